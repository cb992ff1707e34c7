"""Figure 10: contact time on a plate of 500 t follows the contours of the contact resonance, linear spring."""

import source_scenes as source

from fem_impact import charts


def compute(**wanted):
    """Stick masses and linear springs on the plate of 500 t."""
    return source.linear_map(5e5, **wanted)


def draw(table):
    """The map with contours of the contact resonance."""
    figure = source.draw_map(
        table,
        "contact_time",
        charts.Axis("contact time", "s", log=True),
        title="Contact time, plate of 500 t, linear spring",
        marks=[source.mark(source.MARKED, "figures 8 and 9")],
    )
    return figure, source.table_columns(table, "contact_time", "n_impacts")


if __name__ == "__main__":
    source.run("fig10", compute, draw)
