"""Results, decks and matrices of Nastran."""

from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import BODIES
from test_matrices import KEPT, LENGTH, N, assert_the_same_bar, reduced

import fem_impact as fi

pytest.importorskip("pyNastran", reason="the nastran extra is not installed")
pytestmark = pytest.mark.usefixtures("read_here")


@contextmanager
def older_numpy():
    """What pyNastran 1.3 writes with, and numpy 2.4 lacks; reading must do without."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(np, "in1d", np.isin, raising=False)
        yield


def test_a_rod_of_nastran():
    """Ten bars with lumped masses, and a mass at the tip; along the rod there is a closed form: k tan k = m / M."""
    area, length, E, rho, tip = np.pi, 10.0, 3e7, 7.4851e-4, 2.59e-3
    mass = rho * area * length
    body = fi.Body.load(BODIES / "beam.op2", mass=mass + tip)
    along = body.modes("x")
    i = int(np.abs(along.shape_at([body.at(11)])).argmax())
    k = 1.4166
    for _ in range(50):
        k = np.arctan2(mass, tip * k)
    scale = (mass / 2.0 * (1.0 - np.sin(2.0 * k) / (2.0 * k)) + tip * np.sin(k) ** 2) ** -0.5
    assert body.frequencies[i] == pytest.approx(k * np.sqrt(E / rho) / length / (2.0 * np.pi), rel=5e-3)
    assert abs(along.shape_at([body.at(11)])[0, i]) == pytest.approx(scale * np.sin(k), rel=2e-3)


@older_numpy()
def written_op2(path, eigenvalues, shapes, frequencies, static=None):
    """Results at two nodes: modes, and maybe one static solution."""
    from pyNastran.op2.op2 import OP2
    from pyNastran.op2.tables.oug.oug_displacements import RealDisplacementArray
    from pyNastran.op2.tables.oug.oug_eigenvectors import RealEigenvectorArray

    numbers, results = np.array([[1, 1], [2, 1]], "int32"), OP2(debug=False)
    results.is_nx = False
    if static is not None:
        results.displacements[1] = RealDisplacementArray.add_static_case("OUGV1", numbers, static, 1)
    modal = list(range(1, len(eigenvalues) + 1)), list(eigenvalues), list(frequencies)
    results.eigenvectors[1] = RealEigenvectorArray.add_modal_case("OUGV1", numbers, shapes, 1, *modal)
    results.eigenvectors[1].table_code = 7  # not that of displacements
    results.write_op2(str(path))


def test_static_results_of_nastran_in_frames_of_their_own(tmp_path):
    """Node 2 gives its displacement in a frame turned by 90 degrees about z."""
    op2, deck = tmp_path / "bar.op2", tmp_path / "bar.bdf"
    deck.write_text(
        "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.,7\nCORD2R,7,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\nCBAR,1,1,1,2,0.,0.,1.\n"
        "PBAR,1,1,1.,1.,1.,1.\nMAT1,1,1.,,.3,1.\n"
    )
    moved = np.zeros((1, 2, 6), "float32")
    moved[0, 1, :3] = 3.0, 1.0, 2.0
    written_op2(op2, [16.0], 2.0 * moved, [4.0 / (2.0 * np.pi)], moved)
    with pytest.raises(ValueError, match=r"bar\.op2 holds no nodes; give the deck \(\.bdf\) beside it"):
        fi.Body.load(op2, mass=1.0)
    body = fi.Body.load([op2, deck], mass=1.0, loads=[(2, (-1.0, 3.0, 2.0))], modal_mass=[4.0])
    for found in (body.static[1, :, 0], body.shapes[1, :, 0]):
        assert_allclose(found, [-1.0, 3.0, 2.0], atol=1e-6)
    assert body.frequencies[0] == pytest.approx(4.0 / (2.0 * np.pi), rel=1e-6) and body.cells.tolist() == [[0, 1]]


@pytest.mark.parametrize("own", [False, True])
def test_nodes_without_results_of_nastran_and_scalar_points_are_left_out(tmp_path, own):
    op2, deck = tmp_path / "bar.op2", tmp_path / "bar.bdf"
    deck.write_text(
        f"GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,2.,0.,0.{',7' * own}\nCORD2R,7,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\n"
        "SPOINT,9\nCBAR,1,1,1,2,0.,0.,1.\nCBAR,2,1,2,3,0.,0.,1.\nPBAR,1,1,1.,1.,1.,1.\nMAT1,1,1.,,.3,1.\n"
    )
    written_op2(op2, [16.0], np.ones((1, 2, 6), "float32"), [4.0 / (2.0 * np.pi)])
    if own:
        with pytest.raises(ValueError, match=r"results in frames of their own; export them at all nodes"):
            fi.Body.load([op2, deck], mass=1.0)
        return
    body = fi.Body.load([op2, deck], mass=1.0)
    assert body.numbers.tolist() == [1, 2] and body.cells.tolist() == [[0, 1]]
    assert body.nodes[:, 0].tolist() == [0.0, 1.0] and (body.shapes == 1.0).all()


def test_a_buckled_model_of_nastran_is_refused(tmp_path):
    files = [tmp_path / "bar.op2", written_deck(tmp_path / "bar.bdf", np.zeros((0, 2), int), sets=False)]
    for first in (-1e-9, -16.0):
        cycles = np.sqrt(np.abs([first, 900.0])) / (2.0 * np.pi)
        written_op2(files[0], [first, 900.0], np.ones((2, 2, 6), "float32"), cycles)
        if first == -1e-9:
            assert_allclose(fi.Body.load(files, mass=1.0).frequencies, [0.0, cycles[1]], rtol=1e-6)
    with pytest.raises(ValueError, match=r"the mode at -0\.63662 Hz has a negative eigenvalue"):
        fi.Body.load(files, mass=1.0)


@older_numpy()
def written_op4(path, matrices):
    from pyNastran.op4.op4 import OP4

    OP4(debug=False).write_op4(str(path), {name: (6, each) for name, each in matrices.items()}, is_binary=False)


def written_deck(path, dofs, sets=True, entries=None):
    """Nodes, and a reduction's sets or its matrices as DMIG, in large fields."""
    lines = [f"GRID,{i + 1},,{x:.6f},0.,0." for i, x in enumerate(np.linspace(0.0, LENGTH, N + 1))]
    modal = dofs[dofs[:, 1] == 0, 0]
    lines += [f"SPOINT,{number}" for number in modal]
    lines += [f"CBAR,{i},1,{i},{i + 1},0.,0.,1." for i in range(1, N + 1)]
    lines += ["PBAR,1,1,1.,1.,1.,1.", "MAT1,1,1.,,.3,1."]
    if sets:
        lines += [f"ASET1,123456,{i + 1}" for i in KEPT] + [f"QSET1,0,{number}" for number in modal]
    for name, matrix in (entries or {}).items():
        lines.append(f"DMIG,{name},0,6,2,0")
        for column, (node, way) in enumerate(dofs):
            rows = [row for row in range(column, len(dofs)) if matrix[row, column]]
            for k, row in enumerate(rows):
                start = f"DMIG*   {name:<16}{node:>16}{way:>16}{'':16}*\n" if k == 0 else ""
                value = f"{matrix[row, column]:.9E}".replace("E", "D")
                lines.append(f"{start}*       {dofs[row][0]:>16}{dofs[row][1]:>16}{value:>16}")
    path.write_text("\n".join([*lines, ""]))
    return path


