"""The equations of one step: schemes A and A4, for one contact and for several that share modes.

Scheme A holds each contact force constant over the step and gives it the work it does: with approaches ``d0`` at the
step's start and ``y`` at its end, stored energies ``V0`` and ``V1``, the force is ``f = (V1 - V0) / (y - d0)``, and
``y = e - b f``, where ``e`` is the approach at the end if nothing pushed and ``b`` what a unit force takes from it.
The energy after the step is that before it, whatever the step's length; the error falls with its square. The equation
has exactly one root, as f rises with y.

Scheme A4 lets the force change linearly, ``f + s (t/h - 1/2)``, with ``s = F(y) - F(d0)`` and the mean f such that the
work ``f (y - d0) + s ((d0 + y)/2 - mean approach)`` is again ``V1 - V0``: order 4, and the same energy. It has no root
where the step is long against the contact; such a step goes to scheme A.

With loss (Hunt and Crossley 1975, J. Appl. Mech. 42, 440) the force is ``F(d) (1 + loss d')``: its mean gains
``loss (V1 - V0) / h`` and its slope ``loss (F1 v1 - F0 v0)``, so that no step creates energy. Felt takes from the mean
what it remembers in the mean, and from the slope how that changes, with the compression a cubic over the step.
"""

from typing import NamedTuple

import numpy as np

from .build import inner
from .laws.felt import growth, memory_within_step
from .rounding import CHORD, ITERATIONS, NEAR, OVERFLOW, REPEATED, SOLVED, STALLED

from .law import (  # isort: skip
    Point, mean_slopes, memory_energy, point_at, point_when_compressed, power, spring_of, steepness, with_compliance,
)  # fmt: skip

from .layout import (  # isort: skip
    APPROACH, COMPRESSION, ENERGY, FORCE, FREE_END, FREE_MEAN, FREE_RATE, OWN_END, OWN_MEAN,
    OWN_MEAN_RAMP, OWN_RATE, OWN_RATE_RAMP, RATE,
)  # fmt: skip

CLOSING = 1e-6  # [-] of the largest force: less may pull in a try, or scheme A would decide when the contact closes
WORK_ERROR = 1e-9  # [-] a step whose force's work misses the stored energy by more lost its digits: scheme A takes it


class Free(NamedTuple):
    """The approach of a contact if nothing pushed during the step."""

    end: float  # [m]
    mean: float  # [m] over the step
    rate: float  # [m/s] at the end


class Own(NamedTuple):
    """What a unit of the step's force takes from them; `_ramp` for the force t/h - 1/2."""

    end: float
    end_ramp: float
    mean: float
    mean_ramp: float
    rate: float
    rate_ramp: float


@inner()
def point_of(now, i):
    """Where contact i stands: ``now`` (6, n_contacts) holds approach, compression, force, energy and rate."""
    return Point(now[APPROACH, i], now[COMPRESSION, i], now[FORCE, i], now[ENERGY, i])


@inner()
def mean_force(start, y, h, spring):
    """Scheme A at an approach y at the step's end: the point there, mean force, never less than 0, its slope, memory.

    Felt takes up the middle compression u: ``z1 - z0 = (1 - exp(-h/tau)) (u**a - z0)``, and takes the force
    ``k share (z0 + z1) / 2``. So the step loses ``k share (z1 - z0) (u - mean of z**(1/a))``, never less than nothing.
    """
    end = point_at(y, spring)
    g, d = mean_slopes(start, end, spring)
    span = y - start.approach
    turn = (end.force - g) / span if abs(span) > CHORD * (abs(y) + abs(start.approach)) else 0.5 * d
    if spring.relaxation == 0.0:
        loss = spring.loss / h
        f = g + loss * (end.energy - start.energy)
        return (end, f, turn + loss * end.force, 0.0) if f > 0.0 else (end, 0.0, 0.0, 0.0)
    a, z = spring.exponent, spring.memory
    middle = 0.5 * (max(0.0, start.compression) + max(0.0, end.compression))
    taken = -np.expm1(-h / spring.relaxation)
    aim = power(middle, a) if middle > 0.0 else 0.0
    memory = z + taken * (aim - z)
    f = g - 0.5 * spring.hard * (z + memory)
    if f <= 0.0:
        left = spring.hard / spring.stiffness
        return end, 0.0, 0.0, z * np.exp(-(1.0 - left) * h / spring.relaxation)
    if end.compression > 0.0:
        turn -= 0.25 * spring.hard * taken * a * aim / middle
    return end, f, turn, memory


