"""Many blows at once: scheme A4 in kernel form, at a cost that does not depend on the number of modes.

For two bodies and fixed strike points, all that the modes do to the approach is a convolution of the contact force with
a kernel, which is computed once for each step length. A blow is then a scalar recursion: `schemes` solves each step in
contact, and the convolution gives the free approach. Flights advance in looks of up to 16 steps; bounds on what cubics
through both ends can miss prove that no touch was passed, or mark the blow as doubtful.
"""

import numpy as np

from .build import LOOSE, ONE, ZERO, inner, outer
from .law import Point, at, simple
from .layout import COMPLIANCE, EXPONENT, LOSS, STIFFNESS
from .propagation import restore
from .schemes import Free, Own, solve_constant, solve_ramp

END, END_RAMP, RATE, RATE_RAMP, MEAN, MEAN_RAMP = (np.uintp(row) for row in range(6))  # rows of a kernel
N_KERNELS = 6
LEVELS = 5  # [-] lengths of a look ahead in flight: 1, 2, 4, 8 and 16 steps
SPLITS = 2  # [-] halvings of a step in flight where the whole leaves a doubt
DONE, DOUBTFUL, AWKWARD, LONG = 0, 1, 2, 3  # how a blow ended: proved apart; with something that the steps may have
# missed; in a way not followed here; longer than the kernel
MOST_WAVES = 3e8  # [-] samples times frequencies of one centroid; the engine finds those of longer blows by a transform
LANES = 32  # [-] frequencies of a spectrum found together
WAVES = 16.0  # [-] frequencies over the inverse of the time between first touch and last: errs by 1e-4; test_batches.py
FEWEST_WAVES, MOST_POINTS = 64.0, 65536.0  # [-] frequencies of a spectrum
SAMPLES = 12.0  # [-] of the force per period of a spectrum's highest frequency: the rule errs by (2 pi / 12)**4 / 720
PARTS = 2.0  # [-] and per step, at least
LOOKS = 8  # [-] parts of a look ahead judged apart where the whole leaves a doubt
PIECES = 3  # [-] of the step in which a contact opens, integrated by themselves: order 4
FEWEST = 1.0  # [-] steps of a contact at least; briefer ones are looked at closer
LETTING_GO = 0.9  # [-] loss times rate of parting from which a blow is left to the modal engine: at 1 it stops pushing
TINY = 1e-15  # [-] curvature of a straight line
NEAR_PEAK = 0.5  # [-] of the largest force: steps that reach it are held to the law
DIP = 0.2  # [-] of the lesser approach at a step's ends: one that dips lower in between is looked at closer


@outer()
def orbit(table, q, p, out_states):
    """States after 0, 1, 2, ... steps, (n_steps, 2, n_modes), of modes that start from q and p and move freely.

    Parameters: table (4 or more, n_modes): a11, a12, a21, a22 of one step as in `propagation.step_table`.
    """
    restore(q, p, out_states[0, 0], out_states[0, 1])
    for m in range(1, out_states.shape[0]):
        x, y = out_states[m - 1, 0], out_states[m - 1, 1]
        for n in range(q.size):
            out_states[m, 0, n] = table[0, n] * x[n] + table[1, n] * y[n]
            out_states[m, 1, n] = table[2, n] * x[n] + table[3, n] * y[n]


@outer()
def flight_bounds(omega, zeta, squared, h, out_bounds):
    """What cubics through both ends of a look ahead miss of a body's free motion, at unit mass.

    Parameters: out_bounds (SPLITS + LEVELS, 2, 2), for looks of 1/4, 1/2, 1, 2, 4, ... steps: of the approach and of
    its slope over the look H, after a force of unit jumps and one of unit bends (changes of its slope). A jump leaves
    a mode with the velocity u**2 / omega at most, a bend with u**2 / omega**2. The cubic misses H**4 / 384 and
    sqrt(3) / 216 H**4 times the fourth derivative, or no more than the motion itself.
    """
    out_bounds[:] = 0.0
    for n in range(omega.size):
        w, z = omega[n], zeta[n]
        if w == 0.0:
            continue
        size = squared[n] * np.sqrt(1.0 + 4.0 * z * z) / (w * w)
        for level in range(SPLITS + LEVELS):
            angle = w * h * 2.0 ** (level - SPLITS)
            steep = (angle * (1.0 + 2.0 * z)) ** 4
            missed = size * min(steep / 384.0, 2.0 + 0.25 * angle)
            missed_rate = size * min(np.sqrt(3.0) / 216.0 * steep, 3.0 + 2.0 * angle)
            out_bounds[level, 0, 0] += missed
            out_bounds[level, 0, 1] += missed / w
            out_bounds[level, 1, 0] += missed_rate
            out_bounds[level, 1, 1] += missed_rate / w


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
    t = d0 / (d0 - d1)
    for _ in range(60):
        value, slope = cubic(d0, v0, d1, v1, t)
        if (value > 0.0) == (d1 > 0.0):
            high = t
        else:
            low = t
        new = t - value / slope if slope != 0.0 else 0.5 * (low + high)
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - t) < 1e-9:  # the next would change it by the square of that
            return new
        t = new
    return t


