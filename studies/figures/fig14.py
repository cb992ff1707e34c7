"""Figure 14: the plate of 200 g and the four points where figure 15 strikes it."""

import fig07
import sketches
import source_scenes as source

from fem_impact.show import plots

PLACES = {0.05: plots.VERMILION, 0.2: plots.BLUE, 0.3: plots.GREEN, 0.5: plots.BLACK}  # [-] of the length


def compute():
    """Points struck [m], (4, 2)."""
    return [(place * source.LENGTH, 0.5 * source.WIDTH) for place in PLACES]


def draw(points):
    """Draw the plate from above."""
    labels = [f"{place:g}" for place in PLACES]
    title = "Where the plate is struck, as a share of its length"
    figure = sketches.plan(fig07.compute(), points, labels, title=title, colors=list(PLACES.values()))
    return figure, {"x [m]": [x for x, _ in points], "y [m]": [y for _, y in points]}


if __name__ == "__main__":
    source.run("fig14", compute, draw)
