"""A scene file builds what the public functions build, and says in one line what is wrong with it."""

import tomllib
from contextlib import nullcontext
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from comparing import examined, worst
from numpy.testing import assert_allclose
from scenes import SHIPPED, SMALL, TITLED, edited, load_text

import fem_impact as fi
from fem_impact.fe import assembly
from fem_impact.impact import collision
from fem_impact.model.budget import Budget
from fem_impact.modes import finding
from fem_impact.scenes import scene, sentences
from fem_impact.scenes.schema import toml_text
from fem_impact.scenes.sentences import words

SOURCE = 'source = "analytic"'
RIGID, RECTANGLE = 'kind = "rigid"\nmass = 0.03', 'shape = "rectangle"\nlength = 0.465\nwidth = 0.3'
MATERIAL = "[material]\nE = 10e9\nnu = 0.3\nrho = 450.0\n"
PLATE = f'{MATERIAL}[section]\nkind = "plate"\nthickness = 3e-3\n[target]'


def test_title_cannot_command_a_terminal(tmp_path):
    told = load_text(tmp_path, edited('title = "A small test"', r'title = "a\u001b[31m\u202e\nb"'))
    assert told.title == "a [31m  b"


def test_scene_strikes_what_the_public_functions_strike(tmp_path):
    hit = load_text(tmp_path, TITLED).strike()
    body = fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=hit.target.n_modes).damped(0.01)
    blow = {"at": [0.1395, 0.09], "speed": 2.0, "tolerance": Budget(1e-2).half}
    again = collision.strike(body, fi.Striker.rigid(0.03), fi.Contact.hertz(695e3), **blow)
    # the same calls with the same numbers, up to rounding of the scale: 1e-9 of the peak after some 1e3 rad
    assert_allclose(hit.force, again.force, rtol=0, atol=1e-9 * again.peak_force)
    assert hit.n_impacts == again.n_impacts


@pytest.mark.parametrize(("text", "law"), [
    ('"layers"\nstiffness = 1e5\nexponent = 1.2\ndepth = 2e-4\nhard_stiffness = 1e7',
     fi.Contact.layers(1e5, 1.2, depth=2e-4, hard_stiffness=1e7)),
    ('"elastic_plastic"\nstiffness = 695e3\nyield_speed = 0.1\nmass = 0.03',
     fi.Contact.elastic_plastic(695e3, yield_speed=0.1, mass=0.03)),
    ('"felt"\nstiffness = 695e3\nexponent = 1.5\nhysteresis = 0.2\nrelaxation = 1e-3',
     fi.Contact.felt(695e3, 1.5, hysteresis=0.2, relaxation=1e-3)),
])  # fmt: skip
def test_contacts_that_lose_and_a_hammer_in_a_scene(tmp_path, text, law):
    hammer = 'kind = "hammer"\nhead = 0.03\nhandle = 0.05\nstiffness = 1e4\ndamping = 2.0'
    loaded = load_text(tmp_path, edited('"hertz"\nstiffness = 695e3', text).replace(RIGID, hammer))
    hit = loaded.strike()
    assert hit.contact == law and hit.striker.mass == pytest.approx(0.08)
    assert hit.tolerance_met and hit.energy_error < 1e-12
    assert (hit.dissipated["contact"] > 0.0) == law.lossy
    assert "g" in words(loaded, hit)[1]


TURNING = 'kind = "turning"\nmass = 0.08\ninertia = 2e-5\narm = [0.01, 0.03]\npivot = [-0.2, 0.0]'


def test_a_striker_that_turns_in_a_scene(tmp_path):
    """It is the one of `Striker.turning`; the answer tells the mass felt, and what friction would do."""
    loaded = load_text(tmp_path, edited(RIGID, TURNING))
    hit = loaded.strike()
    assert_allclose(hit.striker.motion, fi.Striker.turning(0.08, 2e-5, (0.01, 0.03), pivot=(-0.2, 0.0)).motion)
    assert "felt as 57.14\xa0g off its centre" in words(loaded, hit)[1]
    assert examined(hit, "no friction").worst > 0.0


def test_a_panel_on_posts_in_a_scene(tmp_path):
    posts = "point_supports = [{ at = [0.1, 0.1] }, { at = [0.3, 0.2], stiffness = 1e4 }]"
    free, held = (load_text(tmp_path, text).modes(3) for text in (TITLED, edited(SOURCE, posts)))
    assert held.frequencies[0] == pytest.approx(100.0)  # the scale is that of the body on its posts
    assert abs(held.frequencies[1] / held.frequencies[0] - free.frequencies[1] / free.frequencies[0]) > 0.01
    assert np.abs(held.shape_at([(0.1, 0.1)])).max() < 1e-6 * np.abs(held.shape_at([(0.25, 0.1)])).max()


