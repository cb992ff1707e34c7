"""Which channel is the force, which are responses, and what they are in SI."""

import numpy as np
import pytest

from fem_impact.taps import channels
from fem_impact.taps.readers import Recording


def recording(names, units):
    return Recording((np.zeros((8, len(names))),), tuple(names), tuple(units), 1e3)


def test_the_force_is_found_by_its_unit_before_its_name():
    found = recording(["Voltage", "Force head", "cell"], ["V", "", "lbf"])
    unit = channels.stated_units(found, None)
    assert channels.force_channel(found, None, unit, "a.csv") == 2
    assert channels.force_channel(found, "head", unit, "a.csv") == 1
    assert channels.response_channels(recording(["F", "a1", "x"], ["N", "", "mm"]), None, ["N", "", "mm"], 0) == [1, 2]


def test_a_name_that_fits_several_channels_is_refused():
    found = recording(["Force 1", "Force 2"], ["N", "N"])
    with pytest.raises(ValueError, match="has several force channels"):
        channels.force_channel(found, None, ["N", "N"], "a.csv")
    with pytest.raises(ValueError, match="fits several channels"):
        channels.find_channel("force", "force", found)


def test_factors_are_to_si_times_the_scale():
    assert channels.factor("F", "kN", "N", None, "a") == (1e3, [])
    assert channels.factor("F", "kN", "N", 2.0, "a") == (2e3, [])
    assert channels.factor("F", "V", "N", 22.5, "a") == (22.5, [])
    assert channels.factor("F", "", "N", None, "a")[1] == ["F: no unit stated, N assumed"]
    with pytest.raises(ValueError, match="scale must be given for 'F'"):
        channels.factor("F", "V", "N", None, "a")
