"""Blows on a body that still moves: from the state that another blow left."""

from dataclasses import replace

import numpy as np
import pytest
from comparing import difference
from numpy.testing import assert_allclose
from restarted import measured
from test_collision import integrate

import fem_impact as fi
from fem_impact.impact.state import State


@pytest.mark.parametrize("law", [fi.Contact.hertz(1e7), fi.Contact.power(1e7, 1.5, loss=0.3)], ids=["hertz", "loss"])
def test_a_second_blow_meets_an_independent_integration(law):
    modes, ball, later = measured(10, 3, 0.01, n_points=2), fi.Striker.rigid(0.02), 4e-3
    blow = {"speed": 1.0, "tolerance": 1e-7}
    first = fi.strike(modes, ball, law, at=[0.0], **blow)
    second = fi.strike(modes, ball, law, at=[1.0], start=first.state(later), **blow)
    end = 1.1 * second.history.end_time
    bodies, touches = [fi.Modes.rigid(0.02), modes], [fi.Touch(law, 0, 1, None, [at]) for at in (0.0, 1.0)]
    (_, q), (_, p), _ = integrate(bodies, touches[:1], later, speeds=[1.0, 0.0])
    assert first.history.end_time < later
    arrives = np.array([modes.shape_at([1.0])[0] @ q, 1.0])[:, None] * 0.02**0.5  # at the surface where it is
    (_, q), (mass_p, p), touching = integrate(bodies, touches[1:], end, states=[arrives, (q, p)])
    # both blows are asked for 1e-7; the reference is four digits better
    rebound = -mass_p[0] * 0.02**-0.5
    assert_allclose(second.restitution, rebound, atol=1e-6)
    assert_allclose([second.impulse, second.contact_time], [0.02 * (1.0 + rebound), touching], rtol=1e-6)
    for found, wanted in zip(second.modal_state([end]), (q, p)):
        assert_allclose(found[0], wanted, atol=1e-6 * np.abs(wanted).max())
    alone = fi.strike(modes, ball, law, at=[1.0], **blow)
    assert abs(alone.restitution - second.restitution) > 0.01  # the motion matters, and by far more than that


def test_a_striker_at_a_surface_that_recedes_faster_touches_nothing():
    """Rounding of where the surface is made 2 of these 60 an impact of 1e-37 N."""
    body, rng = measured(3, 1, 0.0), np.random.default_rng(1)
    shape, law = body.shape_at([[0.0]])[0], fi.Contact.layers(1e12, 1.0, depth=1e-9, hard_stiffness=1e15)
    for size in 10.0 ** rng.uniform(-2.0, 1.0, 60):
        away = State(0.0, (body,), (1e-4 * rng.normal(size=3),), (size * shape,), np.zeros((0, 2)), 0.0)
        blow = {"at": [0.0], "speed": 0.5 * size * float(shape @ shape), "start": away, "tolerance": 1e-4}
        hit = fi.strike(body, fi.Striker.rigid(1e3), law, **blow, max_impacts=1)
        assert not hit.impacts or hit.impacts[0].start > 0.0


PLATE = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=200, damping_ratio=0.01)
STICK, AT = fi.Striker.stick(0.1, 10e3, n_modes=8), (0.465, 0.3)
LISTEN, LATER = [(0.7, 0.6)], np.array([1e-3, 5e-3, 2e-2])  # m, s


@pytest.mark.parametrize("where", ["between", "pressed"])
@pytest.mark.parametrize(
    ("law", "residual", "apart"),
    [(fi.Contact.linear(1e6), False, 1e-6),
     (fi.Contact.hertz(5e7), True, 1e-6),  # a spring stands for the modes left out: nothing of it swings
     (fi.Contact.power(5e7, 1.5, loss=0.05), True, 1e-4),  # overdamped modes stand for them
     # what they remember goes on with them
     (fi.Contact.felt(5e8, 2.0, hysteresis=0.5, relaxation=3e-4), False, 1e-6),
     (fi.Contact.elastic_plastic(5e7, yield_approach=1e-5), False, 1e-6)],
    ids=["bare", "complete", "loss", "felt", "yields"],
)  # fmt: skip
def test_a_blow_of_several_impacts_goes_on_from_its_middle(law, residual, apart, where):
    blow = {"at": AT, "tolerance": 1e-7 if apart < 1e-3 else 1e-3, "residual": residual, "quantity": "n_impacts"}
    whole = fi.strike(PLATE, STICK, law, speed=1.0, **blow)
    one, two = whole.impacts[:2]
    time = 0.5 * (one.end + two.start) if where == "between" else 0.6 * two.start + 0.4 * two.end
    rest = fi.strike(PLATE, STICK, law, speed=None, start=whole.state(time), **blow)
    assert rest.n_impacts == whole.n_impacts - 1 >= 1
    assert_allclose([x.end + time for x in rest.impacts], [x.end for x in whole.impacts[1:]], rtol=0.1 * apart)
    wanted = whole.velocity(LISTEN, time + LATER)
    assert_allclose(rest.velocity(LISTEN, LATER), wanted, atol=apart * np.abs(wanted).max())
    assert rest.energy_error < 1e-12


