"""Ribs along lines of a plate: bars, stiffeners and joists, eccentric as built.

A rib bends, twists and stretches with the plate. At the height of its centroid over the middle of the plate, z, its
strain is that of the plate there, e - z k along the rib, so that it and the plate share the load of a T beam. It is
slender: its section stays plane, its sideways bending is left out, and where ribs cross each goes through.

References
----------
Mukherjee and Mukhopadhyay (1986), Shock Vib. Digest 18(5), 1-9; Timoshenko and Goodier (1951), Theory of elasticity,
art. 109 (torsion of a bar of rectangular section).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from .._base import check
from ..mesh.mesh_files import side_lengths, sides_of
from ..mesh.meshes import Mesh, mesh_along_lines, sizes
from .corners import SMALLEST_FREE, graded_towards
from .section import Beam, Plate, Varying, size_at
from .splitting import distance
from .springs import at_facets
from .theory import Frame, gram

# [-] least height of triangles on ribs, over the extent: up to 2.5e-4 they lost the digits of K, at 2.5e-3 they did not
FINEST = 3e-4
ON = 1e-8  # [-] of the extent: vertices of a mesh nearer to a path lie on it; the mesher leaves 1e-12


@dataclass(frozen=True, eq=False)
class Rib:
    """Rib of a plate for `assemble`.

    Parameters
    ----------
    path : array_like, shape (n_points, 2) [m], or str
        Where it runs, straight from point to point; parts beyond the edge count for nothing. Or the name of an edge
        that it follows.
    section : Beam
        Its height is across the plate. Where it varies, it is a function of the distance along the path.
    offset : float or function of points (n, 2) [m], optional
        Height of its centroid over the middle of the plate, towards the striker. By default it is glued to the other
        side: minus half of both thicknesses.

    Examples
    --------
    >>> spruce = fi.Material(E=11e9, nu=0.3, rho=430.0)
    >>> bar = fi.Rib([(0.1, 0.0), (0.1, 0.3)], fi.Beam.rectangular(spruce, width=8e-3, height=12e-3))
    >>> system = fi.assemble(fi.mesh.rectangle(0.4, 0.3), fi.Plate(spruce, 3e-3), {"boundary": "hinged"}, ribs=[bar])
    >>> fi.find_modes(system, n_modes=2).frequencies.round(2).tolist()
    [170.45, 354.03]
    """

    path: Any
    section: Beam
    offset: Varying | None = None

    def __post_init__(self) -> None:
        check.instance("section", self.section, Beam)
        if not isinstance(self.path, str):
            path = check.array("path", self.path, (None, 2), "m")
            if len(path) < 2 or (np.linalg.norm(np.diff(path, axis=0), axis=1) == 0.0).any():
                raise ValueError("path must have two points or more, and none twice in a row")
            check.settle(self, path=path)
        elif any(callable(value) for value in (self.section.width, self.section.height)):
            raise ValueError("section must not vary along a rib that follows an edge; give the path as points")
        if self.offset is not None and not callable(self.offset):
            check.settle(self, offset=check.number("offset", self.offset, "m"))

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Distance (n, 1) [m] along the path of points (n, 2) [m] on it."""
        if isinstance(self.path, str):
            return np.zeros((len(points), 1))
        pairs = [np.array(pair) for pair in pairwise(self.path)]
        lengths = [float(np.linalg.norm(end - start)) for start, end in pairs]
        away = np.array([[distance(point, start, end) for start, end in pairs] for point in points])
        nearest, before = away.argmin(axis=1), np.concatenate([[0.0], np.cumsum(lengths)])
        start = np.array([pair[0] for pair in pairs])[nearest]
        far = before[nearest] + np.linalg.norm(points - start, axis=1)
        return np.minimum(far, before[-1])[:, None]

    def rigidity(self, points: np.ndarray, thickness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness (n, 3, 3) and mass per length (n,) [kg/m] at points (n, 2) [m] on a plate of ``thickness`` (n,).

        The stiffness is that on the strain of the plate along the rib [N], its curvature along the rib, negative
        [N m^2], and its twist [N m^2].
        """
        place, beam = self.distances(points), self.section
        inertia = beam.inertia(place)
        z: Any = self.offset
        if z is None:
            z = -0.5 * (thickness + size_at(beam, "height", place))
        elif callable(z):
            z = check.field("offset", z, points, "m")
        stretch = beam.material.E * inertia / beam.material.rho
        result = np.zeros((len(points), 3, 3))
        result[:, 0, 0] = stretch
        result[:, 0, 1] = result[:, 1, 0] = stretch * z
        result[:, 1, 1] = beam.stiffness(place) + stretch * z**2
        result[:, 2, 2] = beam.torsion(place)
        return result, inertia

    def turning(self, points: np.ndarray) -> np.ndarray:
        """Rotary inertia per length (n,) [kg m] at points (n, 2) [m]."""
        return self.section.rotary(self.distances(points))


def sides_on(mesh: Mesh, path: Any) -> np.ndarray:
    """Vertices (n, 2) of the sides of triangles that lie on a path (n_points, 2) [m], or on a named edge."""
    if isinstance(path, str):
        if path not in mesh.edges:
            raise ValueError(f"path names edge {path!r}, but the mesh has {', '.join(sorted(mesh.edges)):.300}")
        return mesh.facets[mesh.edges[path]]
    sides = sides_of(mesh.cells)[0]
    on, close = np.zeros(len(sides), bool), ON * float(np.ptp(mesh.points, axis=0).max())
    for start, end in pairwise(path):
        near = distance(mesh.points, start, end) < close
        on |= near[sides].all(axis=1)
    if not on.any():
        raise ValueError("path of a rib must cross the plate; none of it lies on the body")
    return sides[on]


def mesh_along_ribs(mesh: Mesh, section: Any) -> Mesh:
    """The mesh, of whose triangles sides follow the ribs of a plate.

    ValueError if a rib makes triangles so small that the digits of the stiffness are lost.
    """
    paths = [rib.path for rib in getattr(section, "ribs", ()) if not isinstance(rib.path, str)]
    mesh, extent = mesh_along_lines(mesh, paths) if paths else mesh, float(np.ptp(mesh.points, axis=0).max())
    for path in paths:
        cells = mesh.cells[np.isin(mesh.cells, sides_on(mesh, path)).any(axis=1)]
        twice, longest = 2.0 * sizes(mesh.points, cells), side_lengths(mesh.points, cells).max(axis=1)
        least = float((twice / longest).min())  # height of a triangle
        if least < FINEST * extent:
            raise ValueError(
                f"path of a rib must lie on edges, ribs and its own points or {FINEST:g} of the plate's size away from "
                f"them, got {least:.2g} m beside {extent:.3g} m; move its points"
            )
    return mesh


def singular_vertices(
    mesh: Mesh, ribs: Sequence[Rib], kinds: Sequence[Any]
) -> tuple[dict[int, list[int]], dict[int, list[int]], dict[int, float]]:
    """Vertices where ribs end or cross, free ones and held ones, with how many sides each has there, and widths [m].

    Held ones lie on edges that are not free, by the supports ``kinds`` of the facets. A rib along an edge ends at them
    only.
    """
    counts: dict[int, list[int]] = {}
    width: dict[int, float] = {}
    held = set(np.unique(mesh.facets[[kind != "free" for kind in kinds]]).tolist())
    for rib in ribs:
        for vertex, count in zip(*np.unique(sides_on(mesh, rib.path), return_counts=True)):
            if vertex in held or not isinstance(rib.path, str):
                counts.setdefault(int(vertex), []).append(int(count))
                place = rib.distances(mesh.points[[vertex]])
                width[int(vertex)] = float(size_at(rib.section, "width", place)[0])
    free, fixed = ({v: each for v, each in counts.items() if each != [2] and (v in held) == at} for at in (False, True))
    return free, fixed, width


def around_ends(mesh: Mesh, ribs: Sequence[Rib], kinds: Sequence[Any], coarser: float) -> Mesh:
    """The mesh with rings of triangles that shrink to ends and crossings of ribs.

    At a free end a rib acts like a point, which would turn endlessly: triangles shrink to twice its width, at a held
    end to half of it times ``coarser``. Around a crossing three rings leave as much error as between crossings.
    """
    rings, (free, held, width) = {}, singular_vertices(mesh, ribs, kinds)
    narrow = 2.0 * SMALLEST_FREE * float(np.ptp(mesh.points, axis=0).max())
    for vertex, counts in (free | held).items():
        around = mesh.points[mesh.cells[(mesh.cells == vertex).any(axis=1)]]
        longest = float(np.linalg.norm(around - mesh.points[vertex], axis=2).max())
        least = 2.0 * width[vertex] if vertex in free else 0.5 * coarser * max(width[vertex], narrow)
        rings[vertex] = max(0, int(np.ceil(np.log2(longest / least)))) if 1 in counts else 3
    return graded_towards(mesh, {vertex: number for vertex, number in rings.items() if number})


class RibLine(NamedTuple):
    """The sides of triangles on which a rib lies, at Gauss points."""

    rib: Rib
    facets: np.ndarray  # (n, 2) vertices of the sides
    cells: np.ndarray  # (n,)
    area: np.ndarray  # (n, n_q, 3) coordinates in the cells
    x: np.ndarray  # (n, n_q, 2) in the frame
    ds: np.ndarray  # (n, n_q) weights, in the frame
    along: np.ndarray  # (n, n_q, 3) what strains xx, yy and 2 xy are along it
    twist: np.ndarray  # (n, n_q, 3) what curvatures xx, yy and 2 xy are as a twist
    stiffness: np.ndarray  # (n, n_q, 3, 3) as of `Rib.rigidity`
    inertia: np.ndarray  # (n, n_q) [kg/m]

    @classmethod
    def of(cls, rib: Rib, facets: np.ndarray, section: Plate, space: Any, frame: Frame) -> "RibLine":
        """Where a rib of a plate lies: on the sides ``facets`` (n, 2)."""
        cells, area, x, ds, normal = at_facets(space, facets)
        (nx, ny), place = np.moveaxis(normal, 2, 0), frame.to_metres(x)
        along = np.stack([ny**2, nx**2, -nx * ny], axis=-1)  # for the tangent (-ny, nx)
        twist = np.stack([-nx * ny, nx * ny, 0.5 * (nx**2 - ny**2)], axis=-1)
        stiffness, inertia = rib.rigidity(place, size_at(section, "thickness", place))
        shaped = stiffness.reshape(*ds.shape, 3, 3), inertia.reshape(ds.shape)
        return cls(rib, facets, cells, area, x, ds, along, twist, *shaped)


def matrices_of_ribs(
    space: Any, frame: Frame, strained: Callable[..., np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness and mass (n, n_local, n_local) that the ribs of a plate add to cells, and these cells (n,).

    ``strained`` gives strains and negative curvatures (n, n_q, 6, n_local) of cells (n,) at area coordinates and
    places.
    """
    size = np.array([1.0, 1.0 / frame.length, 1.0 / frame.length])
    unit = np.outer(size, size) * frame.length / frame.stiffness
    pairs = []
    for rib in space.ribs:
        parts = strained(space, rib.cells, rib.area, rib.x)
        turns = (rib.along, slice(3)), (rib.along, slice(3, 6)), (rib.twist, slice(3, 6))
        own = np.stack([np.einsum("nqi,nqik->nqk", turn, parts[:, :, half]) for turn, half in turns], axis=2)
        value = space.functions(rib.cells, rib.x, (0,))[0][:, :, None]
        stiff = gram(own, unit * rib.stiffness * rib.ds[..., None, None])
        pairs.append((stiff, gram(value, rib.inertia * rib.ds / (frame.inertia * frame.length))))
    K, M = (np.concatenate(each) for each in zip(*pairs))
    return K, M, np.concatenate([rib.cells for rib in space.ribs])
