"""`fem-impact watch` as it is typed: a folder with good and bad records, read once, and followed until Ctrl-C."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import fem_impact as fi
from fem_impact import hammer_commands


@pytest.fixture
def folder(tmp_path):
    body = fi.Modes.from_arrays([0.0, 700.0], [[1.0, 1.0]], points=[[0.0]], mass=1.0, damping_ratio=0.02)
    home = tmp_path / "records"
    home.mkdir()
    for name, stiffness in (("good", 1e7), ("soft", 1e4)):
        hit = fi.strike(body, fi.Striker.rigid(0.02), fi.Contact.linear(stiffness), at=[0.0], speed=1.0, max_impacts=1)
        fi.measure(hit, rate=25600.0, at=[[0.0]], duration=0.2, noise=1e-3, rng=0).save(home / f"{name}.npz")
    (home / "torn.csv").write_text("t,Force [N]\n0,not a number\n")
    return home


@pytest.mark.slow
def test_once_tells_every_record_and_what_cannot_be_read_and_draws(folder, tmp_path, prompt):
    found = prompt("watch records --bandwidth 2000 --once --out seen.svg --json --quiet").json
    told = {each["file"]: each for each in found["records"]}
    assert told["good.npz"]["good"] and found["n_good"] == 1
    assert told["soft.npz"]["said"].startswith("too soft for 2 kHz")
    assert told["torn.csv"]["said"].startswith("cannot be judged: ") and not told["torn.csv"]["good"]
    assert found["files"] == ["seen.svg"] and (tmp_path / "seen.svg").stat().st_size > 1e4


@pytest.mark.slow
def test_a_new_record_gets_a_line_of_its_own_until_the_program_is_stopped(folder, tmp_path, prompt, monkeypatch):
    later = (folder / "good.npz").read_bytes()
    (folder / "good.npz").unlink()
    steps = [None, None, lambda: (folder / "good.npz").write_bytes(later[:500]),
             lambda: (folder / "good.npz").write_bytes(later), None, None]  # fmt: skip

    def sleep(_):
        if not steps:
            raise KeyboardInterrupt
        step = steps.pop(0)
        if step is not None:
            step()

    monkeypatch.setattr(hammer_commands, "time", SimpleNamespace(sleep=sleep))
    said = prompt("watch records --bandwidth 2000 --out seen.png").out
    lines = [line for line in said.splitlines() if line.startswith(("good", "soft", "torn"))]
    assert [line.split()[0] for line in lines] == ["soft.npz,", "torn.csv:", "good.npz,"]
    assert "good: " in lines[2] and (tmp_path / "seen.png").stat().st_size > 1e4


def test_a_folder_without_records_says_so(prompt):
    assert prompt("watch . --bandwidth 2000 --once") == (0, "no records yet\n", "")


@pytest.mark.slow  # starts a process
def test_ctrl_c_ends_a_watch_cleanly_with_its_last_word(folder, tmp_path):
    """A real signal to a real process, once it has judged what is there."""
    words = ["watch", str(folder), "--bandwidth", "2000", "--out", str(tmp_path / "seen.png")]
    watch = subprocess.Popen(
        [sys.executable, "-m", "fem_impact", *words], cwd=tmp_path, text=True, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(Path(fi.__file__).parents[1])},
    )  # fmt: skip
    try:
        told = [watch.stdout.readline() for _ in range(4)]  # three records, and the picture
        watch.send_signal(signal.SIGINT)
        _, said = watch.communicate(timeout=300)
    finally:
        watch.kill()
    assert watch.returncode == 0 and sum(line.startswith(("good", "soft", "torn")) for line in told) == 3
    assert said.splitlines()[-1] == "fem-impact: stopped; 1 of 3 taps in 3 files were good"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["records", "seen.png"]
