"""A contact that yields: elastic up to first yield, beyond it along the tangent; it unloads from a dent.

Beyond first yield, or beyond the deepest compression so far, the force goes on along the tangent of the elastic curve
at first yield. The memory is that deepest compression ``m``. From there the contact unloads along
``F = F_m ((x - dent) / x_e)**a`` with ``x_e = F_m / (k m**(a-1))`` and ``dent = m - x_e``. That is Thornton's law
(1997, J. Appl. Mech. 64, 383) for a = 1.5. At each moment it is the potential of a spring with a corner, at rest at
the dent: what yielding takes is the difference of two such potentials.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from ...._base import check
from ..build import inner
from .base import Law, LawNumber, Spring, standing_in
from .power import PowerNumbers, power, power_slopes

KIND = 2.0


@dataclass(frozen=True)
class PlasticNumbers(PowerNumbers):
    """The number of first yield."""

    yield_approach: float = 0.0  # [m] approach at first yield; 0: it never yields

    @classmethod
    def elastic_plastic(
        cls,
        stiffness: float,
        exponent: float = 1.5,
        *,
        yield_speed: float | None = None,
        mass: float | None = None,
        yield_approach: float | None = None,
        gap: float = 0.0,
    ) -> Self:
        """A contact that yields: elastic up to first yield, beyond it along the tangent; it unloads from a dent.

        Well beyond first yield the restitution on a rigid wall falls as ``speed**(-1/4)``. Pressed again, the contact
        is elastic up to the deepest approach so far.

        Parameters
        ----------
        stiffness : float [N/m**exponent]
        exponent : float [-]
            At least 1; 1.5 for round bodies. With exponent 1 nothing yields.
        yield_speed : float [m/s]
            Speed of first yield of a mass on a rigid wall.
        mass : float [kg]
            This mass; of two free bodies, product over sum.
        yield_approach : float [m]
            Approach at first yield, instead of speed and mass.

        References
        ----------
        Thornton (1997), J. Appl. Mech. 64, 383-386, for the exponent 1.5.

        Examples
        --------
        >>> law = fi.Contact.elastic_plastic(1e10, yield_speed=0.1, mass=0.004)
        >>> wall, ball = fi.Modes.rigid(1e6), fi.Striker.rigid(0.004)
        >>> [round(fi.strike(wall, ball, law, at=None, speed=v).restitution, 3) for v in (0.1, 1.6, 25.6)]
        [1.0, 0.588, 0.296]
        """
        if (yield_approach is None) == (yield_speed is None or mass is None):
            raise ValueError("yield_approach must be given, or yield_speed and mass")
        if yield_approach is not None:
            first = check.positive("yield_approach", yield_approach, "m")
            return cls(stiffness, exponent, gap=gap, yield_approach=first)
        law = cls(stiffness, exponent, gap=gap)
        energy = 0.5 * check.positive("mass", mass, "kg") * check.positive("yield_speed", yield_speed, "m/s") ** 2
        power = law.exponent + 1.0
        return replace(law, yield_approach=float((power * energy / law.stiffness) ** (1.0 / power)))


class PlasticLaw(Law):
    """A contact that yields."""

    kind = KIND
    name = "elastic_plastic"
    mark = "yield_approach"
    numbers: ClassVar = {"yield_approach": LawNumber("m", "approach at first yield", "")}
    keys: ClassVar = {
        "exponent": LawNumber("", "", "1.5 for round bodies; with 1 nothing yields", 1.0, 100.0),
        "yield_speed": LawNumber("m/s", "", "at which a mass on a rigid wall first yields; with mass", None),
        "mass": LawNumber("kg", "", "of that mass", None),
        "yield_approach": LawNumber("m", "", "approach at first yield, in place of yield_speed and mass", None),
    }
    remembers = True
    hertzian = True
    slopes = ("stiffness", "exponent", *numbers)
    words = " that yields"

    def acts(self, contact: Any) -> bool:
        return bool(contact.exponent > 1.0)

    def force(self, contact: Any, pressed: np.ndarray) -> np.ndarray:
        k, a, first = contact.stiffness, contact.exponent, contact.yield_approach
        soft = np.minimum(pressed, first)
        return np.asarray(k * soft**a + a * k * first ** (a - 1.0) * (pressed - soft))

    def acting(self, row: Any, mobility: Any, speed: Any) -> np.ndarray:
        k, a, first = row.stiffness, row.exponent, row.yield_approach
        energy = 0.5 * np.asarray(speed) ** 2 / np.asarray(mobility)  # [J]
        deepest = ((a + 1.0) * energy / k) ** (1.0 / (a + 1.0))  # [m] by the power law alone
        force, steep = k * first**a, a * k * first ** (a - 1.0)
        further = np.maximum(energy - force * first / (a + 1.0), 0.0)
        beyond = first + (np.sqrt(force * force + 2.0 * steep * further) - force) / steep
        return standing_in(row, energy, np.where(deepest > first, beyond, deepest))

    def sunk(self, row: Any, memory: np.ndarray, left: np.ndarray) -> np.ndarray:
        a, first = row.exponent, row.yield_approach
        deepest = np.maximum(np.abs(memory), first)
        return np.asarray(deepest - (first / deepest) ** (a - 1.0) * (a * deepest - (a - 1.0) * first))

    def approach(self, contact: Any, force: float) -> float:
        k, a, first = contact.stiffness, contact.exponent, contact.yield_approach
        beyond = force - k * first**a
        return first + beyond / (a * k * first ** (a - 1.0)) if beyond > 0.0 else super().approach(contact, force)

    def sentence(self, contact: Any, si: Any) -> str:
        return f" Beyond {si(contact.yield_approach, 'm')} it yields and keeps a dent."


@inner()
def spring(law, i, memory):
    """The spring of contact i that has been pressed as deep as it remembers, from its dent."""
    k, a, loss, c, first = (
        law["stiffness"][i], law["exponent"][i], law["loss"][i], law["compliance"][i], law["yield_approach"][i],
    )  # fmt: skip
    steep = a * k * power(first, a - 1.0)
    deepest = max(memory, first)
    if deepest == first:
        return Spring(k, a, loss, c, KIND, first, steep, 1.0, 0.0, 0.0)
    force = k * power(first, a) + steep * (deepest - first)
    back = force / (k * power(deepest, a - 1.0))
    return Spring(force / power(back, a), a, loss, c, KIND, back, steep, 1.0, 0.0, 0.0)


@inner()
def yields(law, i):
    """Whether contact i can yield."""
    return law["yield_approach"][i] > 0.0


@inner()
def dent(law, i, memory):
    """How far the surface of contact i is lower than at first [m], from what it remembers."""
    first = law["yield_approach"][i]
    if first <= 0.0 or memory <= first:
        return 0.0
    a = law["exponent"][i]
    return memory - power(first / memory, a - 1.0) * (a * memory - (a - 1.0) * first)


@inner()
def pushed(x, spring):
    """Force and stored energy at a compression beyond the corner."""
    a, corner, further = spring.exponent, spring.corner, x - spring.corner
    f = spring.stiffness * power(corner, a)
    more = spring.hard * further
    return f + more, f * corner / (a + 1.0) + further * (f + 0.5 * more)


@inner()
def slopes(small, large, spring):
    """Average slopes between two compressions > 0, of which at least one is beyond the corner."""
    k, a, corner, hard = spring.stiffness, spring.exponent, spring.corner, spring.hard
    further = large - corner
    f = k * power(corner, a)
    if small >= corner:
        return f + 0.5 * hard * (further + small - corner), hard
    g, d = power_slopes(k, a, small, corner)
    span = large - small
    g = (g * (corner - small) + (f + 0.5 * hard * further) * further) / span
    return g, (d * (corner - small) + hard * further) / span


@inner()
def far_side(x, spring):
    """Force and its slope beyond the corner, continued smoothly to the near side of it."""
    return spring.stiffness * power(spring.corner, spring.exponent) + spring.hard * (x - spring.corner), spring.hard
