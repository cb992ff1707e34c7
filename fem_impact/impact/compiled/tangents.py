"""Derivatives of a recorded blow in any of its numbers.

A change of a number changes the motion of each mode by dq, each approach d by dd and the contact force f there by df:
``dq'' + 2 zeta omega dq' + omega**2 dq = db - sum (f du + u df) - 2 omega domega q - 2 d(zeta omega) q'``,
``dd = doffset + sum (u dq + q du)``, ``df = f_d dd + f_v dd' + f_p dp``; the first sum is over the contacts. These
equations are linear, whatever the law: where a force starts and ends it is zero, so that df has no peaks there although
these times move. What a plastic contact remembers, its deepest compression m, adds ``f_m dm``. It moves as the
compression does until that turns back, where its rate is zero, and stays until the contact yields further.

The force of the record is a polynomial in each piece of time, and so is df, through s Gauss nodes. The modes follow
both exactly: with m_k the moments of the impulse response (see `propagation`) and m_(-1) its rate,
``omega dm_k/domega = m_(k-1) - (k+1) m_k`` and
``(1 - zeta**2) dm_k/dzeta = zeta ((k+1) m_k - m_(k-1)) - omega h (m_k - k m_(k+1))``.
"""

from typing import NamedTuple

import numpy as np

from .arrays import ANGLE_LIMIT, LIGHT
from .build import LOOSE, ZERO, inner, outer
from .law import PLASTIC, at, compression, power, simple, spring_of, steepness
from .layout import A12, A21, A22, COMPLIANCE, EXPONENT, FIRST_YIELD, KIND, STIFFNESS, WIDTH
from .one_mode import mode_moments
from .propagation import any_of, free_table, product, restore

N_LAW = 8  # numbers of a law that may change, in the order of `law.spring_of`
OMEGA, ZETA, BIAS, SHAPES = range(4)  # rows of a `Grown`; the changes of motion that they make follow the motion itself
SLOTS = 12  # [-] lengths of pieces whose tables are kept, to limit the memory
SMALL = 0.5  # [rad] phase below which the recursion of the moments cancels: two orders lose a digit
TERMS = 13  # [-] of their power series there: leave 1e-16
CRITICAL = 1e-4  # [-] this near to critical damping, derivatives in zeta are differences; they err by its square


class Blow(NamedTuple):
    """The numbers of a blow, as in `History`."""

    omega: np.ndarray  # (n_modes,)
    zeta: np.ndarray  # (n_modes,)
    shape: np.ndarray  # (n_contacts, n_modes)
    bias: np.ndarray  # (n_modes,)
    start_q: np.ndarray  # (n_modes,)
    start_p: np.ndarray  # (n_modes,)
    offset: np.ndarray  # (n_contacts,)
    law: np.ndarray  # (n_contacts, 9 or 4)


class Change(NamedTuple):
    """Their changes per unit of each of some parameters."""

    omega: np.ndarray  # (n, n_modes)
    zeta: np.ndarray  # (n, n_modes)
    shape: np.ndarray  # (n, n_contacts, n_modes)
    bias: np.ndarray  # (n, n_modes)
    start_q: np.ndarray  # (n, n_modes)
    start_p: np.ndarray  # (n, n_modes)
    offset: np.ndarray  # (n, n_contacts)
    law: np.ndarray  # (n, n_contacts, N_LAW)


class Pieces(NamedTuple):
    """Time in pieces without an event inside, with the recorded forces at Gauss nodes; and these nodes."""

    length: np.ndarray  # (n_pieces,) [s]
    closed: np.ndarray  # (n_pieces, n_contacts) bool, whether a contact carries force
    force: np.ndarray  # (n_pieces, n_contacts, s) [N]
    memory: np.ndarray  # (n_pieces + 1, n_contacts) what a contact remembers at the start of a piece, and at the end
    yields: np.ndarray  # (n_pieces + 1, n_contacts) bool, whether a plastic contact is pressed deeper than before
    mark: np.ndarray  # (n_pieces + 1,) number of the mark at the start of a piece and at the end; -1 for none
    nodes: np.ndarray  # (s + 1,) fractions of a piece, the last one 1
    powers: np.ndarray  # (s, s) Lagrange polynomials of the first s as powers


