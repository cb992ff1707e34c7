"""Uncertain inputs and the statistics of blows: against closed forms, binomial laws and Sobol indices."""

import json
from functools import partial

import numpy as np
import pytest
import xarray
from comparing import refusing
from numpy.testing import assert_allclose
from scipy import stats

from fem_impact._base.check import SimulationError
from fem_impact.sweeps import inputs
from fem_impact.sweeps.spreads import Spread

SIGMAS = {"a": 0.3, "b": 0.2, "c": 0.1}


def spread(restitution, *, values=None, n_parts=1, counts=None, names=("a",), **rest):
    """A spread of made-up blows: arrays (n_blows,)."""
    n = len(restitution)
    counts = np.ones(n, int) if counts is None else counts
    values = np.linspace(0.0, 1.0, n)[:, None] if values is None else values
    data = {name: ("blow", column, {"units": "1"}) for name, column in zip(names, np.asarray(values).T)}
    data |= {
        "n_impacts": ("blow", counts),
        "restitution": ("blow", np.asarray(restitution, float)),
        "double_hit": ("blow", (counts > 1).astype(int)),
        "part": ("blow", np.arange(n) % n_parts),
        "failure": ("blow", np.where(counts < 0, "no luck", "")),
    }
    told = inputs.read_inputs({name: ("lognormal", 1.0, SIGMAS[name]) for name in names})
    return Spread(told, xarray.Dataset(data), 1e-3, n_parts > 1, **rest)


@pytest.mark.parametrize("level", [0.05, 0.5, 0.9])
def test_quantiles_have_the_interval_of_order_statistics(level):
    values = np.random.default_rng(0).normal(size=400)
    found = spread(values).quantile("restitution", level)
    exact = stats.quantile_test(values, p=level).confidence_interval(0.9)
    ranks = np.searchsorted(np.sort(values), [*found[1:], exact.low, exact.high])
    assert abs(ranks[0] - ranks[2]) <= 1 and abs(ranks[1] - ranks[3]) <= 1  # either rounds outwards by a rank
    assert found.value == np.quantile(values, level)


def test_the_chance_of_a_double_hit_has_wilsons_interval():
    found = spread(np.ones(100), counts=np.array([2] * 7 + [1] * 93)).chance()
    z, p, n = stats.norm.ppf(0.95), 0.07, 100
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    assert_allclose(found, (p, middle - half, middle + half), rtol=1e-12)
    none = spread(np.ones(100)).chance()
    assert none.value == none.low == 0.0 and none.high == pytest.approx(z**2 / (n + z**2))


def test_failed_blows_are_left_out_and_counted_and_without_a_result_there_is_no_distribution():
    found = spread([1.0, 2.0, np.nan, 3.0], counts=np.array([1, 1, -1, 1]))
    assert found.n_failed == 1 and found.quantile("restitution", 0.5).value == 2.0
    assert "4 blows, 3 of them independent, 1 failed" in found.summary()
    found = spread([np.nan, np.nan], counts=np.array([-1, -1]))
    for ask in (found.chance, lambda: found.quantile("restitution", 0.5)):
        with pytest.raises(SimulationError, match="no blow succeeded"):
            ask()
    assert "No blow succeeded" in found.summary()


test_questions_name_what_is_known = refusing([
    ("quantile", ("restitutio", 0.5), "did you mean 'restitution'"),
    ("quantile", ("restitution", 2.0), "level must lie"),
    ("ranking", ("a",), "quantity must be one of"),
], lambda question, words: getattr(spread(np.arange(10.0)), question)(*words))  # fmt: skip


def grouped(function, n=2**12):
    """A spread of a function of three lognormal inputs, in groups for Sobol indices."""
    told = inputs.read_inputs({name: ("lognormal", 1.0, sigma) for name, sigma in SIGMAS.items()})
    values = inputs.drawn_inputs(told, inputs.sobol_points(inputs.shares(n, 6, 0)), None)
    return spread(function(*values.T), values=values, n_parts=5, names=tuple(SIGMAS))


