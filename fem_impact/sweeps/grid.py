"""Maps: one blow for every combination of parameters, returned as an xarray Dataset."""

import json
import math
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from .._base import check
from .._base.check import SimulationError
from ..fe import plausible
from ..impact import accuracy
from ..impact.collision import RESOLVABLE, strike
from ..impact.contact import Contact, wall_time
from ..impact.response import Response
from ..impact.striker import Striker
from ..model.planner import COSTLY
from ..modes.modal import Modes, SampledShapes
from . import batches
from .store import LARGEST_BLOCK, Texts, block_size, by_cluster, by_store

TOLERANCE = 1e-3  # [-] default error limit of a map
AXES = {  # name: unit, what it is, its name in a scene file
    "mass": ("kg", "mass of the striker", "striker.mass"),
    "striker_frequency": ("Hz", "first flexible frequency of the striker", "striker.first_frequency"),
    "stiffness": ("N/m**exponent", "stiffness of the contact", "contact.stiffness"),
    "exponent": ("", "exponent of the contact", "contact.exponent"),
    "loss": ("s/m", "loss factor of the contact", "contact.loss"),
    "gap": ("m", "distance the striker travels before contact", "contact.gap"),
    "depth": ("m", "approach at which the hard layer is reached", "contact.depth"),
    "hard_stiffness": ("N/m**hard_exponent", "stiffness of the hard layer", "contact.hard_stiffness"),
    "hard_exponent": ("", "exponent of the hard layer", "contact.hard_exponent"),
    "yield_approach": ("m", "approach at first yield", "contact.yield_approach"),
    "hysteresis": ("", "share of the force that felt loses", "contact.hysteresis"),
    "relaxation": ("s", "relaxation time of felt", "contact.relaxation"),
    "speed": ("m/s", "speed of the striker's contact point", "strike.speed"),
    "at": ("m", "strike point", "strike.at"),
    "target_mass": ("kg", "mass of the struck body", "target.mass"),
    "target_frequency": ("Hz", "first flexible frequency of the struck body", "target.first_frequency"),
    "damping_ratio": ("", "damping ratio of the struck body", "target.damping_ratio"),
}
LAW = [field.name for field in fields(Contact)]  # the axes that change the contact
ALIASES = {alias: name for name, (_, _, alias) in AXES.items()}
FAMILY_AXES = ("at", "target_frequency", "striker_frequency", "damping_ratio")  # each value needs new kernels
REACH = 1e30  # [SI] speeds, masses and frequencies lie between 1/REACH and REACH: beyond, the kernels never finish
LAYERS: dict[str, tuple[str, str]] = {  # name: unit, what it is
    "n_impacts": ("", "number of separate contacts"),
    "contact_time": ("s", "total time in contact"),
    "restitution": ("", "minus the speed after the blow over the speed before, at the contact point"),
    "impulse": ("N s", "total impulse of the contact force"),
    "peak_force": ("N", "largest contact force"),
    "error": ("", "estimated time-step error: absolute for restitution, relative for the others"),
    "centroid": ("Hz", "mean frequency, weighted by the magnitude of the force spectrum"),
}


MOST_CELLS = 10**8  # [-] default limit of a map: half an hour to two hours of work, 8 GB
SECONDS = {True: 1e-5, False: 2e-3}  # [s] per blow, in a batch or alone: the slower plates of studies/map_speed.py
Watch = Callable[[int, int], Any]
Tell = Callable[[str], Any]


@dataclass(frozen=True, eq=False)
class Case:
    """One cell of a map: the arguments of `strike`."""

    modes: Modes
    striker: Striker
    contact: Contact
    at: np.ndarray  # (dimension,) [m]
    speed: float  # [m/s]

    @property
    def resonance(self) -> float:
        """Contact resonance [Hz] of the striker on a rigid wall."""
        return accuracy.contact_resonance(self.contact, self.striker.felt_mass, self.speed)

    def changed(self, name: str, value: Any) -> "Case":
        """The same blow with one parameter of `AXES` replaced."""
        if name == "at":
            return replace(self, at=self.modes.point("at", value)[0])
        if name == "speed":
            return replace(self, speed=check.positive("speed", value, "m/s", reach=REACH))
        if name in LAW:
            return replace(self, contact=replace(self.contact, **{name: float(value)}))
        if name in ("mass", "striker_frequency"):
            key = "mass" if name == "mass" else "first_frequency"
            return replace(self, striker=replace(self.striker, modes=self.striker.modes.scaled(**{key: value})))
        if name == "damping_ratio":
            return replace(self, modes=self.modes.damped(value))
        key = "mass" if name == "target_mass" else "first_frequency"
        return replace(self, modes=self.modes.scaled(**{key: value}))


