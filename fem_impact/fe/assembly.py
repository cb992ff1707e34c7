"""Assemble the stiffness and mass matrices of a body from its mesh, section and supports."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh, qr
from scipy.sparse import coo_matrix, csc_matrix, csr_matrix, diags, eye_array, vstack

from .._base import check, explained, markup
from .._base.rounding import ROUNDING, SAME
from .._base.untyped import Sparse
from ..mesh import sketch
from ..mesh.facets import Curves
from ..mesh.meshes import Mesh, aligned, pierced
from . import beam_elements, plausible, shear_beam, thick
from .beam_elements import HermiteSpace
from .corners import SAY, around_corners
from .elements import CHUNK, ArgyrisSpace, Bent, MorleySpace, numbering, quadrature, triangles
from .section import KINDS, SOFT, Beam, Elastic, Plate, directional, evaluate
from .shear_beam import TimoshenkoSpace
from .splitting import towards_points
from .springs import beam_springs, check_masses, check_posts, edge_springs, plate_springs
from .supports import SupportedRim, cells_of_facets, constrain
from .thick import MindlinSpace, ThickStrain

THEORIES = {2: ("kirchhoff", "mindlin"), 1: ("euler", "timoshenko")}  # by dimension; the first is the default
THICK = ("mindlin", "timoshenko")  # theories with shear and rotary inertia
ELEMENTS: dict[str, tuple[str, ...]] = {
    "kirchhoff": ("argyris", "morley"), "mindlin": ("argyris and shear",),
    "euler": ("hermite",), "timoshenko": ("hermite and shear",),
}  # fmt: skip
HOLDS = {"hinged": 3, "clamped": 6}  # unknowns of a thin plate that a held facet and its first vertex take away
MORLEY_ORDER = 4  # [-] order of the quadrature on Morley elements; exact for products of quadratics
MASS_ORDER = 10  # [-] order of the quadrature on Argyris elements; exact for products of quintics
# [-] smallest triangle over the extent below which eigenvalues come from the strain energy: rounding in K grows as the
# size to the power -2, and larger triangles leave 1e-11
TINY = 4e-3


class Attached(NamedTuple):
    """What is attached to a body at points."""

    masses: list[tuple[np.ndarray, float]]  # points [m] and masses [kg]
    posts: list[tuple[np.ndarray, float]]  # points [m] and stiffnesses [N/m] of what holds them; infinite if hinged

    @property
    def points(self) -> list[np.ndarray]:
        return [point for point, _ in (*self.masses, *self.posts)]


@dataclass(frozen=True, eq=False)
class Frame:
    """The units used for one body, so that its size, position and stiffness do not affect the accuracy."""

    centre: np.ndarray  # (dimension,) [m]
    length: float  # [m]
    stiffness: float  # [N m] on a plate, [N m^2] on a beam
    inertia: float  # [kg/m^2] on a plate, [kg/m] on a beam

    @property
    def rate(self) -> float:
        """Angular frequency [rad/s] of an eigenvalue 1 in the frame."""
        return float(np.sqrt(self.stiffness / self.inertia) / self.length**2)

    @property
    def mass(self) -> float:
        """Mass [kg] of a mass 1 in the frame."""
        return float(self.inertia * self.length ** len(self.centre))

    def local(self, points: np.ndarray) -> np.ndarray:
        """Coordinates [-] in the frame of points [m]."""
        return (points - self.centre) / self.length


def curvatures(hessian: np.ndarray) -> np.ndarray:
    """Curvatures (xx, yy, 2 xy) of shape functions, (n, n_q, 3, n_local), from (xx, xy, yy), (n, 3, n_q, n_local)."""
    return hessian[:, [0, 2, 1]].transpose(0, 2, 1, 3) * np.array([1.0, 1.0, 2.0])[:, None]


@dataclass(frozen=True, eq=False)
class Strain:
    """Data to compute the strain energy of a plate from curvatures, where triangles are so small that K loses digits.

    The stiffness of a triangle grows with its size to the power -2, so the rounding of K in the smallest triangles
    affects the total energy. Curvature squared times area is equally accurate in all triangles.
    """

    x: np.ndarray  # (n_cells, n_q, 2) quadrature points
    stiffness: np.ndarray  # (n_cells, n_q, 3, 3) times the quadrature weights
    springs: Sparse  # (n_all, n_all) stiffness of elastic supports and tension

    def __repr__(self) -> str:
        return check.brief(self)

    def energy(self, system: "System", vectors: np.ndarray) -> np.ndarray:
        """Twice the strain energy (n_modes,) of vectors (n_dofs, n_modes)."""
        return self._sum(system, vectors, "nqik,nqik->k")

    def products(self, system: "System", vectors: np.ndarray) -> np.ndarray:
        """Twice the mutual strain energy (n, n) of all pairs of vectors (n_dofs, n)."""
        return self._sum(system, vectors, "nqik,nqil->kl")

    def around(self, system: "System", vectors: np.ndarray, vertex: int) -> np.ndarray:
        """Twice the strain energy (n_modes,) in the ring of triangles around those that touch a vertex of the mesh."""
        space: Any = system.space
        corners = space.vertices
        touching = (corners == vertex).any(axis=1)
        ring = np.isin(corners, corners[touching]).any(axis=1) & ~touching
        far = np.linalg.norm(self.x.mean(axis=1) - self.x[touching].mean(axis=(0, 1)), axis=1)
        ring &= far < 4.0 * far[touching].max()  # not the neighbours of its outer vertices, where one ring is all
        moved = system.expand @ vectors
        return np.einsum("nqik,nqik->k", *self._curved(system, moved, np.flatnonzero(ring)))

    def _curved(self, system: "System", moved: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Moments and curvatures (n, n_q, 3, n_modes) in cells (n,)."""
        bend = curvatures(*system.space.functions(cells, self.x[cells], (2,)))
        curved = bend @ moved[system.element_dofs[:, cells].T][:, None]
        return self.stiffness[cells] @ curved, curved

    def _sum(self, system: "System", vectors: np.ndarray, pairs: str) -> np.ndarray:
        moved = system.expand @ vectors
        total = np.einsum(pairs.replace("nqi", "n"), moved, self.springs @ moved)
        for start in range(0, len(self.x), CHUNK):
            cells = np.arange(start, min(start + CHUNK, len(self.x)))
            total += np.einsum(pairs, *self._curved(system, moved, cells))
        return total


