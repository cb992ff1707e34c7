"""The page about frequency responses shows taps, poles, stabilisation, computed modes and moving shapes."""

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scenes import SHIPPED

import fem_impact as fi
from fem_impact.pages import frf_page, tap_pictures
from fem_impact.taps.windows import join_tables

DRUMSTICK = SHIPPED / "drumstick.toml"
PLATE = fi.analytic.rectangle(0.4, 0.3, mass=1.0, first_frequency=100.0, n_modes=12, damping_ratio=0.01)
POINTS = np.array([(x, y) for x in (0.06, 0.2, 0.34) for y in (0.05, 0.15)])


@pytest.fixture(scope="module")
def taps():
    hits = [fi.strike(PLATE, fi.Striker.rigid(0.01), fi.Contact.linear(1e5), at=POINTS[0], speed=v, tolerance=0.1)
            for v in (0.5, 1.0)]  # fmt: skip
    made = join_tables([fi.measure(hit, rate=4096.0, at=POINTS, duration=1.0, noise=1e-3, rng=i, before=5e-3)
                   for i, hit in enumerate(hits)])  # fmt: skip
    force = made.force.copy()
    force[1] += 0.3 * np.roll(force[1], 100)  # a second pulse
    return fi.Taps.from_arrays(force, made.response, rate=made.rate)


@pytest.fixture(scope="module")
def written(taps, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "frf.html"
    frf_page.write_responses(path, fi.frf(taps.pick([0])), title="A <plate>", taps=taps, computed=PLATE, points=POINTS)
    return path


@pytest.mark.slow
def test_the_page_tells_double_hits_poles_and_computed_modes(written):
    page = written.read_text()
    assert "A &lt;plate&gt;" in page and "Double hits: tap 2" in page and "double hit, repeat" in page
    for name in ("taps", "responses", "poles", "stable", "mac", "shapes"):
        assert f'<section id="{name}"' in page
    assert page.count("data:image/png;base64,") == 5 and "±" in page  # no coherence of one tap
    assert not re.search("https?:", page)  # pictures are letters, of which some may say http


@pytest.mark.slow
def test_without_points_nothing_moves_and_without_peaks_it_says_so(taps, tmp_path):
    found = fi.frf(taps)
    frf_page.write_responses(tmp_path / "a.html", found)
    assert "<canvas" not in (tmp_path / "a.html").read_text()
    flat = found.assign(H=found.H * 0.0 + 1.0)
    frf_page.write_responses(tmp_path / "b.html", flat)
    assert "No modes were picked: found has no peaks that are modes" in (tmp_path / "b.html").read_text()


def test_the_page_tells_notes_of_its_responses_and_what_modes_leave(tmp_path, monkeypatch):
    """It said in green how many modes were picked, whatever they left, and no word of taps left out of the average."""
    shown = {}
    monkeypatch.setattr(frf_page, "write_page", lambda *_, **what: shown.update(what))
    monkeypatch.setattr(frf_page, "_pictures", lambda *_: {})
    f = np.arange(1.0, 400.0)
    H = 1.0 / (1.0 - (100.0 / f) ** 2 - 2j * 100.0 / f * 0.01)
    late, filtered = H * np.exp(-2j * np.pi * f * 1e-3), H * np.exp(-1j * np.sin(f / 20.0))
    delay = "Note: 'a' seems late against the force, by 1 ms, which are taken off; check its delay"
    for each, left, said in ((H, False, []), (late, False, [delay]), (filtered, True, [])):
        coords = {"frequency": f, "channel": ["a"], "units": ("channel", ["m/s^2/N"])}
        found = xr.Dataset({"H": (("frequency", "channel"), each[:, None])}, coords, {"notes": ["left out: tap 3"]})
        frf_page.write_responses(tmp_path / "a.html", found)
        assert shown["notes"] == ["Note: left out: tap 3", *said] and bool(shown["unexplained"]) == left, shown


def test_points_are_joined_in_triangles_or_along_a_line():
    square = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
    assert len(frf_page.edges(square)) == 5
    assert sorted(map(sorted, frf_page.edges(np.array([[0.3], [0.1], [0.2]])))) == [[0, 2], [1, 2]]


@pytest.mark.parametrize("value, half, said", [(387.81, 0.26, "387.81 ± 0.26"), (0.5, 0.0123, "0.500 ± 0.012"),
                                               (1234.5, 15.0, "1234 ± 15"), (2.0, 0.0, "2.000 ± 0")])  # fmt: skip
def test_numbers_have_the_digits_of_their_intervals(value, half, said):
    assert frf_page._within(value, half) == said


@pytest.mark.slow
def test_the_page_in_a_browser_moves_shapes_and_fits_a_phone_and_a_desk(written, visit):
    for width in (360, 1280):
        page = visit(written.as_uri(), width=width, height=800)
        tab = page.tab
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        drawn = "document.getElementById('shape').toDataURL()"
        tab.evaluate(f"window.before = {drawn}")
        tab.evaluate("document.getElementById('phase').value = 0.75")
        tab.dispatch_event("#phase", "input")
        page.until(f"window.before !== {drawn}")
        assert tab.inner_text("#play") == "Play" and not page.errors


@pytest.mark.slow
def test_the_prompt_writes_table_and_page_and_compares_with_a_scene(taps, prompt):
    taps.save("taps.npz")
    assert prompt("frf taps.npz --out out --quiet").status == 0
    assert sorted(path.suffix for path in Path("out").iterdir()) == [".csv", ".html"]
    ran = prompt("frf taps.npz --out x.html --against", DRUMSTICK)
    assert ran.status == 2
    assert "--against must be a scene with one observation point for each of 6 responses" in ran.err


def test_the_picture_of_a_watched_folder_marks_double_hits_and_has_responses_of_good_taps(taps):
    figure = tap_pictures.figure_of_record(taps, taps, 2000.0, 10.0, "b.npz: double hit, repeat")
    pulses, spectra, responses, coherence = figure.axes
    assert [text.get_text() for text in pulses.get_legend().get_texts()] == ["tap 1", "tap 2: double hit"]
    marks = [line for line in pulses.lines if line.get_marker() == "v"]
    assert len(marks) == taps.n_pulses[1] == 2
    assert [line.get_linestyle() for line in spectra.lines[:2]] == ["-", "--"]
    assert responses.get_ylabel() == "response [m/s^2/N]" and coherence.get_ylim()[1] > 1.0
    assert "responses of 2 good taps" in figure.get_suptitle()
