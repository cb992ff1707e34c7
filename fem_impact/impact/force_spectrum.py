"""The Fourier transform of a force history that is linear between its samples.

Gauss nodes replace the pieces by impulses, exactly enough for the frequencies asked for. Many impulses are collected in
equal time cells, so short that exp(-i omega t) is a power series of few terms within a cell. One fast transform over
the cells then sums each term at all frequencies.
"""

from math import factorial, isqrt
from typing import Any

import numpy as np
from scipy import fft, special

from .._base import check

MOST_PERIODS = 2.0**18  # [-] periods of the highest frequency in a blow whose centroid is sought: takes half a second
WINDOW = 8  # [-] half width of the window that interpolates from twice as many even frequencies: errs by 4e-16
BETA = 1.5 * np.pi * WINDOW  # [-] fact: best shape of the window, that of Kaiser and Bessel
# Gauss rules, and half the phase [rad] over a piece at which they err by 1e-15 of its force, by their error term
RULES = {n: np.polynomial.legendre.leggauss(n) for n in range(2, 12)}
REACH = {
    n: (1e-15 * (2 * n + 1) * factorial(2 * n) ** 3 / (n * 2 ** (2 * n + 1) * factorial(n) ** 4)) ** (1 / (2 * n - 1))
    for n in RULES
}

Pieces = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def straight_pieces(time: np.ndarray, force: np.ndarray) -> Pieces:
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

    Errs by rounding: that of the phases, and 2e-14 of the integral of the force's magnitude.
    """
    t, h, _, _ = pieces
    n, n_terms = len(frequencies), len(t) * len(frequencies)
    if n_terms <= 2**12:  # the direct sum is faster
        return spectrum_in_closed_form(pieces, frequencies)
    step = frequencies[1] if n > 1 else 0.0
    # but for their rounding, from zero on
    evenly = step > 0.0 and np.abs(frequencies - step * np.arange(n)).max() <= 1e-15 * frequencies[-1]
    span = t[-1] + h[-1]
    if not evenly:
        step = 0.5 / span
    count = n if evenly else np.floor(np.abs(frequencies).max() / step) + WINDOW + 1.0
    half_phase = np.pi * step * (count - 1.0) * h
    rule = min(REACH, key=lambda n: n * np.ceil(half_phase / REACH[n]).sum())
    parts = np.maximum(np.ceil(half_phase / REACH[rule]), 1.0)  # into which a long piece is cut
    # as many nodes or cells as the direct sum has terms cost more, and beyond 2**24 more than two gigabytes
    if not max(rule * parts.sum(), 2.0 * count) <= min(n_terms, 2**24):
        return spectrum_in_closed_form(pieces, frequencies)
    time, impulse = _impulses(pieces, rule, parts.astype(int))
    if evenly:
        return transform_impulses(time, impulse, step, n)
    return _interpolated(time, impulse, span, int(count), frequencies)


def spectrum_in_closed_form(pieces: Pieces, frequencies: np.ndarray) -> np.ndarray:
    """The same, summed over the closed forms of all pieces: for few of them, and for very high frequencies.

    About its middle a piece has the mean force times sinc and half its rise times the first spherical Bessel function.
    Zero where the phases, by their rounding, err by more than the force can have there.
    """
    t, h, f0, f1 = pieces
    omega = 2.0 * np.pi * frequencies
    total = np.zeros(len(omega), complex)
    rounding = np.finfo(float).eps * (t + h).max(initial=0.0) * (0.5 * h * np.abs(f0 + f1)).sum()
    jumps, turns = _unevenness(pieces)
    known = np.flatnonzero(np.abs(omega) ** 3 * rounding <= np.abs(omega) * jumps + turns)
    for block in np.array_split(known, max(1, len(known) * len(h) // 2**20)):
        y = omega[block, None] * (0.5 * h)  # (n_block, n_pieces)
        whole = 0.5 * h * ((f0 + f1) * np.sinc(y / np.pi) - 1j * (f1 - f0) * special.spherical_jn(1, y))
        total[block] = (np.exp(-1j * omega[block, None] * (t + 0.5 * h)) * whole).sum(axis=1)
    return total


def _unevenness(pieces: Pieces) -> tuple[float, float]:
    """Sums of the jumps [N] of a force and of its slope [N/s]; over omega and omega**2 they bound its transform."""
    _, h, f0, f1 = pieces
    jumps = np.abs(np.diff(np.column_stack([f0, f1]).ravel(), prepend=0.0, append=0.0))
    jumps[1::2][h > 0.0] = 0.0
    slope = np.divide(f1 - f0, h, out=np.zeros(len(h)), where=h > 0.0)
    turns = np.abs(np.diff(slope, prepend=0.0, append=0.0))
    rest = np.flatnonzero(f1[:-1] == 0.0)  # here there may be a pause
    turns[rest + 1] = np.abs(slope[rest]) + np.abs(slope[rest + 1])
    return float(jumps.sum()), float(turns.sum())


def _impulses(pieces: Pieces, rule: int, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and impulses [N s] at Gauss nodes in every part of every piece, ascending."""
    t, h, f0, f1 = (np.repeat(x, parts) for x in pieces)
    number = np.arange(len(t)) - np.repeat(np.cumsum(parts) - parts, parts)  # of a part within its piece
    n_parts = np.repeat(parts, parts)
    nodes, weights = RULES[rule]
    share = (number + 0.5 * (nodes[:, None] + 1.0)) / n_parts
    impulse = (h / n_parts * (0.5 * weights[:, None])) * (f0 + (f1 - f0) * share)  # (rule, n_parts)
    return (t + h * share).T.ravel(), impulse.T.ravel()


