"""From mesh, section and supports to stiffness and mass: everything about the body that its modes depend on."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.linalg import qr
from scipy.sparse import coo_matrix, csc_matrix, csr_matrix, diags

from . import _check
from .corners import around_corners
from .curves import Curves
from .elements import (
    Argyris,
    ArgyrisSpace,
    Bent,
    BentMapping,
    Hermite,
    HermiteSpace,
    numbering,
    quadrature,
    segments,
    triangles,
)
from .mesh import Mesh
from .section import Beam, Plate
from .supports import Rim, cells_of_facets, constrain

KINDS = ("clamped", "hinged", "free")
MASS_ORDER = 10  # [-] of the quadrature: exact for products of quintics
BEAM_ORDER = 8  # [-] exact for products of cubics where the height varies linearly
RIGID = 1e-9  # [-] share of a rigid motion that supports may suppress by rounding alone


@dataclass(frozen=True, eq=False)
class Frame:
    """The units a body is computed in, so that neither its size, place nor stiffness touches the accuracy."""

    centre: np.ndarray  # (dimension,) [m]
    length: float  # [m]
    stiffness: float  # [N m] on a plate, [N m^2] on a beam
    inertia: float  # [kg/m^2] on a plate, [kg/m] on a beam

    @property
    def rate(self) -> float:
        """Angular frequency [rad/s] of a computed eigenvalue 1."""
        return float(np.sqrt(self.stiffness / self.inertia) / self.length**2)

    @property
    def mass(self) -> float:
        """Mass [kg] of a computed mass 1."""
        return float(self.inertia * self.length ** len(self.centre))

    def local(self, points: np.ndarray) -> np.ndarray:
        """Coordinates [-] of points [m]."""
        return (points - self.centre) / self.length


@dataclass(frozen=True, eq=False)
class System:
    """Stiffness and mass of a supported body in the units of its frame, and how to evaluate a deflection."""

    mesh: Mesh
    section: Plate | Beam
    supports: dict[str, Any]
    element: str
    mass: float  # [kg] of the whole body
    frame: Frame
    K: csc_matrix = field(repr=False)  # (n_dofs, n_dofs) [-] on the unknowns the supports leave
    M: csc_matrix = field(repr=False)  # (n_dofs, n_dofs) [-]
    expand: csr_matrix = field(repr=False)  # (n_all, n_dofs) unknowns left -> all unknowns of the elements
    element_dofs: np.ndarray = field(repr=False)  # (n_local, n_cells) numbers among all unknowns
    space: ArgyrisSpace | HermiteSpace = field(repr=False)  # shape functions
    rigid: np.ndarray = field(repr=False)  # (n_dofs, n_rigid) [-] rigid motions left, mass-normalised
    held: np.ndarray = field(repr=False)  # (n_rigid,) unknowns that hold the rigid motions, statically determinate
    graded: bool = True  # whether rings of ever smaller triangles surround singular corners
    rim: Rim | None = field(default=None, repr=False)  # of the triangles solved on, in the frame; None on a beam
    order: float = np.inf  # [-] power of the element size by which singular corners let the error of a frequency fall
    softness: float = 1.0  # [-] largest inertia over stiffness on the body, in the frame: its shortest waves

    @property
    def n_dofs(self) -> int:
        """Number of unknowns the supports leave."""
        return self.K.shape[0]

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Whether each point (n_points, dimension) [m] lies on the body, (n_points,) bool."""
        return self.space.locate(self.frame.local(points))[1]

    def interpolate(self, points: np.ndarray) -> csr_matrix:
        """Deflection at points (n_points, dimension) [m] from the unknowns, (n_points, n_dofs) [-]."""
        local = self.frame.local(points)
        cells = self.space.locate(local)[0]
        values = self.space.functions(cells, local[:, None, :], (0,))[0][:, 0]  # (n_points, n_local)
        dofs = self.element_dofs[:, cells].T
        rows = np.repeat(np.arange(len(points)), dofs.shape[1])
        full = csr_matrix((values.ravel(), (rows, dofs.ravel())), shape=(len(points), self.expand.shape[0]))
        return full @ self.expand


