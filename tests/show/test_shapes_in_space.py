"""Files and pictures of curved and ribbed plates show them as they are in space."""

import numpy as np
import pytest
import pyuff
import pyvista
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.modes import viewing
from fem_impact.pages import report
from fem_impact.show import canvas, export, figures, pictures

WOOD = fi.Material(E=10e9, nu=0.3, rho=450.0)
RISE = fi.rise.cap(1.5, centre=(0.2, 0.15))
BAR = fi.Beam.rectangular(WOOD, width=8e-3, height=12e-3)
RIBS = [fi.Rib([(0.1, 0.0), (0.2, 0.3)], BAR), fi.Rib("left", BAR)]
AT = (0.13, 0.1)


@pytest.fixture(scope="module")
def modes():
    plate = fi.Plate(WOOD, 3e-3)
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3, size=0.1), plate, {"boundary": "hinged"}, rise=RISE, ribs=RIBS)
    return fi.find_modes(system, n_modes=6, damping_ratio=0.01)


@pytest.fixture(scope="module")
def hit(modes):
    return fi.strike(modes, fi.Striker.rigid(0.01), fi.Contact.linear(1e4), at=AT, speed=1.0, tolerance=0.5)


def test_places_have_the_rise_whatever_the_modes_went_through(modes):
    points = np.array([[0.2, 0.15], AT])
    for each in (modes, modes.truncated(n_modes=2), modes.scaled(mass=0.5), fi.in_air(modes)):
        assert_allclose(viewing.places_in_space(each, points), np.column_stack([points, RISE(points)]), atol=1e-15)
    flat = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=4)
    assert viewing.heights(flat, points) is None and not viewing.places_in_space(flat, points)[:, 2].any()


def test_sides_along_ribs_are_as_long_as_the_ribs(modes):
    points, cells = viewing.grid(modes)
    ends = points[viewing.rib_sides(modes, points, cells)]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
    assert length == pytest.approx(np.hypot(0.1, 0.3) + 0.3, rel=1e-6)


def test_vtk_has_the_true_shape_and_moves_it_along_the_blow(tmp_path, modes, hit):
    export.write_vtk(tmp_path / "modes.vtu", modes)
    grid = pyvista.read(tmp_path / "modes.vtu")
    assert_allclose(grid.points[:, 2], RISE(np.asarray(grid.points[:, :2])), atol=1e-12)
    assert_allclose(modes.to_pyvista().points, grid.points, atol=1e-7)  # pyvista keeps single precision
    export.write_vtk(tmp_path / "wave.vtu", hit.target, hit, [1e-3])
    moved = pyvista.read(tmp_path / "wave.vtu")
    there = hit.displacement(np.asarray(moved.points[:, :2]), [1e-3], residual=False)[0]
    assert_allclose(moved.point_data["displacement"][:, 2], -there, atol=1e-12)  # down, as z is up
    assert np.abs(there).max() > 1e-5
    tip = hit.displacement(hit.striker.at[None], [1e-3], body=0)[0, 0]
    assert_allclose(moved.field_data["striker"][0], [*AT, RISE(np.array([AT]))[0] - tip], atol=1e-12)


def test_universal_files_have_the_rise_and_come_back_in_the_plane(tmp_path, modes):
    export.write_uff(tmp_path / "modes.uff", modes)
    nodes = pyuff.UFF(str(tmp_path / "modes.uff")).read_sets(1)  # data set 2411
    points = np.column_stack([nodes["x"], nodes["y"]])
    assert_allclose(nodes["z"], RISE(points), atol=1e-9)
    assert np.ptp(nodes["z"]) > 1e-3
    back = fi.Modes.from_uff(tmp_path / "modes.uff", mass=modes.mass)
    assert back.dimension == 2
    assert_allclose(back.frequencies, modes.frequencies, rtol=1e-5)  # six digits


def test_pictures_know_rise_and_ribs(modes, hit):
    shown, film = pictures.gallery(modes, 2), pictures.film(hit, np.array([1e-3]))
    for each in (shown, film):
        assert_allclose(each.rise, RISE(each.plane), atol=1e-15)
        assert len(each.ribs) == len(viewing.rib_sides(modes, *viewing.grid(modes)))
    for figure in (figures.mode_shapes(modes, count=2), figures.chladni(modes, 2, 2)):
        drawn = [each for axes in figure.axes for each in axes.collections if hasattr(each, "get_segments")]
        lines = [line for each in drawn for line in each.get_segments() if np.shape(line) == (2, 2)]
        assert len(lines) >= 2 * len(shown.ribs)


@pytest.mark.slow
def test_a_picture_in_space_is_another_with_its_rise_and_ribs(modes):
    if not pictures.can_render():
        pytest.skip(f"nothing renders here: {pictures.REMEDY}")
    shown = pictures.gallery(modes, 1)
    kinds = shown._replace(rise=0.0, ribs=()), shown._replace(ribs=()), shown
    flat, risen, ribbed = (np.asarray(canvas.gallery(each), float) for each in kinds)
    assert np.abs(flat - risen).max() > 50.0  # of 255
    red, green, blue = np.moveaxis([risen, ribbed], -1, 0)
    found = ((green > 1.2 * red) & (green > 1.05 * blue)).sum(axis=(1, 2))
    assert found[0] == 0 and found[1] > 50  # green pixels, which only ribs have


def test_a_report_draws_rise_and_ribs(hit, modes):
    view = report._view(hit, 5e-3)
    assert view["under"] == pytest.approx(float(RISE(np.array([AT]))[0]), rel=1e-12)
    at = np.column_stack([view["x"], view["y"]])
    assert_allclose(view["rise"], RISE(at), atol=1e-6)  # six digits
    x, y, z = (np.array([value for value in axis if value is not None]) for axis in view["ribs"])
    assert_allclose(z, RISE(np.column_stack([x, y])), atol=1e-12)
    assert len(x) == 2 * len(viewing.rib_sides(modes, *viewing.grid(modes)))
