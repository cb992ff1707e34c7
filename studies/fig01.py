"""Figure 1: of two equal steel balls the arriving one stops dead, the other flies off, comes back, and it repeats."""

import fig02
import source_scenes as source

run = fig02.cradle


def compute():
    """Two balls, for one and a half swings."""
    return run(2)


if __name__ == "__main__":
    source.run("fig01", compute, fig02.draw)
