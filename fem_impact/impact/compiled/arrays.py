"""What plain Python runs in place of the loops over modes: the same on whole arrays, ten to a hundred times as fast.

Each function has the name and the arguments of the kernel that it stands for, which see. They serve only where nothing
is compiled: plain Python cannot call the compiled kernels of heavily damped modes.
"""

import numpy as np

from .one_mode import mode_matrix, mode_moments

LIGHT = 0.9  # [-] damping ratio up to which a mode takes the fast lanes
SERIES_END = 3.0  # [-] omega*h below which the fast lanes sum a power series: 13 terms leave 3e-17
ANGLE_LIMIT = 1e6  # [-] angle up to which the reduction in `waves` is exact


@np.errstate(all="ignore")  # as compiled code does
def lane_table(omega, zeta, h, whole, out_lanes):
    """`propagation.lane_table`."""
    angle = omega * h
    alone = (zeta > LIGHT) | (angle >= ANGLE_LIMIT)
    x = np.where(alone, 0.0, zeta) * angle
    y = np.sqrt(np.maximum(angle - x, 0.0) * (angle + x))
    decay = np.exp(-x)
    s = decay * np.divide(np.sin(y), y, out=np.ones_like(y), where=y > 0.0)
    c = decay * np.cos(y)
    out_lanes[0], out_lanes[1], out_lanes[3], out_lanes[4] = c + x * s, h * s, c - x * s, 0.0
    if whole:
        near = angle < SERIES_END
        square = angle * angle
        inverse = 1.0 / np.where(near, 1.0, square)
        m1 = (1.0 - 2.0 * x * s - out_lanes[3]) * inverse
        m2 = (1.0 - 2.0 * x * m1 - s) * inverse
        m3 = (0.5 - 2.0 * x * m2 - m1) * inverse
        m2[near], m3[near] = _near_moments(2.0 * x[near], square[near])
        m1 = np.where(near, 0.5 - 2.0 * x * m2 - square * m3, m1)
        out_lanes[4], out_lanes[5], out_lanes[6] = h * m1, h * m2, h * (m3 - 0.5 * m2)
    work, m = np.empty((2, 3)), np.empty(4)
    for n in np.flatnonzero(alone):
        out_lanes[0, n], out_lanes[1, n], out_lanes[3, n], _, _, _ = mode_matrix(omega[n], zeta[n], h)
        if whole:
            mode_moments(omega[n], zeta[n], h, m, work)
            out_lanes[4:, n] = h * m[1], h * m[2], h * (m[3] - 0.5 * m[2])
    out_lanes[2] = -omega * omega * out_lanes[1]


def _near_moments(double, square):
    """Moments 2 and 3, (n_modes,) each, by power series; see `propagation.near_moments`."""
    second, third = np.zeros_like(double), np.zeros_like(double)
    last, now, factor = np.zeros_like(double), np.ones_like(double), 1.0 / 6.0
    for j in range(1, 30):
        second += now * factor
        third += now * (factor / (j + 3.0))
        last, now = now, -double * now - square * last
        factor /= j + 3.0
    return second, third


def restore(q, p, out_q, out_p):
    """`propagation.restore`."""
    out_q[:], out_p[:] = q, p


def glide(lanes, h, bias, q, p):
    """`propagation.glide`."""
    q[:], p[:] = (
        lanes[0] * q + lanes[1] * p + h * lanes[4] * bias,
        lanes[2] * q + lanes[3] * p + lanes[1] * bias,
    )


def commit(shape, lanes, h, force, slope, free_q, free_p, out_q, out_p):
    """`propagation.commit`."""
    out_q[:], out_p[:] = free_q, free_p
    for u, f, s in zip(shape, force - 0.5 * slope, slope):
        if f != 0.0 or s != 0.0:
            out_q -= u * (h * (f * lanes[4] + s * lanes[5]))
            out_p -= u * (f * lanes[1] + s * lanes[4])


def approach(shape, offset, i, q, p):
    """`flight.approach`."""
    return offset[i] + shape[i] @ q, shape[i] @ p


def contact_sums(shape, lanes, h, out_sums):
    """`energy.contact_sums`."""
    s1, s4, s5, s6 = ((shape * lanes[row]) @ shape.T for row in (1, 4, 5, 6))
    out_sums[:] = h * s4, h * (s5 - 0.5 * s4), h * s5, h * s6, s1, s4 - 0.5 * s1


def predict(shape, tables, slot, h, twice, offset, bias, q, p, out_q, out_p, out_end):
    """`energy.predict`."""
    lanes = tables[slot]
    out_q[:] = lanes[0] * q + lanes[1] * p + h * lanes[4] * bias
    out_p[:] = lanes[2] * q + lanes[3] * p + lanes[1] * bias
    mean = lanes[1] * q / h + lanes[4] * (p + twice * q) + h * lanes[5] * bias
    out_end[0], out_end[1], out_end[2] = offset + shape @ out_q, offset + shape @ mean, shape @ out_p


def advance(shape, tables, slot, h, twice, offset, bias, force, slope, q, p, free_q, free_p, out_end):
    """`energy.advance`."""
    commit(shape, tables[slot], h, force, slope, free_q, free_p, q, p)
    predict(shape, tables, slot, h, twice, offset, bias, q, p, free_q, free_p, out_end)
