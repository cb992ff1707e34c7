"""Maps: one blow for every combination of parameters, returned as an xarray Dataset."""

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from .._base import check, progress
from .._base.files import PARTIAL
from .._base.threads import one_thread
from ..fe import plausible
from ..fe.assembly import System
from ..impact.contact import Contact
from ..impact.response import Response
from ..impact.striker import Striker
from ..model.asked import COSTLY
from ..model.planner import Blow
from ..model.target import Stages, Target
from ..modes.modal import Damping, Modes
from . import batches, bodies, cell_errors, refined
from .borders import add_borders, find_borders, why_none
from .cases import LAYERS, Cases, solve_all
from .cells import ALIASES, AXES, Case, laid_out
from .store import Texts, Watch, not_free

TOLERANCE = 1e-3  # [-] default error limit of a map
MOST_CELLS = 10**8  # [-] default limit of a map: half an hour to two hours of work, 8 GB
# [s] per blow, in a batch or alone, that predict the time: the plates of studies/benchmarks/map_speed.py on one core
SECONDS = {True: 1e-5, False: 2e-3}
# [s] a map with default axes that takes less is computed in all its cells: refining it would gain nothing to notice
DENSE = 1.0
Announce = Callable[[str], Any]


@dataclass(frozen=True)
class Job:
    """What to compute of a map, where, where it is kept and who is informed: arguments of `sweep`, checked."""

    tolerance: float  # [-]
    max_frequency: float | None = None  # [Hz]
    layers: Any = None  # mapping of name to function of a Response
    residual: bool = True
    workers: int | None = None
    client: Any = None
    store: Any = None  # path
    watch: Watch | None = None
    tell: Announce | None = None
    audit: bool = False
    borders: bool | None = None
    refine: bool | None = None
    ours: bool = False  # whether the cells of an axis were chosen by this program

    def __post_init__(self) -> None:
        layers = {} if self.layers is None else self.layers
        if not isinstance(layers, Mapping) or not all(isinstance(n, str) and callable(f) for n, f in layers.items()):
            raise ValueError(f"layers must map names to functions of a Response, got {check.shown(layers)}")
        if self.refine and layers:
            raise ValueError("refine must be left out with layers of one's own, which are not interpolated")
        band = self.max_frequency
        check.settle(
            self,
            tolerance=check.tolerance(self.tolerance),
            max_frequency=None if band is None else check.positive("max_frequency", band, "Hz"),
            layers=dict(layers),
            workers=None if self.workers is None else check.count("workers", self.workers),
            store=None if self.store is None else Path(self.store),
        )

    def described(
        self, blow: Blow, over: Mapping[str, Any], stages: Stages | None = None
    ) -> tuple[Case, dict[str, Any]]:
        """The blow on a body described as the map needs it, and the map's axes; as `bodies.body_of`."""
        alone = self.residual and not self.layers
        return bodies.body_of(blow, over, tolerance=self.tolerance, alone=alone, store=self.store, stages=stages)

    def cases(self, base: Case, axes: Mapping[str, np.ndarray]) -> Cases:
        """All cells of a map."""
        return Cases(base, axes, self.tolerance, self.residual, self.max_frequency, self.layers)

    @property
    def watched(self) -> Watch:
        """What is called with the number of cells done and of all."""
        return self.watch or partial(progress.report, "cells")

    def solved(self, cases: Cases, turn: str = "") -> tuple[np.ndarray, Texts]:
        """Compute all cases; those of a round with a name are kept in a folder of the store."""
        place = self.store / turn if self.store is not None and turn else self.store
        return solve_all(cases, self.workers, self.client, place, None if turn else self.watched)

    def compute_refined(self, cases: Cases) -> refined.MapSheet | None:
        """Compute a map where its answer changes; None if it has few cells, unless asked for."""
        there = os.listdir(self.store) if self.store is not None and self.store.exists() else ()
        held = {name for name in there if not name.startswith(PARTIAL)}  # but for what is not finished
        if "zarr.json" in held and not self.refine:
            return None
        if self.store is not None and held and "round-0" not in held:
            raise not_free(self.store)
        if not self.refine and not held and self.client is None:
            seconds = cases.n_cases * SECONDS[cases.quick]  # on any machine, however busy: the answer must be the same
            if self.tell is not None:
                done = "only those where the answer changes are computed" if seconds > DENSE else "all are computed"
                self.tell(f"all {cases.n_cases} cells are expected to take {seconds:.2g} s: {done}")
            if seconds <= DENSE:
                return None
        return refined.refine(
            (cases.shape[0], cases.shape[1]), cases.layers, cases.tolerance,
            lambda cells, turn: self.solved(replace(cases, chosen=cells), turn),
            lambda done: self.watched(done, cases.n_cases),
        )  # fmt: skip


