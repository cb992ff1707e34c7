"""The mesh of a plate or beam: its elements, its named edges on the exact curve and how to refine it."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from .._base import check, markup
from . import drawings, lines, mesh_files, sketch, smooth_edges
from .facets import Curves, angles, cross_product, divide_facets, is_curved
from .loops import TURN, Bezier, Outline, circle, extent, polyline, segment, signed_area, straight_loop, why_crossed
from .rise import table
from .triangulation import triangulate

MOST_CELLS = 200_000  # [-] most triangles allowed: several times what `find_modes` can solve
SMALLEST_HOLE = 1e-6  # [-] smallest hole radius over disk radius: a smaller hole is lost in rounding
LONGEST = 1.5  # [-] longest side of a triangle over the requested size: 1.4 to 1.6 on rectangles, disks and a guitar
# [-] default elements across a rectangle or any other outline: a first mesh only, which `find_modes` refines
DEFAULT_DIVISIONS = 8


@dataclass(frozen=True, eq=False, repr=False)
class Mesh(check.Locked):
    """Triangles in the plane or elements on a line, with named edges.

    Boundary facets run with the body on their left; normals point outward. Each facet is a curve through its ends and
    middle with the given end tangents and curvatures; its distance from the true curve falls as length**6.
    """

    points: np.ndarray  # (n_points, dimension) [m]
    cells: np.ndarray  # (n_cells, dimension + 1) vertex numbers
    facets: np.ndarray  # (n_facets, dimension) vertex numbers of the boundary facets
    edges: dict[str, np.ndarray]  # name -> facet numbers; "boundary" is all of them
    middles: np.ndarray  # (n_facets, dimension) [m] middle of each facet on the true curve
    tangents: np.ndarray  # (n_facets, 2, 2) unit tangent at both ends of each facet; zero on a line
    curvatures: np.ndarray  # (n_facets, 2) [1/m] at both ends, positive where convex
    recipe: Callable[..., "Mesh"] | None = field(default=None, repr=False)  # recipe(size=...) meshes the same body anew
    size: float = 0.0  # [m] requested element size
    size_stated: bool = True  # True if the user chose the size; otherwise find_modes may change it
    notes: tuple[str, ...] = ()  # what was repaired or assumed
    # ("rectangle", length, width), ("disk", radius) or ("line", length) [m]; empty for any other body
    form: tuple[Any, ...] = ()
    # height [m] of the unloaded surface at points (n, 2), as for `assemble`; of a mesh file with three coordinates
    rise: Callable[[np.ndarray], Any] | None = field(default=None, repr=False)
    lines: dict[str, np.ndarray] = field(default_factory=dict, repr=False)  # name -> (n, 2) [m], of a drawing; for ribs

    @property
    def dimension(self) -> int:
        """2 for a plate, 1 for a beam."""
        return self.points.shape[1]

    @property
    def curved(self) -> np.ndarray:
        """Which facets are curved, (n_facets,) bool."""
        if self.dimension == 1:
            return np.zeros(len(self.facets), bool)
        return is_curved(self.points[self.facets], self.middles)

    @property
    def chords(self) -> np.ndarray:
        """Distances (n_facets,) [m] between the ends of the facets; zero on a line."""
        ends = self.points[self.facets]
        return np.linalg.norm(ends[:, -1] - ends[:, 0], axis=1)

    @property
    def lengths(self) -> np.ndarray:
        """Lengths (n_facets,) [m] of the facets along curved edges; zero on a line."""
        # the chord errs by length cubed, the two chords through the middle by a quarter of that: the difference cancels
        halves = np.linalg.norm(self.points[self.facets] - self.middles[:, None], axis=2).sum(axis=1)
        return (4.0 * halves - self.chords) / 3.0

    @property
    def perimeter(self) -> float:
        """Length of the boundary [m]."""
        return float(self.lengths.sum())

    @property
    def area(self) -> float:
        """Area [m^2] of a plate, within curved edges to 1e-4 at worst; length [m] of a beam."""
        inside = float(sizes(self.points, self.cells).sum())
        if self.dimension == 1:
            return inside
        a, b = self.points[self.facets].swapaxes(0, 1)  # a parabola through the middle lies beside each chord
        return inside + 2.0 / 3.0 * float(cross_product(self.middles - 0.5 * (a + b), b - a).sum())

    def pieces(self, path: Any) -> np.ndarray:
        """Straight pieces (n, 2, 2) [m] of a path (n_points, 2) [m] or, given a name, of that edge."""
        if isinstance(path, str):
            return self.points[self.facets[self.edges[path]]]
        return np.stack([path[:-1], path[1:]], axis=1)

    def _repr_html_(self) -> str:
        """Notebook view: the outline and a table of its size and edges."""
        kind = "triangles" if self.dimension == 2 else "elements"
        edges = ", ".join(name for name in self.edges if name != "boundary")
        extent = " x ".join(f"{size:.4g} m" for size in np.ptp(self.points, axis=0))
        rows = [("extent", extent), ("points", len(self.points)), (kind, len(self.cells)), ("edges", edges)]
        return markup.side_by_side(sketch.draw_body(self, title=f"Outline of a body of {extent}"), markup.table(rows))

    def refined(self, factor: float = 2.0) -> "Mesh":
        """The same body with elements smaller by ``factor``, fitted to the exact outline if it is known."""
        if self.recipe is None:
            raise ValueError(
                "this mesh has no outline and cannot be refined; make it with fi.mesh, or load a finer file"
            )
        size = self.size / check.positive("factor", factor)
        finer = self.recipe(size=float(f"{size:.11g}"))  # the mesher would amplify the rounding of an error estimate
        return replace(finer, notes=self.notes, rise=self.rise, lines=self.lines)

    def line(self, path: Any) -> Any:
        """A path as it is, or the points (n, 2) [m] of the line of that name, if there is one."""
        return self.lines.get(path, path) if isinstance(path, str) else path


def straight(
    points: np.ndarray, cells: np.ndarray, facets: np.ndarray, edges: dict[str, np.ndarray], **rest: Any
) -> Mesh:
    """A plane mesh with straight edges only."""
    ends = points[facets]
    along = ends[:, 1] - ends[:, 0]
    unit = along / np.linalg.norm(along, axis=1, keepdims=True)
    tangents, curvatures = np.stack([unit, unit], axis=1), np.zeros((len(facets), 2))
    return Mesh(points, cells, facets, edges, ends.mean(axis=1), tangents, curvatures, **rest)


def _element_size(size: float | None, default: float) -> tuple[float, bool]:
    return (default, False) if size is None else (check.positive("size", size, "m"), True)


def _check_affordable(cells: float, size: float, most: int) -> None:
    if cells > most:
        raise ValueError(f"size must be larger: {size:g} m gives about {cells:.1g} elements, more than {most}")


def rectangle(length: float, width: float, *, size: float | None = None) -> Mesh:
    """Rectangle [0, length] x [0, width] [m]; edges left, right (x = 0, length), bottom, top (y = 0, width).

    Without ``size``, `find_modes` chooses one fine enough for the requested modes.

    Examples
    --------
    >>> mesh = fi.mesh.rectangle(0.465, 0.3)
    >>> round(mesh.area, 6), sorted(mesh.edges)
    (0.1395, ['bottom', 'boundary', 'left', 'right', 'top'])
    """
    length = check.positive("length", length, "m")
    width = check.positive("width", width, "m")
    short, long = sorted((length, width))
    # at most 64 along it, however slender: the default mesh then has 1 200 triangles at most
    size, stated = _element_size(size, max(short / DEFAULT_DIVISIONS, long / 64.0))
    _check_affordable(2.0 * (length / size + 1.0) * (width / size + 1.0), size, MOST_CELLS)
    least = 1 if stated else 2
    nx, ny = max(least, round(length / size)), max(least, round(width / size))
    x, y = np.meshgrid(np.linspace(0.0, length, nx + 1), np.linspace(0.0, width, ny + 1), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel()])
    number = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    odd = (np.add.outer(np.arange(nx), np.arange(ny)) % 2).astype(bool)[..., None]
    # alternating diagonals give the mesh the symmetries of the plate
    first = np.where(odd, np.stack([a, b, d], axis=-1), np.stack([a, b, c], axis=-1))
    second = np.where(odd, np.stack([b, c, d], axis=-1), np.stack([a, c, d], axis=-1))
    cells = np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])
    sides = {"left": number[0, ::-1], "right": number[-1, :], "bottom": number[:, 0], "top": number[::-1, -1]}
    facets, edges, start = [], {}, 0
    for name, line in sides.items():
        facets.append(np.column_stack([line[:-1], line[1:]]))
        edges[name] = np.arange(start, start + len(line) - 1)
        start += len(line) - 1
    edges["boundary"] = np.arange(start)
    rest = {"recipe": partial(rectangle, length, width), "size": size, "size_stated": stated}
    return straight(points, cells, np.concatenate(facets), edges, form=("rectangle", length, width), **rest)


def line(length: float, *, size: float | None = None) -> Mesh:
    """Line [0, length] [m] for a beam; edges left (x = 0) and right (x = length).

    Examples
    --------
    >>> fi.mesh.line(0.4, size=0.1).points.ravel().round(3).tolist()
    [0.0, 0.1, 0.2, 0.3, 0.4]
    """
    length = check.positive("length", length, "m")
    size, stated = _element_size(size, length / 4.0)  # few elements do, because their degree is high
    _check_affordable(length / size, size, 5000)
    n = max(1, round(length / size))
    cells = np.column_stack([np.arange(n), np.arange(1, n + 1)])
    edges = {"left": np.array([0]), "right": np.array([1]), "boundary": np.array([0, 1])}
    points, ends, rim = np.linspace(0.0, length, n + 1)[:, None], np.array([[0.0], [length]]), np.zeros((2, 2))
    rest: dict[str, Any] = {"recipe": partial(line, length), "size": size, "size_stated": stated}
    rest["form"] = ("line", length)
    return Mesh(points, cells, np.array([[0], [n]]), edges, ends, np.zeros((2, 2, 2)), rim, **rest)


def fill(outline: Outline, *, size: float | None = None) -> Mesh:
    """Mesh any outline; without ``size``, `find_modes` chooses one."""
    problem = why_crossed(outline)
    if problem:
        raise ValueError(problem)
    size, stated = _element_size(size, extent(outline.outer) / DEFAULT_DIVISIONS)
    around = polyline(outline.outer, extent(outline.outer) / 50.0)
    _check_affordable(2.0 * abs(signed_area(around)) / size / size, size, MOST_CELLS)
    arrays = triangulate(outline, size)
    return Mesh(**arrays, recipe=partial(fill, outline), size=size, size_stated=stated)


def disk(radius: float, hole: float = 0.0, *, size: float | None = None) -> Mesh:
    """Disk or annulus around the origin with radii ``radius`` and ``hole`` [m]; edges outer, inner, boundary (both).

    Examples
    --------
    >>> ring = fi.mesh.disk(0.15, hole=0.05, size=0.05)
    >>> sorted(ring.edges), round(float(ring.curvatures[ring.edges["inner"]].mean()), 6)  # 1/m, concave
    (['boundary', 'inner', 'outer'], -20.0)
    """
    radius = check.positive("radius", radius, "m")
    hole = check.non_negative("hole", hole, "m")
    if hole >= radius:
        raise ValueError(f"hole must be smaller than radius = {radius:g} m, got {hole:g} m")
    if 0.0 < hole < SMALLEST_HOLE * radius:
        raise ValueError(f"hole must be zero or at least {SMALLEST_HOLE:g} of radius = {radius:g} m, got {hole:g} m")
    inner = (circle((0.0, 0.0), hole, "inner"),) if hole else ()
    made = fill(Outline.around(circle((0.0, 0.0), radius, "outer"), inner), size=size)
    return made if hole else replace(made, recipe=partial(disk, radius), form=("disk", radius))


def polygon(corners: Any, holes: Sequence[Any] = (), *, size: float | None = None) -> Mesh:
    """Polygon with holes.

    Parameters
    ----------
    corners : array_like, shape (n, 2) [m]
        In order, clockwise or anticlockwise.
    holes : sequence of array_like, shape (n, 2) [m]
        Corners of each hole.
    size : float [m], optional
        Element size; by default `find_modes` chooses one fine enough for the requested modes.

    Returns
    -------
    Mesh
        Edge "edge0" runs from the first corner to the second, and so on; "hole0" is the rim of the first hole, "outer"
        the whole outer rim, "boundary" both.

    Examples
    --------
    >>> plate = fi.mesh.polygon([(0, 0), (0.4, 0), (0.1, 0.3)], size=0.1)
    >>> round(plate.area, 6), sorted(plate.edges)
    (0.06, ['boundary', 'edge0', 'edge1', 'edge2', 'outer'])
    """
    outer = straight_loop("corners", corners, "edge{}")
    if not isinstance(holes, (list, tuple, np.ndarray)):
        raise ValueError(f"holes must be a list with the corners of each hole, got {check.shown(holes)}")
    inner = [straight_loop(f"holes[{i}]", hole, f"hole{i}") for i, hole in enumerate(holes)]
    loops = [np.concatenate([side.at(np.zeros(1)) for side in loop]) for loop in (outer, *inner)]
    gentle = max(map(smooth_edges.n_gentle_corners, loops))
    made = fill(Outline.around(outer, tuple(inner)), size=size)
    if gentle < 2.0 * np.pi / TURN:  # a circle takes more facets
        return made
    note = (
        f"{gentle} corners turn as gently as points of a curve; if they are, fi.mesh.outline joins them by a smooth "
        "curve: hinged sides have other frequencies, however short they are"
    )
    return replace(made, notes=(note,))


def outline(source: Any, *, size: float | None = None, unit: str | None = None) -> Mesh:
    """Plate from a drawing; its curves stay curves.

    Parameters
    ----------
    source : str, Path, shapely Polygon or array_like (n, 2) [m]
        An .svg or .dxf file (needs ``pip install 'fem-impact[cad]'``), or geometry. The largest closed loop is the
        outline, loops inside it are holes. Points along gentle bends are joined by smooth curves, in drawings from 65
        in a row on; points that scatter, as traced ones do, lie beside these curves. Corners stay.
    size : float [m], optional
        Element size; by default `find_modes` chooses one fine enough for the requested modes.
    unit : str, optional
        Unit of the numbers in the source: "m", "cm", "mm", "um", "in" or "km". By default SVG uses the unit of its
        width, or px of 1/96 inch; DXF uses $INSUNITS.

    Returns
    -------
    Mesh
        Edges take their name from the id of an SVG shape or the layer of a DXF entity. Otherwise they are called
        "edge0", "edge1" ... from corner to corner, and "hole0" ... for holes. Open paths with a name are `Mesh.lines`
        by that name, for ribs. `Mesh.notes` says what was assumed.

    Raises
    ------
    ValueError
        If the outline is open, crosses itself, or looks like millimetres read as metres.

    Examples
    --------
    >>> angle = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    >>> egg = fi.mesh.outline(np.column_stack([0.2 * np.cos(angle), 0.15 * np.sin(angle)]))  # or "guitar.svg"
    >>> sorted(egg.edges), bool(egg.curved.all())
    (['boundary', 'edge0', 'outer'], True)
    """
    curve, lines, notes = drawings.read_outline(source, unit)
    return replace(fill(curve, size=size), notes=tuple(notes), lines=lines)


def load(path: Any, *, unit: str | None = None) -> Mesh:
    """Plate from a mesh file: Gmsh .msh, .vtu, .vtk and any other format that meshio reads.

    Parameters
    ----------
    path : str or Path
    unit : str, optional
        Unit of the numbers in the file: "m" (default), "cm", "mm", "um", "in" or "km".

    Returns
    -------
    Mesh
        Physical groups of lines, cell sets, sets of nodes and numbered line cells become named edges ("edge7" for
        number 7 without a name); "outer", "hole0" ... are the loops of the rim and "boundary" is all of it. A rim with
        only small turns at its vertices becomes a smooth curve. A curved surface is projected on its mean plane, with
        its heights over it as `Mesh.rise`. `Mesh.notes` says what was repaired or assumed.

        If the modes need another element size, `find_modes` splits each triangle in four or meshes the inside of the
        rim anew, whichever takes fewer triangles. If the thickness varies, it only splits: the triangles of the file
        may follow steps of the thickness.

    Raises
    ------
    ValueError
        If the file cannot be read, is not one connected set of triangles, slopes by 45 degrees or more, or looks like
        millimetres.

    Examples
    --------
    >>> fi.mesh.save("plate.msh", fi.mesh.rectangle(0.4, 0.3, size=0.1))
    >>> round(fi.mesh.load("plate.msh").area, 6)  # m^2
    0.12
    """
    points, cells, given, pairs, notes, heights, off = mesh_files.read_mesh(path, unit)
    rim = mesh_files.boundary(cells)
    follower = {int(a): int(b) for a, b in rim}
    loops = [np.array([(a, follower[a]) for a in loop]) for loop in mesh_files.loops_of(rim)]
    loops.sort(key=lambda loop: -float(np.ptp(points[loop[:, 0]], axis=0).max()))
    facets = np.concatenate(loops)
    number = {(min(a, b), max(a, b)): i for i, (a, b) in enumerate(facets.tolist())}
    known = {number[pair]: at for pair, at in given.items() if pair in number}
    points, middles, tangents, curvatures = smooth_edges.recover_rim(points, loops, known, off)
    n_curved = np.count_nonzero(is_curved(points[facets], middles))
    if n_curved and not given:
        notes.append(f"{n_curved} sides of the rim were replaced by smooth curves through their ends")
    edges = {name: np.array(sorted(number[p] for p in found if p in number), int) for name, found in pairs.items()}
    edges = {name: found for name, found in edges.items() if len(found)}
    inside = sorted(set(pairs) - set(edges))
    if inside:
        notes.append(f"{', '.join(inside)}: not on the rim, so it cannot be supported")
    sides = {(a, b) for a, b in mesh_files.sides_of(cells)[0].tolist()}
    for name in sorted(edges):
        lost = len(pairs[name] - sides)
        if lost:
            notes.append(f"{name}: {lost} of its {len(pairs[name])} lines are no sides of triangles and are left out")
    start = 0
    for i, loop in enumerate(loops):
        edges.setdefault("outer" if i == 0 else f"hole{i - 1}", np.arange(start, start + len(loop)))
        start += len(loop)
    edges["boundary"] = np.arange(len(facets))
    rise = None
    if heights is not None:
        away, nearest = cKDTree(points).query(heights[0])  # what lies on a point of the mesh stays there
        rise = table(np.where((away <= off)[:, None], points[nearest], heights[0]), heights[1])
    made = Mesh(
        points, cells, facets, edges, middles, tangents, curvatures,
        size=float(mesh_files.side_lengths(points, cells).max()) / LONGEST, size_stated=False,
        notes=tuple(f"{Path(path).name}: {note}" for note in notes),
        rise=rise,
    )  # fmt: skip
    return replace(made, recipe=partial(_resize_mesh, made))


def sizes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Areas [m^2] of triangles or lengths [m] of line elements, (n_cells,), from points (n_points, dimension)."""
    corner = points[cells]
    return np.abs(np.linalg.det(corner[:, 1:] - corner[:, :1])) / points.shape[1]


