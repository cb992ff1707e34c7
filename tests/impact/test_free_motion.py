"""Free motion at many times, against the exponential of each mode's equations."""

import numpy as np
from numpy.testing import assert_allclose
from scipy.linalg import expm

from fem_impact.impact import free_motion


def test_every_mode_moves_as_its_equations_say():
    """Displacement, velocity and acceleration, below, at and beyond critical damping, with a constant force."""
    rng = np.random.default_rng(3)
    zeta = np.array([0.0, 0.003, 0.3, 0.999, 1.0, 1.001, 4.0])
    omega, bias = rng.uniform(50.0, 4000.0, (2, len(zeta)))
    q, p = rng.normal(size=(2, len(zeta))) * np.array([[1.0], [1000.0]])
    times, weights = 0.01 + 1e-4 * np.arange(300), rng.normal(size=(1, len(zeta)))  # more times than a block holds
    expected = np.zeros((3, len(times)))
    for n, w in enumerate(omega):
        pull, rest = np.array([[0.0, 1.0], [-w * w, -2.0 * zeta[n] * w]]), bias[n] / w**2
        step, states = expm(pull * 1e-4), [np.array([q[n] - rest, p[n]])]
        for _ in times[1:]:
            states.append(step @ states[-1])
        states = np.array(states)
        expected += weights[0, n] * np.stack([states[:, 0], states[:, 1], (states @ pull.T)[:, 1]])
    for order, wanted in enumerate(expected):
        found = free_motion.flexible_motion(omega, zeta, bias, (q, p), times, weights, order)
        # critical damping is moved aside by 1e-6
        assert_allclose(found, wanted, rtol=0.0, atol=1e-6 * np.abs(wanted).max())
