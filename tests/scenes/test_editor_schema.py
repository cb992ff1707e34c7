"""The schema for editors: every scene that is shipped satisfies it, and what a scene may not say violates it."""

import json
import tomllib
from pathlib import Path

import pytest

from fem_impact import cli
from fem_impact.scenes import editor_schema, templates
from fem_impact.scenes.schema import MAKERS, TABLES

ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "studies" / "scenes").rglob("*.toml"))
SCHEMA = editor_schema.schema()
PLAIN = {"object": dict, "array": list, "string": str, "boolean": bool, "integer": int, "number": (int, float)}


def faults(value, schema, where="scene"):
    """What violates the few keywords that the schema uses; a keyword it does not know is an error."""
    known = {"$schema", "title", "description", "default", "type", "properties", "required", "additionalProperties",
             "enum", "const", "oneOf", "anyOf", "items"}  # fmt: skip
    assert set(schema) <= known, set(schema) - known
    found = []
    kind = PLAIN.get(schema.get("type", ""), object)
    if not isinstance(value, kind) or (isinstance(value, bool) and kind not in (bool, object)):
        return [f"{where} is no {schema['type']}"]
    if "enum" in schema and value not in schema["enum"]:
        found.append(f"{where} is none of {schema['enum']}")
    if "const" in schema and value != schema["const"]:
        found.append(f"{where} is not {schema['const']}")
    if isinstance(value, dict):
        inner = schema.get("properties", {})
        found += [f"{where} lacks {name}" for name in schema.get("required", []) if name not in value]
        for name, item in value.items():
            rule = inner.get(name, schema.get("additionalProperties", {}))
            found += [f"{where} has {name}"] if rule is False else faults(item, rule, f"{where}.{name}")
    for i, item in enumerate(value if isinstance(value, list) else ()):
        found += faults(item, schema.get("items", {}), f"{where}[{i}]")
    for word, most in (("oneOf", 1), ("anyOf", 99)):
        if word in schema:
            each = [faults(value, choice, where) for choice in schema[word]]
            found += [] if 1 <= sum(not some for some in each) <= most else min(each, key=len)
    return found


def test_scenes_are_shipped():
    assert len(SHIPPED) > 20


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_scene_satisfies_the_schema(path):
    assert faults(tomllib.loads(path.read_text()), SCHEMA) == []


@pytest.mark.parametrize("kind", templates.KINDS)
def test_every_new_scene_satisfies_the_schema(kind):
    assert faults(tomllib.loads(templates.text(kind)), SCHEMA) == []


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("mass = 0.02", "mas = 0.02", "scene.striker has mas"),
        ("mass = 0.02", "", "scene.striker lacks mass"),
        ('kind = "hertz"', 'kind = "herz"', "scene.contact is none of|scene.contact.kind is none of"),
        ('boundary = "hinged"', 'boundary = "glued"', "scene.supports.boundary is none of"),
        ("[observe]", "[obsreve]", "scene has obsreve"),
        ("speed = 1.0", 'speed = "fast"', "scene.strike.speed is no number"),
        ("nu = 0.3", "nu = true", "scene.material.nu is no number"),
        ("rho = 450.0", "", "scene.material lacks rho"),
    ],
)
def test_what_a_scene_may_not_say_violates_the_schema(old, new, fault):
    text = templates.text("plate")
    assert text.count(old) == 1
    found = faults(tomllib.loads(text.replace(old, new)), SCHEMA)
    assert any(said.startswith(tuple(fault.split("|"))) for said in found), found


def test_the_schema_knows_every_table_and_kind():
    assert set(SCHEMA["properties"]) == {"title", *TABLES}
    for name, (selector, makers) in MAKERS.items():
        if selector:
            assert SCHEMA["properties"][name]["properties"][selector]["enum"] == list(makers)


def test_strokes_have_strikers_and_contacts_of_their_own_in_the_schema():
    text = templates.text("plate") + '\n[[stroke]]\nwhen = 0.0\nstriker = { kind = "rigid", mass = 0.01 }\n'
    assert faults(tomllib.loads(text), SCHEMA) == []
    for old, new, fault in (
        ("when = 0.0", "wen = 0.0", "scene.stroke[0] lacks when"),
        ("mass = 0.01", "mas = 0.01", "scene.stroke[0].striker has mas"),
        ("when = 0.0", "when = 0.0\nlasts = true", "scene.stroke[0].lasts is no number"),
    ):
        found = faults(tomllib.loads(text.replace(old, new)), SCHEMA)
        assert any(said.startswith(fault) for said in found), found


def test_the_prompt_prints_the_schema(capsys):
    assert cli.main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == SCHEMA
