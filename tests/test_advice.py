"""Every message that gives advice: following it works."""

import json
import re
import shutil
import tomllib
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from comparing import follow_advice
from scenes import QUICK, SMALL, load_text

import fem_impact as fi
from fem_impact._base import explained
from fem_impact.impact import engine
from fem_impact.model import by_modes
from fem_impact.model.target import Target
from fem_impact.pages import report
from fem_impact.scenes import maps, schema

SPRUCE = fi.Material.orthotropic(E_along=10e9, E_across=0.8e9, nu=0.3, G=0.7e9, rho=400.0)
STEEL = fi.Material(210e9, 0.3, 7850.0)


def advice(pattern, call, kind=ValueError):
    """The number a message proposes."""
    with pytest.raises(kind) as caught:
        call()
    found = re.search(pattern, str(caught.value))
    assert found, str(caught.value)
    return float(found[1])


@pytest.mark.parametrize("stiffness, tolerance", [(1e8, 1e-6), (1e16, 1.0)])
def test_a_blow_of_too_many_modes_proposes_a_softer_contact(tmp_path, stiffness, tolerance):
    def plan(stiffness, tolerance):
        text = SMALL.replace('source = "analytic"', 'source = "fe"').replace("695e3", str(stiffness))
        return load_text(tmp_path, text).plan(tolerance=tolerance, target="modal")

    words = r"; take a larger tolerance, or a softer striker or contact, with stiffness = (\S+)"
    soft = advice(words, lambda: plan(stiffness, tolerance), fi.SimulationError)
    assert plan(soft, tolerance).n_modes <= 2000
    assert stiffness > 1e8 or plan(stiffness, 1e-2).n_modes <= 2000


@pytest.mark.parametrize("pattern, much, asked", [
    (r"give n_modes of at most (\d+)", 3000, lambda most: {"n_modes": int(most)}),
    (r"give max_frequency of at most (\S+) Hz", 1e7, lambda most: {"max_frequency": most}),
    (r"band of the quantity of at most (\S+) Hz", 1e7, lambda most: {"quantity": f"sound={most}"}),
    (r"band of the quantity of at most (\S+) Hz", 1e7,
     lambda most: {"quantity": f"spectrum={most}", "target": "modal"}),
])  # fmt: skip
def test_a_part_of_the_plan_that_is_too_large_gets_its_limit(tmp_path, pattern, much, asked):
    found = load_text(tmp_path, SMALL.replace('source = "analytic"', 'source = "fe"'))
    most = advice(pattern, lambda: found.plan(**asked(much)), fi.SimulationError)
    assert found.plan(**asked(most)).n_modes <= 2000


@pytest.mark.slow
def test_a_map_of_too_many_modes_is_done_with_softer_contacts_or_a_larger_tolerance(tmp_path, monkeypatch):
    monkeypatch.setitem(by_modes.MOST_MODES, "fe", 150)
    text = QUICK.replace('source = "analytic"', 'source = "fe"').replace("[strike]", "[strike]\nresidual = false")
    found, over = load_text(tmp_path, text), {"contact.stiffness": [1e3, 1e5]}
    with pytest.raises(fi.SimulationError, match="leave out the lightest strikers and the stiffest contacts, or take"):
        maps.map_scene(found, over=over, tolerance=1e-6)
    assert (maps.map_scene(found, over={"contact.stiffness": [1e3]}, tolerance=1e-6).n_impacts > 0).all()
    assert (maps.map_scene(found, over=over, tolerance=1e-1).n_impacts > 0).all()


def test_too_large_elements_get_a_size_that_suffices(tmp_path, prompt):
    load_text(tmp_path, SMALL.replace('source = "analytic"', 'source = "fe"'))
    ran = prompt("plan scene.toml --size 1")
    assert ran.status == 2 and "size must be smaller or n_modes lower: elements of 1 m have" in ran.err
    assert prompt("plan scene.toml --size", re.search(r"elements of (\S+) m suffice", ran.err)[1]).status == 0


