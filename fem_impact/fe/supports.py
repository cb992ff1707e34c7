"""Apply supports to a plate's unknowns, by one rule for straight and curved edges, corners and mixed supports."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import null_space
from scipy.sparse import csr_matrix

from .._base import check
from .._base.untyped import Sparse
from ..mesh.facets import cross_product
from ..mesh.mesh_files import numbers_of, sides_of
from ..mesh.meshes import Mesh
from .section import KINDS, Elastic

# [-] two facets join smoothly if tangents [rad] and curvatures times length differ by less: arcs from files do
SMOOTH = 1e-5
SIDES = ((0, 1), (1, 2), (0, 2))  # vertices of each facet of a triangle, in scikit-fem's order


@dataclass(frozen=True, eq=False)
class SupportedRim:
    """The boundary of a plate and its supports."""

    facets: np.ndarray  # (n_facets, 2) vertices, with the body on the left
    tangents: np.ndarray  # (n_facets, 2, 2) at both ends
    curvatures: np.ndarray  # (n_facets, 2) at both ends, positive if convex
    points: np.ndarray  # (n_points, 2)
    kinds: list[str]  # (n_facets,) clamped, hinged or free
    springs: np.ndarray  # (n_facets, 2) [-] stiffness of elastic supports against deflection and slope
    plane: Sequence[str] = ()  # (n_facets,) how they are held in the plane, of `section.PLANE`

    def is_special(self, at: list[tuple[int, int]]) -> bool:
        """Whether the plate's curvature may jump at a vertex; ``at`` lists its (facet, end) pairs."""
        if len(at) != 2:
            return True
        (f, i), (g, j) = at
        if self.kinds[f] != self.kinds[g]:
            return True
        a, b = self.tangents[f, i], self.tangents[g, j]
        corner = a @ b < 0.0 or abs(cross_product(a, b)) > SMOOTH
        ends = self.points[self.facets[[f, g]]]
        length = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max())
        jump = abs(self.curvatures[f, i] - self.curvatures[g, j]) * length > SMOOTH
        return corner or (jump and self.kinds[f] == "hinged")


def support_of_facets(
    mesh: Mesh, supports: dict[str, Any], allowed: tuple[str, ...] = KINDS, name: str = "supports",
    otherwise: Sequence[str] = (),
) -> list[str | Elastic]:  # fmt: skip
    """The support of each facet; ``allowed`` are the words besides `Elastic`.

    ``otherwise`` (n_facets,) are those of edges that the argument ``name`` does not name; free if it is empty.
    """
    if not isinstance(supports, dict):
        raise ValueError(f"{name} must be a dict of edge name -> support, got {check.shown(supports)}")
    for edge, kind in supports.items():
        if edge not in mesh.edges:
            raise ValueError(
                f"{name} names edge {edge!r}, but the mesh has the edges {', '.join(sorted(mesh.edges)):.300}"
                + check.nearest(edge, mesh.edges)
            )
        if not isinstance(kind, Elastic):
            check.one_of(f"{name}[{edge!r}]", kind, allowed)
    kinds: list[str | Elastic] = list(otherwise) or ["free"] * len(mesh.facets)
    stated: dict[int, str] = {}
    for edge in sorted(supports, key=lambda edge: -len(mesh.edges[edge])):
        mine = mesh.edges[edge].tolist()
        for facet in mine:
            before = stated.get(facet)
            nested = before is not None and set(mine) < set(mesh.edges[before].tolist())
            if before is not None and not nested and kinds[facet] != supports[edge]:
                raise ValueError(
                    f"{name} must agree where edges overlap; edge {before!r} and edge {edge!r} overlap but differ"
                )
            kinds[facet], stated[facet] = supports[edge], edge
    return kinds


def _conditions(kind: str, tangent: np.ndarray, curvature: float) -> np.ndarray:
    """Conditions (n, 6) on w, w_x, w_y, w_xx, w_xy, w_yy at one end of a facet."""
    (tx, ty), (nx, ny) = tangent, (tangent[1], -tangent[0])
    along = [0.0, 0.0, 0.0, tx * tx, 2.0 * tx * ty, ty * ty]
    deflection, slope = [1.0, 0, 0, 0, 0, 0], [0, tx, ty, 0, 0, 0]
    if kind == "free":
        return np.zeros((0, 6))
    if kind == "hinged":
        # w = 0 along the curve, where the second derivative of w by arc length is w_tt - curvature w_n
        return np.array([deflection, slope, np.subtract(along, [0, curvature * nx, curvature * ny, 0, 0, 0])])
    across = [0, 0, 0, tx * nx, tx * ny + ty * nx, ty * ny]
    return np.array([deflection, slope, [0, nx, ny, 0, 0, 0], along, across])


