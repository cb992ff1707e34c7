"""Maps computed where their answer changes: the same as all cells computed, within the tolerance, and resumable."""

import numpy as np
import pytest
import xarray
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.sweeps import cases, grid, refined

AT = (0.465, 0.3)
LAYERS = ["n_impacts", "contact_time", "restitution", "impulse", "peak_force", "margin", "error", "truncation"]


def made(shape, seed=0):
    """All layers of a map whose number of impacts changes along a circle and a line, with a kink and two failures."""
    y, x = np.meshgrid(*(np.linspace(0.0, 1.0, n) for n in shape), indexing="ij")
    count = 1.0 + (np.hypot(x - 0.4, y - 0.5) < 0.2) + (x > 0.8 + 0.1 * y)
    smooth = np.exp(0.3 * x + 0.3 * np.sin(3.0 * y)) * (1.0 + 0.1 * np.maximum(0.0, x - 0.3 - 0.2 * y))
    same = [np.full(shape, value) for value in (0.05, 1e-4, np.nan)]  # margin, error, truncation
    numbers = np.stack([count, smooth, np.cos(x * y) + 0.1 * count, smooth**2, 3.0 / smooth, *same])
    numbers[:, -6:, -1:] = np.nan
    return numbers.reshape(len(LAYERS), -1)


@pytest.mark.parametrize("shape", [(150, 130), (33, 18), (5, 40), (2, 2)])
def test_all_cells_are_what_computing_them_gives(shape):
    whole, tolerance, asked = made((max(shape[0], 8), max(shape[1], 10)))[:, : shape[0] * shape[1]], 1e-3, []
    if min(shape) > 9:
        whole = made(shape)

    def compute(cells, turn):
        asked.append(cells)
        failed = np.flatnonzero(np.isnan(whole[0, cells]))
        return whole[:, cells], {int(i): "refused" for i in failed}

    done = []
    found = refined.refine(shape, LAYERS, tolerance, compute, done.append)
    cells = np.concatenate(asked)
    assert len(np.unique(cells)) == len(cells) == found.computed.sum()  # none twice
    assert np.array_equal(found.computed.ravel()[cells], np.ones(len(cells)))
    assert np.array_equal(found.numbers[0], whole[0], equal_nan=True)
    good = ~np.isnan(whole[0])
    assert found.texts == dict.fromkeys(np.flatnonzero(~good), "refused")
    assert_allclose(found.numbers[2, good], whole[2, good], atol=tolerance)
    for row in (1, 3, 4):
        assert_allclose(found.numbers[row, good], whole[row, good], rtol=tolerance)
    between = ~found.computed.ravel()
    off = np.abs(np.log(found.numbers[[1, 3, 4]] / whole[[1, 3, 4]])).max(axis=0)
    off = np.maximum(off, np.abs(found.numbers[2] - whole[2]))[between]
    told = found.numbers[-2, between] - whole[-2, between] + 1e-12  # rounding where both are zero
    assert (off <= 2.0 * told).all() and np.count_nonzero(off > told) <= 1e-3 * len(off)  # beside the kink
    assert done[-1:] in ([], [shape[0] * shape[1]])
    if shape == (150, 130):
        assert found.computed.mean() < 0.4


def test_interpolated_cells_meet_the_tolerance_with_the_errors_of_those_computed():
    """Cells with loss state more than time steps are allowed: the rest of the tolerance is for interpolation."""
    whole = made((150, 130))
    whole[-2] = 5e-4
    found = refined.refine((150, 130), LAYERS, 1e-3, lambda cells, turn: (whole[:, cells], {}))
    assert not found.computed.all() and np.nanmax(found.numbers[-2]) <= 1e-3


def test_parabolas_need_three_nodes_and_lines_two():
    nodes, places = np.array([[0, 2, 5], [3, 3, 4]]), np.array([[1, 4], [3, 4]])
    found = np.einsum("npi,ni->np", refined.weights(nodes, places), np.array([[0.0, 4.0, 25.0], [9.0, 9.0, 16.0]]))
    assert_allclose(found, [[1.0, 16.0], [9.0, 16.0]])


def test_islands_that_can_be_missed_are_told():
    """The widest gap between cells computed in any case is a quarter of a block."""
    assert_allclose(refined.widest_gap((401, 401)), 4 / 400)
    asked = []

    def compute(cells, turn):
        asked.append(cells)
        return np.ones((len(LAYERS), len(cells))), {}

    refined.refine((50, 70), LAYERS, 1e-3, compute)
    rows, columns = np.unravel_index(np.concatenate(asked), (50, 70))
    gap = max(np.diff(np.unique(rows)).max() / 49, np.diff(np.unique(columns)).max() / 69)
    assert_allclose(refined.widest_gap((50, 70)), gap)