@pytest.mark.slow  # half a minute
def test_modes_that_miss_a_tolerance_get_one_that_is_met():
    slit = fi.mesh.polygon([(0, 0), (1, 0), (1, 1), (0.5, 0.02), (0, 1)])
    system = fi.assemble(slit, fi.Plate(STEEL, 1e-3), supports={"boundary": "hinged"})
    met = advice(r"a tolerance of (\S+) is met", lambda: fi.find_modes(system, n_modes=6, tolerance=1e-10),
                 fi.SimulationError)  # fmt: skip
    assert float(fi.find_modes(system, n_modes=6, tolerance=met).frequency_error.max()) <= met


def test_a_blow_that_misses_its_tolerance_is_done_without_the_scheme():
    plate = fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=60)
    blow = plate, fi.Striker.rigid(0.01), fi.Contact.hertz(695e3)
    wanted = {"at": (0.14, 0.09), "speed": 2.0, "tolerance": 1e-11}
    with pytest.raises(fi.SimulationError, match=r"; leave out scheme \(notes"):
        fi.strike(*blow, **wanted, scheme="A")
    hit = fi.strike(*blow, **wanted)
    assert hit.error.step <= 1e-11 and hit.n_impacts == 1


BY_EDGES = SMALL.replace('boundary = "hinged"', 'left = "clamped"\nright = "hinged"').replace(
    'source = "analytic"\n', ""
)
WEDGE = """[material]
E = 10e9
E_across = 0.8e9
G = 0.7e9
nu = 0.3
rho = 400
[section]
kind = "plate"
thickness = { x = [0, 1], y = [0, 1], values = [[3e-3, 3e-3], [4e-3, 4e-3]] }
[striker]"""
OF_WOOD = BY_EDGES.replace("first_frequency = 100.0\n", "").replace("mass = 0.2\n", "").replace("[striker]", WEDGE)


@pytest.mark.parametrize(
    "text, words",
    [(OF_WOOD, "is only for plates of constant thickness"),
     (BY_EDGES, "first_frequency gives the rigidity only once the modes are known")],
)  # fmt: skip
def test_a_target_that_cannot_be_infinite_says_why_and_modal_works(tmp_path, text, words):
    found = load_text(tmp_path, text)
    with pytest.raises(ValueError, match=f"target = 'infinite' .*{words}.*; use target = 'modal'"):
        found.plan(target="infinite")
    assert found.plan(target="modal").target == "modal"


def test_an_infinite_target_off_the_plate_is_blamed_on_the_point(tmp_path):
    text = SMALL.replace('boundary = "hinged"', 'left = "clamped"').replace('source = "analytic"\n', "")
    with pytest.raises(ValueError, match=r"\[strike\] at must lie on the body, got \(9, 9\) m"):
        load_text(tmp_path, text.replace("[0.1395, 0.09]", "[9, 9]")).plan(target="infinite")


@pytest.mark.parametrize(
    "place, words", [("folder", "it is a folder; name a file in it"), ("null", "it is not a regular")]
)
def test_a_folder_and_a_device_are_not_called_missing(tmp_path, prompt, place, words):
    name = str(tmp_path) if place == "folder" else "/dev/null"
    ran = prompt("strike", name)
    assert ran.status == 2 and ran.err.strip() == f"fem-impact: {name}: {words}" + (" file" if place == "null" else "")
    for read in (fi.mesh.load, fi.mesh.outline):
        with pytest.raises(ValueError, match=words):
            read(name)


def test_a_bad_option_is_not_blamed_on_the_file_and_a_bad_key_is_blamed_once(tmp_path, prompt):
    load_text(tmp_path, SMALL)
    words = "tolerance must lie between 1e-12 and 1, got 0\n"
    for verb in ("plan", "strike"):
        assert prompt(f"{verb} scene.toml --tolerance 0") == (2, "", f"fem-impact: {words}")
    (tmp_path / "scene.toml").write_text(SMALL.replace("tolerance = 1e-2", "tolerance = 0"))
    assert prompt("plan scene.toml") == (2, "", f"fem-impact: scene.toml: [strike] {words}")
    assert prompt("plan scene.toml --tolerance 1e-2").status == 0


