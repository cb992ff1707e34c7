"""A table of blows: maps, spreads, borders and choices of a hammer are rows of changes of one blow, solved alike."""

import logging
import math
import os
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, TypeVar

import numpy as np

from .._base.check import SimulationError
from .._base.rounding import ROUNDING
from ..impact.distance import distance
from ..impact.response import Response
from ..modes.modal import Modes
from . import batches
from .cells import ALONE, FAMILY_AXES, LOSSY, Case, computed_together, law_numbers
from .refined import COUNTED
from .store import LARGEST_BLOCK, Texts, Watch, block_size, by_blocks, by_cluster

LOG = logging.getLogger(__name__)
Result = TypeVar("Result")
LAYERS: dict[str, tuple[str, str]] = {  # name: unit, what it is
    "n_impacts": ("", "number of separate contacts"),
    "contact_time": ("s", "total contact time"),
    "restitution": ("", "minus the speed after the blow over the speed before, at the contact point; NaN in contact"),
    "impulse": ("N s", "total impulse of the contact force"),
    "peak_force": ("N", "largest contact force"),
    "margin": ("", "how near the number of impacts is to another, over the deepest approach; given up to 0.05"),
    "error": ("", "estimated time-step error: absolute for restitution, relative for the others"),
    "truncation": ("", "expected error of the body's description; infinite where modes left out govern the contact"),
    "centroid": ("Hz", "mean frequency, weighted by the magnitude of the force spectrum"),
}
POWERS = {"contact_time": -1.0, "impulse": 1.0, "peak_force": 2.0, "centroid": 1.0}  # of a unit of time, see `Cases`
FAMILIES = 256  # [-] most pairs of bodies of rows that need kernels of their own: some 5 ms each


