"""Pieces of outlines against closed forms: derivatives, curvature, division, orientation, area."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ellipe

from fem_impact.mesh import loops
from fem_impact.mesh.loops import TURN, Arc, Bezier, Outline

ELLIPSE = Arc(np.array([1.0, 2.0]), np.array([3.0, 0.0]), np.array([0.0, 1.0]), 0.0, 2.0 * np.pi)
T = np.linspace(0.0, 1.0, 101)
CUBIC = Bezier(np.array([[0.0, 0.0], [1.0, 2.0], [3.0, -1.0], [4.0, 1.0]]))


def test_bezier_pieces_are_their_polynomials():
    x, y = CUBIC.at(T).T
    assert_allclose(x, 3.0 * T + 3.0 * T**2 - 2.0 * T**3, atol=1e-14)  # expanded by hand
    assert_allclose(y, 6.0 * T - 15.0 * T**2 + 10.0 * T**3, atol=1e-14)
    assert_allclose(CUBIC.at(T, 1)[:, 1], 6.0 - 30.0 * T + 30.0 * T**2, atol=1e-13)
    assert_allclose(CUBIC.at(T, 2)[:, 1], -30.0 + 60.0 * T, atol=1e-13)
    assert_allclose(CUBIC.at(T, 4), 0.0, atol=0.0)


def test_curvature_of_an_ellipse_and_of_a_cubic():
    angle = 2.0 * np.pi * T
    bend = 3.0 / np.hypot(3.0 * np.sin(angle), np.cos(angle)) ** 3
    assert_allclose(loops.curvature(ELLIPSE, T), bend, rtol=1e-12)
    assert_allclose(loops.curvature(ELLIPSE.reversed(), T), -bend[::-1], rtol=1e-12)
    x, y = CUBIC.at(T, 1).T
    u, v = CUBIC.at(T, 2).T
    assert_allclose(loops.curvature(CUBIC, T), (x * v - y * u) / np.hypot(x, y) ** 3, rtol=1e-12)
    assert_allclose(loops.curvature(loops.segment((0, 0), (3, 4)), T), 0.0, atol=0.0)


@pytest.mark.parametrize("piece", [ELLIPSE, CUBIC], ids=["arc", "bezier"])
def test_turning_back_gives_the_same_places(piece):
    assert_allclose(piece.reversed().at(T), piece.at(1.0 - T), atol=1e-14)
    assert_allclose(loops.tangent(piece.reversed(), T), -loops.tangent(piece, 1.0 - T), atol=1e-12)


def test_tangent_where_the_derivative_vanishes_is_that_just_inside():
    piece = Bezier(np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [2.0, 1.0]]))  # leaves its doubled first point by 45
    assert_allclose(loops.tangent(piece, np.zeros(1))[0], [np.sqrt(0.5), np.sqrt(0.5)], atol=1e-4)


def test_division_is_fine_enough_in_length_and_turn_and_no_finer():
    circle = loops.circle((0.0, 0.0), 2.0)[0]
    assert len(loops.divide(circle, 10.0)) - 1 == np.ceil(2.0 * np.pi / TURN)  # the turn decides: 26 facets
    for size in (0.1, 0.037):
        t = loops.divide(circle, size)
        assert len(t) - 1 == np.ceil(4.0 * np.pi / size)
        assert_allclose(np.diff(t), 1.0 / (len(t) - 1), rtol=1e-6)
    t = loops.divide(ELLIPSE, 0.05)
    facets = np.linalg.norm(np.diff(ELLIPSE.at(t), axis=0), axis=1)
    assert facets.max() < 0.05 * (1.0 + 1e-3)
    length = 12.0 * ellipe(1.0 - 1.0 / 9.0)  # the turn adds facets at the tips only
    assert length / 0.05 <= len(facets) < 1.05 * length / 0.05


def test_a_place_above_the_chord_is_found():
    start, end, share = np.array([0.1, 0.4]), np.array([0.2, 0.55]), np.array([0.25, 0.9])
    for piece in (ELLIPSE, CUBIC, loops.segment((0, 0), (3, 4))):
        found = piece.at(loops.crossing(piece, start, end, share))
        a, b = piece.at(start), piece.at(end)
        along = ((found - a) * (b - a)).sum(axis=1) / ((b - a) ** 2).sum(axis=1)
        assert_allclose(along, share, atol=1e-13)


def test_area_within_a_curve_converges_at_second_order_and_keeps_its_sign():
    missed = [np.pi * 3.0 - loops.signed_area(loops.polyline((ELLIPSE,), size)) for size in (0.1, 0.05)]
    assert 1.9 < np.log2(missed[0] / missed[1]) < 2.1
    assert loops.signed_area(loops.polyline((ELLIPSE.reversed(),), 0.05)) < 0.0


def test_the_body_lies_on_the_left_of_every_loop_however_it_was_drawn():
    hole = loops.circle((1.0, 2.0), 0.5)
    drawn = Outline.around((ELLIPSE.reversed(),), (hole,))
    area = [loops.signed_area(loops.polyline(loop, 0.01)) for loop in drawn.loops]
    assert_allclose(area, [3.0 * np.pi, -0.25 * np.pi], rtol=2e-3)  # the turn within a facet: TURN**2 / 24
    assert loops.why_crossed(drawn) == ""
    assert_allclose(loops.extent(drawn.outer), 6.0, rtol=1e-12)


def test_straight_and_curved_are_told_apart():
    assert loops.is_straight(Bezier(np.array([[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]])))
    assert not loops.is_straight(Bezier(np.array([[0.0, 0.0], [1.0, 1.0 + 1e-9], [3.0, 3.0]])))
    assert not loops.is_straight(ELLIPSE)
