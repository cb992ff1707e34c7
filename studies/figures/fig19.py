"""Figure 19: on a plate of 200 g, contact times differ at the upper right, where the stick hits more than once."""

import source_scenes as source


def compute(**wanted):
    """Map of stick masses and linear springs on the plate of 200 g."""
    return source.linear_map(0.2, **wanted)


def draw(table):
    """Draw the map with contours of the contact resonance."""
    return source.draw_map(table, "contact_time", "Contact time, plate of 200 g, linear spring", source.FIGURES_21_22)


if __name__ == "__main__":
    source.run("fig19", compute, draw)
