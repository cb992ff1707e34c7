"""Frequency responses against closed forms, and modes that belong together."""

import numpy as np
import pytest
import xarray as xr

import fem_impact as fi
from fem_impact import cli
from fem_impact.modes import universal_files
from fem_impact.taps import readers, transfer

RATE = 12800.0  # [Hz]


@pytest.fixture(scope="module")
def body():
    return fi.Modes.from_arrays(
        [180.0, 640.0], [[1.2, 0.9], [0.7, -1.1]], points=[[0.0], [1.0]], mass=1.0, damping_ratio=0.02, complete=True
    )


def taps_of(body, noise, n=4, duration=0.8):
    hits = [
        fi.strike(body, fi.Striker.rigid(0.02), fi.Contact.linear(1e5), at=[0.0], speed=1.0 + i, tolerance=1e-5)
        for i in range(n)
    ]
    return [fi.measure(h, rate=RATE, at=[[1.0]], noise=noise, rng=i, duration=duration) for i, h in enumerate(hits)]


@pytest.mark.parametrize("method", ["H1", "H2"])
def test_taps_give_the_accelerance_of_the_modes(body, method):
    found = fi.frf(taps_of(body, 0.0), method=method)
    frequencies = found.frequency.values
    band = (frequencies > 50.0) & (frequencies < 1200.0)
    exact = fi.mobility(body, [0.0], [1.0], frequencies[band], "accelerance")
    assert np.abs(found.H.values[band, 0] - exact).max() < 2e-3 * np.abs(exact).max()  # its tail beyond the record
    assert found.coherence.values[band].min() > 0.999 and found.attrs["averages"] == 4
    assert str(found.units.values[0]) == "m/s^2/N"


def test_noise_lowers_the_coherence_and_biases_h1_and_h2_apart(body):
    taps = taps_of(body, 0.05, n=8)
    one, two = (fi.frf(taps, method=method) for method in ("H1", "H2"))
    band = (one.frequency.values > 50.0) & (one.frequency.values < 1200.0)
    ratio = np.abs(one.H.values / two.H.values)[band, 0]
    assert np.allclose(ratio, one.coherence.values[band, 0], rtol=1e-9)  # H1 / H2 is the coherence
    assert one.coherence.values[band].mean() < 0.999


def test_windows(body):
    taps = taps_of(body, 0.02)
    plain, windowed = fi.frf(taps), fi.frf(taps, force_window=5e-3)
    band = (plain.frequency.values > 100.0) & (plain.frequency.values < 900.0)  # the force has no power at 1080 Hz
    exact = fi.mobility(body, [0.0], [1.0], plain.frequency.values[band], "accelerance")
    error = [np.linalg.norm(one.H.values[band, 0] - exact) for one in (plain, windowed)]
    assert error[1] < error[0]  # the noise of the force after the tap is gone
    faded = fi.frf(taps_of(body, 0.0), response_window=0.1)
    more = body.damped(body.damping_ratio + 1.0 / (0.1 * body.omega))
    wanted = fi.mobility(more, [0.0], [1.0], plain.frequency.values[band], "accelerance")
    assert np.abs(np.abs(faded.H.values[band, 0]) - np.abs(wanted)).max() < 0.03 * np.abs(wanted).max()
    assert faded.attrs["added_damping"] == 10.0


def records(body, *, double, noise=(0.0, 0.0), n=4, seed=0, delay=6e-3):
    """Taps of half sines of 2 ms, or of two, of which the second is 0.9 of the first; the body answers exactly."""
    rng, n_times, rows = np.random.default_rng(seed), 10240, []
    time, frequencies = np.arange(n_times) / RATE - 0.01, np.fft.rfftfreq(n_times, 1.0 / RATE)
    H = np.append(0.0, fi.mobility(body, [0.0], [1.0], frequencies[1:], "accelerance"))
    for i in range(n):
        starts = (0.0, delay + 7e-4 * i) if double else (0.0,)
        force = sum((0.9**k) * np.sin(np.pi * np.clip((time - t) / 2e-3, 0.0, 1.0)) for k, t in enumerate(starts))
        response = np.fft.irfft(H * np.fft.rfft(force), n_times)
        rows.append([x + size * np.abs(x).max() * rng.standard_normal(n_times)
                     for x, size in zip((force, response), noise)])  # fmt: skip
    force, response = np.moveaxis(np.array(rows), 1, 0)
    return fi.Taps.from_arrays(force, response, rate=RATE), frequencies[40:480], H[40:480]  # 50 to 600 Hz


