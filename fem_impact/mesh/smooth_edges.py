"""Fit tangents and curvatures to a rim known only by its points, as in a mesh file."""

import warnings
from typing import NamedTuple

import numpy as np
import shapely

from .._base.rounding import SAME, rounded_by
from .facets import angles, cross_product, slopes_and_bends
from .loops import SAMPLES

# [rad] a vertex where the rim turns by more is a corner: ten facets of a circle turn by 36 degrees each
CORNER = np.radians(35.0)
STRAIGHT = 1e-6  # [rad] a smaller turn is rounding: the rim is straight there
# [-] a turn is part of a curve if a neighbour turns the same way, by 1 / ALIKE as much: facets differ in length
ALIKE = 4.0
ROUND = 2e-6  # [-] points closer to a circle than this fraction of its radius lie on it: files write six digits
# [rad] a curve meets its neighbour smoothly if their tangents differ by less, some 3 degrees, as fits leave
JOINT = 0.05
DENSE = 64  # [-] a curve through more points is a spline, of as few pieces as follow them: 26 facets make a circle
SCATTER = 2e-3  # [-] points further than this fraction of the extent from smooth curves are no noise, but what is meant
ALTERNATING = 0.05  # [-] with a larger share of turns in other directions than the ones before, points scatter
ARM = 2  # [-] points used on each side of a vertex to fit curves other than circles: a quartic through five, order 4


class Blur(NamedTuple):
    """How well the points of a rim are known."""

    noise: float  # [m] standard deviation across cubics through seven neighbours; 0 for few points
    scattered: bool  # if that is scatter, as of traced points
    off: float  # [m] how far a single point may lie beside the rim
    written: float  # [m] the same by the digits of its coordinates alone


