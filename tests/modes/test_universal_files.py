"""Universal files: modes written and read back, measured modes struck, what is missing named."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.modes import universal_files
from fem_impact.show import sampling

pyuff = pytest.importorskip("pyuff", reason="the uff extra is not installed")
pytestmark = pytest.mark.usefixtures("read_here")
STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Modes of a free plate, the points and triangles that are written of them, and the file."""
    path = tmp_path_factory.mktemp("written") / "plate.uff"
    modes = fi.find_modes(
        fi.assemble(fi.mesh.rectangle(0.4, 0.3), fi.Plate(STEEL, 2e-3)), n_modes=8, damping_ratio=0.01
    )
    fi.export.write_uff(path, modes)
    return modes, *modes.shapes.grid(), path


@pytest.fixture
def plate(written):
    """The points of that plate, its data sets to change, and the modes as they were written."""
    *_, path = written
    return written[1], pyuff.UFF(str(path)).read_sets(), fi.Modes.from_uff(path, mass=1.0)


@pytest.fixture
def read(tmp_path):
    """Write data sets and read their modes."""

    def read(sets, **told):
        (tmp_path / "other.uff").unlink(missing_ok=True)
        pyuff.UFF(str(tmp_path / "other.uff")).write_sets(sets, mode="add")
        return fi.Modes.from_uff(tmp_path / "other.uff", **({"mass": 1.0} | told))

    return read


def assert_same(found, modes, points):
    assert_allclose(found.frequencies, modes.frequencies, rtol=1e-5)  # six digits are written
    shapes = modes.shape_at(points)
    assert_allclose(found.shape_at(points), shapes, atol=1e-5 * np.abs(shapes).max())


def test_shapes_of_another_size_than_the_mass_are_noted_once(written):
    notes = fi.Modes.from_uff(written[-1], mass=1e4).notes
    assert sum("times as large as those of a body" in note for note in notes) == 1


def test_modes_come_back_as_they_were_written_with_their_elements(written, tmp_path):
    modes, points, cells, path = written
    again = fi.Modes.from_uff(path, mass=modes.mass)
    assert_same(again, modes, points)
    assert_allclose(again.damping_ratio, modes.damping_ratio, rtol=1e-5)
    assert again.n_rigid == 3 and modes.continuous and not again.continuous
    assert np.array_equal(again.shapes.grid()[1], cells)
    drawn = sampling.grid(again)  # not refined: nothing is known between the points
    assert_allclose(drawn[0], points, atol=1e-9)
    assert np.array_equal(drawn[1], cells)
    assert len(fi.figures.mode_shapes(again, count=4).axes) >= 4
    fi.export.write_uff(tmp_path / "again.uff", again)
    assert np.array_equal(fi.Modes.from_uff(tmp_path / "again.uff", mass=modes.mass).shapes.grid()[1], cells)
    with pytest.raises(ValueError, match="in_air needs"):
        fi.in_air(again)


def test_rounding_of_rigid_motions_is_none_and_a_mount_no_rigid_motion(plate, read, tmp_path):
    """Both doors say the same."""
    sets = plate[1]
    first = next(each["freq"] for each in sets if each.get("freq"))
    for frequency, n_rigid in ((1e-5 * first, 3), (5e-3 * first, 0)):
        for each in [each for each in sets if each["type"] == 55][:3]:
            each["freq"] = frequency
        assert read(sets).n_rigid == fi.Body.load(tmp_path / "other.uff", mass=1.0).modes("z").n_rigid == n_rigid


def test_nodes_and_triangles_are_in_the_file(written, plate):
    points, sets, _ = plate
    assert [s["type"] for s in sets[:4]] == [15, 2411, 2412, 55]
    assert_allclose(sets[0]["x"], points[:, 0], atol=1e-6)
    assert_allclose([element["nodes_nums"] for element in sets[2][91]], written[2] + 1)  # 91: thin shell triangle


def element(code, nodes):
    beam = {"beam_orientation": 0, "beam_foreend_cross": 1, "beam_aftend_cross": 1} if code == 11 else {}
    return {"element_nums": 1, "fe_descriptor": code, "phys_table": 1, "mat_table": 1, "color": 1,
            "num_nodes": len(nodes), "nodes_nums": nodes} | beam  # fmt: skip


def test_other_elements_are_taken_by_their_corners(plate, read, tmp_path):
    points, sets, _ = plate
    kept = [s for s in sets if s["type"] != 2412]
    mixed = {94: [[1, 2, 3, 4]], 92: [[1, 9, 2, 8, 3, 7]], 95: [[1, 9, 2, 8, 3, 7, 5, 6]], 11: [[1, 2]],
             111: [[1, 2, 3, 4]], 91: [[1, 2, 999_999]]}  # fmt: skip
    table = {code: [element(code, nodes) for nodes in rows] for code, rows in mixed.items()}
    found = {tuple(cell) for cell in read([{"type": 2412} | table, *kept]).shapes.grid()[1].tolist()}
    assert found == {(0, 1, 2), (0, 2, 3), (0, 2, 4)}  # quadrilateral halved; (0, 1, 2) is in three of them
    bare = tmp_path / "bare.uff"
    solid = element(116, list(range(1, 21)))  # on three lines, as the format has it
    pyuff.UFF(str(bare)).write_sets([{"type": 2412, 116: [solid]}, *kept], mode="add")
    line = "".join(f"{node:10d}" for node in range(1, 21))
    assert line in bare.read_text()
    bare.write_text(bare.read_text().replace(line, "\n".join((line[:80], line[80:160], line[160:]))))
    assert fi.Modes.from_uff(bare, mass=1.0).shapes.grid()[1].shape == (len(points), 1)  # points alone


