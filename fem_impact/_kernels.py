"""Compiled loops: exact modal propagation, energy-exact contact steps and free flight; the only file with numba."""

from typing import Any

import numpy as np
from numba import config, njit
from numba.core.options import DefaultOptions

COMPILED = not config.DISABLE_JIT  # type: ignore[attr-defined]  # else a hundred times slower, as plain Python
UNCOUNTED = hasattr(DefaultOptions, "_nrt")  # whether the compiler can leave out the counting of references
LOOSE = {"reassoc", "contract"}  # sums may be reordered to run in parallel lanes; NaN and infinity keep their meaning
SERIES_LIMIT = 1.0  # [-] below this omega*h the moment recursion cancels and a power series takes over
LIGHT = 0.9  # [-] damping ratio up to which a mode takes the fast lanes
SERIES_END = 3.0  # [-] omega*h below which the fast lanes sum a power series: 13 terms leave 3e-17
ANGLE_LIMIT = 1e6  # [-] angle up to which the reduction in `waves` is exact
OVERDAMPED = 1.2  # [-] damping ratio from which the two decay rates are far enough apart for partial fractions
ZERO, WHOLE = np.int64(0), np.bool_(True)  # no literals: what is called with one is compiled for it and then again
LEVELS = 40  # [-] halvings of the step that may be cached
N_TABLE = 12  # rows of a step table, in the order of `step_table`
N_LANE = 7  # rows of what a run keeps of it, in the order of `lane_table`
PATIENT = 4  # [-] looks of a flight that make do with the table of a step up to four times shorter than allowed
GLIDES = 40  # [-] step lengths of free flight kept, each twice the one before
SLOW_LOOKS = 300  # [-] looks of a flight that lead hardly on before a stepping scheme takes over
LOOK_LIMIT = 20_000_000  # [-] looks ahead times modes in one free flight before the run gives up: some 0.1 s
WORK_ERROR = 1e-9  # [-] a step whose force's work misses the stored energy by more lost its digits: scheme A takes it
SECULAR_MISFIT = 1e-12  # [-] of the peak force: what recorded polynomials may miss of the exact force
LOCATED = 1e-11  # [-] of the approach about an event: a stored energy of 1e-22 of the step's is left out there
LET_GO = 1e-7  # [-] of the force's factor 1 + loss * rate: about zero up to this
LOCATE_LIMIT = 60  # [-] iterations for an event inside a step; bisection alone reaches rounding
EVENT_LIMIT = 64  # [-] events within one step's time: chatter, passed with unlocated steps, each time for twice as long
FINISHED, HORIZON, IMPACTS, SETTLED, EXHAUSTED, FAILED = 0, 1, 2, 3, 4, 5  # why a run ended


def outer(**options: Any) -> Any:
    """Compile for use from Python; other threads run meanwhile."""
    if UNCOUNTED:
        options["_nrt"] = True
    wrapped: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
    return njit(**wrapped, **options)


def inner(allocates: bool = False, **options: Any) -> Any:
    """Compile for use by other kernels only; part of them when they are cached, and cheaper to compile.

    What allocates no array needs no count of references, half of the time of a step with few modes.
    """
    bare: dict[str, Any] = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    if UNCOUNTED:
        bare["_nrt"] = allocates  # said in both cases, as it is inherited from the caller
    return njit(**bare, **options)


@inner()
def mode_matrix(w, z, h):
    """Exact free motion of one flexible mode: a11, a12, a22 of the state's step, then slow and fast rate and half gap.

    The rates are those of an overdamped mode, zero below; a21 is -w**2 a12.
    """
    x = z * w * h
    if z < 1.0:
        damped = w * np.sqrt((1.0 - z) * (1.0 + z))
        decay = np.exp(-x)
        s = decay * np.sin(damped * h) / damped
        c = decay * np.cos(damped * h)
        return c + z * w * s, s, c - z * w * s, 0.0, 0.0, 0.0
    if z == 1.0:
        decay = np.exp(-x)
        return decay * (1.0 + x), decay * h, decay * (1.0 - x), w, w, 0.0
    root = w * np.sqrt((z - 1.0) * (z + 1.0))
    fast = z * w + root
    slow = w * (w / fast)
    e1 = np.exp(-slow * h)
    s = e1 * (-np.expm1(-2.0 * root * h)) / (2.0 * root)
    return e1 + slow * s, s, np.exp(-fast * h) - slow * s, slow, fast, root


@inner()
def exponential_sums(z, out_sums):
    """phi_k of -z, k = 1 .. out_sums.size, z >= 0: the integrals of (1-r)**(k-1)/(k-1)! exp(-z r) over [0, 1].

    Upwards by recursion while that keeps digits (k <= z), downwards from a power series at the top.
    """
    count = out_sums.size
    upward = min(count, int(min(z, 1e6)))
    inverse = 1.0
    if upward > 0:
        out_sums[0] = -np.expm1(-z) / z
        for k in range(1, upward):
            out_sums[k] = (inverse - out_sums[k - 1]) / z
            inverse /= k + 1.0
    if upward < count:
        term = 1.0
        for k in range(2, count + 1):
            term /= k
        inverse = term * count
        total = 0.0
        for j in range(1, 60):
            total += term
            term *= -z / (count + j)
            if abs(term) < 1e-18 * total:
                break
        out_sums[count - 1] = total
        for k in range(count - 1, upward, -1):
            out_sums[k - 1] = inverse - z * out_sums[k]
            inverse *= k


@inner()
def mode_moments(w, z, h, out_moments, work):
    """Exact step of one mode: a11, a12, a22, and in out_moments the moments of its impulse response g.

    Moment k is ``h**(-k-1)`` times the integral over [0, h] of ``(h-t)**(k-1)/(k-1)! g(t)``, k = 0 being
    g(h)/h. They obey ``th**2 m[k+1] = 1/k! - 2 x m[k] - m[k-1]`` with ``th = w h``, ``x = z th``: upwards while
    k < th, downwards from a power series above; heavily damped modes take partial fractions.
    """
    count = out_moments.size - 1
    if w == 0.0:
        value = 1.0
        for k in range(count + 1):
            out_moments[k] = value
            value /= k + 2.0
        return 1.0, h, 1.0
    th = w * h
    x = z * th
    a11, a12, a22, slow, fast, root = mode_matrix(w, z, h)
    out_moments[0] = a12 / h
    heavy = z >= OVERDAMPED and fast * h >= SERIES_LIMIT
    if heavy:
        exponential_sums(slow * h, work[0])
        exponential_sums(fast * h, work[1])
        for k in range(1, count + 1):
            out_moments[k] = (work[0, k - 1] - work[1, k - 1]) / (2.0 * root * h)
        return a11, a12, a22
    upward = min(count, int(min(th, 1e6)))
    inverse = 1.0
    before = a22
    for k in range(upward):
        if k == 0 and z == 0.0:
            half = np.sin(0.5 * th) / th
            new = 2.0 * half * half
        else:
            new = (inverse - 2.0 * x * out_moments[k] - before) / (th * th)
        before = out_moments[k]
        out_moments[k + 1] = new
        inverse /= k + 1.0
    if upward < count:
        factor = 1.0
        for k in range(2, count + 2):
            factor /= k
        inverse = factor * (count + 1.0)
        last = 0.0
        now = 1.0
        top = 0.0
        above = 0.0
        for j in range(1, 80):
            top += now * factor
            factor /= count + j + 1.0
            above += now * factor
            last, now = now, -2.0 * x * now - th * th * last
            if (abs(now) + abs(last)) * factor < 1e-19 * abs(top):
                break
        out_moments[count] = top
        for k in range(count, upward + 1, -1):
            out_moments[k - 1] = inverse - 2.0 * x * out_moments[k] - th * th * above
            above = out_moments[k]
            inverse *= k
    return a11, a12, a22


@inner(fastmath={"contract"})
def waves(angle, out_sin, out_cos):
    """Sine and cosine of many angles from 0 to ANGLE_LIMIT, within 1.5 units in the last place, in parallel lanes.

    Cody and Waite's reduction by multiples of pi/2 in three parts, then the polynomials of Sun's fdlibm.
    """
    for n in range(angle.size):
        turns = np.floor(angle[n] * 0.6366197723675814 + 0.5)
        r = angle[n] - turns * 1.57079632673412561417e00
        r -= turns * 6.07710050630396597660e-11
        r -= turns * 2.02226624879595063154e-21
        z = r * r
        sine = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
        sine = 2.75573137070700676789e-06 + z * sine
        sine = -1.98412698298579493134e-04 + z * sine
        sine = 8.33333333332248946124e-03 + z * sine
        sine = r + r * z * (-1.66666666666666324348e-01 + z * sine)
        cosine = 2.08757232129817482790e-09 + z * -1.13596475577881948265e-11
        cosine = -2.75573143513906633035e-07 + z * cosine
        cosine = 2.48015872894767294178e-05 + z * cosine
        cosine = -1.38888888888741095749e-03 + z * cosine
        cosine = 4.16666666666666019037e-02 + z * cosine
        cosine = 1.0 - (0.5 * z - z * z * cosine)
        quarter = turns - 4.0 * np.floor(0.25 * turns)
        odd = (quarter == 1.0) or (quarter == 3.0)
        s = cosine if odd else sine
        c = sine if odd else cosine
        out_sin[n] = -s if quarter >= 2.0 else s
        out_cos[n] = -c if (quarter == 1.0) or (quarter == 2.0) else c


@inner(allocates=True, fastmath={"contract"})
def decays(exponent, out_decay):
    """exp(-x) of many x >= 0 within two units in the last place, in parallel lanes; zero beyond 700."""
    bits = np.empty(exponent.size, np.int64)
    for n in range(exponent.size):
        x = min(exponent[n], 700.0)
        turns = np.floor(0.5 - x * 1.4426950408889634)
        r = -x - turns * 6.93147180369123816490e-01
        r -= turns * 1.90821492927058770002e-10
        e = 1.0 + r * (1.0 / 13.0)
        e = 1.0 + r * (1.0 / 12.0) * e
        e = 1.0 + r * (1.0 / 11.0) * e
        e = 1.0 + r * (1.0 / 10.0) * e
        e = 1.0 + r * (1.0 / 9.0) * e
        e = 1.0 + r * (1.0 / 8.0) * e
        e = 1.0 + r * (1.0 / 7.0) * e
        e = 1.0 + r * (1.0 / 6.0) * e
        e = 1.0 + r * (1.0 / 5.0) * e
        e = 1.0 + r * (1.0 / 4.0) * e
        e = 1.0 + r * (1.0 / 3.0) * e
        e = 1.0 + r * (1.0 / 2.0) * e
        out_decay[n] = 1.0 + r * e
        bits[n] = (np.int64(turns) + 1023) << 52
    scale = bits.view(np.float64)
    for n in range(exponent.size):
        out_decay[n] = out_decay[n] * scale[n] if exponent[n] < 700.0 else 0.0


