"""What a plate gives under a point load: the logarithmic dip in closed form, the elements carry the smooth rest."""

from typing import Any

import numpy as np

from .assembly import System
from .eigen import Flexibility
from .section import Plate
from .supports import cells_of_facets

FACET_POINTS = 12  # [-] Gauss points on a boundary facet; S is smooth there unless the load is on the edge
CELL_POINTS = 6  # [-] Gauss points along each direction of a triangle: exact to degree 10, as in the assembly
NEAREST = 0.02  # [-] of a facet: nearer to the edge the dip is as rough there as the load itself: nothing is gained
REFERENCE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])


def applies(system: System) -> bool:
    """Whether the closed form covers the body: an isotropic plate of constant thickness and nothing attached to it."""
    plate = system.section
    if system.point_masses or any(not isinstance(kind, str) for kind in system.supports.values()):
        return False
    if not isinstance(plate, Plate) or system.element != "argyris":
        return False
    return not callable(plate.thickness) and plate.material.E_across is None and plate.tension == 0.0


def _dip(offset: np.ndarray) -> tuple[np.ndarray, ...]:
    """The dip r**2 log(r) / 8 pi of an infinite plate of unit rigidity and what follows from it.

    offset (..., 2) from the load; returns value (...), gradient (..., 2), Hessian (..., 2, 2), gradient of the
    Laplacian (..., 2), and the gradient (..., 2) and value of a U whose Laplacian is the dip.
    """
    square = (offset**2).sum(axis=-1)
    log = 0.5 * np.log(square)
    outer = offset[..., :, None] * offset[..., None, :] / square[..., None, None]
    value = square * log
    gradient = (2.0 * log + 1.0)[..., None] * offset
    hessian = (2.0 * log + 1.0)[..., None, None] * np.eye(2) + 2.0 * outer
    laplacian_slope = 4.0 * offset / square[..., None]
    potential = square**2 * (log / 16.0 - 1.0 / 32.0)
    potential_slope = (square * (log / 4.0 - 1.0 / 16.0))[..., None] * offset
    return tuple(x / (8.0 * np.pi) for x in (value, gradient, hessian, laplacian_slope, potential_slope, potential))


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
        self.bending = _bending(system, self.layer) if self.layer.size else np.zeros((0, 21, 21))


def _bending(system: System, cells: np.ndarray) -> np.ndarray:
    """Stiffness matrices (n, 21, 21) of some cells."""
    node, weight = np.polynomial.legendre.leggauss(CELL_POINTS)
    a, b = np.meshgrid(0.5 * (node + 1.0), 0.5 * (node + 1.0), indexing="ij")
    w = 0.25 * np.outer(weight * (1.0 - a[:, 0]), weight).ravel()
    u, v = a.ravel(), (b * (1.0 - a)).ravel()
    area = np.broadcast_to(np.column_stack([1.0 - u - v, u, v]), (len(cells), len(w), 3))
    x, gradient = _place(system.space, cells, area)
    dx = np.abs(np.linalg.det(gradient[..., 1:] - gradient[..., :1])) * w
    hessian = system.space.functions(cells, x, (2,))[0][:, [0, 2, 1]].transpose(0, 2, 1, 3)  # (n, n_q, 3, 21)
    bend = hessian * np.array([1.0, 1.0, 2.0])[:, None]
    C = system.section.stiffness(np.zeros((1, 2)))[0] / system.frame.stiffness
    shape = (len(cells), -1, 21)
    moment = (dx[..., None, None] * C) @ bend
    return bend.reshape(shape).transpose(0, 2, 1) @ moment.reshape(shape)


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
    Timoshenko and Woinowsky-Krieger, Theory of plates and shells, art. 19 and 76, for the dip; Green's second
    identity of the bi-Laplacian for the boundary terms.
    """
    local = system.frame.local(points)
    rows = system.interpolate(points)
    result = rows @ flexibility.solve(rows.toarray().T)
    edge = Edge(system)
    if system.rigid.shape[1] and edge.held.any():
        return 0.5 * (result + result.T)  # the rigid share of what the boundary carries has no closed form
    for j, point in enumerate(local):
        distance = np.linalg.norm(edge.x - point, axis=2).min(axis=1)
        if distance.min() > NEAREST * edge.lengths[distance.argmin()]:
            result[:, j] = _column(system, flexibility, edge, local, point, rows)
    return 0.5 * (result + result.T)


def _column(
    system: System, flexibility: Flexibility, edge: Edge, local: np.ndarray, point: np.ndarray, rows
) -> np.ndarray:
    """Deflection (n_points,) at local points under a unit force at one of them."""
    curve, shear, potential_slope, potential = _dip(edge.x - point)[2:]
    nu = system.section.material.nu
    moment = (1.0 - nu) * curve + nu * np.trace(curve, axis1=2, axis2=3)[..., None, None] * np.eye(2)
    bent = np.einsum("fqij,fqj->fqi", moment, edge.normal)
    force = np.einsum("fqi,fqi->fq", shear, edge.normal)
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
    dip[apart] = _dip(offset[apart])[0]
    cell = system.space.locate(local)[0]
    shape = system.space.functions(cell, local[:, None], (0,))[0][:, 0]
    total = dip - np.einsum("nk,kn->n", shape, lifted[system.element_dofs[:, cell]]) + rows @ rest
    if system.rigid.shape[1]:  # linear shapes: Green's identity turns the integral of the dip into one along the edge
        at = edge.x.reshape(-1, 2)
        corners = system.mesh.points[system.mesh.cells[0]]
        plane = np.column_stack([np.ones(3), system.frame.local(corners)])
        motions = np.linalg.solve(plane, system.interpolate(corners) @ system.rigid)  # (3, n_rigid): 1, x, y
        values = (motions[0] + at @ motions[1:]).reshape(*edge.x.shape[:2], -1)
        flux = np.einsum("fqi,fqi->fq", potential_slope, edge.normal)
        share = np.einsum("fq,fqr->r", flux, values) - np.einsum("fq,fqi,ir->r", potential, edge.normal, motions[1:])
        total = total - (rows @ system.rigid) @ share
    return total


def _jets(system: System, edge: Edge, point: np.ndarray) -> np.ndarray:
    """Unknowns (n_all,) of a function that has the dip's value, slope and curvature at every held vertex."""
    jets = np.zeros(system.expand.shape[0])
    space: Any = system.space
    vertices = edge.points
    for k in range(3):
        vertex = space.vertices[:, k]
        cells = np.flatnonzero(edge.held_vertex[vertex])
        value, slope, curve = _dip(vertices[vertex[cells]] - point)[:3]
        table = [value, slope[:, 0], slope[:, 1], curve[:, 0, 0], curve[:, 0, 1], curve[:, 1, 1]]
        for row, entry in enumerate(table):
            jets[system.element_dofs[6 * k + row, cells]] = entry
    facets = np.flatnonzero(edge.held)
    cells, sides = edge.cells[facets], edge.sides[facets]
    slope = _dip(space.middles[cells, sides] - point)[1]
    jets[system.element_dofs[18 + sides, cells]] = (slope * space.normals[cells, sides]).sum(axis=1)
    return jets
