"""A run in which deflections stretch the body, with energy kept as exactly as in `energy`.

Stretching adds to the strain energy of some modes q a quartic ``V = 1/4 sum_k (q' B_k q)**2``. As the contact forces,
its modal forces are linear over a step, with mean ``-g`` and slope ``-e``, while the modes move exactly. With ``m`` the
middle of both ends and ``d`` their difference, ``a = m' B m``, ``b = m' B d`` and ``c = d' B d``,

    e = sum (a + c/4) B d + 2 b B m,    g = sum (a + c/12) B m + b/6 B d + (a + c/4) B x + 2 (m' B x) B m,

where x is the mean of q over the step less m. ``e`` is the difference of the forces at both ends and symmetric in d and
x, and without x the work of ``g`` is the difference of V at both ends, so that all the work is just that for any x: the
proof of scheme A4 with the mean Hessian in place of its mean slope. Scheme A leaves out x and the slope. Both are
solved by iteration with the contacts' equations inside; a step in which that does not settle is halved.

A free flight takes the same steps. It is over for good once the rigid motion recedes and the energy of the swinging
modes, which never grows, cannot bring the surface back: |u' q|**2 <= 2 E sum u**2 / omega**2.
"""

from typing import NamedTuple

import numpy as np

from .build import LOOSE, WHOLE, ZERO, inner, outer
from .energy import LEVELS, contact_sums, keep_in_mind, predict, record, solve_step
from .events import (
    EVENT_LIMIT,
    LOCATE_LIMIT,
    LOCATED,
    begin,
    dipped,
    enclose,
    first_corner,
    first_crossing,
    narrow,
    nearer,
    remembered,
    settle,
    strayed,
)
from .law import at, harden, meet, special_of, spring_of
from .layout import (
    A11,
    A12,
    A21,
    A22,
    APPROACH,
    COMPRESSION,
    ENERGY,
    FORCE,
    FREE_END,
    FREE_MEAN,
    FREE_RATE,
    HEAD,
    LENGTH,
    M1,
    M2,
    M3,
    MEMORY,
    PUSH,
    RATE,
    SIZE,
    START,
)
from .propagation import N_LANE, any_of, commit, lane_table, restore
from .record import EXHAUSTED, FAILED, FINISHED, HORIZON, IMPACTS, SETTLED, resized, total_energy

ITERATIONS = 60  # [-] of a step's stretching forces at most; each gains some two digits in steps that resolve them
SETTLES = 1e-15  # [-] of the stretching forces: their change in the last iteration
STALLS = 1e-11  # [-] a change that no longer falls below this is rounding
UNSEEN = 1.0  # [rad] modes that turn further in a step than this are not seen by the cubic through its ends
RIPPLE = 1e-3  # [-] of the way of a contact in a step: such modes may close it unseen where they move it farther
SHORTEST = 8  # [-] halvings of the step to see them
NOTHING, CROSSING, CORNER = 0, 1, 2  # what the length of a step is sought for


class Body(NamedTuple):
    """The modes of all bodies, and the forms B of those that stretch: `count` of them from `first` on."""

    omega: np.ndarray
    zeta: np.ndarray
    twice: np.ndarray  # 2 zeta omega
    shape: np.ndarray
    bias: np.ndarray
    forms: np.ndarray  # (n_forms, count, count)
    first: int


class Room(NamedTuple):
    """Where a step is worked out."""

    free_q: np.ndarray
    free_p: np.ndarray
    free_end: np.ndarray  # (3, n_contacts)
    end: np.ndarray  # (3, n_contacts) with the stretching forces, without those of the contacts
    ends: np.ndarray  # (3, count) of the modes that stretch: mean of the free motion, end and mean
    bent: np.ndarray  # (3, n_forms, count) B times start, end and mean
    pull: np.ndarray  # (4, count) mean and slope of the stretching forces, and the same of the last iteration
    moved: np.ndarray  # (3, count) what these add to q, p and the mean of q
    work: np.ndarray


def _bend(forms, q, out):
    """`bend`."""
    out[:] = forms @ q


@inner(arrays=_bend, fastmath=LOOSE)
def bend(forms, q, out):
    """Every form times a state, (n_forms, count)."""
    for k in range(forms.shape[0]):
        for i in range(q.size):
            total = 0.0
            for j in range(q.size):
                total += forms[k, i, j] * q[j]
            out[k, i] = total


