"""Checks the estimated error of each frequency, and measures what a tolerance on frequencies costs.

Takes random bodies with closed forms, of every edge support and size, with and without a tolerance, and compares the
estimated error of each mode with the true error. Then compares the time of `find_modes` with a tolerance with that of
the cheapest mesh, out of many, that meets the tolerance.
"""

import argparse
import time

import numpy as np

import fem_impact as fi

TOLERANCES = (None, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
FLOOR = 1e-13  # [-] smaller true errors are rounding errors of the closed form


def bodies(rng):
    """A random body: mesh, section, supports, and a function that returns its first n exact modes."""
    kind = rng.choice(["rectangle", "disk", "beam"])
    size = 10.0 ** rng.uniform(-2.0, 2.0)
    E, nu, rho = ((210e9, 0.3, 7850.0), (11e9, 0.1, 450.0), (2.3e9, 0.45, 1100.0))[rng.integers(3)]
    material, thin = fi.Material(E=E, nu=nu, rho=rho), size * 10.0 ** rng.uniform(-4.0, -1.0)
    if kind == "beam":
        ends = tuple(rng.choice(["clamped", "hinged", "free"], 2))
        bar = fi.Beam.rectangular(material, width=thin, height=thin)
        held = {name: end for name, end in zip(("left", "right"), ends) if end != "free"}
        return fi.mesh.line(size), bar, held, lambda n: fi.analytic.beam(size, ends=ends, section=bar, n_modes=n)
    plate = fi.Plate(material, thin)
    if kind == "disk":
        edge = str(rng.choice(["clamped", "hinged", "free"]))
        exact = lambda n: fi.analytic.disk(size, edge=edge, section=plate, n_modes=n)  # noqa: E731
        return fi.mesh.disk(size), plate, {"boundary": edge}, exact
    width = size * rng.uniform(0.2, 1.0)
    exact = lambda n: fi.analytic.rectangle(size, width, section=plate, n_modes=n)  # noqa: E731
    return fi.mesh.rectangle(size, width), plate, {"boundary": "hinged"}, exact


def claims(n_modes, seed=0):
    """True error, estimated error and tolerance (0 for none) of at least ``n_modes`` modes, each (n,)."""
    rng = np.random.default_rng(seed)
    rows = []
    while sum(len(row) for row in rows) < n_modes:
        mesh, section, supports, exact = bodies(rng)
        count, tolerance = int(rng.integers(5, 41)), TOLERANCES[rng.integers(len(TOLERANCES))]
        found = fi.find_modes(fi.assemble(mesh, section, supports), n_modes=count, tolerance=tolerance)
        flexible = found.omega > 0.0
        truth = np.abs(found.omega[flexible] / exact(count).omega[flexible] - 1.0)
        claim = found.frequency_error[flexible]
        rows.append(np.column_stack([truth, claim, np.full(len(truth), tolerance or 0.0)]))
    return np.vstack(rows).T


def cost(tolerance, n_modes=200):
    """Time with a tolerance, and time of the cheapest mesh that meets it, for three plates."""
    plate = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 2e-3)
    cases = {
        "hinged rectangle": (
            fi.mesh.rectangle(1.55, 1.0),
            fi.analytic.rectangle(1.55, 1.0, section=plate, n_modes=n_modes),
        ),
        "clamped disk": (fi.mesh.disk(1.0), fi.analytic.disk(1.0, edge="clamped", section=plate, n_modes=n_modes)),
        "free disk": (fi.mesh.disk(1.0), fi.analytic.disk(1.0, edge="free", section=plate, n_modes=n_modes)),
    }
    for name, (mesh, exact) in cases.items():
        supports = {"boundary": name.split()[0]}
        flexible = exact.omega > 0.0

        def timed(shape, tolerance=None, supports=supports, exact=exact, flexible=flexible):
            best = np.inf
            for _ in range(2):
                start = time.perf_counter()
                system = fi.assemble(shape, plate, supports)
                found = fi.find_modes(system, n_modes=n_modes, tolerance=tolerance)
                best = min(best, time.perf_counter() - start)
            return best, np.abs(found.omega[flexible] / exact.omega[flexible] - 1.0).max(), found.shapes.system.n_dofs

        seconds, error, unknowns = timed(mesh, tolerance)
        size = 0.8 * mesh.size
        while (cheapest := timed(mesh.refined(mesh.size / size)))[1] > tolerance:
            size /= 1.06
        yield name, seconds, error, unknowns, cheapest[0], cheapest[2]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--modes", type=int, default=2000)
    options = parser.parse_args()
    truth, claim, tolerance = claims(options.modes)
    ratio = claim / np.maximum(truth, FLOOR)
    print(f"{len(truth)} modes; estimate at least a third of the true error: {np.mean(claim >= truth / 3.0):.2%}")
    print(f"estimate at most 30 times the true error: {np.mean(ratio <= 30.0):.2%}, median {np.median(ratio):.2g}")
    asked = tolerance > 0.0
    print(f"tolerance met: {np.mean(truth[asked] <= tolerance[asked]):.2%}")
    for wanted in (1e-2, 1e-4, 1e-6):
        for name, seconds, error, unknowns, cheapest, n_dofs in cost(wanted):
            print(
                f"{wanted:.0e} {name:<17} {seconds:6.2f} s, {unknowns:6d} unknowns, off by {error:.1e}; "
                f"cheapest mesh {cheapest:6.2f} s, {n_dofs:6d} unknowns: {seconds / cheapest:.2f} times"
            )


if __name__ == "__main__":
    main()
