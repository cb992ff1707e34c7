"""What plays the sound: a loudspeaker, or a clock that counts how often it would have had nothing to play."""

import threading
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._base import check
from ..show import sampling
from ..show.sound import LONGEST, SHORTEST, Sound
from .controllers import Source
from .player import Player


class Feed:
    """All blocks of a performance, made beforehand: one side fills them, the other copies them, neither allocates."""

    def __init__(self, n_blocks: int, block: int) -> None:
        self.blocks: np.ndarray = np.zeros((n_blocks, block), np.float32)
        self.written: int = 0
        self.played: int = 0
        self.missed: int = 0

    def copy(self, out: np.ndarray) -> None:
        """Copy the next block to a device, or silence if it is not there: a missed deadline."""
        if self.played < self.written:
            out[:] = self.blocks[self.played]
            self.played += 1
        else:
            out[:] = 0.0
            self.missed += self.written > 0


class Speaker:
    """The loudspeaker of this machine."""

    def __init__(self) -> None:
        try:
            self._library = check.extra("sounddevice", "play", "playing aloud")
            self._library.query_devices(kind="output")
        except (OSError, ValueError, RuntimeError) as error:  # no PortAudio, or no device
            raise ValueError(f"no loudspeaker can be used here ({error}), only the file is written") from None

    def play_feed(self, feed: Feed, rate: int) -> None:
        block = feed.blocks.shape[1]
        options: dict[str, Any] = {"samplerate": rate, "blocksize": block, "channels": 1, "dtype": "float32"}
        options["callback"] = lambda out, *_: feed.copy(out[:, 0])
        self._stream = self._library.OutputStream(latency="low", **options)
        self._stream.start()

    def stop(self) -> None:
        self._stream.stop()
        self._stream.close()


class Clock:
    """A device that plays nothing, in time: it asks for every block when a loudspeaker would."""

    def play_feed(self, feed: Feed, rate: int) -> None:
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._ask, args=(feed, feed.blocks.shape[1] / rate), daemon=True)
        self._thread.start()

    def _ask(self, feed: Feed, period: float) -> None:
        out = np.zeros(feed.blocks.shape[1], np.float32)
        due = time.perf_counter()
        while not self._ended.is_set():
            due += period
            time.sleep(max(0.0, due - time.perf_counter()))
            feed.copy(out)

    def stop(self) -> None:
        self._ended.set()
        self._thread.join()


Device = Speaker | Clock  # calls `Feed.copy` once in each block's time between play_feed and stop


@dataclass(frozen=True, eq=False)
class Performance:
    """What was played."""

    sound: Sound
    seconds: np.ndarray = field(repr=False)  # (n_blocks,) [s] computing time of each block
    missed: int  # blocks that were not there in time

    @property
    def slowest(self) -> float:
        """99th percentile of the computing times [s]."""
        return float(np.percentile(self.seconds, 99.0))


def perform(player: Player, source: Source, longest: float, device: Device | None = None) -> Performance:
    """Play until the source ends and the body has rung out, or for the longest time [s].

    Without a device nothing waits: each block is computed at once after the one before, and its deadline is missed if
    that takes longer than it lasts.
    """
    period = player.block / player.rate
    most = max(1, round(check.positive("longest", longest, "s") / period))
    look = 0.2 * period  # for room: more often costs time, less often uses up what is ahead
    feed, seconds = Feed(most, player.block), np.zeros(most)
    rings = sampling.ringing_time(player.modes, player.modes.omega > 0.0, (SHORTEST, LONGEST))
    if device is not None:
        device.play_feed(feed, player.rate)
    try:
        end = most
        while feed.written < end:
            # four blocks ahead are 5 ms at 48 kHz, an inaudible delay; fewer are late on a busy machine
            while device is not None and feed.written - feed.played >= 4:
                time.sleep(look)
            first = feed.written * player.block
            strokes = source.due(first, first + player.block)
            begin = time.perf_counter()
            player.fill(strokes, feed.blocks[feed.written])
            seconds[feed.written] = time.perf_counter() - begin
            feed.written += 1
            if end == most and source.over(first):
                end = min(most, feed.written + round(rings / period))
        while device is not None and feed.played < feed.written:
            time.sleep(look)
        missed = feed.missed
    finally:
        if device is not None:
            device.stop()
    samples, seconds = feed.blocks[: feed.written].reshape(-1), seconds[: feed.written]
    if device is None:
        missed = int(np.count_nonzero(seconds > period))
    return Performance(Sound(samples.astype(float), player.rate, 1.0 / player.gain), seconds, missed)