def test_a_set_of_modes_of_nastran_has_their_own_modal_masses(tmp_path, monkeypatch):
    """The table of eigenvalues is of all modes; shapes may be written of some."""
    from pyNastran.op2 import op2

    files = [tmp_path / "bar.op2", written_deck(tmp_path / "bar.bdf", np.zeros((0, 2), int), sets=False)]
    written_op2(files[0], [16.0, 900.0], np.ones((2, 2, 6), "float32"), np.array([4.0, 30.0]) / (2.0 * np.pi))
    read = op2.read_op2

    def read_with_masses(*given, **more):
        found = read(*given, **more)
        found.eigenvectors[1].modes = np.array([2, 4])
        masses = SimpleNamespace(mode=np.arange(1, 5), generalized_mass=np.array([1.0, 4.0, 9.0, 25.0]))
        found.eigenvalues["all"] = masses
        return found

    monkeypatch.setattr(op2, "read_op2", read_with_masses)
    assert_allclose(fi.Body.load(files, mass=1.0).shapes[0, 0], [0.5, 0.2])


@pytest.mark.parametrize(("card", "said"), [
    (
        "GRDSET,,,,,,7\nCORD2R,7,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.",
        "names coordinate systems in GRDSET; write them to each GRID",
    ),
    ("PARAM,CK2,2.", "scales matrices by PARAM CK2; write them as they are meant, without it"),
])  # fmt: skip
def test_cards_that_change_all_others_are_refused(tmp_path, card, said):
    deck = written_deck(tmp_path / "bar.bdf", np.zeros((0, 2), int), sets=False)
    deck.write_text(f"SOL 103\nCEND\nbegin  bulk\n{card}\n{deck.read_text()}ENDDATA\n")
    with pytest.raises(ValueError, match=said):
        fi.Body.load(deck)


def test_matrices_of_nastran_with_the_sets_of_their_deck(tmp_path):
    M, K, _, dofs = reduced()
    written_op4(tmp_path / "bar.op4", {"MAA": M, "KAA": K})
    deck = written_deck(tmp_path / "bar.bdf", dofs)
    assert_the_same_bar(fi.Body.load([tmp_path / "bar.op4", deck]))


def test_structural_damping_of_nastran_is_no_stiffness(tmp_path):
    """Nastran writes K4AAX beside KAAX, and MUG1, which recovers displacements, beside MAA.

    Ten digits are kept: rigid motions of the reduction resist by 1e-9 of what cancels in them.
    """
    M, K, _, dofs = reduced()
    deck = written_deck(tmp_path / "bar.pch", dofs, sets=False, entries={"KAAX": K, "MAAX": M, "K4AAX": 0.02 * K})
    alone = written_deck(tmp_path / "alone.pch", dofs, sets=False, entries={"KAAX": K, "MAAX": M})
    body = fi.Body.load(alone)
    assert_the_same_bar(body)
    assert_allclose(fi.Body.load(deck).frequencies, body.frequencies)
    written_op4(tmp_path / "bar.op4", {"MAA": M, "KAA": K, "MUG1": 0.5 * M})
    with pytest.raises(ValueError, match=r"bar\.op4 holds MAA and MUG1, and either may be mass; leave one of them out"):
        fi.Body.load([tmp_path / "bar.op4", written_deck(tmp_path / "bar.bdf", dofs)])
    with pytest.raises(ValueError, match=r"files must hold the matrix of .* once, but two of them do; leave out one"):
        fi.Body.load([alone, deck])
    (tmp_path / "turned.pch").write_text("DMIG,KAAX,0,6,3,0\nDMIG,KAAX,1,1,,1,1,1.,0.02\nGRID,1,,0.,0.,0.\n")
    with pytest.raises(ValueError, match="stiffness must be real; give damping as damping_ratio"):
        fi.Body.load(tmp_path / "turned.pch", mass=1.0)
