"""The schema for editors: every scene that is shipped satisfies it, and what a scene may not say violates it."""

import json
import tomllib

import pytest
from jsonschema import Draft7Validator
from scenes import SHIPPED

import fem_impact as fi
from fem_impact import cli
from fem_impact.scenes import editor_schema, templates
from fem_impact.scenes.schema import MAKERS, TABLES

PATHS = sorted(SHIPPED.rglob("*.toml"))
SCHEMA = editor_schema.schema()
CHECKED = Draft7Validator(SCHEMA)


def faults(tables):
    """Where tables violate the schema, and by which of its words; those of every choice where there is one."""
    found = list(CHECKED.iter_errors(tables))
    return {f"{each.json_path[1:]} {each.validator}" for error in found for each in (error, *error.context)}


STROKE = '\n[[stroke]]\nwhen = 0.0\nstriker = { kind = "rigid", mass = 0.01 }\n'
TEXTS = {path.stem: path.read_text() for path in PATHS} | {kind: templates.text(kind) for kind in templates.KINDS}


@pytest.mark.parametrize("text", [*TEXTS.values(), TEXTS["plate"] + STROKE], ids=[*TEXTS, "strokes"])
def test_every_shipped_and_every_new_scene_has_a_title_and_satisfies_the_schema(text):
    tables = tomllib.loads(text)
    CHECKED.validate(tables)
    assert len(PATHS) > 20 and tables["title"]


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("mass = 0.02", "mas = 0.02", ".striker additionalProperties"),
        ("mass = 0.02", "", ".striker required"),
        ('kind = "hertz"', 'kind = "herz"', ".contact.kind enum"),
        ('boundary = "hinged"', 'boundary = "glued"', ".supports.boundary enum"),
        ("[observe]", "[obsreve]", " additionalProperties"),
        ("speed = 1.0", 'speed = "fast"', ".strike.speed type"),
        ("thickness = 4e-3", "thickness = { x = [0.0, 1.0], valus = [1e-3, 2e-3] }", ".section.thickness anyOf"),
        ("at = [0.13, 0.1] ", "at = [0.13, 0.1, 0.0] ", ".strike.at anyOf"),
        ("tolerance = 1e-3", "tolerance = 0", ".strike.tolerance minimum"),
        ("tolerance = 1e-3", 'quantity = "restitutoin"', ".strike.quantity pattern"),
        ("tolerance = 1e-3", "max_impacts = 1.5", ".strike.max_impacts type"),
        ("tolerance = 1e-3", "stretching = true", ".strike additionalProperties"),
        ("damping_ratio = 0.005", 'theory = "mindlinn"', ".target.theory enum"),
        ("damping_ratio = 0.005", "point_masses = [{ at = [0.1, 0.1] }]", ".target.point_masses[0] required"),
        ("points = [[0.13, 0.1]]", "listener = [0.1, 0.2]", ".observe.listener minItems"),
        ("[observe]", "[map.over]\n'striker.mass' = 0.1\n[observe]", ".map.over['striker.mass'] anyOf"),
        ("when = 0.0", "wen = 0.0", ".stroke[0] required"),
        ("mass = 0.01", "mas = 0.01", ".stroke[0].striker additionalProperties"),
        ("when = 0.0", "when = 0.0\nlasts = true", ".stroke[0].lasts type"),
    ],
)
def test_what_a_scene_may_not_say_violates_the_schema_and_is_refused(tmp_path, old, new, fault):
    text = templates.text("plate") + STROKE * ("stroke" in fault)
    assert text.count(old) == 1
    assert fault in (found := faults(tomllib.loads(text.replace(old, new)))), found
    (tmp_path / "scene.toml").write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=r"scene\.toml"):
        fi.load_scene(tmp_path / "scene.toml").strike()


def test_the_schema_is_one_knows_every_table_and_kind_and_is_printed_by_the_prompt(capsys):
    Draft7Validator.check_schema(SCHEMA)
    assert set(SCHEMA["properties"]) == {"title", *TABLES}
    for name, (selector, makers) in MAKERS.items():
        if selector:
            assert SCHEMA["properties"][name]["properties"][selector]["enum"] == list(makers)
    assert cli.main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == SCHEMA
