"""Scenes to begin with: each runs as it stands, explains every key, and never replaces a file."""

import re

import pytest
from scenes import load_text

import fem_impact as fi
from fem_impact.scenes import maps, templates


def made(kind, folder):
    path = folder / f"{kind}.toml"
    templates.write_scene(path, kind)
    return fi.load_scene(path)


@pytest.mark.parametrize("kind", templates.KINDS)
def test_a_new_scene_strikes_within_its_tolerance_and_has_an_answer_to_trust_without_notes(kind, tmp_path):
    scene = made(kind, tmp_path)
    hit = scene.strike(strict=True)
    assert hit.n_impacts >= 1 and 0.0 < hit.restitution < 1.0 and hit.trusted and hit.notes == ()
    assert hit.displacement(scene.points, [1e-3]).shape == (1, 1)


def test_the_scene_of_a_map_makes_a_map(tmp_path):
    table = maps.map_scene(made("map", tmp_path), tolerance=1e-1)
    assert table.n_impacts.shape == (12, 12) and "centroid" in table and bool((table.n_impacts > 0).all())


@pytest.mark.parametrize("kind", templates.KINDS)
def test_every_number_has_a_comment_that_begins_with_its_unit(kind):
    for line in templates.text(kind).splitlines():
        if re.match(r"#? ?[\w\".]+ = [-\d{\[]", line):
            unit = line.rpartition("# ")[2].split(";")[0].split(",")[0].split(" ")[0]
            assert unit in {"m", "kg", "Pa", "kg/m^3", "Hz", "-", "m/s", "N/m^1.5"}, line


@pytest.mark.parametrize("kind", templates.KINDS)
def test_what_a_comment_offers_is_known(kind, tmp_path):
    """Commented-out keys are valid when the comment sign is removed."""
    text = re.sub(r"^# (?=\w+ = |\[\[)", "", templates.text(kind), flags=re.MULTILINE)
    assert text != templates.text(kind)
    load_text(tmp_path, text).built  # noqa: B018  builds the whole scene, and complains of what is unknown


def test_the_prompt_writes_a_scene_and_says_what_is_next(tmp_path, prompt):
    assert prompt("new")[:2] == (0, "Files: plate.toml\nNext: fem-impact strike plate.toml\n")
    assert prompt("new map --out deep/in.toml").status == 0
    assert (tmp_path / "deep" / "in.toml").read_text() == templates.text("map")


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("palte", "did you mean 'plate'"),
        ("plate --out there.toml", "exists already; name another file with --out, or remove it"),
        ("plate --out scene.txt", "a scene must be a .toml file"),
    ],
)
def test_the_prompt_refuses_and_replaces_nothing(tmp_path, prompt, words, text):
    (tmp_path / "there.toml").write_text("mine")
    said = prompt(f"new {words}")
    assert said.status == 2 and text in said.err and said.err.count("\n") == 1
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"there.toml": "mine"}
