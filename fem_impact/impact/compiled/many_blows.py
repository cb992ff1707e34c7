"""Many blows at once: scheme A4 in kernel form, at a cost that does not depend on the number of modes.

For two bodies and fixed strike points, all that the modes do to the approach is a convolution of the contact force with
a kernel, which is computed once for each step length (`convolution`). A blow is then a scalar recursion, `follow`:
`press` solves each step in contact by the equations of `schemes`, and the convolution gives the free approach. Flights
advance in looks of up to 16 steps (`look`); bounds on what cubics through both ends can miss prove that no touch was
passed, or mark the blow as doubtful. It ends where no body can come back (`glide`).
"""

from typing import NamedTuple

import numpy as np

from .build import ZERO, inner, outer
from .bundles import Track
from .centroids import centroid
from .cubics import LOOKS, crossing, cubic, surely_parted, turning
from .law import Point, point_at, simple, spring_of
from .laws.base import Spring
from .misfit import misfit
from .schemes import Free, Own, solve_constant, solve_ramp

from .convolution import (  # isort: skip
    END, END_RAMP, N_SPANS, MEAN, MEAN_RAMP, N_ROWS, RATE_RAMP, SPLITS, add_missed, carry, combine, convolve,
    convolve_flight,
)  # fmt: skip
from .convolution import RATE as RATE_ROW  # isort: skip
from .layout import (  # isort: skip
    APPROACH, BEGAN, BENDS, BLOW_COUNTS, BLOW_STATES, CARRIED, COMPRESSION, DEEPEST, END_AHEAD, ENDING, ENERGY,
    FORCE, FOUND_CENTROID, FOUND_IMPACTS, FOUND_IMPULSE, FOUND_MARGIN, FOUND_MISFIT, FOUND_PEAK, FOUND_STATUS,
    FOUND_STEPS, FOUND_SWING, FOUND_TIME, HELD, HIGHEST, IMPULSE, JUMPS, KNOWN, LOWEST, MARGIN, MEAN_AHEAD, MOMENT,
    N_CONTACTS, N_SEGMENTS, NEAREST, NEEDED, PEAK, PRESSED, RATE, RATE_AHEAD, SHARP, SLOPED, SWING, TOUCHED,
)  # fmt: skip

DONE, DOUBTFUL, AWKWARD, LONG = range(4)  # how a blow ended: proved apart; with something that the steps may have
# missed; in a way not followed here; longer than the kernel
NEARER, UNPROVED, APART, TOUCH = range(4)  # what a look ahead in flight found: a shorter one is needed, or kernels of
# parts of a step; no touch; a touch
PIECES = 3  # [-] of the step in which a contact opens, integrated by themselves: order 4


class MapBlow(NamedTuple):
    """What stays the same during one blow."""

    h: float  # [s] step
    per_step: float  # [1/s] its inverse
    certify: bool  # whether flights are to be proved free of touches, or only sampled
    shares: tuple[float, float]  # [-] of the bodies' kernels
    spring: Spring
    own: Own  # what a unit of a step's force takes within that step
    once: Own  # and within the next one
    linear: bool  # whether the contact is, without loss: pressed all along a step, all is straight in the last approach
    firm: float  # [N/m] stiffness of both springs in series
    lever: float  # [N/m] mean force per mean approach
    turn: float  # [N/m] what the mean force loses per approach at the end
    over: float  # [-] approach at the end per free one
    swift: float  # [m/N] what the struck surface yields at once, and its rate
    swift_rate: float  # [m/s/N]
    stiff: float  # [-] what is left of a linear contact's force when the surface yields so
    rigid: float  # [1/kg] squared shapes of all rigid motions
    static: float  # [m/N] static compliance of all flexible ones
    slack: float  # [-] part of the deepest approach that a touch or a gap must exceed to be sure


