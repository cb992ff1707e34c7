"""The page that follows a hand: safe to serve, quick, and usable by anyone."""

import contextlib
import http.client
import os
import re
import signal
import socket
import subprocess
import sys
from functools import partial
from importlib import import_module

import pytest
from scenes import LEAF, TITLED
from test_interrupt import RUNNER

from fem_impact.pages import explore_view
from fem_impact.scenes.sentences import si

SLIDERS = ("mass", "stiffness", "exponent", "speed", "bending", "x", "y")
READY = "document.documentElement.dataset.ready === 'true'"
MAP = "document.documentElement.dataset.map !== undefined"


@contextlib.contextmanager
def served(*words):
    """The address that a server of its own printed, and what ends it, as Ctrl-C does, quietly."""
    command = [sys.executable, "-m", "fem_impact.cli", "explore", *map(str, words), "--no-open"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    line = server.stdout.readline()
    assert line.startswith("http://127.0.0.1:"), server.communicate(timeout=120)[1]

    def end():
        if server.poll() is None:
            server.send_signal(signal.SIGINT)
            assert (server.communicate(timeout=120)[1], server.returncode) == ("", 0)

    try:
        yield line.split()[0], end
    finally:
        end()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("explore") / "small.toml"
    stick = 'kind = "stick"\nmass = 0.1\nfirst_frequency = 10e3'
    path.write_text(TITLED.replace("A small test", "<b>small</b>").replace('kind = "rigid"\nmass = 0.03', stick))
    return path


@pytest.fixture(scope="module")
def address(scene):
    with served(scene) as (address, _):
        yield address


@pytest.fixture
def opened(address, visit):
    return partial(visit, address, until=READY)


def ask(address, host=None, path="/", method="GET", **headers):
    port = int(address.rstrip("/").rpartition(":")[2])
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
    connection.putrequest(method, path, skip_host=True)
    for name, value in {"Host": f"127.0.0.1:{port}" if host is None else host, **headers}.items():
        connection.putheader(name.replace("_", "-"), value)
    with contextlib.closing(connection):
        connection.endheaders()
        with connection.getresponse() as answer:
            return answer.status


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "", "127.0.0.1"])
def test_other_hosts_are_refused(address, host):
    assert ask(address) == 200
    assert {ask(address, host, path) for path in ("/", "/talk", "/explore.js", "/nowhere")} == {403}


