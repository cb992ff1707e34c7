"""Read triangles and named edges from a file; repair what is safe to repair, refuse the rest with a reason."""

import re
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from .._base import check
from .._base.rounding import SAME, rounded_by
from . import meshio_reader
from .facets import cross_product
from .loops import FARTHEST, UNITS, refuse_millimetres

PLANE = {"triangle": 3, "triangle6": 6, "triangle7": 7, "quad": 4, "quad8": 8, "quad9": 9}  # nodes of cells read here
FLAT = 1e-5  # [-] of its extent, across the plane of a mesh: less is noise, as of coordinates with six digits
# [-] of a side, along and across it, within which its middle lies: from a quarter along it the curve turns back, and
# on a third of a circle it is 0.29 off
ALONG, ACROSS = 0.26, 0.3
NODES = PLANE | {"line": 2, "line3": 3}


def read_mesh(path: Any, unit: str | None) -> tuple[
    np.ndarray, np.ndarray, dict[tuple[int, int], np.ndarray], dict[str, set[tuple[int, int]]], list[str],
    tuple[np.ndarray, np.ndarray] | None, float,
]:  # fmt: skip
    """Read and repair a mesh file.

    Returns
    -------
    points : ndarray, shape (n_points, 2) [m]
    cells : ndarray, shape (n_cells, 3)
    middles : dict, sorted pair of vertices -> middle of their side (2,) [m]; empty if all sides are straight
    names : dict, edge name -> set of sorted pairs of vertices
    notes : list of str, what was repaired
    heights : None if it is flat, else all its points (n, 2) [m] in its mean plane, and their heights (n,) [m] over it
    off : float [m], how far nodes may lie beside where they are meant by the digits that the file writes
    """
    path = check.path("path", path)
    data = meshio_reader.read_raw(path)
    cells, nodes = _triangles(path, data)
    raw, height, off, notes = _plane_points(path, data, unit)
    rows = np.array([[*pair, node] for pair, node in nodes.items()], int).reshape(-1, 3)
    a, b, middle = raw[rows].transpose(1, 0, 2)
    side, away = b - a, middle - 0.5 * (a + b)
    along = np.abs((away * side).sum(axis=1))
    across = np.abs(cross_product(away, side))
    far = np.maximum(along / ALONG, across / ACROSS) > (side**2).sum(axis=1)
    if far.any():
        first, second, node = rows[far][0]
        raise ValueError(
            f"{path.name} has {np.count_nonzero(far)} sides far from their middles, the first between nodes {first} "
            f"and {second}, whose middle is node {node}; correct it, or export linear cells"
        )
    if height is not None:
        notes.append(_note_on_slope(path, raw, height, cells))
        used = np.unique(np.append(cells, list(nodes.values())).astype(int))
    heights = None if height is None else (raw[used], height[used])
    names = _named_pairs(path, data)
    named = [node for found in names.values() for pair in found for node in pair]  # lines may have nodes of their own
    level = np.zeros(len(raw)) if height is None else height
    points, cells, number = _mend(path, raw, level, cells, named, off, notes)
    middles = {_pair(number[a], number[b]): raw[node] for (a, b), node in nodes.items()}
    pairs = {name: {_pair(number[a], number[b]) for a, b in found} for name, found in names.items()}
    sides = sides_of(cells)[0]
    for name, group in data.nodes.items():  # of two duplicates, a set may hold either
        on = sides[np.isin(sides, number[group]).all(axis=1)]
        if len(on) or (number[group] < 0).all():  # a node of a triangle alone is for a force
            pairs.setdefault(name, set()).update(map(tuple, on.tolist()))
    cells = _split_at_hanging(points, cells, pairs, off, notes)
    _refuse_overlap(path, points, cells)
    return points, cells, middles, pairs, notes, heights, off


def _pair(a: int, b: int) -> tuple[int, int]:
    return (int(a), int(b)) if a < b else (int(b), int(a))


