"""Poles of measured frequency responses by models of rising order: those of modes come back at every order.

Least-squares complex frequency method: all channels share a denominator, a polynomial in ``z = exp(i omega dt)`` with
real coefficients, and have numerators of their own of the same order, which are eliminated. Noise gives poles that
wander from order to order or grow in time; those of modes stay.

References
----------
Guillaume et al. (2003), Proc. 21st IMAC; Van der Auweraer et al. (2001), J. Dyn. Sys. Meas. Control 123, 651-658.
"""

from typing import Any, NamedTuple

import numpy as np

from .._base.threads import one_thread
from . import picked


class Chart(NamedTuple):
    """Poles (n_poles,) of all orders that decay, within the band and with damping ratios below 0.1."""

    order: np.ndarray  # [-] of the model
    frequency: np.ndarray  # [Hz]
    damping_ratio: np.ndarray  # [-]
    stable: np.ndarray  # bool: like one of the order below in both


@one_thread
def chart(found: Any, orders: int = 100) -> Chart:
    """The poles of frequency responses, as `fi.frf` returns them, by models of even orders up to ``orders``.

    Noise takes most of them, and 20 modes need 80. A pole is stable if one of the order below differs by less than 1 %
    in frequency and 5 % in damping ratio, as usual in modal analysis.
    """
    lines, values, *_ = picked.responses("frf", found)  # all lines count alike: weights by their errors did no better
    omega, window = lines.imag, float(lines.real.max(initial=0.0))  # [1/s] decay of an exponential window
    orders = min(orders, len(omega) // 4)
    dt = np.pi / omega[-1]
    powers = np.exp(1j * dt * np.outer(omega, np.arange(orders + 1)))  # (n_frequencies, orders + 1)
    R = (powers.conj().T @ powers).real
    S, T = [], []
    for column in values.T:
        turned = -column[:, None] * powers
        S.append((powers.conj().T @ turned).real)
        T.append((turned.conj().T @ turned).real)
    rows: list[tuple[float, float, float, bool]] = []
    before = np.zeros((2, 0))
    for order in range(2, orders + 1, 2):
        n = order + 1
        A = np.sum([t[:n, :n] - s[:n, :n].T @ np.linalg.lstsq(R[:n, :n], s[:n, :n], rcond=None)[0]
                    for s, t in zip(S, T)], axis=0)  # fmt: skip
        # with the lowest coefficient held, the poles that noise makes grow in time, and are dropped
        free = np.linalg.lstsq(A[1:, 1:], -A[1:, 0], rcond=None)[0]
        z = np.roots(np.concatenate([[1.0], free])[::-1])
        s = np.log(np.where(z == 0.0, 1e-300, z).astype(complex)) / dt + window
        size = np.abs(s)
        ratio = -s.real / np.maximum(size, 1e-300)
        kept = (s.imag > 0.0) & (ratio > 0.0) & (ratio < 0.1) & (size >= omega[0]) & (size <= omega[-1])
        now = np.stack([size[kept], ratio[kept]])[:, np.argsort(size[kept])]
        for natural, damping in now.T:
            near = np.abs(before[0] / natural - 1.0) < 0.01
            stable = bool((near & (np.abs(before[1] / damping - 1.0) < 0.05)).any())
            rows.append((order, natural / (2.0 * np.pi), damping, stable))
        before = now
    columns = np.array(rows, float).reshape(-1, 4).T
    return Chart(columns[0].astype(int), columns[1], columns[2], columns[3].astype(bool))
