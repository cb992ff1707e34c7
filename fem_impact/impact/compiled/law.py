"""All contact laws, and what kernels ask of any: force and stored energy over the approach, and their average slopes.

A contact pushes with ``F = k x**a (1 + loss d')`` while its spring is compressed by ``x > 0``. A residual compliance
``c`` in series takes the rest of the approach, ``d = x + c F``. The stored energy is that of both springs,
``V = k x**(a+1) / (a+1) + c F**2 / 2``, so that ``V' = F`` along d without loss. The other laws of the folder `laws`
differ beyond a corner or remember (one number each, ``memory``); which kind of spring takes which course is said here.

A law is added by a file in that folder, a line in `LAWS` and in `Numbers`, and, where its force has a course of its own
beyond a corner, a branch in `spring_with`, `force_and_energy`, `steepness` and `part_slopes`.
"""

from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from .build import inner, outer
from .laws import felt, layers, plastic, tabled
from .laws.base import POWER, Law, LawNumber, Point
from .laws.felt import memory_energy, relaxes
from .laws.plastic import dent, yields
from .laws.power import PowerLaw, power, power_slopes, simple

LAWS: tuple[Law, ...] = (PowerLaw(), layers.LayersLaw(), plastic.PlasticLaw(), felt.FeltLaw(), tabled.TableLaw())
NUMBERS: dict[str, LawNumber] = {name: number for law in LAWS for name, number in law.numbers.items()}
MARKS = {law.mark: law for law in LAWS if law.mark}
# what kernels know of a contact: where a law has nothing of the kind, 0; the compliance in series [m/N], the kind,
# what it remembers, and the table of one of the user's own
NAMES = ("stiffness", "exponent", "loss", "compliance", "kind", *NUMBERS, "n_knots", "memory", "knots")
LAW = np.dtype([(name, float, tabled.TABLE if name == "knots" else ()) for name in NAMES])
NOTHING = (0.0,) * (len(NAMES) - 3)  # of a power law, behind stiffness, exponent and loss
Row: Any = partial(namedtuple, "Row")(NAMES)  # one contact of such an array, in Python


@dataclass(frozen=True)
class Numbers(tabled.TableNumbers, felt.FeltNumbers, plastic.PlasticNumbers, layers.LayersNumbers):
    """The numbers of all laws and their methods; bases last to first, as fields come in the order of `LAWS`."""


def law_of(contact: Any) -> Law:
    """The law that a `Contact` or a row follows."""
    for mark, law in MARKS.items():
        if getattr(contact, mark):
            return law
    return LAWS[0]


def row_of(contact: Any) -> Any:
    """The `Row` of a `Contact`: of the numbers of laws, those of its own if it is more than a power law."""
    law = law_of(contact)
    if not law.acts(contact):
        return Row(contact.stiffness, contact.exponent, contact.loss, *NOTHING)
    own = [getattr(contact, name) if name in law.numbers else 0.0 for name in NUMBERS]
    knots = law.table(contact)
    return Row(contact.stiffness, contact.exponent, contact.loss, 0.0, law.kind, *own, contact.n_knots, 0.0, knots)


def columns(values: np.ndarray) -> np.ndarray:
    """The numbers of contacts as a plain array (..., n_numbers) that shares their memory; any other array as it is."""
    return values.view(float).reshape(*values.shape, -1) if values.dtype == LAW else values


def table(rows: Sequence[Sequence[float]]) -> np.ndarray:
    """Contacts (n_contacts,) as kernels read them; rows may end early, with zeros to follow."""
    found = np.zeros(len(rows), LAW)
    for i, row in enumerate(rows):
        found[i] = (*row, *[0.0] * (len(NAMES) - len(row)))
    return found


@inner()
def spring_of(law, i):
    """The spring of contact i of a law (n_contacts,) with the numbers `NAMES`, as it is now."""
    return spring_with(law, i, law["memory"][i])


@inner()
def special_of(law):
    """Whether some contact is more than a power law, and whether some force has corners in between."""
    special = cornered = False
    for i in range(law.shape[0]):
        if law["kind"][i] != POWER:
            special = True
        if law["loss"][i] > 0.0:
            cornered = True
    return special, special or cornered


@inner()
def spring_with(law, i, memory):
    """The same if it remembers another number."""
    kind = law["kind"][i]
    if kind == felt.KIND:
        return felt.spring(law, i, memory)
    if kind == layers.KIND:
        return layers.spring(law, i)
    if kind == plastic.KIND:
        return plastic.spring(law, i, memory)
    if kind == tabled.KIND:
        return tabled.spring(law, i)
    return simple(law["stiffness"][i], law["exponent"][i], law["loss"][i], law["compliance"][i])


@inner()
def force_and_energy(x, spring):
    """Force and stored energy at a compression x > 0, without the compliance in series."""
    if x <= spring.corner:
        f = spring.stiffness * power(x, spring.exponent)
        return f, f * x / (spring.exponent + 1.0)
    if spring.kind == tabled.KIND:
        return tabled.pushed_beyond(x, spring)
    return plastic.pushed_beyond(x, spring) if spring.kind == plastic.KIND else layers.pushed_beyond(x, spring)


