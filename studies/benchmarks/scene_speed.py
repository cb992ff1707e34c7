"""Measures what a user waits for: time and memory from a scene to the numbers of its blow, each in a new process.

    python studies/benchmarks/scene_speed.py [--only NAME ...] [--seconds 120] [--memory 16] [--ratio] [--repeats 1]

Runs the everyday scenes (`scenes/everyday/`) at a tolerance of 1e-2 and five more blows that ask for many short waves.
The time includes reading the scene, planning and striking, not the import and not writing files. A run that takes more
than ``--seconds``, or more than ``--memory`` gigabytes of address space besides the libraries, is stopped and counted
as such. With ``--ratio`` every blow is computed again through the modes of its body; the ratio is that time over the
other, of processor times. With ``--repeats`` the fastest run counts. Prints a table and writes the same as CSV. On a
machine that others use, processor times tell more than wall times; they are the same with OMP_NUM_THREADS=1.
"""

import argparse
import csv
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import fem_impact as fi
from fem_impact.model.playing import Strokes

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

# what interpreters say when they get no more of it; the last where Python makes a syntax tree
OVER = re.compile(r"emory|failed to map|field '\w+' is required for")
EVERYDAY_TOLERANCE = 1e-2  # [-] of every everyday scene, as their files say too
THROUGH_MODES = {"target": "modal"}  # what a plan needs so that the body's modes carry the blow
# the plate of frontier.py, by elements ("fe") or closed forms ("analytic")
FRONTIER = """
[mesh]
shape = "rectangle"
length = 1.55
width = 1.0
[target]
mass = 0.2
first_frequency = 100.0
source = "{source}"
[supports]
boundary = "hinged"
[striker]
kind = "rigid"
mass = 0.0333333333333333
[contact]
kind = "hertz"
stiffness = 695e3
[strike]
at = [0.465, 0.3]
speed = 1.0
"""
NAMED = {  # name: text of the scene, tolerances
    # a bronze disk (as the cymbals of scenes/everyday, without a hole) and the tip of a hickory stick; by elements, as
    # the closed form is the only shape that has one
    "bronze_disk": ("""
[mesh]
shape = "disk"
radius = 0.2
[material]
E = 110e9
nu = 0.34
rho = 8700.0
[section]
kind = "plate"
thickness = 1e-3
[target]
damping_ratio = 0.001
source = "fe"
[supports]
boundary = "hinged"
[striker]
kind = "stick"
mass = 0.05
first_frequency = 400.0
[contact]
kind = "hertz"
stiffness = 1.8e8
[strike]
at = [0.08, 0.06]
speed = 2.0
""", (1e-2, 1e-4)),
    # a steel ball of 1 cm on spruce of 3 mm; its contact is that with spruce across the grain, 0.85 GPa
    "ball_on_spruce": ("""
[mesh]
shape = "rectangle"
length = 0.4
width = 0.3
[supports]
boundary = "hinged"
[material]
E = 10.9e9
nu = 0.372
rho = 450.0
E_across = 0.85e9
G = 0.7e9
[section]
kind = "plate"
thickness = 3e-3
[target]
damping_ratio = 0.01
[striker]
kind = "sphere"
radius = 5e-3
E = 210e9
nu = 0.3
rho = 7850.0
[contact]
kind = "hertz"
stiffness = 9.1e7
[strike]
at = [0.15, 0.12]
speed = 1.0
""", (1e-2,)),
    "guitar_top": ((shared.SCENES / "guitar_top.toml").read_text(encoding="utf-8"), (1e-2,)),
    "frontier_plate": (FRONTIER.format(source="fe"), (1e-7,)),
}  # fmt: skip


@dataclass(frozen=True)
class Row:
    """What one scene cost and gave."""

    name: str
    tolerance: float  # [-]
    verdict: str  # "met", "missed", or why there are no numbers
    seconds: float | None = None  # [s] wall time
    processor: float | None = None  # [s] processor time of all threads and of the process that reads a file
    megabytes: float | None = None  # [MB] peak memory of the process
    error: float | None = None  # [-] estimated
    n_impacts: int | None = None
    restitution: float | None = None  # [-]
    target: str = ""  # how the body is modelled
    n_modes: int | None = None
    n_dofs: int | None = None
    processor_modes: float | None = None  # [s] processor time of the same through modes
    ratio: float | None = None  # [-] processor time through modes over that without


def cases(only: Sequence[str] = ()) -> dict[str, tuple[Path | str, float]]:
    """Name of every blow that has one of the given parts: path or text of its scene, and its tolerance [-]."""
    found: dict[str, tuple[Path | str, float]] = {path.stem: (path, EVERYDAY_TOLERANCE) for path in everyday()}
    for name, (text, tolerances) in NAMED.items():
        found |= {f"{name} {tolerance:g}": (text, tolerance) for tolerance in tolerances}
    return {name: case for name, case in found.items() if not only or any(part in name for part in only)}


def everyday() -> list[Path]:
    """Paths of the everyday scenes."""
    return sorted((shared.SCENES / "everyday").glob("*.toml"))


