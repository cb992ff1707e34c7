"""Mobility against exact formulas, and the half sine against its printed properties."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_impact.impact import spectra
from fem_impact.modes import analytic


def test_half_sine_levels():
    # -3, -6, -10, -20 dB points and the first null, over the contact frequency (half-sine table of Euphonics 2.2.6).
    level = 20.0 * np.log10(spectra.half_sine_spectrum([1.187, 1.637, 2.039, 2.607], 1.0))
    assert_allclose(level, [-3.0, -6.0, -10.0, -20.0], atol=0.02)  # abscissae printed to four digits
    assert spectra.half_sine_spectrum(3.0, 1.0) < 1e-15
    assert spectra.half_sine_spectrum(-1.0, 1.0) == pytest.approx(np.pi / 4)
    assert_allclose(spectra.half_sine_spectrum([1.0, 1.0 + 1.01e-4, 1.0 - 1.01e-4], 1.0), np.pi / 4, rtol=1e-4)


def test_mobility_is_static_at_low_frequency():
    modes = analytic.rectangle(1.0, 0.7, mass=0.5, first_frequency=80.0, n_modes=30, damping_ratio=0.01)
    a, b, low = (0.2, 0.3), (0.6, 0.5), [1e-3]
    static = modes.shapes.compliance(np.array([a, b]))[0, 1]
    assert_allclose(spectra.mobility(modes, a, b, low) / (2j * np.pi * low[0]), static, rtol=1e-6)  # damping: 1e-7


def test_mobility_of_a_rigid_mass_is_that_of_a_mass():
    modes = analytic.Modes.rigid(2.0)
    assert_allclose(spectra.mobility(modes, None, None, [5.0]), 1.0 / (2j * np.pi * 5.0 * 2.0), rtol=1e-14)


def test_many_points_are_reciprocal_and_agree_with_single_ones():
    modes = analytic.rectangle(1.0, 0.7, mass=0.5, first_frequency=80.0, n_modes=30, damping_ratio=0.01)
    points, frequencies = [(0.2, 0.3), (0.6, 0.5), (0.5, 0.1)], np.array([50.0, 81.0, 200.0])
    found = {name: spectra.mobility(modes, points, points, frequencies, name) for name in spectra.QUANTITIES}
    assert found["mobility"].shape == (3, 3, 3)
    assert_allclose(found["mobility"], found["mobility"].transpose(0, 2, 1), rtol=1e-12)  # same sum in another order
    for i, to in enumerate(points):
        for j, at in enumerate(points):
            assert_allclose(found["mobility"][:, i, j], spectra.mobility(modes, at, to, frequencies), rtol=1e-10)
    s = 2j * np.pi * frequencies[:, None, None]
    assert_allclose(found["receptance"] * s, found["mobility"], rtol=1e-12)
    assert_allclose(found["receptance"] * s**2, found["accelerance"], rtol=1e-12)
    row = spectra.mobility(modes, points[0], points[1:], frequencies)
    assert_allclose(row, found["mobility"][:, 1:, :1], rtol=1e-10)


def test_an_undamped_mode_is_infinite_at_its_frequency_but_at_its_nodes():
    modes = analytic.Modes.from_arrays(
        [100.0, 300.0], [[1.0, 1.0], [0.0, 1.0]], points=[[0.0], [1.0]], mass=1.0, complete=True
    )
    found = np.abs(spectra.mobility(modes, [[0.0], [1.0]], [[0.0], [1.0]], [100.0, 200.0]))
    assert np.isinf(found[0]).tolist() == [[True, False], [False, False]]
    s = 2.0 * np.pi
    assert_allclose(found[0, 1, 1], s * 100.0 / (s**2 * (300.0**2 - 100.0**2)), rtol=1e-12)  # the other mode alone
    assert np.isfinite(found[1]).all()


def test_frequencies_must_be_positive():
    modes = analytic.Modes.rigid(2.0)
    with pytest.raises(ValueError, match="quantity must be one of receptance, mobility, accelerance"):
        spectra.mobility(modes, None, None, [1.0], "compliance")
    with pytest.raises(ValueError, match="frequencies must be positive, got 0 Hz"):
        spectra.mobility(modes, None, None, [0.0])
