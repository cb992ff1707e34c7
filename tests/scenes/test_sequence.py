"""Scenes of several strokes: played as the public function plays them, told, and refused where they make no sense."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import SMALL

import fem_impact as fi
from fem_impact.model.target import Stages
from fem_impact.scenes import maps, scene

TABLES = (
    SMALL
    + """[observe]
points = [[0.2, 0.15], [0.1, 0.2]]
listeners = [[0.1, 0.15, 0.5], [0.4, 0.15, 0.5]]
[[stroke]]
when = 0.03
[[stroke]]
when = 0.0
at = [0.2, 0.1]
speed = 0.5
lasts = 0.02
striker = { kind = "rigid", mass = 0.01 }
contact = { kind = "linear", stiffness = 1e4 }
"""
)


@pytest.fixture
def path(tmp_path):
    (tmp_path / "flam.toml").write_text(TABLES)
    return tmp_path / "flam.toml"


def test_a_scene_plays_its_strokes_as_the_function_does(path):
    told = scene.load_scene(path)
    found = told.play()
    alone = [told.alone(i) for i in (0, 1)]
    assert alone[0].blow.values["at"] == [0.1395, 0.09] and alone[1].striker.values["mass"] == 0.01
    strokes = [
        (0.03, fi.Striker.rigid(0.03), fi.Contact.hertz(695e3), (0.1395, 0.09), 2.0),
        (0.0, fi.Striker.rigid(0.01), fi.Contact.linear(1e4), (0.2, 0.1), 0.5, 0.02),
    ]
    same = fi.strokes(found.target, strokes, tolerance=1e-2)
    assert_allclose(found.force, same.force, rtol=1e-12)
    assert found.tolerance == 1e-2 and found.tolerance_met == same.tolerance_met
    assert [each.when for each in found.strokes] == [0.0, 0.03]
    single = alone[0].run(target="modal").response.target
    assert found.target.n_modes >= single.n_modes  # as many as the hard one needs
    assert scene.scene_of(told.data(), path, folder=path.parent).stroke[1].values == told.stroke[1].values


def test_the_prompt_plays_a_scene_and_writes_one_sound_of_all(path, tmp_path, prompt):
    played = prompt("strike flam.toml --out out --duration 0.1")
    assert played.status in (0, 3) and "2 strokes" in played.out and "stroke 1" in played.out
    data = json.loads((tmp_path / "out" / "response.json").read_text())
    assert {path.name for path in (tmp_path / "out").glob("[!.]*") if path.is_file()} == set(data["files"])
    assert [each["when"] for each in data["strokes"]] == [0.0, 0.03]
    assert sum(each["impulse"] for each in data["strokes"]) == pytest.approx(data["sequence"]["impulse"])
    assert data["scene"]["stroke"][1]["striker"] == {"kind": "rigid", "mass": 0.01}
    refused = prompt("strike flam.toml --verify --out more")
    assert refused.status == 2 and "--verify must be left out for a scene with strokes" in refused.err


def test_a_plan_of_strokes_is_of_all_and_the_body_has_the_modes_that_the_hardest_needs(path, prompt):
    told = scene.load_scene(path)
    planned = told.plan_strokes(tolerance=2e-2)
    assert [each["when"] for each in planned.strokes] == [0.0, 0.03] and planned.needed == 1  # in order of time
    own = [told.alone(i).plan(target="modal", tolerance=1e-2) for i in (1, 0)]  # half the tolerance for each
    assert [plan.max_frequency for plan in planned.plans] == [plan.max_frequency for plan in own]
    assert planned.body.max_frequency == max(plan.max_frequency for plan in own)
    assert planned.body.seconds > own[1].seconds and planned.meets == all(plan.meets for plan in own)
    assert told.play(tolerance=2e-2).target.n_modes == planned.body.description.found(Stages())[1].n_modes
    said = prompt("plan flam.toml --tolerance 2e-2").out.replace("\n    ", " ")
    assert "will be met by 2 strokes: each to 0.01 by itself" in said and f"{planned.body.cost}" in said
    data = prompt("plan flam.toml --tolerance 2e-2 --json").json
    assert [each["plan"] for each in data["strokes"]] == [0, 1] and len(data["plans"]) == 2 and data["needed"] == 1


def test_strokes_alike_share_the_plan_of_the_fastest(path):
    path.write_text(SMALL + "".join(f"[[stroke]]\nwhen = {i}\nspeed = {1 + i % 3}\n" for i in range(25)))
    planned = scene.load_scene(path).plan_strokes()
    assert len({id(plan) for plan in planned.plans}) == 1 and len(planned.data()["plans"]) == 1
    assert planned.plans[0].changes["tolerance"] == 5e-3 and "... and 5 more" in str(planned)
    assert planned.plans[0].blow.arguments["speed"] == 3


def test_the_first_modes_of_the_body_are_found_once_for_all_strokes(path):
    first, second = scene.load_scene(path).plan_strokes().plans
    assert first.first is not None and first.first is second.first


def test_a_stroke_beside_the_body_is_named(path):
    path.write_text(TABLES.replace("at = [0.2, 0.1]", "at = [0.6, 0.1]"))
    with pytest.raises(ValueError, match=r"flam.toml: \[\[stroke\]\] 1 at must lie on the body"):
        scene.load_scene(path).play()


def test_what_needs_a_single_blow_says_so(path):
    told = scene.load_scene(path)
    path.write_text(SMALL)
    for call in (scene.load_scene(path).plan_strokes, scene.load_scene(path).play):
        with pytest.raises(
            ValueError, match=r"\[\[stroke\]\] is missing: strokes are played together; a single blow has"
        ):
            call()
    assert np.isfinite(scene.load_scene(path).strike().restitution)
    for call in (told.strike, told.plan, lambda: maps.map_scene(told, over={"striker.mass": [0.1]}),
                 lambda: fi.spread(told, {"striker.mass": "lognormal(0.03, 0.1)"})):  # fmt: skip
        with pytest.raises(ValueError, match=r"\[\[stroke\]\] must be left out here.* from Python scene.alone\(0\)"):
            call()
    assert told.alone(0).plan().meets  # what the text proposes
    with pytest.raises(ValueError, match="max_impacts must be left out for a scene with strokes; it takes tolerance"):
        told.play(max_impacts=1)


@pytest.mark.parametrize(("old", "new", "text"), [
    ("when = 0.03", "wen = 0.03", r"\[\[stroke\]\] 0 wen is not a key of this table; did you mean 'when'"),
    ("when = 0.03", "", r"\[\[stroke\]\] 0 when is missing"),
    ("speed = 0.5", "speed = -0.5", r"\[\[stroke\]\] 1 speed must be positive"),
    ("lasts = 0.02", "lasts = 0", r"\[\[stroke\]\] 1 lasts must be positive"),
    ("mass = 0.01 }", "mas = 0.01 }", r"\[\[stroke\]\] 1 striker: mas is not a key"),
    ("mass = 0.01 }", "mass = -0.01 }", "mass must be positive"),
    ('"linear", stiff', '"between", stiff', r"\[\[stroke\]\] 1 contact: stiffness is not a key"),
    ('striker = { kind = "rigid", mass = 0.01 }', "striker = 3", r"striker must be a table with the keys of"),
    ("tolerance = 1e-2", "tolerance = 1e-2\nmax_impacts = 2", "max_impacts must be left out with"),
    ("tolerance = 1e-2", "tolerance = 1e-2\nstriker_force = 1.0\ndt = 1e-5", "striker_force, dt must be left out with"),
    ("[[stroke]]\nwhen = 0.03\n[[stroke]]", "[stroke]", r"stroke must be tables, each written \[\[stroke\]\]"),
    ("listeners = [[0.1, 0.15, 0.5]", "listeners = [[0.1, 0.15, 0.0]", "listener must lie off the plate's plane"),
    ("listeners =", "listener = [0.1, 0.1, 1.0]\nlisteners =", "listener must be left out beside listeners"),
    ("listeners = [[0.1, 0.15, 0.5], [0.4, 0.15, 0.5]]", "listeners = []", "listeners must be a list of 1 to"),
])  # fmt: skip
def test_what_is_wrong_with_a_stroke_is_said_before_any_work(path, old, new, text):
    assert TABLES.count(old) == 1
    path.write_text(TABLES.replace(old, new))
    with pytest.raises(ValueError, match=text):
        scene.load_scene(path)
