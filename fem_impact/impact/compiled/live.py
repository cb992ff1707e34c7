"""A body that is played: strokes at any frame of a sound, contacts by scheme A4, ringing by recursion, block by block.

All modes are in one list: those of each stick, slot after slot, then those of the body. Between frames the state goes
ahead by exact steps ``period / 2**level``, whose tables are made beforehand. In contact a step is no longer than that
of ``limits.contact``; a step in which a contact opens or closes is halved, until it ends there to ``limits.closing`` or
``limits.opening``. In flight a step is as long as `level_of_flight` allows, but never below ``limits.flight``.
Here nothing allocates: what does could not be compiled as part of `follow`.
"""

from typing import NamedTuple

import numpy as np

from .build import ONE, TRUE, inner, outer
from .bundles import Bodies, Contacts, Tables
from .events import has_dipped
from .exact import contact_sums, freshen, keep_in_mind, predict, solve_step
from .flight import LASTING, approach_of, carry_rigid, motion_bounds, safe_wait, surely_recedes
from .law import point_at, special_of, spring_of
from .laws.felt import rest_of
from .layout import APPROACH, FREE_END, FREE_RATE, RATE
from .propagation import any_of, commit, glide, product, restore
from .rounding import OVERFLOW

TICKS = 1 << 20  # [-] ticks of a frame: the shortest step is one, 2e-11 s at 48 kHz
LEVELS = TICKS.bit_length()  # lengths of steps, from a frame to a tick
N_ON, N_LOOKS, FRAME, FORCED = range(4)  # places of `PlayState.place`
STRUCK, STOLEN, TOUCHED, TRACED, STEPS, LOST, COUNTERS = range(7)  # what is counted; how many counters


class PlayedBody(NamedTuple):
    """The modes of all sticks and of the body, and what is known of them beforehand."""

    omega: np.ndarray  # (n_modes,) [rad/s]
    zeta: np.ndarray  # (n_modes,) [-]
    twice: np.ndarray  # (n_modes,) [rad/s] 2 zeta omega
    tables: np.ndarray  # (LEVELS, N_LANE, n_modes) of the steps
    listen: np.ndarray  # (n_modes,) factor of each velocity in the sound


class Pads(NamedTuple):
    """The points that can be struck, and the stick."""

    rows: np.ndarray  # (n_pads, n_body) signed shapes of the body
    own: np.ndarray  # (n_pads, n_own) those of a stick, with what stands for the modes left out
    laws: np.ndarray  # (n_pads,) of `law.LAW`
    offsets: np.ndarray  # (n_pads,) [m] approach at zero state
    motion: np.ndarray  # (n_own,) modal velocities of a stick per unit speed
    push: np.ndarray  # (n_own,) constant modal forces on a stick


class PlayLimits(NamedTuple):
    """Levels of steps, and when contacts end."""

    contact: int  # longest step while something touches
    closing: int  # shortest step that ends at an onset
    opening: int  # shortest step that ends at a release
    flight: int  # shortest step in flight
    lasts: int  # frames after which a stick is lifted, as soon as it does not touch
    period: float  # [s] of a frame
    depth: float  # [m] approaches that are rounding
    still: float  # [m/s] speeds that are rounding


class PlayStrokes(NamedTuple):
    """What is struck during a block, in the order of time."""

    when: np.ndarray  # (n,) frames of the block
    pad: np.ndarray  # (n,)
    speed: np.ndarray  # (n,) [m/s]


class PlayState(NamedTuple):
    """What moves, for up to n_sticks sticks on the body; the first ``m`` rows are in use."""

    q: np.ndarray  # (n_modes,)
    p: np.ndarray  # (n_modes,)
    free_q: np.ndarray  # (n_modes,)
    free_p: np.ndarray  # (n_modes,)
    bias: np.ndarray  # (n_modes,)
    rows: np.ndarray  # (n_sticks, n_modes)
    law: np.ndarray  # (n_sticks,) of `law.LAW`
    offset: np.ndarray  # (n_sticks,)
    slot: np.ndarray  # (n_sticks,) which part of the modes is this stick's
    pad: np.ndarray  # (n_sticks,) which point it strikes
    until: np.ndarray  # (n_sticks,) frame when it is lifted
    pressed: np.ndarray  # (n_sticks,)
    now: np.ndarray  # (6, n_sticks) see `schemes.point_of`
    end: np.ndarray  # (3, n_sticks)
    found: np.ndarray  # (5, n_sticks) of a step: approach, rate, mean force, slope, memory
    bounds: np.ndarray  # (n_sticks, 6) see `flight.motion_bounds`
    sums: np.ndarray  # (LEVELS, 6, n_sticks, n_sticks)
    known: np.ndarray  # (LEVELS,) whether those are of the present sticks
    work: np.ndarray  # (5, n, n)
    place: np.ndarray  # (4,) sticks on the body, looks since the bounds were drawn, frames so far, whether forces act
    counted: np.ndarray  # (COUNTERS,)
    trace: np.ndarray  # (n, 6) [s], [s], [-], [N], [m], [N]: end of a step in contact, length, pad, mean, approach, end


