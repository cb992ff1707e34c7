"""A run in which deflections stretch the body, with energy kept as exactly as in `energy`.

Stretching adds to the strain energy of some modes q a quartic ``V = 1/4 sum_k (q' B_k q)**2``. As the contact forces,
its modal forces are linear over a step, with mean ``-g`` and slope ``-e``, while the modes move exactly. With ``m`` the
middle of both ends and ``d`` their difference, ``a = m' B m``, ``b = m' B d`` and ``c = d' B d``,

    e = sum (a + c/4) B d + 2 b B m,    g = sum (a + c/12) B m + b/6 B d + (a + c/4) B x + 2 (m' B x) B m,

where x is the mean of q over the step less m. ``e`` is the difference of the forces at both ends and symmetric in d and
x, and without x the work of ``g`` is the difference of V at both ends, so that all the work is just that for any x: the
proof of scheme A4 with the mean Hessian in place of its mean slope. Scheme A leaves out x and the slope. Both are
solved by iteration with the contacts' equations inside; a step in which that does not settle is halved.

Where the linear motion strains the plane, too, by rows l, it is ``V = 1/4 sum_k ((l q + q' B q)**2 - (l q)**2)``. The
additional part ``1/2 l q q' B q`` has a mean slope and a mean Hessian in closed form, too, with which

    e += l m B d + l d B m + b l,    g += l m B m + l d/12 B d + (a + c/12) l/2 + l m B x + l x B m + m' B x l.

A free flight takes the same steps. It is over for good once the rigid motion recedes and the energy of the swinging
modes, which never grows, cannot bring the surface back: |u' q|**2 <= 2 E u' S u. S is the inverse of the stiffness
without the squares of l q / 2**0.5, as those of l q + q' B q are not negative; on a flat plate it is 1 / omega**2.
"""

from typing import NamedTuple

import numpy as np

from .build import LOOSE, TRUE, ZERO, inner, outer
from .bundles import KernelSystem
from .exact import made_tables, predict, solve_step
from .frame import LEVELS, begin_run, course_of, made_run, moving, touching
from .propagation import any_of, commit, glide, lane_table, restore
from .rounding import ITERATIONS, OVERFLOW, SOLVED, STALLED

from .layout import (  # isort: skip
    A12, APPROACH, FLYING, FREE_END, FREE_MEAN, FREE_RATE, GAIN, HEAD, LENGTH, M1, M2, M3, PUSH, RATE, START,
    STEPS, TAKEOFF, TIME, WIDTH,
)  # fmt: skip


class Stretch(NamedTuple):
    """The forms B and rows l of the modes that stretch a body: `count` of them from `first` on."""

    forms: np.ndarray  # (n_forms, count, count)
    linear: np.ndarray  # (n_forms, count), or (0, count) if the linear motion does not strain the plane
    first: int


class StretchRoom(NamedTuple):
    """The same, and where a step is worked out."""

    forms: np.ndarray
    linear: np.ndarray
    first: int
    soft: np.ndarray  # (count, count) the inverse S
    free: np.ndarray  # (3, n_contacts) where the contacts would end without the stretching forces
    ends: np.ndarray  # (3, count) of the modes that stretch: mean of the free motion, end and mean
    bent: np.ndarray  # (3, n_forms, count) B times start, end and mean
    pull: np.ndarray  # (4, count) mean and slope of the stretching forces, and the same of the last iteration
    moved: np.ndarray  # (3, count) what these add to q, p and the mean of q
    hint: np.ndarray  # (count,) rate of these forces in the last step
    before: np.ndarray  # (2, n_modes) state when the present flight began
    apart: np.ndarray  # (2, n_contacts) approaches and rates then


@inner(arrays=np.matmul, fastmath=LOOSE)
def products_with_forms(forms, q, out):
    """Every form times a state, (n_forms, count)."""
    for k in range(forms.shape[0]):
        for i in range(q.size):
            total = 0.0
            for j in range(q.size):
                total += forms[k, i, j] * q[j]
            out[k, i] = total


