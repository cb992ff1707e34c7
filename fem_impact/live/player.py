"""A body that is played: strokes at any time, answered block by block with the contact force and the motion of each."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base import check
from .._base.rounding import EPSILON, ROUNDING
from ..impact import collision, stepping
from ..impact.collision import Touch
from ..impact.compiled import live
from ..impact.compiled.layout import WIDTH
from ..impact.compiled.propagation import N_LANE, N_TABLE, step_table
from ..impact.contact import Contact
from ..impact.striker import Striker
from ..modes.modal import Modes
from ..show.sound import FULL_SCALE, HIGHEST_RATE, RATE, Sound

# [-] frames computed at a time: 1.3 ms at 48 kHz, as usual; longer ones delay strokes, shorter ones cost more calls
BLOCK = 64
CONTACT_STEPS = 32.0  # [-] least steps in the shortest contact; test_player.py holds the force to 1e-3
SHORTEST = 12  # [-] halvings of a frame that a step in contact may need: 5 ns at 48 kHz
OPENING, CLOSING, FLIGHT = 5, 8, 2  # [-] halvings of that step to end at a release, at an onset, and in flight
LASTING = 1.0  # [s] after which a stick that still rests on the body is lifted: a blow lasts some milliseconds
AT_ONCE = 64  # [-] strokes in one block, far more than hands or a keyboard make; what comes on top waits for the next


class PlayedStroke(NamedTuple):
    """A stroke of a player."""

    frame: int  # [-] since the start of the sound
    point: int  # index of the struck point
    speed: float  # [m/s]


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

    def __init__(
        self, modes: Modes, striker: Striker, contact: Contact, *, points: Any, fastest: float, listen: Any = None,
        rate: int = RATE, block: int = BLOCK, sticks: int = 4, residual: bool = True, n_trace: int = 0,
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
            Frames in a block.
        sticks : int
            How many can be on the body at once; the next one takes the place of the oldest that does not touch.
        residual : bool
            As in `fi.strike`.
        n_trace : int
            Steps in contact that `trace` keeps.
        """
        self.modes, self.contact = modes, contact
        self.points = modes.point("points", points[0]) if modes.dimension == 0 else _points(modes, points)
        self.rate = check.count("rate", rate, high=HIGHEST_RATE)
        self.block, self.fastest = check.count("block", block), check.positive("fastest", fastest, "m/s")
        self.sticks = check.count("sticks", sticks, high=16)
        needed = collision.striker_modes(striker, contact=contact, speed=fastest, tolerance=collision.TOLERANCE)[0]
        self.striker = striker if striker.fixed else collision.shortened(striker, needed)
        found = [
            collision.touching(
                (self.striker.modes, modes), Touch(contact, 0, 1, self.striker.at, point), self.fastest, residual
            )
            for point in self.points
        ]
        shortest = min(duration for _, duration in found)
        listen = self.points[0] if listen is None else listen
        self.step = self._arrays([system for system, _ in found], shortest, sticks, n_trace, listen)
        self._strokes = live.PlayStrokes(np.zeros(AT_ONCE, np.int64), np.zeros(AT_ONCE, np.int64), np.zeros(AT_ONCE))
        self.gain = 1.0 / FULL_SCALE

    def _arrays(self, systems: list, duration: float, sticks: int, n_trace: int, listen: Any) -> float:
        """Make the arrays of the kernel; the longest step in contact [s]."""
        modes, n_stick, n_body = self.modes, self.striker.modes.n_modes, self.modes.n_modes
        most = max(systems, key=lambda system: system.omega.size)
        n_own = most.omega.size - n_body
        own = np.r_[:n_stick, n_stick + n_body : most.omega.size]
        rows, mine = np.zeros((len(systems), n_body)), np.zeros((len(systems), n_own))
        for i, system in enumerate(systems):
            rows[i] = system.shape[0, n_stick : n_stick + n_body]
            mine[i, :n_stick] = system.shape[0, :n_stick]
            extra = system.shape[0, n_stick + n_body :]
            mine[i, n_stick : n_stick + extra.size] = extra
        held, body = np.arange(n_own) < n_stick, self.striker.body
        mine_omega, mine_zeta = most.omega[own], most.zeta[own]
        mine_omega[held], mine_zeta[held] = body.omega, body.damping_ratio  # as a hand may hold it
        omega = np.r_[np.tile(mine_omega, sticks), modes.omega]
        zeta = np.r_[np.tile(mine_zeta, sticks), modes.damping_ratio]
        motion, push = np.zeros(n_own), np.zeros(n_own)
        motion[:n_stick], push[:n_stick] = self.striker.motion, self.striker.push
        period = 1.0 / self.rate
        ringing = omega[zeta < stepping.RINGING].max(initial=0.0)
        finer = max(period * CONTACT_STEPS / duration, period * ringing / stepping.RESOLVED)
        level = max(0, int(np.ceil(np.log2(finer))))
        if level > SHORTEST:
            raise ValueError(
                f"contact must last at least {CONTACT_STEPS * period * 0.5**SHORTEST:.2g} s at {self.fastest:g} m/s to "
                f"be played, got {duration:.2g} s; take a softer one"
            )
        listening = np.zeros(omega.size)
        heard = (modes.omega > 0.0) & (modes.omega < np.pi * self.rate)
        listening[-n_body:] = np.where(heard, modes.shape_at(modes.point("listen", listen))[0], 0.0)
        self._body = live.PlayedBody(omega, zeta, 2.0 * zeta * omega, _tables(omega, zeta, period), listening)
        laws = np.array([system.law[0] for system in systems])
        offsets = np.array([system.offset[0] for system in systems])
        self._pads = live.Pads(rows, mine, laws, offsets, motion, push)
        self._limits = live.PlayLimits(
            level, min(level + CLOSING, live.LEVELS - 1), level + OPENING, level + FLIGHT, round(LASTING * self.rate),
            period, EPSILON * duration * self.fastest, ROUNDING * self.fastest,
        )  # fmt: skip
        self._state = _state(omega.size, sticks, n_trace)
        return float(period * 0.5**level)

    def reset(self) -> None:
        """Bring the body to rest, without sticks, at frame zero."""
        for array in self._state:
            array[:] = 0

    def fill(self, strokes: Sequence[PlayedStroke], out: np.ndarray) -> None:
        """Compute the next block into ``out`` (n_frames,) float32, with the strokes in it, by frames of the block."""
        count = min(len(strokes), AT_ONCE)
        now = live.PlayStrokes(*(array[:count] for array in self._strokes))
        for i in range(count):
            now.when[i], now.pad[i], now.speed[i] = strokes[i]
        live.play(self._body, self._pads, self._limits, self._state, now, self.gain, out)

    def play(self, strokes: Sequence[PlayedStroke | tuple[int, int, float]], duration: float) -> Sound:
        """The sound [m/s] of strokes, by frames since now, for a duration [s]; the same strokes give the same bits."""
        score = sorted(self._checked(stroke) for stroke in strokes)
        out = np.zeros(round(check.positive("duration", duration, "s") * self.rate), np.float32)
        first = 0
        for begin in range(0, len(out), self.block):
            last = first
            while last < len(score) and score[last].frame < begin + self.block and last - first < AT_ONCE:
                last += 1
            here = [stroke._replace(frame=max(0, stroke.frame - begin)) for stroke in score[first:last]]
            self.fill(here, out[begin : begin + self.block])
            first = last
        return Sound(out.astype(float), self.rate, 1.0 / self.gain)

    def _checked(self, stroke: Any) -> PlayedStroke:
        frame, point, speed = stroke
        check.count("point of a stroke", point, low=0, high=len(self.points) - 1)
        frame = check.count("frame of a stroke", frame, low=0)
        return PlayedStroke(frame, point, check.between("speed of a stroke", speed, 0.0, self.fastest, "m/s"))

    @property
    def counted(self) -> dict[str, int]:
        """What happened so far: strokes, sticks lifted early for others, contacts that ended, steps in contact."""
        names = {"strokes": live.STRUCK, "stolen": live.STOLEN, "contacts": live.TOUCHED, "steps": live.STEPS}
        return {name: int(self._state.counted[i]) for name, i in names.items()}

    @property
    def trace(self) -> np.ndarray:
        """Steps in contact so far, up to ``n_trace``: end [s], length [s], point, mean force [N], approach [m], force
        at the end [N]; (n, 6).
        """  # fmt: skip
        return self._state.trace[: self._state.counted[live.TRACED]].copy()


