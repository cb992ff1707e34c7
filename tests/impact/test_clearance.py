"""The smallest gap after the first impact: where a second follows, and its derivatives."""

import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.impact import clearance

PLATE = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=20)
NUMBERS = {"striker.mass": 0.05, "contact.stiffness": 1e5, "strike.speed": 0.8, "strike.x": 0.13, "target.mass": 0.2}


def struck(numbers, **how):
    plate = PLATE.scaled(mass=numbers["target.mass"])
    law = fi.Contact.linear(numbers["contact.stiffness"])
    at, speed = (numbers["strike.x"], 0.1), numbers["strike.speed"]
    return fi.strike(plate, fi.Striker.rigid(numbers["striker.mass"]), law, at=at, speed=speed, **how)


def test_it_is_below_zero_where_a_second_impact_follows():
    signs = set()
    for mass in (0.01, 0.02, 0.03, 0.05, 0.1, 0.2):
        for stiffness in (1e4, 1e5):
            numbers = NUMBERS | {"striker.mass": mass, "contact.stiffness": stiffness}
            again = struck(numbers, tolerance=1e-3).n_impacts > 1
            assert (clearance.nearest_clearance(struck(numbers, tolerance=1e-4, max_impacts=1))[0] < 0.0) == again
            signs.add(again)
    assert signs == {True, False}


def test_a_ball_leaves_a_wall_for_good():
    law = fi.Contact.linear(1e5)
    hit = fi.strike(fi.Modes.rigid(1e6), fi.Striker.rigid(0.1), law, at=None, speed=1.0, max_impacts=1)
    assert clearance.nearest_clearance(hit) == (clearance.FAR, None)
    assert not clearance.slopes(hit, ("striker.mass",), {}).any()


@pytest.mark.parametrize("stiffness", [1e5, 1e6])  # a near miss, and so deep an overlap that its logarithm is told
def test_its_derivatives_are_differences(stiffness):
    numbers, names = NUMBERS | {"contact.stiffness": stiffness}, tuple(NUMBERS)
    hit = struck(numbers, tolerance=1e-8, max_impacts=1)
    found = clearance.slopes(hit, names, {})
    assert clearance.nearest_clearance(hit)[1] is not None
    for name, slope in zip(names, found):
        sides = [numbers | {name: numbers[name] * (1.0 + side * 1e-4)} for side in (-1.0, 1.0)]
        low, high = (clearance.nearest_clearance(struck(side, tolerance=1e-8, max_impacts=1))[0] for side in sides)
        # differences of second order of blows told to 1e-8
        assert_allclose(slope * numbers[name], (high - low) / 2e-4, rtol=1e-5, atol=2e-4, err_msg=name)


def test_a_run_that_goes_on_has_none():
    with pytest.raises(fi.SimulationError, match=r"must end with its first impact; give max_impacts = 1$"):
        clearance.nearest_clearance(struck(NUMBERS, tolerance=1e-3))
    clearance.nearest_clearance(struck(NUMBERS, tolerance=1e-3, max_impacts=1))
