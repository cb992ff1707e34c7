"""A plan: how a blow will be modelled, why, with which errors and at which price; and the quantities it is for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from . import _check

QUANTITIES = ("restitution", "impulse", "contact_time", "force", "n_impacts", "spectrum", "sound")
BANDED = ("spectrum", "sound")  # quantities that need a frequency up to which they are wanted
USUAL = MappingProxyType(dict.fromkeys(("restitution", "impulse", "contact_time", "force", "n_impacts")))
COSTLY = 10.0, 2e9  # [s], [byte] beyond which a plan warns


def asked_for(quantity: Any) -> Mapping[str, float | None]:
    """Quantities wanted, each with the frequency [Hz] up to which, where it has a band.

    Parameters
    ----------
    quantity : None, str, sequence of str or mapping of str to frequency [Hz]
        Names of QUANTITIES; ``"spectrum=5000"`` is the spectrum up to 5 kHz. None is everything without a band.
    """
    if quantity is None:
        return USUAL
    if isinstance(quantity, str):
        quantity = (quantity,)
    pairs = quantity.items() if isinstance(quantity, Mapping) else (_pair(item) for item in _listed(quantity))
    found: dict[str, float | None] = {}
    for name, limit in pairs:
        _check.one_of("quantity", name, QUANTITIES)
        if (name in BANDED) != (limit is not None):
            rule = "needs a frequency, such as" if name in BANDED else "has no frequency, write"
            raise ValueError(f"quantity {name} {rule} '{name}{'=5000' if name in BANDED else ''}'")
        found[name] = None if limit is None else _check.positive(f"frequency of {name}", limit, "Hz")
    if not found:
        raise ValueError(f"quantity must name one of {', '.join(QUANTITIES)}, got none")
    return MappingProxyType(found)


def _listed(quantity: Any) -> Sequence[Any]:
    if not isinstance(quantity, Sequence):
        raise ValueError(f"quantity must be names of {', '.join(QUANTITIES)}, got {_check.shown(quantity)}")
    return quantity


def _pair(item: Any) -> tuple[str, float | None]:
    if not isinstance(item, str):
        raise ValueError(f"quantity must be names of {', '.join(QUANTITIES)}, got {_check.shown(item)}")
    name, equals, limit = item.partition("=")
    if not equals:
        return name.strip(), None
    try:
        return name.strip(), float(limit)
    except ValueError:
        raise ValueError(
            f"frequency of {name.strip()} must be a number in Hz, got {_check.shown(limit.strip())}"
        ) from None


@dataclass(frozen=True)
class Plan:
    """How a scene will be modelled, why, and at which price; `print` it, `run` it, or override pieces with `but`.

    Everything is decided from the scene, the tolerance and the quantities alone: the same scene gives the same plan.
    """

    scene: Any = field(repr=False)  # the `Scene`
    changes: Mapping[str, Any]  # arguments that replaced the scene's, and pieces overridden
    tolerance: float  # [-]
    quantities: Mapping[str, float | None]  # each with its band [Hz]
    target: str  # "rigid", "infinite" or "modal"
    element: str | None  # "argyris", "hermite", "closed form", or None where nothing is assembled
    size: float | None  # [m] of the elements
    n_dofs: int  # [-] unknowns, about
    n_modes: int  # [-] of the target, about
    max_frequency: float | None  # [Hz] up to which the target's modes are kept; the rest yields statically
    n_striker_modes: int  # [-] of the striker, its rigid motions included
    scheme: str
    dt: float  # [s] step in contact to begin with
    duration: float  # [s] of an undisturbed contact; the run lasts until the final separation unless the scene says
    errors: Mapping[str, float]  # [-] predicted, by what causes them
    reasons: tuple[str, ...]  # in plain words: what is kept, what is dropped and why
    seconds: float  # [s] predicted
    memory: float  # [byte] predicted
    mass: float = 0.0  # [kg] of the target
    mobility: float = 0.0  # [m/(N s)] of an infinite plate
    first: Any = field(default=None, repr=False, compare=False)  # the first modes, where they had to be found

    @property
    def error(self) -> float:
        """Predicted error [-], the sum."""
        return float(sum(self.errors.values()))

    @property
    def costly(self) -> bool:
        """Whether running it would surprise: ten seconds or two gigabytes."""
        return self.seconds > COSTLY[0] or self.memory > COSTLY[1]

    def but(self, **changes: Any) -> "Plan":
        """The plan with pieces or arguments overridden, its predictions made anew.

        Parameters
        ----------
        **changes
            As in `Scene.plan`; None leaves a piece to the plan again.
        """
        return self.scene.plan(**{**self.changes, **changes})

    def run(self, watch: Any = None) -> Any:
        """Carry it out; returns a `Run`."""
        return self.scene.run(watch, plan=self)

    def strike(self) -> Any:
        """Carry it out; returns the `Response`."""
        return self.run().response

    @property
    def cost(self) -> str:
        """Predicted time and memory, in words."""
        time = f"{self.seconds:.1g} s" if self.seconds < 10.0 else f"{self.seconds:.0f} s"
        memory = float(f"{self.memory / 1e6:.2g}")
        return f"about {time} and {memory:.0f} MB predicted"

    def data(self) -> dict[str, Any]:
        """Everything it decides and predicts, by name, in SI units."""
        hidden = ("scene", "changes", "first")
        found = {name: getattr(self, name) for name in self.__dataclass_fields__ if name not in hidden}
        return {name: dict(value) if isinstance(value, Mapping) else value for name, value in found.items()}

    def __str__(self) -> str:
        wanted = ", ".join(name if band is None else f"{name} to {band:g} Hz" for name, band in self.quantities.items())
        lines = [f"Plan for {wanted} to {self.tolerance:g}:", *(f"  {line}" for line in self.reasons)]
        lines.append("Predicted errors:")
        lines += [f"  {name:<22} {error:.1e}" for name, error in [*self.errors.items(), ("together", self.error)]]
        lines.append(f"Cost: {self.cost}")
        if self.costly:
            lines.append("  a larger tolerance, a softer contact or fewer quantities would cost less")
        return "\n".join(lines)
