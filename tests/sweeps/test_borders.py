"""Borders between numbers of impacts: known curves, single blows on both sides, what is in doubt, and files."""

import io

import numpy as np
import pytest
import xarray
from comparing import refusing
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.sweeps import borders
from fem_impact.sweeps.cases import Cases
from fem_impact.sweeps.cells import Case

AT, RIGID, LINEAR = (0.465, 0.3), fi.Striker.rigid(0.1), fi.Contact.linear(1e5)


PLATE = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=20)


def swept(over, law=LINEAR, **wanted):
    return fi.sweep(PLATE, RIGID, law, at=AT, speed=1.0, over=over, **{"borders": True, **wanted})


def found_of(rule, mass, stiffness):
    """Borders of numbers of impacts told by a rule of mass and stiffness instead of blows."""
    cells = Cases(Case(PLATE, RIGID, LINEAR, np.array(AT), 1.0), {"mass": mass, "stiffness": stiffness}, 1e-3)
    rounds = []

    def solve(rows, turn):
        rounds.append((turn, rows.n_cases, rows.tolerance))
        numbers = np.full((len(rows.layers), rows.n_cases), np.nan)
        numbers[0] = rule(rows.axes["mass"], rows.axes["stiffness"])
        return numbers, {}

    count = np.nan_to_num(rule(*np.meshgrid(mass, stiffness, indexing="ij")), nan=-1.0).astype(int)
    return *borders.find_borders(cells, count, solve), rounds


def test_a_closed_curve_is_where_its_equation_says():
    """An ellipse in the mass and in the logarithm of the stiffness, which half of each axis holds."""
    mass, stiffness = np.linspace(0.1, 0.3, 15), np.geomspace(1e4, 1e6, 18)

    def radius(mass, stiffness):
        return np.hypot((mass - 0.2) / 0.2, np.log(stiffness / 1e5) / np.log(1e2))

    found, doubtful, rounds = found_of(lambda m, k: np.where(radius(m, k) < 0.251, 4, 2), mass, stiffness)
    assert [border.impacts for border in found] == [2]
    (border,) = found
    assert border.axes == ("mass", "stiffness") and np.array_equal(border.points[0], border.points[-1])
    assert (border.error <= 0.75e-3).all() and (border.error > 0.0).all()
    # located along one axis: the radius errs by no more
    assert (np.abs(radius(*border.points.T) - 0.251) <= border.error).all()
    assert not doubtful.any()
    halvings = [n for turn, n, _ in rounds if turn.startswith("halving")]
    assert len(halvings) == 6  # 1/14 of an axis is 1.1e-3 of it after six
    assert {tolerance for _, _, tolerance in rounds} == {borders.FINER * 1e-3}


def test_each_number_of_impacts_has_its_border_even_where_they_meet():
    """First 1 and 3 impacts side by side, then 1, 2 and 3."""
    mass, stiffness = np.linspace(0.11, 0.29, 7), np.geomspace(1e4, 1e6, 4)
    found, *_ = found_of(lambda m, k: 1 + 2 * (m > 0.2), mass, stiffness)
    assert [border.impacts for border in found] == [1]
    assert_allclose(found[0].points[:, 0], 0.2, atol=0.75e-3 * 0.18)
    found, *_ = found_of(lambda m, k: 1 + (m > 0.2) + (m > 0.25), mass, stiffness)
    assert [border.impacts for border in found] == [1, 2]
    assert_allclose(found[1].points[:, 0], 0.25, atol=0.75e-3 * 0.18)


def test_what_cannot_be_told_is_in_doubt_and_not_enclosed():
    mass, stiffness = np.linspace(0.1, 0.3, 9), np.geomspace(1e4, 1e6, 9)
    found, doubtful, _ = found_of(lambda m, k: np.where(m > 0.26, np.nan, 1.0 + (m > 0.2)), mass, stiffness)
    assert doubtful[7:].all() and not doubtful[:7].any()
    assert [border.impacts for border in found] == [1]  # none between numbers and refusals
    gap, *_ = found_of(lambda m, k: np.where(abs(m - 0.2125) < 1e-3, np.nan, 1.0 + (m > 0.2)), mass, stiffness)
    assert (gap[0].error > borders.WIDTH).all()  # the first halving is refused
    assert_allclose(gap[0].error, 0.5 / 8)


