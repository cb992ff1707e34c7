"""Least squares of a fit: residuals of all taps through the rig, their derivatives, and the search for the best."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import qmc

from .._base import check
from .._base.check import SimulationError
from .._base.threads import one_thread
from .rig import FINE, MARGIN
from .unknowns import TIME, Setting, Unknown

# [-] momentum over impulse of a blow that returns with two thirds of its speed, fact: 1 / (1 + 2 / 3): usual taps
HALF_LOST = 0.6
STEP = 1e-4  # [-] of coordinates, for derivatives by differences: blows with a fixed step are smooth to 1e-6
MOST_OUTLIERS = 0.34  # [-] of what is measured may disagree: with more, nobody knows which ones are right
ENOUGH = 60  # [-] iterations of one search
STARTS = 64  # [-] points at most where searches begin: four along each of three unknowns
# [-] fall of the sum of squares, over the mean square, that ends a search: values are then within 0.01 of a deviation
CLOSE = 1e-4
QUICK = 12  # [-] iterations of a search that begins close to its end, or only shows whether to go on
# [-] the same of a search of which only the sum of squares counts, not the values
NEARLY = 1e-2

Function = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False, repr=False)
class Data(check.Brief):
    """The records to be explained, each scaled to a peak of one."""

    values: np.ndarray  # (n_taps, 1 + n_points, n_times) over their scale
    scale: np.ndarray  # (n_taps, 1 + n_points): peak force [N], peaks of the responses, over the channel's weight
    impulse: np.ndarray  # (n_taps,) [N s], measured
    lead: int  # [samples] of every record before the blow begins in the simulation

    @property
    def n_taps(self) -> int:
        return len(self.values)

    @property
    def n_times(self) -> int:
        return self.values.shape[2]


@dataclass(frozen=True, eq=False, repr=False)
class Problem(check.Brief):
    """Residuals over coordinates: those of the unknowns, then of all taps the logarithm of the momentum, the onset
    [samples] and, for each name in `own`, how far the tap is from the unknown, which is the mean of all taps."""

    setting: Setting
    data: Data
    free: tuple[Unknown, ...]  # those in the coordinates; `contact.time` in place of the stiffness
    fixed: Mapping[str, float]  # values of the others
    own: tuple[str, ...] = ()  # names among `free` that every tap has a value of its own for
    centre: int | None = None  # the tap whose own values the unknowns are, in place of the mean of all
    momentum: bool = True  # False: the coordinate of a tap is the logarithm of its speed itself
    _last: dict[bytes, np.ndarray] = field(default_factory=dict, init=False, repr=False)

    @property
    def n_shared(self) -> int:
        return len(self.free)

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = map(list, zip(*[each.bounds for each in self.free])) if self.free else ([], [])
        centre = np.log(self.data.impulse) if self.momentum else np.zeros(self.data.n_taps)
        slide = np.full(self.data.n_taps, 60.0)  # samples from the trigger, which is set at 5 % of the peak
        wide = np.repeat([high[i] - low[i] for i in self._own], self.data.n_taps)
        # logarithms of speeds in m/s and of momenta over measured impulses within 25: all there are
        return np.concatenate([low, centre - 25.0, -slide, -wide]), np.concatenate([high, centre + 25.0, slide, wide])

    @cached_property
    def _own(self) -> list[int]:
        """Numbers of the coordinates of `own`."""
        return [i for i, each in enumerate(self.free) if each.name in self.own]

    @property
    def owners(self) -> list[str]:
        """The names of `own` in the order of the coordinates."""
        return [self.free[i].name for i in self._own]

    @property
    def n_values(self) -> int:
        """Number of values that the data decide: of all coordinates, one for each name in `own` changes nothing."""
        return self.n_shared + self.data.n_taps * (2 + len(self.own)) - len(self.own)

    @property
    def needless(self) -> list[int]:
        """Coordinates that may stay where they are: of the own values of all taps, one goes along with the others."""
        first, n_taps = self.n_shared + 2 * self.data.n_taps, self.data.n_taps
        return [first + k * n_taps + (self.centre or 0) for k in range(len(self.own))]

    def among(self, taps: Sequence[int], x: np.ndarray) -> "tuple[Problem, np.ndarray]":
        """The problem with some of its taps only, and what remains of coordinates."""
        n, n_taps = self.n_shared, self.data.n_taps
        kept = [*range(n), *(n + k * n_taps + i for k in range(2 + len(self.own)) for i in taps)]
        part = {name: getattr(self.data, name)[list(taps)] for name in ("values", "scale", "impulse")}
        return replace(self, data=replace(self.data, **part)), x[kept]

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

    def spectra(self, x: np.ndarray) -> np.ndarray:
        """Filtered spectra of the fine records, (n_taps, 1 + n_points, n_frequencies) of the band that passes."""
        speeds = self.speeds(x)
        groups = [(tap, speeds[tap : tap + 1]) for tap in range(self.data.n_taps)] if self.own else [(None, speeds)]
        made = []
        for tap, several in groups:
            made.append(self.setting.records(self.values(x, tap), several, self.data.n_times, self.data.lead))
        fine = np.concatenate(made)
        frequencies, transfer, sensor = self._chain
        spectra = np.fft.rfft(fine)[..., : len(frequencies)] * transfer
        spectra[:, 0] *= sensor
        return spectra

    @cached_property
    def _chain(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Frequencies [Hz] of the fine records that the filter passes, and transfer functions of filter and sensor."""
        chain = self.setting.rig
        frequencies = np.fft.rfftfreq(FINE * (self.data.n_times + 2 * MARGIN), 1.0 / (FINE * chain.rate))
        transfer = chain.passes(frequencies)
        band = slice(int(np.flatnonzero(transfer)[-1]) + 1)
        return frequencies[band], transfer[band], chain.senses(frequencies[band])

    def sampled(self, spectra: np.ndarray, onsets: np.ndarray, rate: bool = False) -> np.ndarray:
        """Records as the rig samples them, (n_taps, 1 + n_points, n_times), over the scale; or their onset rates."""
        turns = -2j * np.pi * self._chain[0] / self.setting.rig.rate  # of a delay of one sample
        spectra = spectra * np.exp(turns * onsets[:, None, None])
        fine = np.fft.irfft(spectra * turns if rate else spectra, FINE * (self.data.n_times + 2 * MARGIN))
        return fine[..., ::FINE][..., MARGIN : MARGIN + self.data.n_times] / self.data.scale[:, :, None]

    def _base(self, x: np.ndarray) -> np.ndarray:
        n, n_taps = self.n_shared, self.data.n_taps
        key = np.delete(x, slice(n + n_taps, n + 2 * n_taps)).tobytes()  # without the onsets
        if key not in self._last:
            self._last.clear()
            self._last[key] = self.spectra(x)
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
            slope = (self.sampled(self.spectra(moved), onsets) - here) / step
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
        for _ in range(3):  # Gauss-Newton steps: nearly linear in both, so that three find them
            onsets, base = self.onsets(x), self._base(x)
            here, rate = self.sampled(base, onsets), self.sampled(base, onsets, rate=True)
            for tap in range(n_taps):
                columns = np.column_stack([here[tap].ravel(), rate[tap].ravel()])
                miss = (self.data.values[tap] - here[tap]).ravel()
                size, shift = np.linalg.lstsq(columns, miss, rcond=None)[0]
                x[n + tap] += np.clip(size, -0.5, 1.0)  # the force grows about as the speed
                x[n + n_taps + tap] += np.clip(shift, -3.0, 3.0)  # samples: pulses are linear in it so far
            x[n:] = np.clip(x[n:], self.bounds[0][n:], self.bounds[1][n:])
        return x


