"""Time steps: short enough for the tolerance, few enough, and who says what helps where none are."""

import re

import numpy as np
import pytest
from comparing import worst
from numpy.testing import assert_allclose
from restarted import measured
from test_collision import grazing_blow, target_of, thinned_blow

import fem_impact as fi
from fem_impact.impact.collision import Touch, collide
from fem_impact.impact.state import State


@pytest.mark.parametrize("n_modes", [12, 2500])
@pytest.mark.parametrize(("law", "slope"), [(fi.Contact.linear(1e6), 3.8), (fi.Contact.hertz(1e8), 3.3)])
def test_order_of_scheme_a4(n_modes, law, slope):
    """Four while the force is smooth; a Hertz onset, t**1.5, leaves somewhat less. Fit over five steps."""
    target, striker = target_of(n_modes), fi.Striker.rigid(0.01)
    truth = fi.strike(target, striker, law, at=[0.0], speed=1.0, tolerance=1e-11)
    counts, one = np.array([12, 17, 25, 35, 50]), truth.impacts[0]
    blow = {"at": [0.0], "speed": 1.0, "scheme": "A4", "max_impacts": 1}
    impulses = [fi.strike(target, striker, law, dt=one.duration / n, **blow).impulse for n in counts]
    assert -np.polyfit(np.log(counts), np.log(np.abs(np.subtract(impulses, one.impulse))), 1)[0] > slope


def test_a_short_duration_is_still_judged_by_two_runs_of_different_steps():
    """Two runs of one step each, cut to one length, would agree on anything."""
    mass, striker, how = fi.Modes.rigid(1.0), fi.Striker.rigid(1.0), {"duration": 1e-5, "tolerance": 1e-2}
    hit = fi.strike(mass, striker, fi.Contact.linear(1e5), at=None, speed=1.0, **how)
    assert len(hit.history.steps) >= 4  # a contact lasts 7 ms; the plan's first step is longer than the duration


# [Hz] of a tip that swings by 10 um and grazes a ball at rest, and how near the ball is to where it turns
@pytest.mark.parametrize(("frequency", "gap"), [(1e3, 0.9999), (1e4, 0.999), (4e4, 0.99)])
def test_a_touch_shorter_than_a_step_is_judged_by_runs_of_different_steps(frequency, gap):
    """Runs whose steps all end at the same events agreed to 1e-12, on impulses that were 3 to 8 % off."""
    swing, mass, omega = 1e-5, 0.05, 2.0 * np.pi * frequency
    tip = fi.Modes.from_arrays([frequency], [[mass**-0.5]], points=[[0.0]], mass=mass, damping_ratio=0.0, complete=True)
    states = [(np.zeros(1), np.array([swing * omega * mass**0.5])), (np.zeros(1), np.zeros(1))]
    touch = Touch(fi.Contact.hertz(1e9, gap=gap * swing), 0, 1, [0.0], None)
    blow = {"speeds": [0.0, 0.0], "states": states, "max_impacts": 1}
    hit, exact = (collide([tip, fi.Modes.rigid(0.02)], [touch], tolerance=each, **blow) for each in (1e-2, 1e-6))
    claimed = hit.error.of_quantity("impulse") + exact.error.of_quantity("impulse")
    assert hit.impulse == pytest.approx(exact.impulse, rel=claimed)


# law, mass [kg], place [m], speed [m/s], tolerance, damping ratio, and the quantity that erred by up to 1.7 times what
# was stated of it
@pytest.mark.parametrize(
    ("law", "mass", "at", "speed", "tolerance", "damping_ratio", "attribute"),
    [
        (fi.Contact.power(5.9025e5, 1.0705), 0.133, 0.7992, 0.7618, 1e-1, 0.005, "peak_force"),
        (fi.Contact.linear(1888.75, loss=0.02954), 6.544e-3, 0.41866, 3.6144, 1e-4, 0.0, "peak_force"),
        (fi.Contact.linear(1.102685e6), 0.035797, 0.127645, 0.62013, 1e-3, 0.0, "contact_time"),
    ],
)
def test_each_quantity_errs_by_no_more_than_its_own_step_error(
    law, mass, at, speed, tolerance, damping_ratio, attribute
):
    shape = {"mass": 0.2, "first_frequency": 100.0, "n_modes": 40, "damping_ratio": damping_ratio}
    beam, striker = fi.analytic.beam(1.0, ends=("free", "free"), **shape), fi.Striker.rigid(mass)
    hit, exact = (fi.strike(beam, striker, law, at=[at], speed=speed, tolerance=each) for each in (tolerance, 1e-8))
    name = "force" if attribute == "peak_force" else attribute
    error = abs(getattr(hit, attribute) / getattr(exact, attribute) - 1.0)
    assert 1e-7 < error < hit.error.table["step"][name]  # well above what the exact one may err by


