"""Derivatives of a recorded blow with one contact in any of its numbers.

A change of a number changes the motion of each mode by dq, the approach d by dd and the contact force f by df:
``dq'' + 2 zeta omega dq' + omega**2 dq = db - f du - u df - 2 omega domega q - 2 d(zeta omega) q'``,
``dd = doffset + sum (u dq + q du)``, ``df = f_d dd + f_v dd' + f_p dp``. These equations are linear, whatever the law:
where the force starts and ends it is zero, so that df has no peaks there although these times move.

The force of the record is a polynomial in each piece of time, and so is df, through s Gauss nodes. The modes follow
both exactly: with m_k the moments of the impulse response (see `propagation`) and m_(-1) its rate,
``omega dm_k/domega = m_(k-1) - (k+1) m_k`` and
``(1 - zeta**2) dm_k/dzeta = zeta ((k+1) m_k - m_(k-1)) - omega h (m_k - k m_(k+1))``.
"""

from typing import NamedTuple

import numpy as np

from .arrays import ANGLE_LIMIT, LIGHT
from .build import LOOSE, inner, outer
from .law import at, power, spring_of, steepness
from .layout import A12, A21, A22
from .one_mode import mode_moments
from .propagation import any_of, free_table, product, restore

N_LAW = 8  # numbers of a law that may change, in the order of `law.spring_of`
SLOTS = 12  # [-] lengths of pieces whose tables are kept
SMALL = 0.5  # [rad] phase below which the recursion of the moments cancels: two orders lose a digit
TERMS = 13  # [-] of their power series there: leave 1e-16
CRITICAL = 1e-4  # [-] this near to critical damping, derivatives in zeta are differences; they err by its square


class Blow(NamedTuple):
    """The numbers of a blow with one contact, as in `History`."""

    omega: np.ndarray  # (n_modes,)
    zeta: np.ndarray  # (n_modes,)
    shape: np.ndarray  # (n_modes,)
    bias: np.ndarray  # (n_modes,)
    start_q: np.ndarray  # (n_modes,)
    start_p: np.ndarray  # (n_modes,)
    offset: float
    law: np.ndarray  # (1, 9 or 4)


class Change(NamedTuple):
    """Their changes per unit of each of some parameters."""

    omega: np.ndarray  # (n, n_modes)
    zeta: np.ndarray  # (n, n_modes)
    shape: np.ndarray  # (n, n_modes)
    bias: np.ndarray  # (n, n_modes)
    start_q: np.ndarray  # (n, n_modes)
    start_p: np.ndarray  # (n, n_modes)
    offset: np.ndarray  # (n,)
    law: np.ndarray  # (n, N_LAW)


class Pieces(NamedTuple):
    """Time in pieces without an event inside, with the recorded force at Gauss nodes; and these nodes."""

    length: np.ndarray  # (n_pieces,) [s]
    closed: np.ndarray  # (n_pieces,) bool, whether the contact carries force
    force: np.ndarray  # (n_pieces, s) [N]
    mark: np.ndarray  # (n_pieces + 1,) number of the mark at the start of a piece and at the end; -1 for none
    nodes: np.ndarray  # (s + 1,) fractions of a piece, the last one 1
    powers: np.ndarray  # (s, s) Lagrange polynomials of the first s as powers


class Found(NamedTuple):
    """The motion and its changes at marks, and the change of the force."""

    way: np.ndarray  # (n_pieces + 1, 2) approach and rate at the ends of all pieces
    base: np.ndarray  # (n_marks, 5) approach and its first three rates, force
    ends: np.ndarray  # (n_marks, 4, n) changes of approach, rate, acceleration and force
    q: np.ndarray  # (n_marks, n_modes)
    p: np.ndarray  # (n_marks, n_modes)
    force: np.ndarray  # (n_pieces, s, n) change of the force at the nodes
    dq: np.ndarray  # (n, n_modes) changes of the state at the end
    dp: np.ndarray  # (n, n_modes)


class Grown(NamedTuple):
    """The rows of a `Change` that each parameter makes, and where they are not zero."""

    rows: np.ndarray  # (n, 4, n_modes) of omega, zeta, shape and bias
    seen: np.ndarray  # (n, 3, n_modes) the first three times the shape
    spans: np.ndarray  # (n, 4, 2) first index of a row that is not zero, and one after the last; both zero for none


