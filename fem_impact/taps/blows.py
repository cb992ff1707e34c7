"""Many blows of a hammer at one point, quickly: the bodies as lists of modes at that point, and the runs of the engine.

`fi.strike` finds its own step and estimates every error; a fit knows its step and needs thousands of blows. The runs
are those of `fi.collide` with a fixed step (tests hold both to each other).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base import check
from .._base.check import SimulationError
from .._base.rounding import EPSILON, ROUNDING
from ..impact.compiled import layout, record
from ..impact.compiled.bundles import KernelSystem, Limits
from ..impact.compiled.energy import run_energy
from ..impact.contact import Contact
from ..impact.history import History
from ..impact.reduced_body import rest_mode
from ..impact.striker import Striker
from ..modes.modal import Modes
from . import rig as rigs
from .rig import FINE, MARGIN, Rig

STEPS = 40.0  # [-] steps of a contact: the force is then exact to 1e-5 of its peak
FASTEST = 6.0  # [-] steps per period of the fastest mode that the contact sees: the force errs by 4e-6 of its peak
MOST_STEPS = 50_000  # [-] of one blow
# [-] modes with less than this share of the compliance do not set the step: they change the force by as little
SEEN = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Body(check.Brief):
    """A body as its contact point knows it."""

    omega: np.ndarray  # (n_modes,) [rad/s]
    zeta: np.ndarray  # (n_modes,) [-]
    row: np.ndarray  # (n_modes,) [kg**-0.5] shapes at the contact point
    motion: np.ndarray  # (n_modes,) [kg**0.5] modal velocities of unit speed, of a striker
    rows: np.ndarray  # (n_points, n_modes) [kg**-0.5] shapes where the response is measured
    rest: float = 0.0  # [m/N] residual compliance at the contact point
    dimension: int = 0
    mass: float = np.inf  # [kg]

    @property
    def felt_mass(self) -> float:
        """Mass felt at the contact point if the body is rigid [kg]; infinite for one that cannot move rigidly."""
        rigid = self.row[self.omega == 0.0]
        return 1.0 / float(rigid @ rigid) if rigid.any() else np.inf

    def scaled(self, mass: float | None, first_frequency: float | None, damping: float | None) -> "Body":
        """The same body with another mass [kg], first flexible frequency [Hz] and damping ratio [-]."""
        amplitude = 1.0 if mass is None else np.sqrt(self.mass / mass)
        flexible = self.omega > 0.0
        ratio = 1.0 if first_frequency is None else 2.0 * np.pi * first_frequency / self.omega[flexible][0]
        zeta = self.zeta if damping is None else np.where(flexible, damping, 0.0)
        return replace(
            self, omega=self.omega * ratio, zeta=zeta, row=self.row * amplitude, motion=self.motion / amplitude,
            rows=self.rows * amplitude, rest=self.rest * (amplitude / ratio) ** 2,
            mass=self.mass if mass is None else mass,
        )  # fmt: skip

    def with_mode(self, frequency: float, mass: float, damping: float, gains: np.ndarray) -> "Body":
        """The body with one more mode: frequency [Hz], modal mass at the contact point [kg], damping ratio, and its
        deflections (n_points,) where the response is measured over that at the contact point."""
        u = mass**-0.5
        return replace(
            self, omega=np.append(self.omega, 2.0 * np.pi * frequency), zeta=np.append(self.zeta, damping),
            row=np.append(self.row, u), motion=np.append(self.motion, 0.0),
            rows=np.column_stack([self.rows, u * gains]),
        )  # fmt: skip


def wall(n_points: int = 0) -> Body:
    """A body that cannot move."""
    none = np.zeros(0)
    return Body(none, none, none, none, np.zeros((n_points, 0)))


def of_striker(striker: Striker) -> Body:
    """A striker at its contact point."""
    rest = float(striker.left_out[0][0, 0]) if striker.modes.dimension else 0.0
    modes = striker.modes
    return _body(modes, striker.shape, striker.motion, np.zeros((0, modes.n_modes)), rest)


def of_target(modes: Modes, at: Any, points: Any = None, softness: float | None = None) -> Body:
    """A struck body at its strike point, and where its response is measured.

    ``softness`` is the static compliance at the strike point [m/N], if it is known already.
    """
    place = modes.point("at", at)
    row = modes.shape_at(place)[0]
    rows = np.zeros((0, modes.n_modes)) if points is None else modes.shape_at(points)
    if softness is not None:
        rest = max(0.0, softness - float(modes.modal_compliance(place)[0, 0]))
    else:
        rest = float(modes.residual_compliance(place)[0, 0]) if modes.dimension else 0.0
    return _body(modes, row, np.zeros(modes.n_modes), rows, rest)


def _body(modes: Modes, row: np.ndarray, motion: np.ndarray, rows: np.ndarray, rest: float) -> Body:
    carried = np.square(row[modes.omega > 0.0] / modes.omega[modes.omega > 0.0]).sum()
    rest = rest if rest > ROUNDING * (rest + carried) else 0.0
    return Body(modes.omega, modes.damping_ratio, row, motion, rows, rest, modes.dimension, modes.mass)


@dataclass(frozen=True, eq=False, repr=False)
class StruckPair(check.Brief):
    """Striker and struck body in the lists of the engine."""

    omega: np.ndarray
    zeta: np.ndarray
    shape: np.ndarray
    motion: np.ndarray
    law: np.ndarray
    striker: slice
    target: slice
    rows: np.ndarray
    rated: bool  # whether the force depends on how fast the contact is pressed


def pair(striker: Body, target: Body, contact: Contact) -> StruckPair:
    """Both bodies with one contact; their residual compliances as `impact.collision` joins them."""
    n, m = len(striker.omega), len(target.omega)
    omega, zeta = np.append(striker.omega, target.omega), np.append(striker.zeta, target.zeta)
    shape, motion = np.append(striker.row, -target.row), np.append(striker.motion, np.zeros(m))
    law = np.array([contact.numbers])
    for body, sign in ((striker, 1.0), (target, -1.0)):
        if body.rest <= 0.0:
            continue
        if not contact.rated:
            law[0, layout.COMPLIANCE] += body.rest
            continue
        above, damping = rest_mode(body.dimension, body.omega[-1], body.zeta[-1], True)
        omega, zeta = np.append(omega, above), np.append(zeta, damping)
        shape, motion = np.append(shape, sign * np.sqrt(body.rest) * above), np.append(motion, 0.0)
    return StruckPair(
        omega, zeta, shape[None], motion, law, slice(0, n), slice(n, n + m), target.rows, contact.rated
    )  # fmt: skip


def run(bodies: StruckPair, speed: float, step: float, horizon: float) -> History:
    """One blow at a speed [m/s] with a step in contact [s], up to a time [s]."""
    n = len(bodies.omega)
    still = np.zeros(n)
    start = speed * bodies.motion
    parts = (bodies.omega, bodies.zeta, bodies.shape, np.zeros(1), still, bodies.law, still, start)
    for part in parts:
        part.setflags(write=False)  # or numba would compile the kernel again for writable arrays
    rounding = float(EPSILON * STEPS * step * speed), float(ROUNDING * speed)
    limits = Limits(*rounding, float(horizon), 0, MOST_STEPS)
    result = run_energy(KernelSystem(*parts), None, 1, float(step), limits)
    if result[6] in (record.EXHAUSTED, record.FAILED):
        raise SimulationError(f"a blow at {speed:.3g} m/s did not end within {MOST_STEPS} steps of {step:.2g} s")
    return History(*parts, *result)


def longest_step(bodies: StruckPair, duration: float) -> float:
    """Step [s] for contacts of about ``duration`` [s], short enough for the modes that the contact feels."""
    step = duration / STEPS
    if bodies.rated:
        return step  # the mode that stands for the rest is a dashpot, not a vibration
    flexible = bodies.omega > 0.0
    share = (bodies.shape[0, flexible] / bodies.omega[flexible]) ** 2
    whole = share.sum() + (duration**2) * float((bodies.shape[0, ~flexible] ** 2).sum()) / 10.0
    fast = bodies.omega[flexible][share > SEEN * whole]
    return min(step, 2.0 * np.pi / (FASTEST * fast.max())) if fast.size else step


def records(
    bodies: StruckPair, speeds: np.ndarray, *, duration: float, n_times: int, lead: int, rig: Rig, tip_mass: float
) -> np.ndarray:
    """Fine records of blows, (n_blows, 1 + n_points, FINE (n_times + 2 MARGIN)): cell force [N], accelerations.

    Every blow begins ``lead`` samples after the begin of its record.
    """
    n_fine = FINE * (n_times + 2 * MARGIN)
    first = FINE * (lead + MARGIN)
    times = np.arange(n_fine - first) / (FINE * rig.rate)
    step = longest_step(bodies, duration)
    n_points = len(bodies.rows)
    out = np.zeros((len(speeds), 1 + n_points, n_fine))
    moves = bool(tip_mass) and bool(bodies.omega[bodies.striker].any())
    for one, speed in zip(out, speeds):
        history = run(bodies, float(speed), step, times[-1])
        until = int(np.searchsorted(times, history.end_time, side="right"))
        pushed = one[0, first:]
        pushed[:until] = _force(history, times[:until])
        if n_points:
            one[1:, first:] = rigs.accelerations(history, bodies.target, bodies.rows, pushed, times).T
        if tip_mass:
            until = len(times) if moves else until
            pushed[:until] = rigs.behind_tip(history, bodies.striker, tip_mass, pushed[:until], times[:until])
    return out


def _force(history: History, times: np.ndarray) -> np.ndarray:
    """Contact force [N] at ascending times (n_times,) from zero to the end of the run."""
    begun, lengths = history.steps[:, layout.START], history.steps[:, layout.LENGTH]
    if not len(begun):
        return np.zeros(len(times))
    rows = np.searchsorted(begun, times, side="right") - 1
    part = np.minimum((times - begun[rows]) / lengths[rows], 1.0)
    found = np.empty((2, len(times)))
    with np.errstate(all="ignore"):  # the rate of the force, not used here, is infinite at the onset of soft laws
        record.forces(history.steps, history.now, history.law, history.n_coefficients, rows, 0, part, found)
    found[0][~history.pressed[rows, 0]] = 0.0
    return found[0]
