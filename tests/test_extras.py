"""Without the optional extras every core command works, and one that needs an extra names it."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from test_cli import TEXT

from fem_impact import cli, doctor

ROOT = Path(__file__).parents[1]
MODULES = [module for _, *modules in doctor.EXTRAS.values() for module in modules]
MAP = '[map.over]\n"striker.mass" = [0.02, 0.03]\n'


@pytest.fixture
def bare(monkeypatch):
    """No extra can be imported."""
    for module in [*MODULES, "plotly.offline"]:
        monkeypatch.setitem(sys.modules, module, None)


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "small.toml").write_text(TEXT + MAP)
    return str(tmp_path / "small.toml")


@pytest.mark.slow
def test_package_loads_without_any_extra():
    paths = [path.relative_to(ROOT).with_suffix("") for path in (ROOT / "fem_impact").rglob("*.py")]
    modules = [".".join(path.parts) for path in paths if path.stem not in ("__init__", "__main__", "isolated")]
    block = "".join(f"sys.modules[{module!r}] = None; " for module in [*MODULES, "dask"])
    code = f"import sys; {block} import " + ", ".join(sorted(modules))
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")


@pytest.mark.parametrize(
    "words",
    [
        ["strike", "SCENE", "--out", "OUT"],
        ["modes", "SCENE", "--n-modes", "2"],
        ["plan", "SCENE"],
        ["map", "SCENE", "--out", "OUT"],
        ["hammer", "SCENE", "--bandwidth", "500", "--masses", "0.01"],
    ],
)
def test_core_commands_need_no_extra(bare, scene, tmp_path, words):
    assert cli.main([{"SCENE": scene, "OUT": str(tmp_path / "out")}.get(word, word) for word in words]) == 0


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["report", "SCENE", "--out", "OUT/r.html"], "a report needs jinja2: pip install 'fem-impact[web]'"),
        (["completion"], "completion needs shtab: pip install 'fem-impact[completion]'"),
        (["explore", "SCENE", "--no-open"], "exploring needs tornado: pip install 'fem-impact[web]'"),
        (
            ["map", "SCENE", "--out", "OUT", "--format", "zarr"],
            "format zarr needs zarr: pip install 'fem-impact[cluster]'",
        ),
        (["map", "SCENE", "--out", "OUT", "--store", "OUT/s"], "a store needs zarr: pip install 'fem-impact[cluster]'"),
        (["map", "SCENE", "--out", "OUT", "--cluster", "tcp://127.0.0.1:1"], "pip install 'fem-impact[cluster]'"),
    ],
)
def test_command_that_needs_an_extra_names_it(bare, scene, tmp_path, capsys, words, text):
    words = [scene if word == "SCENE" else word.replace("OUT", str(tmp_path / "out")) for word in words]
    assert cli.main(words) == 2
    captured = capsys.readouterr()
    assert text in captured.err and captured.err.count("\n") == 1 and captured.out == ""
    assert not (tmp_path / "out").exists()


def test_doctor_knows_the_extras_there_are(monkeypatch):
    known = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert set(doctor.EXTRAS) == set(known) - {"all", "test", "peers"}  # peers are for one study
    assert known["all"] == [f"fem-impact[{','.join(sorted(doctor.EXTRAS))}]"]
    monkeypatch.setattr(doctor.importlib.util, "find_spec", lambda name: None)
    finding = doctor._extra("web", "report and explore", ["plotly"])
    assert not finding.works and not finding.vital and finding.remedy == "pip install 'fem-impact[web]' (plotly)"
