"""Where taps begin, how many pulses they have, and whether they are cut off."""

import numpy as np

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
    assert triggers.n_pulses(np.pad(pulse, 20)) == 1
    assert triggers.n_pulses(np.concatenate([pulse, np.zeros(5), 0.3 * pulse])) == 2
    assert triggers.n_pulses(np.concatenate([pulse, np.zeros(5), 0.07 * pulse])) == 1  # the ringing of a filter
    assert triggers.n_pulses(np.zeros(30)) == 0


def test_noise_is_no_pulse_and_drift_no_rest():
    rng = np.random.default_rng(2)
    pulse = np.pad(np.sin(np.pi * np.arange(11) / 10), (500, 3000))
    noisy = pulse + 0.04 * rng.standard_normal(len(pulse))
    assert triggers.n_pulses(noisy) > 1  # without knowledge of the noise
    ((first, end),) = triggers.pulses(noisy, 0.04)
    assert abs(first - 501) <= 2 and abs(end - 510) <= 2
    assert triggers.pulses(np.zeros(30)) == []
    drift = np.linspace(-5.0, 3.0, len(pulse))
    left = pulse + drift - triggers.level_of_rest(pulse + drift, 200)
    assert np.abs(left - pulse).max() < 0.03  # the pulse moves a median of 200 by 5 ranks of 0.0023


def test_a_ceiling_is_reached_by_several_samples_two_of_them_neighbours():
    pulse = np.sin(np.pi * np.arange(11) / 10)
    low = np.minimum(pulse, 0.95)  # three samples at the top of each
    assert triggers.ceiling([low, 0.5 * pulse, low]) == 0.95
    assert triggers.ceiling([pulse, pulse, pulse]) == np.inf  # three taps of the same peak


def test_a_flat_top_is_clipping_and_a_round_one_is_not():
    pulse = np.sin(np.pi * np.arange(101) / 100)
    assert not triggers.clipped(pulse) and triggers.clipped(np.minimum(pulse, 0.9))
    assert triggers.clipped(-np.minimum(pulse, 0.9)) and not triggers.clipped(np.zeros(9))
    assert triggers.clipped(pulse, full_scale=1.0)