@dataclass(frozen=True, eq=False)
class System:
    """Stiffness and mass of a supported body in the units of its frame, and the shape functions."""

    mesh: Mesh
    section: Plate | Beam
    supports: dict[str, Any]
    element: str
    mass: float  # [kg] of the whole body
    frame: Frame
    K: Sparse = field(repr=False)  # (n_dofs, n_dofs) [-] for the unknowns not fixed by supports
    M: Sparse = field(repr=False)  # (n_dofs, n_dofs) [-]
    expand: Sparse = field(repr=False)  # (n_all, n_dofs) from these unknowns to all unknowns of the elements
    element_dofs: np.ndarray = field(repr=False)  # (n_local, n_cells) unknowns of each cell, among all
    space: ArgyrisSpace | HermiteSpace | MorleySpace | MindlinSpace | TimoshenkoSpace = field(repr=False)
    rigid: np.ndarray = field(repr=False)  # (n_dofs, n_rigid) [-] mass-normalised rigid motions
    # those that only weak springs resist, (n_dofs, n_sprung) [-] mass-normalised, and the forces of these springs
    sprung: np.ndarray = field(repr=False)
    pull: np.ndarray = field(repr=False)
    # (n_rigid + n_sprung,) unknowns that, when fixed, just prevent these motions
    held: np.ndarray = field(repr=False)
    graded: bool = True  # whether rings of shrinking triangles surround singular corners
    # boundary of the triangles used, in the frame; None on a beam
    rim: SupportedRim | None = field(default=None, repr=False)
    order: float = np.inf  # [-] power of the element size with which corners let the frequency error fall
    softness: float = 1.0  # [-] largest inertia over stiffness on the body, in the frame; sets the shortest waves
    point_masses: tuple[Any, ...] = ()  # pairs of point [m] and mass [kg]
    point_supports: tuple[Any, ...] = ()  # pairs of point [m] and stiffness [N/m], infinite if hinged
    strain: Strain | ThickStrain | None = field(default=None, repr=False)
    near: np.ndarray | None = None  # (n_points, 2) [m] points towards which the triangles shrink
    coarseness: float = 1.0  # [-] size of the triangles there, over the usual one
    layer: float = 1.0  # [-] size of triangles along free edges of a thick plate, over the usual one
    unresolved: float = 0.0  # [-] approximate relative error that singular corners leave on any mesh

    def __repr__(self) -> str:
        return check.brief(self)

    def _repr_html_(self) -> str:
        """Notebook view: the body with its supports, and a table of its size."""
        held = ", ".join(f"{name} {kind}" for name, kind in self.supports.items())
        rows = [("theory", self.theory), ("mass", f"{self.mass:.4g} kg"), ("supports", held), ("unknowns", self.n_dofs)]
        drawn = sketch.body(self.mesh, supports=self.supports, title=f"Outline of a body of {self.mass:.4g} kg: {held}")
        return markup.side_by_side(drawn, markup.table(rows))

    @property
    def theory(self) -> str:
        """The theory: "kirchhoff" or "mindlin" of a plate, "euler" or "timoshenko" of a beam."""
        return next(theory for theory, elements in ELEMENTS.items() if self.element in elements)

    @property
    def n_dofs(self) -> int:
        """Number of unknowns not fixed by supports."""
        return self.K.shape[0]

    @property
    def notes(self) -> tuple[str, ...]:
        """What mesh and theory assumed, and numbers that are probably a slip of a unit."""
        assumed = plausible.rolling(self.section.material) if self.theory == "mindlin" else ()
        if self.unresolved > SAY:
            corner = f"corners leave the frequencies uncertain by {100.0 * self.unresolved:.2g} %, whatever the mesh"
            assumed = (*assumed, f"{corner}: hinged edges that meet near or beyond 180 degrees do, and free notches")
        return plausible.together(notes_on(self.mesh, self.section), assumed)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Whether each point (n_points, dimension) [m] lies on the body, (n_points,) bool."""
        return self.space.locate(self.frame.local(points))[1]

    def interpolate(self, points: np.ndarray) -> Sparse:
        """Matrix (n_points, n_dofs) [-] from the unknowns to the deflection at points (n_points, dimension) [m].

        On a thick plate it is the mean over the disk on which a force at the point acts, see `thick`.
        """
        rows = _interpolation(self.space, self.element_dofs, self.expand, self.frame, self.section, points)
        return rows @ self.expand


@check.typed
def assemble(
    mesh: Mesh,
    section: Plate | Beam,
    supports: Mapping[str, str | Elastic] | None = None,
    element: str | None = None,
    *,
    theory: str | None = None,
    point_masses: Sequence[tuple[ArrayLike, float]] = (),
    point_supports: Sequence[ArrayLike | tuple[ArrayLike, float]] = (),
    near: Any = None,
    coarseness: float = 1.0,
    graded: bool = True,
) -> System:
    """Assemble stiffness and mass of a body supported at its named edges.

    Parameters
    ----------
    mesh : Mesh
    section : Plate on a plane mesh, Beam on a line
    supports : dict, name of an edge -> "clamped", "hinged", "free" or an Elastic
        Edges not named are free. "boundary" means all edges; a support of a part overrides that of the whole. On a
        thick plate "hinged" also holds the rotation along the edge; "soft hinged" does not, nor does an Elastic.
    element : str, optional
        For a thin plate "argyris" (the default; frequencies from above) or "morley" (from below, straight edges only,
        as a check). Otherwise there is one for each theory.
    theory : str, optional
        For a plate "kirchhoff" (the default; thin) or "mindlin" (with shear and rotary inertia); for a beam "euler" or
        "timoshenko". A thick plate takes some five times as long. A force, a mass or an observed point acts on it over
        a disk of radius 0.325 times the thickness, because under a point it would give way without limit.
    point_masses : sequence of (point [m], mass [kg])
        Masses without extent that move with the plate or beam.
    point_supports : sequence of (point [m], "hinged" or stiffness [N/m]) or (point [m], "clamped", radius [m])
        Points held at rest, free to turn, or by a spring: cords at the nodes of a marimba bar, the feet of a panel. A
        disk of a plate that is clamped, such as between the nuts of a post, becomes a hole with a clamped edge
        "clamp0" ... of the mesh.
    near : array_like, shape (n_points, dimension) [m], optional
        Points where forces act, such as the strike point; triangles shrink towards them, and a beam gets a node there.
    coarseness : float [-]
        Size of the triangles at these points of a plate, at least 1; the error of the compliance there is about 1e-7
        times its square.
    graded : bool
        Whether to put rings of shrinking triangles at corners where the supports make the solution singular.

    Returns
    -------
    System

    Raises
    ------
    ValueError
        If section and mesh do not match, an edge does not exist or a support is unknown.

    Examples
    --------
    >>> plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    >>> system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), plate, {"left": "clamped", "right": "hinged"})
    >>> round(system.mass, 6)  # kg
    0.188325
    """
    theories = THEORIES[mesh.dimension]
    theory = theories[0] if theory is None else check.one_of("theory", theory, theories)
    kinds = ELEMENTS[theory]
    element = kinds[0] if element is None else check.one_of("element", element, kinds)
    supports = {} if supports is None else supports
    if callable(getattr(section, "thickness", None)):
        mesh = aligned(mesh)
    posts, clamps = check_posts(point_supports, mesh.dimension)
    if clamps:
        mesh, supports = pierced(mesh, clamps), clamped(supports, len(clamps))
    masses = Attached(check_masses(point_masses, mesh.dimension), posts)
    near = None if near is None else check.places("near", near, mesh.dimension)
    near, coarseness = None if near is None or not len(near) else near, check.number("coarseness", coarseness)
    if coarseness < 1.0:
        raise ValueError(f"coarseness must be at least 1, got {coarseness:g}")
    return _made(mesh, section, supports, element, masses, near, graded, coarseness=coarseness)


def _made(
    mesh: Mesh, section: Any, supports: Any, element: str, masses: Attached, near: np.ndarray | None, graded: bool,
    layer: float = 1.0, coarseness: float = 1.0,
) -> System:  # fmt: skip
    """`assemble` with checked arguments, and `System.layer`."""
    none = np.zeros((0, mesh.dimension))
    marked = np.vstack([none if near is None else near, none, *masses.points])  # forces act here
    if mesh.dimension == 1 and isinstance(section, Beam):
        made = _assemble_beam(mesh, section, supports, masses, marked[:, 0], element)
    elif isinstance(section, Plate) and element == "morley":
        made = _assemble_morley(mesh, section, supports, masses)
    elif mesh.dimension == 2 and isinstance(section, Plate):
        size = np.ones(len(marked))
        size[: len(marked) - len(masses.points)] = coarseness
        order, unresolved, fine = _graded(mesh, section, supports, element, marked, graded, layer, size)
        assembled = _assemble_thick if element in ELEMENTS["mindlin"] else _assemble_plate
        made = assembled(fine, section, supports, masses)
        made = replace(made, mesh=mesh, graded=graded, order=order, unresolved=unresolved, layer=layer)
        made = replace(made, coarseness=coarseness)
    else:
        wanted = "Plate" if mesh.dimension == 2 else "Beam"
        raise ValueError(
            f"section must be a {wanted} on a mesh of dimension {mesh.dimension}, got {check.shown(section)}"
        )
    if near is not None:
        _check_on(made.space, made.frame, "near", near)
    return replace(made, near=near)


def _graded(
    mesh: Mesh, section: Plate, supports: dict, element: str, points: np.ndarray, graded: bool, layer: float = 1.0,
    coarseness: Any = 1.0,
) -> tuple[float, float, Mesh]:  # fmt: skip
    """Order and unresolved error of the corners of a plate, and the mesh that shrinks to them, to layers and points."""
    thicker = element in ELEMENTS["mindlin"]
    allowed = support_words("mindlin" if thicker else None)
    stated = _kinds(support_of_facets(mesh, supports, allowed))
    order, unresolved, fine = around_corners(mesh, stated, section.material)
    fine = fine if graded else mesh
    if thicker:
        fine = thick.layered(fine, section, _kinds(support_of_facets(fine, supports, allowed)), layer)
    if len(points):
        least = thick.PATCH * evaluate("thickness", section.thickness, points, "m") if thicker else 0.0
        held = np.array([kind != "free" for kind in support_of_facets(fine, supports, allowed)])
        fine = towards_points(fine, points, held, least, coarseness)
    return order, unresolved, fine


def unknowns_near(
    mesh: Mesh, section: Plate, supports: dict[str, Any], points: np.ndarray, graded: bool = True, coarseness: Any = 1.0
) -> int:
    """About how many unknowns `assemble` makes of a thin plate with elements that shrink towards points; 1 % more."""
    fine = _graded(mesh, section, supports, "argyris", points, graded, 1.0, coarseness)[2]
    held = [HOLDS.get(kind, 0) for kind in _kinds(support_of_facets(fine, supports))]
    sides = (3 * len(fine.cells) + len(fine.facets)) // 2
    return 6 * len(fine.points) + sides - sum(held)


def _check_on(space: Any, frame: Frame, name: str, points: np.ndarray) -> None:
    """Raise ValueError unless every point lies on the body."""
    inside = space.locate(frame.local(points))[1]
    if not inside.all():
        where = ", ".join(f"{x:g}" for x in points[int(np.argmin(inside))])
        raise ValueError(explained.pointed(f"{name} must lie on the body, got ({where}) m"))


def reassemble(
    system: System,
    mesh: Mesh,
    near: np.ndarray | None = None,
    layer: float | None = None,
    element: str | None = None,
) -> System:
    """Assemble the same body on another mesh.

    ``near`` (n_points, dimension) [m], ``layer`` and ``element`` replace those of the system.
    """
    coarseness = system.coarseness if near is None else 1.0
    near, layer = system.near if near is None else near, system.layer if layer is None else layer
    attached = Attached(list(system.point_masses), list(system.point_supports))
    rest = attached, near, system.graded, layer, coarseness
    return _made(mesh, system.section, system.supports, element or system.element, *rest)


def clamped(supports: Any, n_clamps: int) -> dict[str, Any]:
    """Supports of the edges, with those of clamps by `pierced`."""
    if not isinstance(supports, dict):
        raise ValueError(f"supports must be a dict of edge name -> support, got {check.shown(supports)}")
    return {**supports, **{f"clamp{i}": "clamped" for i in range(n_clamps)}}


def notes_on(mesh: Mesh, section: Plate | Beam) -> tuple[str, ...]:
    """What a mesh assumed, and numbers of the body that are probably a slip of a unit."""
    return plausible.together(mesh.notes, plausible.body(np.ptp(mesh.points, axis=0), section))


def support_words(theory: str | None) -> tuple[str, ...]:
    """Words for the support of an edge, besides `Elastic`."""
    return (*KINDS, SOFT) if theory == "mindlin" else KINDS


def support_of_facets(mesh: Mesh, supports: dict[str, Any], allowed: tuple[str, ...] = KINDS) -> list[str | Elastic]:
    """The support of each facet; ``allowed`` are the words besides `Elastic`."""
    if not isinstance(supports, dict):
        raise ValueError(f"supports must be a dict of edge name -> support, got {check.shown(supports)}")
    for name, kind in supports.items():
        if name not in mesh.edges:
            raise ValueError(
                f"supports names edge {name!r}, but the mesh has the edges {', '.join(sorted(mesh.edges)):.300}"
                + check.nearest(name, mesh.edges)
            )
        if not isinstance(kind, Elastic):
            check.one_of(f"supports[{name!r}]", kind, allowed)
    kinds: list[str | Elastic] = ["free"] * len(mesh.facets)
    stated: dict[int, str] = {}
    for name in sorted(supports, key=lambda name: -len(mesh.edges[name])):
        mine = mesh.edges[name].tolist()
        for facet in mine:
            before = stated.get(facet)
            nested = before is not None and set(mine) < set(mesh.edges[before].tolist())
            if before is not None and not nested and kinds[facet] != supports[name]:
                raise ValueError(
                    f"supports must agree where edges overlap; edge {before!r} and edge {name!r} overlap but differ"
                )
            kinds[facet], stated[facet] = supports[name], name
    return kinds


def _kinds(supports: list[str | Elastic]) -> list[str]:
    """The kind of support of each facet; an elastic support counts as free because it only adds stiffness."""
    return ["free" if isinstance(kind, Elastic) else kind for kind in supports]


def _scatter(local: np.ndarray, element_dofs: np.ndarray, n_all: int) -> csc_matrix:
    """Add element matrices (n_cells, n_local, n_local) into a sparse one (n_all, n_all)."""
    rows = np.broadcast_to(element_dofs.T[:, :, None], local.shape)
    columns = np.broadcast_to(element_dofs.T[:, None, :], local.shape)
    held = local != 0.0  # drop the zeros between bubbles of a beam
    return coo_matrix((local[held], (rows[held], columns[held])), shape=(n_all, n_all)).tocsc()


def _interpolation(
    space: Any, element_dofs: np.ndarray, expand: csr_matrix, frame: Frame, section: Any, points: np.ndarray
) -> csr_matrix:
    """Matrix (n_points, n_all) from all unknowns to the deflection at points (n_points, dimension) [m]."""
    n_all, local = expand.shape[0], frame.local(points)
    rows = _plain(space, element_dofs, n_all, local)
    if not isinstance(space, MindlinSpace):
        return rows
    radius = thick.PATCH * evaluate("thickness", section.thickness, points, "m") / frame.length
    moves = np.flatnonzero(abs(rows @ expand).max(axis=1).toarray()[:, 0] > ROUNDING)
    found = [rows[np.setdiff1d(np.arange(len(local)), moves)]]  # on a support, so at rest
    for some in np.array_split(moves, max(1, -(-len(moves) // CHUNK))):
        if some.size:
            places, weights = thick.spread(space, local[some], radius[some])
            found.append(weights @ _plain(space, element_dofs, n_all, places))
    order = np.concatenate([np.setdiff1d(np.arange(len(local)), moves), moves])
    return vstack(found, format="csr")[np.argsort(order)]


def _plain(space: Any, element_dofs: np.ndarray, n_all: int, local: np.ndarray) -> csr_matrix:
    """`_interpolation` at points in the frame, exactly there."""
    cells = space.locate(local)[0]
    values = space.functions(cells, local[:, None, :], (0,))[0][:, 0]  # (n_points, n_local)
    dofs = element_dofs[:, cells].T
    rows = np.repeat(np.arange(len(local)), dofs.shape[1])
    return csr_matrix((values.ravel(), (rows, dofs.ravel())), shape=(len(local), n_all))


def _supported(attached: Attached, matrices: tuple, maps: tuple, **known: Any) -> System:
    """The system of a body from matrices for all unknowns, with point masses, point supports and supports applied.

    ``matrices`` are K, M and the stiffness of elastic supports and tension, each (n_all, n_all). ``maps`` go from the
    unknowns not fixed by supports to all, (n_all, n_dofs), and back. ``known`` are the other fields of `System`.
    """
    (K, M, springs), (expand, project) = matrices, maps
    space, dofs, frame, n_all = known["space"], known["element_dofs"], known["frame"], expand.shape[0]
    if attached.posts:
        springs, expand, project = _on_posts(attached.posts, springs, expand, project, known)
    if attached.masses:
        points, weights = (np.array(column) for column in zip(*attached.masses))
        for i, point in enumerate(points):
            _check_on(space, frame, f"point of point_masses[{i}]", point[None])
        rows = _interpolation(space, dofs, expand, frame, known["section"], points)
        M = M + rows.T @ diags(weights / frame.mass) @ rows
        known["mass"] += float(weights.sum())
    across = _across(space.origin[:, 0], dofs, expand)
    moving = _rigid(space.linear(dofs, n_all), expand, project)[across]
    expand = expand[:, across].tocsr()
    K, M = (expand.T @ (K + springs) @ expand).tocsc(), (expand.T @ M @ expand).tocsc()
    rigid, sprung = _resisted(moving, expand.T @ (springs @ (expand @ moving)), M)
    held = qr(np.hstack([rigid, sprung]).T, pivoting=True, mode="economic")[2][: rigid.shape[1] + sprung.shape[1]]
    size = 1.0 / np.sqrt(K.diagonal())
    even = diags(size)
    pull = even @ (expand.T @ (springs @ (expand @ sprung)))
    K, M = ((even @ matrix @ even).tocsc() for matrix in (K, M))
    rigid, sprung = rigid / size[:, None], sprung / size[:, None]
    K, M = (0.5 * (matrix + matrix.T).tocsc() for matrix in (K, M))
    expand = (expand @ even).tocsr()
    masses, posts = (tuple(each) for each in attached)
    motions = {"rigid": rigid, "sprung": sprung, "pull": pull, "held": held}
    return System(K=K, M=M, expand=expand, point_masses=masses, point_supports=posts, **motions, **known)


def _on_posts(posts: list, springs: csc_matrix, expand: csr_matrix, project: csr_matrix, known: dict[str, Any]):
    """`_supported`'s springs and maps with points held: each hinged one fixes the unknown that moves it most."""
    space, dofs, frame = known["space"], known["element_dofs"], known["frame"]
    for i, (point, stiffness) in enumerate(posts):
        _check_on(space, frame, f"point of point_supports[{i}]", point[None])
        row = _interpolation(space, dofs, expand, frame, known["section"], point[None])
        if np.isfinite(stiffness):
            springs = springs + stiffness / (frame.mass * frame.rate**2) * (row.T @ row)
            continue
        moves = (row @ expand).toarray()[0]
        most = int(np.abs(moves).argmax())
        if not abs(moves[most]) > ROUNDING:
            continue  # at rest already
        others = np.delete(np.arange(len(moves)), most)
        shares = -moves[others] / moves[most]
        given = np.flatnonzero(shares)
        place = np.concatenate([others, np.full(len(given), most)]), np.concatenate([np.arange(len(others)), given])
        entries = np.concatenate([np.ones(len(others)), shares[given]])
        expand = expand @ csr_matrix((entries, place), shape=(len(moves), len(others)))
        project = project[others]
    if known.get("strain") is not None:
        known["strain"] = replace(known["strain"], springs=springs.tocsc())
    return springs.tocsc(), expand.tocsr(), project.tocsr()


