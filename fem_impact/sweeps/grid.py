"""Maps: one blow for every combination of parameters, returned as an xarray Dataset."""

import json
import math
import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from .._base import check
from .._base.check import SimulationError
from .._base.files import PARTIAL
from .._base.rounding import ROUNDING
from ..fe import plausible
from ..fe.assembly import System
from ..impact import accuracy
from ..impact.collision import strike
from ..impact.contact import Contact, wall_time
from ..impact.distance import distance
from ..impact.response import Response
from ..impact.striker import Striker
from ..impact.what_if import RESOLVABLE
from ..model.asked import COSTLY
from ..model.target import Target
from ..modes.modal import Damping, Modes
from . import batches, bodies, cloud, refined
from .borders import add_borders, find_borders, why_none
from .cells import AXES, FAMILY_AXES, REACH, Case, checked_axes, laid_out
from .solving import LAYERS, alone, plain, solve_all, struck_alone, together
from .store import Texts, Watch, not_free

TOLERANCE = 1e-3  # [-] default error limit of a map
# [-] cells struck again for the error of vectors, in a batch or alone: some 0.1 and 0.2 s
DOUBTED = {True: 10_000, False: 100}
MOST_CELLS = 10**8  # [-] default limit of a map: half an hour to two hours of work, 8 GB
# [s] per blow, in a batch or alone, that foretell the time; the slower plates of studies/map_speed.py. Does not change
# the result
SECONDS = {True: 1e-5, False: 2e-3}
# [s] a map with default axes that takes less is computed in all its cells: refining it would gain nothing to notice
DENSE = 1.0
MOST_MIDDLES = 4  # [-] axes whose middle is examined, too: 3**4 = 81 blows, where five would take 243
Tell = Callable[[str], Any]


