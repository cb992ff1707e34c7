"""Cubics through both ends of an interval with the slopes there: where they cross zero, turn, or surely do neither.

The interval is of unit length: of a step of length h the slopes are h times the rates at its ends.
"""

import numpy as np

from .build import inner
from .rounding import ITERATIONS, NEAR

LOOKS = 8  # [-] parts of a look ahead judged apart where the whole leaves a doubt


@inner()
def cubic(d0, v0, d1, v1, t):
    """Value and slope at t of the cubic through both ends of a unit interval with the slopes there."""
    a = 2.0 * (d0 - d1) + v0 + v1
    b = 3.0 * (d1 - d0) - 2.0 * v0 - v1
    return d0 + t * (v0 + t * (b + t * a)), v0 + t * (2.0 * b + t * 3.0 * a)


@inner()
def crossing(d0, v0, d1, v1):
    """Where that cubic passes zero, its ends differing in sign."""
    low = 0.0
    high = 1.0
    t = d0 / (d0 - d1) if d0 != 0.0 else 0.5  # it may begin at zero, and pass it later
    for _ in range(ITERATIONS):
        value, slope = cubic(d0, v0, d1, v1, t)
        if (value > 0.0) == (d1 > 0.0):
            high = t
        else:
            low = t
        new = t - value / slope if slope != 0.0 else 0.5 * (low + high)
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - t) < NEAR:  # the next would change it by the square of that
            return new
        t = new
    return t


@inner()
def turning(d0, v0, d1, v1):
    """Where that cubic turns, its end slopes differing in sign, and its value there."""
    a = 2.0 * (d0 - d1) + v0 + v1
    b = 3.0 * (d1 - d0) - 2.0 * v0 - v1
    side = 1.0 if v0 < 0.0 else -1.0
    root = side * np.sqrt(max(0.0, b * b - 3.0 * a * v0))
    t = -v0 / (b + root) if side * b >= 0.0 else (root - b) / (3.0 * a)
    return t, cubic(d0, v0, d1, v1, t)[0]


@inner()
def lowest_between(d0, v0, d1, v1):
    """Least value of that cubic between its ends; infinity unless it falls at the first and rises at the last."""
    return turning(d0, v0, d1, v1)[1] if v0 < 0.0 < v1 else np.inf


@inner()
def surely_parted(d0, v0, d1, v1, error, rate_error):
    """Whether an approach, known at both ends of a look ahead, surely has no touch in between but one that lasts.

    The cubic through both ends errs by at most ``error``, its slope by ``rate_error``. Falling from the start, rising
    to the end, or below zero: each part of the look must be one of these, in this order.
    """
    if d1 <= 0.0 and max(d0, d1) + 4.0 / 27.0 * (max(0.0, v0) + max(0.0, -v1)) + error < 0.0:
        return True
    a = 2.0 * (d0 - d1) + v0 + v1
    b = 3.0 * (d1 - d0) - 2.0 * v0 - v1
    falling = True
    dt = 1.0 / LOOKS
    value, slope = d0, v0
    for look in range(LOOKS):
        after, steep = cubic(d0, v0, d1, v1, (look + 1.0) * dt)
        low = min(slope, steep)
        high = max(slope, steep)
        if a != 0.0:
            t = -b / (3.0 * a)
            if look * dt < t < (look + 1.0) * dt:
                turn = v0 + t * (2.0 * b + t * 3.0 * a)
                low = min(low, turn)
                high = max(high, turn)
        falling = falling and high + rate_error < 0.0
        if not falling and not low - rate_error > 0.0:
            top = max(value, after) + 4.0 / 27.0 * dt * (max(0.0, slope) + max(0.0, -steep))
            if not top + error < 0.0:
                return False
        value, slope = after, steep
    return d1 <= 0.0 or not falling
