"""Shares of a tolerance."""

import pytest

from fem_impact.impact.accuracy import LOSSY
from fem_impact.impact.response import Error
from fem_impact.model.budget import Budget


def test_model_steps_and_mesh_together_take_the_tolerance():
    budget = Budget(1e-3)
    assert 2.0 * budget.half + budget.cheap == pytest.approx(budget.total, rel=1e-12)
    assert budget.left_out < budget.half  # an estimate before the blow needs room


def test_left_out_modes_may_err_less_under_a_lossy_contact_and_after_each_failure():
    plain = Budget(1e-3).left_out
    assert plain / Budget(1e-3, lossy=True).left_out == pytest.approx(LOSSY, rel=1e-12)
    assert plain / Budget(1e-3, margin=4.0).left_out == pytest.approx(4.0, rel=1e-12)


@pytest.mark.parametrize(("model", "follow", "missed"), [(0.9, True, False), (0.9, False, True), (1.1, True, True)])
def test_a_blow_misses_what_finer_steps_cannot_mend(model, follow, missed):
    error = Error(step=0.3e-3, truncation=model * 1e-3, mesh=0.0)
    assert Budget(1e-3).missed(error, follow) == missed