def test_pages_elsewhere_can_neither_speak_to_it_nor_send_a_file(address):
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Version": "13"}
    upgrade |= {"Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    assert ask(address, None, "/talk", Origin="http://evil.example", **upgrade) == 403
    for origin in ({}, {"Origin": "http://evil.example"}):
        assert ask(address, None, "/drop?name=a.svg", "POST", Content_Length="0", **origin) == 403
    own = {"Origin": address.rstrip("/"), "Content_Length": "0"}
    assert ask(address, None, "/drop?name=a.toml", "POST", **own) == 400
    assert ask(address, None, "/drop?name=..%2Fa.svg", "POST", **own) == 200


def test_large_requests_are_cut_off_and_only_this_machine_is_served(address):
    assert ask(address, None, "/", "POST", Content_Length="100000000") in (400, 405)
    with contextlib.suppress(http.client.HTTPException, ConnectionError):  # or the line is simply cut
        assert ask(address, None, "/", Cookie="x" * 100_000) in (400, 431)
    port = int(address.rstrip("/").rpartition(":")[2])
    with pytest.raises(OSError):  # another address of this machine: refused unless bound to all
        socket.create_connection(("127.0.0.2", port), timeout=60).close()


def test_a_port_that_is_taken_or_none_is_a_sentence(scene, address, prompt):
    taken = prompt("explore", scene, "--no-open", "--port", address.rstrip("/").rpartition(":")[2])
    assert taken.status == 1 and taken.err.count("\n") == 1
    wrong = prompt("explore", scene, "--no-open", "--port", "70000")
    assert wrong.status == 2 and "port must lie between 0 and 65535, got 70000" in wrong.err


def test_nothing_is_asked_for_elsewhere_and_sliders_change_the_pictures(opened, address):
    shown, turn = opened(), import_module("explore_speed").TURN
    shown.until(MAP)
    assert shown.tab.title() == "<b>small</b>" and shown.tab.locator("h1").inner_text() == "<b>small</b>"

    def pictures():
        return [shown.tab.locator(f"#{plot}-plot").screenshot() for plot in ("map", "force", "spectrum")]

    after = pictures()
    for name in SLIDERS:
        before = after
        shown.tab.evaluate(turn, name)  # until everything is answered; how fast: studies/benchmarks/explore_speed.py
        after = pictures()
        assert before[1] != after[1] and before[2] != after[2], name
        assert before[0] != after[0] or name not in ("mass", "stiffness")
    own = (address, address.replace("http", "ws", 1), "data:")
    assert [url for url in shown.requests if not url.startswith(own)] == [] and shown.errors == []


@pytest.mark.slow
def test_click_moves_the_strike_point_and_the_verdict_follows(opened):
    shown = opened()
    shown.until(MAP)  # what comes later moves the pictures
    click(shown, "body", 0.6, 0.4)
    shown.until("document.getElementById('x').value !== document.getElementById('x').defaultValue")  # sliders follow
    shown.until("document.getElementById('verdict').textContent.includes('(tolerance 0.01 met)')")
    assert shown.tab.inner_text("#verdict").startswith("Restitution 0.")
    assert "refining" not in shown.tab.inner_text("#numbers")
    assert shown.tab.inner_text("#what").startswith("the first ")


@pytest.mark.slow
def test_a_click_moves_the_listening_point_too(opened):
    shown = opened()
    shown.until(MAP)
    shown.tab.get_by_label("Click listens").check()
    before = shown.tab.locator("#body-plot").screenshot(), shown.tab.inner_text("#numbers")
    click(shown, "body", 0.6, 0.4)
    shown.until("document.documentElement.dataset.rested === '2'")
    assert shown.tab.locator("#body-plot").screenshot() != before[0]
    assert shown.tab.evaluate("document.getElementById('x').value === document.getElementById('x').defaultValue")
    shown.tab.click("#listen")
    # a strike before may have been heard already, from where the listener was
    heard = "document.getElementById('heard').innerText"
    shown.until(f"{heard}.includes('full scale') && !{heard}.includes('(0.1395, 0.09)')")


@pytest.mark.slow
def test_quick_hand_does_not_queue_up_blows(opened):
    shown = opened()
    shown.until(MAP)
    low, high = (float(shown.tab.get_attribute("#mass", f"data-{end}")) for end in ("low", "high"))
    last = si(low * (high / low) ** (219 / 400), "kg", 3)
    before = shown.tab.evaluate(
        """async () => {
            const slider = document.getElementById('mass'), before = Number(document.documentElement.dataset.rested);
            for (let i = 0; i < 120; i++) {
                slider.value = 100 + i;
                slider.dispatchEvent(new Event('input'));
                await new Promise(done => setTimeout(done, 2));
            }
            return before;
        }"""
    )
    shown.until(f"document.getElementById('mass-said').textContent === {last!r}")  # the last one counts
    asked = int(shown.tab.evaluate("document.documentElement.dataset.rested")) - before
    assert 1 <= asked < 100  # what the hand did meanwhile was sent together
    assert shown.errors == []


def click(shown, plot, x, y):
    """Click somewhere on a picture: shares of its width and height."""
    box = shown.box(plot)
    shown.tab.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])


@pytest.mark.slow
def test_map_is_zoomed_by_rectangle_and_wheel_and_there_is_a_way_back(opened):
    shown = opened()
    shown.until(MAP)
    canvas, box = shown.tab.locator("#map-plot"), shown.box("map")
    place = [(box["x"] + a * box["width"], box["y"] + b * box["height"]) for a, b in ((0.5, 0.2), (0.8, 0.6))]
    window = "JSON.parse(document.documentElement.dataset.map)"
    mass, stiffness = shown.tab.evaluate(window)[:2]
    shown.tab.mouse.move(*place[0])
    shown.tab.mouse.down()
    shown.tab.mouse.move(*place[1], steps=3)
    shown.tab.mouse.up()
    shown.until(f"{window}[0][0] > {1.5 * mass[0]}")
    zoomed = shown.tab.evaluate(window)
    assert mass[0] < zoomed[0][0] < zoomed[0][1] < mass[1]
    assert stiffness[0] < zoomed[1][0] < zoomed[1][1] < stiffness[1]
    shown.until(f"{window}[2] >= 385 && {window}[3]")  # refined up to the pixels, each border checked
    shown.tab.mouse.wheel(0, -100)
    shown.until(f"{window}[0][0] > {zoomed[0][0]} && {window}[0][1] < {zoomed[0][1]}")
    shown.tab.click("#back")
    shown.until(f"Math.abs({window}[0][0] / {zoomed[0][0]} - 1) < 1e-9")
    shown.tab.click("#whole")
    shown.until(f"Math.abs({window}[0][0] / {mass[0]} - 1) < 1e-9")
    assert shown.tab.is_disabled("#back") and shown.tab.is_disabled("#whole")
    before = shown.tab.inner_text("#mass-said")
    canvas.click(position={"x": 0.5 * box["width"], "y": 0.2 * box["height"]})  # where it lies by now
    shown.until(f"document.getElementById('mass-said').textContent !== {before!r}")  # a click still selects
    assert shown.errors == []


