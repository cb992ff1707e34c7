"""Taps as a model has them, with all held that they have in common; each from a fit to the others; measured ones beside
the bands of what values leave open, what the model lacks, and the noise."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from scipy.signal import resample

from .._base import check
from .._base.known import NINETY
from ..impact.measured import SEED, Comparison, Measured, Predicted, Trace, compare
from . import profiles, solver, windows
from .records import Taps
from .rig import FINE
from .solver import HALF_LOST, Problem, Solution
from .unknowns import TIME

DRAWS = 400  # [-] of the values of a fit, and of the noise: ends good to 0.06 of the width


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(check.Brief):
    """A tap as the model has it, with speed, onset and the unknowns that each tap has of its own fitted to it."""

    time: np.ndarray  # (n_times,) [s] of the record
    measured: np.ndarray  # (n_times,) [N]
    force: np.ndarray  # (n_times,) [N]
    speed: float  # [m/s]
    onset: float  # [s]
    own: Mapping[str, float]  # unknown freed for each tap -> its value here
    spreads: Callable[[], np.ndarray] = field(repr=False)  # finds `spread`

    @cached_property
    def spread(self) -> np.ndarray:
        """How the force moves with what the fit leaves open of its values, (n_times, n) [N], each by one deviation."""
        return self.spreads()

    @property
    def residual(self) -> np.ndarray:
        """Predicted less measured force, (n_times,) [N]."""
        return self.force - self.measured

    @property
    def error(self) -> float:
        """Root mean square of the residual over that of the measured force [-]."""
        return float(np.linalg.norm(self.residual) / np.linalg.norm(self.measured))

    @property
    def error_of_peak(self) -> float:
        """Root mean square of the residual over the record, over the measured peak [-]."""
        return float(np.sqrt(np.mean(self.residual**2)) / np.abs(self.measured).max())


def predict_tap(problem: Problem, best: Solution, tap: Taps, rise_only: bool = False) -> Prediction:
    """One tap with all unknowns held as a fit found them, but those that each tap has of its own.

    They, its speed and its onset are found from the whole record or, with ``rise_only``, until the largest force.
    """
    values = problem.values(best.x)
    n_points = problem.data.values.shape[1] - 1
    data = windows.data(tap, n_points, np.ones(1 + n_points))
    free = tuple(each for each in problem.free if each.name in problem.own)
    names = {each.name for each in free} | {TIME} | ({"contact.stiffness"} if TIME in problem.own else set())
    single = replace(  # a prediction is judged by the force
        problem, setting=replace(problem.setting, points=None, n_points=0), free=free, own=(),
        data=replace(data, values=data.values[:, :1], scale=data.scale[:, :1]),
        fixed={name: value for name, value in values.items() if name not in names},
    )  # fmt: skip
    until = int(tap.force[0].argmax()) + 1 if rise_only else None
    compared = replace(single, data=replace(single.data, values=single.data.values[..., :until]))
    own = [float(each.inside(values[each.name])) for each in free]
    momentum = np.log(HALF_LOST * tap.impulse[0])
    x = compared.aligned(np.array([*own, momentum, tap.onset[0] * tap.rate - data.lead - 1.0]))
    x = solver.solve(compared, x, solver.QUICK).x
    made = single.sampled(single.spectra(x), single.onsets(x))[0, 0] * data.scale[0, 0]
    onset = (data.lead + float(single.onsets(x)[0])) / tap.rate
    found = single.values(x)
    freed = {name: found[name] for name in (each.name.replace(TIME, "contact.stiffness") for each in free)}
    spreads = partial(_spread, problem, best, single, x)
    return Prediction(tap.time, tap.force[0], made, float(single.speeds(x)[0]), onset, freed, spreads)


def _spread(problem: Problem, best: Solution, single: Problem, x: np.ndarray) -> np.ndarray:
    """`Prediction.spread` of a tap alone at ``x``, by the derivatives of the fit and of the tap.

    What the values move is lessened by what speed, onset and own values of the tap, found from itself, take back.
    """
    whole = replace(single, free=problem.free, fixed=problem.fixed)
    table = single.values(x)
    table[TIME] = single.setting.contact_time(table)
    shared = [float(each.inside(table[each.name])) for each in problem.free]
    slopes = whole.jacobian(np.append(shared, x[single.n_shared :]))
    own = [i for i in range(slopes.shape[1]) if i >= len(shared) or problem.free[i].name in problem.own]
    held = np.setdiff1d(np.arange(len(shared)), own)
    moved = slopes[:, held] - slopes[:, own] @ np.linalg.lstsq(slopes[:, own], slopes[:, held], rcond=None)[0]
    residual = problem.residual(best.x).reshape(-1, problem.data.n_times)
    noise = profiles.variance(residual, problem.n_values)[0]
    return float(np.sqrt(noise) * single.data.scale[0, 0]) * moved @ solver.pseudo_inverse(best.jacobian)[held]


def predict_left_out(problem: Problem, x: np.ndarray, taps: Taps, rise_only: bool = False) -> tuple[Prediction, ...]:
    """Every tap of a problem, predicted from a fit to the others that begins at ``x``."""
    n_taps = problem.data.n_taps
    found = []
    for tap in range(n_taps):
        others = [i for i in range(n_taps) if i != tap]
        part, begun = problem.among(others, x)
        without = solver.solve(part, begun, close=solver.NEARLY)
        found.append(predict_tap(part, without, taps.pick(tap), rise_only))
    return tuple(found)


def rms_error(several: tuple[Prediction, ...]) -> float:
    """Root mean square of the errors of predictions [-]."""
    return float(np.sqrt(np.mean([one.error**2 for one in several])))


def widths(force: np.ndarray, rate: float) -> np.ndarray:
    """Time [s] for which records (n, n_times) exceed half their peak, of their band-limited interpolation."""
    fine = resample(force, FINE * force.shape[1], axis=1)
    above = fine - 0.5 * fine.max(axis=1, keepdims=True)
    up = np.maximum(above, 0.0)
    size = np.abs(above[:, :-1]) + np.abs(above[:, 1:])
    parts = (up[:, :-1] + up[:, 1:]) / np.maximum(size, np.finfo(float).tiny)  # straight lines between fine samples
    return parts.sum(axis=1) / (FINE * rate)


def compare_taps(taps: Taps, several: tuple[Prediction, ...], lacking: float, calibration: float) -> Comparison:
    """Peak and width of each tap, and its force, against its prediction; see `Found.against`.

    What the model is ``lacking`` [-], over the force, and the deviation of its ``calibration`` widen the bands.
    """
    rng, rate = np.random.default_rng(SEED), taps.rate
    points, columns, traces = [], [], []
    for label, one, noise in zip(taps.labels, several, taps.noise.tolist()):
        drawn = one.force + rng.standard_normal((DRAWS, one.spread.shape[1])) @ one.spread.T
        shaken = one.measured + noise * rng.standard_normal((DRAWS, len(one.measured)))
        peak, width = float(one.measured.max()), float(widths(one.measured[None], rate)[0])
        reading = NINETY * float(np.hypot(noise, calibration * peak)), NINETY * float(widths(shaken, rate).std())
        points += [
            Measured(f"{label}, peak", peak, reading[0], "N"),
            Measured(f"{label}, width", width, reading[1], "s"),
        ]
        columns += [drawn.max(axis=1), widths(drawn, rate)]
        rms = float(np.sqrt(np.mean(one.force**2)))  # what the model lacks is spread over the record as the residual
        own = NINETY * np.hypot(noise, calibration * one.force)
        band = np.hypot(own, NINETY * np.sqrt(np.square(one.spread).sum(axis=1) + (lacking * rms) ** 2))
        traces.append(Trace(label, one.time, -one.residual, own, band))
    # fixed steps and aliasing err by a hundredth of 1e-3, see `blows`
    bands = Predicted(np.column_stack(columns), computation=1e-3, model=lacking)
    return compare(tuple(points), bands, traces=tuple(traces), title="Taps against the fit")
