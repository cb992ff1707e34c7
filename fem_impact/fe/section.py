"""Materials, plate and beam sections, and elastic supports."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._base import check
from . import plausible

KINDS = ("clamped", "hinged", "free")  # supports of an edge besides `Elastic`
PLANE = ("held", "free", "sliding")  # how an edge is held in the plane of a plate; sliding: along itself only
SOFT = "soft hinged"  # support of a thick plate that leaves the rotation along the edge free
SHEAR = 5.0 / 6.0  # [-] shear coefficient of plates: shear stress is parabolic over the thickness (Reissner 1945)
DIRECTIONS = 36  # [-] directions in which waves in wood are looked at: the softest is then known to a hundredth
# [Pa] mean pressure under the pyramid of 136 degrees for a Vickers number of 1: kgf/mm^2, but of its slanted faces
VICKERS = float(9.80665e6 / np.sin(np.radians(68.0)))
TABOR = 2.8  # [-] mean pressure under a deep dent over the yield strength (Tabor 1951)
Varying = float | Callable[[np.ndarray], Any]


def turned(stiffness: np.ndarray, angle: float) -> np.ndarray:
    """The stiffness (3, 3) on strains (xx, yy, 2 xy) of a material turned anticlockwise by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])
    return turn.T @ stiffness @ turn


def directional(stiffness: np.ndarray) -> np.ndarray:
    """What a stiffness (3, 3) on strains (xx, yy, 2 xy) opposes to a wave in each of DIRECTIONS directions."""
    angle = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    wave = np.stack([np.cos(angle) ** 2, np.sin(angle) ** 2, np.sin(2.0 * angle)])
    return np.asarray(np.einsum("in,ij,jn->n", wave, stiffness, wave))


def yield_strength(hardness: float) -> float:
    """Yield strength [Pa] of a metal from its Vickers hardness number, such as 300 for 300 HV.

    The mean pressure under the pyramid, ``hardness * 9.81 MPa / sin(68 deg)``, over 2.8. It is the stress at a strain
    of some 8 %: first yield of metals that harden no more, above it of those that harden when they are worked.

    References
    ----------
    Tabor (1951), The Hardness of Metals; Johnson (1985), Contact Mechanics, 6.4.

    Examples
    --------
    >>> round(fi.yield_strength(300.0) / 1e6)  # MPa
    1133
    """
    return check.positive("hardness", hardness) * VICKERS / TABOR


