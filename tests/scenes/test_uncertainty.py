"""Uncertain blows of scenes and bodies, and their bands: against closed forms, and the scene with other numbers."""

import json

import numpy as np
import pytest
import xarray
from numpy.testing import assert_allclose
from scenes import QUICK, SMALL, load_text
from scipy import stats

import fem_impact as fi
from fem_impact.scenes.maps import map_scene

MASS, STIFFNESS = 0.1, 1e5
WALL = fi.Modes.rigid(1e12)  # so heavy that it does not move: 1e-13 of the striker's speed
PLATE = """title = "A ball on a plate"
mesh = { shape = "rectangle", length = 0.4, width = 0.3 }
material = { E = 10e9, nu = 0.3, rho = 450.0 }
section = { kind = "plate", thickness = 3e-3 }
supports = { boundary = "hinged" }
striker = { kind = "sphere", radius = 8e-3, E = 210e9, nu = 0.3, rho = 7850.0 }
contact = { kind = "between" }
strike = { at = [0.13, 0.1], speed = 1.0, tolerance = 1e-3 }
"""
RIGID = PLATE.replace('kind = "between"', 'kind = "linear", stiffness = 1e5')
HEAVIER = {"striker.mass": ("lognormal", MASS, 0.2)}


def wall(vary, **wanted):
    blow = {"at": None, "speed": 1.0, "tolerance": 1e-5, "sobol": False, **wanted}
    return fi.spread(WALL, vary, fi.Striker.rigid(MASS), fi.Contact.linear(STIFFNESS), **blow)


@pytest.fixture
def scene(tmp_path):
    return lambda text=RIGID: load_text(tmp_path, text)


def test_contact_times_on_a_wall_are_lognormal():
    """pi sqrt(m / k) has half the sigmas of both; a Kolmogorov distance of random points would be 0.02."""
    found = wall(HEAVIER | {"contact.stiffness": ("lognormal", STIFFNESS, 0.3)}, n=2048)
    exact = stats.lognorm(0.5 * np.hypot(0.2, 0.3), scale=np.pi * (MASS / STIFFNESS) ** 0.5)
    assert stats.kstest(found.values("contact_time"), exact.cdf).statistic < 0.01
    for level in (0.05, 0.5, 0.95):
        each = found.quantile("contact_time", level)
        assert each.low <= exact.ppf(level) <= each.high
        assert_allclose(each.value, exact.ppf(level), rtol=5e-3)
    assert found.checks.apart["contact_time"] < 2e-5 and found.n_failed == 0


def test_correlated_inputs_change_the_deviation_as_the_closed_form_says():
    """Of ln T, the variance is (s1^2 + s2^2 - 2 r s1 s2) / 4."""
    inputs = HEAVIER | {"contact.stiffness": ("lognormal", STIFFNESS, 0.3)}
    found = wall(inputs, n=2048, correlation={("striker.mass", "contact.stiffness"): 0.8})
    exact = 0.5 * (0.2**2 + 0.3**2 - 2 * 0.8 * 0.2 * 0.3) ** 0.5
    assert_allclose(np.log(found.values("contact_time")).std(), exact, rtol=5e-3)


def test_what_depends_linearly_keeps_its_distribution():
    """A linear contact on a wall gives the impulse 2 m v."""
    found = wall({"strike.speed": ("uniform", 1.0, 3.0)}, n=512)
    assert_allclose(found.values("impulse"), 2.0 * MASS * found.values("strike.speed"), rtol=1e-4)
    assert found.correlations["impulse"]["strike.speed"] == pytest.approx(1.0)
    assert "restitution" not in found.varying  # it is the same in every blow