@inner(allocates=True, fastmath={"contract"})
def free_table(omega, zeta, h, out_free, out_double):
    """Exact free motion of every mode over h: rows a11, a12, a21, a22 of out_free (4 or more, n_modes).

    out_double (n_modes,) receives twice the damping exponent zeta omega h, zero for modes beyond the fast lanes;
    returns the number of those and of damped modes.
    """
    n_modes = omega.size
    n_single = 0
    n_damped = 0
    for n in range(n_modes):
        n_single += 1 if zeta[n] > LIGHT or omega[n] * h >= ANGLE_LIMIT else 0
        n_damped += 1 if zeta[n] != 0.0 else 0
    angle = np.empty(n_modes)
    if n_damped == 0:
        for n in range(n_modes):
            angle[n] = omega[n] * h
            out_double[n] = 0.0
    else:
        for n in range(n_modes):
            z = zeta[n] if zeta[n] <= LIGHT else 0.0
            angle[n] = omega[n] * h * np.sqrt((1.0 - z) * (1.0 + z))
            out_double[n] = z * omega[n] * h
    if n_single > 0:
        for n in range(n_modes):
            angle[n] = min(angle[n], ANGLE_LIMIT)
    waves(angle, out_free[1], out_free[0])
    if n_damped == 0:
        for n in range(n_modes):
            y = angle[n]
            c = out_free[0, n]
            out_free[1, n] = h * (out_free[1, n] / y if y > 0.0 else 1.0)
            out_free[3, n] = c
    else:
        decays(out_double, out_free[3])
        for n in range(n_modes):
            y = angle[n]
            decay = out_free[3, n]
            x = out_double[n]
            s = decay * (out_free[1, n] / y if y > 0.0 else 1.0)
            c = decay * out_free[0, n]
            out_free[0, n] = c + x * s
            out_free[1, n] = h * s
            out_free[3, n] = c - x * s
            out_double[n] = 2.0 * x
    if n_single > 0:
        for n in range(n_modes):
            if zeta[n] > LIGHT or omega[n] * h >= ANGLE_LIMIT:
                a11, a12, a22, _, _, _ = mode_matrix(omega[n], zeta[n], h)
                out_free[0, n] = a11
                out_free[1, n] = a12
                out_free[3, n] = a22
    for n in range(n_modes):
        out_free[2, n] = -omega[n] * omega[n] * out_free[1, n]
    return n_single, n_damped


@inner(allocates=True, fastmath={"contract"})
def near_moments(omega, h, double, n_damped, out_moments):
    """Moments 2 and 3 (rows 5 and 6 of out_moments) by power series, for every mode with omega h < SERIES_END."""
    n_modes = omega.size
    square = np.empty(n_modes)
    for n in range(n_modes):
        th = min(omega[n] * h, SERIES_END)
        square[n] = th * th
    if n_damped == 0:
        for n in range(n_modes):
            t2 = square[n]
            odd = 1.0 - t2 * (1.0 / 812.0)
            odd = 1.0 - t2 * (1.0 / 702.0) * odd
            odd = 1.0 - t2 * (1.0 / 600.0) * odd
            odd = 1.0 - t2 * (1.0 / 506.0) * odd
            odd = 1.0 - t2 * (1.0 / 420.0) * odd
            odd = 1.0 - t2 * (1.0 / 342.0) * odd
            odd = 1.0 - t2 * (1.0 / 272.0) * odd
            odd = 1.0 - t2 * (1.0 / 210.0) * odd
            odd = 1.0 - t2 * (1.0 / 156.0) * odd
            odd = 1.0 - t2 * (1.0 / 110.0) * odd
            odd = 1.0 - t2 * (1.0 / 72.0) * odd
            odd = 1.0 - t2 * (1.0 / 42.0) * odd
            out_moments[5, n] = (1.0 / 6.0) * (1.0 - t2 * (1.0 / 20.0) * odd)
            even = 1.0 - t2 * (1.0 / 756.0)
            even = 1.0 - t2 * (1.0 / 650.0) * even
            even = 1.0 - t2 * (1.0 / 552.0) * even
            even = 1.0 - t2 * (1.0 / 462.0) * even
            even = 1.0 - t2 * (1.0 / 380.0) * even
            even = 1.0 - t2 * (1.0 / 306.0) * even
            even = 1.0 - t2 * (1.0 / 240.0) * even
            even = 1.0 - t2 * (1.0 / 182.0) * even
            even = 1.0 - t2 * (1.0 / 132.0) * even
            even = 1.0 - t2 * (1.0 / 90.0) * even
            even = 1.0 - t2 * (1.0 / 56.0) * even
            out_moments[6, n] = (1.0 / 24.0) * (1.0 - t2 * (1.0 / 30.0) * even)
        return
    now = np.empty(n_modes)
    last = np.empty(n_modes)
    for n in range(n_modes):
        now[n] = 1.0
        last[n] = 0.0
        out_moments[5, n] = 0.0
        out_moments[6, n] = 0.0
    factor = 1.0 / 6.0
    for j in range(1, 30):
        after = factor / (j + 3.0)
        for n in range(n_modes):
            value = now[n]
            out_moments[5, n] += value * factor
            out_moments[6, n] += value * after
            now[n] = -min(double[n], 2.0 * SERIES_END) * value - square[n] * last[n]
            last[n] = value
        factor = after


@inner(allocates=True, fastmath={"contract"})
def lane_table(omega, zeta, h, whole, out_lanes):
    """Coefficients of one exact step of length h for every mode, (N_LANE, n_modes), all that others follow from.

    Rows: a11, a12, a21, a22 of the state's step; h times the moments 1 and 2 (see `mode_moments`) and times moment 3
    less half of moment 2. Lightly damped modes take parallel lanes: their moments by a power series below SERIES_END,
    by recursion above; the others go one by one. Where it is not asked for the whole, free motion without a constant
    force is all that is made.
    """
    n_modes = omega.size
    double = np.empty(n_modes)
    n_single, n_damped = free_table(omega, zeta, h, out_lanes, double)
    if not whole:
        for n in range(n_modes):
            out_lanes[4, n] = 0.0
        return
    near_moments(omega, h, double, n_damped, out_lanes)
    part = 1.0 / h
    for n in range(n_modes):
        th = omega[n] * h
        near = th < SERIES_END
        inverse = 1.0 / (1.0 if near else th * th)
        first = out_lanes[1, n] * part
        m1 = (1.0 - double[n] * first - out_lanes[3, n]) * inverse
        m2 = (1.0 - double[n] * m1 - first) * inverse
        m3 = (0.5 - double[n] * m2 - m1) * inverse
        m2 = out_lanes[5, n] if near else m2
        m3 = out_lanes[6, n] if near else m3
        m1 = 0.5 - double[n] * m2 - th * th * m3 if near else m1
        out_lanes[4, n] = h * m1
        out_lanes[5, n] = h * m2
        out_lanes[6, n] = h * (m3 - 0.5 * m2)
    if n_single > 0:
        work = np.empty((2, 3))
        m = np.empty(4)
        for n in range(n_modes):
            if zeta[n] > LIGHT or omega[n] * h >= ANGLE_LIMIT:
                mode_moments(omega[n], zeta[n], h, m, work)
                out_lanes[4, n] = h * m[1]
                out_lanes[5, n] = h * m[2]
                out_lanes[6, n] = h * (m[3] - 0.5 * m[2])


@outer()
def step_table(omega, zeta, h, out_table):
    """Coefficients of one exact step of length h for every mode, (12, n_modes).

    Rows: a11, a12, a21, a22; b1, b2 (constant force); c1, c2 (ramp t/h - 1/2); the step averages of the free motion
    A1, A2 and of the two forces B0, B1.
    """
    lanes = np.empty((N_LANE, omega.size))
    lane_table(omega, zeta, h, WHOLE, lanes)
    for n in range(omega.size):
        for k in range(4):
            out_table[k, n] = lanes[k, n]
        out_table[4, n] = h * lanes[4, n]
        out_table[5, n] = lanes[1, n]
        out_table[6, n] = h * (lanes[5, n] - 0.5 * lanes[4, n])
        out_table[7, n] = lanes[4, n] - 0.5 * lanes[1, n]
        out_table[8, n] = lanes[1, n] / h + 2.0 * zeta[n] * omega[n] * lanes[4, n]
        out_table[9, n] = lanes[4, n]
        out_table[10, n] = h * lanes[5, n]
        out_table[11, n] = h * lanes[6, n]


@inner(fastmath=LOOSE)
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
                s1 += uu * lanes[1, n]
                s4 += uu * lanes[4, n]
                s5 += uu * lanes[5, n]
                s6 += uu * lanes[6, n]
            out_sums[0, i, j] = h * s4
            out_sums[1, i, j] = h * (s5 - 0.5 * s4)
            out_sums[2, i, j] = h * s5
            out_sums[3, i, j] = h * s6
            out_sums[4, i, j] = s1
            out_sums[5, i, j] = s4 - 0.5 * s1
            for r in range(6):
                out_sums[r, j, i] = out_sums[r, i, j]


@inner()
def power(x, exponent):
    """x**exponent for x > 0 without the general power where a root will do."""
    if exponent == 1.0:
        return x
    if exponent == 1.5:
        return x * np.sqrt(x)
    return x**exponent


@inner()
def compression(d, k, a, c):
    """Compression x of the contact spring when a residual compliance c in series takes c k x**a of the approach d."""
    if c == 0.0:
        return d
    if a == 1.0:
        return d / (1.0 + k * c)
    kc = k * c
    low = 0.0
    high = d
    x = min(d, (d / kc) ** (1.0 / a))
    for _ in range(200):
        f = kc * power(x, a)
        r = x + f - d
        if r > 0.0:
            high = x
        else:
            low = x
        new = x - r / (1.0 + a * f / x)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 2e-16 * x:
            return new
        x = new
    return x


@outer()
def law_at(d, law, i):
    """Spring compression, elastic force and stored energy of contact i at approach d."""
    if d <= 0.0:
        return d, 0.0, 0.0
    k, a, c = law[i, 0], law[i, 1], law[i, 3]
    x = compression(d, k, a, c)
    f = k * power(x, a)
    return x, f, f * x / (a + 1.0) + 0.5 * c * f * f


@inner()
def law_pair(d0, x0, f0, v0, d1, x1, f1, v1, law, i):
    """Average slopes between two approaches: energy over approach (G) and force over approach (D); no cancellation."""
    if d0 <= 0.0 or d1 <= 0.0:
        if d0 <= 0.0 and d1 <= 0.0:
            return 0.0, 0.0
        return (v1 - v0) / (d1 - d0), (f1 - f0) / (d1 - d0)
    k, a, c = law[i, 0], law[i, 1], law[i, 3]
    if a == 1.0:
        g = 0.5 * k * (x0 + x1)
        d = k
    elif a == 1.5:
        r0 = np.sqrt(x0)
        r1 = np.sqrt(x1)
        s0 = x0
        s1 = x1
        g = 0.4 * k * (s1 * s1 + s1 * r1 * r0 + s1 * s0 + r1 * r0 * s0 + s0 * s0) / (r0 + r1)
        d = k * (s0 + r0 * r1 + s1) / (r0 + r1)
    else:
        small = min(x0, x1)
        large = max(x0, x1)
        r = (large - small) / (large + small)
        if r < 1e-4:
            mid = 0.5 * (large + small)
            f = k * mid**a
            g = f * (1.0 + a * (a - 1.0) / 6.0 * r * r)
            d = a * f / mid * (1.0 + (a - 1.0) * (a - 2.0) / 6.0 * r * r)
        elif small < 1e-290:
            f = k * large**a
            g = f / (a + 1.0)
            d = f / large
        else:
            log = np.log1p((small - large) / large)
            f = k * large**a
            g = f / (a + 1.0) * np.expm1((a + 1.0) * log) / np.expm1(log)
            d = f / large * np.expm1(a * log) / np.expm1(log)
    return (g + 0.5 * c * (f0 + f1) * d) / (1.0 + c * d), d / (1.0 + c * d)


