"""A run with the energy-exact schemes A and A4 (see `schemes`): flight, step, event, record.

The modes move exactly; the contact forces are constant (A) or linear (A4) over the step. So one step costs a sum over
the modes before and after one scalar equation per contact, whatever the number of modes. The step in contact has a
fixed length, shortened to end at onsets and releases; in flight there are no steps.
"""

import numpy as np

from . import arrays
from .build import LOOSE, WHOLE, ZERO, inner, outer
from .events import (
    AGAIN,
    CORNER,
    CROSSING,
    EVENT_LIMIT,
    LOCATE_LIMIT,
    begin,
    dipped,
    enclose,
    first_corner,
    first_crossing,
    land,
    narrow,
    nearer,
    remember,
    remembered,
    settle,
    strayed,
)
from .flight import GLIDES, find_onset
from .law import FELT, at, harden, meet, special_of, spring_of
from .layout import (
    A11,
    A12,
    A21,
    A22,
    APPROACH,
    BLIND,
    CLOSED,
    COMPRESSION,
    ENERGY,
    FORCE,
    FREE_END,
    FREE_MEAN,
    FREE_RATE,
    HEAD,
    KIND,
    LENGTH,
    M1,
    M2,
    M3,
    MEMORY,
    OWN_END,
    OWN_END_RAMP,
    OWN_MEAN,
    OWN_MEAN_RAMP,
    OWN_RATE,
    OWN_RATE_RAMP,
    PUSH,
    RATE,
    RELAXATION,
    SHARE,
    SIZE,
    START,
)
from .propagation import N_LANE, any_of, commit, lane_table
from .record import EXHAUSTED, FAILED, FINISHED, HORIZON, IMPACTS, SETTLED, resized, total_energy
from .schemes import Free, Own, linear_guess, point_of, remembers, solve_constants, solve_ramp, solve_ramps

LEVELS = 40  # [-] halvings of the step that may be cached


@inner(arrays=arrays.contact_sums, fastmath=LOOSE)
def contact_sums(shape, lanes, h, out_sums):
    """Sums over the modes of u_i u_j times b1, c1, B0, B1, b2, c2: (6, n_contacts, n_contacts)."""
    n_contacts, n_modes = shape.shape
    for i in range(n_contacts):
        for j in range(i + 1):
            s1 = 0.0
            s4 = 0.0
            s5 = 0.0
            s6 = 0.0
            for n in range(n_modes):
                uu = shape[i, n] * shape[j, n]
                s1 += uu * lanes[A12, n]
                s4 += uu * lanes[M1, n]
                s5 += uu * lanes[M2, n]
                s6 += uu * lanes[M3, n]
            out_sums[OWN_END, i, j] = h * s4
            out_sums[OWN_END_RAMP, i, j] = h * (s5 - 0.5 * s4)
            out_sums[OWN_MEAN, i, j] = h * s5
            out_sums[OWN_MEAN_RAMP, i, j] = h * s6
            out_sums[OWN_RATE, i, j] = s1
            out_sums[OWN_RATE_RAMP, i, j] = s4 - 0.5 * s1
            for r in range(6):
                out_sums[r, j, i] = out_sums[r, i, j]


@inner(arrays=arrays.predict, fastmath=LOOSE)
def predict(shape, tables, slot, h, twice, offset, bias, q, p, out_q, out_p, out_end):
    """Free motion over one step: the new state and, per contact, end approach, mean approach and end rate (3, m).

    ``twice`` is 2 zeta omega of every mode, ``tables[slot]`` the step's `lane_table`.
    """
    n_contacts, n_modes = shape.shape
    lanes = tables[slot]
    part = 1.0 / h
    for n in range(n_modes):
        out_q[n] = lanes[A11, n] * q[n] + lanes[A12, n] * p[n] + h * lanes[M1, n] * bias[n]
        out_p[n] = lanes[A21, n] * q[n] + lanes[A22, n] * p[n] + lanes[A12, n] * bias[n]
    for i in range(n_contacts):
        end = 0.0
        mean = 0.0
        rate = 0.0
        for n in range(n_modes):
            u = shape[i, n]
            end += u * out_q[n]
            rate += u * out_p[n]
            drift = lanes[M1, n] * (p[n] + twice[n] * q[n]) + h * lanes[M2, n] * bias[n]
            mean += u * (part * lanes[A12, n] * q[n] + drift)
        out_end[FREE_END, i] = offset[i] + end
        out_end[FREE_MEAN, i] = offset[i] + mean
        out_end[FREE_RATE, i] = rate


