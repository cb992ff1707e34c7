"""Pictures carry the data they are given, with units, and are written without a screen."""

from dataclasses import replace
from functools import partial

import matplotlib.image
import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.show import figures, outlined, plots, sampling
from fem_impact.sweeps.hammers import Hammer


def test_force_picture_holds_history_and_spectrum_and_says_its_units(hit):
    above, below = figures.force(hit, band=(20.0, 5e3)).axes
    time, force = above.lines[0].get_data()
    np.testing.assert_array_equal(np.column_stack([time, force]), np.column_stack([hit.time, hit.force]))
    frequencies, size = below.lines[0].get_data()
    top = np.abs(hit.spectrum(frequencies)).max()
    shown = size > 1e-4 * top
    assert_allclose(size[shown], np.abs(hit.spectrum(frequencies))[shown], rtol=1e-12)
    assert below.get_xlim() == (20.0, 5e3)
    assert len(above.patches) == hit.n_impacts
    assert above.xaxis.get_major_formatter().unit == "s" and above.yaxis.get_major_formatter().unit == "N"
    assert below.xaxis.get_major_formatter().unit == "Hz" and "[N s]" in below.get_ylabel()


@pytest.mark.parametrize(("count", "drawn"), [(5, 5), (99, 30)])
def test_mode_shapes_draw_as_many_as_there_are(modes, count, drawn):
    titles = [title for axes in figures.mode_shapes(modes, count=count).axes if (title := axes.get_title(loc="left"))]
    assert len(titles) == drawn and titles[0] == "1   100 Hz"


@pytest.mark.parametrize("draw", [figures.mode_shapes, fi.pictures.chladni, partial(fi.pictures.mode_shapes, "no.png")])
def test_bodies_known_at_a_few_points_are_not_drawn(draw, modes):
    """As of a blow that was read from its folder: `fi.load_response`."""
    at = np.array([[0.1, 0.1], [0.2, 0.1], [0.3, 0.2]])
    known = fi.Modes.from_arrays(modes.frequencies, modes.shapes.at(at), points=at, mass=modes.mass)
    with pytest.raises(ValueError, match=r"got shapes without cells between their points, 3; strike the scene again"):
        draw(known)


def test_mode_shapes_of_a_beam_are_lines():
    axes = figures.mode_shapes(fi.analytic.beam(0.4, mass=0.1, first_frequency=1e3, n_modes=3)).axes
    assert all(len(a.lines) >= 1 for a in axes) and axes[-1].get_xlabel() == "x [m]"


def test_saved_picture_is_an_image_with_ink_and_other_formats_are_refused(tmp_path, hit):
    figures.save(tmp_path / "force.png", figures.force(hit))
    pixels = matplotlib.image.imread(tmp_path / "force.png")
    assert pixels.shape[1] == 1050 and pixels[:, :, :3].std() > 0.05  # 7 inches at 150 dots; blank is 0
    assert [path.name for path in tmp_path.iterdir()] == ["force.png"]
    with pytest.raises(ValueError, match=r"path ending must be one of .*'\.pgn'; did you mean '\.png'"):
        figures.save(tmp_path / "force.pgn", figures.force(hit))


def test_energies_add_up_at_every_instant(hit):
    lines = figures.energies(hit).axes[0].lines
    assert [line.get_label() for line in lines] == ["striker", "struck body", "contact and losses"]
    total = sum(line.get_ydata() for line in lines)
    assert_allclose(total, 0.5 * 0.03 * 2.0**2, rtol=1e-12)  # what the striker brought
    # a contact stores and never lends; between the ends of steps the energy holds to their tolerance of 1e-3
    assert lines[2].get_ydata().min() > -1e-3 * 0.06


@pytest.mark.parametrize("given", [
    {"striker_force": 20.0, "duration": 0.02}, {"target_force": -30.0, "duration": 0.02}, {"stretching": True},
    {"contact": fi.Contact.linear(1e5, gap=-3e-4)},
], ids=["a force on the striker", "a force on the body", "stretching", "pressed at the start"])  # fmt: skip
def test_energies_drawn_end_as_those_of_the_blow(given):
    """The work of forces, and what stretching or the contact stored from the start, counted as contact and losses."""
    sheet = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), thickness=5e-4)
    plate = fi.analytic.rectangle(0.4, 0.3, section=sheet, n_modes=6, damping_ratio=0.01)
    how = {"contact": fi.Contact.linear(1e5), "at": (0.13, 0.1), "speed": 2.0, "tolerance": 1.0, "residual": False}
    hit = fi.strike(plate, fi.Striker.rigid(0.05), **how | given)
    *bodies, rest = (part[0] for part in sampling.energies(hit, np.array([hit.history.end_time])))
    assert_allclose(bodies, [hit.energies[name] for name in ("striker", "target")], rtol=1e-9)
    assert rest == pytest.approx(hit.energies["contact"] + hit.energies["dissipated"], abs=1e-4 * 0.1)


