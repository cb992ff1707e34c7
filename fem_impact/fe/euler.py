"""Slender (Euler-Bernoulli) beams on the elements of `beam_elements`: strain energy is that of curvature."""

from functools import partial

import numpy as np

from .beam_elements import DEGREE, HermiteSpace, balanced_errors, domain, support_ends
from .theory import Domain, Points, Subject, Term, Theory, integrals


def terms(space: HermiteSpace, points: Points, cells: np.ndarray) -> list[Term]:
    """Curvature strains a slender beam, deflection moves it."""
    value, bend = space.functions(cells, points.x[cells], (0, 2))
    return [Term("K", "stiffness", bend[:, :, None]), Term("M", "inertia", value[:, :, None])]


def _matrices(body: Subject, found: Domain) -> tuple[np.ndarray, np.ndarray]:
    K, M = integrals(EULER, found, np.arange(len(found.points.x)))
    found.space.decouple(K, M)
    return K, M


EULER = Theory(
    "euler", "hermite", 1, partial(domain, HermiteSpace), terms, support_ends, balanced_errors, wave=30.0,
    unknowns=DEGREE - 1, matrices=_matrices,
)  # fmt: skip
