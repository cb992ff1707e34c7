"""Compiled loops: exact modal propagation, energy-exact contact steps and free flight; the only file with numba."""

import numpy as np
from numba import njit

LOOSE = {"reassoc", "contract"}  # sums may be reordered to run in parallel lanes; NaN and infinity keep their meaning
SERIES_LIMIT = 1.0  # [-] below this omega*h the moment recursion cancels and a power series takes over
OVERDAMPED = 1.2  # [-] damping ratio from which the two decay rates are far enough apart for partial fractions
LEVELS = 40  # [-] halvings of the step that may be cached
N_TABLE = 12  # rows of a step table, in the order of `step_table`
LOCATE_LIMIT = 60  # [-] iterations for an event inside a step; bisection alone reaches rounding
EVENT_LIMIT = 64  # [-] events without one full step between them: chatter, passed with unlocated steps
CONTACT, FLIGHT = 0, 1  # what the run does next
FINISHED, HORIZON, IMPACTS, SETTLED, EXHAUSTED, FAILED = 0, 1, 2, 3, 4, 5  # why a run ended


@njit(cache=True, error_model="numpy")
def exponential_sums(z):
    """phi_1, phi_2, phi_3 of -z for z >= 0, where phi_k(-z) = integral of (1-r)^(k-1)/(k-1)! exp(-z r) over [0, 1]."""
    if z < 1.0:
        term = 1.0 / 6.0
        third = 0.0
        for j in range(1, 24):
            third += term
            term *= -z / (j + 3.0)
        second = 0.5 - z * third
        return 1.0 - z * second, second, third
    first = -np.expm1(-z) / z
    second = (1.0 - first) / z
    return first, second, (0.5 - second) / z


@njit(cache=True, error_model="numpy")
def mode_step(w, z, h):
    """Exact step of one mode: (a11, a12, a21, a22) and the moments I1, I2, I3 of its impulse response."""
    if w == 0.0:
        return 1.0, h, 0.0, 1.0, 0.5 * h * h, h**3 / 6.0, h**4 / 24.0
    th = w * h
    x = z * th
    fast = 0.0
    root = 0.0
    if z < 1.0:
        damped = w * np.sqrt((1.0 - z) * (1.0 + z))
        decay = np.exp(-x)
        s = decay * np.sin(damped * h) / damped
        c = decay * np.cos(damped * h)
        a11 = c + z * w * s
        a22 = c - z * w * s
    elif z == 1.0:
        decay = np.exp(-x)
        s = decay * h
        a11 = decay * (1.0 + x)
        a22 = decay * (1.0 - x)
    else:
        root = w * np.sqrt((z - 1.0) * (z + 1.0))
        fast = z * w + root
        slow = w * w / fast
        e1 = np.exp(-slow * h)
        e2 = np.exp(-fast * h)
        s = e1 * (-np.expm1(-2.0 * root * h)) / (2.0 * root)
        a11 = e1 + slow * s
        a22 = e2 - slow * s
    rate = w if z < OVERDAMPED else fast
    if rate * h < SERIES_LIMIT:
        before = 0.0
        now = 1.0
        second = 0.0
        third = 0.0
        factor = 1.0 / 6.0
        for j in range(1, 30):
            second += now * factor
            factor /= j + 3.0
            third += now * factor
            before, now = now, -2.0 * x * now - th * th * before
            if abs(now) * factor < 1e-19 and abs(before) * factor < 1e-19:
                break
        i2 = h**3 * second
        i3 = h**4 * third
        i1 = h * h * (0.5 - 2.0 * x * second - th * th * third)
    elif z < OVERDAMPED:
        if z == 0.0:
            half = np.sin(0.5 * th) / w
            i1 = 2.0 * half * half
        else:
            i1 = (1.0 - a11) / (w * w)
        i2 = (h - 2.0 * z * w * i1 - s) / (w * w)
        i3 = (0.5 * h * h - 2.0 * z * w * i2 - i1) / (w * w)
    else:
        f1, f2, f3 = exponential_sums(slow * h)
        g1, g2, g3 = exponential_sums(fast * h)
        i1 = h * (f1 - g1) / (2.0 * root)
        i2 = h * h * (f2 - g2) / (2.0 * root)
        i3 = h**3 * (f3 - g3) / (2.0 * root)
    return a11, s, -w * w * s, a22, i1, i2, i3


