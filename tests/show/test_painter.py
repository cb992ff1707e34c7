"""A process of its own draws the same pictures, dies with the command, and may die alone."""

import numpy as np
import pytest
from PIL import Image

import fem_impact as fi
from fem_impact._base import progress
from fem_impact.show import painter, pictures
from fem_impact.show.painter import Painter


@pytest.fixture(scope="module")
def hit():
    plate = fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=20)
    return fi.strike(plate, fi.Striker.rigid(0.03), fi.Contact.linear(1e4), at=(0.14, 0.09), speed=1.0, tolerance=0.1)


def test_it_draws_what_this_process_would_and_counts_the_frames(hit, tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "FRAMES", 6)
    told = []
    with Painter() as other, progress.heard(lambda *each: told.append(each)):
        other.begin(tmp_path, hit)
        missing = other.finish()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["modes.png", "wave.gif", "wave.png"]
    assert told[-1] == ("frames", pictures.FRAMES, pictures.FRAMES)
    assert missing == ("" if pictures.can_render() else pictures.REMEDY)
    pictures.wave(tmp_path / "own.png", hit)
    own, others = (np.asarray(Image.open(tmp_path / name), float) for name in ("own.png", "wave.png"))
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
