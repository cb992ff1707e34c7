"""The eigenvalue problem K x = lambda M x: factorised once, every mode accounted for, rigid motions exact."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg import eigh, solve_triangular
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from . import _check

DENSE = 300  # [-] unknowns up to which a dense solution is faster
BLOCK = 8  # [-] vectors per Lanczos step: 4 and 16 were 10 % slower on 200 modes
RESIDUAL = 1e-7  # [-] of a Ritz vector, relative; its eigenvalue is then good to the square of it
DRIFT = 1e-9  # [-] overlap with old directions beyond which products with the mass are taken anew
SPARE = 6  # [-] modes computed beyond those wanted, to find a gap behind the last


def factorise(A: csc_matrix) -> Any:
    """Sparse LU of a symmetric matrix, its pivots on the diagonal."""
    options = {"SymmetricMode": True}
    return splu(A.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def count_below(K: csc_matrix, M: csc_matrix, shift: float) -> int:
    """Number of eigenvalues below a shift, by Sylvester's law of inertia from the pivots of K - shift M."""
    lu = factorise(K - shift * M)
    pivots = lu.U.diagonal()
    if not np.array_equal(lu.perm_r, lu.perm_c):
        raise _check.SimulationError(f"the factorisation at eigenvalue {shift:g} left the diagonal; move the shift")
    return int(np.count_nonzero(pivots < 0.0))


@dataclass(frozen=True, eq=False)
class Flexibility:
    """Inverse of K on everything that is not a rigid motion; factorised when first used, and again after a pickle."""

    K: csc_matrix
    M: csc_matrix
    rigid: np.ndarray  # (n_dofs, n_rigid) mass-normalised
    held: np.ndarray  # (n_rigid,) unknowns that hold the rigid motions and nothing else
    _lu: list = field(default_factory=list)

    def __reduce__(self):
        return Flexibility, (self.K, self.M, self.rigid, self.held)

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Static deflection under loads (n_dofs, n): balanced by inertia and free of rigid motion where not held."""
        if not self._lu:
            keep = np.setdiff1d(np.arange(self.K.shape[0]), self.held) if self.rigid.shape[1] else slice(None)
            self._lu.extend([keep, factorise(self.K[keep][:, keep] if self.rigid.shape[1] else self.K)])
        keep, lu = self._lu
        if not self.rigid.shape[1]:
            return lu.solve(np.ascontiguousarray(loads))
        moving = self.M @ self.rigid  # (n_dofs, n_rigid)
        balanced = loads - moving @ (self.rigid.T @ loads)
        result = np.zeros_like(balanced)
        result[keep] = lu.solve(np.ascontiguousarray(balanced[keep]))
        return result - self.rigid @ (moving.T @ result)


def lowest(flexibility: Flexibility, n: int, residual: float = RESIDUAL) -> tuple[np.ndarray, np.ndarray]:
    """The n lowest flexible eigenvalues, ascending (n,), and their mass-normalised vectors (n_dofs, n)."""
    K, M = flexibility.K, flexibility.M
    size, n_rigid = K.shape[0], flexibility.rigid.shape[1]
    if n == 0:
        return np.zeros(0), np.zeros((size, 0))
    if n > size - n_rigid:
        raise ValueError(f"n_modes must not exceed the {size} unknowns of this mesh; refine it")
    if size <= DENSE or 3 * (n + n_rigid) >= size:
        # the reciprocal problem: K stays definite where the smallest triangles leave M none of its digits
        moving = M @ flexibility.rigid
        rest = moving @ moving.T
        vectors = eigh(M.toarray() - rest, K.toarray() + rest, subset_by_index=[size - n, size - 1])[1][:, ::-1]
    else:
        vectors = _krylov(flexibility, n, residual)
    if n_rigid:
        vectors = vectors - flexibility.rigid @ (flexibility.rigid.T @ (M @ vectors))
    gram = vectors.T @ (M @ vectors)
    vectors = solve_triangular(np.linalg.cholesky(gram), vectors.T, lower=True).T
    stiffness = vectors.T @ (K @ vectors)
    values, turn = eigh(0.5 * (stiffness + stiffness.T))
    return values, vectors @ turn


def _krylov(flexibility: Flexibility, n: int, allowed: float) -> np.ndarray:
    """Vectors (n_dofs, n) of the n lowest flexible modes, by block Lanczos on the flexibility.

    Against scipy's `eigsh` on 200 modes of 5 600 unknowns this takes a third of the time: blocks turn the
    orthogonalisation, where two thirds of it go, and the triangular solves into matrix products.
    """
    M, size = flexibility.M, flexibility.K.shape[0]
    most = min(size - flexibility.rigid.shape[1], 6 * n + 20 * BLOCK)
    rng = np.random.default_rng(0)  # fixed, so that every run gives the same
    basis = np.empty((most + BLOCK, size))  # rows are vectors
    small = np.zeros((most + BLOCK, most + BLOCK))
    block, carried, _ = _normal(*_with(M, flexibility.solve(M @ rng.standard_normal((size, BLOCK)))))
    block, carried, _ = _normal(block, carried)
    basis[:BLOCK], done, older = block.T, 0, np.zeros((size, 0))
    next_look = 2 * n + 2 * BLOCK
    while True:
        new, heavy = _with(M, flexibility.solve(carried))  # the flexibility times the newest block, and its mass
        near = slice(max(0, done - BLOCK), done + BLOCK)  # in exact arithmetic only these overlap with it
        overlap = basis[near] @ heavy
        new -= basis[near].T @ overlap
        heavy -= np.column_stack([older, carried]) @ overlap
        small[near, done : done + BLOCK] = overlap
        done += BLOCK
        new, heavy, factor = _normal(new, heavy)
        drift = basis[:done] @ heavy  # rounding lets old directions back in
        new -= basis[:done].T @ drift
        small[:done, done - BLOCK : done] += drift @ factor
        if np.abs(drift).max() > DRIFT:
            heavy = M @ new
        older, (new, carried, again) = carried, _normal(new, heavy)
        factor = again @ factor
        full = done + BLOCK > most
        if done >= next_look or full:
            values, turn = eigh(
                0.5 * (small[:done, :done] + small[:done, :done].T), subset_by_index=[done - n, done - 1]
            )
            residual = np.linalg.norm(factor @ turn[-BLOCK:], axis=0)
            if full or (residual <= allowed * values).all():
                return basis[:done].T @ turn
            next_look = done + 4 * BLOCK
        basis[done : done + BLOCK] = new.T
        small[done : done + BLOCK, done - BLOCK : done] = factor


def _with(M: csc_matrix, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return vectors, M @ vectors


def _normal(vectors: np.ndarray, heavy: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass-normal vectors spanning given ones (n_dofs, n), their products with the mass, and the factor between."""
    gram = vectors.T @ heavy
    gram = 0.5 * (gram + gram.T)
    try:
        factor = np.linalg.cholesky(gram)
    except np.linalg.LinAlgError:  # a direction ran dry; any small one in its place does no harm
        factor = np.linalg.cholesky(gram + 1e-14 * np.trace(gram) * np.eye(len(gram)))
    back = np.linalg.inv(factor).T
    return vectors @ back, heavy @ back, factor.T
