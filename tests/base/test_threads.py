"""Linear algebra on one thread, and on as many as before afterwards."""

import numpy as np
import pytest
from scipy.sparse import csc_matrix
from threadpoolctl import threadpool_info, threadpool_limits

from fem_impact._base import threads
from fem_impact.fe import eigenvalues
from fem_impact.modes import picked
from fem_impact.taps import solver


@pytest.fixture
def two_threads():
    """How many threads linear algebra takes, of two that it may."""
    threads._libraries.cache_clear()  # libraries that other tests have loaded since, NGSolve's among them, count, too

    def counted():
        return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}

    with threadpool_limits(2, user_api="blas"):
        yield counted


def test_a_function_that_fails_leaves_the_others_to_the_rest(two_threads):
    before = two_threads()

    @threads.one_thread
    def fails():
        assert two_threads() == {1}
        raise RuntimeError("here")

    with pytest.raises(RuntimeError, match="here"):
        fails()
    assert two_threads() == before


def test_searches_among_many_measured_values_take_one_thread(two_threads, monkeypatch):
    """With two they took three times as long for fits and ten for modes of responses, beside other work."""
    taken = []

    def residual(x):
        taken.append(two_threads())
        return x - np.arange(3.0)

    box = np.full(3, -5.0), np.full(3, 5.0)
    solver.least(residual, lambda x: np.eye(3), np.zeros(3), box, close=1e-9, iterations=9)
    monkeypatch.setattr(picked, "responses", lambda *_: taken.append(two_threads()) or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        picked.pick("frf", None)
    assert len(taken) > 2 and taken == [{1}] * len(taken)


def test_factors_are_found_and_used_on_one_thread_and_leave_the_others_to_the_rest(two_threads, monkeypatch):
    """Two threads took seven times the processor time for the 1 800 loads of a curved sheet."""
    taken, usual = [], two_threads()

    class Watched:
        def __init__(self, *matrix, **options):
            taken.append(two_threads())

        def solve(self, loads):
            taken.append(two_threads())
            return loads

    monkeypatch.setattr(eigenvalues, "splu", Watched)
    eigenvalues.factorise(csc_matrix(np.eye(3))).solve(np.ones((3, 1)))
    assert taken == [{1}, {1}] and two_threads() == usual
