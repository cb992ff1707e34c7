"""Checks tolerance, error estimate and cost of random scenes against much finer references.

    python studies/verification/effectivity.py [--scenes 0] [--first 0] [--by-elements] [--file effectivity.csv]

Examines that many scenes, from that number on, and appends a line for each to the file. Then prints what all lines of
the file say and draws them: the share of scenes whose true error is below the tolerance, the ratio of estimated to true
error, every miss by name, and the cost. Without --scenes it only does this. Scenes that were examined by code that
estimated errors in another way are told apart.

Scenes are TOML texts as a user would write them: hinged rectangles, disks with every edge support, beams with all end
supports and, by finite elements, a guitar top and a rectangle. A rigid mass strikes them through a linear or a Hertz
spring, soft to hard, at tolerances from 1e-2 to 1e-5 (finite elements: to 1e-3). The reference uses a tenth of the
tolerance with the modes and elements that this needs. It comes first: blows with more than three impacts are followed
up to the fourth and only counted. For every tenth scene with closed forms, the study searches the cheapest setting
among all combinations of ten numbers of modes and seven steps.

With --by-elements every scene is a rectangle or a disk by finite elements, seen through Ritz vectors, at tolerances
from 1e-1 to 1e-6 and with contacts up to twenty times as high as the first mode; the reference is its closed form. The
error that this states of itself is at most a thirtieth of the tolerance and of the error that the scene states: enough
to tell whether the latter is twenty times too large. Scene and reference may each take a minute of processor time; what
takes longer is told and not judged.
"""

import signal
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from fit_coverage import share

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

GUITAR = shared.MESHES / "guitar.msh"
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
FIRST_FREQUENCY = 100.0  # [Hz]
SCENE = """
[mesh]
{mesh}
[target]
mass = 0.2
first_frequency = {first_frequency!r}
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
BEYOND_CLOSED = 1.0 / 30.0  # [-] error that a closed form states over the scene's tolerance and stated error
WITHIN = (0.5, 20.0)  # [-] estimated over true error that counts as honest
CHAOTIC = 3  # [-] scenes with more impacts are chaotic: they are only counted
HARD = 10.0  # [-] pitch from which a contact is hard
LIMIT = 60.0  # [s] of processor time for a scene, and for its reference
ESTIMATES = "each cause by two comparisons"  # how errors are estimated: changes with the code
SEARCHED = 10  # [-] one scene in so many gets a search for the cheapest setting
NUMBERS = (5, 10, 20, 40, 80, 160, 320, 640, 1280, 2560)  # [-] modes tried
STEPS = [0.5**n for n in range(1, 8)]  # [-] steps tried, as shares of the contact time


@dataclass(frozen=True)
class Scene:
    """A random scene."""

    name: str
    text: str
    tolerance: float
    pitch: float  # [-] contact resonance on a wall over the first frequency


@dataclass(frozen=True)
class Case:
    """What was found of one scene: a line of the file."""

    number: int
    name: str
    tolerance: float
    pitch: float
    verdict: str  # "judged", "chaotic", "no reference", "refused" or "over time"
    target: str = ""  # "vectors" or "other"
    impacts: int = 0
    true: float = np.nan
    estimated: float = np.nan
    met: bool = False  # whether the scene says that it met its tolerance
    reference: float = np.nan  # error that the reference states
    seconds: float = np.nan  # [s] of processor time
    reference_seconds: float = np.nan  # [s] of processor time
    over: float = np.nan  # [-] seconds over those of the cheapest equally accurate setting
    remark: str = ""
    estimates: str = ESTIMATES  # of the code that judged the scene


class OverTime(Exception):
    """A blow took too long."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise OverTime after so many seconds of processor time."""

    late = OverTime(f"no answer within {seconds:g} s of processor time")
    told = False

    def stop(*_: object) -> None:
        nonlocal told
        told = True
        raise late

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    except SystemError:  # what a kernel makes of it while it is being called
        if told:
            raise late from None
        raise
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def random_scene(number: int, by_elements: bool = False) -> Scene:
    """The scene of this number."""
    rng = np.random.default_rng([1, number])
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
        first_frequency=FIRST_FREQUENCY,
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
    return Scene(name, text, tolerance, 0.5 / duration / FIRST_FREQUENCY)