@dataclass(frozen=True, eq=False)
class Grid:
    """The blow all cells share, the axes that vary it, and what to compute in each cell."""

    base: Case
    axes: Mapping[str, np.ndarray]  # name: (n,) values, for `at` (n, dimension)
    tolerance: float  # [-]
    residual: bool
    band: float | None  # [Hz] upper end of the centroid's band
    extra: Mapping[str, Callable[[Response], float]]  # additional layers
    audit: bool = False  # whether the model's own error is wanted
    max_impacts: int | None = None  # what follows does not matter where cells are computed alone
    kernels: batches.Kernels = field(default_factory=dict)  # computed so far
    chosen: np.ndarray | None = None  # (n_cases,) cells to compute, numbered with the last axis fastest; all by default

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(values) for values in self.axes.values())

    @property
    def n_cases(self) -> int:
        return math.prod(self.shape) if self.chosen is None else len(self.chosen)

    def cells(self, start: int, stop: int) -> np.ndarray:
        """Numbers of some of the cells to compute, (n_cells,)."""
        return np.arange(start, stop) if self.chosen is None else self.chosen[start:stop]

    @property
    def lossy(self) -> bool:
        """Whether any contact loses energy."""
        return bool(self.base.contact.lossy or {"loss", "yield_approach", "hysteresis"} & set(self.axes))

    @property
    def quick(self) -> bool:
        """Whether all cells are computed together."""
        exponents = self.axes.get("exponent", [self.base.contact.exponent])
        layered = self.base.contact.hard_stiffness or "hard_stiffness" in self.axes
        alone = self.lossy or layered or self.extra or self.base.modes.stretches
        return not alone and min(exponents) >= 1.0

    @property
    def layers(self) -> list[str]:
        """Names of the numbers computed in each cell."""
        return [name for name in LAYERS if name != "centroid" or self.band is not None] + list(self.extra)

    def case(self, index: int) -> Case:
        """The blow of one cell."""
        case, cell = self.base, self.cells(index, index + 1)[0]
        for (name, values), i in zip(self.axes.items(), np.unravel_index(cell, self.shape)):
            case = case.changed(name, values[i])
        return case

    def blow(self, index: int) -> Response:
        """The blow of one cell by the modal engine."""
        return struck_alone(self, self.case(index))

    def doubt(self, index: int) -> float:
        """Error [-] of the body's vectors and mesh in one cell struck alone; 0 if that fails."""
        case = self.case(index)
        try:
            error = strike(
                case.modes, case.striker, case.contact, at=case.at, speed=case.speed, tolerance=self.tolerance
            ).error
        except SimulationError:
            return 0.0
        return error.truncation + error.mesh

    def left_out(self) -> np.ndarray:
        """Expected error [-] of leaving out modes, in the shape of the grid; infinite where they govern the contact."""
        if not self.residual:
            return np.zeros(self.shape)
        base, places = self.base, self.axes.get("at", self.base.at[None])
        seen = [base.changed("at", place).modes for place in places] if base.views else [base.modes] * len(places)

        def along(name: str, values: Any) -> np.ndarray:
            """Values of an axis, or one that all cells share, shaped to broadcast over the grid."""
            shape = [-1 if axis == name else 1 for axis in self.axes] if name in self.axes else [1]
            return np.reshape(np.asarray(values, float), shape)

        def value(name: str, shared: float) -> np.ndarray:
            return along(name, self.axes.get(name, [shared]))

        stiffness, exponent, loss, share = (
            value(name, getattr(base.contact, name)) for name in ("stiffness", "exponent", "loss", "hysteresis")
        )
        speed = value("speed", base.speed)
        weight = value("mass", base.striker.mass) / base.striker.mass
        felt = base.striker.felt_mass * weight
        omega = np.pi / wall_time(stiffness, exponent, 1.0 / felt, speed)
        yielding = base.modes.dimension > 0
        left = [modes.residual_compliance(place)[0, 0] if yielding else 0.0 for modes, place in zip(seen, places)]
        last = along("at", [modes.omega[-1] for modes in seen])
        striker = base.striker
        sides = [
            (base.modes, along("at", left), last, base.first, "target_mass", "target_frequency"),
            (striker.modes, striker.left_out[0][0, 0], striker.modes.omega[-1], None, "mass", "striker_frequency"),
        ]  # fmt: skip
        total, softness = np.zeros(self.shape), np.zeros(self.shape)
        for modes, rest, edge, first, mass, frequency in sides:
            if not modes.dimension or not modes.omega.any():
                continue
            first = first or float(modes.frequencies[modes.omega > 0.0][0])
            ratio = value(frequency, first) / first
            soft = felt * omega**2 * np.maximum(rest, 0.0) * modes.mass / value(mass, modes.mass) / ratio**2
            above = np.minimum(1.0, omega / (edge * ratio))
            total = total + accuracy.left_out_error(soft, above, exponent, modes.dimension)
            softness = softness + soft
        return np.where(
            softness <= RESOLVABLE, total * np.where((loss > 0.0) | (share > 0.0), accuracy.LOSSY, 1.0), np.inf
        )

    def model_error(self) -> tuple[np.ndarray, str]:
        """The model's own error [-] in the shape of the grid, and what of it is not known.

        Examined at the ends and the middle of every axis, at the ends of more than MOST_MIDDLES, and interpolated in
        its logarithm; NaN where these fail.
        """
        middle = [] if len(self.shape) > MOST_MIDDLES else [0.5]
        some = [np.unique([0, *(int(share * (n - 1)) for share in middle), n - 1]) for n in self.shape]
        found = np.empty([len(places) for places in some])
        unknown: dict[str, None] = {}
        for at in np.ndindex(*found.shape):
            index = np.ravel_multi_index([places[i] for places, i in zip(some, at)], self.shape)
            try:
                hit = self.blow(int(index))
            except SimulationError:
                found[at] = np.nan
                continue
            found[at] = max(hit.model_error, ROUNDING)
            unknown |= {each.name: None for each in hit.assumptions if not each.known}
        logs = np.log(found)
        for axis, (places, n) in enumerate(zip(some, self.shape)):
            logs = np.apply_along_axis(lambda column: np.interp(np.arange(n), places, column), axis, logs)  # noqa: B023
        return np.exp(logs), ", ".join(unknown)

    def scene(self) -> dict[str, Any]:
        """The blow that all cells share, as plain numbers, and which cells these are if not all."""
        return plain(self.base) | ({} if self.chosen is None else {"cells": self.chosen.tolist()})

    def sampled(self) -> "Grid":
        """The same grid with each body reduced to its contact points: small enough to send to a cluster."""
        if self.base.modes.stretches:
            return replace(self, kernels={})  # slopes are not known from points
        return replace(self, base=self.base.sampled(self.axes.get("at", self.base.at[None])), kernels={})

    def without_speed(self) -> "Grid | None":
        """The grid at one speed if every contact is linear, so that speed only scales the forces; otherwise None."""
        exponents = self.axes.get("exponent", np.array([self.base.contact.exponent]))
        law = self.base.contact
        if "speed" not in self.axes or (exponents != 1.0).any() or self.lossy or law.gap or self.extra:
            return None
        if law.hard_stiffness or "hard_stiffness" in self.axes or self.base.modes.stretches:
            return None
        return replace(self, axes={**self.axes, "speed": self.axes["speed"][:1]})


