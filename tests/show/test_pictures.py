"""Pictures in space where something can render, in the plane where nothing can; both tell the same."""

import sys

import imageio_ffmpeg
import numpy as np
import pytest
from numpy.testing import assert_allclose
from PIL import Image, ImageSequence
from scenes import TITLED

import fem_impact as fi
from fem_impact._base import child
from fem_impact.modes import viewing
from fem_impact.show import canvas, pictures, sampling


@pytest.fixture(params=["in space", "in the plane"])
def renders(request, monkeypatch):
    """Whether pictures are rendered; the plane must do wherever nothing can render."""
    if request.param == "in the plane":
        monkeypatch.setattr(pictures, "can_render", lambda: False)
    elif not pictures.can_render():
        pytest.skip(f"nothing renders here: {pictures.REMEDY}")
    return request.param == "in space"


def coloured(image):
    """Share of pixels that are orange (pushed down) and that are purple (up)."""
    red, _, blue = (np.asarray(image.convert("RGB"), float)[..., i] for i in range(3))
    return float((red > blue + 40.0).mean()), float((blue > red + 20.0).mean())


def test_mode_shapes_show_as_many_hills_as_valleys(hit, tmp_path, renders):
    said = pictures.mode_shapes(tmp_path / "modes.png", hit.target, count=4, columns=2)
    assert said == ("" if renders else pictures.REMEDY)
    image = Image.open(tmp_path / "modes.png")
    width, height = image.size  # mode (2, 1), the second: one half goes up, the other down
    assert min(coloured(image.crop((width // 2, 0, width, height // 2)))) > 0.04


def test_wave_begins_below_the_striker_and_spreads(hit, tmp_path, renders):
    assert pictures.animation(tmp_path / "wave.gif", hit, frames=4) == ("" if renders else pictures.REMEDY)
    with Image.open(tmp_path / "wave.gif") as movie:
        shares = [coloured(frame)[0] for frame in ImageSequence.Iterator(movie)]
    assert len(shares) == 4
    assert shares[0] < 0.02 < shares[1] < max(shares[2:])  # at the first touch the plate is flat but for the mark


def test_film_holds_every_frame(hit, tmp_path):
    pictures.animation(tmp_path / "wave.mp4", hit, frames=6)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "wave.mp4"))
    assert frames == 6 and abs(seconds - 6 / canvas.RATE) < 0.05
    assert [path.name for path in tmp_path.iterdir()] == ["wave.mp4"]


def test_a_film_without_its_extra_and_other_endings_are_refused(hit, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    for name in ("wave.jpg", "wave"):
        with pytest.raises(ValueError, match="path ending must be"):
            pictures.wave(tmp_path / name, hit)
    with pytest.raises(ValueError, match=r"an MP4 file needs imageio_ffmpeg: pip install 'fem-impact\[film\]'"):
        pictures.animation(tmp_path / "wave.mp4", hit)


def test_picture_of_one_instant_and_its_time(hit, tmp_path, renders):
    pictures.wave(tmp_path / "a.png", hit)
    pictures.wave(tmp_path / "b.png", hit, time=0.0)
    assert coloured(Image.open(tmp_path / "a.png"))[0] > coloured(Image.open(tmp_path / "b.png"))[0]


def test_gap_is_closed_while_the_striker_presses(hit):
    first, last = hit.impacts[0], hit.impacts[-1]
    gap = sampling.gap(hit, np.array([0.0, 0.5 * (first.start + first.end), last.end * 3.0]))
    assert gap[0] == gap[1] == 0.0 < gap[2]


def areas(points, cells):
    return 0.5 * np.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]])


def test_beam_is_drawn_as_a_ribbon():
    modes = fi.analytic.beam(1.0, ends=("free", "free"), mass=1.0, first_frequency=100.0, n_modes=4)
    points, cells, plane = sampling.surface(modes)
    # length 1 m times the width, of triangles that all turn the same way
    assert areas(plane, cells).sum() == pytest.approx(sampling.RIBBON, rel=1e-9)
    assert points.shape == (len(plane), 1)


