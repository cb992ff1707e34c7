"""Files must say the same as the objects they were written from, to readers other than ours."""

import json
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
import pyuff
import pyvista
from numpy.testing import assert_allclose
from scipy.io import wavfile

import fem_impact as fi
from fem_impact.show import export, sampling, sound


def frames(path):
    """Times of a collection and what pyvista reads of each."""
    reader = pyvista.get_reader(path)
    for i, time in enumerate(reader.time_values):
        reader.set_active_time_point(i)
        yield time, reader.read()[0]


@pytest.mark.slow
def test_motion_of_a_plate_with_a_hole_opens_though_chords_leave_it(tmp_path):
    plate = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), 2e-3)
    ring = fi.find_modes(fi.assemble(fi.mesh.disk(0.2, 0.05, size=0.06), plate, {"outer": "clamped"}), n_modes=6)
    hit = fi.strike(ring, fi.Striker.rigid(0.02), fi.Contact.hertz(1e6), at=(0.12, 0.0), speed=1.0, tolerance=1e-1)
    points, _ = sampling.grid(ring)
    inside = ring.shapes.contains(points)
    assert not inside.all()  # the case this is about
    export.write_vtk(tmp_path / "motion.pvd", ring, hit, [0.0, 1e-4])
    _, (_, grid) = frames(tmp_path / "motion.pvd")
    for name, said in (("displacement", hit.displacement), ("velocity", hit.velocity)):
        there = said(points[inside], [1e-4], residual=False)[0]
        assert_allclose(grid.point_data[name][inside, 2], there, rtol=0, atol=1e-12 * np.abs(there).max())


def test_collection_opens_in_pyvista_with_frequencies_as_times(tmp_path, modes):
    export.write_vtk(tmp_path / "modes.pvd", modes.truncated(n_modes=5))
    found = list(frames(tmp_path / "modes.pvd"))
    assert_allclose([time for time, _ in found], modes.frequencies[:5], rtol=1e-8)  # spread by 1e-9 where equal
    for i, (_, grid) in enumerate(found):
        assert_allclose(grid.field_data["frequency"], modes.frequencies[i], rtol=0, atol=0)
        assert grid.field_data["mode"] == i + 1
        inside = grid.points[:, :2].astype(float)
        assert_allclose(grid.point_data["shape"], modes.shape_at(inside)[:, i], rtol=0, atol=1e-12)
        # the warp lifts by a tenth of the plate's length at most
        assert_allclose(np.abs(grid.point_data["warp"]).max(), 0.1 * 0.465, rtol=1e-12)


def test_equal_frequencies_stay_apart_as_times(tmp_path):
    disk = fi.analytic.disk(0.1, edge="clamped", nu=0.3, mass=0.1, first_frequency=200.0, n_modes=5)
    export.write_vtk(tmp_path / "disk.PVD", disk)
    times = pyvista.get_reader(tmp_path / "disk.PVD").time_values
    assert len(set(times)) == 5 and disk.frequencies[1] == disk.frequencies[2]
    assert_allclose(times, disk.frequencies, rtol=1e-8)


def test_single_file_opens_in_meshio_and_pyvista(tmp_path, modes):
    export.write_vtk(tmp_path / "modes.vtu", modes)
    grid, points = pyvista.read(tmp_path / "modes.vtu"), sampling.grid(modes)[0]
    assert_allclose(grid.field_data["frequency"], modes.frequencies, rtol=0, atol=0)
    other = meshio.read(tmp_path / "modes.vtu")
    for data in (grid.point_data, other.point_data):
        assert_allclose(data["mode_007"], modes.shape_at(points)[:, 6], rtol=0, atol=0)
    assert_allclose(other.points[:, :2], points, rtol=0, atol=0)


def test_beam_is_drawn_by_lines_and_a_rigid_mass_by_one_point(tmp_path):
    beam = fi.analytic.beam(0.4, mass=0.1, first_frequency=1e3, n_modes=3)
    export.write_vtk(tmp_path / "beam.vtu", beam)
    grid = pyvista.read(tmp_path / "beam.vtu")
    assert set(grid.celltypes) == {pyvista.CellType.LINE} and grid.bounds[1] == pytest.approx(0.4)
    export.write_vtk(tmp_path / "rigid.vtu", fi.Modes.rigid(1.0))
    assert pyvista.read(tmp_path / "rigid.vtu").n_points == 1


