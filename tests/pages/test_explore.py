"""The page that follows a hand: safe to serve, quick, and usable by anyone."""

import contextlib
import http.client
import os
import signal
import socket
import subprocess
import sys
import time

import pytest
from test_cli import TEXT
from test_interrupt import RUNNER
from test_studies import study

from fem_impact import cli


def served(scene, *options):
    """A server of its own, and the address it printed."""
    command = [sys.executable, "-m", "fem_impact.cli", "explore", str(scene), "--no-open", *options]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    line = server.stdout.readline()
    assert line.startswith("http://127.0.0.1:"), server.communicate(timeout=120)[1]
    return server, line.split()[0]


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("explore") / "small.toml"
    stick = 'kind = "stick"\nmass = 0.1\nfirst_frequency = 10e3'
    path.write_text(TEXT.replace("A small test", "<b>small</b>").replace('kind = "rigid"\nmass = 0.03', stick))
    return path


@pytest.fixture(scope="module")
def address(scene):
    server, address = served(scene)
    yield address
    server.send_signal(signal.SIGINT)
    _, err = server.communicate(timeout=120)
    assert (server.returncode, err) == (0, "")  # Ctrl-C ends quietly


@pytest.fixture
def opened(address, visit):
    def opened(**options):
        shown = visit(address, **options)
        shown.until("document.documentElement.dataset.ready === 'true'")
        return shown

    return opened


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


def test_other_hosts_are_refused(address):
    assert ask(address) == 200
    for host in ("evil.example", "evil.example:80", "127.0.0.1.evil.example", "", "127.0.0.1"):
        for path in ("/", "/ws", "/static/js/bokeh.min.js", "/nowhere"):
            assert ask(address, host, path) == 403


def test_pages_elsewhere_cannot_speak_to_it(address):
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Version": "13"}
    upgrade |= {"Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ==", "Sec_WebSocket_Protocol": "bokeh, x"}
    assert ask(address, None, "/ws", Origin="http://evil.example", **upgrade) == 403


def test_large_requests_are_cut_off(address):
    assert ask(address, None, "/", "POST", Content_Length="100000000") == 400
    with contextlib.suppress(http.client.HTTPException, ConnectionError):  # or the line is simply cut
        assert ask(address, None, "/", Cookie="x" * 100_000) in (400, 431)


def test_only_this_machine_is_served(address):
    port = int(address.rstrip("/").rpartition(":")[2])
    with pytest.raises(OSError):  # another address of this machine: refused unless bound to all
        socket.create_connection(("127.0.0.2", port), timeout=60).close()


