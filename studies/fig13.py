"""Figure 13: the spectral centroid with Hertz springs: the same trends."""

import source_scenes as source

from fem_impact import charts


def compute(**wanted):
    """Stick masses and Hertz springs on the plate of 500 t."""
    return source.hertz_map(5e5, **wanted)


def draw(table):
    """The map with contours of the contact resonance."""
    figure = source.draw_map(
        table,
        "centroid",
        charts.Axis("spectral centroid up to 5 kHz", "Hz", log=True),
        title="Spectral centroid, plate of 500 t, Hertz spring",
        marks=[source.mark(source.MARKED_HERTZ, "figures 8 and 9")],
        hertz=True,
    )
    return figure, source.table_columns(table, "centroid", "n_impacts")


if __name__ == "__main__":
    source.run("fig13", compute, draw)
