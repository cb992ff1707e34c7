"""Static compliance of FE plates under a point against closed forms, inside, beside edges and on them."""

import functools

import numpy as np
import pytest
from numpy.testing import assert_allclose
from references_plates import levy, rigidity

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


RARE = [pytest.param(place, marks=pytest.mark.slow) for place in (0.97, 0.9999)]


@pytest.mark.xdist_group("disks")
@pytest.mark.parametrize("edge", KINDS)
@pytest.mark.parametrize("place", [0.0, 0.999, 1.0, *RARE])
def test_disk(edge, place):
    exact, modes = disk_of(edge)
    system = modes.shapes.system
    ends = system.mesh.points[system.mesh.facets[0]]
    angle = np.arctan2(ends[:, 1], ends[:, 0])
    turn = (angle[1] - angle[0] + np.pi) % (2.0 * np.pi) - np.pi
    for share in (0.0, 0.5, 0.3):  # at a vertex of the rim, in mid-facet and between
        direction = angle[0] + share * turn
        point = place * 0.2 * np.array([[np.cos(direction), np.sin(direction)]])
        found, expected = (one.shapes.compliance(point)[0, 0] for one in (modes, exact))
        if place == 1.0 and edge != "free":
            assert abs(found) < 1e-12 * exact.shapes.compliance(np.zeros((1, 2)))[0, 0]  # it rests there
            continue
        error = abs(found / expected - 1.0)
        assert error < 2e-5  # 1e-6 at and inside a free edge, 5e-6 beside a held one
        assert error < 3.0 * modes.shapes.compliance_error(point)[0]


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


# Straight edges of every kind, on them, beside them and in the corners.
@pytest.mark.parametrize("edges", [
    ("free", "free"), ("hinged", "hinged"), *(pytest.param(edges, marks=pytest.mark.slow) for edges in (
        ("clamped", "free"), ("hinged", "free"), ("clamped", "clamped"))),
])  # fmt: skip
def test_plates_hinged_at_two_sides_have_levys_compliance(edges):
    length, width, nu = 0.3, 0.2, 0.33
    points = [(0.15, 0.1), (0.11, 0.07), (0.02, 0.16), (0.15, 2e-3), (3e-4, width - 2e-4), (0.003, width - 3e-3)]
    points += [(0.15, width - d) for d in (2e-5, 2e-4, 2e-3, 6e-3)]
    points += [(0.15, width), (0.07, width), (0.0123, width)] if edges[1] == "free" else []
    supports = {"left": "hinged", "right": "hinged", "bottom": edges[0], "top": edges[1]}
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(length, width), PLATE, supports=supports), n_modes=20)
    for point in points:
        expected = levy(edges, length, width, nu, point, point) / rigidity(70e9, nu, 2e-3)
        found = modes.shapes.compliance(np.array([point]))[0, 0]
        # 1e-7 and, beside held edges, 2e-6 measured
        assert abs(found / expected - 1.0) < min(5e-6, 3.0 * modes.shapes.compliance_error(np.array([point]))[0])
        assert modes.residual_compliance(np.array([point]))[0, 0] > 0.0  # what twenty modes leave of it


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
