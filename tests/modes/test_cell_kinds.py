"""What elements tell of a body: its surface, and whether it is solid."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_solver_files import block

import fem_impact as fi
from fem_impact.modes import cell_kinds


def test_the_inside_of_a_solid_has_no_normal():
    grid, cells, _ = block((2, 2, 2), (2.0, 2.0, 2.0))
    row = {tuple(place): i for i, place in enumerate(grid.tolist())}
    skin = cell_kinds.surface(grid, {12: cells})
    assert len(skin) == 48  # 24 squares
    shapes = np.random.default_rng(0).standard_normal((27, 3, 4))
    body = fi.Body([10.0, 20.0, 30.0, 40.0], shapes, grid, mass=1.0, cells=skin)
    middle = row[1.0, 1.0, 1.0]
    assert not body.normals[middle].any()
    assert_allclose(np.abs(body.normals[row[1.0, 1.0, 2.0]]), [0.0, 0.0, 1.0], atol=1e-12)
    assert len(body.modes().shapes.grid()[0]) == 26


@pytest.mark.parametrize(
    ("codes", "solid"), [({10}, True), ({10, 5}, True), ({12, 3}, True), ({9, 3}, False), ({3}, False), (set(), None)]
)
def test_any_solid_element_makes_a_mesh_solid_and_shells_or_lines_alone_do_not(codes, solid):
    """A face of a solid block is a shell in many files."""
    points, corners = np.random.default_rng(0).random((8, 3)), {10: 4, 5: 3, 12: 8, 9: 4, 3: 2}
    told = cell_kinds.surface_and_kind(points, {code: np.arange(corners[code])[None] for code in codes})
    body = fi.Body([9.0], np.ones((8, 3, 1)), points, mass=1.0, solid=told.get("solid"))
    assert body.solid is None if solid is None else body.solid == (solid or ())


def test_names_of_matrices_say_what_they_are():
    names = {"KAA": "stiffness", "K2GG": "stiffness", "job_STIF2": "stiffness", "m": "mass", "job_MASS2": "mass",
             "RECOV": "recovery", "BAA": "", "what": ""}  # fmt: skip
    assert {name: cell_kinds.kind_of_matrix(name) for name in names} == names
