"""Blows that follow a hand are the blows of `strike`, and what is sent to the page is what they are."""

import base64
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scenes import BAR, TITLED, edited, load_text

import fem_impact as fi
from fem_impact.impact import accuracy
from fem_impact.pages import explore_model, explore_numbers, explore_view
from fem_impact.scenes.scene import scene_of
from fem_impact.scenes.schema import toml_text
from fem_impact.show import sound


def test_start_is_the_scene(stand):
    assert not stand.by_vectors and stand.excited_at(stand.start.at) is None  # a body in closed form keeps its modes
    hit, scene = stand.case(stand.start).blow(), stand.scene.strike(target="modal")
    # both promise 1e-2 or better
    assert hit.n_impacts == scene.n_impacts and hit.impulse == pytest.approx(scene.impulse, rel=1e-2)


def test_exponent_leaves_the_contact_time_on_a_wall(stand):
    durations = [
        accuracy.contact_duration(stand.law(replace(stand.start, exponent=p)), stand.start.mass, stand.start.speed)
        for p in (1.0, 1.5, 2.7)
    ]
    np.testing.assert_allclose(durations, durations[0], rtol=1e-12)  # a closed form, met to rounding


LOSING = {
    "layers": ("exponent = 1.2\ndepth = 2e-4\nhard_stiffness = 1e7", 0.0),
    "felt": ("exponent = 1.5\nhysteresis = 0.4\nrelaxation = 1e-3", None),
    "elastic_plastic": ("yield_approach = 1e-4", None),
}


@pytest.mark.parametrize("kind", LOSING)
def test_contacts_that_lose_start_as_the_scene_has_them(stand, kind):
    text, loss = LOSING[kind]
    tables = stand.scene.data() | {"contact": tomllib.loads(f'kind = "{kind}"\nstiffness = 5e5\n{text}')}
    setup = replace(stand, scene=scene_of(tables, stand.scene.path, folder=stand.scene.path.parent))
    setup = replace(setup, base=replace(stand.base, contact=setup.scene.make_contact()))
    law = setup.scene.make_contact()
    np.testing.assert_allclose(setup.law(setup.start).numbers, law.numbers, rtol=1e-12)  # rounding of a power
    assert setup.start.loss == loss  # no slider for a contact that cannot have a loss factor
    twice = setup.law(replace(setup.start, stiffness=2.0))
    assert twice.stiffness == pytest.approx(2.0 * law.stiffness) and replace(twice, stiffness=law.stiffness) == law
    saved = scene_of(setup.saved(setup.start), stand.scene.path, folder=stand.scene.path.parent).make_contact()
    np.testing.assert_allclose(saved.numbers, law.numbers, rtol=1e-12)


def test_guessed_compliance_gives_the_same_blow_where_it_is_right(stand):
    exact = stand.case(stand.start).blow()
    guessed = stand.case(stand.start, stand.residual_at(stand.start.at)).blow()
    assert guessed.impulse == pytest.approx(exact.impulse, rel=1e-9)  # the same numbers by another way
    assert stand.case(stand.start, 0.0).blow().impulse != exact.impulse


def test_damping_loss_and_thickness_change_the_blow_as_a_new_body_would(stand):
    thick, start = stand.case(replace(stand.start, thickness=1.5)).modes, stand.base.modes
    assert thick.mass == pytest.approx(1.5 * start.mass)
    np.testing.assert_allclose(thick.frequencies, 1.5 * start.frequencies, rtol=1e-12)
    assert (stand.case(replace(stand.start, damping=0.07)).modes.damping_ratio == 0.07).all()
    lossy = stand.case(replace(stand.start, loss=1.0))
    assert lossy.contact.loss == 1.0
    assert lossy.blow().restitution != stand.case(stand.start).blow().restitution


STRIKERS = {
    "hammer": "head = 0.02\nhandle = 0.1\nstiffness = 1e4\ndamping = 0.5",
    "turning": "mass = 0.03\ninertia = 1e-5\narm = [0.01, 0.02]",
    "bar": "E = 1e10\nrho = 700.0\nlength = 0.3\nat = 0.25\ndiameter = 0.014",
    "stick": "mass = 0.04\nfirst_frequency = 300.0\nslenderness = 20.0",
    "sphere": "radius = 0.01\nE = 2e11\nnu = 0.3\nrho = 7800.0",
}


