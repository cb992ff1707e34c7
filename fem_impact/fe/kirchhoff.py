"""Thin (Kirchhoff) plates on Argyris triangles, or on Morley triangles as a check: strain energy is that of curvature.

The deflection is the only field. Argyris triangles approach frequencies from above, Morley triangles from below.
"""

from functools import partial
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix

from . import plates, residual
from .elements import ArgyrisSpace, MorleySpace, curvatures, numbering
from .supports import cells_of_facets, constrain
from .theory import Domain, Held, Points, Subject, Term, Theory, integrals, kept_unknowns


def terms(space: Any, points: Points, cells: np.ndarray) -> list[Term]:
    """Curvature strains a thin plate, deflection moves it."""
    value, hessian = space.functions(cells, points.x[cells], (0, 2))
    return [Term("K", "stiffness", curvatures(hessian)), Term("M", "inertia", value[:, :, None])]


def _matrices(body: Subject, domain: Domain) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass of the triangles: in closed form where the section is uniform and no side is curved."""
    space, n = domain.space, len(domain.points.x)
    K, M = np.empty((n, 21, 21)), np.empty((n, 21, 21))
    plain = ~space.curved & (not callable(body.section.thickness))
    if plain.any():
        uniform = domain.frame.field(body.section, "stiffness", domain.points.x[:1, :1])[0, 0]
        K[plain], M[plain] = space.uniform(np.flatnonzero(plain), uniform)
    if not plain.all():
        K[~plain], M[~plain] = integrals(ARGYRIS, domain, np.flatnonzero(~plain))
    return K, M


def _hold(body: Subject, domain: Domain) -> Held:
    rim = plates.rim(body, domain, body.kinds)
    expand, project, dofs = constrain(rim, domain.space.vertices, *numbering(domain.cells, domain.space))
    return Held(expand, project, dofs, plates.springs(body, domain, dofs, expand.shape[0]), rim)


def _hold_morley(body: Subject, domain: Domain) -> Held:
    """A held facet fixes the deflection at its ends, a clamped one also the slope at its middle."""
    if body.mesh.curved.any():
        raise ValueError("element 'morley' needs straight edges; use 'argyris', or a polygon")
    if body.section.tension or not all(isinstance(kind, str) for kind in body.held):
        raise ValueError("element 'morley' does not allow tension or elastic supports; use 'argyris'")
    dofs, n_all = numbering(domain.cells, domain.space)
    vertices, facets = domain.space.vertices, body.mesh.facets
    cells, sides = cells_of_facets(facets, vertices)
    fixed = np.zeros(n_all, bool)
    for facet, kind in enumerate(body.held):
        if kind != "free":
            corner = np.isin(vertices[cells[facet]], facets[facet])
            fixed[dofs[:3, cells[facet]][corner]] = True
        if kind == "clamped":
            fixed[dofs[3 + sides[facet], cells[facet]]] = True
    if fixed.all():
        raise ValueError("supports fix every unknown of this mesh; refine it")
    return Held(*kept_unknowns(fixed), dofs, csc_matrix((n_all, n_all)))


def _morley_errors(system: Any, vectors: np.ndarray, loads: np.ndarray, forced: Any = None) -> np.ndarray:
    """Errors (3, n) of modes from the length of their waves, by a measured law.

    Frequencies err by 0.2 (kh)**2: by 0.09 to 0.16 on hinged, by 0.12 to 0.33 on clamped rectangles.
    """
    strained, moved = (np.einsum("ij,ij->j", vectors, matrix @ vectors) for matrix in (system.K, system.M))
    size = np.sqrt(2.0 * system.mesh.area / len(system.mesh.cells)) / system.frame.length
    wave = (system.softness * strained / moved) ** 0.25 * size
    return np.outer([1.0, 0.0, 0.0], 2.0 * 0.2 * wave**2 * strained)


ARGYRIS = Theory(
    "kirchhoff", "argyris", 2, partial(plates.domain, ArgyrisSpace), terms, _hold, residual.energy_errors, wave=1.8,
    unknowns=10.4, matrices=_matrices, graded=True, sharp=plates.is_tiny,
)  # fmt: skip
MORLEY = Theory(
    "kirchhoff", "morley", 2, partial(plates.domain, MorleySpace), terms, _hold_morley, _morley_errors, wave=0.2,
    unknowns=4.6,
)  # fmt: skip