class Found(NamedTuple):
    """The motion and its changes at marks, and the change of the forces."""

    way: np.ndarray  # (n_pieces + 1, n_contacts, 2) approach and rate at the ends of all pieces
    base: np.ndarray  # (n_marks, n_contacts, 5) approach and its first three rates, force
    ends: np.ndarray  # (n_marks, n_contacts, 4, n) changes of approach, rate, acceleration and force
    dents: np.ndarray  # (n_marks, n_contacts, 1 + n) dent of a plastic contact, and its changes
    force: np.ndarray  # (n_pieces, n_contacts, s, n) change of the forces at the nodes
    dq: np.ndarray  # (n, n_modes) changes of the state at the end
    dp: np.ndarray  # (n, n_modes)


class Grown(NamedTuple):
    """The rows of a `Change` that each parameter makes, and where they are not zero."""

    rows: np.ndarray  # (n, SHAPES + n_contacts, n_modes) of omega, zeta, bias and the shape of each contact
    seen: np.ndarray  # (n, 2 + n_contacts, n_contacts, n_modes) all but the third times the shape of each contact
    spans: np.ndarray  # (n, SHAPES + n_contacts, 2) where a row is not zero: its first index, one after its last; or 0


class Table(NamedTuple):
    """Coefficients of a piece of one length; a force polynomial is that of `Pieces.powers`."""

    free: np.ndarray  # (s + 1, 12, n_modes) a11, a12, a21, a22 up to each node, their changes per omega and per zeta
    sight: np.ndarray  # (s, n_contacts, 4, n_modes) the shapes times the first four at an inner node
    forced: np.ndarray  # (6, s, n_modes) displacement and velocity at the end per unit force, and their changes
    thrust: np.ndarray  # (n_contacts, 2, s, n_modes) the shapes times the first two
    inner: np.ndarray  # (2, n_contacts, n_contacts, s, s) an approach and its rate at a node per force polynomial
    lean: np.ndarray  # (2, n_contacts, s) the same by the bias
    pushed: np.ndarray  # (n, 2, n_contacts, n_contacts, s, s) changes of minus `inner` per parameter
    leaned: np.ndarray  # (n, 2, n_contacts, s) changes of `lean`


class State(NamedTuple):
    """The motion, and its change with each parameter."""

    q: np.ndarray  # (n_modes,)
    p: np.ndarray  # (n_modes,)
    dq: np.ndarray  # (n, n_modes)
    dp: np.ndarray  # (n, n_modes)


class Pressed(NamedTuple):
    """The contacts of a piece, or at a mark."""

    acting: np.ndarray  # (up to n_contacts,) those that carry force
    force: np.ndarray  # (n_contacts, s) [N]
    memory: np.ndarray  # (n_contacts,)
    yields: np.ndarray  # (n_contacts,) bool
    deeper: np.ndarray  # (n_contacts, n) changes of what the contacts remember


class Room(NamedTuple):
    """Room for what a piece needs."""

    out: np.ndarray  # (2 + 2 (SHAPES + n_contacts), n_modes), see `carry`
    work: np.ndarray  # (n_modes,)
    matrix: np.ndarray  # (n_contacts s, n_contacts s)
    right: np.ndarray  # (n_contacts s, n)
    slopes: np.ndarray  # (N_LAW,)
    by_change: np.ndarray  # (n_contacts, s, 2, n)
    column: np.ndarray  # (s,)


@inner()
def law_slopes(d, v, law, c, memory, yields, out_slopes):
    """Force of contact c and its slopes in approach, rate and memory; in out_slopes (N_LAW,) those in its numbers."""
    for k in range(N_LAW):
        out_slopes[k] = 0.0
    if law.shape[1] == WIDTH and law[c, KIND] == PLASTIC and (yields or memory > law[c, FIRST_YIELD]):
        return plastic_slopes(d, law, c, memory, yields, out_slopes)
    spring = spring_of(law, c)
    factor = 1.0 + spring.loss * v
    if d <= 0.0 or factor <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    point = at(d, spring)
    x = point.compression
    steep = steepness(x, point.force, spring)
    soft = 1.0 / (1.0 + spring.compliance * steep)
    soft_layer = spring.stiffness * power(x, spring.exponent)
    out_slopes[0] = soft_layer / spring.stiffness * soft * factor
    out_slopes[1] = soft_layer * np.log(x) * soft * factor
    out_slopes[2] = point.force * v
    out_slopes[3] = -point.force * steep * soft * factor
    if x > spring.corner and spring.kind != PLASTIC:
        further = x - spring.corner
        more = spring.hard * power(further, spring.hard_exponent)
        out_slopes[5] = -spring.hard_exponent * more / further * soft * factor
        out_slopes[6] = more / spring.hard * soft * factor
        out_slopes[7] = more * np.log(further) * soft * factor
    return point.force * factor, steep * soft * factor, point.force * spring.loss, 0.0


