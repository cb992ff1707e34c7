"""A body that is played: strokes at any time, answered block by block with the contact force and the motion of each."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base import check
from ..impact import collision
from ..impact.contact import Contact
from ..impact.played import AT_ONCE, StruckBody
from ..impact.striker import Striker
from ..modes.modal import Modes
from ..show.sound import FULL_SCALE, HIGHEST_RATE, RATE, Sound


class PlayedStroke(NamedTuple):
    """A stroke of a player."""

    frame: int  # [-] since the start of the sound
    point: int  # index of the struck point
    speed: float  # [m/s]


class Score:
    """Strokes known beforehand."""

    live = False

    def __init__(self, strokes: Sequence[PlayedStroke]) -> None:
        self.strokes: list[PlayedStroke] = sorted(strokes)
        self._next = 0

    def due(self, begin: int, end: int) -> list[PlayedStroke]:
        """The strokes of a block, by frames of the block; what is too much at once comes in the next."""
        first = self._next
        while self._next < len(self.strokes) and self.strokes[self._next].frame < end and self._next - first < AT_ONCE:
            self._next += 1
        return [stroke._replace(frame=max(0, stroke.frame - begin)) for stroke in self.strokes[first : self._next]]

    def over(self, frame: int) -> bool:
        """Whether none follows."""
        return self._next == len(self.strokes)


class Player:
    """A body with points that can be struck at any time, by up to ``sticks`` sticks at once.

    Each contact is resolved by scheme A4, in steps of `step` or less; the modes ring on by recursion. The sound is that
    of `fi.sound.synthesise`, the velocity of a point of the body.
    """

    modes: Modes
    contact: Contact
    points: np.ndarray  # (n_points, dimension) [m] where the body can be struck
    rate: int  # [Hz]
    block: int  # frames
    fastest: float  # [m/s]
    striker: Striker  # with as many modes as the fastest stroke needs
    step: float  # [s] longest step in contact
    sticks: int  # [-] most that are on the body at once
    gain: float  # [s/m] of samples
    struck: StruckBody  # which counts what happens, and starts afresh by its ``reset``

    def __init__(
        self, modes: Modes, striker: Striker, contact: Contact, *, points: Any, fastest: float, listen: Any = None,
        rate: int = RATE, block: int = 64, sticks: int = 4, n_trace: int = 0,
    ) -> None:  # fmt: skip
        """Prepare everything that a block needs.

        Parameters
        ----------
        modes, striker, contact : Modes, Striker, Contact
            As in `fi.strike`.
        points : array_like, shape (n_points, dimension) [m]
            Where the body can be struck.
        fastest : float [m/s]
            Fastest stroke, which the step in contact is made for.
        listen : array_like, shape (dimension,) [m], optional
            Point to listen to; the first of ``points`` by default.
        rate : int [Hz]
        block : int
            Frames in a block, 1.3 ms as usual; longer ones delay strokes, shorter ones cost more calls.
        sticks : int
            How many can be on the body at once; the next one takes the place of the oldest that does not touch.
        n_trace : int
            Steps in contact that ``struck.trace`` keeps.
        """
        self.modes, self.contact = modes, contact
        if modes.dimension and not (isinstance(points, (list, tuple, np.ndarray)) and len(points)):
            raise ValueError(f"points must be a list of points of the body, got {check.shown(points)}")
        named = {f"points[{i}]": point for i, point in enumerate(points)} if modes.dimension else {"points": points[0]}
        self.points = np.vstack([modes.point(name, point) for name, point in named.items()])
        self.rate = check.count("rate", rate, high=HIGHEST_RATE)
        self.block, self.fastest = check.count("block", block), check.positive("fastest", fastest, "m/s")
        self.sticks = check.count("sticks", sticks, high=16)
        needed = collision.striker_modes(striker, contact=contact, speed=fastest, tolerance=collision.TOLERANCE)[0]
        self.striker = striker if striker.fixed else collision.shortened_striker(striker, needed)
        place = modes.point("listen", self.points[0] if listen is None else listen)
        self.struck = StruckBody(
            modes, self.striker, contact, points=self.points, listen=place, fastest=self.fastest, rate=self.rate,
            sticks=sticks, n_trace=n_trace,
        )  # fmt: skip
        self.step, self.gain = self.struck.step, 1.0 / FULL_SCALE

    def fill(self, strokes: Sequence[PlayedStroke], out: np.ndarray) -> None:
        """Compute the next block into ``out`` (n_frames,) float32, with the strokes in it, by frames of the block."""
        self.struck.fill(strokes, self.gain, out)

    def play(self, strokes: Sequence[PlayedStroke | tuple[int, int, float]], duration: float) -> Sound:
        """The sound [m/s] of strokes, by frames since now, for a duration [s]; the same strokes give the same bits."""
        checked = []
        for frame, point, speed in strokes:
            point = check.count("point of a stroke", point, low=0, high=len(self.points) - 1)
            frame = check.count("frame of a stroke", frame, low=0)
            speed = check.between("speed of a stroke", speed, 0.0, self.fastest, "m/s")
            checked.append(PlayedStroke(frame, point, speed))
        score = Score(checked)
        out = np.zeros(round(check.positive("duration", duration, "s") * self.rate), np.float32)
        for begin in range(0, len(out), self.block):
            self.fill(score.due(begin, begin + self.block), out[begin : begin + self.block])
        return Sound(out.astype(float), self.rate, 1.0 / self.gain)
