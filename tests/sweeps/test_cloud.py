"""Blows with values of their own: each against the same blow struck alone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.sweeps import cloud, solving
from fem_impact.sweeps.cells import Case
from fem_impact.sweeps.cloud import Cloud

AT = np.array([0.465, 0.3])
STICK = fi.Striker.stick(0.1, 2e3, n_modes=4)


def base(striker, law):
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=40, damping_ratio=0.01)
    return Case(plate, striker, law, AT, 1.0)


def axes(n=6):
    """Values that change body, striker, law and place at once."""
    rng = np.random.default_rng(3)
    return {
        "stiffness": 1e5 * rng.lognormal(0.0, 0.3, n),
        "mass": 0.05 * rng.lognormal(0.0, 0.3, n),
        "speed": rng.uniform(0.5, 2.0, n),
        "target_mass": 0.2 * rng.lognormal(0.0, 0.3, n),
        "target_frequency": 100.0 * rng.lognormal(0.0, 0.3, n),
        "damping_ratio": rng.uniform(0.0, 0.02, n),
        "at": AT + rng.uniform(-0.05, 0.05, (n, 2)),
    }


@pytest.mark.parametrize("band", [None, 1e3])
@pytest.mark.parametrize("striker", [fi.Striker.rigid(0.05), STICK], ids=["rigid", "stick"])
@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_blows_on_bodies_of_other_frequencies_are_those_struck_alone(striker, loss, band):
    blows = Cloud(base(striker, fi.Contact.power(1e5, 1.3, loss=loss)), axes(), 1e-4, True, band)
    numbers, texts = cloud.solve_all(blows, 1, None, None, None)
    assert texts == {}
    for i in range(blows.n_cases):
        row = solving.numbers_of(blows.blow(i), band)
        assert numbers[0, i] == row[0]
        assert_allclose(numbers[2, i], row[2], atol=2e-4)  # restitution: either run is off by at most 1e-4
        assert_allclose(numbers[[1, 3, 4], i], row[[1, 3, 4]], rtol=2e-4)
        assert_allclose(numbers[6:, i], row[6:], rtol=1e-3)  # the band of the centroid is met up to a 64th of its range


def test_blows_that_cannot_be_followed_together_are_struck_alone():
    law = fi.Contact.layers(1e5, 1.2, depth=2e-4, hard_stiffness=1e7, hard_exponent=1.5)
    blows = Cloud(base(fi.Striker.rigid(0.05), law), {"speed": np.array([0.5, 1.0])}, 1e-2, True, None)
    numbers, _ = cloud.solve_all(blows, 1, None, None, None)
    assert_allclose(numbers.T, [solving.numbers_of(blows.blow(i), None) for i in range(2)], rtol=1e-12)


def test_a_cloud_of_sampled_bodies_gives_the_same_numbers():
    blows = Cloud(base(STICK, fi.Contact.hertz(1e6)), axes(), 1e-3, True, None)
    one, two = (cloud.solve_all(each, 1, None, None, None)[0] for each in (blows, blows.sampled()))
    assert_allclose(one, two, rtol=1e-9)


def test_a_blow_that_fails_says_why_and_leaves_the_others_alone(monkeypatch):
    def refuse(grid_, index):
        raise fi.SimulationError("no luck")

    law = fi.Contact.felt(1e6, 2.0, hysteresis=0.3, relaxation=1e-3)
    monkeypatch.setattr(Cloud, "blow", refuse)
    numbers, texts = cloud.solve_all(
        Cloud(base(fi.Striker.rigid(0.05), law), {"speed": np.ones(2)}, 1e-2, True, None), 1, None, None, None
    )
    assert texts == {0: "no luck", 1: "no luck"} and np.isnan(numbers).all()


def test_few_values_need_kernels_and_means_are_kept():
    many = {name: values for name, values in axes(5000).items() if name in ("target_frequency", "damping_ratio", "at")}
    found = cloud.few(base(STICK, fi.Contact.linear(1e5)), many)
    blows = Cloud(base(STICK, fi.Contact.linear(1e5)), found, 1e-3, True, None)
    assert len(blows.families[1]) <= cloud.FAMILIES
    np.testing.assert_array_equal(found["target_frequency"], many["target_frequency"])  # free, see Cloud
    assert_allclose(found["damping_ratio"].mean(), many["damping_ratio"].mean(), rtol=1e-12)
    assert_allclose(found["at"].mean(axis=0), many["at"].mean(axis=0), rtol=1e-12)
    # four dimensions share 256 families: four levels each, of uniform values at most half a quarter off; 10 % by chance
    assert np.abs(found["damping_ratio"] - many["damping_ratio"]).max() < 1.1 * 0.02 / 4 / 2


def test_a_rigid_striker_on_bodies_of_many_frequencies_needs_one_family():
    rigid = base(fi.Striker.rigid(0.05), fi.Contact.linear(1e5))
    many = {"target_frequency": axes(5000)["target_frequency"]}
    blows = Cloud(rigid, cloud.few(rigid, many), 1e-3, True, None)
    assert len(blows.families[1]) == 1 and np.unique(blows.families[0]).tolist() == [0]


def test_values_that_are_few_already_stay():
    some = {"damping_ratio": np.array([0.0, 0.01, 0.02, 0.01])}
    found = cloud.few(base(STICK, fi.Contact.linear(1e5)), some)
    np.testing.assert_array_equal(found["damping_ratio"], some["damping_ratio"])
