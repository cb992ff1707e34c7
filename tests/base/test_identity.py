"""Functions that do the same are the same wherever they stand; what differs in what it does is told apart."""

import functools
import math
import sys
import threading
from dataclasses import dataclass

import numpy as np
import pytest

from fem_impact._base import identity

FACTOR = 2.0


def scaled(hit):
    return FACTOR * hit


def compiled(text, **known):
    """A function from its source, as another script would have it."""
    exec(compile(text, "elsewhere.py", "exec"), known)
    return known["f"]


def closed(value):
    return lambda hit: value * hit


@dataclass
class Gain:
    factor: float

    def __call__(self, hit):
        return self.factor * hit

    @functools.cached_property
    def seen(self):
        return [self.factor]


SAME = {
    "the same text in another place": (lambda: compiled("f = lambda h: h + 1"), lambda: compiled("\n\nf=lambda h:h+1")),
    "equal closures": (lambda: closed(1.5), lambda: closed(1.5)),
    "equal arrays": (lambda: closed(np.arange(3.0)), lambda: closed(np.arange(3.0))),
    "an object that has computed a property": (lambda: Gain(1.0), lambda: (gain := Gain(1.0)).seen and gain),
    "sets": (lambda: {"a", "b", "c"}, lambda: {"c", "b", "a"}),
    "a local name": (
        lambda: compiled("def f(h):\n a = h\n return a"), lambda: compiled("def f(h):\n b = h\n return b"),
    ),
}  # fmt: skip
APART = {
    "constants": (lambda: lambda hit: 1.0, lambda: lambda hit: 2.0),
    "signs of zero": (lambda: lambda hit: 0.0, lambda: lambda hit: -0.0),
    "an integer and a float": (lambda: lambda hit: 1, lambda: lambda hit: 1.0),
    "operations": (lambda: lambda hit: hit + 1, lambda: lambda hit: hit - 1),
    "names": (lambda: lambda hit: hit.force, lambda: lambda hit: hit.time),
    "closures": (lambda: closed(1.0), lambda: closed(2.0)),
    "arrays": (lambda: closed(np.arange(3.0)), lambda: closed(np.arange(4.0))),
    "kinds of arrays": (lambda: closed(np.zeros(2)), lambda: closed(np.zeros(2, np.int64))),
    "functions in closures": (lambda: closed(closed(1.0)), lambda: closed(closed(2.0))),
    "globals": (
        lambda: compiled("f = lambda h: g(h)", g=closed(1.0)), lambda: compiled("f = lambda h: g(h)", g=closed(2.0)),
    ),
    "defaults": (lambda: lambda hit, a=1: a, lambda: lambda hit, a=2: a),
    "named defaults": (lambda: lambda hit, *, a=1: a, lambda: lambda hit, *, a=2: a),
    "functions inside": (lambda: lambda hit: (lambda: 1)(), lambda: lambda hit: (lambda: 2)()),
    "partial": (lambda: functools.partial(pow, 2), lambda: functools.partial(pow, 3)),
    "states of objects": (lambda: Gain(1.0), lambda: Gain(2.0)),
    "methods": (lambda: Gain(1.0).__call__, lambda: Gain(2.0).__call__),
    "what a cache holds": (lambda: functools.cache(closed(1.0)), lambda: functools.cache(closed(2.0))),
    "classes": (lambda: type("A", (), {"f": closed(1.0)}), lambda: type("A", (), {"f": closed(2.0)})),
    "functions of Python": (lambda: math.sin, lambda: math.cos),
    "functions of a library": (lambda: np.sin, lambda: np.cos),
}  # fmt: skip


@pytest.mark.parametrize("name", SAME)
def test_what_does_the_same_is_the_same(name):
    one, two = SAME[name]
    assert identity.identify(one()) == identity.identify(two())


@pytest.mark.parametrize("name", APART)
def test_what_does_something_else_is_told_apart(name):
    one, two = APART[name]
    assert identity.identify(one()) == identity.identify(one()) != identity.identify(two())


def test_globals_count_as_they_are_now(monkeypatch):
    before = identity.identify(scaled)
    monkeypatch.setitem(globals(), "FACTOR", 3.0)
    assert identity.identify(scaled) != before


def test_a_module_of_ones_own_is_its_file_and_what_it_imports(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)

    def seen(text):
        (tmp_path / "mine_too.py").write_text(text)
        (tmp_path / "mine.py").write_text("import mine_too\n")
        for name in ("mine", "mine_too"):
            sys.modules.pop(name, None)
            (tmp_path / "__pycache__" / f"{name}.cpython-{sys.version_info[0]}{sys.version_info[1]}.pyc").unlink(True)
        return identity.identify(compiled("def f(h):\n import mine\n return mine.x"))

    first = seen("x = 1.0")
    assert first != seen("x = 2.5") and first == seen("x = 1.0")


def test_what_cannot_be_told_apart_is_named():
    with pytest.raises(ValueError, match=r"^it uses an object of type _thread.lock$"):
        identity.identify(closed(threading.Lock()))
    deep = []
    for _ in range(sys.getrecursionlimit()):
        deep = [deep]
    with pytest.raises(ValueError, match="nested too deeply"):
        identity.identify(deep)


def test_a_function_that_calls_itself_has_an_end():
    one, two = (compiled(f"def f(h):\n return f(h - {i}) if h > 0 else 0") for i in (1, 2))
    assert identity.identify(one) != identity.identify(two)


def test_the_program_is_the_same_in_every_call():
    assert identity.program() == identity.program() and len(identity.program()) == 64
