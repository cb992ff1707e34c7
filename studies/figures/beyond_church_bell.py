"""Beyond the source: a bell of bronze, tuned by its profile, and the clapper that strikes it from inside.

The profile is our own. Its partials come from the section alone, wave by wave around the axis (`revolved.py`); with
``--tune`` twelve numbers of the profile are found again, from which they are as 0.5 : 1 : 1.2 : 1.5 : 2. The bell is
then revolved to a solid of tetrahedra (`solids.py`), bolted to its yoke, which becomes a `fi.Body` with the static
solution under a unit load where the clapper strikes. The script prints the partials of both, those measured in the
sound, and the blow, and writes the sound of the lip as a WAV file.

    python studies/figures/beyond_church_bell.py [folder] [--tune]
"""

import sys
from pathlib import Path

import numpy as np
import source_scenes as source
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.optimize import least_squares

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `solids`
import revolved
import solids

BRONZE = fi.Material(E=99e9, nu=0.34, rho=8600.0)  # a fifth of tin; typical values
STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
YIELD = 140e6  # [Pa] of the bronze, typical; clappers wear a flat into it
WIDTH = 0.36  # [m] of the mouth, about; the numbers of the profile are over it
HEIGHTS = np.array([0.0, 0.08, 0.2, 0.4, 0.6, 0.72])  # [-] of the numbers of the profile, from the mouth
RADII = np.array([0.51207, 0.46992, 0.37339, 0.31444, 0.26953, 0.26728])  # [-] of the outside
WALLS = np.array([0.01959, 0.07666, 0.05192, 0.03058, 0.02488, 0.02908])  # [-] thickness
FIRST = np.array([0.5, 0.455, 0.385, 0.315, 0.278, 0.262, 0.02, 0.075, 0.05, 0.03, 0.027, 0.03])  # before tuning
SHY = 30.0  # [cents] that a number of the profile as large as the mouth is worth, from `FIRST`
CROWN, FLAT, RISE, BOLT = 0.045, 0.12, 0.09, 0.03  # [-] thickness, flat radius, rise of the crown; radius of its hole
NAMES = {"hum": (2, 0), "prime": (2, 1), "tierce": (3, 0), "quint": (3, 1), "nominal": (4, 0)}  # waves, order
IDEAL = np.array([0.5, 1.0, 1.2, 1.5, 2.0])
HELD = 3  # number of the curve that the bolt holds
SIZES = 0.016, 3e-3  # [m] of tetrahedra anywhere, and where the clapper strikes
DAMPING = 4e-4  # [-] typical of bronze bells
CLAPPER, SPEED = 0.036, 0.4  # [m] radius of a ball of steel, [m/s]
SECONDS = 4.0


def profile(radii=RADII, walls=WALLS):
    """Curves (n, 2) [m] of the section: outside below and above the bow, crown, bolt, crown, inside above and below."""
    z = np.linspace(0.0, HEIGHTS[-1], 41)
    r, wall = CubicSpline(HEIGHTS, radii), PchipInterpolator(HEIGHTS, walls)(z)
    slope = r(z, 1)
    outside = np.column_stack([r(z), z])
    inside = outside - wall[:, None] * np.column_stack([np.ones(41), -slope]) / np.hypot(1.0, slope)[:, None]
    turn = 0.5 * np.pi * np.linspace(0.0, 1.0, 16)[1:, None]
    top = HEIGHTS[-1] + RISE
    ends = (outside[-1], top), (inside[-1], top - CROWN)
    outside, inside = (
        np.vstack([wall, np.hstack([FLAT + (r - FLAT) * np.cos(turn), z + (high - z) * np.sin(turn)])])
        for wall, ((r, z), high) in zip((outside, inside), ends)
    )
    bow = int(np.argmax(wall))
    return [WIDTH * each for each in (
        outside[: bow + 1], outside[bow:], np.array([outside[-1], (BOLT, top)]),
        np.array([(BOLT, top), (BOLT, top - CROWN)]), np.array([(BOLT, top - CROWN), inside[-1]]),
        inside[bow:][::-1], inside[: bow + 1][::-1], np.array([inside[0], outside[0]]),
    )]  # fmt: skip


