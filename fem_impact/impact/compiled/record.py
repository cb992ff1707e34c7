"""What a run leaves behind, and the impacts read from it.

A row of ``steps`` is a step or a flight: start, length, whether events were passed; then for each contact approach and
rate at its start, whether it is closed, the force there and what it gains to the end; then what each contact
remembers. Between the ends the approach is the cubic through both.
"""

from typing import Any

import numpy as np

from .build import ZERO, inner, outer
from .cubics import crossing, cubic, turning
from .events import NO_FORCE, releasing
from .law import dent, point_at, relaxes, spring_of, spring_with, stored_energies
from .laws.felt import above_felt
from .misfit import force_on, misfit
from .rounding import NEAR

from .layout import (  # isort: skip
    APPROACH, CLOSED, GAIN, HEAD, LENGTH, PUSH, RATE, REMEMBERED, SPEED, START, WIDTH,
)  # fmt: skip

FINISHED, HORIZON, IMPACTS, SETTLED, EXHAUSTED, FAILED = range(6)  # why a run ended
FULL = -1  # it did not: its record is full
PEAK_LOOKS = 16  # [-] per step for a peak force: misses (pi/11/16)**2/8 of it before the parabola


@inner()
def total_energy(bodies, contacts):
    """Kinetic and strain energy less the work of the bias force, and what the contacts store."""
    omega, bias, q, p = bodies.omega, bodies.bias, bodies.q, bodies.p
    total = 0.0
    for n in range(q.size):
        total += 0.5 * (p[n] * p[n] + (omega[n] * q[n]) ** 2) - bias[n] * q[n]
    return total + stored_energies(contacts.now[APPROACH], contacts.law)


@inner()
def memory_of(steps, law, row, i):
    """What contact i remembers in a step."""
    return steps[row, HEAD + WIDTH * law.shape[0] + i]


@inner()
def ends_of(steps, now, law, row, i):
    """Approach from the dent and its rate at both ends of a step."""
    first = HEAD + WIDTH * i
    last = row + 1 == steps.shape[0]
    low = dent(law, i, memory_of(steps, law, row, i))
    d0 = steps[row, first] - low
    v0 = steps[row, first + SPEED]
    d1 = (now[APPROACH, i] if last else steps[row + 1, first]) - low
    v1 = now[RATE, i] if last else steps[row + 1, first + SPEED]
    return d0, v0, d1, v1


@inner()
def course_of(steps, now, law, row, i):
    """Approach from the dent and its rate at both ends of a step, and the spring of contact i in it."""
    spring = spring_with(law, i, memory_of(steps, law, row, i))
    return ends_of(steps, now, law, row, i), spring


@inner()
def force_within(steps, row, course, part):
    """Force at a fraction of a step of that course, never negative, and its rate [N/s]: the law on the cubic."""
    (d0, v0, d1, v1), spring = course
    return force_on(d0, v0, d1, v1, steps[row, LENGTH], part, spring)


@outer()
def forces(steps, now, law, rows, i, part, out):
    """Force of contact i [N] and its rate [N/s], (2, n), at fractions (n,) of steps (n,)."""
    for n in range(rows.size):
        course = course_of(steps, now, law, rows[n], i)
        out[0, n], out[1, n] = force_within(steps, rows[n], course, part[n])


@inner()
def pushing(steps, now, law, row, i):
    """Fractions of a step between which contact i pushes, by the cubic through both ends; (0, 0) if it does not.

    A lossy contact stops pushing while the bodies still overlap, when they part as fast as 1 / loss. A sticky one
    slows them down to that and holds them at it but for rounding: they part then where the overlap ends.
    """
    first = HEAD + WIDTH * i
    if steps[row, first + CLOSED] == 0.0:
        return 0.0, 0.0
    h = steps[row, LENGTH]
    d0, v0, d1, v1 = ends_of(steps, now, law, row, i)
    lower = 0.0
    upper = 1.0
    if d0 < 0.0 < d1:
        lower = crossing(d0, h * v0, d1, h * v1)
    elif d1 < 0.0 < d0:
        upper = crossing(d0, h * v0, d1, h * v1)
    if relaxes(law, i):  # steps end where the body parts from the felt or meets it
        pushes = steps[row, first + PUSH] != 0.0 or steps[row, first + GAIN] != 0.0
        return (lower, upper) if pushes else (0.0, 0.0)
    loss = law["loss"][i]
    start = 1.0 + loss * v0
    end = 1.0 + loss * v1
    if start > -NO_FORCE and end > -NO_FORCE:
        return lower, upper
    if start <= 0.0 and end <= 0.0:
        return 0.0, 0.0
    at = releasing(loss, d0, v0, d1, v1, h)
    if start < 0.0:
        lower = max(lower, at)
    else:
        upper = min(upper, at)
    return lower, upper


