"""Beyond the source: in a hammer test of the plate of 200 g, hammers of up to 30 g reach 500 Hz with a single hit."""

import numpy as np
import source_scenes as source

from fem_impact.show import plots
from fem_impact.sweeps import hammers

BANDWIDTH = 500.0  # [Hz] at 10 dB below the spectrum's start
MASSES = np.geomspace(1e-3, 1.0, 19)  # [kg]


def compute(masses=MASSES):
    """The range of each hammer at 0.3 of both sides."""
    return hammers.choose(source.plate(0.2), source.AT, BANDWIDTH, masses)


def draw(found):
    """Draw the tips that work over the hammer's mass."""
    names = ("mass", "softest", "hardest", "reach")
    columns = {name: [getattr(hammer, name) or np.nan for hammer in found] for name in names}
    return plots.hammers(found, BANDWIDTH), columns


if __name__ == "__main__":
    source.run("beyond_hammer_test", compute, draw)