def test_motion_has_displacement_and_velocity_at_each_time(tmp_path, modes, hit):
    times = [1e-4, 1e-3, 5e-3]
    export.write_vtk(tmp_path / "wave.pvd", modes, hit, times)
    found, points = list(frames(tmp_path / "wave.pvd")), sampling.grid(modes)[0]
    assert [time for time, _ in found] == times
    for instant, grid in found:
        for name, history in (("displacement", hit.displacement), ("velocity", hit.velocity)):
            there = history(points, [instant], residual=False)[0]
            assert_allclose(grid.point_data[name][:, 2], there, rtol=0, atol=1e-15)
        place, force = grid.field_data["striker"][0], grid.field_data["force"][0]
        assert_allclose(place[:2], hit.at, rtol=0, atol=0)
        assert force == hit.history.force_at(np.array([instant]), 0)[0][0]
        indentation = place[2] - hit.displacement([hit.at], [instant])[0, 0]
        assert (force > 0.0) == (indentation > 0.0)  # it presses where it is pressed in


@pytest.mark.parametrize(("write", "text"), [
    (lambda at, modes, hit: export.write_vtk(at / "a.pvd", modes, hit), "times must be given with response"),
    (lambda at, modes, hit: export.write_wav(at / "a.wav", hit, duration=0.0), "duration must be positive"),
    (lambda at, modes, hit: export.write_wav(at / "a.mp3", hit), "path ending must be one of .wav, got '.mp3'"),
    (lambda at, modes, hit: export.write_animation(at / "a.vtu", modes, 1), "must end in .pvd"),
    (lambda at, modes, hit: export.write_animation(at / "a.pvd", modes, 31), "mode must be at most 30, got 31"),
    (lambda at, modes, hit: export.write_animation(at / "a.pvd", modes, 0), "at least 1"),
    (lambda at, modes, hit: export.write_history(at / "a.bdf", hit, direction="up"), "direction must be one of"),
    (lambda at, modes, hit: export.write_history(at / "a.bdf", hit, node=0), "node must be"),
    (lambda at, modes, hit: export.write_history(at / "a.bdf", hit, times=[[0.0]]), "times"),
    (lambda at, modes, hit: export.write_history(at / "a.csv", hit), r"path ending must be one of \.op4, \.uff"),
])  # fmt: skip
def test_what_cannot_be_written_says_why_and_leaves_nothing(tmp_path, modes, hit, write, text):
    with pytest.raises(ValueError, match=text):
        write(tmp_path, modes, hit)
    assert not list(tmp_path.iterdir())


def test_names_with_markup_stay_names(tmp_path, modes):
    path = tmp_path / 'a"<&b.pvd'
    export.write_vtk(path, modes.truncated(n_modes=1))
    (data,) = ElementTree.parse(path).getroot().iter("DataSet")
    assert (tmp_path / data.get("file")).is_file()


