"""Compiled kernels on disk are compiled anew after an edit in another file that they call into."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import fem_impact

SCRIPT = """
import numpy as np
from fem_impact.impact.compiled.record import nearest_turn

steps = np.zeros((2, 11))
steps[:, 1] = 1.0  # two steps of a second: down and up again, then up and down again
steps[:, 3:5] = [[1.0, -3.0], [1.0, 5.0]]
print(nearest_turn(steps, np.array([[1.0], [0.0], [0.0], [0.0], [-5.0]]), np.array([[1.0, 1.0, 0.0, 0.0]]), 5, -np.inf))
"""


@pytest.mark.slow
def test_an_edit_in_another_file_is_noticed(tmp_path):
    shutil.copytree(Path(fem_impact.__file__).parent, tmp_path / "fem_impact", ignore=shutil.ignore_patterns("*.nb?"))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def answer():
        done = subprocess.run(
            [sys.executable, "-c", SCRIPT], env=environment, cwd=tmp_path, capture_output=True, text=True, check=True
        )
        return float(done.stdout)

    before = answer()
    kept = set((tmp_path / "cache").rglob("*.nbc"))
    assert kept and answer() == before
    callee = tmp_path / "fem_impact" / "impact" / "compiled" / "events.py"
    text = callee.read_text()
    line = next(line for line in text.split("def lowest")[1].splitlines() if line.startswith("    return "))
    callee.write_text(text.replace(line, f"{line.replace('return ', 'return 2.0 + (')})", 1))
    assert abs(answer() - before) > 0.1 * before
