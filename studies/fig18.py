"""Figure 18: on a plate of 2 kg the contact times are all but those of figure 10."""

import source_scenes as source

from fem_impact import charts


def compute(**wanted):
    """Stick masses and linear springs on the plate of 2 kg."""
    return source.linear_map(2.0, **wanted)


def draw(table):
    """The map with contours of the contact resonance."""
    figure = source.draw_map(
        table,
        "contact_time",
        charts.Axis("contact time", "s", log=True),
        title="Contact time, plate of 2 kg, linear spring",
        marks=[source.mark(source.MARKED, "figure 21"), source.mark(source.STIFF, "figure 22", charts.BLACK)],
    )
    return figure, source.table_columns(table, "contact_time", "n_impacts")


if __name__ == "__main__":
    source.run("fig18", compute, draw)
