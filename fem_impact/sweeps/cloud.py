"""Many blows that share no grid: each has values of its own for whatever is uncertain."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from .._base.rounding import ROUNDING
from ..impact.response import Response
from . import batches, solving
from .cells import FAMILY_AXES, Case
from .store import Texts

FAMILIES = 256  # [-] most pairs of bodies of a cloud that need kernels of their own: some 5 ms each
BANDS = 64  # [-] most upper ends of the centroid's band; blows between share them, so that few kernels are needed


@dataclass(frozen=True, eq=False)
class Cloud:
    """The blow that all cases share, and what is different in each.

    The numbers that need kernels of their own (strike point, damping, and the frequency of a flexible striker over that
    of the body) must take few values, see `few`. The body's frequency is free: with time in units of its period the
    blow on a body r times as high is that on the body itself, of stiffness over r squared and speed over r.
    """

    base: Case
    axes: Mapping[str, np.ndarray]  # name in `cells.AXES`: (n_cases,) values, for `at` (n_cases, dimension)
    tolerance: float  # [-]
    residual: bool
    band: float | None  # [Hz] upper end of the centroid's band
    audit: bool = True  # whether the model's own error is wanted of blows struck alone
    max_impacts: int | None = None
    kernels: batches.Kernels = field(default_factory=dict)
    extra: Mapping[str, Any] = field(default_factory=dict)  # a cloud has no layers besides those of a map

    @property
    def n_cases(self) -> int:
        return len(next(iter(self.axes.values())))

    @property
    def layers(self) -> list[str]:
        """Names of the numbers computed of each blow."""
        return [name for name in solving.LAYERS if name != "centroid" or self.band is not None]

    @property
    def lossy(self) -> bool:
        """Whether any contact loses energy."""
        return bool(self.base.contact.lossy or {"loss", "yield_approach", "hysteresis"} & set(self.axes))

    def case(self, index: int) -> Case:
        """One blow."""
        return self.base.with_values({name: values[index] for name, values in self.axes.items()})

    def blow(self, index: int) -> Response:
        """One blow by the modal engine."""
        return solving.struck_alone(self, self.case(index))

    def scene(self) -> dict[str, Any]:
        """The blow that all cases share, as plain numbers."""
        return solving.plain(self.base)

    def sampled(self) -> "Cloud":
        """The same cloud with each body reduced to its contact points: small enough to send to a cluster."""
        places = np.unique(self.axes["at"], axis=0) if "at" in self.axes else self.base.at[None]
        return replace(self, base=self.base.sampled(places), kernels={})

    @property
    def flexible(self) -> bool:
        """Whether the striker vibrates."""
        return bool(self.base.striker.modes.omega.any())

    @cached_property
    def ratio(self) -> np.ndarray:
        """Factor (n_cases,) [-] by which the frequencies of the struck body are raised."""
        if "target_frequency" not in self.axes:
            return np.ones(self.n_cases)
        return self.axes["target_frequency"] / self.base.first_frequency

    @cached_property
    def families(self) -> tuple[np.ndarray, np.ndarray]:
        """Number of the pair of bodies of each case (n_cases,), and one case of each pair (n_families,)."""
        columns: list[Any] = [np.zeros(self.n_cases)]
        if self.flexible:
            columns.append(np.log(self.axes.get("striker_frequency", 1.0) / self.ratio))
        columns += [self.axes["at"].T[i] for i in range(self.axes["at"].shape[1])] if "at" in self.axes else []
        columns += [self.axes["damping_ratio"]] if "damping_ratio" in self.axes else []
        if self.base.contact.loss or "loss" in self.axes:
            columns.append(self.axes.get("loss", np.ones(self.n_cases)) > 0.0)
        numbers = [_ranks(np.asarray(column, float)) for column in columns]
        _, one, which = np.unique(np.column_stack(numbers), axis=0, return_index=True, return_inverse=True)
        return which.reshape(-1), one

    def family(self, index: int, lossy: bool) -> batches.Family:
        """The bodies of one case, with time in units of its period."""
        values = {name: self.axes[name][index] for name in FAMILY_AXES if name in self.axes}
        raised = float(self.ratio[index])
        values.pop("target_frequency", None)
        case = self.base.with_values(values)
        striker = case.striker
        if raised != 1.0 and self.flexible:
            striker = replace(striker, modes=striker.modes.stretched(1.0, 1.0 / raised))
        return batches.Family.of(case.modes, case.at, striker, self.residual, lossy)


def _ranks(column: np.ndarray) -> np.ndarray:
    """Whole numbers (n,) that are equal where values are, up to rounding."""
    order = np.argsort(column, kind="stable")
    ascending = column[order]
    steps = np.diff(ascending) > ROUNDING * np.maximum(1.0, np.abs(ascending[1:]))
    ranks = np.empty(len(column), int)
    ranks[order] = np.concatenate([[0], np.cumsum(steps)])
    return ranks


def few(base: Case, axes: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The axes of a cloud with few values of what needs kernels of its own: each value becomes the nearest level.

    All dimensions that need kernels get equally many levels, each for as many cases as any other, at most `FAMILIES`
    together. The levels are means of their cases, so that means over all cases stay what they were.
    """
    raised = axes["target_frequency"] / base.first_frequency if "target_frequency" in axes else np.ones(1)
    columns: dict[tuple[str, int], np.ndarray] = {}
    if base.striker.modes.omega.any() and {"striker_frequency", "target_frequency"} & set(axes):
        own = axes.get("striker_frequency", _first(base))
        columns["striker_frequency", 0] = np.broadcast_to(own / raised, (len(next(iter(axes.values()))),))
    if "at" in axes:
        columns |= {("at", i): column for i, column in enumerate(axes["at"].T) if np.ptp(column) > 0.0}
    if "damping_ratio" in axes:
        columns["damping_ratio", 0] = axes["damping_ratio"]
    found = {name: np.array(values) for name, values in axes.items()}
    for (name, i), column in columns.items():
        levels = _levelled(column, int(FAMILIES ** (1.0 / len(columns))))
        if name == "at":
            found["at"][:, i] = levels
        else:
            found[name] = levels * raised if name == "striker_frequency" else levels
    return found


