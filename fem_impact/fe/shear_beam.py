"""Timoshenko beams: elements of high degree for the deflection by bending, and for that by shear.

The deflection of a beam of a stout section is that of an Euler-Bernoulli beam, W, whose slope W' is the rotation of the
section, and a deflection s by shear:

    w = W + s,     U = 1/2 int (E I W''^2 + kappa G A s'^2),     T = 1/2 int (rho A w'^2 + rho I W'^2)  (rates)

Written so, nothing locks and no digit is lost however slender the beam; at a step of the section s may have a kink.
The elements of W are those of `beam_elements`; s has the same degree, and is zero at the left end, because only W + s
counts.

References
----------
Timoshenko (1921), Phil. Mag. 41, 744-746; Cowper (1966), J. Appl. Mech. 33, 335-340 (kappa).
"""

from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from .._base.untyped import Cells, Sparse
from . import beam_elements
from .beam_elements import DEGREE, HermiteSpace, integral_along, quadrature
from .elements import numbering
from .section import Elastic
from .theory import Domain, Held, Points, Subject, Term, Theory, unknowns_of_cells

BENT = DEGREE + 1  # shape functions of W on an element
LOCAL = 2 * BENT  # of both


class TimoshenkoSpace:
    """Shape functions of the elements of one line: `HermiteSpace` for W, then two hats and bubbles for s."""

    bend: HermiteSpace
    start: np.ndarray  # (n_cells,)
    length: np.ndarray  # (n_cells,)
    origin: np.ndarray  # (n_cells, 1)
    vertices: np.ndarray  # (2, n_cells)

    def __init__(self, mesh: Cells) -> None:
        self.bend = HermiteSpace(mesh)
        self.start, self.length, self.origin = self.bend.start, self.bend.length, self.bend.origin
        self.vertices = mesh.t  # (2, n_cells)

    def shears(self, cells: np.ndarray, points: np.ndarray, order: int) -> np.ndarray:
        """Shape functions of s (n, n_q, DEGREE + 1), or their derivatives, of cells (n,) at points (n, n_q, 1)."""
        h = self.length[cells][:, None]
        place = (points[..., 0] - self.start[cells][:, None]) / h
        legendre = np.polynomial.legendre.legvander(2.0 * place - 1.0, DEGREE)
        j = np.arange(1, DEGREE)
        if order:
            ends, bubbles = np.stack([-np.ones_like(place), np.ones_like(place)], axis=-1), 2.0 * legendre[..., j]
        else:
            ends = np.stack([1.0 - place, place], axis=-1)
            bubbles = (legendre[..., j + 1] - legendre[..., j - 1]) / (2 * j + 1)
        return np.concatenate([ends, np.sqrt(j + 0.5) * bubbles], axis=-1) / h[..., None] ** order

    def functions(self, cells: np.ndarray, points: np.ndarray, orders: tuple[int, ...]) -> list[np.ndarray]:
        """Derivatives of the deflection w, as in `HermiteSpace.functions`, of order 0 or 1."""
        bent = self.bend.functions(cells, points, orders)
        return [np.concatenate([b, self.shears(cells, points, k)], axis=-1) for b, k in zip(bent, orders)]

    def locate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cell that holds each point (n, 1), or else the nearest one, and whether the point lies in it."""
        return self.bend.locate(points)

    def linear(self, element_dofs: np.ndarray, n_all: int) -> np.ndarray:
        """Unknowns (n_all, 2) of the deflections 1 and x, which have no shear strain."""
        return self.bend.linear(element_dofs, n_all)

    def numbering(self, bent: tuple[np.ndarray, int]) -> tuple[np.ndarray, int]:
        """Numbers of the unknowns of each element (LOCAL, n_cells), from those of W, and how many there are."""
        dofs, n_bent = bent
        n_nodes, n_cells = int(self.vertices.max()) + 1, self.vertices.shape[1]
        inside = n_bent + n_nodes + np.arange(n_cells * (DEGREE - 1)).reshape(n_cells, -1).T
        return np.vstack([dofs, n_bent + self.vertices, inside]), n_bent + n_nodes + inside.size


def terms(space: TimoshenkoSpace, points: Points, cells: np.ndarray) -> list[Term]:
    """Curvature and shear strain, deflection and rotation."""
    x = points.x[cells]
    none = np.zeros((*x.shape[:2], BENT))
    slope, curve = (np.concatenate([b, none], axis=-1) for b in space.bend.functions(cells, x, (1, 2)))
    strain = np.concatenate([none, space.shears(cells, x, 1)], axis=-1)
    value = space.functions(cells, x, (0,))[0]
    named = (
        ("K", "stiffness", curve), ("K", "shear", strain), ("M", "inertia", value), ("M", "rotary", slope),
    )  # fmt: skip
    return [Term(matrix, name, parts[:, :, None]) for matrix, name, parts in named]


def _domain(body: Subject, fields: tuple[str, ...]) -> Domain:
    return beam_elements.domain(body, TimoshenkoSpace, fields)


def _hold(body: Subject, domain: Domain) -> Held:
    dofs, n_all = domain.space.numbering(numbering(domain.cells, domain.space.bend))
    (expand, project), sprung = constrain(beam_elements.ends(body), dofs, n_all)
    return Held(expand, project, dofs, beam_elements.end_springs(sprung, domain.frame, n_all))


def constrain(
    ends: list[tuple[bool, str | Elastic]], dofs: np.ndarray, n_all: int
) -> tuple[tuple[Sparse, Sparse], list[tuple[dict[int, float], int, Elastic]]]:
    """Maps from the unknowns left free to all and back, and the springs.

    ``ends`` are pairs of whether the end is the left one, and its support. Each spring comes with the unknowns that
    make up the deflection there, the one that is the rotation, and its `Elastic`.
    """
    left, right = int(dofs[BENT, 0]), int(dofs[BENT + 1, -1])
    fixed, tied, sprung = np.zeros(n_all, bool), False, []
    fixed[left] = True
    for at_left, kind in ends:
        bent, turned = (dofs[:2, 0] if at_left else dofs[2:4, -1]).tolist()
        if isinstance(kind, Elastic):
            sprung.append(({bent: 1.0} if at_left else {bent: 1.0, right: 1.0}, turned, kind))
        elif kind != "free":
            fixed[turned] |= kind == "clamped"
            fixed[bent if at_left else right] = True
            tied |= not at_left
    kept = np.flatnonzero(~fixed)
    rows, columns, values = kept, np.arange(len(kept)), np.ones(len(kept))
    project = csr_matrix((values, (columns, rows)), shape=(len(kept), n_all))
    if tied:  # s = -W at the right end
        rows = np.append(rows, right)
        columns, values = np.append(columns, np.searchsorted(kept, dofs[2, -1])), np.append(values, -1.0)
    return (csr_matrix((values, (rows, columns)), shape=(n_all, len(kept))), project), sprung


def balanced_errors(
    system: Any, vectors: np.ndarray, loads: np.ndarray, forced: np.ndarray | None = None
) -> np.ndarray:
    """Errors (3, n) of the squared energy norm of solutions, from moments and shear forces in equilibrium.

    As `beam_elements.energy_errors`; here the shear force must agree, too.
    """
    space, (x, dx) = system.space, quadrature(system.space)
    cells, at = np.arange(len(x)), x[..., None]
    unknowns, loads_of_cells = unknowns_of_cells(system, vectors), unknowns_of_cells(system, loads)
    forces, hinges = beam_elements.point_forces(system, vectors, loads, forced)
    fields = {name: system.frame.field(system.section, name, at)[..., None] for name in TIMOSHENKO.fields}
    bending, shear = fields["stiffness"], fields["shear"]
    curve = space.bend.functions(cells, at, (2,))[0] @ unknowns[:, :BENT]
    strain = space.shears(cells, at, 1) @ unknowns[:, BENT:]
    load = fields["inertia"] * (space.functions(cells, at, (0,))[0] @ loads_of_cells)
    turning = fields["rotary"] * (space.bend.functions(cells, at, (1,))[0] @ loads_of_cells[:, :BENT])
    carried = integral_along(space, load)
    moment, push = integral_along(space, carried - turning), -carried
    for place, force in forces:
        moment = moment + (at - place).clip(0.0) * force
        push = push - (at > place) * force
    weight = np.sqrt(dx)[..., None]
    missed = [(bending * curve - moment) * weight / np.sqrt(bending), (shear * strain - push) * weight / np.sqrt(shear)]
    rest = np.concatenate([part.reshape(x.size, -1) for part in missed])
    one, none = np.ones((x.size, 1)), np.zeros((x.size, 1))
    scale = np.concatenate([(weight / np.sqrt(field)).reshape(-1, 1) for field in (bending, shear)])
    free = np.block([[-x.reshape(-1, 1), one], [one, none]])  # the constants of equilibrium
    for place in hinges:
        beyond = np.concatenate([(x - place).clip(0.0).ravel(), -(x > place).ravel().astype(float)])
        free = np.column_stack([free, beyond])
    free = scale * free
    rest -= free @ np.linalg.lstsq(free, rest, rcond=None)[0]
    return np.outer([1.0, 0.0, 0.0], (rest**2).sum(axis=0))


TIMOSHENKO = Theory(
    "timoshenko", "hermite and shear", 1, _domain, terms, _hold, balanced_errors, wave=30.0, unknowns=2 * DEGREE - 1,
    fields=("stiffness", "inertia", "shear", "rotary"),
)  # fmt: skip
