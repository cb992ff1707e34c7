"""Onset, release and loss of force within a step: how they are found and located.

The cubic through approach and rate at both ends of a step shows whether a contact opened, closed or did both. The step
is then repeated with a length that ends at the event: Newton's method on the approach at the step's end, corrected by
the change the last two lengths really made, and kept inside a bracket by bisection. A contact with loss stops pushing
before it opens, where ``1 + loss d'`` passes zero; felt stays behind and is met again; a head of two layers changes its
law where the hard one is reached; a contact that yields does so where it turns back and where it is pressed deeper than
ever before. These corners of the force are located by secants. Events that pile up within the time of one step
(chatter) are passed with full steps that need no location, because scheme A conserves energy across them.
"""

import numpy as np

from .build import inner
from .cubics import crossing, lowest_between, turning
from .law import corner_approach, relaxes, spring_of, yields
from .laws.felt import above_felt, parting, parting_rate
from .rounding import NEAR, REPEATED

from .layout import (  # isort: skip
    APPROACH, HIGH, LOW, MISSED, RATE, SIZE, SLOPE, TRIED,
)  # fmt: skip

LOCATED = 1e-11  # [-] of the approach about an event: a stored energy of 1e-22 of the step's is left out there
SUMMED = 500.0  # [-] over the rounding of an approach: what a sum of a few thousand modes leaves of one that is zero
NO_FORCE = 1e-7  # [-] of the force's factor 1 + loss * rate: about zero up to this
NO_PAUSE = 1e-5  # [-] of that factor: a force that is by less beyond zero within a step does not stop
# kinds of corners: it stops or starts pushing by its rate, the bend, the turn, it parts from its felt or meets it, and
# meets it again at once, so that the step is to be taken pressed
RELEASES, BENDS, TURNS, PARTS, AGAIN = range(5)
AT_ONCE = 1e-6  # [-] of a step in which felt is met: sooner it is met at its start, a contact that much too early
HALVED = 8  # [-] halvings of a step before a body parts from felt; with them contact times err by 1e-6 instead of 1e-4
EVENT_LIMIT = 64  # [-] events within one step's time: chatter, passed with unlocated steps, each time for twice as long


@inner(part=True)
def has_crossed(pressed, d0, v0, y, depth, still):
    """Whether a contact opened (was pressed and ends apart) or closed (was apart and ends pressed) within a step."""
    if pressed:
        return y < -depth
    return y > depth and (d0 < 0.0 or v0 < -still)


@inner()
def drawn_apart(bodies, contacts, i):
    """Whether a step's forces, and what already moves, first draw contact i apart, which touches at rest."""
    pull = 0.0
    for n in range(bodies.q.size):
        push = bodies.bias[n] - bodies.omega[n] ** 2 * bodies.q[n] - bodies.twice[n] * bodies.p[n]
        for j in range(contacts.force.size):
            push -= bodies.shape[j, n] * contacts.force[j]
        pull += bodies.shape[i, n] * push
    return pull < 0.0


@inner(part=True)
def first_crossing(bodies, contacts, h, limits, first):
    """The contact that opened or closed first within a step, and when by the cubic; -1 and h where none did.

    One that touches at rest counts as apart only in the ``first`` step of a run: later, rounding decides.
    """
    now, y, rate, still = contacts.now, contacts.end, contacts.rate, limits.still
    target = -1
    at = h
    for i in range(y.size):
        d0, v0, pressed = now[APPROACH, i], now[RATE, i], contacts.pressed[i]
        closes_later = first and not pressed and d0 == 0.0 and abs(v0) <= still and y[i] > limits.depth
        if has_crossed(pressed, d0, v0, y[i], limits.depth, still) or (
            closes_later and drawn_apart(bodies, contacts, i)
        ):
            root = h * crossing(d0, h * v0, y[i], h * rate[i])
            if root <= at:
                at = root
                target = i
    return target, at


