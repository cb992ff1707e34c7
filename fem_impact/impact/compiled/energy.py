"""A run with the energy-exact schemes A and A4 (see `schemes`), with or without stretching: see `frame`.

The step in contact has a fixed length, shortened to end at onsets and releases. In flight there are no steps, but for
bodies that stretch (see `stretched`). Events that pile up within the time of one step (chatter) are passed by blind
steps, which locate none.
"""

from typing import Any

import numpy as np

from .build import FALSE, inner, outer
from .bundles import Flights, KernelSystem, Limits
from .events import EVENT_LIMIT, has_dipped, has_paused, has_strayed, lags_behind
from .exact import advance, freshen, keep_in_mind, made_tables, predict, record, solve_step, tabulate
from .flight import NEVER, SLOW, UNPROVED
from .law import point_at, special_of, spring_of
from .propagation import any_of, commit, restore
from .record import EXHAUSTED, FAILED, FINISHED, FULL, SETTLED
from .rounding import OVERFLOW
from .stretched import Stretch, attempt, finish, fly_in_steps, made_room, overlooked, stretching_energy

from .frame import (  # isort: skip
    LEVELS, LOST, NOTHING, TAKEN, at_rest, begin_run, course_of, finish_memory, follow_run, locate_event, made_run,
    moving, status_if_over, step_length, take_over, touching, write_flight,
)  # fmt: skip
from .layout import (  # isort: skip
    APPROACH, BEGUN, BLINDS, CORNERED, EVENTS, FAINT, FALLBACKS, FORCE, FRESH, LEAST, LEVEL, PAUSE, RATE,
    READY, RESPITE, SEEKS, STEPS, TARGET, TIME,
)  # fmt: skip


MOST_HALVINGS = LEVELS // 2  # [-] of a step because a force misses its law


@inner(part=True)
def pass_events(course):
    """Whether the next step is blind, as events piled up; the halvings of the step are set accordingly."""
    clock, count = course.clock, course.counts
    if count[EVENTS] > EVENT_LIMIT:  # or a late step would never be blind
        clock[PAUSE] = max(clock[TIME] + clock[RESPITE], np.nextafter(clock[TIME], np.inf))
        clock[RESPITE] *= 2.0
        count[EVENTS] = 0
    blind = clock[TIME] < clock[PAUSE]
    count[LEVEL] = count[LEAST] if blind else max(count[LEVEL], count[LEAST])
    return blind


@inner(part=True, fastmath=False)  # typed by itself, as room may be None
def fly_if_free(bodies, contacts, course, flights, room, limits, row):
    """How a flight ends, see `find_onset`; SLOW where there is none, or bodies that stretch fly in steps."""
    if room is not None:
        return NEVER if fly_in_steps(bodies, contacts, course, room, limits) else SLOW
    if course.clock[TIME] < course.clock[PAUSE] or any_of(contacts.pressed):
        return SLOW
    return write_flight(bodies, contacts, course, flights, limits, row)


@inner(part=True, fastmath=False)
def solve_forces(bodies, contacts, room, tables, slot, h, blind):
    """Whether the forces of a step were found, and what `solve_step` returns of them."""
    if room is None:
        return True, solve_step(contacts, tables, slot, h, blind)
    return attempt(bodies, contacts, room, tables, slot, h, blind, FALSE)


@inner(part=True)
def locate_end(bodies, contacts, course, limits, h, cornered, blind):
    """Whether to take a step of length h, and the next length to try; one whose event was not found is passed blind."""
    if blind:
        course.counts[TARGET] = -1
        course.counts[CORNERED] = -1
        return True, 0.0
    answer, guess = locate_event(bodies, contacts, course, limits, h, cornered)
    if answer == LOST:
        course.clock[PAUSE] = np.nextafter(course.clock[TIME], np.inf)
    if answer == TAKEN:
        for i in range(contacts.force.size):
            if contacts.force[i] < 0.0:  # it ends where it touches: rounding
                contacts.force[i] = 0.0
    return answer == TAKEN, guess


