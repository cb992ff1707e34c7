"""Triangular elements whose shape functions stay accurate for any size, shape and position of the triangle."""

from itertools import product
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from skfem import Dofs, ElementTriArgyris, ElementTriMorley, MeshTri
from skfem.quadrature import get_quadrature

from .._base.remembered import gauss_rule
from .._base.rounding import SAME
from .._base.untyped import Cells
from ..mesh.facets import CURVE_STEPS, Curves, powers
from .supports import SIDES
from .theory import Points

# by highest degree: the exponents (n, 2) of monomials of quadratics, of cubics and of quintics
EXPONENTS = {k: np.array([(i, j) for i in range(k + 1) for j in range(k + 1 - i)]) for k in (2, 3, 5)}
REFERENCE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) - 1.0 / 3.0  # corners in local coordinates


def monomials(local: np.ndarray, dx: int, dy: int, degree: int = 5) -> np.ndarray:
    """Derivative of the monomials up to a degree at local coordinates (..., 2), shape (..., n); 21 of them up to 5."""
    (i, j), (x, y) = EXPONENTS[degree].T, (powers(local[..., k], degree, d) for k, d in enumerate((dx, dy)))
    return x[..., i] * y[..., j]


def curvatures(hessian: np.ndarray) -> np.ndarray:
    """Curvatures (xx, yy, 2 xy) of shape functions, (n, n_q, 3, n_local), from (xx, xy, yy), (n, 3, n_q, n_local)."""
    return hessian[:, [0, 2, 1]].transpose(0, 2, 1, 3) * np.array([1.0, 1.0, 2.0])[:, None]


def area_coordinates(local: np.ndarray) -> np.ndarray:
    """Shares (n, 3) of the corners of a triangle in points (n, 2) of the reference triangle."""
    return np.column_stack([1.0 - local[:, 0] - local[:, 1], local])


