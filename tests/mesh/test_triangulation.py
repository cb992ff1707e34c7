"""Triangles that fill an outline: each place once, and the boundary on the true curve."""

from collections import Counter

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact import mesh
from fem_impact.mesh import loops
from fem_impact.mesh.loops import Arc, Outline
from fem_impact.mesh.triangulation import SPREAD, triangulate

ELLIPSE = Arc(np.zeros(2), np.array([3.0, 0.0]), np.array([0.0, 1.0]), 0.0, 2.0 * np.pi, "rim")
HOLES = (loops.circle((1.0, 0.1), 0.4, "left"), loops.circle((-1.0, 0.0), 0.3, "right"))
BODY = Outline.around((ELLIPSE,), HOLES)


@pytest.mark.parametrize("size", [0.3, 0.1])
def test_triangles_cover_the_body_once(size):
    made = triangulate(BODY, size)
    corners = made["points"][made["cells"]]
    (ux, uy), (vx, vy) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    areas = 0.5 * (ux * vy - uy * vx)
    assert areas.min() > 0.0
    sides = Counter(tuple(sorted(side)) for cell in made["cells"].tolist() for side in zip(cell, cell[1:] + cell[:1]))
    rim = {tuple(sorted(facet)) for facet in made["facets"].tolist()}
    assert {side for side, count in sides.items() if count == 1} == rim and max(sides.values()) == 2
    assert len(made["points"]) - len(sides) + len(made["cells"]) == -1  # Euler: one body, two holes
    start, end = made["points"][made["facets"]].transpose(1, 2, 0)
    assert_allclose(areas.sum(), 0.5 * (start[0] * end[1] - start[1] * end[0]).sum(), rtol=1e-12)  # Green, body left
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    assert np.quantile(longest, 0.9) < 1.2 * SPREAD * size  # netgen takes the size as a wish


def test_the_boundary_is_the_curve_with_its_tangent_and_curvature():
    made = triangulate(BODY, 0.2)
    mine = made["edges"]["rim"]
    place, middle = made["points"][made["facets"][mine]], made["middles"][mine]
    for points in (place[:, 0], place[:, 1], middle):
        assert_allclose((points / [3.0, 1.0]) ** 2 @ [1.0, 1.0], 1.0, rtol=1e-12)
    x, y = np.moveaxis(place, 2, 0)
    speed = np.hypot(3.0 * y, x / 3.0)  # at angle t: x = 3 cos t, y = sin t
    assert_allclose(made["tangents"][mine], np.stack([-3.0 * y, x / 3.0], axis=2) / speed[..., None], atol=1e-9)
    assert_allclose(made["curvatures"][mine], 3.0 / speed**3, rtol=1e-9)
    for name, radius in (("left", 0.4), ("right", 0.3)):
        assert_allclose(made["curvatures"][made["edges"][name]], -1.0 / radius, rtol=1e-9)  # a hole is concave
    assert sum(len(made["edges"][name]) for name in ("rim", "left", "right")) == len(made["edges"]["boundary"])
    assert_allclose(made["edges"]["outer"], mine)


def test_mass_within_curved_facets_is_that_of_the_body():
    """Facets follow their circle with order eight; parabolas, for areas and lengths of meshes, with order four."""
    ring = mesh.disk(1.0, 0.4, size=0.3)
    system = fi.assemble(ring, fi.Plate(fi.Material(E=1e9, nu=0.3, rho=1.0), 1.0))
    assert_allclose(system.mass, np.pi * (1.0 - 0.4**2), rtol=1e-9)
    assert_allclose(ring.area, system.mass, rtol=1e-4)
    assert_allclose(ring.perimeter, 2.0 * np.pi * 1.4, rtol=1e-4)
