"""Grids to look at: they hold the shapes of the modes at their own points."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.modes import viewing

PLATE = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=4)


@pytest.mark.parametrize(
    ("modes", "sides"),
    [(PLATE, 3), (fi.analytic.beam(0.4, ends=("free", "free"), mass=0.2, first_frequency=100.0, n_modes=4), 2)],
    ids=["plate", "beam"],
)
def test_a_pyvista_grid_holds_shapes_and_frequencies(modes, sides):
    grid = modes.to_pyvista()
    assert grid.n_cells > 20 and grid.get_cell(0).n_points == sides
    for i in range(4):
        found = np.asarray(grid.point_data[f"mode_{i + 1:03d}"])
        assert_allclose(found, modes.shapes.at(grid.points[:, : modes.dimension].astype(float))[:, i], atol=1e-6)
    assert_allclose(grid.field_data["frequency"], modes.frequencies)
    assert_allclose(np.ptp(grid.points, axis=0)[0], 0.4, rtol=1e-6)  # single precision


def test_a_plate_is_refined_until_it_is_smooth():
    points, cells = viewing.grid(PLATE)
    assert len(points) >= viewing.ENOUGH and cells.max() == len(points) - 1
    corner = points[cells]
    (a, b), (c, d) = (corner[:, 1] - corner[:, 0]).T, (corner[:, 2] - corner[:, 0]).T
    assert_allclose(0.5 * np.abs(a * d - b * c).sum(), 0.12, rtol=1e-12)


def test_a_beam_of_few_elements_shows_every_half_wave():
    rod = fi.Beam.circular(fi.Material(E=10e9, nu=0.3, rho=700.0), diameter=0.01)
    modes = fi.find_modes(fi.assemble(fi.mesh.line(0.4), rod, {"boundary": "hinged"}), n_modes=8)
    points, cells = viewing.grid(modes)
    assert_allclose(np.abs(np.diff(points[cells][:, :, 0])).sum(), 0.4, rtol=1e-12)
    shape = modes.shapes.at(np.sort(points, axis=0))[1:-1, 7]
    assert (np.diff(np.sign(shape[shape != 0.0])) != 0.0).sum() == 7
    assert_allclose(np.abs(shape).max(), np.sqrt(2.0 / modes.mass), rtol=0.02)  # that of a sine; 6 points a half wave


def test_shapes_known_at_points_only_are_not_refined():
    modes = fi.Modes.from_arrays(
        [100.0], [[1.0], [0.5], [0.2]], points=[[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]], mass=1.0, complete=True
    )
    assert modes.to_pyvista().n_points == 3