@check.typed
def sweep(
    modes: Modes | System,
    striker: Striker,
    contact: Contact,
    *,
    at: Any,
    speed: float,
    over: Mapping[str, Any],
    tolerance: float = TOLERANCE,
    max_frequency: float | None = None,
    damping_ratio: Damping | None = None,
    layers: Mapping[str, Callable[[Response], float]] | None = None,
    residual: bool = True,
    workers: int | None = None,
    client: Any = None,
    store: str | Path | None = None,
    watch: Watch | None = None,
    max_cells: float = MOST_CELLS,
    tell: Tell | None = None,
    audit: bool = False,
    borders: bool | None = None,
    cells: int | None = None,
    refine: bool | None = None,
) -> xarray.Dataset:
    """Strike once for every combination of parameters.

    Parameters
    ----------
    modes, striker, contact, at, speed
        The blow that all cells share, as in `strike`; the axes replace some of it. Of a `System`, a map computes what
        its cells need: Ritz vectors started from each strike point if it is a plate, otherwise modes.
    over : mapping of axis name to values
        Names are those of `AXES` (``mass`` is the striker's) or those of a scene file (``striker.mass``). Values of
        ``at`` are points, shape (n_points, dimension) [m]; all others are one-dimensional, in SI units, or ranges as in
        a scene file: ``{"from": 0.01, "to": 0.2, "scale": "log", "count": 20}``. A range without a count gets as many
        values as a picture shows, see ``cells``.
    tolerance : float [-]
        Error limit of every cell, as in `strike`.
    max_frequency : float [Hz], optional
        Adds the layer ``centroid``, the spectral centroid of the band from zero to this frequency. It has no default:
        the mean frequency of a pulse grows without limit as the band widens.
    damping_ratio : float or function of frequency [Hz], optional
        Damping of a system, which has none of its own.
    layers : mapping of name to function of a Response, optional
        Additional scalars to compute; the functions run in threads. Every cell is then computed alone, which is about
        a hundred times slower (``studies/map_speed.py``); so are cells with an exponent below 1, and contacts of two
        layers, that yield or are felt.
    residual : bool
        As in `strike`.
    workers : int, optional
        Number of threads; one per core by default.
    client : dask.distributed.Client or address of a scheduler, optional
        Cluster that computes the map instead of this process.
    store : path, optional
        Zarr folder for finished cells; a run that was killed resumes from it, with the bits of an undisturbed run. It
        serves this map only: the same blow, the same functions in ``layers`` and the same version of the program. What
        it lost or what was damaged is computed again. The workers of a cluster write to it themselves, so it must have
        the same path on every machine.
    watch : callable, optional
        Called from time to time with the number of cells done and the total.
    max_cells : float
        A map with more cells is refused before it starts.
    tell : callable, optional
        Called before the start, with a sentence on the cost, if the map will take more than 10 s or 2 GB; and with what
        was predicted if that decides how many cells are computed.
    audit : bool
        Whether to add ``model_error``, as in `Response`: examined at the ends and the middle of every axis, and
        interpolated. What is not known there is named in its attributes.
    borders : bool, optional
        Whether to locate where the number of impacts changes, in a map with two axes: see `read_borders`. By default
        only if the map has a range without a count.
    cells : int, optional
        Number of values along an axis that is a range without a count: 400 by default, or 100 if each cell must be
        struck alone; fewer if further axes would make more cells than two such axes have.
    refine : bool, optional
        Whether to compute only cells where the answer changes and to interpolate the others to within the tolerance,
        in a map with two axes. By default only if a range has no count and all cells would take more than about a
        second, predicted from the first few.

    Returns
    -------
    xarray.Dataset
        One dimension per axis, in the order given; variables as in `LAYERS` with their units; ``truncation``, the
        expected error of modes left out, or of having no more vectors and no finer mesh; ``tolerance_met``; and
        ``failure``, the error text of a cell that failed (its numbers are then NaN and its n_impacts is -1).
        With borders, also ``doubtful``, cells whose number of impacts depends on the tolerance, on the body's
        description, or was refused; and along the dimension ``border`` the curves themselves, which `read_borders`
        returns: points in the units of the axes, ``border_impacts``, ``border_curve`` and ``border_error``.
        ``attrs["borders"]`` sums them up. With cells left to this function, ``attrs["cells"]`` says how many were
        computed, and ``interpolated`` which were not; ``error`` counts the error of interpolation, but for that of the
        centroid, which its attribute ``interpolation_error`` bounds.
        ``attrs["scene"]`` holds the blow all cells share, as JSON; ``attrs["notes"]`` what was assumed, one note per
        line.

    Raises
    ------
    ValueError
        If an axis is unknown, a value is not allowed, or the map is too large.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300)
    >>> over = {"mass": [0.01, 0.1], "stiffness": [1e4, 1e5, 1e6]}
    >>> table = fi.sweep(plate, fi.Striker.rigid(0.1), fi.Contact.linear(1e5), at=(0.45, 0.3), speed=1.0, over=over)
    >>> table.n_impacts.values.tolist()
    [[1, 1, 4], [1, 2, 4]]
    """
    tolerance = check.tolerance(tolerance)
    layers = _checked_layers(layers)
    striker.let_go("a map")
    ours = False
    if isinstance(over, Mapping):
        alone_ = bool(layers) or (isinstance(modes, Modes) and modes.stretches)
        over, ours = laid_out(over, contact, alone=alone_, cells=cells)
    if isinstance(modes, Modes):
        modes = modes if damping_ratio is None else modes.damped(damping_ratio)
        speed = check.positive("speed", speed, "m/s", reach=REACH)
        base = Case(modes, striker, contact, modes.point("at", at)[0], speed)
        axes = checked_axes(base, over)
    else:
        base, axes = bodies.body_of(
            Target.of(modes, damping_ratio), striker, contact, at=at, speed=speed, over=over, tolerance=tolerance,
            alone=residual and not layers, keep=kept_beside(store),
        )  # fmt: skip
    max_cells = check.number("max_cells", max_cells)
    n_cells = math.prod(map(len, axes.values()))
    admit(n_cells, len(LAYERS) + len(layers), max_cells, quick=not layers, tell=tell)
    return run(
        base, axes, tolerance=tolerance, max_frequency=max_frequency, layers=layers, residual=residual, workers=workers,
        client=client, store=store, watch=watch, tell=tell, audit=audit, borders=borders, refine=refine, ours=ours,
    )  # fmt: skip


