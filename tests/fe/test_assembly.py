"""Assembly: supports, invariance, and elements that do not remember another mesh."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse.linalg import splu
from skfem import BilinearForm, CellBasis, ElementTriArgyris, MeshTri
from skfem.element import DiscreteField
from skfem.helpers import dd, ddot, eye, trace

from fem_impact import mesh
from fem_impact.fe import assembly
from fem_impact.fe.assembly import assemble
from fem_impact.fe.elements import ArgyrisSpace
from fem_impact.fe.section import Beam, Material, Plate
from fem_impact.modes.finding import find_modes

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
PLATE = Plate(STEEL, 2e-3)


class Argyris(ElementTriArgyris):
    """scikit-fem's Argyris element with the shape functions of `ArgyrisSpace`."""

    def __init__(self, space):
        self.space, self.fields, self.asked = space, [], None

    def gbasis(self, mapping, X, i, tind=None):
        cells = np.arange(len(self.space.origin)) if tind is None else tind
        if X is not self.asked:
            points = mapping.F(X, tind=tind).transpose(1, 2, 0)  # (n_cells, n_q, 2)
            self.fields, self.asked = self.space.functions(cells, points, (0, 1, 2)), X
        value, gradient, hessian = self.fields
        xx, xy, yy = hessian[:, 0, :, i], hessian[:, 1, :, i], hessian[:, 2, :, i]
        grad = gradient[..., i].transpose(1, 0, 2)
        return (DiscreteField(value=value[..., i], grad=grad, hess=np.array([[xx, xy], [xy, yy]])),)


def test_stiffness_is_that_of_scikit_fem_s_own_assembly():
    square = mesh.rectangle(1.0, 1.0, size=0.5)
    system = assemble(square, PLATE)
    frame = system.frame
    plane = MeshTri((square.points.T - frame.centre[:, None]) / frame.length, square.cells.T)
    basis = CellBasis(plane, Argyris(ArgyrisSpace(plane)), intorder=10)

    @BilinearForm
    def bending(u, v, _):
        return ddot(0.7 * dd(u) + 0.3 * eye(trace(dd(u)), 2), dd(v))

    whole = bending.assemble(basis)
    expand = system.expand[: basis.N]  # corners are split into unknowns of their own behind the regular ones
    inside = np.setdiff1d(np.arange(basis.N), basis.nodal_dofs[:, np.unique(square.facets)])
    columns = np.unique(expand[inside].nonzero()[1])
    scale = expand[:, columns]
    assert_allclose((scale.T @ whole @ scale - system.K[columns][:, columns]).toarray(), 0.0, atol=1e-11)  # of one


def test_an_element_made_for_one_mesh_leaves_the_next_alone():
    first = assemble(mesh.rectangle(1.0, 1.0, size=0.5), PLATE, {"boundary": "hinged"})
    assemble(mesh.rectangle(2.0, 0.3, size=0.1), PLATE, {"boundary": "hinged"})
    again = assemble(mesh.rectangle(1.0, 1.0, size=0.5), PLATE, {"boundary": "hinged"})
    assert abs(first.K - again.K).max() == 0.0


def test_mass_is_area_times_thickness_times_density():
    assert_allclose(assemble(mesh.rectangle(1.5, 1.0), PLATE).mass, 1.5 * 2e-3 * 7850, rtol=1e-12)
    beam = Beam.rectangular(STEEL, width=0.02, height=lambda x: 0.01 * (1 + x[:, 0]))
    assert_allclose(assemble(mesh.line(2.0), beam).mass, 7850 * 0.02 * 0.01 * 4.0, rtol=1e-12)


@pytest.mark.parametrize(
    ("supports", "n_rigid"),
    [({}, 3), ({"left": "hinged"}, 1), ({"left": "hinged", "bottom": "hinged"}, 0), ({"left": "clamped"}, 0)],
)
def test_rigid_motions_left_by_the_supports(supports, n_rigid):
    system = assemble(mesh.rectangle(1.0, 1.0, size=0.5), PLATE, supports)
    assert system.rigid.shape[1] == n_rigid
    assert_allclose(system.K @ system.rigid, 0.0, atol=1e-11)  # of a stiffness with ones on its diagonal
    assert_allclose(system.rigid.T @ system.M @ system.rigid, np.eye(n_rigid), atol=1e-12)


