"""A reference case: where its numbers come from, and how this program computes them."""

import time
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..impact.response import Response
from ..modes.modal import Modes

TABLE: Mapping[str, Mapping[str, Any]] = tomllib.loads(Path(__file__).with_name("cases.toml").read_text("utf-8"))
QUANTITIES = {
    "n_impacts": ("number of impacts", ""), "contact_time": ("contact time", "s"), "peak_force": ("peak force", "N"),
    "impulse": ("impulse", "N s"), "restitution": ("restitution", ""),
}  # fmt: skip


@dataclass(frozen=True)
class ReferenceLine:
    """One number: the reference, ours, and how far each may be wrong."""

    quantity: str
    unit: str
    reference: float
    within: float  # what the reference itself may err by, in its unit
    ours: float
    error: float  # what we say that ours errs by, in its unit

    @property
    def difference(self) -> float:
        """Ours less the reference, in the unit."""
        return self.ours - self.reference

    @property
    def allowed(self) -> float:
        """What the difference may be: both errors, and rounding."""
        return self.error + self.within + 1e-13 * abs(self.reference)  # so much is left of a closed form

    @property
    def holds(self) -> bool:
        """Whether the two differ by no more than both errors allow."""
        return bool(abs(self.difference) <= self.allowed)


@dataclass(frozen=True)
class ReferenceVerdict:
    """What a case says on this machine."""

    name: str
    title: str
    kind: str  # "closed form", "published", "independent integrator" or "independent computation"
    source: str
    lines: Sequence[ReferenceLine]
    seconds: float  # [s] wall time

    @property
    def holds(self) -> bool:
        """Whether every number differs from its reference by no more than both errors allow."""
        return all(line.holds for line in self.lines)

    @property
    def worst(self) -> ReferenceLine:
        """The number that takes the largest share of what it is allowed."""
        return max(self.lines, key=lambda line: abs(line.difference) / max(line.allowed, np.finfo(float).tiny))

    @property
    def data(self) -> dict[str, Any]:
        """Everything as plain numbers and words."""
        lines = [asdict(line) | {"difference": line.difference, "holds": line.holds} for line in self.lines]
        return asdict(self) | {"lines": lines, "holds": self.holds}


@dataclass(frozen=True)
class Reference:
    """A reference case of `cases.toml`, computed when it is asked for."""

    name: str
    lines: Callable[[], Iterable[ReferenceLine]]

    @property
    def about(self) -> Mapping[str, Any]:
        """Its title, kind and source; its values and the unit of their last digit, unless a formula gives them."""
        return TABLE[self.name]

    def compute(self) -> ReferenceVerdict:
        """What it says on this machine."""
        start, about = time.perf_counter(), self.about
        lines = tuple(self.lines())
        return ReferenceVerdict(
            self.name, about["title"], about["kind"], about["source"], lines, time.perf_counter() - start
        )  # fmt: skip


def of_modes(
    modes: Modes, wanted: ArrayLike, digit: float = 0.0, unit: str = "Hz", per: float = 1.0
) -> list[ReferenceLine]:
    """Lines of the frequencies of the flexible modes, each multiplied by ``per`` to the unit of the reference."""
    wanted = np.atleast_1d(np.asarray(wanted, dtype=float))
    flexible = slice(modes.n_rigid, modes.n_rigid + len(wanted))
    assert modes.frequency_error is not None  # `find_modes` always gives it
    ours = modes.frequencies[flexible] * per
    rows = zip(wanted.tolist(), ours.tolist(), (ours * modes.frequency_error[flexible]).tolist())
    return [ReferenceLine(f"mode {i}", unit, there, 0.5 * digit, *row) for i, (there, *row) in enumerate(rows, 1)]


def of_blow(hit: Response, wanted: Mapping[str, float], within: Mapping[str, float]) -> list[ReferenceLine]:
    """Lines of the numbers of a blow with the errors that it states; ``within`` by name, in the unit of each."""
    lines = []
    for name, reference in wanted.items():
        words, unit = QUANTITIES[name]
        ours = float(getattr(hit, name))
        relative = 0.0 if name == "n_impacts" else hit.error.of_quantity("force" if name == "peak_force" else name)
        error = relative * (1.0 if name == "restitution" else abs(ours))
        lines.append(ReferenceLine(words, unit, reference, within.get(name, 0.0), ours, error))
    return lines
