"""The process beside the page answers in order, passes errors on, and ends with the page."""

import io
import pickle

import pytest

from fem_impact._base.check import SimulationError
from fem_impact.pages import explore_worker


def add(held, *values):
    held.extend(values)
    if -1 in values:
        raise SimulationError("minus one")
    return list(held)


def exchanged(*messages):
    """The answers to some messages, by the loop of the process itself."""
    questions, answers = io.BytesIO(b"".join(map(pickle.dumps, messages))), io.BytesIO()
    explore_worker.follow(questions, answers)
    answers.seek(0)
    found = []
    while answers.tell() < len(answers.getvalue()):
        found.append(pickle.load(answers))
    return found


def test_each_question_is_answered_about_the_same_object():
    first, second, third = exchanged([1], (add, (2,)), (add, (-1,)), (add, ()))
    assert first == ([1, 2], None) and third == ([1, 2, -1], None)
    assert second[0] is None and isinstance(second[1], SimulationError) and str(second[1]) == "minus one"


def test_a_process_of_its_own_computes_and_ends():
    worker = explore_worker.Worker({"a": 1})
    try:
        assert worker.ask(dict.get, "a").result(60) == 1
        with pytest.raises(ValueError, match="could not convert"):
            worker.ask(_number, "x").result(60)
        worker.process.kill()
        worker.process.wait()
        with pytest.raises(SimulationError, match="beside the page has ended"):
            worker.ask(dict.get, "a").result(60)
    finally:
        worker.stop()
    assert worker.process.poll() is not None


def _number(held, text):
    return float(text)