def test_a_plate_clamped_at_a_post_in_a_scene(tmp_path):
    posts = "point_supports = [{ at = [0.1, 0.1], clamped = 0.01 }, { at = [0.3, 0.2] }]"
    loaded = load_text(tmp_path, edited(SOURCE, posts))
    assert "clamp0" in loaded.body().edges and loaded.held["clamp0"] == "clamped"
    assert [entry[1] for entry in loaded.built.target.point_supports] == ["hinged"]
    shape = loaded.modes(3).shape_at([(0.1101, 0.1), (0.3, 0.2), (0.25, 0.1)])
    assert np.abs(shape[:2]).max() < 1e-3 * np.abs(shape[2]).max()  # at the edge of the clamp and on the other post


def test_a_held_striker_in_a_scene_comes_back(tmp_path):
    loaded = load_text(tmp_path, edited(RIGID, f"{RIGID}\nhand = {{ stiffness = 100.0, damping = 0.1, force = -0.3 }}"))
    assert loaded.make_striker().hand == fi.Hand(100.0, 0.1, -0.3)
    hit = loaded.strike(tolerance=0.1, duration=0.2, quantity="n_impacts")
    assert any(impact.start > 0.02 for impact in hit.impacts)  # half a swing at 9 Hz
    assert "held by a hand in which it swings at 9.189" in words(loaded, hit)[1]  # sqrt(100 / 0.03) / 2 pi


def test_finite_elements_in_stages_that_are_watched_agree_with_formulas_to_the_tolerance(tmp_path):
    seen, exact = [], load_text(tmp_path, TITLED).strike()
    run = load_text(tmp_path, edited('"analytic"', '"fe"')).run(lambda name: seen.append(name) or nullcontext())
    assert list(dict.fromkeys(seen)) == list(run.seconds) == ["mesh", "modes", "assembly", "vectors", "strike"]
    assert all(value > 0.0 for value in run.seconds.values())
    assert worst(run.response, exact) < 2e-2  # both are promised to 1e-2 of the exact plate


def test_tolerance_or_count_decides_how_many_modes_are_used(tmp_path):
    loose = load_text(tmp_path, TITLED)
    assert load_text(tmp_path, edited("1e-2", "1e-5")).modes().n_modes > 2 * loose.modes().n_modes
    assert loose.modes(7).n_modes == 7


def test_material_and_section_give_the_plate_its_own_mass_unless_mass_and_frequency_rescale_it(tmp_path):
    text = edited("[target]\nmass = 0.2\nfirst_frequency = 100.0", PLATE).replace('"analytic"', '"fe"')
    modes = load_text(tmp_path, text).modes(4)
    plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), 3e-3)
    system = assembly.assemble(fi.mesh.rectangle(0.465, 0.3), plate, supports={"boundary": "hinged"})
    assert_allclose(modes.mass, 0.465 * 0.3 * 450.0 * 3e-3, rtol=1e-12)
    # the scene refines to 1e-2, the default mesh is at least that good on the first four
    assert_allclose(modes.frequencies, finding.find_modes(system, n_modes=4).frequencies, rtol=2e-2)
    modes = load_text(tmp_path, edited("[target]", PLATE)).modes(4)
    assert_allclose([modes.mass, modes.frequencies[0]], [0.2, 100.0], rtol=1e-12)


def test_scene_is_frozen_and_tells_its_data_in_which_arguments_of_the_strike_can_be_replaced(tmp_path):
    loaded = load_text(tmp_path, TITLED)
    assert loaded.run(speed=1.0).response.speed == 1.0
    assert loaded.data(speed=1.0)["strike"] == {"at": [0.1395, 0.09], "speed": 1.0, "tolerance": 1e-2}
    loaded = load_text(tmp_path, TITLED)
    with pytest.raises(FrozenInstanceError):
        loaded.title = "other"
    with pytest.raises(TypeError):
        loaded.mesh.values["length"] = 1.0
    data = loaded.data()
    assert data["mesh"] == {"shape": "rectangle", "length": 0.465, "width": 0.3}
    assert data["supports"] == {"boundary": "hinged"} and data["title"] == "A small test"


