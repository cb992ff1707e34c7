"""Taps joined to one table, and cut to what is compared."""

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.taps import triggers, windows

PULSE = 100.0 * np.sin(np.linspace(0.0, np.pi, 14)) ** 2


def tap(place, n_times=400, rate=25600.0, added=0.0):
    force = np.zeros(n_times)
    force[place : place + len(PULSE)] = PULSE
    return fi.Taps.from_arrays(force + added, rate=rate)


def test_records_of_unequal_length_are_joined_to_the_shortest():
    both = windows.join_tables([tap(50), tap(80, 300)])
    assert both.n_taps == 2 and len(both.time) == 300 and both.labels == ("tap 1", "tap 2")
    with pytest.raises(ValueError, match="sampled at 25600 Hz"):
        windows.join_tables([tap(50), tap(50, rate=51200.0)])


def test_joined_taps_keep_their_labels_and_what_counts_as_a_pulse():
    """Each table's own threshold; a threshold of 5 N sees the small second pulse, one of 20 N does not."""
    rows = np.pad(100.0 * np.sin(np.linspace(0.0, np.pi, 20)) ** 2, (60, 400))
    rows[120:126] += 8.0 * np.sin(np.linspace(0.0, np.pi, 6))
    blind, keen = (
        fi.Taps.from_arrays(rows, rate=25600.0, pulse=least, labels=[name]) for least, name in ((20.0, "a"), (5.0, "b"))
    )
    for several in ([blind, keen], [keen, blind]):
        both = windows.join_tables(several)
        assert both.n_pulses.tolist() == [int(each.n_pulses[0]) for each in several]
        assert both.labels == tuple(each.labels[0] for each in several)
    assert windows.join_tables([blind, blind]).labels == ("tap 1", "tap 2")


def test_responses_are_joined_by_their_names_whatever_their_order():
    rows, moved = np.pad(PULSE, 60), np.arange(2.0) + np.ones((len(PULSE) + 120, 1))
    first, second = (
        fi.Taps.from_arrays(rows, moved[None][..., way], rate=25600.0, names=[f"a{k}" for k in way],
                            overload=[[False, way[0] == 0, way[1] == 0]])
        for way in ([0, 1], [1, 0])
    )  # fmt: skip
    both = windows.join_tables([first, second])
    assert (both.response == [1.0, 2.0]).all() and both.table["overload"].values.tolist() == 2 * [[False, True, False]]
    other = fi.Taps.from_arrays(rows, moved[None], rate=25600.0, names=["a0", "a2"])
    with pytest.raises(ValueError, match="the same responses, got a0, a2 and a0, a1"):
        windows.join_tables([first, other])


def test_all_onsets_come_to_the_same_place():
    cut = windows.cut_to_window(windows.join_tables([tap(50), tap(83)]), None)
    assert np.array_equal(cut.force[0], cut.force[1])
    assert cut.onset[0] * cut.rate == pytest.approx(windows.BEFORE) and np.ptp(cut.onset) == 0.0
    assert len(cut.time) >= windows.BEFORE + 2 * len(PULSE)
    assert len(windows.cut_to_window(tap(50), (1e-4, 5e-4)).time) == round(1e-4 * 25600) + round(5e-4 * 25600)


def test_records_are_scaled_to_their_peaks_over_the_weights():
    data = windows.data(windows.join_tables([tap(50), tap(83)]), 0, np.array([2.0]))
    assert np.allclose(data.scale, PULSE.max() / 2.0) and np.allclose(np.abs(data.values).max(axis=2), 2.0)


def test_offsets_beyond_the_noise_are_removed_and_said():
    pulse = np.pad(100.0 * np.sin(np.linspace(0.0, np.pi, 12)) ** 2, (40, 60))
    pulse += 0.2 * np.random.default_rng(1).standard_normal(112)
    rows = np.array([pulse, pulse + 20.0, pulse - 7.0, np.roll(pulse, -37) + 5.0])  # the last begins with its pulse
    taps = fi.Taps.from_arrays(rows, rate=25600.0, notes=["as given"])
    assert (np.abs(taps.onset * 25600.0 - [42, 42, 42, 5]) <= 1.0).all()  # an offset moves no onset
    made = windows.level_offsets(taps)
    assert np.allclose(made.peak, taps.peak[0], atol=0.3)
    assert np.array_equal(made.force[0], taps.force[0])  # noise is no offset
    assert made.notes == ("as given", "offsets of the force were removed, up to 20 N: tap 2, tap 3, tap 4")
    assert windows.level_offsets(taps.pick([0])).notes == ("as given",)


NOISE = 2.0 * np.random.default_rng(3).standard_normal(400)
REST = slice(0, 50 - triggers.GUARD)
SURE = triggers.noise(tap(50).force[0] + NOISE) / np.sqrt(REST.stop)  # standard deviation of the mean


@pytest.mark.parametrize(
    ("added", "removed"),
    [(0.1, False), (0.4, True), (NOISE - np.median(NOISE[REST]) + 4.0 * SURE, False),
     (NOISE - np.median(NOISE[REST]) + 9.0 * SURE, True)],
    ids=["0.001 of the peak", "0.004 of the peak", "4 standard deviations", "9 standard deviations"],
)  # fmt: skip
def test_an_offset_below_0_002_of_the_peak_or_six_deviations_of_its_mean_is_left(added, removed):
    assert bool(windows.level_offsets(tap(50, added=added)).notes) == removed