class Table(NamedTuple):
    """Coefficients of a piece of one length; a force polynomial is that of `Pieces.powers`."""

    free: np.ndarray  # (s + 1, 12, n_modes) a11, a12, a21, a22 up to each node, their changes per omega and per zeta
    sight: np.ndarray  # (s, 4, n_modes) the shape times the first four at an inner node
    forced: np.ndarray  # (6, s, n_modes) displacement and velocity at the end per unit force, and their changes
    thrust: np.ndarray  # (2, s, n_modes) the shape times the first two
    inner: np.ndarray  # (2, s, s) approach and its rate at a node per force polynomial
    lean: np.ndarray  # (2, s) the same by the bias
    pushed: np.ndarray  # (n, 2, s, s) changes of minus `inner` per parameter
    leaned: np.ndarray  # (n, 2, s) changes of `lean`


class Room(NamedTuple):
    """Room for what a piece needs."""

    out: np.ndarray  # (10, n_modes), see `carry`
    work: np.ndarray  # (n_modes,)
    matrix: np.ndarray  # (s, s)
    slopes: np.ndarray  # (N_LAW,)
    by_change: np.ndarray  # (s, 2, n)
    column: np.ndarray  # (s,)


@inner()
def law_slopes(d, v, law, out_slopes):
    """Force of contact 0 and its slopes in approach and rate; in out_slopes (N_LAW,) those in its numbers."""
    for k in range(N_LAW):
        out_slopes[k] = 0.0
    spring = spring_of(law, 0)
    factor = 1.0 + spring.loss * v
    if d <= 0.0 or factor <= 0.0:
        return 0.0, 0.0, 0.0
    point = at(d, spring)
    x = point.compression
    steep = steepness(x, point.force, spring)
    soft = 1.0 / (1.0 + spring.compliance * steep)
    soft_layer = spring.stiffness * power(x, spring.exponent)
    out_slopes[0] = soft_layer / spring.stiffness * soft * factor
    out_slopes[1] = soft_layer * np.log(x) * soft * factor
    out_slopes[2] = point.force * v
    out_slopes[3] = -point.force * steep * soft * factor
    if x > spring.corner:
        further = x - spring.corner
        more = spring.hard * power(further, spring.hard_exponent)
        out_slopes[5] = -spring.hard_exponent * more / further * soft * factor
        out_slopes[6] = more / spring.hard * soft * factor
        out_slopes[7] = more * np.log(further) * soft * factor
    return point.force * factor, steep * soft * factor, point.force * spring.loss


@inner(allocates=True, fastmath={"contract"})
def moments_of(omega, zeta, t, out_moments):
    """Moments m_(-1), m_0, .. of every mode over t, (count + 2, n_modes), by the recursion in `propagation`.

    Where it cancels, the last two come from power series and the others from the recursion backwards.
    """
    count = out_moments.shape[0] - 2
    free = np.empty((4, omega.size))
    double = np.empty(omega.size)
    near = np.empty(omega.size, np.int64)
    n_single, _ = free_table(omega, zeta, t, free, double)
    n_near = 0
    for n in range(omega.size):
        if omega[n] * t < SMALL:
            near[n_near] = n
            n_near += 1
    part = 1.0 / t
    for n in range(omega.size):
        out_moments[0, n] = free[A22, n]
    for n in range(omega.size):
        out_moments[1, n] = part * free[A12, n]
    square = free[A21]
    for n in range(omega.size):
        square[n] = 1.0 / max(omega[n] * t, SMALL) ** 2
    whole = 1.0
    for k in range(count):
        last, now = out_moments[k], out_moments[k + 1]
        further(whole, double, square, now, last, out_moments[k + 2])
        whole /= k + 1.0
    if n_near > 0:
        power_series(omega, t, double, near[:n_near], out_moments)
    if n_single > 0:
        moments = np.empty(count + 1)
        work = np.empty((2, count))
        for n in range(omega.size):
            if zeta[n] > LIGHT or omega[n] * t >= ANGLE_LIMIT:
                _, _, a22 = mode_moments(omega[n], zeta[n], t, moments, work)
                out_moments[0, n] = a22
                for k in range(count + 1):
                    out_moments[k + 1, n] = moments[k]


@inner(fastmath={"contract"})
def further(whole, double, square, now, last, out):
    """The next moment of every mode, ``square`` is 1 / (omega h)**2."""
    for n in range(out.size):
        out[n] = (whole - double[n] * now[n] - last[n]) * square[n]


