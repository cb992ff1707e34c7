"""Universal files: modes written and read back, measured modes struck, what is missing named."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_impact import mesh
from fem_impact.fe.assembly import assemble
from fem_impact.fe.section import Beam, Material, Plate
from fem_impact.modes import universal_files
from fem_impact.modes.air import in_air
from fem_impact.modes.finding import find_modes
from fem_impact.modes.modal import Modes
from fem_impact.show import export, figures, sampling

pyuff = pytest.importorskip("pyuff", reason="the uff extra is not installed")
pytestmark = pytest.mark.usefixtures("read_here")
PLATE = Plate(Material(E=210e9, nu=0.3, rho=7850.0), 2e-3)


def written(tmp_path):
    modes = find_modes(assemble(mesh.rectangle(0.4, 0.3), PLATE), n_modes=8, damping_ratio=0.01)
    points, cells = modes.shapes.grid()
    path = tmp_path / "plate.uff"
    export.write_uff(path, modes)
    return modes, points, cells, path


def test_modes_come_back_as_they_were_written(tmp_path):
    modes, points, _, path = written(tmp_path)
    again = Modes.from_uff(path, mass=modes.mass)
    assert_allclose(again.frequencies, modes.frequencies, rtol=1e-5)  # six digits are written
    assert_allclose(again.damping_ratio, modes.damping_ratio, rtol=1e-5)
    shapes = modes.shape_at(points)
    assert_allclose(again.shape_at(points), shapes, atol=1e-5 * np.abs(shapes).max())
    assert again.n_rigid == 3


def test_nodes_and_triangles_are_in_the_file(tmp_path):
    _, points, cells, path = written(tmp_path)
    sets = pyuff.UFF(str(path)).read_sets()
    assert [s["type"] for s in sets[:4]] == [15, 2411, 2412, 55]
    assert_allclose(sets[0]["x"], points[:, 0], atol=1e-6)
    assert_allclose([element["nodes_nums"] for element in sets[2][91]], cells + 1)  # 91: thin shell triangle


def test_elements_come_back_and_connect_the_measured_points(tmp_path):
    modes, points, cells, path = written(tmp_path)
    again = Modes.from_uff(path, mass=modes.mass)
    assert np.array_equal(again.shapes.grid()[1], cells)
    assert not again.continuous and modes.continuous
    drawn = sampling.grid(again)  # not refined: nothing is known between the points
    assert_allclose(drawn[0], points, atol=1e-9)
    assert np.array_equal(drawn[1], cells)
    figure = figures.mode_shapes(again, count=4)
    assert len(figure.axes) >= 4
    export.write_uff(tmp_path / "again.uff", again)
    assert np.array_equal(Modes.from_uff(tmp_path / "again.uff", mass=modes.mass).shapes.grid()[1], cells)
    with pytest.raises(ValueError, match="in_air needs"):
        in_air(again)


def test_other_elements_are_taken_by_their_corners(tmp_path):
    _, points, _, path = written(tmp_path)
    sets = pyuff.UFF(str(path)).read_sets()

    def element(code, nodes):
        beam = {"beam_orientation": 0, "beam_foreend_cross": 1, "beam_aftend_cross": 1} if code == 11 else {}
        return {"element_nums": 1, "fe_descriptor": code, "phys_table": 1, "mat_table": 1, "color": 1,
                "num_nodes": len(nodes), "nodes_nums": nodes} | beam  # fmt: skip

    mixed = [(94, [1, 2, 3, 4]), (92, [1, 9, 2, 8, 3, 7]), (95, [1, 9, 2, 8, 3, 7, 5, 6]), (11, [1, 2]),
             (111, [1, 2, 3, 4]), (91, [1, 2, 999_999])]  # fmt: skip
    table = {}
    for code, nodes in mixed:
        table.setdefault(code, []).append(element(code, nodes))
    other = tmp_path / "mixed.uff"
    kept = [s for s in sets if s["type"] != 2412]
    pyuff.UFF(str(other)).write_sets([{"type": 2412} | table, *kept], mode="add")
    found = {tuple(cell) for cell in Modes.from_uff(other, mass=1.0).shapes.grid()[1].tolist()}
    assert found == {(0, 1, 2), (0, 2, 3), (0, 2, 4)}  # quadrilateral halved; (0, 1, 2) is in three of them
    bare = tmp_path / "bare.uff"
    solid = element(116, list(range(1, 21)))  # on three lines, as the format has it
    pyuff.UFF(str(bare)).write_sets([{"type": 2412, 116: [solid]}, *kept], mode="add")
    line = "".join(f"{node:10d}" for node in range(1, 21))
    assert line in bare.read_text()
    bare.write_text(bare.read_text().replace(line, "\n".join((line[:80], line[80:160], line[160:]))))
    assert Modes.from_uff(bare, mass=1.0).shapes.grid()[1].shape == (len(points), 1)  # points alone


def test_a_beam_comes_back_as_a_line_of_points(tmp_path):
    beam = Beam.rectangular(Material(E=210e9, nu=0.3, rho=7850.0), width=0.02, height=0.01)
    modes = find_modes(assemble(mesh.line(1.0, size=0.1), beam, {"left": "clamped"}), n_modes=3)
    points, cells = modes.shapes.grid()
    universal_files.write_modes(
        tmp_path / "bar.unv", modes.frequencies, modes.damping_ratio, modes.shape_at(points), points, cells
    )
    again = Modes.from_uff(tmp_path / "bar.unv", mass=modes.mass)
    assert again.dimension == 1
    assert_allclose(again.shape_at([1.0]), modes.shape_at([1.0]), rtol=1e-5)
    assert np.array_equal(again.shapes.grid()[1], cells)


def test_shapes_are_scaled_by_their_modal_mass(tmp_path):
    _, points, _, path = written(tmp_path)
    sets = pyuff.UFF(str(path)).read_sets()
    for entry in sets[3:]:
        entry["modal_m"], entry["r3"] = 4.0, 2.0 * entry["r3"]
        entry["modal_damp_vis"], entry["modal_damp_his"] = 0.0, 0.02  # a loss factor: twice the damping ratio
    other = tmp_path / "scaled.uff"
    pyuff.UFF(str(other)).write_sets(sets, mode="add")
    assert_allclose(Modes.from_uff(other, mass=1.0).damping_ratio, 0.01)
    assert_allclose(
        Modes.from_uff(other, mass=1.0).shape_at(points),
        Modes.from_uff(path, mass=1.0).shape_at(points),
        rtol=2e-5,
        atol=1e-6,
    )


def test_files_in_other_units_or_frames_and_of_other_quantities(tmp_path):
    """Inches and pounds of force, for which the unit of mass is 175 kg, and stresses beside shapes."""
    modes, points, _, path = written(tmp_path)
    sets = pyuff.UFF(str(path)).read_sets()
    inch, pound, other = 1.0 / 0.0254, 1.0 / 4.4482216152605, tmp_path / "other.uff"
    for entry in sets[:2]:
        entry.update({axis: np.asarray(entry[axis]) * inch for axis in "xyz"})
    for entry in sets[3:]:
        entry["r3"] = entry["r3"] / np.sqrt(pound / inch)
    units = {"type": 164, "units_code": 7, "units_description": "inch", "temp_mode": 1, "length": inch, "force": pound}
    stresses = [entry | {"spec_data_type": 2, "data_type": 4} for entry in sets[3:]]
    pyuff.UFF(str(other)).write_sets([units | {"temp": 1.0, "temp_offset": 0.0}, *sets, *stresses], mode="add")
    again = Modes.from_uff(other, mass=modes.mass)
    assert_allclose(again.frequencies, modes.frequencies, rtol=1e-5)
    shapes = modes.shape_at(points)
    assert_allclose(again.shape_at(points), shapes, atol=1e-5 * np.abs(shapes).max())
    frames = {"type": 2420, "CS_colors": [8, 8], "CS_names": ["all", "own"], "CS_sys_labels": [1, 5]}
    frames |= {"CS_types": [0, 0], "CS_matrices": [np.eye(4)[:, :3], np.eye(4)[::-1, :3]]}
    for system, told in ((1, True), (5, False)):
        for entry in sets[:2]:
            entry["disp_cs"] = np.full(len(points), system)
        framed = tmp_path / f"framed{system}.uff"
        pyuff.UFF(str(framed)).write_sets([frames, *sets], mode="add")
        if told:
            assert Modes.from_uff(framed, mass=1.0).n_modes == modes.n_modes
        else:
            with pytest.raises(ValueError, match="nodes in coordinate system 5; export all in the global one"):
                Modes.from_uff(framed, mass=1.0)


def test_what_a_file_lacks_is_said(tmp_path):
    _, _, _, path = written(tmp_path)
    sets = pyuff.UFF(str(path)).read_sets()
    alone = tmp_path / "nodes.uff"
    pyuff.UFF(str(alone)).write_sets(sets[:1], mode="add")
    with pytest.raises(
        ValueError, match=r"must hold nodes \(15 or 2411\) and mode shapes \(55\) of.*; its data sets are 15"
    ):
        Modes.from_uff(alone, mass=1.0)
    for entry in sets[3:]:
        entry["modal_m"] = 0.0
    bare = tmp_path / "bare.uff"
    pyuff.UFF(str(bare)).write_sets(sets, mode="add")
    with pytest.raises(ValueError, match=r"states no modal mass for mode 1"):
        Modes.from_uff(bare, mass=1.0)
    with pytest.raises(ValueError, match="there is no such file"):
        Modes.from_uff(tmp_path / "none.uff", mass=1.0)
    with pytest.raises(ValueError, match="direction must be one of x, y, z"):
        Modes.from_uff(path, mass=1.0, direction="up")


def test_a_rigid_mass_has_no_shape_to_write(tmp_path):
    with pytest.raises(ValueError, match="no shape to write"):
        export.write_uff(tmp_path / "mass.uff", Modes.rigid(1.0))


@pytest.mark.parametrize(("degrees", "real"), [(10.0, True), (25.0, False)])
def test_shapes_with_phases_of_some_degrees_are_taken_as_real(tmp_path, degrees, real):
    """Half of the points lead, half lag."""
    _, points, _, path = written(tmp_path)
    sets = pyuff.UFF(str(path)).read_sets()
    for entry in sets[3:]:
        phase = np.radians(degrees) * np.where(np.arange(len(entry["r3"])) % 2, 1.0, -1.0)
        entry["r3"] = entry["r3"] * np.exp(1j * phase)
        entry["r1"], entry["r2"], entry["data_type"] = 0.0 * entry["r3"], 0.0 * entry["r3"], 5
    other = tmp_path / "complex.uff"
    pyuff.UFF(str(other)).write_sets(sets, mode="add")
    if real:
        found, whole = (Modes.from_uff(each, mass=1.0).shape_at(points) for each in (other, path))
        assert np.abs(found).max() == pytest.approx(np.abs(whole).max(), rel=0.02)  # the cosine of 10 degrees
    else:
        with pytest.raises(ValueError, match="phases far from 0 and 180 degrees"):
            Modes.from_uff(other, mass=1.0)
