"""Taps joined to one table, and cut to what is compared."""

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.taps import triggers, windows

PULSE = 100.0 * np.sin(np.linspace(0.0, np.pi, 14)) ** 2


def tap(place, n_times=400, rate=25600.0):
    force = np.zeros(n_times)
    force[place : place + len(PULSE)] = PULSE
    return fi.Taps.from_arrays(force, rate=rate)


def test_records_of_unequal_length_are_joined_to_the_shortest():
    both = windows.joined([tap(50), tap(80, 300)])
    assert both.n_taps == 2 and len(both.time) == 300 and both.labels == ("tap 1", "tap 2")
    with pytest.raises(ValueError, match="sampled at 25600 Hz"):
        windows.joined([tap(50), tap(50, rate=51200.0)])


def test_all_onsets_come_to_the_same_place():
    cut = windows.cut(windows.joined([tap(50), tap(83)]), None)
    assert np.array_equal(cut.force[0], cut.force[1])
    assert cut.onset[0] * cut.rate == pytest.approx(windows.BEFORE) and np.ptp(cut.onset) == 0.0
    assert len(cut.time) >= windows.BEFORE + 2 * len(PULSE)
    narrow = windows.cut(tap(50), (1e-4, 5e-4))
    assert len(narrow.time) == round(1e-4 * 25600) + round(5e-4 * 25600)
    with pytest.raises(ValueError, match="window must leave samples"):
        windows.cut(tap(50), (0.0, 1e-4))


def test_records_are_scaled_to_their_peaks_over_the_weights():
    data = windows.data(windows.joined([tap(50), tap(83)]), 0, np.array([2.0]))
    assert np.allclose(data.scale, PULSE.max() / 2.0) and np.allclose(np.abs(data.values).max(axis=2), 2.0)


def test_offsets_beyond_the_noise_are_removed_and_said():
    rng = np.random.default_rng(1)
    pulse = np.pad(100.0 * np.sin(np.linspace(0.0, np.pi, 12)) ** 2, (40, 60)) + 0.2 * rng.standard_normal(112)
    rows = np.array([pulse, pulse + 20.0, pulse - 7.0, np.roll(pulse, -37) + 5.0])  # the last begins with its pulse
    taps = fi.Taps.from_arrays(rows, rate=25600.0, notes=["as given"])
    assert (np.abs(taps.onset * 25600.0 - [42, 42, 42, 5]) <= 1.0).all()  # an offset moves no onset
    made = windows.levelled(taps)
    assert np.allclose(made.peak, taps.peak[0], atol=0.3)
    assert np.array_equal(made.force[0], taps.force[0])  # noise is no offset
    assert made.notes == ("as given", "offsets of the force were removed, up to 20 N: tap 2, tap 3, tap 4")
    assert windows.levelled(taps.pick([0])).notes == ("as given",)


@pytest.mark.parametrize(("offset", "removed"), [(0.1, False), (0.4, True)])
def test_an_offset_of_less_than_two_thousandths_of_the_peak_is_left(offset, removed):
    taps = tap(50)
    moved = fi.Taps.from_arrays(taps.force + offset, rate=25600.0)
    assert bool(windows.levelled(moved).notes) == removed


@pytest.mark.parametrize(("deviations", "removed"), [(4.0, False), (9.0, True)])
def test_an_offset_of_less_than_six_standard_deviations_of_its_mean_is_left(deviations, removed):
    row = tap(50).force[0] + 2.0 * np.random.default_rng(3).standard_normal(400)
    rest = row[: 50 - triggers.GUARD]
    row += deviations * triggers.noise(row) / np.sqrt(len(rest)) - np.median(rest)
    assert bool(windows.levelled(fi.Taps.from_arrays(row, rate=25600.0)).notes) == removed