def _checked_layers(layers: Any) -> dict[str, Callable[[Response], float]]:
    """Additional layers of a map, which may be None."""
    found = {} if layers is None else layers
    if not isinstance(found, Mapping) or not all(isinstance(name, str) and callable(found[name]) for name in found):
        raise ValueError(f"layers must map names to functions of a Response, got {check.shown(layers)}")
    return dict(found)


def kept_beside(store: str | Path | None) -> Path | None:
    """File beside a store that keeps what was found of the struck body."""
    return None if store is None else Path(store).with_name(f"{Path(store).name}.modes.npz")


def run(
    base: Case,
    axes: Mapping[str, np.ndarray],
    *,
    tolerance: float,
    max_frequency: float | None = None,
    layers: Mapping[str, Callable[[Response], float]] | None = None,
    residual: bool = True,
    workers: int | None = None,
    client: Any = None,
    store: str | Path | None = None,
    watch: Watch | None = None,
    tell: Tell | None = None,
    audit: bool = False,
    borders: bool | None = None,
    refine: bool | None = None,
    ours: bool = False,
) -> xarray.Dataset:
    """The map of a blow over axes that are checked; as `sweep`; ``ours`` if the cells of an axis were chosen here."""
    band = None if max_frequency is None else check.positive("max_frequency", max_frequency, "Hz")
    workers = None if workers is None else check.count("workers", workers)
    layers = _checked_layers(layers)
    grid = Grid(base, axes, tolerance, residual, band, layers, bool(audit))
    fewer = grid.without_speed()
    for name, asked, of in (("borders", borders, grid), ("refine", refine, fewer or grid)):
        if asked and why_none(of):
            raise ValueError(f"{name}: {why_none(of)}")
    if refine and layers:
        raise ValueError("layers of one's own are not interpolated: refine is not for them")
    way = Way(workers, client, None if store is None else Path(store), watch)
    drawn = ours and not layers and not why_none(fewer or grid)
    computed = way.refined(fewer or grid, refine, tell) if refine or (drawn and refine is None) else None
    numbers, texts = way.solved(fewer or grid) if computed is None else (computed.numbers, computed.texts)
    failures = np.full((fewer or grid).n_cases, "", dtype=f"<U{max(map(len, texts.values()), default=1)}")
    failures[list(texts)] = list(texts.values())
    doubt = described(fewer or grid, numbers, workers)
    if fewer is not None:
        numbers, failures = _with_speed(grid, fewer, numbers, failures)
    doubt = np.broadcast_to(doubt, grid.shape)
    table = _dataset(grid, numbers, failures, doubt)
    gap = 1.0 / max(1, min(grid.shape) - 1)
    if ours:
        table.attrs["cells"] = f"all {grid.n_cases} cells computed"
    if computed is not None:
        _tell_interpolated(table, computed.computed)
        gap = refined.widest_gap(grid.shape)
    if borders or (borders is None and ours and not why_none(grid)):
        found = find_borders(grid, np.asarray(table.n_impacts), way.solved)
        found.doubtful[doubt >= 1.0] = True
        add_borders(table, found, gap)
    return table