@pytest.mark.slow
def test_button_plays_the_sound(opened):
    shown = opened()
    shown.tab.click("#listen")
    shown.until("document.getElementById('player').readyState >= 1")
    assert shown.tab.evaluate("document.getElementById('player').duration") == pytest.approx(2.0, abs=0.01)
    shown.until("document.getElementById('heard').innerText.includes('full scale 10 m/s')")
    shown.until("Number(document.documentElement.dataset.rung) >= 1")
    before = shown.tab.evaluate("document.getElementById('player').src")
    shown.tab.click("#roll")
    shown.until(f"document.getElementById('player').src !== {before!r}")
    before = shown.tab.evaluate("document.getElementById('player').src")
    shown.tab.evaluate(import_module("explore_speed").TURN, "height")
    shown.tab.click("#listen")
    shown.until("document.getElementById('heard').innerText.includes(' above (')")
    assert "Pa; full scale" in shown.tab.inner_text("#heard")
    assert shown.tab.evaluate("document.getElementById('player').src") != before


@pytest.mark.slow
@pytest.mark.parametrize("width", [375, 768, 1280])
def test_the_map_stands_with_its_legend_and_each_slider_with_what_it_changes(opened, width):
    shown = opened(width=width, height=700)
    shown.assert_fits(width)
    cards = shown.tab.locator(".card").evaluate_all(
        """cards => cards.map(card => [
            ...[card, card.querySelector('figure'), card.querySelector('.legend'), card.querySelector('.hands')].map(
                part => part ? Object.values(part.getBoundingClientRect().toJSON()) : null)
        ])"""
    )  # each [x, y, width, height, top, right, bottom, left]
    assert len(cards) == 4
    for card, figure, legend, hands in cards:
        assert card[7] >= 0 and card[5] <= width and figure[2] > 0.5 * min(card[2], 540)
        if legend:
            assert 0 <= legend[4] - figure[6] < 40 and legend[7] >= card[7] and legend[5] <= card[5]
        if width == 375:
            assert hands[4] >= figure[6]  # below
        else:
            assert hands[7] >= figure[5] and hands[4] < figure[6]  # beside
        assert hands[7] >= card[7] and hands[5] <= card[5]
    under = shown.tab.evaluate(
        """['body', 'map', 'force', 'spectrum'].map(n => [...document.querySelectorAll(`#hands-${n} [type=range]`)]
            .map(slider => slider.id))"""
    )
    assert under == [list(names) for names in explore_view.CARDS.values()]


@pytest.mark.slow
def test_keyboard_turns_every_slider(opened):
    shown = opened()
    stops = shown.tabbed_to()
    names = {name for _, name, _ in stops}
    others = "height rate damping thickness loss listen roll closer player file pick-mallet keep midi"
    assert {*SLIDERS, *others.split()} <= names and [stop for stop in stops if not stop[2]] == []
    before = shown.tab.inner_text("#mass-said")
    shown.tab.focus("#mass")
    shown.tab.keyboard.press("ArrowRight")
    shown.until(f"document.getElementById('mass-said').textContent !== {before!r}")
    spoken = shown.tab.get_attribute("#mass", "aria-valuetext")
    assert re.fullmatch(r"[0-9.]+\sg", spoken)  # the mass, not its logarithm
    assert shown.tab.get_by_label("Mass", exact=True).get_attribute("id") == "mass"


