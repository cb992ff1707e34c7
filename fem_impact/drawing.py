"""Points and cells fine enough to draw a body's shapes, whatever its elements are."""

import numpy as np

from .modal import Modes

ENOUGH = 2500  # [-] points on a plate: each mode of the first hundred then has some points per half wave
HALVINGS = 5  # [-] at most: each makes four triangles of one


def grid(modes: Modes) -> tuple[np.ndarray, np.ndarray]:
    """Points (n_points, dimension) [m] and cells (n_cells, dimension + 1) of a body, refined until smooth to the eye.

    Sides are halved as straight lines, so a curved edge is drawn as finely as its elements follow it.
    """
    points, cells = modes.shapes.grid()
    for _ in range(HALVINGS):
        if modes.dimension != 2 or cells.shape[1] != 3 or len(points) >= ENOUGH:
            break
        points, cells = _halved(points, cells)
    return points, cells


def _halved(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    sides = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)  # (3 n_cells, 2)
    unique, number = np.unique(sides, axis=0, return_inverse=True)
    middle = len(points) + number.reshape(-1, 3)  # (n_cells, 3) opposite vertices 2, 0, 1
    a, b, c = cells.T
    ab, bc, ca = middle.T
    quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.vstack([points, points[unique].mean(axis=1)]), np.vstack([np.column_stack(q) for q in quarters])
