"""A run with exponential Gauss collocation of the contact forces, the reference scheme: see `frame`.

The force of each contact is a polynomial over the step that obeys the contact law at s Gauss nodes; the modes move
exactly under it. The order is 2 s between events, which are located. A step is halved where the polynomial misses the
law at its ends.
"""

from typing import Any, NamedTuple

import numpy as np

from .build import FALSE, LOOSE, TRUE, inner, outer
from .bundles import Flights, KernelSystem, Limits
from .events import EVENT_LIMIT, dipped, strayed
from .exact import freshen
from .flight import GLIDES, NEVER, ONSET, SLOW, UNPROVED, approach_of
from .law import corner_approach, point_at, power, relaxes, simple, smooth_force, special_of, spring_of, yields
from .laws.felt import faded, lags
from .one_mode import mode_moments
from .propagation import any_of, glide, restore
from .record import EXHAUSTED, FAILED, FINISHED, FULL, SETTLED
from .rounding import NEAR, OVERFLOW, SOLVED, STALLED
from .schemes import solve_linear

from .frame import (  # isort: skip
    LEVELS, LOST, NOTHING, TAKEN, TRY, at_rest, begin, course_of, fly, followed, locate_event, made_run, moving, over,
    remember, remembered, step_length, take_over, touching,
)  # fmt: skip
from .layout import (  # isort: skip
    A11, A12, A21, A22, APPROACH, BEGUN, CLOSED, CORNERED, EVENTS, FAILURES, FRESH, HEAD,
    LENGTH, LEVEL, M1, N_LANE, PUSH, RATE, RELEASED, SEEKS, START, STEPS, TARGET, TIME, TRIES,
)  # fmt: skip

MOBILITY, BEYOND = range(2)  # rows of `CollocationRoom.contacts`
FORCES, SQUEEZE = range(2)  # and of `CollocationRoom.nodes`
BEGINS, ENDS, MOMENTS = range(3)  # and of `NodeGrid.work`
MOVED, SPED = range(2)  # rows of what force polynomials do: to the approach and to its rate
WELL, TURNED, LONG = range(3)  # how a step looks: take it so, take it again otherwise pressed, take a shorter one


class NodeGrid(NamedTuple):
    """Polynomials of s Gauss nodes, and the tables of steps: `tabulate`."""

    nodes: np.ndarray  # (s + 1,) fractions of the step, the last one 1
    powers: np.ndarray  # (s, s) Lagrange polynomials of the first s as powers
    free: np.ndarray  # (n_levels, s + 1, M1 + 1, n_modes)
    last: np.ndarray  # (n_levels, 2 s, n_modes)
    inner: np.ndarray  # (n_levels, 2, s, s, n_contacts, n_contacts)
    known: np.ndarray  # (n_levels,) whether a level's are there
    work: np.ndarray  # (3, s + 1) the polynomials at the step's start and end, and moments of a mode
    space: np.ndarray  # (2, s) where these are worked out
    base: float  # [s] longest step
    limit: float  # [m/s] misfit at most


class CollocationRoom(NamedTuple):
    """Where a step is worked out."""

    contacts: np.ndarray  # (2, n_contacts) mobility [1/kg], and whether the step runs beyond the corner of the law
    nodes: np.ndarray  # (2, s, n_contacts) forces at the nodes [N], at first a guess, and compressions [m]
    lag: np.ndarray  # (n_contacts, s + 1, s + 1), see `lag_table`
    free: np.ndarray  # (2, s + 1, n_contacts) approach and rate if nothing pushed
    matrix: np.ndarray  # (s n_contacts + 1, s n_contacts), the last row for the other side
    active: np.ndarray  # (n_contacts,) the contacts that are pressed


@inner()
def tabulate(bodies, grid, slot, h):
    """Coefficients of one collocation step of length h.

    ``free``: the rows A11 to M1 of `propagation.lane_table` up to each node; ``last``: displacement, then velocity at
    the end per unit force of each polynomial; ``inner``: approach and its rate at a node per force
    polynomial, summed over the modes.
    """
    omega, shape, nodes, powers = bodies.omega, bodies.shape, grid.nodes, grid.powers
    out_free, out_end, out_inner = grid.free[slot], grid.last[slot], grid.inner[slot]
    m = shape.shape[0]
    s = nodes.size - 1
    moments, work = grid.work[MOMENTS], grid.space
    out_inner[:] = 0.0
    for n in range(omega.size):
        silent = not any_of(shape[:, n])
        for a in range(s + 1):
            c = nodes[a]
            t = c * h
            a11, a12, a22 = mode_moments(omega[n], bodies.zeta[n], t, moments, work)
            out_free[a, A11, n] = a11
            out_free[a, A12, n] = a12
            out_free[a, A21, n] = -omega[n] * omega[n] * a12
            out_free[a, A22, n] = a22
            out_free[a, M1, n] = t * moments[1]
            for b in range(s):
                x = v = 0.0
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
    grid.known[slot] = 1.0


