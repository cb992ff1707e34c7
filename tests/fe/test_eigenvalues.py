"""The eigenvalue search against dense algebra: the lowest values, none missed, however close they lie."""

import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import linalg
from scipy.sparse import csc_matrix

from fem_impact._base.check import SimulationError
from fem_impact.fe import eigenvalues, refinement
from fem_impact.fe.assembly import assemble
from fem_impact.fe.eigenvalues import Flexibility, by_slices, count_below, lowest
from fem_impact.fe.section import Material, Plate
from fem_impact.mesh import rectangle


def body_of(K, M):
    """A body that cannot move rigidly."""
    nothing = np.zeros((K.shape[0], 0))
    return Flexibility(K, M, nothing, nothing, nothing, np.zeros(0, int))


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
    found, vectors = search(body_of(K, M), 20)
    assert_allclose(found[:20], values[:20], rtol=1e-9)  # of values spread over six decades
    gram = vectors[:, :20].T @ (M @ vectors[:, :20])
    assert_allclose(gram, np.eye(20), atol=1e-9)
    residual = K @ vectors[:, :20] - (M @ vectors[:, :20]) * found[:20]
    assert np.abs(residual).max() < 1e-6 * values[20]


def test_memory_is_taken_for_the_vectors_that_are_needed_not_for_the_most_that_may_be():
    """Twice as many vectors as modes are usual; room for six times as many was asked for at once, 27 GB of a pane."""
    system, n = assemble(rectangle(1.0, 0.7, size=0.03), Plate(Material(E=210e9, nu=0.3, rho=7850.0), 2e-3)), 100
    heavier = body_of(system.K + system.M, system.M)
    assert system.n_dofs > 20 * n  # no dense solver
    tracemalloc.start()
    eigenvalues.krylov(heavier._whole.solve, system.M, n, system.n_dofs, eigenvalues.RESIDUAL)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 7.0 * n * 8 * system.n_dofs  # measured 5.5: two and a half times as many, the result, the factors


def test_where_a_pivot_vanishes_another_number_of_modes_is_counted(monkeypatch):
    """A pair of equal unknowns has no pivot midway between its eigenvalues 4 and 6, only beside."""
    values = np.array([1.0, 2.0, 3.0, 7.0, 8.0, 9.0])
    K = csc_matrix(linalg.block_diag([[5.0, 1.0], [1.0, 5.0]], np.diag(values)))
    M = csc_matrix(np.eye(8))
    assert count_below(K, M, 5.0) == 4  # a nudge steps beside
    monkeypatch.setattr(eigenvalues, "SAME", 0.0)
    with pytest.raises(SimulationError, match=r"a pivot vanished .*; change the number of modes"):
        count_below(K, M, 5.0)  # after four modes
    assert count_below(K, M, 6.5) == 5  # after five


def test_a_beam_whose_slice_misses_modes_is_found_with_another_number(monkeypatch):
    """A search that loses a mode of the last slice is noticed; fewer modes need no such slice."""
    whole = eigenvalues.krylov
    stiff = np.diag((1.0 + np.arange(400.0)) ** 4)
    body = body_of(csc_matrix(stiff), csc_matrix(np.eye(400)))

    def loses(solve, M, n, available, allowed, width=eigenvalues.BLOCK):
        found = whole(solve, M, n, available, allowed, width)
        return found[:, 1:] if width == eigenvalues.NARROW else found

    monkeypatch.setattr(eigenvalues, "krylov", loses)
    with pytest.raises(SimulationError, match=r"modes lie between eigenvalues .*; change the number of modes"):
        by_slices(body, 40)
    assert_allclose(by_slices(body, 20)[0][:20], np.diag(stiff)[:20], rtol=1e-9)


def test_modes_that_stay_missing_are_found_by_asking_for_more(monkeypatch):
    """A search that loses the same mode again and again is noticed; for all modes, the search is dense."""
    system = assemble(rectangle(0.4, 0.3, size=0.05), Plate(Material(E=210e9, nu=0.3, rho=7850.0), 1e-3))
    whole = eigenvalues.krylov
    monkeypatch.setattr(eigenvalues, "DENSE", 10)
    monkeypatch.setattr(eigenvalues, "krylov", lambda *arguments: np.delete(whole(*arguments), 2, axis=1))
    with pytest.raises(SimulationError, match=r"flexible modes lie below .* were found; ask for a few more modes"):
        refinement.solve_on_mesh(system, 12, None)
    many = system.n_dofs // 3
    assert len(refinement.solve_on_mesh(system, many, None).omega) == many
