"""Measured frequency responses as bodies: do blows on them come out as on the bodies that were measured?

    python studies/verification/measured_bodies.py [--bodies 30] [--blows 10] [--first 0] [--out DIR]

Steel bars and disks (free, clamped or hinged) and hinged plates, of random size and damping, are tapped
five times at a random point by a light hammer; `fi.measure` records force and acceleration at 25.6 kHz with 24 bits and
noise of 1e-3 of the peaks, `fi.frf` makes a response of them, and `fi.Modes.from_frf` a body, once without picking and
once of the modes at its peaks. Random strikers meet the two bodies and the true one, of all its modes, at that point.
Errors are those of peak force, contact time, impulse and number of impacts, the last being where a second hit is missed
or made up. "Held": the true error is at most the one stated of that quantity. Prints a table and writes a CSV.
"""

import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import fem_impact as fi
from fem_impact.impact import distance

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

RATE, DURATION, BEFORE = 25600.0, 0.25, 4e-3  # [Hz], [s], [s]
NOISE, BITS, TAPS = 1e-3, 24, 5  # [-] of the peaks, of the converter, at the point
FORCE_WINDOW, RESPONSE_WINDOW = 3e-3, 0.06  # [s]
HIGHEST, MOST = 25e3, 200  # [Hz] modes of the truth, and how many at most
STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
QUANTITIES = "force", "contact_time", "impulse", "n_impacts"
WAYS = "followed", "picked"
TOLERANCE = 1e-2
MOST_IMPACTS = 5  # a light bar and its striker may go on hitting each other for half a minute


def known(rng: np.random.Generator, seed: int) -> tuple[str, fi.Modes]:
    """A random body as seen at a random point, with all its modes."""
    damping, kind = float(np.exp(rng.uniform(*np.log([3e-3, 3e-2])))), ("bar", "disk", "plate")[seed % 3]
    common: dict[str, Any] = {"damping_ratio": damping, "n_modes": MOST}
    if kind == "bar":
        length, ends = rng.uniform(0.15, 0.5), [("free", "free"), ("clamped", "free"), ("hinged", "hinged"),
                                                ("clamped", "clamped")][rng.integers(4)]  # fmt: skip
        section = fi.Beam.rectangular(STEEL, width=0.03, height=rng.uniform(4e-3, 15e-3))
        whole = fi.analytic.beam(length, ends=ends, section=section, **common | {"n_modes": 60})
        at = [length * rng.uniform(0.05, 0.95)]
        kind += " " + "-".join(ends)
    elif kind == "disk":
        radius, edge = rng.uniform(0.06, 0.15), ("free", "clamped", "hinged")[rng.integers(3)]
        plate = fi.Plate(STEEL, thickness=rng.uniform(2e-3, 6e-3))
        whole = fi.analytic.disk(radius, edge=edge, section=plate, **common | {"n_modes": 120})
        angle, part = rng.uniform(0.0, 2.0 * np.pi), radius * np.sqrt(rng.uniform(0.05, 0.7))
        at = [part * np.cos(angle), part * np.sin(angle)]
        kind += " " + edge
    else:
        length, width = rng.uniform(0.15, 0.3), rng.uniform(0.1, 0.2)
        plate = fi.Plate(STEEL, thickness=rng.uniform(1.5e-3, 5e-3))
        whole = fi.analytic.rectangle(length, width, section=plate, **common)
        at = [length * rng.uniform(0.1, 0.9), width * rng.uniform(0.1, 0.9)]
    kept = whole.truncated(max_frequency=HIGHEST)
    return kind, fi.Modes.from_arrays(
        kept.frequencies, kept.shape_at([at]), points=[[0.0]], mass=whole.mass, damping_ratio=kept.damping_ratio,
        complete=True,
    )  # fmt: skip


def tapped(rng: np.random.Generator, body: fi.Modes) -> Any:
    """The frequency response at the point, as a rig tells it of five taps."""
    hammer, duration = fi.Striker.rigid(body.mass * rng.uniform(0.02, 0.1)), rng.uniform(1.5e-4, 4e-4)
    law = fi.Contact.linear(hammer.mass * (np.pi / duration) ** 2)
    taps = []
    for _ in range(TAPS):
        hit = fi.strike(body, hammer, law, at=[0.0], speed=rng.uniform(0.5, 1.5), tolerance=1e-3, max_impacts=3)
        taps.append(fi.measure(
            hit, rate=RATE, at=[[0.0]], duration=DURATION, before=BEFORE, onset=rng.uniform(0.0, 1.0 / RATE),
            noise=NOISE, bits=BITS, rng=rng,
        ))  # fmt: skip
    return fi.frf(taps, force_window=FORCE_WINDOW, response_window=RESPONSE_WINDOW)


