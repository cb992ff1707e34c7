"""Curves recovered from the points of a rim: circles exactly, others at the order of their fit, corners kept."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_impact.mesh.facets import is_curved
from fem_impact.mesh.smooth_edges import _corners, join_smoothly, recover_rim, smooth_runs


def loop_of(place):
    n = len(place)
    return [np.column_stack([np.arange(n), (np.arange(n) + 1) % n])]


def n_corners_of(place):
    return np.count_nonzero(_corners(place))


def n_curved_of(place, middles):
    return np.count_nonzero(is_curved(place[loop_of(place)[0]], middles))


@pytest.mark.parametrize("turn", [1.0, -1.0])  # the rim of a disk, and that of a hole
def test_points_of_a_circle_are_a_circle_wherever_they_lie(turn):
    angle = turn * np.sort(np.random.default_rng(2).uniform(0.0, 2.0 * np.pi, 60))
    place = np.array([5.0, -3.0]) + 2.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    _, middles, tangents, curvatures = recover_rim(place, loop_of(place), {})
    assert (n_curved_of(place, middles), n_corners_of(place)) == (60, 0)
    assert_allclose(np.linalg.norm(middles - [5.0, -3.0], axis=1), 2.0, rtol=1e-12)
    assert_allclose(curvatures, turn / 2.0, rtol=1e-10)
    assert_allclose(tangents[:, 0], turn * np.column_stack([-np.sin(angle), np.cos(angle)]), atol=1e-11)


def ellipse(n):
    """Points of an ellipse of half axes 2 and 1, evenly in its angle, with tangents and curvatures there."""
    t = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    speed = np.hypot(2.0 * np.sin(t), np.cos(t))
    tangent = np.column_stack([-2.0 * np.sin(t), np.cos(t)]) / speed[:, None]
    return np.column_stack([2.0 * np.cos(t), np.sin(t)]), tangent, 2.0 / speed**3


def test_fit_to_an_ellipse_converges():
    """A quartic through five points: tangents of order four, curvatures of three, and middles of five."""
    errors = []
    for n in (40, 80):
        place, tangent, curvature = ellipse(n)
        _, middles, tangents, curvatures = recover_rim(place, loop_of(place), {})
        assert (n_curved_of(place, middles), n_corners_of(place)) == (n, 0)
        off = np.abs((middles / [2.0, 1.0]) ** 2 @ [1.0, 1.0] - 1.0)
        bend = np.abs(curvatures[:, 0] - curvature)
        errors.append([np.abs(tangents[:, 0] - tangent).max(), bend.max(), off.max()])
    order = np.log2(np.divide(*errors))
    assert (order > [3.5, 2.7, 4.5]).all(), order


def test_middles_from_the_file_are_kept_and_make_the_fit_finer():
    place, tangent, _ = ellipse(40)
    t = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False) + np.pi / 40
    known = np.column_stack([2.0 * np.cos(t), np.sin(t)])
    _, _, coarse, _ = recover_rim(place, loop_of(place), {})
    _, middles, fine, _ = recover_rim(place, loop_of(place), dict(enumerate(known)))
    assert_allclose(middles, known, atol=0.0)
    missed = [np.abs(tangents[:, 0] - tangent).max() for tangents in (coarse, fine)]
    assert missed[1] < missed[0] / 8.0  # half the distance between points: a sixteenth


def stadium(n):
    """Two half circles of radius 1 about (+-1, 0), of n facets each, and two sides of four facets."""
    angle = np.pi * (np.arange(n + 1) / n - 0.5)
    right = np.column_stack([1.0 + np.cos(angle), np.sin(angle)])
    top = np.column_stack([[0.5, 0.0, -0.5], [1.0, 1.0, 1.0]])
    return np.concatenate([right, top, -right, -top])


def test_half_circles_and_straight_sides_meet_smoothly():
    place = stadium(20)
    _, middles, tangents, curvatures = recover_rim(place, loop_of(place), {})
    assert (n_curved_of(place, middles), n_corners_of(place)) == (40, 4)
    curved = curvatures[:, 0] > 0.0
    assert_allclose(curvatures[curved], 1.0, rtol=1e-9)
    centre = np.where(middles[curved, :1] > 0.0, 1.0, -1.0) * [1.0, 0.0]
    assert_allclose(np.linalg.norm(middles[curved] - centre, axis=1), 1.0, rtol=1e-12)
    assert_allclose(tangents[:, 1], np.roll(tangents[:, 0], -1, axis=0), atol=1e-9)  # no kink anywhere
    runs, _ = smooth_runs(place)
    assert sorted(circle is not None for *_, circle in runs) == [False, False, True, True]
    assert [len(points) for points, _, circle in runs if circle] == [21, 21]


def test_a_square_has_four_corners_and_no_curve():
    half = np.array([(0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (4, 1), (4, 2), (4, 3)]) / 4.0
    place = np.concatenate([half, 1.0 - half])
    _, middles, _, curvatures = recover_rim(place, loop_of(place), {})
    assert (n_curved_of(place, middles), n_corners_of(place)) == (0, 4)
    assert_allclose(curvatures, 0.0, atol=0.0)


@pytest.mark.parametrize(("n", "n_corners"), [(8, 8), (24, 0)])
def test_a_polygon_of_few_sides_stays_one(n, n_corners):
    """An octagon turns by 45 degrees at each vertex: corners; 24 sides turn by 15: a circle."""
    assert n_corners_of(np.exp(2j * np.pi / n * np.arange(n))[:, None].view(float)) == n_corners


@pytest.mark.parametrize(("off", "found"), [(1e-6, True), (4e-6, False)])
def test_points_within_two_millionths_of_a_circle_lie_on_it(off, found):
    """Six digits of a file keep points that near; an ellipse of this flatness is followed as well by its fit."""
    angle = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    radius = 2.0 * (1.0 + off * np.cos(2.0 * angle))
    ((_, _, circle), *others), _ = smooth_runs(radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))
    assert not others and (circle is not None) == found


@pytest.mark.parametrize(("ratio", "corner"), [(3.0, False), (6.0, True)])
def test_a_turn_far_larger_than_its_neighbours_is_a_corner(ratio, corner):
    turn = np.full(9, 0.08)
    turn[4] *= ratio
    heading = np.concatenate([[0.0], np.cumsum(turn)])
    place = np.concatenate([np.zeros((1, 2)), np.cumsum(np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)])
    assert _corners(place)[5] == corner  # the middle one; the loop is closed by a straight side between two corners


@pytest.mark.parametrize(("angle", "smooth"), [(0.035, True), (0.07, False)])
def test_curves_that_nearly_share_a_tangent_are_joined(angle, smooth):
    tangents = np.tile([1.0, 0.0], (2, 2, 1))
    tangents[1] = np.cos(angle), np.sin(angle)
    join_smoothly(np.array([[0, 1]]), tangents, np.full((2, 2), 0.5))
    assert np.array_equal(tangents[0, 1], tangents[1, 0]) == smooth


def arc(centre, radius, start, stop, n):
    """Points (n, 2) of an arc between two angles [degrees], without its last."""
    angle = np.radians(start + (stop - start) * np.arange(n) / n)
    return np.asarray(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def radii_of(place):
    return sorted(round(circle[1], 6) for *_, circle in smooth_runs(place)[0] if circle)


@pytest.mark.parametrize("digits", [17, 7, 5])
def test_small_fillets_between_sides_of_many_points_are_arcs(digits):
    """Ten points along each side, four facets in each fillet: more points than count as few, and no scatter."""
    radii, fillets = [0.004, 0.01, 0.02, 0.035], []
    for i, (x, y) in enumerate([(0.3, 0.0), (0.3, 0.2), (0.0, 0.2), (0.0, 0.0)]):
        r = radii[i]
        fillets.append(arc((abs(x - r), abs(y - r)), r, 90.0 * i - 90.0, 90.0 * i + 22.5, 5))
    share = np.arange(13)[:, None] / 13
    place = np.concatenate([
        part for one, two in zip(fillets, fillets[1:] + fillets[:1])
        for part in (one[:-1], one[-1] + share * (two[0] - one[-1]))
    ])  # fmt: skip
    z = np.exp(0.7j) * (place @ [1.0, 1j])
    place = np.array([[float(f"{value:.{digits - 1}e}") for value in pair] for pair in zip(z.real, z.imag)])
    assert len(place) > 64
    runs, _ = smooth_runs(place)
    straight = [points for points, controls, circle in runs if circle is None and controls.shape[:2] == (1, 2)]
    assert len(runs) == 8 and len(straight) == 4
    if digits > 5:
        assert_allclose(radii_of(place), radii, rtol=1e-4)


def test_an_oval_is_four_arcs():
    """Arcs of radii 1 and 3 that meet smoothly: the centres of the larger lie 2 apart from those of the smaller."""
    h = 2.0 / np.sqrt(2.0)
    place = np.concatenate([
        arc((h, 0.0), 1.0, -45.0, 45.0, 12), arc((0.0, -h), 3.0, 45.0, 135.0, 20),
        arc((-h, 0.0), 1.0, 135.0, 225.0, 12), arc((0.0, h), 3.0, 225.0, 315.0, 20),
    ])  # fmt: skip
    assert radii_of(place) == [1.0, 1.0, 3.0, 3.0]
    _, _, tangents, curvatures = recover_rim(place, loop_of(place), {})
    assert_allclose(np.sort(curvatures[:, 0]), [1.0 / 3.0] * 40 + [1.0] * 24, rtol=1e-6)
    assert_allclose(tangents[:, 1], np.roll(tangents[:, 0], -1, axis=0), atol=1e-6)
