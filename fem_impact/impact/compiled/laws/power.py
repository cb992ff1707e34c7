"""A power of the approach: ``F = k x**a``, with ``V = k x**(a+1) / (a+1)``; what the other laws are made of.

The energy-exact schemes need the average slopes ``G = (V1 - V0) / (d1 - d0)`` and ``D = (F1 - F0) / (d1 - d0)`` to full
precision for close approaches, where the differences cancel: `power_slopes` forms them from x without subtracting.
"""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.special import gamma

from ..build import inner
from .base import POWER, Law, Spring


@dataclass(frozen=True)
class PowerNumbers:
    """The numbers of every law, and the methods that make one of these alone."""

    stiffness: float  # [N/m**exponent]
    exponent: float = 1.0  # [-]
    loss: float = 0.0  # [s/m] Hunt and Crossley's damping factor
    gap: float = 0.0  # [m] distance the bodies travel before they touch

    @classmethod
    def linear(cls, stiffness: float, *, loss: float = 0.0, gap: float = 0.0) -> Self:
        """A linear spring, stiffness in N/m.

        Examples
        --------
        >>> fi.Contact.linear(1e5).force([-1e-3, 1e-3]).tolist()
        [0.0, 100.0]
        """
        return cls(stiffness, 1.0, loss, gap)

    @classmethod
    def hertz(cls, stiffness: float, *, loss: float = 0.0, gap: float = 0.0) -> Self:
        """Hertz's law for smooth round bodies, stiffness in N/m**1.5.

        Examples
        --------
        >>> fi.Contact.hertz(1e6, loss=0.1).force([1e-4, 4e-4], rate=1.0).round(6).tolist()
        [1.1, 8.8]
        """
        return cls(stiffness, 1.5, loss, gap)

    @classmethod
    def power(cls, stiffness: float, exponent: float, *, loss: float = 0.0, gap: float = 0.0) -> Self:
        """Any power of the approach, stiffness in N/m**exponent.

        Examples
        --------
        >>> felt = fi.Contact.power(1e9, 2.5)
        >>> felt.force([1e-3, 2e-3]).round(3).tolist()
        [31.623, 178.885]
        """
        return cls(stiffness, exponent, loss, gap)


class PowerLaw(Law):
    """A power law, with a loss factor or without."""

    name = "power"
    damped = hertzian = True
    slopes = ("stiffness", "exponent", "loss")

    def acts(self, contact: object) -> bool:
        return False

    def acting(self, row: Any, mobility: Any, speed: Any) -> np.ndarray:
        return np.asarray(row.stiffness)


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


@inner()
def simple(k, a, loss, c):
    """The spring of a power law."""
    return Spring(k, a, loss, c, POWER, np.inf, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)


@inner()
def power(x, exponent):
    """x**exponent for x > 0 without the general power where a root will do."""
    if exponent == 1.0:
        return x
    if exponent == 1.5:
        return x * np.sqrt(x)
    return x**exponent


@inner()
def power_slopes(k, a, x0, x1):
    """Average slopes of ``k x**(a+1) / (a+1)`` and ``k x**a`` between two compressions > 0, x0 the smaller."""
    if a == 1.0:
        return 0.5 * k * (x0 + x1), k
    if a == 1.5:
        r0 = np.sqrt(x0)
        r1 = np.sqrt(x1)
        g = 0.4 * k * (x1 * x1 + x1 * r1 * r0 + x1 * x0 + r1 * r0 * x0 + x0 * x0) / (r0 + r1)
        return g, k * (x0 + r0 * r1 + x1) / (r0 + r1)
    r = (x1 - x0) / (x1 + x0)
    if r < 1e-4:
        mid = 0.5 * (x1 + x0)
        f = k * mid**a
        g = f * (1.0 + a * (a - 1.0) / 6.0 * r * r)
        return g, a * f / mid * (1.0 + (a - 1.0) * (a - 2.0) / 6.0 * r * r)
    f = k * x1**a
    if x0 < 1e-16 * x1:
        return f / (a + 1.0), f / x1
    log = np.log1p((x0 - x1) / x1)
    return f / (a + 1.0) * np.expm1((a + 1.0) * log) / np.expm1(log), f / x1 * np.expm1(a * log) / np.expm1(log)
