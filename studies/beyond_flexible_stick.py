"""Beyond the source: a stick that bends below 240 Hz, near the contact resonance, hits an unyielding plate twice."""

import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact import charts

FREQUENCIES = np.geomspace(10e3, 100.0, 41)  # [Hz] of the stick's first bending mode


def compute(frequencies=FREQUENCIES):
    """Sticks of 100 g on the plate of 500 t through the marked spring."""
    over = {"striker_frequency": np.sort(frequencies)}
    law = fi.Contact.linear(source.MARKED[1])
    return fi.sweep(source.plate(5e5), source.stick(), law, at=source.AT, speed=source.SPEED, over=over)


def draw(table):
    """Restitution over the stick's first frequency, single blows apart from several."""
    frequency, restitution = table.striker_frequency.values, table.restitution.values
    once = table.n_impacts.values == 1
    drawn = [
        charts.Curve(frequency, restitution, "", charts.GREY),
        charts.Curve(frequency[once], restitution[once], "one impact", charts.BLUE, "o"),
        charts.Curve(frequency[~once], restitution[~once], "several impacts", charts.VERMILION, "s"),
    ]
    figure = charts.curves(
        drawn,
        x=charts.Axis("first bending mode of the stick", "Hz", log=True),
        y=charts.Axis("restitution"),
        title="Stick of 100 g, spring of 88.6 kN/m, unyielding plate",
    )
    return figure, source.table_columns(table, "n_impacts", "contact_time", "restitution")


if __name__ == "__main__":
    source.run("beyond_flexible_stick", compute, draw)