@inner()
def steepness(x, f, spring):
    """Slope of the force f over the compression x > 0."""
    if x <= spring.corner:
        return spring.exponent * f / x
    if spring.kind == tabled.KIND:
        return tabled.slope_beyond(x, spring)
    return plastic.slope_beyond(x, spring) if spring.kind == plastic.KIND else layers.slope_beyond(x, spring)


@inner()
def with_compliance(steep, spring):
    """Slope of the force over the approach [N/m], from that over the compression."""
    return steep / (1.0 + spring.compliance * steep)


@inner()
def compression(d, spring):
    """Compression of the spring at approach d > 0: Newton's method on ``x + c F = d``, kept between bounds."""
    k, a, c = spring.stiffness, spring.exponent, spring.compliance
    if c == 0.0:
        return d
    if a == 1.0 and d <= spring.corner:
        return d / (1.0 + k * c)
    low = 0.0
    high = d
    x = min(d, (d / (k * c)) ** (1.0 / a))
    for _ in range(200):
        f, _ = force_and_energy(x, spring)
        r = x + c * f - d
        if r > 0.0:
            high = x
        else:
            low = x
        new = x - r / (1.0 + c * steepness(x, f, spring))
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 2e-16 * x:
            return new
        x = new
    return x


@inner()
def point_when_compressed(x, spring):
    """The spring at a given compression."""
    if x <= 0.0:
        return Point(x, x, 0.0, 0.0)
    f, energy = force_and_energy(x, spring)
    return Point(x + spring.compliance * f, x, f, energy + 0.5 * spring.compliance * f * f)


@inner()
def point_at(d, spring):
    """The spring at a given approach."""
    if d <= 0.0:
        return Point(d, d, 0.0, 0.0)
    point = point_when_compressed(compression(d, spring), spring)
    return Point(d, point.compression, point.force, point.energy)


@inner()
def part_slopes(small, large, spring):
    """Average slopes of energy and force between two compressions > 0 on one side of the corner."""
    if large <= spring.corner:
        return power_slopes(spring.stiffness, spring.exponent, small, large)
    if spring.kind == tabled.KIND:
        return tabled.slopes_beyond(small, large, spring)
    if spring.kind == plastic.KIND:
        return plastic.slopes_beyond(small, large, spring)
    return layers.slopes_beyond(small, large, spring)


@inner()
def mean_slopes(one, two, spring):
    """Average slopes between two points: energy over approach (G) and force over approach (D), without cancellation."""
    if one.approach <= 0.0 or two.approach <= 0.0:
        if one.approach <= 0.0 and two.approach <= 0.0:
            return 0.0, 0.0
        span = two.approach - one.approach
        return (two.energy - one.energy) / span, (two.force - one.force) / span
    c = spring.compliance
    small, large = min(one.compression, two.compression), max(one.compression, two.compression)
    bend = spring.corner
    if large <= bend or small >= bend:
        g, d = part_slopes(small, large, spring)
    else:
        below, above, span = bend - small, large - bend, large - small
        g0, d0 = part_slopes(small, bend, spring)
        g1, d1 = part_slopes(bend, large, spring)
        g, d = (g0 * below + g1 * above) / span, (d0 * below + d1 * above) / span
    return (g + 0.5 * c * (one.force + two.force) * d) / (1.0 + c * d), d / (1.0 + c * d)


@inner()
def corner_approach(spring):
    """Approach at the corner of a spring; infinite if it has none."""
    if spring.corner == np.inf:
        return np.inf
    return spring.corner + spring.compliance * spring.stiffness * power(spring.corner, spring.exponent)


@inner()
def harden(law, i, approach):
    """Remember how deep a plastic contact is pressed at an approach [m] from its dent; how much the dent grows [m]."""
    if not yields(law, i) or approach <= 0.0:
        return 0.0
    spring = spring_of(law, i)
    x = compression(approach, spring)
    if x <= spring.corner:
        return 0.0
    before = dent(law, i, law["memory"][i])
    law["memory"][i] = before + x
    return dent(law, i, law["memory"][i]) - before


@outer()
def stored_energies(approach, law):
    """Energy that contacts store at approaches from their dents (n_contacts,) [m]; felt never less than by itself."""
    total = 0.0
    for i in range(law.shape[0]):
        z, x = abs(law["memory"][i]), approach[i]
        if relaxes(law, i):
            x = max(max(0.0, x), felt.surface(law, i, z))
        spring = spring_with(law, i, z)
        total += point_at(x, spring).energy
        if relaxes(law, i):
            total += memory_energy(x, z, spring)
    return total


@outer()
def dents(law):
    """Dent of every contact as it is now, (n_contacts,) [m]."""
    result = np.empty(law.shape[0])
    for i in range(law.shape[0]):
        result[i] = dent(law, i, law["memory"][i])
    return result


@outer()
def yielded_energy(law):
    """Energy that yielding took from all contacts so far [J]: what it cost to press them, less what comes back."""
    total = 0.0
    for i in range(law.shape[0]):
        deepest = law["memory"][i]
        if yields(law, i) and deepest > law["yield_approach"][i]:
            whole = force_and_energy(deepest, spring_with(law, i, 0.0))[1]
            total += whole - force_and_energy(deepest - dent(law, i, deepest), spring_of(law, i))[1]
    return total
