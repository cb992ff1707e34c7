"""Ritz vectors started from point loads: a body as seen from the points where it is struck.

The vectors span the Krylov space of (K + s**2 M)**-1 M that starts with the static deflection under the loads. Their
Ritz pairs are a Gauss quadrature of the body's response at those points: modes that the loads do not excite never
appear, and modes closer together than a blow can tell apart become one. One factorisation and one solution per vector
replace the search for eigenvalues, and the first vectors of a longer run are the vectors of a shorter one.

References
----------
Wilson, Yuan and Dickens (1982), Earthquake Eng. Struct. Dyn. 10, 813-821 (load-dependent Ritz vectors); Golub and
Meurant (2010), Matrices, Moments and Quadrature, ch. 6 (Lanczos and Gauss quadrature).
"""

from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._base import check
from ..fe import point_load
from ..fe.assembly import System
from ..fe.eigenvalues import Flexibility, factorise, one_thread
from .modal import Damping, Modes, Shapes, damping_notes, damping_ratios

GROWN = 32  # [-] vectors for which room is made at a time
DEPENDENT = 1e-10  # [-] a new vector shorter than this fraction of its length before orthogonalisation adds nothing
FEWER = 0.7  # [-] fraction of the vectors with which a second blow tells the error of having no more


@check.typed
def ritz_modes(
    system: System, points: Any, *, max_frequency: float, n_vectors: int = 100, damping_ratio: Damping = 0.0
) -> Modes:
    """Describe a body as forces at given points see it, by Ritz vectors instead of modes.

    Parameters
    ----------
    system : System
        Best assembled with ``near=points``, so that the elements shrink towards the forces.
    points : array_like, shape (n_points, dimension) [m]
        Where the body is struck or held, for `strike` or `collide`.
    max_frequency : float [Hz]
        Highest frequency of interest, for example ten times one over the contact's duration.
    n_vectors : int
        More vectors resolve later echoes. `strike` of a `System` chooses them by itself.
    damping_ratio : float or function of frequency [Hz]

    Returns
    -------
    Modes
        Pseudo-modes: complete at the points, approximate elsewhere and for a limited time. A blow with them states the
        error of having no more of them; that of the mesh is not known.

    Examples
    --------
    >>> plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    >>> system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), plate, {"boundary": "hinged"}, near=[(0.1, 0.1)])
    >>> seen = fi.ritz_modes(system, [(0.1, 0.1)], max_frequency=5e3, n_vectors=40)
    >>> seen.n_modes, round(float(seen.frequencies[0]), 2)
    (40, 105.78)
    """
    place = check.array("points", points, (None, system.mesh.dimension), "m", lift=True)
    inside = system.contains(place)
    if not inside.all():
        raise ValueError(f"points must lie on the body, got {check.shown(place[~inside][0].tolist())} m")
    shift = np.pi * check.positive("max_frequency", max_frequency, "Hz")
    krylov = Krylov(system, place, shift)
    if (krylov.compliance.diagonal() <= point_load.RESTS).any():
        raise ValueError("points must not lie on a support, where no vector can start")
    return krylov.modes(check.count("n_vectors", n_vectors), damping_ratio)


