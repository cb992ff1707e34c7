"""Curves, maps and sketches for studies and sweeps, in the style of `figures`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import EngFormatter, LogLocator, MaxNLocator, NullFormatter
from scipy.interpolate import RegularGridInterpolator

from .._base import check, markup
from ..impact import accuracy
from ..modes.modal import Modes
from ..references.case import ReferenceVerdict
from ..sweeps.hammers import Hammer, half_sine_reach
from ..sweeps.spreads import DOUBLE, QUANTITIES, Spread, double_hits
from . import sampling
from .figures import NAMES, TICKS, styled
from .style import BLUE, GREEN, GREY, ORANGE, PALETTE, PURPLE, SKY, VERMILION, draw_rim, set_units

BLACK = "#222222"
SCALE = "cividis"  # perceptually uniform, also for colour-blind readers
HALO: withStroke = withStroke(linewidth=2.2, foreground=BLACK)  # keeps white lines visible on bright colours
__all__ = ["BLACK", "BLUE", "GREEN", "GREY", "ORANGE", "PURPLE", "SKY", "VERMILION", "Axis", "Curve", "Mark"]


@dataclass(frozen=True)
class Axis:
    """Label, unit (shown with SI prefixes), scale and limits of an axis."""

    label: str
    unit: str = ""
    log: bool = False
    limits: tuple[float | None, float | None] = (None, None)
    names: tuple[str, ...] = ()  # labels for the values 0, 1, 2 ... instead of numbers

    def apply(self, axes: Any, which: str) -> None:
        """Set label, scale, limits and ticks of matplotlib axes along 'x' or 'y'."""
        axes.set(**{f"{which}label": f"{self.label} [dB]" if self.unit == "dB" else self.label})
        axis = getattr(axes, f"{which}axis")
        if self.log:
            axes.set(**{f"{which}scale": "log"})
            axis.set_minor_formatter(NullFormatter())
        if self.unit not in ("", "dB"):
            set_units(axes, **{which: self.unit})
        elif self.log:
            axis.set_major_formatter("{x:g}")
        if self.names:
            axis.set_major_locator(MaxNLocator(5, integer=True))  # more names would overlap
            axis.set_major_formatter(lambda x, _: self.names[int(x)] if x in range(len(self.names)) else "")
        axes.set(**{f"{which}lim": self.limits})


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve, its name in the legend ('' for none) and its style."""

    x: np.ndarray  # (n_points,)
    y: np.ndarray  # (n_points,)
    label: str = ""
    color: str = BLUE
    style: str = "-"
    width: float = 1.5  # [pt]
    panel: str = ""  # name of the panel it belongs to; panels are stacked


@dataclass(frozen=True)
class Mark:
    """A case to mark on a map."""

    x: float
    y: float
    label: str
    color: str = GREEN


