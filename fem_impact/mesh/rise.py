"""Rises of usual curved bodies: the height of the unloaded surface above the outline, towards the striker.

Each function returns a function of points (n, 2) [m] that gives heights (n,) [m], for ``rise`` of `assemble`. Yours
may be any such function.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CloughTocher2DInterpolator
from scipy.sparse import bsr_array, diags_array
from scipy.sparse.linalg import cg
from scipy.spatial import Delaunay, cKDTree

from .._base import check
from .._base.rounding import ROUNDING, SAME

Rise = partial[np.ndarray]


def _local(points: np.ndarray, centre: np.ndarray, angle: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (n,) along and across a direction, from a centre."""
    (x, y), c, s = (points - centre).T, np.cos(angle), np.sin(angle)
    return c * x + s * y, c * y - s * x


def _round(away: np.ndarray, radius: float) -> np.ndarray:
    """Height of a circle of a radius at distances from its top; negative radii are hollow."""
    if (away >= abs(radius)).any():
        raise ValueError(f"radius must be larger than the body, got {radius:g} m at {away.max():g} m from the top")
    return np.sign(radius) * -(away**2) / (abs(radius) + np.sqrt(radius**2 - away**2))


def _cap(points: np.ndarray, radius: float, centre: np.ndarray) -> np.ndarray:
    return _round(np.hypot(*_local(points, centre)), radius)


def _bent_height(points: np.ndarray, radius: float, angle: float, centre: np.ndarray, saddle: bool) -> np.ndarray:
    along, across = map(np.abs, _local(points, centre, angle))
    return _round(along, radius) - _round(across, radius) if saddle else _round(across, radius)


def _cymbal(points: np.ndarray, radius: float, bow: float, cup_radius: float, cup: float) -> np.ndarray:
    away = np.hypot(*points.T)
    return bow * (1.0 - (away / radius) ** 2) + cup * np.maximum(1.0 - (away / cup_radius) ** 2, 0.0) ** 3


@dataclass(frozen=True, eq=False)
class _Heights:
    """A smooth surface through points; it differs from others by these alone."""

    points: np.ndarray  # (n, 2) [m]
    heights: np.ndarray  # (n,) [m]
    first: "_Heights | None" = None  # the surface of which this is `otherwise`

    @cached_property
    def otherwise(self) -> "_Heights":
        """A surface through the same points that is as far from this as this may be from the true one.

        Three times as far as with slopes of cubics: frequencies with that were 0.1 to 2.5 times as far as from true
        ones, of domes, waves and bumps through 60 points or more.
        """
        return replace(self, first=self)

    @cached_property
    def _smooth(self) -> Any:
        place, which = np.unique(self.points, axis=0, return_index=True)
        triangles, height = Delaunay(place), self.heights[which]
        smooth = CloughTocher2DInterpolator(triangles, height, tol=np.inf)  # its own slopes have no bend at the rim
        slope = _spline_slopes(triangles, height, _fitted_polynomials(place, height, 2)[:, 2:])
        if self.first is not None:
            slope += 3.0 * (_fitted_polynomials(place, height, 3)[:, :2] - slope)
        smooth.grad[:, 0] = slope
        return smooth

    def __call__(self, points: np.ndarray) -> np.ndarray:
        found = self._smooth(points)
        beyond = np.isnan(found)
        if beyond.any():
            known, height = self._smooth.tri.points, self._smooth.values[:, 0]
            nearest = cKDTree(known).query(points[beyond])[1]
            step = points[beyond] - known[nearest]
            found[beyond] = height[nearest] + (self._smooth.grad[nearest, 0] * step).sum(axis=1)
        return found


def _fitted_polynomials(points: np.ndarray, heights: np.ndarray, degree: int) -> np.ndarray:
    """Coefficients (n, n_terms), of x, y, x**2, x y, y**2 ..., of polynomials about n points, through each.

    They are fitted to twice as many points around as they have terms.
    """
    powers = np.array([(k - i, i) for k in range(1, degree + 1) for i in range(k + 1)])
    away, near = cKDTree(points).query(points, min(2 * len(powers) + 1, len(points)))
    reach = away[:, -1:]
    step, weight = (points[near] - points[:, None]) / reach[..., None], np.maximum(1.0 - (away / reach) ** 2, 0.01)
    terms = (step[:, :, None] ** powers).prod(axis=-1) * weight[..., None]
    rest = weight * (heights[near] - heights[:, None])
    found = np.linalg.pinv(terms, rcond=1e-6) @ rest[..., None]
    return np.asarray(found[..., 0] / reach ** powers.sum(axis=1))


