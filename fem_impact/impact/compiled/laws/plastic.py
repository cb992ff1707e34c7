"""A contact that yields: elastic up to first yield, then ever more as a plastic one bears; it unloads from a dent.

With the approach ``u`` beyond first yield ``y`` and ``w = u - reach (1 - exp(-u / reach))``, the part of it that is
fully plastic, the force goes on as

    F = k y**a + a k y**(a-1) (u + steeper w),      reach = REACH y,  steeper = 2.5 for a = 1.5,

so it leaves first yield along the tangent (Thornton 1997, J. Appl. Mech. 64, 383) and ends, for a = 1.5, 3.5 times as
steep: where the mean pressure is 2.8 times the yield strength on the whole area that a rigid ball has cut, pi 2 R x
(Tabor 1951; Johnson 1985, Contact Mechanics, 6.3). The contact grows from Hertz's area pi R x to that one as
``pi R (m + w)``. The memory is the deepest approach ``m``. From there the contact unloads elastically as the wider and
flatter pair of bodies that it has become: ``F = F_m ((x - dent) / back)**a`` with ``back = F_m / (k (m + w)**(a-1))``
and ``dent = m - back`` (Johnson, 11.5). At each moment it is the potential of a spring with a corner, at rest at the
dent: what yielding takes is the difference of two such potentials.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from ...._base import check
from ..build import inner
from .base import Law, LawNumber, Spring
from .power import PowerNumbers, power

KIND = 2.0
LEAST_BACK = 1e-6  # [-] of the deepest approach, on which it unloads: `NEAR` of it is rounding of the approach
REACH = 12.0  # [-] approaches of first yield: nearest to finite elements, force within 12 %; test_plastic.py


@dataclass(frozen=True)
class PlasticNumbers(PowerNumbers):
    """The number of first yield."""

    yield_approach: float = 0.0  # [m] approach at first yield; 0: it never yields

    @classmethod
    def elastic_plastic(
        cls, stiffness: float, exponent: float = 1.5, *, yield_speed: float | None = None, mass: float | None = None,
        yield_approach: float | None = None, gap: float = 0.0,
    ) -> Self:  # fmt: skip
        """A contact that yields: elastic up to first yield, fully plastic far beyond it; it unloads from a dent.

        The force leaves first yield along the tangent. Within some 30 times that approach it becomes 3.5 times as steep
        (for the exponent 1.5), as where a ball presses on metal with 2.8 times its yield strength. Well beyond that the
        restitution on a rigid wall falls as ``speed**(-1/4)``. Pressed again, the contact is elastic up to the deepest
        approach so far.

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
        Johnson (1985), Contact Mechanics, 6.3 and 11.5; Thornton (1997), J. Appl. Mech. 64, 383-386; both for the
        exponent 1.5.

        Examples
        --------
        >>> law = fi.Contact.elastic_plastic(1e10, yield_speed=0.1, mass=0.004)
        >>> wall, ball = fi.Modes.rigid(1e6), fi.Striker.rigid(0.004)
        >>> [round(fi.strike(wall, ball, law, at=None, speed=v).restitution, 3) for v in (0.1, 1.6, 25.6)]
        [1.0, 0.814, 0.538]
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
    remembers = hertzian = True
    slopes = ("stiffness", "exponent", *numbers)
    words = " that yields"

    def acts(self, contact: Any) -> bool:
        return bool(contact.exponent > 1.0)

    def force(self, contact: Any, pressed: np.ndarray) -> np.ndarray:
        return _course(contact, pressed)[0]

    def sunk(self, row: Any, memory: np.ndarray, left: np.ndarray) -> np.ndarray:
        deepest = np.maximum(np.abs(memory), row.yield_approach)
        force, _, _, wide = _course(row, deepest)
        return np.asarray(deepest - force / (row.stiffness * wide ** (row.exponent - 1.0)))

    def remembered(self, row: Any, memory: float, pressed: float, force: float, left: float) -> float:
        return max(memory, pressed) if force else memory

    def approach(self, contact: Any, force: float) -> float:
        k, a, first = contact.stiffness, contact.exponent, contact.yield_approach
        more = force - k * first**a
        if more <= 0.0:
            return super().approach(contact, force)

        def missed(x: np.ndarray) -> np.ndarray:
            reached, slope, _, _ = _course(contact, x)
            return (reached - force) / slope

        return float(_descended(np.asarray(first + more / (a * k * first ** (a - 1.0))), missed))

    def wide(self, contact: Any, approach: float) -> float:
        return float(_course(contact, approach)[3])

    def rebound(self, contact: Any, energy: float) -> float:
        """Restitution [-] of a body with this energy [J] on a rigid wall."""
        force, _, stored, wide = _course(contact, self.deepest(contact, np.asarray(energy)))
        back = force / (contact.stiffness * wide ** (contact.exponent - 1.0))
        return float(np.sqrt(force * back / ((contact.exponent + 1.0) * stored)))

    def deepest(self, row: Any, energy: np.ndarray) -> np.ndarray:
        k, a, first = row.stiffness, row.exponent, row.yield_approach
        elastic = ((a + 1.0) * energy / k) ** (1.0 / (a + 1.0))  # [m]
        force, steep = k * first**a, a * k * first ** (a - 1.0)
        further = np.maximum(energy - force * first / (a + 1.0), 0.0)

        def missed(x: np.ndarray) -> np.ndarray:
            reached, _, taken, _ = _course(row, x)
            return (taken - energy) / reached

        found = _descended(first + (np.sqrt(force * force + 2.0 * steep * further) - force) / steep, missed)
        return np.where(elastic > first, found, elastic)

    def steepest(self, row: Any, energy: np.ndarray) -> np.ndarray:
        deepest = self.deepest(row, energy)
        force, _, _, wide = _course(row, deepest)
        hard = row.stiffness * wide ** (row.exponent - 1.0)
        certain = force > LEAST_BACK * deepest * hard  # else rounding hides whether it has turned back
        return np.where(certain, row.exponent * hard, np.inf)  # as it unloads

    def sentence(self, contact: Any, si: Any) -> str:
        return f" Beyond {si(contact.yield_approach, 'm')} it yields and keeps a dent."


