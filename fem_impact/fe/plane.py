"""A field of two components in the plane of a plate, by quartic triangles beside those of the deflection.

Thick plates have their shear strains there, shells and stretched plates the displacements in their plane.
"""

import numpy as np
from scipy.linalg import qr
from scipy.sparse import csr_matrix
from skfem import Dofs, ElementTriP4

from .._base.untyped import Cells
from . import supports
from .elements import ArgyrisSpace, Triangles, area_coordinates
from .theory import unresisted_motions

QUARTIC = 15  # shape functions of one component on a triangle
FIRST, SECOND = slice(21, 21 + QUARTIC), slice(21 + QUARTIC, 21 + 2 * QUARTIC)  # unknowns of both components
NODES = ElementTriP4.doflocs  # (15, 2) where those of a component lie in the unit triangle
LOCAL = 21 + 2 * QUARTIC  # unknowns of a triangle, those of the deflection first


def numbered_unknowns(mesh: Cells) -> Dofs:
    """Numbers of the unknowns of one component on a mesh."""
    return Dofs(mesh, ElementTriP4())


def reference(X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quartic shape functions (n_q, 15) and their gradients (2, n_q, 15) at points (2, n_q) of the unit triangle."""
    element = ElementTriP4()
    found = [element.lbasis(X, i) for i in range(QUARTIC)]
    values = np.stack([np.broadcast_to(value, X[0].shape) for value, _ in found], axis=-1)
    gradients = [np.stack([np.broadcast_to(part, X[0].shape) for part in gradient]) for _, gradient in found]
    return values, np.stack(gradients, axis=-1)


class PlaneSpace(ArgyrisSpace):
    """Shape functions of one mesh: 21 by `bending_functions`, then 15 for each component in the plane."""

    def functions(self, cells: np.ndarray, points: np.ndarray, orders: tuple[int, ...]) -> list[np.ndarray]:
        """Those of `bending_functions`, with zeros for the plane, which moves no point across it."""
        found = self.bending_functions(cells, points, orders)
        return [np.concatenate([f, np.zeros((*f.shape[:-1], 2 * QUARTIC))], axis=-1) for f in found]


def nodes(inner: Triangles) -> np.ndarray:
    """Where the nodes (n_cells, 15, 2) of both components lie, on the true edge."""
    cells, none = np.arange(len(inner.origin)), np.zeros((1, 1, 3))
    return inner.points_along(cells, np.broadcast_to(area_coordinates(NODES), (len(cells), QUARTIC, 3)), none)[0]


def gradients(inner: Triangles, cells: np.ndarray, area: np.ndarray) -> np.ndarray:
    """Gradients (n, n_q, 2, 15) of the functions of cells (n,) at area coordinates (n, n_q, 3), on the true edge.

    The area coordinates may be the same for all cells, (1, n_q, 3).
    """
    n_q = area.shape[1]
    own = reference(area[..., 1:].reshape(-1, 2).T)[1].reshape(2, len(area), n_q, QUARTIC)
    J = inner.jacobians(cells, area)
    return np.einsum("eqji,jeqk->eqik", np.linalg.inv(J), np.broadcast_to(own, (2, len(cells), n_q, QUARTIC)))


def strains(gradient: np.ndarray) -> np.ndarray:
    """Strains xx, yy and 2 xy (..., 3, 30) by both components, from the gradients (..., 2, 15) of their functions."""
    result = np.zeros((*gradient.shape[:-2], 3, 2 * QUARTIC))
    result[..., 0, :QUARTIC] = result[..., 2, QUARTIC:] = gradient[..., 0, :]
    result[..., 1, QUARTIC:] = result[..., 2, :QUARTIC] = gradient[..., 1, :]
    return result


def at_rim(
    inner: Triangles, facets: np.ndarray, cells: np.ndarray, sides: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes on boundary facets: their local numbers (n, 5), places and outward normals (n, 5, 2)."""
    pairs = np.array(supports.SIDES)[sides]  # (n, 2) corners
    local = np.column_stack([pairs, 3 + 3 * sides[:, None] + np.arange(3)])
    s = np.array([0.0, 1.0, 0.25, 0.5, 0.75])[:, None]
    first, last = (np.eye(3)[pairs[:, end]][:, None] for end in range(2))  # (n, 1, 3)
    area = (1.0 - s) * first + s * last
    x, step = inner.points_along(cells, area, last - first)
    backward = inner.vertices[cells, pairs[:, 0]] != facets[:, 0]
    step = np.where(backward[:, None, None], -step, step)
    normal = np.stack([step[..., 1], -step[..., 0]], axis=-1)
    return local, x, normal / np.linalg.norm(normal, axis=2)[..., None]


def held_at(
    inner: Triangles, facets: np.ndarray, words: list[str], own: Dofs
) -> tuple[csr_matrix, dict[int, list[tuple[int, int]]]]:
    """What boundary facets leave of a field: the map (2 n, n_left) to both components, and where facets have nodes.

    ``words`` (n_facets,) are those of `section.PLANE`. The second result lists, for each node that is not free, the
    facets and their nodes that it belongs to.
    """
    cells, sides = supports.cells_of_facets(facets, inner.vertices)
    local, _, normal = at_rim(inner, facets, cells, sides)
    at: dict[int, list[tuple[int, int]]] = {}
    for facet, word in enumerate(words):
        if word != "free":
            for k in range(local.shape[1]):
                at.setdefault(int(own.element_dofs[local[facet, k], cells[facet]]), []).append((facet, k))
    single = []  # nodes free in one direction only, and that direction
    for node, places in at.items():
        if not any(words[facet] == "held" for facet, _ in places):  # the direction that each facet leaves free
            left = [normal[p] if words[p[0]] == "sliding" else np.array([-normal[p][1], normal[p][0]]) for p in places]
            (x, y), turn = left[0], max(abs(left[0][0] * b - left[0][1] * a) for a, b in left)
            if turn < supports.SMOOTH:  # edges that meet may leave the same one, as one slides and one is held across
                single.append((node, np.array([x, y])))
    n, free = own.N, np.setdiff1d(np.arange(own.N), list(at))
    rows = np.concatenate([free, free + n, *[[node, node + n] for node, _ in single]]).astype(int)
    columns = np.concatenate([np.arange(2 * len(free)), np.repeat(2 * len(free) + np.arange(len(single)), 2)])
    entries = np.concatenate([np.ones(2 * len(free)), *[way for _, way in single]])
    return csr_matrix((entries, (rows, columns)), shape=(2 * n, 2 * len(free) + len(single))), at


def plane_motions(places: np.ndarray) -> np.ndarray:
    """Values (2 n, 3) at nodes (n, 2) of the rigid motions in the plane: along x, along y, and turning."""
    one, none = np.ones(len(places)), np.zeros(len(places))
    return np.vstack([np.column_stack([one, none, -places[:, 1]]), np.column_stack([none, one, places[:, 0]])])


def free_displacements(inner: Triangles, rim: supports.SupportedRim, own: Dofs) -> tuple[csr_matrix, np.ndarray]:
    """The map (2 n, n_left) that the edges leave of the displacements in a plane, and that cannot move rigidly.

    If no edge prevents a rigid motion, some unknowns are left out that, when fixed, just do. The second result are
    these motions (2 n, n_motions).
    """
    loose, places = held_at(inner, rim.facets, list(rim.plane), own)[0], np.zeros((own.N, 2))
    places[own.element_dofs.T] = nodes(inner)
    motions = plane_motions(places)
    free = unresisted_motions(motions, loose, loose.T)  # the columns of the map are orthonormal
    still = loose.T @ motions @ free
    pinned = qr(still.T, pivoting=True, mode="economic")[2][: still.shape[1]] if still.size else []
    return loose[:, np.setdiff1d(np.arange(loose.shape[1]), pinned)], motions @ free