@inner()
def tangent_slopes(x, law, c, out_slopes):
    """Force of plastic contact c that yields at a compression, and its slope; in out_slopes those in its numbers."""
    k, a, first = law[c, STIFFNESS], law[c, EXPONENT], law[c, FIRST_YIELD]
    base = k * power(first, a - 1.0)
    force = base * (first + a * (x - first))
    out_slopes[STIFFNESS] = force / k
    out_slopes[EXPONENT] = force * np.log(first) + base * (x - first)
    out_slopes[FIRST_YIELD] = a * (a - 1.0) * base / first * (x - first)
    return force, a * base


@inner()
def plastic_slopes(d, law, c, memory, yields, out_slopes):
    """`law_slopes` of a contact that yields, or has done so and unloads from its dent or is pressed again."""
    k, a, soft = law[c, STIFFNESS], law[c, EXPONENT], law[c, COMPLIANCE]
    if yields:
        force, steep = tangent_slopes(0.0, law, c, out_slopes)
        force, _ = tangent_slopes((d - soft * force) / (1.0 + soft * steep), law, c, out_slopes)
        share = 1.0 / (1.0 + soft * steep)
        out_slopes[COMPLIANCE] = -force * steep
        for n in range(N_LAW):
            out_slopes[n] *= share
        return force, steep * share, 0.0, 0.0
    low, low_memory = dent_slopes(law, c, memory, out_slopes)
    if d <= low:
        for n in range(N_LAW):
            out_slopes[n] = 0.0
        return 0.0, 0.0, 0.0, 0.0
    back = memory - low
    most = k * power(memory, a - 1.0) * back
    stiff = most / power(back, a)
    x = compression(d - low, simple(stiff, a, 0.0, soft))
    force = stiff * power(x, a)
    steep = a * force / x
    share = 1.0 / (1.0 + soft * steep)
    # the force is k m**(a-1) back (x / back)**a, and a change of the dent is minus one of back and one of x
    grows = force * (1.0 - a) / back + steep
    for n in range(N_LAW):
        out_slopes[n] *= -grows
    out_slopes[STIFFNESS] += force / k
    out_slopes[EXPONENT] += force * (np.log(memory) + np.log(x / back))
    out_slopes[COMPLIANCE] = -force * steep
    by_memory = force * ((1.0 - a) / back + (a - 1.0) / memory) - grows * low_memory
    for n in range(N_LAW):
        out_slopes[n] *= share
    return force, steep * share, 0.0, by_memory * share


@inner()
def dent_slopes(law, c, memory, out_slopes):
    """Dent of plastic contact c that yielded and its slope in the memory; in out_slopes those in its numbers."""
    k, a = law[c, STIFFNESS], law[c, EXPONENT]
    for n in range(N_LAW):
        out_slopes[n] = 0.0
    most, steep = tangent_slopes(memory, law, c, out_slopes)
    back = most / (k * power(memory, a - 1.0))
    for n in range(N_LAW):
        out_slopes[n] *= -back / most
    out_slopes[STIFFNESS] += back / k
    out_slopes[EXPONENT] += back * np.log(memory)
    return memory - back, 1.0 - back * (steep / most - (a - 1.0) / memory)


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
    """1 / omega and 1 / (1 - zeta**2) of every mode, zero for rigid ones; the latter also next to critical damping."""
    for n in range(omega.size):
        rest = (1.0 - zeta[n]) * (1.0 + zeta[n])
        out_per[n] = 1.0 / omega[n] if omega[n] > 0.0 else 0.0
        out_own[n] = 1.0 / rest if omega[n] > 0.0 and abs(rest) > CRITICAL else 0.0


@inner(allocates=True)
def moment_slopes(omega, zeta, t, moments, per, own, out_faster, out_damped):
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
    for n in range(omega.size):
        if omega[n] > 0.0 and own[n] == 0.0:
            difference(omega[n], zeta[n], t, out_damped[:, n])


