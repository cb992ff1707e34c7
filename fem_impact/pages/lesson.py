"""Writes one HTML page whose sliders change a blow without a program behind it: every blow is struck beforehand."""

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .._base import check
from ..model.planner import Watch
from ..scenes.scene import Scene
from ..scenes.sentences import RAISED, place, power, si, tidy, words
from ..show import sound
from . import lesson_grid, worksheet
from .explore_model import Setup
from .explore_numbers import PLAYED, SPECTRUM_FACTS, drawn_map
from .explore_view import drawn_body
from .html_page import packed, script_data, write_page
from .lesson_grid import NAMES, STEPS, Lesson

SLIDERS = {"mass": "Mass", "stiffness": "Stiffness", "speed": "Speed", "place": "Place"}
_squeezed = partial(packed, squeezed=True)  # what all blows of a page take


@dataclass(frozen=True, eq=False)
class Written:
    """What a page holds, and what it errs by."""

    n_blows: int
    n_failed: int
    n_missed: int  # blows that miss the tolerance
    n_unlike: int  # blows that the map counts otherwise
    tolerance: float  # [-] of the blows
    force_error: float  # [-] of its peak by which a curve shown misses the force, at worst
    spectrum_error: float  # [-] of the impulse by which a spectrum shown misses that of the force, at most
    questions: int
    bytes: int

    def summary(self) -> str:
        """The same in a sentence or two."""
        return (
            f"{self.n_blows} blows to a tolerance of {self.tolerance:g}, {self.n_missed} of which miss it and "
            f"{self.n_failed} failed; {self.questions} questions; {1e-6 * self.bytes:.2f} MB. Curves shown miss the "
            f"force by at most {self.force_error:.1e} of its peak and the spectrum by at most "
            f"{self.spectrum_error:.1e} of the impulse; the map counts {self.n_unlike} blows otherwise"
        )


@check.typed
def write(
    path: str | Path, scene: Scene, *, watch: Watch | None = None, told: Callable[[int, int], None] | None = None
) -> Written:
    """Write the page of a scene.

    Its sliders stand on a grid of masses, stiffnesses, speeds and places; force, spectrum, map and sound of each blow
    are in the file, which needs no other and no network.

    Parameters
    ----------
    path : str or Path
        The HTML file to write.
    scene : Scene
        With a single blow.
    watch : callable, optional
        Called with the name of each stage; returns a context manager that is active during the stage.
    told : callable, optional
        Called from time to time with the number of blows done and the total.

    Raises
    ------
    ValueError
        If the extra ``web`` is not installed, or the scene has strokes.
    """
    check.extra("jinja2", "web", "a page")
    if scene.stroke:
        raise ValueError("scene must have a single blow: the page changes one; leave its strokes out")
    watch = watch or nullcontext
    with watch("modes"):
        setup = Setup.of(scene)
    with watch("blows"):
        lesson = lesson_grid.strike_grid(setup, told or (lambda done, total: None))
        first = scene.run().response
    asked = worksheet.questions(lesson)
    about = Written(
        n_blows=len(lesson.blows),
        n_failed=int(np.isnan(lesson.quantity("n_impacts")).sum()),
        n_missed=sum(not blow.met for blow in lesson.blows),
        n_unlike=lesson.unlike,
        tolerance=lesson.tolerance,
        force_error=max(blow.missed for blow in lesson.blows),
        spectrum_error=max(blow.spectrum_missed for blow in lesson.blows),
        questions=len(asked),
        bytes=0,
    )
    frequencies = setup.base.modes.frequencies
    size = write_page(
        path,
        "lesson.html",
        styles=("explore.css", "lesson.css"),
        scripts=("plots.js", "lesson.js"),
        title=scene.title or scene.path.stem,
        eyebrow="Move a slider or click: every blow on this page was struck beforehand",
        tiles=[],
        words=words(scene, first),
        verdict=tidy(first.verdict),
        sliders=_sliders(lesson),
        asked=asked,
        about=about,
        ringing=f"{np.count_nonzero(frequencies)} modes up to {si(float(frequencies[-1]), 'Hz', 3)}",
        power=power,
        facts=script_data(_facts(lesson)),
    )
    return replace(about, bytes=size)


def _sliders(lesson: Lesson) -> list[dict[str, Any]]:
    """Each slider, and what it says at each position."""
    law, axes = lesson.setup.start, lesson.axes
    raised = "" if law.exponent == 1.0 else f"{law.exponent:.3g}".translate(RAISED)
    scene = lesson.setup.law(law).stiffness
    said = {
        "mass": [si(float(m), "kg", 3) for m in axes["mass"]],
        "stiffness": [si(float(scene * k), "N/m", 3) + raised for k in axes["stiffness"]],
        "speed": [si(float(v), "m/s", 3) for v in axes["speed"]],
        "place": [place(where) for where in lesson.places],
    }
    at = dict(zip(("place", "speed", "stiffness", "mass"), lesson.start))
    return [{"name": name, "label": SLIDERS[name], "said": said[name], "at": at[name]} for name in SLIDERS
            if len(said[name]) > 1]  # fmt: skip


def _facts(lesson: Lesson) -> dict[str, Any]:
    """Everything the page draws, as data."""
    setup, modes = lesson.setup, lesson.setup.base.modes
    rings, ear = modes.omega > 0.0, np.array([setup.scene.points[0]], float)
    cases = [[setup.case(lesson.settings(0, v, k, m)).resonance for k in range(lesson.shape[2])
              for m in range(lesson.shape[3])] for v in range(lesson.shape[1])]  # fmt: skip
    struck = [modes.shape_at(np.array([where]))[0][rings] for where in lesson.places]
    return {
        "shape": lesson.shape, "start": lesson.start, "axes": lesson.axes, "places": lesson.places, "names": NAMES,
        "tolerance": lesson.tolerance, "steps": STEPS, **SPECTRUM_FACTS, **drawn_body(setup),
        "ear": setup.scene.points[0], "played": PLAYED, "full": sound.FULL_SCALE,
        "limits": [[value if 0.0 < value < np.inf else None for value in row] for row in lesson.limits],
        "resonance": _squeezed(np.array(cases), "<f4"),
        "omega": _squeezed(modes.omega[rings], "<f4"), "zeta": _squeezed(modes.damping_ratio[rings], "<f4"),
        "struck": _squeezed(np.array(struck), "<f4"), "heard": _squeezed(modes.shape_at(ear)[0][rings], "<f4"),
        "numbers": _squeezed(lesson.all_numbers, "<f4"), "met": _squeezed([blow.met for blow in lesson.blows], "u1"),
        "lengths": _squeezed([len(blow.time) for blow in lesson.blows], "<u2"),
        "ends": _squeezed([[blow.end, blow.top] for blow in lesson.blows], "<f4"),
        # differences of times, which deflate better
        "time": _squeezed(np.concatenate([np.diff(blow.time, prepend=0.0) for blow in lesson.blows]), "<u2"),
        "force": _squeezed(np.concatenate([blow.force for blow in lesson.blows]), "<u2"),
        "maps": [drawn_map(picture, _squeezed) for picture in lesson.maps],
    }  # fmt: skip
