"""The target by Ritz vectors started from the blow, on a mesh and in a number that the blow needs; see `vectors`."""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from .._base import check, progress
from ..fe import refinement
from ..fe.section import Plate
from ..impact import accuracy, collision
from ..impact.compiled import build
from ..impact.contact import STICKY
from ..impact.motion import LOOKED_AT
from ..impact.response import Response
from ..modes.modal import Modes, damping_ratios
from . import audit, cost, fresh, idealisation, vectors
from .asked import Asked, Description, Unaffordable
from .budget import CHEAP
from .by_idealisation import Idealised
from .by_modes import MOST_MODES, Modal, ringing_work
from .target import FIRST_LOOK, Elements, Stages

AUDIBLE = 20e3  # [Hz] the ear's limit: no mode above is asked for unless a band of the sound is
MOST_RINGING = 400  # [-] modes for motion and sound if no band is asked for: ten seconds, a minute of a curved plate
RESOLVING = 30  # [-] unknowns of the finest mesh for each vector of a heavy striker; 17 to 47 in effectivity.py
LIGHT = 0.1  # [-] mass over that of the plate
SEVERAL = 3  # [-] impacts at least of a striker at rest until echoes throw it off; 3 to 9 on steel sheets


@dataclass(frozen=True, eq=False)
class Vectors(Description):
    """A plate by Ritz vectors."""

    rings = True
    elements: Elements  # those to begin with
    otherwise: Description | None = None  # for a blow that these cannot describe; by default the infinite plate
    whole: Modes | None = None  # all Ritz pairs

    @property
    def margin(self) -> float:
        """Divides what left-out modes of the striker may err [-]."""
        return 1.0 if self.ritz is None else self.ritz.margin

    @classmethod
    def of(cls, asked: Asked, stages: Stages) -> "Vectors | None":
        """The plate by vectors, if these can describe it and its own modes are not asked for."""
        blow, target = asked.blow, asked.blow.target
        if not (vectors.vectors_usable(target) and asked.values["residual"] and asked.plain) or asked.counted:
            asked.refuse(
                "needs a thin plate in a vacuum by elements that can be meshed again, its residual, no stretching, no "
                "n_modes or max_frequency, and no damping ratios mode by mode"
            )
            return None
        band, most = asked.quantities.get("sound"), MOST_MODES["fe"]
        if band is not None and (rings := target.count_below(band / target.stretch)) > most:
            raise check.SimulationError(
                f"the sound up to {band:g} Hz needs about {rings:.2g} modes, more than the limit of {most}; "
                f"give a band of the quantity of at most {float(f'{0.9 * band * most / rings:.1e}'):g} Hz"
            )
        with stages("modes"):
            size = asked.pieces.get("size") or vectors.size_for(target, 0.5 / asked.duration, asked.budget.total)
        assert target.mesh is not None
        smallest = refinement.smallest_size(target.element, target.mesh)
        if size < smallest and not asked.meshed:
            soft = blow.contact.stiffness * (size / smallest) ** (2.0 * (blow.contact.exponent + 1.0))
            needs, soft = refinement.unknowns(target.element, target.mesh, size), float(f"{0.9 * soft:.1e}")
            raise Unaffordable(
                f"this blow needs about {needs:.2g} unknowns, elements of {size:.2g} m, more than the limit of "
                f"{refinement.MOST_UNKNOWNS}; take a softer striker or contact, with stiffness = {soft:g}"
            )
        wanted, at = (0.5 / asked.duration, asked.budget.total), asked.values["at"][None]
        elements = vectors.elements_for(target, size, asked.mass, *wanted)
        n_dofs, first = target.unknowns(at, elements, stages), vectors.first_count(target, *wanted)
        lasts, impacts, stopped = _predicted_length(asked)
        meshes = list(vectors.compared_elements(target, elements, stages))
        if impacts > 2 and not asked.meshed:  # each multiplies the error that a mesh makes before it
            meshes.append(vectors.finer_elements(target, meshes[0], stages))
        # echoes fade by damping; without, many blows soon disagree
        ratio = float(damping_ratios(target.damping_ratio or 0.0, np.array([np.pi / asked.duration]))[0])
        lasts = max(lasts, min(asked.pressed, 1.0 / (np.pi * max(ratio, 0.01))))
        grown = round(min(cost.grown_number(first, lasts), vectors.MOST_VECTORS, n_dofs))
        # vectors that end before the echo throw the striker off by one of their own
        count = max(first, round(0.5 * grown)) if stopped else first
        unknowns = [target.unknowns(at, each, stages) for each in meshes]
        if (rattling := _vectors_if_rattling(asked, first)) > grown:
            grown, finest = rattling, max(*unknowns, RESOLVING * rattling)
            unknowns = [finest, max(unknowns[0], round(finest / refinement.COARSER**2))]
        work = cost.by_vectors(unknowns, grown)
        ringing = ringing_work(target.element, FIRST_LOOK, asked.close)
        ringing += ringing_work(target.element, ringing_count(asked), asked.close)
        why = f"the contact lasts about {asked.duration:.3g} s"
        kept = f"the target is described by about {count} Ritz vectors, more if the error demands it"
        reason = f"{target.element} elements of {size:.3g} m, smaller towards the blow, about {n_dofs} unknowns"
        if rattling or impacts > 2:
            kept += "; while the impacts of a blow that rattles are in doubt, up to four times as long as predicted"
        if asked.moving:
            reason += "; the vectors give the early motion, modes driven by the computed force the rest and the sound"
            work, ringing = work + ringing, cost.NOTHING
        shares = dict.fromkeys(("Ritz vectors", "mesh"), asked.budget.half * (1.0 - CHEAP))
        forecast = asked.foretell(
            "vectors", errors=shares, reasons=(why, kept, reason), n_modes=count, most=grown, size=size,
            n_dofs=n_dofs, element=target.element, steps=asked.budget.cheap, mass=target.mass, notes=target.assumed,
            work=work, ringing=ringing.seconds,
        )  # fmt: skip
        return cls(asked, forecast, elements)

    def found(self, stages: Stages, keep: Any = None) -> "tuple[Vectors | Modal, Modes]":
        """The same, and its vectors; modes, if the point struck is at rest, where no vector can start."""
        asked, ritz, at = self.asked, self.ritz, self.asked.values["at"]
        if ritz is None:
            wanted = 0.5 / asked.duration, asked.budget.total
            damping = 0.0 if asked.estimates is None else asked.damped_by(asked.estimates.mobility)
            shift = vectors.shift_for(*wanted, damping if np.isfinite(damping) else 0.0)
            how = *wanted, self.elements, asked.meshed, stages, shift, self.forecast.n_modes
            ritz = vectors.RitzTarget(asked.blow.target, at, *how)
        if ritz.at_rest:
            return Modal.of(asked, stages).found(stages, keep)

        def cutoff(modes: Modes, margin: float) -> float:
            allowed = replace(asked.budget, margin=margin).for_left_out
            return accuracy.tail_cutoff(modes, ritz.at, mass=asked.mass, tolerance=allowed, **asked.law)

        modes = ritz.needed_modes(cutoff)
        elements, n_dofs = ritz.elements, ritz.n_dofs
        forecast = replace(self.forecast, n_modes=ritz.count, size=elements.size, n_dofs=n_dofs)
        return replace(self, forecast=forecast, elements=elements, ritz=ritz, whole=ritz.whole), modes

    def refined(self, hit: Response, stages: Stages) -> Description | None:
        """More vectors or a finer mesh, whichever the errors demand; if neither helps, an infinite plate that may."""
        asked, budget, ritz = self.asked, self.asked.budget, self.ritz
        assert ritz is not None
        # `cost.strikes` takes all runs as 20 of an undisturbed contact; those of a blow take some eight of its last
        ritz.done += cost.strikes(8.0 / 20.0 * len(hit.history.steps), len(hit.history.omega))
        most = 4.0 * (1.0 + self.forecast.seconds)  # [s]
        if ritz.improved(hit.error, budget.total - hit.error.step, most):
            progress.revise(ritz.work.seconds)
            return self
        if "target" in asked.pieces or not budget.missed(hit.error, not asked.values["dt"]):
            return None
        if self.otherwise is not None:
            return self.otherwise
        other = Idealised.of("infinite", asked, stages, anyway=True)
        return other if other is not None and other.forecast.error < hit.error.total else None

    def completed(self, hit: Response, stages: Stages, keep: Any = None) -> Response:
        """The response with the modes that ring, which are found when they are asked for."""
        blow, ringing = self.asked.blow, partial(_ringing, self.asked, keep)
        hit, times = replace(hit, rings=ringing, vectors=self.whole), np.linspace(0.0, hit.history.end_time, LOOKED_AT)
        sounds, moving = "sound" in self.asked.quantities, blow.points if blow.moving else ()
        if sounds or not all(np.isfinite(hit.motion_error([point], times)) for point in moving):
            with stages("modes"):
                hit = replace(hit, ringing=ringing(hit))
        return super().completed(hit, stages)


