"""A body that sticks strike at any time, as the kernel of playing takes it: its arrays, its state and its blocks."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._base.rounding import EPSILON, ROUNDING
from ..modes.modal import Modes
from . import stepping
from .collision import Touch, touching_system
from .compiled import live
from .compiled.law import LAW
from .compiled.layout import N_LANE
from .compiled.propagation import N_TABLE, step_table
from .contact import Contact
from .striker import Striker

CONTACT_STEPS = 32.0  # [-] least steps in the shortest contact; tests/live/test_player.py holds the force to 1e-3
SHORTEST = 12  # [-] halvings of a frame that a step in contact may need: 5 ns at 48 kHz
AT_ONCE = 64  # [-] strokes in one block, far more than hands or a keyboard make; what comes on top waits for the next


class StruckBody:
    """A body with sticks, at rest at first; `fill` computes its sound, block by block."""

    def __init__(
        self, modes: Modes, striker: Striker, contact: Contact, *, points: np.ndarray, listen: np.ndarray,
        fastest: float, rate: int, sticks: int, n_trace: int,
    ) -> None:  # fmt: skip
        """Make all arrays of a body struck at points (n_points, dimension) [m] by up to ``sticks`` sticks at once."""
        bodies = striker.modes, modes
        found = [touching_system(bodies, Touch(contact, 0, 1, striker.at, point), fastest) for point in points]
        systems, duration = [system for system, _ in found], min(duration for _, duration in found)
        n_stick, n_body = striker.modes.n_modes, modes.n_modes
        most = max(systems, key=lambda system: system.omega.size)
        own = np.r_[:n_stick, n_stick + n_body : most.omega.size]  # those of a stick, with what stands for the rest
        rows, mine = np.zeros((len(systems), n_body)), np.zeros((len(systems), own.size))
        for i, system in enumerate(systems):
            rows[i] = system.shape[0, n_stick : n_stick + n_body]
            here = np.delete(system.shape[0], slice(n_stick, n_stick + n_body))
            mine[i, : here.size] = here
        stick_omega, stick_zeta = most.omega[own], most.zeta[own]
        stick_omega[:n_stick], stick_zeta[:n_stick] = striker.body.omega, striker.body.damping_ratio  # in a hand
        omega = np.r_[np.tile(stick_omega, sticks), modes.omega]
        zeta = np.r_[np.tile(stick_zeta, sticks), modes.damping_ratio]
        motion, push = np.zeros(own.size), np.zeros(own.size)
        motion[:n_stick], push[:n_stick] = striker.motion, striker.push
        period = 1.0 / rate
        level = _halvings(period, duration, omega[zeta < stepping.RINGING].max(initial=0.0), fastest)
        audible = (modes.omega > 0.0) & (modes.omega < np.pi * rate)
        listening = np.zeros(omega.size)
        listening[-n_body:] = np.where(audible, modes.shape_at(listen)[0], 0.0)
        self.step = float(period * 0.5**level)  # [s] longest in contact
        self.body = live.PlayedBody(omega, zeta, 2.0 * zeta * omega, _tables(omega, zeta, period), listening)
        laws, offsets = (np.array([getattr(system, name)[0] for system in systems]) for name in ("law", "offset"))
        self.pads = live.Pads(rows, mine, laws, offsets, motion, push)
        self.limits = live.PlayLimits(
            level,
            min(level + 8, live.LEVELS - 1),  # halvings of that step to end at an onset,
            level + 5,  # at a release,
            level + 2,  # and in flight
            rate,  # after a second, a stick that still rests on the body is lifted: a blow lasts some milliseconds
            period, EPSILON * duration * fastest, ROUNDING * fastest,
        )  # fmt: skip
        self.state = _state(omega.size, sticks, n_trace)
        self._strokes = live.PlayStrokes(np.zeros(AT_ONCE, np.int64), np.zeros(AT_ONCE, np.int64), np.zeros(AT_ONCE))

    def reset(self) -> None:
        """Bring the body to rest, without sticks, at frame zero."""
        for array in self.state:
            array[:] = 0

    def fill(self, strokes: Sequence[tuple[int, int, float]], gain: float, out: np.ndarray) -> None:
        """Compute the next block into ``out`` (n_frames,) float32: ``gain`` times the velocity at the listener's point.

        Of each stroke in it, in the order of time: the frame of the block, the point, and the speed [m/s].
        """
        count = min(len(strokes), AT_ONCE)
        now = live.PlayStrokes(*(array[:count] for array in self._strokes))
        for i in range(count):
            now.when[i], now.pad[i], now.speed[i] = strokes[i]
        live.play_block(self.body, self.pads, self.limits, self.state, now, gain, out)

    @property
    def counted(self) -> dict[str, int]:
        """What happened so far: strokes, sticks lifted early for others, contacts that ended, steps in contact."""
        names = {"strokes": live.STRUCK, "stolen": live.STOLEN, "contacts": live.TOUCHED, "steps": live.STEPS}
        return {name: int(self.state.counted[i]) for name, i in names.items()}

    @property
    def trace(self) -> np.ndarray:
        """Steps in contact so far, (n, 6), up to ``n_trace``.

        Columns are end [s], length [s], point, mean force [N], approach [m] and force at the end [N].
        """
        return self.state.trace[: self.state.counted[live.TRACED]].copy()


def _halvings(period: float, duration: float, ringing: float, speed: float) -> int:
    """Halvings of a frame of ``period`` [s] for the steps in contacts of ``duration`` [s] and a mode [rad/s]."""
    finer = max(period * CONTACT_STEPS / duration, period * ringing / stepping.RESOLVED)
    level = max(0, int(np.ceil(np.log2(finer))))
    if level > SHORTEST:
        raise ValueError(
            f"contact must last at least {CONTACT_STEPS * period * 0.5**SHORTEST:.2g} s at {speed:g} m/s to be played, "
            f"got {duration:.2g} s; take a softer one"
        )
    return level


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
        "rows": (sticks, n_modes), "offset": sticks, "now": (6, sticks), "end": (3, sticks),
        "found": (5, sticks), "bounds": (sticks, 6), "sums": (live.LEVELS, 6, sticks, sticks), "work": (5, size, size),
        "trace": (n_trace, 6), **dict.fromkeys(("q", "p", "free_q", "free_p", "bias"), n_modes),
    }  # fmt: skip
    counts: dict[str, Any] = {"known": live.LEVELS, "place": 4, "counted": live.COUNTERS}
    counts |= dict.fromkeys(("slot", "pad", "until"), sticks)
    made = {name: np.zeros(shape) for name, shape in numbers.items()}
    made |= {name: np.zeros(shape, np.int64) for name, shape in counts.items()}
    made["law"] = np.zeros(sticks, LAW)
    return live.PlayState(pressed=np.zeros(sticks, np.bool_), **made)
