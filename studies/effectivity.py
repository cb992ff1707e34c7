"""Checks tolerance, error estimate and cost of random scenes against much finer references.

    python studies/effectivity.py [--scenes 500] [--seed 1] [--by-elements] [--summary] [--out studies/out]

Prints the share of scenes whose true error is below the tolerance, the ratio of estimated to true error, every miss by
name, and the cost of the chosen model over that of the cheapest equally accurate setting; writes effectivity.csv, scene
by scene, and effectivity.png. An interrupted run goes on where it stopped; ``--summary`` only sums up what it has. The
scenes are one pseudo-random sequence, so that the first of them are as random as all.

They are TOML texts as a user would write them: hinged rectangles, disks with every edge support, beams with all end
supports and, by finite elements, a guitar top and a rectangle. A rigid mass strikes them through a linear or a Hertz
spring, soft to hard, at tolerances from 1e-2 to 1e-5 (finite elements: to 1e-3). Blows with more than three impacts are
followed up to the fourth and only counted. The reference uses a tenth of the tolerance with the modes and
elements that this needs. With ``--by-elements`` every scene is a rectangle or a disk by finite elements, seen through
Ritz vectors, at tolerances from 1e-1 to 1e-6 and with contacts up to twenty times as high as the first mode; the
reference is its closed form. For every tenth scene with closed forms, the study searches the cheapest setting among all
combinations of ten numbers of modes and seven steps.
"""

import argparse
import csv
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import astuple, dataclass
from functools import partial
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import drawing
import matplotlib.pyplot as plt
import numpy as np

import fem_impact as fi

GUITAR = Path(__file__).parents[1] / "meshes" / "guitar.msh"
TARGETS = {
    "rectangle": ('shape = "rectangle"\nlength = 0.465\nwidth = 0.3', 'boundary = "hinged"'),
    "clamped disk": ('shape = "disk"\nradius = 0.2', 'outer = "clamped"'),
    "hinged disk": ('shape = "disk"\nradius = 0.2', 'outer = "hinged"'),
    "free disk": ('shape = "disk"\nradius = 0.2', 'outer = "free"'),
    "free beam": ('shape = "line"\nlength = 0.4', 'left = "free"\nright = "free"'),
    "clamped beam": ('shape = "line"\nlength = 0.4', 'left = "clamped"\nright = "free"'),
    "hinged beam": ('shape = "line"\nlength = 0.4', 'left = "hinged"\nright = "hinged"'),
    "elements": ('shape = "rectangle"\nlength = 0.465\nwidth = 0.3', 'boundary = "hinged"'),
    "guitar": (f'shape = "file"\npath = "{GUITAR}"', 'body = "clamped"\nhole0 = "free"'),
}
PLATES = ("rectangle", "clamped disk", "hinged disk", "free disk")  # with a closed form and, on request, by elements
FINITE = {"elements": 0.02, "guitar": 0.02}  # [-] share of each finite-element scene
SCENE = """
[mesh]
{mesh}
[target]
mass = 0.2
first_frequency = 100.0
source = "{source}"
[supports]
{supports}
[striker]
kind = "rigid"
mass = {mass!r}
[contact]
kind = "{law}"
stiffness = {stiffness!r}
[strike]
at = {at}
speed = {speed!r}
tolerance = {tolerance!r}
"""
BEYOND = 0.1  # [-] reference tolerance over scene tolerance
WITHIN = (0.5, 20.0)  # [-] estimated over true error that counts as honest
HEADER = "scene", "tolerance", "impacts", "true error", "estimated error", "remark", "seconds over the cheapest"
CHAOTIC = 3  # [-] scenes with more impacts are chaotic: they are only counted
SEARCHED = 10  # [-] one scene in so many gets a search for the cheapest setting
NUMBERS = (5, 10, 20, 40, 80, 160, 320, 640, 1280, 2560)  # [-] modes tried
STEPS = [0.5**n for n in range(1, 8)]  # [-] steps tried, as shares of the contact time


@dataclass(frozen=True)
class Case:
    """One scene with its tolerance, errors and cost."""

    name: str
    tolerance: float
    n_impacts: int
    true: float
    estimated: float
    remark: str = ""
    over: float = np.nan  # [-] seconds over those of the cheapest equally accurate setting


