"""Strike anything thin with anything, and know how far to trust the answer."""

from importlib import import_module
from typing import Any

# Public names and their modules, imported at first use so that the command line starts quickly.
_HOME = {
    "SimulationError": "_base.check",
    "Material": "fe.section",
    "Plate": "fe.section",
    "Beam": "fe.section",
    "Elastic": "fe.section",
    "Contact": "impact.contact",
    "assemble": "fe.assembly",
    "Modes": "modes.modal",
    "find_modes": "modes.modal",
    "rayleigh": "modes.modal",
    "Striker": "impact.striker",
    "Response": "impact.response",
    "Impact": "impact.response",
    "Touch": "impact.collision",
    "mobility": "impact.spectra",
    "threshold_frequency": "impact.threshold",
    "strike": "model.planner",
    "collide": "impact.collision",
    "Scene": "scenes.scene",
    "load_scene": "scenes.scene",
    "plan": "scenes.scene",
    "Plan": "model.planner",
    "sweep": "sweeps.grid",
}
_MODULES = {
    "mesh": "mesh",
    "analytic": "modes.analytic",
    "spectra": "impact.spectra",
    "threshold": "impact.threshold",
    "figures": "show.figures",
    "pictures": "show.pictures",
    "sound": "show.sound",
    "export": "show.export",
    "hammers": "sweeps.hammers",
    "report": "pages.report",
    "explore": "pages.explore",
}

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