@check.typed
def aligned(mesh: Mesh) -> Mesh:
    """The mesh, set to be refined only by splitting: the triangles of a file may follow steps of the thickness."""
    recipe = mesh.recipe
    refilled = isinstance(recipe, partial) and recipe.func is _resize_mesh
    return replace(mesh, recipe=partial(_divide_mesh, mesh)) if refilled else mesh


@check.typed
def save(path: Any, mesh: Mesh) -> None:
    """Write the mesh of a plate and its named edges to a Gmsh file (.msh), readable by `load` and other programs.

    Examples
    --------
    >>> fi.mesh.save("disk.msh", fi.mesh.disk(0.1, size=0.05))
    >>> sorted(fi.mesh.load("disk.msh").edges)
    ['boundary', 'outer']
    """
    if not isinstance(mesh, Mesh) or mesh.dimension != 2:
        raise ValueError("mesh must be the mesh of a plate, got a beam; make a beam with fi.mesh.line")
    mesh_files.write_mesh(path, mesh)


def mesh_with_holes(mesh: Mesh, holes: Sequence[tuple[np.ndarray, float]], *, size: float | None = None) -> Mesh:
    """The mesh of a plate with round holes, each a centre (2,) [m] and a radius [m]; their edges are "clamp0" ...

    Edges keep their names and curves; a mesh from a file keeps its own vertices on curved edges only.
    """
    extent = float(np.ptp(mesh.points, axis=0).max())
    least = SMALLEST_HOLE * extent
    for _, radius in holes:
        if radius > extent:
            raise ValueError(f"radius of point_supports must be smaller than the body, {extent:g} m, got {radius:g} m")
        if radius < least:
            raise ValueError(
                f"radius of point_supports must be at least {SMALLEST_HOLE:g} of the body, {least:g} m, got "
                f"{radius:g} m"
            )
    inner = tuple(circle(centre, radius, f"clamp{i}") for i, (centre, radius) in enumerate(holes))
    around = _outline(mesh) or _facets_outline(mesh)
    whole = Outline.around(around.outer, (*around.holes, *inner))
    problem = why_crossed(whole)
    if problem:
        raise ValueError(f"point_supports must leave room for each clamp, inside the body and apart: {problem}")
    return _fill_outline(mesh, whole, size, recipe=partial(mesh_with_holes, mesh, holes))


