"""Estimate the error of a finite element solution from its residual in the plate's equation of motion.

Three residuals are squared, weighted by powers of the element size and summed: that of ``div div M = inertia`` in the
triangles, the jumps of bending moment and effective shear force between triangles, and the violation of the natural
conditions at the edge. The sum is proportional to the energy error, and for quintic triangles the factor is nearly
the same for every plate (CALIBRATION). On a curved edge the supports hold the plate exactly only at vertices; the
work of the reactions on the motion in between is added. Where the thickness jumps within a triangle, so do the
moments, and what keeps them from any cubic is added, too.

References
----------
Verfuerth (2013), A posteriori error estimation techniques, ch. 1 and 3; Beirao da Veiga, Niiranen and Stenberg (2007),
Numer. Math. 106, 165-179, for Kirchhoff plates.
"""

from typing import Any

import numpy as np

from .._base.remembered import gauss_rule
from ..mesh.mesh_files import sides_of
from .elements import EXPONENTS, curvatures, monomials, triangle_gauss_points
from .springs import at_facets
from .supports import SIDES
from .system import System
from .theory import blocks, unknowns_of_cells

CALIBRATION = 33.0  # [-] weighted squares over the energy error: 20 to 45 for 20 kinds of plates; test_residual.py
DEGREE = 5  # polynomial degree of the elements
POINTS = 3  # [-] Gauss points on a side, and in each direction of a triangle: CALIBRATION was measured with this number
CUBIC = 3  # degree of the moments of a quintic deflection
# ten points inside the triangle, enough to define a cubic
NODES = 0.8 / 3.0 * EXPONENTS[CUBIC] + 0.2 / 3.0 - 1.0 / 3.0
HALVED = 3  # [-] times a triangle is divided in four to look at its thickness: a step is placed to an eighth of a side
FIT = np.linalg.inv(monomials(NODES, 0, 0, CUBIC))  # from values at NODES to the coefficients of the cubic