@inner(allocates=True, fastmath={"contract"})
def power_series(omega, t, double, near, out_moments):
    """All moments from m_1 on of some modes, for which omega t is below SMALL."""
    count, size = out_moments.shape[0] - 2, near.size
    now, last = np.ones(size), np.zeros(size)
    high, low = np.zeros(size), np.zeros(size)
    twice, square = np.empty(size), np.empty(size)
    for i in range(size):
        twice[i] = double[near[i]]
        square[i] = (omega[near[i]] * t) ** 2
    factor = 1.0
    for k in range(1, count + 1):
        factor /= k
    after = factor
    for j in range(1, TERMS):
        factor = after
        after = factor / (j + count)
        for i in range(size):
            value = now[i]
            low[i] += value * factor
            high[i] += value * after
            now[i] = -twice[i] * value - square[i] * last[i]
            last[i] = value
    whole = 1.0
    for k in range(1, count):
        whole /= k
    for i in range(size):
        out_moments[count + 1, near[i]] = high[i]
        out_moments[count, near[i]] = low[i]
    for k in range(count - 1, 1, -1):  # m_(k-1) from m_k and m_(k+1)
        for i in range(size):
            value = whole - twice[i] * low[i] - square[i] * high[i]
            high[i] = low[i]
            low[i] = value
            out_moments[k, near[i]] = value
        whole *= k


@inner()
def divisors(omega, zeta, out_per, out_own):
    """1 / omega and 1 / (1 - zeta**2) of every mode, zero for rigid ones; the number of nearly critically damped ones,
    for which the latter is zero, too.
    """
    n_critical = 0
    for n in range(omega.size):
        rest = (1.0 - zeta[n]) * (1.0 + zeta[n])
        near = abs(rest) <= CRITICAL
        out_per[n] = 1.0 / omega[n] if omega[n] > 0.0 else 0.0
        out_own[n] = 1.0 / rest if omega[n] > 0.0 and not near else 0.0
        n_critical += 1 if omega[n] > 0.0 and near else 0
    return n_critical


@inner(allocates=True)
def moment_slopes(omega, zeta, t, moments, per, own, n_critical, out_faster, out_damped):
    """Changes of all moments but the last per unit of omega and of zeta, (count + 1, n_modes) each."""
    rows = out_faster.shape[0]
    for n in range(omega.size):
        th = omega[n] * t
        out_faster[0, n] = -per[n] * th * (2.0 * zeta[n] * moments[0, n] + th * moments[1, n])  # t**2 g'' / omega
    for n in range(omega.size):
        bend = omega[n] * out_faster[0, n]
        out_damped[0, n] = -own[n] * (zeta[n] * bend + omega[n] * t * (moments[0, n] + moments[1, n]))
    for k in range(rows - 1):
        for n in range(omega.size):
            out_faster[k + 1, n] = per[n] * (moments[k, n] - (k + 1.0) * moments[k + 1, n])
        for n in range(omega.size):
            fall = moments[k, n] - (k + 1.0) * moments[k + 1, n]
            next_fall = moments[k + 1, n] - k * moments[k + 2, n]
            out_damped[k + 1, n] = -own[n] * (zeta[n] * fall + omega[n] * t * next_fall)
    if n_critical == 0:
        return
    near = np.empty(rows)
    work = np.empty((2, rows))
    for n in range(omega.size):
        if omega[n] > 0.0 and abs((1.0 - zeta[n]) * (1.0 + zeta[n])) <= CRITICAL:
            for k in range(rows):
                out_damped[k, n] = 0.0
            for side in (-1.0, 1.0):
                _, _, a22 = mode_moments(omega[n], zeta[n] + side * CRITICAL, t, near, work)
                out_damped[0, n] += side * a22 / (2.0 * CRITICAL)
                for k in range(rows - 1):
                    out_damped[k + 1, n] += side * near[k] / (2.0 * CRITICAL)


