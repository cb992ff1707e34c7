"""Meshes: areas, outlines, named edges, refinement."""

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose

from fem_impact import mesh


def test_rectangle_is_covered_once_and_its_edges_lie_where_their_names_say():
    plate = mesh.rectangle(1.55, 1.0, size=0.13)
    assert_allclose(plate.area, 1.55, rtol=1e-13)  # a sum of rounded areas
    assert_allclose(plate.perimeter, 5.1, rtol=1e-13)
    (x, y), (u, v) = plate.points[plate.facets].transpose(1, 2, 0)
    assert_allclose(0.5 * np.sum(x * v - y * u), 1.55)  # the boundary runs with the body on its left
    for name, axis, value in (("left", 0, 0.0), ("right", 0, 1.55), ("bottom", 1, 0.0), ("top", 1, 1.0)):
        on = plate.points[plate.facets[plate.edges[name]]]
        assert_allclose(on[..., axis], value, atol=1e-15)
    assert len(plate.edges["boundary"]) == len(plate.facets)


@pytest.mark.parametrize(("n", "noted"), [(24, False), (48, True), (480, True)])
def test_a_polygon_like_points_of_a_curve_says_so_and_stays_one(n, noted):
    """An advice that `find_modes` repeats where corners of held sides meet no tolerance; outline follows it."""
    corners = np.exp(2j * np.pi * np.arange(n) / n)[:, None].view(float) * [0.2, 0.15]
    shape = mesh.polygon(corners)
    assert len(shape.edges) == n + 2 and not shape.curved.any()
    assert [note.startswith(f"{n} corners") and "fi.mesh.outline" in note for note in shape.notes] == [True] * noted
    assert mesh.outline(corners).curved.all()


def test_refined_mesh_keeps_shape_and_edge_names():
    coarse = mesh.rectangle(1.0, 0.5, size=0.25)
    fine = coarse.refined(2.0)
    assert len(fine.cells) == 4 * len(coarse.cells)
    assert set(fine.edges) == set(coarse.edges)


def test_polygon_names_its_sides_and_holes():
    plate = mesh.polygon([(0, 0), (0, 1), (2, 1), (2, 0)], [[(0.5, 0.4), (0.8, 0.4), (0.8, 0.7)]], size=0.3)
    assert_allclose(plate.area, 2.0 - 0.045, rtol=1e-12)
    assert_allclose(plate.points[plate.facets[plate.edges["edge0"]]][..., 0], 0.0, atol=1e-15)
    assert_allclose(plate.points[plate.facets[plate.edges["edge1"]]][..., 1], 1.0)
    assert len(plate.edges["outer"]) + len(plate.edges["hole0"]) == len(plate.edges["boundary"])


def test_mesh_far_from_the_origin_is_the_same_one_moved():
    here = mesh.polygon([(0, 0), (1, 0), (0, 1)], size=0.2)
    there = mesh.polygon([(1e4, 0), (1e4 + 1, 0), (1e4, 1)], size=0.2)
    assert_allclose(there.points - [1e4, 0], here.points, atol=1e-10)  # 1e4 in floats leaves 2e-12


ROUND = np.linspace(0.0, 2.0 * np.pi, 10**6, endpoint=False)


test_what_is_no_body_or_would_take_for_ever_is_refused = refusing([
    (lambda: mesh.rectangle(-1.0, 1.0), "length must be positive, got -1 m"),
    (lambda: mesh.rectangle(1.0, 1.0, size=0.0), "size must be positive, got 0 m"),
    (lambda: mesh.disk(1.0, 1.0), "hole must be smaller than radius = 1 m, got 1 m"),
    (lambda: mesh.polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), "must not cross or touch itself.*Self-intersection"),
    (lambda: mesh.polygon([(0, 0), (1, 1)]), "corners must have 3 to 2000 corners, got 2"),
    (lambda: mesh.polygon([(0, 0), (1, 0), (0, 1)], [[(2, 2), (3, 2), (3, 3)]]), "must lie inside the outline"),
    (lambda: mesh.polygon([(0, 0), (1, 0), (0, 1)], [[(0, 0.1), (0.2, 0.1), (0.2, 0.2)]]), "and not touch it"),
    (lambda: mesh.polygon([(0, 0), (1, 0), (0, 1)], [[(0.1, 0.1), (0.3, 0.1), (0.1, 0.3)]] * 2),
     r"holes\[1\] must not overlap or touch holes\[0\]"),
    (lambda: mesh.line(float("nan")), "length must be finite"),
    # what would take for ever, at once
    (lambda: mesh.rectangle(1.0, 1.0, size=1e-9), r"size must be larger: 1e-09 m gives about 2e\+18 elements"),
    (lambda: mesh.disk(1.0, size=1e-9), "size must be larger"),
    (lambda: mesh.line(1.0, size=1e-12), "size must be larger"),
    (lambda: mesh.rectangle(1.0, 1.0).refined(1e9), "size must be larger"),
    (lambda: mesh.polygon(np.column_stack([np.cos(ROUND), np.sin(ROUND)])), "corners must have 3 to 2000 corners"),
])  # fmt: skip


def test_a_polygon_may_lie_far_from_the_origin():
    """Where it was refused as too slender."""
    corners = np.array([[0.2, 0.0], [0.05, 0.25], [-0.2, 0.12], [-0.15, -0.15], [0.08, -0.22]])
    assert mesh.polygon(corners + 4e5).area == pytest.approx(0.1215, rel=1e-9)
    with pytest.raises(ValueError, match=r"longer than wide near \(4\d{5}, 4\d{5}\) m; widen it there"):
        mesh.polygon(np.add([(0, 0), (1, 0), (1, 1), (0.5, 1), (0.5, 2), (0.49999, 2), (0.49999, 1), (0, 1)], 4e5))


@pytest.mark.parametrize(("n", "noted"), [(24, False), (40, True)])
def test_corners_of_a_polygon_that_turn_like_points_of_a_curve_are_noted(n, noted):
    """With points along its sides, too; a circle of facets that `fi.mesh.outline` draws takes 26."""
    corners = 0.2 * np.exp(2j * np.pi * np.arange(n) / n)
    points = np.column_stack([corners, 0.5 * (corners + np.roll(corners, -1))]).reshape(-1, 1).view(float)
    assert any(f"{n} corners turn as gently" in note for note in mesh.polygon(points).notes) == noted
