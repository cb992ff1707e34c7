"""Designs the lightest and the heaviest hammer for the tutorial's plate: 800 Hz, and one hit at each of nine points.

    python studies/tutorials/design_hammer.py     prints both hammers and their checks, draws pictures/design_hammer.png

The free aluminium plate of the tutorial (600 x 400 x 4 mm, 2.6 kg) is struck at 0.5 m/s at nine points of a quarter,
one of them 20 mm from its corner. Mass and tip (a linear spring) are free. Wanted at every point: one hit, the force at
800 Hz at most 10 dB below that at 0 Hz, and an impulse of at least 20 mN s, for without this the lightest hammer would
have no mass. Both designs are struck again at all points, by plans of their own and with finer models.
"""

import sys
import time
from pathlib import Path

import numpy as np
import tutorial_hammer_test as tutorial
from scipy.ndimage import zoom

import fem_impact as fi
from fem_impact.impact import clearance
from fem_impact.show import plots
from fem_impact.show.figures import styled
from fem_impact.sweeps import hammers

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

POINTS = {f"({1e3 * x:.0f}, {1e3 * y:.0f}) mm": (x, y) for x in (0.02, 0.16, 0.3) for y in (0.02, 0.11, 0.2)}  # [m]
IMPULSE = 0.02  # [N s]
LEVEL = f"spectral_level={tutorial.BANDWIDTH:g}"
WANTED = {"n_impacts": 1, LEVEL: (-tutorial.DROP, None), "impulse": (IMPULSE, None)}
FREE = {"mass": (5e-3, 0.5), "tip": (1e4, 1e7)}  # [kg], [N/m]
START = {"mass": 0.05, "tip": 3e5}
N_MODES = 180  # [-] of the plate, up to 8 kHz
MAP, FINER = 17, 16  # [-] masses and tips of the picture, and how many pixels are drawn of each
PICTURE = shared.PICTURES / "design_hammer.png"


def blows(body):
    """A function that makes the blows at all points from mass and tip."""

    def made(values):
        return {name: {
            "target": body, "striker": fi.Striker.rigid(values["mass"]), "contact": fi.Contact.linear(values["tip"]),
            "at": at, "speed": tutorial.SPEED, "damping_ratio": tutorial.DAMPING, "tolerance": 1e-4,
        } for name, at in POINTS.items()}  # fmt: skip

    return made


def designed(body, which):
    """The hammer of the "least" or of the "most" mass."""
    return fi.design(blows(body), WANTED, FREE, start=START, n_modes=N_MODES, **{which: "mass"})


def checked(found):
    """Impacts, bandwidth [Hz] and impulse [N s] at every point, struck again; and how much a finer run differs."""
    checks = found.verify()
    table = {
        name: (hit.n_impacts, hammers.bandwidth_of(hit, tutorial.DROP), hit.impulse)
        for name, hit in checks.hits.items()
    }
    return table, max(max(each.values()) for each in checks.differences.values())


def surveyed(modes, count=MAP):
    """Smallest clearance [-], level [dB] and impulse [N s] of all points over masses and tips, (count, count) each."""
    masses, tips = np.geomspace(0.02, 0.08, count), np.geomspace(6e4, 8e5, count)
    found = np.empty((3, count, count))
    for i, mass in enumerate(masses):
        for j, tip in enumerate(tips):
            hits = [
                fi.strike(modes, fi.Striker.rigid(mass), fi.Contact.linear(tip), at=at, speed=tutorial.SPEED,
                          tolerance=1e-2, max_impacts=1)
                for at in POINTS.values()
            ]  # fmt: skip
            sizes = [np.abs(hit.spectrum(np.array([0.0, tutorial.BANDWIDTH]))) for hit in hits]
            levels = [20.0 * np.log10(size[1] / size[0]) for size in sizes]
            found[:, i, j] = (
                min(clearance.nearest_clearance(hit)[0] for hit in hits), min(levels), min(hit.impulse for hit in hits)
            )  # fmt: skip
    return masses, tips, found


def draw(survey, designs):
    """Where each wish holds at all points, and both hammers."""
    masses, tips, (gaps, levels, impulses) = survey
    with styled(6.4, 4.6) as figure:
        axes = figure.subplots()
        x, y = 1e3 * masses, 1e-3 * tips
        fine = [zoom(field, FINER, order=1) for field in (gaps, levels, impulses)]  # linear in between
        good = (fine[0] > 0.0) & (fine[1] > -tutorial.DROP) & (fine[2] > IMPULSE)
        across, up = (np.geomspace(each[0], each[-1], len(good)) for each in (x, y))
        axes.contourf(across, up, good.T.astype(float), [0.5, 1.5], colors=[plots.GREEN], alpha=0.3)
        axes.contourf(x, y, gaps.T, [-1e3, 0.0], colors=[plots.VERMILION], alpha=0.25)
        for field, limit, colour, name in (
            (levels, -tutorial.DROP, plots.BLUE, "force at 800 Hz 10 dB down"),
            (impulses, IMPULSE, plots.BLACK, "impulse 20 mN s"),
        ):
            axes.contour(x, y, field.T, [limit], colors=[colour])
            axes.plot([], [], color=colour, label=name)
        axes.fill([], [], color=plots.VERMILION, alpha=0.25, label="hits twice at some point")
        axes.fill([], [], color=plots.GREEN, alpha=0.3, label="all wishes hold at nine points")
        for which, found in designs.items():
            mass, tip = found.values["mass"], found.values["tip"]
            axes.plot(1e3 * mass, 1e-3 * tip, "o", color=plots.BLACK, mfc="white", zorder=5)
            side = {"least": (-8, 10, "right"), "most": (10, -14, "left")}[which]
            axes.annotate(f"{1e3 * mass:.1f} g", (1e3 * mass, 1e-3 * tip), side[:2], textcoords="offset points",
                          ha=side[2])  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel="mass of the hammer [g]", ylabel="stiffness of the tip [kN/m]")
        axes.set_xticks([20, 30, 40, 60, 80], ["20", "30", "40", "60", "80"])
        axes.set_yticks([100, 200, 400, 800], ["100", "200", "400", "800"])
        axes.minorticks_off()
        axes.set_title("Hammers for a plate of 2.6 kg: the lightest and the heaviest")
        axes.legend(loc="lower right")
    return figure


def main():
    """Design, check and draw both hammers."""
    body, designs = tutorial.plate(), {}
    for which in ("least", "most"):
        began = time.perf_counter()
        found = designs[which] = designed(body, which)
        print(f"{which} mass: {1e3 * found.values['mass']:.2f} g, tip {1e-3 * found.values['tip']:.1f} kN/m")
        print(f"{found.verdict}, {found.n_evaluations} evaluations in {time.perf_counter() - began:.1f} s")
        table, apart = checked(found)
        for name, (count, reach, impulse) in table.items():
            print(f"  at {name:>14}: {count} impact, reaches {reach:.0f} Hz, {1e3 * impulse:.2f} mN s")
        print(f"  finer models differ by at most {apart:.1e}")
    modes = fi.find_modes(body, n_modes=N_MODES, damping_ratio=tutorial.DAMPING)
    shared.save(PICTURE, draw(surveyed(modes), designs))
    return designs


if __name__ == "__main__":
    main()