@pytest.mark.parametrize("speeds", [[1.0, 0.0, 0.0], [0.5, 0.0, -0.5]])
def test_a_chain_is_drawn_whole(speeds):
    """The middle body's energy, and that of others that arrive, counted as lost; the last touch to begin ends first."""
    laws = fi.Contact.linear(1e4), fi.Contact.linear(1e6, gap=1e-3)
    touches = [fi.Touch(law, i, i + 1) for i, law in enumerate(laws)]
    hit = fi.collide([fi.Modes.rigid(mass) for mass in (1.0, 0.5, 0.3)], touches, speeds=speeds)
    lines = figures.energies(hit).axes[0].lines
    assert [line.get_label() for line in lines] == ["body 0", "body 1", "body 2", "contact and losses"]
    assert_allclose(lines[-1].get_ydata()[[0, -1]], 0.0, atol=1e-9)  # elastic contacts, open again
    assert hit.impacts[-1].end < hit.impacts[0].end < figures.force(hit).axes[0].get_xlim()[1]


def test_mode_energies_are_those_at_the_last_release(hit):
    (bars,) = figures.mode_energies(hit).axes[0].collections
    tops = np.array([segment[1] for segment in bars.get_segments()])
    q, p = hit.modal_state([hit.impacts[-1].end])
    assert_allclose(tops[:, 0], hit.target.frequencies, rtol=1e-12)
    assert_allclose(tops[:, 1], 0.5 * (p**2 + (hit.target.omega * q) ** 2)[0], rtol=1e-12)


def test_mobility_shows_every_peak_and_of_a_rigid_mass_needs_a_band(modes):
    above, below = figures.mobility(modes, (0.1395, 0.09)).axes
    frequency, size = above.lines[0].get_data()
    for i in (0, 1, 10, 20):  # at resonance one mode dominates: u**2 / (2 zeta omega); its neighbours add some percent
        alone = modes.shape_at([(0.1395, 0.09)])[0, i] ** 2 / (2 * 0.005 * modes.omega[i])
        if alone > 0.1:
            at_peak = size[np.argmin(np.abs(frequency - modes.frequencies[i]))]
            assert_allclose(at_peak, alone, rtol=0.1)
    phase = below.lines[0].get_ydata()
    assert np.abs(phase).max() <= 90.0 + 1e-9  # power flows in only: the real part of a point mobility is positive
    with pytest.raises(ValueError, match="band must be given"):
        figures.mobility(fi.Modes.rigid(1.0), None)


def test_names_between_dollar_signs_are_no_formulas(tmp_path, monkeypatch):
    name = r"a$\frac{$b"
    plate = fi.mesh.rectangle(0.3, 0.2, size=0.1)
    left, right, whole = (plate.edges[each] for each in ("left", "right", "boundary"))
    named = replace(plate, edges={name: left, "x$": right, "boundary": whole})
    monkeypatch.setitem(matplotlib.rcParams, "text.usetex", True)  # as a file in the working folder may say
    monkeypatch.setitem(matplotlib.rcParams, "svg.fonttype", "none")
    figures.save(tmp_path / "edges.svg", figures.edges(named))
    text = (tmp_path / "edges.svg").read_text()
    assert f">{name}<" in text and ">x$<" in text


def test_the_range_of_tips_of_hammers_closes_between_the_masses_tried():
    """In between, the hardest tip falls with mass**-2 and the softest keeps rising with the mass."""
    made = [Hammer(m, ((1e2, high),), ((low, high),) if low else (), 1e6, 1e3, 1e-4) for m, low, high in (
        (1e-3, 5e3, 4e4), (2e-3, 1e4, 4e4), (4e-3, None, 1e4), (8e-3, None, 9e5))]  # fmt: skip
    (axes,) = plots.hammers(made[::-1], 500.0).axes
    (region,) = (each for each in axes.collections if len(each.get_paths()))
    masses = np.concatenate([path.vertices[:, 0] for path in region.get_paths()])
    assert_allclose(masses.min(), 1.0, rtol=1e-12)
    meeting = 2.0 * 4.0 ** (1.0 / 3.0)  # g: 4e4 (m/2)**-2 = 1e4 (m/2)
    assert_allclose(masses.max(), meeting, rtol=0.01)  # drawn from 100 points per mass


def test_patches_stand_where_they_are():
    points, cells = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    maps, marks = np.array([[1.0, -2.0], [0.5, 1.0], [-1.0, 0.0], [0.0, 0.3]]), (np.array([[0.3, 0.4]]), 0.1)
    first, second = outlined.marked(points, cells, maps, ["one", "two"], [(*marks, ["1: a", "1: b"])]).axes[:2]
    assert_allclose(np.linalg.norm(first.lines[0].get_xydata() - [0.3, 0.4], axis=1), 0.1, rtol=1e-12)
    assert [axes.get_title(loc="left") for axes in (first, second)] == ["one", "two"]
    assert "1: b" in [text.get_text() for text in second.texts]


def test_a_bar_is_drawn_along_its_length():
    points = np.linspace(0.0, 1.0, 5)[:, None]
    cells, marks = np.column_stack([np.arange(4), np.arange(1, 5)]), [(np.array([[0.2], [0.8]]), 0.1, ["1: a"])]
    (axes,) = outlined.marked(points, cells, points - 0.5, ["one"], marks).axes
    assert_allclose(axes.lines[0].get_xydata(), np.column_stack([points[:, 0], points[:, 0] - 0.5]))
    assert [round(each.get_x(), 12) for each in axes.patches] == [0.1, 0.7]
