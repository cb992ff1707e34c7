"""What a theory of plates or beams consists of, and the one way from it to matrices and strain energies.

A theory is one file that makes a `Theory`, as `kirchhoff`, `thick`, `euler` and `shear_beam` do, and its name in
`assembly.EVERY`; or anybody's object, given as ``theory=`` of `assemble`. It says how the elements of a body look
(`Domain`), which strains and motions hold energy (`Term`), and how supports hold the unknowns (`Held`). What is common
follows from these: matrices, point masses and point supports, modes, static deflections, derivatives in the section,
and errors by a second mesh where the theory has no estimate of its own (`no_estimate`). The shortest is
``dataclasses.replace`` of a known one with other ``terms``, ``matrices=None``, ``errors=no_estimate`` and
``compared=True``, and a section with a method for each new field.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix, csr_matrix, eye_array

from .._base import check
from .._base.rounding import SAME
from .._base.untyped import Cells, Sparse
from ..mesh.meshes import Mesh
from .material import stiffness_by_way
from .section import KINDS, Elastic
from .supports import SupportedRim

# powers of the length in the units of a section's fields, over those of its stiffness or its inertia per area or length
POWERS = {"shear": -2, "rotary": 2, "foundation": -4}
INERT = "inertia", "rotary"  # fields of a section that do not resist


@dataclass(frozen=True, eq=False)
class Frame:
    """The units used for one body, so that its size, position and stiffness do not affect the accuracy."""

    centre: np.ndarray  # (dimension,) [m]
    length: float  # [m]
    stiffness: float  # [N m] on a plate, [N m^2] on a beam
    inertia: float  # [kg/m^2] on a plate, [kg/m] on a beam

    @classmethod
    def around(cls, mesh: Mesh) -> "Frame":
        """Around the middle of a body, its largest side long; stiffness and inertia are still in SI units."""
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        return cls(0.5 * (low + high), float((high - low).max()), 1.0, 1.0)

    @property
    def rate(self) -> float:
        """Angular frequency [rad/s] of an eigenvalue 1 in the frame."""
        return float(np.sqrt(self.stiffness / self.inertia) / self.length**2)

    @property
    def mass(self) -> float:
        """Mass [kg] of a mass 1 in the frame."""
        return float(self.inertia * self.length ** len(self.centre))

    def unit(self, name: str) -> float:
        """That of a field of a section, see `POWERS`."""
        return self.inertia if name in INERT else self.stiffness

    def local(self, points: np.ndarray) -> np.ndarray:
        """Coordinates [-] in the frame of points [m]."""
        return (points - self.centre) / self.length

    def to_metres(self, local: np.ndarray) -> np.ndarray:
        """Points (n, dimension) [m] at coordinates (..., dimension) in the frame; on a beam never beyond its ends."""
        points = self.centre + self.length * local.reshape(-1, len(self.centre))
        if len(self.centre) > 1:
            return points
        return points.clip(self.centre - 0.5 * self.length, self.centre + 0.5 * self.length)

    def field(self, section: Any, name: str, local: np.ndarray) -> np.ndarray:
        """A field of a section, see `Term`, at coordinates (n, n_q, dimension), in the frame."""
        size: Any = self.length ** POWERS.get(name, 0)
        if name == "walls":
            size = np.outer(*[np.repeat([1.0 / self.length, 1.0], 3)] * 2)
        found = getattr(section, name)(self.to_metres(local)) / (self.unit(name) * size)
        return found.reshape(*local.shape[:2], *found.shape[1:])


class Points(NamedTuple):
    """A quadrature on every cell."""

    reference: np.ndarray  # (dimension, n_q) in the reference cell
    x: np.ndarray  # (n_cells, n_q, dimension) in the frame
    dx: np.ndarray  # (n_cells, n_q) weights


class Term(NamedTuple):
    """A part of the energy: half the integral of ``parts . field . parts`` over the body."""

    matrix: str  # "K" if it is strain energy, "M" if kinetic
    # of the section, a method of points (n, dimension) [m]: "stiffness", "shear", "walls", "inertia", "rotary", or a
    # "foundation" [N/m^3 of a plate, N/m^2 of a beam] on the deflection
    field: str
    parts: np.ndarray  # (n_cells, n_q, n_parts, n_local) strains or motions by each unknown


@dataclass(frozen=True, eq=False)
class Subject:
    """What a theory is asked to describe."""

    mesh: Mesh
    section: Any
    held: Sequence[str | Elastic]  # (n_facets,) supports
    marked: np.ndarray  # (n, dimension) [m] points where forces act

    @property
    def kinds(self) -> list[str]:
        """The kind of support of each facet."""
        return plain_kinds(self.held)


@dataclass(frozen=True, eq=False)
class Domain:
    """The elements of a body, their shape functions, and its section at the points of a quadrature."""

    cells: Cells  # scikit-fem's mesh, in the frame
    space: Any  # shape functions
    frame: Frame
    points: Points
    fields: dict[str, np.ndarray]  # name -> (n_cells, n_q) or (n_cells, n_q, m, m) in the frame, times the weights
    softness: float  # [-] largest inertia over stiffness in any direction, in the frame

    @classmethod
    def of(cls, names: Sequence[str], section: Any, bare: Frame, cells: Cells, space: Any, points: Points) -> "Domain":
        """That of a section, by its fields ``names``; ``bare`` is the frame around the body."""
        fields = {name: bare.field(section, name, points.x) for name in names}
        frame = replace(bare, stiffness=float(fields["stiffness"].max()), inertia=float(fields["inertia"].max()))
        for name, values in fields.items():
            fields[name] = values / frame.unit(name)
        stiffness, inertia, soft = fields["stiffness"], fields["inertia"], 1.0
        if stiffness.ndim > 2:
            plane = section.material.plane_stress
            stiffness, soft = stiffness[..., 0, 0], plane[0, 0] / stiffness_by_way(plane).min()
        softness = float((inertia / stiffness).max() * soft)
        dx = points.dx
        weighted = {name: each * dx.reshape(*dx.shape, *[1] * (each.ndim - 2)) for name, each in fields.items()}
        return cls(cells, space, frame, points, weighted, softness)


class Held(NamedTuple):
    """How supports hold the unknowns; all there are is what the elements have without them."""

    expand: Any  # sparse (n_all, n_dofs) from the unknowns left free to all
    project: Any  # sparse (n_dofs, n_all) left inverse of that
    dofs: np.ndarray  # (n_local, n_cells) numbers of the unknowns of each cell, among all
    springs: Any  # sparse (n_all, n_all) stiffness of elastic supports and tension
    rim: SupportedRim | None = None  # of a plate
    ribs: tuple[Any, Any] | None = None  # sparse (n_all, n_all) stiffness and mass of its ribs


@dataclass(frozen=True)
class Theory:
    """A theory of plates or beams and the elements for it."""

    name: str
    element: str
    dimension: int
    domain: Callable[[Subject, tuple[str, ...]], Domain]  # with these fields of the section
    terms: Callable[[Any, Points, np.ndarray], list[Term]]  # of a space in some cells (n,)
    hold: Callable[[Subject, Domain], Held]
    # (3, n) errors of the squared energy norm of solutions: arguments as in `residual.energy_errors`
    errors: Callable[..., np.ndarray]
    wave: float  # [rad] largest wavenumber times element size: error 1e-5, 1e-12 on beams
    unknowns: float  # [-] of an element per square, or length, of its size
    fields: tuple[str, ...] = ("stiffness", "inertia")  # of the section, that its terms weigh with
    matrices: Callable[[Subject, Domain], tuple[np.ndarray, np.ndarray]] | None = None  # where quicker than by `terms`
    words: tuple[str, ...] = KINDS  # supports of an edge, besides `Elastic`
    graded: bool = False  # whether triangles shrink to corners, points and layers
    compared: bool = False  # whether its errors need a second mesh, in addition to ``errors``
    patch: float = 0.0  # [-] radius over which a force at a point is spread, over the thickness
    # whether K is so rounded that the strain energy is computed from strains
    sharp: Callable[[Domain], bool] | None = None
    # the mesh with triangles that resolve the layers at edges of these supports (n_facets,), or sharp bends, coarser by
    # a factor
    layered: Callable[[Mesh, Any, list[str], float], Mesh] | None = None
    # twice the mutual strain energy, and the mutual mass (n, n) of vectors (n_dofs, n) of a system if it had another
    # section, where its terms depend on that
    energies: Callable[[Any, Any, np.ndarray], tuple[np.ndarray, np.ndarray]] | None = None

    @property
    def thick(self) -> bool:
        """Whether shear and rotary inertia count."""
        return "shear" in self.fields

    @property
    def has_plane(self) -> bool:
        """Whether displacements in the plane are among the unknowns of a plate."""
        return "walls" in self.fields


def no_estimate(system: Any, vectors: np.ndarray, loads: np.ndarray, forced: Any = None) -> np.ndarray:
    """``errors`` (3, n) of a theory that is ``compared``: none, as a second mesh shows all of it."""
    return np.zeros((3, vectors.shape[1]))


def plain_kinds(supports: Sequence[str | Elastic]) -> list[str]:
    """The kind of support of each facet; an elastic support counts as free because it only adds stiffness."""
    return ["free" if isinstance(kind, Elastic) else kind for kind in supports]


def weighted_parts(weight: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """Parts (n, n_q, m, k) times a weight, which is a number at each point, (n, n_q), or a matrix, (n, n_q, m, m)."""
    return weight @ parts if weight.ndim == parts.ndim else weight[..., None, None] * parts


def gram(parts: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Sum (n, k, k) over the points of a quadrature of ``parts.T @ weight @ parts``, as of `weighted_parts`."""
    n, k = len(parts), parts.shape[-1]
    return parts.reshape(n, -1, k).transpose(0, 2, 1) @ weighted_parts(weight, parts).reshape(n, -1, k)


