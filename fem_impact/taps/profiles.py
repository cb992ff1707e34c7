"""How well the data determine a value: profiles of the likelihood over it, with all others readjusted, and its scatter
over taps that have values of their own."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.stats import chi2, t
from scipy.stats import f as fisher

from .._base import check
from .._base.check import SimulationError
from .._base.rounding import HALVINGS, ROUNDING, SAME
from .solver import ENOUGH, NEARLY, Problem, Solution, pseudo_inverse, solve
from .unknowns import Unknown

SURE = 0.95  # [-] the widest interval that a profile is followed to
# [-] largest ratio of two steps, where the rise stalls or where it was too steep: not so long as to leap over a bend
GROWTH = 3.0
# [-] where the root of the rise over the target is more, a shorter step is tried: the interval's ends then err by 3 %
# of its half width in likelihoods as bent as an exponential, by 8 % at 1.6
TOO_STEEP = 1.1
# [-] probability below which residuals do not count as white: one fit of a hundred is doubted without need
DOUBTED = 0.01


@dataclass(frozen=True, eq=False, repr=False)
class Profile(check.Brief):
    """One value moved over its range, the others readjusted."""

    name: str
    value: float  # at the best fit
    values: np.ndarray  # (n_points,), ascending
    rise: np.ndarray  # (n_points,) [-] increase of the sum of squares over the noise variance
    open: tuple[bool, bool]  # whether the data set no limit below, above
    held_by: tuple[str, str]  # the unknown whose range ended the profile there; "" for none
    others: Mapping[str, np.ndarray]  # the other values along the profile, (n_points,) each
    freedom: int  # degrees of freedom of the noise variance
    low: float
    high: float
    log: bool

    def _coordinate(self, value: Any) -> Any:
        return np.log(value) if self.log else np.asarray(value, float)

    @cached_property
    def _climb(self) -> tuple[np.ndarray, np.ndarray]:
        """Ascending coordinates of the points computed, and signed roots of the rise there, which do not fall."""
        root = np.sqrt(np.maximum(self.rise, 0.0)) * np.where(self.values < self.value, -1.0, 1.0)
        x, kept = np.unique(self._coordinate(self.values), return_index=True)
        return x, np.maximum.accumulate(root[kept])

    def interval(self, level: float = 0.9) -> tuple[float, float]:
        """The range (low, high) that holds the value with this probability; an open end is the end of its range."""
        level = check.between("level", level, 0.01, SURE)
        threshold, (x, root) = float(t.ppf(0.5 + 0.5 * level, self.freedom)), self._climb
        if len(x) < 2:
            return self.low, self.high
        rising = root + SAME * np.arange(len(x))
        ends = PchipInterpolator(rising, x)(np.clip([-threshold, threshold], rising[0], rising[-1]))
        low, high = (np.exp(ends) if self.log else ends).tolist()
        return low if -root[0] > threshold else self.low, high if root[-1] > threshold else self.high

    def curve(self, n_points: int = 200) -> tuple[np.ndarray, np.ndarray]:
        """Values and rise of the profile, (n_points,) each, smooth between the points computed, for drawing."""
        x, root = self._climb
        fine = np.linspace(x[0], x[-1], n_points) if len(x) > 2 else x
        found = PchipInterpolator(x, root)(fine) if len(x) > 2 else root
        return (np.exp(fine) if self.log else fine), found**2

    @property
    def kind(self) -> str:
        """ "closed" if both ends are, "limited" if one is, "open" if the data do not determine the value."""
        if all(self.open):
            return "open"
        if not any(self.open):
            return "closed"
        low, high = self._coordinate(np.array(self.interval()))
        whole = self._coordinate(self.high) - self._coordinate(self.low)
        return "open" if high - low > 0.5 * whole else "limited"  # a choice: wider ones limit nothing

    @property
    def ridge(self) -> dict[str, float]:
        """How the others go along: exponents of their growth with this value, where that is flat."""
        flat = self.rise <= float(t.ppf(0.5 + 0.5 * SURE, self.freedom)) ** 2
        if flat.sum() < 2 or not self.log:
            return {}
        x = np.log(self.values[flat])
        if np.ptp(x) <= 0.0:
            return {}
        found = {}
        for name, values in self.others.items():
            if (values[flat] > 0.0).all():
                slope = float(np.polyfit(x, np.log(values[flat]), 1)[0])
                if abs(slope) > 0.05:  # otherwise twice the one value moves the other by less than 4 %
                    found[name] = slope
        return found


def variance(residual: np.ndarray, n_values: int) -> tuple[float, int, float]:
    """Noise variance of residuals (n_records, n_times), its degrees of freedom, and the probability that it is white.

    Residuals that are not white hold fewer independent samples: the variance grows, and the freedom shrinks, by the
    sum of their autocorrelation.

    References
    ----------
    Ljung and Box (1978), Biometrika 65, 297-303; the effective number of samples: Bayley and Hammersley (1946), J. R.
    Stat. Soc. Suppl. 8, 184-197.
    """
    n = residual.size
    freedom = max(1, n - n_values)
    total = float(np.square(residual).sum())
    n_times = residual.shape[1]
    lags = min(10, n_times - 2)  # filters of rigs ring over some ten samples
    size = np.sqrt(np.square(residual).mean(axis=1, keepdims=True))
    rows = residual / np.maximum(size, 1e-300)  # each counts alike, whatever its noise
    rho = np.array([float((rows[:, k:] * rows[:, :-k]).sum()) / n for k in range(1, lags + 1)])
    statistic = n * (n + 2.0) * float((rho**2 / (n - np.arange(1, lags + 1))).sum())
    white = float(chi2.sf(statistic, lags))
    factor = 1.0
    if white < DOUBTED:
        positive = np.concatenate([rho, [0.0]])
        until = int(np.argmax(positive <= 0.0))
        factor = 1.0 + 2.0 * float(positive[:until].sum())
    return total / freedom * factor, max(1, round(freedom / factor)), white


@dataclass(frozen=True, eq=False, repr=False)
class _Climb:
    """What stays while one coordinate of a problem is moved away from its best fit."""

    problem: Problem
    best: Solution
    j: int
    noise: float
    bounds: tuple[np.ndarray, np.ndarray]
    target: float  # [-] root of the rise at the end of the widest interval

    @cached_property
    def tangent(self) -> tuple[np.ndarray, float]:
        """How the others go along with the one, (n_coordinates,), by the derivatives at the best fit; and how far that
        one goes until the sum of squares rises by the noise."""
        jacobian, way = self.problem.jacobian(self.best.x), np.zeros(len(self.best.x))
        others = np.setdiff1d(np.arange(len(way)), [self.j, *self.problem.needless])
        way[others] = -pseudo_inverse(jacobian[:, others]) @ jacobian[:, self.j]
        way[self.j] = 1.0
        return way, float(np.sqrt(self.noise) / max(np.linalg.norm(jacobian @ way), 1e-300))

    def _solve(self, start: np.ndarray, held: tuple[int, ...]) -> Solution:
        """The best fit with some coordinates held."""
        return solve(self.problem, start, ENOUGH, NEARLY, held)

    def side(self, sign: float, floor: bool) -> tuple[list[Solution], bool, str]:
        """Fits up (sign 1) or down (-1) from the best, whether the data set no limit there, and what ended the way."""
        low, high = (float(each[self.j]) for each in self.bounds)
        bound = high if sign > 0.0 else low
        found: list[Solution] = []
        root, steep, ended, x = 0.0, 0.0, False, self.best.x
        slope, spread = self.tangent
        # a little short of the target by curvature, as the second step finds the rest; four steps cover the range
        step = min(0.8 * self.target * spread, 0.25 * (high - low))
        for _ in range(HALVINGS):  # most profiles end after two steps
            here = float(x[self.j])
            ended = sign * (here + sign * step - bound) >= -1e-9 * abs(bound)
            step = abs(bound - here) if ended else step
            if step < SAME * max(1.0, abs(here)):
                break
            start = np.clip(x + sign * step * slope, *self.bounds)
            try:
                moved = self._solve(start, (self.j,))
            except SimulationError:
                return found, root < self.target and steep <= TOO_STEEP * self.target, "the simulation"
            found.append(moved)
            steep = float(np.sqrt(max(moved.cost - self.best.cost, 0.0) / self.noise))
            if steep > TOO_STEEP * self.target:
                step *= max(1.0 / GROWTH, 1.02 * (self.target - root) / (steep - root))
                continue
            was, root = root, steep
            x, slope = moved.x, (moved.x - x) / (moved.x[self.j] - here)
            if root >= self.target or ended:
                break
            step = min((1.02 * self.target - root) * step / max(root - was, 1e-3), GROWTH * step)
        if root < self.target and steep <= TOO_STEEP * self.target:
            return found, not (sign < 0.0 and floor and ended), ""
        held = self._limiting(found[-1])
        return found, bool(held), held

    def _limiting(self, end: Solution) -> str:
        """An unknown at an end of its range that holds the sum of squares up there; "" if there is none.

        That is one whose way back by a quarter of its range costs more than noise: if it only drifted there along a
        flat valley it costs nothing. A natural limit at zero is none.
        """
        for k, each in enumerate(self.problem.free):
            low, high = (float(bound[k]) for bound in self.problem.bounds)
            near = 0.02 * (high - low)  # of a bound, which may then hold the unknown
            up = high - end.x[k] < near
            if k == self.j or not (up or (end.x[k] - low < near and not each.floor)):
                continue
            start = end.x.copy()
            start[k] = high - 0.25 * (high - low) if up else low + 0.25 * (high - low)
            with suppress(SimulationError):
                if self._solve(start, (self.j, k)).cost - end.cost > self.noise:
                    return each.name
        return ""


def follow_profile(
    problem: Problem, best: Solution, j: int, noise: float, freedom: int, name: str
) -> tuple[Profile, Solution]:
    """The profile of a coordinate, and the best fit met on the way."""
    low, high = problem.bounds
    if j < problem.n_shared:
        unknown = problem.free[j]
    else:  # a speed: as far as makes sense
        unknown = Unknown(name, float(np.exp(best.x[j])) / 1e3, float(np.exp(best.x[j])) * 1e3)
        low, high = low.copy(), high.copy()
        low[j], high[j] = unknown.bounds
    climb = _Climb(problem, best, j, noise, (low, high), float(t.ppf(0.5 + 0.5 * SURE, freedom)))
    sides = [climb.side(sign, unknown.floor) for sign in (-1.0, 1.0)]
    fits = sorted([*sides[0][0], best, *sides[1][0]], key=lambda fit: fit.x[j])
    table = [problem.values(fit.x) for fit in fits]
    speeds = np.array([problem.speeds(fit.x) for fit in fits])
    others = {key: np.array([row[key] for row in table]) for key in table[0] if key != name}
    others |= {f"speed[{i}]": each for i, each in enumerate(speeds.T) if f"speed[{i}]" != name}
    values = np.array([float(unknown.outside(fit.x[j])) for fit in fits])
    rise = np.array([(fit.cost - best.cost) / noise for fit in fits])
    profile = Profile(
        name, float(unknown.outside(best.x[j])), values, rise, (sides[0][1], sides[1][1]), (sides[0][2], sides[1][2]),
        others, freedom, unknown.low, unknown.high, unknown.log,
    )  # fmt: skip
    return profile, min(fits, key=lambda fit: fit.cost)


@dataclass(frozen=True, eq=False, repr=False)
class Scatter(check.Brief):
    """One unknown over the taps."""

    name: str
    values: np.ndarray  # (n_taps,)
    mean: float  # geometric if `relative`
    deviation: float  # standard deviation over the taps; of the logarithm [-] if `relative`
    by_noise: float  # the same, as noise alone would make it
    relative: bool  # whether the range is positive, so that ratios count
    freedom: int  # degrees of freedom of the noise variance

    @property
    def chance(self) -> float:
        """Probability that noise alone makes taps differ this much [-]; large: one value for all would do."""
        return float(fisher.sf((self.deviation / max(self.by_noise, 1e-300)) ** 2, len(self.values) - 1, self.freedom))


def scatter(problem: Problem, x: np.ndarray, i: int, noise: float, freedom: int) -> Scatter:
    """The scatter of the free unknown number ``i``, which every tap has its own value of.

    Parameters
    ----------
    x : ndarray, shape (n_coordinates,), the best fit
    noise : float, variance of the residuals
    freedom : int, its degrees of freedom
    """
    n_taps, unknown = problem.data.n_taps, problem.free[i]
    place = problem.owners.index(unknown.name)
    columns = problem.n_shared + (2 + place) * n_taps + np.arange(n_taps)
    answers = np.linalg.pinv(problem.jacobian(x), rcond=ROUNDING)[columns]  # (n_taps, n_residuals) to the noise
    answers -= answers.mean(axis=0)  # apart from the mean of all taps
    variance = noise * float(np.square(answers).sum()) / (n_taps - 1)
    size = 1.0 if unknown.log else unknown.high - unknown.low
    apart = problem.apart(x)[place]
    values = np.array([problem.values(x, tap)[unknown.name] for tap in range(n_taps)])
    return Scatter(
        unknown.name, values, problem.values(x)[unknown.name], size * float(np.std(apart, ddof=1)),
        size * float(np.sqrt(variance)), unknown.log, freedom,
    )  # fmt: skip
