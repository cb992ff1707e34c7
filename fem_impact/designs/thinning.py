"""The search of `tune`: least material off, by linear programs over places of a body that is solved again and again."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import linprog

from .._base import check
from .._base.check import SimulationError
from ..fe import refinement
from ..fe.assembly import reassemble
from ..fe.system import System
from ..model.target import RIGID_MOTIONS, Target
from ..modes import finding
from ..modes.modal import Modes
from ..modes.varied import share_frequency
from ..modes.viewing import grid
from . import pitches as wishes
from .pitches import CENTS, Pitch, cents
from .removal import Dishes, Places, Sensitivity, thickness, thinned_section

PENALTY = 100.0  # [-] places taken down to the greatest depth that a miss of a cent weighs: more than any pitch costs


def drawing_grid(modes: Modes) -> tuple[np.ndarray, np.ndarray]:
    """Points (n_points, dimension) [m] and cells (n_cells, dimension + 1) all over a body, to draw and compare shapes.

    The elements of a bar are too few for that.
    """
    points, cells = grid(modes)
    if modes.dimension == 2:
        return points, cells
    here = np.arange(200)  # pieces: ten for each half wave of the twentieth mode
    return np.linspace(points.min(axis=0), points.max(axis=0), len(here) + 1), np.column_stack([here, here + 1])


@dataclass(frozen=True, eq=False, repr=False)
class Solved(check.Brief):
    """A body and those of its modes that are looked at."""

    modes: Modes
    which: np.ndarray  # (n,) their numbers among all modes

    @property
    def system(self) -> System:
        """The body of elements."""
        shapes: Any = self.modes.shapes
        found: System = shapes.system
        return found

    @property
    def frequencies(self) -> np.ndarray:
        """(n,) [Hz]."""
        return self.modes.frequencies[self.which]

    @property
    def errors(self) -> np.ndarray:
        """Stated errors of the frequencies, (n,) [cents]."""
        assert self.modes.frequency_error is not None
        return np.asarray(cents(1.0 + self.modes.frequency_error[self.which]))

    @cached_property
    def thinnest(self) -> float:
        """Least thickness [m]."""
        return float(thickness(self.system.section, self.system.mesh.points).min())

    def reach(self, depth: float) -> tuple[float, float]:
        """Factors between which frequencies stay, whatever is taken off up to a depth [m].

        They are those if only stiffness, or only mass, went where that is thinnest.
        """
        section, points = self.system.section, self.system.mesh.points
        less = thinned_section(section, lambda at: np.full(len(at), depth))
        each = (
            [getattr(one, name)(points).reshape(len(points), -1)[:, 0] for one in (less, section)]
            for name in ("stiffness", "rotary" if self.modes.thick else "inertia")
        )
        stiff, heavy = (float((left / whole).min()) for left, whole in each)
        return stiff**0.5, heavy**-0.5

    @cached_property
    def sensitivity(self) -> Sensitivity:
        """What taking material off does."""
        shapes: Any = self.modes.shapes
        return Sensitivity.of(self.system, shapes.vectors[:, self.which], self.modes.omega[self.which])


@dataclass(frozen=True, eq=False, repr=False)
class Blank(check.Brief):
    """The body to be tuned, and the modes that are looked at."""

    target: Target
    pitches: tuple[Pitch, ...]
    numbers: tuple[int, ...]  # of the flexible modes looked at, from 1
    start: Modes
    close: float  # [-] largest relative error of frequencies

    @classmethod
    def of(cls, target: Target, pitches: tuple[Pitch, ...], tolerance: float) -> "Blank":
        """With the modes that pitches mean, for a tolerance [cents]."""
        # frequencies err by a quarter of the tolerance at most: what is said of a pitch is then true
        close = min(0.25 * (2.0 ** (tolerance / CENTS) - 1.0), refinement.LOOSEST)
        unsettled = not pitches[0].mode
        # two above the highest wanted, to follow it if it passes them
        count = max(len(pitches) + 2, *(each.mode for each in pitches)) + 2 + RIGID_MOTIONS
        modes = target.find(count, tolerance=close)
        while unsettled and modes.frequencies[-1] < 2.0 * max(each.frequency or 0.0 for each in pitches):
            modes = target.find(2 * modes.n_modes, tolerance=close)
        if unsettled:
            pitches = wishes.match_pitches(pitches, modes.frequencies[modes.n_rigid :])
        numbers = sorted({each.mode for each in pitches} | {1 for each in pitches if each.ratio is not None})
        shared = share_frequency(modes).sum(axis=0) > 1
        for number in numbers:
            if shared[modes.n_rigid + number - 1]:
                raise SimulationError(
                    f"mode {number} at {modes.frequencies[modes.n_rigid + number - 1]:.6g} Hz shares its frequency "
                    "with another: a patch splits the pair, and neither has a slope of its own; start from a body "
                    "without this symmetry, or want other modes"
                )
        return cls(target, pitches, tuple(numbers), modes, close)

    @cached_property
    def spots(self) -> np.ndarray:
        """Places (n, dimension) [m] all over the body."""
        return drawing_grid(self.start)[0]

    def first(self) -> Solved:
        """As it stands."""
        return Solved(self.start, self.start.n_rigid + np.array(self.numbers) - 1)

    def after(self, dishes: Dishes, before: Solved) -> Solved:
        """With dishes, its modes followed by their shapes from a body much like it."""
        system, whole = before.system, self.first().system.section
        body = reassemble(replace(system, section=thinned_section(whole, dishes.depth)), system.mesh)
        wanted = None if self.target.size_stated else self.close
        modes = finding.find_modes(body, n_modes=self.start.n_modes, tolerance=wanted)
        old, new = (each.shapes.at(self.spots) for each in (before.modes, modes))
        old = old[:, before.which]
        cosines = (old.T @ new) ** 2 / ((old**2).sum(axis=0)[:, None] * (new**2).sum(axis=0))
        cosines[:, : modes.n_rigid] = 0.0
        which = cosines.argmax(axis=1)
        if cosines.max(axis=1).min() < 0.5 or len(set(which)) < len(which):
            lost = int(cosines.max(axis=1).argmin())
            raise SimulationError(
                f"mode {self.numbers[lost]} can no longer be identified after this removal; take less depth"
            )
        return Solved(modes, which)


@dataclass(eq=False)
class Thinning:
    """One search: places that a body may be thinned at, and where it stands."""

    body: Blank
    before: Solved
    depth: float  # [m] greatest
    radius: float  # [m]
    mirror: str
    tolerance: float  # [cents]
    n_solved: int = 1

    @cached_property
    def sought(self) -> tuple[Pitch, ...]:
        """The pitches of which something is wanted."""
        return tuple(each for each in self.body.pitches if each.words)

    def misses(self, solved: Solved) -> np.ndarray:
        """How far each pitch is missed, (n_pitches,) [cents]."""
        first, now = self.before.frequencies, solved.frequencies
        own = now[[self.body.numbers.index(each.mode) for each in self.sought]]
        return np.asarray(cents(own, [each.wanted(first, now, self.body.numbers) for each in self.sought]))

    def miss_slopes(self, solved: Solved, places: Places) -> tuple[np.ndarray, np.ndarray]:
        """Changes of the misses (n_pitches, n_places) [cents/m] with depths, and areas (n_places,) [m^2]."""
        each, areas = map(places.summed, solved.sensitivity.of_dishes(places.middles, self.radius))
        columns = each.T
        own = columns[[self.body.numbers.index(row.mode) for row in self.sought]]
        for i, row in enumerate(self.sought):
            if row.ratio is not None:
                own[i] -= columns[self.body.numbers.index(1)]
        return own, areas

    def choose_places(self, most: int) -> list[tuple[np.ndarray, float]]:
        """At most so many places, each with its images and depth, from the largest."""
        places = Places.over(self.before.system, self.radius, self.mirror)
        share, solved = self.settle(places, np.zeros(len(places.first)), self.before)
        order = np.argsort(-share, kind="stable")
        keep = order[share[order] > 0.02 * share.max()][:most] if share.any() else order[:0]  # others are negligible
        if len(keep) < np.count_nonzero(share) and len(keep):
            places = places.some(keep)
            try:
                start = share[keep], self.after(places, share[keep], solved)
            except SimulationError:  # modes that cannot be followed to there at once
                start = np.zeros(len(keep)), self.before
            share, _ = self.settle(places, *start)
            order = np.argsort(-share, kind="stable")
            keep = order[share[order] > 0.0]
        return [(places.middles[places.owners == k], float(share[k] * self.depth)) for k in keep]

    def after(self, places: Places, share: np.ndarray, near: Solved) -> Solved:
        """The body with dishes of shares (n_places,) of the greatest depth."""
        self.n_solved += 1
        return self.body.after(places.dishes(share * self.depth), near)

    def settle(self, places: Places, share: np.ndarray, solved: Solved) -> tuple[np.ndarray, Solved]:
        """Shares (n_places,) of the greatest depth that take least off, and the body then; from shares to start at."""
        room, overlaps = 0.5 * self.tolerance, places.overlaps  # as much is left to what the search errs
        trust = 0.1 * self.before.thinnest / self.depth  # slopes of so large a step hold to a tenth or two
        slopes, areas = self.miss_slopes(solved, places)
        cost = areas / areas.max()

        def merit(share: np.ndarray, misses: np.ndarray) -> float:
            return float(cost @ share + PENALTY * np.maximum(np.abs(misses) - room, 0.0).sum())

        now, stalled = self.misses(solved), 0
        for _ in range(40):  # bodies: those of a bar cut to a third of its height take 25
            tried = _cheapest_shares(cost, slopes * self.depth, now, share, overlaps, room, trust)
            predicted = merit(share, now) - merit(tried, now + slopes @ (self.depth * (tried - share)))
            if stalled == 6 or predicted <= 0.01 * max(float(cost @ share), 0.01):  # of what is taken off
                break
            try:
                other = self.after(places, tried, solved)
            except SimulationError:
                trust *= 0.5
                continue
            gained = merit(share, now) - merit(tried, self.misses(other))
            # so many bodies that each make up for less than a hundredth of the misses, and do not gain speed
            quick = gained > 0.01 * merit(0.0 * share, now)
            stalled = 0 if quick else stalled + (gained <= 0.75 * predicted)
            if gained > 0.0:
                share, solved, now = tried, other, self.misses(other)
                slopes, _ = self.miss_slopes(solved, places)
            trust *= 2.0 if gained > 0.75 * predicted else 1.0 if gained > 0.25 * predicted else 0.4
        return share, solved


def _cheapest_shares(
    cost: np.ndarray, slopes: np.ndarray, now: np.ndarray, share: np.ndarray, overlaps: np.ndarray, room: float,
    trust: float,
) -> np.ndarray:  # fmt: skip
    """Shares (n,) that cost least with misses, linear in them, within ``room``, or as little beyond as possible.

    Of the limits where dishes overlap few matter, and only those are given: all of a plate's, some 5 000 in 300 shares,
    take 5 to 15 times as long, a third of the whole search.
    """
    n, rows = len(share), len(now)
    beyond = -np.eye(rows)
    held = slopes @ share - now
    limits = np.minimum(1.0, overlaps @ share + trust)
    bounds = [(max(0.0, s - trust), min(1.0, s + trust)) for s in share] + [(0.0, None)] * rows
    close = np.zeros(len(limits), bool)
    while True:
        matrix = np.block([[slopes, beyond], [-slopes, beyond], [overlaps[close], np.zeros((close.sum(), rows))]])
        sides = np.concatenate([room + held, room - held, limits[close]])
        for method in ("highs", "highs-ipm"):  # the simplex method fails at times, and is better where it does not
            found = linprog(np.append(cost, np.full(rows, PENALTY)), matrix, sides, bounds=bounds, method=method)
            if found.x is not None:
                break
        else:
            raise SimulationError(f"the linear program of a step failed: {found.message}")
        best = np.clip(np.asarray(found.x[:n]), 0.0, 1.0)
        passed = (overlaps @ best > limits + 1e-6) & ~close
        if not passed.any():
            return best
        close |= passed
