"""Plots of a blow in one style: safe for colour-blind readers, SI units on every axis, no screen needed."""

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation

from .._base import check, markup
from .._base.files import replacing
from .._base.rounding import SAME
from ..impact import spectra
from ..impact.measured import Comparison
from ..impact.response import Response
from ..mesh import edge_table
from ..mesh.mesh_files import quarter_triangles
from ..mesh.meshes import Mesh
from ..model.playing import Strokes
from ..modes.modal import Modes
from ..modes.viewing import rib_sides
from . import sampling
from .canvas import COLOURS, VERMILION
from .style import BLUE, ENDINGS, GREEN, GREY, PALETTE, SKY, STYLE, draw_rim, open_figure, panels, set_units

if TYPE_CHECKING:
    from ..sweeps.spreads import Spread

SPECTRUM_BAND = (10.0, 20e3)  # [Hz] default band: about what people hear
SPECTRUM_POINTS = 1200  # [-] frequencies in a spectrum: about one per pixel
SPECTRUM_DEPTH = 1e-4  # [-] bottom of the spectrum axis: 80 dB below the largest value; of energies its square
TICKS = 4  # [-] most intervals between numbers below a narrow panel
NAMES = {  # quantity of a blow: its name in a picture
    "n_impacts": "number of impacts",
    "contact_time": "contact time",
    "restitution": "restitution",
    "impulse": "impulse",
    "peak_force": "peak force",
    "centroid": "spectral centroid",
}
MARGIN = 0.1  # [-] time shown before and after the blow, over its duration


def styled(width: float, height: float) -> AbstractContextManager[Figure]:
    """A figure of a size [inch], drawn in `STYLE` inside the block."""
    return open_figure(width, height)


@check.typed
def save(path: str | Path, figure: Figure) -> None:
    """Write a figure; the ending of the path sets the format (.png, .pdf, .svg)."""
    check.ending(path, *ENDINGS)
    with matplotlib.rc_context(STYLE), replacing(path) as temporary:
        figure.savefig(temporary)


@check.typed
def force(response: Response | Strokes, *, band: tuple[float, float] = SPECTRUM_BAND) -> Figure:
    """Plot the contact force over time, and the magnitude of its spectrum over frequency.

    Parameters
    ----------
    response : Response or Strokes
    band : (low, high) [Hz] of the spectrum shown

    Returns
    -------
    matplotlib.figure.Figure
        Contacts are shaded and numbered; ticks at the bottom of the spectrum mark the modes of the struck body.
    """
    low, high = check.band("band", band, "Hz")
    with styled(7.0, 6.0) as figure:
        above, below = figure.subplots(2, 1)
        start, end = response.time[0], response.time[-1]
        if response.impacts:
            start, end = response.impacts[0].start, sampling.last_release(response)
        room, several, most = MARGIN * (end - start), response.force.ndim == 2, 20  # numbers that do not overlap
        names = [f"contact {i}" for i in range(response.force.shape[1])] if several else None
        above.plot(response.time, response.force, label=names)
        if several and len(names or ()) <= most:
            above.legend(loc="upper right")
        inner: dict[str, Any] = {"xycoords": above.get_xaxis_transform(), "ha": "center", "va": "top"}
        for number, impact in enumerate(response.impacts, 1):
            above.axvspan(impact.start, impact.end, color=SKY, alpha=0.2, lw=0)
            if response.n_impacts <= most:
                above.annotate(str(number), (0.5 * (impact.start + impact.end), 0.97), color="#555555", **inner)
        above.set(xlim=(start - room, end + room), xlabel="time", ylabel="contact force", title="Contact force")
        above.set_ylim(0.0, 1.15 * (response.peak_force or 1.0))  # leaves room for the numbers
        set_units(above, "s", "N")
        frequencies = np.geomspace(low, high, SPECTRUM_POINTS)
        size = np.abs(response.spectrum(frequencies))
        top = float(size.max(initial=0.0)) or 1.0
        below.loglog(frequencies, np.maximum(size, 0.1 * SPECTRUM_DEPTH * top))
        below.set(xlim=(low, high), ylim=(SPECTRUM_DEPTH * top, 2.0 * top))
        below.set(xlabel="frequency", ylabel="force spectrum [N s]", title="Spectrum of the force")
        set_units(below, "Hz")
        marks: dict[str, Any] = {"color": GREEN, "ms": 9.0, "transform": below.get_xaxis_transform(), "clip_on": True}
        natural = response.target.frequencies
        below.plot(natural, np.zeros(len(natural)), "|", label="modes of the struck body", **marks)
        below.legend(loc="lower left")
    return figure


