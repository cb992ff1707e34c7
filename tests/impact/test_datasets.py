"""A response as labelled arrays: the same numbers as its own, and a file that reads back."""

import numpy as np
import pytest
import xarray

import fem_impact as fi


def blow():
    plate = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=40)
    return fi.strike(plate, fi.Striker.rigid(0.05), fi.Contact.linear(1e6), at=(0.13, 0.1), speed=1.0, tolerance=1e-2)


def test_a_dataset_has_the_numbers_of_its_response():
    hit = blow()
    found = hit.to_xarray()
    np.testing.assert_array_equal(found.time, hit.time)
    np.testing.assert_array_equal(found.force, hit.force)
    assert found.sizes["impact"] == hit.n_impacts == found.n_impacts
    for name in ("contact_time", "impulse", "peak_force", "restitution"):
        assert float(found[name]) == getattr(hit, name)
    np.testing.assert_array_equal(found.impact_end, [impact.end for impact in hit.impacts])
    assert found.force.attrs["units"] == "N" and found.attrs["verdict"] == hit.verdict
    for cause in ("step", "truncation", "mesh", "idealisation", "measurement", "inherited", "total"):
        assert float(found[f"error_{cause}"]) == getattr(hit.error, cause)
    assert float(found.energy_striker) == hit.energies["striker"]


def test_a_dataset_survives_a_file(tmp_path):
    found = blow().to_xarray()
    found.to_netcdf(tmp_path / "hit.nc", engine="scipy")
    xarray.testing.assert_allclose(xarray.load_dataset(tmp_path / "hit.nc", engine="scipy"), found)


def test_several_contacts_have_a_column_each():
    balls = [fi.Modes.rigid(0.1)] * 3
    law = fi.Contact.linear(1e6)
    hit = fi.collide(balls, [fi.Touch(law, 0, 1), fi.Touch(law, 1, 2)], speeds=[1.0, 0.0, 0.0], tolerance=1e-3)
    found = hit.to_xarray()
    assert found.force.dims == ("time", "contact") and found.sizes["contact"] == 2
    assert found.sizes["impact"] == hit.n_impacts
    assert hit.restitution_errors[0] > 0.0
    np.testing.assert_array_equal(found.impact_restitution_error, np.array(hit.restitution_errors, float))


def test_motion_and_spectrum_where_they_are_asked_for():
    hit, points, times = blow(), [(0.3, 0.2), (0.13, 0.1)], [0.0, 1e-3, 5e-3]
    found = hit.to_xarray(points, times, max_frequency=4e3)
    np.testing.assert_array_equal(found.displacement, hit.displacement(points, times))
    np.testing.assert_allclose(found.velocity.sel(moment=1e-3), hit.velocity(points, [1e-3])[0], rtol=1e-12)
    np.testing.assert_array_equal(np.column_stack([found.x, found.y]), points)
    np.testing.assert_allclose(found.spectrum, abs(hit.spectrum(found.frequency.to_numpy())), rtol=1e-12)
    assert float(found.spectrum[0]) == pytest.approx(
        hit.impulse, rel=1e-4
    )  # at 0 Hz; a parabola taken as straight between samples
    assert hit.to_xarray(points).sizes["moment"] == len(hit.time)
    with pytest.raises(ValueError, match="times must come with points"):
        hit.to_xarray(times=times)
    with pytest.raises(ValueError, match="max_frequency must be positive, got -1 Hz"):
        hit.to_xarray(max_frequency=-1.0)