@dataclass(frozen=True, eq=False)
class Cases:
    """The blow that all cases share, and what is different in each: every combination of values, or row by row.

    Of rows, the numbers that need kernels of their own (strike point, damping, and the frequency of a flexible striker
    over that of the body) must take few values, see `fewer_values`. The body's frequency is free there: with time in
    units of its period the blow on a body r times as high is that on the body itself, of stiffness over r squared and
    speed over r.
    """

    base: Case
    axes: Mapping[str, np.ndarray]  # name in `cells.AXES`: (n,) values, for `at` (n, dimension)
    tolerance: float  # [-]
    residual: bool = True
    band: float | None = None  # [Hz] upper end of the centroid's band
    extra: Mapping[str, Callable[[Response], float]] = field(default_factory=dict)  # additional layers
    by_row: bool = False  # whether all axes are columns of one table, as long as each other, and not to be combined
    chosen: np.ndarray | None = None  # (n_cases,) combinations to compute, numbered with the last axis fastest
    kernels: batches.Kernels = field(default_factory=dict)  # computed so far

    @property
    def shape(self) -> tuple[int, ...]:
        sizes = tuple(len(values) for values in self.axes.values())
        return sizes[:1] if self.by_row else sizes

    @property
    def n_cases(self) -> int:
        return math.prod(self.shape) if self.chosen is None else len(self.chosen)

    @property
    def lossy(self) -> bool:
        """Whether any contact loses energy."""
        return bool(self.base.contact.lossy or LOSSY & set(self.axes))

    @property
    def special(self) -> bool:
        """Whether any contact is more than a power law with or without loss."""
        return bool(self.base.contact.special or ALONE & set(self.axes))

    @property
    def quick(self) -> bool:
        """Whether all cases are computed together, and none with loss, which takes longer."""
        alone = self.lossy or self.extra or self.base.modes.stretches
        return computed_together(self.base.contact, self.axes) and not alone

    @property
    def layers(self) -> list[str]:
        """Names of the numbers computed of each case."""
        return [name for name in LAYERS if name != "centroid" or self.band is not None] + list(self.extra)

    def cells(self, start: int, stop: int) -> np.ndarray:
        """Numbers of some of the cases to compute, (n_cells,)."""
        return np.arange(start, stop) if self.chosen is None else self.chosen[start:stop]

    def numbered(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Which value of each axis some of the cases have, (n_cells,) each."""
        cells = self.cells(start, stop)
        return dict(zip(self.axes, [cells] * len(self.axes) if self.by_row else np.unravel_index(cells, self.shape)))

    def blow(self, index: int) -> Response:
        """One blow by the modal engine."""
        numbered = self.numbered(index, index + 1)
        return self.strike(self.base.with_values({name: self.axes[name][i[0]] for name, i in numbered.items()}))

    def strike(self, case: Case) -> Response:
        """A blow by the modal engine, to the tolerance of the table."""
        return case.blow(tolerance=self.tolerance, residual=self.residual)

    def row(self, hit: Response) -> np.ndarray:
        """The layers (n_layers,) of one blow."""
        described = hit.error.truncation + hit.error.mesh + hit.error.measurement if hit.error.resolvable else np.inf
        row = [hit.n_impacts, hit.contact_time, hit.restitution, hit.impulse, hit.peak_force]
        row += [hit.margin, hit.error.step, described]
        row += [hit.spectral_centroid(self.band)] if self.band is not None else []
        return np.array(row + [function(hit) for function in self.extra.values()], float)

    def apart(self, one: np.ndarray, two: np.ndarray) -> dict[str, Any]:
        """Differences of two results (n_layers, ...) in each quantity, relative to the first where these are."""
        first, second = (
            {name: x for name, x in zip(self.layers, rows) if name in LAYERS and name not in COUNTED}
            for rows in (one, two)
        )
        return distance(second, first)

    def labelled(self, numbers: np.ndarray) -> dict[str, tuple[np.ndarray, dict[str, Any]]]:
        """Values and attributes of each layer of a result (n_layers, ...); n_impacts is -1 where a blow failed."""
        found = {}
        for name, values in zip(self.layers, numbers):
            unit, meaning = LAYERS.get(name, ("", name))
            about: dict[str, Any] = {"units": unit or "1", "long_name": meaning}
            if name == "n_impacts":
                values = np.where(np.isnan(values), -1, values).astype(np.int32)
            if name == "centroid":
                about |= {"max_frequency": self.band, "sum_error": batches.SUMMED}
            found[name] = values, about
        return found

    def scene(self) -> dict[str, Any]:
        """The blow that all cases share, as plain numbers."""
        case = self.base
        return {
            "target": _plain(case.modes, case.at),
            "striker": _plain(case.striker.modes, case.striker.at),
            "contact": dict(vars(case.contact)),
            "speed": case.speed,
        }

    def sampled(self) -> "Cases":
        """The same cases with each body reduced to its contact points: small enough to send to a cluster."""
        if self.base.modes.stretches:
            return replace(self, kernels={})  # slopes are not known from points
        places = np.unique(self.axes["at"], axis=0) if "at" in self.axes else self.base.at[None]
        return replace(self, base=self.base.sampled(places), kernels={})

    def without_speed(self) -> "Cases | None":
        """The cases at one speed if every contact is linear, so that speed only scales the forces; otherwise None."""
        exponents = self.axes.get("exponent", np.array([self.base.contact.exponent]))
        preloaded = self.base.contact.gap or "gap" in self.axes
        if "speed" not in self.axes or (exponents != 1.0).any() or not self.quick or preloaded:
            return None
        return replace(self, axes={**self.axes, "speed": self.axes["speed"][:1]})

    @cached_property
    def ratio(self) -> np.ndarray:
        """Factor (n_rows,) [-] by which the frequencies of the struck body are raised: its period is the unit."""
        if "target_frequency" not in self.axes:
            return np.ones(self.n_cases)
        return self.axes["target_frequency"] / self.base.first_frequency

    @cached_property
    def pairs(self) -> tuple[np.ndarray, np.ndarray]:
        """Number of the pair of bodies of each row (n_rows,), and one row of each pair (n_pairs,)."""
        columns: list[Any] = [np.zeros(self.n_cases)]
        if self.base.striker.modes.omega.any():
            columns.append(np.log(self.axes.get("striker_frequency", 1.0) / self.ratio))
        columns += [*self.axes["at"].T] if "at" in self.axes else []
        columns += [self.axes["damping_ratio"]] if "damping_ratio" in self.axes else []
        columns += [self.axes["loss"] > 0.0] if "loss" in self.axes else []
        numbers = [_ranks(np.asarray(column, float)) for column in columns]
        _, one, which = np.unique(np.column_stack(numbers), axis=0, return_index=True, return_inverse=True)
        return which.reshape(-1), one

    def families(
        self, numbered: Mapping[str, np.ndarray], loss: np.ndarray
    ) -> tuple[dict[int, batches.Family], np.ndarray]:
        """The pairs of bodies of some cases by number, and that of each case (n_cells,).

        Of rows they are those with time in units of the struck body's period.
        """
        if self.by_row:
            which, one = self.pairs
            kind = which[next(iter(numbered.values()))]
        else:
            kind = np.zeros(len(loss), int)
            for name in FAMILY_AXES:
                if name in numbered:
                    kind = kind * len(self.axes[name]) + numbered[name]
            kind = 2 * kind + (loss > 0.0)
        found = {}
        for number, i in zip(*np.unique(kind, return_index=True)):
            # nothing else of the case, so that no block is rounded differently
            names, raised = [name for name in numbered if name in FAMILY_AXES], 1.0
            values = {name: self.axes[name][one[number] if self.by_row else numbered[name][i]] for name in names}
            if self.by_row:
                values.pop("target_frequency", None)
                raised = float(self.ratio[one[number]])
            case = self.base.with_values(values)
            striker = case.striker
            if raised != 1.0 and striker.modes.omega.any():
                striker = replace(striker, modes=striker.modes.stretched(1.0, 1.0 / raised))
            lossy = bool(loss[i] > 0.0)
            found[int(number)] = batches.Family.of(case.modes, case.at, striker, self.residual, lossy)
        return found, kind

    def bands(self, ratio: np.ndarray) -> np.ndarray:
        """Upper end of the centroid's band in units of the period of each body (n_cells,) [Hz].

        Some 64 different ones, which rows between share: each takes kernels of its own.
        """
        if self.band is None:
            return np.zeros(len(ratio))
        log = np.log(ratio)
        width = np.ptp(log) / 64
        return self.band / np.exp(width * np.round(log / width) if width > ROUNDING else log)


def _plain(modes: Modes, at: np.ndarray) -> dict[str, Any]:
    """A body and its contact point as plain numbers."""
    place = at[None]
    return {
        "mass": modes.mass, "frequencies": modes.frequencies.tolist(), "damping_ratios": modes.damping_ratio.tolist(),
        "at": at.tolist(), "shape": modes.shape_at(place)[0].tolist(),
        "residual_compliance": float(modes.residual_compliance(place)[0, 0]),
    }  # fmt: skip


def _ranks(column: np.ndarray) -> np.ndarray:
    """Whole numbers (n,) that are equal where values are, up to rounding."""
    order = np.argsort(column, kind="stable")
    ascending = column[order]
    steps = np.diff(ascending) > ROUNDING * np.maximum(1.0, np.abs(ascending[1:]))
    ranks = np.empty(len(column), int)
    ranks[order] = np.concatenate([[0], np.cumsum(steps)])
    return ranks


def fewer_values(cases: Cases) -> Cases:
    """The same rows with few values of what needs kernels of its own: each value becomes the nearest level.

    All dimensions that need kernels get equally many levels, each for as many rows as any other, at most `FAMILIES`
    together. The levels are means of their rows, so that means over all rows stay what they were.
    """
    base, axes = cases.base, cases.axes
    columns: dict[tuple[str, int], np.ndarray] = {}
    if base.striker.modes.omega.any() and {"striker_frequency", "target_frequency"} & set(axes):
        first = base.striker.modes.frequencies[base.striker.modes.omega > 0.0][0]
        columns["striker_frequency", 0] = axes.get("striker_frequency", first) / cases.ratio
    if "at" in axes:
        columns |= {("at", i): column for i, column in enumerate(axes["at"].T) if np.ptp(column) > 0.0}
    if "damping_ratio" in axes:
        columns["damping_ratio", 0] = axes["damping_ratio"]
    found = {name: np.array(values) for name, values in axes.items()}
    for (name, i), column in columns.items():
        number, levels = int(FAMILIES ** (1.0 / len(columns))), np.array(column, float)
        if len(np.unique(column)) > number:
            for part in np.array_split(np.argsort(column, kind="stable"), number):  # groups of neighbours
                levels[part] = column[part].mean()
        if name == "at":
            found["at"][:, i] = levels
        else:
            found[name] = levels * cases.ratio if name == "striker_frequency" else levels
    return replace(cases, axes=found, kernels={})


def can_be_batched(column: Mapping[str, np.ndarray]) -> np.ndarray:
    """Which blows (n_cells,) can be followed together, by their parameters, (n_cells,) each."""
    found = (column["exponent"] >= 1.0) & (column["gap"] >= 0.0)
    for name in ALONE:
        found &= column[name] == 0.0
    return found


def solve_all(
    cases: Cases, workers: int | None = None, client: Any = None, store: Any = None, watch: Watch | None = None
) -> tuple[np.ndarray, Texts]:
    """Compute all cases, block by block, on a cluster or in threads of this process; as `solve_cases`."""
    LOG.info("%d blows at the tolerance %g", cases.n_cases, cases.tolerance)
    if client is not None:
        return by_cluster(cases, client, store, partial(solve_cases, workers=1), watch)
    often = cases.lossy or cases.extra  # slow ones report more often
    size = max(batches.FEW, block_size(cases.n_cases)) if often else LARGEST_BLOCK
    return by_blocks(cases, partial(solve_cases, workers=workers), watch, size, store)


def solve_cases(cases: Cases, start: int, stop: int, *, workers: int | None = None) -> tuple[np.ndarray, Texts]:
    """Compute the cases from ``start`` up to ``stop``.

    Returns
    -------
    numbers : ndarray, shape (n_layers, n_cells)
    texts : dict of failed case to its error text
    """
    names, base, count = cases.layers, cases.base, stop - start
    numbers = np.full((len(names), count), np.nan)
    numbered = cases.numbered(start, stop)
    shared = {"target_mass": base.modes.mass, "mass": base.striker.mass, "speed": base.speed}
    shared |= law_numbers(base.contact)
    column = {
        name: cases.axes[name][numbered[name]] if name in numbered else np.full(count, value)
        for name, value in shared.items()
    }
    quick = can_be_batched(column) & (not cases.extra) & (not base.modes.stretches)
    ratio = cases.ratio[cases.cells(start, stop)] if cases.by_row else np.ones(count)
    bands = cases.bands(ratio)
    for band in np.unique(bands[quick]):
        cells = np.flatnonzero(quick & (bands == band))
        r = ratio[cells]
        families, kind = cases.families({name: i[cells] for name, i in numbered.items()}, column["loss"][cells])
        blows = batches.Blows(
            families, kind, column["target_mass"][cells], column["mass"][cells], column["stiffness"][cells] / r**2,
            column["exponent"][cells], column["speed"][cells] / r, column["loss"][cells] * r,
        )  # fmt: skip
        found = batches.follow_blows(
            blows, tolerance=cases.tolerance, band=float(band), workers=workers, kernels=cases.kernels
        )
        for row, name in enumerate(names):
            if name != "truncation":  # known of cells struck alone only
                numbers[row, cells] = getattr(found, name) * r ** POWERS.get(name, 0.0)
        quick[cells] = found.done & ~(np.isnan(found.centroid) & (cases.band is not None))
    texts: Texts = {}
    alone = np.flatnonzero(~quick)
    for i, (layers, text) in zip(alone, try_each(start + alone, lambda cell: cases.row(cases.blow(cell)), workers)):
        numbers[:, i] = math.nan if layers is None else layers
        if text:
            texts[start + int(i)] = text
    return numbers, texts


def try_each(
    cells: Iterable[int], act: Callable[[int], Result], workers: int | None
) -> list[tuple[Result | None, str]]:
    """What a function finds of some cases, in threads; None and the error text where it fails."""

    def tried(cell: int) -> tuple[Result | None, str]:
        try:
            return act(cell), ""
        except SimulationError as error:
            return None, str(error)

    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        found = [pool.submit(tried, int(cell)) for cell in cells]
        try:
            return [one.result() for one in found]
        finally:
            pool.shutdown(cancel_futures=True)
