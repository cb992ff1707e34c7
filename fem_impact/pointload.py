"""What a plate gives under a point load: the logarithmic dip in closed form, the elements carry the smooth rest."""

from typing import Any

import numpy as np

from .assembly import System, assemble
from .eigen import Flexibility
from .section import Plate
from .supports import cells_of_facets

FACET_POINTS = 12  # [-] Gauss points on a boundary facet; S is smooth there unless the load is on the edge
CELL_POINTS = 6  # [-] Gauss points along each direction of a triangle: exact to degree 10, as in the assembly
DIP_POINTS = 10  # [-] the same for the dip itself, whose third derivative is infinite under the load
DISTINCT = 1e-4  # [-] roots nearer to each other than this leave the anisotropic form no digits
CREDIBLE = 1.05  # [-] largest correction to the elements' own answer that is believed beside graded corners
NEAREST = 0.02  # [-] of a facet: nearer to the edge the dip is as rough there as the load itself: nothing is gained
REFERENCE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])


def applies(system: System) -> bool:
    """Whether the closed form covers the body: a plate of constant thickness and nothing attached to it."""
    plate = system.section
    if system.point_masses or any(not isinstance(kind, str) for kind in system.supports.values()):
        return False
    if not isinstance(plate, Plate) or system.element != "argyris" or callable(plate.thickness) or plate.tension:
        return False
    roots = _characteristic(plate.material.plane_stress)
    return plate.material.E_across is None or abs(roots[0] - roots[1]) > DISTINCT


def _characteristic(C: np.ndarray) -> np.ndarray:
    """The two mu with positive imaginary part for which any f(x + mu y) is a free deflection of the plate."""
    roots = np.roots([C[1, 1], 4 * C[1, 2], 2 * C[0, 1] + 4 * C[2, 2], 4 * C[0, 2], C[0, 0]])
    return roots[roots.imag > 0.0]


