"""What uncertain inputs do to a blow: distributions of its quantities, the chance of a double hit, shares of inputs."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import xarray
from scipy import stats

from .._base import check, markup
from .._base.explained import lines_of_notes
from .._base.rounding import SAME
from .cases import LAYERS
from .inputs import Input

LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)  # [-] quantiles stated: median, quartiles and the ends of nine tenths of all
DOUBLE = "double_hit"
QUANTITIES: dict[str, tuple[str, str]] = {
    **{name: about for name, about in LAYERS.items() if name not in ("margin", "error", "truncation")},
    DOUBLE: ("", "whether the striker touches more than once"),
}


class Estimate(NamedTuple):
    """A number found from a sample, and the ends of its interval."""

    value: float
    low: float
    high: float


class Shares(NamedTuple):
    """Sobol indices of one input: its share of a quantity's variance alone, and with all it acts through."""

    first: Estimate  # [-]
    total: Estimate  # [-]


@dataclass(frozen=True, eq=False)
class Checks:
    """A few blows of a spread struck one by one, with their exact inputs: how far the spread's own are off."""

    n_blows: int
    apart: Mapping[str, float]  # quantity: largest difference (restitution absolute, others relative) [-]
    n_other: int  # blows with another number of impacts
    body: float  # [-] largest error of the body's description
    model: float  # [-] largest error of the model itself
    unknown: tuple[str, ...]  # what of the model's error is not known


