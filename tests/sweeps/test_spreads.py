"""Statistics of uncertain blows: against binomial laws and Sobol indices in closed form."""

import json

import numpy as np
import pytest
import xarray
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


def test_intervals_of_quantiles_hold_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(1)
    hits = 0
    for _ in range(400):
        found = spread(rng.normal(size=60)).quantile("restitution", 0.5)
        hits += found.low <= 0.0 <= found.high
    assert hits / 400 > 0.9 - 3.0 * (0.9 * 0.1 / 400) ** 0.5  # three standard deviations of the count


def test_the_chance_of_a_double_hit_has_wilsons_interval():
    counts = np.array([2] * 7 + [1] * 93)
    found = spread(np.ones(100), counts=counts).chance()
    z, p, n = stats.norm.ppf(0.95), 0.07, 100
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    assert_allclose(found, (p, middle - half, middle + half), rtol=1e-12)
    none = spread(np.ones(100)).chance()
    assert none.value == none.low == 0.0 and none.high == pytest.approx(z**2 / (n + z**2))


def test_failed_blows_are_left_out_and_counted():
    found = spread([1.0, 2.0, np.nan, 3.0], counts=np.array([1, 1, -1, 1]))
    assert found.n_failed == 1 and found.quantile("restitution", 0.5).value == 2.0
    assert "4 blows, 3 of them independent, 1 failed" in found.summary()


def test_without_a_single_result_there_is_no_distribution():
    found = spread([np.nan, np.nan], counts=np.array([-1, -1]))
    for ask in (found.chance, lambda: found.quantile("restitution", 0.5)):
        with pytest.raises(SimulationError, match="no blow succeeded"):
            ask()
    assert "No blow succeeded" in found.summary()


def test_questions_name_what_is_known():
    found = spread(np.arange(10.0))
    with pytest.raises(ValueError, match="did you mean 'restitution'"):
        found.quantile("restitutio", 0.5)
    with pytest.raises(ValueError, match="level must lie"):
        found.quantile("restitution", 2.0)
    with pytest.raises(ValueError, match="quantity must be one of"):
        found.ranking("a")


def grouped(function, n=2**12):
    """A spread of a function of three lognormal inputs, in groups for Sobol indices."""
    told = inputs.read_inputs({name: ("lognormal", 1.0, sigma) for name, sigma in SIGMAS.items()})
    values = inputs.drawn(told, inputs.crossed(inputs.shares(n, 6, 0)), None)
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


def test_sobol_indices_of_a_sum_are_shares_of_the_variance():
    pytest.importorskip("SALib", reason="the spread extra is not installed")
    found = grouped(lambda a, b, c: np.log(a) + np.log(b)).shares["restitution"]
    assert_allclose([found[k].first.value for k in SIGMAS], [9 / 13, 4 / 13, 0.0], atol=0.01)
    assert_allclose([found[k].total.value for k in SIGMAS], [9 / 13, 4 / 13, 0.0], atol=0.01)
    assert found["c"].total.value == 0.0  # exactly: no blow changes with it


def test_the_summary_says_what_to_measure_better_with_its_sign():
    pytest.importorskip("SALib", reason="the spread extra is not installed")
    text = grouped(lambda a, b, c: a / b).summary()
    line = next(line for line in text.splitlines() if line.startswith("  restitution"))
    assert line.index("a 7") < line.index("b 3") and " c " not in line
    assert line.split(";")[0].endswith("+") and line.endswith("-")


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


def test_impacts_that_vary_are_called_chaotic():
    counts = np.array([1, 2, 5, 1] * 10)
    found = spread(np.linspace(0.1, 0.9, 40), counts=counts)
    assert found.chaotic and "from 1 to 5: such blows are chaotic" in found.summary()
    assert not spread(np.linspace(0.1, 0.9, 40)).chaotic


def test_what_never_changes_needs_no_measurement():
    found = spread(np.full(50, 0.5))
    assert found.varying == () and "Nothing varies" in found.summary()


def test_all_numbers_are_plain_data():
    text = json.dumps(spread(np.linspace(0.0, 1.0, 50)).data())
    assert json.loads(text)["quantities"]["restitution"]["quantiles"]["0.5"]["value"] == 0.5
