"""The first blow after an installation is plain Python and as good, while one other process compiles."""

import os
import subprocess
import sys
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scenes import SHIPPED

import fem_impact as fi
from fem_impact.impact import collision, engine
from fem_impact.impact.compiled import build, places
from fem_impact.model import audit, fresh

pytestmark = pytest.mark.skipif(not build.COMPILED, reason="nothing is compiled anyway")


def half_sine():
    """A blow on a wall by a linear contact, of which everything is known."""
    return fi.strike(fi.Modes.rigid(1e6), fi.Striker.rigid(0.01), fi.Contact.linear(1e6), at=None, speed=1.0)


class Compiler:
    """What stands for the compiler: a process that sleeps, and how often one was begun."""

    def __init__(self, mark):
        self.mark, self.begun = mark, 0

    def python(self, *_, **variables):
        assert variables[fresh.SWITCH] == "0" and self.mark.exists()
        self.begun += 1
        return [sys.executable, "-c", "import time; time.sleep(60)"], dict(os.environ)

    def stop(self, name="follow"):
        """Kill it, and wait until its mark is gone."""
        process = fresh._begin_compiling(self.mark, ("energy", name, ()))
        process.kill()
        until = time.monotonic() + 60.0
        while self.mark.exists() and time.monotonic() < until:
            time.sleep(0.01)
        assert process.returncode is not None and not self.mark.exists()  # no zombie, no mark


@pytest.fixture
def compiler(monkeypatch, tmp_path):
    """As after an installation, for what asks `lacking`."""
    one = Compiler(tmp_path / "kernels" / fresh.MARK)
    monkeypatch.delenv(fresh.SWITCH, raising=False)
    monkeypatch.setattr(build, "folder", lambda _: one.mark.parent)
    monkeypatch.setattr(fresh, "child", one)
    fresh._begin_compiling.cache_clear()
    yield one
    if one.begun:
        one.stop()
    fresh._begin_compiling.cache_clear()


def lacking(name="follow"):
    """Do as a kernel that is not on disk; whether it runs as plain Python."""
    if build.QUICK.get() == build.REFUSED:
        raise build.Uncompiled("energy", name, ())
    return build.is_limited()


def limited(name="follow", **outcome):
    """What `fresh.answer` returns of a function that tells whether it runs as plain Python."""
    said = {"tolerance_met": True, **outcome}
    return fresh.answer(lambda: SimpleNamespace(plain=lacking(name), **said), False).plain


def test_the_first_blow_is_plain_and_meets_its_tolerance(compiler, monkeypatch):
    plain: list[bool] = []
    run_energy = engine.run_energy
    monkeypatch.setattr(engine, "run_energy", lambda *them: plain.append(lacking()) or run_energy(*them))
    known, n_runs = half_sine(), len(plain)
    assert all(plain) and n_runs and compiler.begun == 1
    compiler.stop()
    compiled = half_sine()
    assert not any(plain[n_runs:])
    for name in ("restitution", "impulse", "contact_time", "peak_force"):
        told = known.error.total + compiled.error.total  # each may err by its own estimate
        assert getattr(known, name) == pytest.approx(getattr(compiled, name), rel=told)


def test_one_process_compiles_however_many_blows_wait(compiler):
    assert [limited() for _ in range(3)] == [True] * 3
    assert compiler.begun == 1
    compiler.stop()
    assert not limited() and compiler.begun == 1  # one that failed is not begun again
    assert limited("another") and compiler.begun == 2
    compiler.stop("another")


def test_a_process_of_others_that_compiles_is_enough(compiler):
    compiler.mark.parent.mkdir()
    compiler.mark.touch()
    assert limited() and compiler.begun == 0
    long_ago = time.time() - 2.0 * fresh.PATIENCE
    os.utime(compiler.mark, (long_ago, long_ago))  # it was killed
    assert limited() and compiler.begun == 1


def test_what_is_compiled_already_is_used(compiler):
    assert not fresh.answer(lambda: SimpleNamespace(plain=build.is_limited()), False).plain and compiler.begun == 0


def test_whether_the_model_holds_is_examined_as_plain_python_too(compiler, monkeypatch):
    """It strikes again with other bodies: the first verdict waits for no compiler either."""
    steel = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), thickness=5e-3)
    plate = fi.analytic.rectangle(0.3, 0.2, section=steel, n_modes=20, damping_ratio=0.01)
    hit = fi.strike(plate, fi.Striker.rigid(0.05), fi.Contact.hertz(1e7), at=(0.1, 0.08), speed=0.2, tolerance=1e-2)
    compiled = audit.examine(hit)
    most, follow = [], engine.run_system

    def seen(*given):
        lacking()
        most.append(build.QUICK.get())
        return follow(*given)

    monkeypatch.setattr(engine, "run_system", seen)
    plain = audit.examine(hit)
    assert compiler.begun == 1 and most and set(most) == {np.inf}  # not cut short: that would look like not known
    for one, other in zip(compiled, plain, strict=True):
        assert one.name == other.name and one.effect == pytest.approx(other.effect, rel=1e-6, abs=1e-12)


