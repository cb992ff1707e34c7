"""The contact law: force and stored energy over the approach, and their average slopes between two approaches.

A contact pushes with ``F = k x**a (1 + loss d')`` while its spring is compressed by ``x > 0``. A residual compliance
``c`` in series takes the rest of the approach, ``d = x + c F``. The stored energy is that of both springs,
``V = k x**(a+1) / (a+1) + c F**2 / 2``, so that ``V' = F`` along d without loss. Three kinds differ beyond a corner or
remember (one number each, ``memory``):

* LAYERS: beyond ``depth`` a second, harder spring adds ``k2 (x - depth)**a2``. Nothing is lost.
* PLASTIC: beyond first yield, or beyond the deepest compression so far, the force goes on along the tangent of the
  elastic curve at first yield. The memory is that deepest compression ``m``. From there the contact unloads along
  ``F = F_m ((x - dent) / x_e)**a`` with ``x_e = F_m / (k m**(a-1))`` and ``dent = m - x_e``. That is Thornton's law
  (1997, J. Appl. Mech. 64, 383) for a = 1.5. At each moment it is the potential of a spring with a corner, at rest at
  the dent: what yielding takes is the difference of two such potentials.
* FELT: ``F = k (x**a - share z)`` with the memory ``tau z' = x**a - z`` (Stulov 1995, J. Acoust. Soc. Am. 97, 2577).
  It stores ``k (x**(a+1) / (a+1) - share z x + share a / (a+1) z**(1 + 1/a))`` and loses
  ``k share (x - z**(1/a)) z'``, never less than nothing. Where the force would pull, body and felt part, and the felt
  recovers on its own along ``x**a = share z``.

The energy-exact schemes need the average slopes ``G = (V1 - V0) / (d1 - d0)`` and ``D = (F1 - F0) / (d1 - d0)`` to full
precision for close approaches, where the differences cancel: `slopes` forms them from x without subtracting.
"""

from typing import NamedTuple

import numpy as np

from .build import inner, outer
from .rounding import NEAR

from .layout import (  # isort: skip
    COMPLIANCE, DEPTH, EXPONENT, FIRST_YIELD, HARD, HARD_EXPONENT, KIND, LOSS, MEMORY, RELAXATION, SHARE, STIFFNESS,
    WIDTH,
)  # fmt: skip

POWER, LAYERS, PLASTIC, FELT = 0.0, 1.0, 2.0, 3.0  # kinds of law


class Spring(NamedTuple):
    """One contact as it is now; a plastic one measured from its dent."""

    stiffness: float  # [N/m**exponent]
    exponent: float  # [-]
    loss: float  # [s/m]
    compliance: float  # [m/N] in series
    kind: float  # [-]
    corner: float  # [m] compression from which the force takes another course; infinite if none
    hard: float  # [N/m**hard_exponent] stiffness of what the force gains from there; of felt, what the memory takes
    hard_exponent: float  # [-]
    relaxation: float  # [s] of felt
    memory: float  # [m**exponent] of felt


class Point(NamedTuple):
    """A contact's spring at one approach."""

    approach: float  # [m]
    compression: float  # [m]
    force: float  # [N] elastic
    energy: float  # [J]


@inner()
def simple(k, a, loss, c):
    """The spring of a power law."""
    return Spring(k, a, loss, c, POWER, np.inf, 0.0, 1.0, 0.0, 0.0)


@inner()
def spring_of(law, i):
    """Contact i of a law (n_contacts, 9 or 4): stiffness, exponent, loss, compliance, kind, three numbers, memory.

    The three are depth, stiffness and exponent of the hard layer; compression at first yield; share and time of felt.
    Felt from which the body has parted carries a minus before its memory: a spring without stiffness.
    """
    if law.shape[1] < WIDTH or law[i, KIND] == POWER:
        return simple(law[i, STIFFNESS], law[i, EXPONENT], law[i, LOSS], law[i, COMPLIANCE])
    return spring_with(law, i, law[i, MEMORY])


@inner()
def special_of(law):
    """Whether some contact is more than a power law, and whether some force has corners in between."""
    special = False
    cornered = False
    for i in range(law.shape[0]):
        if law.shape[1] == WIDTH and law[i, KIND] != POWER:
            special = True
        if law[i, LOSS] > 0.0:
            cornered = True
    return special, special or cornered