def _spline_slopes(triangles: Delaunay, heights: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """Slopes (n, 2) with which cubics along all sides bend least, in squares, beside 2 ``bend`` (n, 3): xx, xy, yy.

    Without that they would be natural splines: exact for no quadratic, and straight at the rim.
    """
    start, other = triangles.vertex_neighbor_vertices
    count, n = np.diff(start), len(heights)
    own = np.repeat(np.arange(n), count)
    side = triangles.points[other] - triangles.points[own]
    length = np.linalg.norm(side, axis=1)
    x, y = along = side.T / length
    pull = 6.0 * (heights[other] - heights[own]) / length**2
    pull -= 2.0 * (bend[own] * np.column_stack([x**2, x * y, y**2])).sum(axis=1)
    pair, shape = np.einsum("in,jn->nij", along, along / length), (2 * n, 2 * n)
    near, far = (bsr_array(each, shape=shape) for each in ((4.0 * pair, own, start), (2.0 * pair, other, start)))
    alone = diags_array(np.repeat(1.0 * (count == 0), 2))  # points too near others to be corners
    stiff = near.tocsr() + far.tocsr() + alone
    force = np.column_stack([np.bincount(own, pull * each, n) for each in along]).ravel()
    found = cg(stiff, force, rtol=ROUNDING, M=diags_array(1.0 / stiff.diagonal()))[0]  # 50 to 200 steps
    return np.asarray(found).reshape(-1, 2)


def _radius(radius: float) -> float:
    if check.number("radius", radius, "m") == 0.0:
        raise ValueError("radius must not be zero; a flat plate needs no rise")
    return float(radius)


def cap(radius: float, *, centre: "ArrayLike" = (0.0, 0.0)) -> Rise:
    """A sphere of a radius [m], highest at ``centre`` (2,) [m]; lowest there if the radius is negative.

    Examples
    --------
    >>> fi.rise.cap(2.0)(np.array([[0.1, 0.0]])).round(6).tolist()  # m
    [-0.002502]
    """
    return partial(_cap, radius=_radius(radius), centre=check.array("centre", centre, (2,), "m"))


def cylinder(radius: float, *, angle: float = 0.0, centre: "ArrayLike" = (0.0, 0.0)) -> Rise:
    """A cylinder of a radius [m] whose straight top runs through ``centre`` at an angle [rad] from the x axis."""
    angle, place = check.number("angle", angle, "rad"), check.array("centre", centre, (2,), "m")
    return partial(_bent_height, radius=_radius(radius), angle=angle, centre=place, saddle=False)


def saddle(radius: float, *, angle: float = 0.0, centre: "ArrayLike" = (0.0, 0.0)) -> Rise:
    """A saddle that falls with a radius [m] along a direction ``angle`` [rad] and rises as much across it."""
    angle, place = check.number("angle", angle, "rad"), check.array("centre", centre, (2,), "m")
    return partial(_bent_height, radius=_radius(radius), angle=angle, centre=place, saddle=True)


def cymbal(radius: float, bow: float, cup_radius: float, cup: float) -> Rise:
    """A cymbal around the origin: a bow of a height [m] over its whole radius [m], and a cup of a height [m] on top.

    The bow is a paraboloid that is zero at the edge. The cup of ``cup_radius`` [m] joins it without a jump of slope or
    curvature.

    Examples
    --------
    >>> fi.rise.cymbal(0.2, bow=0.02, cup_radius=0.05, cup=0.015)(np.array([[0.0, 0.0], [0.05, 0.0]])).tolist()
    [0.035, 0.01875]
    """
    sizes: dict[str, Any] = {"radius": check.positive("radius", radius, "m"), "bow": check.number("bow", bow, "m")}
    sizes |= {"cup_radius": check.positive("cup_radius", cup_radius, "m"), "cup": check.number("cup", cup, "m")}
    return partial(_cymbal, **sizes)


def table(points: "ArrayLike", heights: "ArrayLike") -> Callable[[np.ndarray], np.ndarray]:
    """A smooth surface through heights (n,) [m] at points (n, 2) [m]; beyond them, it goes on straight.

    What few points leave open between them is in `Modes.frequency_error` and in the errors of blows.
    """
    place = check.array("points", points, (None, 2), "m")
    height = check.array("heights", heights, (len(place),), "m")
    if len(place) < 4:
        raise ValueError(f"points must be four or more, got {len(place)}")
    size = np.linalg.svd(place - place.mean(axis=0), compute_uv=False)
    if size[1] <= SAME * size[0]:
        raise ValueError("points must not all lie on one line; give some beside it")
    return _Heights(place, height)
