"""What plays: blocks are copied in order, late ones are counted, and the same notes write the same file."""

import sys
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from fem_impact.live.devices import Clock, Feed, Speaker, perform
from fem_impact.live.player import PlayedStroke, Score
from fem_impact.show import sound


class Beeps:
    """In place of a player: a stroke is a sample of its speed."""

    block, rate, gain = 64, 48_000, 0.5

    def __init__(self, late=()):
        self.modes = SimpleNamespace(omega=np.array([0.0, 100.0]), damping_ratio=np.array([0.0, 1.0]))
        self.n_done, self.late = 0, late

    def fill(self, strokes, out):
        for stroke in strokes:
            out[stroke.frame] = stroke.speed
        if self.n_done in self.late:
            time.sleep(0.02)
        self.n_done += 1


SCORE = [PlayedStroke(10, 0, 0.25), PlayedStroke(500, 0, 0.5)]


def test_blocks_are_copied_in_order_and_missed_ones_are_silent():
    feed, out = Feed(3, 4), np.ones(4, np.float32)
    feed.copy(out)
    assert not out.any() and feed.missed == 0  # nothing was begun
    feed.blocks[0] = 3.0
    feed.written = 1
    feed.copy(out)
    assert (out == 3.0).all() and feed.played == 1
    feed.copy(out)
    assert not out.any() and (feed.missed, feed.played) == (1, 1)


def test_without_a_device_the_strokes_stand_at_their_frames_and_late_blocks_are_counted():
    played = perform(Beeps(late=(3,)), Score(SCORE), 60.0)
    assert played.sound.full_scale == 2.0 and np.flatnonzero(played.sound.samples).tolist() == [10, 500]
    assert len(played.sound.samples) == 64 * (8 + round(sound.SHORTEST * 48_000 / 64))  # rings for half a second
    assert played.missed >= 1 and played.seconds[3] >= 0.02
    assert len(perform(Beeps(), Score(SCORE), 0.1).sound.samples) == 64 * 75  # the longest that was asked for


def test_a_clock_asks_in_time_and_hears_the_same():
    class Watched(Clock):
        def play_feed(self, feed, rate):
            self.feed = feed
            super().play_feed(feed, rate)

    class Late(Beeps):
        def fill(self, strokes, out):
            super().fill(strokes, out)
            asked_by = time.monotonic() + 60.0
            while self.n_done == 100 and not clock.feed.missed and time.monotonic() < asked_by:
                time.sleep(1e-3)  # until the clock has asked in vain, however late a busy machine lets it

    clock, began = Watched(), time.monotonic()
    played = perform(Late(), Score(SCORE), 60.0, clock)
    assert time.monotonic() - began > 0.9 * len(played.sound.samples) / 48_000
    assert played.missed > 0
    assert (played.sound.samples == perform(Beeps(), Score(SCORE), 60.0).sound.samples).all()


def test_a_speaker_gets_the_blocks_by_its_callback(monkeypatch):
    heard = []

    class Stream:
        def __init__(self, callback, **options):
            assert (options["samplerate"], options["blocksize"], options["dtype"]) == (48_000, 64, "float32")
            self.callback, self.over, self.asking = callback, threading.Event(), threading.Thread(target=self.ask)
            self.start, self.close = self.asking.start, self.asking.join

        def ask(self):
            while not self.over.is_set():
                out = np.ones((64, 1), np.float32)
                self.callback(out, 64, None, None)
                heard.append(out[:, 0])
                time.sleep(1e-5)

        def stop(self):
            self.over.set()

    monkeypatch.setitem(
        sys.modules, "sounddevice", SimpleNamespace(OutputStream=Stream, query_devices=lambda kind: kind)
    )
    played = perform(Beeps(), Score(SCORE), 60.0, Speaker())
    found = np.concatenate(heard)
    assert found[found != 0.0].tolist() == [0.25, 0.5]
    assert played.sound.samples.sum() == 0.75


def test_without_a_loudspeaker_the_reason_is_said(monkeypatch):
    def none(kind):
        raise ValueError("no output device")

    monkeypatch.setitem(sys.modules, "sounddevice", SimpleNamespace(query_devices=none))
    with pytest.raises(ValueError, match=r"no loudspeaker can be used here \(no output device\), only"):
        Speaker()
