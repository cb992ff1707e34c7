"""Divide triangles where a solution needs smaller ones, and keep the boundary on its true curve."""

from dataclasses import replace
from typing import Any

import numpy as np

from .._base.rounding import SAME
from ..mesh.facets import cross_product, divide_facets
from ..mesh.mesh_files import sides_of
from ..mesh.meshes import Mesh

# [-] triangle size under a point load, as a fraction of the body's breadth or of the distance to a held edge. These
# triangles miss 1e-6 of the compliance; rounding grows with the size to the power -2 and is smaller; test_point_load.py
DEPTH = 2.0**-8
GROWTH = 0.7  # [-] longest side of a triangle per distance to the point: 1.0 is ten times worse at curved edges
STEEPEST = 1.0  # [-] largest growth; the error goes as its power eight, and as the square of the size at the point


def towards_points(mesh: Mesh, points: np.ndarray, held: np.ndarray, least: Any = 0.0, coarseness: Any = 1.0) -> Mesh:
    """Make the triangles of a mesh shrink towards points (n_points, 2) [m] anywhere on the body.

    ``held`` (n_facets,) says which facets are supported. A point near them hardly moves, so the triangles around it
    shrink to a fraction of its distance to the edge. Triangles that are too large are divided across their longest
    side, together with their neighbours, so that no angle falls below half of the smallest original angle. None becomes
    smaller than ``least`` [m], a number or one for each point. ``coarseness``, a number or one for each point, is their
    size over that which misses a millionth of the compliance.
    """
    least, coarseness = (np.broadcast_to(each, len(points)) for each in (least, coarseness))
    growth = np.minimum(GROWTH * coarseness**0.25, STEEPEST)
    extent = float(np.ptp(mesh.points, axis=0).max())
    breadth = mesh.area / mesh.perimeter
    while True:  # some thirty times to a millionth of the extent
        start, stop = mesh.points[mesh.facets[held]].transpose(1, 0, 2)
        edge = np.stack([start, mesh.middles[held], stop], axis=1)
        corner = mesh.points[mesh.cells]
        after = np.roll(corner, -1, axis=1)
        side = after - corner
        longest = np.linalg.norm(side, axis=2).max(axis=1)
        tall = np.zeros(len(corner), bool)
        for point, coarse, floor, steep in zip(points, coarseness, least, growth):
            free = float(distance(point, edge[:, :-1], edge[:, 1:]).min(initial=np.inf))
            size = DEPTH * (breadth if free < SAME * extent else min(breadth, free))  # at the point
            off = point - corner
            turn = cross_product(side, off)
            inside = (turn >= 0.0).all(axis=1) | (turn <= 0.0).all(axis=1)
            away = np.where(inside, 0.0, distance(point, corner, after).min(axis=1))
            tall |= longest > np.maximum(max(coarse * size, floor), steep * away)
        if not tall.any():
            return mesh
        mesh, parent = divided_across(mesh, tall)
        held = held[parent]