def _predicted_length(asked: Asked) -> tuple[float, int, bool]:
    """How long the blow lasts on an infinite plate, in undisturbed contacts, its impacts, and whether it stops there.

    Where such a plate, with the edges nearby, stops the striker, only echoes throw it off: until the first has turned
    once, the blow goes on. (1, 1, False) if not known.
    """
    at, estimates = asked.values["at"], asked.estimates
    if estimates is None or not np.isfinite(estimates.mobility):
        return 1.0, 1, False
    mobility, echo = estimates.local
    try:
        hit = _strike_roughly(
            asked, idealisation.infinite_plate(at, estimates.mass, mobility, asked.duration), fresh.STEPS
        )
    except check.SimulationError:
        return 1.0, 1, False
    lasts, echo = max((touch.end for touch in hit.impacts), default=0.0) / asked.duration, echo / asked.duration
    if asked.damped_by(mobility) < 1.0:
        return lasts, hit.n_impacts, False
    if mobility > estimates.mobility:  # echoes find it pressing on an edge, until 3e-4 of its speed are left
        return max(echo, min(lasts, 8.0 * asked.mass * mobility / asked.duration)), SEVERAL, True
    return max(1.0, echo), SEVERAL if echo > lasts else 1, True  # still pressing, it is thrown off for good


