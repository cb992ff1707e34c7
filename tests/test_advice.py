"""Every message that gives advice: following it works."""

import re

import pytest
from scenes import QUICK, SMALL

import fem_impact as fi
from fem_impact import cli
from fem_impact.model import planner
from fem_impact.scenes import maps

SPRUCE = fi.Material.orthotropic(E_along=10e9, E_across=0.8e9, nu=0.3, G=0.7e9, rho=400.0)
STEEL = fi.Material(210e9, 0.3, 7850.0)


def loaded(tmp_path, text):
    (tmp_path / "scene.toml").write_text(text)
    return fi.load_scene(tmp_path / "scene.toml")


def advice(pattern, call, kind=ValueError):
    """The number a message proposes."""
    with pytest.raises(kind) as caught:
        call()
    found = re.search(pattern, str(caught.value))
    assert found, str(caught.value)
    return float(found[1])


def test_a_blow_of_too_many_modes_proposes_a_tolerance_that_is_affordable(tmp_path):
    found = loaded(tmp_path, SMALL.replace("695e3", "1e8").replace('source = "analytic"', 'source = "fe"'))
    enough = advice(r"; tolerance = (\S+) is affordable", lambda: found.plan(tolerance=1e-9), fi.SimulationError)
    assert found.plan(tolerance=enough).n_modes <= 2000


def test_a_blow_too_hard_for_any_tolerance_proposes_a_softer_contact(tmp_path):
    text = SMALL.replace('source = "analytic"', 'source = "fe"')
    found = loaded(tmp_path, text.replace("695e3", "1e16"))
    for tolerance in (1e-4, 1.0):
        soft = advice(
            r"no tolerance is large enough; take a contact with stiffness = (\S+)",
            lambda tolerance=tolerance: found.plan(tolerance=tolerance), fi.SimulationError,
        )  # fmt: skip
    assert loaded(tmp_path, text.replace("695e3", str(soft))).plan(tolerance=1.0).n_modes <= 2000


@pytest.mark.parametrize(
    "wanted, pattern, key",
    [
        ({"n_modes": 3000}, r"give n_modes of at most (\d+)", "n_modes"),
        ({"max_frequency": 1e7}, r"give max_frequency of at most (\S+) Hz", "max_frequency"),
    ],
)
def test_a_part_of_the_plan_that_is_too_large_gets_its_limit(tmp_path, wanted, pattern, key):
    found = loaded(tmp_path, SMALL.replace('source = "analytic"', 'source = "fe"'))
    most = advice(pattern, lambda: found.plan(**wanted), fi.SimulationError)
    assert found.plan(**{key: int(most) if key == "n_modes" else most}).n_modes <= 2000


def test_a_band_that_is_too_wide_gets_its_limit(tmp_path):
    found = loaded(tmp_path, SMALL.replace('source = "analytic"', 'source = "fe"'))
    most = advice(r"band of the quantity of at most (\S+) Hz", lambda: found.plan(quantity="spectrum=1e7"),
                  fi.SimulationError)  # fmt: skip
    assert found.plan(quantity=f"spectrum={most}").n_modes <= 2000


def test_a_map_of_too_many_modes_proposes_a_tolerance(tmp_path, monkeypatch):
    monkeypatch.setitem(planner.MOST_MODES, "fe", 150)
    found = loaded(tmp_path, QUICK.replace('source = "analytic"', 'source = "fe"'))
    over = {"contact.stiffness": [1e3, 1e5]}
    with pytest.raises(fi.SimulationError, match="leave out the stiffest contacts") as caught:
        maps.map_scene(found, over=over, tolerance=1e-9)
    enough = float(re.search(r"tolerance = (\S+) is affordable", str(caught.value))[1])
    with pytest.raises(fi.SimulationError, match="leave out the stiffest contacts"):
        maps.map_scene(found, over=over, tolerance=enough / 3.0)
    assert (maps.map_scene(found, over=over, tolerance=enough).n_impacts > 0).all()


