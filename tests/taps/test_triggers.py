"""Where taps begin, how many pulses they have, and whether they are cut off."""

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.taps import triggers


def half_sine(n):
    return np.sin(np.pi * np.arange(n) / (n - 1))


PULSE, K = half_sine(11), np.arange(1, 60)
# from 2.7 % on, pushing first
RINGING = np.concatenate([np.zeros(20), PULSE, 0.03 * np.exp(-K / 20.0) * np.sin(2.0 * np.pi * K / 7.3)])
PUSHED = RINGING + np.pad(0.1 * PULSE, (60, 19))
BITS = np.concatenate([np.zeros(20), np.round(512 * PULSE) / 512, np.zeros(50)])
BITS[[50, 60]] = 1.0 / 512.0


def after(second):
    return np.concatenate([PULSE, np.zeros(5), second * PULSE])


def touching(low, second):
    return np.interp(np.arange(41), [0, 10, 20, 30, 40], [0.0, 1.0, low, second, 0.0])


@pytest.mark.parametrize(("force", "least", "n"), [
    pytest.param(np.zeros(30), None, 0, id="nothing"),
    pytest.param(after(0.3), None, 2, id="apart"),
    pytest.param(after(0.002), None, 2, id="small, but without noise"),
    # pulses that touch are apart below a twentieth of the peak or half of the smaller
    *(pytest.param(touching(*how), None, n, id=f"touching {how}")
      for *how, n in ((0.04, 0.5, 2), (0.06, 0.5, 1), (0.02, 0.07, 2), (0.04, 0.07, 1))),
    pytest.param(RINGING, None, 1, id="ringing"),
    pytest.param(PUSHED, None, 2, id="a push above the ringing"),
    pytest.param(PUSHED, 0.15, 1, id="a push below what was asked for"),
    pytest.param(BITS, None, 1, id="bits"),
])  # fmt: skip
def test_pulses_are_counted_once_each(force, least, n):
    assert len(triggers.pulses(force, least=least)) == n


def test_noise_is_no_pulse_and_moves_none():
    pulse = np.pad(PULSE, (500, 3000))
    assert triggers.pulses(pulse) == [(501, 510)]
    noisy = pulse + 0.04 * np.random.default_rng(2).standard_normal(len(pulse))
    assert len(triggers.pulses(noisy, least=0.08)) > 1  # without knowledge of the noise
    assert np.abs(np.subtract(triggers.pulses(noisy, 0.04), [(501, 510)])).max() <= 2


def test_a_second_hit_is_found_in_strong_noise():
    force = np.concatenate([np.zeros(900), half_sine(101), np.zeros(100), 0.53 * half_sine(101), np.zeros(900)])
    noisy = force + 0.1 * np.random.default_rng(4).standard_normal(len(force))  # six deviations are 0.6
    assert len(triggers.pulses(np.convolve(noisy, np.ones(16) / 16.0, mode="same"), 0.1)) == 2


def test_noise_is_not_raised_by_taps():
    force = np.random.default_rng(1).normal(0.0, 0.3, 4000)
    force[100:130] += 200.0
    assert abs(triggers.noise(force) / 0.3 - 1.0) < 0.05  # 4 000 samples: 2 % of spread


def test_noise_alone_is_no_tap_and_one_of_ten_deviations_is():
    force = np.random.default_rng(5).normal(size=100_000)  # up to 4.3 deviations
    assert not triggers.find_rooms(force, triggers.level(force), 100)
    force[50_000:50_005] += 12.0
    assert len(triggers.find_rooms(force, triggers.level(force), 100)) == 1


def test_a_ceiling_is_reached_by_several_samples_two_of_them_neighbours():
    low = np.minimum(PULSE, 0.95)  # three samples at the top of each
    assert triggers.ceiling([low, 0.5 * PULSE, low]) == triggers.ceiling([low]) == 0.95
    assert triggers.ceiling([PULSE, PULSE, PULSE]) == np.inf  # three taps of the same peak


def test_a_flat_top_is_clipping_and_a_round_one_is_not():
    pulse = half_sine(101)
    assert not triggers.is_clipped(pulse) and not triggers.is_clipped(np.zeros(9))
    assert triggers.is_clipped(np.minimum(pulse, 0.9)) and triggers.is_clipped(-np.minimum(pulse, 0.9))
    assert triggers.is_clipped(pulse, full_scale=1.0)


def test_a_force_cut_off_before_its_noise_is_told(tmp_path):
    """Cut to 0.6 of its peak, it told responses 1.4 times as large, with a coherence of 0.95 and without a word."""
    rng = np.random.default_rng(0)
    pulses = 100.0 * np.array([np.pad(half_sine(n), (200, 800 - n)) for n in (20, 31, 60)])
    noise = 0.05 * rng.standard_normal((3, 1000))
    for force, cut in ((pulses, False), (np.minimum(pulses, 60.0), True), (np.minimum(pulses, 97.0), None)):
        taps = fi.Taps.from_arrays(force + noise, rate=25600.0)
        assert cut is None or (taps.overload == cut).all()
        taps.save(tmp_path / "t.npz")
        assert (fi.read_taps(tmp_path / "t.npz").overload == taps.overload).all()
    assert not any(triggers.is_saturated(row) for row in (0.0 * pulses[0], np.ones(1000), pulses[0][190:]))


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_a_round_top_in_steps_of_a_fast_converter_is_no_clipping(bits):
    pulse = np.concatenate([np.zeros(50), 0.97 * half_sine(4001) ** 1.3, np.zeros(50)])
    steps = np.round(pulse * 2**bits) / 2**bits  # a hundred and more samples at the top with 8 bits, six with 16
    cut = np.minimum(steps, steps[1500])
    assert not triggers.is_clipped(steps) and triggers.ceiling([steps, 0.5 * steps]) == np.inf
    assert triggers.is_clipped(cut) and triggers.ceiling([cut, 0.5 * steps]) == steps[1500]


