"""Keys, MIDI files and ports become strokes of the right point, speed and frame."""

import os
import sys
import time
from contextlib import contextmanager
from types import SimpleNamespace

import mido
import numpy as np
import pytest

import fem_impact as fi
from fem_impact.live import controllers
from fem_impact.live.controllers import Hands


def test_points_are_spread_over_any_outline():
    corner = fi.mesh.polygon([(0, 0), (1, 0), (1, 0.3), (0.3, 0.3), (0.3, 1), (0, 1)], size=0.3)
    plate = fi.Plate(fi.Material(E=7e10, nu=0.3, rho=2700.0), thickness=2e-3)
    modes = fi.find_modes(fi.assemble(corner, plate, supports={"boundary": "hinged"}), n_modes=4)
    points = controllers.spread_points(modes, (0.1, 0.2), 8)
    assert modes.shapes.contains(points).all() and points[0] == pytest.approx((0.1, 0.2))
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    assert apart[~np.eye(8, dtype=bool)].min() > 0.15 and (np.diff(apart[0]) >= 0.0).all()


@pytest.mark.parametrize(
    "key, points, fastest, stroke",
    [("z", 10, 2.0, (0, 0.25)), ("S", 10, 2.0, (1, 0.5)), ("0", 10, 2.0, (9, 2.0)), (" ", 10, 2.0, None),
     ("p", 3, 2.0, (0, 1.0))],  # fewer points than columns: round again
)  # fmt: skip
def test_a_column_of_keys_is_a_point_and_a_row_a_loudness(key, points, fastest, stroke):
    assert controllers.of_key(key, points, fastest) == stroke


def test_a_note_is_a_point_and_its_velocity_a_speed():
    assert controllers.of_note(60, 127, 10, 2.0) == (0, 2.0)
    assert controllers.of_note(59, 64, 10, 127.0) == (9, 64.0)


@pytest.fixture
def pipe(monkeypatch):
    """Where to write what the prompt then reads."""
    there, here = os.pipe()
    with os.fdopen(there) as reader:
        monkeypatch.setattr(sys, "stdin", reader)
        yield here


def waited(done):
    """Wait until it is true, at most two minutes."""
    end = time.monotonic() + 120.0
    while not done() and time.monotonic() < end:
        time.sleep(0.001)


def test_piped_keys_strike_and_the_end_of_the_pipe_ends(pipe):
    hands, found = Hands(), []
    with controllers.keys(hands, 10, 1.0):
        os.write(pipe, b"z 2")
        os.close(pipe)
        waited(lambda: found.extend(hands.due(0, 64)) or len(found) >= 2)
    assert found == [(0, 0, 0.125), (0, 1, 1.0)] and hands.over(0)


def test_escape_ends_and_what_was_struck_before_is_played(pipe):
    hands = Hands()
    os.write(pipe, b"1\x1b2")
    with controllers.keys(hands, 10, 1.0):
        waited(hands._ended.is_set)
    os.close(pipe)
    assert not hands.over(0) and hands.due(0, 64) == [(0, 0, 1.0)] and hands.over(0)


def midi(path):
    """A file of two tracks in which the tempo doubles after a beat."""
    file = mido.MidiFile(ticks_per_beat=480)
    file.tracks.append(mido.MidiTrack([
        mido.MetaMessage("set_tempo", tempo=500_000), mido.Message("note_on", note=60, velocity=127),
        mido.Message("note_off", note=60, time=480), mido.MetaMessage("set_tempo", tempo=250_000),
        mido.Message("note_on", note=61, velocity=64, time=480), mido.Message("note_on", note=61, velocity=0, time=10),
    ]))  # fmt: skip
    file.tracks.append(mido.MidiTrack([mido.Message("note_on", note=59, velocity=1, time=240)]))
    file.save(path)
    return path


def test_a_midi_file_keeps_its_tempo_in_all_tracks(tmp_path):
    notes = controllers.read_midi(midi(tmp_path / "a.mid"))
    assert [time for time, _, _ in notes] == pytest.approx([0.0, 0.25, 0.75])
    struck = [controllers.of_note(*note, 10, 1.27) for _, *note in notes]
    assert [point for point, _ in struck] == [0, 9, 1]
    assert [speed for _, speed in struck] == pytest.approx([1.27, 0.01, 0.64])


def test_what_is_no_midi_file_is_one_clear_error(tmp_path):
    whole = midi(tmp_path / "a.mid").read_bytes()
    rng = np.random.default_rng(1)
    cases = [b"", b"RIFF", whole[:30], whole[:14]]
    for _ in range(60):
        broken = bytearray(whole)
        broken[rng.integers(len(whole))] = rng.integers(256)
        cases.append(bytes(broken))
    for case in cases:
        (tmp_path / "b.mid").write_bytes(case)
        try:
            controllers.read_midi(tmp_path / "b.mid")
        except ValueError as error:
            assert str(error).startswith(str(tmp_path / "b.mid")) and "\n" not in str(error)
    for absent, why in ((tmp_path / "none.mid", "there is no such file"), (tmp_path, "it is a folder")):
        with pytest.raises(ValueError, match=why):
            controllers.read_midi(absent)


def test_a_midi_port_is_found_by_the_start_of_its_name(monkeypatch):
    @contextmanager
    def open_input(name, callback):
        assert name == "Pads 20:0"
        callback(SimpleNamespace(type="note_on", note=62, velocity=127))
        callback(SimpleNamespace(type="note_on", note=62, velocity=0))
        callback(SimpleNamespace(type="control_change", value=3))
        yield

    fake = SimpleNamespace(get_input_names=lambda: ["Through 14:0", "Pads 20:0"], open_input=open_input)
    monkeypatch.setitem(sys.modules, "mido", fake)
    monkeypatch.setitem(sys.modules, "rtmidi", fake)
    hands = Hands()
    with controllers.port("Pads", hands, 10, 1.5) as name:
        assert name == "Pads 20:0"
    assert hands.due(0, 64) == [(0, 2, 1.5)]
    with (
        pytest.raises(ValueError, match="port must be a MIDI input of this machine, got 'Drum'; there are: Through"),
        controllers.port("Drum", hands, 10, 1.5),
    ):
        pass
