"""Does the promise hold, and is the estimate honest? Random scenes against references far beyond their tolerance.

    python studies/effectivity.py [--scenes 500] [--seed 1] [--out studies/out]

prints the share of scenes whose true error is below the tolerance, how the estimated error compares with the true one,
and every miss by name; writes effectivity.csv and effectivity.png. The scenes are read from TOML as a user would write
them: hinged rectangles, disks of every edge and beams of all ends, struck by a rigid mass through a linear or a Hertz
spring, from soft to hard. They take closed-form modes, so that their references, with a thirtieth of
the tolerance and modes to match, are cheap; the finite elements' own error has its own tests.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import fem_impact as fi

TARGETS = {
    "rectangle": ('shape = "rectangle"\nlength = 0.465\nwidth = 0.3', 'boundary = "hinged"'),
    "clamped disk": ('shape = "disk"\nradius = 0.2', 'outer = "clamped"'),
    "hinged disk": ('shape = "disk"\nradius = 0.2', 'outer = "hinged"'),
    "free disk": ('shape = "disk"\nradius = 0.2', 'outer = "free"'),
    "free beam": ('shape = "line"\nlength = 0.4', 'left = "free"\nright = "free"'),
    "clamped beam": ('shape = "line"\nlength = 0.4', 'left = "clamped"\nright = "free"'),
    "hinged beam": ('shape = "line"\nlength = 0.4', 'left = "hinged"\nright = "hinged"'),
}
SCENE = """
[mesh]
{mesh}
[target]
mass = 0.2
first_frequency = 100.0
source = "analytic"
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
BEYOND = 0.03  # [-] tolerance of the reference over that of the scene
FINEST = 1e-9  # [-] tolerance no reference goes below
WITHIN = (0.5, 20.0)  # [-] estimate over truth that counts as honest
CHAOTIC = 3  # [-] impacts after which digits are not promised; such scenes are counted apart


@dataclass(frozen=True)
class Case:
    """One scene, what it promised and what came out."""

    name: str
    tolerance: float
    n_impacts: int
    true: float
    estimated: float
    remark: str = ""


