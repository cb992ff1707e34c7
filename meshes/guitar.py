"""A guitar-like top plate, 0.49 m long, with a round sound hole; edges body and hole0.

The curve is an original design: the control points below define one half, and the other half mirrors it.
"""

from pathlib import Path

import numpy as np

import fem_impact as fi
from fem_impact.mesh.loops import Bezier, Outline, circle

HALF = [  # [m] cubic pieces from tail to neck, y > 0, with continuous tangents
    [(0.0, 0.0), (0.0, 0.11), (0.045, 0.185), (0.13, 0.185)],
    [(0.13, 0.185), (0.21, 0.185), (0.235, 0.118), (0.29, 0.118)],
    [(0.29, 0.118), (0.335, 0.118), (0.345, 0.14), (0.39, 0.14)],
    [(0.39, 0.14), (0.455, 0.14), (0.49, 0.085), (0.49, 0.0)],
]


def outline() -> Outline:
    """The curve around the plate and its sound hole."""
    there = [Bezier(np.array(piece), "body") for piece in HALF]
    back = [Bezier(piece.control[::-1] * [1.0, -1.0], "body") for piece in reversed(there)]
    return Outline.around((*there, *back), (circle((0.335, 0.0), 0.045, "hole0"),))


if __name__ == "__main__":
    fi.mesh.save(Path(__file__).with_suffix(".msh"), fi.mesh.fill(outline(), size=0.04))
