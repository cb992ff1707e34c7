"""Scenes to begin with for one's own drawing, and a material and a mallet by name."""

import shutil
from pathlib import Path

import pytest
from scenes import LEAF, MESHES

import fem_impact as fi
from fem_impact.scenes import templates


@pytest.fixture
def leaf(tmp_path, monkeypatch, read_here):
    monkeypatch.chdir(tmp_path)
    Path("leaf.svg").write_text(LEAF)
    return tmp_path


@pytest.mark.slow
def test_a_drawing_becomes_a_scene_of_brass_and_yarn_that_strikes(leaf, prompt):
    said = " ".join(prompt('new --from leaf.svg --material brass --mallet "yarn, medium"').out.split())
    assert "y points down" in said and "Files: leaf.toml Next: fem-impact strike leaf.toml" in said
    scene = fi.load_scene("leaf.toml")
    assert scene.title == "Leaf of brass struck by yarn, medium"
    assert scene.make_section("plate").material == fi.materials["brass"]
    assert scene.make_contact() == fi.strikers.entry("yarn, medium").contact()
    assert scene.make_striker().mass == 0.03 and {"material.E", "contact.stiffness"} <= set(scene.known)
    assert scene.target.values["damping_ratio"] == 0.5 * fi.materials.entry("brass").facts["loss_factor"].value
    x, y = scene.blow.values["at"]
    assert 0.005 < x < 0.085 and -0.06 < y < 0.0  # inside, with y upwards
    hit = scene.strike(tolerance=1e-2)
    assert hit.tolerance_met and hit.n_impacts >= 1


@pytest.mark.slow
def test_a_mesh_file_becomes_a_scene_elsewhere(leaf, prompt):
    shutil.copy(MESHES / "l_shape.msh", leaf)
    assert prompt('new --from l_shape.msh --out deep/mine.toml --mallet "steel, 10 mm"').status == 0
    text = Path("deep/mine.toml").read_text()
    assert 'path = "../l_shape.msh"' in text and "# [contact]" in text
    scene = fi.load_scene("deep/mine.toml")
    assert scene.make_striker().radius == 5e-3 and scene.body().dimension == 2
    wood = scene.make_section("plate").material
    assert scene.make_contact() == fi.strikers.entry("steel, 10 mm").contact(on=wood)


@pytest.mark.parametrize("kind", templates.KINDS)
def test_every_kind_takes_a_material(kind, prompt):
    assert prompt(["new", kind, "--material", "glass, float"]).status == 0
    made = fi.load_scene(f"{kind}.toml")
    assert made.make_section("beam" if kind == "beam" else "plate").material == fi.materials["glass, float"]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["map", "--mallet", "yarn, medium"], "--mallet must be left out for a map"),
        (["disk", "--from", "leaf.svg"], "--from must be left out for a disk"),
        (["--unit", "mm"], "--unit must be left out without --from"),
        (["--from", "laef.svg"], "laef.svg"),
    ],
)
def test_what_does_not_fit_is_refused_and_nothing_written(leaf, prompt, words, text):
    said = prompt(["new", *words])
    assert said.status == 2 and text in said.err and not list(leaf.glob("*.toml"))
