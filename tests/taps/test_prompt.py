"""The commands for measured taps, and scene files that strike with what was found."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import fem_impact as fi
from fem_impact import cli
from fem_impact.taps import prompt

ROOT = Path(__file__).parents[2]
TAPS = ROOT / "studies" / "measured" / "acceleration_multi.lvm"
LAW = fi.Contact.hertz(2e8)


def test_fit_writes_a_page_numbers_and_a_scene(tmp_path, capsys):
    words = ["--unknown", "contact.stiffness=1e5:1e13", "--unknown", "contact.exponent=1:3", "--mass", "0.15"]
    words += ["--per-tap", "contact.stiffness"]
    assert cli.main(["fit", str(TAPS), "--out", str(tmp_path / "out"), *words]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "4 taps explained to" in said and "90 % interval" in said
    data = json.loads((tmp_path / "out" / "fit.json").read_text())
    assert len(data["per_tap"]["contact.stiffness"]["values"]) == 4 and "mean of the taps" in said
    assert data["values"]["contact.exponent"] > 1.0 and len(data["left_out"]) == 4
    assert (tmp_path / "out" / "fit.html").stat().st_size > 5e4
    assert fi.load_scene(tmp_path / "out" / "scene.toml").make_striker().mass == pytest.approx(0.15)


def test_frf_of_a_file_lists_peaks_and_writes_a_table(tmp_path, capsys):
    assert cli.main(["frf", str(TAPS), "--out", str(tmp_path / "h.csv")]) == 0
    assert "m/s^2/N" in capsys.readouterr().out
    rows = np.genfromtxt(tmp_path / "h.csv", delimiter=",", skip_header=1)
    assert rows.shape[1] == 5 and rows[-1, 0] == pytest.approx(12800.0, rel=0.01)


@pytest.mark.slow
def test_frf_of_a_scene_finds_its_modes(tmp_path, capsys):
    scene = ROOT / "studies" / "scenes" / "drumstick.toml"
    assert cli.main(["frf", str(scene), "--rate", "12800"]) == 0
    first = fi.load_scene(scene).modes(1).frequencies[0]
    peaks = [float(line.split()[2]) for line in capsys.readouterr().out.splitlines()[1:] if "Hz" in line]
    assert min(abs(peak - first) for peak in peaks) < 2.0  # 1 s of record resolves 1 Hz


@pytest.mark.slow
def test_fit_proposes_the_model_and_lists_what_was_tried(tmp_path, capsys):
    assert cli.main(["fit", str(TAPS), "--propose", "--mass", "0.15", "--out", str(tmp_path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert {"linear", "Hertz"} < {each["name"] for each in data["tried"]} == set(data["compared"])
    best = [each for each in data["tried"] if each["taken"]][-1]
    errors = np.sqrt(np.mean(np.square(data["left_out"])))
    assert best["left_out"] == pytest.approx(errors, rel=0.05) and errors < 0.01  # 0.73 and 0.72 % measured: the
    # profiles met a better fit
    assert data["summary"][0].split()[:2] == ["model", "unknowns"] and (tmp_path / "fit.html").is_file()


@pytest.mark.parametrize(
    "words, said",
    [(["--unknown", "contact.stiffness=3"], "must read NAME=LOW:HIGH"),
     (["--propose", "--known", "striker.mass=0.1"], "--known must be left out beside --propose"),
     (["--propose", "--per-tap", "striker.mass"], "--per-tap must be left out"),
     (["--unknown", "tip=1:2"], "must be one of"),
     (["--known", "striker.mass=x"], "must read NAME=VALUE"), (["--force", "hammer"], "is no channel")],
)  # fmt: skip
def test_wrong_commands_say_what_is_wrong(words, said, tmp_path, capsys):
    assert cli.main(["fit", str(TAPS), "--out", str(tmp_path / "out"), *words]) == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()


def test_a_single_tap_is_fitted_too(tmp_path, capsys):
    words = ["--response", "Acceleration", "--unknown", "contact.stiffness=1e5:1e13", "--json"]
    single = TAPS.with_name("acceleration.lvm")
    assert cli.main(["fit", str(single), "--out", str(tmp_path / "out"), *words]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["left_out"] == [] and data["intervals"]["contact.stiffness"][0] > 1e5


def test_peaks_of_five_times_their_surroundings_are_listed_and_lower_ones_are_not():
    frequency = np.arange(400.0)
    size = 1.0 + 7.0 * np.exp(-(((frequency - 100.0) / 3.0) ** 2)) + 2.0 * np.exp(-(((frequency - 250.0) / 3.0) ** 2))
    found = xr.Dataset(
        {"H": (("frequency", "channel"), size[:, None].astype(complex)),
         "coherence": (("frequency", "channel"), np.ones((400, 1))), "units": ("channel", ["m/s^2/N"])},
        {"frequency": frequency, "channel": ["a"]},
    )  # fmt: skip
    assert [each["frequency"] for each in prompt.peaks(found)] == [100.0]


@pytest.fixture(scope="module")
def found():
    wall = [fi.Touch(LAW, 0, None)]
    hits = [fi.collide([fi.Modes.rigid(0.1)], wall, speeds=[v]) for v in (0.5, 1.0)]
    taps = [fi.measure(hit, rate=25600.0, noise=1e-3, rng=i) for i, hit in enumerate(hits)]
    ranges = {"contact.stiffness": (1e6, 1e10)}
    return fi.fit(taps, striker=fi.Striker.rigid(0.1), contact=LAW, unknown=ranges, starts=1)


def test_a_wall_becomes_a_scene_with_the_same_blow(found, tmp_path):
    assert prompt.write_scene(tmp_path / "s.toml", found) == ()
    hit = fi.load_scene(tmp_path / "s.toml").strike()
    same = fi.collide([fi.Modes.rigid(0.1)], [fi.Touch(found.contact, 0, None)], speeds=[hit.speed])
    assert hit.peak_force == pytest.approx(same.peak_force, rel=1e-3)  # the tolerance is 1e-4
    assert hit.speed == pytest.approx(0.75, rel=0.01)
    assert "90 % interval" in (tmp_path / "s.toml").read_text()


def test_the_body_of_a_scene_is_kept(found, tmp_path):
    scene = fi.load_scene(ROOT / "studies" / "scenes" / "drumstick.toml")
    prompt.write_scene(tmp_path / "s.toml", found, scene)
    again = fi.load_scene(tmp_path / "s.toml")
    assert again.data()["mesh"] == scene.data()["mesh"]
    assert again.make_striker().mass == pytest.approx(0.1) and again.make_contact().exponent == 1.5


def test_an_unknown_structure_needs_a_scene(found):
    body = fi.Modes.from_arrays([500.0], [[1.0]], points=[[0.0]], mass=1.0, complete=True)
    hit = fi.strike(body, fi.Striker.rigid(0.1), LAW, at=[0.0], speed=1.0)
    taps = [fi.measure(hit, rate=25600.0)]
    made = fi.fit(
        taps, target=body, at=[0.0], striker=fi.Striker.rigid(0.1), contact=LAW, starts=1,
        unknown={"contact.stiffness": (1e6, 1e10)},
    )  # fmt: skip
    with pytest.raises(ValueError, match="scene must be given"):
        prompt.scene_tables(made)
