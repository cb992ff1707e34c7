"""What the elements of another program's mesh show: its surface, and whether it is solid; and names of its matrices."""

import math
import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from .._base import check
from .._base.rounding import SAME

LINES, SHELLS = {3, 21, 35}, {5, 7, 9, 22, 23, 28, 34}  # codes of vtk
SOLIDS = {10, 11, 12, 13, 14, 24, 25, 26, 27, 29, 32, 33}
# codes and corners of meshio's kinds of cells, without their numbers of nodes
BASIC = {
    "line": (3, 2), "triangle": (5, 3), "quad": (9, 4), "tetra": (10, 4), "hexahedron": (12, 8), "wedge": (13, 6),
    "pyramid": (14, 5),
}  # fmt: skip
# names of matrices and of their files: Nastran's KAA, K2GG, but not K4AA of damping, Abaqus's job_STIF1.mtx
NAMES = (("stiffness", r"^K(?!4[A-Z])|STIF"), ("mass", r"^M|MASS"), ("recovery", r"^R"))


def surface_and_kind(points: np.ndarray, blocks: dict[int, np.ndarray]) -> dict[str, np.ndarray]:
    """Cells of the surface of elements by vtk's codes, and `Body.solid`, as far as they show it.

    A mesh with any solid element is taken as solid, because it may be struck there.
    """
    codes = {code for code, each in blocks.items() if len(each)}
    found = {"cells": surface(points, blocks)}
    if codes & SOLIDS:
        return found | {"solid": np.array(True)}
    return found | ({"solid": np.zeros(0)} if codes & (SHELLS | LINES) else {})


def surface(points: np.ndarray, blocks: dict[int, np.ndarray]) -> np.ndarray:
    """Triangles (n, 3) on the surface of elements by vtk's codes, or lines (n, 2) if they have none."""
    import pyvista

    corners = dict(BASIC.values())  # some programs' quadratic elements come under the codes of linear ones
    wide = {code: each[:, : corners.get(code)] for code, each in blocks.items() if code not in LINES and len(each)}
    if not wide:
        return blocks.get(3, np.zeros((0, 3), int))
    grid = pyvista.UnstructuredGrid(wide, points)
    grid.point_data["row"] = np.arange(len(points))
    skin = grid.extract_surface(nonlinear_subdivision=0, algorithm="dataset_surface").triangulate()
    return np.asarray(skin.point_data["row"], int)[skin.faces.reshape(-1, 4)[:, 1:]]


def of_meshio(cells: Any) -> dict[int, np.ndarray]:
    """Elements of meshio's blocks by vtk's codes, by their corners; of a solid mesh no shells, which name its faces."""
    blocks: dict[int, list[np.ndarray]] = {}
    for block in cells:
        code, corners = BASIC.get(re.sub(r"\d+$", "", block.type), (0, 0))
        if code:
            blocks.setdefault(code, []).append(np.asarray(block.data, int)[:, :corners])
    kept = {code: np.vstack(each) for code, each in blocks.items()}
    return {code: each for code, each in kept.items() if code in SOLIDS} or kept


def steps(n: int, shapes: Sequence[Any], static: Sequence[Any]) -> dict[str, np.ndarray]:
    """Modes and static displacements (n_nodes, 3, n_steps), from those (n_nodes, 3) of each step."""
    named = {"shapes": shapes, "static": static}
    return {name: np.stack(each, axis=2) if len(each) else np.zeros((n, 3, 0)) for name, each in named.items()}


def points_in_space(points: np.ndarray) -> np.ndarray:
    """Points (n, 3) of those with fewer coordinates."""
    return np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))])


def differing_axes(points: np.ndarray, without: str = "") -> list[int]:
    """The axes along which points (n_points, 3) differ, one at least; ``without`` is one that does not count."""
    others = [i for i, axis in enumerate("xyz") if axis != without]
    spread = np.ptp(points[:, others], axis=0)
    return [i for i, wide in zip(others, spread) if wide > SAME * max(spread.max(), 1e-300)] or others[:1]


def count_rigid(frequencies: np.ndarray) -> int:
    """How many modes are rigid, at most six, of frequencies ascending in size and below zero where eigenvalues are.

    No spring has a negative eigenvalue: rounding is then as large. Without any, springs are as soft only where
    eigenvalues differ as the digits of files do: a mount is none.
    """
    size, rounding = np.abs(frequencies), max(0.0, -10.0 * float(frequencies.min(initial=0.0)))
    far = [0.01 if one <= rounding else 3e-4 for one in size]
    return max((k for k in range(1, min(7, len(size))) if size[k - 1] < far[k - 1] * size[k]), default=0)


