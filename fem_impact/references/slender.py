"""Frequencies of slender beams: roots of their frequency equations."""

from functools import partial

import numpy as np
from scipy.optimize import brentq

from .. import mesh
from ..fe.assembly import assemble
from ..fe.section import Beam, Material
from ..modes.modal import find_modes
from .case import Reference, ReferenceLine, of_modes

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
EQUATIONS = {  # of z = k length by supports, and the half wave that holds the first root
    "hinged-hinged": (np.sin, 0.5),
    "clamped-free": (lambda z: np.cos(z) + 1.0 / np.cosh(z), 0.0),
    "free-free": (lambda z: np.cos(z) - 1.0 / np.cosh(z), 1.0),
    "hinged-free": (lambda z: np.sin(z) - np.cos(z) * np.tanh(z), 1.0),
    "hinged-clamped": (lambda z: np.sin(z) - np.cos(z) * np.tanh(z), 1.0),
}


def roots(ends: str, n_modes: int) -> np.ndarray:
    """The roots k length (n_modes,) of the frequency equation of a beam, such as "clamped-free"."""
    equation, first = EQUATIONS[ends]
    starts = np.pi * (first + np.arange(n_modes))
    return np.array([brentq(equation, start, start + np.pi, xtol=1e-14, rtol=1e-15) for start in starts])


def _lines(ends: str, n_modes: int = 6) -> list[ReferenceLine]:
    beam = Beam.rectangular(STEEL, width=0.02, height=0.01)
    held = {side: how for side, how in zip(("left", "right"), ends.split("-")) if how != "free"}
    n_rigid = {"free-free": 2, "hinged-free": 1}.get(ends, 0)
    modes = find_modes(assemble(mesh.line(1.0), beam, held), n_modes=n_modes + n_rigid, tolerance=1e-8)
    per = 2.0 * np.pi * float(np.sqrt(12.0 * STEEL.rho / STEEL.E)) / 0.01  # 2 pi sqrt(rho A / (E I)) at 1 m
    return of_modes(modes, roots(ends, n_modes) ** 2, unit="k^2", per=per)


CASES = tuple(Reference(f"beam-{ends}", partial(_lines, ends)) for ends in EQUATIONS)