def _rigid(every: np.ndarray, expand: csr_matrix, project: csr_matrix) -> np.ndarray:
    """Those rigid motions (n_dofs, n), of ``every`` one (n_all, n_motions), that no support but springs resists."""
    left = project @ every
    lost = every - expand @ left
    scale = np.abs(every).max()
    _, lengths, turn = np.linalg.svd(lost.T @ lost / scale**2)
    return left @ turn[np.sqrt(lengths) < SAME * np.sqrt(len(every))].T


def _resisted(moving: np.ndarray, force: np.ndarray, M: Sparse) -> tuple[np.ndarray, np.ndarray]:
    """Mass-normalised motions (n_dofs, n_rigid) that springs do not resist, and weakly (n_dofs, n_sprung).

    ``force`` (n_dofs, n) is that of the springs against rigid motions ``moving`` (n_dofs, n). Weakly means an
    eigenvalue below one in the units of the frame, where those of bending are hundreds.
    """
    if not moving.shape[1]:
        return moving, moving
    values, turn = eigh(moving.T @ force, moving.T @ (M @ moving))
    free = values <= SAME * max(values[-1], 0.0)
    return moving @ turn[:, free], moving @ turn[:, ~free & (values < 1.0)]


def _across(origin: np.ndarray, element_dofs: np.ndarray, expand: csr_matrix) -> np.ndarray:
    """Order of the unknowns (n_dofs,) along the x axis, for a fast factorisation; ``origin`` (n_cells,) places cells.

    In the order left by dividing triangles into four, the minimum degree ordering takes five times as long.
    """
    place, weight = np.zeros(expand.shape[0]), np.zeros(expand.shape[0])
    for row in element_dofs:
        np.add.at(place, row, origin)
        np.add.at(weight, row, 1.0)
    used = abs(expand).sign()
    shares = np.asarray(used.sum(axis=0)).ravel()
    return np.argsort((used.T @ (place / np.maximum(weight, 1.0))) / shares, kind="stable")


