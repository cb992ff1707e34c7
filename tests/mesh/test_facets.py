"""Curved facets against curves known in closed form."""

import numpy as np
from numpy.testing import assert_allclose

from fem_impact.mesh.facets import Curves, divide_facets


def arcs(radius, angle, start=0.3):
    """Facets of an arc: ends, middles, tangents and curvatures, for `Curves`; the body lies within."""
    ends = start + np.array([[0.0, angle]])
    points = radius * np.stack([np.cos(ends), np.sin(ends)], axis=2)
    middle = radius * np.array([[np.cos(start + 0.5 * angle), np.sin(start + 0.5 * angle)]])
    tangents = np.stack([-np.sin(ends), np.cos(ends)], axis=2)
    return points, middle, tangents, np.full((1, 2), 1.0 / radius)


def test_a_facet_follows_its_circle_with_order_eight():
    """Seven conditions leave the seventh derivative, which an arc lacks by its symmetry."""
    errors = []
    for angle in (0.8, 0.4):
        point, tangent, curvature = Curves(*arcs(2.0, angle)).at(np.linspace(0.0, 1.0, 41))
        radius = np.linalg.norm(point, axis=1)
        errors.append(np.abs(radius - 2.0).max())
        assert_allclose((point * tangent).sum(axis=1) / radius, 0.0, atol=1e-4)
        assert_allclose(curvature, 0.5, rtol=1e-2)
    assert 7.5 < np.log2(errors[0] / errors[1]) < 8.5
    assert errors[1] < 3e-8  # of a radius of 2, over 0.4 rad


def test_a_facet_is_the_curve_of_degree_six_that_it_was_taken_from():
    """Height s (1 - s) p(s) above a chord of 2 m, p a quartic: nothing is left to approximate."""
    p = np.polynomial.Polynomial([0.3, -0.2, 0.5, 0.1, -0.4])
    height = np.polynomial.Polynomial([0.0, 1.0, -1.0]) * p
    turn = np.array([[np.cos(0.9), np.sin(0.9)], [-np.sin(0.9), np.cos(0.9)]])  # rows: along the chord, to its left

    def placed(s):
        return np.column_stack([2.0 * s, -height(s)]) @ turn + [3.0, -1.0]  # the body lies on the left, outside right

    ends, slope, bend = np.array([0.0, 1.0]), 0.5 * height.deriv(1), 0.25 * height.deriv(2)
    stretch = np.hypot(1.0, slope(ends))
    tangents = np.column_stack([1.0 / stretch, -slope(ends) / stretch]) @ turn
    curvatures = -bend(ends) / stretch**3
    curves = Curves(placed(ends)[None], placed(np.array([0.5])), tangents[None], curvatures[None])
    s = np.linspace(0.0, 1.0, 9)
    point, along, curvature = (np.concatenate(x) for x in zip(*(curves.at(np.array([x])) for x in s)))
    assert_allclose(point, placed(s), atol=1e-14)
    assert_allclose(along @ turn[1], -slope(s) / np.hypot(1.0, slope(s)), atol=1e-13)
    assert_allclose(curvature, -bend(s) / np.hypot(1.0, slope(s)) ** 3, atol=1e-12)
    k, x = np.arange(7), s[:, None]
    bernstein = np.array([1, 6, 15, 20, 15, 6, 1]) * x**k * (1 - x) ** (6 - k)
    assert_allclose(bernstein @ curves.controls()[0], placed(s), atol=1e-14)
    assert_allclose(curves.middle()[0], placed(np.array([0.5])), atol=1e-15)
    assert_allclose((curves.middle()[1] * curves.at(np.array([0.5]))[1]).sum(), 0.0, atol=1e-15)


def test_parts_of_a_divided_arc_lie_on_it_and_of_a_straight_facet_beside_it_on_the_line():
    straight, unit = np.array([[[0.0, 0.0], [1.0, 2.0]]]), np.tile([1.0, 2.0], (1, 2, 1)) / np.sqrt(5.0)
    both = [np.concatenate(x) for x in zip(arcs(2.0, 0.2), (straight, straight.mean(axis=1), unit, np.zeros((1, 2))))]
    points, tangents, curvatures, firsts, seconds = divide_facets(*both, 0.25)
    # the facet itself, over 0.2 rad, leaves the circle by 5e-11 of its radius, and its tangent by 8e-10
    assert_allclose(np.linalg.norm([points[0], firsts[0], seconds[0]], axis=1), 2.0, rtol=1e-10)
    assert_allclose(points[0] @ tangents[0], 0.0, atol=4e-9)
    assert_allclose(curvatures[0], 0.5, rtol=1e-6)
    (start, end), *_ = both[0]
    for middle, a, b in ((firsts[0], start, points[0]), (seconds[0], points[0], end)):
        assert_allclose(np.linalg.norm(middle - a), np.linalg.norm(middle - b), rtol=1e-10)  # halfway
    assert_allclose([firsts[1], points[1], seconds[1]], [[0.125, 0.25], [0.25, 0.5], [0.625, 1.25]], rtol=1e-15)
    assert_allclose(tangents[1], unit[0, 0])
    assert_allclose(curvatures[1], 0.0, atol=0.0)