def assemble(
    mesh: Mesh,
    section: Plate | Beam,
    supports: dict | None = None,
    element: str = "argyris",
    *,
    graded: bool = True,
) -> System:
    """Stiffness and mass of a body, held at its named edges.

    Parameters
    ----------
    mesh : Mesh
    section : Plate on a plane mesh, Beam on a line
    supports : dict, name of an edge -> "clamped", "hinged" or "free"
        Edges not named are free; "boundary" stands for all edges, and an edge named itself goes before it.
    element : str
        "argyris" on a plate; beams always take Hermite elements.
    graded : bool
        Whether rings of ever smaller triangles are put at corners where the supports make the solution singular.

    Returns
    -------
    System

    Raises
    ------
    ValueError
        Where section and mesh disagree, an edge does not exist or a support is not known.
    """
    if not isinstance(mesh, Mesh):
        raise ValueError(f"mesh must be made by fi.mesh, got {type(mesh).__name__}")
    kinds = _support_of_facets(mesh, supports or {})
    _check.one_of("element", element, ("argyris", "hermite"))
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    centre, length = 0.5 * (low + high), float((high - low).max())
    if mesh.dimension == 1 and isinstance(section, Beam):
        return _assemble_beam(mesh, section, supports or {}, kinds, centre, length)
    if mesh.dimension == 2 and isinstance(section, Plate):
        order, fine = around_corners(mesh, kinds, section.material.nu)
        fine = fine if graded else mesh
        kinds = _support_of_facets(fine, supports or {})
        made = _assemble_plate(fine, section, supports or {}, kinds, centre, length)
        return replace(made, mesh=mesh, graded=graded, order=order)
    wanted = "Plate" if mesh.dimension == 2 else "Beam"
    raise ValueError(f"section must be a {wanted} on a mesh of dimension {mesh.dimension}, got {section!r:.80}")


def reassemble(system: System, mesh: Mesh) -> System:
    """The same body on another mesh of it."""
    return assemble(mesh, system.section, system.supports, graded=system.graded)


def _support_of_facets(mesh: Mesh, supports: dict) -> list[str]:
    """The support of each facet."""
    if not isinstance(supports, dict):
        raise ValueError(f"supports must be a dict of edge name -> support, got {supports!r:.80}")
    for name, kind in supports.items():
        if name not in mesh.edges:
            raise ValueError(
                f"supports names edge {name!r}, but the mesh has {', '.join(sorted(mesh.edges))}"
                + _check.nearest(name, mesh.edges)
            )
        _check.one_of(f"supports[{name!r}]", kind, KINDS)
    kinds = ["free"] * len(mesh.facets)
    stated: dict[int, str] = {}
    for name in sorted(supports, key=lambda name: name != "boundary"):
        for facet in mesh.edges[name].tolist():
            if name != "boundary" and stated.setdefault(facet, name) != name and kinds[facet] != supports[name]:
                raise ValueError(
                    f"supports gives edge {stated[facet]!r} and edge {name!r} different supports, but they overlap"
                )
            kinds[facet] = supports[name]
    return kinds


def _scatter(local: np.ndarray, element_dofs: np.ndarray, n_all: int) -> csc_matrix:
    """Sum element matrices (n_cells, n_local, n_local) into a sparse one (n_all, n_all)."""
    rows = np.broadcast_to(element_dofs.T[:, :, None], local.shape)
    columns = np.broadcast_to(element_dofs.T[:, None, :], local.shape)
    return coo_matrix((local.ravel(), (rows.ravel(), columns.ravel())), shape=(n_all, n_all)).tocsc()


def _finish(mesh, section, supports, element, mass, frame, K, M, expand, project, element_dofs, space) -> System:
    """Put the supports on the matrices and find the rigid motions they leave."""
    n_all = expand.shape[0]
    rigid_all = space.linear(element_dofs, n_all)
    left = project @ rigid_all
    lost = rigid_all - expand @ left
    scale = np.abs(rigid_all).max()
    _, lengths, turn = np.linalg.svd(lost.T @ lost / scale**2)
    kept = turn[np.sqrt(lengths) < RIGID * np.sqrt(n_all)].T  # (n_motions, n_rigid)
    K, M = (expand.T @ K @ expand).tocsc(), (expand.T @ M @ expand).tocsc()
    size = 1.0 / np.sqrt(K.diagonal())
    even = diags(size)
    K, M, expand = (even @ K @ even).tocsc(), (even @ M @ even).tocsc(), (expand @ even).tocsr()
    rigid = left @ kept
    held = qr(rigid.T, pivoting=True, mode="economic")[2][: rigid.shape[1]]
    rigid = rigid / size[:, None]
    if kept.shape[1]:
        factor = np.linalg.cholesky(rigid.T @ (M @ rigid))
        rigid = np.linalg.solve(factor, rigid.T).T
    K, M = 0.5 * (K + K.T).tocsc(), 0.5 * (M + M.T).tocsc()
    return System(mesh, section, supports, element, mass, frame, K, M, expand, element_dofs, space, rigid, held)


