"""A source of modes of your own: a stretched string, by closed forms.

python studies/tutorials/own_modes.py

Any class with the methods of `fem_impact.modes.shapes.Shapes` is a body: where it is, its mass-normalised shapes, and
how all of it yields to forces, which tells a blow what the modes left out would do. The reference is a mass on a spring
on an endless string, which takes the force as a dashpot would: ``F'' + k / (2 Z) F' + k / m F = 0`` until echoes come.
"""

from dataclasses import dataclass, replace

import numpy as np

import fem_impact as fi
from fem_impact.modes.shapes import Shapes

TENSION, LINE, LENGTH, MODES = 1000.0, 0.01, 2.0, 1500  # [N], [kg/m], [m], [-]
MASS, TIP, SPEED = 2e-3, 2e4, 1.0  # [kg], [N/m], [m/s]


@dataclass(frozen=True, eq=False)
class StringShapes(Shapes):
    """Shapes of a string held at both ends."""

    n_modes: int
    dimension = 1

    def at(self, points):
        return np.sqrt(2.0 / (LINE * LENGTH)) * np.sin(np.pi / LENGTH * points * np.arange(1, self.n_modes + 1))

    def contains(self, points):
        return ((points >= 0.0) & (points <= LENGTH)).all(axis=1)

    def deflection(self, loads, points):
        low, high = np.minimum(points, loads.T), np.maximum(points, loads.T)
        return low * (LENGTH - high) / (TENSION * LENGTH)

    def take(self, n_modes):
        return replace(self, n_modes=n_modes)

    def grid(self):
        cells = np.arange(200)
        return LENGTH * np.arange(201.0)[:, None] / 200.0, np.column_stack([cells, cells + 1])


def main():
    """Contact time [s], the reference, and the error stated [-]."""
    omega = np.pi / LENGTH * np.sqrt(TENSION / LINE) * np.arange(1.0, MODES + 1.0)
    string = fi.Modes(omega, np.zeros(MODES), StringShapes(MODES), LINE * LENGTH)
    hit = fi.strike(
        string, fi.Striker.rigid(MASS), fi.Contact.linear(TIP), at=[0.9], speed=SPEED, tolerance=1e-2, max_impacts=1
    )
    decay = TIP / (4.0 * np.sqrt(TENSION * LINE))
    known = np.pi / np.sqrt(TIP / MASS - decay**2)
    stated = hit.error.of_quantity("contact_time")
    print(f"contact time {1e3 * hit.contact_time:.4f} ms, endless string {1e3 * known:.4f} ms, stated to {stated:.0e}")
    return hit.contact_time, known, stated


if __name__ == "__main__":
    main()