def test_the_chance_of_a_double_hit_is_the_share_of_stiffnesses_that_hit_twice():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=60)
    blow = {"at": (0.465, 0.3), "speed": 1.0, "tolerance": 1e-2}
    bodies = plate, fi.Striker.rigid(0.05), fi.Contact.linear(1e5)
    found = fi.spread(plate, {"stiffness": ("uniform", 1e4, 2e5)}, *bodies[1:], n=2048, sobol=False, **blow)
    stiffness = np.linspace(1e4, 2e5, 4001)
    table = fi.sweep(*bodies, over={"stiffness": stiffness}, **blow)
    exact = float((table.n_impacts > 1).mean())
    twice = found.chance()
    assert 0.05 < exact < 0.95 and found.chaotic
    assert twice.low <= exact <= twice.high
    assert_allclose(twice.value, exact, atol=5e-3)  # even points: within some cells of 1/2048 of each border


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("section.thickness", ("normal", 3e-3, 2e-4)),
        ("material.E", ("normal", 10e9, 1e9)),
        ("material.rho", ("normal", 450.0, 50.0)),
        ("target.mass", ("normal", 0.16, 0.01)),
        ("strike.x", ("normal", 0.13, 0.01)),
    ],
)
def test_a_blow_on_a_changed_body_is_that_of_the_changed_scene(scene, name, given):
    made = scene(RIGID + "[target]\nmass = 0.16\n" * (name == "target.mass"))
    found = fi.spread(made, {name: given}, n=8, sobol=False)
    for i in (0, 5):
        value = float(found.values(name)[i])
        if name == "strike.x":
            hit = made.strike(at=(value, 0.1), tolerance=1e-4)
        else:
            hit = made.changed({name: value}).strike(tolerance=1e-4)
        assert found.values("n_impacts")[i] == hit.n_impacts
        assert_allclose(found.values("restitution")[i], hit.restitution, atol=1e-3)
        for quantity in ("contact_time", "impulse", "peak_force"):
            assert_allclose(found.values(quantity)[i], getattr(hit, quantity), rtol=1e-3)
    assert all(error < 1e-3 for error in found.rescaled.values())
    assert bool(found.rescaled) == name.startswith(("section", "material"))


def test_size_scales_all_lengths(scene):
    found = fi.spread(scene(), {"target.size": ("uniform", 0.9, 1.1)}, n=4, sobol=False)
    for size, time, rebound in zip(*(found.values(n) for n in ("target.size", "contact_time", "restitution"))):
        other = scene(RIGID.replace("length = 0.4, width = 0.3", f"length = {0.4 * size}, width = {0.3 * size}"))
        hit = other.strike(at=(0.13 * size, 0.1 * size), tolerance=1e-4)
        assert_allclose(time, hit.contact_time, rtol=1e-3)
        assert_allclose(rebound, hit.restitution, atol=1e-3)


@pytest.mark.slow
def test_a_body_whose_modes_do_not_just_scale_says_the_error(scene):
    """Under tension, frequencies do not follow the thickness: the rescaled modes are off by more than the blow."""
    text = RIGID.replace("thickness = 3e-3", "thickness = 3e-3, tension = 2e4")
    found = fi.spread(scene(text), {"section.thickness": ("normal", 3e-3, 3e-4)}, n=8, sobol=False, tolerance=1e-2)
    assert found.rescaled["section.thickness"] > 1e-2
    assert "section.thickness: modes were rescaled; a rebuilt body differs" in found.summary()


def test_a_contact_between_bodies_follows_its_materials(scene):
    made = scene(PLATE)
    vary = {"striker.radius": ("normal", 8e-3, 4e-4), "material.E": ("normal", 10e9, 5e8)}
    found = fi.spread(made, vary, n=6, sobol=False)
    for i in (1, 4):
        hit = made.changed({name: float(found.values(name)[i]) for name in vary}).strike(tolerance=1e-4)
        assert_allclose(found.values("contact_time")[i], hit.contact_time, rtol=1e-3)
        assert_allclose(found.values("peak_force")[i], hit.peak_force, rtol=1e-3)


@pytest.mark.slow
def test_an_assembled_body_is_rebuilt_to_judge_its_rescaling():
    def body(thickness):
        plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness)
        return fi.assemble(fi.mesh.rectangle(0.4, 0.3), plate, {"boundary": "hinged"})

    bodies, vary = (fi.Striker.rigid(0.02), fi.Contact.hertz(1e6)), {"section.thickness": ("normal", 3e-3, 2e-4)}
    blow = {"at": (0.13, 0.1), "speed": 1.0, "tolerance": 1e-2, "damping_ratio": 0.01}
    found = fi.spread(body(3e-3), vary, *bodies, n=16, sobol=False, **blow)
    assert found.rescaled["section.thickness"] < 1e-2 and found.checks.body < 1e-2
    hit = fi.strike(body(found.values("section.thickness")[3]), *bodies, **blow)
    assert_allclose(found.values("contact_time")[3], hit.contact_time, rtol=1e-2)