def test_port_that_is_taken_is_a_sentence(scene, address, capsys):
    port = address.rstrip("/").rpartition(":")[2]
    assert cli.main(["explore", str(scene), "--no-open", "--port", port]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert cli.main(["explore", str(scene), "--no-open", "--port", "70000"]) == 2
    assert "port must lie between 0 and 65535, got 70000" in capsys.readouterr().err


def test_missing_extra_is_named(scene, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "bokeh.server.tornado", None)
    assert cli.main(["explore", str(scene), "--no-open"]) == 2
    assert "exploring needs bokeh: pip install 'fem-impact[web]'" in capsys.readouterr().err


def test_nothing_fails_and_nothing_is_asked_for_elsewhere(opened, address):
    shown = opened()
    shown.until(
        "document.querySelector('.readout') && Bokeh.documents[0].get_model_by_name('cells').data.left.length > 0"
    )
    assert shown.errors == []
    own = (address, address.replace("http", "ws", 1), "data:", "blob:")
    assert [url for url in shown.requests if not url.startswith(own)] == []
    assert shown.tab.title() == "<b>small</b>" and shown.tab.locator("h1").inner_text() == "<b>small</b>"


SAYS = (
    "[...document.querySelectorAll('.readout *')].some(e => e.shadowRoot?.textContent.toLowerCase()"
    '.includes("TEXT".toLowerCase()))'
)
MASS = 4  # its slider: those of the strike point, the listener and the roll come before
MAP = "Bokeh.documents[0].get_model_by_name('cells').data.left.length > 0"


def until_it_changes(shown, number, before):
    """Wait until the picture of a figure is another one."""
    end = time.monotonic() + 120.0
    while shown.tab.locator(f"figure >> nth={number}").screenshot() == before:
        assert time.monotonic() < end, f"figure {number} stays as it was"
        shown.tab.wait_for_timeout(20)


def test_sliders_change_the_pictures(opened):
    shown, turn = opened(), study("explore_speed").TURN
    shown.until(MAP)
    for name in ("mass", "stiffness", "exponent", "speed", "bending", "x", "y"):
        before = {plot: shown.tab.locator(f"figure >> nth={i}").screenshot() for plot, i in (("map", 1), ("force", 2))}
        shown.tab.evaluate(turn, name)  # how fast: studies/explore_speed.py
        until_it_changes(shown, 2, before["force"])
        if name in ("mass", "stiffness"):
            until_it_changes(shown, 1, before["map"])
    assert shown.errors == []


@pytest.mark.slow
def test_click_moves_the_strike_point(opened):
    shown = opened()
    place = "JSON.stringify(Bokeh.documents[0].get_model_by_name('at').data)"
    before = shown.tab.evaluate(place)
    box = shown.tab.locator("figure >> nth=0").bounding_box()
    shown.tab.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + 0.4 * box["height"])
    shown.until(f"{place} !== '{before}'")
    x = shown.tab.evaluate("Bokeh.documents[0].get_model_by_name('at').data.x[0]")
    shown.until(f"Math.abs(Bokeh.documents[0].get_model_by_name('x').value - {x}) < 1e-9")  # the sliders follow
    refined = "[...document.querySelectorAll('.readout *')].some(e => /10[⁻0-9]/.test(e.shadowRoot?.textContent ?? ''))"
    shown.until(refined)  # and the exact blow takes the place of the quick one
    shown.until(refined.replace("/10[⁻0-9]/", "/model's own error/"))  # which is examined when the hand rests


@pytest.mark.slow
def test_quick_hand_does_not_queue_up_blows(opened):
    shown = opened()
    box = shown.tab.locator(".noUi-handle").nth(MASS).bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    page = "Bokeh.documents[0].get_model_by_name"
    followed = f"Math.abs(Math.log10({page}('here').data.x[0]) - {page}('mass').value) < 1e-9"
    shown.until(MAP)
    shown.tab.mouse.move(x, y)
    shown.tab.mouse.down()
    single = time.monotonic()
    shown.tab.mouse.move(x + 40.0, y)
    shown.until(followed)
    single = time.monotonic() - single
    for i in range(120):
        shown.tab.mouse.move(x + 80.0 * (-1) ** i * i / 120.0, y)
    shown.tab.mouse.up()
    hurried = time.monotonic()
    shown.until(followed)
    hurried = time.monotonic() - hurried
    # 120 blows one after another, each drawn, would take some forty times as long as one
    assert hurried < 15.0 * single + 1.0
    assert shown.errors == []


@pytest.mark.slow
def test_button_plays_the_sound(opened):
    shown = opened()
    shown.tab.get_by_role("button", name="Strike and listen").click()
    shown.until("document.getElementById('player').readyState >= 1")
    assert shown.tab.evaluate("document.getElementById('player').duration") == pytest.approx(2.0, abs=0.01)
    shown.until("document.getElementById('heard').innerText.includes('Full scale is 10 m/s')")
    shown.tab.get_by_role("button", name="Play a roll").click()
    shown.until("document.getElementById('heard').innerText.includes('Computing')")
    shown.until("document.getElementById('heard').innerText.includes('Full scale is 10 m/s')")
    before = shown.tab.evaluate("document.getElementById('player').src")
    page = "Bokeh.documents[0].get_model_by_name"
    shown.tab.evaluate(f"{page}('height').value = 1.5")
    shown.tab.get_by_role("button", name="Strike and listen").click()
    shown.until("document.getElementById('heard').innerText.includes(' above (')")
    assert "Pa; peak" in shown.tab.inner_text("#heard")
    assert shown.tab.evaluate("document.getElementById('player').src") != before


