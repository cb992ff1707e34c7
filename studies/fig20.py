"""Figure 20: single impacts black, several in colour by contact stiffness over its threshold; white beyond that.

The source does not say where its plate is struck, and this map depends on it. Struck near the middle, every case beyond
the threshold strikes more than once, as the source shows (fig20). At 0.3 of both sides, where figures 19 and 21 to 24
come out as described, a quarter of the cases beyond it still bounce off cleanly (fig20_off_centre).
"""

import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact import charts

MIDDLE = (0.45 * source.LENGTH, 0.5 * source.WIDTH)  # [m]


def compute(at=MIDDLE, damping_ratio=0.0, **wanted):
    """Blows on the plate of 200 g and, for each mass, the stiffness at which the plate would stop the stick [N/m]."""
    table = source.linear_map(0.2, at=at, damping_ratio=damping_ratio, **wanted)
    limit = threshold_stiffness(source.plate(0.2, n_modes=300), at, table.mass.values / 3.0)
    return table, table.mass.copy(data=limit)


def threshold_stiffness(modes, at, felt_masses):
    """Contact stiffness [N/m] whose resonance with each mass is the threshold frequency, (n_masses,)."""
    return np.array([m * (2.0 * np.pi * fi.threshold_frequency(modes, at, m)) ** 2 for m in felt_masses])


def draw(result):
    """Stiffness over threshold in colour where there are several impacts."""
    table, limit = result
    ratio = table.stiffness / limit + 0.0 * table.contact_time  # (n_stiffnesses, n_masses)
    figure = charts.colour_map(
        ratio.assign_coords(mass=1e3 * table.mass),
        x=source.MASS,
        y=source.STIFFNESS,
        colour=charts.Axis("stiffness over threshold, several impacts", "", log=True, limits=(None, 1.0)),
        shades=[
            (table.n_impacts == 1, charts.BLACK, "one clean impact"),
            ((table.n_impacts > 1) & (ratio >= 1.0), "white", "several, beyond the threshold"),
        ],
        contours=[(ratio, [1.0], "", "threshold")],
        marks=[source.mark(source.MARKED, "figure 21"), source.mark(source.STIFF, "figure 22", charts.ORANGE)],
        title="Single and multiple impacts, plate of 200 g",
    )
    table = table.assign(ratio=ratio)
    return figure, source.table_columns(table, "n_impacts", "ratio")


if __name__ == "__main__":
    source.run("fig20", compute, draw)
    source.run("fig20_off_centre", lambda: compute(source.AT), draw)