@inner(part=True)
def make_ready(bodies, contacts, course, tables, slot, h, special):
    """Where a step would end if nothing pushed, and what the contacts remember now."""
    count = course.counts
    if slot == LEVELS or tables.known[slot] == 0.0:
        tabulate(bodies, tables, slot, h)
    if count[READY] != slot:
        predict(bodies, contacts, tables, slot, h)
    count[READY] = -1
    if count[SEEKS] == NOTHING:
        freshen(contacts, special and count[FRESH] == 1)
        count[FRESH] = 0


@inner(part=True)
def too_long(contacts, special, level, h, still):
    """By how many halvings a step must be shorter, because contacts opened and closed again within it."""
    now, pressed = contacts.now, contacts.pressed
    shorter = 0
    for i in range(contacts.end.size):
        if pressed[i] and contacts.end[i] <= 0.0 and now[APPROACH, i] == 0.0:
            if now[RATE, i] > still:
                shorter = max(shorter, 3 if level == 0 else 1)
        elif has_dipped(contacts, h, i) or (pressed[i] and has_paused(contacts, h, i)):
            shorter = max(shorter, 1)
        if special and pressed[i] and (has_strayed(contacts, h, i) or lags_behind(contacts, level, h, i)):
            shorter = max(shorter, 1)
    return shorter


@inner()
def missed_impulse(contacts, h):
    """Impulse [N s] that a step's lossy forces miss of their laws, from what the laws say at its ends; the largest."""
    now, law = contacts.now, contacts.law
    worst = 0.0
    for i in range(contacts.end.size):
        loss = law["loss"][i]
        if loss > 0.0:
            begins = now[FORCE, i] * max(0.0, 1.0 + loss * now[RATE, i])
            ends = point_at(contacts.end[i], spring_of(law, i)).force * max(0.0, 1.0 + loss * contacts.rate[i])
            worst = max(worst, abs(contacts.force[i] - 0.5 * (begins + ends)) * h)
    return worst


@inner(part=True, fastmath=False)
def halve_if_needed(bodies, contacts, course, room, special, h, limits):
    """Whether to take a step again, halved; steps that cannot be halved any more pass the events."""
    shorter = too_long(contacts, special, course.counts[LEVEL], h, limits.still)
    if course.counts[LEVEL] < MOST_HALVINGS and missed_impulse(contacts, h) > limits.misfit:
        shorter = max(shorter, 1)
    if room is not None:
        shorter = max(shorter, overlooked(bodies, contacts, h, course.counts[LEVEL]))
    course.counts[LEVEL] += shorter
    if course.counts[LEVEL] >= LEVELS:
        course.counts[LEVEL] = course.counts[LEAST]
        course.counts[EVENTS] = EVENT_LIMIT + 1
    return shorter > 0


@inner(part=True)
def is_finite(contacts):
    """Whether a step ends with numbers."""
    total = 0.0
    for i in range(contacts.end.size):
        total += abs(contacts.end[i]) + abs(contacts.rate[i]) + contacts.force[i]
    return total < OVERFLOW


@inner(part=True, fastmath=False)
def move_on(bodies, contacts, course, room, tables, slot, h, horizon):
    """Move the modes to the end of a step; how long the next one is, predicted at once if it is alike."""
    count = course.counts
    if count[TARGET] < 0 and count[CORNERED] < 0:  # halved less often after one that ended at no event
        count[LEVEL] = max(0, count[LEVEL] - 1)
        count[LEAST] = max(0, count[LEAST] - 1)
    if room is not None:
        finish(bodies, contacts, room, tables.lanes[slot], h)
        return
    alike = slot == count[LEVEL] and course.clock[TIME] + h <= horizon
    if contacts.end.size == 1 and alike and contacts.pressed[0]:
        advance(bodies, contacts, tables, slot, h)
        count[READY] = slot
    else:
        restore(bodies.free_q, bodies.free_p, bodies.q, bodies.p)
        commit(bodies.shape, tables.lanes[slot], h, contacts.force, contacts.slope, bodies.q, bodies.p)