@inner()
def stretching_energy(forms, first, q):
    """The energy V [J] of a state."""
    total = 0.0
    for k in range(forms.shape[0]):
        s = 0.0
        for i in range(forms.shape[1]):
            bent = 0.0
            for j in range(forms.shape[1]):
                bent += forms[k, i, j] * q[first + j]
            s += bent * q[first + i]
        total += 0.25 * s * s
    return total


@inner()
def pulls(first, q, ends, bent, ramp, out):
    """Mean and slope (2, count) of the stretching forces over a step, from both ends and the mean of its motion."""
    for i in range(out.shape[1]):
        out[0, i] = 0.0
        out[1, i] = 0.0
    for k in range(bent.shape[1]):
        a = 0.0
        b = 0.0
        c = 0.0
        d = 0.0
        for i in range(out.shape[1]):
            middle = 0.5 * (q[first + i] + ends[1, i])
            whole = 0.5 * (bent[0, k, i] + bent[1, k, i])
            more = bent[1, k, i] - bent[0, k, i]
            a += middle * whole
            b += middle * more
            c += (ends[1, i] - q[first + i]) * more
            d += whole * (ends[2, i] - middle)
        for i in range(out.shape[1]):
            whole = 0.5 * (bent[0, k, i] + bent[1, k, i])
            more = bent[1, k, i] - bent[0, k, i]
            out[0, i] -= (a + c / 12.0) * whole + b / 6.0 * more
            if ramp:
                out[0, i] -= (a + 0.25 * c) * (bent[2, k, i] - whole) + 2.0 * d * whole
                out[1, i] -= (a + 0.25 * c) * more + 2.0 * b * whole


@inner()
def prepare(body, room, lanes, h, q, p, hint):
    """Free mean of the modes that stretch and the first guess of their forces, from the rate ``hint`` of the last."""
    first, forms = body.first, body.forms
    count = forms.shape[1]
    bend(forms, q[first : first + count], room.bent[0])
    for i in range(count):
        n = first + i
        drift = lanes[M1, n] * (p[n] + body.twice[n] * q[n]) + h * lanes[M2, n] * body.bias[n]
        room.ends[0, i] = lanes[A12, n] * q[n] / h + drift
        room.pull[0, i] = 0.0
    for k in range(forms.shape[0]):
        s = 0.0
        for i in range(count):
            s += q[first + i] * room.bent[0, k, i]
        for i in range(count):
            room.pull[0, i] -= s * room.bent[0, k, i]
    for i in range(count):
        room.pull[1, i] = h * hint[i]
        room.pull[0, i] += 0.5 * room.pull[1, i]


@inner()
def apply_pull(body, room, lanes, h):
    """What the stretching forces add to the end and the mean of the modes, and to the approaches."""
    first = body.first
    for i in range(room.pull.shape[1]):
        n = first + i
        slope = room.pull[1, i]
        start = room.pull[0, i] - 0.5 * slope
        room.moved[0, i] = h * (start * lanes[M1, n] + slope * lanes[M2, n])
        room.moved[1, i] = start * lanes[A12, n] + slope * lanes[M1, n]
        room.moved[2, i] = h * (room.pull[0, i] * lanes[M2, n] + slope * lanes[M3, n])
    for c in range(body.shape.shape[0]):
        end = room.free_end[FREE_END, c]
        mean = room.free_end[FREE_MEAN, c]
        rate = room.free_end[FREE_RATE, c]
        for i in range(room.pull.shape[1]):
            u = body.shape[c, first + i]
            end += u * room.moved[0, i]
            mean += u * room.moved[2, i]
            rate += u * room.moved[1, i]
        room.end[FREE_END, c] = end
        room.end[FREE_MEAN, c] = mean
        room.end[FREE_RATE, c] = rate