@inner()
def solve_constant(start, e, b, h, spring):
    """Scheme A: the point at the step's end and the force >= 0, with ``y = e - b force``; always exists, unique.

    By Newton's method between bounds.
    """
    end, f, turn, _ = mean_force(start, e, h, spring)
    low, high, y = e - b * f, e, e
    a, d0 = spring.exponent, start.approach
    if spring.loss == 0.0 and spring.compliance == 0.0 and e > 0.0 and b > 0.0 and f > 0.0:
        share = e - d0 if d0 <= 0.0 else 1.0
        y = ((a + 1.0) * e * share / (b * spring.stiffness)) ** (1.0 / (a + (1.0 if d0 <= 0.0 else 0.0)))
        y = max(low, min(high, y * (1.0 + SOLVED)))
        end, f, turn, _ = mean_force(start, y, h, spring)
    for _ in range(300):
        r = y - e + b * f
        if r > 0.0:
            high = y
        else:
            low = y
        new = y - r / (1.0 + b * turn)
        if abs(new - y) <= REPEATED * abs(y) or high - low <= REPEATED * max(abs(low), abs(high)):
            break
        y = new if low < new < high else 0.5 * (low + high)
        end, f, turn, _ = mean_force(start, y, h, spring)
    return end, f


@inner()
def lossy_terms(h, start, end, rate0, free_rate, spring):
    """What loss or memory adds to mean force and slope at the free end rate, and takes of each per unit less of it."""
    if spring.relaxation > 0.0:
        g0, r0, _ = growth(start, rate0, spring)
        g1, r1, per = growth(end, free_rate, spring)
        z, mean, per_end, per_mean = memory_within_step(h, 1.0, g0, g1, r0, r1, spring)
        k = spring.hard
        return -k * mean, -k * (z - spring.memory), -k * per_mean * per, -k * per_end * per
    loss = spring.loss
    add = loss * (end.energy - start.energy) / h
    return add, loss * (end.force * free_rate - start.force * rate0), 0.0, loss * end.force


@inner()
def memory_after(h, start, end, rate0, rate1, ramped, spring):
    """What felt remembers after a step of scheme A4 or A; 0 of another contact."""
    if spring.relaxation == 0.0:
        return 0.0
    if not ramped:
        return mean_force(start, end.approach, h, spring)[3]
    g0, r0, _ = growth(start, rate0, spring)
    g1, r1, _ = growth(end, rate1, spring)
    return max(0.0, memory_within_step(h, 1.0, g0, g1, r0, r1, spring)[0])


@inner()
def is_fair(start, end, f, s, mean, memory, spring):
    """Whether a step of scheme A4 loses neither less than nothing nor, without loss, more than its rounding.

    ``mean`` is its mean approach, ``memory`` what is remembered at its end.
    """
    work = f * (end.approach - start.approach) + s * (0.5 * (start.approach + end.approach) - mean)
    stored = end.energy - start.energy
    if spring.relaxation > 0.0:
        stored += memory_energy(max(0.0, end.compression), memory, spring)
        stored -= memory_energy(max(0.0, start.compression), spring.memory, spring)
        return work - stored >= -1e-14 * (start.energy + end.energy)
    slack = WORK_ERROR * (start.energy + end.energy)
    return work >= stored if spring.loss > 0.0 else abs(work - stored) <= slack


