"""What the libraries return has all that the stated types promise."""

import numpy as np
import pytest
from scipy import sparse
from skfem import MeshLine, MeshTri

from fem_impact._base.untyped import Cells, Sparse


@pytest.mark.parametrize("kind", [sparse.csc_matrix, sparse.csr_matrix])
def test_sparse_matrices_of_scipy_are_sparse(kind):
    matrix = kind(np.diag([1.0, 2.0]))
    results = (matrix.T, matrix + matrix, matrix - matrix, matrix * 2.0, 2.0 * matrix, matrix[[1]], matrix.tocsr())
    assert all(isinstance(each, Sparse) for each in (matrix, *results, matrix.multiply(matrix), matrix.tocsc()))
    assert isinstance(matrix @ np.eye(2), np.ndarray) and isinstance(matrix.diagonal(), np.ndarray)
    assert not isinstance(np.eye(2), Sparse)


@pytest.mark.parametrize("kind", [MeshTri, MeshLine])
def test_meshes_of_scikit_fem_are_cells(kind):
    mesh = kind()
    assert isinstance(mesh, Cells) and mesh.p.shape[0] + 1 == mesh.t.shape[0]
