"""Assembly: supports, invariance, and elements that do not remember another mesh."""

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose
from scipy.sparse.linalg import splu

import fem_impact as fi
from fem_impact.fe import assembly
from fem_impact.mesh.facets import CURVE_STEPS

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
PLATE = fi.Plate(STEEL, 2e-3)


def test_an_element_made_for_one_mesh_leaves_the_next_alone():
    sizes = {(1.0, 1.0): 0.5, (2.0, 0.3): 0.1}
    first, _, again = (
        fi.assemble(fi.mesh.rectangle(*sides, size=sizes[sides]), PLATE, {"boundary": "hinged"})
        for sides in ((1.0, 1.0), (2.0, 0.3), (1.0, 1.0))
    )
    assert abs(first.K - again.K).max() == 0.0


@pytest.mark.parametrize(
    ("supports", "n_rigid"),
    [({}, 3), ({"left": "hinged"}, 1), ({"left": "hinged", "bottom": "hinged"}, 0), ({"left": "clamped"}, 0)],
)
def test_rigid_motions_left_by_the_supports(supports, n_rigid):
    system = fi.assemble(fi.mesh.rectangle(1.0, 1.0, size=0.5), PLATE, supports)
    assert system.rigid.shape[1] == n_rigid
    assert_allclose(system.K @ system.rigid, 0.0, atol=1e-11)  # of a stiffness with ones on its diagonal
    assert_allclose(system.rigid.T @ system.M @ system.rigid, np.eye(n_rigid), atol=1e-12)


@pytest.mark.parametrize("degrees", [40.0, 60.0, 75.0, 100.0])
def test_a_plate_turns_about_a_hinged_edge_in_any_direction(degrees):
    """Rounding at the hundreds of vertices of the rings at its corners is not a support."""
    tip = 0.3 * np.cos(np.radians(degrees)), 0.3 * np.sin(np.radians(degrees))
    for edge in ("edge0", "edge1", "edge2"):
        system = fi.assemble(fi.mesh.polygon([(0.0, 0.0), (0.3, 0.0), tip]), PLATE, {edge: "hinged"})
        assert system.rigid.shape[1] == 1
        assert fi.find_modes(system, n_modes=2).frequencies[1] > 1.0


def test_a_rigid_motion_is_linear_in_the_place_however_thin_and_far_away_the_plate_is():
    length, shift = 1e-3, 1e3
    plate = fi.mesh.rectangle(length, 0.01 * length, size=0.01 * length)
    system = fi.assemble(fi.mesh.straight(plate.points + shift, plate.cells, plate.facets, plate.edges), PLATE)
    places = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.01], [0.1, 0.003], [0.5, 0.008], [0.9, 0.001]])
    corner, along, across, *values = system.interpolate(shift + places * length) @ system.rigid @ [1.0, 2.0, 3.0]
    x, y = places[3:].T
    wanted = corner + (along - corner) * x + (across - corner) * y / 0.01
    assert_allclose(values, wanted, rtol=1e-7)  # 1e3 m in floats leave 1e-13 m of 1e-5 m


def dip(system, at):
    """Compliance [m/N] at a point by the elements alone."""
    load = system.interpolate(np.array([at])).toarray().T
    return (load.T @ splu(system.K.tocsc()).solve(load))[0, 0] / system.frame.mass / system.frame.rate**2


@pytest.mark.parametrize("at", [(0.37, 0.41), (0.5, 0.25), (0.5, 0.5)])  # in a triangle, on a side, at a vertex
def test_triangles_shrink_towards_a_point(at):
    shape = fi.mesh.rectangle(1.0, 1.0, size=0.25)
    plain, graded = (fi.assemble(shape, PLATE, {"boundary": "hinged"}, near=near) for near in (None, at))
    exact = fi.find_modes(plain, n_modes=1).shapes.compliance(np.array([at]))[0, 0]  # the dip in closed form
    rough, fine = (abs(dip(system, at) / exact - 1.0) for system in (plain, graded))
    assert fine < 0.05 * rough  # 0.03 and less were measured; what is left is the flat triangles around it
    assert graded.contains(np.random.default_rng(0).uniform(0.01, 0.99, (50, 2))).all()


