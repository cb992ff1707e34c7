"""Sections of plates and beams, and elastic supports."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._base import check
from .._base.rounding import SAME
from . import layers as layering
from .layers import SHEAR
from .material import Material

KINDS = ("clamped", "hinged", "free")  # supports of an edge besides `Elastic`
# how an edge is held in the plane of a plate: sliding only along itself, across only across itself
PLANE = ("held", "free", "sliding", "across")
SOFT = "soft hinged"  # support of a thick plate that leaves the rotation along the edge free
Varying = float | Callable[[np.ndarray], Any]


def size_at(section: Any, name: str, points: np.ndarray) -> np.ndarray:
    """A size (n_points,) [m] of a section, a number or a function, at points; raise ValueError if not positive."""
    points, value = check.array("points", points, (None, None), "m"), getattr(section, name)
    if not callable(value):
        return np.full(len(points), check.positive(name, value, "m"))
    field = check.field(name, value, points, "m")
    worst = int(np.argmin(field))
    if field[worst] < 1.0 / check.REACH:
        where = ", ".join(f"{x:g}" for x in points[worst])
        rule = "positive" if field[worst] <= 0.0 else f"at least {1.0 / check.REACH:g} m"
        raise ValueError(f"{name} must be {rule} everywhere, got {field[worst]:g} m at ({where}) m")
    return field


@dataclass(frozen=True, eq=False)
class Plate:
    """Thin (Kirchhoff) plate.

    Parameters
    ----------
    material : Material
    thickness : float or function of points (n_points, 2) returning (n_points,) [m]
    tension : float [N/m]
        Uniform in-plane tension, as in a drumhead; the whole edge must be supported.
    layers : tuple of Layer
        Made by `Plate.laminate`.
    rise, ribs, in_plane
        As in `assemble`.

    Examples
    --------
    >>> plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    >>> plate.inertia(np.zeros((1, 2))).tolist()  # kg/m^2
    [1.35]
    """

    material: Material
    thickness: Varying
    tension: float = 0.0
    layers: tuple[layering.Layer, ...] = ()
    rise: Callable[[np.ndarray], Any] | None = None
    ribs: tuple[Any, ...] = ()
    in_plane: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check.instance("material", self.material, Material)
        if not callable(self.thickness):
            check.settle(self, thickness=check.positive("thickness", self.thickness, "m"))
        check.settle(self, tension=check.non_negative("tension", self.tension, "N/m"))
        bare = isinstance(self.layers, Sequence) and not len(self.layers)
        layers = () if bare else check.tuple_of("layers", self.layers, layering.Layer)
        if layers and self.material != layering.merge_layers(layers):
            raise ValueError("material must be that of the layers; make a plate of layers by Plate.laminate")
        if layers and self.thickness != sum(layer.thickness for layer in layers):
            raise ValueError("thickness must be that of the layers; make a plate of layers by Plate.laminate")
        if self.rise is not None and not callable(self.rise):
            raise ValueError(f"rise must be a function of points, or one of fi.rise, got {check.shown(self.rise)}")
        if not isinstance(self.ribs, Sequence) or not all(hasattr(rib, "rigidity") for rib in self.ribs):
            raise ValueError(f"ribs must be a list of fi.Rib, got {check.shown(self.ribs)}")
        if not isinstance(self.in_plane, Mapping):
            raise ValueError(f"in_plane must be a dict of edge name -> word, got {check.shown(self.in_plane)}")
        for edge, word in self.in_plane.items():
            check.one_of(f"in_plane[{edge!r}]", word, PLANE)
        check.settle(self, layers=layers, ribs=tuple(self.ribs), in_plane=dict(self.in_plane))

    @classmethod
    def laminate(cls, layers: Sequence[tuple[Material, float, float]], *, tension: float = 0.0) -> "Plate":
        """Plate of layers glued to each other: plywood, carbon, a sandwich, laminated glass with a stiff interlayer.

        Parameters
        ----------
        layers : sequence of (material, thickness [m], angle [rad])
            From the struck side; the angle turns the grain anticlockwise, besides that of the material.
        tension : float [N/m]

        Where the layers are not symmetric, bending stretches the plate; `assemble` then computes its plane, too. The
        softest shear, as of a sandwich's core, counts with ``theory="mindlin"``. An interlayer so soft that the panes
        slide on each other would need a displacement of each pane.

        Examples
        --------
        >>> birch = fi.Material.orthotropic(E_along=13e9, E_across=0.7e9, nu=0.4, G=0.8e9, rho=640.0)
        >>> plywood = fi.Plate.laminate([(birch, 1e-3, 0.0), (birch, 1e-3, np.pi / 2), (birch, 1e-3, 0.0)])
        >>> round(plywood.thickness, 6), plywood.stiffness(np.zeros((1, 2)))[0].diagonal().round(2).tolist()
        (0.003, [28.47, 2.62, 1.8])
        """
        found = layering.checked_layers(layers)
        return cls(layering.merge_layers(found), sum(layer.thickness for layer in found), tension, found)

    @property
    def uniform(self) -> bool:
        """Whether it is plain, of one material and the same everywhere, as formulas of plates ask."""
        return self.plain and not self.layers and not callable(self.thickness)

    @property
    def plain(self) -> bool:
        """Whether it is flat, without ribs, and bending does not stretch it: its plane need not be computed."""
        return self.rise is None and not self.ribs and not self.coupled

    @property
    def coupled(self) -> bool:
        """Whether it is layered so that bending stretches it."""
        if not self.layers:
            return False
        walls = layering.moments(self.layers)
        size = np.sqrt(np.abs(walls[:3, :3]).max() * np.abs(walls[3:, 3:]).max())
        return bool(np.abs(walls[:3, 3:]).max() > SAME * size)

    def walls(self, points: np.ndarray) -> np.ndarray:
        """Stiffness (n_points, 6, 6) on strains xx, yy, 2 xy and negative curvatures: [N/m], [N] and [N m]."""
        if self.layers:
            return np.broadcast_to(layering.moments(self.layers), (len(points), 6, 6))
        thickness = size_at(self, "thickness", points)[:, None, None]
        result = np.zeros((len(points), 6, 6))
        result[:, :3, :3] = thickness * self.material.plane_stress
        result[:, 3:, 3:] = self.stiffness(points)
        return result

    @property
    def stretched(self) -> np.ndarray:
        """Mean stiffness (3, 3) [Pa] on strains xx, yy, 2 xy of the plane."""
        if self.layers:
            return np.asarray(layering.moments(self.layers)[:3, :3] / self.thickness)
        return self.material.plane_stress

    def stiffness(self, points: np.ndarray) -> np.ndarray:
        """Bending stiffness (n_points, 3, 3) [N m] on curvatures (xx, yy, 2 xy)."""
        thickness = size_at(self, "thickness", points)
        return (thickness**3 / 12.0)[:, None, None] * self.material.plane_stress

    def inertia(self, points: np.ndarray) -> np.ndarray:
        """Mass per area (n_points,) [kg/m^2]."""
        return self.material.rho * size_at(self, "thickness", points)

    def shear(self, points: np.ndarray) -> np.ndarray:
        """Shear stiffness (n_points, 2, 2) [N/m] on mean shear strains (xz, yz), for a thick plate."""
        return SHEAR * size_at(self, "thickness", points)[:, None, None] * self.material.through

    def rotary(self, points: np.ndarray) -> np.ndarray:
        """Rotary inertia per area (n_points,) [kg], for a thick plate."""
        if self.layers:
            each = [rho * h * (z**2 + h**2 / 12.0) for (rho, h, z) in ((m.rho, h, z) for m, h, z in self.layers)]
            return np.full(len(points), sum(each))
        return self.material.rho * size_at(self, "thickness", points) ** 3 / 12.0


@dataclass(frozen=True)
class Elastic:
    """Elastic support of an edge: springs against deflection and optionally against rotation.

    Parameters
    ----------
    stiffness : float
        Force per deflection and length of a plate's edge [N/m^2]; force per deflection at a beam's end [N/m].
    rotation : float
        Moment per angle and length of a plate's edge [N]; moment per angle at a beam's end [N m].

    Examples
    --------
    >>> rod = fi.Beam.circular(fi.Material(E=10e9, nu=0.3, rho=700.0), diameter=0.01)
    >>> system = fi.assemble(fi.mesh.line(0.4), rod, {"left": fi.Elastic(1e4), "right": fi.Elastic(1e4)})
    >>> fi.find_modes(system, n_modes=2).frequencies.round(2).tolist()
    [80.74, 225.45]
    """

    stiffness: float
    rotation: float = 0.0

    def __post_init__(self) -> None:
        check.settle(
            self,
            stiffness=check.non_negative("stiffness", self.stiffness, "N/m^2"),
            rotation=check.non_negative("rotation", self.rotation, "N"),
        )


@dataclass(frozen=True, eq=False)
class Beam:
    """Slender (Euler-Bernoulli) beam; make it with `Beam.rectangular` or `Beam.circular`.

    Parameters
    ----------
    material : Material
    width : float or function of points (n_points, 1) [m]
        Perpendicular to the blow.
    height : float or function of points [m]
        In the direction of the blow.
    round : bool
        Whether the section is round; width and height are then both the diameter.
    """

    material: Material
    width: Varying
    height: Varying
    round: bool = False

    def __post_init__(self) -> None:
        check.instance("material", self.material, Material)
        check.flag("round", self.round)
        for name, value in (("width", self.width), ("height", self.height)):
            if not callable(value):
                check.settle(self, **{name: check.positive(name, value, "m")})

    @classmethod
    def rectangular(cls, material: Material, *, width: Varying, height: Varying) -> "Beam":
        """Beam of rectangular section; the blow acts along its height.

        Examples
        --------
        >>> bar = fi.Beam.rectangular(fi.Material(E=70e9, nu=0.33, rho=2700.0), width=0.03, height=0.01)
        >>> round(float(bar.stiffness(np.zeros((1, 1)))[0]), 6)  # N m^2
        175.0
        """
        return cls(material, width, height)

    @classmethod
    def circular(cls, material: Material, *, diameter: Varying) -> "Beam":
        """Beam of circular section.

        Examples
        --------
        >>> rod = fi.Beam.circular(fi.Material(E=10e9, nu=0.3, rho=700.0), diameter=0.015)
        >>> round(float(rod.inertia(np.zeros((1, 1)))[0]), 6)  # kg/m
        0.1237
        """
        if not callable(diameter):
            check.positive("diameter", diameter, "m")
        return cls(material, diameter, diameter, round=True)

    def stiffness(self, points: np.ndarray) -> np.ndarray:
        """Bending stiffness E I, (n_points,) [N m^2]."""
        height = size_at(self, "height", points)
        width = size_at(self, "width", points)
        return self.material.E * width * height**3 * (np.pi / 64.0 if self.round else 1.0 / 12.0)

    def inertia(self, points: np.ndarray) -> np.ndarray:
        """Mass per length (n_points,) [kg/m]."""
        area = size_at(self, "height", points) * size_at(self, "width", points)
        return self.material.rho * (area * (np.pi / 4.0 if self.round else 1.0))

    @property
    def shear_coefficient(self) -> float:
        """Share [-] of the section that carries shear in a Timoshenko beam.

        References
        ----------
        Cowper (1966), J. Appl. Mech. 33, 335-340; for isotropic materials. Wood gets that of nu = 0, 5/6 or 6/7.
        """
        nu = self.material.nu if self.material.E_across is None else 0.0
        return 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu) if self.round else 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu)

    def torsion(self, points: np.ndarray) -> np.ndarray:
        """Torsional stiffness (n_points,) [N m^2] by Saint-Venant, for a rib."""
        height, width = (size_at(self, name, points) for name in ("height", "width"))
        shear = self.material.transverse[0]
        if self.round:
            return shear * np.pi / 32.0 * height**4
        thin, n = np.minimum(height, width), np.arange(1, 16, 2)[:, None]  # the ninth term is 1e-6 of the first
        ratio = np.maximum(height, width) / thin
        missing = (np.tanh(0.5 * n * np.pi * ratio) / n**5).sum(axis=0) / ratio
        return shear * thin**4 * ratio * (1.0 / 3.0 - 64.0 / np.pi**5 * missing)

    def shear(self, points: np.ndarray) -> np.ndarray:
        """Shear stiffness (n_points,) [N] on the mean shear strain, for a Timoshenko beam."""
        return self.shear_coefficient * self.material.transverse[0] / self.material.rho * self.inertia(points)

    def rotary(self, points: np.ndarray) -> np.ndarray:
        """Rotary inertia per length (n_points,) [kg m], for a Timoshenko beam."""
        return self.material.rho / self.material.E * self.stiffness(points)
