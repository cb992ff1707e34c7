"""Ctrl-C and SIGTERM at any moment: exit status, one line, all files or none."""

import os
import random
import shutil
import signal
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from scenes import QUICK

import fem_impact
from fem_impact._base import files

ENDS = {signal.SIGINT: (130, -2), signal.SIGTERM: (143, -15)}  # ours, and Python's own before and after our part
OVER = 'over = { "striker.mass" = { from = 0.01, to = 0.1, count = 8 }, "contact.exponent" = [0.9, 1.0] }'
SCENE = QUICK.replace('over = { "striker.mass" = [0.03, 0.05] }', OVER)
COMMANDS = {  # words, and what is there when they are done
    "strike": (
        "strike scene.toml --out out",
        ["force.csv", "force.png", "modes", "modes.pvd", "response.json", "response.npz"],
    ),
    "modes": ("modes scene.toml --vtk out/m.pvd", ["m", "m.pvd"]),
    "map": ("map scene.toml --out out --store store", ["map.csv", "map.nc"]),
    "hammer": ("hammer scene.toml --bandwidth 300 --masses 0.01 0.03 --out out/h.png", ["h.png"]),
    "report": ("report scene.toml --out out/r.html", ["r.html"]),
    "doctor": ("doctor", []),
}


# Runs a command that sends itself a signal: after some CPU time or some blocks of a store, however busy the machine.
RUNNER = """
import atexit, os, pathlib, runpy, signal, sys, time

kind, moment, number, mark = sys.argv[1], float(sys.argv[2]), int(sys.argv[3]), pathlib.Path(sys.argv[4])


def send(*_):
    mark.write_text("sent")
    os.kill(os.getpid(), number)


if kind == "cpu":
    signal.signal(signal.SIGPROF, send)
    signal.setitimer(signal.ITIMER_PROF, moment)
elif kind == "blocks":
    from fem_impact.sweeps.store import Store

    write, left = Store.write, [int(moment)]

    def counted(*what):
        kept = write(*what)
        left[0] -= 1
        if left[0] == 0:
            send()
        return kept

    Store.write = counted
else:
    atexit.register(lambda: mark.write_text(str(time.process_time())))
sys.argv[1:] = sys.argv[5:]
runpy.run_module("fem_impact", run_name="__main__", alter_sys=True)
"""


def run(folder, words, kind="whole", moment=0.0, number=0):
    """Exit status, what was said, and the mark: CPU time [s] of a whole run, "sent" if the signal was, or nothing."""
    mark = folder.with_name(f"{folder.name}.mark")
    mark.unlink(missing_ok=True)
    environment = {**os.environ, "PYTHONPATH": str(Path(fem_impact.__file__).parents[1]), "TMPDIR": str(folder)}
    command = [sys.executable, "-c", RUNNER, kind, str(moment), str(int(number)), str(mark), *words.split()]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    return done.returncode, done.stderr, mark.read_text() if mark.exists() else ""


def prepared(folder, name):
    folder.mkdir()
    (folder / "scene.toml").write_text(SCENE)
    if name == "hammer":  # writes into a folder that there is; the others make it
        (folder / "out").mkdir()
    return folder


def stop(parent, name, number, share):
    """Send a signal after a share of the command's CPU time; whether that ended it, all files being there or none."""
    words, expected = COMMANDS[name]
    moment = share * cpu_time(parent, name)
    sent, folder = "", None
    while not sent:  # where this run takes less CPU time than the whole one took: earlier
        folder = prepared(parent / f"{name}-{len(list(parent.iterdir()))}", name)
        status, said, sent = run(folder, words, "cpu", moment, number)
        moment *= 0.7
    out = folder / "out"
    there = sorted(path.name for path in out.iterdir()) if out.exists() else []
    assert status in (0, *ENDS[number]), (share, said)
    assert not list(folder.rglob(f"{files.PARTIAL}*")), share
    if status == 0 or there:  # the files were on their way
        assert set(expected) <= set(there), (share, there)
        return False
    assert "fem_impact" not in said, (share, said)  # no trace of ours; Python's own start may leave one of its own
    if status == ENDS[number][0] and said:
        assert said.startswith("fem-impact: ") and said.count("\n") == 1
    left = {path.name for path in folder.iterdir()} - {"scene.toml", "store", "out"}
    assert not {name for name in left if not name.startswith(("tmp", "pymp", "matplotlib"))}, left
    return True


@cache
def cpu_time(parent, name):
    """CPU time [s] of a command that nobody interrupts; the first run may compile and find fonts, the second not."""
    folder = prepared(parent / f"{name}-whole", name)
    taken = []
    for _ in range(2):
        shutil.rmtree(folder / "store", ignore_errors=True)
        status, said, mark = run(folder, COMMANDS[name][0])
        assert status == 0, said
        taken.append(float(mark))
    return min(taken)


@pytest.mark.slow
@pytest.mark.thin(6)
@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_at_any_moment(tmp_path, name, all_cases):
    chance, n = random.Random(name), 10 if all_cases else 3
    shares = [0.05 + 0.95 * (i + chance.random()) / n for i in range(n)]  # before, Python still starts
    ended = [stop(tmp_path, name, chance.choice(list(ENDS)), share) for share in shares]
    assert all(ended[: n // 2 + 1])  # later, a signal may come too late to stop the files


@pytest.mark.slow  # compiles where that was not done before
def test_stored_cells_are_kept_and_used(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "scene.toml").write_text(SCENE)
    words = COMMANDS["map"][0]
    status, said, sent = run(tmp_path / "in", words, "blocks", 5, signal.SIGINT)
    assert (status, sent) == (130, "sent")
    assert said == "fem-impact: interrupted; finished cells are in store; run the same command again to continue\n"
    blocks = (path for path in (tmp_path / "in" / "store" / "numbers" / "c").rglob("*") if path.is_file())
    kept = {path: path.stat().st_mtime_ns for path in blocks}
    assert len(kept) == 5  # none lost
    status, said, _ = run(tmp_path / "in", words)
    assert status == 0, said
    assert {path: path.stat().st_mtime_ns for path in kept} == kept  # and none computed again
    assert (tmp_path / "in" / "out" / "map.nc").is_file()


def test_undoing_takes_back_the_newest_first_and_nothing_that_is_appearing(tmp_path, monkeypatch):
    seen = []
    with files.undoable(lambda: seen.append("first")), files.undoable(lambda: seen.append("second")):
        assert files.undo_all() and seen == ["second", "first"]
        monkeypatch.setattr(files, "FINISHING", [tmp_path])
        assert not files.undo_all() and len(seen) == 2
    assert not files.UNDONE
    with files.staged_folder(tmp_path / "new" / "deep") as staging:
        (staging / "half.txt").write_text("half")
        monkeypatch.setattr(files, "FINISHING", [])
        assert files.undo_all() and not (tmp_path / "new").exists()
        staging.mkdir(parents=True)  # so that the block may end as if nothing had been
