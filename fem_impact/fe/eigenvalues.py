"""Solve K x = lambda M x with one factorisation, exact rigid motions and a check that no mode is missing."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import eigh, solve_triangular
from scipy.sparse import eye_array
from scipy.sparse.linalg import splu

from .._base import check, progress
from .._base.rounding import SAME
from .._base.threads import one_thread
from .._base.untyped import Sparse

DENSE = 300  # [-] up to this many unknowns a dense solver is faster
BLOCK = 8  # [-] vectors per Lanczos step: 4 and 16 were 10 % slower for 200 modes of a plate
NARROW = 4  # [-] the same for a beam, which has no multiple modes: 8 was 20 % slower
# [-] relative residual allowed for a Ritz vector; the eigenvalue's error is its square, 1e-14, which is near rounding
RESIDUAL = 1e-7
STRICT = 1e-11  # [-] relative residual allowed when the first search missed modes: rounding leaves 1e-12
FIRST_SLICE = 24  # [-] modes found with shift zero; their eigenvalues span five decades and keep ten digits
SLICE = 50  # [-] modes found with each further shift: 30 were 10 % slower, 80 were 40 % slower
# [-] eigenvalues with a smaller relative distance count as equal: far above their errors, below what meshes resolve
CLUSTER = 1e-6


@dataclass(frozen=True, eq=False)
class Factors:
    """A sparse LU factorisation."""

    lu: Any

    @one_thread
    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Solutions (n,) or (n, n_loads) of the factorised system."""
        return np.asarray(self.lu.solve(np.ascontiguousarray(loads)))


@one_thread
def factorise(A: Sparse) -> Factors:
    """Sparse LU factorisation of a symmetric matrix with pivots on the diagonal."""
    options = {"SymmetricMode": True}
    return Factors(splu(A.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options))


def count_below(K: Sparse, M: Sparse, shift: float) -> int:
    """Count the eigenvalues below a shift from the signs of the pivots of K - shift M (Sylvester's law of inertia)."""
    for nudge in (0.0, SAME, -SAME):  # if a pivot happens to vanish, SuperLU takes one off the diagonal: useless signs
        lu = factorise(K - shift * (1.0 + nudge) * M).lu
        if np.array_equal(lu.perm_r, lu.perm_c):
            return int(np.count_nonzero(lu.U.diagonal() < 0.0))
    raise check.SimulationError(
        f"a pivot vanished in the factorisation at eigenvalue {shift:g}; change the number of modes"
    )


@dataclass(frozen=True, eq=False)
class Flexibility:
    """Inverse of K without rigid motions; K is factorised on first use, and again after unpickling.

    Motions that only weak springs resist are ``sprung``: K, in which bending is so much stiffer that rounding hides
    the springs, is not asked for the forces on them.
    """

    K: Sparse
    M: Sparse
    rigid: np.ndarray  # (n_dofs, n_rigid) mass-normalised
    sprung: np.ndarray  # (n_dofs, n_sprung) mass-normalised
    pull: np.ndarray  # (n_dofs, n_sprung) forces of the springs on them
    held: np.ndarray  # (n_rigid + n_sprung,) unknowns that, when fixed, just prevent all these motions

    @classmethod
    def of(cls, system: Any) -> "Flexibility":
        """That of a `System`."""
        return cls(system.K, system.M, system.rigid, system.sprung, system.pull, system.held)

    def __reduce__(self) -> tuple[type["Flexibility"], tuple[Any, ...]]:
        return Flexibility, (self.K, self.M, self.rigid, self.sprung, self.pull, self.held)

    @cached_property
    def inertial(self) -> np.ndarray:
        """Unknowns that have inertia."""
        return np.flatnonzero(self.M.diagonal())

    @cached_property
    def _factors(self) -> tuple[Any, Any, np.ndarray]:
        """Unknowns kept, the factorisation of their stiffness, and their answer to the springs' forces."""
        if not len(self.held):
            return slice(None), factorise(self.K), self.pull
        keep = np.setdiff1d(np.arange(self.K.shape[0]), self.held)
        lu = factorise(self.K[keep][:, keep])
        return keep, lu, lu.solve(self.pull[keep]) if self.pull.size else self.pull[keep]

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Static deflection under loads (n_dofs, n); inertia balances them if the body can move rigidly."""
        keep, lu, answer = self._factors
        if not len(self.held):
            return lu.solve(loads)
        moving = self.M @ self.rigid  # (n_dofs, n_rigid)
        balanced = loads - moving @ (self.rigid.T @ loads)
        result = np.zeros_like(balanced)
        result[keep] = lu.solve(balanced[keep])
        if self.pull.size:  # the springs balance what the loads do on the sprung motions
            moved = self.sprung.T @ balanced - self.pull.T @ result
            moved = np.linalg.solve(self.sprung.T @ self.pull - self.pull[keep].T @ answer, moved)
            result[keep] -= answer @ moved
            result += self.sprung @ moved
        return result - self.rigid @ (moving.T @ result)

    @cached_property
    def _whole(self) -> Any:
        return factorise(self.K + self.M)

    def shifted(self, loads: np.ndarray) -> np.ndarray:
        """The inverse (n_dofs, n) of K + M, without rigid motions."""
        result = self._whole.solve(loads)
        return result - self.rigid @ (self.rigid.T @ (self.M @ result))

    def bent(self, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Vectors (n_dofs, n) without the sprung motions in them, and how much of each (n_sprung, n)."""
        part = self.sprung.T @ (self.M @ vectors)
        return vectors - self.sprung @ part, part

    def products(self, vectors: np.ndarray) -> np.ndarray:
        """Twice the mutual strain energy (n, n) of vectors (n_dofs, n)."""
        rest, part = self.bent(vectors)
        cross = part.T @ (self.pull.T @ rest)
        whole = rest.T @ (self.K @ rest) + cross + cross.T + part.T @ (self.sprung.T @ self.pull) @ part
        return 0.5 * (whole + whole.T)