@inner()
def spring_with(law, i, memory):
    """The same if it remembers another number."""
    k, a, loss, c = law[i, STIFFNESS], law[i, EXPONENT], law[i, LOSS], law[i, COMPLIANCE]
    if law.shape[1] < WIDTH or law[i, KIND] == POWER:
        return simple(k, a, loss, c)
    if law[i, KIND] == FELT:
        if memory < 0.0:
            return simple(0.0, a, 0.0, c)
        return Spring(k, a, loss, c, FELT, np.inf, k * law[i, SHARE], 1.0, law[i, RELAXATION], memory)
    if law[i, KIND] == LAYERS:
        return Spring(k, a, loss, c, LAYERS, law[i, DEPTH], law[i, HARD], law[i, HARD_EXPONENT], 0.0, 0.0)
    first = law[i, FIRST_YIELD]
    steep = a * k * power(first, a - 1.0)
    deepest = max(memory, first)
    if deepest == first:
        return Spring(k, a, loss, c, PLASTIC, first, steep, 1.0, 0.0, 0.0)
    force = k * power(first, a) + steep * (deepest - first)
    back = force / (k * power(deepest, a - 1.0))
    return Spring(force / power(back, a), a, loss, c, PLASTIC, back, steep, 1.0, 0.0, 0.0)


@inner()
def dent(law, i, memory):
    """How far the surface of contact i is lower than at first [m], from what it remembers."""
    if law.shape[1] < WIDTH or law[i, KIND] != PLASTIC or memory <= law[i, FIRST_YIELD]:
        return 0.0
    a, first = law[i, EXPONENT], law[i, FIRST_YIELD]
    return memory - power(first / memory, a - 1.0) * (a * memory - (a - 1.0) * first)


@inner()
def power(x, exponent):
    """x**exponent for x > 0 without the general power where a root will do."""
    if exponent == 1.0:
        return x
    if exponent == 1.5:
        return x * np.sqrt(x)
    return x**exponent


@inner()
def pushed(x, spring):
    """Force and stored energy at a compression x > 0, without the compliance in series."""
    k, a, corner = spring.stiffness, spring.exponent, spring.corner
    if x <= corner:
        f = k * power(x, a)
        return f, f * x / (a + 1.0)
    further = x - corner
    if spring.kind == PLASTIC:
        f = k * power(corner, a)
        more = spring.hard * further
        return f + more, f * corner / (a + 1.0) + further * (f + 0.5 * more)
    f = k * power(x, a)
    more = spring.hard * power(further, spring.hard_exponent)
    return f + more, f * x / (a + 1.0) + more * further / (spring.hard_exponent + 1.0)


@inner()
def steepness(x, f, spring):
    """Slope of the force f over the compression x > 0."""
    if x <= spring.corner:
        return spring.exponent * f / x
    if spring.kind == PLASTIC:
        return spring.hard
    further = x - spring.corner
    more = spring.hard * power(further, spring.hard_exponent)
    return spring.exponent * (f - more) / x + spring.hard_exponent * more / further


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
        f, _ = pushed(x, spring)
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
def compressed(x, spring):
    """The spring at a given compression."""
    if x <= 0.0:
        return Point(x, x, 0.0, 0.0)
    f, energy = pushed(x, spring)
    return Point(x + spring.compliance * f, x, f, energy + 0.5 * spring.compliance * f * f)


@inner()
def at(d, spring):
    """The spring at a given approach."""
    if d <= 0.0:
        return Point(d, d, 0.0, 0.0)
    point = compressed(compression(d, spring), spring)
    return Point(d, point.compression, point.force, point.energy)


@inner()
def power_slopes(k, a, x0, x1):
    """Average slopes of ``k x**(a+1) / (a+1)`` and ``k x**a`` between two compressions > 0."""
    if a == 1.0:
        return 0.5 * k * (x0 + x1), k
    if a == 1.5:
        r0 = np.sqrt(x0)
        r1 = np.sqrt(x1)
        g = 0.4 * k * (x1 * x1 + x1 * r1 * r0 + x1 * x0 + r1 * r0 * x0 + x0 * x0) / (r0 + r1)
        return g, k * (x0 + r0 * r1 + x1) / (r0 + r1)
    small = min(x0, x1)
    large = max(x0, x1)
    r = (large - small) / (large + small)
    if r < 1e-4:
        mid = 0.5 * (large + small)
        f = k * mid**a
        g = f * (1.0 + a * (a - 1.0) / 6.0 * r * r)
        return g, a * f / mid * (1.0 + (a - 1.0) * (a - 2.0) / 6.0 * r * r)
    f = k * large**a
    if small < 1e-17 * large:
        return f / (a + 1.0), f / large
    log = np.log1p((small - large) / large)
    return f / (a + 1.0) * np.expm1((a + 1.0) * log) / np.expm1(log), f / large * np.expm1(a * log) / np.expm1(log)


