"""Checks the installation with small problems of known answer; each failed check comes with a remedy."""

import importlib.util
import pickle
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from . import mesh
from ._base import progress
from ._base.check import EXTRAS
from ._base.files import scratch_folder
from .fe.assembly import assemble
from .fe.section import Material, Plate
from .impact.collision import strike
from .impact.contact import Contact
from .impact.response import Response
from .impact.striker import Striker
from .model import cost
from .modes import analytic
from .modes.finding import find_modes
from .modes.modal import Modes
from .show import export, figures, pictures
from .sweeps.grid import sweep

UNKEPT = "make the folder of the compiled kernels writable; else costs are predicted for another machine"


@dataclass(frozen=True)
class Finding:
    """The result of one check."""

    name: str
    works: bool
    seconds: float  # [s]
    remedy: str  # empty if it works
    vital: bool = True  # whether the command line needs it


def examine() -> list[Finding]:
    """Check everything a strike needs, and the optional 3-D rendering and extras; takes a few seconds."""
    checks: list[Callable[[], Finding]] = [
        partial(_tried, "finite elements", _finite_elements, "reinstall scikit-fem: it fails or gives wrong numbers"),
        partial(_tried, "compiled kernels", _kernels, "reinstall numba; NUMBA_DISABLE_JIT=1 runs without it, slowly"),
        partial(_tried, "predicted cost", cost.calibrate, UNKEPT, vital=False),
        partial(_tried, "pictures", _picture, "reinstall matplotlib"),
        partial(_tried, "mode shapes as files", _vtk, "make the folder for temporary files writable"),
        partial(_tried, "3-D rendering", pictures.can_render, pictures.REMEDY, vital=False),
    ]
    found: list[Finding] = []
    for each in checks:
        progress.report("checks", len(found), len(checks))
        found.append(each())
    return found + [_extra(name, purpose, modules) for name, (purpose, *modules) in EXTRAS.items()]


def _tried(name: str, check: Callable[[], bool], remedy: str, vital: bool = True) -> Finding:
    start = time.perf_counter()
    reason = ""
    try:
        works = check()
    except (ArithmeticError, ImportError, LookupError, OSError, RuntimeError, TypeError, ValueError) as error:
        works, reason = False, f" ({type(error).__name__}: {error})"
    return Finding(name, works, time.perf_counter() - start, "" if works else remedy + reason, vital)


def _extra(name: str, purpose: str, modules: list[str]) -> Finding:
    """Check whether an optional extra is installed, without importing it."""
    missing = [module for module in modules if importlib.util.find_spec(module) is None]
    remedy = f"pip install 'fem-impact[{name}]' ({', '.join(missing)})" if missing else ""
    return Finding(purpose, not missing, 0.0, remedy, vital=False)


def _finite_elements() -> bool:
    plate = Plate(Material(E=12.0 * (1.0 - 0.09), nu=0.3, rho=1.0), 1.0)
    modes = find_modes(assemble(mesh.rectangle(1.0, 1.0), plate, supports={"boundary": "hinged"}), n_modes=1)
    return bool(abs(modes.omega[0] / (2.0 * np.pi**2) - 1.0) < 1e-4)  # unit stiffness and mass


def _blow() -> Response:
    return strike(Modes.rigid(1.0), Striker.rigid(1.0), Contact.linear(1e5), at=None, speed=1.0)


def _kernels() -> bool:
    hit = _blow()
    speed = hit.speeds[0]  # [m/s] equal masses exchange their speeds
    return abs(speed) < 1e-9 and hit.n_impacts == 1


def compile_kernels() -> int:
    """Compile what the first blow of a kind lacks and what is asked of it, and then what a map needs, as a process.

    Its argument is the mark of `model.fresh`.
    """
    mark = Path(sys.argv[1])
    try:
        module, name, types = pickle.loads(mark.read_bytes())
        getattr(import_module(module), name).compile(types)
        hit = _blow()
        hit.modal_state(np.zeros(1))
        hit.summary()
    finally:
        mark.unlink(missing_ok=True)
    compile_map()
    return 0


def compile_map() -> None:
    """Make a map of two blows."""
    body = analytic.rectangle(1.0, 0.7, mass=1.0, first_frequency=100.0, n_modes=20)
    how: dict[str, Any] = {"at": (0.3, 0.3), "speed": 1.0, "tolerance": 1e-2, "over": {"mass": [0.02, 0.03]}}
    sweep(body, Striker.rigid(0.02), Contact.linear(1e5), **how)


def _picture() -> bool:
    with scratch_folder() as folder:
        figures.save(folder / "picture.png", figures.force(_blow()))
        return (folder / "picture.png").stat().st_size > 1000


def _vtk() -> bool:
    with scratch_folder() as folder:
        export.write_vtk(folder / "rigid.vtu", Modes.rigid(1.0))
        return bool(list(folder.iterdir()))
