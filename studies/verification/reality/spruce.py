"""Spruce plates that were tapped, four clamped and two free: every frequency predicted from the others."""

from collections.abc import Mapping
from functools import cache, partial

import numpy as np
from reality.record import Experiment, Measured, Predicted
from reality.tapped import ROUNDS, from_the_others, slopes

import fem_impact as fi

SESSIONS = (  # [Hz] the plate of 4.61 mm on three occasions
    (82.8, 160.7, 517.2, 635.1, 657.3, 1059.5),
    (80.8, 156.9, 507.2, 629.4, 670.9, 1069.9),
    (82.4, 157.2, 510.25, 631.0, 669.6, 1070.1),
)
READING = float(np.sqrt(np.mean(np.var(np.log(SESSIONS), axis=0, ddof=1))))  # [-] one deviation of one session: 1.1 %
PLATES = {  # thickness [mm] -> length, width, thickness [m], density [kg/m^3], Poisson's ratio, and frequencies [Hz]
    "3.00": (0.223, 0.114, 3.00e-3, 473.9, 0.51, (52.0, 98.0, 311.0, 337.0, 398.0, 637.0)),
    "3.80": (0.175, 0.129, 3.80e-3, 438.0, 0.40, (97.0, 160.0, 326.0, 599.0, 645.0, 716.0)),
    "4.50": (0.212, 0.108, 4.50e-3, 457.0, 0.40, (87.0, 160.0, 540.0, 616.0, 651.0, 1061.0)),
    "4.61": (0.215, 0.108, 4.61e-3, 439.0, 0.51, SESSIONS[0]),
    # free; means of five readings along the plates; the lowest eight
    "5L": (0.5814, 0.2176, 5.03e-3, 428.7, 0.39, (56.5, 81.0, 140.5, 162.5, 196.5, 221.5, 275.5, 292.5)),
    "5R": (0.5812, 0.2174, 4.89e-3, 435.7, 0.39, (56.5, 77.5, 138.0, 163.5, 197.5, 216.5, 272.5, 292.5)),
}
FREE = ("5L", "5R")
STEP = 0.5  # [Hz] between the frequencies of the free plates' responses
NEAR = {  # [Pa] stiffness along and across the grain and in shear, near what all six frequencies give
    "3.00": (13.1e9, 0.68e9, 0.60e9), "3.80": (10.2e9, 0.30e9, 0.65e9),
    "4.50": (13.0e9, 0.87e9, 0.52e9), "4.61": (11.6e9, 0.84e9, 0.52e9),
    "5L": (11.7e9, 0.95e9, 0.79e9), "5R": (11.7e9, 1.02e9, 0.84e9),
}  # fmt: skip
NAMES = ("along", "across", "shear")
# [-] one deviation of what is not found but known only so well: the free length, as the plate moves a little within its
# clamp, and Poisson's ratio
OPEN = {"length": 0.01, "nu": 0.25}
OPEN_FREE = {"length": 0.001, "nu": 0.25}
UNEVEN = 0.01  # [-] assumed: one deviation of a frequency because no board is the same everywhere
ROLLING = 0.1  # [-] shear modulus through the thickness across the grain over that in the plane; only the thick theory


def frequencies(plate: str, values: Mapping[str, float], *, theory: str = "kirchhoff", air: bool = False) -> np.ndarray:
    """The frequencies [Hz] of a plate with these constants, clamped at the end of the grain or free."""
    _, width, thickness, rho, _, measured = PLATES[plate]
    along, across, shear, length, nu = (values[name] for name in (*NAMES, *OPEN))
    wood = fi.Material.orthotropic(E_along=along, E_across=across, nu=nu, G=shear, rho=rho, G_yz=ROLLING * shear)
    board = fi.mesh.rectangle(length, width)
    edges, rigid = ({}, 3) if plate in FREE else ({"left": "clamped"}, 0)
    system = fi.assemble(board, fi.Plate(wood, thickness), edges, theory=theory)
    modes = fi.find_modes(system, n_modes=rigid + len(measured), tolerance=1e-3)
    return (fi.in_air(modes, baffled=False) if air else modes).frequencies[rigid:]


def reading(plate: str) -> np.ndarray:
    """One deviation of what was read of each frequency [-]."""
    measured = np.array(PLATES[plate][-1])
    return STEP / 2.0 / measured if plate in FREE else np.full(len(measured), READING)


def left_by_a_fit(change: np.ndarray, slope: np.ndarray) -> float:
    """What is left of a change of the frequencies (n,), rms [-], when the constants are found anew."""
    rest = change - slope @ np.linalg.lstsq(slope, change, rcond=None)[0]
    return float(np.sqrt(np.mean(rest**2)))