@njit(cache=True, error_model="numpy")
def step_table(omega, zeta, h, out_table):
    """Coefficients of one exact step of length h for every mode, (12, n_modes).

    Rows: a11, a12, a21, a22; b1, b2 (constant force); c1, c2 (ramp t/h - 1/2); the step averages of the free motion
    A1, A2 and of the two forces B0, B1.
    """
    for n in range(omega.size):
        w = omega[n]
        a11, a12, a21, a22, i1, i2, i3 = mode_step(w, zeta[n], h)
        out_table[0, n] = a11
        out_table[1, n] = a12
        out_table[2, n] = a21
        out_table[3, n] = a22
        out_table[4, n] = i1
        out_table[5, n] = a12
        out_table[6, n] = i2 / h - 0.5 * i1
        out_table[7, n] = i1 / h - 0.5 * a12
        out_table[8, n] = (a12 + 2.0 * zeta[n] * w * i1) / h
        out_table[9, n] = i1 / h
        out_table[10, n] = i2 / h
        out_table[11, n] = (i3 / h - 0.5 * i2) / h


@njit(cache=True, error_model="numpy", fastmath=LOOSE)
def contact_sums(shape, table, out_sums):
    """Sums over the modes of u_i u_j times b1, c1, B0, B1, b2, c2: (6, n_contacts, n_contacts)."""
    n_contacts, n_modes = shape.shape
    for i in range(n_contacts):
        for j in range(i + 1):
            s0 = 0.0
            s1 = 0.0
            s2 = 0.0
            s3 = 0.0
            s4 = 0.0
            s5 = 0.0
            for n in range(n_modes):
                uu = shape[i, n] * shape[j, n]
                s0 += uu * table[4, n]
                s1 += uu * table[6, n]
                s2 += uu * table[10, n]
                s3 += uu * table[11, n]
                s4 += uu * table[5, n]
                s5 += uu * table[7, n]
            out_sums[0, i, j] = s0
            out_sums[1, i, j] = s1
            out_sums[2, i, j] = s2
            out_sums[3, i, j] = s3
            out_sums[4, i, j] = s4
            out_sums[5, i, j] = s5
            for r in range(6):
                out_sums[r, j, i] = out_sums[r, i, j]


@njit(cache=True, error_model="numpy")
def power(x, exponent):
    """x**exponent for x > 0 without the general power where a root will do."""
    if exponent == 1.0:
        return x
    if exponent == 1.5:
        return x * np.sqrt(x)
    return x**exponent


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def law_at(d, law, i):
    """Spring compression, elastic force and stored energy of contact i at approach d."""
    if d <= 0.0:
        return d, 0.0, 0.0
    k, a, c = law[i, 0], law[i, 1], law[i, 3]
    x = compression(d, k, a, c)
    f = k * power(x, a)
    return x, f, f * x / (a + 1.0) + 0.5 * c * f * f


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def solve_constants(h, now, law, e, sums, work, out_y, out_f):
    """Scheme A for several contacts: one contact at a time (descent of a convex function), sped up by Newton steps.

    ``now`` holds approach, compression, force, energy and rate of each contact, (5, n_contacts).
    """
    m = e.size
    if m == 1:
        out_y[0], out_f[0] = solve_constant(
            now[0, 0], now[1, 0], now[2, 0], now[3, 0], e[0], sums[0, 0, 0], law[0, 2] / h, law, 0
        )
        return
    matrix = work[:m, :m]
    step = work[m, :m]
    trial = work[m + 1, :m]
    for i in range(m):
        out_y[i] = e[i]
        out_f[i] = 0.0
    for _ in range(400):
        change = 0.0
        scale = 0.0
        for i in range(m):
            rest = e[i]
            for j in range(m):
                if j != i:
                    rest -= sums[0, i, j] * out_f[j]
            old = out_f[i]
            out_y[i], out_f[i] = solve_constant(
                now[0, i], now[1, i], now[2, i], now[3, i], rest, sums[0, i, i], law[i, 2] / h, law, i
            )
            change = max(change, abs(out_f[i] - old))
            scale = max(scale, out_f[i])
        if change <= 2e-16 * scale:
            break
        residual = 0.0
        for i in range(m):
            x1, f1, v1 = law_at(out_y[i], law, i)
            g, slope = law_pair(now[0, i], now[1, i], now[2, i], now[3, i], out_y[i], x1, f1, v1, law, i)
            span = out_y[i] - now[0, i]
            turn = (f1 - g) / span if abs(span) > 1e-6 * (abs(out_y[i]) + abs(now[0, i])) else 0.5 * slope
            turn += law[i, 2] / h * f1
            if out_f[i] == 0.0:
                turn = 0.0
            step[i] = out_y[i] - e[i]
            for j in range(m):
                step[i] += sums[0, i, j] * out_f[j]
            residual = max(residual, abs(step[i]))
            for j in range(m):
                matrix[j, i] = sums[0, j, i] * turn
        for i in range(m):
            matrix[i, i] += 1.0
        if not solve_linear(matrix, step, m):
            continue
        worst = 0.0
        for i in range(m):
            trial[i] = out_y[i] - step[i]
        for i in range(m):
            x1, f1, v1 = law_at(trial[i], law, i)
            g, slope = law_pair(now[0, i], now[1, i], now[2, i], now[3, i], trial[i], x1, f1, v1, law, i)
            step[i] = max(0.0, g + law[i, 2] / h * (v1 - now[3, i]))
        for i in range(m):
            r = trial[i] - e[i]
            for j in range(m):
                r += sums[0, i, j] * step[j]
            worst = max(worst, abs(r))
        if worst < 0.5 * residual:
            for i in range(m):
                out_y[i] = trial[i]
                out_f[i] = step[i]


