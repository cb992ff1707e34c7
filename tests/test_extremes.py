"""Extremes: any unit, stiffness, place, order of nodes and shape of triangle gives the same frequencies."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_impact import mesh
from fem_impact.fe.assembly import assemble
from fem_impact.fe.eigenvalues import count_below
from fem_impact.fe.section import Beam, Material, Plate
from fem_impact.modes.finding import find_modes
from fem_impact.references.frequencies import hinged

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
PLATE = Plate(STEEL, 2e-3)
PER_RATE = np.sqrt(7850 * 2e-3 / (210e9 * 2e-3**3 / (12 * (1 - 0.3**2))))
QUADRILATERAL = mesh.polygon([(0, 0), (1.3, 0.1), (1.1, 0.9), (0.2, 1.0)], size=0.2)


def turned(angle=0.0, shift=0.0, seed=None):
    """The quadrilateral turned [rad], shifted [m] and with its nodes and triangles in another order."""
    shape = QUADRILATERAL
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    rng = np.random.default_rng(seed)
    order = np.arange(len(shape.points)) if seed is None else rng.permutation(len(shape.points))
    place = np.argsort(order)
    cells = place[shape.cells] if seed is None else rng.permuted(place[shape.cells], axis=1)[::-1]
    return replace(
        shape, points=(shape.points @ turn.T + shift)[order], cells=np.ascontiguousarray(cells),
        facets=place[shape.facets], middles=shape.middles @ turn.T + shift, tangents=shape.tangents @ turn.T,
    )  # fmt: skip


@pytest.mark.parametrize(
    "supports, change",
    [({"boundary": "hinged"}, {"angle": 0.7}), ({"boundary": "clamped"}, {"shift": 1e3}), ({}, {"seed": 4}),
     ({"edge0": "clamped"}, {"angle": 2.1, "shift": 5.0, "seed": 5}), ({}, {"angle": 2.1, "shift": 1e3})],
)  # fmt: skip
def test_place_turn_and_order_of_nodes_do_not_matter(supports, change):
    here = find_modes(assemble(QUADRILATERAL, PLATE, supports), n_modes=8)
    there = find_modes(assemble(turned(**change), PLATE, supports), n_modes=8)
    assert here.n_rigid == there.n_rigid
    assert_allclose(there.omega, here.omega, rtol=1e-9)  # 4e-12 was measured


@pytest.mark.parametrize("length", [1e-6, 1e3])
def test_frequencies_scale_with_length(length):
    wanted = find_modes(assemble(mesh.disk(1.0, size=0.3), PLATE), n_modes=6).omega
    found = find_modes(assemble(mesh.disk(length, size=0.3 * length), PLATE), n_modes=6).omega
    assert_allclose(found * length**2, wanted, rtol=1e-9)  # rounding


@pytest.mark.parametrize("E, thickness", [(1e3, 1e-6), (1e13, 0.1)])
def test_frequencies_scale_with_stiffness_and_thickness(E, thickness):
    plate = Plate(Material(E=E, nu=0.3, rho=1e3), thickness)
    unit = np.sqrt(E * thickness**2 / (12 * (1 - 0.3**2) * 1e3))
    wanted = find_modes(assemble(mesh.rectangle(1, 1, size=0.2), PLATE, {"boundary": "clamped"}), n_modes=3)
    found = find_modes(assemble(mesh.rectangle(1, 1, size=0.2), plate, {"boundary": "clamped"}), n_modes=3)
    assert_allclose(found.omega / unit, wanted.omega * PER_RATE, rtol=1e-11)  # rounding


@pytest.mark.parametrize(("aspect", "rtol"), [(100, 4e-5), (1000, 1e-6)])
def test_a_free_strip_is_a_free_beam(aspect, rtol):
    width = 1.0 / aspect
    strip = find_modes(assemble(mesh.rectangle(1.0, width), PLATE), n_modes=5)
    beam = find_modes(assemble(mesh.line(1.0), Beam.rectangular(STEEL, width=width, height=2e-3)), n_modes=4)
    # the sides of the strip curl over its width: relative (k width)**2 / 40, 2e-5 of the second at 1 : 100
    assert_allclose(strip.omega[3:], beam.omega[2:], rtol=rtol)


def test_needle_triangles_bend_like_others():
    fine = mesh.rectangle(1.0, 1.0, size=1 / 6)
    # squeeze the middle column of nodes: triangles of 1 : 300
    points = fine.points.copy()
    inner = np.isclose(points[:, 0], 0.5)
    points[inner, 0] = points[np.isclose(points[:, 0], 2 / 3), 0][0] - 5e-4
    squeezed = mesh.straight(points, fine.cells, fine.facets, fine.edges, size=fine.size)
    wanted = np.pi**2 * np.array([2.0, 5.0, 5.0])
    found = find_modes(assemble(squeezed, PLATE, {"boundary": "hinged"}), n_modes=3).omega * PER_RATE
    assert_allclose(found, wanted, rtol=3e-5)  # the wide triangles beside them are a third of the plate: (kh)**8


def test_no_mode_is_missed_in_a_dense_cluster():
    # a narrow ring clamped outside: a cantilever all round, whose modes crowd within 1e-4
    ring = assemble(mesh.disk(1.0, 0.97), PLATE, {"outer": "clamped"})
    modes = find_modes(ring, n_modes=12)
    system = modes.shapes.system
    above = (modes.omega[-1] / system.frame.rate) ** 2 * (1 + 1e-9)
    assert count_below(system.K, system.M, above) >= 12
    below = (modes.omega[0] / system.frame.rate) ** 2 * (1 - 1e-9)
    assert count_below(system.K, system.M, below) == 0


@pytest.mark.parametrize("supports", [{"boundary": "hinged"}, {"edge0": "clamped"}, {}])
@pytest.mark.slow
def test_compliance_stays_that_of_the_plate_where_corners_are_graded(supports):
    # narrow and wide corners, one short side: rings down to 1e-10 of the plate
    corners = [(0, 0), (1, 0), (1.02, 0.05), (0.3, 0.35), (0.25, 0.6), (0.1, 0.3)]
    modes = find_modes(assemble(mesh.polygon(corners), PLATE, supports), n_modes=60)
    at = [(0.4, 0.15)]
    carried, whole = modes.modal_compliance(at)[0, 0], modes.shapes.compliance(np.array(at))[0, 0]
    assert carried < whole < 1.2 * carried  # 60 modes leave a few percent
    assert (modes.omega[modes.n_rigid :] > 1.0).all()  # no rigid motion taken for a mode


def test_the_smallest_mesh_solves():
    one = find_modes(assemble(mesh.rectangle(1, 1, size=9.0), PLATE, {"boundary": "hinged"}), n_modes=1)
    assert one.omega[0] * PER_RATE > 2 * np.pi**2  # from above, with two triangles


@pytest.mark.slow
def test_a_hundred_thousand_unknowns():
    shape = mesh.rectangle(1.55, 1.0, size=1 / 84)
    modes = find_modes(assemble(shape, PLATE, {"boundary": "hinged"}), n_modes=10)
    assert modes.shapes.system.n_dofs > 95_000
    # rounding grows as the elements shrink: (1 / h)**4
    assert_allclose(modes.omega * PER_RATE, hinged(1.55, 1.0, 10), rtol=1e-8)
