"""Exact motion of modes over a step, free and under polynomial forces.

Every mode obeys ``q'' + 2 zeta omega q' + omega**2 q = -u F(t)``. Its impulse response g and the matrix that carries
(q, q') over a step are known in closed form, so a step of any length is exact for a force that is a polynomial of time.
What the force does follows from moments ``m_k = h**(-k-1) integral of (h-t)**(k-1)/(k-1)! g(t)``, m_0 = g(h)/h; they
obey ``(omega h)**2 m_(k+1) = 1/k! - 2 zeta omega h m_k - m_(k-1)``. The recursion cancels where omega h is small; there
it runs downwards. Heavily damped modes split into two exponentials.

Sines and cosines use Cody and Waite's argument reduction and the polynomials of fdlibm, so that the compiler can run
them in parallel lanes; sine and cosine of one angle come from the same reduced argument, or the energy would drift.
"""

import numpy as np

from . import arrays
from .arrays import ANGLE_LIMIT, LIGHT, SERIES_END
from .build import LOOSE, TRUE, inner, outer
from .layout import A11, A12, A21, A22, GAIN, HEAD, LENGTH, M1, M2, M3, N_LANE, PUSH, START, WIDTH
from .one_mode import mode_matrix, mode_moments

N_TABLE = 12  # rows of a step table, in the order of `step_table`


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


@inner()
def goes_alone(omega, zeta, h):
    """Whether a mode is too heavily damped or turns too far for the fast lanes."""
    return zeta > LIGHT or omega * h >= ANGLE_LIMIT


@inner(fastmath={"contract"})
def free_table(omega, zeta, h, out_free, out_double):
    """Exact free motion of every mode over h: rows a11, a12, a21, a22 of out_free (4 or more, n_modes).

    out_double (n_modes,) receives twice the damping exponent zeta omega h, zero for modes beyond the fast lanes;
    returns the number of those and of damped modes.
    """
    n_modes = omega.size
    n_single = n_damped = 0
    angle = out_free[A21]
    for n in range(n_modes):
        n_single += 1 if goes_alone(omega[n], zeta[n], h) else 0
        n_damped += 1 if zeta[n] != 0.0 else 0
        z = zeta[n] if zeta[n] <= LIGHT else 0.0
        angle[n] = min(omega[n] * h * np.sqrt((1.0 - z) * (1.0 + z)), ANGLE_LIMIT)
        out_double[n] = z * omega[n] * h
        out_free[A22, n] = 1.0
    waves(angle, out_free[A12], out_free[A11])
    if n_damped > 0:
        decays(out_double, out_free[A22])
    for n in range(n_modes):
        x, y, decay = out_double[n], angle[n], out_free[A22, n]
        s = decay * (out_free[A12, n] / y if y > 0.0 else 1.0)
        c = decay * out_free[A11, n]
        out_free[A11, n] = c + x * s
        out_free[A12, n] = h * s
        out_free[A22, n] = c - x * s
        out_double[n] = 2.0 * x
    for n in range(n_modes if n_single > 0 else 0):
        if goes_alone(omega[n], zeta[n], h):
            out_free[A11, n], out_free[A12, n], out_free[A22, n], _, _, _ = mode_matrix(omega[n], zeta[n], h)
    for n in range(n_modes):
        out_free[A21, n] = -omega[n] * omega[n] * out_free[A12, n]
    return n_single, n_damped


