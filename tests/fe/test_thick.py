"""Mindlin plates against Wang's relation, disks, Navier's series, Ritz, beams and solids; their error estimates."""

import numpy as np
import pytest
import thick_elements  # the study, which has the exact equations
from numpy.testing import assert_allclose
from thick_plates import block, by_rotations, navier, ritz, spread_compliance

import fem_impact as fi
from fem_impact.fe import interpolation, refinement, thick
from fem_impact.fe.assembly import reassemble

UNIT = fi.Material(E=1.0, nu=0.3, rho=1.0)
ALUMINIUM = fi.Material(E=70e9, nu=0.3, rho=2700.0)
POLYGONS = {"triangle": [(0, 0), (1, 0), (0, 1)], "quadrilateral": [(0, 0), (1.3, 0.1), (1.1, 0.9), (0.2, 1.0)]}
WOOD = {"E_along": 11e9, "E_across": 0.8e9, "nu": 0.37, "G": 0.7e9, "rho": 430.0, "G_xz": 0.6e9, "G_yz": 0.04e9}


def modes_of(mesh, h, supports, n, *, material=UNIT, **options):
    """Modes of a thick plate."""
    plate = h if isinstance(h, fi.Plate) else fi.Plate(material, h)
    return fi.find_modes(fi.assemble(mesh, plate, supports, theory="mindlin"), n_modes=n, **options)


@pytest.mark.parametrize("h", [0.1, 1e-3])
@pytest.mark.parametrize("name", POLYGONS)
def test_hinged_polygons_follow_wangs_relation_from_our_own_thin_frequencies(name, h):
    mesh, held = fi.mesh.polygon(POLYGONS[name]), {"boundary": "hinged"}
    thin = fi.find_modes(fi.assemble(mesh, fi.Plate(UNIT, h), held), n_modes=5, tolerance=2e-6)
    found = modes_of(mesh, h, held, 5, tolerance=5e-6)
    assert_allclose(found.omega, thick_elements.hinged_polygon(thin.omega, h), rtol=1e-5)
    if h == 0.1:  # the thin frequencies themselves are far off
        assert (thin.omega > 1.02 * found.omega).all()


@pytest.mark.slow
def test_a_hinged_l_shape_follows_wangs_relation_where_it_holds():
    """Modes 2, 3 and 4 are at rest at the re-entrant corner; of the others another element tells the truth."""
    h, mesh = 0.2, fi.mesh.polygon(thick_elements.L_SHAPE, size=0.2)
    system = fi.assemble(mesh, fi.Plate(UNIT, h), {"boundary": "hinged"}, theory="mindlin")
    assert system.space.turned.any()  # around the corner, where shear strains as unknowns made the matrix singular
    found = refinement._pairs(system, 5, None)[1]
    wang = thick_elements.hinged_polygon(thick_elements.L_MEMBRANE * thick_elements.thin_rate(h), h)
    assert_allclose(found[1:4], wang[1:4], rtol=1e-5)  # 6e-7
    assert found[0] > 1.1 * wang[0] and found[4] > 1.02 * wang[4]
    assert_allclose(found, by_rotations(mesh, h, 5, thick_elements.matrices), rtol=1e-5)  # 7e-7


@pytest.mark.parametrize("supports", [
    {"left": "clamped", "bottom": "hinged", "right": fi.Elastic(0.05, rotation=0.01)}, {},
])  # fmt: skip
def test_nodes_may_hold_rotations_instead_of_shear_strains(supports, monkeypatch):
    """The same functions: none of them, many or all turned give the same frequencies to rounding."""
    found, mesh = [], fi.mesh.rectangle(1.0, 1.0, size=0.5)
    for small in (0.0, 2.0, 1e9):  # the size of a triangle over the thickness: from none to all
        monkeypatch.setattr(thick, "SMALL", small)
        system = fi.assemble(mesh, fi.Plate(UNIT, lambda p: 0.2 + 0.1 * p[:, 0]), supports, theory="mindlin")
        found.append((system.space.turned.mean(), refinement._pairs(system, 8, None)[1]))
    shares, omega = zip(*found)
    assert shares[0] == 0.0 and 0.0 < shares[1] < 1.0 and shares[2] == 1.0
    for other in omega[1:]:
        assert_allclose(other, omega[0], rtol=1e-12)  # 1e-14