@dataclass(frozen=True, eq=False, repr=False)
class Spread(check.Brief):
    """Many blows with uncertain inputs; from `fem_impact.spread`.

    Intervals hold the truth with a probability of `confidence` as if the blows were drawn at random; their points fill
    the inputs more evenly, so that most intervals are wider than need be.
    """

    inputs: tuple[Input, ...]
    table: xarray.Dataset  # one dimension, ``blow``: inputs, quantities, ``part``, ``failure``
    tolerance: float  # [-] of every blow
    crossed: bool  # whether the blows are groups for Sobol indices
    mixer: np.ndarray | None = None  # what correlates the inputs, see `inputs.correlating_matrix`
    seed: int = 0
    confidence: float = 0.9  # [-] with which every interval covers the truth
    checks: Checks | None = None
    rescaled: Mapping[str, float] = field(default_factory=dict)  # input of the body: error [-] of rescaling its modes
    title: str = ""
    notes: tuple[str, ...] = ()
    why_no_shares: str = ""  # why there are no Sobol indices

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(each.name for each in self.inputs)

    @property
    def n_blows(self) -> int:
        """Blows struck, those for Sobol indices included."""
        return int(self.table.sizes["blow"])

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of the quantities known of each blow."""
        return tuple(name for name in QUANTITIES if name in self.table)

    @cached_property
    def own(self) -> np.ndarray:
        """Numbers of the blows whose inputs are independent points, failed ones left out."""
        part = self.table["part"].values
        return np.flatnonzero(((part == 0) | (part == part.max())) & (self.table["n_impacts"].values >= 0))

    def values(self, name: str) -> np.ndarray:
        """An input or a quantity in the blows of `own`."""
        check.one_of("quantity", name, [*self.quantities, *self.names])
        return np.asarray(self.table[name].values[self.own], float)

    def quantile(self, quantity: str, level: float) -> Estimate:
        """Value that a share ``level`` [-] of all blows stays below, with a distribution-free interval.

        References
        ----------
        Conover (1999), Practical Nonparametric Statistics, 3.2: order statistics and the binomial distribution.
        """
        level = check.between("level", level, 0.0, 1.0)
        values = np.sort(self.values(quantity))
        n, rest = len(values), 0.5 * (1.0 - self.confidence)
        if n == 0:
            raise check.SimulationError("no blow succeeded, so nothing has a distribution; see `table.failure`")
        low, high = stats.binom.ppf([rest, 1.0 - rest], n, level)
        ends = int(np.clip(low - 1, 0, n - 1)), int(np.clip(high, 0, n - 1))
        return Estimate(float(np.quantile(values, level)), float(values[ends[0]]), float(values[ends[1]]))

    def chance(self, quantity: str = DOUBLE, above: float = 0.5) -> Estimate:
        """Chance that a quantity exceeds a value, by default that of a double hit, with Wilson's interval.

        References
        ----------
        Wilson (1927), J. Am. Stat. Assoc. 22, 209-212.
        """
        values = self.values(quantity) > check.number("above", above)
        if not len(values):
            raise check.SimulationError("no blow succeeded, so nothing has a chance; see `table.failure`")
        found = stats.binomtest(int(values.sum()), len(values))
        low, high = found.proportion_ci(self.confidence, method="wilson")
        return Estimate(float(values.mean()), float(low), float(high))

    @property
    def varying(self) -> tuple[str, ...]:
        """Quantities that are not the same in every blow."""
        return tuple(
            name for name in self.quantities
            if len(v := self.values(name)) > 1 and np.ptp(v) > SAME * np.abs(v).max(initial=0.0)
        )  # fmt: skip

    @cached_property
    def correlations(self) -> dict[str, dict[str, float]]:
        """Spearman's rank correlation [-] of each varying quantity with each input."""
        ranks = {name: stats.rankdata(self.values(name)) for name in (*self.names, *self.varying)}
        return {
            quantity: {name: float(np.corrcoef(ranks[quantity], ranks[name])[0, 1]) for name in self.names}
            for quantity in self.varying
        }

    @cached_property
    def shares(self) -> dict[str, dict[str, Shares]]:
        """Sobol indices of each varying quantity and each input; empty if there are none, see `why_no_shares`.

        Estimated by SALib: first order as Saltelli et al. (2010), total order as Jansen (1999), intervals by bootstrap.
        """
        if not self.crossed:
            return {}
        from SALib.analyze import sobol

        d = len(self.inputs)
        every: dict[str, dict[str, Shares]] = {}
        whole = (self.table["n_impacts"].values.reshape(-1, d + 2) >= 0).all(axis=1)
        problem = {"num_vars": d, "names": list(self.names), "bounds": [[0.0, 1.0]] * d}
        for quantity in self.varying:
            every[quantity] = {}
            groups = np.asarray(self.table[quantity].values, float).reshape(-1, d + 2)
            groups = groups[whole][:4096]  # to limit the memory: their bootstrap keeps 100 copies
            if not len(groups) or np.ptp(groups[:, [0, -1]]) == 0.0:
                continue
            # 100 bootstrap samples estimate a standard deviation to 7 %
            how: dict[str, Any] = {"num_resamples": 100, "conf_level": self.confidence, "seed": self.seed + 1}
            found = sobol.analyze(problem, groups.ravel(), calc_second_order=False, **how)
            first, total = (
                [Estimate(float(v), float(v - c), float(v + c)) for v, c in zip(found[key], found[f"{key}_conf"])]
                for key in ("S1", "ST")
            )
            every[quantity] = {name: Shares(*pair) for name, pair in zip(self.names, zip(first, total))}
        return every

    @property
    def n_failed(self) -> int:
        """Blows without a result."""
        return int((self.table["n_impacts"].values < 0).sum())

    @property
    def chaotic(self) -> bool:
        """Whether the number of impacts varies."""
        return "n_impacts" in self.varying

    def ranking(self, quantity: str) -> list[tuple[str, float]]:
        """Inputs and how much of the quantity's variance each takes part in, the largest first.

        The share is Sobol's total index or, without it, the square of the rank correlation.
        """
        check.one_of("quantity", quantity, self.quantities)
        shares = self.shares.get(quantity)
        if shares:
            pairs = [(name, shares[name].total.value) for name in self.names]
        else:
            pairs = [(name, value**2) for name, value in self.correlations.get(quantity, {}).items()]
        return sorted(pairs, key=lambda pair: -pair[1])

    def summary(self) -> str:
        """Everything in words and numbers; a line for each quantity and each input."""
        lines = [f"{self.n_blows} blows, {len(self.own)} of them independent, {self.n_failed} failed"]
        lines += [f"{each.name}: {each.said}" for each in self.inputs]
        if self.mixer is not None:
            lines.append("The inputs are correlated (Gaussian copula).")
        if not len(self.own):
            return "\n".join([*lines, "No blow succeeded."])
        head = "quantity", "5 %", "median", "95 %", f"{100 * self.confidence:g} % interval of the median"
        rows = []
        for name in (each for each in self.quantities if each != DOUBLE):
            unit = QUANTITIES[name][0]
            low, middle, high = (self.quantile(name, level) for level in (0.05, 0.5, 0.95))
            values = (f"{each.value:.4g}" for each in (low, middle, high))
            ends = f"{middle.low:.4g} to {middle.high:.4g}"
            rows.append((f"{name} [{unit}]" if unit else name, *values, ends))
        lines += ["", *markup.columns(rows, head)]
        lines += ["", f"Chance of a double hit: {double_hits(self)}"]
        if self.chaotic:
            counts = self.values("n_impacts")
            lines.append(
                f"The number of impacts varies from {counts.min():.0f} to {counts.max():.0f}: such blows are chaotic. "
                "With inputs known only this well, no single one can be predicted; their statistics, as above, can."
            )
        lines += ["", *self._advice()]
        if self.checks is not None and self.checks.n_blows:  # how far the blows themselves can be trusted
            worst = ", ".join(f"{name} {value:.1e}" for name, value in self.checks.apart.items())
            other = f", {self.checks.n_other} with another number of impacts" if self.checks.n_other else ""
            unknown = f" (not known: {', '.join(self.checks.unknown)})" if self.checks.unknown else ""
            lines.append(
                f"{self.checks.n_blows} of the blows, struck again one by one, differ most by {worst}{other}; "
                f"error of the body's description {self.checks.body:.1e}, of the model itself "
                f"{self.checks.model:.1g}{unknown}"
            )
        for name, error in self.rescaled.items():
            lines.append(f"{name}: modes were rescaled; a rebuilt body differs by at most {error:.1e}")
        return "\n".join([*lines, *lines_of_notes(self.notes)])

    def _advice(self) -> list[str]:
        """What to measure better, quantity by quantity."""
        if not self.varying:
            return ["Nothing varies: no input matters here."]
        kind = "total Sobol index" if self.shares else "square of the rank correlation"
        lines = [f"What to measure better ({kind}: share of the variance in which an input is involved):"]
        twice = not self.chaotic or self.values("n_impacts").max() <= 2
        for quantity in self.varying:
            if quantity == DOUBLE and twice:  # the number of impacts says the same
                continue
            said = []
            for name, share in self.ranking(quantity):
                if share < 0.02:  # without it, the spread would shrink by 1 %
                    continue
                sign = "+" if self.correlations[quantity][name] >= 0.0 else "-"
                found = self.shares.get(quantity, {}).get(name)
                ends = f" ({_whole(found.total.low)} to {_whole(found.total.high)} %)" if found else ""
                said.append(f"{name} {_whole(share)} %{ends} {sign}")
            lines.append(f"  {quantity}: {'; '.join(said) or 'no input by itself'}")
        lines.append("+ raises the quantity, - lowers it.")
        if self.why_no_shares:
            lines.append(f"No Sobol indices: {self.why_no_shares}")
        return lines

    def data(self) -> dict[str, Any]:
        """All numbers but those of single blows, as plain data."""
        quantities = {
            name: {
                "unit": QUANTITIES[name][0],
                "quantiles": {str(level): self.quantile(name, level)._asdict() for level in LEVELS},
                "rank_correlation": self.correlations.get(name, {}),
                "sobol": {
                    key: {kind: each._asdict() for kind, each in share._asdict().items()}
                    for key, share in self.shares.get(name, {}).items()
                },
            }
            for name in self.quantities
        }  # fmt: skip
        checks = None if self.checks is None else {**vars(self.checks), "apart": dict(self.checks.apart)}
        return {
            "title": self.title, "inputs": {each.name: each.said for each in self.inputs}, "blows": self.n_blows,
            "independent": len(self.own), "failed": self.n_failed, "seed": self.seed, "tolerance": self.tolerance,
            "correlation": None if self.mixer is None else (self.mixer @ self.mixer.T).tolist(),
            "confidence": self.confidence, "double_hit": self.chance()._asdict(), "chaotic": self.chaotic,
            "quantities": quantities, "checks": checks, "rescaled": dict(self.rescaled), "notes": list(self.notes),
            "why_no_sobol": self.why_no_shares,
        }  # fmt: skip


def _whole(share: float) -> str:
    """A share in whole percent; estimates may leave 0 to 100 %, which no share can."""
    return f"{100.0 * min(1.0, max(0.0, share)):.0f}"


def double_hits(found: Spread) -> str:
    """The chance of a double hit and its interval in words."""
    share = found.chance()
    if share.value == 0.0:
        return f"none observed, at most {100 * share.high:.2g} %"
    return f"{100 * share.value:.3g} % ({100 * share.low:.3g} to {100 * share.high:.3g} %)"
