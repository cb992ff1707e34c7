"""Figure 20: single clean impacts (black), others by stiffness over threshold (colour), others beyond it (white).

The source calls two humps without a loss of contact, as in its figure 21, "a multiple impact of some kind". So here a
blow is clean only if its force rises once and falls once. Then all but one of 180 cases beyond the threshold are
multiple at 0.3 of both sides, and both marked cases lie where the source has them (fig20). If only a lost contact
counts, the same holds for a plate struck near its middle (fig20_middle), but not at 0.3 of both sides.
"""

import source_scenes as source

from fem_impact.scenes import maps
from fem_impact.show import plots

MIDDLE = (0.45 * source.LENGTH, 0.5 * source.WIDTH)  # [m]


def compute(at=source.AT, *, humps=True, **wanted):
    """Map of the plate of 200 g: which blows are clean, and contact stiffness over the stiffness at the threshold.

    With ``humps``, a second hump of the force counts as another impact; otherwise only a lost contact does.
    """
    layers = {"humps": lambda hit: len(source.humps(hit))} if humps else None
    table = source.linear_map(0.2, at=at, layers=layers, **wanted)
    clean = (table.n_impacts == 1) & (table.humps == 1 if humps else True)
    ratio = (table.contact_resonance / table.threshold) ** 2
    return table.assign(clean=clean, ratio=ratio.transpose(*table.n_impacts.dims))


def draw(table, title="Single and multiple impacts, plate of 200 g"):
    """Draw stiffness over threshold in colour, except for clean impacts."""
    figure = maps.draw(
        table.assign_attrs(title=title),
        "ratio",
        source.FIGURES_21_22,
        colour=plots.Axis("stiffness over threshold, multiple impacts", "", log=True, limits=(0.1, 1.0)),
        shades=[
            (table.clean, plots.BLACK, "one clean impact"),
            (~table.clean & (table.ratio >= 1.0), "white", "multiple, beyond the threshold"),
        ],
        contours=[(table.ratio, [1.0], "", "threshold")],
    )
    return figure, source.table_columns(table, "n_impacts", "clean", "ratio")


def main():
    """Draw both pictures and print how many cases beyond the threshold are clean."""
    for name, table, words in (
        ("fig20", compute(), "Single and multiple impacts, plate of 200 g"),
        ("fig20_middle", compute(MIDDLE, humps=False), "Plate of 200 g struck near its middle: lost contacts"),
    ):
        beyond = table.ratio >= 1.0
        print(f"{int(beyond.sum())} cases beyond the threshold, {int((beyond & table.clean).sum())} of them clean")
        source.publish(name, *draw(table, words))


if __name__ == "__main__":
    main()
