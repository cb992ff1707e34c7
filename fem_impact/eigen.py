"""The eigenvalue problem K x = lambda M x: factorised once, every mode accounted for, rigid motions exact."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from . import _check

DENSE = 300  # [-] unknowns up to which a dense solution is faster
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


def lowest(flexibility: Flexibility, n: int) -> tuple[np.ndarray, np.ndarray]:
    """The n lowest flexible eigenvalues, ascending (n,), and their mass-normalised vectors (n_dofs, n)."""
    K, M = flexibility.K, flexibility.M
    size, n_rigid = K.shape[0], flexibility.rigid.shape[1]
    if n == 0:
        return np.zeros(0), np.zeros((size, 0))
    if n > size - n_rigid:
        raise ValueError(f"n_modes must not exceed the {size} unknowns of this mesh; refine it")
    if size <= DENSE or n + SPARE + n_rigid >= size // 2:
        # the reciprocal problem: K stays definite where the smallest triangles leave M none of its digits
        moving = M @ flexibility.rigid
        rest = moving @ moving.T
        vectors = eigh(M.toarray() - rest, K.toarray() + rest, subset_by_index=[size - n, size - 1])[1][:, ::-1]
    else:
        start = np.cos(np.arange(size) * 1.7 + 0.3)  # fixed, so that every run gives the same
        start = flexibility.solve(M @ start)
        operator = LinearOperator(K.shape, flexibility.solve, dtype=float)
        krylov = min(size - 1, max(2 * n if n < 20 else int(1.3 * n), n + 20))
        values, vectors = eigsh(K, k=n, M=M, sigma=0.0, OPinv=operator, v0=start, ncv=krylov)
        vectors = vectors[:, np.argsort(values)]
    if n_rigid:
        vectors = vectors - flexibility.rigid @ (flexibility.rigid.T @ (M @ vectors))
    gram = vectors.T @ (M @ vectors)
    factor = np.linalg.cholesky(gram)
    vectors = np.linalg.solve(factor, vectors.T).T
    values = np.einsum("ij,ij->j", vectors, K @ vectors)
    order = np.argsort(values, kind="stable")
    return values[order], vectors[:, order]