@inner(fastmath=LOOSE)
def free_slopes(omega, zeta, t, moments, faster, damped, out_free):
    """Free motion over t and its changes, the rows of ``free`` in `tangent_table`; one loop for each, so as to run in
    parallel lanes.
    """
    first, first_faster, first_damped = moments[1], faster[1], damped[1]
    for n in range(omega.size):
        out_free[0, n] = moments[0, n] + 2.0 * zeta[n] * omega[n] * t * first[n]
    for n in range(omega.size):
        out_free[1, n] = t * first[n]
    for n in range(omega.size):
        out_free[2, n] = -omega[n] * omega[n] * t * first[n]
    for n in range(omega.size):
        out_free[3, n] = moments[0, n]
    for n in range(omega.size):
        out_free[4, n] = faster[0, n] + 2.0 * zeta[n] * t * (omega[n] * first_faster[n] + first[n])
    for n in range(omega.size):
        out_free[5, n] = t * first_faster[n]
    for n in range(omega.size):
        out_free[6, n] = -omega[n] * t * (omega[n] * first_faster[n] + 2.0 * first[n])
    for n in range(omega.size):
        out_free[7, n] = faster[0, n]
    for n in range(omega.size):
        out_free[8, n] = damped[0, n] + 2.0 * omega[n] * t * (zeta[n] * first_damped[n] + first[n])
    for n in range(omega.size):
        out_free[9, n] = t * first_damped[n]
    for n in range(omega.size):
        out_free[10, n] = -omega[n] * omega[n] * t * first_damped[n]
    for n in range(omega.size):
        out_free[11, n] = damped[0, n]


@inner(allocates=True)
def tangent_table(blow, grown, leans, closed, h, nodes, powers, out):
    """Coefficients of one piece of length h in ``out``, a `Table`; of an open contact only those of the end."""
    s = nodes.size - 1
    omega, zeta = blow.omega, blow.zeta
    moments = np.empty((s + 3, omega.size))
    faster = np.empty((s + 2, omega.size))
    damped = np.empty((s + 2, omega.size))
    per = np.empty(omega.size)
    own = np.empty(omega.size)
    weights = np.empty(s)
    n_critical = divisors(omega, zeta, per, own)
    for a in range(0 if closed else s, s + 1):
        c = nodes[a]
        t = c * h
        moments_of(omega, zeta, t, moments)
        moment_slopes(omega, zeta, t, moments, per, own, n_critical, faster, damped)
        free_slopes(omega, zeta, t, moments, faster, damped, out.free[a])
        if a < s:
            for r in range(4):
                set_times(blow.shape, out.free[a, r], out.sight[a, r])
        elif not (closed or leans):
            break
        for b in range(s):
            scale = t
            for k in range(s):
                weights[k] = powers[b, k] * scale
                scale *= (k + 1.0) * c
            add_up(moments[1:], weights, out.forced[1, b])
            add_up(faster[1:], weights, out.forced[3, b])
            add_up(damped[1:], weights, out.forced[5, b])
            for k in range(s):
                weights[k] *= t
            add_up(moments[2:], weights, out.forced[0, b])
            add_up(faster[2:], weights, out.forced[2, b])
            add_up(damped[2:], weights, out.forced[4, b])
            if a < s:
                see_forced(blow, grown, a, b, out)
            else:
                set_times(blow.shape, out.forced[0, b], out.thrust[0, b])
                set_times(blow.shape, out.forced[1, b], out.thrust[1, b])
            if a < s and leans:
                see_steady(blow, grown, a, b, out)


@inner()
def set_times(one, other, out):
    """The products of two rows in a third, all (n,)."""
    for n in range(out.size):
        out[n] = one[n] * other[n]


@inner(fastmath=LOOSE)
def see_forced(blow, grown, a, b, out):
    """Enter what node a sees of the force polynomial b, whose responses there are ``out.forced``, in a `Table`."""
    shape, forced = blow.shape, out.forced
    for k in range(2):
        out.inner[k, a, b] = seen_thrice(shape, shape, forced[k, b])
        for i in range(grown.rows.shape[0]):
            total = 0.0
            for r in range(3):
                lo, hi = grown.spans[i, r, 0], grown.spans[i, r, 1]
                if hi > 0 and r < 2:
                    total += seen_thrice(grown.seen[i, r, lo:hi], shape[lo:hi], forced[2 + 2 * r + k, b, lo:hi])
                elif hi > 0:
                    total += 2.0 * product(grown.seen[i, r, lo:hi], forced[k, b, lo:hi])
            out.pushed[i, k, a, b] = total


