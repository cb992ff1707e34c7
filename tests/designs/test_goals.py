"""What can be wanted, and what is refused with the rule and the value."""

import numpy as np
from comparing import refusing
from numpy.testing import assert_allclose

from fem_impact.designs import goals


def test_values_and_ranges_miss_by_what_lies_outside():
    wanted = {"mode1.frequency": 440.0, "contact_time": (None, 2e-3), "restitution": (0.2, 0.4)}
    value, below, between = goals.read_goals(wanted, ("",))
    assert value.low == value.high and below.low != below.high
    assert_allclose([value.miss(444.4), value.miss(435.6)], [0.01, -0.01])
    assert_allclose([below.miss(1e-3), below.miss(3e-3)], [0.0, 0.5])
    assert_allclose([between.miss(0.1), between.miss(0.3), between.miss(0.5)], [-0.1, 0.0, 0.1])  # absolute
    assert (value.unit, below.unit, between.unit) == ("Hz", "s", "")
    assert below.words == "at most 0.002 s" and between.words == "at least 0.2 and at most 0.4"
    (level,) = goals.read_goals({"spectral_level=800": (-10.0, None)}, ("",))  # levels miss as their forces
    assert_allclose(level.miss(-10.0 - 20.0 * np.log10(1.01)), -np.log(1.01))  # one per cent


def test_goals_hold_for_each_blow_or_for_one():
    wanted = {"mode2.ratio": 4.0, "impulse": 1.0, "loud": {"spectral_centroid=5000": 900.0}}
    found = goals.read_goals(wanted, ("soft", "loud"))
    labels = ["mode2.ratio", "soft: impulse", "loud: impulse", "loud: spectral_centroid=5000"]
    assert [goal.label for goal in found] == labels
    assert found[0].ratio and found[0].mode == 2 and found[3].mode == 0


def test_one_impact_is_wanted_as_a_clearance():
    (found,) = goals.read_goals({"n_impacts": 1}, ("",))
    assert found.name == "clearance" and found.low == goals.CLEAR and found.high == np.inf
    assert found.miss(0.5) == 0.0 and found.miss(-0.5) == -0.5 - goals.CLEAR


test_what_cannot_be_wanted_is_said = refusing([
    ({}, "wanted must name at least one quantity"),
    ([("impulse", 1.0)], "wanted must be a dict of names"),
    ({"impuls": 1.0}, "wanted must be one of .*'impuls'"),
    ({"impulse": (2.0, 1.0)}, r"wanted\['impulse'\] must be a range \(low, high\), got \(2, 1\)"),
    ({"contact_time": -1.0}, r"wanted\['contact_time'\] must not be negative, got -1; nothing could meet it"),
    ({"impulse": (None, None)}, "must be a number or a range .* None leaves an end open"),
    ({"impulse": np.nan}, r"wanted\['impulse'\]"),
    ({"impulse=5": 1.0}, "impulse has no frequency, write 'impulse'"),
    ({"spectral_centroid": 1.0}, "needs a frequency, such as 'spectral_centroid=5000'"),
    ({"loud": {"impulse": 1.0}}, "the blow in wanted must be one of"),
    ({"n_impacts": 2}, r"wanted\['n_impacts'\] must be 1, the only count"),
], lambda wanted: goals.read_goals(wanted, ("",)))  # fmt: skip
