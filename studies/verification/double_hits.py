"""What a second pulse of the hammer costs a frequency response: nothing but where the force is not known.

    python studies/verification/double_hits.py [--rigs 12] [--out DIR]

Simulated: hammers drawn at random bounce on plates of twelve modes and hit twice; four blows of each are recorded by
`fi.measure`. The same blows without the second impact are the single hits. Errors of `fi.frf` are those from the exact
accelerance, over its own size (root mean squares up to 2 kHz, where the single hits have a tenth of their largest force
spectrum). "Known" is the part of it outside the holes, where the double hits have as much. "Held" is the share of lines
whose true error is within the one stated.

Measured: taps of `studies/measured/acceleration_multi.lvm`. A record plus another one, smaller and delayed, is what a
double hit would have read, as the structure is linear. Each pair of taps gives a response, and the other pair, single
or made double, another: their difference is that of the rig, unless the second pulse costs something.

Prints both tables and writes CSV.
"""

import sys
from collections.abc import Iterator, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

RATE, DURATION = 12800.0, 0.8  # [Hz], [s] of simulated records: all modes have died
TOP = 2000.0  # [Hz]
POWER = 0.1  # [-] of the largest force spectrum of single hits: what lies lower tells little
CASES = {  # noise of force and response over their peaks, and what else goes wrong
    "noise of the response 0.3 %": (0.0, 0.003, ""),
    "noise of the force 0.1 %": (0.001, 0.0, ""),
    "noise of the force 1 %": (0.01, 0.0, ""),
    "one tap only, noise of both 0.1 %": (0.001, 0.001, "alone"),
    "record ends 30 ms after the last pulse": (0.0, 0.0, "short"),
    "force of the first pulse only": (0.0, 0.0, "first"),
}
SHARES, DELAYS = (0.3, 0.6, 0.9), (1.2e-3, 2e-3, 2.8e-3)  # [-], [s] of the second pulse made of measured ones
FADE = 1.5e-3  # [s] exponential window: measured records end after 12 ms
Hits = list[fi.Response]


def rig(seed: int) -> tuple[fi.Modes, Hits, Hits]:
    """A random plate, and four blows that hit it twice, and the same that hit it once."""
    rng = np.random.default_rng(seed)
    plate = fi.analytic.rectangle(0.4, 0.3, mass=0.5, first_frequency=rng.uniform(80.0, 200.0), n_modes=12)
    rows = plate.shape_at(rng.uniform(0.15, 0.5, (2, 2)) * (0.4, 0.3))
    body = fi.Modes.from_arrays(
        plate.frequencies, rows, points=[[0.0], [1.0]], mass=0.5, damping_ratio=0.02, complete=True
    )
    while True:
        hammer = fi.Striker.rigid(float(np.exp(rng.uniform(*np.log([0.05, 1.0])))))
        law = fi.Contact.hertz(float(np.exp(rng.uniform(*np.log([3e6, 3e8])))))
        speeds = rng.uniform(0.5, 2.0, 4).tolist()
        double = list(blows(body, hammer, law, speeds, 3))
        if all(hit.n_impacts == 2 for hit in double):
            return body, double, list(blows(body, hammer, law, speeds, 1))


def blows(
    body: fi.Modes, hammer: fi.Striker, law: fi.Contact, speeds: Sequence[float], n: int
) -> Iterator[fi.Response]:  # fmt: skip
    """One blow for each speed, of at most n impacts; ends with the first that does not hit twice, if it may."""
    for speed in speeds:
        hit = fi.strike(body, hammer, law, at=[0.0], speed=speed, tolerance=1e-4, max_impacts=n)
        yield hit
        if n > 1 and hit.n_impacts != 2:
            return


def recorded(hits: Hits, seed: int, noise: tuple[float, float], wrong: str) -> fi.Taps:
    """The taps as the rig records them."""
    rows = []
    ends = 5e-3 + 0.03 + max(impact.end for hit in hits for impact in hit.impacts)
    for i, hit in enumerate(hits[: 1 if wrong == "alone" else None]):
        tap = fi.measure(hit, rate=RATE, at=[[1.0]], duration=ends if wrong == "short" else DURATION, before=5e-3)
        rng, parts = np.random.default_rng([seed, i]), (tap.force[0], tap.response[0, :, 0])
        rows.append([x + each * np.abs(x).max() * rng.standard_normal(len(x)) for x, each in zip(parts, noise)])
        if wrong == "first":
            rows[-1][0] *= tap.time < 5e-3 + hit.impacts[0].end + 3.0 / RATE  # samples, in which the filter rings
    force, response = np.moveaxis(np.array(rows), 1, 0)
    return fi.Taps.from_arrays(force, response, rate=RATE)


