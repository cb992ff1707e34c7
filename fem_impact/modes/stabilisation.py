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

from . import picked

ORDERS = 100  # [-] poles of the largest model: noise takes most, and 20 modes need 80
# [-] a pole is stable if one of the order below differs by less, in frequency and in damping ratio: as usual in
# modal analysis
ALIKE = 0.01, 0.05
SEEN = 0.1  # [-] largest damping ratio shown: those of modes of what is struck are smaller


class Chart(NamedTuple):
    """Poles (n_poles,) of all orders that decay."""

    order: np.ndarray  # [-] of the model
    frequency: np.ndarray  # [Hz]
    damping_ratio: np.ndarray  # [-]
    stable: np.ndarray  # bool: like one of the order below in both


def chart(found: Any, orders: int = ORDERS) -> Chart:
    """The poles of frequency responses, as `fi.frf` returns them, by models of even orders up to ``orders``."""
    s, values, *_ = picked.responses("frf", found)  # all lines count alike: weights by their errors did no better
    omega, window = s.imag, float(s.real.max(initial=0.0))
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
        now = _decaying(np.roots(np.concatenate([[1.0], free])[::-1]), dt, omega, window)
        for natural, damping in now.T:
            near = np.abs(before[0] / natural - 1.0) < ALIKE[0]
            stable = bool((near & (np.abs(before[1] / damping - 1.0) < ALIKE[1])).any())
            rows.append((order, natural / (2.0 * np.pi), damping, stable))
        before = now
    columns = np.array(rows, float).reshape(-1, 4).T
    return Chart(columns[0].astype(int), columns[1], columns[2], columns[3].astype(bool))


def _decaying(z: np.ndarray, dt: float, omega: np.ndarray, window: float) -> np.ndarray:
    """Natural frequencies [rad/s] and damping ratios (2, n_poles) of those that decay, within the band.

    Of the decay, ``window`` [1/s] is that of an exponential window.
    """
    s = np.log(np.where(z == 0.0, 1e-300, z).astype(complex)) / dt + window
    natural = np.abs(s)
    damping = -s.real / np.maximum(natural, 1e-300)
    kept = (s.imag > 0.0) & (damping > 0.0) & (damping < SEEN) & (natural >= omega[0]) & (natural <= omega[-1])
    order = np.argsort(natural[kept])
    return np.stack([natural[kept][order], damping[kept][order]])