@pytest.mark.parametrize(
    ("vary", "text"),
    [
        ({"contact.stifness": "normal(1, 1)"}, "'contact.stifness' is not an input; did you mean 'contact.stiffness'"),
        ({"mass": "normal(0.1, 0.01)", "striker.mass": "normal(0.1, 0.01)"}, "vary names mass twice"),
        ({"strike.speed": "normal(1, 1)"}, r"vary\['strike.speed'\] must stay positive, but it reaches -.*lognormal"),
        ({"section.thickness": "normal(3e-3, 2e-3)"}, r"vary\['section.thickness'\] must stay positive"),
        ({"section.height": "normal(3e-3, 1e-4)"}, "'section.height' is not an input"),
        ({"section.thickness": "normal(3e-3, 1e-4)", "target.mass": "normal(1, .1)"}, "mass and frequency of the body"),
        ({"strike.x": "normal(0.13, 0.2)"}, "strike point"),
        ({"contact.exponent": "uniform(-1, 2)"}, "exponent"),
        ({"striker.mass": "lognormal(0.1, 50)"}, "vary must stay finite and below"),
    ],
)
def test_inputs_that_make_no_sense_are_refused(scene, vary, text):
    with pytest.raises(ValueError, match=text):
        fi.spread(scene(), vary, n=64, sobol=False)


def test_size_is_refused_where_modes_do_not_scale_and_so_are_arguments_of_others(scene):
    held = scene(RIGID.replace('boundary = "hinged"', "boundary = { stiffness = 1e4 }"))
    with pytest.raises(ValueError, match=r"target.size needs a thin body"):
        fi.spread(held, {"target.size": "uniform(0.9, 1.1)"}, n=8)
    section = fi.Beam.rectangular(fi.Material(E=210e9, nu=0.3, rho=7850.0), width=0.02, height=0.005)
    bar = fi.assemble(fi.mesh.line(0.5), section, point_supports=[(0.11, 3e4), (0.39, 3e4)])  # as in soft cords
    blow = fi.Striker.rigid(0.02), fi.Contact.linear(3e4)
    with pytest.raises(ValueError, match=r"target.size needs a thin body"):
        fi.spread(bar, {"target.size": "uniform(0.9, 1.1)"}, *blow, at=0.25, speed=1.0, n=8)
    vary = {"striker.mass": "lognormal(0.1, 0.1)"}
    with pytest.raises(ValueError, match="speed must be left out for a scene"):
        fi.spread(scene(), vary, speed=1.0)
    with pytest.raises(ValueError, match="striker must be a Striker"):
        fi.spread(WALL, vary, at=None, speed=1.0)


def test_sobol_indices_are_refused_for_correlated_inputs_and_without_their_library(monkeypatch):
    vary = HEAVIER | {"contact.stiffness": ("lognormal", STIFFNESS, 0.3)}
    pair = {("striker.mass", "contact.stiffness"): 0.5}
    with pytest.raises(ValueError, match="sobol must be left out: the inputs are correlated"):
        wall(vary, n=64, correlation=pair, sobol=True)
    found = wall(vary, n=64, correlation=pair, sobol=None)
    assert "No Sobol indices: the inputs are correlated" in found.summary() and found.shares == {}
    for module in ("SALib", "SALib.analyze", "SALib.analyze.sobol"):
        monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(ValueError, match=r"pip install 'fem-impact\[spread\]'"):
        wall(vary, n=64, sobol=True)
    assert "pip install 'fem-impact[spread]'" in wall(vary, n=64, sobol=None).summary()


def test_the_centroid_is_one_of_the_quantities():
    found = wall(HEAVIER, n=16, max_frequency=2e3, tolerance=1e-3)
    striker = fi.Striker.rigid(found.values("striker.mass")[2])
    hit = fi.strike(WALL, striker, fi.Contact.linear(STIFFNESS), at=None, speed=1.0)
    assert_allclose(found.values("centroid")[2], hit.spectral_centroid(2e3), rtol=2e-3)


