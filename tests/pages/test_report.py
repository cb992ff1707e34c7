"""The page about a blow: everything on it, nothing from elsewhere, usable by anyone."""

import base64
import html
import json
import re
import warnings
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from browsing import Page
from scenes import BAR, SMALL, TITLED, load_text

import fem_impact as fi
from fem_impact import cli
from fem_impact.pages import html_page, report
from fem_impact.scenes import sentences

SCRIPT = "<script>document.title = 'taken'</script>"


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A small scene whose title tries to be a script."""
    path = tmp_path_factory.mktemp("report") / "small.toml"
    path.write_text(TITLED.replace("A small test", SCRIPT))
    return path


@pytest.fixture(scope="module")
def page(scene):
    path = scene.parent / "out" / "report.html"
    assert cli.main(["report", str(scene), "--out", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def text(page):
    return page.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def hit(scene):
    return report.read(scene).strike(target="modal")


@pytest.fixture
def opened(page, visit):
    return partial(visit, page.as_uri(), until="'ready' in document.documentElement.dataset")


@pytest.fixture(scope="module")
def desktop(page, chromium):
    """The page on a desk, shared by tests that only look at it."""
    shown = Page(chromium)
    shown.tab.goto(page.as_uri())
    shown.tab.wait_for_selector("html[data-ready]")
    yield shown
    shown.context.close()


def download(text, name):
    raw = re.search(rf'download="{re.escape(name)}" href="data:[a-z/]+;base64,([^"]*)"', text).group(1)
    return base64.b64decode(raw).decode()


def table(text, name):
    return np.loadtxt(download(text, name).splitlines(), delimiter=",", skiprows=1)


def test_page_is_one_file_with_no_way_out_and_texts_of_the_scene_escaped(page, text):
    assert [path.name for path in page.parent.iterdir()] == ["report.html"]
    assert page.stat().st_size < 12e6
    own = re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)  # plotly's own code names addresses it never asks
    assert not re.findall(r'(?:src|href)="(?!data:|#)', own)
    assert "default-src 'none'" in own and "connect-src" not in own
    assert SCRIPT not in text and "&lt;script&gt;document.title" in text


def test_page_tells_whether_the_model_is_right(text):
    part = text[text.index('id="model"') : text.index('id="force"')]
    assert text.index('id="trust"') < text.index('id="model"') and "Is the model right?" in part
    for name in ("thin target", "no yielding", "still air", "not known: the thickness of the body"):
        assert name in part
    told = json.loads(download(text, "response.json"))["response"]
    assert {each["name"] for each in told["assumptions"]} >= {"thin target", "still air"}
    assert told["model_error"] >= max(each["effect"]["force"] or 0.0 for each in told["assumptions"])


def test_downloads_hold_every_number_and_the_page_says_where_the_mobility_ends(text, hit):
    data = json.loads(download(text, "response.json"))
    assert data["response"]["peak_force"] == hit.peak_force and len(data["impacts"]) == hit.n_impacts
    time, force = table(text, "force.csv").T
    assert (time == hit.time).all() and (force == hit.force).all()
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])
    last = table(text, "modes.csv")[-1, 0]
    assert last < data["spectrum"]["x"][-1]  # the spectrum goes on
    assert data["mobility"]["x"][-1] == pytest.approx(last, rel=1e-5) == data["natural"][-1]
    assert f"modes of the struck body end at {sentences.si(last, 'Hz')}" in text


def test_result_of_a_strike_gives_the_same_blow(scene, hit, tmp_path):
    assert cli.main(["strike", str(scene), "--out", str(tmp_path / "out"), "--target", "modal"]) == 0
    for name in (tmp_path / "out", tmp_path / "out" / "response.json"):
        assert report.read(name).strike(target="modal").impulse == hit.impulse


@pytest.mark.parametrize(("kind", "target"), [("analytic", "modal"), ("fe", "vectors")])
def test_the_command_on_the_page_gives_the_same_numbers(prompt, kind, target):
    mesh = "size = 0.05\n[target]" if kind == "fe" else "[target]"
    Path("my plate.toml").write_text(TITLED.replace('"analytic"', f'"{kind}"').replace("[target]", mesh))
    assert prompt("report", "my plate.toml", "--out", "r.html", "--tolerance", "0.02").status == 0
    page = Path("r.html").read_text(encoding="utf-8")
    told = html.unescape(re.search(r"<code>(fem-impact .*?)</code>", page)[1])
    assert told.startswith("fem-impact strike 'my plate.toml'") and f"--target {target}" in told
    assert prompt(told.removeprefix("fem-impact "), "--out", "again").status == 0
    again, shown = json.loads(Path("again/response.json").read_text()), json.loads(download(page, "response.json"))
    assert again["response"] == shown["response"] and again["impacts"] == shown["impacts"]


def test_a_change_that_no_option_names_is_reproduced_from_python(tmp_path):
    scene = load_text(tmp_path)
    run = scene.run(motion=True, speed=1.0)
    told = report._command(scene, run)
    assert told.startswith("fi.load_scene(") and eval(told, {"fi": fi}).impulse == run.response.impulse


@pytest.mark.slow
def test_result_carries_its_mesh_wherever_it_goes(tmp_path, prompt, monkeypatch):
    text = TITLED.replace('shape = "rectangle"\nlength = 0.465\nwidth = 0.3', 'shape = "file"\npath = "plate.msh"')
    (tmp_path / "scene.toml").write_text(text.replace('"analytic"', '"fe"').replace("1e-2", "1e-1"))
    fi.mesh.save(tmp_path / "plate.msh", fi.mesh.rectangle(0.465, 0.3, size=0.1))
    assert prompt("strike scene.toml --out out --target rigid").status == 3  # quick, and misses
    assert "plate.msh" in json.loads(Path("out/response.json").read_text())["files"]
    moved = tmp_path / "elsewhere" / "moved"
    moved.parent.mkdir()
    Path("out").rename(moved)
    Path("plate.msh").unlink()
    monkeypatch.chdir("/")
    assert report.read(moved).body().points.max() == 0.465
    (moved / "plate.msh").unlink()
    ran = prompt("report", moved, "--out", tmp_path / "report.html")
    assert ran.status == 2
    assert f"the file of the struck body is missing: restore {moved / 'plate.msh'}" in ran.err


@pytest.mark.parametrize(
    "text",
    ["", "[]", '{"scene": 3}', "[" * 100_000, '{"scene": {"mesh": {"x": ' + "[" * 900 + "]" * 900 + "}}}",
     '{"scene": {"mesh": {}}}'],
)  # fmt: skip
def test_file_that_is_no_result_is_a_sentence(tmp_path, prompt, text):
    path = tmp_path / "response.json"
    path.write_text(text)
    ran = prompt("report", path, "--out", "report.html")
    assert ran.status == 2 and ran.err.startswith(f"fem-impact: {path}") and ran.err.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == ["response.json"]


def test_beams_and_balls_have_a_page_too(tmp_path):
    ball = 'kind = "sphere"\nradius = 0.01\nE = 210e9\nnu = 0.3\nrho = 7850.0'
    scene = load_text(tmp_path, BAR.replace('kind = "rigid"\nmass = 0.03', ball))
    report.write(tmp_path / "bar.html", scene, scene.run(target="modal"))
    page = (tmp_path / "bar.html").read_text(encoding="utf-8")
    assert "A beam of 350" in page and "by a ball of 32.88" in page


STROKES = "[[stroke]]\nwhen = 0.03\n[[stroke]]\nwhen = 0.0\nat = [0.2, 0.1]\nspeed = 0.5\n"


def test_a_sequence_has_a_page_with_every_stroke(prompt):
    Path("flam.toml").write_text(SMALL + STROKES)
    ran = prompt("report flam.toml --out r.html")
    assert ran.status in (0, 3) and "2 strokes" in ran.out
    text = Path("r.html").read_text(encoding="utf-8")
    assert "Report of a sequence" in text and "It is struck 2 times in 30" in text and 'plot-energy" role' not in text
    assert "struck at (0.1395, 0.09) and (0.2, 0.1) m" in text
    data = json.loads(download(text, "response.json"))
    assert [each["when"] for each in data["strokes"]] == [0.0, 0.03]


def test_listeners_in_free_air_get_a_player_for_each_bound(tmp_path):
    scene = load_text(tmp_path, BAR + "[observe]\nlistener = [0.2, 0.1, 0.5]\n")
    players = report._sounds(scene, scene.run(target="modal").response)
    told = {player["name"].partition("; ")[2] for player in players} - {""}
    assert len(told) == 1 and re.fullmatch(r"bounded: between [\d.]+ and [\d.]+ dB re 20 µPa", told.pop())
    names = [player["name"].partition(";")[0] for player in players if "bounded" in player["name"]]
    place = "Sound radiated to (0.2, 0.1, 0.5)\N{NO-BREAK SPACE}m without a baffle"
    assert list(dict.fromkeys(names)) == [f"{place}, estimate from below", f"{place}, estimate from above"]


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(0.0041273, "s", "4.127 ms"), (0.1, "kg", "100 g"), (5e5, "kg", "500 t"), (2.5, "kg", "2.5 kg"),
     (0.0, "N", "0 N"), (-2e-7, "m", "−200 nm"), (1000.0, "Hz", "1 kHz"), (0.00099998, "N s", "1 mN s"),
     (float("inf"), "Hz", "∞ Hz")],
)  # fmt: skip
def test_numbers_have_prefixes(value, unit, text):
    assert sentences.si(value, unit).replace(sentences.NBSP, " ") == text


@pytest.mark.parametrize(("value", "text"), [(4.5e-6, "4.5\u00a0·\u00a010⁻⁶"), (1e-4, "10⁻⁴"), (0.0, "0")])
def test_small_numbers_have_powers(value, text):
    assert sentences.power(value) == text


def test_nothing_fails_or_is_asked_for_and_sounds_load(desktop):
    desktop.tab.wait_for_timeout(300)
    asked = [url for url in desktop.requests if not url.startswith(("data:", "blob:"))]
    assert desktop.errors == [] and asked == desktop.requests[:1]
    assert asked[0].startswith("file:") and desktop.tab.title() == SCRIPT
    desktop.until("[...document.querySelectorAll('audio')].every(a => a.readyState >= 1)")
    lengths = desktop.tab.evaluate("[...document.querySelectorAll('audio')].map(a => a.duration)")
    assert len(lengths) >= 2 and all(0.4 < length < 4.0 for length in lengths)


@pytest.mark.slow
def test_sliders_lists_and_keys_change_the_pictures_and_nothing_moves_by_itself(opened):
    shown = opened()
    tab = shown.tab
    eye = "JSON.stringify(document.getElementById('plot-wave').layout.scene.camera.eye)"
    before = tab.evaluate(eye)
    tab.locator("#plot-wave").focus()
    tab.keyboard.press("ArrowLeft")
    shown.until(f"{eye} !== '{before}'")
    depth = "Math.min(...document.getElementById('plot-wave').data[0].z)"
    before, picture = tab.evaluate(depth), tab.locator("#plot-wave").screenshot()
    tab.locator("#wave-time").focus()
    for _ in range(10):
        tab.keyboard.press("ArrowRight")
    shown.until(f"{depth} !== {before}")
    assert "s" in tab.locator("#wave-out").inner_text() and tab.locator("#plot-wave").screenshot() != picture
    still = tab.locator("#wave-time").input_value()
    tab.wait_for_timeout(200)
    assert tab.locator("#wave-time").input_value() == still
    tab.locator("#wave-play").press("Enter")
    shown.until(f"document.getElementById('wave-time').value !== '{still}'")
    assert tab.locator("#wave-play").inner_text() == "Pause"
    shape = "Array.from(document.getElementById('plot-mode').data[0].z).slice(0, 400).join()"
    before = tab.evaluate(shape)
    tab.select_option("#mode-pick", index=3)
    shown.until(f"{shape} !== '{before}'")


@pytest.mark.slow
def test_paper_is_light_and_shows_the_views(opened):
    shown = opened(color_scheme="dark")
    if shown.tab.evaluate("!document.createElement('canvas').getContext('webgl')"):
        pytest.skip("this browser has no WebGL, so there are no views to print")
    shown.tab.evaluate("dispatchEvent(new Event('beforeprint'))")
    shown.tab.emulate_media(media="print", color_scheme="dark")
    shown.until("[...document.querySelectorAll('.view .printed')].filter(i => i.naturalWidth > 100).length === 2")
    # a view that had been wiped would be of one colour
    colours = """() => [...document.querySelectorAll('.view .printed')].map(image => {
        const canvas = document.createElement('canvas');
        [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
        const pen = canvas.getContext('2d');
        pen.drawImage(image, 0, 0);
        return new Set(new Uint32Array(pen.getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size;
    })"""
    assert min(shown.tab.evaluate(colours)) > 50
    paper = shown.tab.evaluate("getComputedStyle(document.body).backgroundColor")
    assert min(map(int, re.findall(r"\d+", paper)[:3])) > 230
    assert shown.tab.evaluate("getComputedStyle(document.querySelector('nav')).display") == "none"
    assert shown.errors == []


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_fits_a_phone(opened, scheme):
    shown = opened(width=375, height=700, color_scheme=scheme, reduced_motion="reduce")
    assert shown.tab.evaluate("document.documentElement.scrollWidth") == 375
    cut = "[...document.querySelectorAll('.scroll, pre, nav ul')].filter(e => e.scrollWidth > e.clientWidth).length"
    assert shown.tab.evaluate(cut) == 0  # nothing has to be pushed aside to be read
    small = "[...document.querySelectorAll('button, select')].filter(e => e.getBoundingClientRect().height < 40).length"
    assert shown.tab.evaluate(small) == 0  # 40 px: a finger's width
    both = "[getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor]"
    ink, paper = (sum(map(int, re.findall(r"\d+", c)[:3])) / 765 for c in shown.tab.evaluate(both))
    assert (ink < 0.2 and paper > 0.9) if scheme == "light" else (ink > 0.8 and paper < 0.2)


def test_keyboard_reaches_everything_and_pictures_have_a_text_for_those_who_cannot_see_them(desktop):
    tags, names, seen = zip(*desktop.tabbed_to())
    assert {"A", "BUTTON", "INPUT", "SELECT", "AUDIO"} <= set(tags)
    assert {"plot-wave", "wave-play", "wave-time", "plot-mode", "mode-pick"} <= set(names)
    assert names[0] == "Skip to the report" and all(seen)
    tab = desktop.tab
    pictures = "[...document.querySelectorAll('[role=img], audio, [role=application]')]"
    bare = "e => !e.getAttribute('aria-label') && !e.getAttribute('aria-labelledby')"
    assert tab.evaluate(f"{pictures}.length") > 5 and tab.evaluate(f"{pictures}.filter({bare}).length") == 0
    unnamed = "[...document.querySelectorAll('input, select')].filter(e => !e.labels.length).length"
    assert tab.evaluate(unnamed) == 0


def test_a_report_begins_with_what_was_missed_and_what_would_meet_it(tmp_path):
    scene = load_text(tmp_path)
    fi.report.write(tmp_path / "report.html", scene, scene.run(target="modal", n_modes=5, tolerance=1e-6))
    page = (tmp_path / "report.html").read_text()
    head = page[page.index("<header>") : page.index("</header>")]
    assert 'class="badge bad"' in head and "MISSED" in head and "modes of the target instead of 5" in head


def test_page_says_of_a_soft_blow_that_its_sound_was_not_asked_for(tmp_path):
    soft = load_text(tmp_path, TITLED.replace("695e3", "70"))
    for quantity, doubt in ((None, True), ("sound=24000", False)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", fi.ToleranceWarning)
            fi.report.write(tmp_path / "soft.html", soft, soft.run(quantity=quantity, motion=True))
        assert ("may err by" in (tmp_path / "soft.html").read_text()) == doubt


def test_page_and_result_tell_what_pushes_a_blow_and_ends_it(tmp_path, prompt):
    """Blows of a striker that falls ended in an error as soon as their plan was written down."""
    falls = TITLED.replace("0.03", "0.03\ngravity = 9.81").replace("695e3", "695e3\ngap = 2e-3")
    load_text(tmp_path, falls + "target_force = -0.5\nmax_impacts = 2\nduration = 4e-3\n")
    assert prompt("report scene.toml --out page.html").status in (0, 3)
    page = Path("page.html").read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    for said in ("falls back at 9.81 m/s²", "At the start the bodies are 2 mm apart.",
                 "A constant force of 500 mN pushes the body against the blow.",
                 "It is followed no further than after 4 ms or with impact 2.",
                 "the run ends in contact, after which the body rings as if let go"):  # fmt: skip
        assert said in page
    assert json.loads(download(page, "response.json"))["plan"]["assumptions"]


def test_data_cannot_close_the_script_around_them_and_are_json():
    data = {"title": "</script><b>", "numbers": [1.5, float("nan")]}
    assert html_page.script_data(data) == '{"title":"\\u003c/script>\\u003cb>","numbers":[1.5,null]}'
