"""Frequencies of thin flat plates: closed forms, roots of Bessel functions and converged Ritz sums."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import mesh
from ..fe.assembly import assemble
from ..fe.section import Material, Plate
from ..modes.modal import find_modes
from .case import TABLE, Reference, ReferenceLine, of_modes

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
THICKNESS = 2e-3  # [m] any, as the numbers do not depend on it
PLATE = Plate(STEEL, THICKNESS)
SHAPES: dict[str, Callable[[], Any]] = {
    "square": partial(mesh.rectangle, 1.0, 1.0),
    "rectangle": partial(mesh.rectangle, 1.55, 1.0),
    "disk": partial(mesh.disk, 1.0),
    "triangle": partial(mesh.polygon, [(0, 0), (1, 0), (0, 1)]),
}
FORMULAS = {
    "square-hinged": lambda: hinged(1.0, 1.0, 6),
    "rectangle-hinged": lambda: hinged(1.55, 1.0, 8),
    "triangle-hinged": lambda: np.pi**2 * np.array([5.0, 10.0, 13.0]),
}


def hinged(length: float, width: float, n_modes: int) -> np.ndarray:
    """Exact omega sqrt(rho h / D) (n_modes,) [1/m**2] of a hinged rectangle, ascending."""
    m = np.arange(1, n_modes + 1)
    return np.sort(np.pi**2 * ((m[:, None] / length) ** 2 + (m / width) ** 2), axis=None)[:n_modes]


def wanted(name: str) -> ArrayLike:
    """The values omega sqrt(rho h / D) [1/m**2] of a case."""
    return FORMULAS[name]() if name in FORMULAS else TABLE[name]["values"]


def _lines(name: str) -> list[ReferenceLine]:
    shape, held = name.split("-")
    supports = {"free": {}, "cantilever": {"left": "clamped"}}.get(held, {"boundary": held})
    values = np.asarray(wanted(name), dtype=float)
    modes = find_modes(
        assemble(SHAPES[shape](), PLATE, supports), n_modes=len(values) + 3 * (held == "free"), tolerance=1e-6
    )
    rigidity = STEEL.E * THICKNESS**2 / (12.0 * (1.0 - STEEL.nu**2) * STEEL.rho)  # [m**4/s**2] D / (rho h)
    per = 2.0 * np.pi / float(np.sqrt(rigidity))
    return of_modes(modes, values, TABLE[name].get("digit", 0.0), "1/m^2", per)


CASES = tuple(Reference(name, partial(_lines, name)) for name in TABLE if name.split("-")[0] in SHAPES)