@inner()
def solve_constant(d0, x0, f0, v0, e, b, loss, law, i):
    """Root y of y - e + b F(d0, y) = 0 and the constant force F >= 0 of the step (scheme A); always exists, unique.

    ``loss`` is the Hunt-Crossley factor over the step length [1/m]; F = G + loss (V(y) - V(d0)), never below zero.
    """
    if d0 <= 0.0 and e <= 0.0:
        return e, 0.0
    if d0 > 0.0 and b * (v0 / d0 - loss * v0) >= e:
        free = e - d0 + b * loss * v0
        root = np.sqrt(free * free + 4.0 * b * v0)
        gap = 0.5 * (root - free) if free <= 0.0 else 2.0 * b * v0 / (root + free)
        if gap <= 0.0:
            return e, 0.0
        f = v0 / gap - loss * v0
        if f < 0.0:
            return e, 0.0
        return d0 - gap, f
    k, a, c = law[i, 0], law[i, 1], law[i, 3]
    if a == 1.0 and loss == 0.0:
        half = 0.5 * b * k / (1.0 + k * c)
        if d0 >= 0.0:
            y = (e - half * d0) / (1.0 + half)
        else:
            s = e + d0
            root = np.sqrt(max(0.0, s * s - 4.0 * (1.0 + half) * e * d0))
            y = 0.5 * (s + root) / (1.0 + half) if s >= 0.0 else -2.0 * e * d0 / (root - s)
        x1, f1, v1 = law_at(y, law, i)
        g, _ = law_pair(d0, x0, f0, v0, y, x1, f1, v1, law, i)
        return y, g
    high = e if loss == 0.0 else max(e, e + b * loss * v0)
    y = high
    if loss == 0.0 and c == 0.0 and e > 0.0 and b > 0.0:
        if d0 <= 0.0:
            y = min(high, ((a + 1.0) * e * (e - d0) / (b * k)) ** (1.0 / (a + 1.0)))
        else:
            y = min(high, ((a + 1.0) * e / (b * k)) ** (1.0 / a))
        y *= 1.0 + 1e-15
    low = 0.0
    f = 0.0
    for _ in range(300):
        x1, f1, v1 = law_at(y, law, i)
        g, slope = law_pair(d0, x0, f0, v0, y, x1, f1, v1, law, i)
        f = g + loss * (v1 - v0)
        r = y - e + b * f
        if r > 0.0:
            high = y
        else:
            low = y
        span = y - d0
        turn = (f1 - g) / span if abs(span) > 1e-6 * (abs(y) + abs(d0)) else 0.5 * slope
        new = y - r / (1.0 + b * (turn + loss * f1))
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - y) <= 4e-16 * abs(y):
            break
        y = new
    return y, max(0.0, f)


@inner()
def solve_linear(matrix, vector, n):
    """Solve the leading n x n system in place by elimination with row exchange; False where it is singular."""
    for i in range(n):
        best = i
        for r in range(i + 1, n):
            if abs(matrix[r, i]) > abs(matrix[best, i]):
                best = r
        if not abs(matrix[best, i]) > 0.0:
            return False
        if best != i:
            for j in range(n):
                matrix[i, j], matrix[best, j] = matrix[best, j], matrix[i, j]
            vector[i], vector[best] = vector[best], vector[i]
        for r in range(i + 1, n):
            factor = matrix[r, i] / matrix[i, i]
            if factor != 0.0:
                for j in range(i, n):
                    matrix[r, j] -= factor * matrix[i, j]
                vector[r] -= factor * vector[i]
    for i in range(n - 1, -1, -1):
        total = vector[i]
        for j in range(i + 1, n):
            total -= matrix[i, j] * vector[j]
        vector[i] = total / matrix[i, i]
    return True


@inner()
def mean_force(h, y, now, law, i):
    """Mean force of scheme A for one contact ending at approach y, and its slope; the force never pulls."""
    x1, f1, v1 = law_at(y, law, i)
    g, d = law_pair(now[0, i], now[1, i], now[2, i], now[3, i], y, x1, f1, v1, law, i)
    loss = law[i, 2] / h
    f = g + loss * (v1 - now[3, i])
    if f <= 0.0:
        return 0.0, 0.0
    span = y - now[0, i]
    turn = (f1 - g) / span if abs(span) > 1e-6 * (abs(y) + abs(now[0, i])) else 0.5 * d
    return f, turn + loss * f1


@inner()
def sweep_constants(h, now, law, e, sums, out_y, out_f):
    """Solve scheme A's equations one contact at a time, the others' forces held; the largest relative change."""
    m = e.size
    change = 0.0
    for i in range(m):
        rest = e[i]
        for j in range(m):
            if j != i:
                rest -= sums[0, i, j] * out_f[j]
        old = out_f[i]
        out_y[i], out_f[i] = solve_constant(
            now[0, i], now[1, i], now[2, i], now[3, i], rest, sums[0, i, i], law[i, 2] / h, law, i
        )
        if out_f[i] != old:
            change = max(change, abs(out_f[i] - old) / max(abs(out_f[i]), abs(old)))
    return change


@inner()
def solve_constants(h, now, law, e, sums, work, out_y, out_f):
    """Scheme A for several contacts, whose equations minimise a convex function of the forces g.

    The function is g.B g / 2 + the sum of the contacts' work at the approaches e - B g; Newton's method with a search
    along each direction descends on it, sweeps over the contacts one by one begin and end it. ``now`` holds approach,
    compression, force, energy and rate of each contact, (5, n_contacts).
    """
    m = e.size
    for i in range(m):
        out_f[i] = 0.0
    for _ in range(4):
        if sweep_constants(h, now, law, e, sums, out_y, out_f) <= 1e-15 or m == 1:
            return
    matrix = work[0]
    step = work[2, 0]
    slope = work[2, 1]
    best = np.inf
    for _ in range(60):
        worst = 0.0
        for i in range(m):
            y = e[i]
            for j in range(m):
                y -= sums[0, i, j] * out_f[j]
            force, slope[i] = mean_force(h, y, now, law, i)
            step[i] = force - out_f[i]
            if step[i] != 0.0:
                worst = max(worst, abs(step[i]) / max(force, abs(out_f[i])))
        if worst <= 1e-15 or (worst <= 1e-11 and worst >= 0.5 * best):
            break
        best = min(best, worst)
        for i in range(m):
            for j in range(m):
                matrix[i, j] = slope[i] * sums[0, i, j]
            matrix[i, i] += 1.0
        if not solve_linear(matrix, step, m):
            break
        begin = 0.0
        low = 0.0
        high = 0.0
        t = 1.0
        for look in range(40):
            rise = 0.0
            for i in range(m):
                y = e[i]
                lift = 0.0
                for j in range(m):
                    y -= sums[0, i, j] * (out_f[j] + (t if look > 0 else 0.0) * step[j])
                    lift += sums[0, i, j] * step[j]
                force, _ = mean_force(h, y, now, law, i)
                rise += lift * (out_f[i] + (t if look > 0 else 0.0) * step[i] - force)
            if look == 0:
                begin = rise
                continue
            if abs(rise) <= 0.5 * abs(begin):
                break
            if rise > 0.0:
                high = t
            else:
                low = t
            t = 0.5 * (low + high) if high > 0.0 else 2.0 * t
        for i in range(m):
            out_f[i] = out_f[i] + t * step[i]
    for _ in range(200):
        if sweep_constants(h, now, law, e, sums, out_y, out_f) <= 1e-15:
            break


@inner()
def solve_ramp(h, d0, x0, f0, v0, rate0, e, ea, vf, sums, law):
    """Scheme A4 for one contact: (settled, y, mean force, slope) by Newton's method, the loss by secants.

    ``y`` is the approach at the step's end. Not settled where the iteration fails, the force would pull or the contact
    would give energy; the step then belongs to scheme A.
    """
    i = law.shape[0] - 1
    a, loss, c = law[i, 1], law[i, 2], law[i, 3]
    b0 = sums[0, 0, 0]
    b1 = sums[1, 0, 0]
    mean0 = sums[2, 0, 0]
    mean1 = sums[3, 0, 0]
    tangent = 0.0
    if d0 > 0.0:
        tangent = a * f0 / x0
        tangent /= 1.0 + c * tangent
    y = (e - b0 * f0 + 0.5 * b0 * tangent * d0) / (1.0 + 0.5 * b0 * tangent)
    limit = 1e-2 * max(abs(e), abs(d0))
    settled = False
    close = False
    last = False
    old_y = 0.0
    old_r = 0.0
    f = 0.0
    s = 0.0
    for iteration in range(25):
        x1, f1, v1 = law_at(y, law, i)
        g, d = law_pair(d0, x0, f0, v0, y, x1, f1, v1, law, i)
        middle = 0.5 * (d0 + y)
        scale = 1.0 + d * mean0
        if loss == 0.0:
            s = f1 - f0
            f = (g + d * (ea - mean1 * s - middle)) / scale
        else:
            right = g + d * (ea - middle) + loss * (v1 - v0) / h
            top = f1 - f0 + loss * (f1 * vf - f0 * rate0)
            m12 = d * mean1
            m21 = loss * f1 * sums[4, 0, 0]
            m22 = 1.0 + loss * f1 * sums[5, 0, 0]
            det = scale * m22 - m12 * m21
            f = (right * m22 - m12 * top) / det
            s = (scale * top - m21 * right) / det
        r = y - e + b0 * f + b1 * s
        settled = last or r == 0.0 or (close and abs(r) <= 1e-15 * max(abs(e), abs(d0), abs(y)))
        if settled:
            break
        if loss == 0.0 or iteration == 0:
            tangent = 0.0
            if y > 0.0 and x1 > 0.0:
                tangent = a * f1 / x1
                tangent /= 1.0 + c * tangent
            span = y - d0
            if abs(span) > 1e-6 * (abs(y) + abs(d0)):
                turn = (f1 - g) / span
                bend = (tangent - d) / span
            else:
                turn = 0.5 * d
                bend = 0.0
            rise = turn + bend * (ea - mean1 * s - middle - mean0 * f) - d * (mean1 * tangent + 0.5)
            slope = 1.0 + b0 * rise / scale + b1 * tangent
        else:
            slope = (r - old_r) / (y - old_y)
        step = -r / slope
        if not abs(step) < 1e300:
            return False, y, f, s
        old_y = y
        old_r = r
        y += step
        close = abs(step) <= 1e-7 * max(abs(y), limit) or y == old_y
        last = y == old_y or abs(step) <= 2e-15 * max(abs(y), limit)
    if not settled or not f >= 0.0:
        return False, y, f, s
    _, _, v1 = law_at(y, law, i)
    work = f * (y - d0) + s * (0.5 * (d0 + y) - (ea - mean0 * f - mean1 * s))
    if work - (v1 - v0) < (0.0 if loss > 0.0 else -WORK_ERROR * (v0 + v1)):
        return False, y, f, s
    return loss > 0.0 or work - (v1 - v0) <= WORK_ERROR * (v0 + v1), y, f, s


