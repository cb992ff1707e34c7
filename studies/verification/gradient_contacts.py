"""Checks gradients of blows with two and three contacts as `gradient_claims` does those of one.

    python studies/verification/gradient_contacts.py [--scenes 100]     writes gradient_contacts.csv, draws a picture

Two sticks on a plate, a stick that strikes a plate which hits a second stick, and two sticks on a plate over a stop, as
often each. Every contact has a power law of its own with or without loss and a gap of its own. All numbers of a blow
change together; blows with an impact at each contact and five in all at most are looked at.
"""

from functools import partial

import gradient_claims as claims
import numpy as np

import fem_impact as fi

STRIKE_AT = (0.45, 0.3), (1.1, 0.62), (0.8, 0.41)  # [m] on the plate of 1.55 m by 1 m
# bodies of each kind of blow; the first and second body of every contact, and its number among these points
KINDS = {
    "two sticks": (("stick", "stick", "plate"), ((0, 2, 0), (1, 2, 1))),
    "buzz": (("stick", "plate", "stick"), ((0, 1, 0), (1, 2, 1))),
    "over a stop": (("stick", "stick", "plate"), ((0, 2, 0), (1, 2, 1), (2, None, 2))),
}
MOST = 5  # [-] impacts


def random_numbers(rng, kind):
    """Numbers of a random blow, by the names of its gradient."""
    bodies, touches = KINDS[kind]
    mass, speed = 10.0 ** rng.uniform(-2, -0.5), 10.0 ** rng.uniform(-0.5, 0.5)
    duration, loss = 10.0 ** rng.uniform(-3.5, -2.3), float(rng.choice([0.0, 0.3 / speed]))
    found = {}
    for b, body in enumerate(bodies):
        plate = body == "plate"
        found[f"bodies.{b}.mass"] = mass * 10.0 ** (rng.uniform(-0.3, 1.5) if plate else rng.uniform(-0.3, 0.3))
        found[f"bodies.{b}.first_frequency"] = 10.0 ** (rng.uniform(1.3, 2.3) if plate else rng.uniform(2.8, 4))
        found[f"bodies.{b}.damping_ratio"] = float(rng.choice([0.0, 0.01, 0.2])) if plate else 0.02
        struck_last = kind == "buzz" and b == 2
        found[f"speeds.{b}"] = 0.0 if plate or struck_last else speed * 10.0 ** rng.uniform(-0.2, 0.2)
    for c, _ in enumerate(touches):
        exponent = rng.choice([1.0, 1.5, float(rng.uniform(1.2, 3.0))])
        stiffness = mass / 3.0 * (np.pi / duration) ** 2 * (speed * duration / np.pi) ** (1.0 - exponent)
        found[f"contacts.{c}.stiffness"] = stiffness * 10.0 ** rng.uniform(-0.3, 0.3)
        found[f"contacts.{c}.exponent"] = exponent
        found[f"contacts.{c}.loss"] = loss * float(rng.choice([0.0, 1.0]))
        found[f"contacts.{c}.gap"] = speed * duration * rng.uniform(0.01, 0.2)
    return found


def strike(numbers, tolerance=claims.TIGHT, *, kind):
    """The blow that numbers make."""
    bodies, touches = KINDS[kind]
    made, tips = [], []
    for b, body in enumerate(bodies):
        mass, frequency, damping = (numbers[f"bodies.{b}.{x}"] for x in ("mass", "first_frequency", "damping_ratio"))
        if body == "plate":
            shape = {"mass": mass, "first_frequency": frequency, "n_modes": 20, "damping_ratio": damping}
            made.append(fi.analytic.rectangle(1.55, 1.0, **shape))
            tips.append(None)
        else:
            stick = fi.Striker.stick(mass, frequency, n_modes=2)
            made.append(stick.modes.damped(damping))
            tips.append(stick.at)
    contacts = []
    for c, (first, second, at) in enumerate(touches):
        stiffness, exponent, loss, gap = (
            numbers[f"contacts.{c}.{x}"] for x in ("stiffness", "exponent", "loss", "gap")
        )
        law = fi.Contact.power(stiffness, exponent, loss=loss, gap=gap)
        places = [None if b is None else STRIKE_AT[at] if tips[b] is None else tips[b] for b in (first, second)]
        contacts.append(fi.Touch(law, first, second, *places))
    speeds = [numbers[f"speeds.{b}"] for b in range(len(bodies))]
    return fi.collide(made, contacts, speeds=speeds, tolerance=tolerance, max_impacts=MOST)


def examine(seed, kind):
    """One random blow of a kind, see `gradient_claims.examine`."""
    return claims.examine(seed, partial(random_numbers, kind=kind), partial(strike, kind=kind), MOST)


if __name__ == "__main__":
    claims.main(__doc__, lambda seed: examine(seed, list(KINDS)[seed % len(KINDS)]), 100, "gradient_contacts")
