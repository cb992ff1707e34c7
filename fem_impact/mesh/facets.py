"""Curved boundary facets, written as a height above the chord."""

from math import comb, perm
from typing import Any

import numpy as np

from .._base.rounding import SAME

# [-] iterations to find a point of a curved facet; each gains a digit or two
CURVE_STEPS = 12


def angles(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Turn [rad] from directions (n, 2) to others, positive to the left."""
    return np.arctan2(cross_product(before, after), (before * after).sum(axis=1))


def cross_product(one: np.ndarray, two: np.ndarray) -> Any:
    """Cross product (...) of vectors (..., 2) in the plane, positive where the second points to the left."""
    return one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]


def is_curved(ends: np.ndarray, middles: np.ndarray) -> np.ndarray:
    """Which facets are curved, (n,) bool, from their ends (n, 2, 2) and middles (n, 2)."""
    chord = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return np.linalg.norm(middles - ends.mean(axis=1), axis=1) > SAME * chord


def powers(x: np.ndarray, highest: int, order: int) -> np.ndarray:
    """The ``order``-th derivative of x**0 ... x**highest, (..., highest + 1)."""
    result = np.zeros((*x.shape, highest + 1))
    for k in range(order, highest + 1):
        result[..., k] = perm(k, order) * x ** (k - order)
    return result


def slopes_and_bends(
    along: np.ndarray, out: np.ndarray, length: np.ndarray, tangents: np.ndarray, curvatures: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivatives (n, 2) [m] of the heights over chords, by the share of these, at both ends."""
    lean = np.einsum("nei,ni->ne", tangents, out) / np.einsum("nei,ni->ne", tangents, along)
    return lean * length[:, None], -curvatures * (1.0 + lean**2) ** 1.5 * length[:, None] ** 2


class Curves:
    """The curved facets of a mesh, each given by its height above the chord.

    The height is s (1 - s) p(s) [m] with s from 0 to 1 along the chord. The quartic p matches tangent and curvature at
    both ends and the given middle point. Inside a triangle, p times the product of the two area coordinates of the
    ends bends the triangle to follow its facet.
    """

    def __init__(self, ends: np.ndarray, middles: np.ndarray, tangents: np.ndarray, curvatures: np.ndarray) -> None:
        chord = ends[:, 1] - ends[:, 0]  # (n, 2)
        self.length: np.ndarray = np.linalg.norm(chord, axis=1)
        self.along: np.ndarray = chord / self.length[:, None]
        self.out: np.ndarray = np.column_stack([self.along[:, 1], -self.along[:, 0]])
        self.centre: np.ndarray = ends.mean(axis=1)
        slope, bend = slopes_and_bends(self.along, self.out, self.length, tangents, curvatures)
        height = ((middles - self.centre) * self.out).sum(axis=1)
        start, stop = slope[:, 0], -slope[:, 1]  # p(0), p(1)
        values = np.column_stack([start, stop, 0.5 * bend[:, 0] + start, -0.5 * bend[:, 1] - stop, 4.0 * height])
        k = np.arange(5.0)
        conditions = np.array([k == 0, np.ones(5), k == 1, k, 0.5**k], float)
        self.p: np.ndarray = np.linalg.solve(conditions, values.T).T  # (n, 5) ascending powers of s

    def middle(self) -> tuple[np.ndarray, np.ndarray]:
        """Middle point (n, 2) of each curve and the outward unit normal (n, 2) there."""
        point, tangent, _ = self.at(np.full(len(self.p), 0.5))
        return point, np.column_stack([tangent[:, 1], -tangent[:, 0]])

    def point(self, share: np.ndarray) -> np.ndarray:
        """Points (n, 2) at chord parameters s = ``share`` (n,)."""
        s = np.asarray(share, float)[:, None]
        return self._above(s, (self.p[:, None] * powers(s, 4, 0)).sum(axis=2))

    def _above(self, s: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Points (n, 2) at s (n, 1), with the values p(s) (n, 1)."""
        return self.centre + (s - 0.5) * self.length[:, None] * self.along + s * (1.0 - s) * p * self.out

    def at(self, share: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points (n, 2), unit tangents (n, 2) and curvatures (n,) at chord parameters s = ``share`` (n,)."""
        s = np.asarray(share, float)[:, None]
        p, dp, d2p = ((self.p[:, None] * powers(s, 4, k)).sum(axis=2) for k in range(3))
        bump, slope = s * (1.0 - s), 1.0 - 2.0 * s
        length = self.length[:, None]
        lean = (slope * p + bump * dp) / length
        second = (-2.0 * p + 2.0 * slope * dp + bump * d2p) / length**2
        stretch = np.hypot(1.0, lean)
        return self._above(s, p), (self.along + lean * self.out) / stretch, (-second / stretch**3)[:, 0]

    def controls(self) -> np.ndarray:
        """Control points (n, 7, 2) of the curves as Bezier pieces of degree six."""
        a, b, chord = self.p, np.zeros((len(self.p), 1)), self.along * self.length[:, None]
        rise = np.concatenate([b, a, b], axis=1) - np.concatenate([b, b, a], axis=1)  # s (1 - s) p, ascending powers
        power = rise[:, :, None] * self.out[:, None]  # (n, 7, 2)
        power[:, 0] += self.centre - 0.5 * chord
        power[:, 1] += chord
        k = range(7)
        choices = np.array([[comb(i, j) for j in k] for i in k])
        return np.einsum("ik,nkd->nid", choices / choices[6], power)

    def halfway(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Point (n, 2) of each part from s = ``low`` to ``high`` that lies equally far from both ends of the part."""
        a, b = self.point(low), self.point(high)
        chord = b - a
        share = 0.5 * (low + high)
        for _ in range(CURVE_STEPS):
            short = ((self.point(share) - 0.5 * (a + b)) * chord).sum(axis=1) / (chord**2).sum(axis=1)
            share = share - (high - low) * short
        return self.point(share)


def divide_facets(
    ends: np.ndarray, middles: np.ndarray, tangents: np.ndarray, curvatures: np.ndarray, share: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Cut facets in two at the chord parameter s = ``share``.

    Returns
    -------
    point, tangent, curvature : ndarray, shapes (n, 2), (n, 2), (n,), at the cut
    first, second : ndarray, shape (n, 2), middle points of the two parts
    """
    straight, zero = ~is_curved(ends, middles), np.zeros(len(ends))
    plain = ends[:, 0] + share * (ends[:, 1] - ends[:, 0])
    if straight.all():
        return plain, tangents[:, 0], zero, 0.5 * (ends[:, 0] + plain), 0.5 * (plain + ends[:, 1])
    curves = Curves(ends, middles, tangents, curvatures)
    cut = np.full(len(ends), share)
    point, tangent, curvature = curves.at(cut)
    first, second = curves.halfway(zero, cut), curves.halfway(cut, zero + 1.0)
    tangent, curvature = np.where(straight[:, None], tangents[:, 0], tangent), np.where(straight, 0.0, curvature)
    point = np.where(straight[:, None], plain, point)
    first = np.where(straight[:, None], 0.5 * (ends[:, 0] + point), first)
    second = np.where(straight[:, None], 0.5 * (point + ends[:, 1]), second)
    return point, tangent, curvature, first, second
