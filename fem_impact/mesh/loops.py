"""Exact outline of a plate: arcs and Bezier pieces joined into loops, each piece part of a named edge."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely

from .._base import check
from .._base.rounding import HALVINGS, SAME
from .facets import angles, cross_product

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "km": 1e3}
FARTHEST = 1e12  # [-] largest coordinate accepted: products of larger ones lose digits or overflow
LARGEST = 20.0  # [m] a plate larger than this was probably drawn in millimetres, where 20 mm make 20 m
SLENDER = 1e4  # [-] largest area / half width**2: the mesher is fast up to 4e3 and hangs from 4e4
# [rad] largest turn within one facet: puts 26 facets on a circle; half of it doubles the triangles at curved edges
TURN = 0.25
MOST_PIECES = 2000  # [-] most pieces in an outline: several times what tracing programs write
# [-] intervals per piece for integrating its length and turning: some ten for each facet of a whole circle
SAMPLES = 256


@dataclass(frozen=True, eq=False)
class Arc:
    """Arc of a circle or ellipse: centre + a cos(angle) + b sin(angle)."""

    centre: np.ndarray  # (2,) [m]
    a: np.ndarray  # (2,) [m]
    b: np.ndarray  # (2,) [m]
    start: float  # [rad]
    sweep: float  # [rad]
    name: str = ""

    def at(self, t: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Points (n, 2) at parameters (n,) between 0 and 1, or a derivative with respect to the parameter."""
        angle = self.start + self.sweep * np.asarray(t)[..., None] + 0.5 * np.pi * derivative
        swept = self.sweep**derivative * (np.cos(angle) * self.a + np.sin(angle) * self.b)
        return swept + (self.centre if derivative == 0 else 0.0)

    def reversed(self) -> "Arc":
        """The same piece traversed backwards."""
        return replace(self, start=self.start + self.sweep, sweep=-self.sweep)