def test_an_earlier_name_of_a_scheme_is_understood():
    """As A4, number for number, with exponents below one, too."""
    blow = fi.Modes.rigid(1.0), fi.Striker.rigid(0.1), fi.Contact.power(1e6, 0.8)
    one, two = (fi.strike(*blow, at=None, speed=1.0, tolerance=1e-6, scheme=name) for name in ("collocation", None))
    assert one.scheme == two.scheme == "A4"
    np.testing.assert_array_equal(one.history.steps, two.history.steps)


def test_a_lossy_force_hears_strongly_damped_modes():
    plate = fi.analytic.rectangle(1.3, 1.0, mass=0.708, first_frequency=94.3, n_modes=60, damping_ratio=0.45)
    law = fi.Contact.power(1.81e5, 1.0, loss=1.87)
    blow, where = (plate, fi.Striker.rigid(0.0174), law), {"at": (0.657, 0.248), "speed": 1.0}
    hit, truth = (fi.strike(*blow, **where, tolerance=tolerance) for tolerance in (1e-3, 1e-7))
    assert hit.error.step < hit.tolerance
    assert worst(hit, truth) < hit.tolerance  # twice as long steps miss it 1.6-fold and state 0.86 of it


def test_steps_see_a_body_that_rings_from_the_start_beneath_a_long_contact():
    """Two runs with steps of half a period and of a whole one agreed on one contact of 16 s to 5e-7."""
    body = fi.Modes.from_arrays([1.8], [[1.26]], points=[[0.0]], mass=1.0, complete=True, damping_ratio=0.1)
    rings = State(0.0, (body,), (np.array([-4.8e-5]),), (np.array([-5.7e-4]),), np.zeros((0, 2)), 0.0)
    blow = {"at": [0.0], "speed": 7.5e-5, "start": rings, "duration": 16.0}
    hit, truth = (
        fi.strike(body, fi.Striker.rigid(5.3e-4), fi.Contact.power(24.0, 3.5), **blow, tolerance=tolerance)
        for tolerance in (1e-3, 1e-7)
    )
    assert hit.n_impacts == truth.n_impacts == 3
    assert_allclose(hit.contact_time, truth.contact_time, rtol=hit.error.of_quantity("contact_time"))
    assert truth.contact_time < 0.97 * 16.0  # the body leaves the striker twice in its first period


@pytest.mark.parametrize("seed", [1, 2, 3, 5, 11])
def test_a_blow_at_the_usual_tolerance_is_told_by_few_steps(seed):
    """Its first two runs suffice; averages over the blow, as the restitution, take half as many."""
    plate, kept, how, where = thinned_blow(seed)
    body = plate.truncated(n_modes=kept)
    hit, averaged = (fi.strike(body, *how, **where, residual=False, quantity=asked) for asked in (None, "restitution"))
    assert hit.tolerance_met and averaged.tolerance_met
    assert len(hit.history.steps) < 60  # 44 were measured
    assert len(averaged.history.steps) < 30  # 22 were measured
    truth = fi.strike(body, *how, **where, residual=False, tolerance=1e-8)
    assert worst(hit, truth) < hit.error.total < 0.1 * hit.tolerance
    assert abs(averaged.restitution - truth.restitution) < averaged.error.total


TOUCHES = [(1, 0.08040367666), (1, 0.31088011), (2, 0.0933117233), (3, 0.02846306), (6, 0.135557784)]
MISSES = [(1, 0.0716013), (1, 0.0715942250), (8, 0.0478841312), (27, 0.139124020), (34, 0.0220161), (6, 0.135559001)]


@pytest.mark.parametrize(("seed", "mass"), TOUCHES + MISSES)
def test_a_touch_that_barely_happens_is_decided_by_finer_steps(seed, mass):
    """Of those missed, rough steps make the bodies turn back in flight, and nothing of it is in the force."""
    hit, truth = (grazing_blow(seed, mass)(tolerance=tolerance) for tolerance in (1e-2, 1e-8))
    assert hit.n_impacts == truth.n_impacts
    assert_allclose(hit.contact_time, truth.contact_time, rtol=1e-2)  # the tolerance
    if (seed, mass) in TOUCHES:
        others = {grazing_blow(seed, factor * mass)(tolerance=1e-6).n_impacts for factor in (0.99, 1.0, 1.01)}
        assert len(others) > 1  # the number does depend on the mass


def test_the_tolerance_advised_is_met_and_hardly_looser_than_what_was_reached():
    blow = grazing_blow(2, 0.0933117233)
    with pytest.raises(fi.SimulationError, match="the step error stays at") as caught:
        blow(tolerance=1e-12)  # the smallest there is
    reached, advised = (
        float(re.search(rf"{words} (\S+?),? ", f"{caught.value} ")[1]) for words in ("stays at", "raise tolerance to")
    )
    assert advised < 30.0 * reached  # steps twice as long, which may meet it, err 16 times more
    assert blow(tolerance=advised).error.step < advised


