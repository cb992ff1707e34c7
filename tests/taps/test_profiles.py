"""Profiles of the likelihood, on problems whose answer is known."""

import numpy as np
import pytest
from scipy.stats import t

from fem_impact.taps import profiles


def parabola(open_=(False, False), log=False, n=41, width=0.1):
    """The profile of a value 2 with a Gaussian likelihood of the given width."""
    values = np.linspace(1.0, 3.0, n)
    rise = ((values - 2.0) / width) ** 2
    return profiles.Profile("a", 2.0, values, rise, open_, ("", ""), {"b": values**-1.5}, 100, 1.0, 3.0, log)


@pytest.mark.parametrize("level", [0.5, 0.9, 0.95])
def test_the_interval_of_a_gaussian_is_students(level):
    low, high = parabola().interval(level)
    half = 0.1 * t.ppf(0.5 + 0.5 * level, 100)
    assert np.allclose([low, high], [2.0 - half, 2.0 + half], rtol=1e-4)


def test_the_curve_drawn_is_smooth_and_goes_through_the_points():
    made = parabola(n=7)
    x, rise = made.curve()
    assert np.interp(2.1, x, rise) == pytest.approx(1.0, rel=0.02) and len(x) == 200


def test_open_ends_are_the_ends_of_the_range():
    flat = parabola(open_=(True, True), width=100.0)
    assert flat.interval() == (1.0, 3.0) and flat.told == "open"
    assert parabola().told == "told" and parabola(open_=(False, True)).told == "limited"


def test_the_ridge_of_a_flat_profile_is_the_power_of_the_others():
    assert parabola(open_=(True, True), log=True, width=100.0).ridge == pytest.approx({"b": -1.5})


def test_white_residuals_are_white_and_coloured_ones_widen():
    rng = np.random.default_rng(3)
    white = rng.standard_normal((5, 60))
    noise, freedom, chance = profiles.variance(white, 10)
    assert abs(noise - 1.0) < 0.2 and freedom == 290 and chance > profiles.DOUBTED
    coloured = np.array([np.convolve(row, np.ones(4), mode="same") for row in white])
    wider, fewer, chance = profiles.variance(coloured, 10)
    assert chance < 1e-6 and fewer < 150 and wider > 2.5 * np.mean(coloured**2)