def distance(point: np.ndarray, start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """Distance [m] of a point (2,) to segments (..., 2)."""
    along = stop - start
    share = ((point - start) * along).sum(axis=-1) / (along**2).sum(axis=-1)
    return np.linalg.norm(point - start - np.clip(share, 0.0, 1.0)[..., None] * along, axis=-1)


def divided_across(mesh: Mesh, tall: np.ndarray) -> tuple[Mesh, np.ndarray]:
    """The mesh with the triangles ``tall`` (n_cells,) divided across their longest sides; each facet's old number."""
    cells, (sides, number, _) = mesh.cells, sides_of(mesh.cells)
    length = np.linalg.norm(np.diff(mesh.points[sides], axis=1)[:, 0], axis=1)[number]  # (n_cells, 3)
    # equal sides are ranked by number, so that neighbours pick the same one
    rank = np.round(length / length.max(axis=1, keepdims=True) / SAME) + number / len(sides)
    longest = number[np.arange(len(cells)), rank.argmax(axis=1)]
    marked = np.zeros(len(sides), bool)
    marked[longest[tall]] = True
    while True:  # if any side of a triangle is divided, so is its longest
        more = longest[marked[number].any(axis=1) & ~marked[longest]]
        if not more.size:
            break
        marked[more] = True
    points, rim, touched = list(mesh.points), Rim(mesh), marked[number].any(axis=1)
    pieces = rim.halve(sides[marked].tolist(), cells[touched].tolist(), points)
    finer = rim.finish(mesh, np.array(points), np.concatenate([cells[~touched], np.array(pieces, cells.dtype)]))
    return finer, np.array(rim.parent)


def bisect_triangle(points: list[np.ndarray], cell: list[int], middle: dict[tuple[int, int], int]) -> list[list[int]]:
    """Divide a triangle at those midpoints of its sides that ``middle`` holds."""
    a, b, c = cell
    found = [middle.get((a, b), -1), middle.get((b, c), -1), middle.get((c, a), -1)]
    count = sum(m >= 0 for m in found)
    if count == 0:
        return [cell]
    while found[0] < 0 or (count == 2 and found[2] < 0):  # rotate until the divided sides come first and last
        a, b, c, found = b, c, a, [*found[1:], found[0]]
    ab, bc, ca = found
    if count == 1:
        return [[a, ab, c], [ab, b, c]]
    if count == 3:
        return [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return [[a, ab, ca], *split_quadrilateral(points, ab, b, c, ca)]


def split_quadrilateral(points: list[np.ndarray], a: int, b: int, c: int, d: int) -> list[list[int]]:
    """Divide the quadrilateral a, b, c, d along its shorter diagonal, or along a-c if both are equal."""
    ac, bd = np.linalg.norm(points[a] - points[c]), np.linalg.norm(points[b] - points[d])
    return [[a, b, d], [b, c, d]] if bd < ac * (1.0 - 1e-6) else [[a, b, c], [a, c, d]]


class Rim:
    """The boundary facets while they are being split."""

    def __init__(self, mesh: Mesh) -> None:
        self.facets: list[list[int]] = mesh.facets.tolist()  # vertices of each
        self.number = {(a, b): i for i, (a, b) in enumerate(self.facets)}  # of the facet between two vertices
        self.middles, self.tangents, self.curvatures = list(mesh.middles), list(mesh.tangents), list(mesh.curvatures)
        self.parent = list(range(len(self.facets)))  # facet of the whole mesh

    def split(self, vertex: int, far: int, new: int, points: list[np.ndarray], ratio: float) -> np.ndarray:
        """Return the point that divides the side from a vertex to ``far``; a boundary facet there becomes two."""
        plain = points[vertex] + ratio * (points[far] - points[vertex])
        forward = (vertex, far) in self.number
        if not forward and (far, vertex) not in self.number:
            return plain
        pair = (vertex, far) if forward else (far, vertex)
        facet = self.number.pop(pair)
        ends = np.array([[points[pair[0]], points[pair[1]]]])
        share = ratio if forward else 1.0 - ratio
        middle, tangent, bend = (np.array([a[facet]]) for a in (self.middles, self.tangents, self.curvatures))
        place, tangent, curvature, *halves = (a[0] for a in divide_facets(ends, middle, tangent, bend, share))
        first, last = self.tangents[facet], self.curvatures[facet]
        self.facets[facet], self.number[pair[0], new] = [pair[0], new], facet
        self.middles[facet] = halves[0]
        self.tangents[facet], self.curvatures[facet] = np.array([first[0], tangent]), np.array([last[0], curvature])
        self.number[new, pair[1]] = len(self.facets)
        self.facets.append([new, pair[1]])
        self.middles.append(halves[1])
        self.tangents.append(np.array([tangent, first[1]]))
        self.curvatures.append(np.array([curvature, last[1]]))
        self.parent.append(self.parent[facet])
        return place

    def halve(self, sides: list, cells: list[list[int]], points: list[np.ndarray]) -> list[list[int]]:
        """Divide cells at the middles of sides (pairs of vertices), which are appended to ``points``."""
        middle = {}
        for a, b in sides:
            middle[a, b] = middle[b, a] = len(points)
            points.append(self.split(a, b, len(points), points, 0.5))
        return [piece for cell in cells for piece in bisect_triangle(points, cell, middle)]

    def finish(self, mesh: Mesh, points: np.ndarray, cells: np.ndarray) -> Mesh:
        parent = np.array(self.parent)
        edges = {name: np.flatnonzero(np.isin(parent, numbers)) for name, numbers in mesh.edges.items()}
        rim: dict[str, Any] = {
            name: np.array(getattr(self, name)) for name in ("facets", "middles", "tangents", "curvatures")
        }
        return replace(mesh, points=points, cells=cells, edges=edges, **rim)
