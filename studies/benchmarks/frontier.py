"""Measures what accuracy costs: error against time for every choice, compared with the choices of the tolerance.

    python studies/benchmarks/frontier.py [--modes] [--only-chain] [--out studies/out]

A rigid hammer of 33 g strikes the hinged plate of 200 g of *Euphonics* 12.1 through a Hertz spring. Draws four plots:
mesh size and element (largest error of the first sixty frequencies), number of modes with and without the residual
compliance, step and scheme, and the whole chain from mesh to response. There, every combination of mesh, modes and
steps is one dot, and a line shows the choices for tolerances from 1e-1 to 1e-8. Prints the table of limits.md, what a
tolerance costs over the cheapest combination, and the seconds and memory predicted by the plan and measured. With
``--modes`` also what every tolerance costs if the modes of the plate carry the blow instead of Ritz vectors (minutes at
1e-7 and 1e-8); with ``--only-chain`` the first three plots are left out. The seconds are those of one processor, which
other programs on the machine change little. The error is the largest of those in restitution (absolute), impulse,
contact time and peak force (relative). The reference uses 20 000 closed-form modes, or as many as a tolerance of 1e-9
needs for the chain.
"""

import resource
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import scene_speed
from threadpoolctl import threadpool_limits

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

TOLERANCES = [10.0**-n for n in range(1, 9)]
SIZES = (0.5, 0.35, 0.25, 0.18, 0.125, 0.09, 0.06)  # [m] of elements
NUMBERS = (10, 20, 40, 80, 160, 320, 640, 1280)  # [-] numbers of modes
STEPS = [2.0**-n for n in range(1, 11)]  # [-] steps as shares of the contact time
REPEATS = 3  # [-] runs per setting; the fastest one counts


@dataclass(frozen=True)
class Point:
    """The cost and error of one setting."""

    name: str
    seconds: float
    error: float
    detail: str = ""


def difference(hit: fi.Response, other: fi.Response) -> float:
    """Error as the tolerance counts it; 1 if the numbers of impacts differ."""
    if hit.n_impacts != other.n_impacts:
        return 1.0
    relative = (abs(getattr(hit, x) / getattr(other, x) - 1.0) for x in ("impulse", "contact_time", "peak_force"))
    return max(abs(hit.restitution - other.restitution), *relative)


def scene(source: str, folder: Path) -> fi.Scene:
    """The scene with closed-form or finite-element modes."""
    path = folder / f"{source}.toml"
    path.write_text(scene_speed.FRONTIER.format(source=source))
    return fi.load_scene(path)


def meshes() -> list[Point]:
    """Error of the first sixty frequencies over element size, for two elements."""
    plate = fi.Plate(fi.Material(E=70e9, nu=0.3, rho=2700.0), 2e-3)
    exact = fi.analytic.rectangle(1.55, 1.0, section=plate, n_modes=60).frequencies
    points = []
    for element, size in product(("argyris", "morley"), SIZES):
        size = size if element == "argyris" else size / 4.0

        def find(element=element, size=size):
            body = fi.mesh.rectangle(1.55, 1.0, size=size)
            return fi.find_modes(fi.assemble(body, plate, {"boundary": "hinged"}, element), n_modes=60)

        try:
            seconds, modes = shared.timed(find)
        except ValueError:  # fewer unknowns than modes
            continue
        error = float(np.abs(modes.frequencies / exact - 1.0).max())
        points.append(Point(element, seconds, error, f"size {size:g} m"))
    return points


def blow(whole: fi.Scene) -> dict[str, object]:
    """The arguments of `fi.strike` for the scene."""
    return {"striker": whole.make_striker(), "contact": whole.make_contact(), "at": (0.465, 0.3), "speed": 1.0}