@pytest.mark.parametrize(("edge", "h"), [
    *((edge, 0.2) for edge in ("clamped", "hinged", "soft hinged", "free")),
    *(pytest.param(edge, 0.05, marks=pytest.mark.slow) for edge in ("soft hinged", "free")),
])  # fmt: skip
def test_disks_follow_their_characteristic_equations(edge, h):
    """Curved edges; the estimated error is neither below half of the true error nor 30 times as large."""
    exact = thick_elements.disk_frequencies(h, edge, 6)
    found = modes_of(fi.mesh.disk(1.0), h, {"boundary": edge}, 6 + 3 * (edge == "free"))
    flexible = found.omega > 0.0
    true = np.abs(found.omega[flexible] / exact - 1.0)
    assert true.max() < 3e-5  # the edge layers of the free one; 5e-6 if clamped or hinged
    claimed = found.frequency_error[flexible]
    assert (2.0 * claimed > true).all() and claimed.max() < 30.0 * true.max()


@pytest.mark.slow
@pytest.mark.parametrize("edge", ["clamped", "hinged"])
def test_the_order_on_thick_curved_plates_is_that_of_the_elements(edge):
    """Held edges once slipped between the vertices: order 3, 3e-4 on the first of these meshes."""
    exact, errors = thick_elements.disk_frequencies(0.2, edge, 5), []
    for size in (0.2, 0.1):
        system = fi.assemble(fi.mesh.disk(1.0, size=size), fi.Plate(UNIT, 0.2), {"boundary": edge}, theory="mindlin")
        errors.append(np.abs(refinement.solve_on_mesh(system, 5, None).omega / exact - 1.0).max())
    assert errors[0] < 1e-5  # 6e-6 if clamped
    assert np.log2(errors[0] / errors[1]) > 4.0  # 4.5 clamped; the size at the edge shrinks by less than 2


@pytest.mark.parametrize("sides", [("clamped",) * 4, ("soft hinged",) * 4, ("clamped", "free", "hinged", "free")])
def test_squares_agree_with_a_ritz_solution(sides):
    """Liew's method computed anew; 14th degree is converged to 1e-6 with singular corners, else to 1e-9."""
    held = dict(zip(("left", "right", "bottom", "top"), sides))
    found = modes_of(fi.mesh.rectangle(1.0, 1.0), 0.2, held, 6)
    assert_allclose(found.omega, ritz(0.2, 0.3, sides, 14, 6), rtol=2e-5)  # 1e-5 at free edges next to clamped ones


LIEW = {  # support and thickness of the unit square: omega / pi**2 sqrt(rho h / D), all digits printed
    ("hinged", 0.1): [1.9317], ("hinged", 0.2): [1.7679],
    ("clamped", 0.1): [3.2954, 6.2858, 6.2858, 8.8098, 10.3788, 10.4778],
    ("clamped", 0.2): [2.6875, 4.6907, 4.6907, 6.2985, 7.1767, 7.2759],
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("edge", "h"), LIEW)
def test_squares_have_the_digits_of_liews_tables(edge, h):
    """Liew, Xiang and Kitipornchai (1993), Int. J. Solids Struct. 30, 3357-3379: nu = 0.3, shear factor 5/6."""
    printed = np.array(LIEW[edge, h])
    system = fi.assemble(fi.mesh.rectangle(1.0, 1.0), fi.Plate(UNIT, h), {"boundary": edge}, theory="mindlin")
    found = refinement._pairs(system, len(printed), None)[1]
    assert_allclose(
        found / thick_elements.thin_rate(h) / np.pi**2, printed, atol=6e-5
    )  # half a digit, and 1e-5 of each


@pytest.mark.parametrize(("ratio", "size"), [(1e-3, 0.5), (1e-4, 0.25), (1e-5, 0.5)])
def test_thin_plates_become_kirchhoff_plates_on_any_mesh(ratio, size):
    """Nothing locks: on the same coarse triangles, both differ by what Wang's relation says, for each mode."""
    body = fi.mesh.rectangle(1.55, 1.0, size=size), fi.Plate(UNIT, ratio), {"boundary": "hinged"}
    thin, found = (
        refinement.solve_on_mesh(fi.assemble(*body, theory=theory), 6, None).omega for theory in (None, "mindlin")
    )
    expected = thick_elements.hinged_polygon(thin, ratio) / thin - 1.0  # -1e-10 ... -6e-6
    assert_allclose(found / thin - 1.0, expected, rtol=0.1, atol=3e-11)  # rounding 1e-11


