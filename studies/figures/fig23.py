"""Figure 23: spectra of figure 21; the lighter the plate, the shallower the dips."""

import fig21
import numpy as np
import source_scenes as source

from fem_impact.show import plots

FREQUENCIES = np.linspace(0.0, 3e3, 1501)  # [Hz]


def levels(hits, frequencies):
    """Spectrum level [dB] of each blow."""
    return {name: source.decibels(hit.spectrum(frequencies)) for name, hit in hits.items()}


def compute():
    """Levels of the three blows of figure 21."""
    return levels(fig21.compute(), FREQUENCIES)


def draw(result, frequencies=FREQUENCIES, title="Spectra of the pulses of figure 21"):
    """Draw the levels over frequency, the ragged one as a thin line behind the others."""
    drawn = [
        plots.Curve(frequencies, level, f"plate of {name}", source.PLATE_COLORS[name], width=width)
        for (name, level), width in zip(result.items(), (1.5, 1.5, 0.9))
    ]
    axis = plots.Axis("frequency", "Hz", limits=(0.0, frequencies[-1]))
    columns = {"frequency [Hz]": frequencies} | {f"level, {name} [dB]": level for name, level in result.items()}
    return plots.curves(drawn[::-1], x=axis, y=source.LEVEL, title=title), columns


if __name__ == "__main__":
    source.run("fig23", compute, draw)
