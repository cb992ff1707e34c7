"""What modes from elsewhere leave unstated, as far as they determine it themselves: modes left out, and rigid motions.

The squared shapes of all modes up to omega at one point add up to ``S = A omega**p``, rigid motions included: p is 1 on
a plate and 1/2 on a beam, in their middle without any correction for the edge; a body in three dimensions may be
either, and counts as both. The modes left out above omega_c yield
``integral of dS / omega**2 = 2 A omega_c**(p - 2) / (2 - p) - S(omega_c) / omega_c**2``.
"""

from typing import Any

import numpy as np
from scipy.spatial import Delaunay, QhullError

from .._base import check
from .._base.rounding import SAME
from ..mesh.meshes import sizes

FLAT = 1e-6  # [-] of their extent, by which points may be off a line or a plane: as many digits as files keep
HELD = 0.25  # [-] of the mass that moves along in a mode of a held body: at least 0.48 in the first of a clamped plate


def estimate_left_out(
    omega: np.ndarray, rows: np.ndarray, mass: float, dimension: int
) -> tuple[np.ndarray, np.ndarray]:
    """What the modes left out yield at each point: the middle of an interval and half its width, (n_points,) [m/N].

    Three estimates differ where the shapes near an edge change with frequency: the last value of S, its mean course
    over the upper half of the modes, and the mean squared shape of a whole body, 1 / mass.

    Parameters
    ----------
    omega : ndarray, shape (n_modes,) [rad/s]
    rows : ndarray, shape (n_points, n_modes) [kg**-0.5]
    mass : float [kg]
    dimension : int
    """
    moving = omega > 0.0
    n = int(np.count_nonzero(moving))
    still = ~(np.abs(rows) > SAME * mass**-0.5).any(axis=1)
    if not n:
        return np.zeros(len(rows)), np.zeros(len(rows))
    squares, upper = rows[:, moving] ** 2, omega[moving]
    total = (rows[:, ~moving] ** 2).sum(axis=1)[:, None] + np.cumsum(squares, axis=1)  # S just above each mode
    course_from, reached, guesses = slice(n // 2, None), total[:, -1], []
    body = np.full(len(rows), len(omega) / mass if dimension < 3 else reached.mean())  # only a part moves along a line
    for power in {1: (0.5,), 2: (1.0,)}.get(dimension, (0.5, 1.0)):
        last, share = upper[-1] * (1.0 + 0.5 / (power * n)), 2.0 / (2.0 - power)  # half way to the next one
        course = ((total - 0.5 * squares) / upper**power)[:, course_from].mean(axis=1)
        ways = (share - 1.0) * reached, share * course * last**power - reached, (share - 1.0) * body
        guesses += [each / last**2 for each in ways]
    low, high = np.maximum(np.min(guesses, axis=0), 0.0), np.max(guesses, axis=0)
    # near an edge the truth may lie outside by as much as the estimates differ, but not by more than a factor of two:
    # shapes that go over to those of the middle of the body overshoot them by at most that
    outside = np.minimum(high / np.maximum(low, 0.5 * high), 2.0)
    # two standard errors of the mean of the squared shapes; those of a beam are periodic, not random
    spread = 2.0 / n**0.5 if dimension > 1 else 4.0 / n
    low, high = low / outside * max(0.0, 1.0 - spread), high * outside * (1.0 + spread)
    low[still] = high[still] = 0.0
    return 0.5 * (low + high), 0.5 * (high - low)


def unfold_points(points: np.ndarray) -> np.ndarray:
    """Coordinates of points along the line or in the plane on which they lie; the points themselves if on none."""
    if points.shape[1] < 2 or len(points) < 2:
        return points
    _, size, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    n = max(1, int((size > FLAT * size[0]).sum()))
    return points if n == points.shape[1] else points @ axes[:n].T


def loose_motions(
    points: np.ndarray, cells: np.ndarray | None, values: np.ndarray, mass: float, free: Any
) -> tuple[np.ndarray | None, float]:
    """Rigid motions (n_points, n) that modes without any may lack; None if these are the modes of a held body.

    They are those of a uniform body over its points, or all points alike if these span no line or area. Of elastic
    modes, those of a free body carry none of its mass along. Beside them the relative error [-] of their squares: twice
    the largest product, over that body, of one with a low mode, which is zero if the body is as it is taken.
    """
    flat = unfold_points(points)
    own, whole = lumped_mass(flat, cells if flat is points else None), lumped_mass(points, cells)
    share, rigid, error = 0.0 if own is None else _mass_carried(*own, values, mass), None, 0.0
    if free and share >= HELD:
        raise ValueError(
            f"free must be False: one of the modes carries {share:.0%} of the mass along, as only those of a held "
            "body do; leave it out, or check mass and the scale of shapes"
        )
    if whole is not None:
        pairs, weight = whole
        motions = np.column_stack([np.ones(len(points)), (points - points.mean(axis=0)) / np.ptp(points, axis=0).max()])
        at = motions[pairs].mean(axis=1)
        rigid = np.linalg.solve(np.linalg.cholesky(mass * at.T @ (weight[:, None] * at)), motions.T).T
        low = values[:, _low_modes(mass * weight @ values[pairs].mean(axis=1) ** 2, len(points))]
        error = 2.0 * mass * float(np.abs((rigid[pairs].mean(axis=1).T * weight) @ low[pairs].mean(axis=1)).max())
        error = error if error > 0.1 else 0.0  # less comes of even grids: of 11 points on a bar, of 16 on a plate
    if free and rigid is None:
        raise ValueError(
            "free needs points that span the body, to find its rigid motions; give these as modes of 0 Hz instead"
        )
    if not free and share >= HELD:
        return None, 0.0
    rigid = np.full((len(points), 1), mass**-0.5) if rigid is None else rigid
    return rigid if free else rigid * (1.0 + error) ** 0.5, error  # what may be moves as much as it may


def _low_modes(squares: np.ndarray, n_points: int) -> np.ndarray:
    """The lowest modes that move along, whose waves so many points can show, by their mean squares over the body."""
    return np.flatnonzero(squares >= 0.1 * squares.max())[: max(1, int((0.1 * n_points) ** 0.5))]


def _mass_carried(pairs: np.ndarray, weight: np.ndarray, values: np.ndarray, mass: float) -> float:
    """Largest share of its mass that a uniform body carries along in a low mode.

    Zero where a mode says that the body is not uniform, or that the points do not show it, as its mean square is not
    one over the mass, or more if few points lie where it moves most; and for shares that these may show by chance.
    """
    at, n_points = values[pairs].mean(axis=1), len(np.unique(pairs))
    squares = mass * weight @ at**2
    low = _low_modes(squares, n_points)
    shares = mass * (weight @ at[:, low]) ** 2
    shown = (squares[low] > 0.5) & (squares[low] < 1.0 + max(0.5, 8.0 / n_points)) & (n_points * shares >= 2.0)
    return float(shares[shown].max(initial=0.0))


def lumped_mass(points: np.ndarray, cells: np.ndarray | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Pairs of points (n, 2), in the middle of which quadratics are integrated, and shares (n,) of the body."""
    dimension = points.shape[1]
    if dimension == 1:
        order = np.argsort(points[:, 0])
        lines = np.column_stack([order[:-1], order[1:]]) if cells is None else cells
        length = sizes(points, lines)
        pairs = np.vstack([lines, lines[:, [0, 0]], lines[:, [1, 1]]])
        weight = np.concatenate([4.0 * length, length, length]) / 6.0
    elif dimension == 2:
        try:
            triangles = Delaunay(points).simplices if cells is None else cells
        except (QhullError, ValueError):  # fewer than three points, or all on a line
            return None
        pairs = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        weight = np.tile(sizes(points, triangles) / 3.0, 3)
    else:
        return None
    whole = weight.sum()
    return (pairs, weight / whole) if whole > 0.0 else None


def mean_squares(points: np.ndarray, cells: np.ndarray | None, shapes: np.ndarray) -> np.ndarray:
    """Mean squares (n_modes,) [1/kg] of shapes (n_points, n, n_modes) over a body on a line or in a plane, or none."""
    flat = unfold_points(points)
    own = lumped_mass(flat, cells if flat is points else None)
    if own is None:
        return np.zeros(0)
    return np.asarray(own[1] @ (shapes**2).sum(axis=1)[own[0]].mean(axis=1))


def numbers_of_points(loads: Any, n_points: int, given: bool) -> np.ndarray:
    """Numbers of the points under the loads of a given compliance."""
    if loads is None:
        return np.arange(n_points if given else 0)
    numbers = check.array("loads", loads, (None,)).astype(int)
    wrong = not len(numbers) or (numbers < 0).any() or (numbers >= n_points).any() or (numbers != np.ravel(loads)).any()
    if wrong or not given or len(np.unique(numbers)) < len(numbers):
        raise ValueError(
            f"loads must be different numbers of points from 0 to {n_points - 1} with a column of compliance each, got "
            f"{check.shown(loads)}"
        )
    return numbers
