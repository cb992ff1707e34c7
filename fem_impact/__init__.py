"""Strike anything thin with anything, and know how far to trust the answer."""

from importlib import import_module
from typing import Any

# Public names and the module each lives in; loaded at first use, so that the command line answers at once.
_HOME = {
    "SimulationError": "_check",
    "Material": "section",
    "Plate": "section",
    "Beam": "section",
    "Elastic": "section",
    "Contact": "contact",
    "assemble": "assembly",
    "Modes": "modal",
    "find_modes": "modal",
    "rayleigh": "modal",
    "Striker": "striker",
    "Response": "response",
    "Impact": "response",
    "mobility": "spectra",
    "threshold_frequency": "threshold",
    "strike": "integrator",
    "collide": "integrator",
    "Scene": "scene",
    "load_scene": "scene",
    "plan": "scene",
    "Plan": "plans",
    "sweep": "maps",
}
_MODULES = (
    "mesh", "analytic", "spectra", "threshold", "accuracy", "export", "figures", "charts", "sound", "section",
    "contact", "doctor", "maps", "plans", "planner", "atlas", "hammers", "report",
    "explore", "pictures", "drawing",
)  # fmt: skip

__all__ = [*_HOME, *_MODULES, "__version__"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f".{_HOME[name]}", __name__), name)
    if name in _MODULES:
        return import_module(f".{name}", __name__)
    if name == "__version__":
        return import_module("importlib.metadata").version("fem-impact")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
