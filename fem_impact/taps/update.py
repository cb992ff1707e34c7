"""`update`: material constants that give measured frequencies."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import f, qmc, t

from .._base import check
from .._base.check import SimulationError
from ..fe.assembly import System
from ..modes.modal import Modes, find_modes
from ..scenes.scene import Scene, load_scene
from . import arguments, transfer
from .profiles import DOUBTED
from .solver import CLOSE
from .transfer import Pair
from .unknowns import Unknown

# [-] of logarithms, for derivatives by differences: frequencies go with powers of the constants; errs by 0.3 %
STEP = 0.01
MOST_SOLVES = 200  # [-] of the body
MORE = 2  # [-] modes computed beyond those measured, so that as many may be missed in the measurement
TABLES = ("mesh", "material", "section", "target", "supports")  # of a scene: what its modes depend on
# [-] measured frequencies, and their share, that may belong to no mode: with more, nobody knows which ones are right
MOST_SPURIOUS, SPURIOUS = 2, 0.34
LOOKS, STEPS = 16, 4  # [-] starts over the ranges, and steps of each, where frequencies go by powers of the constants
POOR = 0.1  # [-] half width of an interval, in logarithms: a constant known to no better than 10 % is called not told


@dataclass(frozen=True, eq=False, repr=False)
class Updated(check.Brief):
    """What `update` found."""

    values: Mapping[str, float]
    spread: Mapping[str, float]  # half width of the 90 % interval, relative; infinite if there is no spare frequency
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
        """Constants that the frequencies tell to no better than 10 %."""
        return tuple(name for name, spread in self.spread.items() if spread > POOR)

    def summary(self) -> str:
        """The constants and the frequencies in a few lines."""
        lines = [
            f"{name} = {value:.4g}"
            + (
                " (not told by these frequencies)"
                if self.spread[name] > 1.0
                else f" (± {100 * self.spread[name]:.2g} %)"
            )
            for name, value in self.values.items()
        ]
        left = ", ".join(f"{frequency:.5g} Hz" for frequency in self.unpaired)
        told = [f"without a mode of the body, left out: {left}"] if left else []
        return "\n".join([*lines, transfer.table(self.pairs), *told, f"{self.n_solves} solves"])


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
    measured : array_like, (n_modes,) [Hz], or Modes
        Ascending frequencies; `Modes` of a measurement are paired with the computed ones by their shapes too. Up to two
        that belong to no mode of the body are left out and told, if as many frequencies as unknowns are spare without
        them and chance hardly meets the others so well.
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
    >>> found.uncertain  # a thin disk's frequencies tell thickness times the root of the modulus only
    ('material.E', 'section.thickness')
    """
    if isinstance(build, (str, Path)):
        build = load_scene(check.path("build", build))
    if not isinstance(build, Scene) and not callable(build):
        raise ValueError(
            f"build must be a function of a dict of values, a Scene or the path of one, got {check.shown(build)}"
        )
    ranges = [Unknown(name, *limits) for name, limits in arguments.ranges("unknown", unknown).items()]
    for each in ranges:
        if not each.log:
            raise ValueError(f"unknown[{each.name!r}] must begin above zero, got {each.low:g}")
    target = measured.frequencies if isinstance(measured, Modes) else check.ascending("measured", measured, "Hz")
    if len(target) < len(ranges) or not ranges:
        raise ValueError(
            f"measured must hold at least {len(ranges)} frequencies for as many unknowns, got {len(target)}"
        )
    if (target <= 0.0).any():
        raise ValueError("measured must hold positive frequencies only; leave out rigid motions")
    if isinstance(build, Scene):
        _check_names(build, ranges)
    rigid = [0]  # motions of the body, which the measurement does not have
    kept: dict[bytes, Modes] = {}
    used = np.arange(len(target))  # numbers of the measured modes that are paired

    def modes_at(x: np.ndarray) -> Modes:
        key = x.tobytes()
        if key not in kept:
            if len(kept) >= MOST_SOLVES:
                raise SimulationError(f"the search did not end within {MOST_SOLVES} solves; narrow the ranges")
            values = {each.name: float(each.outside(z)) for each, z in zip(ranges, x)}
            find = _scene_modes(build, values) if isinstance(build, Scene) else _found(build(values))
            modes = find(len(target) + MORE + rigid[0])
            if modes.n_rigid > rigid[0]:
                rigid[0] = modes.n_rigid
                modes = find(len(target) + MORE + rigid[0])
            kept[key] = modes
        return kept[key]

    def paired(x: np.ndarray) -> tuple[Pair, ...]:
        modes = modes_at(x)
        if isinstance(measured, Modes):
            return transfer.matched(measured, modes, points=points, which=used)
        return transfer.matched(target, modes.frequencies[modes.omega > 0.0], which=used)

    def misfit(x: np.ndarray) -> np.ndarray:
        return np.log([1.0 + pair.difference for pair in paired(x)])

    def slopes(x: np.ndarray) -> np.ndarray:
        here, columns = misfit(x), []
        for i, each in enumerate(ranges):
            moved = x.copy()
            moved[i] += STEP if x[i] + STEP < each.bounds[1] else -STEP
            columns.append((misfit(moved) - here) / (moved[i] - x[i]))
        return np.column_stack(columns)

    middle = {each.name: float(np.sqrt(each.low * each.high)) for each in ranges} | arguments.table("start", start)
    bounds = np.array([each.bounds for each in ranges]).T
    first = np.array([float(each.inside(check.between(f"start[{each.name!r}]", middle[each.name], each.low, each.high)))
                      for each in ranges])  # fmt: skip
    inside = np.clip(first, bounds[0] + 1e-9, bounds[1] - 1e-9)
    options = {"ftol": CLOSE, "xtol": CLOSE, "gtol": 1e-12, "max_nfev": 40}
    found = least_squares(misfit, inside, slopes, bounds, **options)
    every = used
    for count in range(MOST_SPURIOUS + 1):
        spare = len(every) - count - len(ranges)
        if spare < len(ranges) or count > SPURIOUS * len(every):
            break
        table = _logs(modes_at(found.x))
        moved = [_logs(modes_at(found.x + step)) for step in STEP * np.eye(len(ranges))]
        steep = (np.column_stack(moved) - table[:, None]) / STEP
        rests = [np.setdiff1d(every, out) for out in combinations(every, count)]
        looks = [_look(np.log(target[rest]), table, steep, found.x, bounds) for rest in rests]
        best = int(np.argmin([cost for cost, _ in looks]))
        used = rests[best]
        again = least_squares(misfit, np.clip(looks[best][1], bounds[0] + 1e-9, bounds[1] - 1e-9), slopes, bounds,
                              **options)  # fmt: skip
        if not count:  # of all frequencies, from starts all over the ranges
            found = min(found, again, key=lambda one: one.cost)
            continue
        ratio = (found.cost - again.cost) / count / max(again.cost / spare, 1e-300)
        if len(rests) * float(f.sf(ratio, count, spare)) < DOUBTED:  # the best of so many choices by chance
            found = again
            break
        used = every
    modes, pairs = modes_at(found.x), paired(found.x)
    spare = len(used) - len(ranges)
    spread = {each.name: np.inf for each in ranges}
    if spare > 0:
        inverse = np.linalg.pinv(found.jac.T @ found.jac) * 2.0 * found.cost / spare
        flat = np.linalg.svd(found.jac, compute_uv=False)
        told = flat[-1] > 1e-6 * flat[0]
        half = float(t.ppf(0.95, spare)) * np.sqrt(np.diag(inverse))
        spread = {each.name: float(x) if told else np.inf for each, x in zip(ranges, half)}
    values = {each.name: float(each.outside(z)) for each, z in zip(ranges, found.x)}
    unpaired = tuple(float(target[i]) for i in np.setdiff1d(np.arange(len(target)), used))
    return Updated(values, spread, pairs, modes, len(kept), unpaired)


