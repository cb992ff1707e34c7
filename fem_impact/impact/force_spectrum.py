"""The Fourier transform of a force history that is linear between its samples."""

import numpy as np
from scipy import fft, special

from .compiled import build, many_blows

LEAST_SAMPLES = 800.0  # [-] per impact: its spectrum errs by less than 1e-3 up to the thirtieth lobe
MOST_TERMS = 2 * 10**7  # [-] pieces times frequencies of a spectrum summed directly: takes three seconds; above it, FFT
MOST_PERIODS = 2.0**18  # [-] periods of the highest frequency in a blow: the FFT then takes half a gigabyte
GRID = 8  # [-] time cells per half period of the highest frequency, in the FFT of a long blow
WINDOW, BETA = 6, 28.1  # [-] half width and shape of the window for an FFT of twice the length: errs by 1e-11

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
    """Integral of F exp(-i omega t) [N s] at frequencies (n_frequencies,) [Hz], complex."""
    t, h, f0, f1 = pieces
    if len(t) * len(frequencies) > MOST_TERMS and 0.0 < np.abs(frequencies).max() * (t[-1] + h[-1]) < MOST_PERIODS:
        return _by_transform(pieces, frequencies)
    omega = 2.0 * np.pi * frequencies
    total = np.zeros(len(omega), complex)
    for block in np.array_split(np.arange(len(omega)), max(1, len(omega) * len(h) // 2**20)):
        x = omega[block, None] * h  # (n_block, n_pieces)
        small = np.abs(x) < 1e-2
        safe = np.where(small, 1.0, x)
        edge = np.exp(-1j * safe)
        mean = np.where(small, 1.0 - 0.5j * x - x**2 / 6.0 + 1j * x**3 / 24.0, (1.0 - edge) / (1j * safe))
        ramp = np.where(
            small, 0.5 - 1j * x / 3.0 - x**2 / 8.0 + 1j * x**3 / 30.0, (edge * (1.0 + 1j * safe) - 1.0) / safe**2
        )
        start = np.exp(-1j * omega[block, None] * t)
        total[block] = (start * h * (f0 * mean + (f1 - f0) * ramp)).sum(axis=1)
    return total


def evenly(pieces: Pieces, frequencies: np.ndarray) -> np.ndarray:
    """The same at evenly spaced frequencies from zero on, by the compiled sum unless the transform is faster."""
    if not build.COMPILED or len(pieces[0]) * len(frequencies) > MOST_TERMS:
        return of_pieces(pieces, frequencies)
    total = np.zeros(len(frequencies), complex)
    many_blows.straight_spectrum(2.0 * np.pi * frequencies[1], *pieces, total)
    return total


def _by_transform(pieces: Pieces, frequencies: np.ndarray) -> np.ndarray:
    """The spectrum by FFT, (n_frequencies,), for a blow of so many pieces that the direct sum would take minutes.

    The force is replaced by its exact impulses in equal time cells; aliasing is small because the band ends far
    below the cell rate. A Kaiser-Bessel window interpolates from the FFT frequencies to the requested ones.
    """
    t, h, f0, f1 = pieces
    span = t[-1] + h[-1]
    before = np.concatenate([[0.0], np.cumsum(0.5 * h * (f0 + f1))])
    step = min(0.5 / (GRID * np.abs(frequencies).max()), span / LEAST_SAMPLES)
    edges = step * np.arange(int(span / step) + 2)
    row = np.clip(np.searchsorted(t, edges, side="right") - 1, 0, None)
    part = np.clip((edges - t[row]) / h[row], 0.0, 1.0)
    impulse = np.diff(before[row] + h[row] * part * (f0[row] + 0.5 * (f1 - f0)[row] * part))
    middle, length = 0.5 * (len(impulse) - 1), fft.next_fast_len(2 * len(impulse))
    root = np.sqrt(BETA**2 - (2.0 * np.pi * WINDOW / length * (np.arange(len(impulse)) - middle)) ** 2)
    even = fft.fft(impulse * root / (2.0 * WINDOW * np.sinh(root)), length)
    place = frequencies * step * length
    near = np.floor(place).astype(int)[:, None] + np.arange(1 - WINDOW, WINDOW + 1)  # (n_frequencies, 2 WINDOW)
    weight = special.i0(BETA * np.sqrt(np.clip(1.0 - ((place[:, None] - near) / WINDOW) ** 2, 0.0, None)))
    turn = np.exp(2j * np.pi * middle / length * near)
    found = (weight * turn * even[near % length]).sum(axis=1)
    return found * np.exp(-2j * np.pi * frequencies * step * (middle + 0.5)) / np.sinc(frequencies * step)


def magnitude(time: np.ndarray, force: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    """Magnitude of the spectrum [N s] by the trapezoidal rule: three times as fast, for the live page."""
    weights = np.zeros(len(time))
    weights[1:] = 0.5 * np.diff(time)
    weights[:-1] += 0.5 * np.diff(time)
    used = force > 0.0
    turns = np.exp(-2j * np.pi * np.outer(frequencies, time[used]))  # (n_frequencies, n_times)
    return np.abs(turns @ (weights * force)[used])