@inner()
def ramp_forces(h, y, now, law, e, ea, vf, sums, work, out_f, out_s, out_r):
    """Mean and slope of the forces of scheme A4 if the step ended at approaches y, and the residual in y."""
    m = law.shape[0]
    matrix = work[0]
    vector = work[2, 2]
    for i in range(m):
        d0 = now[0, i]
        x1, f1, v1 = law_at(y[i], law, i)
        g, d = law_pair(d0, now[1, i], now[2, i], now[3, i], y[i], x1, f1, v1, law, i)
        loss = law[i, 2]
        for j in range(m):
            matrix[i, j] = d * sums[2, i, j]
            matrix[i, m + j] = d * sums[3, i, j]
            matrix[m + i, j] = loss * f1 * sums[4, i, j]
            matrix[m + i, m + j] = loss * f1 * sums[5, i, j]
        matrix[i, i] += 1.0
        matrix[m + i, m + i] += 1.0
        vector[i] = g + d * (ea[i] - 0.5 * (d0 + y[i])) + loss * (v1 - now[3, i]) / h
        vector[m + i] = f1 - now[2, i] + loss * (f1 * vf[i] - now[2, i] * now[4, i])
    if not solve_linear(matrix, vector, 2 * m):
        return False
    for i in range(m):
        out_f[i] = vector[i]
        out_s[i] = vector[m + i]
    for i in range(m):
        r = y[i] - e[i]
        for j in range(m):
            r += sums[0, i, j] * out_f[j] + sums[1, i, j] * out_s[j]
        out_r[i] = r
    return True


@inner()
def solve_ramps(h, now, law, e, ea, vf, sums, work, out_y, out_f, out_s):
    """Scheme A4: mean and slope of the forces of one step, starting from the approaches of scheme A in out_y.

    Returns False where the iteration does not settle or a force would pull; the step then belongs to scheme A.
    """
    m = e.size
    r = work[3, 0]
    r2 = work[3, 1]
    f2 = work[3, 2]
    s2 = work[3, 3]
    y2 = work[4, 0]
    jacobian = work[1]
    settled = False
    for _ in range(20):
        if not ramp_forces(h, out_y, now, law, e, ea, vf, sums, work, out_f, out_s, r):
            return False
        if settled:
            break
        for j in range(m):
            for i in range(m):
                y2[i] = out_y[i]
            shift = 1e-7 * max(abs(out_y[j]), 1e-3 * abs(now[0, j]))
            y2[j] += shift
            shift = y2[j] - out_y[j]
            if not shift > 0.0:
                return False
            if not ramp_forces(h, y2, now, law, e, ea, vf, sums, work, f2, s2, r2):
                return False
            for i in range(m):
                jacobian[i, j] = (r2[i] - r[i]) / shift
        if not solve_linear(jacobian, r, m):
            return False
        settled = True
        for i in range(m):
            out_y[i] -= r[i]
            if not abs(r[i]) < 1e300:
                return False
            if abs(r[i]) > 4e-15 * max(abs(out_y[i]), 1e-2 * abs(now[0, i])):
                settled = False
    if not settled:
        return False
    for i in range(m):
        if not out_f[i] >= 0.0:
            return False
        _, _, v1 = law_at(out_y[i], law, i)
        mean = ea[i]
        for j in range(m):
            mean -= sums[2, i, j] * out_f[j] + sums[3, i, j] * out_s[j]
        work_done = out_f[i] * (out_y[i] - now[0, i]) + out_s[i] * (0.5 * (now[0, i] + out_y[i]) - mean)
        lost = work_done - (v1 - now[3, i])
        if lost < (0.0 if law[i, 2] > 0.0 else -WORK_ERROR * (v1 + now[3, i])):
            return False
        if law[i, 2] == 0.0 and lost > WORK_ERROR * (v1 + now[3, i]):
            return False
    return True


@inner(fastmath=LOOSE)
def predict(shape, tables, slot, h, twice, offset, bias, q, p, out_q, out_p, out_end):
    """Free motion over one step: the new state and, per contact, end approach, mean approach and end rate (3, m).

    ``twice`` is 2 zeta omega of every mode, ``tables[slot]`` the step's `lane_table`.
    """
    n_contacts, n_modes = shape.shape
    lanes = tables[slot]
    part = 1.0 / h
    for n in range(n_modes):
        out_q[n] = lanes[0, n] * q[n] + lanes[1, n] * p[n] + h * lanes[4, n] * bias[n]
        out_p[n] = lanes[2, n] * q[n] + lanes[3, n] * p[n] + lanes[1, n] * bias[n]
    for i in range(n_contacts):
        end = 0.0
        mean = 0.0
        rate = 0.0
        for n in range(n_modes):
            u = shape[i, n]
            end += u * out_q[n]
            rate += u * out_p[n]
            drift = lanes[4, n] * (p[n] + twice[n] * q[n]) + h * lanes[5, n] * bias[n]
            mean += u * (part * lanes[1, n] * q[n] + drift)
        out_end[0, i] = offset[i] + end
        out_end[1, i] = offset[i] + mean
        out_end[2, i] = rate


@inner(fastmath=LOOSE)
def commit(shape, tables, slot, h, force, slope, free_q, free_p, out_q, out_p):
    """Add the motion the step's forces (mean, slope) cause to the free motion."""
    n_contacts, n_modes = shape.shape
    lanes = tables[slot]
    for n in range(n_modes):
        out_q[n] = free_q[n]
        out_p[n] = free_p[n]
    for i in range(n_contacts):
        f = force[i] - 0.5 * slope[i]
        s = slope[i]
        if force[i] != 0.0 or s != 0.0:
            for n in range(n_modes):
                u = shape[i, n]
                out_q[n] -= u * h * (f * lanes[4, n] + s * lanes[5, n])
                out_p[n] -= u * (f * lanes[1, n] + s * lanes[4, n])


@inner(fastmath=LOOSE)
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
        a12 = lanes[1, n]
        first = lanes[4, n]
        second = lanes[5, n]
        x = free_q[n] - u * h * (f * first + s * second)
        v = free_p[n] - u * (f * a12 + s * first)
        q[n] = x
        p[n] = v
        g = bias[n]
        new_x = lanes[0, n] * x + a12 * v + h * first * g
        new_v = lanes[2, n] * x + lanes[3, n] * v + a12 * g
        free_q[n] = new_x
        free_p[n] = new_v
        end += u * new_x
        rate += u * new_v
        mean += u * (part * a12 * x + first * (v + twice[n] * x) + h * second * g)
    out_end[0, 0] = offset[0] + end
    out_end[1, 0] = offset[0] + mean
    out_end[2, 0] = rate


@inner(fastmath=LOOSE)
def approach(shape, offset, i, q, p):
    """Approach of contact i and its rate."""
    d = 0.0
    v = 0.0
    for n in range(q.size):
        d += shape[i, n] * q[n]
        v += shape[i, n] * p[n]
    return offset[i] + d, v


