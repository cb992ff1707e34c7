"""Designs a marimba bar's undercut, tuned 1 : 4 : 10 at a given pitch, and the mallet that suits it.

    python studies/design_marimba.py [FOLDER]     prints the designs and their checks, draws design_marimba.png

Rosewood bars (Timoshenko), 55 mm wide, 22 mm high and free at both ends, are cut from below in their middle. How deep,
along what curve and how far are free: three numbers, with which the first frequency comes out as the pitch, and the
next two as four and ten times that. The stiffness of the mallet's yarn is free, too: it shall stay on the bar for half
a period. Every design is struck again as a blow of its own, and with a finer model.
"""

import time
from functools import partial

import numpy as np
import shared

import fem_impact as fi
from fem_impact.show import plots
from fem_impact.show.figures import styled

WIDTH, HEIGHT = 0.055, 0.022  # [m]
ROSEWOOD = {"E": 16e9, "nu": 0.35, "rho": 900.0}
MALLET, SPEED = 0.03, 2.0  # [kg], [m/s]
BARS = {"C4": (261.63, 0.35), "F4": (349.23, 0.303), "A4": (440.0, 0.27)}  # pitch [Hz] and length [m]
RATIOS = {"mode2.ratio": 4.0, "mode3.ratio": 10.0}
FREE = {
    "deep": (1e-3, 20e-3),  # [m] cut in the middle
    "bow": (-20e-3, 20e-3),  # [m] how its curve differs from a parabola: times the square of the place
    "half": (0.2, 0.48),  # [-] of the length, from the middle to the end of the cut
    "yarn": (1e5, 1e9),  # [N/m^2] stiffness of the mallet
}
START = {"deep": 12e-3, "bow": 0.0, "half": 0.28}
LINES = {"C4": "-", "F4": "--", "A4": ":"}
CENT = 1200.0  # [-] cents per octave


def height(x, length, values):
    """Height [m] of the bar at places (n,) [m]."""
    s = np.clip(np.abs(x / length - 0.5) / values["half"], 0.0, 1.0) ** 2
    return HEIGHT - (1.0 - s) * (values["deep"] + values["bow"] * s)


def blow(length, values):
    """The bar of a length [m] and a mallet of yarn that strikes its middle."""
    section = fi.Beam.rectangular(
        fi.Material(**ROSEWOOD), width=WIDTH, height=lambda points: height(points[:, 0], length, values)
    )
    return {
        "mesh": fi.mesh.line(length), "section": section, "theory": "timoshenko", "damping_ratio": 0.003,
        "striker": fi.Striker.rigid(MALLET), "contact": fi.Contact.power(values["yarn"], 2.0, loss=0.1),
        "at": 0.5 * length, "speed": SPEED,
    }  # fmt: skip


def designed(pitch, length):
    """The bar of a length [m] and its mallet for a pitch [Hz]."""
    wanted = {"mode1.frequency": pitch, **RATIOS, "contact_time": 0.5 / pitch}
    return fi.design(partial(blow, length), wanted, FREE, start=START, tolerance=1e-6)


def cents(found, checked):
    """Largest distance [cents] of the three frequencies from where they are wanted, found again on a finer model."""
    values = {each.goal.label: (checked.values[each.goal.label], each.goal.low) for each in found.reached}
    first, wanted = values["mode1.frequency"]
    apart = [first / wanted] + [values[name][0] / ratio * (first / wanted) for name, ratio in RATIOS.items()]
    return max(abs(CENT * np.log2(one)) for one in apart)


def draw(designs):
    """The bars from the side, and the spectra of the blows over the frequency in first frequencies."""
    with styled(6.4, 5.6) as figure:
        side, spectra = figure.subplots(2)
        for (name, found), colour in zip(designs.items(), (plots.BLUE, plots.VERMILION, plots.GREEN)):
            pitch, length = BARS[name]
            x = np.linspace(0.0, length, 400)
            place = 1e3 * (x - 0.5 * length)
            edge = np.concatenate([[HEIGHT], HEIGHT - height(x, length, found.values), [HEIGHT, HEIGHT]])
            across = np.concatenate([place[:1], place, place[-1:], place[:1]])
            side.plot(across, 1e3 * edge, color=colour, label=f"{name}, {1e3 * length:.0f} mm")
            frequencies = np.linspace(0.0, 12.0 * pitch, 600)
            size = np.abs(found.hits[""].spectrum(frequencies))
            spectra.plot(frequencies / pitch, 20.0 * np.log10(size / size[0]), color=colour, ls=LINES[name])
        side.set(xlabel="from the middle [mm]", ylabel="height [mm]", ylim=(-0.5, 1e3 * HEIGHT + 0.8))
        side.set_title("Undercuts tuned to 1 : 4 : 10, from the side, and the blows of their mallets")
        side.legend(loc="center", bbox_to_anchor=(0.5, 0.3))
        for ratio in (1.0, 4.0, 10.0):
            spectra.axvline(ratio, color=plots.GREY, lw=0.8, ls="--")
        spectra.set(xlabel="frequency over the first of the bar", ylabel="force spectrum [dB]", ylim=(-60.0, 3.0))
    return figure


def main():
    """Design, check and draw the bars of three pitches."""
    designs = {}
    for name, (pitch, length) in BARS.items():
        began = time.perf_counter()
        found = designs[name] = designed(pitch, length)
        seconds = time.perf_counter() - began
        checked = found.verify()
        hit = checked.hits[""]
        print(f"{name}: {found.summary()}\nin {seconds:.1f} s")
        print(
            f"checked: frequencies within {cents(found, checked):.1e} cents; the mallet stays on the bar for "
            f"{1e3 * hit.contact_time:.4f} ms, wanted {500.0 / pitch:.4f} ms, {hit.n_impacts} impact; a finer model "
            f"changes the contact time by {checked.differences['']['contact_time']:.1e} of it"
        )
    shared.save(shared.folder(shared.PICTURES) / "design_marimba.png", draw(designs))
    return designs


if __name__ == "__main__":
    main()