def curves(
    drawn: Sequence[Curve], *, x: Axis, y: Axis, title: str = "", filled: Curve | None = None, between: Any = None
) -> Figure:
    """Draw curves in one or more panels; shade ``filled`` down to zero, and ``between`` = (x, low, high)."""
    panels = list(dict.fromkeys(curve.panel for curve in drawn))
    with styled(6.4, 3.8 if len(panels) == 1 else 2.2 * len(panels)) as figure:
        called = {tuple(curve.label for curve in drawn if curve.panel == panel and curve.label) for panel in panels}
        same = len(panels) > 1 and len(called) == 1  # then one legend below names the curves of all panels
        all_axes = figure.subplots(len(panels), sharex=True, squeeze=False)[:, 0]
        for axes, panel in zip(all_axes, panels):
            if filled is not None:
                axes.fill_between(filled.x, filled.y, color=filled.color, alpha=0.3, lw=0)
            if between is not None:
                axes.fill_between(*between, color=GREEN, alpha=0.25, lw=0)
            mine = [curve for curve in drawn if curve.panel == panel]
            for curve in mine:
                axes.plot(curve.x, curve.y, curve.style, color=curve.color, lw=curve.width, label=curve.label or None)
            x.apply(axes, "x")
            y.apply(axes, "y")
            axes.label_outer()
            if same:
                axes.set_title(f"{title}\n{panel}" if title and panel == panels[0] else panel)
            elif any(curve.label for curve in mine):
                axes.legend(loc="best", title=panel or None, alignment="left")
        if same:
            figure.legend(*all_axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
        else:
            all_axes[0].set_title(title)
    return figure


def colour_map(
    values: Any,
    *,
    x: Axis,
    y: Axis,
    colour: Axis,
    title: str = "",
    contours: Sequence[tuple[Any, Sequence[float], str, str]] = (),
    marks: Sequence[Mark] = (),
    shades: Sequence[tuple[Any, str, str]] = (),
    borders: Sequence[tuple[np.ndarray, np.ndarray]] = (),
) -> Figure:
    """Draw a scalar over a grid of two parameters, one pixel per case.

    Parameters
    ----------
    values : xarray.DataArray with two dimensions, the first along y
    x, y, colour : Axis
    contours : sequence of (values on the same grid, levels, unit, name); unit '' draws lines without numbers
    marks : sequence of Mark
    shades : sequence of (mask on the same grid, colour, name), painted over the colours
    borders : sequence of (x, y), between numbers of impacts
    """
    along_y, along_x = (np.asarray(values[dim], float) for dim in values.dims)
    field = np.ma.masked_invalid(np.asarray(values, float))
    with styled(6.4, 4.6) as figure:
        axes = figure.subplots()
        axes.grid(False)
        edges = _edges(along_x, x.log), _edges(along_y, y.log)
        x.apply(axes, "x")  # scales first: contour labels follow the drawn lines
        y.apply(axes, "y")
        axes.set(xlim=edges[0][[0, -1]], ylim=edges[1][[0, -1]])
        _draw_colours(axes, edges, field, colour)
        handles: list[Any] = []
        for mask, paint, name in shades:
            shown = np.ma.masked_equal(np.asarray(mask, float), 0.0)
            axes.pcolormesh(*edges, shown, cmap=ListedColormap([paint]), vmin=0.0, vmax=1.0, rasterized=True)
            handles.append(Patch(facecolor=paint, edgecolor=GREY, label=name))
        if borders:  # in a colour that is visible on all of the palette
            paths = [np.column_stack(line) for line in borders]
            axes.add_collection(LineCollection(paths, colors=VERMILION, linewidths=0.8, label="borders"))
            handles.append(Line2D([], [], color=VERMILION, lw=0.8, label="the number of impacts changes"))
        for (data, levels, unit, name), style in zip(contours, ("solid", "dashed", "dotted")):
            finer = _finer(along_x, along_y, np.asarray(data, float))
            lines = axes.contour(*finer, levels=levels, colors="white", linewidths=1.0, linestyles=style)
            if unit:
                axes.clabel(lines, fmt={level: EngFormatter(unit=unit, sep=" ")(level) for level in levels}, fontsize=8)
            for part in (lines, *lines.labelTexts):
                part.set_path_effects([HALO])
            handles.append(Line2D([], [], color="white", ls=style, lw=1.0, label=name, path_effects=[HALO]))
        for mark in marks:
            ring: dict[str, Any] = {"ls": "", "marker": "o", "ms": 10, "mfc": "none", "mec": mark.color, "mew": 2.2}
            ring["path_effects"] = [withStroke(linewidth=4.0, foreground="white")]  # visible on dark colours
            axes.plot([mark.x], [mark.y], clip_on=False, **ring)
            handles.append(Line2D([], [], label=mark.label, **ring))
        axes.set_title(title)
        if handles:
            legend = figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=9)
            legend.set_frame_on(True)
            legend.get_frame().set(facecolor="#DDDDDD" if contours else "white", edgecolor="none")
    return figure


