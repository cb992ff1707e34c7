"""Reissner-Mindlin plates: deflection by Argyris triangles, shear strain by scikit-fem's quartic ones.

A thick plate has a deflection w and rotations beta of its normals. Its energy is that of bending, with the curvatures
of beta, and of shear, with the shear strain gamma = grad w - beta:

    U = 1/2 int (kappa(beta) D kappa(beta) + gamma S gamma),     S = 5/6 h (G_xz, G_yz)
    T = 1/2 int (rho h w'^2 + rho h^3/12 |beta'|^2)

The unknowns here are w and gamma, and beta = grad w - gamma. That removes locking by construction: as the plate becomes
thin, gamma vanishes and what remains is the Kirchhoff plate on the same triangles, on curved edges too. With w and beta
as unknowns, the shear energy is a difference of nearly equal numbers, (L/h)^2 times as large as that of bending; here
no digit is lost at h/L = 1e-6 (``studies/verification/thick_elements.py`` compares four elements). The price is that w
has no kinks: where the thickness jumps, w of a thick plate has one, and the frequencies converge slowly.

In triangles much smaller than the thickness, as around a re-entrant corner, bending would in turn be the difference of
grad w and gamma. There the nodes of gamma hold beta instead (`MindlinSpace.turned`): the same functions, as grad w of
the quintic w is quartic itself.

Edges, on the true curve (n outward, t along it):

    free         nothing
    soft hinged  w = 0
    hinged       w = 0 and beta_t = 0, as gamma_t = 0: a "hard" hinge; for polygons Wang's relation holds
    clamped      w = 0 and beta = 0, as gamma_t = 0, gamma_n = w_n

Wang's relation is that of convex polygons. The modes of a hinged membrane that swing at a re-entrant corner as
r**(pi / angle) have slopes of infinite bending energy, so they are no modes of either plate: the first frequency of an
L-shaped plate is 33 % above that of Kirchhoff's plate by the membrane, and 13 % below Wang's at h = a / 5, where a is
its shorter side (Sapondzhyan's paradox). Modes that are at rest there follow the relation.

Free and soft edges let beta_t relax within a layer of width h / sqrt(12 kappa), about h/3. `mesh_with_layer` makes the
triangles shrink to a thickness there. If that takes too many, `errors_by_layers` estimates what a coarser layer misses:
the twisting moment M_nt of the thin plate does work on the relaxation, to first order M_nt^2 width / (2 G h^3/12) per
length.

A point force sinks into a Mindlin plate without limit, as log(1/r). The real force acts through the thickness; its
stress at the bottom is that of a thin plate under a load spread evenly over a disk of radius 0.325 h (Westergaard).
So forces, point masses and the deflection at a point are all spread over this disk (`Theory.patch`), cut at the edge
and weighted so that its centre is the point. This keeps reciprocity and rigid motions exact, and the contact law alone
stands for the indentation below the striker.

References
----------
Mindlin (1951), J. Appl. Mech. 18, 31-38; Beirao da Veiga, Hughes, Kiendl, Lovadina, Niiranen, Reali and Speleers
(2015), Math. Models Methods Appl. Sci. 25, 1519-1551 (deflection and shear as unknowns); Arnold and Falk (1989), SIAM
J. Math. Anal. 20, 1-26 (the layer); Westergaard (1926), Public Roads 7, 25-35, and Timoshenko and Woinowsky-Krieger,
Theory of plates and shells, art. 19 (0.325 h).
"""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse import block_diag, coo_matrix, csc_matrix, csr_matrix
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from ..mesh.mesh_files import side_lengths
from ..mesh.meshes import LONGEST, Mesh
from . import plane, plates, splitting, supports
from .elements import area_coordinates, curvatures, numbering
from .plane import FIRST, LOCAL, QUARTIC, SECOND, PlaneSpace, reference
from .section import KINDS, SOFT, Plate, size_at
from .springs import at_facets
from .theory import Domain, Held, Points, Subject, Term, Theory

# [-] radius over which a point force is spread, over the thickness: right stress below a small load (Westergaard 1926)
PATCH = 0.325
LOOSE = "free", SOFT  # supports with a layer
# [-] most triangles along these edges, to bound the size of the mesh; a plate that needs more keeps larger ones
MOST_LAYER = 120.0
SMALL = 0.1  # [-] longest side over the thickness below which nodes hold rotations: either choice loses two digits here


