"""What strikes: felt masses, arrival, errors."""

from dataclasses import replace

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose
from restarted import followed
from scipy.integrate import solve_ivp

import fem_impact as fi

EARTH, HARD = fi.Modes.rigid(1e9), fi.Contact.linear(1e7)


def test_stick_feels_as_a_third_of_its_mass_at_its_tip():
    stick = fi.Striker.stick(0.1, 10e3)
    assert_allclose(stick.felt_mass, 0.1 / 3.0, rtol=1e-12)  # the turning mode is closed form
    assert_allclose(stick.modes.frequencies[1], 10e3, rtol=1e-12)  # by scaling
    # hinged-free beams: frequencies as the squares of kL; in closed form
    ratio = np.array([7.068582745629, 10.210176122814]) ** 2 / 3.926602312048**2
    assert_allclose(stick.modes.frequencies[2:4] / 10e3, ratio, rtol=1e-11)
    assert_allclose(np.abs(stick.shape[1:4]), 2.0 * 0.1**-0.5, rtol=1e-12)  # u**2 = 4/m at a free end


STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
HELD = fi.Striker.stick(0.06, 500.0, n_modes=4).held(fi.Hand(stiffness=100.0, damping=0.3, force=1.0))


def bar(*ends, n_modes=2):
    return fi.analytic.beam(1.0, ends=ends, mass=0.1, first_frequency=2e3, n_modes=n_modes)


test_errors_name_argument_rule_and_value = refusing([
    (lambda: fi.Striker.rigid(-1.0), "mass must be positive, got -1 kg"),
    (lambda: fi.Striker.stick(0.1, 0.0), "first_frequency must be positive"),
    (lambda: fi.Striker.stick(0.1, 1e4, n_modes=0), "n_modes must be at least 1"),
    (lambda: fi.Striker.sphere(STEEL, 1e300), r"radius must lie between 1e-09 and 1e\+09 m, got 1e\+300 m"),
    (lambda: fi.Striker.hammer(0.0, 0.1, stiffness=1e3), "head"),
    (lambda: fi.Striker.hammer(0.1, 0.1, stiffness=-1.0), "stiffness"),
    (lambda: fi.Striker.stick(mass=0.1, first_frequency=1e3).dropped(0.3), "turns or comes aslant; give its speed"),
    (lambda: fi.Striker.rigid(0.1).held(fi.Hand(stiffness=100.0)).dropped(0.3), "a hand holds this one; leave"),
    (lambda: fi.Striker.stick(0.06, 500.0).held(fi.Hand(1e6)),
     "stiffness of the hand must keep the striker below 0.3 of its bending"),
    (lambda: fi.Striker.rigid(0.1).held(3.0), "hand must be a Hand of fi.Hand"),
    (lambda: fi.Hand(0.0), "stiffness must be positive"),
    (lambda: fi.Hand(1.0, -1.0), "damping must not be negative"),
    (lambda: fi.sweep(EARTH, HELD, HARD, at=None, speed=1.0, over={"mass": [0.1]}), "must not be held"),
    (lambda: fi.strike(EARTH, HELD, HARD, at=None, speed=0.8), "duration or max_impacts must be given"),
])  # fmt: skip


def test_a_hammer_of_two_masses_moves_as_its_two_equations_say():
    """Head and handle with spring and damper against a wall, by scipy; modes with damping proportional to stiffness."""
    head, handle, joint, damper, k = 0.03, 0.06, 2e4, 15.0, 1e6

    def rates(t, state):
        x, y, u, v = state
        pull = joint * (x - y) + damper * (u - v)
        return [u, v, (-pull - k * max(x, 0.0)) / head, pull / handle]

    hammer = fi.Striker.hammer(head, handle, stiffness=joint, damping=damper)
    hit = fi.strike(EARTH, hammer, fi.Contact.linear(k), at=None, speed=1.0, tolerance=1e-9)
    times = np.linspace(0.0, hit.impacts[0].end, 40)
    found = solve_ivp(rates, (0.0, times[-1]), [0.0, 0.0, 1.0, 1.0], "DOP853", times, rtol=1e-12, atol=1e-16)
    assert hit.n_impacts > 1  # the handle pushes the head back
    motion = hit.displacement([[0.0], [1.0]], times, body=0)
    assert_allclose(motion, found.y[:2].T, atol=1e-8 * np.abs(found.y[0]).max())
    assert hit.dissipated["modes"] > 0.0
    assert hit.energy_error < 1e-9


