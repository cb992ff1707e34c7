"""Sketches of bodies are well-formed, round where the body is round, and say how each edge is held."""

import pytest
from comparing import parsed

import fem_impact as fi
from fem_impact._base import markup
from fem_impact.mesh import sketch

SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("mesh", [fi.mesh.disk(0.1, hole=0.02), fi.mesh.line(1.0), fi.mesh.rectangle(1.0, 2.0)])
def test_every_edge_can_be_drawn_in_every_way(mesh):
    for kind in ("clamped", "hinged", "free", fi.Elastic(1e4)):
        picture = sketch.draw_body(mesh, supports={"boundary": kind}, title="a < b")
        tree = parsed(picture)
        assert tree[0].get("aria-label") == "a < b"
        box = [float(x) for x in tree[0].get("viewBox").split()]
        assert 0 < box[3] < 2.0 * markup.WIDTH


@pytest.mark.parametrize(("hole", "loops"), [(0.0, 1), (0.03, 2)])
def test_each_rim_is_drawn_once(hole, loops):
    picture = sketch.draw_body(fi.mesh.disk(0.1, hole=hole), title="disk")
    assert next(parsed(picture).iter(f"{SVG}path")).get("d").count("Z") == loops


def test_named_edge_overrules_the_whole():
    mesh = fi.mesh.rectangle(1.0, 1.0)
    held = sketch.held_edges(mesh, {"left": "clamped", "boundary": "hinged"})
    assert {held[int(i)] for i in mesh.edges["left"]} == {"clamped"}
    assert {held[int(i)] for i in mesh.edges["top"]} == {"hinged"}