def _points(modes: Modes, points: Any) -> np.ndarray:
    if not isinstance(points, (list, tuple, np.ndarray)) or not len(points):
        raise ValueError(f"points must be a list of points of the body, got {check.shown(points)}")
    return np.vstack([modes.point(f"points[{i}]", point) for i, point in enumerate(points)])


def _tables(omega: np.ndarray, zeta: np.ndarray, period: float) -> np.ndarray:
    """What `propagation.lane_table` holds for each of the step lengths, (LEVELS, N_LANE, n_modes)."""
    found, table = np.empty((live.LEVELS, N_LANE, omega.size)), np.empty((N_TABLE, omega.size))
    for level, lanes in enumerate(found):
        h = period * 0.5**level
        step_table(omega, zeta, h, table)
        lanes[:4], lanes[4], lanes[5], lanes[6] = table[:4], table[9], table[10] / h, table[11] / h
    return found


def _state(n_modes: int, sticks: int, n_trace: int) -> live.PlayState:
    """A body at rest, and no stick."""
    size = max(4, 2 * sticks)
    numbers: dict[str, Any] = {
        "rows": (sticks, n_modes), "law": (sticks, WIDTH), "offset": sticks, "now": (6, sticks), "end": (3, sticks),
        "found": (5, sticks), "bounds": (sticks, 6), "sums": (live.LEVELS, 6, sticks, sticks), "work": (5, size, size),
        "trace": (n_trace, 6), **dict.fromkeys(("q", "p", "free_q", "free_p", "bias"), n_modes),
    }  # fmt: skip
    counts: dict[str, Any] = {"known": live.LEVELS, "place": 4, "counted": live.COUNTERS}
    counts |= dict.fromkeys(("slot", "pad", "until"), sticks)
    made = {name: np.zeros(shape) for name, shape in numbers.items()}
    made |= {name: np.zeros(shape, np.int64) for name, shape in counts.items()}
    return live.PlayState(pressed=np.zeros(sticks, np.bool_), **made)