@inner()
def linear_guess(start, free, own, spring):
    """Compression at the end of a step if the spring were linear from its start on."""
    if start.approach <= 0.0:
        return 0.5 * free.end
    steep = steepness(start.compression, start.force, spring)
    half = 0.5 * own.end * with_compliance(steep, spring)
    y = (free.end - own.end * start.force + half * start.approach) / (1.0 + half)
    if spring.compliance == 0.0:
        return y
    return start.compression + (y - start.approach) / (1.0 + spring.compliance * steep)


@inner()
def solve_ramp(guess, h, start, rate0, free, own, spring):
    """Scheme A4 for one contact: whether it settled, the point at the step's end, mean force and slope.

    The unknown is the compression at the end, from ``guess``, by Newton's method; with loss by secants. Not settled
    where that fails, the force would pull or the contact would give energy.
    """
    d0, c = start.approach, spring.compliance
    lossy = spring.loss > 0.0 or spring.relaxation > 0.0
    scale = max(abs(free.end), abs(d0))
    x = guess if guess > -scale else 0.5 * free.end
    old_x = old_r = f = s = 0.0
    end = start
    close = last = False
    for iteration in range(ITERATIONS):
        end = point_when_compressed(x, spring)
        y = end.approach
        g, d = mean_slopes(start, end, spring)
        middle = 0.5 * (d0 + y)
        right = g + d * (free.mean - middle)
        s = end.force - start.force
        stiffening = 1.0 + d * own.mean
        if not lossy:
            f = (right - d * own.mean_ramp * s) / stiffening
        else:  # mean and slope depend on each other through the rate at the end: two equations
            add, tilt, held_back, part = lossy_terms(h, start, end, rate0, free.rate, spring)
            right += add
            top = s + tilt
            one = stiffening + held_back * own.rate
            cross = d * own.mean_ramp + held_back * own.rate_ramp
            two = 1.0 + part * own.rate_ramp
            f = (right * two - cross * top) / (one * two - cross * part * own.rate)
            s = (top - part * own.rate * f) / two
        r = y - free.end + own.end * f + own.end_ramp * s
        if last or r == 0.0 or (close and abs(r) <= SOLVED * max(scale, abs(y))):
            mean = free.mean - own.mean * f - own.mean_ramp * s
            rate1 = free.rate - own.rate * f - own.rate_ramp * s
            memory = memory_after(h, start, end, rate0, rate1, True, spring)
            return f >= 0.0 and is_fair(start, end, f, s, mean, memory, spring), end, f, s
        if not lossy or iteration == 0:
            steep = steepness(x, end.force, spring) if x > 0.0 else 0.0  # dF/dx; over the approach it is less
            tangent = with_compliance(steep, spring)
            span = y - d0
            turn = 0.5 * d
            bend = 0.0
            if abs(span) > CHORD * (abs(y) + abs(d0)):
                turn = (end.force - g) / span
                bend = (tangent - d) / span
            rise = turn + bend * (free.mean - own.mean_ramp * s - middle - own.mean * f)
            rise -= d * (own.mean_ramp * tangent + 0.5)
            slope = (1.0 + own.end * rise / stiffening + own.end_ramp * tangent) * (1.0 + c * steep)
        else:
            slope = (r - old_r) / (x - old_x)
        step = -r / slope
        if not abs(step) < OVERFLOW:
            break
        old_x = x
        old_r = r
        x += step
        size = max(abs(x), 1e-2 * scale)
        close = abs(step) <= 1e-7 * size or x == old_x
        last = x == old_x or abs(step) <= 2e-15 * size
    return False, end, f, s


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
def sweep_constants(h, now, law, e, sums, out_y, out_f):
    """Solve scheme A's equations one contact at a time, the others' forces held; the largest relative change."""
    m = e.size
    change = 0.0
    for i in range(m):
        rest = e[i]
        for j in range(m):
            if j != i:
                rest -= sums[OWN_END, i, j] * out_f[j]
        old = out_f[i]
        end, out_f[i] = solve_constant(point_of(now, i), rest, sums[OWN_END, i, i], h, spring_of(law, i))
        out_y[i] = end.approach
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
        if sweep_constants(h, now, law, e, sums, out_y, out_f) <= SOLVED or m == 1:
            return
    matrix = work[0]
    step = work[2, 0]
    slope = work[2, 1]
    best = np.inf
    for _ in range(ITERATIONS):
        worst = 0.0
        for i in range(m):
            y = e[i]
            for j in range(m):
                y -= sums[OWN_END, i, j] * out_f[j]
            _, force, slope[i], _ = mean_force(point_of(now, i), y, h, spring_of(law, i))
            step[i] = force - out_f[i]
            if step[i] != 0.0:
                worst = max(worst, abs(step[i]) / max(force, abs(out_f[i])))
        if worst <= SOLVED or (worst <= STALLED and worst >= 0.5 * best):
            break
        best = min(best, worst)
        for i in range(m):
            for j in range(m):
                matrix[i, j] = slope[i] * sums[OWN_END, i, j]
            matrix[i, i] += 1.0
        if not solve_linear(matrix, step, m):
            break
        begin = low = high = 0.0
        t = 1.0
        for look in range(40):
            rise = 0.0
            for i in range(m):
                y = e[i]
                lift = 0.0
                for j in range(m):
                    y -= sums[OWN_END, i, j] * (out_f[j] + (t if look > 0 else 0.0) * step[j])
                    lift += sums[OWN_END, i, j] * step[j]
                force = mean_force(point_of(now, i), y, h, spring_of(law, i))[1]
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
        if sweep_constants(h, now, law, e, sums, out_y, out_f) <= SOLVED:
            break


