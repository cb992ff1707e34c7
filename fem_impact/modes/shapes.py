"""Shapes of modes: where a body is, how it deflects under a force, and the rest of it that moves on its own."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from scipy.spatial import KDTree

from .._base import check
from .._base.remembered import Remembered, gauss_rule
from .._base.rounding import SAME
from ..fe import point_load
from ..fe.assembly import System
from ..fe.eigenvalues import Flexibility
from ..fe.slopes import quadrature
from ..mesh.meshes import sizes

REMEMBERED = 16  # [-] points whose shapes and static deflections a body keeps, because one blow needs them many times


class Shapes(Protocol):
    """What every source of mode shapes offers: FE solutions, closed formulas and measured points."""

    @property
    def dimension(self) -> int:
        """Number of coordinates of a point: 2 on a plate, 1 on a beam, 0 for a rigid mass."""
        return self.grid()[0].shape[1]

    def at(self, points: np.ndarray) -> np.ndarray:
        """Mass-normalised shapes (n_points, n_modes) [kg**-0.5] at points (n_points, dimension) [m]."""

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Whether each point lies on the body, (n_points,) bool."""

    def compliance(self, points: np.ndarray) -> np.ndarray:
        """Static compliance (n_points, n_points) [m/N] of the complete body, with inertia relief if it is free."""
        return self.deflection(points, points)

    def compliance_error(self, points: np.ndarray) -> np.ndarray:
        """Estimated relative error (n_points,) [-] of the diagonal of `compliance`; closed formulas have none."""
        return np.zeros(len(points))

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Static deflection (n_points, n_loads) [m/N] of the complete body under unit forces at ``loads``."""

    def dent(self, points: np.ndarray) -> np.ndarray:
        """Dents taken out of the diagonal of `compliance`, and the part of its error due to dents, (n_points, 2)."""
        return np.zeros((len(points), 2))

    def loose(self, points: np.ndarray) -> np.ndarray:
        """Shapes (n_points, n) [kg**-0.5] of rigid motions that the modes lack if nothing holds the body."""
        return np.zeros((len(points), 0))

    def spread(self, points: np.ndarray) -> np.ndarray | None:
        """Relative errors (n_ways, n_points, n_modes) [-] of squared shapes that were measured; None if not known.

        Each way is one that errors may go together, with either sign.
        """
        return None

    def across(self, points: np.ndarray) -> np.ndarray | None:
        """Shapes (n_points, 2, n_modes) [kg**-0.5] at right angles to the blow; None if they are not known."""
        return None

    def take(self, n_modes: int) -> "Shapes":
        """The same body with its first ``n_modes`` modes only."""

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (n_points, dimension) [m] and cells (n_cells, dimension + 1) for drawing the body."""

    def quadrature(self, wave: float) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, dimension) [m] and sizes (n,) to sum over the body what has waves of up to so many rad/m.

        Of shapes known at points only, those points.
        """
        points, cells = self.grid()
        shares = np.repeat(sizes(points, cells) / cells.shape[1], cells.shape[1])  # of a cell, one for each corner
        return points, np.bincount(cells.reshape(-1), shares, minlength=len(points))


class ClosedShapes(Shapes, Protocol):
    """What closed forms share: each of their arrays has one row per mode."""

    def part(self, modes: slice) -> Any:
        """The same body with some of its modes only."""
        fields: Any = self
        arrays = {name: value for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return replace(fields, **{name: value[modes] for name, value in arrays.items()})

    def take(self, n_modes: int) -> Any:
        return self.part(slice(n_modes))


@dataclass(frozen=True, eq=False, repr=False)
class WrappedShapes(Shapes, check.Brief):
    """What shapes share that are those of a body changed in one respect."""

    base: Shapes

    def contains(self, points: np.ndarray) -> np.ndarray:
        return self.base.contains(points)

    def compliance_error(self, points: np.ndarray) -> np.ndarray:
        return self.base.compliance_error(points)

    def spread(self, points: np.ndarray) -> np.ndarray | None:
        return self.base.spread(points)

    def take(self, n_modes: int) -> Any:
        return replace(self, base=self.base.take(n_modes))

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        return self.base.grid()

    def quadrature(self, wave: float) -> tuple[np.ndarray, np.ndarray]:
        return self.base.quadrature(wave)


@dataclass(frozen=True, eq=False, repr=False)
class ScaledShapes(WrappedShapes):
    """The shapes of the same body with another mass and stiffness, see `Modes.scaled`, or mixed; its deflections stay.

    A mixture is of shapes that are known everywhere, as by the air around a plate.
    """

    amplitude: float = 1.0  # [-] new shape divided by old
    frequency: float = 1.0  # [-] new frequency divided by old
    mix: np.ndarray | None = None  # (n_base, n_modes) [-] of the old shapes in each new one

    def at(self, points: np.ndarray) -> np.ndarray:
        found = self.amplitude * self.base.at(points)
        return found if self.mix is None else found @ self.mix

    def compliance(self, points: np.ndarray) -> np.ndarray:
        return (self.amplitude / self.frequency) ** 2 * self.base.compliance(points)

    def dent(self, points: np.ndarray) -> np.ndarray:
        return (self.amplitude / self.frequency) ** 2 * self.base.dent(points)

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        return (self.amplitude / self.frequency) ** 2 * self.base.deflection(loads, points)

    def loose(self, points: np.ndarray) -> np.ndarray:
        return self.amplitude * self.base.loose(points)

    def across(self, points: np.ndarray) -> np.ndarray | None:
        found = self.base.across(points)
        return None if found is None else self.amplitude * found

    def take(self, n_modes: int) -> "ScaledShapes":
        if self.mix is not None:
            return replace(self, mix=self.mix[:, :n_modes].copy())
        return super().take(n_modes)


def unwrap_shapes(shapes: Shapes) -> tuple[Shapes, float, np.ndarray | None]:
    """The shapes inside `ScaledShapes`, the factor [-] of their amplitude, and their mixture."""
    amplitude, mix = 1.0, None
    while isinstance(shapes, ScaledShapes):
        if shapes.mix is not None:
            mix = shapes.mix if mix is None else shapes.mix @ mix
        amplitude, shapes = amplitude * shapes.amplitude, shapes.base
    return shapes, amplitude, mix


def surface_of(shapes: Shapes, points: np.ndarray) -> np.ndarray:
    """How the surface moves at points (n_points, dimension) [m], (n_points, n_modes) [kg**-0.5].

    `Shapes.at`, of thick plates, is what a force there feels: the mean over the disk on which it acts.
    """
    base, amplitude, mix = unwrap_shapes(shapes)
    if not isinstance(base, FieldShapes):
        return shapes.at(points)
    found = amplitude * base._shapes(points, spread=False)
    return found if mix is None else found @ mix


@dataclass(frozen=True, eq=False)
class RigidShapes(Shapes):
    """A rigid mass that can only translate: one mode of frequency zero, with the same shape everywhere."""

    mass: float  # [kg]
    n_modes: int = 1

    def at(self, points: np.ndarray) -> np.ndarray:
        return np.full((len(points), self.n_modes), self.mass**-0.5)

    def contains(self, points: np.ndarray) -> np.ndarray:
        return np.ones(len(points), bool)

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        return np.zeros((len(points), len(loads)))

    def take(self, n_modes: int) -> "RigidShapes":
        return replace(self, n_modes=n_modes)

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros((1, 0)), np.zeros((1, 1), int)


@dataclass(frozen=True, eq=False, repr=False)
class SampledShapes(Shapes, check.Locked):
    """Shapes known only at points, as from a modal test; the striker must hit one of these points."""

    points: np.ndarray  # (n_points, dimension) [m]
    values: np.ndarray  # (n_points, n_modes) [kg**-0.5]
    static: np.ndarray  # (n_points, n_loads) [m/N] static deflection of the complete body under unit loads
    cells: np.ndarray | None = None  # (n_cells, dimension + 1) lines or triangles between the points, for drawing
    # (n_points, 2) [m/N] what the modes left out yield if that is estimated, with its error; nothing between the points
    rest: np.ndarray | None = None
    rigid: np.ndarray | None = None  # (n_points, n) [kg**-0.5] see `loose`
    loads: np.ndarray | None = None  # (n_loads,) points of these loads; None if every point has one
    carried: np.ndarray | None = None  # (n_points, n) [(m/N)**0.5] shapes by frequency: what yields under other loads
    doubt: np.ndarray | None = None  # (n_ways, n_points, n_modes) [-] see `spread`
    dents: np.ndarray | None = None  # (n_points, 2) [m/N] see `dent`
    sideways: np.ndarray | None = None  # (n_points, 2, n_modes) [kg**-0.5] see `across`

    @cached_property
    def _tree(self) -> KDTree:
        return KDTree(self.points)

    def _index(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        distance, index = self._tree.query(points)
        span = float(np.ptp(self.points, axis=0).max(initial=0.0))
        return index, distance <= 1e-6 * (span or 1.0)

    def at(self, points: np.ndarray) -> np.ndarray:
        return self.values[self._index(points)[0]]

    def contains(self, points: np.ndarray) -> np.ndarray:
        return self._index(points)[1]

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        i, j = self._index(points)[0], self._index(loads)[0]
        if self.loads is None or self.carried is None:
            return self.static[np.ix_(i, j)]
        found = self.carried[i] @ self.carried[j].T
        if self.rest is not None:
            found += np.where(i[:, None] == j, self.rest[j, 0], 0.0)
        column = np.full(len(self.points), -1)
        column[self.loads] = np.arange(len(self.loads))
        rows, columns = column[i], column[j]
        found[rows >= 0] = self.static[j, rows[rows >= 0, None]]  # by reciprocity
        found[:, columns >= 0] = self.static[i[:, None], columns[columns >= 0]]
        return found

    def compliance_error(self, points: np.ndarray) -> np.ndarray:
        """Of an estimate; between two points the modes left out yield at most the geometric mean of both."""
        doubt = self.dent(points)[:, 1]
        if self.rest is not None:
            middle, error = self.rest[self._index(points)[0]].T
            root = np.sqrt(middle)
            doubt = doubt + error + np.where(error > 0.0, root * (root.sum() - root), 0.0)
        if not doubt.any():
            return doubt
        return doubt / np.maximum(np.abs(self.compliance(points).diagonal()), np.finfo(float).tiny)

    def dent(self, points: np.ndarray) -> np.ndarray:
        return super().dent(points) if self.dents is None else self.dents[self._index(points)[0]]

    def loose(self, points: np.ndarray) -> np.ndarray:
        return super().loose(points) if self.rigid is None else self.rigid[self._index(points)[0]]

    def spread(self, points: np.ndarray) -> np.ndarray | None:
        return None if self.doubt is None else self.doubt[:, self._index(points)[0]]

    def across(self, points: np.ndarray) -> np.ndarray | None:
        return None if self.sideways is None else self.sideways[self._index(points)[0]]

    def take(self, n_modes: int) -> "SampledShapes":
        others = {"doubt": self.doubt, "sideways": self.sideways}
        fewer: dict[str, Any] = {
            name: each if each is None else each[..., :n_modes].copy() for name, each in others.items()
        }
        return replace(self, values=self.values[:, :n_modes].copy(), **fewer)

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        return self.points, np.arange(len(self.points))[:, None] if self.cells is None else self.cells


def gauss(length: float, wave: float) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points (n,) [m] from 0 to a length [m] and weights (n,) [m], for waves of up to so many rad/m."""
    x, dx = gauss_rule(8 + math.ceil(0.3 * wave * length))
    return length * x, length * dx


