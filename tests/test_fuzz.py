"""What comes from outside, mutated: a result or one clear error; the judge and the mutations are in fuzz.py."""

import json
from collections import Counter

import fuzz
import pytest

from fem_impact._base import isolated

STARTED = {"mesh": 4, "outline": 4, "uff": 4}  # [-] inputs in the normal run where each starts a process
MANY, ALL = 1_000, 10_000  # [-] inputs of the slow run, and with --all-cases
DEAR = {"store": 400, "command": 400}  # those of which each takes 50 ms


@pytest.fixture
def hastened(monkeypatch, tmp_path, request):
    """Commands need no more time than other inputs."""
    if request.node.callspec.params["category"] == "command":
        fuzz.hasten(monkeypatch, tmp_path)


def tally(category, inputs):
    """Verdicts of so many inputs and how often; failed ones with the number by which `fuzz.one` makes them again."""
    found = Counter()
    with fuzz.confined() as folder:
        for number in range(inputs):
            verdict = fuzz.one(category, number, folder)
            found[verdict if verdict in ("", fuzz.REFUSED) else f"{number}: {verdict}"] += 1
    return found


@pytest.mark.parametrize("category", [name for name in fuzz.CATEGORIES if name != "command"])
def test_samples_are_read_before_they_are_mutated(category, tmp_path, read_here):
    for name, raw in fuzz.samples(category):
        (tmp_path / name).write_bytes(raw)
        if category != "mesh" or name in ("binary41.msh", "plate.vtu"):  # the others in test_mesh_files
            assert fuzz.judged(fuzz.CATEGORIES[category].read, tmp_path / name) == ""


@pytest.mark.parametrize("category", fuzz.CATEGORIES)
def test_mutated_inputs_give_a_result_or_one_clear_error(category, hastened):
    assert set(tally(category, STARTED.get(category, 60))) <= {"", fuzz.REFUSED}


@pytest.mark.slow
@pytest.mark.thin(6)
@pytest.mark.parametrize("category", fuzz.CATEGORIES)
def test_very_many_mutated_inputs_give_a_result_or_one_clear_error(category, hastened, all_cases, monkeypatch):
    monkeypatch.setattr(isolated, "run_reader", fuzz.quick)
    inputs = ALL if all_cases else DEAR.get(category, MANY)
    found = tally(category, inputs)
    assert set(found) == {"", fuzz.REFUSED}
    # else the mutations are too wild, or do nothing
    assert found[""] > inputs / 100 and found[fuzz.REFUSED] > inputs / 10


def test_the_judge_tells_traces_hangs_litter_and_murmurs_apart(tmp_path, monkeypatch):
    def verdict(act):
        path = tmp_path / "input.txt"
        path.write_text("")
        return fuzz.judged(act, path)

    def endless(path):
        while True:
            pass

    assert verdict(fuzz.fi.mesh.load) == "refused"
    monkeypatch.setattr(fuzz, "PATIENCE", 0.05)
    assert verdict(lambda path: None) == ""
    assert verdict(lambda path: 1 / 0).startswith("ZeroDivisionError")
    assert verdict(lambda path: json.loads("{")).startswith("JSONDecodeError from decoder.py")
    assert verdict(lambda path: fuzz.fi.mesh.rectangle(-1.0, 1.0)).startswith("unclear")  # it does not name the file
    assert verdict(endless).startswith("Hang")
