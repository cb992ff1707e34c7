"""A run with exponential Gauss collocation of the contact forces, the reference scheme.

The force of each contact is a polynomial over the step that obeys the contact law at s Gauss nodes; the modes move
exactly under it. The order is 2 s between events, which are located. A step is halved where the polynomial misses the
law at its ends.
"""

import numpy as np

from .build import LOOSE, ZERO, inner, outer
from .energy import LEVELS
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
from .flight import (
    GLIDES,
    any_of,
    find_onset,
    restore,
)
from .law import (
    FELT,
    NEAR,
    PLASTIC,
    at,
    corner_approach,
    harden,
    lags,
    meet,
    near_side,
    power,
    smooth_force,
    special_of,
    spring_of,
)
from .layout import (
    A11,
    A12,
    A21,
    A22,
    APPROACH,
    CLOSED,
    COMPLIANCE,
    HEAD,
    KIND,
    LENGTH,
    MEMORY,
    PUSH,
    RATE,
    RELAXATION,
    SHARE,
    SIZE,
    START,
    WIDTH,
)
from .propagation import N_LANE, mode_moments
from .record import EXHAUSTED, FAILED, FINISHED, HORIZON, IMPACTS, SETTLED, resized, total_energy
from .schemes import solve_linear

PUSHED = 4  # row after those of free motion: displacement by a constant force
MOVED, SPED = 0, 1  # rows of what force polynomials do: to the approach and to its rate


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
                    out_inner[MOVED, a, b, i, j] = 0.0
                    out_inner[SPED, a, b, i, j] = 0.0
    for n in range(omega.size):
        silent = True
        for i in range(m):
            if shape[i, n] != 0.0:
                silent = False
        for a in range(s + 1):
            c = nodes[a]
            t = c * h
            a11, a12, a22 = mode_moments(omega[n], zeta[n], t, moments, work)
            out_free[a, A11, n] = a11
            out_free[a, A12, n] = a12
            out_free[a, A21, n] = -omega[n] * omega[n] * a12
            out_free[a, A22, n] = a22
            out_free[a, PUSHED, n] = t * t * moments[1]
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
                            out_inner[MOVED, a, b, i, j] += uu * x
                            out_inner[SPED, a, b, i, j] += uu * v


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
                d += u * (free[a, A11, n] * q[n] + free[a, A12, n] * p[n] + free[a, PUSHED, n] * bias[n])
                v += u * (free[a, A21, n] * q[n] + free[a, A22, n] * p[n] + free[a, A12, n] * bias[n])
            out_d[a, i] = offset[i] + d
            out_v[a, i] = v


@inner()
def side_of(law, i, beyond):
    """The spring of contact i on the side of its corner where the step runs."""
    spring = spring_of(law, i)
    return spring if beyond[i] or spring.corner == np.inf else near_side(spring)


@inner()
def sides(law, now, out_beyond):
    """Whether each contact begins its step beyond the corner of its law; one that yields only on its way in."""
    for i in range(now.shape[1]):
        spring = spring_of(law, i)
        bend = corner_approach(spring)
        d, rate = now[APPROACH, i], now[RATE, i]
        if spring.kind == PLASTIC:
            out_beyond[i] = d >= (1.0 - NEAR) * bend and rate > 0.0
        else:
            out_beyond[i] = d > (1.0 + NEAR) * bend or (d >= (1.0 - NEAR) * bend and rate >= 0.0)


@inner()
def turned_over(law, now, y, rate, after, h, pressed, beyond):
    """Change the side of contacts that left theirs from the corner at once; whether any did."""
    again = False
    for i in range(y.size):
        if pressed[i]:
            side = 1.0 if beyond[i] else -1.0
            if strayed(law, now, y, rate, after, h, i, side) == 1:
                beyond[i] = not beyond[i]
                again = True
    return again


@inner()
def weight_of(inner, mobility, h, i):
    """What turns a misfit of contact i's force at a step's end into a speed [s/kg]."""
    s = inner.shape[1]
    return min(mobility[i] * h, inner[SPED, s - 1, s - 1, i, i] * 4.0 + 1e-3 * mobility[i] * h)


