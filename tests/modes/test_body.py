"""Bodies from other programs: read, struck anywhere in any direction, and what is missing told."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import fem_impact as fi
from fem_impact.modes import viewing

pytestmark = pytest.mark.usefixtures("read_here")
STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
LAW = fi.Contact.linear(1e6)
LOADS = [(1, (0.0, 0.0, 2.0)), (5, (0.0, 0.0, -1.0))]  # N


def struck(modes, at, law=LAW, mass=0.05, tolerance=1e-2):
    return fi.strike(modes, fi.Striker.rigid(mass), law, at=at, speed=1.0, tolerance=tolerance)


def hinged(n_modes, n=(9, 7)):
    """Modes of a hinged plate, and points."""
    x, y = np.meshgrid(np.linspace(0.0, 0.4, n[0]), np.linspace(0.0, 0.3, n[1]), indexing="ij")
    plate = fi.analytic.rectangle(0.4, 0.3, section=fi.Plate(STEEL, 2e-3), n_modes=n_modes, damping_ratio=0.01)
    return plate, np.column_stack([x.ravel(), y.ravel()])


def free_bar(n_modes):
    bar = fi.Beam.rectangular(STEEL, width=0.03, height=0.01)
    found = fi.analytic.beam(0.4, ends=("free", "free"), section=bar, n_modes=n_modes + 2, damping_ratio=0.01)
    return found, np.linspace(0.0, 0.4, 41)[:, None]


def body_of(modes, points, loads=(), turn=None, **more):
    """The body as another program knows it: moving along z, in three dimensions, maybe turned."""
    nodes = np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))])
    shapes, static = np.zeros((len(points), 3, modes.n_modes)), np.zeros((len(points), 3, len(loads)))
    shapes[:, 2] = modes.shape_at(points)
    for k, (number, force) in enumerate(loads):
        static[:, 2, k] = modes.shapes.deflection(points[[number - 1]], points)[:, 0] * force[2]
    if turn is not None:
        nodes, loads = nodes @ turn.T, [(number, turn @ force) for number, force in loads]
        shapes, static = np.einsum("ij,njm->nim", turn, shapes), np.einsum("ij,njm->nim", turn, static)
    told = {"mass": modes.mass, "damping_ratio": modes.damping_ratio, "static": static, "loads": loads} | more
    return fi.Body(modes.frequencies, shapes, nodes, **told)


@pytest.mark.parametrize("make", [hinged, free_bar])
@pytest.mark.parametrize("n_modes", [5, 20, 100])
def test_a_body_of_our_own_comes_back_with_its_blow(make, n_modes):
    """The truth has 1000 modes; where the unit load is known, the rest of the body is exact."""
    many, points = make(1000 if make is hinged else 300)
    few, law, number = make(n_modes)[0], fi.Contact.linear(2e4), 12
    truth = struck(many, points[number - 1], law, tolerance=1e-5)
    for loads in ((), [(number, (0.0, 0.0, 3.0))]):
        body = body_of(few, points, loads)
        modes, at = body.modes("z"), body.at(number)
        found = struck(modes, at, law)
        assert abs(found.restitution - truth.restitution) <= found.error.total + truth.error.total
        assert abs(found.contact_time / truth.contact_time - 1.0) <= found.error.total + truth.error.total
        assert ("not stated of the target: static compliance" in found.verdict) is not bool(loads)
        if loads:
            place = points[[number - 1]]
            assert_allclose(modes.residual_compliance(at), few.residual_compliance(place), rtol=1e-9)


@pytest.fixture(scope="module")
def shell():
    """A shallow cap of steel by our own elements, and 100 of its modes."""
    plate, cap = fi.Plate(STEEL, 2e-3), fi.rise.cap(2.0)
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3), plate, {"boundary": "hinged"}, rise=cap)
    return system, fi.find_modes(system, n_modes=100, damping_ratio=0.01)


@pytest.mark.slow
def test_a_shell_of_our_own_comes_back_with_its_blow(shell):
    """The truth is the blow on the shell itself, which finds its own modes and compliance."""
    (system, many), law = shell, fi.Contact.linear(5e5)
    points, cells = many.shapes.grid()
    nodes = viewing.places_in_space(many, points)
    row = int(np.linalg.norm(points - (0.13, 0.11), axis=1).argmin())
    how = {"at": points[row], "speed": 1.0, "tolerance": 1e-3, "damping_ratio": 0.01}
    truth = fi.strike(system, fi.Striker.rigid(0.05), law, **how)
    assert truth.tolerance_met
    # measured: 0.39, 0.079 and 0.012 without the static solution, 0.37, 0.026 and 2.7e-4 with it
    for n_modes, known, most in ((5, False, 0.5), (5, True, 0.5), (20, False, 0.1), (20, True, 0.1),
                                 (100, False, 0.02), (100, True, 1e-3)):  # fmt: skip
        few = many.truncated(n_modes=n_modes)
        shapes, static = np.zeros((len(nodes), 3, n_modes)), np.zeros((len(nodes), 3, 1))
        shapes[:, 2], static[:, 2] = few.shape_at(points), few.shapes.deflection(points[[row]], points)
        told = {"static": static, "loads": [(row + 1, (0.0, 0.0, 1.0))]} if known else {}
        told |= {"damping_ratio": few.damping_ratio, "cells": cells, "solid": False}
        body = fi.Body(few.frequencies, shapes, nodes, system.mass, **told)
        found = struck(body.modes("z", free=False), body.at(row + 1), law)
        for name in ("restitution", "contact_time", "peak_force"):
            one, two = getattr(found, name), getattr(truth, name)
            assert abs(one - two) <= (found.error.total + truth.error.total) * (1.0 if name == "restitution" else two)
        assert ("not stated of the target: static compliance" in found.verdict) is not known
        assert found.error.total < most


def test_the_same_body_turned_in_space_has_the_same_blow():
    plate, points = hinged(20)
    turn = Rotation.from_euler("xyz", [0.3, -1.1, 2.0]).as_matrix()
    flat, turned = body_of(plate, points, LOADS), body_of(plate, points, LOADS, turn)
    assert turned.axes == [0, 1, 2] and flat.axes == [0, 1]
    one, two = flat.modes("normal"), turned.modes("normal")
    for number in (1, 5, 20):
        here, there = np.array([flat.at(number)]), np.array([turned.at(number)])
        assert_allclose(one.modal_compliance(here), two.modal_compliance(there), atol=1e-18)
    hits = [struck(modes, body.at(5)) for modes, body in ((one, flat), (two, turned))]
    assert_allclose(hits[0].restitution, hits[1].restitution, rtol=1e-3)
    here, there = (each.displacement(hit.modal_state([1e-3])[0], 20) for each, hit in zip((flat, turned), hits))
    assert_allclose(there, here @ turn.T, rtol=1e-2, atol=1e-9)


def test_unit_loads_count_along_their_direction_alone():
    """A load of 2 N gives twice the deflection; one against the direction the same compliance."""
    plate, points = hinged(8)
    body = body_of(plate, points, [(20, (0.0, 0.0, -2.0))])
    known, at = body.modes("z"), np.array([body.at(20)])
    assert_allclose(known.shapes.compliance(at), plate.shapes.compliance(points[[19]]))
    assert not known.shapes.compliance_error(at).any()
    assert known.shapes.compliance_error(np.array([body.at(18)])).all()
    assert body.modes((0.0, 1.0, 1.0)).shapes.compliance_error(at).all()
    between = known.shapes.deflection(np.array([body.at(18)]), at)
    assert_allclose(between, known.shapes.deflection(at, np.array([body.at(18)])).T)  # reciprocity


def test_a_flat_body_turned_in_space_is_known_as_well_as_before():
    """The same interval of what is left out, and the same sign that it is held."""
    plate, points = hinged(12)
    turn = Rotation.from_euler("xyz", [0.3, -1.1, 2.0]).as_matrix()
    flat, turned = (body_of(plate, points, turn=each) for each in (None, turn))
    one, two = flat.modes("normal"), turned.modes("normal")
    assert one.unstated == two.unstated == ("compliance",)
    for number in (10, 20):
        here, there = np.array([flat.at(number)]), np.array([turned.at(number)])
        assert_allclose(one.shapes.compliance_error(here), two.shapes.compliance_error(there), rtol=1e-9)
    bar, points = free_bar(5)
    elastic = fi.Body(bar.frequencies[2:], body_of(bar, points).shapes[:, :, 2:], body_of(bar, points).nodes, bar.mass)
    assert elastic.modes("z", free=True).n_rigid == 2
    with pytest.raises(ValueError, match="give them as modes of 0 Hz"):
        elastic.modes("x", free=True)


def test_strike_points_by_number_name_and_place():
    plate, points = hinged(5)
    body = body_of(plate, points, names={"corner": 623}, numbers=np.arange(1, 64) * 10 - 7)
    number = int(body.numbers[30])
    assert body.node(number) == 30 and body.node(body.nodes[30] + 1e-5) == 30
    with pytest.raises(ValueError, match=r"where must be a node of the body, got 5; nodes are .* names corner"):
        body.node(5)
    with pytest.raises(ValueError, match="where must be one of corner"):
        body.node("middle")
    with pytest.raises(ValueError, match=r"0.0\d+ m away from the nearest, node \d+ at \(.*\) m; give that one"):
        body.node((0.03, 0.0, 0.0))


def test_arrays_and_tables_come_back(tmp_path):
    plate, points = hinged(6)
    body = body_of(plate, points, LOADS, names={"middle": 32}, numbers=np.arange(1, 64))
    table = xr.Dataset({
        "frequencies": ("mode", body.frequencies), "shapes": (("node", "axis", "mode"), body.shapes),
        "nodes": (("node", "axis"), body.nodes), "numbers": ("node", body.numbers), "mass": body.mass,
        "static": (("node", "axis", "load"), body.static), "loads": (("load", "number_force"), body.loads),
        "damping_ratio": ("mode", body.damping_ratio),
    })  # fmt: skip
    for again in (fi.Body.load(body.save(tmp_path / "plate")), fi.Body.load(table)):
        found, wanted = (each.modes("z").shapes.compliance(np.array([each.at(5)])) for each in (again, body))
        assert_allclose(found, wanted)
        assert_allclose(again.modes("z").damping_ratio, 0.01)
    assert fi.Body.load(tmp_path / "plate.npz").at("middle") == body.at("middle")


def test_rounding_of_rigid_motions_is_none():
    body = body_of(*free_bar(4))
    noisy = body.frequencies + np.array([1e-5, 2e-4, 0.0, 0.0, 0.0, 0.0])
    told = {"shapes": (("n", "x", "m"), body.shapes), "nodes": (("n", "x"), body.nodes)}
    assert fi.Body.load(xr.Dataset(told | {"frequencies": ("m", noisy)}), mass=1.0).modes("z").n_rigid == 2


@pytest.mark.parametrize(("change", "text"), [
    ({"shapes": np.zeros((63, 3, 2))}, r"shapes must have shape \(63, 3, 5\)"),
    ({"numbers": np.ones(63)}, "numbers must be whole and differ"),
    ({"numbers": np.arange(63) + 0.5}, "numbers must be whole and differ"),
    ({"cells": [[0, 1, 63]]}, "cells must be rows of nodes from 0 to 62"),
    ({"names": {"rim": 99}}, "'rim' must be a node of the body, got 99"),
    ({"loads": [(1, 2.0)]}, r"loads must have shape \(3\)"),
    ({"names": {"rim": "a"}}, r"names\['rim'\] must be"),
])  # fmt: skip
def test_what_is_no_body_is_refused(change, text):
    plate, points = hinged(5)
    body = body_of(plate, points)
    told = {"frequencies": body.frequencies, "shapes": body.shapes, "nodes": body.nodes, "mass": 1.0} | change
    with pytest.raises(ValueError, match=text):
        fi.Body(**told)


def test_nodes_at_one_place_that_move_otherwise_cannot_be_struck():
    """A blow at either was one at whichever came first."""
    nodes = [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.2, 0.0)]
    shapes = np.zeros((5, 3, 1))
    shapes[:, 2, 0] = [1.2, -0.9, 0.4, 0.3, 0.3]
    body = fi.Body([110.0], shapes, nodes, mass=0.5)
    modes = body.modes("z")
    assert modes.shape_at([body.at(1), body.at(5)]).ravel().tolist() == [1.2, 0.3]
    with pytest.raises(ValueError, match="at must lie on the body"):
        struck(modes, body.at(2))
