"""Where taps begin, how many pulses they have, and whether they are cut off."""

import numpy as np
import pytest

from fem_impact.taps import triggers


def test_noise_is_not_raised_by_taps():
    force = np.random.default_rng(1).normal(0.0, 0.3, 4000)
    force[100:130] += 200.0
    assert abs(triggers.noise(force) / 0.3 - 1.0) < 0.05  # 4 000 samples: 2 % of spread


def test_a_gap_decides_what_is_one_tap():
    force = np.zeros(1000)
    force[[100, 140, 500]] = 10.0
    assert triggers.starts(force, 1.0, 50).tolist() == [100, 500]
    assert triggers.starts(force, 1.0, 30).tolist() == [100, 140, 500]
    assert triggers.starts(force, 11.0, 30).size == 0


def test_pulses_are_counted_once_each():
    pulse = np.sin(np.pi * np.arange(11) / 10)
    assert triggers.pulses(np.pad(pulse, 20)) == [(21, 30)]
    assert len(triggers.pulses(np.concatenate([pulse, np.zeros(5), 0.3 * pulse]))) == 2
    assert len(triggers.pulses(np.concatenate([pulse, np.zeros(5), 0.002 * pulse]))) == 2  # above what noise allows
    assert triggers.pulses(np.zeros(30)) == []


@pytest.mark.parametrize(("low", "second", "n"), [(0.04, 0.5, 2), (0.06, 0.5, 1), (0.02, 0.07, 2), (0.04, 0.07, 1)])
def test_pulses_that_touch_are_apart_below_a_twentieth_of_the_peak_or_half_of_the_smaller(low, second, n):
    force = np.interp(np.arange(41), [0, 10, 20, 30, 40], [0.0, 1.0, low, second, 0.0])
    assert len(triggers.pulses(force)) == n


def test_ringing_and_bits_are_no_pulses_and_a_push_above_them_is():
    pulse, k = np.sin(np.pi * np.arange(11) / 10), np.arange(1, 60)
    ringing = 0.03 * np.exp(-k / 20.0) * np.sin(2.0 * np.pi * k / 7.3)  # from 2.7 % on, pushing first
    tap = np.concatenate([np.zeros(20), pulse, ringing])
    assert len(triggers.pulses(tap)) == 1
    tap[60:71] += 0.1 * pulse
    assert len(triggers.pulses(tap)) == 2 and len(triggers.pulses(tap, least=0.15)) == 1
    bits = np.concatenate([np.zeros(20), np.round(512 * pulse) / 512, np.zeros(50)])
    bits[[50, 60]] = 1.0 / 512.0
    assert len(triggers.pulses(bits)) == 1


def test_noise_is_no_pulse_and_drift_no_rest():
    rng = np.random.default_rng(2)
    pulse = np.pad(np.sin(np.pi * np.arange(11) / 10), (500, 3000))
    noisy = pulse + 0.04 * rng.standard_normal(len(pulse))
    assert len(triggers.pulses(noisy, least=0.08)) > 1  # without knowledge of the noise
    ((first, end),) = triggers.pulses(noisy, 0.04)
    assert abs(first - 501) <= 2 and abs(end - 510) <= 2
    assert triggers.pulses(np.zeros(30)) == []
    drift = np.linspace(-5.0, 3.0, len(pulse))
    left = pulse + drift - triggers.level_of_rest(pulse + drift, 200)
    assert np.abs(left - pulse).max() < 0.03  # the pulse moves a median of 200 by 5 ranks of 0.0023


def test_a_ceiling_is_reached_by_several_samples_two_of_them_neighbours():
    pulse = np.sin(np.pi * np.arange(11) / 10)
    low = np.minimum(pulse, 0.95)  # three samples at the top of each
    assert triggers.ceiling([low, 0.5 * pulse, low]) == triggers.ceiling([low]) == 0.95
    assert triggers.ceiling([pulse, pulse, pulse]) == np.inf  # three taps of the same peak


def test_a_flat_top_is_clipping_and_a_round_one_is_not():
    pulse = np.sin(np.pi * np.arange(101) / 100)
    assert not triggers.clipped(pulse) and triggers.clipped(np.minimum(pulse, 0.9))
    assert triggers.clipped(-np.minimum(pulse, 0.9)) and not triggers.clipped(np.zeros(9))
    assert triggers.clipped(pulse, full_scale=1.0)


def test_a_tap_begins_at_a_twentieth_of_its_peak_whatever_its_offset():
    pulse = np.sin(np.pi * np.arange(701) / 700)
    assert triggers.onset(np.repeat([0.0, 0.03, 0.08, 1.0, 0.0, 0.0], 100)) == 200
    assert abs(triggers.onset(5.0 + np.pad(pulse, (290, 10))) - 302) <= 2  # a pulse over seven tenths of the record


def test_a_second_hit_is_found_in_strong_noise():
    pulse = np.sin(np.pi * np.arange(101) / 100)
    force = np.concatenate([np.zeros(900), pulse, np.zeros(100), 0.53 * pulse, np.zeros(900)])
    noisy = force + 0.1 * np.random.default_rng(4).standard_normal(len(force))  # six deviations are 0.6
    assert len(triggers.pulses(np.convolve(noisy, np.ones(16) / 16.0, mode="same"), 0.1)) == 2


def cut(force, *, rate=1000.0, **options):
    """The taps of a record without responses."""
    given = dict.fromkeys(("trigger", "before", "length")) | {"together": 0.05} | options
    return triggers.cut([(force, np.zeros((len(force), 0)))], rate, "here", **given)


def test_taps_may_be_as_near_as_one_sample_below_the_trigger():
    force = np.zeros(4000)
    force[[2000, 2002]] = 10.0
    assert len(cut(force, together=1e-9, length=0.005)[0]) == 2  # together counts for one sample at least
    assert len(cut(force, together=0.002, length=0.005)[0]) == 1


@pytest.mark.parametrize(("share", "told"), [(0.15, False), (0.3, True)])
def test_drift_is_told_from_a_fifth_of_the_trigger_on(share, told):
    force = np.zeros(4000)
    force[2000:2010] = 10.0
    drift = share * 1.0 / 0.12 * np.arange(4000) / 1000.0  # [N] in the 0.12 s of a record with a trigger of 1 N
    notes = cut(force + drift, trigger=1.0, length=0.12)[3:][1]
    assert told == any("drift" in note for note in notes)


def test_a_pulse_of_a_tenth_of_a_second_is_no_drift():
    force = np.zeros(4000)
    force[2010:2100] = 10.0
    for offset in (0.0, 3.0):
        assert np.ptp(cut(force + offset)[0]) == cut(force + offset)[0].max() == pytest.approx(10.0, rel=1e-3)


@pytest.mark.parametrize(("lead", "told"), [(6, True), (10, False)])
def test_fewer_than_eight_samples_before_a_tap_give_no_offset(lead, told):
    force = np.zeros(3000)
    force[lead : lead + 5] = 10.0
    assert told == any("offsets are not removed" in note for note in cut(force)[4])


def test_a_record_lasts_ten_seconds_at_most():
    force = np.zeros(30_000)
    force[100:105] = 10.0
    assert cut(force)[0].shape[1] == 10_000 + 20  # and 0.02 s before the tap


def test_noise_alone_is_no_tap_and_one_of_ten_deviations_is():
    force = np.random.default_rng(5).normal(size=100_000)  # up to 4.3 deviations
    assert not triggers.starts(force, triggers.level(force), 100).size
    force[50_000:50_005] += 12.0
    assert len(triggers.starts(force, triggers.level(force), 100)) == 1