def test_a_beam_comes_back_as_a_line_of_points(tmp_path):
    beam = fi.Beam.rectangular(STEEL, width=0.02, height=0.01)
    modes = fi.find_modes(fi.assemble(fi.mesh.line(1.0, size=0.1), beam, {"left": "clamped"}), n_modes=3)
    points, cells = modes.shapes.grid()
    told = modes.frequencies, modes.damping_ratio, modes.shape_at(points), points, cells
    universal_files.write_modes(tmp_path / "bar.unv", *told)
    again = fi.Modes.from_uff(tmp_path / "bar.unv", mass=modes.mass)
    assert again.dimension == 1 and np.array_equal(again.shapes.grid()[1], cells)
    assert_allclose(again.shape_at([1.0]), modes.shape_at([1.0]), rtol=1e-5)


def test_shapes_are_scaled_by_their_modal_mass(plate, read):
    points, sets, plain = plate
    for entry in sets[3:]:
        entry["modal_m"], entry["r3"] = 4.0, 2.0 * entry["r3"]
        entry["modal_damp_vis"], entry["modal_damp_his"] = 0.0, 0.02  # a loss factor: twice the damping ratio
    scaled = read(sets)
    assert_allclose(scaled.damping_ratio, 0.01)
    assert_allclose(scaled.shape_at(points), plain.shape_at(points), rtol=2e-5, atol=1e-6)


def test_files_in_other_units_or_frames_and_of_other_quantities(written, plate, read):
    """Inches and pounds of force, for which the unit of mass is 175 kg, and stresses beside shapes."""
    modes, points, sets = written[0], *plate[:2]
    inch, pound = 1.0 / 0.0254, 1.0 / 4.4482216152605
    for entry in sets[:2]:
        entry.update({axis: np.asarray(entry[axis]) * inch for axis in "xyz"})
    for entry in sets[3:]:
        entry["r3"] = entry["r3"] / np.sqrt(pound / inch)
    units = {"type": 164, "units_code": 7, "units_description": "inch", "temp_mode": 1, "length": inch, "force": pound}
    stresses = [entry | {"spec_data_type": 2, "data_type": 4} for entry in sets[3:]]
    assert_same(read([units | {"temp": 1.0, "temp_offset": 0.0}, *sets, *stresses], mass=modes.mass), modes, points)
    frames = {"type": 2420, "CS_colors": [8, 8], "CS_names": ["all", "own"], "CS_sys_labels": [1, 5]}
    frames |= {"CS_types": [0, 0], "CS_matrices": [np.eye(4)[:, :3], np.eye(4)[::-1, :3]]}

    def framed(system):
        return read([frames, *(entry | {"disp_cs": np.full(len(points), system)} for entry in sets[:2]), *sets[2:]])

    assert framed(1).n_modes == modes.n_modes
    with pytest.raises(ValueError, match="nodes in coordinate system 5; export all in the global one"):
        framed(5)


@pytest.mark.parametrize(
    ("kind", "x", "z", "own"),
    [(0, (2.0, 0.0, 0.0), (3.0, 0.0, 1.0), False), (1, (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), True),
     (0, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), True), (0, (1.0, 0.0, 0.0), (0.0, 0.0, -1.0), True)],
)  # fmt: skip
def test_older_frames_of_nodes(plate, read, kind, x, z, own):
    """Data set 18 goes with nodes in 15: by an origin, a point on the axis x and one in the plane of x and z."""
    _, sets, plain = plate
    frame = {"type": 18, "cs_num": [4], "cs_type": [kind], "ref_cs_num": [0], "ref_o": [(0.0, 0.0, 0.0)]}
    frame |= {"x_point": [x], "xz_point": [z]}
    nodes = sets[0] | {"def_cs": np.full(len(sets[0]["x"]), 4)}
    if not own:
        assert read([nodes, frame, *sets[3:]]).n_modes == plain.n_modes
        return
    with pytest.raises(ValueError, match="nodes in coordinate system 4; export all in the global one"):
        read([nodes, frame, *sets[3:]])