@inner(allocates=True)
def difference(omega, zeta, t, out_damped):
    """Changes of all moments but the last per unit of zeta (count + 1,), of a mode next to critical damping."""
    rows = out_damped.size
    near = np.empty(rows)
    work = np.empty((2, rows))
    out_damped[:] = 0.0
    for side in (-1.0, 1.0):
        _, _, a22 = mode_moments(omega, zeta + side * CRITICAL, t, near, work)
        out_damped[0] += side * a22 / (2.0 * CRITICAL)
        for k in range(rows - 1):
            out_damped[k + 1] += side * near[k] / (2.0 * CRITICAL)


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
    """Coefficients of one piece of length h in ``out``, a `Table`; without a closed contact only those of the end."""
    s, m = nodes.size - 1, blow.offset.size
    omega, zeta = blow.omega, blow.zeta
    moments = np.empty((s + 3, omega.size))
    faster = np.empty((s + 2, omega.size))
    damped = np.empty((s + 2, omega.size))
    per = np.empty(omega.size)
    own = np.empty(omega.size)
    weights = np.empty(s)
    divisors(omega, zeta, per, own)
    for a in range(0 if closed else s, s + 1):
        part = nodes[a]
        t = part * h
        moments_of(omega, zeta, t, moments)
        moment_slopes(omega, zeta, t, moments, per, own, faster, damped)
        free_slopes(omega, zeta, t, moments, faster, damped, out.free[a])
        if a < s:
            for c in range(m):
                for r in range(4):
                    set_times(blow.shape[c], out.free[a, r], out.sight[a, c, r])
        elif not (closed or leans):
            break
        for b in range(s):
            scale = t
            for k in range(s):
                weights[k] = powers[b, k] * scale
                scale *= (k + 1.0) * part
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
                for c in range(m):
                    set_times(blow.shape[c], out.forced[0, b], out.thrust[c, 0, b])
                    set_times(blow.shape[c], out.forced[1, b], out.thrust[c, 1, b])
            if a < s and leans:
                see_steady(blow, grown, a, b, out)


@inner()
def set_times(one, other, out):
    """The products of two rows in a third, all (n,)."""
    for n in range(out.size):
        out[n] = one[n] * other[n]


@inner()
def see_forced(blow, grown, a, b, out):
    """Enter what node a sees of the force polynomial b, whose responses there are ``out.forced``, in a `Table`."""
    for c in range(blow.offset.size):
        for e in range(c + 1):
            for k in range(2):
                out.inner[k, c, e, a, b] = seen_thrice(blow.shape[c], blow.shape[e], out.forced[k, b])
                out.inner[k, e, c, a, b] = out.inner[k, c, e, a, b]
                for i in range(grown.rows.shape[0]):
                    out.pushed[i, k, c, e, a, b] = seen_change(blow, grown, i, k, c, e, b, out.forced)
                    out.pushed[i, k, e, c, a, b] = out.pushed[i, k, c, e, a, b]


@inner(fastmath=LOOSE)
def seen_change(blow, grown, i, k, c, e, b, forced):
    """Change with parameter i of what contact c sees of the force polynomial b of contact e, or the reverse."""
    total = 0.0
    for r in range(2):
        lo, hi = grown.spans[i, r, 0], grown.spans[i, r, 1]
        if hi > 0:
            total += seen_thrice(grown.seen[i, r, c, lo:hi], blow.shape[e, lo:hi], forced[2 + 2 * r + k, b, lo:hi])
    lo, hi = grown.spans[i, SHAPES + e, 0], grown.spans[i, SHAPES + e, 1]
    if hi > 0:
        part = product(grown.seen[i, 2 + e, c, lo:hi], forced[k, b, lo:hi])
        total += 2.0 * part if c == e else part
    lo, hi = grown.spans[i, SHAPES + c, 0], grown.spans[i, SHAPES + c, 1]
    if hi > 0 and c != e:
        total += product(grown.seen[i, 2 + c, e, lo:hi], forced[k, b, lo:hi])
    return total


