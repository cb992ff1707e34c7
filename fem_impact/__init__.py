"""Strike anything thin with anything, and know how far to trust the answer."""

import logging
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ._base import progress

logging.getLogger(__name__).addHandler(logging.NullHandler())  # silent unless the user listens to "fem_impact"
progress.speak()  # but for what takes long

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
    "impact.history": "Impact",
    "impact.response": "Response",
    "impact.gradient": "Gradient",
    "impact.collision": "Touch collide",
    "impact.spectra": "mobility",
    "impact.threshold": "threshold_frequency",
    "model.planner": "Plan strike",
    "model.playing": "strokes",
    "scenes.scene": "Scene load_scene plan",
    "scenes.results": "load_response",
    "scenes.uncertainty": "spread",
    "sweeps.grid": "sweep",
    "sweeps.borders": "read_borders",
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


if TYPE_CHECKING:  # the same names for type checkers; test_typing.py compares
    from . import mesh as mesh
    from ._base.check import SimulationError as SimulationError
    from ._base.check import ToleranceWarning as ToleranceWarning
    from .designs.search import design as design
    from .fe.assembly import assemble as assemble
    from .fe.section import Beam as Beam
    from .fe.section import Elastic as Elastic
    from .fe.section import Material as Material
    from .fe.section import Plate as Plate
    from .impact import spectra as spectra
    from .impact import threshold as threshold
    from .impact.collision import Touch as Touch
    from .impact.collision import collide as collide
    from .impact.contact import Contact as Contact
    from .impact.gradient import Gradient as Gradient
    from .impact.history import Impact as Impact
    from .impact.response import Response as Response
    from .impact.spectra import mobility as mobility
    from .impact.striker import Hand as Hand
    from .impact.striker import Striker as Striker
    from .impact.threshold import threshold_frequency as threshold_frequency
    from .model.planner import Plan as Plan
    from .model.planner import strike as strike
    from .model.playing import strokes as strokes
    from .modes import analytic as analytic
    from .modes.air import in_air as in_air
    from .modes.modal import Modes as Modes
    from .modes.modal import find_modes as find_modes
    from .modes.modal import rayleigh as rayleigh
    from .modes.ritz import ritz_modes as ritz_modes
    from .pages import explore as explore
    from .pages import report as report
    from .scenes.results import load_response as load_response
    from .scenes.scene import Scene as Scene
    from .scenes.scene import load_scene as load_scene
    from .scenes.scene import plan as plan
    from .scenes.uncertainty import spread as spread
    from .show import export as export
    from .show import figures as figures
    from .show import pictures as pictures
    from .show import sound as sound
    from .sweeps import hammers as hammers
    from .sweeps.borders import read_borders as read_borders
    from .sweeps.grid import sweep as sweep
    from .taps.fit import fit as fit
    from .taps.records import Taps as Taps
    from .taps.records import read_taps as read_taps
    from .taps.rig import measure as measure
    from .taps.roving import plan_test as plan_test
    from .taps.transfer import frf as frf
    from .taps.transfer import mac as mac
    from .taps.transfer import matched as matched
    from .taps.update import update as update

    __version__: str
else:

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
