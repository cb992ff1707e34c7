"""What a step says of the error of the peak force."""

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from fem_impact.impact.compiled import law, misfit

STEP = 1e-4, 0.9, 1.3e-4, -0.1, 5e-5  # [m], [m/s], [m], [m/s], [s] approach and rate at both ends, length


@njit
def suggested(mean, loss, peak):
    return misfit.misfit(mean, *STEP, law.simple(1e6, 1.5, loss, 0.0), peak)


@pytest.mark.parametrize("loss, factor", [(0.0, 1.5), (0.2, 5.0)])
def test_a_step_is_judged_by_how_far_its_mean_force_is_from_the_law(loss, factor):
    d0, v0, d1, v1, h = STEP
    t = (np.arange(4000) + 0.5) / 4000  # midpoint rule: errs by 1e-8
    d = d0 + t * (h * v0 + t * (3.0 * (d1 - d0) - h * (2.0 * v0 + v1) + t * (2.0 * (d0 - d1) + h * (v0 + v1))))
    mean = (1e6 * d**1.5 * (1.0 + loss * np.gradient(d, t) / h)).mean()
    assert suggested(mean, loss, mean) < 1e-4 * mean  # what Gauss's rule of three nodes misses
    assert_allclose(suggested(1.01 * mean, loss, mean), factor * 0.01 * mean, rtol=0.02)
    assert suggested(mean, loss, 4.0 * mean) == suggested(0.0, loss, mean) == 0.0  # too far from the peak to count
