"""Beyond the source: a stick that bends below 240 Hz, near the contact resonance, hits a rigid plate twice."""

import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact.show import plots

FREQUENCIES = np.geomspace(10e3, 100.0, 41)  # [Hz] of the stick's first bending mode


def compute(frequencies=FREQUENCIES):
    """Strike the plate of 500 t with sticks of 100 g through the marked spring."""
    over = {"striker_frequency": np.sort(frequencies)}
    law = fi.Contact.linear(source.MARKED[1])
    return fi.sweep(source.plate(5e5), source.stick(), law, at=source.AT, speed=source.SPEED, over=over)


def draw(table):
    """Draw restitution over the stick's first frequency, with single and multiple impacts marked."""
    frequency, restitution = table.striker_frequency.values, table.restitution.values
    once = table.n_impacts.values == 1
    drawn = [
        plots.Curve(frequency, restitution, "", plots.GREY),
        plots.Curve(frequency[once], restitution[once], "one impact", plots.BLUE, "o"),
        plots.Curve(frequency[~once], restitution[~once], "several impacts", plots.VERMILION, "s"),
    ]
    figure = plots.curves(
        drawn,
        x=plots.Axis("first bending mode of the stick", "Hz", log=True),
        y=plots.Axis("restitution"),
        title="Stick of 100 g, spring of 88.6 kN/m, unyielding plate",
    )
    return figure, source.table_columns(table, "n_impacts", "contact_time", "restitution")


if __name__ == "__main__":
    source.run("beyond_flexible_stick", compute, draw)