@inner()
def turning(d0, v0, d1, v1):
    """Value where that cubic turns in between, its end slopes differing in sign."""
    a = 3.0 * (2.0 * (d0 - d1) + v0 + v1)
    b = 3.0 * (d1 - d0) - 2.0 * v0 - v1
    root = np.sqrt(max(0.0, b * b - a * v0))
    t = -v0 / (b + root) if v0 < 0.0 else v0 / (root - b)
    return cubic(d0, v0, d1, v1, t)[0]


@inner()
def opening(d0, free, own, spring, loss):
    """Part of a step after which a pressed contact opens, and the approach's change per step at that moment.

    The step's own force is integrated against the law, not held to one slope: the struck surface answers at once, so
    that the way the force ends sets the moment to second order. Free motion and kernel within the step are parabolas
    but for the fastest modes, whose static compliance joins that of the contact. ``loss`` is over the step [1/m].
    """
    swift = own.end + 12.0 * own.mean_ramp
    start = d0 + swift * at(d0, spring).force
    first = -4.0 * start - 2.0 * free.end + 6.0 * free.mean
    second = 3.0 * (start + free.end) - 6.0 * free.mean
    k, c = spring.stiffness, spring.compliance + swift
    if spring.exponent == 1.0:  # the two springs in series as one: no division below
        k, c = k / (1.0 + k * c), 0.0
    soft = simple(k, spring.exponent, 0.0, c)
    fast = 6.0 * (own.mean - swift) - 2.0 * (own.end - swift)
    slow = 3.0 * (own.end - swift) - 6.0 * (own.mean - swift)
    dt = 1.0 / PIECES
    d = start
    impulse = 0.0
    for piece in range(PIECES):
        change = 0.0
        push = 0.0
        rate0 = 0.0
        rate = 0.0
        f = 0.0
        for stage in range(4):
            part = 0.0 if stage == 0 else dt if stage == 3 else 0.5 * dt
            pushed = impulse + part * f
            elastic = at(d + part * rate, soft).force
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


@inner()
def parted(d0, v0, d1, v1, error, rate_error):
    """Whether an approach, known at both ends of a look ahead, surely has no touch in between but one that lasts.

    The cubic through both ends errs by at most ``error``, its slope by ``rate_error``. Falling from the start, rising
    to the end, or below zero: each part of the look must be one of these, in this order.
    """
    if d1 <= 0.0 and max(d0, d1) + 4.0 / 27.0 * (max(0.0, v0) + max(0.0, -v1)) + error < 0.0:
        return True
    a = 2.0 * (d0 - d1) + v0 + v1
    b = 3.0 * (d1 - d0) - 2.0 * v0 - v1
    falling = True
    rising = False
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
        rising = rising and low - rate_error > 0.0
        if not falling and not rising:
            top = max(value, after) + 4.0 / 27.0 * dt * (max(0.0, slope) + max(0.0, -steep))
            if not top + error < 0.0:
                rising = low - rate_error > 0.0
                if not rising:
                    return False
        value, slope = after, steep
    return d1 <= 0.0 or rising


