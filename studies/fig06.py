"""Figure 6: spectra of the half sine for contact resonances of 300 and 1500 Hz."""

import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact import charts
from fem_impact.integrator import Touch

RESONANCES = {300.0: charts.VERMILION, 1500.0: charts.BLACK}  # [Hz]
MASS, SPEED = 0.05, 1.0  # [kg], [m/s] chosen
FREQUENCIES = np.linspace(0.0, 8e3, 1601)  # [Hz]


def compute(mass=MASS, speed=SPEED):
    """Level [dB] of the computed pulse's spectrum for each contact resonance, and that of the formula."""
    result = {}
    for resonance in RESONANCES:
        law = fi.Contact.linear(mass * (2.0 * np.pi * resonance) ** 2)
        hit = fi.collide([fi.Modes.rigid(mass)], [Touch(law, 0, None)], speeds=[speed], tolerance=1e-6)
        with np.errstate(divide="ignore"):
            formula = 20.0 * np.log10(fi.spectra.half_sine_spectrum(FREQUENCIES, resonance))
        result[resonance] = source.decibels(hit.spectrum(FREQUENCIES)), formula
    return result


def reach(level, drop):
    """Frequency [Hz] at which a level first falls ``drop`` [dB]."""
    return FREQUENCIES[np.argmax(level < -drop)]


def draw(result):
    """Both levels over frequency."""
    drawn = [
        charts.Curve(FREQUENCIES, level, f"contact resonance {resonance:g} Hz", RESONANCES[resonance])
        for resonance, (level, _) in result.items()
    ]
    axis = charts.Axis("frequency", "Hz", limits=(0.0, FREQUENCIES[-1]))
    figure = charts.curves(drawn, x=axis, y=source.LEVEL, title="A stiffer or lighter hammer reaches higher")
    columns = {"frequency [Hz]": FREQUENCIES}
    return figure, columns | {f"level at {resonance:g} Hz [dB]": level for resonance, (level, _) in result.items()}


if __name__ == "__main__":
    source.run("fig06", compute, draw)
