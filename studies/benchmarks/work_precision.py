"""Compares error and time of the project's schemes with general solvers: same blow, same machine, same run.

    python studies/benchmarks/work_precision.py [--out DIR] [--modes 40 300 1000]

A rigid hammer of 5 g strikes a hinged plate of 200 g (300 modes up to 18.7 kHz, no residual compliance) through a
linear spring of 0.3 MN/m; the contact lasts 0.45 ms. Every solver integrates from the first touch until no further
contact is possible. The rigid and the flexible motion prove this about 2 ms after the separation. The compiled loops
find the proof themselves; the other solvers get the time at which it holds and integrate up to there. They detect
contacts by their events, or, if they have none, simply evaluate the spring force.

The error is the larger of those in rebound speed (over arrival speed) and impulse (relative), against scheme A4 at
1e-11. The worst of four blows with similar strike points and stiffnesses counts: the error of a solver changes sign
with its setting and with the blow, so with one blow a setting could look accurate by chance. The time is the mean over
the four blows of the best of several runs, or of a single run if it is long. Prints one row per setting and draws error
over time. Then times the whole `fi.strike` call for a stick on the complete plate at a tolerance of 1e-6, including
residual compliance and error estimate, and the compiled loops within it. scikit-sundae and Exudyn take part if they are
installed (``pip install fem-impact[peers]``).
"""

import os
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp

import fem_impact as fi
from fem_impact.impact import engine
from fem_impact.impact.compiled import energy
from fem_impact.impact.compiled.bundles import KernelSystem, Limits
from fem_impact.impact.compiled.law import table

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

MASS, SPEED = 0.005, 1.0  # [kg], [m/s]
BLOWS = [((0.465, 0.31), 3.0e5), ((0.465, 0.33), 2.8e5), ((0.60, 0.40), 3.1e5), ((0.50, 0.37), 3.3e5)]  # [m], [N/m]
PATIENCE = 20.0  # [s] a solver that takes longer for the four blows gets no finer tolerance
LONG = 0.2  # [s] longer runs are timed only once
STICKS = [(0.02, 1.0e5), (0.1, 1.0e5), (0.1, 3.0e5)]  # [kg], [N/m] for the timing of the whole call
CALLS = 400  # [-] repeated calls; the fastest counts
TOLERANCES = 10.0 ** -np.arange(2.0, 12.0)

Answer = tuple[float, float]  # rebound speed [m/s] (negative), impulse [N s]


class Blow:
    """One blow as plain arrays, for solvers that do not know modes, and its reference result."""

    def __init__(self, plate: fi.Modes, at: tuple[float, float], stiffness: float) -> None:
        self.plate, self.at, self.stiffness = plate, at, stiffness
        self.striker, self.law = fi.Striker.rigid(MASS), fi.Contact.linear(stiffness)
        self.omega = np.append(0.0, plate.omega)
        self.shape = np.append(MASS**-0.5, -plate.shape_at(at)[0])
        self.start = np.zeros(2 * len(self.omega))
        self.start[len(self.omega)] = SPEED * MASS**0.5
        truth = self.strike("A4", 1e-11)
        assert truth.n_impacts == 1
        assert truth.finished
        self.truth = truth.speeds[0], truth.impulse
        h, flexible = truth.history, self.omega > 0.0
        rigid, rate = h.shape[0, ~flexible] @ h.end_q[~flexible], h.shape[0, ~flexible] @ h.end_p[~flexible]
        swing = np.abs(h.shape[0, flexible]) @ np.hypot(h.end_q[flexible], h.end_p[flexible] / self.omega[flexible])
        self.horizon = float(truth.impacts[0].end + (swing + rigid) / -rate)  # [s] after this no contact is possible

    def strike(self, scheme: str, tolerance: float) -> fi.Response:
        """The whole call, including plan, error estimate and audit."""
        return fi.strike(
            self.plate, self.striker, self.law, at=self.at, speed=SPEED, residual=False, scheme=scheme,
            tolerance=tolerance,
        )  # fmt: skip

    def error(self, answer: Answer) -> float:
        """The larger of the errors of rebound speed and impulse."""
        return max(abs(answer[0] - self.truth[0]) / SPEED, abs(answer[1] / self.truth[1] - 1.0))

    def rate(self, t: float, z: np.ndarray) -> np.ndarray:
        """Time derivative of modal displacements and velocities."""
        n = len(self.omega)
        force = self.stiffness * max(self.shape @ z[:n], 0.0)
        return np.concatenate([z[n:], -(self.omega**2) * z[:n] - force * self.shape])

    def jacobian(self, t: float, z: np.ndarray) -> np.ndarray:
        """Derivative of `rate` with respect to the state."""
        n = len(self.omega)
        result = np.zeros((2 * n, 2 * n))
        result[:n, n:] = np.eye(n)
        result[n:, :n] = np.diag(-(self.omega**2))
        if self.shape @ z[:n] > 0.0:
            result[n:, :n] -= self.stiffness * np.outer(self.shape, self.shape)
        return result

    def answer(self, end: np.ndarray) -> Answer:
        """Rebound speed and impulse from the state at separation."""
        speed = end[len(self.omega)] * MASS**-0.5
        return speed, MASS * (SPEED - speed)


