"""What a mesh is like before supports are written: its extent, its elements, and the names and places of its edges."""

from dataclasses import dataclass

import numpy as np

from .mesh_files import side_lengths
from .meshes import Mesh

WHOLE = "boundary"  # the name of all edges together


@dataclass(frozen=True)
class Edge:
    """A named edge of a mesh."""

    name: str
    length: float  # [m] along the true curve; 0 for the end of a beam
    n_facets: int
    curved: bool
    middle: tuple[float, ...]  # (dimension,) [m] a point on it, half way
    twins: tuple[str, ...]  # other names of the same facets


def edges(mesh: Mesh) -> list[Edge]:
    """The named edges of a mesh, in its order; `WHOLE` comes last."""
    lengths = mesh.lengths
    names = [*(name for name in mesh.edges if name != WHOLE), WHOLE]
    sets = {name: frozenset(np.asarray(mesh.edges[name]).tolist()) for name in names}
    found = []
    for name in names:
        facets = np.asarray(mesh.edges[name], int)
        along = np.cumsum(lengths[facets])
        half = int(facets[np.searchsorted(along, 0.5 * along[-1])]) if len(facets) else 0
        twins = tuple(other for other in names if other != name and sets[other] == sets[name])
        middle = tuple(map(float, mesh.middles[half]))
        found.append(
            Edge(name, float(lengths[facets].sum()), len(facets), bool(mesh.curved[facets].any()), middle, twins)
        )
    return found


def sides(mesh: Mesh) -> tuple[float, float, float]:
    """Shortest, median and longest side [m] of the elements."""
    along = side_lengths(mesh.points, mesh.cells)
    return float(along.min()), float(np.median(along)), float(along.max())


def rows(mesh: Mesh) -> list[tuple[str, str]]:
    """Extent, area and elements as pairs of name and text, in SI units."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    extent = " x ".join(f"{a:.4g} ... {b:.4g}" for a, b in zip(low, high))
    shortest, middle, longest = sides(mesh)
    plate = mesh.dimension == 2
    return [
        ("extent", f"{extent} m"),
        ("area" if plate else "length", f"{mesh.area:.5g} {'m^2' if plate else 'm'}"),
        ("triangles" if plate else "elements", f"{len(mesh.cells)}"),
        ("points", f"{len(mesh.points)}"),
        ("sides", f"{shortest:.3g} ... {middle:.3g} ... {longest:.3g} m"),
    ]
