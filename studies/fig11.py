"""Figure 11: the spectral centroid of the same blows follows the same contours."""

import source_scenes as source

from fem_impact import charts


def compute(**wanted):
    """Stick masses and linear springs on the plate of 500 t."""
    return source.linear_map(5e5, **wanted)


def draw(table):
    """The map with contours of the contact resonance."""
    figure = source.draw_map(
        table,
        "centroid",
        charts.Axis("spectral centroid up to 5 kHz", "Hz", log=True),
        title="Spectral centroid, plate of 500 t, linear spring",
        marks=[source.mark(source.MARKED, "figures 8 and 9")],
    )
    return figure, source.table_columns(table, "centroid", "n_impacts")


if __name__ == "__main__":
    source.run("fig11", compute, draw)