def test_a_strike_may_write_into_the_folder_where_it_runs(tmp_path, prompt):
    load_text(tmp_path, SMALL)
    assert prompt("strike scene.toml --out .").status == 0 and (tmp_path / "response.json").is_file()


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
    exact = fi.analytic.disk(0.05, section=plate, n_modes=3).frequencies[0]
    assert exact > 0.0
    found = fi.find_modes(fi.assemble(fi.mesh.disk(0.05), plate, supports={"boundary": "clamped"}), n_modes=3)
    assert found.frequencies[0] == pytest.approx(exact, rel=1e-4)
    assert load_text(tmp_path, SMALL.replace("mass = 0.2", "mass = 0.2\nnu = 0.5")).modes(2).n_modes == 2
    with pytest.raises(ValueError, match=r"\[target\] nu must lie between -0.99 and 0.5"):
        load_text(tmp_path, SMALL.replace("mass = 0.2", "mass = 0.2\nnu = -1"))


PLATE = fi.Plate(STEEL, 1e-3)
BEAM = fi.Beam.rectangular(STEEL, width=0.02, height=0.01)
SQUARE = fi.mesh.rectangle(0.4, 0.3, size=0.2)
DISK = fi.mesh.disk(0.2, size=0.1)
SCALE = {"mass": 0.2, "first_frequency": 100.0}
closed = partial(fi.analytic.rectangle, 0.4, 0.3)
CLOSED = closed(**SCALE, n_modes=20)
SOFT = {"at": (0.13, 0.1), "speed": 1.0, "tolerance": 1e-2}
HELD = {"boundary": "clamped"}
HARD = fi.Contact.linear(1e6)
OVER = '[map]\nover = { "striker.mass" = [0.01, 0.1]%s }\n'


def struck(law=None, mass=0.03, **changes):
    law = fi.Contact.linear(1e4) if law is None else law
    return fi.strike(CLOSED, fi.Striker.rigid(mass), law, **{**SOFT, **changes})


def swept(**changes):
    over = {"mass": [0.02, 0.03, 0.04]}
    how = {**SOFT, "over": over, "max_cells": 2, **changes}
    return fi.sweep(CLOSED, fi.Striker.rigid(0.03), fi.Contact.linear(1e4), **how)


def mapped(folder, table):
    return maps.map_scene(load_text(folder, SMALL + table), tolerance=1e-1)


