"""Shallow shells: plates whose plane answers when they bend, because they are curved, ribbed or unevenly layered.

The unknowns are the deflection w, by Argyris triangles, and the displacements u in the plane, by quartic ones. With the
rise z(x, y) of the unloaded surface, the strains are Marguerre's:

    e = sym grad u + sym(grad z grad w),        k = grad grad w
    U = 1/2 int (e A e - 2 e B k + k D k),      T = 1/2 int rho h w'^2

where A, B and D are the moments of the stiffness over the thickness, and both z and the height in a layer count towards
the striker. The inertia of what moves in the plane (`plane_mass`) is left out, as in Reissner's formulas, so that the
plane follows at once and has no modes of its own. With ribs, which hang far below the middle, it counts. Rigid motions
are exact: a tilt w = x comes with u = -z, which the quartic elements hold, as the rise is quartic itself in each
triangle; their inertia is that of the deflection.

Shallow means slopes of the rise below a tenth or so: the area of the surface, and so its mass, is larger than that of
its outline by half the square of the slope.

References
----------
Marguerre (1938), Proc. 5th Int. Congr. Appl. Mech., 93-101; Leissa (1973), Vibration of shells, NASA SP-288, ch. 2 and
3; Soedel (2004), Vibrations of shells and plates, ch. 6.8.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import block_diag, csc_matrix

from .._base import check
from ..mesh.meshes import Mesh
from . import plane, plates, ribs, slopes, splitting
from .elements import area_coordinates, curvatures, numbering
from .plane import FIRST, LOCAL, SECOND, PlaneSpace
from .ribs import RibLine
from .section import size_at
from .supports import constrain
from .theory import (
    Domain,
    Frame,
    Held,
    Points,
    Subject,
    Term,
    Theory,
    blocks,
    gram,
    no_estimate,
    scatter,
    unknowns_of_cells,
)

# [-] what the rise differs from a quartic along a side, over the thickness, above which triangles are divided: where
# its curvature jumps
KINK = 0.005
MOST_BENT = 20_000  # [-] triangles from which on a rise is refused, as one that jumps, and finer meshes divide no more


class ShallowSpace(PlaneSpace):
    """Shape functions of one mesh: 21 of the deflection, then 15 for each displacement in the plane."""

    heights: np.ndarray  # (n_cells, 15) rise over its mean plane at the nodes of the plane, in the frame
    tilt: np.ndarray  # (2,) slope of that plane
    ribs: Sequence[RibLine] = ()
    drifts: np.ndarray  # (n_all, n) rigid motions in the plane that no edge prevents

    def sloping(self, cells: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """Slopes (n, n_q, 2) of the rise in cells (n,), by gradients of their functions as of `plane.gradients`."""
        found: np.ndarray = (gradient @ self.heights[cells][:, None, :, None])[..., 0]
        return found

    def rigid_unknowns(self, element_dofs: np.ndarray, n_all: int) -> np.ndarray:
        """Unknowns (n_all, 6) of the deflections 1, x and y, and of the rigid motions in the plane."""
        flat = super().rigid_unknowns(element_dofs, n_all)
        for i, part in enumerate((FIRST, SECOND)):
            flat[element_dofs[part].T, 1 + i] = -self.heights
        own, places = np.vstack([element_dofs[FIRST], element_dofs[SECOND]]), plane.nodes(self).transpose(1, 0, 2)
        within = np.zeros((n_all, 3))
        within[own.reshape(2, -1).ravel()] = plane.plane_motions(places.reshape(-1, 2))
        return np.hstack([flat, within])


def strained(space: ShallowSpace, cells: np.ndarray, area: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Strains and negative curvatures (n, n_q, 6, 51) of cells (n,) at area coordinates and places (n, n_q, 3 and 2).

    The area coordinates may be the same for all cells, (1, n_q, 3).
    """
    slope, hessian = space.bending_functions(cells, x, (1, 2))
    gradient = plane.gradients(space, cells, area)
    steep = space.sloping(cells, gradient)
    parts = np.zeros((*x.shape[:2], 6, LOCAL))
    parts[:, :, :3, 21:] = plane.strains(gradient)
    parts[:, :, 0, :21], parts[:, :, 1, :21] = (steep[..., i, None] * slope[:, i] for i in range(2))
    parts[:, :, 2, :21] = steep[..., :1] * slope[:, 1] + steep[..., 1:] * slope[:, 0]
    parts[:, :, 3:, :21] = -curvatures(hessian)
    return parts


def strains_and_motion(space: ShallowSpace, points: Points, cells: np.ndarray) -> list[Term]:
    """Strains and changes of curvature; the deflection moves."""
    area, moved = area_coordinates(points.reference.T)[None], space.functions(cells, points.x[cells], (0,))[0]
    return [Term("K", "walls", strained(space, cells, area, points.x[cells])), Term("M", "inertia", moved[:, :, None])]


