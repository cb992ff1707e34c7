"""Files of CalculiX, Code_Aster, Ansys and Abaqus."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import BODIES
from test_body import struck
from test_matrices import N, assert_the_same_bar, bar

import fem_impact as fi

pytestmark = pytest.mark.usefixtures("read_here")


def test_a_plate_of_calculix():
    """Six shells by four are 1 to 6 % too soft or stiff, by comparison with our own elements."""
    pytest.importorskip("pyvista_frd", reason="the calculix extra is not installed")
    paths, mass = [BODIES / "plate.frd", BODIES / "plate.inp"], 0.3 * 0.2 * 3e-3 * 2700.0
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
    text = (BODIES / "plate.frd").read_bytes().replace(b" 95.76123372", b" 29.12784664")  # the second step as the first
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
    labels = [f"{10 * (i + 1)},{way}" for i in range(N + 1) for way in range(1, 7)]
    for name, matrix, letter in (("bar_STIF1", K, "E"), ("bar_MASS1", M, "D")):
        rows = (
            f"{labels[i]}, {labels[j]}, {matrix[i, j]:.16E}".replace("E", letter)
            for i, j in zip(*np.nonzero(np.tril(matrix)))
        )
        (tmp_path / f"{name}.mtx").write_text("\n".join(["** Assembled", *rows, ""]))
    body = fi.Body.load([tmp_path / name for name in ("bar.inp", "bar_STIF1.mtx", "bar_MASS1.mtx")])
    assert body.at("quarter") == pytest.approx((0.1,)) and body.numbers[5] == 60
    assert_the_same_bar(body)


def test_matrices_of_ansys():
    """Of a clamped beam of solids, which ansys-mapdl-reader ships: frequencies as its manual prints them."""
    examples = pytest.importorskip("ansys.mapdl.reader.examples", reason="the ansys extra is not installed")
    body = fi.Body.load([examples.fullfile, examples.hexarchivefile], mass=2.3e-3, n_modes=4)
    assert_allclose(body.frequencies, [1283.200, 1283.200, 5781.975, 6919.399], atol=1e-3)
    assert body.solid is True and len(body.cells)


def block(n=(3, 2, 2), sides=(0.3, 0.2, 0.1)):
    """Corners of a block, its hexahedra and the quadrilaterals of its top."""
    grids = [np.linspace(0.0, side, count + 1) for side, count in zip(sides, n)]
    points = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape([count + 1 for count in n])
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.array([[number[tuple(np.add(low, each))] for each in corners] for low in np.ndindex(*n)])
    return points, cells, cells.reshape(*n, 8)[:, :, -1, 4:].reshape(-1, 4)


def written_med(path, fields, rows=None):
    """A block, and displacements in the layout of MED: field (time, values) by name, at nodes of a profile."""
    h5py, meshio = pytest.importorskip("h5py", reason="the hdf5 extra is not installed"), pytest.importorskip("meshio")
    points, cells, top = block()
    tags = np.zeros(len(points), int)
    tags[-1] = 1
    mesh = meshio.Mesh(points, [("hexahedron", cells), ("quad", top)], point_data={"point_tags": tags})
    mesh.point_tags = {1: ["corner"]}
    mesh.write(path)
    names = b"".join(name.ljust(16).encode() for name in ("DX", "DY", "DZ", "DRX"))
    profile = "MED_NO_PROFILE_INTERNAL" if rows is None else "SOME"
    kept = slice(None) if rows is None else rows
    with h5py.File(path, "r+") as file:
        for name, steps in fields.items():
            field = file["CHA"].create_group(name)
            field.attrs.update({"MAI": np.bytes_("mesh"), "NCO": 4, "NOM": np.bytes_(names), "TYP": 6})
            for k, (time, values) in enumerate(steps, 1):
                step = field.create_group(f"{k:020d}{k:020d}")
                step.attrs.update({"NDT": k, "NOR": k, "PDT": float(time)})
                nodal = step.create_group("NOE")
                nodal.attrs["PFL"] = np.bytes_(profile)
                data = nodal.create_group(profile)
                data.attrs["NBR"] = len(points)
                moved = np.pad(values[kept], ((0, 0), (0, 1)))
                data.create_dataset("CO", data=moved.ravel(order="F"))
        if rows is not None:
            place = file.create_group("PROFILS").create_group("SOME")
            place.attrs["NBR"] = len(rows)
            place.create_dataset("PFL", data=rows + 1)
    return path


@pytest.mark.parametrize("partly", [False, True])
def test_modes_and_static_solutions_of_code_aster(tmp_path, partly):
    """In a profile of the nodes above the lowest layer, or at all of them."""
    points, rng = block()[0], np.random.default_rng(0)
    values = rng.standard_normal((4, len(points), 3))
    rows = np.flatnonzero(points[:, 2] > 0.0) if partly else None
    fields = {"MODES___DEPL": zip((150.0, 90.0, 400.0), values), "STAT____DEPL": [(0.0, values[3])]}
    fields |= {"MODES___REAC_NODA": [(150.0, values[1])], "STAT____FORC_NODA": [(0.0, values[2])]}  # no motions
    path = written_med(tmp_path / "block.med", fields, rows)
    body = fi.Body.load(path, mass=3.0, loads=[(len(points), (0.0, 0.0, 1.0))])
    wanted = np.where((points[:, 2:] > 0.0) | (not partly), values, 0.0)
    assert_allclose(body.frequencies, [90.0, 150.0, 400.0])
    assert_allclose(body.shapes, np.moveaxis(wanted[[1, 0, 2]], 0, 2))
    assert_allclose(body.static[:, :, 0], wanted[3])
    assert body.solid is True and body.at("corner") == pytest.approx((0.3, 0.2, 0.1))
    assert len(body.cells) == 2 * 2 * (3 * 2 + 3 * 2 + 2 * 2)  # two triangles a face, each once


def test_meshes_of_abaqus_tell_shells_from_solids(tmp_path):
    """Labels of nodes are their own; a set of one node is a name."""
    points, cells, top = block()
    for kind, name, rows, solid in (("C3D8", "solid", cells, True), ("S4R", "shell", top, ())):
        used = np.unique(rows)
        nodes = [f"{100 + i}, " + ", ".join(f"{x:.6g}" for x in points[i]) for i in used]
        elements = [f"{k + 1}, " + ", ".join(str(100 + i) for i in row) for k, row in enumerate(rows)]
        lines = ["*Heading", "** written by hand", "*Node, nset=all", *nodes, f"*Element, type={kind}", *elements]
        (tmp_path / f"{name}.inp").write_text("\n".join([*lines, "*Nset, nset=corner", f"{100 + used[-1]},", ""]))
        shapes = np.random.default_rng(0).standard_normal((len(used), 3, 2))
        modes = {"frequencies": [50.0, 80.0], "shapes": shapes}
        body = fi.Body.load([tmp_path / f"{name}.inp", modes], mass=1.0)
        assert body.solid == solid and body.names["corner"] == body.numbers[-1] == 100 + used[-1]
        assert_allclose(body.nodes, points[used], rtol=1e-5)
        upwards = abs(body.normals[body.node("corner")][2])
        assert upwards == pytest.approx(1.0) if name == "shell" else 0.3 < upwards < 0.9


def test_modes_of_ansys():
    """The file that ansys-mapdl-reader ships: a free-free pair of bending modes first; and a mesh of solids."""
    examples = pytest.importorskip("ansys.mapdl.reader.examples", reason="the ansys extra is not installed")
    from ansys.mapdl import reader

    body, read = fi.Body.load(examples.rstfile, mass=2.3e-3), reader.read_binary(examples.rstfile)
    assert_allclose(body.frequencies, read.time_values, rtol=1e-12)
    numbers, moved = read.nodal_solution(2)
    assert_allclose(body.shapes[[body.node(int(number)) for number in numbers], :, 2], moved)
    assert body.solid is True
    hit = struck(body.modes("normal"), body.at(int(body.numbers[body.normals.any(axis=1)][0])))
    assert "not stated of the target" in hit.verdict
