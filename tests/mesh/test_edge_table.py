"""What is told of a mesh before supports are written: lengths against closed forms, names and places as they are."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import MESHES

import fem_impact as fi
from fem_impact.mesh import edge_table


def found(mesh):
    return {edge.name: edge for edge in edge_table.edges(mesh)}


def test_edges_of_a_rectangle_have_lengths_and_ends_of_a_beam_a_place():
    edges = found(fi.mesh.rectangle(0.4, 0.3, size=0.05))
    assert set(edges) == {"left", "right", "bottom", "top", "boundary"}
    assert_allclose([edges[n].length for n in ("left", "bottom", "boundary")], [0.3, 0.4, 1.4], rtol=1e-12)
    assert_allclose(edges["top"].middle, (0.2, 0.3), atol=0.026)  # the middle of a facet, half a size off at most
    assert edges["left"].n_facets == 6 and not edges["left"].curved and edges["left"].twins == ()
    edges = found(fi.mesh.line(0.5))
    assert edges["left"].middle == (0.0,) and edges["right"].middle == (0.5,) and edges["right"].length == 0.0


@pytest.mark.parametrize("size", [0.2, 0.1])
def test_length_of_a_circle_converges_at_fourth_order(size):
    """Two points of a facet give pi d up to (angle / 2)**4 / 480 of the facet's angle."""
    edges = found(fi.mesh.disk(0.5, size=size))
    name = next(name for name in edges if name != "boundary")
    angle = 2.0 * np.pi / edges[name].n_facets
    assert abs(edges[name].length / np.pi - 1.0) < 1.1 * angle**4 / 480 / 4
    assert edges[name].curved and "boundary" in edges[name].twins


def test_rows_tell_extent_and_elements():
    mesh = fi.mesh.rectangle(0.4, 0.3, size=0.05)
    rows = dict(edge_table.rows(mesh))
    assert rows["extent"] == "0 ... 0.4 x 0 ... 0.3 m" and rows["area"] == "0.12 m^2"
    assert rows["triangles"] == f"{len(mesh.cells)}"
    assert dict(edge_table.rows(fi.mesh.line(0.5)))["length"] == "0.5 m"
    low, middle, high = edge_table.sides(mesh)
    assert low == pytest.approx(0.05) and low <= middle <= high < 0.08


@pytest.mark.parametrize("name", ["guitar.msh", "ukulele.svg"])
def test_the_prompt_lists_the_edges_of_a_file_and_draws_them(name, prompt, read_here):
    said = prompt("mesh", MESHES / name, "--out", "mesh.png")
    mesh = fi.mesh.outline(MESHES / name) if name.endswith(".svg") else fi.mesh.load(MESHES / name)
    assert said.status == 0 and set(mesh.edges) <= {line.split()[0] for line in said.out.splitlines() if line.split()}
    assert all(note[:30] in " ".join(said.out.split()) for note in mesh.notes)
    assert Path("mesh.png").read_bytes()[:4] == b"\x89PNG"


def test_the_prompt_takes_scenes_and_units(prompt, read_here):
    assert prompt("new beam --out bar.toml").status == 0
    assert "0 ... 0.3 m" in prompt("mesh bar.toml").out
    small = fi.mesh.load(MESHES / "l_shape.msh", unit="mm")
    assert f"{small.area:.5g} m^2" in prompt("mesh", MESHES / "l_shape.msh", "--unit", "mm").out


@pytest.mark.parametrize(("line", "text"), [
    ("mesh nothing.msh", "nothing.msh"),
    ("mesh plate.toml --unit mm", "--unit must be left out for a scene"),
    ("mesh plate.toml --out out.txt", "path ending must be one of"),
])  # fmt: skip
def test_the_prompt_complains_in_one_line(prompt, line, text):
    assert prompt("new plate --out plate.toml").status == 0
    said = prompt(line)
    assert said.status == 2 and text in said.err and said.err.count("\n") == 1
