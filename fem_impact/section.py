"""What a body is made of across its thickness: material, plate and beam sections."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _check

Varying = float | Callable[[np.ndarray], Any]


@dataclass(frozen=True)
class Material:
    """Linear elastic material; `Material.orthotropic` makes wood and composites.

    Parameters
    ----------
    E : float [Pa]
        Young's modulus (along the grain where orthotropic).
    nu : float [-]
        Poisson's ratio: contraction across the grain over stretch along it. Above -1 and below 0.5 if isotropic.
    rho : float [kg/m^3]
    E_across, G : float [Pa], optional
        Young's modulus across the grain and shear modulus; isotropic where left out.
    angle : float [rad]
        Direction of the grain, anticlockwise from the x axis.
    """

    E: float
    nu: float
    rho: float
    E_across: float | None = None
    G: float | None = None
    angle: float = 0.0

    def __post_init__(self) -> None:
        _check.positive("E", self.E, "Pa")
        _check.positive("rho", self.rho, "kg/m^3")
        _check.number("angle", self.angle, "rad")
        nu = _check.number("nu", self.nu)
        if (self.E_across is None) != (self.G is None):
            raise ValueError("E_across and G go together; use Material.orthotropic, or give neither")
        if self.E_across is None or self.G is None:
            if not -1.0 < nu < 0.5 and nu != 0.5:
                raise ValueError(f"nu must lie above -1 and at most at 0.5, got {nu:g}")
            return
        _check.positive("E_across", self.E_across, "Pa")
        _check.positive("G", self.G, "Pa")
        if nu**2 * self.E_across >= self.E:
            raise ValueError(
                f"nu must stay below sqrt(E/E_across) = {(self.E / self.E_across) ** 0.5:g}, got {nu:g}: "
                "the material would gain energy by deforming"
            )

    @classmethod
    def orthotropic(cls, *, E_along, E_across, nu, G, rho, angle=0.0) -> "Material":
        """Orthotropic material such as tonewood.

        Parameters
        ----------
        E_along, E_across : float [Pa]
            Young's moduli along and across the grain.
        nu : float [-]
            Contraction across the grain over stretch along it (often called nu_LR); nu**2 < E_along / E_across.
        G : float [Pa]
            Shear modulus in the plane of the plate.
        rho : float [kg/m^3]
        angle : float [rad]
            Direction of the grain, anticlockwise from the x axis.
        """
        for name, value in (("E_along", E_along), ("E_across", E_across), ("G", G)):
            _check.positive(name, value, "Pa")
        return cls(E_along, nu, rho, E_across, G, angle)

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
        c, s = np.cos(self.angle), np.sin(self.angle)
        turn = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])
        return turn.T @ local @ turn


def evaluate(name: str, value: Varying, points: np.ndarray, unit: str) -> np.ndarray:
    """Return a positive field at points (n_points, dimension), (n_points,): from a number or a function of points."""
    points = _check.array("points", points, (None, None), "m")
    if not callable(value):
        return np.full(len(points), _check.positive(name, value, unit))
    field = _check.field(name, value, points, unit)
    worst = int(np.argmin(field))
    if field[worst] <= 0.0:
        where = ", ".join(f"{x:g}" for x in points[worst])
        raise ValueError(f"{name} must be positive everywhere, got {field[worst]:g} {unit} at ({where}) m")
    return field


@dataclass(frozen=True, eq=False)
class Plate:
    """Thin (Kirchhoff) plate.

    Parameters
    ----------
    material : Material
    thickness : float or function of points (n_points, 2) returning (n_points,) [m]
    tension : float [N/m]
        Uniform pull in the plane, as on a drumhead; needs an edge supported all round.
    """

    material: Material
    thickness: Varying
    tension: float = 0.0

    def __post_init__(self) -> None:
        _check.instance("material", self.material, Material)
        if not callable(self.thickness):
            _check.positive("thickness", self.thickness, "m")
        _check.non_negative("tension", self.tension, "N/m")

    def stiffness(self, points: np.ndarray) -> np.ndarray:
        """Bending stiffness (n_points, 3, 3) [N m] on curvatures (xx, yy, 2 xy)."""
        thickness = evaluate("thickness", self.thickness, points, "m")
        return (thickness**3 / 12.0)[:, None, None] * self.material.plane_stress

    def inertia(self, points: np.ndarray) -> np.ndarray:
        """Mass per area (n_points,) [kg/m^2]."""
        return self.material.rho * evaluate("thickness", self.thickness, points, "m")


@dataclass(frozen=True)
class Elastic:
    """Elastic support of an edge: springs against deflection and, if wanted, against turning.

    Parameters
    ----------
    stiffness : float [N/m^2] force per deflection and length of a plate's edge; [N/m] at the end of a beam
    rotation : float [N] moment per angle and length of a plate's edge; [N m] at the end of a beam
    """

    stiffness: float
    rotation: float = 0.0

    def __post_init__(self) -> None:
        _check.non_negative("stiffness", self.stiffness, "N/m^2")
        _check.non_negative("rotation", self.rotation, "N")


@dataclass(frozen=True, eq=False)
class Beam:
    """Slender (Euler-Bernoulli) beam; make it with `Beam.rectangular` or `Beam.circular`.

    Parameters
    ----------
    material : Material
    width : float or function of points (n_points, 1) [m]
        Across the blow.
    height : float or function of points [m]
        In the direction of the blow; the diameter if round.
    round : bool
    """

    material: Material
    width: Varying
    height: Varying
    round: bool = False

    def __post_init__(self) -> None:
        _check.instance("material", self.material, Material)
        _check.flag("round", self.round)
        for name, value in (("width", self.width), ("height", self.height)):
            if not callable(value):
                _check.positive(name, value, "m")

    @classmethod
    def rectangular(cls, material: Material, *, width: Varying, height: Varying) -> "Beam":
        """Beam of rectangular section, struck across its height."""
        return cls(material, width, height)

    @classmethod
    def circular(cls, material: Material, *, diameter: Varying) -> "Beam":
        """Round beam."""
        if not callable(diameter):
            _check.positive("diameter", diameter, "m")
        return cls(material, diameter, diameter, round=True)

    def stiffness(self, points: np.ndarray) -> np.ndarray:
        """Bending stiffness E I, (n_points,) [N m^2]."""
        height = evaluate("height", self.height, points, "m")
        width = evaluate("width", self.width, points, "m")
        return self.material.E * width * height**3 * (np.pi / 64.0 if self.round else 1.0 / 12.0)

    def inertia(self, points: np.ndarray) -> np.ndarray:
        """Mass per length (n_points,) [kg/m]."""
        area = evaluate("height", self.height, points, "m") * evaluate("width", self.width, points, "m")
        return self.material.rho * area * (np.pi / 4.0 if self.round else 1.0)
