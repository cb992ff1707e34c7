"""Figure 7: the scene, a hinged plate struck through a spring by the free end of a hinged stick."""

import numpy as np
import sketches
import source_scenes as source


def compute():
    """Corners of the plate [m], (4, 2)."""
    return np.array([[0.0, 0.0], [source.LENGTH, 0.0], [source.LENGTH, source.WIDTH], [0.0, source.WIDTH]])


def draw(corners):
    """Draw the scene in oblique view."""
    figure = sketches.blow(corners, source.AT, title="A stick strikes a plate")
    return figure, {"x [m]": [*corners[:, 0], source.AT[0]], "y [m]": [*corners[:, 1], source.AT[1]]}


if __name__ == "__main__":
    source.run("fig07", compute, draw)
