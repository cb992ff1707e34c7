"""What a change of the bodies does to a blow tells the errors of its modes."""

import numpy as np
import pytest
from test_collision import left_out, thin_plate_blow

import fem_impact as fi


@pytest.mark.parametrize("seed", [0, 2, 4, 8, 12, 14, 16, 21])
def test_error_of_leaving_out_modes_is_neither_below_the_true_one_nor_far_above(seed):
    told, true = left_out(seed)
    assert true < told < 4.0 * true  # 1.2 to 2.7 times it were measured


@pytest.mark.parametrize("seed", [55, 105, 123, 151, 183, 206, 274])
def test_runs_that_agree_by_chance_do_not_hide_the_modes_left_out(seed):
    told, true = left_out(seed)
    assert 0.5 * true < told < 3.0 * true  # 0.6 to 1.4 times it were measured; 0.3 to 10 are promised


def test_a_number_of_impacts_that_the_modes_left_out_may_change_is_doubted_aloud():
    """Forty modes of a plate see one impact, all modes two; a spring for the others does not decide it."""
    plate, how, blow = thin_plate_blow()
    few, many = (fi.strike(plate(n), *how, **blow, tolerance=1e-2) for n in (40, 3000))
    assert few.n_impacts == 1 and many.n_impacts == 2
    assert many.tolerance_met and not few.tolerance_met
    assert "number of impacts cannot be determined" in few.verdict or "modes" in few.verdict
    averaged = fi.strike(plate(40), *how, **blow, tolerance=1e-2, quantity="impulse")
    assert averaged.error.total < few.error.total  # what does not ask for the number is not told to doubt it


def test_contact_the_modes_cannot_resolve_says_so():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=30)
    hit = fi.strike(plate, fi.Striker.rigid(0.02), fi.Contact.linear(1e7), at=(0.465, 0.31), speed=1.0, max_impacts=1)
    assert not hit.error.resolvable
    assert hit.error.total == np.inf
    assert "not resolvable" in hit.summary()
