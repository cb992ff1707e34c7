"""Blows against closed forms: rigid walls, two masses, a stick on a heavy plate."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import gamma

import fem_impact as fi
from fem_impact.integrator import Touch, collide

RATIOS = [10.0**n for n in range(-6, 7)]


def wall_duration(stiffness, exponent, mass, speed):
    """Contact time of a mass on a rigid wall: T = 2 sqrt(pi) G(1+q)/G(1/2+q) d/v with q = 1/(p+1)."""
    q = 1.0 / (exponent + 1.0)
    deepest = (0.5 * mass * speed**2 / (q * stiffness)) ** q
    return 2.0 * np.sqrt(np.pi) * gamma(1.0 + q) / gamma(0.5 + q) * deepest / speed


@pytest.mark.parametrize("exponent", [1.0, 1.2, 1.5, 2.5])
@pytest.mark.parametrize("speed", [1e-3, 1.0, 30.0])
def test_mass_on_rigid_wall_meets_closed_forms(exponent, speed):
    law, mass = fi.Contact.power(1e5, exponent), 0.2
    hit = collide([fi.Modes.rigid(mass)], [Touch(law, 0, None)], speeds=[speed])
    deepest = (0.5 * (exponent + 1.0) * mass * speed**2 / 1e5) ** (1.0 / (exponent + 1.0))
    assert hit.n_impacts == 1
    assert hit.finished
    assert_allclose(hit.restitution, 1.0, rtol=1e-12)  # energy is exact at every step
    assert_allclose(hit.contact_time, wall_duration(1e5, exponent, mass, speed), rtol=hit.tolerance)
    assert_allclose(hit.peak_force, 1e5 * deepest**exponent, rtol=hit.tolerance)
    assert_allclose(hit.impulse, 2.0 * mass * speed, rtol=1e-12)  # momentum is exact at every step


@pytest.mark.parametrize("law", [fi.Contact.linear(1e5), fi.Contact.hertz(1e6)], ids=["linear", "hertz"])
@pytest.mark.parametrize("ratio", RATIOS)
def test_two_masses_share_speed_as_in_newtons_cradle(law, ratio):
    mass, other = 0.1, 0.1 * ratio
    hit = fi.strike(fi.Modes.rigid(other), fi.Striker.rigid(mass), law, at=None, speed=1.0)
    # energy and momentum exact to rounding fix both speeds, whatever the step
    assert_allclose(-hit.restitution, (mass - other) / (mass + other), rtol=0, atol=1e-12)
    speed = hit.velocity(None, [hit.time[-1] + 1.0])[0, 0]
    assert_allclose(speed, 2.0 * mass / (mass + other), rtol=1e-12)
    assert hit.n_impacts == 1
    assert hit.energy_error < 1e-13  # rounding of some dozen steps


def test_stick_on_half_a_million_kilograms_rings_like_a_third_of_its_mass():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=5e5, first_frequency=100.0, n_modes=60)
    stick = fi.Striker.stick(0.1, 10e3)
    hit = fi.strike(plate, stick, fi.Contact.linear(88.6e3), at=(0.465, 0.3), speed=1.0)
    half_period = np.pi * np.sqrt(0.1 / 3.0 / 88.6e3)
    # the stick's own bending at 10 kHz lengthens a contact of 260 Hz by some (260/10000)**2
    assert_allclose(hit.contact_time, half_period, rtol=2e-3)
    inside = (hit.time > 0.05 * half_period) & (hit.time < 0.95 * half_period)
    sine = np.sqrt(88.6e3 * 0.1 / 3.0) * np.sin(np.pi * hit.time / half_period)
    assert_allclose(hit.force[inside], sine[inside], atol=0.01 * sine.max())
    hertz = fi.strike(plate, stick, fi.Contact.hertz(695e3), at=(0.465, 0.3), speed=1.0)
    assert_allclose(hertz.contact_time, wall_duration(695e3, 1.5, 0.1 / 3.0, 1.0), rtol=2e-3)
    assert_allclose(hertz.peak_force, 1.1432626298 * 695e3**0.4 * (0.1 / 3.0) ** 0.6, rtol=2e-3)


def test_sixty_modes_meet_the_eigen_solution():
    """Separation and rebound of the linear case from the roots of the secular equation (computed apart)."""
    frequencies = 1500.0 * np.arange(1, 60) / (2.0 * np.pi)
    target = fi.Modes.from_arrays(frequencies, np.full((1, 59), 1.5), points=[[0.0]], mass=1.0)
    striker, law = fi.Striker.rigid(0.01), fi.Contact.linear(1e6)
    for scheme, slope in (("A", 2.0), ("A4", 4.0)):
        errors = []
        for n in (25, 50, 100):
            dt = 3.1553252963599e-4 / n
            hit = fi.strike(target, striker, law, at=[0.0], speed=1.0, scheme=scheme, dt=dt)
            errors.append(abs(hit.restitution - 0.704365580386))
            assert hit.energy_error < 1e-13  # rounding of a hundred steps
        assert_allclose(np.log2(errors[0] / errors[1]), slope, atol=0.1)  # 2.00 and 4.00 were measured
        assert_allclose(np.log2(errors[1] / errors[2]), slope, atol=0.1)
    assert_allclose(hit.contact_time, 3.1553252963599e-4, rtol=1e-8)  # A4 with 100 steps: 4e-10 was measured


def test_response_agrees_with_itself():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=60)
    hit = fi.strike(plate, fi.Striker.stick(0.1, 10e3), fi.Contact.linear(1e6), at=(0.465, 0.3), speed=1.0)
    assert hit.n_impacts == 3
    assert_allclose(sum(hit.energies.values()), 0.5 * 0.1 / 3.0, rtol=1e-12)  # rounding of some hundred steps
    assert_allclose(np.trapezoid(hit.force, hit.time), hit.impulse, rtol=1e-4)  # the tolerance asked for
    assert_allclose(abs(hit.spectrum([0.0])[0]), hit.impulse, rtol=1e-4)
    assert hit.momentum_error < 1e-14  # rounding: momentum is exact at each step
    assert hit.force.min() >= 0.0
    q, p = hit.modal_state([hit.history.end_time])
    assert_allclose(q[0], hit.history.end_q[-60:], atol=1e-12 * np.abs(q).max())  # rounding of 312 steps
    assert_allclose(p[0], hit.history.end_p[-60:], atol=1e-12 * np.abs(p).max())
