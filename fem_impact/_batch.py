"""Compiled loops for many blows at once: scheme A4 in kernel form, at a cost that does not depend on the modes kept."""

import numpy as np
from numba import njit

LOOSE = {"reassoc", "contract"}  # sums may be reordered to run in parallel lanes; NaN and infinity keep their meaning
N_KERNELS = 4  # rows of a kernel, in the order of `kernel_rows`
DONE, AWKWARD, LONG = 0, 1, 2  # how a blow ended: proved apart; an event inside a step; longer than the kernel
SETTLED = 1e-12  # [-] of the approach: change at which the unknown of a step has converged
SOLVES = 30  # [-] iterations of one step at most
SAFETY = 4.0  # [-] in flight, times the fastest change seen: steps in which a gap cannot close are passed over
NEAR = 0.05  # [-] of the gap at the step's ends: a gap closing to less than this within the step is looked at closer
PARTS = 2.0  # [-] samples of the force per step, at least, from which a spectrum is taken
SAMPLES = 6.0  # [-] and per period of its highest frequency: the trapezoidal rule errs by (2 pi / 6)**4 / 720 there


@njit(cache=True, error_model="numpy", fastmath=LOOSE, nogil=True)
def kernel_rows(table, squared, out_rows):
    """Approach caused by a unit force held for one step, at the ends of that step and of all later ones.

    Parameters: table (12, n_modes) of `_kernels.step_table`; squared (n_modes,) the squared shapes; out_rows
    (4, n_steps): end value for a constant force and for the ramp t/h - 1/2; mean over the step for both.
    """
    n_modes = squared.size
    n_steps = out_rows.shape[1]
    q0 = table[4].copy()
    p0 = table[5].copy()
    q1 = table[6].copy()
    p1 = table[7].copy()
    s0 = 0.0
    s1 = 0.0
    s2 = 0.0
    s3 = 0.0
    for n in range(n_modes):
        u = squared[n]
        s0 += u * q0[n]
        s1 += u * q1[n]
        s2 += u * table[10, n]
        s3 += u * table[11, n]
    out_rows[0, 0] = s0
    out_rows[1, 0] = s1
    out_rows[2, 0] = s2
    out_rows[3, 0] = s3
    for m in range(1, n_steps):
        s0 = 0.0
        s1 = 0.0
        s2 = 0.0
        s3 = 0.0
        for n in range(n_modes):
            u = squared[n]
            s2 += u * (table[8, n] * q0[n] + table[9, n] * p0[n])
            s3 += u * (table[8, n] * q1[n] + table[9, n] * p1[n])
            x = table[0, n] * q0[n] + table[1, n] * p0[n]
            p0[n] = table[2, n] * q0[n] + table[3, n] * p0[n]
            q0[n] = x
            y = table[0, n] * q1[n] + table[1, n] * p1[n]
            p1[n] = table[2, n] * q1[n] + table[3, n] * p1[n]
            q1[n] = y
            s0 += u * x
            s1 += u * y
        out_rows[0, m] = s0
        out_rows[1, m] = s1
        out_rows[2, m] = s2
        out_rows[3, m] = s3


@njit(cache=True, error_model="numpy")
def power(x, exponent):
    """x**exponent for x >= 0 without the general power where a root will do."""
    if exponent == 1.0:
        return x
    if exponent == 1.5:
        return x * np.sqrt(x)
    return x**exponent


@njit(cache=True, error_model="numpy")
def compression(d, k, a, c):
    """Compression x of the contact spring when a residual compliance c in series takes c k x**a of the approach d."""
    if d <= 0.0 or c == 0.0:
        return d
    if a == 1.0:
        return d / (1.0 + k * c)
    low = 0.0
    high = d
    x = min(d, (d / (k * c)) ** (1.0 / a))
    for _ in range(100):
        f = k * c * power(x, a)
        r = x + f - d
        if r > 0.0:
            high = x
        else:
            low = x
        new = x - r / (1.0 + a * f / x)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 4e-16 * x:
            return new
        x = new
    return x


