"""Frequency domain: the mobility of a structure, and the half-sine pulse of the simple theory of bouncing."""

from typing import Any

import numpy as np

from .._base import check
from ..modes.modal import Modes

QUANTITIES = {"receptance": 0, "mobility": 1, "accelerance": 2}  # -> powers of i omega


@check.typed
def mobility(modes: Modes, at: Any, to: Any, frequencies: Any, quantity: str = "mobility") -> np.ndarray:
    """Motion at ``to`` per unit force at ``at``, over frequency: by default the velocity.

    Parameters
    ----------
    modes : Modes
    at, to : array_like, shape (dimension,), or (n_forces, dimension) and (n_points, dimension) [m]
        Points of the force and of the motion.
    frequencies : array_like, shape (n_frequencies,) [Hz]
        All positive.
    quantity : "receptance", "mobility" or "accelerance"
        Displacement, velocity or acceleration per force.

    Returns
    -------
    mobility : ndarray, complex [m/N], [m/(N s)] or [m/(N s^2)]
        Shape (n_frequencies,) for one force and one point, else (n_frequencies, n_points, n_forces).

    Notes
    -----
    The kept modes are summed; the others act by their residual compliance. Reciprocal in ``at`` and ``to``. Infinite at
    the frequency of an undamped mode, except at its nodes. Valid below the last kept mode.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300, damping_ratio=0.01)
    >>> abs(fi.mobility(plate, (0.45, 0.3), (0.45, 0.3), [100.0, 150.0])).round(4).tolist()  # m/(N s)
    [0.6517, 0.0178]
    >>> fi.mobility(plate, (0.45, 0.3), [(0.2, 0.2), (0.4, 0.5), (1.0, 0.7)], [100.0, 150.0], "accelerance").shape
    (2, 3, 1)
    """
    power = QUANTITIES[check.one_of("quantity", quantity, QUANTITIES)]
    frequency = check.array("frequencies", frequencies, (None,), "Hz", lift=True)
    if (frequency <= 0.0).any():
        raise ValueError(f"frequencies must be positive, got {frequency.min():g} Hz")
    forces, places = modes.points("at", at), modes.points("to", to)
    struck, moved = modes.shape_at(forces), modes.shape_at(places)  # (n_forces, n_modes), (n_points, n_modes)
    rest = modes.residual_compliance(np.vstack([forces, places]))[len(forces) :, : len(forces)]
    omega = 2.0 * np.pi * frequency[:, None]  # (n_frequencies, 1)
    stiffness = modes.omega**2 - omega**2 + 2j * modes.damping_ratio * modes.omega * omega  # (n_frequencies, n_modes)
    resonant = stiffness == 0.0
    factor = np.where(resonant, 0.0, 1.0 / np.where(resonant, 1.0, stiffness))
    motion = np.einsum("fm,pm,am->fpa", factor, moved, struck, optimize=True) + rest
    motion = motion * (1j * omega[:, :, None]) ** power
    for i, mode in zip(*resonant.nonzero()):
        motion[i, np.outer(moved[:, mode], struck[:, mode]) != 0.0] = np.inf
    return motion[:, 0, 0] if motion.shape[1:] == (1, 1) else motion


def half_sine_spectrum(frequencies: Any, contact_frequency: float) -> np.ndarray:
    """Magnitude of the spectrum of a half-sine pulse, divided by its value at zero frequency.

    Parameters
    ----------
    frequencies : array_like [Hz]
    contact_frequency : float [Hz]
        Frequency of the sine; the pulse lasts half a period.

    Returns
    -------
    magnitude : ndarray [-]
        pi / 4 at the contact frequency; the first zero is at three times that frequency.

    References
    ----------
    Euphonics 2.2.6 and 12.1.

    Examples
    --------
    >>> fi.spectra.half_sine_spectrum([0.0, 100.0, 300.0], contact_frequency=100.0).round(4).tolist()
    [1.0, 0.7854, 0.0]
    """
    frequency = check.finite("frequencies", check.numbers("frequencies", frequencies, "Hz"), "Hz")
    x = np.abs(frequency) / check.positive("contact_frequency", contact_frequency, "Hz")
    near = np.abs(x - 1.0) < 1e-4  # both cos and 1 - x**2 vanish at 1: use the series of their ratio
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        far = np.abs(np.cos(0.5 * np.pi * x) / (1.0 - x**2))
    return np.where(near, 0.25 * np.pi * (1.0 - 0.5 * (x - 1.0)), far)