class Dip:
    """Deflection of an infinite plate under a unit force at the origin, and its derivatives up to the third.

    Isotropic: r**2 log(r) / 8 pi. Otherwise 2 Re sum of A z**2 log(z) over z = x + mu y, where the A make deflection,
    slope and curvature single-valued and the shear force carry the load.
    """

    def __init__(self, C: np.ndarray, isotropic: bool) -> None:
        """C : (3, 3) bending stiffness on the curvatures xx, yy and 2 xy."""
        self.C = C
        self.mu = None if isotropic else _characteristic(C)
        if self.mu is not None:
            conditions = np.array([np.concatenate([(self.mu**k).imag, (self.mu**k).real]) for k in range(4)])
            parts = np.linalg.solve(conditions, [0.0, 0.0, 0.0, 1.0 / (8.0 * np.pi * C[1, 1])])
            self.weight = parts[:2] + 1j * parts[2:]

    def __call__(self, offset: np.ndarray) -> tuple[np.ndarray, ...]:
        """Value (...), gradient (..., 2), Hessian (..., 2, 2), third derivatives (..., 2, 2, 2) at offsets (..., 2)."""
        if self.mu is None:
            return self._isotropic(offset)
        z = offset[..., :1] + self.mu * offset[..., 1:]  # (..., 2)
        log = np.log(z)
        slope = np.stack([np.ones(2), self.mu])  # of z along x and y, (2, 2 roots)
        value = 2.0 * (self.weight * z**2 * log).sum(axis=-1).real
        gradient = 2.0 * np.einsum("...m,im->...i", self.weight * (2.0 * z * log + z), slope).real
        hessian = 2.0 * np.einsum("...m,im,jm->...ij", self.weight * (2.0 * log + 3.0), slope, slope).real
        third = 2.0 * np.einsum("...m,im,jm,km->...ijk", self.weight * 2.0 / z, slope, slope, slope).real
        return value, gradient, hessian, third

    def _isotropic(self, offset: np.ndarray) -> tuple[np.ndarray, ...]:
        square = (offset**2).sum(axis=-1)
        log = 0.5 * np.log(square)
        unit = offset / np.sqrt(square)[..., None]
        value = square * log
        gradient = (2.0 * log + 1.0)[..., None] * offset
        hessian = (2.0 * log + 1.0)[..., None, None] * np.eye(2) + 2.0 * unit[..., :, None] * unit[..., None, :]
        one = np.einsum("...i,jk->...ijk", unit, np.eye(2))
        even = one + np.moveaxis(one, -3, -2) + np.moveaxis(one, -3, -1)
        third = 2.0 * even - 4.0 * np.einsum("...i,...j,...k->...ijk", unit, unit, unit)
        factor = 8.0 * np.pi * self.C[0, 0]
        third /= np.sqrt(square)[..., None, None, None]
        return tuple(x / factor for x in (value, gradient, hessian, third))

    def edge_forces(self, offset: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Bending moment vector (..., 2) and shear force (...) on an edge of a given normal (..., 2)."""
        hessian, third = self(offset)[2:]
        moment = _tensor(self.C, hessian)
        shear = np.stack([_tensor(self.C, third[..., k]) for k in range(2)], axis=-1)  # (..., i, j, k) derivative k
        force = np.einsum("...ijj->...i", shear)
        return np.einsum("...ij,...j->...i", moment, normal), np.einsum("...i,...i->...", force, normal)


def _tensor(C: np.ndarray, hessian: np.ndarray) -> np.ndarray:
    """Moments (..., 2, 2) under curvatures (..., 2, 2)."""
    voigt = np.stack([hessian[..., 0, 0], hessian[..., 1, 1], 2.0 * hessian[..., 0, 1]], axis=-1)
    xx, yy, xy = np.moveaxis(voigt @ C, -1, 0)
    return np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)


def _place(space: Any, cells: np.ndarray, area: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, n_q, 2) of cells at area coordinates (n, n_q, 3) on the true shape, and their gradient (..., 2, 3)."""
    corners = space.origin[cells, None] + (REFERENCE - 1.0 / 3.0) @ space.jacobian[cells].transpose(0, 2, 1)
    x = area @ corners
    gradient = np.broadcast_to(corners.transpose(0, 2, 1)[:, None], (*x.shape, 3))
    if space.bent is None:
        return x, gradient
    moved, turned = space.bent.shift(cells, area)
    return x + moved, gradient + turned


class Edge:
    """The boundary of a body as its elements see it: quadrature, shape functions and what is held."""

    def __init__(self, system: System) -> None:
        rim: Any = system.rim
        space: Any = system.space
        self.cells, self.sides = cells_of_facets(rim.facets, space.vertices)
        node, weight = np.polynomial.legendre.leggauss(FACET_POINTS)
        s = 0.5 * (node + 1.0)[:, None]
        corner = space.vertices[self.cells][:, None]  # (n_facets, 1, 3)
        first, last = (np.equal(corner, rim.facets[:, end, None, None]).astype(float) for end in (0, 1))
        self.x, gradient = _place(space, self.cells, (1.0 - s) * first + s * last)
        tangent = (gradient @ (last - first)[..., None])[..., 0]  # (n_facets, n_q, 2)
        self.normal = np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1) * 0.5 * weight[:, None]  # n ds
        self.value, self.slope = space.functions(self.cells, self.x, (0, 1))
        self.dofs = system.element_dofs[:, self.cells]  # (21, n_facets)
        self.lengths = np.linalg.norm(self.normal, axis=2).sum(axis=1)
        self.held = np.array([kind != "free" for kind in rim.kinds])
        self.points = rim.points
        self.held_vertex = np.full(len(rim.points), False)
        self.held_vertex[rim.facets[self.held]] = True
        self.layer = np.flatnonzero(self.held_vertex[space.vertices].any(axis=1))
        plate: Any = system.section
        C = plate.stiffness(np.zeros((1, 2)))[0] / system.frame.stiffness
        self.dip = Dip(C, plate.material.E_across is None)
        self.bending = np.zeros((0, 21, 21))
        if self.layer.size:
            self.bending = _bending(system, Cells(system, self.layer, CELL_POINTS), C)


