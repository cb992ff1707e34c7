"""The limits of rounding are neither below what sums and equations leave nor far above it."""

import numpy as np

from fem_impact._base.rounding import EPSILON, HALVINGS, ROUNDING, SAME


def test_a_sum_that_is_zero_leaves_less_but_not_much_less():
    terms = np.random.default_rng(1).normal(size=4000)
    order = np.random.default_rng(2).permutation(8000)
    left = abs(np.cumsum(np.concatenate([terms, -terms])[order])[-1]) / np.abs(terms).max()
    assert 1e-3 * ROUNDING < left < 0.1 * ROUNDING  # 7e-15 was measured; other orders leave up to 1e-13
    assert ROUNDING > 1000.0 * EPSILON


def test_equations_solved_leave_less_but_not_much_less():
    n = 3000
    matrix = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)  # condition 4e6, as of a coarse mesh
    wanted = np.random.default_rng(3).normal(size=n)
    error = np.abs(np.linalg.solve(matrix, matrix @ wanted) - wanted).max() / np.abs(wanted).max()
    assert 1e-4 * SAME < error < 0.5 * SAME


def test_so_many_bisections_reach_the_last_digit_and_half_of_them_do_not():
    low, high, reached = 0.0, 1000.0, None
    for count in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if middle**2 < 2.0 else (low, middle)
        reached = count if reached is None and high - low <= np.spacing(low) else reached
    assert reached is not None and reached > 0.75 * HALVINGS
