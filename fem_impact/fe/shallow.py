"""Shallow shells: plates whose plane answers when they bend, because they are curved, ribbed or unevenly layered.

The unknowns are the deflection w, by Argyris triangles, and the displacements u in the plane, by quartic ones. With the
rise z(x, y) of the unloaded surface, the strains are Marguerre's:

    e = sym grad u + sym(grad z grad w),        k = grad grad w
    U = 1/2 int (e A e - 2 e B k + k D k),      T = 1/2 int rho h w'^2

where A, B and D are the moments of the stiffness over the thickness, and both z and the height in a layer count towards
the striker. The inertia of motions in the plane is left out: `plane_inertia` tells what it would do. Rigid motions are
exact: a tilt w = x comes with u = -z, which the quartic elements hold, as the rise is quartic itself in each triangle.

Shallow means slopes of the rise below a tenth or so: the area of the surface, and so its mass, is larger than that of
its outline by half the square of the slope.

References
----------
Marguerre (1938), Proc. 5th Int. Congr. Appl. Mech., 93-101; Leissa (1973), Vibration of shells, NASA SP-288, ch. 2 and
3; Soedel (2004), Vibrations of shells and plates, ch. 6.8.
"""

from typing import Any

import numpy as np
from skfem import Dofs, ElementTriP4

from .._base import check
from . import plane, plates, ribs
from .elements import curvatures, numbering
from .plane import FIRST, LOCAL, SECOND, PlaneSpace
from .supports import constrain
from .theory import Body, Domain, Held, Points, Term, Theory


class ShallowSpace(PlaneSpace):
    """Shape functions of one mesh: 21 of the deflection, then 15 for each displacement in the plane."""

    heights: np.ndarray  # (n_cells, 15) rise at the nodes of the plane, in the frame
    ribs: list[ribs.Piece]

    def linear(self, element_dofs: np.ndarray, n_all: int) -> np.ndarray:
        """Unknowns (n_all, 6) of the deflections 1, x and y, and of the rigid motions in the plane."""
        flat = self.flat.linear(element_dofs[:21], n_all)
        for i, part in enumerate((FIRST, SECOND)):
            flat[element_dofs[part].T, 1 + i] = -self.heights
        own, places = np.vstack([element_dofs[FIRST], element_dofs[SECOND]]), plane.nodes(self.inner).transpose(1, 0, 2)
        within = np.zeros((n_all, 3))
        within[own.reshape(2, -1).ravel()] = plane.rigid(places.reshape(-1, 2))
        return np.hstack([flat, within])


def strained(space: ShallowSpace, cells: np.ndarray, area: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Strains and negative curvatures (n, n_q, 6, 51) of cells (n,) at area coordinates and places (n, n_q, 3 and 2).

    The area coordinates may be the same for all cells, (1, n_q, 3).
    """
    slope, hessian = space.flat.functions(cells, x, (1, 2))
    gradient = plane.gradients(space.inner, cells, area)
    steep = (gradient @ space.heights[cells][:, None, :, None])[..., 0]  # (n, n_q, 2) of the rise
    parts = np.zeros((*x.shape[:2], 6, LOCAL))
    parts[:, :, :3, 21:] = plane.strains(gradient)
    parts[:, :, 0, :21], parts[:, :, 1, :21] = (steep[..., i, None] * slope[:, i] for i in range(2))
    parts[:, :, 2, :21] = steep[..., :1] * slope[:, 1] + steep[..., 1:] * slope[:, 0]
    parts[:, :, 3:, :21] = -curvatures(hessian)
    return parts


def terms(space: ShallowSpace, points: Points, cells: np.ndarray) -> list[Term]:
    """Strains and changes of curvature; the deflection moves."""
    X = points.reference
    area = np.stack([1.0 - X[0] - X[1], *X], axis=1)[None]
    moved = space.functions(cells, points.x[cells], (0,))[0][:, :, None]
    return [Term("K", "walls", strained(space, cells, area, points.x[cells])), Term("M", "inertia", moved)]


def _domain(body: Body, fields: tuple[str, ...]) -> Domain:
    found = plates.domain(body, ShallowSpace, fields)
    space, rise = found.space, body.section.rise
    space.heights = np.zeros((len(space.origin), plane.QUARTIC))
    if rise is not None:
        places = found.frame.places(plane.nodes(space.inner))
        space.heights[:] = check.field("rise", rise, places, "m").reshape(space.heights.shape) / found.frame.length
    return found


def _hold(body: Body, domain: Domain) -> Held:
    rim, space = plates.rim(body, domain, body.kinds), domain.space
    expand, project, dofs = constrain(rim, space.vertices, *numbering(domain.cells, space.flat))
    n_flat, own = expand.shape[0], Dofs(domain.cells, ElementTriP4())
    loose = plane.loosened(space.inner, rim, own)
    dofs = np.vstack([dofs, n_flat + own.element_dofs, n_flat + own.N + own.element_dofs])
    expand, project = plane.beside(expand, loose), plane.beside(project, loose.T)
    n_all = expand.shape[0]
    space.ribs = ribs.pieces(body, domain)
    held = ribs.attached(domain, dofs, n_all, strained) if space.ribs else None
    return Held(expand, project, dofs, plates.springs(body, domain, dofs, n_all), rim, held)


def _errors(system: Any, vectors: np.ndarray, loads: np.ndarray, forced: Any = None) -> np.ndarray:
    """Errors (3, n) of the squared energy norm: none, as a second mesh tells all of it."""
    return np.zeros((3, vectors.shape[1]))


SHALLOW = Theory(
    "shallow", "argyris and quartic", 2, _domain, terms, _hold, _errors, wave=1.8, unknowns=47.0,
    fields=("stiffness", "inertia", "walls"), graded=True, compared=True, sharp=plates.is_tiny,
)  # fmt: skip