@inner(part=True)
def begin_blow(track):
    """A blow at unit speed that is about to touch."""
    track.state[:] = 0.0
    track.state[NEAREST] = np.inf
    track.counts[:] = 0
    track.state[RATE] = track.rates[0] = 1.0
    track.counts[PRESSED] = 1
    track.counts[N_SEGMENTS] = 1
    track.ends[0] = 0.0
    track.segments[0, 0] = 0
    track.segments[0, 1] = track.force.size


@inner()
def extend(kernels, shares, track, wanted):
    """Combine the kernels of both bodies for at least as many steps as wanted; the last column is that of no delay."""
    first, second = kernels.rows
    known, n_steps = track.counts[KNOWN], track.force.size
    while known < min(wanted, n_steps):
        more = min(max(32, 2 * known), n_steps)
        combine(first[:, :more], second[:, :more], shares[0], shares[1], known, track.rows[:, n_steps - more :])
        known = more
    track.counts[KNOWN] = known


@inner(part=True)
def own_of(rows, column):
    """What a unit of a step's force takes within one step, from a column of the kernel."""
    return Own(
        rows[END, column], rows[END_RAMP, column], rows[MEAN, column],
        rows[MEAN_RAMP, column], rows[RATE_ROW, column], rows[RATE_RAMP, column],
    )  # fmt: skip


@inner(part=True)
def blow_of(pairs, cell, h, certify, rows):
    """The numbers of one blow."""
    spring = spring_of(pairs.law, cell)
    last = rows.shape[1] - 1
    own, once = own_of(rows, last), own_of(rows, last - 1)
    k = spring.stiffness / (1.0 + spring.stiffness * spring.compliance)
    lever = k / (1.0 + k * own.mean)
    turn = lever * own.mean_ramp * k
    over = 1.0 / (1.0 - own.end * turn + own.end_ramp * k)
    linear = spring.exponent == 1.0 and spring.loss == 0.0
    swift = own.end + 12.0 * own.mean_ramp
    swift_rate = own.rate + (12.0 * own.mean - 6.0 * own.end) / h
    stiff = 1.0 / (1.0 + k * swift)
    return MapBlow(
        h, 1.0 / h, certify, (pairs.shares[0, cell], pairs.shares[1, cell]), spring, own, once, linear, k, lever, turn,
        over, swift, swift_rate, stiff, pairs.rigid[cell], pairs.static[cell], pairs.slack[cell],
    )  # fmt: skip


@inner()
def bound_missed(kernels, blow, track):
    """What looks ahead miss at most in the flight that begins, if all modes met in phase after every jump and bend."""
    state, missed = track.state, track.missed
    missed[:] = 0.0
    track.counts[SHARP] = 0
    for level in range(missed.shape[0]):
        for share, bound in zip(blow.shares, kernels.bounds):
            for i in range(2):
                missed[level, i] += share * (state[JUMPS] * bound[level, i, 0] + state[BENDS] * bound[level, i, 1])


@inner()
def sharpen(kernels, blow, track):
    """What looks ahead miss at most in this flight, by the amplitude that the force has left in each mode."""
    counts, moved = track.counts, track.moved
    if counts[CARRIED] == 0:
        moved[:] = 0.0
    for i in range(counts[N_SEGMENTS]):
        for m in range(counts[CARRIED], track.segments[i, 1]):
            pressed = m >= track.segments[i, 0]
            f, s = (track.force[m], track.ramp[m]) if pressed else (0.0, 0.0)
            for body in range(2):
                carry(kernels.modes[body], f, s, moved[body])
        counts[CARRIED] = max(counts[CARRIED], track.segments[i, 1])
    track.missed[:] = 0.0
    counts[SHARP] = 1
    for body in range(2):
        add_missed(kernels.modes[body], blow.shares[body], blow.h, moved[body], track.missed)


@inner(part=True)
def longest_look(blow, track, n):
    """Level of the longest look ahead from step n that might leave no doubt."""
    state = track.state
    for level in range(N_SPANS - 1, 0, -1):
        rise = state[RATE] * 2.0**level * blow.h
        error, rate_error = track.missed[SPLITS + level]
        if n + 2**level <= track.force.size and (
            state[APPROACH] + max(0.0, rise) + error < 0.0 or rise + rate_error < 0.0
        ):
            return level
    return 0


