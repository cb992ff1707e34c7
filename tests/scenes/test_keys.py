"""What the table of keys says of each number is what the functions that take it accept and refuse."""

import inspect
from contextlib import suppress

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.fe.section import Elastic
from fem_impact.scenes import editor_schema, keys
from fem_impact.scenes.schema import MAKERS, NESTED, RISES, SUPPLIED, keys_of

METAL = {"E": 210e9, "nu": 0.3, "rho": 7850.0}
STEEL = fi.Material(**METAL)
BAR = {"E": 70e9, "rho": 2700.0, "length": 0.3, "width": 0.03, "height": 0.01, "at": 0.1}
MODES = fi.analytic.beam(1.0, ends=("hinged", "hinged"), mass=0.2, first_frequency=100.0, n_modes=3)
VALID = {  # what each function needs besides the key that is tried
    "mesh.rectangle": {"length": 0.4, "width": 0.3, "size": 0.2},
    "mesh.disk": {"radius": 0.1, "size": 0.05},
    "mesh.polygon": {"corners": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], "size": 0.5},
    "mesh.line": {"length": 0.4},
    "material.": METAL | {"E_across": 1e9, "G": 1e9},
    "section.plate": {"material": STEEL, "thickness": 2e-3},
    "section.beam": {"material": STEEL, "width": 0.02, "height": 0.01},
    "layer.": {"base": STEEL, "thickness": 1e-3},
    "rib.": {"base": STEEL, "path": [[0.0, 0.0], [1.0, 0.0]], "width": 0.02, "height": 0.01},
    "target.": {},
    "striker.rigid": {"mass": 0.02},
    "striker.sphere": METAL | {"radius": 0.01},
    "striker.stick": {"mass": 0.1, "first_frequency": 1e3, "slenderness": 20.0},
    "striker.hammer": {"head": 0.1, "handle": 0.1, "stiffness": 1e5},
    "striker.bar": BAR,
    "contact.linear": {"stiffness": 1e5},
    "contact.hertz": {"stiffness": 1e5},
    "contact.power": {"stiffness": 1e5, "exponent": 2.0},
    "contact.restituting": {"stiffness": 1e5, "exponent": 1.5, "restitution": 0.5, "speed": 1.0},
    "contact.layers": {"stiffness": 1e5, "exponent": 1.5, "depth": 1e-3, "hard_stiffness": 1e6},
    "contact.elastic_plastic": {"stiffness": 1e5, "yield_approach": 1e-3},
    "contact.felt": {"stiffness": 1e5, "exponent": 2.0, "hysteresis": 0.3, "relaxation": 1e-3},
    "contact.between": {"sphere": fi.Striker.sphere(STEEL, 0.01), "plate": STEEL},
    "strike.": {
        "modes": MODES, "striker": fi.Striker.rigid(0.01), "contact": fi.Contact.linear(1e4), "at": 0.3, "speed": 1.0,
        "tolerance": 1e-2,
    },
    "stroke.": {"when": 0.0},
    "observe.": {"points": [[0.1, 0.1]]},
    "map.": {"over": {"striker.mass": [0.1]}},
    "supports.": {"stiffness": 1e5},
}  # fmt: skip
HARD = {("strike.", "tolerance"), ("contact.felt", "relaxation")}  # 1e-12 takes too long; 0 only without hysteresis
OF_SCENES = {"hand", "stretching"}  # a table of its own, and a key of the target
LATER = {("stroke.", "at")}  # checked with the body or the other strokes, which a table alone does not know
ALONE = {"yield_speed": ("mass", 0.1), "mass": ("yield_speed", 0.1)}  # of a contact: in place of yield_approach


def maker(name):
    table, _, kind = name.partition(".")
    return Elastic if table == "supports" else MAKERS[table][1][kind]


def forms(name):
    """The keys of a function and their forms."""
    table, _, kind = name.partition(".")
    found = set(inspect.signature(maker(name)).parameters) - SUPPLIED - OF_SCENES
    return {key: keys.form(table, kind, key) for key in sorted(found)}


def beyond(form):
    """Values that the form does not allow."""
    found = [{"nonsense": 1}]
    for choice in [form, *form.get("anyOf", ())]:
        if "minimum" in choice:
            found += [choice["minimum"] - 0.01]
        if "maximum" in choice:
            found += [choice["maximum"] * 1.01]
        if "exclusiveMinimum" in choice:
            found += [choice["exclusiveMinimum"], choice["exclusiveMinimum"] - 1.0]
    kind = form.get("type")
    found += {"integer": [1.5, 0], "boolean": ["yes", 1], "array": ["nonsense", 1.0]}.get(kind, [])
    return found + (["nonsense"] if "enum" in form or kind == "number" or "anyOf" in form else [])


def call(name, key, value):
    given = VALID[name] | {key: value}
    if name == "contact.elastic_plastic" and key in ALONE:
        other, number = ALONE[key]
        given = {"stiffness": 1e5, key: value, other: number}
    if name == "observe." and key != "points":
        given = {key: value}
    if key == "diameter":
        del given["width"], given["height"]
    made = maker(name)(**given)
    if hasattr(made, "notes"):
        _ = made.notes
    return made


@pytest.mark.parametrize("name", VALID)
def test_what_a_form_does_not_allow_is_refused(name):
    taken = []
    for key, form in forms(name).items():
        for value in beyond(form) if (name, key) not in LATER else ():
            with suppress(ValueError):
                call(name, key, value)
                taken.append((key, value))
    assert taken == []


@pytest.mark.parametrize("name", VALID)
def test_the_limits_of_a_form_are_accepted(name):
    refused = []
    for key, form in forms(name).items():
        for choice in [form, *form.get("anyOf", ())]:
            for value in (choice.get("minimum"), choice.get("maximum"), *choice.get("enum", ())):
                if value is not None and (name, key) not in HARD:
                    try:
                        call(name, key, value)
                    except ValueError as error:
                        refused.append((key, value, str(error)))
    assert refused == []


def test_every_key_of_a_scene_is_explained_plainly_and_every_explanation_is_used():
    found = set()
    for table, makers in {**{name: makers for name, (_, makers) in MAKERS.items()}, "rise": RISES}.items():
        for kind, function in makers.items():
            for key in set(keys_of(function)) - {"hand", *NESTED}:
                names = (f"{table}.{kind}.{key}", f"{table}.{key}", key)
                found.add(next(name for name in names if name in keys.KEYS))
    found |= {"material.name", "striker.name", "supports.stiffness", "supports.rotation", "hand.force", "rise.table"}
    assert found == set(keys.KEYS)
    assert [each for each, (words, _) in keys.KEYS.items() if not 1 <= len(words) <= 150 or words.endswith(".")] == []


def test_the_numbers_of_a_hand_have_their_limits():
    hand = editor_schema.schema()["properties"]["striker"]["oneOf"][0]["properties"]["hand"]["properties"]
    least = hand["stiffness"]["anyOf"][0]["exclusiveMinimum"], hand["damping"]["anyOf"][0]["minimum"]
    assert least == (0, 0)
    assert np.isfinite(fi.Hand(stiffness=1.0, damping=0.0, force=-1.0).force)
