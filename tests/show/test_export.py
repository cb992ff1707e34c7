"""Files must say the same as the objects they were written from, to readers other than ours."""

import json
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
import pyvista
from numpy.testing import assert_allclose
from scipy.io import wavfile

import fem_impact as fi
from fem_impact.show import export, sampling, sound


@pytest.mark.slow
def test_motion_of_a_plate_with_a_hole_opens_though_chords_leave_it(tmp_path):
    plate = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), 2e-3)
    ring = fi.find_modes(fi.assemble(fi.mesh.disk(0.2, 0.05, size=0.06), plate, {"outer": "clamped"}), n_modes=6)
    hit = fi.strike(ring, fi.Striker.rigid(0.02), fi.Contact.hertz(1e6), at=(0.12, 0.0), speed=1.0, tolerance=1e-1)
    points, _ = sampling.grid(ring)
    assert not ring.shapes.contains(points).all()  # the case this is about
    export.write_vtk(tmp_path / "motion.pvd", ring, hit, [0.0, 1e-4])
    reader = pyvista.get_reader(tmp_path / "motion.pvd")
    reader.set_active_time_point(1)
    grid = reader.read()[0]
    inside = ring.shapes.contains(points)
    for name, said in (("displacement", hit.displacement), ("velocity", hit.velocity)):
        there = said(points[inside], [1e-4], residual=False)[0]
        assert_allclose(grid.point_data[name][inside, 2], there, rtol=0, atol=1e-12 * np.abs(there).max())


def test_collection_opens_in_pyvista_with_frequencies_as_times(tmp_path, modes):
    export.write_vtk(tmp_path / "modes.pvd", modes.truncated(n_modes=5))
    reader = pyvista.get_reader(tmp_path / "modes.pvd")
    assert_allclose(reader.time_values, modes.frequencies[:5], rtol=1e-8)  # spread by 1e-9 where equal
    for i in range(5):
        reader.set_active_time_point(i)
        grid = reader.read()[0]
        assert_allclose(grid.field_data["frequency"], modes.frequencies[i], rtol=0, atol=0)
        assert grid.field_data["mode"] == i + 1
        inside = grid.points[:, :2].astype(float)
        assert_allclose(grid.point_data["shape"], modes.shape_at(inside)[:, i], rtol=0, atol=1e-12)
        # the warp lifts by a tenth of the plate's length at most
        assert_allclose(np.abs(grid.point_data["warp"]).max(), 0.1 * 0.465, rtol=1e-12)


def test_equal_frequencies_stay_apart_as_times(tmp_path):
    disk = fi.analytic.disk(0.1, edge="clamped", nu=0.3, mass=0.1, first_frequency=200.0, n_modes=5)
    assert disk.frequencies[1] == disk.frequencies[2]
    export.write_vtk(tmp_path / "disk.pvd", disk)
    times = pyvista.get_reader(tmp_path / "disk.pvd").time_values
    assert len(set(times)) == 5
    assert_allclose(times, disk.frequencies, rtol=1e-8)


def test_single_file_opens_in_meshio_and_pyvista(tmp_path, modes):
    export.write_vtk(tmp_path / "modes.vtu", modes)
    grid, points = pyvista.read(tmp_path / "modes.vtu"), sampling.grid(modes)[0]
    assert_allclose(grid.field_data["frequency"], modes.frequencies, rtol=0, atol=0)
    other = meshio.read(tmp_path / "modes.vtu")
    for data in (grid.point_data, other.point_data):
        assert_allclose(data["mode_007"], modes.shape_at(points)[:, 6], rtol=0, atol=0)
    assert_allclose(other.points[:, :2], points, rtol=0, atol=0)


def test_beam_is_drawn_by_lines(tmp_path):
    beam = fi.analytic.beam(0.4, mass=0.1, first_frequency=1e3, n_modes=3)
    export.write_vtk(tmp_path / "beam.vtu", beam)
    grid = pyvista.read(tmp_path / "beam.vtu")
    assert set(grid.celltypes) == {pyvista.CellType.LINE} and grid.bounds[1] == pytest.approx(0.4)


