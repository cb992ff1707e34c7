"""What small changes of a blow's numbers do to it, to first order, from the record of one run."""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING

import numpy as np

from .._base import check
from .._base.check import SimulationError
from .compiled import record
from .compiled.tangents import N_LAW, Blow, Change, Found, Pieces, follow, law_at

if TYPE_CHECKING:
    from .response import History

NODES = 3, 5  # [-] Gauss nodes per piece: for a force that is linear in each step, and for one of higher order
# [-] fractions of the first step of a contact in which its force is no polynomial, and mirrored of the last: there the
# slope of a power law goes as (exponent - 1) powers of time
GRADED = (4.0**-4, 4.0**-3, 4.0**-2, 4.0**-1)
LOOKS, ROUNDS = 16, 2  # [-] samples per step in the search for the largest force; one step of Newton's method follows
NUDGE = 1e-5  # [-] relative change at which the curvature of a contact law is taken; leaves 1e-10
SLOW, MORE = 0.3, 12  # [rad], [-] half the phase over a piece up to which its own nodes make a spectrum; else so many
EDGE = 1e-9  # [-] of a step: what lies nearer to its ends is at them
ROUNDING = 1e-14  # [-] of the duration: the same
ALIKE = 1e-11  # [-] difference of lengths of pieces that rounding leaves
CANCELS = 1e-12  # [-] of the changes of the approach at the start: what they leave if they cancel
AT_ZERO = 1e-7  # [-] of the deepest approach: a contact that ends deeper lets go by its loss


