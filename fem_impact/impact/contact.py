"""Contact laws: the force between two bodies as a function of how far they are pressed together."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import gamma

from .._base import check

LOWEST_EXPONENT, HIGHEST_EXPONENT = 0.5, 100.0  # [-] limits: below, no longer a spring; above, a wall

MOST_LOSS = 1e12  # [s/m] far above that of a contact that swallows the slowest blow whole
STIFFEST = 1e200  # [N/m**exponent] upper limit, 1/STIFFEST the lower: high exponents need huge stiffnesses


@dataclass(frozen=True)
class Contact:
    """A spring that only pushes: ``F = stiffness d**exponent (1 + loss d')`` for an approach d > 0, else zero.

    The approach is the first body's displacement minus the second's, minus the gap. A negative gap is a preload: the
    bodies start pressed together. Valid while the contact area is small compared with both bodies and the speed is far
    below their wave speeds.

    References
    ----------
    Hertz (1882), J. reine angew. Math. 92, 156; Hunt and Crossley (1975), J. Appl. Mech. 42, 440-445.
    """

    stiffness: float  # [N/m**exponent]
    exponent: float = 1.0  # [-]
    loss: float = 0.0  # [s/m] Hunt and Crossley's damping factor
    gap: float = 0.0  # [m] distance the bodies travel before they touch

    def __post_init__(self) -> None:
        check.settle(
            self,
            stiffness=check.positive("stiffness", self.stiffness, "N/m**exponent", reach=STIFFEST),
            exponent=check.between("exponent", self.exponent, LOWEST_EXPONENT, HIGHEST_EXPONENT),
            loss=check.between("loss", check.non_negative("loss", self.loss, "s/m"), 0.0, MOST_LOSS, "s/m"),
            gap=check.number("gap", self.gap, "m"),
        )

    @classmethod
    def linear(cls, stiffness: float, *, loss: float = 0.0, gap: float = 0.0) -> "Contact":
        """A linear spring, stiffness in N/m.

        Examples
        --------
        >>> fi.Contact.linear(1e5).force([-1e-3, 1e-3]).tolist()
        [0.0, 100.0]
        """
        return cls(stiffness, 1.0, loss, gap)

    @classmethod
    def hertz(cls, stiffness: float, *, loss: float = 0.0, gap: float = 0.0) -> "Contact":
        """Hertz's law for smooth round bodies, stiffness in N/m**1.5.

        Examples
        --------
        >>> fi.Contact.hertz(1e6, loss=0.1).force([1e-4, 4e-4], rate=1.0).round(6).tolist()
        [1.1, 8.8]
        """
        return cls(stiffness, 1.5, loss, gap)

    @classmethod
    def power(cls, stiffness: float, exponent: float, *, loss: float = 0.0, gap: float = 0.0) -> "Contact":
        """Any power of the approach, stiffness in N/m**exponent.

        Examples
        --------
        >>> felt = fi.Contact.power(1e9, 2.5)
        >>> felt.force([1e-3, 2e-3]).round(3).tolist()
        [31.623, 178.885]
        """
        return cls(stiffness, exponent, loss, gap)

    @classmethod
    def restituting(
        cls, stiffness: float, exponent: float, *, restitution: float, speed: float, gap: float = 0.0
    ) -> "Contact":
        """A contact with the loss that gives a mass the stated restitution on a rigid wall.

        Parameters
        ----------
        restitution : float [-]
            From 1e-6 to 1.
        speed : float [m/s]
            Approach speed at which this restitution holds.

        Notes
        -----
        Solves ``L (1 + e) = ln((1 + L) / (1 - e L))`` with ``L = loss speed``. The equation holds for any mass,
        stiffness and exponent.

        Examples
        --------
        >>> law = fi.Contact.restituting(1e6, 1.5, restitution=0.8, speed=2.0)
        >>> hit = fi.strike(fi.Modes.rigid(1e3), fi.Striker.rigid(1e-3), law, at=None, speed=2.0)
        >>> round(hit.restitution, 3)
        0.8
        """
        e = check.between("restitution", restitution, 1e-6, 1.0)
        speed = check.positive("speed", speed, "m/s")
        return cls(stiffness, exponent, loss_number(e) / speed, gap)

    @classmethod
    def between(cls, sphere: Any, plate: Any, *, loss: float = 0.0, gap: float = 0.0) -> "Contact":
        """Hertz contact of a sphere with a flat body, stiffness ``(4/3) E* sqrt(R)``, ``1/E* = sum (1 - nu**2)/E``.

        Parameters
        ----------
        sphere : Striker
            Made by `Striker.sphere`.
        plate : Plate or Material
            The flat body; isotropic. For wood, give an isotropic `Material` with its stiffness across the thickness.

        Examples
        --------
        >>> steel = fi.Material(E=210e9, nu=0.3, rho=7850.0)
        >>> ball = fi.Striker.sphere(steel, radius=5e-3)
        >>> round(fi.Contact.between(ball, steel).stiffness / 1e9, 3)  # GN/m^1.5
        10.879
        """
        for name in ("material", "radius"):
            if getattr(sphere, name, None) is None:
                raise ValueError(f"sphere must be made by Striker.sphere, got {check.shown(sphere)} without {name}")
        flat = getattr(plate, "material", plate)
        compliance = sum(
            (1.0 - nu**2) / E for E, nu in (_isotropic("sphere", sphere.material), _isotropic("plate", flat))
        )
        return cls(4.0 / 3.0 / compliance * float(np.sqrt(sphere.radius)), 1.5, loss, gap)

    def force(self, approach: Any, rate: Any = 0.0) -> np.ndarray:
        """Contact force [N] for an approach [m] and its rate [m/s]; never negative."""
        pressed = np.maximum(check.numbers("approach", approach, "m"), 0.0)
        rates = check.numbers("rate", rate, "m/s")
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                force = self.stiffness * pressed**self.exponent * (1.0 + self.loss * rates)
        except ValueError:
            raise ValueError(f"rate must have the shape of approach, {pressed.shape}, got {rates.shape}") from None
        if not np.isfinite(force).all():
            raise ValueError("approach and rate must give a finite force; check their units, m and m/s")
        return np.maximum(force, 0.0)


def _isotropic(name: str, material: Any) -> tuple[float, float]:
    E, nu = getattr(material, "E", None), getattr(material, "nu", None)
    if getattr(material, "E_across", None) is not None:
        raise ValueError(
            f"{name} must be isotropic, because the contact of an orthotropic body depends on its stiffness across the "
            "thickness; give fi.Material with that E instead, or use Contact.hertz with a measured stiffness"
        )
    if not isinstance(E, (int, float)) or not isinstance(nu, (int, float)):
        raise ValueError(
            f"{name} must have an isotropic material (E, nu), got {check.shown(material)}; use Contact.hertz"
        )
    return float(E), float(nu)


def wall_time(stiffness: Any, exponent: Any, mobility: Any, speed: Any, compliance: Any = 0.0) -> np.ndarray:
    """Contact times [s] of masses 1 / ``mobility`` [1/kg] on a rigid wall, without loss; the arguments broadcast.

    ``T = 2 sqrt(pi) Gamma(1 + q) / Gamma(1/2 + q) deepest / speed`` with ``q = 1 / (exponent + 1)``. A ``compliance``
    [m/N] in series counts for a linear contact only.

    References
    ----------
    Euphonics 12.1.1.
    """
    q = 1.0 / (np.asarray(exponent) + 1.0)
    # in logarithms: the direct form overflows for extreme stiffness or speed
    deepest = np.exp(q * (2.0 * np.log(speed) - np.log(2.0 * q * stiffness) - np.log(mobility)))
    series = np.sqrt(1.0 + np.where(q == 0.5, stiffness * np.asarray(compliance), 0.0))
    return np.asarray(2.0 * np.sqrt(np.pi) * gamma(1.0 + q) / gamma(0.5 + q) * deepest / speed * series)


def loss_number(restitution: float) -> float:
    """Hunt and Crossley's ``loss * speed`` [-] that gives a restitution on a rigid wall."""
    e = restitution
    if e > 1.0 - 1e-6:
        return 1.5 * (1.0 - e)

    def excess(t: float) -> float:
        number = -float(np.expm1(-t)) / e
        return float(np.log1p(number)) + t - number * (1.0 + e)

    # solve for t = -ln(1 - e number): for small e, rounding makes the number 1/e, but t stays accurate
    t = brentq(excess, -float(np.log1p(-e * (1.0 - e))), 3.0 / e + 10.0, xtol=1e-300, rtol=1e-15)
    return -float(np.expm1(-t)) / e
