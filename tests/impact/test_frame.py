"""The frame of the runs: records that grow, and kernels short enough to read."""

import ast
from pathlib import Path

import numpy as np
import pytest
from warming import locked

from fem_impact.impact import compiled
from fem_impact.impact.compiled import frame
from fem_impact.impact.compiled.bundles import KernelSystem, Limits
from fem_impact.impact.compiled.energy import run_energy
from fem_impact.impact.compiled.law import table
from fem_impact.impact.compiled.stretched import Stretch

LINES, PARAMETERS = 100, 8  # of a kernel: what fits on two pages, and what a reader keeps in mind


@pytest.mark.parametrize(
    "scheme, stretch",
    [(0, None), (1, None), (1, Stretch(*locked(np.array([[[4e3]]]), np.zeros((0, 1))), 1))],
)
def test_a_record_that_grows_is_the_same(scheme, stretch, monkeypatch):
    """A run that stops at each full record and goes on, against one whose record has room for all: bit for bit."""
    scene = KernelSystem(
        *locked(
            np.array([0.0, 3e3, 9e3]), np.array([0.0, 0.01, 0.02]), np.array([[1.0, -1.3, 0.8]]), np.zeros(1),
            np.zeros(3), table([[1e5, 1.5]]), np.zeros(3), np.array([1.0, 0.0, 0.0]),
        )
    )  # fmt: skip
    limits = Limits(0.0, 0.0, 1e-2, 0, 2000)

    def run():
        return run_energy(scene, stretch, scheme, 1e-4, limits)

    whole = run()
    monkeypatch.setattr(frame, "FIRST_ROWS", 2)
    for one, other in zip(whole, run()):
        np.testing.assert_array_equal(one, other)
    assert len(whole[0]) > 2 * 4  # it grew at least twice


def kernels():
    """Name, lines and parameters of every function of the package."""
    for file in sorted(Path(compiled.__file__).parent.glob("*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef):
                size = node.end_lineno - node.lineno + 1
                yield f"{file.stem}.{node.name}", size, len(node.args.args) + len(node.args.kwonlyargs)


def test_kernels_are_short():
    assert not [name for name, lines, parameters in kernels() if lines > LINES or parameters > PARAMETERS]
