import copy
import pickle
import re
from dataclasses import replace

import numpy as np
import pytest
from scenes import SHIPPED

import fem_impact as fi
from fem_impact.impact import assumption, engine
from fem_impact.model import audit, bending, planner, restrike
from fem_impact.model.target import Target

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0, yield_strength=2e9)
PLATE = fi.Plate(STEEL, 0.01)
BALL = fi.Striker.sphere(STEEL, 5e-3)
LAW = fi.Contact.between(BALL, PLATE)


def modal(n_modes=60, section=PLATE):
    return fi.analytic.rectangle(0.4, 0.3, section=section, n_modes=n_modes, damping_ratio=0.01)


def named(told):
    return {each.name: each for each in told.assumptions}


AMID = {"at": (0.35, 0.3), "tolerance": 1e-2, "damping_ratio": 0.01}
HOW = {"at": (0.12, 0.1), "speed": 1.0, "tolerance": 1e-2}
BAR = fi.Beam.rectangular(STEEL, width=0.03, height=0.01)


def wide():
    return fi.assemble(fi.mesh.rectangle(0.8, 0.6), PLATE, {"boundary": "hinged"})


@pytest.mark.slow
def test_the_examination_knows_every_kind_of_target():
    effect = {}
    for target in ("vectors", "modal", "infinite", "rigid"):  # a slow blow on a wide plate
        n_modes = {"n_modes": 150} if target == "modal" else {}
        found = named(fi.strike(wide(), BALL, LAW, **AMID, speed=0.05, target=target, **n_modes))
        for name in ("thin target", "small deflections", "no yielding", "local contact", "still air"):
            assert found[name].known, found[name].sentence
        # k h of the contact's own frequency, by the wave in an endless plate; the modes that ring lie below and above
        assert 0.2 < found["thin target"].value < 1.0 and 0.0 < found["thin target"].worst < 0.1
        effect[target] = found["thin target"].effect
    for name in ("restitution", "force"):  # estimates by two formulas
        assert effect["infinite"][name] == pytest.approx(effect["vectors"][name], rel=1.0, abs=1e-3)


def test_a_plan_foresees_what_the_blow_then_finds():
    before, after = (named(ask(wide(), BALL, LAW, **AMID, speed=2.0)) for ask in (fi.plan, fi.strike))
    for name in ("no yielding", "quasi-static contact"):
        assert before[name].value == pytest.approx(after[name].value, rel=0.2)  # a wall is a little harder
        assert before[name].effect == {}
    assert before["thin target"].value == pytest.approx(after["thin target"].value, rel=0.5)
    assert before["small deflections"].value >= 0.5 * after["small deflections"].value


def test_modes_alone_are_foreseen_as_the_body_they_come_from():
    plan = fi.plan(modal(), BALL, LAW, **HOW)
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3), PLATE, {"boundary": "hinged"})
    before, after, other = named(plan), named(plan.strike()), named(fi.plan(system, BALL, LAW, **HOW))
    for name in ("thin target", "small deflections", "local contact", "still air", "no yielding"):
        assert before[name].state == "foreseen"
        assert before[name].value == pytest.approx(after[name].value, rel=0.4)  # a wall is harder than the plate
        assert before[name].value == pytest.approx(other[name].value, rel=0.03), name
    assert "; the model is doubtful here: thin target, no yielding" in str(plan).splitlines()[0]


def test_a_beam_is_foreseen_as_it_is_found():
    plan = fi.plan(fi.assemble(fi.mesh.line(0.3), BAR), BALL, fi.Contact.between(BALL, STEEL), **HOW | {"at": (0.1,)})
    before, after = named(plan), named(plan.strike())
    assert before["no yielding"].known and before["thin target"].doubtful
    for name in ("thin target", "small deflections", "local contact"):
        assert before[name].value == pytest.approx(after[name].value, rel=0.3)
    assert before["still air"].value < after["still air"].value  # what sound damps is known after the blow
    assert before["stated damping"].state == "not known"


def test_what_the_plan_models_is_no_doubt_of_its():
    light = fi.Plate(STEEL, 5e-4)
    stout = fi.analytic.beam(0.3, ends=("free", "free"), section=BAR, n_modes=5, theory="timoshenko")
    for body, name in ((modal(5), "stated damping"), (stout, "thin target"), (fi.in_air(modal(5, light)), "still air")):
        found = named(fi.plan(body, BALL, LAW, **HOW | {"at": HOW["at"][: body.dimension]}))[name]
        assert found.state == "foreseen" and found.value is None, name
    plain, better = (
        named(fi.plan(modal(40, light), BALL, LAW, stretching=on, **HOW))["small deflections"] for on in (False, True)
    )
    assert plain.value == better.value and (plain.limit, better.limit) == (0.2, 1.0)
    assert plain.quantities == ("restitution", "impulse", "contact_time", "force", "n_impacts")
    only = fi.plan(modal(40, light), BALL, LAW, quantity="restitution", **HOW).assumptions
    assert {each.quantities for each in only} == {("restitution",)}


