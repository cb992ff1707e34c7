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


def test_a_flat_top_is_clipping_and_a_round_one_is_not():
    pulse = np.sin(np.pi * np.arange(101) / 100)
    assert not triggers.clipped(pulse) and triggers.clipped(np.minimum(pulse, 0.9))
    assert triggers.clipped(-np.minimum(pulse, 0.9)) and not triggers.clipped(np.zeros(9))
    assert triggers.clipped(pulse, full_scale=1.0)
