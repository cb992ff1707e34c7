"""What a fit found: a value for each tap, their spread, predictions, words and numbers."""

import numpy as np
import pytest
from hammer_taps import LAW, MASS, RANGES, fitted, taps_of

import fem_impact as fi
from fem_impact.taps.found import scatter_in_words

FACTORS = (0.85, 1.1, 1.0, 1.25)  # stiffness of each tap over their typical one: no spot is struck twice
SPEEDS = (0.5, 0.7, 0.9, 1.1)


@pytest.fixture(scope="module")
def taps():
    laws = [fi.Contact.power(factor * LAW.stiffness, LAW.exponent) for factor in FACTORS]
    return taps_of(law=laws, speeds=SPEEDS, noise=0.003)


def hertz(taps, per_tap=()):
    return fitted(taps, contact=fi.Contact.hertz(1e7), robust=False, per_tap=per_tap)


@pytest.fixture(scope="module")
def each(taps):
    return hertz(taps, "contact.stiffness")


def test_every_tap_gets_its_own_stiffness_and_the_unknown_is_their_mean(each):
    spread = each.spreads["contact.stiffness"]
    ratios = spread.values / spread.values[2]
    assert np.allclose(ratios, FACTORS, rtol=0.04)  # 0.3 % of noise; 0.012 measured
    assert spread.mean == pytest.approx(np.exp(np.log(spread.values).mean()))
    assert each.point["contact.stiffness"] == each.contact.stiffness == pytest.approx(spread.mean, rel=1e-9)
    assert each.point["contact.stiffness[1]"] == spread.values[1]
    assert spread.deviation == pytest.approx(np.std(np.log(FACTORS), ddof=1), rel=0.1) and spread.relative
    assert spread.chance < 1e-6 and each.per_tap == ("contact.stiffness",)
    assert each.point["striker.mass"] == pytest.approx(MASS, rel=0.03)


def test_one_stiffness_for_all_explains_such_taps_worse(taps, each):
    common = hertz(taps)
    assert common.error > 3.0 * each.error and common.whiteness < 1e-6 < each.whiteness
    worst = [max(one.error for one in made.left_out()) for made in (common, each)]
    assert worst[0] > 3.0 * worst[1]
    assert "a stiffness for each tap (per_tap)" in common.verdict[-1] and "per_tap" not in each.summary()


@pytest.mark.slow
def test_intervals_of_the_mean_and_of_a_single_tap_hold_the_truth(each):
    typical = LAW.stiffness * float(np.exp(np.mean(np.log(FACTORS))))
    for name, truth in (("contact.stiffness", typical), ("contact.stiffness[3]", 1.25 * LAW.stiffness)):
        low, high = each.interval(name, 0.95)
        assert low < truth < high  # this seed's noise
    assert each.profile("contact.stiffness[3]").value == pytest.approx(each.point["contact.stiffness[3]"], rel=1e-9)


def test_words_and_numbers_tell_the_spread(each):
    spread = each.spreads["contact.stiffness"]
    assert scatter_in_words(spread).startswith("differ by 16 % (standard deviation); noise alone")
    assert f"contact.stiffness is the mean of the taps, which {scatter_in_words(spread)}" in each.summary()
    data = each.data()["per_tap"]["contact.stiffness"]
    assert len(data["values"]) == 4 and data["by_noise"] < 0.1 * data["deviation"]


def test_equal_taps_do_not_differ_beyond_the_noise():
    made = hertz(taps_of(speeds=SPEEDS), "contact.stiffness")
    spread = made.spreads["contact.stiffness"]
    assert spread.chance > 0.05 and 0.3 < spread.deviation / spread.by_noise < 3.0  # this seed's noise
    assert "one value for all would do" in scatter_in_words(spread)


@pytest.mark.slow
def test_what_a_tap_has_of_its_own_and_nobody_can_tell_gets_no_number():
    wall = fi.Modes.rigid(1e9)
    laws = [fi.Contact.power(factor * 5e8, 1.7) for factor in FACTORS]
    made = fi.fit(
        taps_of(wall, None, law=laws, speeds=SPEEDS), striker=fi.Striker.rigid(0.1), contact=LAW, starts=2,
        unknown=RANGES | {"contact.stiffness": (1e4, 1e13)}, per_tap=("contact.stiffness",), robust=False,
    )  # fmt: skip
    assert set(made.unidentifiable) == {"contact.stiffness", "striker.mass"}
    assert set(made.values) == {"contact.exponent"}
    assert made.spreads["contact.stiffness"].deviation == pytest.approx(np.std(np.log(FACTORS), ddof=1), rel=0.1)


def test_a_name_that_is_not_unknown_has_no_value_for_each_tap(taps):
    for per_tap, said in (("contact.loss", "be one of"), (3, "be a list of texts")):
        with pytest.raises(ValueError, match=f"per_tap must {said}"):
            hertz(taps, per_tap)
