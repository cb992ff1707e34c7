"""A finer grid covers the same body with triangles that fit together."""

import numpy as np
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.modes import viewing
from fem_impact.show import sampling


def areas(points, cells):
    (x0, y0), (x1, y1), (x2, y2) = (points[cells[:, i]].T for i in range(3))
    return 0.5 * ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0))


def test_refined_triangles_cover_the_body_once_fit_together_and_keep_their_orientation():
    plate = fi.Plate(fi.Material(E=1.0, nu=0.3, rho=1.0), 1.0)
    system = fi.assemble(fi.mesh.rectangle(1.5, 1.0, size=0.5), plate, supports={"boundary": "hinged"})
    coarse = fi.find_modes(system, n_modes=1)
    points, cells = sampling.grid(coarse)
    assert len(points) >= viewing.ENOUGH
    assert_allclose(np.abs(areas(points, cells)).sum(), 1.5, rtol=1e-12)
    assert len(np.unique(points.round(12), axis=0)) == len(points)  # no point twice: neighbours share their sides
    assert_allclose([points.min(axis=0), points.max(axis=0)], [[0, 0], [1.5, 1.0]], atol=1e-12)
    before, after = (np.sign(areas(*grid)) for grid in (coarse.shapes.grid(), sampling.grid(coarse)))
    assert set(after) == set(before)


def test_beams_and_rigid_masses_are_left_as_they_are():
    beam = fi.analytic.beam(0.4, mass=0.1, first_frequency=1e3, n_modes=3)
    for modes in (beam, fi.Modes.rigid(1.0)):
        for drawn, own in zip(sampling.grid(modes), modes.shapes.grid()):
            np.testing.assert_array_equal(drawn, own)


def test_the_telling_instant_is_when_the_plate_has_begun_to_yield(hit):
    times = np.linspace(0.0, sampling.end_of(hit), 50)
    depth = np.abs(hit.displacement([hit.at], times)[:, 0])
    first = sampling.telling(hit, times)
    assert depth[first] >= 0.5 * depth.max() > depth[:first].max()
