"""Force laws between two bodies: how hard they push for how far they are pressed together."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from . import _check

LOWEST_EXPONENT, HIGHEST_EXPONENT = 0.5, 100.0  # [-] below, the force is no longer a spring's; above, it is a wall

STIFFEST = 1e200  # [N/m**exponent] and its reciprocal: a high power of a small approach has a huge factor


@dataclass(frozen=True)
class Contact:
    """A spring that only pushes: ``F = stiffness d**exponent (1 + loss d')`` for an approach d > 0, else zero.

    The approach is the first body's displacement less the second's, less the gap. A negative gap is a preload: the
    bodies start pressed together. Valid while the contact area is small beside both bodies and the speed far below
    that of their waves.

    References
    ----------
    Hertz (1882), J. reine angew. Math. 92, 156; Hunt and Crossley (1975), J. Appl. Mech. 42, 440-445.
    """

    stiffness: float  # [N/m**exponent]
    exponent: float = 1.0  # [-]
    loss: float = 0.0  # [s/m] Hunt and Crossley's factor of the rate of approach
    gap: float = 0.0  # [m] free way before the bodies touch

    def __post_init__(self) -> None:
        _check.positive("stiffness", self.stiffness, "N/m**exponent", reach=STIFFEST)
        _check.between("exponent", self.exponent, LOWEST_EXPONENT, HIGHEST_EXPONENT)
        _check.non_negative("loss", self.loss, "s/m")
        _check.number("gap", self.gap, "m")

    @classmethod
    def linear(cls, stiffness: float, *, loss: float = 0.0, gap: float = 0.0) -> "Contact":
        """A linear spring, stiffness in N/m."""
        return cls(stiffness, 1.0, loss, gap)

    @classmethod
    def hertz(cls, stiffness: float, *, loss: float = 0.0, gap: float = 0.0) -> "Contact":
        """Hertz's law for smooth round bodies, stiffness in N/m**1.5."""
        return cls(stiffness, 1.5, loss, gap)

    @classmethod
    def power(cls, stiffness: float, exponent: float, *, loss: float = 0.0, gap: float = 0.0) -> "Contact":
        """Any power of the approach, stiffness in N/m**exponent."""
        return cls(stiffness, exponent, loss, gap)

    @classmethod
    def restituting(
        cls, stiffness: float, exponent: float, *, restitution: float, speed: float, gap: float = 0.0
    ) -> "Contact":
        """A contact that loses just enough to throw a mass back off a rigid wall with the given restitution.

        Parameters
        ----------
        restitution : float [-], above 0, at most 1, at approach ``speed`` [m/s]

        Notes
        -----
        Solves ``L (1 + e) = ln((1 + L) / (1 - e L))`` with ``L = loss speed``, which holds whatever the mass,
        stiffness and exponent.
        """
        e = _check.between("restitution", restitution, 1e-6, 1.0)
        speed = _check.positive("speed", speed, "m/s")
        return cls(stiffness, exponent, loss_number(e) / speed, gap)

    @classmethod
    def between(cls, sphere: Any, plate: Any, *, loss: float = 0.0, gap: float = 0.0) -> "Contact":
        """Hertz contact of a sphere with a flat body, stiffness ``(4/3) E* sqrt(R)``, ``1/E* = sum (1 - nu**2)/E``.

        Parameters
        ----------
        sphere : Striker made by `Striker.sphere`
        plate : Plate or Material of the flat body, isotropic
        """
        for name in ("material", "radius"):
            if getattr(sphere, name, None) is None:
                raise ValueError(f"sphere must be made by Striker.sphere, got {_check.shown(sphere)} without {name}")
        flat = getattr(plate, "material", plate)
        compliance = sum(
            (1.0 - nu**2) / E for E, nu in (_isotropic("sphere", sphere.material), _isotropic("plate", flat))
        )
        return cls(4.0 / 3.0 / compliance * float(np.sqrt(sphere.radius)), 1.5, loss, gap)

    def force(self, approach: Any, rate: Any = 0.0) -> np.ndarray:
        """Contact force [N] at an approach [m] and its rate [m/s]; never pulls."""
        pressed = np.maximum(_check.numbers("approach", approach, "m"), 0.0)
        rates = _check.numbers("rate", rate, "m/s")
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                force = self.stiffness * pressed**self.exponent * (1.0 + self.loss * rates)
        except ValueError:
            raise ValueError(f"rate must have the shape of approach, {pressed.shape}, got {rates.shape}") from None
        if not np.isfinite(force).all():
            raise ValueError("approach and rate must be finite and give a finite force")
        return np.maximum(force, 0.0)


def _isotropic(name: str, material: Any) -> tuple[float, float]:
    E, nu = getattr(material, "E", None), getattr(material, "nu", None)
    if not isinstance(E, (int, float)) or not isinstance(nu, (int, float)):
        raise ValueError(
            f"{name} must be of an isotropic material (E, nu), got {_check.shown(material)}; give Contact.hertz"
        )
    return float(E), float(nu)


def loss_number(restitution: float) -> float:
    """Hunt and Crossley's ``loss * speed`` [-] that gives a restitution on a rigid wall."""
    e = restitution
    if e > 1.0 - 1e-6:
        return 1.5 * (1.0 - e)

    def excess(t: float) -> float:
        number = -float(np.expm1(-t)) / e
        return float(np.log1p(number)) + t - number * (1.0 + e)

    # unknown t = -ln(1 - e number): for small e the number is 1/e to rounding, while t stays distinct
    t = brentq(excess, -float(np.log1p(-e * (1.0 - e))), 3.0 / e + 10.0, xtol=1e-300, rtol=1e-15)
    return -float(np.expm1(-t)) / e
