"""The plan of a test against single blows and against records of a simulated rig with noise."""

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import SMALL, load_text

import fem_impact as fi
from fem_impact.taps import roving

PLATE = fi.analytic.rectangle(1.0, 0.7, mass=2.0, first_frequency=50.0, n_modes=150, damping_ratio=0.01)
KIT = {"small": (0.005, {"vinyl": 1e5, "rubber": 1e3}), "large": (0.3, {"vinyl": 1e6})}
POINTS = [(0.2, 0.2), (0.5, 0.35), (0.04, 0.05)]
BAND = 400.0


def rows_of(path):
    return list(csv.DictReader(path.read_text().splitlines()))


@pytest.fixture(scope="module")
def plan():
    return fi.plan_test(PLATE, KIT, POINTS, BAND, sensor=(0.37, 0.31))


def test_impacts_and_reach_are_those_of_single_blows(plan):
    for i, at in enumerate(POINTS):
        for j, (mass, tip) in enumerate(zip(plan.masses, plan.stiffnesses)):
            hit = fi.strike(PLATE, fi.Striker.rigid(mass), fi.Contact.linear(tip), at=at, speed=0.3, tolerance=1e-4)
            assert plan.n_impacts[i, j] == min(hit.n_impacts, 2)
            if hit.n_impacts == 1:
                size = np.abs(hit.spectrum(np.linspace(0.0, BAND, 200)))
                assert plan.works[i, j] == (size.min() > 0.3162 * size[0])  # 10 dB
    assert plan.verdicts[0] == plan.verdicts[2] == "works"
    assert not plan.works[:, plan.tips.index("rubber")].any()  # too soft for the band
    assert plan.best.tolist() == [np.nanargmax(row) for row in plan.coherence]


def test_expected_coherence_is_that_of_many_noisy_records(plan):
    """Of 60 taps as `fi.measure` records them; the mean over the band has a spread of some 1e-3."""
    i, j = 0, int(plan.best[0])
    ball, law = fi.Striker.rigid(plan.masses[j]), fi.Contact.linear(plan.stiffnesses[j])
    hit = fi.strike(PLATE, ball, law, at=POINTS[i], speed=1.0)
    rng, noise = np.random.default_rng(3), 0.02
    loud = fi.plan_test(PLATE, KIT, POINTS[:1], BAND, sensor=(0.37, 0.31), noise=noise)
    rig = {"rate": 2.56 * BAND, "at": [(0.37, 0.31)], "anti_alias": "2.56", "duration": loud.duration}
    middle = 0.5 * hit.impacts[0].end * rig["rate"]
    clean = fi.measure(hit, **rig, onset=(np.ceil(middle) - middle) / rig["rate"])  # a sample falls on the peak
    records = np.stack([clean.force, clean.response[..., 0]])  # (2, 1, n_times)
    peaks = np.abs(records).max(axis=2, keepdims=True)
    records = records + noise * peaks * rng.standard_normal((2, 60, records.shape[2]))
    found = fi.frf(fi.Taps.from_arrays(records[0], records[1][..., None], rate=clean.rate, units=clean.units))
    band = (found.frequency.values >= PLATE.frequencies[0]) & (found.frequency.values <= BAND)
    assert 0.3 < loud.coherence[0, j] < 0.95  # the noise is felt
    # samples may miss the peak of the acceleration, to which the noise relates, by some 10 %
    assert_allclose(loud.coherence[0, j], found.coherence.values[band, 0].mean(), atol=0.03)
    assert loud.coherence[0, j] < plan.coherence[0, j]


def test_where_a_double_hit_cannot_be_avoided_it_is_said_and_drawn(tmp_path):
    light = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300, damping_ratio=0.01)
    found = fi.plan_test(light, {"heavy": (0.1, {"vinyl": 1e5})}, [(0.465, 0.3), (0.46, 0.3)], 500.0, duration=0.5)
    assert set(found.verdicts) == {"double hit"} and (found.best == -1).all()
    assert "double hit with every tip: 2 points" in found.summary()
    drawn = found.figure()
    assert [text.get_text() for text in drawn.legends[0].get_texts()] == ["double hit"]
    found.write_csv(tmp_path / "plan.csv")
    rows = rows_of(tmp_path / "plan.csv")
    assert [row["impacts"] for row in rows] == ["2 or more"] * 2 and rows[0]["coherence"] == ""
    assert float(rows[0]["resolution [Hz]"]) == pytest.approx(2.0)


def test_a_double_hit_that_more_modes_do_not_have_is_none():
    """A hard tip beside the edge: with the modes given it hits twice, with all of them once."""
    kit, at = {"hard": (0.091, {"steel": 5.2e6})}, (0.21, 0.408)
    told = {}
    for n_modes in (400, 4000):
        plate = fi.analytic.rectangle(
            0.6285, 0.4411, mass=1.94, first_frequency=25.7, n_modes=n_modes, damping_ratio=2e-3
        )
        told[n_modes] = fi.plan_test(plate, kit, [at], 456.0, drop=20.0)
    assert told[4000].n_impacts == [[1]]
    assert told[400].n_impacts == [[0]] and told[400].verdicts == (roving.UNKNOWN,)