@inner()
def cornered_slopes(x0, x1, spring):
    """Average slopes between two compressions > 0, of which at least one is beyond the corner."""
    k, a, corner, hard = spring.stiffness, spring.exponent, spring.corner, spring.hard
    small = min(x0, x1)
    large = max(x0, x1)
    further = large - corner
    if spring.kind == PLASTIC:
        f = k * power(corner, a)
        if small >= corner:
            return f + 0.5 * hard * (further + small - corner), hard
        g, d = power_slopes(k, a, small, corner)
        span = large - small
        g = (g * (corner - small) + (f + 0.5 * hard * further) * further) / span
        return g, (d * (corner - small) + hard * further) / span
    g, d = power_slopes(k, a, small, large)
    if small > corner:
        more, steeper = power_slopes(hard, spring.hard_exponent, small - corner, further)
        return g + more, d + steeper
    more = hard * power(further, spring.hard_exponent)
    return g + more * further / ((spring.hard_exponent + 1.0) * (large - small)), d + more / (large - small)


@inner()
def slopes(one, two, spring):
    """Average slopes between two points: energy over approach (G) and force over approach (D), without cancellation."""
    if one.approach <= 0.0 or two.approach <= 0.0:
        if one.approach <= 0.0 and two.approach <= 0.0:
            return 0.0, 0.0
        span = two.approach - one.approach
        return (two.energy - one.energy) / span, (two.force - one.force) / span
    c = spring.compliance
    x0, x1 = one.compression, two.compression
    if max(x0, x1) <= spring.corner:
        g, d = power_slopes(spring.stiffness, spring.exponent, x0, x1)
    else:
        g, d = cornered_slopes(x0, x1, spring)
    return (g + 0.5 * c * (one.force + two.force) * d) / (1.0 + c * d), d / (1.0 + c * d)


@inner()
def smooth_force(x, v, spring):
    """Force of a pressed contact and its slopes in compression and rate, continued smoothly below zero compression.

    A spring with a corner is taken on the far side of it, also continued; see `near_side`.
    """
    a = spring.exponent
    size = abs(x)
    f = spring.stiffness * power(size, a) if size > 0.0 else 0.0
    slope = spring.stiffness if a == 1.0 else (a * f / size if size > 0.0 else 0.0)
    if x < 0.0:
        f = -f
    if spring.kind == PLASTIC:
        f = spring.stiffness * power(spring.corner, a) + spring.hard * (x - spring.corner)
        slope = spring.hard
    elif spring.kind == LAYERS:
        further = abs(x - spring.corner)
        if further > 0.0:
            more = spring.hard * power(further, spring.hard_exponent)
            f += more if x > spring.corner else -more
            slope += spring.hard_exponent * more / further
    factor = 1.0 + spring.loss * v
    if factor < 0.0:
        return 0.0, 0.0, 0.0
    return f * factor, slope * factor, f * spring.loss


@inner()
def near_side(spring):
    """The spring as it is below its corner."""
    return simple(spring.stiffness, spring.exponent, spring.loss, spring.compliance)


@inner()
def corner_approach(spring):
    """Approach at the corner of a spring; infinite if it has none."""
    if spring.corner == np.inf:
        return np.inf
    return spring.corner + spring.compliance * spring.stiffness * power(spring.corner, spring.exponent)


@inner()
def harden(law, i, approach):
    """Remember how deep a plastic contact is pressed at an approach [m] from its dent; how much the dent grows [m]."""
    if law.shape[1] < WIDTH or law[i, KIND] != PLASTIC or approach <= 0.0:
        return 0.0
    spring = spring_of(law, i)
    x = compression(approach, spring)
    if x <= spring.corner:
        return 0.0
    before = dent(law, i, law[i, MEMORY])
    law[i, MEMORY] = before + x
    return dent(law, i, law[i, MEMORY]) - before


@inner()
def lags(x):
    """Weights J_k, k = 0 .. 4, of time**k in a memory after x of its times: ``x int_0^1 s**k exp(-x (1-s)) ds``."""
    if x > 4.0:
        j0 = -np.expm1(-x)
        j1 = 1.0 - j0 / x
        j2 = 1.0 - 2.0 * j1 / x
        j3 = 1.0 - 3.0 * j2 / x
        return j0, j1, j2, j3, 1.0 - 4.0 * j3 / x
    term = 0.2 * x
    j4 = 0.0
    for j in range(6, 60):
        j4 += term
        term *= -x / j
        if abs(term) < 1e-18 * j4:
            break
    j3 = 0.25 * x * (1.0 - j4)
    j2 = x / 3.0 * (1.0 - j3)
    j1 = 0.5 * x * (1.0 - j2)
    return x * (1.0 - j1), j1, j2, j3, j4


