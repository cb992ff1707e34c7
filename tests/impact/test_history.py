"""What counts as an impact, when its force begins and ends, and with what speeds the bodies meet and part."""

import json
from dataclasses import replace

import gradient_contacts as contacts
import numpy as np
import pytest
from comparing import changes
from numpy.testing import assert_allclose

import fem_impact as fi

GRAVITY = 9.81
FLOOR, FREE = fi.Modes.rigid(1e9), fi.Modes.rigid(3.0)


def chain(masses, exponent, stiffnesses, gaps, speed, **options):
    touches = [
        fi.Touch(fi.Contact.power(k, exponent, gap=gap), i, i + 1) for i, (k, gap) in enumerate(zip(stiffnesses, gaps))
    ]
    balls = [fi.Modes.rigid(mass) for mass in masses]
    return fi.collide(balls, touches, speeds=[speed, *[0.0] * (len(masses) - 1)], duration=0.05, **options)


def slow_chain(tolerance):
    """Five bodies, three of them touching, whose forces rise as slowly as the power 33 of time."""
    masses = 0.982752, 0.171869, 0.212304, 0.530842, 0.661054
    stiffnesses = 3.47887e11, 7.67257e11, 1.20156e12, 4.89698e11
    return chain(masses, 2.5, stiffnesses, (0.0, 5.74532e-5, 0.0, 0.0), 0.32811, tolerance=tolerance)


def random_chain(seed, tolerance):
    rng = np.random.default_rng(seed)
    n, exponent = int(rng.integers(3, 7)), float(rng.choice([1.0, 1.5, 2.5]))
    stiffnesses = 10.0 ** rng.uniform(0.0, 0.7, n - 1) * {1.0: 1e6, 1.5: 1e8, 2.5: 2e11}[exponent]
    gaps = np.where(rng.random(n - 1) < 0.6, 0.0, 10.0 ** rng.uniform(-6.0, -3.5, n - 1))
    masses = np.exp(rng.uniform(np.log(0.1), 0.0, n))
    return chain(masses.tolist(), exponent, stiffnesses, gaps, rng.uniform(0.2, 1.5), tolerance=tolerance)


def first_touches(hit, count):
    """When each contact is first touched."""
    return [min(each.start for each in hit.impacts if each.contact == c) for c in range(count)]


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-6])
def test_bodies_that_touch_are_in_contact_from_when_force_acts_on_them(tolerance):
    """Those beyond the gap touch from the start, and press each other when the gap is closed at 0.756 ms."""
    hit = slow_chain(tolerance)
    assert hit.n_impacts == 7
    assert_allclose(hit.contact_time, 17.479156e-3, rtol=tolerance)  # at 1e-9 and 1e-10
    met = next(each for each in hit.impacts if each.contact == 1)
    assert first_touches(hit, 4) == [0.0, met.start, met.start, met.start]


@pytest.mark.parametrize("n", [3, 6])
@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-5])
def test_a_ball_that_meets_others_presses_them_all_at_once(n, exponent, tolerance):
    """Force reaches every one of touching rigid bodies at once, however slowly it rises there."""
    hit = chain([0.1] * n, exponent, [1e8] * (n - 1), [1e-4, *[0.0] * (n - 2)], 0.5, tolerance=tolerance)
    assert_allclose(first_touches(hit, n - 1), 1e-4 / 0.5, rtol=1e-9)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-5])
def test_a_body_that_draws_back_from_what_it_touches_does_not_press_it(tolerance):
    """A rod pushed by a ball beyond its centre of percussion: its other end leaves the wall at once, for good."""
    law, shapes = fi.Contact.hertz(1e8), [[3.0, 3.0], [3.0, -6.0]]
    rod = fi.Modes.from_arrays([0.0, 0.0], shapes, points=[[0.0], [1.0]], mass=1.0 / 9.0, complete=True)
    touches = fi.Touch(law, 0, 1), fi.Touch(law, 1, 2, None, [0.0]), fi.Touch(law, 2, None, [1.0])
    balls = [fi.Modes.rigid(0.1)] * 2
    hit = fi.collide([*balls, rod], touches, speeds=[1.0, 0.0, 0.0], tolerance=tolerance)
    assert [each.contact for each in hit.impacts] == [0, 1]


def test_how_small_a_force_or_gap_counts_as_none_does_not_matter(monkeypatch):
    histories = [blow.history for blow in (slow_chain(1e-3), random_chain(13, 1e-3))]
    wanted = [history.impacts for history in histories]
    for factor in (0.1, 10.0):
        monkeypatch.setattr("fem_impact.impact.history.FAINT", factor * 1e-9)
        monkeypatch.setattr("fem_impact.impact.history.TOUCH", factor * 1e-6)
        assert [replace(history).impacts for history in histories] == wanted


@pytest.mark.slow
@pytest.mark.thin(20)
@pytest.mark.parametrize("seed", range(40))
def test_impacts_of_random_chains_do_not_depend_on_the_tolerance(seed):
    truth = random_chain(seed, 1e-7)  # errs by some 1e-8; three of these chains are refused below
    for tolerance in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        found = random_chain(seed, tolerance)
        assert found.n_impacts == truth.n_impacts
        for name in ("contact_time", "peak_force", "impulse"):
            assert_allclose(getattr(found, name), getattr(truth, name), rtol=tolerance, err_msg=name)


