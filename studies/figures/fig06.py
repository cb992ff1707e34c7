"""Figure 6: spectra of the half sine for contact resonances of 300 and 1500 Hz."""

import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact.impact.collision import Touch
from fem_impact.show import plots

RESONANCES = {300.0: plots.VERMILION, 1500.0: plots.BLACK}  # [Hz]
MASS, SPEED = 0.05, 1.0  # [kg], [m/s] chosen
FREQUENCIES = np.linspace(0.0, 8e3, 1601)  # [Hz]


def compute(mass=MASS, speed=SPEED):
    """Spectrum level [dB] of the computed pulse and of the formula, for each contact resonance."""
    result = {}
    for resonance in RESONANCES:
        law = fi.Contact.linear(mass * (2.0 * np.pi * resonance) ** 2)
        hit = fi.collide([fi.Modes.rigid(mass)], [Touch(law, 0, None)], speeds=[speed], tolerance=1e-6)
        with np.errstate(divide="ignore"):
            formula = 20.0 * np.log10(fi.spectra.half_sine_spectrum(FREQUENCIES, resonance))
        result[resonance] = source.decibels(hit.spectrum(FREQUENCIES)), formula
    return result


def reach(level, drop):
    """Frequency [Hz] at which a level has first fallen by ``drop`` [dB]."""
    return FREQUENCIES[np.argmax(level < -drop)]


def draw(result):
    """Draw both levels over frequency."""
    drawn = [
        plots.Curve(FREQUENCIES, level, f"contact resonance {resonance:g} Hz", RESONANCES[resonance])
        for resonance, (level, _) in result.items()
    ]
    axis = plots.Axis("frequency", "Hz", limits=(0.0, FREQUENCIES[-1]))
    figure = plots.curves(drawn, x=axis, y=source.LEVEL, title="A stiffer or lighter hammer reaches higher")
    columns = {"frequency [Hz]": FREQUENCIES}
    return figure, columns | {f"level at {resonance:g} Hz [dB]": level for resonance, (level, _) in result.items()}


if __name__ == "__main__":
    source.run("fig06", compute, draw)
