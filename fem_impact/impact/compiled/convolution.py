"""What a contact force does to the approach later: kernels of both bodies, and their convolution with past forces.

A kernel holds what a unit force on a body of unit mass, constant or a ramp over one step, does to the approach at the
end of that step and of all later ones, to its rate there and to its mean over each step.
"""

import numpy as np

from .build import LOOSE, inner, outer
from .propagation import restore

END, END_RAMP, RATE, RATE_RAMP, MEAN, MEAN_RAMP = (np.uintp(row) for row in range(6))  # rows of a kernel
N_ROWS = 6
N_SPANS = 5  # [-] lengths of a look ahead in flight: 1, 2, 4, 8 and 16 steps
SPLITS = 2  # [-] halvings of a step in flight where the whole leaves a doubt


@outer()
def orbit(table, q, p, out_states):
    """States after 0, 1, 2, ... steps, (n_steps, 2, n_modes), of modes that start from q and p and move freely.

    Parameters: table (4 or more, n_modes): a11, a12, a21, a22 of one step as in `propagation.step_table`.
    """
    restore(q, p, out_states[0, 0], out_states[0, 1])
    for m in range(1, out_states.shape[0]):
        x, y = out_states[m - 1, 0], out_states[m - 1, 1]
        for n in range(q.size):
            out_states[m, 0, n] = table[0, n] * x[n] + table[1, n] * y[n]
            out_states[m, 1, n] = table[2, n] * x[n] + table[3, n] * y[n]


@inner()
def missed_parts(angle, zeta):
    """What the cubic through both ends of a look ahead misses at most of a mode's free motion, over its amplitude.

    Of the motion and of its slope over the look H, in which the mode turns by that angle: H**4 / 384 and
    sqrt(3) / 216 H**4 times the fourth derivative, or no more than the motion itself.
    """
    steep = (angle * (1.0 + 2.0 * zeta)) ** 4
    return min(steep / 384.0, 2.0 + 0.25 * angle), min(np.sqrt(3.0) / 216.0 * steep, 3.0 + 2.0 * angle)


@outer()
def flight_bounds(omega, zeta, squared, h, out_bounds):
    """What cubics through both ends of a look ahead miss of a body's free motion, at unit mass.

    Parameters: out_bounds (SPLITS + N_SPANS, 2, 2), for looks of 1/4, 1/2, 1, 2, 4, ... steps: of the approach and of
    its slope over the look, after a force of unit jumps and one of unit bends (changes of its slope). A jump leaves a
    mode with the velocity u**2 / omega at most, a bend with u**2 / omega**2.
    """
    out_bounds[:] = 0.0
    for n in range(omega.size):
        w, z = omega[n], zeta[n]
        if w == 0.0:
            continue
        size = squared[n] * np.sqrt(1.0 + 4.0 * z * z) / (w * w)
        for level in range(SPLITS + N_SPANS):
            for i, missed in enumerate(missed_parts(w * h * 2.0 ** (level - SPLITS), z)):
                out_bounds[level, i, 0] += size * missed
                out_bounds[level, i, 1] += size * missed / w


@inner(fastmath=LOOSE)
def carry(modes, force, ramp, moved):
    """Advance modes by a step under that force; both as of `bundles.Kernels.modes` and `bundles.Track.moved`."""
    for n in range(modes.shape[1]):
        q, p = moved[0, n], moved[1, n]
        moved[0, n] = modes[0, n] * q + modes[1, n] * p + modes[4, n] * force + modes[6, n] * ramp
        moved[1, n] = modes[2, n] * q + modes[3, n] * p + modes[5, n] * force + modes[7, n] * ramp


@inner()
def add_missed(modes, share, h, moved, out_missed):
    """Add what looks ahead of every length miss at most of modes that move freely from there on, see `missed_parts`."""
    for n in range(modes.shape[1]):
        w, z = modes[8, n], modes[9, n]
        if w == 0.0:
            continue
        size = share * modes[10, n] * np.hypot(moved[0, n], moved[1, n] / w)
        for level in range(SPLITS + N_SPANS):
            for i, missed in enumerate(missed_parts(w * h * 2.0 ** (level - SPLITS), z)):
                out_missed[level, i] += size * missed


@inner(fastmath=LOOSE)
def combine(target, striker, share, own, start, out_rows):
    """Kernel of both bodies, reversed in time, from delay ``start`` on."""
    n_steps = out_rows.shape[1]
    for r in range(out_rows.shape[0]):
        backwards = out_rows[r, : n_steps - start][::-1]
        first, second = target[r, start:n_steps], striker[r, start:n_steps]
        for m in range(backwards.size):
            backwards[m] = share * first[m] + own * second[m]


@inner(fastmath=LOOSE)
def convolve(rows, n, known, segments, n_segments, force, ramp):
    """Approach at the end of step n, mean and rate, caused by the forces before step ``known``; rows run backwards.

    Indices without sign, here and below: loops over signed ones do not run in parallel lanes.
    """
    end = mean = rate = 0.0
    shift = rows.shape[1] - 1 - n
    for i in range(n_segments):
        low, high = segments[i, 0], min(segments[i, 1], known)
        if low < high:
            first, start = np.uintp(shift + low), np.uintp(low)
            for j in range(np.uintp(high - low)):
                f = force[start + j]
                s = ramp[start + j]
                end += rows[END, first + j] * f + rows[END_RAMP, first + j] * s
                mean += rows[MEAN, first + j] * f + rows[MEAN_RAMP, first + j] * s
                rate += rows[RATE, first + j] * f + rows[RATE_RAMP, first + j] * s
    return end, mean, rate


@inner(fastmath=LOOSE)
def convolve_flight(rows, n, segments, n_segments, force, ramp):
    """The same in flight, after all forces: approach and rate."""
    end = rate = 0.0
    shift = rows.shape[1] - 1 - n
    for i in range(n_segments):
        low = segments[i, 0]
        first, start = np.uintp(shift + low), np.uintp(low)
        for j in range(np.uintp(segments[i, 1] - low)):
            f = force[start + j]
            s = ramp[start + j]
            end += rows[END, first + j] * f + rows[END_RAMP, first + j] * s
            rate += rows[RATE, first + j] * f + rows[RATE_RAMP, first + j] * s
    return end, rate
