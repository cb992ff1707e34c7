"""Figure 21: the marked blow on plates of 500 t, 2 kg and 200 g; the lightest plate gives two humps in one contact."""

import source_scenes as source

from fem_impact.show import plots

STIFFNESS = source.MARKED[1]


def compute(stiffness=STIFFNESS):
    """One blow per plate, by name of the plate."""
    return {name: source.marked_blow(mass, stiffness) for name, mass in source.PLATE_MASSES.items()}


def draw(hits, title="Stick of 100 g, spring of 88.6 kN/m"):
    """Draw the forces over time."""
    drawn = [
        plots.Curve(hit.time, hit.force, f"plate of {name}", source.PLATE_COLORS[name]) for name, hit in hits.items()
    ]
    last = max(hit.impacts[-1].end for hit in hits.values())
    axis = plots.Axis("time", "s", limits=(-0.02 * last, 1.05 * last))
    columns = {}
    for name, hit in hits.items():
        columns |= {f"time, {name} [s]": hit.time, f"force, {name} [N]": hit.force}
    return plots.curves(drawn, x=axis, y=source.FORCE, title=title), columns


if __name__ == "__main__":
    source.run("fig21", compute, draw)
