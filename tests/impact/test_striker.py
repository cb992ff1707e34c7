"""What strikes: felt masses, arrival, errors."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import fem_impact as fi


def test_stick_feels_as_a_third_of_its_mass_at_its_tip():
    stick = fi.Striker.stick(0.1, 10e3)
    assert_allclose(stick.felt_mass, 0.1 / 3.0, rtol=1e-12)  # the turning mode is closed form
    assert_allclose(stick.modes.frequencies[1], 10e3, rtol=1e-12)  # by scaling
    # hinged-free beams: frequencies as the squares of kL; in closed form
    ratio = np.array([7.068582745629, 10.210176122814]) ** 2 / 3.926602312048**2
    assert_allclose(stick.modes.frequencies[2:4] / 10e3, ratio, rtol=1e-11)
    assert_allclose(np.abs(stick.shape[1:4]), 2.0 * 0.1**-0.5, rtol=1e-12)  # u**2 = 4/m at a free end


def test_free_bar_arrives_straight_whatever_point_strikes():
    bar = fi.analytic.beam(1.0, ends=("free", "free"), mass=0.2, first_frequency=500.0, n_modes=6)
    striker = fi.Striker.flexible(bar, at=0.9)
    wall = fi.Modes.rigid(1e9)
    hit = fi.strike(wall, striker, fi.Contact.linear(1e5), at=None, speed=1.0, max_impacts=1)
    # all of the bar moves at 1 m/s: its energy is that of its whole mass
    assert_allclose(sum(hit.energies.values()), 0.5 * 0.2, rtol=1e-9)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: fi.Striker.rigid(-1.0), "mass must be positive, got -1 kg"),
        (lambda: fi.Striker.stick(0.1, 0.0), "first_frequency must be positive"),
        (lambda: fi.Striker.stick(0.1, 1e4, n_modes=0), "n_modes must be at least 1"),
        (lambda: fi.Striker.sphere(fi.Material(E=1e9, nu=0.3, rho=1e3), 0.0), "radius must lie between"),
        (
            lambda: fi.Striker.flexible(
                fi.analytic.beam(1.0, ends=("clamped", "free"), mass=0.1, first_frequency=10.0, n_modes=2), at=1.0
            ),
            "striker must be able to move rigidly",
        ),
        (
            lambda: fi.Striker.flexible(
                fi.analytic.beam(1.0, ends=("hinged", "free"), mass=0.1, first_frequency=10.0, n_modes=2), at=0.0
            ),
            "at must be a point that moves",
        ),
    ],
)
def test_errors_name_argument_rule_and_value(make, text):
    with pytest.raises(ValueError, match=text):
        make()


def test_a_sphere_larger_than_any_is_refused():
    with pytest.raises(ValueError, match="radius must lie between 1e-09 and 1e\\+09 m, got 1e\\+300 m"):
        fi.Striker.sphere(fi.Material(E=1e9, nu=0.3, rho=1e3), 1e300)


def test_a_hammer_of_two_masses_moves_as_its_two_equations_say():
    """Head and handle with spring and damper against a wall, by scipy; modes with damping proportional to stiffness."""
    head, handle, joint, damper, k = 0.03, 0.06, 2e4, 15.0, 1e6

    def rates(t, state):
        x, y, u, v = state
        pull = joint * (x - y) + damper * (u - v)
        return [u, v, (-pull - k * max(x, 0.0)) / head, pull / handle]

    hammer = fi.Striker.hammer(head, handle, stiffness=joint, damping=damper)
    hit = fi.strike(fi.Modes.rigid(1e9), hammer, fi.Contact.linear(k), at=None, speed=1.0, tolerance=1e-9)
    times = np.linspace(0.0, hit.impacts[0].end, 40)
    found = solve_ivp(rates, (0.0, times[-1]), [0.0, 0.0, 1.0, 1.0], "DOP853", times, rtol=1e-12, atol=1e-16)
    assert hit.n_impacts > 1  # the handle pushes the head back
    motion = hit.displacement([[0.0], [1.0]], times, body=0)
    assert_allclose(motion, found.y[:2].T, atol=1e-8 * np.abs(found.y[0]).max())
    assert hit.dissipated["modes"] > 0.0
    assert hit.energy_error < 1e-9


@pytest.mark.parametrize("wrong, text", [({"head": 0.0}, "head"), ({"stiffness": -1.0}, "stiffness")])
def test_a_hammer_needs_masses_and_a_spring(wrong, text):
    with pytest.raises(ValueError, match=text):
        fi.Striker.hammer(**({"head": 0.1, "handle": 0.1, "stiffness": 1e3} | wrong))
