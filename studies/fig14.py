"""Figure 14: the plate of 200 g and the four points where figure 15 strikes it."""

import fig07
import source_scenes as source

from fem_impact import charts

PLACES = {0.05: charts.VERMILION, 0.2: charts.BLUE, 0.3: charts.GREEN, 0.5: charts.BLACK}  # [-] of the length


def compute():
    """Points struck [m], (4, 2)."""
    return [(place * source.LENGTH, 0.5 * source.WIDTH) for place in PLACES]


def draw(points):
    """The plate from above."""
    labels = [f"{place:g}" for place in PLACES]
    title = "Where the plate is struck, as a share of its length"
    figure = charts.plan(fig07.compute(), points, labels, title=title, colors=list(PLACES.values()))
    return figure, {"x [m]": [x for x, _ in points], "y [m]": [y for _, y in points]}


if __name__ == "__main__":
    source.run("fig14", compute, draw)