@dataclass(frozen=True, eq=False, repr=False)
class Solution(check.Brief):
    """The end of a search."""

    x: np.ndarray
    cost: float  # [-] sum of squares of the residuals
    jacobian: np.ndarray  # (n_residuals, n_coordinates less those held)
    ended: bool = True  # False: the iterations were used up


def solve(
    problem: Problem, x: np.ndarray, iterations: int = ENOUGH, close: float = CLOSE, held: Sequence[int] = ()
) -> Solution:
    """Least squares from a start; the coordinates ``held`` stay."""
    low, high = problem.bounds
    held = [*held, *problem.needless]
    free = np.setdiff1d(np.arange(len(x)), held)

    def whole(part: np.ndarray) -> np.ndarray:
        full = x.copy()
        full[free] = part
        return full

    found = least(
        lambda part: problem.residual(whole(part)), lambda part: problem.jacobian(whole(part), held), x[free],
        (low[free], high[free]), close=close, iterations=iterations,
    )  # fmt: skip
    return replace(found, x=whole(found.x))


@one_thread
def least(
    residual: Function, slopes: Function, x: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], *, close: float,
    iterations: int,
) -> Solution:  # fmt: skip
    """Least squares within a box, by Levenberg and Marquardt, until a step promises less than ``close`` mean squares.

    Each step is the least of the damped linear problem within the box. `scipy.optimize.least_squares` stays away from
    the sides of a box: where values end there, as along the ridges of contacts, it needs ten times the steps or stops
    with sums of squares that are ten to a hundred times the noise too large, so that intervals become too narrow.

    References
    ----------
    Moré (1978), Lecture Notes in Mathematics 630, 105-116 (scales of coordinates); Nielsen (1999), Damping parameter in
    Marquardt's method, IMM-REP-1999-05.
    """
    low, high = bounds
    x = np.clip(x, low, high)
    missed, jacobian, size = residual(x), None, np.zeros(len(x))
    cost, damping, growth = float(missed @ missed), 1e-3, 2.0
    for _ in range(iterations - 1):
        if jacobian is None:
            jacobian = slopes(x)
            size = np.maximum(size, np.linalg.norm(jacobian, axis=0))
            scale = np.where(size > 0.0, size, 1.0)
            both = np.column_stack([jacobian / scale, missed])
            turned = np.asarray(np.linalg.qr(both, mode="r"))[: len(x)]
            rows, wanted = turned[:, :-1], -turned[:, -1]
        lower = (low - x) * scale
        box = lower, np.maximum((high - x) * scale, np.nextafter(lower, np.inf))
        damped = np.vstack([rows, np.sqrt(damping) * np.eye(len(x))]), np.append(wanted, np.zeros(len(x)))
        step = lsq_linear(*damped, box, method="bvls").x
        promised = float(wanted @ wanted - np.square(rows @ step - wanted).sum())
        if promised <= close * cost / len(missed):
            return Solution(x, cost, jacobian)
        there = np.clip(x + step / scale, low, high)
        with suppress(SimulationError):
            left = residual(there)
            fall = cost - float(left @ left)
            if fall > 0.0:
                x, missed, cost, jacobian, growth = there, left, cost - fall, None, 2.0
                damping *= max(0.1, 1.0 - (2.0 * min(fall / promised, 1.0) - 1.0) ** 3)
                continue
        damping, growth = damping * growth, 2.0 * growth
    return Solution(x, cost, slopes(x) if jacobian is None else jacobian, ended=False)


