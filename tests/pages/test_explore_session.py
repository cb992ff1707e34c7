"""An open page is answered at once, judged when its hand rests, and never sent what it no longer asks for."""

import asyncio
import json
from concurrent.futures import Future, ThreadPoolExecutor

import pytest
from test_cli import TEXT

import fem_impact as fi
from fem_impact.pages import explore_map, explore_model, explore_numbers, explore_session
from fem_impact.scenes.sentences import si


@pytest.fixture(scope="module")
def explorer(tmp_path_factory):
    path = tmp_path_factory.mktemp("session") / "small.toml"
    path.write_text(TEXT)
    return explore_numbers.Explorer(explore_model.Setup.of(fi.load_scene(path)))


class Beside:
    """A worker that computes in this process, at once, and notes what it was asked."""

    def __init__(self, explorer):
        self.explorer, self.asked = explorer, []

    def ask(self, function, *arguments):
        self.asked.append((function.__name__, arguments))
        answer = Future()
        answer.set_result(function(self.explorer, *arguments))
        return answer


def run(function, *arguments):
    """Run a coroutine; in a thread of its own, because Playwright keeps a loop running in this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(lambda: asyncio.run(function(*arguments))).result()


def follow(explorer, monkeypatch, *messages, until=lambda said: True, rest=0.0):
    """What a page is sent after some messages."""
    monkeypatch.setattr(explore_session, "REST", rest)
    monkeypatch.setattr(explore_map, "FINEST", 49)
    said, workers = [], (Beside(explorer), Beside(explorer))

    async def work():
        session = explore_session.Session(
            explorer, *workers, lambda message: said.append(json.loads(json.dumps(message)))
        )
        for message in messages:
            session.take(message)
        for _ in range(200):
            if until(said):
                break
            await asyncio.sleep(0.01)
        session.close()
        return session

    session = run(work)
    assert until(said)
    return said, session, workers


def test_force_and_numbers_come_first_then_the_rest_then_the_verdict(explorer, monkeypatch):
    def done(said):
        return any(one.get("exact") for one in said) and any(one.get("columns") == 49 for one in said)

    said, _, _ = follow(explorer, monkeypatch, {"number": 1, "turn": {"mass": 0.02}}, until=done)
    assert [one["kind"] for one in said[:2]] == ["blow", "rest"]
    first, exact = said[0], next(one for one in said if one.get("exact"))
    assert first["mass"] == 0.02 and first["said"]["mass"] == si(0.02, "kg", 3)
    assert "verdict" not in first and exact["verdict"]
    columns = [one["columns"] for one in said if one.get("columns")]
    assert columns[:2] == [25, 49]  # coarse first, then finer
    assert [one["exact"] for one in said if one.get("columns")][:3] == [False, False, False]


def test_a_hand_that_does_not_rest_is_neither_judged_nor_mapped(explorer, monkeypatch):
    moves = [{"number": i, "turn": {"speed": 1.0 + 0.01 * i}} for i in range(1, 6)]
    said, session, workers = follow(explorer, monkeypatch, *moves, rest=60.0)
    assert [one["number"] for one in said if one["kind"] == "blow"] == [1, 2, 3, 4, 5]
    assert workers[0].asked == workers[1].asked == []
    assert session.settings.speed == pytest.approx(1.05)


def test_window_maps_at_once_and_the_way_back_is_the_whole(explorer, monkeypatch):
    def mapped(said):
        return any(one.get("columns") for one in said)

    window = {"mass": [0.02, 0.04], "stiffness": [1.0, 10.0]}
    said, session, _ = follow(explorer, monkeypatch, {"view": window}, until=mapped, rest=60.0)
    found = next(one for one in said if one.get("columns"))
    assert (found["mass"], found["stiffness"]) == (pytest.approx([0.02, 0.04]), pytest.approx([1.0, 10.0]))
    run(_back, session)
    assert session.window.mass == explorer.setup.range("mass")


def test_way_back_is_drawn_even_if_the_map_in_between_was_not_finished(explorer, monkeypatch):
    monkeypatch.setattr(explore_map, "FINEST", 49)
    said = []

    async def work():
        session = explore_session.Session(explorer, Beside(explorer), Beside(explorer), said.append)
        session.take({"view": None})
        while not any(one.get("columns") == 49 for one in said):
            await asyncio.sleep(0.001)
        await asyncio.sleep(0.01)  # the whole map is done
        session.take({"view": {"mass": [0.02, 0.04], "stiffness": [1.0, 10.0]}})
        while said[-1].get("mass", [0.0])[0] != pytest.approx(0.02):
            await asyncio.sleep(0.0)
        session.take({"view": None})  # before its finer form is there
        before = len(said)
        while len(said) == before or not said[-1].get("columns"):
            await asyncio.sleep(0.001)
        session.close()

    run(work)
    assert said[-1]["mass"] == pytest.approx(explorer.setup.range("mass"))


async def _back(session):
    session.take({"view": None})
    session.close()


def test_listener_moves_without_another_blow(explorer, monkeypatch):
    moves = [{"number": 1, "turn": {}}, {"number": 2, "ear": [0.2, 0.1]}, {"number": 3, "turn": {"height": 1.0}}]
    said, session, _ = follow(explorer, monkeypatch, *moves, rest=60.0)
    assert session.heard_at == (0.2, 0.1) and session.height == 1.0
    assert ["force" in one for one in said if one["kind"] == "blow"] == [True, False, False]
    assert said[-2]["said"]["height"] == f"{si(1.0, 'm', 3)}, in the air"


@pytest.mark.parametrize(
    "message",
    [
        [], 3, {"turn": []}, {"turn": {"nothing": 1.0}}, {"turn": {"mass": "1"}}, {"turn": {"mass": float("nan")}},
        {"turn": {"mass": True}}, {"ear": [1.0]}, {"ear": "ab"}, {"view": {"mass": [1.0, 2.0]}}, {"view": 3},
    ],
)  # fmt: skip
def test_nonsense_is_refused(explorer, monkeypatch, message):
    with pytest.raises(ValueError, match="must be"):
        follow(explorer, monkeypatch, message)


def test_values_beyond_a_slider_become_its_end(explorer, monkeypatch):
    _, session, _ = follow(explorer, monkeypatch, {"number": 1, "turn": {"mass": 1e9, "x": -5.0}}, rest=60.0)
    assert session.settings.mass == explorer.setup.range("mass")[1] and session.settings.at[0] == 0.0
