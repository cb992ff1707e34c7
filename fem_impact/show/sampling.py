"""Surfaces, frames and times to draw the motion of a body."""

import numpy as np

from .._base import check
from ..impact import free_motion
from ..impact.response import Response
from ..impact.striker import Striker
from ..model.playing import Strokes
from ..modes import viewing
from ..modes.modal import Modes

RIBBON = 0.06  # [-] a beam is drawn as a ribbon: width over length
AFTER = 1.35  # [-] end of the animation over the end of the last contact
MOST_FRAMES = 1000  # [-] most frames of an animation: 0.2 GB or minutes of work


def grid(modes: Modes) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells as of `viewing.grid`, of a body that can be drawn as a line or a surface."""
    check.between("dimension of modes", modes.dimension, 1, 2)
    points, cells = viewing.grid(modes)
    if (modes.dimension == 2 and cells.shape[1] == 1) or len(points) < 2:
        raise ValueError(
            f"modes must be known all over the body, got shapes without cells between their points, {len(points)}; "
            "strike the scene again if the blow was read from a folder, or give cells to fi.Modes.from_arrays"
        )
    return points, cells


def surface(modes: Modes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The body as triangles in the plane; a beam becomes a ribbon.

    Returns
    -------
    points : ndarray, shape (n_points, dimension) [m], where to evaluate the shapes
    cells : ndarray, shape (n_cells, 3)
    plane : ndarray, shape (n_points, 2) [m], where to draw each point
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


def gallery(modes: Modes, points: np.ndarray, count: int, columns: int, first: int = 0) -> tuple[np.ndarray, int]:
    """The shapes from the ``first`` on at points, each with largest value 1, (n_points, n), and columns to draw."""
    count = min(check.count("count", count), modes.n_modes - first)
    shapes = modes.truncated(n_modes=first + count).shapes.at(points)[:, first:]
    return shapes / np.maximum(np.abs(shapes).max(axis=0), 1e-300), min(check.count("columns", columns), count)


def gap(response: Response, times: np.ndarray) -> np.ndarray:
    """Distance between striker and struck surface [m], (n_times,); zero during contact."""
    striker, at = _struck(response)
    tip = response.displacement(striker.at[None], times, body=0)
    return np.maximum(response.displacement(at[None], times) - tip, 0.0)[:, 0]


def energies(response: Response, times: np.ndarray) -> list[np.ndarray]:
    """Energy [J] of each body as in `Response.energies`, and at last that in the contacts and lost, (n_times,) each."""
    history, states = response.history, list(zip(*response.history.states(times)))
    spans = [response.body_slice(i) for i in range(len(response.bodies))]
    parts = [np.array([history.energy(q, p, span) for q, p in states]) for span in spans]
    return [*parts, sum(response.start_energies.values()) - np.sum(parts, axis=0)]


def _struck(response: Response) -> tuple[Striker, np.ndarray]:
    """Striker and strike point of a blow."""
    if response.striker is None or response.at is None:
        raise ValueError("response must have a striker, got one of collide; use the response of strike")
    return response.striker, response.at


def end_of(response: Response | Strokes) -> float:
    """When the pictures of a blow, or of a sequence of strokes, end [s]."""
    first = 0.0 if isinstance(response, Response) else float(response.starts[0])
    return first + AFTER * (last_release(response) - first) or 1.0


def last_release(response: Response | Strokes) -> float:
    """When bodies part for the last time [s]; at the end of the run if they do not touch."""
    return max((impact.end for impact in response.impacts), default=float(response.time[-1]))


def frame_times(response: Response, frames: int) -> np.ndarray:
    """Times (frames,) [s] from the first touch to the end of the pictures; ValueError for too few or too many."""
    return np.linspace(0.0, end_of(response), check.count("frames", frames, low=2, high=MOST_FRAMES))


def clearest(response: Response, times: np.ndarray) -> int:
    """Index of the time [s] that shows the wave best: the first with half the largest deflection under the striker."""
    deflection = np.abs(response.displacement(_struck(response)[1][None], times)[:, 0])
    return int(np.argmax(deflection >= 0.5 * deflection.max()))


def ringing_time(modes: Modes, some: np.ndarray, limits: tuple[float, float]) -> float:
    """How long it takes until the slowest of some modes has lost 60 dB [s], within limits."""
    slowest = -float(free_motion.roots(modes.omega[some], modes.damping_ratio[some]).real.max(initial=-np.inf))
    return float(np.clip(np.log(1e3) / slowest, *limits)) if slowest > 0.0 else limits[1]
