"""A scene as a whole: its tables fit together, and what is cheap to build can be built."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base import check
from ..fe.assembly import THICK
from ..impact.stepping import Options
from ..sweeps.cells import ALIASES, AXES, rescales
from .keys import checked, form
from .schema import MAKERS, NESTED, REPEATED, Part, rise_of
from .sequence import OF_SEQUENCE

if TYPE_CHECKING:
    from ..model.target import Watch
    from .scene import Scene


def check_whole(scene: "Scene") -> None:
    """Build whatever is cheap, so that a wrong number fails at once, and check that the tables fit together."""
    target, line = scene.target.values, scene.mesh.kind == "line"
    bare = scene.section is None and not scene.layer
    _ = scene._target
    with scene.blame("mesh"):
        for key, value in scene.mesh.values.items():
            if form("mesh", scene.mesh.kind, key).get("type") == "number":
                checked("mesh", key, value)
        if "rise" in scene.mesh.values:
            rise_of(scene.mesh.values["rise"])
    list(scene._listed("rib"))
    if not scene.layer and (scene.material is None) != bare:
        missing, there = ("section", "material") if bare else ("material", "section")
        raise scene.fault(f"[{missing}] is missing; [{there}] needs it")
    thick, other = target.get("theory") in THICK, scene.striker.kind != "sphere" or bare
    single = ", ".join(name for name in scene.blow.values if name not in ("at", "speed", *OF_SEQUENCE))
    wrong = {
        "[target] needs mass and first_frequency if there is no [material]": bare
        and not {"mass", "first_frequency"} <= set(target),
        "[target] nu must be left out beside [material], which has it": not bare and "nu" in target,
        "[[rib]] needs [material] and [section] of a plate, and [in_plane] too": (bare or line)
        and (scene.rib or scene.in_plane.values),
        "[target] theory needs [material] and [section]: shear depends on the thickness": bare and thick,
        "[target] baffle must be left out for a beam, which is in free air": line and target.get("baffle") is True,
        "[contact] kind 'between' needs a striker of kind 'sphere' and a [section]": other
        and scene.contact.kind == "between",
        f"[strike] {single} must be left out with [[{REPEATED}]], of which all take {', '.join(OF_SEQUENCE)}; each may "
        "have lasts": scene.stroke and single,
        "[observe] listener of a beam needs [material] and [section], for its width": bare and line and scene.listeners,
    }
    for text, holds in wrong.items():
        if holds:
            raise scene.fault(text)
    if scene.observe is not None:
        scene._make("observe", scene.observe)
    if scene.map is not None:
        check_axes(scene, scene._make("map", scene.map)["over"])
    _check_blow(scene)
    if scene.listeners and line:
        width, height = scene.girth
        if height > width:
            raise scene.fault(
                f"[observe] listener must be left out for a beam higher than wide, here {height:g} and {width:g} m: "
                "its sound is not known"
            )
    if not bare:
        scene.make_section("plate" if scene.section is None else scene.section.kind)
    scene.make_striker()
    scene.make_contact()
    for i, part in enumerate(scene.stroke):
        if any(name in part.values for name in NESTED):
            try:
                check_whole(scene.alone(i))
            except ValueError as error:
                said = str(error).removeprefix(f"{check.line(str(scene.path))}: ")
                raise scene.fault(f"[[{REPEATED}]] {i} {said}") from None


def for_many(
    scene: "Scene", tolerance: float | None = None, watch: "Watch | None" = None
) -> tuple["Scene", tuple[str, ...]]:
    """The scene as many blows on one body share it, and notes on that; ValueError if they cannot.

    Where the model of the target is to be chosen, it is the one that the scene's own blow requires.
    """
    scene.check_single()
    scene.check_unpushed()
    notes: tuple[str, ...] = ()
    if scene.blow.values.get("quantity"):
        notes = ("quantity of [strike] is of the single blow; here the tolerance holds for the numbers of each blow",)
    if scene.target.values.get("model") != "auto":
        return scene, notes
    changes: dict[str, Any] = {} if tolerance is None else {"tolerance": tolerance}
    found = scene.run(watch, **changes).plan.blow.target
    chosen = {name: value for name in ("theory", "air", "stretching") if (value := getattr(found, name))}
    said = ", ".join(f"{name} = {value}" for name, value in chosen.items()) or "nothing beyond what is stated"
    target = Part(scene.target.kind, {**scene.target.values, **chosen, "model": "stated"})
    notes += (f"the model of the target is what the scene's own blow requires: {said}",)
    return replace(scene, target=target), notes


def is_tied(scene: "Scene", name: str) -> bool:
    """Whether an axis is a number of the scene by which another acts, too, so that more changes than the axis would."""
    key, law = AXES[name][2] if name in AXES else name, scene.contact
    yields = law.kind == "elastic_plastic" and "yield_speed" in law.values
    turns = scene.striker.kind == "turning"
    return (turns and key == "striker.mass") or (yields and key in ("contact.stiffness", "contact.exponent"))


def check_axes(scene: "Scene", over: Mapping[str, Any]) -> list[str]:
    """The axes of a map each of whose values needs another body: that `sweep` does not have, or that do not rescale.

    Raises ValueError unless these are numbers of the scene, with values or a range with a count.
    """
    tables = [name for name in MAKERS if name not in ("observe", "map")]  # those two change no blow
    known = [f"{name}.{key}" for name in tables for key in getattr(getattr(scene, name), "values", {})]
    axes = [ALIASES.get(name, name) for name in over]
    for axis in axes:
        if axes.count(axis) > 1:
            raise scene.fault(f"[map] over names the axis {axis} twice")
    air, ratio = (scene._target[name] for name in ("air", "damping_ratio"))
    anew = [
        name for name in over
        if ALIASES.get(name, name) not in AXES or not rescales(name, air, ratio) or is_tied(scene, name)
    ]  # fmt: skip
    for name in anew:
        if name not in known and ALIASES.get(name, name) not in AXES:
            near = check.nearest(name, [*AXES, *ALIASES, *known])
            raise scene.fault(f"[map] over: {name} is not an axis{near}")
        if isinstance(over[name], partial) or (isinstance(over[name], Mapping) and "count" not in over[name]):
            raise scene.fault(f"[map] over: {name} needs a count, because each value needs another body")
    return anew


def _check_blow(scene: "Scene") -> None:
    """Check the numbers of [strike], and that places are points of a body of this dimension."""
    options = {name: value for name, value in scene.blow.values.items() if name not in ("tolerance", "quantity")}
    at, speed = options.pop("at"), options.pop("speed")  # and those two may be given otherwise at the prompt
    with scene.blame("strike"):
        _check_place(scene, "at", at)
        # strokes have speeds of their own
        (check.non_negative if scene.stroke else check.positive)("speed", speed, "m/s")
        Options(**options)
    for i, part in enumerate(scene.stroke):
        with scene.blame(f"[[{REPEATED}]] {i}"):
            _check_place(scene, "at", part.values.get("at", at))
    with scene.blame("observe"):
        for i, point in enumerate(scene.watched):
            _check_place(scene, f"points[{i}]", point)


def _check_place(scene: "Scene", name: str, value: Any) -> None:
    listed = isinstance(value, (list, tuple)) and len(value) == 2
    line = scene.mesh.kind == "line" or (scene.mesh.kind == "file" and not listed)  # which holds either
    places = check.places(name, value, 1 if line else 2)
    if len(places) != 1 or np.ndim(value) > 1:
        raise ValueError(f"{name} must be one point, got {check.shown(value)}")
