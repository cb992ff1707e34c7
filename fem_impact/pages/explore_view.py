"""Lays out the live page: sliders, the body to click on, the plots that follow, and the sound."""

from typing import Any

import numpy as np

from .._base import check
from .._base.rounding import SAME
from ..mesh.mesh_files import loops_of
from .explore_bench import LARGEST_DRAWING
from .explore_map import NARROWEST
from .explore_model import Setup
from .explore_numbers import SPECTRUM_FACTS
from .html_page import template

SLIDERS = {
    "x": "Strike point x", "y": "Strike point y", "height": "Height of the listener", "rate": "Strokes of a roll",
    "mass": "Mass", "stiffness": "Stiffness", "speed": "Speed", "exponent": "Exponent", "loss": "Loss of the contact",
    "bending": "First bending mode", "damping": "Damping ratio", "thickness": "Thickness / the scene's",
}  # fmt: skip
CARDS = {  # which sliders stand beside which picture
    "body": ("x", "y", "height", "rate"), "map": ("mass", "stiffness"), "force": ("speed", "exponent", "loss"),
    "spectrum": ("bending", "damping", "thickness"),
}  # fmt: skip
LOGARITHMIC = {"mass", "stiffness", "speed", "bending", "thickness"}
STEPS = 400  # [-] per slider: about one per pixel
Ends = dict[str, tuple[float, float, float]]  # slider: lowest, highest and first value
RATES = (2.0, 30.0, 12.0)  # [1/s] strokes of a roll: least, most and at first


def ends(setup: Setup) -> Ends:
    """Lowest, highest and first value of every slider of a setup."""
    found: Ends = {"rate": RATES}
    low, high = setup.mesh.points.min(axis=0), setup.mesh.points.max(axis=0)
    for letter, *three in zip("xy", low, high, setup.start.at):
        found[letter] = (float(three[0]), float(three[1]), float(three[2]))
    if setup.mesh.dimension == 2:
        found["height"] = (0.0, 3.0, 0.0)  # [m] of the listener; at zero the sound is the motion of the surface
    barred = setup.barred
    for name in SLIDERS:
        value = getattr(setup.start, name, None)
        if name not in found and value is not None and name not in barred:
            found[name] = (*setup.range(name), value)
    return found


def page() -> str:
    """The page as HTML, before it gets what it shows."""
    facts = {**SPECTRUM_FACTS, "steps": STEPS, "narrowest": NARROWEST, "largest": LARGEST_DRAWING}
    return str(template("explore.html").render(facts=facts, cards=list(CARDS)))


def laid_out(setup: Setup) -> dict[str, Any]:
    """What the page shows of a setup: its name, the body, the sliders beside each picture, and the axes."""
    known = ends(setup)
    ways = {name: np.log(three) if name in LOGARITHMIC else three for name, three in known.items()}
    cards = {
        card: [
            {
                "name": name, "label": SLIDERS[name], "low": known[name][0], "high": known[name][1],
                "step": round(STEPS * (ways[name][2] - ways[name][0]) / (ways[name][1] - ways[name][0])),
                "logarithmic": name in LOGARITHMIC,
            }
            for name in names if name in known
        ]
        for card, names in CARDS.items()
    }  # fmt: skip
    return {
        "heading": setup.scene.title or setup.scene.path.stem, "cards": cards, "notes": list(setup.mesh.notes),
        **drawn_body(setup), "mass": setup.range("mass"), "stiffness": setup.range("stiffness"),
    }  # fmt: skip


def drawn_body(setup: Setup) -> dict[str, Any]:
    """The outline of a body, as closed loops of points (n, 2) [m], and its ribs, as pages draw them."""
    mesh = setup.mesh
    if mesh.dimension == 1:  # the line between its ends
        loops = [[[float(end), 0.0] for end in (mesh.points.min(), mesh.points.max())]]
    else:
        loops = [np.round(mesh.points[loop], 9).tolist() for loop in loops_of(mesh.facets)]
    return {"loops": loops, "ribs": [mesh.pieces(rib.path).tolist() for rib in setup.scene.ribs]}


def check_sliders(known: Ends, turned: Any) -> dict[str, float]:
    """What a page says of its sliders: finite numbers within their ends; ValueError if it is anything else.

    A click may lie beyond the ends of x and y: then it is beside the body, and no other point is meant.
    """
    if not isinstance(turned, dict) or not set(turned) <= set(known):
        raise ValueError(f"sliders must be some of {', '.join(known)}")
    found = {}
    for name, value in turned.items():
        low, high, _ = known[name]
        number = check.number(name, value)
        held = min(max(number, low), high)
        found[name] = number if name in ("x", "y") and abs(held - number) > SAME * (high - low) else held
    return found


def pair(name: str, values: Any) -> tuple[float, float]:
    """Two finite numbers; ValueError if they are anything else."""
    if not isinstance(values, list) or len(values) != 2:
        raise ValueError(f"{name} must be two numbers")
    first, second = (check.number(name, value) for value in values)
    return first, second