def _plane_points(
    path: Path, data: meshio_reader.Raw, unit: str | None
) -> tuple[np.ndarray, np.ndarray | None, float, list[str]]:
    """Coordinates (n_points, 2) [m] in the plane of the mesh, and heights (n_points,) [m] if it is curved.

    The third is how far [m] nodes may be off by the digits that the file writes; then come notes.
    """
    name, points = path.name, data.points
    notes: list[str] = []
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise ValueError(f"{name} must have points with two or three coordinates, got shape {points.shape}")
    used = np.unique(np.concatenate([nodes.ravel() for _, nodes, _ in data.blocks]))
    lost = used[(used < 0) | (used >= len(points))]
    if lost.size:
        raise ValueError(f"{name} has a cell with node {lost[0]} but only {len(points)} nodes; export it again")
    far = np.abs(points[used]) > FARTHEST
    for what, where in ("that is not a number", ~np.isfinite(points[used])), (f"beyond {FARTHEST:g}", far):
        bad = used[where.any(axis=1)]
        if bad.size:
            raise ValueError(f"{name} has a coordinate {what} at node {bad[0]}: {points[bad[0]]}; correct that node")
    height, off = None, 3.0 * rounded_by(points[used])  # what a sum of coordinates may be, not of one alone
    if points.shape[1] == 3:
        points, flat = _turned_level(points, used, notes)
        spread = np.ptp(points[used], axis=0)
        if spread[flat] > max(FLAT * spread.max(), 2.0 * off):
            height = points[:, flat] - points[used, flat].mean()
        elif spread[flat] > SAME * spread.max():
            notes.append(f"the nodes lie up to {spread[flat]:.1g} apart across the plane of the mesh, which is ignored")
        if flat != 2:
            notes.append(f"the mesh lies in the plane {'xyz'[flat]} = constant; its other two coordinates are used")
        points = np.delete(points, flat, axis=1)
    if unit is not None:
        scale = UNITS[check.one_of("unit", unit, UNITS)]
        points, height, off = points * scale, None if height is None else height * scale, off * scale
    else:
        refuse_millimetres(name, *np.ptp(points[used], axis=0))
    share = off / float(np.ptp(points[used], axis=0).max() or 1.0)
    if share > 2e-4:  # five digits make it 1.5e-4 at most, if the origin is near
        notes.append(f"the digits of the file move nodes by up to {share:.1g} of its extent; write more of them")
    return points, height, off, notes


def _turned_level(points: np.ndarray, used: np.ndarray, notes: list[str]) -> tuple[np.ndarray, int]:
    """Points (n_points, 3) turned so that their mean plane is that of two axes, and the number of the third axis."""
    centre = points[used].mean(axis=0)
    _, size, axes = np.linalg.svd(points[used] - centre, full_matrices=False)
    normal = axes[-1]
    axis = int(np.abs(normal).argmax())
    normal = normal * np.sign(normal[axis])
    tilt = float(np.linalg.norm(np.delete(normal, axis))) / float(normal[axis])
    # a curved surface may lean by 0.03: that changes lengths by half its square, 5e-4
    if tilt <= (FLAT if size[-1] <= FLAT * size[0] else 0.03):
        return points, axis
    notes.append(f"the mean plane of the mesh is tilted by {np.degrees(np.arctan(tilt)):.3g} degrees and was levelled")
    # the smallest turn to the axis: half turns about the line halfway to the normal, and about the axis
    upward = np.eye(3)[axis]
    turns = [2.0 * np.outer(a, a) / (a @ a) - np.eye(3) for a in (upward, normal + upward)]
    return (points - centre) @ (turns[0] @ turns[1]).T + centre, axis


