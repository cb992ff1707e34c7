"""What a watched folder says of each record: written by a simulated rig with the faults that it must tell."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact import hammer_commands
from fem_impact.sweeps import hammers
from fem_impact.taps import watch

RATE, BANDWIDTH = 51200.0, 2000.0  # [Hz]
HEAVY = fi.Modes.rigid(1e3)
PLATE = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=200)


def tip(reach, mass=0.1):
    """Stiffness [N/m] of the tip whose half sine on a wall is 10 dB down there."""
    return mass * (2.0 * np.pi * reach / hammers.half_sine_reach(10.0)) ** 2


def tap(stiffness, body=HEAVY, at=None, mass=0.1, before=2e-3, **rig):
    hit = fi.strike(body, fi.Striker.rigid(mass), fi.Contact.linear(stiffness), at=at, speed=1.0)
    return fi.measure(hit, rate=RATE, noise=1e-3, rng=1, before=before, **rig)


def judged(taps):
    return watch.advice("a.npz", taps, 0, BANDWIDTH)


@pytest.mark.parametrize("reach", [500.0, 1500.0, 6000.0])
def test_the_reach_of_a_pulse_is_that_of_its_half_sine(reach):
    """To 2 %: the noise of the record moves where its spectrum falls."""
    assert_allclose(judged(tap(tip(reach))).reach, reach, rtol=0.02)


def cut(first, last, **rig):
    whole = tap(tip(3000.0), **rig)
    return whole.between(first, whole.time[whole.force[0].argmax()] if last is None else last)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: tap(tip(2500.0)), r"good: .*reaches 2\.5"),
        (lambda: tap(1e5, PLATE, (0.465, 0.3)), "double hit, repeat$"),
        (lambda: tap(tip(3000.0), full_scale=20.0, bits=16), "overload of force, repeat softer"),
        (lambda: cut(5e-3, 20e-3, before=5e-3), "trigger too late, only 1 samples"),  # from the moment of touch on
        (lambda: cut(0.0, None, before=5e-3), "the record ends within the pulse: record longer$"),
    ],
    ids=["good", "double hit", "overload", "late", "short"],
)
def test_every_fault_of_a_record_is_told(make, said):
    found = judged(make())
    assert re.match(said, found.said) and found.good == said.startswith("good")


def test_a_soft_tip_is_told_and_one_as_stiff_as_advised_is_good():
    found = judged(tap(tip(1000.0)))
    assert not found.good and found.said.startswith("too soft for 2 kHz: take the next tip")
    factor = float(found.said.rsplit("must be ", 1)[1].split()[0])
    assert_allclose(factor, 4.0, rtol=0.05)  # twice the bandwidth; two digits, of a reach to 2 %
    assert judged(tap(1.1 * factor * tip(1000.0))).good


def test_a_bandwidth_that_the_rate_cannot_show_is_refused():
    taps, said = tap(tip(3000.0)), r"half the rate of a\.npz, 25600 Hz, got 30000 Hz; sample faster, or ask for less"
    with pytest.raises(ValueError, match=f"below {said}"):
        watch.advice("a.npz", taps, 0, 30e3)
    assert "too soft" in watch.advice("a.npz", taps, 0, 20e3).said  # asked for less


def test_files_are_handed_out_once_nobody_writes_to_them_and_again_when_they_change(tmp_path):
    folder = watch.Folder(tmp_path)
    file = tmp_path / "a.csv"
    file.write_text("t,Force [N]\n")
    assert folder.look() == [] and folder.waiting
    file.write_text("t,Force [N]\n0,1\n")  # still being written
    assert folder.look() == [] and folder.waiting
    assert folder.look() == [file] and not folder.waiting
    assert folder.look() == []
    file.write_text("t,Force [N]\n0,1\n1,2\n")
    (tmp_path / "picture.png").write_bytes(b"no record")
    (tmp_path / "empty.csv").touch()  # its writer has only begun
    assert folder.look() == [] and folder.look() == [file] and folder.look() == []
    with pytest.raises(ValueError, match="FOLDER must be a folder that receives records, got"):
        watch.Folder(tmp_path / "none")


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