def test_bodies_that_touched_before_have_no_restitution_of_an_impact():
    hit = chain([0.1] * 3, 1.5, [1e9] * 2, [0.0, 0.0], 1.0, tolerance=1e-4)
    found = {each.contact: each for each in hit.impacts[:2]}
    assert found[0].restitution > 0.0 and found[1].separation_speed > 0.0
    assert found[1].restitution is None and found[1].approach_speed == 0.0


def falling(duration, mass=0.5, force=GRAVITY * 0.5, **options):
    """A hammer on a concrete slab."""
    slab = fi.Plate(fi.Material(E=30e9, nu=0.2, rho=2400.0), thickness=0.1)
    modes = fi.analytic.rectangle(2.0, 1.5, section=slab, n_modes=40)
    rules = {"at": (0.8, 0.6), "speed": 1.0, "tolerance": 1e-2, "duration": duration, "residual": False, **options}
    return fi.strike(modes, fi.Striker.rigid(mass), fi.Contact.hertz(1e9), striker_force=force, **rules)


def test_the_restitution_of_a_falling_hammer_does_not_depend_on_the_duration():
    found = [falling(duration).restitution for duration in (1e-3, 0.02, 0.05, 0.1)]
    assert_allclose(found, found[0], rtol=1e-9)
    assert_allclose(found[0], falling(1e-3, force=0.0).restitution, rtol=1e-3)  # its weight, for half a millisecond


@pytest.mark.parametrize("height", [1e-3, 0.05])
@pytest.mark.parametrize("duration", [1.2, 1.7])  # times that it takes to fall
def test_a_body_dropped_from_rest_leaves_as_fast_as_it_came(height, duration):
    law, how = fi.Contact.linear(1e6, gap=height), {"at": None, "speed": 0.0, "striker_force": 0.1 * GRAVITY}
    end = duration * np.sqrt(2.0 * height / GRAVITY)
    hit = fi.strike(FLOOR, fi.Striker.rigid(0.1), law, **how, duration=end)
    assert_allclose(hit.restitution, 1.0, rtol=1e-7)
    assert_allclose(hit.impacts[0].approach_speed, np.sqrt(2.0 * GRAVITY * height), rtol=1e-7)


def test_a_held_striker_rebounds_at_its_last_separation():
    held = fi.Striker.rigid(0.1).held(fi.Hand(stiffness=200.0, force=1.0))
    rules = {"at": None, "speed": 1.0, "tolerance": 1e-4}
    short, long = (fi.strike(FLOOR, held, fi.Contact.linear(1e7), duration=t, **rules) for t in (1e-3, 5e-3))
    assert short.n_impacts == long.n_impacts == 1
    assert_allclose([short.restitution, long.restitution], 1.0, rtol=1e-7)


def test_there_is_no_restitution_while_the_bodies_still_touch():
    hit = falling(1e-4)
    assert hit.restitution is None and hit.in_contact
    assert hit.impacts[-1].restitution is None and hit.impacts[-1].separation_speed is None
    assert "restitution none, still in contact" in hit.summary()
    assert "none, still in contact" in hit._repr_html_()
    told = json.loads(json.dumps(fi.export.plain(fi.export.numbers(hit)), allow_nan=False))
    assert told["response"]["restitution"] is None and told["response"]["in_contact"] is True
    assert told["impacts"][-1]["restitution"] is None
    table = hit.to_xarray()
    assert np.isnan(table.restitution) and np.isnan(table.impact_restitution[-1]) and table.attrs["in_contact"] == 1
    with pytest.raises(fi.SimulationError, match="no gradient of restitution: none, still in contact"):
        hit.gradient("restitution", "striker.mass")
    assert not falling(1e-3).in_contact


def falling_blow(numbers):
    mass, speed, gap = numbers.values()
    law, how = fi.Contact.power(1e6, 1.5, loss=0.2, gap=gap), {"striker_force": 5.0, "duration": 0.012}
    return fi.strike(FREE, fi.Striker.rigid(mass), law, at=None, speed=speed, tolerance=1e-8, **how)


def chained_blow(numbers):
    gap, speed = numbers.values()
    return chain([0.1, 0.15, 0.12], 1.5, [1e8, 2e8], [gap, 0.0], speed, tolerance=1e-9)


FALL = {"striker.mass": (0.5, 1e-3), "strike.speed": (1.0, 1e-3), "contact.gap": (2e-3, 1e-3)}  # steps of differences
GAP = {"contacts.0.gap": (1e-4, 1e-2), "speeds.0": (1.0, 1e-3)}  # the start of a contact behind a gap moves with it


