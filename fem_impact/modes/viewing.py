"""Mode shapes to look at: points and cells fine enough to draw them smoothly."""

from typing import TYPE_CHECKING, Any

import numpy as np

from .._base import check
from ..fe.ribs import ON
from ..fe.splitting import distance
from ..fe.system import System
from ..mesh.mesh_files import quarter_triangles, sides_of
from . import cell_kinds

if TYPE_CHECKING:
    from .modal import Modes

# [-] points on a plate, on a beam its root: several per half wave in the first hundred modes, 5 across each of ten
ENOUGH = 2500


def grid(modes: "Modes") -> tuple[np.ndarray, np.ndarray]:
    """Points (n_points, dimension) [m] and cells (n_cells, dimension + 1) of a body, refined until smooth to the eye.

    New points lie on the straight sides of the elements, so a curved edge stays as coarse as the mesh. Shapes known at
    points only are not refined.
    """
    points, cells = modes.shapes.grid()
    corners = modes.dimension + 1
    while modes.continuous and cells.shape[1] == corners > 1 and len(points) < ENOUGH ** (0.5 * modes.dimension):
        ends, middle = cells, len(points) + np.arange(len(cells))
        if corners == 2:
            cells = np.vstack([np.column_stack(half) for half in ((ends[:, 0], middle), (middle, ends[:, 1]))])
        else:
            cells, ends = quarter_triangles(cells, len(points))
        points = np.vstack([points, points[ends].mean(axis=1)])
    return points, cells


def body_of(modes: "Modes") -> System | None:
    """The body of finite elements that has these modes; None of others."""
    shapes: Any = modes.shapes
    while hasattr(shapes, "base"):
        shapes = shapes.base
    return getattr(shapes, "system", None)


def heights(modes: "Modes", points: np.ndarray) -> np.ndarray | None:
    """Rise (n_points,) [m] of a curved plate at points (n_points, 2) [m]; None of a flat body."""
    system = body_of(modes)
    rise = None if system is None else getattr(system.section, "rise", None)
    return None if rise is None else check.field("rise", rise, points, "m")


def places_in_space(modes: "Modes", points: np.ndarray) -> np.ndarray:
    """Places (n_points, 3) [m] of points (n_points, dimension) [m] of the unloaded body, z towards the striker."""
    rise = heights(modes, points)
    places = cell_kinds.points_in_space(points)
    places[:, 2] = 0.0 if rise is None else rise
    return places


def rib_sides(modes: "Modes", points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Sides (n, 2) of drawn triangles that lie on the ribs of a plate, point numbers."""
    system, sides = body_of(modes), sides_of(cells)[0] if cells.shape[1] == 3 else np.zeros((0, 2), int)
    on, close = np.zeros(len(sides), bool), ON * float(np.ptp(points, axis=0).max(initial=0.0))
    for rib in getattr(system.section, "ribs", ()) if system is not None else ():
        for start, end in system.mesh.pieces(rib.path):  # type: ignore[union-attr]
            on |= (distance(points, start, end) <= close)[sides].all(axis=1)
    return sides[on]