# fmt: off
ADVICE = {  # what fails, the message, and what it advises
    "closed form": (lambda tmp: load_text(tmp, SMALL.replace('"hinged"', '"clamped"')).plan(), "use source = 'fe'",
     lambda tmp: load_text(tmp, SMALL.replace('"hinged"', '"clamped"').replace('"analytic"', '"fe"')).plan()),
    "hinge": (lambda _: fi.Striker.flexible(beam("hinged", "free"), at=0.0), "move it off the hinge",
     lambda _: fi.Striker.flexible(beam("hinged", "free"), at=0.05)),
    "cells": (lambda _: swept(), "raise max_cells, now 2$", lambda _: swept(max_cells=3)),
    "fewer values": (lambda _: swept(), "give fewer values", lambda _: swept(over={"mass": [0.02, 0.03]})),
    "sound of a beam": (lambda _: fi.sound.radiate(of_a_beam(), (0.0, 0.0, 1.0)), "use radiate_bar",
     lambda _: as_bar(of_a_beam())),
    "sound of a beam in free air": (lambda _: fi.sound.radiate_free(of_a_beam(), (0.0, 0.0, 1.0)),
     "use radiate_bar for a beam", lambda _: as_bar(of_a_beam())),
    "sound of a plate as a bar": (lambda _: as_bar(struck()), "use radiate$",
     lambda _: fi.sound.radiate(struck(), (0.0, 0.0, 1.0), duration=0.01)),
    "listener": (lambda _: fi.sound.radiate(struck(), (0.1, 0.1, 0.0), duration=0.01), "give a distance",
     lambda _: fi.sound.radiate(struck(), (0.1, 0.1, 0.5), duration=0.01)),
    "gap of a collision": (lambda tmp: fi.pictures.wave(tmp / "a.png", chained(gap=0.0)), "use the response of strike",
     lambda tmp: fi.figures.save(tmp / "a.png", fi.figures.force(struck()))),
    "wood": (lambda _: fi.Material(E=1e10, nu=0.3, rho=450.0, E_across=1e9), "give neither",
     lambda _: fi.Material(E=1e10, nu=0.3, rho=450.0)),
    "tension": (lambda _: fi.assemble(SQUARE, fi.Plate(STEEL, 1e-3, tension=10.0), {"left": "hinged"}), "add supports",
     lambda _: fi.assemble(SQUARE, fi.Plate(STEEL, 1e-3, tension=10.0), {"boundary": "hinged"})),
    "Morley on a disk": (lambda _: fi.assemble(DISK, PLATE, HELD, element="morley"), "use 'argyris', or a polygon",
     lambda _: (fi.assemble(DISK, PLATE, HELD), fi.assemble(SQUARE, PLATE, HELD, element="morley"))),
    "modes of closed forms": (
     lambda _: closed(**SCALE, max_frequency=1e9), "lower max_frequency", lambda _: closed(**SCALE, max_frequency=1e4)),
    "a slip in a closed form": (lambda tmp: load_text(tmp, SMALL.replace("0.465", "46500")).plan(),
     r"\[mesh\] length 46500 m and width 0.3 m must give .*; check the unit", lambda tmp: load_text(tmp, SMALL).plan()),
    "map": (lambda tmp: mapped(tmp, ""), r'over = \{ "striker.mass" = \[0.01, 0.1\] \}',
     lambda tmp: mapped(tmp, OVER % "")),
    "too many modes": (lambda tmp: load_text(tmp, SMALL).modes(10**6), "ask for fewer",
     lambda tmp: load_text(tmp, SMALL).modes(10)),
    "nothing to observe": (lambda tmp: load_text(tmp, SMALL + "[observe]\n"), "leave out the table",
     lambda tmp: load_text(tmp, SMALL)),
    "rigid motion": (lambda tmp: fi.export.write_animation(tmp / "a.pvd", fi.Modes.rigid(1.0), 1, frames=2),
     "a rigid motion", lambda tmp: fi.export.write_animation(tmp / "a.pvd", CLOSED, 2, frames=2)),
    "Morley under tension": (lambda _: fi.assemble(SQUARE, fi.Plate(STEEL, 1e-3, tension=10.0), HELD, element="morley"),
     "does not allow tension or elastic supports; use 'argyris'",
     lambda _: fi.assemble(SQUARE, fi.Plate(STEEL, 1e-3, tension=10.0), HELD, element="argyris")),
    "nothing free to move": (lambda _: fi.assemble(ONE, PLATE, HELD, element="morley"),
     "supports fix every unknown of this mesh; refine it",
     lambda _: fi.assemble(ONE.refined(4.0), PLATE, HELD, element="morley")),
    "nothing free to move, Argyris": (lambda _: fi.assemble(ONE, PLATE, HELD),
     "supports fix every unknown of this mesh; refine it", lambda _: fi.assemble(ONE.refined(4.0), PLATE, HELD)),
    "a beam of too many steps": (lambda _: fi.assemble(fi.mesh.line(1.0), stepped(5000)),
     "steps and kinks, got more; make it smoother", lambda _: fi.assemble(fi.mesh.line(1.0), stepped(5))),
    "modes beyond the unknowns": (lambda _: fi.find_modes(fi.assemble(SQUARE, PLATE, HELD), n_modes=20),
     "elements of 0.02 m suffice",
     lambda _: fi.find_modes(fi.assemble(fi.mesh.rectangle(0.4, 0.3, size=0.02), PLATE, HELD), n_modes=20)),
    "a flat contact far away": (lambda _: chained(gap=1e9), "start nearer to contact", lambda _: chained(gap=1e-3)),
    "states of Ritz vectors": (lambda _: swinging(vectors_of(HUNG)), "find its modes with find_modes",
     lambda _: swinging(fi.find_modes(HUNG, n_modes=20))),
    "a sphere of no one material": (lambda _: fi.Contact.between(fi.Striker.sphere(STEEL, 0.01), 3),
     r"must have an isotropic material .*; use Contact.hertz", lambda _: fi.Contact.hertz(1e9)),
    "a shear modulus of steel": (lambda _: replace(STEEL, G_xz=1e9),
     "needs an orthotropic material; give E_across and G, or leave it out",
     lambda _: (replace(SPRUCE, G_xz=1e9), replace(STEEL, G_xz=None))),
    "a force beyond numbers": (lambda _: fi.Contact.hertz(1e9).force(1e300), "check their units, m and m/s",
     lambda _: fi.Contact.hertz(1e9).force(1e-5)),
    "no contact": (lambda _: struck(fi.Contact.linear(1e4, gap=1.0), duration=1e-3).spectral_centroid(1e3),
     "check gap and speed", lambda _: struck(duration=1e-3).spectral_centroid(1e3)),
    "a striker held": (lambda _: fi.Striker.flexible(beam("hinged", "hinged"), at=0.1),
     "leave it free or support it by one hinge",
     lambda _: [fi.Striker.flexible(beam(end, "free"), at=0.1) for end in ("free", "hinged")]),
    "a point that turns with nothing": (lambda _: beam("hinged", "free").rigid_motion([0.0]),
     "change at or the supports",
     lambda _: (beam("hinged", "free").rigid_motion([0.1]), beam("free", "free").rigid_motion([0.0]))),
    "vectors of a body in closed form": (
     lambda _: fi.plan(CLOSED, fi.Striker.rigid(0.03), fi.Contact.linear(1e4), **SOFT, target="vectors"),
     "target must be one of|use target = 'modal'",
     lambda _: fi.plan(CLOSED, fi.Striker.rigid(0.03), fi.Contact.linear(1e4), **SOFT, target="modal")),
    "vectors with a number of modes": (lambda _: planned(target="vectors", n_modes=9),
     "target = 'vectors' needs a thin plate in a vacuum .*; use target = 'modal'",
     lambda _: planned(target="modal", n_modes=9)),
    "air around a beam": (lambda _: Target(fi.mesh.line(0.4), BEAM, air="both sides"),
     "air is known around plates only; leave it out", lambda _: Target(fi.mesh.line(0.4), BEAM)),
    "no scale of closed forms": (lambda _: closed(mass=0.2, n_modes=4), r"give either section, or both mass \[kg\]",
     lambda _: (closed(section=PLATE, n_modes=4), closed(**SCALE, n_modes=4))),
    "no number of closed forms": (lambda _: closed(section=PLATE), "give either n_modes or max_frequency",
     lambda _: (closed(section=PLATE, n_modes=4), closed(section=PLATE, max_frequency=1e3))),
    "nu twice": (lambda _: fi.analytic.disk(0.1, section=PLATE, nu=0.2, n_modes=4), "give nu or section, not both",
     lambda _: [fi.analytic.disk(0.1, **how, n_modes=4) for how in ({"section": PLATE}, {**SCALE, "nu": 0.2})]),
    "a closed form of a tapered beam": (
     lambda _: fi.analytic.beam(1.0, ends=("free", "free"), section=stepped(2), n_modes=4),
     "section must be constant along the beam; else use find_modes",
     lambda _: fi.find_modes(fi.assemble(fi.mesh.line(1.0), stepped(2)), n_modes=4)),
    "a closed form of wood": (lambda _: closed(section=fi.Plate(SPRUCE, 3e-3), n_modes=4),
     "without tension; else use find_modes",
     lambda _: fi.find_modes(fi.assemble(SQUARE, fi.Plate(SPRUCE, 3e-3), HELD), n_modes=4)),
    "bounds of a disk": (lambda _: fi.find_modes(fi.assemble(DISK, PLATE, HELD), n_modes=4, bounds=True),
     "give a tolerance instead",
     lambda _: fi.find_modes(fi.assemble(fi.mesh.disk(0.2), PLATE, HELD), n_modes=4, tolerance=1e-3)),
    "too much for floats": (lambda tmp: load_text(tmp, MADE.replace("1e-3", "1e-200")).modes(4),
     "must |check its units|check the units", lambda tmp: load_text(tmp, MADE).modes(4)),
    "a file that is no scene": (lambda tmp: load_text(tmp, "#" * (schema.LARGEST_FILE + 1)), "check that it is a scene",
     lambda tmp: load_text(tmp, SMALL)),
    "two times in one file": (lambda tmp: fi.export.write_vtk(tmp / "a.vtu", CLOSED, struck(), [0.0, 1e-3]),
     "got 2; write a .pvd", lambda tmp: fi.export.write_vtk(tmp / "a.pvd", CLOSED, struck(), [0.0, 1e-3])),
    "louder than a file": (lambda tmp: replace(sound(), samples=np.array([1e39])).wav(), "check the units of its speed",
     lambda tmp: sound().wav()),
    "a picture of one axis": (lambda tmp: maps.draw(mapped(tmp, OVER % ""), "contact_time"),
     "must have two axes to be drawn, got mass; select two",
     lambda tmp: maps.draw(mapped(tmp, OVER % ', "strike.speed" = [1.0, 2.0]'), "contact_time")),
    "a map in one file": (lambda tmp: maps.can_write("nc", tmp / "a.nc"), r"give .*a, and --format zarr for map.zarr",
     lambda tmp: maps.can_write("nc", tmp / "a")),
    "a report of no motion": (lambda tmp: reported(tmp, motion=False), "strike with motion=True",
     lambda tmp: reported(tmp, motion=True)),
    "a report of something else": (lambda tmp: report.read(other_json(tmp)),
     "give its response.json, or the scene's TOML file",
     lambda tmp: (report.read(result(tmp)), report.read(tmp / "scene.toml"))),
    "a report of a lost body": (lambda tmp: report.read(result(tmp, {"mesh": {"shape": "file", "path": "lost.msh"}})),
     "the file of the struck body is missing: restore .*, or give the scene's TOML file",
     lambda tmp: (
        fi.mesh.save(tmp / "lost.msh", SQUARE),
        report.read(result(tmp, {"mesh": {"shape": "file", "path": "lost.msh"}})),
        report.read(tmp / "scene.toml"),
    )),
    "a damaged store": (lambda tmp: swept(max_cells=3, store=damaged(tmp / "a")),
     "name a new folder, or delete this one",
     lambda tmp: (swept(max_cells=3, store=tmp / "b"), shutil.rmtree(tmp / "a"), swept(max_cells=3, store=tmp / "a"))),
    "a store of another map": (lambda tmp: swept(max_cells=3, store=kept(tmp / "a"), tolerance=2e-2),
     "store holds another map .*; name a new folder",
     lambda tmp: swept(max_cells=3, store=tmp / "b", tolerance=2e-2)),
    "rigid motions measured": (lambda _: fi.update(clamped_bar, [0.0, 30.0], {"E": (1e11, 3e11)}),
     "positive frequencies only; leave out rigid motions",
     lambda _: fi.update(clamped_bar, [30.0], {"E": (1e11, 3e11)})),
    "functions of no response": (lambda tmp: fi.frf(tap_file(tmp, response=[])), "read them with response=",
     lambda tmp: fi.frf(tap_file(tmp, response=["a"]))),
    "a window that leaves nothing": (lambda tmp: fitted(tap_file(tmp), window=(1e-3, 1e-9)),
     "got 0; give longer records", lambda tmp: fitted(tap_file(tmp), window=(1e-3, 4e-3))),
    "taps everywhere": (lambda tmp: tap_file(tmp, trigger=0.5, together=1e-4), "give trigger= and together=",
     lambda tmp: tap_file(tmp, trigger=9.0, together=1e-2)),
}
# fmt: on