def kept_unknowns(fixed: np.ndarray) -> tuple[csr_matrix, csr_matrix]:
    """Maps of `Held` that leave out the unknowns ``fixed`` (n_all,) bool."""
    expand = eye_array(len(fixed), format="csr")[:, np.flatnonzero(~fixed)]
    return csr_matrix(expand), csr_matrix(expand.T)


def unresisted_motions(motions: np.ndarray, expand: Any, project: Any) -> np.ndarray:
    """Combinations (n_motions, n) of motions (n_all, n_motions) that maps of `Held` leave as they are."""
    lost = (motions - expand @ (project @ motions)) / np.abs(motions).max()
    lengths, turn = np.linalg.svd(lost, full_matrices=False)[1:]  # of its square, half the digits would be lost
    free: np.ndarray = turn[lengths < SAME * np.sqrt(len(motions))].T
    return free


def unknowns_of_cells(system: Any, vectors: np.ndarray) -> np.ndarray:
    """Unknowns (n_cells, n_local, n) of each cell, from those of fields (n_dofs, n)."""
    return (system.expand @ vectors)[system.element_dofs].transpose(1, 0, 2)


def blocks(n: int, most: int = 256) -> list[np.ndarray]:
    """Numbers of n cells in blocks of so many at most, to limit memory."""
    return np.array_split(np.arange(n), max(1, -(-n // most)))


def check_own(theory: Theory, domain: Domain, held: Held) -> None:
    """ValueError where a theory of the user's own has terms that make no matrices."""
    x, n_local = domain.points.x, len(held.dofs)
    for matrix, name, parts in theory.terms(domain.space, domain.points, np.arange(len(x))):
        if matrix not in ("K", "M") or name not in theory.fields:
            raise ValueError(
                f"terms of theory {theory.name!r} must be of 'K' or 'M' and of a field among {theory.fields}, got "
                f"{matrix!r} and {name!r}"
            )
        check.array(f"terms of theory {theory.name!r} of {name!r}", parts, (*x.shape[:2], None, n_local))


def integrals(theory: Theory, domain: Domain, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass (n, n_local, n_local) of cells (n,) from the terms of a theory."""
    found: dict[str, list[np.ndarray]] = {"K": [], "M": []}
    for block in blocks(len(cells)):
        local: dict[str, Any] = {"K": 0.0, "M": 0.0}
        for matrix, name, parts in theory.terms(domain.space, domain.points, cells[block]):
            local[matrix] = local[matrix] + gram(parts, domain.fields[name][cells[block]])
        for matrix, values in local.items():
            found[matrix].append(values)
    return np.concatenate(found["K"]), np.concatenate(found["M"])


def scatter(local: np.ndarray, element_dofs: np.ndarray, n_all: int) -> csc_matrix:
    """Add element matrices (n_cells, n_local, n_local) into a sparse one (n_all, n_all)."""
    rows = np.broadcast_to(element_dofs.T[:, :, None], local.shape)
    columns = np.broadcast_to(element_dofs.T[:, None, :], local.shape)
    held = local != 0.0  # drop the zeros between bubbles of a beam
    return coo_matrix((local[held], (rows[held], columns[held])), shape=(n_all, n_all)).tocsc()


@dataclass(frozen=True, eq=False, repr=False)
class Strain(check.Brief):
    """Data to compute the strain energy of a plate from strains, where triangles are so small that K loses digits.

    The stiffness of a triangle grows with its size to the power -2, so the rounding of K in the smallest triangles
    affects the total energy. Curvature squared times area is equally accurate in all triangles.
    """

    domain: Domain
    springs: Sparse  # (n_all, n_all) stiffness of elastic supports and tension

    def energy(self, system: Any, vectors: np.ndarray) -> np.ndarray:
        """Twice the strain energy (n_modes,) of vectors (n_dofs, n_modes)."""
        return self.products(system, vectors, "nqik,nqik->k")

    def products(self, system: Any, vectors: np.ndarray, pairs: str = "nqik,nqil->kl") -> np.ndarray:
        """Twice the mutual strain energy (n, n) of all pairs of vectors (n_dofs, n)."""
        moved = system.expand @ vectors
        total = np.einsum(pairs.replace("nqi", "n"), moved, self.springs @ moved)
        return total + sum(self._of_cells(system, moved, cells, pairs) for cells in blocks(len(self.domain.points.x)))

    def around(self, system: Any, vectors: np.ndarray, vertex: int) -> np.ndarray:
        """Twice the strain energy (n_modes,) in the ring of triangles around those that touch a vertex of the mesh."""
        space = self.domain.space
        corners = space.vertices
        touching = (corners == vertex).any(axis=1)
        ring = np.isin(corners, corners[touching]).any(axis=1) & ~touching
        far = np.linalg.norm(space.origin - space.corners[corners == vertex][0], axis=1)
        ring &= far < 4.0 * far[touching].max()  # not the neighbours of its outer vertices, where one ring is all
        return self._of_cells(system, system.expand @ vectors, np.flatnonzero(ring), "nqik,nqik->k")

    def _of_cells(self, system: Any, moved: np.ndarray, cells: np.ndarray, pairs: str) -> np.ndarray:
        """The same from all unknowns (n_all, n) of some cells (n_cells,)."""
        own = moved[system.element_dofs[:, cells].T][:, None]
        total: Any = 0.0
        for matrix, name, parts in system.rules.terms(self.domain.space, self.domain.points, cells):
            if matrix == "K":
                strained = parts @ own
                total = total + np.einsum(pairs, weighted_parts(self.domain.fields[name][cells], strained), strained)
        return total