@inner()
def linear_part(linear, k, q, first):
    """Row k of the linear part times some modes, zero without one."""
    total = 0.0
    if linear.shape[0] > 0:
        for i in range(linear.shape[1]):
            total += linear[k, i] * q[first + i]
    return total


@inner()
def stretching_energy(stretch, q):
    """The energy V [J] of a state."""
    forms, first = stretch.forms, stretch.first
    total = 0.0
    for k in range(forms.shape[0]):
        s = 0.0
        for i in range(forms.shape[1]):
            bent = 0.0
            for j in range(forms.shape[1]):
                bent += forms[k, i, j] * q[first + j]
            s += bent * q[first + i]
        total += 0.25 * s * (s + 2.0 * linear_part(stretch.linear, k, q, first))
    return total


@inner()
def stretching_forces(room, q, ramp):
    """Mean and slope of the stretching forces over a step, from both ends and the mean of its motion."""
    first, ends, bent, out = room.first, room.ends, room.bent, room.pull
    for i in range(out.shape[1]):
        out[0, i] = 0.0
        out[1, i] = 0.0
    for k in range(bent.shape[1]):
        a = b = c = d = 0.0
        for i in range(out.shape[1]):
            middle = 0.5 * (q[first + i] + ends[1, i])
            whole = 0.5 * (bent[0, k, i] + bent[1, k, i])
            more = bent[1, k, i] - bent[0, k, i]
            a += middle * whole
            b += middle * more
            c += (ends[1, i] - q[first + i]) * more
            d += whole * (ends[2, i] - middle)
        start = linear_part(room.linear, k, q, first)
        end = linear_part(room.linear, k, ends[1], 0)
        middle = 0.5 * (start + end)
        mean = linear_part(room.linear, k, ends[2], 0) - middle
        for i in range(out.shape[1]):
            whole = 0.5 * (bent[0, k, i] + bent[1, k, i])
            more = bent[1, k, i] - bent[0, k, i]
            out[0, i] -= (a + c / 12.0 + middle) * whole + (b / 6.0 + (end - start) / 12.0) * more
            if ramp:
                out[0, i] -= (a + 0.25 * c + middle) * (bent[2, k, i] - whole) + (2.0 * d + mean) * whole
                out[1, i] -= (a + 0.25 * c + middle) * more + (2.0 * b + end - start) * whole
        if room.linear.shape[0] > 0:
            for i in range(out.shape[1]):
                out[0, i] -= 0.5 * (a + c / 12.0) * room.linear[k, i]
                if ramp:
                    out[0, i] -= d * room.linear[k, i]
                    out[1, i] -= b * room.linear[k, i]


@inner()
def prepare(bodies, contacts, room, lanes, h):
    """Free motion of the contacts and mean of the modes that stretch, and the first guess of their forces."""
    first, forms, q = room.first, room.forms, bodies.q
    count = forms.shape[1]
    for row in range(3):
        for c in range(contacts.end.size):
            room.free[row, c] = contacts.free[row, c]
    for end in range(2):  # as if it stayed
        products_with_forms(forms, q[first : first + count], room.bent[end])
    for i in range(count):
        n = first + i
        drift = lanes[M1, n] * (bodies.p[n] + bodies.twice[n] * q[n]) + h * lanes[M2, n] * bodies.bias[n]
        room.ends[0, i] = lanes[A12, n] * q[n] / h + drift
        room.ends[1, i] = q[n]
    stretching_forces(room, q, ZERO)
    for i in range(count):
        room.pull[1, i] = h * room.hint[i]
        room.pull[0, i] += 0.5 * room.pull[1, i]


@inner()
def apply_pull(bodies, contacts, room, lanes, h):
    """What the stretching forces add to the end and the mean of the modes, and to the approaches."""
    first = room.first
    for i in range(room.pull.shape[1]):
        n = first + i
        slope = room.pull[1, i]
        start = room.pull[0, i] - 0.5 * slope
        room.moved[0, i] = h * (start * lanes[M1, n] + slope * lanes[M2, n])
        room.moved[1, i] = start * lanes[A12, n] + slope * lanes[M1, n]
        room.moved[2, i] = h * (room.pull[0, i] * lanes[M2, n] + slope * lanes[M3, n])
    for c in range(contacts.end.size):
        end = room.free[FREE_END, c]
        mean = room.free[FREE_MEAN, c]
        rate = room.free[FREE_RATE, c]
        for i in range(room.pull.shape[1]):
            u = bodies.shape[c, first + i]
            end += u * room.moved[0, i]
            mean += u * room.moved[2, i]
            rate += u * room.moved[1, i]
        contacts.free[FREE_END, c] = end
        contacts.free[FREE_MEAN, c] = mean
        contacts.free[FREE_RATE, c] = rate


