"""Heights of curved bodies: closed forms, and surfaces through points."""

import pickle

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact._base import identity

RNG = np.random.default_rng(3)
PLACES = RNG.uniform(-0.2, 0.2, (40, 2))


def test_bodies_have_their_radius():
    x, y = PLACES.T
    for rise, wanted in (
        (fi.rise.cap(2.0), np.sqrt(4.0 - x**2 - y**2) - 2.0),
        (fi.rise.cap(-2.0), 2.0 - np.sqrt(4.0 - x**2 - y**2)),
        (fi.rise.cylinder(2.0), np.sqrt(4.0 - y**2) - 2.0),
        (fi.rise.cylinder(2.0, angle=0.5 * np.pi), np.sqrt(4.0 - x**2) - 2.0),
        (fi.rise.saddle(2.0), np.sqrt(4.0 - x**2) - np.sqrt(4.0 - y**2)),
    ):
        assert_allclose(rise(PLACES), wanted, atol=1e-15)
    with pytest.raises(ValueError, match=r"radius must be larger than the body, got 0\.1 m"):
        fi.rise.cap(0.1)(PLACES)


def test_a_cymbal_is_flat_at_its_edge_and_has_its_heights_on_top():
    shape = fi.rise.cymbal(0.2, bow=0.02, cup_radius=0.05, cup=0.015)
    edge, top = shape(np.array([[0.0, 0.2], [0.0, 0.0]]))
    assert edge == pytest.approx(0.0, abs=1e-17) and top == pytest.approx(0.035, rel=1e-12)


def test_a_table_goes_through_its_points_and_on_straight_beyond_them():
    plane = fi.rise.table(PLACES, PLACES @ [0.1, -0.2] + 0.03)
    far = np.array([[0.5, 0.5], [-0.4, 0.1]])
    assert_allclose(plane(far), far @ [0.1, -0.2] + 0.03, atol=1e-12)  # rounding, over the distance of points
    errors = []
    for n in (9, 17):
        grid = np.column_stack([axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-0.3, 0.3, n)])])
        cap = fi.rise.table(grid, fi.rise.cap(1.0)(grid))
        assert_allclose(cap(grid), fi.rise.cap(1.0)(grid), atol=1e-15)
        errors.append(np.abs(cap(PLACES) - fi.rise.cap(1.0)(PLACES)).max())
    assert np.log2(errors[0] / errors[1]) > 3.0  # third order at least: the slopes are of quadratics and splines


def test_a_table_follows_any_quadratic_up_to_the_rim():
    """Natural splines, which are straight at the rim, were 1e-3 off; so were any on irregular points."""
    dome = lambda points: 0.03 - points[:, 0] ** 2 - 0.5 * points[:, 0] * points[:, 1]  # noqa: E731
    grid = np.column_stack([axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-0.3, 0.3, 5)])])
    for known in (grid, np.vstack([PLACES, 1.5 * PLACES, PLACES[:5], PLACES[5:9] + 1e-15])):  # some twice
        assert_allclose(fi.rise.table(known, dome(known))(0.7 * PLACES), dome(0.7 * PLACES), atol=1e-12)


def test_a_table_follows_a_bump_as_splines_do():
    """Through 9 x 9 points, of which three lie on its slope, slopes of quadratics around each point erred by 7 %."""
    bump = lambda points: np.exp(-((points / 0.12) ** 2).sum(axis=1))  # noqa: E731
    grid = np.column_stack([axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-0.3, 0.3, 9)])])
    assert np.abs(fi.rise.table(grid, bump(grid))(PLACES) - bump(PLACES)).max() < 0.035  # of splines: 0.030


def test_a_table_is_told_by_its_numbers_whenever_it_was_made():
    one, same, other = (fi.rise.table(PLACES, PLACES[:, i]) for i in (0, 0, 1))
    one(PLACES)
    assert identity.identify(one) == identity.identify(same) != identity.identify(other)
    assert_allclose(pickle.loads(pickle.dumps(one))(PLACES), PLACES[:, 0], atol=1e-15)


test_tables_that_are_no_surface_are_refused = refusing([
    (PLACES[:3], np.zeros(3), "points must be four or more, got 3"),
    (np.outer(np.arange(5.0), [1.0, 2.0]), np.zeros(5), "points must not all lie on one line"),
    (PLACES, np.zeros(3), "heights must have shape"),
], fi.rise.table)  # fmt: skip
