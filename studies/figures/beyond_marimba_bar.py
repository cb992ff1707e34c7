"""Beyond the source: figure 16's free bar needs the softest mallet at its end; elsewhere 10 g works with 10 MN/m."""

import fig16
import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact.show import plots

MASSES = np.geomspace(2e-3, 0.1, 30)  # [kg]
STIFFNESSES = np.geomspace(1e3, 1e7, 41)  # [N/m]


def compute(masses=MASSES, stiffnesses=STIFFNESSES):
    """Hardest head [N/m] of a rigid mallet that hits the bar (200 g, 100 Hz) once, as do all softer heads."""
    bar = fi.analytic.beam(1.0, ends=("free", "free"), mass=0.2, first_frequency=100.0, n_modes=60)
    over = {"at": [[place] for place in fig16.PLACES], "mass": masses, "stiffness": stiffnesses}
    law = fi.Contact.linear(1.0)
    table = fi.sweep(bar, fi.Striker.rigid(0.01), law, at=0.0, speed=1.0, over=over)
    twice = (table.n_impacts != 1).values
    first = np.where(twice.any(axis=2), twice.argmax(axis=2), len(stiffnesses))
    hardest = np.append(np.nan, stiffnesses)[first]  # just below the first head that hits twice; NaN if all do
    return dict(zip(fig16.PLACES, hardest))


def draw(result):
    """Draw the hardest head that hits once over the mallet's mass."""
    drawn = [
        plots.Curve(1e3 * MASSES, values, f"at {place:g} of the length", fig16.PLACES[place])
        for place, values in result.items()
    ]
    figure = plots.curves(
        drawn,
        x=plots.Axis("mass of the mallet", "g", log=True),
        y=plots.Axis("hardest head that hits once", "N/m", log=True, limits=(None, 1.3 * STIFFNESSES[-1])),
        title="Free bar of 200 g, 100 Hz; heads of up to 10 MN/m tried",
    )
    return figure, {"mass [kg]": MASSES} | {f"at {place:g} [N/m]": values for place, values in result.items()}


if __name__ == "__main__":
    source.run("beyond_marimba_bar", compute, draw)
