"""Dents that the balls of rebound hardness testers leave in steel of known hardness."""

from functools import partial

import numpy as np
from reality.record import Experiment, Measured, Predicted
from scipy.stats import qmc

import fem_impact as fi

DEVICES = {"D": (5.5e-3, 11e-3, 1.5e-3), "C": (3.0e-3, 2.7e-3, 1.5e-3), "G": (20e-3, 90e-3, 2.5e-3)}  # kg, J, m
DENTS = {  # device, Vickers hardness -> diameter [m]
    ("D", 300): 0.54e-3, ("D", 600): 0.45e-3, ("D", 800): 0.35e-3,
    ("C", 300): 0.38e-3, ("C", 600): 0.32e-3, ("C", 800): 0.29e-3,
    ("G", 300): 1.03e-3, ("G", 600): 0.90e-3,
}  # fmt: skip
CARBIDE, STEEL = fi.Material(E=600e9, nu=0.22, rho=14.9e3), fi.Material(E=208e9, nu=0.29, rho=7830.0)
TABOR = (0.93, 1.07)  # [-] yield strength over that from the hardness: the latter over 2.6 to 3 instead of 2.8
# [-] yield strength at 1 500 strains a second over that of a slow test, 1 + C ln(1500) with C from 0.010 to 0.022;
# Johnson and Cook have 0.014 for steel 4340, and Mok and Duffy 1 500 / s for balls that fall on metal
FAST = (1.07, 1.16)
# [-] at the same energy the law's contact is as wide as that of the finite elements of Jackson and Green within 0.8 %
# rms, of Kogut and Etsion within 0.5 %, up to 110 times the approach of first yield
LAW = 0.008
BETWEEN = (0.0, 1.0)  # [-] what is seen of a dent lies between the widest contact (0) and the cap that is left (1)
N = 128  # [-] random blows


def dent(device: str, hardness: float, stronger: float, energy: float) -> tuple[float, float]:
    """Diameter [m] of the contact when it is widest, and of the cap that the law leaves, which is no wider."""
    mass, nominal, radius = DEVICES[device]
    contact = fi.Contact.between(
        fi.Striker.sphere(CARBIDE, radius), STEEL, yield_strength=stronger * fi.yield_strength(hardness)
    )
    speed = float(np.sqrt(2.0 * energy * nominal / mass))
    hit = fi.strike(fi.Modes.rigid(1e3), fi.Striker.rigid(mass), contact, at=None, speed=speed)
    force, law = max(each.peak_force for each in hit.impacts), contact.law
    deepest = law.approach(contact, force)
    wide = law.wide(contact, deepest)
    back = force / (contact.stiffness * wide**0.5)  # taken back on unloading, as of a ball of the radius R wide / back
    flatter = radius / (1.0 - back / wide)  # radius of the cap
    contact_squared, cap_squared = radius * wide, 2.0 * flatter * (deepest - back)  # radii [m**2]
    return 2.0 * float(np.sqrt(contact_squared)), 2.0 * float(np.sqrt(min(contact_squared, cap_squared)))


def predict(fast=FAST, between=BETWEEN, law=LAW) -> Predicted:
    """Dents of testers with energies within 2 %, in steels whose hardness is known within 5 %."""
    rows = []
    for a, b, c, d, e in qmc.Sobol(5, seed=0).random(N):
        tabor, stronger, share = (low + x * (high - low) for (low, high), x in zip((TABOR, fast, between), (a, d, e)))
        hard, energy = 0.95 + 0.1 * b, 0.98 + 0.04 * c
        found = np.array([dent(device, hard * hardness, tabor * stronger, energy) for device, hardness in DENTS])
        rows.append(found[:, 0] + share * (found[:, 1] - found[:, 0]))
    return Predicted(np.array(rows), computation=1e-3, model=law)


EXPERIMENTS = (
    Experiment(
        key="leeb",
        title="Dents of rebound hardness testers",
        source="manuals of the hardness testers PCE-2800, page 22, and Mitech MH310, page 20, table 3 of both (read at "
        "manualshive.com)",
        licence="manuals of instruments; numbers only",
        rig="carbide balls of 3 and 5 mm, 5.5 g with 11 mJ (D), 3 g with 2.7 mJ (C), 20 g with 90 mJ (G), on steel of "
        "300, 600 and 800 HV",
        known={
            "energy": "within 2 %",
            "hardness": "within 5 %",
            "yield strength": "hardness over 2.6 to 3 (Tabor), and 7 to 16 % more because it is fast: 1 + C ln(1500), "
            "C from 0.010 to 0.022, where Johnson and Cook have 0.014 for steel 4340 and Mok and Duffy (1964) found "
            "1500 strains a second for falling balls",
            "what is seen of a dent": "between the widest contact and the cap that the law leaves",
            "contact law": "0.8 %, its distance from the finite elements of Jackson and Green (2005)",
        },
        left_open="the steels, how the dents were measured. Both manuals print 0.54 mm for D at 600 HV and 0.35 mm for "
        "C at 800 HV beside depths of 17 and 7 µm, which caps of 0.45 and 0.29 mm have: these are taken",
        measured=tuple(
            Measured(f"{device}, {hardness} HV", diameter, 0.02e-3, "m")
            for (device, hardness), diameter in DENTS.items()
        ),
        predict=predict,
        before=partial(predict, fast=(1.0, 1.0), between=(0.0, 0.0), law=0.0),
        found="Strength at high rates, what is seen of a dent, and the error of the law were added after a first look. "
        "By the law that goes on along the tangent at first yield, which stood here before, dents were 8 to 37 % too "
        "wide, where the shallowest was inside.",
        reasons={
            "D, 800 HV": "the source contradicts itself: with four times the energy of C it should be 1.42 times as "
            "wide, as it is at 300 and 600 HV, but is 1.21 times",
            "C, 800 HV": "not found; the hardest steel is where the law has left first yield least behind, and where "
            "the source is in doubt",
        },
    ),
)
