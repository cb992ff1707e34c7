"""How a small change of a body's section changes the energies of its shapes: derivatives of K and M along vectors."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._base import check
from . import slopes
from .assembly import System, curvatures
from .elements import CHUNK
from .section import Beam, Plate

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

    def of(self, name: str, points: np.ndarray) -> np.ndarray:
        """Rate of "stiffness", "inertia", "shear" or "rotary" at points (n, dimension) [m]."""
        return sum(weight * getattr(each, name)(points) for each, weight in zip(self.sections, self.weights))

    @classmethod
    def along(cls, name: str, value: Any, made: Any) -> "SectionChange":
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


def energies(system: System, change: SectionChange, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Changes ``v_i' dK v_j`` and ``v_i' dM v_j`` (n, n) per unit of a number, in the frame of the system.

    Parameters
    ----------
    system : System, of any element but "morley"
    change : SectionChange
    vectors : ndarray, shape (n_dofs, n)
    """
    if system.element == "morley":
        raise ValueError("derivatives are unknown for element 'morley'; take 'argyris'")
    frame, (x, dx) = system.frame, slopes.places(system)
    low, high = system.mesh.points.min(axis=0), system.mesh.points.max(axis=0)
    whole, n = system.expand @ vectors, vectors.shape[1]
    square = frame.length**2
    units = {"stiffness": frame.stiffness, "inertia": frame.inertia, "shear": frame.stiffness / square,
             "rotary": frame.inertia * square}  # fmt: skip
    found = {"K": np.zeros((n, n)), "M": np.zeros((n, n))}
    for first in range(0, len(x), CHUNK):
        cells = np.arange(first, min(first + CHUNK, len(x)))
        own = whole[system.element_dofs.T[cells]][:, None]  # (n_cells, 1, n_local, n)
        place = frame.centre + frame.length * x[cells].reshape(-1, x.shape[-1])
        place = place.clip(low, high) if system.mesh.dimension == 1 else place
        for matrix, name, parts in _strains(system, cells, x[cells]):
            rate = change.of(name, place) / units[name]
            rate = rate.reshape(*dx[cells].shape, *(rate.shape[1:] or (1, 1))) * dx[cells][..., None, None]
            moved = parts @ own  # (n_cells, n_q, n_parts, n)
            pushed = rate @ moved if rate.shape[-1] > 1 else rate * moved
            found[matrix] += moved.reshape(-1, n).T @ pushed.reshape(-1, n)
    return found["K"], found["M"]


def _strains(system: System, cells: np.ndarray, x: np.ndarray) -> list[tuple[str, str, np.ndarray]]:
    """What deforms or moves in cells at points (n, n_q, dimension): matrix, kind of the section, and the operator.

    The operators are (n, n_q, n_parts, n_local).
    """
    space: Any = system.space
    if system.theory == "euler":
        value, bend = space.functions(cells, x, (0, 2))
        return [("K", "stiffness", bend[:, :, None]), ("M", "inertia", value[:, :, None])]
    if system.theory == "timoshenko":
        none = np.zeros((*x.shape[:2], space.bend.functions(cells, x, (0,))[0].shape[-1]))
        slope, bend = (np.concatenate([b, none], axis=-1) for b in space.bend.functions(cells, x, (1, 2)))
        shear = np.concatenate([none, space.shears(cells, x, 1)], axis=-1)
        value = space.functions(cells, x, (0,))[0]
        pairs = ("K", "stiffness", bend), ("K", "shear", shear), ("M", "inertia", value), ("M", "rotary", slope)
        return [(matrix, name, part[:, :, None]) for matrix, name, part in pairs]
    value, hessian = space.functions(cells, x, (0, 2))
    return [("K", "stiffness", curvatures(hessian)), ("M", "inertia", value[:, :, None])]