@inner(part=True)
def has_dipped(contacts, h, i):
    """Whether contact i opened and closed again, or the other way round, within a step, by its cubic."""
    pressed = contacts.pressed[i]
    side = 1.0 if pressed else -1.0
    d0, v0 = side * contacts.now[APPROACH, i], side * contacts.now[RATE, i]
    d1, v1 = side * contacts.end[i], side * contacts.rate[i]
    ends = d1 <= 0.0 if pressed else d1 < 0.0
    return not ends and lowest_between(d0, h * v0, d1, h * v1) < -NEAR * max(d0, d1)


@inner()
def narrow_crossing(contacts, h, limits, target, bracket):
    """Next length of a step that is to end where a contact opens or closes, from a try of length h.

    Returns (target, length), the length zero where the try was good; the target is an earlier crossing if the try
    showed one. ``bracket`` holds the lengths between which the crossing lies, the size of the approach, and length,
    approach and rate of the last try: what the length changes in the approach is not quite the rate, as the force's
    polynomial changes too.
    """
    now, pressed, y, rate = contacts.now, contacts.pressed, contacts.end, contacts.rate
    for i in range(y.size):
        slack = max(
            limits.depth, LOCATED * (abs(now[APPROACH, i]) + abs(y[i]))
        )  # or contacts that open together take turns for ever
        if i != target and has_crossed(pressed[i], now[APPROACH, i], now[RATE, i], y[i], slack, limits.still):
            enclose(contacts, h, i, bracket)
            part = crossing(now[APPROACH, i], h * now[RATE, i], y[i], h * rate[i])
            return i, part * h if part < 1.0 else 0.5 * h
    miss = y[target]
    good = max(limits.depth, LOCATED * bracket[SIZE])
    if abs(miss) <= good or bracket[HIGH] - bracket[LOW] <= REPEATED * bracket[HIGH]:
        return target, 0.0
    if (miss > 0.0) != pressed[target]:
        bracket[HIGH] = h
    else:
        bracket[LOW] = h
    v = rate[target]
    turn = (6.0 * (now[APPROACH, target] - miss) / h + 2.0 * now[RATE, target] + 4.0 * v) / h
    if bracket[TRIED] != h:
        v += (miss - bracket[MISSED]) / (h - bracket[TRIED]) - 0.5 * (rate[target] + bracket[SLOPE])
    bracket[TRIED] = h
    bracket[MISSED] = miss
    bracket[SLOPE] = rate[target]
    guess = bracket[LOW]
    if v != 0.0:
        wait = -miss / v
        guess = h + wait - 0.5 * turn * wait * wait / v
    if abs(guess - h) <= REPEATED * h:
        return target, 0.0
    if not bracket[LOW] < guess < bracket[HIGH]:
        guess = 0.5 * (bracket[LOW] + bracket[HIGH])
    return target, guess


@inner()
def enclose(contacts, h, target, bracket):
    """Set the bracket of `narrow_crossing` to a whole step."""
    bracket[LOW] = 0.0
    bracket[SIZE] = abs(contacts.now[APPROACH, target]) + abs(contacts.end[target])
    last_try(h, contacts.end[target], contacts.rate[target], bracket)


@inner()
def loss_factor(loss, d0, v0, d1, v1, h):
    """The factor 1 + loss * rate of a force and its slope at both ends of a step, as `cubics.cubic` takes them."""
    slope, turn = 6.0 * (d1 - d0) / h, 2.0 * (v0 + v1)
    start, end = loss * (slope - turn - 2.0 * v0), loss * (turn + 2.0 * v1 - slope)
    return 1.0 + loss * v0, start, 1.0 + loss * v1, end


@inner()
def releasing(loss, d0, v0, d1, v1, h):
    """Fraction of a step at which that factor changes its sign."""
    return crossing(*loss_factor(loss, d0, v0, d1, v1, h))


@inner()
def has_paused(contacts, h, i):
    """Whether lossy contact i stopped and started to push again, or the other way round, within a step."""
    loss = contacts.law["loss"][i]
    if loss == 0.0:
        return False
    f0, s0, f1, s1 = loss_factor(
        loss, contacts.now[APPROACH, i], contacts.now[RATE, i], contacts.end[i], contacts.rate[i], h
    )
    side = 1.0 if f1 > 0.0 else -1.0
    lowest = lowest_between(side * f0, side * s0, side * f1, side * s1)
    return side * f0 > -NO_FORCE and side * f1 > NO_FORCE and lowest < -NO_PAUSE


