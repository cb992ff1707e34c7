"""An experiment: what was measured, what is open, and how the program predicts it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from fem_impact.impact.measured import Comparison, Measured, Predicted, Verdict, compare

__all__ = ["Experiment", "Measured", "Predicted", "Verdict", "judge"]


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
    measured: tuple[Measured, ...]  # none where the comparison itself is what is found
    predict: Callable[[], Predicted | Comparison]
    reasons: Mapping[str, str] = field(default_factory=dict)  # point outside its band -> the reason found
    found: str = ""  # what else the comparison tells
    before: Callable[[], Predicted] | None = None  # the same without what was assumed after a first look


def at_first_look(experiment: Experiment, verdicts: tuple[Verdict, ...]) -> tuple[Verdict, ...]:
    """The verdicts without what was assumed after a first look; those given where nothing was."""
    return verdicts if experiment.before is None else judge(experiment, experiment.before()).verdicts


def judge(experiment: Experiment, predicted: Predicted | Comparison | None = None) -> Comparison:
    """Every point of an experiment against its band."""
    found = experiment.predict() if predicted is None else predicted
    compared = found if isinstance(found, Comparison) else compare(experiment.measured, found)
    return replace(compared.explained(experiment.reasons), title=experiment.title)
