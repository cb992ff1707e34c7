"""Figure 11: the spectral centroid of the same blows follows the same contours."""

import fig10
import source_scenes as source

compute = fig10.compute


def draw(table):
    """Draw the map with contours of the contact resonance."""
    return source.draw_map(table, "centroid", "Spectral centroid, plate of 500 t, linear spring", source.FIGURES_8_9)


if __name__ == "__main__":
    source.run("fig11", compute, draw)
