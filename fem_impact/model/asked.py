"""What is asked of a blow, checked, and what is predicted of it before anything is computed."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from .._base import check
from ..fe import plausible
from ..impact import accuracy, collision, engine, stepping
from ..impact.response import Response
from ..modes.modal import Modes
from . import audit, cost, idealisation
from .budget import Budget
from .target import MODELS, Stages, Target
from .vectors import RitzTarget

if TYPE_CHECKING:
    from .planner import Blow

# that a user may set
PIECES = {"target": "", "model": "", "size": "m", "n_modes": "", "max_frequency": "Hz", "n_striker_modes": ""}
BLOW = "at", "speed"  # arguments of `strike` besides its bodies, their contact and its options
CHOICES = {"target": ("rigid", "infinite", "vectors", "mixed", "modal"), "model": MODELS}
COSTLY = 10.0, 2e9  # [s], [byte] a plan or map that costs more of either is announced: longer than one likes to wait


class Unaffordable(check.SimulationError):
    """A description that meets the tolerance takes too many unknowns or modes; another may not."""


@dataclass(frozen=True)
class Forecast:
    """What a description of the target keeps, and what that errs and costs."""

    tolerance: float  # [-]
    quantities: Mapping[str, float | None]  # each with its band [Hz]
    target: str  # "rigid", "infinite", "vectors" (Ritz vectors started from the blow), "mixed" (see `mixed`) or "modal"
    element: str | None  # "argyris", "hermite" or "closed form"; None for an idealised target
    size: float | None  # [m] element size
    n_dofs: int  # [-] approximate number of unknowns
    n_modes: int  # [-] approximate number of target modes or vectors
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
    first: Modes | None = field(default=None, repr=False, compare=False)  # first modes of the target, if needed
    ringing: float = 0.0  # [s] predicted besides, of the modes that give motion and sound, once these are asked for

    @property
    def error(self) -> float:
        """Total predicted error [-]."""
        return float(sum(self.errors.values()))

    @property
    def costly(self) -> bool:
        """Whether the run takes more than COSTLY: ten seconds or two gigabytes."""
        return self.seconds > COSTLY[0] or self.memory > COSTLY[1]


@dataclass(frozen=True)
class Asked:
    """A blow with changes, checked."""

    blow: "Blow"
    changes: Mapping[str, Any]  # overridden arguments of the blow and pieces of the plan
    values: Mapping[str, Any]  # arguments of `strike`
    pieces: Mapping[str, Any]  # pieces of the plan set by the user
    budget: Budget
    quantities: Mapping[str, float | None]
    duration: float  # [s] contact time on a rigid wall

    @classmethod
    def checked(cls, blow: "Blow", changes: Mapping[str, Any]) -> "Asked":
        """What is asked of a blow; ``changes`` as in `fi.plan`."""
        changes = MappingProxyType({name: value for name, value in changes.items() if value is not None})
        pieces = {name: changes[name] for name in PIECES if name in changes}
        arguments = {name: value for name, value in changes.items() if name not in PIECES}
        values: dict[str, Any] = {**blow.arguments, **arguments}
        for name, value in pieces.items():
            if name in CHOICES:
                check.one_of(name, value, CHOICES[name])
            elif PIECES[name]:
                check.positive(name, value, PIECES[name])
            else:
                check.count(name, value)
        with blow.target.blame("strike", changes):
            given = {name: value for name, value in values.items() if name not in BLOW}
            options = stepping.Options.read(given, (*BLOW, *PIECES))
            for name in ("scheme", "dt", "duration", "residual", "striker_force", "target_force"):
                values[name] = getattr(options, name)
            values["stretching"] = options.stretching or blow.target.stretching
            speed = check.positive("speed", values["speed"], "m/s")
        values["at"] = checked_places(blow.target, "at", values["at"], partial(blow.target.blame, "strike", changes))[0]
        watched = [point for point in blow.points if blow.moving and point is not blow.arguments.get("at")]
        if watched:
            checked_places(blow.target, "points", watched, partial(blow.target.blame, "observe"))
        duration = accuracy.contact_duration(blow.contact, blow.striker.felt_mass, speed)
        budget = Budget(options.tolerance, blow.contact.rated)
        return cls(blow, changes, values, pieces, budget, options.quantities, duration)

    @property
    def moving(self) -> bool:
        """Whether the target's motion or sound is wanted, besides the numbers of the blow."""
        return "sound" in self.quantities or self.blow.moving

    @property
    def plain(self) -> bool:
        """Whether the target is thin, in a vacuum and does not stretch."""
        return not (self.blow.target.thick or self.blow.target.air or self.values["stretching"])

    @property
    def counted(self) -> bool:
        """Whether the user says which modes the target keeps."""
        return bool({"n_modes", "max_frequency"} & set(self.pieces))

    @property
    def meshed(self) -> bool:
        """Whether the user insists on the size of the elements."""
        return self.blow.target.size_stated or "size" in self.pieces

    @property
    def law(self) -> dict[str, Any]:
        """Contact and speed, as arguments."""
        return {"contact": self.blow.contact, "speed": self.values["speed"]}

    @property
    def mass(self) -> float:
        """Mass [kg] of the striker felt at its contact point."""
        return self.blow.striker.felt_mass

    @property
    def slips(self) -> tuple[str, ...]:
        """Notes on numbers of the striker and the speed that are probably a slip of a unit."""
        return *self.blow.striker.notes, *plausible.note_number("speed", self.values["speed"])

    @cached_property
    def estimates(self) -> idealisation.Estimates | None:
        """What is known of the target without finite elements."""
        return idealisation.estimate(self.blow.target, self.values["at"], self.mass, self.duration)

    @property
    def pressed(self) -> float:
        """For how many undisturbed contacts forces press the bodies together, if they do and it is known; else 1."""
        end, force = self.values["duration"], self.values["striker_force"] + self.values["target_force"]
        if not end or self.values.get("max_impacts") or not (force > 0.0 or self.blow.striker.returns):
            return 1.0
        flight = 2.0 * self.mass * self.values["speed"] / force if force > 0.0 else 0.0  # of the first rebound, at most
        return max(1.0, (end - flight) / self.duration)

    def damped_by(self, mobility: float) -> float:
        """How much a plate of a mobility [m/(N s)] damps the contact, over what would be critical [-].

        From 1 on it does not throw the striker off: its edges do. The force rises within 1 / (2 pi n) of the contact.
        """
        return float(0.5 * np.pi * self.mass * mobility / self.duration)

    def highest(self, mobility: float) -> float:
        """Frequency [Hz] above which a plate of a mobility [m/(N s)] acts as a spring."""
        density, swing = 2.0 * mobility / np.pi, accuracy.contact_swing(mass=self.mass, **self.law)
        allowed, exponent = self.budget.for_left_out, self.blow.contact.exponent
        return accuracy.cutoff(density, 0.0, swing, exponent, self.mass, allowed)

    @property
    def unfit(self) -> str:
        """Why the target cannot be treated as rigid or infinite without its modes, if it is not known."""
        target = self.blow.target
        if target.mesh is None or target.mesh.dimension == 1:
            return "is not available for this body"
        if "first_frequency" in target.scale:
            return "needs E, nu, rho and thickness: first_frequency gives the rigidity only once the modes are known"
        return "is only for plates of constant thickness, without tension, point masses and point supports"

    def refuse(self, why: str) -> None:
        """Raise a ValueError if the user names a description that does not apply."""
        if "target" in self.pieces:
            raise ValueError(f"{self.blow.name}target = {self.pieces['target']!r} {why}; use target = 'modal'")

    def find(self, n_modes: int, max_frequency: float | None = None, **how: Any) -> Modes:
        """Modes of the target, see `Target.find`."""
        size = self.pieces.get("size")
        try:
            return self.blow.target.find(n_modes, max_frequency, tolerance=self.close, size=size, **how)
        except check.SimulationError as error:
            if not str(error).startswith("tolerance"):
                raise
            raise check.SimulationError(
                f"tolerance = {self.budget.total:g} of the blow is {self.budget.total / self.close:.2g} "
                f"times that of its frequencies: {error}"
            ) from None

    @property
    def close(self) -> float:
        """What frequencies may err [-]."""
        return 2.0 * self.budget.cheap / self.budget.fineness

    def striker_modes(self, margin: float) -> tuple[int, float]:
        """Number of kept striker modes, and the error [-] of leaving out the others."""
        modes, kept = self.blow.striker.modes, self.pieces.get("n_striker_modes")
        if not modes.dimension:
            return modes.n_modes, 0.0
        if kept is None and self.values["residual"]:
            kept, allowed = collision.striker_modes(self.blow.striker, tolerance=self.budget.total / margin, **self.law)
            if kept == modes.n_rigid:
                return kept, allowed
        else:
            kept = max(modes.n_rigid, min(kept or modes.n_modes, modes.n_modes))
        return kept, collision.striker_error(self.blow.striker, kept, **self.law)

    def simplified(self, kind: str, mass: float) -> audit.Simplified | None:
        """The target as its mesh and section describe it, without modes; None if there is only modes."""
        target = self.blow.target
        if target.mesh is None:
            return None
        section = None if target.scale else target.section
        return audit.Simplified(kind, mass or 1.0, target.mesh, section, target.supports)

    def foretell(
        self, target: str, *, errors: Mapping[str, float], reasons: tuple[str, ...], notes: tuple[str, ...],
        n_modes: int = 0, most: int = 0, lasts: float = 1.0, steps: float | None = None,
        work: cost.Work = cost.NOTHING, **chosen: Any,
    ) -> Forecast:  # fmt: skip
        """The forecast for a target: adds striker modes and time steps, with their errors and cost.

        The time steps may err by ``steps`` [-]; by default, half the budget. ``most`` modes may be kept in the end. The
        blow ``lasts`` so many undisturbed contacts.
        """
        kept, left = self.striker_modes(self.budget.margin)
        modes, steps = self.blow.striker.modes, steps or self.budget.half
        if modes.dimension:
            errors = {**errors, "striker modes left out": left}
            bending, whole = kept - modes.n_rigid, modes.n_modes - modes.n_rigid
            stiff = "is treated as rigid" if bending == 0 else f"keeps {bending} of its {whole} bending modes"
            reasons = (*reasons, f"the striker {stiff}")
        scheme, fixed = self.values["scheme"], self.values["dt"]
        dt = fixed or self.duration / stepping.first_count(scheme, steps, self.quantities)
        until = "fixed by dt" if fixed else f"halved until two runs agree to {steps:.1e}"
        stop = self.values["duration"]
        end = "until the bodies have parted for good" if stop is None else f"for {stop:g} s"
        count = self.duration / dt
        if self.blow.target.air:
            work = work + cost.Work(dense=1e-4 * n_modes**2)  # [s] 0.1 ms per mode squared
        # for three descriptions steps are halved up to eight times, the more often the longer it lasts
        lasts = max(lasts, self.pressed)
        halved = min(min(255.0, lasts) * count * lasts, engine.MAX_STEPS)
        work = work + cost.strikes(max(count, 3.0 / 20.0 * halved), max(n_modes, most) + kept)
        reasons = (*reasons, f"scheme {scheme}, steps of {dt:.3g} s ({count:.0f} per contact), {until}, {end}")
        rest: dict[str, Any] = {"element": None, "size": None, "n_dofs": 0, "max_frequency": None, **chosen}
        return Forecast(
            self.budget.total, self.quantities, target, n_modes=n_modes, n_striker_modes=kept, scheme=scheme, dt=dt,
            duration=self.duration, errors=MappingProxyType({**errors, "steps": steps}), reasons=reasons,
            seconds=work.seconds, memory=work.memory, notes=plausible.together(notes, self.slips), **rest,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Description(ABC):
    """A way to describe the target; those of its kind have ``of``, which decides when it applies."""

    asked: Asked
    forecast: Forecast
    ritz: RitzTarget | None = field(default=None, kw_only=True)  # the vectors that a run has computed so far
    rings: ClassVar[bool] = False  # whether the motion of the target is known, not only the numbers of the blow

    @property
    def margin(self) -> float:
        """Divides what left-out modes of the striker may err [-]."""
        return self.asked.budget.margin

    @abstractmethod
    def found(self, stages: Stages, keep: Any = None) -> "tuple[Description, Modes]":
        """The description as it is struck, and its modes; ``keep`` is a file that stores those of a costly plan."""

    def after(self, other: "Description") -> "Description":
        """The same, with what was found for a blow on another model of the body, as far as that serves."""
        return self

    def refined(self, hit: Response, stages: Stages) -> "Description | None":
        """The next better one that the errors of a blow require; None if they do not, or there is none."""
        return None

    def completed(self, hit: Response, stages: Stages, keep: Any = None) -> Response:
        """The last response with all that belongs to it, its examiner among that."""
        forecast = self.forecast
        kind = "infinite" if forecast.mobility else "rigid"
        return audit.with_examiner(hit, None if self.rings else self.asked.simplified(kind, forecast.mass))


def refine(description: Any, strike: Callable[..., tuple[Any, Any]], stages: Stages, keep: Any = None) -> Any:
    """Strike one description after another until the errors require no better one.

    ``strike`` takes a description, its modes and the stages, and returns what holds the errors, and more. Returns the
    last description that could be struck, with both. What is too much for a better one has missed the tolerance.
    """
    struck = None
    while description is not None:
        try:
            found, modes = description.found(stages, keep)
            struck = found, *strike(found, modes, stages)
            description = found.refined(struck[1], stages)
        except check.SimulationError:
            if struck is None:
                raise
            break
    return struck


def checked_places(target: Target, name: str, given: Any, blame: Callable[[], Any]) -> Any:
    """Points (n_points, dimension) [m], checked to lie on the body; one if they are those of ``at``."""
    mesh = target.mesh
    with blame():
        if mesh is None:
            assert target.modes is not None
            place = target.modes.points(name, given) if target.modes.dimension else [given]
        else:
            place = check.places(name, given, mesh.dimension)
        if name == "at" and len(place) != 1:
            raise ValueError(f"at must be one point, got {len(place)}")
    if mesh is None:
        return place
    if mesh.dimension == 1:
        far = ((place < mesh.points.min()) | (place > mesh.points.max()))[:, 0]
    else:
        far = np.array([idealisation.Surroundings.of(mesh, point) is None for point in place])
    if far.any():
        inside = target.assembled(Stages()).contains(place[far])  # perhaps between a curved edge and its chord
        with blame():
            check.on_body(name, place[far], inside, mesh.points)
    return place
