"""The target as a rigid body or an infinite plate, if that is accurate enough: no mesh and no modes are needed."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..fe import plausible
from ..impact.response import Response
from ..modes.modal import Modes
from . import idealisation
from .asked import Asked, Description
from .target import Stages


@dataclass(frozen=True, eq=False)
class Idealised(Description):
    """A target that is treated as rigid or infinite."""

    error: float  # [-] of the simplification

    @classmethod
    def of(cls, kind: str, asked: Asked, stages: Stages, anyway: bool = False) -> "Idealised | None":
        """The target as "rigid" or "infinite"; None if that is not accurate enough, unless the user asks for it.

        With ``anyway``, a blow that no mesh resolves takes the infinite plate whatever its error is.
        """
        blow, named = asked.blow, "target" in asked.pieces
        if not asked.plain:
            asked.refuse("is only for thin bodies in a vacuum that do not stretch")
            return None
        pushed = asked.values["striker_force"] or asked.values["target_force"]
        exact = not anyway and (blow.contact.gap < 0.0 or not asked.values["residual"])
        if not named and (asked.moving or pushed or exact):
            return None
        with stages("modes"):
            estimates = asked.estimates
        if estimates is None:
            asked.refuse(asked.unfit)
            return None
        if kind == "rigid":
            error, mobility, cause = estimates.rigid, 0.0, "rigid target"
            kept = f"the target, {estimates.mass:.3g} kg, is treated as rigid: that changes the blow by {error:.1e}"
        else:
            error, mobility, cause = estimates.endless, estimates.mobility, "infinite plate"
            kept = (
                f"the target is treated as an infinite plate of mobility {mobility:.3g} m/(N s): the striker leaves "
                f"before an echo returns from the edge; that changes the blow by {error:.1e}"
            )
        if not np.isfinite(mobility):
            asked.refuse(asked.unfit)
        if not named and not error <= (np.finfo(float).max if anyway else asked.budget.half):
            return None
        dropped = "no mesh and no modes are needed; the target's sound is not computed"
        forecast = asked.foretell(
            kind, errors={cause: error}, reasons=(kept, dropped), mass=estimates.mass, mobility=mobility,
            notes=plausible.together(blow.target.assumed, estimates.notes),
        )  # fmt: skip
        return cls(asked, forecast, error)

    def found(self, stages: Stages, keep: Any = None) -> "tuple[Idealised, Modes]":
        """The same, and its modes."""
        at, forecast = self.asked.values["at"], self.forecast
        modes = idealisation.rigid_plate(at, forecast.mass)
        if forecast.mobility:
            modes = idealisation.infinite_plate(at, forecast.mass, forecast.mobility, forecast.duration)
        return self, replace(modes, notes=forecast.notes)

    def completed(self, hit: Response, stages: Stages, keep: Any = None) -> Response:
        """The response with the error of the simplification."""
        return super().completed(replace(hit, error=replace(hit.error, idealisation=self.error)), stages)
