"""Lines inside an outline that the sides of triangles must follow, such as those of ribs."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely
from scipy.optimize import brentq

from .._base.rounding import SAME
from .facets import cross_product
from .loops import SAMPLES, Outline, Piece, extent, polyline


class Lines(NamedTuple):
    """Straight lines inside an outline that meet each other and the outline at their ends only."""

    ends: np.ndarray  # (n_lines, 2, 2) [m]
    cuts: dict[int, list[float]]  # id of a piece of the outline -> parameters where lines end on it


def lines_inside(outline: Outline, paths: Sequence[np.ndarray]) -> Lines:
    """The lines of paths (n_points, 2) [m] within an outline; what sticks out or runs along it is left out."""
    span = extent(outline.outer)
    pieces = [piece for loop in outline.loops for piece in loop]
    cuts: dict[int, list[float]] = {id(piece): [] for piece in pieces}
    size = min(span / 500.0, min(extent(loop) for loop in outline.loops) / 8.0)
    body = shapely.Polygon(polyline(outline.outer, size), [polyline(hole, size) for hole in outline.holes])
    shapely.prepare(body)
    segments = [np.array(pair) for path in paths for pair in pairwise(path)]
    found: dict[tuple[float, ...], np.ndarray] = {}
    for i, line in enumerate(segments):
        shares = [0.0, 1.0]
        for piece in pieces:
            for t, share in _meetings(line, piece, SAME * span):
                cuts[id(piece)].append(t)
                shares.append(share)
        shares += [share for j, other in enumerate(segments) if i != j for share in _shares(line, other, SAME * span)]
        places = np.unique(np.clip(shares, 0.0, 1.0))
        length = float(np.linalg.norm(line[1] - line[0]))
        places = places[np.append(True, np.diff(places) * length > SAME * span)]
        for a, b in pairwise(places):
            ends = line[0] + np.array([[a], [b]]) * (line[1] - line[0])
            middle = shapely.Point(ends.mean(axis=0))
            # along the edge, the true curve and its chords between looks differ by less than half a step
            if body.contains(middle) and body.exterior.distance(middle) > 1e-3 * min(size, (b - a) * length):
                key = tuple(np.round(ends[np.lexsort(ends.T)] / span, 9).ravel())
                found.setdefault(key, ends)
    return Lines(np.array(list(found.values())).reshape(-1, 2, 2), cuts)


def _meetings(line: np.ndarray, piece: Piece, close: float) -> list[tuple[float, float]]:
    """Parameters of a piece, and shares of a line (2, 2), where both meet."""
    along = line[1] - line[0]
    length = float(np.linalg.norm(along))
    across = np.array([-along[1], along[0]]) / length
    t = np.linspace(0.0, 1.0, SAMPLES + 1)
    away = (piece.at(t) - line[0]) @ across
    away[np.abs(away) < close] = 0.0
    roots = [t[k] for k in np.flatnonzero(away == 0.0)] if np.count_nonzero(away == 0.0) < 4 else []
    for k in np.flatnonzero(away[:-1] * away[1:] < 0.0):
        height = lambda s: float((piece.at(np.array([s]))[0] - line[0]) @ across)  # noqa: E731
        roots.append(brentq(height, t[k], t[k + 1], xtol=SAME))
    shares = [float((piece.at(np.array([root]))[0] - line[0]) @ along) / length**2 for root in roots]
    return [(float(root), share) for root, share in zip(roots, shares) if -close < share * length < length + close]


def _shares(line: np.ndarray, other: np.ndarray, close: float) -> list[float]:
    """The shares of a line (2, 2) at which another line meets it: both ends of one that runs along it."""
    along, beside = line[1] - line[0], other[1] - other[0]
    turn = cross_product(along, beside)
    sizes = float(np.linalg.norm(along)), float(np.linalg.norm(beside))
    gap = other - line[0]  # of both ends
    away = cross_product(along, gap)
    if abs(turn) < SAME * sizes[0] * sizes[1]:
        shares = gap @ along / sizes[0] ** 2
        return [float(share) for share in shares[np.abs(away) < close * sizes[0]] if 0.0 < share < 1.0]
    mine, its = cross_product(gap[0], beside) / turn, -away[0] / turn
    meets = all(-close < share * size < size + close for share, size in zip((mine, its), sizes))
    return [float(mine)] if meets else []