def test_a_rigid_mass_assumes_nothing_of_plates_and_a_held_striker_is_foreseen():
    wall = fi.Modes.rigid(1.0), fi.Striker.rigid(0.1), LAW
    assert named(fi.plan(*wall, at=None, speed=1.0))["thin target"].state == "foreseen"
    found = named(fi.strike(*wall, at=None, speed=1.0))
    for name in ("thin target", "small deflections", "local contact", "still air", "stated damping"):
        assert found[name].worst == 0.0 and found[name].known
    held = fi.Striker.stick(mass=0.1, first_frequency=2e3).held(fi.Hand(stiffness=100.0, damping=1.0, force=1.0))
    assert named(fi.plan(modal(), held, LAW, **HOW, duration=0.01))["thin target"].value > 0.23


def test_a_bar_that_strikes_is_foreseen_by_its_own_thickness():
    rod = fi.analytic.beam(0.4, ends=("hinged", "free"), section=fi.Beam.circular(STEEL, diameter=0.03), n_modes=20)
    before, other = (
        named(fi.plan(modal(), striker, fi.Contact.hertz(1e9), **HOW))["thin striker"]
        for striker in (fi.Striker.flexible(rod, at=0.4), fi.Striker.rigid(0.1))
    )
    assert before.state == "foreseen" and 0.1 < before.value < 3.0  # as of the blow itself
    assert other.value is None and other.worst == 0.0  # nothing bends


def test_a_beam_struck_near_its_end_is_no_half_space():
    modes, law = fi.analytic.beam(0.3, ends=("free", "free"), section=BAR, n_modes=20), fi.Contact.between(BALL, STEEL)
    middle, end = (named(fi.strike(modes, BALL, law, at=(x,), speed=0.1))["local contact"] for x in (0.15, 1e-4))
    assert middle.number == "contact radius over half the thickness" and not middle.doubtful
    assert end.number == "contact radius over the distance to the edge" and end.doubtful


def test_distance_to_the_edge_is_that_of_the_body():
    disk, beam = fi.analytic.disk(0.1, section=PLATE, n_modes=5), fi.analytic.beam(0.3, section=BAR, n_modes=5)
    by_elements = fi.find_modes(fi.assemble(fi.mesh.disk(0.1), PLATE, {"boundary": "hinged"}), n_modes=3)
    for modes, at, clearance in (
        (disk, (0.06, 0.0), 0.04), (modal(3), (0.39, 0.1), 0.01), (by_elements, (0.06, 0.0), 0.04),
        (beam, (0.15,), 0.015), (beam, (0.29,), 0.01),  # half the width; the end
    ):  # fmt: skip
        known = bending.known_of(modes) if modes is beam else None
        assert audit._clearance(modes, known, None, np.array(at)) == pytest.approx(clearance, rel=0.01)


LAWS = {
    "layers": fi.Contact.layers(1e5, 1.0, depth=1e-4, hard_stiffness=1e9),
    "felt": fi.Contact.felt(1e9, 2.5, hysteresis=0.4, relaxation=1e-3),
    "yields": fi.Contact.between(BALL, PLATE, yield_strength=1e9),
}


@pytest.mark.parametrize("law", LAWS)
def test_contacts_that_lose_are_examined_and_struck_again_as_they_are(law):
    hit = fi.strike(modal(), BALL, LAWS[law], **HOW)
    found = named(hit)
    for name in ("thin target", "small deflections", "still air", "stated damping", "quasi-static contact"):
        assert found[name].known and found[name].worst < 0.05, found[name].sentence
    assert found["thin target"].worst > 0.0
    again = engine.follow_again(hit.history)  # the blow to compare with is the one found
    before = restrike.Struck(replace(hit, audit=None), hit.bodies, None, None).before
    assert before.peak_force == pytest.approx(hit.peak_force, rel=2e-2)  # a coarse first run
    assert len(again.contacts) == len(hit.history.contacts)


def morley():
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3, size=0.1), PLATE, {"boundary": "hinged"}, element="morley")
    return fi.find_modes(system, n_modes=8)


