"""Measures what uncertain inputs do to a blow, how long that takes, and how exact the chance of a double hit is.

    python studies/figures/uncertain_blow.py [--blows 100000]   prints times and statistics, draws a picture
    python studies/figures/uncertain_blow.py --centroid         the time that the spectral centroid adds

Stick and hinged plate of 200 g of *Euphonics* 12.1, 300 modes, Hertz contact, tolerance 1e-3; stiffness, masses, speed
and damping are known to some percent. Times are the best of three runs and do not include compilation. The share of
double hits over the stiffness alone is compared with a map of 20 000 cells.
"""

import os
import sys
import time
from pathlib import Path

import numpy as np
import source_scenes as source
from scipy import stats

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

KNOWN = {  # how well each input is known: median and deviation of the logarithm, or mean and deviation
    "contact.stiffness": ("lognormal", source.MARKED_HERTZ[1], 0.3),
    "striker.mass": ("normal", 0.1, 0.005),
    "target.mass": ("lognormal", 0.2, 0.1),
    "target.first_frequency": ("normal", 100.0, 3.0),
    "strike.speed": ("normal", 5.0, 0.25),
}
DAMPED = {**KNOWN, "target.damping_ratio": ("lognormal", 0.005, 0.3)}
PICTURE = shared.PICTURES / "uncertain_blow.png"


def spread(vary, n, **wanted):
    """A spread of the stick's blow on the plate of 200 g."""
    plate, blow = source.plate(0.2, damping_ratio=0.005), {"at": source.AT, "speed": 5.0}
    return fi.spread(plate, vary, source.stick(), source.HERTZ, n=n, **blow, **wanted)


def chance_from_map(n_cells=20_000, sigma=1.0):
    """Chance of a double hit if only the stiffness is uncertain: from a spread, and from a map weighted by its law."""
    law = {"contact.stiffness": ("lognormal", source.MARKED_HERTZ[1], sigma)}
    found = spread(law, 8192, sobol=False).chance()
    share = (np.arange(n_cells) + 0.5) / n_cells
    stiffness = stats.lognorm(sigma, scale=source.MARKED_HERTZ[1]).ppf(share)
    plate = source.plate(0.2, damping_ratio=0.005)
    table = fi.sweep(plate, source.stick(), source.HERTZ, at=source.AT, speed=5.0, over={"stiffness": stiffness})
    return found, float((table.n_impacts > 1).mean())


def timed(repeats, *arguments, **wanted):
    """Shortest wall time and computing time of all threads [s] of several runs, and what the last one found."""
    times, work = [], []
    for _ in range(repeats):
        began = time.perf_counter(), time.process_time()
        found = spread(*arguments, **wanted)
        times.append(time.perf_counter() - began[0])
        work.append(time.process_time() - began[1])
    return (min(times), min(work)), found


def main():
    """Print times and statistics; draw the picture."""
    parser = shared.parser(__doc__)
    parser.add_argument("--blows", type=int, default=100_000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--centroid", action="store_true")
    wanted = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    spread(DAMPED, 256)
    few = {name: KNOWN[name] for name in ("contact.stiffness", "striker.mass", "strike.speed")}
    if wanted.centroid:
        seconds = [timed(1, few, 1024, sobol=False, max_frequency=band)[0][1] for band in (None, source.BAND)]
        print(f"1024 blows: {seconds[0]:.2f} s of computing, with the spectral centroid {seconds[1]:.2f} s")
        return
    for title, vary in (("striker and contact", few), ("body too", KNOWN), ("damping too", DAMPED)):
        for sobol in (False, None):
            (seconds, work), found = timed(wanted.repeats, vary, wanted.blows, sobol=sobol)
            began = time.perf_counter()
            found.summary()
            print(
                f"{title}, {len(vary)} inputs, {'with' if found.crossed else 'without'} Sobol indices: "
                f"{found.n_blows} blows in {seconds:.2f} s ({work:.2f} s of computing in all threads), "
                f"statistics in {time.perf_counter() - began:.2f} s"
            )
    print(found.summary())
    shared.save(PICTURE, fi.figures.spread(found))
    (value, low, high), exact = chance_from_map()
    print(
        f"chance of a double hit: {100 * value:.2f} % ({100 * low:.2f} to {100 * high:.2f} %), map {100 * exact:.2f} %"
    )


if __name__ == "__main__":
    main()
