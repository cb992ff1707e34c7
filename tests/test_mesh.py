"""Meshes: areas, outlines, named edges, refinement."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_impact import mesh


def test_rectangle_is_covered_once_and_its_edges_lie_where_their_names_say():
    plate = mesh.rectangle(1.55, 1.0, size=0.13)
    assert_allclose(plate.area, 1.55, rtol=1e-13)  # a sum of rounded areas
    assert_allclose(plate.perimeter, 5.1, rtol=1e-13)
    for name, axis, value in (("left", 0, 0.0), ("right", 0, 1.55), ("bottom", 1, 0.0), ("top", 1, 1.0)):
        on = plate.points[plate.facets[plate.edges[name]]]
        assert_allclose(on[..., axis], value, atol=1e-15)
    assert len(plate.edges["boundary"]) == len(plate.facets)


def test_boundary_runs_with_the_body_on_its_left():
    plate = mesh.rectangle(1.0, 2.0, size=0.5)
    start, end = plate.points[plate.facets].transpose(1, 0, 2)
    assert_allclose(0.5 * np.sum(start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]), 2.0)  # signed area


def test_refined_mesh_keeps_shape_and_edge_names():
    coarse = mesh.rectangle(1.0, 0.5, size=0.25)
    fine = coarse.refined(2.0)
    assert len(fine.cells) == 4 * len(coarse.cells)
    assert set(fine.edges) == set(coarse.edges)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: mesh.rectangle(-1.0, 1.0), "length must be positive, got -1 m"),
        (lambda: mesh.rectangle(1.0, 1.0, size=0.0), "size must be positive, got 0 m"),
        (lambda: mesh.line(float("nan")), "length must be finite"),
    ],
)
def test_refuses_lengths_that_are_none(make, text):
    with pytest.raises(ValueError, match=text):
        make()