as_bar = partial(fi.sound.radiate_bar, listener=(0.0, 0.0, 1.0), width=0.02, height=0.01, duration=0.01)
ONE = fi.mesh.polygon([(0, 0), (1, 0), (0, 1)], size=2.0)
HUNG = fi.assemble(fi.mesh.rectangle(0.4, 0.3), PLATE, near=[(0.13, 0.1)])
MADE = SMALL.replace("first_frequency = 100.0\nmass = 0.2\n", "").replace("mass = 0.2\nfirst_frequency = 100.0\n", "")
MADE += '[material]\nE = 2e11\nnu = 0.3\nrho = 7850\n[section]\nkind = "plate"\nthickness = 1e-3\n'


def stepped(n):
    return fi.Beam.rectangular(STEEL, width=0.02, height=lambda x: 0.01 * (1.0 + (np.floor(n * x[:, 0]) % 2)))


def beam(*ends):
    return fi.analytic.beam(0.3, ends=ends, mass=0.1, first_frequency=1e3, n_modes=4)


def chained(gap):
    touch = fi.Touch(fi.Contact.linear(1e5, gap=gap), 0, 1)
    return fi.collide([fi.Modes.rigid(1.0)] * 2, [touch], speeds=[1.0, 0.0], tolerance=1e-6)