def processor() -> float:
    """Processor time [s] of this process and of those that it started and that have ended."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


def strike(path: Path, tolerance: float, changes: dict) -> dict:
    """Strike a scene in this process and return its part of a `Row`."""
    warnings.simplefilter("ignore", fi.ToleranceWarning)
    start, used = time.perf_counter(), processor()
    try:
        scene = fi.load_scene(path)
        if scene.stroke:
            return _played(scene.play(tolerance=tolerance), start)
        run = scene.run(tolerance=tolerance, **changes)
    except fi.SimulationError as error:
        return {"verdict": f"refused: {error}".replace(f"{path}: ", ""), "seconds": time.perf_counter() - start}
    except MemoryError:
        return {"verdict": "over memory", "seconds": time.perf_counter() - start}
    hit, plan = run.response, run.plan
    return {
        "verdict": "met" if hit.tolerance_met else "missed",
        "seconds": time.perf_counter() - start,
        "processor": processor() - used,
        "megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3,
        "error": hit.error.total,
        "n_impacts": hit.n_impacts,
        "restitution": hit.restitution,
        "target": plan.target,
        "n_modes": plan.n_modes,
        "n_dofs": plan.n_dofs,
    }


def _played(found: Strokes, start: float) -> dict:
    """The same of a sequence of strokes, which is always played on modes; no restitution is that of all."""
    return {
        "verdict": "met" if found.tolerance_met else "missed",
        "seconds": time.perf_counter() - start,
        "megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3,
        "error": found.error,
        "n_impacts": found.n_impacts,
        "target": "modal",
        "n_modes": found.target.n_modes,
    }


def measured(path: Path, tolerance: float, changes: dict, limits: tuple[float, float]) -> dict:
    """The same in a new process with limits on time [s] and address space [GB]."""
    command = [sys.executable, __file__, "--child", json.dumps([str(path), tolerance, changes, limits[1]])]
    places = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limits[0], env={**os.environ, **places})
    except subprocess.TimeoutExpired:
        return {"verdict": "over time", "seconds": limits[0]}
    if done.returncode:
        last = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
        return {"verdict": "over memory" if OVER.search(done.stderr) or done.returncode < 0 else f"failed: {last}"}
    return json.loads(done.stdout.splitlines()[-1])


def best(path: Path, tolerance: float, changes: dict, limits: tuple[float, float], repeats: int) -> dict:
    """The fastest of several runs; a run that gives no numbers is not repeated."""
    found: list[dict] = []
    while len(found) < repeats and all("error" in run for run in found):
        found.append(measured(path, tolerance, changes, limits))
    return min(found, key=lambda run: run.get("processor", 0.0))


def study(name: str, source: Path | str, tolerance: float, options: argparse.Namespace) -> Row:
    """Run one blow, and once more through modes if asked for."""
    limits = options.seconds, options.memory
    with tempfile.TemporaryDirectory() as folder:
        path = source if isinstance(source, Path) else Path(folder) / "scene.toml"
        if isinstance(source, str):
            meshes = shared.MESHES  # a text names its mesh as the scenes in scenes/ do
            path.write_text(source.replace("../../meshes", meshes.as_posix()), encoding="utf-8")
        row = Row(name, tolerance, **best(path, tolerance, {}, limits, options.repeats))
        if not options.ratio:
            return row
        other = best(path, tolerance, THROUGH_MODES, limits, options.repeats)
    if "error" not in other:
        return row
    ratio = other["processor"] / row.processor if row.processor else None
    return Row(**{**asdict(row), "processor_modes": other["processor"], "ratio": ratio})


def cells(row: Row) -> list[str]:
    """A row of the table as text."""
    shown = {
        "seconds": ".2f", "processor": ".2f", "megabytes": ".0f", "error": ".1e", "restitution": ".4f",
        "processor_modes": ".2f", "ratio": ".2f", "tolerance": ".0e",
    }  # fmt: skip
    values = asdict(row)
    return ["" if value is None else format(value, shown.get(name, "")) for name, value in values.items()]


def child(text: str) -> None:
    """One run, for `measured`."""
    path, tolerance, changes, memory = json.loads(text)
    reserved = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()  # by imported libraries
    resource.setrlimit(resource.RLIMIT_AS, (reserved + int(memory * 1e9),) * 2)
    print(json.dumps(strike(Path(path), tolerance, changes)))


def main() -> None:
    """Run the study from the command line."""
    parser = shared.parser(__doc__, shared.OUT / "scene_speed.csv")
    parser.add_argument("--seconds", type=float, default=120.0, help="limit of one run [s]")
    parser.add_argument(
        "--memory", type=float, default=16.0, help="limit of one run's address space, besides libraries [GB]"
    )
    parser.add_argument("--only", nargs="+", default=[], help="names, or parts of names, of the blows to run")
    parser.add_argument("--ratio", action="store_true", help="compute every blow again through modes")
    parser.add_argument("--repeats", type=int, default=1, help="runs of each blow; the fastest counts")
    parser.add_argument("--child", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        child(options.child)
        return
    names = [field.name for field in fields(Row)]
    fi.strike(fi.Modes.rigid(1.0), fi.Striker.rigid(0.1), fi.Contact.hertz(1e6), at=None, speed=1.0)  # compiles
    print("| " + " | ".join(names) + " |\n|" + "---|" * len(names), flush=True)
    with open(options.out, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(names)
        for name, (source, tolerance) in cases(options.only).items():
            row = study(name, source, tolerance, options)
            table.writerow(asdict(row).values())
            file.flush()
            print("| " + " | ".join(cells(row)) + " |", flush=True)


if __name__ == "__main__":
    main()
