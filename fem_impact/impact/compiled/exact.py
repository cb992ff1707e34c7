"""A step of the energy-exact schemes A and A4 (see `schemes`) on all modes and contacts.

The modes move exactly; the contact forces are constant (A) or linear (A4) over the step. So one step costs a sum over
the modes before and after one scalar equation per contact, whatever the number of modes.
"""

import numpy as np

from . import arrays
from .build import LOOSE, TRUE, inner
from .bundles import Tables
from .flight import GLIDES
from .frame import LEVELS, remember
from .law import harden, point_at, relaxes, spring_of
from .laws.felt import faded_memory, meet
from .propagation import any_of, lane_table

from .schemes import (  # isort: skip
    Free, Own, guess_ends, left_of, linear_guess, memory_after, point_of, solve_constants, solve_ramp, solve_ramps,
    stays,
)  # fmt: skip

from .layout import (  # isort: skip
    A11, A12, A21, A22, APPROACH, BLIND, CLOSED, COMPRESSION, ENERGY, FORCE, FREE_END, FREE_MEAN, FREE_RATE,
    GAIN, LENGTH, M1, M2, M3, N_LANE, OWN_END, OWN_END_RAMP, OWN_MEAN, OWN_MEAN_RAMP, OWN_RATE, OWN_RATE_RAMP, PUSH,
    RATE, START, TARGET, TIME,
)  # fmt: skip


def made_tables(n_modes: int, n_contacts: int, base: float, ramp: int) -> Tables:
    """Room for the tables of steps and flights, none known."""
    n_levels, n_tables, wide = LEVELS + 1, LEVELS + GLIDES + 2, max(4, 2 * n_contacts)
    lanes, sums = np.empty((n_tables, N_LANE, n_modes)), np.empty((n_levels, 6, n_contacts, n_contacts))
    return Tables(lanes, sums, np.zeros(n_tables), np.zeros((5, wide, wide)), base, ramp)


@inner(part=True)
def tabulate(bodies, tables, slot, h):
    """Make a table for steps of length h."""
    lane_table(bodies.omega, bodies.zeta, h, TRUE, tables.lanes[slot])
    contact_sums(bodies.shape, tables.lanes[slot], h, tables.sums[slot])
    tables.known[slot] = 1.0


@inner(arrays=arrays.contact_sums, fastmath=LOOSE)
def contact_sums(shape, lanes, h, out_sums):
    """Sums over the modes of u_i u_j times b1, c1, B0, B1, b2, c2: (6, n_contacts, n_contacts)."""
    n_contacts, n_modes = shape.shape
    for i in range(n_contacts):
        for j in range(i + 1):
            s1 = s4 = s5 = s6 = 0.0
            for n in range(n_modes):
                uu = shape[i, n] * shape[j, n]
                s1 += uu * lanes[A12, n]
                s4 += uu * lanes[M1, n]
                s5 += uu * lanes[M2, n]
                s6 += uu * lanes[M3, n]
            out_sums[OWN_END, i, j] = h * s4
            out_sums[OWN_END_RAMP, i, j] = h * (s5 - 0.5 * s4)
            out_sums[OWN_MEAN, i, j] = h * s5
            out_sums[OWN_MEAN_RAMP, i, j] = h * s6
            out_sums[OWN_RATE, i, j] = s1
            out_sums[OWN_RATE_RAMP, i, j] = s4 - 0.5 * s1
            for r in range(6):
                out_sums[r, j, i] = out_sums[r, i, j]


@inner(arrays=arrays.predict, fastmath=LOOSE)
def predict(bodies, contacts, tables, slot, h):
    """Free motion over one step: the new state and, per contact, end approach, mean approach and end rate."""
    shape, bias, q, p, new_q, new_p = bodies.shape, bodies.bias, bodies.q, bodies.p, bodies.free_q, bodies.free_p
    n_contacts, n_modes = shape.shape
    lanes = tables.lanes[slot]
    part = 1.0 / h
    for n in range(n_modes):
        new_q[n] = lanes[A11, n] * q[n] + lanes[A12, n] * p[n] + h * lanes[M1, n] * bias[n]
        new_p[n] = lanes[A21, n] * q[n] + lanes[A22, n] * p[n] + lanes[A12, n] * bias[n]
    for i in range(n_contacts):
        end = mean = rate = 0.0
        for n in range(n_modes):
            u = shape[i, n]
            end += u * new_q[n]
            rate += u * new_p[n]
            drift = lanes[M1, n] * (p[n] + bodies.twice[n] * q[n]) + h * lanes[M2, n] * bias[n]
            mean += u * (part * lanes[A12, n] * q[n] + drift)
        contacts.free[FREE_END, i] = contacts.offset[i] + end
        contacts.free[FREE_MEAN, i] = contacts.offset[i] + mean
        contacts.free[FREE_RATE, i] = rate


@inner(arrays=arrays.advance, fastmath=LOOSE, part=True)
def advance(bodies, contacts, tables, slot, h):
    """Take over a step and `predict` the next one of the same length, for one contact in one pass."""
    q, p, free_q, free_p = bodies.q, bodies.p, bodies.free_q, bodies.free_p
    lanes = tables.lanes[slot]
    part = 1.0 / h
    f = contacts.force[0] - 0.5 * contacts.slope[0]
    s = contacts.slope[0]
    end = mean = rate = 0.0
    for n in range(q.size):
        u = bodies.shape[0, n]
        a12 = lanes[A12, n]
        first = lanes[M1, n]
        second = lanes[M2, n]
        x = free_q[n] - u * h * (f * first + s * second)
        v = free_p[n] - u * (f * a12 + s * first)
        q[n] = x
        p[n] = v
        g = bodies.bias[n]
        new_x = lanes[A11, n] * x + a12 * v + h * first * g
        new_v = lanes[A21, n] * x + lanes[A22, n] * v + a12 * g
        free_q[n] = new_x
        free_p[n] = new_v
        end += u * new_x
        rate += u * new_v
        mean += u * (part * a12 * x + first * (v + bodies.twice[n] * x) + h * second * g)
    contacts.free[FREE_END, 0] = contacts.offset[0] + end
    contacts.free[FREE_MEAN, 0] = contacts.offset[0] + mean
    contacts.free[FREE_RATE, 0] = rate


