"""Residuals, their derivatives and the search."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.taps import fit, solver

RANGES = {"contact.stiffness": (1e6, 1e10), "contact.exponent": (1.0, 3.0), "contact.loss": (0.0, 1.0)}


@pytest.fixture(scope="module")
def found():
    law = fi.Contact.power(3e8, 1.7, loss=0.1)
    wall = [fi.Touch(law, 0, None)]
    hits = [fi.collide([fi.Modes.rigid(0.1)], wall, speeds=[v], tolerance=1e-5) for v in (0.5, 1.0)]
    taps = [fi.measure(hit, rate=25600.0, onset=i * 1e-5) for i, hit in enumerate(hits)]
    return fi.fit(taps, striker=fi.Striker.rigid(0.1), contact=law, unknown=RANGES, profiles=False, starts=2)


def test_without_noise_the_truth_comes_back(found):
    assert found.error < 1e-4  # the step of the quick blows
    assert found.point["contact.exponent"] == pytest.approx(1.7, abs=1e-3)
    assert found.point["contact.stiffness"] == pytest.approx(3e8, rel=1e-2)  # it goes with a power of the exponent
    assert found.point["contact.loss"] == pytest.approx(0.1, abs=1e-3)
    assert found.point["speed[1]"] == pytest.approx(1.0, rel=1e-3)


def test_derivatives_agree_with_central_differences(found):
    problem, x = found.problem, found.best.x + 0.01
    jacobian = problem.jacobian(x)
    for i in range(len(x)):
        step = np.zeros(len(x))
        step[i] = 1e-3
        central = (problem.residual(x + step) - problem.residual(x - step)) / 2e-3
        assert np.abs(jacobian[:, i] - central).max() < 1e-3 * np.abs(central).max()  # one-sided steps of 1e-4


def test_derivatives_hold_for_a_value_of_each_tap_and_coordinates_change_without_loss(found):
    problem = replace(found.problem, own=("contact.time", "contact.loss"), _last={})
    x = np.concatenate([found.best.x + 0.01, [0.1, -0.05, 0.02, 0.04]])
    jacobian = problem.jacobian(x)
    for i in [0, 2, *range(len(x) - 4, len(x))]:
        step = np.zeros(len(x))
        step[i] = 1e-3
        central = (problem.residual(x + step) - problem.residual(x - step)) / 2e-3
        assert np.abs(jacobian[:, i] - central).max() < 1e-3 * np.abs(jacobian).max(axis=0)[i]  # steps of 1e-4
    own, other, mean = (problem.values(x, tap) for tap in (0, 1, None))
    assert own["contact.loss"] - mean["contact.loss"] == pytest.approx(-0.01)  # half of 0.02 - 0.04, on a range of one
    k = own["contact.stiffness"] * other["contact.stiffness"]
    assert mean["contact.stiffness"] == pytest.approx(np.sqrt(k), rel=1e-9)
    single = replace(problem, centre=1, _last={})
    moved = problem.moved(x, single)
    assert np.allclose(single.residual(moved), problem.residual(x), atol=1e-9)
    assert single.values(moved)["contact.stiffness"] == pytest.approx(other["contact.stiffness"], rel=1e-9)
    assert problem.kept([1]) == [0, 1, 2, 4, 6, 8, 10] and problem.n_values == 9


def test_held_coordinates_stay(found):
    x = found.best.x.copy()
    x[1] += 0.05
    solved = solver.solve(found.problem, x, held=(1,))
    assert solved.x[1] == x[1] and solved.cost > found.best.cost
    assert solved.jacobian.shape[1] == len(x) - 1


def test_speed_and_onset_are_found_alone(found):
    x = found.best.x.copy()
    n = found.problem.n_shared
    x[n:] += [0.3, -0.3, 1.0, -1.0]
    assert np.abs(found.problem.aligned(x)[n:] - found.best.x[n:]).max() < 0.1  # a good start, found in three steps


@pytest.mark.parametrize("ridge, ended", [(1e-6, True), (4e-5, False)])
def test_a_chord_ends_where_nothing_is_to_be_gained_along_a_ridge(ridge, ended):
    """Two coordinates do nearly the same; along their difference the residual falls by ``ridge`` of what is left."""
    matrix = np.array([[1.0, 1.0], [0.0, ridge], [0.0, 0.0]])
    left = np.array([0.0, 1e-3, 0.0])
    box = np.full(2, 1e-2 if ended else 1e3)  # how far the ridge may lead
    problem = SimpleNamespace(residual=lambda x: matrix @ x - left, bounds=(-box, box), needless=[])
    assert solver.chord(problem, np.zeros(2), matrix)[1] == ended


def test_too_few_samples_are_refused():
    taps = fi.Taps.from_arrays(np.array([0, 0, 0, 0, 50, 90, 50, 0, 0, 0.0]), rate=25600.0)
    with pytest.raises(ValueError, match=r"window must leave samples|too few"):
        fit.fit(taps, striker=fi.Striker.rigid(0.1), contact=fi.Contact.linear(1.0), unknown=RANGES, window=(0.0, 1e-4))


def test_a_blow_six_samples_before_its_trigger_is_found(found):
    """By the looks at a starting point, which improve speed and onset alone."""
    n = found.problem.n_shared
    x = found.best.x.copy()
    x[n + 2 :] += 6.0
    improved = found.problem.aligned(x)
    assert np.abs(improved[n + 2 :] - found.best.x[n + 2 :]).max() < 0.5  # searches go on from there


def test_a_chord_follows_a_straight_valley_to_its_end_and_a_wrong_one_gives_up():
    """With the right derivatives of a linear problem the first step is the last; with a third of them it leads off."""
    rng = np.random.default_rng(3)
    matrix, wanted = rng.normal(size=(9, 3)), np.array([0.2, -0.1, 0.3])
    target = matrix @ wanted + 1e-3 * rng.normal(size=9)
    problem = SimpleNamespace(
        residual=lambda x: matrix @ x - target, bounds=(np.full(3, -1.0), np.full(3, 1.0)), needless=[]
    )
    solved, ended = solver.chord(problem, np.zeros(3), matrix)
    exact = np.linalg.lstsq(matrix, target, rcond=None)[0]
    assert ended and solved.ended and np.abs(solved.x - exact).max() < 1e-12  # rounding
    stuck, ended = solver.chord(problem, np.zeros(3), 0.3 * matrix)  # goes three times too far, so gains nothing
    assert not ended and (stuck.x == 0.0).all()
