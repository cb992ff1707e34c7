"""Measured numbers beside the bands of the program: how wide they are, what is inside, what is said of the rest."""

import numpy as np
import pytest
from comparing import refusing

import fem_impact as fi
from fem_impact.impact.measured import Measured, Predicted, compare

WALL, BALL, SPRING = fi.Modes.rigid(1e3), fi.Striker.rigid(0.1), fi.Contact.linear(4e6)


def made(value, predicted, error=0.0):
    return compare((Measured("time", value, error, "s"),), predicted).verdicts[0]


def test_a_band_holds_nine_tenths_of_what_may_be_read():
    """Errors of 3 and 4 % add to 5 %, of which nine tenths lie within 1.645 deviations."""
    rng = np.random.default_rng(3)
    found = made(1.0, Predicted(1.0 + 0.03 * rng.standard_normal((40_000, 1)), model=0.04))
    assert found.inside and found.width == pytest.approx(1.645 * 0.05, rel=0.03)  # 1 / sqrt(40 000) of noise, and tails
    assert not made(1.09, Predicted(np.ones((40_000, 1)), model=0.05)).inside
    assert made(1.09, Predicted(np.ones((40_000, 1)), computation=0.101)).inside  # nine tenths of a uniform error
    assert made(1.0, Predicted(np.ones((1, 1))), error=0.02).width == pytest.approx(0.02, rel=0.03)  # 20 000 draws


def test_each_number_has_its_own_errors_and_what_they_are_relative_to():
    points = (Measured("restitution", 0.1, 0.0, ""), Measured("time", 0.1, 0.0, "s"))
    one, two = compare(points, Predicted(np.full((1, 2), 0.1), model=np.array([0.01, 0.02]), size=[1.0, 0.1])).verdicts
    assert one.width == pytest.approx(5.0 * two.width, rel=0.05)  # 0.01 of one, 0.02 of a tenth; 20 000 draws each


def test_how_far_outside_a_number_lies_is_said():
    above, below = (made(value, Predicted(np.ones((1, 1)), computation=0.1)) for value in (2.0, 0.5))
    assert above.beyond == pytest.approx((2.0 - 1.09) / 2.0, rel=1e-2) and "% above the band" in above.said
    assert below.beyond == pytest.approx((0.5 - 0.91) / 0.5, rel=1e-2) and "% below the band" in below.said
    assert made(1.0, Predicted(np.ones((1, 1)), computation=0.1)).beyond == 0.0


def test_a_blow_is_held_against_what_was_measured_of_it():
    """The wall weighs 10 000 hammers: half a period of the reduced mass is the contact time."""
    hit = fi.strike(WALL, BALL, SPRING, at=None, speed=1.0)
    exact = np.pi * np.sqrt(0.1 / (1.0 + 1e-4) / 4e6)
    found = hit.against({"contact_time": (exact, 0.01 * exact), "restitution": 0.5, "n_impacts": 1})
    assert [each.inside for each in found.verdicts] == [True, False, True] and found.n_inside == 2
    assert found["contact time"].width == pytest.approx(0.01, rel=0.05)  # the computation adds 1e-4 of its own
    assert "2 of 3" in str(found) and "below the band" in str(found) and "2 of 3" in found._repr_html_()
    assert found.explained({"restitution": "glue"})["restitution"].reason == "glue"


def test_what_is_not_known_of_the_model_is_said():
    plate = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), 1e-3)
    sheet = fi.analytic.rectangle(0.6, 0.4, section=plate, n_modes=30, damping_ratio=0.01)
    hit = fi.strike(sheet, fi.Striker.rigid(0.05), fi.Contact.hertz(1e4), at=(0.2, 0.15), speed=0.5, tolerance=1e-2)
    unknown = hit.trust["contact_time"].unknown
    said = hit.against({"contact_time": hit.contact_time}).notes
    assert len(said) == bool(unknown) and all(name in "".join(said) for name in unknown)


test_measured_numbers_are_checked = refusing([
    ({}, "must map one or more of restitution, impulse"),
    (3.0, "must map one or more of restitution, impulse"),
    ({"length": 1.0}, "measured must be one of"),
    ({"force": (1.0, 2.0, 3.0)}, r"must be a value, or \(value, half width"),
    ({"force": 0.0}, r"must be a value, or \(value, half width"),
    ({"force": (1.0, -1.0)}, "error of measured force must not be negative"),
], lambda measured: fi.strike(WALL, BALL, SPRING, at=None, speed=1.0).against(measured))  # fmt: skip
