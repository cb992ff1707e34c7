"""Maps: cells against single blows, axes, units, failures and input errors."""

import json
from dataclasses import replace

import numpy as np
import pytest
from comparing import refusing, worst
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.sweeps import cases, cells

AT, LINEAR = (0.465, 0.3), fi.Contact.linear(1e5)


def plate(**wanted):
    return fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=80, **wanted)


def stick(mass=0.1, first_frequency=10e3):
    return fi.Striker.stick(mass, first_frequency)


def swept(over, law=LINEAR, striker=None, speed=1.0, **wanted):
    return fi.sweep(plate(), striker or stick(), law, at=AT, speed=speed, over=over, **wanted)


def test_a_map_as_the_design_says_it():
    table = swept({"mass": [0.05, 0.1], "stiffness": [2e4, 1e5, 5e5]}, tolerance=1e-3)
    assert table.n_impacts.dims == ("mass", "stiffness") and table.n_impacts.dtype.kind == "i"
    units = {"mass": "kg", "stiffness": "N/m", "contact_time": "s", "restitution": "1"}
    assert {name: table[name].attrs["units"] for name in units} == units
    target = json.loads(table.attrs["scene"])["target"]
    assert target["mass"] == 0.2 and len(target["frequencies"]) == 80 and (table.failure == "").all()


@pytest.mark.parametrize("also", [{}, {"loss": [0.0, 0.3]}, {"target_mass": [0.1, 2.0]}, {"at": [AT, (0.7, 0.45)]}])
def test_a_cell_has_the_same_bits_whatever_is_computed_with_it(also):
    base = cells.Case(plate(), stick(), LINEAR, np.array(AT), 1.0)
    axes = cells.checked_axes(base, {"mass": np.geomspace(0.01, 0.2, 8), **also})
    whole = cases.Cases(base, axes, 1e-3, band=5e3)
    expected, _ = cases.solve_cases(whole, 0, whole.n_cases)
    starts = range(0, whole.n_cases, 3)
    parts = [cases.solve_cases(replace(whole, kernels={}), i, min(i + 3, whole.n_cases))[0] for i in starts]
    assert np.hstack(parts).tobytes() == expected.tobytes()


VALUES = {
    "mass": [0.03, 0.15], "striker_frequency": [800.0, 5e3], "stiffness": [3e4, 4e5], "exponent": [1.0, 1.3],
    "loss": [0.0, 0.2], "gap": [0.0, 1e-3], "speed": [0.3, 4.0], "at": [(0.465, 0.3), (0.7, 0.45)],
    "target_mass": [0.1, 2.0], "target_frequency": [60.0, 150.0], "damping_ratio": [0.0, 0.03],
}  # fmt: skip


def single(law, target_mass=0.2, target_frequency=100.0, damping_ratio=0.0, mass=0.1, striker_frequency=10e3, **change):
    """The blow of one cell by `strike` alone."""
    target = plate().scaled(mass=target_mass, first_frequency=target_frequency).damped(damping_ratio)
    blow = {"at": change.pop("at", AT), "speed": change.pop("speed", 1.0), "tolerance": 1e-5}
    return fi.strike(target, stick(mass, striker_frequency), replace(law, **change), **blow)


@pytest.mark.parametrize("name", VALUES)
def test_every_axis_gives_the_single_blow(name):
    law = fi.Contact.hertz(2e6) if name in ("speed", "at", "loss", "target_mass", "damping_ratio") else LINEAR
    table = swept({name: VALUES[name]}, law, max_frequency=3e3)
    for i, value in enumerate(VALUES[name]):
        hit, cell = single(law, **{name: value}), table.isel({name: i})
        assert worst(cell, hit) < 1e-3
        assert_allclose(float(cell.centroid), hit.spectral_centroid(3e3), rtol=2e-3)  # 1e-3 each of the two