@check.typed
def energies(response: Response) -> Figure:
    """Plot the energy of striker and struck body, or of each body, during the blow, and the rest: stored or lost."""
    end, n = sampling.last_release(response) or 1.0, len(response.bodies)
    times = np.linspace(0.0, (1.0 + MARGIN) * end, 800)
    names = ["striker", "struck body"] if n == 2 else [f"body {i}" for i in range(n)]
    with styled(7.0, 3.6) as figure:
        axes = figure.subplots()
        for name, part in zip([*names, "contact and losses"], sampling.energies(response, times)):
            axes.plot(times, part, label=name)
        axes.set(xlim=(0.0, times[-1]), xlabel="time", ylabel="energy", title="Energy during the blow")
        set_units(axes, "s", "J")
        axes.legend(loc="best")
    return figure


@check.typed
def mode_energies(response: Response) -> Figure:
    """Plot the energy of each mode of the struck body when the striker leaves, over its frequency."""
    energy = response.modal_energy([sampling.last_release(response)])[0]
    shown = (response.target.omega > 0.0) & (energy > 0.0)
    top = float(energy[shown].max(initial=0.0)) or 1.0
    with styled(7.0, 3.6) as figure:
        axes = figure.subplots()
        foot = SPECTRUM_DEPTH**2 * top
        axes.vlines(response.target.frequencies[shown], foot, energy[shown], lw=2.0, color=BLUE)
        axes.set(xscale="log", yscale="log", ylim=(foot, 3.0 * top))
        axes.set(xlabel="natural frequency", ylabel="energy", title="Energy of each mode after the blow")
        set_units(axes, "Hz", "J")
    return figure


@check.typed
def mobility(modes: Modes, at: Any, to: Any = None, *, band: tuple[float, float] | None = None) -> Figure:
    """Plot magnitude and phase of the velocity at ``to`` per force at ``at``, over frequency.

    Parameters
    ----------
    modes : Modes
    at, to : point of the force and of the velocity, (dimension,) [m]; the same point by default
    band : (low, high) [Hz], optional
        By default from half the first flexible frequency to the highest kept one.

    Returns
    -------
    matplotlib.figure.Figure
    """
    flexible = modes.frequencies[modes.omega > 0.0]
    if band is None:
        if not flexible.size:
            raise ValueError("band must be given for a body without flexible modes, in Hz")
        band = (0.5 * float(flexible[0]), float(flexible[-1]))
    low, high = check.band("band", band, "Hz")
    grid = np.geomspace(low, high, SPECTRUM_POINTS)
    frequencies = np.union1d(grid, flexible[(flexible > low) & (flexible < high)] * (1.0 + 1e-6))  # misses no peak
    value = spectra.mobility(
        modes, modes.point("at", at), modes.point("at" if to is None else "to", at if to is None else to), frequencies
    )
    with styled(7.0, 5.0) as figure:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        above.loglog(frequencies, np.abs(value))
        above.set(ylabel="mobility [m/(N s)]", title="Mobility", xlim=(low, high))
        below.semilogx(frequencies, np.angle(value, deg=True))
        below.set(ylabel="phase [degrees]", xlabel="frequency", ylim=(-190, 190), yticks=(-180, -90, 0, 90, 180))
        set_units(below, "Hz")
    return figure


@check.typed
def mode_shapes(modes: Modes, *, count: int = 12, columns: int = 4) -> Figure:
    """Draw the first mode shapes as small pictures with nodal lines, each under its frequency.

    Parameters
    ----------
    modes : Modes of a plate or a beam
    count : int
        Largest number of modes.
    columns : int

    Returns
    -------
    matplotlib.figure.Figure
    """
    points, cells = sampling.grid(modes)
    shapes, columns = sampling.gallery(modes, points, count, columns)
    with panels(shapes.shape[1], columns, 2.2, 1.9) as (figure, all_axes):
        for i, (axes, shape) in enumerate(zip(all_axes, shapes.T)):
            if modes.dimension == 1:
                order = np.argsort(points[:, 0])
                axes.plot(points[order, 0], shape[order])
                axes.axhline(0.0, color=GREY, lw=0.6)
                axes.set(ylim=(-1.1, 1.1), yticks=[], xlabel="x [m]" if i >= len(all_axes) - columns else "")
            else:
                axes.tripcolor(*points.T, cells, shape, cmap=COLOURS, vmin=-1, vmax=1, shading="gouraud")
                nodal = _without_zeros(shape, cells)
                axes.tricontour(*points.T, cells, nodal, levels=[0.0], colors="black", linewidths=0.8)
                _draw_edges(axes, modes, points, cells)
            axes.set_title(f"{i + 1}   {in_hertz(modes.frequencies[i])}")
    return figure


