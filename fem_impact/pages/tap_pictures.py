"""Pictures of measured taps: pulses, spectra, frequency responses and coherence, for pages and for a watched folder."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ..modes.picked import FELT
from ..show.style import BLUE, GREEN, GREY, PALETTE, SKY, VERMILION, panels, set_units
from ..taps.records import Taps
from ..taps.transfer import METHODS, frf

SHOWN = 10  # [-] taps, or responses, of a picture at most: a screen holds no more
Part = Callable[[Any], None]  # draws in given axes


def draw_pulses(axes: Any, taps: Taps, which: Sequence[int]) -> None:
    """The force of some taps, from just before to some time after their pulses; pulses of double hits are marked."""
    for n, i in enumerate(which):
        pulses = taps.pulses[i]
        if not pulses:
            continue
        first, last = pulses[0][0], pulses[-1][1]
        span = slice(max(0, first - (last - first)), last + 3 * (last - first))
        axes.plot(taps.time[span] - taps.time[first], taps.force[i, span], color=PALETTE[n % len(PALETTE)], lw=1.0,
                  label=f"{taps.labels[i]}{': double hit' * (len(pulses) > 1)}")  # fmt: skip
        for begin, end in pulses if len(pulses) > 1 else ():
            top = begin + int(taps.force[i, begin:end].argmax())
            axes.plot(taps.time[top] - taps.time[first], taps.force[i, top], "v", color=VERMILION, ms=7)
    axes.set(xlabel="time after the tap begins", ylabel="force")
    set_units(axes, "s", "N")
    axes.legend(fontsize=8)


def draw_spectra(axes: Any, taps: Taps, which: Sequence[int], bandwidth: float | None, drop: float) -> None:
    """Force spectra of some taps over their values at 0 Hz; those of double hits are dashed."""
    frequency = np.fft.rfftfreq(taps.force.shape[1], 1.0 / taps.rate)
    for n, i in enumerate(which):
        size = np.abs(np.fft.rfft(taps.force[i]))
        level = 20.0 * np.log10(np.maximum(size, 1e-9 * size.max()) / max(size[0], 1e-300))
        axes.plot(frequency, level, "--" if taps.n_pulses[i] > 1 else "-", color=PALETTE[n % len(PALETTE)], lw=0.9,
                  label=taps.labels[i])  # fmt: skip
    if bandwidth is not None:
        axes.plot([0.0, bandwidth, bandwidth], [-drop, -drop, 6.0], color=GREY, lw=1.2)
        axes.set_xlim(0.0, min(0.5 * taps.rate, 2.5 * bandwidth))
    axes.set(xlabel="frequency", ylabel="force spectrum [dB]", ylim=(-50.0, 6.0))
    set_units(axes, "Hz")


def draw_responses(axes: Any, found: Mapping[str, xr.Dataset], channel: int) -> None:
    """Magnitudes of one channel by several estimators; the last one with the radius of its error."""
    colours = dict(zip(METHODS, (BLUE, VERMILION, GREEN)))
    for method, each in found.items():
        size, frequency = np.abs(each.H.values[1:, channel]), each.frequency.values[1:]
        axes.semilogy(frequency, np.maximum(size, 1e-300), color=colours[method], lw=0.9, label=method)
    if "error" in each and np.isfinite(each.error.values[1:, channel]).any():
        error = each.error.values[1:, channel]
        low, high = np.maximum(size - error, 0.03 * size), size + error
        axes.fill_between(frequency, low, high, color=SKY, alpha=0.3, lw=0, label="90 % of the last")
    axes.set(xlabel="frequency", ylabel=f"response [{each.units.values[channel]}]", xlim=(0.0, highest_drawn(each)))
    axes.set_title(str(each.channel.values[channel]))
    set_units(axes, "Hz")
    axes.legend(fontsize=8)


def highest_drawn(found: xr.Dataset) -> float:
    """Frequency [Hz] up to which responses are drawn: a little beyond where the force is felt."""
    last = float(found.frequency.values[-1])
    if "force" not in found:
        return last
    force = found.force.values
    return min(last, 1.25 * float(found.frequency.values[np.flatnonzero(force >= FELT * force.max())[-1]]))


def draw_coherence(axes: Any, found: xr.Dataset, channels: Sequence[int]) -> None:
    """Coherence of some channels."""
    for n, k in enumerate(channels):
        axes.plot(found.frequency.values, found.coherence.values[:, k], color=PALETTE[n % len(PALETTE)], lw=0.9,
                  label=str(found.channel.values[k]))  # fmt: skip
    axes.set(xlabel="frequency", ylabel="coherence", xlim=(0.0, highest_drawn(found)), ylim=(0.0, 1.03))
    set_units(axes, "Hz")
    axes.legend(fontsize=8)


def figure_of_record(last: Taps, good: Taps | None, bandwidth: float, drop: float, said: str) -> Any:
    """The last record beside what the good ones give so far: a matplotlib figure."""
    found = frf(good) if good is not None and good.response.shape[2] else None
    parts: list[Part] = [
        lambda axes: draw_pulses(axes, last, range(min(SHOWN, last.n_taps))),
        lambda axes: draw_spectra(axes, last, range(min(SHOWN, last.n_taps)), bandwidth, drop),
    ]
    if found is not None:
        parts.append(lambda axes: draw_responses(axes, {"H1": found}, 0))
        if found.averages > 1:  # of one tap it is 1 everywhere
            parts.append(lambda axes: draw_coherence(axes, found, [0]))
    title = said if found is None else f"{said}; responses of {found.averages} good taps"
    return draw_panels(parts, 2, 5.0, 3.2, title)


def draw_panels(parts: Sequence[Part], columns: int, width: float, height: float, title: str = "") -> Any:
    """Several pictures beside and below each other: a matplotlib figure."""
    with panels(len(parts), columns, width, height) as (figure, all_axes):
        for axes, draw in zip(all_axes, parts):
            draw(axes)
        if title:
            figure.suptitle(title, fontsize=10)
    return figure