@pytest.mark.parametrize("edge", ["clamped", "hinged"])
def test_thin_curved_plates_become_kirchhoff_plates(edge):
    exact = fi.analytic.disk(1.0, edge=edge, section=fi.Plate(UNIT, 1e-5), n_modes=6)
    found = modes_of(fi.mesh.disk(1.0), 1e-5, {"boundary": edge}, 6)
    assert_allclose(found.omega, exact.omega, rtol=5e-6)  # 1e-6; the theories differ by 1e-9


@pytest.mark.slow
def test_what_layers_of_free_edges_miss_is_claimed_where_they_are_hardly_resolved():
    """Facets below four thicknesses counted as fine: a tenth of the error was claimed; above, seventy times as much."""
    plate = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), 3e-3)
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3), plate, {"left": "clamped"}, theory="mindlin")
    fine = refinement.solve_on_mesh(reassemble(system, system.mesh.refined(1.5), layer=0.5), 8, None)
    for layer in (1.0, 2.0):
        found = refinement.solve_on_mesh(reassemble(system, system.mesh, layer=layer), 8, None)
        true = np.abs(found.omega / fine.omega - 1.0)
        assert (true <= found.error).all()
        assert found.error.max() < 30.0 * true.max()


def test_a_layer_too_thin_for_the_mesh_is_told_as_an_error():
    """The layer of a free disk is a hundredth of its radius, a facet a quarter; first-order theory tells its cost."""
    exact = thick_elements.disk_frequencies(0.02, "free", 5)
    system = fi.assemble(fi.mesh.disk(1.0, size=0.4), fi.Plate(UNIT, 0.02), {}, theory="mindlin")
    found = refinement.solve_on_mesh(reassemble(system, system.mesh, layer=100.0), 8, None)
    true = found.omega[3:] / exact - 1.0
    assert true.max() > 1e-4
    assert (found.error[3:] > 0.5 * np.abs(true)).all() and found.error.max() < 30.0 * np.abs(true).max()


def test_orthotropic_plates_under_tension_follow_naviers_solution():
    """Wood with all its shear moduli; by hand, three unknowns for each pair of half waves."""
    E1, E2, nu, G, rho, G1, G2 = WOOD.values()
    h, pull, inner = 0.02, 2e6, 1.0 - nu**2 * E2 / E1
    bending = h**3 / 12.0 * np.array([E1 / inner, E2 / inner, nu * E2 / inner, G])
    constants = [*bending, 5.0 / 6.0 * G1 * h, 5.0 / 6.0 * G2 * h, rho]
    plate = fi.Plate(fi.Material.orthotropic(**WOOD), h, tension=pull)
    found = modes_of(fi.mesh.rectangle(0.4, 0.3), plate, {"boundary": "hinged"}, 6)
    assert_allclose(found.omega, navier(0.4, 0.3, h, constants, 6, pull), rtol=1e-5)
    assert (found.omega > 1.1 * navier(0.4, 0.3, h, constants, 6)).any()  # the tension matters here


def test_the_grain_turns_with_its_angle():
    corners, turn = np.array([(0, 0), (0.4, 0), (0.35, 0.3), (0, 0.25)]), 0.4
    turned = corners @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    one, other = (
        modes_of(fi.mesh.polygon(place, size=0.1), 0.03, {"edge0": "clamped"}, 4, material=material).omega
        for place, material in (
            (at, fi.Material.orthotropic(**WOOD, angle=a)) for at, a in ((corners, 0.0), (turned, turn))
        )
    )
    assert_allclose(one, other, rtol=1e-5)


@pytest.mark.slow
def test_a_tapered_strip_on_springs_is_a_timoshenko_beam():
    """Without Poisson's contraction a strip bends like a beam; both have shear coefficient 5/6 then."""
    plain, width, height = fi.Material(E=70e9, nu=0.0, rho=2700.0), 0.05, lambda x: 0.04 + 0.05 * x[:, 0]
    springs = {"left": np.array([3e7, 2e4]), "right": np.array([1e7, 0.0])}

    def omega(mesh, section, theory, n_modes, over):
        held = {name: fi.Elastic(*(both / over)) for name, both in springs.items()}
        return fi.find_modes(fi.assemble(mesh, section, held, theory=theory), n_modes=n_modes).omega

    exact = omega(fi.mesh.line(0.4), fi.Beam.rectangular(plain, width=width, height=height), "timoshenko", 3, 1.0)
    strip = omega(fi.mesh.rectangle(0.4, width), fi.Plate(plain, height), "mindlin", 6, width)  # some twist
    assert np.abs(strip[:, None] / exact - 1.0).min(axis=0).max() < 1e-6


