"""The scatter over taps that noise alone makes, on a problem whose answer is known."""

import numpy as np
import pytest

from fem_impact.taps.scatter import Scatter, scatter
from fem_impact.taps.unknowns import Unknown


class Straight:
    """A linear problem: each tap measures its own value 50 times, besides a momentum and an onset that matter not."""

    def __init__(self, n_taps):
        self.free, self.own, self.n_shared = (Unknown("a", 1.0, 10.0),), ("a",), 1
        self.data = type("Data", (), {"n_taps": n_taps})

    def jacobian(self, x):
        n = self.data.n_taps
        out = np.zeros((n, 50, 1 + 3 * n))
        out[:, :, 0] = 1.0
        for tap in range(n):
            out[tap, :, 1 + 2 * n + tap] += 1.0
            out[:, :, 1 + 2 * n + tap] -= 1.0 / n
        return out.reshape(-1, 1 + 3 * n)

    def apart(self, x):
        far = x[None, 1 + 2 * self.data.n_taps :]
        return far - far.mean()

    def values(self, x, tap=None):
        return {"a": float(np.exp(x[0] + (0.0 if tap is None else self.apart(x)[0, tap])))}


def test_noise_makes_the_spread_of_independent_means():
    problem, noise = Straight(5), 0.04
    x = np.concatenate([[np.log(2.0)], np.zeros(10), [0.1, -0.1, 0.2, 0.0, 0.3]])
    made = scatter(problem, x, 0, noise, 200)
    assert made.by_noise == pytest.approx(np.sqrt(noise / 50), rel=1e-9)  # standard error of a mean of 50
    assert made.deviation == pytest.approx(np.std([0.1, -0.1, 0.2, 0.0, 0.3], ddof=1)) and made.mean == 2.0
    assert made.chance < 1e-3


def test_a_spread_as_noise_makes_it_is_no_surprise():
    assert Scatter("a", np.ones(5), 1.0, 0.1, 0.1, True, 200).chance == pytest.approx(0.41, abs=0.01)  # F(1; 4, 200)