@inner(fastmath=LOOSE)
def see_steady(blow, grown, a, b, out):
    """Enter what node a sees of the bias by the force polynomial b, as `see_forced` does for the force."""
    shape, bias, forced = blow.shape, blow.bias, out.forced
    for k in range(2):
        first = 0 if b == 0 else 1
        out.lean[k, a] = first * out.lean[k, a] + seen_thrice(shape, bias, forced[k, b])
        for i in range(grown.rows.shape[0]):
            rows = grown.rows[i]
            total = seen_thrice(bias, rows[2], forced[k, b]) + seen_thrice(shape, rows[3], forced[k, b])
            for r in range(2):
                total += seen_thrice(grown.seen[i, r], bias, forced[2 + 2 * r + k, b])
            out.leaned[i, k, a] = first * out.leaned[i, k, a] + total


@inner(fastmath=LOOSE)
def add_up(rows, weights, out):
    """Sum of weighted rows (s or more, n) in out (n,), s from 3 on; three at once, so as to run in parallel lanes."""
    x, y, z = rows[0], rows[1], rows[2]
    a, b, c = weights[0], weights[1], weights[2]
    for n in range(out.size):
        out[n] = a * x[n] + b * y[n] + c * z[n]
    for k in range(3, weights.size):
        x = rows[k]
        a = weights[k]
        for n in range(out.size):
            out[n] += a * x[n]


@inner(fastmath=LOOSE)
def seen_thrice(one, two, three):
    """Sum of the products of three rows (n,)."""
    total = 0.0
    for n in range(one.size):
        total += one[n] * two[n] * three[n]
    return total


@inner(fastmath=LOOSE)
def move_on(free, q, p, out):
    """Free motion of every mode to a node and its changes, rows of out (6, n_modes)."""
    for r in range(6):
        by_q, by_p, row = free[2 * r], free[2 * r + 1], out[r]
        for n in range(q.size):
            row[n] = by_q[n] * q[n] + by_p[n] * p[n]


@inner(fastmath=LOOSE)
def glide_to(free, free_also, q, p, shape, response, out):
    """Free motion of every mode, less its shape times a response, in out."""
    for n in range(out.size):
        out[n] = free[n] * q[n] + free_also[n] * p[n] - shape[n] * response[n]


@inner(fastmath=LOOSE)
def carry(blow, free, forced, force, leans, q, p, work, out):
    """State of every mode at a node, and what changes it; ``free`` and ``forced`` are the node's parts of the table.

    Rows of out (10, n_modes): q and p; their changes per omega, per zeta, per shape and per bias; the last are made
    only if there is a bias or a change of one, which ``leans`` says. work (n_modes,) is room.
    """
    bias, shape = blow.bias, blow.shape
    for r in range(6):
        response = out[6 + r] if r < 2 else work
        add_up(forced[r], force, response)
        glide_to(free[2 * r], free[2 * r + 1], q, p, shape, response, out[r])
    for r in range(6, 8):
        for n in range(q.size):
            out[r, n] = -out[r, n]
    if leans:
        for r in range(6):
            steady = out[8 + r] if r < 2 else work
            for n in range(q.size):
                steady[n] = 0.0
            for b in range(force.size):
                for n in range(q.size):
                    steady[n] += forced[r, b, n]
            for n in range(q.size):
                out[r, n] += bias[n] * steady[n]


@inner(fastmath=LOOSE)
def see_two(sight, dq, dp, i, j):
    """Changes of the approach and of its rate at a node with parameters i and j by the free motion of their changes."""
    by_q, by_p, sped_q, sped_p = sight[0], sight[1], sight[2], sight[3]
    q_i, p_i, q_j, p_j = dq[i], dp[i], dq[j], dp[j]
    d_i = 0.0
    v_i = 0.0
    d_j = 0.0
    v_j = 0.0
    for n in range(q_i.size):
        d_i += by_q[n] * q_i[n] + by_p[n] * p_i[n]
        v_i += sped_q[n] * q_i[n] + sped_p[n] * p_i[n]
        d_j += by_q[n] * q_j[n] + by_p[n] * p_j[n]
        v_j += sped_q[n] * q_j[n] + sped_p[n] * p_j[n]
    return d_i, v_i, d_j, v_j


@inner(fastmath=LOOSE)
def see_grown(grown, i, out):
    """Changes of the approach and of its rate at a node by what parameter i changes of the blow; ``out`` is that of
    `move_on`.
    """
    d = 0.0
    v = 0.0
    for r in range(3):
        a, b = grown.spans[i, r, 0], grown.spans[i, r, 1]
        if b > 0:
            row = grown.seen[i, r, a:b] if r < 2 else grown.rows[i, r, a:b]
            k = 2 + 2 * r if r < 2 else 0
            by_d, by_v = seen(row, out[k, a:b], out[k + 1, a:b])
            d += by_d
            v += by_v
    return d, v


