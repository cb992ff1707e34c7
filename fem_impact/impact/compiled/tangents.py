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

from .build import LOOSE, WHOLE, inner, outer
from .law import at, power, spring_of, steepness
from .one_mode import mode_moments
from .propagation import N_LANE, lane_table

N_LAW = 8  # numbers of a law that may change, in the order of `law.spring_of`
SLOTS = 12  # [-] lengths of pieces whose tables are kept
SMALL = 1e-2  # [rad] phase below which the fourth moment is taken from two terms of its series
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


@inner(allocates=True)
def moments_of(omega, zeta, t, out_moments):
    """Moments m_(-1), m_0, .. of every mode over t, (count + 2, n_modes)."""
    count = out_moments.shape[0] - 2
    if count <= 4:
        lanes = np.empty((N_LANE, omega.size))
        lane_table(omega, zeta, t, WHOLE, lanes)
        part = 1.0 / t
        for n in range(omega.size):
            out_moments[0, n] = lanes[3, n]
            out_moments[1, n] = part * lanes[1, n]
            out_moments[2, n] = part * lanes[4, n]
            out_moments[3, n] = part * lanes[5, n]
        for n in range(omega.size):
            third = part * (lanes[6, n] + 0.5 * lanes[5, n])
            if count > 2:
                out_moments[4, n] = third
            if (
                count > 3
            ):  # only changes per zeta take this one, with a factor omega t: few digits will do if that is small
                th, x = omega[n] * t, zeta[n] * omega[n] * t
                near = 1.0 / 120.0 - x / 360.0
                full = (1.0 / 6.0 - 2.0 * x * third - out_moments[3, n]) / (th * th if th > SMALL else 1.0)
                out_moments[5, n] = full if th > SMALL else near
        return
    moments = np.empty(count + 1)
    work = np.empty((2, count))
    for n in range(omega.size):
        _, _, a22 = mode_moments(omega[n], zeta[n], t, moments, work)
        out_moments[0, n] = a22
        for k in range(count + 1):
            out_moments[k + 1, n] = moments[k]


@inner(allocates=True)
def moment_slopes(omega, zeta, t, moments, out_faster, out_damped):
    """Changes of all moments but the last per unit of omega and of zeta, (count + 1, n_modes) each."""
    rows = out_faster.shape[0]
    for n in range(omega.size):
        w, z = omega[n], zeta[n]
        th = w * t
        per = 1.0 / w if w > 0.0 else 0.0
        rest = (1.0 - z) * (1.0 + z)
        own = (1.0 / rest if abs(rest) > CRITICAL else 0.0) if w > 0.0 else 0.0
        bend = -2.0 * z * th * moments[0, n] - th * th * moments[1, n]  # t**2 g''
        out_faster[0, n] = per * bend
        out_damped[0, n] = own * (-z * bend - th * (moments[0, n] + moments[1, n]))
    for k in range(rows - 1):
        for n in range(omega.size):
            w, z = omega[n], zeta[n]
            rest = (1.0 - z) * (1.0 + z)
            per = 1.0 / w if w > 0.0 else 0.0
            own = (1.0 / rest if abs(rest) > CRITICAL else 0.0) if w > 0.0 else 0.0
            fall = moments[k, n] - (k + 1.0) * moments[k + 1, n]
            out_faster[k + 1, n] = per * fall
            out_damped[k + 1, n] = -own * (z * fall + w * t * (moments[k + 1, n] - k * moments[k + 2, n]))
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