@pytest.mark.parametrize("left", [1e-3, 1e-6])
@pytest.mark.parametrize(
    "law", [fi.Contact.linear(2e5), fi.Contact.felt(2e5, 1.0, hysteresis=0.4, relaxation=1e-3)], ids=["linear", "felt"]
)
def test_a_blow_goes_on_just_before_it_parts(law, left):
    """Steps halved from those of a whole contact were longer than what is left of it, and no tolerance was met."""
    body = fi.Modes.from_arrays([60.0, 210.0, 900.0], [[2.0, -3.0, 4.0]], points=[[0.0]], mass=1.0, complete=True)
    blow = {"modes": body, "striker": fi.Striker.rigid(0.1), "contact": law, "at": [0.0]}
    hit = fi.strike(**blow, speed=1.0, tolerance=1e-8)
    end = hit.impacts[0].end
    rest = fi.strike(**blow, speed=None, start=hit.state((1.0 - left) * end), tolerance=1e-2, max_impacts=1)
    assert_allclose(rest.contact_time, left * end, rtol=1e-5)


@pytest.mark.parametrize("where", ["between", "pressed"])
def test_a_collision_at_two_contacts_goes_on_from_its_middle(where):
    bodies = [fi.Modes.rigid(0.05), fi.Modes.rigid(0.02), PLATE]
    laws, points = (fi.Contact.hertz(1e7), fi.Contact.linear(2e5, gap=1e-2)), (AT, (1.0, 0.4))
    touches = [fi.Touch(law, i, 2, None, at) for i, (law, at) in enumerate(zip(laws, points))]
    rule = {"tolerance": 1e-7, "quantity": "n_impacts"}
    whole = fi.collide(bodies, touches, speeds=[1.0, 2.0, 0.0], **rule)
    first = whole.impacts[0]
    time = 0.5 * (first.start + first.end) if where == "pressed" else 0.5 * (first.end + whole.impacts[1].start)
    state = whole.state(time)
    rest = fi.collide(bodies, touches, start=state, **rule)
    assert state.force.any() == (where == "pressed")
    assert rest.n_impacts == whole.n_impacts - (where != "pressed")
    # the modes that stand for those left out go on swinging; steps err by this, and at 1e-3 by 2e-4
    assert_allclose(rest.speeds, whole.speeds, atol=1e-5)
    wanted = whole.velocity(LISTEN, time + LATER)
    assert_allclose(rest.velocity(LISTEN, LATER), wanted, atol=1e-5 * np.abs(wanted).max())