def test_too_large_elements_get_a_size_that_suffices(tmp_path, capsys):
    loaded(tmp_path, SMALL.replace('source = "analytic"', 'source = "fe"'))
    name = str(tmp_path / "scene.toml")
    assert cli.main(["plan", name, "--size", "1"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "size must be smaller or n_modes lower: elements of 1 m have" in said
    size = re.search(r"elements of (\S+) m suffice", said)[1]
    assert cli.main(["plan", name, "--size", size]) == 0


@pytest.mark.slow  # half a minute
def test_modes_that_miss_a_tolerance_get_one_that_is_met():
    slit = fi.mesh.polygon([(0, 0), (1, 0), (1, 1), (0.5, 0.02), (0, 1)])
    system = fi.assemble(slit, fi.Plate(STEEL, 1e-3), supports={"boundary": "hinged"})
    met = advice(r"a tolerance of (\S+) is met", lambda: fi.find_modes(system, n_modes=6, tolerance=1e-10),
                 fi.SimulationError)  # fmt: skip
    assert float(fi.find_modes(system, n_modes=6, tolerance=met).frequency_error.max()) <= met


@pytest.mark.parametrize("mass, n_impacts", [(0.01, 1), (0.3, 1)])
def test_a_blow_that_misses_its_tolerance_is_done_without_the_scheme(mass, n_impacts):
    plate = fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=60)
    blow = plate, fi.Striker.rigid(mass), fi.Contact.hertz(695e3)
    wanted = {"at": (0.14, 0.09), "speed": 2.0, "tolerance": 1e-11}
    with pytest.raises(fi.SimulationError, match=r"; leave out scheme$"):
        fi.strike(*blow, **wanted, scheme="A")
    hit = fi.strike(*blow, **wanted)
    assert hit.error.step <= 1e-11 and hit.n_impacts == n_impacts


@pytest.mark.parametrize(
    "changed, words",
    [
        ({"first_frequency = 100.0\n": "", "mass = 0.2\n": ""}, "is known for plates of constant thickness only"),
        ({}, "first_frequency gives the rigidity only once the modes are known"),
    ],
)
def test_a_target_that_cannot_be_infinite_says_why_and_modal_works(tmp_path, changed, words):
    text = SMALL.replace('boundary = "hinged"', 'left = "clamped"\nright = "hinged"').replace(
        'source = "analytic"\n', ""
    )
    if changed:
        wood = "[material]\nE = 10e9\nE_across = 0.8e9\nG = 0.7e9\nnu = 0.3\nrho = 400\n"
        wood += (
            '[section]\nkind = "plate"\nthickness = { x = [0, 1], y = [0, 1], values = [[3e-3, 3e-3], [4e-3, 4e-3]] }\n'
        )
        text = text.replace("[striker]", wood + "[striker]")
    for old, new in changed.items():
        text = text.replace(old, new)
    found = loaded(tmp_path, text)
    with pytest.raises(ValueError, match=f"target = 'infinite' .*{words}.*; use target = 'modal'"):
        found.plan(target="infinite")
    assert found.plan(target="modal").target == "modal"


def test_an_infinite_target_off_the_plate_is_blamed_on_the_point(tmp_path):
    text = SMALL.replace('boundary = "hinged"', 'left = "clamped"').replace('source = "analytic"\n', "")
    with pytest.raises(ValueError, match=r"\[strike\] at must lie on the body, got \[9, 9\] m"):
        loaded(tmp_path, text.replace("[0.1395, 0.09]", "[9, 9]")).plan(target="infinite")


@pytest.mark.parametrize(
    "place, words", [("folder", "it is a folder; name a file in it"), ("null", "it is not a regular")]
)
def test_a_folder_and_a_device_are_not_called_missing(tmp_path, capsys, place, words):
    name = str(tmp_path) if place == "folder" else "/dev/null"
    (tmp_path / "scene.toml").write_text(SMALL)
    assert cli.main(["strike", name]) == 2
    assert capsys.readouterr().err.strip() == f"fem-impact: {name}: {words}" + (" file" if place == "null" else "")
    for read in (fi.mesh.load, fi.mesh.outline):
        with pytest.raises(ValueError, match=words):
            read(name)
    assert cli.main(["plan", str(tmp_path / "scene.toml")]) == 0


def test_a_bad_option_is_not_blamed_on_the_file_and_a_bad_key_is_blamed_once(tmp_path, capsys):
    loaded(tmp_path, SMALL)
    name = str(tmp_path / "scene.toml")
    for verb in ("plan", "strike"):
        assert cli.main([verb, name, "--tolerance", "0", *(["--out", str(tmp_path / "o")] * (verb == "strike"))]) == 2
        assert capsys.readouterr().err == "fem-impact: tolerance must lie between 1e-12 and 1, got 0\n"
    (tmp_path / "scene.toml").write_text(SMALL.replace("tolerance = 1e-2", "tolerance = 0"))
    assert cli.main(["plan", name]) == 2
    assert capsys.readouterr().err == f"fem-impact: {name}: [strike] tolerance must lie between 1e-12 and 1, got 0\n"
    assert cli.main(["plan", name, "--tolerance", "1e-2"]) == 0


def test_a_strike_may_write_into_the_folder_where_it_runs(tmp_path, monkeypatch):
    loaded(tmp_path, SMALL)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert cli.main(["strike", "../scene.toml", "--out", "."]) == 0
    assert (tmp_path / "here" / "response.json").is_file()


def test_the_contact_of_wood_is_refused_and_its_advice_works():
    ball = fi.Striker.sphere(STEEL, 0.01)
    for plate in (SPRUCE, fi.Plate(SPRUCE, 3e-3)):
        with pytest.raises(ValueError, match=r"plate must be isotropic.* give fi.Material with that E instead"):
            fi.Contact.between(ball, plate)
    with pytest.raises(ValueError, match="sphere must be isotropic"):
        fi.Contact.between(fi.Striker.sphere(SPRUCE, 0.01), STEEL)
    law = fi.Contact.between(ball, fi.Material(E=0.8e9, nu=0.3, rho=400.0))
    softer = 1.0 / ((1 - 0.09) / 0.8e9 + (1 - 0.09) / 210e9)  # Hertz: the plate's own E governs
    assert law.stiffness == pytest.approx(4.0 / 3.0 * softer * 0.01**0.5)


def test_an_incompressible_material_is_allowed_as_documented(tmp_path):
    plate = fi.Plate(fi.Material(5e6, 0.5, 950.0), 1e-3)
    assert fi.analytic.disk(0.05, section=plate, n_modes=3).frequencies[0] > 0.0
    found = fi.find_modes(fi.assemble(fi.mesh.disk(0.05), plate, supports={"boundary": "clamped"}), n_modes=3)
    assert found.frequencies[0] == pytest.approx(
        fi.analytic.disk(0.05, section=plate, n_modes=3).frequencies[0], rel=1e-4
    )
    assert loaded(tmp_path, SMALL.replace("mass = 0.2", "mass = 0.2\nnu = 0.5")).modes(2).n_modes == 2
    with pytest.raises(ValueError, match=r"\[target\] nu must lie between -0.99 and 0.5"):
        loaded(tmp_path, SMALL.replace("mass = 0.2", "mass = 0.2\nnu = -1"))