@inner(allocates=True)
def tangent_table(omega, zeta, shape, h, nodes, powers, out_free, out_forced, out_inner):
    """Coefficients of one piece of length h.

    out_free (s + 1, 12, n_modes): a11, a12, a21, a22 up to each node, and their changes per omega and per zeta;
    out_forced (s + 1, 6, s, n_modes): displacement and velocity per unit force of each polynomial, and their changes;
    out_inner (2, s, s): approach and its rate at a node per force polynomial, summed over the modes.
    """
    s = nodes.size - 1
    n_modes = omega.size
    moments = np.empty((s + 3, n_modes))
    faster = np.empty((s + 2, n_modes))
    damped = np.empty((s + 2, n_modes))
    for a in range(s + 1):
        c = nodes[a]
        t = c * h
        moments_of(omega, zeta, t, moments)
        moment_slopes(omega, zeta, t, moments, faster, damped)
        free = out_free[a]
        for n in range(n_modes):
            w, z = omega[n], zeta[n]
            a12, a22 = t * moments[1, n], moments[0, n]
            free[0, n] = a22 + 2.0 * z * w * a12
            free[1, n] = a12
            free[2, n] = -w * w * a12
            free[3, n] = a22
            d12 = t * faster[1, n]
            free[4, n] = faster[0, n] + 2.0 * z * (w * d12 + a12)
            free[5, n] = d12
            free[6, n] = -w * (w * d12 + 2.0 * a12)
            free[7, n] = faster[0, n]
            d12 = t * damped[1, n]
            free[8, n] = damped[0, n] + 2.0 * w * (z * d12 + a12)
            free[9, n] = d12
            free[10, n] = -w * w * d12
            free[11, n] = damped[0, n]
        for b in range(s):
            forced = out_forced[a, :, b]
            for n in range(n_modes):
                for r in range(6):
                    forced[r, n] = 0.0
            scale = t
            for k in range(s):
                part = powers[b, k] * scale
                more = t * part
                for n in range(n_modes):
                    forced[0, n] += more * moments[k + 2, n]
                    forced[1, n] += part * moments[k + 1, n]
                    forced[2, n] += more * faster[k + 2, n]
                    forced[3, n] += part * faster[k + 1, n]
                    forced[4, n] += more * damped[k + 2, n]
                    forced[5, n] += part * damped[k + 1, n]
                scale *= (k + 1.0) * c
            if a < s:
                out_inner[0, a, b] = seen_twice(shape, forced[0])
                out_inner[1, a, b] = seen_twice(shape, forced[1])


@inner(fastmath=LOOSE)
def seen_twice(shape, response):
    """Sum of the squared shapes times a response of every mode."""
    total = 0.0
    for n in range(shape.size):
        total += shape[n] * shape[n] * response[n]
    return total


@inner(fastmath=LOOSE)
def carry(blow, free, forced, force, q, p, out):
    """State of every mode at a node, and what changes it; ``free`` and ``forced`` are the node's parts of the table.

    Rows of out (10, n_modes): q and p; their changes per omega, per zeta, per shape and per bias.
    """
    bias, shape = blow.bias, blow.shape
    for n in range(q.size):
        x, v = q[n], p[n]
        out[0, n] = free[0, n] * x + free[1, n] * v
        out[1, n] = free[2, n] * x + free[3, n] * v
        out[2, n] = free[4, n] * x + free[5, n] * v
        out[3, n] = free[6, n] * x + free[7, n] * v
        out[4, n] = free[8, n] * x + free[9, n] * v
        out[5, n] = free[10, n] * x + free[11, n] * v
        out[6, n] = 0.0
        out[7, n] = 0.0
        out[8, n] = 0.0
        out[9, n] = 0.0
    for b in range(force.size):
        f = force[b]
        for n in range(q.size):
            pushed = bias[n] - shape[n] * f
            x, v = forced[0, b, n], forced[1, b, n]
            out[0, n] += x * pushed
            out[1, n] += v * pushed
            out[2, n] += forced[2, b, n] * pushed
            out[3, n] += forced[3, b, n] * pushed
            out[4, n] += forced[4, b, n] * pushed
            out[5, n] += forced[5, b, n] * pushed
            out[6, n] -= x * f
            out[7, n] -= v * f
            out[8, n] += x
            out[9, n] += v


