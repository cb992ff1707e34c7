"""A measured blow beside the band that the program states for it: what was measured, what is open, and the verdict.

The band of a point holds nine tenths of what such a measurement would have read: the prediction for random inputs, each
drawn as well as it is known, times the errors of the computation and of the model, plus the error of the measurement.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from fem_impact.scenes.band import ENDS

SEED, DRAWS = 0, 20_000  # of the errors drawn, and how many at least


@dataclass(frozen=True)
class Measured:
    """One number of a measurement."""

    name: str
    value: float
    error: float  # half width of its own interval of 90 %, in its unit
    unit: str


@dataclass(frozen=True)
class Predicted:
    """The program's answer for every point of an experiment."""

    values: np.ndarray  # (n_samples, n_points) for random inputs
    computation: float = 0.0  # [-] largest relative error of the computation
    model: float = 0.0  # [-] standard deviation of the relative error of the model, as far as it is known

    def bands(self, errors: np.ndarray) -> np.ndarray:
        """Ends of the bands, (2, n_points), for measurements with these errors, (n_points,)."""
        rng = np.random.default_rng(SEED)
        values = np.tile(self.values, (-(-DRAWS // len(self.values)), 1))
        shape = values.shape
        off = rng.uniform(-self.computation, self.computation, shape) + self.model * rng.standard_normal(shape)
        read = values * (1.0 + off) + errors / 1.645 * rng.standard_normal(shape)
        return np.quantile(read, ENDS, axis=0)


@dataclass(frozen=True)
class Experiment:
    """Something that somebody measured, and how the program predicts it."""

    key: str  # name of its file and picture
    title: str
    source: str  # who, where to be read, which place there
    licence: str
    rig: str  # what was struck, and with what
    known: Mapping[str, str]  # input -> how well it is known, and from where
    left_open: str  # what the source does not say
    measured: tuple[Measured, ...]
    predict: Callable[[], Predicted]
    reasons: Mapping[str, str] = field(default_factory=dict)  # point outside its band -> the reason found
    found: str = ""  # what else the comparison tells
    before: Callable[[], Predicted] | None = None  # the same without what was assumed after a first look


@dataclass(frozen=True)
class Verdict:
    """A point and its band."""

    point: Measured
    middle: float
    low: float
    high: float
    reason: str

    @property
    def inside(self) -> bool:
        """Whether the band holds the measured number."""
        return self.low <= self.point.value <= self.high

    @property
    def width(self) -> float:
        """Half width of the band over the measured number [-]."""
        return 0.5 * (self.high - self.low) / abs(self.point.value)

    @property
    def own_width(self) -> float:
        """Half width of the measurement's own interval over the measured number [-]."""
        return self.point.error / abs(self.point.value)


def at_first_look(experiment: Experiment, verdicts: tuple[Verdict, ...]) -> tuple[Verdict, ...]:
    """The verdicts without what was assumed after a first look; those given where nothing was."""
    return verdicts if experiment.before is None else judge(experiment, experiment.before())


def judge(experiment: Experiment, predicted: Predicted | None = None) -> tuple[Verdict, ...]:
    """Every point of an experiment against its band."""
    predicted = experiment.predict() if predicted is None else predicted
    errors = np.array([point.error for point in experiment.measured])
    bands, middles = predicted.bands(errors), np.median(predicted.values, axis=0)
    return tuple(
        Verdict(point, float(middle), float(low), float(high), experiment.reasons.get(point.name, ""))
        for point, middle, (low, high) in zip(experiment.measured, middles, bands.T)
    )