class Cells:
    """Quadrature inside some cells on their true shape."""

    def __init__(self, system: System, cells: np.ndarray, n_points: int) -> None:
        node, weight = np.polynomial.legendre.leggauss(n_points)
        a, b = np.meshgrid(0.5 * (node + 1.0), 0.5 * (node + 1.0), indexing="ij")
        w = 0.25 * np.outer(weight * (1.0 - a[:, 0]), weight).ravel()
        u, v = a.ravel(), (b * (1.0 - a)).ravel()
        area = np.broadcast_to(np.column_stack([1.0 - u - v, u, v]), (len(cells), len(w), 3))
        self.cells = cells
        self.x, gradient = _place(system.space, cells, area)
        self.dx = np.abs(np.linalg.det(gradient[..., 1:] - gradient[..., :1])) * w  # (n, n_q)


def _bending(system: System, inside: Cells, C: np.ndarray) -> np.ndarray:
    """Stiffness matrices (n, 21, 21) of some cells."""
    space: Any = system.space
    hessian = space.functions(inside.cells, inside.x, (2,))[0][:, [0, 2, 1]].transpose(0, 2, 1, 3)  # (n, n_q, 3, 21)
    bend = hessian * np.array([1.0, 1.0, 2.0])[:, None]
    shape = (len(inside.cells), -1, 21)
    moment = (inside.dx[..., None, None] * C) @ bend
    return bend.reshape(shape).transpose(0, 2, 1) @ moment.reshape(shape)


def static_compliance(system: System, flexibility: Flexibility, points: np.ndarray) -> np.ndarray:
    """Static compliance (n_points, n_points) [m/N] of a body at points (n_points, dimension) [m].

    Where the closed form does not cover a plate, what its elements miss under the point itself is taken from a plate
    on the same mesh that has the thickness found there all over: the dip is local.
    """
    unit = 1.0 / (system.frame.mass * system.frame.rate**2)
    if applies(system):
        return unit * compliance(system, flexibility, points)
    rows = system.interpolate(points)
    result = unit * (rows @ flexibility.solve(rows.toarray().T))
    if isinstance(system.section, Plate) and system.element == "argyris":
        result[np.diag_indices(len(points))] += [_missed(system, point[None]) for point in points]
    return 0.5 * (result + result.T)


def _missed(system: System, point: np.ndarray) -> float:
    """Static compliance [m/N] that the elements miss under a force at a point (1, 2) [m]."""
    plate: Any = system.section
    thickness = float(plate.inertia(point)[0]) / plate.material.rho
    supports = {name: kind if isinstance(kind, str) else "free" for name, kind in system.supports.items()}
    twin = assemble(system.mesh, Plate(plate.material, thickness), supports, graded=system.graded)
    if not applies(twin):
        return 0.0
    flexibility = Flexibility(twin.K, twin.M, twin.rigid, twin.held)
    rows = twin.interpolate(point)
    plain = float((rows @ flexibility.solve(rows.toarray().T))[0, 0])
    return (float(compliance(twin, flexibility, point)[0, 0]) - plain) / (twin.frame.mass * twin.frame.rate**2)


def compliance(system: System, flexibility: Flexibility, points: np.ndarray) -> np.ndarray:
    """Static compliance (n_points, n_points) in the units of the frame, at points (n_points, 2) [m].

    The deflection is the dip of an infinite plate plus a smooth rest without a load inside, which the elements carry:
    it is driven from the boundary by what the dip does there. Under a force close to the edge the rest is no smoother
    than the whole, and the elements carry it all.

    Parameters
    ----------
    system : System for which `applies`
    flexibility : Flexibility of the system
    points : ndarray, shape (n_points, 2) [m]

    References
    ----------
    Timoshenko and Woinowsky-Krieger, Theory of plates and shells, art. 19 and 76, and Lekhnitskii, Anisotropic
    plates, ch. 9, for the dip; Green's second identity for the boundary terms.
    """
    local = system.frame.local(points)
    rows = system.interpolate(points)
    result = rows @ flexibility.solve(rows.toarray().T)
    edge = Edge(system)
    for j, point in enumerate(local):
        distance = np.linalg.norm(edge.x - point, axis=2).min(axis=1)
        if distance.min() > NEAREST * edge.lengths[distance.argmin()]:
            column = _column(system, flexibility, edge, local, point, rows)
            # elements alone err by a percent and from below; where triangles shrink to corners by many orders, the
            # dip cancels in them and its rounding shows
            if system.strain is None or 1.0 - 1e-6 < column[j] / result[j, j] < CREDIBLE:
                result[:, j] = column
    return 0.5 * (result + result.T)


