"""How singular corners are, against Williams' exponents, and triangles that shrink towards them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.fe.corners import around_corners, exponent


@pytest.mark.parametrize(
    ("degrees", "kinds", "expected"),
    [
        (270.0, ("clamped", "clamped"), 1.5444837),  # Williams (1952): sin(1.5 pi z) = -z sin(1.5 pi), z = 0.5444837
        (360.0, ("clamped", "clamped"), 1.5),  # a crack: the square root
        (270.0, ("hinged", "hinged"), 4.0 / 3.0),  # twice pi over the angle
    ],
)
def test_exponent_of_the_deflection_at_a_corner(degrees, kinds, expected):
    found = exponent(np.radians(degrees), kinds, 0.3)
    assert_allclose(found, expected, atol=2e-6)


def test_a_clamped_right_angle_is_smooth_enough():
    assert exponent(np.radians(90.0), ("clamped", "clamped"), 0.3) > 2.5  # bounded bending moments


def test_only_the_notch_of_an_l_is_graded():
    mesh = fi.mesh.polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    fine = around_corners(mesh, ["clamped"] * len(mesh.facets), 0.3)[-1]
    side = np.linalg.norm(fine.points[fine.cells] - np.roll(fine.points[fine.cells], 1, axis=1), axis=2).max(axis=1)
    near = np.linalg.norm(fine.points[fine.cells] - [1.0, 1.0], axis=2).min(axis=1) < 1e-12
    assert side[near].max() < 1e-3 < 0.05 < side[~near].max()
