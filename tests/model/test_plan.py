"""A plan as a user holds it: printed, changed, and the same for the same scene."""

from pathlib import Path

import pytest

import fem_impact as fi

SCENES = Path(__file__).parents[2] / "studies" / "scenes"


@pytest.fixture(scope="module")
def made():
    return fi.plan(SCENES / "drumstick_map.toml", tolerance=1e-2)


def test_the_same_scene_gives_the_same_plan(made):
    assert fi.plan(SCENES / "drumstick_map.toml", tolerance=1e-2).data() == made.data()


def test_a_printed_plan_holds_its_reasons_its_errors_and_their_sum(made):
    text = str(made)
    assert all(reason in text for reason in made.reasons)
    assert made.error == pytest.approx(sum(made.errors.values())) and f"{made.error:.1e}" in text
    assert 0.0 < made.error <= made.tolerance and made.cost in text


def test_a_changed_plan_keeps_earlier_changes_and_none_takes_one_back(made):
    few = made.but(n_modes=30).but(scheme="A")
    assert (few.n_modes, few.scheme, few.tolerance) == (30, "A", 1e-2)
    assert made.n_modes != 30  # the first plan stays
    assert few.errors != made.errors
    back = few.but(n_modes=None, scheme=None)
    assert (back.n_modes, back.scheme) == (made.n_modes, made.scheme)


def test_a_smaller_tolerance_takes_a_larger_model(made):
    fine = made.but(tolerance=1e-4)
    assert fine.n_modes > made.n_modes and fine.dt < made.dt and fine.seconds >= made.seconds
    assert fine.error <= 1e-4