@pytest.mark.parametrize("force", [0.981, 5.0])
@pytest.mark.parametrize("stiffness", [1e-3, 10.0, 200.0])
def test_a_held_mass_is_back_when_its_swing_says(stiffness, force):
    mass, speed = 0.1, 1.0
    striker = fi.Striker.rigid(mass).held(fi.Hand(stiffness, force=force))
    hit = fi.strike(EARTH, striker, HARD, at=None, speed=speed, max_impacts=4)
    omega = np.sqrt(stiffness / mass)
    # y = F/k (1 - cos wt) - v/w sin wt is zero again at tan(wt/2) = v w m / F; for a soft spring at 2 v m / F
    wanted = 2.0 / omega * np.arctan(speed * omega * mass / force)
    flights = [after.start - before.end for before, after in zip(hit.impacts, hit.impacts[1:])]
    assert_allclose(flights, wanted, rtol=1e-6)
    if stiffness == 1e-3:  # what a very soft spring errs against gravity alone: (v w m / F)**2 / 3
        error = (speed * omega * mass / force) ** 2 / 3.0
        assert_allclose(wanted, 2.0 * speed * mass / force * (1.0 - error), rtol=1e-6)


def bounced(striker, law, speed, duration):
    """A held striker on a rigid wall, as `restarted` follows it: its modes' velocities."""
    body, row, n = striker.body, striker.shape, striker.modes.n_modes
    hand, felt = striker.hand, striker.felt_mass
    rate = 2.0 * striker.modes.damping_ratio * striker.modes.omega

    def push(t, z):
        q, p = z[:n], z[n:]
        force = float(law.force(row @ q, row @ p))
        # the hand on the rigid motion alone, at the tip
        held = hand.force - hand.stiffness * row[0] * q[0] - hand.damping * row[0] * p[0]
        modal = held * row * (np.arange(n) == 0) - force * row
        return np.concatenate([p, modal - rate * p - striker.modes.omega**2 * q])

    assert_allclose(body.omega[0], np.sqrt(hand.stiffness / felt), rtol=1e-12)
    start = np.concatenate([np.zeros(n), speed * striker.motion])
    return followed(push, lambda z: row[None] @ z[:n], start, duration, max_step=1e-4)[n:]


def test_a_held_stick_that_bends_meets_an_independent_integration():
    stick = fi.Striker.stick(0.06, 400.0, n_modes=3).held(fi.Hand(stiffness=300.0, damping=0.4, force=2.0))
    law, duration = fi.Contact.power(1e6, 1.5, loss=0.2), 0.03
    hit = fi.strike(EARTH, stick, law, at=None, speed=0.5, duration=duration, residual=False, tolerance=1e-7)
    assert hit.n_impacts == 3
    wanted = bounced(stick, law, 0.5, duration)
    found = hit.modal_state([duration], body=0)[1][0]
    assert_allclose(found, wanted, atol=1e-4 * np.abs(wanted).max())  # a thousandfold growth of errors over the bounces
    assert hit.energy_error < 1e-12


def test_a_bounce_that_dies_is_proved_to_have_ended():
    law = fi.Contact.restituting(1e7, 1.5, restitution=0.7, speed=0.5)
    stick = fi.Striker.stick(0.06, 500.0).held(fi.Hand(stiffness=100.0, damping=0.1, force=-0.2))  # rests 2 mm above
    hit = fi.strike(fi.Modes.rigid(50.0), stick, law, at=None, speed=0.5, tolerance=1e-3, quantity="n_impacts")
    assert hit.finished
    assert hit.n_impacts >= 2  # it came back
    times = hit.history.end_time + np.linspace(1e-4, 5.0, 20000)
    gap = hit.displacement(None, times)[:, 0] - hit.displacement([[1.0]], times, body=0)[:, 0]
    assert gap.min() > 0.0
    assert_allclose(gap[-1], 2e-3 + hit.displacement(None, times[-1:])[0, 0], rtol=1e-2)