def test_a_tap_begins_at_a_twentieth_of_its_peak_whatever_its_offset():
    assert triggers.onset(np.repeat([0.0, 0.03, 0.08, 1.0, 0.0, 0.0], 100)) == 200
    wide = np.pad(half_sine(701), (290, 10))  # over seven tenths of the record
    assert abs(triggers.onset(5.0 + wide) - 302) <= 2


def cut(places, n_times=4000, added=0.0, **options):
    """The taps [10 N] of a record without responses at 1 kHz, and what is said of them."""
    force = np.zeros(n_times)
    force[places] = 10.0
    given = dict.fromkeys(("trigger", "before", "length")) | {"together": 0.05} | options
    rows, *_, notes = triggers.cut_taps([(force + added, np.zeros((n_times, 0)))], 1000.0, "here", **given)
    return rows, " ".join(notes)


@pytest.mark.parametrize(("together", "n"), [(1e-9, 2), (0.002, 1)])
def test_taps_may_be_as_near_as_one_sample_below_the_trigger(together, n):
    """`together` counts for one sample at least."""
    assert len(cut([2000, 2002], together=together, length=0.005)[0]) == n


def test_a_pulse_of_a_tenth_of_a_second_is_no_drift():
    for offset in (0.0, 3.0):
        rows = cut(slice(2010, 2100), added=offset)[0]
        assert np.ptp(rows) == rows.max() == pytest.approx(10.0, rel=1e-3)


def drift(share):
    """A drift [N] of a share of a trigger of 1 N in the 0.12 s of a record."""
    added = share / 0.12 * np.arange(4000) / 1000.0
    return {"places": slice(2000, 2010), "added": added, "trigger": 1.0, "length": 0.12}


@pytest.mark.parametrize(("record", "said", "told"), [
    (drift(0.15), "drift", False), (drift(0.3), "drift", True),  # from a fifth of the trigger on
    # eight samples before a tap, and the three before it that are no rest, give an offset
    ({"places": slice(10, 15), "added": 3.0}, "offsets are not removed", True),
    ({"places": slice(11, 16), "added": 3.0}, "offsets are not removed", False),
])  # fmt: skip
def test_drift_is_told_and_a_missing_rest(record, said, told):
    rows, notes = cut(**record)
    assert told == (said in notes)
    assert rows[0, 0] == pytest.approx(3.0 if told and said != "drift" else 0.0, abs=0.1)


def test_a_short_record_holds_its_tap_and_not_only_what_was_before():
    rows, said = cut(slice(2000, 2005), length=0.016)
    assert rows.shape == (1, 16) and rows.max() == 10.0 and "within a pulse" not in said
    with pytest.raises(ValueError, match=r"length must be longer than before, 0\.02 s, got 0\.016 s"):
        cut(slice(2000, 2005), length=0.016, before=0.02)


def test_a_record_lasts_ten_seconds_at_most():
    assert cut(slice(100, 105), 30_000)[0].shape[1] == 10_000 + 20  # and 0.02 s before the tap


@pytest.mark.parametrize(
    ("places", "widths", "kept"),
    [
        ((50, 50, 196, 50), (12, 30, 12, 12), [0, 1, 3]),  # the third ends within its pulse,
        ((50, 50, 186, 50), (12, 30, 12, 12), [0, 1, 3]),  # or too soon after it for the second
        ((50, 50, -3), (12, 30, 12), [0, 1]),
        ((-3, -3), (12, 30), [0, 1]),
    ],
    ids=["ends within", "ends after", "begins within", "all begin within"],
)
def test_a_record_that_ends_early_cuts_no_other_one_short(places, widths, kept):
    force = np.zeros((len(places), 400))
    for row, at, width in zip(force, places, widths):
        row[100 + at : 100 + at + width] = 50.0 * half_sine(width + 2)[1:-1]
    given = dict.fromkeys(("trigger", "before", "length")) | {"together": 0.05}
    rows, *_, labels, _ = triggers.cut_taps([(row[100:300], np.zeros((200, 0))) for row in force], 1e4, "here", **given)
    assert labels == [f"tap {i + 1}" for i in kept]
    *_, notes = triggers.cut_taps([(row, np.zeros((400, 0))) for row in (force[0], -force[0])], 1e4, "here", **given)
    assert any(note.startswith("no tap above") and note.endswith("N in record 2") for note in notes)
    assert triggers.cut_short(rows).tolist() == [places[i] < 0 for i in kept]
