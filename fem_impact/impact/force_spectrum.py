"""The Fourier transform of a force history that is linear between its samples.

Gauss nodes replace the pieces by impulses, exactly enough for the frequencies asked for. The impulses are collected in
equal time cells, so short that exp(-i omega t) is a power series of few terms within a cell. One fast transform over
the cells then sums each term at all frequencies.
"""

from collections.abc import Callable
from math import factorial

import numpy as np
from scipy import fft, special

LEAST_SAMPLES = 800.0  # [-] per impact: its spectrum errs by less than 1e-3 up to the thirtieth lobe
FEW = 2**12  # [-] pieces times frequencies up to which the direct sum is faster
MOST_PERIODS = 2.0**18  # [-] periods of the highest frequency in a blow whose centroid is sought: takes half a second
MOST_NODES = 2**24  # [-] nodes or cells of a transform: they take two gigabytes; above it, the direct sum
TERMS = 14  # [-] of the series: for phases up to a half, that of a cell's end, they leave 0.5**14 / 14! = 7e-16
WINDOW = 8  # [-] half width of the window that interpolates from a transform of twice the length: errs by 4e-16
BETA = 1.5 * np.pi * WINDOW  # [-] shape of the window, that of Kaiser and Bessel
EVEN = 1e-15  # [-] of the highest frequency: rounding of frequencies that are evenly spaced from zero on
SERIES = 0.5  # [rad] half the phase over a piece below which the first spherical Bessel function takes its series
# For n Gauss nodes, half the phase [rad] over a piece at which they err by 1e-15 of its force, by their error term
REACH = {
    n: (1e-15 * (2 * n + 1) * factorial(2 * n) ** 3 / (n * 2 ** (2 * n + 1) * factorial(n) ** 4)) ** (1 / (2 * n - 1))
    for n in range(2, 12)
}

Pieces = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def pieces(time: np.ndarray, force: np.ndarray) -> Pieces:
    """Start [s], length [s], first and last force [N] of all straight pieces that carry force.

    Parameters
    ----------
    time : ndarray, shape (n_times,) [s]
    force : ndarray, shape (n_times, n_contacts) [N]
    """
    force = force.sum(axis=1)
    keep = (force[1:] != 0.0) | (force[:-1] != 0.0)
    return time[:-1][keep], np.diff(time)[keep], force[:-1][keep], force[1:][keep]


def of_pieces(pieces: Pieces, frequencies: np.ndarray) -> np.ndarray:
    """Integral of F exp(-i omega t) [N s] at frequencies (n_frequencies,) [Hz], complex.

    Errs by rounding: of the phases, and 1e-14 of the integral of the force's magnitude.
    """
    t, h, _, _ = pieces
    n_terms = len(t) * len(frequencies)
    if n_terms <= FEW:
        return directly(pieces, frequencies)
    top = 2.0 * np.pi * float(np.abs(frequencies).max())
    phase = 0.5 * top * h
    count = min(REACH, key=lambda n: n * np.ceil(phase / REACH[n]).sum())
    parts = np.ceil(phase / REACH[count])  # into which a long piece is cut
    size = max(count * parts.sum(), top * (t[-1] + h[-1]))  # the number of nodes or of cells
    if not 0.0 < size <= min(n_terms, MOST_NODES):
        return directly(pieces, frequencies)
    return _transform(*_impulses(pieces, count, parts.astype(int)), frequencies)