@inner()
def take_off(pads, state, i):
    """Lift stick i, and close the gap in the list."""
    n_own = pads.motion.size
    first = state.slot[i] * n_own
    for n in range(first, first + n_own):
        state.q[n] = 0.0
        state.p[n] = 0.0
        state.bias[n] = 0.0
    m = state.place[N_ON] - 1
    for k in range(i, m):
        for n in range(state.q.size):
            state.rows[k, n] = state.rows[k + 1, n]
        state.law[k] = state.law[k + 1]
        for n in range(state.now.shape[0]):
            state.now[n, k] = state.now[n, k + 1]
        state.offset[k] = state.offset[k + 1]
        state.slot[k] = state.slot[k + 1]
        state.pad[k] = state.pad[k + 1]
        state.until[k] = state.until[k + 1]
        state.pressed[k] = state.pressed[k + 1]
    note_sticks(state, m)


@inner()
def note_sticks(state, m):
    """Note that there are other sticks on the body than before, m now."""
    state.place[N_ON] = m
    state.place[FORCED] = 1
    for level in range(LEVELS):
        state.known[level] = 0


@inner()
def put_on(body, pads, limits, state, pad, speed):
    """A stick arrives at the surface of a point, wherever that is, instead of another if all are in use.

    Before the first one, a free body comes to rest as a whole: what it lies on holds it.
    """
    n_own = pads.motion.size
    n_sticks = state.slot.size
    base = n_sticks * n_own
    if state.place[N_ON] == n_sticks:
        gone = 0
        for i in range(n_sticks - 1, -1, -1):
            if not state.pressed[i]:
                gone = i
        take_off(pads, state, gone)
        state.counted[STOLEN] += 1
    m = state.place[N_ON]
    if m == 0:
        for n in range(base, state.q.size):
            if body.omega[n] == 0.0:
                state.q[n] = 0.0
                state.p[n] = 0.0
    slot = 0
    for _ in range(m):
        for i in range(m):
            if state.slot[i] == slot:
                slot += 1
    surface = 0.0
    for n in range(base):
        state.rows[m, n] = 0.0
    for n in range(pads.rows.shape[1]):
        state.rows[m, base + n] = pads.rows[pad, n]
        surface -= pads.rows[pad, n] * state.q[base + n]
    for n in range(n_own):
        k = slot * n_own + n
        state.rows[m, k] = pads.own[pad, n]
        state.q[k] = surface * pads.motion[n]
        state.p[k] = speed * pads.motion[n]
        state.bias[k] = pads.push[n]
    state.law[m] = pads.laws[pad]
    state.offset[m] = pads.offsets[pad]
    state.slot[m] = slot
    state.pad[m] = pad
    state.until[m] = state.place[FRAME] + limits.lasts
    _, state.now[RATE, m] = approach_of(state.rows, state.offset, m, state.q, state.p)
    state.now[APPROACH, m] = state.offset[m]
    state.pressed[m] = state.offset[m] >= 0.0 and state.now[RATE, m] > 0.0
    state.counted[STRUCK] += 1
    note_sticks(state, m + 1)


@inner()
def moving(body, state):
    """All modes and how they move."""
    return Bodies(
        body.omega, body.zeta, body.twice, state.rows[: state.place[N_ON]], state.bias,
        state.q, state.p, state.free_q, state.free_p,
    )  # fmt: skip


@inner()
def touched(state):
    """The contacts of the sticks on the body."""
    m = state.place[N_ON]
    return Contacts(
        state.law[:m], state.offset[:m], state.now[:, :m], state.pressed[:m], state.end[:, :m],
        state.found[0, :m], state.found[1, :m], state.found[2, :m], state.found[3, :m], state.found[4, :m],
    )  # fmt: skip


@inner()
def level_of_flight(body, pads, limits, state, level):
    """Level of a step, no longer than the given, in which surely nothing touches; -1 if a stick left for good."""
    m = state.place[N_ON]
    bodies = moving(body, state)
    if state.place[FORCED] == 1 or state.place[N_LOOKS] >= 64:  # as they loosen
        state.place[N_LOOKS] = 0
        state.place[FORCED] = 0
        for i in range(m - 1, -1, -1):
            motion_bounds(bodies, state.offset, i, state.bounds)
            if surely_recedes(state.bounds, i, limits, LASTING + 1):
                take_off(pads, state, i)
                return -1
    state.place[N_LOOKS] += 1
    wait = np.inf
    for i in range(m):
        wait = min(wait, safe_wait(state.bounds, i, min(state.now[APPROACH, i], 0.0), state.now[RATE, i]))
    while level < limits.flight and limits.period * 0.5**level > wait:
        level += 1
    return level


@inner()
def take_over_flight(state, h, end):
    """Take over a step in which nothing touched."""
    restore(state.free_q, state.free_p, state.q, state.p)
    for i in range(state.place[N_ON]):
        state.now[APPROACH, i] = end[FREE_END, i]
        state.now[RATE, i] = end[FREE_RATE, i]
        carry_rigid(state.bounds, i, h)
        rest_of(state.law, i, h)


