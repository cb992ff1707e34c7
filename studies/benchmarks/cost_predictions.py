"""Compares what plans predict, processor time and memory, with what their runs take, each in a new process.

    python studies/benchmarks/cost_predictions.py [--only NAME ...] [--all] [--built-in] [--repeats 2] [--out FILE]

Runs the scenes under `scenes/` and every second of `scenes/everyday/`, with ``--all`` every one, at their own
tolerance; then some of them, and the plate of `frontier.py` under soft and hard blows, at tighter ones. The time
is that of carrying out the plan: imports, planning and compilation are not counted, the last thanks to a rough run
before. It is processor time, because others on the machine do not change it much; the faster of the runs counts. A
prediction is right within a factor of two, or within a second if the run takes less than one. Unknowns and vectors (or
modes) are those of the plan, which a longer blow needs more of, and those that the run ended with. Measures the machine
first, unless ``--built-in`` is given. Prints a table and writes the same as CSV.
"""

import argparse
import csv
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Sequence
from pathlib import Path

import scene_speed

import fem_impact as fi
from fem_impact.model import cost

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

FACTOR, SECOND = 2.0, 1.0  # [-], [s] accepted ratio of seconds or memory; accepted difference of cheap runs
ROUGH = 0.1  # [-] tolerance of the uncounted run
TIGHT = [  # scenes or stiffness [N/m^1.5] of a contact on the plate of frontier.py, and tolerances
    *[("drumstick", 1e-6), ("guitar_top", 1e-4), ("hammer_car_bonnet", 1e-4)],
    *[(2e4, 10.0**-n) for n in (2, 4, 6)],
    *[(695e3, 10.0**-n) for n in (2, 3, 4, 5, 6)],
    *[(5e7, 10.0**-n) for n in (2, 3, 4)],
]
COLUMNS = (
    "scene", "tolerance", "target", "unknowns", "of the run", "vectors", "of the run",
    "predicted s", "measured s", "ratio", "predicted MB", "measured MB", "ratio of MB",
    "right",
)  # fmt: skip


def scenes(whole: bool = False, only: Sequence[str] = ()) -> list[Path]:
    """Paths of the scenes to run."""
    everyday = sorted((shared.SCENES / "everyday").glob("*.toml"))
    found = [*sorted((shared.SCENES).glob("*.toml")), *everyday[:: 1 if whole else 2]]
    single = [path for path in found if "[[stroke]]" not in path.read_text(encoding="utf-8")]
    return [path for path in single if not only or any(part in path.stem for part in only)]


def tight(folder: Path, only: Sequence[str] = ()) -> list[tuple[Path, float]]:
    """Paths of the scenes to run at tighter tolerances; those of the plate are written into a folder."""
    found = []
    for body, tolerance in TIGHT:
        if isinstance(body, str):
            path = next((shared.SCENES).rglob(f"{body}.toml"))
        else:
            path = folder / f"plate_{body:.0e}.toml"
            path.write_text(scene_speed.FRONTIER.format(source="fe").replace("695e3", f"{body:g}"))
        if not only or any(part in path.stem for part in only):
            found.append((path, tolerance))
    return found


def examine(path: Path, tolerance: float | None) -> dict:
    """Plan and run a scene in this process: its target, predicted and measured seconds and bytes."""
    warnings.simplefilter("ignore", fi.ToleranceWarning)
    plan = fi.load_scene(path).plan(tolerance=tolerance)
    fi.load_scene(path).run(
        tolerance=ROUGH, target=plan.target
    )  # compiles what this scene needs, or reads it from disk
    start = time.process_time()
    done = plan.run().plan
    seconds = time.process_time() - start
    return {
        "target": plan.target,
        "tolerance": plan.tolerance,
        "model": (plan.n_dofs, done.n_dofs, plan.n_modes, done.n_modes),
        "predicted": (plan.seconds, plan.memory),
        "measured": (seconds, 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss),
    }


def examined(path: Path, tolerance: float | None, repeats: int) -> dict:
    """The fastest of several runs, each in a new process."""
    command = [sys.executable, __file__, "--child", str(path), *(["--tolerance", repr(tolerance)] if tolerance else [])]
    places = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    found = []
    for _ in range(repeats):
        done = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, **places})
        found.append(json.loads(done.stdout.splitlines()[-1]))
    return min(found, key=lambda run: run["measured"][0])


def right(predicted: float, measured: float, slack: float = 0.0) -> bool:
    """Whether a prediction is within FACTOR of a measurement, or both are less than ``slack`` apart and cheap."""
    near = measured < slack and abs(predicted - measured) < slack
    return near or 1.0 / FACTOR <= predicted / measured <= FACTOR


def cells(name: str, found: dict) -> list[str]:
    """A row of the table."""
    (seconds, memory), (took, used) = found["predicted"], found["measured"]
    verdict = "yes" if right(seconds, took, SECOND) else "no"
    return [
        name, f"{found['tolerance']:g}", found["target"], *map(str, found["model"]),
        f"{seconds:.2f}", f"{took:.2f}", f"{seconds / took:.2f}",
        f"{memory / 1e6:.0f}", f"{used / 1e6:.0f}", f"{memory / used:.2f}", verdict,
    ]  # fmt: skip


def main() -> None:
    """Run the study from the command line."""
    parser = shared.parser(__doc__, shared.OUT / "cost_predictions.csv")
    parser.add_argument("--only", nargs="+", default=[], help="names, or parts of names, of the scenes to run")
    parser.add_argument("--all", action="store_true", help="run all everyday scenes")
    parser.add_argument("--built-in", action="store_true", help="do not measure this machine")
    parser.add_argument("--repeats", type=int, default=2, help="runs of each scene; the fastest counts")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--tolerance", type=float, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        print(json.dumps(examine(options.child, options.tolerance)))
        return
    if not options.built_in:
        kept = "kept" if cost.calibrate() else "not kept"
        print(
            f"this machine over that of the built-in rates ({kept}): {(cost.read_machine() or cost.REFERENCE).slower}"
        )
    rows, memories, runs = [], [], []
    print("| " + " | ".join(COLUMNS) + " |\n|" + "---|" * len(COLUMNS), flush=True)
    with tempfile.TemporaryDirectory() as folder:
        own = [(path, None) for path in scenes(options.all, options.only)]
        for path, tolerance in [*own, *tight(Path(folder), options.only)]:
            runs.append(examined(path, tolerance, options.repeats))
            rows.append(cells(path.stem, runs[-1]))
            memories.append(right(runs[-1]["predicted"][1], runs[-1]["measured"][1]))
            print("| " + " | ".join(rows[-1]) + " |", flush=True)
    times = sum(row[-1] == "yes" for row in rows)
    print(f"{times} of {len(rows)} times and {sum(memories)} of {len(rows)} memories are predicted within {FACTOR:g}")
    with open(options.out, "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])


if __name__ == "__main__":
    main()
