"""The plan of a blow: its model, the reasons for it, the predicted errors and the cost."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .._base import check, markup

COSTLY = 10.0, 2e9  # [s], [byte] a plan that costs more warns the user


@dataclass(frozen=True)
class Plan:
    """The model of a scene, its reasons and its cost; `print` it, `run` it, or override pieces with `but`.

    The plan depends only on the scene, the tolerance and the quantities: the same scene gives the same plan.
    """

    scene: Any = field(repr=False)  # the `Scene`
    changes: Mapping[str, Any]  # overridden arguments of the scene and pieces of the plan
    tolerance: float  # [-]
    quantities: Mapping[str, float | None]  # each with its band [Hz]
    target: str  # "rigid", "infinite" or "modal"
    element: str | None  # "argyris", "hermite" or "closed form"; None for an idealised target
    size: float | None  # [m] element size
    n_dofs: int  # [-] approximate number of unknowns
    n_modes: int  # [-] approximate number of target modes
    max_frequency: float | None  # [Hz] highest kept target mode; those above act as a spring
    n_striker_modes: int  # [-] striker modes, including its rigid motions
    scheme: str
    dt: float  # [s] first time step in contact
    duration: float  # [s] of an undisturbed contact, not of the run
    errors: Mapping[str, float]  # [-] predicted, by cause
    reasons: tuple[str, ...]  # sentences: what is kept, what is left out, and why
    seconds: float  # [s] predicted
    memory: float  # [byte] predicted
    mass: float = 0.0  # [kg] mass of the target
    mobility: float = 0.0  # [m/(N s)] of an infinite plate
    notes: tuple[str, ...] = ()  # what was assumed, and numbers that are probably a slip of a unit
    first: Any = field(default=None, repr=False, compare=False)  # the first modes of the target, if they were needed

    __repr__ = check.brief

    @property
    def error(self) -> float:
        """Total predicted error [-]."""
        return float(sum(self.errors.values()))

    @property
    def costly(self) -> bool:
        """Whether the run takes more than COSTLY: ten seconds or two gigabytes."""
        return self.seconds > COSTLY[0] or self.memory > COSTLY[1]

    def but(self, **changes: Any) -> "Plan":
        """The plan with some pieces or arguments overridden, and new predictions.

        Parameters
        ----------
        **changes
            As in `Scene.plan`; None lets the plan choose this piece again.
        """
        return self.scene.plan(**{**self.changes, **changes})

    def run(self, watch: Any = None) -> Any:
        """Run the plan; returns a `Run`."""
        return self.scene.run(watch, plan=self)

    def strike(self) -> Any:
        """Run the plan; returns the `Response`."""
        return self.run().response

    @property
    def cost(self) -> str:
        """Predicted time and memory, in words."""
        time = f"{self.seconds:.1g} s" if self.seconds < 10.0 else f"{self.seconds:.0f} s"
        memory = float(f"{self.memory / 1e6:.2g}")
        return f"about {time} and {memory:.0f} MB predicted"

    def data(self) -> dict[str, Any]:
        """All decisions and predictions by name, in SI units."""
        hidden = ("scene", "changes", "first")
        found = {name: getattr(self, name) for name in self.__dataclass_fields__ if name not in hidden}
        return {name: dict(value) if isinstance(value, Mapping) else value for name, value in found.items()}

    def _repr_html_(self) -> str:
        """For notebooks: the plan in words."""
        return markup.paragraphs(str(self).splitlines())

    def __str__(self) -> str:
        wanted = ", ".join(name if band is None else f"{name} to {band:g} Hz" for name, band in self.quantities.items())
        lines = [f"Plan for {wanted} to {self.tolerance:g}:", *(f"  {line}" for line in self.reasons)]
        lines.append("Predicted errors:")
        lines += [f"  {name:<22} {error:.1e}" for name, error in [*self.errors.items(), ("total", self.error)]]
        lines.append(f"Cost: {self.cost}")
        if self.costly:
            lines.append("  a larger tolerance, a softer contact or fewer quantities would cost less")
        lines += [f"Note: {note}" for note in self.notes]
        return "\n".join(lines)
