"""Tolerance in, smallest model out: what is modelled, that it meets the tolerance, and that each piece can be set."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from comparing import difference, refusing
from numpy.testing import assert_allclose
from scenes import SHIPPED, load_text

import fem_impact as fi
from fem_impact._base import check
from fem_impact.fe import assembly, refinement
from fem_impact.impact import collision
from fem_impact.model import asked, by_modes, by_vectors, cost, planner
from fem_impact.modes import analytic

STEEL = "E = 210e9, nu = 0.3, rho = 7850.0"


def blow(mesh, body, striker, contact, strike):
    """The text of a scene with a hinged plate."""
    tables = {"mesh": mesh, "supports": 'boundary = "hinged"', "striker": striker, "contact": contact, "strike": strike}
    return "".join(f"{name} = {{ {table} }}\n" for name, table in (tables | body).items())


def steel(thickness):
    return {"material": STEEL, "section": f'kind = "plate", thickness = {thickness}'}


def ball(length, tolerance):
    """A steel ball on a wide plate."""
    mesh, sphere = f'shape = "rectangle", length = {length}, width = 0.8', f'kind = "sphere", radius = 0.004, {STEEL}'
    strike = f"at = [0.5, 0.4], speed = 1.0, tolerance = {tolerance}"
    return blow(mesh, steel(0.004), sphere, 'kind = "between"', strike)


def plate(mass):
    """A stick on a plate of some mass [kg]."""
    return blow(
        'shape = "polygon", corners = [[0, 0], [1.5, 0], [1.5, 1.0], [0, 1.0]]',
        {"target": f"mass = {mass}, first_frequency = 100.0"},
        'kind = "stick", mass = 0.1, first_frequency = 10e3',
        'kind = "linear", stiffness = 88.6e3',
        "at = [0.465, 0.3], speed = 1.0, tolerance = 1e-3",
    )


@pytest.fixture
def scene(tmp_path):
    return partial(load_text, tmp_path)


@pytest.fixture
def no_elements(monkeypatch):
    """Nothing may be assembled for the target; the stick is a beam of its own, on a line."""
    assembled = assembly.assemble

    def refuse(mesh, *args, **kwargs):
        assert mesh.dimension == 1, "a plate was assembled"
        return assembled(mesh, *args, **kwargs)

    monkeypatch.setattr(assembly, "assemble", refuse)


def test_plate_of_500_t_is_rigid_and_costs_no_elements(scene, no_elements):
    plan = fi.plan(SHIPPED / "heavy_plate.toml")
    assert (plan.target, plan.element, plan.n_dofs, plan.n_modes) == ("rigid", None, 0, 0)
    hit = plan.strike()
    assert hit.error.idealisation == plan.errors["rigid target"] < 0.45e-4  # its share of the tolerance
    # Euphonics 12.1.1: half a period of m/3 on the spring; the stick's bending and the tolerance of 1e-4
    assert_allclose(hit.contact_time, np.pi * np.sqrt(0.1 / 3.0 / 88.6e3), rtol=1e-3)
    outlined = scene(plate(500e3)).plan()  # by its corners
    assert outlined.target == "rigid" and difference(outlined.strike(), hit) < 1e-3  # the tolerance


def test_a_light_plate_and_one_whose_motion_is_observed_are_not_rigid(scene):
    assert scene(plate(0.2)).plan().target == "vectors"
    assert scene(plate(500e3) + "[observe]\npoints = [[0.1, 0.1]]\n").plan().target == "vectors"


@pytest.mark.parametrize("name", ["rigid", "modal"])
def test_verifying_run_finds_what_the_estimate_promises(scene, name):
    """A target taken as rigid by a modal one; another by more modes."""
    run = (scene(plate(500e3)) if name == "rigid" else fi.load_scene(SHIPPED / "drumstick_map.toml")).run(verify=True)
    assert 0.0 < max(run.verified.values()) < 1e-3  # the tolerance
    assert run.finer.target == "modal" and (run.plan.target == "rigid") == (name == "rigid")
    if name == "modal":
        assert run.finer.n_modes > run.plan.n_modes and run.verified["n_impacts"] == 0.0
        assert run.finer.error < run.plan.tolerance / 8.0  # what judges errs little beside what it judges: 0.084 of it


def test_ball_on_a_wide_thin_plate_meets_no_echo(scene):
    """Zener's plate: no edge matters to the ball; the finite plate has thousands of modes below the contact's."""
    wide = scene(ball(1.0, 1e-2))
    plan = wide.plan()
    assert plan.target == "infinite" and plan.n_dofs == 0
    stiff = 210e9 * 0.004**3 / (12.0 * (1.0 - 0.3**2))
    assert_allclose(plan.mobility, 1.0 / (8.0 * np.sqrt(stiff * 7850.0 * 0.004)), rtol=1e-9)
    modal = fi.analytic.rectangle(
        1.0, 0.8, section=fi.Plate(fi.Material(210e9, 0.3, 7850.0), 0.004), max_frequency=60e3
    )
    reference = fi.strike(modal, wide.make_striker(), wide.make_contact(), at=(0.5, 0.4), speed=1.0, tolerance=1e-4)
    hit = plan.strike()
    assert difference(hit, reference) < 1e-2 and hit.n_impacts == reference.n_impacts == 1
    vast = scene(ball(50.0, 1e-3))
    with pytest.raises(check.SimulationError, match="modes"):
        vast.plan(target="modal")
    assert vast.plan().target == "infinite"


@pytest.mark.parametrize(("seed", "loss"), [(1, 0.0), (4, 0.0), (10, 0.0), (13, 0.0), (11, 0.3), (13, 0.3)])
def test_the_modes_planned_suffice_at_the_first_attempt(seed, loss):
    rng = np.random.default_rng(seed)
    mesh = fi.mesh.rectangle(rng.uniform(1.0, 2.0), 1.0)
    section = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), rng.uniform(2e-3, 8e-3))
    law = fi.Contact.linear(10 ** rng.uniform(4.0, 5.5)) if seed % 2 else fi.Contact.hertz(10 ** rng.uniform(5.0, 7.0))
    law, blow = replace(law, loss=loss), {"at": tuple(rng.uniform(0.2, 0.8, 2)), "speed": 1.0}
    striker = fi.Striker.rigid(10 ** rng.uniform(-2.2, -1.0))
    modes = analytic.closed_form(mesh, section, {"boundary": "hinged"})(n_modes=3000)
    plan = fi.plan(modes, striker, law, **blow, tolerance=1e-3)
    run = plan.run()
    assert run.response.tolerance_met
    assert run.plan.n_modes < 1.35 * plan.n_modes  # Weyl's law is 25 % off at most; a second attempt takes 60 % more
    truth = collision.strike(modes, striker, law, **blow, tolerance=1e-5)
    assert difference(run.response, truth) < run.response.tolerance


@pytest.mark.parametrize(
    ("thickness", "target", "n_modes", "by_modes"), [(0.5e-3, "modal", 7000, 6980), (0.3e-3, "mixed", 500, 32536)]
)
def test_a_plate_counts_as_infinite_above_a_frequency_where_all_its_modes_are_too_many(
    scene, thickness, target, n_modes, by_modes
):
    mesh, mass = 'shape = "rectangle", length = 0.4, width = 0.3', 'kind = "rigid", mass = 4.11e-3'
    law, strike = 'kind = "hertz", stiffness = 1.09e10', "at = [0.13, 0.11], speed = 1e-3, tolerance = 1e-2"
    plan = scene(blow(mesh, steel(thickness), mass, law, strike)).plan()
    assert plan.target == target and plan.n_modes < n_modes
    whole = plan.but(target="modal")
    assert whole.n_modes == pytest.approx(by_modes, rel=1e-2)
    found = plan.blow.target.closed(max_frequency=whole.max_frequency)
    assert found.n_modes == pytest.approx(whole.n_modes, rel=1e-2)


@pytest.mark.slow  # ten seconds
def test_a_plate_that_is_infinite_only_far_up_is_described_by_vectors_after_all():
    """Its echoes matter up to 100 kHz; vectors cost less than modes up to there."""
    a, b, steel = 0.0985, 0.0592, fi.Material(210e9, 0.3, 7850.0)
    sheet = fi.assemble(fi.mesh.rectangle(a, b), fi.Plate(steel, 0.681e-3), {"boundary": "hinged"})
    how = {"at": (0.5013 * a, 0.3378 * b), "speed": 0.34734, "tolerance": 1e-2}
    plan = fi.plan(sheet, fi.Striker.rigid(0.05339), fi.Contact.power(6.3057e17, 2.7703), **how)
    run = plan.run()
    assert plan.target == "mixed" and run.plan.target == "vectors" and run.response.tolerance_met
    assert run.response.n_impacts == 2 and plan.seconds > run.plan.seconds  # all that may follow is foreseen


@pytest.mark.slow
def test_modes_of_a_costly_plan_are_kept_and_taken_up_again(tmp_path, monkeypatch):
    """Broken off after the modes were found, the next run starts with them; other modes are found anew."""
    monkeypatch.setattr(asked, "COSTLY", (0.0, 0.0))
    scene, keep, solved, solve = (
        fi.load_scene(SHIPPED / "marked_linear.toml"), tmp_path / "modes.npz", [], refinement.solve_on_mesh,
    )  # fmt: skip
    monkeypatch.setattr(refinement, "solve_on_mesh", lambda *args: solved.append(args[2]) or solve(*args))

    def run():
        return scene.run(keep=keep, tolerance=1e-2, target="modal").response

    def broken_off(*args, **kwargs):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(planner.collision, "strike", broken_off)
        run()
    hit = run()
    limits = [limit for limit in solved if limit]  # by frequency; the stick and the first look go by number
    assert limits and len(set(limits)) == len(limits)
    assert difference(hit, scene.strike(tolerance=1e-2, target="modal")) == 0.0
    keep.write_bytes(keep.read_bytes()[:1000])  # damaged: found anew
    assert difference(run(), hit) == 0.0


def test_sound_and_spectrum_bring_the_modes_they_need(scene):
    plan = fi.plan(SHIPPED / "heavy_plate.toml", quantity="sound=2000")
    assert plan.target == "modal" and plan.max_frequency >= 2000.0
    hit = plan.strike()
    assert hit.target.frequencies[-1] > 0.8 * 2000.0 and hit.target.n_modes > 20
    assert fi.plan(SHIPPED / "heavy_plate.toml", quantity={"spectrum": 5e3}).target == "rigid"


@pytest.fixture(scope="module")
def drum():
    return fi.plan(SHIPPED / "drumstick_map.toml")


def test_plan_says_what_it_keeps_and_drops_and_what_that_costs(drum):
    text = str(drum)
    words = "modes up to", "act as a spring", "bending modes", "scheme A4", "target modes left out", "steps", "MB"
    for word in (*words, *drum.reasons, f"{drum.error:.1e}", drum.cost):
        assert word in text
    assert drum.error == pytest.approx(sum(drum.errors.values()))
    assert 0.0 < drum.error <= 1.1e-3  # the tolerance of the scene; the mesh's share is extra
    assert drum == fi.plan(SHIPPED / "drumstick_map.toml") and drum.data() == drum.but().data()


def test_every_piece_can_be_set_and_taken_back_and_a_smaller_tolerance_takes_a_larger_model(drum):
    fine, coarse = drum.but(tolerance=1e-4), drum.but(tolerance=1e-2)
    assert fine.n_modes > coarse.n_modes and fine.dt < coarse.dt and fine.seconds >= coarse.seconds
    assert fine.error <= 1e-4 and coarse.error <= coarse.tolerance
    fewer = drum.but(n_modes=30)
    assert fewer.n_modes == 30 and fewer.errors["target modes left out"] > drum.errors["target modes left out"]
    assert fewer.strike().target.n_modes == 30
    assert drum.but(max_frequency=3000.0).strike().target.frequencies[-1] <= 3000.0
    assert drum.but(n_striker_modes=1).strike().bodies[0].n_modes == 1
    assert drum.but(target="rigid").strike().restitution > 0.99
    assert drum.but(scheme="A", dt=1e-5).strike().scheme == "A"
    assert (fewer.but(scheme="A").n_modes, fewer.but(scheme="A").scheme) == (30, "A")
    assert fewer.but(n_modes=None) == drum
    usual, sized = (fi.plan(SHIPPED / "marked_linear.toml", tolerance=1e-2, size=size) for size in (None, 0.1))
    assert sized.size == 0.1 and sized.n_dofs < usual.n_dofs


test_wrong_pieces_are_named = refusing([
({"target": "wall"}, "target must be one of rigid, infinite, vectors, mixed, modal, got 'wall'"),
({"n_modes": 0}, "n_modes"),
({"size": -1.0}, "size must be positive"),
], lambda changes: fi.plan(SHIPPED / "drumstick_map.toml", **changes))  # fmt: skip


WOOD, MALLET = fi.Material(10e9, 0.3, 450.0), (fi.Striker.rigid(0.02), fi.Contact.hertz(1e7))


@pytest.mark.parametrize("at, words", [
    ((0.9, 0.09), r"at must lie on the body, got \(0.9, 0.09\) m; the body extends"),
    (0.13, r"at must be a point \(x, y\) in m, got 0.13"),
    ([(0.1, 0.1), (0.2, 0.1)], "at must be one point, got 2"),
])  # fmt: skip
@pytest.mark.parametrize("target", [None, "vectors", "modal"])
def test_a_point_beside_the_body_is_refused_before_anything_is_planned(at, words, target):
    body = fi.assemble(fi.mesh.polygon([(0.0, 0.0), (0.4, 0.0), (0.4, 0.3), (0.1, 0.2)]), fi.Plate(WOOD, 3e-3))
    with pytest.raises(ValueError, match=words):
        fi.plan(body, *MALLET, at=at, speed=1.0, target=target)


def test_a_slip_of_a_unit_is_told_before_what_follows_from_it():
    how, mesh, held = {"at": (0.13, 0.1), "speed": 1.0}, fi.mesh.rectangle(0.4, 0.3), {"left": "clamped"}
    soft = fi.assemble(mesh, fi.Plate(fi.Material(10.0, 0.3, 450.0), 3e-3), held)
    with pytest.raises(check.SimulationError, match=r"^E = 10 Pa is softer than rubber; .* 210e9: this blow needs"):
        fi.plan(soft, *MALLET, **how, target="modal")
    plan = fi.plan(fi.assemble(mesh, fi.Plate(WOOD, 3.0), held), *MALLET, **how)
    for told in (str(plan), plan.strike().summary()):
        assert told.splitlines()[1].startswith("Note: thickness 3 m is 10 times the shortest side")


def test_whatever_a_plan_cannot_do_names_the_file(monkeypatch):
    def fails(*_):
        raise check.SimulationError("the mesher could not fill the outline")

    monkeypatch.setattr(planner, "choose", fails)
    with pytest.raises(check.SimulationError, match=r"^\S+/drumstick_map\.toml: the mesher could not"):
        fi.plan(SHIPPED / "drumstick_map.toml")


@pytest.mark.parametrize(
    ("target", "words"),
    [(None, "take a softer striker or contact, with stiffness ="), ("mixed", "its modes has too many unknowns")],
)
def test_a_mesh_too_fine_for_the_echoes_is_known_before_the_blow(target, words):
    glass = fi.Material(70e9, 0.22, 2500.0)
    pane = fi.assemble(fi.mesh.rectangle(1.0, 1.0), fi.Plate(glass, 3e-3), {"boundary": "hinged"})
    ball = fi.Striker.sphere(fi.Material(210e9, 0.3, 7850.0), 0.005)
    with pytest.raises(check.SimulationError, match=words):
        fi.plan(pane, ball, fi.Contact.between(ball, glass), at=(0.5, 0.5), speed=1.0, tolerance=1e-3, target=target)


def test_steps_of_a_tight_tolerance_are_in_the_predicted_time():
    modes = fi.analytic.rectangle(0.4, 0.3, section=fi.Plate(WOOD, 3e-3), n_modes=300, damping_ratio=0.005)
    how = {"at": (0.13, 0.1), "speed": 1.0, "n_modes": 300}
    loose, tight = (fi.plan(modes, *MALLET, tolerance=tolerance, **how) for tolerance in (1e-3, 1e-9))
    assert tight.seconds - cost.START > 10.0 * (loose.seconds - cost.START)


@pytest.mark.slow
def test_a_blow_that_needs_more_memory_than_there_is_is_refused_before_it_is_computed(monkeypatch):
    """A thick pane, whose 27 GB numpy refused after half a minute; the plan tells before."""
    glass = fi.Plate(fi.Material(E=70e9, nu=0.2, rho=2500.0), thickness=4e-3)
    thin, pane = (
        fi.assemble(fi.mesh.rectangle(0.3, 0.2), glass, {"boundary": "hinged"}, theory=theory)
        for theory in (None, "mindlin")
    )

    def planned(body=pane, stiffness=5e8, tolerance=1e-2):
        how = {"at": (0.11, 0.07), "speed": 1.4, "tolerance": tolerance}
        return fi.plan(body, fi.Striker.rigid(0.004), fi.Contact.hertz(stiffness), **how)

    plan = planned()
    assert plan.memory > 6e8 and "do not suffice" not in str(plan)
    monkeypatch.setattr(cost, "memory_installed", lambda: 6e8)
    assert "the 0.6 GB of memory of this machine do not suffice" in str(plan)
    with pytest.raises(fi.SimulationError, match=r"GB of memory for .* more than the 0.6 GB .* or the thin theory"):
        plan.run()
    for advised in (planned(thin), planned(stiffness=5e6), planned(tolerance=0.2)):
        assert advised.run().response.tolerance_met


def test_costly_plan_says_so():
    plan = fi.plan(SHIPPED / "marked_linear.toml", tolerance=1e-2, n_modes=2000)
    assert plan.costly and "would cost less" in str(plan)
    assert not fi.plan(SHIPPED / "drumstick_map.toml").costly


def test_the_modes_that_ring_reach_to_where_the_force_is_sixty_decibels_down(scene):
    response = scene(plate(20.0)).run(tolerance=1e-2).response
    last = response.target.frequencies[-1]  # 113 modes up to 7.2 kHz
    frequencies = np.linspace(0.0, 4.0 * last, 2000)
    force = np.abs(response.spectrum(frequencies))
    beyond = frequencies > 1.1 * last
    assert force[beyond].max() < 2e-3 * force[0]
    assert force[(frequencies > 0.8 * last) & ~beyond].max() > 5e-4 * force[0]  # and no farther


def test_motion_costs_the_modes_it_is_told_by(scene, monkeypatch):
    """A look at a few modes, then as many as ring: here no more, so that both cost the same."""
    monkeypatch.setattr(by_vectors, "ringing_count", lambda _: by_vectors.FIRST_LOOK)
    still, moving = (
        scene(plate(20.0) + extra).plan(target="vectors") for extra in ("", "[observe]\npoints = [[0.1, 0.1]]\n")
    )
    look = by_modes.ringing_work("argyris", by_vectors.FIRST_LOOK, moving.description.asked.close)
    assert moving.seconds - still.seconds == pytest.approx(2.0 * look.seconds, rel=1e-6)


@pytest.mark.parametrize(("how", "n_modes"), [({}, 120), ({"rise": fi.rise.cap(3.0)}, 60), ({"theory": "mindlin"}, 60)])
@pytest.mark.parametrize("tolerance", [1e-5, 2e-3])
def test_modes_that_ring_are_foretold_by_the_meshes_they_take(how, n_modes, tolerance, monkeypatch):
    """Within a fifth: the mesher makes triangles as they fit. Of a curved plate a coarser mesh tells the errors."""
    foretold, sizes = [], []
    monkeypatch.setattr(cost, "by_modes", lambda n, _: foretold.append(n) or cost.NOTHING)
    pairs = refinement._pairs
    monkeypatch.setattr(refinement, "_pairs", lambda body, *how: sizes.append(body.n_dofs) or pairs(body, *how))
    plate = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 0.8e-3)
    body = fi.assemble(fi.mesh.rectangle(0.5, 0.4), plate, {"boundary": "clamped"}, **how)
    side = refinement.longest_side(body.rules, tolerance)
    fine = refinement.fine_enough(body, refinement.size_for(body, n_modes, None, side))
    refinement.solve_on_mesh(fine, n_modes, None)
    by_modes.ringing_work(body.element, n_modes, tolerance)
    assert_allclose(foretold, sizes, rtol=0.2)


def test_a_better_description_that_fails_leaves_what_there_is(scene, monkeypatch):
    class Broken(by_modes.Modal):
        def found(self, stages, keep=None):
            raise check.SimulationError("too many steps")

    plan = scene(plate(20.0)).plan(tolerance=1e-2, target="modal")
    monkeypatch.setattr(by_modes.Modal, "refined", lambda self, hit, stages: Broken(self.asked, self.forecast, False))
    run = plan.run()
    assert run.plan.n_modes == run.response.target.n_modes and run.response.n_impacts > 0
    with pytest.raises(check.SimulationError, match="too many steps"):
        replace(plan, description=Broken(plan.description.asked, plan.description.forecast, False)).run()


def test_the_modes_that_only_files_take_are_told_besides():
    """The command says 5 s of this guitar and then takes a minute, most of it for the sound at the point struck."""
    scene = fi.load_scene(SHIPPED / "everyday" / "guitar_fingernail.toml")
    plan = scene.plan()
    moving = planner.make_plan(replace(plan.blow, moving=True), {}, planner.Stages())
    assert_allclose(plan.seconds + plan.ringing, moving.seconds, rtol=1e-12)
    assert moving.ringing == 0.0 < plan.ringing and "once they are asked for" in str(plan)
    heavy = fi.plan(SHIPPED / "heavy_plate.toml", tolerance=1e-2)
    assert heavy.target in ("rigid", "infinite") and heavy.ringing == 0.0


def test_a_blow_whose_modes_turn_out_too_few_is_struck_again_with_more(monkeypatch):
    kept, truly = [], collision.strike

    def strike(modes, *given, **options):
        kept.append(modes.n_modes)
        hit = truly(modes, *given, **options)
        return replace(hit, error=replace(hit.error, truncation=1.0)) if len(set(kept)) == 1 else hit

    scene = fi.load_scene(SHIPPED / "drumstick.toml")
    monkeypatch.setattr(collision, "strike", strike)
    hit = scene.strike(target="modal")
    assert hit.tolerance_met and len(set(kept)) == 2 and kept[-1] > kept[0]
