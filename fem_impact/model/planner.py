"""Choose the smallest model of a blow that meets its tolerance, and run it."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from inspect import signature
from types import MappingProxyType
from typing import Any

import numpy as np

from .._base import check, markup, progress
from .._base.explained import below, noted, pointed
from ..fe import plausible, refinement
from ..fe.assembly import System
from ..fe.section import Plate
from ..impact import accuracy, assumption, collision, promise, stepping
from ..impact.assumption import Assumption
from ..impact.compiled import build
from ..impact.contact import Contact
from ..impact.quantities import BAND_POINTS, apart, words
from ..impact.response import LOOKED_AT, Response
from ..impact.striker import Striker
from ..modes.modal import Damping, FieldShapes, Modes, at_rest
from . import audit, cost, fresh, idealisation, mixed, vectors
from .target import FIRST_LOOK, MODELS, Elements, Stages, Target, Watch

# [-] of the tolerance for left-out modes, as much for the time steps, as neither is cheap; the mesh gets the rest
SHARE = 0.45
# [-] of the tolerance for what costs little: the time steps of a blow by Ritz vectors, the modes of strikers that meet
# on the body, and the mesh, whose frequencies may err twice as much as the blow then does
CHEAP = 0.1
# [-] runs with ever more modes or finer meshes until the tolerance is met: CAUTION makes even a second one rare
ATTEMPTS = 3
# [Hz], [-] the ear's limit: no mode above is asked for unless a band of the sound is; the force looked at every 10 Hz
AUDIBLE, AUDIBLE_POINTS = 20e3, 2001
# [-] modes ring up to the last frequency where the force has this part of its impulse: -60 dB, which is not heard
FAINT = 1e-3
MOST_RINGING = 400  # [-] modes for motion and sound if no band is asked for: some seconds
# [-] the verifying run divides the tolerance by this: its own error is then an eighth of what it judges
VERIFYING = 8.0
FINEST = 1e-10  # [-] lowest tolerance of a verifying run: below, rounding of long runs begins to show
# [-] safety factor on the mode error: costs a quarter more modes, but seldom needs a second run
CAUTION = 2.0
MOST_MODES = {"fe": 2000, "analytic": 50_000, "modes": 50_000}  # [-] limit by source: takes about 2 GB and some minutes
# [-] a plate that needs more modes is taken as infinite above a frequency, if it overdamps the contact: a steel sheet
# then keeps 4 100 modes instead of 15 190
MANY_MODES = 10_000
# [-] frequency error of the shortest waves that the mesh resolves by `refinement.WAVE_PER_ELEMENT`; beams also round
SHORT_WAVES = {
    "argyris": 1e-5, "hermite": 1e-9, "argyris and shear": 1e-5, "hermite and shear": 1e-9,
}  # fmt: skip
# that a user may set
PIECES = {"target": "", "model": "", "size": "m", "n_modes": "", "max_frequency": "Hz", "n_striker_modes": ""}
# after modes, striker and contact; a plan is for a body at rest
ARGUMENTS = tuple(name for name in tuple(signature(collision.strike).parameters)[3:] if name != "start")
CHOICES = {"target": ("rigid", "infinite", "vectors", "mixed", "modal"), "model": MODELS}
RINGING = ("modal", "vectors")  # those of a target that rings
# [-] modes times steps of one run of a plate that is infinite above a frequency: a time limit of ten seconds
MOST_MIXED = 2e8
NO_MESH = "a mesh that resolves the frequency up to which a plate of 'mixed' keeps its modes has too many unknowns"
COSTLY = 10.0, 2e9  # [s], [byte] a plan or map that costs more of either is announced: longer than one likes to wait


@dataclass(frozen=True, eq=False)
class Blow:
    """A blow to be modelled: who strikes what, and what the answer is needed for."""

    target: Target
    striker: Striker
    contact: Contact
    arguments: Mapping[str, Any]  # of `strike`: at, speed, tolerance, quantity and so on
    points: tuple[Any, ...] = ()  # points (dimension,) [m] of the target whose motion is wanted
    moving: bool = False  # whether the target's motion is wanted, besides the quantities
    name: str = ""  # of the scene file, put in front of messages

    @check.typed
    def plan(self, watch: Watch | None = None, **changes: Any) -> "Plan":
        """Decide how to model the blow, without striking; ``changes`` as in `fi.plan`."""
        return make(self, changes, Stages(watch))

    def run(self, watch: Watch | None = None, *, plan: "Plan | None" = None, keep: Any = None, **changes: Any) -> "Run":
        """Strike, and time every stage; with a plan or by a new one."""
        stages = Stages(watch)
        return carry_out(make(self, changes, stages) if plan is None else plan, stages, keep)


@dataclass(frozen=True, repr=False)
class Plan(check.Brief):
    """The model of a blow, its reasons and its cost; `print` it, `run` it, or override pieces with `but`.

    The plan depends only on the blow, the tolerance and the quantities: the same blow gives the same plan.
    """

    blow: Blow = field(repr=False, compare=False)
    changes: Mapping[str, Any]  # overridden arguments of the blow and pieces of the plan
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
    ringing: float = 0.0  # [s] predicted besides, of the modes that tell motion and sound, once these are asked for

    @property
    def error(self) -> float:
        """Total predicted error [-]."""
        return float(sum(self.errors.values()))

    @property
    def meets(self) -> bool:
        """Whether the predicted error is at most the tolerance."""
        return self.error <= self.tolerance

    @cached_property
    def assumptions(self) -> tuple[Assumption, ...]:
        """Is the model itself right, as far as that is known before the blow? As in `Response`, without effects.

        They come from the same blow on a wall, which is the hardest.
        """
        asked, blow = _Asked.checked(self.blow, self.changes), self.blow
        target = replace(blow.target, stretching=asked.values["stretching"])
        striker = collision.shortened(blow.striker, self.n_striker_modes)
        modes = target.modes if self.first is None else self.first
        body = _outside(self, "infinite") if modes is None else target.finished(modes)
        assert body is not None
        how = {"speed": asked.values["speed"], "quantity": asked.quantities, "rings": self.target in RINGING}
        return audit.foresee(target, body, striker, blow.contact, asked.values["at"], **how)

    @property
    def costly(self) -> bool:
        """Whether the run takes more than COSTLY: ten seconds or two gigabytes."""
        return self.seconds > COSTLY[0] or self.memory > COSTLY[1]

    def but(self, **changes: Any) -> "Plan":
        """The plan with some pieces or arguments overridden, and new predictions.

        Parameters
        ----------
        **changes
            As in `fi.plan`; None lets the plan choose this piece again.
        """
        return self.blow.plan(**{**self.changes, **changes})

    def run(self, watch: Watch | None = None) -> "Run":
        """Run the plan; `Response.tolerance_met` says whether it kept its promise."""
        return self.blow.run(watch, plan=self)

    def strike(self, strict: bool = False) -> Response:
        """Run the plan and return the response only; ``strict`` as in `fi.strike`."""
        if self.seconds > progress.LONG:
            return promise.kept(self.run().response, strict)
        stretches = _Asked.checked(self.blow, self.changes).values["stretching"]
        return promise.kept(fresh.answer(lambda: self.run().response, stretches), strict)

    @property
    def cost(self) -> str:
        """Predicted time and memory, in words."""
        time = f"{self.seconds:.1g} s" if self.seconds < 10.0 else f"{self.seconds:.0f} s"
        memory = float(f"{self.memory / 1e6:.2g}")
        return f"about {time} and {memory:.0f} MB predicted for {cost.whose()}"

    def data(self) -> dict[str, Any]:
        """All decisions and predictions by name, in SI units."""
        hidden = ("blow", "changes", "first")
        found = {name: getattr(self, name) for name in self.__dataclass_fields__ if name not in hidden}
        plain = {name: dict(value) if isinstance(value, Mapping) else value for name, value in found.items()}
        return plain | {"assumptions": assumption.table(self.assumptions)}

    def _repr_html_(self) -> str:
        """For notebooks: the plan in words."""
        return markup.paragraphs(str(self).splitlines())

    def __str__(self) -> str:
        wanted = words(self.quantities)
        kept = "met" if self.meets else "MISSED"
        model, *doubts = assumption.lines(self.assumptions, self.tolerance)
        first = f"tolerance {self.tolerance:g} of {wanted} will be {kept}: predicted error {self.error:.1e}; {model}"
        lines = [first, *below(first), *noted(self.notes), *(f"  {line}" for line in self.reasons)]
        lines.append("Predicted errors:")
        errors = [*self.errors.items(), ("total", self.error)]
        lines += [f"  {line}" for line in markup.columns([(name, f"{error:.1e}") for name, error in errors])]
        lines += [f"Model: {pointed(line)}" for line in doubts]
        lines.append(f"Cost: {self.cost}")
        if self.ringing > progress.LONG:
            lines.append(f"  motion, sound and pictures take about {self.ringing:.0f} s more once they are asked for")
        if self.costly:
            lines.append("  a larger tolerance, a softer contact or fewer quantities would cost less")
        if self.memory > cost.installed():
            lines.append(f"  the {cost.installed() / 1e9:.2g} GB of memory of this machine do not suffice")
        return "\n".join(lines)


@dataclass(frozen=True, repr=False)
class Run(check.Brief):
    """The result of running a plan, with its run times."""

    response: Response
    seconds: Mapping[str, float]  # [s] wall time of each stage, by its name
    plan: Plan  # the plan as run, with the actual number of modes and errors
    notes: tuple[str, ...] = ()  # what was assumed, and numbers that are probably a slip of a unit
    verified: Mapping[str, float] | None = None  # [-] differences from a finer run, see `verify`
    finer: Plan | None = None  # plan of the finer run

    @property
    def rings(self) -> bool:
        """Whether the motion of the target is known, not only the numbers of the blow."""
        return self.plan.target in RINGING


@dataclass(frozen=True)
class _Asked:
    """A blow with changes, checked."""

    blow: Blow
    changes: Mapping[str, Any]
    values: Mapping[str, Any]  # arguments of `strike`
    pieces: Mapping[str, Any]  # pieces of the plan set by the user
    tolerance: float  # [-]
    quantities: Mapping[str, float | None]
    duration: float  # [s] contact time on a rigid wall
    fineness: float = 1.0  # [-] divides the error of the frequencies

    @classmethod
    def checked(cls, blow: Blow, changes: Mapping[str, Any]) -> "_Asked":
        changes = {name: value for name, value in changes.items() if value is not None}
        pieces = {name: changes[name] for name in PIECES if name in changes}
        values: dict[str, Any] = {
            **blow.arguments,
            **{name: value for name, value in changes.items() if name not in PIECES},
        }
        for name, value in pieces.items():
            if name in CHOICES:
                check.one_of(name, value, CHOICES[name])
            elif PIECES[name]:
                check.positive(name, value, PIECES[name])
            else:
                check.count(name, value)
        with blow.target.blame("strike", changes):
            for name in values:
                if name not in ARGUMENTS:
                    raise ValueError(f"{name} is not an argument of a blow{check.nearest(name, [*ARGUMENTS, *PIECES])}")
            wanted = (values.get(name) for name in ("duration", "max_impacts", "scheme", "dt", "quantity"))
            options = stepping.Options.checked(values.get("tolerance", collision.TOLERANCE), *wanted)
            values |= {"dt": options.dt, "duration": options.horizon if np.isfinite(options.horizon) else None}
            speed = check.positive("speed", values["speed"], "m/s")
            values["stretching"] = check.flag("stretching", values.get("stretching", False)) or blow.target.stretching
            for name in ("striker_force", "target_force"):
                values[name] = check.number(name, values.get(name, 0.0), "N")
        values["at"] = _struck_at(blow.target, values["at"], changes)
        duration = accuracy.contact_duration(blow.contact, blow.striker.felt_mass, speed)
        return cls(blow, changes, values, pieces, options.tolerance, options.quantities, duration)

    @property
    def moving(self) -> bool:
        """Whether the target's motion or sound is wanted, besides the numbers of the blow."""
        return "sound" in self.quantities or self.blow.moving

    @property
    def left_out(self) -> float:
        """Error [-] allowed for the modes left out."""
        return SHARE * self.tolerance / CAUTION / (accuracy.LOSSY if self.blow.contact.rated else 1.0)

    @property
    def law(self) -> dict[str, Any]:
        """Contact and speed, as arguments."""
        return {"contact": self.blow.contact, "speed": self.values["speed"]}

    @property
    def mass(self) -> float:
        """Mass [kg] of the striker felt at its contact point."""
        return self.blow.striker.felt_mass

    @property
    def fast(self) -> tuple[str, ...]:
        """A note if the speed is probably a slip of a unit."""
        return tuple(plausible.number("speed", self.values["speed"]))

    @cached_property
    def seen(self) -> idealisation.Outside | None:
        """What is known of the target without finite elements."""
        return idealisation.from_outside(self.blow.target, self.values["at"], self.mass, self.duration)

    def find(self, n_modes: int, max_frequency: float | None = None, **how: Any) -> Modes:
        """Modes of the target, see `Target.find`."""
        size, limit = self.pieces.get("size"), 2.0 * CHEAP * self.tolerance / self.fineness
        return self.blow.target.find(n_modes, max_frequency, tolerance=limit, size=size, **how)


