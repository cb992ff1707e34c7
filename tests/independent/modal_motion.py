"""One blow on modes, followed to rounding by means of its own: what the reference of every attack moves by.

The motion is a sum of modes, each struck by one force F(d, d'): q'' + 2 zeta omega q' + omega**2 q = -s F and
d = sum s q, with signed shapes s. In contact F is a polynomial in each step that obeys the law at eight Gauss points;
every mode answers to it in closed form. Between those points and at both ends the law is evaluated again: where it
departs from the polynomial the step is halved, so steps shrink by themselves towards onset, release, corners of the law
and where a contact nearly splits. In flight all modes move exactly, and a bound on the fourth derivative of d tells for
every interval whether a touch may hide in it; where it may, the interval is halved until it is decided.
"""

import numba
import numpy as np

POINTS = 8
GAUSS = 0.5 + 0.5 * np.polynomial.legendre.leggauss(POINTS)[0]  # on 0 ... 1
ROWS = np.concatenate([GAUSS, [0.055, 0.32, 0.5, 0.68, 0.945, 1.0]])  # points of collocation, then those that check it
TO_POWERS = np.linalg.inv(np.vander(GAUSS, increasing=True))  # (8, 8) from values at the points to coefficients
LEVELS = 44  # [-] sizes of step, each half of the one before: the least is 1e-14 of a contact
FIRST_LEVEL = 12  # [-] of the step that is tried first after an onset
SAMPLES = 32  # [-] looks at the polynomials of a step, for dips and peaks
DEPTH = 40  # [-] halvings of an interval of flight
GRAIN = 1e-14  # [-] of the swing: a touch less deep than this is none
NEAR = 1e-4  # [-] of the swing: what an interval of flight may leave open before it is halved
MOST_STEPS = 20_000  # [-] of one contact
MOST_FLIGHT = 400_000  # [-] intervals of one flight
DONE, UNDECIDED, MANY, CUT, STUCK = range(5)  # how a run ends; CUT: the loss would pull although still pressed


@numba.njit(cache=True, error_model="numpy")
def advance(w, z, t):
    """State transition of one mode over a time: q = c q + s p, p = e q + f p."""
    if w == 0.0:
        return 1.0, t, 0.0, 1.0
    root = np.sqrt(1.0 - z * z)
    decay = np.exp(-z * w * t)
    cos, sin = decay * np.cos(w * root * t), decay * np.sin(w * root * t) / root
    return cos + z * sin, sin / w, -w * sin, cos - z * sin


