"""Estimated errors: a table by cause and quantity, its largest numbers, and their sum."""

import numpy as np
import pytest

from fem_impact.impact.error import CAUSES, Error

ASKED = "restitution", "force"
FOUND = {"step": np.array([1e-5, 4e-5, 9.0, 9.0]), "truncation": np.array([3e-4, 1e-4, 9.0, 9.0])}  # as of `of_runs`


def test_each_cause_counts_by_its_largest_quantity():
    error = Error.of_causes(FOUND, ASKED, True, 2.0)
    assert (error.step, error.truncation, error.mesh, error.sensitivity) == (4e-5, 3e-4, 0.0, 2.0)
    assert error.total == float(error) == pytest.approx(3.4e-4) and error.dominant == ("modes left out", 3e-4)


def test_each_quantity_has_its_own_sum_and_causes_without_a_table_count_in_full():
    error = Error.of_causes(FOUND, ASKED, True, 1.0)
    assert error.of_quantity("force") == pytest.approx(1.4e-4)
    assert error.parts("restitution")["time steps"] == 1e-5
    rest = {cause: 1e-3 for cause in CAUSES if cause not in FOUND}
    more = Error(**rest, step=4e-5, truncation=3e-4, table=error.table)
    assert more.of_quantity("force") == pytest.approx(4.14e-3)
    assert Error(1e-3, 0.0, 0.0).of_quantity("force") == 1e-3


def test_no_estimate_holds_where_modes_left_out_govern_the_contact():
    error = Error.of_causes(FOUND, ASKED, False, 1.0)
    assert error.total == error.of_quantity("force") == float("inf")
