"""What plain Python runs in place of the loops over modes: the same on whole arrays, ten to a hundred times as fast.

Each function has the name and the arguments of the kernel that it stands for, which see. They serve only where nothing
is compiled: plain Python cannot call the compiled kernels of heavily damped modes.
"""

from typing import TypeAlias

import numpy as np

from .bundles import Bodies, Contacts, Tables
from .layout import A11, A12, A21, A22, M1, M2, M3
from .one_mode import mode_matrix, mode_moments

Array: TypeAlias = np.ndarray
LIGHT = 0.9  # [-] damping ratio up to which a mode takes the fast lanes
SERIES_END = 3.0  # [-] omega*h below which the moments' recursion runs downwards: from 30 on it leaves 1e-17
ANGLE_LIMIT = 1e6  # [-] angle up to which the reduction in `waves` is exact


@np.errstate(all="ignore")  # as compiled code does
def lane_table(omega: Array, zeta: Array, h: float, whole: bool, out_lanes: Array) -> None:
    """`propagation.lane_table`."""
    angle = omega * h
    alone = (zeta > LIGHT) | (angle >= ANGLE_LIMIT)
    x = np.where(alone, 0.0, zeta) * angle
    y = np.sqrt(np.maximum(angle - x, 0.0) * (angle + x))
    decay = np.exp(-x)
    s = decay * np.divide(np.sin(y), y, out=np.ones_like(y), where=y > 0.0)
    c = decay * np.cos(y)
    out_lanes[A11], out_lanes[A12], out_lanes[A22], out_lanes[M1] = c + x * s, h * s, c - x * s, 0.0
    if whole:
        near = angle < SERIES_END
        square = angle * angle
        inverse = 1.0 / np.where(near, 1.0, square)
        m1 = (1.0 - 2.0 * x * s - out_lanes[A22]) * inverse
        m2 = (1.0 - 2.0 * x * m1 - s) * inverse
        m3 = (0.5 - 2.0 * x * m2 - m1) * inverse
        second = third = np.ones_like(x)
        for k in range(29, 2, -1):
            first = 1.0 - square / ((k + 1) * (k + 2)) * third - 2.0 * x / (k + 1) * second
            second, third = first, second
        m2, m3 = np.where(near, second / 6.0, m2), np.where(near, third / 24.0, m3)
        m1 = np.where(near, 0.5 - 2.0 * x * m2 - square * m3, m1)
        out_lanes[M1], out_lanes[M2], out_lanes[M3] = h * m1, h * m2, h * (m3 - 0.5 * m2)
    work, m = np.empty((2, 3)), np.empty(4)
    for n in np.flatnonzero(alone):
        out_lanes[A11, n], out_lanes[A12, n], out_lanes[A22, n], _, _, _ = mode_matrix(omega[n], zeta[n], h)
        if whole:
            mode_moments(omega[n], zeta[n], h, m, work)
            out_lanes[4:, n] = h * m[1], h * m[2], h * (m[3] - 0.5 * m[2])
    out_lanes[A21] = -omega * omega * out_lanes[A12]


def restore(q: Array, p: Array, out_q: Array, out_p: Array) -> None:
    """`propagation.restore`."""
    out_q[:], out_p[:] = q, p


def glide(lanes: Array, h: float, bias: Array, q: Array, p: Array) -> None:
    """`propagation.glide`."""
    q[:], p[:] = (
        lanes[A11] * q + lanes[A12] * p + h * lanes[M1] * bias,
        lanes[A21] * q + lanes[A22] * p + lanes[A12] * bias,
    )


def commit(shape: Array, lanes: Array, h: float, force: Array, slope: Array, q: Array, p: Array) -> None:
    """`propagation.commit`."""
    for u, f, s in zip(shape, force - 0.5 * slope, slope):
        if f != 0.0 or s != 0.0:
            q -= u * (h * (f * lanes[M1] + s * lanes[M2]))
            p -= u * (f * lanes[A12] + s * lanes[M1])


def approach_of(shape: Array, offset: Array, i: int, q: Array, p: Array) -> tuple[float, float]:
    """`flight.approach_of`."""
    return offset[i] + shape[i] @ q, shape[i] @ p


def contact_sums(shape: Array, lanes: Array, h: float, out_sums: Array) -> None:
    """`exact.contact_sums`."""
    s1, s4, s5, s6 = ((shape * lanes[row]) @ shape.T for row in (A12, M1, M2, M3))
    out_sums[:] = h * s4, h * (s5 - 0.5 * s4), h * s5, h * s6, s1, s4 - 0.5 * s1


def predict(bodies: Bodies, contacts: Contacts, tables: Tables, slot: int, h: float) -> None:
    """`exact.predict`."""
    lanes, shape, q, p, bias = tables.lanes[slot], bodies.shape, bodies.q, bodies.p, bodies.bias
    bodies.free_q[:] = lanes[A11] * q + lanes[A12] * p + h * lanes[M1] * bias
    bodies.free_p[:] = lanes[A21] * q + lanes[A22] * p + lanes[A12] * bias
    mean = lanes[A12] * q / h + lanes[M1] * (p + bodies.twice * q) + h * lanes[M2] * bias
    end, offset = contacts.free, contacts.offset[: len(shape)]
    end[0], end[1], end[2] = offset + shape @ bodies.free_q, offset + shape @ mean, shape @ bodies.free_p


def advance(bodies: Bodies, contacts: Contacts, tables: Tables, slot: int, h: float) -> None:
    """`exact.advance`."""
    restore(bodies.free_q, bodies.free_p, bodies.q, bodies.p)
    commit(bodies.shape, tables.lanes[slot], h, contacts.force, contacts.slope, bodies.q, bodies.p)
    predict(bodies, contacts, tables, slot, h)