def vectors_of(system):
    return fi.ritz_modes(system, [(0.13, 0.1)], max_frequency=1e3, n_vectors=20)


def swinging(modes):
    """A mass that meets a plate already in motion."""
    bodies, still = [fi.Modes.rigid(0.1), modes], (np.zeros(1), np.zeros(1))
    moving = np.zeros(modes.n_modes), np.full(modes.n_modes, 1e-3)
    touch = [fi.Touch(fi.Contact.linear(1e5), 0, 1, None, (0.13, 0.1))]
    return fi.collide(bodies, touch, speeds=[1.0, 0.0], states=[still, moving], tolerance=1e-1)


def planned(**pieces):
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3), PLATE, HELD)
    return fi.plan(system, fi.Striker.rigid(0.03), fi.Contact.linear(1e4), **SOFT, **pieces)


def sound():
    return fi.sound.synthesise(struck(), (0.1, 0.1), duration=0.01)


def reported(folder, motion):
    scene = load_text(folder, SMALL)
    report.write(folder / "report.html", scene, scene.run(**({"motion": True} if motion else {"target": "rigid"})))


def other_json(folder):
    (folder / "other.json").write_text("[1]")
    return folder / "other.json"


def result(folder, tables=None):
    (folder / "scene.toml").write_text(SMALL)
    scene = tomllib.loads(SMALL) | (tables or {})
    (folder / "response.json").write_text(json.dumps({"scene": scene}))
    return folder / "response.json"