@inner(fastmath=LOOSE)
def convolve(rows, n, known, segments, n_segments, force, ramp):
    """Approach at the end of step n, mean and rate, caused by the forces before step ``known``; rows run backwards.

    Indices without sign, here and below: loops over signed ones do not run in parallel lanes.
    """
    end = 0.0
    mean = 0.0
    rate = 0.0
    shift = rows.shape[1] - 1 - n
    for i in range(n_segments):
        low, high = segments[i, 0], min(segments[i, 1], known)
        if low < high:
            first, start = np.uintp(shift + low), np.uintp(low)
            for j in range(np.uintp(high - low)):
                f = force[start + j]
                s = ramp[start + j]
                end += rows[END, first + j] * f + rows[END_RAMP, first + j] * s
                mean += rows[MEAN, first + j] * f + rows[MEAN_RAMP, first + j] * s
                rate += rows[RATE, first + j] * f + rows[RATE_RAMP, first + j] * s
    return end, mean, rate


@inner(fastmath=LOOSE)
def convolve_flight(rows, n, segments, n_segments, force, ramp):
    """The same after all forces: approach and rate."""
    end = 0.0
    rate = 0.0
    shift = rows.shape[1] - 1 - n
    for i in range(n_segments):
        low, high = segments[i, 0], min(segments[i, 1], n)
        if low < high:
            first, start = np.uintp(shift + low), np.uintp(low)
            for j in range(np.uintp(high - low)):
                f = force[start + j]
                s = ramp[start + j]
                end += rows[END, first + j] * f + rows[END_RAMP, first + j] * s
                rate += rows[RATE, first + j] * f + rows[RATE_RAMP, first + j] * s
    return end, rate


@inner(fastmath=LOOSE)
def within(kernel, n, segments, n_segments, force, ramp):
    """Approach and rate within step n caused by all earlier forces, from a kernel later by a part of a step."""
    end = 0.0
    rate = 0.0
    for i in range(n_segments):
        low, high = segments[i, 0], min(segments[i, 1], n)
        if low < high:
            first, start = np.uintp(n - 1 - low), np.uintp(low)
            for j in range(np.uintp(high - low)):
                f = force[start + j]
                s = ramp[start + j]
                end += kernel[END, first - j] * f + kernel[END_RAMP, first - j] * s
                rate += kernel[RATE, first - j] * f + kernel[RATE_RAMP, first - j] * s
    return end, rate


@inner(fastmath=LOOSE)
def combine(target, striker, share, own, start, out_rows):
    """Kernel of both bodies, reversed in time, from delay ``start`` on."""
    n_steps = out_rows.shape[1]
    for r in range(out_rows.shape[0]):
        backwards = out_rows[r, : n_steps - start][::-1]
        first, second = target[r, start:n_steps], striker[r, start:n_steps]
        for m in range(backwards.size):
            backwards[m] = share * first[m] + own * second[m]


@inner(allocates=True, fastmath=LOOSE)
def add_spectrum(samples, start, dt, step, out_real, out_imag):
    """Add the sum of samples[k] exp(i omega (start + k dt)) for omega = 0, step, 2 step, ... to a spectrum.

    Goertzel's recursion, LANES frequencies at a time; an even number of steps between the samples.
    """
    work = np.empty((7, LANES))
    c, s, ahead, aside, twice, one, two = work[0], work[1], work[2], work[3], work[4], work[5], work[6]
    c[0] = ahead[0] = 1.0
    s[0] = aside[0] = 0.0
    cosine, sine, along, across = np.cos(step * dt), np.sin(step * dt), np.cos(step * start), np.sin(step * start)
    for i in range(1, LANES):
        c[i] = c[i - 1] * cosine - s[i - 1] * sine
        s[i] = c[i - 1] * sine + s[i - 1] * cosine
        ahead[i] = ahead[i - 1] * along - aside[i - 1] * across
        aside[i] = ahead[i - 1] * across + aside[i - 1] * along
    wide = LANES * step
    cosine, sine, along, across = np.cos(wide * dt), np.sin(wide * dt), np.cos(wide * start), np.sin(wide * start)
    for block in range(0, out_real.size, LANES):
        real, imag = out_real[block : block + LANES], out_imag[block : block + LANES]
        for i in range(LANES):
            twice[i] = 2.0 * c[i]
            one[i] = two[i] = 0.0
        for k in range(samples.size - 1, 0, -2):
            last, before = samples[k], samples[k - 1]
            for i in range(LANES):
                two[i] = last + twice[i] * one[i] - two[i]
                one[i] = before + twice[i] * two[i] - one[i]
        for i in range(LANES):
            x = samples[0] + c[i] * one[i] - two[i]
            y = s[i] * one[i]
            real[i] += ahead[i] * x - aside[i] * y
            imag[i] += ahead[i] * y + aside[i] * x
            old = c[i]
            c[i] = old * cosine - s[i] * sine
            s[i] = old * sine + s[i] * cosine
            old = ahead[i]
            ahead[i] = old * along - aside[i] * across
            aside[i] = old * across + aside[i] * along