@inner(fastmath=LOOSE)
def lead(by_q, by_p, thrust, df, dq, dp, out):
    """Change of the displacements or velocities by the changes of state and force, s of them, three at once."""
    x, y, z = thrust[0], thrust[1], thrust[2]
    a, b, c = df[0], df[1], df[2]
    for n in range(out.size):  # with more arrays at once they would not run in parallel lanes
        out[n] = by_q[n] * dq[n] + by_p[n] * dp[n] - (a * x[n] + b * y[n] + c * z[n])
    for k in range(3, df.size):
        x = thrust[k]
        a = df[k]
        for n in range(out.size):
            out[n] -= a * x[n]


@inner(fastmath=LOOSE)
def glide(by_q, by_p, dq, dp, out):
    """The same without a force."""
    for n in range(out.size):
        out[n] = by_q[n] * dq[n] + by_p[n] * dp[n]


@inner(fastmath=LOOSE)
def add_times(one, other, out):
    """Add the products of two rows to a third, all (n,)."""
    for n in range(out.size):
        out[n] += one[n] * other[n]


@inner(fastmath=LOOSE)
def seen(shape, q, p):
    """Sums of the shapes times displacements and velocities."""
    d = 0.0
    v = 0.0
    for n in range(q.size):
        d += shape[n] * q[n]
        v += shape[n] * p[n]
    return d, v


@inner()
def solve_many(matrix, right):
    """Solve matrix (s, s) times x = right (s, n) in place by elimination with row exchange."""
    s, n = right.shape
    for i in range(s):
        best = i
        for r in range(i + 1, s):
            if abs(matrix[r, i]) > abs(matrix[best, i]):
                best = r
        for j in range(s):
            matrix[i, j], matrix[best, j] = matrix[best, j], matrix[i, j]
        for j in range(n):
            right[i, j], right[best, j] = right[best, j], right[i, j]
        for r in range(s):
            if r != i and matrix[r, i] != 0.0:
                factor = matrix[r, i] / matrix[i, i]
                for j in range(i, s):
                    matrix[r, j] -= factor * matrix[i, j]
                for j in range(n):
                    right[r, j] -= factor * right[i, j]
    for i in range(s):
        for j in range(n):
            right[i, j] /= matrix[i, i]


@inner(allocates=True, fastmath=LOOSE)
def look(blow, change, q, p, dq, dp, out_base, out_ends):
    """Approach, its three rates and the force in a state, and their changes but for that of the third; see `Found`."""
    slopes = np.empty(N_LAW)
    rate = np.empty(q.size)
    d, v = seen(blow.shape, q, p)
    d += blow.offset
    f, by_d, by_v = law_slopes(d, v, blow.law, slopes)
    u, w, z = blow.shape, blow.omega, blow.zeta
    a = 0.0
    for n in range(q.size):
        rate[n] = blow.bias[n] - u[n] * f - w[n] * (2.0 * z[n] * p[n] + w[n] * q[n])
        a += u[n] * rate[n]
    turn = 0.0
    grows = by_d * v + by_v * a
    for n in range(q.size):
        turn -= u[n] * (u[n] * grows + w[n] * (2.0 * z[n] * rate[n] + w[n] * p[n]))
    out_base[0] = d
    out_base[1] = v
    out_base[2] = a
    out_base[3] = turn
    out_base[4] = f
    for i in range(dq.shape[0]):
        du, dw, dz, db = change.shape[i], change.omega[i], change.zeta[i], change.bias[i]
        x, y = dq[i], dp[i]
        dd = change.offset[i]
        dv = 0.0
        for n in range(q.size):
            dd += u[n] * x[n] + du[n] * q[n]
            dv += u[n] * y[n] + du[n] * p[n]
        df = by_d * dd + by_v * dv
        for k in range(N_LAW):
            df += slopes[k] * change.law[i, k]
        da = 0.0
        for n in range(q.size):
            more = db[n] - du[n] * f - u[n] * df - w[n] * (2.0 * z[n] * y[n] + w[n] * x[n])
            more -= 2.0 * ((dz[n] * w[n] + z[n] * dw[n]) * p[n] + w[n] * dw[n] * q[n])
            da += u[n] * more + du[n] * rate[n]
        out_ends[0, i] = dd
        out_ends[1, i] = dv
        out_ends[2, i] = da
        out_ends[3, i] = df


