"""Smaller models inside a larger one: the larger one begins where they end, too, and is never worse."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .._base.check import SimulationError
from . import solver
from .solver import NEARLY, QUICK, Problem, Solution
from .unknowns import DAMPING, TIME

SHARES = 0.2, 0.5, 0.8  # [-] of the frequencies that shape a pulse, where a mode that does not move yet begins
# values with which an unknown changes nothing, or which are usual; infinity and zero are the ends of its range
NEUTRAL = {
    "contact.loss": 0.0, "striker.first_frequency": np.inf, "striker.mode_ratio": 0.0, "striker.damping": DAMPING,
    "striker.tip_mass": 0.0,
}  # fmt: skip
NEUTRAL_MODE = {"mass": np.inf, "damping": DAMPING, "gain": 1.0}


class Inner(NamedTuple):
    """A smaller model and its best fit."""

    name: str  # what it lacks
    problem: Problem
    x: np.ndarray

    def cost(self, problem: Problem, taps: list[int] | None = None) -> float:
        """Its sum of squares for the records of a larger problem, which are some of the ``taps`` it was fitted to."""
        x = self.x if taps is None else self.x[self.problem.kept(taps)]
        return float(np.square(replace(self.problem, data=problem.data, _last={}).residual(x)).sum())


def without(problem: Problem) -> tuple[str, Problem] | None:
    """The problem without its last unknown mode or, if there is none, without the mode of a rigid hammer; its name."""
    modes = [each.name.partition(".")[0] for each in problem.setting.unknown if each.name.startswith("mode")]
    springy = any(each.name == "striker.first_frequency" for each in problem.setting.unknown)
    if modes:
        last = max(modes)
        lost = [each.name for each in problem.setting.unknown if each.name.startswith(last)]
    elif springy and problem.setting.striker.modes.n_modes == 1:
        last, lost = "springy head", [f"striker.{part}" for part in ("first_frequency", "mode_ratio", "damping")]
    else:
        return None
    names = tuple(each for each in problem.setting.unknown if each.name not in lost)
    free = tuple(each for each in problem.free if each.name not in lost)
    fixed = {name: value for name, value in problem.fixed.items() if not name.startswith(last)}
    own = tuple(name for name in problem.own if name not in lost)
    if not free:
        return None
    return last, replace(
        problem, setting=replace(problem.setting, unknown=names), free=free, fixed=fixed, own=own, _last={}
    )


def embedded(problem: Problem, inner: Inner) -> list[np.ndarray]:
    """Coordinates of a larger problem for the same taps at the best fit of a smaller one; several if a mode is new."""
    small, x, n_taps = inner.problem, inner.x, problem.data.n_taps
    values = small.values(x)
    values[TIME] = problem.setting.contact_time(values | _given(problem, small, values))
    low, high = (bound[: problem.n_shared] for bound in problem.bounds)
    length = values[TIME]
    found = []
    new = any(each.name.endswith("frequency") and each.name not in values for each in problem.free)
    for share in SHARES if new else SHARES[:1]:
        shared = low + share * (high - low)
        for i, each in enumerate(problem.free):
            value = {**_given(problem, small, values), **values}.get(each.name)
            if value is not None:
                with np.errstate(divide="ignore"):
                    shared[i] = np.clip(each.inside(value), low[i], high[i])
            elif each.name.startswith("mode") and each.name.endswith("frequency"):
                ends = np.clip(np.log(np.array(solver.FELT) / length), low[i], high[i])
                shared[i] = ends[0] + share * (ends[1] - ends[0])
        apart = dict(zip(_owners(small), small.apart(x)))
        rest = [apart.get(name, np.zeros(n_taps)) for name in _owners(problem)]
        found.append(np.concatenate([shared, x[small.n_shared : small.n_shared + 2 * n_taps], *rest]))
    return found


def _owners(problem: Problem) -> list[str]:
    """The names of `Problem.own` in the order of the coordinates."""
    return [each.name for each in problem.free if each.name in problem.own]


def _given(problem: Problem, small: Problem, values: Mapping[str, float]) -> dict[str, float]:
    """Values for the unknowns that the smaller model does not have, with which they change nothing."""
    found = {}
    for each in problem.setting.unknown:
        home, _, part = each.name.partition(".")
        if each.name in values:
            continue
        if each.name in NEUTRAL:
            found[each.name] = NEUTRAL[each.name]
        elif home == "contact":
            found[each.name] = float(getattr(small.setting.contact, part))
        elif each.name == "striker.mass":
            found[each.name] = small.setting.striker.mass
        elif home.startswith("mode") and part in NEUTRAL_MODE:
            found[each.name] = NEUTRAL_MODE[part]
    return found


def no_worse(problem: Problem, best: Solution, inner: Inner, taps: list[int] | None = None) -> tuple[Solution, bool]:
    """A fit at least as good as a smaller model's, as far as the ranges allow, and whether it had to go on from it."""
    cost = inner.cost(problem, taps)
    if best.cost <= cost * (1.0 + NEARLY):
        return best, False
    x = inner.x if taps is None else inner.x[inner.problem.kept(taps)]
    part = inner._replace(problem=replace(inner.problem, data=problem.data, _last={}), x=x)
    for begun in embedded(problem, part):
        with suppress(SimulationError):
            best = min(best, solver.solve(problem, begun), key=lambda one: one.cost)
        if best.cost <= cost * (1.0 + NEARLY):
            break
    return best, True


def quick(problem: Problem, inner: Inner) -> list[Solution]:
    """Searches that begin at the best fit of a smaller model."""
    found = []
    for begun in embedded(problem, inner):
        with suppress(SimulationError):
            found.append(solver.solve(problem, begun, QUICK, NEARLY))
    return found
