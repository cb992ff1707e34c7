"""The spectrum of straight pieces: against closed forms, and each of its four ways against the others."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_impact.impact import force_spectrum

TIME = np.array([0.0, 1e-3, 2e-3, 5e-3, 6e-3, 7e-3])
FORCE = np.array([[0.0], [2.0], [0.0], [0.0], [1.0], [0.0]])  # two triangles of force, with a gap between
FREQUENCIES = np.linspace(0.0, 4e3, 41)


def triangles(frequencies):
    """Each triangle of height F and half width a about a time t: F a sinc(f a)**2 exp(-2 pi i f t)."""
    both = ((2.0, 1e-3, 1e-3), (1.0, 1e-3, 6e-3))
    return sum(F * a * np.sinc(frequencies * a) ** 2 * np.exp(-2j * np.pi * frequencies * t) for F, a, t in both)


@pytest.mark.parametrize("scale", [1.0, 1e-6])  # the second takes the series for short pieces
def test_triangles_have_their_closed_form(scale):
    found = force_spectrum.of_pieces(force_spectrum.pieces(scale * TIME, FORCE), FREQUENCIES)
    assert_allclose(found, scale * triangles(scale * FREQUENCIES), atol=1e-14 * scale)


def test_pieces_without_force_are_left_out_and_forces_of_all_contacts_add():
    start, length, first, last = force_spectrum.pieces(TIME, np.hstack([FORCE, 2.0 * FORCE]))
    assert_allclose(start, [0.0, 1e-3, 5e-3, 6e-3])
    assert_allclose(length, 1e-3)
    assert_allclose(first + last, [6.0, 6.0, 3.0, 3.0])


def test_the_compiled_sum_equals_the_direct_one():
    pieces = force_spectrum.pieces(TIME, FORCE)
    assert_allclose(force_spectrum.evenly(pieces, FREQUENCIES), triangles(FREQUENCIES), atol=1e-13)


def test_the_transform_of_a_long_blow_equals_the_direct_sum(monkeypatch):
    pieces = force_spectrum.pieces(TIME, FORCE)
    asked = np.array([-700.0, 0.0, 12.3, 999.9, 4e3])
    monkeypatch.setattr(force_spectrum, "MOST_TERMS", 0)
    # cells of an eighth of the shortest half period alias by up to 2e-7 of the whole impulse, 3e-3 N s
    assert_allclose(force_spectrum.of_pieces(pieces, asked), triangles(asked), rtol=0.0, atol=2e-7 * 3e-3)


def test_the_trapezoidal_rule_converges_to_it():
    time = np.linspace(0.0, 7e-3, 20_001)
    force = np.interp(time, TIME, FORCE[:, 0])
    found = force_spectrum.magnitude(time, force, FREQUENCIES[:10])
    step = time[1]
    allowed = (2.0 * np.pi * FREQUENCIES[9] * step) ** 2 / 12.0 * 3e-3  # its error, times the whole impulse
    assert_allclose(found, np.abs(triangles(FREQUENCIES[:10])), atol=allowed + 1e-9)
