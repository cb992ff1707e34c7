"""What small changes of a blow's numbers do to it, to first order, from the record of one run."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from .._base import check
from .._base.check import SimulationError
from .._base.rounding import ROUNDING, SAME
from .compiled import layout, record
from .compiled.law import PLASTIC
from .compiled.tangents import N_LAW, Blow, Change, Found, Pieces, follow, law_at, rate_slopes

if TYPE_CHECKING:
    from .response import History

# [-] Gauss nodes per piece: exact to degree 5 for a force linear in each step, to 9 for one of higher order
NODES = 3, 5
# [-] how often the first step of a contact is cut, each time to a quarter of the median step in contact, and mirrored
# the last, for a force that is linear in each step and for one of higher order, whose steps are long for their error:
# there the slope of a power law goes as (exponent - 1) powers of time, that in the exponent as its logarithm
GRADES = 3, 6
# [-] steps from the start or end of a contact, per step that a piece may hold there: pieces grow away from the kinks
NEAR = 4
# [-] steps of a contact from which on pieces are of two steps, and of four; a lossy force rings with every mode
FULL = {False: (24, 128), True: (64, 128)}
# [-] relative change at which the curvature of a contact law is taken, and of a step at which that of the force is:
# leaves 1e-10
NUDGE = 1e-5
# [-] of the deepest approach: what is nearer starts or ends at zero, as the dip under a constant force is known to
# 1e-9; a contact that ends deeper lets go by its loss
AT_ZERO = 1e-7


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
    m = history.n_contacts
    omega, zeta, bias, start_q, start_p = np.zeros((5, n, len(history.omega)))
    shape = np.zeros((n, m, len(history.omega)))
    return Change(omega, zeta, shape, bias, start_q, start_p, np.zeros((n, m)), np.zeros((n, m, N_LAW)))


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """A recorded blow, followed with its changes per unit of n parameters."""

    history: "History"
    change: Change
    time: np.ndarray  # (n_pieces + 1,) [s] ends of the pieces
    pieces: Pieces
    found: Found
    peak: float  # [s] when the force is largest, nearly; NaN if it is not wanted
    apart: float  # [-] how much smaller the next of the maxima is
    pressed_most: int = 0  # the contact whose force is largest

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
        top, apart, most = _peak(history) if peak else (np.nan, np.inf, 0)
        smooth = history.n_coefficients > 2
        if smooth and not np.isnan(top):
            top = _sharper(history, top, most)
        wanted = [when for each in history.impacts for when in (each.start, each.end)]
        marked = [] if np.isnan(top) else [top] if smooth else list(_step_at(history, top))
        bent = (history.law[:, layout.EXPONENT] != 1.0).any() or change.law[:, :, layout.EXPONENT].any()
        grades = 4.0 ** -np.arange(GRADES[smooth] - coarse, 0.0, -1.0) if bent else np.zeros(0)
        memory, yields = remembered(history)
        time, row, part, count = _cut(history, [*wanted, *marked], grades, together, yields[:-1])
        wanted = [0.0, *wanted, *marked, time[-1]]
        nodes, powers = gauss(NODES[int(smooth)])
        n, n_modes, m, s = len(change.offset), len(history.omega), history.n_contacts, len(powers)
        marks = sorted({_nearest(time, when) for when in wanted})
        mark = np.full(len(time), -1)
        mark[marks] = np.arange(len(marks))
        length, closed = _alike(np.diff(time)), history.pressed[row]
        forces = _recorded(history, row, part, count, length, nodes[:-1])
        kept = np.append(row, len(memory) - 1)
        pieces = Pieces(length, closed, forces, memory[kept], yields[kept], mark, nodes, powers)
        found = Found(
            np.zeros((len(time), m, 2)), np.zeros((len(marks), m, 5)), np.zeros((len(marks), m, 4, n)),
            np.zeros((len(marks), m, 1 + n)), np.zeros((len(length), m, s, n)),
            np.zeros((n, n_modes)), np.zeros((n, n_modes)),
        )  # fmt: skip
        blow = Blow(
            history.omega, history.zeta, history.shape, history.bias, history.start_q, history.start_p,
            history.offset, history.law,
        )  # fmt: skip
        follow(blow, change, pieces, found)
        told = cls(history, change, time, pieces, found, top, apart, most)
        return told if smooth or np.isnan(top) or told._law[0, layout.LOSS] else replace(told, peak=told._turned())

    @cached_property
    def deepest(self) -> np.ndarray:
        """Largest approach of each contact in the blow [m], (n_contacts,)."""
        return np.asarray(self.found.way[:, :, 0].max(axis=0, initial=0.0))

    @cached_property
    def events(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """Changes (n,) of start and end of every impact, per unit [s]."""
        return tuple(
            (self._moved(each.start, each.contact), self._moved(each.end, each.contact))
            for each in self.history.impacts
        )

    def _moved(self, time: float, c: int) -> np.ndarray:
        """Change of an onset or release of contact c."""
        k = _nearest(self.time, time)
        mark = self.pieces.mark[k]
        d, v, a = self.found.base[mark, c, :3] - [self.found.dents[mark, c, 0], 0.0, 0.0]
        dd, dv = self.found.ends[mark, c, :2] - [self.found.dents[mark, c, 1:], np.zeros(len(self.change.offset))]
        still = np.zeros(dd.shape)
        near = abs(d) <= AT_ZERO * self.deepest[c]
        resting = abs(v) <= ROUNDING * np.abs(self.found.way[:, :, 1]).max()
        if k == 0 or (near and resting):
            h = self.history
            drift = self._start_terms(c, h.start_p, self.change.start_p)
            way = self._start_terms(c, h.start_q, self.change.start_q) + time * drift
            parts = (np.abs(dd) > ROUNDING * way).any() or (resting and (np.abs(dv) > ROUNDING * drift).any())
            if near and parts:
                raise SimulationError(
                    "no gradient: the bodies touch at the start already, and a change would press or part them; "
                    "give a gap"
                )
            pushes = (each.contact for each in h.impacts if each.start == time and each.approach_speed)
            other = c if k == 0 else next(pushes, c)
            return still if other == c else self._moved(time, other)
        if near:
            return -dd / v
        if k == 0 or (k == len(self.time) - 1 and self.history.status == record.HORIZON):
            return still
        if k == len(self.time) - 1 and c in self._cut_off:
            return self.end
        loss = self.history.law[c, layout.LOSS]
        if abs(d) < abs(1.0 + loss * v) * self.deepest[c]:
            return -dd / v
        return -(self.change.law[:, c, layout.LOSS] * v + loss * dv) / (loss * a)

    @cached_property
    def _last(self) -> int:
        """The contact whose release ended the run, the one that presses least at the end."""
        at, h = self.found.base[self.pieces.mark[-1]], self.history
        parting = np.minimum(np.abs(at[:, 0] / self.deepest), np.abs(1.0 + h.law[:, layout.LOSS] * at[:, 1]))
        return int(np.where(h.pressed[-1], parting, np.inf).argmin())

    @cached_property
    def _cut_off(self) -> np.ndarray:
        """Contacts (n,) that still press where the run ends with the release of another."""
        if self.history.n_contacts == 1 or self.history.status != record.IMPACTS:
            return np.zeros(0, int)
        return np.array([c for c in np.flatnonzero(self.history.pressed[-1]) if c != self._last], int)

    def _start_terms(self, c: int, start: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Sum (n,) of the sizes of what changes approach c at the start, or its rate; all that may cancel."""
        by_shape = np.abs(self.change.shape[:, c]) @ np.abs(start)
        return np.asarray(by_shape + np.abs(change) @ np.abs(self.history.shape[c]))

    @cached_property
    def end(self) -> np.ndarray:
        """Change (n,) of the end of the run [s]; a run that was given a duration keeps it."""
        if self.history.status == record.HORIZON or not self.history.impacts:
            return np.zeros(len(self.change.offset))
        last = max(self.history.impacts, key=lambda each: each.end)
        at_end = _nearest(self.time, last.end) == len(self.time) - 1
        return self._moved(last.end, self._last if at_end else last.contact)

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
        """Change (n,) of the impulse of all contacts [N s]."""
        return np.einsum("jb,jcbi->i", self.weights, self.found.force) + self._end_impulse

    @property
    def _end_impulse(self) -> np.ndarray:
        """Change (n,) of the impulse [N s] as the end of the run moves."""
        if not len(self._cut_off):
            return np.zeros(len(self.change.offset))
        return np.asarray(self.found.base[self.pieces.mark[-1], self._cut_off, 4].sum() * self.end)

    def spectrum(self, frequencies: np.ndarray) -> np.ndarray:
        """Change (n_frequencies, n) of the Fourier transform of all forces together [N s], for few frequencies."""
        time, force = self._impulses(float(np.abs(frequencies).max(initial=0.0)), self.found.force.sum(axis=1))
        return np.exp(-2j * np.pi * frequencies[:, None] * time) @ force

    def even_spectrum(self, count: int, step: float) -> "EvenSpectrum":
        """Transform of the force and its changes at 0, step, 2 step, ... [Hz], so many frequencies."""
        both = np.concatenate([self.pieces.force[..., None], self.found.force], axis=3)
        time, force = self._impulses(step * count, both.sum(axis=1))
        return EvenSpectrum(count, *_turns(count, step, time), force)

    def _impulses(self, highest: float, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Times (m,) [s] and impulses there (m, n) with the same spectrum up to a frequency [Hz] as forces.

        The forces (n_pieces, s, n) [N] are those at the nodes.
        """
        pieces, closed = self.pieces, self.pieces.closed.any(axis=1)
        phase = np.pi * highest * pieces.length[closed].max(initial=0.0)
        rule = len(pieces.powers) + int(np.ceil(3.0 * phase))  # errs by 2e-10 at most
        nodes = gauss(rule)[0][:-1]
        basis = np.vander(nodes, len(pieces.powers), increasing=True) @ pieces.powers.T  # (rule, s)
        length = pieces.length[closed, None]
        time = (self.time[:-1][closed, None] + nodes * length).ravel()
        values = (basis @ force[closed] * (shares(rule) * length)[:, :, None]).reshape(len(time), -1)
        if not len(self._cut_off):
            return time, values
        at_end = np.append(np.zeros(values.shape[1] - len(self.end)), self._end_impulse)
        return np.append(time, self.time[-1]), np.vstack([values, at_end])

    @property
    def end_speeds(self) -> np.ndarray:
        """Change (n_modes, n) of the modal velocities at the end of the run, which moves."""
        h, found = self.history, self.found
        rate = h.bias - h.omega * (2.0 * h.zeta * h.end_p + h.omega * h.end_q)
        return (found.dp + rate * self.end[:, None]).T

    def speed(self, modes: np.ndarray, c: int) -> np.ndarray:
        """Change (n,) of the final speed [m/s] of the point of contact c in some modes."""
        u, p = self.history.shape[c, modes], self.history.end_p[modes]
        return np.asarray(self.change.shape[:, c, modes] @ p + u @ self.end_speeds[modes])

    def rebound(self, rigid: np.ndarray, contacts: Sequence[int]) -> tuple[float, np.ndarray, np.ndarray]:
        """Speed [m/s] of a body under constant forces before its impacts, and the changes (n,) of it and of that after.

        It is that of the point of the first of its contacts in its rigid motions.
        """
        h, change, c = self.history, self.change, contacts[0]
        u, bias = h.shape[c, rigid], h.bias[rigid]
        pull, pulls = float(u @ bias), change.shape[:, c, rigid] @ bias + change.bias[:, rigid] @ u  # [m/s^2]
        mine = [(each, *moved) for each, moved in zip(h.impacts, self.events) if each.contact in contacts]
        first, sooner, _ = min(mine, key=lambda row: row[0].start)
        last, _, later = max(mine, key=lambda row: row[0].end)
        before = change.shape[:, c, rigid] @ h.start_p[rigid] + change.start_p[:, rigid] @ u
        after = self.speed(rigid, c) - pulls * (h.end_time - last.end) - pull * (self.end - later)
        speed = float(u @ h.start_p[rigid]) + pull * first.start
        return speed, before + pulls * first.start + pull * sooner, after

    def energies(self, modes: slice) -> np.ndarray:
        """Change (n_modes, n) of the energy left in each of some modes at the end [J]."""
        omega, q, p = (each[modes] for each in (self.history.omega, self.history.end_q, self.history.end_p))
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
        top = self._top
        return np.asarray(top.changes[3] + top.rate_change * top.late + (0.0 if top.bend else top.rate * self._edge))

    @property
    def peak_time(self) -> np.ndarray:
        """Change (n,) of the time of the largest force [s]."""
        return self._top.moved if self._top.bend else self._edge

    @property
    def _edge(self) -> np.ndarray:
        """Change (n,) of the time of a peak at the start or end of the run [s]."""
        at_end = self.peak > 0.5 * self.time[-1] and len(self._cut_off) > 0
        return self.end if at_end else np.zeros(len(self.change.offset))

    @property
    def when_largest(self) -> float:
        """Time of the largest force [s]."""
        return float(self.peak + self._top.late)

    @property
    def largest(self) -> float:
        """Largest force [N]."""
        d, v = self._top.now[:2]
        return float(law_at(float(d), float(v), self._law, 0.0, self._yields, np.zeros(N_LAW))[0])

    @property
    def peak_doubt(self) -> np.ndarray:
        """How far the cubic and the quintic through the peak disagree on the change (n,) of its time [s].

        Zero unless a lossy force rings within its steps.
        """
        if np.isnan(self.peak) or self.history.n_coefficients > 2 or not self._law[0, layout.LOSS]:
            return np.zeros(len(self.change.offset))
        return np.abs(self._summit(*self._through_ends(3)).moved - self.peak_time)

    @property
    def _law(self) -> np.ndarray:
        """The law of the contact whose force is largest, (1, 9 or 4)."""
        return self.history.law[self.pressed_most : self.pressed_most + 1]

    @property
    def _yields(self) -> bool:
        """Whether that contact yields at its largest force: as it last turned back, if it ever yielded."""
        return bool(self.pieces.yields[:, self.pressed_most].any())

    @cached_property
    def _top(self) -> "Summit":
        """The blow at its largest force.

        A force that is linear in each step jumps between two, and the accelerations with it. There the approach is the
        polynomial through both ends of the step: the quintic or, under a loss, whose rates ring, the cubic, as in the
        force that the peak was found in.
        """
        if self.history.n_coefficients > 2:
            at = self.pieces.mark[_nearest(self.time, self.peak)], self.pressed_most
            return self._summit(self.found.base[at][:4], self.found.ends[at])
        return self._summit(*self._through_ends(2 if self._law[0, layout.LOSS] else 3))

    def _turned(self) -> float:
        """When the quintic through the ends of the step with the peak turns back [s], which it was not found by."""
        start, end, ends = self._peak_step
        inside = (self.peak - start) / (end - start)
        at_ends = self.found.base[ends, self.pressed_most, :3].ravel()
        powers = hermite(3) @ (np.tile((end - start) ** np.arange(3.0), 2) * at_ends)
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
        """The motion at the peak and its changes, see `Summit`, by the polynomial with the approach and its rates, so
        many in all, at the ends of a step.
        """
        (start, end, ends), c = self._peak_step, self.pressed_most
        scale = (end - start) ** np.arange(4.0)
        at_ends = np.tile(scale[:n_rates], 2)
        inside = (self.peak - start) / (end - start)
        rates = derivatives(inside, 2 * n_rates) @ hermite(n_rates) * at_ends / scale[:, None]
        base = rates @ self.found.base[ends, c, :n_rates].ravel()
        changes = rates[:3] @ self.found.ends[ends, c, :n_rates].reshape(2 * n_rates, -1)
        slopes = np.zeros(N_LAW)
        _, by_d, by_v, _ = law_at(base[0], base[1], self._law, 0.0, self._yields, slopes)
        return base, np.vstack([changes, by_d * changes[0] + by_v * changes[1] + self.change.law[:, c] @ slopes])

    def _summit(self, now: np.ndarray, changes: np.ndarray) -> "Summit":
        """The blow at its largest force, where this is the motion; by central differences of the law."""
        c = self.pressed_most
        law, law_change = self._law, self.change.law[:, c]
        along = np.zeros((4 + N_LAW, 3 + N_LAW))
        along[0, :3] = now[1:]
        used = np.flatnonzero(law_change.any(axis=0))
        along[np.arange(1, 4), np.arange(3)] = 1.0
        along[4 + used, 3 + used] = 1.0
        width = min(N_LAW, law.shape[1])
        scale = np.ones(3 + N_LAW)
        fastest = np.abs(self.found.base[:, c, 1:3]).max(axis=0) / self.deepest[c]
        scale[:3] = np.append(1.0, fastest) * now[0]
        scale[3 : 3 + width] = np.where(law[0, :width], law[0, :width], 1.0)
        sizes = np.abs(along / scale).max(axis=1)
        turning = np.empty(5 + N_LAW)
        rate_slopes(now[:3], law, self._yields, along * (NUDGE / np.where(sizes, sizes, 1.0))[:, None], turning)
        turning[1:] *= sizes / NUDGE
        bend = float(turning[1]) if SAME < self.peak / self.time[-1] < 1.0 - SAME else 0.0
        return Summit(now, changes, float(turning[0]), bend, turning[2:5] @ changes[:3] + law_change @ turning[5:])


@dataclass(frozen=True, eq=False)
class Summit:
    """The motion where a force is largest, or nearly, and what small changes do to the force there."""

    now: np.ndarray  # (4,) approach and its first three rates
    changes: np.ndarray  # (4, n) changes of the first three, and of the force
    rate: float  # [N/s] of the force
    bend: float  # [N/s^2] its second rate; zero if the force is largest at an end of the blow
    rate_change: np.ndarray  # (n,) change of the rate

    def __repr__(self) -> str:
        return check.brief(self)

    @property
    def late(self) -> float:
        """How much later [s] the force is largest: one step of Newton's method."""
        return -self.rate / self.bend if self.bend else 0.0

    @property
    def moved(self) -> np.ndarray:
        """Change (n,) of the time of the largest force [s]."""
        return -self.rate_change / self.bend if self.bend else np.zeros(len(self.rate_change))


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


@cache
def falling(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Factors and powers of the first three derivatives of the first powers of x, (4, count) each."""
    order, power = np.arange(4)[:, None], np.arange(count)
    rows = [np.ones(count)]
    for k in range(3):
        rows.append(rows[-1] * np.maximum(power - k, 0))
    return np.stack(rows), np.maximum(power - order, 0)


def derivatives(x: float, count: int) -> np.ndarray:
    """Value and first three derivatives at x of the first powers of x, (4, count)."""
    factors, powers = falling(count)
    return np.asarray(factors * float(x) ** powers)


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
    first = np.append(True, np.diff(ascending) > SAME * ascending[1:])[: len(length)]
    found = np.empty(len(length))
    found[order] = ascending[first][np.cumsum(first) - 1]
    return found


def _peak(history: "History") -> tuple[float, float, int]:
    """When a force is largest [s], by how much it exceeds the next of the maxima [-], and of which contact it is.

    NaN without impacts.
    """
    if not history.impacts:
        return np.nan, np.inf, 0
    found = []
    for c in range(history.n_contacts):
        found.append(record.largest_force(history.steps, history.now, history.law, history.n_coefficients, np.int64(c)))
    most = max(range(len(found)), key=lambda c: found[c][1])
    time, top, rival = found[most]
    rival = max([rival, *(other[1] for other in found[:most] + found[most + 1 :])])
    return time, (top - rival) / top if top > 0.0 else np.inf, most


def _sharper(history: "History", time: float, c: int) -> float:
    """When the force of contact c is largest [s] by the motion itself, from a time nearby.

    The force of a long step is a polynomial through its nodes, whose largest value is a little beside that of the law.
    """
    start, end = _step_at(history, time)
    shape, omega, zeta, beside = history.shape, history.omega, history.zeta, NUDGE * (end - start)
    row = int(np.searchsorted(history.steps[:, layout.START], start, side="right")) - 1
    memory, yields = (each[row] for each in remembered(history))
    best = time
    for _ in range(2):
        rates = np.empty(2)
        for i, (q, p) in enumerate(zip(*history.states(np.array([best, best + beside])))):
            d, v = history.offset + shape @ q, shape @ p
            laws = [
                law_at(d[e], v[e], history.law[e : e + 1], memory[e], bool(yields[e]), np.zeros(N_LAW))
                for e in range(len(d))
            ]
            pushed = history.bias - np.array([each[0] for each in laws]) @ shape
            rates[i] = laws[c][1] * v[c] + laws[c][2] * (shape[c] @ (pushed - omega * (2.0 * zeta * p + omega * q)))
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
    if history.n_coefficients > 2 or not len(history.contacts):
        return 1
    counts = np.bincount(history.contacts[:, 4].astype(int), minlength=history.n_contacts)
    per_impact = min(history.pressed[:, c].sum() / count for c, count in enumerate(counts) if count)
    lossy = bool(history.law[:, layout.LOSS].any())
    return 2 ** sum(bool(per_impact >= least) for least in FULL[lossy])


def _recorded(
    history: "History", row: np.ndarray, part: np.ndarray, count: np.ndarray, length: np.ndarray, nodes: np.ndarray
) -> np.ndarray:
    """Recorded forces at the nodes of all pieces, (n_pieces, n_contacts, s) [N].

    That of several steps is the polynomial through the nodes with the same moments as theirs.
    """
    s = len(nodes)
    force = np.zeros((len(row), history.n_contacts, s))
    for n, c in product(np.unique(count), range(history.n_contacts)):
        own = np.flatnonzero((count == n) & history.pressed[row, c])
        steps = row[own, None] + np.arange(n)
        share = length[own, None] / history.steps[row[own], 1:2] if n == 1 else np.ones((len(own), 1))
        within = part[own, None, None] + share[:, :, None] * nodes  # (n_own, 1, s), the same for all steps of a piece
        each = np.zeros((len(own), n, s))
        first = layout.HEAD + (layout.PUSH + history.n_coefficients) * c + layout.PUSH
        for k in range(history.n_coefficients)[::-1]:
            each = each * within + history.steps[steps, first + k][:, :, None]
        force[own, c] = each.reshape(len(own), int(n) * s) @ moments_kept(s, int(n))
    return force


def remembered(history: "History") -> tuple[np.ndarray, np.ndarray]:
    """What contacts remember at the start of each step and at the end, (n_steps + 1, n_contacts), and if they yield."""
    law, m = history.law, history.n_contacts
    shape = len(history.steps) + 1, m
    if law.shape[1] < layout.WIDTH or not (law[:, layout.KIND] == PLASTIC).any():
        return np.zeros(shape), np.zeros(shape, bool)
    plastic = law[:, layout.KIND] == PLASTIC
    first = layout.HEAD + (layout.PUSH + history.n_coefficients) * m
    memory = np.where(plastic, np.vstack([history.steps[:, first : first + m], history.now[layout.REMEMBERED]]), 0.0)
    before = np.maximum(memory[:-1], law[:, layout.FIRST_YIELD])
    yields = history.pressed & plastic & (memory[1:] - before > SAME * before)
    return memory, np.vstack([yields, np.zeros((1, m), bool)])


def runs(held: np.ndarray) -> np.ndarray:
    """First index of every run of truths (n,), and one after its last, (n_runs, 2)."""
    return np.flatnonzero(np.diff(np.concatenate([[0], held, [0]]))).reshape(-1, 2)


def _cut(
    history: "History", times: Sequence[float], grades: np.ndarray, most: int, yields: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Ends of all pieces [s], (n_pieces + 1,), the step each begins in, where in it [-], and of how many steps it is.

    A piece begins at each of some times and ``grades`` of the median step from where a contact starts or ends; up to
    ``most`` steps make one, in all of which a contact yields (n_steps, n_contacts) or in none.
    """
    steps, pressed = history.steps, history.pressed
    inside: defaultdict[int, set[float]] = defaultdict(set)
    places = np.clip(np.searchsorted(steps[:, layout.START], times, side="right") - 1, 0, len(steps) - 1)
    for i, when in zip(places.tolist(), times):
        inside[i].add(float((when - steps[i, layout.START]) / steps[i, layout.LENGTH]))
    edges = [runs(pressed[:, c]) for c in range(history.n_contacts)]
    if len(grades) and pressed.any():
        grades = grades * float(np.median(steps[pressed.any(axis=1), layout.LENGTH]))
        for first, last in np.vstack(edges).tolist():
            inside[first].update((grades / steps[first, layout.LENGTH]).tolist())
            last -= 1
            inside[last].update((1.0 - grades / steps[last, layout.LENGTH]).tolist())
    begins, rows = [np.zeros(len(steps))], [np.arange(len(steps))]
    for k, fractions in inside.items():
        least = SAME + ROUNDING * history.end_time / steps[k, layout.LENGTH]
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
        edges += [runs(column) for column in yields.T] if yields.any() else []
        borders = np.concatenate([each.ravel() for each in edges])
        row, part, count = _joined(history, row, part, borders, inside, most)
    return np.append(steps[row, layout.START] + part * steps[row, layout.LENGTH], history.end_time), row, part, count


def _joined(
    history: "History", row: np.ndarray, part: np.ndarray, edges: np.ndarray, cut: Iterable[int], most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pieces of one step or a part of it put together, except those of cut steps; what `_cut` returns of them.

    The fewer, the nearer the start or end of a contact, where slopes of the force change fast.
    """
    length, number = history.steps[:, layout.LENGTH], np.arange(len(history.steps))
    far = np.abs(number[:, None] - edges).min(axis=1, initial=len(number)) // NEAR
    most_here = np.where(history.pressed.any(axis=1), np.minimum(most, far), 0)
    most_here[list(cut)] = 0
    new = np.append(True, np.abs(np.diff(length)) > SAME * length[1:])
    kept, count = [0], [1]
    for j in range(1, len(row)):
        one, other = row[kept[-1]], row[j]
        if count[-1] < min(most_here[one], most_here[other]) and not new[other]:
            count[-1] += 1
        else:
            kept.append(j)
            count.append(1)
    return row[kept], part[kept], np.array(count)
