"""Beyond the source: a wine glass on its foot, struck by a pencil and by a knuckle.

Bowl, stem and foot are one solid of revolution of soda-lime glass, held under its foot. The tones of its rim, with two
to four waves around, come from the section alone (`revolved.py`) and from tetrahedra (`solids.py`), which become a
`fi.Body` with the static solution under a unit load on the belly. The script prints the tones of both, those that the
sound of the belly holds, and the blows.

    python studies/figures/beyond_wine_glass.py [folder]
"""

import sys
from pathlib import Path

import numpy as np
import source_scenes as source

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `solids`
import revolved
import solids

GLASS = fi.Material(E=70e9, nu=0.22, rho=2500.0)
WALL = 1.8e-3  # [m] of the bowl
OUTSIDE = np.array([  # [m] radius and height, from the rim to the bottom of the bowl
    (0.030, 0.165), (0.0335, 0.145), (0.0365, 0.125), (0.0375, 0.105), (0.0345, 0.087), (0.026, 0.0745), (0.014, 0.068),
])  # fmt: skip
BELLY = 3  # number of the point above that is struck
STEM, FOOT, LOW = 4.5e-3, 0.034, 3e-3  # [m] radii of stem and foot, thickness of the foot
WAVES = 2, 3, 4
HELD = 4  # number of the curve on which it stands
SIZES = 4.5e-3, 0.4e-3  # [m] of tetrahedra anywhere, and where it is struck
DAMPING = 1e-3  # [-] typical
SPEED = 0.3  # [m/s]
# [kg] and contact: wood across its grain (1 GPa) of a radius of 5 mm; skin over bone, typical
BLOWS = {"pencil": (0.01, fi.Contact.hertz(1e8)), "knuckle": (0.15, fi.Contact.linear(4e4))}
SECONDS = 2.0


def profile():
    """Curves (n, 2) [m] of the section: belly to bottom, stem, edge of the foot, sole, axis, inside, rim, belly."""
    tangent = np.gradient(OUTSIDE, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    inside = OUTSIDE + WALL * np.column_stack([tangent[:, 1], -tangent[:, 0]])
    inside = np.vstack([inside, (0.0, inside[-1, 1] - 1e-3)])
    stem = np.array([OUTSIDE[-1], (0.0065, 0.061), (STEM, 0.052), (STEM, 0.02), (0.008, 0.009), (FOOT, LOW)])
    return [
        OUTSIDE[BELLY:], stem, np.array([(FOOT, LOW), (FOOT, 0.0)]), np.array([(FOOT, 0.0), (0.0, 0.0)]),
        np.array([(0.0, 0.0), inside[-1]]), inside[::-1], np.array([inside[0], OUTSIDE[0]]), OUTSIDE[: BELLY + 1],
    ]  # fmt: skip


def tones(curves, size=1.5e-3):
    """Lowest frequencies [Hz] with each number of waves around, from the section."""
    mesh = revolved.section(curves, size, HELD)
    return np.array([revolved.frequencies(mesh, GLASS, waves, 1)[0] for waves in WAVES])


def solve(sizes=SIZES, n_modes=50):
    """The glass as a `fi.Body`, and where it is struck (3,) [m]."""
    belly = np.array([OUTSIDE[BELLY, 0], 0.0, OUTSIDE[BELLY, 1]])
    loads = [(belly, (-1.0, 0.0, 0.0))]
    shape = revolved.solid(profile())
    for face in shape.faces:
        face.name = "held" if face.bounding_box[1].z < 1e-5 else "free"
    mesh = solids.meshed(shape, sizes[0], [(belly, sizes[1])])
    solved = solids.solve(mesh, GLASS, n_modes, loads, held="held")
    return solids.body(solved, loads, solid=GLASS, damping_ratio=DAMPING), belly


def strike(glass, belly, name, tolerance=1e-2):
    """The first contact with a pencil or a knuckle."""
    mass, law = BLOWS[name]
    modes, striker = glass.modes("x", free=False), fi.Striker.rigid(mass)
    return fi.strike(modes, striker, law, at=glass.at(belly), speed=SPEED, tolerance=tolerance, max_impacts=1)


def main():
    """Print tones and blows; write picture and sounds."""
    of_section = tones(profile())
    glass, belly = solve()
    numbers = [int(np.abs(glass.frequencies - each).argmin()) for each in of_section]
    found = glass.frequencies[numbers]
    columns, heard = {"waves": np.array(WAVES), "section_Hz": of_section, "solid_Hz": found}, {}
    print(f"glass of {1e3 * glass.mass:.0f} g")
    for name in BLOWS:
        hit = strike(glass, belly, name)
        path, heard[name] = solids.listened(hit, glass, belly, "x", f"wine_{name}", found, SECONDS)
        columns[f"{name}_Hz"] = heard[name]
        print(hit.verdict)
        print(f"{name}: contact {1e3 * hit.contact_time:.3f} ms, peak {hit.peak_force:.1f} N, error "
              f"{hit.error.total:.1e}; {path.name}")  # fmt: skip
    print(f"{'waves':6}{'section':>12}{'solid':>12}{'apart':>9}" + "".join(f"{'heard, ' + each:>17}" for each in heard))
    for i, waves in enumerate(WAVES):
        apart = 100.0 * (found[i] / of_section[i] - 1.0)
        print(f"{waves:<6}{of_section[i]:9.1f} Hz{found[i]:9.1f} Hz{apart:7.2f} %"
              + "".join(f"{each[i]:14.1f} Hz" for each in heard.values()))  # fmt: skip
    panels = [(f"{waves} waves, {glass.frequencies[i]:.0f} Hz", glass.shapes[:, :, i]) for waves, i in zip(
        WAVES, numbers)]  # fmt: skip
    source.publish("beyond_wine_glass", solids.drawn(glass, panels, "A wine glass and its tones", most=0.05), columns)


if __name__ == "__main__":
    main()