@outer()
def nearest_turn(steps, now, law, miss, touch):
    """Approach, by the cubic from the dent, that turns back nearest to zero, the farthest, and the nearest's place.

    The place is its step and its contact; of felt, where it counts from where the force ends, and of ``miss``, the
    approach where it turned in flight or -infinity, the step is -1. The farthest is zero where none turns. Bodies that
    touch as the run begins and move by no more than ``touch`` [-] of the deepest approach since, have not turned back.
    """
    deepest = 0.0
    for row in range(steps.shape[0]):
        for i in range(now.shape[1]):
            deepest = max(deepest, steps[row, HEAD + WIDTH * i])
    touch *= deepest
    nearest = miss
    farthest = 0.0
    where = -1
    which = 0
    for i in range(now.shape[1]):
        felt = relaxes(law, i)
        rests = True
        for row in range(steps.shape[0]):
            h = steps[row, LENGTH]
            d0, v0, d1, v1 = ends_of(steps, now, law, row, i)
            rests = rests and abs(d0) <= touch and abs(d1) <= touch
            if rests:
                continue
            turns = v0 < 0.0 < v1 or v1 < 0.0 < v0
            if turns:
                farthest = max(farthest, turning(d0, h * v0, d1, h * v1)[1])
            if felt:
                z0 = memory_of(steps, law, row, i)
                last = row + 1 == steps.shape[0]
                z1 = now[REMEMBERED, i] if last else memory_of(steps, law, row + 1, i)
                d0, v0 = above_felt(law, i, d0, v0, z0, z0 < 0.0)
                d1, v1 = above_felt(law, i, d1, v1, z1, z0 < 0.0)
                turns = v0 < 0.0 < v1 or v1 < 0.0 < v0
            if turns:
                turn = turning(d0, h * v0, d1, h * v1)[1]
                if abs(turn) < abs(nearest):
                    nearest, where, which = turn, -1 if felt else row, i
    return nearest, farthest, where, which


@inner()
def mean_push(steps, row, first):
    """Mean force of a contact in a step, whose numbers begin at ``first``."""
    return steps[row, first + PUSH] + 0.5 * steps[row, first + GAIN]


@outer()
def force_missed(steps, now, law, peak):
    """Largest error [-] of the peak force that `misfit` finds in the steps.

    At a corner of the law a single step may miss, which hardly changes the peak: there two in turn count.
    """
    worst = 0.0
    for i in range(law.shape[0]):
        corner = spring_of(law, i).corner < np.inf
        before = 0.0
        for row in range(steps.shape[0]):
            first = HEAD + WIDTH * i
            miss = 0.0
            if steps[row, first + CLOSED] > 0.0:
                mean = mean_push(steps, row, first)
                (d0, v0, d1, v1), spring = course_of(steps, now, law, row, i)
                miss = misfit(mean, d0, v0, d1, v1, steps[row, LENGTH], spring, peak)
            worst = max(worst, min(miss, before) if corner else miss)
            before = miss
    return worst / peak


@inner()
def peak_in(steps, now, law, row, i):
    """Largest force of contact i in a step: where it is pressed deepest, or the largest of some looks, refined."""
    course = course_of(steps, now, law, row, i)
    (d0, v0, d1, v1), spring = course
    if spring.loss == 0.0 and spring.relaxation == 0.0:
        h = steps[row, LENGTH]
        return point_at(max(d0, d1, turning(d0, h * v0, d1, h * v1)[1] if v1 < 0.0 < v0 else 0.0), spring).force
    peak = part = 0.0
    for look in range(PEAK_LOOKS + 1):
        f, _ = force_within(steps, row, course, look / PEAK_LOOKS)
        if f > peak:
            peak = f
            part = look / PEAK_LOOKS
    spread = 1.0 / PEAK_LOOKS
    for _ in range(4):
        middle = min(max(part, spread), 1.0 - spread)
        low, _ = force_within(steps, row, course, middle - spread)
        top, _ = force_within(steps, row, course, middle)
        high, _ = force_within(steps, row, course, middle + spread)
        bend = low - 2.0 * top + high
        if bend >= 0.0:
            break
        part = middle + min(max(0.5 * (low - high) / bend, -1.0), 1.0) * spread
        peak = max(peak, force_within(steps, row, course, part)[0])
        spread *= 0.125
    return peak