def _column(
    system: System, flexibility: Flexibility, edge: Edge, local: np.ndarray, point: np.ndarray, rows
) -> np.ndarray:
    """Deflection (n_points,) at local points under a unit force at one of them."""
    bent, force = edge.dip.edge_forces(edge.x - point, edge.normal)
    driven = np.einsum("fqi,fiqk->kf", bent, edge.slope) - np.einsum("fq,fqk->kf", force, edge.value)
    load = np.zeros(system.expand.shape[0])
    np.subtract.at(load, edge.dofs, driven)
    lifted = np.zeros(len(load))
    if edge.held.any():
        lifted = _jets(system, edge, point)
        dofs = system.element_dofs[:, edge.layer]
        np.add.at(load, dofs, np.einsum("eab,be->ae", edge.bending, lifted[dofs]))
    rest = flexibility.solve((system.expand.T @ load)[:, None])[:, 0]
    offset = local - point
    apart = (offset**2).sum(axis=1) > 0.0
    dip = np.zeros(len(local))
    dip[apart] = edge.dip(offset[apart])[0]
    cell = system.space.locate(local)[0]
    shape = system.space.functions(cell, local[:, None], (0,))[0][:, 0]
    total = dip - np.einsum("nk,kn->n", shape, lifted[system.element_dofs[:, cell]]) + rows @ rest
    if system.rigid.shape[1]:
        total = total - (rows @ system.rigid) @ _rigid_share(system, edge, point, lifted)
    return total


def _rigid_share(system: System, edge: Edge, point: np.ndarray, lifted: np.ndarray) -> np.ndarray:
    """Rigid motions (n_rigid,) in what the elements do not carry: the dip less its values at the held edges."""
    space: Any = system.space
    inside = Cells(system, np.arange(len(space.vertices)), DIP_POINTS)
    carried = edge.dip(inside.x - point)[0]  # (n_cells, n_q)
    values = space.functions(inside.cells, inside.x, (0,))[0]  # (n_cells, n_q, 21)
    if edge.held.any():
        carried = carried - np.einsum("eqk,ke->eq", values, lifted[system.element_dofs])
    motions = (system.expand @ system.rigid)[system.element_dofs]  # (21, n_cells, n_rigid)
    return np.einsum("eq,eqk,ker->r", carried * inside.dx, values, motions, optimize=True)


def _jets(system: System, edge: Edge, point: np.ndarray) -> np.ndarray:
    """Unknowns (n_all,) of a function that has the dip's value, slope and curvature at every held vertex."""
    jets = np.zeros(system.expand.shape[0])
    space: Any = system.space
    vertices = edge.points
    for k in range(3):
        vertex = space.vertices[:, k]
        cells = np.flatnonzero(edge.held_vertex[vertex])
        value, slope, curve = edge.dip(vertices[vertex[cells]] - point)[:3]
        table = [value, slope[:, 0], slope[:, 1], curve[:, 0, 0], curve[:, 0, 1], curve[:, 1, 1]]
        for row, entry in enumerate(table):
            jets[system.element_dofs[6 * k + row, cells]] = entry
    facets = np.flatnonzero(edge.held)
    cells, sides = edge.cells[facets], edge.sides[facets]
    slope = edge.dip(space.middles[cells, sides] - point)[1]
    jets[system.element_dofs[18 + sides, cells]] = (slope * space.normals[cells, sides]).sum(axis=1)
    return jets
