"""Integrals of the slopes of a body's shapes: how much a deflection lengthens what lies in its plane."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from . import beam_elements
from .elements import collapsed, on_true_edge
from .section import Plate, size_at
from .system import System
from .theory import Points, blocks, unknowns_of_cells, weighted


def products(system: System, vectors: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Integrals (n, n) of ``grad w_i . weight grad w_j`` over the body, on its true edge.

    ``vectors`` (n_dofs, n) are in the frame, the integrals of the shapes [kg**-0.5] as `Modes` has them; ``weight``
    (dimension, dimension) is symmetric.
    """
    frame, space = system.frame, system.space
    _, x, dx = quadrature(system)
    result = np.zeros((vectors.shape[1],) * 2)
    whole = unknowns_of_cells(system, vectors)
    for cells in blocks(len(x)):
        slope = space.functions(cells, x[cells], (1,))[0]
        slope = slope[:, None] if slope.ndim == 3 else slope  # (n, dimension, n_q, n_local)
        steep = slope @ whole[cells][:, None]  # (n, dimension, n_q, n_shapes)
        pulled = np.einsum("ij,ejqk->eiqk", weight, steep) * dx[cells][:, None, :, None]
        result += steep.reshape(-1, result.shape[1]).T @ pulled.reshape(-1, result.shape[1])
    size = len(frame.centre)
    return 0.5 * (result + result.T) * frame.length ** (size - 2) / frame.mass


def section_energies(
    system: System, space: Any, field: Callable[[str, np.ndarray], np.ndarray], vectors: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Twice the mutual strain energy, and the mutual mass (n, n) of vectors (n_dofs, n) in a space, by their terms.

    ``field`` gives one of the section's by its name at places (n, n_q, dimension), in the frame.
    """
    points, n = quadrature(system), vectors.shape[1]
    found = {"K": np.zeros((n, n)), "M": np.zeros((n, n))}
    for matrix, cells, moved, pushed in stressed(system, space, field, vectors, points):
        pushed = pushed * points.dx[cells][..., None, None]
        found[matrix] += moved.reshape(-1, n).T @ pushed.reshape(-1, n)
    return found["K"], found["M"]


def stressed(
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
            yield matrix, cells, moved, weighted(weight, moved)


def quadrature(system: System, nodes: int = 6) -> Points:
    """Quadrature on every cell of a system, on the true edge.

    Of triangles it has so many Gauss points in each direction; six are exact for products of slopes of quintics.
    """
    space: Any = system.space
    if system.mesh.dimension == 1:
        x, dx = beam_elements.quadrature(space)
        return Points(np.zeros((1, x.shape[1])), x[..., None], dx)
    return on_true_edge(space, *collapsed(nodes))


def softness(system: System) -> float:
    """Integral of one over the thickness of a plate [m], of one over E A of a beam [1/N]."""
    frame, section = system.frame, system.section
    _, x, dx = quadrature(system)
    place = frame.to_metres(x)
    if isinstance(section, Plate):
        size = size_at(section, "thickness", place)
    else:
        size = section.inertia(place) * section.material.E / section.material.rho
    return float((dx.ravel() / size).sum() * frame.length ** x.shape[-1])