def _note_on_slope(path: Path, points: np.ndarray, height: np.ndarray, cells: np.ndarray) -> str:
    """What to say of a curved surface; ValueError if it is too steep."""
    corner = np.column_stack([points, height])[cells]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    size, level = np.hypot(across[:, 0], across[:, 1]), np.abs(across[:, 2])
    slope = np.divide(size, level, out=np.where(size > SAME * size.max(), np.inf, 0.0), where=level > SAME * size)
    worst = int(slope.argmax())
    if slope[worst] > 1.0:  # the area is 1.4 times that of the outline: no shallow shell by any measure
        x, y, z = corner[worst].mean(axis=0)
        raise ValueError(
            f"{path.name} is too steep for a plate: near ({x:g}, {y:g}) m, {z:g} m above its mean plane, it slopes by "
            f"{np.degrees(np.arctan(slope[worst])):.3g} degrees; shallow theory needs less than 45, and is good "
            "below some 6 degrees; leave out walls and folds"
        )
    return (
        "the surface is curved: its third coordinate is the rise towards the striker, with slopes up to "
        f"{slope[worst]:.2g}, where shallow theory errs by some {50.0 * slope[worst] ** 2:.2g} %"
    )


def _triangles(path: Path, data: meshio_reader.Raw) -> tuple[np.ndarray, dict]:
    """Triangles (n_cells, 3) and the mid-side nodes of quadratic ones (pair of vertices -> node)."""
    name = path.name
    kinds = sorted({kind for kind, nodes, _ in data.blocks if len(nodes)})
    solid = [kind for kind in kinds if kind.startswith(("tetra", "hexahedron", "wedge", "pyramid"))]
    if not set(kinds) & set(PLANE):
        found = ", ".join(kinds) or "no cells"
        hint = "make a beam with fi.mesh.line" if set(kinds) & {"line", "line3"} else "a plate needs triangles"
        raise ValueError(f"{name} contains {found} but no triangles; mesh the surface with triangles ({hint})")
    other = [kind for kind in kinds if kind.startswith(("triangle", "quad", "polygon")) and kind not in PLANE]
    if other:
        raise ValueError(f"{name} contains {', '.join(other)}, which are not read; export linear or quadratic cells")
    if solid:
        raise ValueError(f"{name} contains volume cells ({', '.join(solid)}); export only the flat surface")
    cells, middles = [], {}
    for kind, nodes, _ in data.blocks:
        if kind in NODES and nodes.shape[1:] != (NODES[kind],):
            raise ValueError(f"{name} has a {kind} without exactly {NODES[kind]} nodes; export it again")
        n = 3 if kind.startswith("triangle") else 4
        if kind in PLANE:
            cells += [nodes[:, [0, k, k + 1]] for k in range(1, n - 1)]
            for row in nodes.tolist() if nodes.shape[1] > n else ():
                middles.update({(row[k], row[(k + 1) % n]): row[n + k] for k in range(n)})
    return np.concatenate(cells), middles


def _named_pairs(path: Path, data: meshio_reader.Raw) -> dict[str, set[tuple[int, int]]]:
    """Edge name -> sides, from physical groups, cell sets and numbered line cells."""
    names: dict[str, set[tuple[int, int]]] = {}
    for i, (kind, nodes, tags) in enumerate(data.blocks):
        if kind not in ("line", "line3"):
            continue
        rows = [(a, b) for a, b, *_ in nodes.tolist()]
        for row, tag in zip(rows, () if tags is None else tags.tolist()):
            if tag in data.labels or tag != 0:
                names.setdefault(data.labels.get(tag, f"edge{tag}"), set()).add(row)
        for name, members in data.sets.items():
            chosen = members[i]
            for number in () if chosen is None else chosen.tolist():
                if not 0 <= number < len(nodes):
                    raise ValueError(
                        f"{path.name} has no line {number}, named by set {check.line(name)}; export it again"
                    )
                names.setdefault(name, set()).add(rows[number])
    return names


