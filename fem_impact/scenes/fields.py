"""What varies in space or over frequency, as a scene file can write it: a table of values or a list of cases."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from .._base import check
from ..mesh import rise

AXES = ("x", "y")
SHAPES = ({"value", "centre", "radius"}, {"value", "from", "to"})


def varying_field(name: str, value: Any, dimension: int) -> Any:
    """A number, or a function of points (n_points, dimension) [m], from what a scene says.

    That is a number; a table ``{x = [...], values = [...]}``, on a plate ``{x = [...], y = [...], values = [[...],
    ...]}`` with one row of values for each x, linear in between and constant beyond; or ``{cases = [...], otherwise =
    3e-3}``, where each case is ``{value, centre, radius}`` or ``{value, from, to}`` (opposite corners) and the first
    that holds counts.
    """
    if not isinstance(value, dict):
        return value
    if "cases" in value:
        return _cases(name, value, dimension)
    axes = AXES[:dimension]
    if set(value) != {*axes, "values"}:
        raise ValueError(
            f"{name} must be a number, a table with {', '.join(axes)} and values, or cases with otherwise; "
            f"got {check.shown(value)}"
        )
    grid = [check.array(f"{name}.{axis}", value[axis], (None,), "m") for axis in axes]
    for axis, along in zip(axes, grid):
        if len(along) < 2 or (np.diff(along) <= 0.0).any():
            raise ValueError(f"{name}.{axis} must be at least two ascending numbers, got {check.shown(value[axis])}")
    table = check.array(f"{name}.values", value["values"], tuple(map(len, grid)), "m")
    between = RegularGridInterpolator(grid, table)
    low, high = ([along[end] for along in grid] for end in (0, -1))
    return lambda points: between(np.clip(points, low, high))


def _cases(name: str, value: dict, dimension: int) -> Callable[[np.ndarray], np.ndarray]:
    """A function that is constant in parts."""
    if set(value) != {"cases", "otherwise"} or not isinstance(value["cases"], list):
        raise ValueError(f"{name} must have cases, a list, and otherwise; got {check.shown(value)}")
    otherwise = check.positive(f"{name}.otherwise", value["otherwise"], "m")
    cases = []
    for i, case in enumerate(value["cases"]):
        where = f"{name}.cases[{i}]"
        if not isinstance(case, dict) or set(case) not in SHAPES:
            raise ValueError(
                f"{where} must have value, centre and radius, or value, from and to; got {check.shown(case)}"
            )
        inside = check.positive(f"{where}.value", case["value"], "m")
        if "radius" in case:
            centre = check.array(f"{where}.centre", np.atleast_1d(case["centre"]), (dimension,), "m")
            cases.append((inside, centre, check.positive(f"{where}.radius", case["radius"], "m")))
        else:
            ends = [
                check.array(f"{where}.{end}", np.atleast_1d(case[end]), (dimension,), "m") for end in ("from", "to")
            ]
            cases.append((inside, np.minimum(*ends), np.maximum(*ends)))

    def value_at(points: np.ndarray) -> np.ndarray:
        result = np.full(len(points), otherwise)
        for inside, first, second in reversed(cases):  # the first case that holds counts
            if isinstance(second, float):
                here = np.linalg.norm(points - first, axis=1) <= second
            else:
                here = ((points >= first) & (points <= second)).all(axis=1)
            result[here] = inside
        return result

    return value_at


def tapered_size(name: str, value: Any) -> Any:
    """A size, or a function of the distance (n, 1) [m] along a rib from ``[[distance, size], ...]``, linear between."""
    if not isinstance(value, list):
        return value
    distance, size = check.array(name, value, (None, 2), "m").T
    if len(distance) < 2 or (np.diff(distance) <= 0.0).any():
        raise ValueError(f"{name} must be two or more [distance, size], distances ascending, got {check.shown(value)}")
    check.positive(f"smallest {name}", float(size.min()), "m")
    return lambda along: np.interp(along[:, 0], distance, size)


def heights(*, table: str) -> Any:
    """The rise through the points of a CSV file with columns x, y, z [m]; a first line without numbers is skipped."""
    if not isinstance(table, str):
        raise ValueError(f"table must be the name of a file, got {check.shown(table)}")
    file = Path(table)
    if not file.is_file():
        raise ValueError(f"table must name a CSV file with columns x, y, z, got {table!r}; {check.absent(file)}")
    rows = []
    for number, line in enumerate(file.read_text(encoding="utf-8-sig", errors="replace").splitlines(), 1):
        try:
            rows += [[float(word) for word in line.split(",")]] if line.strip() else []
        except ValueError:
            if number > 1 or any(map(check.numeric, line.split(","))):
                raise ValueError(f"table {file.name} must hold numbers; line {number} is {check.shown(line)}") from None
    if any(len(row) != 3 for row in rows):
        raise ValueError(f"table {file.name} must have three columns, x, y and z in m, divided by commas")
    *plane, z = check.array(f"table {file.name}", rows, (None, 3), "m").T if rows else np.zeros((3, 0))
    return rise.table(np.column_stack(plane), z)


def over_frequency(value: Any) -> Any:
    """A damping ratio, or a function of frequency [Hz] from ``{frequency = [...], ratio = [...]}``.

    It is linear in between and constant beyond.
    """
    if not isinstance(value, dict):
        return check.non_negative("damping_ratio", value)
    if set(value) != {"frequency", "ratio"}:
        raise ValueError(f"damping_ratio must be a number or have frequency and ratio, got {check.shown(value)}")
    frequency = check.ascending("damping_ratio.frequency", value["frequency"], "Hz")
    ratio = check.array("damping_ratio.ratio", value["ratio"], frequency.shape)
    if not len(ratio) or (ratio < 0.0).any():
        raise ValueError(f"damping_ratio.ratio must not be negative or empty, got {check.shown(value['ratio'])}")
    return lambda hertz: np.interp(hertz, frequency, ratio)
