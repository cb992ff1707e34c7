"""Figure 15: the contact resonance above which the plate of 200 g stops a hammer, over the hammer's mass."""

import fig14
import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact.show import plots

HAMMERS = np.geomspace(1e-3, 0.2, 60)  # [kg]


def thresholds(modes, places, hammers=HAMMERS):
    """Threshold [Hz] of each hammer at each place; NaN if it never rebounds."""
    return {
        place: np.array([fi.threshold_frequency(modes, point, mass) or np.nan for mass in hammers])
        for place, point in places.items()
    }


def compute(hammers=HAMMERS):
    """Thresholds at the four points of figure 14."""
    return thresholds(source.plate(0.2, n_modes=300), dict(zip(fig14.PLACES, fig14.compute())), hammers)


def draw(result, places=fig14.PLACES, title="Threshold of a clean rebound, plate of 200 g"):
    """Draw the four curves on logarithmic axes."""
    drawn = [
        plots.Curve(1e3 * HAMMERS, values, f"at {place:g} of the length", places[place])
        for place, values in result.items()
    ]
    figure = plots.curves(
        drawn,
        x=plots.Axis("mass of the hammer", "g", log=True),
        y=plots.Axis("threshold of contact resonance", "Hz", log=True),
        title=title,
    )
    return figure, {"mass [kg]": HAMMERS} | {f"at {place:g} [Hz]": values for place, values in result.items()}


if __name__ == "__main__":
    source.run("fig15", compute, draw)
