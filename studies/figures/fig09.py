"""Figure 9: the Hertz spectrum has a slightly wider main lobe and weaker side lobes at slightly higher frequencies."""

import fig08
import numpy as np
import source_scenes as source

from fem_impact.show import plots

FREQUENCIES = np.linspace(0.0, 4e3, 1601)  # [Hz]


def compute():
    """Spectrum levels [dB] of figure 8: linear, Hertz."""
    return [source.decibels(hit.spectrum(FREQUENCIES)) for hit in fig08.compute()]


def draw(levels):
    """Draw both levels over frequency."""
    drawn = [
        plots.Curve(FREQUENCIES, level, name, color)
        for level, name, color in zip(levels, ("linear", "Hertz"), (plots.VERMILION, plots.BLUE))
    ]
    axis = plots.Axis("frequency", "Hz", limits=(0.0, FREQUENCIES[-1]))
    figure = plots.curves(drawn, x=axis, y=source.LEVEL, title="Spectra of the two pulses of figure 8")
    return figure, {"frequency [Hz]": FREQUENCIES, "linear [dB]": levels[0], "hertz [dB]": levels[1]}


if __name__ == "__main__":
    source.run("fig09", compute, draw)