def test_sobol_indices_of_a_product_are_those_in_closed_form():
    """Of a product of lognormals, ln of mean square over squared mean is the sum of the squared sigmas."""
    pytest.importorskip("SALib", reason="the spread extra is not installed")
    found = grouped(lambda a, b, c: a * b / c).shares["restitution"]
    whole = sum(sigma**2 for sigma in SIGMAS.values())
    for name, sigma in SIGMAS.items():
        first = np.expm1(sigma**2) / np.expm1(whole)
        total = 1.0 - np.expm1(whole - sigma**2) / np.expm1(whole)
        # 4096 groups of even points: the intervals of independent ones are 0.02 wide at most
        assert_allclose([found[name].first.value, found[name].total.value], [first, total], atol=0.01)
        assert found[name].first.low <= first <= found[name].first.high
        assert found[name].total.low <= total <= found[name].total.high


def test_the_summary_says_what_to_measure_better_with_its_sign():
    pytest.importorskip("SALib", reason="the spread extra is not installed")
    text = grouped(lambda a, b, c: a / b).summary()
    line = next(line for line in text.splitlines() if line.startswith("  restitution"))
    assert line.index("a 7") < line.index("b 3") and " c " not in line
    assert line.split(";")[0].endswith("+") and line.endswith("-")
    assert "restitution: a 100 % (" in grouped(lambda a, b, c: a, n=32).summary()  # estimated at 108 %


def test_a_failed_blow_takes_its_group_out_of_the_sobol_indices():
    pytest.importorskip("SALib", reason="the spread extra is not installed")
    whole = grouped(lambda a, b, c: a * b * c, n=512)
    counts = np.where(np.arange(5 * 512) % 499 == 3, -1, 1)
    bad = whole.table.assign(n_impacts=("blow", counts), restitution=whole.table.restitution.where(counts > 0))
    found = Spread(whole.inputs, bad, 1e-3, True).shares["restitution"]
    for name, share in whole.shares["restitution"].items():
        assert_allclose(found[name].total.value, share.total.value, atol=0.02)


def test_without_sobol_indices_rank_correlations_order_the_inputs():
    rng = np.random.default_rng(0)
    values = rng.normal(size=(2000, 2))
    found = spread(np.exp(values[:, 0]) - 0.1 * values[:, 1], values=values, names=("a", "b"), why_no_shares="no luck")
    (first, share), (second, rest) = found.ranking("restitution")
    assert (first, second) == ("a", "b") and share > 0.9 and rest < 0.05
    rank = stats.spearmanr(values[:, 0], found.values("restitution")).statistic
    assert_allclose(found.correlations["restitution"]["a"], rank, rtol=1e-12)
    assert "square of the rank correlation" in found.summary() and "No Sobol indices: no luck" in found.summary()


def test_impacts_that_vary_are_called_chaotic_and_what_never_changes_needs_no_measurement():
    values = np.linspace(0.1, 0.9, 40)
    found = spread(values, counts=np.array([1, 2, 5, 1] * 10))
    assert found.chaotic and "from 1 to 5: such blows are chaotic" in found.summary()
    assert not spread(values).chaotic
    found = spread(np.full(50, 0.5))
    assert found.varying == () and "Nothing varies" in found.summary()


def test_all_numbers_are_plain_data():
    text = json.dumps(spread(np.linspace(0.0, 1.0, 50)).data())
    assert json.loads(text)["quantities"]["restitution"]["quantiles"]["0.5"]["value"] == 0.5


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
    assert_allclose(one.distribution.ppf(np.array([0.5, stats.norm.cdf(1.0)])), [median, upper], rtol=1e-12)


PAIR = inputs.read_inputs({"a": ("normal", 0.0, 1.0), "b": ("uniform", 0.0, 1.0)})
DISTRIBUTION, CORRELATION = partial(inputs.Input.of, "a"), partial(inputs.correlating_matrix, PAIR)


