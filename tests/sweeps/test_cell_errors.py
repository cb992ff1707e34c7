"""What cells of a map say of their errors, against single strikes."""

import numpy as np
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.impact import collision


def test_every_cell_says_whether_it_met_the_tolerance():
    """The expected error of modes left out against that of single strikes, which find it by runs with fewer modes."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=2.0, first_frequency=100.0, n_modes=60)
    stick, law = fi.Striker.stick(0.1, 2000.0), fi.Contact.hertz(695e3)
    over = {
        "mass": [0.03, 0.3], "stiffness": [1e5, 1e7, 1e9], "at": [(0.45, 0.3), (0.7, 0.5)],
        "target_frequency": [50.0, 100.0],
    }  # fmt: skip
    table = fi.sweep(plate, stick, law, at=(0.45, 0.3), speed=1.0, over=over, tolerance=1e-3)
    assert_allclose(table.tolerance_met, table.error + table.truncation <= 1e-3)
    assert 0.0 < table.tolerance_met.mean() < 1.0
    for i, j, k in np.ndindex(2, 3, 2):
        cell = table.isel(mass=i, stiffness=j, at=k, target_frequency=1)
        hit = collision.strike(
            plate, fi.Striker.stick(over["mass"][i], 2000.0), fi.Contact.hertz(over["stiffness"][j]),
            at=over["at"][k], speed=1.0, tolerance=1e-3,
        )  # fmt: skip
        assert np.isfinite(cell.truncation) == (hit.error.truncation < 0.1)  # those above are not resolvable, or nearly
        if 1e-4 < hit.error.truncation < 0.1:
            assert 0.3 < cell.truncation / hit.error.truncation < 3.0  # both are estimates
        assert cell.tolerance_met == hit.tolerance_met
    bare = fi.sweep(plate, stick, law, at=(0.45, 0.3), speed=1.0, over={"mass": [0.1]}, tolerance=1e-3, residual=False)
    assert bare.tolerance_met.all() and not bare.truncation.any()


def test_a_map_tells_the_models_own_error_between_a_few_blows():
    spruce = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    plate = fi.analytic.rectangle(0.4, 0.3, section=spruce, n_modes=200, damping_ratio=0.01)
    law, over = fi.Contact.hertz(1e7), {"mass": [0.01, 0.02, 0.03, 0.05], "stiffness": [1e6, 1e8]}
    blow = {"at": (0.13, 0.11), "speed": 0.5}
    table = fi.sweep(plate, fi.Striker.rigid(0.02), law, over=over, audit=True, **blow)
    for i, j in ((0, 0), (1, 1), (3, 1)):  # ends and middle are examined
        hit = fi.strike(
            plate, fi.Striker.rigid(over["mass"][i]), fi.Contact.hertz(over["stiffness"][j]), tolerance=1e-3, **blow
        )
        assert_allclose(table.model_error[i, j], hit.model_error, rtol=1e-6)
    ends = table.model_error.values[[1, 3]]
    assert (ends.min(axis=0) <= table.model_error.values[2]).all() and (
        table.model_error.values[2] <= ends.max(axis=0)
    ).all()
    assert "no yielding" in table.model_error.attrs["not_known"]
    assert "model_error" not in fi.sweep(plate, fi.Striker.rigid(0.02), law, over={"mass": [0.01]}, **blow)
    asked = fi.sweep(
        plate, fi.Striker.rigid(0.02), law, over={"mass": [0.01]}, layers={"own": lambda hit: hit.model_error}, **blow
    )
    assert asked.own.values[0] > 1e-6
