"""Beyond the source: a tuning fork, struck on its prong with rubber and with wood, beside the formula of a beam.

The fork is a free solid of steel (`solids.py`). Its first tone, which leaves the foot at rest, is that of two clamped
bars, ``f = 0.5596 a sqrt(E / (12 rho)) / L**2`` by Euler and Bernoulli, which are a little longer than the prongs, as
their root gives way. The script prints tones and blows and what the sound of the tip holds.

    python studies/figures/beyond_tuning_fork.py [folder]
"""

import sys
from pathlib import Path

import numpy as np
import source_scenes as source

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `solids`
import solids

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
LENGTH, SIDE, DEEP, GAP = 0.0906, 4.6e-3, 6e-3, 8e-3  # [m] prong, along its motion, across; between the prongs
YOKE, FOOT = 8e-3, (2.5e-3, 0.04)  # [m] height of the yoke; radius and length of the foot
WHERE = 0.7  # [-] of the prong, from its root, where it is struck
CLAMPED = np.array([1.875104069, 4.694091133])  # [-] roots of cos(x) cosh(x) = -1
DAMPING = 2e-4  # [-] typical
HEADS = {"rubber": 3e4, "wood": 1e6}  # [N/m]
MASS, SPEED = 0.03, 1.0  # [kg], [m/s] of the mallet
SIZES = 4e-3, 1.2e-3  # [m] of tetrahedra anywhere, and where the prong is struck
SECONDS = 3.0


def shape():
    """The fork, its struck prong in four parts that meet in a corner where it is struck."""
    from netgen.occ import Box, Cylinder, Glue, Pnt, Z

    inner, outer, half, height = 0.5 * GAP, 0.5 * GAP + SIDE, 0.5 * DEEP, WHERE * LENGTH
    parts = [
        Box(Pnt(inner, y, low), Pnt(outer, y + half, high))
        for y in (-half, 0.0)
        for low, high in ((0.0, height), (height, LENGTH))
    ]
    parts.append(Box(Pnt(-outer, -half, 0.0), Pnt(-inner, half, LENGTH)))
    parts.append(Box(Pnt(-outer, -half, -YOKE), Pnt(outer, half, 0.0)))
    parts.append(Cylinder(Pnt(0.0, 0.0, -YOKE - FOOT[1]), Z, r=FOOT[0], h=FOOT[1]))
    return Glue(parts), np.array([outer, 0.0, height])


def solve(sizes=SIZES, n_modes=40):
    """The fork as a `fi.Body`, and where it is struck (3,) [m]."""
    glued, struck = shape()
    loads = [(struck, (1.0, 0.0, 0.0))]
    solved = solids.solve(solids.meshed(glued, sizes[0], [(struck, sizes[1])]), STEEL, n_modes, loads)
    return solids.body(solved, loads, solid=STEEL, damping_ratio=DAMPING), struck


def tones(fork):
    """Numbers of the two lowest modes in which the tips of the prongs part and come together."""
    tips = [fork.node((x, -0.5 * DEEP, LENGTH)) for x in (0.5 * GAP + SIDE, -0.5 * GAP - SIDE)]
    right, left = fork.shapes[tips, 0]
    apart = np.abs(right - left) / (np.abs(right) + np.abs(left) + 1e-300)
    strong = np.abs(right - left) > 0.5 * np.abs(right - left).max()
    return np.flatnonzero(strong & (apart > 0.99))[:2]


def formula():
    """The two lowest frequencies [Hz] of a prong clamped at its root."""
    return CLAMPED**2 / (2.0 * np.pi * LENGTH**2) * np.sqrt(STEEL.E / STEEL.rho / 12.0) * SIDE


def strike(fork, struck, stiffness):
    """The first blow of a mallet on the prong, from outside."""
    modes = fork.modes((-1.0, 0.0, 0.0))
    law, mallet = fi.Contact.linear(stiffness), fi.Striker.rigid(MASS)
    return fi.strike(modes, mallet, law, at=fork.at(struck), speed=SPEED, tolerance=1e-2, max_impacts=1)


def main():
    """Print tones and blows; write pictures and sounds."""
    fork, struck = solve()
    two, beam = tones(fork), formula()
    found = fork.frequencies[two]
    print(f"{'tone':8}{'beam':>12}{'solid':>12}{'beam as long as':>18}")
    for name, short, own in zip(("first", "clang"), beam, found):
        print(f"{name:8}{short:9.2f} Hz{own:9.2f} Hz{1e3 * LENGTH * np.sqrt(short / own):15.2f} mm")
    foot, tip = (fork.node(each) for each in ((FOOT[0], 0.0, -YOKE - FOOT[1]), (0.5 * GAP + SIDE, 0.5 * DEEP, LENGTH)))
    moved = np.linalg.norm(fork.shapes[[foot, tip], :, two[0]], axis=1)
    print(f"prongs of {1e3 * LENGTH:g} mm; in the first tone the foot moves {moved[0] / moved[1]:.4f} of the tip")
    columns = {"beam_Hz": beam, "solid_Hz": found}
    for name, stiffness in HEADS.items():
        hit = strike(fork, struck, stiffness)
        path, heard = solids.listened(hit, fork, fork.nodes[tip], "x", f"fork_{name}", found, SECONDS)
        speeds = np.abs(hit.modal_state([hit.contact_time])[1][0] * fork.shapes[tip, 0])
        columns[f"{name}_Hz"] = heard
        print(hit.verdict)
        print(f"{name}: contact {1e3 * hit.contact_time:.2f} ms, error {hit.error.total:.1e}; {path.name}: "
              f"{heard[0]:.2f} and {heard[1]:.2f} Hz; clang by first {np.divide(*speeds[two[::-1]]):.2g}")  # fmt: skip
    panels = [(f"{name}, {fork.frequencies[mode]:.1f} Hz", fork.shapes[:, :, mode]) for name, mode in zip(
        ("first tone", "clang"), two)]  # fmt: skip
    figure = solids.drawn(fork, panels, "A tuning fork and its two tones", (8.0, -75.0), 0.03)
    source.publish("beyond_tuning_fork", figure, columns)


if __name__ == "__main__":
    main()