def random_scene(rng: np.random.Generator) -> tuple[str, str, float]:
    """A scene's name, text and tolerance."""
    target = str(rng.choice(list(TARGETS)))
    mesh, supports = TARGETS[target]
    if target == "rectangle":
        at = [float(rng.uniform(0.02, 0.445)), float(rng.uniform(0.02, 0.28))]
    elif "disk" in target:
        radius, angle = 0.19 * np.sqrt(rng.uniform()), rng.uniform(0.0, 2.0 * np.pi)
        at = [float(radius * np.cos(angle)), float(radius * np.sin(angle))]
    else:
        at = [float(rng.uniform(0.02, 0.38))]
    mass, speed = float(10 ** rng.uniform(-3, -0.7)), float(10 ** rng.uniform(-1, 1))
    tolerance, duration = float(10 ** rng.uniform(-5, -2)), float(0.5 / 10 ** rng.uniform(1.7, 3.3))
    law = str(rng.choice(["linear", "hertz"]))
    if law == "linear":
        stiffness = mass * (np.pi / duration) ** 2
    else:  # the same duration on a rigid wall: T = 3.218 (m**2 / (k**2 v))**(1/5)
        stiffness = mass / np.sqrt(speed) * (3.2180654597 / duration) ** 2.5
    text = SCENE.format(
        mesh=mesh,
        supports=supports,
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
    """What the tolerance speaks of: absolute in the restitution, relative in impulse, contact time and peak force."""
    relative = (abs(getattr(hit, x) / getattr(other, x) - 1.0) for x in ("impulse", "contact_time", "peak_force"))
    return max(abs(hit.restitution - other.restitution), *relative)


def examine(name: str, text: str, tolerance: float, folder: Path) -> Case:
    """Strike one scene and its reference."""
    path = folder / "scene.toml"
    path.write_text(text)
    scene = fi.load_scene(path)
    try:
        hit = scene.strike()
        reference = scene.run(tolerance=max(FINEST, BEYOND * tolerance), max_impacts=hit.n_impacts + 2).response
    except (ValueError, fi.SimulationError) as error:
        return Case(name, tolerance, 0, np.nan, np.nan, str(error))
    remark = "" if hit.n_impacts == reference.n_impacts else f"{hit.n_impacts} impacts, truly {reference.n_impacts}"
    return Case(name, tolerance, hit.n_impacts, difference(hit, reference), float(hit.error), remark)


def study(n_scenes: int, seed: int) -> list[Case]:
    """Examine so many random scenes."""
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        return [examine(*random_scene(rng), Path(folder)) for _ in range(n_scenes)]


def report(cases: list[Case]) -> str:
    """What the cases say, misses by name."""
    judged = [case for case in cases if np.isfinite(case.true) and case.n_impacts <= CHAOTIC]
    true, tolerance = np.array([c.true for c in judged]), np.array([c.tolerance for c in judged])
    ratio = np.array([c.estimated for c in judged]) / np.maximum(true, 1e-300)
    honest = (ratio >= WITHIN[0]) & (ratio <= WITHIN[1])
    refused = [case for case in cases if not np.isfinite(case.true)]
    lines = [
        f"{len(cases)} scenes: {len(judged)} judged, {len(refused)} refused, "
        f"{len(cases) - len(judged) - len(refused)} with more than {CHAOTIC} impacts",
        f"true error within the tolerance: {np.mean(true <= tolerance):.1%}",
        f"estimate over truth within {WITHIN}: {honest.mean():.1%}, median {np.median(ratio):.2g}",
        f"estimate below half the truth: {np.mean(ratio < WITHIN[0]):.1%}",
    ]
    lines += [
        f"  miss: {case.name}: true {case.true:.1e}, estimated {case.estimated:.1e} {case.remark}"
        for case in judged
        if case.true > case.tolerance
    ]
    return "\n".join(lines + [f"  refused: {case.name}: {case.remark}" for case in refused])


def draw(cases: list[Case], path: Path) -> None:
    """Estimated over true error, each case where its tolerance puts it."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained")
    judged = [case for case in cases if np.isfinite(case.true)]
    for label, chosen in (("up to three impacts", True), ("more impacts", False)):
        some = [case for case in judged if (case.n_impacts <= CHAOTIC) is chosen]
        true = np.maximum([case.true for case in some], 1e-10)
        left.loglog(true, np.maximum([case.estimated for case in some], 1e-10), "o", ms=4, alpha=0.6, label=label)
        right.loglog([case.tolerance for case in some], true, "o", ms=4, alpha=0.6, label=label)
    span = np.array([1e-9, 1e-1])
    left.plot(span, span, "k-", lw=1, label="estimate = truth")
    left.fill_between(span, WITHIN[0] * span, WITHIN[1] * span, color="0.9", zorder=0, label="half to 20 times")
    right.plot(span, span, "k-", lw=1, label="truth = tolerance")
    left.set(xlabel="true error", ylabel="estimated error", xlim=span)
    right.set(xlabel="tolerance", ylabel="true error", xlim=(3e-6, 3e-2))
    for axes in (left, right):
        axes.legend(frameon=False)
    figure.savefig(path, dpi=120)
    plt.close(figure)


def main() -> None:
    """Run the study at the prompt."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "out")
    options = parser.parse_args()
    cases = study(options.scenes, options.seed)
    print(report(cases))
    options.out.mkdir(parents=True, exist_ok=True)
    rows = [f'"{c.name}",{c.tolerance:.3e},{c.n_impacts},{c.true:.3e},{c.estimated:.3e},"{c.remark}"' for c in cases]
    header = "scene,tolerance,impacts,true error,estimated error,remark"
    draw(cases, options.out / "effectivity.png")
    (options.out / "effectivity.csv").write_text("\n".join([header, *rows]) + "\n")


if __name__ == "__main__":
    main()