def transform_impulses(time: np.ndarray, impulse: np.ndarray, step: float, count: int) -> np.ndarray:
    """Sum of impulse exp(-i omega time) at frequencies 0, step, 2 step, ... [Hz], (count,).

    A few are summed as a product of two small tables, more by cells of half a period: of 300 both take as long.
    """
    if len(time) < 300:
        block = isqrt(max(0, count - 1)) + 1
        turns = -2j * np.pi * step * np.outer(np.arange(block), time)
        return np.asarray((np.exp(block * turns) * impulse @ np.exp(turns).T).ravel()[:count])
    # a fast transform of this length repeats itself over the cells, so that later ones may be folded into it
    n_cells = fft.next_fast_len(max(1, 2 * (count - 1)), real=True)
    place = time * (step * n_cells)
    near = np.rint(place)
    first = np.append(0, np.flatnonzero(near[1:] != near[:-1]) + 1)  # node of every cell
    cell, beside = near[first].astype(int) % n_cells, place - near
    sums = [np.add.reduceat(impulse, first)]
    for k in range(1, 22):  # for phases up to pi / 2, those of a cell's ends, a series of so many terms errs by 2e-17
        impulse = impulse * (beside / k)
        sums.append(np.add.reduceat(impulse, first))
    turn, total = -2j * np.pi / n_cells * np.arange(count), np.zeros(count, complex)
    for some in np.array_split(sums[::-1], min(len(sums), 1 + len(sums) * n_cells // 2**22)):  # to limit the memory
        for spectrum in fft.rfft([np.bincount(cell, each, n_cells) for each in some]):
            total = total * turn + spectrum[:count]
    return total


def _interpolated(
    time: np.ndarray, impulse: np.ndarray, span: float, count: int, frequencies: np.ndarray
) -> np.ndarray:
    """The same at any frequencies, from ``count`` even ones, twice as many as the time up to ``span`` [s] needs.

    The impulses are divided by the transform of a Kaiser-Bessel window about the middle, which then interpolates.
    """
    step, middle = 0.5 / span, 0.5 * span
    root = np.sqrt(BETA**2 - (2.0 * np.pi * WINDOW * step * (time - middle)) ** 2)
    even = transform_impulses(
        time, impulse * root * np.exp(-root) / WINDOW, step, count
    )  # 2 sinh is exp to rounding: root > 33
    place = frequencies / step
    near = np.floor(place).astype(int)[:, None] + np.arange(1 - WINDOW, WINDOW + 1)  # (n_frequencies, 2 WINDOW)
    weight = special.i0(BETA * np.sqrt(np.clip(1.0 - ((place[:, None] - near) / WINDOW) ** 2, 0.0, None)))
    value = even[np.abs(near)]
    value.imag[near < 0] *= -1.0
    quarter = np.array([1.0, 1j, -1.0, -1j])[near % 4]  # exp(2 pi i middle step near)
    return (weight * quarter * value).sum(axis=1) * np.exp(-2j * np.pi * middle * frequencies)


def dense_frequencies(max_frequency: float, span: float) -> np.ndarray:
    """Frequencies [Hz] from zero, dense enough for the spectrum of a blow whose last contact ends at ``span`` [s]."""
    limit = check.positive("max_frequency", max_frequency, "Hz")
    if span == 0.0:
        raise ValueError("spectral_centroid needs a contact, but the bodies never touched; check gap and speed")
    if limit * span > MOST_PERIODS:
        raise ValueError(f"max_frequency must be at most {MOST_PERIODS / span:.4g} Hz for a blow of {span:.4g} s")
    return np.linspace(0.0, limit, int(np.clip(256.0 * limit * span, 4096, 65536)))


def centroid(frequencies: np.ndarray, spectrum: np.ndarray) -> float:
    """Mean frequency [Hz] of a spectrum's magnitude over even frequencies (n,) from zero, complex or real.

    The magnitude has a corner where the spectrum passes zero, anywhere between two frequencies. There the spectrum, as
    if all impulse came at time zero, is nearly straight and is filled in.
    """
    place = np.arange(len(frequencies))
    turn = np.angle(spectrum[1] / spectrum[0]) if spectrum[0] else 0.0
    fine = np.linspace(0.0, place[-1], 8 * int(place[-1]) + 1)
    size = np.abs(np.interp(fine, place, spectrum * np.exp(-1j * turn * place)))
    return float(frequencies[1] * np.trapezoid(fine * size, fine) / np.trapezoid(size, fine))


def magnitude(time: np.ndarray, force: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    """Magnitude of the spectrum [N s] of one force (n_times,) [N]."""
    return np.abs(of_pieces(straight_pieces(time, force[:, None]), frequencies))


def fastest(hit: Any, rate: float) -> float:
    """Angular frequency [rad/s] up to which a blow's force has what counts in samples of a rate [Hz].

    Six times the root mean square of its own, that of its slope over that of itself: the third lobe of a half sine.
    """
    force, apart = hit.force.reshape(len(hit.time), -1), np.diff(hit.time)[:, None]
    steep = (np.diff(force, axis=0) ** 2 / np.where(apart > 0.0, apart, np.inf)).sum()
    whole = 0.5 * ((force[1:] ** 2 + force[:-1] ** 2) * apart).sum()
    return min(6.0 * float(steep / whole) ** 0.5, np.pi * rate) if whole > 0.0 else 0.0
