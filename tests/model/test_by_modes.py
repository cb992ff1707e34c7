"""A target by its modes: what the errors of a blow ask of them."""

from types import SimpleNamespace

import pytest

import fem_impact as fi
from fem_impact.impact.response import Error
from fem_impact.model.planner import Blow
from fem_impact.model.target import Stages, Target

SPRUCE = fi.Plate(fi.Material(10e9, 0.3, 450.0), 3e-3)


def modal(tolerance=1e-2, **of_target):
    """A hinged plate by its modes, as planned for a tolerance."""
    target = Target(fi.mesh.rectangle(0.4, 0.3), SPRUCE, {"boundary": "hinged"}, damping_ratio=0.01, **of_target)
    blow = Blow(target, fi.Striker.rigid(0.02), fi.Contact.hertz(1e7), {"at": (0.13, 0.1), "speed": 1.0})
    return blow.plan(tolerance=tolerance, target="modal").description


def after(description, **errors):
    """What a blow of these errors asks for."""
    return description.refined(
        SimpleNamespace(error=Error(**{"step": 0.0, "truncation": 0.0, "mesh": 0.0} | errors)), Stages()
    )


@pytest.mark.parametrize(("truncation", "more"), [(4e-5, False), (6e-5, True)])
def test_more_modes_are_taken_if_those_left_out_err_more_than_their_share(truncation, more):
    first = modal(tolerance=1e-4)
    better = after(first, truncation=truncation)
    assert (better is not None) == more
    if more:
        ratio = better.forecast.n_modes / first.forecast.n_modes
        assert ratio == pytest.approx(4.0 ** (1.0 / 3.0), rel=0.02)  # the error goes as the cube of the cutoff


def test_the_air_gets_more_modes_each_time_it_errs_too_much():
    first = modal(air="both sides")
    second = after(first, mesh=2e-2)
    third = after(second, mesh=1.2e-2)
    numbers = [each.forecast.n_modes for each in (first, second, third)]
    assert numbers[1] / numbers[0] == pytest.approx(2.0 / 0.9, rel=0.05)  # as its error is to fall, below the tolerance
    assert numbers[2] / numbers[1] == pytest.approx(1.2 / 0.9, rel=0.05)


def test_three_attempts_are_enough():
    third = after(after(modal(), truncation=1e-2), truncation=1e-2)
    assert after(third, truncation=1e-2) is None
