"""Static deflection of a body under point forces, on elements that shrink towards the forces."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base import check
from ..mesh.meshes import Mesh
from . import beam_elements
from .assembly import reassemble
from .eigenvalues import Flexibility
from .refinement import CHEAP_CELLS, COARSER, FLATTER
from .system import System

# [-] a point whose compliance in the frame is below this lies on a support: rounding of the solution leaves as much
RESTS = 1e-15


@dataclass(frozen=True, eq=False)
class Deflection(check.Locked):
    """Static deflections of a body under unit forces at points, one at a time.

    If the body can move rigidly, inertia balances the load and the deflection contains no rigid motion.
    """

    system: System  # with elements that shrink towards the points
    loads: np.ndarray  # (n_loads, dimension) [m] where the forces act
    vectors: np.ndarray  # (n_dofs, n_loads) [-] in the frame of the system
    compliance: np.ndarray  # (n_loads, n_loads) [m/N] deflection at one load under another
    error: np.ndarray  # (n_loads,) [-] estimated relative error of the compliance's diagonal

    def at(self, points: np.ndarray) -> np.ndarray:
        """Deflection [m/N] at points (n_points, dimension) [m] under each load, (n_points, n_loads)."""
        unit = self.system.frame.mass * self.system.frame.rate**2
        return np.asarray(self.system.interpolate(points) @ self.vectors) / unit


def static_deflection(system: System, loads: np.ndarray) -> Deflection:
    """Find the deflections of a body under unit forces at points (n_loads, dimension) [m], edges and corners included.

    A coarse mesh is enough, because the deflection is smooth except for the dip under the force, and there the
    elements shrink. If the estimated error is still too large, finer meshes follow.
    """
    if system.rules.compared:
        return _compared(system, loads)
    mesh = _coarser_system(system.mesh)
    best: Any = None
    for _ in range(3):  # 700, 2 800 and 11 200 triangles; a fourth mesh is slow
        found = _solved(system, mesh, loads)
        if best is None or found.error.max() < best.error.max():
            best = found
        if best.error.max() <= 1e-5 or mesh.recipe is None:  # a tenth of the default tolerance
            break
        mesh = mesh.refined(2.0)
    return best


def _compared(system: System, loads: np.ndarray) -> Deflection:
    """`static_deflection` of a thick plate or a shell; its error comes from a second mesh."""
    mesh = _coarser_system(system.mesh)
    finer = mesh.refined(COARSER)
    if len(mesh.cells) > CHEAP_CELLS and len(mesh.refined(1.0 / COARSER).cells) < len(mesh.cells):
        mesh, finer = mesh.refined(1.0 / COARSER), mesh
    with_fewer = _solved(replace(system, layer=FLATTER * system.layer), mesh, loads).compliance.diagonal()
    found = _solved(system, finer, loads)
    diagonal = found.compliance.diagonal()
    error = np.abs(diagonal - with_fewer)
    if system.rules.patch:  # points stand for the disk of the force, to 6e-4 over 2 pi the shear stiffness
        error += 6e-4 / (2.0 * np.pi * np.linalg.eigvalsh(found.system.section.shear(loads)).min(axis=1))
    moves = diagonal * found.system.frame.mass * found.system.frame.rate**2 > RESTS
    return replace(found, error=np.where(moves, error / np.where(moves, diagonal, 1.0), 0.0) + found.error)


def _coarser_system(mesh: Mesh) -> Mesh:
    """The same body with fewer triangles, or unchanged if it cannot be meshed again."""
    if mesh.recipe is None or mesh.dimension == 1 or len(mesh.cells) <= 2 * CHEAP_CELLS:
        return mesh
    coarse = mesh.refined((CHEAP_CELLS / len(mesh.cells)) ** 0.5)
    return coarse if len(coarse.cells) < len(mesh.cells) else mesh


def _solved(system: System, mesh: Mesh, loads: np.ndarray) -> Deflection:
    """Deflections on a mesh; where a second one shows their errors, these are still only those by rounding."""
    morley = system.element == "morley"  # its moments are constant in each triangle: no error could be estimated
    fine = reassemble(system, mesh, loads, element="argyris" if morley else None)
    rows = fine.interpolate(loads)
    flexibility = Flexibility.of(fine)
    forces = rows.toarray().T
    vectors = flexibility.solve(forces)
    compliance = np.asarray(rows @ vectors)
    if fine.strain is not None:  # this form is stationary, so the rounding error of K enters squared
        compliance = compliance + compliance.T - fine.strain.products(fine, vectors)
    unit = fine.frame.mass * fine.frame.rate**2
    relative = np.full(len(loads), 1e-7)  # of a plate's smallest triangles
    if mesh.dimension == 1:  # by rounding in the shortest element: 1e-15 in one as long as the beam
        relative[:] = 1e-15 / max(np.abs(fine.space.length).min(), 0.1 * beam_elements.APART) ** 3
    if not fine.rules.compared:
        diagonal, inertia = compliance.diagonal(), -fine.rigid @ (fine.rigid.T @ forces)
        error, moves = fine.rules.errors(fine, vectors, inertia, loads).sum(axis=0), diagonal > RESTS
        relative += np.where(moves, error / np.where(moves, diagonal, 1.0), 0.0)
    return Deflection(fine, loads.copy(), vectors, 0.5 * (compliance + compliance.T) / unit, relative)
