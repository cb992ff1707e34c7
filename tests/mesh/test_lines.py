"""Triangles whose sides follow lines inside an outline."""

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.fe import ribs
from fem_impact.mesh import lines, meshes


def test_triangles_follow_lines_that_cross_end_inside_or_stick_out():
    paths = [np.array([[-1.0, 0.1], [1.0, 0.2]]), np.array([[-0.2, -0.2], [0.1, 0.3], [0.3, 0.2]])]
    mesh = meshes.mesh_along_lines(fi.mesh.disk(0.5), paths)
    length = {}
    for i, path in enumerate(paths):
        sides = mesh.points[ribs.sides_on(mesh, path)]
        length[i] = np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1).sum()
    foot = 0.15 / np.sqrt(1.0 + 0.05**2)  # of the first line from the middle
    assert length[0] == pytest.approx(2.0 * np.sqrt(0.5**2 - foot**2), rel=1e-9)
    assert length[1] == pytest.approx(np.hypot(0.3, 0.5) + np.hypot(0.2, 0.1), rel=1e-9)
    assert meshes.mesh_along_lines(mesh, paths) is mesh
    assert len(mesh.refined(2.0).cells) > 2 * len(mesh.cells)


def test_lines_that_share_a_part_of_their_way_are_followed_once():
    """The mesher failed on two bars that overlap."""
    paths = [np.array([[0.1, 0.0], [0.1, 0.2]]), np.array([[0.1, 0.3], [0.1, 0.1]])]
    found = lines.lines_inside(meshes._outline(fi.mesh.rectangle(0.4, 0.3)), paths)
    assert np.sort(found.ends[..., 1], axis=1).tolist() == pytest.approx(np.array([[0.0, 0.1], [0.1, 0.2], [0.2, 0.3]]))
    mesh = meshes.mesh_along_lines(fi.mesh.rectangle(0.4, 0.3), paths)
    for path in paths:
        sides = mesh.points[ribs.sides_on(mesh, path)]
        assert np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1).sum() == pytest.approx(0.2, rel=1e-9)


def test_lines_along_an_edge_and_beyond_it_are_left_out():
    outline = meshes._outline(fi.mesh.rectangle(1.0, 0.5))
    found = lines.lines_inside(outline, [np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[1.2, 0.1], [2.0, 0.1]])])
    assert len(found.ends) == 0
