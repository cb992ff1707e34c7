"""Static compliance of FE plates under a point against closed forms, inside, beside edges and on them."""

import functools

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.fe import point_load
from fem_impact.fe.section import KINDS
from fem_impact.modes import analytic

PLATE = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), thickness=2e-3)


def finite_elements(mesh, supports, points, section=PLATE):
    modes = fi.find_modes(fi.assemble(mesh, section, supports=supports), n_modes=6)
    return modes.shapes.compliance(np.array(points))


@functools.cache
def disk_of(edge):
    """The same disk by closed form and by finite elements."""
    exact = analytic.disk(0.2, edge=edge, section=PLATE, n_modes=6)
    return exact, fi.find_modes(fi.assemble(fi.mesh.disk(0.2), PLATE, supports={"boundary": edge}), n_modes=6)


@pytest.mark.slow
@pytest.mark.xdist_group("disks")
def test_deflection_elsewhere():
    points = 0.2 * np.array([[0.3, 0.2], [0.62, 0.45], [-0.1, -0.4], [0.0, 1.0]])
    for edge in KINDS:
        exact, modes = disk_of(edge)
        exact = exact.shapes
        expected = exact.deflection(points[:1], points)
        scale = np.abs(expected).max()
        assert_allclose(modes.shapes.deflection(points[:1], points), expected, atol=2e-5 * scale)
        assert_allclose(modes.shapes.compliance(points), exact.compliance(points), atol=2e-5 * scale)


def test_a_body_hinged_at_one_edge_balances_its_load_by_turning():
    meshes = (fi.mesh.rectangle(1.0, 0.8, size=size) for size in (0.1, 0.05))
    found, finer = (finite_elements(mesh, {"left": "hinged"}, [[0.5, 0.4]]) for mesh in meshes)
    assert_allclose(found, finer, rtol=2e-6)  # the coarser mesh's smooth part; 2e-7 measured


def navier(section, length, width, point, n_waves):
    """Static compliance of a hinged orthotropic rectangle, grain along x, by Navier's double series."""
    C = section.stiffness(np.zeros((1, 2)))[0]
    m, n = np.pi * np.arange(1, n_waves + 1)[:, None] / length, np.pi * np.arange(1, n_waves + 1) / width
    stiffness = C[0, 0] * m**4 + 2.0 * (C[0, 1] + 2.0 * C[2, 2]) * m**2 * n**2 + C[1, 1] * n**4
    return 4.0 / (length * width) * ((np.sin(m * point[0]) * np.sin(n * point[1])) ** 2 / stiffness).sum()


def test_tonewood():
    wood = fi.Material.orthotropic(E_along=10e9, E_across=0.7e9, nu=0.37, G=0.7e9, rho=420.0)
    section, point = fi.Plate(wood, thickness=3e-3), (0.2, 0.15)
    rough, fine = (navier(section, 0.5, 0.4, point, n) for n in (800, 1600))
    exact = fine + (fine - rough) / 3.0  # the tail falls with the square of the number of waves
    found = finite_elements(fi.mesh.rectangle(0.5, 0.4, size=0.05), {"boundary": "hinged"}, [point], section)
    assert_allclose(found, exact, rtol=2e-6)  # 2e-7 measured; the elements alone err by 1e-3


def test_the_grain_may_run_askew():
    wood = fi.Material.orthotropic(E_along=10e9, E_across=0.7e9, nu=0.37, G=0.7e9, rho=420.0, angle=0.5)
    section = fi.Plate(wood, thickness=3e-3)
    values = [
        finite_elements(fi.mesh.rectangle(0.5, 0.4, size=size), {"left": "clamped"}, [[0.2, 0.15]], section)
        for size in (0.08, 0.03)
    ]
    assert_allclose(*values, rtol=1e-4)  # 1.5e-5 measured


@pytest.mark.slow
def test_varying_thickness_needs_no_twin():
    mesh, held, points = fi.mesh.rectangle(1.0, 0.8), {"boundary": "clamped"}, [[0.3, 0.3], [0.71, 0.52]]
    taper = fi.Plate(PLATE.material, thickness=lambda x: 2e-3 * (1.0 + x[:, 0]))
    tapered = [finite_elements(fi.mesh.rectangle(1.0, 0.8, size=size), held, points, taper) for size in (0.1, 0.03)]
    assert_allclose(tapered[0], tapered[1], rtol=1e-5)
    uniform = [
        finite_elements(mesh, held, points, fi.Plate(PLATE.material, thickness=thickness))
        for thickness in (2e-3, lambda x: 2e-3 * (1.0 + 1e-9 * x[:, 0]))
    ]
    assert_allclose(*uniform, rtol=1e-7)


@pytest.mark.slow
def test_springs_tension_and_masses_are_part_of_it():
    edges = ("hinged", fi.Elastic(1e12))
    held, sprung = (finite_elements(fi.mesh.rectangle(0.3, 0.2), {"boundary": edge}, [[0.1, 0.07]]) for edge in edges)
    assert_allclose(sprung, held, rtol=1e-4)  # what the springs give: 1e-5
    skin = fi.Plate(fi.Material(E=3.5e9, nu=0.38, rho=1380.0), thickness=2e-4, tension=300.0)
    values = [
        point_load.static_deflection(
            fi.assemble(fi.mesh.disk(0.2, size=size), skin, {"boundary": "clamped"}), np.array([[0.05, 0.1]])
        ).compliance[0, 0]
        for size in (0.03, 0.015)
    ]
    assert_allclose(values[0], values[1], rtol=1e-4)  # its edge bends within three millimetres


def test_modes_softer_than_the_body_are_an_error():
    body, blow = (PLATE, {"boundary": "hinged"}), (fi.Striker.rigid(0.02), fi.Contact.linear(1e5))
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(0.3, 0.2), *body), n_modes=20)
    wrong = fi.Modes(0.5 * modes.omega, modes.damping_ratio, modes.shapes, modes.mass)
    with pytest.raises(fi.SimulationError, match=r"softer at \(0.1, 0.07\) m than the whole body"):
        fi.strike(wrong, *blow, at=(0.1, 0.07), speed=1.0)
    # "find the modes on a finer mesh": of this body, this time
    found = fi.find_modes(fi.assemble(fi.mesh.rectangle(0.3, 0.2, size=0.05), *body), n_modes=20)
    assert fi.strike(found, *blow, at=(0.1, 0.07), speed=1.0).n_impacts