@inner(part=True, fastmath=LOOSE)
def free_approach(bodies, offset, grid, slot, h, out):
    """Approach and rate (2, s + 1, n_contacts) at a step's nodes if nothing pushed."""
    shape, bias, q, p, free = bodies.shape, bodies.bias, bodies.q, bodies.p, grid.free[slot]
    m, n_modes = shape.shape
    for a in range(free.shape[0]):
        t = grid.nodes[a] * h
        for i in range(m):
            d = v = 0.0
            for n in range(n_modes):
                u = shape[i, n]
                d += u * (free[a, A11, n] * q[n] + free[a, A12, n] * p[n] + t * free[a, M1, n] * bias[n])
                v += u * (free[a, A21, n] * q[n] + free[a, A22, n] * p[n] + free[a, A12, n] * bias[n])
            out[MOVED, a, i] = offset[i] + d
            out[SPED, a, i] = v


@inner()
def side_of(law, i, beyond):
    """The spring of contact i on the side of its corner where the step runs."""
    spring = spring_of(law, i)
    if beyond[i] or spring.corner == np.inf:
        return spring
    return simple(spring.stiffness, spring.exponent, spring.loss, spring.compliance)


@inner()
def sides(law, now, out_beyond):
    """Whether each contact begins its step beyond the corner of its law; one that yields only on its way in."""
    for i in range(now.shape[1]):
        spring = spring_of(law, i)
        bend = corner_approach(spring)
        d, rate, there = now[APPROACH, i], now[RATE, i], now[APPROACH, i] >= (1.0 - NEAR) * bend
        further = there and rate >= 0.0
        out_beyond[i] = there and rate > 0.0 if yields(law, i) else d > (1.0 + NEAR) * bend or further


@inner()
def lag_table(law, i, grid, h, out_lag):
    """What felt i remembers at nodes and end per ``x**a`` at a node, (s + 1, s), then what is left of before."""
    nodes, powers = grid.nodes, grid.powers
    s = nodes.size - 1
    for a in range(s + 1):
        x = nodes[a] * h / law["relaxation"][i]
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


@inner()
def add_memory(spring, room, inner, r, count):
    """Add what felt remembers to its equations, those of the active contact number r of ``count``."""
    matrix, active, f, x, i = room.matrix, room.active, room.nodes[FORCES], room.nodes[SQUEEZE], room.active[r]
    s, m = f.shape
    for a in range(s):
        row = a * count + r
        matrix[s * m, row] += spring.hard * memory_at(room.lag[i], a, x, f, i, spring)
        for e in range(s):
            _, fx, _ = smooth_force(x[e, i], 0.0, spring)
            share = room.lag[i, a, e] * fx * spring.hard / spring.stiffness
            for b in range(s):
                for c in range(count):
                    matrix[row, b * count + c] -= share * inner[MOVED, e, b, i, active[c]]


@inner()
def solve_collocation(contacts, room, inner):
    """Forces at the nodes by Newton's method from those in the room, and the compressions there; whether it settles."""
    law, matrix, out_f, out_x = contacts.law, room.matrix, room.nodes[FORCES], room.nodes[SQUEEZE]
    s, m = out_f.shape
    vector = matrix[s * m]
    active = room.active
    count = 0
    for i in range(m):
        for a in range(s):
            out_f[a, i] = max(0.0, out_f[a, i]) if contacts.pressed[i] else 0.0
        if contacts.pressed[i]:
            active[count] = i
            count += 1
    last = np.inf
    for iteration in range(40):
        scale = 0.0
        for a in range(s):
            for r in range(count):
                i = active[r]
                d = room.free[MOVED, a, i]
                v = room.free[SPED, a, i]
                for b in range(s):
                    for c in range(count):
                        j = active[c]
                        d -= inner[MOVED, a, b, i, j] * out_f[b, j]
                        v -= inner[SPED, a, b, i, j] * out_f[b, j]
                x = d - law["compliance"][i] * out_f[a, i]
                f, fx, fv = smooth_force(x, v, side_of(law, i, room.contacts[BEYOND]))
                out_x[a, i] = x
                row = a * count + r
                vector[row] = out_f[a, i] - f
                for b in range(s):
                    for c in range(count):
                        j = active[c]
                        matrix[row, b * count + c] = fx * inner[MOVED, a, b, i, j] + fv * inner[SPED, a, b, i, j]
                matrix[row, row] += 1.0 + fx * law["compliance"][i]
                scale = max(scale, abs(out_f[a, i]), abs(f))
        for r in range(count):
            spring = spring_of(law, active[r])
            if spring.relaxation > 0.0:
                add_memory(spring, room, inner, r, count)
        if not scale < OVERFLOW or not solve_linear(matrix, vector, s * count):
            return False
        change = 0.0
        for a in range(s):
            for r in range(count):
                out_f[a, active[r]] -= vector[a * count + r]
                change = max(change, abs(vector[a * count + r]))
        if change <= SOLVED * scale or (change <= STALLED * scale and change >= 0.5 * last):
            return True
        if iteration > 12 and not change < last:
            return False
        last = change
    return False