@pytest.mark.slow
def test_strike_writes_them_when_asked(tmp_path, monkeypatch, prompt):
    monkeypatch.setattr(child.sys, "executable", "/bin/false")  # the other process fails
    monkeypatch.setattr(pictures, "can_render", lambda: False)
    monkeypatch.setitem(pictures.animation.__wrapped__.__kwdefaults__, "frames", 3)
    (tmp_path / "small.toml").write_text(TITLED)
    said = prompt("strike small.toml --out out --pictures --vtk")
    assert said.status == 0 and pictures.REMEDY in " ".join(said.err.split())
    for name in ("modes.png", "wave.png", "wave.gif", "motion.pvd"):
        assert (tmp_path / "out" / name).stat().st_size > 0
    assert ", pictures " in " ".join(said.out.partition("Time:")[2].split())


def lines(axes):
    """Points (n, 2) of the nodal lines of one figure."""
    return np.vstack([path.vertices for path in axes.collections[0].get_paths()])


def test_chladni_figures_of_a_hinged_plate_are_straight_and_of_a_free_disk_diameters(tmp_path):
    plate = fi.analytic.rectangle(0.5, 0.3, mass=0.2, first_frequency=100.0, n_modes=3)
    drawn = pictures.chladni(plate, columns=3)
    assert [axes.get_title(loc="left").split()[0] for axes in drawn.axes] == ["1", "2", "3"]
    assert not drawn.axes[0].collections[0].get_paths()[0].vertices.size  # the edge, where it is held, is no nodal line
    assert np.ptp(lines(drawn.axes[1])[:, 1]) > 0.28  # from side to side
    np.testing.assert_allclose(lines(drawn.axes[1])[:, 0], 0.25, atol=2e-3)  # of mode (2, 1); a third of a triangle
    free = fi.analytic.disk(0.2, edge="free", mass=0.2, first_frequency=100.0, n_modes=6)
    diameters = lines(pictures.chladni(free, count=1).axes[0])
    angle = np.degrees(np.arctan2(diameters[:, 1], diameters[:, 0]))[np.linalg.norm(diameters, axis=1) > 0.05]
    assert np.abs((angle - angle[0] + 45.0) % 90.0 - 45.0).max() < 0.5  # two, at right angles
    fi.figures.save(tmp_path / "chladni.svg", drawn)
    assert "<image" not in (tmp_path / "chladni.svg").read_text()
    for wrong in (fi.Modes.rigid(1.0), fi.analytic.beam(0.4, mass=0.2, first_frequency=100.0, n_modes=3)):
        with pytest.raises(ValueError, match="dimension of modes must lie between 2 and 2"):
            pictures.chladni(wrong)


def test_refined_triangles_cover_the_body_once_fit_together_and_keep_their_orientation():
    plate = fi.Plate(fi.Material(E=1.0, nu=0.3, rho=1.0), 1.0)
    system = fi.assemble(fi.mesh.rectangle(1.5, 1.0, size=0.5), plate, supports={"boundary": "hinged"})
    coarse = fi.find_modes(system, n_modes=1)
    points, cells = sampling.grid(coarse)
    assert len(points) >= viewing.ENOUGH
    assert_allclose(np.abs(areas(points, cells)).sum(), 1.5, rtol=1e-12)
    assert len(np.unique(points.round(12), axis=0)) == len(points)  # no point twice: neighbours share their sides
    assert_allclose([points.min(axis=0), points.max(axis=0)], [[0, 0], [1.5, 1.0]], atol=1e-12)
    before, after = (np.sign(areas(*grid)) for grid in (coarse.shapes.grid(), sampling.grid(coarse)))
    assert set(after) == set(before)


def test_beams_and_rigid_masses_are_left_as_they_are():
    beam = fi.analytic.beam(0.4, mass=0.1, first_frequency=1e3, n_modes=3)
    for modes in (beam, fi.Modes.rigid(1.0)):
        for drawn, own in zip(viewing.grid(modes), modes.shapes.grid()):
            np.testing.assert_array_equal(drawn, own)


def test_the_clearest_instant_is_when_the_plate_has_begun_to_yield(hit):
    times = np.linspace(0.0, sampling.end_of(hit), 50)
    depth = np.abs(hit.displacement([hit.at], times)[:, 0])
    first = sampling.clearest(hit, times)
    assert depth[first] >= 0.5 * depth.max() > depth[:first].max()