def _draw_colours(axes: Any, edges: tuple[np.ndarray, np.ndarray], field: np.ma.MaskedArray, colour: Axis) -> None:
    """Draw the pixels between edges and the bar beside them; of fewer than ten whole numbers, each has its colour."""
    low, high = colour.limits
    low = float(field.min()) if low is None and field.count() else low
    high = float(field.max()) if high is None and field.count() else high
    norm: Any = LogNorm(low, high) if colour.log else Normalize(low, high)
    whole = field.count() and bool((field == field.round()).all()) and not colour.unit and not colour.log
    few = whole and low is not None and high is not None and high - low < 10
    numbers = np.arange(int(low or 0), int(high or 0) + 1.0)
    if few:
        norm = BoundaryNorm([*(numbers - 0.5), numbers[-1] + 0.5], colormaps[SCALE].N)
    image = axes.pcolormesh(*edges, field, norm=norm, cmap=SCALE, rasterized=True)
    bar = axes.figure.colorbar(image, ax=axes, label=colour.label, pad=0.02)
    if colour.log:
        bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    bar.ax.yaxis.set_minor_formatter(NullFormatter())
    bar.ax.yaxis.set_major_formatter(EngFormatter(unit=colour.unit, sep=" ") if colour.unit else "{x:g}")
    if few:
        bar.set_ticks(numbers)
        bar.ax.tick_params(which="both", length=0)
    elif whole:
        bar.ax.yaxis.set_major_locator(MaxNLocator(integer=True))


