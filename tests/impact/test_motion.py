"""How bodies move in and after a blow, and by which modes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi


def test_states_come_in_any_order_and_before_the_blow_is_refused():
    wall = fi.Modes.rigid(1e6)
    half_sine = fi.strike(wall, fi.Striker.rigid(0.1), fi.Contact.linear(1e5), at=None, speed=1.0)
    times = np.array([2e-3, 0.0, 5e-3, 1e-3])
    q, p = half_sine.modal_state(times, body=0)
    for i, t in enumerate(times):
        one_q, one_p = half_sine.modal_state([t], body=0)
        assert_allclose(q[i], one_q[0], rtol=1e-13, atol=1e-18)
        assert_allclose(p[i], one_p[0], rtol=1e-13)
    assert_allclose(q[1], 0.0, atol=0.0)
    with pytest.raises(ValueError, match="times must not be before the blow at 0 s"):
        half_sine.modal_state([-1e-3])


def test_motion_after_the_end_needs_no_replay():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=40, damping_ratio=0.01)
    stick, law = fi.Striker.rigid(0.02), fi.Contact.hertz(1e6)
    hit = fi.strike(plate, stick, law, at=(0.465, 0.3), speed=1.0, tolerance=1e-3, target_force=-20.0, duration=5e-3)
    history = hit.history
    times = np.linspace(0.0, 3.0 * history.end_time, 40)
    replayed = history.offset + history.states(times)[0] @ history.shape.T
    assert_allclose(history.motion(times), replayed, rtol=0, atol=1e-12 * np.abs(replayed).max())


@pytest.mark.parametrize("stiffness", [3e4, 1e6, 1e8])
def test_the_motion_by_modes_errs_by_less_than_stated(stiffness):
    """Against ten times as many modes, at the blow and elsewhere, in contact and after it, soft and hard."""
    few, many = (
        fi.analytic.rectangle(1.3, 1.0, mass=1.0, first_frequency=100.0, n_modes=n, damping_ratio=1e-3)
        for n in (60, 600)
    )
    stick, law, speed = fi.Striker.rigid(0.05), fi.Contact.hertz(stiffness), {"at": (0.45, 0.3), "speed": 1.0}
    hit = fi.strike(few, stick, law, **speed, tolerance=1e-2, max_impacts=1)
    sounds = {"restitution": None, "sound": few.frequencies[-1]}
    truth = fi.strike(many, stick, law, **speed, tolerance=1e-5, max_impacts=1, quantity=sounds)
    end = hit.history.end_time
    for times in (np.linspace(0.0, end, 200), np.linspace(1.1 * end, 3.0 * end, 200)):
        for point in ((0.45, 0.3), (0.7, 0.6)):
            for name in ("displacement", "velocity"):
                moved, true = (getattr(response, name)([point], times) for response in (hit, truth))
                error = hit.motion_error([point], times, velocity=name == "velocity")
                off = np.abs(moved - true).max() / np.abs(true).max()
                assert off <= error <= 100.0 * off + 0.02
    moved = fi.strike(few, stick, law, **speed, start=hit.state(), max_impacts=1)
    assert moved.motion_error([(0.7, 0.6)], [end]) == np.inf  # nobody knows how it moved before


def test_motion_is_told_by_modes_of_the_same_body_only():
    """Found on another mesh, its mass may differ a little; another body is refused."""
    plate = fi.analytic.rectangle(1.0, 0.7, mass=2.0, first_frequency=60.0, n_modes=40)
    hit = fi.strike(plate, fi.Striker.rigid(0.02), fi.Contact.hertz(1e6), at=(0.4, 0.3), speed=1.0, tolerance=1e-2)
    assert hit.on(plate.scaled(mass=2.01)).target.mass == pytest.approx(2.01)
    for other in (plate.scaled(mass=2.06), plate.scaled(first_frequency=62.0)):
        with pytest.raises(ValueError, match="modes must be of the body struck"):
            hit.on(other)
