"""`design`: the numbers of a body and a blow that make both come out as wanted, by optimisers with gradients."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.optimize import NonlinearConstraint, minimize
from scipy.stats import qmc

from .._base import check, markup
from .._base.check import SimulationError
from .._base.rounding import SAME
from .._base.threads import one_thread
from ..fe.variation import SectionChange
from ..impact import clearance, gradient, promise
from ..impact.response import Response
from ..model import planner, target
from ..model.budget import VERIFYING
from ..modes import varied
from ..modes.modal import Modes
from ..taps import solver
from ..taps.unknowns import Box
from . import goals
from .goals import Goal
from .objects import Maker, Piece, Rate

# [-] relative change that ends a search: its last steps gain several digits each, so a looser end hardly saves any
CLOSE = 1e-10
LOST = 1e3  # [-] miss of numbers that make no blow: any that is far above the miss of a blow makes the search turn back


@dataclass(frozen=True)
class Reached:
    """What became of one goal."""

    goal: Goal
    value: float
    slopes: Mapping[str, float]  # by free number, unit of the quantity over unit of the number

    @property
    def miss(self) -> float:
        """How far the value lies outside its range, over the wanted value [-]; of a restitution absolute."""
        return self.goal.miss(self.value)


@dataclass(frozen=True, eq=False, repr=False)
class Checked(check.Brief):
    """A design struck again as a blow of its own, with a finer model."""

    values: Mapping[str, float]  # by the label of each goal
    hits: Mapping[str, Response]  # by name of the blow
    differences: Mapping[str, Mapping[str, float]]  # of each from the finer blow, see `planner.differences`


@dataclass(frozen=True, eq=False, repr=False)
class Design(check.Brief):
    """What `design` found."""

    values: Mapping[str, float]  # of the free numbers
    reached: tuple[Reached, ...]
    tolerance: float  # [-]
    at_end: tuple[str, ...]  # free numbers at an end of their range
    n_evaluations: int
    maker: Maker = field(repr=False)
    hits: Mapping[str, Response] = field(default_factory=dict, repr=False)  # by name of the blow

    @property
    def met(self) -> bool:
        """Whether every goal is reached within the tolerance."""
        return all(abs(each.miss) <= self.tolerance for each in self.reached)

    def __getitem__(self, label: str) -> float:
        """The value reached of a quantity, by its name, for one of several blows by "blow: name"."""
        labels = [each.goal.label for each in self.reached]
        return self.reached[labels.index(check.one_of("label", label, labels))].value

    @property
    def objects(self) -> Any:
        """The scene, or what the function made, with the numbers found."""
        return self.maker.build(dict(self.values))

    @property
    def verdict(self) -> str:
        """One sentence: whether the goals are reached and, if not, which is missed most and what holds the search."""
        if self.met:
            return f"design found: every goal within {self.tolerance:g}"
        worst = max(self.reached, key=lambda each: abs(each.miss))
        held = f"; {', '.join(self.at_end)} stopped at the end of the range; widen it" if self.at_end else ""
        idle = [name for name in self.values if not any(each.slopes[name] for each in self.reached)]
        if idle:
            held += f"; {', '.join(idle)} changes no goal there: round off what it moves, if that is a step"
        return (
            f"design MISSED: {worst.goal.label} is {worst.value:.6g}, wanted {worst.goal.words}"
            f"{held or '; free more numbers, or begin elsewhere, with start or tries'}"
        )

    def summary(self) -> str:
        """The design in a few lines."""
        rows = [(each.goal.label, f"{each.value:.6g} {each.goal.unit}".strip(), f"wanted {each.goal.words}")
                for each in self.reached]  # fmt: skip
        found = [(name, f"{value:.6g}" + (", at the end of its range" if name in self.at_end else ""))
                 for name, value in self.values.items()]  # fmt: skip
        lines = [self.verdict, *(f"  {line}" for line in markup.columns(found))]
        lines += ["with", *(f"  {line}" for line in markup.columns(rows)), f"{self.n_evaluations} evaluations"]
        return "\n".join(lines)

    def verify(self) -> Checked:
        """Strike the design as a blow of its own and again with a finer model, as ``strike --verify`` does.

        Frequencies are found again, too, to an eighth of the error.
        """
        found: dict[str, float] = {}
        hits: dict[str, Response] = {}
        apart: dict[str, Mapping[str, float]] = {}
        for name, piece in self.maker.pieces(self.values).items():
            own = [each.goal for each in self.reached if each.goal.blow == name and not each.goal.mode]
            if own and piece.blow is not None:
                if piece.target.modes is None:  # by a plan of its own
                    most = min(self.tolerance, piece.blow.arguments.get("tolerance", self.tolerance))
                    run = planner.verify(piece.blow.run(tolerance=most))
                    assert run.verified is not None
                    hits[name], apart[name] = run.response, run.verified
                else:
                    modes = piece.target.surrounded(piece.target.modes)
                    hit = hits[name] = piece.strike(modes, self.tolerance)
                    finer = piece.strike(modes, hit.tolerance / VERIFYING)
                    apart[name] = planner.differences(hit, finer, hit.quantities)
                found |= {goal.label: _of_hit(hits[name], goal) for goal in own}
        some = [each.goal for each in self.reached if each.goal.mode]
        if some:
            piece = next(iter(self.maker.pieces(self.values).values()))
            count = max(goal.mode for goal in some) + target.RIGID_MOTIONS
            modes = _modes_of(piece, count, target.CLOSE / VERIFYING)
            found |= {goal.label: _of_modes(modes, goal) for goal in some}
        return Checked(MappingProxyType(found), MappingProxyType(hits), MappingProxyType(apart))


@check.typed
@one_thread
def design(
    objects: Any,
    wanted: Mapping[str, Any],
    free: Mapping[str, Any],
    *,
    least: str | None = None,
    most: str | None = None,
    start: Mapping[str, float] | None = None,
    tolerance: float = 1e-3,
    tries: int = 1,
    n_modes: int | None = None,
) -> Design:
    """Find numbers of a body and a blow that make both come out as wanted.

    Parameters
    ----------
    objects : Scene, path of a scene file, or function
        What is designed. Of a scene, free numbers are those of its tables. A function takes a dict of values and
        returns arguments of `strike` by name: the body as ``target`` (a System or Modes), or quicker as ``mesh``,
        ``section`` and ``supports``, then ``striker``, ``contact``, ``at``, ``speed`` and others; for several blows a
        dict of such dicts by name; if only frequencies are wanted, the body alone will do.
    wanted : mapping of quantity to a value, or to a range (low, high) with None for an open end
        Of the body "mode1.frequency" [Hz] (flexible modes from 1) and "mode2.ratio" (over the first frequency); of each
        blow "contact_time", "restitution", "impulse", "peak_force", "peak_time", "spectral_centroid=5000" (its band in
        Hz), "spectral_level=800" (of the force at 800 Hz, dB re 0 Hz) and "n_impacts", of which only 1 can be wanted:
        then all quantities are those of the first impact, and the smallest gap after it, the "clearance", is at least
        1 % of the way that the striker goes in the time of the contact at the speed of its arrival. With the name of
        one of several blows as key, a mapping of what is wanted of that one.
    free : mapping of number to (low, high)
        What may change, and how far; by its logarithm where both ends are positive.
    least, most : str, optional
        The free number that shall be as small, or as large, as the goals allow, such as the mass of a hammer.
    start : mapping of number to value, optional
        Where the search begins; by default the middle of each range.
    tolerance : float [-]
        Largest miss of a goal, relative to the wanted value (of a restitution absolute); 0.001 of a frequency are 1.7
        cents.
    tries : int
        Most points, spread over the ranges, where a search begins: until one finds a design; with ``least`` or ``most``
        all of them.
    n_modes : int, optional
        Modes of the body in each blow; by default as many as the plan of the first takes.

    Returns
    -------
    Design
        A design that misses a goal warns (`ToleranceWarning`) and says what holds it.

    Raises
    ------
    ValueError
        If something wanted or free is unknown, or the start makes no body or blow.
    SimulationError
        Where no derivative exists: a number that changes the mesh, a frequency that several modes share.

    Notes
    -----
    Goals alone are met by least squares within bounds (Levenberg and Marquardt), with ``least`` or ``most`` by
    sequential quadratic programming (SLSQP). Derivatives of a blow are those of `Response.gradient`, those of
    frequencies and shapes come from the derivatives of stiffness and mass along the modes. Modes that share a frequency
    answer a blow smoothly, but their single frequencies split, which is refused.

    Examples
    --------
    >>> def bar(values):
    ...     section = fi.Beam.rectangular(fi.Material(E=16e9, nu=0.35, rho=900.0), width=0.05, height=values["height"])
    ...     return {"mesh": fi.mesh.line(0.35), "section": section}
    >>> found = fi.design(bar, wanted={"mode1.frequency": 440.0}, free={"height": (5e-3, 40e-3)})
    >>> found.met, round(1e3 * found.values["height"], 1)  # mm
    (True, 12.4)
    """
    box = Box.of("free", free)
    for label, sought in (("least", least), ("most", most)):
        if sought is not None:
            check.one_of(label, sought, box.names)
    if least is not None and most is not None:
        raise ValueError("most must be left out where least is given")
    tolerance = check.between("tolerance", tolerance, 1e-9, 0.5)
    maker, first = Maker.of(objects, box.names), box.start_at(start)
    wishes = goals.read_goals(wanted, tuple(maker.pieces(box.values_at(first))))
    count = None if n_modes is None else check.count("n_modes", n_modes, high=10_000)  # of a body in a blow
    search = _Search(maker, box, wishes, least or most, -1.0 if most else 1.0, count)
    found = search.search_from(first, tolerance)
    tries = check.count("tries", tries, high=1024)  # points where a search begins
    points = qmc.Sobol(len(first), seed=0).random_base2(max(1, math.ceil(math.log2(tries))))
    low, high = box.bounds
    for point in points[: tries - 1]:
        if found.met and search.least is None:
            break
        try:
            other = search.search_from(low + point * (high - low), tolerance)
        except (SimulationError, ValueError):
            continue
        found = min(found, other, key=search.rank)
    found = replace(found, n_evaluations=len(search.known))
    if not found.met:
        promise.warn(found.verdict)
    return found


@dataclass(frozen=True, eq=False)
class _State:
    """What the numbers of one point make."""

    values: dict[str, float]
    pieces: dict[str, Piece]
    modes: dict[str, Modes]  # of the body, by name of the blow
    hits: dict[str, Response]
    found: np.ndarray  # (n_goals,)


@dataclass(frozen=True, eq=False)
class _Search:
    """Goals over coordinates of the free numbers, remembered by point."""

    maker: Maker
    box: Box
    goals: tuple[Goal, ...]
    least: str | None  # free number to be made small
    sign: float  # -1.0 if it is to be made large
    n_modes: int | None
    known: dict[bytes, Any] = field(default_factory=dict)  # point -> _State, or the error that it met
    slopes: dict[bytes, np.ndarray] = field(default_factory=dict)
    bodies: dict[Any, Modes] = field(default_factory=dict)  # by key of the piece and number of modes
    counts: dict[str, int] = field(default_factory=dict)  # modes of each blow

    def state_at(self, x: np.ndarray) -> _State:
        """What a point makes; raises again the error that it met before."""
        key = x.tobytes()
        if key not in self.known:
            try:
                self.known[key] = self._made(self.box.values_at(x))
            except (SimulationError, ValueError) as error:
                self.known[key] = error
        if isinstance(self.known[key], Exception):
            raise self.known[key]
        found: _State = self.known[key]
        return found

    def _made(self, values: dict[str, float]) -> _State:
        pieces = self.maker.pieces(values)
        highest = max((goal.mode for goal in self.goals), default=0)
        modes: dict[str, Modes] = {}
        hits: dict[str, Response] = {}
        for name, piece in pieces.items():
            struck = any(goal.blow == name and not goal.mode for goal in self.goals)
            if struck and piece.blow is None:
                raise ValueError("wanted: a quantity of a blow needs striker, contact, at and speed; objects has none")
            if struck or name == next(iter(pieces)):
                count = max(self._count(name, piece) if struck else 0, highest + target.RIGID_MOTIONS if highest else 0)
                if piece.key is None or (piece.key, count) not in self.bodies:
                    self.bodies[piece.key, count] = _modes_of(piece, count, target.CLOSE)
                modes[name] = self.bodies[piece.key, count]
            if struck:
                once = any(goal.name == "clearance" for goal in self.goals if goal.blow == name)
                hits[name] = piece.strike(modes[name], 1e-5, once)  # a tolerance small beside what is wanted
        first = next(iter(pieces))
        found = [_of_modes(modes[first], goal) if goal.mode else _of_hit(hits[goal.blow], goal) for goal in self.goals]
        return _State(values, pieces, modes, hits, np.array(found))

    def _count(self, name: str, piece: Piece) -> int:
        """Modes of the body in a blow; the same in all evaluations, so that nothing jumps."""
        if piece.target.modes is not None:
            return piece.target.modes.n_modes
        if self.n_modes is not None:
            return self.n_modes
        if name not in self.counts:
            assert piece.blow is not None
            self.counts[name] = piece.blow.plan(target="modal").n_modes
        return self.counts[name]

    def slope(self, x: np.ndarray) -> np.ndarray:
        """Derivatives (n_goals, n_free) of all goals in the values of the free numbers."""
        key = x.tobytes()
        if key in self.slopes:
            return self.slopes[key]
        state = self.state_at(x)
        found = np.zeros((len(self.goals), len(self.box.unknowns)))
        scales = [state.values[each.name] if each.log else each.high - each.low for each in self.box.unknowns]
        rates = {name: self.maker.rates(state.values, name, scale) for name, scale in zip(self.maker.names, scales)}
        first = next(iter(state.pieces))
        tuned = [i for i, goal in enumerate(self.goals) if goal.mode]
        for j, name in enumerate(self.maker.names if tuned else ()):
            found[tuned, j] = _mode_slopes(state.modes[first], [self.goals[i] for i in tuned], rates[name][first])
        for blow, hit in state.hits.items():
            some = [i for i, goal in enumerate(self.goals) if goal.blow == blow and not goal.mode]
            labels = [self.goals[i].name for i in some]
            found[some] = _hit_slopes(hit, labels, state.values, {name: rate[blow] for name, rate in rates.items()})
        self.slopes[key] = found
        return found

    def search_from(self, first: np.ndarray, tolerance: float) -> Design:
        """One search from one point."""
        low, high = self.box.bounds
        x = solver.least(  # with a number to make least, this finds where the goals are met at all
            self._misses, lambda x: self._turned(x) * (self._misses(x) != 0.0)[:, None],  # none of goals that are met
            first, (low, high), close=CLOSE, iterations=solver.ENOUGH,
        ).x  # fmt: skip
        if self.least is not None:
            x = self._least(x, tolerance)
        state, slopes = self.state_at(x), self.slope(x)
        reached = tuple(
            Reached(goal, float(value), dict(zip(self.maker.names, row.tolist())))
            for goal, value, row in zip(self.goals, state.found, slopes)
        )
        part = (x - low) / (high - low)
        ends = tuple(each.name for each, p in zip(self.box.unknowns, part) if min(p, 1.0 - p) < SAME)
        return Design(
            MappingProxyType(state.values), reached, tolerance, ends, len(self.known), self.maker,
            MappingProxyType(state.hits),
        )  # fmt: skip

    def rank(self, found: Design) -> tuple[float, float]:
        """What makes one design better than another: smaller misses beyond the tolerance, then the number sought."""
        missed = max(0.0, max(abs(each.miss) for each in found.reached) - found.tolerance)
        return missed, self.sign * found.values[self.least] if self.least else 0.0

    def _misses(self, x: np.ndarray) -> np.ndarray:
        try:
            found = self.state_at(x).found
        except (SimulationError, ValueError):
            return np.full(len(self.goals), LOST)
        return np.array([goal.miss(value) for goal, value in zip(self.goals, found)])

    def _turned(self, x: np.ndarray) -> np.ndarray:
        """Derivatives (n_goals, n_free) of the goals over their scale, in the coordinates."""
        per_value = [1.0 / each.outside(z) if each.log else 1.0 / (each.high - each.low)
                     for each, z in zip(self.box.unknowns, x)]  # fmt: skip
        scale = np.array([goal.scale for goal in self.goals])
        return self.slope(x) / scale[:, None] / np.array(per_value)

    def _least(self, first: np.ndarray, tolerance: float) -> np.ndarray:
        """Where one number is smallest or largest of all points tried that meet the goals; else where it ends."""
        which = self.maker.names.index(self.least or "")
        unit = np.eye(len(first))[which]
        low, high = self.box.bounds
        scale = np.array([goal.scale for goal in self.goals])
        ends = np.array([[goal.low, goal.high] for goal in self.goals]).T / scale
        exact = ends[0] == ends[1]

        def value(x: np.ndarray) -> np.ndarray:
            try:
                return self.state_at(x).found / scale
            except (SimulationError, ValueError):
                return np.where(np.isfinite(ends[0]), ends[0] - LOST, ends[1] + LOST)

        constraints = [
            NonlinearConstraint(
                lambda x, some=some: value(x)[some], *ends[:, some], lambda x, some=some: self._turned(x)[some]
            )
            for some in (exact, ~exact) if some.any()
        ]  # fmt: skip
        found = minimize(
            lambda x: self.sign * x[which] / (high[which] - low[which]), first,
            jac=lambda x: self.sign * unit / (high[which] - low[which]), bounds=list(zip(low, high)),
            constraints=constraints, method="SLSQP", options={"maxiter": solver.ENOUGH, "ftol": CLOSE},
        )  # fmt: skip
        last = np.clip(found.x, low, high)
        points = [np.frombuffer(key) for key, state in self.known.items() if isinstance(state, _State)]
        met = [x for x in [last, *points] if np.abs(self._misses(x)).max() <= tolerance]
        return min(met, key=lambda x: self.sign * x[which]) if met else first


def _modes_of(piece: Piece, count: int, tolerance: float) -> Modes:
    """The first modes of the body as struck."""
    target = piece.target
    if target.modes is None and target.source == "auto" and target.section is not None:
        target = replace(target, source="fe")
    return target.surrounded(target.find(count, tolerance=tolerance))


def _of_modes(modes: Modes, goal: Goal) -> float:
    """Frequency [Hz] or ratio of frequencies of a goal."""
    flexible = modes.frequencies[modes.omega > 0.0]
    if len(flexible) < goal.mode:
        raise ValueError(f"wanted: mode {goal.mode} needs more modes, the body has {len(flexible)} flexible ones")
    return float(flexible[goal.mode - 1] / (flexible[0] if goal.ratio else 1.0))


def _of_hit(hit: Response, goal: Goal) -> float:
    """The quantity of a blow."""
    name, _, band = goal.name.partition("=")
    if name == "clearance":
        return clearance.nearest_clearance(hit)[0]
    return float(gradient.value_of(hit, name, float(band) if band else None))


def _mode_slopes(modes: Modes, some: list[Goal], rate: Rate) -> np.ndarray:
    """Derivatives (n_goals,) of `_of_modes` in a free number."""
    asked = np.unique([1, *(goal.mode for goal in some)]) - 1 + modes.n_rigid
    frequencies = modes.frequencies[asked]
    slopes = frequencies * rate.numbers.get("target.first_frequency", 0.0) / frequencies[0]
    if rate.section is not None:
        slopes = slopes + varied.frequency_slopes(modes, rate.section, asked)
    which = np.searchsorted(asked, [goal.mode - 1 + modes.n_rigid for goal in some])
    ratios = np.array([goal.ratio for goal in some])
    own = frequencies[which] / frequencies[0]
    return np.where(ratios, (slopes[which] - slopes[0] * own) / frequencies[0], slopes[which])


def _hit_slopes(hit: Response, labels: list[str], values: Mapping[str, float], rates: Mapping[str, Rate]) -> np.ndarray:
    """Derivatives (n_goals, n_free) of quantities of one blow, by the chain rule over its numbers."""
    numbers = sorted({name for rate in rates.values() for name in rate.numbers})
    sections: dict[str, tuple[float, SectionChange]] = {
        name: (values[name], rate.section) for name, rate in rates.items() if rate.section is not None
    }
    if not numbers and not sections:
        return np.zeros((len(labels), len(rates)))
    marked = {f"free {name}": each for name, each in sections.items()}  # apart from numbers of the blow
    names = (*numbers, *marked)
    asked = tuple(dict.fromkeys(label for label in labels if label != "clearance"))
    found = {name: each.slopes for name, each in gradient.gradients(hit, asked, names, marked).items()} if asked else {}
    if "clearance" in labels:
        found["clearance"] = clearance.slopes(hit, names, marked)
    chain = np.zeros((len(names), len(rates)))
    for j, (name, rate) in enumerate(rates.items()):
        for number, slope in rate.numbers.items():
            chain[names.index(number), j] = slope
        if name in sections:
            chain[names.index(f"free {name}"), j] = 1.0
    return np.array([found[label] for label in labels]) @ chain
