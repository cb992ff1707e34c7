"""Ctrl-C and SIGTERM at any moment: exit status, one line, all files or none."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from scenes import QUICK

import fem_impact
from fem_impact._base import files

ENDS = {signal.SIGINT: (130, -2), signal.SIGTERM: (143, -15)}  # ours, and Python's own before and after our part
OVER = 'over = { "striker.mass" = { from = 0.01, to = 0.1, count = 8 }, "contact.exponent" = [0.9, 1.0] }'
SCENE = QUICK.replace('over = { "striker.mass" = [0.03, 0.05] }', OVER)
COMMANDS = {  # words, and what is there when they are done
    "strike": ("strike scene.toml --out out", ["force.csv", "force.png", "modes", "modes.pvd", "response.json"]),
    "modes": ("modes scene.toml --vtk out/m.pvd", ["m", "m.pvd"]),
    "map": ("map scene.toml --out out --store store", ["map.csv", "map.nc"]),
    "hammer": ("hammer scene.toml --bandwidth 300 --out out/h.png", ["h.png"]),
    "report": ("report scene.toml --out out/r.html", ["r.html"]),
    "doctor": ("doctor", []),
    "plan": ("plan scene.toml", []),
}


def interrupted(folder, words, number, delay):
    environment = {**os.environ, "PYTHONPATH": str(Path(fem_impact.__file__).parents[1]), "TMPDIR": str(folder)}
    command = [sys.executable, "-m", "fem_impact", *words.split()]
    with subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        time.sleep(delay)
        run.send_signal(number)
        _, said = run.communicate(timeout=60)
    return run.returncode, said


@pytest.mark.parametrize("delay", [0.6, 1.2])
@pytest.mark.parametrize("number", ENDS)
def test_strike_is_all_or_nothing(tmp_path, number, delay):
    check(tmp_path, "strike", number, delay)


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_at_any_moment(tmp_path, name):
    chance = random.Random(name)
    for i in range(6):
        (tmp_path / str(i)).mkdir()
        check(tmp_path / str(i), name, chance.choice(list(ENDS)), chance.uniform(0.05, 4.0))


def check(folder, name, number, delay):
    (folder / "scene.toml").write_text(SCENE)
    words, expected = COMMANDS[name]
    status, said = interrupted(folder, words, number, delay)
    out = folder / "out"
    there = sorted(path.name for path in out.iterdir()) if out.exists() else []
    assert status in (0, *ENDS[number]), (delay, said)
    assert not list(folder.rglob(f"{files.PARTIAL}*")), delay
    if status == 0 or there:  # it was done before the signal came
        assert set(expected) <= set(there), (delay, there)
        return
    assert "fem_impact" not in said, (delay, said)  # no trace of ours; Python's own start may leave one of its own
    if status == ENDS[number][0] and said:
        assert said.startswith("fem-impact: ") and said.count("\n") == 1
    left = {path.name for path in folder.iterdir()} - {"scene.toml", "store", "out"}
    assert not {name for name in left if not name.startswith(("tmp", "pymp", "matplotlib"))}, left


@pytest.mark.slow  # compiles where that was not done before
def test_stored_cells_are_kept_and_used(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    words = COMMANDS["map"][0]
    for delay in (1.5, 3.0):
        status, said = interrupted(tmp_path, words, signal.SIGINT, delay)
        if status == 130 and said:
            assert (
                said == "fem-impact: interrupted; finished cells are in store; run the same command again to continue\n"
            )
    environment = {**os.environ, "PYTHONPATH": str(Path(fem_impact.__file__).parents[1])}
    run = subprocess.run([sys.executable, "-m", "fem_impact", *words.split()], cwd=tmp_path, env=environment)
    assert run.returncode == 0 and (tmp_path / "out" / "map.nc").is_file()


def test_undoing_takes_back_the_newest_first_and_nothing_that_is_appearing(tmp_path, monkeypatch):
    seen = []
    with files.undoable(lambda: seen.append("first")), files.undoable(lambda: seen.append("second")):
        assert files.undo_all() and seen == ["second", "first"]
        monkeypatch.setattr(files, "FINISHING", [tmp_path])
        assert not files.undo_all() and len(seen) == 2
    assert not files.UNDONE
    with files.staged(tmp_path / "new" / "deep") as staging:
        (staging / "half.txt").write_text("half")
        monkeypatch.setattr(files, "FINISHING", [])
        assert files.undo_all() and not (tmp_path / "new").exists()
        staging.mkdir(parents=True)  # so that the block may end as if nothing had been