def directly(pieces: Pieces, frequencies: np.ndarray) -> np.ndarray:
    """The same, summed over the closed forms of all pieces: for few of them, and for very high frequencies.

    About its middle a piece has the mean force times sinc and half its rise times the first spherical Bessel function.
    """
    t, h, f0, f1 = pieces
    omega = 2.0 * np.pi * frequencies
    total = np.zeros(len(omega), complex)
    for block in np.array_split(np.arange(len(omega)), max(1, len(omega) * len(h) // 2**20)):
        y = omega[block, None] * (0.5 * h)  # (n_block, n_pieces)
        square = y * y
        near = np.ones_like(y)
        for k in range(6, 0, -1):
            near = 1.0 - square / (2 * k * (2 * k + 3)) * near
        safe = np.where(np.abs(y) < SERIES, 1.0, y)
        bessel = np.where(np.abs(y) < SERIES, y / 3.0 * near, (np.sin(safe) / safe - np.cos(safe)) / safe)
        whole = 0.5 * h * ((f0 + f1) * np.sinc(y / np.pi) - 1j * (f1 - f0) * bessel)
        total[block] = (np.exp(-1j * omega[block, None] * (t + 0.5 * h)) * whole).sum(axis=1)
    return total


def _impulses(pieces: Pieces, count: int, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and impulses [N s] at ``count`` Gauss nodes in every part of every piece, ascending."""
    t, h, f0, f1 = (np.repeat(x, parts)[:, None] for x in pieces)
    number = np.arange(len(t)) - np.repeat(np.cumsum(parts) - parts, parts)  # of a part within its piece
    n_parts = np.repeat(parts, parts)[:, None]
    nodes, weights = np.polynomial.legendre.leggauss(count)
    share = (number[:, None] + 0.5 * (nodes + 1.0)) / n_parts  # (n_parts, count)
    return (t + h * share).ravel(), (h / n_parts * (0.5 * weights) * (f0 + (f1 - f0) * share)).ravel()


def _transform(time: np.ndarray, impulse: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    """Sum of impulse exp(-i omega time) at frequencies (n_frequencies,), by cells of at most a radian."""
    n = len(frequencies)
    step = frequencies[1] if n > 1 else 0.0
    evenly = step > 0.0 and np.abs(frequencies - step * np.arange(n)).max() <= EVEN * frequencies[-1]
    if evenly:
        # the transform's own frequencies; it repeats itself over the cells, so that they may be folded
        n_cells = fft.next_fast_len(int(np.ceil(2.0 * np.pi * (n - 1))), real=True)
        rate, turn = step * n_cells, 2.0 * np.pi / n_cells * np.arange(n)
    else:
        rate = 2.0 * np.pi * np.abs(frequencies).max()
        n_cells, turn = int(np.rint(time[-1] * rate)) + 1, 2.0 * np.pi * frequencies / rate
    near = np.rint(time * rate)
    cell, beside = near.astype(int) % n_cells, time * rate - near
    over_cells = (lambda sums: fft.rfft(sums)[:n]) if evenly else _interpolation(n_cells, turn)
    factor, total = np.ones(n, complex), np.zeros(n, complex)
    for k in range(TERMS):
        total += factor * over_cells(np.bincount(cell, impulse, n_cells))
        impulse, factor = impulse * beside, factor * turn * (-1j / (k + 1.0))
    return total


def _interpolation(n_cells: int, turn: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """The function that sums numbers times exp(-i turn cell) over all cells, at turns (n_turns,) of at most a radian.

    A Kaiser-Bessel window interpolates from the frequencies of a fast transform of twice the length.
    """
    middle, length = 0.5 * (n_cells - 1), fft.next_fast_len(2 * n_cells + 4 * WINDOW)
    root = np.sqrt(BETA**2 - (2.0 * np.pi * WINDOW / length * (np.arange(n_cells) - middle)) ** 2)
    window = root / (2.0 * WINDOW * np.sinh(root))
    place = turn * length / (2.0 * np.pi)
    near = np.floor(place).astype(int)[:, None] + np.arange(1 - WINDOW, WINDOW + 1)  # (n_turns, 2 WINDOW)
    weight = special.i0(BETA * np.sqrt(np.clip(1.0 - ((place[:, None] - near) / WINDOW) ** 2, 0.0, None)))
    weight = weight * np.exp(1j * middle * (2.0 * np.pi / length * near - turn[:, None]))
    near %= length
    return lambda sums: np.einsum("tk,tk->t", weight, fft.fft(sums * window, length)[near])


def magnitude(time: np.ndarray, force: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    """Magnitude of the spectrum [N s] of one force (n_times,) [N]."""
    return np.abs(of_pieces(pieces(time, force[:, None]), frequencies))