def chladni(modes: Modes, count: int, columns: int) -> Figure:
    """Draw the nodal lines as `pictures.chladni` describes."""
    check.between("dimension of modes", modes.dimension, 2, 2)
    if modes.n_rigid == modes.n_modes:
        raise ValueError("modes must have a flexible mode: a rigid motion has no Chladni figure")
    points, cells = sampling.grid(modes)
    cells, sides = quarter_triangles(cells, len(points))  # finer triangles make smooth lines
    points = np.concatenate([points, points[sides].mean(axis=1)])
    shapes, columns = sampling.gallery(modes, points, count, columns, first=modes.n_rigid)
    tall = min(1.6, max(0.4, float(np.ptp(points[:, 1]) / np.ptp(points[:, 0]))))
    sand = 1e-3  # of the largest deflection: along a clamped edge the elements err by less
    with panels(shapes.shape[1], columns, 2.0, 2.0 * tall + 0.35) as (figure, all_axes):
        for i, (axes, shape) in enumerate(zip(all_axes, shapes.T), modes.n_rigid):
            mesh = Triangulation(points[:, 0], points[:, 1], cells, np.abs(shape[cells]).max(axis=1) < sand)
            axes.tricontour(mesh, _without_zeros(shape, cells, sand), levels=[0.0], colors="black")
            _draw_edges(axes, modes, points, cells)
            axes.autoscale_view()
            axes.set_title(f"{i + 1}   {in_hertz(modes.frequencies[i])}")
    return figure


def _draw_edges(axes: Any, modes: Modes, points: np.ndarray, cells: np.ndarray) -> None:
    """Draw the rim and the ribs of a plate as lines, without axes."""
    draw_rim(axes, points, cells)
    axes.set_axis_off()
    axes.add_collection(LineCollection(points[rib_sides(modes, points, cells)], colors=GREEN, linewidths=1.2))


def snapshot(plane: np.ndarray, cells: np.ndarray, deflection: np.ndarray, at: np.ndarray, title: str) -> Figure:
    """Draw the deflection of a surface at one instant in colour, from -1 to 1, and mark the strike point.

    Parameters
    ----------
    plane : ndarray, shape (n_points, 2) [m]
    cells : ndarray, shape (n_cells, 3)
    deflection : ndarray, shape (n_points,) [-]
    at : ndarray, shape (dimension,) [m]
    title : str
    """
    with styled(7.2, 4.8) as figure:
        axes: Any = figure.subplots()
        axes.tripcolor(*plane.T, cells, deflection, cmap=COLOURS, vmin=-1, vmax=1, shading="gouraud")
        draw_rim(axes, plane, cells)
        axes.plot(at[0], at[1] if len(at) > 1 else 0.0, "o", mfc="none", mec=VERMILION, mew=2.0, ms=9.0)
        axes.set_title(title)
        axes.set_axis_off()
    return figure


def in_hertz(value: float, digits: int = 4) -> str:
    """A frequency [Hz] with its unit; in kHz from where its digits before the point are more than asked for."""
    return f"{value:.{digits}g} Hz" if value < 10.0**digits else f"{value * 1e-3:.{digits}g} kHz"


def _without_zeros(shape: np.ndarray, cells: np.ndarray, flat: float = SAME) -> np.ndarray:
    """The shape (n_points,), with zeros replaced by a tiny share of the values around them.

    A supported edge is zero up to rounding; without this, parts of it would be drawn as nodal lines.
    """
    total = np.bincount(cells.ravel(), np.repeat(shape[cells].sum(axis=1), 3), len(shape))
    return np.where(np.abs(shape) < flat, SAME * total, shape)