def test_mesh_file_is_found_beside_the_scene(tmp_path, monkeypatch):
    monkeypatch.chdir("/")
    loaded = load_text(tmp_path, edited(RECTANGLE, 'shape = "file"\npath = "none.msh"').replace('"analytic"', '"fe"'))
    assert loaded.mesh.values["path"] == str(tmp_path / "none.msh")
    with pytest.raises((ValueError, OSError), match=str(tmp_path / "none.msh")):
        loaded.modes(1)


BAD = [
    ("length = 0.465", "lenght = 0.465", r"\[mesh\] lenght is not a key of this table; did you mean 'length'\?"),
    ("length = 0.465", 'theory = "mindlin"', r"\[mesh\] theory is not a key of this table; it has shape, length"),
    ("stiffness = 695e3", "exponent = 2", r"\[contact\] exponent is not a key .*; it has kind, stiffness, loss"),
    ("length = 0.465", "", r"\[mesh\] length is missing for shape = 'rectangle'"),
    ("length = 0.465", "length = -0.465", r"\[mesh\] length must be positive, got -0.465 m"),
    ('"rectangle"', '"rectangel"', r"\[mesh\] shape must be one of .*; did you mean 'rectangle'\?"),
    ('shape = "rectangle"', "", r"\[mesh\] shape is missing; it is one of rectangle, disk"),
    ("[strike]", "[strik]", r"\[strik\] is not a table of a scene; did you mean 'strike'\?"),
    ("title =", "titel =", r"titel is not a key of a scene; did you mean 'title'\?"),
    ("[contact]", "[[contact]]", r"contact must be a table"),
    ("mass = 0.2", "", r"\[target\] needs mass and first_frequency if there is no \[material\]"),
    ('"analytic"', '"formula"', r"\[target\] source must be one of auto, fe, analytic"),
    ('"hertz"\nstiffness = 695e3', '"between"', r"\[contact\] kind 'between' needs a striker of kind 'sphere'"),
    ("at = [0.1395, 0.09]", "", r"\[strike\] at is missing"),
    ("at = [0.1395, 0.09]", "at = [0.5, 0.09]", r"\[strike\] at must lie on the body, got \(0.5, 0.09\) m"),
    ('boundary = "hinged"', 'boundary = "hinge"', r"\[supports\] boundary must be one of clamped, hinged, free"),
    ('boundary = "hinged"', 'lef = "hinged"', r"\[supports\] .*lef.*did you mean 'left'"),
    ("mass = 0.2", "mass = 0.2\nmass = 0.3", r"not valid TOML: the same key is given twice .*line"),
    ("[target]", f"{MATERIAL}[target]", r"\[section\] is missing; \[material\] needs it"),
    (SOURCE, "point_supports = [{ stiffness = 1e4 }]", "must have at"),
    (SOURCE, "point_supports = [{ at = [0.1, 0.1], stiffness = 0 }]", "positive"),
    (SOURCE, "point_supports = [{ at = [0.1, 0.1], stiffness = 1.0, clamped = 0.01 }]",
     "must have at and perhaps stiffness, or clamped"),
    (SOURCE, "point_supports = [{ at = [9.0, 0.1], clamped = 0.01 }]",
     r"\[target\] point_supports must leave room for each clamp"),
    (RIGID, f"{RIGID}\nhand = 3.0", "hand must be a table"),
    (RIGID, f"{RIGID}\nhand = {{ stifness = 1.0 }}", "hand: stifness is not a key"),
    (RIGID, f"{TURNING}\nhand = {{ stiffness = 1.0 }}", "hand needs a striker with one rigid motion, got 6"),
    ("[target]", f"{PLATE}\nnu = 0.2", r"\[target\] nu must be left out beside \[material\], which has it"),
]  # fmt: skip


BAD_AT_ONCE = [  # as the scene is read
    ("speed = 2.0", "speed = 0", r"\[strike\] speed must be positive, got 0 m/s"),
    ("length = 0.465", 'length = "465 mm"', r"\[mesh\] length must be a number in m, got '465 mm'"),
    ("speed = 2.0", "speed = 2.0\nduration = -1", r"\[strike\] duration must be positive, got -1 s"),
    ("at = [0.1395, 0.09]", "at = [0.1, 0.2, 0.3]", r"\[strike\] at must be a point \(x, y\) in m"),
    ("at = [0.1395, 0.09]", 'at = ["0.1", "0.2"]', r"\[strike\] at must be numbers in m"),
    ("speed = 2.0", "speed = 2.0\n[observe]\npoints = [[0.1, 0.1], [0.1]]",
     r"\[observe\] points\[1\] must be a point \(x, y\) in m"),
    ("speed = 2.0", 'speed = 2.0\n[[stroke]]\nwhen = 0\nstriker = { kind = "rigid", mass = "x" }',
     r"\[\[stroke\]\] 0 \[striker\] mass must be a number in kg, got 'x'"),
    ("speed = 2.0", "speed = 2.0\n[[stroke]]\nwhen = 0\nat = [1]", r"\[\[stroke\]\] 0 at must be a point \(x, y\)"),
    ("speed = 2.0", 'speed = 2.0\n[map.over]\n"striker.mas" = [0.1]',
     r"\[map\] over: striker\.mas is not an axis; did you mean 'striker.mass'"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "text"), BAD_AT_ONCE + BAD)
