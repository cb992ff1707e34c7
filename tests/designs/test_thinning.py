"""The search of `tune`: linear programs with a known answer, modes followed by their shapes, pairs refused."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.designs import pitches, thinning
from fem_impact.designs.removal import Dishes
from fem_impact.designs.thinning import Blank
from fem_impact.model.target import Target

WOOD = fi.Material(E=16e9, nu=0.35, rho=900.0)
BAR = fi.Beam.rectangular(WOOD, width=0.05, height=0.012)


def body_of(system, wanted, tolerance=1.0):
    return Blank.of(Target.of(system), pitches.read_pitches(wanted, "order"), tolerance)


def test_the_place_that_costs_least_for_a_cent_is_taken():
    cost, slopes = np.array([1.0, 0.5, 0.1]), np.array([[-40.0, -30.0, -1.0]])
    found = thinning._cheapest_shares(cost, slopes, np.array([12.0]), np.zeros(3), np.eye(3), 0.5, 1.0)
    # 2.5, 1.7 and 10 % of a place per cent: the second, until 0.5 of 12 cents are left
    assert_allclose(found, [0.0, 11.5 / 30.0, 0.0], atol=1e-9)
    held = thinning._cheapest_shares(cost, slopes, np.array([12.0]), np.zeros(3), np.eye(3), 0.5, 0.1)
    assert_allclose(held, 0.1, atol=1e-9)  # all that the step allows, and the rest is missed


def test_a_simplex_search_that_fails_is_made_up_for_by_an_interior_one(monkeypatch):
    cost, slopes, solve = np.array([1.0, 0.5, 0.1]), np.array([[-40.0, -30.0, -1.0]]), thinning.linprog

    def failing(*given, method, **named):
        found = solve(*given, method=method, **named)
        return type(found)(found, x=None) if method == "highs" else found

    monkeypatch.setattr(thinning, "linprog", failing)
    found = thinning._cheapest_shares(cost, slopes, np.array([12.0]), np.zeros(3), np.eye(3), 0.5, 1.0)
    assert_allclose(found, [0.0, 11.5 / 30.0, 0.0], atol=1e-6)


@pytest.mark.parametrize("round_bar", [False, True])
def test_frequencies_stay_within_reach_whatever_is_taken_off(round_bar):
    section = fi.Beam.circular(WOOD, diameter=0.02) if round_bar else BAR
    system = fi.assemble(fi.mesh.line(0.35), section, {"left": "hinged"})
    body, depth = body_of(system, {1: None, 2: None}), 4e-3
    now = body.first()
    low, high = now.reach(depth)
    left = 0.6 if round_bar else 2.0 / 3.0  # of the thickness
    assert_allclose([low, high], [left**2, 1.0 / left] if round_bar else [left**1.5, left**-0.5], rtol=1e-12)
    for middle in np.linspace(0.0, 0.35, 8):
        ratio = body.after(Dishes(np.array([[middle]]), np.array([depth]), 0.05), now).frequencies / now.frequencies
        assert (low < ratio).all() and (ratio < high).all()


def test_reach_of_a_plate_is_told_though_parts_of_its_stiffness_are_zero():
    plate = fi.assemble(fi.mesh.rectangle(0.3, 0.2, size=0.1), fi.Plate(WOOD, 4e-3))
    assert_allclose(body_of(plate, {1: None}).first().reach(1e-3), [0.75**1.5, 0.75**-0.5], rtol=1e-12)


def test_a_search_that_gains_next_to_nothing_ends():
    """A sixth of the bodies did not gain a hundredth of what was missed; there were 74."""
    with pytest.warns(fi.ToleranceWarning, match="mode 1 stays .*; allow more depth or patches"):
        found = fi.tune(fi.assemble(fi.mesh.line(0.35), BAR), {1: "2400 cents"}, depth=0.0119)
    assert found.n_solved < 50 and abs(found.tones[0].left) < 1500.0


def test_modes_that_pass_each_other_are_followed():
    """A groove across a strip lowers its bending below its twist: numbers change, modes do not."""
    strip = fi.assemble(fi.mesh.rectangle(0.3, 0.185), fi.Plate(WOOD, 4e-3))
    body = body_of(strip, {1: None, 2: None})
    now = body.first()
    line = np.column_stack([np.full(9, 0.15), np.linspace(0.0, 0.185, 9)])
    last = now
    for depth in (0.25e-3, 0.5e-3):
        last = body.after(Dishes(line, np.full(9, depth), 0.03), last)
    assert now.which.tolist() == [3, 4] and last.which.tolist() == [4, 3], (now.which, last.which)
    shapes = [each.modes.shape_at([(0.0, 0.0), (0.0, 0.185)])[:, each.which] for each in (now, last)]
    for before, after in zip(*shapes):
        assert_allclose(np.abs(after / before), 1.0, atol=0.3)
    assert (np.sign(shapes[0][0] * shapes[0][1]) == np.sign(shapes[1][0] * shapes[1][1])).all()


def test_pairs_are_refused():
    square = fi.assemble(fi.mesh.rectangle(0.3, 0.3), fi.Plate(WOOD, 3e-3), {"boundary": "hinged"})
    assert body_of(square, {1: "A2"}).numbers == (1,)
    with pytest.raises(
        fi.SimulationError, match=r"mode 2 at .* shares its frequency with another.*; start from a body "
    ):
        body_of(square, {2: "A3"})


def test_a_removal_after_which_a_mode_is_another_is_refused():
    bar = body_of(fi.assemble(fi.mesh.line(0.35), BAR), {3: None})
    with pytest.raises(fi.SimulationError, match=r"mode 3 can no longer be identified .*; take less depth"):
        bar.after(Dishes(np.array([[0.03]]), np.array([0.0118]), 0.03), bar.first())