@njit(cache=True, error_model="numpy")
def slopes(d0, x0, f0, v0, d1, x1, f1, v1, k, a, c):
    """Average slopes between two approaches: energy over approach and force over approach; no cancellation."""
    if d0 <= 0.0 or d1 <= 0.0:
        if d0 <= 0.0 and d1 <= 0.0:
            return 0.0, 0.0
        return (v1 - v0) / (d1 - d0), (f1 - f0) / (d1 - d0)
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
        else:
            big = k * large**a
            less = k * small**a
            g = (big * large - less * small) / ((a + 1.0) * (large - small))
            d = (big - less) / (large - small)
    return (g + 0.5 * c * (f0 + f1) * d) / (1.0 + c * d), d / (1.0 + c * d)


@njit(cache=True, error_model="numpy")
def constant_force(d0, x0, f0, v0, e, b, k, a, c):
    """Scheme A: end approach y and force G(d0, y) >= 0 with y = e - b G; the root is unique and bracketed."""
    x = compression(e, k, a, c)
    f1 = k * power(x, a) if e > 0.0 else 0.0
    v1 = f1 * x / (a + 1.0) + 0.5 * c * f1 * f1 if e > 0.0 else 0.0
    g, _ = slopes(d0, x0, f0, v0, e, x, f1, v1, k, a, c)
    high = e
    low = e - b * g
    y = high
    f = 0.0
    for _ in range(200):
        y = 0.5 * (low + high)
        x = compression(y, k, a, c)
        f1 = k * power(x, a) if y > 0.0 else 0.0
        v1 = f1 * x / (a + 1.0) + 0.5 * c * f1 * f1 if y > 0.0 else 0.0
        f, _ = slopes(d0, x0, f0, v0, y, x, f1, v1, k, a, c)
        if y - e + b * f > 0.0:
            high = y
        else:
            low = y
        if high - low <= 4e-16 * (abs(high) + abs(low)):
            break
    return y, f


@njit(cache=True, error_model="numpy")
def crossing(d0, d1, mean):
    """Fraction of a step at which the parabola through both ends and the mean of the step passes zero."""
    a = 3.0 * (d0 + d1) - 6.0 * mean
    b = -4.0 * d0 - 2.0 * d1 + 6.0 * mean
    low = 0.0
    high = 1.0
    t = d0 / (d0 - d1)
    for _ in range(60):
        value = d0 + t * (b + t * a)
        if (value > 0.0) == (d1 > 0.0):
            high = t
        else:
            low = t
        turn = b + 2.0 * a * t
        new = t - value / turn if turn != 0.0 else 0.5 * (low + high)
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - t) < 1e-13:
            return new
        t = new
    return t


@njit(cache=True, error_model="numpy")
def extreme(d0, d1, mean):
    """Value of the same parabola where it turns within the step; the end value d1 where it does not."""
    a = 3.0 * (d0 + d1) - 6.0 * mean
    b = -4.0 * d0 - 2.0 * d1 + 6.0 * mean
    if a == 0.0:
        return d1
    t = -0.5 * b / a
    if 0.0 < t < 1.0:
        return d0 + t * (b + t * a)
    return d1


@njit(cache=True, error_model="numpy", fastmath=LOOSE)
def convolve(rows, n, segments, n_segments, force, ramp, out_sums):
    """Approach at the end of step n, and its mean over it, caused by all earlier forces; rows run backwards in time."""
    s0 = 0.0
    s1 = 0.0
    last = rows.shape[1] - 1 - n
    for i in range(n_segments):
        for j in range(segments[i, 0], min(segments[i, 1], n)):
            s0 += rows[0, last + j] * force[j] + rows[1, last + j] * ramp[j]
            s1 += rows[2, last + j] * force[j] + rows[3, last + j] * ramp[j]
    out_sums[0] = s0
    out_sums[1] = s1