def _selection(fixed: np.ndarray) -> tuple[csr_matrix, csr_matrix]:
    """Maps of `_supported` that leave out the unknowns ``fixed`` (n_all,) bool."""
    expand = eye_array(len(fixed), format="csr")[:, np.flatnonzero(~fixed)]
    return csr_matrix(expand), csr_matrix(expand.T)


def _centred(mesh: Mesh) -> tuple[np.ndarray, float, np.ndarray]:
    """Centre (dimension,) and largest side [m] of the bounding box of a mesh, and its points in the frame."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    centre, length = 0.5 * (low + high), float((high - low).max())
    return centre, length, (mesh.points - centre) / length


def beam_fields(mesh: Mesh, section: Beam, frame: Frame) -> list[shear_beam.Field]:
    """Bending and shear stiffness, mass and rotary inertia per length at places (n,), all in the frame."""

    def field(of: Callable, unit: float) -> shear_beam.Field:
        def at(x: np.ndarray) -> np.ndarray:
            place = (frame.centre + frame.length * x[:, None]).clip(mesh.points.min(), mesh.points.max())
            return of(place) / unit

        return at

    bend, heavy, square = frame.stiffness, frame.inertia, frame.length**2
    kinds = (section.stiffness, bend), (section.shear, bend / square), (section.inertia, heavy)
    return [field(*kind) for kind in (*kinds, (section.rotary, heavy * square))]


def _assemble_timoshenko(
    mesh: Mesh, section: Beam, supports: dict, masses: Attached, line: Any, frame: Frame
) -> System:
    """Assemble a Timoshenko beam on the elements ``line``."""
    space, fields = TimoshenkoSpace(line), beam_fields(mesh, section, frame)
    dofs, n_all = space.numbering(numbering(line, space.bend))
    bending, shear, inertia, rotary = shear_beam.integrals(space, fields)
    left = mesh.points[mesh.facets[:, 0], 0] <= mesh.points.min()
    maps, sprung = shear_beam.constrain(list(zip(left, support_of_facets(mesh, supports))), dofs, n_all)
    units = np.array([frame.length**3, frame.length]) / frame.stiffness
    K, M = _scatter(bending + shear, dofs, n_all), _scatter(inertia + rotary, dofs, n_all)
    x, dx = beam_elements.quadrature(space)
    stiff, _, heavy, _ = (field(x.ravel()).reshape(x.shape) for field in fields)
    return _supported(
        masses, (K, M, shear_beam.springs(sprung, units, n_all)), maps, mesh=mesh, section=section, supports=supports,
        element="hermite and shear", mass=float((heavy * dx).sum()) * frame.mass, frame=frame, element_dofs=dofs,
        space=space, softness=float((heavy / stiff).max()),
    )  # fmt: skip


def _assemble_beam(
    mesh: Mesh, section: Beam, supports: dict, masses: Attached, marked: np.ndarray, element: str
) -> System:
    """Assemble a beam; ``marked`` are places (n,) [m] where the shear force jumps."""
    centre, length, points = _centred(mesh)

    def fields(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        place = (centre + length * x[:, None]).clip(mesh.points.min(), mesh.points.max())
        return section.stiffness(place), section.inertia(place)

    kinds = support_of_facets(mesh, supports)
    held = [kind in ("clamped", "hinged") for kind in kinds]
    ends = points[mesh.facets[:, 0], 0]
    nodes = beam_elements.nodes(points[:, 0], (marked - centre[0]) / length, ends[held])
    line = beam_elements.divided(fields, nodes)
    space = HermiteSpace(line)
    K, M, stiffness, inertia, dx = beam_elements.integrals(space, fields)
    frame = Frame(centre, length, float(stiffness.max()), float(inertia.max()))
    if element == "hermite and shear":
        return _assemble_timoshenko(mesh, section, supports, masses, line, frame)
    dofs, n_all = numbering(line, space)
    fixed = np.zeros(n_all, bool)
    sprung: list[tuple[tuple[int, int], Elastic]] = []
    for vertex, kind in zip(mesh.facets[:, 0], kinds):
        left = points[vertex, 0] <= points[:, 0].min()
        deflection, slope = (dofs[:2, 0] if left else dofs[2:4, -1]).tolist()
        if isinstance(kind, Elastic):
            sprung.append(((deflection, slope), kind))
        else:
            fixed[deflection] |= kind != "free"
            fixed[slope] |= kind == "clamped"
    springs = beam_springs([at for at, _ in sprung], [kind for _, kind in sprung], frame, n_all)
    matrices = _scatter(K / frame.stiffness, dofs, n_all), _scatter(M / frame.inertia, dofs, n_all), springs.tocsc()
    softness = float((inertia / stiffness).max()) * frame.stiffness / frame.inertia
    return _supported(
        masses, matrices, _selection(fixed), mesh=mesh, section=section, supports=supports, element="hermite",
        mass=float((inertia * dx).sum()) * length, frame=frame, element_dofs=dofs, space=space, softness=softness,
    )  # fmt: skip


def _plate_fields(section: Plate, x: np.ndarray, centre: np.ndarray, length: float) -> tuple:
    """The frame, and in it stiffness (n_cells, n_q, 3, 3), inertia (n_cells, n_q) and softness of a plate.

    ``x`` are points (n_cells, n_q, 2) in the frame.
    """
    flat = centre + length * x.reshape(-1, 2)
    stiffness, inertia = section.stiffness(flat).reshape(*x.shape[:2], 3, 3), section.inertia(flat).reshape(x.shape[:2])
    frame = Frame(centre, length, float(stiffness.max()), float(inertia.max()))
    stiffness, inertia = stiffness / frame.stiffness, inertia / frame.inertia
    plane = section.material.plane_stress
    softness = float((inertia / stiffness[..., 0, 0]).max() * plane[0, 0] / directional(plane).min())
    return frame, stiffness, inertia, softness


def _integrated(space: Any, cells: np.ndarray, x: np.ndarray, stiffness: np.ndarray, inertia: np.ndarray) -> tuple:
    """Bending and mass matrices (n, n_local, n_local) of cells (n,), from fields times quadrature weights at ``x``."""
    value, hessian = space.functions(cells, x[cells], (0, 2))
    bend = curvatures(hessian)
    shape = (len(cells), 3 * x.shape[1], bend.shape[-1])
    K = bend.reshape(shape).transpose(0, 2, 1) @ (stiffness[cells] @ bend).reshape(shape)
    return K, (value * inertia[cells][..., None]).transpose(0, 2, 1) @ value


def _bent(mesh: Mesh, centre: np.ndarray, length: float, points: np.ndarray, plane: Any) -> Bent | None:
    """Bending of the triangles at curved facets onto the true edge; None if every edge is straight."""
    curved = mesh.curved
    if not curved.any():
        return None
    facets = mesh.facets[curved]
    middles = (mesh.middles[curved] - centre) / length
    curves = Curves(points[facets], middles, mesh.tangents[curved], mesh.curvatures[curved] * length)
    return Bent(curves, facets, *cells_of_facets(facets, plane.t.T), plane.t.T)


def _assemble_plate(mesh: Mesh, section: Plate, supports: dict, masses: Attached) -> System:
    centre, length, points = _centred(mesh)
    plane = triangles(points, mesh.cells)
    bent = _bent(mesh, centre, length, points, plane)
    space = ArgyrisSpace(plane, bent)
    x, dx = quadrature(plane, space, MASS_ORDER, bent)
    frame, stiffness, inertia, softness = _plate_fields(section, x, centre, length)
    weighted = stiffness * dx[..., None, None], inertia * dx
    K, M = np.empty((len(x), 21, 21)), np.empty((len(x), 21, 21))
    plain = ~space.curved & (not callable(section.thickness))
    if plain.any():
        cells = np.flatnonzero(plain)
        K[cells], M[cells] = space.uniform(cells, stiffness[0, 0], MASS_ORDER)
    if not plain.all():
        cells = np.flatnonzero(~plain)
        K[cells], M[cells] = _integrated(space, cells, x, *weighted)
    held = support_of_facets(mesh, supports)
    elastic = edge_springs(held, frame)
    rim = SupportedRim(mesh.facets, mesh.tangents, mesh.curvatures * length, points, _kinds(held), elastic)
    expand, project, dofs = constrain(rim, space.vertices, *numbering(plane, space))
    n_all = expand.shape[0]
    springs = csc_matrix((n_all, n_all))
    on = np.flatnonzero(elastic.any(axis=1))
    if on.size:
        cells = cells_of_facets(mesh.facets[on], space.vertices)[0]
        springs = _scatter(plate_springs(space, mesh.facets[on], cells, elastic[on]), dofs[:, cells], n_all)
    if section.tension:
        if "free" in held:
            raise ValueError("tension needs every edge supported, because a free edge cannot be pulled; add supports")
        slope = space.functions(np.arange(len(x)), x, (1,))[0].transpose(0, 2, 1, 3)  # (n_cells, n_q, 2, 21)
        pulled = section.tension * length**2 / frame.stiffness * dx[..., None, None] * slope
        shape = (len(x), 2 * x.shape[1], 21)
        springs = springs + _scatter(slope.reshape(shape).transpose(0, 2, 1) @ pulled.reshape(shape), dofs, n_all)
    matrices = _scatter(K, dofs, n_all), _scatter(M, dofs, n_all), springs
    area = np.abs(np.linalg.det(space.jacobian))
    tiny = area.min() < TINY**2
    return _supported(
        masses, matrices, (expand, project), mesh=mesh, section=section, supports=supports, element="argyris",
        mass=float(weighted[1].sum()) * frame.mass, frame=frame, element_dofs=dofs, space=space, softness=softness,
        rim=rim, strain=Strain(x, weighted[0], springs.tocsc()) if tiny else None,
    )  # fmt: skip


def _assemble_thick(mesh: Mesh, section: Plate, supports: dict, masses: Attached) -> System:
    centre, length, points = _centred(mesh)
    plane = triangles(points, mesh.cells)
    bent = _bent(mesh, centre, length, points, plane)
    space = MindlinSpace(plane, bent)
    middle = centre + length * space.origin
    space.turn(plane, evaluate("thickness", section.thickness, middle, "m") / length)
    x, dx = quadrature(plane, space, MASS_ORDER, bent)
    frame, stiffness, inertia, softness = _plate_fields(section, x, centre, length)
    flat = centre + length * x.reshape(-1, 2)
    shear = section.shear(flat).reshape(*dx.shape, 2, 2) * length**2 / frame.stiffness
    rotary = section.rotary(flat).reshape(dx.shape) / (frame.inertia * length**2)
    fields = thick.Fields(
        x, dx, MASS_ORDER, stiffness * dx[..., None, None], shear * dx[..., None, None], inertia * dx, rotary * dx
    )
    held = support_of_facets(mesh, supports, support_words("mindlin"))
    if section.tension and "free" in held:
        raise ValueError("tension needs every edge supported, because a free edge cannot be pulled; add supports")
    kinds, elastic = _kinds(held), edge_springs(held, frame)
    thin = [thick.held_as_thin(kind) for kind in kinds]
    rim = SupportedRim(mesh.facets, mesh.tangents, mesh.curvatures * length, points, thin, elastic)
    expand, project, dofs = thick.constrain(space, rim, kinds, plane, numbering(plane, space.flat))
    n_all = expand.shape[0]
    K, M, pulled = thick.matrices(space, fields, section.tension * length**2 / frame.stiffness)
    springs = _scatter(pulled, dofs, n_all)
    on = np.flatnonzero(elastic.any(axis=1))
    if on.size:
        cells = cells_of_facets(mesh.facets[on], space.vertices)[0]
        pushed = thick.edge_springs(space, mesh.facets[on], cells, elastic[on])
        springs = springs + _scatter(pushed, dofs[:, cells], n_all)
    matrices = _scatter(K, dofs, n_all), _scatter(M, dofs, n_all), springs
    area = np.abs(np.linalg.det(space.jacobian))
    tiny = area.min() < TINY**2
    return _supported(
        masses, matrices, (expand, project), mesh=mesh, section=section, supports=supports,
        element="argyris and shear", mass=float(fields.inertia.sum()) * frame.mass, frame=frame, element_dofs=dofs,
        space=space, softness=softness, rim=replace(rim, kinds=kinds),
        strain=ThickStrain(fields, springs.tocsc()) if tiny else None,
    )  # fmt: skip


def _assemble_morley(mesh: Mesh, section: Plate, supports: dict, masses: Attached) -> System:
    if mesh.curved.any():
        raise ValueError("element 'morley' needs straight edges; use 'argyris', or a polygon")
    held = support_of_facets(mesh, supports)
    if section.tension or not all(isinstance(kind, str) for kind in held):
        raise ValueError("element 'morley' does not allow tension or elastic supports; use 'argyris'")
    centre, length, points = _centred(mesh)
    plane = triangles(points, mesh.cells)
    space = MorleySpace(plane)
    x, dx = quadrature(plane, space, MORLEY_ORDER)
    frame, stiffness, inertia, softness = _plate_fields(section, x, centre, length)
    K, M = _integrated(space, np.arange(len(x)), x, stiffness * dx[..., None, None], inertia * dx)
    dofs, n_all = numbering(plane, space)
    cells, sides = cells_of_facets(mesh.facets, space.vertices)
    fixed = np.zeros(n_all, bool)
    for facet, kind in enumerate(held):
        if kind != "free":
            corner = np.isin(space.vertices[cells[facet]], mesh.facets[facet])
            fixed[dofs[:3, cells[facet]][corner]] = True
        if kind == "clamped":
            fixed[dofs[3 + sides[facet], cells[facet]]] = True
    if fixed.all():
        raise ValueError("supports fix every unknown of this mesh; refine it")
    matrices = _scatter(K, dofs, n_all), _scatter(M, dofs, n_all), csc_matrix((n_all, n_all))
    return _supported(
        masses, matrices, _selection(fixed), mesh=mesh, section=section, supports=supports, element="morley",
        mass=float((inertia * dx).sum()) * frame.mass, frame=frame, element_dofs=dofs, space=space, softness=softness,
        order=2.0,
    )  # fmt: skip