class Bent:
    """Map that bends the triangles at curved facets onto the true curve and leaves the others straight."""

    def __init__(
        self, curves: Curves, facets: np.ndarray, cells: np.ndarray, sides: np.ndarray, vertices: np.ndarray
    ) -> None:
        self.curves, self.cells, self.sides = curves, cells, sides  # (n,) cell of each curved facet, and side of that
        corner = vertices[cells]  # (n, 3)
        self.start = (corner == facets[:, :1]).argmax(axis=1)  # (n,) corner of the cell at which the facet starts
        self.stop = (corner == facets[:, 1:]).argmax(axis=1)  # (n,) and ends
        self.of_side = np.full(vertices.shape, -1)  # (n_cells, 3) curved facet of every side, or -1
        self.of_side[cells, sides] = np.arange(len(cells))

    def shift(self, cells: np.ndarray, area: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement (n, n_q, 2) of cells (n,) at area coordinates (n, n_q, 3), and its gradient (n, n_q, 2, 3)."""
        moved, gradient = np.zeros((*area.shape[:2], 2)), np.zeros((*area.shape[:2], 2, 3))
        for side in range(3):
            here = np.flatnonzero(self.of_side[cells, side] >= 0)
            rows = self.of_side[cells[here], side]
            first, last, out = self.start[rows], self.stop[rows], self.curves.out[rows]
            a, b = area[here, :, first], area[here, :, last]
            p, dp = ((self.curves.p[rows][:, None] * powers(0.5 * (1.0 + b - a), 4, k)).sum(axis=2) for k in (0, 1))
            moved[here] += (a * b * p)[..., None] * out[:, None]
            gradient[here, :, :, first] += (b * (p - 0.5 * a * dp))[..., None] * out[:, None]
            gradient[here, :, :, last] += (a * (p + 0.5 * b * dp))[..., None] * out[:, None]
        return moved, gradient


class Triangles:
    """The triangles of one mesh and polynomials on them, with a search for the triangle of a point.

    Spaces of shape functions are kinds of it: they state the numbers and the element, and find ``coefficients``.
    """

    degree: int  # of the polynomials
    order: int  # of the quadrature
    element: type[Any]  # scikit-fem's class, which numbers the unknowns
    coefficients: np.ndarray  # (n_cells, n, n_local) of the monomials in each shape function
    per_corner: int  # unknowns at a corner: the deflection, and maybe its derivatives; one for each side follows them

    def __init__(self, mesh: Cells, bent: Bent | None = None) -> None:
        corners = mesh.p[:, mesh.t].transpose(2, 1, 0)  # (n_cells, 3, 2)
        self.corners, self.vertices, self.bent = corners, mesh.t.T, bent
        self.origin = corners.mean(axis=1)  # (n_cells, 2) centre
        # (n_cells, 2, 2) of the map from the reference triangle
        self.jacobian = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
        self.inverse: np.ndarray = np.linalg.inv(self.jacobian)
        along = np.stack([corners[:, q] - corners[:, p] for p, q in SIDES], axis=1)
        up = np.stack([self.vertices[:, p] < self.vertices[:, q] for p, q in SIDES], axis=1)
        along = along * np.where(up, 1.0, -1.0)[..., None]  # the two triangles of a side must agree
        # (n_cells, 3, 2) of the sides
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

    def rule(self) -> tuple[np.ndarray, np.ndarray]:
        """Quadrature of the reference triangle: points (n_q, 2) and weights (n_q,)."""
        X, weight = get_quadrature(self.element.refdom, self.order)
        return X.T, weight

    def straight(self, cells: np.ndarray, local: np.ndarray) -> np.ndarray:
        """Places (n, n_q, 2) of local coordinates (n_q, 2) in cells (n,), as if all sides were straight."""
        return self.origin[cells, None] + local @ self.jacobian[cells].transpose(0, 2, 1)

    def derivatives(self, cells: np.ndarray, points: np.ndarray, order: int, degree: int) -> np.ndarray:
        """Derivatives (n, order + 1, n_q, n_terms) by x and y of the monomials of cells (n,) at points (n, n_q, 2)."""
        local = self.local(cells, points)
        raw = np.stack([monomials(local, order - k, k, degree) for k in range(order + 1)], axis=1)
        flat = raw.reshape(*raw.shape[:2], raw.shape[2] * raw.shape[3])  # not -1: there may be no cells
        return (chain_rule(self.inverse[cells], order) @ flat).reshape(raw.shape)

    def bending_functions(self, cells: np.ndarray, points: np.ndarray, orders: tuple[int, ...]) -> list[np.ndarray]:
        """Derivatives of the shape functions of cells (n,) at points (n, n_q, 2), one array for each order.

        The arrays are (n, n_q, n_local) for order 0, (n, 2, n_q, n_local) for order 1, (n, 3, n_q, n_local) for order
        2: xx, xy, yy.
        """
        weights = self.coefficients[cells][:, None]
        found = [self.derivatives(cells, points, order, self.degree) @ weights for order in orders]
        return [each if order else each[:, 0] for each, order in zip(found, orders)]

    functions = bending_functions  # by all unknowns

    def rigid_unknowns(self, element_dofs: np.ndarray, n_all: int) -> np.ndarray:
        """Unknowns (n_all, 3) of the deflections 1, x and y, the rigid motions of a plate."""
        result = np.zeros((n_all, 3))
        for k in range(3):
            corner = element_dofs[self.per_corner * k :]
            result[corner[0], 0] = 1.0
            result[corner[0], 1:] = self.corners[:, k]
            if self.per_corner > 1:  # the slopes
                result[corner[1], 1] = result[corner[2], 2] = 1.0
            result[element_dofs[3 * self.per_corner + k], 1:] = self.normals[:, k]
        return result

    def jacobians(self, cells: np.ndarray, area: np.ndarray) -> np.ndarray:
        """Jacobians (n, n_q, 2, 2) of the map from the reference triangle at area coordinates (n or 1, n_q, 3)."""
        area = np.broadcast_to(area, (len(cells), *area.shape[1:]))
        plain = np.broadcast_to(self.jacobian[cells][:, None], (*area.shape[:2], 2, 2))
        if self.bent is None:
            return plain
        turned = self.bent.shift(cells, area)[1]
        return plain + turned[..., 1:] - turned[..., :1]

    def points_along(self, cells: np.ndarray, area: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
        count = min(8, len(self.origin))  # about those around a vertex; if none holds the point, all near are searched
        near = self.tree.query(points, k=count)[1].reshape(len(points), count)
        cell, depth = self._deepest(points, near)
        margin = np.full(len(self.origin), -SAME)
        if self.curved.any():
            size = np.sqrt(np.abs(np.linalg.det(self.jacobian)))
            margin = np.minimum(margin, -1e-5 * size[self.curved].max() / size)  # the mesh is as close to the curve
        lost = np.flatnonzero(depth < margin[cell])
        if lost.size:
            reach = 1.25 * np.linalg.norm(self.corners - self.origin[:, None], axis=2).max(axis=1)  # with its bulge
            around = cKDTree(points[lost]).query_ball_point(self.origin, reach)
            held = np.repeat(np.arange(len(reach)), [len(each) for each in around])
            who = lost[np.concatenate(around).astype(int)]
            deep = self._deepest(points[who], held[:, None])[1]
            order = np.flatnonzero(deep > depth[who])
            order = order[np.argsort(deep[order])]  # the deepest comes last, and counts
            cell[who[order]], depth[who[order]] = held[order], deep[order]
        return cell, depth >= margin[cell]

    def _deepest(self, points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The candidate cell (n, k) in which each point lies deepest, and how deep (smallest area coordinate)."""
        cells = np.broadcast_to(cells, (len(points), cells.shape[1]))
        offset = points[:, None] - self.origin[cells]
        local = np.einsum("nkij,nkj->nki", self.inverse[cells], offset) + 1.0 / 3.0
        depth = np.minimum(local.min(axis=2), 1.0 - local.sum(axis=2))
        near = self.curved[cells] & (depth > -0.5)  # facets bulge by less: an eighth of their turn, below 0.1
        first = depth == depth.max(axis=1, keepdims=True)
        for turn in (first, ~first):  # others hold no point that lies well inside the first
            bent = near & turn & (first | (depth.max(axis=1, keepdims=True) < 1e-3))
            if self.bent is None or not bent.any():
                continue
            which, away, place = cells[bent], offset[bent], local[bent]
            for _ in range(CURVE_STEPS):
                moved = self.bent.shift(which, area_coordinates(place)[:, None])[0][:, 0]
                place = np.einsum("nij,nj->ni", self.inverse[which], away - moved) + 1.0 / 3.0
                place = np.clip(place, -1.0, 2.0)  # points far away are outside anyway
            depth[bent] = np.minimum(place.min(axis=1), 1.0 - place.sum(axis=1))
        best = depth.argmax(axis=1)
        row = np.arange(len(points))
        return cells[row, best], depth[row, best]


class ArgyrisSpace(Triangles):
    """Quintic shape functions of all triangles of one mesh, in the local coordinates of each.

    scikit-fem inverts a Vandermonde matrix of monomials in physical coordinates, which becomes singular when elements
    are a thousand times smaller than the coordinates. This class first maps each triangle to the reference triangle
    and its unknowns to the reference directions.
    """

    degree = 5
    order = 10  # exact for products of quintics
    element = ElementTriArgyris
    per_corner = 6

    def __init__(self, mesh: Cells, bent: Bent | None = None) -> None:
        super().__init__(mesh, bent)
        # (n_cells, 3, 2) of the sides, on the true curve, as are the normals
        self.middles = np.stack([0.5 * (self.corners[:, p] + self.corners[:, q]) for p, q in SIDES], axis=1)
        if bent is not None:
            curved = bent.cells, bent.sides
            self.middles[curved], self.normals[curved] = bent.curves.middle()
        n, every = len(self.origin), np.arange(len(self.origin))
        functionals = np.zeros((n, 21, 21))
        turn = np.zeros((n, 21, 21))  # physical unknowns -> unknowns along the reference directions
        for k in range(3):
            at = self.local(every, self.corners[:, k])
            for row, (dx, dy) in enumerate(((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))):  # unknowns at a vertex
                functionals[:, 6 * k + row] = monomials(at, dx, dy)
            for order, own in enumerate((slice(1), slice(1, 3), slice(3, 6))):
                turn[:, 6 * k : 6 * k + 6, 6 * k : 6 * k + 6][:, own, own] = chain_rule(self.jacobian, order)
        for side in range(3):
            weight = np.einsum("eij,ej->ei", self.inverse, self.normals[:, side])  # in local coordinates
            size = np.linalg.norm(weight, axis=1)
            at = self.local(every, self.middles[:, side])
            row = weight[:, :1] * monomials(at, 1, 0) + weight[:, 1:] * monomials(at, 0, 1)
            functionals[:, 18 + side] = row / size[:, None]
            turn[:, 18 + side, 18 + side] = 1.0 / size
        self.coefficients = np.linalg.solve(functionals, turn)

    def uniform(self, cells: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Bending and mass matrices (n, 21, 21) of straight cells (n,) with uniform stiffness (3, 3) and unit inertia.

        The integrals of products of monomials are the same for all triangles, so they are computed once.
        """
        points, weight = self.rule()
        local = points - 1.0 / 3.0
        values = monomials(local, 0, 0)
        bends = np.stack([monomials(local, 2 - k, k) for k in range(3)])  # (3, n_q, 21)
        products = np.einsum("iqa,q,jqb->ijab", bends, weight, bends).reshape(9, 441)
        determinant = np.abs(np.linalg.det(self.jacobian[cells]))
        engineering = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, 2.0, 0]])  # (xx, xy, yy) -> (xx, yy, 2 xy)
        turn = engineering @ chain_rule(self.inverse[cells], 2)
        metric = turn.transpose(0, 2, 1) @ stiffness @ turn * determinant[:, None, None]
        C = self.coefficients[cells]
        bending = C.transpose(0, 2, 1) @ (metric.reshape(-1, 9) @ products).reshape(-1, 21, 21) @ C
        mass = C.transpose(0, 2, 1) @ (values.T * weight @ values) @ C
        return bending, mass * determinant[:, None, None]


class MorleySpace(Triangles):
    """Quadratic Morley shape functions of straight triangles: deflection at corners, slope at mid-sides.

    They are continuous only at those points and approach the frequencies from below, while Argyris elements approach
    them from above.
    """

    degree = 2
    order = 4  # exact for products of quadratics
    element = ElementTriMorley
    per_corner = 1

    def __init__(self, mesh: Cells, bent: Bent | None = None) -> None:
        super().__init__(mesh)
        functionals = np.zeros((len(self.origin), 6, 6))
        for k, corner in enumerate(REFERENCE):
            functionals[:, k] = monomials(corner[None], 0, 0, 2)
        for side, (p, q) in enumerate(SIDES):
            weight = np.einsum("eij,ej->ei", self.inverse, self.normals[:, side])
            x, y = (monomials(0.5 * (REFERENCE[p] + REFERENCE[q])[None], *by, 2) for by in ((1, 0), (0, 1)))
            functionals[:, 3 + side] = weight[:, :1] * x + weight[:, 1:] * y
        self.coefficients = np.linalg.inv(functionals)


def chain_rule(matrix: np.ndarray, order: int) -> np.ndarray:
    """Matrices (n, order + 1, order + 1) that turn derivatives of an order by coordinates into those by others.

    ``matrix`` (n, 2, 2) is how those change with these: the inverse Jacobian from local coordinates to x and y.
    """
    a, b, c, d = (matrix[:, i, j] for i, j in product(range(2), repeat=2))
    rows: list[list[Any]] = [
        [[np.ones(len(matrix))]],
        [[a, c], [b, d]],
        [[a * a, 2 * a * c, c * c], [a * b, a * d + b * c, c * d], [b * b, 2 * b * d, d * d]],
    ][order]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)


def triangles(points: np.ndarray, cells: np.ndarray) -> Cells:
    """Make scikit-fem's mesh of triangles."""
    return MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))


def triangle_gauss_points(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points (n**2, 2) of the reference triangle, so many in each direction, and their weights (n**2,)."""
    x, dx = gauss_rule(n)
    a, b = (each.ravel() for each in np.meshgrid(x, x, indexing="ij"))
    return np.column_stack([a, b * (1.0 - a)]), np.outer(dx, dx).ravel() * (1.0 - a)


def on_true_edge(space: Triangles, local: np.ndarray, weight: np.ndarray) -> Points:
    """Points (n_q, 2) of the reference triangle with their weights (n_q,) on every triangle."""
    cells, area = np.arange(len(space.origin)), area_coordinates(local)[None]
    x = space.points_along(cells, np.broadcast_to(area, (len(cells), *area.shape[1:])), np.zeros((1, 1, 3)))[0]
    J = space.jacobians(cells, area)
    return Points(local.T, x, np.abs(J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]) * weight)


def numbering(mesh: Cells, space: Any) -> tuple[np.ndarray, int]:
    """Numbers of the unknowns of each cell, (n_local, n_cells), and how many unknowns there are."""
    dofs = Dofs(mesh, space.element())  # a new object: scikit-fem's elements remember their first mesh
    return dofs.element_dofs, dofs.N
