"""Triangles that shrink towards points: a conforming mesh of the same body, small where it is asked for."""

from collections import Counter

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.fe.splitting import DEPTH, distance, towards_points

BODIES = {
    "square": (fi.mesh.rectangle(1.0, 1.0), 1.0),
    "L": (fi.mesh.polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]), 3.0),
    "ring": (fi.mesh.disk(1.0, 0.3), np.pi * (1.0 - 0.3**2)),
}
PLACES = {"square": [(0.31, 0.47), (1.0, 0.5), (0.0, 0.0)], "L": [(1.0, 1.0), (0.2, 1.999)], "ring": [(1.0, 0.0)]}


def areas(mesh):
    a, b, c = np.moveaxis(mesh.points[mesh.cells], 1, 0)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


@pytest.mark.parametrize("coarseness", [1.0, 4.0, 64.0])
def test_triangles_at_a_point_are_as_coarse_as_asked_for(coarseness):
    mesh, place = fi.mesh.rectangle(1.0, 1.0), np.array([[0.31, 0.47]])
    fine = towards_points(mesh, place, np.zeros(len(mesh.facets), bool), coarseness=coarseness)
    corner = fine.points[fine.cells]
    nearest = np.linalg.norm(corner.mean(axis=1) - place, axis=1).argmin()
    longest = np.linalg.norm(corner[nearest] - np.roll(corner[nearest], 1, axis=0), axis=1).max()
    allowed = coarseness * DEPTH * mesh.area / mesh.perimeter
    assert 0.4 * allowed < longest <= allowed  # the longest side of a triangle is halved every second time


@pytest.mark.parametrize(("name", "place"), [(name, place) for name in BODIES for place in PLACES[name]])
def test_triangles_shrink_towards_a_point(name, place):
    mesh, area = BODIES[name]
    fine = towards_points(mesh, np.array([place]), np.zeros(len(mesh.facets), bool))
    size = np.abs(areas(fine))
    assert size.min() > 0.0
    assert_allclose(size.sum(), area, rtol=1e-12 if name != "ring" else 2e-2)  # chords of the rim, as before
    distance = np.linalg.norm(fine.points[fine.cells] - np.array(place), axis=2).min(axis=1)
    assert np.sqrt(size[distance.argmin()]) < 2.0 * DEPTH * np.ptp(mesh.points, axis=0).max()
    sides = Counter(tuple(sorted(side)) for cell in fine.cells.tolist() for side in zip(cell, cell[1:] + cell[:1]))
    outer = {tuple(sorted(facet)) for facet in fine.facets.tolist()}
    assert all(count == (1 if side in outer else 2) for side, count in sides.items())  # no hanging node
    assert {name: len(facets) for name, facets in fine.edges.items()}.keys() == mesh.edges.keys()


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