def _finer(x: np.ndarray, y: np.ndarray, data: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Interpolate positive data (n_y, n_x) linearly in the logarithms, which is exact for power laws."""
    if min(x.min(), y.min(), np.nanmin(data)) <= 0.0 or min(data.shape) < 2:
        return x, y, data
    read = RegularGridInterpolator((np.log(y), np.log(x)), np.log(data))
    parts = [max(1, min(8, 400 // len(v))) for v in (x, y)]  # of each pixel; some 400 along an axis are fine enough
    x, y = (
        np.interp(np.arange(0, len(v) - 1 + 1e-9, 1 / n), np.arange(len(v)), np.log(v)) for v, n in zip((x, y), parts)
    )
    return np.exp(x), np.exp(y), np.exp(read(tuple(np.meshgrid(y, x, indexing="ij"))))


def _edges(centres: np.ndarray, log: bool) -> np.ndarray:
    """Edges of the pixels around ascending values, (n + 1,)."""
    place = np.log(centres) if log else centres
    if len(place) == 1:
        place = place[0] + np.array([-0.5, 0.5]) * (0.1 if log else 0.1 * abs(place[0]) or 1.0)
    else:
        middle = 0.5 * (place[1:] + place[:-1])
        place = np.concatenate([[2 * place[0] - middle[0]], middle, [2 * place[-1] - middle[-1]]])
    return np.exp(place) if log else place


def hammers(found: Sequence[Hammer], bandwidth: float, drop: float = 10.0) -> Figure:
    """Draw the range of tips that work, over the mass of the hammer: computed at the dots, straight in between."""
    found = sorted(found, key=lambda hammer: hammer.mass)
    mass = 1e3 * np.array([hammer.mass for hammer in found])
    hardest = np.array([hammer.hardest or np.nan for hammer in found])
    ended = np.array([hammer.limit for hammer in found])
    softest = np.array([hammer.softest or np.nan for hammer in found])
    wanted = accuracy.resonant_stiffness(mass / 1e3, bandwidth / half_sine_reach(drop))
    drawn = [
        Curve(mass, hardest, "hardest tip that hits once", VERMILION, "o-"),
        Curve(mass, softest, "softest tip that reaches the bandwidth", BLUE, "o-"),
        Curve(mass, wanted, "softest tip on a rigid wall", GREY, "--"),
        Curve(mass, ended, "hardest tip that the model resolves", GREY, ":"),
    ]
    x, y = Axis("mass of the hammer", "g", log=True), Axis("stiffness of the tip", "N/m", log=True)
    title = f"Hammers for {bandwidth:g} Hz at -{drop:g} dB without a double hit"
    return curves(drawn, x=x, y=y, title=title, between=_working(mass, softest, hardest, wanted))


def _working(
    mass: np.ndarray, softest: np.ndarray, hardest: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Masses, and the softest and the hardest tip that work: between two masses straight in the logarithms.

    Beside a mass without such a tip, the softest keeps its ratio to that on a wall, up to where the range closes.
    """
    works = np.isfinite(softest)
    if not works.any():
        return mass, softest, hardest
    log = np.log(mass)
    x = np.unique(np.concatenate([log, np.linspace(log[0], log[-1], 100 * len(log))]))
    ratio = np.interp(x, log[works], np.log(softest / wanted)[works])
    low, high = np.interp(x, log, np.log(wanted)) + ratio, np.interp(x, log, np.log(hardest))
    idle = ~works & ~(hardest < np.exp(np.interp(log, x, low)))  # some other reason: nothing is known beside it
    left = np.clip(np.searchsorted(log, x, side="right") - 1, 0, len(log) - 1)
    right = np.minimum(left + (x > log[left]), len(log) - 1)
    shown = (works[left] | works[right]) & ~idle[left] & ~idle[right] & (low <= high)
    return np.exp(x), np.where(shown, np.exp(low), np.nan), np.where(shown, np.exp(high), np.nan)


def places(
    modes: Modes, groups: Mapping[str, np.ndarray], crossed: Mapping[str, str], sensor: np.ndarray, title: str
) -> Figure:
    """Draw groups of points (n, dimension) [m] on the outline of a body, each in its colour, and a star at the sensor.

    ``crossed`` are markers of groups that are drawn in black.
    """
    _, cells, plane = sampling.surface(modes)
    tall = float(np.ptp(plane[:, 1]) / np.ptp(plane[:, 0]))
    with styled(7.0, 6.0 * min(1.4, max(0.2, tall)) + 1.2) as figure:
        axes = figure.subplots()
        draw_rim(axes, plane, cells)
        flat = {name: np.column_stack([some, np.zeros(len(some))])[:, :2] for name, some in groups.items()}
        painted = [name for name in flat if name not in crossed]
        for name, some in flat.items():
            if name in crossed:
                axes.plot(*some.T, crossed[name], color=BLACK, ms=8, mew=1.8, label=name)
            else:
                i = painted.index(name)
                marker, colour = "o^sD"[i // len(PALETTE) % 4], PALETTE[i % len(PALETTE)]
                axes.plot(*some.T, marker, color=colour, ms=8, label=name)
        axes.plot(*np.append(sensor, 0.0)[:2], "*", color=BLACK, ms=15, mfc="none", mew=1.2)
        axes.autoscale_view()
        axes.margins(0.05)
        axes.set(title=title, xlabel="x", ylabel="y" if modes.dimension == 2 else "")
        set_units(axes, "m", "m")
        if modes.dimension == 1:
            axes.set_yticks([])
        figure.legend(loc="outside lower center", ncols=2)
    return figure


def verdicts(found: Sequence[ReferenceVerdict]) -> Figure:
    """Draw how much of what it may differ each number of the reference cases does, a row for each case."""
    with styled(7.0, 1.2 + 0.19 * len(found)) as figure:
        axes = figure.subplots()
        for row, each in enumerate(found):
            share = [abs(line.difference) / max(line.allowed, np.finfo(float).tiny) for line in each.lines]
            paint = [BLUE if line.holds else VERMILION for line in each.lines]
            axes.scatter(np.maximum(share, 1e-4), np.full(len(share), row), s=14, c=paint, zorder=3)
        axes.axvline(1.0, color=VERMILION, lw=1.0)
        axes.set(xscale="log", xlim=(7e-5, max(2.0, 1.5 * axes.get_xlim()[1])), ylim=(len(found) - 0.5, -0.5))
        axes.set_yticks(range(len(found)), [each.name for each in found], fontsize=8)
        axes.set(xlabel="difference from the reference over what both may err (least shown 1e-4)")
        axes.set_title(f"{sum(each.holds for each in found)} of {len(found)} reference cases hold")
    return figure


def set_ticks(axes: Any, low: float, high: float, log: bool) -> None:
    """Few labels along x, from ``low`` to ``high``, so that none touch; on a logarithmic axis if ``log``."""
    if not log:
        axes.xaxis.set_major_locator(MaxNLocator(TICKS))
        return
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(numticks=TICKS, subs=(1.0, 3.0) if high < 100.0 * low else (1.0,)))
    axes.xaxis.set_major_formatter("{x:.0e}")
    axes.xaxis.set_minor_formatter("")


@check.typed
def spread(found: Spread) -> Figure:
    """A row for each quantity that varies: its distribution, the input that matters most, and shares of inputs."""
    rows = [name for name in found.varying if name != DOUBLE] or ["restitution"]
    with styled(11.0, 0.9 + 1.95 * len(rows)) as figure:
        panels = figure.subplots(len(rows), 3, squeeze=False, width_ratios=(1.1, 1.1, 1.0))
        for (left, middle, right), name in zip(panels, rows):
            _histogram(left, found, name)
            _leading_input(middle, found, name)
            _bars(right, found, name)
        kind = "variance explained (Sobol)" if found.shares else "squared rank correlation"
        for panel, title in zip(panels[0], ("distribution, median, 90 %", "against the leading input, 90 %", kind)):
            panel.set_title(title)
        keys = next((named for panel in panels[:, 2] if (named := panel.get_legend_handles_labels())[0]), None)
        if keys is not None:
            figure.legend(*keys, loc="outside lower right", ncols=2, fontsize=8)  # beside the bars of the same colours
        figure.suptitle(
            f"{markup.literal(found.title or 'Spread')}: {len(found.own)} independent blows; "
            f"double hits: {double_hits(found)}",
            fontsize=11,
        )
    return figure


def _histogram(axes: Any, found: Spread, name: str) -> None:
    values = found.values(name)
    if name == "n_impacts":
        counts = np.arange(values.min(), values.max() + 1.0)
        axes.bar(counts, [100.0 * (values == count).mean() for count in counts], 0.8, color=BLUE)
        axes.xaxis.set_major_locator(MaxNLocator(TICKS, integer=True))
    else:
        low, high = np.quantile(values, (0.001, 0.999))
        weights = np.full(len(values), 100.0 / len(values))
        axes.hist(values, 60, range=(low, high) if low < high else None, color=BLUE, weights=weights)
        for level, style in ((0.05, ":"), (0.5, "-"), (0.95, ":")):
            each = found.quantile(name, level)
            axes.axvline(each.value, color=VERMILION, ls=style, lw=1.2)
            axes.axvspan(each.low, each.high, color=VERMILION, alpha=0.25, lw=0)
        axes.xaxis.set_major_locator(MaxNLocator(TICKS))
    axes.set(xlabel=NAMES[name], ylabel="blows [%]")
    set_units(axes, QUANTITIES[name][0])


def _leading_input(axes: Any, found: Spread, name: str) -> None:
    """The quantity over the input with the largest share."""
    order = found.ranking(name)
    if not order:
        axes.set_axis_off()
        return
    first = order[0][0]
    x, y = found.values(first), found.values(name)
    parts = np.array_split(np.argsort(x, kind="stable"), min(16, max(1, len(x) // 4)))  # of equally many blows
    low, middle, high = np.array([np.quantile(y[part], (0.05, 0.5, 0.95)) for part in parts]).T
    if name == "n_impacts":
        middle = np.array([y[part].mean() for part in parts])
    place = [np.median(x[part]) for part in parts]
    axes.fill_between(place, low, high, color=GREEN, alpha=0.25, lw=0)
    axes.plot(place, middle, color=GREEN)
    unit = found.table[first].attrs["units"]
    axes.set(xlabel=first if unit == "1" else f"{first} [{unit}]", ylabel=NAMES[name])
    axes.xaxis.set_major_locator(MaxNLocator(TICKS))
    axes.xaxis.set_major_formatter(EngFormatter(sep=" ") if np.abs(x).max() >= 1e4 else "{x:g}")
    set_units(axes, y=QUANTITIES[name][0])


def _bars(axes: Any, found: Spread, name: str) -> None:
    """Shares of the inputs, the largest on top."""
    order = found.ranking(name)
    place, shares = np.arange(len(order))[::-1], found.shares.get(name)
    if shares:
        for kind, height, colour in (("total", 0.72, "#BBBBBB"), ("first", 0.4, BLUE)):
            each = [getattr(shares[key], kind) for key, _ in order]
            value, high = 100.0 * np.array([(one.value, one.high) for one in each]).T
            bars: dict[str, Any] = {"xerr": high - value, "ecolor": "#555555", "error_kw": {"lw": 1.0}}
            axes.barh(place, value, height, color=colour, label=f"{kind} order", **bars)
    else:
        axes.barh(place, [100.0 * share for _, share in order], 0.6, color=BLUE)
    names = [key if len(key) <= 26 else f"{key[:26]}..." for key, _ in order]  # so long a name fits beside its bar
    axes.set_yticks(place, names, fontsize=8)
    axes.set(xlim=(0.0, 105.0), xlabel="[%]")
    axes.grid(False, axis="y")