def _struck_at(target: Target, at: Any, changes: Mapping[str, Any]) -> Any:
    """The strike point (dimension,) [m], checked to lie on the body."""
    mesh, blame = target.mesh, partial(target.blame, "strike", changes)
    if mesh is None:
        assert target.modes is not None
        with blame():
            return target.modes.point("at", at)[0] if target.modes.dimension else at
    with blame():
        place = check.places("at", at, mesh.dimension)
        if len(place) != 1:
            raise ValueError(f"at must be one point, got {len(place)}")
    along = mesh.dimension == 1 and mesh.points.min() <= place[0, 0] <= mesh.points.max()
    if not along and (mesh.dimension == 1 or idealisation.Surroundings.seen(mesh, place[0]) is None):
        inside = target.assembled(Stages()).contains(place)  # perhaps between a curved edge and its chord
        with blame():
            check.on_body("at", place, inside, mesh.points)
    return place[0]


def plan_of(
    body: System | Modes,
    striker: Any,
    contact: Any,
    watch: Watch | None = None,
    *,
    at: Any,
    speed: float,
    damping_ratio: Damping | None = None,
    **rest: Any,
) -> Plan:
    """The plan of a blow that a user describes with objects; ``rest`` as in `fi.plan`."""
    check.instance("striker", striker, Striker)
    check.instance("contact", contact, Contact)
    pieces = {name: rest.pop(name) for name in PIECES if name in rest}
    target = Target.of(body, damping_ratio)
    return Blow(target, striker, contact, {"at": at, "speed": speed, **rest}).plan(watch, **pieces)


def make(blow: Blow, changes: Mapping[str, Any], stages: Stages) -> Plan:
    """Choose the model of a blow; see `fi.plan`."""
    asked = _Asked.checked(blow, changes)
    with _noted(asked):
        return _chosen(asked, stages)


