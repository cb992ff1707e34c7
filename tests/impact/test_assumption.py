from dataclasses import replace

import pytest

from fem_impact.impact import assumption
from fem_impact.impact.assumption import Assumption

USUAL = ("restitution", "force")


def make(effect, value=0.1, limit=0.2, unknown="", name="thin target"):
    return Assumption(name, value, limit, effect, USUAL, "use a thicker theory", "thickness over wave", unknown)


WELL = make({"restitution": 1e-6, "force": 3e-6})
UNKNOWN = make(dict.fromkeys(USUAL), None, unknown="the thickness", name="still air")


@pytest.mark.parametrize(("found", "enough", "line"), [
    ([WELL, WELL], 1e-4, "the model holds to better than 1e-4"),
    # never less than the sum, 2.4e-4
    ([make({"restitution": 8e-5, "force": 0.0})] * 3, 1e-2, "the model holds to better than 1e-3"),
    # what is not known is said even if the rest is well
    ([WELL, UNKNOWN], 1e-4, "it is not known whether the model holds: still air (the thickness): use a thicker theory"),
    ([WELL, replace(UNKNOWN, stated=True)], 1e-4, "the model holds to better than 1e-4, with the contact as stated"),
    ([make({}, 0.1, name="still air")], 1e-4, "no assumption of the model is expected to fail"),
])  # fmt: skip
def test_one_line_says_how_far_the_model_holds(found, enough, line):
    assert assumption.lines(found, enough) == [line]


def test_an_assumption_that_matters_gets_a_line_with_its_number_its_limit_and_the_remedy():
    head, line = assumption.lines([make({"restitution": 0.01, "force": 0.03}, 0.3), WELL], 1e-3)
    assert head == "the model holds to 0.03"
    assert line == (
        "thin target: thickness over wave 0.3; it usually matters above 0.2; here it changes the peak force by about "
        "3 %; use a thicker theory"
    )


def test_a_large_effect_is_beyond_the_estimate():
    large = make({"restitution": 0.4, "force": 0.03}, 1.0)
    assert large.beyond and large.state == "beyond this estimate"
    head, line = assumption.lines([large], 1e-3)
    wrong = "the model is wrong here: thickness over wave 1, which changes the restitution by about 0.4: "
    assert head == wrong + "use a thicker theory"
    assert "restitution by about 0.4, beyond this estimate" in line


def test_a_number_beyond_its_limit_is_said_even_if_it_changes_little_and_before_the_blow_nothing_else_is_known():
    assert len(assumption.lines([make({"restitution": 1e-7, "force": 0.0}, 2.0)], 1e-4)) == 2
    foreseen = [make({}, 0.5), make({}, 0.1, name="still air")]
    head, line = assumption.lines(foreseen, 1e-4)
    assert head == "the model is doubtful here: thin target"
    assert line.startswith("thin target: thickness over wave 0.5; it usually matters above 0.2")
    assert foreseen[0].state == "foreseen"


def test_total_adds_what_is_done_to_each_quantity_and_takes_the_largest():
    found = [WELL, make({"restitution": 0.01, "force": 0.002}), make({"restitution": 0.0, "force": 0.005}), UNKNOWN]
    assert assumption.total(found) == pytest.approx(0.010001)
