"""Frequencies of shallow shells."""

import numpy as np

from .. import mesh
from ..fe.assembly import assemble
from ..fe.section import Material, Plate
from ..modes.modal import find_modes
from .case import TABLE, Reference, ReferenceLine, of_modes


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

    def rise(points: np.ndarray) -> np.ndarray:
        return 0.5 * (points - np.array(sides) / 2.0) ** 2 @ np.array(curvature)

    sliding = {"boundary": "sliding"}
    plate = Plate(alloy, thickness)
    system = assemble(mesh.rectangle(*sides), plate, {"boundary": "hinged"}, rise=rise, in_plane=sliding)
    return of_modes(find_modes(system, n_modes=8, tolerance=1e-5), panel(sides, curvature, alloy, thickness, 8))


def _clamped() -> list[ReferenceLine]:
    def rise(points: np.ndarray) -> np.ndarray:
        return -0.5 * (points[:, 1] - 0.0508) ** 2 / 0.762

    plate, about = Plate(Material(E=6.8948e10, nu=0.33, rho=2657.0), 3.302e-4), TABLE["panel-clamped"]
    system = assemble(mesh.rectangle(0.0762, 0.1016), plate, {"boundary": "clamped"}, rise=rise)
    return of_modes(find_modes(system, n_modes=5, tolerance=1e-5), about["values"], about["digit"])


CASES = (Reference("panel-diaphragms", _diaphragms), Reference("panel-clamped", _clamped))
