"""The duration of a blow against closed forms, and the modes kept against blows on many more."""

import functools

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.impact import accuracy
from fem_impact.modes import analytic

AT = (0.465, 0.3)


def test_duration_on_a_rigid_wall():
    # Closed forms: pi sqrt(m/k), and Hertz with the constant 3.2180654597.
    assert_allclose(accuracy.contact_duration(fi.Contact.linear(88.6e3), 0.1, 3.0), np.pi * np.sqrt(0.1 / 88.6e3))
    hertz = 3.2180654597 * (0.1**2 / (695e3**2 * 3.0)) ** 0.2
    assert_allclose(accuracy.contact_duration(fi.Contact.hertz(695e3), 0.1, 3.0), hertz, rtol=1e-10)
    assert np.isfinite(accuracy.contact_duration(fi.Contact.hertz(1e200), 1e-12, 1e6))


@functools.cache
def plate(n_modes):
    return analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=n_modes)


@pytest.mark.parametrize("contact", [fi.Contact.linear(1e5), fi.Contact.linear(1e6), fi.Contact.hertz(5e7)], ids=str)
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_modes_up_to_the_cutoff_meet_the_tolerance(contact, tolerance):
    mass, striker = 0.03, fi.Striker.rigid(0.03)
    choice = {"contact": contact, "mass": mass, "speed": 1.0, "tolerance": tolerance}
    cutoff = accuracy.cutoff_frequency(plate(20), AT, **choice)
    kept, many = plate(6000).truncated(max_frequency=cutoff), plate(6000)
    assert kept.n_modes < 3000
    # The first impact only: a later one magnifies what came before.
    blow = {"at": AT, "speed": 1.0, "tolerance": 1e-6, "max_impacts": 1}
    few, reference = (fi.strike(modes, striker, contact, **blow) for modes in (kept, many))
    for name in ("contact_time", "peak_force", "impulse"):
        assert_allclose(getattr(few, name), getattr(reference, name), rtol=tolerance)


def test_a_heavy_target_needs_no_more_than_the_contact_band():
    heavy = plate(20).scaled(mass=500e3)
    cutoff = accuracy.cutoff_frequency(
        heavy, AT, contact=fi.Contact.linear(88.6e3), mass=0.0333, speed=1.0, tolerance=1e-4
    )
    resonance = np.sqrt(88.6e3 / 0.0333) / (2.0 * np.pi)
    assert_allclose(cutoff, accuracy.BAND * resonance, rtol=1e-9)  # nothing but the band is asked for