@contextmanager
def _noted(asked: _Asked) -> Iterator[None]:
    """Put numbers that are probably a slip of a unit in front of an error, which is then hardly about anything else."""
    try:
        yield
    except check.SimulationError as error:
        target = asked.blow.target
        assumed = () if target.mesh is None else target.mesh.notes
        slips = [note for note in (*target.notes, *asked.blow.striker.notes, *asked.fast) if note not in assumed]
        if not slips or str(error).startswith(slips[0]):
            raise
        raise check.SimulationError(f"{'; '.join(slips)}: {error}") from None


def _chosen(asked: _Asked, stages: Stages) -> Plan:
    """The smallest model that meets the tolerance, or the one asked for."""
    blow, target = asked.blow, asked.pieces.get("target")
    held = blow.striker.hand is not None  # it comes back when the body has long answered
    stated = blow.target.modes is not None or {"size", "n_modes", "max_frequency"} & set(asked.pieces)
    if target is None and (held or stated):
        target = "modal"
    plan = None if target in ("modal", "vectors", "mixed") else _idealised(asked, target, stages)
    if plan is None and (target == "mixed" or (target is None and blow.target.kind == "fe")):
        plan = _mixed(asked, target, stages, heavy=target is None)
    return plan or _by_vectors(asked, target, stages) or _modal(asked, stages)


def carry_out(plan: Plan, stages: Stages, keep: Any = None) -> Run:
    """Run the plan, and then with the better models of the target that the tolerance requires, if it may choose."""
    with _noted(_Asked.checked(plan.blow, plan.changes)):
        run = _carry_out(plan, stages, keep)
    chooses = plan.changes.get("model", plan.blow.target.model) == "auto"
    told: tuple[str, ...] = ()
    while chooses and (better := audit.required(plan.blow.target, run.response)) is not None:
        target, why = better
        before = sum(stages.seconds.values())
        try:
            plan = make(replace(plan.blow, target=target), plan.changes, stages)
            progress.foresee(plan.seconds)
            again = _carry_out(plan, stages, None)
        except (check.SimulationError, ValueError, MemoryError) as error:
            return replace(run, notes=(*told, *run.notes, f"{why}; that was not computed: {error}"))
        told, run = (*told, f"{why}; that took {sum(stages.seconds.values()) - before:.1g} s more"), again
    return replace(run, notes=(*told, *run.notes))


def _carry_out(plan: Plan, stages: Stages, keep: Any) -> Run:
    """Run the plan; if the left-out modes turn out to matter, run it again with more modes.

    ``keep`` is a file that stores the modes of a costly plan.
    """
    blow, asked, margin = plan.blow, _Asked.checked(plan.blow, plan.changes), 1.0
    _check_memory(plan)
    if plan.target == "vectors":
        return _carry_out_by_vectors(plan, asked, stages, keep)
    if plan.target == "mixed":
        return _carry_out_mixed(plan, asked, stages)
    fixed = {"n_modes", "max_frequency"} & set(asked.pieces) or not asked.values.get("residual", True)
    given = blow.target.kind != "fe" or blow.target.size_stated or "size" in asked.pieces
    idealised = plan.errors.get("rigid target", 0.0) + plan.errors.get("infinite plate", 0.0)
    for attempt in range(ATTEMPTS):
        modes, striker = struck(plan, stages, keep), collision.shortened(blow.striker, plan.n_striker_modes)
        if plan.target == "modal":
            with blow.target.blame("observe"):
                for point in blow.points:
                    modes.points("points", [point])
        with stages("strike"), blow.target.blame("strike"):
            run = partial(collision.strike, modes, striker, blow.contact)
            first = run(**{**asked.values, "tolerance": SHARE * asked.tolerance})
            response = within(asked.tolerance, first, run, asked.values)
        short = response.error.truncation > SHARE * asked.tolerance
        more = _finer_air(response, asked.tolerance) if blow.target.air else 1.0
        coarse = not given and response.error.total > asked.tolerance and response.error.mesh > CHEAP * asked.tolerance
        if plan.target != "modal" or fixed or not (short or coarse or more > 1.0) or attempt == ATTEMPTS - 1:
            break
        margin *= vectors.NOTCH if short else 1.0
        asked = replace(asked, fineness=asked.fineness * (vectors.NOTCH if coarse else 1.0))
        try:
            plan = _modal(asked, stages, None if coarse else plan.first, margin, more)
            progress.foresee(plan.seconds)
        except check.SimulationError:  # too many modes or too fine a mesh: what there is has missed the tolerance
            break
    error = replace(response.error, idealisation=idealised)
    simplified = None if plan.target == "modal" else _outside(plan, plan.target)
    response = audit.audited(replace(response, tolerance=asked.tolerance, error=error), simplified)
    plan = replace(plan, n_modes=modes.n_modes if plan.target == "modal" else 0)
    return Run(response, MappingProxyType(stages.seconds), plan, plausible.together(plan.notes, response.notes))


def _check_memory(plan: Plan) -> None:
    """Raise SimulationError if this machine has not the memory that a plan needs."""
    here = cost.installed()
    if plan.memory <= here:
        return
    advice = "take a larger tolerance or a softer contact"
    if plan.blow.target.thick:
        advice += ", or the thin theory, which tells what shear changes of the blow (`thin target`)"
    raise check.SimulationError(
        f"{plan.blow.name}this blow needs about {plan.memory / 1e9:.2g} GB of memory for {plan.n_modes} modes or "
        f"vectors of {plan.n_dofs} unknowns, more than the {here / 1e9:.2g} GB of this machine; {advice}"
    )


def _carry_out_by_vectors(plan: Plan, asked: _Asked, stages: Stages, keep: Any) -> Run:
    """Strike with more vectors or on finer meshes until the tolerance is met; then find the modes that ring."""
    blow, values = plan.blow, asked.values
    assert plan.size is not None
    resonance = 0.5 / asked.duration
    fixed = blow.target.size_stated or "size" in asked.pieces
    elements = _elements(asked, plan.size)
    seen = vectors.Seen(blow.target, values["at"], resonance, asked.tolerance, elements, fixed, stages)
    if seen.at_rest:
        return _carry_out(_modal(asked, stages), stages, keep)

    def cutoff(modes: Modes, margin: float) -> float:
        allowed = asked.left_out / margin
        return accuracy.tail_cutoff(modes, seen.at, mass=asked.mass, tolerance=allowed, **asked.law)

    found: Any = None
    while True:
        modes = seen.modes(cutoff)
        with blow.target.blame("observe"):
            for point in blow.points:
                modes.points("points", [point])
        striker = collision.shortened(blow.striker, _striker_modes(asked, seen.margin)[0])
        run = partial(collision.strike, modes, striker, blow.contact)
        with stages("strike"), blow.target.blame("strike"):
            try:
                found = (
                    _in_fine_steps(run, asked),
                    run,
                    seen.count,
                    seen.elements.size,
                    seen.fine.system.n_dofs,
                    seen.whole,
                )
            except check.SimulationError:  # more vectors take more steps than allowed: what there is has missed
                if found is None:
                    raise
                break
        error, before = found[0].error, seen.count
        if not seen.improved(error, asked.tolerance - error.step):
            break
        progress.foresee(seen.work(before).seconds)
    response, run, number, size, n_dofs, whole = found
    response = within(asked.tolerance, response, run, values)
    if not response.tolerance_met and "target" not in asked.pieces:
        other = _last_resort(asked, stages)
        if other is not None and other.error < response.error.total:
            return _carry_out(other, stages, None)
    plan = replace(plan, n_modes=number, size=size, n_dofs=n_dofs)
    response = replace(response, rings=partial(_ringing, asked, keep), vectors=whole)
    if "sound" in asked.quantities or (blow.moving and not _told(blow.points, response)):
        with stages("modes"):
            response = replace(response, ringing=_ringing(asked, keep, response))
        plan = replace(plan, max_frequency=float(response.target.frequencies[-1]))
    response = audit.audited(response)
    return Run(response, MappingProxyType(stages.seconds), plan, plausible.together(plan.notes, response.notes))


