"""The way along a ridge, on a problem of products whose ridge is known."""

import numpy as np
import pytest

from fem_impact.taps import ridges
from fem_impact.taps.solver import directions
from fem_impact.taps.unknowns import Unknown

RANGES = (Unknown("a", 1.0, 100.0), Unknown("b", 0.0, 10.0), Unknown("c", 0.1, 30.0))


class Products:
    """Two residuals, which tell a / b and c / a**2 only: whatever a is, b and c follow."""

    free, needless, n_shared = RANGES, (), 3
    bounds = tuple(np.array(ends, float) for ends in zip(*(each.bounds for each in RANGES)))

    def jacobian(self, x):
        return np.array([[1.0, -1.0 / x[1], 0.0], [-2.0, 0.0, 1.0]])  # of log a - log(10 x1), x2 - 2 log a


@pytest.fixture
def trail():
    x = np.array([np.log(4.0), 0.2, np.log(2.0)])
    return ridges.way(Products(), x, 0, Products.bounds, noise=1e-6, ridge=0.1)


def test_values_go_by_powers_along_a_ridge(trail):
    x = trail.to(np.log(8.0))
    assert x == pytest.approx([np.log(8.0), 0.4, np.log(8.0)])  # b with a, c with its square
    assert trail.spread > 1e6 and trail.factors.tolist() == [False, True, False]


def test_the_nearest_bound_ends_the_way(trail):
    up, meets = trail.reach(1.0)
    assert up == pytest.approx(0.5 * np.log(15.0)) and meets.tolist() == [
        False,
        False,
        True,
    ]  # c reaches 30 at sqrt(15) times a
    down, meets = trail.reach(-1.0)
    assert down == pytest.approx(0.5 * np.log(20.0)) and meets.tolist() == [False, False, True]  # c reaches 0.1
    stopped = ridges.way(Products(), trail.x, 0, Products.bounds, 1e-6, 0.1, meets)
    assert stopped.to(np.log(8.0))[2] == trail.x[2] and stopped.spread == pytest.approx(1e-3 / 2.0)


def test_the_next_stretch_goes_on_as_the_last(trail):
    moved = trail.on(np.array([np.log(8.0), 0.3, np.log(5.0)]))
    x = moved.to(np.log(16.0))
    assert x == pytest.approx([np.log(16.0), 0.45, np.log(12.5)])


def test_small_parts_of_a_range_go_straight(trail):
    near = trail.on(np.array([np.log(3.0), 1e-4, np.log(1.0)]))
    assert not near.factors.any() and near.to(np.log(2.0))[1] == 1e-4


def test_without_a_ridge_parts_of_ranges_go_straight():
    x = np.array([np.log(4.0), 0.2, np.log(2.0)])
    straight = ridges.way(Products(), x, 0, Products.bounds, noise=1e-6, ridge=np.inf)
    assert straight.to(np.log(8.0))[1] == pytest.approx(0.2 + 0.2 * np.log(2.0))


def test_directions_that_steps_cannot_tell_are_apart():
    basis = directions(np.array([[1.0, -1.0, 0.0], [1.0, -1.0, 1e-9], [0.0, 0.0, 3.0]]))
    assert basis.told.tolist() == [True, True, False] and np.abs(basis.flat[:, 0] / basis.flat[0, 0]) == pytest.approx(
        [1.0, 1.0, 0.0], abs=1e-6
    )
