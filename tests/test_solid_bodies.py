"""Solids of NGSolve become bodies (`studies/solids.py`), and what the studies on them show is so."""

import beyond_church_bell as bell
import beyond_dropped_phone as phone
import beyond_tuning_fork as fork
import numpy as np
import pytest
import shared
import solids

import fem_impact as fi

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


@pytest.mark.slow
def test_the_sound_holds_the_frequencies_of_the_body(out):
    loads = [((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))]
    found = solids.body(bar(loads=loads), loads, damping_ratio=1e-3, solid=False)
    law = fi.Contact.linear(1e6)
    hit = fi.strike(found.modes("z"), fi.Striker.rigid(0.01), law, at=found.at(loads[0][0]), speed=0.1, tolerance=0.1)
    path, heard = solids.listened(hit, found, (0.16, 0.0, 0.0), "z", "bar", found.frequencies[6:7], 0.3)
    assert path.exists() and heard == pytest.approx(found.frequencies[6:7], rel=1e-4)


def test_the_bell_is_in_tune():
    """0.1 cents on the mesh on which it was tuned."""
    assert np.abs(bell.cents(bell.partials(bell.profile()))).max() < 0.2


@pytest.mark.slow
def test_a_fork_rings_like_two_clamped_bars_a_little_longer():
    found, struck = fork.solve((6e-3, 1.5e-3), 16)
    longer = np.sqrt(fork.formula() / found.frequencies[fork.tones(found)]) - 1.0
    assert (longer > 0.02).all() and (longer < 0.05).all()  # 0.031 and 0.037 on the study's mesh
    soft, hard = (fork.strike(found, struck, stiffness) for stiffness in fork.HEADS.values())
    assert hard.contact_time < 0.2 * soft.contact_time


@pytest.mark.slow
def test_a_dropped_phone_turns_as_a_rigid_block_would():
    found, corner = phone.solve((8e-3, 8e-4), 30)
    hit = phone.strike(found, corner, tolerance=0.1)
    motion = hit.modal_state([hit.impacts[-1].end])[1][0]
    moving, turning = phone.rigid(found, found.shapes @ np.where(found.frequencies > 0.0, 0.0, motion))
    turned = hit.impulse * np.cross(corner - phone.MIDDLE, phone.WAY) / phone.inertia()
    # 2e-4 on the study's mesh: curved quadratic tetrahedra are not quite as heavy as the block
    assert moving @ phone.WAY == pytest.approx(hit.impulse / found.mass, rel=1e-3)
    assert turning == pytest.approx(turned, rel=3e-3, abs=3e-3 * np.abs(turned).max())