@njit(cache=True, error_model="numpy")
def ramp_forces(h, y, now, law, e, ea, vf, sums, work, out_f, out_s, out_r):
    """Mean and slope of the forces of scheme A4 if the step ended at approaches y, and the residual in y."""
    m = y.size
    if m == 1:
        d0 = now[0, 0]
        x1, f1, v1 = law_at(y[0], law, 0)
        g, d = law_pair(d0, now[1, 0], now[2, 0], now[3, 0], y[0], x1, f1, v1, law, 0)
        loss = law[0, 2]
        right = g + d * (ea[0] - 0.5 * (d0 + y[0])) + loss * (v1 - now[3, 0]) / h
        m11 = 1.0 + d * sums[2, 0, 0]
        if loss == 0.0:
            s = f1 - now[2, 0]
            f = (right - d * sums[3, 0, 0] * s) / m11
        else:
            top = f1 - now[2, 0] + loss * (f1 * vf[0] - now[2, 0] * now[4, 0])
            m12 = d * sums[3, 0, 0]
            m21 = loss * f1 * sums[4, 0, 0]
            m22 = 1.0 + loss * f1 * sums[5, 0, 0]
            det = m11 * m22 - m12 * m21
            f = (right * m22 - m12 * top) / det
            s = (m11 * top - m21 * right) / det
        out_f[0] = f
        out_s[0] = s
        out_r[0] = y[0] - e[0] + sums[0, 0, 0] * f + sums[1, 0, 0] * s
        return True
    matrix = work[: 2 * m, : 2 * m]
    vector = work[2 * m, : 2 * m]
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