def test_a_state_holds_the_swing_of_the_modes_left_out():
    """Of 20 modes a collision at two points went on from their static deflection: speeds were off by 0.1 m/s."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=20, damping_ratio=0.002)
    laws, at = (fi.Contact.hertz(1e7), fi.Contact.linear(1e6)), [(0.44, 0.34), (1.16, 0.17)]
    touches = [fi.Touch(law, i, 2, None, at[i]) for i, law in enumerate(laws)]
    bodies, rule = [fi.Modes.rigid(0.05), fi.Modes.rigid(0.02), plate], {"tolerance": 1e-3, "max_impacts": 3}
    whole = fi.collide(bodies, touches, speeds=[1.0, 2.0, 0.0], **rule)
    end = whole.history.end_time
    for time in (0.3 * end, whole.impacts[0].end):
        rest = fi.collide(bodies, touches, start=whole.state(time), **rule)
        for body in (0, 1):  # 1e-5 of steps
            wanted = whole.velocity(None, [end], body=body)
            assert_allclose(rest.velocity(None, [end - time], body=body), wanted, atol=2e-5)


@pytest.mark.parametrize("left", [-1e-18, 0.0, 1e-18])
def test_a_contact_that_has_just_opened_does_not_open_again(left):
    """Rounding leaves an approach of either sign [m]; strokes that wait for a lift waited for ever."""
    body = fi.Modes.from_arrays([150.0], [[3.0], [-2.0]], points=[[0.0], [1.0]], mass=0.2, complete=True)
    touches = [fi.Touch(fi.Contact.linear(2e4), i, 2, None, [float(i)]) for i in range(2)]
    still, states = np.zeros(1), [([0.2**0.5 * left], [-0.2]), ([1e-3], [-0.1])]
    bodies = [fi.Modes.rigid(0.2), fi.Modes.rigid(0.5), body]
    rest = fi.collide(bodies, touches, states=[*states, (still, still)], tolerance=1e-2, max_impacts=1)
    assert [each.contact for each in rest.impacts] == [1]
    assert rest.impacts[0].separation_speed > 0.0


@pytest.mark.parametrize("left", [-1e-9, 0.0, 1e-9])
def test_a_force_that_its_loss_has_just_ended_is_no_impact(left):
    """Steps find that end to 1e-7 of the force's factor; a run that went on from there told one more impact."""
    body = fi.Modes.from_arrays([150.0], [[3.0], [2.0]], points=[[0.0], [1.0]], mass=0.2, complete=True)
    laws = fi.Contact.power(2e10, 2.3, loss=4.0), fi.Contact.linear(2e4)
    touches = [fi.Touch(law, i, 2, None, [float(i)]) for i, law in enumerate(laws)]
    still, states = np.zeros(1), [([0.2**0.5 * 1e-4], [-(0.2**0.5) * (1.0 - left) / 4.0]), ([1e-3], [-0.1])]
    bodies = [fi.Modes.rigid(0.2), fi.Modes.rigid(0.5), body]
    rest = fi.collide(bodies, touches, states=[*states, (still, still)], tolerance=1e-2, max_impacts=1)
    assert [each.contact for each in rest.impacts] == [1]


def test_felt_is_not_met_again_by_doubts_of_where_it_was_left():
    """Doubts are linear: they moved body and felt into each other by the square of them, and the error became two."""
    shapes = [[2.0, -3.0, 4.0], [1.0, 2.0, -1.0]]
    body = fi.Modes.from_arrays([60.0, 210.0, 900.0], shapes, points=[[0.0], [1.0]], mass=1.0, complete=True)
    laws = fi.Contact.felt(4e9, 2.3, hysteresis=0.5, relaxation=1e-3), fi.Contact.linear(3e3)
    touches = [fi.Touch(law, i, 2, None, [float(i)]) for i, law in enumerate(laws)]
    bodies = [fi.Modes.rigid(0.02), fi.Modes.rigid(0.1), body]
    hit = fi.collide(bodies, touches, speeds=[1.0, 1.0, 0.0], tolerance=1e-3, max_impacts=1)
    left = hit.state()
    pressed_in = 0.5 * abs(left.memory[0, 0])
    doubts = np.array([[-1e-4 * pressed_in ** (1.0 / 2.3) * 0.02**0.5], [0.0]]), np.zeros((2, 1)), np.zeros((2, 3))
    lost = np.array([-2.3e-4 * 2.0 * pressed_in, 0.0])
    moved = replace(left, doubts=doubts, memory=np.array([left.memory[0], lost]))
    assert fi.collide(bodies, touches, start=moved, tolerance=1e-2, max_impacts=1).error.total < 1e-5


def test_the_energies_of_a_second_blow_count_from_its_start():
    law = fi.Contact.hertz(1e7)
    first = fi.strike(PLATE, STICK, law, at=AT, speed=1.0)
    state = first.state(0.03)
    assert_allclose(state.energies[-1], first.modal_energy([0.03])[0].sum(), rtol=1e-12)
    second = fi.strike(PLATE, STICK, law, at=AT, speed=0.5, start=state)
    assert second.moving
    assert not first.moving
    start, gains = second.start_energies, second.energy_gains
    assert_allclose(start["striker"], 0.5 * STICK.felt_mass * 0.5**2, rtol=1e-12)
    assert_allclose(start["target"], state.energies[-1], rtol=1e-12)
    assert_allclose(sum(second.energies.values()), sum(start.values()), rtol=1e-11)  # of the energy before
    assert_allclose(sum(gains.values()), 0.0, atol=1e-12 * start["target"])
    assert "the target moved at the start: striker" in second.summary()
    assert "the target moved" not in first.summary()