def recover_rim(
    points: np.ndarray, loops: list[np.ndarray], given: dict[int, np.ndarray], written: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Recover the curve that a rim was drawn with.

    Returns the points, those beside straight sides moved onto them, and of each facet the middle (n_facets, 2) [m],
    and at both ends the unit tangents (n_facets, 2, 2) and the curvatures (n_facets, 2) [1/m].

    Parameters
    ----------
    points : ndarray, shape (n_points, 2) [m]
    loops : list of ndarray, shape (n, 2)
        Facets of each closed loop in order, body on the left; facet numbers run on from loop to loop.
    given : dict, facet number -> its middle (2,) [m], where the file has quadratic triangles
    written : float [m]
        How far points may lie beside the rim by the digits of their coordinates.
    """
    points, n = points.copy(), sum(len(loop) for loop in loops)
    middles, tangents, curvatures = np.zeros((n, 2)), np.zeros((n, 2, 2)), np.zeros((n, 2))
    start = 0
    for loop in loops:
        numbers = np.arange(start, start + len(loop))
        start += len(loop)
        rim = points[loop[:, 0]]
        off = _blur(rim, written).off
        for run, closed in _runs(_corners(rim, off)):
            facets, ends = numbers[run], np.append(loop[run, 0], loop[run[-1], 1])
            known = np.array([given[f] for f in facets]) if all(f in given for f in facets) else None
            place = points[ends]
            if not closed and _lie_on_a_line(place if known is None else np.concatenate([place, known]), off):
                along = (place[-1] - place[0]) / np.linalg.norm(place[-1] - place[0])
                points[ends[1:-1]] = place[0] + ((place[1:-1] - place[0]) @ along)[:, None] * along
                known = None
            middles[facets], tangents[facets], curvatures[facets] = _fit(points[ends], closed, known, off)
        join_smoothly(np.column_stack([np.roll(numbers, 1), numbers]), tangents, curvatures)
    return points, middles, tangents, curvatures


def join_smoothly(pairs: np.ndarray, tangents: np.ndarray, curvatures: np.ndarray) -> None:
    """Give both facets at a vertex the same tangent where a curve meets its neighbour smoothly; works in place.

    ``pairs`` (n, 2) holds the facets before and after each vertex.
    """
    a, b = tangents[pairs[:, 0], 1], tangents[pairs[:, 1], 0]
    angle = np.abs(angles(a, b))
    bent = curvatures[pairs].any(axis=(1, 2))
    near = (angle > 0.0) & (angle < JOINT) & bent
    mean = (a + b)[near] / np.linalg.norm((a + b)[near], axis=1)[:, None]
    tangents[pairs[near, 0], 1] = mean
    tangents[pairs[near, 1], 0] = mean


def n_gentle_corners(place: np.ndarray) -> int:
    """How many corners in a row of a closed polygon (n, 2) [m] turn as the points of a curve do."""
    bent = place[np.abs(_turns(place)) > STRAIGHT]
    return max(len(run) - (not closed) for run, closed in _runs(_corners(bent)))


Run = tuple[np.ndarray, np.ndarray, tuple[np.ndarray, float] | None]


def smooth_runs(place: np.ndarray, closed: bool = True) -> tuple[list[Run], float]:
    """Split a closed loop, or a line, of points (n, 2) [m] at its corners into smooth runs.

    Returns
    -------
    runs : list of (points (m + 1, 2) [m], controls (n_pieces, degree + 1, 2) [m] of Bezier pieces, circle)
        circle is None or (centre, radius).
    scatter : float [m]
        Standard deviation of points that scatter about the runs; zero if the runs pass through the points.
    """
    around = place if closed else np.concatenate([place, place[-2:0:-1]])  # there and back
    # few points may have been turned after they were written with five digits
    few = 25.0 * ROUND * float(np.ptp(place, axis=0).max()) * (len(place) <= DENSE)
    blur = _blur(around, 3.0 * rounded_by(place), few)
    place, fixed = _with_points_along(place, closed, blur)
    around = place if closed else np.concatenate([place, place[-2:0:-1]])
    corner = _corners_in_noise(around, blur.noise) if blur.scattered else _corners(around, blur.off)
    corner[: len(place)] |= fixed
    if not closed:
        corner[[0, len(place) - 1]] = True
        corner[len(place) :] = False
    runs = _runs(corner) if closed else _runs(corner)[:-1]
    fitted: list[Run] = []
    for run, whole in runs:
        points = around[np.append(run, (run[-1] + 1) % len(around))]
        fitted.append((points, *_pieces(points, whole, blur)))
    return fitted, blur.noise * blur.scattered


def _lie_on_a_line(points: np.ndarray, off: float) -> bool:
    """Whether all points (n, 2) [m] lie within ``off`` [m] of a line."""
    normal = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][1]
    return bool(np.abs((points - points.mean(axis=0)) @ normal).max() <= max(off, SAME * np.ptp(points)))


def _with_points_along(place: np.ndarray, closed: bool, blur: Blur) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) of a loop, or a line, with more along long sides that are straight, and whether these end there.

    A curve would turn at the end of a long side by more than between two short ones; where a straight side runs into
    it, it turns by half of that, but for what points that are off change. Where points scatter, any side much longer
    than both beside it is straight.
    """
    length, turn = np.linalg.norm(np.roll(place, -1, axis=0) - place, axis=1), np.abs(_turns(place))
    before, after = np.roll(length, 1), np.roll(length, -1)
    straight = (length > ALIKE * np.maximum(before, after)) & blur.scattered
    for step, beside, end in ((1, before, turn), (-1, after, np.roll(turn, -1))):
        per_side = np.roll(end, step) * 2.0 * beside / (beside + np.roll(beside, step))
        straight |= (length > (ALIKE if blur.scattered else 1.5) * beside) & (end < 0.65 * per_side + blur.off / beside)
    straight[-1] &= closed
    straight &= length > 20.0 * blur.noise * blur.scattered
    parts = np.where(straight, np.minimum(np.ceil(length / np.minimum(before, after)), SAMPLES), 1.0).astype(int)
    share = np.concatenate([np.arange(n) / n for n in parts])[:, None]
    start, end = (np.repeat(each, parts, axis=0) for each in (place, np.roll(place, -1, axis=0)))
    bent = turn > _turns_by_rounding(place, 0.0 if blur.scattered else blur.off)
    ends = np.repeat((straight | np.roll(straight, 1)) & bent, parts) & (share[:, 0] == 0.0)
    return start * (1.0 - share) + end * share, ends


def _blur(place: np.ndarray, written: float, few: float = 0.0) -> Blur:
    """How well points (n, 2) of a loop are known, each ``written`` to [m], or to ``few`` if they are few."""
    n, off = len(place), max(written, few)
    if n <= DENSE:
        return Blur(0.0, False, off, written)
    seven = (np.arange(n)[:, None] + np.arange(-3, 4)) % n
    near = place[seven]  # (n, 7, 2)
    steps = np.linalg.norm(np.diff(near, axis=1), axis=2)
    along = np.cumsum(np.pad(steps, ((0, 0), (1, 0))), axis=1)
    base, _ = np.linalg.qr((along / along[:, -1:] - 0.5)[..., None] ** np.arange(4))
    local = near - near[:, 3:4]
    chord = near[:, -1] - near[:, 0]
    chord = chord / np.maximum(np.linalg.norm(chord, axis=1), 1e-3 * along[:, -1])[:, None]
    across = cross_product(chord[:, None], local - base @ (base.swapaxes(1, 2) @ local))
    squares, extent = (across**2).sum(axis=1), float(np.ptp(place, axis=0).max())
    turn = _turns(place)
    least = np.minimum(np.abs(turn), np.abs(np.roll(turn, 1)))
    other = (turn * np.roll(turn, 1) < 0.0) & (least > STRAIGHT)
    alternate = bool(np.count_nonzero(other) > ALTERNATING * n)
    if alternate:  # scatter shows where no corner is near, nor a curve of few points
        small = np.abs(turn) < 4.0 * np.median(np.abs(turn[other]))
        smooth = small[seven].all(axis=1)
        squares = squares[smooth & (squares > (SAME * extent) ** 2)]  # sides along rows of pixels are straight
        alternate = squares.size > 0
    # the median of chi-square of three: corners count little
    noise = float(np.sqrt(np.median(squares) / 2.366)) if squares.size else 0.0
    still = np.abs(turn) <= _turns_by_rounding(place, off)
    lost = max(abs(turn[run[1:]].sum()) for run, _ in _runs(~still))  # of what rounding may hide, in a row
    scattered = alternate and noise < SCATTER * extent and (noise > off or lost > JOINT)
    return Blur(noise, scattered, max(off, 5.0 * noise * scattered), written)


def _corners_in_noise(place: np.ndarray, noise: float) -> np.ndarray:
    """Which points (n, 2) [m] of a closed loop, which scatter by ``noise`` [m], are corners, (n,) bool."""
    first = int(np.linalg.norm(place - place.mean(axis=0), axis=1).argmax())  # the simplified loop keeps it
    turned = np.roll(place, -first, axis=0)
    line = shapely.LineString(np.concatenate([turned, turned[:1]])).simplify(5.0 * noise, preserve_topology=False)
    simple = shapely.get_coordinates(line)[:-1]
    lengths = np.linalg.norm(np.roll(simple, -1, axis=0) - simple, axis=1)
    total, reach = lengths.sum(), 20.0 * noise
    at = np.cumsum(lengths) - lengths
    behind, ahead = (
        shapely.get_coordinates(shapely.line_interpolate_point(line, (at + side * reach) % total)) for side in (-1, 1)
    )
    wide = np.abs(angles(simple - behind, ahead - simple))
    apart = np.abs((at[:, None] - at + 0.5 * total) % total - 0.5 * total)
    sharp = (wide > CORNER) & (wide >= np.where(apart < reach, wide, 0.0).max(axis=1))
    lone = _corners(simple) & (np.abs(_turns(simple)) > _turns_by_rounding(simple, 10.0 * noise))
    return np.isin(place @ [1.0, 1j], simple[sharp | lone] @ [1.0, 1j])


def _pieces(points: np.ndarray, closed: bool, blur: Blur) -> tuple[np.ndarray, tuple[np.ndarray, float] | None]:
    """Controls of the Bezier pieces of a run (n + 1, 2) [m] of points, and its circle if it is one."""
    if not closed and _lie_on_a_line(points, blur.off):
        return points[[0, -1]][None], None
    turn = _turns(points)[1:-1]
    origin, radius, away = _circle(points)
    straight = np.abs(turn).max(initial=0.0) <= STRAIGHT or len(points) < 4
    if not straight and away < max(ROUND * radius, blur.off if closed and blur.scattered else blur.written):
        return points[:, None], (origin, radius)
    if not straight and len(points) > (12 if blur.scattered else DENSE):
        return _spline(points, closed, blur.noise), None
    if straight or blur.scattered:
        return np.stack([points[:-1], points[1:]], axis=1), None
    _, tangents, curvatures = _fit(points, closed, None, blur.written)
    ahead = np.linalg.norm(np.diff(points, axis=0), axis=1)[:, None, None] / 5.0 * tangents  # (n, 2, 2)
    bend = np.stack([-ahead[..., 1], ahead[..., 0]], axis=-1) * np.linalg.norm(ahead, axis=2, keepdims=True)
    bend *= 1.25 * curvatures[..., None]
    a, b, before, after = points[:-1], points[1:], ahead[:, 0], ahead[:, 1]
    return np.stack([a, a + before, a + 2.0 * before + bend[:, 0], b - 2.0 * after + bend[:, 1], b - after, b], 1), None


def _spline(points: np.ndarray, closed: bool, noise: float) -> np.ndarray:
    """Controls (n_pieces, 6, 2) [m] of a spline between points (n + 1, 2) [m] that scatter by ``noise`` [m]."""
    from scipy.interpolate import BSpline, splprep  # imported only when needed: the process that reads needs none

    n = len(points) - 1
    arm = int(5.0 * noise / np.median(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    low, high = np.arange(n) - arm, np.arange(n) + 1 + arm  # over so many, noise makes no way longer
    if not closed:
        low, high = np.maximum(low, 0), np.minimum(high, n)
    ways = np.linalg.norm(points[high % n if closed else high] - points[low % n if closed else low], axis=1)
    along = np.concatenate([[0.0], np.cumsum(np.maximum(ways / (high - low), SAME * np.ptp(points)))])
    weights = np.ones(n + 1)
    weights[[0, -1]] = 1.0 if closed else 1e3
    goal = 2.2 * n * max(noise, 1e-8 * float(np.ptp(points, axis=0).max())) ** 2  # 1.1 for few knots
    local, along = (points - points[0]).T, along / along[-1]
    with warnings.catch_warnings():  # where rounding keeps a spline further from the points than asked
        warnings.simplefilter("ignore", RuntimeWarning)
        (knots, values, _), _ = splprep(local, w=weights, u=along, k=5, s=goal, per=closed, quiet=1)
    edges = np.unique(knots[5:-5])
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 6))
    places = BSpline(knots, np.transpose(values), 5)(edges[:-1, None] + np.diff(edges)[:, None] * share)
    powers = share[:, None] ** np.arange(6) * (1.0 - share[:, None]) ** np.arange(5, -1, -1)
    controls = points[0] + np.linalg.solve(powers * [1.0, 5.0, 10.0, 10.0, 5.0, 1.0], places)
    controls[-1, -1] = controls[0, 0] if closed else points[-1]
    controls[0, 0] = controls[0, 0] if closed else points[0]
    return controls


def _turns(place: np.ndarray) -> np.ndarray:
    """Turn [rad] at each point (n, 2) of a closed loop, positive to the left."""
    ahead = np.roll(place, -1, axis=0) - place
    return angles(np.roll(ahead, 1, axis=0), ahead)


def _turns_by_rounding(place: np.ndarray, off: float) -> np.ndarray:
    """How far [rad] a closed loop turns at each of its points (n, 2) if they lie ``off`` [m] beside a straight side."""
    length = np.linalg.norm(np.roll(place, -1, axis=0) - place, axis=1)
    return np.maximum(STRAIGHT, off * (1.0 / length + 1.0 / np.roll(length, 1)))


def _corners(place: np.ndarray, off: float = 0.0) -> np.ndarray:
    """Which vertices of a closed loop are corners, or where a straight side runs into a curve, (n,) bool.

    Along a straight side, vertices may lie ``off`` [m].
    """
    turn = _turns(place)
    sharp = np.abs(turn) > CORNER
    company = np.zeros(len(turn), bool)
    for step in (1, -1):
        other = np.roll(turn, step)
        company |= (np.sign(other) == np.sign(turn)) & (np.abs(other) >= np.abs(turn) / ALIKE) & ~np.roll(sharp, step)
    still = np.abs(turn) <= _turns_by_rounding(place, off)
    # the rim turns on one side of a joint only, and at the joint itself by half as much as along the curve
    beside = np.maximum(np.abs(np.roll(turn, 1)), np.abs(np.roll(turn, -1)))
    joint = (np.roll(still, 1) ^ np.roll(still, -1)) & (np.abs(turn) < 0.75 * beside)
    return sharp | (~still & (~company | joint)) | _arc_ends(place, turn, off)


def _arc_ends(place: np.ndarray, turn: np.ndarray, off: float) -> np.ndarray:
    """Which points (n, 2) [m] of a closed loop, each ``off`` [m] at most, are ends of an arc of a circle, (n,) bool.

    An arc joins five points at least, as any three lie on a circle, and turns by more than `CORNER`.
    """
    ends, bent = np.zeros(len(place), bool), np.abs(turn) > _turns_by_rounding(place, off)
    a, b, c, d = (np.roll(place @ [1.0, 1j], k) for k in (1, 0, -1, -2))
    ab, bc, ac, bd, ad = (np.abs(one - two) for one, two in ((a, b), (b, c), (a, c), (b, d), (a, d)))
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = ab * bc * ac / (2.0 * np.abs(((b - a).conj() * (c - a)).imag))
        ratio = (a - c) * (b - d) / ((a - d) * (b - c))  # real if the four lie on a circle
        near = np.abs(ratio.imag / ratio) < (ROUND * radius + off) * (1.0 / ac + 1.0 / bd + 1.0 / ad + 1.0 / bc)
    for run, closed in _runs(~(near & bent & np.roll(bent, -1) & (turn * np.roll(turn, -1) > 0.0))):
        for first, last in ((-1, 2), (0, 2), (-1, 1), (0, 1)) if not closed and len(run) > 2 else ():
            arc = np.arange(run[1] + first, run[1] + len(run) - 2 + last + 1) % len(place)
            _, radius, away = _circle(place[arc])
            if len(arc) > 4 and np.abs(turn[arc[1:-1]].sum()) > CORNER and away < max(ROUND * radius, off):
                ends[arc[[0, -1]]] = True
                break
    return ends


def _runs(corner: np.ndarray) -> list[tuple[np.ndarray, bool]]:
    """Facets between corners, in order, and whether the run is closed: a loop without corners is one closed run."""
    n = len(corner)
    at = np.flatnonzero(corner)
    if not at.size:
        return [(np.arange(n), True)]
    stops = np.append(at[1:], at[0] + n)
    return [(np.arange(a, b) % n, False) for a, b in zip(at, stops)]


def _fit(
    place: np.ndarray, closed: bool, known: np.ndarray | None, off: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middles (n, 2), tangents (n, 2, 2) and curvatures (n, 2) of a smooth curve through points (n + 1, 2) [m].

    Points may lie ``off`` [m] beside it.
    """
    chord = np.diff(place, axis=0)
    length = np.linalg.norm(chord, axis=1)
    unit = chord / length[:, None]
    centre = 0.5 * (place[1:] + place[:-1])
    bulge = 0.0 if known is None else np.linalg.norm(known - centre, axis=1).max() / length.min()
    bent = np.abs(cross_product(unit[:-1], unit[1:])).max(initial=0.0) > STRAIGHT
    if (not bent and bulge < STRAIGHT) or (known is None and len(chord) < 3):
        return centre, np.stack([unit, unit], axis=1), np.zeros((len(chord), 2))
    origin, radius, away = _circle(place if known is None else np.concatenate([place, known]))
    if away < max(ROUND * radius, off):
        out = (place - origin) / np.linalg.norm(place - origin, axis=1)[:, None]
        left = np.sign(cross_product(out[0], out[1]))  # 1 if the rim turns left (convex), else -1
        tangent = left * np.column_stack([-out[:, 1], out[:, 0]])
        half = out[:-1] + out[1:]
        middles = origin + radius * half / np.linalg.norm(half, axis=1)[:, None]
        return middles, np.stack([tangent[:-1], tangent[1:]], axis=1), np.full((len(chord), 2), left / radius)
    if known is None:
        dense, step = place, 1
    else:
        dense, step = np.empty((2 * len(chord) + 1, 2)), 2
        dense[::2], dense[1::2] = place, known
    tangent, curvature = _polynomials(dense, closed)
    tangent, curvature = tangent[::step], curvature[::step]
    tangents = np.stack([tangent[:-1], tangent[1:]], axis=1)
    curvatures = np.stack([curvature[:-1], curvature[1:]], axis=1)
    if known is None:  # on the quintic that matches tangent and curvature at both ends
        out = np.column_stack([unit[:, 1], -unit[:, 0]])
        slope, bend = slopes_and_bends(unit, out, length, tangents, curvatures)
        # height s (1 - s) p(s) with p cubic, at s = 1/2
        ends = 0.5 * (slope[:, 0] - slope[:, 1])
        rates = (0.5 * bend[:, 0] + slope[:, 0]) - (-0.5 * bend[:, 1] + slope[:, 1])
        known = centre + (0.25 * (ends + rates / 8.0))[:, None] * out
    return known, tangents, curvatures


def _circle(place: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Centre (2,) and radius of the least-squares circle through points (n, 2), and how far they lie beside it."""
    middle = place.mean(axis=0)
    local = place - middle
    scale = np.abs(local).max()
    local = local / scale
    rows = np.column_stack([2.0 * local, np.ones(len(local))])
    solution = np.linalg.lstsq(rows, (local**2).sum(axis=1), rcond=None)[0]
    radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 0.0)))
    away = float(np.abs(np.linalg.norm(local - solution[:2], axis=1) - radius).max())
    return middle + scale * solution[:2], scale * radius, scale * away


def _polynomials(place: np.ndarray, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Unit tangents (n, 2) and curvatures (n,) at points (n, 2), each from a quartic through five neighbours."""
    n = len(place)
    distinct = n - 1 if closed else n
    width = min(2 * ARM + 1, distinct)
    tangent, curvature = np.zeros((n, 2)), np.zeros(n)
    for i in range(n):
        first = i - width // 2 if closed else min(max(i - width // 2, 0), n - width)
        index = np.arange(first, first + width)
        near = place[index % (n - 1)] if closed else place[index]
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(near, axis=0), axis=1))])
        along = (along - along[i - first]) / along[-1]
        powers = np.linalg.solve(np.vander(along, increasing=True), near - place[i])
        velocity, acceleration = powers[1], 2.0 * powers[2]
        speed = np.hypot(*velocity)
        tangent[i] = velocity / speed
        curvature[i] = cross_product(velocity, acceleration) / speed**3
    return tangent, curvature
