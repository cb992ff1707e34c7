"""Stretching of a plate in its plane by its deflection: von Karman's membrane energy as squares of quadratic forms.

A deflection w stretches the plane by ``e = sym(u') + 1/2 w' w'``, and the displacements u in the plane settle where the
energy ``1/2 int e . A e``, A = h C, is least. The stress N = A e is then in equilibrium. With stress fields N_k in
equilibrium that are normalised as ``int N_k . A^-1 N_l = 1`` if k = l and 0 otherwise, the energy of a deflection is

    V = 1/2 sum_k (1/2 int w' . N_k w')**2,

exactly if there are enough of them, and less with fewer: each adds to it. The fields kept here are those that matter
most when the low modes swing with equal energies; quartic elements on the triangles of the plate find u.

A plate that is curved, ribbed or unevenly layered has stresses in its plane from its linear motion, too, see `shallow`.
They are in equilibrium, with the share ``l_k`` of field k, and their work on ``1/2 w' w'`` comes in addition,

    V = 1/2 sum_k ((l_k + 1/2 int w' . N_k w')**2 - l_k**2).

Such stresses count among those that choose the fields, with as much weight in all at most. A rib stretches along its
line.

References
----------
Marguerre (1938), Proc. 5th Int. Congr. Appl. Mech., 93-101;
von Karman (1910), Encyklopaedie der mathematischen Wissenschaften IV/4, 349; Chu and Herrmann (1956), J. Appl. Mech.
23, 532-540.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix

from .._base.untyped import Sparse
from . import plane, slopes
from .eigenvalues import factorise
from .elements import area_coordinates, triangles
from .section import Plate, size_at
from .system import System
from .theory import blocks, gram, scatter

# [-] lowest modes whose stresses choose the fields that are kept: large swings are those of the lowest modes
SWINGING = 16
MOST = 32  # [-] fields kept at most: they have 99 % of the energy of 16 modes with equal energies
WORK = 30_000  # [-] entries of all forms together, to limit the work of a step: 18 fields of 40 modes

Steep = Callable[[np.ndarray, np.ndarray], np.ndarray]
Taut = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Sheet:
    """The plane of a plate at the quadrature points of its triangles, and then of their sides along ribs."""

    cells: np.ndarray  # (n,) the triangle of each piece
    area: np.ndarray  # (n, n_q, 3) coordinates in it
    x: np.ndarray  # (n, n_q, 2) in the frame
    moduli: np.ndarray  # (n, n_q, 3, 3) [N m] A times the weights, on strains xx, yy, 2 xy
    gradient: np.ndarray  # (n, n_q, 2, 15) of the shape functions, in the frame
    dofs: np.ndarray  # (n, 30) numbers of u, then v
    loose: Sparse  # (n_dofs, n_left) map to these unknowns that supports leave
    neutral: np.ndarray  # (n, n_q, 3, 3) [-] strain by which a negative curvature acts, where bending stretches it

    @classmethod
    def of(cls, system: System) -> "Sheet":
        """That of a plate, held in its plane as stated."""
        rim, section, frame = system.rim, system.section, system.frame
        assert rim is not None and isinstance(section, Plate)
        space: Any = system.space
        X, x, dx = slopes.quadrature(system, 4)  # exact for the stiffness of quartic elements
        gradient = plane.gradients(space, np.arange(len(x)), area_coordinates(X.T)[None])
        h = size_at(section, "thickness", frame.to_metres(x)).reshape(dx.shape)
        moduli = (frame.length**2 * h * dx)[..., None, None] * section.stretched
        own = plane.numbered_unknowns(triangles(rim.points, space.vertices))
        dofs = np.vstack([own.element_dofs, own.N + own.element_dofs]).T
        area = np.broadcast_to(area_coordinates(X.T), (*dx.shape, 3))
        neutral = np.zeros((*dx.shape, 3, 3))
        if section.coupled:
            walls = section.walls(frame.centre[None])[0]
            neutral[:] = np.linalg.solve(walls[:3, :3], walls[:3, 3:]) / frame.length
        plate = np.arange(len(x)), area, x, moduli, gradient, neutral
        parts = [plate, *(_pieces_along(space, rib, frame.length, x.shape[1]) for rib in getattr(space, "ribs", ()))]
        cells, area, x, moduli, gradient, neutral = (np.concatenate(each) for each in zip(*parts))
        return cls(cells, area, x, moduli, gradient, dofs[cells], plane.free_displacements(space, rim, own)[0], neutral)

    def strains(self, pieces: np.ndarray) -> np.ndarray:
        """Strains (n, n_q, 3, 30) of the unknowns of pieces (n,)."""
        return plane.strains(self.gradient[pieces])

    def blocks(self, n_pairs: int) -> list[np.ndarray]:
        """Numbers of the pieces in blocks, so that pairs of modes take 4 MB at most."""
        return blocks(len(self.x), max(1, 500_000 // (3 * n_pairs * self.x.shape[1])))

    @property
    def stiffness(self) -> Sparse:
        """Stiffness of the plane (n_dofs, n_dofs) [N m]."""
        n_dofs = self.dofs.max() + 1
        result = csc_matrix((n_dofs, n_dofs))
        for cells in self.blocks(30):
            strain, dofs = self.strains(cells), self.dofs[cells]
            result = result + scatter(gram(strain, self.moduli[cells]), dofs.T, n_dofs)
        return result


def most_fields(n_modes: int) -> int:
    """How many fields are kept at most."""
    return max(1, min(MOST, WORK // n_modes**2))


def stretching_forms(
    sheet: Sheet, steep: Steep, omega: np.ndarray, taut: Taut | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Forms S (n_forms, n_modes, n_modes) and rows l (n_forms, n_modes) of the energy of modes q.

    It is ``V = 1/2 sum_k ((l_k q + q' S_k q)**2 - (l_k q)**2)``; without ``taut``, there are no rows l.

    Parameters
    ----------
    sheet : Sheet
    steep : callable
        Slopes (n, n_q, 2, n_modes) [m**-1 kg**-0.5] of the modes at points (n, n_q, 2) of cells (n,), in the frame.
    omega : ndarray, shape (n_modes,) [rad/s]
    taut : callable, optional
        Strains (n, n_q, 3, n_modes) [m**-1 kg**-0.5] at the points of pieces (n,), whose stress is that by the linear
        motion of the modes.
    """
    n, low = len(omega), min(SWINGING, len(omega))

    def strained(pieces: np.ndarray, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        slope = steep(sheet.cells[pieces], sheet.x[pieces])
        one, two = slope[..., i], slope[..., j]  # (n, n_q, 2, n_pairs)
        pair = np.empty((*slope.shape[:2], 3, len(i)))  # products xx, yy, 2 xy
        np.multiply(one, two, out=pair[:, :, :2])
        np.multiply(one[:, :, 0], two[:, :, 1], out=pair[:, :, 2])
        pair[:, :, 2] += one[:, :, 1] * two[:, :, 0]
        return pair if taut is None else np.concatenate([pair, taut(pieces)], axis=-1)

    i, j = np.triu_indices(low)
    more = 0 if taut is None else n
    width = len(i) + more
    products, load = np.zeros((width, width)), np.zeros((sheet.dofs.max() + 1, width))
    for pieces in sheet.blocks(width):
        strain = strained(pieces, i, j)
        stress = _flattened_values(sheet.moduli[pieces] @ strain)
        products += _flattened_values(strain).reshape(-1, width).T @ stress.reshape(-1, width)
        pushed = _flattened_values(sheet.strains(pieces)).transpose(0, 2, 1) @ stress  # (n_pieces, 30, width)
        np.add.at(load, sheet.dofs[pieces], pushed)
    loose: Any = sheet.loose
    settled = -loose @ factorise(loose.T @ sheet.stiffness @ loose).solve(loose.T @ load)
    products = products + load.T @ settled
    # 1/2 of both slopes, and pairs of different modes count twice in the energy; equal energies
    weight = np.where(i == j, 0.5, np.sqrt(0.5)) / (omega[i] * omega[j])
    if more:
        own = np.diag(products)
        pairs, motions = weight**2 @ own[:-n], omega**-2.0 @ own[-n:]  # the second: shares of their energies
        weight = np.append(weight, np.sqrt(pairs / max(1.0, motions)) / omega)
    size, kept = (each[..., ::-1] for each in np.linalg.eigh(products * weight[:, None] * weight))
    missing = 1.0 - np.cumsum(size) / size.sum()  # without a millionth a body is stiffer by less than any tolerance
    count = min(most_fields(n), 1 + int(np.count_nonzero(missing > 1e-6)))
    mixed = weight[:, None] * kept[:, :count] / np.sqrt(size[:count])
    moved = settled @ mixed
    every = np.triu_indices(n)
    width = len(every[0]) + more
    before = np.append(np.flatnonzero(every[1] < low), len(every[0]) + np.arange(more))  # those that chose the fields
    work = np.zeros((count, width))
    for pieces in sheet.blocks(width):
        strain = strained(pieces, *every)
        settling = strain[..., before] @ mixed + sheet.strains(pieces) @ moved[sheet.dofs[pieces]][:, None]
        work += (sheet.moduli[pieces] @ settling).reshape(-1, count).T @ strain.reshape(-1, width)
    result = np.zeros((count, n, n))
    result[:, *every] = 0.5 * work[:, : len(every[0])]
    upper = np.triu(result, 1)
    return result + upper.transpose(0, 2, 1), work[:, len(every[0]) :]


def _pieces_along(space: Any, rib: Any, length: float, n_q: int) -> tuple[np.ndarray, ...]:
    """Pieces of `Sheet` along a rib, with points without weight up to n_q, in a frame of a length [m]."""
    cells, area, x, ds, along = rib.cells, rib.area, rib.x, rib.ds, rib.along
    stretch, bent = (rib.stiffness[..., 0, i] for i in (0, 1))
    moduli = (length * stretch * ds)[..., None, None] * along[..., None] * along[..., None, :]
    neutral = (bent / (stretch * length))[..., None, None] * np.eye(3)

    def padded(values: np.ndarray, mode: Any = "edge") -> np.ndarray:
        return np.pad(values, [(0, 0), (0, n_q - ds.shape[1]), *[(0, 0)] * (values.ndim - 2)], mode=mode)

    gradient = plane.gradients(space, cells, area)
    return cells, padded(area), padded(x), padded(moduli, "constant"), padded(gradient), padded(neutral)


def _flattened_values(values: np.ndarray) -> np.ndarray:
    """Values (n, n_q, 3, k) as (n, 3 n_q, k)."""
    return values.reshape(len(values), -1, values.shape[-1])
