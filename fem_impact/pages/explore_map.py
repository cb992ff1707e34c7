"""The map of the live page: impacts counted over mass and stiffness, then more finely where the count changes."""

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from .._base.check import SimulationError
from ..impact import threshold
from ..modes.modal import Modes
from ..sweeps import batches, cases, refined
from ..sweeps.cells import law_numbers
from .explore_model import MAP_TOLERANCE, Settings, Setup, strike_quickly

FIRST = {False: (25, 17), True: (13, 9)}  # [-] points of mass and stiffness at first, with True where blows take longer
FINEST = 385  # [-] points of mass at most: about one per pixel of the picture
DRAFT = 3e-2  # [-] of the blows drawn first: borders move by a fifth of a pixel (studies/benchmarks/explore_speed.py)
MORE = 4  # [-] impacts from which on the map makes no difference
NARROWEST = 1.001  # [-] ratio of the ends of an axis when zoomed in


@dataclass(frozen=True, eq=False)
class Picture:
    """The number of impacts of each hammer and contact at one strike point, and the threshold."""

    mass: np.ndarray  # (n_masses,) [kg]
    stiffness: np.ndarray  # (n_stiffnesses,) [-] as in `Settings`
    n_impacts: np.ndarray  # (n_stiffnesses, n_masses) at most `MORE`; -1 if the blow failed
    threshold: np.ndarray  # (n,) [Hz] contact resonance above which the body stops each hammer of the first map
    limit_mass: np.ndarray  # (n,) [kg] of these hammers
    limit: np.ndarray  # (n,) [-] stiffness that gives this resonance; NaN if there is none
    tolerance: float = DRAFT  # [-] of the blows

    @property
    def finest(self) -> bool:
        return len(self.mass) >= FINEST


@dataclass(frozen=True)
class Window:
    """What of the map is in view."""

    mass: tuple[float, float]  # [kg]
    stiffness: tuple[float, float]  # [-]

    @classmethod
    def of(cls, setup: Setup, mass: tuple[float, float] | None, stiffness: tuple[float, float] | None) -> "Window":
        """The part in view that lies on the map, no narrower than `NARROWEST`; None for the whole of an axis."""
        ends = []
        for name, wanted in (("mass", mass), ("stiffness", stiffness)):
            least, most = setup.range(name)
            low, high = (least, most) if wanted is None else sorted(min(max(x, least), most) for x in wanted)
            if high < low * NARROWEST:
                low = min(low, most / NARROWEST)
                high = low * NARROWEST
            ends.append((low, high))
        return cls(*ends)