@inner()
def is_cleared(kernels, blow, track, n, end, end_rate):
    """Whether step n of a flight surely has no touch but one that lasts, looked at in halves and then in quarters."""
    h, state = blow.h, track.state
    for split in range(1, SPLITS + 1):
        parts = 2**split
        dt = h / parts
        error, rate_error = track.missed[SPLITS - split]
        sure = True
        left, slope = state[APPROACH], state[RATE]
        for i in range(1, parts + 1):
            right, steep = end, end_rate
            if i < parts:
                right, steep = (n + i / parts) * h, 1.0
                for kernel, share in zip(kernels.later, blow.shares):
                    late = kernel[i * 2 ** (SPLITS - split) - 1][:, ::-1]
                    y, rate = convolve_flight(
                        late, n - 1, track.segments, track.counts[N_SEGMENTS], track.force, track.ramp
                    )
                    right -= share * y
                    steep -= share * rate
            sure = sure and surely_parted(left, slope * dt, right, steep * dt, error + state[MARGIN], rate_error)
            if right > 0.0:
                sure = sure and end > 0.0
                break
            left, slope = right, steep
        if sure:
            return True
    return False


@inner(part=True)
def look(kernels, blow, track, n, level):
    """Look 2**level steps ahead from step n in flight: what is found, and approach and rate at the end."""
    state, counts, jump = track.state, track.counts, 2**level
    extend(kernels, blow.shares, track, n + jump + 1)
    y, turned = convolve_flight(track.rows, n + jump - 1, track.segments, counts[N_SEGMENTS], track.force, track.ramp)
    end, rate = (n + jump) * blow.h - y, 1.0 - turned
    if end > 0.0 and level > 0:
        return NEARER, end, rate
    span = jump * blow.h
    error, rate_error = track.missed[SPLITS + level]
    if not surely_parted(state[APPROACH], state[RATE] * span, end, rate * span, error + state[MARGIN], rate_error):
        if level > 0:
            return NEARER, end, rate
        if blow.certify and kernels.later[0].shape[2] == 0:
            return UNPROVED, end, rate
        if not blow.certify or not is_cleared(kernels, blow, track, n, end, rate):
            if blow.certify and counts[ENDING] == DONE and not counts[SHARP]:
                sharpen(kernels, blow, track)
                return NEARER, end, rate
            counts[ENDING] = DOUBTFUL
    if end <= 0.0 and state[RATE] > 0.0 > rate:
        state[NEAREST] = min(state[NEAREST], -turning(state[APPROACH], state[RATE] * span, end, rate * span)[1])
    return TOUCH if end > 0.0 else APART, end, rate


@inner(part=True)
def glide(blow, track, n, end, rate):
    """Take over a look without a touch, up to step n; whether the bodies never meet again.

    They part for good where the rigid motion recedes, and lies farther away than the surface can come by all energy.
    """
    state, h, impulse = track.state, blow.h, track.state[IMPULSE]
    track.ends[n] = state[APPROACH] = state[COMPRESSION] = end
    track.rates[n] = state[RATE] = rate
    state[FORCE] = state[ENERGY] = 0.0
    state[LOWEST] = min(state[LOWEST], end)
    gone = 1.0 - impulse * blow.rigid
    place = n * h - blow.rigid * (impulse * n * h - state[MOMENT])
    energy = max(0.0, impulse * (1.0 - 0.5 * impulse * blow.rigid))
    reach = place + np.sqrt(2.0 * energy * blow.static)  # beyond the farthest the surface can come
    if gone < 0.0 and reach < 0.0:
        state[NEEDED] = max(state[NEEDED], n - reach / (gone * h))
        return True
    return False


