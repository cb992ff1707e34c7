"""Designs a drumstick's tip: a wanted brightness at two dynamics, on the hinged plate of 200 g.

    python studies/tutorials/design_drumstick.py     prints the tip and its checks, draws pictures/design_drumstick.png

A tip is a power law, force = stiffness x indentation^exponent. With an exponent above 1 it hardens, and loud blows
sound brighter than soft ones; how much brighter follows from the exponent, how bright at all from the stiffness. Both
are free, and the spectral centroids of a soft and of a loud blow are wanted. The design is struck again with a finer
model.
"""

import sys
import time
from pathlib import Path

import numpy as np

import fem_impact as fi
from fem_impact.show import plots
from fem_impact.show.figures import styled

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

LENGTH, WIDTH = 0.465, 0.3  # [m] 1.55 : 1
AT = (0.14, 0.09)  # [m]
STICK, FREQUENCY = 0.06, 1.2e3  # [kg], [Hz] of the first bending mode
DYNAMICS = {"soft": 0.3, "loud": 3.0}  # [m/s]
BAND = 10e3  # [Hz]
CENTROID = f"spectral_centroid={BAND:g}"
WISHES = {"dark": (300.0, 500.0), "even": (600.0, 700.0), "bright": (900.0, 1800.0)}  # [Hz] soft and loud
FREE = {"stiffness": (1e3, 1e10), "exponent": (1.0, 3.5)}
START = {"stiffness": 1e6, "exponent": 1.5}
SPEEDS = np.geomspace(0.15, 6.0, 25)  # [m/s] of the picture
PICTURE = shared.PICTURES / "design_drumstick.png"


def plate(n_modes=200):
    """A hinged plate of 200 g whose first mode is at 100 Hz."""
    return fi.analytic.rectangle(
        LENGTH, WIDTH, mass=0.2, first_frequency=100.0, n_modes=n_modes, damping_ratio=0.005
    )  # fmt: skip


def blow(body, values, speed):
    """A blow of the stick with its tip at a speed [m/s]."""
    return {
        "target": body, "striker": fi.Striker.stick(STICK, FREQUENCY, n_modes=6),
        "contact": fi.Contact.power(values["stiffness"], values["exponent"]), "at": AT, "speed": speed,
        "max_impacts": 1,
    }  # fmt: skip


def designed(body, soft, loud):
    """The tip whose soft and loud blows have these spectral centroids [Hz]."""

    def blows(values):
        return {name: blow(body, values, speed) for name, speed in DYNAMICS.items()}

    wanted = {"soft": {CENTROID: soft}, "loud": {CENTROID: loud}}
    return fi.design(blows, wanted, FREE, start=START, tolerance=1e-4)


def brightness(body, values, speeds=SPEEDS):
    """Spectral centroid [Hz] over speeds (n,) [m/s]."""
    found = []
    for speed in speeds:
        told = blow(body, values, speed)
        hit = fi.strike(told.pop("target"), told.pop("striker"), told.pop("contact"), **told, tolerance=1e-3)
        found.append(hit.spectral_centroid(BAND))
    return np.array(found)


def draw(body, designs):
    """How bright each tip is over the speed, and the force of its two blows."""
    with styled(6.4, 5.6) as figure:
        over, force = figure.subplots(2)
        for (name, found), colour in zip(designs.items(), (plots.BLUE, plots.GREEN, plots.VERMILION)):
            values = found.values
            over.plot(SPEEDS, brightness(body, values), color=colour,
                      label=f"{name}: exponent {values['exponent']:.2f}")  # fmt: skip
            over.plot(list(DYNAMICS.values()), WISHES[name], "o", color=colour, mfc="white", zorder=5)
            for dynamic, style in (("soft", "--"), ("loud", "-")):
                hit = found.hits[dynamic]
                force.plot(1e3 * hit.time, hit.force / hit.peak_force, style, color=colour)
        over.set(xscale="log", xlabel="speed [m/s]", ylabel="spectral centroid [Hz]", ylim=(0.0, None))
        over.set_xticks([0.2, 0.5, 1.0, 2.0, 5.0], ["0.2", "0.5", "1", "2", "5"])
        over.minorticks_off()
        over.set_title("Tips for a wanted brightness at 0.3 and 3 m/s (circles)")
        over.legend(loc="upper left")
        force.set(xlabel="time [ms]", ylabel="force over its peak (dashed: soft)")
    return figure


def main():
    """Design, check and draw the tips."""
    body, designs = plate(), {}
    for name, wishes in WISHES.items():
        began = time.perf_counter()
        found = designs[name] = designed(body, *wishes)
        print(f"{name}: {found.summary()}\nin {time.perf_counter() - began:.1f} s")
        checks = found.verify()
        for dynamic, hit in checks.hits.items():
            label = f"{dynamic}: {CENTROID}"
            print(
                f"checked, {dynamic}: {checks.values[label]:.2f} Hz, {hit.n_impacts} impact; a finer run differs by "
                f"{max(checks.differences[dynamic].values()):.1e}"
            )
    shared.save(PICTURE, draw(body, designs))
    return designs


if __name__ == "__main__":
    main()
