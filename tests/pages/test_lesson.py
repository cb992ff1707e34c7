"""The page without a server: what it shows is what the program computes, to within the errors it prints."""

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import SMALL, load_text

import fem_impact as fi
from fem_impact.pages import explore_model, explore_numbers, lesson, lesson_grid, worksheet
from fem_impact.pages.explore_model import Setup
from fem_impact.pages.lesson_grid import STEPS
from fem_impact.scenes.sentences import si

COUNTS = {"mass": 5, "stiffness": 5, "speed": 3}
READY = "document.documentElement.dataset.ready === 'true'"
HELD = "document.documentElement.lesson"


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return load_text(tmp_path_factory.mktemp("lesson"), 'title = "<b>& small"\n' + SMALL)


@pytest.fixture(scope="module")
def held(scene):
    """The blows of a coarser grid, and the file with them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lesson_grid, "COUNTS", COUNTS)
        kept, made = [], lesson_grid.strike_grid
        patch.setattr(lesson_grid, "strike_grid", lambda *given: kept.append(made(*given)) or kept[0])
        path = scene.path.parent / "page.html"
        return lesson.write(path, scene), kept[0], path


@pytest.fixture
def shown(held, visit):
    return visit(held[2].as_uri(), until=READY)


def positions(grid):
    """Six positions of the sliders, drawn at random."""
    rng = np.random.default_rng(5)
    return [tuple(int(rng.integers(size)) for size in grid.shape) for _ in range(6)]


def number(grid, position):
    return int(np.ravel_multi_index(position, grid.shape))


def slides(position):
    return dict(zip(("place", "speed", "stiffness", "mass"), position))


@pytest.mark.slow
def test_numbers_are_those_of_the_program(scene, held):
    about, grid, _ = held
    assert about.n_failed == 0
    for position in positions(grid):
        settings = grid.settings(*position)
        law, striker = grid.setup.law(settings), fi.Striker.rigid(settings.mass)
        contact = fi.Contact(law.stiffness, law.exponent, loss=law.loss)
        hit = fi.strike(scene.modes(300), striker, contact, at=settings.at, speed=settings.speed, tolerance=1e-4)
        error = grid.quantity("error")[position]
        if not hit.tolerance_met or not grid.blows[number(grid, position)].met:
            continue  # a number of impacts that depends on the last digit
        assert grid.quantity("n_impacts")[position] == hit.n_impacts
        near = 2.0 * (error + hit.error.total) + 1e-5  # what both say they err by, twice, as one in twenty is worse
        for name in ("peak_force", "contact_time"):
            assert_allclose(grid.quantity(name)[position], getattr(hit, name), rtol=near)
        assert_allclose(grid.quantity("restitution")[position], hit.restitution, atol=near)


@pytest.mark.slow
def test_what_the_browser_shows_is_within_the_errors_that_the_page_prints(held, shown):
    about, grid, path = held
    band = np.geomspace(*explore_numbers.BAND, explore_numbers.SPECTRUM_POINTS)
    printed = path.read_text(encoding="utf-8")
    assert lesson.power(about.force_error) in printed and lesson.power(about.spectrum_error) in printed
    for position in positions(grid):
        got = shown.tab.evaluate(f"at => {{ const b = {HELD}.blow(at); return [[...b.time], [...b.force], b.spectrum, "
                                 "b.n_impacts, b.peak_force, b.resonance]; }", slides(position))  # fmt: skip
        case = grid.setup.case(grid.settings(*position))
        hit = case.blow(tolerance=about.tolerance)
        seen = hit.time <= got[0][-1]
        curve = np.interp(hit.time[seen], got[0], got[1])
        assert np.abs(curve - hit.force[seen]).max() <= (about.force_error + 1e-6) * hit.peak_force  # 32-bit floats
        spectrum = np.abs(hit.spectrum(band))
        assert np.abs(np.array(got[2]) - spectrum).max() <= (about.spectrum_error + 1e-6) * hit.impulse
        assert got[3] == hit.n_impacts
        assert_allclose(got[4:], [hit.peak_force, case.resonance], rtol=1e-6)


@pytest.mark.slow
def test_the_sound_is_that_of_the_program(held, shown):
    _, grid, _ = held
    got = np.array(shown.tab.evaluate(f"at => [...{HELD}.samples(at, 48000)]", slides(grid.start)))
    hit = grid.setup.case(grid.settings(*grid.start)).blow(tolerance=grid.tolerance).on(grid.setup.base.modes)
    heard = fi.sound.synthesise(hit, grid.setup.scene.points[0], duration=lesson.PLAYED)
    wanted = heard.samples * heard.full_scale
    assert len(got) == len(wanted)
    # the curve held misses the force by 1e-3 of its peak; modes above the pulse's band have little to lose
    assert_allclose(got, wanted, atol=2e-3 * np.abs(wanted).max())


@pytest.mark.slow
def test_it_needs_no_network_and_stays_small(scene, held, shown):
    about, grid, path = held
    assert shown.errors == [] and shown.requests == [path.as_uri()]
    assert not re.search(r"""(?:src|href)=["']?(?:https?:|//|/)""", path.read_text(encoding="utf-8"))
    assert shown.tab.title() == scene.title and scene.title == "<b>& small"
    assert about.bytes == path.stat().st_size
    whole = len(grid.places) * np.prod(list(lesson_grid.COUNTS.values()))
    assert about.bytes / about.n_blows * whole < 10e6  # with program, style and maps shared by few


