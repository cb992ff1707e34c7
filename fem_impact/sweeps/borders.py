"""Where the number of impacts changes on a map with two axes: found between its cells, located by bisection."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import xarray
from contourpy import LineType, contour_generator

from .._base import check
from ..model.budget import FINEST
from . import batches
from .cases import Cases
from .cells import AXES, FAMILY_AXES, is_logarithmic
from .refined import beside_change

WIDTH = 1.5e-3  # [-] widest bracket of a border, a share of the axis: half of it and FINER together stay below 1e-3
FINER = 0.3  # [-] of the map's tolerance: that of blows beside a border; 0.01 moved those of 400 x 400 cells by 2.4e-4
# [-] beside borders, to limit work to some 20 s: where the motion is chaotic, borders are known to the cell
MOST_BLOWS = 200_000
PREFIX = "border"  # of the dimension and the variables in a map
MEANINGS = {
    "impacts": "number of impacts on one side of the border; there are more on the other side",
    "curve": "number of the curve that a point belongs to; a closed curve ends with its first point",
    "error": "largest error of a point along the axis on which it was located, as a share of that axis",
}

Solve = Callable[[Cases, str], tuple[np.ndarray, dict[int, str]]]  # cases, the name of the round: as `solve_cases`


@dataclass(frozen=True, eq=False)
class Border:
    """One curve on a map with two axes: a striker touches more often on one side than on the other."""

    impacts: int  # [-] number of impacts on one side at most; there are more on the other side
    axes: tuple[str, str]  # names of the axes of the map
    points: np.ndarray  # (n_points, 2) values along both axes, in their units; the first point again if it is closed
    error: np.ndarray  # (n_points,) [-] largest error along the axis on which a point was located, as a share of it


@dataclass(frozen=True, eq=False)
class Plane:
    """The two axes of a map; a place on it is counted in cells, (n, 2), fractions lie between the cells."""

    grid: Cases
    solve: Solve
    kernels: batches.Kernels = field(default_factory=dict)

    @cached_property
    def columns(self) -> list[tuple[np.ndarray, np.ndarray, bool]]:
        """Of both axes the values (n,), these or their logarithms, which are evenly spaced, and which of the two."""
        axes = [np.asarray(values, float).reshape(-1) for values in self.grid.axes.values()]
        logs = [is_logarithmic(values) for values in axes]
        return [(values, np.log(values) if log else values, log) for values, log in zip(axes, logs)]

    def values_at(self, places: np.ndarray) -> np.ndarray:
        """Values (n, 2) of the axes at places (n, 2); between cells evenly spaced as the cells are."""
        found = np.empty(places.shape)
        for column, place, (values, even, log) in zip(found.T, places.T, self.columns):
            between = np.interp(place, np.arange(len(values)), even)
            on, whole = place == np.round(place), np.round(place).astype(int)
            column[:] = np.where(on, values[whole], np.exp(between) if log else between)
        return found

    def counted(self, places: np.ndarray, turn: str) -> np.ndarray:
        """Number of impacts (n,) at places (n, 2), by a finer tolerance than that of the map; -1 if refused."""
        axes = {
            name: column[:, None] if name == "at" else column
            for name, column in zip(self.grid.axes, np.ascontiguousarray(self.values_at(places).T))
        }
        shared = not {*FAMILY_AXES, "loss"} & set(axes)  # then all rounds strike the same bodies
        tolerance = min(self.grid.tolerance, max(FINEST, FINER * self.grid.tolerance))
        kernels = self.kernels if shared else {}
        rows = Cases(self.grid.base, axes, tolerance, self.grid.residual, by_row=True, kernels=kernels)
        numbers, _ = self.solve(rows, turn)
        count = numbers[rows.layers.index("n_impacts")]
        return np.where(np.isnan(count), -1, count).astype(int)


def why_none(grid: Cases) -> str:
    """Why a map has no borders: '' if it has."""
    if len(grid.shape) != 2 or min(grid.shape) < 2:
        sizes = ", ".join(f"{name} ({len(values)})" for name, values in grid.axes.items())
        return f"a map needs two axes of two values or more, got {sizes}"
    for name, values in grid.axes.items():
        values = np.asarray(values, float)
        if values.ndim == 2 and values.shape[1] > 1:
            return f"axes must have one number each, got strike points of {values.shape[1]}"
        steps = np.diff(values.reshape(-1))
        if not ((steps > 0.0).all() or (steps < 0.0).all()):
            return f"the values of {name} must ascend"
    return ""


def find_borders(grid: Cases, count: np.ndarray, solve: Solve) -> tuple[tuple[Border, ...], np.ndarray]:
    """The borders between numbers of impacts on a grid, see `why_none`, and which of its cells (n, n) are in doubt.

    In doubt is a number that depends on the tolerance, or was refused. ``count`` is the number in each cell, -1 if it
    was refused; ``solve`` computes cases and takes a name for the round.

    Cells beside a border are counted again by a finer tolerance, until none is left that was not. Then each edge
    between two cells that a border crosses is halved until the crossing is known to WIDTH: all edges of one round are
    one call of the engine. Curves join the crossings cell by cell (marching squares). More than one crossing of an edge
    is taken for one or none.
    """
    plane = Plane(grid, solve)
    fine, sure, spent = count.copy(), np.zeros(count.shape, bool), 0
    while True:
        beside = beside_change(fine) & ~sure
        spent += int(beside.sum())
        if not beside.any() or spent > MOST_BLOWS:
            break
        fine[beside] = plane.counted(np.argwhere(beside).astype(float), f"recount-{int(sure.sum())}")
        sure |= beside
    doubtful = (fine < 0) | (count < 0) | (fine != count)
    curves, vertices = _joined(fine)
    if not curves:
        return (), doubtful
    edges, which = np.unique(vertices, axis=0, return_inverse=True)
    places, error = _located(plane, fine, edges)
    values = plane.values_at(places)[which.reshape(-1)]
    error = error[which.reshape(-1)]
    ends, (first, second) = np.cumsum([n for _, n in curves])[:-1], grid.axes
    borders = tuple(
        Border(level, (first, second), points, errors)
        for (level, _), points, errors in zip(curves, np.split(values, ends), np.split(error, ends))
    )
    return borders, doubtful


def _joined(count: np.ndarray) -> tuple[list[tuple[int, int]], np.ndarray]:
    """Curves along the borders: their numbers of impacts and of points; and all points (n, 3) as level and edge.

    An edge is given by its middle, in halves of a cell.
    """
    known = count[count >= 0]
    curves, vertices = [], [np.empty((0, 3), int)]
    for level in np.unique(known)[:-1].tolist():
        inside = np.ma.masked_array((count > level).astype(float), count < 0)
        lines: Any = contour_generator(z=inside, line_type=LineType.Separate, corner_mask=False).lines(0.5)
        for line in lines:
            middle = np.round(2.0 * line[:, ::-1]).astype(int)
            curves.append((level, len(line)))
            vertices.append(np.column_stack([np.full(len(line), level), middle]))
    return curves, np.concatenate(vertices)


def _located(plane: Plane, count: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where borders cross edges (n, 3): places (n, 2) and their errors (n,) [-]."""
    level, middle = edges[:, 0], edges[:, 1:]
    along = (middle % 2 == 1).argmax(axis=1)
    low, high = middle // 2, (middle + 1) // 2
    shares = [np.diff(even) / (even[-1] - even[0]) for _, even, _ in plane.columns]  # [-] of neighbouring cells
    size = np.where(along == 0, *(share[np.minimum(low[:, k], len(share) - 1)] for k, share in enumerate(shares)))
    more = count[tuple(low.T)] > level
    low, high = low.astype(float), high.astype(float)
    width, todo, turn, spent = np.abs(size), np.ones(len(edges), bool), 0, 0
    while True:
        todo &= width > WIDTH
        some = np.flatnonzero(todo)
        spent += len(some)
        if not len(some) or spent > MOST_BLOWS:
            break
        centre = 0.5 * (low[some] + high[some])
        found = plane.counted(centre, f"halving-{turn}")
        known = found >= 0
        same = (found > level[some]) == more[some]
        low[some[known & same]] = centre[known & same]
        high[some[known & ~same]] = centre[known & ~same]
        width[some[known]] *= 0.5
        todo[some[~known]] = False
        turn += 1
    return 0.5 * (low + high), 0.5 * width


