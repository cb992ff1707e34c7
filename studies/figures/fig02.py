"""Figure 2: in a row of five equal steel balls, only the last one flies off; the others hardly move."""

from dataclasses import dataclass

import numpy as np
import source_scenes as source

import fem_impact as fi
from fem_impact.impact.collision import Touch
from fem_impact.show import plots

RADIUS, SWING, SPEED = 0.01, 1.0, 0.5  # [m], [s] period, [m/s] of the first ball on arrival
GAP = 20e-6  # [m] between neighbours, the source's "very small space"
STEEL = {"E": 210e9, "nu": 0.3, "rho": 7850.0}
PAINTS = (plots.BLUE, plots.VERMILION, plots.GREEN, plots.ORANGE, plots.PURPLE)


@dataclass(frozen=True)
class Cradle:
    """Motion of the balls; the first one arrives at time zero."""

    time: np.ndarray  # (n_times,) [s]
    position: np.ndarray  # (n_times, n_balls) [m] from each ball's rest position
    velocity: np.ndarray  # (n_times, n_balls) [m/s]
    impacts: tuple


def cradle(n_balls: int, duration: float = 1.3 * SWING) -> Cradle:
    """Equal balls on pendulums in a row; the first one swings down onto the others, which are at rest."""
    ball = fi.Striker.sphere(fi.Material(**STEEL), RADIUS)
    pendulum = fi.Modes.from_arrays([1.0 / SWING], [[ball.mass**-0.5]], points=[[0.0]], mass=ball.mass, complete=True)
    stiffness = 4.0 / 3.0 * np.sqrt(0.5 * RADIUS) * STEEL["E"] / (2.0 * (1.0 - STEEL["nu"] ** 2))
    law = fi.Contact.hertz(stiffness, gap=GAP)
    touches = [Touch(law, i, i + 1, [0.0], [0.0]) for i in range(n_balls - 1)]
    states = [(np.zeros(1), np.zeros(1)) for _ in range(n_balls)]
    states[0] = np.array([GAP]) * ball.mass**0.5, np.array([SPEED]) * ball.mass**0.5
    hit = fi.collide([pendulum] * n_balls, touches, states=states, duration=duration, tolerance=1e-3)
    time = np.linspace(0.0, duration, 1500)
    motion = [hit.modal_state(time, body=i) for i in range(n_balls)]
    position, velocity = (np.hstack([m[part] for m in motion]) * ball.mass**-0.5 for part in (0, 1))
    return Cradle(time, position, velocity, hit.impacts)


def compute():
    """Five balls, for one and a half swings."""
    return cradle(5)


def draw(result: Cradle):
    """Draw the position of each ball over time; the rest positions are one diameter apart."""
    curves = [
        plots.Curve(result.time, result.position[:, i] + 2.0 * RADIUS * i, f"ball {i + 1}", PAINTS[i])
        for i in range(result.position.shape[1])
    ]
    axis = plots.Axis("time", "s", limits=(None, 1.65 * SWING))  # room for the legend
    title = f"Newton's cradle, {len(curves)} balls: the first arrives at time zero"
    figure = plots.curves(curves, x=axis, y=plots.Axis("position", "m"), title=title)
    columns = {"time [s]": result.time}
    columns |= {f"ball {i + 1} [m]": result.position[:, i] for i in range(result.position.shape[1])}
    return figure, columns


if __name__ == "__main__":
    source.run("fig02", compute, draw)