def _tell_interpolated(table: xarray.Dataset, computed: np.ndarray) -> None:
    """Say in a map which cells (n, n) were computed."""
    n, share = int(computed.sum()), computed.mean()
    table.attrs["cells"] = f"{n} of {computed.size} cells computed ({share:.0%}), the others interpolated between them"
    meaning = "whether the cell was interpolated between others, to within the tolerance"
    left = table.attrs["tolerance"] - batches.allowed(table.attrs["tolerance"])
    for name, weight in refined.ROUGH.items():
        if name in table:
            table[name].attrs["interpolation_error"] = left / weight
    table["interpolated"] = (table.n_impacts.dims, ~computed, {"units": "1", "long_name": meaning})


@dataclass(frozen=True)
class Way:
    """Where blows are computed, where they are kept, and who is told."""

    workers: int | None
    client: Any
    store: Path | None
    watch: Watch | None

    def solved(self, blows: Grid | cloud.Cloud, turn: str = "") -> tuple[np.ndarray, Texts]:
        """Compute all cells of a grid or a cloud; those of a round with a name are kept in a folder of the store."""
        work = solve if isinstance(blows, Grid) else cloud.solve
        place = self.store / turn if self.store is not None and turn else self.store
        return solve_all(blows, work, self.workers, self.client, place, None if turn else self.watch)

    def _held(self) -> set[str]:
        """Names in the folder of the store, but for what is not finished."""
        if self.store is None or not self.store.exists():
            return set()
        return {name for name in os.listdir(self.store) if not name.startswith(PARTIAL)}

    def refined(self, grid: Grid, refine: bool | None, tell: Tell | None) -> refined.Refined | None:
        """Compute a map where its answer changes; None if all cells are predicted to be quick, unless ``refine``."""
        held = self._held()
        if "zarr.json" in held and not refine:
            return None
        if self.store is not None and held and "round-1" not in held:
            raise not_free(self.store)
        first = replace(grid, chosen=np.unique(refined.first_blocks(grid.shape).cells(grid.shape[1])))
        here = replace(self, store=None, watch=None)
        here.solved(replace(grid, chosen=first.cells(0, 1)))  # compiles
        began = time.process_time()
        start = here.solved(first)
        seconds = (time.process_time() - began) / first.n_cases * grid.n_cases / (self.workers or os.cpu_count() or 1)
        if not refine and "round-1" not in self._held() and self.client is None:
            some = seconds > DENSE
            if tell is not None:
                cost = f"all {grid.n_cases} cells are expected to take {seconds:.2g} s"
                tell(
                    f"{cost}: only those where the answer changes are computed" if some else f"{cost}: all are computed"
                )
            if not some:
                return None

        def compute(cells: np.ndarray, turn: str) -> tuple[np.ndarray, Texts]:
            """Cells of one round; those of the first are known."""
            return start if turn == "round-0" else self.solved(replace(grid, chosen=cells), turn)

        def settled(done: int) -> None:
            if self.watch is not None:
                self.watch(done, grid.n_cases)

        return refined.refine((grid.shape[0], grid.shape[1]), grid.layers, grid.tolerance, compute, settled)


