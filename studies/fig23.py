"""Figure 23: spectra of figure 21; the lighter the plate, the shallower the dips."""

import fig21
import numpy as np
import source_scenes as source

from fem_impact import charts

FREQUENCIES = np.linspace(0.0, 3e3, 1501)  # [Hz]


def levels(hits, frequencies):
    """Level [dB] of each blow's spectrum."""
    return {name: source.decibels(hit.spectrum(frequencies)) for name, hit in hits.items()}


def compute():
    """Levels of the three blows of figure 21."""
    return levels(fig21.compute(), FREQUENCIES)


def draw(result, frequencies=FREQUENCIES, title="Spectra of the pulses of figure 21"):
    """Levels over frequency, the ragged one thin and behind the others."""
    drawn = [
        charts.Curve(frequencies, level, f"plate of {name}", source.PLATE_COLORS[name], width=width)
        for (name, level), width in zip(result.items(), (1.5, 1.5, 0.9))
    ]
    axis = charts.Axis("frequency", "Hz", limits=(0.0, frequencies[-1]))
    columns = {"frequency [Hz]": frequencies} | {f"level, {name} [dB]": level for name, level in result.items()}
    return charts.curves(drawn[::-1], x=axis, y=source.LEVEL, title=title), columns


if __name__ == "__main__":
    source.run("fig23", compute, draw)