def _assemble_beam(mesh: Mesh, section: Beam, supports: dict, kinds: list, centre: np.ndarray, length: float) -> System:
    points = (mesh.points - centre) / length
    line = segments(points, mesh.cells)
    space = HermiteSpace(line)
    element = Hermite(space)
    x, dx = quadrature(line, element, BEAM_ORDER)  # (n_cells, n_q, 1), (n_cells, n_q)
    stiffness, inertia = _fields(section, centre + length * x)
    frame = Frame(centre, length, float(stiffness.max()), float(inertia.max()))
    stiffness, inertia = stiffness / frame.stiffness, inertia / frame.inertia
    value, bend = space.functions(np.arange(len(x)), x, (0, 2))
    K = np.einsum("eqi,eq,eqj->eij", bend, stiffness * dx, bend)
    M = np.einsum("eqi,eq,eqj->eij", value, inertia * dx, value)
    dofs, n_all = numbering(line, element)
    fixed = []
    for vertex, kind in zip(mesh.facets[:, 0], kinds):
        cell, end = np.argwhere(vertex == line.t.T)[0]
        deflection, slope = dofs[2 * end : 2 * end + 2, cell].tolist()
        fixed += {"clamped": [deflection, slope], "hinged": [deflection], "free": []}[kind]
    free = np.setdiff1d(np.arange(n_all), fixed)
    if not free.size:
        raise ValueError("supports leave this mesh nothing to move; refine it")
    expand = csr_matrix((np.ones(len(free)), (free, np.arange(len(free)))), shape=(n_all, len(free)))
    project = expand.T.tocsr()
    mass = float((inertia * dx).sum()) * frame.mass
    matrices = _scatter(K, dofs, n_all), _scatter(M, dofs, n_all)
    system = _finish(mesh, section, supports, "hermite", mass, frame, *matrices, expand, project, dofs, space)
    return replace(system, softness=float((inertia / stiffness).max()))


def _fields(section, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness (n_cells, n_q, ...) and inertia (n_cells, n_q) at points (n_cells, n_q, dimension)."""
    flat = points.reshape(-1, points.shape[-1])
    stiffness, inertia = section.stiffness(flat), section.inertia(flat)
    return stiffness.reshape(*points.shape[:2], *stiffness.shape[1:]), inertia.reshape(points.shape[:2])


def _bent(mesh: Mesh, centre: np.ndarray, length: float, points: np.ndarray, plane: Any) -> Bent | None:
    """How the triangles at curved facets are bent; None where every edge is straight."""
    curved = mesh.curved
    if not curved.any():
        return None
    facets = mesh.facets[curved]
    middles = (mesh.middles[curved] - centre) / length
    curves = Curves(points[facets], middles, mesh.tangents[curved], mesh.curvatures[curved] * length)
    return Bent(curves, facets, *cells_of_facets(facets, plane.t.T), plane.t.T)


def _assemble_plate(
    mesh: Mesh, section: Plate, supports: dict, kinds: list, centre: np.ndarray, length: float
) -> System:
    points = (mesh.points - centre) / length
    plane = triangles(points, mesh.cells)
    bent = _bent(mesh, centre, length, points, plane)
    mapping = None if bent is None else BentMapping(plane, bent)
    space = ArgyrisSpace(plane, bent)
    element = Argyris(space)
    x, dx = quadrature(plane, element, MASS_ORDER, mapping)
    stiffness, inertia = _fields(section, centre + length * x)
    frame = Frame(centre, length, float(stiffness.max()), float(inertia.max()))
    stiffness, inertia = stiffness / frame.stiffness, inertia / frame.inertia
    softness = float((inertia / np.minimum(stiffness[..., 0, 0], stiffness[..., 1, 1])).max())
    K, M = np.empty((len(x), 21, 21)), np.empty((len(x), 21, 21))
    plain = ~space.curved & (not callable(section.thickness))
    if plain.any():
        cells = np.flatnonzero(plain)
        K[cells], M[cells] = space.uniform(cells, stiffness[0, 0], MASS_ORDER)
    if not plain.all():
        cells = np.flatnonzero(~plain)
        value, hessian = space.functions(cells, x[cells], (0, 2))
        bend = hessian[:, [0, 2, 1]].transpose(0, 2, 1, 3) * np.array([1.0, 1.0, 2.0])[:, None]  # (n, n_q, 3, 21)
        moment = (stiffness[cells] * dx[cells, :, None, None]) @ bend
        shape = (len(cells), 3 * x.shape[1], 21)
        K[cells] = bend.reshape(shape).transpose(0, 2, 1) @ moment.reshape(shape)
        M[cells] = (value * (inertia * dx)[cells, :, None]).transpose(0, 2, 1) @ value
    rim = Rim(mesh.facets, mesh.tangents, mesh.curvatures * length, points, kinds)
    expand, project, dofs = constrain(rim, space.vertices, *numbering(plane, element))
    n_all = expand.shape[0]
    matrices = _scatter(K, dofs, n_all), _scatter(M, dofs, n_all)
    mass = float((inertia * dx).sum()) * frame.mass
    system = _finish(mesh, section, supports, "argyris", mass, frame, *matrices, expand, project, dofs, space)
    return replace(system, softness=softness, rim=rim)