def test_interpolation_reproduces_a_quintic_anywhere_on_the_plate():
    # a body far from the origin and as thin as a needle keeps every digit but the coordinates' own
    length, shift = 1e-3, 1e3
    plate = mesh.rectangle(length, 0.01 * length, size=0.01 * length)
    moved = mesh.straight(plate.points + shift, plate.cells, plate.facets, plate.edges)
    system = assemble(moved, PLATE)
    motion = system.rigid @ np.array([1.0, 2.0, 3.0])
    points = shift + np.array([[0.1, 0.003], [0.5, 0.008], [0.9, 0.001]]) * length
    values = system.interpolate(points) @ motion
    corner = system.interpolate(shift + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.01]]) * length) @ motion
    x, y = ((points - shift) / length).T
    wanted = corner[0] + (corner[1] - corner[0]) * x + (corner[2] - corner[0]) * y / 0.01
    assert_allclose(values, wanted, rtol=1e-7)  # 1e3 m in floats leave 1e-13 m of 1e-5 m


@pytest.mark.parametrize("at", [(0.37, 0.41), (0.5, 0.25), (0.5, 0.5)])  # in a triangle, on a side, at a vertex
def test_triangles_shrink_towards_a_point(at):
    shape = mesh.rectangle(1.0, 1.0, size=0.25)
    plain = assemble(shape, PLATE, {"boundary": "hinged"})
    graded = assemble(shape, PLATE, {"boundary": "hinged"}, near=at)
    exact = find_modes(plain, n_modes=1).shapes.compliance(np.array([at]))[0, 0]  # the dip in closed form
    errors = []
    for system in (plain, graded):
        rows = system.interpolate(np.array([at]))
        load = rows.toarray().T
        found = (load.T @ splu(system.K.tocsc()).solve(load))[0, 0] / system.frame.mass / system.frame.rate**2
        errors.append(abs(found / exact - 1.0))
    assert errors[1] < 0.05 * errors[0]  # 0.03 and less were measured; what is left is the flat triangles around it
    points = np.random.default_rng(0).uniform(0.01, 0.99, (50, 2))
    assert graded.contains(points).all()


@pytest.mark.parametrize("kind", ["free", "hinged", "clamped"])
@pytest.mark.parametrize("coarseness", [1.0, 16.0])
def test_unknowns_are_counted_before_they_are_assembled(kind, coarseness):
    shape, at, held = mesh.rectangle(1.0, 0.7, size=0.1), (0.37, 0.41), {"boundary": kind}
    made = assemble(shape, PLATE, held, near=at, coarseness=coarseness).n_dofs
    told = assembly.unknowns_near(shape, PLATE, held, np.array([at]), coarseness=coarseness)
    assert abs(told / made - 1.0) < 0.02  # the docstring says 1 %


@pytest.mark.parametrize("at", [(0.37, 0.41), (0.37, 0.03)])  # inside and near a clamped edge
def test_compliance_errs_by_the_square_of_the_coarseness_at_the_load(at):
    found = {}
    for coarseness in (1.0, 8.0, 16.0, 32.0, 64.0):
        shape, held = mesh.rectangle(1.0, 1.0, size=0.1), {"boundary": "clamped"}
        system = assemble(shape, PLATE, held, near=at, coarseness=coarseness)
        load = system.interpolate(np.array([at])).toarray().T
        found[coarseness] = (load.T @ splu(system.K.tocsc()).solve(load))[0, 0]
    for coarseness in (8.0, 16.0, 32.0, 64.0):
        error = (1.0 - found[coarseness] / found[1.0]) / coarseness**2
        assert 2e-8 < error < 4e-7  # the docstring says 1e-7; 6e-8 to 2e-7 were found on other plates


@pytest.mark.parametrize(
    ("act", "text"),
    [
        (lambda: assemble(mesh.rectangle(1, 1), PLATE, {"lft": "hinged"}), "edge 'lft'.*did you mean 'left'"),
        (lambda: assemble(mesh.rectangle(1, 1), PLATE, {"left": "hinge"}), "one of clamped, hinged, free.*hinged"),
        (lambda: assemble(mesh.line(1), PLATE), "section must be a Beam"),
        (lambda: assemble("plate.msh", PLATE), "mesh must be a Mesh of fi.mesh"),
        (lambda: assemble(mesh.rectangle(1, 1), PLATE, near=(2.0, 0.5)), r"near must lie on the body.*\(2, 0.5\) m"),
        (lambda: assemble(mesh.rectangle(1, 1), PLATE, near=(0.5, 0.5), coarseness=0.5), "at least 1, got 0.5"),
        (
            lambda: assemble(mesh.rectangle(1, 1), PLATE, element="morly"),
            "one of argyris, morley.*did you mean 'morley'",
        ),
    ],
)
def test_refuses_supports_and_sections_that_do_not_fit(act, text):
    with pytest.raises(ValueError, match=text):
        act()
