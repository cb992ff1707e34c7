"""What comes from outside, mutated: a result or one clear error; the judge and the mutations are in fuzz.py."""

import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import fuzz
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

FUZZ = Path(fuzz.__file__)
INPUTS, ALL = 1_500, 10_000  # of each category; with --all-cases
DEAR = {"store": 600, "command": 600}  # those of which each takes 50 ms
HERE = [name for name in fuzz.CATEGORIES if name != "command"]  # that one changes its process; see test_cli
FEW = {"mesh": 4, "outline": 4, "uff": 4}  # [-] examples in the normal run where each starts a process
MANY = 60  # [-] of the others


def skip_without_extras():
    pytest.importorskip("svgelements", reason="the cad extra is not installed")
    pytest.importorskip("ezdxf", reason="the cad extra is not installed")
    pytest.importorskip("pyuff", reason="the uff extra is not installed")


@cache
def samples(category):
    skip_without_extras()
    assert category in HERE  # the other one would change every test after it
    return fuzz.CATEGORIES[category].samples()


@pytest.mark.parametrize("category", HERE)
def test_samples_are_read_before_they_are_mutated(category, tmp_path, read_here):
    for name, raw in samples(category):
        (tmp_path / name).write_bytes(raw)
        if category != "mesh" or name in ("binary41.msh", "plate.vtu"):  # the others in test_mesh_files
            assert fuzz.judged(fuzz.CATEGORIES[category].read, tmp_path / name) == ""


@pytest.mark.parametrize("category", HERE)
def test_mutated_inputs_give_a_result_or_one_clear_error(category, tmp_path):
    known = samples(category)
    raws = [raw for _, raw in known]

    @settings(max_examples=FEW.get(category, MANY), deadline=None, suppress_health_check=list(HealthCheck))
    @given(sample=st.sampled_from(known), random=st.randoms(use_true_random=False))
    def check(sample, random):
        name, raw = sample
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}-{name}"
        path.write_bytes(fuzz.mutated(raw, random, raws))
        assert fuzz.judged(fuzz.CATEGORIES[category].read, path) in ("", "refused")

    check()


@pytest.mark.slow
@pytest.mark.thin(6)
@pytest.mark.parametrize("category", fuzz.CATEGORIES)
def test_very_many_mutated_inputs_give_a_result_or_one_clear_error(category, all_cases):
    skip_without_extras()
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "OMP_NUM_THREADS": "1"}
    inputs = ALL if all_cases else DEAR.get(category, INPUTS)
    command = [sys.executable, str(FUZZ), category, "--inputs", str(inputs)]
    run = subprocess.run(command, capture_output=True, text=True, env=environment)
    found = json.loads(run.stdout.splitlines()[-1])
    assert found["failed"] == []
    assert found["results"] + found["refused"] == inputs
    # else the mutations are too wild, or do nothing
    assert found["results"] > inputs / 100 and found["refused"] > inputs / 10


def test_the_judge_tells_traces_hangs_litter_and_murmurs_apart(tmp_path, monkeypatch):
    def verdict(act):
        path = tmp_path / "input.txt"
        path.write_text("")
        return fuzz.judged(act, path)

    def foreign(path):
        json.loads("{")

    def vague(path):
        fuzz.fi.mesh.rectangle(-1.0, 1.0)  # one of ours, but it does not name the file

    def endless(path):
        while True:
            pass

    assert verdict(fuzz.fi.mesh.load) == "refused"
    monkeypatch.setattr(fuzz, "PATIENCE", 0.05)
    assert verdict(lambda path: None) == ""
    assert verdict(lambda path: 1 / 0).startswith("ZeroDivisionError")
    assert verdict(foreign).startswith("JSONDecodeError from decoder.py")
    assert verdict(vague).startswith("unclear")
    assert verdict(endless).startswith("Hang")
