"""Quantities a user can ask of a blow: how they may be named, and what is refused."""

from comparing import refusing

from fem_impact.impact.quantities import BANDED, QUANTITIES, USUAL, asked_for


def test_quantities_may_be_named_in_three_ways():
    assert asked_for("spectrum=5000") == asked_for(["spectrum=5e3"]) == asked_for({"spectrum": 5000})
    assert asked_for(["force", "sound=8000"]) == {"force": None, "sound": 8000.0}
    assert asked_for(None) == USUAL and set(USUAL) | set(BANDED) == set(QUANTITIES)


test_wrong_quantities_are_told = refusing([
    ("spectrum", r"quantity spectrum needs a frequency, such as 'spectrum=5000'"),
    ("force=5", r"quantity force has no frequency, write 'force'"),
    ({"spectrum": -1.0}, "frequency of spectrum must be positive, got -1 Hz"),
    ("sound=loud", "frequency of sound must be a number in Hz, got 'loud'"),
    ("forse", "did you mean 'force'"),
    ([], "quantity must name one of restitution, .*got none"),
    (5, "quantity must be names of restitution, .*got 5"),
    ([5], "quantity must be names of restitution, .*got 5"),
], asked_for)  # fmt: skip
