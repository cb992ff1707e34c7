"""Elastic materials: isotropic, and orthotropic such as wood."""

import math
from dataclasses import dataclass

import numpy as np

from .._base import check
from . import plausible

# [Pa] mean pressure under the pyramid of 136 degrees for a Vickers number of 1: kgf/mm^2, but of its slanted faces
VICKERS = float(9.80665e6 / np.sin(np.radians(68.0)))
TABOR = 2.8  # [-] mean pressure under a deep dent over the yield strength (Tabor 1951)


def rotated_stiffness(stiffness: np.ndarray, angle: float) -> np.ndarray:
    """The stiffness (3, 3) on strains (xx, yy, 2 xy) of a material turned anticlockwise by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])
    return turn.T @ stiffness @ turn


def stiffness_by_way(stiffness: np.ndarray) -> np.ndarray:
    """What a stiffness (3, 3) on strains (xx, yy, 2 xy) opposes to a wave every 5 degrees: the least to a hundredth."""
    angle = np.pi * np.arange(36) / 36
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
        Stress at which it yields in tension; decides whether a contact dents it (`Response.assumptions`).
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
        check.settle(self, nu=nu, angle=check.number("angle", self.angle, "rad"))
        for name in ("E", "rho", "yield_strength", "E_across", "G", "G_xz", "G_yz"):
            if name in ("E", "rho") or getattr(self, name) is not None:
                unit = "kg/m^3" if name == "rho" else "Pa"
                check.settle(self, **{name: check.positive(name, getattr(self, name), unit)})
        if (self.E_across is None) != (self.G is None):
            raise ValueError("E_across and G must be given together; use Material.orthotropic, or give neither")
        for name in ("G_xz", "G_yz"):
            if self.G is None and getattr(self, name) is not None:
                raise ValueError(f"{name} needs an orthotropic material; give E_across and G, or leave it out")
        if self.E_across is None:
            if not -1.0 < nu < 0.5 and nu != 0.5:
                raise ValueError(f"nu must be above -1 and at most 0.5, got {nu:g}")
        elif nu**2 * self.E_across >= self.E:
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
        named = ("E", "E_across", "G", "rho")
        notes = [note for name in named for note in plausible.note_number(name, getattr(self, name))]
        if abs(self.angle) > math.tau:
            notes.append(
                f"angle = {self.angle:g} rad is {abs(self.angle) / math.tau:.3g} turns; rad are expected, and "
                f"{self.angle:g} degrees are {np.radians(self.angle):.4g}"
            )
        return tuple(notes)

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
        return rotated_stiffness(local, self.angle)

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
