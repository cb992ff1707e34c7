"""A soft layer over a hard one: ``F = k x**a``, and beyond ``depth`` ``k2 (x - depth)**a2`` more. Nothing is lost."""

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from ...._base.rounding import HALVINGS
from ..build import inner
from .base import Law, LawNumber, Spring
from .power import PowerNumbers, power, power_slopes

KIND = 1.0


@dataclass(frozen=True)
class LayersNumbers(PowerNumbers):
    """The numbers of the hard layer."""

    depth: float = 0.0  # [m] approach at which a hard layer is reached
    hard_stiffness: float = 0.0  # [N/m**hard_exponent] of the hard layer; 0: there is none
    hard_exponent: float = 1.5  # [-] of the hard layer

    @classmethod
    def layers(
        cls, stiffness: float, exponent: float, *, depth: float, hard_stiffness: float, hard_exponent: float = 1.5,
        loss: float = 0.0, gap: float = 0.0,
    ) -> Self:  # fmt: skip
        """A soft layer over a hard one: ``F = stiffness d**exponent + hard_stiffness (d - depth)**hard_exponent``.

        The second term acts where the approach d exceeds ``depth`` [m], at which the soft layer bottoms.

        Examples
        --------
        >>> tip = fi.Contact.layers(1e5, 1.0, depth=1e-3, hard_stiffness=1e9)
        >>> tip.force([1e-3, 2e-3]).round(3).tolist()
        [100.0, 31822.777]
        """
        return cls(stiffness, exponent, loss, gap, depth, hard_stiffness, hard_exponent)


class LayersLaw(Law):
    """A soft layer over a hard one."""

    kind = KIND
    name = "layers"
    mark = "hard_stiffness"
    numbers: ClassVar = {
        "depth": LawNumber(
            "m", "approach at which the hard layer is reached", "approach at which the soft layer bottoms"
        ),
        "hard_stiffness": LawNumber(
            "N/m**hard_exponent", "stiffness of the hard layer", "of the layer below", most=1e200
        ),
        "hard_exponent": LawNumber("", "exponent of the hard layer", "of the layer below", 1.0, 100.0),
    }
    damped = True
    slopes = ("stiffness", "exponent", "loss", *numbers)
    words = " over a hard layer"

    def force(self, contact: Any, pressed: np.ndarray) -> np.ndarray:
        further = np.maximum(pressed - contact.depth, 0.0)
        return super().force(contact, pressed) + contact.hard_stiffness * further**contact.hard_exponent

    def deepest(self, row: Any, energy: np.ndarray) -> np.ndarray:
        k, a, hard, b = row.stiffness, row.exponent, row.hard_stiffness, row.hard_exponent
        deepest = ((a + 1.0) * energy / k) ** (1.0 / (a + 1.0))  # [m] by the power law alone
        low, high = np.zeros_like(deepest), deepest
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            over = np.maximum(middle - row.depth, 0.0)
            stored = k * middle ** (a + 1.0) / (a + 1.0) + hard * over ** (b + 1.0) / (b + 1.0)
            low, high = np.where(stored < energy, middle, low), np.where(stored < energy, high, middle)
        return np.where(deepest > row.depth, high, deepest)

    def sentence(self, contact: Any, si: Any) -> str:
        return f" Beyond {si(contact.depth, 'm')} it meets a hard layer."


@inner()
def spring(law, i):
    """The spring of contact i."""
    return Spring(
        law["stiffness"][i], law["exponent"][i], law["loss"][i], law["compliance"][i], KIND,
        law["depth"][i], law["hard_stiffness"][i], law["hard_exponent"][i], 0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip


@inner()
def pushed_beyond(x, spring):
    """Force and stored energy at a compression beyond the corner."""
    a, further = spring.exponent, x - spring.corner
    f = spring.stiffness * power(x, a)
    more = spring.hard * power(further, spring.hard_exponent)
    return f + more, f * x / (a + 1.0) + more * further / (spring.hard_exponent + 1.0)


@inner()
def slopes_beyond(small, large, spring):
    """Average slopes between two compressions beyond the corner."""
    corner = spring.corner
    g, d = power_slopes(spring.stiffness, spring.exponent, small, large)
    more, steeper = power_slopes(spring.hard, spring.hard_exponent, small - corner, large - corner)
    return g + more, d + steeper


@inner()
def slope_beyond(x, spring):
    """Slope of the force at a compression beyond the corner."""
    slope = spring.exponent * spring.stiffness * power(x, spring.exponent) / x
    further = x - spring.corner
    return slope + spring.hard_exponent * spring.hard * power(further, spring.hard_exponent) / further