def test_force_table_keeps_every_digit(tmp_path, hit):
    export.write_force(tmp_path / "force.csv", hit)
    assert (tmp_path / "force.csv").read_text().splitlines()[0] == "time [s],force [N]"
    table = np.loadtxt(tmp_path / "force.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(table, np.column_stack([hit.time, hit.force]))


def test_force_table_has_a_column_for_each_contact(tmp_path):
    law = fi.Contact.linear(1e6)
    hit = fi.collide([fi.Modes.rigid(0.1)] * 3, [fi.Touch(law, 0, 1), fi.Touch(law, 1, 2)], speeds=[1.0, 0.0, 0.0])
    export.write_force(tmp_path / "force.csv", hit)
    assert (tmp_path / "force.csv").read_text().splitlines()[0] == "time [s],force_1 [N],force_2 [N]"
    table = np.loadtxt(tmp_path / "force.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(table, np.column_stack([hit.time, hit.force]))


def test_a_sound_file_can_be_heard_ends_softly_and_keeps_its_true_level(tmp_path):
    plate = fi.analytic.rectangle(0.3, 0.2, mass=0.2, first_frequency=100.0, n_modes=20)  # rings for ever
    for speed in (1.0, 1e-3, 30.0):
        blow = {"at": (0.1, 0.07), "speed": speed, "tolerance": 0.1}
        hit = fi.strike(plate, fi.Striker.rigid(0.01), fi.Contact.hertz(1e6), **blow)
        heard, plain = export.write_wav(tmp_path / "a.wav", hit, duration=1.0), sound.synthesise(hit, duration=1.0)
        samples, raw = wavfile.read(tmp_path / "a.wav")[1], (tmp_path / "a.wav").read_bytes()
        assert -20.0 <= heard.peak_level <= 0.0
        assert heard.level == pytest.approx(plain.level, abs=1e-9)  # the loudest sample comes first
        assert np.abs(plain.samples[-480:]).max() > 0.05 * np.abs(plain.samples).max()  # it would click
        assert np.abs(samples[-48:]).max() < 1e-3 * np.abs(samples).max()
        assert heard.stated.replace("−", "-").replace("µ", "u").encode() in raw
        assert len(raw) == 8 + int.from_bytes(raw[4:8], "little")
    loudest = export.write_wav(tmp_path / "b.wav", hit, duration=1.0, normalise=True)
    assert np.abs(loudest.samples).max() == pytest.approx(1.0)


def test_numbers_are_those_of_the_response_and_valid_json_which_cannot_hold_all(tmp_path, hit):
    export.write_json(tmp_path / "a.json", export.numbers(hit))
    data = json.loads((tmp_path / "a.json").read_text(), parse_constant=pytest.fail)
    told, impacts = data["response"], data["impacts"]
    assert told["restitution"] == hit.restitution and told["error"]["total"] == hit.error.total
    assert len(impacts) == told["n_impacts"] == hit.n_impacts and impacts[0]["impulse"] == hit.impacts[0].impulse
    mixed = {"a": np.nan, "b": [np.inf, np.float32(0.5)], 3: np.arange(2), "c": (True, None, "x")}
    assert export.plain(mixed) == {"a": None, "b": [None, 0.5], "3": [0, 1], "c": [True, None, "x"]}


def test_animation_swings_a_mode_through_one_period(tmp_path, modes):
    export.write_animation(tmp_path / "swing.pvd", modes, 3, frames=8)
    found = list(frames(tmp_path / "swing.pvd"))
    times, heights = [time for time, _ in found], [grid.point_data["warp"][:, 2] for _, grid in found]
    assert_allclose(times, np.arange(8) / 8 / modes.frequencies[2], rtol=1e-15)  # written with every digit
    shape = modes.shape_at(sampling.grid(modes)[0])[:, 2]
    lifted = 0.1 * 0.465 * shape / np.abs(shape).max()  # a tenth of the plate's length
    assert_allclose(heights, np.outer(np.cos(np.pi * np.arange(8) / 4), lifted), atol=1e-15)


@pytest.mark.parametrize("meshed", [True, False])
def test_a_body_of_another_program_moves_on_its_own_mesh(tmp_path, modes, hit, meshed):
    """A plate turned by 30 degrees about x: modes and motion are along its normal, at its nodes."""
    points, cells = modes.shapes.grid()
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.75**0.5, -0.5], [0.0, 0.5, 0.75**0.5]])
    normal, shapes = turn[:, 2], modes.shape_at(points)[:, None] * turn[None, :, 2, None]
    nodes = np.column_stack([points, np.zeros(len(points))]) @ turn.T
    numbers = np.arange(len(points)) + 101
    body = fi.Body(modes.frequencies, shapes, nodes, modes.mass, numbers=numbers, cells=cells if meshed else None)
    export.write_vtk(tmp_path / "motion.pvd", body, hit, [0.0, 1e-4, 2e-3])
    for time, grid in frames(tmp_path / "motion.pvd"):
        assert_allclose(grid.points, nodes, atol=1e-7)
        assert grid.n_cells == (len(cells) if meshed else len(nodes))
        for name, said in (("displacement", hit.displacement), ("velocity", hit.velocity)):
            wanted = said(points, [time], residual=False)[0][:, None] * normal
            assert_allclose(grid.point_data[name], wanted, rtol=0, atol=1e-9 * max(np.abs(wanted).max(), 1e-9))
        assert_allclose(grid.field_data["force"], hit.history.force_at(np.array([time]), 0)[0])
    export.write_vtk(tmp_path / "modes.vtu", body)
    assert_allclose(pyvista.read(tmp_path / "modes.vtu").point_data["mode_003"], shapes[..., 2])


TIMES = np.linspace(0.0, 4e-3, 81)  # s
POINTS = [(0.1, 0.1), (0.3, 0.2)]  # m


@pytest.fixture
def force(hit, monkeypatch):
    if not hasattr(np, "in1d"):  # numpy 2.4 lacks it, and pyNastran asks for it
        monkeypatch.setattr(np, "in1d", np.isin, raising=False)
    return hit.history.force_at(TIMES, 0)[0]


def test_matrices_of_nastran_hold_all_digits(tmp_path, hit, force):
    from pyNastran.op4 import op4

    fi.export.write_history(tmp_path / "blow.op4", hit, TIMES, at=POINTS)
    read = {name: found[1] for name, found in op4.read_op4(str(tmp_path / "blow.op4"), debug=False).items()}
    assert list(read) == ["TIME", "FORCE", "MOVE", "VELO"]
    assert_allclose(read["TIME"][:, 0], TIMES, rtol=1e-15)
    assert_allclose(read["FORCE"][:, 0], force, rtol=1e-15)
    assert_allclose(read["MOVE"], hit.displacement(POINTS, TIMES), rtol=1e-15)
    assert_allclose(read["VELO"], hit.velocity(POINTS, TIMES), rtol=1e-15)
    fi.export.write_history(tmp_path / "own.op4", hit)
    own = op4.read_op4(str(tmp_path / "own.op4"), debug=False)
    assert_allclose(own["FORCE"][1][:, 0].max(), hit.peak_force, rtol=1e-3)