def test_motion_has_displacement_and_velocity_at_each_time(tmp_path, modes, hit):
    times = np.array([1e-4, 1e-3, 5e-3])
    export.write_vtk(tmp_path / "wave.pvd", modes, hit, times)
    reader = pyvista.get_reader(tmp_path / "wave.pvd")
    assert_allclose(reader.time_values, times, rtol=0, atol=0)
    points = sampling.grid(modes)[0]
    for i, instant in enumerate(times):
        reader.set_active_time_point(i)
        grid = reader.read()[0]
        for name, history in (("displacement", hit.displacement), ("velocity", hit.velocity)):
            there = history(points, [instant], residual=False)[0]
            assert_allclose(grid.point_data[name][:, 2], there, rtol=0, atol=1e-15)
        place, force = grid.field_data["striker"][0], grid.field_data["force"][0]
        assert_allclose(place[:2], hit.at, rtol=0, atol=0)
        assert force == hit.history.force_at(np.array([instant]), 0)[0][0]
        indentation = place[2] - hit.displacement([hit.at], [instant])[0, 0]
        assert (force > 0.0) == (indentation > 0.0)  # it presses where it is pressed in


@pytest.mark.parametrize(
    ("name", "times", "text"),
    [
        ("a.stl", None, "path ending must be one of .vtu, .pvd, got '.stl'"),
        ("a.pvd", None, "times must be given with response"),
        ("a.vtu", [0.0, 1.0], "times must be one time for a .vtu, got 2"),
    ],
)
def test_motion_that_cannot_be_written_says_why(tmp_path, modes, hit, name, times, text):
    with pytest.raises(ValueError, match=text):
        export.write_vtk(tmp_path / name, modes, hit, times)
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


def test_sound_file_holds_the_samples_as_float(tmp_path, hit):
    heard = export.write_wav(tmp_path / "a.wav", hit, at=(0.3, 0.2), duration=0.1)
    rate, samples = wavfile.read(tmp_path / "a.wav")
    assert rate == sound.RATE and samples.dtype == np.float32
    np.testing.assert_array_equal(samples, heard.samples.astype(np.float32))