@inner(fastmath={"contract"})
def near_moments(omega, h, double, n_damped, out_moments):
    """Moments 2 and 3 (rows 5 and 6 of out_moments) by recursion downwards, for every mode with omega h < SERIES_END.

    ``(k+1)! m_k`` tends to 1 with omega h; from k = 30 down, what that misses leaves 1e-17.
    """
    for n in range(omega.size if n_damped == 0 else 0):  # the same with half of the terms
        th = min(omega[n] * h, SERIES_END)
        square = th * th
        third = second = 1.0
        for k in range(28, 3, -2):
            second = 1.0 - square * (1.0 / (k * (k + 1))) * second
            third = 1.0 - square * (1.0 / ((k + 1) * (k + 2))) * third
        out_moments[M2, n] = (1.0 / 6.0) * second
        out_moments[M3, n] = (1.0 / 24.0) * third
    for n in range(omega.size if n_damped > 0 else 0):
        th, x = min(omega[n] * h, SERIES_END), min(double[n], 2.0 * SERIES_END)
        square = th * th
        third = second = 1.0
        for k in range(29, 2, -1):
            first = (1.0 - square * (1.0 / ((k + 1) * (k + 2))) * third) - x * (1.0 / (k + 1)) * second
            third = second
            second = first
        out_moments[M2, n] = (1.0 / 6.0) * second
        out_moments[M3, n] = (1.0 / 24.0) * third


@inner(allocates=True, arrays=arrays.lane_table, fastmath={"contract"})
def lane_table(omega, zeta, h, whole, out_lanes):
    """Coefficients of one exact step of length h for every mode, (N_LANE, n_modes), all that others follow from.

    Rows: a11, a12, a21, a22 of the state's step; h times the moments 1 and 2 (see `mode_moments`) and times moment 3
    less half of moment 2. Lightly damped modes take parallel lanes: their moments by recursion downwards below
    SERIES_END, upwards above; the others go one by one. Where it is not asked for the whole, free motion without a
    constant force is all that is made.
    """
    n_modes = omega.size
    double = np.empty(n_modes)
    n_single, n_damped = free_table(omega, zeta, h, out_lanes, double)
    if not whole:
        for n in range(n_modes):
            out_lanes[M1, n] = 0.0
        return
    near_moments(omega, h, double, n_damped, out_lanes)
    part = 1.0 / h
    for n in range(n_modes):
        th = omega[n] * h
        near = th < SERIES_END
        inverse = 1.0 / (1.0 if near else th * th)
        first = out_lanes[A12, n] * part
        m1 = (1.0 - double[n] * first - out_lanes[A22, n]) * inverse
        m2 = (1.0 - double[n] * m1 - first) * inverse
        m3 = (0.5 - double[n] * m2 - m1) * inverse
        m2 = out_lanes[M2, n] if near else m2
        m3 = out_lanes[M3, n] if near else m3
        m1 = 0.5 - double[n] * m2 - th * th * m3 if near else m1
        out_lanes[M1, n] = h * m1
        out_lanes[M2, n] = h * m2
        out_lanes[M3, n] = h * (m3 - 0.5 * m2)
    if n_single == 0:
        return
    work = np.empty((2, 3))
    m = np.empty(4)
    for n in range(n_modes):
        if goes_alone(omega[n], zeta[n], h):
            mode_moments(omega[n], zeta[n], h, m, work)
            out_lanes[M1, n] = h * m[1]
            out_lanes[M2, n] = h * m[2]
            out_lanes[M3, n] = h * (m[3] - 0.5 * m[2])


@outer()
def step_table(omega, zeta, h, out_table):
    """Coefficients of one exact step of length h for every mode, (12, n_modes).

    Rows: a11, a12, a21, a22; b1, b2 (constant force); c1, c2 (ramp t/h - 1/2); the step averages of the free motion
    A1, A2 and of the two forces B0, B1.
    """
    lanes = np.empty((N_LANE, omega.size))
    lane_table(omega, zeta, h, TRUE, lanes)
    for n in range(omega.size):
        for k in range(4):
            out_table[k, n] = lanes[k, n]
        out_table[4, n] = h * lanes[M1, n]
        out_table[5, n] = lanes[A12, n]
        out_table[6, n] = h * (lanes[M2, n] - 0.5 * lanes[M1, n])
        out_table[7, n] = lanes[M1, n] - 0.5 * lanes[A12, n]
        out_table[8, n] = lanes[A12, n] / h + 2.0 * zeta[n] * omega[n] * lanes[M1, n]
        out_table[9, n] = lanes[M1, n]
        out_table[10, n] = h * lanes[M2, n]
        out_table[11, n] = h * lanes[M3, n]