def mesh_along_lines(mesh: Mesh, paths: Sequence[np.ndarray], *, size: float | None = None) -> Mesh:
    """The mesh of a plate in which sides of triangles follow paths (n_points, 2) [m], straight between their points.

    Edges keep their names and curves; a mesh from a file keeps its own vertices on curved edges only.
    """
    before = mesh.recipe.args[1] if isinstance(mesh.recipe, partial) and mesh.recipe.func is mesh_along_lines else ()
    if size is None and all(any(np.array_equal(path, other) for other in before) for path in paths):
        return mesh  # it follows them already
    around = _outline(mesh) or _facets_outline(mesh)
    return _fill_outline(
        mesh, around, size, lines.lines_inside(around, paths), recipe=partial(mesh_along_lines, mesh, paths)
    )


def _fill_outline(
    mesh: Mesh, whole: Outline, size: float | None, within: lines.Lines | None = None, *, recipe: Callable[..., Mesh]
) -> Mesh:
    """A new mesh of an outline made of that of another mesh, whose edges keep their names."""
    size, stated = (mesh.size, mesh.size_stated) if size is None else (size, True)
    _check_affordable(2.0 * mesh.area / size / size, size, MOST_CELLS)
    arrays = triangulate(whole, size, within)
    parts = arrays["edges"]
    if _outline(mesh) is None:
        rim = {
            name: np.concatenate([parts[str(i)] for i in numbers if str(i) in parts])
            for name, numbers in mesh.edges.items()
        }
        added = {name: numbers for name, numbers in parts.items() if not name.isdigit() and name not in rim}
        arrays["edges"] = added | rim
    arrays["edges"]["boundary"] = np.arange(len(arrays["facets"]))
    kept: dict[str, Any] = {"notes": mesh.notes, "rise": mesh.rise, "lines": mesh.lines}
    return Mesh(**arrays, recipe=recipe, size=size, size_stated=stated, **kept)


