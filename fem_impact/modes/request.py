"""Which body a closed formula is asked for, how many of its modes, and in which units it answers."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base import check
from ..fe.section import Beam
from .modal import Damping, Modes


@dataclass(frozen=True)
class Request:
    """A section, or a mass and first frequency, and a number of modes or a highest frequency."""

    section: Any
    mass: float | None  # [kg]
    first_frequency: float | None  # [Hz]
    n_modes: int | None
    max_frequency: float | None  # [Hz]
    damping_ratio: Damping
    rate: float | None  # [rad/s] omega of the body of the section over that at unit mass and rigidity

    def count(self, first: float, most: int) -> tuple[int, float]:
        """Largest number of modes and largest omega (at unit mass and rigidity); the one not asked for is no limit.

        ``first`` is the lowest omega at unit mass and rigidity.
        """
        if (self.n_modes is None) == (self.max_frequency is None):
            raise ValueError("give either n_modes or max_frequency [Hz]")
        if self.n_modes is not None:
            return check.count("n_modes", self.n_modes, high=most), np.inf
        frequency = check.positive("max_frequency", self.max_frequency, "Hz")
        if self.rate is not None:
            return check.MOST, 2.0 * np.pi * frequency / self.rate
        return check.MOST, frequency / check.positive("first_frequency", self.first_frequency, "Hz") * first

    def answered(self, shapes: Any, values: np.ndarray, notes: tuple[str, ...]) -> Modes:
        """The modes of this body from their shapes and omega**2, both at unit mass and rigidity."""
        if self.rate is not None:
            factor = self.rate
        else:
            first = check.positive("first_frequency", self.first_frequency, "Hz")
            factor = 2.0 * np.pi * first / np.sqrt(values[values > 0.0][0])
        omega = np.sqrt(values)
        if not omega[-1] <= check.REACH:
            raise ValueError(
                f"size gives frequencies beyond all numbers, {omega[-1]:g} rad/s at unit mass and rigidity"
            )
        unit = Modes(omega, np.zeros(len(omega)), shapes, mass=1.0, notes=notes)
        scaled = unit.scaled(mass=self.mass, first_frequency=factor * unit.frequencies[omega > 0.0][0])
        return replace(scaled.damped(self.damping_ratio), section=self.section)


def request(
    section: Any, kind: type, size: float, *, mass: float | None, first_frequency: float | None, unit: float = 1.0,
    **wanted: Any,
) -> Request:  # fmt: skip
    """Check what was asked for a body whose area [m^2] or length [m] is ``size``, and its shapes' of ``unit``.

    Raises
    ------
    ValueError
        If there is neither or both a section and a mass with a first frequency, or if the section is not constant.
    """
    given = mass is not None, first_frequency is not None
    if (section is None and not all(given)) or (section is not None and any(given)):
        raise ValueError("give either section, or both mass [kg] and first_frequency [Hz]")
    if section is None:
        mass = check.positive("mass", mass, "kg")
        return Request(None, mass, check.positive("first_frequency", first_frequency, "Hz"), rate=None, **wanted)
    check.instance("section", section, kind)
    if kind is Beam:
        if callable(section.width) or callable(section.height):
            raise ValueError("section must be constant along the beam; else use find_modes")
        point = np.zeros((1, 1))
        rigidity = section.stiffness(point)[0] / size**3
    else:
        if not section.uniform or section.material.E_across is not None or section.tension:
            raise ValueError(
                "section must be flat, isotropic, of constant thickness and without tension; else use find_modes"
            )
        point = np.zeros((1, 2))
        rigidity = section.stiffness(point)[0, 0, 0]
    mass = float(section.inertia(point)[0]) * size
    return Request(section, mass, None, rate=float(np.sqrt(rigidity / mass)) / unit, **wanted)


def check_number(about: float, most: int, **sizes: float) -> None:
    """Raise ValueError if a body of these sizes [m] has more than ``most`` modes below max_frequency."""
    if about > most:
        body = " and ".join(f"{name} {size:g} m" for name, size in sizes.items())
        raise ValueError(
            f"{body} must give at most {most} modes up to the frequency asked for, got about {about:.2g}; check the "
            "unit, or lower max_frequency"
        )


def check_beyond_rigid(count: int, n_rigid: int, kind: str) -> None:
    """Raise ValueError if so many modes hold rigid motions only, and none of a kind."""
    if count <= n_rigid:
        raise ValueError(f"n_modes must exceed the {n_rigid} rigid motions; max_frequency must reach a {kind} mode")