def call(blow: Blow, scheme: str, tolerance: float) -> Answer:
    """The call that a user makes."""
    hit = blow.strike(scheme, tolerance)
    return hit.speeds[0], hit.impulse


def kernel(blow: Blow, scheme: str, size: float) -> Callable[[], Answer]:
    """A run of the compiled loop in steps of which a contact on a rigid wall takes ``size``."""
    n = len(blow.omega)
    scene = KernelSystem(
        blow.omega, np.zeros(n), blow.shape[None], np.zeros(1), np.zeros(n),
        table([[blow.stiffness, 1.0]]),
        np.zeros(n), blow.start[n:].copy(),
    )  # fmt: skip
    contact = np.pi * np.sqrt(MASS / blow.stiffness)
    limits = Limits(1e-19, 1e-12, np.inf, 0, 10**6)

    def run() -> Answer:
        out = energy.run_energy(scene, None, int(scheme == "A4"), contact / size, limits)
        return blow.answer(np.concatenate([out[1], out[2]]))

    return run


def scipy_solver(blow: Blow, method: str, tolerance: float) -> Answer:
    """SciPy's solve_ivp with onsets and separations as events."""

    def apart(t: float, z: np.ndarray) -> float:
        return blow.shape @ z[: len(blow.omega)]

    extra = {"jac": blow.jacobian} if method in ("Radau", "LSODA") else {}
    result = solve_ivp(
        blow.rate, (0.0, blow.horizon), blow.start, method=method, rtol=max(tolerance, 1e-12), atol=1e-6 * tolerance,
        events=apart, **extra,
    )  # fmt: skip
    return blow.answer(result.y[:, -1])


def sundials(blow: Blow, tolerance: float) -> Answer:
    """CVODE (Adams, dense Newton) from scikit-sundae, with onsets and separations as events."""
    from sksundae.cvode import CVODE

    def rate(t, z, out):
        out[:] = blow.rate(t, z)

    def apart(t, z, out):
        out[0] = blow.shape @ z[: len(blow.omega)] if t > 0.0 else 1.0

    apart.terminal, apart.direction = [False], [0]

    def jacobian(t, z, rates, out):
        out[:] = blow.jacobian(t, z)

    solver = CVODE(
        rate, method="Adams", rtol=max(tolerance, 1e-12), atol=1e-6 * tolerance, eventsfn=apart, num_events=1,
        jacfn=jacobian, max_num_steps=10**6,
    )  # fmt: skip
    result = solver.solve(np.array([0.0, blow.horizon]), blow.start)
    return blow.answer(np.asarray(result.y[-1]))


