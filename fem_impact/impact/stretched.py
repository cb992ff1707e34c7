"""What a history keeps of a body that stretches, and the motion of that body."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._base import check
from .._base.check import SimulationError
from .compiled.stretched import energies_of_stretching, replay_stretched


@dataclass(frozen=True, eq=False)
class Stretched:
    """The forms of `Stretching`, which modes they belong to, and the steps in which the run took them."""

    forms: np.ndarray  # (n_forms, n_modes, n_modes) [kg**-0.5 m**-1 s**-1]
    first: int  # index of the first of these modes among those of all bodies
    base: float = 0.0  # [s] longest step; the motion after the run takes the same
    ramp: bool = True  # whether the forces are linear over a step (scheme A4), not constant (A)

    def __repr__(self) -> str:
        return check.brief(self)

    def __post_init__(self) -> None:
        check.lock_arrays(self)

    def energy(self, q: np.ndarray, modes: slice = slice(None)) -> float:
        """Energy [J] of stretching at a state (n_all,); zero if these modes are not among ``modes``."""
        start, stop, _ = modes.indices(len(q))
        if not start <= self.first < stop:
            return 0.0
        return float(energies_of_stretching(self.forms, self.first, np.array(q, float)[None])[0])

    def states(self, history: Any, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Modal displacements and velocities (n_times, n_all) of a `History` at ascending times."""
        q, p = np.empty((2, len(times), len(history.omega)))
        if not len(times):
            return q, p
        time, step, state, hint = history.reached.get("last", (np.inf, 0, None, None))
        if times[0] < time:
            time, step, hint = 0.0, 0, np.zeros(self.forms.shape[1])
            state = np.stack([history.start_q, history.start_p])
        state, hint = state.copy(), hint.copy()
        failed, time, step = replay_stretched(
            history.omega, history.zeta, history.shape, history.bias, history.steps, self.forms, self.first,
            int(self.ramp), self.base, float(time), int(step), state, hint, np.array(times, float), q, p,
        )  # fmt: skip
        history.reached["last"] = time, step, state, hint
        if failed:
            raise SimulationError(f"the stretching of the motion did not settle at {time:.4g} s in any step")
        return q, p