@inner(fastmath=LOOSE)
def motion_bounds(shape, omega, zeta, bias, i, q, p):
    """Rigid part and bounds of the flexible part of contact i's approach, valid for all later free time.

    Returns rigid position, rate and acceleration; then the largest flexible displacement, rate and acceleration.
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
    return position, rate, acceleration, reach, fastest, hardest


@inner()
def quadratic_wait(d, v, a):
    """Largest t with d + v t + a t**2 / 2 <= 0 all along, for d <= 0 and a >= 0; infinity if never."""
    if a <= 0.0:
        return np.inf if v <= 0.0 else -d / v
    root = np.sqrt(v * v - 2.0 * a * d)
    if v >= 0.0:
        return -2.0 * d / (root + v) if root + v > 0.0 else 0.0
    return (root - v) / a


@inner(fastmath=LOOSE)
def glide(lanes, h, bias, q, p):
    """Advance a state in place by the free motion over h, whose `lane_table` is given."""
    for n in range(q.size):
        q0 = q[n]
        p0 = p[n]
        q[n] = lanes[0, n] * q0 + lanes[1, n] * p0 + h * lanes[4, n] * bias[n]
        p[n] = lanes[2, n] * q0 + lanes[3, n] * p0 + lanes[1, n] * bias[n]


@inner()
def restore(q, p, out_q, out_p):
    """Copy a state; for less compilation than assigning slices."""
    for n in range(q.size):
        out_q[n] = q[n]
        out_p[n] = p[n]


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
                r0, r1, r2, reach, fastest, hardest = motion_bounds(shape, omega, zeta, bias, i, q, p)
                bounds[i, 0] = r0 + offset[i]
                bounds[i, 1] = r1
                bounds[i, 2] = r2
                bounds[i, 3] = reach
                bounds[i, 4] = fastest
                bounds[i, 5] = hardest
            r0 = bounds[i, 0]
            r1 = bounds[i, 1]
            r2 = bounds[i, 2]
            reach = bounds[i, 3]
            hardest = bounds[i, 5]
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
            bound = max(bound, quadratic_wait(d, max(0.0, r1 + bounds[i, 4]), max(r2, 0.0)))
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
            if not close and bounds[first, 5] != 0.0 and 2 <= power_of_two < GLIDES:
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
            bounds[i, 0] += wait * (bounds[i, 1] + 0.5 * bounds[i, 2] * wait)
            bounds[i, 1] += wait * bounds[i, 2]
    return elapsed, -1, 4


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
def solve_step(ramp, h, all_sums, slot, law, now, end, work, y, f, s, rate):
    """Solve one step of length h from its prediction; 0 where a contact pushes by A (asked for or fallen to)."""
    m = y.size
    sums = all_sums[slot]
    if m == 1 and ramp and (now[0, 0] > 0.0 or end[0, 0] > 0.0):
        settled, y[0], f[0], s[0] = solve_ramp(
            h, now[0, 0], now[1, 0], now[2, 0], now[3, 0], now[4, 0], end[0, 0], end[1, 0], end[2, 0], sums, law
        )
        if settled:
            rate[0] = end[2, 0] - sums[4, 0, 0] * f[0] - sums[5, 0, 0] * s[0]
            return 1
    solve_constants(h, now, law, end[0], sums, work, y, f)
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
        if solve_ramps(h, now, law, end[0], end[1], end[2], sums, work, y, f, s):
            fine = 1
        else:
            for i in range(m):
                y[i] = keep[i]
                f[i] = keep[m + i]
                s[i] = 0.0
    for i in range(m):
        v = end[2, i]
        for j in range(m):
            v -= sums[4, i, j] * f[j] + sums[5, i, j] * s[j]
        rate[i] = v
    return fine


@inner(allocates=True)
def resized(array, n, length):
    """The first n rows of an array in a new one of another length."""
    result = np.empty((length, array.shape[1]))
    for i in range(n):
        for j in range(array.shape[1]):
            result[i, j] = array[i, j]
    return result


@inner()
def any_of(values):
    """Whether any value is not zero; for less compilation than the general `any`."""
    found = False
    for n in range(values.size):
        found = found or values[n] != 0
    return found


@inner()
def total_energy(omega, bias, law, q, p, now):
    """Kinetic and strain energy less the work of the bias force, and what the contacts store."""
    total = 0.0
    for n in range(q.size):
        total += 0.5 * (p[n] * p[n] + (omega[n] * q[n]) ** 2) - bias[n] * q[n]
    for i in range(law.shape[0]):
        _, _, stored = law_at(now[0, i], law, i)
        total += stored
    return total


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


@inner()
def record(row, time, h, blind, sums, now, pressed, end, y, f, s, done):
    """Write a step of the energy-exact schemes to a row of the steps, and add up its work."""
    row[0] = time
    row[1] = h
    row[2] = 1.0 if blind else 0.0
    for i in range(y.size):
        row[3 + 5 * i] = now[0, i]
        row[4 + 5 * i] = now[4, i]
        row[5 + 5 * i] = 1.0 if f[i] > 0.0 or pressed[i] else 0.0
        row[6 + 5 * i] = f[i] - 0.5 * s[i]
        row[7 + 5 * i] = s[i]
        mean = end[1, i]
        for j in range(y.size):
            mean -= sums[2, i, j] * f[j] + sums[3, i, j] * s[j]
        done[i] += f[i] * (y[i] - now[0, i]) + s[i] * (0.5 * (now[0, i] + y[i]) - mean)


@outer()
def run_energy(
    omega, zeta, shape, offset, bias, law, start_q, start_p, ramp, base, depth, still, horizon, max_impacts, max_steps
):
    """Follow bodies in contact with the energy-exact schemes A (ramp 0) or A4 (ramp 1).

    Parameters: omega, zeta, bias, start_q, start_p (n_modes,); shape (n_contacts, n_modes), the signed shapes at the
    contacts; offset (n_contacts,) approach at zero state; law (n_contacts, 4): stiffness, exponent, loss, compliance;
    base: the longest step in contact; depth [m] and still [m/s]: approaches and speeds that are rounding;
    horizon: where to stop at the latest; max_impacts: stop after so many releases.

    Returns (steps, q, p, now, done, time, status, n_fallback, n_blind). Each row of steps is a step or a flight:
    start, length, blind; then per contact start approach, start rate, whether it is closed, and the force as powers of
    the fraction of the step. now (5, n_contacts) ends with the last approach, .., rate; done (n_contacts,) is the
    integral of force times rate [J]. A finished run ends at the last separation.
    """
    m, n_modes = shape.shape
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
    now = np.zeros((5, m))
    end = np.empty((3, m))
    work = np.zeros((5, max(4, 2 * m), max(4, 2 * m)))
    y = np.empty(m)
    f = np.empty(m)
    s = np.empty(m)
    rate = np.empty(m)
    pressed = np.zeros(m, np.bool_)
    bracket = np.empty(6)
    flights = np.empty((GLIDES + 1, N_LANE, n_modes))
    flown = np.zeros(GLIDES + 1)
    done = np.zeros(m)
    steps = np.zeros((64, 3 + 5 * m))
    n_steps = ZERO
    n_fallback = 0
    n_blind = 0
    n_released = 0
    n_looks = 0
    level = 0
    events = 0
    ready = -1  # slot of the table with which the coming step is predicted already
    reset = 0.0
    pause = 0.0  # until when events are passed, not located
    respite = base  # how long the next such time will be
    time = 0.0
    status = EXHAUSTED
    quiet = not any_of(bias)
    lossy = False
    for i in range(m):
        if law[i, 2] > 0.0:
            lossy = True
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
            land(shape, offset, time, elapsed, first, found, steps[n_steps], 5, now, pressed, q, p)
            if elapsed > 0.0:
                n_steps += 1
                time += elapsed
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
            now[1, i], now[2, i], now[3, i] = law_at(now[0, i], law, i)
        fine = solve_step(ramp, h, all_sums, slot, law, now, end, work, y, f, s, rate)
        target = -1
        if not blind:
            shorter = 0
            for i in range(m):
                if pressed[i] and y[i] <= 0.0 and now[0, i] == 0.0:
                    if now[4, i] > still:
                        shorter = max(shorter, 3 if level == 0 else 1)
                elif dipped(now, pressed, y, rate, h, i):
                    shorter = max(shorter, 1)
            if shorter > 0:
                level += shorter
                if level >= LEVELS:
                    events = EVENT_LIMIT + 1
                continue
            target, guess = first_crossing(now, pressed, y, rate, h, depth, still)
        if target >= 0:
            enclose(now, y, rate, h, target, bracket)
            slot = odd
            for _ in range(LOCATE_LIMIT):
                h = guess
                lane_table(omega, zeta, h, WHOLE, tables[slot])
                contact_sums(shape, tables[slot], h, all_sums[slot])
                predict(shape, tables, slot, h, twice, offset, bias, q, p, free_q, free_p, end)
                fine = solve_step(ramp, h, all_sums, slot, law, now, end, work, y, f, s, rate)
                target, guess = narrow(now, pressed, y, rate, h, depth, still, target, bracket)
                if guess == 0.0:
                    break
            if not abs(y[target]) <= 1e-9 * bracket[2]:
                if h < 1e-3 * base:
                    events = EVENT_LIMIT + 1
                    continue
                target = -1
                blind = True
        letting, guess = -1, h
        if lossy and not blind:
            letting, guess = first_letting_go(now, law, y, rate, h)
        if letting >= 0:
            target = -1
            slot = odd
            bracket[0] = 0.0
            bracket[1] = h
            bracket[3] = h
            bracket[4] = 1.0 + law[letting, 2] * rate[letting]
            start = 1.0 + law[letting, 2] * now[4, letting]
            for _ in range(LOCATE_LIMIT):
                h = guess
                lane_table(omega, zeta, h, WHOLE, tables[slot])
                contact_sums(shape, tables[slot], h, all_sums[slot])
                predict(shape, tables, slot, h, twice, offset, bias, q, p, free_q, free_p, end)
                fine = solve_step(ramp, h, all_sums, slot, law, now, end, work, y, f, s, rate)
                miss = 1.0 + law[letting, 2] * rate[letting]
                if abs(miss) <= 0.1 * LET_GO or bracket[1] - bracket[0] <= 1e-9 * bracket[1]:
                    break
                bracket[0 if miss * start > 0.0 else 1] = h
                guess = h - miss * (h - bracket[3]) / (miss - bracket[4]) if miss != bracket[4] else 0.0
                bracket[3] = h
                bracket[4] = miss
                if not bracket[0] < guess < bracket[1]:
                    guess = 0.5 * (bracket[0] + bracket[1])
        total = 0.0
        for i in range(m):
            total += abs(y[i]) + abs(rate[i]) + f[i]
        if not total < 1e300:
            status = FAILED
            break
        record(steps[n_steps], time, h, blind, all_sums[slot], now, pressed, end, y, f, s, done)
        n_steps += 1
        if ramp and fine == 0:
            n_fallback += 1
        if blind:
            n_blind += 1
        time += h
        n_released += settle(now, pressed, y, rate, target, depth, still)
        if target >= 0:
            events += 1
        elif level > 0 and letting < 0:
            level -= 1
        if m == 1 and slot == level and pressed[0] and time + h <= horizon:
            advance(shape, tables, slot, h, twice, offset, bias, f, s, q, p, free_q, free_p, end)
            ready = slot
        else:
            commit(shape, tables, slot, h, f, s, free_q, free_p, q, p)
        if time - reset > base:
            reset = time
            events = 0
        n_looks += 1
        if quiet and n_looks % 512 == 0 and total_energy(omega, bias, law, q, p, now) <= 1e-24 * start_energy:
            status = SETTLED
            break
    return resized(steps, n_steps, n_steps), q, p, now, done, time, status, n_fallback, n_blind


@inner(allocates=True)
def collocation_table(omega, zeta, shape, h, nodes, powers, out_free, out_end, out_inner):
    """Coefficients of one collocation step of length h.

    Parameters: nodes (s + 1,) fractions of the step, the last one 1; powers (s, s) Lagrange polynomials of the first s
    as powers. out_free (s + 1, 5, n_modes): a11, a12, a21, a22 and constant force's displacement up to each node;
    out_end (2 s, n_modes): displacement, then velocity at the end per unit force of each polynomial;
    out_inner (2, s, s, m, m): approach and its rate at a node per force polynomial, summed over the modes.
    """
    m = shape.shape[0]
    s = nodes.size - 1
    moments = np.empty(s + 1)
    work = np.empty((2, s))
    for a in range(s):
        for b in range(s):
            for i in range(m):
                for j in range(m):
                    out_inner[0, a, b, i, j] = 0.0
                    out_inner[1, a, b, i, j] = 0.0
    for n in range(omega.size):
        silent = True
        for i in range(m):
            if shape[i, n] != 0.0:
                silent = False
        for a in range(s + 1):
            c = nodes[a]
            t = c * h
            a11, a12, a22 = mode_moments(omega[n], zeta[n], t, moments, work)
            out_free[a, 0, n] = a11
            out_free[a, 1, n] = a12
            out_free[a, 2, n] = -omega[n] * omega[n] * a12
            out_free[a, 3, n] = a22
            out_free[a, 4, n] = t * t * moments[1]
            for b in range(s):
                x = 0.0
                v = 0.0
                scale = 1.0
                for k in range(s):
                    x += powers[b, k] * scale * moments[k + 1]
                    v += powers[b, k] * scale * moments[k]
                    scale *= (k + 1.0) * c
                x *= t * t
                v *= t
                if a == s:
                    out_end[b, n] = x
                    out_end[s + b, n] = v
                elif not silent:
                    for i in range(m):
                        for j in range(m):
                            uu = shape[i, n] * shape[j, n]
                            out_inner[0, a, b, i, j] += uu * x
                            out_inner[1, a, b, i, j] += uu * v


@inner(fastmath=LOOSE)
def free_approach(shape, offset, bias, free, q, p, out_d, out_v):
    """Approach and rate (s + 1, n_contacts) at a step's nodes if nothing pushed."""
    m, n_modes = shape.shape
    for a in range(free.shape[0]):
        for i in range(m):
            d = 0.0
            v = 0.0
            for n in range(n_modes):
                u = shape[i, n]
                d += u * (free[a, 0, n] * q[n] + free[a, 1, n] * p[n] + free[a, 4, n] * bias[n])
                v += u * (free[a, 2, n] * q[n] + free[a, 3, n] * p[n] + free[a, 1, n] * bias[n])
            out_d[a, i] = offset[i] + d
            out_v[a, i] = v


@inner()
def smooth_force(x, v, law, i):
    """Force of a pressed contact and its slopes in compression and rate, continued smoothly below zero compression."""
    k, a, loss = law[i, 0], law[i, 1], law[i, 2]
    size = abs(x)
    f = k * power(size, a) if size > 0.0 else 0.0
    slope = k if a == 1.0 else (a * f / size if size > 0.0 else 0.0)
    if x < 0.0:
        f = -f
    factor = 1.0 + loss * v
    if factor < 0.0:
        return 0.0, 0.0, 0.0
    return f * factor, slope * factor, f * loss


