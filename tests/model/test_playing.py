"""Sequences of blows on a body that goes on moving, against independent integration and superposition."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose
from restarted import followed, measured

import fem_impact as fi

DRUM = fi.analytic.disk(0.18, edge="clamped", mass=0.1, first_frequency=150.0, n_modes=60, damping_ratio=0.01)
BALL, LAW = fi.Striker.rigid(0.02), fi.Contact.linear(2e4)
LOOSE = {"tolerance": 1e-2, "quantity": "n_impacts"}


def played(modes, strokes, end):
    """Masses that arrive at the surface one after another and stay, as `restarted` follows them.

    Returns the velocities of the body's modes and of the masses.
    """
    n, n_sticks = modes.n_modes, len(strokes)
    shape = np.array([modes.shape_at([at])[0] for _, _, _, at, _ in strokes])
    masses = np.array([striker.mass for _, striker, *_ in strokes])
    whens = [when for when, *_ in strokes]
    z, there = np.zeros(2 * n + 2 * n_sticks), np.zeros(n_sticks, bool)

    def gaps(z):
        return np.where(there, z[2 * n : 2 * n + n_sticks] - shape @ z[:n], 1.0)

    def push(t, z):
        d, v = gaps(z), z[2 * n + n_sticks :] - shape @ z[n : 2 * n]
        force = np.array([float(law.force(x, y)) for (_, _, law, *_), x, y in zip(strokes, d, v)]) * there
        swing = force @ shape - 2.0 * modes.damping_ratio * modes.omega * z[n : 2 * n] - modes.omega**2 * z[:n]
        return np.concatenate([z[n : 2 * n], swing, z[2 * n + n_sticks :], -force / masses])

    for time, limit in pairwise([*dict.fromkeys(whens), end]):
        for i in np.flatnonzero(np.array(whens) == time):
            there[i] = True
            z[2 * n + i], z[2 * n + n_sticks + i] = shape[i] @ z[:n], strokes[i][4]
        z = followed(push, gaps, z, limit, time, max_step=2e-5)
    return z[n : 2 * n], z[2 * n + n_sticks :]


@pytest.mark.parametrize("delay", [0.0, 2e-4, 9e-4], ids=["at once", "while the first presses", "later"])
def test_two_sticks_on_one_body_meet_an_independent_integration(delay):
    modes, law = measured(10, 7, 0.01, n_points=2), fi.Contact.hertz(1e6)
    strokes = [(0.0, fi.Striker.rigid(0.05), law, 0.0, 1.0), (delay, fi.Striker.rigid(0.02), LAW, 1.0, 2.0)]
    pair = fi.strokes(modes, strokes, tolerance=1e-6)
    last = pair.hits[-1]
    assert pair.strikers == (((0, 1),) if delay == 0.0 else ((0,), (0, 1)))
    end = pair.starts[-1] + last.history.end_time
    swing, sticks = played(modes, strokes, end)
    # each blow is asked for half of 1e-6 in quantities of the blow, which the motion follows; the reference has 1e-10
    assert_allclose(pair.modal_state([end])[1][0], swing, atol=3e-6 * np.abs(swing).max())
    found = [last.velocity(None, [last.history.end_time], body=i)[0, 0] for i in (0, 1)]
    assert_allclose(found, sticks, atol=3e-6)
    energy = 0.5 * (0.05 * sticks[0] ** 2 + 0.02 * sticks[1] ** 2)
    assert_allclose(pair.energies["taken away"], energy, rtol=1e-5)  # a balance of all hits against the end alone


def test_an_impact_that_goes_on_as_another_stick_arrives_is_one_whatever_the_rounding():
    """The run of the first ends some 1e-19 s before the second one arrives."""
    first, second = 3e-4, 8e-4
    assert first + (second - first) < second
    strokes = [(when, BALL, LAW, at, 1.0) for when, at in ((first, (0.05, 0.0)), (second, (0.0, 0.05)))]
    pair = fi.strokes(DRUM, strokes, tolerance=0.1, duration=1e-3)
    assert [each.contact for each in pair.impacts] == [0, 1]


def alone(strokes):
    """The forces of each stroke on a body at rest: with their start [s]."""
    for start, hit in zip(strokes.starts, strokes.hits):
        part, q, p = hit.body_slice(len(hit.bodies) - 1), hit.history.start_q.copy(), hit.history.start_p.copy()
        q[part] = p[part] = 0.0
        yield start, replace(hit, history=replace(hit.history, start_q=q, start_p=p))


@pytest.fixture(scope="module")
def roll():
    strokes = [(0.02 * i, BALL, LAW, (0.05, 0.02 * (i % 2)), 1.0 + 0.1 * i) for i in range(5)]
    return fi.strokes(DRUM, [strokes[i] for i in (3, 0, 4, 1, 2)], **LOOSE)


def test_motion_is_the_sum_of_what_each_force_does_to_a_body_at_rest(roll):
    times, points = np.array([0.033, 0.005, 0.081, 0.3, 0.06]), [(0.1, 0.0), (0.0, -0.05)]
    assert len(roll.hits) == 5
    for name in ("displacement", "velocity"):
        wanted = sum(
            np.where((times >= start)[:, None], getattr(hit, name)(points, np.maximum(times - start, 0.0)), 0.0)
            for start, hit in alone(roll)
        )
        found = getattr(roll, name)(points, times)
        assert_allclose(found, wanted, atol=1e-11 * np.abs(wanted).max())  # rounding: the body is linear
    _, p = roll.modal_state(times)
    assert_allclose(p @ DRUM.shape_at(points).T, roll.velocity(points, times, residual=False), rtol=1e-12)


@pytest.mark.parametrize(
    "listener", [None, pytest.param((0.1, 0.0, 0.5), marks=pytest.mark.slow)], ids=["surface", "air"]
)
def test_one_sound_from_all_is_the_sum_of_their_sounds(roll, listener, tmp_path):
    def heard(blow, duration):
        if listener is None:
            return fi.sound.synthesise(blow, (0.1, 0.0), duration=duration)
        return fi.sound.radiate(blow, listener, duration=duration)

    together = heard(roll, 0.15)
    wanted = np.zeros(len(together.samples))
    for start, hit in alone(roll):
        first = round(start * 48000)
        samples = heard(hit, 0.15 - start).samples
        wanted[first:] += samples[: len(wanted) - first]
    # in the air the acceleration while waves arrive is a finite difference, of all in one and of each in the other
    apart = 1e-11 if listener is None else 1e-2
    assert_allclose(together.samples, wanted, atol=apart * np.abs(wanted).max())
    written = fi.export.write_wav(tmp_path / "roll.wav", roll, at=(0.1, 0.0), listener=listener)
    assert written.samples.size > 0.08 * 48000 + 24000  # until the last stroke has died away


def test_a_single_stroke_is_a_strike():
    one = fi.strokes(DRUM, [(0.0, BALL, LAW, (0.05, 0.0), 1.0)], tolerance=2e-3)
    hit = fi.strike(DRUM, BALL, LAW, at=(0.05, 0.0), speed=1.0, tolerance=1e-3)
    assert_allclose(one.force, hit.force, rtol=1e-12)
    assert one.impacts == hit.impacts
    assert_allclose(one.spectrum([0.0, 500.0]), hit.spectrum([0.0, 500.0]), rtol=1e-12)


@pytest.mark.parametrize(("seed", "lifted"), [
    (64, False), (76, False), (221, False), (275, False), (288, False), (84, True), (124, True),
])  # fmt: skip
def test_what_a_stroke_inherits_is_what_the_steps_before_did_to_the_motion(seed, lifted):
    """Scaling the motion by the stated error missed by up to a thousand times what is told now, of 269 such rolls one.

    Where a stick is lifted while another presses, what follows begins a little late in a run that errs: without that,
    1e-11 was told of an error of 1e-5. Twice the claim is allowed: estimates are right within a factor.
    """
    rng, n = np.random.default_rng(seed), 10
    omega = np.sort(10.0 ** rng.uniform(1.7, 3.5, n))
    shapes = rng.normal(size=(1, n)) * 5.0
    body = fi.Modes.from_arrays(omega, shapes, points=[[0.0]], mass=1.0, complete=True)
    ball, law = fi.Striker.rigid(10.0 ** rng.uniform(-2.5, -0.8)), fi.Contact.linear(10.0 ** rng.uniform(4.0, 6.5))
    times = np.cumsum([0.0, *10.0 ** rng.uniform(-2.5, -1.3, 2)])
    played = [(t, ball, law, [0.0], v) for t, v in zip(times, 10.0 ** rng.uniform(-1.0, 0.7, 3))]
    if lifted:
        lasts, rng = [], np.random.default_rng(seed + 7_000_000)
        for _ in played:
            lasts.append((10.0 ** rng.uniform(-3.0, -1.7),) if rng.random() < 0.6 else ())
        played = [(0.3 * when, *stroke, *end) for (when, *stroke), end in zip(played, lasts)]
    told, exact = (fi.strokes(body, played, tolerance=tolerance) for tolerance in (1e-3, 1e-7))
    for hit, other in zip(told.hits, exact.hits, strict=True):
        assert hit.n_impacts == other.n_impacts
        for name, quantity in (("impulse", "impulse"), ("contact_time", "contact_time"), ("peak_force", "force")):
            found, wanted = getattr(hit, name), getattr(other, name)
            assert abs(found - wanted) <= (2.0 * hit.error.of_quantity(quantity) + 3e-7) * wanted, name


def test_what_a_stroke_inherits_from_felt_is_of_the_order_of_felt():
    """Runs in twice the steps differ by three times the error there, and by 15 times where nothing remembers."""
    body = fi.Modes.from_arrays([60.0, 210.0, 900.0], [[2.0, -3.0, 4.0]], points=[[0.0]], mass=1.0, complete=True)
    felt, ball = fi.Contact.felt(2e5, 1.0, hysteresis=0.4, relaxation=1e-3), fi.Striker.rigid(0.1)
    roll = [(0.0, ball, felt, [0.0], 1.0), (1e-3, fi.Striker.rigid(0.02), LAW, [0.0], 0.4)]
    told, exact = (fi.strokes(body, roll, tolerance=each, duration=2.5e-3).hits[1] for each in (2e-2, 1e-8))
    missed = abs(told.impulse / exact.impulse - 1.0)
    assert told.error.inherited > 3.0 * told.error.step  # or it is not this that is compared
    assert missed < told.error.of_quantity("impulse") < 2.0 * missed


def test_a_stick_is_lifted_when_its_time_is_up_and_it_does_not_touch():
    stay = (0.0, fi.Striker.rigid(0.5), LAW, (0.05, 0.0), 1.0)  # for many milliseconds
    long = fi.strokes(DRUM, [stay], tolerance=1e-3)
    during = long.impacts[0]
    lifted = fi.strokes(DRUM, [(*stay, 0.5 * during.end)], tolerance=1e-3)
    (only,) = lifted.impacts  # the impact is not cut, though the run is
    assert_allclose([only.end, lifted.starts[-1], only.impulse], [during.end, during.end, during.impulse], rtol=1e-3)
    assert_allclose(only.peak_force, during.peak_force, rtol=1e-2)
    wanted = long.velocity([(0.1, 0.0)], [during.end])
    assert_allclose(lifted.velocity([(0.1, 0.0)], [during.end]), wanted, rtol=1e-2)


def test_what_steps_leave_of_a_force_at_its_release_does_not_keep_a_stick_from_being_lifted():
    """At a tolerance of 1e-8 it stayed for one more impact."""
    frequencies = [70.0, 73.0, 170.0, 200.0, 220.0, 300.0, 350.0, 580.0, 580.0, 600.0, 1100.0, 2300.0]
    shape = [2.1, -4.0, -2.5, -1.6, 1.3, 3.8, 0.84, 0.86, 0.033, 2.7, -0.5, 2.5]
    body = fi.Modes.from_arrays(frequencies, [shape], points=[[0.0]], mass=1.0, complete=True)
    stroke = (0.0, fi.Striker.rigid(0.03), fi.Contact.power(7.3e8, 2.1), [0.0], 1.2, 0.0057)
    rough, fine = (fi.strokes(body, [stroke], tolerance=each) for each in (1e-4, 1e-8))
    assert rough.n_impacts == fine.n_impacts == 3


def test_a_pause_after_a_lift_and_a_start_from_before_carry_the_motion():
    at, other = (0.05, 0.0), (-0.05, 0.02)
    both = fi.strokes(DRUM, [(0.0, BALL, LAW, at, 1.0, 0.01), (0.04, BALL, LAW, other, 1.0)], tolerance=1e-3)
    first = fi.strokes(DRUM, [(0.0, BALL, LAW, at, 1.0)], tolerance=1e-3)
    second = fi.strokes(DRUM, [(0.0, BALL, LAW, other, 1.0)], tolerance=1e-3, start=first.state(0.04))
    times = np.array([0.001, 0.01])
    wanted = second.velocity([(0.1, 0.0)], times)
    assert_allclose(both.velocity([(0.1, 0.0)], 0.04 + times), wanted, atol=1e-9 * np.abs(wanted).max())
    assert second.energies["start"] > 0.0
    short = fi.strokes(DRUM, [(0.0, BALL, LAW, at, 1.0), (0.04, BALL, LAW, other, 1.0)], tolerance=1e-3, duration=0.02)
    assert len(short.hits) == 1


def test_energies_of_a_sequence_cut_short_are_of_the_strokes_played_and_leave_out_what_contacts_store():
    """The second stroke comes after the end, and the first still presses then."""
    strokes = [(0.0, BALL, LAW, (0.05, 0.0), 1.0), (0.04, BALL, LAW, (0.0, 0.05), 1.0)]
    cut = fi.strokes(DRUM, strokes, tolerance=1e-6, duration=1e-3, quantity="impulse", residual=False)
    (hit,), given = cut.hits, cut.energies
    ball = 0.5 * 0.02 * hit.velocity(None, [1e-3], body=0)[0, 0] ** 2
    found, stored = [given[name] for name in ("brought", "contact", "taken away")], cut.force[-1] ** 2 / 2.0 / 2e4
    assert_allclose(found, [0.5 * 0.02, stored, ball], rtol=1e-5)
    assert given["contact"] > 0.1 * given["brought"]


def test_the_summary_tells_the_sequence(roll):
    text = roll.summary().splitlines()
    assert text[0].startswith("tolerance 0.01 met by all: estimated error")
    assert text[1].startswith("See notes.md#") and text[2].startswith("5 strokes, ")
    assert "stroke 0, peak" in text[3]
    assert any(line.startswith("energy start 0 J, brought") for line in text)
    assert "Strokes(" in repr(roll)
    fi.figures.force(roll)
    given = roll.energies
    assert_allclose(given["brought"], sum(0.01 * (1.0 + 0.1 * i) ** 2 for i in range(5)), rtol=1e-12)
    assert_allclose(roll.impulse, abs(roll.spectrum([0.0])[0]), rtol=1e-3)
    assert_allclose(np.trapezoid(roll.force, roll.time), roll.impulse, rtol=1e-2)
    assert 0.0 < roll.contact_time < 5 * 0.02
    with pytest.warns(fi.ToleranceWarning, match="stroke . at .* s: tolerance 1e-08 MISSED"):
        fi.strokes(DRUM, [(0.0, BALL, LAW, (0.05, 0.0), 1.0)], tolerance=1e-8)


@pytest.mark.parametrize(
    "law",
    [fi.Contact.felt(3e7, 2.0, hysteresis=0.6, relaxation=2e-4), fi.Contact.elastic_plastic(1e6, yield_approach=1e-5)],
    ids=["felt", "yields"],
)
def test_a_contact_remembers_while_another_stick_is_lifted(law):
    """That stick meets the clamped edge, which does not move: it cuts the blow of the other and changes nothing."""
    rule = {"tolerance": 1e-6, "residual": False}
    alone = fi.strike(DRUM, BALL, law, at=(0.05, 0.0), speed=1.0, **rule)
    cut = 0.6 * alone.impacts[0].end
    stroke, edge = (0.0, BALL, law, (0.05, 0.0), 1.0), (0.3 * cut, BALL, LAW, (0.18, 0.0), 1e-3, 0.7 * cut)
    both = fi.strokes(DRUM, [stroke, edge], **rule)
    own = [each for each in both.impacts if each.contact == 0]
    assert len(both.hits) > 2 and len(own) == alone.n_impacts
    for each, wanted in zip(own, alone.impacts):  # blows are asked for 1e-6
        assert_allclose(
            [each.end, each.peak_force, each.impulse], [wanted.end, wanted.peak_force, wanted.impulse], rtol=3e-6
        )


@pytest.mark.parametrize("law", [
    fi.Contact.hertz(1e5), fi.Contact.felt(1e7, 2.2, hysteresis=0.5, relaxation=3e-4),
], ids=["hertz", "felt"])  # fmt: skip
def test_a_lift_does_not_make_the_error_one(law):
    """Runs that tell it, with fewer modes or as the blow before errs, touched at once where a stick had parted."""
    drum = fi.analytic.disk(0.18, edge="clamped", mass=0.14, first_frequency=22.7, n_modes=200)
    ball, here, there = fi.Striker.rigid(0.03), (0.05, 0.0), (0.0, 0.05)
    roll = [(0.0, ball, law, here, 1.0), (4e-3, ball, law, there, 0.6, 3e-3), (9e-3, ball, law, here, 0.8)]
    found = fi.strokes(drum, roll, tolerance=2e-2)
    assert len(found.hits) > 4 and found.tolerance_met


STROKE = 0.0, BALL, LAW, (0.05, 0.0), 1.0


test_what_is_no_sequence_says_so = refusing([
    ([], "strokes must be a list of"),
    ([STROKE[:4]], r"strokes\[0\] must be \(when, striker, contact, at, speed\)"),
    ([STROKE, (0.1, LAW, BALL, (0.0, 0.0), 1.0)], r"strokes\[1\] striker must be a Striker"),
    ([(0.0, BALL, LAW, (0.5, 0.0), 1.0)], r"strokes\[0\] at must lie on the body"),
    ([(*STROKE, -1.0)], r"strokes\[0\] lasts must be positive"),
    ([(1e6, *STROKE[1:])], r"strokes\[0\] when must lie between -100000 and 100000 s"),
    ([(1e5, *STROKE[1:])], "duration must not vanish beside the time of the first stroke"),
], lambda strokes: fi.strokes(DRUM, strokes, duration=1e-12, **LOOSE))  # fmt: skip


def test_a_stroke_that_a_hand_keeps_pressing_needs_an_end():
    held = BALL.held(fi.Hand(stiffness=100.0, damping=0.1, force=1.0))
    stroke = (0.0, held, LAW, (0.05, 0.0), 1.0)
    with pytest.raises(ValueError, match=r"strokes\[1\] must have lasts, or duration be given: a hand or its weight"):
        fi.strokes(DRUM, [(*stroke, 0.01), stroke], **LOOSE)
    assert fi.strokes(DRUM, [(*stroke, 0.01)], **LOOSE).n_impacts


def test_a_stroke_without_end_says_which_it_is(monkeypatch):
    monkeypatch.setattr("fem_impact.impact.engine.MAX_STEPS", 5)
    with pytest.raises(fi.SimulationError, match=r"stroke 0 at 0 s: no final separation was reached in 5 steps"):
        fi.strokes(DRUM, [STROKE], **LOOSE)


def test_a_stroke_is_not_told_to_end_with_an_impact_as_only_a_single_blow_can():
    played = fi.strokes(DRUM, [STROKE], **LOOSE)
    hits = [replace(hit, error=replace(hit.error, mesh=1.0)) for hit in played.hits]
    said = replace(played, hits=tuple(hits)).promise
    assert said.endswith("give max_impacts = 1 for the first impact alone; to a stroke, give a short lasts instead")