@cache
def computed(plate: str) -> tuple[np.ndarray, np.ndarray, float]:
    """Logarithms of a plate's frequencies, their slopes, and what of the thick theory and of air a fit leaves [-]."""
    length, _, _, _, nu, _ = PLATES[plate]
    values = dict(zip((*NAMES, *OPEN), (*NEAR[plate], length, nu)))
    here, slope = slopes(partial(frequencies, plate), values)
    changes = (
        np.log(frequencies(plate, values, theory="mindlin")) - here, np.log(frequencies(plate, values, air=True)) - here
    )  # fmt: skip
    return here, slope, float(np.hypot(*(left_by_a_fit(change, slope) for change in changes)))


def predict(plate: str, uneven: float = UNEVEN, rounds: int = ROUNDS) -> Predicted:
    """Every frequency of a plate from its others."""
    here, slope, left = computed(plate)
    measured, model = PLATES[plate][-1], float(np.hypot(left, uneven))
    error = float(np.hypot(np.sqrt(np.mean(reading(plate) ** 2)), model))
    prior = (*(np.inf for _ in NAMES), *(OPEN_FREE if plate in FREE else OPEN).values())
    return Predicted(from_the_others(measured, here, slope, error, prior, rounds=rounds), computation=1e-3, model=model)


def experiment(plate: str) -> Experiment:
    """The record of one plate."""
    length, width, thickness, rho, nu, measured = PLATES[plate]
    free = plate in FREE
    points = tuple(
        Measured(f"mode {i + 1}", f, 1.645 * r * f, "Hz") for i, (f, r) in enumerate(zip(measured, reading(plate)))
    )
    size = f"{1e3 * length:g} x {1e3 * width:g} x {1e3 * thickness:g} mm, {rho:g} kg/m³"
    return Experiment(
        key=f"spruce_{plate.replace('.', '_').lower()}",
        title=f"Free spruce plate {plate}, tapped" if free else f"Spruce plate of {plate} mm, tapped",
        source=SOURCES[plate],
        licence="no licence stated; numbers only" if free
        else "MIT (file LICENSE there) and, for the sessions, GPL-3.0; numbers only",
        rig=f"{size}, free" if free else f"{size}, clamped at the end of the grain, three edges free",
        known={
            "stiffness along, across, shear": "found from the other frequencies",
            "free length": "0.1 %" if free else f"{1e3 * length:g} mm within 1 %, for the clamp",
            "Poisson's ratio": f"{nu:g}, as the source assumes, within 25 %",
            "evenness": f"{100 * UNEVEN:g} % of a frequency, assumed",
            "reading": "steps of 0.5 Hz, of which half" if free else f"{100 * READING:.1f} % (three sessions)",
        },
        left_open="the mass of the sensor, how soft the supports were" if free
        else "how the clamp gives, the mass of the sensor",
        measured=points, predict=partial(predict, plate), reasons=REASONS.get(plate, {}),
        before=None if free else partial(predict, plate, uneven=0.0, rounds=1),
        found=FOUND_FREE if free else FOUND,
    )  # fmt: skip


MAGPIE = "NEMUS project, github.com/Nemus-Project/magpie-matlab"
BADIANE = (
    "D. G. Badiane and others, github.com/David-Badiane/Data-driven-characterization-of-spruce-tonewood-plates (commit "
    "897fe34), FRF2Params: geom_mass_measurements, sheet and geomParams.csv (sizes and weight), measFRFs.mat, f0s "
    "(peaks of five taps), referenceVals.csv (Poisson's ratio)"
)
SOURCES = {
    "3.00": f"{MAGPIE}, README.md, section Inverse Modelling (commit e8ca524)",
    "3.80": f"{MAGPIE}, InverseModelling.m (commit 2c11e0b)",
    "4.50": f"{MAGPIE}, src/InverseModelling.m (commit 0b52982)",
    "4.61": "NEMUS project, github.com/Nemus-Project/magpie-python, src/matlab/ElasticConstantEstimation.m "
            "(commit aee774d)",
    "5L": BADIANE, "5R": BADIANE,
}  # fmt: skip
FOUND = "The unevenness was assumed, and the robust fit taken, after a first comparison."
FOUND_FREE = (
    "Of the source's ten plates the two with regular edges. Unevenness and fit are those of the clamped plates, as "
    "they stood before. Of two peaks near 193 Hz in the response of 5L the higher is taken."
)
REASONS = {
    "4.61": {
        "mode 4": "modes 4 and 5, a twist and a bend across the grain, lie 3 % apart and mix: a little more of one "
                  "constant moves both, and the sessions differ most there",
        "mode 6": "not found; the thick theory lowers it by 5 %, and what the fit leaves of that is in the band",
    },
}  # fmt: skip
EXPERIMENTS = tuple(experiment(plate) for plate in PLATES)
