"""Many blows at once: each body becomes one kernel, and every blow refines its step until it meets the tolerance."""

import math
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from functools import cached_property, partial

import numpy as np

from .._base.threads import one_thread
from ..impact.compiled import bundles, convolution, many_blows, propagation
from ..impact.compiled.law import LAW
from ..impact.contact import wall_time
from ..impact.distance import distance
from ..impact.history import CLEAR
from ..impact.reduced_body import rest_mode
from ..impact.stepping import RESOLVED, missed_by_ringing
from ..impact.striker import Striker
from ..modes.modal import Modes

from ..impact.compiled.layout import (  # isort: skip
    FOUND_CENTROID, FOUND_IMPACTS, FOUND_IMPULSE, FOUND_MARGIN, FOUND_MISFIT, FOUND_PEAK, FOUND_STATUS, FOUND_STEPS,
    FOUND_SWING, FOUND_TIME, N_FOUND,
)  # fmt: skip

STEP_ORDER = 3.5  # [-] order of the error in the step: between 3 (linear contact) and 4 (Hertz)
REFINEMENTS = 6  # [-] runs after the first one; a blow that then still misses the tolerance goes to the modal engine
COUNTED = 1e-2  # [-] largest tolerance used: looser ones save no time and miscount impacts
LENGTHS = (48, 192, 768, 3072, 12288)  # [-] kernel lengths in steps, tried in turn until the blow fits
SLACK = 2.0  # [-] a touch or gap counts only above this many times tolerance times deepest approach
# [-] what is stated, as two runs may agree by chance: of their difference, over what the order leaves of it; of the
# misfit of a smooth force; of that of a lossy one, per loss; of the change of the rates at which contacts begin and end
SAFE, SMOOTH, LOSSY, INSTANT, RATTLE = 5.0, 2.5, 10.0, 0.2, 0.5
FALLS = 2.5  # [-] power of the ratio of steps by which an error found falls at most
SUMMED = 2.5e-3  # [-] what sums for a centroid err by at most, whatever the steps; 90 % of 1 111 less than 1e-4
FEW = 1024  # [-] blows that are too few to split between threads: one alone is faster