@outer()
def law_at(d, v, law, out_slopes):
    """`law_slopes` for use from Python."""
    return law_slopes(d, v, law, out_slopes)


@inner()
def force_rate(d, v, a, law, slopes):
    """Rate of the force of contact 0 at an approach, rate and acceleration."""
    _, by_d, by_v = law_slopes(d, v, law, slopes)
    return by_d * v + by_v * a


@outer()
def rate_slopes(now, law, along, out):
    """The force's rate at an approach and its first two rates, and half its differences to both sides along others.

    ``now`` (3,), ``along`` (n, 3 + N_LAW) also of the law's numbers, ``out`` (1 + n,).
    """
    slopes = np.empty(N_LAW)
    width = min(N_LAW, law.shape[1])
    near = law.copy()
    out[0] = force_rate(now[0], now[1], now[2], law, slopes)
    for i in range(along.shape[0]):
        out[1 + i] = 0.0
        for side in (-0.5, 0.5):
            for k in range(width):
                near[0, k] = law[0, k] + 2.0 * side * along[i, 3 + k]
            d, v, a = now[0] + 2.0 * side * along[i, 0], now[1] + 2.0 * side * along[i, 1], now[2]
            out[1 + i] += side * force_rate(d, v, a + 2.0 * side * along[i, 2], near, slopes)


@inner()
def span(values, out_span):
    """First of some values that is not zero, and one after the last; both zero without any."""
    out_span[0] = 0
    out_span[1] = 0
    for n in range(values.size):
        if values[n] != 0.0:
            out_span[0] = n if out_span[1] == 0 else out_span[0]
            out_span[1] = n + 1


@inner()
def enter(shape, change, out_grown, dq, dp):
    """Rows that every parameter changes, and its change of the state at the start."""
    for i in range(dq.shape[0]):
        for k in range(dq.shape[1]):
            out_grown.rows[i, 0, k] = change.omega[i, k]
            out_grown.rows[i, 1, k] = change.zeta[i, k]
            out_grown.rows[i, 2, k] = change.shape[i, k]
            out_grown.rows[i, 3, k] = change.bias[i, k]
            dq[i, k] = change.start_q[i, k]
            dp[i, k] = change.start_p[i, k]
        for r in range(4):
            span(out_grown.rows[i, r], out_grown.spans[i, r])
        for r in range(3):
            for k in range(dq.shape[1]):
                out_grown.seen[i, r, k] = shape[k] * out_grown.rows[i, r, k]


@inner()
def solve_forces(blow, change, grown, table, force, q, p, dq, dp, room, out_force):
    """Change of the force at the inner nodes of a closed piece, (s, n), from the state at its start."""
    n, s = dq.shape[0], force.size
    matrix, slopes, by_change = room.matrix, room.slopes, room.by_change
    for i in range(0, n, 2):
        j = min(i + 1, n - 1)
        for a in range(s):
            d, v, other_d, other_v = see_two(table.sight[a], dq, dp, i, j)
            by_change[a, 0, i] = d
            by_change[a, 1, i] = v
            by_change[a, 0, j] = other_d
            by_change[a, 1, j] = other_v
    for a in range(s):
        move_on(table.free[a], q, p, room.out)
        d, v = seen(blow.shape, room.out[0], room.out[1])
        d += table.lean[0, a]
        v += table.lean[1, a]
        for b in range(s):
            d -= force[b] * table.inner[0, a, b]
            v -= force[b] * table.inner[1, a, b]
        _, by_d, by_v = law_slopes(blow.offset + d, v, blow.law, slopes)
        for b in range(s):
            matrix[a, b] = by_d * table.inner[0, a, b] + by_v * table.inner[1, a, b]
        matrix[a, a] += 1.0
        for i in range(n):
            dd, dv = see_grown(grown, i, room.out)
            dd += by_change[a, 0, i] + table.leaned[i, 0, a] + change.offset[i]
            dv += by_change[a, 1, i] + table.leaned[i, 1, a]
            for b in range(s):
                dd -= force[b] * table.pushed[i, 0, a, b]
                dv -= force[b] * table.pushed[i, 1, a, b]
            out_force[a, i] = by_d * dd + by_v * dv + product(slopes, change.law[i])
    solve_many(matrix, out_force)


