"""Tests of free motion at many times, against the exponential of each mode's equations."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from fem_impact.impact import free_motion


@pytest.mark.parametrize("order", [0, 1, 2])
def test_every_mode_moves_as_its_equations_say(order):
    # below, at and beyond critical damping, with a constant force; more times than a block holds
    rng = np.random.default_rng(3)
    zeta = np.array([0.0, 0.003, 0.3, 0.999, 1.0, 1.001, 4.0])
    omega, bias = rng.uniform(50.0, 4000.0, (2, len(zeta)))
    q, p = rng.normal(size=(2, len(zeta))) * np.array([[1.0], [1000.0]])
    times, weights = 0.01 + 1e-4 * np.arange(300), rng.normal(size=(1, len(zeta)))
    expected = np.zeros(len(times))
    for n, w in enumerate(omega):
        pull = np.array([[0.0, 1.0], [-w * w, -2.0 * zeta[n] * w]])
        rest = bias[n] / w**2
        states = [expm(pull * (t - times[0])) @ (q[n] - rest, p[n]) for t in times]
        rates = {0: lambda x: x[0], 1: lambda x: x[1], 2: lambda x: (pull @ x)[1]}[order]  # noqa: B023
        expected += weights[0, n] * np.array([rates(x) for x in states])
    found = free_motion.swing(omega, zeta, bias, (q, p), times, weights, order)
    # critical damping is moved aside by 1e-6
    assert_allclose(found, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())