def kept(store):
    swept(max_cells=3, store=store)
    return store


def damaged(store):
    (kept(store) / "zarr.json").write_text("{}")
    return store


def clamped_bar(values):
    section = fi.Beam.rectangular(fi.Material(E=values["E"], nu=0.3, rho=7850.0), width=0.02, height=0.01)
    return fi.assemble(fi.mesh.line(0.5), section, supports={"left": "clamped"})


def tap_file(folder, **options):
    """Two taps of 40 N, with a ripple of 1 N and a response, read from a table at 10 kHz."""
    time = np.arange(90_000)
    force = 40.0 * np.maximum(np.sin(time / 4.0), 0.0) * np.isin(time // 12, [800, 5000]) + (time % 7 < 3)
    np.savez(folder / "taps.npz", hammer_force=force, a=np.roll(force, 3))
    return fi.read_taps(folder / "taps.npz", rate=10e3, force="hammer_force", **options)


def fitted(taps, **options):
    return fi.fit(
        taps, striker=fi.Striker.rigid(0.1), contact=fi.Contact.linear(1e5), unknown={"contact.stiffness": (1e4, 1e6)},
        profiles=False, starts=1, **options,
    )  # fmt: skip


def of_a_beam():
    modes = fi.analytic.beam(0.3, ends=("hinged", "hinged"), mass=0.1, first_frequency=100.0, n_modes=9)
    return fi.strike(modes, fi.Striker.rigid(0.01), fi.Contact.linear(1e4), at=0.1, speed=1.0, tolerance=1e-1)


@pytest.mark.parametrize("name", ADVICE)
def test_following_the_advice_works(tmp_path, name):
    follow_advice(ADVICE[name], tmp_path)


@pytest.mark.parametrize(
    "most, tolerance, mass, stiffness",
    [(300, 3e-7, 0.5, 1e4), (300, 1e-6, 2.0, 1e4), (300, 1e-3, 0.5, 1e5), (1000, 1e-3, 5.0, 1e5)],
)
def test_a_step_error_that_stays_too_large_proposes_what_is_met(monkeypatch, most, tolerance, mass, stiffness):
    monkeypatch.setattr(engine, "most_steps", lambda *_: most)
    law = fi.Contact.power(stiffness, 0.8)
    wanted = {"mass": mass, "tolerance": tolerance, "residual": False}
    words = r"; (raise tolerance to|give max_impacts of at most) \S+ \("
    with pytest.raises(fi.SimulationError, match=words) as caught:
        struck(law, **wanted)
    number = float(explained.POINTER.sub("", str(caught.value)).rpartition(" ")[2])
    key = "max_impacts" if "impacts of" in str(caught.value) else "tolerance"
    hit = struck(law, **{**wanted, key: int(number) if key == "max_impacts" else number})
    assert hit.error.step <= hit.tolerance


@pytest.mark.parametrize("given", [{"tolerance": 1e-4}, {"dt": 1e-5}])
@pytest.mark.parametrize("ends", [{}, {"max_impacts": 17}, {"duration": 1.0}])
def test_a_run_without_end_is_ended_by_each_of_what_is_told(monkeypatch, given, ends):
    """A hammer that touches the plate 18 times; whoever gave an end already gets one that is soon enough."""
    monkeypatch.setattr(engine, "most_steps", lambda *_: 400)
    words = rf"raise {next(iter(given))}, or give a duration of at most \S+ s or max_impacts of at most \d+ \(notes"
    blow = {"residual": False, **ends}
    with pytest.raises(fi.SimulationError, match=words) as caught:
        struck(HARD, mass=0.5, **blow, **given)
    soon, few = re.search(r"at most (\S+) s or max_impacts of at most (\d+) ", str(caught.value)).groups()
    longer = {"tolerance": 1e-1} if "tolerance" in given else {"dt": 1e-4}
    for way in ({"duration": float(soon)}, {"max_impacts": int(few)}, longer):
        assert struck(HARD, mass=0.5, **{**blow, **given, **way}).history.end_time > 0.0


def test_too_little_memory_points_to_the_plan_which_says_what_needs_it(tmp_path, prompt, monkeypatch):
    load_text(tmp_path, SMALL)

    def full(*_, **__):
        raise MemoryError

    monkeypatch.setattr(fi.Scene, "run", full)
    words = "fem-impact: not enough memory; `fem-impact plan SCENE` shows what needs it\n"
    assert prompt("strike scene.toml") == (1, "", words)
    assert re.search(r"Cost: about .* and \d+ MB predicted", prompt("plan scene.toml").out)


def test_a_heavy_hammer_advises_lighter_ones(tmp_path, prompt):
    load_text(tmp_path, SMALL)
    for mass in (2.0, 0.001):
        ran = prompt("hammer scene.toml --bandwidth 600 --masses", mass)
        assert ran.status == 0 and ("try lighter hammers" in " ".join(ran.out.split())) == (mass > 1.0)


@pytest.mark.slow  # a connection is tried for ten seconds
@pytest.mark.filterwarnings("default")  # the cluster's own sockets, if its first port is taken
def test_a_cluster_that_does_not_answer_is_started_or_its_address_corrected():
    import distributed  # only here, as it is slow to load

    with pytest.raises(OSError, match="start one or correct the address"):
        swept(max_cells=3, client="tcp://127.0.0.1:1")
    with distributed.LocalCluster(n_workers=1, processes=False, dashboard_address=":0") as cluster:
        assert len(swept(max_cells=3, client=cluster.scheduler_address).mass) == 3