@inner()
def march(grown, table, closed, n_rows, df, room, dq, dp, out_dq, out_dp):
    """Changes of the state at the end of a piece; ``n_rows`` of the rows of `Grown` act in it."""
    s = df.shape[0]
    free, column = table.free[s], room.column
    for i in range(dq.shape[0]):
        if closed:
            for b in range(s):
                column[b] = df[b, i]
            lead(free[0], free[1], table.thrust[0], column, dq[i], dp[i], out_dq[i])
            lead(free[2], free[3], table.thrust[1], column, dq[i], dp[i], out_dp[i])
        else:
            glide(free[0], free[1], dq[i], dp[i], out_dq[i])
            glide(free[2], free[3], dq[i], dp[i], out_dp[i])
        for r in range(n_rows):
            a, b = grown.spans[i, r, 0], grown.spans[i, r, 1]
            if b > 0:
                row = grown.rows[i, r, a:b]
                add_times(row, room.out[2 + 2 * r, a:b], out_dq[i, a:b])
                add_times(row, room.out[3 + 2 * r, a:b], out_dp[i, a:b])


@outer()
def follow(blow, change, pieces, found):
    """Follow a recorded blow and its changes through all pieces; writes into every array of ``found``."""
    n_modes, n, s = blow.omega.size, change.offset.size, pieces.force.shape[1]
    grown = Grown(np.empty((n, 4, n_modes)), np.empty((n, 3, n_modes)), np.zeros((n, 4, 2), np.int64))
    dq, next_dq = np.empty((n, n_modes)), np.empty((n, n_modes))
    dp, next_dp = np.empty((n, n_modes)), np.empty((n, n_modes))
    enter(blow.shape, change, grown, dq, dp)
    leans = any_of(blow.bias) or any_of(grown.spans[:, 3, 1])
    q = blow.start_q.copy()
    p = blow.start_p.copy()
    known = np.zeros(SLOTS)
    last = np.zeros(SLOTS, np.int64)
    free = np.empty((SLOTS, s + 1, 12, n_modes))
    sight = np.empty((SLOTS, s, 4, n_modes))
    forced = np.empty((SLOTS, 6, s, n_modes))
    thrust = np.empty((SLOTS, 2, s, n_modes))
    inner_sums = np.empty((SLOTS, 2, s, s))
    lean = np.zeros((SLOTS, 2, s))
    pushed = np.empty((SLOTS, n, 2, s, s))
    leaned = np.zeros((SLOTS, n, 2, s))
    room = Room(
        np.zeros((10, n_modes)), np.empty(n_modes), np.empty((s, s)), np.empty(N_LAW), np.empty((s, 2, n)), np.zeros(s)
    )
    for j in range(pieces.length.size + 1):
        d, v = seen(blow.shape, q, p)
        found.way[j, 0] = blow.offset + d
        found.way[j, 1] = v
        mark = pieces.mark[j]
        if mark >= 0:
            look(blow, change, q, p, dq, dp, found.base[mark], found.ends[mark])
            restore(q, p, found.q[mark], found.p[mark])
        if j == pieces.length.size:
            break
        h, force, closed = pieces.length[j], pieces.force[j], pieces.closed[j]
        key = h if closed else -h
        slot = 0
        for k in range(SLOTS):
            if known[k] == key:
                slot = k
                break
            if last[k] < last[slot]:
                slot = k
        table = Table(
            free[slot],
            sight[slot],
            forced[slot],
            thrust[slot],
            inner_sums[slot],
            lean[slot],
            pushed[slot],
            leaned[slot],
        )
        if known[slot] != key:
            tangent_table(blow, grown, leans, closed, h, pieces.nodes, pieces.powers, table)
            known[slot] = key
        last[slot] = j + 1
        if closed:
            solve_forces(blow, change, grown, table, force, q, p, dq, dp, room, found.force[j])
        if closed or leans:
            carry(blow, table.free[s], table.forced, force, leans, q, p, room.work, room.out)
        else:
            move_on(table.free[s], q, p, room.out)
        n_rows = 4 if leans else 3 if closed else 2
        march(grown, table, closed, n_rows, found.force[j], room, dq, dp, next_dq, next_dp)
        dq, next_dq = next_dq, dq
        dp, next_dp = next_dp, dp
        restore(room.out[0], room.out[1], q, p)
    for i in range(n):
        restore(dq[i], dp[i], found.dq[i], found.dp[i])
