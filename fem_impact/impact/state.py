"""Where all bodies of a blow are at one time and how they move, so that another blow can start there."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base import check
from .._base.rounding import SAME
from ..modes.modal import Modes
from .compiled import record
from .contact import Contact
from .reduced_body import ReducedBody
from .stepping import richardson
from .striker import Striker

if TYPE_CHECKING:
    from .response import Response


@dataclass(frozen=True, eq=False, repr=False)
class State(check.Brief):
    """The motion of all bodies of a blow at one time; `Response.state` makes it."""

    time: float  # [s] since the start of that blow
    bodies: tuple[Modes, ...]
    displacements: tuple[np.ndarray, ...]  # (n_modes,) [m kg**0.5] of each body
    velocities: tuple[np.ndarray, ...]  # (n_modes,) [m kg**0.5/s]
    force: np.ndarray  # (n_contacts, 2) [N], [N/s] contact forces and their rates
    error: float  # [-] estimated, of the blow so far
    striker: Striker | None = None
    contacts: tuple[Contact, ...] = ()
    at: np.ndarray | None = None  # (dimension,) [m] strike point
    # (n_contacts, 2, 2) [N], [N/s] at first and second body: forces that deflect the modes left out as they are, rates
    pressed: np.ndarray = field(default_factory=lambda: np.zeros((0, 2, 2)))  # by default the forces that act
    # of each body (2, n_modes): by how much displacements and velocities may err together, by default by ``error``
    doubts: tuple[np.ndarray, ...] = ()
    # (2, n_contacts) what contacts remember, [m] if they yield, [m**exponent] of felt, and by how much it may err
    memory: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))
    late: float = 0.0  # [s] how much later all this would be reached: doubts of a cut while something touches

    def __post_init__(self) -> None:
        if not len(self.pressed):
            check.settle(self, pressed=np.repeat(self.force[:, None], 2, axis=1))
        if not self.memory.size:
            check.settle(self, memory=np.zeros((2, len(self.force))))
        if not self.doubts:
            each = zip(self.bodies, self.displacements, self.velocities)
            check.settle(self, doubts=tuple(self.error * flexible_part(*body) for body in each))
        check.lock_arrays(self)
        for array in (*self.displacements, *self.velocities, *self.doubts):
            array.setflags(write=False)

    @property
    def otherwise(self) -> "State":
        """The same bodies as they would move if the blow before erred as estimated."""
        q = tuple(q + doubt[0] for q, doubt in zip(self.displacements, self.doubts))
        p = tuple(p + doubt[1] for p, doubt in zip(self.velocities, self.doubts))
        memory, doubt = self.memory
        changed = np.copysign(np.maximum(0.0, np.abs(memory) + doubt), memory)
        return replace(self, displacements=q, velocities=p, memory=np.array([changed, doubt]))

    def of(self, body: int, name: str, modes: Modes) -> tuple[np.ndarray, np.ndarray]:
        """Modal displacements and velocities (n_modes,) of a body; ValueError unless ``modes`` are its own."""
        mine = self.bodies[body]
        if modes is not mine and not (_same_body(modes, mine) and modes.n_modes == mine.n_modes):
            raise ValueError(
                f"{name} must be those of the body that moves at the start, {mine.n_modes} modes of {mine.mass:g} kg, "
                f"got {modes.n_modes} modes of {modes.mass:g} kg; after a blow on a System give hit.target"
            )
        return self.displacements[body], self.velocities[body]

    def states(self, bodies: Sequence[Modes], laws: Sequence[Contact]) -> list[tuple[np.ndarray, np.ndarray]]:
        """The states of all bodies of `collide`; ValueError unless bodies and contacts are those of the blow before."""
        if len(bodies) != len(self.bodies) or tuple(laws) != self.contacts:
            raise ValueError(
                f"start must come from a blow of the same bodies and contacts, got {len(self.bodies)} bodies and "
                f"{len(self.contacts)} contacts for {len(bodies)} and {len(laws)}"
            )
        return [self.of(i, f"bodies[{i}]", modes) for i, modes in enumerate(bodies)]

    def go_on(self, part: ReducedBody) -> ReducedBody:
        """A body as its contacts press it in this state and remember."""
        ends = [i for i, _ in part.touched]
        pressed = self.pressed[ends, [int(sign < 0.0) for _, sign in part.touched]]
        return replace(part, pressed=pressed, memory=self.memory[0, ends])

    def same_striker(self, striker: Striker, law: Contact, at: Any) -> Striker:
        """The striker that goes on; ValueError if it, its contact or the strike point is another than before."""
        mine = self.striker
        same = (
            mine is not None
            and _same_body(mine.modes, striker.modes)
            and (mine.hand, mine.gravity) == (striker.hand, striker.gravity)
        )
        if mine is None or not same or not np.array_equal(mine.at, striker.at):
            raise ValueError("striker must be the one of the blow before if speed is None; give its speed")
        if law != self.contacts[0] or self.at is None or not np.array_equal(self.at, at[0]):
            raise ValueError("contact and at must be those of the blow before if speed is None; give a speed")
        return mine

    def displacement(self, points: Any, *, body: int = -1) -> np.ndarray:
        """Displacement [m] of a body at points (n_points, dimension) [m], by its modes, (n_points,)."""
        return self.bodies[body].shape_at(points) @ self.displacements[body]

    def velocity(self, points: Any, *, body: int = -1) -> np.ndarray:
        """Velocity [m/s] of a body at points (n_points, dimension) [m], by its modes, (n_points,)."""
        return self.bodies[body].shape_at(points) @ self.velocities[body]

    @property
    def energies(self) -> tuple[float, ...]:
        """Kinetic and elastic energy [J] of each body."""
        parts = zip(self.bodies, self.displacements, self.velocities)
        return tuple(0.5 * float(p @ p + (modes.omega * q) @ (modes.omega * q)) for modes, q, p in parts)

    def summary(self) -> str:
        """The state in words."""
        each = ", ".join(f"{x:.4g} J" for x in self.energies)
        touch = f"contact forces {', '.join(f'{x:.4g}' for x in self.force[:, 0])} N" if self.force.any() else "apart"
        return f"{self.time * 1e3:.4g} ms after the start, {touch}; energies of {len(self.bodies)} bodies: {each}"


def flexible_part(modes: Modes, q: np.ndarray, p: np.ndarray) -> np.ndarray:
    """How a body moves, (2, n_modes), its rigid position left out."""
    return np.array([np.where(modes.omega == 0.0, 0.0, q), p])


def _same_body(one: Modes, other: Modes) -> bool:
    """Whether both describe the same body, perhaps with another number of modes."""
    n = min(one.n_modes, other.n_modes)
    return bool(np.isclose(one.mass, other.mass, rtol=SAME) and np.allclose(one.omega[:n], other.omega[:n], rtol=SAME))


def state_at(hit: "Response", time: float | None) -> State:
    """The state of a blow, by default at the end of its run; see `Response.state`."""
    h, end = hit.history, hit.history.end_time
    time = end if time is None else check.non_negative("time", time, "s")
    if time > end and h.status not in (record.FINISHED, record.SETTLED):
        raise ValueError(f"time must be at most {end:g} s, where the run stopped before its end, got {time:g} s")
    own = h.state(time)
    states = [own[:, hit.body_slice(body)] for body in range(len(hit.bodies))]
    if hit.target is not hit.bodies[-1]:
        states[-1] = np.vstack(hit.modal_state([time]))
    forces = np.array([h.force_at(np.array([time]), i) for i in range(len(hit.contacts))])[:, :, 0]
    which, parts = h.contacts[:, 4].astype(int), np.isfinite(h.contacts[:, 6])
    forces[which[parts & (np.abs(h.contacts[:, 1] - time) <= SAME * time)]] = 0.0  # what steps leave of it at a release
    forces[forces[:, 0] <= SAME * hit.peak_force] = 0.0
    pressed = np.repeat(forces[:, None], 2, axis=1)
    for ends in hit.ends:
        for (i, sign), force in zip(ends.touched, ends.pressed(h.omega, own)):
            pressed[i, int(sign < 0.0)] = force
    bodies = (*hit.bodies[:-1], hit.target)
    doubts, memory, late = _doubts(hit, time, own, states, bool(forces.any()))
    return State(
        time, bodies, tuple(q for q, _ in states), tuple(p for _, p in states), forces, min(hit.error.total, 1.0),
        hit.striker, hit.contacts, hit.at, pressed, doubts, memory, late,
    )  # fmt: skip


def _doubts(
    hit: "Response", time: float, own: np.ndarray, states: list[np.ndarray], touching: bool
) -> tuple[Any, np.ndarray, float]:
    """How far all bodies may be from a state of a blow, ``own`` that of its run: `State.doubts`, `memory` and `late`.

    Its runs show what its steps and the blow before it do to them, which of other causes are as wrong as the numbers of
    the blow. Where the run was cut as an impact ended while other contacts last, each run counts as it was cut itself.
    """
    error, bodies = hit.error, (*hit.bodies[:-1], hit.target)
    shown = error.step + error.inherited  # of 1 and more, where there may be other impacts, runs show nothing
    runs = hit.runs if shown < 1.0 and hit.target is hit.bodies[-1] else ()
    other = min(1.0, error.total - (shown if runs else 0.0))
    memory = hit.history.remembered(time, own)
    found, lost = [other * flexible_part(modes, *state) for modes, state in zip(bodies, states)], other * np.abs(memory)
    over = richardson(hit.scheme, hit.history.law)[0]
    cut, late = touching and time == hit.history.end_time and hit.history.status == record.IMPACTS, 0.0

    def extrapolated(fine: Any, coarse: Any, *moved: Any) -> Any:
        return (coarse - fine) / over + (moved[0] - coarse if moved else 0.0)

    if runs:
        times = [run.end_time if cut else max(0.0, time - begun) for run, begun in zip(runs, (0.0, hit.late))]
        late = extrapolated(time, times[0], *(end + hit.late for end in times[1:])) if cut else 0.0
        ends = [run.state(each) for run, each in zip(runs, times)]
        whole = extrapolated(own, *ends)
        found = [doubt + whole[:, hit.body_slice(i)] for i, doubt in enumerate(found)]
        kept = [np.abs(run.remembered(each, end)) for run, each, end in zip(runs, times, ends)]
        lost += extrapolated(np.abs(memory), *kept)
    return tuple(found), np.array([memory, lost]), late
