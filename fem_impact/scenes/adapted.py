"""A scene to begin with for one's own drawing, and a material and a mallet of the catalogue."""

import json
import os
from pathlib import Path

import numpy as np

from .. import mesh
from .._base import check
from ..impact.catalogue import materials, strikers
from . import templates

DRAWINGS = (".svg", ".dxf")
OUTLINE = """[mesh]                    # the outline of the struck body; `fem-impact mesh {name}` lists its edges
shape = "{shape}"
{key} = {file}
"""
UNIT = "unit = {unit}                # of the numbers in the file\n"
FREE = """[supports]                # edges not named are free: {edges}
# boundary = "hinged"     # all of them; "clamped", "hinged", "free" or springs {{ stiffness, rotation }}
"""
LOST = "# -, half the loss factor of the material: supports and air add to it"


def text(
    kind: str,
    folder: Path,
    *,
    drawing: Path | None = None,
    unit: str | None = None,
    material: str | None = None,
    mallet: str | None = None,
) -> tuple[str, tuple[str, ...]]:
    """The scene of a kind, as of `templates.text`, for a file in ``folder``; and what was assumed of the drawing.

    A drawing, or a mesh file, takes the place of the outline of a plate; material and mallet are names of the
    catalogue, of which the scene takes the numbers.
    """
    whole = templates.text(kind)
    notes: tuple[str, ...] = ()
    if unit is not None and drawing is None:
        raise ValueError("--unit must be left out without --from: the scenes to begin with are in metres")
    if drawing is not None and kind != "plate":
        raise ValueError(f"--from must be left out for a {kind}: a drawing is the outline of a plate")
    if mallet is not None and kind == "map":
        raise ValueError("--mallet must be left out for a map, whose axes are numbers of its own striker")
    if drawing is not None:
        whole, notes = _drawn(whole, drawing, unit, folder)
    if material is not None:
        damped = damping_of(material)
        whole = _with(whole, "[material]", _listed_as("material", material))
        if damped is not None:
            ratio = f"damping_ratio = {damped}"
            line = next(each for each in whole.splitlines() if each.startswith("damping_ratio"))
            whole = whole.replace(line, f"{ratio.ljust(26)}{LOST}")
    if mallet is not None:
        strikers.entry(mallet)
        whole = _with(whole, "[striker]", _listed_as("striker", mallet))
        whole = _with(whole, "[contact]", "# [contact]               # left out: the name of the striker says it\n")
    if (drawing, material, mallet) != (None, None, None):
        title = title_of_body(kind if drawing is None else drawing.stem, material, mallet or "a steel ball")
        whole = whole.replace(whole.splitlines()[0], f"title = {json.dumps(title)}", 1)
    return whole, notes


def damping_of(material: str) -> float | None:
    """Damping ratio [-] of a body of this material: half its loss factor; None if that is not known."""
    facts = materials.entry(material).facts
    return float(f"{0.5 * facts['loss_factor'].value:.2g}") if "loss_factor" in facts else None


def title_of_body(body: str, material: str | None, mallet: str | None) -> str:
    """What a body of a material and what strikes it are called together."""
    struck = f" struck by {mallet}" if mallet else ""
    return f"{body[0].upper()}{body[1:]}{f' of {material}' if material else ''}{struck}"


def _drawn(whole: str, drawing: Path, unit: str | None, folder: Path) -> tuple[str, tuple[str, ...]]:
    """The scene with the outline of a drawing or mesh file, free, struck inside it."""
    flat = drawing.suffix.lower() in DRAWINGS
    body = (mesh.outline if flat else mesh.load)(drawing, unit=unit)
    if body.dimension != 2:
        raise ValueError(f"{drawing} must be the outline of a plate, got a line")
    shape, key = ("outline", "source") if flat else ("file", "path")
    file = json.dumps(Path(os.path.relpath(drawing, folder)).as_posix())
    block = OUTLINE.format(name=drawing.name, shape=shape, key=key, file=file)
    whole = _with(whole, "[mesh]", block + (UNIT.format(unit=json.dumps(unit)) if unit else ""))
    whole = _with(whole, "[supports]", FREE.format(edges=check.line(", ".join(body.edges))))
    low, high = body.points.min(axis=0), body.points.max(axis=0)
    middles = body.points[body.cells].mean(axis=1)
    aside = low + 0.43 * (high - low)  # off the middle, where modes have their nodes
    nearest = middles[np.argmin(np.linalg.norm(middles - aside, axis=1))]
    place = f"[{', '.join(f'{x:.4g}' for x in nearest)}]"
    usual = templates.PLACE
    return whole.replace(usual.ljust(20), place.ljust(20)).replace(usual, place), body.notes


def _listed_as(table: str, name: str) -> str:
    """A table of the scene with a name of the catalogue."""
    line = f"name = {json.dumps(name)}".ljust(26)
    return f"[{table}]\n{line}# `fem-impact catalogue` lists its numbers; other keys here replace them\n"


def _with(whole: str, head: str, block: str) -> str:
    """The scene with the block that begins with a head, up to the next empty line, replaced by another."""
    blocks = whole.split("\n\n")
    i = next(i for i, each in enumerate(blocks) if each.lstrip("\n").startswith(head))
    return "\n\n".join([*blocks[:i], block.rstrip("\n"), *blocks[i + 1 :]])