def _strike_roughly(asked: Asked, body: Any, most: float, **how: Any) -> Response:
    """The blow on a body that stands for the target, in the time of a plan; gives up after ``most`` steps."""
    striker = collision.shortened_striker(asked.blow.striker, asked.striker_modes(1.0)[0])
    at, speed = asked.values["at"], asked.values["speed"]
    with build.uncompiled(most):
        return collision.strike(
            body, striker, asked.blow.contact, at=at, speed=speed, tolerance=audit.ROUGH,
            duration=100.0 * asked.duration, **how,  # the cost of longer blows is estimated too low
        )  # fmt: skip


def _vectors_if_rattling(asked: Asked, first: int) -> int:
    """Number of vectors for a striker that an infinite plate or a loss stops, so that the edges throw it off; else 0.

    It takes 1.6 vectors for each mode up to the highest frequency that matters, or three for each period of that as
    long as it lasts. Errors grow 200-fold on the way at most, and fall with the third power of the number: six times
    the ``first``. Within a factor of two in 11 of 11 scenes of studies/verification/effectivity.py.
    """
    target, estimates, mass, contact = asked.blow.target, asked.estimates, asked.mass, asked.blow.contact
    lost = contact.loss * asked.values["speed"]
    quicker = (1.0 + lost) ** (1.0 / (contact.exponent + 1.0))  # than without loss, as a stiffer contact
    if estimates is None or not np.isfinite(estimates.mobility):
        return 0
    if lost < STICKY and quicker * asked.damped_by(estimates.mobility) < 1.0:
        return 0
    # half a period of a heavy one on a hinged square as a spring; the first echo throws off a light one
    lasts = np.pi * estimates.mobility * (0.74 * mass * estimates.mass) ** 0.5 if mass > LIGHT * estimates.mass else 0.0
    excited = target.count_below(accuracy.BAND * 0.5 / asked.duration / target.stretch)
    if target.closed is not None and excited < 1000.0:
        with suppress(check.SimulationError):
            body = target.finished(target.closed(n_modes=FIRST_LOOK + round(excited)))
            hit = _strike_roughly(asked, body, 1000.0, residual=False, max_impacts=asked.values.get("max_impacts"))
            lasts = max((touch.end for touch in hit.impacts), default=lasts)
    highest = quicker * asked.highest(estimates.mobility)
    needed = min(1.6 * target.count_below(highest / target.stretch), 3.0 * highest * lasts, 6.0 * first)
    return round(min(needed, vectors.MOST_VECTORS))


def ringing_count(asked: Asked) -> int:
    """Predicted number of modes that ring and are found after the blow, by Weyl's law."""
    target, band = asked.blow.target, asked.quantities.get("sound")
    mesh, section = target.mesh, target.section
    assert mesh is not None and isinstance(section, Plate)
    stiffness = section.stiffness(mesh.points[mesh.cells].mean(axis=1))
    ratio = float((stiffness[:, 0, 0] / stiffness[:, 1, 1]).mean())  # waves across the grain are shorter
    # frequency times contact time: 16 of a half sine, less of smoother forces
    below = target.count_below((band or min(AUDIBLE, 8.0 / asked.duration)) / target.stretch)
    number = below * min(ratio, 1.0 / ratio) ** 0.25
    return max(FIRST_LOOK, min(MOST_MODES["fe"] if band else MOST_RINGING, round(number)))


def _ringing(asked: Asked, keep: Any, response: Response) -> Modes:
    """The modes that the force found makes ring: up to the band asked for, or as far as the force reaches."""
    target, band = asked.blow.target, asked.quantities.get("sound")
    frequencies = np.arange(0.0, AUDIBLE + 1.0, 10.0)
    force = np.abs(response.spectrum(frequencies))
    limit = band or float(frequencies[np.flatnonzero(force >= 1e-3 * force[0])[-1]])  # -60 dB are inaudible
    first = asked.find(FIRST_LOOK)
    number = round(target.number_below(target.finished(first), limit))
    most = MOST_MODES["fe"] if band else MOST_RINGING
    modes = first if number <= FIRST_LOOK else asked.find(min(number, most), first=first, keep=keep)
    return target.surrounded(modes)
