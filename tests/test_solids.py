"""Solids of NGSolve become bodies (`studies/solids.py`), and what the studies on them show is so."""

import pytest
import shared
import solids

import fem_impact as fi

ng = pytest.importorskip("ngsolve", reason="the test extra is not installed")
STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)


@pytest.fixture
def out(tmp_path, monkeypatch):
    """Where the studies write."""
    monkeypatch.setattr(shared.sys, "argv", ["study", str(tmp_path)])
    return tmp_path


def bar(length=0.16, side=0.012, n_modes=10, loads=(), **more):
    from netgen.occ import Box, Pnt

    mesh = solids.meshed(Box(Pnt(0, 0, 0), Pnt(length, side, side)), 8e-3)
    return solids.solve(mesh, STEEL, n_modes, loads, **more)


def test_a_solid_bar_is_a_body():
    """Its corner is a node, its first frequency that of a Timoshenko beam, its rigid motions know its mass."""
    loads = [((0.0, 0.0, 0.0), (0.0, 0.0, 2.0))]
    solved = bar(loads=loads)
    found = solids.body(solved, loads)
    own = fi.find_modes(
        fi.assemble(fi.mesh.line(0.16), fi.Beam.rectangular(STEEL, width=0.012, height=0.012), theory="timoshenko"),
        n_modes=4,
    )
    # quadratic tetrahedra of 8 mm are some 1e-3 too stiff
    assert found.frequencies[6:8] == pytest.approx(own.frequencies[2], rel=3e-3)
    assert found.mass == pytest.approx(STEEL.rho * 0.16 * 0.012**2, rel=1e-9) and not found.frequencies[:6].any()
    assert (((found.nodes - found.nodes.mean(axis=0)) * found.normals).sum(axis=1) > 0.0).all()  # they point outwards
    row = found.shapes[found.node((0.0, 0.0, 0.0)), 2, :6]
    yields = 1.0 + 3.0 / (1.0 + (0.012 / 0.16) ** 2) + 1.5  # that of the centre, and of turns about two axes
    assert row @ row == pytest.approx(yields / found.mass, rel=1e-9)
    with pytest.raises(ValueError, match="make it a corner there"):
        solids.body(solved, [((0.05, 0.0, 0.0), (0.0, 0.0, 1.0))])


def test_the_sound_holds_the_frequencies_of_the_body(out):
    loads = [((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))]
    found = solids.body(bar(loads=loads), loads, damping_ratio=1e-3, solid=False)
    law = fi.Contact.linear(1e6)
    hit = fi.strike(found.modes("z"), fi.Striker.rigid(0.01), law, at=found.at(loads[0][0]), speed=0.1, tolerance=0.1)
    path, heard = solids.listened(hit, found.at((0.16, 0.0, 0.0)), "bar", found.frequencies[6:7], 0.3)
    assert path.exists() and heard == pytest.approx(found.frequencies[6:7], rel=1e-4)
