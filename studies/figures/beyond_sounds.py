"""Beyond the source: hard heads, light sticks and double hits sound brighter; heavy sticks sound louder."""

import sys
from pathlib import Path

import numpy as np
import source_scenes as source
from scipy.io import wavfile

import fem_impact as fi
from fem_impact.show import plots

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

DAMPING = 0.005  # [-] a wooden plate
SPEED = 2.0  # [m/s] of the tip
LISTEN = (1.085, 0.7)  # [m] observation point: 0.7 of both sides
BLOWS = {  # name: mass of the stick [kg], stiffness of the Hertz contact [N/m^1.5]
    "soft": (0.1, 2e5),
    "hard": (0.1, 5e6),
    "light": (0.02, 7e5),
    "heavy": (0.2, 7e5),
    "single": (0.1, 7e5),
    "double": (0.1, 2e7),
}
PANELS = {"head": ("soft", "hard"), "stick": ("light", "heavy"), "impact": ("single", "double")}
THIRD = 2.0 ** (1.0 / 6.0)  # [-] half a third-octave: from the centre of a band to its edge
BANDS = 50.0 * 2.0 ** (np.arange(25) / 3.0)  # [Hz] band centres
RING = 0.05  # [s] after this all contacts are over and the decay is measured


def compute(duration=1.5, n_modes=150):
    """For each blow: the number of impacts and the samples [m/s] of its sound."""
    modes = source.plate(0.2, damping_ratio=DAMPING).truncated(n_modes=n_modes)
    heard = {}
    for name, (mass, stiffness) in BLOWS.items():
        hit = fi.strike(
            modes, source.stick(mass), fi.Contact.hertz(stiffness), at=source.AT, speed=SPEED, tolerance=1e-3
        )
        heard[name] = hit.n_impacts, fi.sound.synthesise(hit, LISTEN, duration=duration)
    return heard


def level(samples, full_scale=1.0):
    """RMS level in dB."""
    return 20.0 * np.log10(np.sqrt(np.mean(samples**2)) / full_scale)


def centroid(samples, rate):
    """Spectral centroid [Hz]: mean frequency, weighted by energy."""
    power = np.abs(np.fft.rfft(samples)) ** 2
    return float(np.fft.rfftfreq(len(samples), 1.0 / rate) @ power / power.sum())


def bands(samples, rate):
    """Levels [dB] in third-octave bands."""
    power = np.abs(np.fft.rfft(samples) / len(samples)) ** 2
    frequencies = np.fft.rfftfreq(len(samples), 1.0 / rate)
    inside = (frequencies > BANDS[:, None] / THIRD) & (frequencies <= BANDS[:, None] * THIRD)
    return 10.0 * np.log10(np.maximum(2.0 * inside @ power, 1e-14))


def decay_time(samples, rate, frequency):
    """Time [s] in which a mode decays by 60 dB, from its amplitude in an early and a late window."""
    n = round(10 * rate / frequency)
    starts = round(RING * rate), len(samples) - n
    turns = np.exp(-2j * np.pi * frequency * np.arange(n) / rate) * np.hanning(n)
    first, last = (abs(samples[start : start + n] @ turns) for start in starts)
    return float(np.log(1e3) * (starts[1] - starts[0]) / rate / np.log(first / last))


def draw(heard):
    """Draw the third-octave levels of all blows on one scale."""
    columns = {"frequency_Hz": BANDS}
    for name, (_, sound) in heard.items():
        columns[f"{name}_dB"] = bands(sound.samples, sound.rate)
    curves = [
        plots.Curve(BANDS, columns[f"{name}_dB"], name, paint, panel=panel)
        for panel, names in PANELS.items()
        for name, paint in zip(names, (plots.BLUE, plots.VERMILION))
    ]
    figure = plots.curves(
        curves,
        x=plots.Axis("frequency", "Hz", log=True),
        y=plots.Axis("level re 10 m/s", "dB", limits=(-120.0, -25.0)),
        title="Sounds of one plate, in thirds of an octave",
    )
    return figure, columns


def main():
    """Write a WAV file for each blow and print the values measured in it."""
    heard = compute()
    folder = shared.folder()
    source.publish("beyond_sounds", *draw(heard))
    print(f"{'blow':<8}{'impacts':>8}{'peak':>10}{'level':>10}{'centroid':>10}{'first mode loses 60 dB in':>28}")
    for name, (n, sound) in heard.items():
        path = folder / f"{name}.wav"
        wavfile.write(path, sound.rate, sound.samples.astype(np.float32))
        rate, samples = wavfile.read(path)
        peak = 20.0 * np.log10(np.abs(samples).max())
        lost = decay_time(samples, rate, 100.0)
        print(f"{name:<8}{n:8d}{peak:7.1f} dB{level(samples):7.1f} dB{centroid(samples, rate):7.0f} Hz{lost:26.2f} s")
    print(
        f"dB re {sound.full_scale:g} {sound.unit}; theory for the decay: {np.log(1e3) / (DAMPING * 200 * np.pi):.2f} s"
    )


if __name__ == "__main__":
    main()
