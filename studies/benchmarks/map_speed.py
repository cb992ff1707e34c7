"""Measures the speed of maps against plain loops over `strike` and over solve_ivp.

    python studies/benchmarks/map_speed.py [--bounces 1000000]
    python studies/benchmarks/map_speed.py --cluster 10000000      threads against Dask with two workers of one thread
    python studies/benchmarks/map_speed.py --elements [NAME ...]   Ritz vectors against modes on plates by elements
    python studies/benchmarks/map_speed.py --pictures [--centroid] 400 x 400 cells, all computed and refined; borders
    python studies/benchmarks/map_speed.py --decisions         draws pictures/map_of_decisions.png, of a Hertz contact

Stick and hinged plate of *Euphonics* 12.1, 300 modes, tolerance 1e-3. Times are the best of several runs and do not
include compilation.

On plates by elements (scenes of `scene_speed.py`): a map of 20 x 20 cells at the tolerance 1e-2, over half a decade of
the striker's mass and two decades of stiffness; the choice among ten hammers; and how long `fem-impact explore` takes
to open and to know a new strike point. Through vectors and through modes in turn, one run each, compared cell by cell;
in processor seconds, which tell more than wall time where others use the machine, too.

Pictures: the source's maps at 20 x 20 and at 400 x 400 cells, all of them computed or only those where the answer
changes, and what locating the borders between numbers of impacts costs; in processor seconds, the least of two runs.
Single blows at a hundredth of the tolerance, up to 1e-3 of an axis to both sides of a border, check where it is.
"""

import os
import resource
import sys
import tempfile
import time
import warnings
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import scene_speed
from scipy.integrate import solve_ivp

import fem_impact as fi
from fem_impact.pages import explore_model
from fem_impact.scenes import maps
from fem_impact.sweeps import bodies, hammers
from fem_impact.sweeps import grid as cells

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared
from figures import source_scenes as source

