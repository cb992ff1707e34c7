"""Integrals of the slopes of a body's shapes: how much a deflection lengthens what lies in its plane."""

from typing import Any

import numpy as np

from . import beam_elements
from .assembly import System
from .elements import CHUNK
from .section import Plate, evaluate

NODES = 6  # [-] Gauss points in each direction of a triangle: exact for products of slopes of quintics


def products(system: System, vectors: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Integrals (n, n) of ``grad w_i . weight grad w_j`` over the body, on its true edge.

    ``vectors`` (n_dofs, n) are in the frame, the integrals of the shapes [kg**-0.5] as `Modes` has them; ``weight``
    (dimension, dimension) is symmetric.
    """
    frame, space = system.frame, system.space
    x, dx = places(system)
    result = np.zeros((vectors.shape[1],) * 2)
    whole = system.expand @ vectors
    for first in range(0, len(x), CHUNK):
        cells = np.arange(first, min(first + CHUNK, len(x)))
        slope = space.functions(cells, x[cells], (1,))[0]
        slope = slope[:, None] if slope.ndim == 3 else slope  # (n, dimension, n_q, n_local)
        steep = slope @ whole[system.element_dofs.T[cells]][:, None]  # (n, dimension, n_q, n_shapes)
        pulled = np.einsum("ij,ejqk->eiqk", weight, steep) * dx[cells][:, None, :, None]
        result += steep.reshape(-1, result.shape[1]).T @ pulled.reshape(-1, result.shape[1])
    size = len(frame.centre)
    return 0.5 * (result + result.T) * frame.length ** (size - 2) / frame.mass


def places(system: System, nodes: int = NODES) -> tuple[np.ndarray, np.ndarray]:
    """Points of a quadrature on every cell (n_cells, n_q, dimension) and their weights (n_cells, n_q), in the frame."""
    space: Any = system.space
    if system.mesh.dimension == 1:
        x, dx = beam_elements.quadrature(space)
        return x[..., None], dx
    weight, local = np.polynomial.legendre.leggauss(nodes)[1], reference(nodes)
    share = 0.25 * np.outer(weight, weight).ravel() * (1.0 - local[:, 0])
    x = space.origin[:, None] + (local - 1.0 / 3.0) @ space.jacobian.transpose(0, 2, 1)
    dx = np.abs(np.linalg.det(space.jacobian))[:, None] * share
    if space.bent is not None:
        cells = space.bent.cells
        area = np.broadcast_to(np.column_stack([1.0 - local.sum(axis=1), local]), (len(cells), len(local), 3))
        moved, gradient = space.bent.shift(cells, area)
        x[cells] = x[cells] + moved  # a triangle with two curved sides is listed twice, each time with the whole shift
        steep = space.jacobian[cells][:, None] + gradient[..., 1:] - gradient[..., :1]
        dx[cells] = np.abs(np.linalg.det(steep)) * share
    return x, dx


def reference(nodes: int) -> np.ndarray:
    """These points (n_q, 2) of the unit triangle."""
    node = np.polynomial.legendre.leggauss(nodes)[0]
    a, b = (x.ravel() for x in np.meshgrid(0.5 * (node + 1.0), 0.5 * (node + 1.0), indexing="ij"))
    return np.column_stack([a, b * (1.0 - a)])


def softness(system: System) -> float:
    """Integral of one over the thickness of a plate [m], of one over E A of a beam [1/N]."""
    frame, section = system.frame, system.section
    x, dx = places(system)
    low, high = system.mesh.points.min(axis=0), system.mesh.points.max(axis=0)
    place = (frame.centre + frame.length * x.reshape(-1, x.shape[-1])).clip(low, high)
    if isinstance(section, Plate):
        size = evaluate("thickness", section.thickness, place, "m")
    else:
        size = section.inertia(place) * section.material.E / section.material.rho
    return float((dx.ravel() / size).sum() * frame.length ** x.shape[-1])