@inner()
def rate_within(steps, now, law, row, i, part):
    """Approach rate of contact i at a fraction of a step, by the cubic through both ends."""
    d0, v0, d1, v1 = ends_of(steps, now, law, row, i)
    if part <= 0.0 or part >= 1.0:
        return v0 if part <= 0.0 else v1
    h = steps[row, LENGTH]
    return cubic(d0, h * v0, d1, h * v1, part)[1] / h


@inner()
def peak_between(steps, now, law, begin, end, i):
    """Largest force of contact i in the steps of a push.

    It is sought with all looks in the step with the largest of a few and in those beside it: where it lies at
    the end of a step, rounding decides which holds the larger look.
    """
    first = HEAD + WIDTH * i
    most = 0.0
    for row in range(begin, end):
        most = max(most, mean_push(steps, row, first))
    peak = 0.0
    peak_row = begin
    for row in range(begin, end):
        if mean_push(steps, row, first) >= 0.9 * most:
            course = course_of(steps, now, law, row, i)
            for look in range(2):
                f, _ = force_within(steps, row, course, 0.5 * look)
                if f > peak:
                    peak = f
                    peak_row = row
    for row in range(max(begin, peak_row - 1), min(end - 1, peak_row + 1) + 1):
        peak = max(peak, peak_in(steps, now, law, row, i))
    return peak


@inner()
def stays_in_touch(steps, row, first, slack):
    """Whether two bodies touch at the start of a step, within ``slack`` [m], and stay there."""
    return abs(steps[row, first]) <= slack and abs(steps[row, first + SPEED]) * steps[row, LENGTH] <= slack


@inner()
def still_pressed(now, law, i, d):
    """Whether contact i presses at the end of a run, where the approach from its dent is d.

    Felt releases a body that is still in its dent, where its force ends; a contact with loss may, where the bodies
    part as fast as 1 / loss.
    """
    if relaxes(law, i):
        return now[REMEMBERED, i] >= 0.0
    return d > NEAR * abs(now[APPROACH, i]) and 1.0 + law["loss"][i] * now[RATE, i] > NO_FORCE


@outer()
def find_impacts(steps, now, law, rounding, way, touch):
    """Every unbroken push, (n_impacts, 8), contact by contact.

    Its start, end, peak force, impulse and contact; how fast the bodies approach at its start and part at its end; and
    since when they have touched at rest, infinity if they met. A rate up to ``rounding`` [-] of the fastest is rest, an
    approach up to that of the ``way`` [m] that a body goes, or up to ``touch`` [-] of the deepest, either way a touch.
    They approach with 0 where they touched before or press each other as the run begins; where they do as it ends, they
    part with NaN.
    """
    n_steps, m = steps.shape[0], law.shape[0]
    result = np.empty((m * n_steps, 8))  # each takes a step at least
    count = ZERO
    fastest = deepest = 0.0
    for first in range(HEAD, HEAD + m * WIDTH, WIDTH):
        for k in range(n_steps):
            fastest = max(fastest, abs(steps[k, first + SPEED]))
            deepest = max(deepest, steps[k, first])
    still, slack = rounding * fastest, max(rounding * way, touch * deepest)
    for i in range(m):
        first = HEAD + WIDTH * i
        row: Any = ZERO
        while row < n_steps:
            lower, upper = pushing(steps, now, law, row, i)
            if lower >= upper:
                row += 1
                continue
            begin = row
            start = steps[row, START] + lower * steps[row, LENGTH]
            met = rate_within(steps, now, law, row, i, lower)
            since = np.inf
            if abs(steps[row, first]) <= slack:
                back = row
                while back >= 0 and (back == row or stays_in_touch(steps, back, first, slack)):
                    if abs(steps[back, first + SPEED]) <= still:
                        since = steps[back, START]
                    back -= 1
            if met <= still or since < np.inf or (row == 0 and steps[row, first] > slack):
                met = 0.0
            end = start
            part = impulse = 0.0
            while upper > lower:
                impulse += steps[row, LENGTH] * mean_push(steps, row, first)
                end = steps[row, START] + upper * steps[row, LENGTH]
                part = upper
                row += 1
                if upper < 1.0 or row == n_steps:
                    break
                lower, upper = pushing(steps, now, law, row, i)
                if lower > 0.0:
                    break
            left = -rate_within(steps, now, law, row - 1, i, part)
            deep = now[APPROACH, i] - dent(law, i, memory_of(steps, law, row - 1, i))
            if row == n_steps and part >= 1.0 and still_pressed(now, law, i, deep):
                left = np.nan
            peak = peak_between(steps, now, law, begin, row, i)
            if impulse > 0.0:  # a loss that has just made the force vanish may not quite do so where a run goes on
                result[count] = start, end, peak, impulse, float(i), met, left, since
                count += 1
    return result[:count].copy()