def simulated(seed: int) -> list[dict[str, float | str]]:
    """Errors of single and double hits on one rig, case by case."""
    body, *kinds = rig(seed)
    clean = [fi.frf(recorded(hits, seed, (0.0, 0.0), "")) for hits in kinds]
    known, force = clean[1].frequency.values, [found.force.values for found in clean]
    rows: list[dict[str, float | str]] = []
    for case, (*noise, wrong) in CASES.items():
        line: dict[str, float | str] = {"rig": seed, "case": case}
        for name, hits in zip(("double", "single"), kinds):
            found = fi.frf(recorded(hits, seed, (noise[0], noise[1]), wrong))
            frequency = found.frequency.values
            two, one = (np.interp(frequency, known, each) for each in force)
            band = (frequency > 40.0) & (frequency < TOP) & (one > POWER * one.max())
            exact = fi.mobility(body, [0.0], [1.0], np.maximum(frequency, 1.0), "accelerance")
            off, whole = np.abs(found.H.values[:, 0] - exact), np.linalg.norm(exact[band])
            line[name] = float(np.linalg.norm(off[band]) / whole)
            line[f"{name}_known"] = float(np.linalg.norm(off[band & (two > POWER * one.max())]) / whole)
            line[f"{name}_held"] = float(np.mean((off <= found.error.values[:, 0])[band]))
        rows.append(line)
    return rows


def doubled(taps: fi.Taps, share: float, delay: float, counted: bool, noise: float) -> fi.Taps:
    """Double hits made of two single ones, either first; ``counted`` tells whether the second pulse was recorded."""
    n, rng = round(delay * taps.rate), np.random.default_rng(0)
    late = [np.roll(rows[::-1], n, axis=1) for rows in (taps.force, taps.response)]
    for rows in late:
        rows[:, :n] = 0.0
    force = taps.force + counted * share * late[0]
    force += noise * force.max(axis=1, keepdims=True) * rng.standard_normal(force.shape)
    return fi.Taps.from_arrays(force, taps.response + share * late[1], rate=taps.rate)


def measured() -> list[dict[str, float | str]]:
    """How much responses of two pairs of measured taps differ, with the second pair single or made double."""
    taps = fi.read_taps(shared.STUDIES / "measured" / "acceleration_multi.lvm")
    rows: list[dict[str, float | str]] = []
    for noise in (0.0, 0.01):
        sums: dict[str, list[float]] = {"single": [], "double": [], "not counted": []}
        for pair in combinations(range(taps.n_taps), 2):
            rest = taps.pick([i for i in range(taps.n_taps) if i not in pair])
            reference = fi.frf(taps.pick(list(pair)), response_window=FADE)
            band = reference.force.values > POWER * reference.force.values.max()
            for share, delay in ((a, t) for a in SHARES for t in DELAYS):
                kinds = (doubled(rest, 0.0, 0.0, True, noise), doubled(rest, share, delay, True, noise),
                         doubled(rest, share, delay, False, noise))  # fmt: skip
                for name, kind in zip(sums, kinds):
                    apart = (fi.frf(kind, response_window=FADE).H.values - reference.H.values)[band]
                    sums[name].append(float(np.linalg.norm(apart) / np.linalg.norm(reference.H.values[band])))
        rows.append({"noise": noise} | {name: float(np.sqrt(np.mean(np.square(x)))) for name, x in sums.items()})
    return rows


def main() -> None:
    """Judge random rigs and the measured taps; print two tables and write CSV."""
    parser = shared.parser(__doc__, shared.OUT)
    parser.add_argument("--rigs", type=int, default=12)
    options = parser.parse_args()
    rows = [row for seed in range(options.rigs) for row in simulated(seed)]
    print("| simulated, medians | single | double | single, known | double, known | single, held | double, held |")
    print("|---|---|---|---|---|---|---|")
    names = [f"{kind}{part}" for part in ("", "_known", "_held") for kind in ("single", "double")]
    for case in CASES:
        table = np.median([[row[name] for name in names] for row in rows if row["case"] == case], axis=0)
        print(f"| {case} | " + " | ".join(f"{100.0 * value:.2g} %" for value in table) + " |")
    taps = measured()
    print("\n| measured, added noise of the force | single | double | second pulse not counted |\n|---|---|---|---|")
    for row in taps:
        print("| " + " | ".join(f"{100.0 * float(value):.2g} %" for value in row.values()) + " |")
    options.out.mkdir(parents=True, exist_ok=True)
    shared.write_rows(options.out / "double_hits.csv", rows)
    shared.write_rows(options.out / "double_hits_measured.csv", taps)


if __name__ == "__main__":
    main()