def settle_frequencies(frequencies: np.ndarray) -> np.ndarray:
    """Frequencies [Hz], ascending in size and below zero where eigenvalues are, with zeros for rigid motions."""
    n_rigid = count_rigid(frequencies)
    found = np.append(np.zeros(n_rigid), frequencies[n_rigid:])
    if (found < 0.0).any():
        raise ValueError(
            f"files must hold a stable body, but the mode at {found[found < 0.0][0]:g} Hz has a negative eigenvalue, "
            "too large for the rounding of a rigid motion; correct the model, or the load under which it buckles"
        )
    return found


def refuse_twice(frequencies: np.ndarray, shapes: np.ndarray, holder: str = "files") -> None:
    """ValueError if a mode occurs twice, as in two subcases; two of one frequency may look alike at three nodes."""
    flat = shapes.reshape(math.prod(shapes.shape[:-1]), len(frequencies))  # which may be none
    marks: set[tuple[float, int]] = set()
    for frequency, mode in zip(frequencies.tolist(), flat.T):
        first = mode[mode.nonzero()[0][:1]].sum()
        mark = frequency, hash((np.sign(first) * mode + 0.0).tobytes())  # of either sign it is the same mode
        if mark in marks and len(shapes) > 3 and mode.any():
            raise ValueError(f"{holder} must hold each mode once, but that at {frequency:g} Hz is there twice")
        marks.add(mark)


def places(points: Any) -> np.ndarray:
    """Points (n_points, 1 to 3) [m], checked."""
    found = check.array("points", points, (None, None), "m")
    if not 1 <= found.shape[1] <= 3:
        raise ValueError(f"points must have 1, 2 or 3 coordinates, got {found.shape[1]}")
    return found


def contradicting(points: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Pairs (n, 2) of points that lie at one place and have different shapes (n_points, n_modes)."""
    pairs = KDTree(points).query_pairs(1e-6 * float(np.ptp(points, axis=0).max(initial=0.0)), output_type="ndarray")
    apart = np.abs(shapes[pairs[:, 0]] - shapes[pairs[:, 1]]).max(axis=1, initial=0.0)
    return pairs[apart > 1e-4 * np.abs(shapes).max(initial=0.0)]  # files in single precision round to less


def refuse_contradicting(points: np.ndarray, shapes: np.ndarray) -> None:
    """ValueError where points lie at one place and have different shapes."""
    for i, j in contradicting(points, shapes)[:1]:
        raise ValueError(f"points {i} and {j} must not lie at one place, as their shapes differ; leave one out")


def rows_of(numbers: np.ndarray, wanted: Any) -> np.ndarray:
    """Rows of nodes by their numbers, all of which are known."""
    order = np.argsort(numbers, kind="stable")
    return order[np.searchsorted(numbers, wanted, side="right", sorter=order) - 1]


def kind_of_matrix(name: str) -> str:
    """Mass, stiffness or recovery, by the name of a matrix; an empty text if neither."""
    return next((kind for kind, pattern in NAMES if re.search(pattern, name.upper())), "")


def matrices_by_kind(file: str, names: Iterable[str]) -> dict[str, str]:
    """Names of the mass, stiffness and recovery among those of a file's matrices."""
    found: dict[str, str] = {}
    for name in names:
        kind = kind_of_matrix(name)
        if kind in found:
            raise ValueError(f"{file} holds {found[kind]} and {name}, and either may be {kind}; leave one of them out")
        found |= {kind: name} if kind else {}
    return found


def triplets(kind: str, matrix: Any) -> dict[str, np.ndarray]:
    """A matrix as arrays of numbers: rows, columns and values (n, 3), and its shape."""
    if hasattr(matrix, "tocoo"):
        coo = matrix.tocoo()
        rows, columns, values = coo.row, coo.col, coo.data
    else:
        rows, columns = np.nonzero(matrix)
        values = np.asarray(matrix)[rows, columns]
    if np.iscomplexobj(values):
        raise ValueError(f"{kind} must be real")
    return {f"{kind}_triplets": np.column_stack([rows, columns, values]), f"{kind}_shape": np.array(matrix.shape)}


def numbered_cells(cells: Any, points: np.ndarray) -> np.ndarray | None:
    """Cells (n_cells, dimension + 1) by numbers of points (n_points, dimension), checked; None if there are none."""
    if cells is None:
        return None
    given = check.array("cells", cells, (None, points.shape[1] + 1))
    if (given % 1.0).any() or given.min() < 0 or given.max() >= len(points):
        raise ValueError(f"cells must be numbers of points from 0 to {len(points) - 1}, got {check.shown(cells)}")
    return given.astype(int)