@inner(arrays=arrays.advance, fastmath=LOOSE)
def advance(shape, tables, slot, h, twice, offset, bias, force, slope, q, p, free_q, free_p, out_end):
    """`commit` into q and p, then `predict` the next step of the same length, for one contact in one pass."""
    lanes = tables[slot]
    part = 1.0 / h
    f = force[0] - 0.5 * slope[0]
    s = slope[0]
    end = 0.0
    mean = 0.0
    rate = 0.0
    for n in range(q.size):
        u = shape[0, n]
        a12 = lanes[A12, n]
        first = lanes[M1, n]
        second = lanes[M2, n]
        x = free_q[n] - u * h * (f * first + s * second)
        v = free_p[n] - u * (f * a12 + s * first)
        q[n] = x
        p[n] = v
        g = bias[n]
        new_x = lanes[A11, n] * x + a12 * v + h * first * g
        new_v = lanes[A21, n] * x + lanes[A22, n] * v + a12 * g
        free_q[n] = new_x
        free_p[n] = new_v
        end += u * new_x
        rate += u * new_v
        mean += u * (part * a12 * x + first * (v + twice[n] * x) + h * second * g)
    out_end[FREE_END, 0] = offset[0] + end
    out_end[FREE_MEAN, 0] = offset[0] + mean
    out_end[FREE_RATE, 0] = rate


@inner()
def solve_step(ramp, h, all_sums, slot, law, now, end, work, y, f, s, rate):
    """Solve one step of length h from its prediction; 0 where a contact pushes by A (asked for or fallen to)."""
    m = y.size
    sums = all_sums[slot]
    if m == 1 and ramp and (now[APPROACH, 0] > 0.0 or end[FREE_END, 0] > 0.0):
        start, spring = point_of(now, 0), spring_of(law, 0)
        own = Own(
            sums[OWN_END, 0, 0], sums[OWN_END_RAMP, 0, 0], sums[OWN_MEAN, 0, 0],
            sums[OWN_MEAN_RAMP, 0, 0], sums[OWN_RATE, 0, 0], sums[OWN_RATE_RAMP, 0, 0],
        )  # fmt: skip
        free = Free(end[FREE_END, 0], end[FREE_MEAN, 0], end[FREE_RATE, 0])
        guess = linear_guess(start, free, own, spring)
        settled, point, f[0], s[0] = solve_ramp(guess, h, start, now[RATE, 0], free, own, spring)
        if settled:
            y[0] = point.approach
            rate[0] = free.rate - own.rate * f[0] - own.rate_ramp * s[0]
            return 1
    solve_constants(h, now, law, end[FREE_END], sums, work, y, f)
    pressed = False
    for i in range(m):
        s[i] = 0.0
        if f[i] > 0.0:
            pressed = True
    fine = 0 if pressed else 1
    if ramp and pressed and m > 1:
        keep = work[4, 1]
        for i in range(m):
            keep[i] = y[i]
            keep[m + i] = f[i]
        if solve_ramps(h, now, law, end[FREE_END], end[FREE_MEAN], end[FREE_RATE], sums, work, y, f, s):
            fine = 1
        else:
            for i in range(m):
                y[i] = keep[i]
                f[i] = keep[m + i]
                s[i] = 0.0
    for i in range(m):
        v = end[FREE_RATE, i]
        for j in range(m):
            v -= sums[OWN_RATE, i, j] * f[j] + sums[OWN_RATE_RAMP, i, j] * s[j]
        rate[i] = v
    return fine


@inner()
def keep_in_mind(h, law, now, y, f, s, rate, ramped, out_after):
    """What every contact remembers after a step of A4 (ramped) or A."""
    for i in range(y.size):
        out_after[i] = law[i, MEMORY]
        if law[i, KIND] == FELT:
            if law[i, MEMORY] < 0.0:
                out_after[i] *= np.exp(-(1.0 - law[i, SHARE]) * h / law[i, RELAXATION])
            else:
                spring = spring_of(law, i)
                smooth = ramped and (f[i] != 0.0 or s[i] != 0.0)
                out_after[i] = remembers(h, point_of(now, i), at(y[i], spring), now[RATE, i], rate[i], smooth, spring)


@inner()
def record(row, law, time, h, blind, sums, now, pressed, end, y, f, s, done):
    """Write a step of the energy-exact schemes to a row of the steps, and add up its work."""
    row[START] = time
    row[LENGTH] = h
    row[BLIND] = 1.0 if blind else 0.0
    for i in range(y.size):
        remember(law, i, row, 5, y.size, now)
        first = HEAD + 5 * i
        row[first + CLOSED] = 1.0 if f[i] > 0.0 or pressed[i] else 0.0
        row[first + PUSH] = f[i] - 0.5 * s[i]
        row[first + PUSH + 1] = s[i]
        mean = end[FREE_MEAN, i]
        for j in range(y.size):
            mean -= sums[OWN_MEAN, i, j] * f[j] + sums[OWN_MEAN_RAMP, i, j] * s[j]
        done[i] += f[i] * (y[i] - now[APPROACH, i]) + s[i] * (0.5 * (now[APPROACH, i] + y[i]) - mean)


