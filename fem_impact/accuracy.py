"""Tolerance in, model size out: which modes a blow needs, and how long it lasts."""

from typing import Any

import numpy as np
from scipy import special

from . import _check
from .contact import Contact
from .modal import Modes

# Error when modes beyond omega_c act as a residual compliance, over k omega_0 sum(u**2 / omega**3): the largest force
# error is 0.8 with a linear spring, contact time and peak of blows that nearly stop the striker twice that.
STATIC_CORRECTION = 1.6
SERIES_SHARE = 0.1  # [-] residual compliance times contact stiffness above which the left-out modes shape the blow
BAND = 4.0  # [-] kept modes reach at least this multiple of the contact frequency, whatever the target weighs


def contact_duration(contact: Contact, mass: float, speed: float) -> float:
    """Duration [s] of the blow of a rigid mass [kg] at a speed [m/s] on a rigid wall, loss left out.

    References
    ----------
    Euphonics 12.1.1; for the exponent p: T = 2 sqrt(pi) Gamma(1 + 1/(p+1)) / Gamma(1/2 + 1/(p+1)) delta_max / v.
    """
    mass, speed = _check.positive("mass", mass, "kg"), _check.positive("speed", speed, "m/s")
    q = 1.0 / (contact.exponent + 1.0)
    # in logarithms, because extreme stiffness and speed overflow the direct form
    indentation = np.exp(q * (np.log(0.5 * mass / (q * contact.stiffness)) + 2.0 * np.log(speed)))
    return float(2.0 * np.sqrt(np.pi) * special.gamma(1.0 + q) / special.gamma(0.5 + q) * indentation / speed)


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
    Squared shapes per omega beyond the last mode fall as A omega**-s, s = 0 on plates and 1/2 on beams. With residual
    compliance the force errs by ``1.6 k omega_0 A omega_c**(-2-s) / (2+s)``, where omega_0 = pi / duration and
    k = mass omega_0**2; and the residual compliance must stay a small part of the contact's.
    """
    tolerance = _check.positive("tolerance", tolerance)
    omega_0, stiffness, density, s = _density(modes, at, contact, mass, speed)
    by_error = (STATIC_CORRECTION * stiffness * omega_0 * density / ((2.0 + s) * tolerance)) ** (1.0 / (2.0 + s))
    by_share = (stiffness * density / ((1.0 + s) * SERIES_SHARE)) ** (1.0 / (1.0 + s))
    return float(max(BAND * omega_0, by_error, by_share)) / (2.0 * np.pi)


def truncation_error(
    modes: Modes, at: Any, max_frequency: float, *, contact: Contact, mass: float, speed: float
) -> float:
    """Error [-] to expect of leaving out the modes above a frequency [Hz]: `cutoff_frequency` the other way round."""
    omega_0, stiffness, density, s = _density(modes, at, contact, mass, speed)
    omega_c = 2.0 * np.pi * _check.positive("max_frequency", max_frequency, "Hz")
    return float(STATIC_CORRECTION * stiffness * omega_0 * density / ((2.0 + s) * omega_c ** (2.0 + s)))


def _density(modes: Modes, at: Any, contact: Contact, mass: float, speed: float) -> tuple[float, float, float, float]:
    """Contact frequency [rad/s], stiffness [N/m], factor A and exponent s of the squared shapes per omega left out."""
    omega_0 = np.pi / contact_duration(contact, mass, speed)
    point = modes.points("at", at)[:1]
    rest = max(0.0, float(modes.residual_compliance(point)[0, 0]))
    s = 0.5 if modes.dimension == 1 else 0.0
    return omega_0, mass * omega_0**2, (1.0 + s) * rest * modes.omega[-1] ** (1.0 + s), s
