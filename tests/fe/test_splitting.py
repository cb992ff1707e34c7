"""Triangles that shrink towards points: a conforming mesh of the same body, small where it is asked for."""

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.fe.splitting import distance, towards_points


@pytest.mark.parametrize(("coarseness", "growth"), [(1.0, 0.7), (64.0, 1.0)])
def test_triangles_grow_with_the_distance_to_the_point(coarseness, growth):
    """The error goes as the power eight of the growth: 0.7 leaves a millionth, and 1 is enough for coarse blows."""
    mesh, place = fi.mesh.rectangle(1.0, 1.0, size=0.5), np.array([[0.31, 0.47]])
    fine = towards_points(mesh, place, np.zeros(len(mesh.facets), bool), coarseness=coarseness)
    corner = fine.points[fine.cells]
    after = np.roll(corner, -1, axis=1)
    longest = np.linalg.norm(after - corner, axis=2).max(axis=1)
    away = distance(place[0], corner, after).min(axis=1)
    far = longest > 1.01 * coarseness * 2.0**-8 * 0.25  # beyond the smallest, of a 256th of area over perimeter
    assert 0.8 * growth < (longest[far] / away[far]).max() <= growth * (1.0 + 1e-12)
