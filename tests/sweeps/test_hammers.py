"""Hammers on bodies whose blow is known in closed form."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.sweeps import hammers

# Euphonics 2.2.6: frequencies over the contact frequency where the spectrum of a half sine has fallen, to four digits
PRINTED = {3.0: 1.187, 6.0: 1.637, 10.0: 2.039, 20.0: 2.607}


@pytest.mark.parametrize("drop", PRINTED)
def test_reach_of_a_half_sine(drop):
    assert_allclose(hammers.half_sine_reach(drop), PRINTED[drop], atol=6e-4)


@pytest.mark.parametrize("body", [0.05, 2.0])  # [kg]
@pytest.mark.parametrize("drop", [3.0, 20.0])
def test_bandwidth_of_two_masses_on_a_linear_spring(body, drop):
    """A half sine of the reduced mass, whatever the speed."""
    mass, stiffness = 0.1, 1e5
    hit = fi.strike(
        fi.Modes.rigid(body), fi.Striker.rigid(mass), fi.Contact.linear(stiffness), at=None, speed=3.0, tolerance=1e-6
    )
    resonance = np.sqrt(stiffness * (1.0 / mass + 1.0 / body)) / (2.0 * np.pi)
    assert_allclose(hammers.bandwidth_of(hit, drop), hammers.half_sine_reach(drop) * resonance, rtol=1e-3)  # 400 looks


def test_softest_tip_on_a_mass_has_a_closed_form():
    """No mass is hit twice: only the bandwidth matters, k = m (2 pi f / reach)**2 with the reduced mass m."""
    bandwidth, body = 800.0, 5.0
    masses = [0.01, 0.3, 5.0]
    found = hammers.choose(fi.Modes.rigid(body), None, bandwidth, masses)
    for mass, hammer in zip(masses, found):
        reduced = mass * body / (mass + body)
        exact = reduced * (2.0 * np.pi * bandwidth / hammers.half_sine_reach(10.0)) ** 2
        # seven bisections of the tips from 0.03 to 10 leave a factor of 333**(1 / 128), and never less than is needed
        assert 0.995 * exact <= hammer.softest <= 1.05 * exact
        tips = mass * (2.0 * np.pi * bandwidth / hammers.half_sine_reach(10.0)) ** 2 * hammers.TIPS
        assert_allclose(hammer.hardest, tips[-1], rtol=1e-12)
        assert_allclose(hammer.reach, bandwidth * np.sqrt(hammer.hardest / exact), rtol=2e-3)
        assert hammer.works


def test_modes_wanted_follow_from_the_hardest_tip():
    """Its contact frequency is sqrt(10) times that of the bandwidth, and modes reach at least four times that far."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=1e4, first_frequency=100.0, n_modes=20)
    found = hammers.highest_frequency(plate, (0.465, 0.3), 500.0, [0.01, 0.02])
    assert_allclose(found, 4.0 * np.sqrt(10.0) * 500.0 / hammers.half_sine_reach(10.0), rtol=1e-6)
    light = plate.scaled(mass=0.2)
    assert hammers.highest_frequency(light, (0.465, 0.3), 500.0, [0.01, 0.02]) > found
