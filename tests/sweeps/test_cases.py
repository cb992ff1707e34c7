"""A table of blows: each against the same blow struck alone, whatever is computed with it, and failures are told."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import fem_impact as fi
from fem_impact.sweeps import cases, cells
from fem_impact.sweeps.cases import Cases
from fem_impact.sweeps.cells import Case

AT = np.array([0.465, 0.3])
STICK, RIGID = fi.Striker.stick(0.1, 2e3, n_modes=4), fi.Striker.rigid(0.05)


def rows(striker, law, axes, tolerance=1e-3, **wanted):
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=40, damping_ratio=0.01)
    return Cases(Case(plate, striker, law, AT, 1.0), axes, tolerance, **{"by_row": True, **wanted})


def drawn(n=6, *names):
    """Values that change body, striker, law and place at once, or some of them."""
    rng = np.random.default_rng(3)
    found = {
        "stiffness": 1e5 * rng.lognormal(0.0, 0.3, n), "mass": 0.05 * rng.lognormal(0.0, 0.3, n),
        "speed": rng.uniform(0.5, 2.0, n), "target_mass": 0.2 * rng.lognormal(0.0, 0.3, n),
        "target_frequency": 100.0 * rng.lognormal(0.0, 0.3, n), "damping_ratio": rng.uniform(0.0, 0.02, n),
        "at": AT + rng.uniform(-0.05, 0.05, (n, 2)),
    }  # fmt: skip
    return {name: found[name] for name in names or found}


@pytest.mark.parametrize(
    ("striker", "loss", "band"), [(RIGID, 0.0, 1e3), (RIGID, 0.2, None), (STICK, 0.0, None), (STICK, 0.2, 1e3)]
)
def test_blows_on_bodies_of_other_frequencies_are_those_struck_alone(striker, loss, band):
    blows = rows(striker, fi.Contact.power(1e5, 1.3, loss=loss), drawn(), 1e-4, band=band)
    numbers, texts = cases.solve_all(blows, 1)
    assert texts == {}
    for i in range(blows.n_cases):
        row = blows.row(blows.blow(i))
        assert numbers[0, i] == row[0]
        assert_allclose(numbers[2, i], row[2], atol=2e-4)  # restitution: either run is off by at most 1e-4
        assert_allclose(numbers[[1, 3, 4], i], row[[1, 3, 4]], rtol=2e-4)
        assert_allclose(numbers[8:, i], row[8:], rtol=1e-3)  # the band of the centroid is met up to a 64th of its range


def test_blows_that_cannot_be_followed_together_are_struck_alone():
    law = fi.Contact.layers(1e5, 1.2, depth=2e-4, hard_stiffness=1e7, hard_exponent=1.5)
    blows = rows(RIGID, law, {"speed": np.array([0.5, 1.0])}, 1e-2)
    numbers, _ = cases.solve_all(blows, 1)
    assert_allclose(numbers.T, [blows.row(blows.blow(i)) for i in range(2)], rtol=1e-12)


def test_sampled_bodies_give_the_same_numbers():
    blows = rows(STICK, fi.Contact.hertz(1e6), drawn())
    one, two = (cases.solve_all(each, 1)[0] for each in (blows, blows.sampled()))
    assert_allclose(one, two, rtol=1e-9)  # the same numbers but for rounding in the compliance
    one, two = (each.row(each.blow(1)) for each in (blows, blows.sampled()))
    assert_allclose(one, two, rtol=1e-9)


def test_a_blow_that_fails_says_why_and_leaves_the_others_alone(monkeypatch):
    def fail(modes, striker, contact, **wanted):
        if contact.exponent < 0.8:
            raise fi.SimulationError("the motion may be chaotic")
        return fi.strike(modes, striker, contact, **wanted)

    monkeypatch.setattr(cells, "strike", fail)
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=40)
    bodies = plate, fi.Striker.rigid(0.1), fi.Contact.linear(1e5)
    table = fi.sweep(*bodies, at=AT, speed=1.0, over={"exponent": [0.9, 0.7]})
    assert table.failure.values.tolist() == ["", "the motion may be chaotic"]
    assert table.n_impacts.values.tolist() == [2, -1]
    assert np.isnan(table.restitution.values).tolist() == [False, True]


def test_a_block_is_the_same_from_any_start():
    """Combined or by row, also where a blow is struck alone: the fourth, with an exponent below 1."""
    table = rows(RIGID, fi.Contact.linear(1e5), {"exponent": np.array([1.0, 1.2, 1.5, 0.9])})
    whole, _ = cases.solve_all(table)
    for by_row in (True, False):
        for start in range(4):
            found = rows(RIGID, fi.Contact.linear(1e5), table.axes, by_row=by_row)
            assert_allclose(cases.solve_cases(found, start, 4)[0], whole[:, start:], rtol=1e-9)  # order of sums


def test_few_values_need_kernels_and_means_are_kept():
    many = rows(STICK, fi.Contact.linear(1e5), drawn(5000, "target_frequency", "damping_ratio", "at"))
    blows = cases.fewer_values(many)
    found, given = blows.axes, many.axes
    assert len(blows.pairs[1]) <= cases.FAMILIES
    assert_array_equal(found["target_frequency"], given["target_frequency"])  # free, see Cases
    assert_allclose(found["damping_ratio"].mean(), given["damping_ratio"].mean(), rtol=1e-12)
    assert_allclose(found["at"].mean(axis=0), given["at"].mean(axis=0), rtol=1e-12)
    # four dimensions share 256 families: four levels each, of uniform values at most half a quarter off; 10 % by chance
    assert np.abs(found["damping_ratio"] - given["damping_ratio"]).max() < 1.1 * 0.02 / 4 / 2


def test_a_rigid_striker_on_bodies_of_many_frequencies_needs_one_family_and_few_values_stay():
    blows = cases.fewer_values(rows(RIGID, fi.Contact.linear(1e5), drawn(5000, "target_frequency")))
    assert len(blows.pairs[1]) == 1 and np.unique(blows.pairs[0]).tolist() == [0]
    some = np.array([0.0, 0.01, 0.02, 0.01])
    few = cases.fewer_values(rows(STICK, fi.Contact.linear(1e5), {"damping_ratio": some}))
    assert_array_equal(few.axes["damping_ratio"], some)


def test_speed_scales_no_blow_that_begins_pressed():
    """Under a preload, a linear contact at another speed moves otherwise, also where the gap is an axis."""
    law, over = fi.Contact.linear(1e5), {"gap": np.array([-1e-4, 0.0]), "speed": np.array([0.2, 1.0])}
    whole = rows(RIGID, law, over, by_row=False)
    assert whole.without_speed() is None
    table = fi.sweep(whole.base.modes, RIGID, law, at=AT, speed=1.0, over=over)
    one, two = table.restitution.values
    assert abs(one[0] - one[1]) > 1e-2 and abs(two[0] - two[1]) < 1e-3
