"""Figure 5: with a linear spring between two masses, the force is a half sine; it ends where the spring would pull."""

import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact.impact.collision import Touch
from fem_impact.show import plots

MASS, STIFFNESS = 0.1 / 3.0, 88.6e3  # [kg], [N/m]


def compute(mass=MASS, stiffness=STIFFNESS, speed=source.SPEED):
    """The blow of a mass on a rigid wall; the source gives no numbers, so all three are our choice."""
    return fi.collide([fi.Modes.rigid(mass)], [Touch(fi.Contact.linear(stiffness), 0, None)], speeds=[speed])


def sticky(time, mass=MASS, stiffness=STIFFNESS, speed=source.SPEED):
    """Force [N] if the masses could not separate."""
    return speed * np.sqrt(stiffness * mass) * np.sin(np.sqrt(stiffness / mass) * time)


def draw(hit):
    """Draw the pulse, shaded, within the sine."""
    period = 2.0 * np.pi * np.sqrt(MASS / STIFFNESS)
    time = np.linspace(0.0, 1.5 * period, 600)
    pulse = plots.Curve(hit.time, hit.force, "contact force", plots.VERMILION)
    whole = plots.Curve(time, sticky(time), "if they stuck together", plots.GREY, "--")
    figure = plots.curves(
        [whole, pulse], x=source.TIME, y=plots.Axis("force", "N"), filled=pulse, title="Half a sine, then separation"
    )
    return figure, {"time [s]": hit.time, "force [N]": hit.force}


if __name__ == "__main__":
    source.run("fig05", compute, draw)