@inner()
def left_of(free, sums, row, i, force, slope):
    """What forces leave of a free approach or rate of contact i; a ``row`` of `exact.contact_sums`, and the next."""
    for j in range(force.size):
        free -= sums[row, i, j] * force[j] + sums[row + 1, i, j] * slope[j]
    return free


@inner()
def guess_ends(contacts, sums, work, out_y, out_f):
    """Approaches at the end of a step and mean forces, if every spring were linear from the step's start on.

    False if some contact begins or ends then: scheme A4 may have a root with it and one without.
    """
    now, matrix, vector, half = contacts.now, work[0], work[2, 0], work[2, 1]  # half of the stiffness [N/m]
    m = out_y.size
    for i in range(m):
        half[i] = out_f[i] = 0.0
        if now[APPROACH, i] > 0.0:
            spring = spring_of(contacts.law, i)
            half[i] = 0.5 * with_compliance(steepness(now[COMPRESSION, i], now[FORCE, i], spring), spring)
            out_f[i] = now[FORCE, i]
    for i in range(m):
        vector[i] = contacts.free[FREE_END, i] - now[APPROACH, i]
        for j in range(m):
            vector[i] -= sums[OWN_END, i, j] * out_f[j]
            matrix[i, j] = sums[OWN_END, i, j] * half[j]
        matrix[i, i] += 1.0
    if not solve_linear(matrix, vector, m):
        return False
    for i in range(m):
        out_f[i] = max(0.0, out_f[i] + half[i] * vector[i])
        out_y[i] = now[APPROACH, i] + vector[i]
    return stays(now[APPROACH], out_y)


@inner()
def stays(start, end):
    """Whether no contact begins or ends between these approaches."""
    same = True
    for i in range(end.size):
        same = same and start[i] * end[i] > 0.0
    return same


