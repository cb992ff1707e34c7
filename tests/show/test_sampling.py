"""A finer grid covers the same body with triangles that fit together."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_impact import mesh
from fem_impact.fe.assembly import assemble
from fem_impact.fe.section import Material, Plate
from fem_impact.impact.collision import strike
from fem_impact.impact.contact import Contact
from fem_impact.impact.striker import Striker
from fem_impact.modes import analytic, viewing
from fem_impact.modes.modal import Modes, find_modes
from fem_impact.show import sampling


def areas(points, cells):
    (x0, y0), (x1, y1), (x2, y2) = (points[cells[:, i]].T for i in range(3))
    return 0.5 * ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0))


@pytest.fixture(scope="module")
def coarse():
    plate = Plate(Material(E=1.0, nu=0.3, rho=1.0), 1.0)
    system = assemble(mesh.rectangle(1.5, 1.0, size=0.5), plate, supports={"boundary": "hinged"})
    return find_modes(system, n_modes=1)


def test_refined_triangles_cover_the_body_once_and_fit_together(coarse):
    points, cells = sampling.grid(coarse)
    assert len(points) >= viewing.ENOUGH
    assert_allclose(np.abs(areas(points, cells)).sum(), 1.5, rtol=1e-12)
    assert len(np.unique(points.round(12), axis=0)) == len(points)  # no point twice: neighbours share their sides
    assert_allclose([points.min(axis=0), points.max(axis=0)], [[0, 0], [1.5, 1.0]], atol=1e-12)


def test_orientation_is_kept(coarse):
    before, after = (np.sign(areas(*grid)) for grid in (coarse.shapes.grid(), sampling.grid(coarse)))
    assert set(after) == set(before)


def test_beams_and_rigid_masses_are_left_as_they_are():
    beam = analytic.beam(0.4, mass=0.1, first_frequency=1e3, n_modes=3)
    for modes in (beam, Modes.rigid(1.0)):
        for drawn, own in zip(sampling.grid(modes), modes.shapes.grid()):
            np.testing.assert_array_equal(drawn, own)


def test_the_telling_instant_is_when_the_plate_has_begun_to_yield():
    plate = analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=30)
    hit = strike(plate, Striker.rigid(0.03), Contact.hertz(695e3), at=(0.1395, 0.09), speed=2.0, tolerance=1e-2)
    times = np.linspace(0.0, sampling.end_of(hit), 50)
    depth = np.abs(hit.displacement([hit.at], times)[:, 0])
    first = sampling.telling(hit, times)
    assert depth[first] >= 0.5 * depth.max() > depth[:first].max()
