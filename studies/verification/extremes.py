"""Checks that results at extreme parameters are right, flagged or refused, and never silently wrong.

    python studies/verification/extremes.py [--corners 150] [--seed 1] [--out studies/out]

A hinged plate of 200 g with its first mode at 100 Hz is struck at 1 m/s by a rigid mass of 33 g through a spring of
contact frequency 300 Hz, tolerance 1e-3, sixty modes and the residual compliance of the rest. The study varies
each parameter alone from absurdly small to absurdly large: stiffness, mass, speed, damping, thickness (which changes
mass and frequencies), number of modes, step, exponent and loss of the contact. Then it varies all of them at random.

right    the true error is within the tolerance; the reference has 1 500 modes and a hundredth of the tolerance
flagged  the estimated error is above the tolerance or "not resolvable"
refused  ValueError or SimulationError
wrong    none of these; must not occur

If the reference is refused too, energy and momentum must balance to 1e-9. Prints a table and writes extremes.csv and
extremes.png.
"""

import sys
import time
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import fem_impact as fi

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

TOLERANCE = 1e-3
N_MODES, N_REFERENCE = 100, 1500
AT = (0.465, 0.3)
BALANCE = 1e-9  # [-] limit for energy and momentum if there is no reference
MOST_IMPACTS = 3  # [-] with more impacts the trajectory may be chaotic
AXES = {  # factors on the basic scene, except modes, exponent, loss and step
    "stiffness": np.logspace(-12, 12, 25),
    "mass": np.logspace(-9, 9, 19),
    "speed": np.logspace(-12, 6, 19),
    "damping": np.logspace(-12, 6, 19),
    "thickness": np.logspace(-6, 6, 25),
    "modes": np.array([1, 2, 3, 5, 10, 20, 60, 200, 600, 1500]),
    "step": np.logspace(-5, 4, 19),
    "exponent": np.array([0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 3.0, 5.0, 10.0, 30.0, 100.0]),
    "loss": np.logspace(-9, 9, 19),
}
BASIS = dict.fromkeys(("stiffness", "mass", "speed", "thickness", "exponent"), 1.0) | {
    "damping": 0.0, "modes": N_MODES, "step": None, "loss": 0.0,
}  # fmt: skip
COLOURS = {"right": "#0072b2", "flagged": "#e69f00", "refused": "#999999", "wrong": "#d55e00"}


@dataclass(frozen=True)
class Outcome:
    """One blow: its parameter, verdict, errors and time."""

    axis: str
    value: float
    kind: str
    true: float
    estimated: float
    seconds: float
    text: str


def struck(choice: dict[str, float], modes: fi.Modes, tolerance: float, **how: object) -> fi.Response:
    """Strike the given modes with the parameters of a choice."""
    mass = 0.1 / 3.0 * choice["mass"]
    stiffness = mass * (2.0 * np.pi * 300.0) ** 2 * choice["stiffness"]
    law = fi.Contact.power(stiffness, choice["exponent"], loss=choice["loss"])
    return fi.strike(modes, fi.Striker.rigid(mass), law, at=AT, speed=choice["speed"], tolerance=tolerance, **how)


def plate(choice: dict[str, float], n_modes: int) -> fi.Modes:
    """The plate of a choice: mass and frequencies are proportional to the thickness."""
    scale = choice["thickness"]
    modes = fi.analytic.rectangle(1.55, 1.0, mass=0.2 * scale, first_frequency=100.0 * scale, n_modes=n_modes)
    return modes.damped(choice["damping"])


def difference(hit: fi.Response, other: fi.Response) -> float:
    """Error as the tolerance counts it; 1 if the numbers of impacts differ."""
    if hit.n_impacts != other.n_impacts:
        return 1.0
    names = ("impulse", "contact_time", "peak_force")
    relative = [abs(getattr(hit, x) / getattr(other, x) - 1.0) for x in names if getattr(other, x)]
    return max(abs(hit.restitution - other.restitution), *relative)