def axis_attributes(name: str) -> dict[str, str]:
    """Unit and meaning of an axis of `AXES`, as attributes."""
    return {"units": AXES[name][0] or "1", "long_name": AXES[name][1]}


@check.typed
@one_thread
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
    tell: Announce | None = None,
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
        a hundred times slower (``studies/benchmarks/map_speed.py``); so are cells with an exponent below 1, and
        contacts of two layers, that yield or are felt.
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
        in a map with two axes. By default only if a range has no count and there are more than 100 000 cells, or more
        than 500 of which each must be struck alone or loses energy: all of these would take about a second.

    Returns
    -------
    xarray.Dataset
        One dimension per axis, in the order given; variables as in `LAYERS` with their units; ``tolerance_met``; and
        ``failure``, the error text of a cell that failed (its numbers are then NaN and its n_impacts is -1).
        With borders, also ``doubtful``, cells whose number of impacts depends on the tolerance, on the body's
        description, or was refused; and along the dimension ``border`` the curves themselves, which `read_borders`
        returns: points in the units of the axes, ``border_impacts``, ``border_curve`` and ``border_error``.
        ``attrs["borders"]`` sums them up. With cells left to this function, ``attrs["cells"]`` says how many were
        computed, and ``interpolated`` which were not; ``error`` counts the error of interpolation, but for that of the
        centroid, which its attribute ``interpolation_error`` bounds. What sums for the centroid err by, whatever the
        steps, is in its attribute ``sum_error``.
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
    striker.let_go("a map")
    job = Job(
        tolerance, max_frequency, layers, residual, workers, client, store, watch, tell, bool(audit), borders, refine
    )
    if isinstance(over, Mapping):
        alone = bool(job.layers) or (isinstance(modes, Modes) and modes.stretches)
        scaled = [name for name in over if ALIASES.get(name, name) in ("target_mass", "target_frequency")]
        if scaled and isinstance(modes, Modes) and modes.air:
            raise ValueError(
                f"over must not name {scaled[0]} for modes in air, which does not scale with them; rescale them before "
                "`in_air`"
            )
        over, ours = laid_out(over, contact, alone=alone, cells=cells)
        job = replace(job, ours=ours)
    blow = Blow(Target.of(modes, damping_ratio), striker, contact, {"at": at, "speed": speed})
    base, axes = job.described(blow, over)
    cases, max_cells = job.cases(base, axes), check.number("max_cells", max_cells)
    admit_size(cases.n_cases, len(LAYERS) + len(job.layers), max_cells, quick=cases.quick, tell=tell)
    return compute_map(cases, job)