RANGES = {"mass": {"from": 0.02, "to": 0.1}, "stiffness": {"from": 1e4, "to": 3e5, "scale": "log"}}


def swept(**wanted):
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.5, first_frequency=100.0, n_modes=20)
    bodies = plate, fi.Striker.rigid(0.1), fi.Contact.linear(1e5)
    return fi.sweep(*bodies, at=AT, speed=1.0, **{"over": RANGES, "cells": 90, **wanted})


def test_a_refined_map_is_the_dense_one():
    """Layers within the sum of both errors told, numbers of impacts and borders the same, computed cells equal."""
    table, dense = swept(refine=True), swept(refine=False)
    assert table.n_impacts.shape == (90, 90) and dense.attrs["cells"] == "all 8100 cells computed"
    assert "cells computed" in table.attrs["cells"] and 0.1 < float(table.interpolated.mean()) < 0.9
    assert np.array_equal(table.n_impacts, dense.n_impacts)
    there = ~table.interpolated.values
    limit = table.error.values + dense.error.values
    assert (np.abs(table.restitution - dense.restitution).values <= limit).all()
    for name in ("contact_time", "impulse", "peak_force"):
        assert (np.abs(table[name] / dense[name] - 1.0).values <= limit).all()
        assert_allclose(table[name].values[there], dense[name].values[there], rtol=1e-9)  # order of sums
    assert (table.error <= 1e-3).all() and bool(table.tolerance_met.all()) == bool(dense.tolerance_met.all())
    for one, two in zip(fi.read_borders(table), fi.read_borders(dense), strict=True):
        assert_allclose(one.points, two.points, rtol=1e-9)


@pytest.mark.parametrize(("limit", "words"), [(0.0, "only those where"), (1e9, "all are computed")])
def test_the_predicted_cost_decides_and_is_told(monkeypatch, limit, words):
    monkeypatch.setattr(grid, "DENSE", limit)
    said = []
    table = swept(tell=said.append, borders=False, cells=20)
    assert len(said) == 1 and said[0].startswith("all 400 cells are expected to take") and words in said[0]
    assert ("interpolated" in table) == (limit == 0.0) and "borders" not in table.attrs


@pytest.mark.slow
def test_a_map_that_was_stopped_goes_on(tmp_path, monkeypatch):
    pytest.importorskip("zarr", reason="the cluster extra is not installed")
    solved, real = [], cases.solve_cases

    def count(cells, start, stop, **wanted):
        if len(solved) == 100:
            raise KeyboardInterrupt
        solved.append(tuple(cells.cells(start, stop)))
        return real(cells, start, stop, **wanted)

    monkeypatch.setattr(cases, "solve_cases", count)
    wanted = {"refine": True, "borders": False, "store": tmp_path / "map", "cells": 50}
    with pytest.raises(KeyboardInterrupt):
        swept(**wanted)
    first = list(solved)
    solved.append(())
    table = swept(**{**wanted, "refine": None})  # goes on as it began, whatever it would cost
    again = solved[len(first) + 1 :]
    assert "interpolated" in table and not set(first[2:]) & set(again[2:])  # but for the first look
    monkeypatch.setattr(cases, "solve_cases", real)
    alone = swept(refine=True, borders=False, cells=50)
    xarray.testing.assert_allclose(table.drop_vars("failure"), alone.drop_vars("failure"), rtol=1e-9)
    with pytest.raises(ValueError, match="store must be a new folder or the store of this map"):
        swept(refine=True, borders=False, store=tmp_path)


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ({"over": {"mass": [0.1, 0.2]}}, "refine must be left out: a map needs two axes"),
        ({"layers": {"own": lambda hit: 1.0}}, "refine must be left out with layers of one's own"),
    ],
)
def test_what_cannot_be_refined_is_told(wanted, message):
    with pytest.raises(ValueError, match=message):
        swept(refine=True, **{"cells": 5, **wanted})
    if "layers" in wanted:  # without refine, they are computed
        assert swept(**{"cells": 2, "borders": False, **wanted}).own.shape == (2, 2)


def test_a_border_is_followed_where_no_node_sees_it():
    """A strip one cell wide that begins at a border, between the nodes of all blocks."""
    count = np.ones((120, 120))
    count[:, :40] = 2.0
    count[61, 40:90] = 2.0

    def compute(cells, turn):
        numbers = np.ones((len(LAYERS), len(cells)))
        numbers[0] = count.ravel()[cells]
        return numbers, {}

    found = refined.refine((120, 120), LAYERS, 1e-3, compute)
    assert np.array_equal(found.numbers[0], count.ravel()) and found.computed.mean() < 0.25