@inner()
def lag_table(law, i, nodes, powers, h, out_lag):
    """What felt i remembers at nodes and end per ``x**a`` at a node, (s + 1, s), then what is left of before."""
    s = nodes.size - 1
    for a in range(s + 1):
        x = nodes[a] * h / law[i, RELAXATION]
        j0, j1, j2, j3, j4 = lags(x)
        weights = j0, j1, j2, j3, j4
        out_lag[a, s] = 1.0 - j0
        for b in range(s):
            total = 0.0
            scale = 1.0
            for k in range(s):
                total += powers[b, k] * scale * weights[k]
                scale *= nodes[a]
            out_lag[a, b] = total


@inner()
def memory_at(lag, a, x, f, i, spring):
    """What felt remembers at node a, or at the end, of a step with compressions x (s, n_contacts)."""
    s = f.shape[0]
    z = lag[a, s] * spring.memory
    for b in range(s):
        size = abs(x[b, i])
        if size > 0.0:
            g = power(size, spring.exponent)
            z += lag[a, b] * (g if x[b, i] > 0.0 else -g)
    return z


@inner(allocates=True)
def solve_collocation(inner, law, pressed, beyond, lag, free_d, free_v, matrix, vector, out_f, out_x):
    """Forces at the nodes (s, n_contacts) by Newton's method from those in out_f; False where it does not settle.

    out_x (s, n_contacts) receives the compressions there.
    """
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
                        d -= inner[MOVED, a, b, i, j] * out_f[b, j]
                        v -= inner[SPED, a, b, i, j] * out_f[b, j]
                x = d - law[i, COMPLIANCE] * out_f[a, i]
                f, fx, fv = smooth_force(x, v, side_of(law, i, beyond))
                out_x[a, i] = x
                row = a * count + r
                vector[row] = out_f[a, i] - f
                for b in range(s):
                    for c in range(count):
                        j = active[c]
                        matrix[row, b * count + c] = fx * inner[MOVED, a, b, i, j] + fv * inner[SPED, a, b, i, j]
                matrix[row, row] += 1.0 + fx * law[i, COMPLIANCE]
                scale = max(scale, abs(out_f[a, i]), abs(f))
        for r in range(count):
            i = active[r]
            spring = spring_of(law, i)
            if spring.kind != FELT:
                continue
            for a in range(s):
                row = a * count + r
                vector[row] += spring.hard * memory_at(lag[i], a, out_x, out_f, i, spring)
                for e in range(s):
                    _, fx, _ = smooth_force(out_x[e, i], 0.0, spring)
                    share = lag[i, a, e] * fx * spring.hard / spring.stiffness
                    for b in range(s):
                        for c in range(count):
                            matrix[row, b * count + c] -= share * inner[MOVED, e, b, i, active[c]]
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
        out_q[n] = free[s, A11, n] * q[n] + free[s, A12, n] * p[n] + free[s, PUSHED, n] * bias[n]
        out_p[n] = free[s, A21, n] * q[n] + free[s, A22, n] * p[n] + free[s, A12, n] * bias[n]
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
    shape, offset, bias, law, pressed, beyond, now, nodes, powers, edges, h, free, last, inner, q, p, guess, small,
    lag, x, free_d, free_v, f, matrix, vector, out_q, out_p, out_y, out_rate, out_after,
):  # fmt: skip
    """One collocation step: node forces in f, the end state, and the force polynomial's largest misfit at both ends.

    The misfit is weighed to a speed by ``small`` (n_contacts,); infinity where the forces were not found.
    """
    s, m = f.shape
    free_approach(shape, offset, bias, free, q, p, free_d, free_v)
    for a in range(s):
        for i in range(m):
            f[a, i] = guess[a, i]
    for i in range(m):
        out_after[i] = law[i, MEMORY] if law.shape[1] == WIDTH else 0.0
        if law.shape[1] == WIDTH and law[i, KIND] == FELT:
            if pressed[i] and law[i, MEMORY] >= 0.0:
                lag_table(law, i, nodes, powers, h, lag[i])
            else:
                out_after[i] = -abs(law[i, MEMORY]) * np.exp(-(1.0 - law[i, SHARE]) * h / law[i, RELAXATION])
    if not solve_collocation(inner, law, pressed, beyond, lag, free_d, free_v, matrix, vector, f, x):
        return np.inf
    collocation_end(shape, offset, bias, free, last, f, q, p, out_q, out_p, out_y, out_rate)
    worst = 0.0
    for i in range(m):
        if not abs(out_y[i]) < 1e300:
            return np.inf
        if pressed[i]:
            spring = side_of(law, i, beyond)
            f0, _, _ = smooth_force(max(0.0, at(now[APPROACH, i], spring).compression), now[RATE, i], spring)
            f1, _, _ = smooth_force(max(0.0, at(out_y[i], spring).compression), out_rate[i], spring)
            if spring.kind == FELT:
                out_after[i] = memory_at(lag[i], s, x, f, i, spring)
                f0 -= spring.hard * spring.memory
                f1 -= spring.hard * out_after[i]
            for b in range(s):
                f0 -= edges[0, b] * f[b, i]
                f1 -= edges[1, b] * f[b, i]
            worst = max(worst, max(abs(f0), abs(f1)) * small[i])
    return worst


