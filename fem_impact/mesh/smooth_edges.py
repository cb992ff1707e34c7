"""Fit tangents and curvatures to a rim known only by its points, as in a mesh file."""

import numpy as np

from .facets import angles, cross_product, slopes_and_bends

# [rad] a vertex where the rim turns by more is a corner: ten facets of a circle turn by 36 degrees each
CORNER = np.radians(35.0)
STRAIGHT = 1e-6  # [rad] a smaller turn is rounding: the rim is straight there
# [-] a turn is part of a curve if a neighbour turns the same way, by 1 / ALIKE as much: facets differ in length
ALIKE = 4.0
ROUND = 2e-6  # [-] points closer to a circle than this fraction of its radius lie on it: files write six digits
# [rad] a curve meets its neighbour smoothly if their tangents differ by less, some 3 degrees, as fits leave
JOINT = 0.05
ARM = 2  # [-] points used on each side of a vertex to fit curves other than circles: a quartic through five, order 4


def recover_rim(
    points: np.ndarray, loops: list[np.ndarray], given: dict[int, np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Recover the curve that a rim was drawn with.

    Returns of each facet the middle (n_facets, 2) [m], and at both ends the unit tangents (n_facets, 2, 2) and the
    curvatures (n_facets, 2) [1/m].

    Parameters
    ----------
    points : ndarray, shape (n_points, 2) [m]
    loops : list of ndarray, shape (n, 2)
        Facets of each closed loop in order, body on the left; facet numbers run on from loop to loop.
    given : dict, facet number -> its middle (2,) [m], where the file has quadratic triangles
    """
    n = sum(len(loop) for loop in loops)
    middles, tangents, curvatures = np.zeros((n, 2)), np.zeros((n, 2, 2)), np.zeros((n, 2))
    start = 0
    for loop in loops:
        numbers = np.arange(start, start + len(loop))
        start += len(loop)
        corner = _corners(points[loop[:, 0]])
        for run, closed in _runs(corner):
            facets = numbers[run]
            place = points[np.append(loop[run, 0], loop[run[-1], 1])]
            known = np.array([given[f] for f in facets]) if all(f in given for f in facets) else None
            middles[facets], tangents[facets], curvatures[facets] = _fit(place, closed, known)
        join_smoothly(np.column_stack([np.roll(numbers, 1), numbers]), tangents, curvatures)
    return middles, tangents, curvatures


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


Run = tuple[np.ndarray, np.ndarray, np.ndarray, tuple[np.ndarray, float] | None]


def smooth_runs(place: np.ndarray) -> list[Run]:
    """Split a closed loop of points (n, 2) at its corners into smooth runs.

    Returns
    -------
    list of (points (m + 1, 2), tangents (m, 2, 2), curvatures (m, 2), circle); circle is None or (centre, radius)
    """
    runs = []
    for run, closed in _runs(_corners(place)):
        points = place[np.append(run, (run[-1] + 1) % len(place))]
        _, tangents, curvatures = _fit(points, closed, None)
        circle = None
        if curvatures.any():
            origin, radius = _circle(points)
            if np.abs(np.linalg.norm(points - origin, axis=1) - radius).max() < ROUND * radius:
                circle = origin, radius
        runs.append((points, tangents, curvatures, circle))
    return runs


def _corners(place: np.ndarray) -> np.ndarray:
    """Which vertices of a closed loop are corners, or where a straight side runs into a curve, (n,) bool."""
    ahead = np.roll(place, -1, axis=0) - place
    turn = angles(np.roll(ahead, 1, axis=0), ahead)
    sharp = np.abs(turn) > CORNER
    company = np.zeros(len(turn), bool)
    for step in (1, -1):
        other = np.roll(turn, step)
        company |= (np.sign(other) == np.sign(turn)) & (np.abs(other) >= np.abs(turn) / ALIKE) & ~np.roll(sharp, step)
    still = np.abs(turn) <= STRAIGHT
    # the rim turns on one side of a joint only, and at the joint itself by half as much as along the curve
    beside = np.maximum(np.abs(np.roll(turn, 1)), np.abs(np.roll(turn, -1)))
    joint = (np.roll(still, 1) ^ np.roll(still, -1)) & (np.abs(turn) < 0.75 * beside)
    return sharp | (~still & (~company | joint))


def _runs(corner: np.ndarray) -> list[tuple[np.ndarray, bool]]:
    """Facets between corners, in order, and whether the run is closed: a loop without corners is one closed run."""
    n = len(corner)
    at = np.flatnonzero(corner)
    if not at.size:
        return [(np.arange(n), True)]
    stops = np.append(at[1:], at[0] + n)
    return [(np.arange(a, b) % n, False) for a, b in zip(at, stops)]


def _fit(place: np.ndarray, closed: bool, known: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middles (n, 2), tangents (n, 2, 2) and curvatures (n, 2) of a smooth curve through points (n + 1, 2)."""
    chord = np.diff(place, axis=0)
    length = np.linalg.norm(chord, axis=1)
    unit = chord / length[:, None]
    centre = 0.5 * (place[1:] + place[:-1])
    bulge = 0.0 if known is None else np.linalg.norm(known - centre, axis=1).max() / length.min()
    bent = np.abs(cross_product(unit[:-1], unit[1:])).max(initial=0.0) > STRAIGHT
    if (not bent and bulge < STRAIGHT) or (known is None and len(chord) < 3):
        return centre, np.stack([unit, unit], axis=1), np.zeros((len(chord), 2))
    on_it = place if known is None else np.concatenate([place, known])
    origin, radius = _circle(on_it)
    if np.abs(np.linalg.norm(on_it - origin, axis=1) - radius).max() < ROUND * radius:
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


def _circle(place: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre (2,) and radius of the least-squares circle through points (n, 2)."""
    middle = place.mean(axis=0)
    local = place - middle
    scale = np.abs(local).max()
    local = local / scale
    rows = np.column_stack([2.0 * local, np.ones(len(local))])
    solution = np.linalg.lstsq(rows, (local**2).sum(axis=1), rcond=None)[0]
    return middle + scale * solution[:2], float(scale * np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 0.0)))


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
