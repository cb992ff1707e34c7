"""Figure 17: the contact resonance above which the free beam of 200 g stops a hammer, over the hammer's mass."""

import fig15
import fig16
import source_scenes as source

import fem_impact as fi


def compute(hammers=fig15.HAMMERS):
    """Thresholds at the four points of figure 16; the beam's rigid motions are included."""
    beam = fi.analytic.beam(1.0, ends=("free", "free"), mass=0.2, first_frequency=100.0, n_modes=400)
    return fig15.thresholds(beam, dict(zip(fig16.PLACES, fig16.compute())), hammers)


def draw(result):
    """Draw the four curves on logarithmic axes."""
    return fig15.draw(result, fig16.PLACES, "Threshold of a clean rebound, free beam of 200 g")


if __name__ == "__main__":
    source.run("fig17", compute, draw)
