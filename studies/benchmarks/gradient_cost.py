"""Measures what a gradient in all numbers of a blow costs, in strikes of the same blow.

    python studies/benchmarks/gradient_cost.py [--repeats 40]     prints a table, writes gradient_cost.csv

Strikers that bend or not hit plates of one, 50 and 300 modes once or twice, at three tolerances. Strike and gradients
take turns, and the least processor time of each counts, so that other work on the machine does not. Gradients are of
one quantity each, or of seven together.
"""

import sys
import warnings
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

BAND = 2000.0  # [Hz] of the centroid
ALL = (
    "restitution", "impulse", "contact_time", "peak_force", "peak_time", f"spectral_centroid={BAND:g}",
    f"spectral_level={BAND:g}",
)  # fmt: skip
TOLERANCES = 1e-3, 1e-4, 1e-6  # [-]
MODES = 1, 50, 300  # [-] of the plate
# [kg], [Hz], [m] mass of a striker, first frequency of a stick or None if rigid, strike point; some of them hit twice
STRIKERS = (
    (0.03, None, (0.45, 0.3)), (0.1, 10e3, (0.45, 0.3)), (0.03, None, (0.775, 0.5)), (0.1, 10e3, (0.775, 0.5)),
    (0.3, None, (0.45, 0.3)),
)  # fmt: skip
CHEAPEST, DEAREST, TOGETHER = "cheapest quantity / strikes", "dearest quantity / strikes", "all seven / strikes"


def blow(n_modes, mass, frequency, at, tolerance):
    """A function that strikes the plate of 200 g."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=n_modes, damping_ratio=0.005)
    striker = fi.Striker.rigid(mass) if frequency is None else fi.Striker.stick(mass, frequency)
    law = fi.Contact.hertz(695e3, gap=1e-5)
    return lambda: fi.strike(plate, striker, law, at=at, speed=1.0, tolerance=tolerance, max_impacts=4)


def examine(n_modes, striker, tolerance, repeats):
    """One row; None if the blow has no gradient, as it grazes, or hits more than three times."""
    strike = blow(n_modes, *striker, tolerance)
    try:
        hit = strike()
        n = len(hit.gradient("impulse").names)
        hit.gradient(ALL)
    except fi.SimulationError:
        return None
    if not 1 <= hit.n_impacts <= 3:
        return None
    asked = [partial(hit.gradient, quantity) for quantity in (*ALL, ALL)]
    whole, *each, together = shared.timed_in_turn([strike, *asked], repeats)
    row = {
        "modes of the plate": n_modes, "modes of the run": len(hit.history.omega), "steps": len(hit.history.steps),
        "tolerance": tolerance, "impacts": hit.n_impacts, "numbers": n, "strike / ms": round(1e3 * whole, 2),
        CHEAPEST: round(min(each) / whole, 2), DEAREST: round(max(each) / whole, 2),
        TOGETHER: round(together / whole, 2),
    }  # fmt: skip
    print(", ".join(f"{name} {value:g}" for name, value in row.items()), flush=True)
    return row


def main():
    """Measure, print and write."""
    parser = shared.parser(__doc__)
    parser.add_argument("--repeats", type=int, default=40)
    warnings.simplefilter("ignore", fi.ToleranceWarning)  # of the plate of one mode
    repeats = parser.parse_args().repeats
    found = [examine(*case, repeats) for case in product(MODES, STRIKERS, TOLERANCES)]
    rows = [row for row in found if row]
    for name in (CHEAPEST, DEAREST, TOGETHER):
        found = np.array([row[name] for row in rows])
        print(f"{name}: median {np.median(found):.2f}, largest {found.max():.2f} of {len(rows)} blows")
    shared.write_rows(Path(__file__).with_suffix(".csv"), rows)


if __name__ == "__main__":
    main()
