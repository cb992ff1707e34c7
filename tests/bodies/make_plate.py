"""Make plate.frd, an aluminium plate clamped at its left, with CalculiX (`ccx`, of Debian's calculix-ccx).

    python tests/bodies/make_plate.py

Six quadratic shells by four: the 12 lowest modes, and the deflection under 1 N half way along the free side (TIP).
"""

import subprocess
from pathlib import Path

import numpy as np

LENGTH, WIDTH, THICKNESS, NX, NY = 0.3, 0.2, 3e-3, 6, 4
HERE = Path(__file__).parent
STEPS = """
*MATERIAL, NAME=ALUMINIUM
*ELASTIC
70e9, 0.33
*DENSITY
2700.
*SHELL SECTION, ELSET=PLATE, MATERIAL=ALUMINIUM
3e-3
*BOUNDARY
LEFT, 1, 6
*STEP
*FREQUENCY
12
*NODE FILE, OUTPUT=2D
U
*END STEP
*STEP
*STATIC
*CLOAD
TIP, 3, 1.
*NODE FILE, OUTPUT=2D
U
*END STEP
"""


def deck() -> str:
    """Nodes from 1, column by column, corners and middles of sides; elements of eight nodes; sets and steps."""
    grid, nodes, lines = {}, ["*NODE, NSET=ALL"], ["*ELEMENT, TYPE=S8R, ELSET=PLATE"]
    for i in range(2 * NX + 1):
        for j in range(2 * NY + 1):
            if i % 2 and j % 2:
                continue
            grid[i, j] = len(grid) + 1
            nodes.append(f"{grid[i, j]}, {LENGTH * i / (2 * NX):.9g}, {WIDTH * j / (2 * NY):.9g}, 0.")
    around = (0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)
    for number, (i, j) in enumerate(np.ndindex(NX, NY), 1):
        lines.append(", ".join(str(each) for each in (number, *(grid[2 * i + a, 2 * j + b] for a, b in around))))
    left = [f"{grid[0, j]}," for j in range(2 * NY + 1)]
    return "\n".join([*nodes, *lines, "*NSET, NSET=LEFT", *left, "*NSET, NSET=TIP", f"{grid[2 * NX, NY]},"]) + STEPS


if __name__ == "__main__":
    (HERE / "plate.inp").write_text(deck())
    subprocess.run(["ccx", "plate"], cwd=HERE, check=True)
    for ending in ("12d", "cvg", "dat", "sta"):
        (HERE / f"plate.{ending}").unlink(missing_ok=True)
    (HERE / "spooles.out").unlink(missing_ok=True)