@inner(fastmath=LOOSE)
def see_steady(blow, grown, a, b, out):
    """Enter what node a sees of the bias by the force polynomial b, as `see_forced` does for the forces."""
    bias, forced = blow.bias, out.forced
    for c in range(blow.offset.size):
        shape = blow.shape[c]
        for k in range(2):
            first = 0 if b == 0 else 1
            out.lean[k, c, a] = first * out.lean[k, c, a] + seen_thrice(shape, bias, forced[k, b])
            for i in range(grown.rows.shape[0]):
                rows = grown.rows[i]
                total = seen_thrice(bias, rows[SHAPES + c], forced[k, b]) + seen_thrice(shape, rows[BIAS], forced[k, b])
                for r in range(2):
                    total += seen_thrice(grown.seen[i, r, c], bias, forced[2 + 2 * r + k, b])
                out.leaned[i, k, c, a] = first * out.leaned[i, k, c, a] + total


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
def take(shape, response, out):
    """Subtract the shape times a response from a row, all (n,)."""
    for n in range(out.size):
        out[n] -= shape[n] * response[n]


@inner(fastmath=LOOSE)
def carry(blow, table, pressed, leans, state, room):
    """State of every mode at the end of a piece, and what changes it, in ``room.out``.

    Rows: q and p; their changes per omega, per zeta, per bias and per shape of each contact, those of contacts that
    carry no force left as they are; those per bias are made only if there is a bias or a change of one, which ``leans``
    says.
    """
    q, p, bias, out = state.q, state.p, blow.bias, room.out
    forced = table.forced
    free = table.free[forced.shape[1]]
    n_acting = pressed.acting.size
    for r in range(6):
        for x in range(n_acting):
            c = pressed.acting[x]
            response = out[2 + 2 * (SHAPES + c) + r] if r < 2 else room.work
            add_up(forced[r], pressed.force[c], response)
            if x == 0:
                glide_to(free[2 * r], free[2 * r + 1], q, p, blow.shape[c], response, out[r])
            else:
                take(blow.shape[c], response, out[r])
            if r < 2:
                for n in range(q.size):
                    response[n] = -response[n]
        if n_acting == 0:
            glide(free[2 * r], free[2 * r + 1], q, p, out[r])
        if leans:
            steady = out[2 + 2 * BIAS + r] if r < 2 else room.work
            for n in range(q.size):
                steady[n] = 0.0
            for b in range(forced.shape[1]):
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
def see_grown(grown, i, c, out):
    """Changes of approach c and of its rate at a node by what parameter i changes of the blow; ``out`` is that of
    `move_on`.
    """
    d = 0.0
    v = 0.0
    for r in range(2):
        a, b = grown.spans[i, r, 0], grown.spans[i, r, 1]
        if b > 0:
            by_d, by_v = seen(grown.seen[i, r, c, a:b], out[2 + 2 * r, a:b], out[3 + 2 * r, a:b])
            d += by_d
            v += by_v
    a, b = grown.spans[i, SHAPES + c, 0], grown.spans[i, SHAPES + c, 1]
    if b > 0:
        by_d, by_v = seen(grown.rows[i, SHAPES + c, a:b], out[0, a:b], out[1, a:b])
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
        push(thrust[k], df[k], out)


