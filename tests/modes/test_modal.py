"""Modes as the description of a body: kept, scaled and described less well."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi


def test_modes_survive_a_pickle():
    plate = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 2e-3)
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(1.0, 1.0, size=0.25), plate), n_modes=6)
    again = pickle.loads(pickle.dumps(modes))
    assert_allclose(again.residual_compliance([(0.3, 0.3)]), modes.residual_compliance([(0.3, 0.3)]), rtol=1e-12)


def test_poorer_descriptions_are_listed_by_all_that_they_lack_and_change_with_the_body():
    whole = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=9)
    both, fewer = whole.truncated(n_modes=3), whole.truncated(n_modes=5)
    body = replace(whole, poorer={"mesh": replace(whole, poorer={"truncation": both}), "truncation": fewer})
    lists = [modes.descriptions() for modes in (body, body.scaled(mass=0.4).damped(0.01))]
    for found in lists:
        counts = {tuple(sorted(lacking)): modes.n_modes for lacking, modes in found.items()}
        assert counts == {(): 9, ("mesh",): 9, ("mesh", "truncation"): 3, ("truncation",): 5}
    assert all(modes.mass == 0.4 and (modes.damping_ratio == 0.01).all() for modes in lists[1].values())


def test_a_mode_given_twice_and_shapes_of_zeros_are_refused():
    plate = fi.analytic.rectangle(0.3, 0.3, mass=0.2, first_frequency=100.0, n_modes=6)
    points = 0.3 * np.random.default_rng(0).random((7, 2))
    twice = [0, 1, 2, 2, 3]
    for sign in (1.0, -1.0):
        shapes = plate.shape_at(points)[:, twice] * [1.0, 1.0, 1.0, sign, 1.0]
        with pytest.raises(ValueError, match="shapes must hold each mode once, but that at 250 Hz is there twice"):
            fi.Modes.from_arrays(plate.frequencies[twice], shapes, points=points, mass=0.2)
    with pytest.raises(ValueError, match="shapes must move at least one point in one mode, got zeros only"):
        fi.Modes.from_arrays([100.0], np.zeros((7, 1)), points=points, mass=0.2)
    # both modes of a square at 250 Hz are the same along its diagonal
    along = np.linspace(0.05, 0.25, 7)[:, None] * np.ones(2)
    assert fi.Modes.from_arrays(plate.frequencies, plate.shape_at(along), points=along, mass=0.2).n_modes == 6


@pytest.mark.parametrize(
    ("points", "text"),
    [
        (
            [(0.1, 0.2), (0.1, 0.2), (0.3, 0.1)],
            r"points .+ and .+ must not lie at one place, as their shapes differ; leave one out",
        ),
        ([(0.0,) * 4, (1.0,) * 4, (2.0,) * 4], "points must have 1, 2 or 3 coordinates, got 4"),
        ([(), (), ()], "points must have 1, 2 or 3 coordinates, got 0"),
    ],
)
def test_points_that_are_none_or_contradict_each_other_are_refused(points, text):
    with pytest.raises(ValueError, match=text):
        fi.Modes.from_arrays([100.0], [[1.0], [0.5], [0.2]], points=points, mass=1.0)


def test_a_point_measured_twice_alike_is_known():
    modes = fi.Modes.from_arrays([100.0], [[1.0], [1.0], [0.2]], points=[[0.1], [0.1], [0.3]], mass=1.0)
    assert modes.shape_at([[0.1]]).tolist() == [[1.0]]


def test_frequencies_whose_squares_are_no_numbers_are_refused():
    with pytest.raises(ValueError, match="frequencies above zero must be at least 1e-75 Hz, got 1e-300 Hz"):
        fi.Modes.from_arrays([1e-300, 10.0], np.eye(2), points=[[0.0], [1.0]], mass=1.0)


def test_stiffness_of_rounding_beside_the_compliance_of_a_free_body_is_told():
    """The compliance of a body of which all modes are known is theirs to the rounding of an inverse."""
    shapes, points = np.array([[1.0, 1.2], [1.0, -1.2]]), [[0.0], [0.1]]
    for omega, change, said in (([30.0, 3e3], 1.0 - 1e-10, None), ([6.0, 3e3], 0.0, "or 0 Hz for rigid motions")):
        whole = change * np.outer(shapes[:, 0], shapes[:, 0]) / omega[0] ** 2
        whole += np.outer(shapes[:, 1], shapes[:, 1]) / omega[1] ** 2
        body = fi.Modes.from_arrays(np.array(omega) / (2.0 * np.pi), shapes, points=points, mass=1.0, compliance=whole)
        if said is None:
            assert np.abs(body.residual_compliance(points)).max() < 1e-9 * whole.max()
        else:
            with pytest.raises(fi.SimulationError, match=said):
                body.residual_compliance(points)