def difference(hit: fi.Response, other: fi.Response) -> float:
    """Error as the tolerance counts it: absolute in restitution, relative in impulse, contact time and peak force."""
    relative = (abs(getattr(hit, x) / getattr(other, x) - 1.0) for x in ("impulse", "contact_time", "peak_force"))
    return max(abs(hit.restitution - other.restitution), *relative)


def examine(number: int, by_elements: bool = False) -> Case:
    """Strike one scene and its reference; for every tenth scene, find the cheapest equally accurate setting."""
    made = random_scene(number, by_elements)
    case = Case(number, made.name, made.tolerance, made.pitch, "no reference")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(made.text)
        scene = truth = fi.load_scene(path)
        if by_elements:
            path.write_text(made.text.replace('source = "fe"', 'source = "analytic"'))
            truth = fi.load_scene(path)
    beyond = BEYOND_CLOSED if by_elements else BEYOND
    try:
        reference, spent = struck(truth, tolerance=beyond * made.tolerance, target="modal")
        case = replace(case, impacts=reference.n_impacts, reference_seconds=spent)
        if reference.n_impacts > CHAOTIC:
            return replace(case, verdict="chaotic")
        case = replace(case, verdict="refused")
        hit, seconds = struck(scene)
        estimated = float(hit.error)
        case = replace(case, verdict="no reference", estimated=estimated, seconds=seconds, met=hit.tolerance_met)
        if by_elements and float(reference.error) > beyond * estimated:
            reference, more = struck(truth, tolerance=beyond * min(made.tolerance, estimated), target="modal")
            case = replace(case, reference_seconds=spent + more)
    except OverTime as late:
        if case.verdict == "refused":
            return replace(case, verdict="over time", seconds=LIMIT, remark=str(late))
        return replace(case, reference_seconds=LIMIT, remark=str(late))
    except (ValueError, fi.SimulationError) as error:
        return replace(case, remark=str(error).replace(f"{path}: ", ""))
    if not reference.tolerance_met:
        return replace(case, remark="the reference misses its tolerance")
    searched = number % SEARCHED == 0 and 'source = "analytic"' in made.text
    return replace(
        case,
        verdict="judged",
        target="other" if hit.vectors is None else "vectors",
        true=difference(hit, reference),
        reference=float(reference.error),
        over=seconds / cheapest(scene, reference, made.tolerance) if searched else np.nan,
        remark=f"{hit.n_impacts} impacts" if hit.n_impacts != reference.n_impacts else "",
    )


def struck(scene: fi.Scene, **how: Any) -> tuple[fi.Response, float]:
    """A blow up to the impact after the last that is judged, and seconds of processor time."""
    with at_most(LIMIT), warnings.catch_warnings():
        warnings.simplefilter("ignore", fi.ToleranceWarning)
        seconds, hit = shared.timed(lambda: scene.strike(max_impacts=CHAOTIC + 1, **how))
    return hit, seconds


def cheapest(scene: fi.Scene, reference: fi.Response, tolerance: float) -> float:
    """Fewest seconds in which any number of modes and any step meet the tolerance; inf if none does."""
    best = np.inf
    for n_modes in NUMBERS:
        for step in STEPS:
            how = {"n_modes": n_modes, "dt": step * reference.contact_time, "tolerance": 1.0}
            try:
                seconds, hit = shared.timed(partial(scene.strike, **how))
            except (ValueError, fi.SimulationError):
                continue
            if seconds < best and hit.n_impacts == reference.n_impacts and difference(hit, reference) <= tolerance:
                best = seconds
    return best


