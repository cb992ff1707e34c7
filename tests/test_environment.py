"""Harsh surroundings: full disks, closed streams, no home and no fonts give a sentence, never a trace."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from scenes import QUICK as SCENE

import fem_impact

ROOT = str(Path(fem_impact.__file__).parents[1])
pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name != "posix", reason="shells, limits and devices of POSIX")]


def run(folder, command, **environment):
    (folder / "scene.toml").write_text(SCENE)
    whole = {**os.environ, "PYTHONPATH": ROOT, "FEM": f"{sys.executable} -m fem_impact", **environment}
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
        (
            "$FEM modes scene.toml --vtk /dev/null/x.pvd",
            1,
            "fem-impact: /dev/null: it is a file and no folder; name another\n",
        ),
        ("mkdir gone; cd gone; rmdir ../gone; $FEM strike ../scene.toml", 2, None),
    ],
)
def test_streams_and_places_that_fail_are_a_sentence(tmp_path, command, status, said):
    done = run(tmp_path, command)
    assert done.returncode == status or (said is None and done.returncode in (1, 2))
    if said is None:
        assert done.stderr.startswith("fem-impact: ") and done.stderr.count("\n") == 1
    else:
        assert done.stderr == said
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


def test_text_that_a_terminal_cannot_show_is_escaped(tmp_path):
    poor = {"LANG": "C", "LC_ALL": "C", "PYTHONIOENCODING": "ascii", "COLUMNS": "40", "TERM": "dumb", "NO_COLOR": "1"}
    (tmp_path / "title.toml").write_text('title = "Plaque frappée ☃ 5 µs − 2 · 10⁻³"\n' + SCENE, encoding="utf-8")
    done = run(tmp_path, "$FEM modes title.toml", **poor)
    assert (done.returncode, done.stderr) == (0, "")
    assert "frapp\\xe9e" in done.stdout and "\x1b" not in done.stdout
    assert "5 us - 2 * 10^-3" in " ".join(done.stdout.split())


@pytest.mark.parametrize("limit", [1, 64])  # blocks of 512 or 1024 bytes a file may have
def test_disk_that_is_full_half_way_leaves_nothing(tmp_path, limit):
    done = run(tmp_path, f"ulimit -f {limit}; $FEM strike scene.toml --out out")
    assert done.returncode in (0, 1)
    if done.returncode:
        assert done.stderr == "fem-impact: File too large\n"
        assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


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


def test_kernels_compile_where_no_cache_can_be_written(tmp_path):
    script = (
        "import os; from fem_impact.impact.compiled import places; places.find(os.environ, places.Path('/dev/null'))"
    )
    script += "; import fem_impact as fi; print(fi.Contact.linear(1.0)); from fem_impact.impact.compiled import energy"
    done = run(tmp_path, f'{sys.executable} -c "{script}"', HOME="/dev/null", NUMBA_CACHE_DIR="/dev/null/cache")
    assert (done.returncode, done.stderr) == (0, "")
