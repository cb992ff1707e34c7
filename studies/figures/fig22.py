"""Figure 22: a stiff spring on the same plates; the lightest gives three impacts, the third after a long gap."""

import fig21
import source_scenes as source


def compute(stiffness=source.STIFF[1]):
    """One blow per plate, by name of the plate."""
    return fig21.compute(stiffness)


def draw(hits):
    """Draw the forces over time."""
    return fig21.draw(hits, "Stick of 100 g, spring of 1 MN/m")


if __name__ == "__main__":
    source.run("fig22", compute, draw)