def test_what_takes_many_steps_or_misses_the_tolerance_is_compiled(compiler):
    assert not limited(tolerance_met=False)

    def endless():
        if lacking():
            raise fi.SimulationError("no final separation")
        return "compiled"

    assert fresh.answer(endless, False) == "compiled"


def test_blows_of_many_runs_are_compiled(compiler, monkeypatch):
    """None of the runs is long by itself."""
    plain: list[bool] = []
    run_energy = engine.run_energy
    monkeypatch.setattr(engine, "run_energy", lambda *them: plain.append(lacking()) or run_energy(*them))
    monkeypatch.setattr(fresh, "TOGETHER", 1e-6)
    half_sine()
    assert plain[0] and len(plain) > 2 and not any(plain[1:])


def test_a_run_that_gives_up_takes_its_whole_share():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=30)
    blow = {"at": (0.45, 0.3), "speed": 1.0}
    with build.uncompiled(50, 1.0), pytest.raises(build.Uncompiled):
        collision.strike(plate, fi.Striker.rigid(1e9), fi.Contact.hertz(695e3), **blow)
    assert build.ALLOWED.get() == np.inf


def test_only_plans_that_take_long_are_compiled_at_once(monkeypatch):
    stretches: list[bool] = []
    monkeypatch.setattr(fresh, "answer", lambda compute, stretched: stretches.append(stretched) or compute())
    plan = fi.plan(SHIPPED / "heavy_plate.toml")
    for seconds in (plan.seconds, 1e3):
        replace(plan, seconds=seconds).strike()
    assert stretches == [False]


@pytest.mark.parametrize("value", ["0", "1"])
def test_the_switch_of_numba_decides(compiler, monkeypatch, value):
    monkeypatch.setenv(fresh.SWITCH, value)
    assert not limited() and compiler.begun == 0


def test_nothing_is_begun_where_nothing_can_be_kept(compiler, monkeypatch, tmp_path):
    compiler.mark.parent.write_text("a file where a folder should be")
    assert not limited()
    environment: dict[str, str] = {"XDG_CACHE_HOME": str(compiler.mark.parent)}
    places.find(environment, compiler.mark.parent)
    assert not places.is_lasting(environment)
    monkeypatch.setenv(places.GIVEN, environment[places.GIVEN])
    monkeypatch.setattr(build, "folder", lambda _: tmp_path)
    assert not limited() and compiler.begun == 0


def test_runs_of_a_first_blow_give_up_early():
    with build.uncompiled(7):
        assert build.is_limited() and build.most_steps(100) == 7 and build.most_steps(3) == 3
    assert not build.is_limited() and build.most_steps(100) == 100


KINDS = {"plain": "", "stretching": ", stretching=True"}


@pytest.mark.slow
def test_after_the_first_blow_of_a_kind_it_is_on_disk(tmp_path, all_cases):
    """The process goes on when the one that began it has ended; the next process only reads."""
    code = (
        "import fem_impact as fi; from fem_impact.impact.compiled import energy\n"
        "section = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 1e-3)\n"
        "plate = fi.analytic.rectangle(0.2, 0.3, section=section, n_modes=20)\n"
        "how = dict(at=(0.09, 0.13), speed=1.0, tolerance=1e-2)\n"
        "hit = fi.strike(plate, fi.Striker.rigid(0.02), fi.Contact.hertz(1e6), **how{})\n"
        "print(sum(energy.follow.stats.cache_hits.values()))"
    )
    environment = {name: value for name, value in os.environ.items() if name != fresh.SWITCH}
    environment["NUMBA_CACHE_DIR"] = str(tmp_path)

    def strike(kind):
        run = [sys.executable, "-W", "error", "-c", code.format(KINDS[kind])]
        return subprocess.run(run, env=environment, capture_output=True, text=True, check=True).stdout

    for kind in [*KINDS][: None if all_cases else 1]:
        assert strike(kind) == "0\n"  # as plain Python
        until = time.monotonic() + 400.0
        while list(tmp_path.rglob(fresh.MARK)) and time.monotonic() < until:
            time.sleep(0.2)
        assert strike(kind) == "1\n"  # read from disk
    while not list(tmp_path.rglob("many_blows.run*.nbc")) and time.monotonic() < until:
        time.sleep(0.2)
    assert list(tmp_path.rglob("many_blows.run*.nbc"))  # what maps need comes next
