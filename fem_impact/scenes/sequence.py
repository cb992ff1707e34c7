"""A scene of several strokes: rolls, flams and two sticks at once, played on one body and reported as one."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from .._base import check, markup
from .._base.explained import heading_line, lines_of_notes, with_headings
from ..impact import assumption, quantities
from ..impact.engine import TOLERANCE
from ..model import cost, playing
from ..model.planner import Plan
from ..model.playing import Strokes
from ..model.target import Stages, Watch
from ..show import export
from .schema import REPEATED

if TYPE_CHECKING:
    from .scene import Scene

OF_SEQUENCE = ("tolerance", "quantity", "residual", "duration")  # keys of [strike] that hold for all strokes together
OF_BODY = ("n_modes", "max_frequency", "size")  # how the body is described, as in `fi.plan`
TAKEN = (*OF_SEQUENCE, *OF_BODY)
SCALARS = (
    "n_impacts", "contact_time", "peak_force", "impulse", "energies", "tolerance", "tolerance_met", "error",
    "trusted", "verdict",
)  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class SequencePlan(check.Brief):
    """How a sequence will be modelled, why and at what cost; `print` it. `Scene.plan_strokes` makes it."""

    tolerance: float  # [-] for every stroke with what it inherits from those before
    strokes: tuple[Mapping[str, Any], ...]  # in order of time: when [s], at [m], speed [m/s]
    # of every stroke as if it struck the body at rest, to EACH of the tolerance; strokes alike share one
    plans: tuple[Plan, ...]

    @property
    def needed(self) -> int:
        """Number of the most demanding stroke: the body has the modes that this one needs."""
        return max(range(len(self.plans)), key=lambda i: self.plans[i].max_frequency or 0.0)

    @property
    def body(self) -> Plan:
        """The plan of the most demanding stroke, which sets the modes of the body, with the cost of all strokes."""
        own = self.plans[self.needed]
        others = [plan for i, plan in enumerate(self.plans) if i != self.needed]
        blows = (cost.strikes(each.duration / each.dt, own.n_modes + each.n_striker_modes) for each in others)
        return replace(own, seconds=own.seconds + sum(blow.seconds for blow in blows))

    @property
    def meets(self) -> bool:
        """Whether the predicted error of every stroke is at most its share of the tolerance."""
        return all(plan.meets for plan in self.plans)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Sentences: how the tolerance is shared, what is kept of the body, and why."""
        body, count, kept = self.body, len(self.plans), "met" if self.meets else "MISSED"
        shared = (
            f"tolerance {self.tolerance:g} of {quantities.words(body.quantities)} will be {kept} by {count} strokes: "
            f"each to {body.tolerance:g} by itself, and the rest for what it inherits from those before"
        )
        return shared, f"the body has the modes that stroke {self.needed} needs, the most demanding", *body.reasons

    def data(self) -> dict[str, Any]:
        """All decisions and predictions by name, in SI units; ``plan`` of a stroke is its number in ``plans``."""
        single = list({id(plan): plan for plan in self.plans}.values())
        numbers = [next(i for i, plan in enumerate(single) if plan is mine) for mine in self.plans]
        return {
            "tolerance": self.tolerance, "meets": self.meets, "needed": self.needed, "seconds": self.body.seconds,
            "memory": self.body.memory,
            "strokes": [{**stroke, "plan": number} for stroke, number in zip(self.strokes, numbers)],
            "plans": [plan.data() for plan in single],
        }  # fmt: skip

    def __str__(self) -> str:
        body, count = self.body, len(self.plans)
        shared, *reasons = self.reasons
        rows = [
            (i, f"{stroke['when']:.4g} s", f"{stroke['speed']:.4g} m/s", f"{plan.error:.1e}",
             f"{plan.max_frequency:.4g} Hz")
            for i, (stroke, plan) in enumerate(zip(self.strokes, self.plans))
        ]  # fmt: skip
        head = "stroke", "when", "speed", "predicted error", "modes needed to"
        more = [f"... and {count - playing.LISTED} more"] if count > playing.LISTED else []
        table = (*markup.columns(rows[: playing.LISTED], head), *more, *reasons)
        lines = [shared, *heading_line(shared), *(f"  {line}" for line in table)]
        if body.assumptions:
            said = assumption.lines(body.assumptions, self.tolerance)
            lines += [f"Model of stroke {self.needed}: {with_headings(line)}" for line in said]
        return "\n".join([*lines, f"Cost: {body.cost}", *lines_of_notes(body.notes)])


class Played(NamedTuple):
    """A sequence as it was played."""

    plan: SequencePlan
    response: Strokes
    seconds: dict[str, float]  # [s] wall time of each stage, by its name