def test_the_deflection_under_a_spread_force_follows_its_series():
    """The force, and the deflection, are spread over the disk of radius 0.325 h; under a point it would be infinite."""
    at, h = np.array([[0.15, 0.17]]), 0.08
    modes = modes_of(fi.mesh.rectangle(0.5, 0.4), h, {"boundary": "hinged"}, 10, material=ALUMINIUM)
    exact = spread_compliance(0.5, 0.4, h, 70e9, 0.3, at[0], 0.325 * h)
    error = abs(modes.shapes.compliance(at)[0, 0] / exact - 1.0)
    assert error < 1e-4  # 2.5e-5; the bending part alone is 28 % less
    assert modes.shapes.compliance_error(at)[0] > error
    thin = fi.analytic.rectangle(0.5, 0.4, section=fi.Plate(ALUMINIUM, h), n_modes=1).shapes
    assert modes.shapes.compliance(at)[0, 0] > 1.2 * thin.compliance(at)[0, 0]
    carried = [modes.truncated(n_modes=n).modal_compliance(at)[0, 0] for n in (1, 4, 10)]
    assert np.all(np.diff(carried) >= 0.0) and carried[-1] < exact


def test_rigid_motions_are_exact_under_a_spread_force_at_edge_and_corner():
    modes = modes_of(fi.mesh.rectangle(0.5, 0.4), 0.05, {}, 6, material=ALUMINIUM)
    assert modes.n_rigid == 3 and modes.mass == pytest.approx(0.5 * 0.4 * 0.05 * 2700.0, rel=1e-12)
    places = np.array([[0.0, 0.0], [0.25, 0.0], [0.5, 0.4], [0.2, 0.2], [0.499, 0.1]])
    motion = modes.shape_at(places)[:, :3]
    plane = np.column_stack([np.ones(5), places])
    assert np.abs(motion - plane @ np.linalg.lstsq(plane, motion, rcond=None)[0]).max() < 1e-9  # linear in the place
    inertia = np.diag([1.0, 0.5**2 / 12.0 + 0.05**2 / 12.0, 0.4**2 / 12.0 + 0.05**2 / 12.0]) * modes.mass
    centred = np.column_stack([np.ones(5), places - [0.25, 0.2]])
    factor = np.linalg.lstsq(centred, motion, rcond=None)[0]
    assert_allclose(factor.T @ inertia @ factor, np.eye(3), atol=1e-9)


@pytest.mark.slow
def test_a_point_mass_adds_its_mass_and_a_support_does_not_move():
    body = fi.mesh.rectangle(0.5, 0.4), fi.Plate(ALUMINIUM, 0.03), {"left": "clamped"}
    bare, loaded = (fi.assemble(*body, theory="mindlin", point_masses=on) for on in ([], [((0.4, 0.2), 0.5)]))
    assert loaded.mass - bare.mass == pytest.approx(0.5)
    first = fi.find_modes(bare, n_modes=1)
    rest, free = first.shape_at([(0.0, 0.2), (0.4, 0.2)])[:, 0]
    assert abs(rest) < 1e-9 and first.shapes.compliance(np.array([[0.0, 0.2]]))[0, 0] == pytest.approx(0.0, abs=1e-20)
    rayleigh = first.omega[0] / np.sqrt(1.0 + 0.5 * free**2)
    assert fi.find_modes(loaded, n_modes=1).omega[0] == pytest.approx(rayleigh, rel=2e-3)  # Rayleigh's is from above


@pytest.mark.parametrize(("thickness", "supports", "more", "words"), [
    (0.1, {}, {"theory": "timoshenko"}, "theory must be one of kirchhoff, mindlin"),
    (0.1, {"boundary": "soft hinged"}, {}, "must be one of clamped, hinged, free, got 'soft hinged'"),
    (0.1, {}, {"element": "morley", "theory": "mindlin"}, "element must be"),
    ])  # fmt: skip
def test_refusals(thickness, supports, more, words):
    plate = thickness if isinstance(thickness, fi.Plate) else fi.Plate(UNIT, thickness)
    with pytest.raises(ValueError, match=words):
        fi.assemble(fi.mesh.rectangle(1.0, 1.0), plate, supports, **more)