@inner(part=True)
def touch(blow, track, n, end, rate):
    """Begin a contact within step n; where it would end if nothing pushed."""
    state, counts, h = track.state, track.counts, blow.h
    state[NEAREST] = min(state[NEAREST], -state[LOWEST])
    if state[LOWEST] > -state[MARGIN]:
        counts[ENDING] = DOUBTFUL
    d, v0, v1 = state[APPROACH], state[RATE] * h, rate * h
    part = crossing(d, v0, end, v1)
    state[BEGAN] = (n + part) * h
    state[SWING] += h / abs(cubic(d, v0, end, v1, part)[1])
    state[HIGHEST] = 0.0
    track.segments[counts[N_SEGMENTS], 0] = n
    track.segments[counts[N_SEGMENTS], 1] = track.force.size
    counts[N_SEGMENTS] += 1
    counts[PRESSED] = 1
    _, mean, _ = convolve(track.rows, n, n, track.segments, counts[N_SEGMENTS], track.force, track.ramp)
    return Free(end, (n + 0.5) * h - mean, rate)


@inner(part=True)
def free_end_of(blow, track, n):
    """Where step n of a contact would end if nothing pushed: all but the last force is summed up already."""
    state, once, h = track.state, blow.once, blow.h
    end = mean = turned = 0.0
    if n > 0:
        f, s = track.force[n - 1], track.ramp[n - 1]
        end = state[END_AHEAD] + once.end * f + once.end_ramp * s
        mean = state[MEAN_AHEAD] + once.mean * f + once.mean_ramp * s
        turned = state[RATE_AHEAD] + once.rate * f + once.rate_ramp * s
    return Free((n + 1) * h - end, (n + 0.5) * h - mean, 1.0 - turned)


@inner(part=True)
def solve(blow, start, rate, free):
    """Scheme A4 for one step, or A where that fails: point at the end, mean force and what the force gains."""
    own, spring, k, d0 = blow.own, blow.spring, blow.firm, start.approach
    if blow.linear and d0 >= 0.0:
        top = blow.lever * (free.mean + own.mean_ramp * k * d0)
        y = blow.over * (free.end - own.end * top + own.end_ramp * k * d0)
        f = top - blow.turn * y
        if y > 0.0 and f >= 0.0:
            force = k * y
            return Point(y, y - spring.compliance * force, force, 0.5 * force * y), f, k * (y - d0)
    guess = start.compression + rate * blow.h if d0 > 0.0 else 0.5 * free.end
    settled, point, f, s = solve_ramp(guess, blow.h, start, rate, free, own, spring)
    if not settled:
        point, f = solve_constant(start, free.end, own.end, blow.h, spring)
        s = 0.0
    return point, f, s


@inner(part=True)
def push(blow, track, n, f, s):
    """Write the force of step n to the record, and add up its impulse, the moment of that, its jumps and bends."""
    state, h = track.state, blow.h
    track.force[n] = f
    track.ramp[n] = s
    slope = s * blow.per_step
    if blow.certify:
        state[JUMPS] += abs(f - 0.5 * s - state[HELD])
        state[BENDS] += abs(slope - state[SLOPED])
    state[HELD] = f + 0.5 * s
    state[SLOPED] = slope
    state[IMPULSE] += f * h
    state[MOMENT] += f * h * (n + 0.5) * h + s * h * h / 12.0


@inner(part=True)
def mend_end(blow, track, n, point, rate):
    """Write the end of step n to the record, mended by what the scheme's straight force misses there."""
    spring, y, missed = blow.spring, point.approach, 0.0
    if y > 0.0:
        missed = point.force * (1.0 + spring.loss * rate) - track.force[n] - 0.5 * track.ramp[n]
        if blow.linear:
            missed *= blow.stiff
        else:
            missed *= 1.0 / (1.0 + point.force * (spring.exponent / y * blow.swift + spring.loss * blow.swift_rate))
    track.ends[n + 1] = y - missed * blow.swift
    track.rates[n + 1] = rate - missed * blow.swift_rate


