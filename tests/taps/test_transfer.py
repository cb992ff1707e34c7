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


def test_modes_are_paired_by_shape_although_their_order_changed(body):
    other = fi.Modes.from_arrays(
        [170.0, 200.0, 660.0], [[0.1, 1.2, 0.9], [1.3, 0.7, -1.1]], points=[[0.0], [1.0]], mass=1.0, complete=True
    )
    pairs = fi.matched(body, other)
    assert [pair.computed for pair in pairs] == [1, 2] and all(pair.mac > 0.999 for pair in pairs)
    assert pairs[0].difference == pytest.approx(200.0 / 180.0 - 1.0)
    assert "+11.11 %" in transfer.table(pairs)
    alone = fi.matched([100.0, 200.0, 310.0], [99.0, 150.0, 205.0, 300.0])
    assert [pair.computed for pair in alone] == [0, 2, 3]
    with pytest.raises(ValueError, match="at least the 3 modes of"):
        fi.matched([1.0, 2.0, 3.0], [1.0, 2.0])


@pytest.mark.slow
def test_universal_files_keep_taps_and_functions(body, tmp_path):
    pytest.importorskip("pyuff")
    taps = fi.Taps.from_arrays(
        np.concatenate([tap.force for tap in taps_of(body, 0.0, n=2, duration=0.1)]),
        np.concatenate([tap.response for tap in taps_of(body, 0.0, n=2, duration=0.1)]), rate=RATE,
    )  # fmt: skip
    transfer.write_uff(tmp_path / "t.uff", taps)
    again = fi.read_taps(tmp_path / "t.uff")
    assert again.n_taps == 2 and again.rate == RATE
    assert np.allclose(again.peak, taps.peak, rtol=1e-4)
    found = fi.frf(taps)
    transfer.write_uff(tmp_path / "h.uff", found)
    back = transfer.read_frf(tmp_path / "h.uff")
    assert np.allclose(back.H.values, found.H.values, rtol=1e-4, atol=1e-6)
    with pytest.raises(
        ValueError, match=r"holds time records \(data set 58, function type 1\), no frequency responses"
    ):
        fi.frf(tmp_path / "t.uff")


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
        universal_files.arrays(path, "z")
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