def promised_fall(problem: Problem, found: Solution) -> float:
    """By how much the sum of squares would fall by its derivatives, within the bounds and apart from ridges."""
    low, high = problem.bounds
    inside = (found.x > low + STEP) & (found.x < high - STEP)
    slopes = found.jacobian[:, np.delete(inside, problem.needless)]
    return float(np.square(slopes @ pseudo_inverse(slopes) @ problem.residual(found.x)).sum())


def pseudo_inverse(jacobian: np.ndarray) -> np.ndarray:
    """What moves the residuals by one, (n_coordinates, n_residuals), apart from ridges, whose ways move nothing."""
    columns = np.maximum(np.linalg.norm(jacobian, axis=0), np.finfo(float).tiny)
    # differences of steps cannot distinguish flatter directions from ridges
    return np.linalg.pinv(jacobian / columns, rcond=3e-5) / columns[:, None]


def pulse_length(taps: Any) -> float:
    """Typical contact time [s] of measured taps, that of a half sine of the same peak and impulse."""
    return float(np.median(0.5 * np.pi * taps.impulse / taps.peak))


def felt_frequency(share: float, length: float, low: float, high: float) -> float:
    """Logarithm of a frequency within bounds, a share of the way along those that shape a pulse of a length [s]."""
    first, last = np.clip(np.log(np.array([0.1, 5.0]) / length), low, high)
    return float(first + share * (last - first))


def starts(problem: Problem, length: float, momentum: np.ndarray, rng: np.random.Generator) -> list[np.ndarray]:
    """Starting points in order of their sums of squares, of `STARTS` that fill the ranges evenly; neighbours last.

    Parameters
    ----------
    length : float [s], measured contact time, near which the contact time starts
    momentum : ndarray, shape (n_taps,) [N s], measured impulses: a rebound without loss has twice the momentum
    """
    n = problem.n_shared
    low, high = (bound[:n] for bound in problem.bounds)
    points = qmc.Sobol(max(n, 1), rng=rng).random(STARTS) if n else np.zeros((1, 1))
    looked: list[tuple[float, np.ndarray]] = []
    for point in points:
        shared = low + (0.02 + 0.96 * point[:n]) * (high - low)
        for i, each in enumerate(problem.free):
            if each.name == TIME:
                shared[i] = np.clip(np.log(length) + 0.6 * (point[i] - 0.5), low[i], high[i])
            elif each.name.endswith("frequency") and each.log:
                shared[i] = felt_frequency(point[i], length, low[i], high[i])
        x = np.concatenate([shared, np.log(HALF_LOST * momentum), np.zeros(len(momentum))])
        try:
            x = problem.aligned(x)
            looked.append((float(np.square(problem.residual(x)).sum()), x))
        except SimulationError:
            continue
    if not looked:
        raise SimulationError("no starting point in the ranges of unknown makes a blow that ends; narrow the ranges")
    looked.sort(key=lambda pair: pair[0])
    chosen: list[np.ndarray] = []
    later: list[np.ndarray] = []
    for _, x in looked:
        away = [np.abs((x - other)[:n] / (high - low)).max(initial=0.0) for other in chosen]
        (later if away and min(away) < 0.25 else chosen).append(x)  # neighbours often lead to the same minimum
    return chosen + later