def test_the_striker_arrives_at_the_surface_where_it_is():
    first = fi.strike(PLATE, STICK, fi.Contact.hertz(1e7), at=AT, speed=1.0)
    state = first.state(6e-3)
    surface = state.displacement([AT])[0]
    assert abs(surface) > 1e-5  # m
    for gap in (0.0, 1e-4):
        hit = fi.strike(PLATE, STICK, fi.Contact.hertz(1e7, gap=gap), at=AT, speed=3.0, start=state)
        there = hit.displacement([[1.0]], [0.0], body=0)[0, 0]
        assert_allclose(there, surface, rtol=1e-12)
        speed = 3.0 - state.velocity([AT])[0]
        assert_allclose(hit.impacts[0].start, gap / speed, rtol=0.2, atol=1e-12)  # the surface swings meanwhile


def test_errors_of_the_blow_before_count():
    law, striker = fi.Contact.hertz(1e7), fi.Striker.rigid(0.02)

    def pair(before, tolerance, dt=None):
        first = fi.strike(PLATE, striker, law, at=AT, speed=1.0, tolerance=before, dt=dt)
        return fi.strike(PLATE, striker, law, at=AT, speed=1.0, tolerance=tolerance, start=first.state(6e-3))

    exact = pair(1e-7, 1e-7)
    with pytest.warns(fi.ToleranceWarning, match="mostly from the blow before .*; give the blow before a smaller tol"):
        rough = pair(1e-2, 1e-4, dt=8e-5)  # a quarter of the contact
    assert pair(1e-6, 1e-4).error.inherited < 0.3 * rough.error.inherited  # the rest is from modes left out
    off = difference(rough, exact)
    assert rough.error.inherited > 0.5 * rough.error.total
    assert 0.3 * off < rough.error.total < 1e3 * off


def test_the_motion_of_a_system_goes_on_in_its_modes():
    plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    system = fi.assemble(fi.mesh.rectangle(0.465, 0.3, size=0.05), plate, {"boundary": "hinged"})
    blow = {"at": (0.1, 0.1), "speed": 1.0, "tolerance": 1e-2}
    ball, law = fi.Striker.rigid(0.005), fi.Contact.hertz(1e6)
    first = fi.strike(system, ball, law, **blow)
    second = fi.strike(first.target, ball, law, start=first, **blow)
    assert second.moving
    with pytest.raises(ValueError, match=r"start needs modes.*: give those of the blow before, hit\.target"):
        fi.strike(system, ball, law, start=first, **blow)
    assert_allclose(second.start_energies["target"], first.modal_energy([first.history.end_time])[0].sum(), rtol=1e-12)
    with pytest.raises(ValueError, match=r"modes must be those of the body that moves .* give hit\.target"):
        fi.strike(PLATE, ball, law, start=first, **blow)


def test_what_cannot_start_says_so():
    law, other = fi.Contact.hertz(1e7), fi.Contact.felt(1e7, 1.5, hysteresis=0.3, relaxation=1e-3)
    hit = fi.strike(PLATE, STICK, law, at=AT, speed=1.0)
    pressed = hit.state(0.5 * hit.impacts[0].end)
    assert "contact forces" in pressed.summary() and "apart" in hit.state().summary()
    goes = {"at": AT, "speed": None, "start": hit}
    usual = {"at": AT, "speed": 1.0}
    for call, words in (
        (lambda: fi.strike(PLATE, STICK, law, **usual, start=pressed), "a time when nothing touches"),
        (lambda: fi.strike(PLATE, STICK, law, at=AT, speed=None), "speed must be given in m/s"),
        (lambda: fi.strike(PLATE, fi.Striker.rigid(1.0), law, **goes), "striker must be the one of the blow before"),
        (lambda: fi.strike(PLATE, STICK, other, **goes), "contact and at must be those of the blow before"),
        (lambda: fi.strike(PLATE, STICK, law, **(goes | {"at": (0.1, 0.1)})), "contact and at must be those"),
        (lambda: fi.strike(PLATE, STICK, law, **usual, start=3), "start must be a State"),
        (lambda: fi.collide([PLATE], [fi.Touch(law, 0, None, AT)], start=hit), "the same bodies and contacts"),
        (lambda: hit.state(-1.0), "time must not be negative"),
        (lambda: fi.strike(PLATE, STICK, law, **usual, max_impacts=1).state(1.0), "where the run stopped"),
        (lambda: fi.strike(PLATE, STICK, law, **usual, start=hit).on(PLATE), "on a body at rest"),
    ):
        with pytest.raises(ValueError, match=words):
            call()
