"""The system that a blow follows, and what one run of it leaves behind."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from .._base import check
from .._base.rounding import ROUNDING, SAME
from .compiled import layout, propagation, record
from .compiled.bundles import KernelSystem
from .compiled.law import Row, law_of
from .contact import depths_of_surfaces
from .free_motion import flexible_motion
from .stretched import Stretched

# [-] of the largest force and of the deepest approach of a blow: a push that stays below both is an error of steps
FAINT = 1e-9
# [-] of the largest approach: bodies nearer than this touch, an atom's width in most blows; errors of the first step
# part bodies that are pressed from rest by less, and coarse steps do not see that, so that it is no impact where they
# touched before, unless its force exceeds this share of the largest
TOUCH = 1e-6
CUBIC = 3.0**0.5 / 216.0  # [-] error of the rate of a cubic through both ends of a step, over a fourth derivative h**3
SLOWEST = 0.1  # [-] of a force, what a loss that takes more of it leaves
CLEAR = 0.05  # [-] margins are stated up to this: no error that meets a tolerance moves a blow across more


@dataclass(frozen=True)
class Impact:
    """One impact: the time in which a contact carries force without a break."""

    start: float  # [s]
    end: float  # [s]
    peak_force: float  # [N]
    impulse: float  # [N s]
    contact: int = 0  # index of the contact
    approach_speed: float = 0.0  # [m/s] with which its points met; 0 if they touched already
    separation_speed: float | None = None  # [m/s] with which they parted; None if they still press each other

    @property
    def duration(self) -> float:
        """Time in contact [s]."""
        return self.end - self.start

    @property
    def restitution(self) -> float | None:
        """Speed with which the points of the contact parted over that with which they met [-].

        Both are relative speeds, so what the struck surface does counts. None while the bodies still press each other,
        and where they touched already when the force began. `Response.restitution_errors` states how exact it is.
        """
        if self.separation_speed is None or not self.approach_speed:
            return None
        return self.separation_speed / self.approach_speed


@dataclass(frozen=True, eq=False, repr=False)
class History(check.Locked):
    """A run: the system, its start and every step."""

    omega: np.ndarray  # (n_modes,) [rad/s] modes of all bodies
    zeta: np.ndarray  # (n_modes,) [-]
    shape: np.ndarray  # (n_contacts, n_modes) [kg**-0.5] signed: the approach is offset + shape @ q
    offset: np.ndarray  # (n_contacts,) [m]
    bias: np.ndarray  # (n_modes,) [N kg**-0.5] constant modal forces
    law: np.ndarray  # (n_contacts,) stiffness, exponent, loss, series compliance, .. see `compiled.law.LAW`
    start_q: np.ndarray  # (n_modes,) [m kg**0.5]
    start_p: np.ndarray  # (n_modes,) [m kg**0.5/s]
    steps: np.ndarray  # (n_steps, 3 + 6 n_contacts), see `energy.run_energy`
    end_q: np.ndarray  # (n_modes,)
    end_p: np.ndarray  # (n_modes,)
    now: np.ndarray  # (6, n_contacts) at the end; row 0 approach [m], row 4 rate [m/s], row 5 memory
    work: np.ndarray  # (n_contacts,) [J] integral of force times approach rate
    end_time: float  # [s]
    status: int  # why the run ended, see `record`
    n_fallback: int  # [-] steps in which scheme A4 fell back to A
    n_blind: int  # [-] steps that passed over contact events without locating them
    miss: float | None = None  # [m] highest approach at which the bodies turned back in flight, if they did
    stretched: Stretched | None = None  # if one of the bodies stretches
    reached: dict[str, Any] = field(default_factory=dict, init=False, repr=False)  # where its motion goes on

    @property
    def n_contacts(self) -> int:
        return len(self.offset)

    @property
    def system(self) -> KernelSystem:
        """What the run followed, as its kernel takes it."""
        bodies = self.omega, self.zeta, self.shape, self.offset, self.bias
        return KernelSystem(*bodies, self.law, self.start_q, self.start_p)

    def _column(self, first: int) -> np.ndarray:
        return self.steps[:, layout.HEAD + first : layout.HEAD + layout.WIDTH * len(self.offset) : layout.WIDTH]

    @cached_property
    def impulses(self) -> np.ndarray:
        """Impulse of every step and contact [N s], (n_steps, n_contacts)."""
        return self.steps[:, 1:2] * (self._column(layout.PUSH) + 0.5 * self._column(layout.GAIN))

    @cached_property
    def pressed(self) -> np.ndarray:
        """True where a contact carries force in a step, (n_steps, n_contacts)."""
        return self._column(layout.CLOSED) > 0.0

    def force_of(self, steps: np.ndarray, contact: int, part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Contact force [N] and its rate [N/s] at a fraction of each of some steps, (n,) each."""
        found = np.empty((2, len(steps)))
        rows, parts = np.array(steps, np.int64), np.array(part, float)
        record.forces(self.steps, self.now, self.law, rows, contact, parts, found)
        return found[0], found[1]

    def force_at(self, times: np.ndarray, contact: int) -> tuple[np.ndarray, np.ndarray]:
        """Contact force [N] and its rate [N/s] at any times, (n_times,) each; zero after the end."""
        if not len(self.steps):
            return np.zeros(len(times)), np.zeros(len(times))
        begun, lengths = self.steps[:, layout.START], self.steps[:, layout.LENGTH]
        rows = np.maximum(begun.searchsorted(times, side="right") - 1, 0)
        part = np.minimum(np.maximum((times - begun[rows]) / lengths[rows], 0.0), 1.0)
        force, rate = self.force_of(rows, contact, part)
        acts = self.pressed[rows, contact] & (force > 0.0) & (times <= self.end_time)
        return np.where(acts, force, 0.0), np.where(acts, rate, 0.0)

    @cached_property
    def end_law(self) -> np.ndarray:
        """The law with what the contacts remember at the end."""
        found = self.law.copy()
        found["memory"] = self.now[layout.REMEMBERED]
        found.setflags(write=False)  # or numba would compile the kernels again for writable arrays
        return found

    def states(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Modal displacements and velocities (n_times, n_modes) at ascending times; free motion after the end."""
        if self.stretched is not None:
            return self.stretched.states(self, times)
        q, p = np.empty((len(times), len(self.omega))), np.empty((len(times), len(self.omega)))
        propagation.replay(self.system, self.steps, times, q, p)
        return q, p

    @cached_property
    def ended(self) -> "History":
        """The free motion that follows, from the end state, which only the modes of the run itself have."""
        return replace(self, start_q=self.end_q, start_p=self.end_p, steps=self.steps[:0], end_time=0.0)

    def state(self, time: float) -> np.ndarray:
        """Modal displacements and velocities (2, n_modes) of the run's own modes at a time."""
        after = time - self.end_time
        run, time = (self.ended, after) if after >= 0.0 else (self, time)
        return np.vstack(run.states(np.array([time])))

    def remembered(self, time: float, state: np.ndarray) -> np.ndarray:
        """What each contact remembers at a time, where the modes are in a ``state`` (2, n_modes), (n_contacts,)."""
        found, left = self.now[layout.REMEMBERED].copy(), time - self.end_time
        if not left:
            return found
        if left < 0.0:
            row = int(self.steps[:, layout.START].searchsorted(time, side="right")) - 1
            found, left = self.steps[row, -self.n_contacts :].copy(), time - float(self.steps[row, layout.START])
        approach = self.offset + self.shape @ state[0]
        for i in self.law["kind"].nonzero()[0].tolist():
            law = Row._make(self.law[i].item())
            force = float(self.force_at(np.array([time]), i)[0][0])
            found[i] = law_of(law).remembered(law, found[i], approach[i] - law.compliance * force, force, left)
        return found

    def motion(self, times: np.ndarray) -> np.ndarray:
        """Approach [m] of its own modes at equally spaced times, (n_times, n_contacts), without the dip of others."""
        n = int(np.searchsorted(times, (1.0 - SAME) * self.end_time))  # nearer to it, as at the end
        found = self.offset + np.vstack(
            [self.states(times[:n])[0] @ self.shape.T, np.zeros((len(times) - n, self.n_contacts))]
        )
        after = times[n:] - self.end_time
        if not len(after):
            return found
        if self.stretched is not None:
            found[n:] += self.ended.states(after)[0] @ self.shape.T
            return found
        rigid, t = self.omega == 0.0, after[:, None]
        drift = self.end_q[rigid] + t * (self.end_p[rigid] + 0.5 * t * self.bias[rigid])
        found[n:] += drift @ self.shape[:, rigid].T
        q, p = (state[0, ~rigid] for state in self.ended.states(after[:1]))
        bodies = self.omega[~rigid], self.zeta[~rigid], self.bias[~rigid]
        for i, row in enumerate(self.shape[:, ~rigid]):
            found[n:, i] += flexible_motion(*bodies, (q, p), after, row[None]) + row @ (bodies[2] / bodies[0] ** 2)
        return found

    def surfaces(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Approach [m] at which each contact would touch, and whether it is open, (n_times, n_contacts) each."""
        rows = np.searchsorted(self.steps[:, layout.START], times, side="right") - 1
        ended = times >= self.end_time
        closed = self.pressed[rows] & ~ended[:, None]
        since = np.where(ended, times - self.end_time, times - self.steps[rows, layout.START])
        memory = np.where(ended[:, None], self.now[layout.REMEMBERED], self.steps[rows, -self.n_contacts :])
        closed &= memory >= 0.0  # felt from which the body has parted
        return depths_of_surfaces(self.law, memory, np.where(closed, 0.0, since[:, None])), ~closed

    @cached_property
    def contacts(self) -> np.ndarray:
        """All impacts, (n_impacts, 8), sorted by contact.

        Columns are start, end, peak force, impulse, contact index, with what speed the bodies meet and part, and the
        restitution, the second of these over the first; NaN where there is none.
        """
        size = np.abs(self.shape)
        way = max((size @ (np.abs(self.start_q) + self.end_time * np.abs(self.start_p))).tolist())
        found = record.find_impacts(self.steps, self.now, self.law, ROUNDING, way, TOUCH)
        if len(found) > 1:
            peak, pressed = found[:, 2], self.law[found[:, 4].astype(int)]
            depth = (peak / pressed["stiffness"]) ** (1.0 / pressed["exponent"])
            least = np.where(found[:, 5] > 0.0, FAINT, TOUCH)
            found = found[(peak > least * peak.max()) | (depth > least * self._column(0).max(initial=0.0))]
        if min(found[:, 7].tolist(), default=np.inf) < np.inf:
            # bodies that touch at rest press each other as soon as a force acts on one of them: a constant one, or that
            # of a push at another contact
            which, begun, end, since = found[:, 4].astype(int), found[:, 0], found[:, 1], found[:, 7]
            driven = np.abs(self.shape @ self.bias) > ROUNDING * (size @ np.abs(self.bias))
            start = np.where(since == np.inf, begun, np.where(driven[which], since, np.inf))
            acts = (size @ size.T > 0.0)[np.ix_(which, which)] & (end >= begun[:, None])
            for _ in start:  # a force reaches one more contact at a time
                start = np.minimum(start, np.maximum(np.where(acts, start, np.inf).min(axis=1), since))
            found[:, 0] = np.where(start < end, start, begun)
        met = found[:, 5].copy()
        met[met == 0.0] = np.nan
        found[:, 7] = found[:, 6] / met
        return found

    @property
    def n_ended(self) -> int:
        """How many impacts end within the run."""
        return int(np.isfinite(self.contacts[:, 6]).sum())

    @cached_property
    def impacts(self) -> tuple[Impact, ...]:
        """All impacts in order of their start."""
        rows = self.contacts.tolist()
        found = [
            Impact(start, end, peak, impulse, int(i), met, None if np.isnan(left) else left)
            for start, end, peak, impulse, i, met, left, _ in rows
        ]
        return tuple(sorted(found, key=lambda impact: (impact.start, impact.contact)))

    @property
    def nearest_turn(self) -> float:
        """How near to zero an approach turns back, over the farthest it ever turns [-]; infinity where none does.

        A near one counts by the motion of the modes, from which the cubics of long steps differ; as zero where it
        passes zero although the steps say that it does not. Where the run is cut off, it turns as far as it came.
        """
        miss = -np.inf if self.miss is None else self.miss
        near, far, row, i = record.nearest_turn(self.steps, self.now, self.law, miss, TOUCH)
        if row >= 0 and abs(near) < CLEAR * far:
            near = max(0.0, self._turn_in(row, i) * (1.0 if self.pressed[row, i] else -1.0))
        if self.status in (record.HORIZON, record.IMPACTS):  # what closes as it is cut off would count a bit later
            apart = self.now[layout.APPROACH] - self.surfaces(np.array([self.end_time]))[0][0]
            near = np.abs(apart[(self.now[layout.RATE] > 0.0) & (apart != 0.0)]).min(initial=abs(near))
        return float(abs(near) / far) if far else np.inf

    def _turn_in(self, row: int, i: int) -> float:
        """Approach [m] from its dent at which contact i turns within a step, by the motion of the modes."""
        part = np.linspace(0.0, 1.0, record.PEAK_LOOKS + 1)
        length = self.steps[row, layout.LENGTH]
        times = self.steps[row, layout.START] + part * length
        q, p = self.states(times)
        force, slope = self.force_of(np.full(len(part), row), i, part)
        soft = self.law["compliance"][i] * self.pressed[row, i]
        approach = self.offset[i] + q @ self.shape[i] - soft * force - self.surfaces(times[:1])[0][0, i]
        rate = p @ self.shape[i] - soft * slope
        bend = np.gradient(rate, part)
        k = int((approach * np.sign(bend.sum())).argmin())
        beside = 0.0 < abs(rate[k]) * record.PEAK_LOOKS < abs(bend[k])  # it turns between two of these times
        return float(approach[k] - (0.5 * length * rate[k] ** 2 / bend[k] if beside else 0.0))

    def bridged(self, reach: float = 0.0) -> np.ndarray:
        """How long after the end all modes together may bring surfaces within ``reach`` [m] of each other [s].

        (n_contacts,); infinite where the rigid motions do not part them.
        """
        rigid, shape = self.omega == 0.0, self.shape
        size = np.hypot(self.end_q, self.end_p / np.where(rigid, 1.0, self.omega))
        gap = -self.offset - shape[:, rigid] @ self.end_q[rigid]
        apart = -shape[:, rigid] @ self.end_p[rigid]  # [m/s]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(apart > 0.0, (np.abs(shape[:, ~rigid]) @ size[~rigid] - gap + reach) / apart, np.inf)

    @cached_property
    def margin(self) -> float:
        """How near the run is to one impact more or fewer; see `Response.margin`."""
        return min(CLEAR, self.nearest_turn)

    @cached_property
    def force_missed(self) -> float:
        """Error [-] of the peak force within steps, on which two runs may agree by chance.

        Steps may be too long for its ripples or, with loss, for the rate in them: that of a cubic errs by nothing at
        three places in a step, and in both directions between them. It is twice what a step shows: with once, 14 of
        1 000 random blows erred by more, up to 2.7 times.
        """
        if not len(self.contacts):
            return 0.0
        peak = float(self.contacts[:, 2].max())
        if not peak:  # pressed by less than rounding
            return 1.0
        missed = float(record.force_missed(self.steps, self.now, self.law, peak))
        for i in self.law["loss"].nonzero()[0]:
            pushes, speeds = self.impulses[:, i] / self.steps[:, layout.LENGTH], self._column(layout.SPEED)[:, i]
            row, loss = int(pushes.argmax()), float(self.law["loss"][i])
            bends = np.abs(np.diff(speeds[max(0, row - 3) : row + 4], 3))  # fourth derivatives times h**3
            share = loss / max(1.0 + loss * speeds[row], SLOWEST)
            missed = max(missed, CUBIC * share * float(bends.max(initial=0.0)) * float(pushes[row]) / peak)
        return min(1.0, 2.0 * missed)

    def samples(self, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
        """Times [s], (n_times,), dense enough for a tolerance, and the forces [N] there, (n_times, n_contacts)."""
        steps = self.steps
        if not len(steps):
            return np.zeros(1), np.zeros((1, self.n_contacts))
        busy = np.asarray(self.pressed.any(axis=1))
        per_step = 4.0
        if busy.any():
            per_impact = busy.sum() / max(1, len({impact.start for impact in self.impacts}))
            # with 800 the spectrum of an impact errs by less than 1e-3 up to the thirtieth lobe
            wanted = max((3.0 / max(tolerance, 1e-10)) ** 0.5, 800.0)
            per_step = np.clip(np.ceil(wanted / per_impact), 4, 4096)
        counts = np.where(busy, int(per_step), 1)
        rows = np.repeat(np.arange(len(steps)), counts)
        part = (np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)) / per_step
        times = np.append(steps[rows, layout.START] + part * steps[rows, layout.LENGTH], self.end_time)
        rows, part = np.append(rows, len(steps) - 1), np.append(part, 1.0)
        forces = [np.where(self.pressed[rows, i], self.force_of(rows, i, part)[0], 0.0) for i in range(self.n_contacts)]
        return times, np.stack(forces, axis=1)

    def energy(self, q: np.ndarray, p: np.ndarray, modes: slice = slice(None)) -> float:
        """Energy [J] of some modes at a state, in the field of the constant forces."""
        linear = float(mode_energy(self.omega[modes], q[modes], p[modes]).sum() - self.bias[modes] @ q[modes])
        return linear if self.stretched is None else linear + self.stretched.energy(q, modes)


def mode_energy(omega: np.ndarray, q: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Kinetic and elastic energy [J] of each mode, (..., n_modes)."""
    return 0.5 * (p**2 + (omega * q) ** 2)