def random_scene(rng: np.random.Generator, by_elements: bool = False) -> tuple[str, str, float]:
    """A scene's name, text and tolerance."""
    rest = (1.0 - sum(FINITE.values())) / (len(TARGETS) - len(FINITE))
    target = str(rng.choice(list(TARGETS), p=[FINITE.get(name, rest) for name in TARGETS]))
    if by_elements:
        target = str(rng.choice(PLATES))
    mesh, supports = TARGETS[target]
    if target == "guitar":
        at = [float(rng.uniform(0.08, 0.14)), float(rng.uniform(-0.04, 0.04))]
    elif target in ("rectangle", "elements"):
        at = [float(rng.uniform(0.02, 0.445)), float(rng.uniform(0.02, 0.28))]
    elif "disk" in target:
        radius, angle = 0.19 * np.sqrt(rng.uniform()), rng.uniform(0.0, 2.0 * np.pi)
        at = [float(radius * np.cos(angle)), float(radius * np.sin(angle))]
    else:
        at = [float(rng.uniform(0.02, 0.38))]
    mass, speed = float(10 ** rng.uniform(-3, -2 if target in FINITE else -0.7)), float(10 ** rng.uniform(-1, 1))
    tolerance = float(10 ** rng.uniform(-3 if target in FINITE else -5, -2))
    duration = float(0.5 / 10 ** rng.uniform(1.7, 2.3 if target in FINITE else 3.0))
    if by_elements:
        tolerance, duration = float(10 ** rng.uniform(-6, -1)), float(0.5 / 10 ** rng.uniform(1.7, 3.3))
    law = str(rng.choice(["linear", "hertz"]))
    if law == "linear":
        stiffness = mass * (np.pi / duration) ** 2
    else:  # the same duration on a rigid wall: T = 3.218 (m**2 / (k**2 v))**(1/5)
        stiffness = mass / np.sqrt(speed) * (3.2180654597 / duration) ** 2.5
    text = SCENE.format(
        mesh=mesh,
        supports=supports,
        source="fe" if target in FINITE or by_elements else "analytic",
        mass=mass,
        law=law,
        stiffness=float(stiffness),
        at=at,
        speed=speed,
        tolerance=tolerance,
    )
    name = f"{target}, {law}, {1e3 * mass:.3g} g, {duration * 1e3:.3g} ms, tolerance {tolerance:.1e}"
    return name, text, tolerance


def difference(hit: fi.Response, other: fi.Response) -> float:
    """Error as the tolerance counts it: absolute in restitution, relative in impulse, contact time and peak force."""
    relative = (abs(getattr(hit, x) / getattr(other, x) - 1.0) for x in ("impulse", "contact_time", "peak_force"))
    return max(abs(hit.restitution - other.restitution), *relative)


def examine(name: str, text: str, tolerance: float, search: bool) -> Case:
    """Strike one scene and its reference; with ``search``, also find the cheapest equally accurate setting."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(text)
        scene = truth = fi.load_scene(path)
        if name.split(",")[0] in PLATES and 'source = "fe"' in text:
            path.write_text(text.replace('source = "fe"', 'source = "analytic"'))
            truth = fi.load_scene(path)
    try:
        if search:
            scene.strike(max_impacts=CHAOTIC + 1)  # so that imports and compilation are not timed
        start = time.perf_counter()
        hit = scene.strike(max_impacts=CHAOTIC + 1)
        seconds = time.perf_counter() - start
        if hit.n_impacts > CHAOTIC:
            return Case(name, tolerance, hit.n_impacts, np.nan, float(hit.error))
        finer = {"tolerance": BEYOND * tolerance, "max_impacts": hit.n_impacts + 2, "target": "modal"}
        reference = truth.strike(**finer)
    except (ValueError, fi.SimulationError) as error:
        return Case(name, tolerance, 0, np.nan, np.nan, str(error))
    remark = "" if hit.n_impacts == reference.n_impacts else f"{hit.n_impacts} impacts, reference {reference.n_impacts}"
    over = seconds / cheapest(scene, reference, tolerance) if search and 'source = "analytic"' in text else np.nan
    return Case(name, tolerance, hit.n_impacts, difference(hit, reference), float(hit.error), remark, over)


def cheapest(scene: fi.Scene, reference: fi.Response, tolerance: float) -> float:
    """Fewest seconds in which any number of modes and any step meet the tolerance; inf if none does."""
    best = np.inf
    for n_modes in NUMBERS:
        for step in STEPS:
            start = time.perf_counter()
            try:
                hit = scene.strike(n_modes=n_modes, dt=step * reference.contact_time, tolerance=1.0)
            except (ValueError, fi.SimulationError):
                continue
            seconds = time.perf_counter() - start
            if seconds < best and hit.n_impacts == reference.n_impacts and difference(hit, reference) <= tolerance:
                best = seconds
    return best


def study(n_scenes: int, seed: int, path: Path, workers: int | None = None, by_elements: bool = False) -> list[Case]:
    """Examine ``n_scenes`` random scenes but those already in the CSV file ``path``, which grows scene by scene."""
    rng = np.random.default_rng(seed)
    scenes = [(*random_scene(rng, by_elements), i % SEARCHED == 0 and not by_elements) for i in range(n_scenes)]
    known = {case.name: case for case in saved(path)}
    with ProcessPoolExecutor(workers) as pool, path.open("a", newline="") as file:
        rows = csv.writer(file)
        if not known:
            rows.writerow(HEADER)
        running = [pool.submit(examine, *scene) for scene in scenes if scene[0] not in known]
        for done in as_completed(running):
            case = done.result()
            known[case.name] = case
            rows.writerow(astuple(case))
            file.flush()
    return [known[scene[0]] for scene in scenes]


def saved(path: Path) -> list[Case]:
    """The cases that an earlier run wrote."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return [
            Case(name, float(tolerance), int(impacts), float(true), float(estimated), remark, float(over))
            for name, tolerance, impacts, true, estimated, remark, over in list(csv.reader(file))[1:]
        ]