def _carry_out_mixed(plan: Plan, asked: _Asked, stages: Stages) -> Run:
    """Strike with modes or vectors up to ever higher frequencies until the echoes left out hardly matter."""
    values, frequency, allowed = asked.values, plan.max_frequency, SHARE * asked.tolerance
    assert frequency is not None
    by_parts = _mixed_by_modes if plan.size is None else _mixed_by_vectors
    found: Any = None
    other = None if plan.size is None or "target" in asked.pieces else _all_by_vectors(asked, stages)
    while True:
        try:
            found = *by_parts(plan, asked, frequency, stages), frequency
        except check.SimulationError:  # too fine a mesh, too many modes, or too many steps with them
            if found is None:
                raise
            break
        hit = found[0]
        work = 2.0 * hit.history.steps.shape[0] * hit.bodies[-1].n_modes
        many = plan.size is not None and 2.0 * hit.bodies[-1].n_modes > mixed.MOST_VECTORS
        if hit.error.idealisation <= allowed or work > MOST_MIXED or many:
            break
        frequency *= 2.0
        if plan.size is not None:
            more = _mixed_work(asked, plan.mobility, frequency, stages).seconds
            if other is not None and other.seconds < more:
                progress.foresee(other.seconds)
                instead, other = _carry_out(other, stages, None), None
                if instead.response.tolerance_met:
                    return instead
            progress.foresee(more)
    response, run, frequency = found
    response = within(asked.tolerance, response, run, values)
    plan = replace(plan, n_modes=response.bodies[-1].n_modes, max_frequency=frequency)
    response = audit.audited(response, _outside(plan, "infinite"))
    return Run(response, MappingProxyType(stages.seconds), plan, plausible.together(plan.notes, response.notes))


def _strike_mixed(
    plan: Plan, asked: _Asked, modes: Modes, frequency: float, stages: Stages
) -> tuple[Response, Callable[..., Response]]:
    """One blow on a plate of these modes that is infinite above a frequency [Hz], and how to repeat it."""
    blow, highest = plan.blow, _highest(asked, plan.mobility)
    body = mixed.mixed(modes, asked.values["at"], plan.mobility, frequency, highest)
    run = partial(collision.strike, body, collision.shortened(blow.striker, plan.n_striker_modes), blow.contact)
    with stages("strike"), blow.target.blame("strike"):
        return run(**{**asked.values, "tolerance": SHARE * asked.tolerance}), run


def _mixed_by_modes(
    plan: Plan, asked: _Asked, frequency: float, stages: Stages
) -> tuple[Response, Callable[..., Response]]:
    target = plan.blow.target
    with stages("modes"):
        reach = mixed.REACH * frequency / target.stretch
        modes = target.finished(asked.find(FIRST_LOOK, reach, first=plan.first, stages=stages))
    return _strike_mixed(plan, asked, modes, frequency, stages)


def _mixed_by_vectors(
    plan: Plan, asked: _Asked, frequency: float, stages: Stages
) -> tuple[Response, Callable[..., Response]]:
    target, elements = plan.blow.target, _mixed_elements(asked, frequency)
    if not _mixed_mesh(asked, frequency):
        raise check.SimulationError(NO_MESH)
    shift, count = 2.0 * np.pi * mixed.REACH * frequency, _mixed_vectors(asked, plan.mobility, frequency)
    seen = vectors.Seen(
        target,
        asked.values["at"],
        mixed.RESOLVED * frequency,
        asked.tolerance,
        elements,
        target.size_stated,
        stages,
        shift,
        count,
    )
    allowed = SHARE * asked.tolerance
    while True:
        seen.modes(lambda found, _: float(found.frequencies[-1]))
        assert seen.whole is not None
        hit, run = _strike_mixed(plan, asked, seen.whole, frequency, stages)
        if seen.count >= mixed.MOST_VECTORS:
            return hit, run
        if hit.error.truncation > 0.5 * allowed:
            seen.count = min(mixed.MOST_VECTORS, 2 * seen.count)  # it lasts longer than expected
        elif not seen.improved(hit.error, allowed):
            return hit, run


def _in_fine_steps(run: Callable[..., Response], asked: _Asked) -> Response:
    """The blow with a small part of the tolerance for its steps, or with half of it if that takes too many."""
    with suppress(check.SimulationError):
        return run(**{**asked.values, "tolerance": CHEAP * asked.tolerance})
    return run(**{**asked.values, "tolerance": SHARE * asked.tolerance})


def _told(points: tuple, response: Response) -> bool:
    """Whether Ritz vectors tell the motion of all points as long as the blow lasts."""
    times = np.linspace(0.0, response.history.end_time, LOOKED_AT)
    return all(np.isfinite(response.motion_error([point], times)) for point in points)


def _ringing(asked: _Asked, keep: Any, response: Response) -> Modes:
    """The modes that the force found makes ring: up to the band asked for, or as far as the force reaches."""
    target, band = asked.blow.target, asked.quantities.get("sound")
    frequencies = np.linspace(0.0, AUDIBLE, AUDIBLE_POINTS)
    force = np.abs(response.spectrum(frequencies))
    limit = band or float(frequencies[np.flatnonzero(force >= FAINT * force[0])[-1]])
    first = asked.find(FIRST_LOOK)
    number = round(FIRST_LOOK * target.growth(target.finished(first).frequencies[-1], limit))
    most = MOST_MODES["fe"] if band else MOST_RINGING
    modes = first if number <= FIRST_LOOK else asked.find(min(number, most), first=first, keep=keep)
    return target.surrounded(modes)


def within(tolerance: float, hit: Response, run: Callable[..., Response], values: Mapping[str, Any]) -> Response:
    """The blow, or the same with time steps that leave room in the tolerance for the other errors."""
    left = tolerance - (hit.error.total - hit.error.step)
    if hit.error.total > tolerance and left > 0.0 and not values.get("dt"):
        with suppress(check.SimulationError):  # steps so fine that nothing is gained: the tolerance is missed
            hit = run(**{**values, "tolerance": max(FINEST, 0.9 * left)})
    return hit if hit.tolerance == tolerance else replace(hit, tolerance=tolerance)


def verify(run: Run, watch: Watch | None = None) -> Run:
    """Run again with a finer model and record how much the results differ (`Run.verified`).

    The tolerance is divided by eight and the element size by 1.5. A rigid or infinite target gets modes, unless that
    takes too many.
    """
    plan = run.plan
    target = plan.target if plan.target in ("vectors", "mixed") else "modal"
    finer: dict[str, Any] = {"tolerance": max(FINEST, plan.tolerance / VERIFYING), "target": target}
    if plan.size is not None and plan.target != "mixed":
        finer["size"] = plan.size / 1.5
    finer.update({name: None for name in ("n_modes", "max_frequency", "n_striker_modes", "dt") if name in plan.changes})
    try:
        other = plan.blow.run(watch, **{**plan.changes, **finer})
    except check.SimulationError:
        if plan.target == target:
            raise
        other = plan.blow.run(watch, **{**plan.changes, **finer, "target": plan.target})
    true = differences(run.response, other.response, plan.quantities)
    return replace(run, verified=MappingProxyType(true), finer=other.plan)