def test_a_number_that_changes_with_the_tolerance_is_in_doubt():
    calls = []

    def rule(mass, stiffness):
        calls.append(mass.size)
        return 1 + (mass > (0.2 if len(calls) == 1 else 0.24))

    found, doubtful, _ = found_of(rule, np.linspace(0.11, 0.31, 11), np.geomspace(1e4, 1e6, 3))
    assert doubtful.any(axis=1).nonzero()[0].tolist() == [5, 6]  # 0.21 and 0.23 kg
    assert_allclose(found[0].points[:, 0], 0.24, atol=1e-4)


@pytest.mark.parametrize("law", [LINEAR, fi.Contact.hertz(2e6)], ids=["linear", "hertz"])
def test_blows_on_both_sides_of_a_border_differ(law):
    """Single blows at a hundredth of the tolerance, 1e-3 of the axis to both sides of where the border is told."""
    over = {"mass": np.linspace(0.02, 0.2, 5), "stiffness": law.stiffness * np.geomspace(0.1, 10.0, 5)}
    table = swept(over, law)
    curves = fi.read_borders(table)
    assert curves and "located to 0.0005 of the axes" in table.attrs["borders"]
    for border in curves:
        for point in border.points[:: max(1, len(border.points) // 2)]:
            counts = set()
            for step in ((-1e-3, 0.0), (1e-3, 0.0), (0.0, -1e-3), (0.0, 1e-3)):
                mass, stiffness = point[0] + 0.18 * step[0], point[1] * 100.0 ** step[1]
                striker, contact = fi.Striker.rigid(mass), fi.Contact(stiffness=stiffness, exponent=law.exponent)
                counts.add(fi.strike(PLATE, striker, contact, at=AT, speed=1.0, tolerance=1e-5).n_impacts)
            assert min(counts) <= border.impacts < max(counts)


def test_a_file_keeps_the_curves():
    table = swept({"mass": np.linspace(0.02, 0.2, 4), "stiffness": np.geomspace(1e4, 1e6, 4)})
    with xarray.open_dataset(io.BytesIO(bytes(table.to_netcdf(engine="scipy"))), engine="scipy") as read:
        again = fi.read_borders(read)
    assert len(again) > 0 and table.border_stiffness.attrs["units"] == "N/m"
    for one, two in zip(again, fi.read_borders(table), strict=True):
        assert (one.impacts, one.axes) == (two.impacts, two.axes)
        assert np.array_equal(one.points, two.points) and np.array_equal(one.error, two.error)
    few = swept({"mass": [0.01, 0.02], "stiffness": [1e3, 2e3]})
    assert fi.read_borders(few) == () and few.attrs["borders"].startswith("no border between")
    with pytest.raises(ValueError, match="table has no borders; make the map with borders=True"):
        fi.read_borders(swept({"mass": [0.02, 0.2], "stiffness": [1e4, 1e6]}, borders=False))
    with pytest.raises(ValueError, match="table must be a map"):
        fi.read_borders({})


test_maps_without_borders_are_told_at_once = refusing([
    ({"mass": [0.1, 0.2]}, r"borders must be left out: a map needs two axes of two values or more, got mass \(2\)"),
    ({"mass": [0.1, 0.2], "at": [(0.4, 0.3), (0.5, 0.3)]}, "borders must be left out: axes must have one number"),
    ({"mass": [0.1, 0.3, 0.2], "speed": [1.0, 2.0]}, "borders must be left out: the values of mass must ascend"),
], swept)  # fmt: skip


def test_points_that_are_known_to_the_cell_only_are_told_apart():
    line = borders.Border(1, ("mass", "stiffness"), np.ones((4, 2)), np.array([2e-4, 0.05, 7e-4, 0.1]))
    told = borders._describe_borders((line,), 0, 0.02)
    assert "located to 0.0007 of the axes, 2 of 4 points only to the cell" in told
