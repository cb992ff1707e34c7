"""Four taps of an instrumented hammer: each is predicted from the other three."""

from pathlib import Path

from reality.record import Experiment

import fem_impact as fi
from fem_impact.impact.measured import Comparison

FILE = Path(__file__).parents[2] / "measured" / "acceleration_multi.lvm"
UNKNOWN = {
    "contact.stiffness": (1e4, 1e10), "contact.exponent": (1.0, 3.0), "mode1.frequency": (50.0, 3000.0),
    "mode1.mass": (0.01, 50.0),
}  # fmt: skip
CALIBRATION = 0.005  # [-] assumed of a hammer's force


def predict() -> Comparison:
    """Peaks and widths of taps, each from the others; their model error is what the fit leaves of the taps it has."""
    taps = fi.read_taps(FILE, response=())
    found = fi.fit(
        taps, striker=fi.Striker.rigid(0.1), contact=fi.Contact.power(1e7, 1.5), unknown=UNKNOWN, profiles=False,
        robust=False, rng=0,
    )  # fmt: skip
    return found.against(calibration=CALIBRATION)


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
        measured=(), predict=predict,
        reasons=dict.fromkeys(
            ("tap 1, width", "tap 4, width"),
            "no two taps met the same spot: with a contact stiffness for each tap the fit leaves four times less",
        ),
    ),
)  # fmt: skip