def test_bad_scene_is_told_in_one_line_with_file_table_and_key(tmp_path, old, new, text):
    for source in ("analytic", "fe"):
        with pytest.raises(ValueError, match=text) as caught:
            told = load_text(tmp_path, edited(old, new).replace('"analytic"', f'"{source}"'))
            assert (old, new, text) in BAD
            told.strike()
        assert str(caught.value).startswith(f"{tmp_path / 'scene.toml'}: ") and "\n" not in str(caught.value)


@pytest.mark.parametrize("source", ["analytic", "fe"])
def test_points_beside_the_body_are_refused_before_anything_is_computed(tmp_path, source):
    """Corners and points on the rim are on it."""
    for points, kept in (([[0.465, 0.3], [0.0, 0.1]], True), ([[0.1, 0.1], [0.1, 0.31]], False)):
        text = edited("speed = 2.0", f"speed = 2.0\n[observe]\npoints = {points}")
        made = load_text(tmp_path, text.replace('"analytic"', f'"{source}"'))
        told = r"\[observe\] points must lie on the body, got \(0.1, 0.31\) m"
        with nullcontext() if kept else pytest.raises(ValueError, match=told):
            made.plan()


@pytest.mark.parametrize(
    ("raw", "text"),
    [
        (b"\xef\xbb\xbftitle = 3", "title must be text, got 3"),  # behind the mark that some editors begin with
        (b"", r"\[mesh\] is missing"),
        (b"mesh = 3", r"mesh must be a table, written \[mesh\]"),
        (b"a = " + b"[" * 50_000, "not valid TOML"),
        (b"a = " + b"9" * 5_000, "not valid TOML: .* value has 5000 digits$"),
        (b"a = 1.0\r\nb = [-.3]\r\n", r"line 2, column 6\) 'b = \[-.3\]'; numbers begin with a digit, as 0.5 does"),
        (b"a = 5.", r"'a = 5.'; numbers end with a digit, as 5.0 does"),
        (b"a = 0,4", r"'a = 0,4'; decimals stand behind a point"),
        (b"a = 03", r"'a = 03'; numbers are written as 3, 0.3 or 3e-3"),
        (b"a = 1 / 3", r"'a = 1 / 3'; numbers are written out, not computed"),
        (b"a = 400 mm", r"'a = 400 mm'; numbers stand alone, in SI units"),
        (b"a = [1 2]", r"'a = \[1 2\]'; a comma or a bracket is missing, or a number has a unit"),
        (b"[mesh]\n[mesh]", r"the table \[mesh\] stands twice \(at line 2, column 6\)"),
        (b"a = True", r"'a = True'; true and false are written small"),
        (b"a = steel", """'a = steel'; text stands between straight quotes, "so"$"""),
        (b"a 3", r"Expected '=' after a key in a key/value pair \(at line 1, column 3\) 'a 3'$"),
        (b"a" + b".a" * 50_000 + b" = 1", "a key must have at most 16 parts between dots, got 'a.a.*' and more"),
        (b"[" + b'"."."\\"" . ' * 9 + b"a]", "a key must have at most 16 parts between dots"),
    ],
    ids=["marked", "nothing", "no table", "nested", "digits", "point first", "point last", "comma", "zero", "ratio",
         "unit", "no comma", "twice", "True", "bare", "no equals", "dotted", "quoted"],
)  # fmt: skip
def test_file_that_is_no_scene_is_told_so(tmp_path, raw, text):
    (tmp_path / "scene.toml").write_bytes(raw)
    with pytest.raises(ValueError, match=text):
        scene.load_scene(tmp_path / "scene.toml")


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("disk", "radius = 5e-3", "radius = 1e308", r"\[striker\] radius must lie between 1e-09 and"),
        ("marimba_bar", "width = 0.05", "width = 1e308", r"scene\.toml: \["),
    ],
)
def test_numbers_that_are_none_or_beyond_floats_name_file_and_table_once(tmp_path, name, old, new, words):
    text = (SHIPPED / f"{name}.toml").read_text(encoding="utf-8").replace(old, new)
    with pytest.raises(ValueError, match=words) as caught:  # warnings are errors here, and would come first
        load_text(tmp_path, text).strike()
    assert str(caught.value).count("[") == 1 and str(caught.value).count(str(tmp_path / "scene.toml")) == 1


