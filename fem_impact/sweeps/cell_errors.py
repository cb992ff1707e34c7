"""How far the cells of a map may be off besides their time steps: the body's description, and the model itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base.check import SimulationError
from .._base.rounding import ROUNDING
from ..impact import accuracy
from ..impact.contact import wall_time
from ..impact.reduced_body import THINNED
from ..impact.what_if import RESOLVABLE, left_out_weight, worst_differences
from .cases import Cases, solve_cases, try_each
from .cells import RATED, Case
from .refined import beside_change

# [-] cells struck again on poorer bodies: of modes in a batch, a fifth of a large map's time; of vectors; or alone
DOUBTED = {"modes": 400, "vectors": 10_000, "alone": 100}


def estimate_left_out(cases: Cases) -> np.ndarray:
    """Expected error [-] of leaving out modes, in the shape of a map; infinite where they govern the contact."""
    if not cases.residual:
        return np.zeros(cases.shape)
    base, places = cases.base, cases.axes.get("at", cases.base.at[None])
    excited = [base.changed("at", place).modes for place in places] if base.views else [base.modes] * len(places)

    def shaped(name: str, values: Any) -> np.ndarray:
        """Values of an axis, or one that all cells share, shaped to broadcast over the map."""
        shape = [-1 if axis == name else 1 for axis in cases.axes] if name in cases.axes else [1]
        return np.reshape(np.asarray(values, float), shape)

    def value(name: str, shared: float | None = None) -> np.ndarray:
        return shaped(name, cases.axes.get(name, [getattr(base.contact, name) if shared is None else shared]))

    stiffness, exponent = value("stiffness"), value("exponent")
    striker = base.striker
    felt = striker.felt_mass * (value("mass", striker.mass) / striker.mass)
    omega = np.pi / wall_time(stiffness, exponent, 1.0 / felt, value("speed", base.speed))
    yielding = base.modes.dimension > 0
    left = [modes.residual_compliance(place)[0, 0] if yielding else 0.0 for modes, place in zip(excited, places)]
    last = shaped("at", [modes.omega[-1] for modes in excited])
    sides = [
        (base.modes, shaped("at", left), last, base.first, "target_mass", "target_frequency"),
        (striker.modes, striker.left_out[0][0, 0], striker.modes.omega[-1], None, "mass", "striker_frequency"),
    ]  # fmt: skip
    total, softness = np.zeros(cases.shape), np.zeros(cases.shape)
    for modes, rest, edge, first, mass, frequency in sides:
        if not modes.dimension or not modes.omega.any():
            continue
        first = first or float(modes.frequencies[modes.omega > 0.0][0])
        ratio = value(frequency, first) / first
        soft = felt * omega**2 * np.maximum(rest, 0.0) * modes.mass / value(mass, modes.mass) / ratio**2
        above = np.minimum(1.0, omega / (edge * ratio))
        total = total + accuracy.left_out_error(soft, above, exponent, modes.dimension)
        softness = softness + soft
    lossy = np.where(sum(value(name) for name in RATED) > 0.0, accuracy.LOSSY, 1.0)
    return np.where(softness <= RESOLVABLE, total * lossy, np.inf)


def model_error(cases: Cases) -> tuple[np.ndarray, str]:
    """The model's own error [-] in the shape of a map, and what of it is not known.

    Examined at the ends and the middle of every axis, at the ends of more than four, and interpolated in its logarithm;
    NaN where these fail.
    """
    middle = [] if len(cases.shape) > 4 else [0.5]  # 3**4 = 81 blows, where five would take 243
    some = [np.unique([0, *(int(share * (n - 1)) for share in middle), n - 1]) for n in cases.shape]
    found = np.empty([len(places) for places in some])
    unknown: dict[str, None] = {}
    for at in np.ndindex(*found.shape):
        index = np.ravel_multi_index([places[i] for places, i in zip(some, at)], cases.shape)
        try:
            hit = cases.blow(int(index))
        except SimulationError:
            found[at] = np.nan
            continue
        found[at] = max(hit.model_error, ROUNDING)
        unknown |= {each.name: None for each in hit.assumptions if not each.known}
    logs = np.log(found)
    for axis, (places, n) in enumerate(zip(some, cases.shape)):
        logs = np.apply_along_axis(lambda column: np.interp(np.arange(n), places, column), axis, logs)  # noqa: B023
    return np.exp(logs), ", ".join(unknown)


def errors_of_description(cases: Cases, numbers: np.ndarray, workers: int | None = None) -> np.ndarray:
    """Error [-] of the bodies' description in each cell, in the shape of a map, as blows on poorer ones show it.

    Cells struck alone know theirs. Of the others, evenly spaced cells, at most DOUBTED, are struck again on bodies
    described less well, see `_Poorer`, and any other has the largest error of those around it; one whose margin is
    shifted by as much has its number of impacts in doubt. Where by that one meets the tolerance beside a cell of
    another number of impacts, or would by the least of those errors, it is struck again, too: at most four times
    DOUBTED.
    """
    poorer = _Poorer.of(cases, numbers, workers)
    if poorer is None:
        return np.zeros(cases.shape)
    fewer = max(1.0, (cases.n_cases / poorer.most) ** (1.0 / len(cases.shape)))
    chosen = [np.unique(np.round(np.linspace(0, n - 1, max(1, int(n / fewer)))).astype(int)) for n in cases.shape]
    every = np.arange(cases.n_cases).reshape(cases.shape)
    struck = every[np.ix_(*chosen)]
    least = most = poorer.errors(struck.reshape(-1)).reshape(2, *struck.shape)
    for axis, (n, some) in enumerate(zip(cases.shape, chosen), 1):
        before = np.searchsorted(some, np.arange(n), side="right") - 1
        after = np.minimum(np.searchsorted(some, np.arange(n)), len(some) - 1)
        least = np.minimum(least.take(before, axis), least.take(after, axis))
        most = np.maximum(most.take(before, axis), most.take(after, axis))
    count, margin = (numbers[cases.layers.index(name)].reshape(cases.shape) for name in ("n_impacts", "margin"))
    meets, surely = (found_in_doubt(errors, margin) <= cases.tolerance for errors in (least, most))
    beside = beside_change(count)
    beside[np.ix_(*chosen)] = False  # known
    found = np.concatenate([every[beside & surely], every[meets & ~surely]])[: 4 * poorer.most]
    if found.size:
        most.reshape(2, -1)[:, found] = poorer.errors(found)
    known = numbers[cases.layers.index("truncation")].reshape(cases.shape)
    return np.where(np.isnan(known), found_in_doubt(most, margin), known)


def found_in_doubt(errors: np.ndarray, margin: np.ndarray) -> np.ndarray:
    """Error [-] of each cell, at least 1 where what shifts its margin is as much as that; both as `_Poorer.errors`."""
    error, shift = errors
    return np.where(shift >= margin, np.maximum(1.0, error), error)


@dataclass(frozen=True, eq=False)
class _Poorer:
    """Blows of a map on bodies described less well: by `Modes.poorer`, or by `blow_when_thinned` where modes left out
    may matter.

    Too few vectors may agree on a final separation that is none; therefore cells with several impacts are also struck
    alone, because `strike` looks for that; so are the cells of a body of which something is not stated
    (`Modes.unstated`).
    """

    cases: Cases
    mine: np.ndarray  # (n_layers, n_cases) of the map itself
    expected: np.ndarray  # (n_cases,) [-] see `estimate_left_out`
    lacking: Mapping[frozenset[str], Cases]  # on bodies that lack something
    thin: Sequence[tuple[Cases, float]]
    unstated: bool
    most: int  # cells to strike at once
    workers: int | None

    @classmethod
    def of(cls, cases: Cases, numbers: np.ndarray, workers: int | None) -> "_Poorer | None":
        """Those of a map of which the results are known; None where the bodies are described exactly."""
        base = cases.base
        descriptions = dict.fromkeys(lacking for modes in base.views.values() for lacking in modes.descriptions())
        by_vectors, bodies = len(descriptions) > 1, (base.modes, base.striker.modes)
        unstated = cases.residual and any(
            each.unstated or each.shapes.dent(each.shapes.grid()[0]).any() for each in bodies
        )
        thin = blow_when_thinned(base) if cases.residual and not base.views else []
        if not by_vectors and not unstated and not thin:
            return None
        plain = replace(cases, band=None, extra={})
        return cls(
            plain, numbers[[cases.layers.index(name) for name in plain.layers]], estimate_left_out(cases).reshape(-1),
            {each: replace(plain, base=base.lacking(each), kernels={}) for each in descriptions if each},
            [(replace(plain, base=poorer, kernels={}), weight) for poorer, weight in thin], unstated,
            DOUBTED["alone" if unstated or not cases.quick else "vectors" if by_vectors else "modes"], workers,
        )  # fmt: skip

    def errors(self, cells: np.ndarray) -> np.ndarray:
        """Error [-] of the description in some cells, and what it shifts their margins by [-], (2, n_cells)."""
        found = np.array([self.mine[self.cases.layers.index("truncation"), cells], np.zeros(len(cells))])
        todo = np.isnan(found[0])
        if todo.any():
            find = self._errors_alone if self.unstated else self._errors_by_descriptions
            found[:, todo] = find(cells[todo])
        return found

    def _errors_by_descriptions(self, cells: np.ndarray) -> np.ndarray:
        """Both of cells that do not know their own."""
        count = self.cases.layers.index("n_impacts")
        mine = self.mine[:, cells]
        runs = {frozenset[str](): mine} | {each: self._struck(cases, cells) for each, cases in self.lacking.items()}
        total = sum(worst_differences(runs, self._difference).values(), np.zeros((2, len(cells))))
        doubted = np.isfinite(self.expected[cells]) & (mine[count] > 0)
        doubted &= self.expected[cells] > 1e-2 * self.cases.tolerance
        some = np.flatnonzero(doubted)
        for cases, weight in self.thin if some.size else ():
            change, shift = self._difference(mine[:, some], self._struck(cases, cells[some]))
            change = np.where(change < 1.0, weight * change, 1.0)
            total[:, some] = np.maximum(total[:, some], [change, weight * shift])
        several = np.flatnonzero((mine[count] > 1) & (len(self.lacking) > 0))
        several = several[:: max(1, -(-len(several) // DOUBTED["alone"]))]
        total[:, several] = np.maximum(total[:, several], self._errors_alone(cells[several]))
        return total

    def _errors_alone(self, cells: np.ndarray) -> np.ndarray:
        """Both of cells struck one by one, whose errors include those of margins; 1 where one fails."""
        described = self.cases.layers.index("truncation")
        found = try_each(cells, lambda cell: self.cases.row(self.cases.blow(cell))[described], self.workers)
        return np.array([[1.0 if error is None else error for error, _ in found], np.zeros(len(cells))])

    def _struck(self, cases: Cases, cells: np.ndarray) -> np.ndarray:
        """The layers of some cells on other bodies."""
        return solve_cases(replace(cases, chosen=cells), 0, len(cells), workers=self.workers)[0]

    def _difference(self, one: np.ndarray, other: np.ndarray, first: bool = True) -> np.ndarray:
        count, margin = (self.cases.layers.index(name) for name in ("n_impacts", "margin"))
        change = np.fmax.reduce(list(self.cases.apart(one, other).values()))
        change = np.where(one[count] == other[count], change, 1.0 * first)
        return np.array([change, np.abs(one[margin] - other[margin]) * first])


def blow_when_thinned(base: Case) -> list[tuple[Case, float]]:
    """The blow on bodies with their upper modes replaced by compliance, and the error over what this changes.

    For each of THINNED that leaves modes out, as of a single blow (`what_if.modes_left_out`).
    """
    found = []
    for wanted in () if base.modes.stretches else THINNED:
        fewer, weights = [], []
        for modes in (base.modes, base.striker.modes):
            flexible = modes.frequencies[modes.omega > 0.0] if modes.dimension else np.empty(0)
            if len(flexible) > 1:
                kept = modes.truncated(max_frequency=max(flexible[-1] / wanted, flexible[0]))
                ratio = float(modes.omega[-1] / kept.omega[-1])
                weights += [left_out_weight(ratio, modes.damping_ratio[-1])] if ratio > 1.0 else []
                modes = kept
            fewer.append(modes)
        if weights:
            striker = replace(base.striker, modes=fewer[1])
            found.append((replace(base, modes=fewer[0], striker=striker), max(weights)))
    return found
