"""Which channel is the force, which are responses, and what they are in SI."""

import numpy as np
import pytest

from fem_impact.taps import channels, units
from fem_impact.taps.readers import Recording


def recording(names, units):
    return Recording((np.zeros((8, len(names))),), tuple(names), tuple(units), 1e3)


@pytest.mark.parametrize(
    "text, wanted",
    [("N", ("N", 1.0)), ("Newtons", ("N", 1.0)), ("kN", ("N", 1e3)), ("mN", ("N", 1e-3)), ("MN", ("N", 1e6)),
     ("lbf", ("N", 4.4482216152605)), ("g", ("m/s^2", 9.80665)), ("m/s²", ("m/s^2", 1.0)), ("mm/s", ("m/s", 1e-3)),
     ("μm", ("m", 1e-6)), ("mg", ("m/s^2", 9.80665e-3)), ("mV", None), ("furlong", None)],
)  # fmt: skip
def test_known_units(text, wanted):
    assert units.si_unit(text) == wanted


@pytest.mark.parametrize(
    "heading, wanted",
    [("Hammer [mV]", ("Hammer", "mV")), ("Force [N]", ("Force", "N")), ("Hammer (lbf)", ("Hammer", "lbf")),
     ("Force (Trigger)", ("Force (Trigger)", "")), ("Kraft / kN", ("Kraft", "kN")), ("F/kN", ("F", "kN")),
     ("a/(m/s²)", ("a", "m/s²")), ("Zeit in ms", ("Zeit", "ms")), ("Force, lbf", ("Force", "lbf")),
     ("load [kg]", ("load", "kg")), ("velocity m/s", ("velocity m/s", "")), ("m/s", ("m/s", "")),
     ("acc_g", ("acc_g", "g")), ("acc_mg", ("acc_mg", "mg")), ("speed (ips)", ("speed", "ips")),
     ("F_kN", ("F_kN", "kN")), ("hammer_in", ("hammer_in", ""))],
)  # fmt: skip
def test_a_heading_ends_with_its_unit_if_it_holds_one(heading, wanted):
    assert units.label(heading) == wanted


def test_the_force_is_found_by_its_unit_before_its_name_and_is_no_response():
    found = recording(["Voltage", "Force head", "cell"], ["V", "", "lbf"])
    unit = channels.stated_units(found, None)
    assert channels.force_channel(found, None, unit, "a.csv") == 2
    assert channels.force_channel(found, "head", unit, "a.csv") == 1
    assert channels.response_channels(recording(["F", "a1", "x"], ["N", "", "mm"]), None, ["N", "", "mm"], 0) == [1, 2]
    found = recording(["Force", "a"], ["N", "g"])
    with pytest.raises(ValueError, match=r"response must name other channels than the force, got \['a', 'Force'\]"):
        channels.response_channels(found, ["a", "Force"], ["N", "g"], 0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_forces_are_turned_around_by_their_taps_and_not_by_their_offset(sign):
    force = np.pad([[20.0], [80.0], [30.0]], ((20, 20), (0, 0))) - 60.0
    found = Recording((sign * force,), ("Force",), ("N",), 1e3)
    ((pushed, _),), *_, notes = channels.in_si(found, "a.csv", None, None, None, None)
    assert pushed.tolist() == force[:, 0].tolist() and bool(notes) == (sign < 0.0)


def test_factors_are_to_si_times_the_scale():
    assert channels.factor("F", "kN", "N", 2.0, "a") == (2e3, [])
    assert channels.factor("F", "", "N", None, "a") == (1.0, ["F: no unit stated, N assumed"])


def test_what_is_not_read_or_has_an_unknown_unit_is_said():
    force = np.pad([[20.0], [80.0], [30.0]], ((20, 20), (0, 0)))
    found = Recording((np.tile(force, 4),), ("F", "accel", "acc [furlong]", "Voltage"), ("N", "Foos", "", "V"), 1e3)
    _, names, kinds, notes = channels.in_si(found, "a.csv", None, None, None, None)
    assert (names, kinds) == (["acc [furlong]"], ["m/s^2"])
    assert notes == [
        "accel: not read, as 'Foos' is no known unit of motion; give units, or response and scale",
        "acc [furlong]: no known unit stated, m/s^2 assumed",
    ]
    assert not channels.in_si(found, "a.csv", None, (), None, None)[3]


def test_a_scale_of_zero_is_refused():
    with pytest.raises(ValueError, match="scale must not be zero"):
        channels.in_si(recording(["Force"], ["N"]), "a.csv", None, None, 0.0, None)