@pytest.mark.parametrize("double", [False, True])
@pytest.mark.parametrize(("noise", "n"), [((0.0, 0.01), 4), ((0.003, 0.0), 4), ((0.003, 0.003), 1), ((0.0, 0.01), 2)])
def test_the_true_response_lies_within_the_error_stated_in_nine_lines_of_ten(body, double, noise, n):
    inside = []
    for seed in range(5):
        taps, _, exact = records(body, double=double, noise=noise, n=n, seed=seed)
        found = fi.frf(taps)
        inside.append(np.abs(found.H.values[40:480, 0] - exact) <= found.error.values[40:480, 0])
    # 2 200 lines tell it to 0.007, and the noise before one tap is known to a tenth from its 125 samples; to first
    # order of the force's noise, which in the holes of one double hit is half the force: 0.87 there
    assert np.mean(inside) == pytest.approx(0.9, abs=0.04)


def test_a_second_pulse_costs_only_where_the_spectrum_of_the_force_has_holes(body):
    """Taps with other delays fill each other's holes; the error stated of one tap is large in its own."""
    errors = {}
    for double in (False, True):
        taps, _, exact = records(body, double=double, noise=(0.0, 0.01))
        found = fi.frf(taps)
        apart = np.abs(found.H.values[40:480, 0] - exact)
        errors[double] = np.linalg.norm(apart) / np.linalg.norm(exact)
        alone = fi.frf(taps.pick(0))
        # 1.8 of the force where both pulses agree, 0.1 where they cancel
        force, stated = alone.force.values[40:480], alone.error.values[40:480, 0] / np.abs(alone.H.values[40:480, 0])
        assert not double or stated[force.argmin()] > 5.0 * np.median(stated)
    # 1.81 of the mean square of one pulse, less in holes: 0.94 to 1.03 over six seeds
    assert errors[True] < 1.1 * errors[False] < 0.05


def test_the_window_of_the_force_keeps_every_pulse(body):
    taps, _, exact = records(body, double=True, n=1)
    whole, windowed = fi.frf(taps), fi.frf(taps, force_window=4e-3)  # a window of the first pulse alone ends before
    band = np.abs(whole.force.values) > 0.1 * whole.force.values.max()  # the second
    assert np.abs(windowed.force.values - whole.force.values)[band].max() < 1e-3 * whole.force.values.max()
    assert np.linalg.norm(windowed.H.values[40:480, 0] - exact) < 1e-2 * np.linalg.norm(exact)


def test_the_error_of_one_tap_is_not_known_without_a_rest_before_it(body):
    taps = records(body, double=True, noise=(0.0, 0.01))[0].between(9.6e-3, 0.5)
    assert np.isnan(fi.frf(taps.pick(0)).error.values).all() and np.isfinite(fi.frf(taps).error.values).all()


def test_h2_is_wrong_by_the_noise_of_the_response(body):
    taps, _, exact = records(body, double=False, noise=(0.0, 0.1))
    one, two = (fi.frf(taps, method=method) for method in ("H1", "H2"))
    bias = np.median(np.abs(two.H.values[40:480, 0] / exact)) - 1.0
    assert 0.0 < bias < np.median(two.error.values[40:480, 0] / np.abs(two.H.values[40:480, 0]))
    assert (two.error.values > one.error.values)[40:480].mean() > 0.9


def test_modes_are_paired_by_shape_although_their_order_changed(body):
    other = fi.Modes.from_arrays(
        [170.0, 200.0, 660.0], [[0.1, 1.2, 0.9], [1.3, 0.7, -1.1]], points=[[0.0], [1.0]], mass=1.0, complete=True
    )
    pairs = fi.matched(body, other)
    assert [pair.computed for pair in pairs] == [1, 2] and all(pair.mac > 0.999 for pair in pairs)
    assert pairs[0].difference == pytest.approx(200.0 / 180.0 - 1.0)
    assert "+11.11 %" in transfer.pair_table(pairs)
    alone = fi.matched([100.0, 200.0, 310.0], [99.0, 150.0, 205.0, 300.0])
    assert [pair.computed for pair in alone] == [0, 2, 3]
    with pytest.raises(ValueError, match="at least the 3 modes of"):
        fi.matched([1.0, 2.0, 3.0], [1.0, 2.0])