@inner(allocates=True)
def solve_collocation(inner, law, pressed, free_d, free_v, matrix, vector, out_f):
    """Forces at the nodes (s, n_contacts) by Newton's method from those in out_f; False where it does not settle."""
    s, m = out_f.shape
    active = np.empty(m, np.int64)
    count = 0
    for i in range(m):
        if pressed[i]:
            active[count] = i
            count += 1
        else:
            for a in range(s):
                out_f[a, i] = 0.0
    last = np.inf
    for iteration in range(40):
        scale = 0.0
        for a in range(s):
            for r in range(count):
                i = active[r]
                d = free_d[a, i]
                v = free_v[a, i]
                for b in range(s):
                    for c in range(count):
                        j = active[c]
                        d -= inner[0, a, b, i, j] * out_f[b, j]
                        v -= inner[1, a, b, i, j] * out_f[b, j]
                x = d - law[i, 3] * out_f[a, i]
                f, fx, fv = smooth_force(x, v, law, i)
                row = a * count + r
                vector[row] = out_f[a, i] - f
                for b in range(s):
                    for c in range(count):
                        j = active[c]
                        matrix[row, b * count + c] = fx * inner[0, a, b, i, j] + fv * inner[1, a, b, i, j]
                matrix[row, row] += 1.0 + fx * law[i, 3]
                scale = max(scale, abs(out_f[a, i]), abs(f))
        if not scale < 1e300:
            return False
        if not solve_linear(matrix, vector, s * count):
            return False
        change = 0.0
        for a in range(s):
            for r in range(count):
                out_f[a, active[r]] -= vector[a * count + r]
                change = max(change, abs(vector[a * count + r]))
        if change <= 1e-15 * scale or (change <= 1e-12 * scale and change >= 0.5 * last):
            return True
        if iteration > 12 and not change < last:
            return False
        last = change
    return False


@inner(fastmath=LOOSE)
def collocation_end(shape, offset, bias, free, last, f, q, p, out_q, out_p, out_y, out_rate):
    """State at a collocation step's end, and approach and rate of each contact there."""
    m, n_modes = shape.shape
    s = f.shape[0]
    for n in range(n_modes):
        out_q[n] = free[s, 0, n] * q[n] + free[s, 1, n] * p[n] + free[s, 4, n] * bias[n]
        out_p[n] = free[s, 2, n] * q[n] + free[s, 3, n] * p[n] + free[s, 1, n] * bias[n]
    for i in range(m):
        for b in range(s):
            force = f[b, i]
            if force != 0.0:
                for n in range(n_modes):
                    out_q[n] -= shape[i, n] * force * last[b, n]
                    out_p[n] -= shape[i, n] * force * last[s + b, n]
    for i in range(m):
        d = 0.0
        v = 0.0
        for n in range(n_modes):
            d += shape[i, n] * out_q[n]
            v += shape[i, n] * out_p[n]
        out_y[i] = offset[i] + d
        out_rate[i] = v


@inner()
def collocate(
    shape, offset, bias, law, pressed, now, nodes, edges, free, last, inner, q, p, guess, small,
    free_d, free_v, f, matrix, vector, out_q, out_p, out_y, out_rate,
):  # fmt: skip
    """One collocation step: node forces in f, the end state, and the force polynomial's largest misfit at both ends.

    The misfit is weighed to a speed by ``small`` (n_contacts,); infinity where the forces were not found.
    """
    s, m = f.shape
    free_approach(shape, offset, bias, free, q, p, free_d, free_v)
    for a in range(s):
        for i in range(m):
            f[a, i] = guess[a, i]
    if not solve_collocation(inner, law, pressed, free_d, free_v, matrix, vector, f):
        return np.inf
    collocation_end(shape, offset, bias, free, last, f, q, p, out_q, out_p, out_y, out_rate)
    worst = 0.0
    for i in range(m):
        if not abs(out_y[i]) < 1e300:
            return np.inf
        if pressed[i]:
            x0 = compression(now[0, i], law[i, 0], law[i, 1], law[i, 3]) if now[0, i] > 0.0 else 0.0
            x1 = compression(out_y[i], law[i, 0], law[i, 1], law[i, 3]) if out_y[i] > 0.0 else 0.0
            f0, _, _ = smooth_force(x0, now[4, i], law, i)
            f1, _, _ = smooth_force(x1, out_rate[i], law, i)
            for b in range(s):
                f0 -= edges[0, b] * f[b, i]
                f1 -= edges[1, b] * f[b, i]
            worst = max(worst, max(abs(f0), abs(f1)) * small[i])
    return worst


@outer()
def run_collocation(
    omega, zeta, shape, offset, bias, law, start_q, start_p, nodes, powers, base, speed, tolerance, depth, still,
    horizon, max_impacts, max_steps,
):  # fmt: skip
    """Follow bodies in contact with exponential Gauss collocation of the contact forces; the reference scheme.

    The forces are polynomials through s nodes per step that obey the law at the nodes. Onset and release are located,
    steps are halved where the polynomial misses the force at a step's ends (weighed to a speed) by more than
    ``tolerance * speed``, and doubled where it does not. Other parameters and results as in `run_energy`; the status
    is FAILED where the halvings are used up.
    """
    m, n_modes = shape.shape
    s = nodes.size - 1
    q = start_q.copy()
    p = start_p.copy()
    new_q = np.empty(n_modes)
    new_p = np.empty(n_modes)
    bracket = np.empty(6)
    table_free = np.empty((LEVELS, s + 1, 5, n_modes))
    table_last = np.empty((LEVELS, 2 * s, n_modes))
    table_inner = np.empty((LEVELS, 2, s, s, m, m))
    known = np.zeros(LEVELS)
    odd_free = np.empty((s + 1, 5, n_modes))
    odd_last = np.empty((2 * s, n_modes))
    odd_inner = np.empty((2, s, s, m, m))
    edges = np.zeros((2, s))
    for b in range(s):
        edges[0, b] = powers[b, 0]
        for k in range(s):
            edges[1, b] += powers[b, k]
    mobility = np.zeros(m)
    small = np.zeros(m)
    for i in range(m):
        for n in range(n_modes):
            mobility[i] += shape[i, n] * shape[i, n]
    now = np.zeros((5, m))
    y = np.empty(m)
    rate = np.empty(m)
    f = np.zeros((s, m))
    guess = np.zeros((s, m))
    free_d = np.empty((s + 1, m))
    free_v = np.empty((s + 1, m))
    matrix = np.empty((s * m, s * m))
    vector = np.empty(s * m)
    pressed = np.zeros(m, np.bool_)
    flights = np.empty((GLIDES + 1, N_LANE, n_modes))
    flown = np.zeros(GLIDES + 1)
    done = np.zeros(m)
    coefficients = np.empty(s)
    stride = 3 + s
    steps = np.zeros((64, 3 + stride * m))
    n_steps = ZERO
    n_released = 0
    n_tries = 0
    n_looks = 0
    level = 0
    events = 0
    reset = 0.0
    time = 0.0
    status = EXHAUSTED
    limit = tolerance * speed
    quiet = not any_of(bias)
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
        if not any_of(pressed):
            elapsed, first, found = find_onset(
                omega, zeta, shape, offset, bias, horizon - time, base, 1e-6 * base, depth, still, flights, flown, q, p
            )
            if found == 1:
                status = FINISHED
                break
            land(shape, offset, time, elapsed, first, found, steps[n_steps], stride, now, pressed, q, p)
            if elapsed > 0.0:
                n_steps += 1
                time += elapsed
            if found >= 3:
                status = FAILED if found == 3 else EXHAUSTED
                break
            if found == 0:
                events += 1
                level = min(LEVELS - 2, level + 4)
                guess[:] = 0.0
            continue
        n_tries += 1
        if n_tries > 64 * LEVELS or events > 64 * EVENT_LIMIT:
            status = FAILED
            break
        h = base * 0.5**level
        odd = h > horizon - time
        if odd:
            h = horizon - time
            collocation_table(omega, zeta, shape, h, nodes, powers, odd_free, odd_last, odd_inner)
        elif known[level] == 0.0:
            collocation_table(
                omega, zeta, shape, h, nodes, powers, table_free[level], table_last[level], table_inner[level]
            )
            known[level] = 1.0
        free = odd_free if odd else table_free[level]
        last = odd_last if odd else table_last[level]
        inner = odd_inner if odd else table_inner[level]
        for i in range(m):
            small[i] = min(mobility[i] * h, inner[1, s - 1, s - 1, i, i] * 4.0 + 1e-3 * mobility[i] * h)
        misfit = collocate(
            shape, offset, bias, law, pressed, now, nodes, edges, free, last, inner, q, p, guess, small,
            free_d, free_v, f, matrix, vector, new_q, new_p, y, rate,
        )  # fmt: skip
        shorter = 0
        again = False
        target = -1
        if misfit == np.inf:
            shorter = 1
        else:
            for i in range(m):
                d0 = now[0, i]
                if pressed[i] and y[i] <= 0.0 and d0 == 0.0:
                    if now[4, i] > still and level < LEVELS - 2:
                        shorter = 1
                    else:
                        pressed[i] = False
                        again = True
                elif not pressed[i] and d0 == 0.0 and now[4, i] >= -still and y[i] > depth:
                    pressed[i] = True
                    again = True
                elif dipped(now, pressed, y, rate, h, i) and (pressed[i] or level < LEVELS - 2):
                    shorter = 1
            target, root = first_crossing(now, pressed, y, rate, h, depth, still)
        if again:
            continue
        if shorter > 0:
            if level + shorter >= LEVELS:
                status = FAILED
                break
            level += shorter
            guess[:] = 0.0
            continue
        if target >= 0:
            if misfit > limit and root > 0.25 * h and root < 0.9 * h:
                level += 1
                if level >= LEVELS:
                    status = FAILED
                    break
                continue
            enclose(now, y, rate, h, target, bracket)
            free = odd_free
            last = odd_last
            inner = odd_inner
            for _ in range(LOCATE_LIMIT):
                h = root
                collocation_table(omega, zeta, shape, h, nodes, powers, odd_free, odd_last, odd_inner)
                for i in range(m):
                    small[i] = min(mobility[i] * h, inner[1, s - 1, s - 1, i, i] * 4.0 + 1e-3 * mobility[i] * h)
                    for a in range(s):
                        guess[a, i] = max(0.0, f[a, i])
                misfit = collocate(
                    shape, offset, bias, law, pressed, now, nodes, edges, free, last, inner, q, p, guess, small,
                    free_d, free_v, f, matrix, vector, new_q, new_p, y, rate,
                )  # fmt: skip
                if misfit == np.inf:
                    break
                target, root = narrow(now, pressed, y, rate, h, depth, still, target, bracket)
                if root == 0.0:
                    break
            if misfit == np.inf or not abs(y[target]) <= 1e-9 * bracket[2]:
                level += 1
                if level >= LEVELS:
                    status = FAILED
                    break
                continue
        if misfit > limit and level < LEVELS - 2 and h > 1e-9 * base:
            level += 1
            while level < LEVELS - 2 and base * 0.5**level > 0.6 * h:
                level += 1
            continue
        n_tries = 0
        steps[n_steps] = 0.0
        steps[n_steps, 0] = time
        steps[n_steps, 1] = h
        for i in range(m):
            steps[n_steps, 3 + stride * i] = now[0, i]
            steps[n_steps, 4 + stride * i] = now[4, i]
            if pressed[i]:
                steps[n_steps, 5 + stride * i] = 1.0
                for k in range(s):
                    coefficients[k] = 0.0
                    for b in range(s):
                        coefficients[k] += powers[b, k] * f[b, i]
                    steps[n_steps, 6 + stride * i + k] = coefficients[k]
            for a in range(s):
                v = free_v[a, i]
                for b in range(s):
                    for j in range(m):
                        v -= inner[1, a, b, i, j] * f[b, j]
                weight = 0.0
                for k in range(s):
                    weight += powers[a, k] / (k + 1.0)
                done[i] += weight * h * f[a, i] * v
        n_steps += 1
        time += h
        restore(new_q, new_p, q, p)
        for i in range(m):
            for a in range(s):
                ahead = 0.0
                if pressed[i] and target < 0:
                    position = 1.0 + nodes[a]
                    for k in range(s - 1, -1, -1):
                        ahead = ahead * position + coefficients[k] if m == 1 else f[s - 1, i]
                guess[a, i] = max(0.0, ahead)
        n_released += settle(now, pressed, y, rate, target, depth, still)
        if target >= 0:
            events += 1
        if target < 0 and level > 0 and misfit < limit * 0.25 * 0.5**s:
            level -= 1
        if time - reset > base:
            reset = time
            events = 0
        n_looks += 1
        if quiet and n_looks % 512 == 0 and total_energy(omega, bias, law, q, p, now) <= 1e-24 * start_energy:
            status = SETTLED
            break
    return resized(steps, n_steps, n_steps), q, p, now, done, time, status, 0, 0


