"""The film of a blow: its captions say what the blow did, and its pictures show it."""

import subprocess
from functools import partial

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image
from scenes import SMALL

import fem_impact as fi
from fem_impact.show import canvas, pictures, slow_motion


@pytest.fixture(scope="module")
def twice():
    """A blow of two impacts."""
    plate = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=20, damping_ratio=0.01)
    hit = fi.strike(plate, fi.Striker.rigid(0.03), fi.Contact.linear(1e6), at=(0.13, 0.1), speed=1.0, tolerance=0.01)
    assert hit.n_impacts > 1
    return hit


def test_captions_say_what_happens_when_it_happens(twice):
    said = slow_motion.captions(twice)
    assert [each.time for each in said] == sorted(each.time for each in said)
    assert len(said) == 3 * twice.n_impacts  # meeting, peak and parting of each
    first, second = twice.impacts[:2]
    assert said[1].text.startswith(f"The force is largest: {first.peak_force:.3g} N, ")
    assert (said[2].time, said[3].time) == (first.end, second.start)
    assert said[3].text == "Body and striker meet again: impact 2."
    assert f"keeps {twice.restitution:.3g} of its speed" in said[-1].text


def test_subtitles_follow_each_other_without_gaps_and_end_with_the_film(twice):
    times = np.linspace(0.0, 1.3 * twice.impacts[-1].end, 240)
    text = slow_motion.subtitles(slow_motion.captions(twice), times)
    assert text.startswith("WEBVTT\n\n00:00.000 --> ")
    spans = [line.split(" --> ") for line in text.splitlines() if "-->" in line]
    assert [end for _, end in spans[:-1]] == [start for start, _ in spans[1:]]
    assert spans[-1][1] == "00:20.000"  # 240 frames, 12 a second
    start = next(each.time for each in slow_motion.captions(twice) if each.text.startswith("They part"))
    shown = next(i for i, time in enumerate(times) if time >= start) / canvas.RATE
    assert f"{slow_motion._clock(shown)} --> " in text


@pytest.mark.slow
def test_the_film_shows_the_force_grow_and_the_body_move(twice, tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "can_render", lambda: False)  # flat pictures take no display
    fi.slow_motion.write(tmp_path / "blow.mp4", twice, frames=4)
    unpack = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-i", tmp_path / "blow.mp4", tmp_path / "%d.png"]
    subprocess.run(unpack, check=True)
    shown = [np.asarray(Image.open(tmp_path / f"{i}.png")).astype(int) for i in range(1, 5)]
    tall, wide, _ = shown[0].shape
    assert not (tmp_path / "5.png").exists() and (wide % 2, tall % 2) == (0, 0) and wide > tall
    side = slow_motion.SIDE[0]
    for part in (np.s_[: slow_motion.SIDE[1], : wide - side], np.s_[: slow_motion.SIDE[1], wide - side :]):
        assert np.abs(shown[0][part] - shown[1][part]).max() > 60  # the body; the dot on the curve
    strip = shown[1][slow_motion.SIDE[1] :]
    assert (strip < 128).any() and (strip > 250).mean() > 0.8  # a caption on white
    assert (tmp_path / "blow.vtt").read_text().startswith("WEBVTT")


@pytest.mark.slow
def test_the_command_writes_film_and_captions(tmp_path, prompt, monkeypatch):
    monkeypatch.setattr(pictures, "can_render", lambda: False)
    monkeypatch.setattr(slow_motion, "write", partial(slow_motion.write, frames=3))
    (tmp_path / "small.toml").write_text(SMALL)
    said = prompt("strike small.toml --film --out out --json")
    assert said.status == 0 and {"slow_motion.mp4", "slow_motion.vtt"} <= set(said.json["files"])
    assert (tmp_path / "out" / "slow_motion.mp4").stat().st_size > 1000