@inner(part=True, fastmath=LOOSE)
def collocation_end(bodies, contacts, f, free, last, h):
    """State at a collocation step's end, and approach and rate of each contact there."""
    shape, new_q, new_p = bodies.shape, bodies.free_q, bodies.free_p
    m, n_modes = shape.shape
    s = f.shape[0]
    restore(bodies.q, bodies.p, new_q, new_p)
    glide(free[s], h, bodies.bias, new_q, new_p)
    for i in range(m):
        for b in range(s):
            force = f[b, i]
            if force != 0.0:
                for n in range(n_modes):
                    new_q[n] -= shape[i, n] * force * last[b, n]
                    new_p[n] -= shape[i, n] * force * last[s + b, n]
    for i in range(m):
        contacts.end[i], contacts.rate[i] = approach_of(shape, contacts.offset, i, new_q, new_p)


@inner(part=True)
def collocate(bodies, contacts, grid, room, slot, h):
    """One collocation step: node forces, the end state, and the force polynomial's largest misfit at both ends.

    The misfit is weighed to a speed; infinity where the forces were not found.
    """
    law, y, rate, after, now = contacts.law, contacts.end, contacts.rate, contacts.after, contacts.now
    f, lag, inner = room.nodes[FORCES], room.lag, grid.inner[slot]
    s, m = f.shape
    free_approach(bodies, contacts.offset, grid, slot, h, room.free)
    for i in range(m):
        after[i] = law["memory"][i]
        if relaxes(law, i):
            if contacts.pressed[i] and law["memory"][i] >= 0.0:
                lag_table(law, i, grid, h, lag[i])
            else:
                after[i] = faded(law, i, h)
    if not solve_collocation(contacts, room, inner):
        return np.inf
    collocation_end(bodies, contacts, f, grid.free[slot], grid.last[slot], h)
    worst = 0.0
    for i in range(m):
        if not abs(y[i]) < OVERFLOW:
            return np.inf
        if contacts.pressed[i]:
            spring = side_of(law, i, room.contacts[BEYOND])
            f0, _, _ = smooth_force(max(0.0, point_at(now[APPROACH, i], spring).compression), now[RATE, i], spring)
            f1, _, _ = smooth_force(max(0.0, point_at(y[i], spring).compression), rate[i], spring)
            if spring.relaxation > 0.0:
                after[i] = memory_at(lag[i], s, room.nodes[SQUEEZE], f, i, spring)
                f0 -= spring.hard * spring.memory
                f1 -= spring.hard * after[i]
            for b in range(s):
                f0 -= grid.work[BEGINS, b] * f[b, i]
                f1 -= grid.work[ENDS, b] * f[b, i]
            quick = room.contacts[MOBILITY, i] * h  # [s/kg] if all modes answered at once
            weight = min(quick, inner[SPED, s - 1, s - 1, i, i] * 4.0 + 1e-3 * quick)
            worst = max(worst, max(abs(f0), abs(f1)) * weight)
    return worst