@dataclass(frozen=True, eq=False)
class Family:
    """Blows between the same two bodies at the same points; their masses, the law and the speed may differ."""

    omega: tuple[np.ndarray, np.ndarray]  # of target and striker, (n_modes,) [rad/s]
    zeta: tuple[np.ndarray, np.ndarray]  # (n_modes,) [-]
    squared: tuple[np.ndarray, np.ndarray]  # (n_modes,) [-] squared shapes at the contact point times the body's mass
    rest: tuple[float, float]  # [kg m/N] residual compliance times the body's mass

    @classmethod
    def of(cls, modes: Modes, at: np.ndarray, striker: Striker, residual: bool, lossy: bool = False) -> "Family":
        """The family of a blow; if ``lossy``, the residual compliance becomes an extra mode, as in `strike`."""
        parts = []
        for body, point in ((modes, at), (striker.modes, striker.at)):
            place = point[None]
            rest = float(body.residual_compliance(place)[0, 0]) if residual and body.dimension else 0.0
            rest = max(0.0, rest) * body.mass
            omega, zeta = np.array(body.omega), np.array(body.damping_ratio)
            squared = body.shape_at(place)[0] ** 2 * body.mass
            if lossy and rest > 0.0:
                above, damping = rest_mode(body.dimension, omega[-1], zeta[-1], 0.0, squared.sum() / rest)
                omega, zeta = np.append(omega, above), np.append(zeta, damping)
                squared, rest = np.append(squared, rest * above**2), 0.0
            parts.append((omega, zeta, squared, rest))
        return cls(*zip(*parts))

    def sums(self, body: int) -> tuple[float, float, float]:
        """Squared shapes of rigid motions [-], compliance of kept flexible modes and residual one [kg m/N], by mass."""
        squared, omega = self.squared[body], self.omega[body]
        flexible = omega > 0.0
        return squared[~flexible].sum(), (squared[flexible] / omega[flexible] ** 2).sum(), self.rest[body]

    @cached_property
    def upper(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of each body flexible modes [rad/s], the fastest first, and compliance [kg m/N] of each with faster ones."""
        found = []
        for omega, squared in zip(self.omega, self.squared):
            fastest = np.argsort(-omega)[: np.count_nonzero(omega)]
            found.append((omega[fastest], np.cumsum(squared[fastest] / omega[fastest] ** 2)))
        return found

    def cutoff(self, body: int, compliance: np.ndarray) -> np.ndarray:
        """Frequency [rad/s] above which all modes together stay below each compliance; 0 if the whole body does."""
        omega, above = self.upper[body]
        return np.append(omega, 0.0)[np.searchsorted(above, compliance)]

    def faster(self, body: int, frequency: np.ndarray) -> np.ndarray:
        """Compliance [kg m/N] of all modes above each frequency [rad/s]."""
        omega, above = self.upper[body]
        return np.append(0.0, above)[np.searchsorted(-omega, -frequency)]

    def kernels(self, h: float, n_steps: int) -> tuple[np.ndarray, ...]:
        """Kernels of both bodies at unit mass, (6, n_steps) each, bounds of their motion in flight, and their modes."""
        found = []
        for omega, zeta, squared in zip(self.omega, self.zeta, self.squared):
            bounds = np.empty((convolution.SPLITS + convolution.N_SPANS, 2, 2))
            convolution.flight_bounds(omega, zeta, squared, h, bounds)
            table = np.empty((propagation.N_TABLE, len(omega)))
            propagation.step_table(omega, zeta, h, table)
            found.append((kernel_rows(omega, zeta, squared, h, n_steps)[0], bounds, [*table[:8], omega, zeta, squared]))
        return tuple(np.asarray(each) for pair in zip(*found) for each in pair)

    def later(self, h: float, n_steps: int) -> tuple[np.ndarray, np.ndarray]:
        """The same kernels without the means, 1/4, 2/4, ... of a step later, (2**SPLITS - 1, 4, n_steps) each."""
        parts = np.arange(1, 2**convolution.SPLITS) / 2**convolution.SPLITS
        first, second = (kernel_rows(*body, h, n_steps, parts) for body in zip(self.omega, self.zeta, self.squared))
        return first, second


def kernel_rows(
    omega: np.ndarray, zeta: np.ndarray, squared: np.ndarray, h: float, n_steps: int, parts: np.ndarray | None = None
) -> np.ndarray:
    """Approach of a body of unit mass when a unit force acts on it for one step h [s]: in that and all later ones.

    Of modes (n_modes,) with frequencies [rad/s], damping ratios and squared shapes. Returns approach at the ends of the
    steps, its rate there and its mean over each step, each for a constant force and for the ramp t/h - 1/2, (1, 6,
    n_steps); or the same without means at fractions ``parts`` (n_parts,) [-] of a step after the end of each, (n_parts,
    4, n_steps). The output after ``i stride + j`` steps is the output row advanced by j steps times the state after ``i
    stride`` steps: one matrix product replaces the loop over all steps.
    """
    stride = 2 ** math.ceil(0.5 * math.log2(n_steps))
    n_strides = -(-n_steps // stride)
    looks = 3 if parts is None else 2
    rows: np.ndarray = np.zeros((1 if parts is None else len(parts), looks, 2, n_strides * stride))
    for start in range(0, len(omega), 4096):  # limits the memory to about 20 MB
        some = slice(start, start + 4096)
        w, z, u = omega[some], zeta[some], squared[some]
        one, many, part = np.empty((3, propagation.N_TABLE, len(w)))
        propagation.step_table(w, z, h, one)
        propagation.step_table(w, z, stride * h, many)
        weights = np.empty((looks, stride, 2, len(w)))
        for look, (q, p) in zip(weights, ((u, 0.0 * u), (0.0 * u, u), (u * one[8], u * one[9]))):
            convolution.orbit(one[[0, 2, 1, 3]], q, p, look)
        states = np.empty((len(rows), 2, n_strides, 2, len(w)))
        for i, places in enumerate(states):
            if parts is not None:
                propagation.step_table(w, z, parts[i] * h, part)
            for place, q, p in zip(places, one[4:8:2], one[5:8:2]):
                if parts is not None:
                    q, p = part[0] * q + part[1] * p, part[2] * q + part[3] * p
                convolution.orbit(many, q, p, place)
        product = weights.reshape(looks * stride, -1) @ states.reshape(-1, 2 * len(w)).T
        product = product.reshape(looks, stride, len(rows), 2, n_strides).transpose(2, 0, 3, 4, 1)
        if parts is None:
            rows[0, 2, :, 0] += one[10:12] @ u
        ends, means = product[:, :2], product[:, 2:]
        rows[:, :2] += ends.reshape(rows[:, :2].shape)
        rows[:, 2:, :, 1:] += means.reshape(rows[:, 2:].shape)[..., :-1]
    return np.ascontiguousarray(rows.reshape(len(rows), 2 * looks, -1)[..., :n_steps])


@dataclass(frozen=True, eq=False)
class Blows:
    """Parameters of many blows, all arrays (n_cases,)."""

    families: Mapping[int, Family]
    family: np.ndarray  # key of each blow in families
    target_mass: np.ndarray  # [kg]
    striker_mass: np.ndarray  # [kg]
    stiffness: np.ndarray  # [N/m**exponent]
    exponent: np.ndarray  # [-]
    speed: np.ndarray  # [m/s]
    loss: np.ndarray  # [s/m]

    @property
    def n_cases(self) -> int:
        return len(self.family)

    def some(self, cells: np.ndarray) -> "Blows":
        """Those blows only."""
        return Blows(self.families, *(getattr(self, field.name)[cells] for field in fields(self)[1:]))


@dataclass(frozen=True, eq=False)
class Bounces:
    """Results of many blows, all arrays (n_cases,); NaN for blows that the modal engine must compute."""

    n_impacts: np.ndarray  # [-]
    contact_time: np.ndarray  # [s]
    restitution: np.ndarray  # [-]
    impulse: np.ndarray  # [N s]
    peak_force: np.ndarray  # [N]
    margin: np.ndarray  # [-] as of `Response`
    error: np.ndarray  # [-] estimated
    centroid: np.ndarray  # [Hz]
    done: np.ndarray  # bool: met the tolerance, and no touch in flight was missed


Kernels = dict[tuple[int, int, int, bool], tuple[np.ndarray, ...]]  # keys: family, step, length, later
NO_KERNELS = (np.empty((0, 4, 0)),) * 2


def follow_blows(
    blows: Blows, *, tolerance: float, band: float = 0.0, workers: int | None = None, kernels: Kernels | None = None
) -> Bounces:
    """Compute blows in kernel form at unit speed, with shorter steps until each meets the tolerance, as in `strike`.

    ``band`` [Hz] is the upper end of the centroid's, 0 for no centroid; ``workers`` the number of threads, by default
    one per core; ``kernels`` are those computed so far for the same families, to which this call adds new ones. With
    ``d = v x`` the blow depends on stiffness and speed only through ``k v**(exponent - 1)``; times do not change, and
    forces scale with v.
    """
    return Bounces(*_in_pieces(blows, partial(_follow, tolerance=tolerance, band=band), workers, kernels))


def allowed_error(tolerance: float) -> float:
    """Largest estimated error [-] of the time steps that a tolerance accepts.

    A tenth of it, as with half of it two runs agreed by chance in 8 of 7 000 cells; or half of a tolerance so small
    that it comes to less than 2e-5, as there they did not.
    """
    return max(0.1 * tolerance, min(0.5 * tolerance, 2e-5))


def count_impacts(blows: Blows, *, tolerance: float, most: int, kernels: Kernels | None = None) -> np.ndarray:
    """Only how often each blow touches (n_cases,), at most ``most``; NaN where the modal engine must count.

    Two runs of different steps agree on each number. ``tolerance`` and ``kernels`` as in `follow_blows`, but errors of
    forces and times ask for no shorter steps, and a touch in flight is missed where the two agree on that.
    """
    return _in_pieces(blows, partial(_count_by_two_runs, tolerance=tolerance, most=most), None, kernels)[0]


@one_thread
def _in_pieces(
    blows: Blows, following: Callable[..., tuple[np.ndarray, ...]], workers: int | None, kernels: Kernels | None
) -> list[np.ndarray]:
    """What ``following`` finds of blows, with the kernels known so far, by several threads if they are many."""
    kernels = {} if kernels is None else kernels
    follow, workers = partial(following, kernels=kernels), workers or os.cpu_count() or 1
    piece = 2**14  # blows a thread follows at once at most: their data stay in the cache
    size = min(piece, max(FEW, -(-blows.n_cases // (4 * workers))))
    # those of like kernels together, so that few are computed by several threads
    order = np.lexsort([blows.stiffness * blows.speed ** (blows.exponent - 1.0) / blows.striker_mass, blows.family])
    if workers == 1 or blows.n_cases <= size:
        size = piece
    parts = np.split(order, range(size, blows.n_cases, size))
    with ThreadPoolExecutor(workers) as pool:
        found = list(pool.map(follow, map(blows.some, parts)))
    back = np.argsort(order)
    return [np.concatenate(columns)[back] for columns in zip(*found)]


def _follow(blows: Blows, tolerance: float, band: float, kernels: Kernels) -> tuple[np.ndarray, ...]:
    """The columns of `Bounces` for some blows: once the steps are short enough, NaN if they never are.

    Neither are they of a blow too long for the longest kernel: shorter steps only make it longer.
    """
    engine, tolerance, todo = _Engine(blows, band, kernels), min(tolerance, COUNTED), np.arange(blows.n_cases)
    first = engine.first_step(tolerance)
    coarse = engine.run_all(todo, first - 2)
    # [half-octaves] half the step seldom does, a quarter mostly; not with loss, where errors fall more slowly, nor
    # where the longest kernel would not leave room for more
    finer = np.where((blows.loss > 0.0) | (16.0 * coarse[FOUND_STEPS] > LENGTHS[-1]), 2, 4)
    step = first - 2 + finer
    error, final = np.full(blows.n_cases, np.nan), np.full_like(coarse, np.nan)
    before = np.zeros(blows.n_cases)  # [-] error found of the coarser run, 0 where none was
    for _ in range(REFINEMENTS):
        fits = coarse[FOUND_STATUS] != many_blows.LONG
        coarse, todo, step, finer, before = coarse[:, fits], todo[fits], step[fits], finer[fits], before[fits]
        if not todo.size:
            break
        ratio = 2.0 ** (0.5 * finer)
        slack = SLACK * tolerance * 2.0 ** (0.5 * STEP_ORDER * (first[todo] - step))
        fine = engine.run_all(todo, step, slack, ratio * coarse[FOUND_STEPS])
        found, stated = engine.compare_runs(coarse, fine, todo, step, ratio)
        loss = engine.law["loss"][todo]
        rung = loss * engine.softness(todo, step, RESOLVED) if loss.any() else loss
        by_chance = np.minimum(before / ratio**FALLS, tolerance)
        stated = np.fmax.reduce([stated, by_chance, missed_by_ringing(rung, tolerance)])
        met = (found <= allowed_error(tolerance)) & (stated <= tolerance)
        final[:, todo[met]] = fine[:, met]
        error[todo[met]] = stated[met]
        coarse, todo = fine[:, ~met], todo[~met]
        before = np.nan_to_num(found[~met], posinf=0.0)
        # halving always leaves 13 % of stiff blows at 3e-5 undone instead of 8 %, never a third of those with loss
        finer = np.where(found[~met] < 8.0 * allowed_error(tolerance), 1, 2)
        step = step[~met] + finer
    v = blows.speed
    return (
        final[FOUND_IMPACTS], final[FOUND_TIME], final[FOUND_IMPULSE] * engine.own_rigid - 1.0,
        final[FOUND_IMPULSE] * v, final[FOUND_PEAK] * v, np.minimum(CLEAR, final[FOUND_MARGIN]), error,
        final[FOUND_CENTROID], ~np.isnan(error),
    )  # fmt: skip


def _count_by_two_runs(blows: Blows, tolerance: float, most: int, kernels: Kernels) -> tuple[np.ndarray]:
    """Numbers of impacts on which two runs agree, the finer one with half the step."""
    engine = _Engine(blows, 0.0, kernels)
    tolerance = min(tolerance, COUNTED)
    step, todo = engine.first_step(tolerance), np.arange(blows.n_cases)
    number, before = np.full(len(todo), np.nan), None
    for turn in range(REFINEMENTS):
        slack = np.full(len(todo), SLACK * tolerance * 2.0 ** (-STEP_ORDER * turn))
        now = engine.run_all(todo, step + 2 * turn, slack, None if before is None else 2.0 * before[FOUND_STEPS])
        counted = now[FOUND_STATUS] <= many_blows.DOUBTFUL
        now[FOUND_IMPACTS] = np.where(counted, np.minimum(now[FOUND_IMPACTS], most), np.nan)
        met = np.zeros(len(todo), bool) if before is None else now[FOUND_IMPACTS] == before[FOUND_IMPACTS]
        number[todo[met]] = now[FOUND_IMPACTS, met]
        again = ~met & (now[FOUND_STATUS] != many_blows.LONG)  # shorter steps would only make it longer
        before, todo, step = now[:, again], todo[again], step[again]
        if not todo.size:
            break
    return (number,)


class _Engine:
    """Kernels by family and step, and the numbers that all runs share."""

    def __init__(self, blows: Blows, band: float, kernels: Kernels) -> None:
        self.blows, self.band, self.kernels = blows, band, kernels
        self.keys, self.which = np.unique(blows.family, return_inverse=True)
        self.shares = np.array([1.0 / blows.target_mass, 1.0 / blows.striker_mass])
        families = [blows.families[int(key)] for key in self.keys]
        self.n_modes = max(len(omega) for family in families for omega in family.omega)
        sums = np.array([[family.sums(body) for family in families] for body in (0, 1)])  # (2, n_families, 3)
        rigid, static, rest = np.moveaxis(sums[:, self.which], 2, 0) * self.shares
        self.own_rigid, self.rigid, self.static = rigid[1], rigid.sum(axis=0), static.sum(axis=0)
        stiffness = blows.stiffness * blows.speed ** (blows.exponent - 1.0)
        self.law = np.zeros(len(stiffness), LAW)
        self.law["stiffness"], self.law["exponent"] = stiffness, blows.exponent
        self.law["loss"], self.law["compliance"] = blows.loss * blows.speed, rest.sum(axis=0)
        self.duration = wall_time(stiffness, blows.exponent, self.rigid, 1.0, self.law["compliance"])
        # [N/m] stiffness of the contact as it lasts, by body: over its mass
        self.firm = (np.pi / self.duration) ** 2 / self.rigid * self.shares

    def first_step(self, tolerance: float) -> np.ndarray:
        """Step of each blow in half-octaves, h = 2**(-step / 2).

        At least 12 per contact with a rigid wall at 1e-3, of which the first run takes half, and two per period of the
        centroid's highest frequency. A contact with loss needs shorter ones: its force depends on the rate of approach,
        so that more modes ring; only part of what they ring becomes an error.
        """
        loss, count = self.law["loss"], 12.0 * (1e-3 / tolerance) ** (1.0 / STEP_ORDER)
        step = np.ceil(2.0 * np.log2(np.maximum(count / self.duration, 2.0 * self.band))).astype(int)
        for body in (0, 1) if loss.any() else ():
            cutoff = np.zeros(len(step))
            for i, key in enumerate(self.keys):
                cells = (self.which == i) & (loss > 0.0)
                rung = loss[cells] * self.firm[body, cells]
                cutoff[cells] = self.blows.families[int(key)].cutoff(body, 3.0 * tolerance / rung)
            ringing = cutoff > 0.0
            needed = np.ceil(2.0 * np.log2(2.0 * cutoff[ringing] / RESOLVED)).astype(int)
            step[ringing] = np.maximum(step[ringing], needed)
        return step

    def softness(self, cells: np.ndarray, step: np.ndarray, phase: float) -> np.ndarray:
        """Compliance over that of the contact [-] of modes that turn by more than a phase in a step, (n_cells,)."""
        found = np.zeros(len(cells))
        for i, key in enumerate(self.keys):
            some, family = self.which[cells] == i, self.blows.families[int(key)]
            limit = phase * 2.0 ** (0.5 * step[some])
            found[some] = sum(self.firm[body, cells[some]] * family.faster(body, limit) for body in (0, 1))
        return found

    def run_all(
        self, cells: np.ndarray, step: np.ndarray, slack: np.ndarray | None = None, length: np.ndarray | None = None
    ) -> np.ndarray:
        """Compute blows with the given steps; return what `many_blows.run` writes, (N_FOUND, n_cells).

        Without ``slack``, flights are only sampled and a short touch can be missed: good enough for the coarse run of a
        comparison. ``length`` is the expected number of steps of each blow.
        """
        out, slacks, sure = np.full((N_FOUND, self.blows.n_cases), np.nan), np.zeros(self.blows.n_cases), False
        out[FOUND_STATUS] = many_blows.LONG
        if slack is not None:
            slacks[cells], sure = slack, True
        pairs = bundles.Pairs(self.shares, self.law, self.rigid, self.static, slacks)
        group = np.stack([self.blows.family[cells], step])
        order, todo = np.lexsort(group), np.ones(len(cells), bool)
        edges = np.flatnonzero(np.any(np.diff(group[:, order], axis=1) != 0, axis=0)) + 1
        parts = np.split(order, edges)  # of one family and step each
        for limit in LENGTHS:
            if limit == LENGTHS[-1]:  # the work is that of its square: the modal engine takes fewer steps with loss
                now = todo & (self.law["loss"][cells] == 0.0)
            else:
                now = todo if length is None else todo & (length < limit)
            track = many_blows.made_track(limit, self.n_modes)
            for part in (each[now[each]] for each in parts):
                if not part.size:
                    continue
                family, exponent = group[:, part[0]].tolist()
                found = self.kernel(family, exponent, limit, False)
                later = self.kernel(family, exponent, limit, True) if sure and limit > LENGTHS[0] else NO_KERNELS
                of_bodies = bundles.Kernels(found[:2], found[2:4], later, found[4:])
                many_blows.run(cells[part], pairs, of_bodies, 2.0 ** (-0.5 * exponent), sure, self.band, track, out)
            todo &= ~(now & (out[FOUND_STATUS, cells] != many_blows.LONG))
            if not todo.any():
                break
        return out[:, cells]

    def kernel(self, family: int, step: int, length: int, later: bool) -> tuple[np.ndarray, ...]:
        """Kernels of a family, one per length, so that no blow depends on the others in its batch."""
        key = family, step, length, later
        found = self.kernels.get(key)
        if found is None:
            find = Family.later if later else Family.kernels
            found = find(self.blows.families[family], 2.0 ** (-0.5 * step), length)
            if sum(part.nbytes for parts in list(self.kernels.values()) for part in parts) > 128e6:  # limits the memory
                self.kernels.clear()
            self.kernels[key] = found
        return found

    @np.errstate(divide="ignore", invalid="ignore")  # of blows that ended before a touch
    def compare_runs(
        self, coarse: np.ndarray, fine: np.ndarray, cells: np.ndarray, step: np.ndarray, ratio: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Largest error of the finer run in the quantities under tolerance, and what is stated of it, (n_cells,) each.

        Both infinite if the two runs ended differently, or differ by more in how near they come to another number of
        impacts than the finer one comes to it. ``step`` is that of the finer run, ``ratio`` that of the two. The error
        in the time of contact is that of the approach divided by its rate there. A change of that rate shifts the
        instant within its step, a force by as much per loss, and its peak where modes faster than the steps rattle on
        the contact. The peak of a force that loses much errs by more than what is found.
        """
        one, two = (
            {
                "restitution": run[FOUND_IMPULSE] * self.own_rigid[cells], "contact_time": run[FOUND_TIME],
                "impulse": run[FOUND_IMPULSE], "force": run[FOUND_PEAK],
            } | ({"centroid": run[FOUND_CENTROID]} if self.band else {})
            for run in (coarse, fine)
        )  # fmt: skip
        apart = distance(one, two)
        swung = fine[FOUND_SWING] * np.maximum(apart["impulse"], apart["force"])
        change = np.fmax.reduce([swung, *apart.values()])
        same = coarse[FOUND_IMPACTS] == fine[FOUND_IMPACTS]
        same &= (coarse[FOUND_STATUS] <= many_blows.DOUBTFUL) & (fine[FOUND_STATUS] == many_blows.DONE)
        margins = np.minimum(CLEAR, [coarse[FOUND_MARGIN], fine[FOUND_MARGIN]])
        same &= 8.0 * np.abs(margins[1] - margins[0]) <= ratio**2 * margins[1]
        order, misfit = ratio**2 - 1.0, fine[FOUND_MISFIT]  # an order of 3 and more was measured
        found = np.where(same, np.maximum(change / order, misfit), np.inf)
        loss = self.law["loss"][cells]
        lossy = (1.0 + LOSSY * np.minimum(0.5, loss)) * np.maximum(apart["force"] / order, misfit)
        peak = np.where(loss > 0.0, lossy, SMOOTH * misfit)
        turned = abs(coarse[FOUND_SWING] / fine[FOUND_SWING] - 1.0)
        share = 2.0 ** (-0.5 * step) * fine[FOUND_IMPACTS] / fine[FOUND_TIME]  # of a step in a contact
        rattles = RATTLE * np.minimum(1.0, self.softness(cells, step, 1.0)) / ratio
        turns = np.maximum(INSTANT * (share + loss), rattles) * turned
        return found, np.fmax.reduce([found, SAFE * change / (ratio**STEP_ORDER - 1.0), peak, turns])
