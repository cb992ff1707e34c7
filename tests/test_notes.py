"""What a mesh or drawing assumed is said wherever its numbers appear: modes, blows, plans, files, pages, the prompt."""

from dataclasses import replace

import pytest
from scenes import SMALL, load_text

import fem_impact as fi

DRAWING = '<svg xmlns="http://www.w3.org/2000/svg" width="465" height="300"><rect width="465" height="300"/></svg>'
ASSUMED = "states no unit"
SECTION = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), 1e-3)


@pytest.fixture
def drawing(tmp_path, read_here):
    path = tmp_path / "plate.svg"
    path.write_text(DRAWING)
    return path


@pytest.fixture
def scene(tmp_path, drawing):
    lines = SMALL.replace(
        'shape = "rectangle"\nlength = 0.465\nwidth = 0.3', f'shape = "outline"\nsource = "{drawing.name}"'
    )
    path = tmp_path / "scene.toml"
    path.write_text(lines.replace('source = "analytic"\n', "").replace("at = [0.1395, 0.09]", "at = [0.04, -0.03]"))
    return path


def test_a_refined_mesh_keeps_its_notes(drawing):
    mesh = fi.mesh.outline(drawing)
    assert ASSUMED in mesh.notes[0]
    assert mesh.refined(2.0).notes == mesh.refined(2.0).refined(1.5).notes == mesh.notes


@pytest.mark.parametrize("name", ["split", "meshed anew"])
def test_a_refined_mesh_file_keeps_its_notes(name):
    mesh = replace(fi.mesh.load("meshes/disk.msh"), notes=("two corners were merged",))
    assert mesh.refined(2.0 if name == "split" else 0.4).notes == ("two corners were merged",)


@pytest.mark.parametrize("wanted", [{"n_modes": 5}, {"n_modes": 5, "tolerance": 1e-4}])
def test_modes_and_all_made_from_them_keep_the_notes_of_the_mesh(drawing, wanted):
    system = fi.assemble(fi.mesh.outline(drawing), SECTION, supports={"boundary": "clamped"})
    assert ASSUMED in system.notes[0]
    modes = fi.find_modes(system, **wanted)
    made = modes, modes.scaled(mass=0.1), modes.truncated(n_modes=3), modes.damped(0.01)
    assert all(each.notes == system.notes for each in made)
    hit = fi.strike(modes, fi.Striker.rigid(0.001), fi.Contact.linear(1e3), at=(0.05, -0.03), speed=1.0, tolerance=0.1)
    assert hit.notes == system.notes
    assert ASSUMED in hit.summary() and ASSUMED in hit._repr_html_() and ASSUMED in modes._repr_html_()
    pair = fi.collide([fi.Modes.rigid(0.001), modes], [fi.Touch(fi.Contact.linear(1e3), 0, 1, None, (0.05, -0.03))],
                      speeds=[1.0, 0.0], tolerance=0.1)  # fmt: skip
    assert pair.notes == system.notes


@pytest.mark.parametrize("target", [None, "modal", "rigid"])
def test_plan_and_run_carry_the_notes_whatever_the_model(scene, target):
    found = fi.load_scene(scene).run(target=target, tolerance=0.05)
    assert ASSUMED in found.plan.notes[0] and ASSUMED in str(found.plan)
    assert found.notes == found.response.notes == found.plan.notes


@pytest.mark.slow
def test_every_command_says_the_notes(scene, prompt):
    scene.write_text(scene.read_text() + '[map]\nover = { "striker.mass" = [0.03, 0.05] }\n')
    for words in ("strike", "modes --n-modes 3", "plan", "hammer --bandwidth 300 --masses 0.01", "map"):
        command, *rest = words.split()
        assert ASSUMED in " ".join(prompt([command, scene.name, *rest]).out.split()), command
        if command in ("strike", "modes", "plan"):
            assert ASSUMED in prompt([command, scene.name, *rest, "--json"]).json["notes"][0], command


def test_the_report_says_the_notes(scene, tmp_path):
    found = fi.load_scene(scene)
    fi.report.write(tmp_path / "page.html", found, found.run(target="modal"))
    assert ASSUMED in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_a_scene_without_a_material_says_nothing_about_one(tmp_path):
    scene = load_text(tmp_path)
    assert scene.run().notes == scene.modes(5).notes == scene.plan(target="rigid").notes == ()