@pytest.mark.parametrize("analysis", [2, 3])
def test_complex_shapes_of_newer_data_sets(plate, read, tmp_path, analysis):
    """Data set 2414 with real and imaginary parts in turn, all turned by one phase; by modal mass or modal A."""
    points, sets, plain = plate
    names = ("model_type", "analysis_type", "data_characteristic", "result_type", "data_type")
    head = {"type": 2414, "analysis_dataset_label": 1, "analysis_dataset_name": "mode", "dataset_location": 1,
            "number_of_data_values_for_the_data_component": 3} | dict(zip(names, (1, analysis, 2, 8, 5)))  # fmt: skip
    head |= {f"id{i}": "NONE" for i in range(1, 6)}
    head |= {f"record{k}_field{i}": 0 for k, n in ((10, 8), (11, 8), (12, 6), (13, 6)) for i in range(1, n + 1)}
    moved = []
    for one in sets[6:]:
        turned = np.column_stack([0.3 * one["r3"], 0.0 * one["r3"], one["r3"]]) * np.exp(0.4j)
        told = {"node_nums": one["node_nums"], "data_at_node": list(turned.view(float)), "record12_field2": one["freq"]}
        omega = 2.0 * np.pi * one["freq"]
        told |= (
            {"record13_field2": omega, "record13_field4": 2.0 * omega} if analysis == 3 else {"record12_field4": 1.0}
        )
        moved.append(head | told)
    found, wanted = read([*sets[:3], *moved], free=False), plain.shape_at(points)[:, 3:]
    assert_allclose(found.frequencies, plain.frequencies[3:], rtol=1e-5)
    assert_allclose(np.abs(found.shape_at(points)), np.abs(wanted), atol=2e-5 * np.abs(wanted).max())


def test_what_a_file_lacks_is_said(written, plate, read, tmp_path):
    _, sets, _ = plate
    said = r"must hold nodes \(15 or 2411\) and mode shapes \(55\) of.*; its data sets are 15"
    with pytest.raises(ValueError, match=said):
        read(sets[:1])
    with pytest.raises(ValueError, match=r"each mode once, but that at 161\.208 Hz is there twice"):
        read([*sets, sets[-1]])
    (tmp_path / "cut.uff").write_bytes(written[-1].read_bytes()[:-5000])
    with pytest.raises(ValueError, match=r"cut\.uff ends within a data set; it may be cut off"):
        fi.Modes.from_uff(tmp_path / "cut.uff", mass=1.0)
    with pytest.raises(ValueError, match=r"other\.uff has a mode with two shapes at one node; export it again"):
        read([*sets[:3], sets[-1] | {"node_nums": np.maximum(sets[-1]["node_nums"], 2)}])
    with pytest.raises(ValueError, match="there is no such file"):
        fi.Modes.from_uff(tmp_path / "none.uff", mass=1.0)
    with pytest.raises(ValueError, match=r"one along which plate.uff has motions, got 'x'"):
        fi.Modes.from_uff(written[-1], mass=1.0, direction="x")
    with pytest.raises(ValueError, match="direction must be one of x, y, z"):
        fi.Modes.from_uff(written[-1], mass=1.0, direction="up")
    with pytest.raises(ValueError, match="no shape to write"):
        fi.export.write_uff(tmp_path / "mass.uff", fi.Modes.rigid(1.0))


@pytest.mark.parametrize("ratio", [2.0, 1.0, -0.02, -1e-4])
def test_a_mode_that_would_not_swing_or_would_grow_is_refused(plate, read, tmp_path, ratio):
    """Light damping, as it is found from measurements, may be below zero by a thousandth."""
    _, sets, _ = plate
    sets[-1]["modal_damp_vis"] = ratio
    sets[3]["modal_damp_vis"] = 2.0  # of a rigid motion
    if ratio == -1e-4:
        assert read(sets).damping_ratio[[-2, -1]].tolist() == [0.01, 0.0]
        return
    said = f"other.uff must state damping ratios .*, got {ratio:g} for mode 8 at .*give damping_ratio to fi.Body.load"
    with pytest.raises(ValueError, match=said):
        read(sets)
    with pytest.raises(ValueError, match=said):
        fi.Body.load(tmp_path / "other.uff", mass=1.0)
    assert set(fi.Body.load(tmp_path / "other.uff", mass=1.0, damping_ratio=0.02).damping_ratio[3:]) == {0.02}


@pytest.mark.parametrize(("degrees", "real"), [(10.0, True), (25.0, False)])
def test_shapes_with_phases_of_some_degrees_are_taken_as_real(plate, read, degrees, real):
    """Half of the points lead, half lag."""
    points, sets, plain = plate
    for entry in sets[3:]:
        phase = np.radians(degrees) * np.where(np.arange(len(entry["r3"])) % 2, 1.0, -1.0)
        entry["r3"] = entry["r3"] * np.exp(1j * phase)
        entry["r1"], entry["r2"], entry["data_type"] = 0.0 * entry["r3"], 0.0 * entry["r3"], 5
    if real:
        found, whole = (np.abs(each.shape_at(points)).max() for each in (read(sets), plain))
        assert found == pytest.approx(whole, rel=0.02)  # the cosine of 10 degrees
    else:
        with pytest.raises(ValueError, match="phases far from 0 and 180 degrees"):
            read(sets)
