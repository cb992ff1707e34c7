"""Harsh surroundings: full disks, closed streams, no home, no fonts, no extras give a sentence, never a trace."""

import os
import subprocess
import sys
import venv
from pathlib import Path

import pytest
from scenes import QUICK as SCENE

import fem_impact

ROOT = str(Path(fem_impact.__file__).parents[1])
WITHOUT = """
import importlib.machinery
real = importlib.machinery.PathFinder.find_spec
def find(cls, name, path=None, target=None):
    return None if name.split(".")[0] in {hidden} else real(name, path, target)
importlib.machinery.PathFinder.find_spec = classmethod(find)
"""
HIDDEN = (
    "svgelements",
    "ezdxf",
    "pyuff",
    "h5py",
    "dask",
    "distributed",
    "zarr",
    "plotly",
    "tornado",
    "jinja2",
    "shtab",
)
pytestmark = pytest.mark.skipif(os.name != "posix", reason="shells, limits and devices of POSIX")


def run(folder, command, python=sys.executable, **environment):
    (folder / "scene.toml").write_text(SCENE)
    whole = {**os.environ, "PYTHONPATH": ROOT, "FEM": f"{python} -m fem_impact", **environment}
    whole = {name: value for name, value in whole.items() if value is not None}
    done = subprocess.run(["bash", "-c", command], cwd=folder, env=whole, capture_output=True, text=True, timeout=600)
    assert "Traceback" not in done.stderr and "Error" not in done.stderr, done.stderr
    return done


@pytest.mark.parametrize(
    ("command", "status", "said"),
    [
        ("$FEM modes scene.toml > /dev/full", 1, "fem-impact: No space left on device\n"),
        ("$FEM modes scene.toml >&-", 0, ""),
        ("$FEM modes scene.toml <&-", 0, ""),
        ("$FEM modes none.toml 2>&-", 2, ""),
        ("$FEM modes scene.toml --vtk /dev/null/x.pvd", 1, "fem-impact: /dev/null: File exists\n"),
        ("mkdir gone; cd gone; rmdir ../gone; $FEM strike ../scene.toml", 2, None),
    ],
)
@pytest.mark.slow
def test_streams_and_places_that_fail_are_a_sentence(tmp_path, command, status, said):
    done = run(tmp_path, command)
    assert done.returncode == status or (said is None and done.returncode in (1, 2))
    if said is None:
        assert done.stderr.startswith("fem-impact: ") and done.stderr.count("\n") == 1
    else:
        assert done.stderr == said
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


@pytest.mark.slow
def test_text_that_a_terminal_cannot_show_is_escaped(tmp_path):
    poor = {"LANG": "C", "LC_ALL": "C", "PYTHONIOENCODING": "ascii", "COLUMNS": "20", "TERM": "dumb", "NO_COLOR": "1"}
    (tmp_path / "title.toml").write_text('title = "Plaque frappée ☃"\n' + SCENE, encoding="utf-8")
    done = run(tmp_path, "$FEM modes title.toml", **poor)
    assert (done.returncode, done.stderr) == (0, "")
    assert "frapp\\xe9e" in done.stdout and "\x1b" not in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("limit", [1, 8, 64])  # blocks of 512 or 1024 bytes a file may have
def test_disk_that_is_full_half_way_leaves_nothing(tmp_path, limit):
    done = run(tmp_path, f"ulimit -f {limit}; $FEM strike scene.toml --out out")
    assert done.returncode in (0, 1)
    if done.returncode:
        assert done.stderr == "fem-impact: File too large\n"
        assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "missing",
    [
        {"HOME": None, "XDG_CACHE_HOME": None, "DISPLAY": None},
        {"HOME": "/dev/null", "MPLCONFIGDIR": "/dev/null/fonts", "NUMBA_CACHE_DIR": "/dev/null/cache"},
    ],
)
def test_strike_needs_no_home_no_display_and_no_cache(tmp_path, missing):
    done = run(tmp_path, "$FEM strike scene.toml --tolerance 0.1 --out out", **missing)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "force.png").stat().st_size > 1000


@pytest.mark.slow  # compiles, as nothing can be kept
def test_kernels_compile_where_no_cache_can_be_written(tmp_path):
    script = (
        "from fem_impact.impact.compiled import places; import os; places.find(os.environ, places.Path('/dev/null'))"
    )
    script += "; import fem_impact as fi; print(fi.Contact.linear(1.0)); from fem_impact.impact.compiled import energy"
    done = run(tmp_path, f'{sys.executable} -c "{script}"', HOME="/dev/null", NUMBA_CACHE_DIR="/dev/null/cache")
    assert (done.returncode, done.stderr) == (0, "")


CORE = ["strike scene.toml --out o", "modes scene.toml", "hammer scene.toml --bandwidth 300", "doctor"]
CORE += ["map scene.toml --out m", "plan scene.toml"]


@pytest.fixture(scope="module")
def without(tmp_path_factory):
    """A Python of an environment of its own, in which it and those it starts find no optional library."""
    folder = tmp_path_factory.mktemp("venv")
    venv.create(folder, symlinks=True)
    site = next(folder.glob("lib/python*/site-packages"))
    (site / "all.pth").write_text("\n".join(path for path in sys.path if path.endswith("-packages")))
    (site / "sitecustomize.py").write_text(WITHOUT.format(hidden=HIDDEN))
    return folder / "bin" / "python"


@pytest.mark.slow
@pytest.mark.thin(3)
@pytest.mark.parametrize("words", CORE)
def test_core_commands_work_without_extras(tmp_path, without, words):
    done = run(tmp_path, f"$FEM {words}", without)
    told = [line for line in done.stderr.splitlines() if "Ctrl-C stops it" not in line]  # a slow machine's forecast
    assert (done.returncode, told) == (0, [])
    if words == "doctor":
        assert "pip install 'fem-impact[cad]'" in " ".join(done.stdout.split())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "content", "remedy"),
    [
        ('shape = "outline"\nsource = "a.svg"', b"<svg/>", "this needs svgelements: pip install 'fem-impact[cad]'"),
        ('shape = "file"\npath = "a.med"', b"\x89HDF\r\n\x1a\n", "this needs h5py: pip install 'fem-impact[hdf5]'"),
    ],
)
def test_a_file_that_needs_an_extra_to_be_read_names_it(tmp_path, without, shape, content, remedy):
    text = SCENE.replace('source = "analytic"', "").replace('shape = "rectangle"\nlength = 0.465\nwidth = 0.3', shape)
    (tmp_path / "other.toml").write_text(text)
    (tmp_path / shape.split('"')[3]).write_bytes(content)
    done = run(tmp_path, "$FEM modes other.toml", without)
    assert done.returncode == 2 and remedy in done.stderr and done.stderr.count("\n") == 1
