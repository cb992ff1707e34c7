"""The process beside the page answers in order, passes errors on, and ends with the page."""

import io
import pickle
from functools import partial

import pytest

from fem_impact._base.check import SimulationError
from fem_impact.pages import explore_worker

DEADLY = partial(eval, "__import__('os')._exit(3)")  # the process knows no functions of this file


def add(held, *values):
    held.extend(values)
    if -1 in values:
        raise SimulationError("minus one")
    return list(held)


def exchanged(*messages):
    """The answers to some messages, by the loop of the process itself."""
    questions, answers = io.BytesIO(b"".join(map(pickle.dumps, messages))), io.BytesIO()
    explore_worker.answer_questions(questions, answers)
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
        with pytest.raises(ValueError, match="has length 1; 2 is required"):
            worker.ask(dict.update, "x").result(60)
    finally:
        worker.stop()
    assert worker.process.poll() is not None
    with pytest.raises(RuntimeError):  # nothing takes its place any more
        worker.ask(dict.get, "a")


def test_a_process_that_is_killed_is_replaced_and_answers():
    worker = explore_worker.Worker({"a": 1})
    try:
        assert (worker.ask(dict.get, "a").result(60), worker.ended) == (1, 0)
        first = worker.process
        first.kill()
        assert (worker.ask(dict.get, "a").result(60), worker.ended) == (1, 1)
        assert first.poll() is not None and worker.process.poll() is None
        with pytest.raises(SimulationError, match="has ended, and so has the one in its place"):
            worker.ask(DEADLY).result(60)
        assert (worker.ask(dict.get, "a").result(60), worker.ended) == (1, 3)
    finally:
        worker.stop()
