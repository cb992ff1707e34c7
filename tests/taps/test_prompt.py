"""The commands for measured taps, and scene files that strike with what was found."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scenes import MEASURED, SHIPPED

import fem_impact as fi
from fem_impact.taps import prompt

TAPS, DRUMSTICK = MEASURED / "acceleration_multi.lvm", SHIPPED / "drumstick.toml"
LAW = fi.Contact.hertz(2e8)
GIVEN = {"striker": fi.Striker.rigid(0.1), "contact": LAW, "unknown": {"contact.stiffness": (1e6, 1e10)}}
pytestmark = pytest.mark.usefixtures("read_here")


def test_fit_writes_a_page_numbers_and_a_scene(prompt):
    words = ["--unknown", "contact.stiffness=1e5:1e13", "--mass", "0.15", "--per-tap", "contact.stiffness"]
    ran = prompt("fit", TAPS, "--out", "out", *words)
    said = " ".join(ran.out.split())
    assert ran.status == 0 and "4 taps explained to" in said and "90 % interval" in said
    data = json.loads(Path("out/fit.json").read_text())
    assert len(data["per_tap"]["contact.stiffness"]["values"]) == 4 and "mean of the taps" in said
    assert data["values"]["contact.stiffness"] > 1e5 and len(data["left_out"]) == 4
    assert Path("out/fit.html").stat().st_size > 5e4
    assert fi.load_scene("out/scene.toml").make_striker().mass == pytest.approx(0.15)


def test_frf_of_a_file_lists_peaks_and_writes_a_table(prompt):
    ran = prompt("frf", TAPS, "--out", "h.csv")
    assert ran.status == 0 and "m/s^2/N" in ran.out
    rows = np.genfromtxt("h.csv", delimiter=",", skip_header=1)
    assert rows.shape[1] == 5 and rows[-1, 0] == pytest.approx(12800.0, rel=0.01)


def test_a_scene_to_compare_with_needs_a_page_and_responses_a_known_ending(prompt):
    ran = prompt("frf", TAPS, "--against", "no.toml", "--out", "frf.csv")
    assert ran.status == 2 and "give --out a folder, or a name that ends in .html" in ran.err
    ran = prompt("frf", "no.lvm", "--out", "frf.xyz")
    assert ran.status == 2 and "must be one of .csv, .uff, .html, got '.xyz'" in ran.err


@pytest.mark.slow
def test_frf_of_a_scene_finds_its_modes(prompt):
    ran = prompt("frf", DRUMSTICK, "--rate", "12800")
    first = fi.load_scene(DRUMSTICK).modes(1).frequencies[0]
    peaks = [float(line.split()[2]) for line in ran.out.splitlines()[1:] if "Hz" in line]
    assert ran.status == 0 and min(abs(peak - first) for peak in peaks) < 2.0  # 1 s of record resolves 1 Hz


@pytest.mark.slow
def test_fit_proposes_the_model_and_lists_what_was_tried(prompt):
    taps = fi.read_taps(TAPS)
    replace(taps, table=taps.table.isel(tap=slice(0, 2))).save("two.npz")  # of all four it takes four times as long
    ran = prompt("fit", "two.npz", "--propose", "--mass", "0.15", "--out", "out", "--json")
    assert ran.status == 0
    data = ran.json
    assert {"linear", "Hertz"} < {each["name"] for each in data["tried"]} == set(data["compared"])
    best = [each for each in data["tried"] if each["taken"]][-1]
    errors = np.sqrt(np.mean(np.square(data["left_out"])))
    # 0.68 % measured; the profiles may meet a better fit
    assert best["left_out"] == pytest.approx(errors, rel=0.05) and errors < 0.01
    assert data["summary"][0].split()[:2] == ["model", "unknowns"] and Path("out/fit.html").is_file()


@pytest.mark.parametrize(
    "words, said",
    [(["--unknown", "contact.stiffness=3"], "must read NAME=LOW:HIGH"),
     (["--propose", "--known", "striker.mass=0.1"], "--known must be left out beside --propose"),
     (["--propose", "--per-tap", "striker.mass"], "--per-tap must be left out"),
     (["--known", "striker.mass=x"], "must read NAME=VALUE"), (["--force", "hammer"], "is no channel"),
     (["--mass", "0"], "mass must be positive, got 0 kg")],
)  # fmt: skip
def test_wrong_commands_say_what_is_wrong(words, said, prompt):
    ran = prompt("fit", TAPS, "--out", "out", *words)
    assert ran.status == 2 and said in " ".join(ran.err.split()) and not Path("out").exists()


def test_a_single_tap_is_fitted_too(prompt):
    words = ["--response", "Acceleration", "--unknown", "contact.stiffness=1e5:1e13", "--json"]
    ran = prompt("fit", TAPS.with_name("acceleration.lvm"), "--out", "out", *words)
    assert ran.status == 0 and ran.json["left_out"] == [] and ran.json["intervals"]["contact.stiffness"][0] > 1e5


def test_peaks_of_five_times_their_surroundings_are_listed_and_lower_ones_are_not():
    frequency = np.arange(400.0)
    size = 1.0 + sum(high * np.exp(-(((frequency - at) / 3.0) ** 2)) for at, high in ((100.0, 7.0), (250.0, 2.0)))
    found = xr.Dataset(
        {"H": (("frequency", "channel"), size[:, None].astype(complex)),
         "coherence": (("frequency", "channel"), np.ones((400, 1))), "units": ("channel", ["m/s^2/N"])},
        {"frequency": frequency, "channel": ["a"]},
    )  # fmt: skip
    assert [each["frequency"] for each in prompt.peaks(found)] == [100.0]
    unsure = [found.assign(error=(("frequency", "channel"), np.full((400, 1), error))) for error in (7.0, 9.0, np.nan)]
    assert [len(prompt.peaks(each)) for each in unsure] == [1, 0, 1]  # a peak smaller than its error is none


@pytest.fixture(scope="module")
def found():
    hits = [fi.collide([fi.Modes.rigid(0.1)], [fi.Touch(LAW, 0, None)], speeds=[v]) for v in (0.5, 1.0)]
    taps = [fi.measure(hit, rate=25600.0, noise=1e-3, rng=i) for i, hit in enumerate(hits)]
    return fi.fit(taps, starts=1, **GIVEN)


def test_a_wall_becomes_a_scene_with_the_same_blow(found, tmp_path):
    assert prompt.write_scene(tmp_path / "s.toml", found) == ()
    hit = fi.load_scene(tmp_path / "s.toml").strike()
    same = fi.collide([fi.Modes.rigid(0.1)], [fi.Touch(found.contact, 0, None)], speeds=[hit.speed])
    assert hit.peak_force == pytest.approx(same.peak_force, rel=1e-3)  # the tolerance is 1e-4
    assert hit.speed == pytest.approx(0.75, rel=0.01)
    assert "90 % interval" in (tmp_path / "s.toml").read_text()


def test_the_body_of_a_scene_is_kept(found, tmp_path):
    scene = fi.load_scene(DRUMSTICK)
    prompt.write_scene(tmp_path / "s.toml", found, scene)
    again = fi.load_scene(tmp_path / "s.toml")
    assert again.data()["mesh"] == scene.data()["mesh"]
    assert again.make_striker().mass == pytest.approx(0.1) and again.make_contact().exponent == 1.5


def test_an_unknown_structure_needs_a_scene(tmp_path):
    body = fi.Modes.from_arrays([500.0], [[1.0]], points=[[0.0]], mass=1.0, complete=True)
    hit = fi.strike(body, fi.Striker.rigid(0.1), LAW, at=[0.0], speed=1.0)
    made = fi.fit(fi.measure(hit, rate=25600.0), target=body, at=[0.0], starts=1, profiles=False, **GIVEN)
    with pytest.raises(ValueError, match="scene must be given"):
        prompt.write_scene(tmp_path / "scene.toml", made)
