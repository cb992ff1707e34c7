"""Results are found again, the oldest are dropped, and a pickled store is empty."""

import pickle
from functools import partial

import numpy as np
import pytest

from fem_impact._base.remembered import Remembered, gauss_rule


def test_a_gauss_rule_is_exact_for_polynomials_and_found_once():
    x, dx = gauss_rule(5)
    for power in range(10):
        assert dx @ x**power == pytest.approx(1.0 / (power + 1.0), rel=1e-14)  # rounding of five numbers
    assert gauss_rule(5)[0] is x
    with pytest.raises(ValueError, match="read-only"):
        np.copyto(x, 0.0)


def test_known_results_are_not_computed_again_and_the_oldest_are_dropped():
    store, asked = Remembered(2), []

    def double(x):
        asked.append(x)
        return 2.0 * x

    for x in (1.0, 2.0, 1.0, 3.0, 2.0, 1.0):
        assert store.recall(x, partial(double, x)) == 2.0 * x
    assert asked == [1.0, 2.0, 3.0, 1.0]
    assert len(store.results) == 2


def test_a_pickled_store_is_empty_and_as_large():
    store = Remembered(3)
    store.recall(b"", lambda: 0.0)
    copy = pickle.loads(pickle.dumps(store))
    assert (copy.most, copy.results) == (3, {})