@inner()
def lossy_force(d0, v0, d1, v1, spring, loss, part):
    """Force at a part of a step, on the cubic through both ends; slopes and the loss factor over the step's length."""
    d, rate = cubic(d0, v0, d1, v1, part)
    return point_at(d, spring).force * (1.0 + loss * rate)


@inner()
def lossy_peak(d0, v0, d1, v1, spring, loss):
    """Largest force of a step, see `lossy_force`, on the parabola through the three looks about the largest of some.

    It may lie a little beyond an end of the step, where the looks of neither step enclose it.
    """
    best, most = 0, 0.0
    for look in range(LOOKS + 1):
        value = lossy_force(d0, v0, d1, v1, spring, loss, look / LOOKS)
        if value > most:
            best, most = look, value
    middle = min(max(best, 1), LOOKS - 1)
    left = lossy_force(d0, v0, d1, v1, spring, loss, (middle - 1) / LOOKS)
    top = lossy_force(d0, v0, d1, v1, spring, loss, middle / LOOKS)
    right = lossy_force(d0, v0, d1, v1, spring, loss, (middle + 1) / LOOKS)
    bend = left - 2.0 * top + right
    if bend >= 0.0:
        return most
    place = 0.5 * (left - right) / bend
    if abs(place) > 1.5:
        return most
    return max(most, top + 0.25 * (right - left) * place)


@inner(part=True)
def mark_peak(blow, track, n):
    """Keep the deepest approach so far and in this contact, and the largest lossy force."""
    state, spring, h = track.state, blow.spring, blow.h
    d0, v0, d1, v1 = track.ends[n], track.rates[n] * h, track.ends[n + 1], track.rates[n + 1] * h
    state[HIGHEST] = max(state[HIGHEST], d1)
    if v0 > 0.0 and v1 < 0.0:
        state[HIGHEST] = max(state[HIGHEST], turning(d0, v0, d1, v1)[1])
    state[DEEPEST] = max(state[DEEPEST], state[HIGHEST])
    if spring.loss > 0.0:
        state[PEAK] = max(state[PEAK], lossy_peak(d0, v0, d1, v1, spring, spring.loss / h))
    state[MARGIN] = blow.slack * state[DEEPEST]


@inner()
def opening(d0, free, own, spring, loss):
    """Part of a step after which a pressed contact opens, and the approach's change per step at that moment.

    The step's own force is integrated against the law, not held to one slope: the struck surface answers at once, so
    that the way the force ends sets the moment to second order. Free motion and kernel within the step are parabolas
    but for the fastest modes, whose static compliance joins that of the contact; extrapolated, it may come out below
    zero, and is none then. ``loss`` is over the step [1/m].
    """
    swift = own.end + 12.0 * own.mean_ramp
    start = d0 + swift * point_at(d0, spring).force
    first = -4.0 * start - 2.0 * free.end + 6.0 * free.mean
    second = 3.0 * (start + free.end) - 6.0 * free.mean
    k, c = spring.stiffness, spring.compliance + swift
    if spring.exponent == 1.0:  # the two springs in series as one: no division below
        k, c = k / (1.0 + k * c), 0.0
    soft = simple(k, spring.exponent, 0.0, max(0.0, c))
    fast = 6.0 * (own.mean - swift) - 2.0 * (own.end - swift)
    slow = 3.0 * (own.end - swift) - 6.0 * (own.mean - swift)
    dt = 1.0 / PIECES
    d = start
    impulse = 0.0
    for piece in range(PIECES):
        change = push = rate0 = rate = f = 0.0
        for stage in range(4):
            part = 0.0 if stage == 0 else dt if stage == 3 else 0.5 * dt
            pushed = impulse + part * f
            elastic = point_at(d + part * rate, soft).force
            free = first + 2.0 * second * (piece * dt + part) - 2.0 * slow * pushed
            f = elastic * (1.0 + loss * free) / (1.0 + fast * elastic * loss)
            rate = free - fast * f
            if stage == 0:
                rate0 = rate
            weight = dt / 6.0 if stage in (0, 3) else dt / 3.0
            change += weight * rate
            push += weight * f
        after = d + change
        if after <= 0.0:
            part = crossing(d, dt * rate0, after, dt * rate)
            return (piece + part) * dt, cubic(d, dt * rate0, after, dt * rate, part)[1] / dt
        d = after
        impulse += push
    return 1.0, rate


