"""The eigenvalue search against dense algebra: the lowest values, none missed, however close they lie."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import linalg
from scipy.sparse import csc_matrix

from fem_impact.fe.eigenvalues import Flexibility, by_slices, count_below, lowest


def pencil(n, seed, repeated):
    """Stiffness and mass (n, n) with known eigenvalues, some of them three times."""
    rng = np.random.default_rng(seed)
    values = np.sort(10.0 ** rng.uniform(0.0, 6.0, n))
    if repeated:
        values[3:6] = values[4]
    turn = linalg.qr(rng.normal(size=(n, n)))[0]
    weight = rng.uniform(0.5, 2.0, n)
    root = np.sqrt(weight)
    K = (root[:, None] * turn * values) @ (turn.T * root)
    return csc_matrix(0.5 * (K + K.T)), csc_matrix(np.diag(weight)), values


@pytest.mark.parametrize("repeated", [False, True])
def test_inertia_counts_the_values_below_a_shift(repeated):
    K, M, values = pencil(60, 3, repeated)
    for shift in np.concatenate([values[:-1] + 0.5 * np.diff(values), [0.5, 1e7]]):
        if np.abs(values / shift - 1.0).min() > 1e-9:
            assert count_below(K, M, shift) == np.count_nonzero(values < shift)


@pytest.mark.parametrize("search", [lowest, by_slices])
@pytest.mark.parametrize("repeated", [False, True])
def test_lowest_values_and_their_vectors(search, repeated):
    K, M, values = pencil(150, 5, repeated)
    nothing = np.zeros((150, 0))
    found, vectors = search(Flexibility(K, M, nothing, np.zeros(0, int)), 20)
    assert_allclose(found[:20], values[:20], rtol=1e-9)  # of values spread over six decades
    gram = vectors[:, :20].T @ (M @ vectors[:, :20])
    assert_allclose(gram, np.eye(20), atol=1e-9)
    residual = K @ vectors[:, :20] - (M @ vectors[:, :20]) * found[:20]
    assert np.abs(residual).max() < 1e-6 * values[20]