def described(grid: Grid, numbers: np.ndarray, workers: int | None = None) -> np.ndarray:
    """Error [-] of too few Ritz vectors and of their mesh in each cell, in the shape of the grid; zero for most modes.

    Evenly spaced cells, at most DOUBTED, are struck again on the body described less well (`Modes.poorer`); any other
    cell has the error of the nearest of them. Too few vectors may agree on a final separation that is none; therefore
    cells with several impacts are also struck alone, because `strike` looks for that; so are the cells of a body of
    which something is not stated (`Modes.unstated`).
    """
    causes = list(dict.fromkeys(cause for modes in grid.base.views.values() for cause in modes.poorer))
    unstated = grid.residual and bool(grid.base.modes.unstated or grid.base.striker.modes.unstated)
    if not causes and not unstated:
        return np.zeros(grid.shape)
    most = DOUBTED[grid.quick and not unstated]
    thinner = max(1.0, (grid.n_cases / most) ** (1.0 / len(grid.shape)))
    chosen = [np.unique(np.round(np.linspace(0, n - 1, max(1, int(n / thinner)))).astype(int)) for n in grid.shape]
    axes = {name: values[some] for (name, values), some in zip(grid.axes.items(), chosen)}
    few = replace(grid, axes=axes, band=None, kernels={})
    names = [grid.layers.index(name) for name in few.layers]
    mine = numbers.reshape(-1, *grid.shape)[np.ix_(np.array(names), *chosen)]
    total = np.zeros(few.shape)
    before = mine
    for cause in causes:
        other, _ = solve(replace(few, base=grid.base.poorer(cause), kernels={}), 0, few.n_cases, workers=workers)
        before, better = other.reshape(mine.shape), before
        total += _largest_difference(few.layers, better, before)
    several = np.flatnonzero((mine[few.layers.index("n_impacts")] > 1) | unstated)
    several = several[:: max(1, -(-len(several) // DOUBTED[False]))]
    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        total.flat[several] = np.maximum(total.flat[several], list(pool.map(few.doubt, several)))
    nearest = [np.abs(np.arange(n)[:, None] - some).argmin(axis=1) for n, some in zip(grid.shape, chosen)]
    return total[np.ix_(*nearest)]


def _largest_difference(names: list[str], one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Largest difference of two maps in the quantities under tolerance; 1 if their impacts differ in number."""
    mine, its = dict(zip(names, one)), dict(zip(names, other))
    judged = ("restitution", "impulse", "contact_time", "peak_force")
    apart = distance({name: its[name] for name in judged}, {name: mine[name] for name in judged})
    return np.where(mine["n_impacts"] == its["n_impacts"], np.fmax.reduce(list(apart.values())), 1.0)


def admit(n_cells: int, n_layers: int, max_cells: float, *, quick: bool = True, tell: Tell | None = None) -> None:
    """Refuse a map with too many cells; announce the cost of a large one."""
    seconds = n_cells * SECONDS[quick] / (os.cpu_count() or 1)
    memory = 8.0 * n_cells * (n_layers + 2.0)  # [byte]
    cost = f"{n_cells:.3g} cells: about {seconds:.2g} s on this machine and {memory / 1e9:.2g} GB of memory"
    if n_cells > max_cells:
        raise ValueError(f"over asks for {cost}; give fewer values, or raise max_cells, now {max_cells:.3g}")
    if tell is not None and (seconds > COSTLY[0] or memory > COSTLY[1]):
        tell(cost)


def _with_speed(grid: Grid, fewer: Grid, numbers: np.ndarray, failures: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Blows at all speeds from those at one speed: impulse and peak force scale with it, all else is unchanged."""
    along = list(grid.axes).index("speed")
    shape = [1] * len(grid.shape)
    shape[along] = -1
    ratio = (grid.axes["speed"] / grid.axes["speed"][0]).reshape(shape)
    whole = np.broadcast_to(numbers.reshape(-1, *fewer.shape), (len(numbers), *grid.shape)).copy()
    for row, name in enumerate(grid.layers):
        if name in ("impulse", "peak_force"):
            whole[row] *= ratio
    failures = np.broadcast_to(failures.reshape(fewer.shape), grid.shape)
    return whole.reshape(len(numbers), -1), failures.reshape(-1)


def solve(grid: Grid, start: int, stop: int, *, workers: int | None = None) -> tuple[np.ndarray, Texts]:
    """Compute the cells from ``start`` up to ``stop``.

    Returns
    -------
    numbers : ndarray, shape (n_layers, n_cells)
    texts : dict of failed cell to its error text
    """
    names = grid.layers
    numbers = np.full((len(names), stop - start), np.nan)
    place = dict(zip(grid.axes, np.unravel_index(grid.cells(start, stop), grid.shape)))
    law = grid.base.contact
    base = {"target_mass": grid.base.modes.mass, "mass": grid.base.striker.mass, "speed": grid.base.speed, **vars(law)}
    column = {
        name: grid.axes[name][place[name]] if name in place else np.full(stop - start, value)
        for name, value in base.items()
    }
    quick = together(column) & (not grid.extra) & (not grid.base.modes.stretches)
    cells = np.flatnonzero(quick)
    if cells.size:
        kind = np.zeros(stop - start, int)
        for name in FAMILY_AXES:
            if name in place:
                kind = kind * len(grid.axes[name]) + place[name]
        kind = 2 * kind + (column["loss"] > 0.0)
        kinds, first, family = np.unique(kind[cells], return_index=True, return_inverse=True)
        families = {}
        for which, i in zip(kinds, cells[first]):
            chosen = {name: grid.axes[name][place[name][i]] for name in FAMILY_AXES if name in place}
            case = grid.base.with_values(chosen)  # nothing else of the cell, so that no block is rounded differently
            families[int(which)] = batches.Family.of(case.modes, case.at, case.striker, grid.residual, bool(which % 2))
        blows = batches.Blows(
            families,
            kinds[family],
            *(column[name][cells] for name in ("target_mass", "mass", "stiffness", "exponent", "speed", "loss")),
        )
        found = batches.bounce(
            blows, tolerance=grid.tolerance, band=grid.band or 0.0, workers=workers, kernels=grid.kernels
        )
        for row, name in enumerate(names):
            numbers[row, cells] = getattr(found, name)
        quick[cells] = found.done & ~(np.isnan(found.centroid) & (grid.band is not None))
    return numbers, alone(grid, start, np.flatnonzero(~quick), numbers, workers)


def _dataset(grid: Grid, numbers: np.ndarray, failures: np.ndarray, doubt: np.ndarray) -> xarray.Dataset:
    """The map as a Dataset, with units on layers and axes."""
    dims = tuple(grid.axes)
    data: dict[str, Any] = {}
    for name, values in zip(grid.layers, numbers):
        unit, meaning = LAYERS.get(name, ("", name))
        attributes: dict[str, Any] = {"units": unit or "1", "long_name": meaning}
        if name == "n_impacts":
            values = np.where(np.isnan(values), -1, values).astype(np.int32)
        if name == "centroid":
            attributes["max_frequency"] = grid.band
        data[name] = (dims, values.reshape(grid.shape), attributes)
    left_out = grid.left_out() + doubt
    meaning = "expected error of the body's description; infinite where modes left out govern the contact"
    data["truncation"] = (dims, left_out, {"units": "1", "long_name": meaning})
    met = data["error"][1] + left_out <= grid.tolerance
    data["tolerance_met"] = (dims, met, {"units": "1", "long_name": "whether both errors together meet the tolerance"})
    if grid.audit:
        own, unknown = grid.model_error()
        meaning = "error of the model itself, interpolated between a few blows"
        data["model_error"] = (dims, own, {"units": "1", "long_name": meaning, "not_known": unknown})
    data["failure"] = (dims, failures.reshape(grid.shape), {"long_name": "error text of a failed cell"})
    places: dict[str, Any] = {}
    for name, values in grid.axes.items():
        attributes = {"units": AXES[name][0] or "1", "long_name": AXES[name][1]}
        if name == "stiffness" and "exponent" not in grid.axes:
            power = grid.base.contact.exponent
            attributes["units"] = "N/m" if power == 1.0 else f"N/m**{power:g}"
        if name != "at":
            places[name] = (name, values, attributes)
        elif values.shape[1] == 1:
            places["at"] = ("at", values[:, 0], attributes)
        else:
            places |= {f"at_{letter}": ("at", column, attributes) for letter, column in zip("xyz", values.T)}
    notes = plausible.together(grid.base.modes.notes, grid.base.striker.notes)
    about = {"title": "Map of blows", "scene": json.dumps(grid.scene()), "notes": "\n".join(notes)}
    return xarray.Dataset(data, places, about | {"tolerance": grid.tolerance, "residual": int(grid.residual)})
