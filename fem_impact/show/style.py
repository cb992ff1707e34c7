"""The style of every plot, and how its axes are laid out."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
import numpy as np
from cycler import cycler
from matplotlib import font_manager
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter

from ..mesh.mesh_files import boundary
from .canvas import VERMILION

# Okabe and Ito's palette: distinct for all common kinds of colour vision, and in print.
BLUE, GREEN, ORANGE, PURPLE, SKY = "#0072B2", "#009E73", "#E69F00", "#CC79A7", "#56B4E9"
GREY = "#777777"
PALETTE = [BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY]
STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "axes.prop_cycle": cycler(color=PALETTE),
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.5,
    "legend.frameon": False,
    "savefig.dpi": 150.0,
    "text.usetex": False,  # a matplotlibrc in the working folder may say otherwise, with commands of its own
}
ENDINGS = tuple(f".{name}" for name in FigureCanvasAgg.get_supported_filetypes())  # of files of figures


class StyledFigure(Figure):
    """A figure that notebooks show as a picture, whatever their backend."""

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        with matplotlib.rc_context(STYLE):
            self.savefig(file, format="png")
        return file.getvalue()

    def __repr__(self) -> str:
        return f"<Picture of {len(self.axes)} axes; save it with fi.figures.save>"


@contextmanager
def open_figure(width: float, height: float) -> Iterator[Figure]:
    """A figure of a size [inch], drawn in `STYLE` inside the block."""
    with matplotlib.rc_context(STYLE):
        yield StyledFigure(figsize=(width, height), layout="constrained")


@contextmanager
def panels(count: int, columns: int, width: float, height: float, **shared: Any) -> Iterator[tuple[Figure, list[Any]]]:
    """A figure of ``count`` panels of a size [inch] in rows, drawn in `STYLE` inside the block, and their axes."""
    rows = -(-count // columns)
    with open_figure(width * columns, height * rows) as figure:
        all_axes = figure.subplots(rows, columns, squeeze=False, **shared).ravel()
        for axes in all_axes[count:]:
            axes.set_visible(False)
        yield figure, list(all_axes[:count])


def set_units(axes: Any, x: str = "", y: str = "") -> None:
    """Label the ticks with SI prefixes and units; "" leaves those of an axis as they are."""
    for axis, unit in ((axes.xaxis, x), (axes.yaxis, y)):
        if unit:
            axis.set_major_formatter(EngFormatter(unit=unit, sep=" "))


def draw_rim(axes: Any, plane: np.ndarray, cells: np.ndarray) -> None:
    """Draw the outline of triangles, to scale."""
    axes.add_collection(LineCollection(list(plane[boundary(cells)]), colors=GREY, linewidths=1.0))
    axes.set_aspect("equal")


def pixels(figure: Figure, dpi: float) -> np.ndarray:
    """A figure as it would be saved, (height, width, 3) from the upper left; its axes are laid out afterwards."""
    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def font_file() -> str:
    """The file of the letters of all figures, for text in pictures by other means."""
    return str(font_manager.findfont("DejaVu Sans"))
