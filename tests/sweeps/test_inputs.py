"""Distributions, correlations and points: against their closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import stats

from fem_impact.sweeps import inputs


@pytest.mark.parametrize(
    ("given", "median", "upper"),
    [
        (("normal", 3.0, 0.5), 3.0, 3.5),
        (("lognormal", 2.0, 0.1), 2.0, 2.0 * np.exp(0.1)),
        (("uniform", 1.0, 5.0), 3.0, 1.0 + 4.0 * stats.norm.cdf(1.0)),
        (("loguniform", 1.0, 100.0), 10.0, 100.0 ** stats.norm.cdf(1.0)),
        (("triangular", 0.0, 1.0, 2.0), 1.0, 2.0 - np.sqrt(2.0 * stats.norm.sf(1.0))),
        (stats.norm(3.0, scale=0.5), 3.0, 3.5),
        ("lognormal( 2, 1e-1 )", 2.0, 2.0 * np.exp(0.1)),
    ],
)
def test_a_distribution_has_the_quantiles_of_its_closed_form(given, median, upper):
    one = inputs.Input.of("a", given)
    assert_allclose(one.at(np.array([0.5, stats.norm.cdf(1.0)])), [median, upper], rtol=1e-12)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (("gaussian", 1.0, 0.1), r"vary\['a'\] must be one of normal, lognormal"),
        (("normal", 1.0), r"vary\['a'\] must be normal\(mean, deviation\), got 1 numbers"),
        (("normal", 1.0, 0.0), r"deviation of vary\['a'\] must be positive"),
        (("lognormal", -1.0, 0.1), r"median of vary\['a'\] must be positive"),
        (("uniform", 2.0, 1.0), r"low of vary\['a'\] must be below high, got 2 and 1"),
        (("triangular", 0.0, 3.0, 2.0), r"mode of vary\['a'\] must lie between low and high"),
        (("loguniform", 0.0, 3.0), r"low of vary\['a'\] must be positive"),
        ("normal 1 2", r"vary\['a'\] must look like lognormal\(695e3, 0.1\), got 'normal 1 2'"),
        ("normal(1, b)", r"vary\['a'\] must hold numbers"),
        (3.0, r"vary\['a'\] must be a distribution such as"),
        (("normal", float("nan"), 1.0), r"mean of vary\['a'\] must be finite"),
    ],
)
def test_a_wrong_distribution_is_refused(given, text):
    with pytest.raises(ValueError, match=text):
        inputs.Input.of("a", given)


def test_inputs_must_be_named():
    for wrong in ({}, None, [("a", "normal(0, 1)")]):
        with pytest.raises(ValueError, match="vary must name at least one input"):
            inputs.read_inputs(wrong)
    with pytest.raises(ValueError, match="vary must map names to distributions"):
        inputs.read_inputs({3: "normal(0, 1)"})
    with pytest.raises(ValueError, match="at most 64 inputs"):
        inputs.read_inputs({f"a{i}": "normal(0, 1)" for i in range(65)})


def pair():
    return inputs.read_inputs({"a": ("normal", 0.0, 1.0), "b": ("uniform", 0.0, 1.0)})


@pytest.mark.parametrize("given", [{("a", "b"): 0.6}, {("b", "a"): 0.6}, [[1.0, 0.6], [0.6, 1.0]]])
def test_a_gaussian_copula_has_its_rank_correlation(given):
    mixer = inputs.mixing(pair(), given)
    values = inputs.drawn(pair(), inputs.shares(2**14, 2, 0), mixer)
    rank = stats.spearmanr(*values.T).statistic
    assert_allclose(rank, 6.0 / np.pi * np.arcsin(0.3), atol=5e-3)  # Pearson's formula; even points beat 1/sqrt(n)
    assert_allclose(np.quantile(values[:, 1], [0.1, 0.9]), [0.1, 0.9], atol=2e-3)  # margins stay as they were


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({("a", "c"): 0.5}, "correlation must be one of a, b, got 'c'"),
        ({("a", "a"): 0.5}, "pairs of different names"),
        ({("a", "b"): 1.5}, "correlation of a and b must"),
        ({("a", "b"): 1.0}, "must be positive definite"),
        ([[1.0, 0.5], [0.4, 1.0]], "must be symmetric with ones on its diagonal"),
        ([[1.0]], "must have shape"),
    ],
)
def test_a_wrong_correlation_is_refused(given, text):
    with pytest.raises(ValueError, match=text):
        inputs.mixing(pair(), given)


def test_no_correlation_mixes_nothing():
    assert inputs.mixing(pair(), None) is None and inputs.mixing(pair(), np.eye(2)) is None


def test_points_are_repeatable_even_and_inside_the_cube():
    points = inputs.shares(1000, 3, 7)
    np.testing.assert_array_equal(points, inputs.shares(1000, 3, 7))
    assert np.abs(points - inputs.shares(1000, 3, 8)).max() > 0.1
    assert points.min() > 0.0 and points.max() < 1.0
    # of 1024 points of the sequence every slab of 1/16 holds exactly 64
    counts = [np.histogram(column, 16, (0.0, 1.0))[0] for column in inputs.shares(1024, 3, 7).T]
    np.testing.assert_array_equal(counts, 64)


def test_groups_for_sobol_indices_exchange_one_input_at_a_time():
    points = inputs.shares(8, 6, 1)
    groups = inputs.crossed(points).reshape(8, 5, 3)
    first, second = points[:, :3], points[:, 3:]
    np.testing.assert_array_equal(groups[:, 0], first)
    np.testing.assert_array_equal(groups[:, 4], second)
    for i in range(3):
        mixed = first.copy()
        mixed[:, i] = second[:, i]
        np.testing.assert_array_equal(groups[:, 1 + i], mixed)