def struck(body: fi.Modes, striker: fi.Striker, law: fi.Contact, tolerance: float) -> fi.Response:
    """A blow at 1 m/s, without a warning if its tolerance is missed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)
        asked = {"tolerance": tolerance, "quantity": QUANTITIES, "max_impacts": MOST_IMPACTS}
        return fi.strike(body, striker, law, at=[0.0], speed=1.0, **asked)


def judged(found: fi.Response, truth: fi.Response) -> Iterator[tuple[str, float]]:
    """True errors, less what the truth itself may err, and those stated."""
    apart = distance.of_blows(found, truth, dict.fromkeys(QUANTITIES))
    for quantity, error in apart.items():
        yield quantity, max(0.0, error - truth.error.of_quantity(quantity))
        yield f"{quantity}_stated", found.error.of_quantity(quantity)


def rows_of(seed: int, n_blows: int) -> Iterator[dict[str, Any]]:
    """Blows on one body, as it was measured and as it is."""
    rng = np.random.default_rng(seed)
    kind, body = known(rng, seed)
    frf, bodies = tapped(rng, body), {}
    used = frf.frequency.values[frf.force.values >= 0.1 * frf.force.values.max()][-1]
    for way in WAYS:
        start = time.process_time()
        try:
            bodies[way] = fi.Modes.from_frf(frf, mass=body.mass, points=[[0.0]], driving=0, pick=way == "picked")
        except ValueError as refused:
            print(f"  {seed} {way}: {str(refused)[:110]}")
        print(f"  {seed} {kind} {way} {time.process_time() - start:.1f} s", flush=True)
    for blow in range(n_blows):
        striker = fi.Striker.rigid(body.mass * float(np.exp(rng.uniform(*np.log([0.01, 1.0])))))
        stiffness = striker.mass * (np.pi / float(np.exp(rng.uniform(*np.log([3e-4, 5e-3]))))) ** 2
        law = fi.Contact.linear(stiffness)
        truth = struck(body, striker, law, 1e-4)
        for way, measured in bodies.items():
            found = struck(measured, striker, law, TOLERANCE)
            row = {"body": seed, "kind": kind, "band": float(used), "blow": blow, "way": way, "modes": measured.n_modes}
            row |= {"impacts": truth.n_impacts, "met": found.tolerance_met, **dict(judged(found, truth))}
            yield row


def told(rows: list[dict[str, Any]]) -> None:
    """Print how many true errors are within those stated."""
    print("| | blows | " + " | ".join(QUANTITIES) + " | all | met | median error stated of the force, true one |")
    print("|---|---|" + "---|" * (len(QUANTITIES) + 3))
    for way in WAYS:
        for again in (False, True):
            mine = [row for row in rows if row["way"] == way and (row["impacts"] > 1 or not again)]
            if not mine:
                continue
            held = np.array([[row[q] <= row[f"{q}_stated"] for q in QUANTITIES] for row in mine]).reshape(-1, 4)
            sizes = np.median([(row["force_stated"], row["force"]) for row in mine], axis=0)
            shares = [f"{100.0 * share:.1f} %" for share in [*held.mean(axis=0), held.all(axis=1).mean()]]
            met = sum(row["met"] for row in mine)
            name = f"{way}{', hit again' if again else ''}"
            print(f"| {name} | {len(mine)} | {' | '.join(shares)} | {met} | {sizes[0]:.1e}, {sizes[1]:.1e} |")


def main() -> None:
    """Measure random bodies and strike them; print a table and write a CSV."""
    parser = shared.parser(__doc__, shared.OUT)
    parser.add_argument("--bodies", type=int, default=30)
    parser.add_argument("--blows", type=int, default=10, help="on each")
    parser.add_argument("--first", type=int, default=0, help="body, by its number")
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    for seed in range(options.first, options.first + options.bodies):
        rows += rows_of(seed, options.blows)
        rounded = [{key: f"{x:.3g}" if isinstance(x, float) else x for key, x in row.items()} for row in rows]
        shared.write_rows(options.out / "measured_bodies.csv", rounded)
    told(rows)


if __name__ == "__main__":
    main()
