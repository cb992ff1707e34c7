"""Error against time: the project's schemes beside general solvers, same blow, same machine, same run.

    python studies/work_precision.py [--out DIR] [--modes 40 300 1000]

A rigid hammer of 10 g strikes a hinged plate of 200 g (bare set of modes) through a linear spring; every solver follows
it from the first touch to the first separation. Prints one row per run and draws error over time. Error is the larger
of the rebound speed's (over the arrival's) and the impulse's (relative), against collocation at 1e-12; time is the best
of several runs, one where a run takes long. scikit-sundae and Exudyn take part where they are installed
(``pip install fem-impact[peers]``).
"""

import argparse
import csv
import os
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp

import fem_impact as fi
from fem_impact import _kernels, integrator

MASS, SPEED, STIFFNESS = 0.01, 1.0, 1e5  # [kg], [m/s], [N/m]: a contact of about a millisecond
AT = (0.465, 0.31)  # [m]
PATIENCE = 20.0  # [s] a solver that took longer gets no finer tolerance
LONG = 0.2  # [s] runs longer than this are timed once
TOLERANCES = 10.0 ** -np.arange(2.0, 12.0)

Answer = tuple[float, float]  # rebound speed [m/s] (negative), impulse [N s]


class Blow:
    """The blow as plain arrays, for solvers that know nothing of modes."""

    def __init__(self, n_modes: int) -> None:
        self.plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=n_modes)
        self.striker, self.law = fi.Striker.rigid(MASS), fi.Contact.linear(STIFFNESS)
        self.omega = np.append(0.0, self.plate.omega)
        self.shape = np.append(MASS**-0.5, -self.plate.shape_at(AT)[0])
        self.start = np.zeros(2 * len(self.omega))
        self.start[len(self.omega)] = SPEED * MASS**0.5
        self.horizon = 20e-3  # [s]

    def rate(self, t: float, z: np.ndarray) -> np.ndarray:
        """Time derivative of modal displacements and velocities."""
        n = len(self.omega)
        force = STIFFNESS * max(self.shape @ z[:n], 0.0)
        return np.concatenate([z[n:], -(self.omega**2) * z[:n] - force * self.shape])

    def jacobian(self, t: float, z: np.ndarray) -> np.ndarray:
        """Derivative of `rate` by the state."""
        n = len(self.omega)
        result = np.zeros((2 * n, 2 * n))
        result[:n, n:] = np.eye(n)
        result[n:, :n] = np.diag(-(self.omega**2))
        if self.shape @ z[:n] > 0.0:
            result[n:, :n] -= STIFFNESS * np.outer(self.shape, self.shape)
        return result

    def answer(self, end: np.ndarray) -> Answer:
        """Rebound speed and impulse from the state at separation."""
        speed = end[len(self.omega)] * MASS**-0.5
        return speed, MASS * (SPEED - speed)


def strike(blow: Blow, scheme: str, tolerance: float) -> Answer:
    """The whole call, plan, error estimate and audit included."""
    hit = fi.strike(
        blow.plate, blow.striker, blow.law, at=AT, speed=SPEED, residual=False, max_impacts=1, scheme=scheme,
        tolerance=float(tolerance),
    )  # fmt: skip
    return hit.speeds[0], hit.impulse