@inner(allocates=True)
def centroid(contacts, n_contacts, n_steps, h, ends, rates, spring, limit):
    """Mean frequency of the magnitude of the force spectrum from zero to ``limit``.

    Trapezoidal sums over each contact and over the band, with the Euler-Maclaurin terms for a force that starts with a
    slope and for a magnitude that has one at the band's end. Approaches between steps are cubics. Not a number where
    the sums would take long.
    """
    begun = contacts[0, 0]
    wanted = min(max(WAVES * limit * (contacts[n_contacts - 1, 1] - begun), FEWEST_WAVES), MOST_POINTS)
    n = LANES * int(np.ceil(wanted / LANES))
    step = 2.0 * np.pi * limit / (n - 1)
    real = np.zeros(n)
    imag = np.zeros(n)
    for contact in range(n_contacts):
        start, end = contacts[contact, 0], contacts[contact, 1]
        samples = max(16.0, PARTS * (end - start) / h, SAMPLES * limit * (end - start))
        if n * samples > MOST_WAVES:
            return np.nan
        count = 2 * int(np.ceil(0.5 * samples))
        dt = (end - start) / count
        force = np.zeros(count + 1)
        for i in range(1, count):
            t = (start + i * dt) / h
            j = min(int(t), n_steps - 1)
            d, rate = cubic(ends[j], h * rates[j], ends[j + 1], h * rates[j + 1], t - j)
            force[i] = dt * max(0.0, at(d, spring).force * (1.0 + spring.loss * rate / h))
        if spring.exponent == 1.0:
            force[0] = force[1] / 12.0
            force[count] = force[count - 1] / 12.0
        add_spectrum(force, start - begun, dt, step, real, imag)
    top = 0.0
    bottom = 0.0
    for i in range(n):
        real[i] = np.sqrt(real[i] ** 2 + imag[i] ** 2)
        top += real[i] * i
        bottom += real[i]
    last, before, earlier = real[n - 1], real[n - 2], real[n - 3]
    top -= 0.5 * last * (n - 1) - real[0] / 12.0
    top -= (1.5 * last * (n - 1) - 2.0 * before * (n - 2) + 0.5 * earlier * (n - 3)) / 12.0
    bottom -= 0.5 * (real[0] + last) + (1.5 * last - 2.0 * before + 0.5 * earlier) / 12.0
    return top / bottom * limit / (n - 1)


@inner()
def doubt(level, jumps, bends, shares, bounds):
    """What a look ahead of that level misses at most of the approach and of its slope over the look."""
    error = 0.0
    rate_error = 0.0
    for share, bound in zip(shares, bounds):
        error += share * (jumps * bound[level, 0, 0] + bends * bound[level, 0, 1])
        rate_error += share * (jumps * bound[level, 1, 0] + bends * bound[level, 1, 1])
    return error, rate_error


@inner()
def cleared(d0, v0, d1, v1, h, n, jumps, bends, slack, later, bounds, shares, segments, n_segments, force, ramp):
    """Whether step n of a flight surely has no touch but one that lasts, looked at in halves and then in quarters."""
    for split in range(1, SPLITS + 1):
        parts = 2**split
        dt = h / parts
        error, rate_error = doubt(SPLITS - split, jumps, bends, shares, bounds)
        sure = True
        left, slope = d0, v0
        for i in range(1, parts + 1):
            right, steep = d1, v1
            if i < parts:
                right, steep = (n + i / parts) * h, 1.0
                for kernel, share in zip(later, shares):
                    end, rate = within(kernel[i * 2 ** (SPLITS - split) - 1], n, segments, n_segments, force, ramp)
                    right -= share * end
                    steep -= share * rate
            sure = sure and parted(left, slope * dt, right, steep * dt, error + slack, rate_error)
            if right > 0.0:
                sure = sure and d1 > 0.0
                break
            left, slope = right, steep
        if sure:
            return True
    return False


