"""Free motion at many equally spaced times: sums of decaying waves as a product of two small tables."""

import math

import numpy as np

BLOCK = 128  # [-] times in a block, and blocks computed at a time, at most: does not change the result


def roots(omega: np.ndarray, zeta: np.ndarray) -> np.ndarray:
    """Both roots [1/s] of ``s**2 + 2 zeta omega s + omega**2`` for each mode, (2, n_modes).

    They would coincide at a damping ratio of 1: up to a millionth from it, it counts as a millionth more.
    """
    zeta = np.where(np.abs(zeta - 1.0) < 1e-6, 1.0 + 1e-6, zeta)
    split = omega * np.sqrt(zeta**2 - 1.0 + 0j)
    return np.stack([-zeta * omega + split, -zeta * omega - split])


def flexible_motion(
    omega: np.ndarray, zeta: np.ndarray, bias: np.ndarray, state: tuple[np.ndarray, np.ndarray], times: np.ndarray,
    weights: np.ndarray, order: int = 0,
) -> np.ndarray:  # fmt: skip
    """Weighted sum of a time derivative of flexible modes in free flight at equally spaced times, (n_times,).

    About its rest a mode moves as ``a exp(r t) + b exp(s t)``, or twice the real part of one of the two. An exponential
    of a time is one of the start of its block times one of the time since: the sum over the modes is a matrix product.

    ``bias`` (n_modes,) are constant modal forces; ``state`` the displacements and velocities (n_modes,) at the first
    time; ``weights`` (1, n_modes), or (2, n_modes) with one for each of `roots`. In a derivative of any ``order`` but
    zero the rest position does not count.
    """
    both, (q, p) = roots(omega, zeta), state
    q = q - bias / omega**2
    first = (p - both[1] * q) / (both[0] - both[1])
    parts = np.stack([first, q - first]) * weights * both**order  # (2, n_modes)
    waves = both[0].imag != 0.0
    parts = np.concatenate([np.where(waves, 2.0, 1.0) * parts[0], parts[1, ~waves]])
    rates = np.concatenate([both[0], both[1, ~waves]])
    block = n_blocks = min(BLOCK, math.isqrt(len(times)) + 1)  # two tables of one size are the smallest
    step = (times[-1] - times[0]) / max(1, len(times) - 1)
    table = np.hstack(_powers(rates, step * np.arange(block))).T  # (2 n_rates, block)
    real, imag = _powers(rates, step * block * np.arange(n_blocks))  # (n_blocks, n_rates)
    found = []
    for begin in range(0, len(times), block * n_blocks):
        size, turn = _powers(rates, np.array([step * begin]))
        now = parts * (size[0] + 1j * turn[0])
        rows = slice(-(-(len(times) - begin) // block))
        x, y, c, s = now.real, now.imag, real[rows], imag[rows]
        found.append((np.hstack([x * c - y * s, -x * s - y * c]) @ table).ravel())
    return np.concatenate(found)[: len(times)]


def _powers(rates: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Real and imaginary part of exp(rates times), (n_times, n_rates) each; faster than the complex exponential."""
    size, angle = np.exp(np.outer(times, rates.real)), np.outer(times, rates.imag)
    return size * np.cos(angle), size * np.sin(angle)