@dataclass(frozen=True, eq=False)
class Bezier:
    """Bezier piece of any degree; two control points make a straight line."""

    control: np.ndarray  # (n, 2) [m]
    name: str = ""

    def at(self, t: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Points (n, 2) at parameters (n,) between 0 and 1, or a derivative with respect to the parameter."""
        control = self.control
        for _ in range(derivative):
            control = (len(control) - 1) * np.diff(control, axis=0)
            if not len(control):
                return np.zeros((*np.shape(t), 2))
        t, degree = np.asarray(t)[..., None], len(control) - 1
        k = np.arange(degree + 1)
        return np.array([math.comb(degree, int(i)) for i in k]) * t**k * (1.0 - t) ** (degree - k) @ control

    def reversed(self) -> "Bezier":
        """The same piece traversed backwards."""
        return replace(self, control=self.control[::-1].copy())


Piece = Arc | Bezier
Loop = tuple[Piece, ...]


def segment(start: Any, end: Any, name: str = "") -> Bezier:
    """Straight piece from ``start`` to ``end``, both (2,) [m]."""
    return Bezier(np.array([start, end], float), name)


def circle(centre: Any, radius: float, name: str = "") -> Loop:
    """A full circle, anticlockwise."""
    return (Arc(np.array(centre, float), np.array([radius, 0.0]), np.array([0.0, radius]), 0.0, 2.0 * np.pi, name),)


def is_straight(piece: Piece) -> bool:
    """Whether a piece is a straight line."""
    if isinstance(piece, Arc):
        return False
    along = piece.control[-1] - piece.control[0]
    across = (piece.control - piece.control[0]) @ np.array([along[1], -along[0]])
    return bool((np.abs(across) <= 1e-12 * (along @ along)).all())


def tangent(piece: Piece, t: np.ndarray) -> np.ndarray:
    """Unit tangents (n, 2) at parameters (n,); if the derivative vanishes at an end, the value just inside."""
    t = np.asarray(t, float)
    speed = piece.at(t, 1)
    length = np.linalg.norm(speed, axis=-1, keepdims=True)
    still = length[..., 0] < 1e-9 * np.abs(piece.at(np.linspace(0, 1, 5), 1)).max()
    if still.any():
        inside = piece.at(np.where(t < 0.5, t + 1e-4, t - 1e-4), 1)
        speed = np.where(still[..., None], inside, speed)
        length = np.linalg.norm(speed, axis=-1, keepdims=True)
    return speed / np.where(length > 0.0, length, 1.0)


def curvature(piece: Piece, t: np.ndarray) -> np.ndarray:
    """Signed curvature (n,) [1/m], positive where the piece turns left."""
    if is_straight(piece):
        return np.zeros(np.shape(t))
    first, second = piece.at(t, 1), piece.at(t, 2)
    speed = np.linalg.norm(first, axis=-1)
    fastest = np.linalg.norm(piece.at(np.linspace(0.0, 1.0, 9), 1), axis=1).max()
    return cross_product(first, second) / np.maximum(speed, 1e-6 * fastest) ** 3


def divide(piece: Piece, size: float) -> np.ndarray:
    """Parameters (n + 1,) from 0 to 1 that cut a piece into facets of at most ``size`` [m] and `TURN` [rad]."""
    if isinstance(piece, Bezier) and len(piece.control) == 2:
        length = float(np.linalg.norm(piece.control[1] - piece.control[0]))
        return np.linspace(0.0, 1.0, max(1, math.ceil(length / size * (1.0 - 1e-6))) + 1)
    t = np.linspace(0.0, 1.0, SAMPLES + 1)
    points = piece.at(t)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    direction = tangent(piece, t)
    turning = np.abs(angles(direction[:-1], direction[1:]))
    need = np.maximum(steps / size, 0.0 if is_straight(piece) else turning / TURN)
    total = np.concatenate([[0.0], np.cumsum(need + 1e-9 * need.sum())])
    n = max(1, int(np.ceil(total[-1] * (1.0 - 1e-6))))
    inner = np.interp(np.arange(1, n) * total[-1] / n, total, t)
    return np.concatenate([[0.0], inner, [1.0]])


def crossing(piece: Piece, start: np.ndarray, end: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Parameters (n,) where the piece lies above ``share`` (n,) [-] of its chord from ``start`` to ``end`` (n,)."""
    if isinstance(piece, Bezier) and len(piece.control) == 2:
        return start + share * (end - start)
    a, b = piece.at(start), piece.at(end)
    chord = b - a
    wanted = a + share[:, None] * chord
    low, high, t, moved = start.copy(), end.copy(), start + share * (end - start), end - start
    for _ in range(HALVINGS):  # Newton; bisection where the step leaves the bracket or does not shrink
        ahead = ((piece.at(t) - wanted) * chord).sum(axis=1)
        low, high = np.where(ahead < 0.0, t, low), np.where(ahead < 0.0, high, t)
        with np.errstate(divide="ignore", invalid="ignore"):
            better = t - ahead / (piece.at(t, 1) * chord).sum(axis=1)
        good = (better >= low) & (better <= high) & (np.abs(better - t) <= 0.5 * moved)
        better = np.where(good, better, 0.5 * (low + high))
        moved, t = np.abs(better - t), better
        if moved.max(initial=0.0) <= 1e-15:  # rounding
            break
    return t


def polyline(loop: Loop, size: float) -> np.ndarray:
    """Points (n, 2) along a loop, at most ``size`` [m] apart; the first point is not repeated at the end."""
    return np.concatenate([piece.at(divide(piece, size)[:-1]) for piece in loop])


def signed_area(points: np.ndarray) -> float:
    """Area [m^2] of a closed polygon (n, 2), positive if anticlockwise."""
    shifted = points - points[0]
    return 0.5 * float(cross_product(shifted, np.roll(shifted, -1, axis=0)).sum())


@dataclass(frozen=True, eq=False)
class Outline:
    """One outer loop and any number of holes; the body lies on the left of every loop."""

    outer: Loop
    holes: tuple[Loop, ...] = ()

    @classmethod
    def around(cls, outer: Loop, holes: tuple[Loop, ...] = ()) -> "Outline":
        """An outline from loops of any orientation."""
        size, turned = extent(outer) / 20.0, []
        for loop in (outer, *holes):
            forward = (signed_area(polyline(loop, size)) > 0.0) == (loop is outer)
            turned.append(loop if forward else tuple(piece.reversed() for piece in reversed(loop)))
        return cls(turned[0], tuple(turned[1:]))

    @property
    def loops(self) -> tuple[Loop, ...]:
        return (self.outer, *self.holes)


def extent(loop: Loop) -> float:
    """The longer side [m] of the bounding box of a loop."""
    return float(max(np.ptp(np.concatenate([piece.at(np.linspace(0, 1, 33)) for piece in loop]), axis=0)))


def refuse_millimetres(name: str, *sides: float) -> None:
    """Raise ValueError if a drawing or mesh with sides [m], whose unit nobody stated, is too large to be in metres."""
    if max(sides) > LARGEST:
        raise ValueError(
            f"{name} extends over {' x '.join(f'{side:g}' for side in sides)} m, which looks like millimetres read as "
            "metres; pass unit='mm' to load it, or unit='m' if it is that large"
        )


def ring(name: str, given: Any, what: str, most: int = MOST_PIECES) -> np.ndarray:
    """Points (n, 2) [m] of a closed polygon, checked; the first is not repeated at the end."""
    points = check.array(name, given, (None, 2), "m")
    if len(points) > 1 and np.array_equal(points[0], points[-1]):
        points = points[:-1]
    if not 3 <= len(points) <= most:
        raise ValueError(f"{name} must have 3 to {most} {what}, got {len(points)}")
    return points


def straight_loop(name: str, corners: Any, label: str) -> Loop:
    """Closed polygon through corners (n, 2) [m]; in ``label``, ``{}`` becomes the number of the side's first corner."""
    points = ring(name, corners, "corners")
    after = np.roll(points, -1, axis=0)
    gap = np.linalg.norm(after - points, axis=1)
    if gap.min() <= 1e-12 * gap.max():
        i = int(gap.argmin())
        raise ValueError(f"{name} has corners {i} and {(i + 1) % len(points)} at the same place; remove one")
    return tuple(segment(a, b, label.format(i)) for i, (a, b) in enumerate(zip(points, after)))


def why_crossed(outline: Outline) -> str:
    """Why an outline cannot be meshed, as an error text; an empty string if it can."""
    size = extent(outline.outer) / 30.0
    outer = shapely.Polygon(polyline(outline.outer, size))
    if not outer.is_valid:
        return f"outline must not cross or touch itself: {shapely.is_valid_reason(outer)}"
    holes: list[shapely.Polygon] = []
    for i, loop in enumerate(outline.holes):
        hole = shapely.Polygon(polyline(loop, min(size, extent(loop) / 8.0)))
        if not hole.is_valid:
            return f"holes[{i}] must not cross or touch itself: {shapely.is_valid_reason(hole)}"
        if not outer.contains_properly(hole):
            return f"holes[{i}] must lie inside the outline and not touch it"
        for j, other in enumerate(holes):
            if hole.intersects(other):
                return f"holes[{i}] must not overlap or touch holes[{j}]"
        holes.append(hole)
    whole = outer.difference(shapely.union_all(holes)) if holes else outer
    low, high = np.reshape(whole.bounds, (2, 2))
    whole = shapely.transform(whole, lambda points: points - low)  # far away, rounding would look like strips
    span = max(high - low)
    if whole.area * SLENDER < span**2:  # far too slender to fill with triangles
        return "outline must not be a thousand times longer than wide; widen it"
    for k in range(1, math.ceil(-math.log(SAME, 4.0)) + 1):  # down to rounding
        width = span * 4.0**-k
        if SLENDER * width**2 >= whole.area:  # no room for so long a strip; the test would be slow
            continue
        body = whole.simplify(0.05 * width)  # finer detail does not matter at this width
        rest = body.difference(body.buffer(-width, quad_segs=1).buffer(1.001 * width, quad_segs=2))
        if rest.area > SLENDER * width**2:  # a strip SLENDER / 2 half widths long
            place = max(getattr(rest, "geoms", [rest]), key=lambda part: part.area).representative_point().coords[0]
            x, y = place + low
            return f"outline must not be a thousand times longer than wide near ({x:g}, {y:g}) m; widen it there"
    return ""
