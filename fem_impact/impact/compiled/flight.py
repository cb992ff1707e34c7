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
from .cubics import turning
from .layout import FASTEST, HARDEST, REACH, RIGID, RIGID_ACCELERATION, RIGID_RATE
from .propagation import any_of, glide, lane_table, restore
from .rounding import REPEATED

GLIDES = 40  # [-] step lengths of free flight kept, each twice the one before; does not change the result
AWAY = 1e14  # [-] over rounding of the approach: bodies that come no nearer than so much of it, 2 %, touch by no error
LASTING = 200  # [-] looks after which a proof that nothing touches again does without that
ONSET, NEVER, LATER, SLOW, UNPROVED = range(5)  # how a flight ends, see `find_onset`


@inner(arrays=arrays.approach_of, fastmath=LOOSE)
def approach_of(shape, offset, i, q, p):
    """Approach of contact i and its rate."""
    d = v = 0.0
    for n in range(q.size):
        d += shape[i, n] * q[n]
        v += shape[i, n] * p[n]
    return offset[i] + d, v


@inner(fastmath=LOOSE)
def motion_bounds(bodies, offset, i, out_bounds):
    """Rigid part and bounds of the flexible part of contact i's approach, valid for all later free time.

    Row i of out_bounds (n_contacts, 6) receives rigid position, rate and acceleration, then the largest flexible
    displacement, rate and acceleration, as named in `layout`.
    With a bias force a flexible mode swings about its static rest, hence the shift by bias/omega**2.
    """
    omega, bias, q, p = bodies.omega, bodies.bias, bodies.q, bodies.p
    position = rate = acceleration = reach = fastest = hardest = 0.0
    for n in range(q.size):
        u = bodies.shape[i, n]
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
            hardest += w * w * size * (1.0 + 2.0 * bodies.zeta[n])
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


@inner()
def approach_watched(bodies, offset, i, before, h, out_miss):
    """Approach of contact i and its rate; ``before`` (n_contacts, 2) has those of a time h ago, zero at first.

    ``out_miss`` (1,) is raised to where it turned back meanwhile, by the cubic through both ends.
    """
    d, v = approach_of(bodies.shape, offset, i, bodies.q, bodies.p)
    if v < 0.0 < before[i, 1]:
        out_miss[0] = max(out_miss[0], turning(before[i, 0], h * before[i, 1], d, h * v)[1])
    before[i, 0] = d
    before[i, 1] = v
    return d, v


@inner()
def safe_wait(bounds, i, d, v):
    """How long contact i surely does not touch from an approach d <= 0 and its rate v on, by its bounds."""
    ahead, rate, reach, hardest = bounds[i, RIGID], bounds[i, RIGID_RATE], bounds[i, REACH], bounds[i, HARDEST]
    pull = max(bounds[i, RIGID_ACCELERATION], 0.0)
    wait = quadratic_wait(d, v, hardest + pull)
    wait = max(wait, quadratic_wait(d, max(0.0, rate + bounds[i, FASTEST]), pull))
    if bounds[i, RIGID_ACCELERATION] <= 0.0 and ahead + reach <= 0.0:
        wait = max(wait, quadratic_wait(ahead + reach, max(0.0, rate), 0.0))
    return wait


@inner()
def safe_look(bounds, i, d, v):
    """The same, but short enough to find where a contact that cannot touch turns back near enough to count."""
    wait = safe_wait(bounds, i, d, v)
    apart = bounds[i, RIGID_ACCELERATION] <= 0.0 and bounds[i, RIGID] + bounds[i, REACH] <= 0.0
    if apart and bounds[i, HARDEST] > 0.0:
        # a quarter of a radian of the fastest swing: cubics then miss a turn by 1e-5 of it
        wait = min(wait, 0.25 * bounds[i, FASTEST] / bounds[i, HARDEST])
    return wait


@inner()
def carry_rigid(bounds, i, time):
    """Rigid part of contact i's approach, and its rate, after a time."""
    bounds[i, RIGID] += time * (bounds[i, RIGID_RATE] + 0.5 * bounds[i, RIGID_ACCELERATION] * time)
    bounds[i, RIGID_RATE] += time * bounds[i, RIGID_ACCELERATION]


@inner()
def surely_recedes(bounds, i, limits, look):
    """Whether contact i surely never touches again, by its bounds; first only if it stays well away, see `AWAY`."""
    still = bounds[i, RIGID_RATE] <= limits.still and bounds[i, RIGID_ACCELERATION] <= 0.0
    return still and bounds[i, RIGID] + bounds[i, REACH] <= (limits.depth if look > LASTING else -AWAY * limits.depth)


