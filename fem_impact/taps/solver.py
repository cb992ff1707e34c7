"""Least squares of a fit: residuals of all taps through the rig, their derivatives, and the search for the best."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from .._base import check
from .._base.check import SimulationError
from . import blows, rig
from .rig import FINE, MARGIN
from .unknowns import TIME, Setting, Unknown

STEP = 1e-4  # [-] of coordinates, for derivatives by differences: blows with a fixed step are smooth to 1e-6
TIMES = 30.0  # [-] the contact time is sought within this factor of the measured one
SCREENED = 64  # [-] starting points that are looked at
FELT = 0.1, 5.0  # [-] frequency times contact time of modes that shape a pulse: where their searches begin
LOOKS = 3  # [-] Gauss-Newton steps in speed and onset while looking
ENOUGH = 60  # [-] iterations of one search
CLOSE = 1e-8  # [-] relative change of the sum of squares or of the values that ends a search
MOMENTA = 5.0  # [-] the logarithm of the momentum is sought this far from that of the measured impulse
SPEEDS = 25.0  # [-] the logarithm of a speed in m/s is sought this far from zero
LATEST = 60.0  # [samples] the onset is sought this far from the trigger
SHIFT = 3.0  # [samples] the onset may move by at a single look


@dataclass(frozen=True, eq=False)
class Data:
    """The records to be explained, each scaled to a peak of one."""

    values: np.ndarray  # (n_taps, 1 + n_points, n_times) over their scale
    scale: np.ndarray  # (n_taps, 1 + n_points): peak force [N], peaks of the responses, over the channel's weight
    impulse: np.ndarray  # (n_taps,) [N s], measured
    lead: int  # [samples] of every record before the blow begins in the simulation

    __repr__ = check.brief

    @property
    def n_taps(self) -> int:
        return len(self.values)

    @property
    def n_times(self) -> int:
        return self.values.shape[2]

    def pick(self, taps: Sequence[int]) -> "Data":
        index = list(taps)
        return replace(self, values=self.values[index], scale=self.scale[index], impulse=self.impulse[index])


@dataclass(frozen=True, eq=False)
class Problem:
    """Residuals over coordinates: those of the unknowns, then log speed and onset [samples] of every tap."""

    setting: Setting
    data: Data
    free: tuple[Unknown, ...]  # those in the coordinates; `contact.time` in place of the stiffness
    fixed: Mapping[str, float]  # values of the others
    momentum: bool = True  # False: the coordinate of a tap is the logarithm of its speed itself
    _last: dict[bytes, np.ndarray] = field(default_factory=dict, repr=False)

    __repr__ = check.brief

    @property
    def n_shared(self) -> int:
        return len(self.free)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = map(list, zip(*[each.bounds for each in self.free])) if self.free else ([], [])
        centre = np.log(self.data.impulse) if self.momentum else np.zeros(self.data.n_taps)
        reach = MOMENTA if self.momentum else SPEEDS
        slide = np.full(self.data.n_taps, LATEST)
        return np.concatenate([low, centre - reach, -slide]), np.concatenate([high, centre + reach, slide])

    def values(self, x: np.ndarray) -> dict[str, float]:
        """The unknowns of a coordinate vector, in SI units."""
        found = dict(self.fixed) | {each.name: float(each.outside(z)) for each, z in zip(self.free, x)}
        if TIME in found:
            found["contact.stiffness"] = self.setting.stiffness(found, found[TIME])
        return found

    def speeds(self, x: np.ndarray) -> np.ndarray:
        """Speeds (n_taps,) [m/s]; their coordinate is the logarithm of the momentum."""
        size = np.exp(x[self.n_shared : self.n_shared + self.data.n_taps])
        return size / self.setting.felt_mass(self.values(x)) if self.momentum else size

    def onsets(self, x: np.ndarray) -> np.ndarray:
        """Onsets (n_taps,) [samples] after `Data.lead`."""
        return x[self.n_shared + self.data.n_taps :]

    def fine(self, x: np.ndarray) -> np.ndarray:
        """Unfiltered fine records, (n_taps, 1 + n_points, n_fine)."""
        values = self.values(x)
        bodies, tip_mass = self.setting.bodies(values)
        duration = self.setting.duration(values)
        return blows.records(
            bodies, self.speeds(x), duration=duration, n_times=self.data.n_times, lead=self.data.lead,
            rig=self.setting.rig, tip_mass=tip_mass,
        )  # fmt: skip

    def sampled(self, fine: np.ndarray, onsets: np.ndarray, rate: bool = False) -> np.ndarray:
        """Records as the rig samples them, (n_taps, 1 + n_points, n_times), over the scale; or their onset rates."""
        n = fine.shape[-1]
        chain = self.setting.rig
        frequencies = np.fft.rfftfreq(n, 1.0 / (FINE * chain.rate))
        band = frequencies <= 1.25 * chain.rate if chain.anti_alias in rig.FILTERS else slice(None)
        spectrum = np.fft.rfft(fine)
        transfer = np.zeros(len(frequencies), complex)
        transfer[band] = chain.passes(frequencies[band])
        spectrum *= transfer * np.exp(-2j * np.pi * frequencies * onsets[:, None, None] / chain.rate)
        spectrum[:, 0] *= chain.senses(frequencies)
        if rate:
            spectrum *= -2j * np.pi * frequencies / chain.rate
        whole = np.fft.irfft(spectrum, n)[..., ::FINE]
        return whole[..., MARGIN : MARGIN + self.data.n_times] / self.data.scale[:, :, None]

    def _base(self, x: np.ndarray) -> np.ndarray:
        key = x[: self.n_shared + self.data.n_taps].tobytes()
        if key not in self._last:
            self._last.clear()
            self._last[key] = self.fine(x)
        return self._last[key]

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Simulated less measured records over their scale, flat."""
        return (self.sampled(self._base(x), self.onsets(x)) - self.data.values).ravel()

    def jacobian(self, x: np.ndarray, held: Sequence[int] = ()) -> np.ndarray:
        """Derivatives of `residual`, (n_residuals, n_coordinates less those held)."""
        n, n_taps = self.n_shared, self.data.n_taps
        onsets, base = self.onsets(x), self._base(x)
        here = self.sampled(base, onsets)
        out = np.zeros((*here.shape, len(x)))
        high = self.bounds[1]
        for i in range(n + 1):
            if i in held and i < n:
                continue
            step = STEP if i == n or x[i] + STEP <= high[i] else -STEP
            moved = x.copy()
            moved[slice(n, n + n_taps) if i == n else i] += step
            slope = (self.sampled(self.fine(moved), onsets) - here) / step
            if i < n:
                out[..., i] = slope
            else:
                for tap in range(n_taps):
                    out[tap, ..., n + tap] = slope[tap]
        rate = self.sampled(base, onsets, rate=True)
        for tap in range(n_taps):
            out[tap, ..., n + n_taps + tap] = rate[tap]
        return np.delete(out.reshape(-1, len(x)), list(held), axis=1)

    def aligned(self, x: np.ndarray) -> np.ndarray:
        """The coordinates with speeds and onsets improved, one tap at a time, the unknowns held."""
        n, n_taps = self.n_shared, self.data.n_taps
        x = x.copy()
        for _ in range(LOOKS):
            onsets, base = self.onsets(x), self._base(x)
            here, rate = self.sampled(base, onsets), self.sampled(base, onsets, rate=True)
            for tap in range(n_taps):
                columns = np.column_stack([here[tap].ravel(), rate[tap].ravel()])
                miss = (self.data.values[tap] - here[tap]).ravel()
                size, shift = np.linalg.lstsq(columns, miss, rcond=None)[0]
                x[n + tap] += np.clip(size, -0.5, 1.0)  # the force grows about as the speed
                x[n + n_taps + tap] += np.clip(shift, -SHIFT, SHIFT)
            x[n:] = np.clip(x[n:], self.bounds[0][n:], self.bounds[1][n:])
        return x


