"""The table of taps: what is found in real records, and what is said about it."""

import numpy as np
import pytest
from comparing import refusing
from hammer_taps import RATE, said
from scenes import MEASURED

import fem_impact as fi

pytestmark = pytest.mark.usefixtures("read_here")


def test_four_segments_with_decimal_points():
    taps = fi.read_taps(MEASURED / "acceleration_multi.lvm")
    assert taps.n_taps == 4 and taps.rate == RATE and taps.units == ("m/s^2",)
    assert np.allclose(taps.peak, [131.8, 212.4, 191.3, 221.5], atol=0.3)  # N, as the files' own description has them
    assert (taps.n_pulses == 1).all() and not taps.table.overload.any() and said(taps, "offsets")


@pytest.mark.parametrize("name, peak, cut", [("acceleration", 196.0, False), ("camera", 422.0, True)])
def test_decimal_commas_and_empty_times(name, peak, cut):
    taps = fi.read_taps(MEASURED / f"{name}.lvm")
    assert taps.n_taps == 1 and taps.rate == 50e3
    assert abs(taps.peak[0] - peak) < 1.0  # N
    assert taps.units == ("m/s^2",) and np.abs(taps.response).max() > 100.0  # given in g
    assert not taps.overload[0] and bool(taps.table.overload[0, 1]) == cut  # 54.79 g, three times in a row
    assert said(taps, "cut off") == cut


def record(*places, noise=0.05, offset=2.0):
    """A second of noise, with half sines of 100 N and 13 samples at some places."""
    force = np.random.default_rng(0).normal(offset, noise, 25600)
    for place in places:
        force[place : place + 13] += 100.0 * np.sin(np.pi * (np.arange(13) + 0.5) / 13)
    return force


@pytest.fixture
def read(tmp_path):
    def read(samples, /, other=(), **options):
        np.savez(tmp_path / "t.npz", force=samples, rate=RATE, **dict(other))
        return fi.read_taps(tmp_path / "t.npz", **options)

    return read


def test_taps_are_found_in_a_long_record_and_double_hits_stay_together(read):
    force = record(5000, 12000, 12200, 20000)
    force[12200:12213] -= 0.6 * (force[12200:12213] - 2.0)
    taps = read(force)
    assert taps.n_pulses.tolist() == [1, 2, 1] and said(taps, "tap 2: more than one pulse")
    assert np.allclose(taps.force[:, :300].mean(axis=1), 0.0, atol=0.02)  # the offset is gone
    assert read(force, together=2e-3).n_taps == 4


@pytest.mark.parametrize("resonance", [None, 8e3])
def test_a_second_touch_of_a_twentieth_is_told_from_the_ringing_of_a_rig(resonance):
    plate = fi.analytic.rectangle(1.0, 0.7, mass=2.0, first_frequency=60.0, n_modes=150, damping_ratio=0.01)
    ball, law = fi.Striker.rigid(0.1), fi.Contact.hertz(2e8)
    hit = fi.strike(plate, ball, law, at=(0.31, 0.27), speed=1.0, tolerance=1e-2)
    assert hit.n_impacts == 2 and hit.impacts[1].peak_force < 0.05 * hit.peak_force
    wall = fi.strike(fi.Modes.rigid(1e4), ball, law, at=None, speed=1.0)
    rig = {"rate": RATE, "resonance": resonance, "resonance_damping": 0.03, "noise": 1e-3, "rng": 1}
    assert [int(fi.measure(each, **rig).n_pulses[0]) for each in (hit, wall)] == [2, 1]


@pytest.mark.parametrize("noise", [0.0, 5e-3])
def test_a_second_rise_of_seven_hundredths_is_a_pulse_above_the_noise_of_its_record(noise):
    first, second = np.zeros((2, 400))
    first[50:63] = np.sin(np.pi * (np.arange(13) + 0.5) / 13)
    second[90:110] = 0.07 * np.sin(np.pi * (np.arange(20) + 0.5) / 20)
    rows = np.array([first, first + second]) + noise * np.random.default_rng(2).standard_normal((2, 400))
    taps = fi.Taps.from_arrays(100.0 * rows, rate=RATE)
    assert taps.n_pulses.tolist() == [1, 2]
    assert taps.impulse[1] / taps.impulse[0] == pytest.approx(1.108, abs=0.02)  # 7 % for 20 samples instead of 13
    told = fi.Taps.from_arrays(taps.force, rate=RATE, pulse=10.0)
    assert told.n_pulses.tolist() == told.pick([0, 1]).n_pulses.tolist() == [1, 1]


