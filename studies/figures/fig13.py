"""Figure 13: with Hertz springs, the spectral centroid shows the same trends."""

import fig12
import source_scenes as source

compute = fig12.compute


def draw(table):
    """Draw the map with contours of the contact resonance."""
    return source.draw_map(
        table, "centroid", "Spectral centroid, plate of 500 t, Hertz spring", source.FIGURES_8_9_HERTZ
    )


if __name__ == "__main__":
    source.run("fig13", compute, draw)
