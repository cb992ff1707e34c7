"""The kinetic-energy criterion: the contact resonance above which a hammer cannot rebound after one impact."""

from functools import partial
from typing import Any

import numpy as np
from scipy import optimize

from .._base import check
from ..modes.modal import Modes
from .accuracy import left_out_density
from .spectra import half_sine_spectrum

# [-] width in contact frequencies of each piece of the integral over the modes left out, fact: that of one lobe
PIECE = 2.0
# Gauss nodes of each piece and their weights: integrate cos**2 over a lobe to 1e-18
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
# [-] log of the highest contact frequency tried [rad/s]: its fourth power is still finite; no threshold above
HARDEST = np.log(1e70)
SETTLED = 40.0  # [-] above this many contact frequencies, cos**2 is replaced by its mean: changes the sum by 1e-7


@check.typed
def required_energy(modes: Modes, at: Any, contact_frequency: float) -> float:
    """Twice the energy that a half-sine pulse of unit impulse leaves in the body [1/kg].

    Parameters
    ----------
    modes : Modes
    at : strike point, (dimension,) [m]
    contact_frequency : float [Hz]
        Frequency of the half sine.

    Notes
    -----
    The sum runs over the kept modes. The residual compliance at the point gives the share of the other modes: beyond
    the last kept mode, the squared shapes per unit omega fall as omega**-s, with s = 0 on plates and 1/2 on beams.
    """
    omega_c = 2.0 * np.pi * check.positive("contact_frequency", contact_frequency, "Hz")
    return float(_energy(*_participation(modes, at), np.array([omega_c]))[0])


def _participation(modes: Modes, at: Any) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Omega and squared shapes of the kept modes; A and s of the density A omega**-s [1/(kg rad/s)] beyond them."""
    point = modes.point("at", at)
    squared = modes.shape_at(point)[0] ** 2
    density, exponent = left_out_density(modes, point)
    kept = float(modes.modal_compliance(point)[0, 0])
    if density <= 1e-12 * kept * modes.omega[-1] ** (1.0 + exponent):  # no modes are left out, or only rounding remains
        density = 0.0
    return modes.omega, squared, density, exponent


def _energy(omega: np.ndarray, squared: np.ndarray, density: float, exponent: float, omega_c: np.ndarray) -> np.ndarray:
    """`required_energy` (n,) [1/kg] of several contact frequencies (n,) [rad/s]."""
    total = half_sine_spectrum(omega / omega_c[:, None], 1.0) ** 2 @ squared
    if density == 0.0:
        return total
    last = omega[-1] / omega_c
    settled = np.maximum(SETTLED, last)
    edges = np.minimum(last[:, None] + PIECE * np.arange(SETTLED / PIECE + 1.0), settled[:, None])
    width = np.diff(edges)[..., None]
    x = edges[:, :-1, None] + width * (0.5 * (NODES + 1.0))  # (n, n_pieces, n_nodes)
    tail = np.sum(width * 0.5 * WEIGHTS * half_sine_spectrum(x, 1.0) ** 2 * x**-exponent, axis=(1, 2))
    tail += 0.5 * settled ** (-3.0 - exponent) / (3.0 + exponent)
    return total + density * omega_c ** (1.0 - exponent) * tail


@check.typed
def threshold_frequency(modes: Modes, at: Any, mass: float) -> float | None:
    """Lowest contact resonance at which the struck body absorbs all the energy of a rigid hammer.

    Parameters
    ----------
    modes : Modes
    at : strike point, (dimension,) [m]
    mass : float [kg]
        Mass of the hammer.

    Returns
    -------
    frequency : float [Hz] or None
        None if the hammer does not rebound even from the softest contact: a free body whose mass felt at the point is
        at most the hammer's. Infinite if it rebounds from every contact: the body has too few modes to absorb the
        energy.

    Notes
    -----
    The force is a half-sine pulse of contact frequency f, and momentum is conserved: the hammer stops when
    mass * required_energy(f) = 1. Use it as a trend only: multiple impacts already occur well below this frequency.

    References
    ----------
    Euphonics 12.1.2; here the rigid motions of free bodies are included.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300)
    >>> round(fi.threshold_frequency(plate, (0.45, 0.3), 0.1))  # Hz; a harder contact gives several impacts
    124
    """
    found = thresholds(modes, at, [check.positive("mass", mass, "kg")])[0]
    return None if found == 0.0 else float(found)


@check.typed
def thresholds(modes: Modes, at: Any, masses: Any) -> np.ndarray:
    """`threshold_frequency` of several hammers at once.

    Parameters
    ----------
    modes : Modes
    at : strike point, (dimension,) [m]
    masses : array_like, shape (n,) [kg]

    Returns
    -------
    frequencies : ndarray, shape (n,) [Hz]
        0 where even the softest contact cannot rebound, infinite where every contact does.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300)
    >>> fi.threshold.thresholds(plate, (0.45, 0.3), [0.01, 0.1]).round().tolist()  # Hz
    [953.0, 124.0]
    """
    masses = check.array("masses", masses, (None,), "kg")
    for mass in masses:
        check.positive("masses", mass, "kg")
    omega, squared, density, exponent = _participation(modes, at)

    def energy(log_omega: np.ndarray) -> np.ndarray:
        return _energy(omega, squared, density, exponent, np.exp(log_omega))

    found = np.full(len(masses), np.inf)
    found[masses * squared[omega == 0.0].sum() >= 1.0] = 0.0
    todo = np.isinf(found) if density > 0.0 else np.isinf(found) & (masses * squared.sum() > 1.0)
    if not todo.any():
        return found
    # an upper bound that grows with the contact frequency c: the half-sine spectrum is at most 1, and from 2 c on at
    # most 4/3 (c / omega)**2; where it says that no pulse takes all of the heaviest hammer's energy, none is tried
    ends, shares, heaviest = omega[omega > 0.0], squared[omega > 0.0], masses[todo].max()
    still, beyond = squared[omega == 0.0].sum(), density * omega[-1] ** (-3.0 - exponent) / (3.0 + exponent)
    above = 16.0 / 9.0 * (np.cumsum((shares / ends**4)[::-1])[::-1] + beyond)  # of each mode and those above
    harmless = heaviest * (still + np.cumsum(shares) - shares + above * (0.5 * ends) ** 4) < 1.0
    low = np.log(0.5 * ends[harmless].max() if harmless.any() else ((1.0 / heaviest - still) / above[0]) ** 0.25)
    # above omega[-1], all modes lie in the first lobe, so the energy only grows with the contact frequency
    last = max(low, np.log(omega[-1]))
    # by a hundredth each: only from the hundredth on is a lobe of the pulse's spectrum narrower
    tried = np.append(np.arange(low, last, np.log(1.01)), np.arange(last, HARDEST + np.log(2.0), np.log(2.0)))
    for start in range(0, len(tried) - 1, 64):  # tried together, to limit the work
        some = tried[start : start + 65]
        reached = energy(some)
        for i in np.flatnonzero(todo & (masses * reached.max() > 1.0)):
            j = int(np.argmax(masses[i] * reached > 1.0))
            excess = partial(lambda mass, one: mass * energy(np.array([one]))[0] - 1.0, masses[i])
            found[i] = np.exp(optimize.brentq(excess, some[j - 1], some[j], xtol=1e-13)) / (2.0 * np.pi)
            todo[i] = False
        if not todo.any():
            break
    return found
