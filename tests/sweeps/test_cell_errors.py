"""What cells of a map say of their errors, against single strikes."""

from dataclasses import replace

import numpy as np
import pytest
from comparing import QUANTITIES
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.sweeps import cell_errors


def test_every_cell_says_whether_it_met_the_tolerance():
    """The expected error of modes left out against that of single strikes, which find it by runs with fewer modes."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=2.0, first_frequency=100.0, n_modes=60)
    stick, law = fi.Striker.stick(0.1, 2000.0), fi.Contact.hertz(695e3)
    over = {"mass": [0.03, 0.3], "stiffness": [1e5, 1e7, 1e9], "at": [(0.45, 0.3), (0.7, 0.5)]}
    blow = {"at": (0.45, 0.3), "speed": 1.0, "tolerance": 1e-3}
    table = fi.sweep(plate, stick, law, over=over | {"target_frequency": [50.0, 100.0]}, **blow)
    assert_allclose(table.tolerance_met, table.error + table.truncation <= 1e-3)
    assert 0.0 < table.tolerance_met.mean() < 1.0
    for i, j, k in np.ndindex(2, 3, 2):
        cell = table.isel(mass=i, stiffness=j, at=k, target_frequency=1)
        striker, spring = fi.Striker.stick(over["mass"][i], 2000.0), fi.Contact.hertz(over["stiffness"][j])
        hit = fi.strike(plate, striker, spring, **blow | {"at": over["at"][k]})
        assert np.isfinite(cell.truncation) == (hit.error.truncation < 0.1)  # those above are not resolvable, or nearly
        if 1e-4 < hit.error.truncation < 0.1:
            assert 0.3 < cell.truncation / hit.error.truncation < 3.0  # both are estimates
        assert cell.tolerance_met == hit.tolerance_met
    bare = fi.sweep(plate, stick, law, over={"mass": [0.1]}, residual=False, **blow)
    assert bare.tolerance_met.all() and not bare.truncation.any()


def test_a_map_tells_the_models_own_error_between_a_few_blows():
    spruce = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    plate = fi.analytic.rectangle(0.4, 0.3, section=spruce, n_modes=200, damping_ratio=0.01)
    law, over = fi.Contact.hertz(1e7), {"mass": [0.01, 0.02, 0.03, 0.05], "stiffness": [1e6, 1e8]}
    striker, blow = fi.Striker.rigid(0.02), {"at": (0.13, 0.11), "speed": 0.5}
    table = fi.sweep(plate, striker, law, over=over, audit=True, **blow)
    for i, j in ((0, 0), (1, 1), (3, 1)):  # ends and middle are examined
        bodies = plate, fi.Striker.rigid(over["mass"][i]), fi.Contact.hertz(over["stiffness"][j])
        hit = fi.strike(*bodies, tolerance=1e-3, **blow)
        assert_allclose(table.model_error[i, j], hit.model_error, rtol=1e-6)
    told = table.model_error.values[1:]
    assert (np.sort(told, axis=0)[1] == told[1]).all()  # between its neighbours
    assert "no yielding" in table.model_error.attrs["not_known"]
    own = {"own": lambda hit: hit.model_error}
    asked = fi.sweep(plate, striker, law, over={"mass": [0.01]}, layers=own, **blow)
    assert asked.own.values[0] > 1e-6 and "model_error" not in asked


def test_cells_between_those_examined_do_not_meet_the_tolerance_where_they_alone_would_not(monkeypatch):
    """Fewer modes mean another number of impacts in some cells between others: they had the error of the nearest."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300, damping_ratio=0.01)
    over = {"mass": np.geomspace(3e-3, 0.2, 60), "stiffness": np.geomspace(1e4, 1e6, 60)}
    maps = []
    for most in (cell_errors.DOUBTED["modes"], 10_000):
        monkeypatch.setitem(cell_errors.DOUBTED, "modes", most)
        blow = {"at": (0.45, 0.3), "speed": 1.0, "tolerance": 1e-2}
        maps.append(fi.sweep(plate, fi.Striker.stick(0.1, 10e3), fi.Contact.linear(1e5), over=over, **blow))
    some, every = maps
    assert not (some.tolerance_met & (every.truncation > 0.5)).any()
    assert (some.tolerance_met & ~every.tolerance_met).mean() < 2e-3  # errors that are just above the tolerance
    assert some.tolerance_met.mean() > 0.98 * every.tolerance_met.mean() > 0.5


