"""Time steps short enough: runs of ever shorter steps until two agree to the tolerance."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from .._base import check
from .._base.check import SimulationError
from . import distance, engine
from .compiled import law
from .compiled.bundles import KernelSystem
from .contact import STICKY
from .engine import STEP_SHARE, TOLERANCE
from .history import History
from .quantities import asked_for
from .stretched import Stretched

Function = TypeVar("Function", bound=Callable)

SCHEMES = {"A": "A", "A4": "A4", "collocation": "A4"}  # the last an earlier one, whose tolerances A4 meets
SHARPEST = 1e-12  # [-] error aimed at, at the least: rounding adds as much in some ten thousand steps
AVERAGES = {"restitution", "impulse", "n_impacts"}  # quantities that depend on no single instant
# [-] step halvings to decide whether bodies touch or part where the margin is less than its error, which each divides
# by eight or more
GRAZES = 6
# [-] of the change of a margin in twice the steps, what it changes at least: a sixteenth is usual, much less is chance
LEFT = 1.0 / 64.0
# [-] Difference of two runs over the error of the finer one: first for speeds and impulse, then for contact time and
# peak force. These two depend on one instant, and modes faster than the step lower the order of A4 there: with 4 for
# them and a fifth as EACH, 2.5 % of 1 600 random blows erred by more than stated, up to 6 times.
RICHARDSON = {"A": (3.0, 3.0), "A4": (7.0, 3.0)}
EACH = 0.3  # [-] of the largest error of any quantity, what each errs by at least: two runs agree in one by chance
FEW = 8  # [-] steps of an impact: with fewer, two runs may differ by less than they err
ONSET = 0.5  # [-] error of a blow on felt over the impulse of its first step and the hysteresis: 0.33 on a wall
COARSER = 4.0  # [-] steps over those that are right, with which a blow is tried where these are too many
# [-] by how much of a lossy force's ringing faster than the steps its peak errs, which no two runs show, and the most,
# of the tolerance: of 280 random blows 51 stated less than they erred, up to 34 times; with it 14 of 600, up to 4 times
UNRESOLVED = 0.1, 0.25
RINGING = 0.5  # [-] modes with a damping ratio above this do not ring: a swing is down to 3 % of the one before
# [rad] largest phase of a ringing mode in a step of the coarser run: a third of a period, resolved before it repeats
RESOLVED = 2.0


@dataclass(frozen=True)
class Options:
    """How exact a blow is to be, when it stops, by which steps, and what acts besides.

    These are arguments of `strike`, of `collide`, of a plan and of [strike] in a scene, each checked here: a function
    that takes them as keywords is marked by `takes_options`.
    """

    tolerance: float = TOLERANCE
    quantity: Any = None  # as the user names them, see `quantities`
    residual: bool = True  # whether modes left out act by their static compliance
    duration: float | None = None  # [s]
    max_impacts: int | None = None
    scheme: str = "A4"
    dt: float | None = None  # [s]
    striker_force: float = 0.0  # [N] constant
    target_force: float = 0.0  # [N]
    stretching: bool = False
    quantities: Mapping[str, float | None] = field(init=False)  # that must meet the tolerance, with their bands [Hz]
    n_quantities: int = field(init=False)
    last: tuple[float, int] = field(init=False)  # [s] time, and number of impacts, 0 for any, up to which to follow

    @classmethod
    def read(cls, given: Mapping[str, Any], others: Sequence[str] = ()) -> "Options":
        """Options by name, all of them known; ``others`` are what else a name that is not may have been meant for."""
        for name in given:
            if name not in cls.__match_args__:
                known = *cls.__match_args__, *others
                raise ValueError(f"{name} is not an argument of a blow{check.nearest(name, known)}")
        return cls(**given)

    def __post_init__(self) -> None:
        check.flag("residual", self.residual)
        check.flag("stretching", self.stretching)
        check.settle(
            self,
            tolerance=check.tolerance(self.tolerance),
            duration=None if self.duration is None else check.positive("duration", self.duration, "s"),
            max_impacts=None if self.max_impacts is None else check.count("max_impacts", self.max_impacts),
            scheme=SCHEMES["A4" if self.scheme is None else check.one_of("scheme", self.scheme, SCHEMES)],
            dt=None if self.dt is None else check.positive("dt", self.dt, "s"),
            quantities=asked_for(self.quantity),
            striker_force=check.number("striker_force", self.striker_force, "N"),
            target_force=check.number("target_force", self.target_force, "N"),
        )
        object.__setattr__(self, "n_quantities", len(self.quantities))
        object.__setattr__(self, "last", (np.inf if self.duration is None else self.duration, self.max_impacts or 0))


def takes_options(*but: str) -> Callable[[Function], Function]:
    """Decorator: show fields of `Options`, ``but`` some, in the signature of a function that takes ``**options``."""

    def shown(function: Function) -> Function:
        own, shared = inspect.signature(function), inspect.signature(Options).parameters
        given = [each for each in own.parameters.values() if each.kind is not each.VAR_KEYWORD]
        given += [each.replace(kind=each.KEYWORD_ONLY) for name, each in shared.items() if name not in but]
        function.__signature__ = own.replace(parameters=given)  # type: ignore[attr-defined]
        return function

    return shown


def first_count(scheme: str, tolerance: float, quantities: Mapping[str, float | None]) -> float:
    """Steps per contact in the first run: for averages half of the usual, as errors of single instants cancel there."""
    count = engine.steps_per_contact(tolerance, 0.5 if scheme == "A" else 0.25)
    return max(6.0, count * (0.5 if set(quantities) <= AVERAGES else 1.0))


@dataclass(frozen=True, eq=False)
class Converged:
    """Two runs that agree, the finer one with its estimated errors."""

    scheme: str
    steps: tuple[float, float]  # of the finer and the coarser run, as `engine.run_system` takes them
    fine: History
    coarse: History
    error: np.ndarray  # [-] of the finer run, as of `distance.of_runs`
    within: float = 0.0  # [s] as `engine.run_system` takes it


def refine_steps(
    system: KernelSystem, options: Options, pace: engine.Pace, stretched: Stretched | None = None
) -> Converged:
    """Refine until two successive runs agree to the tolerance."""
    most, span = engine.most_steps(system, stretched), min(pace.duration, options.last[0])
    if options.dt is None and span > COARSER * most * pace.longest_step:
        rise = f"within {engine.STEEP * pace.longest_step:.2g} s" if pace.longest_step else "at once"
        raise SimulationError(
            f"{most} steps cannot follow a force that acts for {span:.2g} s and changes {rise} where it is steepest; "
            "take a law of a lower exponent, that yields later or that rises less steeply"
        )
    control = _Control(system, options, pace, stretched, _ringing(system, pace))
    return control.add_unresolved(control.agree_runs())


@dataclass(frozen=True, eq=False)
class _Control:
    """What a blow is followed with while its steps are refined."""

    system: KernelSystem
    options: Options
    pace: engine.Pace
    stretched: Stretched | None
    ringing: tuple[np.ndarray, list[np.ndarray], list[np.ndarray]]  # see `_ringing`

    @property
    def stickiness(self) -> float:
        """Largest loss factor of a contact times the speed [-]."""
        return self.pace.speed * max(self.system.law["loss"].tolist())

    def follow_blow(self, size: float, chosen_by: str = "tolerance", within: float = 0.0) -> History:
        """One run, see `engine.run_system`."""
        how = self.options.scheme, size, self.pace, self.options.last, self.stretched
        return engine.run_system(self.system, *how, chosen_by, within)

    def judge_runs(self, sizes: tuple[float, float], coarse: History, fine: History) -> Converged:
        """Two runs of a finer and a coarser size, and the errors of the finer one."""
        scheme, quantities, n = self.options.scheme, self.options.quantities, self.options.n_quantities
        over = richardson(scheme, self.system.law)
        # a strong loss reacts to the rates of modes faster than the step
        over = over[0], over[1] / (1.0 + 2.0 * self.stickiness)
        fades = self.system.law["relaxation"]
        if scheme == "A4" and fades[fades > 0.0].min(initial=np.inf) < sizes[0]:
            over = over[0], 1.0  # felt releases within its relaxation: contact times at first order
        error = distance.of_runs(coarse, fine, quantities, over, self.pace)
        if "force" in quantities:
            i = [*quantities].index("force")
            error[i] = max(error[i], fine.force_missed)
        error[:n] = np.maximum(error[:n], _missed_impulse(coarse, fine, sizes[0]) + _missed_onset(coarse, fine))
        error[:n] = np.maximum(error[:n], EACH * max(error[:n].tolist()))
        # beside a graze A4 converges at first order only, and a margin in two runs may differ by a seventh of its error
        error[n] = min(1.0, 4.0 * error[n])
        return Converged(scheme, sizes, fine, coarse, error)

    def add_unresolved(self, found: Converged) -> Converged:
        """The same runs with the error of modes that neither resolves."""
        omega, _, lossy = self.ringing
        n_faster = np.count_nonzero(omega * found.steps[0] > RESOLVED)
        if not lossy or not n_faster:
            return found
        missed = missed_by_ringing(max(each[n_faster - 1] for each in lossy), self.options.tolerance)
        n, error = self.options.n_quantities, found.error.copy()
        least = [missed if name == "force" else EACH * missed for name in self.options.quantities]
        error[:n] = np.maximum(error[:n], least)
        return replace(found, error=error)

    def agree_runs(self) -> Converged:
        """The first pair of runs that agrees."""
        options, tolerance = self.options, self.options.tolerance
        if options.dt is not None:
            size = min(options.dt, 0.5 * options.last[0])
            fine, coarse = (self.follow_blow(each, "dt") for each in (size, 2.0 * size))
            return self.judge_runs((size, 2.0 * size), coarse, fine)
        sizes, aim, within = self.list_sizes()
        follow = partial(self.follow_blow, within=within)
        try:
            runs = [follow(size) for size in sizes[:2]]
        except SimulationError as exhausted:  # so many steps are out of reach: longer ones may do
            sizes = [COARSER * sizes[0], 2.0 * sizes[0], *sizes]
            try:
                runs = [follow(size) for size in sizes[:2]]
            except SimulationError:
                raise exhausted from None
        best, met, changed = np.inf, None, 0.0
        grazes = 0 if options.quantities.keys() & {"n_impacts", "contact_time"} else GRAZES
        for i, (before, size) in enumerate(pairwise(sizes)):
            if i:
                runs = [runs[1], follow(size)]
            found = self.judge_runs((size, before), *runs)
            if len(runs[0].contacts) == len(runs[1].contacts):  # or there are margins to two other numbers
                changed = found.error[options.n_quantities] = max(found.error[options.n_quantities], LEFT * changed)
            error = max(found.error[: options.n_quantities].tolist())
            best = min(best, error)
            if error <= tolerance:
                met = found
            if error <= aim:
                clear = grazes >= GRAZES or found.fine.margin > found.error[options.n_quantities]
                # a step of scheme A in the finer run alone errs as the coarser run does, and both may agree on that
                if clear and runs[1].n_fallback <= runs[0].n_fallback:
                    break
                grazes += 1
            enough = i > 5 and len(found.fine.steps) > FEW**2
            if enough or 2 * len(found.fine.steps) > engine.most_steps(self.system, self.stretched):
                break  # the next run would exceed the step limit
        if met is None:
            raise SimulationError(self.explain_failure(best, *runs))
        return replace(met, within=within)

    def list_sizes(self) -> tuple[list[float], float, float]:
        """Steps to try in turn, the error [-] aimed at, and within what a lossy force is compared with its law [s]."""
        options = self.options
        aim = max(STEP_SHARE * options.tolerance, SHARPEST)
        # or the horizon could cut both runs to one step, and they would always agree
        shortest = min(self.pace.duration, options.last[0])
        count = first_count(options.scheme, min(aim, TOLERANCE), options.quantities)
        longest, (omega, shown, _) = self.pace.longest_step, self.ringing
        for shares in shown:
            significant = np.searchsorted(shares, options.tolerance, side="right")
            if significant < len(omega):
                longest = min(longest, RESOLVED / float(omega[significant]))
        if band := options.quantities.get("sound"):  # both runs push modes with their steps' rhythm alike
            heard = self.system.omega[distance.heard(self.system, self.pace.struck, band)]
            least = 8.0 * shortest / engine.most_steps(self.system, self.stretched)
            longest = min(longest, max(RESOLVED / float(heard.max(initial=1e-300)), least))
        first = min(2.0 * shortest / count, longest)
        within = 0.5 * count * first if self.stickiness > STICKY and options.scheme == "A4" else 0.0
        # after seven halvings A4 errs 2**28 times less; a run cut after a few steps has not been halved at all by then
        return [first * 0.5**n for n in range(24)], aim, within

    def explain_failure(self, best: float, coarse: History, fine: History) -> str:
        """Why no two runs agreed, of which the best erred by ``best``, and what helps."""
        # steps twice as long, to which the tolerance advised may lead, err 16 times more
        tolerance, hint, enough = self.options.tolerance, "", min(20.0 * best, 1.0)
        free = self.options.scheme == "A4"  # or ours is more exact
        advice = f"raise tolerance to {float(f'{enough:.1e}'):g}" if free else "leave out scheme"
        if len(fine.contacts) > 1:
            growth = distance.growth(coarse, fine)
            hint = f"; small errors grow {growth:.1g}-fold over {len(fine.contacts)} impacts"
            if free and growth == np.inf:  # the last runs were different blows, to which no tolerance applies
                one, two = (np.sort(history.contacts[:, 1]) for history in (coarse, fine))
                n = min(len(one), len(two))
                # the first impacts, which end at the same times
                same = np.append(np.abs(one[:n] - two[:n]) <= tolerance * self.pace.duration, False)
                advice = f"give max_impacts of at most {max(1, int(same.argmin()))}"
        return (
            f"the step error stays at {best:.1e}, above the tolerance {tolerance:.1e}, with {len(fine.steps)} "
            f"steps{hint}; {advice}"
        )


def richardson(scheme: str, law: np.ndarray) -> tuple[float, float]:
    """Difference of two runs over the error of the finer one, as `RICHARDSON`, with contacts of these laws."""
    over, felt = RICHARDSON[scheme], law[law["relaxation"] > 0.0]
    if scheme == "A4" and len(felt):  # what it remembers sets in like the force
        slow = 2.0 ** (1.0 + felt["exponent"].min()) - 1.0
        over = min(over[0], slow), min(over[1], slow)
    return over


def missed_by_ringing(share: Any, tolerance: float) -> Any:
    """Error [-] of the peak of a force that rings by a share of it [-] in modes faster than the steps."""
    part, most = UNRESOLVED
    return np.minimum(part * share, most * tolerance)


def _missed_impulse(coarse: History, fine: History, size: float) -> float:
    """Share [-] of the impulse that may be wrong in impacts too short for steps of that ``size`` [s].

    What ends each step there is an event rather than its length. Two runs that take an impact in as many steps agree on
    it whatever they err; of fewer than FEW steps the error is that of scheme A4 with so many.
    """
    start, end, _, impulse, *_ = fine.contacts.T
    if len(coarse.contacts) != len(start) or (end - start).min(initial=np.inf) > FEW * size:
        return 0.0
    before, steps = (np.diff(np.searchsorted(run.steps[:, 0], run.contacts[:, :2]))[:, 0] for run in (coarse, fine))
    errs = np.where(before >= steps, 1.0, np.where(steps < FEW, (2.0 / np.maximum(steps, 2)) ** 4, 0.0))
    return float(impulse @ errs / (impulse.sum() or 1.0))


def _missed_onset(coarse: History, fine: History) -> float:
    """Error [-] of first steps on felt that other contacts end, and so are as long in both runs.

    Scheme A4 errs there at second order only, and two such runs agree on it whatever they err.
    """
    missed = 0.0
    for i in fine.law["relaxation"].nonzero()[0]:
        before, first = (
            np.flatnonzero(np.diff(run.pressed[:, i], prepend=False) & run.pressed[:, i]) for run in (coarse, fine)
        )
        if len(before) == len(first):
            alike = fine.steps[first, 1] > 0.75 * coarse.steps[before, 1]
            missed += ONSET * float(fine.law["hysteresis"][i] * (fine.impulses[first, i] @ alike))
    return missed / (float(fine.impulses.sum()) or 1.0)


def _ringing(system: KernelSystem, pace: engine.Pace) -> tuple[np.ndarray, list[np.ndarray], list[np.ndarray]]:
    """Frequencies [rad/s] of modes that ring, the fastest first, and what each and all faster ones show of it [-].

    Modes that ring from the start, about where forces hold them then, show by what they move of the approach of each
    contact. A lossy force depends on the approach rate, too: one that rises like a spring's makes each mode ring in
    that rate, with stiffness times u**2 / omega**2 of the approach speed.
    """
    numbers, bends = (pace.speed * system.law["loss"]).tolist(), system.omega > 0.0
    rings = (bends & ((system.q != 0.0) | (system.p != 0.0))).any()
    shown: list[np.ndarray] = []
    lossy: list[np.ndarray] = []
    if not rings and not any(numbers):
        return np.empty(0), shown, lossy
    slow = system.omega <= np.pi / pace.duration
    order = (-system.omega).argsort(kind="stable")[: np.count_nonzero(bends)]
    omega = system.omega[order]
    swing = np.hypot(system.q[order] - (_static(system)[order] / omega**2 if rings else 0.0), system.p[order] / omega)
    resounds = system.zeta[order] < RINGING
    for shape, number in zip(system.shape, numbers):
        way = pace.duration * abs(float(shape[slow] @ system.p[slow]))
        shown.append(np.cumsum(np.abs(shape[order]) * swing) / max(way, 1e-300))
        if number > 0.0:
            stiffness = (np.pi / pace.duration) ** 2 / max(float(shape[slow] @ shape[slow]), 1e-300)
            rung = number * stiffness * (shape[order] / omega) ** 2
            shown.append(np.cumsum(resounds * rung))
            lossy.append(np.cumsum(rung))
    return omega, shown, lossy


def _static(system: KernelSystem) -> np.ndarray:
    """Modal forces [N kg**-0.5] as a run starts, (n_modes,): constant ones and those of contacts that are pressed."""
    found, rates = system.bias.copy(), system.shape @ system.p
    for i, approach in enumerate(system.offset + system.shape @ system.q - law.dents(system.law)):
        if approach > 0.0:  # the slope of what the contact stores, of any law and memory: only kernels call its force
            stored = [
                law.stored_energies(np.array([(1.0 + part) * approach]), system.law[i : i + 1])
                for part in (-1e-3, 1e-3)
            ]
            factor = max(0.0, 1.0 + system.law["loss"][i] * rates[i])
            found -= (stored[1] - stored[0]) / (2e-3 * approach) * factor * system.shape[i]
    return found