def truncations(whole: fi.Scene, reference: fi.Response) -> list[Point]:
    """Error over the number of closed-form modes, with and without the residual compliance."""
    points = []
    for residual, number in product((True, False), NUMBERS):
        modes = reference.target.truncated(n_modes=number)
        strike = lambda: fi.strike(modes, **blow(whole), residual=residual, tolerance=1e-7)  # noqa: B023, E731
        seconds, hit = shared.timed(strike, REPEATS)
        name = "with residual compliance" if residual else "bare modes"
        points.append(Point(name, seconds, difference(hit, reference), f"{number} modes"))
    return points


def steps(whole: fi.Scene, reference: fi.Response) -> list[Point]:
    """Error over the step of each scheme, on the same 80 modes as the reference."""
    modes, length = reference.target.truncated(n_modes=80), reference.contact_time
    exact = fi.strike(modes, **blow(whole), tolerance=1e-11)
    points = []
    for scheme, step in product(("A", "A4"), STEPS):
        strike = lambda: fi.strike(modes, **blow(whole), scheme=scheme, dt=step * length)  # noqa: B023, E731
        seconds, hit = shared.timed(strike, REPEATS)
        points.append(Point(f"scheme {scheme}", seconds, difference(hit, exact), f"step {step:g} of the contact"))
    return points


def combinations(whole: fi.Scene, reference: fi.Response) -> list[Point]:
    """Run the whole chain with every combination of mesh, modes and steps."""
    points = []
    for size, number in product(SIZES, NUMBERS[:-1]):
        start = time.process_time()
        body = fi.mesh.rectangle(1.55, 1.0, size=size)
        plate = fi.Plate(fi.Material(E=70e9, nu=0.3, rho=2700.0), 2e-3)
        try:
            modes = fi.find_modes(fi.assemble(body, plate, {"boundary": "hinged"}), n_modes=number)
        except ValueError:
            continue
        modes = modes.scaled(mass=0.2, first_frequency=100.0)
        modes.residual_compliance([(0.465, 0.3)])
        found = time.process_time() - start
        for step in STEPS[1:8:2]:
            strike = lambda: fi.strike(modes, **blow(whole), dt=step * reference.contact_time)  # noqa: B023, E731
            seconds, hit = shared.timed(strike, REPEATS)
            detail = f"size {size:g} m, {number} modes, step {step:g} of the contact"
            points.append(Point("combination", found + seconds, difference(hit, reference), detail))
    return points


@dataclass(frozen=True)
class Dial:
    """The choices of one tolerance and their cost."""

    tolerance: float
    seconds: float
    run: object
    megabytes: float
    error: float = np.nan


def dials(whole: fi.Scene, target: str | None = None) -> list[Dial]:
    """Run the chain for each tolerance, loosest first, because peak memory only grows within a process."""
    found = []
    for tolerance in TOLERANCES:
        repeats = REPEATS if tolerance >= 1e-6 else 1
        seconds, run = shared.timed(lambda: whole.run(tolerance=tolerance, target=target), repeats)  # noqa: B023
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
        found.append(Dial(tolerance, seconds, run, peak))
    return found


def table(found: list[Dial]) -> str:
    """The table of `limits.md`."""
    lines = [
        "| tolerance | seconds | unknowns | vectors | steps | MB | true error |",
        "|---|---|---|---|---|---|---|",
    ]
    for d in found:
        plan, n_steps = d.run.plan, len(d.run.response.history.steps)
        sizes = f"{plan.n_dofs} | {plan.n_modes} | {n_steps} | {d.megabytes:.0f}"
        lines.append(f"| {d.tolerance:.0e} | {d.seconds:.2f} | {sizes} | {d.error:.1e} |")
    return "\n".join(lines)