@inner()
def soaked(h, part, g0, g1, r0, r1, spring):
    """What felt remembers at a part of a step in which ``x**a`` is the cubic with these ends and rates.

    Returns it at that time and in the mean until then, each with what a unit of r1 adds.
    """
    x = part * h / spring.relaxation
    j0, j1, j2, j3, j4 = lags(x)
    z0 = spring.memory
    b = part * h * r0
    c = part * part * (3.0 * (g1 - g0) - 2.0 * h * r0)
    d = part**3 * (2.0 * (g0 - g1) + h * r0)
    per_c = -h * part * part
    per_d = h * part**3
    gone = j0 / x if x > 0.0 else 1.0
    end = z0 * (1.0 - j0) + g0 * j0 + b * j1 + c * j2 + d * j3
    mean = z0 * gone + g0 * j1 + b * j2 / 2.0 + c * j3 / 3.0 + d * j4 / 4.0
    per_end = per_c * j2 + per_d * j3
    per_mean = per_c * j3 / 3.0 + per_d * j4 / 4.0
    return end + per_end * r1, mean + per_mean * r1, per_end, per_mean


@inner()
def growth(point, rate, spring):
    """``x**a`` of a felt's point, its rate, and that per rate of approach."""
    if point.compression <= 0.0:
        return 0.0, 0.0, 0.0
    g = point.force / spring.stiffness
    per = spring.exponent * g / point.compression
    return g, per * rate, per


@inner()
def memory_energy(x, z, spring):
    """What its memory adds to the elastic energy of felt at a compression [J]."""
    if z <= 0.0:
        return 0.0
    a = spring.exponent
    return spring.hard * (a / (a + 1.0) * z ** (1.0 + 1.0 / a) - z * x)


@inner()
def held(approach, law, i):
    """Energy that contact i stores at an approach from its dent [m]; felt never less than left to itself."""
    if law.shape[1] < WIDTH or law[i, KIND] != FELT:
        return at(approach, spring_of(law, i)).energy
    z = abs(law[i, MEMORY])
    spring = spring_with(law, i, z)
    x = max(0.0, approach)
    left = (law[i, SHARE] * z) ** (1.0 / spring.exponent) if z > 0.0 else 0.0
    x = max(x, left)
    return at(x, spring).energy + memory_energy(x, z, spring)


@inner()
def rest_of(law, i, time):
    """Let the memory of felt fade for a time without force."""
    if law.shape[1] == WIDTH and law[i, KIND] == FELT:
        law[i, MEMORY] = -abs(law[i, MEMORY]) * np.exp(-(1.0 - law[i, SHARE]) * time / law[i, RELAXATION])


@inner()
def parting(law, i, approach, memory):
    """``x**a - share z`` of felt: positive where it pushes."""
    g = power(approach, law[i, EXPONENT]) if approach > 0.0 else 0.0
    return g - law[i, SHARE] * abs(memory)


@inner()
def parting_rate(law, i, approach, rate, memory):
    """How fast that changes at an approach > 0 [m**a/s]; a minus before the memory is of a body that has parted."""
    share, g = law[i, SHARE], power(approach, law[i, EXPONENT])
    grows = (share - 1.0) * -memory if memory < 0.0 else g - memory
    return law[i, EXPONENT] * g / approach * rate - share * grows / law[i, RELAXATION]


@inner()
def meet(law, i, approach, rate):
    """Decide whether a body pushes felt i at the start of a step or has parted from it."""
    if law.shape[1] < WIDTH or law[i, KIND] != FELT:
        return
    z = abs(law[i, MEMORY])
    over = parting(law, i, approach, z)
    rises = over > 0.0
    if abs(over) <= NEAR * law[i, SHARE] * z:
        grows = law[i, EXPONENT] * power(approach, law[i, EXPONENT]) / approach * rate if approach > 0.0 else 0.0
        rises = (
            grows >= -(1.0 - law[i, SHARE]) * law[i, SHARE] * z / law[i, RELAXATION]
        )  # how the felt recovers on its own
    law[i, MEMORY] = z if rises else -z


@outer()
def stored(approach, law):
    """Energy that all contacts store at their approaches from their dents (n_contacts,) [m]."""
    total = 0.0
    for i in range(law.shape[0]):
        total += held(approach[i], law, i)
    return total


@outer()
def dents(law):
    """Dent of every contact as it is now, (n_contacts,) [m]."""
    result = np.empty(law.shape[0])
    for i in range(law.shape[0]):
        result[i] = dent(law, i, law[i, MEMORY]) if law.shape[1] == WIDTH else 0.0
    return result


@outer()
def yielded(law):
    """Energy that yielding took from all contacts so far [J]: what it cost to press them, less what comes back."""
    total = 0.0
    for i in range(law.shape[0]):
        if law.shape[1] == WIDTH and law[i, KIND] == PLASTIC and law[i, MEMORY] > law[i, FIRST_YIELD]:
            deepest = law[i, MEMORY]
            whole = pushed(deepest, spring_with(law, i, 0.0))[1]
            total += whole - pushed(deepest - dent(law, i, deepest), spring_of(law, i))[1]
    return total
