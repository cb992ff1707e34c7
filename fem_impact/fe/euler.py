"""Slender (Euler-Bernoulli) beams on the elements of `beam_elements`: strain energy is that of curvature."""

from typing import Any

import numpy as np

from . import beam_elements
from .beam_elements import DEGREE, HermiteSpace
from .elements import numbering
from .section import Elastic
from .theory import Domain, Held, Points, Subject, Term, Theory, integrals, kept_unknowns, unknowns_of_cells


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


def errors(system: Any, vectors: np.ndarray, loads: np.ndarray, forced: np.ndarray | None = None) -> np.ndarray:
    """Errors (3, n) of the squared energy norm of solutions, see `residual.energy_errors`."""
    space = system.space
    x, _ = beam_elements.quadrature(space)
    stiffness, inertia = (system.frame.field(system.section, name, x[..., None]) for name in EULER.fields)
    value, bend = space.functions(np.arange(len(x)), x[..., None], (0, 2))
    forces, hinges = beam_elements.point_forces(system, vectors, loads, forced)
    moments = np.zeros((*x.shape, vectors.shape[1]))
    for place, force in forces:
        moments += (x - place).clip(0.0)[..., None] * force
    load = inertia[..., None] * (value @ unknowns_of_cells(system, loads))
    beyond = [(x - place).clip(0.0) for place in hinges]
    curvature = bend @ unknowns_of_cells(system, vectors)
    found = beam_elements.energy_errors(space, stiffness, curvature, load, moments, beyond)
    return np.outer([1.0, 0.0, 0.0], found)


EULER = Theory(
    "euler", "hermite", 1, _domain, terms, _hold, errors, wave=30.0, unknowns=DEGREE - 1, matrices=_matrices,
)  # fmt: skip
