"""Tolerance in, model size out: which modes a blow needs, and how long it lasts."""

from typing import Any

import numpy as np
from scipy import special

from . import _check
from .contact import Contact
from .modal import Modes

SMOOTH = 1.5, 3.0  # [-] power of omega_0 / omega_c in the error: this plus the contact's exponent, at most that
FACTOR = 1.0, 2.0  # [-] and its factor, linear and from Hertz on: nine of ten random blows on plates stay below
SERIES_SHARE = 0.1  # [-] residual compliance times contact stiffness above which the left-out modes shape the blow
LOSSY = 5.0  # [-] times the error of a lossless contact: what is left out then acts as one mode, not as a spring
BAND = 4.0  # [-] kept modes reach at least this multiple of the contact frequency, whatever the target weighs


@_check.typed
def contact_duration(contact: Contact, mass: float, speed: float) -> float:
    """Duration [s] of the blow of a rigid mass [kg] at a speed [m/s] on a rigid wall, loss left out.

    References
    ----------
    Euphonics 12.1.1; for the exponent p: T = 2 sqrt(pi) Gamma(1 + 1/(p+1)) / Gamma(1/2 + 1/(p+1)) delta_max / v.
    """
    mass, speed = _check.positive("mass", mass, "kg"), _check.positive("speed", speed, "m/s")
    q = 1.0 / (contact.exponent + 1.0)
    # in logarithms, because extreme stiffness and speed overflow the direct form
    indentation = np.exp(q * (np.log(0.5 / q) + np.log(mass) - np.log(contact.stiffness) + 2.0 * np.log(speed)))
    return float(2.0 * np.sqrt(np.pi) * special.gamma(1.0 + q) / special.gamma(0.5 + q) * indentation / speed)


@_check.typed
def cutoff_frequency(modes: Modes, at: Any, *, contact: Contact, mass: float, speed: float, tolerance: float) -> float:
    """Frequency [Hz] up to which modes are kept so that leaving out the rest errs by less than a tolerance.

    Parameters
    ----------
    modes : Modes
        A few modes of the body; their residual compliance at the point gives the density of all the others.
    at : point struck, (dimension,) [m]
    contact : Contact
    mass : float [kg] of the other body at its contact point
    speed : float [m/s]
    tolerance : float [-], of the force relative to its peak

    Notes
    -----
    See `left_out_error`; and the residual compliance must stay a small part of the contact's.
    """
    tolerance = _check.positive("tolerance", tolerance)
    omega_0, stiffness, density, s = _density(modes, at, contact, mass, speed)
    power, factor = _order(contact.exponent)
    soft = stiffness * density / ((1.0 + s) * omega_0 ** (1.0 + s))  # compliance beyond omega_0 over the contact's
    by_error = omega_0 * (factor * (1.0 + s) * soft / tolerance) ** (1.0 / (power + s))
    by_share = omega_0 * (soft / SERIES_SHARE) ** (1.0 / (1.0 + s))
    return float(max(BAND * omega_0, by_error, by_share)) / (2.0 * np.pi)


@_check.typed
def truncation_error(
    modes: Modes, at: Any, max_frequency: float, *, contact: Contact, mass: float, speed: float
) -> float:
    """Error [-] to expect of leaving out the modes above a frequency [Hz]: `cutoff_frequency` the other way round."""
    omega_0, stiffness, density, s = _density(modes, at, contact, mass, speed)
    omega_c = 2.0 * np.pi * _check.positive("max_frequency", max_frequency, "Hz")
    rest = density / ((1.0 + s) * omega_c ** (1.0 + s))
    return float(left_out_error(stiffness * rest, omega_0 / omega_c, contact.exponent, modes.dimension))


def left_out_error(softness: Any, ratio: Any, exponent: Any, dimension: int) -> Any:
    """Error [-] to expect of modes left out whose residual compliance acts, in one blow.

    Parameters
    ----------
    softness : float or ndarray [-], residual compliance times the contact's stiffness
    ratio : float or ndarray [-], contact frequency over the highest frequency kept
    exponent : float or ndarray [-] of the contact law
    dimension : int of the body

    Notes
    -----
    The force begins as a power of time, the smoother the higher the exponent, and rings what is left out by
    ``softness ratio**(exponent + 1/2)``, but no higher power than 2: measured on 175 random blows, between the power of
    the ripple in the force and that of the energy it takes away. Squared shapes per omega fall as omega**-s, s = 0 on
    plates and 1/2 on beams.
    """
    power, factor = _order(exponent)
    return factor * (1.5 if dimension == 1 else 1.0) * softness * ratio ** (power - 1.0)


def _order(exponent: Any) -> tuple[Any, Any]:
    """Power of the contact frequency over the highest one kept in the error, and its factor."""
    return np.minimum(SMOOTH[0] + exponent, SMOOTH[1]), np.minimum(
        np.maximum(2.0 * exponent - 1.0, FACTOR[0]), FACTOR[1]
    )


def _density(modes: Modes, at: Any, contact: Contact, mass: float, speed: float) -> tuple[float, float, float, float]:
    """Contact frequency [rad/s], stiffness [N/m], factor A and exponent s of the squared shapes per omega left out."""
    omega_0 = np.pi / contact_duration(contact, mass, speed)
    point = modes.point("at", at)
    rest = max(0.0, float(modes.residual_compliance(point)[0, 0]))
    s = 0.5 if modes.dimension == 1 else 0.0
    return omega_0, mass * omega_0**2, (1.0 + s) * rest * modes.omega[-1] ** (1.0 + s), s