@njit(cache=True, error_model="numpy")
def solve_ramps(h, now, law, e, ea, vf, sums, work, out_y, out_f, out_s):
    """Scheme A4: mean and slope of the forces of one step, starting from the approaches of scheme A in out_y.

    Returns False where the iteration does not settle or a force would pull; the step then belongs to scheme A.
    """
    m = e.size
    width = work.shape[1]
    base = work.shape[0] - 6
    r = work[base, :m]
    r2 = work[base + 1, :m]
    f2 = work[base + 2, :m]
    s2 = work[base + 3, :m]
    y2 = work[base + 4, :m]
    inner = work[: base - 2 * m - 1]
    jacobian = work[base - 2 * m - 1 : base - 1, :width]
    settled = False
    if m == 1:
        slope = 0.0
        before = 0.0
        scale = max(abs(e[0]), abs(now[0, 0]))
        for iteration in range(25):
            ramp_forces(h, out_y, now, law, e, ea, vf, sums, inner, out_f, out_s, r)
            if settled or r[0] == 0.0:
                settled = True
                break
            if iteration == 0:
                x1, f1, v1 = law_at(out_y[0], law, 0)
                _, d = law_pair(now[0, 0], now[1, 0], now[2, 0], now[3, 0], out_y[0], x1, f1, v1, law, 0)
                slope = 1.0 + 0.5 * sums[0, 0, 0] * d
            else:
                dr = r[0] - before
                if dr != 0.0 and y2[0] != 0.0:
                    slope = dr / y2[0]
            if not abs(slope) > 0.0:
                return False
            step = -r[0] / slope
            before = r[0]
            old = out_y[0]
            out_y[0] = old + step
            y2[0] = out_y[0] - old
            if not abs(step) < 1e300:
                return False
            if abs(step) <= 2e-15 * max(abs(out_y[0]), 1e-2 * scale) or y2[0] == 0.0:
                settled = True
    else:
        for _ in range(20):
            if not ramp_forces(h, out_y, now, law, e, ea, vf, sums, inner, out_f, out_s, r):
                return False
            if settled:
                break
            scale = 0.0
            for i in range(m):
                scale = max(scale, abs(e[i]), abs(now[0, i]))
            for j in range(m):
                for i in range(m):
                    y2[i] = out_y[i]
                shift = 1e-7 * max(abs(out_y[j]), 1e-3 * scale)
                y2[j] += shift
                shift = y2[j] - out_y[j]
                if not ramp_forces(h, y2, now, law, e, ea, vf, sums, inner, f2, s2, r2):
                    return False
                for i in range(m):
                    jacobian[i, j] = (r2[i] - r[i]) / shift
            if not solve_linear(jacobian, r, m):
                return False
            largest = 0.0
            for i in range(m):
                out_y[i] -= r[i]
                largest = max(largest, abs(r[i]))
            if not largest < 1e300:
                return False
            if largest <= 4e-15 * scale:
                settled = True
    if not settled:
        return False
    for i in range(m):
        if not out_f[i] >= 0.0:
            return False
        if law[i, 2] > 0.0:
            _, _, v1 = law_at(out_y[i], law, i)
            mean = ea[i]
            for j in range(m):
                mean -= sums[2, i, j] * out_f[j] + sums[3, i, j] * out_s[j]
            lost = out_f[i] * (out_y[i] - now[0, i]) + out_s[i] * (0.5 * (now[0, i] + out_y[i]) - mean)
            if lost < v1 - now[3, i]:
                return False
    return True


@njit(cache=True, error_model="numpy", fastmath=LOOSE)
def predict(shape, table, offset, bias, q, p, out_q, out_p, out_end):
    """Free motion over one step: the new state and, per contact, end approach, mean approach and end rate (3, m)."""
    n_contacts, n_modes = shape.shape
    for n in range(n_modes):
        out_q[n] = table[0, n] * q[n] + table[1, n] * p[n] + table[4, n] * bias[n]
        out_p[n] = table[2, n] * q[n] + table[3, n] * p[n] + table[5, n] * bias[n]
    for i in range(n_contacts):
        end = 0.0
        mean = 0.0
        rate = 0.0
        for n in range(n_modes):
            u = shape[i, n]
            end += u * out_q[n]
            mean += u * (table[8, n] * q[n] + table[9, n] * p[n] + table[10, n] * bias[n])
            rate += u * out_p[n]
        out_end[0, i] = offset[i] + end
        out_end[1, i] = offset[i] + mean
        out_end[2, i] = rate


@njit(cache=True, error_model="numpy", fastmath=LOOSE)
def commit(shape, table, force, slope, free_q, free_p, out_q, out_p):
    """Add the motion the step's forces (mean, slope) cause to the free motion."""
    n_contacts, n_modes = shape.shape
    if n_contacts == 1:
        f = force[0]
        s = slope[0]
        for n in range(n_modes):
            u = shape[0, n]
            out_q[n] = free_q[n] - u * (f * table[4, n] + s * table[6, n])
            out_p[n] = free_p[n] - u * (f * table[5, n] + s * table[7, n])
        return
    for n in range(n_modes):
        f = 0.0
        s = 0.0
        for i in range(n_contacts):
            f += shape[i, n] * force[i]
            s += shape[i, n] * slope[i]
        out_q[n] = free_q[n] - f * table[4, n] - s * table[6, n]
        out_p[n] = free_p[n] - f * table[5, n] - s * table[7, n]


@njit(cache=True, error_model="numpy")
def free_flight(omega, zeta, bias, time, q, p):
    """Advance a state in place by the exact motion without contact."""
    for n in range(omega.size):
        a11, a12, a21, a22, i1, _, _ = mode_step(omega[n], zeta[n], time)
        q0 = q[n]
        q[n] = a11 * q0 + a12 * p[n] + i1 * bias[n]
        p[n] = a21 * q0 + a22 * p[n] + a12 * bias[n]


