"""Integrals over a body of the slopes and strains of its shapes."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from . import beam_elements
from .elements import on_true_edge, triangle_gauss_points
from .system import System
from .theory import Points, blocks, unknowns_of_cells, weighted_parts


def lengthening_of_beam(system: System, vectors: np.ndarray) -> tuple[np.ndarray, float]:
    """Integrals (n, n) [1/(kg m)] of ``w_i' w_j'`` along a beam, and of one over its E A [1/N].

    ``vectors`` (n_dofs, n) are in the frame; the shapes are those [kg**-0.5] of `Modes`.
    """
    frame, section, (_, x, dx) = system.frame, system.section, quadrature(system)
    slope = system.space.functions(np.arange(len(x)), x, (1,))[0] @ unknowns_of_cells(system, vectors)
    steep, place = (slope * np.sqrt(dx)[..., None]).reshape(-1, vectors.shape[1]), frame.to_metres(x)
    stiff = section.inertia(place) * section.material.E / section.material.rho
    return steep.T @ steep / (frame.length * frame.mass), float((dx.ravel() / stiff).sum() * frame.length)


def slope_products(system: System, vectors: np.ndarray) -> np.ndarray:
    """Integrals (n, n) of ``grad w_i . grad w_j`` over a plate of vectors (n_dofs, n), in the frame."""
    points, whole = quadrature(system), unknowns_of_cells(system, vectors)
    found = np.zeros((vectors.shape[1],) * 2)
    for cells in blocks(len(points.x)):
        slope = system.space.functions(cells, points.x[cells], (1,))[0] @ whole[cells][:, None]  # (n_cells, 2, n_q, n)
        found += np.einsum("nq,niqk,niql->kl", points.dx[cells], slope, slope, optimize=True)
    return found


def section_energies(
    system: System, space: Any, field: Callable[[str, np.ndarray], np.ndarray], vectors: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Twice the mutual strain energy, and the mutual mass (n, n) of vectors (n_dofs, n) in a space, by their terms.

    ``field`` gives one of the section's by its name at places (n, n_q, dimension), in the frame.
    """
    points, n = quadrature(system), vectors.shape[1]
    found = {"K": np.zeros((n, n)), "M": np.zeros((n, n))}
    for matrix, cells, moved, pushed in stress_terms(system, space, field, vectors, points):
        pushed = pushed * points.dx[cells][..., None, None]
        found[matrix] += moved.reshape(-1, n).T @ pushed.reshape(-1, n)
    return found["K"], found["M"]


def stress_terms(
    system: System, space: Any, field: Callable[[str, np.ndarray], np.ndarray], vectors: np.ndarray, points: Points
) -> Iterator[tuple[str, np.ndarray, np.ndarray, np.ndarray]]:
    """Of every term of the energies and block of cells: "K" or "M", cells, strains or motions, and stresses by these.

    Both are (n_cells, n_q, n_parts, n), of each vector; the arguments are those of `section_energies`, and its points.
    """
    whole = unknowns_of_cells(system, vectors)
    for cells in blocks(len(points.x)):
        own = whole[cells][:, None]  # (n_cells, 1, n_local, n)
        for matrix, name, parts in system.rules.terms(space, points, cells):
            weight, moved = field(name, points.x[cells]), parts @ own
            yield matrix, cells, moved, weighted_parts(weight, moved)


def quadrature(system: System, nodes: int = 6) -> Points:
    """Quadrature on every cell of a system, on the true edge.

    Of triangles it has so many Gauss points in each direction; six are exact for products of slopes of quintics.
    """
    space: Any = system.space
    if system.mesh.dimension == 1:
        x, dx = beam_elements.quadrature(space)
        return Points(np.zeros((1, x.shape[1])), x[..., None], dx)
    return on_true_edge(space, *triangle_gauss_points(nodes))