def kernel(blow: Blow, scheme: str, size: float) -> Callable[[], Answer]:
    """One run of the compiled loop at one step (A, A4), misfit (collocation) or at all (secular)."""
    n = len(blow.omega)
    state = (
        blow.omega, np.zeros(n), blow.shape[None], np.zeros(1), np.zeros(n), np.array([[STIFFNESS, 1.0, 0.0, 0.0]]),
        np.zeros(n), blow.start[n:].copy(),
    )  # fmt: skip
    nodes, contact = integrator._gauss(integrator.NODES), np.pi * np.sqrt(MASS / STIFFNESS)
    noise = (1e-19, 1e-12)

    def run() -> Answer:
        if scheme == "collocation":
            out = _kernels.run_collocation(*state, *nodes, contact / 2.0, SPEED, size, *noise, np.inf, 1, 10**6)
        elif scheme == "secular":
            group, amplitude = np.arange(n), np.abs(blow.shape)
            out = _kernels.run_secular(
                blow.omega, group, amplitude, *state[2:], *nodes, contact, *noise, np.inf, 1, 10**6
            )
        else:
            out = _kernels.run_energy(*state, int(scheme == "A4"), contact / size, *noise, np.inf, 1, 10**6)
        return blow.answer(np.concatenate([out[1], out[2]]))

    return run


def scipy_solver(blow: Blow, method: str, tolerance: float) -> Answer:
    """SciPy's solve_ivp with the separation as its event."""

    def apart(t: float, z: np.ndarray) -> float:
        return blow.shape @ z[: len(blow.omega)]

    apart.terminal, apart.direction = True, -1
    extra = {"jac": blow.jacobian} if method in ("Radau", "LSODA") else {}
    result = solve_ivp(
        blow.rate, (0.0, blow.horizon), blow.start, method=method, rtol=max(tolerance, 1e-12), atol=1e-6 * tolerance,
        events=apart, **extra,
    )  # fmt: skip
    return blow.answer(result.y_events[0][0])


def sundials(blow: Blow, tolerance: float) -> Answer:
    """CVODE (Adams, dense Newton) by scikit-sundae, with the separation as its event."""
    from sksundae.cvode import CVODE

    def rate(t, z, out):
        out[:] = blow.rate(t, z)

    def apart(t, z, out):
        out[0] = blow.shape @ z[: len(blow.omega)] if t > 0.0 else 1.0

    apart.terminal, apart.direction = [True], [-1]

    def jacobian(t, z, rates, out):
        out[:] = blow.jacobian(t, z)

    solver = CVODE(
        rate, method="Adams", rtol=max(tolerance, 1e-12), atol=1e-6 * tolerance, eventsfn=apart, num_events=1,
        jacfn=jacobian, max_num_steps=10**6,
    )  # fmt: skip
    result = solver.solve(np.array([0.0, blow.horizon]), blow.start)
    return blow.answer(np.asarray(result.y_events[-1] if result.y_events is not None else result.y[-1]))


def exudyn_solver(blow: Blow, n_steps: int) -> Answer:
    """Exudyn's explicit RK44 at fixed steps up to the separation (taken as known), forces by a user function."""
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
        return -(blow.omega**2) * q - STIFFNESS * max(blow.shape @ q, 0.0) * blow.shape

    system.AddObject(ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.eye(n), forceUserFunction=force))
    system.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = n_steps
    settings.timeIntegration.endTime = blow.separation
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.show.computationTime = False
    system.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44)
    rates = system.systemData.GetODE2Coordinates_t()
    return blow.answer(np.concatenate([np.zeros(n), rates]))


def best_time(run: Callable[[], Answer]) -> tuple[float, Answer]:
    """Best wall time [s] of some runs, or of the first if it is long, and the answer."""
    run_once = time.perf_counter()
    answer = run()
    first = time.perf_counter() - run_once
    if first > LONG:
        return first, answer
    best = np.inf
    for _ in range(int(np.clip(0.3 / first, 5, 300))):
        begin = time.perf_counter()
        run()
        best = min(best, time.perf_counter() - begin)
    return best, answer


