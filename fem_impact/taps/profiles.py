"""Profiles of the likelihood: how far a value may move, with all others readjusted, before the data object."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.stats import chi2, t

from .._base import check
from .._base.check import SimulationError
from .._base.rounding import HALVINGS, SAME
from .ridges import way
from .solver import ENOUGH, NEARLY, QUICK, SMALL, Problem, Solution, chord, solve
from .unknowns import Unknown

SURE = 0.95  # [-] the widest interval that a profile is followed to
# [-] of the distance to that interval's end by curvature: the first step, a little short, as the second tells the rest
FIRST = 0.8
FARTHEST = 0.25  # [-] of its range: the first step at most, so that four steps see all of it
# [-] largest ratio of two steps, where the rise stalls or where it was too steep: not so long as to leap over a bend
GROWTH = 3.0
# [-] where the root of the rise over the target is more, a shorter step is tried: the interval's ends then err by 3 %
# of its half width in likelihoods as bent as an exponential, by 8 % at 1.6
TOO_STEEP = 1.1
AT_BOUND = 0.02  # [-] of a range: a value this close to its bound may be held by it
# [-] of its range (by its coordinate): an interval open at one end and wider than this tells nothing; a choice
WIDE = 0.5
LAGS = 10  # [-] of the test for whiteness: filters of rigs ring over some ten samples
# [-] probability below which residuals do not count as white: one fit of a hundred is doubted without need
DOUBTED = 0.01
# [-] smallest exponent of a ridge that is named: twice the one value then moves the other by less than 4 %
MOVES = 0.05


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

    def interval(self, level: float = 0.9) -> tuple[float, float]:
        """The range (low, high) that holds the value with this probability; an open end is the end of its range."""
        level = check.between("level", level, 0.01, SURE)
        threshold = float(t.ppf(0.5 + 0.5 * level, self.freedom))
        root = np.sqrt(np.maximum(self.rise, 0.0)) * np.where(self.values < self.value, -1.0, 1.0)
        x = self._coordinate(self.values)
        order = np.argsort(x)
        x, root = x[order], np.maximum.accumulate(root[order]) + SAME * np.arange(len(x))
        ends = []
        for sign, limit in ((-1.0, self.low), (1.0, self.high)):
            if abs(root[0 if sign < 0 else -1]) <= threshold:
                ends.append(limit)
                continue
            found = float(PchipInterpolator(root, x)(sign * threshold)) if len(x) > 1 else float(x[0])
            ends.append(float(np.exp(found)) if self.log else found)
        return ends[0], ends[1]

    def curve(self, n_points: int = 200) -> tuple[np.ndarray, np.ndarray]:
        """Values and rise of the profile, (n_points,) each, smooth between the points computed, for drawing."""
        root = np.sqrt(np.maximum(self.rise, 0.0)) * np.where(self.values < self.value, -1.0, 1.0)
        x, keep = np.unique(self._coordinate(self.values), return_index=True)
        if len(x) < 3:
            return self.values[keep], np.maximum(self.rise[keep], 0.0)
        fine = np.linspace(x[0], x[-1], n_points)
        found = PchipInterpolator(x, np.maximum.accumulate(root[keep]))(fine)
        return (np.exp(fine) if self.log else fine), found**2

    @property
    def told(self) -> str:
        """ "told" if both ends are closed, "limited" if one is, "open" if the data do not tell the value."""
        if all(self.open):
            return "open"
        if not any(self.open):
            return "told"
        low, high = self._coordinate(np.array(self.interval()))
        whole = self._coordinate(self.high) - self._coordinate(self.low)
        return "open" if high - low > WIDE * whole else "limited"

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
                if abs(slope) > MOVES:
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
    lags = min(LAGS, n_times - 2)
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


def follow(problem: Problem, best: Solution, j: int, noise: float, freedom: int, name: str) -> tuple[Profile, Solution]:
    """The profile of a coordinate, and the best fit met on the way."""
    low, high = problem.bounds
    named = problem.free[j] if j < problem.n_shared else None
    if named is None:  # a speed: as far as makes sense
        named = Unknown(name, float(np.exp(best.x[j])) / 1e3, float(np.exp(best.x[j])) * 1e3)
        low, high = low.copy(), high.copy()
        low[j], high[j] = named.bounds
    target = float(t.ppf(0.5 + 0.5 * SURE, freedom))
    farthest = FARTHEST * (high[j] - low[j])
    first = way(problem, best.x, j, (low, high), noise, farthest / target)
    rows: list[tuple[float, float, np.ndarray]] = [(float(best.x[j]), 0.0, best.x)]
    opened, held, found = [False, False], ["", ""], best
    for side, (sign, bound) in enumerate(((-1.0, low[j]), (1.0, high[j]))):
        trail, root, steep, ended = first, 0.0, 0.0, False
        step = min(FIRST * target * trail.spread, farthest)
        for _ in range(HALVINGS):  # most profiles end after two steps
            reach, meets = trail.reach(sign)
            if touches := reach < step:
                step = reach
            at = float(trail.x[j])
            last = at + sign * step
            if step < SAME * max(1.0, abs(at)):
                if not touches:
                    break
                trail = way(problem, trail.x, j, (low, high), noise, farthest / target, trail.stopped | meets)
                step = min((1.02 * target - root) * trail.spread, farthest)
                continue
            ended = sign * (last - bound) >= -1e-9 * abs(bound)
            last = float(bound) if ended else last
            step = abs(last - at)
            try:
                moved, sure = chord(problem, trail.to(last), trail.jacobian, (j,), NEARLY)
                if not sure:
                    moved = solve(problem, moved.x, QUICK, NEARLY, held=(j,))
                    trail = replace(trail, jacobian=moved.jacobian)
                if not moved.ended and moved.cost - best.cost > target**2 * noise:
                    moved = solve(problem, moved.x, ENOUGH, NEARLY, held=(j,), method="dogbox")  # quicker trail a ridge
            except SimulationError:
                held[side] = "the simulation"
                break
            rise = (moved.cost - best.cost) / noise
            rows.append((last, rise, moved.x))
            if moved.cost < found.cost - SMALL * noise:
                found = moved
            steep = float(np.sqrt(max(rise, 0.0)))
            if steep > TOO_STEEP * target:
                step *= max(1.0 / GROWTH, 1.02 * (target - root) / (steep - root))
                continue
            was, root = root, steep
            trail = trail.on(moved.x)
            if root >= target or ended:
                break
            if touches:
                trail = way(problem, moved.x, j, (low, high), noise, farthest / target, trail.stopped | meets)
                step = min((1.02 * target - root) * trail.spread, farthest)
                continue
            slope = max(root - was, 1e-3) / step
            step = min((1.02 * target - root) / slope, GROWTH * step)
        x = trail.x
        if root < target and steep <= TOO_STEEP * target:
            opened[side] = not (side == 0 and named.floor and ended)
        else:
            bounded = _limiting(problem, x, j, noise)
            held[side] = bounded[0] if bounded else ""
            opened[side] = bool(bounded)
    rows.sort(key=lambda row: row[0])
    table = [problem.values(row[2]) for row in rows]
    speeds = np.array([problem.speeds(row[2]) for row in rows])
    along = {key: np.array([row[key] for row in table]) for key in table[0] if key != name}
    along |= {f"speed[{i}]": speeds[:, i] for i in range(speeds.shape[1]) if f"speed[{i}]" != name}
    values = np.array([float(named.outside(row[0])) for row in rows])
    profile = Profile(
        name, float(named.outside(best.x[j])), values, np.array([row[1] for row in rows]), (opened[0], opened[1]),
        (held[0], held[1]), along, freedom, named.low, named.high, named.log,
    )  # fmt: skip
    return profile, found


def _limiting(problem: Problem, x: np.ndarray, j: int, noise: float) -> list[str]:
    """Unknowns at an end of their range whose release would lower the sum of squares there.

    An unknown that only drifted there along a flat valley pulls nothing, and a natural limit at zero is none.
    """
    n = problem.n_shared
    low, high = (bound[:n] for bound in problem.bounds)
    span = high - low
    down, up = x[:n] - low < AT_BOUND * span, high - x[:n] < AT_BOUND * span
    touched = up | (down & ~np.array([each.floor for each in problem.free], bool))
    touched[j : j + 1] = False
    if not touched.any():
        return []
    slope = 2.0 * (problem.jacobian(x).T @ problem.residual(x))[:n]
    gain = np.where(up, -slope, slope) * span
    return [each.name for i, each in enumerate(problem.free) if touched[i] and gain[i] > noise]
