"""Frequencies of beams, flat plates and shallow shells: closed forms, roots of equations, converged Ritz sums."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from .. import mesh
from ..fe.assembly import assemble
from ..fe.section import Beam, Material, Plate
from ..modes.finding import find_modes
from .case import TABLE, Reference, ReferenceLine, of_modes

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
PLATE = Plate(STEEL, 2e-3)  # any thickness, as the numbers do not depend on it
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
EQUATIONS = {  # of z = k length by supports, and the half wave that holds the first root
    "hinged-hinged": (np.sin, 0.5),
    "clamped-free": (lambda z: np.cos(z) + 1.0 / np.cosh(z), 0.0),
    "free-free": (lambda z: np.cos(z) - 1.0 / np.cosh(z), 1.0),
    "hinged-free": (lambda z: np.sin(z) - np.cos(z) * np.tanh(z), 1.0),
    "hinged-clamped": (lambda z: np.sin(z) - np.cos(z) * np.tanh(z), 1.0),
}


def hinged(length: float, width: float, n_modes: int) -> np.ndarray:
    """Exact omega sqrt(rho h / D) (n_modes,) [1/m**2] of a hinged rectangle, ascending."""
    m = np.arange(1, n_modes + 1)
    return np.sort(np.pi**2 * ((m[:, None] / length) ** 2 + (m / width) ** 2), axis=None)[:n_modes]


def _of_plate(name: str) -> list[ReferenceLine]:
    shape, held = name.split("-")
    supports = {"free": {}, "cantilever": {"left": "clamped"}}.get(held, {"boundary": held})
    wanted: ArrayLike = FORMULAS[name]() if name in FORMULAS else TABLE[name]["values"]
    values = np.asarray(wanted, dtype=float)  # omega sqrt(rho h / D) [1/m**2]
    modes = find_modes(
        assemble(SHAPES[shape](), PLATE, supports), n_modes=len(values) + 3 * (held == "free"), tolerance=1e-6
    )
    rigidity = STEEL.E * 2e-3**2 / (12.0 * (1.0 - STEEL.nu**2) * STEEL.rho)  # [m**4/s**2] D / (rho h)
    per = 2.0 * np.pi / float(np.sqrt(rigidity))
    return of_modes(modes, values, TABLE[name].get("digit", 0.0), "1/m^2", per)


def _of_beam(ends: str, n_modes: int = 6) -> list[ReferenceLine]:
    """Roots k length of the frequency equation of a beam, such as "clamped-free"."""
    equation, first = EQUATIONS[ends]
    starts = np.pi * (first + np.arange(n_modes))
    roots = np.array([brentq(equation, start, start + np.pi, xtol=1e-14, rtol=1e-15) for start in starts])
    beam = Beam.rectangular(STEEL, width=0.02, height=0.01)
    held = {side: how for side, how in zip(("left", "right"), ends.split("-")) if how != "free"}
    n_rigid = {"free-free": 2, "hinged-free": 1}.get(ends, 0)
    modes = find_modes(assemble(mesh.line(1.0), beam, held), n_modes=n_modes + n_rigid, tolerance=1e-8)
    per = 2.0 * np.pi * float(np.sqrt(12.0 * STEEL.rho / STEEL.E)) / 0.01  # 2 pi sqrt(rho A / (E I)) at 1 m
    return of_modes(modes, roots**2, unit="k^2", per=per)


def panel(
    sides: tuple[float, float], curvature: tuple[float, float], material: Material, h: float, n_modes: int
) -> np.ndarray:
    """Frequencies (n_modes,) [Hz] of a panel on shear diaphragms, of Donnell, Mushtari and Vlasov's theory."""
    E, nu, rho = material.E, material.nu, material.rho
    m = np.arange(1, 30)
    kx, ky = (np.pi * x for x in np.meshgrid(m / sides[0], m / sides[1]))
    square = kx**2 + ky**2
    bending = E * h**3 / (12.0 * (1.0 - nu**2)) * square**2
    stretching = E * h * (curvature[0] * ky**2 + curvature[1] * kx**2) ** 2 / square**2
    return np.sort(np.sqrt((bending + stretching) / (rho * h)), axis=None)[:n_modes] / (2.0 * np.pi)


def _diaphragms() -> list[ReferenceLine]:
    sides, curvature, thickness = (0.4, 0.3), (-0.3, 0.1), 2e-3
    alloy = Material(E=70e9, nu=0.3, rho=2700.0)

    system = assemble(
        mesh.rectangle(*sides), Plate(alloy, thickness), {"boundary": "hinged"}, in_plane={"boundary": "sliding"},
        rise=lambda points: 0.5 * (points - np.array(sides) / 2.0) ** 2 @ np.array(curvature),
    )  # fmt: skip
    return of_modes(find_modes(system, n_modes=8, tolerance=1e-5), panel(sides, curvature, alloy, thickness, 8))


def _clamped() -> list[ReferenceLine]:
    plate, about = Plate(Material(E=6.8948e10, nu=0.33, rho=2657.0), 3.302e-4), TABLE["panel-clamped"]
    system = assemble(
        mesh.rectangle(0.0762, 0.1016), plate, {"boundary": "clamped"},
        rise=lambda points: -0.5 * (points[:, 1] - 0.0508) ** 2 / 0.762,
    )  # fmt: skip
    return of_modes(find_modes(system, n_modes=5, tolerance=1e-5), about["values"], about["digit"])


CASES = (
    *(Reference(name, partial(_of_plate, name)) for name in TABLE if name.split("-")[0] in SHAPES),
    *(Reference(f"beam-{ends}", partial(_of_beam, ends)) for ends in EQUATIONS),
    Reference("panel-diaphragms", _diaphragms),
    Reference("panel-clamped", _clamped),
)
