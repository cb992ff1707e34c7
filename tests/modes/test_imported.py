"""Files of other programs are read as bodies, and what they lack is said."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from test_body import STEEL, body_of, hinged, struck

import fem_impact as fi
from fem_impact.modes import imported

FILES = Path(__file__).parents[1] / "bodies"
pytestmark = pytest.mark.usefixtures("read_here")


def test_the_inside_of_a_solid_has_no_normal():
    grid = np.stack(np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    row = {tuple(place): i for i, place in enumerate(grid.tolist())}
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    cells = np.array([[row[tuple(map(float, np.add(low, each)))] for each in corners] for low in np.ndindex(2, 2, 2)])
    skin = imported.surface(grid, {12: cells})
    assert len(skin) == 48  # 24 squares
    shapes = np.random.default_rng(0).standard_normal((27, 3, 4))
    body = fi.Body([10.0, 20.0, 30.0, 40.0], shapes, grid, mass=1.0, cells=skin)
    middle = row[1.0, 1.0, 1.0]
    assert not body.normals[middle].any()
    assert_allclose(np.abs(body.normals[row[1.0, 1.0, 2.0]]), [0.0, 0.0, 1.0], atol=1e-12)
    assert len(body.modes().shapes.grid()[0]) == 26


def test_universal_files_hold_bodies(tmp_path):
    pyuff = pytest.importorskip("pyuff", reason="the uff extra is not installed")
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(0.4, 0.3), fi.Plate(STEEL, 2e-3)), n_modes=8)
    path = tmp_path / "plate.uff"
    fi.export.write_uff(path, modes)
    body, plain = fi.Body.load(path, mass=modes.mass), fi.Modes.from_uff(path, mass=modes.mass)
    points = plain.shapes.grid()[0]
    assert_allclose(np.abs(body.modes("normal").shape_at(points)), np.abs(plain.shape_at(points)))
    assert np.array_equal(body.modes("z").shapes.grid()[1], plain.shapes.grid()[1])
    load = 1e-6 * np.random.default_rng(0).standard_normal((len(points), 3))
    head = {"type": 2414, "analysis_dataset_label": 1, "analysis_dataset_name": "unit load", "dataset_location": 1,
            "id1": "NONE", "id2": "NONE", "id3": "NONE", "id4": "NONE", "id5": "NONE", "model_type": 1,
            "data_characteristic": 2, "result_type": 8, "data_type": 2,
            "number_of_data_values_for_the_data_component": 3, "node_nums": body.numbers}  # fmt: skip
    fields = {f"record{k}_field{i}": 0 for k, n in ((10, 8), (11, 8), (12, 6), (13, 6)) for i in range(1, n + 1)}
    text = path.read_text()
    pyuff.UFF(str(path)).write_sets([head | fields | {"analysis_type": 1, "data_at_node": list(load)}], mode="add")
    assert path.read_text().startswith(text[:1000])
    again = fi.Body.load(path, mass=1.0, loads=[(3, (0.0, 0.0, 1.0))])
    assert_allclose(again.static[:, :, 0], load, rtol=1e-5)  # six digits are written
    assert again.shapes.shape == body.shapes.shape


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


def test_a_rod_of_nastran():
    """Ten bars with lumped masses, and a mass at the tip; along the rod there is a closed form: k tan k = m / M."""
    pytest.importorskip("pyNastran", reason="the nastran extra is not installed")
    area, length, E, rho, tip = np.pi, 10.0, 3e7, 7.4851e-4, 2.59e-3
    mass = rho * area * length
    body = fi.Body.load(FILES / "beam.op2", mass=mass + tip)
    along = body.modes("x")
    i = int(np.abs(along.shape_at([body.at(11)])).argmax())
    k = 1.4166
    for _ in range(50):
        k = np.arctan2(mass, tip * k)
    scale = (mass / 2.0 * (1.0 - np.sin(2.0 * k) / (2.0 * k)) + tip * np.sin(k) ** 2) ** -0.5
    assert body.frequencies[i] == pytest.approx(k * np.sqrt(E / rho) / length / (2.0 * np.pi), rel=5e-3)
    assert abs(along.shape_at([body.at(11)])[0, i]) == pytest.approx(scale * np.sin(k), rel=2e-3)


def test_static_results_of_nastran_in_frames_of_their_own(tmp_path):
    """Node 2 gives its displacement in a frame turned by 90 degrees about z."""
    pytest.importorskip("pyNastran", reason="the nastran extra is not installed")
    if not hasattr(np, "in1d"):
        pytest.MonkeyPatch().setattr(np, "in1d", np.isin, raising=False)
    from pyNastran.op2.op2 import OP2
    from pyNastran.op2.tables.oug.oug_displacements import RealDisplacementArray
    from pyNastran.op2.tables.oug.oug_eigenvectors import RealEigenvectorArray

    (tmp_path / "bar.bdf").write_text(
        "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.,7\nCORD2R,7,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\nCBAR,1,1,1,2,0.,0.,1.\n"
        "PBAR,1,1,1.,1.,1.,1.\nMAT1,1,1.,,.3,1.\n"
    )
    numbers = np.array([[1, 1], [2, 1]], "int32")
    moved = np.zeros((1, 2, 6), "float32")
    moved[0, 1, :3] = 3.0, 1.0, 2.0
    results = OP2(debug=False)
    results.is_nx = False
    results.displacements[1] = RealDisplacementArray.add_static_case("OUGV1", numbers, moved, 1)
    modal = [1], [16.0], [4.0 / (2.0 * np.pi)]
    results.eigenvectors[1] = RealEigenvectorArray.add_modal_case("OUGV1", numbers, 2.0 * moved, 1, *modal)
    results.eigenvectors[1].table_code = 7  # not that of displacements
    results.write_op2(str(tmp_path / "bar.op2"))
    with pytest.raises(ValueError, match=r"bar\.op2 holds no nodes; give the deck \(\.bdf\) beside it"):
        fi.Body.load(tmp_path / "bar.op2", mass=1.0)
    body = fi.Body.load(
        [tmp_path / "bar.op2", tmp_path / "bar.bdf"], mass=1.0, loads=[(2, (-1.0, 3.0, 2.0))], modal_mass=[4.0]
    )
    assert_allclose(body.static[1, :, 0], [-1.0, 3.0, 2.0], atol=1e-6)
    assert_allclose(body.shapes[1, :, 0], [-1.0, 3.0, 2.0], atol=1e-6)
    assert body.frequencies[0] == pytest.approx(4.0 / (2.0 * np.pi), rel=1e-6) and body.cells.tolist() == [[0, 1]]


def test_what_files_lack_is_said(tmp_path):
    plate, points = hinged(5)
    body = body_of(plate, points)
    with pytest.raises(ValueError, match="direction must be one of normal, x, y, z"):
        body.modes("up")
    with pytest.raises(ValueError, match="direction must not be zero"):
        body.modes((0.0, 0.0, 0.0))
    line = fi.Body([1.0], np.ones((3, 3, 1)), np.eye(3)[[0, 0, 0]] * [[0], [1], [2]], mass=1.0)
    with pytest.raises(ValueError, match="neither cells nor a plane tell the normals"):
        line.modes()
    with pytest.raises(ValueError, match=r"files must be one of \.uff, .* got 'body.med'; convert it"):
        fi.Body.load(tmp_path / "body.med", mass=1.0)
    with pytest.raises(ValueError, match="files must hold results"):
        fi.Body.load(FILES / "plate.inp", mass=1.0)
    paths = [tmp_path / "one.npz", tmp_path / "two.npz"]
    body.save(paths[0])
    fi.Body(body.frequencies, body.shapes[:-1], body.nodes[:-1], mass=1.0, cells=np.zeros((0, 3), int)).save(paths[1])
    with pytest.raises(ValueError, match="files must be about the same nodes; export all results of one"):
        fi.Body.load(paths)
    told = {"shapes": (("n", "x", "m"), body.shapes), "nodes": (("n", "x"), body.nodes)}
    with pytest.raises(ValueError, match="files must hold modes"):
        fi.Body.load(xr.Dataset(told), mass=1.0)
    with pytest.raises(ValueError, match="mass must be given in kg"):
        fi.Body.load(xr.Dataset(told | {"frequencies": ("m", body.frequencies)}))