@inner()
def ramp_forces(h, y, contacts, sums, work, out_f, out_s, out_r):
    """Mean and slope of the forces of scheme A4 if the step ended at approaches y, and the residual in y."""
    law, now = contacts.law, contacts.now
    e, ea, vf = contacts.free[FREE_END], contacts.free[FREE_MEAN], contacts.free[FREE_RATE]
    m = e.size
    matrix = work[0]
    vector = work[2, 2]
    for i in range(m):
        spring = spring_of(law, i)
        start, end = point_of(now, i), point_at(y[i], spring)
        g, d = mean_slopes(start, end, spring)
        add, tilt, held_back, part = lossy_terms(h, start, end, now[RATE, i], vf[i], spring)
        for j in range(m):
            matrix[i, j] = d * sums[OWN_MEAN, i, j] + held_back * sums[OWN_RATE, i, j]
            matrix[i, m + j] = d * sums[OWN_MEAN_RAMP, i, j] + held_back * sums[OWN_RATE_RAMP, i, j]
            matrix[m + i, j] = part * sums[OWN_RATE, i, j]
            matrix[m + i, m + j] = part * sums[OWN_RATE_RAMP, i, j]
        matrix[i, i] += 1.0
        matrix[m + i, m + i] += 1.0
        vector[i] = g + d * (ea[i] - 0.5 * (start.approach + y[i])) + add
        vector[m + i] = end.force - start.force + tilt
    if not solve_linear(matrix, vector, 2 * m):
        return False
    for i in range(m):
        out_f[i] = vector[i]
        out_s[i] = vector[m + i]
    for i in range(m):
        out_r[i] = -left_of(e[i] - y[i], sums, OWN_END, i, out_f, out_s)
    return True


@inner()
def solve_ramps(h, contacts, sums, work, blind):
    """Scheme A4: mean and slope of the forces of one step, starting from a guess of the approaches at its end.

    Returns False where the iteration does not settle or a force would pull; the step then belongs to scheme A. Only in
    a try, repeated until it ends where a contact closes, may that contact pull: a ``blind`` step is none.
    """
    law, now, out_y, out_f, out_s = contacts.law, contacts.now, contacts.end, contacts.force, contacts.slope
    m = out_y.size
    r, r2, f2, s2 = work[3, 0], work[3, 1], work[3, 2, :m], work[3, 3, :m]
    y2, jacobian = work[4, 0], work[1]
    scale = work[2, 3]  # of an approach: what rounding counts from, though it ends at zero
    widest = 0.0
    for i in range(m):
        scale[i] = max(abs(now[APPROACH, i]), abs(contacts.free[FREE_END, i]))
        for j in range(m):
            scale[i] = max(scale[i], abs(sums[OWN_END, i, j] * out_f[j]))
        widest = max(widest, scale[i])
    for i in range(m):
        scale[i] = max(scale[i], NEAR * widest)
    settled = False
    for _ in range(20):
        if not ramp_forces(h, out_y, contacts, sums, work, out_f, out_s, r):
            return False
        if settled:
            break
        for j in range(m):
            for i in range(m):
                y2[i] = out_y[i]
            y2[j] += 1e-7 * max(abs(out_y[j]), 1e-3 * scale[j])
            shift = y2[j] - out_y[j]
            if not ramp_forces(h, y2, contacts, sums, work, f2, s2, r2):
                return False
            for i in range(m):
                jacobian[i, j] = (r2[i] - r[i]) / shift
        if not solve_linear(jacobian, r, m):
            return False
        settled = True
        for i in range(m):
            out_y[i] -= r[i]
            if not abs(r[i]) < OVERFLOW:
                return False
            if abs(r[i]) > SOLVED * max(4.0 * abs(out_y[i]), scale[i]):
                settled = False
    if not settled:
        return False
    largest = 0.0
    for i in range(m):
        largest = max(largest, out_f[i])
    for i in range(m):
        if not blind and now[APPROACH, i] < 0.0 and abs(out_f[i]) <= CLOSING * largest:
            continue
        if not out_f[i] >= 0.0:
            return False
        spring = spring_of(law, i)
        start, end = point_of(now, i), point_at(out_y[i], spring)
        mean = left_of(contacts.free[FREE_MEAN, i], sums, OWN_MEAN, i, out_f, out_s)
        v1 = left_of(contacts.free[FREE_RATE, i], sums, OWN_RATE, i, out_f, out_s)
        memory = memory_after(h, start, end, now[RATE, i], v1, True, spring)
        if not is_fair(start, end, out_f[i], out_s[i], mean, memory, spring):
            return False
    return True