def partials(curves, size=6e-3):
    """Frequencies [Hz] of the five partials, from the section."""
    mesh = revolved.section(curves, size, HELD)
    found = {waves: revolved.frequencies(mesh, BRONZE, waves, 2) for waves in (2, 3, 4)}
    return np.array([found[waves][order] for waves, order in NAMES.values()])


def cents(frequencies):
    """How far partials are from the ideal ratios to the prime."""
    return 1200.0 * np.log2(frequencies / frequencies[1] / IDEAL)


def tune():
    """Radii and walls of the profile whose partials have the ideal ratios."""

    def off(numbers):
        found = cents(partials(profile(*np.split(numbers, 2)), 8e-3))
        return np.concatenate([found - found.mean(), SHY * (numbers - FIRST)])

    best = least_squares(off, FIRST, diff_step=1e-3, max_nfev=12, bounds=(0.5 * FIRST - 0.01, 1.6 * FIRST + 0.01))
    return np.split(best.x, 2)


def solve(sizes=SIZES, n_modes=90):
    """The bell as a `fi.Body`, and the points (3,) [m] where the clapper strikes from inside and opposite, outside."""
    curves = profile()
    (x, z), (far, high) = curves[5][-1], curves[0][-1]
    inside, outside = np.array([x, 0.0, z]), np.array([far, 0.0, high])
    loads = [(inside, (outside - inside) / np.linalg.norm(outside - inside))]
    shape = revolved.solid(curves)
    for face in shape.faces:
        face.name = "held" if face.bounding_box[1].x < 1.01 * BOLT * WIDTH else "free"
    mesh = solids.meshed(shape, sizes[0], [(inside, sizes[1])])
    solved = solids.solve(mesh, BRONZE, n_modes, loads, held="held")
    return solids.body(solved, loads, solid=BRONZE, damping_ratio=DAMPING), inside, outside


def strike(bell, inside, outside, tolerance=1e-2):
    """The first blow of the clapper, across the wall."""
    clapper = fi.Striker.sphere(STEEL, CLAPPER)
    law = fi.Contact.between(clapper, BRONZE, yield_strength=YIELD)
    modes = bell.modes(outside - inside, free=False)
    return fi.strike(modes, clapper, law, at=bell.at(inside), speed=SPEED, tolerance=tolerance, max_impacts=1)


def draw(bell, found):
    """The bell as each partial moves it."""
    panels = []
    for name, frequency in zip(NAMES, found):
        mode = int(np.abs(bell.frequencies - frequency).argmin())
        panels.append((f"{name}, {bell.frequencies[mode]:.0f} Hz", bell.shapes[:, :, mode]))
    return solids.drawn(bell, panels, "A bell and its five partials")


def main():
    """Print partials, sound and blow; write picture and sound."""
    again = "--tune" in sys.argv
    if again:
        sys.argv.remove("--tune")
        radii, walls = tune()
        print("radii", radii.round(5), "walls", walls.round(5))
        curves = profile(radii, walls)
    else:
        curves = profile()
    of_section = partials(curves)
    bell, inside, outside = solve()
    hit = strike(bell, inside, outside)
    print(hit.verdict)
    print(f"clapper {hit.striker.mass:.2f} kg, bell {bell.mass:.1f} kg: contact {1e3 * hit.contact_time:.3f} ms, peak "
          f"{hit.peak_force:.0f} N, restitution {hit.restitution:.3f}, error {hit.error.total:.1e}")  # fmt: skip
    path, heard = solids.listened(hit, bell, outside, "normal", "church_bell", of_section, SECONDS)
    kept = np.array([bell.frequencies[np.abs(bell.frequencies - each).argmin()] for each in of_section])
    print(f"{'partial':10}{'ideal':>6}{'section':>12}{'cents':>8}{'solid':>12}{'cents':>8}{path.name:>18}{'cents':>8}")
    rows = zip(NAMES, IDEAL, *(each for f in (of_section, kept, heard) for each in (f, cents(f))))
    for name, ideal, *rest in rows:
        print(f"{name:10}{ideal:6.1f}" + "".join(f"{f:9.2f} Hz{c:8.2f}" for f, c in zip(rest[::2], rest[1::2])))
    columns = {"ideal": IDEAL, "section_Hz": of_section, "solid_Hz": kept, "heard_Hz": heard}
    source.publish("beyond_church_bell", draw(bell, of_section), columns)


if __name__ == "__main__":
    main()