def cheapest(points: list[Point], found: list[Dial]) -> list[str]:
    """Cost of each tolerance over that of the cheapest combination that meets it."""
    lines, ratios = [], []
    for dial in found:
        good = [point for point in points if point.error <= dial.tolerance]
        if good:
            best = min(good, key=lambda point: point.seconds)
            ratios.append(dial.seconds / best.seconds)
            lines.append(
                f"  {dial.tolerance:.0e}: {dial.seconds:.3f} s, cheapest of {len(points)} combinations "
                f"{best.seconds:.3f} s ({best.detail}), ratio {ratios[-1]:.2f}"
            )
    return [f"cost over that of the cheapest combination: median {np.median(ratios):.2f}", *lines]


def predictions(found: list[Dial]) -> list[str]:
    """Seconds and megabytes, predicted and measured."""
    return [
        f"  {d.tolerance:.0e}: predicted {d.run.plan.seconds:.2f} s and {d.run.plan.memory / 1e6:.0f} MB, "
        f"took {d.seconds:.2f} s and {d.megabytes:.0f} MB"
        for d in found
    ]


def draw(panels: dict[str, list[Point]], found: list[Dial], path: Path) -> None:
    """Draw error over seconds, one plot for each choice and one for the whole chain."""
    figure, axes = plt.subplots(2, 2, figsize=(11, 8), layout="constrained")
    for axis, (title, points) in zip(axes.flat, panels.items()):
        for name, marker in zip(dict.fromkeys(point.name for point in points), "osd^"):
            mine = [point for point in points if point.name == name]
            style = "." if name == "combination" else f"{marker}-"
            shown = np.maximum([point.error for point in mine], 1e-14)
            axis.loglog([point.seconds for point in mine], shown, style, ms=5, label=name, alpha=0.8)
        axis.set(title=title, xlabel="seconds of one processor", ylabel="error")
    last = axes.flat[-1]
    last.loglog([d.seconds for d in found], [d.error for d in found], "k*-", ms=11, label="chosen by the tolerance")
    for d in found:
        last.annotate(f"{d.tolerance:.0e}", (d.seconds, d.error), textcoords="offset points", xytext=(6, 4), fontsize=8)
    for axis in axes.flat:
        axis.legend(frameon=False, fontsize=8)
        axis.grid(alpha=0.3)
    shared.save(path, figure, dpi=120)


def main() -> None:
    """Run the study from the command line."""
    parser = shared.parser(__doc__, shared.OUT)
    parser.add_argument("--modes", action="store_true", help="also measure every tolerance by modes")
    parser.add_argument("--only-chain", action="store_true", help="leave out mesh, modes and steps by themselves")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1):
        exact, whole = scene("analytic", Path(folder)), scene("fe", Path(folder))
        found = dials(whole)
        everything = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=20_000)
        reference = fi.strike(everything, **blow(exact), tolerance=1e-9)
        found = [replace(dial, error=difference(dial.run.response, reference)) for dial in found]
        print(table(found), flush=True)
        through = dials(whole, "modal") if options.modes else []
        parts = {} if options.only_chain else {
            "first 60 frequencies: mesh and element": meshes(),
            "blow: number of modes": truncations(exact, reference),
            "blow: step and scheme": steps(exact, reference),
        }  # fmt: skip
        panels = {**parts, "from mesh to response": combinations(whole, reference)}
    print("\n".join(cheapest(list(panels.values())[-1], found)))
    print("\n".join(["predicted and measured:", *predictions(found)]))
    for one, other in zip(found, through):
        print(f"  {one.tolerance:.0e}: by modes {other.seconds:.2f} s, {other.seconds / one.seconds:.1f} times as long")
    if not options.only_chain:
        draw(panels, found, options.out / "frontier.png")
    rows = [f'"{t}","{p.name}","{p.detail}",{p.seconds:.4e},{p.error:.4e}' for t, ps in panels.items() for p in ps]
    rows += [f'"chosen","tolerance {d.tolerance:g}","",{d.seconds:.4e},{d.error:.4e}' for d in found]
    (options.out / "frontier.csv").write_text("\n".join(["panel,name,detail,seconds,error", *rows]) + "\n")


if __name__ == "__main__":
    main()