@inner()
def attempt(body, room, tables, all_sums, slot, h, ramp, given, offset, law, now, q, p, hint, y, f, s, rate):
    """Solve a step of contact and stretching forces together: whether it settled, and that of `solve_step`.

    The contacts' forces f and s are results, or ``given``. What stretching does is left in the room.
    """
    lanes = tables[slot]
    first = body.first
    predict(body.shape, tables, slot, h, body.twice, offset, body.bias, q, p, room.free_q, room.free_p, room.free_end)
    prepare(body, room, lanes, h, q, p, hint)
    fine = 1
    best = np.inf
    for _ in range(ITERATIONS):
        apply_pull(body, room, lanes, h)
        if not given:
            fine = solve_step(ramp, h, all_sums, slot, law, now, room.end, room.work, y, f, s, rate)
        for i in range(room.pull.shape[1]):
            n = first + i
            end = room.free_q[n] + room.moved[0, i]
            mean = room.ends[0, i] + room.moved[2, i]
            for c in range(f.size):
                u = body.shape[c, n]
                end -= u * h * ((f[c] - 0.5 * s[c]) * lanes[M1, n] + s[c] * lanes[M2, n])
                mean -= u * h * (f[c] * lanes[M2, n] + s[c] * lanes[M3, n])
            room.ends[1, i] = end
            room.ends[2, i] = mean
            room.pull[2, i] = room.pull[0, i]
            room.pull[3, i] = room.pull[1, i]
        bend(body.forms, room.ends[1], room.bent[1])
        if ramp:
            bend(body.forms, room.ends[2], room.bent[2])
        pulls(first, q, room.ends, room.bent, ramp, room.pull)
        change = 0.0
        size = 0.0
        for i in range(room.pull.shape[1]):
            change += abs(room.pull[0, i] - room.pull[2, i]) + abs(room.pull[1, i] - room.pull[3, i])
            size += abs(room.pull[0, i]) + abs(room.pull[1, i])
        if not change < 1e300:  # a sum keeps what is no number; a maximum may drop it
            return False, fine
        if change <= SETTLES * size or (change <= STALLS * size and change >= 0.5 * best):
            return True, fine
        best = min(best, change)
    return False, fine


@inner()
def finish(body, room, lanes, h, f, s, q, p):
    """Take over the state at the end of a step that settled."""
    commit(body.shape, lanes, h, f, s, room.free_q, room.free_p, q, p)
    for i in range(room.pull.shape[1]):
        q[body.first + i] += room.moved[0, i]
        p[body.first + i] += room.moved[1, i]


@inner(allocates=True)
def made_room(n_modes, n_contacts, forms):
    """Arrays for the work of a step."""
    count = forms.shape[1]
    wide = max(4, 2 * n_contacts)
    return Room(
        np.empty(n_modes),
        np.empty(n_modes),
        np.empty((3, n_contacts)),
        np.empty((3, n_contacts)),
        np.empty((3, count)),
        np.zeros((3, forms.shape[0], count)),
        np.zeros((4, count)),
        np.zeros((3, count)),
        np.zeros((5, wide, wide)),
    )


@inner()
def stretches(body, n):
    """Whether a mode stretches the body."""
    return body.first <= n < body.first + body.forms.shape[1]


@inner()
def parted(body, offset, depth, still, q, p):
    """Whether no contact ever closes again: the rigid parts recede, and the energy left cannot bring them back."""
    energy = stretching_energy(body.forms, body.first, q)
    for n in range(q.size):
        if stretches(body, n):
            w = body.omega[n]
            energy += 0.5 * (p[n] ** 2 + (w * q[n] - body.bias[n] / w) ** 2)
    for i in range(offset.size):
        position = offset[i]
        rate = 0.0
        acceleration = 0.0
        reach = 0.0
        soft = 0.0
        for n in range(q.size):
            u = body.shape[i, n]
            w = body.omega[n]
            if w == 0.0:
                position += u * q[n]
                rate += u * p[n]
                acceleration += u * body.bias[n]
                continue
            rest = body.bias[n] / (w * w)
            position += u * rest
            if stretches(body, n):
                soft += (u / w) ** 2
            else:
                reach += abs(u) * np.sqrt((q[n] - rest) ** 2 + (p[n] / w) ** 2)
        reach += np.sqrt(2.0 * energy * soft)
        if rate > still or acceleration > 0.0 or position + reach > depth:
            return False
    return True


@inner()
def unseen(body, h, pressed, now, y, q, p):
    """Whether modes too fast for the step may close an open contact that the cubic through its ends leaves open."""
    for i in range(y.size):
        if pressed[i]:
            continue
        ripple = 0.0
        for n in range(q.size):
            w = body.omega[n]
            if w * h > UNSEEN:
                ripple += abs(body.shape[i, n]) * np.sqrt(q[n] ** 2 + (p[n] / w) ** 2)
        if max(now[APPROACH, i], y[i]) + ripple > 0.0 and ripple > RIPPLE * (abs(now[APPROACH, i]) + abs(y[i])):
            return True
    return False