@inner()
def attempt(bodies, contacts, room, tables, slot, h, blind, given):
    """Solve a step of contact and stretching forces together: whether it settled, and that of `solve_step`.

    The free motion is there. The contacts' forces are results, or ``given``. What stretching does is left in the room.
    """
    lanes, f, s = tables.lanes[slot], contacts.force, contacts.slope
    prepare(bodies, contacts, room, lanes, h)
    fine = 1
    best = np.inf
    settled = False
    for _ in range(ITERATIONS):
        apply_pull(bodies, contacts, room, lanes, h)
        if not given:
            fine = solve_step(contacts, tables, slot, h, blind)
        for i in range(room.pull.shape[1]):
            n = room.first + i
            end = bodies.free_q[n] + room.moved[0, i]
            mean = room.ends[0, i] + room.moved[2, i]
            for c in range(f.size):
                u = bodies.shape[c, n]
                end -= u * h * ((f[c] - 0.5 * s[c]) * lanes[M1, n] + s[c] * lanes[M2, n])
                mean -= u * h * (f[c] * lanes[M2, n] + s[c] * lanes[M3, n])
            room.ends[1, i] = end
            room.ends[2, i] = mean
            room.pull[2, i] = room.pull[0, i]
            room.pull[3, i] = room.pull[1, i]
        products_with_forms(room.forms, room.ends[1], room.bent[1])
        if tables.ramp:
            products_with_forms(room.forms, room.ends[2], room.bent[2])
        stretching_forces(room, bodies.q, tables.ramp)
        change = size = 0.0
        for i in range(room.pull.shape[1]):
            change += abs(room.pull[0, i] - room.pull[2, i]) + abs(room.pull[1, i] - room.pull[3, i])
            size += abs(room.pull[0, i]) + abs(room.pull[1, i])
        if not change < OVERFLOW:  # a sum keeps what is no number; a maximum may drop it
            break
        settled = change <= SOLVED * size or (change <= STALLED * size and change >= 0.5 * best)
        if settled:
            break
        best = min(best, change)
    if not settled:
        room.hint[:] = 0.0
    return settled, fine


@inner()
def finish(bodies, contacts, room, lanes, h):
    """Take over the state at the end of a step that settled, and the rate of its forces as a hint for the next."""
    restore(bodies.free_q, bodies.free_p, bodies.q, bodies.p)
    commit(bodies.shape, lanes, h, contacts.force, contacts.slope, bodies.q, bodies.p)
    for i in range(room.pull.shape[1]):
        bodies.q[room.first + i] += room.moved[0, i]
        bodies.p[room.first + i] += room.moved[1, i]
        room.hint[i] = room.pull[1, i] / h


def made_room(stretch: Stretch, omega: np.ndarray, n_contacts: int) -> StretchRoom:
    """Arrays for the work of a step, for all modes (n_modes,)."""
    (n_forms, count), n_modes, first = stretch.forms.shape[:2], len(omega), stretch.first
    own = omega[first : first + count]
    weight = np.divide(1.0, own, out=np.zeros(count), where=own > 0.0)
    share, turn = np.linalg.eigh(np.eye(count) - 0.5 * (stretch.linear * weight).T @ (stretch.linear * weight))
    half = weight[:, None] * turn / np.sqrt(np.maximum(share, 1e-6))  # of a shell's stiffness; less is lost in rounding
    return StretchRoom(
        stretch.forms, stretch.linear, first, half @ half.T, np.zeros((3, n_contacts)), np.zeros((3, count)),
        np.zeros((3, n_forms, count)), np.zeros((4, count)), np.zeros((3, count)), np.zeros(count),
        np.zeros((2, n_modes)), np.zeros((2, n_contacts)),
    )  # fmt: skip