@njit(cache=True, error_model="numpy", fastmath=LOOSE)
def approach(shape, offset, i, q, p):
    """Approach of contact i and its rate."""
    d = 0.0
    v = 0.0
    for n in range(q.size):
        d += shape[i, n] * q[n]
        v += shape[i, n] * p[n]
    return offset[i] + d, v


@njit(cache=True, error_model="numpy", fastmath=LOOSE)
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


@njit(cache=True, error_model="numpy")
def quadratic_wait(d, v, a):
    """Largest t with d + v t + a t**2 / 2 <= 0 all along, for d <= 0 and a >= 0; infinity if never."""
    if a <= 0.0:
        return np.inf if v <= 0.0 else -d / v
    root = np.sqrt(v * v - 2.0 * a * d)
    if v >= 0.0:
        return -2.0 * d / (root + v) if root + v > 0.0 else 0.0
    return (root - v) / a


@njit(cache=True, error_model="numpy")
def find_onset(omega, zeta, shape, offset, bias, limit, shortest, q, p):
    """Advance a state without contact in place to the next onset, never passing one (conservative advancement).

    Returns (elapsed, contact, status): status 0 an onset at `contact`, 1 no contact ever again (proved),
    2 the limit reached, 3 too slow an advance (shorter than `shortest` per look): hand over to a stepping scheme.
    """
    n_contacts = shape.shape[0]
    elapsed = 0.0
    slow = 0
    while True:
        wait = np.inf
        first = -1
        final = True
        for i in range(n_contacts):
            d, v = approach(shape, offset, i, q, p)
            r0, r1, r2, reach, fastest, hardest = motion_bounds(shape, omega, zeta, bias, i, q, p)
            r0 += offset[i]
            scale = abs(r0) + reach + abs(offset[i])
            d = min(d, 0.0)
            if -d <= 4e-16 * scale and (v > 0.0 or (v == 0.0 and elapsed > 0.0)):
                return elapsed, i, 0
            if not (r1 <= 0.0 and r2 <= 0.0 and r0 + reach <= 0.0):
                final = False
            bound = quadratic_wait(d, v, hardest + max(r2, 0.0))
            bound = max(bound, quadratic_wait(d, max(0.0, r1 + fastest), max(r2, 0.0)))
            if r2 <= 0.0 and r0 + reach <= 0.0:
                bound = max(bound, quadratic_wait(r0 + reach, max(0.0, r1), 0.0))
            if bound < wait:
                wait = bound
                first = i
        if final or wait == np.inf:
            return elapsed, -1, 1
        if elapsed + wait >= limit:
            wait = limit - elapsed
            free_flight(omega, zeta, bias, wait, q, p)
            return limit, -1, 2
        if wait <= 4e-16 * (elapsed + wait) or wait <= 1e-14 * shortest:
            d, v = approach(shape, offset, first, q, p)
            if v > 0.0:
                return elapsed, first, 0
            return elapsed, first, 3
        if wait < shortest:
            slow += 1
            if slow > 4000:
                return elapsed, first, 3
        free_flight(omega, zeta, bias, wait, q, p)
        elapsed += wait


@njit(cache=True, error_model="numpy")
def hermite_extreme(d0, v0, d1, v1, h):
    """Smallest and largest value inside the step of the cubic through both ends' positions and rates."""
    a = 2.0 * (d0 - d1) + h * (v0 + v1)
    b = 3.0 * (d1 - d0) - h * (2.0 * v0 + v1)
    c = h * v0
    low = min(d0, d1)
    high = max(d0, d1)
    disc = b * b - 3.0 * a * c
    if disc > 0.0:
        root = np.sqrt(disc)
        for sign in (-1.0, 1.0):
            if b * sign >= 0.0:
                t = -c / (b + sign * root) if b + sign * root != 0.0 else -1.0
            else:
                t = (-b + sign * root) / (3.0 * a) if a != 0.0 else -1.0
            if 0.0 < t < 1.0:
                value = d0 + t * (c + t * (b + t * a))
                low = min(low, value)
                high = max(high, value)
    return low, high


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def try_step(ramp, h, table, sums, shape, offset, bias, law, q, p, now, free_q, free_p, end, work, y, f, s, rate):
    """Solve one step of length h from the state; return 1 for A4, 0 for A (asked for, or fallen back to)."""
    m = y.size
    predict(shape, table, offset, bias, q, p, free_q, free_p, end)
    solve_constants(h, now, law, end[0], sums, work, y, f)
    fine = 0
    pressed = False
    for i in range(m):
        s[i] = 0.0
        if f[i] > 0.0:
            pressed = True
    if ramp and pressed:
        keep = work[work.shape[0] - 1]
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


