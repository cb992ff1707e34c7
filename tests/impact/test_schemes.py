"""One step of schemes A and A4 for a mass on one contact: discrete energy identity and order."""

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from fem_impact.impact.compiled import law, schemes

LAWS = [(1e5, 1.0, 0.0), (1e7, 1.5, 0.0), (3e6, 1.3, 1e-7)]
MASS = 0.01  # [kg]


@njit
def constant(h, d0, v0, k, a, loss, c):
    """Scheme A: approach, rate and energies after a step of a mass pressed by its motion, and whether it settled."""
    spring = law.simple(k, a, loss, c)
    start = law.point_at(d0, spring)
    end, f = schemes.solve_constant(start, d0 + h * v0, 0.5 * h * h / MASS, h, spring)
    return end.approach, v0 - h * f / MASS, start.energy, end.energy, True


@njit
def ramp(h, d0, v0, k, a, loss, c):
    """The same by scheme A4: a rigid mass answers a unit of the force t/h - 1/2 with these six numbers."""
    spring = law.simple(k, a, loss, c)
    start = law.point_at(d0, spring)
    b = h * h / MASS
    free = schemes.Free(d0 + h * v0, d0 + 0.5 * h * v0, v0)
    own = schemes.Own(0.5 * b, -b / 12.0, b / 6.0, -b / 24.0, h / MASS, 0.0)
    guess = schemes.linear_guess(start, free, own, spring)
    settled, end, f, _ = schemes.solve_ramp(guess, h, start, v0, free, own, spring)
    return end.approach, v0 - h * f / MASS, start.energy, end.energy, settled


@pytest.mark.parametrize("step", [constant, ramp])
@pytest.mark.parametrize("k, a, c", LAWS)
@pytest.mark.parametrize("d0, v0", [(0.0, 1.0), (3e-4, 0.4), (2e-4, -0.8)])
def test_a_step_keeps_the_energy(step, k, a, c, d0, v0):
    for h in (1e-8, 1e-6, 1e-5, 4e-5):
        _, v1, before, after, settled = step(h, d0, v0, k, a, 0.0, c)
        assert settled
        whole = 0.5 * MASS * v0 * v0 + before
        assert_allclose(0.5 * MASS * v1 * v1 + after, whole, rtol=2e-14)  # rounding: the step's length does not enter


@pytest.mark.parametrize("step", [constant, ramp])
@pytest.mark.parametrize("d0, v0", [(3e-4, 0.4), (3e-4, -0.8)])
def test_a_lossy_step_creates_no_energy(step, d0, v0):
    for h in (1e-6, 1e-5, 4e-5):
        _, v1, before, after, settled = step(h, d0, v0, 1e7, 1.5, 0.2, 0.0)
        assert settled
        assert 0.5 * MASS * v1 * v1 + after < 0.5 * MASS * v0 * v0 + before


@pytest.mark.parametrize("h", [1e-2, 1.0])
def test_scheme_a_takes_any_step(h):
    """One step longer than the whole contact gives all the energy back as motion away from it."""
    y, v1, before, after, _ = constant(h, 2e-4, 0.5, 1e5, 1.0, 0.0, 0.0)
    assert y < 0.0 and after == 0.0
    assert_allclose(0.5 * MASS * v1 * v1, 0.5 * MASS * 0.25 + before, rtol=1e-13)
    assert v1 < 0.0


@pytest.mark.parametrize("step, order, loss", [(constant, 2, 0.0), (ramp, 4, 0.0), (constant, 2, 0.3), (ramp, 4, 0.3)])
@pytest.mark.parametrize("k, a", [(1e5, 1.0), (1e7, 1.5)])
def test_order_in_pressed_contact(step, order, loss, k, a):
    """From 0.2 mm at 0.6 m/s over 0.1 ms, against DOP853."""
    end, d0, v0 = 1e-4, 2e-4, 0.6
    exact = solve_ivp(
        lambda _, z: [z[1], -k * z[0] ** a * (1.0 + loss * z[1]) / MASS], (0.0, end), [d0, v0], "DOP853",
        rtol=1e-13, atol=1e-18,
    ).y[:, -1]  # fmt: skip
    errors = []
    for count in (8, 16):
        d, v = d0, v0
        for _ in range(count):
            d, v, _, _, settled = step(end / count, d, v, k, a, loss, 0.0)
            assert settled
        errors.append(np.hypot(v - exact[1], (d - exact[0]) * np.sqrt(k / MASS)))
    assert abs(np.log2(errors[0] / errors[1]) - order) < 0.35