def test_shapes_of_a_held_striker_are_as_doubtful_as_when_it_is_free():
    """They counted as exact in a hand."""
    rod = fi.Modes.from_arrays([0.0, 900.0], [[4.0, 3.0]], points=[[0.0]], mass=0.0625, complete=True)
    doubt = np.array([[[0.0, 0.2]]])
    rod = replace(rod, shapes=replace(rod.shapes, doubt=doubt), unstated=("shapes",))
    free = fi.Striker.flexible(rod, at=[0.0])
    blow = {"at": None, "speed": 1.0, "max_impacts": 1, "tolerance": 1.0}
    errors = [
        fi.strike(fi.Modes.rigid(10.0), each, fi.Contact.linear(1e6), **blow).error.of_quantity("impulse")
        for each in (free, free.held(fi.Hand(10.0)))
    ]
    assert errors[0] > 1e-3
    assert_allclose(errors[1], errors[0], rtol=0.05)  # a hand so soft changes the blow by little


@pytest.mark.parametrize("held", [False, True])
def test_the_restitution_errs_by_less_than_it_claims_in_a_hand_too(held):
    """Where nothing else moved rigidly, other quantities told its error: a third of the truth."""
    plate = fi.analytic.rectangle(0.65, 0.56, mass=0.81, first_frequency=129.0, n_modes=17, damping_ratio=0.01)
    striker, law = fi.Striker.rigid(0.0316), fi.Contact.hertz(2.113e7)
    striker = striker.held(fi.Hand(0.4357)) if held else striker
    blow = {"at": (0.315, 0.432), "speed": 1.0, "max_impacts": 1, "residual": False}
    told, true = (fi.strike(plate, striker, law, tolerance=each, **blow) for each in (1e-2, 1e-9))
    assert abs(told.restitution - true.restitution) < told.error.of_quantity("restitution")


def test_a_held_striker_is_a_body_like_others():
    stick, held = fi.Striker.stick(0.06, 500.0, n_modes=4), HELD
    assert_allclose(held.hand_frequency, np.sqrt(100.0 / 0.02) / (2.0 * np.pi), rtol=1e-12)
    assert_allclose(held.body.damping_ratio[0], 0.3 / (2.0 * np.sqrt(100.0 * 0.02)), rtol=1e-12)
    tip = np.array([[1.0]])
    assert_allclose(held.body.residual_compliance(tip), stick.modes.residual_compliance(tip), rtol=1e-9)
    softer = held.body.shapes.compliance(tip) - stick.modes.shapes.compliance(tip)
    assert_allclose(softer, 0.01, rtol=1e-9)  # m/N, of 100 N/m at the tip
    assert held.felt_mass == stick.felt_mass


def test_a_contact_is_resolved_though_the_body_swings_more_slowly_than_the_hand():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=20.0, first_frequency=20.0, n_modes=200, damping_ratio=0.02)
    law, blow = fi.Contact.hertz(3e6), {"at": (0.45, 0.3), "speed": 1.0, "tolerance": 1e-2, "quantity": "impulse"}
    stick = fi.Striker.stick(0.05, 400.0, n_modes=3)
    held = stick.held(fi.Hand(stiffness=1000.0))
    assert held.hand_frequency > 1.5 * plate.frequencies[0]
    one, other = (fi.strike(plate, each, law, max_impacts=1, **blow) for each in (stick, held))
    first, same = one.impacts[0], other.impacts[0]
    assert_allclose(same.duration, first.duration, rtol=0.05)  # the hand pulls back by 245 rad/s for 3 ms
    # the steps suit the contact, not the slowest mode of the plate
    steps = [np.count_nonzero(hit.history.steps[:, 1] < 0.2 * first.duration) for hit in (one, other)]
    assert 0.5 < steps[1] / steps[0] < 2.0
    assert other.error.truncation < 10.0 * one.error.truncation + 1e-3


def test_a_dropped_ball_has_the_energy_of_its_height():
    ball, stick = fi.Striker.sphere(STEEL, radius=5e-3), fi.Striker.flexible(bar("free", "free", n_modes=4), at=[0.0])
    assert 0.5 * ball.dropped(0.3) ** 2 == pytest.approx(9.80665 * 0.3, rel=1e-12)
    assert ball.dropped(1.2) == pytest.approx(2.0 * ball.dropped(0.3), rel=1e-12)
    assert stick.dropped(0.3) == ball.dropped(0.3)