@inner(part=True)
def release(blow, track, n, free, y, rate):
    """End a contact within step n, which ends at the approach y with that rate."""
    state, counts, h = track.state, track.counts, blow.h
    d0, v0 = state[APPROACH], state[RATE]
    part, speed = opening(track.ends[n], free, blow.own, blow.spring, blow.spring.loss / h)
    now = (n + part) * h
    if now - state[BEGAN] < h or state[HIGHEST] < state[MARGIN]:
        counts[ENDING] = DOUBTFUL
    state[NEAREST] = min(state[NEAREST], state[HIGHEST])
    state[NEEDED] = n + 2.0
    state[LOWEST] = turning(d0, v0 * h, y, rate * h)[1] if v0 < 0.0 < rate else y
    state[SWING] += h / abs(speed)
    state[TOUCHED] += now - state[BEGAN]
    track.contacts[counts[N_CONTACTS], 0] = state[BEGAN]
    track.contacts[counts[N_CONTACTS], 1] = now
    counts[N_CONTACTS] += 1
    track.segments[counts[N_SEGMENTS] - 1, 1] = n + 1
    counts[PRESSED] = 0
    if blow.certify:
        state[JUMPS] += abs(state[HELD])
        state[BENDS] += abs(state[SLOPED])
    state[HELD] = state[SLOPED] = 0.0


@inner(part=True)
def press(blow, track, n, free):
    """Solve step n, in contact, and take it over; whether the blow can be followed further."""
    state, own, h = track.state, blow.own, blow.h
    if n + 1 < track.force.size:  # what the forces before step n do to the next one, before its own is known
        state[END_AHEAD], state[MEAN_AHEAD], state[RATE_AHEAD] = convolve(
            track.rows, n + 1, n, track.segments, track.counts[N_SEGMENTS], track.force, track.ramp
        )
    d0, v0 = state[APPROACH], state[RATE]
    start = Point(d0, state[COMPRESSION], state[FORCE], state[ENERGY])
    point, f, s = solve(blow, start, v0, free)
    y = point.approach
    rate = free.rate - own.rate * f - own.rate_ramp * s
    push(blow, track, n, f, s)
    if y <= 0.0 and (n == 0 or d0 <= 0.0):
        return False
    if v0 < 0.0 < rate and d0 > 0.0 and y > 0.0:
        low = turning(d0, v0 * h, y, rate * h)[1]
        state[NEAREST] = min(state[NEAREST], low)
        if low < max(0.2 * min(d0, y), state[MARGIN]):
            track.counts[ENDING] = DOUBTFUL
    mend_end(blow, track, n, point, rate)
    mark_peak(blow, track, n)
    if blow.spring.loss * track.rates[n + 1] < -0.9:  # at -1 it stops pushing, which is not followed here
        return False
    if y <= 0.0:
        release(blow, track, n, free, y, rate)
    state[APPROACH], state[COMPRESSION], state[FORCE], state[ENERGY] = y, point.compression, point.force, point.energy
    state[RATE] = rate
    return True


@inner()
def follow_blow(kernels, blow, track):
    """Follow one blow step by step; how it ended, and after how many steps."""
    counts = track.counts
    level = -1  # of the look ahead in flight, not yet chosen
    n = ZERO
    while n < track.force.size:
        if counts[PRESSED]:
            extend(kernels, blow.shares, track, n + 2)
            free = free_end_of(blow, track, n)
        else:
            if level < 0:
                level = longest_look(blow, track, n)
            found, end, rate = look(kernels, blow, track, n, level)
            if found == NEARER:
                level -= 1
                continue
            if found == UNPROVED:
                break
            jump = 2**level
            level = -1
            if found == APART:
                n += jump
                if glide(blow, track, n, end, rate):
                    return counts[ENDING], n
                continue
            free = touch(blow, track, n, end, rate)
        if not press(blow, track, n, free):
            return AWKWARD, n
        if not counts[PRESSED]:
            bound_missed(kernels, blow, track)
        n += 1
    return LONG, n


