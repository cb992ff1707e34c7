"""A scene of several strokes: rolls, flams and two sticks at once, played on one body and told as one."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from .._base import check
from ..impact import collision
from ..model import planner, playing
from ..model.playing import Strokes
from ..model.target import Stages, Watch
from ..modes.modal import Modes
from ..show import export
from .schema import REPEATED

if TYPE_CHECKING:
    from .scene import Scene

OF_SEQUENCE = ("tolerance", "quantity", "residual", "duration")  # keys of [strike] that hold for all strokes together
OF_BODY = ("n_modes", "max_frequency", "size")  # how the body is described, as in `fi.plan`
TAKEN = (*OF_SEQUENCE, *OF_BODY)
SCALARS = (
    "n_impacts", "contact_time", "peak_force", "impulse", "energies", "tolerance", "tolerance_met", "error", "verdict",
)  # fmt: skip


def play(scene: "Scene", watch: Watch | None = None, strict: bool = False, **changes: Any) -> Strokes:
    """As `Scene.play`."""
    if not scene.stroke:
        raise scene.fault(f"[[{REPEATED}]] is missing: Scene.play plays strokes, Scene.strike a single blow")
    wrong = [name for name in changes if name not in TAKEN]
    if wrong:
        raise ValueError(f"{wrong[0]} must be left out for a scene with strokes; it takes {', '.join(TAKEN)}")
    stages = Stages(watch)
    modes = modes_for(scene, stages, **changes)
    told = {name: scene.blow.values[name] for name in OF_SEQUENCE if name in scene.blow.values}
    told |= {name: value for name, value in changes.items() if name in OF_SEQUENCE and value is not None}
    strokes: list[tuple[Any, ...]] = []
    for i, part in enumerate(scene.stroke):
        single, own = scene.alone(i), part.values
        striker = (single if "striker" in own else scene).make_striker()
        stroke = own["when"], striker, single.make_contact(), single.blow.values["at"], single.blow.values["speed"]
        strokes.append((*stroke, own["lasts"]) if "lasts" in own else stroke)
    with stages("strike"):
        found = playing.strokes(modes, strokes, strict=strict, **told)
    return replace(found, notes=tuple(dict.fromkeys((*modes.notes, *found.notes))))


def modes_for(scene: "Scene", stages: Stages, **changes: Any) -> Modes:
    """The modes of the body that its most demanding stroke needs, planned as if each struck it at rest."""
    wanted = {name: changes[name] for name in (*OF_SEQUENCE[:2], *OF_BODY) if changes.get(name) is not None}
    tolerance = wanted.get("tolerance", scene.blow.values.get("tolerance", collision.TOLERANCE))
    wanted |= {"target": "modal", "tolerance": playing.EACH * check.tolerance(tolerance)}
    fastest: dict[str, int] = {}
    for i, part in enumerate(scene.stroke):
        blow = scene.alone(i).blow.values
        key = repr([part.values.get("striker"), part.values.get("contact"), blow["at"]])
        j = fastest.get(key, i)
        fastest[key] = i if blow["speed"] >= scene.alone(j).blow.values["speed"] else j
    plans = [scene.alone(i).plan(watch=stages.watch, **wanted) for i in fastest.values()]
    return planner.struck(max(plans, key=lambda plan: plan.max_frequency or 0.0), stages)


def numbers(found: Strokes, scene: Mapping[str, Any], seconds: Mapping[str, float]) -> dict[str, Any]:
    """Everything a sequence told, as plain data: its numbers, strokes and impacts, and the tables of its scene."""
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