@pytest.mark.parametrize("place", ["../../../../../../../../etc/passwd", "/etc/passwd", "secret.svg", "secret.msh"])
def test_a_file_that_is_no_mesh_is_told_without_its_content(tmp_path, read_here, place):
    for name in ("secret.svg", "secret.msh"):
        (tmp_path / name).write_text("root:x:0:0:hunter2:/root\n")
    for shape in (f'shape = "file"\npath = "{place}"', f'shape = "outline"\nsource = "{place}"'):
        with pytest.raises(ValueError, match=r"scene\.toml: \[mesh\]") as caught:
            load_text(tmp_path, edited(RECTANGLE, shape).replace('"analytic"', '"fe"')).modes(1)
        assert "hunter2" not in str(caught.value) and "root:" not in str(caught.value)


@pytest.mark.parametrize(
    ("said", "written"),
    [
        ("modes up to 1.34e+04 Hz, about 232", "modes up to 13.4 kHz, about 232"),
        ("steps of 4.23e-05 s (9 per contact), to 4.5e-03", "steps of 42.3 µs (9 per contact), to 4.5 · 10⁻³"),
        ("elements of 0.011 m, about 13818 unknowns", "elements of 11 mm, about 13818 unknowns"),
        ("the target, 5e+05 kg, of mobility 1.2e-05 m/(N s)", "the target, 500 t, of mobility 12 µm/(N s)"),
        ("guitar_0.02.msh: 52 sides of 2 smooth curves", "guitar_0.02.msh: 52 sides of 2 smooth curves"),
    ],
)
def test_sentences_of_a_plan_are_tidied(said, written):
    assert sentences.tidy(said).replace(sentences.NBSP, " ") == written


def test_a_hertz_contact_acts_as_long_as_the_tip_that_is_told(tmp_path):
    """Hertz on a wall lasts 2.9432 (5/4)**(2/5) (m**2 / (k**2 v))**(1/5); a tip k' lasts pi sqrt(m / k')."""
    made = load_text(tmp_path, SMALL)
    k, m, v = made.contact.values["stiffness"], made.make_striker().felt_mass, made.blow.values["speed"]
    told = float(sentences.tip_notes(made)[0].rsplit("tip of ", 1)[1].split()[0])
    duration = 2.9432 * (5.0 / 4.0) ** 0.4 * (m**2 / (k**2 * v)) ** 0.2
    assert_allclose(told, m * (np.pi / duration) ** 2, rtol=6e-3)  # three digits are printed
    assert sentences.tip_notes(load_text(tmp_path, SMALL.replace('"hertz"', '"linear"'))) == ()  # that is a tip


def test_a_scene_written_again_keeps_its_words_and_numbers(tmp_path):
    """Signs beyond the first plane, which JSON writes as pairs, and a number of numpy."""
    tables = load_text(tmp_path, TITLED).data(speed=np.float64(0.1) * 3.0) | {"title": 'µ "drum" \\ \U0001f941 −'}
    assert load_text(tmp_path, toml_text(tables)).data() == tables
    assert tomllib.loads(toml_text({"title": "\x7f"})) == {"title": "\x7f"}


def test_a_ball_meets_a_flat_bar_as_it_meets_any_flat_body_of_the_material(tmp_path):
    """The kind of the section was blamed, as if only plates were flat."""
    text = """
        mesh = { shape = "line", length = 1.0 }
        material = { E = 10e9, nu = 0.3, rho = 500.0 }
        section = { kind = "beam", width = 0.03, height = 0.01 }
        striker = { kind = "sphere", radius = 0.01, E = 210e9, nu = 0.3, rho = 7850.0 }
        contact = { kind = "between" }
        strike = { at = [0.3], speed = 1.0 }
    """
    scene = load_text(tmp_path, text)
    flat = fi.Contact.between(scene.make_striker(), scene.built.target.section.material)
    assert scene.make_contact() == flat and scene.strike().tolerance_met