@inner()
def leave_open(now, pressed, y, depth, f, s):
    """Leave out the force of an open contact that ends a step just at its onset, or the step would count as closed."""
    for i in range(y.size):
        if not pressed[i] and y[i] <= max(depth, LOCATED * (abs(now[APPROACH, i]) + abs(y[i]))):
            f[i] = 0.0
            s[i] = 0.0


@inner()
def ready(law, now, offset, fresh):
    """Bring what the contacts remember up to a fresh state, and the points at which they stand."""
    for i in range(offset.size):
        if fresh:
            meet(law, i, now[APPROACH, i], now[RATE, i])
            deeper = harden(law, i, now[APPROACH, i])
            offset[i] -= deeper
            now[APPROACH, i] -= deeper
        point = at(now[APPROACH, i], spring_of(law, i))
        now[COMPRESSION, i] = point.compression
        now[FORCE, i] = point.force
        now[ENERGY, i] = point.energy


@inner()
def too_long(law, special, now, pressed, y, rate, after, h, level, still):
    """By how many halvings a step must be shorter, because contacts opened and closed again within it."""
    shorter = 0
    for i in range(y.size):
        if pressed[i] and y[i] <= 0.0 and now[APPROACH, i] == 0.0:
            if now[RATE, i] > still:
                shorter = max(shorter, 3 if level == 0 else 1)
        elif dipped(now, pressed, y, rate, h, i):
            shorter = max(shorter, 1)
        if special and pressed[i] and strayed(law, now, y, rate, after, h, i, 1.0 if now[RATE, i] > 0.0 else -1.0) == 2:
            shorter = max(shorter, 1)
    return shorter


