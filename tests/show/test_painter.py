"""A process of its own draws the same pictures from arrays, dies with the command, and may die alone."""

import base64
import io
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
import pyvista
from PIL import Image, ImageSequence

from fem_impact._base import progress
from fem_impact.show import FORMATS, canvas, painter, pictures
from fem_impact.show.painter import Painter


def test_it_draws_what_this_process_would_and_counts_the_frames(hit, tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "FRAMES", 3)
    told = []
    with Painter() as other, progress.observed(lambda *each: told.append(each)):
        other.begin(tmp_path, hit)
        missing = other.finish()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["modes.png", "wave.gif", "wave.png"]
    assert told[-1] == ("frames", pictures.FRAMES, pictures.FRAMES)
    assert missing == ("" if pictures.can_render() else pictures.REMEDY)
    if not missing:  # a library that readers use sets it for the whole process
        monkeypatch.setattr(pyvista.global_theme.font, "family", "courier")
    pictures.wave(tmp_path / "own.png", hit)
    own, others = (np.asarray(Image.open(tmp_path / name)) for name in ("own.png", "wave.png"))
    assert np.array_equal(own, others)


def test_it_ends_with_the_block_even_if_nothing_was_drawn():
    with pytest.raises(RuntimeError), Painter() as other:
        raise RuntimeError
    assert other.process.returncode is not None


def test_if_it_dies_this_process_draws(hit, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(painter, "draw", lambda *task: drawn.append(task) or "flat")
    with Painter() as other:
        other.process.kill()
        other.process.wait()
        other.begin(tmp_path, hit)
        assert other.finish() == "flat"
    assert drawn == [(tmp_path, hit, "png")]


HEAVY = "numba scipy skfem xarray shapely fem_impact.impact fem_impact.modes fem_impact.mesh"


def test_the_process_loads_nothing_that_computes():
    code = f"import sys, fem_impact.show.canvas; print([m for m in {HEAVY.split()} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_normals_of_a_slope_point_across_it():
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [0.0, 1.0, 0.0], [1.0, 1.0, 0.5]])
    found = canvas._normals(points, np.array([[0, 1, 3], [0, 3, 2]]))
    assert np.allclose(found, np.array([-0.5, 0.0, 1.0]) / 1.25**0.5, atol=1e-12)  # rounding


def test_an_animation_keeps_every_picture_and_its_size(tmp_path):
    colours = [(0, 0, 0), (255, 0, 0), (0, 128, 0), (0, 0, 255)]
    canvas.write_gif(tmp_path / "a.gif", [Image.new("RGB", (40, 30), colour) for colour in colours])
    with Image.open(tmp_path / "a.gif") as film:
        assert film.size == (40, 30)
        assert [frame.convert("RGB").getpixel((20, 15)) for frame in ImageSequence.Iterator(film)] == colours


@pytest.mark.parametrize("form", FORMATS)
def test_a_picture_is_written_in_every_format(tmp_path, form):
    picture = Image.fromarray(np.random.default_rng(1).integers(0, 255, (20, 30, 3), np.uint8))
    canvas.write_picture(tmp_path / f"a.{form}", picture)
    raw = (tmp_path / f"a.{form}").read_bytes()
    if form == "svg":
        root = ElementTree.fromstring(raw)
        assert (root.get("width"), root.get("height")) == ("30", "20")
        within = base64.b64decode(root[0].get("href").partition(",")[2])
        assert np.array_equal(np.asarray(Image.open(io.BytesIO(within))), np.asarray(picture))
    else:
        assert raw.startswith({"png": b"\x89PNG", "pdf": b"%PDF"}[form])
