"""Slender (Euler-Bernoulli) beams on the elements of `beam_elements`: strain energy is that of curvature."""

import numpy as np

from . import beam_elements
from .beam_elements import DEGREE, HermiteSpace
from .elements import numbering
from .section import Elastic
from .theory import Domain, Held, Points, Subject, Term, Theory, integrals, kept_unknowns


def terms(space: HermiteSpace, points: Points, cells: np.ndarray) -> list[Term]:
    """Curvature strains a slender beam, deflection moves it."""
    value, bend = space.functions(cells, points.x[cells], (0, 2))
    return [Term("K", "stiffness", bend[:, :, None]), Term("M", "inertia", value[:, :, None])]


def _domain(body: Subject, fields: tuple[str, ...]) -> Domain:
    return beam_elements.domain(body, HermiteSpace, fields)


def _matrices(body: Subject, domain: Domain) -> tuple[np.ndarray, np.ndarray]:
    K, M = integrals(EULER, domain, np.arange(len(domain.points.x)))
    domain.space.decouple(K, M)
    return K, M


def _hold(body: Subject, domain: Domain) -> Held:
    dofs, n_all = numbering(domain.cells, domain.space)
    fixed, sprung = np.zeros(n_all, bool), []
    for at_left, kind in beam_elements.ends(body):
        deflection, slope = (dofs[:2, 0] if at_left else dofs[2:4, -1]).tolist()
        if isinstance(kind, Elastic):
            sprung.append(({deflection: 1.0}, slope, kind))
        else:
            fixed[deflection] |= kind != "free"
            fixed[slope] |= kind == "clamped"
    return Held(*kept_unknowns(fixed), dofs, beam_elements.end_springs(sprung, domain.frame, n_all))


EULER = Theory(
    "euler", "hermite", 1, _domain, terms, _hold, beam_elements.balanced_errors, wave=30.0,
    unknowns=DEGREE - 1, matrices=_matrices,
)  # fmt: skip
