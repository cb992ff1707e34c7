"""Strike anything thin with anything, and know how far to trust the answer."""

import logging
from importlib import import_module
from typing import Any

logging.getLogger(__name__).addHandler(logging.NullHandler())  # silent unless the user listens to "fem_impact"

# Public names and their modules, imported at first use so that the command line starts quickly.
_NAMES = {
    "_base.check": "SimulationError ToleranceWarning",
    "fe.section": "Material Plate Beam Elastic",
    "fe.assembly": "assemble",
    "modes.modal": "Modes find_modes rayleigh",
    "modes.ritz": "ritz_modes",
    "modes.air": "in_air",
    "impact.contact": "Contact",
    "impact.striker": "Striker Hand",
    "impact.response": "Response Impact",
    "impact.gradient": "Gradient",
    "impact.collision": "Touch collide",
    "impact.spectra": "mobility",
    "impact.threshold": "threshold_frequency",
    "model.planner": "Plan strike",
    "model.playing": "strokes",
    "scenes.scene": "Scene load_scene plan",
    "scenes.uncertainty": "spread",
    "sweeps.grid": "sweep",
    "taps.records": "Taps read_taps",
    "taps.rig": "measure",
    "taps.roving": "plan_test",
    "taps.fit": "fit",
    "taps.transfer": "frf mac matched",
    "taps.update": "update",
    "designs.search": "design",
}
_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}
_MODULES = {
    "mesh": "mesh", "analytic": "modes.analytic", "spectra": "impact.spectra", "threshold": "impact.threshold",
    "figures": "show.figures", "pictures": "show.pictures", "sound": "show.sound", "export": "show.export",
    "hammers": "sweeps.hammers", "report": "pages.report", "explore": "pages.explore",
}  # fmt: skip

__all__ = [*_HOME, *_MODULES, "__version__"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f".{_HOME[name]}", __name__), name)
    if name in _MODULES:
        return import_module(f".{_MODULES[name]}", __name__)
    if name == "__version__":
        return import_module("importlib.metadata").version("fem-impact")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