@pytest.mark.slow
def test_universal_files_keep_functions(body, tmp_path):
    pytest.importorskip("pyuff")
    found = fi.frf(taps_of(body, 0.0, n=2, duration=0.1))
    transfer.write_uff(tmp_path / "h.uff", found)
    back = transfer.read_frf(tmp_path / "h.uff")
    assert np.allclose(back.H.values, found.H.values, rtol=1e-4, atol=1e-6)


def oscillator(path):
    """A universal file with the mobility-like response of an oscillator at 99 Hz; the response and its data set."""
    pyuff = pytest.importorskip("pyuff")
    frequency = np.arange(1.0, 401.0)
    made = xr.Dataset(
        {"H": (("frequency", "channel"), 1.0 / (100.0**2 - frequency**2 + 20j * frequency)[:, None])},
        {"frequency": frequency, "channel": ["tip"], "units": ("channel", ["m/s/N"])},
    )
    transfer.write_uff(path, made)
    return made, pyuff.UFF(str(path)).read_sets(0)


def test_frequency_responses_of_a_universal_file_are_read_or_named(tmp_path):
    path = tmp_path / "h.uff"
    made, one = oscillator(path)
    plain = transfer.arrays(path)
    assert np.allclose(plain["H"], made.H, rtol=1e-4) and "coherence" not in plain and plain["units"] == ["m/s/N"]
    with pytest.raises(
        ValueError, match=r"holds frequency responses \(data set 58, function type 4\), no time records"
    ):
        readers.arrays(path)
    with pytest.raises(ValueError, match="58, of which 58 are time records or frequency responses"):
        universal_files.arrays(path)
    feet = {"type": 164, "units_code": 2, "units_description": "foot", "temp_mode": 1, "length": 2.0, "force": 0.5,
            "temp": 1.0, "temp_offset": 1.0}  # fmt: skip
    sure = one | {"func_type": 6, "ord_data_type": 4, "data": np.full(400, 0.75)}
    scaled = transfer.arrays(written(path, feet, one, sure))
    assert np.allclose(scaled["H"], 0.25 * made.H, rtol=1e-4) and (scaled["coherence"] == 0.75).all()
    with pytest.raises(ValueError, match="responses at other frequencies for 'tip' than for 'tip'"):
        transfer.arrays(written(path, one, one | {"x": 2.0 * one["x"], "abscissa_inc": 2.0}))
    with pytest.raises(ValueError, match="a response 'tip' that is no motion per force"):
        transfer.arrays(written(path, one | {"ordinate_spec_data_type": 2}))


def written(path, *sets):
    pytest.importorskip("pyuff").UFF(str(path)).write_sets(list(sets), mode="overwrite")
    return path


@pytest.mark.slow
def test_the_prompt_lists_peaks_of_frequency_responses_in_a_file(tmp_path, capsys):
    made, _ = oscillator(tmp_path / "h.uff")
    assert cli.main(["frf", str(tmp_path / "h.uff"), "--out", str(tmp_path / "h.csv")]) == 0
    assert "99 Hz" in capsys.readouterr().out
    assert np.loadtxt(tmp_path / "h.csv", delimiter=",", skiprows=1)[:, 1] == pytest.approx(
        made.H.values[:, 0].real, rel=1e-3
    )


def test_wrong_records_are_refused(body):
    with pytest.raises(ValueError, match="must have a response"):
        fi.frf(fi.Taps.from_arrays(np.zeros(40), rate=1e3))
    with pytest.raises(ValueError, match="method must be one of"):
        fi.frf(taps_of(body, 0.0, n=1), method="H3")
    with pytest.raises(ValueError, match="at the same points"):
        fi.mac(np.zeros((2, 2)), np.zeros((3, 2)))
