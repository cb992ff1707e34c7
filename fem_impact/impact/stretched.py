"""What a history keeps of a body that stretches, and the motion of that body."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base import check
from .._base.check import SimulationError
from .compiled.stretched import Stretch, energies_of_stretching, replay_stretched


@dataclass(frozen=True, eq=False, repr=False)
class Stretched(check.Locked):
    """The forms of `Stretching`, which modes they belong to, and the steps in which the run took them."""

    forms: np.ndarray  # (n_forms, n_modes, n_modes) [kg**-0.5 m**-1 s**-1]
    linear: np.ndarray  # (n_forms, n_modes) [s**-1], or (0, n_modes)
    first: int  # index of the first of these modes among those of all bodies
    base: float = 0.0  # [s] longest step; the motion after the run takes the same
    ramp: bool = True  # whether the forces are linear over a step (scheme A4), not constant (A)

    def __post_init__(self) -> None:
        n_forms, n = self.forms.shape[:2]
        if self.linear.shape not in ((n_forms, n), (0, n)):  # the kernels trust it
            raise ValueError(f"linear must be of {n_forms} or no forms and {n} modes, got {self.linear.shape}")
        super().__post_init__()

    @property
    def kernel(self) -> Stretch:
        """The same for the kernels."""
        return Stretch(self.forms, self.linear, self.first)

    def part(self, n_forms: int, n_modes: int) -> "Stretched":
        """The first forms of the first modes only."""
        forms, linear = self.forms[:n_forms, :n_modes, :n_modes], self.linear[:n_forms, :n_modes]
        return replace(self, forms=np.ascontiguousarray(forms), linear=np.ascontiguousarray(linear))

    def energy(self, q: np.ndarray, modes: slice = slice(None)) -> float:
        """Energy [J] of stretching at a state (n_all,); zero if these modes are not among ``modes``."""
        start, stop, _ = modes.indices(len(q))
        if not start <= self.first < stop:
            return 0.0
        return float(energies_of_stretching(self.kernel, np.array(q, float)[None])[0])

    def states(self, history: Any, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Modal displacements and velocities (n_times, n_all) of a `History` at ascending times.

        Goes on from the first or the last of the times before, as blocks of them may overlap.
        """
        start = 0.0, 0, np.zeros(self.forms.shape[1]), history.start_q, history.start_p
        found, times = [np.empty((2, 0, len(history.omega)))], np.array(times, float)
        for name, part in (("first", times[:1]), ("last", times[1:])):
            if not len(part):
                continue
            known = [each for each in history.reached.values() if each[0] <= part[0]]
            begin = max(known, key=lambda each: each[0], default=start)
            for array in begin[2:]:
                array.setflags(write=False)  # as the others; numba would compile the kernel again for writable ones
            system = history.system._replace(q=begin[3], p=begin[4])
            states = np.empty((2, len(part), len(history.omega)))
            how = self.kernel, history.steps, int(self.ramp), self.base, begin[:3]
            failed, *begin = replay_stretched(system, *how, part, states)
            history.reached[name] = tuple(begin)
            if failed:
                raise SimulationError(f"the stretching of the motion did not settle at {begin[0]:.4g} s in any step")
            found.append(states)
        states = np.concatenate(found, axis=1)
        return states[0], states[1]
