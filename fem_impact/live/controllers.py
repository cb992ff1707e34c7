"""Where strokes come from: a MIDI file, a live MIDI port or the keys of a terminal."""

import os
import select
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check
from ..modes.modal import Modes
from ..modes.viewing import grid
from .player import AT_ONCE, PlayedStroke, Score

KEYS = ("zxcvbnm,./", "asdfghjkl;", "qwertyuiop", "1234567890")  # a column strikes one point, a row up twice as fast
ENDS = ("\x1b", "\x04", "\x03")  # Escape, Ctrl-D and Ctrl-C end the playing


class Hands:
    """Strokes that come at any moment, each struck at the start of the next block."""

    live = True  # not from a file

    def __init__(self) -> None:
        self._waiting: deque[PlayedStroke] = deque()
        self._ended = threading.Event()

    def add_stroke(self, point: int, speed: float) -> None:
        self._waiting.append(PlayedStroke(0, point, speed))

    def stop(self) -> None:
        """Let the playing end."""
        self._ended.set()

    def due(self, begin: int, end: int) -> list[PlayedStroke]:
        """What came since the last block."""
        return [self._waiting.popleft() for _ in range(min(len(self._waiting), AT_ONCE))]

    def over(self, frame: int) -> bool:
        """Whether the playing was ended."""
        return self._ended.is_set() and not self._waiting


Source = Hands | Score  # what strokes a body


def spread_points(modes: Modes, first: Any, count: int) -> np.ndarray:
    """Points over a body, the given one and then by their distance from it, (count, dimension) [m].

    Each is the point of a fine grid that lies farthest from those before (Gonzalez 1985, Theor. Comput. Sci. 38, 293).
    """
    points = grid(modes)[0]
    points = points[modes.shapes.contains(points)]
    chosen = [modes.point("at", first)[0]]
    least = np.linalg.norm(points - chosen[0], axis=1)
    while len(chosen) < count:
        chosen.append(points[int(np.argmax(least))])
        least = np.minimum(least, np.linalg.norm(points - chosen[-1], axis=1))
    return np.array(sorted(chosen, key=lambda point: float(np.linalg.norm(point - chosen[0]))))


def of_note(note: int, velocity: int, n_points: int, fastest: float) -> tuple[int, float]:
    """Point and speed [m/s] of a MIDI note: middle C, 60, is the first point, each semitone up the next, in rounds."""
    return (note - 60) % n_points, fastest * velocity / 127  # the largest velocity of MIDI


def read_midi(path: Path) -> list[tuple[float, int, int]]:
    """Time [s], number and velocity of the notes of all tracks of a MIDI file; what else it holds says nothing."""
    mido = check.extra("mido", "play", "a MIDI file")
    if not path.is_file():
        raise ValueError(f"{path}: {check.absent(path)}")
    if path.stat().st_size > 10_000_000:  # days of music
        raise ValueError(f"{path}: a MIDI file must have at most 10 MB")
    notes, now = [], 0.0
    try:
        for message in mido.MidiFile(str(path)):
            now += message.time
            if message.type == "note_on" and message.velocity > 0:
                notes.append((now, message.note, message.velocity))
    except (EOFError, IndexError, KeyError, OSError, TypeError, ValueError, ZeroDivisionError) as error:
        if isinstance(error, OSError) and error.errno:
            raise
        raise ValueError(f"{path}: not a MIDI file that can be read ({error or type(error).__name__})") from None
    if not notes:
        raise ValueError(f"{path}: holds no notes")
    return notes


@contextmanager
def port(name: str, hands: Hands, n_points: int, fastest: float) -> Iterator[str]:
    """Listen to the MIDI input whose name begins so, or to the first; yields its name."""
    mido = check.extra("mido", "play", "a MIDI port")
    check.extra("rtmidi", "play", "a MIDI port")
    names = mido.get_input_names()
    found = [each for each in names if each.startswith(name)]
    if not found:
        known = ", ".join(names) or "none"
        raise ValueError(f"port must be a MIDI input of this machine, got {name!r}; there are: {known}")

    def receive(message: Any) -> None:
        if message.type == "note_on" and message.velocity > 0:
            hands.add_stroke(*of_note(message.note, message.velocity, n_points, fastest))

    with mido.open_input(found[0], callback=receive):
        yield found[0]


@contextmanager
def keys(hands: Hands, n_points: int, fastest: float) -> Iterator[None]:
    """Listen to the keys of the terminal, or to what is piped in; Escape or the end of the input end the playing."""

    def listen() -> None:
        for key in _pressed(hands):
            if key in ENDS:
                break
            struck = of_key(key, n_points, fastest)
            if struck is not None:
                hands.add_stroke(*struck)
        hands.stop()

    thread = threading.Thread(target=listen, daemon=True)
    with _raw(sys.stdin):
        thread.start()
        try:
            yield
        finally:
            hands.stop()
            thread.join()


def of_key(key: str, n_points: int, fastest: float) -> tuple[int, float] | None:
    """Point and speed [m/s] of a key; None if it has none."""
    for row, keys in enumerate(KEYS):
        if key.lower() in keys:
            return keys.index(key.lower()) % n_points, fastest * 2.0 ** (row + 1 - len(KEYS))
    return None


def _pressed(hands: Hands, patience: float = 0.05) -> Iterator[str]:
    """Keys as they are pressed, until the input or, as is noticed within some patience [s], the playing ends."""
    if os.name == "nt" and sys.stdin.isatty():
        import msvcrt

        while not hands.over(0):
            if msvcrt.kbhit():  # type: ignore[attr-defined]
                yield msvcrt.getwch()  # type: ignore[attr-defined]
            else:
                threading.Event().wait(patience / 10.0)
        return
    handle = sys.stdin.fileno()
    while not hands.over(0):
        if select.select([handle], [], [], patience)[0]:
            text = os.read(handle, 64).decode("utf-8", "replace")
            if not text:
                return
            yield from text


@contextmanager
def _raw(stream: Any) -> Iterator[None]:
    """Have the terminal hand over each key at once, without showing it."""
    if os.name == "nt" or not stream.isatty():
        yield
        return
    import termios
    import tty

    before = termios.tcgetattr(stream)
    tty.setcbreak(stream)
    try:
        yield
    finally:
        termios.tcsetattr(stream, termios.TCSADRAIN, before)