def _steeper(a: float) -> float:
    """How much steeper the force is far beyond first yield, over its slope there.

    That is 2 * 2.8 / 1.6 - 1 for round bodies: twice the area, under 2.8 instead of 1.6 times the yield strength. For
    other exponents it is only so chosen that the contact is never stiffer than an elastic one nor gives energy, and
    does not yield for a = 1.
    """
    return 10.0 * (a - 1.0) ** 2 / (a - 0.5)


steeper = inner()(_steeper)


def _descended(found: np.ndarray, missed: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Newton's method for an approach [m] from one along the tangent at first yield, too deep as force is convex."""
    for _ in range(20):  # 5 for round bodies, 12 for the exponent 100; test_plastic.py
        change = missed(found)
        found = found - change
        if (np.abs(change) <= 1e-9 * found).all():  # what is left is its square
            break
    return found


def _course(row: Any, pressed: Any) -> tuple[np.ndarray, ...]:
    """First pressed to these approaches [m]: force, its slope, the energy taken, and Hertz's approach of that area."""
    k, a, first = row.stiffness, row.exponent, row.yield_approach
    soft = np.minimum(pressed, first)
    beyond, reach, steep = pressed - soft, REACH * first, a * k * first ** (a - 1.0)
    gone = -np.expm1(-beyond / reach)
    plastic, more = beyond - reach * gone, _steeper(a)
    force = k * soft**a
    energy = force * (soft / (a + 1.0) + beyond)
    energy = energy + steep * (0.5 * (1.0 + more) * beyond**2 - more * reach * plastic)
    slope = np.where(beyond > 0.0, steep * (1.0 + more * gone), a * k * soft ** (a - 1.0))
    return force + steep * (beyond + more * plastic), slope, energy, pressed + plastic


@inner()
def exponential_parts(z):
    """``1 - exp(-z)``, what that lacks of z, and what this lacks of z**2 / 2, without cancellation, for z >= 0."""
    if z >= 1.0:
        one = -np.expm1(-z)
        return one, z - one, 0.5 * z * z - (z - one)
    term = z * z * z / 6.0
    three = term
    for n in range(4, 30):
        term *= -z / n
        three += term
        if abs(term) < 1e-17 * three:
            break
    two = 0.5 * z * z - three
    return z - two, two, three


@inner()
def pressed_to(law, i, memory):
    """Of contact i pressed as deep as it remembers, at least to first yield: force, slope, how much steeper it can
    become, and how far back it unloads."""
    k, a, first = law["stiffness"][i], law["exponent"][i], law["yield_approach"][i]
    steep = a * k * power(first, a - 1.0)
    if memory <= first:
        return k * power(first, a), steep, steeper(a) * steep, first
    reach = REACH * first
    gone, plastic, _ = exponential_parts((memory - first) / reach)
    more = steeper(a) * steep
    force = k * power(first, a) + steep * (memory - first) + more * reach * plastic
    back = force / (k * power(memory + reach * plastic, a - 1.0))
    return force, steep + more * gone, more * (1.0 - gone), back


@inner()
def spring(law, i, memory):
    """The spring of contact i that has been pressed as deep as it remembers, from its dent."""
    a = law["exponent"][i]
    force, hard, more, back = pressed_to(law, i, memory)
    k = law["stiffness"][i] if memory <= law["yield_approach"][i] else force / power(back, a)
    return Spring(
        k, a, law["loss"][i], law["compliance"][i], KIND, back, hard, 1.0, 0.0, 0.0,
        more, REACH * law["yield_approach"][i],
    )  # fmt: skip


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
    return memory - pressed_to(law, i, memory)[3]


@inner()
def pushed_beyond(x, spring):
    """Force and stored energy at a compression beyond the corner."""
    a, corner, further, reach = spring.exponent, spring.corner, x - spring.corner, spring.reach
    f = spring.stiffness * power(corner, a)
    _, two, three = exponential_parts(further / reach)
    more = spring.hard * further
    energy = f * corner / (a + 1.0) + further * (f + 0.5 * more) + spring.steeper * reach * reach * three
    return f + more + spring.steeper * reach * two, energy


@inner()
def slopes_beyond(small, large, spring):
    """Average slopes between two compressions beyond the corner."""
    reach, near, far = spring.reach, small - spring.corner, large - spring.corner
    f = spring.stiffness * power(spring.corner, spring.exponent)
    one, two, _ = exponential_parts(near / reach)
    z = (far - near) / reach
    if z <= 0.0:
        return f + spring.hard * near + spring.steeper * reach * two, spring.hard + spring.steeper * one
    _, later, last = exponential_parts(z)
    force = two + 0.5 * z * one + (1.0 - one) * last / z
    slope = spring.hard + spring.steeper * (one + (1.0 - one) * later / z)
    return f + 0.5 * spring.hard * (near + far) + spring.steeper * reach * force, slope


@inner()
def slope_beyond(x, spring):
    """Slope of the force at a compression beyond the corner."""
    return spring.hard - spring.steeper * np.expm1((spring.corner - x) / spring.reach)