@inner()
def seen(contacts, room, special, level, h, limits):
    """How a step looks whose forces were found: WELL, LONG, or TURNED: other contacts pressed, or another side."""
    now, pressed = contacts.now, contacts.pressed
    found = WELL
    turned = False
    for i in range(contacts.end.size):
        d0, d1 = now[APPROACH, i], contacts.end[i]
        side = 1.0 if room.contacts[BEYOND, i] else -1.0
        if pressed[i] and d1 <= 0.0 and d0 == 0.0:
            if now[RATE, i] > limits.still and level < LEVELS - 2:
                found = LONG
            else:
                pressed[i] = False
                turned = True
        elif not pressed[i] and d0 == 0.0 and now[RATE, i] >= -limits.still and d1 > limits.depth:
            pressed[i] = True
            turned = True
        elif dipped(contacts, h, i) and (pressed[i] or level < LEVELS - 2):
            found = LONG
        if special and pressed[i] and strayed(contacts, h, i, side) == 2:
            found = LONG
    if special and not turned:
        for i in range(contacts.end.size):
            if pressed[i] and strayed(contacts, h, i, 1.0 if room.contacts[BEYOND, i] else -1.0) == 1:
                room.contacts[BEYOND, i] = not room.contacts[BEYOND, i]
                turned = True
    return TURNED if turned else found


@inner()
def record(contacts, course, grid, room, row, inner, h):
    """Write a step to a row of the steps, and add up its work."""
    s, m = room.nodes[FORCES].shape
    powers, f = grid.powers, room.nodes[FORCES]
    row[:] = 0.0
    row[START] = course.clock[TIME]
    row[LENGTH] = h
    for i in range(m):
        first = remember(contacts, i, row)
        pushed = contacts.force[i] > 0.0
        contacts.force[i] = 0.0
        if contacts.pressed[i]:
            row[first + CLOSED] = 1.0
            for k in range(s):
                for b in range(s):
                    row[first + PUSH + k] += powers[b, k] * f[b, i]
        for a in range(s):
            contacts.force[i] = max(contacts.force[i], f[a, i])
            v = room.free[SPED, a, i]
            for b in range(s):
                for j in range(m):
                    v -= inner[SPED, a, b, i, j] * f[b, j]
            weight = 0.0
            for k in range(s):
                weight += powers[a, k] / (k + 1.0)
            course.done[i] += weight * h * f[a, i] * v
        if pushed and contacts.pressed[i] and contacts.force[i] == 0.0 and contacts.law["loss"][i] > 0.0:
            course.counts[RELEASED] += 1  # it was let go within a step


@inner()
def look_ahead(contacts, grid, room, row, smooth):
    """First guess of the forces of the next step, from the polynomials of the last (``smooth``) or its last forces."""
    s, m = room.nodes[FORCES].shape
    for i in range(m):
        push = HEAD + (PUSH + s) * i + PUSH
        last = room.nodes[FORCES, s - 1, i]
        for a in range(s):
            ahead = 0.0
            if smooth and contacts.pressed[i]:
                position = 1.0 + grid.nodes[a]
                for k in range(s - 1, -1, -1):
                    ahead = ahead * position + row[push + k] if m == 1 else last
            room.nodes[FORCES, a, i] = ahead


@inner(part=True)
def judged(bodies, contacts, course, grid, room, misfit, h, limits):
    """Whether to take a step of length h; if not, the next is shorter, of other contacts, or of the length returned."""
    count, (special, _) = course.counts, special_of(contacts.law)
    coarse = misfit > grid.limit and count[LEVEL] < LEVELS - 2
    if misfit == np.inf and count[SEEKS] != NOTHING:
        count[SEEKS] = NOTHING
        count[LEVEL] += 1
        room.nodes[FORCES] = 0.0
        return False, 0.0
    if count[SEEKS] == NOTHING:
        look = LONG if misfit == np.inf else seen(contacts, room, special, count[LEVEL], h, limits)
        if look == LONG:
            count[LEVEL] += 1
            room.nodes[FORCES] = 0.0
        if look != WELL:
            return False, 0.0
    answer, guess = locate_event(bodies, contacts, course, limits, h, special, FALSE)
    if answer == TRY and count[TRIES] == 0 and coarse and 0.25 * h < guess < 0.9 * h:
        count[SEEKS] = NOTHING
        count[LEVEL] += 1
    if answer == LOST:
        count[LEVEL] += 1
    if answer == TAKEN and coarse and h > NEAR * grid.base:
        count[LEVEL] += 1
        while count[LEVEL] < LEVELS - 2 and grid.base * 0.5 ** count[LEVEL] > 0.6 * h:
            count[LEVEL] += 1
        return False, guess
    return answer == TAKEN, guess