@one_thread
def lowest(flexibility: Flexibility, n: int, residual: float = RESIDUAL) -> tuple[np.ndarray, np.ndarray]:
    """Find the n lowest flexible eigenvalues, ascending (n,), and their mass-normalised vectors (n_dofs, n)."""
    K, M = flexibility.K, flexibility.M
    size, n_rigid = K.shape[0], flexibility.rigid.shape[1]
    if n == 0:
        return np.zeros(0), np.zeros((size, 0))
    solve = flexibility.solve
    if flexibility.sprung.size:  # one, the scale of bending, keeps K definite and the lowest modes within some decades
        K = K + M
        solve = flexibility.shifted
    moving = flexibility.inertial
    if n > len(moving) - n_rigid:
        raise ValueError(f"n_modes must not exceed the {len(moving)} unknowns of this mesh; refine it")
    if size <= DENSE or 3 * (n + n_rigid) >= size:
        # solve M x = mu K x: K stays definite even if tiny triangles make M singular to rounding
        heavy = M @ flexibility.rigid
        rest, stiff = heavy @ heavy.T, float(K.diagonal().sum() / M.diagonal().sum())  # lifts them above rounding
        vectors = eigh(M.toarray() - rest, K.toarray() + stiff * rest, subset_by_index=[size - n, size - 1])[1][:, ::-1]
    elif len(moving) == size:
        vectors = krylov(solve, M, n, size - n_rigid, residual)
    else:  # the unknowns without inertia follow from the others
        place = eye_array(size, format="csc")[:, moving]
        own = krylov(lambda loads: place.T @ solve(place @ loads), M[moving][:, moving], n, len(moving), residual)
        vectors = solve(M @ (place @ own))
    few = min(n, flexibility.sprung.shape[1])
    if few:  # bending left in these by an inexact search would be far stiffer than their springs
        answer = flexibility.solve(M @ vectors[:, :few])
        vectors[:, :few] = answer / np.linalg.norm(answer, axis=0)
    if n_rigid:
        vectors = vectors - flexibility.rigid @ (flexibility.rigid.T @ (M @ vectors))
    return _ritz(flexibility, vectors)


