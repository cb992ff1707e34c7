"""Texts, tables and seeds."""

import numpy as np
import pytest

from fem_impact.taps import arguments


def test_good_ones_pass():
    assert arguments.texts("names", ("a", "b"), 2, "channel") == ["a", "b"]
    assert arguments.table("known", None) == {}
    assert arguments.generator("rng", 3).random() == np.random.default_rng(3).random()


@pytest.mark.parametrize(
    "call, said",
    [
        (lambda: arguments.texts("names", "ab"), "list of texts"),
        (lambda: arguments.texts("names", ["a"], 2, "tap"), "each tap"),
        (lambda: arguments.table("known", {1: 2}), "dict of names"),
        (lambda: arguments.generator("rng", -1), "seed"),
        (lambda: arguments.generator("rng", None), "rng must be"),
    ],
)
def test_bad_ones_are_named(call, said):
    with pytest.raises(ValueError, match=said):
        call()
