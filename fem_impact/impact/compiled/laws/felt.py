"""Felt that remembers: ``F = k (x**a - share z)``, ``tau z' = x**a - z`` (Stulov 1995, J. Acoust. Soc. Am. 97, 2577).

It stores ``k (x**(a+1) / (a+1) - share z x + share a / (a+1) z**(1 + 1/a))`` and loses ``k share (x - z**(1/a)) z'``,
never less than nothing. Where the force would pull, body and felt part, and the felt recovers on its own along
``x**a = share z``. A contact from which the body has parted carries a minus before its memory.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from ..build import inner
from ..rounding import NEAR
from .base import Law, LawNumber, Spring
from .power import PowerNumbers, power, simple, wall_time

KIND = 3.0


@dataclass(frozen=True)
class FeltNumbers(PowerNumbers):
    """The numbers of its memory."""

    hysteresis: float = 0.0  # [-] the share of the force that felt loses if it is held pressed; 0: it is no felt
    relaxation: float = 0.0  # [s] time in which felt loses it

    @classmethod
    def felt(cls, stiffness: float, exponent: float, *, hysteresis: float, relaxation: float, gap: float = 0.0) -> Self:
        """Felt that remembers: ``F = stiffness (d**exponent - hysteresis z)``, ``relaxation z' = d**exponent - z``.

        Pressed much faster than it relaxes it has the full stiffness, much more slowly the share 1 - hysteresis of it.
        The force never pulls: where it would, the felt stays behind and recovers on its own.

        Parameters
        ----------
        stiffness : float [N/m**exponent]
        exponent : float [-]
        hysteresis : float [-]
            From 0 to 1.
        relaxation : float [s]

        References
        ----------
        Stulov (1995), J. Acoust. Soc. Am. 97, 2577-2585.

        Examples
        --------
        >>> felt = fi.Contact.felt(1e10, 2.5, hysteresis=0.4, relaxation=1e-3)
        >>> hit = fi.strike(fi.Modes.rigid(1e3), fi.Striker.rigid(0.01), felt, at=None, speed=2.0)
        >>> 0.0 < hit.restitution < 1.0
        True
        """
        return cls(stiffness, exponent, gap=gap, hysteresis=hysteresis, relaxation=relaxation)


class FeltLaw(Law):
    """Felt that remembers."""

    kind = KIND
    name = "felt"
    mark = "hysteresis"
    numbers: ClassVar = {
        "hysteresis": LawNumber(
            "", "share of the force that felt loses", "share of the force that a slow blow loses", most=1.0
        ),
        "relaxation": LawNumber("s", "relaxation time of felt", "time in which the felt relaxes"),
    }
    keys: ClassVar = {"exponent": LawNumber("", "", "", 1.0, 100.0)}
    remembers = rated = True
    words = " felt"

    def check(self, contact: Any) -> None:
        super().check(contact)
        if not contact.relaxation:
            raise ValueError("relaxation must be positive for felt with hysteresis, got 0 s")

    def acting(self, row: Any, mobility: Any, speed: Any) -> np.ndarray:
        whole = np.asarray(row.stiffness)
        for _ in range(4):
            time = wall_time(whole, row.exponent, mobility, speed)
            whole = row.stiffness * (row.relaxation + (1.0 - row.hysteresis) * time) / (row.relaxation + time)
        return whole

    def sunk(self, row: Any, memory: np.ndarray, left: np.ndarray) -> np.ndarray:
        rate = (1.0 - row.hysteresis) / row.relaxation
        return np.asarray((row.hysteresis * np.abs(memory * np.exp(-rate * left))) ** (1.0 / row.exponent))

    def remembered(self, row: Any, memory: float, pressed: float, force: float, left: float) -> float:
        if force:
            return max(0.0, float(pressed**row.exponent - force / row.stiffness) / row.hysteresis)
        return -abs(memory) * float(np.exp(-(1.0 - row.hysteresis) * left / row.relaxation))

    def sentence(self, contact: Any, si: Any) -> str:
        time = si(contact.relaxation, "s")
        return f" It is felt: held pressed, it loses {contact.hysteresis:.0%} of its force in some {time}."


@inner()
def spring(law, i, memory):
    """The spring of contact i that remembers this; without stiffness if the body has parted from it."""
    k, a, loss, c = law["stiffness"][i], law["exponent"][i], law["loss"][i], law["compliance"][i]
    if memory < 0.0:
        return simple(0.0, a, 0.0, c)
    return Spring(k, a, loss, c, KIND, np.inf, k * law["hysteresis"][i], 1.0, law["relaxation"][i], memory, 0.0, 0.0)


@inner()
def relaxes(law, i):
    """Whether what contact i remembers fades."""
    return law["relaxation"][i] > 0.0


@inner()
def memory_weights(x):
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
def memory_within_step(h, part, g0, g1, r0, r1, spring):
    """What felt remembers at a part of a step in which ``x**a`` is the cubic with these ends and rates.

    Returns it at that time and in the mean until then, each with what a unit of r1 adds.
    """
    x = part * h / spring.relaxation
    j0, j1, j2, j3, j4 = memory_weights(x)
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
def faded_memory(law, i, time):
    """What felt i remembers after a time without force."""
    share = law["hysteresis"][i]
    return -abs(law["memory"][i]) * np.exp(-(1.0 - share) * time / law["relaxation"][i])


@inner()
def rest_of(law, i, time):
    """Let the memory of felt fade for a time without force."""
    if relaxes(law, i):
        law["memory"][i] = faded_memory(law, i, time)


@inner()
def stay_parted(law, i, approach):
    """Let felt that a body has parted from reach to the body at most, as a run starts where doubts have moved both."""
    if relaxes(law, i) and law["memory"][i] < 0.0 and parting(law, i, approach, law["memory"][i]) > 0.0:
        law["memory"][i] = -power(approach, law["exponent"][i]) / law["hysteresis"][i]


@inner()
def surface(law, i, memory):
    """Approach at which felt i pushes from, as far as it is still pressed in [m]."""
    return (law["hysteresis"][i] * memory) ** (1.0 / law["exponent"][i]) if memory > 0.0 else 0.0


@inner()
def parting(law, i, approach, memory):
    """``x**a - share z`` of felt: positive where it pushes."""
    g = power(approach, law["exponent"][i]) if approach > 0.0 else 0.0
    return g - law["hysteresis"][i] * abs(memory)


@inner()
def parting_rate(law, i, approach, rate, memory):
    """How fast that changes at an approach > 0 [m**a/s]; a minus before the memory is of a body that has parted."""
    share, g = law["hysteresis"][i], power(approach, law["exponent"][i])
    grows = (share - 1.0) * -memory if memory < 0.0 else g - memory
    return law["exponent"][i] * g / approach * rate - share * grows / law["relaxation"][i]


@inner()
def above_felt(law, i, d, v, memory, parted):
    """Approach over that at which felt i releases the body or is met, and its rate; it may have ``parted`` from it."""
    z = abs(memory)
    if z == 0.0:
        return d, v
    a, pressed_in = law["exponent"][i], surface(law, i, z)
    grows = -(1.0 - law["hysteresis"][i]) * z if parted else (power(d, a) if d > 0.0 else 0.0) - z
    return d - pressed_in, v - pressed_in * grows / (a * z * law["relaxation"][i])


@inner()
def meet(law, i, approach, rate):
    """Decide whether a body pushes felt i at the start of a step or has parted from it."""
    if not relaxes(law, i):
        return
    z, a, share = abs(law["memory"][i]), law["exponent"][i], law["hysteresis"][i]
    over = parting(law, i, approach, z)
    rises = over > 0.0
    if abs(over) <= NEAR * share * z:
        grows = a * power(approach, a) / approach * rate if approach > 0.0 else 0.0
        rises = grows >= -(1.0 - share) * share * z / law["relaxation"][i]  # how the felt recovers on its own
    law["memory"][i] = z if rises else -z