def report(cases: list[Case]) -> str:
    """Summarise the cases and name every miss."""
    judged = [case for case in cases if np.isfinite(case.true) and case.n_impacts <= CHAOTIC]
    true, tolerance = np.array([c.true for c in judged]), np.array([c.tolerance for c in judged])
    ratio = np.array([c.estimated for c in judged]) / np.maximum(true, 1e-300)
    honest = (ratio >= WITHIN[0]) & (ratio <= WITHIN[1])
    refused = [case for case in cases if not np.isfinite(case.true) and case.n_impacts <= CHAOTIC]
    lines = [
        f"{len(cases)} scenes: {len(judged)} judged, {len(refused)} refused, "
        f"{len(cases) - len(judged) - len(refused)} with more than {CHAOTIC} impacts",
        f"true error within the tolerance: {np.mean(true <= tolerance):.1%}",
        f"estimated over true error within {WITHIN}: {honest.mean():.1%}, median {np.median(ratio):.2g}",
        f"estimate below half the true error: {np.mean(ratio < WITHIN[0]):.1%}",
    ]
    over = np.array([case.over for case in cases if np.isfinite(case.over) and case.over > 0.0])
    if over.size:
        lines.append(f"seconds over the cheapest equally accurate: median {np.median(over):.2g} in {over.size} scenes")
    lines += [
        f"  miss: {case.name}: true {case.true:.1e}, estimated {case.estimated:.1e} {case.remark}"
        for case in judged
        if case.true > case.tolerance
    ]
    return "\n".join(lines + [f"  refused: {case.name}: {case.remark}" for case in refused])


def draw(cases: list[Case], path: Path) -> None:
    """Draw estimated over true error and true error over tolerance."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained")
    judged = [case for case in cases if np.isfinite(case.true) and case.n_impacts <= CHAOTIC]
    true = np.maximum([case.true for case in judged], 1e-10)
    left.loglog(true, np.maximum([case.estimated for case in judged], 1e-10), "o", ms=4, alpha=0.6, label="scenes")
    right.loglog([case.tolerance for case in judged], true, "o", ms=4, alpha=0.6, label="scenes")
    span = np.array([1e-9, 1e-1])
    left.plot(span, span, "k-", lw=1, label="estimate = truth")
    left.fill_between(span, WITHIN[0] * span, WITHIN[1] * span, color="0.9", zorder=0, label="half to 20 times")
    right.plot(span, span, "k-", lw=1, label="truth = tolerance")
    left.set(xlabel="true error", ylabel="estimated error", xlim=span)
    right.set(xlabel="tolerance", ylabel="true error", xlim=(5e-7, 2e-1))
    for axes in (left, right):
        axes.legend(frameon=False)
    drawing.save(path, figure, dpi=120)


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--by-elements", action="store_true", help="only plates by elements, against closed forms")
    parser.add_argument("--summary", action="store_true", help="only sum up the scenes of an earlier run")
    parser.add_argument("--workers", type=int, help="number of processes (default: one per core)")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "out")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    name = "effectivity_by_elements" if options.by_elements else "effectivity"
    path = options.out / f"{name}.csv"
    finished = partial(study, options.scenes, options.seed, path, options.workers, options.by_elements)
    cases = saved(path) if options.summary else finished()
    print(report(cases))
    draw(cases, path.with_suffix(".png"))


if __name__ == "__main__":
    main()
