"""Points and cells fine enough to draw a body's shapes, whatever its elements are."""

import numpy as np

from .modal import Modes
from .response import Response

ENOUGH = 2500  # [-] points on a plate: each mode of the first hundred then has some points per half wave
RIBBON = 0.06  # [-] width over length of the ribbon a beam is drawn as
AFTER = 1.35  # [-] a blow is followed so far beyond its last contact
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


def surface(modes: Modes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The body as triangles in the plane, a beam as a ribbon.

    Returns
    -------
    points : ndarray, shape (n_points, dimension) [m], where its shapes are evaluated
    cells : ndarray, shape (n_cells, 3)
    plane : ndarray, shape (n_points, 2) [m], where each point is drawn
    """
    points, cells = grid(modes)
    if modes.dimension == 2:
        return points, cells, points
    x = np.sort(points[:, 0])
    n, half = len(x), 0.5 * RIBBON * float(np.ptp(x))
    here = np.arange(n - 1)
    corners = ((here, here + 1, here + n), (here + 1, here + n + 1, here + n))
    cells = np.vstack([np.column_stack(corner) for corner in corners])
    plane = np.column_stack([np.tile(x, 2), np.repeat([-half, half], n)])
    return plane[:, :1], cells, plane


def gap(response: Response, times: np.ndarray) -> np.ndarray:
    """How far the striker is from the surface it strikes [m], (n_times,); zero while it presses."""
    striker = response.striker
    if striker is None or response.at is None:
        raise ValueError("response must be that of a strike, which has a striker, not of bodies that collide")
    tip = response.displacement(striker.at[None] if striker.modes.dimension else None, times, body=0)
    return np.maximum(response.displacement(response.at[None], times) - tip, 0.0)[:, 0]


def end_of(response: Response) -> float:
    """How long a blow is worth watching [s]."""
    return AFTER * (response.impacts[-1].end if response.impacts else float(response.time[-1])) or 1.0


def telling(response: Response, times: np.ndarray) -> int:
    """Which of some times [s] shows the wave best: the first with half the largest deflection under the striker."""
    assert response.at is not None
    deflection = np.abs(response.displacement(response.at[None], times)[:, 0])
    return int(np.argmax(deflection >= 0.5 * deflection.max()))


def _halved(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    sides = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)  # (3 n_cells, 2)
    unique, number = np.unique(sides, axis=0, return_inverse=True)
    middle = len(points) + number.reshape(-1, 3)  # (n_cells, 3) opposite vertices 2, 0, 1
    a, b, c = cells.T
    ab, bc, ca = middle.T
    quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.vstack([points, points[unique].mean(axis=1)]), np.vstack([np.column_stack(q) for q in quarters])
