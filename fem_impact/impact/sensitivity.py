"""What small changes of a blow's numbers do to it, to first order, from the record of one run."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING

import numpy as np

from .._base import check
from .._base.check import SimulationError
from .compiled import build, layout, record
from .compiled.tangents import N_LAW, Blow, Change, Found, Pieces, follow, law_at, rate_slopes

if TYPE_CHECKING:
    from .response import History

NODES = 3, 5  # [-] Gauss nodes per piece: for a force that is linear in each step, and for one of higher order
# [-] how often the first step of a contact is cut, each time to a quarter of the median step in contact, and mirrored
# the last, for a force that is linear in each step and for one of higher order, whose steps are long for their error:
# there the slope of a power law goes as (exponent - 1) powers of time, that in the exponent as its logarithm
GRADES = 3, 6
WHOLLY = 0.9  # [-] of such a step: what is left beyond goes to the last of them
NEAR = 4  # [-] steps from the start or end of a contact, per step that a piece may hold there
# [-] steps of a contact from which on pieces are of two steps, and of four; a lossy force rings with every mode
FULL = {False: (24, 128), True: (64, 128)}
BESIDE = 1e-4  # [-] of a step: distance of two rates of the force from which its peak is told; leaves 1e-12 of the step
NUDGE = 1e-5  # [-] relative change at which the curvature of a contact law is taken; leaves 1e-10
MORE = 2  # [-] Gauss nodes beyond those of the force, and three per radian of half the phase over a piece: err by 1e-9
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


@cache
def shares(count: int) -> np.ndarray:
    """Weights (count,) of these nodes, which sum to one."""
    return np.asarray(0.5 * np.polynomial.legendre.leggauss(count)[1])


@cache
def moments_kept(count: int, steps: int) -> np.ndarray:
    """Matrix (count * steps, count) from values at the nodes of some equal steps to those at the nodes of all together.

    The polynomial through the latter has the moments of the former.
    """
    nodes, order = gauss(count)[0][:-1], np.arange(count)
    places = ((np.arange(steps)[:, None] + nodes) / steps).ravel()
    here, there = (np.polynomial.legendre.legvander(2.0 * x - 1.0, count - 1) for x in (nodes, places))
    return np.asarray(np.tile(shares(count) / steps, steps)[:, None] * there @ (here * (2.0 * order + 1.0)).T)


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
    peak: float  # [s] when the force is largest, nearly; NaN if it is not wanted
    apart: float  # [-] how much smaller the next of its maxima is

    def __repr__(self) -> str:
        return check.brief(self)

    @classmethod
    def of(
        cls, history: "History", change: Change, peak: bool = True, together: int = 1, coarse: bool = False
    ) -> "Sensitivity":
        """Follow the record; raises SimulationError where it passed over contacts without locating them.

        ``peak`` says whether the largest force is wanted; up to ``together`` steps make one piece, see `together`. A
        ``coarse`` record is cut once less where a contact starts and ends: two runs may share their first steps, and
        the error made there would not show in their difference.
        """
        if history.n_blind:
            raise SimulationError(
                "no gradient: the bodies chatter, and the run passed over contacts without locating them; give "
                "max_impacts, a shorter duration or no dt"
            )
        top, apart = _peak(history) if peak else (np.nan, np.inf)
        smooth = history.n_coefficients > 2
        if smooth and not np.isnan(top):
            top = _sharper(history, top)
        wanted = [when for each in history.impacts for when in (each.start, each.end)]
        marked = [] if np.isnan(top) else [top] if smooth else list(_step_at(history, top))
        bent = float(history.law[0, layout.EXPONENT]) != 1.0 or change.law[:, layout.EXPONENT].any()
        grades = 4.0 ** -np.arange(GRADES[smooth] - coarse, 0.0, -1.0) if bent else np.zeros(0)
        time, row, part, count = _cut(history, [*wanted, *marked], grades, together)
        wanted = [0.0, *wanted, *marked, time[-1]]
        nodes, powers = gauss(NODES[int(smooth)])
        n, n_modes, s = len(change.offset), len(history.omega), len(powers)
        marks = sorted({_nearest(time, when) for when in wanted})
        mark = np.full(len(time), -1)
        mark[marks] = np.arange(len(marks))
        length, closed = _alike(np.diff(time)), history.pressed[row, 0]
        pieces = Pieces(length, closed, _recorded(history, row, part, count, length, nodes[:-1]), mark, nodes, powers)
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
        told = cls(history, change, time, pieces, found, top, apart)
        return told if smooth or np.isnan(top) or history.law[0, layout.LOSS] else replace(told, peak=told._summit())

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
        k = _nearest(self.time, time)
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
        if k == 0 or (k == len(self.time) - 1 and self.history.status == record.HORIZON):
            return still
        loss = self.history.law[0, layout.LOSS]
        if abs(d) < abs(1.0 + loss * v) * self.deepest:
            return -dd / v
        return -(self.change.law[:, layout.LOSS] * v + loss * dv) / (loss * a)

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
        """Change (n_frequencies, n) of the force's Fourier transform [N s], for few frequencies."""
        time, force = self._impulses(float(np.abs(frequencies).max(initial=0.0)), self.found.force)
        return np.exp(-2j * np.pi * frequencies[:, None] * time) @ force

    def even_spectrum(self, count: int, step: float) -> "EvenSpectrum":
        """Transform of the force and its changes at 0, step, 2 step, ... [Hz], so many frequencies."""
        time, force = self._impulses(step * count, np.concatenate([self.pieces.force[..., None], self.found.force], 2))
        return EvenSpectrum(count, *_turns(count, step, time), force)

    def _impulses(self, highest: float, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Times (m,) [s] and impulses there (m, n) with the same spectrum up to a frequency [Hz] as forces.

        The forces (n_pieces, s, n) [N] are those at the nodes.
        """
        pieces = self.pieces
        phase = np.pi * highest * pieces.length[pieces.closed].max(initial=0.0)
        rule = len(pieces.powers) + MORE + int(3.0 * phase)
        nodes = gauss(rule)[0][:-1]
        basis = np.vander(nodes, len(pieces.powers), increasing=True) @ pieces.powers.T  # (rule, s)
        length = pieces.length[pieces.closed, None]
        time = (self.time[:-1][pieces.closed, None] + nodes * length).ravel()
        values = basis @ force[pieces.closed] * (shares(rule) * length)[:, :, None]
        return time, values.reshape(len(time), -1)

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
        if np.isnan(self.peak):
            return np.zeros(len(self.change.offset))
        return self._at_peak[1][3] + self._rate_change * self._late

    @property
    def peak_time(self) -> np.ndarray:
        """Change (n,) of the time of the largest force [s]."""
        return np.zeros(len(self.change.offset)) if not self._bend else -self._rate_change / self._bend

    @property
    def when_largest(self) -> float:
        """Time of the largest force [s]."""
        return float(self.peak + self._late)

    @property
    def largest(self) -> float:
        """Largest force [N]."""
        d, v = self._at_peak[0][:2]
        return float(law_at(float(d), float(v), self.history.law, np.zeros(N_LAW))[0])

    @cached_property
    def _at_peak(self) -> tuple[np.ndarray, np.ndarray]:
        """Approach and its first three rates (4,) at the peak; changes (4, n) of the first three, and of the force.

        A force that is linear in each step jumps between two, and the accelerations with it. There the approach is the
        polynomial through both ends of the step: the quintic or, under a loss, whose rates ring, the cubic, as in the
        force that the peak was found in.
        """
        if self.history.n_coefficients > 2:
            at = self.pieces.mark[_nearest(self.time, self.peak)]
            return self.found.base[at, :4], self.found.ends[at]
        return self._through_ends(2 if self.history.law[0, layout.LOSS] else 3)

    def _summit(self) -> float:
        """When the quintic through the ends of the step with the peak turns back [s], which it was not found by."""
        start, end, ends = self._peak_step
        inside = (self.peak - start) / (end - start)
        powers = hermite(3) @ (np.tile((end - start) ** np.arange(3.0), 2) * self.found.base[ends, :3].ravel())
        for _ in range(2):
            _, rate, bend, _ = derivatives(inside, 6) @ powers
            inside -= rate / bend if bend < 0.0 else 0.0
        return start + inside * (end - start) if 0.0 < inside < 1.0 else self.peak

    @property
    def _peak_step(self) -> tuple[float, float, np.ndarray]:
        """Start and end [s] of the step with the largest force, and the marks there."""
        start, end = _step_at(self.history, self.peak)
        return start, end, self.pieces.mark[[_nearest(self.time, start), _nearest(self.time, end)]]

    def _through_ends(self, n_rates: int) -> tuple[np.ndarray, np.ndarray]:
        """The same at the peak by the polynomial with the approach and rates, so many in all, at the ends of a step."""
        start, end, ends = self._peak_step
        scale = (end - start) ** np.arange(4.0)
        at_ends = np.tile(scale[:n_rates], 2)
        inside = (self.peak - start) / (end - start)
        rates = derivatives(inside, 2 * n_rates) @ hermite(n_rates) * at_ends / scale[:, None]
        base = rates @ self.found.base[ends, :n_rates].ravel()
        changes = rates[:3] @ self.found.ends[ends, :n_rates].reshape(2 * n_rates, -1)
        slopes = np.zeros(N_LAW)
        _, by_d, by_v = law_at(base[0], base[1], self.history.law, slopes)
        return base, np.vstack([changes, by_d * changes[0] + by_v * changes[1] + self.change.law @ slopes])

    @property
    def peak_doubt(self) -> np.ndarray:
        """How far the cubic and the quintic through the peak disagree on the change (n,) of its time [s].

        Zero unless a lossy force rings within its steps.
        """
        if np.isnan(self.peak) or self.history.n_coefficients > 2 or not self.history.law[0, layout.LOSS]:
            return np.zeros(len(self.change.offset))
        other = replace(self)
        other.__dict__["_at_peak"] = self._through_ends(3)
        return np.asarray(np.abs(other.peak_time - self.peak_time))

    @cached_property
    def _late(self) -> float:
        """How much later than `peak` [s] the force is largest: one step of Newton's method."""
        return -self._turning[0] / self._bend if self._bend else 0.0

    @property
    def _bend(self) -> float:
        """Second rate of the force at its peak [N/s^2]; zero if the force is largest at an end of the blow."""
        return float(self._turning[1]) if EDGE < self.peak / self.time[-1] < 1.0 - EDGE else 0.0

    @property
    def _rate_change(self) -> np.ndarray:
        """Change (n,) of the rate of the force at its peak."""
        law = self.change.law
        return np.asarray(self._turning[2:5] @ self._at_peak[1][:3] + law @ self._turning[5:])

    @cached_property
    def _turning(self) -> np.ndarray:
        """Rate of the force at its peak [N/s], and its slopes along the motion, in the approach and its first two rates
        and in the numbers of the law, (5 + N_LAW,); by central differences.
        """
        now, law = self._at_peak[0], self.history.law
        along = np.zeros((4 + N_LAW, 3 + N_LAW))
        along[0, :3] = now[1:]
        used = np.flatnonzero(self.change.law.any(axis=0))
        along[np.arange(1, 4), np.arange(3)] = 1.0
        along[4 + used, 3 + used] = 1.0
        width = min(N_LAW, law.shape[1])
        scale = np.ones(3 + N_LAW)
        scale[:3] = np.array([1.0, *self._fast]) * now[0]
        scale[3 : 3 + width] = np.where(law[0, :width], law[0, :width], 1.0)
        sizes = np.abs(along / scale).max(axis=1)
        found = np.empty(5 + N_LAW)
        rate_slopes(now[:3], law, along * (NUDGE / np.where(sizes, sizes, 1.0))[:, None], found)
        found[1:] *= sizes / NUDGE
        return found

    @property
    def _fast(self) -> tuple[float, float]:
        """Largest rate and acceleration of the approach over the largest approach."""
        fastest = np.abs(self.found.base[:, 1:3]).max(axis=0) / self.deepest
        return float(fastest[0]), float(fastest[1])


@dataclass(frozen=True, eq=False)
class EvenSpectrum:
    """Fourier transform of a recorded force and of its changes at equally spaced frequencies from zero on.

    A sum over frequencies or times is a product of matrices, as the frequency k = a K + b turns by two factors.
    """

    count: int  # of frequencies
    few: np.ndarray  # (K, m) factors of b at each time, see `_turns`
    many: np.ndarray  # (K, m) of a
    impulses: np.ndarray  # (m, 1 + n) [N s] of the force, and their changes

    def __repr__(self) -> str:
        return check.brief(self)

    @property
    def value(self) -> np.ndarray:
        """Transform of the force itself, (count,) [N s]."""
        return ((self.many * self.impulses[:, 0]) @ self.few.T).ravel()[: self.count]

    def change(self, weights: np.ndarray) -> np.ndarray:
        """Change (n,) of the real part of the sum of the transform times weights (count,)."""
        table = np.zeros(len(self.few) ** 2, complex)
        table[: self.count] = weights
        summed = np.real((self.many * (table.reshape(len(self.few), -1) @ self.few)).sum(axis=0))
        return np.asarray(summed @ self.impulses[:, 1:])


def derivatives(x: float, count: int) -> np.ndarray:
    """Value and first three derivatives at x of the first powers of x, (4, count)."""
    order, power = np.arange(4)[:, None], np.arange(count)
    rows = [np.ones(count)]
    for k in range(3):
        rows.append(rows[-1] * np.maximum(power - k, 0))
    return np.stack(rows) * float(x) ** np.maximum(power - order, 0)


@cache
def hermite(n_rates: int) -> np.ndarray:
    """Coefficients by values and further rates, so many in all, at 0 and then at 1, (2 n_rates, 2 n_rates)."""
    return np.linalg.inv(np.vstack([derivatives(x, 2 * n_rates)[:n_rates] for x in (0.0, 1.0)]))


def _turns(count: int, step: float, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Factors exp(-2 pi i f t) at b step and at a K step [Hz], a, b < K, (K, n_times) each, K * K not below count."""
    size = int(np.ceil(np.sqrt(count)))
    few, many = np.ones((2, size, len(time)), complex)
    for table, stride in ((few, 1), (many, size)):
        table[1:2] = np.exp(-2j * np.pi * step * stride * time)
        done = 2
        while done < size:  # powers as products of two, which is faster than exponentials
            more = min(done - 1, size - done)
            np.multiply(table[1 : more + 1], table[done - 1], out=table[done : done + more])
            done += more
    return few, many


def _nearest(times: np.ndarray, time: float) -> int:
    """Index of the one of some ascending times next to a time."""
    k = int(np.searchsorted(times, time))
    return k - 1 if k == len(times) or (k > 0 and time - times[k - 1] <= times[k] - time) else k


def _alike(length: np.ndarray) -> np.ndarray:
    """Lengths (n,) of pieces, those equal but for rounding made equal: pieces of one length share their tables."""
    order = np.argsort(length)
    ascending = length[order]
    first = np.append(True, np.diff(ascending) > ALIKE * ascending[1:])[: len(length)]
    found = np.empty(len(length))
    found[order] = ascending[first][np.cumsum(first) - 1]
    return found


def _peak(history: "History") -> tuple[float, float]:
    """When the force is largest [s], and by how much it exceeds the next of its maxima [-]; NaN without impacts."""
    if not history.impacts:
        return np.nan, np.inf
    time, top, rival = record.largest_force(history.steps, history.now, history.law, history.n_coefficients, build.ZERO)
    return time, (top - rival) / top if top > 0.0 else np.inf


def _sharper(history: "History", time: float) -> float:
    """When the force is largest [s] by the motion itself, from a time nearby.

    The force of a long step is a polynomial through its nodes, whose largest value is a little beside that of the law.
    """
    start, end = _step_at(history, time)
    shape, omega, zeta, beside = history.shape[0], history.omega, history.zeta, BESIDE * (end - start)
    best = time
    for _ in range(2):
        rates = np.empty(2)
        for i, (q, p) in enumerate(zip(*history.states(np.array([best, best + beside])))):
            d, v = float(history.offset[0] + shape @ q), float(shape @ p)
            force, by_d, by_v = law_at(d, v, history.law, np.zeros(N_LAW))
            rates[i] = by_d * v + by_v * (shape @ (history.bias - shape * force - omega * (2.0 * zeta * p + omega * q)))
        later = best - rates[0] * beside / (rates[1] - rates[0]) if rates[1] < rates[0] else best
        if not start < later < end:
            return time
        best = float(later)
    return best


def _step_at(history: "History", time: float) -> tuple[float, float]:
    """Start and end [s] of the step that holds a time."""
    i = int(np.clip(np.searchsorted(history.steps[:, layout.START], time, side="right") - 1, 0, len(history.steps) - 1))
    ends = np.append(history.steps[:, layout.START], history.end_time)
    return float(ends[i]), float(ends[i + 1])


def together(history: "History") -> int:
    """How many steps of equal length inside a contact may make one piece.

    The changes are polynomials of higher order than the force of the record, and need fewer pieces. None are put
    together where a step's force is of high order itself.
    """
    per_impact = history.pressed[:, 0].sum() / max(1, len(history.impacts))
    lossy = bool(history.law[0, layout.LOSS])
    return 1 if history.n_coefficients > 2 else 2 ** sum(per_impact >= least for least in FULL[lossy])


def _recorded(
    history: "History", row: np.ndarray, part: np.ndarray, count: np.ndarray, length: np.ndarray, nodes: np.ndarray
) -> np.ndarray:
    """Recorded force at the nodes of all pieces, (n_pieces, s) [N].

    That of several steps is the polynomial through the nodes with the same moments as theirs.
    """
    s = len(nodes)
    force = np.zeros((len(row), s))
    for n in np.unique(count):
        own = np.flatnonzero((count == n) & history.pressed[row, 0])
        steps = row[own, None] + np.arange(n)
        share = length[own, None] / history.steps[row[own], 1:2] if n == 1 else np.ones((len(own), 1))
        within = part[own, None, None] + share[:, :, None] * nodes  # (n_own, 1, s), the same for all steps of a piece
        each = np.zeros((len(own), n, s))
        for k in range(history.n_coefficients)[::-1]:
            each = each * within + history.steps[steps, layout.HEAD + layout.PUSH + k][:, :, None]
        force[own] = each.reshape(len(own), -1) @ moments_kept(s, int(n))
    return force


def _cut(
    history: "History", times: Sequence[float], grades: np.ndarray, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Ends of all pieces [s], (n_pieces + 1,), the step each begins in, where in it [-], and of how many steps it is.

    A piece begins at each of some times and ``grades`` of the median step from where a contact starts or ends; up to
    ``most`` steps make one.
    """
    steps, pressed = history.steps, history.pressed[:, 0]
    if not len(steps):
        return np.zeros(1), np.zeros(0, int), np.zeros(0), np.zeros(0, int)
    inside: defaultdict[int, set[float]] = defaultdict(set)
    places = np.clip(np.searchsorted(steps[:, layout.START], times, side="right") - 1, 0, len(steps) - 1)
    for i, when in zip(places.tolist(), times):
        inside[i].add(float((when - steps[i, layout.START]) / steps[i, layout.LENGTH]))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], pressed, [False]]).astype(int)))
    if len(edges) and len(grades):
        grades = grades * float(np.median(steps[pressed, layout.LENGTH]))
        for first, last in zip(edges[::2].tolist(), (edges[1::2] - 1).tolist()):
            inside[first].update(part for part in (grades / steps[first, layout.LENGTH]).tolist() if part < WHOLLY)
            inside[last].update(1.0 - part for part in (grades / steps[last, layout.LENGTH]).tolist() if part < WHOLLY)
    begins, rows = [np.zeros(len(steps))], [np.arange(len(steps))]
    for k, fractions in inside.items():
        least = EDGE + ROUNDING * history.end_time / steps[k, layout.LENGTH]
        kept = [0.0]
        for fraction in sorted(fractions):
            if kept[-1] + least < fraction < 1.0 - least:
                kept.append(fraction)
        begins.append(np.array(kept[1:]))
        rows.append(np.full(len(kept) - 1, k))
    row, part = np.concatenate(rows), np.concatenate(begins)
    order = np.lexsort((part, row))
    row, part = row[order], part[order]
    count = np.ones(len(row), int)
    if most > 1:
        row, part, count = _joined(history, row, part, edges, inside, most)
    return np.append(steps[row, layout.START] + part * steps[row, layout.LENGTH], history.end_time), row, part, count


def _joined(
    history: "History", row: np.ndarray, part: np.ndarray, edges: np.ndarray, cut: Iterable[int], most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pieces of one step or a part of it put together, except those of cut steps; what `_cut` returns of them.

    The fewer, the nearer the start or end of a contact, where slopes of the force change fast.
    """
    length, number = history.steps[:, layout.LENGTH], np.arange(len(history.steps))
    far = np.abs(number[:, None] - edges).min(axis=1, initial=len(number)) // NEAR
    most_here = np.where(history.pressed[:, 0], np.minimum(most, far), 0)
    most_here[list(cut)] = 0
    new = np.append(True, np.abs(np.diff(length)) > ALIKE * length[1:])
    kept, count = [0], [1]
    for j in range(1, len(row)):
        one, other = row[kept[-1]], row[j]
        if count[-1] < min(most_here[one], most_here[other]) and not new[other]:
            count[-1] += 1
        else:
            kept.append(j)
            count.append(1)
    return row[kept], part[kept], np.array(count)
