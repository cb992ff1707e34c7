"""Figure 9: the Hertz pulse has a slightly wider low band, lobes a little higher up, and lower ones."""

import fig08
import numpy as np
import source_scenes as source

from fem_impact import charts

FREQUENCIES = np.linspace(0.0, 4e3, 1601)  # [Hz]


def compute():
    """Levels [dB] of the spectra of figure 8: linear, Hertz."""
    return [source.decibels(hit.spectrum(FREQUENCIES)) for hit in fig08.compute()]


def draw(levels):
    """Both levels over frequency."""
    drawn = [
        charts.Curve(FREQUENCIES, level, name, color)
        for level, name, color in zip(levels, ("linear", "Hertz"), (charts.VERMILION, charts.BLUE))
    ]
    axis = charts.Axis("frequency", "Hz", limits=(0.0, FREQUENCIES[-1]))
    figure = charts.curves(drawn, x=axis, y=source.LEVEL, title="Spectra of the two pulses of figure 8")
    return figure, {"frequency [Hz]": FREQUENCIES, "linear [dB]": levels[0], "hertz [dB]": levels[1]}


if __name__ == "__main__":
    source.run("fig09", compute, draw)
