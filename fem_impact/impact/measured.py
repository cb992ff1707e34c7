"""Measured numbers beside the band that the program states for them: inside or outside, and by how much.

The band of a number holds nine tenths of what such a measurement would have read: the prediction for random inputs,
each drawn as well as it is known, with the errors of the computation and of the model, plus that of the measurement.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base import check, markup
from .._base.explained import lines_of_notes
from .._base.known import NINETY
from .quantities import UNITS
from .trust import Trust

ENDS = (0.05, 0.95)  # [-] nine tenths of all lie between them
SEED, DRAWS = 0, 20_000  # of the errors drawn, and how many at least: ends good to 0.01 of the width


@dataclass(frozen=True)
class Measured:
    """One number of a measurement."""

    name: str
    value: float
    error: float  # half width of its own interval of 90 %, in its unit
    unit: str


@dataclass(frozen=True)
class Predicted:
    """The program's answer for every number of a measurement, with errors of all or of each, (n_points,)."""

    values: np.ndarray  # (n_samples, n_points) for random inputs
    computation: Any = 0.0  # [-] largest relative error of the computation
    model: Any = 0.0  # [-] standard deviation of the relative error of the model, as far as it is known
    size: Any = None  # what these are relative to; by default the value

    def bands(self, errors: np.ndarray) -> np.ndarray:
        """Ends of the bands, (2, n_points), for measurements with these errors, (n_points,)."""
        rng = np.random.default_rng(SEED)
        values = np.tile(self.values, (-(-DRAWS // len(self.values)), 1))
        shape, size = values.shape, np.abs(values) if self.size is None else self.size
        off = self.computation * rng.uniform(-1.0, 1.0, shape) + self.model * rng.standard_normal(shape)
        return np.quantile(values + size * off + errors / NINETY * rng.standard_normal(shape), ENDS, axis=0)


@dataclass(frozen=True)
class Verdict:
    """A measured number and its band."""

    point: Measured
    middle: float
    low: float
    high: float
    reason: str = ""  # why it is outside, where that is known

    @property
    def inside(self) -> bool:
        """Whether the band holds the measured number."""
        return self.low <= self.point.value <= self.high

    @property
    def beyond(self) -> float:
        """How far the measured number is above the band, or below it (negative), over the number itself [-]."""
        value = self.point.value
        return (max(0.0, value - self.high) - max(0.0, self.low - value)) / abs(value)

    @property
    def width(self) -> float:
        """Half width of the band over the measured number [-]."""
        return 0.5 * (self.high - self.low) / abs(self.point.value)

    @property
    def own_width(self) -> float:
        """Half width of the measurement's own interval over the measured number [-]."""
        return self.point.error / abs(self.point.value)

    @property
    def said(self) -> str:
        """Inside or outside, and by how much."""
        if self.inside:
            return "inside"
        return f"outside: {100.0 * abs(self.beyond):.2g} % {'above' if self.beyond > 0.0 else 'below'} the band"

    def row(self) -> tuple[str, ...]:
        """Name, measured number with its error and unit, prediction, band and verdict in words."""
        point = self.point
        unit = f" {point.unit}" if point.unit else ""
        return (
            point.name, f"{point.value:.4g} ± {point.error:.2g}{unit}", f"{self.middle:.4g}",
            f"{self.low:.4g} to {self.high:.4g}", self.said,
        )  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Trace(check.Brief):
    """A measured force over time, and the band of the prediction."""

    name: str
    time: np.ndarray  # (n_times,) [s]
    residual: np.ndarray  # (n_times,) [N] measured less predicted
    error: np.ndarray  # (n_times,) [N] half width of the measurement's own interval of 90 %
    band: np.ndarray  # (n_times,) [N] of the prediction and the measurement together

    @property
    def inside(self) -> np.ndarray:
        """Whether the band holds each sample, (n_times,)."""
        return np.abs(self.residual) <= self.band


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(check.Brief):
    """Measured numbers against the program; `print` it, draw it by `fi.figures.against`."""

    verdicts: tuple[Verdict, ...]
    traces: tuple[Trace, ...] = ()
    notes: tuple[str, ...] = ()
    title: str = ""

    HEAD = ("", "measured", "predicted", "band of 90 %", "")

    @property
    def n_inside(self) -> int:
        """How many numbers lie inside their bands."""
        return sum(each.inside for each in self.verdicts)

    def __getitem__(self, name: str) -> Verdict:
        found = {each.point.name: each for each in self.verdicts}
        return found[check.one_of("name", name, found)]

    def explained(self, reasons: Mapping[str, str]) -> "Comparison":
        """The same with reasons, name by name, why numbers lie outside."""
        return replace(
            self, verdicts=tuple(replace(each, reason=reasons.get(each.point.name, "")) for each in self.verdicts)
        )

    def summary(self) -> str:
        """Every number with its band and verdict."""
        lines = [f"{self.n_inside} of {len(self.verdicts)} measured numbers lie inside the band of 90 %"]
        lines += markup.columns([each.row() for each in self.verdicts], self.HEAD)
        lines += [f"{each.name}: {100.0 * each.inside.mean():.0f} % of the samples inside" for each in self.traces]
        return "\n".join(lines + lines_of_notes(self.notes))

    __str__ = summary


def compare(measured: tuple[Measured, ...], predicted: Predicted, **more: Any) -> Comparison:
    """Every measured number against its band; ``more`` is of the `Comparison`."""
    bands = predicted.bands(np.array([point.error for point in measured]))
    middles = np.median(predicted.values, axis=0).tolist()
    return Comparison(tuple(map(Verdict, measured, middles, *bands.tolist())), **more)


def of_blow(trust: Trust, measured: Any, samples: Mapping[str, np.ndarray] | None = None) -> Comparison:
    """Measured quantities of a blow against it, see `Response.against`; ``samples`` of each (n_samples,) for inputs."""
    judged = {each.quantity: each for each in trust if each.value is not None}
    if not isinstance(measured, Mapping) or not measured:
        raise ValueError(f"measured must map one or more of {', '.join(judged)} to values, got {check.shown(measured)}")
    points, values, errors, said = [], [], [], []
    for name, given in measured.items():
        each = judged[check.one_of("measured", name, judged)]
        if each.value is None or each.computation is None:
            raise ValueError(f"measured must not name {name}, whose error is not known: the modes left out govern it")
        pair = check.array(f"measured {name}", given, (None,), UNITS[name], lift=True)
        if len(pair) not in (1, 2) or not pair[0]:
            raise ValueError(f"measured {name} must be a value, or (value, half width of its interval of 90 %)")
        error = check.non_negative(f"error of measured {name}", pair[1]) if len(pair) == 2 else 0.0
        points.append(Measured(each.name, float(pair[0]), error, UNITS[name]))
        values.append(np.array([each.value]) if samples is None else samples[name])
        errors.append((each.computation, each.known, 1.0 if name == "restitution" else abs(each.value)))
        said += [f"{each.name}: the band lacks what is not known of {', '.join(each.unknown)}"] if each.unknown else []
    computation, model, size = np.array(errors).T
    predicted = Predicted(np.column_stack(values), computation, model, size)
    return compare(tuple(points), predicted, notes=tuple(said))
