"""The estimated errors of a blow, by cause and quantity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

CAUSES = {
    "step": "time steps", "truncation": "modes left out", "mesh": "the finite elements",
    "idealisation": "the simplified target", "inherited": "the blow before",
    "measurement": "the measured responses",
}  # fmt: skip


@dataclass(frozen=True)
class Error:
    """Estimated errors: absolute for the restitution, relative for impulse, contact time and peak force."""

    step: float  # [-] of the time integration
    truncation: float  # [-] of leaving out modes
    mesh: float  # [-] of the finite elements
    resolvable: bool = True  # False: the left-out modes govern the contact itself, and no estimate holds
    idealisation: float = 0.0  # [-] of treating the target as rigid or infinite
    sensitivity: float = 1.0  # [-] growth of a small difference from first to last impact; infinite: others happened
    inherited: float = 0.0  # [-] of the motion at the start, from the blow before
    measurement: float = 0.0  # [-] of shapes from measured responses: noise, ends of records, what no body would do
    # [-] by cause, named as above, and quantity; a cause that is not here errs as much in every quantity
    table: Mapping[str, Mapping[str, float]] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def of_causes(
        cls, found: Mapping[str, np.ndarray], quantities: Sequence[str], resolvable: bool, sensitivity: float
    ) -> "Error":
        """The errors by cause, from distances as of `distance.of_runs`: of each the largest in any quantity."""
        whole, table = {"step": 0.0, "truncation": 0.0, "mesh": 0.0}, {}
        for cause, apart in found.items():
            table[cause] = dict(zip(quantities, apart.tolist()))
            whole[cause] = max(table[cause].values())
        return cls(**whole, resolvable=resolvable, sensitivity=sensitivity, table=table)

    @cached_property
    def total(self) -> float:
        """The sum [-]; infinite if the modes cannot resolve the contact."""
        return sum([getattr(self, cause) for cause in CAUSES]) if self.resolvable else float("inf")

    @property
    def dominant(self) -> tuple[str, float]:
        """The largest part, in words, and its size [-]."""
        return max(self.parts().items(), key=lambda part: part[1])

    def parts(self, quantity: str | None = None) -> dict[str, float]:
        """Size [-] of each part by its name in words; of one quantity, or the largest of all that were asked for."""
        largest = {cause: getattr(self, cause) for cause in CAUSES}
        return {words: self.table.get(cause, {}).get(quantity or "", largest[cause]) for cause, words in CAUSES.items()}

    def of_quantity(self, quantity: str) -> float:
        """The estimated error of one quantity [-]; infinite if the modes cannot resolve the contact."""
        return float(sum(self.parts(quantity).values())) if self.resolvable else float("inf")

    def __float__(self) -> float:
        return float(self.total)