class Moments:
    """Bending moments of all triangles as cubic polynomials, their derivatives and the edge forces."""

    def __init__(self, system: System) -> None:
        space: Any = system.space
        self.space, self.n_cells = space, len(space.origin)
        cells = np.arange(self.n_cells)
        x = space.straight(cells, NODES)
        self.stiffness = system.frame.field(system.section, "stiffness", x)  # (n_cells, n_q, 3, 3)
        moment = self.stiffness @ curvatures(space.functions(cells, x, (2,))[0])  # (n_cells, n_q, 3, 21)
        self.coefficients = np.einsum("pq,eqrk->erpk", FIT, moment, optimize=True)  # (n_cells, 3, 10, 21) of the cubics

    def derivatives(self, cells: np.ndarray, x: np.ndarray, order: int) -> np.ndarray:
        """Derivatives (n, order + 1, 3, n_q, 21) of the moments xx, yy, xy of cells (n,) at points (n, n_q, 2)."""
        return self.space.derivatives(cells, x, order, CUBIC)[:, :, None] @ self.coefficients[cells][:, None]

    def edge_forces(self, cells: np.ndarray, x: np.ndarray, normal: np.ndarray, curvature: Any = 0.0) -> np.ndarray:
        """Bending moment and effective shear force (n, 2, n_q, 21) on edges with normals (n, n_q, 2)."""
        moment, slope = self.derivatives(cells, x, 0)[:, 0], self.derivatives(cells, x, 1)
        nx, ny = (normal[..., i, None] for i in range(2))
        bending = moment[:, 0] * nx**2 + moment[:, 1] * ny**2 + 2.0 * moment[:, 2] * nx * ny
        shear = (slope[:, 0, 0] + slope[:, 1, 2]) * nx + (slope[:, 0, 2] + slope[:, 1, 1]) * ny
        twist = (slope[:, :, 1] - slope[:, :, 0]) * (nx * ny)[:, None] + slope[:, :, 2] * (nx**2 - ny**2)[:, None]
        along = twist[:, 1] * nx - twist[:, 0] * ny  # of the twisting moment, along the tangent (-ny, nx)
        turned = curvature * (moment[:, 0] + moment[:, 1] - 2.0 * bending)  # normal and tangent turn on a curve
        return np.stack([bending, shear + along + turned], axis=1)

    def rigidity(self, cells: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Bending stiffness (n,) of cells across a direction (n, 2)."""
        nx, ny = normal.T
        bend = np.column_stack([nx**2, ny**2, 2.0 * nx * ny])
        return np.einsum("ei,eij,ej->e", bend, self.stiffness[cells].mean(axis=1), bend)


def _look_points() -> np.ndarray:
    """Local coordinates (n, 2) of the centres of the 4**HALVED equal parts of a triangle."""
    n = 2**HALVED
    i, j = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    up = np.column_stack([i, j])[i + j < n] + 1.0 / 3.0
    down = np.column_stack([i, j])[i + j < n - 1] + 2.0 / 3.0
    return np.vstack([up, down]) / n - 1.0 / 3.0


class Residual:
    """Residuals of a plate's solutions, as linear operators on the unknowns of each triangle and side."""

    def __init__(self, system: System) -> None:
        self.system, self.moments = system, Moments(system)
        self._set_cells()
        self._set_sides()
        self._set_rim()
        self._set_steps()

    def _set_cells(self) -> None:
        space, frame = self.moments.space, self.system.frame
        cells = np.arange(self.moments.n_cells)
        local, share = triangle_gauss_points(POINTS)
        x = space.straight(cells, local - 1.0 / 3.0)
        second = self.moments.derivatives(cells, x, 2)
        double = np.abs(np.linalg.det(space.jacobian))  # twice the area
        stiffness = self.moments.stiffness.mean(axis=1)
        rigidity = np.sqrt(stiffness[:, 0, 0] * stiffness[:, 1, 1])
        scale = np.sqrt(double[:, None] * share / rigidity[:, None]) * double[:, None] / DEGREE**2
        inertia, value = frame.field(self.system.section, "inertia", x), space.functions(cells, x, (0,))[0]
        self.inertia = (scale * inertia)[..., None] * value  # (n_cells, n_q, 21)
        balance = second[:, 0, 0] + 2.0 * second[:, 1, 2] + second[:, 2, 1]
        section: Any = self.system.section
        if section.tension:
            curve = space.functions(cells, x, (2,))[0]
            pull = section.tension * frame.length**2 / frame.stiffness
            balance = balance - pull * (curve[:, 0] + curve[:, 2])
        self.balance = scale[..., None] * balance  # (n_cells, n_q, 21) what the moments leave of a load

    def _set_sides(self) -> None:
        space = self.moments.space
        number = sides_of(space.vertices)[1].ravel()
        order = np.argsort(number, kind="stable")
        shared = np.flatnonzero(np.diff(number[order]) == 0)
        first, second = order[shared], order[shared + 1]
        self.beside = np.column_stack([first // 3, second // 3])  # (n_sides, 2) cells
        corners = space.corners
        start, stop = (corners[first // 3, np.array(SIDES)[first % 3, end]] for end in (0, 1))
        length = np.linalg.norm(stop - start, axis=1)
        along = (stop - start) / length[:, None]
        normal = np.column_stack([along[:, 1], -along[:, 0]])
        part, weight = gauss_rule(POINTS)
        x = start[:, None] + part[:, None] * (stop - start)[:, None]
        every = np.broadcast_to(normal[:, None], x.shape)
        jump = [self.moments.edge_forces(self.beside[:, k], x, every) for k in range(2)]  # (n_sides, 2, n_q, 21)
        rigidity = np.mean([self.moments.rigidity(self.beside[:, k], normal) for k in range(2)], axis=0)
        size = length[:, None] / DEGREE * np.column_stack([np.ones(len(length)), (length / DEGREE) ** 2])
        scale = np.sqrt(0.5 * size[..., None] * length[:, None, None] * weight / rigidity[:, None, None])
        jumps = np.concatenate([jump[0], -jump[1]], axis=3) * scale[..., None]
        self.jumps = jumps.reshape(len(shared), -1, 42)  # (n_sides, 2 n_q, 42) of moment and force

    def _set_rim(self) -> None:
        space, rim = self.moments.space, self.system.rim
        assert rim is not None
        self.rim_cells, _, x, ds, normal = at_facets(space, rim.facets)
        force = self.moments.edge_forces(self.rim_cells, x, normal, rim.curvatures.mean(axis=1)[:, None, None])
        kinds = np.array(rim.kinds)
        length = ds.sum(axis=1)
        rigidity = self.moments.rigidity(self.rim_cells, normal.mean(axis=1))
        part = length / DEGREE
        size = part[:, None] * np.column_stack([kinds != "clamped", (kinds == "free") * part**2])
        scale = np.sqrt(size[..., None] * ds[:, None] / rigidity[:, None, None])
        value, slope = space.functions(self.rim_cells, x, (0, 1))
        turn = np.einsum("fqi,fiqk->fqk", normal, slope)
        held_by = rim.springs[:, ::-1, None, None] * np.stack([turn, -value], axis=1)
        # (n_facets, 2 n_q, 21) of what a free edge asks, and (n_facets, 2, n_q, 21) of what a held one forbids
        self.missed = ((force + held_by) * scale[..., None]).reshape(len(ds), -1, 21)
        held = np.stack([kinds != "free", kinds == "clamped"], axis=1)[:, :, None, None]
        self.moved = np.stack([value, -turn], axis=1) * held * ds[:, None, :, None]
        self.reaction = force[:, ::-1]  # the shear force does work on the deflection, the moment on the slope

    def _set_steps(self) -> None:
        """A deflection that is smooth where the stiffness jumps makes the moments jump, which true ones do not.

        Nor does the quadrature of the matrices place a step exactly.
        """
        space, looks = self.moments.space, _look_points()
        places, weight = space.rule()
        places = places - 1.0 / 3.0
        self.stepped = np.zeros(0, int)  # (n,) cells across which the thickness jumps
        section: Any = self.system.section
        if callable(section.thickness):
            every = np.vstack([looks, places])
            fit = monomials(every, 0, 0, CUBIC)
            x = space.straight(np.arange(self.moments.n_cells), every)
            thickness = self.system.frame.field(section, "inertia", x)
            missed = thickness - (thickness @ np.linalg.pinv(fit).T) @ fit.T
            # a step: with more than a hundredth beside any cubic, the moments are no cubics either
            self.stepped = np.flatnonzero(np.abs(missed).max(axis=1) > 0.01 * thickness.max(axis=1))
        if not len(self.stepped):
            self.uneven, self.misplaced = np.zeros((0, 0, 21)), np.zeros((2, 0, 21, 21))
            return
        bent, root, placed = self._energies(looks, np.full(len(looks), 0.5 / len(looks)))
        smooth = np.linalg.inv(root)[..., None] * monomials(looks, 0, 0, CUBIC)[:, None, None]  # (n, n_q, 3, 3, 10)
        basis = np.linalg.qr(smooth.reshape(*bent.shape[:2], -1))[0]
        # (n, 3 n_q, 21) of their moments, beside any cubic, and (2, n, 21, 21) of both matrices
        self.uneven = bent - basis @ (basis.transpose(0, 2, 1) @ bent)
        self.misplaced = placed - self._energies(places, weight)[2]

    def _energies(self, local: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of stepped cells: roots of strain energy (n, 3 n_q, 21) and stiffness, and both matrices (2, n, 21, 21)."""
        space, cells = self.moments.space, self.stepped
        frame, section, x = self.system.frame, self.system.section, space.straight(cells, local)
        stiffness, inertia = (frame.field(section, name, x) for name in ("stiffness", "inertia"))
        dx = weight * np.abs(np.linalg.det(space.jacobian[cells]))[:, None]
        root = np.linalg.cholesky(stiffness)  # (n, n_q, 3, 3)
        value, second = space.functions(cells, x, (0, 2))
        bent = root.transpose(0, 1, 3, 2) @ curvatures(second) * np.sqrt(dx)[..., None, None]
        bent = bent.reshape(len(cells), -1, 21)
        mass = (value * (inertia * dx)[..., None]).transpose(0, 2, 1) @ value
        return bent, root, np.stack([bent.transpose(0, 2, 1) @ bent, mass])


def energy_errors(
    system: System, vectors: np.ndarray, loads: np.ndarray, forced: np.ndarray | None = None
) -> np.ndarray:
    """Estimated error of the squared energy norm of solutions for a thin plate, (3, n).

    The first row is the error of the elements, which falls with the eighth power of their size if the solution is
    smooth. The second comes from supports on curved edges, which let the plate move between their nodes; it falls with
    the fifth or sixth power. The third comes from steps of the thickness within triangles; it falls with the first.

    Parameters
    ----------
    system : System, not of Morley elements
    vectors : ndarray, shape (n_dofs, n), the solutions
    loads : ndarray, shape (n_dofs, n), fields whose inertia drives the solutions; for a mode, its eigenvalue times it
    forced : ndarray, shape (n, dimension) [m], optional
        Points where an additional unit force acts, one for each solution.
    """
    of, found = Residual(system), []
    for block in blocks(vectors.shape[1], 128):  # to limit memory
        unknowns, pushed = (unknowns_of_cells(system, field[:, block]) for field in (vectors, loads))
        total = _squares(of.inertia @ pushed - of.balance @ unknowns)
        total += _squares(of.jumps @ unknowns[of.beside].reshape(len(of.beside), 42, -1))
        at_rim = unknowns[of.rim_cells]
        total += _squares(of.missed @ at_rim)
        moved, reaction = (operator @ at_rim[:, None] for operator in (of.moved, of.reaction))
        rim = 2.0 * np.abs(np.einsum("fiqk,fiqk->ik", moved, reaction)).sum(axis=0)
        across, load = unknowns[of.stepped], pushed[of.stepped]
        stiff, heavy = (np.einsum("eik,eij,ejk->k", one, m, across) for one, m in zip((across, load), of.misplaced))
        steps = _squares(of.uneven @ across) + np.abs(stiff - heavy)
        found.append(np.stack([total / CALIBRATION, rim, steps]))
    return np.concatenate(found, axis=1)


def _squares(values: np.ndarray) -> np.ndarray:
    """Sum of squares over all but the last axis."""
    return np.einsum("eqk,eqk->k", values, values)