@pytest.mark.parametrize(("body", "law", "how"), [
    (modal, fi.Contact.hertz(LAW.stiffness, gap=1.0), {"duration": 1e-4}),
    (modal, LAW, {"at": (0.0, 0.1)}),
    (modal, LAW, {"speed": 0.0, "striker_force": 500.0, "duration": 2e-4}),
    (morley, LAW, {}),
], ids=["no touch", "at the edge", "pressed from rest", "morley"])  # fmt: skip
def test_odd_blows_are_examined_too(body, law, how):
    hit = fi.strike(body(), BALL, law, **HOW | how)
    assert np.isfinite(hit.model_error) and len(hit.assumptions) == len(assumption.ALL)
    assert law is LAW or (hit.n_impacts == 0 and hit.model_error < 1e-6)
    assert body is modal or named(hit)["thin target"].state == "not known"


@pytest.mark.parametrize(("mesh", "supports", "can"), [
    ("plate", {"boundary": "hinged"}, True), ("plate", {"left": "clamped"}, True),
    ("plate", {"left": fi.Elastic(1e6)}, False), ("bar", {"left": "clamped", "right": "hinged"}, True),
    ("bar", {"left": "clamped", "right": "free"}, False),
])  # fmt: skip
def test_what_holds_the_plane_decides_whether_a_body_can_stretch(mesh, supports, can):
    body = (fi.mesh.rectangle(0.3, 0.2), fi.Plate(STEEL, 1e-3)) if mesh == "plate" else (fi.mesh.line(0.3), BAR)
    assert Target(*body, supports, source="fe").can_stretch == can
    assert mesh == "bar" or not Target(*body, supports, scale={"mass": 1.0}).can_stretch


def test_every_blow_tells_all_its_assumptions_in_one_order():
    hit = fi.strike(modal(), BALL, LAW, at=(0.12, 0.1), speed=0.1)
    assert tuple(each.name for each in hit.assumptions) == assumption.ALL
    for each in hit.assumptions:
        assert set(each.effect) == set(hit.quantities) and each.quantities == tuple(hit.quantities)
    assert hit.model_error == pytest.approx(max(each.model for each in hit.trust))
    assert {each.number for each in hit.assumptions if each.value is not None} <= set(assumption.READINGS)


def test_a_blow_that_keeps_every_assumption_says_so_in_one_line():
    soft = fi.Striker.sphere(fi.Material(E=1e6, nu=0.4, rho=1100.0, yield_strength=1e7), 5e-3)
    hit = fi.strike(modal(300), soft, fi.Contact.between(soft, PLATE), at=(0.12, 0.1), speed=0.01, tolerance=1e-2)
    assert hit.model_verdict == ("the model holds to better than 1e-3",)
    assert hit.summary().splitlines()[0] == hit.verdict and hit.verdict.endswith(f"; {hit.model_verdict[0]}")


def test_the_quantities_asked_for_are_those_that_get_an_effect():
    hit = fi.strike(modal(), BALL, LAW, at=(0.12, 0.1), speed=0.1, quantity=("spectrum=5000", "sound=3000"))
    effect = named(hit)["thin target"].effect
    assert set(effect) == {"spectrum", "sound"} and 0.0 < effect["sound"] < 0.2 and effect["spectrum"] > 0.0


def test_a_body_of_scaled_mass_is_not_known():
    plate = fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=60, damping_ratio=0.005)
    law = fi.Contact.hertz(695e3)
    hit = fi.strike(plate, fi.Striker.rigid(0.03), law, at=(0.1395, 0.09), speed=5.0, tolerance=1e-2)
    found = named(hit)
    for name in ("thin target", "small deflections", "no yielding"):
        assert found[name].state == "not known" and found[name].open == (name != "no yielding")
    assert hit.tolerance_met and not hit.trusted and hit.trust["force"].model is None
    assert hit.trust["force"].unknown == ("thin target", "small deflections") and hit.trust["force"].known > 0.01
    said = "it is not known whether the model holds: thin target, small deflections (the thickness of the body)"
    assert f", but {said}: give material and section" in hit.summary().splitlines()[0]
    assert found["still air"].known and found["still air"].value > 0.02  # its mass per area is known


def test_what_measured_modes_cannot_tell_is_not_known_before_the_blow():
    shapes = np.array([[1.2, 0.4], [0.9, -1.1]])
    modes = fi.Modes.from_arrays([110.0, 340.0], shapes, points=[(0.1, 0.1), (0.3, 0.1)], mass=0.5, complete=True)
    stick = fi.Striker.stick(mass=0.1, first_frequency=2e3)
    plan = fi.plan(modes, stick, fi.Contact.hertz(1e8), at=(0.1, 0.1), speed=1.0, tolerance=1e-2)
    states = {each.name: each.state for each in plan.assumptions}
    assert tuple(states) == assumption.ALL
    known = [name for name, state in states.items() if state != "not known"]
    assert known == ["shallow target", "quasi-static contact", "no friction"]
    assert "not known before the blow: thin target, thin striker, small deflections, still air" in str(plan)