def _mend(
    path: Path, points: np.ndarray, height: np.ndarray, cells: np.ndarray, named: list[int], off: float,
    notes: list[str],
):  # fmt: skip
    """Merge nodes up to ``off`` [m] apart, drop degenerate and duplicate triangles, flip inverted ones; renumber."""
    name = path.name
    used = np.unique(cells)
    span = float(np.ptp(points[used], axis=0).max())
    if span == 0.0:
        raise ValueError(f"{name} has all its nodes at one point; export it again")
    leader, used = np.arange(len(points)), np.unique(np.append(used, named).astype(int))
    tree = cKDTree(points[used])
    # each node is its own neighbour; parts that touch share a point by few, not by sixteen on average
    apart = max(off, SAME * span)
    if tree.count_neighbors(tree, apart) > 16 * len(used):
        raise ValueError(f"{name} has most of its nodes at a few points; export it again")
    for a, b in sorted(map(tuple, tree.query_pairs(apart))):
        if abs(height[used[a]] - height[used[b]]) > FLAT * span:
            x, y = points[used[a]]
            raise ValueError(f"{name} has two surfaces, one over the other at ({x:g}, {y:g}) m; export one of them")
        leader[used[b]] = min(leader[used[b]], leader[used[a]])
    doubles = np.flatnonzero(leader != np.arange(len(points)))
    if doubles.size:
        (a, b, c), ones, square = cells.T, np.ones(2 * len(cells)), (len(points), len(points))
        sides = coo_matrix((ones, (np.append(a, b), np.append(b, c))), square)
        piece = connected_components(sides, directed=False)[1]
        slit = (piece[doubles] == piece[leader[doubles]]).any()
        why = "; some lie in one piece: if that is a slit, it is closed, so give it a width" if slit else ""
        notes.append(f"{doubles.size} duplicate nodes were merged{why}")
    cells = leader[cells]
    collapsed = (cells[:, 0] == cells[:, 1]) | (cells[:, 1] == cells[:, 2]) | (cells[:, 0] == cells[:, 2])
    if collapsed.any():
        notes.append(f"{int(collapsed.sum())} triangles with two corners at one point were removed")
        cells = cells[~collapsed]
    if not len(cells):
        raise ValueError(f"{name} has no triangle with three corners apart; export it again")
    _, first = np.unique(np.sort(cells, axis=1), axis=0, return_index=True)
    if len(first) < len(cells):
        notes.append(f"{len(cells) - len(first)} duplicate triangles were removed")
        cells = cells[np.sort(first)]
    corner = points[cells]
    u, v = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    area = 0.5 * cross_product(u, v)
    longest = np.maximum(np.maximum((u**2).sum(1), (v**2).sum(1)), ((u - v) ** 2).sum(1))
    flat = np.flatnonzero(2.0 * np.abs(area) <= SAME * longest)
    if flat.size:
        x, y = corner[flat[0]].mean(axis=0)
        raise ValueError(
            f"{name} has {flat.size} triangles with zero area, the first near ({x:g}, {y:g}) m between nodes "
            f"{cells[flat[0]].tolist()}; remove them or mesh the outline again"
        )
    turned = area < 0.0
    if turned.any() and not turned.all():
        notes.append(f"{int(turned.sum())} inverted triangles were flipped")
    cells = np.where(turned[:, None], cells[:, [0, 2, 1]], cells)
    used = np.unique(cells)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    return points[used], number[cells], number[leader]


