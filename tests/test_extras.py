"""Without the optional extras every core command works, and one that needs an extra names it."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from test_cli import TEXT

from fem_impact import doctor

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


@pytest.mark.slow
def test_package_loads_without_any_extra():
    paths = [path.relative_to(ROOT).with_suffix("") for path in (ROOT / "fem_impact").rglob("*.py")]
    later = ("__init__", "__main__", "isolated", "explore_server")  # the last is loaded where a page is served
    modules = [".".join(path.parts) for path in paths if path.stem not in later]
    block = "".join(f"sys.modules[{module!r}] = None; " for module in [*MODULES, "dask"])
    code = f"import sys; {block} import " + ", ".join(sorted(modules))
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")


@pytest.mark.parametrize("words", [
    "strike small.toml --out out", "modes small.toml --n-modes 2", "plan small.toml", "map small.toml --out out",
    "hammer small.toml --bandwidth 500 --masses 0.01",
])  # fmt: skip
def test_core_commands_need_no_extra(bare, scene, prompt, words):
    assert prompt(words).status == 0


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("report small.toml --out out/r.html", "a report needs jinja2: pip install 'fem-impact[web]'"),
        ("completion", "completion needs shtab: pip install 'fem-impact[completion]'"),
        ("explore small.toml --no-open", "exploring needs tornado: pip install 'fem-impact[web]'"),
        ("map small.toml --out out --format zarr", "format zarr needs zarr: pip install 'fem-impact[cluster]'"),
        ("map small.toml --out out --store out/s", "a store needs zarr: pip install 'fem-impact[cluster]'"),
        ("map small.toml --out out --cluster tcp://x:1", "client needs distributed: pip install 'fem-impact[cluster]'"),
    ],
)
def test_command_that_needs_an_extra_names_it(bare, scene, tmp_path, prompt, words, text):
    said = prompt(words)
    assert (said.status, said.out, said.err.count("\n")) == (2, "", 1) and text in said.err
    assert [path.name for path in tmp_path.iterdir()] == ["small.toml"]


def test_doctor_knows_the_extras_there_are(monkeypatch):
    known = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert set(doctor.EXTRAS) == set(known) - {"all", "test", "peers", "site"}  # peers are for one study
    assert known["all"] == [f"fem-impact[{','.join(sorted(doctor.EXTRAS))}]"]
    monkeypatch.setattr(doctor.importlib.util, "find_spec", lambda name: None)
    finding = doctor._extra("web", "report and explore", ["plotly"])
    assert not finding.works and not finding.vital and finding.remedy == "pip install 'fem-impact[web]' (plotly)"