def test_isotropic_plates_have_no_modulus_of_their_own_across_and_are_thin_unless_told():
    with pytest.raises(ValueError, match="G_xz needs an orthotropic material"):
        fi.Material(E=1.0, nu=0.3, rho=1.0, G_xz=0.1)
    assert fi.assemble(fi.mesh.rectangle(1.0, 1.0), fi.Plate(UNIT, 0.1)).theory == "kirchhoff"


@pytest.mark.slow
def test_a_free_block_of_one_to_five_is_a_mindlin_plate_within_a_hundredth():
    """Where the thin theory is 10 to 40 % off. The solid is converged to 1e-3."""
    exact = block((1.0, 1.0, 0.2), (8, 8, 2), 0.3, 6)
    thick_one = modes_of(fi.mesh.rectangle(1.0, 1.0), 0.2, {}, 9).omega[3:]
    thin = fi.find_modes(fi.assemble(fi.mesh.rectangle(1.0, 1.0), fi.Plate(UNIT, 0.2), {}), n_modes=9).omega[3:]
    assert_allclose(thick_one, exact, rtol=0.01)
    assert (thin > 1.05 * exact).all()


@pytest.mark.parametrize("beside", [0.0, 0.3])
@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_forces_beside_an_edge_act_over_their_disk_as_the_edge_cuts_it(turn, beside):
    """Of 144 places each once lay inside or not: the second moment across the edge erred by 2 to 8 %."""
    way = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    mesh = fi.mesh.polygon(np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 0.7), (0.0, 0.7)]) @ way.T)
    system, radius = fi.assemble(mesh, fi.Plate(UNIT, 0.1), theory="mindlin"), 0.05
    point = system.frame.local((way @ [(beside + 1e-9) * radius * system.frame.length, 0.35])[None])
    places, weights = interpolation.spread_forces(system.space, point, np.array([radius]))
    x = np.linspace(-beside, 1.0, 200001)  # over the radius
    chord = np.sqrt(1.0 - x**2)
    moment = [np.trapezoid(chord * x**n, x) for n in range(4)]
    lean = -moment[1] / moment[2]
    exact = (moment[2] + lean * moment[3]) / (moment[0] + lean * moment[1])
    assert_allclose(weights @ ((places - point) @ way)[:, 0] ** 2, exact * radius**2, rtol=1e-3)  # 2e-4


@pytest.mark.parametrize(("corner", "beside"), [
    ((0.0, 0.0), (0.57, 0.1)),  # over the radius; once 4 % off
    ((1.0, 0.6), (-0.06, -0.4)),
    ((0.4, 0.6), (0.06, -0.1)),  # re-entrant
    ((0.6, 0.2), (0.0, 0.4)),  # a hole a third as wide as the disk
    ])  # fmt: skip
def test_forces_in_corners_and_beside_small_holes_act_over_their_disk_as_the_edges_cut_it(corner, beside):
    outline = [(0, 0), (1, 0), (1, 0.6), (0.4, 0.6), (0.4, 1), (0, 1)]
    turn = np.linspace(0.0, 2.0 * np.pi, 33)[:-1]
    hole = np.array([0.6, 0.2]) + 0.01 * np.column_stack([np.cos(turn), np.sin(turn)])
    system, radius = fi.assemble(fi.mesh.polygon(outline, [hole]), fi.Plate(UNIT, 0.1), theory="mindlin"), 0.03
    point = np.array(corner) + np.array(beside) * radius
    places, weights = interpolation.spread_forces(system.space, system.frame.local(point[None]), np.array([radius]))
    x, y = (each.ravel() for each in np.meshgrid(*[np.arange(-0.9995, 1.0, 1e-3)] * 2))  # over the radius
    at = point[:, None] + radius * np.array([x, y])
    on = (x**2 + y**2 < 1.0) & ~((at[0] > 0.4) & (at[1] > 0.6)) & (at > 0.0).all(axis=0) & (at[0] < 1.0)
    on &= np.hypot(at[0] - 0.6, at[1] - 0.2) > 0.01
    about = np.array([x[on], y[on]])
    lean = np.linalg.solve(np.cov(about, bias=True), about.mean(axis=1))
    share = (1.0 - lean @ (about - about.mean(axis=1)[:, None])) / on.sum()
    found = (system.frame.to_metres(places) - point) / radius
    for i, j in ((0, 0), (0, 1), (1, 1)):
        assert_allclose(weights @ (found[:, i] * found[:, j]), share @ (about[i] * about[j]), atol=1e-3)