def sides_of(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sides (n_sides, 2) of triangles, each once and sorted; those of each cell, (n_cells, 3); how many cells share it.

    A cell's sides go from its first vertex to its second, from there to its third, and back.
    """
    n, (a, b) = int(cells.max()) + 1, np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]], axis=2).astype(np.int64).T
    keys, number, counts = np.unique((a * n + b).T, return_inverse=True, return_counts=True)
    return np.column_stack(np.divmod(keys, n)), number.reshape(-1, 3), counts


def numbers_of(sides: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Numbers (n,) of those ``sides``, as of `sides_of`, that lie between pairs (n, 2) of vertices."""
    n, (a, b) = int(sides.max()) + 1, np.sort(pairs, axis=1).T
    return np.searchsorted(sides[:, 0] * n + sides[:, 1], a * n + b)


def side_lengths(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Lengths (n_cells, 3) [m] of the sides of triangles, from the first vertex to the second and on."""
    corner = points[cells]
    return np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)


def boundary(cells: np.ndarray) -> np.ndarray:
    """Sides (n_facets, 2) of a single triangle, body on the left; the cells must be anticlockwise."""
    _, number, counts = sides_of(cells)
    cell, side = np.nonzero(counts[number] == 1)
    order = np.argsort(number[cell, side])
    cell, side = cell[order], side[order]
    return np.column_stack([cells[cell, side], cells[cell, (side + 1) % 3]])


def quarter_triangles(cells: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Each triangle split in four, (4 n_cells, 3); the new points, from number n on, halve the sides (n_new, 2)."""
    sides, number, _ = sides_of(cells)
    (a, b, c), (ab, bc, ca) = cells.T, n + number.T
    quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([np.column_stack(part) for part in quarters]), sides


def _split_at_hanging(points: np.ndarray, cells: np.ndarray, names: dict, off: float, notes: list[str]) -> np.ndarray:
    """Split triangles at hanging nodes, vertices of neighbours ``off`` [m] beside their sides, until none is left."""
    count = 0
    for _ in range(64):
        rim = boundary(cells)
        corners = np.unique(rim)
        tree = cKDTree(points[corners])
        a, b = points[rim[:, 0]], points[rim[:, 1]]
        length = np.linalg.norm(b - a, axis=1)
        near = tree.query_ball_point(0.5 * (a + b), 0.5 * length)
        split: dict[tuple[int, int], int] = {}
        for i, candidates in enumerate(near):
            others = [corners[c] for c in candidates if corners[c] not in rim[i]]
            for node in others:
                along = (points[node] - a[i]) @ (b[i] - a[i]) / length[i] ** 2
                away = abs(np.linalg.det(np.array([b[i] - a[i], points[node] - a[i]]))) / length[i]
                if 1e-9 < along < 1.0 - 1e-9 and away <= max(off, 1e-8 * length[i]):
                    split[_pair(*rim[i])] = int(node)
                    break
        if not split:
            break
        fresh = []
        for c, cell in enumerate(cells.tolist()):
            for k in range(3):
                p, q, r = cell[k], cell[(k + 1) % 3], cell[(k + 2) % 3]
                node = split.pop(_pair(p, q), None)
                if node is not None:
                    cells[c] = [p, node, r]
                    fresh.append([node, q, r])
                    for found in names.values():
                        if _pair(p, q) in found:
                            found |= {_pair(p, node), _pair(node, q)}
                    count += 1
                    break
        cells = np.concatenate([cells, np.array(fresh, int).reshape(-1, 3)])
    if count:
        notes.append(f"{count} triangles were split at hanging nodes, where a neighbour's vertex lies on their side")
    return cells


def _refuse_overlap(path: Path, points: np.ndarray, cells: np.ndarray) -> None:
    """Raise ValueError if triangles overlap, branch or form several pieces."""
    name = path.name
    unique, number, counts = sides_of(cells)
    if (counts > 2).any():
        x, y = points[unique[counts > 2][0]].mean(axis=0)
        raise ValueError(f"{name} has a side shared by three triangles near ({x:g}, {y:g}) m; remove the extra one")
    owner = np.argsort(number.ravel(), kind="stable") // 3
    starts = np.concatenate([[0], np.cumsum(counts)])[:-1]
    inner = starts[counts == 2]
    links = coo_matrix((np.ones(len(inner)), (owner[inner], owner[inner + 1])), shape=(len(cells), len(cells)))
    n_pieces, piece = connected_components(links, directed=False)
    if n_pieces > 1:
        where = [points[cells[piece == i]].mean(axis=(0, 1)) for i in range(min(n_pieces, 4))]
        text = ", ".join(f"({x:g}, {y:g})" for x, y in where)
        raise ValueError(
            f"{name} has {n_pieces} pieces that share no side (around {text} m); connect them, or export only one piece"
        )
    rim = boundary(cells)
    if not len(rim):
        raise ValueError(f"{name} has triangles that form a closed surface; a plate must have a boundary")
    if not np.array_equal(np.sort(rim[:, 0]), np.sort(rim[:, 1])):
        raise ValueError(
            f"{name} has triangles that overlap: two of them lie on the same side of their common edge; mesh it again"
        )
    vertex, visits = np.unique(rim, return_counts=True)
    if (visits > 2).any():
        x, y = points[vertex[visits > 2][0]]
        raise ValueError(f"{name} is connected only by the node at ({x:g}, {y:g}) m; connect it along a side")
    # all triangles are anticlockwise, so they overlap exactly if the rim crosses itself
    loops = [shapely.LinearRing(points[loop]) for loop in loops_of(rim)]
    crossed = [a for i, a in enumerate(loops) if not a.is_simple or any(a.intersects(b) for b in loops[:i])]
    if crossed:
        x, y = crossed[0].coords[0]
        raise ValueError(f"{name} has triangles that overlap at the rim through ({x:g}, {y:g}) m; mesh it again")


def loops_of(rim: np.ndarray) -> list[list[int]]:
    """Closed loops of vertices from boundary facets (n_facets, 2), in the order of their first facets."""
    after = dict(rim.tolist())
    loops = []
    while after:
        start, node = next(iter(after.items()))
        loop = [start]
        del after[start]
        while node != start:
            loop.append(node)
            node = after.pop(node)
        loops.append(loop)
    return loops


def write_mesh(path: str | Path, mesh: Any) -> None:
    """Write a `Mesh` as binary Gmsh 2.2, to a path that ends in .msh; a curved rim makes all triangles quadratic."""
    points, cells, edges = mesh.points, mesh.cells, mesh.edges
    path = check.path("path", path)
    if path.suffix != ".msh":
        raise ValueError(f"path must end in .msh, got {path.name!r}")
    own = [name for name in edges if name not in ("boundary", "outer")] or ["boundary"]
    parts = [np.arange(len(mesh.facets))[edges[name]] for name in own]  # a facet of two names is written twice
    parts.append(np.setdiff1d(np.arange(len(mesh.facets)), np.concatenate(parts)))
    tag = np.repeat([*range(1, len(own) + 1), 0], [len(part) for part in parts])
    facets, middles = (each[np.concatenate(parts)] for each in (mesh.facets, mesh.middles))
    # meshio writes a name in quotation marks as it is, and reads it as a shell does
    names = {re.sub(r'(["\\])', r"\\\1", name): np.array([i + 1, 1]) for i, name in enumerate(own)}
    names["plate" if "plate" not in own else " ".join([*own, "plate"])] = np.array([len(own) + 1, 2])
    flat = points
    blocks: list[tuple[str, np.ndarray]] = [("line", facets), ("triangle", cells)]
    if mesh.curved.any():
        unique, number, _ = sides_of(cells)
        halfway = points[unique].mean(axis=1)
        on_rim = numbers_of(unique, facets)
        halfway[on_rim] = middles
        flat = np.concatenate([points, halfway])
        blocks = [
            ("line3", np.column_stack([facets, len(points) + on_rim])),
            ("triangle6", np.column_stack([cells, len(points) + number])),
        ]
    import meshio  # imported here because it takes 0.1 s and only saving needs it

    tags = [tag, np.full(len(cells), len(own) + 1)]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    height = np.zeros(len(flat)) if mesh.rise is None else check.field("rise", mesh.rise, flat, "m")
    made = meshio.Mesh(np.column_stack([flat, height]), blocks, cell_data=data, field_data=names)
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        made.write(path, file_format="gmsh22", binary=True)