@njit(cache=True, error_model="numpy")
def longer(array, n):
    """The same rows in an array twice as long."""
    result = np.empty((2 * array.shape[0], array.shape[1]))
    result[:n] = array[:n]
    return result


@njit(cache=True, error_model="numpy")
def modal_energy(omega, bias, q, p):
    """Kinetic and strain energy less the work of the bias force."""
    total = 0.0
    for n in range(q.size):
        total += 0.5 * (p[n] * p[n] + (omega[n] * q[n]) ** 2) - bias[n] * q[n]
    return total


@njit(cache=True, error_model="numpy")
def crossed(pressed, d0, y):
    """Whether a contact opened (was pressed and ends apart) or closed (was apart and ends pressed) within a step."""
    return (pressed and y <= 0.0) or (not pressed and d0 < 0.0 and y > 0.0)


@njit(cache=True, error_model="numpy")
def run_energy(omega, zeta, shape, offset, bias, law, start_q, start_p, ramp, base, horizon, max_impacts, max_steps):
    """Follow bodies in contact with the energy-exact schemes A (ramp 0) or A4 (ramp 1).

    Parameters: omega, zeta, bias, start_q, start_p (n_modes,); shape (n_contacts, n_modes), the signed shapes at the
    contacts; offset (n_contacts,) approach at zero state; law (n_contacts, 4): stiffness, exponent, loss, compliance;
    base: the longest step in contact; horizon: where to stop at the latest; max_impacts: stop after so many releases.

    Returns (steps, q, p, now, work, time, status, n_fallback, n_blind); steps has one row per step or flight: start,
    length, blind, then per contact the start approach and rate and the force's mean and slope (mean + slope
    (t/h - 1/2)); now (5, n_contacts) ends with the last approach, .., rate; work (n_contacts,) is the integral of
    force times rate [J].
    """
    m, n_modes = shape.shape
    q = start_q.copy()
    p = start_p.copy()
    free_q = np.empty(n_modes)
    free_p = np.empty(n_modes)
    tables = np.empty((LEVELS, N_TABLE, n_modes))
    all_sums = np.empty((LEVELS, 6, m, m))
    known = np.zeros(LEVELS)
    odd_table = np.empty((N_TABLE, n_modes))
    odd_sums = np.empty((6, m, m))
    now = np.zeros((5, m))
    end = np.empty((3, m))
    work = np.zeros((4 * m + 10, max(4, 2 * m)))
    y = np.empty(m)
    f = np.empty(m)
    s = np.empty(m)
    rate = np.empty(m)
    pressed = np.zeros(m, np.bool_)
    done = np.zeros(m)
    steps = np.zeros((64, 3 + 4 * m))
    n_steps = 0
    n_fallback = 0
    n_blind = 0
    n_released = 0
    n_looks = 0
    level = 0
    events = 0
    reset = 0.0
    time = 0.0
    stalled = False
    status = EXHAUSTED
    start_energy = 0.0
    quiet = True
    for n in range(n_modes):
        if bias[n] != 0.0:
            quiet = False
    for i in range(m):
        now[0, i], now[4, i] = approach(shape, offset, i, q, p)
        pressed[i] = now[0, i] > 0.0 or (now[0, i] == 0.0 and now[4, i] > 0.0)
        _, _, stored = law_at(now[0, i], law, i)
        start_energy += stored
    start_energy += modal_energy(omega, bias, q, p)
    while n_steps < max_steps:
        if time >= horizon:
            status = HORIZON
            break
        if 0 < max_impacts <= n_released:
            status = IMPACTS
            break
        if n_steps + 1 >= steps.shape[0]:
            steps = longer(steps, n_steps)
        idle = True
        for i in range(m):
            if pressed[i]:
                idle = False
        if idle and not stalled:
            for i in range(m):
                steps[n_steps, 3 + 4 * i] = now[0, i]
                steps[n_steps, 4 + 4 * i] = now[4, i]
                steps[n_steps, 5 + 4 * i] = 0.0
                steps[n_steps, 6 + 4 * i] = 0.0
            elapsed, first, found = find_onset(omega, zeta, shape, offset, bias, horizon - time, 1e-3 * base, q, p)
            if found == 1:
                time += elapsed
                if elapsed > 0.0:
                    steps[n_steps, 0] = time - elapsed
                    steps[n_steps, 1] = elapsed
                    steps[n_steps, 2] = 0.0
                    n_steps += 1
                status = FINISHED
                break
            if elapsed > 0.0:
                steps[n_steps, 0] = time
                steps[n_steps, 1] = elapsed
                steps[n_steps, 2] = 0.0
                n_steps += 1
                time += elapsed
            for i in range(m):
                now[0, i], now[4, i] = approach(shape, offset, i, q, p)
                now[0, i] = min(0.0, now[0, i])
            if found == 0:
                now[0, first] = 0.0
                pressed[first] = True
                events += 1
            stalled = found == 3
            continue
        blind = stalled or events > EVENT_LIMIT
        if blind:
            level = 0
        h = base * 0.5**level
        if h <= horizon - time:
            if known[level] == 0.0:
                step_table(omega, zeta, h, tables[level])
                contact_sums(shape, tables[level], all_sums[level])
                known[level] = 1.0
            table = tables[level]
            sums = all_sums[level]
        else:
            h = horizon - time
            step_table(omega, zeta, h, odd_table)
            contact_sums(shape, odd_table, odd_sums)
            table = odd_table
            sums = odd_sums
        for i in range(m):
            now[1, i], now[2, i], now[3, i] = law_at(now[0, i], law, i)
        fine = try_step(
            ramp, h, table, sums, shape, offset, bias, law, q, p, now, free_q, free_p, end, work, y, f, s, rate
        )
        target = -1
        if not blind:
            shorter = 0
            for i in range(m):
                d0 = now[0, i]
                low, high = hermite_extreme(d0, now[4, i], y[i], rate[i], h)
                if pressed[i]:
                    if y[i] <= 0.0 and d0 == 0.0:
                        shorter = max(shorter, 3 if level == 0 else 1)
                    elif y[i] > 0.0 and low < -1e-9 * max(d0, y[i]):
                        shorter = max(shorter, 1)
                elif y[i] <= 0.0 and high > 1e-9 * max(-d0, -y[i]):
                    shorter = max(shorter, 1)
                if crossed(pressed[i], d0, y[i]):
                    target = i
            if shorter > 0 and level + shorter < LEVELS:
                level += shorter
                continue
            if shorter > 0:
                blind = True
                target = -1
        if target >= 0:
            low = 0.0
            high = h
            guess = h
            for i in range(m):
                if crossed(pressed[i], now[0, i], y[i]):
                    root = hermite_root(now[0, i], now[4, i], y[i], rate[i], h)
                    if root <= guess:
                        guess = root
                        target = i
            scale = abs(now[0, target]) + abs(y[target])
            table = odd_table
            sums = odd_sums
            for _ in range(LOCATE_LIMIT):
                h = guess
                step_table(omega, zeta, h, odd_table)
                contact_sums(shape, odd_table, odd_sums)
                fine = try_step(
                    ramp, h, table, sums, shape, offset, bias, law, q, p, now, free_q, free_p, end, work, y, f, s, rate
                )
                early = -1
                for i in range(m):
                    if i != target and crossed(pressed[i], now[0, i], y[i]):
                        early = i
                if early >= 0:
                    target = early
                    high = h
                    low = 0.0
                    scale = abs(now[0, target]) + abs(y[target])
                    guess = hermite_root(now[0, target], now[4, target], y[target], rate[target], h)
                    if guess >= high:
                        guess = 0.5 * high
                    continue
                if abs(y[target]) <= 2e-15 * scale or high - low <= 4e-16 * high:
                    break
                if crossed(pressed[target], now[0, target], y[target]):
                    high = h
                else:
                    low = h
                guess = h - y[target] / rate[target] if rate[target] != 0.0 else low
                if abs(guess - h) <= 4e-16 * h:
                    break
                if not low < guess < high:
                    guess = 0.5 * (low + high)
            if not abs(y[target]) <= 1e-9 * scale:
                target = -1
                blind = True
        total = 0.0
        for i in range(m):
            total += abs(y[i]) + abs(rate[i]) + f[i]
        if not total < 1e300:
            status = FAILED
            break
        steps[n_steps, 0] = time
        steps[n_steps, 1] = h
        steps[n_steps, 2] = 1.0 if blind else 0.0
        for i in range(m):
            steps[n_steps, 3 + 4 * i] = now[0, i]
            steps[n_steps, 4 + 4 * i] = now[4, i]
            steps[n_steps, 5 + 4 * i] = f[i]
            steps[n_steps, 6 + 4 * i] = s[i]
            mean = end[1, i]
            for j in range(m):
                mean -= sums[2, i, j] * f[j] + sums[3, i, j] * s[j]
            done[i] += f[i] * (y[i] - now[0, i]) + s[i] * (0.5 * (now[0, i] + y[i]) - mean)
        n_steps += 1
        if ramp and fine == 0:
            for i in range(m):
                if f[i] > 0.0:
                    n_fallback += 1
                    break
        if blind:
            n_blind += 1
        commit(shape, table, f, s, free_q, free_p, q, p)
        time += h
        for i in range(m):
            was = pressed[i]
            now[0, i] = y[i]
            now[4, i] = rate[i]
            if i == target:
                now[0, i] = 0.0
                pressed[i] = not was
                events += 1
            else:
                pressed[i] = y[i] > 0.0
            if was and not pressed[i]:
                n_released += 1
        if target < 0 and level > 0:
            level -= 1
        if time - reset > base:
            reset = time
            events = 0
        stalled = False
        n_looks += 1
        if quiet and n_looks % 512 == 0:
            energy = modal_energy(omega, bias, q, p)
            for i in range(m):
                _, _, stored = law_at(now[0, i], law, i)
                energy += stored
            if energy <= 1e-24 * start_energy:
                status = SETTLED
                break
    return steps[:n_steps].copy(), q, p, now, done, time, status, n_fallback, n_blind


