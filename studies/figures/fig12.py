"""Figure 12: with Hertz springs on a plate of 500 t, contact time shows the same trends."""

import source_scenes as source


def compute(**wanted):
    """Map of stick masses and Hertz springs on the plate of 500 t."""
    return source.hertz_map(5e5, **wanted)


def draw(table):
    """Draw the map with contours of the contact resonance."""
    return source.draw_map(
        table, "contact_time", "Contact time, plate of 500 t, Hertz spring", source.FIGURES_8_9_HERTZ
    )


if __name__ == "__main__":
    source.run("fig12", compute, draw)
