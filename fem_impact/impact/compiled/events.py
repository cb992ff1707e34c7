"""Onset, release and letting go within a step: how they are found and located.

The cubic through approach and rate at both ends of a step shows whether a contact opened, closed or did both. The step
is then repeated with a length that ends at the event: Newton's method on the approach at the step's end, corrected by
the change the last two lengths really made, and kept inside a bracket by bisection. A contact with loss lets go before
it opens, where ``1 + loss d'`` passes zero; that is located in the same way. Events that pile up within the time of one
step (chatter) are passed with full steps that need no location, because scheme A conserves energy across them.
"""

import numpy as np

from .build import inner
from .flight import approach

LOCATED = 1e-11  # [-] of the approach about an event: a stored energy of 1e-22 of the step's is left out there
LET_GO = 1e-7  # [-] of the force's factor 1 + loss * rate: about zero up to this
LOCATE_LIMIT = 60  # [-] iterations for an event inside a step; bisection alone reaches rounding
EVENT_LIMIT = 64  # [-] events within one step's time: chatter, passed with unlocated steps, each time for twice as long


@inner()
def lowest(d0, v0, d1, v1, h):
    """Smallest value of the cubic through both ends' positions and rates where it falls at first and rises at last."""
    a = 2.0 * (d0 - d1) + h * (v0 + v1)
    b = 3.0 * (d1 - d0) - h * (2.0 * v0 + v1)
    c = h * v0
    root = np.sqrt(max(0.0, b * b - 3.0 * a * c))
    t = -c / (b + root) if b >= 0.0 else (root - b) / (3.0 * a)
    return d0 + t * (c + t * (b + t * a))


@inner()
def hermite_root(d0, v0, d1, v1, h):
    """First zero in (0, h] of the cubic through both ends, where d0 and d1 differ in sign; by bisection and secant."""
    a = 2.0 * (d0 - d1) + h * (v0 + v1)
    b = 3.0 * (d1 - d0) - h * (2.0 * v0 + v1)
    c = h * v0
    low = 0.0
    high = 1.0
    rising = d1 > d0
    for _ in range(60):
        t = 0.5 * (low + high)
        value = d0 + t * (c + t * (b + t * a))
        if (value > 0.0) == rising:
            high = t
        else:
            low = t
    return high * h


@inner()
def crossed(pressed, d0, v0, y, depth, still):
    """Whether a contact opened (was pressed and ends apart) or closed (was apart and ends pressed) within a step."""
    if pressed:
        return y < -depth
    return y > depth and (d0 < 0.0 or v0 < -still)


@inner()
def first_crossing(now, pressed, y, rate, h, depth, still):
    """The contact that opened or closed first within a step, and when by the cubic; -1 and h where none did."""
    target = -1
    at = h
    for i in range(y.size):
        if crossed(pressed[i], now[0, i], now[4, i], y[i], depth, still):
            root = hermite_root(now[0, i], now[4, i], y[i], rate[i], h)
            if root <= at:
                at = root
                target = i
    return target, at


@inner()
def dipped(now, pressed, y, rate, h, i):
    """Whether contact i opened and closed again, or the other way round, within a step, by its cubic."""
    d0 = now[0, i]
    v0 = now[4, i]
    side = 1.0 if pressed[i] else -1.0
    if side * v0 < 0.0 < side * rate[i] and (y[i] > 0.0 if pressed[i] else y[i] <= 0.0):
        low = lowest(side * d0, side * v0, side * y[i], side * rate[i], h)
        return low < -1e-9 * max(side * d0, side * y[i])
    return False


