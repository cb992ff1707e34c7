"""The true curve around a plate: arcs and Bezier pieces joined to loops, each piece part of a named edge."""

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely

from . import _check

SLENDER = 1e4  # [-] area over square of the half width: the mesher is quick up to 4e3 and never ends from 4e4 on
FINEST = 16  # [-] widths looked at, each a quarter of the one before: down to rounding
TURN = 0.25  # [rad] most that an edge turns within one facet: 26 facets on a circle
MOST_PIECES = 2000  # [-] of an outline: several times what tracing programs write
HALVINGS = 60  # [-] at most: a parameter then is exact to the last digit
HERE = 1e-15  # [-] steps of a parameter that end the search
SAMPLES = 256  # [-] points per piece on which its length and turning are integrated


@dataclass(frozen=True, eq=False)
class Arc:
    """Piece of a circle or ellipse: centre + a cos(angle) + b sin(angle)."""

    centre: np.ndarray  # (2,) [m]
    a: np.ndarray  # (2,) [m]
    b: np.ndarray  # (2,) [m]
    start: float  # [rad]
    sweep: float  # [rad]
    name: str = ""

    def at(self, t: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Points (n, 2) at parameters (n,) between 0 and 1, or their derivative by the parameter."""
        angle = self.start + self.sweep * np.asarray(t)[..., None] + 0.5 * np.pi * derivative
        swept = self.sweep**derivative * (np.cos(angle) * self.a + np.sin(angle) * self.b)
        return swept + (self.centre if derivative == 0 else 0.0)

    def reversed(self) -> "Arc":
        """The same piece run backwards."""
        return replace(self, start=self.start + self.sweep, sweep=-self.sweep)

    def named(self, name: str) -> "Arc":
        """The same piece as part of a named edge."""
        return replace(self, name=name)

    def moved(self, matrix: np.ndarray, shift: np.ndarray) -> "Arc":
        """The piece after points are multiplied by a matrix (2, 2) and shifted."""
        return replace(self, centre=matrix @ self.centre + shift, a=matrix @ self.a, b=matrix @ self.b)


@dataclass(frozen=True, eq=False)
class Bezier:
    """Bezier piece of any degree; two control points make a straight line."""

    control: np.ndarray  # (n, 2) [m]
    name: str = ""

    def at(self, t: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Points (n, 2) at parameters (n,) between 0 and 1, or their derivative by the parameter."""
        control = self.control
        for _ in range(derivative):
            control = (len(control) - 1) * np.diff(control, axis=0)
            if not len(control):
                return np.zeros((*np.shape(t), 2))
        t, degree = np.asarray(t)[..., None], len(control) - 1
        k = np.arange(degree + 1)
        return np.array([math.comb(degree, int(i)) for i in k]) * t**k * (1.0 - t) ** (degree - k) @ control

    def reversed(self) -> "Bezier":
        """The same piece run backwards."""
        return replace(self, control=self.control[::-1].copy())

    def named(self, name: str) -> "Bezier":
        """The same piece as part of a named edge."""
        return replace(self, name=name)

    def moved(self, matrix: np.ndarray, shift: np.ndarray) -> "Bezier":
        """The piece after points are multiplied by a matrix (2, 2) and shifted."""
        return replace(self, control=self.control @ matrix.T + shift)


Piece = Arc | Bezier
Loop = tuple[Piece, ...]


def segment(start, end, name: str = "") -> Bezier:
    """Straight piece from start to end (2,) [m]."""
    return Bezier(np.array([start, end], float), name)


def circle(centre, radius: float, name: str = "") -> Loop:
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
    """Unit tangents (n, 2) at parameters (n,); where the speed vanishes at an end, the limit from inside."""
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
    cross = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return cross / np.maximum(speed, 1e-6 * fastest) ** 3


def divide(piece: Piece, size: float) -> np.ndarray:
    """Parameters (n + 1,) from 0 to 1 that cut a piece into facets no longer than a size [m] and turning little."""
    if isinstance(piece, Bezier) and len(piece.control) == 2:
        length = float(np.linalg.norm(piece.control[1] - piece.control[0]))
        return np.linspace(0.0, 1.0, max(1, math.ceil(length / size * (1.0 - 1e-6))) + 1)
    t = np.linspace(0.0, 1.0, SAMPLES + 1)
    points = piece.at(t)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    direction = tangent(piece, t)
    cross = direction[:-1, 0] * direction[1:, 1] - direction[:-1, 1] * direction[1:, 0]
    turning = np.abs(np.arctan2(cross, (direction[:-1] * direction[1:]).sum(axis=1)))
    need = np.maximum(steps / size, 0.0 if is_straight(piece) else turning / TURN)
    total = np.concatenate([[0.0], np.cumsum(need + 1e-9 * need.sum())])
    n = max(1, int(np.ceil(total[-1] * (1.0 - 1e-6))))
    inner = np.interp(np.arange(1, n) * total[-1] / n, total, t)
    return np.concatenate([[0.0], inner, [1.0]])


def crossing(piece: Piece, start: np.ndarray, end: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Parameters (n,) where the piece passes a share (n,) [-] of its chords between parameters start and end (n,)."""
    if isinstance(piece, Bezier) and len(piece.control) == 2:
        return start + share * (end - start)
    a, b = piece.at(start), piece.at(end)
    chord = b - a
    wanted = a + share[:, None] * chord
    low, high, t, moved = start.copy(), end.copy(), start + share * (end - start), end - start
    for _ in range(HALVINGS):  # Newton's steps, halved where they leave the bracket or do not shrink
        ahead = ((piece.at(t) - wanted) * chord).sum(axis=1)
        low, high = np.where(ahead < 0.0, t, low), np.where(ahead < 0.0, high, t)
        with np.errstate(divide="ignore", invalid="ignore"):
            better = t - ahead / (piece.at(t, 1) * chord).sum(axis=1)
        good = (better >= low) & (better <= high) & (np.abs(better - t) <= 0.5 * moved)
        better = np.where(good, better, 0.5 * (low + high))
        moved, t = np.abs(better - t), better
        if moved.max(initial=0.0) <= HERE:
            break
    return t


def polyline(loop: Loop, size: float) -> np.ndarray:
    """Points (n, 2) along a loop at most a size [m] apart, its start not repeated."""
    return np.concatenate([piece.at(divide(piece, size)[:-1]) for piece in loop])


def signed_area(points: np.ndarray) -> float:
    """Area [m^2] inside a closed polygon (n, 2), positive where it runs anticlockwise."""
    shifted = points - points[0]
    after = np.roll(shifted, -1, axis=0)
    return 0.5 * float((shifted[:, 0] * after[:, 1] - shifted[:, 1] * after[:, 0]).sum())


@dataclass(frozen=True, eq=False)
class Outline:
    """One outer loop and any number of holes; the body lies on the left of every loop."""

    outer: Loop
    holes: tuple[Loop, ...] = ()

    @classmethod
    def around(cls, outer: Loop, holes: tuple[Loop, ...] = ()) -> "Outline":
        """An outline from loops that run either way round."""
        span = extent(outer)
        return cls(_turned(outer, span, True), tuple(_turned(hole, span, False) for hole in holes))

    @property
    def loops(self) -> tuple[Loop, ...]:
        return (self.outer, *self.holes)


def extent(loop: Loop) -> float:
    """The longer side [m] of the box around a loop."""
    return float(max(np.ptp(np.concatenate([piece.at(np.linspace(0, 1, 33)) for piece in loop]), axis=0)))


def _turned(loop: Loop, span: float, anticlockwise: bool) -> Loop:
    if (signed_area(polyline(loop, span / 20.0)) > 0.0) == anticlockwise:
        return loop
    return tuple(piece.reversed() for piece in reversed(loop))


def straight_loop(name: str, corners, label: str) -> Loop:
    """Closed loop of straight pieces through corners (n, 2) [m]; piece i runs from corner i, ``{}`` in its label."""
    points = _check.array(name, corners, (None, 2), "m")
    if len(points) > 1 and np.array_equal(points[0], points[-1]):
        points = points[:-1]
    if not 3 <= len(points) <= MOST_PIECES:
        raise ValueError(f"{name} must have 3 to {MOST_PIECES} corners, got {len(points)}")
    after = np.roll(points, -1, axis=0)
    gap = np.linalg.norm(after - points, axis=1)
    if gap.min() <= 1e-12 * gap.max():
        i = int(gap.argmin())
        raise ValueError(f"{name} has corners {i} and {(i + 1) % len(points)} at the same place; leave one out")
    return tuple(segment(a, b, label.format(i)) for i, (a, b) in enumerate(zip(points, after)))


def crossed(outline: Outline) -> str:
    """What makes an outline no body: it crosses itself, or a hole leaves it; empty where all is well."""
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
    return _slender(outer.difference(shapely.union_all(holes)) if holes else outer)


def _slender(whole: shapely.Polygon) -> str:
    """Where a body is much longer than it is wide, as at a needle; triangles as small as that would be countless."""
    span = max(np.ptp(np.reshape(whole.bounds, (2, 2)), axis=0))
    if whole.area * SLENDER < span**2:
        return "outline must not be a thousand times longer than wide; widen it"
    for k in range(1, FINEST):
        width = span * 4.0**-k
        if SLENDER * width**2 >= whole.area:  # no strip of this half width can be that long, and looking would be slow
            continue
        body = whole.simplify(0.05 * width)  # what is finer does not matter at this width, and costs
        rest = body.difference(body.buffer(-width, quad_segs=1).buffer(1.001 * width, quad_segs=2))
        if rest.area > SLENDER * width**2:  # a strip of this half width and `SLENDER` / 2 times as long
            x, y = max(getattr(rest, "geoms", [rest]), key=lambda part: part.area).representative_point().coords[0]
            return f"outline must not be a thousand times longer than wide, as it is near ({x:g}, {y:g}) m; widen it"
    return ""
