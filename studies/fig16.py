"""Figure 16: the free beam of 200 g and the four points where figure 17 strikes it."""

import source_scenes as source

from fem_impact import charts

PLACES = {0.0: charts.VERMILION, 0.03: charts.BLUE, 0.1: charts.GREEN, 0.4: charts.BLACK}  # [-] of the length


def compute():
    """Points struck [m], (4, 1), on a beam of 1 m."""
    return [(place,) for place in PLACES]


def draw(points):
    """The beam from the side."""
    labels = [f"{place:g}" for place in PLACES]
    title = "Where the free beam is struck, as a share of its length"
    figure = charts.plan([[0.0], [1.0]], points, labels, title=title, colors=list(PLACES.values()))
    return figure, {"x [m]": [x for (x,) in points]}


if __name__ == "__main__":
    source.run("fig16", compute, draw)
