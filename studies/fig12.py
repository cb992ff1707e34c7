"""Figure 12: contact time on a plate of 500 t with Hertz springs: the same trends."""

import source_scenes as source


def compute(**wanted):
    """Stick masses and Hertz springs on the plate of 500 t."""
    return source.hertz_map(5e5, **wanted)


def draw(table):
    """The map with contours of the contact resonance."""
    return source.draw_map(
        table, "contact_time", "Contact time, plate of 500 t, Hertz spring", source.FIGURES_8_9_HERTZ
    )


if __name__ == "__main__":
    source.run("fig12", compute, draw)