@pytest.mark.slow
def test_the_prompt_writes_numbers_and_a_picture_and_says_what_to_measure(scene, tmp_path, prompt):
    scene()
    words = ["spread", "scene.toml", "--vary", "contact.stiffness=lognormal(1e5, 0.2)", "--vary",
             "strike.speed = normal(1, 0.05)", "--correlate", "contact.stiffness, strike.speed=0.3", "--blows", "64",
             "--out", "out"]  # fmt: skip
    said = prompt(words)
    assert said.status == 0 and "What to measure better" in said.out and "A ball on a plate" in said.out
    out = tmp_path / "out"
    assert sorted(p.name for p in out.glob("[!.]*")) == ["spread.csv", "spread.json", "spread.nc", "spread.png"]
    data = json.loads((out / "spread.json").read_text())
    assert data["inputs"]["contact.stiffness"] == "lognormal(100000, 0.2)" and data["correlation"][0][1] == 0.3
    table = xarray.load_dataset(out / "spread.nc", engine="scipy")
    assert table.sizes["blow"] == 64 and table["contact_time"].attrs["units"] == "s"
    assert prompt([*words, "--json"]).json["blows"] == 64


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--vary", "contact.stiffness"], "--vary must have a name, an equals sign and a value"),
        (["--vary", "contact.stiffness=lognormal(1e5)"], "must be lognormal(median, sigma)"),
        (["--vary", "strike.speed=normal(1, 0.1)", "--correlate", "strike.speed=a"], "--correlate must look like"),
        (["--vary", "strike.speed=normal(1, 0.1)", "--correlate", "strike.speed=0.5"], "correlation must map pairs"),
    ],
)
def test_the_prompt_complains_in_one_line_and_writes_nothing(scene, tmp_path, prompt, words, text):
    said = prompt(["spread", scene().path.name, *words, "--out", "out"])
    assert said.status == 2 and text in said.err and said.err.count("\n") == 1 and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("table", "line", "words"),
    [
        ("[strike]", "max_impacts = 4\nstriker_force = 0.05", r"\[strike\] striker_force must be left out here"),
        ("[striker]", "gravity = 9.8", "striker must not fall in"),
        ("[strike]", "max_impacts = 1", r"\[strike\] max_impacts must be left out here"),
    ],
)
def test_a_spread_or_map_does_not_leave_out_what_pushes_or_ends_early(scene, table, line, words):
    """A ball that its weight brings back four times would be told to hit once."""
    made = scene(SMALL.replace(table, f"{table}\n{line}"))
    for wanted in (lambda: fi.spread(made, {"striker.mass": ("lognormal", 0.03, 0.1)}, n=8),
                   lambda: map_scene(made, over={"striker.mass": [0.02, 0.03]})):  # fmt: skip
        with pytest.raises(ValueError, match=words):
            wanted()


HEAVY = QUICK.replace("mass = 0.2", "mass = 1e9")  # so heavy that contact time and impulse have closed forms


@pytest.mark.parametrize("n", [None, 64])
def test_a_band_of_a_linear_contact_on_a_wall(tmp_path, n):
    """Contact time goes with the root of mass over stiffness, impulse with the speed: 90 % within half the share."""
    told = HEAVY.replace("stiffness = 1e4", "stiffness = { value = 1e4, about = 0.2 }")
    found = fi.band(load_text(tmp_path, told.replace("speed = 2.0", "speed = { value = 2.0, about = 0.1 }")), n=n)
    assert not found.anew
    time = found["contact_time"]
    assert time.value == pytest.approx(np.pi * (0.03 / 1e4) ** 0.5, rel=1e-2)
    close = 0.01 if n is None else 0.1  # of a width, from so many evenly spread blows
    assert np.log(time.high / time.low) == pytest.approx(0.2, rel=close) and time.mostly == "contact.stiffness"
    assert time.ends[0] < time.low and time.high < time.ends[1]
    force = found["peak_force"]  # impulse m v (1 + e), time from k alone: independent
    assert np.log(force.high / force.low) == pytest.approx(2.0 * np.hypot(0.1, 0.1), rel=2 * close)


def test_an_input_that_needs_another_body_strikes_anew(tmp_path):
    """Both ways give the same band of the same inputs: a length that is no input of a spread, beside one that is."""
    text = QUICK.replace("stiffness = 1e4", "stiffness = { value = 1e4, about = 0.1 }")
    wide = text.replace("width = 0.3", "width = { value = 0.3, low = 0.299, high = 0.301 }")
    quick, other = (fi.band(load_text(tmp_path, each), n=32) for each in (text, wide))
    assert other.anew and not quick.anew and set(other.inputs) == {"mesh.width", "contact.stiffness"}
    one, two = (each["contact_time"] for each in (quick, other))
    assert two.high / two.low == pytest.approx(one.high / one.low, rel=0.02)


def test_a_scene_without_intervals_has_no_band(tmp_path, prompt):
    with pytest.raises(ValueError, match="no number says how well it is known"):
        fi.band(load_text(tmp_path, QUICK))
    assert prompt("strike scene.toml --band --out none").status == 2 and not (tmp_path / "none").exists()


