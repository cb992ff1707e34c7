"""Figure 18: on a plate of 2 kg, the contact times are nearly those of figure 10."""

import source_scenes as source


def compute(**wanted):
    """Map of stick masses and linear springs on the plate of 2 kg."""
    return source.linear_map(2.0, **wanted)


def draw(table):
    """Draw the map with contours of the contact resonance."""
    return source.draw_map(table, "contact_time", "Contact time, plate of 2 kg, linear spring", source.FIGURES_21_22)


if __name__ == "__main__":
    source.run("fig18", compute, draw)