class MindlinSpace(PlaneSpace):
    """Shape functions of one mesh: 21 of the deflection, then 15 for each component of the shear strain."""

    turned: np.ndarray  # (n_cells, 15) nodes that hold rotations, not shear strains

    def slopes_in_rotations(self, cells: np.ndarray, *shapes: np.ndarray) -> list[np.ndarray]:
        """Part of grad w in the rotations of cells (n,): at nodes that hold shear strains; (.., n_q, 2, 21) each.

        ``shapes`` (n, .., n_q, 15) are the quartic functions or their derivatives. For straight triangles.
        """
        node = plane.NODES - 1.0 / 3.0
        x = self.straight(cells, node)
        slope = self.bending_functions(cells, x, (1,))[0].transpose(0, 2, 1, 3)  # (n, 15, 2, 21)
        slope = slope * ~self.turned[cells][:, :, None, None]
        return [np.einsum("n...k,nkis->n...is", shape, slope, optimize=True) for shape in shapes]

    def rotations(self, cells: np.ndarray, area: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Rotations (n, 2, n_q, 51) by each unknown of cells (n,) at area coordinates and places (n, n_q, 3 and 2)."""
        slope = self.functions(cells, points, (1,))[0]
        shape = reference(area[..., 1:].reshape(-1, 2).T)[0].reshape(*points.shape[:2], QUARTIC)
        own = np.where(self.turned[cells], 1.0, -1.0)[:, None] * shape
        slope[:, 0, :, FIRST] = slope[:, 1, :, SECOND] = own
        small = np.flatnonzero(self.turned[cells].any(axis=1))
        if small.size:
            slope[small, ..., :21] = self.slopes_in_rotations(cells[small], shape[small])[0].transpose(0, 2, 1, 3)
        return slope

    def rigid_unknowns(self, element_dofs: np.ndarray, n_all: int) -> np.ndarray:
        """Unknowns (n_all, 3) of the deflections 1, x and y, which have no shear strain."""
        found = super().rigid_unknowns(element_dofs, n_all)
        for i in range(2):
            rows = element_dofs[(FIRST, SECOND)[i]].T[self.turned]
            found[rows, 1 + i] = 1.0
        return found


def terms(space: MindlinSpace, points: Points, cells: np.ndarray) -> list[Term]:
    """Curvatures of the rotation and shear strains, deflection and rotation."""
    value, slope, hessian = space.bending_functions(cells, points.x[cells], (0, 1, 2))
    shape = reference(points.reference)[0]
    n, n_q = value.shape[:2]
    area = area_coordinates(points.reference.T)[None]
    gradient = plane.gradients(space, cells, area).transpose(0, 2, 1, 3)  # of gamma's shapes in x and y
    deflection, rotation = np.zeros((n, n_q, 1, LOCAL)), np.zeros((n, n_q, 2, LOCAL))
    shear, curvature = np.zeros((n, n_q, 2, LOCAL)), np.zeros((n, n_q, 3, LOCAL))
    deflection[:, :, 0, :21] = value
    sign = np.where(space.turned[cells], -1.0, 1.0)[:, None]  # of the shear strains in the unknowns
    shear[:, :, 0, FIRST] = shear[:, :, 1, SECOND] = sign * shape
    rotation[..., :21] = slope.transpose(0, 2, 1, 3)
    rotation -= shear
    own = gradient * sign[:, None]
    curvature[..., :21] = curvatures(hessian)
    curvature[:, :, 0, FIRST] = curvature[:, :, 2, SECOND] = -own[:, 0]
    curvature[:, :, 1, SECOND] = curvature[:, :, 2, FIRST] = -own[:, 1]
    small = np.flatnonzero(space.turned[cells].any(axis=1))
    if small.size:
        values = np.broadcast_to(shape, (len(small), *shape.shape))
        tilt, bend = space.slopes_in_rotations(cells[small], values, gradient[small])
        shear[small, ..., :21] = rotation[small, ..., :21] - tilt
        rotation[small, ..., :21] = tilt
        curvature[small, ..., :21] = np.stack(
            [bend[:, 0, :, 0], bend[:, 1, :, 1], bend[:, 0, :, 1] + bend[:, 1, :, 0]], axis=2
        )
    return [
        Term("K", "stiffness", curvature), Term("K", "shear", shear),
        Term("M", "inertia", deflection), Term("M", "rotary", rotation),
    ]  # fmt: skip


def _domain(body: Subject, fields: tuple[str, ...]) -> Domain:
    found = plates.domain(MindlinSpace, body, fields)
    space, frame = found.space, found.frame
    h = size_at(body.section, "thickness", frame.to_metres(space.origin)) / frame.length
    longest = side_lengths(found.cells.p.T, space.vertices).max(axis=1)
    dofs = plane.numbered_unknowns(found.cells).element_dofs.T  # (n_cells, 15)
    # nodes of straight triangles much smaller than their thickness
    small = np.setdiff1d(dofs[(longest < SMALL * h) & ~space.curved], dofs[space.curved])
    space.turned = np.isin(dofs, small)
    return found


def _hold(body: Subject, domain: Domain) -> Held:
    space, kinds, own = domain.space, body.kinds, plane.numbered_unknowns(domain.cells)
    # supports of a thin plate that hold the deflection as these do: rotations are held apart
    rim = plates.rim(body, domain, ["free" if kind == "free" else "hinged" for kind in kinds])
    expand, project, dofs = supports.constrain(rim, space.vertices, *numbering(domain.cells, space))
    cells, sides = supports.cells_of_facets(rim.facets, space.vertices)
    held = np.array([kind != "free" for kind in rim.kinds])
    if space.bent is not None:
        slips = np.flatnonzero(held & (space.bent.of_side[cells, sides] >= 0))
        if slips.size:
            expand, project = _without_slip(space, rim, slips, cells[slips], sides[slips], dofs, expand, project)
    n_flat = expand.shape[0]
    dofs = np.vstack([dofs, n_flat + own.element_dofs, n_flat + own.N + own.element_dofs])
    words = [{"hinged": "sliding", "clamped": "held"}.get(kind, "free") for kind in kinds]
    loose, at = plane.held_at(space, rim.facets, words, own)
    local, x, normal = plane.at_rim(space, rim.facets, cells, sides)
    slope = space.bending_functions(cells, x, (1,))[0].transpose(0, 2, 1, 3)  # (n_facets, 5, 2, 21)
    tied: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []  # rows, columns and values of gamma_n = w_n
    for node, facets in at.items():
        facet, k = next((place for place in facets if kinds[place[0]] == "clamped"), (-1, -1))
        if facet < 0 or space.turned[cells[facet], local[facet, k]]:
            continue
        n = normal[facet, k]
        row = n @ slope[facet, k]  # (21,)
        for i in range(2):
            tied.append((np.full(21, node + i * own.N), dofs[:21, cells[facet]], n[i] * row))
    whole = block_diag([expand, loose], format="csr")
    if tied:
        row, column, value = (np.concatenate(part) for part in zip(*tied))
        tie = coo_matrix((value, (row, column)), shape=(2 * own.N, n_flat)).tocsr() @ expand
        lower = block_diag([csr_matrix((n_flat, 0)), tie], format="csr")
        lower.resize(whole.shape)
        whole = (whole + lower).tocsr()
    springs = plates.springs(body, domain, dofs, whole.shape[0], space.rotations)
    project = block_diag([project, loose.T], format="csr")
    return Held(whole, project, dofs, springs, replace(rim, kinds=kinds))


def _without_slip(
    space: MindlinSpace, rim: supports.SupportedRim, slips: np.ndarray, cells: np.ndarray, sides: np.ndarray,
    dofs: np.ndarray, expand: csr_matrix, project: csr_matrix,
) -> tuple[csr_matrix, csr_matrix]:  # fmt: skip
    """Make the slope across curved held edges ``slips`` (n,) cubic along them, by their mid-side unknowns.

    The supports hold w to the second derivative at both ends of a facet. In between, on the curve, w is the part of
    fourth degree of this slope times the height over the chord. A thin plate is too stiff to use that; a thick one
    would slip there, and its error would only fall as size**3.
    """
    x, normal = plane.at_rim(space, rim.facets[slips], cells, sides)[1:]
    slope = space.bending_functions(cells, x, (1,))[0]  # (n, 2, 5, 21)
    fourth = np.einsum("ni,niqk,q->nk", normal[:, 3], slope, np.array([1.0, 1.0, -4.0, 6.0, -4.0]))
    rows = np.repeat(np.arange(len(slips)), 21)
    whole = csc_matrix((fourth.ravel(), (rows, dofs[:21, cells].T.ravel())), shape=(len(slips), expand.shape[0]))
    middle = dofs[18 + sides, cells]
    gone = expand[middle].indices  # each is an unknown of its own
    kept = np.setdiff1d(np.arange(expand.shape[1]), gone)
    expand, project = expand[:, kept], project[kept]
    solved = csr_matrix(spsolve(whole[:, middle], csc_matrix(-whole @ expand)))
    place = csr_matrix((np.ones(len(middle)), (middle, np.arange(len(middle)))), shape=(expand.shape[0], len(middle)))
    return (expand + place @ solved).tocsr(), project.tocsr()


def mesh_with_layer(mesh: Mesh, section: Plate, kinds: list[str], coarser: float) -> Mesh:
    """The mesh with triangles that resolve the layer along free and soft edges, if `MOST_LAYER` of them suffice.

    ``kinds`` (n_facets,) are the supports; ``coarser`` [-] multiplies the size of the triangles there.
    """
    loose = np.isin(kinds, LOOSE)
    if not loose.any():
        return mesh
    thin = float(size_at(section, "thickness", mesh.middles[loose]).min())
    # triangles of twice the thickness h err by some 2e-4 h / L of a frequency
    size = coarser * max(2.0 * thin, float(mesh.chords[loose].sum()) / MOST_LAYER)
    while True:
        ends, steps = mesh.points[mesh.facets[loose]], np.ceil(2.0 * mesh.chords[loose] / size).astype(int)
        along = [np.linspace(0.0, 1.0, n + 1)[:, None] * (b - a) + a for (a, b), n in zip(ends, steps)]
        away = cKDTree(np.concatenate(along)).query(mesh.points[mesh.cells])[0].min(axis=1)
        longest = side_lengths(mesh.points, mesh.cells).max(axis=1)
        tall = longest > np.maximum(size, splitting.GROWTH * away) * LONGEST
        if not tall.any():
            return mesh
        mesh, parent = splitting.divided_across(mesh, tall)
        loose = loose[parent]


def errors_by_layers(system: Any, vectors: np.ndarray, loads: np.ndarray, forced: Any = None) -> np.ndarray:
    """Errors (3, n) of the squared energy norm that vectors keep where triangles are too large for the edge layers.

    They are those of the second part, which falls with the fourth power of the size. The rest is estimated from a
    second mesh.
    """
    space, rim, frame = system.space, system.rim, system.frame
    loose = np.flatnonzero(np.isin(rim.kinds, LOOSE))
    if not loose.size:
        return np.zeros((3, vectors.shape[1]))
    cells, _, x, ds, normal = at_facets(space, rim.facets[loose])
    nx, ny = np.moveaxis(normal, 2, 0)
    stiffness, shear = (frame.field(system.section, name, x) for name in ("stiffness", "shear"))
    along = np.stack([-ny, nx], axis=-1)
    turn = np.stack([-nx * ny, nx * ny, nx**2 - ny**2], axis=-1)  # the moment M_nt from M_xx, M_yy, M_xy
    twist = np.stack([-2.0 * nx * ny, 2.0 * nx * ny, nx**2 - ny**2], axis=-1)  # strains of a unit 2 kappa_nt
    rigidity = np.einsum("fqi,fqij,fqj->fq", 0.5 * twist * [1.0, 1.0, 2.0], stiffness, 0.5 * twist * [1.0, 1.0, 2.0])
    width = np.sqrt(rigidity / np.einsum("fqi,fqij,fqj->fq", along, shear, along))
    thin = size_at(system.section, "thickness", frame.to_metres(x)).reshape(ds.shape) / frame.length
    coarse = ds.sum(axis=1)[:, None] / thin
    # sides of nine thicknesses miss the layer; 90 meshes of 18 plates erred by two thirds of the claim at most
    share = np.minimum(1.0, (coarse / 9.0) ** 4)
    bend = curvatures(space.bending_functions(cells, x, (2,))[0])
    unknowns = (system.expand @ vectors)[system.element_dofs[:21, cells]].transpose(1, 0, 2)
    moment = np.einsum("fqi,fqij,fqjk->fqk", turn, stiffness, bend, optimize=True) @ unknowns
    return np.outer([0.0, 1.0, 0.0], np.einsum("fqk,fq->k", moment**2, share * width / rigidity * ds))


MINDLIN = Theory(
    "mindlin", "argyris and shear", 2, _domain, terms, _hold, errors_by_layers, wave=1.8, unknowns=47.0,
    fields=("stiffness", "inertia", "shear", "rotary"), words=(*KINDS, SOFT), graded=True, compared=True,
    patch=PATCH, sharp=plates.is_tiny, layered=mesh_with_layer,
)  # fmt: skip
