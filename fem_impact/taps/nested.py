"""Smaller models inside a larger one: the larger one begins where they end, too, and is never worse."""

from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .._base.check import SimulationError
from . import solver
from .solver import NEARLY, Data, Problem, Solution
from .unknowns import DAMPING, TIME

# values with which unknowns of the hammer and of modes change nothing; infinity and zero are the ends of their ranges
NEUTRAL = {
    "first_frequency": np.inf, "mode_ratio": 0.0, "tip_mass": 0.0, "mass": np.inf, "damping": DAMPING, "gain": 1.0,
}  # fmt: skip


class Inner(NamedTuple):
    """A smaller model and its best fit."""

    name: str  # what it lacks
    problem: Problem
    x: np.ndarray

    def among(self, taps: list[int], data: Data) -> "Inner":
        """The same for some of its taps, as a larger problem holds and weighs them."""
        fewer, x = self.problem.among(taps, self.x)
        return self._replace(problem=replace(fewer, data=data), x=x)


def smaller_problem(problem: Problem) -> tuple[str, Problem] | None:
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
    return last, replace(problem, setting=replace(problem.setting, unknown=names), free=free, fixed=fixed, own=own)


def embed_fit(problem: Problem, inner: Inner) -> list[np.ndarray]:
    """Coordinates of a larger problem for the same taps at the best fit of a smaller one; several if a mode is new."""
    small, x, n_taps = inner.problem, inner.x, problem.data.n_taps
    values = {}
    for name in (each.name for each in problem.setting.unknown):  # with which they change nothing, if there are any
        home, _, part = name.partition(".")
        if home == "contact":
            values[name] = float(getattr(small.setting.contact, part))
        elif name == "striker.mass":
            values[name] = small.setting.striker.mass
        elif home != "target" and part in NEUTRAL:
            values[name] = NEUTRAL[part]
    values |= small.values(x)
    values[TIME] = problem.setting.contact_time(values)
    low, high = (bound[: problem.n_shared] for bound in problem.bounds)
    begun = []
    # of the frequencies that shape a pulse, where a mode that does not move yet begins
    for share in (0.2, 0.5, 0.8) if any(each.name not in values for each in problem.free) else (0.2,):
        shared = low + share * (high - low)
        for i, each in enumerate(problem.free):
            if each.name in values:
                with np.errstate(divide="ignore"):
                    shared[i] = np.clip(each.inside(values[each.name]), low[i], high[i])
            elif each.name.endswith(".frequency"):
                shared[i] = solver.felt_frequency(share, values[TIME], low[i], high[i])
        apart = dict(zip(small.owners, small.apart(x)))
        rest = [apart.get(name, np.zeros(n_taps)) for name in problem.owners]
        begun.append(np.concatenate([shared, x[small.n_shared : small.n_shared + 2 * n_taps], *rest]))
    return begun


def never_worse(problem: Problem, best: Solution, inner: Inner, notes: list[str]) -> tuple[Problem, Solution, bool]:
    """The larger model, from the best fit of the smaller one if its own searches ended above that; the smaller one if
    that is no better; and whether they did. ``notes`` say so."""
    cost = (1.0 + NEARLY / problem.data.values.size) * float(np.square(inner.problem.residual(inner.x)).sum())
    if best.cost <= cost:
        return problem, best, False
    for begun in embed_fit(problem, inner):
        with suppress(SimulationError):
            best = min(best, solver.solve(problem, begun), key=lambda one: one.cost)
        if best.cost <= cost:
            notes.append(f"the searches stuck above the model without {inner.name}, and went on from that")
            return problem, best, True
    notes.append(f"{inner.name}: left out, as its ranges allow no better fit than without; widen them")
    return inner.problem, solver.solve(inner.problem, inner.x), True