@inner(fastmath=LOOSE)
def along(shape, free, out, row_of, acts, dq, dp):
    """Change of the approach and of its rate at a node if the force did not change; ``row_of`` are the changes."""
    d = 0.0
    v = 0.0
    f11, f12, f21, f22 = free[0], free[1], free[2], free[3]
    for n in range(dq.size):
        u, x, y = shape[n], dq[n], dp[n]
        d += u * (f11[n] * x + f12[n] * y)
        v += u * (f21[n] * x + f22[n] * y)
    for r in range(4):
        if acts[r]:
            row, by_d, by_v = row_of[r], out[2 + 2 * r], out[3 + 2 * r]
            for n in range(dq.size):
                part = shape[n] * row[n]
                d += part * by_d[n]
                v += part * by_v[n]
    if acts[2]:
        row, q, p = row_of[2], out[0], out[1]
        for n in range(dq.size):
            d += row[n] * q[n]
            v += row[n] * p[n]
    return d, v


@inner(fastmath=LOOSE)
def lead(free, out, row_of, acts, dq, dp):
    """Carry the change of the state to a node in place if the force did not change."""
    f11, f12, f21, f22 = free[0], free[1], free[2], free[3]
    for n in range(dq.size):
        x, v = dq[n], dp[n]
        dq[n] = f11[n] * x + f12[n] * v
        dp[n] = f21[n] * x + f22[n] * v
    for r in range(4):
        if acts[r]:
            row, by_q, by_p = row_of[r], out[2 + 2 * r], out[3 + 2 * r]
            for n in range(dq.size):
                dq[n] += row[n] * by_q[n]
                dp[n] += row[n] * by_p[n]


@inner(fastmath=LOOSE)
def push_on(shape, forced, df, dq, dp):
    """Add what the change of the force does to the change of the state at the end of a piece."""
    for b in range(df.size):
        f = df[b]
        x, v = forced[0, b], forced[1, b]
        for n in range(dq.size):
            dq[n] -= shape[n] * f * x[n]
            dp[n] -= shape[n] * f * v[n]


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


@inner(allocates=True)
def look(blow, change, q, p, dq, dp, out_base, out_ends):
    """Approach, its three rates and the force in a state, and their changes but for that of the third; see `Found`."""
    slopes = np.empty(N_LAW)
    d, v = seen(blow.shape, q, p)
    d += blow.offset
    f, by_d, by_v = law_slopes(d, v, blow.law, slopes)
    u, w, z = blow.shape, blow.omega, blow.zeta
    a = 0.0
    for n in range(q.size):
        a += u[n] * (blow.bias[n] - u[n] * f - w[n] * (2.0 * z[n] * p[n] + w[n] * q[n]))
    out_base[0] = d
    out_base[1] = v
    out_base[2] = a
    turn = 0.0
    grows = by_d * v + by_v * a
    for n in range(q.size):
        rate = blow.bias[n] - u[n] * f - w[n] * (2.0 * z[n] * p[n] + w[n] * q[n])
        turn -= u[n] * (u[n] * grows + w[n] * (2.0 * z[n] * rate + w[n] * p[n]))
    out_base[3] = turn
    out_base[4] = f
    for i in range(dq.shape[0]):
        dd = change.offset[i]
        dv = 0.0
        for n in range(q.size):
            dd += u[n] * dq[i, n] + change.shape[i, n] * q[n]
            dv += u[n] * dp[i, n] + change.shape[i, n] * p[n]
        df = by_d * dd + by_v * dv
        for k in range(N_LAW):
            df += slopes[k] * change.law[i, k]
        da = 0.0
        for n in range(q.size):
            du, dw, dz = change.shape[i, n], change.omega[i, n], change.zeta[i, n]
            da += du * (blow.bias[n] - u[n] * f - w[n] * (2.0 * z[n] * p[n] + w[n] * q[n]))
            more = change.bias[i, n] - du * f - u[n] * df - w[n] * (2.0 * z[n] * dp[i, n] + w[n] * dq[i, n])
            da += u[n] * (more - 2.0 * (dz * w[n] + z[n] * dw) * p[n] - 2.0 * w[n] * dw * q[n])
        out_ends[0, i] = dd
        out_ends[1, i] = dv
        out_ends[2, i] = da
        out_ends[3, i] = df


