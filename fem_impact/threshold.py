"""The kinetic-energy criterion: the contact resonance above which a hammer cannot bounce off cleanly."""

from typing import Any

import numpy as np
from scipy import optimize

from . import _check
from .modal import Modes
from .spectra import half_sine_spectrum

STEP = 1.01  # [-] ratio of the search from low frequencies: lobes of the pulse's spectrum are far wider
HARDEST = np.log(1e70)  # [-] of a contact's frequency [rad/s]: none is too hard for a striker as light as that
SETTLED = 40.0  # [-] frequency over contact frequency beyond which cos**2 is replaced by its mean: 1e-7 of the sum


@_check.typed
def required_energy(modes: Modes, at: Any, contact_frequency: float) -> float:
    """Twice the energy a half-sine pulse of unit impulse leaves in the body [1/kg].

    Parameters
    ----------
    modes : Modes
    at : point struck, (dimension,) [m]
    contact_frequency : float [Hz] of the half sine

    Notes
    -----
    The kept modes are summed. Those left out follow from the residual compliance at the point: beyond the last kept
    mode the squared shapes per omega fall as omega**-s, s = 0 on plates and 1/2 on beams.
    """
    omega_c = 2.0 * np.pi * _check.positive("contact_frequency", contact_frequency, "Hz")
    return _energy(*_participation(modes, at), omega_c)


def _participation(modes: Modes, at: Any) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Kept omega and squared shapes, and the density A omega**-s [1/(kg rad/s)] of the squared shapes beyond."""
    point = modes.point("at", at)
    squared = modes.shape_at(point)[0] ** 2
    exponent = {1: 0.5}.get(modes.dimension, 0.0)
    rest = max(0.0, float(modes.residual_compliance(point)[0, 0]))
    complete = rest + float(modes.modal_compliance(point)[0, 0])
    if rest <= 1e-12 * complete:  # nothing left out, or rounding
        return modes.omega, squared, 0.0, exponent
    return modes.omega, squared, (1.0 + exponent) * rest * modes.omega[-1] ** (1.0 + exponent), exponent


def _energy(omega: np.ndarray, squared: np.ndarray, density: float, exponent: float, omega_c: float) -> float:
    total = float(squared @ half_sine_spectrum(omega, omega_c) ** 2)
    if density == 0.0:
        return total
    last = omega[-1] / omega_c
    settled = max(SETTLED, last)
    tail = 0.5 * settled ** (-3.0 - exponent) / (3.0 + exponent)
    if last < settled:
        pieces = np.append(np.arange(last, settled, 2.0), settled)
        nodes, weights = np.polynomial.legendre.leggauss(12)
        half = 0.5 * np.diff(pieces)[:, None]
        x = pieces[:-1, None] + half * (nodes + 1.0)
        tail += float(np.sum(half * weights * half_sine_spectrum(x, 1.0) ** 2 * x**-exponent))
    return total + density * omega_c ** (1.0 - exponent) * tail


@_check.typed
def threshold_frequency(modes: Modes, at: Any, mass: float) -> float | None:
    """Lowest contact resonance at which the struck body takes all the energy of a rigid hammer.

    Parameters
    ----------
    modes : Modes
    at : point struck, (dimension,) [m]
    mass : float [kg] of the hammer

    Returns
    -------
    frequency : float [Hz], or None where even the softest contact cannot rebound (a free body no heavier, at the
        point, than the hammer); inf where no contact is too hard (a body with too few modes to take the energy)

    Notes
    -----
    Half-sine pulse of contact frequency f with momentum balance: the hammer is stopped when
    mass * required_energy(f) = 1. Good as a trend; several impacts happen well below it.

    References
    ----------
    Euphonics 12.1.2, with the rigid motions of free bodies kept.
    """
    mass = _check.positive("mass", mass, "kg")
    omega, squared, density, exponent = _participation(modes, at)
    if mass * squared[omega == 0.0].sum() >= 1.0:
        return None

    def excess(log_omega: float) -> float:
        return mass * _energy(omega, squared, density, exponent, np.exp(log_omega)) - 1.0

    if density == 0.0 and mass * squared.sum() <= 1.0:
        return float("inf")
    low = np.log(_harmless(omega, squared, density, exponent, mass))
    while excess(low) > 0.0:
        low -= 1.0
    high = low
    while excess(high) <= 0.0:
        if high > HARDEST:
            return float("inf")
        # the spectrum of a shorter pulse has all modes in its first lobe and only rises
        low, high = high, high + np.log(STEP if high < np.log(omega[-1]) else 2.0)
    return float(np.exp(optimize.brentq(excess, low, high, xtol=1e-13)) / (2.0 * np.pi))


def _harmless(omega: np.ndarray, squared: np.ndarray, density: float, exponent: float, mass: float) -> float:
    """A contact frequency [rad/s] up to which no pulse takes all the energy, by a bound that rises with it.

    The spectrum of the half sine is at most 1, and at most 4/3 (contact frequency / frequency)**2 from twice the
    contact frequency on.
    """
    flexible = omega > 0.0
    ends, shares = omega[flexible], squared[flexible]
    beyond = density * ends[-1] ** (-3.0 - exponent) / (3.0 + exponent)
    fourth = shares / ends**4
    above = beyond + np.append(np.cumsum(fourth[::-1])[::-1][1:], 0.0)  # of the modes after each
    half = 0.5 * ends
    bound = squared[~flexible].sum() + np.cumsum(shares) + 16.0 / 9.0 * half**4 * above
    safe = int(np.argmax(mass * bound >= 1.0)) if (mass * bound >= 1.0).any() else len(ends)
    return float(half[safe - 1]) if safe else 1e-3 * float(ends[0])