@pytest.mark.slow
def test_a_response_with_its_examiner_can_be_copied_and_pickled():
    hit = fi.strike(modal(20), BALL, LAW, at=(0.12, 0.1), speed=0.1)
    for twin in (pickle.loads(pickle.dumps(hit)), copy.deepcopy(hit)):
        assert [each.effect for each in twin.assumptions] == [each.effect for each in hit.assumptions]


def scene_of(path, model="stated", extra="", speed=0.1, **body):
    """A hammer on a hinged plate, written and loaded."""
    path.write_text(
        """
        mesh = {{ shape = "rectangle", length = {length}, width = {width} }}
        material = {{ E = {E}, nu = 0.3, rho = {rho} }}
        section = {{ kind = "plate", thickness = {thickness} }}
        target = {{ damping_ratio = 0.01, model = "{model}"{extra} }}
        supports = {{ boundary = "hinged" }}
        striker = {{ kind = "rigid", mass = {mass} }}
        contact = {{ kind = "linear", stiffness = {stiffness} }}
        strike = {{ at = [{at}, {at}], speed = {speed}, tolerance = 1e-2 }}
        """.format(model=model, extra=extra, speed=speed, **body)
    )
    return fi.load_scene(path)


STOUT = {"length": 0.3, "width": 0.24, "E": 210e9, "rho": 7850.0, "at": 0.1}
THICK = {**STOUT, "thickness": 0.03, "mass": 0.1, "stiffness": 3e8}
LIGHT = {
    "length": 0.465, "width": 0.3, "E": 10e9, "rho": 450.0, "at": 0.12, "thickness": 1e-3, "mass": 0.05,
    "stiffness": 2e3,
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("body", "name", "better", "does"), [
    (THICK, "thin target", ', theory = "mindlin"', "has shear"),
    (LIGHT, "still air", ', air = "both sides", stretching = true', "moves the air"),
    pytest.param(
        {**STOUT, "thickness": 1e-3, "mass": 0.05, "stiffness": 1e4, "speed": 1.0}, "small deflections",
        ", stretching = true", "stiffens as it stretches", marks=pytest.mark.xdist_group("stretched"),
    ),
])  # fmt: skip
def test_a_scene_takes_the_better_model_that_its_tolerance_requires(tmp_path, body, name, better, does):
    """The thin body in a vacuum, the same with the choice left open, and with the better model stated."""
    plain, auto = (scene_of(tmp_path / "scene.toml", model, **body).run() for model in ("stated", "auto"))
    stated = scene_of(tmp_path / "scene.toml", extra=better, **body).strike()
    assert named(plain.response)[name].worst > 1e-2
    note = next(note for note in auto.notes if note.startswith("the target now") and does in note)
    assert re.search(r"which changes the .* \(.*\); that took .* s more$", note)
    assert auto.response.restitution == pytest.approx(stated.restitution, abs=1e-9) and stated.tolerance_met
    assert abs(plain.response.restitution - stated.restitution) > 1e-3


@pytest.mark.slow
def test_a_better_model_that_cannot_be_had_does_not_keep_another_away(tmp_path, monkeypatch):
    """Air and stretching are taken in at once; if that fails, each alone."""

    def without(blow, *given, make=planner.make_plan):
        if blow.target.air:
            raise fi.SimulationError("too thin an air")
        return make(blow, *given)

    monkeypatch.setattr(planner, "make_plan", without)
    run = scene_of(tmp_path / "scene.toml", "auto", **LIGHT).run()
    assert run.plan.blow.target.stretching and not run.plan.blow.target.air
    assert [note for note in run.notes if note.endswith("; that was not computed: too thin an air")]
    assert [note for note in run.notes if "stiffens as it stretches" in note and "that took" in note]


@pytest.mark.slow
def test_a_closed_form_that_cannot_be_thick_still_moves_air_and_stretches():
    run = fi.load_scene(SHIPPED / "drumstick_map.toml").run(model="auto")
    target = run.plan.blow.target
    assert target.air and target.stretching and target.theory is None
    assert [note for note in run.notes if "that was not computed: source = 'analytic' covers" in note]


def test_stretching_belongs_to_the_target_of_a_scene(tmp_path):
    with pytest.raises(ValueError, match="stretching is not a key of this table"):
        scene_of(tmp_path / "scene.toml", **THICK | {"speed": "1.0, stretching = true"})


def test_a_scene_keeps_the_simple_model_where_it_is_enough(tmp_path):
    run = scene_of(tmp_path / "scene.toml", "auto", **{**THICK, "thickness": 3e-3, "stiffness": 1e4}).run()
    assert run.plan.blow.target.theory is None and run.plan.blow.target.air is None
