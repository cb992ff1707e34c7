"""No process of ours runs a module that lies in the working folder or in PYTHONPATH."""

import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import meshio
import numpy as np
import pytest

import fem_impact as fi
from fem_impact import answers, arguments, cli
from fem_impact._base import child
from fem_impact.pages import explore_worker
from fem_impact.show import pictures
from fem_impact.show.painter import Painter

HOME = Path(fi.__file__).parent
LIBRARIES = (
    "numpy scipy skfem meshio pyvista vtk vtkmodules matplotlib PIL rich numba llvmlite xarray pandas shapely netgen "
    "threadpoolctl yaml plotly tornado jinja2 cuda sitecustomize usercustomize fem_impact"
)


@pytest.fixture(scope="module")
def planted(tmp_path_factory):
    """Two folders of modules that leave a mark when they run, and the file of these marks."""
    folder = tmp_path_factory.mktemp("planted")
    early = {"abc", "codecs", "encodings", "io"}  # loaded before a file can be opened
    names = {name for name in sys.stdlib_module_names if not name.startswith("_")} - early | set(LIBRARIES.split())
    for place in ("here", "there"):
        (folder / place / "fem_impact").mkdir(parents=True)
        for name in names:
            code = f"open({str(folder / 'ran')!r}, 'a').write('{place}/{name} ')\n"
            (folder / place / f"{name}.py").write_text(code)
        (folder / place / "fem_impact" / "__init__.py").write_text(code)
    (folder / "here" / ".numba_config.yaml").write_text("cache_dir: planted\n")
    return folder


@pytest.fixture
def ran(planted, monkeypatch):
    """A function that tells which planted modules were run; they lie wherever a process might look for some."""
    marks = planted / "ran"
    marks.unlink(missing_ok=True)
    monkeypatch.chdir(planted / "here")
    monkeypatch.syspath_prepend(str(planted / "here"))  # as after python -m
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", ".", str(planted / "there")]))
    return lambda: marks.read_text() if marks.exists() else ""


def read_a_mesh(monkeypatch):
    meshio.Mesh(np.eye(3) * [1, 1, 0], [("triangle", np.array([[0, 1, 2]]))]).write("plate.vtu")
    assert len(fi.mesh.load("plate.vtu").cells) == 1


def ask_beside_the_page(monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)
    worker = explore_worker.Worker("import_module('fem_impact.impact.compiled.build').config.CACHE_DIR")
    try:
        assert worker.ask(eval, {"import_module": import_module}).result(120) == ""  # no code compiled by others
    finally:
        worker.stop()


def run_again_compiled(monkeypatch):
    began = []
    monkeypatch.setattr(cli, "_prepare", lambda *_, **__: True)
    failing = arguments.COMMANDS["modes"]._replace(run=lambda _: (_ for _ in ()).throw(fi.SimulationError("none")))
    monkeypatch.setitem(arguments.COMMANDS, "modes", failing)
    monkeypatch.setattr(os, "execve", lambda *them: began.append(them))
    assert cli.main(["modes", "none.toml"]) == answers.Status.FAILED
    ((program, words, environment),) = began
    assert program == words[0] == sys.executable
    done = subprocess.run(words, env=environment, capture_output=True, text=True)
    assert done.returncode == answers.Status.BAD_INPUT and "none.toml" in done.stderr


def draw(monkeypatch):
    with Painter() as painter:
        painter.process.stdin.close()
        painter.process.wait()


def probe_for_rendering(monkeypatch):
    pictures.can_render.__wrapped__()


SLOW = [pytest.param(road, marks=pytest.mark.slow) for road in (probe_for_rendering, draw)]


@pytest.mark.parametrize("road", [read_a_mesh, ask_beside_the_page, run_again_compiled, *SLOW])
def test_nothing_planted_runs(ran, road, monkeypatch):
    road(monkeypatch)
    assert ran() == ""


def test_every_process_of_python_is_started_in_one_place():
    other = re.compile(r"sys\.executable|import multiprocessing|from multiprocessing|ProcessPool|os\.fork|runpy")
    for path in HOME.rglob("*.py"):
        text = path.read_text()
        if path.name != "child.py":
            assert not other.search(text), path
            assert not re.search(r"subprocess\.(run|call|check)", text), path
            assert "subprocess.Popen(" not in text or "child.python(" in text, path


def test_what_this_process_found_by_pythonpath_is_found(tmp_path, monkeypatch):
    path = os.pathsep.join([str(HOME.parent), str(child.LIBRARIES)])
    monkeypatch.setenv("PYTHONPATH", path)
    code = "from fem_impact._base import child; import sys, os; os.execve(sys.executable, *child.python(*sys.argv[1:]))"
    words = [getattr(sys, "_base_executable", sys.executable), "-c", code, "_base.isolated:process", "60", "none"]
    done = subprocess.run([*words, "no:no"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1 and done.stderr == "this needs fem_impact: pip install fem_impact"