@inner(fastmath=LOOSE)
def push(thrust, df, out):
    """Subtract a row times a number from another, both (n,)."""
    for n in range(out.size):
        out[n] -= df * thrust[n]


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
def solve_many(matrix, right, s):
    """Solve matrix x = right in place, of both the first s rows, by elimination with row exchange."""
    n = right.shape[1]
    for i in range(s):
        best = i
        for r in range(i + 1, s):
            if abs(matrix[r, i]) > abs(matrix[best, i]):
                best = r
        if best != i:
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
def look(blow, change, pressed, state, out_base, out_ends, out_dents):
    """Approaches, three rates and forces in a state, and their changes but for those of the third rate; see `Found`."""
    q, p, memory, deeper = state.q, state.p, pressed.memory, pressed.deeper
    m = blow.offset.size
    slopes = np.empty((m, N_LAW))
    steep = np.empty((m, 3))
    rate = np.empty(q.size)
    more = np.empty(q.size)
    w, z = blow.omega, blow.zeta
    for n in range(q.size):
        rate[n] = blow.bias[n] - w[n] * (2.0 * z[n] * p[n] + w[n] * q[n])
    for c in range(m):
        d, v = seen(blow.shape[c], q, p)
        for i in range(deeper.shape[1] + 1):
            out_dents[c, i] = 0.0
        if blow.law.shape[1] == WIDTH and blow.law[c, KIND] == PLASTIC and memory[c] > blow.law[c, FIRST_YIELD]:
            low, low_memory = dent_slopes(blow.law, c, memory[c], slopes[c])
            out_dents[c, 0] = low
            for i in range(deeper.shape[1]):
                out_dents[c, 1 + i] = low_memory * deeper[c, i] + product(slopes[c], change.law[i, c])
        f, by_d, by_v, by_m = law_slopes(blow.offset[c] + d, v, blow.law, c, memory[c], pressed.yields[c], slopes[c])
        steep[c, 0] = by_d
        steep[c, 1] = by_v
        steep[c, 2] = by_m
        out_base[c, 0] = blow.offset[c] + d
        out_base[c, 1] = v
        out_base[c, 4] = f
        push(blow.shape[c], f, rate)
    for n in range(q.size):
        more[n] = -w[n] * (2.0 * z[n] * rate[n] + w[n] * p[n])
    for c in range(m):
        out_base[c, 2] = product(blow.shape[c], rate)
        push(blow.shape[c], steep[c, 0] * out_base[c, 1] + steep[c, 1] * out_base[c, 2], more)
    for c in range(m):
        out_base[c, 3] = product(blow.shape[c], more)
    for i in range(state.dq.shape[0]):
        dw, dz, db = change.omega[i], change.zeta[i], change.bias[i]
        x, y = state.dq[i], state.dp[i]
        for n in range(q.size):
            more[n] = db[n] - w[n] * (2.0 * z[n] * y[n] + w[n] * x[n])
            more[n] -= 2.0 * ((dz[n] * w[n] + z[n] * dw[n]) * p[n] + w[n] * dw[n] * q[n])
        for c in range(m):
            u, du = blow.shape[c], change.shape[i, c]
            dd = change.offset[i, c]
            dv = 0.0
            for n in range(q.size):
                dd += u[n] * x[n] + du[n] * q[n]
                dv += u[n] * y[n] + du[n] * p[n]
            df = steep[c, 0] * dd + steep[c, 1] * dv + product(slopes[c], change.law[i, c])
            df += steep[c, 2] * deeper[c, i]
            push(u, df, more)
            push(du, out_base[c, 4], more)
            out_ends[c, 0, i] = dd
            out_ends[c, 1, i] = dv
            out_ends[c, 3, i] = df
        for c in range(m):
            out_ends[c, 2, i] = product(blow.shape[c], more) + product(change.shape[i, c], rate)


@outer()
def law_at(d, v, law, memory, yields, out_slopes):
    """`law_slopes` of the first of some laws, for use from Python."""
    return law_slopes(d, v, law, ZERO, memory, yields, out_slopes)


@inner()
def force_rate(d, v, a, law, yields, slopes):
    """Rate of the force of contact 0 at an approach, rate and acceleration; that of a contact that never unloaded."""
    _, by_d, by_v, _ = law_slopes(d, v, law, ZERO, 0.0, yields, slopes)
    return by_d * v + by_v * a


@outer()
def rate_slopes(now, law, yields, along, out):
    """The force's rate at an approach and its first two rates, and half its differences to both sides along others.

    ``now`` (3,), ``along`` (n, 3 + N_LAW) also of the law's numbers, ``out`` (1 + n,).
    """
    slopes = np.empty(N_LAW)
    width = min(N_LAW, law.shape[1])
    near = law.copy()
    out[0] = force_rate(now[0], now[1], now[2], law, yields, slopes)
    for i in range(along.shape[0]):
        out[1 + i] = 0.0
        for side in (-0.5, 0.5):
            for k in range(width):
                near[0, k] = law[0, k] + 2.0 * side * along[i, 3 + k]
            d, v, a = now[0] + 2.0 * side * along[i, 0], now[1] + 2.0 * side * along[i, 1], now[2]
            out[1 + i] += side * force_rate(d, v, a + 2.0 * side * along[i, 2], near, yields, slopes)


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
def enter(shape, change, out_grown, out_dq, out_dp):
    """Rows that every parameter changes, and its change of the state at the start."""
    m = shape.shape[0]
    for i in range(out_dq.shape[0]):
        for k in range(out_dq.shape[1]):
            out_grown.rows[i, OMEGA, k] = change.omega[i, k]
            out_grown.rows[i, ZETA, k] = change.zeta[i, k]
            out_grown.rows[i, BIAS, k] = change.bias[i, k]
            for c in range(m):
                out_grown.rows[i, SHAPES + c, k] = change.shape[i, c, k]
            out_dq[i, k] = change.start_q[i, k]
            out_dp[i, k] = change.start_p[i, k]
        for r in range(SHAPES + m):
            span(out_grown.rows[i, r], out_grown.spans[i, r])
        for r in range(2 + m):
            row = out_grown.rows[i, r if r < 2 else r + SHAPES - 2]
            for c in range(m):
                set_times(shape[c], row, out_grown.seen[i, r, c])


