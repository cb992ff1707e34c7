"""How a small change of a body's section changes the energies of its shapes: derivatives of K and M along vectors."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from .._base import check
from . import slopes
from .section import Beam, Plate
from .system import System

# fourth-order differences over values at these multiples of a step: about the value, and to one side of it
DIFFERENCES = (
    ((-2, -1, 1, 2), (1 / 12, -2 / 3, 2 / 3, -1 / 12)),
    ((0, 1, 2, 3, 4), (-25 / 12, 4.0, -3.0, 4 / 3, -1 / 4)),
    ((0, -1, -2, -3, -4), (25 / 12, -4.0, 3.0, -4 / 3, 1 / 4)),
)
STEP = 1e-5  # [-] of a number, for these differences of fourth order: they err by less than they round, which is 1e-11


@dataclass(frozen=True, eq=False)
class SectionChange:
    """Rate at which a section changes with one number, as a weighted sum of sections."""

    sections: tuple[Plate | Beam, ...]
    weights: tuple[float, ...]  # [1 over the unit of the number]

    @classmethod
    def by_differences(cls, name: str, value: Any, made: Any) -> "SectionChange":
        """How a section changes with a number, at a value of it, from a function that makes it; ValueError names it."""
        value = check.number(name, value)
        if not callable(made):
            raise ValueError(f"{name} must be a pair of a value and a function that makes a section of it")
        step = STEP * (abs(value) or 1.0)
        for multiples, weights in DIFFERENCES:
            try:
                found = tuple(made(value + step * k) for k in multiples)
            except ValueError:
                continue
            for each in found:
                check.instance(name, each, Plate, Beam)
            return cls(found, tuple(weight / step for weight in weights))
        raise ValueError(f"{name}: no section can be made on either side of {value:g}; change the value")


def energy_changes(system: System, change: SectionChange, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Changes ``v_i' dK v_j`` and ``v_i' dM v_j`` (n, n) per unit of a number, in the frame of the system.

    Parameters
    ----------
    system : System, of any element but "morley"
    change : SectionChange
    vectors : ndarray, shape (n_dofs, n)
    """
    if system.element == "morley":
        raise ValueError("derivatives are unknown for element 'morley'; take 'argyris'")
    if system.rules.energies is not None:
        each = [system.rules.energies(system, section, vectors) for section in change.sections]
        K, M = (sum(weight * one for weight, one in zip(change.weights, pair)) for pair in zip(*each))
    else:
        K, M = slopes.section_energies(system, system.space, partial(_rate, system, change), vectors)
    pull = sum(weight * getattr(each, "tension", 0.0) for weight, each in zip(change.weights, change.sections))
    if pull:
        K = K + pull * system.frame.length**2 / system.frame.stiffness * slopes.slope_products(system, vectors)
    return np.asarray(K), np.asarray(M)


def frequency_densities(system: System, change: SectionChange, vectors: np.ndarray, square: np.ndarray) -> np.ndarray:
    """How much a change at each place changes modes: relative changes of frequencies (n_cells, n_q, n).

    They are per unit of the number and per area [1/m^2], or length [1/m] of a beam, at the points of
    `slopes.quadrature`, for flat bodies and shells without ribs whose section changes in its thickness only.

    Parameters
    ----------
    system, change : as in `energy_changes`
    vectors : ndarray, shape (n_dofs, n), mass-normalised modes in the frame
    square : ndarray, shape (n,) [-] their eigenvalues in the frame, positive
    """
    points = slopes.quadrature(system)
    found = np.zeros((*points.dx.shape, vectors.shape[1]))
    rate = partial(_rate, system, change)
    for matrix, cells, moved, pushed in slopes.stress_terms(system, system.space, rate, vectors, points):
        found[cells] += (moved * pushed).sum(axis=2) / square if matrix == "K" else -(moved * pushed).sum(axis=2)
    return 0.5 * found / system.frame.length ** points.x.shape[-1]


def _rate(system: System, change: SectionChange, name: str, x: np.ndarray) -> np.ndarray:
    """The rate at which a field of the section changes at places in the frame."""
    fields = (system.frame.field(each, name, x) for each in change.sections)
    return np.asarray(sum(weight * field for weight, field in zip(change.weights, fields)))