@outer(allocates=False, seconds=10.0)
def follow_nodes(scene, grid, room, flights, limits, run, steps):
    """Step by step until the run ends, or until its record is FULL."""
    bodies, contacts, course = moving(scene, run), touching(run), course_of(run)
    if course.counts[BEGUN] == 0:
        begin(scene, bodies, contacts, course, grid.base)
    count = course.counts
    special, _ = special_of(contacts.law)
    quiet = not any_of(bodies.bias)
    guess = 0.0
    status = EXHAUSTED
    while count[STEPS] < limits.max_steps:
        if count[LEVEL] >= LEVELS:
            status = FAILED
            break
        if count[SEEKS] == NOTHING:
            status = over(course, limits, steps)
            if status != EXHAUSTED:
                break
            if not any_of(contacts.pressed):
                found = fly(bodies, contacts, course, flights, limits, steps[count[STEPS]])
                if found in (NEVER, SLOW, UNPROVED):
                    status = FINISHED if found == NEVER else FAILED if found == SLOW else EXHAUSTED
                    break
                if found == ONSET:
                    count[LEVEL] = min(LEVELS - 2, count[LEVEL] + 4)
                    room.nodes[FORCES] = 0.0
                continue
            if special and count[FRESH] == 1:
                freshen(contacts, TRUE)
                sides(contacts.law, contacts.now, room.contacts[BEYOND])
            count[FRESH] = 0
            count[FAILURES] += 1
            if count[FAILURES] > 64 * LEVELS or count[EVENTS] > 64 * EVENT_LIMIT:
                status = FAILED
                break
            h, slot = step_length(course, grid.base, limits.horizon)
        else:
            h, slot = guess, LEVELS
        if slot == LEVELS or grid.known[slot] == 0.0:
            tabulate(bodies, grid, slot, h)
        misfit = collocate(bodies, contacts, grid, room, slot, h)
        taken, guess = judged(bodies, contacts, course, grid, room, misfit, h, limits)
        if not taken:
            continue
        smooth = count[TARGET] < 0 and count[CORNERED] < 0
        row = steps[count[STEPS]]
        count[FAILURES] = 0
        record(contacts, course, grid, room, row, grid.inner[slot], h)
        look_ahead(contacts, grid, room, row, smooth)
        restore(bodies.free_q, bodies.free_p, bodies.q, bodies.p)
        take_over(contacts, course, limits, h, grid.base, special)
        if smooth and count[LEVEL] > 0 and misfit < grid.limit * 0.25 * 0.5 ** (grid.nodes.size - 1):
            count[LEVEL] -= 1
        if quiet and at_rest(bodies, contacts, course):
            status = SETTLED
            break
    if status != FULL:
        remembered(contacts)
    return status


def run_collocation(
    scene: KernelSystem, nodes: np.ndarray, powers: np.ndarray, base: float, limit: float, limits: Limits
) -> tuple[Any, ...]:
    """Follow bodies in contact with exponential Gauss collocation of the contact forces; the reference scheme.

    The forces are polynomials through s nodes per step that obey the law at the nodes. Onset and release are located,
    steps are halved where the polynomial misses the force at a step's ends (weighed to a speed) by more than ``limit``
    [m/s], and doubled where it does not. nodes, powers: see `NodeGrid`; the rest, and the results, as in
    `energy.run_energy`. The status is FAILED where the halvings are used up.
    """
    (m, n_modes), s, n_levels = scene.shape.shape, len(powers), LEVELS + 1
    free, last = np.empty((n_levels, s + 1, M1 + 1, n_modes)), np.empty((n_levels, 2 * s, n_modes))
    work = np.zeros((3, s + 1))
    work[BEGINS, :s], work[ENDS, :s] = powers[:, 0], powers.sum(axis=1)
    tables = free, last, np.empty((n_levels, 2, s, s, m, m)), np.zeros(n_levels), work, np.empty((2, s))
    grid = NodeGrid(nodes, powers, *tables, base, limit)
    room = CollocationRoom(
        np.zeros((2, m)), np.zeros((2, s, m)), np.zeros((m, s + 1, s + 1)), np.zeros((2, s + 1, m)),
        np.zeros((s * m + 1, s * m)), np.zeros(m, np.int64),
    )  # fmt: skip
    room.contacts[MOBILITY] = (scene.shape**2).sum(axis=1)
    flights = Flights(np.empty((GLIDES + 1, N_LANE, n_modes)), np.zeros(GLIDES + 1), base, 1e-6 * base)
    return followed(follow_nodes, (scene, grid, room, flights, limits), made_run(scene), HEAD + (PUSH + len(nodes)) * m)