STICK = source.stick()
PICTURE = shared.PICTURES / "map_of_decisions.png"


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
    stick, blow = source.stick(first_frequency=frequency), {"at": source.AT, "speed": 1.0, "over": over}
    rough, fine = (fi.sweep(modes, stick, fi.Contact.linear(1e5), tolerance=t, **blow) for t in (1e-3, 1e-5))
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
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster, Client(cluster) as client:
        grid(modes, 300), grid(modes, 300, client=client)
        for _ in range(3):
            alone, spread = best(1, grid, modes, side), best(1, partial(grid, client=client), modes, side)
            print(f"{side**2} bounces: threads {alone:.2f} s, Dask {spread:.2f} s, {spread / alone:.2f} times")
    print(f"largest memory of this process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


MASSES = [m * 10.0**e for e in (-3, -2, -1) for m in (1.0, 2.0, 5.0)] + [1.0]  # [kg] of hammers, as at the prompt
BANDWIDTH = 1000.0  # [Hz] that they should reach


def scenes(only=()):
    """Scenes of plates by elements, by name; their texts are those of scene_speed.py."""
    found = {}
    for name, (text, _) in scene_speed.NAMED.items():
        if not only or name in only:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"{name}.toml"
                path.write_text(text.replace("../../meshes", shared.MESHES.as_posix()))
                found[name] = fi.load_scene(path)
                found[name].built  # noqa: B018  reads the outline while the folder is there
    return found


def timed(work, *arguments, **options):
    """Processor time [s] of all threads and what the work gives; None in its place if it refuses."""
    start = time.process_time()
    try:
        found = work(*arguments, **options)
    except fi.SimulationError as refusal:
        return time.process_time() - start, None, str(refusal)
    return time.process_time() - start, found, ""


def map_of(scene, alone, tolerance=1e-2, side=20):
    """A map about a scene, through vectors (``alone``) or modes; with the number of either."""
    striker, law = scene.make_striker(), scene.make_contact()
    over = {
        "mass": striker.mass * np.geomspace(10**-0.25, 10**0.25, side),
        "stiffness": law.stiffness * np.geomspace(0.1, 10.0, side),
    }
    base, axes = bodies.body_of(scene.built, over, tolerance=tolerance, alone=alone)
    return cells.compute_map(base, axes, cells.Job(tolerance)), base.modes.n_modes


def hammers_of(scene, vectors):
    """The choice of a hammer for a scene, through vectors or modes."""
    target = scene.built.target
    if not vectors:  # as many modes as the choice takes where there are no vectors
        target = replace(target, modes=target.finished(target.find(hammers.MOST_MODES, tolerance=1e-2)))
    return hammers.choose_on(target, scene.blow.values["at"], BANDWIDTH, MASSES)


def apart(one, other):
    """Largest difference of two maps in cells with as many impacts, and the number of the other cells."""
    same = (one.n_impacts == other.n_impacts).values
    found = np.abs(one.restitution - other.restitution).values
    for name in ("impulse", "contact_time", "peak_force"):
        found = np.maximum(found, np.abs(one[name] / other[name] - 1.0).values)
    return found[same].max(), int((~same).sum())


def by_elements(only):
    """Compare vectors with modes on plates by elements."""
    for name, scene in scenes(only).items():
        plate = scene.built.target
        fi.strike(fi.Modes.rigid(1.0), fi.Striker.rigid(0.1), fi.Contact.hertz(1e6), at=None, speed=1.0)  # compiles
        grid(source.plate(2.0, n_modes=30), 3)
        print(f"{name}: {plate.mass:.3g} kg, load {os.getloadavg()[0]:.1f}")
        seconds, found, _ = timed(map_of, scene, True)
        table, count = found
        met = float(table.tolerance_met.mean())
        print(f"  map by {count} vectors {seconds:.1f} s, {met:.0%} of the cells meet the tolerance", flush=True)
        before, other, refusal = timed(map_of, scene, False)
        if other is None:
            print(f"  map by modes refused: {refusal}")
        else:
            off, counts = apart(table, other[0])
            print(
                f"  map by {other[1]} modes {before:.1f} s, {before / seconds:.1f} times; cells with as many impacts "
                f"differ by at most {off:.1e}, {counts} of {table.n_impacts.size} have another number"
            )
        seconds, one, _ = timed(hammers_of, scene, True)
        before, two, refusal = timed(hammers_of, scene, False)
        print(
            f"  hammers by vectors {seconds:.1f} s, by modes {before:.1f} s, {before / seconds:.1f} times", flush=True
        )
        for first, second in zip(one, two or ()):
            if first.hardest and second.hardest and not (first.unlimited or second.unlimited):
                print(f"    {1e3 * first.mass:.4g} g: hardest tip {first.hardest:.4g} and {second.hardest:.4g} N/m")
        seconds, setup, _ = timed(explore_model.Setup.of, scene)
        point, seen, _ = timed(setup.seen, setup.start.at)
        before, _, _ = timed(lambda: scene.modes(100))  # noqa: B023
        print(
            f"  explore opens after {seconds:.1f} s, before after {before:.1f} s or more; a strike point is known by "
            f"{seen.n_modes} vectors after {point:.1f} s"
        )
        for stiffness in (1.0, 100.0):
            settings = replace(setup.start, stiffness=stiffness)
            exact, quick = (setup.case(settings, seen=modes).blow().error.total for modes in (seen, None))
            print(
                f"    {stiffness:g} times the stiffness: error {exact:.1e} by vectors, {quick:.1e} by the first modes"
            )


def spent(work, **wanted):
    """Least processor time [s] of two runs, and what the work gives."""
    times = []
    for _ in range(2):
        start = time.process_time()
        found = work(**wanted)
        times.append(time.process_time() - start)
    return min(times), found


NEAR = (-1.0, -0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 1.0)  # [1e-3 of an axis] tongues may be narrower than 1e-3


def misplaced(modes, law, table, number=40):
    """How many points of borders, of some at random, have the same number of impacts 1e-3 of the axes around them."""
    places = [(border, point) for border in fi.read_borders(table) for point in border.points]
    chosen = np.random.default_rng(0).choice(len(places), min(number, len(places)), replace=False)
    wrong = 0
    for border, point in (places[i] for i in chosen):
        counts = []
        for along, side in product((0, 1), NEAR):
            stiffness, mass = point
            ends = np.asarray(table[border.axes[along]])[[0, -1]]
            if along == 0:
                stiffness *= (ends[1] / ends[0]) ** (1e-3 * side)
            else:
                mass += 1e-3 * side * (ends[1] - ends[0])
            contact = fi.Contact(stiffness=stiffness, exponent=law.exponent)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", fi.ToleranceWarning)  # of leaving out modes: maps have as many
                hit = fi.strike(modes, source.stick(mass), contact, at=source.AT, speed=1.0, tolerance=1e-5)
            counts.append(hit.n_impacts)
        wrong += not min(counts) <= border.impacts < max(counts)
    return wrong, len(chosen)


def pictures(band):
    """Compare ways to 400 x 400 cells of the source's maps."""
    for name, mass, law, ends in (
        ("2 kg, linear", 2.0, source.LINEAR, (1e4, 1e6)),
        ("200 g, linear", 0.2, source.LINEAR, (1e4, 1e6)),
        ("200 g, Hertz", 0.2, source.HERTZ, (1e5, 1e8)),
    ):
        modes = source.plate(mass)
        over = {"stiffness": {"from": ends[0], "to": ends[1], "scale": "log"}, "mass": {"from": 10e-3, "to": 200e-3}}
        blow = {"at": source.AT, "speed": 1.0, "over": over, "max_frequency": band}
        work = partial(fi.sweep, modes, source.stick(), law, **blow)
        work(cells=20, refine=False)  # compiles
        small, _ = spent(work, cells=20, refine=False, borders=False)
        dense, whole = spent(work, refine=False, borders=False)
        refined, table = spent(work, refine=True, borders=False)
        off, counts = apart(whole, table)
        print(
            f"{name}: 20 x 20 in {small:.2f} s; 400 x 400 in {dense:.2f} s, refined in {refined:.2f} s, "
            f"{dense / refined:.1f} times; {table.attrs['cells']}; off by {off:.1e}, {counts} other numbers of impacts",
            flush=True,
        )
        if band is None:
            both, lined = spent(work, refine=True, borders=True)
            wrong, tried = misplaced(modes, law, lined)
            print(f"  borders in {both - refined:.2f} s: {lined.attrs['borders']}")
            print(f"  {wrong} of {tried} points of borders farther off than 1e-3 of the axes", flush=True)


def decisions():
    """Draw which sticks and contacts hit the plate of 200 g once, twice or more often, and check the borders."""
    axes = np.linspace(10e-3, 200e-3, 400), np.geomspace(1e5, 1e8, 400)
    work = partial(source.hertz_map, 0.2, *axes, speed=1.0, max_frequency=None, refine=True, borders=True)
    seconds, table = spent(work)
    wrong, tried = misplaced(source.plate(0.2), source.HERTZ, table)
    print(f"{seconds:.2f} s of processor time; {table.attrs['cells']}; {table.attrs['borders']}")
    print(f"{wrong} of {tried} points of borders farther off than 1e-3 of the axes")
    shared.save(PICTURE, maps.draw(table, "n_impacts", title="Sticks on a hinged plate of 200 g, Hertz contact"))


def main():
    """Measure and print the times."""
    parser = shared.parser(__doc__)
    parser.add_argument("--bounces", type=int, default=1_000_000)
    parser.add_argument("--cluster", type=int, default=0, metavar="BOUNCES")
    parser.add_argument("--elements", nargs="*", metavar="NAME")
    parser.add_argument("--pictures", action="store_true")
    parser.add_argument("--centroid", action="store_true")
    parser.add_argument("--decisions", action="store_true")
    wanted = parser.parse_args()
    bounces = wanted.bounces
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    if wanted.elements is not None:
        by_elements(wanted.elements)
        return
    if wanted.decisions:
        decisions()
        return
    if wanted.pictures:
        pictures(source.BAND if wanted.centroid else None)
        return
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
    blow = {"at": source.AT, "speed": 1.0, "over": lossy, "tolerance": 1e-3}
    seconds = best(2, lambda: fi.sweep(plates["2 kg"], STICK, fi.Contact.linear(88.6e3), **blow))
    print(f"with loss: {1e6 * seconds / 400:.0f} us each of 400")
    for n_modes in (30, 300, 3000):
        seconds = best(2, grid, source.plate(2.0, n_modes=n_modes), 300)
        print(f"{n_modes} modes: {1e6 * seconds / 9e4:.2f} us each of 90 000")


if __name__ == "__main__":
    main()
