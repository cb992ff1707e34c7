"""Triangular elements whose shape functions stay accurate for any size, shape and position of the triangle."""

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from skfem import Dofs, ElementTriArgyris, ElementTriMorley, MappingAffine, MeshTri
from skfem.quadrature import get_quadrature

from .._base.rounding import SAME
from .._base.untyped import Cells
from ..mesh.facets import CURVE_STEPS, Curves, powers
from .supports import SIDES
from .theory import Points

EXPONENTS = np.array([(i, j) for i in range(6) for j in range(6 - i)])  # the 21 monomials of degree 5
NEAR_CURVE = 1e-5  # [-] the same at curved edges: the mesh is closer to the curve than this share of a triangle
# [-] nearest triangles searched first: about those around a vertex; if none holds the point, all are searched
CANDIDATES = 8
# [-] share of a triangle's size; no curved edge bulges this far: facets bulge by an eighth of their turn, below 0.1
REACH = 0.5
REFERENCE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) - 1.0 / 3.0  # corners in local coordinates
DERIVATIVES = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))  # unknowns at a vertex: orders in x and y


def monomials(local: np.ndarray, dx: int, dy: int) -> np.ndarray:
    """Derivative of the 21 monomials at local coordinates (..., 2), shape (..., 21)."""
    x, y = powers(local[..., 0], 5, dx), powers(local[..., 1], 5, dy)
    return x[..., EXPONENTS[:, 0]] * y[..., EXPONENTS[:, 1]]


def curvatures(hessian: np.ndarray) -> np.ndarray:
    """Curvatures (xx, yy, 2 xy) of shape functions, (n, n_q, 3, n_local), from (xx, xy, yy), (n, 3, n_q, n_local)."""
    return hessian[:, [0, 2, 1]].transpose(0, 2, 1, 3) * np.array([1.0, 1.0, 2.0])[:, None]


def area_coordinates(local: np.ndarray) -> np.ndarray:
    """Shares (n, 3) of the corners of a triangle in points (n, 2) of the reference triangle."""
    return np.column_stack([1.0 - local[:, 0] - local[:, 1], local])


