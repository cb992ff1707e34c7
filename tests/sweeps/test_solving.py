"""How blows are computed: those that the engine of maps leaves are struck one by one, and a failure is told."""

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.sweeps import cloud, grid, solving

AT = (0.465, 0.3)


def plate():
    return fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=40)


def test_a_cell_that_fails_says_why_and_the_others_go_on(monkeypatch):
    def fail(modes, striker, contact, **wanted):
        if contact.exponent < 0.8:
            raise fi.SimulationError("the motion may be chaotic")
        return fi.strike(modes, striker, contact, **wanted)

    monkeypatch.setattr(solving, "strike", fail)
    table = fi.sweep(
        plate(), fi.Striker.rigid(0.1), fi.Contact.linear(1e5), at=AT, speed=1.0, over={"exponent": [0.9, 0.7]}
    )
    assert table.failure.values.tolist() == ["", "the motion may be chaotic"]
    assert table.n_impacts.values.tolist() == [2, -1]
    assert np.isnan(table.restitution.values).tolist() == [False, True]


def test_a_block_is_the_same_from_any_start():
    """Of a map and of a cloud, also where a cell is struck alone: the fourth, with an exponent below 1."""
    base = grid.Case(plate(), fi.Striker.rigid(0.05), fi.Contact.linear(1e5), np.array(AT), 1.0)
    axes = {"exponent": np.array([1.0, 1.2, 1.5, 0.9])}
    cells = grid.Grid(base, axes, 1e-3, True, None, {})
    points = cloud.Cloud(base, axes, 1e-3, True, None)
    whole, _ = grid.solve(cells, 0, 4)
    for start in range(4):
        for one in (grid.solve(cells, start, 4)[0], cloud.solve(points, start, 4)[0]):
            np.testing.assert_allclose(one, whole[:, start:], rtol=1e-9)  # order of sums
    assert solving.solve_all(points, cloud.solve, 1, None, None, None)[0] == pytest.approx(whole, rel=1e-9)