def _curved_domain(body: Subject, fields: tuple[str, ...]) -> Domain:
    found = plates.domain(ShallowSpace, body, fields)
    _raise(found.space, body.section, found.frame)
    return found


def _raise(space: ShallowSpace, section: Any, frame: Frame) -> None:
    """Give a space the rise of its section and, apart from it, the tilt, which stretches nothing but costs digits."""
    space.heights, space.tilt = np.zeros((len(space.origin), plane.QUARTIC)), np.zeros(2)
    if section.rise is None:
        return
    local = plane.nodes(space).reshape(-1, 2)
    heights = check.field("rise", section.rise, frame.to_metres(local), "m") / frame.length
    weight = np.repeat(np.sqrt(np.abs(np.linalg.det(space.jacobian))), plane.QUARTIC)
    level, space.tilt = over_mean_plane(local, heights, weight)
    space.heights = level.reshape(-1, plane.QUARTIC)


def over_mean_plane(points: np.ndarray, heights: np.ndarray, weight: Any = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Heights (n,) at points (n, 2) over the plane closest to them by their weights (n,), and its slope (2,)."""
    flat = np.column_stack([np.ones(len(points)), points])
    found = np.linalg.lstsq(flat * np.reshape(weight, (-1, 1)), weight * heights, rcond=None)[0]
    return heights - flat @ found, found[1:]


def _hold_shell(body: Subject, domain: Domain) -> Held:
    rim, space = plates.rim(body, domain, body.kinds), domain.space
    known = body.section, space, domain.frame
    space.ribs = [RibLine.of(rib, ribs.sides_on(body.mesh, rib.path), *known) for rib in body.section.ribs]
    creased = np.unique(np.concatenate([np.zeros(0, int), *(rib.facets.ravel() for rib in space.ribs)]))
    expand, project, dofs = constrain(rim, space.vertices, *numbering(domain.cells, space), creased)
    n_flat, own = expand.shape[0], plane.numbered_unknowns(domain.cells)
    loose, drifts = plane.free_displacements(space, rim, own)
    space.drifts = np.vstack([np.zeros((n_flat, drifts.shape[1])), drifts])
    dofs = np.vstack([dofs, n_flat + own.element_dofs, n_flat + own.N + own.element_dofs])
    expand, project = (block_diag(pair, format="csr") for pair in ((expand, loose), (project, loose.T)))
    n_all = expand.shape[0]
    held = None
    if space.ribs:
        K, M, cells = ribs.matrices_of_ribs(space, domain.frame, strained)
        held = scatter(K, dofs[:, cells], n_all), scatter(M, dofs[:, cells], n_all)
    return Held(expand, project, dofs, plates.springs(body, domain, dofs, n_all), rim, held)


def towards_bends(mesh: Mesh, section: Any, kinds: list[str], coarser: float) -> Mesh:
    """The mesh with smaller triangles at ends and crossings of ribs, and where the rise bends much within them.

    ``coarser`` multiplies their size.
    """
    mesh = ribs.around_ends(mesh, section.ribs, kinds, coarser) if section.ribs else mesh
    share = np.linspace(0.0, 1.0, 9)[:, None, None, None]
    between = np.vander(share[1::2].ravel(), 5) @ np.linalg.inv(np.vander(share[::2].ravel(), 5))  # of a quartic
    rise = getattr(section.rise, "first", None) or section.rise  # the same triangles for `otherwise`
    while rise is not None:
        corner = mesh.points[mesh.cells]
        places = corner + share * (np.roll(corner, -1, axis=1) - corner)
        z = check.field("rise", rise, places.reshape(-1, 2), "m").reshape(9, -1, 3)
        sag = np.abs(z[4] - 0.5 * (z[0] + z[8])).max(axis=1)
        kink = np.abs(z[1::2] - np.tensordot(between, z[::2], 1)).max(axis=(0, 2))
        least = size_at(section, "thickness", corner.mean(axis=1)) * coarser**2
        # bending that does not stretch a curved plate needs displacements beyond quartics where the middle of a side
        # rises more than this over its chord; ten modes of a cymbal then err by 2e-3
        uneven = (sag > 0.5 * least) | (kink > KINK * least)
        if not uneven.any():
            return mesh
        if len(mesh.cells) >= MOST_BENT:
            break
        mesh = splitting.divided_across(mesh, uneven)[0]
    if rise is not None and coarser >= 1.0:
        where = ", ".join(f"{x:.3g}" for x in corner.mean(axis=1)[uneven][0])
        raise ValueError(
            f"rise must be smoother, or the plate thicker: triangles that follow it are more than {MOST_BENT}, as at "
            f"({where}) m; round off jumps and kinks, and check the unit"
        )
    return mesh


class PlaneMass(NamedTuple):
    """The mass of what moves besides the deflection, or all of it, in the frame: a matrix, less a square of another."""

    whole: csc_matrix  # (n_dofs, n_dofs)
    spared: np.ndarray  # (n_dofs, n_drifts)

    @property
    def shape(self) -> tuple[int, int]:
        return self.whole.shape

    def __matmul__(self, vectors: np.ndarray) -> np.ndarray:
        """The mass times vectors (n_dofs, n)."""
        return self.whole @ vectors - self.spared @ (self.spared.T @ vectors)


def plane_mass(system: Any, vectors: np.ndarray) -> np.ndarray:
    """What moves besides the deflection in vectors (n_dofs, n), times its mass (n_dofs, n), in the frame."""
    return mass_in_plane(system) @ vectors


def whole_mass(system: Any) -> PlaneMass:
    """All the mass that counts: of a ribbed plate with that in its plane, of any other body that of the deflection."""
    if not system.ribbed:
        return PlaneMass(system.M, np.zeros((system.n_dofs, 0)))
    found = mass_in_plane(system)
    return PlaneMass(found.whole + system.M, found.spared)


def mass_in_plane(system: Any) -> PlaneMass:
    """The mass of what moves besides the deflection.

    It is that of the displacements in the plane, of ribs at the height of their centroids and as they turn, and of what
    the slope of the rise makes the surface larger. A free body stays where it is in its plane, which spares it a part.
    """
    space, frame, dofs = system.space, system.frame, system.element_dofs
    X, x, dx = slopes.quadrature(system)
    shape, area = plane.reference(X)[0], area_coordinates(X.T)[None]
    local, where = [], [np.arange(len(x))]
    for cells in blocks(len(x)):
        moved = np.zeros((*dx[cells].shape, 3, LOCAL))
        moved[:, :, 0, FIRST] = moved[:, :, 1, SECOND] = shape
        steep = space.sloping(cells, plane.gradients(space, cells, area)) + space.tilt
        larger = np.sqrt(0.5 * (steep**2).sum(axis=2))
        moved[:, :, 2, :21] = larger[..., None] * space.bending_functions(cells, x[cells], (0,))[0]
        local.append(gram(moved, frame.field(system.section, "inertia", x[cells]) * dx[cells]))
    for piece in space.ribs:
        shape = plane.reference(piece.area[..., 1:].reshape(-1, 2).T)[0].reshape(*piece.ds.shape, plane.QUARTIC)
        slope = space.functions(piece.cells, piece.x, (1,))[0].transpose(0, 2, 1, 3)
        moved = -(piece.stiffness[..., 0, 1] / piece.stiffness[..., 0, 0] / frame.length)[..., None, None] * slope
        moved[:, :, 0, FIRST] = moved[:, :, 1, SECOND] = shape
        turns = piece.rib.turning(frame.to_metres(piece.x)).reshape(piece.ds.shape) / frame.length**2
        each = gram(moved, piece.inertia * piece.ds) + gram(slope, turns * piece.ds)
        local.append(each / (frame.inertia * frame.length))
        where.append(piece.cells)
    whole = scatter(np.concatenate(local), dofs[:, np.concatenate(where)], system.expand.shape[0])
    drifting = whole @ space.drifts
    square = np.linalg.cholesky(space.drifts.T @ drifting)
    return PlaneMass(system.expand.T @ whole @ system.expand, system.expand.T @ np.linalg.solve(square, drifting.T).T)


def shell_energies(system: Any, section: Any, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Twice the mutual strain energy, and the mutual mass (n, n) of vectors (n_dofs, n), with another section.

    Its ribs, if any, lie where those of the system do.
    """
    space, frame = copy(system.space), system.frame
    if len(section.ribs) != len(space.ribs):
        raise ValueError(f"a section must keep the {len(space.ribs)} ribs of the body, got {len(section.ribs)}")
    _raise(space, section, frame)
    space.ribs = [RibLine.of(rib, line.facets, section, space, frame) for rib, line in zip(section.ribs, space.ribs)]
    whole = unknowns_of_cells(system, vectors)
    K, M = slopes.section_energies(system, space, partial(frame.field, section), vectors)
    if space.ribs:
        *each, cells = ribs.matrices_of_ribs(space, frame, strained)
        for part, total in zip(each, (K, M)):
            total += np.einsum("nki,nkl,nlj->ij", whole[cells], part, whole[cells], optimize=True)
        M += vectors.T @ plane_mass(replace(system, space=space, section=section), vectors)
    return K, M


def steepest(system: Any) -> float:
    """The steepest slope [-] of the rise of a shell."""
    space = system.space
    cells, area = np.arange(len(space.origin)), area_coordinates(plane.NODES)[None]
    return float(np.linalg.norm(space.sloping(cells, plane.gradients(space, cells, area)) + space.tilt, axis=2).max())


SHALLOW = Theory(
    "shallow", "argyris and quartic", 2, _curved_domain, strains_and_motion, _hold_shell, no_estimate, wave=1.8,
    unknowns=47.0, fields=("stiffness", "inertia", "walls"), graded=True, compared=True, sharp=plates.is_tiny,
    layered=towards_bends, energies=shell_energies,
)  # fmt: skip