@njit(cache=True, error_model="numpy", fastmath=LOOSE)
def combine(target, striker, target_share, striker_share, start, out_rows):
    """Kernel of both bodies, reversed in time, from delay ``start`` on."""
    n_steps = out_rows.shape[1]
    for r in range(N_KERNELS):
        for m in range(start, n_steps):
            out_rows[r, n_steps - 1 - m] = target_share * target[r, m] + striker_share * striker[r, m]


@njit(cache=True, error_model="numpy", fastmath=LOOSE)
def add_wave(amplitude, start, step, out_real, out_imag):
    """Add amplitude times exp(-i omega start) for omega = 0, step, 2 step, ... to a spectrum."""
    n = out_real.size
    lanes = 16
    cosine = np.cos(lanes * step * start)
    sine = np.sin(lanes * step * start)
    c = np.empty(lanes)
    s = np.empty(lanes)
    for i in range(lanes):
        c[i] = amplitude * np.cos(i * step * start)
        s[i] = amplitude * np.sin(i * step * start)
    for block in range(0, n - lanes + 1, lanes):
        for i in range(lanes):
            out_real[block + i] += c[i]
            out_imag[block + i] -= s[i]
            old = c[i]
            c[i] = old * cosine - s[i] * sine
            s[i] = old * sine + s[i] * cosine


@njit(cache=True, error_model="numpy")
def rate_at(j, n_steps, h, ends, means):
    """Rate of approach at the beginning of step j: mean of the parabolas of the steps before and after it."""
    if j == n_steps:
        return (2.0 * ends[j - 1] + 4.0 * ends[j] - 6.0 * means[j - 1]) / h
    after = (-4.0 * ends[j] - 2.0 * ends[j + 1] + 6.0 * means[j]) / h
    if j == 0:
        return after
    return 0.5 * (after + (2.0 * ends[j - 1] + 4.0 * ends[j] - 6.0 * means[j - 1]) / h)


@njit(cache=True, error_model="numpy")
def centroid(contacts, n_contacts, n_steps, h, ends, means, k, a, c, limit):
    """Mean frequency of the magnitude of the force spectrum from zero to ``limit``.

    Trapezoidal sums over each contact, with the Euler-Maclaurin term for a force that starts with a slope. Approaches
    between steps are cubics.
    """
    span = contacts[n_contacts - 1, 1]
    n = 16 * int(min(max(2.0 * limit * span, 32.0), 4096.0)) + 16
    step = 2.0 * np.pi * limit / (n - 1)
    real = np.zeros(n)
    imag = np.zeros(n)
    for contact in range(n_contacts):
        start, end = contacts[contact, 0], contacts[contact, 1]
        count = int(max(16.0, PARTS * (end - start) / h, SAMPLES * limit * (end - start)))
        dt = (end - start) / count
        first = 0.0
        last = 0.0
        for i in range(1, count):
            t = (start + i * dt) / h
            j = min(int(t), n_steps - 1)
            t -= j
            one = h * rate_at(j, n_steps, h, ends, means)
            two = h * rate_at(j + 1, n_steps, h, ends, means)
            cube = 2.0 * (ends[j] - ends[j + 1]) + one + two
            square = 3.0 * (ends[j + 1] - ends[j]) - 2.0 * one - two
            d = ends[j] + t * (one + t * (square + t * cube))
            if d > 0.0:
                f = k * power(compression(d, k, a, c), a)
                add_wave(f * dt, start + i * dt, step, real, imag)
                if i == 1:
                    first = f / dt
                if i == count - 1:
                    last = f / dt
        if a == 1.0:
            add_wave(first * dt * dt / 12.0, start, step, real, imag)
            add_wave(last * dt * dt / 12.0, end, step, real, imag)
    top = 0.0
    bottom = 0.0
    for i in range(n):
        size = np.sqrt(real[i] ** 2 + imag[i] ** 2)
        if i == 0 or i == n - 1:
            size *= 0.5
        top += size * i
        bottom += size
    return top / bottom * limit / (n - 1)