@pytest.mark.parametrize(("kind", "coarseness"), [("free", 1.0), ("hinged", 16.0), ("clamped", 1.0), ("clamped", 16.0)])
def test_unknowns_are_counted_before_they_are_assembled(kind, coarseness):
    shape, at, held = fi.mesh.rectangle(1.0, 0.7, size=0.1), (0.37, 0.41), {"boundary": kind}
    made = fi.assemble(shape, PLATE, held, near=at, coarseness=coarseness).n_dofs
    told = assembly.unknowns_near(shape, PLATE, held, np.array([at]), coarseness=coarseness)
    assert abs(told / made - 1.0) < 0.02  # the docstring says 1 %


@pytest.mark.parametrize("at", [(0.37, 0.41), (0.37, 0.03)])  # inside and near a clamped edge
def test_compliance_errs_by_the_square_of_the_coarseness_at_the_load(at):
    shape, held = fi.mesh.rectangle(1.0, 1.0, size=0.1), {"boundary": "clamped"}
    fine, *coarse = (dip(fi.assemble(shape, PLATE, held, near=at, coarseness=c), at) for c in (1.0, 8.0, 64.0))
    for coarseness, found in zip((8.0, 64.0), coarse):
        # the docstring says 1e-7; 6e-8 to 2e-7 were found on other plates
        assert 2e-8 < (1.0 - found / fine) / coarseness**2 < 4e-7


test_refuses_supports_and_sections_that_do_not_fit = refusing([
    (fi.mesh.rectangle(1, 1), PLATE, {"supports": {"lft": "hinged"}}, "edge 'lft'.*did you mean 'left'"),
    (fi.mesh.line(1), PLATE, {}, "section must be a Beam"),
    ("plate.msh", PLATE, {}, "mesh must be a Mesh of fi.mesh"),
    (fi.mesh.rectangle(1, 1), PLATE, {"near": (2.0, 0.5)}, r"near must lie on the body.*\(2, 0.5\) m"),
    (fi.mesh.rectangle(1, 1), PLATE, {"near": (0.5, 0.5), "coarseness": 0.5}, "at least 1, got 0.5"),
    (fi.mesh.rectangle(1, 1), PLATE, {"element": "morly"}, "one of argyris, morley.*did you mean 'morley'"),
], lambda body, section, more: fi.assemble(body, section, **more))  # fmt: skip


def test_points_beside_a_body_are_sought_together(monkeypatch):
    """One by one, those of a lattice around a disk took `fi.in_air` minutes."""
    system = fi.assemble(fi.mesh.disk(0.2, hole=0.05), fi.Plate(fi.Material(70e9, 0.33, 2700.0), 1e-3), {})
    points, space, calls = np.random.default_rng(0).uniform(-0.25, 0.25, (2000, 2)), system.space, []
    deepest = space._deepest
    monkeypatch.setattr(type(space), "_deepest", lambda self, *given: calls.append(0) or deepest(*given))
    inside, radius = system.contains(points), np.hypot(*points.T)
    assert np.array_equal(inside, (radius < 0.2) & (radius > 0.05)) and len(calls) == 2
    where, every = system.frame.local(points[inside][:200]), np.arange(len(space.origin))
    near, far = (np.array([deepest(x[None], each[None])[1][0] for x, each in zip(where, cells)])
                 for cells in (space.locate(where)[0][:, None], np.broadcast_to(every, (200, len(every)))))  # fmt: skip
    assert (near == far).all()


def test_points_well_inside_a_triangle_bend_no_other(monkeypatch):
    space, bent = fi.assemble(fi.mesh.disk(0.2), PLATE, {}).space, []
    shift = space.bent.shift
    monkeypatch.setattr(space.bent, "shift", lambda cells, area: bent.extend(cells) or shift(cells, area))
    cells, inside = space.locate(space.origin)
    assert inside.all() and (cells == np.arange(len(cells))).all() and set(bent) == set(np.flatnonzero(space.curved))
    assert len(bent) == CURVE_STEPS * space.curved.sum()
