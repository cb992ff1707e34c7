"""Figure 1: one of two equal steel balls hits the other and stops; the other swings out and back, and this repeats."""

import fig02
import source_scenes as source

run = fig02.cradle


def compute():
    """Two balls, for one and a half swings."""
    return run(2)


if __name__ == "__main__":
    source.run("fig01", compute, fig02.draw)