def _outline(mesh: Mesh) -> Outline | None:
    """The outline that a mesh was made from; None if it comes from a file."""
    recipe = mesh.recipe
    if mesh.form[:1] == ("rectangle",):
        length, width = mesh.form[1:]
        corners = [(0.0, 0.0), (length, 0.0), (length, width), (0.0, width)]
        names = "bottom", "right", "top", "left"
        after = [*corners[1:], corners[0]]
        return Outline.around(tuple(segment(a, b, name) for a, b, name in zip(corners, after, names)))
    if mesh.form[:1] == ("disk",):
        return Outline.around(circle((0.0, 0.0), mesh.form[1], "outer"))
    return recipe.args[0] if isinstance(recipe, partial) and recipe.func is fill else None


def _facets_outline(mesh: Mesh) -> Outline:
    """The rim of a mesh: curved facets, and straight lines of them with the same names, each called by a number."""
    ends, curved = mesh.points[mesh.facets], mesh.curved
    control = Curves(ends, mesh.middles, mesh.tangents, mesh.curvatures).controls()
    named = np.array([np.isin(np.arange(len(ends)), facets) for facets in mesh.edges.values()])
    number, along = {int(facet[0]): i for i, facet in enumerate(mesh.facets)}, ends[:, 1] - ends[:, 0]
    loops = []
    for vertices in mesh_files.loops_of(mesh.facets):
        loop = np.array([number[vertex] for vertex in vertices])
        before = np.roll(loop, 1)
        straight = ~curved[loop] & (np.abs(angles(along[before], along[loop])) <= smooth_edges.STRAIGHT)
        starts = np.flatnonzero(~straight | curved[before] | (named[:, loop] != named[:, before]).any(axis=0))
        pieces = [
            Bezier(control[i], str(i)) if curved[i] else segment(ends[i, 0], ends[last, 1], str(i))
            for i, last in zip(loop[starts], loop[np.roll(starts, -1) - 1])
        ]
        loops.append(tuple(pieces))
    return Outline(loops[0], tuple(loops[1:]))


