"""The studies still reproduce what they were made to show."""

import re

import assumptions
import attack
import beyond_bell
import beyond_flexible_stick
import beyond_hammer_test
import beyond_marimba_bar
import beyond_sounds as sounds
import design_drumstick as drumstick
import design_hammer as hammer
import design_marimba as marimba
import effectivity
import extremes
import fit_coverage as coverage
import frontier
import is_the_model_right as right
import measured_bodies as measured
import numpy as np
import pytest
import roll
import scene_speed as speed
import shared
from comparing import stretched
from numpy.testing import assert_allclose
from scenes import ROOT

STUDIES = ROOT / "studies"


@pytest.mark.slow
def test_measured_bodies_answer_within_their_stated_errors():
    """Three bodies, one of them among the few that miss: of the study's 300 blows 19 of 20 hold."""
    rows = [row for seed in (102, 103, 104) for row in measured.rows_of(seed, 6) if row["way"] == "followed"]
    shares = np.array([row[name] / row[f"{name}_stated"] for row in rows for name in measured.QUANTITIES])
    assert len(shares) == 72 and np.mean(shares <= 1.0) >= 0.9 and shares.max() < 3.0  # 2.2 was the worst of 150 blows
    assert np.median([row["force_stated"] for row in rows]) < 1e-2  # and these are not large


@stretched
@pytest.mark.parametrize("kind", ["stretching", "air", "quasi-static contact", "damping"])
def test_the_models_own_error_is_told_in_random_scenes(kind):
    chatter = [37, 72] if kind == "stretching" else []  # a first touch so short that few waves have left it
    for seed in [*range(105, 108), *chatter]:  # the first not of the study's table
        assert assumptions.judge(kind, seed)["verdict"] in ("right", "silent", "beyond", "hardly beyond")


@pytest.mark.slow
def test_random_scenes_keep_their_promise():
    cases = [effectivity.examine(number) for number in range(1001, 1026) if number % effectivity.SEARCHED]
    judged = [case for case in cases if case.verdict == "judged"]
    assert len(judged) > 15
    kept = [case.true <= case.tolerance for case in judged]
    assert sum(kept) >= len(kept) - 1  # 94 of 94 in the study's run; one miss in 25 would still be no proof against it
    honest = [case.estimated >= 0.3 * case.true for case in judged]
    assert sum(honest) >= len(honest) - 1  # one estimate in a hundred falls below half the truth


def test_effectivity_tells_what_it_could_not_judge(tmp_path, monkeypatch, capsys):
    """Scenes that take too long or rattle are counted, and a run goes on where another stopped."""
    run = ["--by-elements", "--scenes", "1", "--file", str(tmp_path / "cases.csv"), "--out", str(tmp_path)]
    effectivity.main([*run, "--first", "50"])
    told = capsys.readouterr().out
    assert "1 scenes: 1 judged" in told and "1 impacts: within the tolerance 100.0 % of 1" in told
    monkeypatch.setattr(effectivity, "CHAOTIC", 0)
    effectivity.main([*run, "--first", "50"])
    monkeypatch.undo()
    monkeypatch.setattr(effectivity, "LIMIT", 1e-3)
    cases = effectivity.main([*run, "--first", "50"])
    late = cases[2].verdict  # the reference itself may be found before the first tick of the processor's clock
    assert [case.verdict for case in cases[:2]] == ["judged", "chaotic"] and late in ("no reference", "over time")
    assert cases[0].reference <= effectivity.BEYOND_CLOSED * min(cases[0].tolerance, cases[0].estimated)
    assert f"{late}: " in capsys.readouterr().out and "processor time" in cases[2].remark
    assert (tmp_path / "effectivity_by_elements.png").stat().st_size > 1e4


def test_attacks_go_on_where_they_stopped(tmp_path, capsys):
    run = ["--file", str(tmp_path / "cases.csv"), "--truths", str(tmp_path / "truths")]
    attack.main([*run, "--count", "2"])
    first = (tmp_path / "cases.csv").read_text()
    assert "| everyday | 2 | 0 | 0 |" in capsys.readouterr().out
    cases = attack.main([*run, "--count", "3"])
    assert (tmp_path / "cases.csv").read_text().startswith(first)
    assert [case.number for case in cases] == [0, 1, 2] and str(cases) == str(attack.main(run))
    kept = attack.attack_blows.Truths(tmp_path / "truths" / "1")
    assert len(kept.known) == 3
    kept.of("everyday", "0 ", None)  # known: no blow is needed


