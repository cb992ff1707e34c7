"""Figure 8: on a plate of 500 t, the linear spring gives a half sine; the Hertz pulse starts more gently."""

import source_scenes as source

from fem_impact.show import plots


def compute():
    """The blows through the linear and the Hertz spring."""
    return source.marked_blow(5e5), source.marked_hertz_blow()


def draw(hits):
    """Draw each force over its peak, because the speeds differ."""
    names = "linear, 88.6 kN/m", "Hertz, 695 kN/m$^{1.5}$"
    drawn = [
        plots.Curve(hit.time, hit.force / hit.peak_force, name, color)
        for hit, name, color in zip(hits, names, (plots.VERMILION, plots.BLUE))
    ]
    axis = plots.Axis("force over its peak", "", limits=(0.0, 1.05))
    figure = plots.curves(drawn, x=source.TIME, y=axis, title="Stick of 100 g on an unyielding plate")
    columns = {}
    for hit, name in zip(hits, ("linear", "hertz")):
        columns |= {f"time, {name} [s]": hit.time, f"force, {name} [N]": hit.force}
    return figure, columns


if __name__ == "__main__":
    source.run("fig08", compute, draw)
