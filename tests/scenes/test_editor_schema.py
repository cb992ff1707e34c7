"""The schema for editors: every scene that is shipped satisfies it, and what a scene may not say violates it."""

import json
import re
import tomllib
from pathlib import Path

import pytest

import fem_impact as fi
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
             "enum", "const", "oneOf", "anyOf", "items", "pattern", "minimum", "exclusiveMinimum", "maximum",
             "minItems", "maxItems", "minProperties"}  # fmt: skip
    assert set(schema) <= known, set(schema) - known
    found = []
    kind = PLAIN.get(schema.get("type", ""), object)
    if not isinstance(value, kind) or (isinstance(value, bool) and kind not in (bool, object)):
        return [f"{where} is no {schema['type']}"]
    if "enum" in schema and value not in schema["enum"]:
        found.append(f"{where} is none of {schema['enum']}")
    if "const" in schema and value != schema["const"]:
        found.append(f"{where} is not {schema['const']}")
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        low, high, above = (schema.get(word) for word in ("minimum", "maximum", "exclusiveMinimum"))
        found += [f"{where} is below {low}"] if low is not None and value < low else []
        found += [f"{where} is above {high}"] if high is not None and value > high else []
        found += [f"{where} is not above {above}"] if above is not None and value <= above else []
    if "pattern" in schema and not re.search(schema["pattern"], value):
        found.append(f"{where} is not like {schema['pattern']}")
    if isinstance(value, list) and not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
        found.append(f"{where} has {len(value)} items")
    if isinstance(value, dict):
        found += [f"{where} is empty"] if len(value) < schema.get("minProperties", 0) else []
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


STROKE = '\n[[stroke]]\nwhen = 0.0\nstriker = { kind = "rigid", mass = 0.01 }\n'
TEXTS = {path.stem: path.read_text() for path in SHIPPED} | {kind: templates.text(kind) for kind in templates.KINDS}


@pytest.mark.parametrize("text", [*TEXTS.values(), TEXTS["plate"] + STROKE], ids=[*TEXTS, "strokes"])
def test_every_shipped_and_every_new_scene_has_a_title_and_satisfies_the_schema(text):
    tables = tomllib.loads(text)
    assert len(SHIPPED) > 20 and tables["title"] and faults(tables, SCHEMA) == []


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("mass = 0.02", "mas = 0.02", "scene.striker has mas"),
        ("mass = 0.02", "", "scene.striker lacks mass"),
        ('kind = "hertz"', 'kind = "herz"', "scene.contact is none of|scene.contact.kind is none of"),
        ('boundary = "hinged"', 'boundary = "glued"', "scene.supports.boundary is none of"),
        ("[observe]", "[obsreve]", "scene has obsreve"),
        ("speed = 1.0", 'speed = "fast"', "scene.strike.speed is no number"),
        ("thickness = 4e-3", "thickness = { x = [0.0, 1.0], valus = [1e-3, 2e-3] }", "scene.section.thickness "),
        ("at = [0.13, 0.1] ", "at = [0.13, 0.1, 0.0] ", "scene.strike.at "),
        ("tolerance = 1e-3", "tolerance = 0", "scene.strike.tolerance is below"),
        ("tolerance = 1e-3", 'quantity = "restitutoin"', "scene.strike.quantity "),
        ("tolerance = 1e-3", "max_impacts = 1.5", "scene.strike.max_impacts is no integer"),
        ("tolerance = 1e-3", "stretching = true", "scene.strike has stretching"),
        ("damping_ratio = 0.005", 'theory = "mindlinn"', "scene.target.theory is none of"),
        ("damping_ratio = 0.005", "point_masses = [{ at = [0.1, 0.1] }]", "scene.target.point_masses[0] lacks mass"),
        ("points = [[0.13, 0.1]]", "listener = [0.1, 0.2]", "scene.observe.listener has 2 items"),
        ("[observe]", "[map.over]\n'striker.mass' = 0.1\n[observe]", "scene.map.over.striker.mass "),
        ("when = 0.0", "wen = 0.0", "scene.stroke[0] lacks when"),
        ("mass = 0.01", "mas = 0.01", "scene.stroke[0].striker has mas"),
        ("when = 0.0", "when = 0.0\nlasts = true", "scene.stroke[0].lasts is no number"),
    ],
)
def test_what_a_scene_may_not_say_violates_the_schema_and_is_refused(tmp_path, old, new, fault):
    text = templates.text("plate") + STROKE * ("stroke" in fault)
    assert text.count(old) == 1
    found = faults(tomllib.loads(text.replace(old, new)), SCHEMA)
    assert any(said.startswith(tuple(fault.split("|"))) for said in found), found
    (tmp_path / "scene.toml").write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=r"scene\.toml"):
        fi.load_scene(tmp_path / "scene.toml").strike()


def test_the_schema_knows_every_table_and_kind():
    assert set(SCHEMA["properties"]) == {"title", *TABLES}
    for name, (selector, makers) in MAKERS.items():
        if selector:
            assert SCHEMA["properties"][name]["properties"][selector]["enum"] == list(makers)


def test_the_prompt_prints_the_schema(capsys):
    assert cli.main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == SCHEMA