@check.typed
def edges(mesh: Mesh) -> Figure:
    """Draw the elements of a mesh and its named edges, each in its colour; of edges that coincide, the first.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    matplotlib.figure.Figure
    """
    low, size = mesh.points.min(axis=0), np.ptp(mesh.points, axis=0)
    with styled(7.0, 7.0 * min(1.4, max(0.35, size[1] / size[0])) + 0.6 if mesh.dimension == 2 else 2.2) as figure:
        axes = figure.subplots()
        x, y = mesh.points.T if mesh.dimension == 2 else (mesh.points[:, 0], np.zeros(len(mesh.points)))
        if mesh.dimension == 2:
            axes.triplot(x, y, mesh.cells, color="#CCCCCC", lw=0.4)
            axes.set_aspect("equal")
        else:
            axes.plot(np.sort(x), y, "|-", color=GREY)
            axes.set_yticks([])
        drawn: set[int] = set()
        for edge in edge_table.edges(mesh):
            facets = [int(i) for i in mesh.edges[edge.name] if int(i) not in drawn]
            if not facets:
                continue
            drawn |= set(facets)
            middles = np.column_stack([mesh.middles[facets], np.zeros(len(facets))])[:, :2]
            if mesh.dimension == 2:
                ends = mesh.points[mesh.facets[facets]]
                lines = np.stack([ends[:, 0], middles, ends[:, 1]], axis=1)  # (n_facets, 3, 2)
                colour = PALETTE[len(axes.collections) % len(PALETTE)]
                axes.add_collection(
                    LineCollection(list(lines), colors=colour, linewidths=2.5, label=markup.literal(edge.name))
                )
            else:
                axes.plot(*middles.T, "o", ms=8, label=markup.literal(edge.name))
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        axes.set(xlabel="x", ylabel="y" if mesh.dimension == 2 else "")
        axes.set_xlim(low[0] - MARGIN * size[0] / 2, low[0] + (1.0 + MARGIN / 2) * size[0])
        axes.xaxis.set_major_locator(MaxNLocator(TICKS + 1))
        set_units(axes, "m", "m" if mesh.dimension == 2 else "")
    return figure


def spread(found: "Spread") -> Figure:
    """Plot what uncertain inputs do: a row for each quantity that varies, at most one page.

    Parameters
    ----------
    found : Spread

    Returns
    -------
    matplotlib.figure.Figure
        From left to right: the distribution with its median and 90 % range, each with its interval; the quantity over
        the input that matters most, median (of impacts the mean) and 90 % range; and the share of the variance that
        each input takes part in, with first-order Sobol indices in front of the total ones.
    """
    from . import plots  # loads libraries that no other figure needs

    return plots.spread(found)


@check.typed
def against(found: Comparison) -> Figure:
    """Plot measured numbers, and forces less their predictions, beside the bands; what is outside is red.

    Parameters
    ----------
    found : Comparison, of `Response.against`, `fi.band` or a fit

    Returns
    -------
    matplotlib.figure.Figure
    """
    columns = min(3, len(found.traces))
    rows = -(-len(found.traces) // columns) if columns else 0
    tall = 1.1 + 0.3 * len(found.verdicts)
    with styled(6.4 if columns < 3 else 9.0, tall + 2.2 * rows) as figure:
        grid = figure.add_gridspec(rows + 1, columns or 1, height_ratios=[*[2.2] * rows, tall])
        for i, trace in enumerate(found.traces):
            axes = figure.add_subplot(grid[i // columns, i % columns])
            axes.fill_between(trace.time, -trace.band, trace.band, color=SKY, lw=0)
            for some, colour in ((trace.inside, "black"), (~trace.inside, VERMILION)):
                own: dict[str, Any] = {"yerr": trace.error[some], "fmt": ".", "ms": 3.0, "elinewidth": 0.4}
                axes.errorbar(trace.time[some], trace.residual[some], color=colour, **own)
            axes.set_title(f"{markup.literal(trace.name)}: {100.0 * trace.inside.mean():.0f} % inside")
            if i % columns == 0:
                axes.set_ylabel("measured less predicted")
            axes.xaxis.set_major_locator(MaxNLocator(TICKS))
            set_units(axes, "s", "N")
        _bands(figure.add_subplot(grid[rows, :]), found)
    return figure


def _bands(axes: Any, found: Comparison) -> None:
    """Bands and measured numbers, a row for each, over the measured number."""
    for row, each in enumerate(found.verdicts):
        value, place = each.point.value, len(found.verdicts) - 1 - row
        low, middle, high = (100.0 * (x / value - 1.0) for x in (each.low, each.middle, each.high))
        names = ("predicted band", "predicted", "measured") if not row else (None, None, None)
        axes.barh(place, high - low, left=low, height=0.55, color=SKY, label=names[0])
        axes.plot([middle] * 2, [place - 0.27, place + 0.27], color=BLUE, label=names[1])
        own: dict[str, Any] = {"xerr": 100.0 * each.own_width, "color": "black" if each.inside else VERMILION}
        axes.errorbar(0.0, place, fmt="o", markersize=4.0, capsize=3.0, label=names[2], **own)
    axes.set_yticks(range(len(found.verdicts)), [markup.literal(each.point.name) for each in reversed(found.verdicts)])
    axes.set(xlabel="difference from the measured number [%]", title=markup.literal(found.title))
    axes.grid(axis="y", visible=False)
    axes.use_sticky_edges = False
    axes.margins(x=0.05)
    axes.locator_params(axis="x", nbins=6)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
