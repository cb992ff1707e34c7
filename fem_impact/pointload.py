"""What a body gives under forces at points: a solution on elements that shrink towards them."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _check, beam_elements, residual
from .assembly import System, assemble
from .eigen import Flexibility
from .mesh import Mesh

CELLS = 600  # [-] triangles of the mesh to begin with, about
GOAL = 1e-5  # [-] relative error of the compliance that ends the refinement
ROUNDS = 3  # [-] meshes tried for it, each with elements half as large
ROUNDING = 1e-7  # [-] of a plate's compliance, left by the smallest triangles; of a beam's, see `beam_elements`
RESTS = 1e-15  # [-] compliance in the frame below which a point rests on a support


@dataclass(frozen=True, eq=False)
class Deflection:
    """Static deflections of a body under unit forces at points, one at a time.

    A body that can move rigidly balances its load by inertia, and the deflection is free of rigid motion.
    """

    system: System  # with elements that shrink towards the points
    loads: np.ndarray  # (n_loads, dimension) [m] where the forces act
    vectors: np.ndarray  # (n_dofs, n_loads) [-] in the frame of the system
    compliance: np.ndarray  # (n_loads, n_loads) [m/N] deflection at each load under each
    error: np.ndarray  # (n_loads,) [-] estimated relative error of its diagonal

    def __post_init__(self) -> None:
        _check.lock_arrays(self)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Deflection [m/N] at points (n_points, dimension) [m] under each load, (n_points, n_loads)."""
        unit = self.system.frame.mass * self.system.frame.rate**2
        return np.asarray(self.system.interpolate(points) @ self.vectors) / unit


def static_deflection(system: System, loads: np.ndarray) -> Deflection:
    """Deflections under unit forces at points (n_loads, dimension) [m] of a body, edges and corners included.

    A coarse mesh does: the deflection is smooth but for the dip under the force, which the shrinking elements resolve
    wherever it is. Where the estimated error is too large nevertheless, finer ones follow.
    """
    mesh = _coarse(system.mesh)
    best: Any = None
    for _ in range(ROUNDS):
        found = _solved(system, mesh, loads)
        if best is None or found.error.max() < best.error.max():
            best = found
        if best.error.max() <= GOAL or mesh.recipe is None:
            break
        mesh = mesh.refined(2.0)
    return best


def _coarse(mesh: Mesh) -> Mesh:
    """The body with few triangles, or its own ones where they cannot be replaced."""
    if mesh.recipe is None or mesh.dimension == 1 or len(mesh.cells) <= 2 * CELLS:
        return mesh
    coarse = mesh.refined((CELLS / len(mesh.cells)) ** 0.5)
    return coarse if len(coarse.cells) < len(mesh.cells) else mesh


def _solved(system: System, mesh: Mesh, loads: np.ndarray) -> Deflection:
    fine = assemble(
        mesh, system.section, system.supports, point_masses=system.point_masses, near=loads, graded=system.graded
    )
    rows = fine.interpolate(loads)
    flexibility = Flexibility(fine.K, fine.M, fine.rigid, fine.held)
    forces = rows.toarray().T
    vectors = flexibility.solve(forces)
    compliance = np.asarray(rows @ vectors)
    if fine.strain is not None:  # stationary: rounding of K in the smallest triangles enters squared
        compliance = compliance + compliance.T - fine.strain.products(fine, vectors)
    diagonal = compliance.diagonal()
    inertia = -fine.rigid @ (fine.rigid.T @ forces)
    error = residual.energy_errors(fine, vectors, inertia, loads).sum(axis=0)
    rounding = ROUNDING if mesh.dimension == 2 else beam_elements.rounding(fine.space)
    moves = diagonal > RESTS
    relative = np.where(moves, error / np.where(moves, diagonal, 1.0), 0.0) + rounding
    unit = fine.frame.mass * fine.frame.rate**2
    return Deflection(fine, loads.copy(), vectors, 0.5 * (compliance + compliance.T) / unit, relative)
