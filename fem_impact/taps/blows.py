"""Many blows of a hammer at one point, quickly: both bodies as lists of modes at that point, and runs with one step.

`fi.strike` finds its own step and estimates every error; a fit knows its step and needs thousands of blows. The runs
are those of `fi.collide` with a fixed step (tests hold both to each other).
"""

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..impact import engine
from ..impact.contact import Contact
from ..impact.history import History
from ..impact.reduced_body import ReducedBody, join_bodies, reduce_body
from ..impact.striker import Striker
from ..modes.modal import Modes, left_out, left_out_between
from .rig import FINE, MARGIN, Rig, accelerations, behind_tip

STEPS = 40.0  # [-] steps of a contact: the force is then exact to 1e-5 of its peak


@dataclass(frozen=True, eq=False, repr=False)
class TappedBody(ReducedBody):
    """A body of a tap: at its contact, with the modal velocities of unit speed, and where its response is measured."""

    measured: np.ndarray = field(kw_only=True)  # (n_points, n_modes) [kg**-0.5] shapes where the response is measured
    mass: float = field(kw_only=True)  # [kg]
    # (n_points,) [m/N] static deflection of its modes left out there, under a unit force at its contact
    softness: np.ndarray = field(kw_only=True)

    @cached_property
    def felt_mass(self) -> float:
        """Mass felt at the contact point if the body is rigid [kg]; infinite for one that cannot move rigidly."""
        rigid = self.rows[0, self.omega == 0.0]
        return 1.0 / float(rigid @ rigid) if rigid.any() else np.inf

    def scaled(self, mass: float | None, first_frequency: float | None, damping: float | None) -> "TappedBody":
        """The same body with another mass [kg], first flexible frequency [Hz] and damping ratio [-]."""
        if mass is None and first_frequency is None and damping is None:
            return self
        amplitude = 1.0 if mass is None else np.sqrt(self.mass / mass)
        flexible = self.omega > 0.0
        ratio = 1.0 if first_frequency is None else 2.0 * np.pi * first_frequency / self.omega[flexible][0]
        return replace(
            self, omega=self.omega * ratio, zeta=self.zeta if damping is None else np.where(flexible, damping, 0.0),
            rows=self.rows * amplitude, p=self.p / amplitude, measured=self.measured * amplitude,
            rest=self.rest * (amplitude / ratio) ** 2, softness=self.softness * (amplitude / ratio) ** 2,
            mass=self.mass if mass is None else mass,
        )  # fmt: skip

    def with_mode(self, frequency: float, mass: float, damping: float, gains: np.ndarray) -> "TappedBody":
        """The body with one more mode: frequency [Hz], modal mass at the contact point [kg], damping ratio, and its
        deflections (n_points,) where the response is measured over that at the contact point."""
        u, still = mass**-0.5, np.append(self.q, 0.0)
        return replace(
            self, omega=np.append(self.omega, 2.0 * np.pi * frequency), zeta=np.append(self.zeta, damping),
            rows=np.append(self.rows, [[u]], axis=1), measured=np.column_stack([self.measured, u * gains]),
            p=np.append(self.p, 0.0), q=still, bias=still,
        )  # fmt: skip


def tapped_body(part: ReducedBody, measured: np.ndarray, mass: float, softness: np.ndarray | float = 0.0) -> TappedBody:
    """A body of a blow as one of a tap."""
    same = {each.name: getattr(part, each.name) for each in fields(part)}
    return TappedBody(**same, measured=measured, mass=mass, softness=np.zeros(len(measured)) + softness)


def wall(n_points: int = 0) -> TappedBody:
    """A body that cannot move."""
    part = reduce_body(Modes.rigid(1.0), ((0, -1.0),), np.zeros((1, 0)), np.zeros((1, 1)), None)
    none = {name: getattr(part, name)[..., :0] for name in ("omega", "zeta", "rows", "q", "p", "bias")}
    return tapped_body(replace(part, **none), np.zeros((n_points, 0)), np.inf)