def _logs(modes: Modes) -> np.ndarray:
    return np.log(modes.frequencies[modes.omega > 0.0])


def _look(
    target: np.ndarray, table: np.ndarray, steep: np.ndarray, x: np.ndarray, bounds: np.ndarray
) -> tuple[float, np.ndarray]:
    """Sum of squares and constants for logarithms of measured frequencies (n,), by those computed at ``x``, (n_modes,),
    which go along with the constants as ``steep`` (n_modes, n_constants); the best of starts over the bounds."""
    best = np.inf, x
    for start in (x, *qmc.scale(qmc.Sobol(len(x), scramble=False).random(LOOKS), *bounds)):
        here = start
        for _ in range(STEPS):
            now = table + steep @ (here - x)
            order = np.argsort(now)
            columns = order[transfer.in_order(np.abs(now[order] - target[:, None]))]
            here = np.clip(x + np.linalg.lstsq(steep[columns], target - table[columns], rcond=None)[0], *bounds)
        miss = float(np.square(table[columns] + steep[columns] @ (here - x) - target).sum())
        best = min(best, (miss, here), key=lambda pair: pair[0])
    return best


def _check_names(scene: Scene, ranges: list[Unknown]) -> None:
    """ValueError unless the unknowns are numbers of the scene's body."""
    for each in ranges:
        check.one_of(f"the table of unknown[{each.name!r}]", each.name.partition(".")[0], TABLES)
        try:
            scene.changed({each.name: each.low})
        except ValueError as error:
            raise ValueError(f"unknown[{each.name!r}]: {error}") from None


def _scene_modes(scene: Scene, values: dict[str, float]) -> Callable[[int], Modes]:
    return scene.changed(values).modes


def _found(body: Any) -> Callable[[int], Modes]:
    """A function of the number of modes that finds them."""
    if isinstance(body, Modes):
        return lambda count: body
    if isinstance(body, System):
        return lambda count: find_modes(body, n_modes=count)
    raise ValueError(f"build must return a System of fi.assemble or Modes, got {check.shown(body)}")