@outer()
def law_at(d, v, law, out_slopes):
    """`law_slopes` for use from Python."""
    return law_slopes(d, v, law, out_slopes)


@inner()
def any_in(values):
    """Whether any of some values is not zero."""
    found = False
    for n in range(values.size):
        found = found or values[n] != 0.0
    return found


@outer()
def follow(blow, change, pieces, found):
    """Follow a recorded blow and its changes through all pieces; writes into every array of ``found``."""
    n_modes, n, s = blow.omega.size, change.offset.size, pieces.force.shape[1]
    nodes, powers, shape = pieces.nodes, pieces.powers, blow.shape
    dq, dp = found.dq, found.dp
    rows = np.empty((n, 4, n_modes))
    acts = np.zeros((n, 4), np.bool_)
    q = blow.start_q.copy()
    p = blow.start_p.copy()
    for i in range(n):
        for k in range(n_modes):
            rows[i, 0, k] = change.omega[i, k]
            rows[i, 1, k] = change.zeta[i, k]
            rows[i, 2, k] = change.shape[i, k]
            rows[i, 3, k] = change.bias[i, k]
            dq[i, k] = change.start_q[i, k]
            dp[i, k] = change.start_p[i, k]
        for r in range(4):
            acts[i, r] = any_in(rows[i, r])
    known = np.zeros(SLOTS)
    last = np.zeros(SLOTS, np.int64)
    all_free = np.empty((SLOTS, s + 1, 12, n_modes))
    all_forced = np.empty((SLOTS, s + 1, 6, s, n_modes))
    all_inner = np.empty((SLOTS, 2, s, s))
    out = np.empty((10, n_modes))
    matrix = np.empty((s, s))
    slopes = np.empty(N_LAW)
    column = np.empty(s)
    for j in range(pieces.length.size + 1):
        d, v = seen(shape, q, p)
        found.way[j, 0] = blow.offset + d
        found.way[j, 1] = v
        mark = pieces.mark[j]
        if mark >= 0:
            look(blow, change, q, p, dq, dp, found.base[mark], found.ends[mark])
            for k in range(n_modes):
                found.q[mark, k] = q[k]
                found.p[mark, k] = p[k]
        if j == pieces.length.size:
            break
        h, force = pieces.length[j], pieces.force[j]
        slot = 0
        for k in range(SLOTS):
            if known[k] == h:
                slot = k
                break
            if last[k] < last[slot]:
                slot = k
        free, forced, inner_sums = all_free[slot], all_forced[slot], all_inner[slot]
        if known[slot] != h:
            tangent_table(blow.omega, blow.zeta, shape, h, nodes, powers, free, forced, inner_sums)
            known[slot] = h
        last[slot] = j + 1
        right = found.force[j]
        if pieces.closed[j]:
            for a in range(s):
                carry(blow, free[a], forced[a], force, q, p, out)
                d, v = seen(shape, out[0], out[1])
                _, by_d, by_v = law_slopes(blow.offset + d, v, blow.law, slopes)
                for b in range(s):
                    matrix[a, b] = by_d * inner_sums[0, a, b] + by_v * inner_sums[1, a, b]
                matrix[a, a] += 1.0
                for i in range(n):
                    dd, dv = along(shape, free[a], out, rows[i], acts[i], dq[i], dp[i])
                    df = by_d * (dd + change.offset[i]) + by_v * dv
                    for k in range(N_LAW):
                        df += slopes[k] * change.law[i, k]
                    right[a, i] = df
            solve_many(matrix, right)
        carry(blow, free[s], forced[s], force, q, p, out)
        for i in range(n):
            lead(free[s], out, rows[i], acts[i], dq[i], dp[i])
            if pieces.closed[j]:
                for b in range(s):
                    column[b] = right[b, i]
                push_on(shape, forced[s], column, dq[i], dp[i])
        for k in range(n_modes):
            q[k] = out[0, k]
            p[k] = out[1, k]