LOSING = {  # axis: its values, and the contact whose number they replace
    "depth": ([1e-4, 1e-3], fi.Contact.layers(1e5, 1.2, depth=5e-4, hard_stiffness=1e8)),
    "hard_stiffness": ([0.0, 1e8], fi.Contact.layers(1e5, 1.2, depth=1e-4, hard_stiffness=1e8)),
    "hard_exponent": ([1.0, 2.0], fi.Contact.layers(1e5, 1.2, depth=1e-4, hard_stiffness=1e7)),
    "yield_approach": ([0.0, 1e-4], fi.Contact.elastic_plastic(2e6, yield_approach=1e-4)),
    "hysteresis": ([0.0, 0.4], fi.Contact.felt(2e6, 1.5, hysteresis=0.2, relaxation=1e-3)),
    "relaxation": ([1e-4, 1e-2], fi.Contact.felt(2e6, 1.5, hysteresis=0.2, relaxation=1e-3)),
}


@pytest.mark.parametrize("name", LOSING)
def test_contacts_that_lose_vary_by_name(name):
    values, law = LOSING[name]
    striker = fi.Striker.rigid(0.03)
    table = swept({f"contact.{name}": values}, law, striker)
    for i, value in enumerate(values):
        hit = fi.strike(plate(), striker, replace(law, **{name: value}), at=AT, speed=1.0, tolerance=1e-3)
        cell = table.isel({name: i})
        assert int(cell.n_impacts) == hit.n_impacts
        assert_allclose(float(cell.restitution), hit.restitution, atol=1e-3)
        assert_allclose(float(cell.impulse), hit.impulse, rtol=1e-3)
    assert abs(float(table.restitution[0]) - float(table.restitution[1])) > 2e-3  # the number does matter
    assert (table.failure == "").all()


def test_speed_matters_under_a_hard_layer():
    """A linear contact scales with the speed; not one that bottoms."""
    law = fi.Contact.layers(1e5, 1.0, depth=2e-4, hard_stiffness=1e7, hard_exponent=1.0)
    force = swept({"speed": [0.1, 2.0]}, law, fi.Striker.rigid(0.03)).peak_force.values
    assert force[1] > 1.5 * 20.0 * force[0]


def test_speed_only_scales_the_forces_of_linear_springs():
    table = swept({"speed": [0.5, 1.0, 3.0], "stiffness": [5e4, 8e5]}, speed=7.0)
    direct = swept({"stiffness": [5e4, 8e5]}, speed=3.0)
    assert_allclose(table.contact_time.sel(speed=3.0), direct.contact_time, rtol=1e-12)
    assert_allclose(table.peak_force.sel(speed=3.0), direct.peak_force, rtol=1e-12)
    assert_allclose(table.impulse.sel(speed=0.5) * 6.0, direct.impulse, rtol=1e-12)


def test_points_are_an_axis_with_coordinates():
    table = swept({"at": [(0.2, 0.3), (0.4, 0.5)]})
    assert_allclose([table.at_x, table.at_y], [[0.2, 0.4], [0.3, 0.5]])


test_wrong_axes_are_told_at_once = refusing([
    ({}, "over must name at least one axis"),
    ({"masss": [1.0]}, "over must be one of .*did you mean 'mass'"),
    ({"mass": [0.1, -1.0]}, r"over\['mass'\] must be positive, got -1 kg"),
    ({"mass": []}, "must contain at least one value"),
    ({"mass": [0.1], "striker.mass": [0.1]}, "names the axis mass twice"),
    ({"stiffness": [1e5, np.nan]}, r"over\['stiffness'\] must be finite"),
    ({"exponent": [0.1]}, "exponent must lie between"),
    ({"at": [(9.0, 0.1)]}, "must lie on the body"),
    ({"contact.depth": [1e-4], "hard_stiffness": [0.0]}, "contact.depth does nothing unless"),
    ({"relaxation": [1e-4]}, "contact.relaxation does nothing unless contact.hysteresis is positive"),
], swept)  # fmt: skip


def test_sweep_stays_a_function_whatever_was_imported():
    import fem_impact.sweeps.grid  # noqa: F401

    assert callable(fi.sweep)
