"""What is read from a blow: histories, spectrum, motion, words."""

import pytest

import fem_impact as fi


@pytest.fixture(scope="module")
def half_sine():
    """A mass of 0.1 kg on a plate of 1000 t: pi ms half sine of 100 N."""
    return fi.strike(fi.Modes.rigid(1e6), fi.Striker.rigid(0.1), fi.Contact.linear(1e5), at=None, speed=1.0)


def test_spectral_centroid_states_its_band_and_is_refused_for_too_many_periods(half_sine):
    low, high = half_sine.spectral_centroid(100.0), half_sine.spectral_centroid(1000.0)
    assert 40.0 < low < 50.0 < high < 1000.0  # a spectrum flat at first has its centroid near half the band
    with pytest.raises(ValueError, match="max_frequency must be positive"):
        half_sine.spectral_centroid(0.0)
    with pytest.raises(ValueError, match=r"max_frequency must be at most .* Hz for a blow of 0\.003142 s"):
        half_sine.spectral_centroid(1e12)