def run_sequence(
    scene: "Scene",
    watch: Watch | None = None,
    *,
    before: Callable[[Plan], object] | None = None,
    strict: bool = False,
    **changes: Any,
) -> Played:
    """As `Scene.run_strokes`: with the plan, which ``before`` gets first, and the time of every stage."""
    stages = Stages(watch)
    planned = plan_sequence(scene, watch, **changes)
    if before is not None:
        before(planned.body)
    _, modes = planned.body.description.found(stages)
    options = {name: scene.blow.values[name] for name in OF_SEQUENCE if name in scene.blow.values}
    options |= {name: value for name, value in changes.items() if name in OF_SEQUENCE and value is not None}
    strokes: list[tuple[Any, ...]] = []
    for i, part in enumerate(scene.stroke):
        single, own = scene.alone(i), part.values
        striker = (single if "striker" in own else scene).make_striker()
        stroke = own["when"], striker, single.make_contact(), single.blow.values["at"], single.blow.values["speed"]
        strokes.append((*stroke, own["lasts"]) if "lasts" in own else stroke)
    with stages("strike"):
        found = playing.strokes(modes, strokes, strict=strict, **options)
    found = replace(found, notes=tuple(dict.fromkeys((*modes.notes, *found.notes))))
    return Played(planned, found, dict(stages.seconds))


def plan_sequence(scene: "Scene", watch: Watch | None = None, **changes: Any) -> SequencePlan:
    """As `Scene.plan_strokes`."""
    if not scene.stroke:
        raise scene.fault(f"[[{REPEATED}]] is missing: strokes are played together; a single blow has strike and plan")
    wrong = [name for name in changes if name not in TAKEN]
    if wrong:
        raise ValueError(f"{wrong[0]} must be left out for a scene with strokes; it takes {', '.join(TAKEN)}")
    wanted = {name: changes[name] for name in (*OF_SEQUENCE[:2], *OF_BODY) if changes.get(name) is not None}
    with scene.blame("strike", wanted):
        tolerance = check.tolerance(wanted.get("tolerance", scene.blow.values.get("tolerance", TOLERANCE)))
    wanted |= {"target": "modal", "tolerance": playing.EACH * tolerance}
    order = played_order(scene)
    parts, alone = [scene.stroke[i] for i in order], [scene.alone(i) for i in order]
    keys: list[str] = []
    fastest: dict[str, Scene] = {}
    for part, single in zip(parts, alone):
        blow = single.blow.values
        keys.append(repr([part.values.get("striker"), part.values.get("contact"), blow["at"]]))
        other = fastest.get(keys[-1], single)
        fastest[keys[-1]] = single if blow["speed"] >= other.blow.values["speed"] else other
    plans, target = {}, alone[0].built.target  # of all strokes, so that its first modes are found once
    for key, single in fastest.items():
        try:
            plans[key] = replace(single.built, target=target).plan(watch, **wanted)
        except ValueError as error:  # of a scene with one blow only
            before, file, said = str(error).partition(f"{check.line(str(scene.path))}: [strike] ")
            if before or not file:
                raise
            raise scene.fault(f"[[{REPEATED}]] {order[keys.index(key)]} {said}") from None
    strokes = tuple(
        {"when": part.values["when"], "at": single.blow.values["at"], "speed": single.blow.values["speed"]}
        for part, single in zip(parts, alone)
    )
    return SequencePlan(tolerance, strokes, tuple(plans[key] for key in keys))


def played_order(scene: "Scene") -> list[int]:
    """Which table of the scene each stroke is, in order of time."""
    return sorted(range(len(scene.stroke)), key=lambda i: scene.stroke[i].values["when"])


def sequence_numbers(found: Strokes, scene: Mapping[str, Any], seconds: Mapping[str, float]) -> dict[str, Any]:
    """Everything found of a sequence, as plain data: its numbers, strokes and impacts, and the tables of its scene."""
    data = {name: getattr(found, name) for name in SCALARS}
    strokes = [
        {
            "when": each.when, "at": each.at, "speed": each.speed, "lasts": each.lasts,
            "n_impacts": sum(impact.contact == i for impact in found.impacts),
            "impulse": sum(impact.impulse for impact in found.impacts if impact.contact == i),
        }
        for i, each in enumerate(found.strokes)
    ]  # fmt: skip
    impacts = [
        {"stroke" if name == "contact" else name: getattr(impact, name) for name in export.IMPACT_PARTS}
        for impact in found.impacts
    ]
    modes = {"n_modes": found.target.n_modes, "max_frequency": found.target.frequencies[-1]}
    rest = {"seconds": dict(seconds), "notes": list(found.notes), "scene": scene, "versions": export.versions()}
    return export.plain({"sequence": {**data, **modes}, "strokes": strokes, "impacts": impacts, **rest})
