"""Beyond the source: a clapper on the rim of a bell-like free disk of steel, light to heavy, by finite elements."""

import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact import charts

RADIUS, THICKNESS = 0.15, 8e-3  # [m]
MASSES = np.geomspace(0.02, 3.0, 25)  # [kg] of the clapper
STIFFNESSES = np.geomspace(1e7, 1e10, 25)  # [N/m**1.5]
STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)


def compute(masses=MASSES, stiffnesses=STIFFNESSES, max_frequency=12e3):
    """Rigid clappers on a free disk near its rim, Hertz contact, 1 m/s."""
    disk = fi.assemble(fi.mesh.disk(RADIUS), fi.Plate(STEEL, THICKNESS), supports={"boundary": "free"})
    modes = fi.find_modes(disk, max_frequency=max_frequency, damping_ratio=1e-4)
    over = {"stiffness": stiffnesses, "mass": masses}
    law = fi.Contact.hertz(1e9)
    return fi.sweep(modes, fi.Striker.rigid(0.5), law, at=(0.95 * RADIUS, 0.0), speed=1.0, over=over)


def draw(table):
    """Number of impacts."""
    figure = charts.colour_map(
        table.n_impacts.clip(max=4).assign_coords(mass=1e3 * table.mass),
        x=charts.Axis("mass of the clapper", "g", log=True),
        y=charts.Axis("contact stiffness", "N/m$^{1.5}$", log=True),
        colour=charts.Axis("number of impacts, 4 or more as 4"),
        title="Clapper on the rim of a free steel disk of 4.4 kg",
    )
    return figure, source.table_columns(table, "n_impacts", "contact_time", "restitution")


if __name__ == "__main__":
    source.run("beyond_bell", compute, draw)
