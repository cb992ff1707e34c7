"""Blows on walls, between masses and on plates without end, whose answers are formulas."""

from functools import partial

import numpy as np
from scipy.optimize import brentq
from scipy.special import gamma

from ..impact.collision import Touch, collide, strike
from ..impact.contact import Contact
from ..impact.striker import Striker
from ..modes import analytic
from ..modes.modal import Modes
from .case import Reference, ReferenceLine, of_blow


def wall(contact: Contact, mass: float, speed: float) -> dict[str, float]:
    """Numbers of a blow on a rigid wall through F = k delta**p (1 + loss delta'); force and time without loss only."""
    if contact.loss:
        x = contact.loss * speed  # loss (v0 + v1) = log((1 + loss v0) / (1 - loss v1))
        end = brentq(lambda y: np.log1p(x) - np.log1p(-y) - x - y, 1e-9, 1.0 - 1e-12, xtol=1e-15)
        return {"restitution": float(end / x)}
    k, p1 = contact.stiffness, contact.exponent + 1.0
    deepest = (p1 * mass * speed**2 / (2.0 * k)) ** (1.0 / p1)
    duration = 2.0 * np.sqrt(np.pi) * gamma(1.0 + 1.0 / p1) / gamma(0.5 + 1.0 / p1) * deepest / speed
    return {"contact_time": float(duration), "peak_force": k * deepest**contact.exponent, "restitution": 1.0}


def _wall(contact: Contact, mass: float = 0.1, speed: float = 1.0) -> list[ReferenceLine]:
    touch = Touch(contact, first=0, second=None)
    hit = collide([Modes.rigid(mass)], [touch], speeds=[speed], tolerance=1e-6)
    return of_blow(hit, wall(contact, mass, speed), {})


def _masses(one: float = 0.1, other: float = 0.3, speed: float = 1.0) -> list[ReferenceLine]:
    hit = strike(Modes.rigid(other), Striker.rigid(one), Contact.hertz(1e7), at=None, speed=speed, tolerance=1e-6)
    both = one + other
    return of_blow(hit, {"restitution": (other - one) / both, "impulse": 2.0 * speed * one * other / both}, {})


def _endless(stiffness: float, mass: float = 0.002) -> list[ReferenceLine]:
    sides, total, first = (3.1, 2.0), 2.0, 10.0  # so large that the echo of the edges comes after the blow
    plate = analytic.rectangle(*sides, mass=total, first_frequency=first, n_modes=6000)
    root = 2.0 * first / (np.pi * (sides[0] ** -2 + sides[1] ** -2))  # [m**2/s] sqrt(D / m''), of a hinged plate
    mobility = sides[0] * sides[1] / (8.0 * root * total)
    z = 0.5 * mobility * float(np.sqrt(stiffness * mass))
    damped = float(np.sqrt(1.0 - z**2))
    wanted = {
        "restitution": float(np.exp(-np.pi * z / damped)),
        "contact_time": float(np.pi / damped * np.sqrt(mass / stiffness)),
    }
    spring, at = Contact.linear(stiffness), (1.43, 0.97)
    hit = strike(plate, Striker.rigid(mass), spring, at=at, speed=1.0, max_impacts=1, tolerance=1e-3)
    return of_blow(hit, wanted, {})


CASES = (
    Reference("wall-linear", partial(_wall, Contact.linear(88.6e3))),
    Reference("wall-hertz", partial(_wall, Contact.hertz(695e3))),
    Reference("wall-felt", partial(_wall, Contact(1e8, 2.5))),
    Reference("wall-hunt-crossley", partial(_wall, Contact.hertz(695e3, loss=0.3))),
    Reference("two-masses", _masses),
    Reference("endless-plate-soft", partial(_endless, 2.2e4)),
    Reference("endless-plate-hard", partial(_endless, 4.1e5)),
)
