"""The spectrum of straight pieces: against closed forms, and both of its ways against 80 digits."""

import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import special

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
    found = force_spectrum.of_pieces(force_spectrum.straight_pieces(scale * TIME, FORCE), FREQUENCIES)
    # 1e-15 of the integral of the force, 3e-3 N s, and the rounding of phases of up to 180 rad
    assert_allclose(found, scale * triangles(scale * FREQUENCIES), rtol=0.0, atol=1e-16 * scale)


def test_pieces_without_force_are_left_out_and_forces_of_all_contacts_add():
    start, length, first, last = force_spectrum.straight_pieces(TIME, np.hstack([FORCE, 2.0 * FORCE]))
    assert_allclose(start, [0.0, 1e-3, 5e-3, 6e-3])
    assert_allclose(length, 1e-3)
    assert_allclose(first + last, [6.0, 6.0, 3.0, 3.0])


def rough(n_pieces, seed):
    """Pieces of very unequal length whose force jumps about, with a gap, and the integral of its magnitude."""
    rng = np.random.default_rng(seed)
    time = 3e-3 + np.cumsum(10.0 ** rng.uniform(-9.0, -5.0, n_pieces + 1))
    force = rng.uniform(-1.0, 3.0, (n_pieces + 1, 1))
    force[n_pieces // 3 : n_pieces // 2] = 0.0
    found = force_spectrum.straight_pieces(time, force)
    return found, float(np.abs(found[1] * (found[2] + found[3])).sum() / 2.0)


def with_eighty_digits(pieces, frequency):
    """The spectrum by the closed form of every piece as it stands; a phase of 1e-19 costs 38 of the digits."""
    with mpmath.workdps(80):
        omega, total = 2 * mpmath.pi * mpmath.mpf(float(frequency)), mpmath.mpc(0)
        for t, h, f0, f1 in zip(*(map(mpmath.mpf, map(float, x)) for x in pieces)):
            if omega == 0:
                total += h * (f0 + f1) / 2
                continue
            turn, slope = mpmath.expj(-omega * h), (f1 - f0) / h
            part = (f0 - f1 * turn) / (1j * omega) + slope * (turn - 1) / omega**2
            total += mpmath.expj(-omega * t) * part
        return complex(total)


def allowed(pieces, highest, rounding):
    """In parts of the force's integral: ``rounding``, and that of the greatest phase."""
    return rounding + np.finfo(float).eps * 2.0 * np.pi * highest * (pieces[0][-1] + pieces[1][-1])


@pytest.mark.parametrize("highest", [1e-3, 1e3, 1e5])  # Hz: phases over the whole blow of 2e-5, 20 and 2 000 rad
def test_the_transform_is_exact_to_rounding(highest, monkeypatch):
    """Frequencies evenly from zero, which folds the time; from below zero; over seven decades."""
    monkeypatch.setattr(force_spectrum, "spectrum_in_closed_form", None)
    pieces, whole = rough(300, seed=1)
    evenly, below = np.linspace(0.0, highest, 64), np.append(np.linspace(-highest, 0.7 * highest, 40), 0.0)
    for frequencies in (evenly, below, np.geomspace(1e-7 * highest, highest, 60)):
        found = force_spectrum.of_pieces(pieces, frequencies)[::21]
        exact = np.array([with_eighty_digits(pieces, frequency) for frequency in frequencies[::21]])
        # a window of exp(38) keeps 38 eps twice over
        assert_allclose(found, exact, rtol=0.0, atol=allowed(pieces, highest, 2e-14) * whole)


def test_few_impulses_and_many_are_summed_alike():
    """One more without impulse makes them so many that cells collect them."""
    rng = np.random.default_rng(5)
    time, impulse = np.sort(rng.uniform(0.0, 3e-3, 300)), rng.normal(size=300) * (np.arange(300) > 0)
    for count in (1, 2, 97, 4096):
        many = force_spectrum.transform_impulses(time, impulse, 20.0, count)
        few = force_spectrum.transform_impulses(time[1:], impulse[1:], 20.0, count)
        phase = 2.0 * np.pi * 20.0 * count * time[-1]
        limit = (1e-15 + np.finfo(float).eps * phase) * np.abs(impulse).sum()  # rounding, and that of the phase
        assert_allclose(few, many, rtol=0.0, atol=limit)


@pytest.mark.parametrize("highest", [0.0, 1e-3, 1e3, 1e5, 1e7, 1e9, 1e12])  # Hz: over a piece from 0 to 6e7 rad
def test_the_direct_sum_is_exact_to_rounding(highest):
    pieces, whole = rough(300, seed=2)
    frequencies = np.array([highest, -0.3 * highest])
    exact = np.array([with_eighty_digits(pieces, frequency) for frequency in frequencies])
    found = force_spectrum.of_pieces(pieces, frequencies)
    assert_allclose(found, exact, rtol=0.0, atol=allowed(pieces, highest, 1e-15) * whole)


@pytest.mark.parametrize("n_pieces", [5_000, 20_000])
def test_many_pieces_and_frequencies_too_high_for_the_transform_agree(n_pieces):
    pieces, whole = rough(n_pieces, seed=3)
    for highest in (1e4, 1e9):
        frequencies = np.array([-1.0, -0.11, 0.0, 1e-9, 0.003, 0.5, 1.0]) * highest
        found, direct = (
            force_spectrum.of_pieces(pieces, frequencies),
            force_spectrum.spectrum_in_closed_form(pieces, frequencies),
        )
        assert_allclose(found, direct, rtol=0.0, atol=allowed(pieces, highest, 2e-14) * whole)


def test_what_rounding_hides_is_zero_and_takes_no_time():
    """Touches of days, in pieces that no transform of seconds resolves."""
    time = np.linspace(0.0, 1e7, 100_001)
    pieces = force_spectrum.straight_pieces(time, np.maximum(np.sin(3e-6 * np.pi * time), 0.0)[:, None])
    frequencies = np.concatenate([[0.0, 1.5e-6], np.full(100_000, 1e3)])  # would take a quarter of an hour
    found = force_spectrum.of_pieces(pieces, frequencies)
    assert_allclose(found[:2], force_spectrum.spectrum_in_closed_form(pieces, frequencies[:2]), rtol=1e-12)
    assert np.abs(found[:2]).min() > 1e5 and not found[2:].any()


def test_one_frequency_zeros_and_no_pieces_have_a_spectrum():
    pieces, whole = rough(5_000, seed=4)
    impulse = float((pieces[1] * (pieces[2] + pieces[3])).sum() / 2.0)
    assert_allclose(force_spectrum.of_pieces(pieces, np.zeros(7)), np.full(7, impulse), rtol=0.0, atol=1e-15 * whole)
    alone = force_spectrum.of_pieces(pieces, np.array([123.4]))
    beside = force_spectrum.of_pieces(pieces, np.array([123.4, -123.4, 60.0]))
    assert_allclose([alone[0], alone[0].conj()], beside[:2], rtol=0.0, atol=2e-14 * whole)
    nothing = force_spectrum.straight_pieces(TIME, np.zeros((6, 1)))
    assert not force_spectrum.of_pieces(nothing, FREQUENCIES).any()


def test_magnitude_is_that_of_the_spectrum():
    found = force_spectrum.magnitude(TIME, FORCE[:, 0], FREQUENCIES)
    assert_allclose(found, np.abs(triangles(FREQUENCIES)), rtol=0.0, atol=1e-16)


def test_centroids_and_their_slopes_hold_over_many_lobes():
    """A steady force of length T from T on; between its zeros, |sin(pi x)| / x over x = f T has known integrals."""
    band = 20.3  # lobes

    def centroid(length):
        frequencies = force_spectrum.dense_frequencies(band, 2.0 * length)
        spectrum = length * np.sinc(frequencies * length) * np.exp(-3j * np.pi * frequencies * length)
        return force_spectrum.centroid(frequencies, spectrum)

    def exact(length):
        zeros = np.append(np.arange(np.floor(band * length) + 1.0), band * length)
        areas = np.abs(np.diff(special.sici(np.pi * zeros)[0]))
        return np.abs(np.diff(np.cos(np.pi * zeros))).sum() / areas.sum() / np.pi / length

    lengths = np.linspace(0.95, 1.05, 41)
    found, known = np.array([[centroid(x), exact(x)] for x in lengths]).T
    assert_allclose(found, known, rtol=5e-6)  # 1e-6
    slopes = np.array([centroid(x + 1e-4) - centroid(x - 1e-4) for x in lengths]) / 2e-4
    known = np.array([exact(x + 1e-4) - exact(x - 1e-4) for x in lengths]) / 2e-4
    assert_allclose(slopes, known, atol=1e-4 * np.abs(known).max(), rtol=0.0)  # 2e-5; 7e-2 with corners cut
