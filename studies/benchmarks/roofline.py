"""Measures how close the contact loop comes to the limit of the machine, and how its cost grows with modes.

    python studies/benchmarks/roofline.py [--out DIR]

Small compiled loops measure the multiply-add peak of one core and its read bandwidth at several array sizes. Then the
study times one step of scheme A4 for 10 to 10 000 modes. One step of one mode with one contact takes about 36
floating-point operations and 15 reads and writes of 8 bytes; the slower of the two is the bound. Draws the time per
step and the bound. Also times batches of 100 to 10 000 blows, and fits a power law to both costs; exponent 1 is linear.
"""

import os
import sys
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numba
import numpy as np

import fem_impact as fi
from fem_impact.impact.compiled import energy
from fem_impact.impact.compiled.bundles import KernelSystem, Limits
from fem_impact.impact.compiled.law import table
from fem_impact.sweeps import batches

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

COUNTS = [10, 30, 100, 300, 1000, 3000, 10000]
BLOWS = [100, 300, 1000, 3000, 10000]
OPERATIONS = 36.0  # [-] per mode and step: response 11, free motion and bias 12, three sums 13
BYTES = 8.0 * 15.0  # [-] per mode and step: state, shape, bias, damping and six coefficients read, four values written


@numba.njit(fastmath=True)
def multiply_adds(x: np.ndarray, out: np.ndarray, turns: int) -> None:
    """Evaluate two polynomials at every x: 16 multiply-adds per value in two independent chains."""
    for _ in range(turns):
        for n in range(x.size):
            v = x[n]
            a = v
            b = v + 0.5
            a = a * v + 0.1
            b = b * v + 0.2
            a = a * v + 0.3
            b = b * v + 0.4
            a = a * v + 0.5
            b = b * v + 0.6
            a = a * v + 0.7
            b = b * v + 0.8
            a = a * v + 0.9
            b = b * v + 0.11
            a = a * v + 0.12
            b = b * v + 0.13
            a = a * v + 0.14
            b = b * v + 0.15
            a = a * v + 0.16
            b = b * v + 0.17
            out[n] = a * b


@numba.njit(fastmath=True)
def read(one: np.ndarray, other: np.ndarray, turns: int) -> float:
    """Compute the inner product of two arrays several times."""
    total = 0.0
    for turn in range(turns):
        part = 0.0
        for n in range(one.size):
            part += one[n] * other[n]
        total += part * turn
    return total


def best(run, repeats: int = 15) -> float:
    """Best time [s] of several runs, not counting the first."""
    run()
    return shared.timed(run, repeats, time.perf_counter)[0]


def peak() -> float:
    """Floating-point operations per second of one core."""
    x, out = np.linspace(0.0, 0.9, 1024), np.empty(1024)
    return 2.0 * 16.0 * 1024 * 5000 / best(lambda: multiply_adds(x, out, 5000))


def bandwidth(n_bytes: int) -> float:
    """Bytes per second that one core reads from two arrays of ``n_bytes`` in total."""
    one, other = np.ones((2, max(64, n_bytes // 16)))
    turns = max(1, int(2e7 / one.size))
    return 16.0 * one.size * turns / best(lambda: read(one, other, turns), 5)


def step_time(n_modes: int, compliance: float = 0.0) -> float:
    """Seconds per step of A4, without set-up: the slope between a long and a short run in sustained contact."""
    rng = np.random.default_rng(0)
    omega = np.append(0.0, np.sort(rng.uniform(1e2, 1e5, n_modes - 1)))
    shape = np.append(1.0, -rng.normal(0.0, 1.0, n_modes - 1) * n_modes**-0.5)[None]
    zeros, law = np.zeros(n_modes), table([[1e4, 1.5, 0.0, compliance]])
    p = zeros.copy()
    p[0] = 1.0
    scene = KernelSystem(omega, zeros, shape, np.zeros(1), zeros, law, zeros, p)

    def run(n_steps: int) -> float:
        return best(lambda: energy.run_energy(scene, None, 1, 1e-7, Limits(0.0, 0.0, np.inf, 0, n_steps)))

    return (run(1000) - run(200)) / 800.0


def batch_time(n_blows: int) -> float:
    """Seconds for a batch of blows of a rigid mass on a plate, on one core."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=2.0, first_frequency=100.0, n_modes=100)
    family = batches.Family.of(plate, np.array([0.465, 0.3]), fi.Striker.rigid(0.02), True)
    spread = 10.0 ** np.random.default_rng(3).uniform(-0.5, 0.5, (3, n_blows))
    one = np.ones(n_blows)
    blows = batches.Blows(
        {0: family}, np.zeros(n_blows, int), 2.0 * spread[0], 0.02 * spread[1], 1e5 * spread[2], one, one, 0.0 * one
    )
    return best(lambda: batches.follow_blows(blows, tolerance=1e-3, workers=1), 5)


def power(counts: np.ndarray, seconds: np.ndarray) -> float:
    """Exponent of a power law fitted to the upper half of the counts."""
    half = len(counts) // 2
    return float(np.polyfit(np.log(counts[half:]), np.log(seconds[half:]), 1)[0])


def main() -> None:
    """Measure, print and draw the results."""
    parser = shared.parser(__doc__, shared.OUT)
    out = parser.parse_args().out
    top = peak()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; one core: {top / 1e9:.1f} Gflop/s")
    print("modes   step (us)   mode-steps/s   read (GB/s)   bound (us)   share of bound")
    rows = []
    for count in COUNTS:
        taken, reading = step_time(count), bandwidth(16 * 8 * count)
        bound = count * max(OPERATIONS / top, BYTES / reading)
        rows.append((count, taken, bound))
        print(
            f"{count:5d}  {taken * 1e6:10.3f}  {count / taken:13.3e}  {reading / 1e9:12.1f}  {bound * 1e6:11.3f}"
            f"  {bound / taken:10.0%}"
        )
    counts, taken, bound = np.array(rows).T
    print(f"the cost of a step grows with the number of modes to the power {power(counts, taken):.2f}")
    print("blows   batch (ms)   each (us)")
    batches = np.array([batch_time(n) for n in BLOWS])
    for n, seconds in zip(BLOWS, batches):
        print(f"{n:5d}  {seconds * 1e3:11.2f}  {seconds / n * 1e6:10.2f}")
    print(f"the cost of a batch grows with the number of blows to the power {power(np.array(BLOWS), batches):.2f}")
    figure, axes = plt.subplots(figsize=(6, 4.5))
    axes.loglog(counts, taken * 1e6, "o-", label="A4, one contact")
    axes.loglog(counts, bound * 1e6, "k--", label="bound of the machine")
    axes.set(xlabel="modes", ylabel="time per step (µs)")
    axes.grid(alpha=0.3)
    axes.legend()
    figure.tight_layout()
    shared.save(out / "roofline.png", figure, dpi=150)


if __name__ == "__main__":
    main()