class Krylov:
    """Vectors started from unit forces at points of a system; `grow` makes more of them.

    Parameters
    ----------
    system : System
    points : ndarray, shape (n_points, dimension) [m]
    shift : float [rad/s]
        s in (K + s**2 M)**-1 M; about twice the highest angular frequency that matters.
    """

    def __init__(self, system: System, points: np.ndarray, shift: float) -> None:
        self.system = system
        self._solve = factorise(system.K + (shift / system.frame.rate) ** 2 * system.M).solve
        self._moving = system.M @ system.rigid
        self._flexibility = Flexibility(system.K, system.M, system.rigid, system.held)
        self._begin(points)

    def _begin(self, points: np.ndarray) -> None:
        system = self.system
        self.points = points
        self.loads = np.asarray(system.interpolate(points).todense()).T  # (n_dofs, n_points)
        self.width = len(points)
        self.vectors = np.empty((0, system.n_dofs))  # (room, n_dofs) mass-orthonormal rows
        self.stiffness = np.zeros((0, 0))  # (n_projected, n_projected) of the first vectors
        self.count, self.full = 0, False
        self._next = self._flexibility.solve(self.loads)  # the static deflection, so that the compliance is exact
        self.compliance = self.loads.T @ self._next  # (n_points, n_points) in the frame

    def beside(self, points: np.ndarray) -> "Krylov":
        """Vectors started from other points, with the same factorisations."""
        other = copy(self)
        other._begin(points)
        return other

    @one_thread
    def grow(self, count: int) -> None:
        """Make vectors until there are at least ``count``, or all that the loads can reach."""
        M = self.system.M
        while self.count < min(count, self.system.n_dofs - self.system.rigid.shape[1]) and not self.full:
            if self.count + self.width > len(self.vectors):
                room = np.empty((max(GROWN, self.width), self.system.n_dofs))
                self.vectors = np.concatenate([self.vectors, room])
            new, known = self._next, self.vectors[: self.count]
            heavy = M @ new
            length = np.sqrt(np.einsum("ij,ij->j", new, heavy))
            for start in (max(0, self.count - 2 * self.width), 0):  # the last vectors hold nearly all that must go
                new = new - self.system.rigid @ (self._moving.T @ new) - known[start:].T @ (known[start:] @ heavy)
                heavy = M @ new
            value, turn = np.linalg.eigh(new.T @ heavy / np.outer(length, length))
            kept = value > DEPENDENT**2
            if not kept.any():
                self.full = True
                return
            unit = (turn[:, kept] / np.sqrt(value[kept])) / length[:, None]
            self.vectors[self.count : self.count + unit.shape[1]] = (new @ unit).T
            self.count += unit.shape[1]
            self._next = self._solve(np.ascontiguousarray(heavy @ unit))

    def _project(self) -> None:
        """Extend the projected stiffness to all vectors there are."""
        before, now = len(self.stiffness), self.count
        if now == before:
            return
        vectors = self.vectors[:now]
        columns = vectors @ (self.system.K @ vectors[before:].T)
        whole = np.zeros((now, now))
        whole[:before, :before] = self.stiffness
        whole[:, before:], whole[before:, :] = columns, columns.T
        self.stiffness = 0.5 * (whole + whole.T)

    def modes(self, count: int, damping_ratio: Damping = 0.0) -> Modes:
        """Ritz pairs of the first ``count`` vectors, after the rigid motions, which are exact.

        `Modes.poorer` holds those of fewer vectors, so that a blow states the error of having no more.
        """
        self.grow(count)
        self._project()
        count = min(count, self.count)
        found = self._pairs(count, damping_ratio)
        if count == self.count and self.full:
            return found
        return replace(found, poorer={"truncation": self._pairs(max(self.width, int(FEWER * count)), damping_ratio)})

    def _pairs(self, count: int, damping_ratio: Damping) -> Modes:
        frame, rigid = self.system.frame, self.system.rigid
        value, turn = np.linalg.eigh(self.stiffness[:count, :count])
        omega = np.concatenate([np.zeros(rigid.shape[1]), np.sqrt(np.maximum(value, 0.0)) * frame.rate])
        basis = self.vectors[:count]
        rows = np.hstack([self.loads.T @ rigid, (basis @ self.loads).T @ turn]) * frame.mass**-0.5
        damping = damping_ratios(damping_ratio, omega)
        shapes = RitzShapes(self.system, self.points, omega, rows, basis, turn)
        notes = (*self.system.notes, *damping_notes(damping, omega))
        no_error = np.zeros(len(omega))
        return Modes(omega, damping, shapes, self.system.mass, no_error, notes=notes, section=self.system.section)


@dataclass(frozen=True, eq=False)
class RitzShapes(Shapes):
    """Shapes of Ritz vectors: complete at the loads they started from, approximate elsewhere."""

    system: System
    loads: np.ndarray  # (n_loads, dimension) [m] points that the vectors started from
    omega: np.ndarray  # (n_all,) [rad/s] of all vectors, rigid motions first
    rows: np.ndarray  # (n_loads, n_all) [kg**-0.5] shapes at the loads
    basis: np.ndarray  # (n_vectors, n_dofs) [-] mass-orthonormal in the frame
    turn: np.ndarray  # (n_vectors, n_vectors) [-] from the basis to the flexible shapes
    kept: int | None = None  # number of shapes that count as modes; the others are left out

    __repr__ = check.brief

    @property
    def dimension(self) -> int:
        return self.system.mesh.dimension

    def at(self, points: np.ndarray) -> np.ndarray:
        return self._all_at(points)[:, : self.kept]

    def _all_at(self, points: np.ndarray) -> np.ndarray:
        if np.array_equal(points, self.loads):
            return self.rows
        place = self.system.interpolate(points)
        flexible = (place @ self.basis.T) @ self.turn
        return np.hstack([place @ self.system.rigid, flexible]) * self.system.frame.mass**-0.5

    def contains(self, points: np.ndarray) -> np.ndarray:
        return self.system.contains(points)

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Static deflection of all the vectors, which is that of the whole body under the loads they started from."""
        flexible = self.omega > 0.0
        pushed, moved = (self._all_at(place)[:, flexible] / self.omega[flexible] for place in (loads, points))
        return moved @ pushed.T

    def take(self, n_modes: int) -> "RitzShapes":
        return replace(self, kept=n_modes)

    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        return self.system.mesh.points, self.system.mesh.cells