@inner()
def stretches(room, n):
    """Whether a mode stretches the body."""
    return room.first <= n < room.first + room.forms.shape[1]


@inner()
def surely_apart(bodies, contacts, room, limits):
    """Whether no contact ever closes again: the rigid parts recede, and the energy left cannot bring them back."""
    q, p, first, soft = bodies.q, bodies.p, room.first, room.soft
    energy = stretching_energy(room, q)
    for n in range(q.size):
        w = bodies.omega[n]
        if stretches(room, n) and w > 0.0:
            energy += 0.5 * (p[n] ** 2 + (w * q[n]) ** 2) - bodies.bias[n] * q[n]
            for i in range(soft.shape[0]):
                energy += 0.5 * bodies.bias[n] * soft[n - first, i] * bodies.bias[first + i]
    for i in range(contacts.end.size):
        position = contacts.offset[i]
        rate = acceleration = reach = give = 0.0
        for n in range(q.size):
            u = bodies.shape[i, n]
            w = bodies.omega[n]
            if w == 0.0:
                position += u * q[n]
                rate += u * p[n]
                acceleration += u * bodies.bias[n]
            elif stretches(room, n):
                for j in range(soft.shape[0]):
                    give += u * soft[n - first, j] * bodies.shape[i, first + j]
                    position += u * soft[n - first, j] * bodies.bias[first + j]
            else:
                rest = bodies.bias[n] / (w * w)
                position += u * rest
                reach += abs(u) * np.sqrt((q[n] - rest) ** 2 + (p[n] / w) ** 2)
        reach += np.sqrt(2.0 * max(0.0, energy) * give)
        if rate > limits.still or acceleration > 0.0 or position + reach > limits.depth:
            return False
    return True


@inner()
def fly_in_steps(bodies, contacts, course, room, limits):
    """Whether a flight, which takes steps, too, never ends; all is then as it was when it began."""
    clock, count = course.clock, course.counts
    approach, rate = contacts.now[APPROACH], contacts.now[RATE]
    if any_of(contacts.pressed):
        count[FLYING] = -1
        return False
    if count[FLYING] < 0:
        restore(bodies.q, bodies.p, room.before[0], room.before[1])
        restore(approach, rate, room.apart[0], room.apart[1])
        count[FLYING] = count[STEPS]
        clock[TAKEOFF] = clock[TIME]
    if not surely_apart(bodies, contacts, room, limits):
        return False
    restore(room.before[0], room.before[1], bodies.q, bodies.p)
    restore(room.apart[0], room.apart[1], approach, rate)
    count[STEPS] = count[FLYING]
    clock[TIME] = clock[TAKEOFF]
    return True


@inner()
def overlooked(bodies, contacts, h, level):
    """1 if modes too fast for the step may close a contact that the cubic through its ends leaves open, else 0."""
    if level >= 8:
        return 0
    for i in range(contacts.end.size):
        if contacts.pressed[i]:
            continue
        start, end = contacts.now[APPROACH, i], contacts.end[i]
        ripple = 0.0
        for n in range(bodies.q.size):
            w = bodies.omega[n]
            if w * h > 1.0:
                ripple += abs(bodies.shape[i, n]) * np.sqrt(bodies.q[n] ** 2 + (bodies.p[n] / w) ** 2)
        if max(start, end) + ripple > 0.0 and ripple > 1e-3 * (abs(start) + abs(end)):
            return 1
    return 0


@inner()
def part_way(bodies, contacts, room, length, h, lanes, out_q, out_p):
    """Advance a state in place by a part of a step whose forces are known; ``lanes`` are of that length."""
    share, mean, slope = length / h, contacts.end, contacts.rate  # which are not used here
    for c in range(mean.size):
        slope[c] = share * contacts.slope[c]
        mean[c] = contacts.force[c] - 0.5 * (contacts.slope[c] - slope[c])
    glide(lanes, length, bodies.bias, out_q, out_p)
    commit(bodies.shape, lanes, length, mean, slope, out_q, out_p)
    for i in range(room.pull.shape[1]):
        n, start, bend = room.first + i, room.pull[0, i] - 0.5 * room.pull[1, i], share * room.pull[1, i]
        out_q[n] += length * (start * lanes[M1, n] + bend * lanes[M2, n])
        out_p[n] += start * lanes[A12, n] + bend * lanes[M1, n]


