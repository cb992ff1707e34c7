"""Shared by the figure studies: the scenes of *Euphonics* 12.1, the parameters it does not state, and the output.

The source states masses, frequencies, the plate's proportions and the contact stiffness, but not the strike point, the
speed and the damping. The studies use 0.3 of both sides, 1 m/s (30 m/s for the Hertz spring, so that the two marked
springs have equal contact times) and no damping.
"""

import csv
import sys
from collections.abc import Callable, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import find_peaks

import fem_impact as fi
from fem_impact.scenes import maps
from fem_impact.show import plots
from fem_impact.sweeps import grid

sys.path.append(str(Path(__file__).parents[1]))  # of `shared`
import shared

LENGTH, WIDTH = 1.55, 1.0  # [m] the source states only their ratio
AT = (0.3 * LENGTH, 0.3 * WIDTH)  # [m] chosen
SPEED, HERTZ_SPEED = 1.0, 30.0  # [m/s] chosen
PLATE_MASSES = {"500 t": 5e5, "2 kg": 2.0, "200 g": 0.2}  # [kg]
PLATE_COLORS = dict(zip(PLATE_MASSES, (plots.VERMILION, plots.BLUE, plots.GREEN)))
PLATE_FREQUENCY, STICK_FREQUENCY = 100.0, 10e3  # [Hz]
MARKED = 0.1, 88.6e3  # [kg] of the stick, [N/m]: the green circle
STIFF = 0.1, 1000e3  # [kg], [N/m]: the black circle, our choice in the region where the plate stops the stick
MARKED_HERTZ = 0.1, 695e3  # [kg], [N/m**1.5]
MASSES = np.linspace(10e-3, 200e-3, 20)  # [kg] of the maps
STIFFNESSES = np.logspace(4, 6, 20)  # [N/m]
HERTZ_STIFFNESSES = np.logspace(5, 7, 20)  # [N/m**1.5]
BAND = 5e3  # [Hz] of every spectral centroid; not stated by the source
N_MODES = 300  # [-] of a plate, up to 20 kHz
TOLERANCE = 1e-3  # [-]
RISE = 0.005  # [-] of the peak: a hump counts if the force falls this much before it: five tolerances
LINEAR, HERTZ = fi.Contact.linear(MARKED[1]), fi.Contact.hertz(MARKED_HERTZ[1])

TIME = plots.Axis("time", "s")
FORCE = plots.Axis("contact force", "N", limits=(0.0, None))
LEVEL = plots.Axis("force spectrum", "dB", limits=(-60.0, 3.0))
SCALES = {"contact_time": (0.2e-3, 10e-3), "centroid": (0.1e3, 2.5e3)}  # [s], [Hz] ranges of the colours


def plate(mass: float, *, n_modes: int = N_MODES, damping_ratio: float = 0.0) -> fi.Modes:
    """The hinged plate, 1.55 : 1, lowest mode 100 Hz, in closed form."""
    return fi.analytic.rectangle(
        LENGTH, WIDTH, mass=mass, first_frequency=PLATE_FREQUENCY, n_modes=n_modes, damping_ratio=damping_ratio
    )


def stick(mass: float = MARKED[0], first_frequency: float = STICK_FREQUENCY) -> fi.Striker:
    """The stick, which is hinged at its far end and strikes with its free end."""
    return fi.Striker.stick(mass, first_frequency)


def marked_blow(plate_mass: float, stiffness: float = MARKED[1], *, tolerance: float = 1e-4) -> fi.Response:
    """The blow of the 100 g stick through a linear spring."""
    law = fi.Contact.linear(stiffness)
    return fi.strike(plate(plate_mass), stick(), law, at=AT, speed=SPEED, tolerance=tolerance)


def marked_hertz_blow(*, tolerance: float = 1e-4) -> fi.Response:
    """The blow of the 100 g stick on the plate of 500 t through the Hertz spring."""
    return fi.strike(plate(5e5), stick(), HERTZ, at=AT, speed=HERTZ_SPEED, tolerance=tolerance)