@njit(cache=True, error_model="numpy")
def replay_ramps(omega, zeta, shape, bias, start_q, start_p, steps, times, out_q, out_p):
    """States (n_times, n_modes) at ascending times, from the start state and the recorded forces; exact in between."""
    m, n_modes = shape.shape
    q = start_q.copy()
    p = start_p.copy()
    table = np.empty((N_TABLE, n_modes))
    part = np.empty((N_TABLE, n_modes))
    force = np.empty(m)
    slope = np.empty(m)
    last = -1.0
    k = 0
    for j in range(steps.shape[0] + 1):
        ends = np.inf if j == steps.shape[0] else steps[j, 0] + steps[j, 1]
        begin = (
            0.0 if steps.shape[0] == 0 else (steps[j, 0] if j < steps.shape[0] else steps[j - 1, 0] + steps[j - 1, 1])
        )
        while k < times.size and times[k] < ends:
            t = max(0.0, times[k] - begin)
            for i in range(m):
                force[i] = 0.0
                slope[i] = 0.0
                if j < steps.shape[0]:
                    slope[i] = steps[j, 6 + 4 * i] * t / steps[j, 1]
                    force[i] = steps[j, 5 + 4 * i] + 0.5 * (slope[i] - steps[j, 6 + 4 * i])
            if t > 0.0:
                step_table(omega, zeta, t, part)
                for n in range(n_modes):
                    out_q[k, n] = part[0, n] * q[n] + part[1, n] * p[n] + part[4, n] * bias[n]
                    out_p[k, n] = part[2, n] * q[n] + part[3, n] * p[n] + part[5, n] * bias[n]
                commit(shape, part, force, slope, out_q[k], out_p[k], out_q[k], out_p[k])
            else:
                out_q[k] = q
                out_p[k] = p
            k += 1
        if k >= times.size or j == steps.shape[0]:
            return
        h = steps[j, 1]
        if h != last:
            step_table(omega, zeta, h, table)
            last = h
        for i in range(m):
            force[i] = steps[j, 5 + 4 * i]
            slope[i] = steps[j, 6 + 4 * i]
        for n in range(n_modes):
            q0 = q[n]
            q[n] = table[0, n] * q0 + table[1, n] * p[n] + table[4, n] * bias[n]
            p[n] = table[2, n] * q0 + table[3, n] * p[n] + table[5, n] * bias[n]
        commit(shape, table, force, slope, q, p, q, p)


@njit(cache=True, error_model="numpy")
def compressions(approach, k, a, c):
    """Spring compression at many approaches, (n,), zero where apart."""
    result = np.zeros(approach.size)
    for n in range(approach.size):
        if approach[n] > 0.0:
            result[n] = compression(approach[n], k, a, c)
    return result