def compliance_errors(shapes: Shapes, points: np.ndarray) -> dict[str, np.ndarray]:
    """Errors (n_points,) [m/N] of the compliance at points, by what was not stated or had to be found, see `Modes`."""
    whole, dent = np.abs(shapes.compliance(points).diagonal()), shapes.dent(points)[:, 1]
    other = shapes.compliance_error(points) * whole - dent
    return {"compliance": np.where(other > SAME * whole, other, 0.0), "dent": dent}


@dataclass(frozen=True, eq=False, repr=False)
class ElementShapes(Shapes):
    """What shapes by finite elements share."""

    system: System

    def contains(self, points: np.ndarray) -> np.ndarray:
        return self.system.contains(points)

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        return self.system.mesh.points, self.system.mesh.cells

    def quadrature(self, wave: float) -> tuple[np.ndarray, np.ndarray]:
        length = self.system.frame.length
        side = length * float(2.0 * quadrature(self.system, 1).dx.max()) ** 0.5  # of the largest triangle
        found = quadrature(self.system, 1 + math.ceil(0.6 * wave * side))
        return self.system.frame.to_metres(found.x.reshape(-1, 2)), length**2 * found.dx.reshape(-1)


@dataclass(frozen=True, eq=False, repr=False)
class FieldShapes(ElementShapes, check.Locked):
    """Shapes of an FE solution, evaluated anywhere on the body with the shape functions of its elements."""

    vectors: np.ndarray  # (n_dofs, n_modes) [-] mass-normalised in the frame of the system
    flexibility: Flexibility
    _under: Remembered = field(default_factory=lambda: Remembered(REMEMBERED), repr=False)  # deflections, by loads
    _at: Remembered = field(default_factory=lambda: Remembered(REMEMBERED), init=False, repr=False)  # shapes, by point

    def at(self, points: np.ndarray) -> np.ndarray:
        if len(points) != 1:
            return self._shapes(points)
        shapes = self._at.recall(points.tobytes(), lambda: self._shapes(points))
        shapes.flags.writeable = False
        return shapes

    def _shapes(self, points: np.ndarray, spread: bool = True) -> np.ndarray:
        """`at`, if not ``spread`` of the surface, see `surface_of`."""
        return self.system.interpolate(points, spread) @ self.vectors * self.system.frame.mass**-0.5

    def _deflection(self, loads: np.ndarray) -> point_load.Deflection:
        return self._under.recall(loads.tobytes(), lambda: point_load.static_deflection(self.system, loads))

    def compliance(self, points: np.ndarray) -> np.ndarray:
        return self._deflection(points).compliance

    def compliance_error(self, points: np.ndarray) -> np.ndarray:
        return self._deflection(points).error

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        return self._deflection(loads).at(points)

    def take(self, n_modes: int) -> "FieldShapes":
        return replace(self, vectors=self.vectors[:, :n_modes].copy())

    def after(self, first: "FieldShapes") -> "FieldShapes":
        """The same, which shares the static deflections of the ``first`` modes: those need no mesh for short waves."""
        return replace(self, _under=first._under)
