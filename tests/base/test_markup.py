"""What a notebook shows of things: pictures and tables that are well-formed, true and escaped."""

import base64
import html
import re

import numpy as np
import pytest
from comparing import parsed
from scenes import TITLED, load_text

import fem_impact as fi
from fem_impact._base import markup
from fem_impact.model.planner import Run

SVG = "{http://www.w3.org/2000/svg}"
PLATE = {"mass": 1.0, "first_frequency": 200.0}


@pytest.fixture
def scene(tmp_path):
    return load_text(tmp_path, TITLED.replace("A small test", "<b>&") + "[observe]\npoints = [[0.3, 0.2]]\n")


def test_scene_shows_where_it_is_struck(scene):
    tree = parsed(scene._repr_html_())
    (picture,) = tree.iter(f"{SVG}svg")
    circles = [(float(c.get("cx")), float(c.get("cy"))) for c in picture.iter(f"{SVG}circle")]
    corners = markup.MARGIN, markup.WIDTH - markup.MARGIN
    across = [(x - corners[0]) / (corners[1] - corners[0]) for x, _ in circles]
    assert across == pytest.approx([0.3 / 0.465, 0.3, 0.3], abs=1e-3)  # drawn to a tenth of a pixel
    assert "<b>&" in "".join(tree.itertext())
    assert any(path.get("stroke-dasharray") == "7 4" for path in picture.iter(f"{SVG}path"))  # hinged all round


def test_response_shows_its_force(scene):
    hit = scene.strike()
    tree = parsed(hit._repr_html_())
    text = "".join(tree.itertext())
    assert f"{hit.peak_force:.5g} N" in text and f"{hit.restitution:.5f}" in text
    (line,) = tree.iter(f"{SVG}polyline")
    heights = [float(pair.split(",")[1]) for pair in line.get("points").split()]
    assert min(heights) == pytest.approx(2.0 * markup.MARGIN, abs=0.1) and len(heights) <= 401
    assert hit.state().summary() in "".join(parsed(hit.state()._repr_html_()).itertext())  # as all that has a summary


def test_a_response_shows_its_impacts_only():
    """A hand holds the striker, so that the run goes on to its end."""
    held = fi.Striker.rigid(0.02).held(fi.Hand(stiffness=100.0, damping=1.0, force=0.1))
    how = {"at": (0.13, 0.1), "speed": 1.0, "tolerance": 1e-2, "duration": 0.05}
    hit = fi.strike(fi.analytic.rectangle(0.4, 0.3, **PLATE, n_modes=5), held, fi.Contact.linear(1e5), **how)
    (told,) = (each.text for each in parsed(hit._repr_html_()).iter(f"{SVG}text") if each.text.endswith(" s"))
    assert float(told.split()[0]) == pytest.approx(hit.impacts[-1].end, rel=1e-2)
    assert hit.impacts[-1].end < 0.97 * hit.time[-1]


def test_modes_and_meshes_show_themselves():
    text = "".join(parsed(fi.analytic.rectangle(0.4, 0.3, **PLATE, n_modes=30)._repr_html_()).itertext())
    assert "30 modes" in text and "200 Hz" in text and "1 kg" in text
    assert "3 x 2 m" in "".join(parsed(fi.mesh.rectangle(3.0, 2.0)._repr_html_()).itertext()).replace(" m x", " x")


def test_flat_and_single_histories_are_drawn():
    for x, y in ((np.zeros(1), np.zeros(1)), (np.arange(3.0), np.zeros(3))):
        assert "nan" not in markup.curve(x, y, label="force", unit="N", title="none").lower()


@pytest.fixture(scope="module")
def hit():
    plate = fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=60, damping_ratio=0.01)
    return fi.strike(plate, fi.Striker.rigid(0.03), fi.Contact.hertz(695e3), at=(0.1, 0.1), speed=2.0, tolerance=0.01)