@numba.njit(cache=True, error_model="numpy")
def answer(w, z, h, x, out_q, out_p):
    """Motion at the fraction x of a step h after rest, to forces (t/h)**m, m = 0 ... 7.

    With W = w h: W**2 q_m + 2 z W m q_(m-1) + m (m-1) q_(m-2) = x**m, as the answer to the derivative of a force is
    the derivative of the answer; downwards this is stable where W x is small, upwards where it is not.
    """
    big = w * h
    if big * x < 7.0:
        after, here = 0.0, 0.0  # q_(m), q_(m-1): forgotten on the way down
        most = 2 * ((16 + int(4.0 * big * x)) // 2) + 1
        power = x**most
        for m in range(most, 1, -1):
            before = (power - 2.0 * z * big * m * here - big * big * after) / (m * (m - 1.0))
            power /= x
            after, here = here, before
            if m - 2 < POINTS:
                out_q[m - 2] = before
    c, s, _, _ = advance(w, z, x * h)
    swift = s / h
    if big * x >= 7.0:
        out_q[0] = (1.0 - c) / big**2
        out_q[1] = (x - 2.0 * z * big * out_q[0] - swift) / big**2
        power = x
        for m in range(2, POINTS):
            power *= x
            out_q[m] = (power - 2.0 * z * big * m * out_q[m - 1] - m * (m - 1.0) * out_q[m - 2]) / big**2
    out_p[0] = h * swift
    for m in range(1, POINTS):
        out_p[m] = h * m * out_q[m - 1]
    for m in range(POINTS):
        out_q[m] *= h * h


@numba.njit(cache=True, error_model="numpy")
def _tables(omega, zeta, shape, h, rows, to_powers, out_d_free, out_v_free, out_move, out_end, out_d, out_v):
    """Of one step size: free motion to the points, the approach's answers there, and each mode's at the end."""
    n, n_rows = len(omega), len(rows)
    d, v = np.zeros((n_rows, POINTS)), np.zeros((n_rows, POINTS))
    q, p = np.empty(POINTS), np.empty(POINTS)
    for k in range(n):
        for i in range(n_rows):
            c, s, e, f = advance(omega[k], zeta[k], rows[i] * h)
            out_d_free[i, k], out_d_free[i, n + k] = shape[k] * c, shape[k] * s
            out_v_free[i, k], out_v_free[i, n + k] = shape[k] * e, shape[k] * f
            answer(omega[k], zeta[k], h, rows[i], q, p)
            for m in range(POINTS):
                d[i, m] += shape[k] ** 2 * q[m]
                v[i, m] += shape[k] ** 2 * p[m]
        out_move[0, k], out_move[1, k], out_move[2, k], out_move[3, k] = c, s, e, f
        for m in range(POINTS):
            out_end[k, m], out_end[n + k, m] = shape[k] * q[m], shape[k] * p[m]
    out_d[:], out_v[:] = d @ to_powers, v @ to_powers


@numba.njit(cache=True, error_model="numpy")
def force_of(law, d, v):
    """Force, its slopes in approach and rate, and whether the loss would pull."""
    stiffness, exponent, loss, depth, hard, hard_exponent = law
    if d <= 0.0:
        return 0.0, 0.0, 0.0, False
    force = stiffness * d**exponent
    slope = exponent * force / d
    if hard > 0.0 and d > depth:
        more = hard * (d - depth) ** hard_exponent
        force += more
        slope += hard_exponent * more / (d - depth)
    factor = 1.0 + loss * v
    if factor <= 0.0:
        return 0.0, 0.0, 0.0, True
    return force * factor, slope * factor, force * loss, False


@numba.njit(cache=True, error_model="numpy")
def _solve(law, d_free, v_free, d_table, v_table, out_force, out_d, out_v):
    """Forces at the points by Newton from those that ``out_force`` brings; whether it settles, and whether it pulls."""
    jacobian, miss = np.empty((POINTS, POINTS)), np.empty(POINTS)
    cut, largest, size = False, 0.0, 1e-300
    for _ in range(40):
        largest, size, cut = 0.0, 1e-300, False
        for i in range(POINTS):
            d, v = d_free[i], v_free[i]
            for j in range(POINTS):
                d -= d_table[i, j] * out_force[j]
                v -= v_table[i, j] * out_force[j]
            value, by_d, by_v, pulls = force_of(law, d, v)
            cut |= pulls
            miss[i] = out_force[i] - value
            for j in range(POINTS):
                jacobian[i, j] = (1.0 if i == j else 0.0) + by_d * d_table[i, j] + by_v * v_table[i, j]
            largest, size = max(largest, abs(miss[i])), max(size, abs(value))
        if not largest < 1e280:
            return False, cut
        change = np.linalg.solve(jacobian, miss)
        for i in range(POINTS):
            out_force[i] -= change[i]
        if largest <= 1e-12 * size:
            break
    for i in range(len(d_free)):
        out_d[i], out_v[i] = d_free[i], v_free[i]
        for j in range(POINTS):
            out_d[i] -= d_table[i, j] * out_force[j]
            out_v[i] -= v_table[i, j] * out_force[j]
    return largest <= 1e-9 * size, cut


@numba.njit(cache=True, error_model="numpy")
def _value(power, x):
    """A polynomial by its coefficients."""
    total = 0.0
    for m in range(POINTS - 1, -1, -1):
        total = total * x + power[m]
    return total


@numba.njit(cache=True, error_model="numpy")
def _dips(power):
    """Whether a polynomial that is positive at both ends may pass zero in between: a dip small beside its range."""
    left, here, most = power[0], _value(power, 1.0 / SAMPLES), power[0]
    least = np.inf
    for i in range(2, SAMPLES + 1):
        right = _value(power, i / SAMPLES)
        most = max(most, here, right)
        if here <= 0.0 or right <= 0.0:
            return True
        bend = left - 2.0 * here + right
        if here <= left and here < right:
            least = min(least, here - (right - left) ** 2 / (8.0 * bend))
        left, here = here, right
    return least < 0.05 * (most - least)


@numba.njit(cache=True, error_model="numpy")
def _peak(power):
    """Largest value of a polynomial on 0 ... 1: the best of the samples, then Newton on the slope."""
    best, x = -np.inf, 0.0
    for i in range(SAMPLES + 1):
        value = _value(power, i / SAMPLES)
        if value > best:
            best, x = value, i / SAMPLES
    for _ in range(4):
        slope, bend = 0.0, 0.0
        for m in range(POINTS - 1, 0, -1):
            slope = slope * x + m * power[m]
        for m in range(POINTS - 1, 1, -1):
            bend = bend * x + m * (m - 1.0) * power[m]
        if not bend < 0.0:
            break
        x -= slope / bend
    if 0.0 <= x <= 1.0:
        best = max(best, _value(power, x))
    return best


@numba.njit(cache=True, error_model="numpy")
def _at(omega, zeta, shape, y, t):
    """Approach and rate after a time of free flight."""
    n = len(omega)
    d, v = 0.0, 0.0
    for k in range(n):
        c, s, e, f = advance(omega[k], zeta[k], t)
        d += shape[k] * (c * y[k] + s * y[n + k])
        v += shape[k] * (e * y[k] + f * y[n + k])
    return d, v


@numba.njit(cache=True, error_model="numpy")
def _fly(omega, zeta, out_y, t):
    """Move all modes freely by a time."""
    n = len(omega)
    for k in range(n):
        c, s, e, f = advance(omega[k], zeta[k], t)
        q, p = out_y[k], out_y[n + k]
        out_y[k], out_y[n + k] = c * q + s * p, e * q + f * p


@numba.njit(cache=True, error_model="numpy")
def _most_of_cubic(h, d0, v0, d1, v1):
    """Largest value in an interval of the cubic with these values and slopes at its ends."""
    best = max(d0, d1)
    b, c = 3.0 * (d1 - d0) - h * (2.0 * v0 + v1), 2.0 * (d0 - d1) + h * (v0 + v1)
    root = b * b - 3.0 * c * h * v0
    if root > 0.0:
        big = -(b + np.sqrt(root)) if b >= 0.0 else -(b - np.sqrt(root))  # the root free of cancellation
        for x in (big / (3.0 * c) if c != 0.0 else -1.0, h * v0 / big if big != 0.0 else -1.0):
            if 0.0 < x < 1.0:
                best = max(best, d0 + x * (h * v0 + x * (b + x * c)))
    return best


@numba.njit(cache=True, error_model="numpy")
def _first_touch(omega, zeta, shape, y, h, first, last, fourth, grain):
    """Time of the first touch within h, or -1: intervals are halved until the bound decides; ends are (d, v)."""
    times, approaches, rates = np.empty(DEPTH + 2), np.empty(DEPTH + 2), np.empty(DEPTH + 2)  # right ends yet to do
    times[0], approaches[0], rates[0], top = h, last[0], last[1], 1
    t0, d0, v0 = 0.0, first[0], first[1]
    while top > 0:
        t1, d1, v1 = times[top - 1], approaches[top - 1], rates[top - 1]
        span, middle = t1 - t0, 0.5 * (t0 + t1)
        if max(d1, _most_of_cubic(span, d0, v0, d1, v1) + fourth * span**4 / 384.0) <= grain:
            t0, d0, v0, top = t1, d1, v1, top - 1
        elif top > DEPTH or not t0 < middle < t1:
            if d1 > grain:
                return t1
            t0, d0, v0, top = t1, d1, v1, top - 1
        else:
            d, v = _at(omega, zeta, shape, y, middle)
            times[top], approaches[top], rates[top], top = middle, d, v, top + 1
    return -1.0


@numba.njit(cache=True, error_model="numpy")
def _next_touch(omega, zeta, shape, y, longest):
    """Fly to the next touch; 1 there, 0 where the bodies part for good, -1 where neither comes in time."""
    n = len(omega)
    move = np.empty((4, n))
    h, fourth, grain = 0.0, 0.0, 0.0
    before = _at(omega, zeta, shape, y, 0.0)
    for step in range(MOST_FLIGHT):
        if step % 64 == 0:
            away, speed, swing, fourth = 0.0, 0.0, 0.0, 0.0
            for k in range(n):
                if omega[k] == 0.0:
                    away += shape[k] * y[k]
                    speed += shape[k] * y[n + k]
                else:
                    lag = (y[n + k] + zeta[k] * omega[k] * y[k]) / (omega[k] * np.sqrt(1.0 - zeta[k] ** 2))
                    size = abs(shape[k]) * np.sqrt(y[k] ** 2 + lag**2)
                    swing += size
                    fourth += size * omega[k] ** 4
            if speed < 0.0 and away + swing < 0.0:
                return 0
            grain = GRAIN * (swing + abs(away))
            if step == 0:
                h = min(longest, (384.0 * NEAR * swing / fourth) ** 0.25)
                for k in range(n):
                    move[0, k], move[1, k], move[2, k], move[3, k] = advance(omega[k], zeta[k], h)
        d, v = 0.0, 0.0
        for k in range(n):
            d += shape[k] * (move[0, k] * y[k] + move[1, k] * y[n + k])
            v += shape[k] * (move[2, k] * y[k] + move[3, k] * y[n + k])
        touch = _first_touch(omega, zeta, shape, y, h, before, (d, v), fourth, grain)
        if touch >= 0.0:
            _fly(omega, zeta, y, touch)
            return 1
        for k in range(n):
            q, p = y[k], y[n + k]
            y[k], y[n + k] = move[0, k] * q + move[1, k] * p, move[2, k] * q + move[3, k] * p
        before = d, v
    return -1


@numba.njit(cache=True, error_model="numpy")
def _contact(omega, zeta, shape, law, y, longest, accuracy, scale, tables, known, rows, to_powers, out):
    """Follow one contact from its onset to its release; adds to ``out`` impulse, time and peak force."""
    d_free_all, v_free_all, move_all, end_all, d_all, v_all = tables
    n = len(omega)
    force, d, v = np.zeros(POINTS), np.empty(len(rows)), np.empty(len(rows))
    elapsed, level, last = 0.0, FIRST_LEVEL, 0.0
    for _ in range(MOST_STEPS):
        here, rate = _at(omega, zeta, shape, y, 0.0)
        if rate < 0.0 and elapsed > 0.0:  # towards the release steps halve with what is left
            while level < LEVELS - 1 and longest * 0.5**level > -0.5 * max(here, 0.0) / rate:
                level += 1
        h, part, power = 0.0, -1.0, force
        while True:
            h = longest * 0.5**level
            if not known[level]:
                _tables(
                    omega, zeta, shape, h, rows, to_powers, d_free_all[level], v_free_all[level], move_all[level],
                    end_all[level], d_all[level], v_all[level],
                )  # fmt: skip
                known[level] = True
            d_free, v_free = d_free_all[level] @ y, np.zeros(len(rows))
            if law[2] > 0.0:
                v_free = v_free_all[level] @ y
            force[:] = last
            settled, cut = _solve(law, d_free, v_free, d_all[level], v_all[level], force, d, v)
            power = to_powers @ force
            if level == LEVELS - 1:  # nothing is left to halve: a release, or the solution as it is
                if cut:
                    return CUT
                if d.min() <= 0.0:
                    part = h * min(1.0, max(0.0, here / max(here - d.min(), 1e-300)))
                elif not settled:
                    return STUCK
                break
            if settled and not cut and d.min() > 0.0 and not _dips(to_powers @ d[:POINTS]):
                defect = abs(power[0] - last)
                for i in range(POINTS, len(rows)):
                    defect = max(defect, abs(force_of(law, d[i], v[i])[0] - _value(power, rows[i])))
                if defect * h / longest <= accuracy * scale and defect <= 1e4 * accuracy * scale:
                    break
            level += 1
        if part >= 0.0:
            kick = 0.5 * last * part
            for k in range(n):
                y[n + k] -= shape[k] * kick
            _fly(omega, zeta, y, part)
            out[1] += kick
            out[2] += elapsed + part
            return DONE
        kicks = end_all[level] @ power
        move = move_all[level]
        for k in range(n):
            q, p = y[k], y[n + k]
            y[k] = move[0, k] * q + move[1, k] * p - kicks[k]
            y[n + k] = move[2, k] * q + move[3, k] * p - kicks[n + k]
        for m in range(POINTS):
            out[1] += h * power[m] / (m + 1.0)
        out[3] = max(out[3], _peak(power))
        elapsed += h
        last = force_of(law, d[-1], v[-1])[0]
        if level > 0 and 2.0 * h <= elapsed:
            level -= 1
    return STUCK


@numba.njit(cache=True, error_model="numpy")
def follow(omega, zeta, shape, law, speed, scale, longest, accuracy, most, rows, to_powers):
    """All contacts; status and (striker's speed, impulse, contact time, peak force, number of impacts).

    The first mode is the rigid striker's; ``scale`` [N] is the force, ``longest`` [s] the step that errors refer to.
    """
    n, n_rows = len(omega), len(rows)
    tables = (
        np.empty((LEVELS, n_rows, 2 * n)), np.empty((LEVELS, n_rows, 2 * n)), np.empty((LEVELS, 4, n)),
        np.empty((LEVELS, 2 * n, POINTS)), np.empty((LEVELS, n_rows, POINTS)), np.empty((LEVELS, n_rows, POINTS)),
    )  # fmt: skip
    known = np.zeros(LEVELS, np.bool_)
    y, out = np.zeros(2 * n), np.zeros(5)
    y[n] = speed / shape[0]
    while True:
        out[4] += 1.0
        if out[4] > most:
            return MANY, out
        status = _contact(omega, zeta, shape, law, y, longest, accuracy, scale, tables, known, rows, to_powers, out)
        if status != DONE:
            return status, out
        out[0] = shape[0] * y[n]
        found = _next_touch(omega, zeta, shape, y, longest)
        if found == 0:
            return DONE, out
        if found < 0:
            return UNDECIDED, out
