"""Stretching of a plate in its plane by its deflection: von Karman's membrane energy as squares of quadratic forms.

A deflection w stretches the plane by ``e = sym(u') + 1/2 w' w'``, and the displacements u in the plane settle where the
energy ``1/2 int e . A e``, A = h C, is least. The stress N = A e is then in equilibrium. With stress fields N_k in
equilibrium that are normalised as ``int N_k . A^-1 N_l = 1`` if k = l and 0 otherwise, the energy of a deflection is

    V = 1/2 sum_k (1/2 int w' . N_k w')**2,

exactly if there are enough of them, and less with fewer: each adds to it. The fields kept here are those that matter
most when the low modes swing with equal energies; quartic elements on the triangles of the plate find u.

References
----------
von Karman (1910), Encyklopaedie der mathematischen Wissenschaften IV/4, 349; Chu and Herrmann (1956), J. Appl. Mech.
23, 532-540.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix
from skfem import Dofs, ElementTriP4

from .._base.untyped import Sparse
from . import plane, slopes
from .eigenvalues import factorise
from .elements import inverses, triangles
from .section import Plate, evaluate
from .system import System

NODES = 4  # [-] Gauss points in each direction of a triangle: exact for the stiffness of quartic elements
# [-] lowest modes whose stresses choose the fields that are kept: large swings are those of the lowest modes
SWINGING = 16
ENTRIES = 500_000  # [-] of an array of pairs of modes, to limit memory
MOST = 32  # [-] fields kept at most: they have 99 % of the energy of 16 modes with equal energies
WORK = 30_000  # [-] entries of all forms together, to limit the work of a step: 18 fields of 40 modes
# [-] of that energy, in fields that are not kept: stiffens the body by a millionth less, below any tolerance
LEFT_OUT = 1e-6

Steep = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Sheet:
    """The plane of a plate at the quadrature points of its triangles."""

    x: np.ndarray  # (n_cells, n_q, 2) in the frame
    moduli: np.ndarray  # (n_cells, n_q, 3, 3) [N m] A times the weights, on strains xx, yy, 2 xy
    gradient: np.ndarray  # (n_cells, n_q, 2, 15) of the shape functions, in the frame
    dofs: np.ndarray  # (n_cells, 30) numbers of u, then v
    loose: Sparse  # (n_dofs, n_left) map to these unknowns that supports leave

    @classmethod
    def of(cls, system: System) -> "Sheet":
        """That of a plate, held in its plane as stated."""
        rim, section, frame = system.rim, system.section, system.frame
        assert rim is not None and isinstance(section, Plate)
        space: Any = system.space
        X, x, dx = slopes.quadrature(system, NODES)
        gradient = np.einsum("eqji,jqk->eqik", inverses(space, X), plane.reference(X)[1])
        h = evaluate("thickness", section.thickness, frame.places(x), "m").reshape(dx.shape)
        moduli = (frame.length**2 * h * dx)[..., None, None] * section.material.plane_stress
        own = Dofs(triangles(rim.points, space.vertices), ElementTriP4())
        dofs = np.vstack([own.element_dofs, own.N + own.element_dofs]).T
        return cls(x, moduli, gradient, dofs, plane.loosened(space.inner, rim, own)[0])

    def strains(self, cells: np.ndarray) -> np.ndarray:
        """Strains (n, n_q, 3, 30) of the unknowns of cells (n,)."""
        return plane.strains(self.gradient[cells])

    def blocks(self, n_pairs: int) -> list[np.ndarray]:
        """Numbers of the cells in blocks, to limit the memory that pairs of modes take."""
        most = max(1, ENTRIES // (3 * n_pairs * self.x.shape[1]))
        return np.array_split(np.arange(len(self.x)), -(-len(self.x) // most))

    @property
    def stiffness(self) -> Sparse:
        """Stiffness of the plane (n_dofs, n_dofs) [N m]."""
        n_dofs = self.dofs.max() + 1
        result = csc_matrix((n_dofs, n_dofs))
        for cells in self.blocks(30):
            strain, dofs = self.strains(cells), self.dofs[cells]
            local = _flat(strain).transpose(0, 2, 1) @ _flat(self.moduli[cells] @ strain)
            place = (np.broadcast_to(each, local.shape).ravel() for each in (dofs[:, :, None], dofs[:, None]))
            result = result + csc_matrix((local.ravel(), tuple(place)), shape=result.shape)
        return result


def most(n_modes: int) -> int:
    """How many fields are kept at most."""
    return max(1, min(MOST, WORK // n_modes**2))


def forms(sheet: Sheet, steep: Steep, omega: np.ndarray) -> np.ndarray:
    """Forms S (n_forms, n_modes, n_modes) of the energy ``V = 1/2 sum_k (q' S_k q)**2`` of modes q.

    Parameters
    ----------
    sheet : Sheet
    steep : callable
        Slopes (n, n_q, 2, n_modes) [m**-1 kg**-0.5] of the modes at points (n, n_q, 2) of cells (n,), in the frame.
    omega : ndarray, shape (n_modes,) [rad/s]
    """
    n, low = len(omega), min(SWINGING, len(omega))
    i, j = np.triu_indices(low)
    products, load = np.zeros((len(i), len(i))), np.zeros((sheet.dofs.max() + 1, len(i)))
    for cells in sheet.blocks(len(i)):
        pair = _pairs(steep(cells, sheet.x[cells]), i, j)
        stress = _flat(sheet.moduli[cells] @ pair)
        products += _flat(pair).reshape(-1, len(i)).T @ stress.reshape(-1, len(i))
        pushed = _flat(sheet.strains(cells)).transpose(0, 2, 1) @ stress  # (n_cells, 30, n_pairs)
        np.add.at(load, sheet.dofs[cells], pushed)
    loose: Any = sheet.loose
    settled = -loose @ factorise(loose.T @ sheet.stiffness @ loose).solve(loose.T @ load)
    # 1/2 of both slopes, and pairs of different modes count twice in the energy; equal energies
    weight = np.where(i == j, 0.5, np.sqrt(0.5)) / (omega[i] * omega[j])
    size, kept = (each[..., ::-1] for each in np.linalg.eigh((products + load.T @ settled) * weight[:, None] * weight))
    missing = 1.0 - np.cumsum(size) / size.sum()
    count = min(most(n), 1 + int(np.count_nonzero(missing > LEFT_OUT)))
    mixed = weight[:, None] * kept[:, :count] / np.sqrt(size[:count])
    moved = settled @ mixed
    every = np.triu_indices(n)
    result = np.zeros((count, n, n))
    for cells in sheet.blocks(len(every[0])):
        slope = steep(cells, sheet.x[cells])
        strain = _pairs(slope, i, j) @ mixed + sheet.strains(cells) @ moved[sheet.dofs[cells]][:, None]
        stress = sheet.moduli[cells] @ strain
        result[:, *every] += 0.5 * stress.reshape(-1, count).T @ _pairs(slope, *every).reshape(-1, len(every[0]))
    upper = np.triu(result, 1)
    return result + upper.transpose(0, 2, 1)


def _pairs(slope: np.ndarray, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Products (n, n_q, 3, n_pairs) of the slopes (n, n_q, 2, n_modes) of modes i and j (n_pairs,): xx, yy, 2 xy."""
    result = np.empty((*slope.shape[:2], 3, len(i)))
    one, two = slope[..., i], slope[..., j]  # (n, n_q, 2, n_pairs)
    np.multiply(one, two, out=result[:, :, :2])
    np.multiply(one[:, :, 0], two[:, :, 1], out=result[:, :, 2])
    result[:, :, 2] += one[:, :, 1] * two[:, :, 0]
    return result


def _flat(values: np.ndarray) -> np.ndarray:
    """Values (n, n_q, 3, k) as (n, 3 n_q, k)."""
    return values.reshape(len(values), -1, values.shape[-1])