@dataclass(frozen=True, eq=False)
class Grid:
    """The blow all cells share, the axes that vary it, and what to compute in each cell."""

    base: Case
    axes: Mapping[str, np.ndarray]  # name: (n,) values, for `at` (n, dimension)
    tolerance: float  # [-]
    residual: bool
    band: float | None  # [Hz] upper end of the centroid's band
    extra: Mapping[str, Callable[[Response], float]]  # additional layers
    kernels: batches.Kernels = field(default_factory=dict)  # computed so far

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(values) for values in self.axes.values())

    @property
    def n_cases(self) -> int:
        return math.prod(self.shape)

    @property
    def lossy(self) -> bool:
        """Whether any contact loses energy."""
        return bool(self.base.contact.lossy or {"loss", "yield_approach", "hysteresis"} & set(self.axes))

    @property
    def layers(self) -> list[str]:
        """Names of the numbers computed in each cell."""
        return [name for name in LAYERS if name != "centroid" or self.band is not None] + list(self.extra)

    def case(self, index: int) -> Case:
        """The blow of one cell; the last axis varies fastest."""
        case = self.base
        for (name, values), i in zip(self.axes.items(), np.unravel_index(index, self.shape)):
            case = case.changed(name, values[i])
        return case

    def strike(self, index: int) -> tuple[np.ndarray, str]:
        """The layers of one cell from the modal engine, and its error text ('' if it succeeded)."""
        case = self.case(index)
        try:
            hit = strike(
                case.modes, case.striker, case.contact,
                at=case.at, speed=case.speed, tolerance=self.tolerance, residual=self.residual,
            )  # fmt: skip
            row = [hit.n_impacts, hit.contact_time, hit.restitution, hit.impulse, hit.peak_force, hit.error.step]
            row += [hit.spectral_centroid(self.band)] if self.band is not None else []
            row += [function(hit) for function in self.extra.values()]
        except SimulationError as error:
            return np.full(len(self.layers), np.nan), str(error)
        return np.array(row, float), ""

    def left_out(self) -> np.ndarray:
        """Expected error [-] of leaving out modes, in the shape of the grid; infinite where they govern the contact."""
        if not self.residual:
            return np.zeros(self.shape)
        base, places = self.base, self.axes.get("at", self.base.at[None])

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
        left = [base.modes.residual_compliance(place[None])[0, 0] if yielding else 0.0 for place in places]
        sides = [
            (base.modes, along("at", left), "target_mass", "target_frequency"),
            (base.striker.modes, np.array(base.striker.left_out[0][0, 0]), "mass", "striker_frequency"),
        ]
        total, softness = np.zeros(self.shape), np.zeros(self.shape)
        for modes, rest, mass, frequency in sides:
            if not modes.dimension or not modes.omega.any():
                continue
            first = float(modes.frequencies[modes.omega > 0.0][0])
            ratio = value(frequency, first) / first
            soft = felt * omega**2 * np.maximum(rest, 0.0) * modes.mass / value(mass, modes.mass) / ratio**2
            above = np.minimum(1.0, omega / (modes.omega[-1] * ratio))
            total = total + accuracy.left_out_error(soft, above, exponent, modes.dimension)
            softness = softness + soft
        return np.where(
            softness <= RESOLVABLE, total * np.where((loss > 0.0) | (share > 0.0), accuracy.LOSSY, 1.0), np.inf
        )

    def scene(self) -> dict[str, Any]:
        """The blow that all cells share, as plain numbers."""
        law = self.base.contact
        return {
            "target": _plain(self.base.modes, self.base.at),
            "striker": _plain(self.base.striker.modes, self.base.striker.at),
            "contact": dict(vars(law)),
            "speed": self.base.speed,
        }

    def sampled(self) -> "Grid":
        """The same grid with each body reduced to its contact points: small enough to send to a cluster."""
        places = self.axes.get("at", self.base.at[None])
        striker = self.base.striker
        if striker.modes.dimension:
            striker = replace(striker, modes=_sampled(striker.modes, striker.at[None]))
        places = np.unique(np.vstack([places, self.base.at[None]]), axis=0)
        return replace(
            self, base=replace(self.base, modes=_sampled(self.base.modes, places), striker=striker), kernels={}
        )

    def without_speed(self) -> "Grid | None":
        """The grid at one speed if every contact is linear, so that speed only scales the forces; otherwise None."""
        exponents = self.axes.get("exponent", np.array([self.base.contact.exponent]))
        law = self.base.contact
        if "speed" not in self.axes or (exponents != 1.0).any() or self.lossy or law.gap or self.extra:
            return None
        if law.hard_stiffness or "hard_stiffness" in self.axes:
            return None
        return replace(self, axes={**self.axes, "speed": self.axes["speed"][:1]})