@njit(cache=True, error_model="numpy", nogil=True)
def run(cells, h, target, striker, shares, law, rigid, static, band, out):
    """Follow the blows of some cells, all at unit speed, with one step length and kernel.

    Parameters: cells (n,) rows of the other arrays; h: step; target, striker (4, n_steps) of `kernel_rows`; shares
    (2, n_cells) [-] of both kernels; law (3, n_cells): stiffness, exponent, compliance in series; rigid (n_cells,)
    [1/kg] squared shapes of all rigid motions; static (n_cells,) [m/N] static compliance of all flexible ones;
    band: of the centroid, 0 for none. out (6, n_cells): impacts, time in contact, impulse, peak force, centroid, how
    it ended.
    """
    n_steps = target.shape[1]
    rows = np.empty((N_KERNELS, n_steps))
    force = np.zeros(n_steps)
    ramp = np.zeros(n_steps)
    ends = np.zeros(n_steps + 1)
    means = np.zeros(n_steps)
    sums = np.empty(2)
    segments = np.zeros((n_steps + 1, 2), np.int64)
    contacts = np.zeros((n_steps + 1, 2))
    for cell in cells:
        k, a, c = law[0, cell], law[1, cell], law[2, cell]
        known = min(32, n_steps)
        for m in range(n_steps):
            force[m] = 0.0
            ramp[m] = 0.0
        share, own = shares[0, cell], shares[1, cell]
        for r in range(N_KERNELS):
            for m in range(known):
                rows[r, n_steps - 1 - m] = share * target[r, m] + own * striker[r, m]
        b0 = rows[0, n_steps - 1]
        c0 = rows[1, n_steps - 1]
        b1 = rows[2, n_steps - 1]
        c1 = rows[3, n_steps - 1]
        d0 = 0.0
        x0 = 0.0
        f0 = 0.0
        v0 = 0.0
        pressed = True
        began = 0.0
        count = 0
        touched = 0.0
        impulse = 0.0
        moment = 0.0
        peak = 0.0
        slope = 0.0
        fastest = h
        n_segments = 1
        segments[0, 0] = 0
        segments[0, 1] = n_steps
        status = LONG
        n = 0
        while n < n_steps:
            if not pressed:
                jump = int(min(-d0 / (SAFETY * fastest), n_steps - 1.0 - n))
                while n + jump - 1 >= known:
                    more = min(2 * known, n_steps)
                    combine(target[:, :more], striker[:, :more], share, own, known, rows[:, n_steps - more :])
                    known = more
                if jump > 1:
                    n += jump
                    convolve(rows, n - 1, segments, n_segments, force, ramp, sums)
                    e = n * h - sums[0]
                    fastest = max(fastest, abs(e - d0) / jump)
                    d0 = x0 = min(e, 0.0)
                    if e > 0.0:
                        status = AWKWARD
                        break
            if n >= known:
                more = min(2 * known, n_steps)
                combine(target[:, :more], striker[:, :more], share, own, known, rows[:, n_steps - more :])
                known = more
            convolve(rows, n, segments, n_segments, force, ramp, sums)
            e = (n + 1.0) * h - sums[0]
            ea = (n + 0.5) * h - sums[1]
            if d0 <= 0.0 and e <= 0.0:
                y, f, s, mean = e, 0.0, 0.0, ea
                x1, f1, v1 = y, 0.0, 0.0
            else:
                scale = max(abs(e), abs(d0))
                fine = False
                x = 0.0
                if a == 1.0 and d0 >= 0.0:
                    kk = k / (1.0 + k * c)
                    # fully pressed: everything is straight in y
                    top = kk * (ea + c1 * kk * d0) / (1.0 + kk * b1)
                    turn = kk * c1 * kk / (1.0 + kk * b1)
                    y = (e - b0 * top + c0 * kk * d0) / (1.0 - b0 * turn + c0 * kk)
                    if y > 0.0:
                        f = top - turn * y
                        s = kk * (y - d0)
                        fine = True
                        x1 = y / (1.0 + k * c)
                        f1 = kk * y
                        v1 = 0.5 * f1 * y
                if not fine:
                    x = x0 + slope * h if d0 > 0.0 else 0.5 * e
                    if not x > -scale:
                        x = 0.5 * e
                    old_x = 0.0
                    old_r = 0.0
                    y = e
                    f = 0.0
                    s = 0.0
                    settled = False
                    for iteration in range(SOLVES):
                        if x > 0.0:
                            f1 = k * power(x, a)
                            y = x + c * f1
                            v1 = f1 * x / (a + 1.0) + 0.5 * c * f1 * f1
                        else:
                            f1 = 0.0
                            y = x
                            v1 = 0.0
                        x1 = x
                        g, d = slopes(d0, x0, f0, v0, y, x1, f1, v1, k, a, c)
                        s = f1 - f0
                        f = (g + d * (ea - c1 * s - 0.5 * (d0 + y))) / (1.0 + d * b1)
                        r = y - e + b0 * f + c0 * s
                        if settled or r == 0.0:
                            fine = True
                            break
                        rate = 1.0 + 0.5 * b0 * d if iteration == 0 else (r - old_r) / (x - old_x)
                        old_x = x
                        old_r = r
                        if not abs(rate) > 0.0:
                            break
                        step = -r / rate
                        x = x + step
                        if not abs(step) < 1e3 * scale:
                            break
                        if abs(step) <= SETTLED * scale or x == old_x:
                            settled = True
                    fine = fine and f >= 0.0
                if not fine:
                    y, f = constant_force(d0, x0, f0, v0, e, b0, k, a, c)
                    s = 0.0
                    x1 = compression(y, k, a, c)
                    f1 = k * power(x1, a) if y > 0.0 else 0.0
                    v1 = f1 * x1 / (a + 1.0) + 0.5 * c * f1 * f1 if y > 0.0 else 0.0
                mean = ea - b1 * f - c1 * s
            force[n] = f
            ramp[n] = s
            ends[n + 1] = y
            means[n] = mean
            part = f * h
            impulse += part
            moment += part * (n + 0.5) * h + s * h * h / 12.0
            turn = extreme(d0, y, mean)
            if pressed:
                if y > 0.0:
                    if turn < -1e-9 * scale:
                        status = AWKWARD
                        break
                    top = f1
                    if turn > y and turn > d0:
                        top = k * power(compression(turn, k, a, c), a)
                    peak = max(peak, top)
                else:
                    if n == 0:
                        status = AWKWARD
                        break
                    if turn > d0:
                        peak = max(peak, k * power(compression(turn, k, a, c), a))
                    now = (n + crossing(d0, y, mean)) * h
                    touched += now - began
                    contacts[count, 0] = began
                    contacts[count, 1] = now
                    count += 1
                    pressed = False
                    segments[n_segments - 1, 1] = n + 1
            elif y > 0.0:
                began = (n + crossing(d0, y, mean)) * h
                pressed = True
                segments[n_segments, 0] = n
                segments[n_segments, 1] = n_steps
                n_segments += 1
                peak = max(peak, f1)
            elif turn != y and turn > -NEAR * max(-d0, -y):
                status = AWKWARD
                break
            slope = (x1 - x0) / h if x1 > 0.0 else 0.0
            fastest = max(fastest, abs(y - d0))
            d0, x0, f0, v0 = y, x1, f1, v1
            n += 1
            if not pressed:
                # apart: the rigid motions part at a known rate, and the energy left bounds how far the flexible reach
                rate = 1.0 - impulse * rigid[cell]
                if rate < 0.0:
                    place = n * h - rigid[cell] * (impulse * n * h - moment)
                    energy = max(0.0, impulse * (1.0 - 0.5 * impulse * rigid[cell]))
                    if place + np.sqrt(2.0 * energy * static[cell]) < 0.0:
                        status = DONE
                        break
        out[0, cell] = count
        out[1, cell] = touched
        out[2, cell] = impulse
        out[3, cell] = peak
        out[4, cell] = 0.0
        out[5, cell] = status
        if band > 0.0 and status == DONE:
            out[4, cell] = centroid(contacts, count, n, h, ends, means, k, a, c, band)