@inner()
def corner_value(law, i, which, d, v, memory):
    """What changes its sign at a corner of contact i's force of this kind."""
    if which == RELEASES:
        return 1.0 + law["loss"][i] * v
    if which == PARTS:
        return parting(law, i, d, memory)
    return -v if which == TURNS else d - corner_approach(spring_of(law, i))


@inner()
def last_try(length, value, slope, out_bracket):
    """The upper end of a bracket, with what `narrow_crossing` and `narrow_corner` ask of it."""
    out_bracket[HIGH] = length
    out_bracket[TRIED] = length
    out_bracket[MISSED] = value
    out_bracket[SLOPE] = slope


@inner()
def first_corner(contacts, h, depth, out_bracket):
    """The first corner within a step: contact, its kind, and when; -1, RELEASES and h where there is none.

    Felt pressed by less than ``depth`` [m] has none: its marks are rounding. ``out_bracket`` receives two times with
    the corner in between and, for secants, a third time and the value there and at the start. ``after`` (n_contacts,)
    is what they remember at the end.
    """
    law, now, y, rate, after = contacts.law, contacts.now, contacts.end, contacts.rate, contacts.after
    target, kind, at = -1, RELEASES, h
    for i in range(y.size):
        d0, v0, d1, v1 = now[APPROACH, i], now[RATE, i], y[i], rate[i]
        loss = law["loss"][i]
        if loss > 0.0 and d0 > 0.0:
            start = 1.0 + loss * v0
            end = 1.0 + loss * v1
            if end < -NO_FORCE < NO_FORCE < start or start < -NO_FORCE < NO_FORCE < end:
                root = h * releasing(loss, d0, v0, d1, v1, h)
                if 0.0 < root < at:
                    at, target, kind = root, i, RELEASES
                    last_try(h, end, start, out_bracket)
        if relaxes(law, i):
            if max(d0, d1) <= depth:
                continue
            apart = law["memory"][i] < 0.0
            start = parting(law, i, d0, law["memory"][i])
            end = parting(law, i, d1, after[i])
            least = NEAR * law["hysteresis"][i] * abs(after[i])
            if least > 0.0 and (end > least if apart else end < -least):
                start = min(start, -least) if apart else max(start, least)
                if apart:  # it meets the felt like a wall that comes, in a force of any exponent
                    low, slow = above_felt(law, i, d0, v0, law["memory"][i], apart)
                    high, fast = above_felt(law, i, d1, v1, after[i], apart)
                    root = h * crossing(min(low, 0.0), h * slow, high, h * fast)
                    if root < AT_ONCE * h:
                        return i, AGAIN, h
                else:
                    root = h * start / (start - end)
                if AT_ONCE * h <= root < at:
                    at, target, kind = root, i, PARTS
                    last_try(h, end, start, out_bracket)
            continue
        bend = corner_approach(spring_of(law, i))
        near = NEAR * bend
        if bend == np.inf or near <= 0.0:
            continue
        late, high = h, d1
        if v1 < 0.0 < v0:
            part, high = turning(d0, h * v0, d1, h * v1)
            late = part * h
        if yields(law, i) and d0 >= bend - near:
            if v1 < 0.0 < v0 and high > bend + near and 0.0 < late < at:
                at, target, kind = late, i, TURNS
                last_try(h, -v1, -v0, out_bracket)
            continue
        deepens = d0 < bend - near and high > bend + near
        if deepens or (not yields(law, i) and d0 > bend + near and d1 < bend - near):
            if not deepens:
                late, high = h, d1
            root = h * crossing(d0 - bend, h * v0, d1 - bend, h * v1) if (d0 < bend) != (d1 < bend) else -1.0
            if root <= 0.0 or root > late:
                root = late * (bend - d0) / (high - d0)
            if root < at:
                at, target, kind = root, i, BENDS
                last_try(late, high - bend, d0 - bend, out_bracket)
    out_bracket[LOW] = 0.0
    return target, kind, at