@inner(allocates=True)
def secular_modes(omega, shape, stiffness):
    """Eigenpairs of diag(omega**2) + stiffness u u^T for ascending, distinct omega and non-zero u.

    Returns the squared frequencies (n,) and the orthogonal eigenvectors (n, n), both to rounding: roots of
    ``1 + k sum u**2 / (omega**2 - mu) = 0``, one behind each pole, sought as distances from the nearer pole; vectors
    from the u for which those roots are exact.

    References
    ----------
    Golub (1973), SIAM Rev. 15, 318; Gu and Eisenstat (1994), SIAM J. Matrix Anal. Appl. 15, 1266.
    """
    n = omega.size
    origin = np.empty(n, np.int64)
    distance = np.empty(n)
    whole = 0.0
    for i in range(n):
        whole += stiffness * shape[i] * shape[i]
    for j in range(n):
        span = (omega[j + 1] - omega[j]) * (omega[j + 1] + omega[j]) if j + 1 < n else whole
        middle = 0.5 * span
        value = 1.0
        for i in range(n):
            gap = (omega[i] - omega[j]) * (omega[i] + omega[j])
            value += stiffness * shape[i] * shape[i] / (gap - middle)
        near = j
        low = 0.0
        high = span
        if value < 0.0 and j + 1 < n:
            near = j + 1
            low = -middle
            high = 0.0
        elif value < 0.0:
            low = middle
        else:
            high = middle
        own = stiffness * shape[near] * shape[near]
        t = 0.5 * (low + high)
        for _ in range(200):
            value = t - own
            slope = 1.0
            for i in range(n):
                if i != near:
                    gap = (omega[i] - omega[near]) * (omega[i] + omega[near])
                    part = stiffness * shape[i] * shape[i] / (gap - t)
                    value += part * t
                    slope += part * gap / (gap - t)
            if (value > 0.0) == (near == j):
                high = t
            else:
                low = t
            new = t - value / slope
            if not low < new < high:
                new = 0.5 * (low + high)
            if abs(new - t) <= 2e-16 * abs(new):
                t = new
                break
            t = new
        origin[j] = near
        distance[j] = t
    square = np.empty(n)
    vectors = np.empty((n, n))
    for j in range(n):
        square[j] = omega[origin[j]] * omega[origin[j]] + distance[j]
    for i in range(n):
        product = 1.0
        for j in range(n):
            top = distance[j] + (omega[origin[j]] - omega[i]) * (omega[origin[j]] + omega[i])
            if j < i:
                product *= top / ((omega[j] - omega[i]) * (omega[j] + omega[i]))
            elif j + 1 < n:
                product *= top / ((omega[j + 1] - omega[i]) * (omega[j + 1] + omega[i]))
            else:
                product *= top
        size = np.sqrt(abs(product))
        for j in range(n):
            top = distance[j] + (omega[origin[j]] - omega[i]) * (omega[origin[j]] + omega[i])
            vectors[i, j] = -(size if shape[i] > 0.0 else -size) / top
    for j in range(n):
        norm = 0.0
        for i in range(n):
            norm += vectors[i, j] * vectors[i, j]
        norm = np.sqrt(norm)
        for i in range(n):
            vectors[i, j] /= norm
    return square, vectors


@inner(fastmath=LOOSE)
def secular_approach(rate, weight, x, v, rest, t):
    """Approach of a contact in contact and its rate after t, from the state (x, v) of the joint eigenmodes."""
    d = rest
    r = 0.0
    for j in range(rate.size):
        s = np.sin(rate[j] * t)
        c = np.cos(rate[j] * t)
        d += weight[j] * (x[j] * c + v[j] * s / rate[j])
        r += weight[j] * (v[j] * c - x[j] * rate[j] * s)
    return d, r


