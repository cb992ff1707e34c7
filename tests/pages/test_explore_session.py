"""An open page is answered at once, judged when its hand rests, and never sent what it no longer asks for."""

import asyncio
import gc
import json
import logging
import re
import time
from concurrent.futures import Future, ThreadPoolExecutor

import pytest
from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

import fem_impact as fi
from fem_impact.pages import explore_map, explore_numbers, explore_server, explore_session
from fem_impact.scenes.sentences import si


class Beside:
    """A worker that computes in this process, at once, and notes what it was asked."""

    def __init__(self, explorer):
        self.explorer, self.asked, self.ended = explorer, [], 0

    def ask(self, function, *arguments):
        self.asked.append((function.__name__, arguments))
        answer = Future()
        answer.set_result(function(self.explorer, *arguments))
        return answer


def run(function, *arguments):
    """Run a coroutine; in a thread of its own, because Playwright keeps a loop running in this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(lambda: asyncio.run(function(*arguments))).result()


def follow(explorer, monkeypatch, *messages, until=lambda said: True, rest=0.0, apart=False):
    """What a page is sent after some messages, each of which waits for the answer to the last one if they are apart."""
    monkeypatch.setattr(explore_session, "REST", rest)
    monkeypatch.setattr(explore_map, "FINEST", 49)
    said, workers = [], (Beside(explorer), Beside(explorer))

    async def work():
        session = explore_session.Session(explorer, *workers, lambda told: said.append(json.loads(json.dumps(told))))
        for message in messages:
            session.obey(message)
            while apart and session.asked is not None:
                await asyncio.sleep(0)
        end = time.monotonic() + 120.0  # of a busy machine
        while not until(said) and time.monotonic() < end:
            await asyncio.sleep(0.01)
        session.close()
        return session

    session = run(work)
    assert until(said)
    return said, session, workers


WINDOW = {"mass": [0.02, 0.04], "stiffness": [1.0, 10.0]}
ANSWERED = {"until": lambda said: any(one["kind"] == "rest" for one in said), "rest": 60.0}


def mapped(said):
    """What was sent with a map."""
    return [one for one in said if one.get("columns")]


def test_force_and_numbers_come_first_then_the_rest_then_the_verdict(explorer, monkeypatch):
    def done(said):
        return any(one.get("exact") for one in said) and len(mapped(said)) >= 3

    said, _, _ = follow(explorer, monkeypatch, {"number": 1, "turn": {"mass": 0.02}}, until=done)
    assert [one["kind"] for one in said[:2]] == ["blow", "rest"]
    first, exact = said[0], next(one for one in said if one.get("exact"))
    assert first["mass"] == 0.02 and first["said"]["mass"] == si(0.02, "kg", 3)
    assert "verdict" not in first and exact["verdict"]
    assert [one["columns"] for one in mapped(said)[:2]] == [25, 49]  # coarse first, then finer
    assert not any(one["exact"] for one in mapped(said)[:3])


def test_a_hand_that_does_not_rest_is_neither_judged_nor_mapped(explorer, monkeypatch):
    moves = [{"number": i, "turn": {"speed": 1.0 + 0.01 * i}} for i in range(1, 6)]
    said, session, workers = follow(explorer, monkeypatch, *moves, **ANSWERED)
    assert [one["number"] for one in said if one["kind"] == "blow"] == [5]  # what was superseded is not struck
    assert workers[0].asked == workers[1].asked == []
    assert session.settings.speed == pytest.approx(1.05)


def test_a_window_is_mapped_at_once(explorer, monkeypatch):
    said, _, _ = follow(explorer, monkeypatch, {"view": WINDOW}, until=mapped, rest=60.0)
    assert all(mapped(said)[0][name] == pytest.approx(ends) for name, ends in WINDOW.items())


def test_way_back_is_drawn_even_if_the_map_in_between_was_not_finished(explorer, monkeypatch):
    monkeypatch.setattr(explore_map, "FINEST", 49)
    said = []

    async def work():
        session = explore_session.Session(explorer, Beside(explorer), Beside(explorer), said.append)
        session.obey({"view": None})
        while not any(one.get("columns") == 49 for one in said):
            await asyncio.sleep(0.001)
        await asyncio.sleep(0.01)  # the whole map is done
        session.obey({"view": WINDOW})
        while said[-1].get("mass", [0.0])[0] != pytest.approx(0.02):
            await asyncio.sleep(0.0)
        session.obey({"view": None})  # before its finer form is there
        before = len(said)
        while len(said) == before or not said[-1].get("columns"):
            await asyncio.sleep(0.001)
        session.close()

    run(work)
    assert said[-1]["mass"] == pytest.approx(explorer.setup.range("mass"))


def test_listener_moves_without_another_blow(explorer, monkeypatch):
    moves = [{"number": 1, "turn": {}}, {"number": 2, "ear": [0.2, 0.1]}, {"number": 3, "turn": {"height": 1.0}}]
    said, session, _ = follow(explorer, monkeypatch, *moves, rest=60.0, apart=True)
    assert session.listener == (0.2, 0.1) and session.height == 1.0
    assert ["force" in one for one in said if one["kind"] == "blow"] == [True, False, False]
    assert said[-2]["said"]["height"] == f"{si(1.0, 'm', 3)}, in the air"


@pytest.mark.parametrize("message", [
    [], 3, {"turn": []}, {"turn": {"nothing": 1.0}}, {"turn": {"mass": "1"}}, {"turn": {"mass": float("nan")}},
    {"turn": {"mass": True}}, {"turn": {"mass": 10**400}},
    {"ear": [1.0]}, {"ear": "ab"}, {"view": {"mass": [1.0, 2.0]}}, {"view": 3},
])  # fmt: skip
def test_nonsense_is_refused(explorer, monkeypatch, message):
    with pytest.raises(ValueError, match="must be"):
        follow(explorer, monkeypatch, message)


def test_values_beyond_a_slider_become_its_end(explorer, monkeypatch):
    _, session, _ = follow(explorer, monkeypatch, {"number": 1, "turn": {"mass": 1e9, "x": -1e-12}}, **ANSWERED)
    assert session.settings.mass == explorer.setup.range("mass")[1] and session.settings.at[0] == 0.0


@pytest.mark.parametrize(
    "message, stays", [({"turn": {"x": -0.01, "y": 0.1}}, "strike"), ({"ear": [9.0, 0.1]}, "listening")]
)
def test_a_click_beside_the_body_moves_nothing_and_says_so(explorer, monkeypatch, message, stays):
    said, session, _ = follow(explorer, monkeypatch, {"number": 1, **message}, **ANSWERED)
    assert re.fullmatch(rf"\(.*\)\sm is beside the body: the {stays} point stays\.", said[0]["note"])
    assert session.settings.at == explorer.setup.start.at == session.listener


def test_where_the_body_does_not_move_nothing_is_heard(explorer, monkeypatch):
    corner = {"number": 1, "turn": {"x": 0.0, "y": 0.0}}

    said, session, _ = follow(explorer, monkeypatch, corner, **ANSWERED)
    assert session.settings.at == (0.0, 0.0) and said[0]["note"].startswith("The body does not move at (0, 0)")
    settings, middle = session.settings, explorer.setup.start
    for struck, where, height in ((settings, middle.at, 0.0), (settings, middle.at, 1.0), (middle, (0.0, 0.0), 0.0)):
        sound = explorer.listen(struck, where, height, None)
        assert sound["uri"] == "" and sound["note"].startswith("Silent: the body does not move at (0, 0)")


def test_one_page_that_asks_for_much_does_not_make_another_wait(explorer, monkeypatch):
    struck, answer = [], explorer.answer
    monkeypatch.setattr(explorer, "answer", lambda settings: struck.append(settings.mass) or answer(settings))

    async def work():
        said = []
        beside = explorer, Beside(explorer), Beside(explorer)
        one, other = (explore_session.Session(*beside, lambda told, who=who: said.append((who, told)))
                      for who in ("one", "other"))  # fmt: skip
        for i in range(1000):
            one.obey({"number": i, "turn": {"mass": 0.02 + 1e-6 * i}})
        other.obey({"number": 7, "turn": {"mass": 0.05}})
        while len(struck) < 2:
            await asyncio.sleep(0)
        one.close(), other.close()
        return [(who, message["number"]) for who, message in said if message["kind"] == "rest"]

    assert run(work) == [("one", 999), ("other", 7)]
    assert struck == [pytest.approx(0.020999), pytest.approx(0.05)]


def test_of_several_sounds_the_last_is_played(explorer, monkeypatch):
    asked = []
    monkeypatch.setattr(explore_numbers.Explorer, "listen", lambda *about: asked.append(about[-1]) or {"note": "done"})
    plays = [{"play": "roll"}] * 3 + [{"play": "blow"}]
    said, _, _ = follow(explorer, monkeypatch, *plays, until=lambda said: said[-1]["note"] == "done", rest=60.0)
    assert asked == [None] and len(said) == 5


class Replaced(Beside):
    """A worker whose process ends at every question, and is replaced or not."""

    def __init__(self, explorer, good):
        super().__init__(explorer)
        self.good = good

    def ask(self, function, *arguments):
        self.ended += 1
        answer = super().ask(function, *arguments)
        if not self.good:
            answer = Future()
            answer.set_exception(fi.SimulationError("the process has ended"))
        return answer


@pytest.mark.parametrize(("good", "told"), [(True, "another one has taken its place."), (False, "process has ended.")])
def test_a_process_that_ended_is_told_in_one_line(explorer, good, told):
    said = []

    async def work():
        session = explore_session.Session(explorer, Replaced(explorer, good), Beside(explorer), said.append)
        await session._guarded(session._judge)

    run(work)
    notes = [one["text"] for one in said if one["kind"] == "note"]
    assert notes and all(note.endswith(told) and "\n" not in note for note in notes)
    assert any(one.get("exact") for one in said) == good


BAD = {
    "nested": "[" * 60_000,
    "large": '{"turn": {"mass": 1%s}}' % ("0" * 400),
    "larger": '{"turn": {"mass": 1%s}}' % ("0" * 5000),
    "no JSON": "\0",
    "a list": "[]",
}


async def talk(host, text):
    """A connection that has sent a message, as a page would."""
    page = await websocket_connect(HTTPRequest(f"ws://{host}/talk", headers={"Origin": f"http://{host}"}))
    await page.write_message(text)
    return page


def test_pages_that_vanish_or_send_nonsense_are_one_line_each(explorer, caplog, monkeypatch, tmp_path):
    caplog.set_level(logging.INFO)
    monkeypatch.setattr(explore_session, "REST", 60.0)
    bad = []

    async def work():
        asyncio.get_running_loop().set_exception_handler(lambda _, context: bad.append(context))
        server, address = explore_server.open_server(explorer, [Beside(explorer), Beside(explorer)], 0, tmp_path)
        host = address.split("/")[2]
        for _ in range(5):
            page = await talk(host, '{"number": 1, "turn": {"mass": 0.02}}')
            page.protocol.stream.close()  # without a word
            page.close()
        for text in BAD.values():
            page = await talk(host, text)
            assert json.loads(await page.read_message())["kind"] == "setup"  # what lies on the bench
            assert await page.read_message() is None  # the connection is closed
            page.close()
        while sum("page" in record.getMessage() for record in caplog.records) < 5 + len(BAD):
            await asyncio.sleep(0.01)
        server.stop()
        await server.close_all_connections()

    run(work)
    gc.collect()  # errors that nobody asked for are told as they are collected
    assert bad == []
    said = [record.getMessage() for record in caplog.records if record.name != "tornado.access"]
    assert sorted(line.partition(":")[0] for line in said) == ["a page has gone"] * 5 + ["a page is refused"] * len(BAD)
    assert all(len(line) < 200 and "\n" not in line for line in said)
    assert not any(record.exc_info for record in caplog.records)


def test_all_pages_show_what_one_puts_on_the_bench(explorer, monkeypatch):
    monkeypatch.setattr(explore_session, "REST", 60.0)
    own, said, pages = explore_numbers.Explorer(explorer.setup), [], set()  # the others stay with the scene

    async def work():
        one, other = (explore_session.Session(own, Beside(own), Beside(own),
                                              lambda told, who=who: said.append((who, told)), pages)
                      for who in "ab")  # fmt: skip
        other.obey({"ear": [0.2, 0.1]})
        await asyncio.sleep(0.01)
        one.obey({"open": {"mallet": "yarn, medium"}})
        await one.tasks["open"]
        one.close(), other.close()
        return other

    other = run(work)
    (who, busy), *shown = [(who, told) for who, told in said if told["kind"] in ("bench", "setup")]
    assert (who, busy) == ("a", {"kind": "bench"}) and {who for who, _ in shown} == {"a", "b"}
    assert all(told["heading"] == "Scene struck by yarn, medium" for _, told in shown)
    assert other.setup.base.striker.mass == 0.03 and other.listener == (0.2, 0.1)
    assert other.settings.at == explorer.setup.start.at and not pages


def test_what_cannot_be_put_on_the_bench_is_said_in_words(explorer, monkeypatch):
    def failed(said):
        return [one["failed"] for one in said if "failed" in one]

    wishes = [{"open": {"thickness": 1e9}}, {"open": {"mallet": "yarm, soft"}}, {"open": [1]}]
    said, session, _ = follow(explorer, monkeypatch, *wishes, until=lambda said: len(failed(said)) == 3, rest=60.0)
    wanted = ("thickness must lie between", "open must be a table", "did you mean 'yarn, soft'")
    assert all(text in told for text, told in zip(wanted, failed(said))) and session.setup is explorer.setup