def add_borders(table: xarray.Dataset, borders: tuple[Border, ...], doubtful: np.ndarray, smallest: float) -> None:
    """Write borders into a map; islands narrower than ``smallest`` [-] of an axis can be missing."""
    meaning = "whether the number of impacts depends on the tolerance or the body's description, or was refused"
    table["doubtful"] = (table.n_impacts.dims, doubtful, {"units": "1", "long_name": meaning})
    table.attrs["borders"] = _describe_borders(borders, int(doubtful.sum()), smallest)
    if not borders:
        return
    n = [len(border.points) for border in borders]
    columns: dict[str, Any] = {
        "impacts": np.repeat(np.array([border.impacts for border in borders], np.int32), n),
        "curve": np.repeat(np.arange(len(n), dtype=np.int32), n),
        "error": np.concatenate([border.error for border in borders]),
    }
    for name, values in columns.items():
        table[f"{PREFIX}_{name}"] = (PREFIX, values, {"units": "1", "long_name": MEANINGS[name]})
    points = np.concatenate([border.points for border in borders])
    for name, values in zip(borders[0].axes, points.T):
        unit = table[name].attrs.get("units", AXES[name][0])
        table[f"{PREFIX}_{name}"] = (PREFIX, values, {"units": unit, "long_name": f"{AXES[name][1]}, on a border"})