@pytest.mark.slow
def test_extremes_are_right_flagged_or_refused():
    for axis, values in extremes.AXES.items():
        some = values[:: max(1, len(values) // 4)]
        found = [extremes.judge(axis, float(x), extremes.BASIS | {axis: x}) for x in some]
        assert not [outcome for outcome in found if outcome.kind == "wrong"]
        assert axis == "loss" or any(outcome.kind == "right" for outcome in found)  # lossy blows want more modes


def test_a_wrong_answer_at_the_extremes_would_be_seen(monkeypatch):
    exact = extremes.difference
    monkeypatch.setattr(extremes, "difference", lambda hit, other: exact(hit, other) + 2e-3)
    assert extremes.judge("mass", 1.0, dict(extremes.BASIS)).kind == "wrong"


@pytest.mark.slow
def test_the_tolerance_walks_along_the_edge_of_what_is_possible(tmp_path, monkeypatch):
    monkeypatch.setattr(frontier, "TOLERANCES", [1e-2, 1e-3, 1e-4])
    monkeypatch.setattr(frontier, "REPEATS", 1)
    whole = frontier.scene("fe", tmp_path)
    modes = frontier.fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=3000)
    reference = frontier.fi.strike(modes, **frontier.blow(whole), tolerance=1e-7)
    found = frontier.dials(whole)
    for dial in found:
        assert frontier.difference(dial.run.response, reference) <= dial.tolerance
    kept = [dial.run.plan.n_modes for dial in found]
    assert kept == sorted(kept) and all(dial.run.plan.target == "vectors" for dial in found)
    assert frontier.table(found).count("\n") == 4


@pytest.mark.slow
def test_a_scene_is_measured_within_limits_and_stopped_beyond_them(tmp_path, monkeypatch, capsys):
    path = shared.SCENES / "everyday" / "marimba_yarn.toml"
    assert speed.measured(path, 1e-2, {}, (0.01, 4.0)) == {"verdict": "over time", "seconds": 0.01}
    assert speed.measured(path, 1e-2, {}, (120.0, 1e-6))["verdict"] == "over memory"
    monkeypatch.setattr("sys.argv", ["", "--only", "marimba_yarn", "--ratio", "--out", str(tmp_path / "speed.csv")])
    speed.main()
    row = dict(zip(*[line.split(",") for line in (tmp_path / "speed.csv").read_text().splitlines()]))
    assert row["verdict"] == "met" and row["target"] in ("modal", "vectors") and float(row["ratio"]) > 0.0
    assert float(row["error"]) <= 1e-2 and 0.0 < float(row["restitution"]) < 1.0
    assert row["restitution"][:5] in capsys.readouterr().out


def test_a_scene_that_is_refused_says_so_in_its_row(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(speed.NAMED["bronze_disk"][0])
    row = speed.strike(path, 1e-2, {"n_modes": 5000})
    assert row["verdict"].startswith("refused: this blow needs about 5e+03 modes") and "error" not in row


def test_the_coverage_of_intervals_is_what_the_file_says():
    found = coverage.judge(coverage.read(STUDIES / "verification" / "fit_coverage.csv"))
    held, called, false = (good / count for good, count in found.values())
    count = next(iter(found.values()))[1]
    assert count > 200
    # three standard deviations of a share of 90 % of the intervals counted
    assert abs(held - 0.9) < 3.0 * np.sqrt(0.09 / count) and called >= 0.95 and false <= 0.05


@pytest.mark.slow
def test_a_new_set_of_taps_is_fitted_as_the_file_says(tmp_path):
    rows = coverage.examine(7)  # a wall: mass and stiffness cannot be determined
    found = {each["name"]: each for each in rows}
    assert found["striker.mass"]["ends"] == found["contact.stiffness"]["ends"] == "open"
    assert found["contact.exponent"]["low"] < found["contact.exponent"]["truth"] < found["contact.exponent"]["high"]


def test_the_model_of_a_wooden_bar_struck_fast_fails_first_as_it_yields(tmp_path, capsys, monkeypatch):
    soft, hard = (right.effects(right.scene("wood", 0.02, speed).strike()) for speed in (1e-3, 10.0))
    assert max(soft, key=soft.get) != "no yielding" and soft["no yielding"] == 0.0
    assert max(hard, key=hard.get) == "no yielding" and hard["no yielding"] > 0.2
    argv = ["", "--points", "2", "--only", "wood", "--out", str(tmp_path)]
    monkeypatch.setattr("sys.argv", argv)
    right.main()
    assert "no yielding in 25%" in capsys.readouterr().out
    assert (tmp_path / "is_the_model_right.png").stat().st_size > 10_000
    assert (tmp_path / "is_the_model_right.csv").read_text().count("\n") == 5


@stretched
def test_a_plate_with_and_without_stretching_is_drawn(tmp_path, capsys):
    right.stretched(tmp_path / "stretching.png")
    rows = [[float(x) for x in line.split()] for line in capsys.readouterr().out.splitlines()[2:]]
    assert (tmp_path / "stretching.png").stat().st_size > 10_000 and len(rows) == 13
    for _, linear, depth, true, told, left in rows[:8]:  # up to half a thickness
        assert depth <= linear and true / 3.0 < told < 3.0 * true and 0.0 < left < 0.02 * true
    assert all(np.isnan(left) == (depth > 1.0) for _, _, depth, _, _, left in rows)


@pytest.mark.slow
def test_a_stiffer_hand_buzzes_faster_and_a_damped_one_stops_sooner():
    struck = {name: body for name, body in roll.bodies(highest=600.0).items() if name != "cymbal"}
    for body in struck.values():
        soft, stiff = (roll.buzz(*body, k, roll.DAMPINGS["loose"], roll.LASTS) for k in (10.0, 1000.0))
        assert stiff.rate > 1.15 * soft.rate  # 41 to 63 Hz on the drumhead, 80 to 103 Hz on the table
        firm = roll.buzz(*body, 10.0, roll.DAMPINGS["firm"], roll.LASTS)
        assert len(firm.bounces) < 0.6 * len(soft.bounces)  # 3 of 13, 5 of 13
    omega = np.sqrt(1000.0 / (roll.STICK / 3.0))
    assert roll.alone(1e-6) == pytest.approx(roll.FORCE / (2.0 * roll.SPEED * roll.STICK / 3.0))  # F / 2 m v
    assert roll.alone(1000.0) > 0.5 * omega / (0.5 * np.pi)  # half a swing at most


@pytest.mark.slow
def test_a_marimba_bar_is_tuned_within_a_cent_and_its_mallet_suits(tmp_path):
    pitch, length = marimba.BARS["F4"]
    found = marimba.designed(pitch, length)
    checked = found.verify()
    assert found.met and marimba.cents(found, checked) < 1.0  # 1e-9 were measured, of the model
    hit = checked.hits[""]
    assert hit.n_impacts == 1
    assert_allclose(hit.contact_time, 0.5 / pitch, rtol=1e-5)  # asked to 1e-6, struck again to as much
    assert shared.save(tmp_path / "bars.png", marimba.draw({"F4": found})).stat().st_size > 10_000  # two panels


def test_studies_save_pictures_in_the_format_of_the_command(tmp_path):
    arguments = ["fig05.py", "--format", "svg", "out"]
    assert shared.taken(arguments) == ".svg" and arguments == ["fig05.py", "out"]
    arguments = ["fig05.py", "out", "--format=pdf"]
    assert shared.taken(arguments) == ".pdf" and arguments == ["fig05.py", "out"]
    assert shared.taken(["fig05.py"]) == ".png"
    with pytest.raises(SystemExit, match="--format must be one of png, pdf, svg, got 'bmp'"):
        shared.taken(["fig05.py", "--format", "bmp"])


def test_every_picture_of_a_study_is_saved_in_one_place():
    for path in STUDIES.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert path.name == "shared.py" or not re.search(r"savefig\(|figures\.save\(", text), path.name


@pytest.mark.slow
def test_the_heaviest_hammer_is_held_by_the_corner_and_the_bandwidth(monkeypatch):
    monkeypatch.setattr(hammer, "POINTS", {"corner": (0.02, 0.02), "middle": (0.3, 0.2)})  # the two that decide
    monkeypatch.setattr(hammer, "N_MODES", 90)
    found = hammer.designed(hammer.tutorial.plate(), "most")
    held = [each.goal.name for each in found.reached if abs(each.goal.low - each.value) < 1e-3 * abs(each.goal.scale)]
    assert found.met and held[0] == "clearance" and held[-1] == hammer.LEVEL
    assert_allclose(found.values["mass"], 0.0470, rtol=1e-2)  # 47.04 g at all points with twice the modes
    for name, at in hammer.POINTS.items():
        told = {**hammer.blows(found.hits[name].bodies[-1])(found.values)[name], "tolerance": 1e-3}
        hit = hammer.fi.strike(told.pop("target"), told.pop("striker"), told.pop("contact"), **told)
        assert hit.n_impacts == 1, at  # all of the blow, not only its first impact
        assert hammer.hammers.bandwidth_of(hit, 10.0) > 799.0  # 800 to the tolerance of the design


@pytest.mark.slow
def test_a_tip_is_as_bright_as_wanted_at_two_dynamics():
    body, wishes = drumstick.plate(80), drumstick.WISHES["dark"]
    found = drumstick.designed(body, *wishes)
    heard = drumstick.brightness(body, found.values, list(drumstick.DYNAMICS.values()))
    assert_allclose(heard, wishes, rtol=1e-3)  # struck again to 1e-3


def test_a_stick_that_bends_strikes_twice():
    table = beyond_flexible_stick.compute(np.array([100.0, 178.0, 224.0, 251.0, 500.0, 3e3, 10e3]))
    once = table.n_impacts.values == 1
    assert (once == (table.striker_frequency.values > 240.0)).all()  # Hz; the contact resonance is 260 Hz
    assert_allclose(float(table.restitution[-1]), 1.0, atol=2e-3)  # rigid stick, unyielding plate: nothing is lost


@pytest.mark.slow
def test_the_end_of_a_free_bar_forgives_least():
    result = beyond_marimba_bar.compute(np.array([0.01, 0.05]), np.geomspace(1e3, 1e7, 21))
    assert (result[0.0] < np.minimum(result[0.1], result[0.4])).all()
    assert result[0.0][1] < result[0.0][0]  # a heavier mallet needs a softer head
    assert result[0.0][0] < 5e5  # 10 g: 398 kN/m in the study's finer row
    assert result[0.4][0] == 1e7  # elsewhere the hardest tried still hits once


@pytest.mark.slow
def test_light_or_soft_clappers_hit_a_bell_once():
    table = beyond_bell.compute(np.array([0.02, 1.0]), np.array([1e7, 1e10]), max_frequency=8e3)
    assert table.n_impacts.values[0].tolist() == [1, 1]  # soft
    assert table.n_impacts.values[1, 0] == 1  # light
    assert table.n_impacts.values[1, 1] > 1  # hard and heavy
    assert table.contact_resonance.values[1, 0] < float(table.threshold[0])  # and theory agrees on all three
    assert table.contact_resonance.values[0, 1] < float(table.threshold[1]) or np.isnan(table.threshold[1])


def test_light_hammers_reach_the_bandwidth_and_heavy_ones_cannot():
    found = beyond_hammer_test.compute(np.array([2e-3, 0.02, 0.1]))
    assert [hammer.works for hammer in found] == [True, True, False]
    assert found[2].reach < 250.0 < 600.0 < found[1].reach  # Hz hitting once; 110 Hz at 100 g, 681 Hz at 20 g


def test_harder_heads_and_second_hits_are_brighter_and_heavier_sticks_louder():
    heard = sounds.compute(duration=0.3)
    assert {name: n for name, (n, _) in heard.items() if n > 1} == {"double": 2}
    bright = {name: sounds.centroid(sound.samples, sound.rate) for name, (_, sound) in heard.items()}
    loud = {name: sounds.level(sound.samples) for name, (_, sound) in heard.items()}
    assert bright["hard"] > 1.3 * bright["soft"]
    assert bright["double"] > 1.2 * bright["single"]
    assert bright["light"] > 1.3 * bright["heavy"]
    assert loud["heavy"] > loud["light"] + 6.0  # dB
    assert {sound.full_scale for _, sound in heard.values()} == {10.0}


def test_the_page_shows_every_study():
    page = (STUDIES / "README.md").read_text()
    for script in [*STUDIES.glob("figures/fig*.py"), *STUDIES.glob("figures/beyond_*.py")]:
        assert f"(pictures/{script.stem}.png)" in page
        assert script.read_text().split('"""')[1].split("\n")[0] in page  # its first sentence
        assert (STUDIES / "pictures" / f"{script.stem}.png").stat().st_size < 100_000
