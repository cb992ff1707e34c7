"""The kinetic-energy threshold against the completed figures of Euphonics 12.1.2 and infinite bodies."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_impact.impact import threshold
from fem_impact.impact.accuracy import left_out_density
from fem_impact.impact.spectra import half_sine_spectrum
from fem_impact.modes import analytic


def test_few_modes_and_their_residual_give_the_infinite_plate():
    modes = analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=200)
    density, first = 0.2 / 1.55, np.pi**2 * (1 + 1 / 1.55**2)
    admittance = 1.0 / (8.0 * density * 2 * np.pi * 100.0 / first)
    found = threshold.threshold_frequency(modes, (0.8, 0.4), 1e-5)
    assert_allclose(found, 2.0 / (np.pi**2 * 1e-5 * admittance), rtol=0.02)  # 940 kHz from modes to 12 kHz: the tail


def test_body_without_enough_modes_never_stops_the_hammer():
    modes = analytic.Modes.from_arrays([100.0], [[1.0]], points=[[0.0]], mass=1.0, complete=True)
    assert threshold.threshold_frequency(modes, [0.0], 0.5) == np.inf


def test_several_hammers_at_once_are_those_alone():
    plate = analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=40)
    free = analytic.beam(1.0, ends=("free", "free"), mass=0.1, first_frequency=100.0, n_modes=20)
    for modes, at in ((plate, (0.45, 0.3)), (free, 0.1)):
        masses = np.geomspace(1e-4, 10.0, 7)
        alone = [threshold.threshold_frequency(modes, at, mass) for mass in masses]
        together = threshold.thresholds(modes, at, masses)
        # the root is the same, bracketed from another start: to the 1e-13 of its search and rounding
        assert_allclose(together, [0.0 if one is None else one for one in alone], rtol=1e-11)
    assert (together == 0.0).any() and (together > 0.0).any()
    with pytest.raises(ValueError, match="masses must be positive, got -1 kg"):
        threshold.thresholds(plate, (0.45, 0.3), [0.1, -1.0])


@pytest.mark.parametrize(("frequency", "error"), [(300.0, 1e-8), (3000.0, 1e-8), (1e4, 1e-6)])
@pytest.mark.parametrize("beam", [False, True])
def test_energy_in_the_modes_left_out_is_their_integral(beam, frequency, error):
    """Over 2000 lobes of the pulse's spectrum instead of twenty and the mean of cos**2 beyond."""
    if beam:
        modes, at = analytic.beam(1.0, ends=("hinged", "hinged"), mass=0.2, first_frequency=100.0, n_modes=4), 0.3
    else:
        modes, at = analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=6), (0.45, 0.3)
    density, s = left_out_density(modes, modes.point("at", at))
    omega = 2.0 * np.pi * frequency
    kept = half_sine_spectrum(modes.omega / omega, 1.0) ** 2 @ modes.shape_at(modes.point("at", at))[0] ** 2
    nodes, weights = np.polynomial.legendre.leggauss(40)
    lobes = modes.omega[-1] / omega + 2.0 * np.arange(2000)
    x = lobes[:, None] + nodes + 1.0
    rest = (weights * half_sine_spectrum(x, 1.0) ** 2 * x**-s).sum() + 0.5 * (lobes[-1] + 2.0) ** (-3.0 - s) / (3.0 + s)
    # the mean of cos**2 beyond forty contact frequencies errs by 3e-9; the first mode of the beam is slow at 10 kHz
    assert_allclose(
        threshold.required_energy(modes, at, frequency), kept + density * omega ** (1.0 - s) * rest, rtol=error
    )