@dataclass(frozen=True, eq=False)
class Solution:
    """The end of a search."""

    x: np.ndarray
    cost: float  # [-] sum of squares of the residuals
    jacobian: np.ndarray | None = None

    __repr__ = check.brief


def solve(
    problem: Problem, x: np.ndarray, iterations: int = ENOUGH, close: float = CLOSE, held: Sequence[int] = ()
) -> Solution:
    """Least squares from a start; the coordinates ``held`` stay."""
    low, high = problem.bounds
    inner = 1e-9 + 1e-9 * np.abs(x)
    start = np.clip(x, np.where(np.isfinite(low), low + inner, low), np.where(np.isfinite(high), high - inner, high))
    start[list(held)] = x[list(held)]
    free = np.setdiff1d(np.arange(len(x)), held)

    def whole(part: np.ndarray) -> np.ndarray:
        full = start.copy()
        full[free] = part
        return full

    found = least_squares(
        lambda part: problem.residual(whole(part)), start[free], lambda part: problem.jacobian(whole(part), held),
        (low[free], high[free]), x_scale="jac", max_nfev=iterations, ftol=close, xtol=close, gtol=1e-12,
    )  # fmt: skip
    return Solution(whole(found.x), 2.0 * float(found.cost), found.jac)


def pulse_length(taps: Any) -> float:
    """Typical contact time [s] of measured taps, that of a half sine of the same peak and impulse."""
    return float(np.median(0.5 * np.pi * taps.impulse / taps.peak))


def starts(problem: Problem, length: float, momentum: np.ndarray, count: int, rng: np.random.Generator) -> list:
    """Starting points in order of their sums of squares, of `SCREENED` that fill the ranges evenly.

    Parameters
    ----------
    length : float [s], measured contact time, near which the contact time starts
    momentum : ndarray, shape (n_taps,) [N s], measured impulses: a rebound without loss has twice the momentum
    """
    n = problem.n_shared
    low, high = (bound[:n] for bound in problem.bounds)
    points = qmc.Sobol(max(n, 1), rng=rng).random(SCREENED) if n else np.zeros((1, 1))
    looked: list[tuple[float, np.ndarray]] = []
    for point in points:
        shared = low + (0.02 + 0.96 * point[:n]) * (high - low)
        for i, each in enumerate(problem.free):
            if each.name == TIME:
                shared[i] = np.clip(np.log(length) + 0.6 * (point[i] - 0.5), low[i], high[i])
            elif each.name.endswith("frequency") and each.log:
                ends = np.clip(np.log(np.array(FELT) / length), low[i], high[i])
                shared[i] = ends[0] + point[i] * (ends[1] - ends[0])
        x = np.concatenate([shared, np.log(0.6 * momentum), np.zeros(len(momentum))])
        try:
            x = problem.aligned(x)
            looked.append((float(np.square(problem.residual(x)).sum()), x))
        except SimulationError:
            continue
    if not looked:
        raise SimulationError("no starting point in the ranges of unknown makes a blow that ends; narrow the ranges")
    looked.sort(key=lambda pair: pair[0])
    return [x for _, x in looked[:count]]