def differences(one: Response, two: Response, quantities: Mapping[str, float | None]) -> dict[str, float]:
    """Differences [-] of two runs of one blow: absolute in the restitution and the count, relative in the others."""
    true = {
        "restitution": apart(one.restitution, two.restitution),
        "n_impacts": float(abs(one.n_impacts - two.n_impacts)),
    }
    for name in ("impulse", "contact_time", "peak_force"):
        size = getattr(two, name)
        true[name] = abs(getattr(one, name) - size) / size if size else 0.0
    for name, band in quantities.items():
        if band is not None:
            spectra = [response.spectrum(np.linspace(0.0, band, BAND_POINTS)) for response in (one, two)]
            true[name] = float(np.abs(spectra[0] - spectra[1]).max() / (np.abs(spectra[1]).max() or 1.0))
    return true


def _idealised(asked: _Asked, target: str | None, stages: Stages) -> Plan | None:
    """The plan with a rigid or infinite target, if that is accurate enough or the user asks for it; else None."""
    blow, values = asked.blow, asked.values
    if blow.target.thick or blow.target.air or values["stretching"]:
        if target is not None:
            raise ValueError(
                f"{blow.name}target = {target!r} is only for thin bodies in a vacuum that do not stretch; "
                "use target = 'modal'"
            )
        return None
    pressed = values.get("striker_force") or values.get("target_force") or blow.contact.gap < 0.0
    if target is None and (pressed or asked.moving or not values.get("residual", True)):
        return None
    with stages("modes"):
        seen = asked.seen
    allowed = SHARE * asked.tolerance
    if target is not None:
        if seen is None or (target == "infinite" and not np.isfinite(seen.mobility)):
            raise ValueError(f"{blow.name}target = {target!r} {_unfit(asked)}; use target = 'modal'")
    elif seen is None:
        return None
    elif seen.rigid <= allowed:
        target = "rigid"
    elif seen.endless <= allowed:
        target = "infinite"
    else:
        return None
    if target == "rigid":
        error = {"rigid target": seen.rigid}
        kept = f"the target, {seen.mass:.3g} kg, is treated as rigid: that changes the blow by {seen.rigid:.1e}"
    else:
        error = {"infinite plate": seen.endless}
        kept = (
            f"the target is treated as an infinite plate of mobility {seen.mobility:.3g} m/(N s): the striker leaves "
            f"before an echo returns from the edge; that changes the blow by {seen.endless:.1e}"
        )
    dropped = "no mesh and no modes are needed; the target's sound is not computed"
    return _plan(
        asked, target=target, errors=error, reasons=(kept, dropped), mass=seen.mass,
        mobility=seen.mobility if target == "infinite" else 0.0,
        notes=plausible.together(blow.target.notes, seen.notes),
    )  # fmt: skip


def _outside(plan: Plan, kind: str) -> audit.Simplified | None:
    """The target as its mesh and section describe it, without modes; None if there is only modes."""
    target = plan.blow.target
    if target.mesh is None:
        return None
    section = None if target.scale else target.section
    return audit.Simplified(kind, plan.mass or 1.0, target.mesh, section, target.supports)


def _last_resort(asked: _Asked, stages: Stages) -> Plan | None:
    """The plan with an infinite plate, whatever its error, for a blow that no mesh resolves; None if it is unknown."""
    if asked.moving or asked.values.get("striker_force") or asked.values.get("target_force"):
        return None
    with suppress(ValueError):
        plan = _idealised(asked, "infinite", stages)
        return plan if plan is not None and np.isfinite(plan.error) else None
    return None


def _mixed(asked: _Asked, target: str | None, stages: Stages, heavy: bool = False) -> Plan | None:
    """The plan with modes up to a frequency and an infinite plate above it; None if its mobility is not known.

    Or, if it must be ``heavy``, where vectors or few modes do: the infinite plate damps the contact less than
    critically, or few modes tell the blow.
    """
    blow, values = asked.blow, asked.values
    plain = not (blow.target.thick or blow.target.air or values["stretching"] or blow.striker.hand)
    pressed = values["striker_force"] or values["target_force"] or blow.contact.gap < 0.0
    stated = pressed or {"n_modes", "max_frequency"} & set(asked.pieces)
    fits = plain and not stated and not asked.moving and values.get("residual", True)
    with stages("modes"):
        seen = asked.seen if fits else None
    resolved = blow.target.kind == "analytic" or vectors.usable(blow.target)
    if not resolved or seen is None or not np.isfinite(seen.mobility) or not seen.echo:
        if target is None:
            return None
        why = _unfit(asked) if fits else "is only for thin plates in a vacuum, and for the blow alone"
        raise ValueError(f"{blow.name}target = 'mixed' {why}; use target = 'modal'")
    highest = _highest(asked, seen.mobility)
    if target is None and mixed.LASTING * asked.mass * seen.mobility > mixed.LONGEST * asked.duration:
        return None
    if heavy and (
        0.5 * np.pi * asked.mass * seen.mobility < asked.duration
        or blow.target.count_below(highest / blow.target.stretch) < MANY_MODES
    ):
        return None
    frequency = mixed.first_frequency(asked.mass, seen.mobility, seen.echo, asked.duration)
    if blow.target.kind == "fe" and not _mixed_mesh(asked, frequency):
        if target is None:
            return None
        raise check.SimulationError(f"{blow.name}{NO_MESH}")
    number = _mixed_count(asked, frequency)
    kept = (
        f"the target keeps its modes up to about {frequency:.3g} Hz, or higher if the echoes left out matter; above, "
        f"it is treated as an infinite plate of mobility {seen.mobility:.3g} m/(N s), from {highest:.3g} Hz on as a "
        "spring"
    )
    slow = asked.mass * seen.mobility
    why = f"the contact lasts about {asked.duration:.3g} s on a wall, and the striker slows down within {slow:.3g} s"
    size, n_dofs, first, element, work = None, 0, None, "closed form", cost.NOTHING
    if blow.target.kind == "analytic":
        with stages("modes"):
            first = asked.find(FIRST_LOOK, stages=stages)
    else:
        elements, element = _mixed_elements(asked, frequency), "argyris"
        size, n_dofs = elements.size, blow.target.unknowns(values["at"][None], elements, stages)
        work = _mixed_work(asked, seen.mobility, frequency, stages)
    return _plan(
        asked, target="mixed", errors={"echoes left out": SHARE * asked.tolerance}, reasons=(why, kept),
        mass=seen.mass, mobility=seen.mobility, n_modes=number, max_frequency=frequency, first=first, size=size,
        n_dofs=n_dofs, element=element, work=work,
        notes=plausible.together(blow.target.notes, seen.notes),
    )  # fmt: skip


def _highest(asked: _Asked, mobility: float) -> float:
    """Frequency [Hz] above which an infinite plate may act as a spring."""
    return accuracy.infinite_cutoff(mobility, mass=asked.mass, tolerance=asked.left_out, **asked.law)


def _mixed_count(asked: _Asked, frequency: float) -> int:
    """About how many modes the target has up to where they fade, for the infinite plate above a frequency [Hz]."""
    return round(asked.blow.target.count_below(mixed.REACH * frequency / asked.blow.target.stretch))


def _mixed_elements(asked: _Asked, frequency: float) -> Elements:
    """Elements for a blow by Ritz vectors, for the infinite plate above a frequency [Hz]."""
    target, reach = asked.blow.target, mixed.RESOLVED * frequency
    size = vectors.size_for(target, reach, asked.tolerance)
    return vectors.elements_for(target, size, asked.mass, reach, asked.tolerance)


