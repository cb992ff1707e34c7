"""Every public function, every argument spoiled: a result or one clear error; the table and judge are signatures.py."""

import inspect
import json
import subprocess
import sys
from pathlib import Path

import pytest
import signatures
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import fem_impact as fi
from fem_impact._base import check

for extra in ("pyuff", "jinja2", "plotly"):  # the table writes a universal file and a report
    pytest.importorskip(extra)
DRAWN = ("pictures.mode_shapes", "pictures.wave", "pictures.animation", "report.write", "atlas.hammers_for")
QUICK = [case for case in signatures.cases() if case[0] not in DRAWN]  # those render or search for seconds


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """Kernels are compiled before the clock of the judge runs: that may take half a minute."""
    for name in ("strike", "strike free", "strike stick", "collide", "sweep", "sweep cells"):
        signatures.call(name)


def test_every_public_function_has_a_valid_call():
    public = signatures.public()
    assert {name.partition(" ")[0] for name in signatures.table()} == set(public)
    for name, arguments in signatures.table().items():
        parameters = inspect.signature(public[name.partition(" ")[0]]).parameters
        needed = {key for key, value in parameters.items() if value.default is value.empty and value.kind < 4}
        assert needed - {"self", "changes", "options", "wanted"} <= set(arguments), name


@settings(max_examples=300, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(case=st.sampled_from(QUICK))
def test_a_spoiled_argument_gives_a_result_or_one_error_that_names_it(case):
    name, parameter, spoil = case
    with signatures.confined():
        assert signatures.judged(name, {parameter: signatures.SPOILS[spoil]}) == ""


@settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(number=st.floats(), case=st.sampled_from(QUICK))
def test_any_number_gives_a_result_or_one_error_that_names_the_argument(number, case):
    with signatures.confined():
        assert signatures.judged(case[0], {case[1]: number}) == ""


@pytest.mark.slow
def test_spoiled_arguments_of_all_functions_give_a_result_or_one_error_that_names_them(all_cases):
    every = 1 if all_cases else 10
    command = [sys.executable, str(Path(signatures.__file__)), f"--every={every}"]
    done = subprocess.run(command, capture_output=True, text=True)
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["failed"] == []
    assert found["functions"] == len(signatures.table()) and found["calls"] > 9_000 / every


def test_the_judge_tells_bare_and_unclear_errors_murmurs_and_broken_numbers_apart(monkeypatch):
    def verdict(function):
        monkeypatch.setattr(signatures, "call", lambda name, **changes: function(**changes))
        return signatures.judged("strike", {"speed": 1.0})

    def murmur(speed):
        signatures.warnings.warn("speed", UserWarning, stacklevel=1)

    assert verdict(lambda speed: speed) == ""
    assert verdict(lambda speed: speed * float("nan")).startswith("result holds")
    assert verdict(lambda speed: [][1]).startswith("IndexError")
    assert verdict(lambda speed: float("x")).startswith("bare ValueError")
    assert verdict(murmur).startswith("UserWarning")
    assert verdict(lambda speed: fi.mesh.line(-1.0)).startswith("does not name speed")
    assert verdict(lambda speed: check.positive("speed", -speed)) == ""
