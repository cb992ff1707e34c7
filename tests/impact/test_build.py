"""Compiled kernels on disk are compiled anew after an edit in another file; a plan compiles nothing."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import fem_impact
from fem_impact.impact.compiled import build, law

compiled_only = pytest.mark.skipif(not build.COMPILED, reason="nothing is compiled anyway")


def printed(script, environment, *options, folder=None):
    """What a script says in a process of its own."""
    command = [sys.executable, *options, "-c", script]
    return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=True).stdout


SCRIPT = """
import numpy as np
from fem_impact.impact.compiled.law import table
from fem_impact.impact.compiled.record import nearest_turn

steps = np.zeros((2, 9))
steps[:, 1] = 1.0  # two steps of a second: down and up again, then up and down again
steps[:, 3:5] = [[1.0, -3.0], [1.0, 5.0]]
print(nearest_turn(steps, np.array([[1.0], [0.0], [0.0], [0.0], [-5.0]]), table([[1.0, 1.0]]), -np.inf, 0.0)[0])
"""

PLAN = """
import fem_impact as fi
from fem_impact.impact.compiled import energy, law, record

plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), plate, supports={"boundary": "hinged"})
stick, touch = fi.Striker.stick(mass=0.1, first_frequency=10e3), fi.Contact.hertz(695e3)
plan = fi.plan(system, stick, touch, at=(0.1395, 0.09), speed=2.0, tolerance=1e-3, damping_ratio=0.005)
print(plan)
for kernel in (energy.follow, record.find_impacts, law.stored_energies):
    assert not kernel.overloads
"""


@compiled_only
def test_a_plan_compiles_nothing(tmp_path):
    """It strikes, to foresee the length of the blow and what may be wrong with the model, as plain Python."""
    said = printed(PLAN, {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)})
    assert "predicted for a typical machine" in said and not list(tmp_path.rglob("*.nb?"))


@compiled_only
def test_what_is_not_compiled_runs_as_plain_python_and_says_the_same():
    table, approach = law.table([[1e6, 1.5, 0.1]]), np.array([1e-3], np.float32)  # a type nothing is compiled for
    known = len(law.stored_energies.overloads)
    with build.uncompiled():
        found = law.stored_energies(approach, table)
    assert found == pytest.approx(law.stored_energies(approach.astype(float), table), rel=1e-6)
    assert len(law.stored_energies.overloads) <= known + 1


TWICE = """
import logging, sys
import numpy as np
logging.basicConfig(level=logging.INFO, format="%(name)s: %(message)s", stream=sys.stdout)
from fem_impact.impact.compiled import build, law, places

print(law.dents(law.table([[1.0, 1.0]])), sum(law.dents.stats.cache_hits.values()), build.folder(law.dents))
"""


def dents(package, **environment):
    """Dents as a new process finds them with the package in a folder: how many kernels it read, and from where."""
    whole = {name: value for name, value in os.environ.items() if name not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    said = printed(TWICE, {**whole, "PYTHONPATH": str(package), **environment}, folder=package)
    value, hits, place = said.split()
    assert value == "[0.]"
    return int(hits), Path(place)


@pytest.fixture
def installed(tmp_path):
    """A copy of the package beside whose kernels nothing can be written, even by root."""
    source = Path(fem_impact.__file__).parent
    shutil.copytree(source, tmp_path / "site" / "fem_impact", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "site" / "fem_impact" / "impact" / "compiled" / "__pycache__").write_text("read-only")
    return tmp_path / "site"


@compiled_only
def test_users_of_one_installation_that_is_read_only_have_kernels_of_their_own(installed, tmp_path):
    """Spoilt and forbidden files are compiled anew; without any place they are kept for the process."""
    one, two = {"HOME": str(tmp_path / "one")}, {"NUMBA_CACHE_DIR": str(tmp_path / "two")}
    (first, place), (second, again) = dents(installed, **one), dents(installed, **one)
    assert (first, second) == (0, 1) and place == again and place.is_relative_to(tmp_path / "one")
    hits, place = dents(installed, **two)
    assert hits == 0 and place.is_relative_to(tmp_path / "two")
    for name in ("nbi", "nbc"):
        for file in place.glob(f"law.dents*.{name}"):
            file.write_bytes(file.read_bytes()[:40])
        assert dents(installed, **two)[0] == 0
    assert dents(installed, **two)[0] == 1
    (index,) = place.glob("law.dents*.nbi")
    index.unlink()
    index.mkdir()  # as forbidden as that of another user
    assert dents(installed, **two)[0] == 0
    hits, place = dents(installed, HOME="/dev/null")
    assert hits == 0 and not place.exists()


@compiled_only
def test_compiling_that_takes_long_is_announced_once(caplog):
    compiled = []

    def square(x):
        return x * x

    kernel = build.outer(seconds=5.0)(square)
    kernel._cache = type("None", (), {"load_overload": lambda *_: None, "save_overload": lambda *_: None})()
    with caplog.at_level("INFO", logger="fem_impact"):
        compiled += [kernel(2.0), kernel(3.0)]
    assert compiled == [4.0, 9.0]
    assert caplog.messages == ["compiling the inner loops of this kind of blow, once: about 5 s of computing"]


BLOW = """
import fem_impact as fi
from fem_impact.impact.compiled import energy

plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=50.0, n_modes=150, damping_ratio=0.005)
hit = fi.strike(plate, fi.Striker.rigid(0.1), fi.Contact.hertz(1e6), at=(0.45, 0.3), speed=1.0, tolerance=1e-3)
print(hit.history.steps.tobytes().hex(), sum(energy.follow.stats.cache_hits.values()))
"""


@pytest.mark.slow
@compiled_only
def test_the_process_that_compiles_finds_the_digits_of_every_later_one(tmp_path):
    """It did not while parts of a kernel became machine code of their own, too."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    (first, none), (later, one) = (printed(BLOW, environment, "-W", "ignore").split() for _ in range(2))
    assert (none, one) == ("0", "1") and first == later


@pytest.mark.slow
def test_an_edit_in_another_file_is_noticed(tmp_path):
    shutil.copytree(Path(fem_impact.__file__).parent, tmp_path / "fem_impact", ignore=shutil.ignore_patterns("*.nb?"))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def answer():
        return float(printed(SCRIPT, environment, folder=tmp_path))

    before = answer()
    kept = set((tmp_path / "cache").rglob("*.nbc"))
    assert kept and answer() == before
    callee = tmp_path / "fem_impact" / "impact" / "compiled" / "cubics.py"
    callee.write_text(callee.read_text().replace("return t, cubic(", "return t, 2.0 + cubic("))
    assert abs(answer() - before) > 0.1 * before