def solvers(blow: Blow, n_modes: int) -> Iterator[tuple[str, list[tuple[str, Callable[[], Answer]]]]]:
    """Name of each solver and its runs, coarse to fine, each with its setting."""
    yield "A (kernel)", [(f"{n} steps", kernel(blow, "A", n)) for n in (12, 50, 200, 800, 3200)]
    yield "A4 (kernel)", [(f"{n} steps", kernel(blow, "A4", n)) for n in (6, 9, 12, 18, 25, 35, 50, 100, 200, 400)]
    yield (
        "collocation (kernel)",
        [(f"{x:.0e}", kernel(blow, "collocation", x)) for x in 10.0 ** -np.arange(1.0, 12.0, 2)],
    )
    if n_modes <= 300:
        yield "secular (kernel)", [("exact", kernel(blow, "secular", 1.0))]
    for scheme in ("A4", "collocation"):
        runs = [(f"{x:.0e}", lambda x=x, scheme=scheme: strike(blow, scheme, x)) for x in TOLERANCES[:9:2]]
        yield f"fi.strike, {scheme}", runs
    for method in ("DOP853", "RK45", "LSODA", "Radau"):
        if method in ("LSODA", "Radau") and n_modes > 300:
            continue  # dense 2000 x 2000 Jacobians: minutes a run
        yield method, [(f"{x:.0e}", lambda x=x, m=method: scipy_solver(blow, m, x)) for x in TOLERANCES]
    if find_spec("sksundae") and n_modes <= 300:
        yield "CVODE", [(f"{x:.0e}", lambda x=x: sundials(blow, x)) for x in TOLERANCES]
    if find_spec("exudyn"):
        least = int(blow.separation * blow.omega[-1] / 2.5)  # RK44 is unstable beyond omega h = 2.8
        yield "Exudyn RK44", [(f"{n} steps", lambda n=n: exudyn_solver(blow, n)) for n in (least, 3 * least, 9 * least)]


def measure(n_modes: int) -> list[dict]:
    """One row per run."""
    blow = Blow(n_modes)
    truth = fi.strike(
        blow.plate, blow.striker, blow.law, at=AT, speed=SPEED, residual=False, max_impacts=1, tolerance=1e-12,
        scheme="collocation",
    )  # fmt: skip
    blow.separation = truth.impacts[0].end
    rows = []
    for name, runs in solvers(blow, n_modes):
        for setting, run in runs:
            seconds, (speed, impulse) = best_time(run)
            error = max(abs(speed - truth.speeds[0]) / SPEED, abs(impulse / truth.impulse - 1.0))
            rows.append({"modes": n_modes, "solver": name, "setting": setting, "error": error, "seconds": seconds})
            print(f"{n_modes:5d}  {name:22s} {setting:>11s}  {error:9.1e}  {seconds * 1e6:12.1f} us", flush=True)
            if seconds > PATIENCE or (seconds > 2.0 and error < 1e-8):
                break
    return rows


def time_at(rows: list[dict], solver: str, error: float) -> float:
    """Least time [s] of a solver's runs with at most an error; infinity if none."""
    return min((r["seconds"] for r in rows if r["solver"] == solver and r["error"] <= error), default=np.inf)


def draw(rows: list[dict], path: Path) -> None:
    """Error over time, one panel per number of modes."""
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
    figure.savefig(path, dpi=150)


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "out")
    parser.add_argument("--modes", type=int, nargs="+", default=[40, 300, 1000])
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    print("modes  solver                     setting      error          time")
    rows = [row for n_modes in options.modes for row in measure(n_modes)]
    with (options.out / "work_precision.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    draw(rows, options.out / "work_precision.png")
    print("\nleast time at an error of 1e-6, and its ratio to A4's kernel and to the whole call of fi.strike:")
    for n_modes in options.modes:
        some = [row for row in rows if row["modes"] == n_modes]
        ours, call = time_at(some, "A4 (kernel)", 1e-6), time_at(some, "fi.strike, A4", 1e-6)
        for name in dict.fromkeys(row["solver"] for row in some):
            taken = time_at(some, name, 1e-6)
            print(f"{n_modes:5d}  {name:22s} {taken * 1e6:12.1f} us  x {taken / ours:9.1f}  x {taken / call:9.1f}")


if __name__ == "__main__":
    main()