@dataclass(frozen=True)
class Material:
    """Linear elastic material; `Material.orthotropic` makes wood and composites.

    Parameters
    ----------
    E : float [Pa]
        Young's modulus; along the grain if orthotropic.
    nu : float [-]
        Poisson's ratio: contraction across the grain divided by stretch along it. If isotropic, above -1 and at most
        0.5.
    rho : float [kg/m^3]
    E_across, G : float [Pa], optional
        Young's modulus across the grain and shear modulus; the material is isotropic without them.
    angle : float [rad]
        Direction of the grain, anticlockwise from the x axis.
    yield_strength : float [Pa], optional
        Stress at which it yields in tension; tells whether a contact dents it (`Response.assumptions`).
    G_xz, G_yz : float [Pa], optional
        Shear moduli of an orthotropic material through the thickness, along and across the grain; only thick plates
        and beams use them, and the estimate of what a thin one lacks. By default both are G.

    Examples
    --------
    >>> steel = fi.Material(E=210e9, nu=0.3, rho=7850.0)
    >>> steel.plane_stress.round(-8).tolist()
    [[230800000000.0, 69200000000.0, 0.0], [69200000000.0, 230800000000.0, 0.0], [0.0, 0.0, 80800000000.0]]
    """

    E: float
    nu: float
    rho: float
    E_across: float | None = None
    G: float | None = None
    angle: float = 0.0
    yield_strength: float | None = None
    G_xz: float | None = None
    G_yz: float | None = None

    def __post_init__(self) -> None:
        nu = check.number("nu", self.nu)
        check.settle(
            self,
            E=check.positive("E", self.E, "Pa"),
            nu=nu,
            rho=check.positive("rho", self.rho, "kg/m^3"),
            angle=check.number("angle", self.angle, "rad"),
        )
        if self.yield_strength is not None:
            check.settle(self, yield_strength=check.positive("yield_strength", self.yield_strength, "Pa"))
        if (self.E_across is None) != (self.G is None):
            raise ValueError("E_across and G must be given together; use Material.orthotropic, or give neither")
        for name in ("G_xz", "G_yz"):
            if getattr(self, name) is not None:
                if self.G is None:
                    raise ValueError(f"{name} needs an orthotropic material; give E_across and G, or leave it out")
                check.settle(self, **{name: check.positive(name, getattr(self, name), "Pa")})
        if self.E_across is None or self.G is None:
            if not -1.0 < nu < 0.5 and nu != 0.5:
                raise ValueError(f"nu must be above -1 and at most 0.5, got {nu:g}")
            return
        check.settle(
            self, E_across=check.positive("E_across", self.E_across, "Pa"), G=check.positive("G", self.G, "Pa")
        )
        if nu**2 * self.E_across >= self.E:
            raise ValueError(
                f"nu must be below sqrt(E/E_across) = {(self.E / self.E_across) ** 0.5:g}, got {nu:g}: "
                "otherwise deforming the material would release energy"
            )

    @classmethod
    def orthotropic(
        cls,
        *,
        E_along: float,
        E_across: float,
        nu: float,
        G: float,
        rho: float,
        angle: float = 0.0,
        yield_strength: float | None = None,
        G_xz: float | None = None,
        G_yz: float | None = None,
    ) -> "Material":
        """Orthotropic material such as tonewood.

        Parameters
        ----------
        E_along, E_across : float [Pa]
            Young's moduli along and across the grain.
        nu : float [-]
            Contraction across the grain divided by stretch along it (nu_LR for wood); nu**2 < E_along / E_across.
        G : float [Pa]
            Shear modulus in the plane of the plate.
        rho : float [kg/m^3]
        angle : float [rad]
            Direction of the grain, anticlockwise from the x axis.
        yield_strength : float [Pa], optional
            Across the thickness.
        G_xz, G_yz : float [Pa], optional
            Shear moduli through the thickness, along and across the grain, for thick plates and beams. By default both
            are G; spruce cut on the quarter has about G_xz = G, but G_yz (rolling shear) only G / 10 or less.

        Examples
        --------
        >>> spruce = fi.Material.orthotropic(E_along=11e9, E_across=0.8e9, nu=0.37, G=0.7e9, rho=430.0, angle=0.1)
        >>> spruce.E_across, spruce.angle
        (800000000.0, 0.1)
        """
        for name, value in (("E_along", E_along), ("E_across", E_across), ("G", G)):
            check.positive(name, value, "Pa")
        return cls(E_along, nu, rho, E_across, G, angle, yield_strength, G_xz, G_yz)

    @property
    def notes(self) -> tuple[str, ...]:
        """Numbers that are allowed but probably a slip of a unit, in plain words."""
        return plausible.material(self)

    @property
    def plane_stress(self) -> np.ndarray:
        """Plane-stress stiffness (3, 3) [Pa] on strains (xx, yy, 2 xy), in the axes of the plate."""
        E, nu = self.E, self.nu
        across = E if self.E_across is None else self.E_across
        G = E / (2.0 * (1.0 + nu)) if self.G is None else self.G
        inner = 1.0 - nu**2 * across / E
        local = np.array([[E, nu * across, 0.0], [nu * across, across, 0.0], [0.0, 0.0, G * inner]]) / inner
        if self.E_across is None:
            return local
        return turned(local, self.angle)

    @property
    def transverse(self) -> tuple[float, float]:
        """Shear moduli [Pa] through the thickness, along and across the grain: as stated, else that in the plane."""
        plain = self.E / (2.0 * (1.0 + self.nu)) if self.G is None else self.G
        return (plain if self.G_xz is None else self.G_xz, plain if self.G_yz is None else self.G_yz)

    @property
    def through(self) -> np.ndarray:
        """Shear stiffness through the thickness (2, 2) [Pa] on shear strains (xz, yz), in the axes of the plate."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        turn = np.array([[c, s], [-s, c]])
        return turn.T @ np.diag(self.transverse) @ turn


def evaluate(name: str, value: Varying, points: np.ndarray, unit: str) -> np.ndarray:
    """Values (n_points,) of a number or function at points (n_points, dimension); raise ValueError if not positive."""
    points = check.array("points", points, (None, None), "m")
    if not callable(value):
        return np.full(len(points), check.positive(name, value, unit))
    field = check.field(name, value, points, unit)
    worst = int(np.argmin(field))
    if field[worst] < 1.0 / check.REACH:
        where = ", ".join(f"{x:g}" for x in points[worst])
        rule = "positive" if field[worst] <= 0.0 else f"at least {1.0 / check.REACH:g} {unit}"
        raise ValueError(f"{name} must be {rule} everywhere, got {field[worst]:g} {unit} at ({where}) m")
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
    layers: tuple[Any, ...] = ()
    rise: Callable[[np.ndarray], Any] | None = None
    ribs: tuple[Any, ...] = ()
    in_plane: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check.instance("material", self.material, Material)
        if not callable(self.thickness):
            check.settle(self, thickness=check.positive("thickness", self.thickness, "m"))
        check.settle(self, tension=check.non_negative("tension", self.tension, "N/m"))
        if self.rise is not None and not callable(self.rise):
            raise ValueError(f"rise must be a function of points, or one of fi.rise, got {check.shown(self.rise)}")

    @property
    def plain(self) -> bool:
        """Whether it is flat, without ribs, and bending does not stretch it: its plane need not be computed."""
        return self.rise is None and not self.ribs

    def walls(self, points: np.ndarray) -> np.ndarray:
        """Stiffness (n_points, 6, 6) on strains xx, yy, 2 xy and changes of curvature: [N/m], [N] and [N m]."""
        thickness = evaluate("thickness", self.thickness, points, "m")[:, None, None]
        result = np.zeros((len(points), 6, 6))
        result[:, :3, :3] = thickness * self.material.plane_stress
        result[:, 3:, 3:] = self.stiffness(points)
        return result

    def stiffness(self, points: np.ndarray) -> np.ndarray:
        """Bending stiffness (n_points, 3, 3) [N m] on curvatures (xx, yy, 2 xy)."""
        thickness = evaluate("thickness", self.thickness, points, "m")
        return (thickness**3 / 12.0)[:, None, None] * self.material.plane_stress

    def inertia(self, points: np.ndarray) -> np.ndarray:
        """Mass per area (n_points,) [kg/m^2]."""
        return self.material.rho * evaluate("thickness", self.thickness, points, "m")

    def shear(self, points: np.ndarray) -> np.ndarray:
        """Shear stiffness (n_points, 2, 2) [N/m] on mean shear strains (xz, yz), for a thick plate."""
        return SHEAR * evaluate("thickness", self.thickness, points, "m")[:, None, None] * self.material.through

    def rotary(self, points: np.ndarray) -> np.ndarray:
        """Rotary inertia per area (n_points,) [kg], for a thick plate."""
        return self.material.rho * evaluate("thickness", self.thickness, points, "m") ** 3 / 12.0


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
        height = evaluate("height", self.height, points, "m")
        width = evaluate("width", self.width, points, "m")
        return self.material.E * width * height**3 * (np.pi / 64.0 if self.round else 1.0 / 12.0)

    def inertia(self, points: np.ndarray) -> np.ndarray:
        """Mass per length (n_points,) [kg/m]."""
        return self.material.rho * self._area(points)

    def _area(self, points: np.ndarray) -> np.ndarray:
        area = evaluate("height", self.height, points, "m") * evaluate("width", self.width, points, "m")
        return area * (np.pi / 4.0 if self.round else 1.0)

    @property
    def shear_coefficient(self) -> float:
        """Share [-] of the section that carries shear in a Timoshenko beam.

        References
        ----------
        Cowper (1966), J. Appl. Mech. 33, 335-340; for isotropic materials. Wood gets that of nu = 0, 5/6 or 6/7.
        """
        nu = self.material.nu if self.material.E_across is None else 0.0
        return 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu) if self.round else 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu)

    def shear(self, points: np.ndarray) -> np.ndarray:
        """Shear stiffness (n_points,) [N] on the mean shear strain, for a Timoshenko beam."""
        return self.shear_coefficient * self.material.transverse[0] * self._area(points)

    def rotary(self, points: np.ndarray) -> np.ndarray:
        """Rotary inertia per length (n_points,) [kg m], for a Timoshenko beam."""
        return self.material.rho / self.material.E * self.stiffness(points)
