"""Ritz vectors started from point loads: a body as it is excited at the points where it is struck.

The vectors span the Krylov space of (K + s**2 M)**-1 M that starts with the static deflection under the loads. Their
Ritz pairs are a Gauss quadrature of the body's response at those points: modes that the loads do not excite never
appear, and modes closer together than a blow can distinguish become one. One factorisation and one solution per vector
replace the search for eigenvalues, and the first vectors of a longer run are the vectors of a shorter one.

The mass M of a ribbed plate has that of what moves in the plane: in the space of vectors made without it, frequencies
would converge only as fast as the number of vectors grows, because bending along the rib is not among the first.

References
----------
Wilson, Yuan and Dickens (1982), Earthquake Eng. Struct. Dyn. 10, 813-821 (load-dependent Ritz vectors); Golub and
Meurant (2010), Matrices, Moments and Quadrature, ch. 6 (Lanczos and Gauss quadrature).
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import eigh_tridiagonal

from .._base import check
from .._base.rounding import SAME
from .._base.threads import one_thread
from ..fe import plausible, point_load
from ..fe.assembly import System
from ..fe.eigenvalues import Flexibility, factorise
from ..fe.shallow import whole_mass
from .modal import Damping, Modes, damping_ratios
from .shapes import ElementShapes

# [-] part of the vectors with which a second blow estimates the error: at the third power it errs 2.9 times more
FEWER = 0.7


@check.typed
@one_thread
def ritz_modes(
    system: System, points: Any, *, max_frequency: float, n_vectors: int = 100, damping_ratio: Damping = 0.0
) -> Modes:
    """Describe a body as forces at given points excite it, by Ritz vectors instead of modes.

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
    >>> body = fi.ritz_modes(system, [(0.1, 0.1)], max_frequency=5e3, n_vectors=40)
    >>> body.n_modes, round(float(body.frequencies[0]), 2)
    (40, 105.78)
    """
    place = check.places("points", points, system.mesh.dimension)
    check.on_body("points", place, system.contains(place), system.mesh.points)
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
        self.shift = (shift / system.frame.rate) ** 2  # s**2 in the frame
        self._moving = system.M @ system.rigid
        self._mass = whole_mass(system)
        self._eased, self._pushed = self._mass.spared, system.rigid
        self._factors = factorise(system.K + self.shift * self._mass.whole)
        if system.ribbed:
            spared = self._mass.spared
            yields, pushed = self._factors.solve(spared), self._factors.solve(self._moving)
            left = np.eye(yields.shape[1]) / self.shift - spared.T @ yields
            self._eased = yields @ np.linalg.inv(left)  # (n_dofs, n_drifts)
            pushed += self._eased @ (spared.T @ pushed)
            self._pushed = pushed @ np.linalg.inv(self._moving.T @ pushed)  # (n_dofs, n_rigid)
        self._flexibility = Flexibility.of(system)
        self._begin(points)

    def _solve(self, loads: np.ndarray) -> np.ndarray:
        """The inverse of K + s**2 M times loads (n_dofs, n), among motions that are not rigid."""
        found = self._factors.solve(loads)
        return self._flexible(found + self._eased @ (self._mass.spared.T @ found))

    def _flexible(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors (n_dofs, n) without rigid motions."""
        return vectors - self._pushed @ (self._moving.T @ vectors)

    def _begin(self, points: np.ndarray) -> None:
        system = self.system
        self.points = points
        self.loads = np.asarray(system.interpolate(points).todense()).T  # (n_dofs, n_points)
        self.width = len(points)
        self.vectors = np.empty((0, system.n_dofs))  # (room, n_dofs) mass-orthonormal rows
        self.projected = np.zeros((0, 0))  # (room, room) of (K + s**2 M)**-1 M
        self.count, self.full = 0, False  # how many were made, and whether there are no more
        still = self._flexibility.solve(self.loads)
        self.compliance = self.loads.T @ still  # (n_points, n_points) in the frame
        # the static deflection, so that the compliance is exact; but on weak springs bending is lost beside it
        self._next = self._solve(self.loads) if system.sprung.size else still
        self._carried = np.zeros((system.n_dofs, 0))  # M times the two latest blocks of vectors
        self._latest = 0, 0, 0  # where the two latest blocks of vectors begin, and where they end
        self._period, self._due = 1, 1  # [-] blocks between two looks at all vectors, and blocks until the next one

    def beside(self, points: np.ndarray) -> "Krylov":
        """Vectors started from other points, with the same factorisations."""
        other = copy(self)
        other._begin(points)
        return other

    def grow(self, count: int) -> None:
        """Make vectors until there are at least ``count``, or all that the loads can reach."""
        grow_together([self], count)

    def _extended(self, count: int) -> bool:
        """Whether vectors were too few and ``_next`` gave more; it is now the load whose solution gives those after."""
        most = min(count, self.system.n_dofs - self.system.rigid.shape[1])
        if self.count >= most or self.full:
            return False
        if most + self.width - 1 > len(self.vectors):  # memory for more to come is not used until they do
            room = 2 * (most + self.width - 1)
            vectors = np.empty((room, self.system.n_dofs))
            vectors[: self.count] = self.vectors[: self.count]
            self.projected = np.pad(self.projected, (0, room - len(self.projected)))
            self.vectors = vectors
        if self._due == self._period:  # all vectors have just been looked at
            self._sound = self.count, self._latest, self._carried, self._next  # at the last that are orthogonal
        before, start, end = self._latest
        overlap = self._carried.T @ self._next  # in exact arithmetic only the two latest blocks overlap
        self.projected[before:end, start:end] = overlap[:, : end - start]
        new = self._next - self.vectors[before:end].T @ overlap
        new = self._flexible(new)
        self._due -= 1
        if end and self._due <= 0:
            cleared = self._cleared(new)
            if cleared is None:
                return self._extended(count)
            new = cleared
        heavy = self._mass @ new
        gram = new.T @ heavy
        length = np.sqrt((overlap**2).sum(axis=0) + gram.diagonal())  # before `overlap` was removed
        scaled = gram / np.outer(length, length)
        value, turn = np.linalg.eigh(scaled) if self.width > 1 else (scaled[0], np.ones((1, 1)))
        kept = value > SAME**2  # shorter parts of a vector before orthogonalisation add nothing
        if not kept.any():
            self.full = True
            return False
        unit = (turn[:, kept] / np.sqrt(value[kept])) / length[:, None]
        stop = end + unit.shape[1]
        self.vectors[end:stop] = (new @ unit).T
        self.projected[end:stop, start:end] = (unit.T @ gram)[:, : end - start]
        self.projected[start:end, end:stop] = self.projected[end:stop, start:end].T
        self._next = np.ascontiguousarray(heavy @ unit)
        self._carried = np.hstack([self._carried[:, start - before :], self._next])
        self.count, self._latest = stop, (start, end, stop)
        return True

    def _cleared(self, new: np.ndarray) -> np.ndarray | None:
        """New vectors without the parts along earlier ones that rounding brought back; clears the latest block alike.

        The next block follows from both. Where rounding grew so fast that the vectors since the last look are lost,
        goes back there to look more often, and returns None. Ritz values err by the square of the overlap.
        """
        start, end = self._latest[1:]
        latest = end - start
        both = np.vstack([self.vectors[start:end], new.T])
        heavy = np.vstack([self._carried[:, -latest:].T, (self._mass @ new).T])
        rows, worst = max(1, 2**20 // (8 * both.shape[1])), 0.0  # a piece that fits into the cache of a core
        for i in range(0, start, rows):  # a few rows at a time: memory is read once for both products
            known = self.vectors[i : min(i + rows, start)]
            drift = heavy @ known.T
            both -= drift @ known
            worst = max(worst, float(np.abs(drift[:latest]).max()))
        if worst > 1e-8 and self._period > 1:
            self.count, self._latest, self._carried, self._next = self._sound
            self._period = self._due = max(1, self._period // 4)
            return None
        self.vectors[start:end] = both[:latest]
        self._carried[:, -latest:] = self._mass @ both[:latest].T
        new = both[latest:] - (both[latest:] @ self._carried[:, -latest:]) @ both[:latest]
        self._period = max(1, self._period // 2) if worst > 1e-11 else self._period + 1
        self._due = self._period
        return new.T

    def _eigenpairs(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Ascending eigenvalues (count,) and vectors (count, count) of the stiffness projected onto the first vectors.

        They come from its shifted inverse, whose rounding is relative to the shift: the stiffness itself spans so many
        decades that rounding of its largest eigenvalue would spoil the low ones. It differs from the projected inverse
        in the last columns only, because the images of all other vectors lie in the space; those columns follow from
        the stiffness of the last vectors.
        """
        reach = 2 * self.width - 1  # the image of a vector ends so many vectors later
        last, band = min(reach, count), slice(max(0, count - 2 * reach), count)
        inverse = self.projected[:count, :count].copy()
        inverse = 0.5 * (inverse + inverse.T)
        latest = self.vectors[count - last : count].T
        pushed = self.system.K @ latest + self.shift * (self._mass @ latest)  # (n_dofs, last)
        stiff = self.vectors[band] @ pushed
        rest = inverse[count - last :, band] @ stiff - np.eye(last)
        excess = np.linalg.solve(stiff[-last:].T, rest.T)  # rest = excess @ stiff[-last:]
        inverse[-last:, -last:] -= 0.5 * (excess + excess.T)
        if self.width == 1:
            value, turn = eigh_tridiagonal(inverse.diagonal(), inverse.diagonal(1))
        else:
            value, turn = np.linalg.eigh(inverse)
        value, turn = value[::-1], turn[:, ::-1]
        value = 1.0 / np.maximum(value, np.finfo(float).eps * value[0]) - self.shift
        few = min(count, self.system.sprung.shape[1])  # so far below the shift that rounding hides them
        if few:
            low = self.vectors[:count].T @ turn[:, :few]
            back = np.linalg.eigh(self._flexibility.products(low))[1]
            lowest = np.diag(self._flexibility.products(low @ back))
            order = np.argsort(lowest, kind="stable")
            value[:few], turn[:, :few] = lowest[order], turn[:, :few] @ back[:, order]
        return value, turn

    def modes(self, count: int, damping_ratio: Damping = 0.0) -> Modes:
        """`pairs` of the first ``count`` vectors.

        `Modes.poorer` holds those of fewer vectors, so that a blow states the error of having no more.
        """
        found = self.pairs(count, damping_ratio)
        if count >= self.count and self.full:
            return found
        fewer = max(self.width, int(FEWER * min(count, self.count)))
        return replace(found, poorer={"truncation": self.pairs(fewer, damping_ratio)})

    def pairs(self, count: int, damping_ratio: Damping = 0.0) -> Modes:
        """Ritz pairs of the first ``count`` vectors, after the rigid motions, which are exact."""
        self.grow(count)
        count = min(count, self.count)
        frame, rigid = self.system.frame, self.system.rigid
        value, turn = self._eigenpairs(count)
        omega = np.concatenate([np.zeros(rigid.shape[1]), np.sqrt(np.maximum(value, 0.0)) * frame.rate])
        basis = self.vectors[:count]
        rows = np.hstack([self.loads.T @ rigid, (basis @ self.loads).T @ turn]) * frame.mass**-0.5
        damping = damping_ratios(damping_ratio, omega)
        shapes = RitzShapes(self.system, self.points, omega, rows, basis, turn)
        notes = (*self.system.notes, *plausible.notes_on_damping(damping, omega))
        no_error = np.zeros(len(omega))
        return Modes(omega, damping, shapes, self.system.mass, no_error, notes=notes, section=self.system.section)


@one_thread
def grow_together(several: Sequence[Krylov], count: int) -> None:
    """Make vectors of `Krylov.beside` each other until each has ``count``, or all that its loads can reach.

    A solution mostly waits for the factors from memory: side by side, eight take half as long each.
    """
    while growing := [one for one in several if one._extended(count)]:
        found = growing[0]._solve(np.hstack([one._next for one in growing]))
        for one in growing:
            one._next, found = np.hsplit(found, [one._next.shape[1]])


@dataclass(frozen=True, eq=False, repr=False)
class RitzShapes(ElementShapes, check.Brief):
    """Shapes of Ritz vectors: complete at the loads they started from, approximate elsewhere."""

    loads: np.ndarray  # (n_loads, dimension) [m] points that the vectors started from
    omega: np.ndarray  # (n_all,) [rad/s] of all vectors, rigid motions first
    rows: np.ndarray  # (n_loads, n_all) [kg**-0.5] shapes at the loads
    basis: np.ndarray  # (n_vectors, n_dofs) [-] mass-orthonormal in the frame
    turn: np.ndarray  # (n_vectors, n_vectors) [-] from the basis to the flexible shapes
    kept: int | None = None  # number of shapes that count as modes; the others are left out

    @property
    def vectors(self) -> np.ndarray:
        """The shapes in the unknowns of their system, (n_dofs, n_modes)."""
        return np.hstack([self.system.rigid, self.basis.T @ self.turn])[:, : self.kept]

    def at(self, points: np.ndarray) -> np.ndarray:
        return self._all_at(points)[:, : self.kept]

    def _all_at(self, points: np.ndarray) -> np.ndarray:
        if np.array_equal(points, self.loads):
            return self.rows
        place = self.system.interpolate(points)
        flexible = (place @ self.basis.T) @ self.turn
        return np.hstack([place @ self.system.rigid, flexible]) * self.system.frame.mass**-0.5

    def deflection(self, loads: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Static deflection of all the vectors, which is that of the whole body under the loads they started from."""
        flexible = self.omega > 0.0
        pushed, moved = (self._all_at(place)[:, flexible] / self.omega[flexible] for place in (loads, points))
        return moved @ pushed.T

    def take(self, n_modes: int) -> "RitzShapes":
        return replace(self, kept=n_modes)