@pytest.mark.slow
def test_sliders_clicks_and_questions_set_the_blow(held, shown):
    _, grid, _ = held
    tab = shown.tab
    tab.evaluate("const s = document.getElementById('mass'); s.value = 0; s.dispatchEvent(new Event('input'))")
    assert tab.inner_text("#mass-said") == lesson.si(float(grid.axes["mass"][0]), "kg", 3)
    before = tab.inner_text("#numbers")
    box = shown.box("map")
    tab.mouse.click(box["x"] + box["width"] - 20, box["y"] + 15)  # heavy and hard
    shown_now = "document.documentElement.dataset.shown"
    assert tab.evaluate(shown_now) == str(number(grid, (*grid.start[:2], 4, 4)))
    assert tab.inner_text("#numbers") != before
    asked, buttons = worksheet.questions(grid), tab.locator("[data-position]")
    assert buttons.count() == len(asked) >= 6
    buttons.nth(2).click()
    assert tab.evaluate(shown_now) == str(number(grid, asked[2].position))
    tab.click("#keep")
    assert tab.locator("#kept-legend").is_visible()
    tab.click("#listen")
    shown.until("document.documentElement.dataset.played > 0")
    assert shown.errors == []


@pytest.mark.slow
@pytest.mark.parametrize(("width", "scheme"), [(360, "dark"), (1400, "light")])
def test_it_fits_the_screen(held, visit, width, scheme):
    page = visit(held[2].as_uri(), width=width, color_scheme=scheme)
    page.until(READY)
    page.assert_fits(width)
    assert all(stop[2] for stop in page.tabbed_to(60))


def test_scenes_with_strokes_are_refused(tmp_path):
    with pytest.raises(ValueError, match="scene must have a single blow"):
        lesson.write(tmp_path / "page.html", load_text(tmp_path, SMALL + "[[stroke]]\nwhen = 0.0\n"))


def test_a_gap_is_travelled_at_each_speed(tmp_path, monkeypatch):
    """Blows through a linear spring at other speeds were those at the lowest, and began when that does."""
    monkeypatch.setattr(lesson_grid, "COUNTS", {"mass": 1, "stiffness": 1, "speed": 3})
    monkeypatch.setattr(lesson_grid, "places_of", lambda setup: (setup.start.at,))
    text = SMALL.replace('"hertz"\nstiffness = 695e3', '"linear"\nstiffness = 1e4\ngap = 1e-3')
    grid = lesson_grid.strike_grid(Setup.of(load_text(tmp_path, text)), lambda done, total: None)
    for speed, blow in zip(grid.axes["speed"], grid.blows):
        begins = blow.end / STEPS * blow.time[np.flatnonzero(blow.force)[0] - 1]
        assert begins == pytest.approx(1e-3 / speed, rel=1e-3)


def test_lines_between_kept_points_miss_a_curve_by_no_more_than_allowed():
    time = np.linspace(0.0, 1.0, 2001)
    force = np.maximum(0.0, np.sin(7.0 * time)) + 0.1 * np.sin(90.0 * time)
    for most in (1e-1, 1e-2, 1e-4):
        kept = lesson_grid.kept_points(time, force, most)
        assert (np.diff(kept) > 0).all() and kept[0] == 0 and kept[-1] == 2000
        assert np.abs(np.interp(time, time[kept], force[kept]) - force).max() <= most
    assert len(lesson_grid.kept_points(time, 2.0 * time, 1e-9)) == 2


def test_places_lie_on_the_body_and_hold_the_scenes_own(scene):
    setup = explore_model.Setup.of(scene)
    places = lesson_grid.places_of(setup)
    assert len(places) == 4 and setup.start.at in places
    assert not any(setup.at_rest(place) for place in places)


@pytest.mark.slow
def test_answers_to_questions_are_read_off_the_blows(held):
    _, grid, _ = held
    asked, setup = worksheet.questions(grid), grid.setup
    hit = setup.case(grid.settings(*grid.start)).blow(tolerance=grid.tolerance)
    told = f"{hit.n_impacts} impact, {si(hit.contact_time, 's', 3)} in contact, at most "
    assert asked[0].answer == f"{told}{si(hit.peak_force, 'N', 3)}."
    assert si(hit.impulse, "N s", 3) in asked[1].answer  # of a rigid striker: mass times change of speed
    stiffer = next(each for each in asked if each.asked.startswith("Make the contact"))
    place, speed, stiffness, mass = stiffer.position
    time = grid.quantity("contact_time")[place, speed, :, mass]
    assert stiffer.answer.startswith(f"{time[stiffness] / time[stiffness - 1]:.3g}.")
    power = grid.setup.start.exponent
    ratio = grid.axes["stiffness"][1] / grid.axes["stiffness"][0]
    assert f"{ratio ** (-1.0 / (power + 1.0)):.3g}" in stiffer.answer
    elsewhere = next(each for each in asked if "each place" in each.asked)
    rebounds = grid.quantity("restitution")[:, speed, grid.start[2], grid.start[3]]
    assert elsewhere.position[0] == int(np.argmax(rebounds))
    for share in (1.0, 1e-9, 1e9):  # a threshold that no slider reaches has no line on the page, and no question
        other = replace(grid, limits=share * grid.limits)
        assert any("dashed line" in each.asked for each in worksheet.questions(other)) == (share == 1.0)
