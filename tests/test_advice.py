"""Every message that gives advice: following it works."""

import re

import pytest
from scenes import QUICK, SMALL

import fem_impact as fi
from fem_impact import cli
from fem_impact.impact import collision
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
    enough = advice(r"; tolerance = (\S+) is affordable", lambda: found.plan(tolerance=1e-9, target="modal"),
                    fi.SimulationError)  # fmt: skip
    assert found.plan(tolerance=enough, target="modal").n_modes <= 2000


def test_a_blow_too_hard_for_any_tolerance_proposes_a_softer_contact(tmp_path):
    text = SMALL.replace('source = "analytic"', 'source = "fe"')
    found = loaded(tmp_path, text.replace("695e3", "1e16"))
    for tolerance in (1e-4, 1.0):
        soft = advice(
            r"no tolerance is large enough; take a contact with stiffness = (\S+)",
            lambda tolerance=tolerance: found.plan(tolerance=tolerance, target="modal"), fi.SimulationError,
        )  # fmt: skip
    assert loaded(tmp_path, text.replace("695e3", str(soft))).plan(tolerance=1.0, target="modal").n_modes <= 2000


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


@pytest.mark.parametrize("quantity, target", [("sound", None), ("spectrum", "modal")])
def test_a_band_that_is_too_wide_gets_its_limit(tmp_path, quantity, target):
    found = loaded(tmp_path, SMALL.replace('source = "analytic"', 'source = "fe"'))
    words = r"band of the quantity of at most (\S+) Hz"
    most = advice(words, lambda: found.plan(quantity=f"{quantity}=1e7", target=target), fi.SimulationError)
    assert found.plan(quantity=f"{quantity}={most}", target=target).n_modes <= 2000


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


PLATE = fi.Plate(STEEL, 1e-3)
BEAM = fi.Beam.rectangular(STEEL, width=0.02, height=0.01)
SQUARE = fi.mesh.rectangle(0.4, 0.3, size=0.2)
DISK = fi.mesh.disk(0.2, size=0.1)
CLOSED = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=20)
SOFT = {"at": (0.13, 0.1), "speed": 1.0, "tolerance": 1e-2}
HELD = {"boundary": "clamped"}


def struck(law=None, **changes):
    law = fi.Contact.linear(1e4) if law is None else law
    return fi.strike(CLOSED, fi.Striker.rigid(0.03), law, **{**SOFT, **changes})


def collided():
    return fi.collide([fi.Modes.rigid(1.0)] * 2, [fi.Touch(fi.Contact.linear(1e5), 0, 1)], speeds=[1.0, 0.0])


def bar(at):
    modes = fi.analytic.beam(0.3, ends=("hinged", "free"), mass=0.1, first_frequency=1e3, n_modes=4)
    return fi.Striker.flexible(modes, at=at)


def swept(**changes):
    over = {"mass": [0.02, 0.03, 0.04]}
    return fi.sweep(
        CLOSED, fi.Striker.rigid(0.03), fi.Contact.linear(1e4), **{**SOFT, "over": over, "max_cells": 2, **changes}
    )


def mapped(folder, table):
    return maps.map_scene(loaded(folder, SMALL + table), tolerance=1e-1)


ADVICE = {  # what fails, the message, and what it advises
    "closed form": (
        lambda tmp: loaded(tmp, SMALL.replace('"hinged"', '"clamped"')).plan(),
        "use source = 'fe'",
        lambda tmp: loaded(tmp, SMALL.replace('"hinged"', '"clamped"').replace('"analytic"', '"fe"')).plan(),
    ),
    "hinge": (lambda _: bar(0.0), "move it off the hinge", lambda _: bar(0.05)),
    "collocation": (
        lambda _: struck(fi.Contact.power(1e3, 0.8), scheme="collocation"),
        "use A4",
        lambda _: struck(fi.Contact.power(1e3, 0.8), scheme="A4"),
    ),
    "cells": (lambda _: swept(), "raise max_cells, now 2$", lambda _: swept(max_cells=3)),
    "fewer values": (lambda _: swept(), "give fewer values", lambda _: swept(over={"mass": [0.02, 0.03]})),
    "sound of a beam": (
        lambda _: fi.sound.radiate(of_a_beam(), (0.0, 0.0, 1.0)),
        "use synthesise",
        lambda _: fi.sound.synthesise(of_a_beam(), 0.1),
    ),
    "listener": (
        lambda _: fi.sound.radiate(struck(), (0.1, 0.1, 0.0), duration=0.01),
        "give a distance",
        lambda _: fi.sound.radiate(struck(), (0.1, 0.1, 0.5), duration=0.01),
    ),
    "gap of a collision": (
        lambda tmp: fi.pictures.wave(tmp / "a.png", collided()),
        "use the response of strike",
        lambda tmp: fi.figures.save(tmp / "a.png", fi.figures.force(struck())),
    ),
    "wood": (
        lambda _: fi.Material(E=1e10, nu=0.3, rho=450.0, E_across=1e9),
        "give neither",
        lambda _: fi.Material(E=1e10, nu=0.3, rho=450.0),
    ),
    "tension": (
        lambda _: fi.assemble(SQUARE, fi.Plate(STEEL, 1e-3, tension=10.0), {"left": "hinged"}),
        "add supports",
        lambda _: fi.assemble(SQUARE, fi.Plate(STEEL, 1e-3, tension=10.0), {"boundary": "hinged"}),
    ),
    "Morley on a disk": (
        lambda _: fi.assemble(DISK, PLATE, HELD, element="morley"),
        "use 'argyris', or a polygon",
        lambda _: (fi.assemble(DISK, PLATE, HELD), fi.assemble(SQUARE, PLATE, HELD, element="morley")),
    ),
    "modes of closed forms": (
        lambda _: fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, max_frequency=1e9),
        "lower it",
        lambda _: fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, max_frequency=1e4),
    ),
    "map": (
        lambda tmp: mapped(tmp, ""),
        r'over = \{ "striker.mass" = \[0.01, 0.1\] \}',
        lambda tmp: mapped(tmp, '[map]\nover = { "striker.mass" = [0.01, 0.1] }\n'),
    ),
    "too many modes": (
        lambda tmp: loaded(tmp, SMALL).modes(10**6), "ask for fewer", lambda tmp: loaded(tmp, SMALL).modes(10),
    ),
    "nothing to observe": (
        lambda tmp: loaded(tmp, SMALL + "[observe]\n"), "leave out the table", lambda tmp: loaded(tmp, SMALL),
    ),
    "rigid motion": (
        lambda tmp: fi.export.write_animation(tmp / "a.pvd", fi.Modes.rigid(1.0), 1, frames=2),
        "a rigid motion",
        lambda tmp: fi.export.write_animation(tmp / "a.pvd", CLOSED, 2, frames=2),
    ),
}  # fmt: skip