def test_the_command_tells_the_band(tmp_path, prompt):
    load_text(tmp_path, QUICK.replace("speed = 2.0", "speed = { value = 2.0, about = 0.1 }"))
    found = prompt("strike scene.toml --band --json --out out").json["band"]
    assert found["inputs"] == {"strike.speed": "lognormal(2, 0.0607957)"}
    impulse = found["quantities"]["impulse"]
    assert impulse["high"] / impulse["low"] == pytest.approx(np.exp(0.2), rel=2e-3)  # a linear blow goes with its speed


def test_a_band_of_a_blow_that_ends_early_is_of_such_blows(tmp_path):
    """A map or spread follows whole blows, and refuses; a quarter of the blows here ends in contact (it was 0)."""
    text = HEAVY.replace("stiffness = 1e4", "stiffness = { value = 1e4, low = 7e3, high = 1.1e4 }")
    time = np.pi * (0.03 / 8e3) ** 0.5  # a contact of half that stiffness lasts longer
    ended = fi.band(load_text(tmp_path, text.replace("[strike]", f"[strike]\nduration = {time:.6g}")), n=32)
    assert ended.anew and np.isnan(ended.values["restitution"]).sum() == 8
    assert ended["restitution"].low > 0.99 and ended["contact_time"].high < 1.001 * time


@pytest.mark.parametrize("changes", [{"speed": 4.0}, {"at": (0.2, 0.15)}, {"duration": 1e-3}, {"target": "infinite"}])
def test_a_band_is_around_the_blow_as_it_was_changed(tmp_path, changes):
    """Its blows were those of the scene: at twice the speed the force lay twice as high as its band."""
    text = QUICK.replace("mass = 0.03", "mass = { value = 0.03, about = 0.05 }")
    found = fi.band(load_text(tmp_path, text), n=12, **changes)
    assert {each.name for each in found.quantities if not each.low <= each.value <= each.high} == set()


def test_what_a_change_states_is_not_uncertain_any_more(tmp_path):
    known = load_text(tmp_path, QUICK.replace("speed = 2.0", "speed = { value = 2.0, about = 0.1 }"))
    with pytest.raises(ValueError, match="no number says how well it is known"):
        fi.band(known, n=4, speed=1.0)


def test_a_band_makes_bodies_anew_where_modes_do_not_just_scale(tmp_path):
    """Beside a point mass a thickness does not rescale modes, by 7e-3 of a band of 2e-2."""
    post = "target = { point_masses = [{ at = [0.2, 0.15], mass = 0.05 }] }"
    text = RIGID.replace("thickness = 3e-3", "thickness = { value = 3e-3, about = 0.05 }")
    assert fi.band(load_text(tmp_path, f"{text}{post}"), n=4).anew
    assert not fi.band(load_text(tmp_path, text), n=4).anew


TURNING = 'kind = "turning"\ninertia = 2e-5\narm = [0.02, 0.0]\nmass = 0.05'
YIELDS = 'kind = "elastic_plastic"\nyield_speed = 0.05\nmass = 0.03\nstiffness = 1e6'


def test_axes_are_the_scenes_numbers_where_others_act_by_them_too(tmp_path):
    """A turning body felt 60 % more of a larger mass, not 23 %; a contact yielded at an approach, not at its speed."""
    turning = load_text(tmp_path, QUICK.replace('kind = "rigid"\nmass = 0.03', TURNING).partition("[map]")[0])
    plastic = load_text(tmp_path, QUICK.replace('kind = "linear"\nstiffness = 1e4', YIELDS))
    for scene, name, value in ((turning, "striker.mass", 0.08), (plastic, "contact.stiffness", 2e6)):
        hit = scene.changed({name: value}).strike()
        cell = map_scene(scene, over={name: [value]}).squeeze()
        assert_allclose([cell.peak_force, cell.restitution], [hit.peak_force, hit.restitution], rtol=1e-2)
    found = fi.spread(plastic, {"contact.stiffness": ("uniform", 2e6, 2.001e6)}, n=2, sobol=False)
    assert_allclose(found.values("restitution"), hit.restitution, atol=2e-3)
    for name in ("striker.mass", "striker.inertia"):
        with pytest.raises(ValueError, match=f"{name} needs a rigid striker that does not turn"):
            fi.spread(turning, {name: ("uniform", 1e-5, 2e-5), "strike.speed": ("uniform", 1.0, 2.0)}, n=2)