@inner()
def closes_now(bounds, offset, i, d, v, elapsed, still):
    """Whether contact i closes now, at an approach d <= 0 and its rate v."""
    pull = bounds[i, RIGID_ACCELERATION]
    driven = bounds[i, HARDEST] > 0.0 or pull > 0.0
    rises = v > still or (driven and (v > 0.0 or (v == 0.0 and elapsed + pull > 0.0)))
    return rises and -d <= REPEATED * (abs(bounds[i, RIGID]) + bounds[i, REACH] + abs(offset[i]))


@inner()
def kept_slot(flights, wait, look):
    """Which of the kept step lengths a look ahead takes: the longest up to ``wait``, a known one, or GLIDES."""
    slot = int(np.floor(np.log2(wait / flights.base))) + GLIDES // 2
    if not 2 <= slot < GLIDES:
        return GLIDES
    if look < 4 and flights.known[slot] == 0.0:  # makes do with the table of a step up to four times shorter
        slot -= 1 if flights.known[slot - 1] != 0.0 else (2 if flights.known[slot - 2] != 0.0 else 0)
    return slot


@inner()
def fly_on(bodies, flights, slot, wait, pushed, bounds):
    """Advance a state, and the rigid parts of its approaches, by a look ahead."""
    if slot == GLIDES or flights.known[slot] == 0.0:
        lane_table(bodies.omega, bodies.zeta, wait, pushed, flights.lanes[slot])
        flights.known[slot] = 1.0
    glide(flights.lanes[slot], wait, bodies.bias, bodies.q, bodies.p)
    for i in range(bounds.shape[0]):
        carry_rigid(bounds, i, wait)


@inner(allocates=True)
def find_onset(bodies, offset, flights, limits, limit, out_miss):
    """Advance a state without contact in place to the next onset, never passing one (conservative advancement).

    Each look ahead is no longer than bounds on the later motion allow. Long looks take the steps of ``flights``, which
    are kept from flight to flight; the last ones before an onset are exact. A state from which nothing touches again is
    left as it was. ``out_miss`` (1,) is raised to where an approach turns back.

    Returns (elapsed, contact, status): ONSET at `contact`; NEVER any contact again (proved); LATER than the limit;
    SLOW, looks shorter than `shortest`: hand over to a stepping scheme; UNPROVED within some 0.1 s.
    """
    q, p, m = bodies.q, bodies.p, bodies.shape.shape[0]
    elapsed = wait = 0.0
    slow = 0
    pushed = any_of(bodies.bias)
    bounds, before = np.empty((m, 6)), np.zeros((m, 2))
    old_q, old_p = q.copy(), p.copy()
    for look in range(20_000_000 // (q.size + 50)):  # some 0.1 s
        last = wait
        wait = np.inf
        first = -1
        close = True
        leading = 0.0
        for i in range(m):
            if look % 64 == 0:
                motion_bounds(bodies, offset, i, bounds)
            parted = surely_recedes(bounds, i, limits, look)
            if parted and (look == 0 or before[i, 1] <= 0.0):
                continue
            d, v = approach_watched(bodies, offset, i, before, last, out_miss)
            if parted:
                beyond = bounds[i, RIGID] + bounds[i, REACH]
                if v > 0.0 and beyond > -AWAY * limits.depth:  # it turns back later, at most from there
                    out_miss[0] = max(out_miss[0], beyond)
                continue
            d = min(d, 0.0)
            if closes_now(bounds, offset, i, d, v, elapsed, limits.still):
                return elapsed, i, ONSET
            bound = safe_look(bounds, i, d, v)
            if bound < wait:
                wait = bound
                first = i
                leading = v
                close = v > 0.0 and -d < 2.0 * v * bound
        if wait == np.inf:
            restore(old_q, old_p, q, p)
            return 0.0, -1, NEVER
        slot = GLIDES
        over = elapsed + wait >= limit
        if over:
            wait = limit - elapsed
        else:
            if wait <= REPEATED * (elapsed + wait) or wait <= 1e-14 * flights.shortest:
                return elapsed, first, ONSET if leading > 0.0 else SLOW
            if wait < flights.shortest:
                slow += 1
                if slow > 300:
                    return elapsed, first, SLOW
            if not close and bounds[first, HARDEST] != 0.0:
                slot = kept_slot(flights, wait, look)
                wait = wait if slot == GLIDES else flights.base * 2.0 ** (slot - GLIDES // 2)
        fly_on(bodies, flights, slot, wait, pushed, bounds)
        if over:
            for i in range(m):
                approach_watched(bodies, offset, i, before, wait, out_miss)
            return limit, -1, LATER
        elapsed += wait
    return elapsed, -1, UNPROVED
