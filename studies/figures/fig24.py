"""Figure 24: spectra of figure 22; several impacts make the spectrum ragged, and lighter plates have shallower dips."""

import fig22
import fig23
import numpy as np
import source_scenes as source

FREQUENCIES = np.linspace(0.0, 5e3, 1251)  # [Hz]


def compute():
    """Levels of the three blows of figure 22."""
    return fig23.levels(fig22.compute(), FREQUENCIES)


def draw(result):
    """Draw the levels over frequency."""
    return fig23.draw(result, FREQUENCIES, "Spectra of the pulses of figure 22")


if __name__ == "__main__":
    source.run("fig24", compute, draw)