@pytest.mark.slow
def test_a_click_moves_the_listening_point_too(opened):
    shown = opened()
    page = "Bokeh.documents[0].get_model_by_name"
    shown.tab.get_by_role("button", name="Click listens").click()
    shown.until(f"{page}('moves').active === 1")
    struck, ear = (shown.tab.evaluate(f"JSON.stringify({page}('{name}').data)") for name in ("at", "ear"))
    box = shown.tab.locator("figure >> nth=0").bounding_box()
    shown.tab.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + 0.4 * box["height"])
    shown.until(f"JSON.stringify({page}('ear').data) !== '{ear}'")
    assert shown.tab.evaluate(f"JSON.stringify({page}('at').data)") == struck


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 768])
def test_the_map_stands_with_its_legend_and_each_slider_with_what_it_changes(opened, width):
    shown = opened(width=width, height=900)
    assert shown.tab.evaluate("document.documentElement.scrollWidth") == width
    cards = shown.tab.locator(".card").evaluate_all(
        """cards => cards.map(card => [
            ...[card, card.querySelector('figure'), card.querySelector('.legend'), card.lastElementChild].map(
                part => part ? Object.values(part.getBoundingClientRect().toJSON()) : null)
        ])"""
    )  # each [x, y, width, height, top, right, bottom, left]
    assert len(cards) == 4
    for card, figure, legend, hands in cards:
        assert card[7] >= 0 and card[5] <= width and figure[2] > 0.6 * min(card[2], 300)
        if legend:
            assert 0 <= legend[4] - figure[6] < 40 and legend[7] >= card[7] and legend[5] <= card[5]
        assert hands[4] >= figure[6] and hands[4] - (legend or figure)[6] < 60  # right below
    under = shown.tab.evaluate(
        """['body', 'map', 'force', 'spectrum'].map(name => Bokeh.documents[0].get_model_by_name('hands-' + name)
            .children.map(child => child.name))"""
    )
    assert under[1] == ["mass", "stiffness"] and under[2] == ["speed", "exponent", "loss"]
    assert under[0] == ["moves", "x", "y", "height", "rate", "listen", "roll"]
    shown.until(SAYS.replace("TEXT", "Tolerance 0.001 met"))
    shown.until(SAYS.replace("TEXT", "he model's own error"))


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_fits_a_phone(opened, scheme):
    shown = opened(width=375, height=700, color_scheme=scheme)
    assert shown.tab.evaluate("document.documentElement.scrollWidth") == 375
    shown.until("document.querySelectorAll('figure').length === 4")
    canvases = shown.tab.locator("figure").evaluate_all("all => all.map(f => f.getBoundingClientRect().right)")
    assert len(canvases) == 4 and max(canvases) <= 375


@pytest.mark.slow
def test_keyboard_turns_every_slider(opened):
    shown = opened()
    shown.tab.locator(".noUi-handle").nth(6).wait_for()
    stops = shown.tabbed_to()
    names = [name for _, name, _ in stops]
    for name in ("Mass", "Stiffness", "Exponent", "Speed", "First bending mode", "Strike point x", "Strike point y"):
        assert name in names
    assert "Strike and listen" in names and "player" in names
    assert [stop for stop in stops if not stop[2]] == []
    mass = "Bokeh.documents[0].get_model_by_name('mass').value"
    before = shown.tab.evaluate(mass)
    shown.tab.locator(".noUi-handle").nth(MASS).focus()
    shown.tab.keyboard.press("ArrowRight")
    shown.until(f"{mass} > {before}")
    spoken = (
        "Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name('mass')).shadow_el.querySelector('.noUi-handle')"
    )
    shown.until(f"/^[0-9.]+\\s*g$/.test({spoken}.getAttribute('aria-valuetext'))")  # the mass, not its logarithm


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_before_it_serves_is_quiet_too(scene, tmp_path):
    """Half a second of computing is spent on importing; serving begins after twice that."""
    mark = tmp_path / "mark"
    words = ["cpu", "0.5", str(int(signal.SIGINT)), str(mark), "explore", str(scene), "--no-open"]
    done = subprocess.run([sys.executable, "-c", RUNNER, *words], capture_output=True, text=True)
    assert mark.read_text() == "sent" and done.stdout == ""  # mid-run, and nothing served yet
    assert "Traceback" not in done.stderr and done.returncode in (0, 130, -signal.SIGINT)