def exudyn_solver(blow: Blow, n_steps: int) -> Answer:
    """Exudyn's explicit RK44 with fixed steps and a user function for the force."""
    import exudyn
    from exudyn.itemInterface import NodeGenericODE2, ObjectGenericODE2

    n = len(blow.omega)
    system = exudyn.SystemContainer().AddSystem()
    velocities = blow.start[n:].tolist()
    node = system.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * n, initialCoordinates=[0.0] * n, initialCoordinates_t=velocities,
            numberOfODE2Coordinates=n,
        )
    )  # fmt: skip

    def force(mbs, t, item, q, q_t):
        q = np.asarray(q)
        return -(blow.omega**2) * q - blow.stiffness * max(blow.shape @ q, 0.0) * blow.shape

    system.AddObject(ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.eye(n), forceUserFunction=force))
    system.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = n_steps
    settings.timeIntegration.endTime = blow.horizon
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.show.computationTime = False
    system.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44)
    rates = system.systemData.GetODE2Coordinates_t()
    return blow.answer(np.concatenate([np.zeros(n), rates]))


def best_time(run: Callable[[], Answer]) -> tuple[float, Answer]:
    """Best wall time [s] of several runs, or that of the first if it is long, and the answer."""
    first, answer = shared.timed(run, clock=time.perf_counter)
    if first > LONG:
        return first, answer
    return shared.timed(run, int(np.clip(0.1 / first, 3, 200)), time.perf_counter)


def solvers(n_modes: int, cycles: float) -> Iterator[tuple[str, list[tuple[str, Callable]]]]:
    """Name of each solver and its settings, coarse to fine, each with a function that prepares a run.

    ``cycles`` is the highest frequency times the time to integrate [rad].
    """
    for scheme, counts in (
        ("A", (12, 50, 200, 800, 3200)),
        ("A4", (6, 9, 12, 15, 18, 21, 25, 30, 35, 42, 50, 100, 200, 400)),
    ):
        yield f"{scheme} (kernel)", [(f"{n} steps", partial(kernel, scheme=scheme, size=n)) for n in counts]
    yield "fi.strike", [(f"{x:.0e}", prepared(call, "A4", float(x))) for x in TOLERANCES[:9:2]]
    for method in ("DOP853", "RK45", "LSODA", "Radau"):
        if method in ("LSODA", "Radau") and n_modes > 300:
            continue  # dense 2000 x 2000 Jacobians take minutes per run
        yield method, [(f"{x:.0e}", prepared(scipy_solver, method, x)) for x in TOLERANCES]
    if find_spec("sksundae") and n_modes <= 300:
        yield "CVODE", [(f"{x:.0e}", prepared(sundials, x)) for x in TOLERANCES]
    if find_spec("exudyn"):
        least = int(cycles / 2.5)  # RK44 is unstable beyond omega h = 2.8
        yield "Exudyn RK44", [(f"{n} steps", prepared(exudyn_solver, n)) for n in (least, 3 * least, 9 * least)]


def prepared(solver: Callable, *arguments: object) -> Callable[[Blow], Callable[[], Answer]]:
    """Wrap a solver into a function that prepares its run of a blow."""
    return lambda blow: lambda: solver(blow, *arguments)


def measure(n_modes: int) -> list[dict]:
    """Measure one row per solver and setting."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=n_modes)
    blows = [Blow(plate, *blow) for blow in BLOWS]
    rows = []
    for name, settings in solvers(n_modes, max(blow.horizon for blow in blows) * blows[0].omega[-1]):
        for setting, prepare in settings:
            results = [(blow, *best_time(prepare(blow))) for blow in blows]
            seconds = float(np.mean([seconds for _, seconds, _ in results]))
            error = max(blow.error(answer) for blow, _, answer in results)
            rows.append({"modes": n_modes, "solver": name, "setting": setting, "error": error, "seconds": seconds})
            print(f"{n_modes:5d}  {name:22s} {setting:>11s}  {error:9.1e}  {seconds * 1e6:12.1f} us", flush=True)
            if seconds * len(blows) > PATIENCE or (seconds > 0.5 and error < 1e-8):
                break
    return rows


def time_at(rows: list[dict], solver: str, error: float) -> float:
    """Least time [s] among a solver's runs that are within an error; infinity if none is."""
    return min((r["seconds"] for r in rows if r["solver"] == solver and r["error"] <= error), default=np.inf)


