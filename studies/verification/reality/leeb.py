"""Dents that the balls of rebound hardness testers leave in steel of known hardness."""

import numpy as np
from reality.record import Experiment, Measured, Predicted
from scipy.stats import qmc

import fem_impact as fi

DEVICES = {"D": (5.5e-3, 11e-3, 1.5e-3), "C": (3.0e-3, 2.7e-3, 1.5e-3), "G": (20e-3, 90e-3, 2.5e-3)}  # kg, J, m
DENTS = {  # device, Vickers hardness -> diameter [m]
    ("D", 300): 0.54e-3, ("D", 600): 0.45e-3, ("D", 800): 0.35e-3,
    ("C", 300): 0.38e-3, ("C", 600): 0.32e-3, ("C", 800): 0.30e-3,
    ("G", 300): 1.03e-3, ("G", 600): 0.90e-3,
}  # fmt: skip
CARBIDE, STEEL = fi.Material(E=600e9, nu=0.22, rho=14.9e3), fi.Material(E=208e9, nu=0.29, rho=7830.0)
TABOR = (0.93, 1.07)  # [-] yield strength over that from the hardness: the latter over 2.6 to 3 instead of 2.8
N = 128  # [-] random blows


def dent(device: str, hardness: float, tabor: float, energy: float) -> float:
    """Diameter [m] of the dent that stays, where the unloaded ball's cap fits its depth."""
    mass, nominal, radius = DEVICES[device]
    ball = fi.Striker.sphere(CARBIDE, radius)
    law = fi.Contact.between(ball, STEEL, yield_strength=tabor * fi.yield_strength(hardness))
    speed = float(np.sqrt(2.0 * energy * nominal / mass))
    hit = fi.strike(fi.Modes.rigid(1e3), fi.Striker.rigid(mass), law, at=None, speed=speed)
    assert law.yield_approach is not None
    first, peak = law.yield_approach, max(each.peak_force for each in hit.impacts)
    deepest = first + (peak - law.stiffness * first**1.5) / (1.5 * law.stiffness * first**0.5)
    given_back = hit.restitution**2 * energy * nominal  # of the spring F = k d**1.5 that unloads: 2/5 F d
    return 2.0 * float(np.sqrt(2.0 * radius * max(deepest - 2.5 * given_back / peak, 0.0)))


def predict() -> Predicted:
    """Dents of testers with energies within 2 %, in steels whose hardness is known within 5 %."""
    rows = []
    for a, b, c in qmc.Sobol(3, seed=0).random(N):
        tabor, hard, energy = TABOR[0] + a * (TABOR[1] - TABOR[0]), 0.95 + 0.1 * b, 0.98 + 0.04 * c
        rows.append([dent(device, hard * hardness, tabor, energy) for device, hardness in DENTS])
    return Predicted(np.array(rows), computation=1e-3)


EXPERIMENTS = (
    Experiment(
        key="leeb",
        title="Dents of rebound hardness testers",
        source="PCE Instruments, manual of the hardness tester PCE-2800, page 22, table 3 (read at manualshive.com)",
        licence="manual of an instrument; numbers only",
        rig="carbide balls of 3 and 5 mm, 5.5 g with 11 mJ (D), 3 g with 2.7 mJ (C), 20 g with 90 mJ (G), on steel of "
            "300, 600 and 800 HV",
        known={
            "energy": "within 2 %", "hardness": "within 5 %", "yield strength": "hardness over 2.6 to 3 (Tabor)",
        },
        left_open="the steels, how the dents were measured",
        measured=tuple(
            Measured(f"{device}, {hardness} HV", diameter, 0.02e-3, "m")
            for (device, hardness), diameter in DENTS.items()
        ),
        predict=predict,
        found="The shallowest dent is inside, where the law has hardly left first yield behind.",
        reasons=dict.fromkeys(
            (f"{device}, {hardness} HV" for device, hardness in DENTS if (device, hardness) != ("C", 800)),
            "the law goes on along the tangent at first yield and bears too little in a dent this deep, where a mean "
            "pressure of 2.8 times the yield strength is usual (Johnson, Contact Mechanics, 6.4)",
        ),
    ),
)  # fmt: skip
