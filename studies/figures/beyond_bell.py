"""Beyond the source: on the rim of a bell-like free disk, a clapper hits once if it is light or soft enough."""

import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact.scenes import maps
from fem_impact.show import plots
from fem_impact.sweeps import grid

RADIUS, THICKNESS = 0.15, 8e-3  # [m]
MASSES = np.geomspace(0.02, 3.0, 25)  # [kg] of the clapper
STIFFNESSES = np.geomspace(1e7, 1e10, 25)  # [N/m**1.5]
STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)


def compute(masses=MASSES, stiffnesses=STIFFNESSES, max_frequency=12e3):
    """Strike a free disk near its rim with rigid clappers, Hertz contact, 1 m/s."""
    disk = fi.assemble(fi.mesh.disk(RADIUS), fi.Plate(STEEL, THICKNESS), supports={"boundary": "free"})
    modes = fi.find_modes(disk, max_frequency=max_frequency, damping_ratio=1e-4)
    over = {"stiffness": stiffnesses, "mass": masses}
    case = grid.Case(modes, fi.Striker.rigid(0.5), fi.Contact.hertz(1e9), np.array([0.95 * RADIUS, 0.0]), 1.0)
    table = fi.sweep(modes, case.striker, case.contact, at=case.at, speed=case.speed, over=over)
    return maps.with_theory(table, case, over).assign_attrs(title="Clapper on the rim of a free steel disk of 4.4 kg")


def draw(table):
    """Draw the number of impacts."""
    clipped = table.assign(n_impacts=table.n_impacts.clip(max=4))
    figure = maps.draw(clipped, "n_impacts", colour=plots.Axis("number of impacts, 4 or more as 4"))
    return figure, source.table_columns(table, "n_impacts", "contact_time", "restitution")


if __name__ == "__main__":
    source.run("beyond_bell", compute, draw)