def test_a_cell_whose_margin_is_less_than_what_modes_left_out_shift_it_by_is_in_doubt():
    """Eight times as many modes part for 9 us more: poorer bodies have the same number of impacts, by less margin."""

    def plate(n):
        return fi.analytic.rectangle(0.4, 0.3, mass=0.0494692, first_frequency=309.277, n_modes=n)

    law, blow = fi.Contact.hertz(26405974.75), {"at": (0.0844284, 0.0739413), "speed": 2.68640447}
    over = {"mass": [0.02, 0.06509490566]}
    clear, graze = (
        fi.sweep(plate(44), fi.Striker.rigid(0.1), law, over=over, tolerance=1e-2, **blow).isel(mass=i) for i in (0, 1)
    )
    truth = fi.strike(plate(352), fi.Striker.rigid(over["mass"][1]), law, tolerance=1e-4, **blow)
    assert graze.n_impacts == 1 != truth.n_impacts and graze.margin < 1e-3 and graze.truncation >= 1.0
    assert clear.tolerance_met


def test_cells_struck_alone_have_the_errors_of_single_blows():
    plate = fi.analytic.rectangle(0.4, 0.3, mass=0.3, first_frequency=80.0, n_modes=40, damping_ratio=0.01)
    law, blow = fi.Contact.layers(1e5, 1.3, depth=1e-4, hard_stiffness=3e6), {"at": (0.13, 0.11), "speed": 1.0}
    table = fi.sweep(plate, fi.Striker.rigid(0.1), law, over={"mass": [0.02, 0.1, 0.5]}, tolerance=1e-2, **blow)
    for mass, error, truncation in zip(table.mass.values, table.error.values, table.truncation.values):
        own = fi.strike(plate, fi.Striker.rigid(mass), law, tolerance=1e-2, **blow).error
        assert_allclose([error, truncation], [own.step, own.truncation], rtol=1e-6)  # the cell's striker is scaled
        assert own.truncation > 1e-4


def test_no_cell_of_a_body_with_something_unstated_goes_without_its_error(monkeypatch):
    """Those struck again in a second round were a fourth of them, and the others had an error of nearly zero."""
    monkeypatch.setitem(cell_errors.DOUBTED, "alone", 9)
    plate, at = fi.analytic.rectangle(0.4, 0.3, mass=0.3, first_frequency=80.0, n_modes=12), np.array([[0.13, 0.11]])
    known = fi.Modes.from_arrays(plate.frequencies, plate.shape_at(at), points=at, mass=0.3)
    over = {"mass": np.geomspace(0.01, 0.6, 12), "stiffness": np.geomspace(1e3, 3e4, 12)}
    blow = {"at": at[0], "speed": 1.0, "tolerance": 0.3}
    table = fi.sweep(known, fi.Striker.rigid(0.1), fi.Contact.linear(1e4), over=over, **blow)
    assert 0.1 < table.tolerance_met.mean() < 0.9
    for i, j in np.argwhere(table.tolerance_met.values)[::7]:
        law = fi.Contact.linear(over["stiffness"][j])
        hit = fi.strike(known, fi.Striker.rigid(over["mass"][i]), law, **blow)
        assert table.truncation[i, j] > 0.5 * hit.error.truncation  # of those between others the largest around


@pytest.mark.parametrize("many, few, law, blow, over, tolerance", [
    # the cell alone said 1.5e-2 and erred by 0.29, with 5 impacts for 4
    (
        lambda n: fi.analytic.beam(1.0, ends=("hinged", "hinged"), mass=0.78, first_frequency=117.5, n_modes=n),
        13, fi.Contact.hertz(4.752281e9), {"at": 0.44113, "speed": 0.33072},
        {"mass": [0.0135925, 0.135925], "stiffness": [9.50456e8, 4.752281e9, 2.376141e10]}, 3e-2,
    ),
    # 6e-5, and erred by 1.2e-3: the expectation knew of the soft layer only
    (
        lambda n: fi.analytic.rectangle(
            1.0, 0.9511, mass=0.76792, first_frequency=26.012, n_modes=n, damping_ratio=0.005
        ),
        40, fi.Contact.layers(76034.7, 1.5, depth=3.22094e-3, hard_stiffness=536570.0),
        {"at": (0.45247, 0.32336), "speed": 2.93972}, {"mass": [0.384], "stiffness": [15207.0, 76034.7]}, 1e-3,
    ),
])  # fmt: skip
def test_cells_say_what_modes_left_out_do_to_several_impacts_and_to_layers(many, few, law, blow, over, tolerance):
    """Against ten times as many modes and a tenth of the tolerance."""
    table = fi.sweep(many(few), fi.Striker.rigid(0.1), law, over=over, tolerance=tolerance, **blow)
    for i, j in np.ndindex(*table.n_impacts.shape):
        cell, mass, stiffness = table.isel(mass=i, stiffness=j), over["mass"][i], over["stiffness"][j]
        contact = replace(law, stiffness=stiffness)
        truth = fi.strike(many(10 * few), fi.Striker.rigid(mass), contact, tolerance=0.1 * tolerance, **blow)
        claim = float(cell.error + cell.truncation)
        if cell.tolerance_met:
            assert cell.n_impacts == truth.n_impacts
            off = [abs(float(cell[name]) / getattr(truth, name) - 1.0) for name in QUANTITIES]
            assert max(off) < max(2.0 * claim, truth.error.total)