def _null_space(conditions: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Null space (n_unknowns, n_left) of conditions (n, n_unknowns), and its left inverse (n_left, n_unknowns).

    The unknowns are scaled by the length of the local triangles; otherwise slopes and curvatures mix in one column,
    and the smaller the triangles, the more digits that costs.
    """
    n = conditions.shape[1]
    weight = length ** -np.concatenate([[0.0, 1.0, 1.0], np.full(n - 3, 2.0)])  # unknown = weight * scaled unknown
    rows = conditions * weight
    rows = rows / np.abs(rows).max(axis=1, keepdims=True)
    kept = null_space(rows, rcond=1e-5) if len(rows) else np.eye(n)  # directions in tiny triangles are no more exact
    return weight[:, None] * kept, kept.T / weight


def _split_conditions(
    vertex: int, at: list, around: np.ndarray, rim: SupportedRim, cells: np.ndarray, facet_cell: np.ndarray
) -> np.ndarray:
    """Conditions (n_rows, 3 + 3 n) at a vertex where each of its triangles (n,) has its own second derivatives."""
    slot = {int(cell): 3 + 3 * i for i, cell in enumerate(around)}
    rows = []
    shared: dict[int, list[int]] = {}
    for cell in around.tolist():
        for other in cells[cell].tolist():
            if other != vertex:
                shared.setdefault(other, []).append(cell)
    for other, pair in shared.items():
        if len(pair) != 2:
            continue
        x, y = rim.points[other] - rim.points[vertex]
        x, y = np.array([x, y]) / np.hypot(x, y)
        for row in ([x, y, 0.0], [0.0, x, y]):  # derivatives along the shared edge must agree
            line = np.zeros(3 + 3 * len(around))
            line[slot[pair[0]] : slot[pair[0]] + 3] = row
            line[slot[pair[1]] : slot[pair[1]] + 3] = np.negative(row)
            rows.append(line)
    for facet, end in at:
        for condition in _conditions(rim.kinds[facet], rim.tangents[facet, end], rim.curvatures[facet, end]):
            line = np.zeros(3 + 3 * len(around))
            start = slot[int(facet_cell[facet])]
            line[:3], line[start : start + 3] = condition[:3], condition[3:]
            rows.append(line)
    return np.array(rows).reshape(-1, 3 + 3 * len(around))


def cells_of_facets(facets: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The triangle of each boundary facet, and the number of the side it is in that triangle, both (n_facets,)."""
    sides, number, _ = sides_of(cells)
    order = np.argsort(number, axis=None)
    found = order[np.searchsorted(number.ravel(), numbers_of(sides, facets), sorter=order)]
    return found // 3, found % 3


def constrain(
    rim: SupportedRim, cells: np.ndarray, dofs: np.ndarray, n_all: int, creased: Iterable[int] = ()
) -> tuple[Sparse, Sparse, np.ndarray]:
    """Remove from the Argyris unknowns those that the supports fix.

    Each boundary vertex keeps the null space of the conditions of its two facets. At a corner, at a change of support
    and where the curvature of a hinged edge jumps, the curvature of the plate jumps too. Each triangle there gets its
    own second derivatives, tied so that deflection and slope stay continuous across the edges between them.

    Parameters
    ----------
    rim : SupportedRim
    cells : ndarray, shape (n_cells, 3), vertices of the triangles
    dofs : ndarray, shape (21, n_cells), numbers of their unknowns
    n_all : int, number of unknowns
    creased : iterable of int
        More vertices where the curvature of the plate may jump, as along a rib that twists.

    Returns
    -------
    expand : csr_matrix, shape (n_all + new, n_left)
    project : csr_matrix, shape (n_left, n_all + new), left inverse of expand
    dofs : ndarray, shape (21, n_cells), with the new unknowns of vertices where the curvature jumps
    """
    dofs = dofs.copy()
    cell, side = cells_of_facets(rim.facets, cells)
    ends: dict[int, list[tuple[int, int]]] = {}
    for facet, pair in enumerate(rim.facets.tolist()):
        for end, vertex in enumerate(pair):
            ends.setdefault(vertex, []).append((facet, end))
    blocks: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    creases = {int(vertex) for vertex in creased}
    for vertex in creases:
        ends.setdefault(vertex, [])
    for vertex, at in ends.items():
        special = vertex in creases or rim.is_special(at)
        if not special and rim.kinds[at[0][0]] == "free":
            continue
        around, corner = np.nonzero(cells == vertex)
        length = float(np.linalg.norm(rim.points[cells[around]] - rim.points[vertex], axis=2).max())
        first = dofs[6 * corner[0] : 6 * corner[0] + 6, around[0]].copy()
        if not special:
            facet, end = at[0]
            conditions = _conditions(rim.kinds[facet], rim.tangents[facet, end], rim.curvatures[facet, end])
            blocks.append((first, *_null_space(conditions, length)))
            continue
        numbers = [first[:3]]
        for i, (c, k) in enumerate(zip(around, corner)):
            own = first[3:] if i == 0 else n_all + np.arange(3)
            n_all += 0 if i == 0 else 3
            dofs[6 * k + 3 : 6 * k + 6, c] = own
            numbers.append(own)
        blocks.append(
            (np.concatenate(numbers), *_null_space(_split_conditions(vertex, at, around, rim, cells, cell), length))
        )
    clamped = np.array([kind == "clamped" for kind in rim.kinds])
    none = np.zeros((int(clamped.sum()), 0))
    blocks.append((dofs[18 + side[clamped], cell[clamped]], none, none.T))
    free = np.setdiff1d(np.arange(n_all), np.concatenate([block[0] for block in blocks]))
    rows, columns, width = [free], [np.arange(len(free))], len(free)
    entries, inverse = [np.ones(len(free))], [np.ones(len(free))]
    for unknowns, kept, back in blocks:
        n_left = kept.shape[1]
        rows.append(np.repeat(unknowns, n_left))
        columns.append(np.tile(np.arange(width, width + n_left), len(unknowns)))
        entries.append(kept.ravel())
        inverse.append(back.T.ravel())
        width += n_left
    if width == 0:
        raise ValueError("supports fix every unknown of this mesh; refine it")
    row, column = np.concatenate(rows).astype(int), np.concatenate(columns).astype(int)
    expand = csr_matrix((np.concatenate(entries), (row, column)), shape=(n_all, width))
    return expand, csr_matrix((np.concatenate(inverse), (column, row)), shape=(width, n_all)), dofs