def test_a_force_that_pulls_is_turned_around(read):
    taps = read(-record(5000, offset=0.0))
    assert taps.peak[0] > 99.0 and said(taps, "turned around")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_spike_larger_than_the_tap_does_not_turn_its_force_around(read, sign):
    force = record(5000, noise=0.02, offset=0.0)
    force[4000] = -1.5 * force.max()
    taps = read(sign * force)
    assert taps.peak[0] == pytest.approx(force.max(), rel=1e-2) and said(taps, "turned around") == (sign < 0.0)


@pytest.mark.parametrize(("top", "options", "cut"), [(80.0, {}, True), (200.0, {}, False),
                                                     (200.0, {"full_scale": 90.0}, True)])  # fmt: skip
def test_clipping_and_full_scale_are_seen(read, top, options, cut):
    assert read(np.minimum(record(5000, noise=0.02), top), **options).overload.tolist() == [cut]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_force_of_nothing_is_told_as_that(read, sign):
    with pytest.raises(ValueError, match="its force does not change"):
        read(sign * np.zeros(5000))


def test_a_response_that_does_not_change_is_told(tmp_path):
    force = np.pad(80.0 * np.sin(np.linspace(0.0, np.pi, 9)), 40)
    table = np.column_stack([force, np.full(len(force), 5.0), np.cumsum(force)])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="Force [N],a1 [g],a2 [g]", comments="")
    (note,) = (note for note in fi.read_taps(tmp_path / "a.csv", rate=1e4).notes if "dead" in note)
    assert note.startswith("a1: does not change during a tap, as a dead channel; leave it out")


@pytest.mark.parametrize(("options", "text"), [
    ({}, "no tap was found"), ({"force": "forse"}, r"'forse' is no channel.*did you mean 'force'"),
    ({"force": 7}, "channel from 0 to 1"), ({"units": {"force": "pounds"}}, "units must be one of"),
    ({"units": {1: 2}}, "units must be a dict of names"),
])  # fmt: skip
def test_silence_and_wrong_names_are_refused(read, options, text):
    quiet = np.random.default_rng(0).normal(0.0, 1.0, 5000)
    with pytest.raises(ValueError, match=text):
        read(quiet, other={"other": quiet}, **options)


@pytest.mark.parametrize(
    ("names", "read"),
    [(("acc", "acc"), ("acc 1", "acc 2")), (("hammer acc", "input"),) * 2, (("t", "force"),) * 2],
)
def test_saved_taps_keep_channels_of_any_names(tmp_path, names, read):
    pulse = np.pad(np.hanning(20), (50, 130))
    response = np.column_stack([np.sin(np.arange(200.0)), np.cos(np.arange(200.0))])[None]
    taps = again = fi.Taps.from_arrays(pulse, response, rate=1e4, names=names, units=["m/s", "m/s"])
    for _ in range(2):
        again.save(tmp_path / "t.npz")
        again = fi.read_taps(tmp_path / "t.npz")
        assert tuple(again.table["channel"].values) == read and again.units == taps.units
    assert np.allclose(np.ptp(again.response, axis=1), np.ptp(response, axis=1)) and np.allclose(again.force, pulse)


test_arrays_of_wrong_shape_are_refused = refusing([
    (((2, 3),), {}, "at least one tap"), (((2, 30), (2, 29)), {}, "response must have shape"),
    (((2, 30), (2, 30)), {"names": ["a", "b"]}, "names must have 1 entries, one for each response"),
    (((2, 30), (2, 30)), {"names": "a"}, "names must be a list of texts"),
    (((2, 30),), {"pulse": 0.0}, "pulse must be positive"),
], lambda arrays, options: fi.Taps.from_arrays(*map(np.zeros, arrays), rate=1e3, **options))  # fmt: skip


def test_parts_of_a_table():
    taps = fi.read_taps(MEASURED / "acceleration_multi.lvm")
    two, cut = taps.pick([0, 2]), taps.between(5e-4, 2e-3)
    assert two.labels == ("tap 1", "tap 3") and np.array_equal(two.force[1], taps.force[2])
    assert cut.time[[0, -1]] == pytest.approx([0.0, 1.5e-3], abs=1 / RATE)
    assert np.allclose(cut.onset, taps.onset - 5e-4, atol=1 / RATE) and np.allclose(cut.peak, taps.peak)


@pytest.mark.parametrize(("first", "cut"), [(0.22, False), (0.45, True)])
def test_a_record_that_begins_well_within_a_pulse_cuts_it(first, cut):
    """A rest of less than 0.3 of the peak is left by a filter or a late trigger; one that lacks more has no time."""
    pulse = 100.0 * np.sin(np.linspace(np.arcsin(first**0.5), np.pi, 14)) ** 2
    assert fi.Taps.from_arrays(np.append(pulse, np.zeros(100)), rate=RATE).cut_short[0] == cut