@outer()
def run_secular(
    omega, group, amplitude, shape, offset, bias, law, start_q, start_p, nodes, powers, base, depth, still,
    horizon, max_impacts, max_steps,
):  # fmt: skip
    """Follow one lossless linear contact between undamped bodies by the exact motion in contact.

    ``group`` (n_modes,) numbers the distinct frequencies of participating modes, -1 for those at rest at the contact;
    ``amplitude`` (n_groups,) is the root of the sum of their squared shapes. The motion is exact to rounding; the
    recorded force polynomials interpolate it, halved until they miss it by less than SECULAR_MISFIT of the peak.
    Other parameters and results as in `run_collocation`.
    """
    n_modes = omega.size
    n_groups = amplitude.size
    s = nodes.size - 1
    zeta = np.zeros(n_modes)
    k = law[0, 0] / (1.0 + law[0, 0] * law[0, 3])
    w = np.empty(n_groups)
    push = np.zeros(n_groups)
    for n in range(n_modes):
        if group[n] >= 0:
            w[group[n]] = omega[n]
            push[group[n]] += shape[0, n] * bias[n] / amplitude[group[n]]
    square, vectors = secular_modes(w, amplitude, k)
    rate = np.sqrt(square)
    weight = np.zeros(n_groups)
    settled = np.zeros(n_groups)
    rest = offset[0]
    for j in range(n_groups):
        for i in range(n_groups):
            weight[j] += vectors[i, j] * amplitude[i]
            settled[j] += vectors[i, j] * (push[i] - k * amplitude[i] * offset[0])
        settled[j] /= square[j]
        rest += weight[j] * settled[j]
    q = start_q.copy()
    p = start_p.copy()
    a = np.empty(n_groups)
    b = np.empty(n_groups)
    x = np.empty(n_groups)
    v = np.empty(n_groups)
    flights = np.empty((GLIDES + 1, N_LANE, n_modes))
    flown = np.zeros(GLIDES + 1)
    stride = 3 + s
    steps = np.zeros((64, 3 + stride))
    now = np.zeros((5, 1))
    done = np.zeros(1)
    values = np.empty(s)
    n_steps = ZERO
    n_released = 0
    time = 0.0
    status = EXHAUSTED
    pressed = np.zeros(1, np.bool_)
    begin(shape, offset, q, p, now, pressed)
    while n_steps < max_steps:
        if time >= horizon:
            status = HORIZON
            break
        if 0 < max_impacts <= n_released:
            status = IMPACTS
            break
        if n_steps + 1 >= steps.shape[0]:
            steps = resized(steps, n_steps, 2 * steps.shape[0])
        if not pressed[0]:
            elapsed, first, found = find_onset(
                omega, zeta, shape, offset, bias, horizon - time, base, 1e-6 * base, depth, still, flights, flown, q, p
            )
            if found == 1:
                status = FINISHED
                break
            land(shape, offset, time, elapsed, first, found, steps[n_steps], stride, now, pressed, q, p)
            if elapsed > 0.0:
                n_steps += 1
                time += elapsed
            if found >= 3:
                status = FAILED if found == 3 else EXHAUSTED
                break
            continue
        for i in range(n_groups):
            a[i] = 0.0
            b[i] = 0.0
        for n in range(n_modes):
            if group[n] >= 0:
                a[group[n]] += shape[0, n] * q[n] / amplitude[group[n]]
                b[group[n]] += shape[0, n] * p[n] / amplitude[group[n]]
        hardest = 0.0
        for j in range(n_groups):
            x[j] = -settled[j]
            v[j] = 0.0
            for i in range(n_groups):
                x[j] += vectors[i, j] * a[i]
                v[j] += vectors[i, j] * b[i]
            hardest += abs(weight[j]) * square[j] * np.sqrt(x[j] * x[j] + v[j] * v[j] / square[j])
        elapsed = 0.0
        left = horizon - time
        dt = now[0, 0]
        rt = now[4, 0]
        released = False
        for _ in range(LOOK_LIMIT // (n_groups + 50)):
            wait = quadratic_wait(-dt, -rt, hardest)
            if wait <= 4e-16 * elapsed or (elapsed > 0.0 and dt <= 0.0):
                released = True
                break
            elapsed = min(left, elapsed + wait)
            dt, rt = secular_approach(rate, weight, x, v, rest, elapsed)
            if elapsed >= left:
                break
        else:
            status = EXHAUSTED
            break
        n_parts = 16
        misfit = np.inf
        while misfit > SECULAR_MISFIT and n_parts < 4096:
            n_parts *= 2
            h = elapsed / n_parts
            peak = 0.0
            misfit = 0.0
            for part in range(n_parts):
                end = 0.0
                for c in range(s):
                    values[c], _ = secular_approach(rate, weight, x, v, rest, (part + nodes[c]) * h)
                    peak = max(peak, values[c])
                    for m in range(s):
                        end += powers[c, m] * values[c]
                exact, _ = secular_approach(rate, weight, x, v, rest, (part + 1.0) * h)
                misfit = max(misfit, abs(exact - end))
            misfit /= max(peak, 1e-300)
        while n_steps + n_parts + 2 >= steps.shape[0]:
            steps = resized(steps, n_steps, 2 * steps.shape[0])
        for part in range(n_parts):
            for j in range(steps.shape[1]):
                steps[n_steps, j] = 0.0
            steps[n_steps, 0] = time + part * h
            steps[n_steps, 1] = h
            steps[n_steps, 3], steps[n_steps, 4] = secular_approach(rate, weight, x, v, rest, part * h)
            if part == 0:
                steps[n_steps, 3] = now[0, 0]
            steps[n_steps, 5] = 1.0
            for c in range(s):
                value, speed = secular_approach(rate, weight, x, v, rest, (part + nodes[c]) * h)
                share = 0.0
                for m in range(s):
                    steps[n_steps, 6 + m] += powers[c, m] * k * value
                    share += powers[c, m] / (m + 1.0)
                done[0] += share * h * k * value * speed
            n_steps += 1
        lane_table(omega, zeta, elapsed, WHOLE, flights[GLIDES])
        glide(flights[GLIDES], elapsed, bias, q, p)
        for j in range(n_groups):
            sine = np.sin(rate[j] * elapsed)
            cosine = np.cos(rate[j] * elapsed)
            x0 = x[j]
            x[j] = settled[j] + x0 * cosine + v[j] * sine / rate[j]
            v[j] = v[j] * cosine - x0 * rate[j] * sine
        for i in range(n_groups):
            a0, a12, a22, _, _, _ = (
                mode_matrix(w[i], 0.0, elapsed) if w[i] > 0.0 else (1.0, elapsed, 1.0, 0.0, 0.0, 0.0)
            )
            free_a = a0 * a[i] + a12 * b[i]
            free_b = -w[i] * w[i] * a12 * a[i] + a22 * b[i]
            if push[i] != 0.0:
                half = np.sin(0.5 * w[i] * elapsed) / w[i] if w[i] > 0.0 else 0.5 * elapsed
                free_a += 2.0 * half * half * push[i]
                free_b += a12 * push[i]
            a[i] = -free_a
            b[i] = -free_b
            for j in range(n_groups):
                a[i] += vectors[i, j] * x[j]
                b[i] += vectors[i, j] * v[j]
        for n in range(n_modes):
            if group[n] >= 0:
                q[n] += shape[0, n] / amplitude[group[n]] * a[group[n]]
                p[n] += shape[0, n] / amplitude[group[n]] * b[group[n]]
        time += elapsed
        now[0, 0], now[4, 0] = approach(shape, offset, 0, q, p)
        if released:
            now[0, 0] = 0.0
            pressed[0] = False
            n_released += 1
    return resized(steps, n_steps, n_steps), q, p, now, done, time, status, 0, 0


@inner(allocates=True)
def push(omega, zeta, shape, bias, row, n_coefficients, length, q, p, out_q, out_p):
    """State after a part of a step, (n_modes,), from the step's start; exact for its polynomial forces."""
    if length <= 0.0:
        for n in range(q.size):
            out_q[n] = q[n]
            out_p[n] = p[n]
        return
    m = shape.shape[0]
    stride = 3 + n_coefficients
    moments = np.empty(n_coefficients + 1)
    work = np.empty((2, n_coefficients))
    weights = np.zeros((n_coefficients, m))
    active = False
    for i in range(m):
        scale = 1.0
        for k in range(n_coefficients):
            weights[k, i] = row[6 + stride * i + k] * scale
            scale *= (k + 1.0) * length / row[1]
            if weights[k, i] != 0.0:
                active = True
    for n in range(q.size):
        q0 = q[n]
        a11, a12, a22 = mode_moments(omega[n], zeta[n], length, moments, work)
        x = bias[n] * moments[1]
        v = bias[n] * moments[0]
        if active:
            for i in range(m):
                for k in range(n_coefficients):
                    x -= shape[i, n] * weights[k, i] * moments[k + 1]
                    v -= shape[i, n] * weights[k, i] * moments[k]
        out_q[n] = a11 * q0 + a12 * p[n] + length * length * x
        out_p[n] = -omega[n] * omega[n] * a12 * q0 + a22 * p[n] + length * v


@outer()
def replay(omega, zeta, shape, bias, start_q, start_p, steps, n_coefficients, times, out_q, out_p):
    """States (n_times, n_modes) at ascending times, from the start state and the recorded forces; exact in between."""
    n_steps = steps.shape[0]
    q = start_q.copy()
    p = start_p.copy()
    flight = np.zeros(steps.shape[1])
    flight[1] = 1.0
    begin = 0.0
    k = 0
    for j in range(n_steps + 1):
        row = flight if j == n_steps else steps[j]
        ends = np.inf if j == n_steps else begin + row[1]
        while k < times.size and times[k] < ends:
            push(omega, zeta, shape, bias, row, n_coefficients, times[k] - begin, q, p, out_q[k], out_p[k])
            k += 1
        if k >= times.size or j == n_steps:
            return
        push(omega, zeta, shape, bias, row, n_coefficients, row[1], q, p, q, p)
        begin = steps[j + 1, 0] if j + 1 < n_steps else begin + row[1]


@outer()
def compressions(approach, k, a, c):
    """Spring compression at many approaches, (n,), zero where apart."""
    result = np.zeros(approach.size)
    for n in range(approach.size):
        if approach[n] > 0.0:
            result[n] = compression(approach[n], k, a, c)
    return result


@inner()
def force_within(steps, now, law, n_coefficients, row, i, part):
    """Force of contact i at a fraction of a step: the law on the cubic through both ends, or a higher polynomial."""
    first = 3 + (3 + n_coefficients) * i
    if n_coefficients > 2:
        value = 0.0
        for k in range(n_coefficients - 1, -1, -1):
            value = value * part + steps[row, first + 3 + k]
        return max(value, 0.0)
    last = row + 1 == steps.shape[0]
    h = steps[row, 1]
    d0 = steps[row, first]
    v0 = steps[row, first + 1]
    d1 = now[0, i] if last else steps[row + 1, first]
    v1 = now[4, i] if last else steps[row + 1, first + 1]
    a = 2.0 * (d0 - d1) + h * (v0 + v1)
    b = 3.0 * (d1 - d0) - h * (2.0 * v0 + v1)
    d = d0 + part * (h * v0 + part * (b + part * a))
    if d <= 0.0:
        return 0.0
    rate = v0 + part * (2.0 * b + 3.0 * a * part) / h
    _, f, _ = law_at(d, law, i)
    return max(f * (1.0 + law[i, 2] * rate), 0.0)


@inner()
def pushing(steps, now, law, n_coefficients, row, i):
    """Fractions of a step between which contact i pushes, by the cubic through both ends; (0, 0) if it does not.

    A lossy contact stops pushing while the bodies still overlap, when they part as fast as 1 / loss.
    """
    first = 3 + (3 + n_coefficients) * i
    if steps[row, first + 2] == 0.0:
        return 0.0, 0.0
    final = row + 1 == steps.shape[0]
    h = steps[row, 1]
    d0 = steps[row, first]
    v0 = steps[row, first + 1]
    d1 = now[0, i] if final else steps[row + 1, first]
    v1 = now[4, i] if final else steps[row + 1, first + 1]
    lower = 0.0
    upper = 1.0
    if d0 < 0.0 < d1:
        lower = hermite_root(d0, v0, d1, v1, h) / h
    elif d1 < 0.0 < d0:
        upper = hermite_root(d0, v0, d1, v1, h) / h
    loss = law[i, 2]
    start = 1.0 + loss * v0
    end = 1.0 + loss * v1
    if start <= 0.0 and end <= 0.0:
        return 0.0, 0.0
    if start < 0.0 or end < 0.0:
        at = letting_go(loss, d0, v0, d1, v1, h)
        if start < 0.0:
            lower = max(lower, at)
        else:
            upper = min(upper, at)
    return lower, upper


@outer()
def nearest_turn(steps, now, width):
    """How near to zero an approach turns back, over the farthest it ever turns; infinity where none does.

    ``width`` numbers of a step belong to each contact, the approach and its rate first.
    """
    nearest = np.inf
    farthest = 0.0
    for i in range(now.shape[1]):
        first = 3 + width * i
        for row in range(steps.shape[0]):
            d0 = steps[row, first]
            v0 = steps[row, first + 1]
            d1 = now[0, i]
            v1 = now[4, i]
            if row + 1 < steps.shape[0]:
                d1 = steps[row + 1, first]
                v1 = steps[row + 1, first + 1]
            if (v0 < 0.0 < v1) or (v1 < 0.0 < v0):
                side = 1.0 if v0 < 0.0 else -1.0
                turn = side * lowest(side * d0, side * v0, side * d1, side * v1, steps[row, 1])
                nearest = min(nearest, abs(turn))
                farthest = max(farthest, turn)
    return nearest / farthest if farthest > 0.0 else np.inf


@outer()
def find_impacts(steps, now, law, n_coefficients, looks, touch):
    """Every unbroken push, (n_impacts, 5): start, end, peak force, impulse, contact; contact by contact.

    Bodies that touch and approach no faster than ``touch`` [m/s] before the first push press from the start of that
    time. The peak is sought with ``looks`` per step about the largest of a few, and refined by parabolas.
    """
    n_steps = steps.shape[0]
    m = law.shape[0]
    width = 3 + n_coefficients
    result = np.empty((8, 5))
    count = ZERO
    for i in range(m):
        first = 3 + width * i
        row: Any = ZERO
        while row < n_steps:
            lower, upper = pushing(steps, now, law, n_coefficients, row, i)
            if lower >= upper:
                row += 1
                continue
            if count == result.shape[0]:
                result = resized(result, count, 2 * count)
            begin = row
            start = steps[row, 0] + lower * steps[row, 1]
            end = start
            impulse = 0.0
            peak = 0.0
            peak_row = row
            peak_part = 0.0
            while upper > lower:
                for k in range(n_coefficients):
                    impulse += steps[row, 1] * steps[row, first + 3 + k] / (k + 1.0)
                for look in range(n_coefficients):
                    f = force_within(steps, now, law, n_coefficients, row, i, look / n_coefficients)
                    if f > peak:
                        peak = f
                        peak_row = row
                end = steps[row, 0] + upper * steps[row, 1]
                row += 1
                if upper < 1.0 or row == n_steps:
                    break
                lower, upper = pushing(steps, now, law, n_coefficients, row, i)
                if lower > 0.0:
                    break
            last = row - 1
            for near in range(max(begin, peak_row - 1), min(last, peak_row + 1) + 1):
                for look in range(looks + 1):
                    f = force_within(steps, now, law, n_coefficients, near, i, look / looks)
                    if f >= peak:
                        peak = f
                        peak_row = near
                        peak_part = look / looks
            if steps[begin, first] == 0.0:
                while begin > 0 and steps[begin - 1, first] == 0.0 and abs(steps[begin - 1, first + 1]) <= touch:
                    begin -= 1
                    start = steps[begin, 0]
            spread = 1.0 / looks
            for _ in range(4):
                middle = min(max(peak_part, spread), 1.0 - spread)
                low = force_within(steps, now, law, n_coefficients, peak_row, i, middle - spread)
                top = force_within(steps, now, law, n_coefficients, peak_row, i, middle)
                high = force_within(steps, now, law, n_coefficients, peak_row, i, middle + spread)
                bend = low - 2.0 * top + high
                if bend >= 0.0:
                    break
                peak_part = middle + min(max(0.5 * (low - high) / bend, -1.0), 1.0) * spread
                peak = max(peak, force_within(steps, now, law, n_coefficients, peak_row, i, peak_part))
                spread *= 0.125
            result[count, 0] = start
            result[count, 1] = end
            result[count, 2] = peak
            result[count, 3] = impulse
            result[count, 4] = i
            count += 1
    return resized(result, count, count)