def _mixed_work(asked: _Asked, mobility: float, frequency: float, stages: Stages) -> cost.Work:
    """Work for a blow by Ritz vectors, for the infinite plate above a frequency [Hz]."""
    elements, target = _mixed_elements(asked, frequency), asked.blow.target
    n_dofs = target.unknowns(asked.values["at"][None], elements, stages)
    return cost.by_vectors([n_dofs, n_dofs / refinement.COARSER**2], _mixed_vectors(asked, mobility, frequency), 1.0)


def _all_by_vectors(asked: _Asked, stages: Stages) -> Plan | None:
    """The plan with Ritz vectors and no infinite plate, for a blow whose echoes matter; None if no mesh allows it."""
    with suppress(check.SimulationError):
        plan = _by_vectors(asked, None, stages)
        return plan if plan is not None and plan.target == "vectors" else None
    return None


def _mixed_mesh(asked: _Asked, frequency: float) -> bool:
    """Whether a mesh may be so fine, for the infinite plate above a frequency [Hz]."""
    mesh = asked.blow.target.mesh
    assert mesh is not None
    return _mixed_elements(asked, frequency).size >= refinement.smallest_size("argyris", mesh)


def _mixed_vectors(asked: _Asked, mobility: float, frequency: float) -> int:
    """Number of Ritz vectors tried first, for the infinite plate above a frequency [Hz]."""
    lasts = max(asked.duration, mixed.LASTING * asked.mass * mobility)
    phase = 2.0 * np.pi * mixed.REACH * frequency * lasts
    return vectors.FEWEST + min(_mixed_count(asked, frequency), round(mixed.PER_RADIAN * phase))


def _unfit(asked: _Asked) -> str:
    """Why a target cannot be treated as rigid or infinite without its modes."""
    target = asked.blow.target
    if target.mesh is None or target.mesh.dimension == 1:
        return "is not available for this body"
    if "first_frequency" in target.scale:
        return "needs E, nu, rho and thickness: first_frequency gives the rigidity only once the modes are known"
    return "is only for plates of constant thickness, without tension, point masses and point supports"


def _fewer(asked: _Asked, first: Modes, banded: bool) -> str:
    """What makes a blow that needs more modes than allowed affordable, given its first modes."""
    contact, target = asked.blow.contact, asked.blow.target
    most = MOST_MODES[target.kind]
    reach = float(first.frequencies[-1]) * (most / first.n_modes) ** (2.0 / first.dimension)
    if "n_modes" in asked.pieces:
        return f"give n_modes of at most {most}"
    if "max_frequency" in asked.pieces or banded:
        name = "max_frequency" if "max_frequency" in asked.pieces else "a band of the quantity"
        return f"give {name} of at most {float(f'{0.9 * reach:.1e}'):g} Hz"
    loss = accuracy.LOSSY if contact.rated else 1.0

    def fits(tolerance: float, contact: Contact = contact) -> bool:
        allowed = SHARE * tolerance / (CAUTION * vectors.NOTCH * loss)  # with room for a second, finer run
        law = {"contact": contact, "speed": asked.values["speed"], "mass": asked.mass}
        return accuracy.cutoff_frequency(first, asked.values["at"], tolerance=allowed, **law) <= reach

    enough = accuracy.least_tolerance(fits)
    powers = (10.0**-power for power in range(1, 31))
    softer = next((p for p in powers if fits(asked.tolerance, replace(contact, stiffness=contact.stiffness * p))), None)
    first_word = "no tolerance is large enough" if enough is None else f"tolerance = {enough:g} is affordable"
    if softer is None:
        return f"{first_word}; a heavier striker or a lower speed is needed"
    word = "take" if enough is None else "so is"
    return f"{first_word}; {word} a contact with stiffness = {contact.stiffness * softer:.2g}"


def _by_vectors(asked: _Asked, target: str | None, stages: Stages) -> Plan | None:
    """The plan with a target of Ritz vectors, if these can describe it and only the blow is asked for."""
    blow, values = asked.blow, asked.values
    if target == "modal":
        return None
    fits = vectors.usable(blow.target) and values.get("residual", True) and not values["stretching"]
    fits = fits and not {"n_modes", "max_frequency"} & set(asked.pieces)
    if not fits:
        if target == "vectors":
            raise ValueError(
                f"{blow.name}target = 'vectors' needs a thin plate in a vacuum by elements that can be meshed again, "
                "its residual, no stretching, no n_modes or max_frequency, and no damping ratios mode by mode; use "
                "target = 'modal'"
            )
        return None
    band = asked.quantities.get("sound")
    rings = 0.0 if band is None else blow.target.count_below(band / blow.target.stretch)
    if band is not None and rings > MOST_MODES["fe"]:
        reach = 0.9 * band * MOST_MODES["fe"] / rings
        raise check.SimulationError(
            f"{blow.name}the sound up to {band:g} Hz needs about {rings:.2g} modes, more than the limit of "
            f"{MOST_MODES['fe']}; give a band of the quantity of at most {float(f'{reach:.1e}'):g} Hz"
        )
    with stages("modes"):
        size = asked.pieces.get("size") or vectors.size_for(blow.target, 0.5 / asked.duration, asked.tolerance)
    mesh = blow.target.mesh
    assert mesh is not None
    smallest = refinement.smallest_size("argyris", mesh)
    if size < smallest and "size" not in asked.pieces and not blow.target.size_stated:
        plan = _mixed(asked, None, stages) or _last_resort(asked, stages) if target is None else None
        if plan is not None:
            return plan
        soft = blow.contact.stiffness * (size / smallest) ** (2.0 * (blow.contact.exponent + 1.0))
        needs = refinement.unknowns("argyris", mesh, size)
        raise check.SimulationError(
            f"{blow.name}this blow needs about {needs:.2g} unknowns, elements of {size:.2g} m, more than the limit of "
            f"{refinement.MOST_UNKNOWNS}; take a contact with stiffness = {float(f'{0.9 * soft:.1e}'):g}"
        )
    at = values["at"][None]
    lasts, impacts = _foreseen(asked)
    elements, fixed = _elements(asked, size), blow.target.size_stated or "size" in asked.pieces
    n_dofs = blow.target.unknowns(at, elements, stages)
    meshes = list(vectors.compared(blow.target, elements, stages))
    if impacts > cost.MANY and not fixed:
        meshes.append(vectors.finer(blow.target, meshes[0], stages))
    count = vectors.first_count(blow.target, 0.5 / asked.duration, asked.tolerance)
    kept = f"the target is described by about {count} Ritz vectors, more if the error demands it"
    reason = f"argyris elements of {size:.3g} m, smaller towards the blow, about {n_dofs} unknowns"
    if asked.moving:
        reason += "; the vectors give the early motion, modes driven by the computed force the rest and the sound"
    work = cost.by_vectors([blow.target.unknowns(at, each, stages) for each in meshes], count, lasts)
    rings = _ringing_count(asked)
    ringing = cost.by_modes(cost.PER_MODE * FIRST_LOOK, FIRST_LOOK) + cost.by_modes(cost.PER_MODE * rings, rings)
    if asked.moving:
        work, ringing = work + ringing, cost.NOTHING
    shares = dict.fromkeys(("Ritz vectors", "mesh"), SHARE * (1.0 - CHEAP) * asked.tolerance)
    why = f"the contact lasts about {asked.duration:.3g} s"
    return _plan(
        asked, target="vectors", errors=shares, reasons=(why, kept, reason), n_modes=count, size=size, n_dofs=n_dofs,
        element="argyris", steps=CHEAP, mass=blow.target.mass, notes=blow.target.notes, work=work,
        ringing=ringing.seconds,
    )  # fmt: skip


def _elements(asked: _Asked, size: float) -> Elements:
    """Elements of a size [m] for a blow by Ritz vectors."""
    return vectors.elements_for(asked.blow.target, size, asked.mass, 0.5 / asked.duration, asked.tolerance)


