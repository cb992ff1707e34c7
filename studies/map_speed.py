"""Measures the speed of maps against plain loops over `strike` and over solve_ivp.

    python studies/map_speed.py [--bounces 1000000]
    python studies/map_speed.py --cluster 10000000      threads against Dask with two workers of one thread

Stick and hinged plate of *Euphonics* 12.1, 300 modes, tolerance 1e-3. Times are the best of several runs and do not
include compilation.
"""

import argparse
import os
import resource
import time
from functools import partial

import numpy as np
import source_scenes as source
from scipy.integrate import solve_ivp

import fem_impact as fi

STICK = source.stick()


def best(repeats, work, *arguments):
    """Shortest wall time [s] of several runs."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work(*arguments)
        times.append(time.perf_counter() - start)
    return min(times)


def grid(modes, side, **wanted):
    """One map of sticks and linear springs with ``side`` x ``side`` cells."""
    over = {"mass": np.linspace(10e-3, 200e-3, side), "stiffness": np.geomspace(1e4, 1e6, side)}
    return fi.sweep(modes, STICK, fi.Contact.linear(1e5), at=source.AT, speed=1.0, over=over, tolerance=1e-3, **wanted)


def beyond(modes, frequency, side=100):
    """Say how many cells of a map at 1e-3 miss the tolerance, judged by a map at 1e-5."""
    over = {"mass": np.linspace(11e-3, 197e-3, side), "stiffness": np.geomspace(1.1e4, 0.93e6, side)}
    stick, shared = source.stick(first_frequency=frequency), {"at": source.AT, "speed": 1.0, "over": over}
    rough, fine = (fi.sweep(modes, stick, fi.Contact.linear(1e5), tolerance=t, **shared) for t in (1e-3, 1e-5))
    same = (rough.n_impacts == fine.n_impacts).values
    off = np.abs(rough.restitution - fine.restitution).values
    for name in ("contact_time", "peak_force"):
        off = np.maximum(off, np.abs(rough[name] / fine[name] - 1.0).values)
    return (
        f"of {side**2} cells {(off[same] > 1e-3).sum()} off by more than 1e-3, at most {off[same].max():.1e}, median "
        + (f"{np.median(off):.1e}; {(~same).sum()} with a different number of impacts")
    )


def by_solve_ivp(plate_mass, mass, stiffness, n_modes=300):
    """One bounce off the plate by SciPy's DOP853 at the same tolerance, up to the first separation."""
    modes = source.plate(plate_mass, n_modes=n_modes)
    shape, omega = modes.shape_at(source.AT)[0], np.array(modes.omega)

    def slope(_, state):
        approach = state[0] - shape @ state[2 : 2 + n_modes]
        force = stiffness * max(approach, 0.0)
        q, p = state[2 : 2 + n_modes], state[2 + n_modes :]
        return np.concatenate([[state[1], -force / mass], p, shape * force - omega**2 * q])

    def parted(_, state):
        return state[0] - shape @ state[2 : 2 + n_modes] + 1e-12

    parted.terminal, parted.direction = True, -1
    start = np.zeros(2 + 2 * n_modes)
    start[1] = 1.0
    return solve_ivp(slope, (0.0, 0.1), start, "DOP853", events=parted, rtol=1e-4, atol=1e-9)


def by_cluster(bounces):
    """Compute the same map of the 2 kg plate alternately by threads and by a local cluster."""
    from distributed import Client, LocalCluster

    modes, side = source.plate(2.0), round(bounces**0.5)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        grid(modes, 300), grid(modes, 300, client=client)
        for _ in range(3):
            alone, spread = best(1, grid, modes, side), best(1, partial(grid, client=client), modes, side)
            print(f"{side**2} bounces: threads {alone:.2f} s, Dask {spread:.2f} s, {spread / alone:.2f} times")
    print(f"largest memory of this process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


def main():
    """Measure and print the times."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bounces", type=int, default=1_000_000)
    parser.add_argument("--cluster", type=int, default=0, metavar="BOUNCES")
    wanted = parser.parse_args()
    bounces = wanted.bounces
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    if wanted.cluster:
        by_cluster(wanted.cluster)
        return
    plates = {name: source.plate(mass) for name, mass in source.PLATE_MASSES.items()}
    for name, modes in plates.items():
        grid(modes, 20)
        small, large = best(9, grid, modes, 20), best(5, grid, modes, 100)
        print(f"plate {name}: 20 x 20 in {1e3 * small:.1f} ms, 100 x 100 in {1e3 * large:.0f} ms")
    side = round(bounces**0.5)
    for name, modes in plates.items():
        seconds = best(1, grid, modes, side)
        print(f"plate {name}: {side**2} bounces in {seconds:.2f} s, {1e6 * seconds / side**2:.2f} us each")
    print(f"largest memory so far: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    sticks = [source.stick(mass) for mass in np.linspace(10e-3, 200e-3, 50)]

    def loop():
        for stick in sticks:
            law = fi.Contact.linear(88.6e3)
            fi.strike(plates["2 kg"], stick, law, at=source.AT, speed=1.0, tolerance=1e-3)

    loop()
    each, batch = best(3, loop) / 50, best(5, grid, plates["2 kg"], 100) / 1e4
    ivp = best(1, by_solve_ivp, 2.0, 0.1 / 3.0, 88.6e3)
    print(
        f"one bounce off 2 kg: map {1e6 * batch:.2f} us; loop over strike {1e6 * each:.0f} us, {each / batch:.0f} times"
    )
    print(f"solve_ivp (DOP853, rigid stick, first contact only) {1e6 * ivp:.0f} us, {ivp / batch:.0f} times")
    for frequency in (600.0, 2e3, 10e3):
        print(f"200 g plate, stick of {frequency:g} Hz: " + beyond(plates["200 g"], frequency))
    lossy = {"mass": np.linspace(10e-3, 200e-3, 20), "loss": np.linspace(0.01, 0.2, 20)}
    shared = {"at": source.AT, "speed": 1.0, "over": lossy, "tolerance": 1e-3}
    seconds = best(2, lambda: fi.sweep(plates["2 kg"], STICK, fi.Contact.linear(88.6e3), **shared))
    print(f"with loss: {1e6 * seconds / 400:.0f} us each of 400")
    for n_modes in (30, 300, 3000):
        seconds = best(2, grid, source.plate(2.0, n_modes=n_modes), 300)
        print(f"{n_modes} modes: {1e6 * seconds / 9e4:.2f} us each of 90 000")


if __name__ == "__main__":
    main()