def _ritz(flexibility: Flexibility, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Best eigenvalues, ascending (n,), and mass-normalised eigenvectors (n_dofs, n) in the span of ``vectors``."""
    M = flexibility.M
    gram = vectors.T @ (M @ vectors)
    vectors = solve_triangular(np.linalg.cholesky(gram), vectors.T, lower=True).T
    # eigh's error scales with the largest eigenvalue; so those of sprung motions, far smaller, are separated again
    for some in (slice(None), slice(min(flexibility.sprung.shape[1], vectors.shape[1]))):
        vectors[:, some] = vectors[:, some] @ eigh(flexibility.products(vectors[:, some]))[1]
    # Rayleigh quotients make small eigenvalues accurate too
    values = np.diag(flexibility.products(vectors)) / np.einsum("ij,ij->j", vectors, M @ vectors)
    order = np.argsort(values, kind="stable")
    return values[order], vectors[:, order]


@one_thread
def by_slices(flexibility: Flexibility, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Do the same as `lowest` for the simple, evenly spaced modes of a beam, a few dozen at a time.

    The eigenvalues of a thousand modes span twelve decades, too many for one search. So each slice has its own shift,
    and the pivots at both ends of a slice show how many eigenvalues it must contain.
    """
    K, M, n_rigid = flexibility.K, flexibility.M, flexibility.rigid.shape[1]
    values, vectors = lowest(flexibility, min(n, FIRST_SLICE))
    pieces, stretch = [vectors], 1.0
    while len(values) < n:
        m, root = len(values), values**0.25
        near = min(m - 1, FIRST_SLICE // 2)
        step = stretch * (root[-1] - root[-1 - near]) / near
        wanted = min(SLICE, m, n - m)
        low, high = values[-1] * (1.0 + CLUSTER), (root[-1] + (wanted + 0.5) * step) ** 4
        inside = count_below(K, M, high) - n_rigid - m
        if not 0 < inside <= 2 * SLICE:
            stretch *= 2.0 if inside == 0 else 0.5
            continue
        shift = 0.5 * (low + high)
        lu = factorise(K - shift * M)
        with progress.observed(None):  # this counts modes, not the vectors of a slice
            found = _ritz(flexibility, krylov(lu.solve, M, inside, K.shape[0], RESIDUAL, NARROW))
        kept = (found[0] > low) & (found[0] < high)
        if np.count_nonzero(kept) != inside:
            raise check.SimulationError(
                f"{inside} modes lie between eigenvalues {low:g} and {high:g}, but {np.count_nonzero(kept)} were "
                "found; change the number of modes"
            )
        values, stretch = np.concatenate([values, found[0][kept]]), 1.0
        pieces.append(found[1][:, kept])
        progress.report("modes", len(values), n)
    return values[:n], np.hstack(pieces)[:, :n]


def krylov(solve: Any, M: Any, n: int, available: int, allowed: float, width: int = BLOCK) -> np.ndarray:
    """Vectors (n_dofs, n) of the n eigenvalues nearest to a shift, by block Lanczos; ``solve`` is (K - shift M)**-1.

    For 200 modes of 5 600 unknowns this takes a third of the time of scipy's `eigsh`, because blocks turn
    orthogonalisation and triangular solves into matrix products.
    """
    size = M.shape[0]
    most = min(available, 6 * n + 20 * width)
    rng = np.random.default_rng(0)  # fixed seed, so that every run gives the same modes
    basis = np.empty((width * (2 * n // width + 4), size))  # rows are vectors; more are taken as they are needed
    small = np.zeros((most + width, most + width))
    block = solve(M @ rng.standard_normal((size, width)))
    block, carried, _ = _normal(*_normal(block, M @ block)[:2])
    basis[:width], done, older, before = block.T, 0, np.zeros((size, 0)), np.zeros((size, 0))
    next_look = 2 * n + 2 * width
    while True:
        new = solve(carried)  # the operator applied to the newest block
        heavy = M @ new
        near = np.column_stack([before, block])  # in exact arithmetic only these overlap
        overlap = near.T @ heavy
        new -= near @ overlap
        heavy -= np.column_stack([older, carried]) @ overlap
        small[max(0, done - width) : done + width, done : done + width] = overlap
        done += width
        new, heavy, factor = _normal(new, heavy)
        drift = basis[:done] @ heavy  # earlier directions that rounding brought back
        new -= basis[:done].T @ drift
        small[:done, done - width : done] += drift @ factor
        heavy = M @ new  # again: a hundredth of the work, and half the overlap that is left
        older, before, (block, carried, again) = carried, block, _normal(new, heavy)
        factor = again @ factor
        full = done + width > most
        progress.report("vectors", done, max(done, next_look))
        if done >= next_look or full:
            values, turn = eigh(0.5 * (small[:done, :done] + small[:done, :done].T))
            nearest = np.argsort(-np.abs(values), kind="stable")[:n]
            values, turn = values[nearest], turn[:, nearest]
            residual = np.linalg.norm(factor @ turn[-width:], axis=0)
            if full or (residual <= allowed * np.abs(values)).all():
                return basis[:done].T @ turn
            next_look = done + 4 * width
        if done + width > len(basis):
            basis.resize((done + n + 4 * width, size), refcheck=False)  # seldom, and mostly without a copy
        basis[done : done + width] = block.T
        small[done : done + width, done - width : done] = factor


def _normal(vectors: np.ndarray, heavy: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass-orthonormal vectors with the span of given ones (n_dofs, n), M times them, and the triangular factor."""
    gram = vectors.T @ heavy
    gram = 0.5 * (gram + gram.T)
    try:
        factor = np.linalg.cholesky(gram)
    except np.linalg.LinAlgError:  # dependent vectors; a small shift of the Gram matrix does no harm
        factor = np.linalg.cholesky(gram + 1e-14 * np.trace(gram) * np.eye(len(gram)))
    back = np.linalg.inv(factor).T
    return vectors @ back, heavy @ back, factor.T