@pytest.mark.parametrize("kind", STRIKERS)
def test_a_saved_striker_is_the_one_on_the_page(kind, tmp_path):
    text = edited('kind = "rigid"\nmass = 0.03', f'kind = "{kind}"\n{STRIKERS[kind]}')
    setup = explore_model.Setup.of(load_text(tmp_path, text))
    bending = setup.start.bending and 1.5 * setup.start.bending
    settings = replace(setup.start, mass=1.4 * setup.start.mass, bending=bending)
    shown = setup.case(settings).striker
    saved = scene_of(setup.saved(settings), setup.scene.path, folder=tmp_path).make_striker()
    # to the rounding of its modes; their numbers are closed formulas or the same meshes
    assert saved.mass == pytest.approx(shown.mass, rel=1e-9)
    np.testing.assert_allclose(saved.modes.frequencies, shown.modes.frequencies, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(
        saved.modes.shape_at(saved.at[None]) ** 2, shown.modes.shape_at(shown.at[None]) ** 2, rtol=1e-6, atol=1e-9
    )


def test_another_mallet_that_requires_another_model_finds_other_modes(tmp_path):
    """A hard one needs shear at 1e-3, a soft one does not; the page had the modes of the one before."""
    bar = edited("{ x = [0.0, 0.175], values = [0.05, 0.04] }", "0.05", BAR)
    text = bar.replace("[target]", '[target]\nmodel = "auto"').replace("1e-2", "1e-3")
    hard = explore_model.Setup.of(load_text(tmp_path, text.replace("1e5", "1e6")))
    soft = explore_model.Setup.of(load_text(tmp_path, text.replace("1e5", "1e3")), before=hard)
    assert hard.base.modes.thick and not soft.base.modes.thick
    assert soft.scene.target.values.get("theory") is None


SECTION = '[material]\nE = 1e10\nnu = 0.3\nrho = 450.0\n[section]\nkind = "plate"\nthickness = 3e-3\n[supports]'
OWN = (
    edited("mass = 0.2\nfirst_frequency = 100.0\n", "")
    .replace('source = "analytic"\n', "")
    .replace("[supports]", SECTION)
)


@pytest.mark.parametrize(
    ("old", "new", "barred"),
    [
        ("[section]", "[section]", set()),
        ("[section]", "[section]\ntension = 1e4", {"thickness"}),
        ("[target]", '[target]\ntheory = "mindlin"', {"thickness"}),
        ("[target]", "[target]\nstretching = true", {"thickness"}),
        ("[target]", "[target]\npoint_masses = [{ at = [0.2, 0.1], mass = 0.1 }]", {"thickness"}),
        ("[target]", "[target]\npoint_supports = [{ at = [0.2, 0.1], stiffness = 1e4 }]", {"thickness"}),
        ('boundary = "hinged"', "boundary = { stiffness = 1e5 }", {"thickness"}),
        ("3e-3", "{ x = [0.0, 0.4], y = [0.0, 0.3], values = [[2e-3, 3e-3], [3e-3, 4e-3]] }", {"thickness"}),
        ("[target]", '[target]\nair = "both sides"', {"thickness", "damping"}),
    ],
)
def test_numbers_that_do_not_rescale_the_body_have_no_slider(stand, old, new, barred, tmp_path):
    """Bodies of which thickness, or damping beside that of the air, make modes that the page does not know."""
    setup = replace(stand, scene=load_text(tmp_path, edited(old, new, OWN)))
    assert setup.barred == barred and not barred & set(explore_view.ends(setup))


@pytest.mark.parametrize(
    ("table", "line", "words"),
    [
        ("[striker]", "gravity = 9.8", "striker must not fall in .* live page"),
        ("[strike]", "max_impacts = 1", "max_impacts must be left out"),
        ("[strike]", "duration = 0.1\ntarget_force = 1.0", "target_force must be left out"),
        ("[striker]", "hand = { stiffness = 100.0 }", "striker must not be held"),
        ("[strike]", "", r"\[\[stroke\]\] must be left out"),
    ],
)
def test_blows_that_the_page_does_not_follow_are_refused(table, line, words, tmp_path):
    text = edited(table, f"{table}\n{line}") + ("" if line else "[[stroke]]\nwhen = 0.0\n[[stroke]]\nwhen = 0.1\n")
    with pytest.raises(ValueError, match=words):
        explore_model.Setup.of(load_text(tmp_path, text))


def test_a_saved_scene_strikes_as_the_page_does(stand, tmp_path):
    settings = replace(stand.start, mass=1.2 * stand.start.mass, damping=0.02, thickness=1.1, exponent=1.3)
    saved = load_text(tmp_path, toml_text(stand.saved(settings))).strike(target="modal", tolerance=1e-3)
    shown = stand.case(settings).blow()
    assert saved.n_impacts == shown.n_impacts
    assert saved.impulse == pytest.approx(shown.impulse, rel=5e-3)  # both promise 1e-3


ELEMENTS = TITLED.replace('source = "analytic"', 'source = "fe"').replace("stiffness = 695e3", "stiffness = 2e6")


@pytest.mark.slow
def test_hard_blows_on_elements_are_resolved_by_vectors(tmp_path):
    """Where the first modes leave the contact unresolved; against a thousand modes in closed form."""
    setup = explore_model.Setup.of(load_text(tmp_path, ELEMENTS))
    seen = setup.excited_at(setup.start.at)
    assert setup.by_vectors and seen.poorer and setup.base.modes.n_modes == explore_model.FIRST_LOOK
    body = fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=1000, damping_ratio=0.01)
    assert setup.mesh.points.max() == pytest.approx(0.465)
    for changes in ({"stiffness": 100.0, "mass": 0.01}, {"damping": 0.05, "thickness": 1.5}):
        settings = replace(setup.start, **changes)
        case = setup.case(settings, body=seen)
        hit, few = case.blow(), setup.case(settings).blow()
        ratio = settings.thickness
        truth = fi.strike(
            body.scaled(mass=0.2 * ratio, first_frequency=100.0 * ratio).damped(settings.damping),
            case.striker, case.contact, at=case.at, speed=case.speed, tolerance=1e-4, max_impacts=hit.n_impacts,
        )  # fmt: skip
        assert hit.error.resolvable and hit.error.total < min(2e-2, few.error.total)
        assert hit.peak_force == pytest.approx(truth.peak_force, rel=max(1e-3, hit.error.total))
        assert hit.impacts[0].impulse == pytest.approx(truth.impacts[0].impulse, rel=max(1e-3, hit.error.total))


