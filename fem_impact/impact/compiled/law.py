"""The contact law: force and stored energy over the approach, and their average slopes between two approaches.

A contact pushes with ``F = k x**a (1 + loss d')`` while its spring is compressed by ``x > 0``. A residual compliance
``c`` in series takes the rest of the approach, ``d = x + c k x**a``. The stored energy is that of both springs,
``V = k x**(a+1) / (a+1) + c (k x**a)**2 / 2``, so that ``V' = F`` along d without loss.

The energy-exact schemes need the average slopes ``G = (V1 - V0) / (d1 - d0)`` and ``D = (F1 - F0) / (d1 - d0)`` to full
precision for close approaches, where the differences cancel: `slopes` forms them from x without subtracting.
"""

from typing import NamedTuple

import numpy as np

from .build import inner, outer


class Spring(NamedTuple):
    """One contact."""

    stiffness: float  # [N/m**exponent]
    exponent: float  # [-]
    loss: float  # [s/m]
    compliance: float  # [m/N] in series


class Point(NamedTuple):
    """A contact's spring at one approach."""

    approach: float  # [m]
    compression: float  # [m]
    force: float  # [N] elastic
    energy: float  # [J]


@inner()
def spring_of(law, i):
    """Contact i of a law (n_contacts, 4)."""
    return Spring(law[i, 0], law[i, 1], law[i, 2], law[i, 3])


@inner()
def power(x, exponent):
    """x**exponent for x > 0 without the general power where a root will do."""
    if exponent == 1.0:
        return x
    if exponent == 1.5:
        return x * np.sqrt(x)
    return x**exponent


@inner()
def compression(d, spring):
    """Compression of the spring at approach d > 0: Newton's method on ``x + c k x**a = d``, kept between bounds."""
    k, a, c = spring.stiffness, spring.exponent, spring.compliance
    if c == 0.0:
        return d
    if a == 1.0:
        return d / (1.0 + k * c)
    kc = k * c
    low = 0.0
    high = d
    x = min(d, (d / kc) ** (1.0 / a))
    for _ in range(200):
        f = kc * power(x, a)
        r = x + f - d
        if r > 0.0:
            high = x
        else:
            low = x
        new = x - r / (1.0 + a * f / x)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 2e-16 * x:
            return new
        x = new
    return x


@inner()
def compressed(x, spring):
    """The spring at a given compression."""
    if x <= 0.0:
        return Point(x, x, 0.0, 0.0)
    f = spring.stiffness * power(x, spring.exponent)
    energy = f * x / (spring.exponent + 1.0) + 0.5 * spring.compliance * f * f
    return Point(x + spring.compliance * f, x, f, energy)


@inner()
def at(d, spring):
    """The spring at a given approach."""
    if d <= 0.0:
        return Point(d, d, 0.0, 0.0)
    point = compressed(compression(d, spring), spring)
    return Point(d, point.compression, point.force, point.energy)


@inner()
def slopes(one, two, spring):
    """Average slopes between two points: energy over approach (G) and force over approach (D), without cancellation."""
    if one.approach <= 0.0 or two.approach <= 0.0:
        if one.approach <= 0.0 and two.approach <= 0.0:
            return 0.0, 0.0
        span = two.approach - one.approach
        return (two.energy - one.energy) / span, (two.force - one.force) / span
    k, a, c = spring.stiffness, spring.exponent, spring.compliance
    x0, x1 = one.compression, two.compression
    if a == 1.0:
        g = 0.5 * k * (x0 + x1)
        d = k
    elif a == 1.5:
        r0 = np.sqrt(x0)
        r1 = np.sqrt(x1)
        g = 0.4 * k * (x1 * x1 + x1 * r1 * r0 + x1 * x0 + r1 * r0 * x0 + x0 * x0) / (r0 + r1)
        d = k * (x0 + r0 * r1 + x1) / (r0 + r1)
    else:
        small = min(x0, x1)
        large = max(x0, x1)
        r = (large - small) / (large + small)
        if r < 1e-4:
            mid = 0.5 * (large + small)
            f = k * mid**a
            g = f * (1.0 + a * (a - 1.0) / 6.0 * r * r)
            d = a * f / mid * (1.0 + (a - 1.0) * (a - 2.0) / 6.0 * r * r)
        elif small < 1e-290:
            f = k * large**a
            g = f / (a + 1.0)
            d = f / large
        else:
            log = np.log1p((small - large) / large)
            f = k * large**a
            g = f / (a + 1.0) * np.expm1((a + 1.0) * log) / np.expm1(log)
            d = f / large * np.expm1(a * log) / np.expm1(log)
    return (g + 0.5 * c * (one.force + two.force) * d) / (1.0 + c * d), d / (1.0 + c * d)


@inner()
def smooth_force(x, v, spring):
    """Force of a pressed contact and its slopes in compression and rate, continued smoothly below zero compression."""
    a = spring.exponent
    size = abs(x)
    f = spring.stiffness * power(size, a) if size > 0.0 else 0.0
    slope = spring.stiffness if a == 1.0 else (a * f / size if size > 0.0 else 0.0)
    if x < 0.0:
        f = -f
    factor = 1.0 + spring.loss * v
    if factor < 0.0:
        return 0.0, 0.0, 0.0
    return f * factor, slope * factor, f * spring.loss


@outer()
def stored(approach, law):
    """Energy that all contacts store at their approaches (n_contacts,) [m]."""
    total = 0.0
    for i in range(law.shape[0]):
        total += at(approach[i], spring_of(law, i)).energy
    return total


@outer()
def compressions(approach, k, a, c):
    """Spring compression at many approaches (n,), zero where apart."""
    result = np.zeros(approach.size)
    for n in range(approach.size):
        if approach[n] > 0.0:
            result[n] = compression(approach[n], Spring(k, a, 0.0, c))
    return result
