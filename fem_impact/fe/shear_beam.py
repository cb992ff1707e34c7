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

import numpy as np
from scipy.sparse import csr_matrix

from .._base.untyped import Cells, Sparse
from . import beam_elements
from .beam_elements import DEGREE, HermiteSpace
from .elements import numbering
from .section import Elastic
from .theory import Domain, Held, Points, Subject, Term, Theory

BENT = DEGREE + 1  # shape functions of W on an element
LOCAL = 2 * BENT  # of both


class TimoshenkoSpace(HermiteSpace):
    """Shape functions of the elements of one line: those of W by `bending`, then two hats and bubbles for s."""

    vertices: np.ndarray  # (2, n_cells)

    def __init__(self, mesh: Cells) -> None:
        super().__init__(mesh)
        self.vertices = mesh.t

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
        bent = self.bending(cells, points, orders)
        return [np.concatenate([b, self.shears(cells, points, k)], axis=-1) for b, k in zip(bent, orders)]

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
    slope, curve = (np.concatenate([b, none], axis=-1) for b in space.bending(cells, x, (1, 2)))
    strain = np.concatenate([none, space.shears(cells, x, 1)], axis=-1)
    value = space.functions(cells, x, (0,))[0]
    named = (
        ("K", "stiffness", curve), ("K", "shear", strain), ("M", "inertia", value), ("M", "rotary", slope),
    )  # fmt: skip
    return [Term(matrix, name, parts[:, :, None]) for matrix, name, parts in named]


def _domain(body: Subject, fields: tuple[str, ...]) -> Domain:
    return beam_elements.domain(body, TimoshenkoSpace, fields)


def _hold(body: Subject, domain: Domain) -> Held:
    dofs, n_all = domain.space.numbering(numbering(domain.cells, domain.space))
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


TIMOSHENKO = Theory(
    "timoshenko", "hermite and shear", 1, _domain, terms, _hold, beam_elements.balanced_errors, wave=30.0,
    unknowns=2 * DEGREE - 1,
    fields=("stiffness", "inertia", "shear", "rotary"),
)  # fmt: skip