@inner()
def dipped_felt(contacts, h, i):
    """Whether a body left its felt and met it again within a step, by the cubic of what makes it push."""
    law, now, y, rate, after = contacts.law, contacts.now, contacts.end, contacts.rate, contacts.after
    z0, z1 = law["memory"][i], after[i]
    if z0 < 0.0 or y[i] <= 0.0 or now[APPROACH, i] <= 0.0:
        return False
    g0, g1 = parting(law, i, now[APPROACH, i], z0), parting(law, i, y[i], z1)
    r0 = parting_rate(law, i, now[APPROACH, i], now[RATE, i], z0)
    r1 = parting_rate(law, i, y[i], rate[i], z1)
    lowest = lowest_between(g0, h * r0, g1, h * r1)
    return g0 > 0.0 and g1 > 0.0 and lowest < -1e-6 * max(g0, g1)  # by less it has not left


@inner()
def lags_behind(contacts, level, h, i):
    """Whether felt i loses most of its approach in a step longer than its relaxation, or all force although it pushes.

    The body parts from it within such a time of the end, of which the cubic of a longer step knows too little: it may
    find no force, and the body meets the felt again.
    """
    law, approach = contacts.law, contacts.now[APPROACH, i]
    if not relaxes(law, i) or law["memory"][i] < 0.0 or level >= HALVED:
        return False
    if h > law["relaxation"][i] and contacts.end[i] < 0.5 * approach:
        return True
    return contacts.force[i] == 0.0 and parting(law, i, approach, law["memory"][i]) > 0.0


@inner()
def has_strayed(contacts, h, i):
    """Whether contact i left the corner of its law, at which its step began, and came back within the step."""
    law, now, y, rate = contacts.law, contacts.now, contacts.end, contacts.rate
    if relaxes(law, i):
        return dipped_felt(contacts, h, i)
    bend = corner_approach(spring_of(law, i))
    near = NEAR * bend
    side = 1.0 if now[RATE, i] > 0.0 else -1.0
    d0, v0, d1, v1 = side * (now[APPROACH, i] - bend), side * now[RATE, i], side * (y[i] - bend), side * rate[i]
    deepens = yields(law, i) and side > 0.0
    if bend == np.inf or abs(d0) > near or (d1 >= -near and not (deepens and v1 < 0.0)):
        return False
    high = 0.0
    if v0 > 0.0 and (v1 < 0.0 or d1 < d0):
        high = turning(d0, h * v0, d1, h * v1)[1]
    return high > near and not (deepens and v1 < 0.0)


@inner()
def narrow_corner(contacts, i, which, h, bracket):
    """Next length of a step that is to end at a corner, from a try of length h; 0 where the try was good.

    By secants inside a bracket as from `first_corner`.
    """
    law, memory = contacts.law, contacts.after[i]
    miss = corner_value(law, i, which, contacts.end[i], contacts.rate[i], memory)
    good = 0.1 * NO_FORCE
    if which == BENDS:
        good = 0.1 * NEAR * corner_approach(spring_of(law, i))
    elif which == PARTS:
        good = 0.1 * NEAR * law["hysteresis"][i] * abs(memory)
    elif which == TURNS:
        good = 1e-8 * (abs(bracket[MISSED]) + abs(bracket[SLOPE]))  # the approach errs by the square of it
    if abs(miss) <= good or bracket[HIGH] - bracket[LOW] <= NEAR * bracket[HIGH]:
        return 0.0
    bracket[LOW if miss * bracket[SLOPE] > 0.0 else HIGH] = h
    guess = h - miss * (h - bracket[TRIED]) / (miss - bracket[MISSED]) if miss != bracket[MISSED] else 0.0
    bracket[TRIED] = h
    bracket[MISSED] = miss
    if not bracket[LOW] < guess < bracket[HIGH]:
        guess = 0.5 * (bracket[LOW] + bracket[HIGH])
    return guess