@outer()
def run_stretched(
    omega, zeta, shape, start, bias, laws, start_q, start_p, forms, first, ramp, base, depth, still, horizon,
    max_impacts, max_steps
):  # fmt: skip
    """Follow bodies in contact of which one stretches, with schemes A (ramp 0) or A4 (ramp 1).

    Parameters and results as in `energy.run_energy`, with flights in steps, too; forms (n_forms, count, count): the
    forms B of the modes from ``first`` on. n_fallback counts the steps in which a contact fell back to scheme A.
    """
    m, n_modes = shape.shape
    offset = start.copy()
    law = laws.copy()
    q = start_q.copy()
    p = start_p.copy()
    twice = np.empty(n_modes)
    for n in range(n_modes):
        twice[n] = 2.0 * zeta[n] * omega[n]
    body = Body(omega, zeta, twice, shape, bias, forms, first)
    room = made_room(n_modes, m, forms)
    hint = np.zeros(forms.shape[1])
    tables = np.empty((LEVELS + 1, N_LANE, n_modes))
    all_sums = np.empty((LEVELS + 1, 6, m, m))
    known = np.zeros(LEVELS + 1)
    odd = known.size - 1
    now = np.zeros((6, m))
    y = np.empty(m)
    f = np.zeros(m)
    s = np.zeros(m)
    rate = np.empty(m)
    after = np.zeros(m)
    pressed = np.zeros(m, np.bool_)
    bracket = np.empty(6)
    done = np.zeros(m)
    steps = np.zeros((64, HEAD + 6 * m))
    kept_q = q.copy()
    kept_p = p.copy()
    n_steps = ZERO
    n_kept = ZERO
    n_fallback = 0
    n_blind = 0
    n_released = 0
    level = 0
    least = 0  # halvings without which the stretching forces do not settle
    events = 0
    reset = 0.0
    which = 0
    corner = -1
    target = -1
    seeking = NOTHING
    tries = 0
    guess = 0.0
    h = base
    slot = 0
    blind = False
    fresh = True
    flying = False
    pause = 0.0
    respite = base
    time = 0.0
    status = EXHAUSTED
    quiet = not any_of(bias)
    special, cornered = special_of(law)
    begin(shape, offset, q, p, now, pressed)
    kept_now = now.copy()
    kept_time = time
    start_energy = total_energy(omega, bias, law, q, p, now) + stretching_energy(forms, first, q)
    while n_steps < max_steps:
        if seeking == NOTHING:
            if time >= horizon:
                status = HORIZON
                break
            if 0 < max_impacts <= n_released:
                status = IMPACTS
                break
            if n_steps + 1 >= steps.shape[0]:
                steps = resized(steps, n_steps, 2 * steps.shape[0])
            apart = not any_of(pressed)
            if apart and not flying:
                restore(q, p, kept_q, kept_p)
                restore(now[APPROACH], now[RATE], kept_now[APPROACH], kept_now[RATE])
                n_kept = n_steps
                kept_time = time
            flying = apart
            if apart and parted(body, offset, depth, still, q, p):
                status = FINISHED
                restore(kept_q, kept_p, q, p)
                restore(kept_now[APPROACH], kept_now[RATE], now[APPROACH], now[RATE])
                n_steps = n_kept
                time = kept_time
                break
            if events > EVENT_LIMIT:
                pause = max(time + respite, np.nextafter(time, np.inf))
                respite *= 2.0
                events = 0
            blind = time < pause
            level = least if blind else max(level, least)
            h = base * 0.5**level
            slot = level
            if h > horizon - time:
                h = horizon - time
                slot = odd
            ready(law, now, offset, special and fresh)
            fresh = False
        else:
            h = guess
            slot = odd
        if slot == odd or known[slot] == 0.0:
            lane_table(omega, zeta, h, WHOLE, tables[slot])
            contact_sums(shape, tables[slot], h, all_sums[slot])
            known[slot] = 1.0
        good, fine = attempt(
            body, room, tables, all_sums, slot, h, ramp, False, offset, law, now, q, p, hint, y, f, s, rate
        )
        if not good:
            seeking = NOTHING
            least = level + 1
            hint[:] = 0.0
            if least >= LEVELS:
                status = FAILED
                break
            continue
        if special:
            keep_in_mind(h, law, now, y, f, s, rate, ramp and fine, after)
        if seeking == NOTHING:
            target = -1
            if not blind:
                shorter = too_long(law, special, now, pressed, y, rate, after, h, level, still)
                if shorter == 0 and level < SHORTEST and unseen(body, h, pressed, now, y, q, p):
                    shorter = 1
                if shorter > 0:
                    level += shorter
                    if level >= LEVELS:
                        level = least
                        events = EVENT_LIMIT + 1
                    continue
                target, guess = first_crossing(now, pressed, y, rate, h, depth, still)
            if target >= 0:
                enclose(now, y, rate, h, target, bracket)
                seeking = CROSSING
                tries = 0
                continue
        if seeking == CROSSING:
            target, guess = narrow(now, pressed, y, rate, h, depth, still, target, bracket)
            tries += 1
            if guess != 0.0 and tries < LOCATE_LIMIT:
                continue
            if not abs(y[target]) <= 1e-9 * bracket[SIZE]:
                if h < 1e-3 * base:
                    seeking = NOTHING
                    events = EVENT_LIMIT + 1
                    continue
                target = -1
                blind = True
        if seeking == CORNER:
            guess = nearer(law, corner, which, h, y[corner], rate[corner], after[corner], bracket)
            tries += 1
            if guess != 0.0 and tries < LOCATE_LIMIT:
                continue
        else:
            corner = -1
            if cornered and not blind:
                corner, which, guess = first_corner(now, law, y, rate, after, h, True, bracket)
            if corner >= 0 and which == 4:
                law[corner, MEMORY] = abs(law[corner, MEMORY])
                seeking = NOTHING
                continue
            if corner >= 0:
                target = -1
                seeking = CORNER
                tries = 0
                continue
        seeking = NOTHING
        total = 0.0
        for i in range(m):
            total += abs(y[i]) + abs(rate[i]) + f[i]
        if not total < 1e300:
            status = FAILED
            break
        leave_open(now, pressed, y, depth, f, s)
        record(steps[n_steps], law, time, h, blind, all_sums[slot], now, pressed, room.end, y, f, s, done)
        n_steps += 1
        fresh = True
        if special:
            for i in range(m):
                law[i, MEMORY] = after[i]
        if ramp and fine == 0 and any_of(f):
            n_fallback += 1
        if blind:
            n_blind += 1
        time += h
        if corner >= 0 and which == 3 and law[corner, MEMORY] > 0.0:
            n_released += 1
        n_released += settle(law, now, pressed, y, rate, target, depth, still)
        if target >= 0:
            events += 1
        elif corner < 0:
            level = max(0, level - 1)
            least = max(0, least - 1)
        for i in range(hint.size):
            hint[i] = room.pull[1, i] / h
        finish(body, room, tables[slot], h, f, s, q, p)
        if time - reset > base:
            reset = time
            events = 0
        if quiet and n_steps % 512 == 0 and total_energy(omega, bias, law, q, p, now) <= 1e-24 * start_energy:
            status = SETTLED
            break
    remembered(law, now)
    return resized(steps, n_steps, n_steps), q, p, now, done, time, status, n_fallback, n_blind


