"""A plate by its modes or vectors up to a frequency, and as an infinite plate above it; see `mixed`."""

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base import check, progress
from ..fe import plausible, refinement
from ..impact.response import Response
from ..modes.modal import Modes
from . import cost, mixed, vectors
from .asked import Asked, Description
from .by_modes import MANY_MODES
from .by_vectors import Vectors
from .target import FIRST_LOOK, Elements, Stages

MOST = vectors.MOST_VECTORS // 2  # [-] a time limit: half a minute on a mesh of 50 000 unknowns
NO_MESH = "a mesh that resolves the frequency up to which a plate of 'mixed' keeps its modes has too many unknowns"


@dataclass(frozen=True, eq=False)
class Mixed(Description):
    """A plate by modes, or vectors of finite elements, that is infinite above a frequency."""

    frequency: float  # [Hz]
    highest: float  # [Hz] above it, the infinite plate acts as a spring
    compared: bool = False  # whether vectors up to any frequency have been tried instead

    @classmethod
    def of(cls, asked: Asked, stages: Stages, anyway: bool = False) -> "Mixed | None":
        """The plate as infinite above a frequency; None if its mobility is not known.

        Or, without ``anyway`` and unless the user asks for it, where vectors or few modes do: the infinite plate damps
        the contact less than critically, or few modes describe the blow.
        """
        blow, target, named = asked.blow, asked.blow.target, "target" in asked.pieces
        pressed = asked.values["striker_force"] or asked.values["target_force"] or blow.contact.gap < 0.0
        stated = pressed or asked.counted or blow.striker.returns or not asked.values["residual"]
        fits = asked.plain and not (stated or asked.moving)
        with stages("modes"):
            estimates = asked.estimates if fits else None
        resolved = target.kind == "analytic" or vectors.vectors_usable(target)
        if not resolved or estimates is None or not np.isfinite(estimates.mobility) or not estimates.echo:
            why = asked.unfit if fits else "is only for thin plates in a vacuum, and for the blow alone"
            asked.refuse(why)
            return None
        slow, highest = asked.mass * estimates.mobility, asked.highest(estimates.mobility)
        if not named and mixed.LASTING * slow > 1e4 * asked.duration:  # too many steps, some 24 for each contact time
            return None
        few = asked.damped_by(estimates.mobility) < 1.0 or target.count_below(highest / target.stretch) < MANY_MODES
        if few and not (named or anyway):
            return None
        frequency = mixed.first_frequency(asked.mass, estimates.mobility, estimates.echo, asked.duration)
        kept = (
            f"the target keeps its modes up to about {frequency:.3g} Hz, or higher if the echoes left out matter; "
            f"above, it is treated as an infinite plate of mobility {estimates.mobility:.3g} m/(N s), from "
            f"{highest:.3g} Hz on as a spring"
        )
        why = (
            f"the contact lasts about {asked.duration:.3g} s on a wall, and the striker slows down within {slow:.3g} s"
        )
        number = round(target.count_below(mixed.REACH * frequency / target.stretch))
        chosen: dict[str, Any] = {"element": "closed form"}
        if target.kind == "analytic":
            with stages("modes"):
                chosen["first"] = asked.find(FIRST_LOOK, stages=stages)
        else:
            try:
                elements, _, n_dofs, work = _by_elements(asked, frequency, stages)
            except check.SimulationError:
                if named:
                    raise
                return None
            with suppress(check.SimulationError):  # the echoes left out mostly ask for more, as far as that is allowed
                higher = 2.0 * frequency
                while (twice := _by_elements(asked, higher, stages))[1] <= MOST:
                    work, higher = replace(work + twice[3], memory=work.memory), 2.0 * higher
            chosen = {"element": target.element, "size": elements.size, "n_dofs": n_dofs, "work": work}
        forecast = asked.foretell(
            "mixed", errors={"echoes left out": asked.budget.half}, reasons=(why, kept), mass=estimates.mass,
            mobility=estimates.mobility, n_modes=number, max_frequency=frequency,
            notes=plausible.together(target.assumed, estimates.notes), **chosen,
        )  # fmt: skip
        return cls(asked, forecast, frequency, highest)

    def found(self, stages: Stages, keep: Any = None) -> "tuple[Mixed, Modes]":
        """The same, and its modes or vectors."""
        asked, target, forecast, frequency = self.asked, self.asked.blow.target, self.forecast, self.frequency
        ritz, at = self.ritz, asked.values["at"]
        if forecast.first is not None:
            with stages("modes"):
                reach = mixed.REACH * frequency / target.stretch
                modes = target.finished(asked.find(FIRST_LOOK, reach, first=forecast.first, stages=stages))
        else:
            if ritz is None:
                elements, count, _, _ = _by_elements(asked, frequency, stages)
                shift, resolved = 2.0 * np.pi * mixed.REACH * frequency, mixed.RESOLVED * frequency
                ritz = vectors.RitzTarget(
                    target, at, resolved, asked.budget.total, elements, target.size_stated, stages, shift, count
                )
            ritz.needed_modes(lambda found, _: float(found.frequencies[-1]))
            assert ritz.whole is not None
            modes = ritz.whole
        body = mixed.mixed_plate(modes, at, forecast.mobility, frequency, self.highest)
        forecast = replace(forecast, n_modes=body.n_modes, max_frequency=frequency)
        return replace(self, forecast=forecast, ritz=ritz), body

    def refined(self, hit: Response, stages: Stages) -> "Mixed | Vectors | None":
        """More vectors, a finer mesh or twice the frequency; vectors for all frequencies if they cost less."""
        asked, error, allowed, ritz = self.asked, hit.error, self.asked.budget.half, self.ritz
        # a higher frequency, which it may take, begins with vectors and a mesh of its own
        simple = error.idealisation > max(allowed, error.truncation, error.mesh)
        if ritz is not None and ritz.count < MOST and not simple:
            if error.truncation > 0.5 * allowed:
                ritz.count = min(MOST, 2 * ritz.count)  # it lasts longer than expected
                return self
            if ritz.improved(error, allowed):
                return self
        twice = 2.0 * hit.bodies[-1].n_modes
        # modes times steps of one run: 2e8 take ten seconds
        many = hit.history.steps.shape[0] * twice > 2e8 or (ritz is not None and twice > MOST)
        if error.idealisation <= allowed or (many and ritz is None):
            return None
        higher = replace(self, frequency=2.0 * self.frequency, ritz=None)
        if ritz is None:
            return higher
        try:
            more = _by_elements(asked, higher.frequency, stages)[3].seconds
        except check.SimulationError:
            if many:
                return None
            many, more = True, np.inf
        if not (self.compared or "target" in asked.pieces):
            with suppress(check.SimulationError):
                other = Vectors.of(asked, stages)
                if other is not None and other.forecast.seconds < more:
                    progress.revise(other.forecast.seconds)
                    return replace(other, otherwise=None if many else replace(higher, compared=True))
        if many:
            return None
        progress.revise(more)
        return higher


def _by_elements(asked: Asked, frequency: float, stages: Stages) -> tuple[Elements, int, int, cost.Work]:
    """Elements and vectors for the infinite plate above a frequency [Hz], with the number of unknowns and the work."""
    target, reach, tolerance = asked.blow.target, mixed.RESOLVED * frequency, asked.budget.total
    assert target.mesh is not None and asked.estimates is not None
    size = vectors.size_for(target, reach, tolerance)
    if size < refinement.smallest_size(target.element, target.mesh):
        raise check.SimulationError(NO_MESH)
    elements = vectors.elements_for(target, size, asked.mass, reach, tolerance)
    lasts = max(asked.duration, mixed.LASTING * asked.mass * asked.estimates.mobility)
    phase = 2.0 * np.pi * mixed.REACH * frequency * lasts
    number = target.count_below(mixed.REACH * frequency / target.stretch)
    count = vectors.FEWEST + min(round(number), round(2.5 * phase))  # eight for each half turn
    n_dofs = target.unknowns(asked.values["at"][None], elements, stages)
    return elements, count, n_dofs, cost.by_vectors([n_dofs, n_dofs / refinement.COARSER**2], count)
