"""How a body moves in and after a blow: by its modes in the run, or by others that the force found makes ring."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..modes.modal import Modes, left_out_between
from ..modes.shapes import SampledShapes
from ..modes.stretching import stretch
from .history import History
from .reduced_body import Ends

if TYPE_CHECKING:
    from .response import Response

# [-] two descriptions of one body may differ by this in mass and compliance: meshes do by less, other bodies by more
ONE_BODY = 1e-2
# [-] largest difference of descriptions up to which Ritz vectors give a motion: as much as modes err that are found
# as far as the force reaches
MOVED = {"displacement": 1e-2, "velocity": 3e-2}
LOOKED_AT = 200  # [-] times at which this error is estimated, evenly among those asked for; more only cost time


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """The motion of one body of a blow."""

    modes: Modes
    history: History  # that holds the motion of these modes
    part: slice  # their columns in it
    ends: Ends | None  # where forces act on it; None if nothing is left out there that yields

    def states(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Modal displacements and velocities (n_times, n_modes) at times (n_times,) in any order."""
        order = np.argsort(times, kind="stable")
        q, p = (state[:, self.part] for state in self.history.states(times[order]))
        if np.all(order[:-1] < order[1:]):
            return q, p
        back = np.argsort(order)
        return q[back], p[back]

    def at(self, points: Any, times: np.ndarray, rate: bool = False, residual: bool = True) -> np.ndarray:
        """Displacement [m], or its rate [m/s], (n_times, n_points)."""
        motion = self.states(times)[rate] @ self.modes.shape_at(points).T  # (n_times, n_modes) @ (n_modes, n_points)
        ends = self.ends
        if ends is None or not residual:
            return np.asarray(motion)
        force = np.stack([-sign * self.history.force_at(times, i)[rate] for i, sign in ends.touched], axis=1)
        if not rate:
            force[:, 0] += ends.dip_force
        return np.asarray(motion + force @ self.softness(points).T if force.any() else motion)

    def softness(self, points: Any) -> np.ndarray:
        """Static deflection of the modes left out at points under unit forces at its ends, (n_points, n_ends) [m/N]."""
        asked = self.modes.points("points", points)
        return np.zeros((len(asked), 1)) if self.ends is None else left_out_between(self.modes, self.ends.points, asked)


def of_run(hit: "Response", body: int) -> BodyMotion:
    """The motion of a body by the modes that carried the blow."""
    ends = hit.ends[body] if hit.ends and hit.ends[body].rest.any() else None
    return BodyMotion(hit.bodies[body], hit.history, hit.body_slice(body), ends)


def driven_motion(hit: "Response", modes: Modes) -> BodyMotion:
    """The motion of the target, at rest before the blow, by other modes under the force found."""
    assert hit.at is not None
    still, push, history = np.zeros(modes.n_modes), constant_force(hit), hit.history
    shape = -modes.shape_at(hit.at[None])
    start = {"start_q": still, "start_p": still, "end_q": still, "end_p": still, "bias": -push * shape[0]}
    if history.stretched is not None:
        found = stretch(modes)
        own = replace(history.stretched, forms=found.forms, linear=found.linear, first=0)
        history = replace(history, stretched=own)
    history = replace(history, omega=modes.omega, zeta=modes.damping_ratio, shape=shape, **start)
    ends = Ends(hit.at[None], ((0, -1.0),), push, np.zeros((1, 1)), dip_force=push)
    return BodyMotion(modes, history, slice(None), ends)


def constant_force(hit: "Response") -> float:
    """Constant force [N] on the target at the strike point."""
    part = hit.body_slice(len(hit.bodies) - 1)
    row = hit.history.shape[0, part]
    return -float(hit.history.bias[part] @ row) / (float(row @ row) or 1.0)


def check_same_body(hit: "Response", modes: Modes) -> None:
    """Raise ValueError unless modes may describe the motion of the target of a blow."""
    if hit.at is None:
        raise ValueError("on needs a blow of `strike`, with one strike point")
    if hit.moving:
        raise ValueError("on needs a blow on a body at rest: only its own modes know how this one moved before")
    point = modes.point("at", hit.at)
    struck = hit.bodies[-1]
    whole, softness = struck.shapes.compliance(point)[0, 0], modes.shapes.compliance(point)[0, 0]
    sampled = isinstance(modes.shapes, SampledShapes)  # it may not know the modes left out
    if not np.isclose(modes.mass, struck.mass, rtol=ONE_BODY) or not (
        sampled or np.isclose(softness, whole, rtol=ONE_BODY)
    ):
        raise ValueError(
            f"modes must be of the body struck, {struck.mass:g} kg that yield {whole:.4g} m/N, got "
            f"{modes.mass:g} kg and {softness:.4g} m/N"
        )


def by_other_modes(hit: "Response") -> tuple[BodyMotion, ...]:
    """The motion of the target by its modes, in the coarser run, by half of the modes and by softer ones.

    Empty where these do not show how far it is known: of a body that moved already, and of `collide`.
    """
    if hit.at is None or hit.moving or not hit.runs:
        return ()
    modes, other = hit.target, replace(hit, history=hit.runs[0])
    found = [driven_motion(hit, modes), driven_motion(other, modes)]
    if hit.ends[-1].rest.any():
        found.append(driven_motion(hit, modes.truncated(n_modes=max(1, modes.n_modes // 2))))
    if modes.frequency_error is not None:
        found.append(driven_motion(hit, replace(modes, omega=modes.omega / (1.0 + modes.frequency_error))))
    return tuple(found)


def largest_difference(
    descriptions: Sequence[BodyMotion], points: Any, times: np.ndarray, rate: bool, until: float | None
) -> float:
    """How far the motion by other descriptions of a body is from that by the first [-], over the largest asked for.

    Of modes all differences add up. Of vectors, which describe a run ``until`` its end [s], the largest counts; it is
    infinite where it exceeds `MOVED`, and long after the end. Infinite for a single description.
    """
    # after twice the run, later echoes may be missing from all vectors
    if len(descriptions) < 2 or (until is not None and times.size and times.max() > 2.0 * until):
        return float("inf")
    if len(times) > LOOKED_AT:
        times = times[np.linspace(0, len(times) - 1, LOOKED_AT).astype(int)]
    first, *others = (each.at(points, times, rate) for each in descriptions)
    largest = float(np.abs(first).max(initial=0.0)) or 1.0
    apart = [float(np.abs(other - first).max(initial=0.0)) / largest for other in others]
    if until is None:
        return sum(apart)
    return max(apart) if max(apart) <= MOVED["velocity" if rate else "displacement"] else float("inf")