@inner()
def piece(contacts, steps, time, j, halved):
    """Length and end of a piece of step j from a time on, halved so often, and its forces; when the step ends."""
    n_steps, whole = steps.shape[0], steps[j, LENGTH]
    until = steps[j + 1, START] if j + 1 < n_steps else steps[j, START] + whole
    h = whole * 0.5**halved
    ends = time + h
    if halved == 0 or ends > until - 0.5 * h:
        ends = until
        h = min(whole, until - time)
    for i in range(contacts.end.size):
        first = HEAD + WIDTH * i
        gain = steps[j, first + GAIN] / whole
        contacts.slope[i] = gain * h
        contacts.force[i] = steps[j, first + PUSH] + gain * (time - steps[j, START] + 0.5 * h)
    return h, ends, until


@outer(allocates=False)
def follow_record(scene, run, room, tables, steps, start, times, out):
    """States at ascending times from a start on, a time and the step at hand: whether it failed, and those of the last.

    See `replay_stretched`.
    """
    bodies, contacts, course = moving(scene, run), touching(run), course_of(run)
    begin_run(scene, bodies, contacts, course, tables.base)
    time, j = start
    known = 0.0
    k = halved = 0
    while k < times.size and halved <= LEVELS:
        h = tables.base * 0.5**halved
        ends = time + h
        until = np.inf
        if j < steps.shape[0]:
            h, ends, until = piece(contacts, steps, time, j, halved)
        else:
            contacts.force[:] = 0.0
            contacts.slope[:] = 0.0
        if h != known:
            lane_table(bodies.omega, bodies.zeta, h, TRUE, tables.lanes[0])
            known = h
        predict(bodies, contacts, tables, ZERO, h)
        good, _ = attempt(bodies, contacts, room, tables, ZERO, h, TRUE, TRUE)
        if not good:
            halved += 1
            continue
        halved = max(0, halved - 1)
        while k < times.size and times[k] < ends:
            restore(bodies.q, bodies.p, out[0, k], out[1, k])
            length = times[k] - time
            if length > 0.0:
                lane_table(bodies.omega, bodies.zeta, length, TRUE, tables.lanes[1])
                part_way(bodies, contacts, room, length, h, tables.lanes[1], out[0, k], out[1, k])
            k += 1
        if k < times.size:
            finish(bodies, contacts, room, tables.lanes[0], h)
            time = ends
            if ends >= until:
                j += 1
    return halved > LEVELS, time, j


def replay_stretched(
    scene: KernelSystem, stretch: Stretch, steps: np.ndarray, ramp: int, base: float,
    start: tuple[float, int, np.ndarray], times: np.ndarray, out: np.ndarray,
) -> tuple[bool, float, int, np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """States (2, n_times, n_modes) at ascending times, by the contact forces of a record.

    The stretching forces are found again, step by step, and after the end of the run in steps of length base or less.
    Without the contacts, which helped them to settle, a recorded step may have to be split. Begins with the state of
    the scene at ``start``: a time, the step at hand and the last rate of the stretching forces. Returns whether it
    failed, and the same of the last time: time, step, rate and state.
    """
    m, n_modes = scene.shape.shape
    run, room = made_run(scene), made_room(stretch, scene.omega, m)
    room.hint[:] = start[2]
    failed, time, j = follow_record(scene, run, room, made_tables(n_modes, m, base, ramp), steps, start[:2], times, out)
    return failed, time, j, room.hint, run.q, run.p


@outer()
def energies_of_stretching(stretch, q):
    """Energy of stretching [J] of states (n_times, n_modes), (n_times,)."""
    result = np.empty(q.shape[0])
    for k in range(q.shape[0]):
        result[k] = stretching_energy(stretch, q[k])
    return result