class Mapper:
    """Draws maps of one setup; kernels are kept while only the part in view changes."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.about: tuple[Settings, Modes | None] | None = None  # settings and body that what follows is of
        self.case: cases.Case  # with mass and stiffness of the scene
        self.kernels: batches.Kernels = {}
        self.limits: np.ndarray | None = None  # (n,) [Hz] threshold of hammers all along the map

    def first(self, settings: Settings, window: Window, body: Modes | None = None) -> Picture:
        """The map in its coarsest form; the settings' mass and stiffness do not matter, ``body`` as in `Setup.case`."""
        self._begin(settings, body)
        law = self.case.contact
        slow = law.lossy or law.special or law.exponent < 1.0
        mass, stiffness = (np.geomspace(*ends, n) for ends, n in zip((window.mass, window.stiffness), FIRST[slow]))
        x, y = (part.ravel() for part in np.meshgrid(mass, stiffness))
        counts = self._counts(x, y, DRAFT).reshape(len(stiffness), len(mass))
        found = self._thresholds(mass)
        if law.special:  # as far as the map goes
            reached = [[self.setup.case(replace(settings, mass=float(m), stiffness=float(k))).resonance
                        for k in stiffness] for m in mass]  # fmt: skip
            rising = np.maximum.accumulate(reached, axis=1)
            limit = [np.interp(*at, np.log(stiffness), math.nan, math.nan) for at in zip(found, rising)]
            return Picture(mass, stiffness, counts, found, mass, np.exp(limit))
        there = (self.setup.case(replace(settings, mass=float(one), stiffness=1.0), body=body) for one in mass)
        ratio = found / np.array([one.resonance for one in there])
        ratio[~((ratio > 0.0) & (ratio < math.inf))] = math.nan
        # contact resonance ~ stiffness**(1 / (exponent + 1))
        return Picture(mass, stiffness, counts, found, mass, ratio ** (settings.exponent + 1.0))

    def finer(self, settings: Settings, picture: Picture, body: Modes | None = None) -> Picture:
        """The same map with twice as many points along each axis; blows are struck only where the counts differ.

        A patch smaller than a cell of the first two maps can be missed.
        """
        self._begin(settings, body)
        coarse = picture.n_impacts
        squares = np.stack([coarse[:-1, :-1], coarse[:-1, 1:], coarse[1:, :-1], coarse[1:, 1:]])
        mixed = squares.min(axis=0) != squares.max(axis=0)
        rows, columns = (2 * n - 1 for n in coarse.shape)
        counts = np.repeat(np.repeat(coarse, 2, axis=0), 2, axis=1)[:rows, :columns]
        asked = np.zeros((rows, columns), bool)
        if len(picture.mass) < 30:  # so coarse that neighbours of these blows are struck, too
            mixed = ndimage.binary_dilation(mixed, np.ones((3, 3)))
            for i in range(3):
                for j in range(3):
                    asked[i : i + rows - 2 : 2, j : j + columns - 2 : 2] |= mixed
            asked[::2, ::2] = False
        else:
            asked[::2, 1::2] = coarse[:, :-1] != coarse[:, 1:]
            asked[1::2, ::2] = coarse[:-1] != coarse[1:]
            asked[1::2, 1::2] = mixed
        mass, stiffness = (np.geomspace(v[0], v[-1], 2 * len(v) - 1) for v in (picture.mass, picture.stiffness))
        y, x = asked.nonzero()
        counts[y, x] = self._counts(mass[x], stiffness[y], picture.tolerance)
        return replace(picture, mass=mass, stiffness=stiffness, n_impacts=counts)

    def sharp(self, settings: Settings, picture: Picture, body: Modes | None = None) -> Picture:
        """The same map up to the pixels, by borders located between neighbours and joined by straight lines."""
        self._begin(settings, body)
        coarse = picture.n_impacts
        step = (FINEST - 1) // (coarse.shape[1] - 1)  # [pixel]
        rows, columns = (step * (n - 1) + 1 for n in coarse.shape)
        mass, stiffness = (
            np.geomspace(v[0], v[-1], n) for v, n in ((picture.mass, columns), (picture.stiffness, rows))
        )
        across, along = np.argwhere(coarse[:, :-1] != coarse[:, 1:]), np.argwhere(coarse[:-1] != coarse[1:])
        start = np.vstack([across, along])  # (n_crossed, 2) first ends of the edges that a border crosses
        way = np.repeat([[0, 1], [1, 0]], [len(across), len(along)], axis=0)
        near, far = np.zeros(len(start), int), np.full(len(start), step)
        for _ in range(step.bit_length() - 1):
            middle = (near + far) // 2
            y, x = (step * start + middle[:, None] * way).T
            found = self._counts(mass[x], stiffness[y], picture.tolerance)
            same = found == coarse[tuple(start.T)]
            near, far = np.where(same, middle, near), np.where(same, far, middle)
        crossed = step * start + 0.5 * (near + far)[:, None] * way  # (n_crossed, 2) [pixel]
        crossings: dict[tuple[int, int], list[np.ndarray]] = {}
        for (i, j), point, upright in zip(start.tolist(), crossed, way[:, 0]):
            for square in ((i, j), (i, j - 1) if upright else (i - 1, j)):  # on both sides of the edge
                crossings.setdefault(square, []).append(point)
        nearest = np.arange(rows) + step // 2, np.arange(columns) + step // 2
        counts = coarse[np.ix_(nearest[0] // step, nearest[1] // step)]
        y, x = np.mgrid[: step + 1, : step + 1]
        for (i, j), points in crossings.items():
            corners = coarse[i : i + 2, j : j + 2]
            if len(points) != 2 or corners.shape != (2, 2) or min(i, j) < 0:
                continue  # three counts meet, or the square is not on the map
            (p, q), here = points, corners[0, 0]
            side = (q[1] - p[1]) * (step * i + y - p[0]) - (q[0] - p[0]) * (step * j + x - p[1])
            other = corners[corners != here][0]
            block = counts[step * i : step * (i + 1) + 1, step * j : step * (j + 1) + 1]
            block[:] = np.where(side * side[0, 0] >= 0.0, here, other)
        return replace(picture, mass=mass, stiffness=stiffness, n_impacts=counts)

    def surer(self, settings: Settings, picture: Picture, body: Modes | None = None) -> Picture:
        """The same map, its points beside another number struck again as all those of finer maps will be."""
        self._begin(settings, body)
        counts = picture.n_impacts.copy()
        y, x = refined.beside_change(counts).nonzero()
        counts[y, x] = self._counts(picture.mass[x], picture.stiffness[y], MAP_TOLERANCE)
        return replace(picture, n_impacts=counts, tolerance=MAP_TOLERANCE)

    @property
    def batched(self) -> bool:
        """Whether blows of these settings are struck many at once."""
        laws = {name: np.array([value]) for name, value in law_numbers(self.case.contact).items()}
        return bool(cases.can_be_batched(laws).all()) and not self.case.modes.stretches

    def _begin(self, settings: Settings, body: Modes | None) -> None:
        """Forget what is kept if the settings, but for their place on the map, or the body are others."""
        settings = replace(settings, mass=self.setup.start.mass, stiffness=1.0)
        if self.about is None or self.about[0] != settings or self.about[1] is not body:
            self.about, self.case = (settings, body), self.setup.case(settings, body=body)
            self.kernels, self.limits = {}, None

    def _thresholds(self, mass: np.ndarray) -> np.ndarray:
        """Thresholds (n,) [Hz] of hammers (n,) [kg], interpolated between those found once for the whole map."""
        along = np.geomspace(*self.setup.range("mass"), 97)  # the points of the whole map are among these
        if self.limits is None:
            felt = self.case.striker.felt_mass / self.case.striker.mass
            self.limits = threshold.thresholds(self.case.modes, self.case.at, felt * along)
        place = np.interp(np.log(mass), np.log(along), np.arange(len(along)))
        low, part = place.astype(int), place % 1.0
        near, far = self.limits[low], self.limits[np.minimum(low + 1, len(along) - 1)]
        some = (near > 0.0) & np.isfinite(near) & (far > 0.0) & np.isfinite(far)
        ratio = np.divide(far, near, out=np.ones(len(mass)), where=some)
        return np.where(some, near * ratio**part, np.where(part < 0.5, near, far))

    def _counts(self, mass: np.ndarray, stiffness: np.ndarray, tolerance: float) -> np.ndarray:
        """Impacts (n,) of hammers (n,) with contacts (n,)."""
        if not len(mass):
            return np.empty(0, np.int8)
        case, law, shared = self.case, self.case.contact, np.ones(len(mass))
        hard = stiffness * law.stiffness
        lossy = law.loss > 0.0
        counts = np.full(len(mass), np.nan)
        if self.batched:
            family = {0: batches.Family.of(case.modes, case.at, case.striker, True, lossy)}
            blows = batches.Blows(
                family, np.zeros(len(mass), int), case.modes.mass * shared, mass, hard, law.exponent * shared,
                case.speed * shared, law.loss * shared,
            )  # fmt: skip
            counts = batches.count_impacts(blows, tolerance=tolerance, most=MORE, kernels=self.kernels)
        for i in np.flatnonzero(np.isnan(counts)):  # those that take long; the rest of "more" does not matter
            one = replace(case.changed("mass", mass[i]), contact=replace(law, stiffness=float(hard[i])))
            with suppress(SimulationError):
                counts[i] = strike_quickly(one, most=MORE).n_impacts
        return np.where(np.isnan(counts), -1, np.minimum(counts, MORE)).astype(np.int8)