def _first(case: Case) -> float:
    """First flexible frequency [Hz] of the striker."""
    return float(case.striker.modes.frequencies[case.striker.modes.omega > 0.0][0])


def _levelled(values: np.ndarray, number: int) -> np.ndarray:
    """Each value (n,) replaced by the mean of its group; groups of neighbours, equally many in each."""
    if len(np.unique(values)) <= number:
        return np.array(values)
    order = np.argsort(values, kind="stable")
    levels = np.empty(len(values))
    for part in np.array_split(order, number):
        levels[part] = values[part].mean()
    return levels


def solve_all(cloud: Cloud, workers: int | None, client: Any, store: Any, watch: Any) -> tuple[np.ndarray, Texts]:
    """Compute all blows: numbers (n_layers, n_cases), and the error texts of those that failed."""
    return solving.solve_all(cloud, solve, workers, client, store, watch)


def solve(cloud: Cloud, start: int, stop: int, *, workers: int | None = None) -> tuple[np.ndarray, Texts]:
    """Compute the blows from ``start`` up to ``stop``; as `grid.solve`."""
    names, some = cloud.layers, slice(start, stop)
    numbers = np.full((len(names), stop - start), np.nan)
    base = cloud.base
    shared = {"target_mass": base.modes.mass, "mass": base.striker.mass, "speed": base.speed, **vars(base.contact)}
    column = {
        name: np.array(cloud.axes[name][some]) if name in cloud.axes else np.full(stop - start, value)
        for name, value in shared.items()
    }
    quick = solving.together(column) & (not base.modes.stretches)
    kinds, one = cloud.families
    ratio, kind = cloud.ratio[some], kinds[some]
    bands = _bands(ratio, cloud.band)
    for band in np.unique(bands):
        cells = np.flatnonzero(quick & (bands == band))
        if not cells.size:
            continue
        r = ratio[cells]
        present, first = np.unique(kind[cells], return_index=True)
        lossy = column["loss"][cells][first] > 0.0
        families = {int(k): cloud.family(int(one[k]), bool(loss)) for k, loss in zip(present, lossy)}
        blows = batches.Blows(
            families, kind[cells], column["target_mass"][cells], column["mass"][cells],
            column["stiffness"][cells] / r**2, column["exponent"][cells], column["speed"][cells] / r,
            column["loss"][cells] * r,
        )  # fmt: skip
        found = batches.bounce(
            blows, tolerance=cloud.tolerance, band=float(band), workers=workers, kernels=cloud.kernels
        )
        powers = {"contact_time": -1.0, "impulse": 1.0, "peak_force": 2.0, "centroid": 1.0}
        for row, name in enumerate(names):
            numbers[row, cells] = getattr(found, name) * r ** powers.get(name, 0.0)
        quick[cells] = found.done & ~(np.isnan(found.centroid) & (cloud.band is not None))
    return numbers, solving.alone(cloud, start, np.flatnonzero(~quick), numbers, workers)


def _bands(ratio: np.ndarray, band: float | None) -> np.ndarray:
    """Upper end of the centroid's band in units of the period of each body (n_cases,) [Hz]; few different ones."""
    if band is None:
        return np.zeros(len(ratio))
    log = np.log(ratio)
    width = np.ptp(log) / BANDS
    return band / np.exp(width * np.round(log / width) if width > ROUNDING else log)
