"""Figure 22: a stiff spring on the same plates; on the lightest three impacts, with a long wait before the third."""

import fig21
import source_scenes as source


def compute(stiffness=source.STIFF[1]):
    """One blow for each plate, by the plate's name."""
    return fig21.compute(stiffness)


def draw(hits):
    """Forces over time."""
    return fig21.draw(hits, "Stick of 100 g, spring of 1 MN/m")


if __name__ == "__main__":
    source.run("fig22", compute, draw)