@inner()
def any_of(values):
    """Whether any value is not zero; for less compilation than the general `any`."""
    found = False
    for n in range(values.size):
        found = found or values[n] != 0
    return found


@inner(fastmath=LOOSE)
def product(one, two):
    """Sum of the products of two rows (n,)."""
    total = 0.0
    for n in range(one.size):
        total += one[n] * two[n]
    return total


@inner(arrays=arrays.restore)
def restore(q, p, out_q, out_p):
    """Copy a state; for less compilation than assigning slices."""
    for n in range(q.size):
        out_q[n] = q[n]
        out_p[n] = p[n]


@inner(arrays=arrays.glide, fastmath=LOOSE)
def glide(lanes, h, bias, q, p):
    """Advance a state in place by the free motion over h, whose `lane_table` is given."""
    for n in range(q.size):
        q0 = q[n]
        p0 = p[n]
        q[n] = lanes[A11, n] * q0 + lanes[A12, n] * p0 + h * lanes[M1, n] * bias[n]
        p[n] = lanes[A21, n] * q0 + lanes[A22, n] * p0 + lanes[A12, n] * bias[n]


@inner(arrays=arrays.commit, fastmath=LOOSE)
def commit(shape, lanes, h, force, slope, q, p):
    """Add the motion that a step's forces (mean, slope) cause to a free motion, in place."""
    n_contacts, n_modes = shape.shape
    for i in range(n_contacts):
        f = force[i] - 0.5 * slope[i]
        s = slope[i]
        if force[i] != 0.0 or s != 0.0:
            for n in range(n_modes):
                u = shape[i, n]
                q[n] -= u * h * (f * lanes[M1, n] + s * lanes[M2, n])
                p[n] -= u * (f * lanes[A12, n] + s * lanes[M1, n])


@inner(allocates=True)
def push(scene, row, length, table, q, p):
    """Advance a state (n_modes,) in place by a part of a step, from its start; exact for its linear forces.

    ``table`` is that of the length before, and (2,) that length and whether it is whole.
    """
    bias, shape = scene.bias, scene.shape
    if length <= 0.0:
        return
    force, gain = np.empty(shape.shape[0]), np.empty(shape.shape[0])
    for i in range(force.size):
        first = HEAD + WIDTH * i
        gain[i] = row[first + GAIN] * (length / row[LENGTH])
        force[i] = row[first + PUSH] + 0.5 * gain[i]
    active = any_of(force) or any_of(gain)
    lanes, known = table
    whole = active or any_of(bias)
    if known[0] != length or (whole and known[1] == 0.0):
        lane_table(scene.omega, scene.zeta, length, whole, lanes)
        known[0] = length
        known[1] = 1.0 if whole else 0.0
    glide(lanes, length, bias, q, p)
    if active:
        commit(shape, lanes, length, force, gain, q, p)


@outer()
def replay(scene, steps, times, out_q, out_p):
    """States (n_times, n_modes) at ascending times, from the start state and the recorded forces; exact in between."""
    n_steps = steps.shape[0]
    parts = np.empty((N_LANE, scene.q.size)), np.zeros(2)  # of steps
    wholes = np.empty((N_LANE, scene.q.size)), np.zeros(2)
    q = scene.q.copy()
    p = scene.p.copy()
    flight = np.zeros(steps.shape[1])
    flight[LENGTH] = 1.0
    begin = 0.0
    k = 0
    for j in range(n_steps + 1):
        row = flight if j == n_steps else steps[j]
        ends = np.inf if j == n_steps else begin + row[LENGTH]
        while k < times.size and times[k] < ends:
            restore(q, p, out_q[k], out_p[k])
            push(scene, row, times[k] - begin, parts, out_q[k], out_p[k])
            k += 1
        if k >= times.size or j == n_steps:
            return
        push(scene, row, row[LENGTH], wholes, q, p)
        begin = steps[j + 1, START] if j + 1 < n_steps else begin + row[LENGTH]