@inner()
def solve_forces(blow, change, grown, table, pressed, state, room, out_force):
    """Change of the forces at the inner nodes of a piece, (n_contacts, s, n), from the state at its start; those of
    contacts that carry no force are left as they are.
    """
    n, s, acting = state.dq.shape[0], pressed.force.shape[1], pressed.acting
    for i in range(0, n, 2):
        j = min(i + 1, n - 1)
        for x in range(acting.size):
            for a in range(s):
                by_free, sight = room.by_change[x, a], table.sight[a, acting[x]]
                by_free[0, i], by_free[1, i], by_free[0, j], by_free[1, j] = see_two(sight, state.dq, state.dp, i, j)
    for a in range(s):
        move_on(table.free[a], state.q, state.p, room.out)
        for x in range(acting.size):
            force_row(blow, change, grown, table, pressed, a, x, room)
    solve_many(room.matrix, room.right, acting.size * s)
    for x in range(acting.size):
        for a in range(s):
            for i in range(n):
                out_force[acting[x], a, i] = room.right[x * s + a, i]


@inner()
def force_row(blow, change, grown, table, pressed, a, x, room):
    """Row of the system of `solve_forces` for node a of the acting contact x; ``room.out`` is that of `move_on`."""
    acting, force, s = pressed.acting, pressed.force, pressed.force.shape[1]
    c, row = acting[x], x * s + a
    d, v = seen(blow.shape[c], room.out[0], room.out[1])
    d += table.lean[0, c, a]
    v += table.lean[1, c, a]
    for e in acting:
        d -= product(force[e], table.inner[0, c, e, a])
        v -= product(force[e], table.inner[1, c, e, a])
    memory, yields = pressed.memory[c], pressed.yields[c]
    _, by_d, by_v, by_m = law_slopes(blow.offset[c] + d, v, blow.law, c, memory, yields, room.slopes)
    for y in range(acting.size):
        e = acting[y]
        for b in range(s):
            room.matrix[row, y * s + b] = by_d * table.inner[0, c, e, a, b] + by_v * table.inner[1, c, e, a, b]
    room.matrix[row, row] += 1.0
    for i in range(change.omega.shape[0]):
        dd, dv = see_grown(grown, i, c, room.out)
        dd += room.by_change[x, a, 0, i] + table.leaned[i, 0, c, a] + change.offset[i, c]
        dv += room.by_change[x, a, 1, i] + table.leaned[i, 1, c, a]
        for e in acting:
            dd -= product(force[e], table.pushed[i, 0, c, e, a])
            dv -= product(force[e], table.pushed[i, 1, c, e, a])
        by_law = product(room.slopes, change.law[i, c])
        room.right[row, i] = by_d * dd + by_v * dv + by_m * pressed.deeper[c, i] + by_law


@inner()
def march(grown, table, acting, leans, df, room, state, out):
    """Changes of the state at the end of a piece, in another state."""
    s = df.shape[1]
    free, column = table.free[s], room.column
    for i in range(state.dq.shape[0]):
        dq, dp, out_dq, out_dp = state.dq[i], state.dp[i], out.dq[i], out.dp[i]
        for x in range(acting.size):
            c = acting[x]
            for b in range(s):
                column[b] = df[c, b, i]
            if x == 0:
                lead(free[0], free[1], table.thrust[c, 0], column, dq, dp, out_dq)
                lead(free[2], free[3], table.thrust[c, 1], column, dq, dp, out_dp)
                continue
            for b in range(s):
                push(table.thrust[c, 0, b], column[b], out_dq)
                push(table.thrust[c, 1, b], column[b], out_dp)
        if acting.size == 0:
            glide(free[0], free[1], dq, dp, out_dq)
            glide(free[2], free[3], dq, dp, out_dp)
        for r in range(SHAPES if leans else BIAS):
            grow(grown, i, r, room.out, out_dq, out_dp)
        for c in acting:
            grow(grown, i, SHAPES + c, room.out, out_dq, out_dp)


