"""Layers of a plate: plywood, carbon, sandwiches, laminated glass."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from .._base import check
from .._base.remembered import gauss_rule
from .material import Material

SHEAR = 5.0 / 6.0  # [-] shear coefficient of plates: shear stress is parabolic over the thickness (Reissner 1945)


class Layer(NamedTuple):
    """A layer of a plate."""

    material: Material
    thickness: float  # [m]
    middle: float  # [m] its height over the middle of the plate, towards the striker


@dataclass(frozen=True)
class Laminated(Material):
    """What the layers of a plate are together when it bends; made by `Plate.laminate`."""

    bending: tuple[tuple[float, ...], ...] = ()  # (3, 3) [Pa]

    @property
    def plane_stress(self) -> np.ndarray:
        return np.array(self.bending)


def moments(layers: Sequence[Layer]) -> np.ndarray:
    """Moments (6, 6) of the stiffness of layers: on strains, and on both and negative curvatures."""
    result = np.zeros((6, 6))
    for material, thickness, z in layers:
        powers = np.array([[1.0, z], [z, z**2 + thickness**2 / 12.0]])
        result += np.kron(powers, thickness * material.plane_stress)
    return result


def layered_shear_stiffness(layers: Sequence[Layer], i: int) -> float:
    """Shear stiffness [N/m] of layers along x (i = 0) or y (1), from the shear stress that bending along it needs.

    The stress is in equilibrium with the bending stress at each height, about the neutral axis.
    """
    stretch, soft = (np.array([f(each) for each in layers]) for f in (
        lambda layer: layer.material.plane_stress[i, i], lambda layer: 1.0 / layer.material.through[i, i],
    ))  # fmt: skip
    h, z = (np.array([getattr(layer, name) for layer in layers]) for name in ("thickness", "middle"))
    z = z - (stretch * h) @ z / (stretch @ h)
    rigidity = (stretch * h) @ (z**2 + h**2 / 12.0)
    x, dx = gauss_rule(3)  # exact: the square of a quadratic
    s = h[:, None] * x  # below the top of each layer
    above = np.concatenate([[0.0], np.cumsum(stretch * h * z)[:-1]])
    moment = above[:, None] + stretch[:, None] * s * ((z + 0.5 * h)[:, None] - 0.5 * s)
    return float(rigidity**2 / ((soft * h) @ (moment**2 @ dx)))


def checked_layers(layers: Any) -> tuple[Layer, ...]:
    """Checked layers from (material, thickness [m], angle [rad]), the first on the struck side."""
    if not isinstance(layers, Sequence) or not layers:
        raise ValueError(f"layers must be a list of (material, thickness, angle), got {check.shown(layers)}")
    found: list[Layer] = []
    for i, layer in enumerate(layers):
        if not isinstance(layer, Sequence) or len(layer) != 3:
            raise ValueError(f"layers[{i}] must be (material, thickness in m, angle in rad), got {check.shown(layer)}")
        material, thickness, angle = layer
        check.instance(f"material of layers[{i}]", material, Material)
        angle = material.angle + check.number(f"angle of layers[{i}]", angle, "rad")
        thickness = check.positive(f"thickness of layers[{i}]", thickness, "m")
        above = sum(each.thickness for each in found)
        found.append(Layer(replace(material, angle=angle), thickness, -above - 0.5 * thickness))
    middle = 0.5 * sum(layer.thickness for layer in found)
    return tuple(layer._replace(middle=layer.middle + middle) for layer in found)


def merge_layers(layers: Sequence[Layer]) -> Laminated:
    """The material of a uniform plate that bends and shears as the layers do."""
    whole = sum(layer.thickness for layer in layers)
    bending = 12.0 / whole**3 * moments(layers)[3:, 3:]
    soft = np.linalg.inv(bending)
    shear = [layered_shear_stiffness(layers, i) / (SHEAR * whole) for i in range(2)]
    return Laminated(
        E=1.0 / soft[0, 0], nu=-soft[0, 1] / soft[0, 0], E_across=1.0 / soft[1, 1], G=1.0 / soft[2, 2],
        rho=sum(each.material.rho * each.thickness for each in layers) / whole, G_xz=shear[0], G_yz=shear[1],
        yield_strength=layers[0].material.yield_strength, bending=tuple(tuple(row) for row in bending.tolist()),
    )  # fmt: skip
