"""How many modes a blow needs for a given tolerance, and how long the contact lasts."""

from typing import Any

import numpy as np

from .._base import check
from ..modes.modal import Modes
from .contact import Contact, acting_stiffness, wall_time

SERIES_SHARE = 0.1  # [-] largest residual compliance times contact stiffness: above it, left-out modes shape the blow
LOSSY = 5.0  # [-] a lossy contact errs this many times more: one mode, not a spring, replaces the left-out modes
BAND = 4.0  # [-] kept modes reach at least this multiple of the contact frequency, however heavy the target


@check.typed
def contact_duration(contact: Contact, mass: float, speed: float) -> float:
    """Contact duration [s] of a rigid mass [kg] that hits a rigid wall at a speed [m/s], without loss or gap.

    Of a head of two layers, a contact that yields or felt, that of a power law which stands for it.
    """
    mass, speed = check.positive("mass", mass, "kg"), check.positive("speed", speed, "m/s")
    stiffness = acting_stiffness(contact.numbers, 1.0 / mass, speed)
    return float(wall_time(stiffness, contact.exponent, 1.0 / mass, speed))


def lasting_stiffness(duration: float, exponent: float, mass: float, speed: float) -> float:
    """Stiffness [N/m**exponent] of the power law in which a rigid mass has a `contact_duration` [s]."""
    return float((wall_time(1.0, exponent, 1.0 / mass, speed) / duration) ** (exponent + 1.0))


def contact_resonance(contact: Contact, mass: float, speed: float) -> float:
    """Contact resonance [Hz]: one over twice the `contact_duration`."""
    return 0.5 / contact_duration(contact, mass, speed)


def contact_swing(contact: Contact, mass: float, speed: float) -> float:
    """Frequency [rad/s] up to which a contact excites what it touches: its resonance, or that on its hard layer."""
    whole = 2.0 * np.pi * contact_resonance(contact, mass, speed)
    hard = contact.law.steepest(contact, np.asarray(0.5 * mass * speed**2)) if contact.hard_stiffness else 0.0
    return max(whole, float(np.sqrt(hard / mass)))


def number_of_modes(modes: Modes, frequency: float) -> float:
    """About how many modes a body has up to a frequency [Hz]; Weyl's law gives that on average, so a tenth is added."""
    return 1.1 * modes.n_modes * (frequency / modes.frequencies[-1]) ** (0.5 * modes.dimension)


def resonant_stiffness(mass: Any, resonance: Any) -> Any:
    """Stiffness [N/m] of the linear contact that gives a mass [kg] a contact resonance [Hz]."""
    return mass * (2.0 * np.pi * resonance) ** 2


@check.typed
def cutoff_frequency(modes: Modes, at: Any, *, contact: Contact, mass: float, speed: float, tolerance: float) -> float:
    """Frequency [Hz] up to which modes must be kept so that the force errs by less than a share of its peak.

    The residual compliance of a few ``modes`` at the point struck gives the density of the others; ``mass`` [kg] is
    that of the other body felt at its contact point. Meets three limits: `left_out_error`, SERIES_SHARE for the
    residual compliance, and BAND.
    """
    tolerance = check.positive("tolerance", tolerance)
    density, s = left_out_density(modes, modes.point("at", at))
    omega_0 = contact_swing(contact, mass, speed)
    return cutoff(density, s, omega_0, contact.exponent, mass, tolerance)


def cutoff(density: float, s: float, omega_0: float, exponent: float, mass: float, tolerance: float) -> float:
    """As `cutoff_frequency`, for a contact frequency [rad/s] and a density as of `left_out_density`."""
    power, factor = order_of(exponent)
    # compliance beyond omega_0 over the contact's
    soft = mass * omega_0**2 * density / ((1.0 + s) * omega_0 ** (1.0 + s))
    by_error = omega_0 * (factor * (1.0 + s) * soft / tolerance) ** (1.0 / (power + s))
    by_share = omega_0 * (soft / SERIES_SHARE) ** (1.0 / (1.0 + s))
    return float(max(BAND * omega_0, by_error, by_share)) / (2.0 * np.pi)


def tail_cutoff(
    modes: Modes, point: np.ndarray, *, contact: Contact, mass: float, speed: float, tolerance: float
) -> float:
    """As `cutoff_frequency`, for modes that hold the whole compliance at a point (1, dimension) [m] themselves."""
    omega_0 = contact_swing(contact, mass, speed)
    omega, rows = modes.omega[modes.n_rigid :], modes.shapes.at(point)[0, modes.n_rigid :]
    softness = mass * omega_0**2 * np.append(np.cumsum(((rows / omega) ** 2)[::-1])[::-1], 0.0)[1:]  # of those above
    error = left_out_error(softness, omega_0 / omega, contact.exponent, modes.dimension)
    enough = (error <= tolerance) & (softness <= SERIES_SHARE) & (omega >= BAND * omega_0)
    return float(omega[np.argmax(enough) if enough.any() else -1]) / (2.0 * np.pi)


@check.typed
def truncation_error(
    modes: Modes, at: Any, max_frequency: float, *, contact: Contact, mass: float, speed: float
) -> float:
    """Expected error [-] if the modes above a frequency [Hz] are left out; the inverse of `cutoff_frequency`."""
    omega_0 = contact_swing(contact, mass, speed)
    density, s = left_out_density(modes, modes.point("at", at))
    omega_c = 2.0 * np.pi * check.positive("max_frequency", max_frequency, "Hz")
    rest = density / ((1.0 + s) * omega_c ** (1.0 + s))
    return float(left_out_error(mass * omega_0**2 * rest, omega_0 / omega_c, contact.exponent, modes.dimension))


def left_out_error(softness: Any, ratio: Any, exponent: Any, dimension: int) -> Any:
    """Expected error [-] of one blow on a beam (1) or plate (2) if a residual compliance replaces the left-out modes.

    ``softness`` [-] is that compliance times the contact stiffness, ``ratio`` [-] the contact frequency over the
    highest kept one, ``exponent`` that of the contact law: floats or arrays. The error goes as
    ``softness ratio**min(exponent + 1/2, 2)``: a higher exponent makes the force rise more smoothly and excites the
    left-out modes less. The power was fitted to 175 random blows; it lies between that of the force ripple and that of
    the energy these modes take. Squared shapes per unit omega fall as omega**-s, with s = 0 on plates and 1/2 on beams.
    """
    power, factor = order_of(exponent)
    return factor * (1.5 if dimension == 1 else 1.0) * softness * ratio ** (power - 1.0)


def order_of(exponent: Any) -> tuple[Any, Any]:
    """Power with which the error falls with the highest frequency kept of a plate, and the factor of the error.

    On a beam the power is larger by 1/2. Both are fitted, see `left_out_error`. The factor is 1 for linear contacts and
    2 from Hertz on: 90 % of random blows on plates err less.
    """
    smooth = np.minimum(exponent, 1.5)
    return 1.5 + smooth, np.maximum(2.0 * smooth - 1.0, 1.0)


def left_out_density(modes: Modes, point: np.ndarray) -> tuple[float, float]:
    """A and s of the density A omega**-s [1/(kg rad/s)] of the squared shapes of the left-out modes at a point.

    The residual compliance gives A; s is 0 on plates and 1/2 on beams.
    """
    s = 0.5 if modes.dimension == 1 else 0.0
    rest = max(0.0, float(modes.residual_compliance(point)[0, 0]))
    return (1.0 + s) * rest * modes.omega[-1] ** (1.0 + s), s