@outer()
def run_collocation(
    omega, zeta, shape, start, bias, laws, start_q, start_p, nodes, powers, base, speed, tolerance, depth, still,
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
    offset = start.copy()
    law = laws.copy()
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
    now = np.zeros((6, m))
    y = np.empty(m)
    rate = np.empty(m)
    after = np.zeros(m)
    lag = np.zeros((m, s + 1, s + 1))
    x = np.zeros((s, m))
    f = np.zeros((s, m))
    guess = np.zeros((s, m))
    free_d = np.empty((s + 1, m))
    free_v = np.empty((s + 1, m))
    matrix = np.empty((s * m, s * m))
    vector = np.empty(s * m)
    pressed = np.zeros(m, np.bool_)
    beyond = np.zeros(m, np.bool_)
    which = 0
    fresh = True  # whether the sides are still to be found
    flights = np.empty((GLIDES + 1, N_LANE, n_modes))
    flown = np.zeros(GLIDES + 1)
    done = np.zeros(m)
    coefficients = np.empty(s)
    stride = PUSH + s
    steps = np.zeros((64, HEAD + (stride + 1) * m))
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
    special, _ = special_of(law)
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
            land(shape, offset, law, time, elapsed, first, found, steps[n_steps], stride, now, pressed, q, p)
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
            fresh = True
            continue
        if special and fresh:
            for i in range(m):
                meet(law, i, now[APPROACH, i], now[RATE, i])
                deeper = harden(law, i, now[APPROACH, i])
                offset[i] -= deeper
                now[APPROACH, i] -= deeper
            sides(law, now, beyond)
            fresh = False
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
            small[i] = weight_of(inner, mobility, h, i)
        misfit = collocate(
            shape, offset, bias, law, pressed, beyond, now, nodes, powers, edges, h, free, last, inner, q, p, guess,
            small, lag, x, free_d, free_v, f, matrix, vector, new_q, new_p, y, rate, after,
        )  # fmt: skip
        shorter = 0
        again = False
        target = -1
        if misfit == np.inf:
            shorter = 1
        else:
            for i in range(m):
                d0 = now[APPROACH, i]
                if pressed[i] and y[i] <= 0.0 and d0 == 0.0:
                    if now[RATE, i] > still and level < LEVELS - 2:
                        shorter = 1
                    else:
                        pressed[i] = False
                        again = True
                elif not pressed[i] and d0 == 0.0 and now[RATE, i] >= -still and y[i] > depth:
                    pressed[i] = True
                    again = True
                elif dipped(now, pressed, y, rate, h, i) and (pressed[i] or level < LEVELS - 2):
                    shorter = 1
                if special and pressed[i] and strayed(law, now, y, rate, after, h, i, 1.0 if beyond[i] else -1.0) == 2:
                    shorter = 1
            target, root = first_crossing(now, pressed, y, rate, h, depth, still)
            if special and not again:
                again = turned_over(law, now, y, rate, after, h, pressed, beyond)
        if again:
            continue
        if shorter > 0:
            if level + shorter >= LEVELS:
                status = FAILED
                break
            level += shorter
            guess[:] = 0.0
            continue
        corner = -1
        for event in (CROSSING, CORNER):  # the step is repeated so that it ends at the first crossing, then corner
            if event == CORNER:
                if not special:
                    break
                corner, which, root = first_corner(now, law, y, rate, after, h, False, bracket)
                if corner < 0 or which == AGAIN:
                    break
                target = -1
            elif target < 0:
                continue
            again = misfit > limit and level < LEVELS - 2 and root > 0.25 * h and root < 0.9 * h
            if again:
                level += 1
                break
            if event == CROSSING:
                enclose(now, y, rate, h, target, bracket)
            free = odd_free
            last = odd_last
            inner = odd_inner
            for _ in range(LOCATE_LIMIT):
                h = root
                collocation_table(omega, zeta, shape, h, nodes, powers, odd_free, odd_last, odd_inner)
                for i in range(m):
                    small[i] = weight_of(inner, mobility, h, i)
                    for a in range(s):
                        guess[a, i] = max(0.0, f[a, i])
                misfit = collocate(
                    shape, offset, bias, law, pressed, beyond, now, nodes, powers, edges, h, free, last, inner, q, p,
                    guess, small, lag, x, free_d, free_v, f, matrix, vector, new_q, new_p, y, rate, after,
                )  # fmt: skip
                if misfit == np.inf:
                    break
                if event == CROSSING:
                    target, root = narrow(now, pressed, y, rate, h, depth, still, target, bracket)
                else:
                    root = nearer(law, corner, which, h, y[corner], rate[corner], after[corner], bracket)
                if root == 0.0:
                    break
            again = misfit == np.inf or (event == CROSSING and not abs(y[target]) <= 1e-9 * bracket[SIZE])
            if again:
                level += 1
                break
        if level >= LEVELS:
            status = FAILED
            break
        if again:
            continue
        if corner >= 0 and which == AGAIN:
            law[corner, MEMORY] = abs(law[corner, MEMORY])
            continue
        if misfit > limit and level < LEVELS - 2 and h > 1e-9 * base:
            level += 1
            while level < LEVELS - 2 and base * 0.5**level > 0.6 * h:
                level += 1
            continue
        n_tries = 0
        steps[n_steps] = 0.0
        steps[n_steps, START] = time
        steps[n_steps, LENGTH] = h
        for i in range(m):
            remember(law, i, steps[n_steps], stride, m, now)
            if pressed[i]:
                steps[n_steps, HEAD + CLOSED + stride * i] = 1.0
                for k in range(s):
                    coefficients[k] = 0.0
                    for b in range(s):
                        coefficients[k] += powers[b, k] * f[b, i]
                    steps[n_steps, HEAD + PUSH + stride * i + k] = coefficients[k]
            for a in range(s):
                v = free_v[a, i]
                for b in range(s):
                    for j in range(m):
                        v -= inner[SPED, a, b, i, j] * f[b, j]
                weight = 0.0
                for k in range(s):
                    weight += powers[a, k] / (k + 1.0)
                done[i] += weight * h * f[a, i] * v
        n_steps += 1
        time += h
        fresh = True
        if special:
            for i in range(m):
                law[i, MEMORY] = after[i]
        restore(new_q, new_p, q, p)
        for i in range(m):
            for a in range(s):
                ahead = 0.0
                if pressed[i] and target < 0 and corner < 0:
                    position = 1.0 + nodes[a]
                    for k in range(s - 1, -1, -1):
                        ahead = ahead * position + coefficients[k] if m == 1 else f[s - 1, i]
                guess[a, i] = max(0.0, ahead)
        if corner >= 0 and which == 3 and law[corner, MEMORY] > 0.0:
            n_released += 1
        n_released += settle(law, now, pressed, y, rate, target, depth, still)
        if target >= 0:
            events += 1
        if target < 0 and corner < 0 and level > 0 and misfit < limit * 0.25 * 0.5**s:
            level -= 1
        if time - reset > base:
            reset = time
            events = 0
        n_looks += 1
        if quiet and n_looks % 512 == 0 and total_energy(omega, bias, law, q, p, now) <= 1e-24 * start_energy:
            status = SETTLED
            break
    remembered(law, now)
    return resized(steps, n_steps, n_steps), q, p, now, done, time, status, 0, 0
