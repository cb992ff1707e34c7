"""Figure 10: plate of 500 t, linear spring: contact time follows the contours of the contact resonance."""

import source_scenes as source


def compute(**wanted):
    """Map of stick masses and linear springs on the plate of 500 t."""
    return source.linear_map(5e5, **wanted)


def draw(table):
    """Draw the map with contours of the contact resonance."""
    return source.draw_map(table, "contact_time", "Contact time, plate of 500 t, linear spring", source.FIGURES_8_9)


if __name__ == "__main__":
    source.run("fig10", compute, draw)