def humps(hit: fi.Response) -> np.ndarray:
    """Times [s] and heights [N] of the force maxima that stand out by RISE of the peak, (n, 2)."""
    top, _ = find_peaks(np.pad(hit.force, 1), prominence=RISE * hit.peak_force)
    return np.column_stack([hit.time[top - 1], hit.force[top - 1]])


def linear_map(
    plate_mass: float,
    masses: Any = MASSES,
    stiffnesses: Any = STIFFNESSES,
    *,
    law: fi.Contact = LINEAR,
    damping_ratio: float = 0.0,
    **wanted: Any,
) -> Any:
    """A map of sticks and springs on one plate; ``wanted`` overrides arguments of `fi.sweep`."""
    arguments = {"at": AT, "speed": SPEED, "tolerance": TOLERANCE, "max_frequency": BAND, **wanted}
    over = {"stiffness": np.asarray(stiffnesses), "mass": np.asarray(masses)}
    modes = plate(plate_mass, damping_ratio=damping_ratio)
    table = fi.sweep(modes, stick(), law, over=over, **arguments)
    case = grid.Case(modes, stick(), law, np.asarray(arguments["at"]), arguments["speed"])
    return maps.with_theory(table, case, over)


def hertz_map(plate_mass: float, masses: Any = MASSES, stiffnesses: Any = HERTZ_STIFFNESSES, **wanted: Any) -> Any:
    """A map of sticks and Hertz springs on one plate."""
    return linear_map(plate_mass, masses, stiffnesses, **{"law": HERTZ, "speed": HERTZ_SPEED, **wanted})


def draw_map(table: Any, layer: str, title: str, marks: Sequence[plots.Mark]) -> tuple[Any, dict[str, np.ndarray]]:
    """Draw one layer of a map, on the same scale in all figures, and return its data."""
    figure = maps.draw(table.assign_attrs(title=title), layer, marks, limits=SCALES[layer])
    return figure, table_columns(table, layer, "n_impacts")


def mark(case: tuple[float, float], label: str, color: str = plots.GREEN) -> plots.Mark:
    """A circle around a case (mass, stiffness) of a map."""
    return plots.Mark(1e3 * case[0], case[1], label, color)


FIGURES_8_9 = [mark(MARKED, "figures 8 and 9")]
FIGURES_8_9_HERTZ = [mark(MARKED_HERTZ, "figures 8 and 9")]
FIGURES_21_22 = [mark(MARKED, "figure 21"), mark(STIFF, "figure 22", plots.BLACK)]


def decibels(spectrum: np.ndarray) -> np.ndarray:
    """Level [dB] of a spectrum relative to its first value."""
    size = np.abs(spectrum)
    return 20.0 * np.log10(np.maximum(size, 1e-12 * size[0]) / size[0])


def table_columns(table: Any, *layers: str) -> dict[str, np.ndarray]:
    """A map as columns of a CSV file with one row per cell."""
    frame = table[list(layers)].to_dataframe().reset_index()
    return {str(name): frame[name].to_numpy() for name in frame}


def publish(name: str, figure: Any, columns: dict[str, Any]) -> None:
    """Write NAME.png, in the format of `shared`, and NAME.csv to the folder of the command line, or to studies/out."""
    folder = shared.folder()
    written = shared.save(folder / f"{name}.png", figure)
    with (folder / f"{name}.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(columns)
        table.writerows(zip_longest(*([_text(value) for value in values] for values in columns.values())))
    print(f"{written} and .csv")


def _text(value: Any) -> str:
    return value if isinstance(value, str) else f"{value:.9g}"


def run(name: str, compute: Callable[[], Any], draw: Callable[[Any], tuple[Any, dict[str, Any]]]) -> None:
    """Compute, draw and write a figure."""
    publish(name, *draw(compute()))
