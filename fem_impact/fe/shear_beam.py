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

from functools import partial

import numpy as np

from .._base.untyped import Cells
from .beam_elements import DEGREE, HermiteSpace, balanced_errors, domain, support_ends
from .theory import Points, Term, Theory

BENT = DEGREE + 1  # shape functions of W on an element
LOCAL = 2 * BENT  # of both


class TimoshenkoSpace(HermiteSpace):
    """Shape functions of one line: those of W by `bending_functions`, then two hats and bubbles for s."""

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
        bent = self.bending_functions(cells, points, orders)
        return [np.concatenate([b, self.shears(cells, points, k)], axis=-1) for b, k in zip(bent, orders)]

    def numbering(self, mesh: Cells) -> tuple[np.ndarray, int]:
        """Numbers of the unknowns of each element (LOCAL, n_cells), those of W first, and how many there are."""
        dofs, n_bent = super().numbering(mesh)
        n_nodes, n_cells = int(mesh.t.max()) + 1, mesh.t.shape[1]
        inside = n_bent + n_nodes + np.arange(n_cells * (DEGREE - 1)).reshape(n_cells, -1).T
        return np.vstack([dofs, n_bent + mesh.t, inside]), n_bent + n_nodes + inside.size


def terms(space: TimoshenkoSpace, points: Points, cells: np.ndarray) -> list[Term]:
    """Curvature and shear strain, deflection and rotation."""
    x = points.x[cells]
    none = np.zeros((*x.shape[:2], BENT))
    slope, curve = (np.concatenate([b, none], axis=-1) for b in space.bending_functions(cells, x, (1, 2)))
    strain = np.concatenate([none, space.shears(cells, x, 1)], axis=-1)
    value = space.functions(cells, x, (0,))[0]
    named = (
        ("K", "stiffness", curve), ("K", "shear", strain), ("M", "inertia", value), ("M", "rotary", slope),
    )  # fmt: skip
    return [Term(matrix, name, parts[:, :, None]) for matrix, name, parts in named]


TIMOSHENKO = Theory(
    "timoshenko", "hermite and shear", 1, partial(domain, TimoshenkoSpace), terms, support_ends, balanced_errors,
    wave=30.0, unknowns=2 * DEGREE - 1, fields=("stiffness", "inertia", "shear", "rotary"),
)  # fmt: skip
