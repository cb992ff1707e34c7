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


def test_motion_is_told_by_modes_of_the_same_body_only():
    """Found on another mesh, its mass may differ a little; another body is refused."""
    plate = fi.analytic.rectangle(1.0, 0.7, mass=2.0, first_frequency=60.0, n_modes=40)
    hit = fi.strike(plate, fi.Striker.rigid(0.02), fi.Contact.hertz(1e6), at=(0.4, 0.3), speed=1.0, tolerance=1e-2)
    assert hit.on(plate.scaled(mass=2.01)).target.mass == pytest.approx(2.01)
    for other in (plate.scaled(mass=2.06), plate.scaled(first_frequency=62.0)):
        with pytest.raises(ValueError, match="modes must be of the body struck"):
            hit.on(other)