def test_the_first_answer_to_a_slider_is_the_blow_but_for_small_errors(stand):
    rng, compared = np.random.default_rng(5), 0
    for _ in range(12):
        settings = replace(stand.start, **{
            name: float(np.exp(rng.uniform(*np.log(stand.range(name))))) for name in ("mass", "stiffness", "speed")
        }, loss=float(rng.choice([0.0, 0.3]) / stand.start.speed))  # fmt: skip
        case = stand.case(settings)
        fast = explore_model.strike_quickly(case)
        assert len(fast.history.steps) < 5_000  # some 5 ms
        slow = case.blow()
        if slow.n_impacts <= 2:  # more of them are sensitive to everything
            compared += 1
            assert fast.n_impacts == slow.n_impacts
            assert (fast.peak_force, fast.impulse) == pytest.approx((slow.peak_force, slow.impulse), rel=2e-2)
    assert compared >= 6


def unpacked(text):
    return np.frombuffer(base64.b64decode(text), "<f4")


def test_judged_blow_is_sent_whole(explorer):
    setup = explorer.setup
    told, hit = explorer.judge(setup.start), setup.case(setup.start).blow(tolerance=setup.tolerance)
    assert hit.tolerance == setup.scene.blow.values["tolerance"] == 1e-2  # the scene's own
    cells, force, time = dict(told["cells"]), unpacked(told["force"]), unpacked(told["time"])
    assert cells["impacts"] == str(hit.n_impacts) and cells["restitution"] == f"{hit.restitution:.3f}"
    assert told["verdict"] == hit.verdict and told["model"] == hit.model_verdict[1:] and not told["missed"]
    assert told["trusted"] == hit.trusted
    assert force.max() == pytest.approx(hit.force.max(), rel=1e-6)  # 32-bit floats
    assert len(force) == len(time) and time[-1] >= hit.impacts[-1].end
    band = np.geomspace(*explore_numbers.BAND, explore_numbers.SPECTRUM_POINTS)
    spectrum = np.abs(hit.spectrum(band))
    np.testing.assert_allclose(unpacked(told["spectrum"]), spectrum, atol=2e-3 * spectrum.max())  # a pixel of 300


def test_answer_says_that_it_is_not_the_last_word(explorer):
    told, hit = explorer.answer(explorer.setup.start)
    assert dict(told["cells"])["estimated error"] == "refining …" and "verdict" not in told
    rest = explorer.rest_of(explorer.setup.start, hit)
    scene = tomllib.loads(base64.b64decode(rest["scene"].partition(",")[2]).decode())
    assert scene["strike"]["at"] == list(explorer.setup.start.at)
    assert rest["limit"] == pytest.approx(explore_model.limit_of(explorer.case(explorer.setup.start)))
    assert "× threshold" in rest["resonates"]


def test_only_the_latest_strike_points_are_remembered(explorer):
    for i in range(explore_numbers.KNOWN + 3):
        explorer.learn((0.1, 0.01 * i), explore_numbers.View(1e-6 * i, None))
    assert len(explorer.views) == explore_numbers.KNOWN and (0.1, 0.0) not in explorer.views
    assert explorer.rest == 1e-6 * (explore_numbers.KNOWN + 2)


@pytest.mark.slow
def test_blows_and_rolls_are_heard_on_the_surface_and_above_it(explorer):
    start, where = explorer.setup.start, explorer.setup.start.at
    on, above, roll = (explorer.listen(start, where, h, rate) for h, rate in ((0.0, None), (1.5, None), (0.0, 12.0)))
    assert "the surface at" in on["note"] and " above (" in above["note"] and "Pa; full scale" in above["note"]
    assert len({on["uri"], above["uri"], roll["uri"]}) == 3
    assert all(each["uri"].startswith("data:audio/wav;base64,") for each in (on, above, roll))
    soft = replace(start, stiffness=1e-4 * start.stiffness)  # contact lasts 40 times as long: next to nothing rings
    case, asked = explorer.setup.case(soft), f"sound={sound.RATE // 2}"
    right = sound.synthesise(case.blow(tolerance=1e-6, quantity=asked), where, duration=1.0)
    for rate in (None, 3.0):  # far apart, the blows of a roll are alike
        heard = explorer.listen(soft, where, 0.0, rate)
        assert heard["peak"] == pytest.approx(right.full_scale * 10.0 ** (right.peak_level / 20.0), rel=0.02)