@inner(part=True)
def force_missed(blow, track, peak):
    """Largest error [N] of the peak force that `misfit` finds in the steps."""
    worst = 0.0
    for contact in range(track.counts[N_SEGMENTS]):
        for n in range(track.segments[contact, 0], track.segments[contact, 1]):
            d0, v0, d1, v1 = track.ends[n], track.rates[n], track.ends[n + 1], track.rates[n + 1]
            worst = max(worst, misfit(track.force[n], d0, v0, d1, v1, blow.h, blow.spring, peak))
    return worst


@inner(part=True)
def write_found(blow, track, status, n, cell, out_found):
    """Write what was found of a blow to its column of the results."""
    state, counts = track.state, track.counts
    deepest, touched = state[DEEPEST], state[TOUCHED]
    peak = state[PEAK] if blow.spring.loss > 0.0 else point_at(deepest, blow.spring).force
    out_found[FOUND_IMPACTS, cell] = counts[N_CONTACTS]
    out_found[FOUND_TIME, cell] = touched
    out_found[FOUND_IMPULSE, cell] = state[IMPULSE]
    out_found[FOUND_PEAK, cell] = peak
    out_found[FOUND_CENTROID, cell] = 0.0
    out_found[FOUND_STATUS, cell] = status
    if status == DONE and blow.certify:  # else nobody asks
        out_found[FOUND_MISFIT, cell] = force_missed(blow, track, peak) / peak
    out_found[FOUND_STEPS, cell] = n if status == LONG else state[NEEDED]
    out_found[FOUND_MARGIN, cell] = state[NEAREST] / deepest if deepest > 0.0 else np.inf
    out_found[FOUND_SWING, cell] = deepest * state[SWING] / touched if touched > 0.0 else np.inf


def made_track(n_steps: int, n_modes: int) -> Track:
    """Room for one blow of as many steps, between bodies of at most as many modes."""
    return Track(
        np.empty((N_ROWS, n_steps)), np.zeros(n_steps), np.zeros(n_steps), np.zeros(n_steps + 1),
        np.zeros(n_steps + 1), np.zeros((n_steps + 1, 2), np.int64), np.zeros((n_steps + 1, 2)), np.zeros(BLOW_STATES),
        np.zeros(BLOW_COUNTS, np.int64), np.zeros((SPLITS + N_SPANS, 2)), np.zeros((2, 2, n_modes)),
    )  # fmt: skip


@outer(allocates=False, seconds=5.0)
def run(cells, pairs, kernels, h, certify, band, track, out_found):
    """Follow the blows of some cells, all at unit speed, with one step length and kernel.

    Parameters: cells (n,) columns of ``pairs`` and of the results; h: step; certify: whether flights are to be proved
    free of touches, or only sampled; band: of the centroid, 0 for none; track: room for any one of the blows;
    out_found (N_FOUND, n_cells), see `layout`.
    """
    for cell in cells:
        begin_blow(track)
        extend(kernels, (pairs.shares[0, cell], pairs.shares[1, cell]), track, ZERO + 2)
        blow = blow_of(pairs, cell, h, certify, track.rows)
        status, n = follow_blow(kernels, blow, track)
        write_found(blow, track, status, n, cell, out_found)
        if band > 0.0 and status in (DONE, DOUBTFUL):
            out_found[FOUND_CENTROID, cell] = centroid(
                track.contacts, track.counts[N_CONTACTS], n, h, track.ends, track.rates, blow.spring, band
            )