@cache
def gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss nodes on [0, 1] with 1 appended, (count + 1,), and Lagrange polynomials in powers, (count, count)."""
    nodes = 0.5 * (np.polynomial.legendre.leggauss(count)[0] + 1.0)
    powers = np.linalg.inv(np.vander(nodes, increasing=True)).T
    return np.append(nodes, 1.0), np.ascontiguousarray(powers)


def no_change(history: "History", n: int) -> Change:
    """Room for the changes that ``n`` parameters make, all zero."""
    omega, zeta, shape, bias, start_q, start_p = np.zeros((6, n, len(history.omega)))
    return Change(omega, zeta, shape, bias, start_q, start_p, np.zeros(n), np.zeros((n, N_LAW)))


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """A recorded blow with one contact, followed with its changes per unit of n parameters."""

    history: "History"
    change: Change
    time: np.ndarray  # (n_pieces + 1,) [s] ends of the pieces
    pieces: Pieces
    found: Found
    peak: int  # index in `time` of the largest force; -1 without contact

    def __repr__(self) -> str:
        return check.brief(self)

    @classmethod
    def of(cls, history: "History", change: Change, peak: bool = True) -> "Sensitivity":
        """Follow the record; raises SimulationError where it passed over contacts without locating them.

        ``peak`` says whether the largest force is wanted.
        """
        if history.n_blind:
            raise SimulationError(
                "no gradient: the bodies chatter, and the run passed over contacts without locating them; give "
                "max_impacts, a shorter duration or no dt"
            )
        top = _peak(history) if peak else None
        time, row, part = _cut(history, top)
        nodes, powers = gauss(NODES[int(history.n_coefficients > 2)])
        n, n_modes, s = len(change.offset), len(history.omega), len(powers)
        wanted = [0.0, *(when for each in history.impacts for when in (each.start, each.end)), time[-1]]
        wanted += [] if top is None else [top, *_step_at(history, top)]
        marks = np.unique([int(np.abs(time - when).argmin()) for when in wanted])
        mark = np.full(len(time), -1)
        mark[marks] = np.arange(len(marks))
        length, closed, step = _alike(np.diff(time)), history.pressed[row, 0], history.steps[row, 1:2]
        within = part[:, None] + nodes[:-1] * length[:, None] / step
        force = np.zeros((len(length), s))
        for c in history.steps[row, 6 : 6 + history.n_coefficients].T[::-1]:
            force = force * within + c[:, None]
        force[~closed] = 0.0
        pieces = Pieces(length, closed, force, mark, nodes, powers)
        found = Found(
            np.zeros((len(time), 2)), np.zeros((len(marks), 5)), np.zeros((len(marks), 4, n)),
            np.zeros((len(marks), n_modes)), np.zeros((len(marks), n_modes)), np.zeros((len(length), s, n)),
            np.zeros((n, n_modes)), np.zeros((n, n_modes)),
        )  # fmt: skip
        blow = Blow(
            history.omega, history.zeta, history.shape[0], history.bias, history.start_q, history.start_p,
            float(history.offset[0]), history.law,
        )  # fmt: skip
        follow(blow, change, pieces, found)
        at = -1 if top is None else int(np.abs(time - top).argmin())
        return cls(history, change, time, pieces, found, at)

    @cached_property
    def deepest(self) -> float:
        """Largest approach in the blow [m]."""
        return float(self.found.way[:, 0].max(initial=0.0))

    @cached_property
    def events(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """Changes (n,) of start and end of every impact, per unit [s]."""
        return tuple((self._moved(each.start), self._moved(each.end)) for each in self.history.impacts)

    def _moved(self, time: float) -> np.ndarray:
        """Change of an onset or release."""
        k = int(np.abs(self.time - time).argmin())
        mark = self.pieces.mark[k]
        d, v, a = self.found.base[mark, :3]
        dd, dv = self.found.ends[mark, :2]
        still = np.zeros(dd.shape)
        near = abs(d) <= AT_ZERO * self.deepest
        if k == 0:
            if near and (np.abs(dd) > CANCELS * self._start_terms).any():
                raise SimulationError(
                    "no gradient: the bodies touch at the start already, and a change would press or part them; "
                    "give a gap"
                )
            return still
        if near:
            return -dd / v
        if k == len(self.time) - 1 and self.history.status == record.HORIZON:
            return still
        loss = self.history.law[0, 2]
        return -(self.change.law[:, 2] * v + loss * dv) / (loss * a)

    @property
    def _start_terms(self) -> np.ndarray:
        """Sum (n,) of the sizes of what changes the approach at the start [m]; all that may cancel."""
        h, change = self.history, self.change
        return np.abs(change.shape) @ np.abs(h.start_q) + np.abs(change.start_q) @ np.abs(h.shape[0])

    @cached_property
    def end(self) -> np.ndarray:
        """Change (n,) of the end of the run [s]; a run that was given a duration keeps it."""
        if self.history.status == record.HORIZON or not self.events:
            return np.zeros(len(self.change.offset))
        last = max(range(len(self.events)), key=lambda i: self.history.impacts[i].end)
        return self.events[last][1]

    @property
    def contact_time(self) -> np.ndarray:
        """Change (n,) of the time in contact [s]."""
        return sum((end - start for start, end in self.events), np.zeros(len(self.change.offset)))

    @property
    def weights(self) -> np.ndarray:
        """Weight (n_pieces, s) [s] of every node in an integral over time."""
        powers = self.pieces.powers
        share = (powers / np.arange(1.0, len(powers) + 1.0)).sum(axis=1)
        return self.pieces.length[:, None] * share

    @property
    def impulse(self) -> np.ndarray:
        """Change (n,) of the impulse [N s]."""
        return np.einsum("jb,jbi->i", self.weights, self.found.force)

    def spectrum(self, frequencies: np.ndarray) -> np.ndarray:
        """Change (n_frequencies, n) of the force's Fourier transform [N s]."""
        pieces = self.pieces
        phase = np.pi * float(np.abs(frequencies).max(initial=0.0)) * pieces.length[pieces.closed].max(initial=0.0)
        rule = len(pieces.powers) if phase < SLOW else MORE
        nodes = gauss(rule)[0][:-1]
        weights = 0.5 * np.polynomial.legendre.leggauss(rule)[1]
        basis = np.vander(nodes, len(pieces.powers), increasing=True) @ pieces.powers.T  # (rule, s)
        length = pieces.length[pieces.closed, None]
        time = (self.time[:-1][pieces.closed, None] + nodes * length).ravel()
        force = np.einsum("ab,jbi->jai", basis, self.found.force[pieces.closed])
        force = (force * (weights * length)[:, :, None]).reshape(len(time), -1)  # [N s]
        blocks = np.array_split(frequencies, max(1, len(frequencies) * len(time) // 2**20))
        return np.vstack([np.exp(-2j * np.pi * block[:, None] * time) @ force for block in blocks])

    @property
    def end_speeds(self) -> np.ndarray:
        """Change (n_modes, n) of the modal velocities at the end of the run, which moves."""
        h, found = self.history, self.found
        rate = h.bias - h.omega * (2.0 * h.zeta * found.p[-1] + h.omega * found.q[-1])
        return (found.dp + rate * self.end[:, None]).T

    def speed(self, modes: np.ndarray) -> np.ndarray:
        """Change (n,) of the final speed [m/s] of the contact point in some modes."""
        u, p = self.history.shape[0, modes], self.found.p[-1, modes]
        return self.change.shape[:, modes] @ p + u @ self.end_speeds[modes]

    def energies(self, modes: slice) -> np.ndarray:
        """Change (n_modes, n) of the energy left in each of some modes at the end [J]."""
        omega, q, p = self.history.omega[modes], self.found.q[-1, modes], self.found.p[-1, modes]
        dq = self.found.dq[:, modes].T + p[:, None] * self.end
        return (
            p[:, None] * self.end_speeds[modes]
            + (omega**2 * q)[:, None] * dq
            + (omega * q**2)[:, None] * self.change.omega[:, modes].T
        )

    @property
    def peak_force(self) -> np.ndarray:
        """Change (n,) of the largest force [N]."""
        if self.peak < 0:
            return np.zeros(len(self.change.offset))
        return self._at_peak[1][3] + self._rate_change * self._late

    @property
    def peak_time(self) -> np.ndarray:
        """Change (n,) of the time of the largest force [s]."""
        return np.zeros(len(self.change.offset)) if not self._bend else -self._rate_change / self._bend

    @property
    def when_largest(self) -> float:
        """Time of the largest force [s]."""
        return float(self.time[self.peak] + self._late)

    @cached_property
    def _at_peak(self) -> tuple[np.ndarray, np.ndarray]:
        """Approach and its first three rates (4,) at the peak; changes (4, n) of the first three, and of the force.

        A force that is linear in each step jumps between two, and the accelerations with it. There the approach is the
        cubic through both ends of the step, as in the force that the peak was found in.
        """
        found, mark, h = self.found, self.pieces.mark, self.history
        if h.n_coefficients > 2:
            return found.base[mark[self.peak], :4], found.ends[mark[self.peak]]
        start, end = _step_at(h, float(self.time[self.peak]))
        ends = [int(mark[np.abs(self.time - when).argmin()]) for when in (start, end)]
        length = end - start
        x = (self.time[self.peak] - start) / length
        powers = np.array([[1.0, x, x**2, x**3], [0.0, 1.0, 2.0 * x, 3.0 * x**2], [0, 0, 2.0, 6.0 * x], [0, 0, 0, 6.0]])
        cubic = np.array([[1.0, 0, 0, 0], [0, length, 0, 0], [-3, -2 * length, 3, -length], [2, length, -2, length]])
        rates = powers @ cubic / length ** np.arange(4.0)[:, None]
        base = rates @ found.base[ends, :2].ravel()
        changes = rates[:3] @ found.ends[ends, :2].reshape(4, -1)
        slopes = np.zeros(N_LAW)
        _, by_d, by_v = law_at(base[0], base[1], h.law, slopes)
        return base, np.vstack([changes, by_d * changes[0] + by_v * changes[1] + self.change.law @ slopes])

    @cached_property
    def _late(self) -> float:
        """How much later than `peak` [s] the force is largest: one step of Newton's method."""
        return -_force_rate(self._at_peak[0][:3], self.history.law) / self._bend if self._bend else 0.0

    @cached_property
    def _bend(self) -> float:
        """Second rate of the force at its peak [N/s^2]; zero if the force is largest at an end of the blow."""
        if self.peak <= 0 or self.peak == len(self.time) - 1:
            return 0.0
        return self._slope(self._at_peak[0][1:], np.zeros(N_LAW))

    @cached_property
    def _rate_change(self) -> np.ndarray:
        """Change (n,) of the rate of the force at its peak."""
        return np.array([self._slope(each, law) for each, law in zip(self._at_peak[1][:3].T, self.change.law)])

    def _slope(self, along: np.ndarray, dlaw: np.ndarray) -> float:
        """Slope of the force's rate at its peak along changes (3,) of the approach and its rates, and of the law.

        By a central difference.
        """
        now = self._at_peak[0][:3]
        law, law_along = self.history.law, np.zeros(self.history.law.shape)
        width = min(len(dlaw), law.shape[1])
        law_along[0, :width] = dlaw[:width]
        scale = np.array([1.0, *self._fast]) * now[0]
        sizes = [np.abs(along / scale).max(), np.abs(law_along / np.where(law, law, 1.0)).max()]
        if not max(sizes):
            return 0.0
        step = NUDGE / max(sizes)
        high, low = (_force_rate(now + side * step * along, law + side * step * law_along) for side in (1.0, -1.0))
        return float((high - low) / (2.0 * step))

    @property
    def _fast(self) -> tuple[float, float]:
        """Largest rate and acceleration of the approach over the largest approach."""
        fastest = np.abs(self.found.base[:, 1:3]).max(axis=0) / self.deepest
        return float(fastest[0]), float(fastest[1])


def _alike(length: np.ndarray) -> np.ndarray:
    """Lengths (n,) of pieces, those equal but for rounding made equal: pieces of one length share their tables."""
    order = np.argsort(length)
    ascending = length[order]
    first = np.append(True, np.diff(ascending) > ALIKE * ascending[1:])[: len(length)]
    found = np.empty(len(length))
    found[order] = ascending[first][np.cumsum(first) - 1]
    return found


def _force_rate(state: np.ndarray, law: np.ndarray) -> float:
    """Rate [N/s] of the contact force at an approach and its first two rates, (3,)."""
    d, v, a = state.tolist()
    _, by_d, by_v = law_at(d, v, law, np.zeros(N_LAW))
    return by_d * v + by_v * a


def _peak(history: "History") -> float | None:
    """When the force is largest [s]."""
    if not history.impacts:
        return None
    rows = np.flatnonzero(history.pressed[:, 0])
    start, length = history.steps[rows, 0], history.steps[rows, 1]
    part = np.arange(LOOKS + 1) / LOOKS
    i, k = divmod(int(history.force(rows, 0, part).argmax()), LOOKS + 1)
    times = start[i] + np.array([-length[i - 1] if i else 0.0, 0.0, *(part[1:] * length[i]), 2.0 * length[i]])
    low, high = (times[1 + k] - length[i] / LOOKS), (times[1 + k] + length[i] / LOOKS)
    low, high = max(low, start[0]), min(high, start[-1] + length[-1])

    for _ in range(ROUNDS):
        near = np.linspace(low, high, LOOKS + 1)
        rate = history.force_at(near, 0)[1]
        falls = int(np.argmax((rate[:-1] > 0.0) & (rate[1:] <= 0.0)))
        if not rate[falls] > 0.0 >= rate[falls + 1]:
            return float(times[1 + k])
        low, high = float(near[falls]), float(near[falls + 1])
    return low + (high - low) * float(rate[falls] / (rate[falls] - rate[falls + 1]))


def _step_at(history: "History", time: float) -> tuple[float, float]:
    """Start and end [s] of the step that holds a time."""
    i = int(np.clip(np.searchsorted(history.steps[:, 0], time, side="right") - 1, 0, len(history.steps) - 1))
    ends = np.append(history.steps[:, 0], history.end_time)
    return float(ends[i]), float(ends[i + 1])


def _cut(history: "History", peak: float | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends of all pieces [s], (n_pieces + 1,); the step each lies in, and where in it each begins [-]."""
    steps, pressed = history.steps, history.pressed[:, 0]
    inside: list[set[float]] = [set() for _ in steps]

    def cut(time: float) -> None:
        i = int(np.clip(np.searchsorted(steps[:, 0], time, side="right") - 1, 0, len(steps) - 1))
        part = (time - steps[i, 0]) / steps[i, 1]
        inside[i].add(part)

    graded = GRADED if float(history.law[0, 1]) != 1.0 else ()
    for i in np.flatnonzero(pressed):
        if i == 0 or not pressed[i - 1]:
            inside[i].update(graded)
        if i + 1 == len(steps) or not pressed[i + 1]:
            inside[i].update(1.0 - part for part in graded)
    for impact in history.impacts:
        cut(impact.start)
        cut(impact.end)
    if peak is not None:
        cut(peak)
    time, row, part = [], [], []
    for k, fractions in enumerate(inside):
        least = EDGE + ROUNDING * history.end_time / steps[k, 1]
        begins = [0.0]
        for fraction in sorted(fractions):
            if begins[-1] + least < fraction < 1.0 - least:
                begins.append(fraction)
        for begin in begins:
            time.append(steps[k, 0] + begin * steps[k, 1])
            row.append(k)
            part.append(begin)
    time.append(history.end_time if len(steps) else 0.0)
    return np.array(time), np.array(row, int), np.array(part)