def test_universal_files_hold_force_and_motion(tmp_path, hit, force):
    """Six digits of single numbers in text; names, nodes, directions and units are there."""
    with pytest.raises(ValueError, match="times must be even for a universal file"):
        fi.export.write_history(tmp_path / "blow.uff", hit, [0.0, 1e-3, 1.5e-3])
    fi.export.write_history(tmp_path / "blow.uff", hit, TIMES, at=POINTS, node=17, direction="-z", numbers=[5, 9])
    sets = pyuff.UFF(str(tmp_path / "blow.uff")).read_sets()
    told = [(each["id1"], each["rsp_node"], each["rsp_dir"], each["ref_node"], each["ordinate_axis_units_lab"].strip())
            for each in sets]  # fmt: skip
    assert told == [("force", 17, -3, 17, "N"), ("displacement", 5, -3, 17, "m"), ("displacement", 9, -3, 17, "m"),
                    ("velocity", 5, -3, 17, "m/s"), ("velocity", 9, -3, 17, "m/s")]  # fmt: skip
    wanted = [force, *hit.displacement(POINTS, TIMES).T, *hit.velocity(POINTS, TIMES).T]
    for each, values in zip(sets, wanted):
        assert_allclose(each["x"], TIMES, rtol=1e-5, atol=1e-9)
        assert_allclose(each["data"], values, rtol=1e-5, atol=1e-5 * np.abs(values).max())


def test_nastran_loads_a_node_with_the_force(tmp_path, hit, force):
    """Nine digits after the point."""
    from pyNastran.bdf import bdf

    fi.export.write_history(tmp_path / "blow.bdf", hit, TIMES, node=17, direction="-y")
    deck = bdf.read_bdf(str(tmp_path / "blow.bdf"), xref=False, validate=False, punch=True, debug=False)
    (load,), (way,) = deck.dloads[1], deck.loads[1000]
    assert load.load_ids == [10] and deck.dload_entries[10][0].tid == 100
    assert way.node == 17 and way.mag * way.xyz[1] == -1.0
    table = deck.tables_d[100]
    assert_allclose(table.x[:-2], TIMES, rtol=1e-9)
    assert_allclose(table.y[:-2], force, rtol=1e-9)
    assert (np.diff(table.x[-3:]) > 0.0).all() and not table.y[-2:].any()  # goes on straight through its last points
    export.write_history(tmp_path / "own.bdf", hit)
    table = bdf.read_bdf(str(tmp_path / "own.bdf"), xref=False, validate=False, punch=True, debug=False).tables_d[100]
    assert (np.diff(table.x) > 0.0).all() and not table.y[-2:].any() and table.y.max() > 0.99 * hit.peak_force


def test_abaqus_loads_a_node_with_the_force(tmp_path, hit, force):
    fi.export.write_history(tmp_path / "blow.inp", hit, TIMES, node=17, direction="-z")
    text = (tmp_path / "blow.inp").read_text()
    head, rest = text.split("*AMPLITUDE, NAME=BLOW1\n")
    rows, load = rest.split("*CLOAD, AMPLITUDE=BLOW1\n")
    assert head.startswith("**") and load == "17, 3, -1.\n"
    table = np.array([line.split(",") for line in rows.splitlines()], float)
    assert_allclose(table[:-2], np.column_stack([TIMES, force]), rtol=1e-9)
    assert not table[-2:, 1].any()


@pytest.mark.parametrize(("touch", "speeds", "sign"), [((1, 2), [1.0, 0.0, 0.0], 1.0), ((2, 1), [0.0, 1.0, 0.0], -1.0)])
def test_a_node_is_loaded_by_the_contacts_of_the_struck_body_alone(tmp_path, touch, speeds, sign):
    """Of three balls the last is struck; where a touch names it first, the force pushes it back."""
    law = fi.Contact.linear(1e6)
    gap = fi.Contact.linear(1e6, gap=1e-3 if touch[0] == 1 else -1e-4)
    balls = [fi.Modes.rigid(0.1)] * 3
    hit = fi.collide(balls, [fi.Touch(law, 0, 1), fi.Touch(gap, *touch)], speeds=speeds, tolerance=1e-3)
    export.write_history(tmp_path / "blow.inp", hit)
    text = (tmp_path / "blow.inp").read_text()
    assert text.count("*AMPLITUDE") == text.count("*CLOAD") == 1
    table = np.array(
        [line.split(",") for line in text.splitlines() if "E" in line and "," in line and "*" not in line], float
    )
    moved = hit.velocity(None, [hit.time[-1]], body=2)[0, 0] - speeds[2]
    assert np.sign(moved) == sign
    assert_allclose(np.trapezoid(table[:, 1], table[:, 0]), 0.1 * moved, rtol=1e-3)
