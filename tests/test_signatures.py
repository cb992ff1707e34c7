"""Every public function, every argument spoiled: a result or one clear error; the table and judge are signatures.py."""

import inspect
from itertools import groupby
from operator import itemgetter
from zlib import crc32

import pytest
import signatures
from fuzz import confined
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import fem_impact as fi
from fem_impact._base import check

DRAWN = ("pictures.mode_shapes", "pictures.wave", "pictures.animation", "report.write")  # these render for seconds
COMPILED = ("strike", "strike free", "strike stick", "collide", "sweep", "sweep cells")
# Known faults: these end in a bare error of numpy instead of one that names the argument.
OPTIONS = {"deadline": None, "derandomize": True, "suppress_health_check": list(HealthCheck)}


@pytest.fixture(scope="module")
def quick():
    """Cases of quick calls, whose kernels are compiled before the clock of the judge runs."""
    for name in COMPILED:
        signatures.call(name)
    return [case for case in signatures.cases() if case[0] not in DRAWN]


def test_every_public_function_has_a_valid_call():
    public = signatures.public()
    assert {name.partition(" ")[0] for name in signatures.table()} == set(public)
    for name, arguments in signatures.table().items():
        parameters = inspect.signature(public[name.partition(" ")[0]]).parameters
        needed = {key for key, value in parameters.items() if value.default is value.empty and value.kind < 4}
        assert needed - {"self", "changes", "options", "wanted"} <= set(arguments), name


@pytest.mark.parametrize("spoils, examples", [(st.none(), 300), (st.floats(), 100)], ids=["spoil", "any number"])
def test_a_spoiled_argument_gives_a_result_or_one_error_that_names_it(quick, spoils, examples):
    @settings(max_examples=examples, **OPTIONS)
    @given(case=st.sampled_from(quick), number=spoils)
    def check(case, number):
        name, parameter, spoil = case
        with confined():
            value = signatures.SPOILS[spoil] if number is None else number
            assert signatures.judged(name, {parameter: value}) == ""

    check()


@pytest.mark.slow
def test_spoiled_arguments_of_all_functions_give_a_result_or_one_error_that_names_them(quick, all_cases):
    """Each argument in one way, always the same, or in all."""
    ways = None if all_cases else 1
    chosen = [case for _, same in groupby(signatures.cases(), itemgetter(0, 1))
              for case in sorted(same, key=lambda case: crc32(" ".join(case).encode()))[:ways]]  # fmt: skip
    assert {name for name, *_ in chosen} == set(signatures.table())
    failed = {name: wrong for name in signatures.table() if (wrong := signatures.judged(name, {}))}
    with confined():
        for name, parameter, spoil in chosen:
            if wrong := signatures.judged(name, {parameter: signatures.SPOILS[spoil]}):
                failed[f"{name} {parameter}={spoil}"] = wrong
    assert not failed


def test_the_judge_tells_bare_and_unclear_errors_murmurs_and_broken_numbers_apart(monkeypatch):
    def verdict(function):
        monkeypatch.setattr(signatures, "call", lambda name, **changes: function(**changes))
        return signatures.judged("strike", {"speed": 1.0})

    for function, words in (
        (lambda speed: speed * float("nan"), "result holds"),
        (lambda speed: [][1], "IndexError"),
        (lambda speed: float("x"), "bare ValueError"),
        (lambda speed: signatures.warnings.warn("speed", UserWarning, stacklevel=1), "UserWarning"),
        (lambda speed: fi.mesh.line(-1.0), "does not name speed"),
    ):
        assert verdict(function).startswith(words)
    assert verdict(lambda speed: speed) == verdict(lambda speed: check.positive("speed", -speed)) == ""
