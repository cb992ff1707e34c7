"""Mode shapes to look at: points and cells fine enough to draw them smoothly, and pyvista's own grids."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ..mesh.mesh_files import quartered

if TYPE_CHECKING:
    from .modal import Modes

ENOUGH = 2500  # [-] points on a plate: several per half wave in the first hundred modes, 5 across each of ten


def grid(modes: "Modes") -> tuple[np.ndarray, np.ndarray]:
    """Points (n_points, dimension) [m] and cells (n_cells, dimension + 1) of a body, refined until smooth to the eye.

    New points lie on the straight sides of the elements, so a curved edge stays as coarse as the mesh. Shapes known at
    points only are not refined.
    """
    points, cells = modes.shapes.grid()
    while modes.continuous and modes.dimension == 2 and cells.shape[1] == 3 and len(points) < ENOUGH:
        cells, sides = quartered(cells, len(points))
        points = np.vstack([points, points[sides].mean(axis=1)])
    return points, cells


def pyvista_grid(modes: "Modes") -> Any:
    """The body as a `pyvista.UnstructuredGrid` with its mode shapes, see `Modes.to_pyvista`."""
    import pyvista  # loads all of VTK, which few need

    points, cells = grid(modes)
    places = np.zeros((len(points), 3))
    places[:, : points.shape[1]] = points
    kind = {1: pyvista.CellType.VERTEX, 2: pyvista.CellType.LINE, 3: pyvista.CellType.TRIANGLE}[cells.shape[1]]
    made = pyvista.UnstructuredGrid({kind: cells}, places)
    for i, shape in enumerate(modes.shapes.at(points).T, 1):
        made.point_data[f"mode_{i:03d}"] = shape
    made.field_data["frequency"], made.field_data["damping_ratio"] = modes.frequencies, modes.damping_ratio
    return made
