"""Fill an outline with triangles whose boundary follows it."""

from itertools import pairwise
from typing import Any

import numpy as np

from .._base import check
from .._base.rounding import SAME
from .lines import Lines
from .loops import Outline, Piece, crossing, curvature, divide, extent, is_straight, tangent
from .smooth_edges import join_smoothly

SPREAD = 1.3  # [-] inner sides may be this much longer than the requested size before the mesher divides them
REMEDY = "remove very thin necks or spikes, or pass another size"


def triangulate(outline: Outline, size: float, lines: Lines | None = None) -> dict[str, Any]:
    """Fill an outline with triangles.

    Parameters
    ----------
    outline : Outline
        Must have passed `loops.why_crossed`.
    size : float [m]
        Approximate longest side of a triangle; triangles are smaller where the outline turns quickly.
    lines : Lines, optional
        Sides of triangles follow them.

    Returns
    -------
    dict
        The fields of a `Mesh`: points, cells, facets, edges, middles, tangents, curvatures.
    """
    from netgen.geom2d import SplineGeometry  # imported here because it takes 0.1 s and rectangles do not need it
    from netgen.meshing import NgException

    span = extent(outline.outer)
    centre = outline.outer[0].at(np.zeros(1))[0]
    geometry = SplineGeometry()
    chords: list[tuple[Piece, float, float]] = []
    for loop in outline.loops:
        first, start = len(chords), len(chords)
        for piece in loop:
            t, cuts = divide(piece, size), lines.cuts[id(piece)] if lines else []
            for cut in cuts:  # where lines end; ends of facets nearer than 0.3 of one give way
                inner = t[1:-1]
                if min(cut, 1.0 - cut) > SAME:
                    near = np.abs(inner - cut) < 0.3 * np.diff(t).max()
                    t = np.sort([0.0, *inner[~near | np.isin(inner, cuts)], cut, 1.0])
            chords += [(piece, a, b) for a, b in pairwise(np.unique(t))]
        places = np.array([piece.at(np.array([a]))[0] for piece, a, _ in chords[first:]])
        numbers = [geometry.AppendPoint(*point) for point in (places - centre) / span]
        for i, number in enumerate(numbers):
            line = ["line", number, numbers[(i + 1) % len(numbers)]]
            geometry.Append(line, leftdomain=1, rightdomain=0, bc=start + i + 1)
    if lines is not None and len(lines.ends):
        known = [(piece.at(np.array([a]))[0] - centre) / span for piece, a, _ in chords]  # netgen's points so far
        for line in (lines.ends - centre) / span:
            numbers = []
            for place in line:  # nearer than 1e-8 of the extent to a known point it is that one
                away = np.linalg.norm(np.array(known) - place, axis=1)
                numbers.append(len(known) if away.min() > 1e-8 else int(away.argmin()))
                if numbers[-1] == len(known):
                    geometry.AppendPoint(*place)
                    known.append(place)
            geometry.Append(["line", *numbers], leftdomain=1, rightdomain=1, bc=len(chords) + 1)
    try:
        made = geometry.GenerateMesh(maxh=SPREAD * size / span, grading=0.35, quad_dominated=False)
    except NgException as error:
        raise check.SimulationError(f"the mesher could not fill the outline ({error}); {REMEDY}") from None
    points = np.array([p.p for p in made.Points()])[:, :2] * span + centre
    cells = made.Elements2D().NumPy()["nodes"][:, :3].astype(int) - 1
    sides = [side for side in made.Elements1D() if side.index <= len(chords)]
    facets = np.array([[e.points[0].nr - 1, e.points[1].nr - 1] for e in sides])
    owner = np.array([e.index - 1 for e in sides])
    if not len(cells) or set(owner.tolist()) != set(range(len(chords))):
        raise check.SimulationError(f"the mesher could not fill the outline; {REMEDY}")
    return _follow(points, cells, facets, owner, chords, outline.outer)


def _follow(
    points: np.ndarray, cells: np.ndarray, facets: np.ndarray, owner: np.ndarray, chords: list, outer: tuple
) -> dict:
    """Move the boundary points onto the true curve and take tangents and curvatures from it."""
    middles, tangents, curvatures = (np.zeros((len(facets), *shape)) for shape in ((2,), (2, 2), (2,)))
    place = points.copy()
    edges: dict[str, list[int]] = {}
    pieces = list({id(piece): piece for piece, _, _ in chords}.values())
    rank = {id(piece): k for k, piece in enumerate(pieces)}
    kind = np.array([rank[id(piece)] for piece, _, _ in chords])[owner]
    order = np.argsort(kind, kind="stable")
    for piece, mine in zip(pieces, np.split(order, np.searchsorted(kind[order], np.arange(1, len(pieces))))):
        low, high = np.array([chords[j][1:] for j in owner[mine]]).T
        ends = points[facets[mine]]  # (n, 2, 2)
        a, b = piece.at(low), piece.at(high)
        along = ((ends - a[:, None]) * (b - a)[:, None]).sum(axis=2) / ((b - a) ** 2).sum(axis=1)[:, None]
        t = np.stack([low, high], axis=1)
        for end in (0, 1):
            cut = np.abs(along[:, end] - end) >= 1e-9  # a vertex that the mesher added on the chord
            if cut.any():
                t[cut, end] = crossing(piece, low[cut], high[cut], along[cut, end])
            place[facets[mine, end]] = piece.at(t[:, end])
        middles[mine] = piece.at(crossing(piece, t[:, 0], t[:, 1], np.full(len(mine), 0.5)))
        for end in (0, 1):
            tangents[mine, end] = tangent(piece, t[:, end])
            curvatures[mine, end] = curvature(piece, t[:, end])
        edges.setdefault(piece.name, []).extend(mine.tolist())
    straight = np.array([is_straight(chords[j][0]) for j in owner])  # between their ends, also where a gap was closed
    middles[straight] = place[facets[straight]].mean(axis=1)
    follower = {int(a): i for i, a in enumerate(facets[:, 0])}
    leader = {int(b): i for i, b in enumerate(facets[:, 1])}
    join_smoothly(np.array([[leader[v], follower[v]] for v in follower]), tangents, curvatures)
    named = {name: np.array(sorted(numbers)) for name, numbers in edges.items() if name}
    if "outer" not in named:
        named["outer"] = np.flatnonzero([any(chords[j][0] is piece for piece in outer) for j in owner])
    named["boundary"] = np.arange(len(facets))
    rim = {"facets": facets, "edges": named, "middles": middles, "tangents": tangents, "curvatures": curvatures}
    return {"points": place, "cells": cells, **rim}
