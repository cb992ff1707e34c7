"""The target by its modes up to a frequency; those above act as a spring."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base import check, progress
from ..fe import plausible, refinement
from ..fe.assembly import BY_ELEMENT
from ..fe.theory import Theory
from ..impact import accuracy
from ..impact.response import Response
from ..modes.modal import Modes, at_rest
from ..modes.shapes import FieldShapes
from ..modes.stretching import stretch
from . import cost, vectors
from .asked import Asked, Description, Forecast, Unaffordable
from .budget import NOTCH
from .target import FIRST_LOOK, Stages

MOST_MODES = {"fe": 2000, "analytic": 50_000, "modes": 50_000}  # [-] limit by source: takes about 2 GB and some minutes
# [-] a plate that needs more modes is taken as infinite above a frequency, if it overdamps the contact: a steel sheet
# of 0.3 mm then keeps 438 modes instead of 32 536
MANY_MODES = 10_000
# [-] frequency error of the shortest waves that the mesh resolves by `Theory.wave`; beams also round
SHORT_WAVES = {
    "argyris": 1e-5, "argyris and quartic": 1e-5, "hermite": 1e-9, "argyris and shear": 1e-5, "hermite and shear": 1e-9,
}  # fmt: skip
PER_MODE = 40.0  # [-] unknowns of thin flat plates for each mode of many, at 1.8 rad per triangle; measured, 38 to 42
CROWDED = 1000.0  # [-] squared perimeter over area of a strip 250 times as long as wide


@dataclass(frozen=True, eq=False)
class Modal(Description):
    """A target by its modes."""

    rings = True
    banded: bool  # whether a band of the quantities asks for more modes than the blow
    finer: float = 1.0  # [-] times as small cells of the air around it, as in `in_air`
    bare: Modes | None = None  # in a vacuum, once they are found
    attempt: int = 1

    @classmethod
    def of(
        cls, asked: Asked, stages: Stages, first: Modes | None = None, finer: float = 1.0, attempt: int = 1
    ) -> "Modal":
        """The target with as many modes as the blow needs; finds the first ones, because they show how many."""
        target, at, mass = asked.blow.target, asked.values["at"], asked.mass
        band, mesh = max((band for band in asked.quantities.values() if band), default=0.0), target.mesh
        # ten times the first modes crowd between one and two half waves across a strip: to find them takes minutes
        long = mesh is not None and mesh.dimension == 2 and mesh.perimeter**2 > CROWDED * mesh.area
        if long and target.kind == "fe" and not asked.counted:
            least = max(band, accuracy.BAND * 0.5 / asked.duration)  # not its edges, and a third at least
            crowd = round(target.count_below(least / target.stretch) / 3.0)
            _check_number(asked, 2, least, crowd, band == least)
        with stages("modes"):
            first = asked.find(FIRST_LOOK, stages=stages) if first is None else first
        modes = target.finished(first)
        with target.blame("strike"):
            point = modes.point("at", at)
        needed = accuracy.cutoff_frequency(modes, at, mass=mass, tolerance=asked.budget.for_left_out, **asked.law)
        limit, number = max(needed, band), asked.pieces.get("n_modes")
        if number is None:
            limit = asked.pieces.get("max_frequency", limit)
            # the first modes are kept even if fewer are enough
            number = max(modes.n_modes, round(target.number_below(modes, limit)))
        else:
            beyond = max(1.0, number / modes.n_modes) ** (2.0 / modes.dimension)
            limit = modes.frequencies[min(number, modes.n_modes) - 1] * beyond
        if target.modes is not None and number > target.modes.n_modes:
            number, limit = target.modes.n_modes, target.modes.frequencies[-1]
        _check_number(asked, modes.dimension, limit, number, band > needed)
        # a heavy striker rattles as fast as the body's mass does, for half a period of its own on the body as a spring
        spring = float(modes.modal_compliance(point)[0, 0])
        lasts = np.pi * (mass * spring * (mass + modes.mass) / modes.mass) ** 0.5 / asked.duration
        left = accuracy.truncation_error(modes, at, limit, mass=mass, **asked.law)
        others = "act as a spring" if asked.values["residual"] else "count for nothing, which no error covers"
        kept = f"the target keeps its modes up to {limit:.4g} Hz, about {number}; the others {others}"
        why = f"the contact lasts about {asked.duration:.3g} s"
        if band > needed:
            kept += f" ({band:g} Hz requested, {needed:.4g} Hz needed for the blow)"
        if asked.values["stretching"]:
            if modes.dimension == 1:  # the modes of a plate take long to stretch
                with target.blame("strike"):
                    stretch(modes)
            kept += "; it stiffens as it stretches"
        forecast = asked.foretell(
            "modal", errors={"target modes left out": left}, reasons=(why, kept), mass=modes.mass, n_modes=number,
            max_frequency=limit, first=first, element="closed form" if target.kind == "analytic" else None, lasts=lasts,
            notes=plausible.together(target.assumed, modes.notes, at_rest(modes, point)),
        )  # fmt: skip
        if isinstance(first.shapes, FieldShapes):
            forecast = _with_mesh(asked, forecast, first.shapes, limit * first.frequencies[-1] / modes.frequencies[-1])
        return cls(asked, forecast, band > needed, finer, attempt=attempt)

    def found(self, stages: Stages, keep: Any = None) -> "tuple[Modal, Modes]":
        """The same, and its modes; ``keep`` is a file that stores those of a costly plan."""
        with stages("modes"):
            bare = self._found_bare(stages, keep) if self.bare is None else self.bare
            modes = self.asked.blow.target.surrounded(bare, self.finer)
        return replace(self, forecast=replace(self.forecast, n_modes=modes.n_modes), bare=bare), modes

    def after(self, other: Description) -> "Modal":
        own = self.forecast
        if not isinstance(other, Modal) or other.bare is None or other.forecast.first is not own.first:
            return self
        enough = own.max_frequency is not None and own.max_frequency <= (other.forecast.max_frequency or 0.0)
        return replace(self, bare=other.bare) if enough else self

    def _found_bare(self, stages: Stages, keep: Any) -> Modes:
        """The modes in a vacuum, before `Target.finished`."""
        forecast, asked = self.forecast, self.asked
        keep = keep if forecast.costly and forecast.n_dofs else None
        assert forecast.first is not None and forecast.max_frequency is not None
        first, modes, number = forecast.first, forecast.first, asked.pieces.get("n_modes")
        ratio = asked.blow.target.finished(first).frequencies[-1] / first.frequencies[-1]
        if number is not None and number > first.n_modes:
            modes = asked.find(number, first=first, stages=stages, keep=keep)
        elif forecast.max_frequency > ratio * first.frequencies[-1] * (1.0 + 1e-9):
            modes = asked.find(FIRST_LOOK, forecast.max_frequency / ratio, first=first, stages=stages, keep=keep)
        if number is not None:
            return modes.truncated(n_modes=number)
        stated = "max_frequency" in asked.pieces
        return modes.truncated(max_frequency=forecast.max_frequency / ratio) if stated else modes

    def refined(self, hit: Response, stages: Stages) -> "Modal | None":
        """More modes if those left out turn out to matter, finer cells of the air, or a finer mesh; twice at most."""
        asked, budget, error = self.asked, self.asked.budget, hit.error
        if self.attempt == 3 or asked.counted or not asked.values["residual"]:
            return None
        target, missed = asked.blow.target, budget.missed(error, not asked.values["dt"])
        short, finer = error.truncation > budget.half, self.finer
        left = vectors.MET * (budget.total - (error.total - error.mesh))
        if missed and target.air and target.baffle and 0.0 < left < error.mesh:
            finer = min(4.0, finer * (error.mesh / left) ** 0.5)  # the error of air goes as the area of its cells
        meshed = target.kind != "fe" or asked.meshed or (self.finer == 1.0 < finer)  # cells cost less: they come first
        coarse = missed and not meshed and error.mesh > budget.cheap
        if not (short or coarse):
            return replace(self, finer=finer, attempt=self.attempt + 1) if finer > self.finer else None
        margin, fineness = (NOTCH if more_exact else 1.0 for more_exact in (short, coarse))
        budget = replace(budget, margin=budget.margin * margin, fineness=budget.fineness * fineness)
        first = None if coarse else self.forecast.first
        better = Modal.of(replace(asked, budget=budget), stages, first, finer, self.attempt + 1)
        progress.revise(better.forecast.seconds)
        return better


def _with_mesh(asked: Asked, forecast: Forecast, shapes: FieldShapes, limit: float) -> Forecast:
    """The forecast with a mesh that resolves a frequency [Hz] of the body as assembled."""
    first, system, mesh = forecast.first, shapes.system, shapes.system.mesh
    assert first is not None and first.frequency_error is not None
    side = refinement.longest_side(system.rules, asked.close)
    size = mesh.size if asked.meshed else min(mesh.size, refinement.size_for(system, None, limit, side))
    n_dofs = round(refinement.unknowns(system.element, mesh, size))
    error = max(float(first.frequency_error.max()), SHORT_WAVES[system.element] * (side / system.rules.wave) ** 8)
    reason = f"{system.element} elements of {size:.3g} m, about {n_dofs} unknowns, resolve the shortest wave"
    work = cost.NOTHING  # if the plan has found all modes, and their compliance
    if forecast.n_modes > first.n_modes:
        compared, each = system.rules.compared, _solved(system.rules, n_dofs, forecast.n_modes)
        if mesh.dimension == 2:
            finer = [n_dofs * refinement.COARSER**2] if compared else []
            at_blow = cost.AT_BLOW[system.element]
            each += [cost.compliance(n + at_blow) for n in [n_dofs, *finer]]
        work = replace(sum(each, cost.NOTHING), memory=max(part.memory for part in each))  # one mesh after another
    return replace(
        forecast, element=system.element, size=size, n_dofs=n_dofs, reasons=(*forecast.reasons, reason),
        errors={**forecast.errors, "mesh": error}, seconds=forecast.seconds + work.seconds,
        memory=forecast.memory + work.memory,
    )  # fmt: skip


def _solved(rules: Theory, n_dofs: float, n_modes: int) -> list[cost.Work]:
    """Modes on one mesh, and on the coarser one from which their errors are estimated, if they are."""
    coarser = [n_dofs / refinement.COARSER**2] if rules.compared else []
    return [cost.by_modes(n, n_modes) for n in [n_dofs, *coarser]]


def ringing_work(element: str, n_modes: int, tolerance: float) -> cost.Work:
    """So many modes of a plate for motion and sound, on a mesh as `Target.find` makes it for them."""
    rules = BY_ELEMENT[element]
    each = PER_MODE * (rules.wave / refinement.longest_side(rules, tolerance)) ** 2
    n_dofs = each * n_modes * rules.unknowns / BY_ELEMENT["argyris"].unknowns
    return sum(_solved(rules, n_dofs, n_modes), cost.NOTHING)


def _check_number(asked: Asked, dimension: int, limit: float, number: int, banded: bool) -> None:
    """Raise an error if more modes are needed than allowed; ``banded`` is whether a band of the quantities needs them.

    The compliance of modes above a frequency f falls as f**-1 on plates and f**-1.5 on beams, and so does the linear
    stiffness that it allows; the contact advised takes the steeper one, and a factor of two in f.
    """
    contact, most = asked.blow.contact, MOST_MODES[asked.blow.target.kind]
    if number <= most:
        return
    lower = (most / number) ** (2.0 / dimension)  # of the highest frequency
    if "n_modes" in asked.pieces:
        advice = f"give n_modes of at most {most}"
    elif "max_frequency" in asked.pieces or banded:
        name = "max_frequency" if "max_frequency" in asked.pieces else "a band of the quantity"
        advice = f"give {name} of at most {float(f'{0.9 * lower * limit:.1e}'):g} Hz"
    else:
        soft = contact.stiffness * (0.5 * lower) ** (0.75 * (contact.exponent + 1.0))
        advice = f"take a larger tolerance, or a softer striker or contact, with stiffness = {soft:.2g}"
    raise (check.SimulationError if banded else Unaffordable)(
        f"this blow needs about {number:.2g} modes, up to {limit:.2g} Hz, more than the limit of {most}; {advice}"
    )
