"""The frame of every run: flight, step, event, record.

A run is a loop over tries of a step, each of one length. In flight, where nothing touches, the next onset is found or
that there is none (see `flight`). A try that shows an opening, a closing or a corner of a force within it is repeated
with a length that ends there (see `events`), until it does; then the step is taken over and written to the record.
How a try is worked out and when it must be shorter is said in `energy`.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from .build import inner
from .bundles import Bodies, Contacts, Course, KernelRun, KernelSystem
from .flight import NEVER, ONSET, SLOW, approach_of, find_onset
from .law import dent, harden
from .laws.felt import meet, rest_of, stay_parted
from .record import EXHAUSTED, FULL, HORIZON, IMPACTS, total_energy
from .rounding import ITERATIONS, NEAR

from .events import (  # isort: skip
    AGAIN, EVENT_LIMIT, LOCATED, PARTS, RELEASES, SUMMED, enclose, first_corner, first_crossing, narrow_corner,
    narrow_crossing,
)  # fmt: skip
from .layout import (  # isort: skip
    APPROACH, BEGUN, BLINDS, CLOCKS, CONTACT_ROWS, CORNERED, COUNTERS, EVENTS, FAINT, FALLBACKS, FLYING, FRESH, HEAD,
    LENGTH, LEVEL, LOOKS, MISS, RATE, READY, RELEASED, REMEMBERED, RESET, RESPITE, SEEKS, SIZE, SPEED,
    START, STEPS, TARGET, TIME, TRIES, WHICH, WIDTH,
)  # fmt: skip

LEVELS = 40  # [-] halvings of the step that may be cached, and where the table of a step of any other length is kept
FIRST_ROWS = 256  # [-] of a record that grows as needed, which does not change the result; few runs have more
NOTHING, CROSSING, CORNER = range(3)  # what a step is to end at: a contact that opens or closes, a corner of its force
TAKEN, TRY, AFRESH, LOST = range(4)  # a try is good; another length is sought; start again; there was nothing to find


def made_run(scene: KernelSystem) -> KernelRun:
    """A run that has not begun."""
    n_modes, m = len(scene.omega), len(scene.offset)
    return KernelRun(
        scene.q.copy(), scene.p.copy(), np.empty((3, n_modes)), np.zeros((CONTACT_ROWS, m)), scene.law.copy(),
        np.zeros(CLOCKS + 6), np.zeros(COUNTERS, np.int64),
    )  # fmt: skip


def follow_run(follow: Callable[..., int], arguments: tuple[Any, ...], run: KernelRun) -> tuple[Any, ...]:
    """What a run found, see `energy.run_energy`, with as many rows of its record as it needs."""
    width = HEAD + (WIDTH + 1) * run.contacts.shape[1]
    steps = np.empty((FIRST_ROWS, width))
    while (status := follow(*arguments, run, steps)) == FULL:
        steps = np.concatenate([steps, np.empty((3 * len(steps), width))])
    now, done, time, count = run.contacts[:6], run.contacts[-1], float(run.clock[TIME]), run.counts
    steps = steps[: count[STEPS]].copy()
    miss = None if run.clock[MISS] == -np.inf else float(run.clock[MISS])
    return steps, run.q, run.p, now, done, time, status, int(count[FALLBACKS]), int(count[BLINDS]), miss


@inner(part=True)
def moving(scene, run):
    """All modes and how they move."""
    twice, free_q, free_p = run.modes[0], run.modes[1], run.modes[2]
    return Bodies(scene.omega, scene.zeta, twice, scene.shape, scene.bias, run.q, run.p, free_q, free_p)


@inner(part=True)
def touching(run):
    """All contacts."""
    row = run.contacts
    return Contacts(run.law, row[9], row[:6], row[10], row[6:9], row[11], row[12], row[13], row[14], row[15])


@inner(part=True)
def course_of(run):
    """How far the run is."""
    return Course(run.clock[:CLOCKS], run.counts, run.clock[CLOCKS:], run.contacts[CONTACT_ROWS - 1])


@inner()
def begin_run(scene, bodies, contacts, course, base):
    """Where all contacts stand at the start of a run, whether they are pressed, and what counts as rest.

    Events are first passed for the time ``base``. A run may start where the one before located a release, or with a
    striker on a surface that is away from rest: the approach is then zero but for the rounding of these.
    """
    now = contacts.now
    for n in range(scene.omega.size):
        bodies.twice[n] = 2.0 * scene.zeta[n] * scene.omega[n]
    for i in range(contacts.end.size):
        contacts.offset[i] = scene.offset[i] - dent(contacts.law, i, contacts.law["memory"][i])
        now[APPROACH, i], now[RATE, i] = approach_of(bodies.shape, contacts.offset, i, bodies.q, bodies.p)
        way = base * abs(now[RATE, i])
        for n in range(scene.omega.size):
            way += abs(bodies.shape[i, n] * bodies.q[n])
        if abs(now[APPROACH, i]) <= LOCATED * way:
            now[APPROACH, i] = 0.0
        contacts.pressed[i] = now[APPROACH, i] > 0.0 or (now[APPROACH, i] == 0.0 and now[RATE, i] > 0.0)
        stay_parted(contacts.law, i, now[APPROACH, i])
    course.clock[RESPITE] = base
    course.clock[MISS] = -np.inf
    course.clock[FAINT] = 1e-24 * total_energy(bodies, contacts)
    course.counts[READY] = -1
    course.counts[FLYING] = -1
    course.counts[BEGUN] = 1
    course.counts[FRESH] = 1


@inner(part=True)
def status_if_over(course, limits, steps):
    """Why a run ends before its next step; EXHAUSTED, which it will be after the last one, where it goes on.

    FULL where the record of its steps is.
    """
    if course.clock[TIME] >= limits.horizon:
        return HORIZON
    if 0 < limits.max_impacts <= course.counts[RELEASED]:
        return IMPACTS
    return FULL if course.counts[STEPS] + 1 >= steps.shape[0] else EXHAUSTED


@inner(part=True)
def remember(contacts, i, row):
    """Write approach, rate and memory of contact i to a row of the steps; the approach counts from no dent.

    Returns the first column of the row that describes the contact.
    """
    law = contacts.law
    memory = law["memory"][i]
    first = HEAD + WIDTH * i
    row[first] = contacts.now[APPROACH, i] + dent(law, i, memory)
    row[first + SPEED] = contacts.now[RATE, i]
    row[HEAD + WIDTH * contacts.end.size + i] = memory
    return first


@inner()
def finish_memory(contacts):
    """Count the approaches at the end of a run from no dent, and add the memory to where the contacts stand."""
    law, now = contacts.law, contacts.now
    for i in range(now.shape[1]):
        meet(law, i, now[APPROACH, i], now[RATE, i])
        low = dent(law, i, law["memory"][i])  # as long as the last step: what it pressed deeper is not yet counted
        harden(law, i, now[APPROACH, i])
        now[REMEMBERED, i] = law["memory"][i]
        now[APPROACH, i] += low


@inner(part=True)
def write_flight(bodies, contacts, course, flights, limits, row):
    """A flight, written to a row of the steps; how it ended, see `find_onset`."""
    now, count, time = contacts.now, course.counts, course.clock[TIME]
    miss, left = course.clock[MISS : MISS + 1], limits.horizon - time
    elapsed, first, found = find_onset(bodies, contacts.offset, flights, limits, left, miss)
    count[READY] = -1
    if found == NEVER:
        return found
    row[:] = 0.0
    row[START] = time
    row[LENGTH] = elapsed
    for i in range(contacts.end.size):
        remember(contacts, i, row)
        now[APPROACH, i], now[RATE, i] = approach_of(bodies.shape, contacts.offset, i, bodies.q, bodies.p)
        now[APPROACH, i] = min(0.0, now[APPROACH, i])
        slack = max(limits.depth, LOCATED * elapsed * abs(now[RATE, i]))
        if found == ONSET and now[APPROACH, i] >= -slack:  # contacts may close together
            now[APPROACH, i] = 0.0
            contacts.pressed[i] = now[RATE, i] > limits.still
        rest_of(contacts.law, i, elapsed)
    if found == ONSET:
        now[APPROACH, first] = 0.0
        contacts.pressed[first] = True
        count[EVENTS] += 1
    if elapsed > 0.0:
        count[STEPS] += 1
        course.clock[TIME] += elapsed
    if found == SLOW:
        count[EVENTS] = EVENT_LIMIT + 1
    count[FRESH] = 1
    return found


@inner(part=True)
def step_length(course, base, horizon):
    """Length of the next step, no farther than to the horizon, and where its table is kept.

    The last one is longer by rounding rather than followed by one as short as that, which holds nothing but rounding.
    """
    left = horizon - course.clock[TIME]
    h = base * 0.5 ** course.counts[LEVEL]
    return (left, LEVELS) if h > (1.0 - NEAR) * left else (h, course.counts[LEVEL])


@inner(part=True)
def locate_event(bodies, contacts, course, limits, h, cornered):
    """After a try of length h: what to do next, and the length of the next try where the end of the step is sought.

    The first crossing is sought first, then the first corner before it, if some force has any (``cornered``).
    """
    count, bracket = course.counts, course.bracket
    sought = count[SEEKS]
    count[SEEKS] = NOTHING
    answer = TAKEN
    guess = 0.0
    if sought == NOTHING:
        count[CORNERED] = -1
        count[TARGET], guess = first_crossing(bodies, contacts, h, limits, course.clock[TIME] == 0.0)
        if count[TARGET] >= 0:
            enclose(contacts, h, count[TARGET], bracket)
            count[SEEKS] = CROSSING
            count[TRIES] = 0
            return TRY, guess
    else:
        if sought == CROSSING:
            count[TARGET], guess = narrow_crossing(contacts, h, limits, count[TARGET], bracket)
        else:
            guess = narrow_corner(contacts, count[CORNERED], count[WHICH], h, bracket)
        count[TRIES] += 1
        if guess != 0.0 and count[TRIES] < ITERATIONS:
            count[SEEKS] = sought
            return TRY, guess
        known = max(SUMMED * limits.depth, NEAR * bracket[SIZE])
        if sought == CROSSING and not abs(contacts.end[count[TARGET]]) <= known:
            answer = LOST  # but a corner before it may be found
    if sought != CORNER and cornered:
        count[CORNERED], count[WHICH], guess = first_corner(contacts, h, limits.depth, bracket)
        if count[CORNERED] >= 0:
            if count[WHICH] == AGAIN:
                contacts.law["memory"][count[CORNERED]] = abs(contacts.law["memory"][count[CORNERED]])
                return AFRESH, guess
            count[TARGET] = -1
            count[SEEKS] = CORNER
            count[TRIES] = 0
            return TRY, guess
    return answer, guess


@inner(part=True)
def at_rest(bodies, contacts, course):
    """Whether the bodies are, asked at every 512th step in contact."""
    return course.counts[LOOKS] % 512 == 0 and total_energy(bodies, contacts) <= course.clock[FAINT]


@inner(part=True)
def settle_contacts(contacts, target, limits, base):
    """Take over approaches and rates at a step's end; the number of contacts that opened, but for those without force.

    Contacts open or close together if they do within a tiny part of the longest step ``base``, or rounding decides.
    """
    now, pressed, y, rate = contacts.now, contacts.pressed, contacts.end, contacts.rate
    opened = 0
    for i in range(y.size):
        was = pressed[i]
        slack = limits.depth
        if target >= 0:
            slack = max(limits.depth, LOCATED * max(abs(now[APPROACH, i]), base * abs(rate[i])))
        now[APPROACH, i] = y[i]
        now[RATE, i] = rate[i]
        if i == target:
            now[APPROACH, i] = 0.0
            pressed[i] = not was
        elif abs(y[i]) <= slack:
            now[APPROACH, i] = 0.0
            pressed[i] = rate[i] > limits.still or (was and rate[i] >= -limits.still)
        else:
            pressed[i] = y[i] > 0.0
        if was and not pressed[i] and contacts.force[i] > 0.0:
            opened += 1
    return opened


@inner(part=True)
def take_over(contacts, course, limits, h, base, special):
    """Take over a step: time, what is remembered, releases, and the events of one step's time."""
    law, clock, count = contacts.law, course.clock, course.counts
    if special:
        for i in range(contacts.end.size):
            law["memory"][i] = contacts.after[i]
    clock[TIME] += h
    corner = count[CORNERED]
    if corner >= 0 and contacts.force[corner] > 0.0 and (count[WHICH] == PARTS or count[WHICH] == RELEASES):
        count[RELEASED] += 1
    count[RELEASED] += settle_contacts(contacts, count[TARGET], limits, base)
    if clock[TIME] - clock[RESET] > base:
        clock[RESET] = clock[TIME]
        count[EVENTS] = 0
    elif count[TARGET] >= 0 or corner >= 0:
        count[EVENTS] += 1
    count[STEPS] += 1
    count[LOOKS] += 1
    count[FRESH] = 1
