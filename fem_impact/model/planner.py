"""Choose the smallest model of a blow that meets its tolerance, and run it.

A description of the target, one of `DESCRIPTIONS`, knows when it applies, predicts its errors and cost (``of``), finds
the modes that are struck (``found``) and says which other one the errors of a blow require (``refined``).
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from types import MappingProxyType
from typing import Any

from .._base import check, markup, progress
from .._base.explained import heading_line, headings_of, lines_of_notes, with_headings
from .._base.threads import one_thread
from ..fe import plausible
from ..fe.assembly import System
from ..impact import assumption, collision, distance, promise
from ..impact.assumption import Assumption
from ..impact.contact import Contact
from ..impact.quantities import USUAL, words
from ..impact.response import Response
from ..impact.striker import Striker
from ..modes.modal import Damping, Modes
from . import audit, cost, fresh
from .asked import PIECES, Asked, Description, Forecast, Unaffordable, refine
from .budget import FINEST, VERIFYING
from .by_idealisation import Idealised
from .by_mixture import Mixed
from .by_modes import MANY_MODES, Modal
from .by_vectors import Vectors
from .target import Stages, Target, Watch

# of a target, by name, the cheapest first; and which others may serve where one is unaffordable
DESCRIPTIONS: Mapping[str, Callable[..., Any]] = {
    "rigid": partial(Idealised.of, "rigid"), "infinite": partial(Idealised.of, "infinite"), "mixed": Mixed.of,
    "vectors": Vectors.of, "modal": Modal.of,
}  # fmt: skip
OTHERS = {"vectors": ("mixed", "infinite"), "modal": ("mixed",)}


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
        return make_plan(self, changes, Stages(watch))

    def run(self, watch: Watch | None = None, *, plan: "Plan | None" = None, keep: Any = None, **changes: Any) -> "Run":
        """Strike, and time every stage; with a plan or by a new one."""
        stages = Stages(watch)
        return carry_out(make_plan(self, changes, stages) if plan is None else plan, stages, keep)


@dataclass(frozen=True, repr=False)
class Plan(Forecast, check.Brief):
    """The model of a blow, its reasons and its cost; `print` it, `run` it, or override pieces with `but`.

    The plan depends only on the blow, the tolerance and the quantities: the same blow gives the same plan.
    """

    blow: Blow = field(kw_only=True, repr=False, compare=False)
    changes: Mapping[str, Any] = field(kw_only=True, repr=False, compare=False)  # arguments and pieces overridden
    description: Description = field(kw_only=True, repr=False, compare=False)  # of the target

    @property
    def meets(self) -> bool:
        """Whether the predicted error is at most the tolerance."""
        return self.error <= self.tolerance

    @cached_property
    def assumptions(self) -> tuple[Assumption, ...]:
        """Is the model itself right, as far as that is known before the blow? As in `Response`, without effects.

        They come from the same blow on a wall, which is the hardest.
        """
        asked, blow = self.description.asked, self.blow
        target = replace(blow.target, stretching=asked.values["stretching"])
        striker = collision.shortened_striker(blow.striker, self.n_striker_modes)
        modes = target.modes if self.first is None else self.first
        body = asked.simplified("infinite", self.mass) if modes is None else target.finished(modes)
        assert body is not None
        how = {"speed": asked.values["speed"], "quantity": asked.quantities, "rings": self.description.rings}
        return audit.examine_plan(target, body, striker, blow.contact, asked.values["at"], **how)

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
            progress.ANNOUNCER.announce(f"striking takes {self.cost}", self.seconds)
            return promise.warn_if_missed(self.run().response, strict)
        stretches = self.description.asked.values["stretching"]
        return promise.warn_if_missed(fresh.answer(lambda: self.run().response, stretches), strict)

    @property
    def cost(self) -> str:
        """Predicted time and memory, in words."""
        time = f"{self.seconds:.1g} s" if self.seconds < 10.0 else f"{self.seconds:.0f} s"
        memory = float(f"{self.memory / 1e6:.2g}")
        return f"about {time} and {memory:.0f} MB predicted for {cost.machine_in_words()}"

    def data(self) -> dict[str, Any]:
        """All decisions and predictions by name, in SI units."""
        hidden = ("blow", "changes", "description", "first")
        found = {name: getattr(self, name) for name in self.__dataclass_fields__ if name not in hidden}
        plain = {name: dict(value) if isinstance(value, Mapping) else value for name, value in found.items()}
        return plain | {"assumptions": assumption.table(self.assumptions)}

    def __str__(self) -> str:
        wanted = words(self.quantities)
        kept = "met" if self.meets else "MISSED"
        model, *doubts = assumption.lines(self.assumptions, self.tolerance)
        first = f"tolerance {self.tolerance:g} of {wanted} will be {kept}: predicted error {self.error:.1e}; {model}"
        lines = [first, *heading_line(first), *lines_of_notes(self.notes), *(f"  {line}" for line in self.reasons)]
        lines.append("Predicted errors:")
        errors = [*self.errors.items(), ("total", self.error)]
        lines += [f"  {line}" for line in markup.columns([(name, f"{error:.1e}") for name, error in errors])]
        lines += [f"Model: {with_headings(line)}" for line in doubts]
        lines.append(f"Cost: {self.cost}")
        if self.ringing > progress.LONG:
            lines.append(f"  motion, sound and pictures take about {self.ringing:.0f} s more once they are asked for")
        if self.costly:
            lines.append("  a larger tolerance, a softer contact or fewer quantities would cost less")
        if self.memory > cost.memory_installed():
            lines.append(f"  the {cost.memory_installed() / 1e9:.2g} GB of memory of this machine do not suffice")
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
        return self.plan.description.rings


def plan_of(
    body: System | Modes, striker: Any, contact: Any, watch: Watch | None = None, *, at: Any, speed: float,
    damping_ratio: Damping | None = None, **rest: Any,
) -> Plan:  # fmt: skip
    """The plan of a blow that a user describes with objects; ``rest`` as in `fi.plan`."""
    check.instance("striker", striker, Striker)
    check.instance("contact", contact, Contact)
    pieces = {name: rest.pop(name) for name in PIECES if name in rest}
    target = Target.of(body, damping_ratio)
    return Blow(target, striker, contact, {"at": at, "speed": speed, **rest}).plan(watch, **pieces)


def _planned(description: Description) -> Plan:
    """The plan with a description of the target."""
    asked = description.asked
    return Plan(blow=asked.blow, changes=asked.changes, description=description, **vars(description.forecast))


@one_thread
def make_plan(blow: Blow, changes: Mapping[str, Any], stages: Stages) -> Plan:
    """Choose the model of a blow; see `fi.plan`."""
    asked = Asked.checked(blow, changes)
    with _note_slips(partial(slips_of, asked), blow.name):
        plan = _planned(choose(asked, stages))
    if not _chooses(plan):
        return plan
    more = "the blow tells whether shear, air or stretching must be taken in, at a cost that is not predicted here"
    return replace(plan, reasons=(*plan.reasons, f"model = 'auto': {more}"))


def _chooses(plan: Plan) -> bool:
    """Whether the model of the target may become a better one."""
    return plan.changes.get("model", plan.blow.target.model) == "auto"


def slips_of(asked: Asked) -> tuple[str, ...]:
    """Notes on numbers that are probably a slip of a unit, without those on the mesh."""
    target = asked.blow.target
    assumed = () if target.mesh is None else target.mesh.notes
    return tuple(note for note in (*target.assumed, *asked.slips) if note not in assumed)


@contextmanager
def _note_slips(find: Callable[[], tuple[str, ...]], name: str = "") -> Iterator[None]:
    """Put numbers that are probably a slip of a unit in front of an error, which is then hardly about anything else.

    The ``name`` of the file goes first.
    """
    try:
        yield
    except check.SimulationError as error:
        slips, said = find(), str(error).removeprefix(name)
        if slips and not said.startswith(slips[0]):
            said = f"{'; '.join(slips)}: {said}"
        raise check.SimulationError(f"{name}{said}") from None


def choose(asked: Asked, stages: Stages) -> Description:
    """The cheapest description of the target that will do, or the one asked for."""
    blow, named = asked.blow, asked.pieces.get("target")
    held = blow.striker.returns  # it comes back when the body has long answered
    stated = blow.target.modes is not None or "size" in asked.pieces or asked.counted
    names = [name for name in DESCRIPTIONS if blow.target.kind == "fe" or name != "mixed"]
    for name in [named] if named else ["modal"] if held or stated else names:
        try:
            found = DESCRIPTIONS[name](asked, stages)
        except Unaffordable as error:
            others = () if named else OTHERS[name]
            instead = (DESCRIPTIONS[other](asked, stages, anyway=True) for other in others)
            found = next((other for other in instead if other is not None), None)
            if found is None:
                raise check.SimulationError(str(error)) from None
        if found is not None:
            break
    # of all modes by closed formulas, which cost little, only many are worth leaving out
    if named is None and isinstance(found, Modal) and found.forecast.n_modes > MANY_MODES and not found.banded:
        return Mixed.of(asked, stages) or found
    return found


@one_thread
def carry_out(plan: Plan, stages: Stages, keep: Any = None) -> Run:
    """Run the plan, and then with the better models of the target that the tolerance requires, if it may choose."""
    with _note_slips(partial(slips_of, plan.description.asked), plan.blow.name):
        run = strike_as_planned(plan, stages, keep)
    added: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()
    together = True
    while _chooses(plan) and (better := audit.required_model(plan.blow.target, run.response, refused, together)):
        changes, why, names = better
        before = sum(stages.seconds.values())
        try:
            again = make_plan(replace(plan.blow, target=plan.blow.target.changed(**changes)), plan.changes, stages)
            progress.revise(again.seconds)
            again = replace(again, description=again.description.after(run.plan.description))
            run = strike_as_planned(again, stages, None)
        except (check.SimulationError, ValueError, MemoryError) as error:
            if len(names) > 1:
                together = False
            else:
                added, refused = (*added, f"{why}; that was not computed: {error}"), (*refused, *names)
            continue
        plan, added = again, (*added, f"{why}; that took {sum(stages.seconds.values()) - before:.1g} s more")
    return replace(run, notes=(*added, *run.notes))


def strike_as_planned(plan: Plan, stages: Stages, keep: Any = None) -> Run:
    """Strike the target as planned, and better descriptions of it as long as the errors of the blow require one.

    ``keep`` is a file that stores the modes of a costly plan.
    """
    if plan.memory > (here := cost.memory_installed()):
        advice = "take a larger tolerance or a softer contact"
        if plan.blow.target.thick:
            advice += ", or the thin theory, which estimates what shear changes of the blow (`thin target`)"
        raise check.SimulationError(
            f"this blow needs about {plan.memory / 1e9:.2g} GB of memory for {plan.n_modes} modes or "
            f"vectors of {plan.n_dofs} unknowns, more than the {here / 1e9:.2g} GB of this machine; {advice}"
        )
    last, response, run = refine(plan.description, _strike, stages, keep)
    response = last.completed(meet_tolerance(plan.tolerance, response, run, last.asked.values), stages, keep)
    forecast = last.forecast
    if response.ringing is not None:
        forecast = replace(forecast, max_frequency=float(response.target.frequencies[-1]))
    plan = _planned(replace(last, forecast=forecast, ritz=None))
    return Run(response, MappingProxyType(stages.seconds), plan, plausible.together(plan.notes, response.notes))


def _strike(found: Description, modes: Modes, stages: Stages) -> tuple[Response, Callable[..., Response]]:
    """A blow with the predicted time steps, or coarser ones if that takes too many, and how to repeat it."""
    asked, blow = found.asked, found.asked.blow
    striker = collision.shortened_striker(blow.striker, asked.striker_modes(found.margin)[0])
    run = partial(collision.strike, modes, striker, blow.contact)
    with stages("strike"), blow.target.blame("strike"):
        if (steps := found.forecast.errors["steps"]) < asked.budget.half:
            with suppress(check.SimulationError):
                return run(**{**asked.values, "tolerance": steps}), run
        return run(**{**asked.values, "tolerance": asked.budget.half}), run


def strike_by_plan(run: Callable[..., Response], values: Mapping[str, Any]) -> Response:
    """What a function strikes with some arguments, again with finer time steps where the other errors leave less."""
    hit = run(**values)
    return meet_tolerance(hit.tolerance, hit, run, values)


def meet_tolerance(
    tolerance: float, hit: Response, run: Callable[..., Response], values: Mapping[str, Any]
) -> Response:
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
    target = plan.target if plan.n_modes else "modal"
    finer: dict[str, Any] = {"tolerance": max(FINEST, plan.tolerance / VERIFYING), "target": target}
    if plan.size is not None and plan.description.rings:
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
    """Differences [-] of two runs of one blow, as of `distance`; that of the force has the name "peak_force"."""
    found = distance.of_blows(one, two, {**USUAL, **quantities})
    return {"peak_force" if name == "force" else name: apart for name, apart in found.items()}


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
        "sound=5000", what the body rings with up to 5 kHz, relative to the root of its energy: of soft blows, which
        make little sound, it is far less exact than the numbers of the blow unless it is asked for.
    residual : bool
        Whether the residual compliance acts; False takes the modes alone for the body, and no error covers the
        others.
    duration : float [s], optional
        Time at which the run stops at the latest.
    max_impacts : int, optional
        The run stops after this many impacts.
    scheme : {"A", "A4", "collocation"}, optional
        Time integration scheme, by default A4; so is the last, the name of an earlier one.
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
        stretches = bool(options.get("stretching")) or modes.stretches
        notes = *modes.notes, *striker.notes
        with _note_slips(lambda: tuple(each for each in notes if "slips-of-units" in headings_of(each))):
            return promise.warn_if_missed(
                fresh.answer(lambda: audit.with_examiner(strike_by_plan(run, options)), stretches), strict
            )
    if options.pop("start", None) is not None:
        raise ValueError(
            "start needs modes, taken as they are: give those of the blow before, hit.target, and no part of a plan"
        )
    if speed is None:
        raise ValueError("speed must be given in m/s")
    return plan_of(modes, striker, contact, at=at, speed=speed, damping_ratio=damping_ratio, **options).strike(strict)