def of_a_beam():
    modes = fi.analytic.beam(0.3, ends=("hinged", "hinged"), mass=0.1, first_frequency=100.0, n_modes=9)
    return fi.strike(modes, fi.Striker.rigid(0.01), fi.Contact.linear(1e4), at=0.1, speed=1.0, tolerance=1e-1)


@pytest.mark.parametrize("name", ADVICE)
def test_following_the_advice_works(tmp_path, name):
    wrong, words, right = ADVICE[name]
    with pytest.raises(ValueError, match=words):
        wrong(tmp_path)
    right(tmp_path)


def test_a_step_error_that_stays_too_large_is_met_by_the_tolerance_it_tells_to_raise(monkeypatch):
    monkeypatch.setattr(collision, "DOUBLINGS", 1)
    law = fi.Contact.power(1e3, 0.8)  # collocation, which would take over, needs an exponent of 1
    with pytest.raises(fi.SimulationError, match=r"; raise tolerance$"):
        struck(law, tolerance=1e-12, residual=False)
    assert struck(law, tolerance=1e-3, residual=False).error.step <= 1e-3


def test_a_run_without_end_is_ended_by_each_of_what_is_told(monkeypatch):
    monkeypatch.setattr(collision, "_most_steps", lambda _: 400)
    blow = {"residual": False, "scheme": "A"}
    with pytest.raises(fi.SimulationError, match="raise tolerance or dt, or give duration or max_impacts"):
        struck(**blow, tolerance=1e-12)
    assert struck(**blow, tolerance=1e-2).error.step <= 1e-2
    with pytest.raises(fi.SimulationError, match="raise tolerance or dt, or give duration or max_impacts"):
        struck(**blow, dt=1e-6)
    for way in ({"dt": 1e-4}, {"dt": 1e-6, "duration": 1e-4}):
        assert struck(**blow, **way).error.step < 1.0


def test_too_little_memory_points_to_the_plan_which_says_what_needs_it(tmp_path, capsys, monkeypatch):
    loaded(tmp_path, SMALL)

    def full(*_, **__):
        raise MemoryError

    monkeypatch.setattr(fi.Scene, "run", full)
    name = str(tmp_path / "scene.toml")
    assert cli.main(["strike", name, "--out", str(tmp_path / "o")]) == 1
    assert capsys.readouterr().err == "fem-impact: not enough memory; `fem-impact plan SCENE` shows what needs it\n"
    assert cli.main(["plan", name]) == 0
    assert re.search(r"Cost: about .* and \d+ MB predicted", capsys.readouterr().out)


def test_a_store_of_another_map_asks_for_a_new_folder(tmp_path):
    pytest.importorskip("zarr", reason="stores are an extra: fem-impact[cluster]")
    swept(max_cells=3, store=tmp_path / "a")
    with pytest.raises(ValueError, match=r"store holds another map .*; name a new folder"):
        swept(max_cells=3, store=tmp_path / "a", tolerance=2e-2)
    swept(max_cells=3, store=tmp_path / "b", tolerance=2e-2)


def test_a_heavy_hammer_advises_lighter_ones(tmp_path, capsys):
    loaded(tmp_path, SMALL)
    name = str(tmp_path / "scene.toml")
    assert cli.main(["hammer", name, "--bandwidth", "600", "--masses", "2.0"]) == 0
    assert "try lighter hammers" in " ".join(capsys.readouterr().out.split())
    assert cli.main(["hammer", name, "--bandwidth", "600", "--masses", "0.001"]) == 0
    assert "try lighter hammers" not in " ".join(capsys.readouterr().out.split())