@inner()
def part_way(body, room, length, h, lanes, f, s, out_q, out_p):
    """Advance a state in place by a part of a step whose forces are known; ``lanes`` are of that length."""
    for n in range(out_q.size):
        q0 = out_q[n]
        p0 = out_p[n]
        start = 0.0
        slope = 0.0
        if stretches(body, n):
            i = n - body.first
            start = room.pull[0, i] - 0.5 * room.pull[1, i]
            slope = room.pull[1, i] * length / h
        start += body.bias[n]
        for c in range(f.size):
            start -= body.shape[c, n] * (f[c] - 0.5 * s[c])
            slope -= body.shape[c, n] * s[c] * length / h
        out_q[n] = lanes[A11, n] * q0 + lanes[A12, n] * p0 + length * (start * lanes[M1, n] + slope * lanes[M2, n])
        out_p[n] = lanes[A21, n] * q0 + lanes[A22, n] * p0 + start * lanes[A12, n] + slope * lanes[M1, n]


@outer()
def replay_stretched(
    omega, zeta, shape, bias, steps, forms, first, ramp, base, time, j, out_state, out_hint, times, out_q, out_p
):
    """States (n_times, n_modes) at ascending times, from that at the start of step j and the recorded contact forces.

    The stretching forces are found again, step by step, and after the end of the run in steps of length base or less.
    Without the contacts, which helped them to settle, a recorded step may have to be split. ``out_state`` (2, n_modes)
    and ``out_hint`` (count,) are where to start, and become those of the step that holds the last time. Returns whether
    it failed, and start and number of that step.
    """
    m, n_modes = shape.shape
    n_steps = steps.shape[0]
    twice = np.empty(n_modes)
    for n in range(n_modes):
        twice[n] = 2.0 * zeta[n] * omega[n]
    body = Body(omega, zeta, twice, shape, bias, forms, first)
    room = made_room(n_modes, m, forms)
    tables = np.empty((2, N_LANE, n_modes))
    all_sums = np.zeros((2, 6, m, m))
    hint = out_hint
    offset = np.zeros(m)
    now = np.zeros((6, m))
    law = np.zeros((m, 4))
    nothing = np.zeros(m)
    f = np.zeros(m)
    s = np.zeros(m)
    q = out_state[0]
    p = out_state[1]
    known = 0.0
    k = 0
    halved = 0
    failed = 0
    while k < times.size:
        flight = j >= n_steps
        if flight:
            h = base * 0.5**halved
            ends = time + h
            f[:] = 0.0
            s[:] = 0.0
        else:
            whole = steps[j, LENGTH]
            until = steps[j + 1, START] if j + 1 < n_steps else steps[j, START] + whole
            h = whole * 0.5**halved
            ends = time + h
            if halved == 0 or ends > until - 0.5 * h:
                ends = until
                h = min(whole, until - time)
            for i in range(m):
                s[i] = steps[j, HEAD + PUSH + 1 + 5 * i] * h / whole
                f[i] = (
                    steps[j, HEAD + PUSH + 5 * i]
                    + steps[j, HEAD + PUSH + 1 + 5 * i] * (time - steps[j, START] + 0.5 * h) / whole
                )
        if h != known:
            lane_table(omega, zeta, h, WHOLE, tables[0])
            known = h
        good, _ = attempt(
            body, room, tables, all_sums, 0, h, ramp, True, offset, law, now, q, p, hint, nothing, f, s, nothing
        )
        if not good:
            if halved >= LEVELS:
                failed = 1
                break
            halved += 1
            hint[:] = 0.0
            continue
        halved = max(0, halved - 1)
        while k < times.size and times[k] < ends:
            restore(q, p, out_q[k], out_p[k])
            length = times[k] - time
            if length > 0.0:
                lane_table(omega, zeta, length, WHOLE, tables[1])
                part_way(body, room, length, h, tables[1], f, s, out_q[k], out_p[k])
            k += 1
        if k >= times.size:
            break
        for i in range(hint.size):
            hint[i] = room.pull[1, i] / h
        finish(body, room, tables[0], h, f, s, q, p)
        time = ends
        if not flight and ends >= until:
            j += 1
    return failed, time, j


@outer()
def energies_of_stretching(forms, first, q):
    """Energy of stretching [J] of states (n_times, n_modes), (n_times,)."""
    result = np.empty(q.shape[0])
    for k in range(q.shape[0]):
        result[k] = stretching_energy(forms, first, q[k])
    return result
