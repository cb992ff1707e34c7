"""A scene file that strikes with the hammer and the contact that a fit found."""

from pathlib import Path
from typing import Any

import numpy as np

from .._base import check
from .._base.files import replacing
from ..scenes.scene import Scene
from ..scenes.schema import written
from .found import Found


def tables(found: Found, scene: Scene | None = None) -> tuple[dict[str, Any], list[str]]:
    """The tables of the scene file, and what could not be kept."""
    hammer, law = found.striker, found.contact
    notes = []
    if hammer.modes.n_modes > 1:
        notes.append("the hammer is written as its rigid mass: its modes are left out")
    speed = float(np.mean(found.problem.speeds(found.best.x)))
    strike: dict[str, Any] = {"speed": speed}
    if scene is None:
        if found.problem.setting.target is not None or len(found.problem.setting.structure(found.point).omega):
            raise ValueError("scene must be given: the struck body of these taps is known at its strike point only")
        made: dict[str, Any] = {
            "title": "Hammer and tip found from measured taps, on a wall",
            "mesh": {"shape": "rectangle", "length": 1.0, "width": 0.8},
            # for a wall: it gains two millionths of the hammer's speed, and bends at 200 times the rate of 0.1 ms
            "target": {"mass": 1e6 * hammer.felt_mass, "first_frequency": 1e6},
            "supports": {"boundary": "free"},
        }
        strike |= {"at": [0.5, 0.4], "tolerance": 1e-4}
    else:
        made = scene.data()
        made.pop("map", None)
        strike = dict(made.pop("strike")) | strike
    made["striker"] = {"kind": "rigid", "mass": hammer.felt_mass}
    made["contact"] = law.table
    made["strike"] = strike
    return made, notes


@check.typed
def write_scene(path: str | Path, found: Found, scene: Scene | None = None) -> tuple[str, ...]:
    """Write the scene file; the body struck is that of ``scene`` or, for taps on a wall, a plate as heavy as one.

    Returns what could not be kept. The file says in its first lines which values the data did not tell.
    """
    made, notes = tables(found, scene)
    lines = [f"# {line}" for line in (*found.summary().splitlines(), *notes)]
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n\n" + written(made), encoding="utf-8")
    return tuple(notes)