class Bent:
    """Map that bends the triangles at curved facets onto the true curve and leaves the others straight."""

    curves: Curves
    cells: np.ndarray  # (n,) of each curved facet
    sides: np.ndarray  # (n,) of the cell
    start: np.ndarray  # (n,) corner of the cell at which the facet starts
    stop: np.ndarray  # (n,) and ends
    of_side: np.ndarray  # (n_cells, 3) curved facet of every side, or -1

    def __init__(
        self, curves: Curves, facets: np.ndarray, cells: np.ndarray, sides: np.ndarray, vertices: np.ndarray
    ) -> None:
        self.curves, self.cells, self.sides = curves, cells, sides
        corner = vertices[cells]  # (n, 3)
        self.start = (corner == facets[:, :1]).argmax(axis=1)
        self.stop = (corner == facets[:, 1:]).argmax(axis=1)
        self.of_side = np.full(vertices.shape, -1)
        self.of_side[cells, sides] = np.arange(len(cells))

    def shift(self, cells: np.ndarray, area: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement (n, n_q, 2) of cells (n,) at area coordinates (n, n_q, 3), and its gradient (n, n_q, 2, 3)."""
        moved, gradient = np.zeros((*area.shape[:2], 2)), np.zeros((*area.shape[:2], 2, 3))
        for side in range(3):
            here = np.flatnonzero(self.of_side[cells, side] >= 0)
            rows = self.of_side[cells[here], side]
            first, last, out = self.start[rows], self.stop[rows], self.curves.out[rows]
            a, b = area[here, :, first], area[here, :, last]
            p, dp = self.curves.graph(rows, 0.5 * (1.0 + b - a))
            moved[here] += (a * b * p)[..., None] * out[:, None]
            gradient[here, :, :, first] += (b * (p - 0.5 * a * dp))[..., None] * out[:, None]
            gradient[here, :, :, last] += (a * (p + 0.5 * b * dp))[..., None] * out[:, None]
        return moved, gradient


class _BentMapping(MappingAffine):
    """scikit-fem's mapping from the reference triangle, extended to bent triangles."""

    def __init__(self, mesh: Cells, bent: Bent) -> None:
        super().__init__(mesh)
        self.bent = bent

    def _shift(self, X: np.ndarray, tind: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        cells = np.arange(self.mesh.t.shape[1]) if tind is None else tind
        X = np.broadcast_to(X, (2, X.shape[-1]))
        area = np.broadcast_to(area_coordinates(X.T), (len(cells), X.shape[1], 3))
        return cells, *self.bent.shift(cells, area)

    def F(self, X: np.ndarray, tind: np.ndarray | None = None) -> np.ndarray:
        """Where points of the reference triangle lie."""
        return super().F(X, tind) + self._shift(X, tind)[1].transpose(2, 0, 1)

    def detDF(self, X: np.ndarray, tind: np.ndarray | None = None) -> np.ndarray:
        """Determinant of the map there."""
        cells, _, gradient = self._shift(X, tind)
        J = self.A[:, :, cells].transpose(2, 0, 1)[:, None] + gradient[..., 1:] - gradient[..., :1]
        return J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]


class Triangles:
    """The triangles of one mesh: local coordinates, normals of sides, and a search for the triangle of a point."""

    corners: np.ndarray  # (n_cells, 3, 2)
    vertices: np.ndarray  # (n_cells, 3)
    bent: Bent | None
    origin: np.ndarray  # (n_cells, 2) centre
    jacobian: np.ndarray  # (n_cells, 2, 2) of the map from the reference triangle
    inverse: np.ndarray  # (n_cells, 2, 2) of that
    normals: np.ndarray  # (n_cells, 3, 2) of the sides, the same for both triangles beside one
    curved: np.ndarray  # (n_cells,) bool
    tree: Any  # scipy's search tree of the centres

    def __init__(self, mesh: Cells, bent: Bent | None = None) -> None:
        corners = mesh.p[:, mesh.t].transpose(2, 1, 0)  # (n_cells, 3, 2)
        self.corners, self.vertices, self.bent = corners, mesh.t.T, bent
        self.origin = corners.mean(axis=1)
        self.jacobian = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
        self.inverse = np.linalg.inv(self.jacobian)
        along = np.stack([corners[:, q] - corners[:, p] for p, q in SIDES], axis=1)
        up = np.stack([self.vertices[:, p] < self.vertices[:, q] for p, q in SIDES], axis=1)
        along = along * np.where(up, 1.0, -1.0)[..., None]  # the two triangles of a side must agree
        self.normals = np.stack([along[..., 1], -along[..., 0]], axis=-1) / np.linalg.norm(along, axis=2)[..., None]
        self.curved = np.zeros(len(corners), bool)
        if bent is not None:
            self.curved[bent.cells] = True
        self.tree = cKDTree(self.origin)

    def local(self, cells: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Local coordinates (n, ..., 2) of points (n, ..., 2); they are zero at the centre of the triangle."""
        shape = (len(cells),) + (1,) * (points.ndim - 2)
        offset = points - self.origin[cells].reshape(*shape, 2)
        return np.einsum("eij,e...j->e...i", self.inverse[cells], offset)

    def chain(self, cells: np.ndarray, order: int) -> np.ndarray:
        """Matrices (n, order + 1, order + 1) that turn derivatives in local coordinates of cells (n,) into x and y."""
        inverse = self.inverse[cells]
        a, b, c, d = (inverse[:, i, j] for i, j in product(range(2), repeat=2))
        if order == 1:
            rows = [[a, c], [b, d]]
        else:
            rows = [[a * a, 2 * a * c, c * c], [a * b, a * d + b * c, c * d], [b * b, 2 * b * d, d * d]]
        return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)

    def derivatives(
        self, cells: np.ndarray, points: np.ndarray, orders: tuple[int, ...],
        terms: Callable[[np.ndarray, int, int], np.ndarray], weights: np.ndarray,
    ) -> list[np.ndarray]:  # fmt: skip
        """Derivatives of polynomials, one array for each order, as in `ArgyrisSpace.functions`.

        ``terms(local, dx, dy)`` gives derivatives (..., n) of n terms; ``weights`` (n_cells, n, n_local) combine them.
        """
        local = self.local(cells, points)
        result = []
        for order in orders:
            raw = [terms(local, order - k, k) @ weights[cells] for k in range(order + 1)]
            stacked = np.stack(raw, axis=1)  # (n, order + 1, n_q, n_local)
            if order:
                stacked = (self.chain(cells, order) @ stacked.reshape(*stacked.shape[:2], -1)).reshape(stacked.shape)
            result.append(stacked if order else raw[0])
        return result

    def along(self, cells: np.ndarray, area: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points of cells (n,) at area coordinates (n, n_q, 3), and their derivatives along ``step``, both (n, n_q, 2).

        ``step`` (n, 1, 3) is a change of the area coordinates.
        """
        x, gradient = area @ self.corners[cells], self.corners[cells].transpose(0, 2, 1)[:, None]
        if self.bent is not None:
            moved, turned = self.bent.shift(cells, area)
            x, gradient = x + moved, gradient + turned
        return x, np.broadcast_to((gradient @ step[..., None])[..., 0], x.shape)

    def locate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cell that holds each point (n, 2), or else the nearest one, and whether the point lies in it."""
        count = min(CANDIDATES, len(self.origin))
        near = self.tree.query(points, k=count)[1].reshape(len(points), count)
        cell, depth = self._deepest(points, near)
        margin = np.full(len(self.origin), -SAME)
        if self.curved.any():
            size = np.sqrt(np.abs(np.linalg.det(self.jacobian)))
            margin = np.minimum(margin, -NEAR_CURVE * size[self.curved].max() / size)
        lost = depth < margin[cell]
        if lost.any():
            every = np.broadcast_to(np.arange(len(self.origin)), (1, len(self.origin)))
            for i in np.flatnonzero(lost):
                cell[i], depth[i] = (a[0] for a in self._deepest(points[i : i + 1], every))
        return cell, depth >= margin[cell]

    def _deepest(self, points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The candidate cell (n, k) in which each point lies deepest, and how deep (smallest area coordinate)."""
        cells = np.broadcast_to(cells, (len(points), cells.shape[1]))
        offset = points[:, None] - self.origin[cells]
        local = np.einsum("nkij,nkj->nki", self.inverse[cells], offset) + 1.0 / 3.0
        straight = np.minimum(local.min(axis=2), 1.0 - local.sum(axis=2))
        bent = self.curved[cells] & (straight > -REACH)
        if self.bent is not None and bent.any():
            which, away = cells[bent], offset[bent]
            place = local[bent]
            for _ in range(CURVE_STEPS):
                moved = self.bent.shift(which, area_coordinates(place)[:, None])[0][:, 0]
                place = np.einsum("nij,nj->ni", self.inverse[which], away - moved) + 1.0 / 3.0
                place = np.clip(place, -1.0, 2.0)  # points far away are outside anyway
            local[bent] = place
        depth = np.minimum(local.min(axis=2), 1.0 - local.sum(axis=2))
        best = depth.argmax(axis=1)
        row = np.arange(len(points))
        return cells[row, best], depth[row, best]


class ArgyrisSpace:
    """Quintic shape functions of all triangles of one mesh, in the local coordinates of each.

    scikit-fem inverts a Vandermonde matrix of monomials in physical coordinates, which becomes singular when elements
    are a thousand times smaller than the coordinates. This class first maps each triangle to the reference triangle
    and its unknowns to the reference directions.
    """

    element: type[Any] = ElementTriArgyris  # scikit-fem's class: it numbers the unknowns
    order: int = 10  # of the quadrature: exact for products of quintics
    inner: Triangles
    origin: np.ndarray  # these and the next as in `Triangles`
    inverse: np.ndarray
    jacobian: np.ndarray
    vertices: np.ndarray
    curved: np.ndarray
    bent: Bent | None
    normals: np.ndarray  # (n_cells, 3, 2) at `middles`
    middles: np.ndarray  # (n_cells, 3, 2) of the sides, on the true curve
    coefficients: np.ndarray  # (n_cells, 21, 21) of the monomials in each shape function

    def __init__(self, mesh: Cells, bent: Bent | None = None) -> None:
        self.inner = Triangles(mesh, bent)
        self.origin, self.inverse, self.jacobian = self.inner.origin, self.inner.inverse, self.inner.jacobian
        self.vertices, self.curved, self.bent = self.inner.vertices, self.inner.curved, bent
        corners, self.normals = self.inner.corners, self.inner.normals.copy()
        self.middles = np.stack([0.5 * (corners[:, p] + corners[:, q]) for p, q in SIDES], axis=1)
        if bent is not None:
            at = bent.cells, bent.sides
            self.middles[at], self.normals[at] = bent.curves.middle()
        self.coefficients = self._invert(corners, self.middles)

    def _invert(self, corners: np.ndarray, middles: np.ndarray) -> np.ndarray:
        n = len(corners)
        functionals = np.zeros((n, 21, 21))
        turn = np.zeros((n, 21, 21))  # physical unknowns -> unknowns along the reference directions
        J = self.jacobian
        for k in range(3):
            at = self.inner.local(np.arange(n), corners[:, k])
            for row, (dx, dy) in enumerate(DERIVATIVES):
                functionals[:, 6 * k + row] = monomials(at, dx, dy)
            a, b, c, d = J[:, 0, 0], J[:, 0, 1], J[:, 1, 0], J[:, 1, 1]
            block = turn[:, 6 * k : 6 * k + 6, 6 * k : 6 * k + 6]
            block[:, 0, 0] = 1.0
            block[:, 1:3, 1:3] = np.stack([np.stack([a, c], -1), np.stack([b, d], -1)], axis=1)
            hessian = [[a * a, 2 * a * c, c * c], [a * b, a * d + b * c, c * d], [b * b, 2 * b * d, d * d]]
            block[:, 3:, 3:] = np.stack([np.stack(row, axis=-1) for row in hessian], axis=1)
        for side in range(3):
            weight = np.einsum("eij,ej->ei", self.inverse, self.normals[:, side])  # in local coordinates
            size = np.linalg.norm(weight, axis=1)
            at = self.inner.local(np.arange(n), middles[:, side])
            row = weight[:, :1] * monomials(at, 1, 0) + weight[:, 1:] * monomials(at, 0, 1)
            functionals[:, 18 + side] = row / size[:, None]
            turn[:, 18 + side, 18 + side] = 1.0 / size
        return np.linalg.solve(functionals, turn)

    def functions(self, cells: np.ndarray, points: np.ndarray, orders: tuple[int, ...]) -> list[np.ndarray]:
        """Derivatives of the shape functions of cells (n,) at points (n, n_q, 2), one array for each order.

        The arrays are (n, n_q, 21) for order 0, (n, 2, n_q, 21) for order 1, (n, 3, n_q, 21) for order 2 (xx, xy, yy).
        """
        return self.inner.derivatives(cells, points, orders, monomials, self.coefficients)

    def rule(self) -> tuple[np.ndarray, np.ndarray]:
        """Quadrature of the reference triangle: local coordinates (n_q, 2) and weights (n_q,)."""
        X, weight = get_quadrature(self.element.refdom, self.order)
        return X.T - 1.0 / 3.0, weight

    def uniform(self, cells: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Bending and mass matrices (n, 21, 21) of straight cells (n,) with uniform stiffness (3, 3) and unit inertia.

        The integrals of products of monomials are the same for all triangles, so they are computed once.
        """
        local, weight = self.rule()
        values = monomials(local, 0, 0)
        bends = np.stack([monomials(local, 2 - k, k) for k in range(3)])  # (3, n_q, 21)
        products = np.einsum("iqa,q,jqb->ijab", bends, weight, bends).reshape(9, 441)
        determinant = np.abs(np.linalg.det(self.jacobian[cells]))
        engineering = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, 2.0, 0]])  # (xx, xy, yy) -> (xx, yy, 2 xy)
        turn = engineering @ self.inner.chain(cells, 2)
        metric = turn.transpose(0, 2, 1) @ stiffness @ turn * determinant[:, None, None]
        C = self.coefficients[cells]
        bending = C.transpose(0, 2, 1) @ (metric.reshape(-1, 9) @ products).reshape(-1, 21, 21) @ C
        mass = C.transpose(0, 2, 1) @ (values.T * weight @ values) @ C
        return bending, mass * determinant[:, None, None]

    def locate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cell that holds each point (n, 2), or else the nearest one, and whether the point lies in it."""
        return self.inner.locate(points)

    def linear(self, element_dofs: np.ndarray, n_all: int) -> np.ndarray:
        """Unknowns (n_all, 3) of the deflections 1, x and y, the rigid motions of a plate."""
        result = np.zeros((n_all, 3))
        corner = self.inner.corners
        for k in range(3):
            result[element_dofs[6 * k], 0] = 1.0
            result[element_dofs[6 * k], 1:] = corner[:, k]
            result[element_dofs[6 * k + 1], 1] = 1.0
            result[element_dofs[6 * k + 2], 2] = 1.0
            result[element_dofs[18 + k], 1:] = self.normals[:, k]
        return result


class MorleySpace:
    """Quadratic Morley shape functions of straight triangles: deflection at corners, slope at mid-sides.

    They are continuous only at those points and approach the frequencies from below, while Argyris elements approach
    them from above.
    """

    element: type[Any] = ElementTriMorley
    order: int = 4  # of the quadrature: exact for products of quadratics
    inner: Triangles
    origin: np.ndarray  # these and the next as in `Triangles`
    inverse: np.ndarray
    jacobian: np.ndarray
    vertices: np.ndarray
    normals: np.ndarray
    bent: None
    coefficients: np.ndarray  # (n_cells, 6, 6) of the monomials in each shape function

    def __init__(self, mesh: Cells, bent: Bent | None = None) -> None:
        self.inner = Triangles(mesh)
        self.origin, self.inverse, self.jacobian = self.inner.origin, self.inner.inverse, self.inner.jacobian
        self.vertices, self.normals, self.bent = self.inner.vertices, self.inner.normals, None
        n = len(self.origin)
        functionals = np.zeros((n, 6, 6))
        for k, corner in enumerate(REFERENCE):
            functionals[:, k] = _quadratic(corner[None], 0, 0)
        for side, (p, q) in enumerate(SIDES):
            weight = np.einsum("eij,ej->ei", self.inverse, self.normals[:, side])
            at = 0.5 * (REFERENCE[p] + REFERENCE[q])[None]
            functionals[:, 3 + side] = weight[:, :1] * _quadratic(at, 1, 0) + weight[:, 1:] * _quadratic(at, 0, 1)
        self.coefficients = np.linalg.inv(functionals)

    def functions(self, cells: np.ndarray, points: np.ndarray, orders: tuple[int, ...]) -> list[np.ndarray]:
        """The same as `ArgyrisSpace.functions`, with six shape functions per cell."""
        return self.inner.derivatives(cells, points, orders, _quadratic, self.coefficients)

    def locate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cell that holds each point (n, 2), or the nearest one, and whether the point lies in it."""
        return self.inner.locate(points)

    def linear(self, element_dofs: np.ndarray, n_all: int) -> np.ndarray:
        """Unknowns (n_all, 3) of the deflections 1, x and y."""
        result = np.zeros((n_all, 3))
        for k in range(3):
            result[element_dofs[k], 0] = 1.0
            result[element_dofs[k], 1:] = self.origin + self.jacobian @ REFERENCE[k]
            result[element_dofs[3 + k], 1:] = self.normals[:, k]
        return result


def _quadratic(local: np.ndarray, dx: int, dy: int) -> np.ndarray:
    """Derivative of the six monomials of degree 2 at local coordinates (..., 2), shape (..., 6)."""
    x, y = powers(local[..., 0], 2, dx), powers(local[..., 1], 2, dy)
    i, j = np.array([(i, j) for i in range(3) for j in range(3 - i)]).T
    return x[..., i] * y[..., j]


def triangles(points: np.ndarray, cells: np.ndarray) -> Cells:
    """Make scikit-fem's mesh of triangles."""
    return MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))


def inverses(space: Any, X: np.ndarray) -> np.ndarray:
    """Inverse Jacobians (n_cells, n_q, 2, 2) of the map from the reference triangle at its points (2, n_q)."""
    J = np.broadcast_to(space.jacobian[:, None], (len(space.origin), X.shape[1], 2, 2)).copy()
    if space.bent is not None:
        cells = space.bent.cells
        area = np.broadcast_to(area_coordinates(X.T), (len(cells), X.shape[1], 3))
        gradient = space.bent.shift(cells, area)[1]
        # a triangle with two curved sides is listed twice, each time with the whole shift
        J[cells] = space.jacobian[cells][:, None] + gradient[..., 1:] - gradient[..., :1]
    return np.linalg.inv(J)


def quadrature(mesh: Any, space: Any, bent: Bent | None) -> Points:
    """The quadrature of a space on every triangle."""
    X, weight = get_quadrature(space.element.refdom, space.order)
    mapping = mesh._mapping() if bent is None else _BentMapping(mesh, bent)
    return Points(X, mapping.F(X).transpose(1, 2, 0), np.abs(mapping.detDF(X)) * weight)


def numbering(mesh: Cells, space: Any) -> tuple[np.ndarray, int]:
    """Numbers of the unknowns of each cell, (n_local, n_cells), and how many unknowns there are."""
    dofs = Dofs(mesh, space.element())  # a new object: scikit-fem's elements remember their first mesh
    return dofs.element_dofs, dofs.N
