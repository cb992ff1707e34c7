"""Pictures from arrays: what they show, and that their process needs next to nothing of the package."""

import base64
import io
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from fem_impact._base import progress
from fem_impact.show import FORMATS, canvas, pictures

HEAVY = "numba scipy skfem xarray shapely fem_impact.impact fem_impact.modes fem_impact.mesh"


def square(n=9):
    """Points (n * n, 2) of a unit square, its triangles and the sides of its edge."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, n), np.linspace(0.0, 1.0, n))
    corner = (np.arange(n - 1) + n * np.arange(n - 1)[:, None]).ravel()
    cells = np.concatenate([corner + np.array([[0], [1], [n + 1]]), corner + np.array([[0], [n + 1], [n]])], axis=1).T
    line = np.arange(n - 1)
    rim = np.concatenate([np.column_stack([line, line + 1]), n * (n - 1) + np.column_stack([line, line + 1])])
    return np.column_stack([x.ravel(), y.ravel()]), cells, rim


def test_the_process_loads_nothing_that_computes():
    code = f"import sys, fem_impact.show.canvas; print([m for m in {HEAVY.split()} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_normals_of_a_slope_point_across_it():
    plane, cells, _ = square()
    found = canvas._normals(np.column_stack([plane, 0.5 * plane[:, 0]]), cells)
    assert np.allclose(found, np.array([-0.5, 0.0, 1.0]) / 1.25**0.5, atol=1e-12)  # rounding


def test_an_animation_keeps_every_picture_and_its_size(tmp_path):
    colours = [(0, 0, 0), (255, 0, 0), (0, 128, 0), (0, 0, 255)]
    canvas.write_gif(tmp_path / "a.gif", [Image.new("RGB", (40, 30), colour) for colour in colours])
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames == 4 and film.size == (40, 30)
        for i, colour in enumerate(colours):
            film.seek(i)
            assert film.convert("RGB").getpixel((20, 15)) == colour


@pytest.mark.slow
def test_pictures_are_drawn_from_arrays_alone(tmp_path):
    if not pictures.can_render():
        pytest.skip(f"nothing renders here: {pictures.REMEDY}")
    plane, cells, rim = square()
    bump = np.sin(np.pi * plane[:, 0]) * np.sin(np.pi * plane[:, 1])
    motion, middle = np.stack([0.0 * bump, bump]), np.array([0.5, 0.5])
    film = canvas.Film(plane, cells, rim, middle, motion, np.zeros(2), ["a", "b"], 1)
    told = []
    with progress.heard(lambda *each: told.append(each)):
        canvas.draw(tmp_path, film, canvas.Gallery(plane, cells, bump[:, None], ["1"], 1))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["modes.png", "wave.gif", "wave.png"]
    assert told == [("frames", 1, 2), ("frames", 2, 2)]
    flat, bent = (np.asarray(picture, float) for picture in canvas.frames(film))
    assert np.array_equal(bent, np.asarray(Image.open(tmp_path / "wave.png"), float))  # the telling one
    assert np.abs(flat - bent).max() > 50.0  # of 255: the bump is coloured


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