@inner()
def narrow(now, pressed, y, rate, h, depth, still, target, bracket):
    """Next length of a step that is to end where a contact opens or closes, from a try of length h.

    Returns (target, length), the length zero where the try was good; the target is an earlier crossing if the try
    showed one. ``bracket`` holds the lengths between which the crossing lies, the size of the approach, and length,
    approach and rate of the last try: what the length changes in the approach is not quite the rate, as the force's
    polynomial changes too.
    """
    for i in range(y.size):
        slack = max(depth, LOCATED * (abs(now[0, i]) + abs(y[i])))  # or contacts that open together take turns for ever
        if i != target and crossed(pressed[i], now[0, i], now[4, i], y[i], slack, still):
            enclose(now, y, rate, h, i, bracket)
            guess = hermite_root(now[0, i], now[4, i], y[i], rate[i], h)
            return i, guess if guess < h else 0.5 * h
    miss = y[target]
    if abs(miss) <= LOCATED * bracket[2] or bracket[1] - bracket[0] <= 4e-16 * bracket[1]:
        return target, 0.0
    if (miss > 0.0) != pressed[target]:
        bracket[1] = h
    else:
        bracket[0] = h
    v = rate[target]
    turn = (6.0 * (now[0, target] - miss) / h + 2.0 * now[4, target] + 4.0 * v) / h
    if bracket[3] != h:
        v += (miss - bracket[4]) / (h - bracket[3]) - 0.5 * (rate[target] + bracket[5])
    bracket[3] = h
    bracket[4] = miss
    bracket[5] = rate[target]
    guess = bracket[0]
    if v != 0.0:
        wait = -miss / v
        guess = h + wait - 0.5 * turn * wait * wait / v
    if abs(guess - h) <= 4e-16 * h:
        return target, 0.0
    if not bracket[0] < guess < bracket[1]:
        guess = 0.5 * (bracket[0] + bracket[1])
    return target, guess


@inner()
def enclose(now, y, rate, h, target, bracket):
    """Set the bracket of `narrow` to a whole step."""
    bracket[0] = 0.0
    bracket[1] = h
    bracket[2] = abs(now[0, target]) + abs(y[target])
    bracket[3] = h
    bracket[4] = y[target]
    bracket[5] = rate[target]


@inner()
def letting_go(loss, d0, v0, d1, v1, h):
    """Fraction of a step at which the factor 1 + loss * rate changes its sign, by the cubic through both ends."""
    start = 1.0 + loss * v0
    b = 2.0 * loss * (3.0 * (d1 - d0) / h - 2.0 * v0 - v1)
    a = loss * (v1 - v0) - b
    root = np.sqrt(max(0.0, b * b - 4.0 * a * start))
    side = 1.0 if v1 > v0 else -1.0
    return -2.0 * start / (b + side * root) if side * b >= 0.0 else 0.5 * (side * root - b) / a


@inner()
def first_letting_go(now, law, y, rate, h):
    """The closed contact that stops or begins to push first within a step, and when; -1 and h where none does."""
    target = -1
    at = h
    for i in range(y.size):
        loss = law[i, 2]
        start = 1.0 + loss * now[4, i]
        end = 1.0 + loss * rate[i]
        if loss > 0.0 and now[0, i] > 0.0 and (end < -LET_GO < LET_GO < start or start < -LET_GO < LET_GO < end):
            root = h * letting_go(loss, now[0, i], now[4, i], y[i], rate[i], h)
            if 0.0 < root < at:
                at = root
                target = i
    return target, at


@inner()
def settle(now, pressed, y, rate, target, depth, still):
    """Take over approaches and rates at a step's end; the number of contacts that opened."""
    opened = 0
    for i in range(y.size):
        was = pressed[i]
        slack = max(depth, LOCATED * abs(now[0, i])) if target >= 0 else depth  # contacts may open together
        now[0, i] = y[i]
        now[4, i] = rate[i]
        if i == target:
            now[0, i] = 0.0
            pressed[i] = not was
        elif abs(y[i]) <= slack:
            now[0, i] = 0.0
            pressed[i] = rate[i] > still or (was and rate[i] >= -still)
        else:
            pressed[i] = y[i] > 0.0
        if was and not pressed[i]:
            opened += 1
    return opened


@inner()
def begin(shape, offset, q, p, now, pressed):
    """Approach and rate of every contact at the start, and whether it is pressed."""
    for i in range(offset.size):
        now[0, i], now[4, i] = approach(shape, offset, i, q, p)
        pressed[i] = now[0, i] > 0.0 or (now[0, i] == 0.0 and now[4, i] > 0.0)


@inner()
def land(shape, offset, time, elapsed, first, found, row, stride, now, pressed, q, p):
    """Write a free flight to a row of the steps and take over the contacts' state at its end."""
    row[:] = 0.0
    row[0] = time
    row[1] = elapsed
    for i in range(offset.size):
        row[3 + stride * i] = now[0, i]
        row[4 + stride * i] = now[4, i]
        now[0, i], now[4, i] = approach(shape, offset, i, q, p)
        now[0, i] = min(0.0, now[0, i])
    if found == 0:
        now[0, first] = 0.0
        pressed[first] = True
