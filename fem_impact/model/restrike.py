"""Strike again with other frequencies, damping or contact, and say how much each quantity changes.

Every doubt about the model is examined alike: where it does not apply, it `Doubt.holds`; else the blow is struck again
with the better model, which is `Doubt.judged` to change it so much; what that takes may be `Doubt.unknown`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from .._base.check import SimulationError
from .._base.rounding import SAME
from ..impact import accuracy, distance
from ..impact.assumption import Assumption
from ..impact.compiled.law import columns
from ..impact.engine import follow_again
from ..impact.history import History, mode_energy
from ..impact.response import Response
from ..modes.modal import Modes
from .bending import Bending, Known, integrate_shapes, known_of


@dataclass(frozen=True, eq=False)
class Struck:
    """A finished blow, with what is known of its bodies, ready to be struck again."""

    hit: Response  # before the blow, that on a wall
    bodies: tuple[Modes, Modes]  # striker and target
    target: Known | None  # None if its shapes are not known
    striker: Known | None
    ideal: str = ""  # "rigid" or "infinite" if the target was simplified so
    clearance: float | None = None  # [m] from the strike point to the nearest edge; None if it is not known
    place: np.ndarray | None = None  # (1, dimension) [m] strike point on the target, before the blow

    @property
    def planned(self) -> bool:
        """Whether the blow is yet to come: nothing is struck again."""
        return self.place is not None

    @cached_property
    def bending(self) -> Bending | None:
        """Integrals of the target's shapes; None if they are not known or the target was simplified."""
        return None if self.target is None or self.ideal else integrate_shapes(self.target)

    @property
    def quantities(self) -> tuple[str, ...]:
        """The quantities asked for."""
        return tuple(self.hit.quantities)

    @cached_property
    def omega(self) -> float:
        """Angular frequency [rad/s] of the contact: pi over the duration of the longest impact, or that on a wall."""
        longest = max((impact.duration for impact in self.hit.impacts), default=0.0)
        if longest > 0.0:
            return float(np.pi / longest)
        mass = 1.0 if self.hit.striker is None else self.hit.striker.felt_mass
        return 2.0 * np.pi * accuracy.contact_resonance(self.hit.contact, mass, self.hit.speed or 1.0)

    @property
    def mine(self) -> slice:
        """The columns of the target in the history."""
        return self.hit.body_slice(len(self.hit.bodies) - 1)

    @cached_property
    def end(self) -> float:
        """When the last impact ends [s], or the run where there is none."""
        return max((impact.end for impact in self.hit.impacts), default=self.hit.history.end_time)

    def energy_in(self, columns: slice) -> np.ndarray:
        """Energy [J] of some modes after the last impact, without rigid motions."""
        q, p = (x[0, columns] for x in self.hit.history.states(np.array([self.end])))
        omega = self.hit.history.omega[columns]
        return np.where(omega > 0.0, mode_energy(omega, q, p), 0.0)

    @cached_property
    def target_energy(self) -> np.ndarray:
        """Energy [J] of each of the target's modes after the last impact, without rigid motions."""
        return self.energy_in(self.mine)

    @cached_property
    def before(self) -> Response:
        """The blow to compare with: as found, in the steps of a first run."""
        return replace(self.hit, history=follow_again(self.hit.history), audit=None)

    def changes(self, **changed: Any) -> dict[str, float | None]:
        """Change of each quantity, as `distance.of_blows`; None if that blow fails. Of the sound see `add_sound`, too.

        ``changed`` are fields of the system, or ``stretched`` of the history.
        """
        return self.between({}, changed)

    def between(self, start: Mapping[str, Any], end: Mapping[str, Any]) -> dict[str, float | None]:
        """As `changes`, between two blows with other fields, if the first is not the one found."""
        h, system = self.hit.history, self.hit.history.system
        same = (
            name != "stretched" and np.allclose(columns(x), columns(getattr(system, name)), rtol=SAME, atol=0.0)
            for name, x in end.items()
        )
        if self.planned or (not start and all(same)):
            return dict.fromkeys(self.quantities, 0.0)
        try:
            before = replace(self.before, history=follow_again(h, **start)) if start else self.before
            after = replace(self.before, history=follow_again(h, **end))
        except SimulationError:
            return dict.fromkeys(self.quantities)
        return {**distance.of_blows(after, before, self.hit.quantities)}

    def with_target(self, values: np.ndarray, name: str = "omega") -> np.ndarray:
        """A field of the history with the target's part replaced."""
        whole = getattr(self.hit.history, name).copy()
        whole[..., self.mine] = values
        return whole

    def add_sound(
        self, effect: dict[str, float | None], shift: Callable[[Known, Bending], np.ndarray | None]
    ) -> dict[str, float | None]:
        """The effect with that on the sound: the relative shift of the audible frequencies, weighted by their energy.

        ``shift`` returns it, (n_modes,) [-], for a body and the integrals of its shapes; None if it is not known.
        """
        if "sound" not in effect:
            return effect
        modes = self.hit.target
        body, integrals = self.target, self.bending
        if modes is not self.hit.bodies[-1]:
            body = known_of(modes)
            integrals = None if body is None else integrate_shapes(body)
        energy = self.hit.modal_energy([self.end])[0]
        band = self.hit.quantities["sound"] or np.inf
        energy = np.where((modes.omega > 0.0) & (modes.frequencies <= band), energy, 0.0)
        moved = None if body is None or integrals is None else shift(body, integrals)
        sound = None if moved is None else float(energy @ np.abs(moved) / (energy.sum() or 1.0))
        return {**effect, "sound": sound}


@dataclass(frozen=True)
class Doubt:
    """One doubt about the model: the assumption, the number that decides and its limit, and how it is answered."""

    name: str  # one of `assumption.ALL`
    number: str  # one of `assumption.READINGS`
    limit: float | None  # from which on the assumption is doubtful
    missing: str = ""  # remedy where the body is not known well enough

    def holds(self, struck: Struck) -> Assumption:
        """It does not apply: the blow has the better model, or nothing that could be modelled better."""
        effect = dict.fromkeys(struck.quantities, 0.0)
        return Assumption(self.name, None, None, effect, struck.quantities, "", self.number)

    def judged(
        self, struck: Struck, value: float | None, effect: Mapping[str, float | None], remedy: str, **more: Any
    ) -> Assumption:
        """The number that decides, what the better model changes, and the remedy; ``more`` as of `Assumption`."""
        if effect.get("sound", 0.0) is None and not more:
            remedy, more = self.missing or remedy, {"unknown": "the section of the audible modes"}
        return Assumption(self.name, value, self.limit, effect, struck.quantities, remedy, self.number, **more)

    def unknown(
        self, struck: Struck, why: str, remedy: str = "", value: float | None = None, stated: bool = False
    ) -> Assumption:
        """What the better model changes is not known; ``stated`` as of `Assumption`."""
        effect = dict.fromkeys(struck.quantities)
        return self.judged(struck, value, effect, remedy or self.missing, unknown=why, stated=stated)


def softened_system(history: History, compliance: float) -> dict[str, np.ndarray]:
    """The fields of the system that change if the contact gets more compliance [m/N] in series."""
    law = history.law.copy()
    law["compliance"] = np.maximum(0.0, law["compliance"] + compliance)
    return {"law": law}