def _foreseen(asked: _Asked) -> tuple[float, int]:
    """How long the blow lasts on an infinite plate, in undisturbed contacts, and its impacts; (1, 1) if not known."""
    at, striker = asked.values["at"], asked.blow.striker
    seen = asked.seen
    if seen is None or not np.isfinite(seen.mobility):
        return 1.0, 1
    endless = idealisation.endless(at, seen.mass, seen.mobility, asked.duration)
    with suppress(check.SimulationError), build.uncompiled():
        hit = collision.strike(
            endless, collision.shortened(striker, _striker_modes(asked, 1.0)[0]), asked.blow.contact, at=at,
            speed=asked.values["speed"], tolerance=audit.ROUGH, duration=cost.LONGEST * asked.duration,
        )  # fmt: skip
        return max((touch.end for touch in hit.impacts), default=0.0) / asked.duration, hit.n_impacts
    return 1.0, 1


def _ringing_count(asked: _Asked) -> int:
    """Predicted number of modes that `_ringing` finds, by Weyl's law."""
    target, band = asked.blow.target, asked.quantities.get("sound")
    mesh, section = target.mesh, target.section
    assert mesh is not None and isinstance(section, Plate)
    wave = target.wave((band or min(AUDIBLE, cost.FAINTEST / asked.duration)) / target.stretch)
    stiffness = section.stiffness(mesh.points[mesh.cells].mean(axis=1))
    ratio = float((stiffness[:, 0, 0] / stiffness[:, 1, 1]).mean())
    number = mesh.area * wave**2 / (4.0 * np.pi) * min(ratio, 1.0 / ratio) ** 0.25  # waves across the grain are shorter
    return max(FIRST_LOOK, min(MOST_MODES["fe"] if band else MOST_RINGING, round(number)))


def _finer_air(hit: Response, tolerance: float) -> float:
    """How many times more modes make the air err so little that a blow meets its tolerance; 1 if it does or cannot.

    The error goes as the area of the cells on which the pressure is found, whose number goes as that of the modes.
    """
    own = hit.error.mesh
    left = vectors.MET * (tolerance - (hit.error.total - own))
    return 1.0 if hit.error.total <= tolerance or left <= 0.0 else max(1.0, own / left)


def _modal(asked: _Asked, stages: Stages, first: Modes | None = None, margin: float = 1.0, more: float = 1.0) -> Plan:
    """The plan with a modal target; finds its first modes, because they tell how many are needed.

    ``more`` times as many are taken.
    """
    target, at, mass = asked.blow.target, asked.values["at"], asked.mass
    with stages("modes"):
        first = asked.find(FIRST_LOOK, stages=stages) if first is None else first
    modes = target.finished(first)
    with target.blame("strike"):
        modes.point("at", at)
    needed = accuracy.cutoff_frequency(modes, at, mass=mass, tolerance=asked.left_out / margin, **asked.law)
    band = max((band for band in asked.quantities.values() if band), default=0.0)
    limit, number = max(needed, band), asked.pieces.get("n_modes")
    if number is None:
        limit = asked.pieces.get("max_frequency", limit)
        # the first modes are kept even if fewer are enough
        number = max(modes.n_modes, round(modes.n_modes * target.growth(modes.frequencies[-1], limit)))
        limit, number = limit * more ** (2.0 / max(1, modes.dimension)), round(number * more)
    else:
        limit = modes.frequencies[min(number, modes.n_modes) - 1] * max(1.0, number / modes.n_modes) ** (
            2.0 / modes.dimension
        )
    if target.modes is not None and number > target.modes.n_modes:
        number, limit = target.modes.n_modes, target.modes.frequencies[-1]
    most = MOST_MODES[target.kind]
    if number > min(most, MANY_MODES) and band <= needed and "target" not in asked.pieces:
        plan = _mixed(asked, None, stages, heavy=number <= most)
        if plan is not None:
            return plan
    if number > most:
        raise check.SimulationError(
            f"{asked.blow.name}this blow needs about {number:.2g} modes, up to {limit:.2g} Hz, more than the limit of "
            f"{most}; {_fewer(asked, modes, band > needed)}"
        )
    left = accuracy.truncation_error(modes, at, limit, mass=mass, **asked.law)
    kept = f"the target keeps its modes up to {limit:.4g} Hz, about {number}; the others act as a spring"
    why = f"the contact lasts about {asked.duration:.3g} s"
    if band > needed:
        kept += f" ({band:g} Hz requested, {needed:.4g} Hz needed for the blow)"
    if asked.values["stretching"]:
        kept += "; it stiffens as it stretches"
    plan = _plan(
        asked, target="modal", errors={"target modes left out": left}, reasons=(why, kept), mass=modes.mass,
        n_modes=number, max_frequency=limit, first=first, margin=margin,
        element="closed form" if target.kind == "analytic" else None,
        notes=plausible.together(target.notes, modes.notes, at_rest(modes, modes.point("at", at))),
    )  # fmt: skip
    if isinstance(first.shapes, FieldShapes):
        plan = _with_mesh(plan, first, first.shapes.system, limit * first.frequencies[-1] / modes.frequencies[-1])
    return plan


def _with_mesh(plan: Plan, first: Modes, system: System, limit: float) -> Plan:
    """The plan with a mesh that resolves a frequency [Hz] of the body as assembled."""
    assert first.frequency_error is not None
    mesh = system.mesh
    stated = plan.blow.target.size_stated or "size" in plan.changes or refinement.resolves(system, limit)
    size = mesh.size if stated else min(mesh.size, refinement.size_for(system, None, limit, None))
    n_dofs = round(refinement.unknowns(system.element, mesh, size))
    error = max(float(first.frequency_error.max()), SHORT_WAVES[system.element])
    reason = f"{system.element} elements of {size:.3g} m, about {n_dofs} unknowns, resolve the shortest wave"
    work = cost.NOTHING  # if the plan has found all modes, and their compliance
    if plan.n_modes > first.n_modes:
        thick = system.element == "argyris and shear"  # its errors come from a second mesh
        coarser = [n_dofs / refinement.COARSER**2] if thick else []
        each = [cost.by_modes(n, plan.n_modes) for n in [n_dofs, *coarser]]
        if mesh.dimension == 2:
            finer = [n_dofs * refinement.COARSER**2] if thick else []
            at_blow = cost.AT_BLOW[system.element]
            each += [cost.compliance(n + at_blow) for n in [n_dofs, *finer]]
        work = replace(sum(each, cost.NOTHING), memory=max(part.memory for part in each))  # one mesh after another
    return replace(
        plan, element=system.element, size=size, n_dofs=n_dofs, errors={**plan.errors, "mesh": error},
        reasons=(*plan.reasons, reason), seconds=plan.seconds + work.seconds, memory=plan.memory + work.memory,
    )  # fmt: skip