def whole_call(n_modes: int, mass: float, stiffness: float) -> tuple[fi.Response, float, float, int]:
    """A stick on the complete plate at 1e-6: response, best time of the call, that of its loops, number of loops."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=n_modes)
    stick, law = fi.Striker.stick(mass, 10e3), fi.Contact.linear(stiffness)
    loop, taken = engine.run_energy, []

    def timed(*state: object) -> tuple:
        begin = time.perf_counter()
        result = loop(*state)
        taken.append(time.perf_counter() - begin)
        return result

    def once() -> fi.Response:
        return fi.strike(plate, stick, law, at=BLOWS[0][0], speed=SPEED, tolerance=1e-6)

    hit = once()
    best, loops = np.inf, np.inf
    engine.run_energy = timed
    try:
        for _ in range(CALLS):
            taken.clear()
            begin = time.perf_counter()
            once()
            best, loops = min(best, time.perf_counter() - begin), min(loops, sum(taken))
    finally:
        engine.run_energy = loop
    return hit, best, loops, len(taken)


def draw(rows: list[dict], path: Path) -> None:
    """Draw error over time, one panel per number of modes."""
    counts = sorted({r["modes"] for r in rows})
    figure, panels = plt.subplots(1, len(counts), figsize=(5 * len(counts), 4.5), sharey=True, squeeze=False)
    for axes, count in zip(panels[0], counts):
        for name in dict.fromkeys(r["solver"] for r in rows):
            mine = [r for r in rows if r["modes"] == count and r["solver"] == name]
            axes.loglog(
                [r["seconds"] for r in mine], [max(r["error"], 1e-16) for r in mine],
                "o-" if "kernel" in name or "strike" in name else "s--", markersize=4, label=name,
            )  # fmt: skip
        axes.set(title=f"{count} modes", xlabel="time (s)")
        axes.grid(alpha=0.3)
    panels[0][0].set_ylabel("error of rebound and impulse (-)")
    panels[0][-1].legend(fontsize=7)
    figure.tight_layout()
    shared.save(path, figure, dpi=150)


def main() -> None:
    """Measure, print and write the results."""
    parser = shared.parser(__doc__, shared.OUT)
    parser.add_argument("--modes", type=int, nargs="+", default=[40, 300, 1000])
    options = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    print("modes  solver                     setting      error          time")
    rows = [row for n_modes in options.modes for row in measure(n_modes)]
    shared.write_rows(options.out / "work_precision.csv", rows)
    draw(rows, options.out / "work_precision.png")
    print("\nleast time at an error of 1e-6, and its ratio to A4's kernel and to the whole fi.strike call:")
    for n_modes in options.modes:
        some = [row for row in rows if row["modes"] == n_modes]
        ours, whole = time_at(some, "A4 (kernel)", 1e-6), time_at(some, "fi.strike", 1e-6)
        for name in dict.fromkeys(row["solver"] for row in some):
            taken = time_at(some, name, 1e-6)
            print(f"{n_modes:5d}  {name:22s} {taken * 1e6:12.1f} us  x {taken / ours:9.1f}  x {taken / whole:9.1f}")
    print("\nwhole fi.strike call, a stick on the complete plate at a tolerance of 1e-6:")
    print("modes  stick (kg)  spring (N/m)  impacts  call (us)  its loops (us)  runs")
    for n_modes in options.modes:
        for mass, stiffness in STICKS:
            hit, best, loops, runs = whole_call(n_modes, mass, stiffness)
            print(
                f"{n_modes:5d}  {mass:10g}  {stiffness:12.2g}  {hit.n_impacts:7d}  {best * 1e6:9.0f}"
                f"  {loops * 1e6:14.0f}  {runs:4d}"
            )


if __name__ == "__main__":
    main()