def _describe_borders(borders: tuple[Border, ...], doubt: int, smallest: float) -> str:
    """What is known of the borders, and that so many cells are in doubt, in a sentence."""
    beside = f"{doubt} cells whose number of impacts is in doubt"
    missed = f"islands narrower than {smallest:.2g} of an axis can be missing"
    if not borders:
        return f"no border between numbers of impacts; {beside}; {missed}"
    error = np.concatenate([border.error for border in borders])
    fine = error[error <= 0.5 * WIDTH]
    located = f"located to {fine.max():.1g} of the axes" if len(fine) else "not located"
    n_coarse = len(error) - len(fine)
    coarse = f", {n_coarse} of {len(error)} points only to the cell" if n_coarse else ""
    curves = f"{len(borders)} curve{'s' if len(borders) > 1 else ''}"
    return f"{curves} between numbers of impacts, {located}{coarse}; {beside}; {missed}"


def read_borders(table: xarray.Dataset) -> tuple[Border, ...]:
    """The curves on which the number of impacts changes, from a map with two axes.

    Parameters
    ----------
    table : xarray.Dataset
        From `sweep` with borders, or read from a map's file.

    Returns
    -------
    tuple of Border
        Each with ``impacts`` (that number or fewer on one side, more on the other), the names of the two ``axes``,
        ``points`` (n_points, 2) in the units of the axes and ``error`` (n_points,) [-], the largest error of a point
        along the axis on which it was located, as a share of that axis (of its logarithm if it is logarithmic).
        Empty if the number is the same everywhere.

    Raises
    ------
    ValueError
        If the borders of the map were not looked for.

    Examples
    --------
    >>> plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=50)
    >>> over = {"mass": [0.02, 0.05, 0.1, 0.2], "stiffness": [2e4, 5e4, 1e5, 2e5]}
    >>> blow = {"striker": fi.Striker.rigid(0.1), "contact": fi.Contact.linear(1e5), "at": (0.465, 0.3), "speed": 1.0}
    >>> border, = fi.read_borders(fi.sweep(plate, **blow, over=over, borders=True))
    >>> border.impacts, border.axes, border.points.shape, bool(border.error.max() < 1e-3)
    (1, ('mass', 'stiffness'), (8, 2), True)
    """
    if not isinstance(table, xarray.Dataset):
        raise ValueError(f"table must be a map, from fi.sweep or read from its file, got {check.shown(table)}")
    if "borders" not in table.attrs:
        raise ValueError("table has no borders; make the map with borders=True")
    if PREFIX not in table.sizes:
        return ()
    first, second = map(str, table.n_impacts.dims)
    columns = [np.asarray(table[f"{PREFIX}_{name}"]) for name in (first, second, "impacts", "curve", "error")]
    x, y, impacts, curve, error = columns
    starts = np.flatnonzero(np.diff(curve)) + 1
    parts = zip(*(np.split(column, starts) for column in (x, y, impacts, error)))
    return tuple(Border(int(n[0]), (first, second), np.column_stack([a, b]), e) for a, b, n, e in parts)
