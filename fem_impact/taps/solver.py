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

HALF_LOST = 0.6  # [-] momentum over impulse of a blow that comes back with two thirds of its speed
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

    def __repr__(self) -> str:
        return check.brief(self)

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
    """Residuals over coordinates: those of the unknowns, then of all taps the logarithm of the momentum, the onset
    [samples] and, for each name in `own`, how far the tap is from the unknown, which is the mean of all taps."""

    setting: Setting
    data: Data
    free: tuple[Unknown, ...]  # those in the coordinates; `contact.time` in place of the stiffness
    fixed: Mapping[str, float]  # values of the others
    own: tuple[str, ...] = ()  # names among `free` that every tap has a value of its own for
    centre: int | None = None  # the tap whose own values the unknowns are, in place of the mean of all
    momentum: bool = True  # False: the coordinate of a tap is the logarithm of its speed itself
    _last: dict[bytes, np.ndarray] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        return check.brief(self)

    @property
    def n_shared(self) -> int:
        return len(self.free)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = map(list, zip(*[each.bounds for each in self.free])) if self.free else ([], [])
        centre = np.log(self.data.impulse) if self.momentum else np.zeros(self.data.n_taps)
        reach = MOMENTA if self.momentum else SPEEDS
        slide = np.full(self.data.n_taps, LATEST)
        wide = np.repeat([high[i] - low[i] for i in self._own], self.data.n_taps)
        return np.concatenate([low, centre - reach, -slide, -wide]), np.concatenate([high, centre + reach, slide, wide])

    @property
    def _own(self) -> list[int]:
        """Numbers of the coordinates of `own`."""
        return [i for i, each in enumerate(self.free) if each.name in self.own]

    @property
    def n_values(self) -> int:
        """Number of values that the data decide: of all coordinates, one for each name in `own` changes nothing."""
        return self.n_shared + self.data.n_taps * (2 + len(self.own)) - len(self.own)

    @property
    def needless(self) -> list[int]:
        """Coordinates that may stay where they are: of the own values of all taps, one goes along with the others."""
        first, n_taps = self.n_shared + 2 * self.data.n_taps, self.data.n_taps
        return [first + k * n_taps + (self.centre or 0) for k in range(len(self.own))]

    def kept(self, taps: Sequence[int]) -> list[int]:
        """The coordinates that remain of a problem with these taps only."""
        n, n_taps = self.n_shared, self.data.n_taps
        return [*range(n), *(n + k * n_taps + i for k in range(2 + len(self.own)) for i in taps)]

    def _weights(self) -> np.ndarray:
        """Weights (n_taps,) [-] of the taps in what the unknowns with own values are."""
        if self.centre is None:
            return np.full(self.data.n_taps, 1.0 / self.data.n_taps)
        return np.eye(self.data.n_taps)[self.centre]

    def apart(self, x: np.ndarray) -> np.ndarray:
        """How far the coordinates of each tap's own values are from those of the unknowns, (n_own, n_taps)."""
        far = x[self.n_shared + 2 * self.data.n_taps :].reshape(len(self.own), self.data.n_taps)
        return far - far @ self._weights()[:, None]

    def values(self, x: np.ndarray, tap: int | None = None) -> dict[str, float]:
        """The unknowns of a coordinate vector, in SI units; of names in `own` the tap's or, without one, the mean.

        The mean is that of the coordinates: of their logarithms if the range is positive.
        """
        if tap is not None and self.own:
            x = x.copy()
            low, high = (bound[: self.n_shared] for bound in self.bounds)
            x[self._own] += self.apart(x)[:, tap]
            x[: self.n_shared] = np.clip(x[: self.n_shared], low, high)
        found = dict(self.fixed) | {each.name: float(each.outside(z)) for each, z in zip(self.free, x)}
        if TIME in found:
            found["contact.stiffness"] = self.setting.stiffness(found, found[TIME])
        return found

    def moved(self, x: np.ndarray, other: "Problem") -> np.ndarray:
        """The coordinates in a problem that differs from this in `centre`, `momentum` or the stiffness only."""
        n, n_taps = self.n_shared, self.data.n_taps
        tables = [self.values(x, tap) for tap in (*range(n_taps), None)]
        for table in tables:
            table[TIME] = self.setting.contact_time(table)
        found, apart = [], []
        for each in other.free:
            rows = np.array([float(each.inside(table[each.name])) for table in tables])
            own = each.name in other.own
            found.append(rows[:-1] @ other._weights() if own else rows[-1])
            apart += [rows[:-1] - found[-1]] if own else []
        felt = [self.setting.felt_mass(table) if other.momentum else 1.0 for table in tables[:-1]]
        sizes = np.log(self.speeds(x) * felt)
        return np.concatenate([found, sizes, x[n + n_taps : n + 2 * n_taps], *apart])

    def speeds(self, x: np.ndarray) -> np.ndarray:
        """Speeds (n_taps,) [m/s]; their coordinate is the logarithm of the momentum."""
        n, n_taps = self.n_shared, self.data.n_taps
        size = np.exp(x[n : n + n_taps])
        if not self.momentum:
            return size
        taps = range(n_taps) if "striker.mass" in self.own else [None]
        return size / np.array([self.setting.felt_mass(self.values(x, tap)) for tap in taps])

    def onsets(self, x: np.ndarray) -> np.ndarray:
        """Onsets (n_taps,) [samples] after `Data.lead`."""
        return x[self.n_shared + self.data.n_taps : self.n_shared + 2 * self.data.n_taps]

    def fine(self, x: np.ndarray) -> np.ndarray:
        """Unfiltered fine records, (n_taps, 1 + n_points, n_fine)."""
        speeds = self.speeds(x)
        groups = [(tap, speeds[tap : tap + 1]) for tap in range(self.data.n_taps)] if self.own else [(None, speeds)]
        made = []
        for tap, several in groups:
            values = self.values(x, tap)
            bodies, tip_mass = self.setting.bodies(values)
            duration = self.setting.duration(values)
            made.append(blows.records(
                bodies, several, duration=duration, n_times=self.data.n_times, lead=self.data.lead,
                rig=self.setting.rig, tip_mass=tip_mass,
            ))  # fmt: skip
        return np.concatenate(made)

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
        n, n_taps = self.n_shared, self.data.n_taps
        key = np.delete(x, slice(n + n_taps, n + 2 * n_taps)).tobytes()  # without the onsets
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
        places, weights = self._own, self._weights()
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
                if i in places:  # the coordinate of a tap's own value acts as that of the unknown, on this tap alone
                    first = n + (2 + places.index(i)) * n_taps
                    for tap in range(n_taps):
                        out[tap, ..., first + tap] = slope[tap]
                        out[..., first + tap] -= weights[tap] * slope
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
    ended: bool = True  # False: the iterations were used up

    def __repr__(self) -> str:
        return check.brief(self)


def solve(
    problem: Problem, x: np.ndarray, iterations: int = ENOUGH, close: float = CLOSE, held: Sequence[int] = (),
    method: str = "trf",
) -> Solution:  # fmt: skip
    """Least squares from a start, by a method of scipy; the coordinates ``held`` stay."""
    low, high = problem.bounds
    held = [*held, *problem.needless]
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
        method=method,
    )  # fmt: skip
    return Solution(whole(found.x), 2.0 * float(found.cost), found.jac, found.status > 0)


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
        x = np.concatenate([shared, np.log(HALF_LOST * momentum), np.zeros(len(momentum))])
        try:
            x = problem.aligned(x)
            looked.append((float(np.square(problem.residual(x)).sum()), x))
        except SimulationError:
            continue
    if not looked:
        raise SimulationError("no starting point in the ranges of unknown makes a blow that ends; narrow the ranges")
    looked.sort(key=lambda pair: pair[0])
    return [x for _, x in looked[:count]]