def judge(cases: list[Case]) -> str:
    """Shares of cases within the tolerance, and with an honest estimate."""
    ratio, (low, high) = ratios(cases), WITHIN
    kept = share(sum(case.true <= case.tolerance for case in cases), len(cases))
    honest = share(int(((ratio >= low) & (ratio <= high)).sum()), len(cases))
    return (
        f"within the tolerance {kept}; estimate over truth in {low:g} ... {high:g} {honest}, "
        f"below {np.mean(ratio < low):.1%}, median {np.median(ratio):.2g}"
    )


def ratios(cases: list[Case]) -> np.ndarray:
    """Estimated over true errors [-]."""
    return np.array([case.estimated for case in cases]) / np.maximum([case.true for case in cases], 1e-300)


def report(cases: list[Case]) -> str:
    """Summarise the cases and name every miss."""
    judged = [case for case in cases if case.verdict == "judged"]
    counts = Counter(case.verdict for case in cases)
    lines = [f"{len(cases)} scenes: " + ", ".join(f"{count} {name}" for name, count in counts.most_common())]
    hard = f"contacts at {HARD:g} times the first mode and harder"
    groups = {"all": judged, hard: [case for case in judged if case.pitch >= HARD]}
    for impacts in range(1, CHAOTIC + 1):
        groups[f"{impacts} impacts"] = [case for case in judged if case.impacts == impacts]
    for power in range(-6, -1):
        some = [case for case in judged if 10.0**power <= case.tolerance < 10.0 ** (power + 1)]
        groups[f"tolerances 1e{power} to 1e{power + 1}"] = some
    lines += [f"{name}: {judge(some)}" for name, some in groups.items() if some]
    times = [np.nanmean([getattr(case, name) for case in cases]) for name in ("seconds", "reference_seconds")]
    lines.append("seconds of processor time: mean {:.2g} of a scene, {:.2g} of its reference".format(*times))
    over = np.array([case.over for case in cases if np.isfinite(case.over) and case.over > 0.0])
    if over.size:
        lines.append(f"seconds over the cheapest equally accurate: median {np.median(over):.2g} in {over.size} scenes")
    for case, ratio in zip(judged, ratios(judged)):
        if case.true > case.tolerance or not WITHIN[0] <= ratio <= WITHIN[1]:
            kind = "far" if case.true <= case.tolerance else "miss" if case.met else "told miss"
            told = f"true {case.true:.1e}, estimated {case.estimated:.1e} ({ratio:.2g}) {case.remark}"
            lines.append(f"  {kind}: {case.number} {case.name}: {told}")
    rest = [case for case in cases if case.verdict not in ("judged", "chaotic")]
    return "\n".join(lines + [f"  {case.verdict}: {case.number} {case.name}: {case.remark}" for case in rest])


def draw(cases: list[Case], path: Path) -> None:
    """Draw estimated over true error and true error over tolerance."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained")
    judged = [case for case in cases if case.verdict == "judged"]
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
    shared.save(path, figure, dpi=120)


def main(arguments: list[str] | None = None) -> list[Case]:
    """Run the study from the command line."""
    parser = shared.parser(__doc__, shared.PICTURES)
    parser.add_argument("--scenes", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--by-elements", action="store_true", help="only plates by elements, against closed forms")
    parser.add_argument("--file", type=Path)
    options = parser.parse_args(arguments)
    name = "effectivity_by_elements" if options.by_elements else "effectivity"
    path = options.file or Path(__file__).with_name(f"{name}.csv")
    for number in range(options.first, options.first + options.scenes):
        shared.write_rows(path, [examine(number, options.by_elements)], append=True)
    cases = shared.read_rows(path, Case)
    for estimates in dict.fromkeys(case.estimates for case in cases):
        print(f"{estimates}:\n" + report([case for case in cases if case.estimates == estimates]))
    draw(cases, options.out / f"{name}.png")
    return cases


if __name__ == "__main__":
    main()
