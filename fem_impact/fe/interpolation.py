"""The deflection at points as a matrix on the unknowns, and forces spread over disks where a point would sink in."""

from typing import Any

import numpy as np
import shapely
from scipy.sparse import csr_matrix, vstack
from scipy.special import roots_jacobi

from .._base import explained
from .._base.remembered import gauss_rule
from .._base.rounding import ROUNDING
from .._base.untyped import Sparse
from ..mesh.mesh_files import sides_of
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

    def rows(self, points: np.ndarray, expand: Any, spread: bool = True) -> Any:
        """Matrix (n_points, n_all) from all unknowns to the deflection at points (n_points, dimension) [m].

        If not ``spread``, at the very points, also of a thick plate.
        """
        local = self.frame.local(points)
        rows = self._exactly(local, expand.shape[0])
        if not (spread and self.theory.patch):
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
    # rings of a whole disk and places on each, which are the corners of the polygon that stands for a cut one, Gauss
    # points on its chords, and how far its edges may be off over the radius: so many err by 3e-5 of a compliance at
    # h/L = 0.2; at many points, as for a picture, fewer do, which err by 1e-6 of a mode of h k = 1
    rings, around, across, off = (6, 48, 24, 3e-4) if len(points) <= 64 else (3, 16, 8, 2e-3)
    turn = 2.0 * np.pi * np.arange(around) / around
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    polygons = (radius * np.sqrt(turn[1] / np.sin(turn[1])))[:, None, None] * circle  # of the disk's area
    body, disks = _outlined(space, off * float(radius.min())), shapely.polygons(points[:, None] + polygons)
    shapely.prepare(body)
    whole = shapely.contains(body, disks)
    inner, cut = np.flatnonzero(whole), np.flatnonzero(~whole)
    away, weight = roots_jacobi(rings, 0.0, 1.0)  # by the radius
    on_rings = ((0.5 * (away + 1.0))[:, None, None] * circle).reshape(-1, 2)
    low, high, width, owner = _chords(shapely.intersection(body, disks[cut]), disks[cut])
    bare = np.setdiff1d(cut, cut[owner])  # off the body, by less than its curves are known: the point itself
    along, part = gauss_rule(across)
    found = (  # points, places of each and their shares
        (inner, points[inner, None] + radius[inner, None, None] * on_rings, np.repeat(weight, around)),
        (cut[owner], low[:, None] + along[:, None] * (high - low)[:, None], np.outer(width * (high - low)[:, 1], part)),
        (bare, points[bare, None], np.ones(1)),
    )
    places = np.concatenate([each.reshape(-1, 2) for _, each, _ in found])
    row = np.concatenate([np.repeat(which, each.shape[1]) for which, each, _ in found])
    share = np.concatenate([np.broadcast_to(part, each.shape[:2]).ravel() for _, each, part in found])
    mean = csr_matrix((share / np.bincount(row, share)[row], (row, np.arange(len(row)))), (len(points), len(row)))
    offset = places - points[row]
    centre = mean @ offset
    about = offset - centre[row]
    spread_out = (mean @ (about[:, :, None] * about[:, None]).reshape(-1, 4)).reshape(-1, 2, 2)
    lean = np.einsum("pij,pj->pi", np.linalg.pinv(spread_out, hermitian=True), centre)
    return places, mean.multiply(1.0 - (about * lean[row]).sum(axis=1)).tocsr()


def _outlined(space: Any, off: float) -> Any:
    """The body as a polygon, whose sides are off its curved edges by at most so much."""
    _, number, counts = sides_of(space.vertices)
    cell, side = np.nonzero(counts[number] == 1)
    ends = np.eye(3)[np.stack([side, (side + 1) % 3], axis=1)]  # (n_facets, 2, 3) area coordinates
    longest = float(np.linalg.norm(np.diff(ends @ space.corners[cell], axis=1), axis=2).max())
    off = max(off, 1e-7 * longest)  # the curves are known no better
    n = int(np.sqrt(0.1 * longest / off)) + 1 if space.curved.any() else 1
    step = np.linspace(0.0, 1.0, n + 1)[:, None]
    area = (1.0 - step) * ends[:, :1] + step * ends[:, 1:]
    lines = shapely.linestrings(space.points_along(cell, area, np.zeros((1, 1, 3)))[0])
    return shapely.build_area(shapely.multilinestrings(lines)).simplify(off)


def _chords(pieces: Any, disks: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Lowest and highest places (n, 2) of chords along y of pieces of disks, the widths (n,) they stand for, and whose.

    Two stand for the strip between one corner of a piece or its disk and the next, where they end on straight lines.
    """
    both = shapely.geometrycollections(np.stack([pieces, disks], axis=1))
    corners, owner = shapely.get_coordinates(both, return_index=True)
    order = np.lexsort([corners[:, 0], owner])
    x, owner = corners[order, 0], owner[order]
    strip = np.flatnonzero((np.diff(owner) == 0) & (np.diff(x) > ROUNDING))
    node, weight = gauss_rule(2)
    width = np.diff(x)[strip, None]
    at, owner, width = (x[strip, None] + width * node).ravel(), np.repeat(owner[strip], 2), (width * weight).ravel()
    lines = shapely.linestrings(np.stack([np.column_stack([at, np.full(len(at), end)]) for end in (-1.0, 1.0)], axis=1))
    found, of = shapely.get_parts(shapely.intersection(lines, pieces[owner]), return_index=True)
    found, of = found[~shapely.is_empty(found)], of[~shapely.is_empty(found)]
    low, high = shapely.bounds(found).reshape(-1, 2, 2).transpose(1, 0, 2)
    return low, high, width[of], owner[of]