def _plan(
    asked: _Asked,
    *,
    errors: Mapping,
    reasons: tuple,
    notes: tuple,
    n_modes: int = 0,
    margin: float = 1.0,
    steps: float = SHARE,
    work: cost.Work = cost.NOTHING,
    **chosen: Any,
) -> Plan:
    """The plan for any target: adds striker modes and time steps, with their errors and cost."""
    kept, left = _striker_modes(asked, margin)
    modes = asked.blow.striker.modes
    if modes.dimension:
        errors = {**errors, "striker modes left out": left}
        bending, whole = kept - modes.n_rigid, modes.n_modes - modes.n_rigid
        stiff = "is treated as rigid" if bending == 0 else f"keeps {bending} of its {whole} bending modes"
        reasons = (*reasons, f"the striker {stiff}")
    scheme = asked.values.get("scheme") or ("A4" if asked.values["stretching"] else None)
    fixed = scheme, asked.values.get("dt")
    scheme, dt = stepping.steps_for(
        asked.blow.contact, asked.duration, steps * asked.tolerance, asked.quantities, *fixed
    )
    until = "fixed by dt" if fixed[1] else f"halved until two runs agree to {steps * asked.tolerance:.1e}"
    lasts = asked.values.get("duration")
    end = "until the bodies have parted for good" if lasts is None else f"for {lasts:g} s"
    count = asked.duration / dt
    refined = scheme == "collocation" and not fixed[1]  # its first step says little of those it takes in the end
    if asked.blow.target.air:
        work = work + cost.in_air(n_modes)
    work = work + cost.strikes(cost.collocated(steps * asked.tolerance) if refined else count, n_modes + kept)
    reasons = (*reasons, f"scheme {scheme}, steps of {dt:.3g} s ({count:.0f} per contact), {until}, {end}")
    return Plan(
        asked.blow,
        MappingProxyType(dict(asked.changes)),
        asked.tolerance,
        asked.quantities,
        **{"element": None, "size": None, "n_dofs": 0, "max_frequency": None, **chosen},
        n_modes=n_modes,
        n_striker_modes=kept,
        scheme=scheme,
        dt=dt,
        duration=asked.duration,
        errors=MappingProxyType({**errors, "steps": steps * asked.tolerance}),
        reasons=reasons,
        seconds=work.seconds,
        memory=work.memory,
        notes=plausible.together(notes, asked.blow.striker.notes, asked.fast),
    )


def _striker_modes(asked: _Asked, margin: float) -> tuple[int, float]:
    """Number of kept striker modes, and the error [-] of leaving out the others."""
    modes, kept = asked.blow.striker.modes, asked.pieces.get("n_striker_modes")
    if not modes.dimension:
        return modes.n_modes, 0.0
    if kept is None and asked.values.get("residual", True):
        return collision.striker_modes(asked.blow.striker, tolerance=asked.tolerance / margin, **asked.law)
    kept = max(modes.n_rigid, min(kept or modes.n_modes, modes.n_modes))
    return kept, collision.striker_error(asked.blow.striker, kept, **asked.law)


def struck(plan: Plan, stages: Stages, keep: Any = None) -> Modes:
    """The modes of the target as planned; ``keep`` as in `carry_out`."""
    keep = keep if plan.costly and plan.n_dofs else None
    target, asked = plan.blow.target, _Asked.checked(plan.blow, plan.changes)
    if plan.target != "modal":
        at = asked.values["at"]
        if plan.target == "rigid":
            found = idealisation.unyielding(at, plan.mass)
        else:
            found = idealisation.endless(at, plan.mass, plan.mobility, asked.duration)
        return replace(found, notes=plan.notes)
    assert plan.first is not None and plan.max_frequency is not None
    with stages("modes"):
        first, modes, number = plan.first, plan.first, asked.pieces.get("n_modes")
        ratio = target.finished(first).frequencies[-1] / first.frequencies[-1]
        if number is not None and number > first.n_modes:
            modes = asked.find(number, first=first, stages=stages, keep=keep)
        elif plan.max_frequency > ratio * first.frequencies[-1] * (1.0 + 1e-9):
            modes = asked.find(FIRST_LOOK, plan.max_frequency / ratio, first=first, stages=stages, keep=keep)
        if number is not None:
            modes = modes.truncated(n_modes=number)
        elif "max_frequency" in asked.pieces:
            modes = modes.truncated(max_frequency=plan.max_frequency / ratio)
        return target.surrounded(modes)


@check.typed
def strike(
    modes: Modes | System,
    striker: Striker,
    contact: Contact,
    *,
    at: Any,
    speed: float | None,
    damping_ratio: Damping | None = None,
    strict: bool = False,
    **options: Any,
) -> Response:
    """Strike a body, at rest or still moving, and follow both bodies until their final separation.

    Parameters
    ----------
    modes : Modes or System
        The struck body. Of an assembled system, the blow computes only what it needs: Ritz vectors for a plate, as
        many modes as the tolerance takes for a beam, neither if the body may count as rigid or infinite; see `fi.plan`.
        Modes are taken as they are; those left out act by their static compliance.
    striker : Striker
        Arrives in rigid motion.
    contact : Contact
    at : strike point, (dimension,) [m]
    speed : float [m/s]
        Speed of the striker's contact point towards the body. None, with ``start``, if the striker goes on as it moves.
    start : State or Response, optional
        Where an earlier blow left the body (`Response.state`; of a response, its end), for Modes only. The striker
        arrives where the surface then is; whoever struck before is gone. A dent or felt is taken as new.
    tolerance : float [-]
        Largest accepted error: absolute for the restitution, relative for impulse, contact time and peak force.
    quantity : str, sequence of str or mapping of str to frequency [Hz], optional
        The quantities that must meet the tolerance; by default "restitution", "impulse", "contact_time", "force" and
        "n_impacts". Others: "spectrum=5000", the force spectrum up to 5 kHz relative to its largest value, and
        "sound=5000".
    residual : bool
        Whether the residual compliance acts; False takes the modes alone for the body, and no error covers the
        others.
    duration : float [s], optional
        Time at which the run stops at the latest.
    max_impacts : int, optional
        The run stops after this many impacts.
    scheme : {"A", "A4", "collocation"}, optional
        Time integration scheme; by default, the tolerance decides.
    dt : float [s], optional
        Time step in contact. If given, the step error is only estimated and may exceed the tolerance.
    striker_force, target_force : float [N]
        Constant forces at the contact points, positive along the blow; for example the weight of a falling ball.
    stretching : bool
        Whether deflections that are not small stretch a plate, or a beam held at both ends, and so stiffen it: von
        Karman's cubic term, good up to deflections of about the thickness. Scheme A or A4; the motion after the blow
        stretches, too.
    damping_ratio : float or function of frequency [Hz], optional
        Damping of a system, which has none of its own.
    strict : bool
        Whether a missed tolerance raises SimulationError; otherwise it warns (`ToleranceWarning`).
    target, model, size, n_modes, max_frequency, n_striker_modes : optional
        Parts of the model to fix by hand, as in `fi.plan`.

    Returns
    -------
    Response

    Raises
    ------
    ValueError
        If an argument is invalid.
    SimulationError
        If the tolerance cannot be met, or if the bodies do not separate for good and no other end was given.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300)
    >>> stick, law = fi.Striker.stick(mass=0.1, first_frequency=10e3), fi.Contact.hertz(695e3)
    >>> hit = fi.strike(plate, stick, law, at=(0.45, 0.3), speed=1.0, tolerance=1e-3)
    >>> hit.n_impacts, round(hit.restitution, 2), hit.error.total < 1e-3
    (1, 0.55, True)
    """
    if isinstance(modes, Modes) and damping_ratio is None and not set(options) & set(PIECES):
        run = partial(collision.strike, modes, striker, contact, at=at, speed=speed)

        def told() -> Response:
            first = run(**options)
            return audit.audited(within(first.tolerance, first, run, options))

        stretches = bool(options.get("stretching")) or modes.stretches
        return promise.kept(fresh.answer(told, stretches), strict)
    if options.pop("start", None) is not None or speed is None:
        raise ValueError(
            "start needs modes, taken as they are: give those of the blow before, hit.target, and no part of a plan"
        )
    plan = plan_of(modes, striker, contact, at=at, speed=speed, damping_ratio=damping_ratio, **options)
    if plan.seconds > progress.LONG:
        progress.SLOW.info("striking takes %s", plan.cost)
    return plan.strike(strict)