def _resize_mesh(mesh: Mesh, *, size: float) -> Mesh:
    """A mesh from a file with triangles of about ``size`` [m]: split in four, or new ones inside the same rim."""
    ratio, recipe = mesh.size / size, partial(_resize_mesh, mesh)
    # split, unless triangles end up smaller by 1.45 than asked for, which are twice as many
    if ratio >= 1.0 - 1e-9 and 2.0 ** np.ceil(np.log2(ratio) - 1e-9) < 1.45 * ratio:
        return replace(_divide_mesh(mesh, size=size), recipe=recipe)
    around = _facets_outline(mesh)
    if not why_crossed(around):
        with suppress(check.SimulationError):  # of the mesher; splitting only costs more
            return _fill_outline(mesh, around, size, recipe=recipe)
    return _divide_mesh(mesh, size=size)


def _divide_mesh(mesh: Mesh, *, size: float) -> Mesh:
    """The mesh with its triangles split in four until their size is at most ``size`` [m]."""
    _check_affordable(len(mesh.cells) * (mesh.size / size) ** 2, size, MOST_CELLS)
    recipe = partial(_divide_mesh, mesh)
    for _ in range(max(0, int(np.ceil(np.log2(mesh.size / size) - 1e-9)))):
        n = len(mesh.points)
        cells, unique = mesh_files.quarter_triangles(mesh.cells, n)
        points = np.concatenate([mesh.points, mesh.points[unique].mean(axis=1)])
        middle = n + mesh_files.numbers_of(unique, mesh.facets)
        known = mesh.points[mesh.facets], mesh.middles, mesh.tangents, mesh.curvatures
        points[middle], tangent, bend, first, second = divide_facets(*known, 0.5)  # on the curve of their facet
        both = np.arange(2 * len(mesh.facets)).reshape(-1, 2)
        halves: dict[str, tuple[np.ndarray, ...]] = {  # of each facet
            "facets": (mesh.facets[:, 0], middle, middle, mesh.facets[:, 1]), "middles": (first, second),
            "tangents": (mesh.tangents[:, 0], tangent, tangent, mesh.tangents[:, 1]),
            "curvatures": (mesh.curvatures[:, 0], bend, bend, mesh.curvatures[:, 1]),
        }  # fmt: skip
        rim: dict[str, Any] = {
            name: np.stack(parts, axis=1).reshape(-1, *getattr(mesh, name).shape[1:]) for name, parts in halves.items()
        }
        edges = {name: both[numbers].ravel() for name, numbers in mesh.edges.items()}
        mesh = replace(mesh, points=points, cells=cells, edges=edges, size=0.5 * mesh.size, **rim)
    return replace(mesh, size_stated=True, recipe=recipe)