def of_striker(striker: Striker) -> TappedBody:
    """A striker at its contact point."""
    modes, rest = striker.modes, striker.left_out if striker.modes.dimension else None
    part = reduce_body(modes, ((0, 1.0),), striker.at[None], striker.shape[None], rest)
    return tapped_body(replace(part, p=striker.motion), np.zeros((0, modes.n_modes)), modes.mass)


def of_target(modes: Modes, at: Any, points: Any = None, compliance: float | None = None) -> TappedBody:
    """A struck body at its strike point, and where its response is measured.

    ``compliance`` is the static one at the strike point [m/N], if it is known already.
    """
    place, asked = modes.point("at", at), np.zeros((0, modes.dimension))
    if points is not None:
        asked = modes.points("points", points)
    rows, measured, rest, softness = modes.shape_at(place), modes.shape_at(asked), None, np.zeros(len(asked))
    if compliance is not None:
        rest = np.maximum(0.0, compliance - modes.modal_compliance(place)), np.zeros(1)
    elif modes.dimension:
        rest = left_out(modes, place, rows)
    if len(asked) and rest is not None and rest[0].any():
        if compliance is None:
            softness = left_out_between(modes, place, asked)[:, 0]
        else:  # of many places: a force here deflects there as one there does here, so that one solution serves all
            softness = left_out_between(modes, asked, place)[0]
    return tapped_body(reduce_body(modes, ((0, -1.0),), place, rows, rest), measured, modes.mass, softness)


def follow_blow(system: engine.KernelSystem, speed: float, step: float, horizon: float) -> History:
    """One blow of a system that moves at unit speed, at a speed [m/s] with a step in contact [s], up to a time [s]."""
    struck = system._replace(p=speed * system.p)
    pace, last = engine.Pace(STEPS * step, speed), (horizon, 0)
    return engine.run_system(struck, "A4", step, pace, last, chosen_by="the lower ends of unknown")


def longest_step(system: engine.KernelSystem, contact: Contact, duration: float) -> float:
    """Step [s] for contacts of about ``duration`` [s], short enough for the modes that the contact feels."""
    step = duration / STEPS
    if contact.rated:
        return step  # the mode that stands for the rest is a dashpot, not a vibration
    flexible = system.omega > 0.0
    share = (system.shape[0, flexible] / system.omega[flexible]) ** 2
    whole = share.sum() + (duration**2) * float((system.shape[0, ~flexible] ** 2).sum()) / 10.0
    fast = system.omega[flexible][share > 1e-6 * whole]  # others change the force by as little
    # six steps per period of the fastest mode that moves the contact: the force errs by 4e-6 of its peak
    return min(step, 2.0 * np.pi / (6.0 * fast.max())) if fast.size else step


def records(
    striker: TappedBody, target: TappedBody, contact: Contact, speeds: np.ndarray, *, duration: float, n_times: int,
    lead: int, rig: Rig, tip_mass: float,
) -> np.ndarray:  # fmt: skip
    """Fine records of blows, (n_blows, 1 + n_points, FINE (n_times + 2 MARGIN)): cell force [N], accelerations.

    Every blow begins ``lead`` samples after the begin of its record.
    """
    n_fine, first, n_own = FINE * (n_times + 2 * MARGIN), FINE * (lead + MARGIN), len(striker.omega)
    times = np.arange(n_fine - first) / (FINE * rig.rate)
    system = join_bodies((striker, target), [contact])
    step = longest_step(system, contact, duration)
    out = np.zeros((len(speeds), 1 + len(target.measured), n_fine))
    for one, speed in zip(out, speeds):
        history = follow_blow(system, float(speed), step, times[-1])
        until = int(np.searchsorted(times, history.end_time, side="right"))
        pushed = one[0, first:]
        with np.errstate(all="ignore"):  # the rate of the force, not used here, is infinite at the onset of soft laws
            pushed[:until] = history.force_at(times[:until], 0)[0]
        if len(target.measured):
            struck = slice(n_own, n_own + len(target.omega))
            one[1:, first:] = accelerations(history, struck, target.measured, pushed, times, target.softness).T
        if tip_mass:
            until = len(times) if striker.omega.any() else until
            pushed[:until] = behind_tip(history, slice(n_own), tip_mass, pushed[:until], times[:until])
    return out