@inner(part=True)
def freshen(contacts, fresh):
    """Bring what the contacts remember up to a fresh state, and find the points of the law at which they stand."""
    law, now = contacts.law, contacts.now
    for i in range(contacts.end.size):
        if fresh:
            meet(law, i, now[APPROACH, i], now[RATE, i])
            deeper = harden(law, i, now[APPROACH, i])
            contacts.offset[i] -= deeper
            now[APPROACH, i] -= deeper
            contacts.free[FREE_END, i] -= deeper
            contacts.free[FREE_MEAN, i] -= deeper
        point = point_at(now[APPROACH, i], spring_of(law, i))
        now[COMPRESSION, i] = point.compression
        now[FORCE, i] = point.force
        now[ENERGY, i] = point.energy


@inner()
def solve_all(contacts, tables, slot, h, blind):
    """Solve one step of several contacts, or by scheme A; 0 where a contact pushes by A (asked for or fallen to)."""
    law, now, end = contacts.law, contacts.now, contacts.free
    y, f, s = contacts.end, contacts.force, contacts.slope
    sums, work = tables.sums[slot], tables.work
    m = y.size
    fine = 0
    if tables.ramp and m > 1 and guess_ends(contacts, sums, work, y, f):
        fine = 1 if solve_ramps(h, contacts, sums, work, blind) and stays(now[APPROACH], y) else 0
    if fine == 0:
        solve_constants(h, now, law, end[FREE_END], sums, work, y, f)
        fine = 0 if any_of(f) else 1
        for i in range(m):
            s[i] = 0.0
    if tables.ramp and fine == 0 and m > 1:
        keep = work[4, 1]
        for i in range(m):
            keep[i] = y[i]
            keep[m + i] = f[i]
        if solve_ramps(h, contacts, sums, work, blind):
            fine = 1
        else:
            for i in range(m):
                y[i] = keep[i]
                f[i] = keep[m + i]
                s[i] = 0.0
    for i in range(m):
        contacts.rate[i] = left_of(end[FREE_RATE, i], sums, OWN_RATE, i, f, s)
    return fine


@inner(part=True)
def solve_step(contacts, tables, slot, h, blind):
    """Solve one step of length h from its prediction; 0 where a contact pushes by A (asked for or fallen to)."""
    now, sums = contacts.now, tables.sums[slot]
    free = Free(contacts.free[FREE_END, 0], contacts.free[FREE_MEAN, 0], contacts.free[FREE_RATE, 0])
    if contacts.end.size == 1 and tables.ramp and (now[APPROACH, 0] > 0.0 or free.end > 0.0):
        start, spring = point_of(now, 0), spring_of(contacts.law, 0)
        own = Own(
            sums[OWN_END, 0, 0], sums[OWN_END_RAMP, 0, 0], sums[OWN_MEAN, 0, 0],
            sums[OWN_MEAN_RAMP, 0, 0], sums[OWN_RATE, 0, 0], sums[OWN_RATE_RAMP, 0, 0],
        )  # fmt: skip
        guess = linear_guess(start, free, own, spring)
        settled, point, f, s = solve_ramp(guess, h, start, now[RATE, 0], free, own, spring)
        if settled:
            contacts.end[0] = point.approach
            contacts.force[0] = f
            contacts.slope[0] = s
            contacts.rate[0] = free.rate - own.rate * f - own.rate_ramp * s
            return 1
    return solve_all(contacts, tables, slot, h, blind)


@inner(part=True)
def keep_in_mind(contacts, h, ramped):
    """What every contact remembers after a step of A4 (ramped) or A."""
    law, f, s = contacts.law, contacts.force, contacts.slope
    for i in range(f.size):
        contacts.after[i] = law["memory"][i]
        if relaxes(law, i):
            if law["memory"][i] < 0.0:
                contacts.after[i] = faded_memory(law, i, h)
            else:
                spring, start = spring_of(law, i), point_of(contacts.now, i)
                smooth = ramped and (f[i] != 0.0 or s[i] != 0.0)
                contacts.after[i] = memory_after(
                    h, start, point_at(contacts.end[i], spring), contacts.now[RATE, i], contacts.rate[i], smooth, spring
                )


@inner(part=True)
def record(contacts, course, row, sums, h, blind):
    """Write a step to a row of the steps, and add up its work."""
    y, f, s, start = contacts.end, contacts.force, contacts.slope, contacts.now[APPROACH]
    row[START] = course.clock[TIME]
    row[LENGTH] = h
    row[BLIND] = 1.0 if blind else 0.0
    for i in range(y.size):
        first = remember(contacts, i, row)
        apart = not blind and (start[i] < 0.0 or i == course.counts[TARGET])  # what closes does so where the step ends
        closed = contacts.pressed[i] or (f[i] > 0.0 and not apart)
        row[first + CLOSED] = 1.0 if closed else 0.0
        row[first + PUSH] = f[i] - 0.5 * s[i]
        row[first + GAIN] = s[i]
        mean = left_of(contacts.free[FREE_MEAN, i], sums, OWN_MEAN, i, f, s)
        course.done[i] += f[i] * (y[i] - start[i]) + s[i] * (0.5 * (start[i] + y[i]) - mean)
