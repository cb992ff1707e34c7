"""Residuals, their derivatives and the search."""

from dataclasses import replace

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.taps import solver

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


def central(problem, x, i):
    """The derivative of the residual by central differences of 1e-3."""
    step = np.zeros(len(x))
    step[i] = 1e-3
    return (problem.residual(x + step) - problem.residual(x - step)) / 2e-3


def test_derivatives_agree_with_central_differences(found):
    problem, x = found.problem, found.best.x + 0.01
    jacobian = problem.jacobian(x)
    for i, column in enumerate(jacobian.T):
        exact = central(problem, x, i)
        assert np.abs(column - exact).max() < 1e-3 * np.abs(exact).max()  # one-sided steps of 1e-4


def test_derivatives_hold_for_a_value_of_each_tap_and_coordinates_change_without_loss(found):
    problem = replace(found.problem, own=("contact.time", "contact.loss"))
    x = np.concatenate([found.best.x + 0.01, [0.1, -0.05, 0.02, 0.04]])
    jacobian = problem.jacobian(x)
    for i in [0, 2, *range(len(x) - 4, len(x))]:
        assert np.abs(jacobian[:, i] - central(problem, x, i)).max() < 1e-3 * np.abs(jacobian[:, i]).max()
    own, other, mean = (problem.values(x, tap) for tap in (0, 1, None))
    assert own["contact.loss"] - mean["contact.loss"] == pytest.approx(-0.01)  # half of 0.02 - 0.04, on a range of one
    k = own["contact.stiffness"] * other["contact.stiffness"]
    assert mean["contact.stiffness"] == pytest.approx(np.sqrt(k), rel=1e-9)
    single = replace(problem, centre=1)
    moved = problem.moved(x, single)
    assert np.allclose(single.residual(moved), problem.residual(x), atol=1e-9)
    assert single.values(moved)["contact.stiffness"] == pytest.approx(other["contact.stiffness"], rel=1e-9)
    assert problem.among([1], np.arange(11))[1].tolist() == [0, 1, 2, 4, 6, 8, 10] and problem.n_values == 9


def test_held_coordinates_stay(found):
    x = found.best.x.copy()
    x[1] += 0.05
    solved = solver.solve(found.problem, x, held=(1,))
    assert solved.x[1] == x[1] and solved.cost > found.best.cost
    assert solved.jacobian.shape[1] == len(x) - 1


@pytest.mark.parametrize(("off", "near"), [((0.3, -0.3, 1.0, -1.0), 0.1), ((0.0, 0.0, 6.0, 6.0), 0.5)])
def test_speed_and_onset_are_found_alone_even_six_samples_away(found, off, near):
    """By the looks at a starting point, in three steps; searches go on from there."""
    n, x = found.problem.n_shared, found.best.x.copy()
    x[n:] += off
    assert np.abs(found.problem.aligned(x)[n:] - found.best.x[n:]).max() < near


def test_directions_that_steps_cannot_tell_from_ridges_move_nothing():
    inverse = solver.pseudo_inverse(np.array([[1.0, -1.0, 0.0], [1.0, -1.0, 1e-9], [0.0, 0.0, 3.0]]))
    assert inverse @ [1.0, 1.0, 3.0] == pytest.approx([0.5, -0.5, 1.0])  # the shortest way of those that do the same


@pytest.mark.parametrize("start", [(2.0, 2.0), (9.0, 0.5)])
def test_the_least_at_a_side_of_a_box_is_found_in_few_steps(start):
    """Along a bent valley that ends there. Of SciPy's methods, "trf" takes twice as many from within, and "dogbox" ends
    where it begins from the side."""
    begun, bounds = [], (np.array([0.1, 0.5]), np.array([10.0, 4.0]))

    def valley(x):
        begun.append(x)
        return np.array([np.exp(x[0] * x[1]) - np.exp(3.0), 0.1 * (x[0] - 9.0)])

    def slopes(x):
        return np.array([x[::-1] * np.exp(x[0] * x[1]), [0.1, 0.0]])

    found = solver.least(valley, slopes, np.array(start), bounds, close=1e-8, iterations=solver.ENOUGH)
    x = np.linspace(5.9, 6.1, 200_001)  # at the side x[1] = 0.5
    truth = ((np.exp(0.5 * x) - np.exp(3.0)) ** 2 + 0.01 * (x - 9.0) ** 2).min()
    assert found.ended and found.x[1] == 0.5 and found.cost == pytest.approx(truth, rel=1e-6)
    assert len(begun) < 50 and np.allclose(found.jacobian, slopes(found.x))


def test_a_search_goes_round_blows_that_do_not_end():
    def missed(x):
        if x[0] > 1.5:
            raise fi.SimulationError("no blow")
        return np.array([np.exp(x[0]) - np.e])

    found = solver.least(missed, lambda x: np.exp(x)[:, None], np.array([-3.0]), (np.full(1, -5.0), np.full(1, 9.0)),
                         close=1e-8, iterations=solver.ENOUGH)  # fmt: skip
    assert found.ended and found.x == pytest.approx([1.0])