@inner()
def grow(grown, i, r, out, out_dq, out_dp):
    """Add what row r of parameter i changes in the state at the end of a piece; ``out`` is that of `carry`."""
    a, b = grown.spans[i, r, 0], grown.spans[i, r, 1]
    if b > 0:
        row = grown.rows[i, r, a:b]
        add_times(row, out[2 + 2 * r, a:b], out_dq[a:b])
        add_times(row, out[3 + 2 * r, a:b], out_dp[a:b])


@inner()
def deepen(blow, change, c, state, room, out_deeper):
    """Change (n,) of the compression of a plastic contact that yields, which it may remember."""
    d, v = seen(blow.shape[c], state.q, state.p)
    force, by_d, _, _ = law_slopes(blow.offset[c] + d, v, blow.law, c, 0.0, True, room.slopes)
    soft = blow.law[c, COMPLIANCE]
    for i in range(out_deeper.size):
        dd = change.offset[i, c] + product(blow.shape[c], state.dq[i]) + product(change.shape[i, c], state.q)
        df = by_d * dd + product(room.slopes, change.law[i, c])
        out_deeper[i] = dd - soft * df - force * change.law[i, c, COMPLIANCE]


@outer(seconds=8.0)
def follow(blow, change, pieces, found):
    """Follow a recorded blow and its changes through all pieces; writes into every array of ``found``."""
    n_modes, n, m, s = blow.omega.size, change.omega.shape[0], blow.offset.size, pieces.force.shape[2]
    grown = Grown(
        np.empty((n, SHAPES + m, n_modes)),
        np.empty((n, 2 + m, m, n_modes)),
        np.zeros((n, SHAPES + m, 2), np.int64),
    )
    q, p = blow.start_q.copy(), blow.start_p.copy()  # those of both states
    state = State(q, p, np.empty((n, n_modes)), np.empty((n, n_modes)))
    after = State(q, p, np.empty((n, n_modes)), np.empty((n, n_modes)))
    enter(blow.shape, change, grown, state.dq, state.dp)
    leans = any_of(blow.bias) or any_of(grown.spans[:, BIAS, 1])
    known = np.zeros(SLOTS)
    last = np.zeros(SLOTS, np.int64)
    free = np.empty((SLOTS, s + 1, 12, n_modes))
    sight = np.empty((SLOTS, s, m, 4, n_modes))
    forced = np.empty((SLOTS, 6, s, n_modes))
    thrust = np.empty((SLOTS, m, 2, s, n_modes))
    inner_sums = np.empty((SLOTS, 2, m, m, s, s))
    lean = np.zeros((SLOTS, 2, m, s))
    pushed = np.empty((SLOTS, n, 2, m, m, s, s))
    leaned = np.zeros((SLOTS, n, 2, m, s))
    acting, no_force, deeper = np.zeros(m, np.int64), np.zeros((m, s)), np.zeros((m, n))
    room = Room(
        np.zeros((2 + 2 * (SHAPES + m), n_modes)),
        np.empty(n_modes),
        np.empty((m * s, m * s)),
        np.empty((m * s, n)),
        np.empty(N_LAW),
        np.empty((m, s, 2, n)),
        np.zeros(s),
    )
    for j in range(pieces.length.size + 1):
        for c in range(m):
            d, v = seen(blow.shape[c], q, p)
            found.way[j, c, 0] = blow.offset[c] + d
            found.way[j, c, 1] = v
        end = j == pieces.length.size
        n_acting = 0
        for c in range(0 if end else m):
            if pieces.closed[j, c]:
                acting[n_acting] = c
                n_acting += 1
        force = no_force if end else pieces.force[j]
        pressed = Pressed(acting[:n_acting], force, pieces.memory[j], pieces.yields[j], deeper)
        mark = pieces.mark[j]
        if mark >= 0:
            look(blow, change, pressed, state, found.base[mark], found.ends[mark], found.dents[mark])
        if end:
            break
        h, closed = pieces.length[j], n_acting > 0
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
            solve_forces(blow, change, grown, table, pressed, state, room, found.force[j])
        if closed or leans:
            carry(blow, table, pressed, leans, state, room)
        else:
            move_on(table.free[s], q, p, room.out)
        march(grown, table, pressed.acting, leans, found.force[j], room, state, after)
        state, after = after, state
        restore(room.out[0], room.out[1], q, p)
        for c in range(m):
            if pieces.yields[j, c]:
                deepen(blow, change, c, state, room, deeper[c])
    for i in range(n):
        restore(state.dq[i], state.dp[i], found.dq[i], found.dp[i])
