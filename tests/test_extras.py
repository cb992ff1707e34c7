"""Without the optional extras every core command works, and one that needs an extra names it; the doctor knows all."""

import re
import subprocess
import sys
import tomllib
from types import SimpleNamespace

import pytest
from scenes import ROOT, TITLED

from fem_impact import doctor
from fem_impact.show import pictures

MODULES = [module for _, *modules in doctor.EXTRAS.values() for module in modules]
MAP = '[map.over]\n"striker.mass" = [0.02, 0.03]\n'


@pytest.fixture
def bare(monkeypatch):
    """No extra can be imported."""
    for module in [*MODULES, "plotly.offline"]:
        monkeypatch.setitem(sys.modules, module, None)


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "small.toml").write_text(TITLED + MAP)


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


@pytest.mark.parametrize(
    ("shape", "content", "remedy"),
    [
        ('shape = "outline"\nsource = "a.svg"', b"<svg/>", "this needs svgelements: pip install 'fem-impact[cad]'"),
        ('shape = "file"\npath = "a.med"', b"\x89HDF\r\n\x1a\n", "this needs h5py: pip install 'fem-impact[hdf5]'"),
    ],
)
def test_a_file_that_needs_an_extra_to_be_read_names_it(bare, read_here, tmp_path, prompt, shape, content, remedy):
    text = TITLED.replace('source = "analytic"', "").replace('shape = "rectangle"\nlength = 0.465\nwidth = 0.3', shape)
    (tmp_path / "other.toml").write_text(text)
    (tmp_path / shape.split('"')[3]).write_bytes(content)
    said = prompt("modes other.toml")
    assert said.status == 2 and remedy in said.err and said.err.count("\n") == 1


def test_doctor_knows_the_extras_there_are(monkeypatch):
    known = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert set(doctor.EXTRAS) == set(known) - {"all", "test", "peers", "site"}  # peers are for one study
    assert known["all"] == [f"fem-impact[{','.join(sorted(doctor.EXTRAS))}]"]
    guide = (ROOT / "studies" / "guide.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| `(\w+)` \|", guide, re.MULTILINE) == sorted([*doctor.EXTRAS, "site"])
    monkeypatch.setattr(doctor.importlib.util, "find_spec", lambda name: None)
    finding = doctor._extra("web", "report and explore", ["plotly"])
    assert not finding.works and not finding.vital and finding.remedy == "pip install 'fem-impact[web]' (plotly)"


def test_this_installation_is_sound(monkeypatch):
    monkeypatch.setattr(pictures, "can_render", lambda: True)  # takes long, and may fail on a sound installation
    findings = doctor.examine()
    assert [finding.name for finding in findings if not finding.works] == []
    assert all(finding.remedy == "" for finding in findings)


def test_an_extra_that_is_missing_comes_with_its_command(bare, monkeypatch, prompt):
    monkeypatch.setattr(pictures, "can_render", lambda: False)
    assert "pip install 'fem-impact[cad]'" in " ".join(prompt("doctor").out.split())


def test_what_fails_comes_with_its_remedy_and_reason_and_missing_rendering_is_no_failure(monkeypatch, prompt):
    def fail():
        raise OSError("no font")

    monkeypatch.setattr(pictures, "can_render", lambda: False)
    said = prompt("doctor")
    assert said.status == 0 and "3-D rendering          missing" in said.out
    monkeypatch.setattr(doctor, "_picture", fail)
    said = prompt("doctor")
    assert said.status == 1 and "reinstall matplotlib (OSError: no font)" in " ".join(said.out.split())
    assert said.err == "fem-impact: pictures: not working; see above\n"


def test_wrong_numbers_are_a_failure(monkeypatch):
    monkeypatch.setattr(doctor, "find_modes", lambda *_, **__: SimpleNamespace(omega=[20.0]))
    assert doctor._tried("x", doctor._finite_elements, "do").remedy == "do"