@outer()
def run_energy(
    omega, zeta, shape, start, bias, laws, start_q, start_p, ramp, base, depth, still, horizon, max_impacts, max_steps
):
    """Follow bodies in contact with the energy-exact schemes A (ramp 0) or A4 (ramp 1).

    Parameters: omega, zeta, bias, start_q, start_p (n_modes,); shape (n_contacts, n_modes), the signed shapes at the
    contacts; start (n_contacts,) approach at zero state; laws (n_contacts, 9 or 4), see `law.spring_of`; base: the
    longest step in contact; depth [m] and still [m/s]: approaches and speeds that are rounding; horizon: where to stop
    at the latest; max_impacts: stop after so many releases.

    Returns (steps, q, p, now, done, time, status, n_fallback, n_blind). Each row of steps is a step or a flight:
    start, length, blind; then per contact start approach, start rate, whether it is closed, and the force as powers
    of the fraction of the step; then what each contact remembers. now (6, n_contacts) ends with the last approach, ..,
    rate and memory; done (n_contacts,) is the integral of force times rate [J]. A finished run ends at the last
    separation.
    """
    m, n_modes = shape.shape
    offset = start.copy()  # grows less as a contact is dented
    law = laws.copy()
    q = start_q.copy()
    p = start_p.copy()
    free_q = np.empty(n_modes)
    free_p = np.empty(n_modes)
    twice = np.empty(n_modes)
    for n in range(n_modes):
        twice[n] = 2.0 * zeta[n] * omega[n]
    tables = np.empty((LEVELS + 1, N_LANE, n_modes))
    all_sums = np.empty((LEVELS + 1, 6, m, m))
    known = np.zeros(LEVELS + 1)
    odd = known.size - 1  # where the table of a step of any other length is kept
    now = np.zeros((6, m))
    end = np.empty((3, m))
    work = np.zeros((5, max(4, 2 * m), max(4, 2 * m)))
    y = np.empty(m)
    f = np.empty(m)
    s = np.empty(m)
    rate = np.empty(m)
    after = np.zeros(m)
    pressed = np.zeros(m, np.bool_)
    bracket = np.empty(6)
    flights = np.empty((GLIDES + 1, N_LANE, n_modes))
    flown = np.zeros(GLIDES + 1)
    done = np.zeros(m)
    steps = np.zeros((64, HEAD + 6 * m))
    n_steps = ZERO
    n_fallback = 0
    n_blind = 0
    n_released = 0
    n_looks = 0
    level = 0
    events = 0
    ready = -1  # slot of the table with which the coming step is predicted already
    reset = 0.0
    which = 0
    fresh = True  # whether what the contacts remember is still to be brought up to the state
    pause = 0.0  # until when events are passed, not located
    respite = base  # how long the next such time will be
    time = 0.0
    status = EXHAUSTED
    quiet = not any_of(bias)
    special, cornered = special_of(law)
    begin(shape, offset, q, p, now, pressed)
    start_energy = total_energy(omega, bias, law, q, p, now)
    while n_steps < max_steps:
        if time >= horizon:
            status = HORIZON
            break
        if 0 < max_impacts <= n_released:
            status = IMPACTS
            break
        if n_steps + 1 >= steps.shape[0]:
            steps = resized(steps, n_steps, 2 * steps.shape[0])
        if time >= pause and not any_of(pressed):
            elapsed, first, found = find_onset(
                omega, zeta, shape, offset, bias, horizon - time, base, 1e-3 * base, depth, still, flights, flown, q, p
            )
            ready = -1
            if found == 1:
                status = FINISHED
            if found == 1 or found == 4:
                break
            land(shape, offset, law, time, elapsed, first, found, steps[n_steps], 5, now, pressed, q, p)
            if elapsed > 0.0:
                n_steps += 1
                time += elapsed
            fresh = True
            if found == 0:
                events += 1
            if found == 3:
                events = EVENT_LIMIT + 1
            else:
                continue
        if events > EVENT_LIMIT:
            pause = max(time + respite, np.nextafter(time, np.inf))  # or a late step would never be blind
            respite *= 2.0
            events = 0
        blind = time < pause
        if blind:
            level = 0
        h = base * 0.5**level
        slot = level
        if h > horizon - time:
            h = horizon - time
            slot = odd
        if slot == odd or known[slot] == 0.0:
            lane_table(omega, zeta, h, WHOLE, tables[slot])
            contact_sums(shape, tables[slot], h, all_sums[slot])
            known[slot] = 1.0
        if ready != slot:
            predict(shape, tables, slot, h, twice, offset, bias, q, p, free_q, free_p, end)
        ready = -1
        for i in range(m):
            if special and fresh:
                meet(law, i, now[APPROACH, i], now[RATE, i])
                deeper = harden(law, i, now[APPROACH, i])
                offset[i] -= deeper
                now[APPROACH, i] -= deeper
                end[FREE_END, i] -= deeper
                end[FREE_MEAN, i] -= deeper
            point = at(now[APPROACH, i], spring_of(law, i))
            now[COMPRESSION, i] = point.compression
            now[FORCE, i] = point.force
            now[ENERGY, i] = point.energy
        fresh = False
        fine = solve_step(ramp, h, all_sums, slot, law, now, end, work, y, f, s, rate)
        if special:
            keep_in_mind(h, law, now, y, f, s, rate, ramp and fine, after)
        target = -1
        if not blind:
            shorter = 0
            for i in range(m):
                if pressed[i] and y[i] <= 0.0 and now[APPROACH, i] == 0.0:
                    if now[RATE, i] > still:
                        shorter = max(shorter, 3 if level == 0 else 1)
                elif dipped(now, pressed, y, rate, h, i):
                    shorter = max(shorter, 1)
                if (
                    special
                    and pressed[i]
                    and strayed(law, now, y, rate, after, h, i, 1.0 if now[RATE, i] > 0.0 else -1.0) == 2
                ):
                    shorter = max(shorter, 1)
            if shorter > 0:
                level += shorter
                if level >= LEVELS:
                    events = EVENT_LIMIT + 1
                continue
            target, guess = first_crossing(now, pressed, y, rate, h, depth, still)
        corner = -1
        for event in (CROSSING, CORNER):  # the step is repeated so that it ends at the first crossing, then corner
            if event == CORNER:
                if not cornered or blind:
                    break
                corner, which, guess = first_corner(now, law, y, rate, after, h, True, bracket)
                if corner < 0 or which == AGAIN:
                    break
                target = -1
            elif target < 0:
                continue
            else:
                enclose(now, y, rate, h, target, bracket)
            slot = odd
            for _ in range(LOCATE_LIMIT):
                h = guess
                lane_table(omega, zeta, h, WHOLE, tables[slot])
                contact_sums(shape, tables[slot], h, all_sums[slot])
                predict(shape, tables, slot, h, twice, offset, bias, q, p, free_q, free_p, end)
                fine = solve_step(ramp, h, all_sums, slot, law, now, end, work, y, f, s, rate)
                if special:
                    keep_in_mind(h, law, now, y, f, s, rate, ramp and fine, after)
                if event == CROSSING:
                    target, guess = narrow(now, pressed, y, rate, h, depth, still, target, bracket)
                else:
                    guess = nearer(law, corner, which, h, y[corner], rate[corner], after[corner], bracket)
                if guess == 0.0:
                    break
            if event == CROSSING and not abs(y[target]) <= 1e-9 * bracket[SIZE]:
                blind = True
                if h >= 1e-3 * base:
                    target = -1
                break
        if blind and target >= 0:  # not located in a tiny step: pass the events that follow
            events = EVENT_LIMIT + 1
            continue
        if corner >= 0 and which == AGAIN:
            law[corner, MEMORY] = abs(law[corner, MEMORY])
            continue
        total = 0.0
        for i in range(m):
            total += abs(y[i]) + abs(rate[i]) + f[i]
        if not total < 1e300:
            status = FAILED
            break
        record(steps[n_steps], law, time, h, blind, all_sums[slot], now, pressed, end, y, f, s, done)
        n_steps += 1
        fresh = True
        if special:
            for i in range(m):
                law[i, MEMORY] = after[i]
        if ramp and fine == 0:
            n_fallback += 1
        if blind:
            n_blind += 1
        time += h
        if corner >= 0 and which == 3 and law[corner, MEMORY] > 0.0:
            n_released += 1
        n_released += settle(law, now, pressed, y, rate, target, depth, still)
        if target >= 0:
            events += 1
        elif level > 0 and corner < 0:
            level -= 1
        if m == 1 and slot == level and pressed[0] and time + h <= horizon:
            advance(shape, tables, slot, h, twice, offset, bias, f, s, q, p, free_q, free_p, end)
            ready = slot
        else:
            commit(shape, tables[slot], h, f, s, free_q, free_p, q, p)
        if time - reset > base:
            reset = time
            events = 0
        n_looks += 1
        if quiet and n_looks % 512 == 0 and total_energy(omega, bias, law, q, p, now) <= 1e-24 * start_energy:
            status = SETTLED
            break
    remembered(law, now)
    return resized(steps, n_steps, n_steps), q, p, now, done, time, status, n_fallback, n_blind
