"""Figure 16: the free beam of 200 g and the four points where figure 17 strikes it."""

import sketches
import source_scenes as source

from fem_impact.show import plots

PLACES = {0.0: plots.VERMILION, 0.03: plots.BLUE, 0.1: plots.GREEN, 0.4: plots.BLACK}  # [-] of the length


def compute():
    """Points struck [m], (4, 1), on a beam of 1 m."""
    return [(place,) for place in PLACES]


def draw(points):
    """Draw the beam from the side."""
    labels = [f"{place:g}" for place in PLACES]
    title = "Where the free beam is struck, as a share of its length"
    figure = sketches.plan([[0.0], [1.0]], points, labels, title=title, colors=list(PLACES.values()))
    return figure, {"x [m]": [x for (x,) in points]}


if __name__ == "__main__":
    source.run("fig16", compute, draw)