def test_a_hammer_of_a_mass_gets_tips_from_the_softest_that_reaches_the_band_on_a_wall():
    found = fi.plan_test(fi.Modes.rigid(1e3), [0.1], [()], 500.0, duration=0.2)
    assert (found.n_impacts == 1).all() and found.verdicts == ("works",)
    assert_allclose(found.reach[0], 500.0 * np.sqrt(roving.TIPS), rtol=1e-3)  # half sines, whose resonance goes so
    assert_allclose(found.lines or 0.0, 0.0)  # no modes


@pytest.mark.slow
def test_a_plate_by_elements_gets_the_plan_of_its_modes():
    wood = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    body = fi.assemble(fi.mesh.rectangle(0.465, 0.3), wood, {"boundary": "hinged"})
    points, kit = [(0.1, 0.1), (0.2, 0.13)], {"a": (0.003, {"soft": 2e4, "hard": 1e5}), "b": (0.1, {"hard": 1e5})}
    vectors = fi.plan_test(body, kit, points, 500.0, damping_ratio=0.01)
    modes = fi.analytic.rectangle(
        0.465, 0.3, mass=body.mass, first_frequency=float(vectors.modes.frequencies[0]), n_modes=400,
        damping_ratio=0.01,
    )  # fmt: skip
    closed = fi.plan_test(modes, kit, points, 500.0)
    assert vectors.n_impacts.tolist() == closed.n_impacts.tolist() and vectors.best.tolist() == closed.best.tolist()
    assert_allclose(vectors.reach, closed.reach, rtol=5e-3)  # vectors to 6e-3
    assert_allclose(vectors.coherence, closed.coherence, atol=5e-3)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"hammers": {"a": 0.1}}, r"hammers\['a'\] must be \(mass in kg, tips as name -> stiffness"),
        ({"hammers": {}}, "hammers must contain at least one hammer"),
        ({"hammers": {"a": (-1.0, {"b": 1e5})}}, r"mass of hammers\['a'\] must lie between"),
        ({"bandwidth": 0.0}, "bandwidth must lie between"),
        ({"duration": 1e-4}, "duration must hold 8 to"),
        ({"noise": -1.0}, "noise must lie between"),
    ],
)
def test_what_is_no_plan_says_so(changes, text):
    asked = {"hammers": KIT, "points": POINTS, "bandwidth": BAND, **changes}
    with pytest.raises(ValueError, match=text):
        fi.plan_test(PLATE, *(asked.pop(name) for name in ("hammers", "points", "bandwidth")), **asked)


def test_the_prompt_plans_points_over_the_body(prompt):
    Path("scene.toml").write_text(SMALL)
    ran = prompt("hammer scene.toml --bandwidth 400 --rove 9 --masses 0.002 0.02 --out plan.svg")
    assert ran.status == 0 and "points, 12 tips, 400 Hz" in ran.out and "plan.csv" in ran.out
    rows = rows_of(Path("plan.csv"))
    assert Path("plan.svg").read_text().startswith("<?xml") and len({row["point"] for row in rows}) in range(6, 13)


SHEET = """mesh = { shape = "rectangle", length = 0.4, width = 0.3 }
material = { E = 70e9, nu = 0.33, rho = 2700.0 }
section = { kind = "plate", thickness = 2e-4 }
supports = { boundary = "hinged" }
striker = { kind = "rigid", mass = 0.03 }
contact = { kind = "linear", stiffness = 1e4 }
strike = { at = [0.13, 0.1], speed = 1.0 }
"""


def test_a_plan_says_that_it_follows_no_model_to_be_chosen_and_taps_lightly(tmp_path, prompt):
    text = SMALL.replace("damping_ratio = 0.01", 'damping_ratio = 0.01\nmodel = "auto"')
    load_text(tmp_path, text)
    words = "hammer scene.toml --bandwidth 400 --masses 0.002"
    for more in ("", "--rove 4"):
        assert 'model = "auto" is not followed' in prompt(f"{words} {more}").out
    scenes = [load_text(tmp_path, SHEET + more) for more in ("", "target = { stretching = true }\n")]
    plans = [roving.of_scene(each, {"a": (0.005, {"b": 1e4})}, 200.0, 10.0, None) for each in scenes]
    assert_allclose(*(plan.peaks for plan in plans), rtol=1e-4)


def test_modes_of_a_scaled_scene_reach_a_little_beyond_the_band(tmp_path):
    scene = load_text(tmp_path, SMALL.replace('source = "analytic"', 'source = "fe"'))
    found = roving._modes(scene.built.target, BAND)
    assert found.frequencies[0] == pytest.approx(100.0) and 1.5 * BAND < found.frequencies[-1] < 5.0 * BAND