def judge(axis: str, value: float, choice: dict[str, float]) -> Outcome:
    """Strike, strike again with the reference, and judge the result."""
    start = time.perf_counter()
    modes, step = int(choice["modes"]), choice["step"]
    how = {} if step is None else {"dt": step * 0.5 / 300.0, "max_impacts": 1}
    try:
        hit = struck(choice, plate(choice, modes), TOLERANCE, **how)
    except (ValueError, fi.SimulationError) as error:
        return Outcome(axis, value, "refused", np.nan, np.nan, time.perf_counter() - start, str(error))
    seconds, estimated = time.perf_counter() - start, float(hit.error)
    if not estimated <= TOLERANCE:
        return Outcome(axis, value, "flagged", np.nan, estimated, seconds, "")
    limit = {"max_impacts": hit.n_impacts + 1} if step is None else {"max_impacts": 1}
    try:
        reference = struck(choice, plate(choice, N_REFERENCE), 0.01 * TOLERANCE, **limit)
        true = difference(hit, reference)
        text = f"{hit.n_impacts} impacts, reference {reference.n_impacts}"
    except (ValueError, fi.SimulationError):
        true, text = max(hit.energy_error, hit.momentum_error), "judged by the balance of energy and momentum"
        true *= TOLERANCE / BALANCE
    return Outcome(axis, value, "right" if true <= TOLERANCE else "wrong", true, estimated, seconds, text)


def walks() -> list[Outcome]:
    """Vary each parameter alone."""
    return [judge(axis, float(x), BASIS | {axis: x}) for axis, values in AXES.items() for x in values]


def corners(count: int, seed: int) -> list[Outcome]:
    """Vary all parameters at once, each chosen at random from its values."""
    rng = np.random.default_rng(seed)
    found = []
    for number in range(count):
        choice = {axis: float(rng.choice(values)) for axis, values in AXES.items()}
        choice["step"] = choice["step"] if rng.uniform() < 0.2 else None
        found.append(judge("corner", float(number), choice))
    return found


def report(found: list[Outcome]) -> str:
    """Count the verdicts of each axis and name every wrong result."""
    lines = []
    for axis in dict.fromkeys(outcome.axis for outcome in found):
        mine = [outcome for outcome in found if outcome.axis == axis]
        counts = ", ".join(f"{sum(o.kind == kind for o in mine)} {kind}" for kind in COLOURS)
        slowest = max(o.seconds for o in mine)
        lines.append(f"{axis:<10} {len(mine):4d} blows: {counts}; the slowest took {slowest:.1f} s")
    lines += [
        f"  wrong: {o.axis} {o.value:g}: true {o.true:.1e}, estimated {o.estimated:.1e}, {o.text}"
        for o in found
        if o.kind == "wrong"
    ]
    return "\n".join(lines)


def draw(found: list[Outcome], path: Path) -> None:
    """Draw one row of dots per axis."""
    figure, axis = plt.subplots(figsize=(10, 5), layout="constrained")
    rows = list(dict.fromkeys(outcome.axis for outcome in found))
    for kind, colour in COLOURS.items():
        mine = [outcome for outcome in found if outcome.kind == kind]
        x = []
        for outcome in mine:
            values = [o.value for o in found if o.axis == outcome.axis]
            x.append(values.index(outcome.value) / max(1, len(values) - 1))
        axis.plot(x, [rows.index(o.axis) for o in mine], "s", color=colour, ms=7, label=f"{kind} ({len(mine)})")
    ends = [[o.value for o in found if o.axis == row] for row in rows]
    labels = [f"{row}  {min(values):.0e} ... {max(values):.0e}" for row, values in zip(rows, ends)]
    axis.set(yticks=range(len(rows)), yticklabels=labels, xticks=[], xlabel="from the smallest to the largest value")
    axis.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, 1.12), ncols=4)
    shared.save(path, figure, dpi=120)


def main() -> None:
    """Run the study from the command line."""
    parser = shared.parser(__doc__, shared.OUT)
    parser.add_argument("--corners", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    found = walks() + corners(options.corners, options.seed)
    print(report(found))
    draw(found, options.out / "extremes.png")
    shared.write_rows(options.out / "extremes.csv", found)


if __name__ == "__main__":
    main()
