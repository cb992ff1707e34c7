"""One page about frequency responses: taps, H1, H2, Hv, coherence, poles and residues, stabilisation, MAC, shapes."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial import Delaunay, QhullError

from .._base import check
from .._base.explained import lines_of_notes
from .._base.known import NINETY
from ..mesh.mesh_files import sides_of
from ..modes import picked, stabilisation
from ..modes.modal import Modes
from ..show import figures
from ..show.style import BLUE, GREY, VERMILION, panels, set_units
from ..taps import transfer, watch
from ..taps.records import Taps
from . import tap_pictures
from .html_page import picture_uri, script_data, write_page

COMPARED = 40  # [-] computed modes that measured ones may belong to: twice as many as fit a picture
CHANNELS = 6  # [-] channels that have a picture and a column of residues: more do not fit a screen


def figure_of_poles(chart: stabilisation.Chart, found: xr.Dataset, modes: picked.Picked) -> Any:
    """Poles over frequency and order of the model, the mean response behind them: a matplotlib figure."""
    with panels(1, 1, 7.2, 3.8) as (figure, (axes,)):
        for some, colour, label in ((~chart.stable, GREY, "new"), (chart.stable, BLUE, "stable")):
            axes.plot(chart.frequency[some], chart.order[some], "o" if label == "stable" else "x", color=colour, ms=3.5,
                      label=label)  # fmt: skip
        for n, one in enumerate(modes.frequencies):
            axes.axvline(one, color=VERMILION, lw=0.8, ls="--", label="modes of the table" if n == 0 else None)
        axes.set(xlabel="frequency", ylabel="order of the model")
        behind = axes.twinx()
        size = np.sqrt(np.square(np.abs(found.H.values[1:])).mean(axis=1))
        behind.semilogy(found.frequency.values[1:], np.maximum(size, 1e-300), color=GREY, lw=0.7, alpha=0.7)
        behind.set_yticks([])
        behind.minorticks_off()
        axes.set_xlim(0.0, 1.1 * float(chart.frequency.max(initial=modes.frequencies.max())))
        set_units(axes, "Hz")
        axes.legend(fontsize=8, loc="upper right")
    return figure


def figure_of_mac(values: np.ndarray, measured: np.ndarray, computed: np.ndarray) -> Any:
    """MAC (n_measured, n_computed) of measured and computed shapes as a table of colours: a matplotlib figure."""
    with panels(1, 1, 1.8 + 0.42 * len(computed), 1.4 + 0.36 * len(measured)) as (figure, (axes,)):
        shown = axes.imshow(values, vmin=0.0, vmax=1.0, cmap="Blues", aspect="auto")
        for (i, j), value in np.ndenumerate(values):
            if value >= 0.1:
                axes.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=7,
                          color="white" if value > 0.6 else "black")  # fmt: skip
        axes.set_xticks(range(len(computed)), [f"{one:.4g}" for one in computed], rotation=90, fontsize=8)
        axes.set_yticks(range(len(measured)), [f"{one:.4g}" for one in measured], fontsize=8)
        axes.set(xlabel="computed modes [Hz]", ylabel="measured [Hz]")
        axes.grid(False)
        figure.colorbar(shown, label="MAC")
    return figure


def _within(value: float, half: float) -> str:
    """A number and half of its interval, to two digits of that."""
    digits = max(0, 1 - int(np.floor(np.log10(half)))) if half > 0.0 else 3
    return f"{value:.{min(digits, 9)}f} ± {half:.2g}"


def edges(points: np.ndarray) -> list[list[int]]:
    """Pairs of points (n_points, dimension) that are joined in a drawing: neighbours along a line or in triangles."""
    flat = points if points.shape[1] > 1 else np.column_stack([points, np.zeros(len(points))])
    try:
        triangles = Delaunay(flat[:, :2]).simplices
    except (QhullError, ValueError):  # along a line, or too few
        along = np.argsort(flat @ np.linalg.svd(flat - flat.mean(axis=0))[2][0])
        return np.column_stack([along[:-1], along[1:]]).tolist()
    return sides_of(triangles)[0].tolist()


def _moving(modes: picked.Picked, points: np.ndarray) -> str:
    """What the page needs to move measured shapes, as JSON."""
    middle, size = 0.5 * (points.max(axis=0) + points.min(axis=0)), max(float(np.ptp(points, axis=0).max()), 1e-300)
    place = (points - middle) / size
    place = np.column_stack([place, np.zeros((len(place), 2))])[:, :2]
    shapes = modes.products / np.maximum(np.abs(modes.products).max(axis=0), 1e-300)
    names = [f"{one:.5g} Hz" for one in modes.frequencies]
    data = {"points": place, "edges": edges(points), "shapes": shapes.T, "names": names}
    return script_data(data)


@check.typed
def write_responses(
    path: str | Path, found: xr.Dataset, *, title: str = "Frequency responses", taps: Taps | None = None,
    computed: Modes | None = None, points: Any = None,
) -> None:  # fmt: skip
    """Write the page; needs the extra ``web``.

    Parameters
    ----------
    found : xarray.Dataset, as `fi.frf` returns it
    taps : Taps, optional
        Those that it comes from: the page shows them, and all three estimators.
    computed : Modes, optional
        What the measured modes are compared with, at ``points``.
    points : array_like, (n_channels, dimension) [m], optional
        Where each channel is measured, by default as a universal file states it; the page moves the shapes there.
    """
    names, trouble, modes, compared = [str(name) for name in found.channel.values], "", None, {}
    shown = min(CHANNELS, len(names))
    try:
        modes = picked.pick("found", found)
    except ValueError as error:
        trouble = str(error)
    if points is None and "place" in found.coords and np.isfinite(found.place.values).all():
        points = found.place.values
    place = None if points is None else check.array("points", points, (len(names), None), "m")
    pictures = _pictures(found, taps, modes, shown)
    if modes is not None and computed is not None and place is not None:
        compared = _compared(modes, computed, place)
        pictures["mac"] = compared.pop("picture")
    rows, poles, double, notes = [], [], [], list(found.attrs.get("notes", ()))
    if taps is not None:
        notes = [*taps.notes, *notes]
        double = [taps.labels[i] for i in np.flatnonzero(taps.n_pulses > 1)]
        for i, name in enumerate(taps.labels):
            reach, half = watch.reach_of(taps, i), figures.in_hertz(0.5 * taps.rate, 3)
            far = f"beyond {half}" if reach is None else figures.in_hertz(reach, 3)
            good = "; ".join(watch.faults(taps, i)) or "good"
            rows.append((name, f"{taps.peak[i]:.4g} N", str(taps.n_pulses[i]), far, good))
    if modes is not None:  # of each frequency, damping ratio and residues, with 90 % intervals
        values = np.vstack([modes.frequencies, 100.0 * modes.damping_ratio, modes.products[:shown]])
        errors = np.vstack([modes.frequency_errors, 100.0 * modes.damping_errors, modes.errors[:shown]])
        poles = [list(map(_within, *each)) for each in zip(values.T.tolist(), (NINETY * errors).T.tolist())]
        notes += picked.notes_of_delays(found, modes.late)
    write_page(
        path, "frf.html", scripts=("shapes.js",), title=title, trouble=trouble, pictures=pictures,
        unexplained=f"{100.0 * modes.left:.2g} % rms" if modes is not None and modes.left > 0.5 else "",
        channels=names[:shown], n_channels=len(names), double=double,
        taps=rows, notes=lines_of_notes(notes),
        poles=poles, pairs=compared.get("pairs", []),
        moving=_moving(modes, place) if modes is not None and place is not None and len(names) > 1 else "",
        tiles=[
            ("taps averaged", str(found.attrs.get("averages", "not stated"))), ("responses", str(len(names))),
            ("estimator", str(found.attrs.get("method", "as in the file"))),
            ("double hits", ", ".join(double) or "none"),
            ("modes", "0" if modes is None else str(len(modes.frequencies))),
            ("left unexplained", "-" if modes is None else f"{100.0 * modes.left:.2g} % rms"),
        ],
    )  # fmt: skip


def _pictures(found: xr.Dataset, taps: Taps | None, modes: picked.Picked | None, shown: int) -> dict[str, str]:
    """The pictures of the page by name, but for those of computed modes."""

    def drawn(height: float, *parts: tap_pictures.Part) -> str:
        return picture_uri(tap_pictures.draw_panels(parts, 1, 7.2, height))

    own = str(found.attrs.get("method", "H1"))
    estimates = {own: found}
    if taps is not None and not found.attrs.get("added_damping"):  # by every estimator, the one asked for last
        others = {method: transfer.frf(taps, method=method) for method in transfer.METHODS if method != own}
        estimates = others | estimates
    parts = (partial(tap_pictures.draw_responses, found=estimates, channel=i) for i in range(shown))
    pictures = {"responses": drawn(2.6, *parts)}
    if "coherence" in found and found.attrs.get("averages", 2) > 1:  # of one tap it is 1 everywhere
        pictures["coherence"] = drawn(3.0, lambda axes: tap_pictures.draw_coherence(axes, found, range(shown)))
    if taps is not None:
        some = range(min(tap_pictures.SHOWN, taps.n_taps))
        pictures["pulses"] = drawn(3.0, lambda axes: tap_pictures.draw_pulses(axes, taps, some))
        pictures["spectra"] = drawn(3.0, lambda axes: tap_pictures.draw_spectra(axes, taps, some, None, 10.0))
    if modes is not None:
        pictures["stable"] = picture_uri(figure_of_poles(stabilisation.chart(found), found, modes))
    return pictures


def _compared(modes: picked.Picked, computed: Modes, points: np.ndarray) -> dict[str, Any]:
    """Pairs of measured and computed modes, and the picture of the MAC of the first ones."""
    measured = Modes.from_arrays(modes.frequencies, modes.products, points=points, mass=1.0)
    near = np.flatnonzero(computed.omega > 0.0)
    near = near[computed.frequencies[near] <= 1.3 * modes.frequencies[-1]]
    rows = []
    if len(near) >= len(modes.frequencies):
        rows = [
            (f"{pair.measured_frequency:.5g} Hz", f"{pair.computed_frequency:.5g} Hz",
             f"{100 * pair.difference:+.2f} %", f"{pair.mac:.3f}")
            for pair in transfer.matched(measured, computed, points=points)
        ]  # fmt: skip
    some = modes.frequencies[:14]  # of the picture, so few that its numbers can be read, and 18 computed ones
    near = near[computed.frequencies[near] <= 1.1 * some[-1]][:18]
    values = transfer.mac(modes.products[:, : len(some)], computed.shape_at(points)[:, near])
    return {"pairs": rows, "picture": picture_uri(figure_of_mac(values, some, computed.frequencies[near]))}