def test_sound_at_a_listener_is_the_radiated_pressure(tmp_path, hit):
    heard = export.write_wav(tmp_path / "a.wav", hit, listener=(0.2, 0.15, 1.0), duration=0.1)
    plain = sound.radiate(hit, (0.2, 0.15, 1.0), duration=0.1)
    before = slice(0, 3 * len(plain.samples) // 4)  # the last quarter fades out
    pressure = plain.samples * plain.full_scale
    assert_allclose(heard.samples[before] * heard.full_scale, pressure[before], rtol=1e-12)
    assert heard.unit == "Pa"


def test_a_sound_file_can_be_heard_ends_softly_and_keeps_its_true_level(tmp_path):
    plate = fi.analytic.rectangle(0.3, 0.2, mass=0.2, first_frequency=100.0, n_modes=20)  # rings for ever
    for speed in (1.0, 1e-3, 30.0):
        hit = fi.strike(
            plate, fi.Striker.rigid(0.01), fi.Contact.hertz(1e6), at=(0.1, 0.07), speed=speed, tolerance=0.1
        )
        heard, plain = export.write_wav(tmp_path / "a.wav", hit, duration=1.0), sound.synthesise(hit, duration=1.0)
        samples = wavfile.read(tmp_path / "a.wav")[1]
        assert -20.0 <= heard.peak_level <= 0.0
        assert heard.level == pytest.approx(plain.level, abs=1e-9)  # the loudest sample comes first
        assert np.abs(plain.samples[-480:]).max() > 0.05 * np.abs(plain.samples).max()  # it would click
        assert np.abs(samples[-48:]).max() < 1e-3 * np.abs(samples).max()
        assert heard.stated.replace("−", "-").replace("µ", "u").encode() in (tmp_path / "a.wav").read_bytes()
        raw = (tmp_path / "a.wav").read_bytes()
        assert len(raw) == 8 + int.from_bytes(raw[4:8], "little")
    loudest = export.write_wav(tmp_path / "b.wav", hit, duration=1.0, normalise=True)
    assert np.abs(loudest.samples).max() == pytest.approx(1.0)


def test_numbers_are_those_of_the_response_and_valid_json(tmp_path, hit):
    export.write_json(tmp_path / "a.json", export.numbers(hit))
    data = json.loads((tmp_path / "a.json").read_text(), parse_constant=pytest.fail)
    assert data["response"]["restitution"] == hit.restitution
    assert data["response"]["error"]["total"] == hit.error.total
    assert len(data["impacts"]) == data["response"]["n_impacts"] == hit.n_impacts
    assert data["impacts"][0]["impulse"] == hit.impacts[0].impulse


def test_plain_data_has_no_number_json_cannot_hold():
    mixed = {"a": np.nan, "b": [np.inf, np.float32(0.5)], 3: np.arange(2), "c": (True, None, "x")}
    assert export.plain(mixed) == {"a": None, "b": [None, 0.5], "3": [0, 1], "c": [True, None, "x"]}


@pytest.mark.parametrize(
    ("name", "duration", "text"),
    [("a.wav", 0.0, "duration must be positive"), ("a.mp3", 1.0, "path ending must be one of .wav, got '.mp3'")],
)
def test_a_sound_that_cannot_be_written_says_why_and_leaves_nothing(tmp_path, hit, name, duration, text):
    with pytest.raises(ValueError, match=text):
        export.write_wav(tmp_path / name, hit, duration=duration)
    assert not list(tmp_path.iterdir())


def test_versions_name_the_package_itself():
    assert export.versions()["fem-impact"] and export.versions()["python"].startswith("3.")


def test_mode_of_a_rigid_mass_is_one_point_and_no_animation(tmp_path):
    export.write_vtk(tmp_path / "rigid.vtu", fi.Modes.rigid(1.0))
    assert pyvista.read(tmp_path / "rigid.vtu").n_points == 1
    with pytest.raises(ValueError, match="mode 1 is a rigid motion"):
        export.write_animation(tmp_path / "a.pvd", fi.Modes.rigid(1.0), 1)


def test_animation_swings_a_mode_through_one_period(tmp_path, modes):
    export.write_animation(tmp_path / "swing.pvd", modes, 3, frames=8)
    reader = pyvista.get_reader(tmp_path / "swing.pvd")
    period = 1.0 / modes.frequencies[2]
    assert_allclose(reader.time_values, period * np.arange(8) / 8, rtol=1e-15)  # written with every digit
    heights = []
    for i in range(8):
        reader.set_active_time_point(i)
        heights.append(reader.read()[0].point_data["warp"][:, 2])
    shape = modes.shape_at(sampling.grid(modes)[0])[:, 2]
    lifted = 0.1 * 0.465 * shape / np.abs(shape).max()  # a tenth of the plate's length
    assert_allclose(heights, np.outer(np.cos(np.pi * np.arange(8) / 4), lifted), atol=1e-15)


@pytest.mark.parametrize(
    "name, mode, text",
    [("a.vtu", 1, "must end in .pvd"), ("a.pvd", 31, "mode must be at most 30, got 31"), ("a.pvd", 0, "at least 1")],
)
def test_animation_that_cannot_be_written_says_why(tmp_path, modes, name, mode, text):
    with pytest.raises(ValueError, match=text):
        export.write_animation(tmp_path / name, modes, mode)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("meshed", [True, False])
def test_a_body_of_another_program_moves_on_its_own_mesh(tmp_path, modes, hit, meshed):
    """A plate turned by 30 degrees about x: modes and motion are along its normal, at its nodes."""
    points, cells = modes.shapes.grid()
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.75**0.5, -0.5], [0.0, 0.5, 0.75**0.5]])
    normal, shapes = turn[:, 2], modes.shape_at(points)[:, None] * turn[None, :, 2, None]
    nodes = np.column_stack([points, np.zeros(len(points))]) @ turn.T
    numbers = np.arange(len(points)) + 101
    body = fi.Body(modes.frequencies, shapes, nodes, modes.mass, numbers=numbers, cells=cells if meshed else None)
    path = tmp_path / "motion.pvd"
    export.write_vtk(path, body, hit, [0.0, 1e-4, 2e-3])
    reader = pyvista.get_reader(path)
    for i, time in enumerate(reader.time_values):
        reader.set_active_time_point(i)
        grid = reader.read()[0]
        assert_allclose(grid.points, nodes, atol=1e-7)
        assert grid.n_cells == (len(cells) if meshed else len(nodes))
        for name, said in (("displacement", hit.displacement), ("velocity", hit.velocity)):
            wanted = said(points, [time], residual=False)[0][:, None] * normal
            assert_allclose(grid.point_data[name], wanted, rtol=0, atol=1e-9 * max(np.abs(wanted).max(), 1e-9))
        assert_allclose(grid.field_data["force"], hit.history.force_at(np.array([time]), 0)[0])
    export.write_vtk(tmp_path / "modes.vtu", body)
    assert_allclose(pyvista.read(tmp_path / "modes.vtu").point_data["mode_003"], shapes[..., 2])
