"""The quick blows of a fit are those of `fi.strike`."""

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.impact import accuracy
from fem_impact.impact.reduced_body import join_bodies
from fem_impact.taps import blows, rig, unknowns

AT = (0.17, 0.11)
PLATE = fi.analytic.rectangle(0.4, 0.3, mass=0.8, first_frequency=120.0, n_modes=30, damping_ratio=0.01)
BALL = fi.Striker.rigid(0.02)


def blow(striker, target, law, speed, duration, horizon, finer=1.0):
    """A quick blow by its longest step, or a finer one."""
    system = join_bodies((striker, target), [law])
    return blows.follow_blow(system, speed, blows.longest_step(system, law, duration) / finer, horizon)


@pytest.mark.parametrize(("hammer", "loss"), [(BALL, 0.0), (fi.Striker.stick(0.1, 900.0, n_modes=4), 0.2)])
def test_a_quick_blow_agrees_with_strike_and_its_record_with_measure(hammer, loss):
    law = fi.Contact.power(1e7, 1.4, loss=loss)
    hit = fi.strike(PLATE, hammer, law, at=AT, speed=1.3, tolerance=1e-5)
    bodies = blows.of_striker(hammer), blows.of_target(PLATE, AT, [(0.1, 0.1), AT])
    assert abs(blow(*bodies, law, 1.3, 3e-4, 3e-3).impulses.sum() - hit.impulse) < 1e-5 * hit.impulse
    chain = rig.Rig(25600.0)
    fine = blows.records(*bodies, law, np.array([1.3]), duration=3e-4, n_times=80, lead=20, rig=chain, tip_mass=0.0)
    found = rig.sample(fine, chain, force=True)[0, :, rig.MARGIN : -rig.MARGIN]
    wanted = fi.measure(hit, rate=25600.0, at=[(0.1, 0.1), AT], before=20 / 25600, duration=80 / 25600)
    assert np.abs(found[0] - wanted.force[0]).max() < 3e-5 * wanted.peak[0]  # 40 steps per contact
    assert (np.abs(found[1:].T - wanted.response[0]).max(axis=0) < 1e-4 * np.abs(wanted.response[0]).max(axis=0)).all()


@pytest.mark.parametrize(
    "law",
    [fi.Contact.felt(1e8, 2.0, hysteresis=0.4, relaxation=1e-4), fi.Contact.elastic_plastic(1e7, yield_approach=5e-5),
     fi.Contact.layers(1e6, 1.2, depth=1e-4, hard_stiffness=1e9)],
    ids=["felt", "plastic", "layers"],
)  # fmt: skip
def test_a_quick_blow_of_a_law_with_memory_or_corners_agrees_with_strike(law):
    hit = fi.strike(PLATE, BALL, law, at=AT, speed=1.3, tolerance=1e-5)
    duration = accuracy.contact_duration(law, BALL.mass, 0.5 * hit.impulse / BALL.mass)
    assert duration == pytest.approx(hit.contact_time, rel=0.25)  # on a wall, at half the impulse
    history = blow(blows.of_striker(BALL), blows.of_target(PLATE, AT), law, 1.3, duration, 3e-3)
    times = np.linspace(0.0, hit.contact_time, 200)[1:-1]
    with np.errstate(all="ignore"):  # rates of the force, not used here, are infinite at corners
        found, wanted = (one.force_at(times, 0)[0] for one in (history, hit.history))
    assert np.abs(found - wanted).max() < 2e-4 * hit.peak_force  # 40 steps per contact; 4e-5 measured
    assert abs(history.impulses.sum() - hit.impulse) < 2e-5 * hit.impulse


def test_a_scaled_body_is_the_scaled_modes():
    other = blows.of_target(PLATE, AT).scaled(0.3, 200.0, 0.05)
    wanted = blows.of_target(PLATE.scaled(mass=0.3, first_frequency=200.0), AT)
    assert np.allclose(other.omega, wanted.omega) and np.allclose(np.abs(other.rows), np.abs(wanted.rows))
    assert np.isclose(other.rest, wanted.rest, rtol=1e-6) and (other.zeta == 0.05).all()


def test_what_a_body_yields_is_known_at_every_place():
    point, rig_ = np.array([(0.15, 0.12)]), rig.Rig(25600.0)
    places = unknowns.checked({"target.x": (0.12, 0.22)}, PLATE, BALL, fi.Contact.hertz(1e7))
    setting = unknowns.Setting(PLATE, AT, BALL, fi.Contact.hertz(1e7), rig_, places, point, 1, 0.02)
    found, exact = setting.structure({"target.x": 0.19}), blows.of_target(PLATE, (0.19, AT[1]), point)
    assert found.rest == pytest.approx(exact.rest, rel=2e-3)  # a quartic over a quarter of the plate: 4e-4
    assert found.softness == pytest.approx(exact.softness, rel=1e-9)  # reciprocal, to rounding


def test_fast_modes_that_matter_shorten_the_step_and_are_followed():
    """The force with the step chosen, against steps of a sixteenth: 2e-6 of its peak, 1e-5 with steps twice as long."""
    law, ball = fi.Contact.linear(1e6), blows.of_striker(BALL)
    assert blows.longest_step(join_bodies((ball, blows.wall()), [law]), law, 4e-4) == pytest.approx(1e-5)
    fast = blows.wall().with_mode(25e3, 0.003, 0.0, np.zeros(0))
    times, bodies = np.linspace(0.0, 4e-4, 500), (ball, fast, law)
    rough, exact = (blow(*bodies, 1.0, 4e-4, 1e-3, finer).force_at(times, 0)[0] for finer in (1.0, 16.0))
    assert np.abs(rough - exact).max() < 5e-6 * exact.max()
    faint = join_bodies((ball, blows.wall().with_mode(25e3, 4e3, 0.0, np.zeros(0))), [law])
    assert blows.longest_step(faint, law, 4e-4) == pytest.approx(1e-5)
