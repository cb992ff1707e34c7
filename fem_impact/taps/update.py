"""`update`: material constants that give measured frequencies."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import f, qmc, t

from .._base import check, markup
from .._base.check import SimulationError
from .._base.threads import one_thread
from ..fe.assembly import System
from ..modes.finding import find_modes
from ..modes.modal import Modes
from ..scenes.scene import Scene, load_scene
from . import transfer
from .profiles import DOUBTED
from .solver import CLOSE, ENOUGH, MOST_OUTLIERS, Solution, least
from .transfer import Pair, frequencies
from .unknowns import Box

# [-] of logarithms, for derivatives by differences: frequencies go with powers of the constants; errs by 0.3 %
STEP = 0.01
MOST_SOLVES = 200  # [-] of the body: a search takes some twenty
TABLES = ("mesh", "material", "section", "target", "supports")  # of a scene: what its modes depend on


@dataclass(frozen=True, eq=False, repr=False)
class Updated(check.Brief):
    """What `update` found."""

    values: Mapping[str, float]
    # half width of the 90 % interval, relative, with another solution that fits as well; infinite without spare ones
    spread: Mapping[str, float]
    pairs: tuple[Pair, ...]
    modes: Modes
    n_solves: int
    unpaired: tuple[float, ...] = ()  # [Hz] measured frequencies that belong to no mode of the body

    @property
    def error(self) -> float:
        """Largest relative difference of a frequency [-]."""
        return max(abs(pair.difference) for pair in self.pairs)

    @property
    def uncertain(self) -> tuple[str, ...]:
        """Constants that the frequencies determine to no better than 10 %."""
        return tuple(name for name, spread in self.spread.items() if spread > 0.1)

    def summary(self) -> str:
        """The constants and the frequencies in a few lines."""
        lines = []
        for name, value in self.values.items():
            spread = self.spread[name]
            width = " (not determined by these frequencies)" if spread > 1.0 else f" (± {100 * spread:.2g} %)"
            lines.append(f"{name} = {value:.4g}{width}")
        left = ", ".join(f"{frequency:.5g} Hz" for frequency in self.unpaired)
        alone = [f"without a mode of the body, left out: {left}"] if left else []
        rows = [
            (pair.measured + 1, f"{pair.measured_frequency:.5g} Hz", pair.computed + 1,
             f"{pair.computed_frequency:.5g} Hz", f"{100.0 * pair.difference:+.2f} %",
             "" if pair.mac is None else f"{pair.mac:.3f}")
            for pair in self.pairs
        ]  # fmt: skip
        table = markup.columns(rows, ("measured", "", "computed", "", "difference", "MAC"))
        return "\n".join([*lines, *table, *alone, f"{self.n_solves} solves"])


@one_thread
def update(
    build: Callable[[dict[str, float]], Any] | Scene | str | Path,
    measured: Any,
    unknown: Mapping[str, Any],
    *,
    start: Mapping[str, float] | None = None,
    points: Any = None,
) -> Updated:
    """Fit material constants to measured frequencies.

    Parameters
    ----------
    build : path of a scene file, Scene, or function
        The body. Of a scene, the unknowns are numbers of its tables by their names, such as ``material.E``,
        ``section.thickness`` or ``supports.left.stiffness``; its modes are found to the tolerance of its strike. A
        function takes a dict of values and returns the assembled `System` or its `Modes`.
    measured : array_like, (n_modes,) [Hz], Modes, or xarray.Dataset of fi.frf
        Ascending frequencies, or frequency responses whose peaks are picked; `Modes` of a measurement are paired with
        the computed ones by their shapes too. Up to two that belong to no mode of the body are left out and named, if
        as many frequencies as unknowns are spare without them and chance hardly meets the others so well. Where other
        constants fit as well, as frequencies alone cannot tell the directions of a plate, intervals reach to them.
    unknown : mapping of name to (low, high), both positive
    start : mapping of name to value, optional
        By default the middle of each range.
    points : array_like, (n_points, dimension) [m], optional
        Where shapes are compared; by default the measured points.

    Returns
    -------
    Updated

    Raises
    ------
    ValueError
        If there are fewer frequencies than unknowns, ``build`` returns something else, or a scene has no such number.
    SimulationError
        If the search does not end within 200 solves.

    Examples
    --------
    >>> def bar(values):
    ...     section = fi.Beam.rectangular(fi.Material(E=values["E"], nu=0.3, rho=7850.0), width=0.02, height=0.01)
    ...     return fi.assemble(fi.mesh.line(0.5), section, supports={"left": "clamped"})
    >>> true = fi.find_modes(bar({"E": 205e9}), n_modes=4).frequencies
    >>> found = fi.update(bar, true, {"E": (50e9, 500e9)})
    >>> round(found.values["E"] / 1e9, 2)
    205.0
    >>> ranges = {"material.E": (100e9, 300e9), "section.thickness": (5e-3, 20e-3)}
    >>> found = fi.update("studies/scenes/disk.toml", [2500.0, 5200.0, 8530.0], ranges)
    >>> found.uncertain  # a thin disk's frequencies determine thickness times the root of the modulus only
    ('material.E', 'section.thickness')
    """
    if isinstance(build, (str, Path)):
        build = load_scene(check.path("build", build))
    if not isinstance(build, Scene) and not callable(build):
        raise ValueError(
            f"build must be a function of a dict of values, a Scene or the path of one, got {check.shown(build)}"
        )
    box = Box.of("unknown", unknown)
    for each in box.unknowns:
        if not each.log:
            raise ValueError(f"unknown[{each.name!r}] must begin above zero, got {each.low:g}")
    target, n = frequencies("measured", measured), len(box.unknowns)
    if len(target) < n:
        raise ValueError(f"measured must hold at least {n} frequencies for as many unknowns, got {len(target)}")
    if (target <= 0.0).any():
        raise ValueError("measured must hold positive frequencies only; leave out rigid motions")
    if isinstance(build, Scene):
        for each in box.unknowns:
            check.one_of(f"the table of unknown[{each.name!r}]", each.name.partition(".")[0], TABLES)
            try:
                build.changed({each.name: each.low})
            except ValueError as error:
                raise ValueError(f"unknown[{each.name!r}]: {error}") from None
    search = _Misfit(build, box, measured, target, points)
    used = every = np.arange(len(target))  # numbers of the measured modes that are paired
    solutions = [search.fit(box.start_at(start), every)]
    for count in range(3):  # frequencies that belong to no mode: with more, nobody knows which ones are right
        spare = len(every) - count - n
        if spare < (n if count else 1) or count > MOST_OUTLIERS * len(every):
            break
        rests = [np.setdiff1d(every, out) for out in combinations(every, count)]
        again, rest = search.look(solutions[0].x, rests)[:2]
        if not count:  # of all frequencies, from starts all over the ranges
            solutions = sorted([*solutions, again], key=lambda one: one.cost)
            continue
        ratio = (solutions[0].cost - again.cost) / count / max(again.cost / spare, 1e-300)
        if len(rests) * float(f.sf(ratio, count, spare)) < DOUBTED:  # the best of so many choices by chance
            solutions, used = [again], rest
            break
    if len(used) > n:
        again, _, other = search.look(solutions[0].x, [used])
        solutions += [again] if other is None else [again, search.fit(other, used)]
    found = min(solutions, key=lambda one: one.cost)
    unpaired, half = tuple(target[np.setdiff1d(every, used)].tolist()), _half_widths(found, solutions, len(used))
    fitted = dict(zip(box.names, half)), search.pairs(found.x, used), search.modes_at(found.x)
    return Updated(box.values_at(found.x), *fitted, len(search.solved), unpaired)


def _half_widths(found: Solution, solutions: Sequence[Solution], n_used: int) -> np.ndarray:
    """Half widths (n,) of the 90 % intervals of the constants' logarithms, up to any solution that fits as well.

    Infinite where ``n_used`` frequencies do not limit them.
    """
    spare, sizes = n_used - len(found.x), np.linalg.svd(found.jacobian, compute_uv=False)
    if spare < 1 or sizes[-1] <= 1e-6 * sizes[0]:
        return np.full(len(found.x), np.inf)
    wide, variance = float(t.ppf(0.95, spare)), found.cost / spare
    own = wide * np.sqrt(np.diag(np.linalg.pinv(found.jacobian.T @ found.jacobian)) * variance)
    enough = max(wide**2 * variance, 1e-10 * n_used)  # numbers have five digits
    alike = [one.x for one in solutions if one.cost - found.cost <= enough]
    return np.asarray(own + np.abs(np.array(alike) - found.x).max(axis=0))


@dataclass(eq=False)
class _Misfit:
    """Misfits of frequencies over coordinates of the constants, and the modes found so far."""

    build: Any
    box: Box
    measured: Any
    target: np.ndarray  # (n_measured,) [Hz]
    points: Any
    n_rigid: int = 0  # motions of the body, which the measurement does not have
    solved: dict[bytes, Modes] = field(default_factory=dict)

    def modes_at(self, x: np.ndarray) -> Modes:
        """The modes of the body, two beyond those measured, so that as many may be missed in the measurement."""
        key = x.tobytes()
        while key not in self.solved:
            if len(self.solved) >= MOST_SOLVES:
                raise SimulationError(f"the search did not end within {MOST_SOLVES} solves; narrow the ranges")
            values, count = self.box.values_at(x), len(self.target) + 2 + self.n_rigid
            modes = self.build.changed(values).modes(count) if isinstance(self.build, Scene) else self.build(values)
            if isinstance(modes, System):
                modes = find_modes(modes, n_modes=count)
            if not isinstance(modes, Modes):
                raise ValueError(f"build must return a System of fi.assemble or Modes, got {check.shown(modes)}")
            if modes.n_rigid <= self.n_rigid:
                self.solved[key] = modes
            self.n_rigid = max(modes.n_rigid, self.n_rigid)
        return self.solved[key]

    def pairs(self, x: np.ndarray, used: np.ndarray) -> tuple[Pair, ...]:
        """Measured modes of some numbers with computed ones."""
        modes = self.modes_at(x)
        if isinstance(self.measured, Modes):
            return transfer.matched(self.measured, modes, points=self.points, which=used)
        return transfer.matched(self.target, modes.frequencies[modes.omega > 0.0], which=used)

    def _logs(self, x: np.ndarray) -> np.ndarray:
        modes = self.modes_at(x)
        return np.log(modes.frequencies[modes.omega > 0.0])

    def fit(self, x: np.ndarray, used: np.ndarray) -> Solution:
        """The least squares of some of the measured frequencies, from a start."""
        low, high = self.box.bounds

        def misfit(x: np.ndarray) -> np.ndarray:
            return np.log([1.0 + pair.difference for pair in self.pairs(x, used)])

        def slopes(x: np.ndarray) -> np.ndarray:
            moved = x + np.diag(np.where(x + STEP < high, STEP, -STEP))
            return np.column_stack([(misfit(one) - misfit(x)) / (one[i] - x[i]) for i, one in enumerate(moved)])

        return least(misfit, slopes, x, (low, high), close=CLOSE, iterations=ENOUGH)

    def look(self, x: np.ndarray, rests: list[np.ndarray]) -> tuple[Solution, np.ndarray, np.ndarray | None]:
        """The fit of the best of some choices of frequencies, that choice, and where another fit of it may begin.

        They are found by Rayleigh quotients of the modes at ``x``, from 16 starts over the ranges with four steps each.
        That other one is not worth a fit if it misses by more than ten times the best and 1 % of each frequency.
        """
        table, bounds = self._logs(x), self.box.bounds
        moved = np.column_stack([self._logs(x + step) - table for step in STEP * np.eye(len(x))]) / STEP
        starts = (x, *qmc.scale(qmc.Sobol(len(x), scramble=False).random(16), *bounds))
        ends = []
        for rest in rests:
            wanted = np.log(self.target[rest])
            for here in starts:
                for _ in range(4):
                    now, steep = _rayleigh(moved, here - x)
                    order = np.argsort(table + now)
                    columns = order[transfer.in_order(np.abs((table + now)[order] - wanted[:, None]))]
                    step = np.linalg.lstsq(steep[columns], wanted - (table + now)[columns], rcond=None)[0]
                    here = np.clip(here + step, *bounds)
                miss = float(np.square((table + _rayleigh(moved, here - x)[0])[columns] - wanted).sum())
                ends.append((miss, here, rest))
        least_miss, best, chosen = min(ends, key=lambda one: one[0])
        enough = max(10.0 * least_miss, 1e-4 * len(chosen))
        others = [end for end in ends if end[2] is chosen and end[0] < enough and np.abs(end[1] - best).max() > 0.05]
        return self.fit(best, chosen), chosen, min(others, key=lambda one: one[0])[1] if others else None


def _rayleigh(steep: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Changes (n_modes,) of logarithms of frequencies, and their derivatives, along logarithms (n,) of constants.

    Of each mode the derivatives (n_modes, n) at the start are half its shares of stiffness, of mass below zero; a share
    goes with the constant, or with the power of it that the largest share shows.
    """
    powers = np.maximum(1.0, 2.0 * np.abs(steep).max(axis=0))
    changes, slopes = np.zeros(len(steep)), np.zeros(steep.shape)
    for sign in (1.0, -1.0):  # of stiffness, of mass
        shares = np.maximum(sign * 2.0 * steep / powers, 0.0)
        moved = shares * np.exp(powers * way)
        whole = np.maximum(1.0 - shares.sum(axis=1) + moved.sum(axis=1), 1e-3)
        changes += sign * 0.5 * np.log(whole)
        slopes += sign * 0.5 * powers * moved / whole[:, None]
    return changes, slopes