def _sampled(modes: Modes, points: np.ndarray) -> Modes:
    """Modes at the given points only; leaves out the compliance between different points, which no blow needs."""
    static = np.diag([float(modes.shapes.compliance(point[None])[0, 0]) for point in points])
    return replace(modes, shapes=SampledShapes(points, modes.shape_at(points), static))


@check.typed
def sweep(
    modes: Modes,
    striker: Striker,
    contact: Contact,
    *,
    at: Any,
    speed: float,
    over: Mapping[str, Any],
    tolerance: float = TOLERANCE,
    max_frequency: float | None = None,
    layers: Mapping[str, Callable[[Response], float]] | None = None,
    residual: bool = True,
    workers: int | None = None,
    client: Any = None,
    store: str | Path | None = None,
    watch: Watch | None = None,
    max_cells: float = MOST_CELLS,
    tell: Tell | None = None,
) -> xarray.Dataset:
    """Strike once for every combination of parameters.

    Parameters
    ----------
    modes, striker, contact, at, speed
        The blow that all cells share, as in `strike`; the axes replace some of it.
    over : mapping of axis name to values
        Names are those of `AXES` (``mass`` is the striker's) or those of a scene file (``striker.mass``). Values of
        ``at`` are points, shape (n_points, dimension) [m]; all others are one-dimensional, in SI units.
    tolerance : float [-]
        Error limit of every cell, as in `strike`.
    max_frequency : float [Hz], optional
        Adds the layer ``centroid``, the spectral centroid of the band from zero to this frequency. It has no default:
        the mean frequency of a pulse grows without limit as the band widens.
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
        Zarr folder for finished cells; a run that was killed resumes from it. The workers of a cluster write to it
        themselves, so it must have the same path on every machine.
    watch : callable, optional
        Called from time to time with the number of cells done and the total.
    max_cells : float
        A map with more cells is refused before it starts.
    tell : callable, optional
        Called once before the start, with a sentence on the cost, if the map will take more than 10 s or 2 GB.

    Returns
    -------
    xarray.Dataset
        One dimension per axis, in the order given; variables as in `LAYERS` with their units; ``truncation``, the
        expected error of modes left out; ``tolerance_met``; and ``failure``, the error text of a cell that failed (its
        numbers are then NaN and its n_impacts is -1).
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
    base = Case(modes, striker, contact, modes.point("at", at)[0], check.positive("speed", speed, "m/s", reach=REACH))
    band = None if max_frequency is None else check.positive("max_frequency", max_frequency, "Hz")
    workers = None if workers is None else check.count("workers", workers)
    max_cells = check.number("max_cells", max_cells)
    layers = {} if layers is None else layers
    if not isinstance(layers, Mapping) or not all(isinstance(name, str) and callable(layers[name]) for name in layers):
        raise ValueError(f"layers must map names to functions of a Response, got {check.shown(layers)}")
    grid = Grid(base, checked_axes(base, over), tolerance, residual, band, dict(layers))
    admit(grid.n_cases, len(grid.layers), max_cells, quick=not grid.extra, tell=tell)
    fewer = grid.without_speed()
    numbers, texts = _solve_all(fewer or grid, workers, client, store, watch)
    failures = np.full((fewer or grid).n_cases, "", dtype=f"<U{max(map(len, texts.values()), default=1)}")
    failures[list(texts)] = list(texts.values())
    if fewer is not None:
        numbers, failures = _with_speed(grid, fewer, numbers, failures)
    return _dataset(grid, numbers, failures)


def admit(n_cells: int, n_layers: int, max_cells: float, *, quick: bool = True, tell: Tell | None = None) -> None:
    """Refuse a map with too many cells; announce the cost of a large one."""
    seconds = n_cells * SECONDS[quick] / (os.cpu_count() or 1)
    memory = 8.0 * n_cells * (n_layers + 2.0)  # [byte]
    cost = f"{n_cells:.3g} cells: about {seconds:.2g} s on this machine and {memory / 1e9:.2g} GB of memory"
    if n_cells > max_cells:
        raise ValueError(f"over asks for {cost}; give fewer values, or raise max_cells, now {max_cells:.3g}")
    if tell is not None and (seconds > COSTLY[0] or memory > COSTLY[1]):
        tell(cost)


def _solve_all(
    grid: Grid, workers: int | None, client: Any, store: Any, watch: Watch | None
) -> tuple[np.ndarray, Texts]:
    """Compute all cells, block by block, on a cluster or in threads of this process."""
    if client is not None:
        return by_cluster(grid, client, store, partial(solve, workers=1), watch)
    if store is not None:
        return by_store(grid, store, partial(solve, workers=workers), watch)
    numbers = np.empty((len(grid.layers), grid.n_cases))
    texts: Texts = {}
    size = block_size(grid.n_cases) if grid.lossy or grid.extra else LARGEST_BLOCK  # slow cells are counted more often
    for start in range(0, grid.n_cases, size):
        stop = min(start + size, grid.n_cases)
        numbers[:, start:stop], new = solve(grid, start, stop, workers=workers)
        texts |= new
        if watch is not None:
            watch(stop, grid.n_cases)
    return numbers, texts


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
    place = dict(zip(grid.axes, np.unravel_index(np.arange(start, stop), grid.shape)))
    law = grid.base.contact
    base = {"target_mass": grid.base.modes.mass, "mass": grid.base.striker.mass, "speed": grid.base.speed, **vars(law)}
    column = {
        name: grid.axes[name][place[name]] if name in place else np.full(stop - start, value)
        for name, value in base.items()
    }
    quick = (column["exponent"] >= 1.0) & (column["gap"] >= 0.0) & (not grid.extra)
    for name in ("hard_stiffness", "yield_approach", "hysteresis"):
        quick &= column[name] == 0.0
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
            case = grid.case(start + i)
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
    rest = np.flatnonzero(~quick)
    texts = {}
    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        struck = [pool.submit(grid.strike, start + int(i)) for i in rest]
        try:
            for i, cell in zip(rest, struck):
                numbers[:, i], text = cell.result()
                if text:
                    texts[start + int(i)] = text
        finally:
            pool.shutdown(cancel_futures=True)
    return numbers, texts


def checked_axes(base: Case, over: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Checked values of every axis, under its name in `AXES`."""
    if not isinstance(over, Mapping) or not over:
        raise ValueError(f"over must name at least one axis, for example {{'mass': [...]}}, got {check.shown(over)}")
    axes: dict[str, np.ndarray] = {}
    for given, values in over.items():
        name = ALIASES.get(given, given)
        check.one_of("over", name, AXES)
        if name in axes:
            raise ValueError(f"over names the axis {name} twice")
        if name == "at":
            axes[name] = base.modes.points("over['at']", values)
        else:
            axes[name] = check.array(f"over[{given!r}]", values, (None,), AXES[name][0])
        if not len(axes[name]):
            raise ValueError(f"over[{given!r}] must contain at least one value")
        if name in LAW:
            for value in axes[name]:
                base.changed(name, value)
        elif name != "at":
            for value in axes[name]:
                if name == "damping_ratio":
                    check.non_negative(name, value)
                else:
                    check.positive(name, value, AXES[name][0], reach=REACH)
            base.changed(name, axes[name][0])  # raises if the body cannot change this way, whatever the value
    return axes


def _dataset(grid: Grid, numbers: np.ndarray, failures: np.ndarray) -> xarray.Dataset:
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
    left_out = grid.left_out()
    meaning = "expected error of leaving out modes; infinite where they govern the contact"
    data["truncation"] = (dims, left_out, {"units": "1", "long_name": meaning})
    met = data["error"][1] + left_out <= grid.tolerance
    data["tolerance_met"] = (dims, met, {"units": "1", "long_name": "whether both errors together meet the tolerance"})
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


def _plain(modes: Modes, at: np.ndarray) -> dict[str, Any]:
    """A body and its contact point as plain numbers."""
    place = at[None]
    return {
        "mass": modes.mass,
        "frequencies": modes.frequencies.tolist(),
        "damping_ratios": modes.damping_ratio.tolist(),
        "at": at.tolist(),
        "shape": modes.shape_at(place)[0].tolist(),
        "residual_compliance": float(modes.residual_compliance(place)[0, 0]),
    }
