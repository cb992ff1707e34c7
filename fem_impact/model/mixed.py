"""A plate as its modes up to a frequency and as an infinite plate above it, from where no echo comes back.

A hard tip on a thin plate needs two clocks: the force rises within the contact stiffness times the mobility of the
plate, often less than a microsecond, and then lasts as long as the striker takes to slow down, its mass times the
mobility, until waves return from the edges. Modes for both may be millions. But above some frequency the edges hardly
answer: short waves come back late, spread out and average out over the contact.

The squared shapes of a wide plate per unit omega are constant, ``2 Y / pi`` with the mobility ``Y``, so that

    Y = (2 Y / pi) int_0^inf i omega / (w**2 - omega**2) dw

and damping that grows with the frequency does not change this by more than a factor,

    int_0^inf i omega / (w**2 + 2 i zeta w omega - omega**2) dw = arccos(zeta) / sqrt(1 - zeta**2),

which a sum over frequencies in a geometric sequence gives up to a ripple of ``2 exp(-2 pi arcsin(zeta) / ratio)``. Such
a sequence from a frequency upwards absorbs what enters it. The real part of its mobility rises from zero to ``Y`` near
that frequency, and the modes of the plate keep the rest of their squared shapes, one minus that part over ``Y``. Causal
responses with the same real part are the same: until the first echo, both together are the infinite plate exactly, and
of every echo only that fraction is lost. A blow with half the frequency (`Modes.poorer`) shows what this costs.

References
----------
Cremer, Heckl and Petersson, Structure-Borne Sound, 3rd ed. (2005), section 5.3, for the mobility; Landau and Lifshitz,
Statistical Physics, part 1, section 123, for causal responses.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ..modes.modal import Modes, carried_compliance
from ..modes.shapes import SampledShapes

# [rad] its sine is the damping ratio above the frequency; modes fade over so much: half takes twice the oscillators
ANGLE = 0.05
RATIO = ANGLE / 1.5  # [-] between neighbouring frequencies, less one: a ripple of 2e-4
REACH = 2.0  # [-] the modes are needed up to this multiple of the frequency, where they keep 1 % of their squared shape
# [-] finite elements resolve waves of so many times the frequency: room for a second, higher frequency on that mesh
RESOLVED = 1.25
# [-] duration of the blow to be expected, over mass times mobility: exp(-15) = 3e-7 of the speed is left then
LASTING = 15.0


def first_frequency(mass: float, mobility: float, echo: float, duration: float) -> float:
    """Frequency [Hz] to begin with, for a striker [kg], a plate's mobility [m/(N s)] and contact time on a wall [s].

    ``echo`` [s] is the squared distance of the nearest edge over sqrt(rigidity / mass per area): times omega, the phase
    of an echo. Five times the rate at which the striker slows down: above, a force hardly changes its speed. But the
    first echo turns by 10 rad at least, a turn and a half: the plate is wider than the wave is long.
    """
    return max(5.0 / max(mass * mobility, duration), 10.0 / echo) / (2.0 * np.pi)


def absorbing_oscillators(mobility: float, frequency: float, highest: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Oscillators that stand for an infinite plate between two frequencies [Hz].

    Returns their angular frequencies (n,) [rad/s], shapes (n,) [kg**-0.5] and the compliance [m/N] of what lies above.
    """
    number = max(1, int(np.ceil(np.log(highest / frequency) / RATIO)))
    omega = 2.0 * np.pi * frequency * np.exp(RATIO * (np.arange(number) + 0.5))
    dense = mobility * np.cos(ANGLE) / (0.5 * np.pi - ANGLE)  # squared shapes per frequency; above, they act as springs
    return omega, np.sqrt(dense * RATIO * omega), float(dense / (omega[-1] * np.exp(0.5 * RATIO)))


def kept_share(omega: np.ndarray, mobility: float, above: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Share (n_modes,) of their squared shapes that modes keep beside oscillators of these frequencies and shapes."""
    damped = 2.0 * np.sin(ANGLE) * above  # [rad/s]
    taken = [
        (shape**2 / mobility * damped * x**2 / ((above**2 - x**2) ** 2 + (damped * x) ** 2)).sum(axis=1)
        for x in np.array_split(omega[:, None], 1 + len(omega) // 2000)  # to limit the memory
    ]
    return np.clip(1.0 - np.concatenate(taken), 0.0, 1.0)


def mixed_plate(modes: Modes, at: Any, mobility: float, frequency: float, highest: float) -> Modes:
    """A plate by its modes below a frequency [Hz] and as an infinite one above it, as struck at a point (2,) [m].

    ``modes`` are all up to `REACH` times the frequency, ``mobility`` [m/(N s)] is that of the infinite plate, which
    acts as a spring above a ``highest`` frequency [Hz]; echoes are left out above the first one. `Modes.poorer` holds
    the same of poorer descriptions, and for half the frequency, so that a blow states the error of the echoes left out.
    """
    point = modes.point("at", at)
    found = _mixed(modes, point, mobility, frequency, highest)
    half = _mixed(replace(modes, poorer={}), point, mobility, 0.5 * frequency, highest)
    return replace(found, poorer={**found.poorer, "idealisation": half})


def _mixed(modes: Modes, point: np.ndarray, mobility: float, frequency: float, highest: float) -> Modes:
    poorer = {cause: _mixed(other, point, mobility, frequency, highest) for cause, other in modes.poorer.items()}
    modes = replace(modes, poorer={}).truncated(max_frequency=max(REACH * frequency, float(modes.frequencies[0])))
    above, shape, rest = absorbing_oscillators(mobility, frequency, highest)
    rows = modes.shapes.at(point)[0] * np.sqrt(kept_share(modes.omega, mobility, above, shape))
    omega, rows = np.append(modes.omega, above), np.append(rows, shape)
    ratio = np.append(modes.damping_ratio, np.full(len(above), np.sin(ANGLE)))
    error = None if modes.frequency_error is None else np.append(modes.frequency_error, np.zeros(len(above)))
    order = np.argsort(omega, kind="stable")
    shapes = SampledShapes(point, rows[order][None], carried_compliance(omega, rows[None], rows[None]) + rest)
    return Modes(
        omega[order], ratio[order], shapes, modes.mass, None if error is None else error[order], notes=modes.notes,
        poorer=poorer,
    )  # fmt: skip
