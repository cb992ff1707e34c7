"""Figure 5: between two masses with a linear spring the force is a half sine, cut off where it would have to pull."""

import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact import charts
from fem_impact.integrator import Touch

MASS, STIFFNESS = 0.1 / 3.0, 88.6e3  # [kg], [N/m]


def compute(mass=MASS, stiffness=STIFFNESS, speed=source.SPEED):
    """The blow of a mass on a rigid wall; all three are chosen here, the source gives no numbers."""
    return fi.collide([fi.Modes.rigid(mass)], [Touch(fi.Contact.linear(stiffness), 0, None)], speeds=[speed])


def sticky(time, mass=MASS, stiffness=STIFFNESS, speed=source.SPEED):
    """Force [N] if the two could not part."""
    return speed * np.sqrt(stiffness * mass) * np.sin(np.sqrt(stiffness / mass) * time)


def draw(hit):
    """The pulse, shaded, within the sine."""
    period = 2.0 * np.pi * np.sqrt(MASS / STIFFNESS)
    time = np.linspace(0.0, 1.5 * period, 600)
    pulse = charts.Curve(hit.time, hit.force, "contact force", charts.VERMILION)
    whole = charts.Curve(time, sticky(time), "if they stuck together", charts.GREY, "--")
    figure = charts.curves(
        [whole, pulse], x=source.TIME, y=charts.Axis("force", "N"), filled=pulse, title="Half a sine, then separation"
    )
    return figure, {"time [s]": hit.time, "force [N]": hit.force}


if __name__ == "__main__":
    source.run("fig05", compute, draw)
