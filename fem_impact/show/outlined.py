"""Pictures of a body with places marked on it: what a removal does anywhere, and patches with their labels."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .canvas import COLOURS, VERMILION
from .style import BLUE, GREY, draw_rim, panels

Marks = Sequence[tuple[np.ndarray, float, Sequence[str]]]
UNIT = "cents per 0.1 mm off 1 cm$^2$"


def marked(points: np.ndarray, cells: np.ndarray, maps: np.ndarray, titles: Sequence[str], marks: Marks) -> Any:
    """A panel for each mode: its map (n_points, n) [cents per 0.1 mm off a square centimetre], and the patches.

    ``points`` (n_points, dimension) [m] and ``cells`` are those of the body; of each patch ``marks`` hold the middles
    (n, dimension) [m], the radius [m] and a label for every panel.
    """
    plane = points.shape[1] == 2
    sides, angle = np.ptp(points, axis=0), np.linspace(0.0, 2.0 * np.pi, 61)
    tall = 1.2 + 4.6 * min(1.6, max(0.4, float(sides[-1] / sides[0]))) if plane else 2.6
    columns = min(len(titles), 2 if plane else 1)
    with panels(len(titles), columns, 5.6 if plane else 7.0, tall) as (figure, all_axes):
        for i, (axes, title) in enumerate(zip(all_axes, titles)):
            if plane:
                most = float(np.abs(maps[:, i]).max()) or 1.0
                kind: dict[str, Any] = {"cmap": COLOURS, "vmin": -most, "vmax": most, "shading": "gouraud"}
                drawn = axes.tripcolor(*points.T, cells, maps[:, i], **kind)
                draw_rim(axes, points, cells)
                axes.set_axis_off()
                figure.colorbar(drawn, ax=axes, label=UNIT, shrink=0.7)
                for number, (middles, radius, _) in enumerate(marks, 1):
                    for x, y in middles:
                        axes.plot(x + radius * np.cos(angle), y + radius * np.sin(angle), color=VERMILION, lw=1.4)
                        axes.annotate(str(number), (x, y), ha="center", va="center", fontweight="bold")
            else:
                axes.plot(points[:, 0], maps[:, i], color=BLUE)
                axes.axhline(0.0, color=GREY, lw=0.6)
                axes.set(xlabel="x [m]", ylabel=UNIT.replace(" per", "\nper"))
                top: dict[str, Any] = {"xycoords": axes.get_xaxis_transform(), "ha": "center", "va": "top"}
                for number, (middles, radius, _) in enumerate(marks, 1):
                    for x in middles[:, 0]:
                        axes.axvspan(x - radius, x + radius, color=VERMILION, alpha=0.12, lw=0)
                        axes.annotate(str(number), (x, 0.97), **top)
            labels = "\n".join(mark[2][i] for mark in marks)
            axes.set_title(title, loc="left")
            place = {"ha": "right", "va": "top"} if plane else {"ha": "left", "va": "bottom"}
            axes.annotate(labels, (1.0 if plane else 1.01, 0.0), xycoords="axes fraction", fontsize=8, **place)
    return figure
