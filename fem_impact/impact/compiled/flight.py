"""Free flight: the next onset of contact, or the proof that there is none.

The approach of a contact is a rigid part, a parabola of time, plus a sum of swinging modes, none of which ever exceeds
its present amplitude. These amplitudes bound displacement, rate and acceleration of the flexible part for all later
time. A flight advances by the longest time in which the bounds allow no touch (conservative advancement, Mirtich 1996)
and looks again; it cannot pass an onset. If the rigid part recedes and the bounds leave no touch at any later time, the
separation is final, and this is the proof.
"""

import numpy as np

from . import arrays
from .build import LOOSE, inner
from .layout import FASTEST, HARDEST, REACH, RIGID, RIGID_ACCELERATION, RIGID_RATE
from .propagation import any_of, glide, lane_table, restore

PATIENT = 4  # [-] looks of a flight that make do with the table of a step up to four times shorter than allowed
GLIDES = 40  # [-] step lengths of free flight kept, each twice the one before
SLOW_LOOKS = 300  # [-] looks of a flight that lead hardly on before a stepping scheme takes over
LOOK_LIMIT = 20_000_000  # [-] looks ahead times modes in one free flight before the run gives up: some 0.1 s


@inner(arrays=arrays.approach, fastmath=LOOSE)
def approach(shape, offset, i, q, p):
    """Approach of contact i and its rate."""
    d = 0.0
    v = 0.0
    for n in range(q.size):
        d += shape[i, n] * q[n]
        v += shape[i, n] * p[n]
    return offset[i] + d, v


@inner(fastmath=LOOSE)
def motion_bounds(shape, offset, omega, zeta, bias, i, q, p, out_bounds):
    """Rigid part and bounds of the flexible part of contact i's approach, valid for all later free time.

    Row i of out_bounds (n_contacts, 6) receives rigid position, rate and acceleration, then the largest flexible
    displacement, rate and acceleration, as named in `layout`.
    With a bias force a flexible mode swings about its static rest, hence the shift by bias/omega**2.
    """
    position = 0.0
    rate = 0.0
    acceleration = 0.0
    reach = 0.0
    fastest = 0.0
    hardest = 0.0
    for n in range(q.size):
        u = shape[i, n]
        w = omega[n]
        if w == 0.0:
            position += u * q[n]
            rate += u * p[n]
            acceleration += u * bias[n]
        else:
            rest = bias[n] / (w * w)
            position += u * rest
            size = abs(u) * np.sqrt((q[n] - rest) ** 2 + (p[n] / w) ** 2)
            reach += size
            fastest += w * size
            hardest += w * w * size * (1.0 + 2.0 * zeta[n])
    out_bounds[i, RIGID] = position + offset[i]
    out_bounds[i, RIGID_RATE] = rate
    out_bounds[i, RIGID_ACCELERATION] = acceleration
    out_bounds[i, REACH] = reach
    out_bounds[i, FASTEST] = fastest
    out_bounds[i, HARDEST] = hardest


@inner()
def quadratic_wait(d, v, a):
    """Largest t with d + v t + a t**2 / 2 <= 0 all along, for d <= 0 and a >= 0; infinity if never."""
    if a <= 0.0:
        return np.inf if v <= 0.0 else -d / v
    root = np.sqrt(v * v - 2.0 * a * d)
    if v >= 0.0:
        return -2.0 * d / (root + v) if root + v > 0.0 else 0.0
    return (root - v) / a


@inner(allocates=True)
def find_onset(omega, zeta, shape, offset, bias, limit, base, shortest, depth, still, tables, known, q, p):
    """Advance a state without contact in place to the next onset, never passing one (conservative advancement).

    Each look ahead is no longer than bounds on the later motion allow. Long looks take steps base * 2**k, whose tables
    (GLIDES + 1, N_LANE, n_modes) are kept from flight to flight; the last ones before an onset are exact. A state from
    which nothing touches again is left as it was.

    Returns (elapsed, contact, status): status 0 an onset at `contact`, 1 no contact ever again (proved),
    2 the limit reached, 3 too slow an advance (shorter than `shortest` per look): hand over to a stepping scheme,
    4 neither contact nor proof within LOOK_LIMIT. Rigid approaches no faster than `still` [m/s] and
    overlaps no deeper than `depth` [m] are rounding.
    """
    m = shape.shape[0]
    elapsed = 0.0
    slow = 0
    pushed = any_of(bias)
    bounds = np.empty((m, 6))
    old_q = q.copy()
    old_p = p.copy()
    for look in range(LOOK_LIMIT // (q.size + 50)):
        wait = np.inf
        first = -1
        final = True
        close = True
        leading = 0.0
        for i in range(m):
            if look % 64 == 0:
                motion_bounds(shape, offset, omega, zeta, bias, i, q, p, bounds)
            r0 = bounds[i, RIGID]
            r1 = bounds[i, RIGID_RATE]
            r2 = bounds[i, RIGID_ACCELERATION]
            reach = bounds[i, REACH]
            hardest = bounds[i, HARDEST]
            if r1 <= still and r2 <= 0.0 and r0 + reach <= depth:
                continue
            final = False
            d, v = approach(shape, offset, i, q, p)
            scale = abs(r0) + reach + abs(offset[i])
            d = min(d, 0.0)
            driven = hardest > 0.0 or r2 > 0.0
            if -d <= 4e-16 * scale and (v > still or (driven and (v > 0.0 or (v == 0.0 and elapsed + r2 > 0.0)))):
                return elapsed, i, 0
            bound = quadratic_wait(d, v, hardest + max(r2, 0.0))
            bound = max(bound, quadratic_wait(d, max(0.0, r1 + bounds[i, FASTEST]), max(r2, 0.0)))
            if r2 <= 0.0 and r0 + reach <= 0.0:
                bound = max(bound, quadratic_wait(r0 + reach, max(0.0, r1), 0.0))
            if bound < wait:
                wait = bound
                first = i
                leading = v
                close = v > 0.0 and -d < 2.0 * v * bound
        if final or wait == np.inf:
            restore(old_q, old_p, q, p)
            return 0.0, -1, 1
        slot = GLIDES
        over = elapsed + wait >= limit
        if over:
            wait = limit - elapsed
        else:
            if wait <= 4e-16 * (elapsed + wait) or wait <= 1e-14 * shortest:
                return elapsed, first, 0 if leading > 0.0 else 3
            if wait < shortest:
                slow += 1
                if slow > SLOW_LOOKS:
                    return elapsed, first, 3
            power_of_two = int(np.floor(np.log2(wait / base))) + GLIDES // 2
            if not close and bounds[first, HARDEST] != 0.0 and 2 <= power_of_two < GLIDES:
                slot = power_of_two
                if look < PATIENT and known[slot] == 0.0:
                    slot -= 1 if known[slot - 1] != 0.0 else (2 if known[slot - 2] != 0.0 else 0)
                wait = base * 2.0 ** (slot - GLIDES // 2)
        if slot == GLIDES or known[slot] == 0.0:
            lane_table(omega, zeta, wait, pushed, tables[slot])
            known[slot] = 1.0
        glide(tables[slot], wait, bias, q, p)
        if over:
            return limit, -1, 2
        elapsed += wait
        for i in range(m):
            bounds[i, RIGID] += wait * (bounds[i, RIGID_RATE] + 0.5 * bounds[i, RIGID_ACCELERATION] * wait)
            bounds[i, RIGID_RATE] += wait * bounds[i, RIGID_ACCELERATION]
    return elapsed, -1, 4
