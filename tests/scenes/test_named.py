"""Materials and strikers by name in scenes: the same numbers as from Python, with their intervals."""

import re

import pytest

import fem_impact as fi
from fem_impact._base import known
from fem_impact.scenes.scene import scene_of

PLATE = {
    "mesh": {"shape": "rectangle", "length": 0.4, "width": 0.3},
    "material": {"name": "brass"},
    "section": {"kind": "plate", "thickness": 4e-3},
    "supports": {"boundary": "hinged"},
    "target": {"damping_ratio": 1e-3},
    "striker": {"name": "yarn, medium"},
    "strike": {"at": [0.13, 0.1], "speed": 1.0, "tolerance": 1e-2},
}


def scene(tmp_path, **tables):
    told = {name: table for name, table in {**PLATE, **tables}.items() if table is not None}
    return scene_of(told, tmp_path / "scene.toml", folder=tmp_path)


def test_a_material_of_a_scene_is_that_of_python(tmp_path):
    for name in fi.materials:
        made = scene(tmp_path, material={"name": name})
        assert made.make_section("plate").material == fi.materials[name]
        of_material = {key: how for key, how in made.known.items() if key.startswith("material")}
        assert of_material == fi.materials.entry(name).vary("material")


def test_a_striker_of_a_scene_is_that_of_python_with_its_contact(tmp_path):
    for name in fi.strikers:
        made, entry = scene(tmp_path, striker={"name": name}), fi.strikers.entry(name)
        assert made.make_contact() == entry.contact(on=fi.materials["brass"])
        assert made.make_striker().felt_mass == fi.strikers[name].felt_mass and made.striker.kind == entry.kind
        assert "contact.stiffness" in made.known


def test_other_keys_replace_what_a_name_says_and_lose_its_interval(tmp_path):
    made = scene(tmp_path, material={"name": "brass", "rho": 8400.0}, striker={"name": "yarn, medium", "mass": 0.02})
    assert made.make_section("plate").material.rho == 8400.0 and made.make_striker().mass == 0.02
    assert {"material.rho", "striker.mass"}.isdisjoint(made.known) and "material.E" in made.known
    hard = scene(tmp_path, contact={"kind": "hertz", "stiffness": 1e7})
    assert hard.make_contact() == fi.Contact.hertz(1e7) and "contact.stiffness" not in hard.known


def test_layers_ribs_and_strokes_take_names_too(tmp_path):
    layers = [{"thickness": 1e-3, "material": {"name": "glass, float"}}, {"thickness": 2e-3}]
    ribs = [{"path": [[0.1, 0.0], [0.1, 0.3]], "width": 8e-3, "height": 9e-3, "material": {"name": "maple, sugar"}}]
    section = {"kind": "plate"}
    sandwich = scene(tmp_path, layer=layers, section=section, striker={"name": "steel, 10 mm"})
    on_glass = fi.strikers.entry("steel, 10 mm").contact(on=fi.materials["glass, float"])
    assert sandwich.make_contact() == on_glass and "layer.0.material.E" in sandwich.known
    assert scene(tmp_path, rib=ribs).ribs[0].section.material == fi.materials["maple, sugar"]
    strokes = [{"when": 0.0, "striker": {"name": "hickory 5A, wood tip"}}, {"when": 0.1}]
    roll = scene(tmp_path, stroke=strokes)
    tip = fi.strikers.entry("hickory 5A, wood tip").contact(on=fi.materials["brass"])
    assert roll.alone(0).make_contact() == tip != roll.alone(1).make_contact()
    stated = scene(tmp_path, stroke=strokes, contact={"kind": "hertz", "stiffness": 1e7})
    assert stated.alone(0).make_contact() == fi.Contact.hertz(1e7)


@pytest.mark.slow
def test_bands_and_spreads_use_the_intervals_of_names(tmp_path):
    made = scene(tmp_path)
    band = fi.band(made, n=64)
    assert not band.anew  # one body serves all blows
    assert band["contact_time"].low < band.hit.contact_time < band["contact_time"].high
    vary = {**fi.materials.entry("brass").vary("material"), **fi.strikers.entry("yarn, medium").vary("striker")}
    assert vary.items() <= made.known.items()
    middle = fi.spread(made, vary, n=64, sobol=False).quantile("impulse", 0.5).value
    assert middle == pytest.approx(band.hit.impulse, rel=0.1)


@pytest.mark.parametrize(("tables", "text"), [
    ({"material": {"name": "bras"}}, "[material] name: the catalogue of materials has no 'bras'; did you mean"),
    ({"striker": {"name": "yarn medum"}}, "[striker] name: the catalogue of strikers has no 'yarn medum'; did you"),
    ({"striker": {"name": "yarn, medium", "kind": "rigid"}}, "[striker] kind must be left out beside name"),
    ({"striker": {"name": "yarn, medium", "radius": 1.0}}, "[striker] radius is not a key of this table"),
    ({"striker": {"kind": "rigid", "mass": 0.1}}, "[contact] is missing"),
    (
        {"striker": {"mass": 0.1}, "contact": {"kind": "linear", "stiffness": 1e5}},
        "[striker] kind is missing; it is one of rigid, sphere, stick, hammer, turning, bar, or give a name of the",
    ),
    ({"material": {"E": 1e9, "nu": 0.3}, "striker": {"name": "steel, 10 mm"}}, "[material] rho is missing"),
    (
        {"material": None, "section": None, "target": {"mass": 0.2, "first_frequency": 90.0},
         "striker": {"name": "steel, 10 mm"}},
        "[striker] name: the contact of 'steel, 10 mm' depends on what it strikes; write a table [material]",
    ),
])  # fmt: skip
def test_wrong_names_are_told_with_their_table(tables, text, tmp_path):
    with pytest.raises(ValueError, match=re.escape(text)):
        scene(tmp_path, **tables)


def test_a_bare_body_takes_a_soft_mallet(tmp_path):
    made = scene(tmp_path, material=None, section=None, target={"mass": 0.2, "first_frequency": 90.0})
    assert made.make_contact().table == known.taken("", fi.strikers.entry("yarn, medium").contact_table())[0]