@pytest.mark.parametrize("given", ["duration", "max_impacts"])
def test_the_end_advised_to_a_run_without_end_leaves_room_for_finer_steps(monkeypatch, given):
    monkeypatch.setattr("fem_impact.impact.engine.MAX_STEPS", 4000)
    bodies, touches = [measured(3, 1), measured(3, 2)], [Touch(fi.Contact.linear(1e5), 0, 1, [0.0], [0.0])]
    swing = {"states": [(np.zeros(3), np.full(3, 0.1)), (np.zeros(3), np.zeros(3))], "tolerance": 1e-6}
    with pytest.raises(fi.SimulationError, match="no final separation") as caught:
        collide(bodies, touches, **swing)
    most = float(re.search(rf"{given} of at most (\S+)", str(caught.value))[1])
    hit = collide(bodies, touches, **swing, **{given: type(2.0 if given == "duration" else 2)(most)})
    assert hit.tolerance_met  # a run twice as long would need more steps than there may be


@pytest.mark.parametrize(("exponent", "tolerance"), [(1.5, 3e-8), (2.0, 1e-9)])
def test_a_peak_within_a_step_is_claimed(exponent, tolerance):
    """Both runs took the same step over the peak: of 1.7e-9 the claim was 1e-12."""
    stiffness, mass = 1e6 * 1e4 ** (exponent - 1.0), 0.02
    law = fi.Contact.power(stiffness, exponent)
    hit = fi.strike(fi.Modes.rigid(1e3), fi.Striker.rigid(mass), law, at=None, speed=1.0, tolerance=tolerance)
    power, felt = exponent + 1.0, mass * 1e3 / (1e3 + mass)
    deepest = (0.5 * power * felt / stiffness) ** (1.0 / power)
    off = abs(hit.peak_force / (stiffness * deepest**exponent) - 1.0)
    assert off < hit.error.of_quantity("force") < tolerance


def test_a_tight_tolerance_is_met_in_the_peak_too():
    """An earlier scheme, collocation, erred at 1e-9 by 2.4e-8 in the largest force and claimed 2e-11."""
    body = fi.analytic.rectangle(1.0, 0.6036633290512105, mass=0.2, first_frequency=100.0, n_modes=30)
    law, where = fi.Contact.power(8.54084282087667e11, 2.692316912081374), (0.8009840782916274, 0.0853988032806512)
    blow = {"at": where, "speed": 0.39810008772774036, "residual": False}
    hit = fi.strike(body, fi.Striker.rigid(0.21535001870100917), law, **blow, tolerance=1e-9)
    assert hit.peak_force == pytest.approx(45.111588548056, rel=1e-9)  # of another scheme, collocation, at 1e-12


def test_a_run_that_ends_as_it_begins_obeys_its_law():
    """Of one step, whatever the misfit allowed, the last force was off by 6e-4 and the claim 1e-12."""
    law, wall = fi.Contact.power(1e7, 1.5), fi.Modes.rigid(1e6)
    hit = fi.strike(wall, fi.Striker.rigid(0.01), law, at=None, speed=1.0, duration=1e-9, tolerance=1e-8)
    # until then the mass has not lost a millionth of its speed
    assert_allclose(hit.peak_force, law.force(1e-9), rtol=1e-7)
    assert_allclose(hit.impulse, law.force(1e-9) * 1e-9 / 2.5, rtol=1e-7)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-5])
def test_a_first_step_on_felt_that_both_runs_share_is_not_believed(tolerance):
    """It ends where the other contact yields: the peak force erred by 4e-5 in longer steps, with a claim of 9e-8."""
    laws = (
        fi.Contact.elastic_plastic(2.3e6, yield_approach=3e-6),
        fi.Contact.felt(3.3e5, 1.0, hysteresis=0.53, relaxation=1.45e-5),
    )
    blow = [fi.Modes.rigid(0.14)], [fi.Touch(law, 0, None) for law in laws]
    hit, exact = (fi.collide(*blow, speeds=[0.15], tolerance=tolerance, dt=dt) for dt in (None, 1e-6))
    claimed = hit.error.of_quantity("force") + exact.error.of_quantity("force")
    assert hit.peak_force == pytest.approx(exact.peak_force, rel=claimed)


def test_bodies_that_forces_part_at_once_are_no_failure():
    """Runs ended with their first steps, and speeds at such different times never agreed: no step was short enough."""
    bodies = [measured(4, 1), measured(4, 2, n_rigid=1)]
    touch = [fi.Touch(fi.Contact.linear(2e6), 0, 1, [0.0], [0.0])]
    hit = fi.collide(bodies, touch, forces=[0.2, 2.0], duration=2e-3)
    assert hit.n_impacts == 0 and hit.tolerance_met
