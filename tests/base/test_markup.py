"""What a notebook shows of things: pictures and tables that are well-formed, true and escaped."""

import numpy as np
import pytest
from comparing import parsed
from scenes import TITLED, load_text

import fem_impact as fi
from fem_impact._base import markup

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
