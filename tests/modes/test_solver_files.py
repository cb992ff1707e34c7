"""Files of CalculiX, Code_Aster, Ansys and Abaqus."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_body import struck
from test_matrices import N, bar, held_to_truth

import fem_impact as fi

FILES = Path(__file__).parents[1] / "bodies"
pytestmark = pytest.mark.usefixtures("read_here")


def test_a_plate_of_calculix():
    """Six shells by four are 1 to 6 % too soft or stiff, by comparison with our own elements."""
    pytest.importorskip("pyvista_frd", reason="the calculix extra is not installed")
    paths, mass = [FILES / "plate.frd", FILES / "plate.inp"], 0.3 * 0.2 * 3e-3 * 2700.0
    with pytest.raises(ValueError, match=r"loads must be given .* for each of 1 static solutions, got 0"):
        fi.Body.load(paths, mass=mass)
    body = fi.Body.load(paths, mass=mass, loads=[(89, (0.0, 0.0, 1.0))])
    assert body.names == {"TIP": 89} and body.at("TIP") == pytest.approx((0.3, 0.1))
    plate = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), 3e-3)
    own = fi.find_modes(fi.assemble(fi.mesh.rectangle(0.3, 0.2), plate, {"left": "clamped"}), n_modes=12)
    assert_allclose(body.frequencies, own.frequencies, rtol=0.06)
    modes, tip = body.modes("normal"), np.array([[0.3, 0.1]])
    assert_allclose(modes.shapes.compliance(tip), own.shapes.compliance(tip), rtol=0.04)
    law = fi.Contact.linear(3e4)
    found, truth = (struck(each, tip[0], law, mass=0.03) for each in (modes, own))
    assert found.restitution == pytest.approx(truth.restitution, abs=0.01)
    assert "not stated" not in found.verdict and found.tolerance_met
    assert "not stated of the target: static compliance" in struck(modes, body.at((0.15, 0.1, 0.0)), law).verdict


def test_steps_of_calculix_that_cannot_be_told_apart_are_refused(tmp_path):
    pytest.importorskip("pyvista_frd", reason="the calculix extra is not installed")
    text = (FILES / "plate.frd").read_bytes().replace(b" 95.76123372", b" 29.12784664")  # the second step as the first
    (tmp_path / "plate.frd").write_bytes(text)
    with pytest.raises(ValueError, match="steps of different times or frequencies; write each load to its own file"):
        fi.Body.load(tmp_path / "plate.frd", mass=1.0)


def test_matrices_of_abaqus_beside_its_mesh(tmp_path):
    """Rows of node, direction, node, direction, value of one triangle; the mesh has labels of its own."""
    M, K, nodes = bar()
    mesh = [f"{10 * (i + 1)}, {x:.12g}, 0., 0." for i, x in enumerate(nodes[:, 0])]
    cells = [f"{i}, {10 * i}, {10 * i + 10}" for i in range(1, N + 1)]
    deck = ["*HEADING", "*NODE", *mesh, "*ELEMENT, TYPE=B31", *cells, "*NSET, NSET=quarter", "60", ""]
    (tmp_path / "bar.inp").write_text("\n".join(deck))
    for name, matrix in (("bar_STIF1", K), ("bar_MASS1", M)):
        rows = [
            f"{10 * (i // 6 + 1)},{i % 6 + 1}, {10 * (j // 6 + 1)},{j % 6 + 1}, {matrix[i, j]:.16e}"
            for i, j in zip(*np.nonzero(np.tril(matrix)))
        ]
        (tmp_path / f"{name}.mtx").write_text("\n".join(["** Assembled", *rows, ""]))
    body = fi.Body.load([tmp_path / name for name in ("bar.inp", "bar_STIF1.mtx", "bar_MASS1.mtx")])
    assert body.at("quarter") == pytest.approx((0.1,)) and body.numbers[5] == 60
    held_to_truth(body)


def test_matrices_of_ansys():
    """Of a clamped beam of solids, which ansys-mapdl-reader ships: frequencies as its manual prints them."""
    examples = pytest.importorskip("ansys.mapdl.reader.examples", reason="the ansys extra is not installed")
    body = fi.Body.load([examples.fullfile, examples.hexarchivefile], mass=2.3e-3, n_modes=4)
    assert_allclose(body.frequencies, [1283.200, 1283.200, 5781.975, 6919.399], atol=1e-3)
    assert body.solid is True and len(body.cells)
