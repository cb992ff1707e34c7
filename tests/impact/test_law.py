"""The contact law: its force is the slope of its energy, and the average slopes hold for any two approaches."""

import mpmath as mp
import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_allclose

from fem_impact.impact.compiled import build, law

LAWS = [(1e5, 1.0, 0.0), (1e7, 1.5, 0.0), (3e6, 1.3, 0.0), (1e5, 1.0, 3e-6), (1e7, 1.5, 1e-7), (1e4, 0.7, 1e-5)]


@njit
def at(d, k, a, c):
    return law.point_at(d, law.simple(k, a, 0.0, c))


@njit
def slopes(d0, d1, k, a, c):
    spring = law.simple(k, a, 0.0, c)
    return law.mean_slopes(law.point_at(d0, spring), law.point_at(d1, spring), spring)


@njit
def smooth_force(x, v, k, a, loss):
    return law.smooth_force(x, v, law.simple(k, a, loss, 0.0))


@pytest.mark.parametrize("k, a, c", LAWS)
def test_compression_and_series_spring_make_up_the_approach(k, a, c):
    for d in (1e-12, 1e-6, 1e-3, 1.0):
        point = at(d, k, a, c)
        assert_allclose(point.force, k * point.compression**a, rtol=1e-14)
        assert_allclose(point.compression + c * point.force, d, rtol=1e-14)
    assert at(-1e-3, k, a, c)[2:] == (0.0, 0.0)


@pytest.mark.parametrize("k, a, c", LAWS)
def test_average_slopes_of_close_approaches_are_force_and_tangent(k, a, c):
    """The differences would lose all digits here; the slopes at the middle err by the square of the distance."""
    d, step = 2e-4, 1e-12
    energy, force = slopes(d - step, d + step, k, a, c)
    point = at(d, k, a, c)
    tangent = a * point.force / point.compression
    assert_allclose(energy, point.force, rtol=1e-13)
    assert_allclose(force, tangent / (1.0 + c * tangent), rtol=1e-13)


@pytest.mark.parametrize("a", [1.3, 1.5, 2.5, 3.5])
@pytest.mark.parametrize("apart", [1e-9, 1.9e-4, 2.1e-4, 0.1])  # below and above where a series takes over
def test_average_slopes_are_exact_at_any_distance(a, apart):
    k, d0, d1 = 1e6, 2e-4, 2e-4 * (1.0 + apart)
    with mp.workdps(40):
        energy, force = (
            k / (a + 1) ** n * (mp.mpf(d1) ** (a + n) - mp.mpf(d0) ** (a + n)) / (mp.mpf(d1) - d0) for n in (1, 0)
        )
    assert_allclose(slopes(d0, d1, k, a, 0.0), [float(energy), float(force)], rtol=1e-12)  # r**4 = 1e-16, and rounding


@pytest.mark.parametrize("x, v", [(2e-4, 0.5), (2e-4, -1.5), (-1e-4, 0.2)])
@pytest.mark.parametrize("k, a", [(1e5, 1.0), (1e7, 1.5), (3e6, 2.0)])
def test_slopes_of_a_lossy_force_by_central_differences(x, v, k, a):
    loss, step = 0.3, 1e-4
    force, by_x, by_v = smooth_force(x, v, k, a, loss)
    assert_allclose(force, np.sign(x) * k * abs(x) ** a * (1.0 + loss * v), rtol=1e-14)
    ends = [smooth_force(x * (1.0 + sign * step), v, k, a, loss)[0] for sign in (-1.0, 1.0)]
    assert_allclose(by_x, (ends[1] - ends[0]) / (2.0 * x * step), rtol=1e-8)  # of order step**2
    ends = [smooth_force(x, v + sign * step, k, a, loss)[0] for sign in (-1.0, 1.0)]
    assert_allclose(by_v, (ends[1] - ends[0]) / (2.0 * step), rtol=1e-10)  # straight in the rate


def test_a_lossy_contact_never_pulls():
    assert smooth_force(1e-4, -4.0, 1e5, 1.5, 0.3) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("loss", [0.0, 0.1])
@pytest.mark.parametrize("each", law.LAWS, ids=lambda each: each.name)
def test_forces_with_corners_are_told_from_smooth_ones(each, loss):
    """A corner is where a head's second layer is reached, a contact yields or turns back, or a lossy one lets go."""
    rows = law.table([[1e6, 1.5], [1e6, 1.5, loss, 0.0, each.kind]])
    special = each is not law.LAWS[0]
    assert build.plain(law.special_of)(rows) == (special, special or loss > 0.0)