@pytest.fixture(scope="module")
def cradle():
    balls, law = [fi.Modes.rigid(0.1)] * 3, fi.Contact.hertz(1e9)
    return fi.collide(balls, [fi.Touch(law, 0, 1), fi.Touch(law, 1, 2)], speeds=[1.0, 0.0, 0.0], tolerance=1e-3)


def test_every_object_is_short_as_text(hit, cradle, tmp_path):
    scene = load_text(tmp_path)
    run = scene.run(target="modal")
    wood = fi.Material.orthotropic(E_along=1e10, E_across=1e9, nu=0.3, G=1e9, rho=400.0)
    plate = fi.Plate(wood, 3e-3)
    outline = fi.mesh.polygon([(np.cos(t), np.sin(t)) for t in np.linspace(0, 6, 500)])
    system = fi.assemble(fi.mesh.disk(0.2, size=0.1), plate)
    modes, touch = fi.find_modes(system, n_modes=8), fi.Touch(fi.Contact.hertz(1e6), 0, 1, None, (0.1, 0.1))
    things = [
        hit, cradle, hit.history, hit.target, hit.target.shapes, hit.error, hit.impacts[0], hit.displacement,
        run, run.plan, scene, outline, system, system.strain, plate, wood, fi.Striker.stick(0.1, 1e4),
        fi.Contact.hertz(1e6), fi.sound.synthesise(hit), fi.figures.force(hit), modes, modes.shapes,
        fi.hammers.choose(hit.target, (0.1, 0.1), 300.0, [0.01])[0], touch,
    ]  # fmt: skip
    for thing in things:
        text = repr(thing)
        assert len(text) <= 1000 and text.count("\n") < 12, type(thing)
    assert "speed=2.0" in repr(hit) and isinstance(run, Run)
    cut = re.search(r"bodies=(.*?), contacts=", repr(hit))
    assert cut is not None and cut[1].endswith(" ...")  # a number cut short reads as another one


def test_a_system_is_drawn_with_its_supports():
    plate = fi.Plate(fi.Material(E=7e10, nu=0.3, rho=2700.0), 2e-3)
    system = fi.assemble(fi.mesh.rectangle(1.0, 0.5, size=0.4), plate, supports={"left": "clamped"})
    shown = system._repr_html_()
    assert shown.count("<svg") == 1 and "left clamped" in shown and "2.7 kg" in shown and str(system.n_dofs) in shown


def test_a_figure_shows_itself_as_a_picture(hit):
    assert fi.figures.force(hit)._repr_png_().startswith(b"\x89PNG")


def test_a_plan_is_shown_in_words_and_a_sound_by_a_player(hit, tmp_path):
    plan = load_text(tmp_path).plan()
    assert html.escape(plan.reasons[0]) in plan._repr_html_()
    shown = fi.sound.synthesise(hit, duration=0.1)._repr_html_()
    assert "<audio controls" in shown and "m/s" in shown
    assert base64.b64decode(shown.partition("base64,")[2].partition('"')[0]).startswith(b"RIFF")


def test_a_collision_says_which_contact_each_impact_belongs_to(cradle):
    said = cradle.summary()
    lines = [line for line in said.splitlines() if "ms: peak" in line]
    assert all(f"contact {impact.contact}" in line for impact, line in zip(cradle.impacts, lines, strict=True))
    assert sum(cradle.contact_times) == pytest.approx(cradle.contact_time)
    closed = (cradle.force > 0.0).any(axis=1)
    union = np.ptp(cradle.time[closed])  # both contacts overlap; samples leave out the two ends
    assert cradle.touching_time == pytest.approx(union, rel=3e-3) and cradle.touching_time < cradle.contact_time
    assert f"any of them {1e3 * cradle.touching_time:.5g} ms" in said
    names = [text.get_text() for text in fi.figures.force(cradle).axes[0].get_legend().get_texts()]
    assert names == ["contact 0", "contact 1"]
