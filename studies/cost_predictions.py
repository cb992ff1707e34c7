"""Compares what plans predict, processor time and memory, with what their runs take, each in a new process.

    python studies/cost_predictions.py [--only NAME ...] [--all] [--built-in] [--repeats 2] [--out FILE]

Runs the scenes under `scenes/` and every second of `scenes/everyday/`, with ``--all`` every one. The time is that of
carrying out the plan: imports, compilation and planning are not counted. It is processor time, because others on the
machine do not change it much; the faster of the runs counts. A prediction is right within a factor of two, or within a
second if the run takes less than one. Measures the machine first, unless ``--built-in`` is given. Prints a table and
writes the same as CSV.
"""

import argparse
import csv
import json
import os
import resource
import subprocess
import sys
import time
import warnings
from collections.abc import Sequence
from pathlib import Path

import fem_impact as fi
from fem_impact.model import cost

HERE = Path(__file__).parent
FACTOR, SECOND = 2.0, 1.0  # [-], [s] accepted ratio of seconds or memory; accepted difference of cheap runs
COLUMNS = "scene", "target", "predicted s", "measured s", "ratio", "predicted MB", "measured MB", "ratio of MB", "right"


def scenes(whole: bool = False, only: Sequence[str] = ()) -> list[Path]:
    """Paths of the scenes to run."""
    everyday = sorted((HERE / "scenes" / "everyday").glob("*.toml"))
    found = [*sorted((HERE / "scenes").glob("*.toml")), *everyday[:: 1 if whole else 2]]
    return [path for path in found if not only or any(part in path.stem for part in only)]


def examine(path: Path) -> dict:
    """Plan and run a scene in this process: its target, predicted and measured seconds and bytes."""
    warnings.simplefilter("ignore", fi.ToleranceWarning)
    # the kernels are read from disk, as a strike of any scene needs them
    fi.strike(fi.Modes.rigid(1.0), fi.Striker.rigid(0.1), fi.Contact.hertz(1e6), at=None, speed=1.0)
    plan = fi.load_scene(path).plan()
    start = time.process_time()
    plan.run()
    seconds = time.process_time() - start
    return {
        "target": plan.target,
        "predicted": (plan.seconds, plan.memory),
        "measured": (seconds, 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss),
    }


def examined(path: Path, repeats: int) -> dict:
    """The fastest of several runs, each in a new process; the first may compile what this scene needs besides."""
    command = [sys.executable, __file__, "--child", str(path)]
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
        name, found["target"], f"{seconds:.2f}", f"{took:.2f}", f"{seconds / took:.2f}",
        f"{memory / 1e6:.0f}", f"{used / 1e6:.0f}", f"{memory / used:.2f}", verdict,
    ]  # fmt: skip


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", default=[], help="names, or parts of names, of the scenes to run")
    parser.add_argument("--all", action="store_true", help="run all everyday scenes")
    parser.add_argument("--built-in", action="store_true", help="do not measure this machine")
    parser.add_argument("--repeats", type=int, default=2, help="runs of each scene; the fastest counts")
    parser.add_argument("--out", type=Path, default=HERE / "out" / "cost_predictions.csv", help="CSV file")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        print(json.dumps(examine(options.child)))
        return
    if not options.built_in:
        kept = "kept" if cost.calibrate() else "not kept"
        print(f"this machine over that of the built-in rates ({kept}): {(cost.read() or cost.REFERENCE).slower}")
    rows, memories = [], []
    print("| " + " | ".join(COLUMNS) + " |\n|" + "---|" * len(COLUMNS), flush=True)
    for path in scenes(options.all, options.only):
        found = examined(path, options.repeats)
        rows.append(cells(path.stem, found))
        memories.append(right(found["predicted"][1], found["measured"][1]))
        print("| " + " | ".join(rows[-1]) + " |", flush=True)
    times = sum(row[-1] == "yes" for row in rows)
    print(f"{times} of {len(rows)} times and {sum(memories)} of {len(rows)} memories are predicted within {FACTOR:g}")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    with open(options.out, "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])


if __name__ == "__main__":
    main()
