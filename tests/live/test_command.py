"""`fem-impact play`: a MIDI file or keys in, a WAV out, the same again for the same notes."""

import os
import re
import sys

import numpy as np
import pytest
from scenes import SMALL
from scipy.io import wavfile
from test_controllers import midi

from fem_impact.scenes.scene import Scene

pytestmark = pytest.mark.xdist_group("live")  # one worker compiles


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)


@pytest.mark.slow
def test_a_midi_file_is_played_into_a_wav_twice_the_same(scene, tmp_path, prompt):
    midi(tmp_path / "a.mid")
    said = prompt("play small.toml --midi a.mid --silent --modes 40 --out one.wav")
    assert said.status == 0
    out = " ".join(said.out.split())
    assert "3 notes of" in said.err and "3 strokes, 0 stolen, 3 contacts" in out
    found = re.search(r"Blocks: (\d+) of 1.33 ms; .* is [\d.]+ ms; \d+ missed their deadline", out)
    assert prompt("play small.toml --midi a.mid --silent --modes 40 --out two.wav").status == 0
    assert (tmp_path / "one.wav").read_bytes() == (tmp_path / "two.wav").read_bytes()
    rate, samples = wavfile.read(tmp_path / "one.wav")
    assert rate == 48_000 and len(samples) == 64 * int(found[1]) and 0.1 < np.abs(samples).max() < 1.0


@pytest.mark.parametrize(
    ("words", "said"), [("--midi no.mid", "no.mid: there is no such file"), ("--duration 0", "must be positive"),
                        ("--block 0", "must be at least 1"), ("--at 0.6 0.1", "--at must lie on the body")],
)  # fmt: skip
def test_what_is_wrong_at_a_glance_is_refused_before_modes_are_found(scene, monkeypatch, prompt, words, said):
    monkeypatch.setattr(Scene, "modes", None)
    ran = prompt(f"play small.toml --silent {words}")
    assert ran.status == 2 and said in ran.err


@pytest.mark.slow
def test_piped_keys_are_played_in_time_without_a_device(scene, tmp_path, monkeypatch, prompt):
    there, here = os.pipe()
    os.write(here, b"1a")
    os.close(here)
    with os.fdopen(there) as reader:
        monkeypatch.setattr(sys, "stdin", reader)
        said = prompt("play small.toml --silent --modes 20 --at 0.1 0.1 --fastest 1")
    assert said.status == 0 and "2 strokes" in said.out
    assert (tmp_path / "out" / "small" / "play.wav").is_file()