@pytest.mark.slow
def test_page_says_that_the_server_has_ended(scene, visit):
    with served(scene) as (address, end):
        shown = visit(address, until=READY)
        end()
        shown.until("document.getElementById('verdict').textContent.includes('has ended')")


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_before_it_serves_is_quiet_too(scene, tmp_path):
    """Half a second of computing is spent on importing; serving begins after twice that."""
    mark = tmp_path / "mark"
    words = ["cpu", "0.5", str(int(signal.SIGINT)), str(mark), "explore", str(scene), "--no-open"]
    done = subprocess.run([sys.executable, "-c", RUNNER, *words], capture_output=True, text=True)
    assert mark.read_text() == "sent" and done.stdout == ""  # mid-run, and nothing served yet
    assert "Traceback" not in done.stderr and done.returncode in (0, 130, -signal.SIGINT)


@pytest.mark.slow
def test_a_dropped_drawing_is_struck_with_yarn_and_compared(visit, tmp_path):
    """A percussionist's way: a leaf, a mallet, two points side by side with their sounds."""
    leaf = tmp_path / "leaf.svg"
    leaf.write_text(LEAF)
    with served() as (address, _):
        shown = visit(address, until=READY)
        root = "document.documentElement.dataset"
        shown.tab.set_input_files("#file", {"name": "bad.svg", "mimeType": "image/svg+xml", "buffer": b"<svg/>"})
        shown.until(f"{root}.bench === 'failed'")
        assert "bad.svg" in shown.tab.inner_text("#bench-said")
        shown.tab.set_input_files("#file", leaf)
        shown.until(f"{root}.bench.includes('leaf.svg')")
        assert "the drawing's y is taken as -y" in shown.tab.inner_text("#notes")
        shown.tab.fill("#search-mallet", "mallet medium")
        assert shown.tab.locator("#pick-mallet option").all_inner_texts() == [
            "as in the scene", "yarn, medium", "rubber, medium"
        ]  # fmt: skip
        shown.tab.select_option("#pick-mallet", "yarn, medium")
        shown.until(f"{root}.bench.includes('yarn, medium')")
        assert shown.tab.inner_text("h1") == "Leaf struck by yarn, medium"
        for letters, x in (("A", 0.5), ("AB", 0.7)):
            click(shown, "body", x, 0.5)
            shown.tab.click("#keep")
            shown.until(f"{root}.kept === '{letters}'")
        first, second = (each.inner_text() for each in shown.tab.locator("#kept article").all())
        assert "peak force" in first and first.splitlines()[1:] != second.splitlines()[1:]
        shown.tab.evaluate(f"delete {root}.rung")
        shown.tab.click("#turns")
        shown.until(f"Number({root}.rung) >= 2")
        assert shown.errors == []


@pytest.mark.slow
def test_keys_and_midi_strike_kept_blows_at_other_speeds(opened):
    shown = opened()
    shown.tab.uncheck("#aloud")  # first: no strike but those of keys is to be heard
    shown.tab.click("#midi")
    shown.until("document.getElementById('midi-said').textContent !== ''")  # whatever this browser has
    shown.tab.click("#keep")
    shown.until("document.documentElement.dataset.kept === 'A'")
    shown.tab.evaluate(
        """() => {
            window.fake = { name: 'Keys' };
            navigator.requestMIDIAccess = async () => ({ inputs: new Map([['a', window.fake]]) });
            document.documentElement.dataset.rung = 0;
            document.activeElement.blur();
        }"""
    )
    # as kept, twice as fast, the same from memory, half as fast, the present
    for rung, key in enumerate(("a", "q", "q", "z", "Space"), 1):
        shown.tab.keyboard.press(key)
        shown.until(f"document.documentElement.dataset.rung === '{rung}'")
    shown.tab.click("#midi")
    shown.until("document.getElementById('midi-said').textContent.startsWith('Listening to Keys')")
    shown.tab.evaluate("window.fake.onmidimessage({ data: [0x90, 61, 100] })")
    shown.until(f"document.documentElement.dataset.rung === '{rung + 1}'")
    shown.tab.get_by_role("button", name="Forget A").click()
    shown.until("document.documentElement.dataset.kept === ''")
    shown.tab.evaluate("delete navigator.requestMIDIAccess; navigator.requestMIDIAccess = undefined")
    shown.tab.click("#midi")
    shown.until("document.getElementById('midi-said').textContent.startsWith('This browser has no Web MIDI')")
    assert shown.errors == []