@inner(allocates=True)
def lossy_peak(d0, v0, d1, v1, spring, loss):
    """Largest force on the cubic through both ends of a step, its slopes and the loss factor over the step's length."""
    values = np.empty(LOOKS + 1)
    best = 0
    for look in range(LOOKS + 1):
        d, rate = cubic(d0, v0, d1, v1, look / LOOKS)
        values[look] = at(d, spring).force * (1.0 + loss * rate)
        best = look if values[look] > values[best] else best
    if best in (0, LOOKS):
        return values[best]
    left, right = values[best - 1], values[best + 1]
    return values[best] - 0.125 * (left - right) ** 2 / min(left - 2.0 * values[best] + right, -TINY * values[best])


@outer()
def run(
    cells, h, target, striker, target_bounds, striker_bounds, target_later, striker_later,
    certify, shares, law, rigid, static, slack, band, out,
):  # fmt: skip
    """Follow the blows of some cells, all at unit speed, with one step length and kernel.

    Parameters: cells (n,) rows of the other arrays; h: step; target, striker (6, n_steps) kernels of both; bounds of
    both (SPLITS + LEVELS, 2, 2): what a unit of the force's jumps and of its bends adds at most to the errors of
    `parted` for looks of 1/4, 1/2, 1, 2, 4, ... steps; target_later, striker_later (2**SPLITS - 1, 4, n_steps): the
    kernels 1/4, 2/4, ... of a step later, or empty, where a doubt in flight ends a blow as if it were too long;
    certify: whether flights are to be proved free of touches, or only sampled; shares (2, n_cells) [-] of both
    kernels; law (4, n_cells): stiffness, exponent, compliance in series, loss factor; rigid (n_cells,) [1/kg] squared
    shapes of all rigid motions; static (n_cells,) [m/N] static compliance of all flexible ones; slack (n_cells,): part
    of the deepest approach that a touch or a gap must exceed to be sure; band: of the centroid, 0 for none.
    out (9, n_cells): impacts, time in contact, impulse, peak force, centroid, how it ended, how far the peak was mended
    or the forces near it miss the law (relative), steps needed,
    and the relative change of the time in contact per relative change of the approach.
    """
    n_steps = target.shape[1]
    per_step = 1.0 / h
    rows = np.empty((6, n_steps))
    force = np.zeros(n_steps)
    ramp = np.zeros(n_steps)
    ends = np.zeros(n_steps + 1)
    rates = np.zeros(n_steps + 1)
    bounds, later = (target_bounds, striker_bounds), (target_later, striker_later)
    loud = 1.0 if certify else 0.0
    segments = np.zeros((n_steps + 1, 2), np.int64)
    contacts = np.zeros((n_steps + 1, 2))
    for cell in cells:
        k, a, c, loss = law[STIFFNESS, cell], law[EXPONENT, cell], law[LOSS, cell], law[COMPLIANCE, cell]
        spring = simple(k, a, loss, c)
        share, mine = shares[0, cell], shares[1, cell]
        known = min(32, n_steps)
        combine(target[:, :known], striker[:, :known], share, mine, ZERO, rows[:, n_steps - known :])
        last = n_steps - 1
        own = Own(
            rows[END, last], rows[END_RAMP, last], rows[MEAN, last],
            rows[MEAN_RAMP, last], rows[RATE, last], rows[RATE_RAMP, last],
        )  # fmt: skip
        once = last - 1
        end_once, end_ramp_once, mean_once = rows[END, once], rows[END_RAMP, once], rows[MEAN, once]
        mean_ramp_once, rate_once, rate_ramp_once = rows[MEAN_RAMP, once], rows[RATE, once], rows[RATE_RAMP, once]
        end_ahead = mean_ahead = rate_ahead = f = s = 0.0
        straight = a == 1.0 and loss == 0.0
        kk = k / (1.0 + k * c)  # a linear contact pressed all along: everything is straight in the end approach y
        lever = kk / (1.0 + kk * own.mean)
        turn = lever * own.mean_ramp * kk
        over = 1.0 / (1.0 - own.end * turn + own.end_ramp * kk)
        swift = own.end + 12.0 * own.mean_ramp
        stiff = 1.0 / (1.0 + kk * swift)
        swift_rate = own.rate + (12.0 * own.mean - 6.0 * own.end) / h
        start = Point(0.0, 0.0, 0.0, 0.0)
        rate = 1.0
        ends[0] = 0.0
        rates[0] = 1.0
        pressed = True
        began = touched = impulse = moment = deepest = mended = peak = 0.0
        jumps = bends = held = sloped = 0.0
        high = low = swing = 0.0  # farthest approaches of this contact and gap; sum of 1 / rate at their ends
        margin = needed = 0.0
        largest = ripple = ripple_at = 0.0
        count = ZERO
        level = -1
        n_segments = ONE
        segments[0, 0] = 0
        segments[0, 1] = n_steps
        status = LONG
        ending = DONE
        n = ZERO
        while n < n_steps:
            d0 = start.approach
            jump = 1
            if not pressed:
                if level < 0:  # the longest look that might leave no doubt
                    level = LEVELS - 1
                    while level > 0:
                        span = 2.0**level * h
                        error, rate_error = doubt(SPLITS + level, jumps, bends, (share, mine), bounds)
                        if n + 2**level <= n_steps and (
                            d0 + max(0.0, rate * span) + error < 0.0 or rate * span + rate_error < 0.0
                        ):
                            break
                        level -= 1
                jump = 2**level
            while n + jump + 1 > known and known < n_steps:
                more = min(2 * known, n_steps)
                combine(target[:, :more], striker[:, :more], share, mine, known, rows[:, n_steps - more :])
                known = more
            if pressed:
                end = end_ahead + end_once * f + end_ramp_once * s
                mean = mean_ahead + mean_once * f + mean_ramp_once * s
                turned = rate_ahead + rate_once * f + rate_ramp_once * s
            else:
                mean = 0.0
                end, turned = convolve_flight(rows, n + jump - 1, segments, n_segments, force, ramp)
            e = (n + jump) * h - end
            vf = 1.0 - turned
            if not pressed:
                span = jump * h
                error, rate_error = doubt(SPLITS + level, jumps, bends, (share, mine), bounds)
                if (e > 0.0 and jump > 1) or not parted(d0, rate * span, e, vf * span, error + margin, rate_error):
                    if level > 0:
                        level -= 1
                        continue
                    if certify and target_later.shape[2] == 0:
                        break
                    if not certify or not cleared(
                        d0, rate, e, vf, h, n, jumps, bends, margin, later, bounds, (share, mine),
                        segments, n_segments, force, ramp,
                    ):  # fmt: skip
                        ending = DOUBTFUL
                level = -1
                if e <= 0.0:
                    n += jump
                    ends[n] = e
                    start = Point(e, e, 0.0, 0.0)
                    rates[n] = rate = vf
                    low = min(low, e)
                    gone = 1.0 - impulse * rigid[cell]
                    place = n * h - rigid[cell] * (impulse * n * h - moment)
                    energy = max(0.0, impulse * (1.0 - 0.5 * impulse * rigid[cell]))
                    reach = place + np.sqrt(2.0 * energy * static[cell])  # beyond the farthest the surface can come
                    if gone < 0.0 and reach < 0.0:
                        status = ending
                        needed = max(needed, n - reach / (gone * h))
                        break
                    continue
                if low > -margin:
                    ending = DOUBTFUL
                part = crossing(d0, rate * h, e, vf * h)
                began = (n + part) * h
                swing += h / abs(cubic(d0, rate * h, e, vf * h, part)[1])
                high = 0.0
                pressed = True
                segments[n_segments, 0] = n
                segments[n_segments, 1] = n_steps
                n_segments += 1
                _, mean, _ = convolve(rows, n, n, segments, n_segments, force, ramp)
            if n + 1 < n_steps:  # of all but this step's force, which is not known yet: found while that is
                end_ahead, mean_ahead, rate_ahead = convolve(rows, n + 1, n, segments, n_segments, force, ramp)
            ea = (n + 0.5) * h - mean
            y = -1.0
            point = start
            free = Free(e, ea, vf)
            if straight and d0 >= 0.0:
                top = lever * (ea + own.mean_ramp * kk * d0)
                y = over * (e - own.end * top + own.end_ramp * kk * d0)
                f = top - turn * y
                s = kk * (y - d0)
                f1 = kk * y
                x1 = y - c * f1
                point = Point(y, x1, f1, 0.5 * f1 * y)
            if y <= 0.0 or f < 0.0:
                guess = start.compression + rate * h if d0 > 0.0 else 0.5 * e
                settled, point, f, s = solve_ramp(guess, h, start, rate, free, own, spring)
                if not settled:
                    point, f = solve_constant(start, e, own.end, loss / h, spring)
                    s = 0.0
                y = point.approach
            rate1 = vf - own.rate * f - own.rate_ramp * s
            force[n] = f
            ramp[n] = s
            jumps += loud * abs(f - 0.5 * s - held)
            slope = s * per_step
            bends += loud * abs(slope - sloped)
            held = f + 0.5 * s
            sloped = slope
            impulse += f * h
            moment += f * h * (n + 0.5) * h + s * h * h / 12.0
            if y <= 0.0 and (n == 0 or d0 <= 0.0):
                status = AWKWARD
                break
            dips = rate < 0.0 < rate1 and d0 > 0.0 and y > 0.0
            if dips and turning(d0, rate * h, y, rate1 * h) < max(DIP * min(d0, y), margin):
                ending = DOUBTFUL
            d, r = ends[n], rates[n]
            missed = 0.0  # by the straight force of the scheme at the step's end
            if y > 0.0:
                missed = point.force * (1.0 + loss * rate1) - f - 0.5 * s
                missed *= stiff if straight else 1.0 / (1.0 + point.force * (a / y * swift + loss * swift_rate))
            ends[n + 1] = y - missed * swift
            rates[n + 1] = rate1 - missed * swift_rate
            if y > 0.0:  # what the force misses of the law near the peak: two runs may agree on a ripple they both miss
                begin = at(max(d, 0.0), spring).force * max(0.0, 1.0 + loss * r)
                middle, speed = cubic(d, r * h, ends[n + 1], rates[n + 1] * h, 0.5)
                middle = at(middle, spring).force * max(0.0, 1.0 + loss * speed * per_step)
                final = at(ends[n + 1], spring).force * max(0.0, 1.0 + loss * rates[n + 1])
                top = max(begin, middle, final)
                largest = max(largest, top)
                miss = abs(f - (begin + 4.0 * middle + final) / 6.0)
                if ripple_at < NEAR_PEAK * largest or (top >= NEAR_PEAK * largest and miss > ripple):
                    ripple, ripple_at = (miss, top) if top >= NEAR_PEAK * largest else (0.0, largest)
            if ends[n + 1] > deepest:
                deepest = ends[n + 1]
                mended = a * abs(missed * swift) / deepest
            high = max(high, ends[n + 1])
            if r > 0.0 and rates[n + 1] < 0.0:
                high = max(high, turning(d, r * h, ends[n + 1], rates[n + 1] * h))
                deepest = max(deepest, high)
            if loss > 0.0:
                top = lossy_peak(d, r * h, ends[n + 1], rates[n + 1] * h, spring, loss / h)
                if top > peak:
                    peak = top
                    mended = abs(missed) / peak
                if loss * rates[n + 1] < -LETTING_GO:
                    status = AWKWARD
                    break
            margin = slack[cell] * deepest
            if y <= 0.0:
                part, speed = opening(d, free, own, spring, loss / h)
                now = (n + part) * h
                if now - began < FEWEST * h or high < margin:
                    ending = DOUBTFUL
                needed = n + 2.0
                low = turning(d0, rate * h, y, rate1 * h) if rate < 0.0 < rate1 else y
                swing += h / abs(speed)
                touched += now - began
                contacts[count, 0] = began
                contacts[count, 1] = now
                count += 1
                pressed = False
                level = -1
                segments[n_segments - 1, 1] = n + 1
                jumps += loud * abs(held)
                bends += loud * abs(sloped)
                held = sloped = 0.0
            start, rate = point, rate1
            n += 1
        out[0, cell] = count
        out[1, cell] = touched
        out[2, cell] = impulse
        out[3, cell] = peak if loss > 0.0 else at(deepest, spring).force
        out[4, cell] = 0.0
        out[5, cell] = status
        out[6, cell] = max(mended, ripple / largest) if largest > 0.0 else mended
        out[7, cell] = n if status == LONG else needed
        out[8, cell] = deepest * swing / touched if touched > 0.0 else np.inf
        if band > 0.0 and status in (DONE, DOUBTFUL):
            out[4, cell] = centroid(contacts, count, n, h, ends, rates, spring, band)
