"""Modes that follow a measured frequency response as it is, closely spaced, without anybody picking them.

The accelerance at the point struck is taken as ``H(s) = 1 / m + sum of A s**2 / (s**2 + 2 zeta omega s + omega**2) +
R s**2`` with no A, 1 / m or R below zero. Any such sum is causal and passive: what it cannot follow of the measured
response is either noise or not that of a passive body. Poles are added where they explain most (a conditional gradient)
and then moved to fit together; the amplitudes are those of least squares above zero.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.optimize import nnls

from .._base.rounding import ROUNDING
from .._base.threads import one_thread
from . import picked
from .picked import DAMPING, GAIN

RATIOS = np.geomspace(1e-3, 0.3, 6)  # [-] damping ratios of poles that may be added, each next three times as wide
# [-] ways in which noise may have changed the amplitudes, drawn with this many standard errors: noise moves poles, too,
# which is not drawn; with 2 the true error was above the largest effect for all of one in 26 bodies, by a fifth
WAYS, SURE = 6, 2.5
DRAWS = 32  # [-] samples of the noise, of which the first are such ways
AROUND = 10  # [-] lines at least over which what is left is averaged


class MeasuredLines(NamedTuple):
    """One response, as it is fitted."""

    s: np.ndarray  # (n,) [rad/s] i omega + the damping that a window added
    data: np.ndarray  # (2 n,) weighted real over imaginary parts of the accelerance
    weight: np.ndarray  # (n,) [kg]


class Passive(NamedTuple):
    """Poles and amplitudes that follow a response."""

    poles: np.ndarray  # (2, n_modes) logarithms of natural frequencies [rad/s] and damping ratios
    amplitudes: np.ndarray  # (2 + n_modes,) 1 / mass [1/kg], compliance [m/N], squared shapes [1/kg]
    rest: np.ndarray  # (2 n,) what they leave


def columns(lines: MeasuredLines, poles: np.ndarray) -> np.ndarray:
    """Weighted accelerances of a mass, a spring and unit modes, real over imaginary parts, (2 n, 2 + n_modes)."""
    rest = lines.weight[:, None] * np.stack([np.ones_like(lines.s), lines.s**2], axis=1)
    found = np.hstack([rest, picked.unit_responses(lines.s, lines.weight, poles)[0]])
    return np.vstack([found.real, found.imag])


def fitted(lines: MeasuredLines, poles: np.ndarray) -> Passive:
    """Amplitudes above zero of given poles; poles without any are left out."""
    basis = columns(lines, poles)
    size = np.linalg.norm(basis, axis=0)
    basis /= size
    triangle = _triangle(basis)
    projected = solve_triangular(triangle, basis.T @ lines.data, trans="T")
    found = nnls(triangle, projected, maxiter=30 * len(size))[0]
    used = found[2:] > 0.0
    rest, found = lines.data - basis @ found, found / size
    return Passive(poles[:, used], np.append(found[:2], found[2:][used]), rest)


def _triangle(basis: np.ndarray) -> np.ndarray:
    """Upper triangle whose square is that of columns of unit size, of which two may be alike.

    It is several times as fast as by their own triangle.
    """
    return np.asarray(cholesky(basis.T @ basis + ROUNDING * np.eye(basis.shape[1])))


def follow_response(lines: MeasuredLines) -> Passive:
    """The sum that follows a response until what is left looks like noise.

    It begins with poles above the band. Up to a dozen are then added in each of at most 25 rounds, and all are moved
    twice before more are added.
    """
    top, low = lines.s.imag[-1], lines.s.imag[0]
    beyond = top * np.array([1.02, 1.06, 1.12, 1.2, 1.35, 1.6, 2.2, 4.0])
    kept = fitted(lines, np.log(np.stack([beyond, np.full(len(beyond), 0.02)])))
    # poles that may be added (2, n), half a width apart, and their columns (2 n_lines, n) of unit size
    places, spacing = [], np.diff(lines.s.imag).min()
    for ratio in RATIOS:
        at = low
        while at < 1.3 * top:
            places.append((at, ratio))
            at += max(0.7 * (ratio * at + lines.s.real[0]), 0.5 * spacing)
    offered = np.log(np.array(places).T)
    parts = [columns(lines, piece)[:, 2:].astype(np.float32) for piece in np.array_split(offered, 20, axis=1)]
    matrix = np.hstack(parts)
    matrix /= np.linalg.norm(matrix, axis=0)
    for _ in range(25):
        before = np.square(kept.rest).sum()
        noise = before / max(1, len(kept.rest) - 3 * kept.poles.shape[1])
        gains = np.maximum(matrix.T @ kept.rest.astype(np.float32), 0.0) ** 2
        more: list[int] = []
        near = np.exp(offered[0])
        while len(more) < 12 and gains.max() > GAIN * noise:
            best = int(gains.argmax())
            more.append(best)
            width = 2.0 * np.exp(offered[:, best]).prod() + 2.0 * lines.s.real[0] + 2.0 * low
            gains[np.abs(near - near[best]) <= width] = 0.0
        if not more:
            break
        kept = _moved(lines, fitted(lines, np.hstack([kept.poles, offered[:, more]])))
        if before - np.square(kept.rest).sum() < GAIN * noise:
            break
    return kept


def _moved(lines: MeasuredLines, kept: Passive) -> Passive:
    """The poles moved by two damped Gauss-Newton steps, amplitudes eliminated (Kaufman 1975, BIT 15, 49-57)."""
    caution = 1e-2
    for _ in range(2):
        n = kept.poles.shape[1]
        basis = columns(lines, kept.poles)[:, np.append(kept.amplitudes[:2] > 0.0, np.ones(n, bool))]
        basis /= np.linalg.norm(basis, axis=0)
        slopes = np.hstack(list(picked.unit_responses(lines.s, lines.weight, kept.poles)[1]))
        steep = np.vstack([slopes.real, slopes.imag]) * np.tile(kept.amplitudes[2:], 2)  # (2 n_lines, 2 n)
        steep -= basis @ cho_solve((_triangle(basis), False), basis.T @ steep)
        square, slope = steep.T @ steep, steep.T @ kept.rest
        cost = np.square(kept.rest).sum()
        for _ in range(4):
            step = np.linalg.solve(square + np.diag(caution * np.diag(square) + 1e-12 * square.trace()), slope)
            poles = kept.poles + np.clip(step, -0.5, 0.5).reshape(2, n)
            poles[1] = np.clip(poles[1], np.log(DAMPING[0]), np.log(0.7))
            trial = fitted(lines, poles)
            if np.square(trial.rest).sum() < cost:
                kept, caution = trial, 0.1 * caution
                break
            caution *= 10.0
        else:
            break
    return kept


class Following(NamedTuple):
    """What follows measured responses, as `Modes` take it."""

    arrays: dict[str, Any]  # frequencies, damping ratio, shapes, points
    doubt: np.ndarray  # (n_ways, n_points, n_modes) [-] relative errors of squared shapes
    rest: np.ndarray  # (2,) [m/N] what modes above the band yield at the point struck, and its error
    loose: float  # [kg**-0.5] of a rigid motion at the point struck that noise may hide; 0 if one was found
    driving: int  # row of the point struck
    notes: list[str]


@one_thread
def body_of(found: Any, driving: Any, points: Any) -> Following:
    """Modes, what is left out of them, and their errors, that follow frequency responses from or to one point."""
    s, values, _, lines_used = picked.responses("frf", found)
    drive, used, sign, end = picked.find_driving_point(found, driving)
    values = values[:, used] * sign
    own = used.index(drive)
    power = (values[:, own] / s * np.abs(s)).real  # goes into a passive body
    picked.check_driving(found, drive, np.array([power.sum()]), values[:, own] != 0.0)
    if len(s) < 2 * AROUND:
        raise ValueError(f"frf must have at least {2 * AROUND} lines where its force has power, got {len(s)}")
    noise = _noise(found, lines_used, used, np.abs(values))
    # no line weighs more, however little the taps differ
    weight = 1.0 / np.maximum(np.hypot(noise, 1e-3 * np.abs(values)), ROUNDING * np.abs(values).max())
    rows = [(values[:, k] * weight[:, k]).view(float).reshape(-1, 2).T.ravel() for k in range(len(used))]
    lines = MeasuredLines(s, rows[own], weight[:, own])
    kept = follow_response(lines)
    order, n = np.argsort(kept.poles[0]), kept.poles.shape[1]
    kept = Passive(kept.poles[:, order], np.append(kept.amplitudes[:2], kept.amplitudes[2:][order]), kept.rest)
    natural, damping = np.exp(kept.poles)
    inside = np.append([kept.amplitudes[0] > 0.0, False], natural <= s.imag[-1])
    if not inside.any():
        raise ValueError(f"frf must follow from modes at the point struck, {picked.label(found, drive)}; none does")
    basis = columns(lines, kept.poles)
    spread = np.sqrt(max(1.0, 2.0 * np.square(kept.rest).sum() / max(1, len(kept.rest) - 3 * n)))
    size = np.linalg.norm(basis, axis=0)
    changed = np.linalg.lstsq(basis / size, spread * _drawn(found, lines, noise[:, own], lines_used), rcond=1e-6)[0]
    changed *= SURE / size[:, None]  # (2 + n_modes, DRAWS)
    above = np.where(inside, 0.0, np.append([0.0, 1.0], natural**-2.0))
    rest = np.array([above @ kept.amplitudes, np.sqrt(np.square(above @ changed).mean())])
    loose = 0.0 if inside[0] else float(np.square(changed[0]).mean() ** 0.25)
    squares, own_modes = kept.amplitudes[inside], np.delete(inside, 1)  # without the spring
    drawn = changed[inside, :WAYS].T / squares
    step = _in_step(lines, kept, noise[:, own], natural, damping)
    steps = np.append(step[:1].sum() * inside[0], step)[own_modes]
    doubt = np.clip(drawn, -1.0, None)[:, None] + steps
    shapes = []
    for k, row in enumerate(rows):  # amplitudes [1/kg] of the same modes in all responses, of either sign
        each = columns(MeasuredLines(s, row, weight[:, k]), kept.poles)
        long = np.linalg.norm(each, axis=0)
        shapes.append((np.linalg.lstsq(each / long, row, rcond=1e-6)[0] / long)[inside])
    shapes[own] = squares
    off = np.linalg.norm(kept.rest) / np.linalg.norm(lines.data)
    notes = [f"follows frequency responses up to {s.imag[-1] / (2.0 * np.pi):.5g} Hz as a passive body, which leaves "
             f"{100.0 * off:.2g} % rms, {spread:.2g} times the noise"]  # fmt: skip
    omega = np.append(0.0, natural)[own_modes]
    arrays = {
        "frequencies": omega / (2.0 * np.pi), "damping_ratio": np.append(0.0, damping)[own_modes],
        "shapes": np.array(shapes) / np.sqrt(squares),
        "points": picked.response_points(found, points, used, end),
    }  # fmt: skip
    return Following(arrays, np.broadcast_to(doubt, (WAYS, len(used), len(omega))).copy(), rest, loose, own, notes)


def _noise(found: Any, lines: np.ndarray, used: list[int], size: np.ndarray) -> np.ndarray:
    """Standard deviation of complex accelerances (n, n_used) [1/kg], estimated from errors or the coherence."""
    deviation = np.full(size.shape, np.nan)
    if "error" in found:
        values = np.abs(found["H"].values)[lines][:, used]
        deviation = found["error"].values[lines][:, used] / np.maximum(values, 1e-300) * size / np.sqrt(-np.log(0.1))
    if not np.isfinite(deviation).all() and "coherence" in found:
        part = np.clip(found["coherence"].values[lines][:, used], 1e-6, 1.0)
        deviation = size * np.sqrt((1.0 - part) / (part * max(1, int(found.attrs.get("averages", 1)))))
    return deviation if np.isfinite(deviation).all() else np.broadcast_to(1e-2 * np.median(size, axis=0), size.shape)


def _drawn(found: Any, lines: MeasuredLines, noise: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Samples (2 n, DRAWS) of the weighted noise, alike in lines closer than the windows resolve."""
    omega, rng = lines.s.imag, np.random.default_rng(0)
    spacing = np.diff(omega).min()
    index = np.rint(omega / spacing).astype(int)
    count = 2 * (int(index[-1]) + 1)
    time = 2.0 * np.pi / spacing * np.arange(count) / count
    size = np.abs(lines.data.reshape(2, -1) / lines.weight)
    force = found["force_error"].values[used] * np.hypot(*size) if "force_error" in found else 0.0 * noise
    force = np.minimum(np.nan_to_num(force), noise)
    length = float(found.attrs.get("force_window", 0.0)) or np.inf
    whole = np.zeros((DRAWS, len(omega)), complex)
    for shade, part in (
        (np.exp(-lines.s.real[0] * time), np.sqrt(noise**2 - force**2)), (np.where(time <= length, 1.0, 0.0), force)
    ):  # fmt: skip
        rows = np.fft.rfft(rng.standard_normal((DRAWS, count)) * shade)[:, index]
        whole += part * rows / np.sqrt(np.square(shade).sum())
    whole *= lines.weight
    return np.hstack([whole.real, whole.imag]).T


def _in_step(
    lines: MeasuredLines, kept: Passive, noise: np.ndarray, natural: np.ndarray, damping: np.ndarray
) -> np.ndarray:
    """What is left of the response around each mode beyond noise, and what the end of the record cut off, [-]."""
    omega, size = lines.s.imag, lines.data.reshape(2, -1) / lines.weight
    left = np.square(kept.rest.reshape(2, -1) / lines.weight).sum(axis=0) - noise**2
    whole, spacing = np.square(size).sum(axis=0), np.diff(omega).min()
    found = np.zeros(len(natural))
    for i, (at, ratio) in enumerate(zip(natural, damping)):
        near = np.abs(omega - at) <= max(ratio * at, AROUND * spacing)
        near |= np.abs(omega - at) <= np.abs(omega - at).min()
        found[i] = np.sqrt(max(0.0, left[near].sum() / whole[near].sum()))
    ends = np.exp(-(damping * natural + lines.s.real[0]) * 2.0 * np.pi / spacing)
    return np.asarray(np.hypot(found, ends))
