"""Random bodies in space, rigid motions and elastic modes, as arrays for other equations and as a `fi.Body`."""

import numpy as np

import fem_impact as fi


def tumbler(rng, n_elastic):
    """A random body in space: nodes, mass, inertia, elastic modes, and the same as a `fi.Body`."""
    nodes, mass = rng.uniform(-0.1, 0.1, (5, 3)), float(rng.uniform(0.1, 1.0))
    spread = rng.normal(size=(6, 3)) * 0.05
    inertia = mass / 6.0 * (np.trace(spread.T @ spread) * np.eye(3) - spread.T @ spread)
    omega, zeta = np.sort(rng.uniform(3e3, 3e4, n_elastic)), rng.uniform(0.0, 0.05, n_elastic)
    shapes = rng.normal(size=(5, 3, n_elastic)) * mass**-0.5
    bare = fi.Body(omega / (2.0 * np.pi), shapes, nodes, mass, damping_ratio=zeta)
    return {"nodes": nodes, "m": mass, "I": inertia, "omega": omega, "zeta": zeta, "shapes": shapes,
            "body": bare.freed(inertia, (0.0, 0.0, 0.0))}  # fmt: skip
