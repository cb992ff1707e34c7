"""The deflection at points as a matrix on the unknowns, and forces spread over disks where a point would sink in."""

from typing import Any

import numpy as np
from scipy.sparse import csr_matrix, vstack

from .._base import explained
from .._base.rounding import ROUNDING
from .._base.untyped import Sparse
from .section import size_at
from .theory import Frame, Theory, blocks


class Interpolation:
    """Rows from the unknowns of a body to its deflection at points.

    In a thick plate it is the mean over the disk on which a force at the point acts, see `thick`.
    """

    def __init__(self, theory: Theory, section: Any, space: Any, frame: Frame, dofs: np.ndarray) -> None:
        self.theory, self.section, self.space, self.frame, self.dofs = theory, section, space, frame, dofs

    def check(self, name: str, points: np.ndarray) -> None:
        """Raise ValueError unless every point lies on the body."""
        inside = self.space.locate(self.frame.local(points))[1]
        if not inside.all():
            where = ", ".join(f"{x:g}" for x in points[int(np.argmin(inside))])
            raise ValueError(explained.with_headings(f"{name} must lie on the body, got ({where}) m"))

    def rows(self, points: np.ndarray, expand: Any) -> Any:
        """Matrix (n_points, n_all) from all unknowns to the deflection at points (n_points, dimension) [m]."""
        local = self.frame.local(points)
        rows = self._exactly(local, expand.shape[0])
        if not self.theory.patch:
            return rows
        radius = self.theory.patch * size_at(self.section, "thickness", points) / self.frame.length
        moves = abs(rows @ expand).max(axis=1).toarray()[:, 0] > ROUNDING
        still, moving = np.flatnonzero(~moves), np.flatnonzero(moves)
        found = [rows[still]]  # on a support, so at rest
        for some in blocks(len(moving)):
            if some.size:
                places, weights = spread_forces(self.space, local[moving[some]], radius[moving[some]])
                found.append(weights @ self._exactly(places, expand.shape[0]))
        return vstack(found, format="csr")[np.argsort(np.concatenate([still, moving]))]

    def _exactly(self, local: np.ndarray, n_all: int) -> csr_matrix:
        """`rows` at points in the frame, exactly there."""
        cells = self.space.locate(local)[0]
        values = self.space.functions(cells, local[:, None, :], (0,))[0][:, 0]  # (n_points, n_local)
        dofs = self.dofs[:, cells].T
        rows = np.repeat(np.arange(len(local)), dofs.shape[1])
        return csr_matrix((values.ravel(), (rows, dofs.ravel())), shape=(len(local), n_all))


def spread_forces(space: Any, points: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, Sparse]:
    """Places (n, 2) over which forces at points (n_points, 2) are spread, and their weights (n_points, n).

    Each disk, of its ``radius`` (n_points,), is cut at the edge of the body. A weight linear in the place moves its
    centre back to the point, so that a rigid motion is followed exactly.
    """
    # points on a disk, radial and around: these err by 3e-5 of a compliance at h/L = 0.2; at many points, as for a
    # picture, fewer do, which err by 1e-6 of a mode of h k = 1
    rings, spokes = (6, 24) if len(points) <= 64 else (2, 8)
    node, weight = np.polynomial.legendre.leggauss(rings)
    turn = 2.0 * np.pi * np.arange(spokes) / spokes
    away = np.sqrt(0.5 * (node + 1.0))  # Gauss points in the radius squared
    disk = (away[:, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)).reshape(-1, 2)
    offset = radius[:, None, None] * disk  # (n_points, n_disk, 2)
    places = points[:, None] + offset
    share = np.repeat(weight, spokes) * space.locate(places.reshape(-1, 2))[1].reshape(offset.shape[:2])
    bare = share.sum(axis=1) == 0.0  # all off the body, as around a spike: the point itself
    places[bare], offset[bare], share[bare] = points[bare, None], 0.0, 1.0
    share = share / share.sum(axis=1, keepdims=True)
    centre = np.einsum("pk,pki->pi", share, offset)
    about = offset - centre[:, None]
    spread_out = np.einsum("pk,pki,pkj->pij", share, about, about)
    lean = np.einsum("pij,pj->pi", np.linalg.pinv(spread_out, hermitian=True), centre)
    share = share * (1.0 - np.einsum("pki,pi->pk", about, lean))
    row = np.repeat(np.arange(len(points)), share.shape[1])
    weights = csr_matrix((share.ravel(), (row, np.arange(share.size))), shape=(len(points), share.size))
    return places.reshape(-1, 2), weights
