"""The frequency domain: mobility of a structure, and the half-sine pulse of the simple theory of bouncing."""

from typing import Any

import numpy as np

from . import _check
from .modal import Modes


@_check.typed
def mobility(modes: Modes, at: Any, to: Any, frequencies: Any) -> np.ndarray:
    """Velocity at ``to`` per unit force at ``at``, over frequency.

    Parameters
    ----------
    modes : Modes
    at, to : point of the force and of the velocity, (dimension,) [m]
    frequencies : array_like, shape (n_frequencies,) [Hz], above zero

    Returns
    -------
    mobility : ndarray, shape (n_frequencies,), complex [m/(N s)]

    Notes
    -----
    Sum over the kept modes plus i omega times the residual compliance of the rest; reciprocal in ``at`` and ``to``.
    Infinite at the frequency of an undamped mode. Valid below the last kept mode.
    """
    frequency = _check.array("frequencies", frequencies, (None,), "Hz", lift=True)
    if (frequency <= 0.0).any():
        raise ValueError(f"frequencies must be positive, got {frequency.min():g} Hz")
    force, place = modes.point("at", at), modes.point("to", to)
    product = modes.shape_at(force)[0] * modes.shape_at(place)[0]  # (n_modes,)
    rest = modes.residual_compliance(np.vstack([force, place]))[0, 1]
    omega = 2.0 * np.pi * frequency[:, None]  # (n_frequencies, 1)
    stiffness = modes.omega**2 - omega**2 + 2j * modes.damping_ratio * modes.omega * omega
    with np.errstate(divide="ignore", invalid="ignore"):
        return (1j * omega * product / stiffness).sum(axis=1) + 1j * omega[:, 0] * rest


def half_sine_spectrum(frequencies: Any, contact_frequency: float) -> np.ndarray:
    """Magnitude of the spectrum of a half-sine pulse over its value at zero frequency.

    Parameters
    ----------
    frequencies : array_like [Hz]
    contact_frequency : float [Hz]
        Of the sine; the pulse lasts half its period.

    Returns
    -------
    magnitude : ndarray [-]; pi / 4 at the contact frequency, first zero at three times it

    References
    ----------
    Euphonics 2.2.6 and 12.1.
    """
    frequency = _check.finite("frequencies", _check.numbers("frequencies", frequencies, "Hz"), "Hz")
    x = frequency / _check.positive("contact_frequency", contact_frequency, "Hz")
    near = np.abs(x - 1.0) < 1e-4  # cos and 1 - x**2 vanish together: their ratio to second order
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        far = np.abs(np.cos(0.5 * np.pi * x) / (1.0 - x**2))
    return np.where(near, 0.25 * np.pi * (1.0 - 0.5 * (x - 1.0)), far)