def compute_map(cases: Cases, job: Job) -> xarray.Dataset:
    """The map of a blow over axes that are checked."""
    some = cases.without_speed() or cases  # those to compute
    for name, asked, of in (("borders", job.borders, cases), ("refine", job.refine, some)):
        if asked and why_none(of):
            raise ValueError(f"{name} must be left out: {why_none(of)}")
    drawn = job.ours and not job.layers and not why_none(some)
    computed = job.compute_refined(some) if job.refine or (drawn and job.refine is None) else None
    numbers, texts = job.solved(some) if computed is None else (computed.numbers, computed.texts)
    failures = error_texts(texts, some.n_cases)
    doubt, described = cell_errors.errors_of_description(some, numbers, job.workers), some.layers.index("truncation")
    expected = np.maximum(cell_errors.estimate_left_out(some), doubt).reshape(-1)
    numbers[described] = np.where(np.isnan(numbers[described]), expected, numbers[described])
    if some is not cases:  # impulse and peak force scale with the speed, all else is unchanged
        ratio = cases.axes["speed"] / cases.axes["speed"][0]
        ratio = np.reshape(ratio, [-1 if name == "speed" else 1 for name in cases.axes])
        scales = [ratio if name in ("impulse", "peak_force") else np.ones_like(ratio) for name in cases.layers]
        numbers = (numbers.reshape(-1, *some.shape) * np.stack(scales)).reshape(len(numbers), -1)
        failures = np.broadcast_to(failures.reshape(some.shape), cases.shape).reshape(-1)
    own = cell_errors.model_error(cases) if job.audit else None
    table = _dataset(cases, numbers, failures, own)
    gap = 1.0 / max(1, min(cases.shape) - 1)
    if job.ours:
        table.attrs["cells"] = f"all {cases.n_cases} cells computed"
    if computed is not None:
        known = computed.computed.reshape(cases.shape)
        share = f"{int(known.sum())} of {known.size} cells computed ({known.mean():.0%})"
        table.attrs["cells"] = f"{share}, the others interpolated between them"
        for name, weight in refined.ROUGH.items():
            if name in table:
                left = job.tolerance - batches.allowed_error(job.tolerance)
                table[name].attrs["interpolation_error"] = left / weight
        meaning = "whether the cell was interpolated between others, to within the tolerance"
        table["interpolated"] = (table.n_impacts.dims, ~known, {"units": "1", "long_name": meaning})
        gap = refined.widest_gap(cases.shape)
    if job.borders or (job.borders is None and job.ours and not why_none(cases)):
        borders, doubtful = find_borders(cases, np.asarray(table.n_impacts), job.solved)
        doubtful[np.broadcast_to(doubt >= 1.0, cases.shape)] = True
        add_borders(table, borders, doubtful, gap)
    return table


def error_texts(texts: Texts, n_cases: int) -> np.ndarray:
    """Error texts (n_cases,), '' where there is none."""
    failures = np.full(n_cases, "", dtype=f"<U{max(map(len, texts.values()), default=1)}")
    failures[list(texts)] = list(texts.values())
    return failures


def admit_size(
    n_cells: int, n_layers: int, max_cells: float, *, quick: bool = True, tell: Announce | None = None
) -> None:
    """Refuse a map with too many cells; announce the cost of a large one."""
    seconds = n_cells * SECONDS[quick] / (os.cpu_count() or 1)
    memory = 8.0 * n_cells * (n_layers + 2.0)  # [byte]
    cost = f"{n_cells:.3g} cells: about {seconds:.2g} s on this machine and {memory / 1e9:.2g} GB of memory"
    if n_cells > max_cells:
        raise ValueError(f"over asks for {cost}; give fewer values, or raise max_cells, now {max_cells:.3g}")
    if tell is not None and (seconds > COSTLY[0] or memory > COSTLY[1]):
        tell(cost)


def _dataset(cases: Cases, numbers: np.ndarray, failures: np.ndarray, own: Any) -> xarray.Dataset:
    """The map as a Dataset, with units on layers and axes; ``own`` is the model's error and what is not known of it."""
    dims = tuple(cases.axes)
    data: dict[str, Any] = {
        name: (dims, values.reshape(cases.shape), about) for name, (values, about) in cases.labelled(numbers).items()
    }
    met = data["error"][1] + data["truncation"][1] <= cases.tolerance
    data["tolerance_met"] = (dims, met, {"units": "1", "long_name": "whether both errors together meet the tolerance"})
    if own is not None:
        meaning = "error of the model itself, interpolated between a few blows"
        data["model_error"] = (dims, own[0], {"units": "1", "long_name": meaning, "not_known": own[1]})
    data["failure"] = (dims, failures.reshape(cases.shape), {"long_name": "error text of a failed cell"})
    places: dict[str, Any] = {}
    for name, values in cases.axes.items():
        attributes = axis_attributes(name)
        if name == "stiffness" and "exponent" not in cases.axes:
            power = cases.base.contact.exponent
            attributes["units"] = "N/m" if power == 1.0 else f"N/m**{power:g}"
        if name != "at":
            places[name] = (name, values, attributes)
        elif values.shape[1] == 1:
            places["at"] = ("at", values[:, 0], attributes)
        else:
            places |= {f"at_{letter}": ("at", column, attributes) for letter, column in zip("xyz", values.T)}
    notes = plausible.together(cases.base.modes.notes, cases.base.striker.notes)
    about = {"title": "Map of blows", "scene": json.dumps(cases.scene()), "notes": "\n".join(notes)}
    return xarray.Dataset(data, places, about | {"tolerance": cases.tolerance, "residual": int(cases.residual)})
