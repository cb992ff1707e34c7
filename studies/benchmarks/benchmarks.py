"""Measures what the program's main acts cost, so that a change of the code that makes one dearer can be seen.

    python studies/benchmarks/benchmarks.py                  prints the table beside the one in benchmarks.csv
    python studies/benchmarks/benchmarks.py --keep           writes benchmarks.csv
    python studies/benchmarks/benchmarks.py --only strike    acts whose names hold the word

Processor time of one thread's work, the least of several runs, in units of a fixed sum of small NumPy calls and Python
loops timed in turn with it: the unit takes away most of the machine. Calls are those of Python functions, ours and the
libraries', that one act makes; they do not depend on the machine at all. The acts: the kernel, bare strikes and those
through a plan, a map of 10 000 blows, a spread, modes by elements, sound, a gradient, a fit's problem.
"""

import os
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one thread's time is what is told

import numpy as np

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared
from figures import source_scenes as source

TABLE = Path(__file__).parent / "benchmarks.csv"
REPEATS, LEAST = 7, 0.05  # [-] runs of which the fastest counts; [s] that a run takes at least

Act = Callable[[], object]


def unit() -> None:
    """What the other times are told in: half small NumPy calls, half plain Python."""
    values, total = np.linspace(0.1, 1.0, 300), 0.0
    for i in range(2000):
        total += float(values @ np.cos(values + i))
    for i in range(60_000):
        total += i % 7


def acts() -> dict[str, Act]:
    """The acts by name."""
    plate = source.plate(0.2, n_modes=300)
    stick, rigid, law = source.stick(), fi.Striker.rigid(0.033), fi.Contact.hertz(1e7)
    section = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), section, supports={"boundary": "hinged"})
    coarse = fi.assemble(fi.mesh.disk(0.2, size=0.04), section, supports={"boundary": "clamped"})
    blow = {"at": (0.1395, 0.09), "speed": 0.5}
    over = {"mass": np.linspace(10e-3, 200e-3, 100), "stiffness": np.geomspace(1e4, 1e6, 100)}
    linear = fi.Contact.linear(1e5)

    def strike(tolerance: float = 1e-3) -> fi.Response:
        return fi.strike(plate, rigid, law, at=source.AT, speed=1.0, tolerance=tolerance)

    hit = strike()
    return {
        "strike, bare modes, 1e-3": strike,
        "strike, bare modes, 1e-6": lambda: strike(1e-6),
        "strike, stick on the complete plate": lambda: fi.strike(system, stick, law, **blow, tolerance=1e-2),
        "plan": lambda: fi.plan(system, stick, law, **blow, tolerance=1e-2),
        "summary": lambda: hit.summary(),
        "gradient": lambda: hit.gradient("restitution"),
        "spectrum": lambda: hit.spectrum(np.linspace(20.0, 5e3, 256)),
        "sound, 1 s": lambda: fi.sound.synthesise(hit, at=source.AT, duration=1.0),
        "modes, 40 of a disk by elements": lambda: fi.find_modes(coarse, n_modes=40),
        "map of 10 000": lambda: fi.sweep(plate, stick, linear, at=source.AT, speed=1.0, over=over, tolerance=1e-3),
        "spread of 1 000": lambda: fi.spread(
            plate,
            {"contact.stiffness": "lognormal(1e5, 0.2)"},
            stick,
            linear,
            at=source.AT,
            speed=1.0,
            n=1000,
            sobol=False,
            tolerance=1e-3,
        ),
    }


def seconds(act: Act) -> float:
    """Processor time of one act: the mean of as many as last long enough."""
    count, start = 0, time.process_time()
    while (used := time.process_time() - start) < LEAST or not count:
        act()
        count += 1
    return used / count


def calls(act: Act) -> int:
    """Number of Python functions that one act calls."""
    count = 0

    def seen(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event == "call"

    sys.setprofile(seen)
    try:
        act()
    finally:
        sys.setprofile(None)
    return count


def main() -> None:
    """Time the acts in turn with the unit."""
    parser = shared.parser(__doc__)
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("--only", default="", metavar="WORD")
    wanted = parser.parse_args()
    warnings.simplefilter("ignore", fi.ToleranceWarning)  # 300 modes are too few for 1e-6
    before = {row["act"]: row for row in shared.read_rows(TABLE)}
    rows = []
    print(f"{'act':38}{'ms':>10}{'units':>9}{'before':>9}{'calls':>9}{'before':>9}")
    for name, act in acts().items():
        if wanted.only not in name:
            continue
        act(), act()
        pairs = [(seconds(act), seconds(unit)) for _ in range(REPEATS)]
        least, ruler = (min(times) for times in zip(*pairs))
        row = {"act": name, "units": f"{least / ruler:.4g}", "calls": str(calls(act))}
        rows.append(row)
        old = before.get(name, {"units": "", "calls": ""})
        print(
            f"{name:38}{1e3 * least:10.3f}{row['units']:>9}{old['units']:>9}{row['calls']:>9}{old['calls']:>9}",
            flush=True,
        )
    if wanted.keep:
        shared.write_rows(TABLE, rows)


if __name__ == "__main__":
    main()
