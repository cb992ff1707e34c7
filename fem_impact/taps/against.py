"""Measured taps beside the bands of a fit: what its values leave open, what the model lacks, and the noise."""

from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import resample

from ..impact.measured import SEED, SURE, Comparison, Measured, Predicted, Trace, compare
from .predictions import Prediction
from .records import Taps
from .rig import FINE

if TYPE_CHECKING:
    from .found import Found

DRAWS = 400  # [-] of the values of a fit, and of the noise: ends good to 0.06 of the width
STEPS = 1e-3  # [-] error of the computation: fixed steps and aliasing, see `blows`, err by a hundredth of it


def widths(force: np.ndarray, rate: float) -> np.ndarray:
    """Time [s] for which records (n, n_times) exceed half their peak, of their band-limited interpolation."""
    fine = resample(force, FINE * force.shape[1], axis=1)
    above = fine - 0.5 * fine.max(axis=1, keepdims=True)
    up = np.maximum(above, 0.0)
    size = np.abs(above[:, :-1]) + np.abs(above[:, 1:])
    return ((up[:, :-1] + up[:, 1:]) / np.maximum(size, np.finfo(float).tiny)).sum(axis=1) / (
        FINE * rate
    )  # straight lines between the fine samples


def compared(found: "Found", taps: Taps, predictions: tuple[Prediction, ...], calibration: float) -> Comparison:
    """Peak and width of each tap, and its force, against its prediction; see `Found.against`."""
    rng, rate = np.random.default_rng(SEED), taps.rate
    lacking = found.misfit
    points, columns, traces = [], [], []
    for label, one, noise in zip(taps.labels, predictions, taps.noise.tolist()):
        drawn = one.force + rng.standard_normal((DRAWS, one.spread.shape[1])) @ one.spread.T
        shaken = one.measured + noise * rng.standard_normal((DRAWS, len(one.measured)))
        peak, width = float(one.measured.max()), float(widths(one.measured[None], rate)[0])
        reading = SURE * float(np.hypot(noise, calibration * peak)), SURE * float(widths(shaken, rate).std())
        points += [
            Measured(f"{label}, peak", peak, reading[0], "N"),
            Measured(f"{label}, width", width, reading[1], "s"),
        ]
        columns += [drawn.max(axis=1), widths(drawn, rate)]
        rms = float(np.sqrt(np.mean(one.force**2)))  # what the model lacks is spread over the record as the residual
        own = SURE * np.hypot(noise, calibration * one.force)
        band = np.hypot(own, SURE * np.sqrt(np.square(one.spread).sum(axis=1) + (lacking * rms) ** 2))
        traces.append(Trace(label, one.time, -one.residual, own, band))
    predicted = Predicted(np.column_stack(columns), computation=STEPS, model=lacking)
    return compare(tuple(points), predicted, traces=tuple(traces), title="Taps against the fit")