@inner()
def note_forces(state, time, h, force):
    """Write a step of the contacts that push to the trace."""
    for i in range(state.place[N_ON]):
        if force[i] > 0.0 and state.counted[TRACED] < state.trace.shape[0]:
            row = state.trace[state.counted[TRACED]]
            spring = spring_of(state.law, i)
            pushes = point_at(state.now[APPROACH, i], spring).force * (1.0 + spring.loss * state.now[RATE, i])
            row[0] = time
            row[1] = h
            row[2] = state.pad[i]
            row[3] = force[i]
            row[4] = state.now[APPROACH, i]
            row[5] = max(0.0, pushes - spring.hard * spring.memory)  # of felt, what it remembers
            state.counted[TRACED] += 1


@inner()
def step(body, limits, state, level, time):
    """Go ahead by a step of at most that level; its level."""
    bodies, contacts = moving(body, state), touched(state)
    tables = Tables(body.tables, state.sums, state.known, state.work, limits.period, ONE)
    special, _ = special_of(contacts.law)
    touching = any_of(contacts.pressed)
    fresh = special
    while True:
        h = limits.period * 0.5**level
        predict(bodies, contacts, tables, level, h)
        if not touching:
            meets = False
            for i in range(contacts.end.size):
                meets = meets or contacts.free[FREE_END, i] > 0.0
            if not meets:
                take_over_flight(state, h, contacts.free)
                return level
            if level < limits.closing:
                level += 1
                continue
        if state.known[level] == 0:
            contact_sums(bodies.shape, body.tables[level], h, state.sums[level])
            state.known[level] = 1
        freshen(contacts, fresh)
        fresh = False
        fine = solve_step(contacts, tables, level, h, TRUE)
        if special:
            keep_in_mind(contacts, h, fine)
        shorter = False
        for i in range(contacts.end.size):
            finest = limits.opening if contacts.pressed[i] else limits.closing
            ends = (contacts.end[i] > 0.0) != contacts.pressed[i]
            shorter = shorter or (ends and level < finest) or (level < limits.opening and has_dipped(contacts, h, i))
        if not shorter:
            break
        level += 1
    restore(bodies.free_q, bodies.free_p, bodies.q, bodies.p)
    commit(bodies.shape, body.tables[level], h, contacts.force, contacts.slope, bodies.q, bodies.p)
    for i in range(contacts.end.size):
        contacts.now[APPROACH, i] = contacts.end[i]
        contacts.now[RATE, i] = contacts.rate[i]
        if special:
            contacts.law["memory"][i] = contacts.after[i]
        if contacts.pressed[i] and contacts.end[i] <= 0.0:
            state.counted[TOUCHED] += 1
        contacts.pressed[i] = contacts.end[i] > 0.0
    state.place[FORCED] = 1
    state.counted[STEPS] += 1
    note_forces(state, time + h, h, contacts.force)
    return level


@inner()
def tidy_modes(body, pads, state):
    """Put modes at rest that hardly move; if a number is no longer one, lift all sticks and still the body."""
    lost = False
    for n in range(state.q.size):
        size = abs(state.p[n]) + body.omega[n] * abs(state.q[n])
        lost = lost or not size < OVERFLOW
        if size < 1e-140 and body.omega[n] > 0.0:  # [J**0.5] before its numbers get slow to calculate with
            state.q[n] = 0.0
            state.p[n] = 0.0
    if lost:
        while state.place[N_ON] > 0:
            take_off(pads, state, 0)
        for n in range(state.q.size):
            state.q[n] = 0.0
            state.p[n] = 0.0
        state.counted[LOST] += 1


@outer()
def play_block(body, pads, limits, state, strokes, gain, out):
    """Fill a block of sound (n_frames,), and leave the state at its end; ``gain`` multiplies all of it."""
    event = 0
    for k in range(out.size):
        while event < strokes.when.size and strokes.when[event] <= k:
            put_on(body, pads, limits, state, strokes.pad[event], strokes.speed[event])
            event += 1
        out[k] = gain * product(body.listen, state.p)
        for i in range(state.place[N_ON] - 1, -1, -1):
            if state.place[FRAME] >= state.until[i] and not state.pressed[i]:
                take_off(pads, state, i)
        tick = 0
        while tick < TICKS:
            level = 0
            while TICKS >> level > TICKS - tick:
                level += 1
            if state.place[N_ON] == 0:
                glide(body.tables[level], limits.period * 0.5**level, state.bias, state.q, state.p)
                tick += TICKS >> level
                continue
            touching = any_of(state.pressed[: state.place[N_ON]])
            level = max(level, limits.contact) if touching else level_of_flight(body, pads, limits, state, level)
            if level >= 0:
                tick += TICKS >> step(body, limits, state, level, (state.place[FRAME] + tick / TICKS) * limits.period)
        state.place[FRAME] += 1
        if state.place[FRAME] % 1024 == 0:
            tidy_modes(body, pads, state)