@pytest.mark.parametrize(
    ("blow", "quantity", "numbers"), [(falling_blow, "restitution", FALL), (chained_blow, "contact_time", GAP)]
)
def test_gradients_of_falling_bodies_and_of_contacts_behind_a_gap_are_differences(blow, quantity, numbers):
    values = {name: value for name, (value, _) in numbers.items()}
    found = blow(values).gradient(quantity, tuple(numbers))
    for name, (value, step) in numbers.items():
        (change,) = changes(blow, values, name, [quantity], step)
        assert_allclose(found[name], change / value, rtol=1e-4, atol=1e-7)


def beam_and_stop(gap, force=0.0):
    """A hinged beam of one mode, struck in the middle, swings towards a stop; the run ends with the duration."""
    beam = fi.analytic.beam(1.0, ends=("hinged", "hinged"), mass=0.3, first_frequency=40.0, n_modes=1)
    laws = fi.Contact.linear(1e6, gap=1e-4), fi.Contact.linear(1e6, gap=gap)
    touches = [fi.Touch(laws[0], 0, 1, None, [0.5]), fi.Touch(laws[1], 1, None, [0.5])]
    how = {"speeds": [1.0, 0.0], "forces": [force, 0.0], "duration": 8e-3, "residual": False}
    return fi.collide([fi.Modes.rigid(0.05), beam], touches, **how)


@pytest.mark.parametrize("force", [0.0, -5.0])
def test_a_near_miss_in_the_flight_that_a_duration_cuts_is_in_the_margin(force):
    swing = float(beam_and_stop(1.0, force).displacement([[0.5]], np.linspace(0.0, 8e-3, 4001), body=1).max())
    for factor in (1.0 + 1e-5, 1.0 + 1e-3):
        hit = beam_and_stop(factor * swing, force)
        deepest = float(hit.history._column(0).max())
        # cubics over a quarter of a radian miss the turn by some 1e-5 of the swing
        assert hit.margin == pytest.approx((factor - 1.0) * swing / deepest, abs=2e-4)


@pytest.mark.parametrize("late", [-1e-6, 1e-6])
def test_an_impact_that_begins_as_a_duration_ends_is_counted_or_not(late):
    """By a microsecond: five were told, "met", of a tolerance that leaves ten times that."""
    blow = {"at": None, "speed": 1.0, "striker_force": 0.1 * GRAVITY}
    how = FLOOR, fi.Striker.rigid(0.1), fi.Contact.hertz(1e7, loss=0.1)
    begins = fi.strike(*how, **blow, duration=1.0, tolerance=1e-9).impacts[-1].start
    hit = fi.strike(*how, **blow, duration=begins * (1.0 + late), tolerance=1e-1)
    assert hit.n_impacts == (6 if late > 0.0 else 5) and hit.tolerance_met
    assert hit.margin == pytest.approx(1e-3, rel=0.1)


def test_contacts_that_part_for_good_at_once_leave_no_margin_behind():
    """A second stick, not yet in contact, has parted when the first look at it is made."""
    for seed, kind in ((3, "two sticks"), (10, "buzz"), (13, "buzz"), (14, "over a stop")):
        numbers = contacts.random_numbers(np.random.default_rng(seed), kind)
        assert 0.0 <= contacts.strike(numbers, 1e-4, kind=kind).margin <= 0.05


def test_felt_that_ends_a_run_has_let_go():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=2.0, first_frequency=50.0, n_modes=40, damping_ratio=0.01)
    felt, ball = fi.Contact.felt(1e10, 2.5, hysteresis=0.4, relaxation=1e-3), fi.Striker.rigid(0.03)
    blow = {"at": (0.45, 0.3), "speed": 1.0, "tolerance": 1e-5, "residual": False}
    whole, first = (fi.strike(plate, ball, felt, **blow, max_impacts=most) for most in (None, 1))
    assert first.restitution == pytest.approx(whole.restitution, abs=1e-5)
    held = fi.strike(plate, ball, felt, **blow, duration=0.5 * whole.contact_time)
    assert held.restitution is None and held.in_contact


def test_a_push_of_less_than_a_touch_is_no_impact_where_bodies_touched_before():
    """With 2e-11 of the largest force for 15 microseconds: it counted from 1e-6 on, and three impacts were others."""
    law, u = fi.Contact.hertz(1e7), 0.1**-0.5
    shapes = [[u, -1.6 * u], [u, 1.6 * u]]
    bar = fi.Modes.from_arrays([0.0, 3e3], shapes, points=[[0.0], [1.0]], mass=0.1, complete=True)
    bodies = [fi.Modes.rigid(0.03), bar, fi.Modes.rigid(0.05)]
    touches = [fi.Touch(law, 0, 1, None, [0.0]), fi.Touch(law, 1, 2, [1.0], None)]
    blow = {"speeds": [1.0, 0.0, 0.0], "forces": [0.0, 0.0, -0.1], "max_impacts": 3}
    coarse, fine = (fi.collide(bodies, touches, tolerance=each, **blow) for each in (1e-4, 1e-6))
    claimed = coarse.error.of_quantity("contact_time") + fine.error.of_quantity("contact_time")
    assert coarse.contact_time == pytest.approx(fine.contact_time, rel=claimed)
    assert len(fine.history.steps) < 1000  # 442; 2027 to find that push