test_inputs_that_are_none_are_refused = refusing([
    (DISTRIBUTION, ("gaussian", 1.0, 0.1), r"vary\['a'\] must be one of normal, lognormal"),
    (DISTRIBUTION, ("normal", 1.0), r"vary\['a'\] must be normal\(mean, deviation\), got 1 numbers"),
    (DISTRIBUTION, ("normal", 1.0, 0.0), r"deviation of vary\['a'\] must be positive"),
    (DISTRIBUTION, ("lognormal", -1.0, 0.1), r"median of vary\['a'\] must be positive"),
    (DISTRIBUTION, ("uniform", 2.0, 1.0), r"low of vary\['a'\] must be below high, got 2 and 1"),
    (DISTRIBUTION, ("triangular", 0.0, 3.0, 2.0), r"mode of vary\['a'\] must lie between low and high"),
    (DISTRIBUTION, ("loguniform", 0.0, 3.0), r"low of vary\['a'\] must be positive"),
    (DISTRIBUTION, "normal 1 2", r"vary\['a'\] must look like lognormal\(695e3, 0.1\), got 'normal 1 2'"),
    (DISTRIBUTION, "normal(1, b)", r"vary\['a'\] must hold numbers"),
    (DISTRIBUTION, 3.0, r"vary\['a'\] must be a distribution such as"),
    (DISTRIBUTION, ("normal", float("nan"), 1.0), r"mean of vary\['a'\] must be finite"),
    (inputs.read_inputs, {}, "vary must name at least one input"),
    (inputs.read_inputs, None, "vary must name at least one input"),
    (inputs.read_inputs, [("a", "normal(0, 1)")], "vary must name at least one input"),
    (inputs.read_inputs, {3: "normal(0, 1)"}, "vary must map names to distributions"),
    (inputs.read_inputs, {f"a{i}": "normal(0, 1)" for i in range(65)}, "at most 64 inputs"),
    (CORRELATION, {("a", "c"): 0.5}, "correlation must be one of a, b, got 'c'"),
    (CORRELATION, {("a", "a"): 0.5}, "pairs of different names"),
    (CORRELATION, {("a", "b"): 1.5}, "correlation of a and b must"),
    (CORRELATION, {("a", "b"): 1.0}, "must be positive definite"),
    (CORRELATION, [[1.0, 0.5], [0.4, 1.0]], "must be symmetric with ones on its diagonal"),
    (CORRELATION, [[1.0]], "must have shape"),
], lambda read, given: read(given))  # fmt: skip


@pytest.mark.parametrize("given", [{("a", "b"): 0.6}, {("b", "a"): 0.6}, [[1.0, 0.6], [0.6, 1.0]]])
def test_a_gaussian_copula_has_its_rank_correlation(given):
    values = inputs.drawn_inputs(PAIR, inputs.shares(2**14, 2, 0), inputs.correlating_matrix(PAIR, given))
    rank = stats.spearmanr(*values.T).statistic
    assert_allclose(rank, 6.0 / np.pi * np.arcsin(0.3), atol=5e-3)  # Pearson's formula; even points beat 1/sqrt(n)
    assert_allclose(np.quantile(values[:, 1], [0.1, 0.9]), [0.1, 0.9], atol=2e-3)  # margins stay as they were


def test_points_are_repeatable_even_and_inside_the_cube():
    points = inputs.shares(1000, 3, 7)
    np.testing.assert_array_equal(points, inputs.shares(1000, 3, 7))
    assert np.abs(points - inputs.shares(1000, 3, 8)).max() > 0.1
    assert points.min() > 0.0 and points.max() < 1.0
    # of 1024 points of the sequence every slab of 1/16 holds exactly 64
    counts = [np.histogram(column, 16, (0.0, 1.0))[0] for column in inputs.shares(1024, 3, 7).T]
    np.testing.assert_array_equal(counts, 64)
