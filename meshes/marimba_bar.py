"""An undercut marimba bar: a free beam whose height follows marimba_bar.csv, thin in the middle.

The undercut is a parabola between two uncut ends; it tunes the second mode to about four times the first, two octaves.
"""

from pathlib import Path

import numpy as np

import fem_impact as fi

PROFILE = Path(__file__).with_suffix(".csv")
LENGTH, WIDTH, HEIGHT = 0.35, 0.055, 0.022  # [m]
THINNEST, PAD = 0.0092, 0.075  # [m] height in the middle; length of each uncut end
ROSEWOOD = {"E": 16e9, "nu": 0.35, "rho": 900.0}


def profile(n_points: int = 141) -> np.ndarray:
    """Position [m] and height [m] along the bar, (n_points, 2)."""
    x = np.linspace(0.0, LENGTH, n_points)
    inside = np.clip(1.0 - ((x - 0.5 * LENGTH) / (0.5 * LENGTH - PAD)) ** 2, 0.0, None)
    return np.column_stack([x, HEIGHT - (HEIGHT - THINNEST) * inside])


def bar() -> tuple[fi.mesh.Mesh, fi.Beam]:
    """Line mesh and beam section read from the shipped profile."""
    x, height = np.loadtxt(PROFILE, delimiter=",", skiprows=1).T
    section = fi.Beam.rectangular(
        fi.Material(**ROSEWOOD), width=WIDTH, height=lambda points: np.interp(points[:, 0], x, height)
    )
    return fi.mesh.line(LENGTH), section


if __name__ == "__main__":
    np.savetxt(PROFILE, profile(), delimiter=",", header="position in m,height in m", comments="", fmt="%.6e")
