"""The deflection at points as a matrix on the unknowns, and forces spread over disks where a point would sink in."""

from typing import Any

import numpy as np
from scipy.sparse import csr_matrix, vstack
from scipy.special import roots_jacobi, roots_legendre

from .._base import explained
from .._base.rounding import HALVINGS, ROUNDING
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
    # rings and arcs of two points each: these err by 3e-5 of a compliance at h/L = 0.2; at many points, as for a
    # picture, fewer do, which err by 1e-6 of a mode of h k = 1
    rings, arcs = (6, 24) if len(points) <= 64 else (3, 4)
    whole = _whole_disks(space, points, radius)
    inner, beyond = roots_jacobi(rings, 0.0, 1.0), roots_legendre(2 * rings)  # by the radius; cut arcs begin like roots
    node = 0.5 * (beyond[0] + 1.0)
    away = np.hstack([np.outer(whole, 0.5 * (inner[0] + 1.0)), whole[:, None] + np.outer(radius - whole, node**2)])
    rest = np.outer(radius - whole, 4.0 * node * beyond[1]) * away[:, rings:]
    weight = np.hstack([np.outer(whole**2, inner[1]), rest])
    first, last = _arcs_inside(space, points, np.where(weight > 0.0, away, 0.0), arcs)
    half = np.array([-1.0, 1.0]) / np.sqrt(3.0)
    turn = 0.5 * (first + last)[..., None] + 0.5 * (last - first)[..., None] * half  # (n_points, rings, arcs, 2)
    offset = away[:, :, None, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    share = np.broadcast_to((weight[..., None] * (last - first))[..., None], turn.shape).reshape(len(points), -1).copy()
    offset = offset.reshape(*share.shape, 2)  # (n_points, n_disk, 2)
    places = points[:, None] + offset
    share[share > 0.0] *= space.locate(places[share > 0.0])[1]
    bare = share.sum(axis=1) == 0.0  # all off the body, as around a spike: the point itself
    places[bare], offset[bare], share[bare] = points[bare, None], 0.0, 1.0
    share = share / share.sum(axis=1, keepdims=True)
    centre = np.einsum("pk,pki->pi", share, offset)
    about = offset - centre[:, None]
    spread_out = np.einsum("pk,pki,pkj->pij", share, about, about)
    lean = np.einsum("pij,pj->pi", np.linalg.pinv(spread_out, hermitian=True), centre)
    share = share * (1.0 - np.einsum("pki,pi->pk", about, lean))
    row, column = np.nonzero(share)
    weights = csr_matrix((share[row, column], (row, np.arange(len(row)))), shape=(len(points), len(row)))
    return places[row, column], weights


def _whole_disks(space: Any, points: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Radius (n_points,) of the largest disk around each point that lies on the body, at most ``radius``."""
    turn = np.linspace(0.0, 2.0 * np.pi, 25)[:-1]
    spokes = np.column_stack([np.cos(turn), np.sin(turn)])

    def on_body(some: np.ndarray, size: np.ndarray) -> np.ndarray:
        places = points[some, None] + size[:, None, None] * spokes
        return np.asarray(space.locate(places.reshape(-1, 2))[1].reshape(len(some), -1).all(axis=1))

    found = radius.copy()
    cut = np.flatnonzero(~on_body(np.arange(len(points)), radius))
    found[cut] = _last_inside(on_body, cut, np.zeros(len(cut)), radius[cut])
    return found


def _arcs_inside(space: Any, points: np.ndarray, away: np.ndarray, arcs: int) -> tuple[np.ndarray, np.ndarray]:
    """First and last angle (n_points, rings, arcs) [rad] of arcs around points, as far as they lie on the body.

    ``away`` (n_points, rings) are the radii; an arc of which one end is beyond the edge is cut there.
    """
    ends = np.linspace(0.0, 2.0 * np.pi, arcs + 1)
    shape = (*away.shape, arcs)
    first, last = (np.broadcast_to(each, shape).reshape(-1).copy() for each in (ends[:-1], ends[1:]))
    middle, away = np.repeat(points, shape[1] * arcs, axis=0), np.repeat(away.ravel(), arcs)

    def on_body(some: np.ndarray, turn: np.ndarray) -> np.ndarray:
        at = middle[some] + away[some, None] * np.column_stack([np.cos(turn), np.sin(turn)])
        return np.asarray(space.locate(at)[1])

    starts = away == 0.0
    starts[~starts] = on_body(np.flatnonzero(~starts), first[~starts])
    stops = np.roll(starts.reshape(shape), -1, axis=2).ravel()
    last[~starts & ~stops] = first[~starts & ~stops]
    cut = np.flatnonzero(starts != stops)
    found = _last_inside(on_body, cut, *np.where(starts[cut], [first[cut], last[cut]], [last[cut], first[cut]]))
    first[cut], last[cut] = np.where(starts[cut], [first[cut], found], [found, last[cut]])
    return first.reshape(shape), last.reshape(shape)


def _last_inside(on_body: Any, some: np.ndarray, inside: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """Where the body ends (n,) between values inside and outside, by halving."""
    for _ in range(HALVINGS if some.size else 0):
        middle = 0.5 * (inside + outside)
        lies = on_body(some, middle)
        inside, outside = np.where(lies, middle, inside), np.where(lies, outside, middle)
    return inside
