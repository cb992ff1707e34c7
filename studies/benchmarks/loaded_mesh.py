"""Measures the cost of modes on a mesh from a file, with new triangles within its rim or with divided triangles.

    python studies/benchmarks/loaded_mesh.py

Takes the guitar top of `meshes/` as it is and meshed more finely, clamped at the body. As in a strike of
`scenes/guitar_top.toml`, the study finds 52 modes to a tolerance of 1e-2 and then with elements for the highest of
them. Each row is one run.
"""

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

SIZES = (0.04, 0.02, 0.01)  # [m] element size of the file in `meshes`, and finer
SUPPORTS = {"body": "clamped", "hole0": "free"}
FREQUENCY = 1943.5  # [Hz] of mode 52


def row(shape, plate):
    """Seconds, number of unknowns and 20th frequency [Hz] on a loaded mesh."""
    start = time.perf_counter()
    first = fi.find_modes(fi.assemble(shape, plate, SUPPORTS), n_modes=20, tolerance=1e-2)
    system = first.shapes.system
    system = replace(system, mesh=replace(system.mesh, size_stated=False))
    modes = fi.find_modes(system, max_frequency=FREQUENCY)
    seconds = time.perf_counter() - start
    return seconds, modes.shapes.system.n_dofs, modes.frequencies[19]


def main():
    """Print one row per mesh and method."""
    sys.path.insert(0, str(shared.MESHES))
    from guitar import outline

    plate = fi.load_scene(shared.SCENES / "guitar_top.toml").make_section("plate")
    exact = fi.find_modes(fi.assemble(fi.mesh.fill(outline()), plate, SUPPORTS), n_modes=20, tolerance=1e-5)
    print(f"{'triangles':>9} {'refined by':>14} {'seconds':>8} {'unknowns':>9} {'error of mode 20':>17}")
    with tempfile.TemporaryDirectory() as folder:
        for size in SIZES:
            fi.mesh.save(Path(folder) / "guitar.msh", fi.mesh.fill(outline(), size=size))
            shape = fi.mesh.load(Path(folder) / "guitar.msh")
            for name, mesh in (("new or divided", shape), ("divided only", fi.mesh.aligned(shape))):
                seconds, unknowns, found = row(mesh, plate)
                error = abs(found / exact.frequencies[19] - 1.0)
                print(f"{len(shape.cells):9d} {name:>14} {seconds:8.2f} {unknowns:9d} {error:17.1e}")


if __name__ == "__main__":
    main()
