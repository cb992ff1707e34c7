"""Four taps of an instrumented hammer: each is predicted from the other three."""

from pathlib import Path

import numpy as np
from reality.record import Experiment, Measured, Predicted
from scipy.signal import resample

import fem_impact as fi

FILE = Path(__file__).parents[2] / "measured" / "acceleration_multi.lvm"
UNKNOWN = {
    "contact.stiffness": (1e4, 1e10), "contact.exponent": (1.0, 3.0), "mode1.frequency": (50.0, 3000.0),
    "mode1.mass": (0.01, 50.0),
}  # fmt: skip
FINE = 16  # [-] times as many samples, to read a width
DRAWS = 4000  # [-] of the errors behind a band


def width(force: np.ndarray, rate: float) -> float:
    """Time [s] for which a pulse (n_times,) exceeds half its peak, of its band-limited interpolation."""
    fine = resample(force, FINE * len(force))
    return float(np.count_nonzero(fine > 0.5 * fine.max()) / (FINE * rate))


def measured() -> tuple[Measured, ...]:
    """Peak and width of every tap."""
    taps = fi.read_taps(FILE, response=())
    points = []
    for label, force, peak, noise in zip(taps.labels, taps.force, taps.peak, taps.noise):
        points.append(Measured(f"{label}, peak", float(peak), 1.645 * max(float(noise), 0.005 * float(peak)), "N"))
        points.append(Measured(f"{label}, width", width(force, taps.rate), 0.25 / taps.rate, "s"))
    return tuple(points)


def predict() -> Predicted:
    """Peaks and widths of taps left out; their model error is what the fit leaves of the taps it has."""
    taps = fi.read_taps(FILE, response=())
    found = fi.fit(
        taps, striker=fi.Striker.rigid(0.1), contact=fi.Contact.power(1e7, 1.5), unknown=UNKNOWN, profiles=False,
        robust=False, rng=0,
    )  # fmt: skip
    rows = [x for one in found.left_out() for x in (one.force.max(), width(one.force, taps.rate))]
    return Predicted(np.tile(rows, (DRAWS, 1)), computation=1e-3, model=found.error)


EXPERIMENTS = (
    Experiment(
        key="taps",
        title="Four taps of a hammer, each from the others",
        source="github.com/ladisk/open_source_research_in_structural_dynamics, data/ (excerpt in studies/measured)",
        licence="MIT, see studies/measured/LICENSE",
        rig="an instrumented hammer on a structure, 25.6 kHz; neither is described",
        known={
            "contact, one mode of the structure": "found from the other three taps",
            "mass of the hammer": "0.1 kg held",
            "speed and onset": "of each tap, found from itself",
        },
        left_open="hammer and structure, whether every tap met the same spot",
        measured=measured(), predict=predict,
        reasons=dict.fromkeys(
            ("tap 1, width", "tap 4, width"),
            "no two taps met the same spot: with a contact stiffness for each tap the fit leaves four times less",
        ),
    ),
)  # fmt: skip