@outer(allocates=False, seconds=10.0)
def follow(scene, tables, room, limits, run, steps):
    """Step by step until the run ends, or until its record is FULL; ``room`` is for a body that stretches, or None."""
    bodies, contacts, course = moving(scene, run), touching(run), course_of(run)
    flights = Flights(tables.lanes[LEVELS + 1 :], tables.known[LEVELS + 1 :], tables.base, 1e-3 * tables.base)
    if course.counts[BEGUN] == 0:
        begin_run(scene, bodies, contacts, course, tables.base)
        if room is not None:
            course.clock[FAINT] += 1e-24 * stretching_energy(room, bodies.q)
    count = course.counts
    special, cornered = special_of(contacts.law)
    quiet = not any_of(bodies.bias)
    blind = False
    guess = 0.0
    status = EXHAUSTED
    while count[STEPS] < limits.max_steps:
        if count[SEEKS] == NOTHING:
            status = status_if_over(course, limits, steps)
            if status != EXHAUSTED:
                break
            found = fly_if_free(bodies, contacts, course, flights, room, limits, steps[count[STEPS]])
            if found in (NEVER, UNPROVED):
                status = FINISHED if found == NEVER else EXHAUSTED
                break
            if found != SLOW:
                continue
            blind = pass_events(course)
            h, slot = step_length(course, tables.base, limits.horizon)
        else:
            h, slot = guess, LEVELS
        make_ready(bodies, contacts, course, tables, slot, h, special)
        good, fine = solve_forces(bodies, contacts, room, tables, slot, h, blind)
        if not good:
            count[SEEKS] = NOTHING
            count[LEAST] = count[LEVEL] + 1
            if count[LEAST] >= LEVELS:
                status = FAILED
                break
            continue
        if special:
            keep_in_mind(contacts, h, tables.ramp and fine)
        fresh = not blind and count[SEEKS] == NOTHING
        if fresh and halve_if_needed(bodies, contacts, course, room, special, h, limits):
            continue
        taken, guess = locate_end(bodies, contacts, course, limits, h, cornered, blind)
        if not taken:
            continue
        if not is_finite(contacts):
            status = FAILED
            break
        record(contacts, course, steps[count[STEPS]], tables.sums[slot], h, blind)
        count[FALLBACKS] += tables.ramp and fine == 0 and any_of(contacts.force)
        count[BLINDS] += blind
        take_over(contacts, course, limits, h, tables.base, special)
        move_on(bodies, contacts, course, room, tables, slot, h, limits.horizon)
        if quiet and at_rest(bodies, contacts, course):
            status = SETTLED
            break
    if status != FULL:
        finish_memory(contacts)
    return status


def run_energy(scene: KernelSystem, stretch: Stretch | None, ramp: int, base: float, limits: Limits) -> tuple[Any, ...]:
    """Follow bodies in contact with the energy-exact schemes A (ramp 0) or A4 (ramp 1).

    ``base`` is the longest step in contact; ``stretch`` is None if nothing stretches.

    Returns (steps, q, p, now, done, time, status, n_fallback, n_blind, miss). Each row of steps is a step or a flight,
    see `record`. now (6, n_contacts) ends with the last approach, .., rate and memory; done (n_contacts,) is the
    integral of force times rate [J]. A finished run ends at the last separation. miss is the highest approach [m] from
    which bodies turned back in flight, None if they did not.
    """
    m, n_modes = scene.shape.shape
    run, tables = made_run(scene), made_tables(n_modes, m, base, ramp)
    room = None if stretch is None else made_room(stretch, scene.omega, m)
    return follow_run(follow, (scene, tables, room, limits), run)
