"""FE modes against exact values, their order of convergence, and the static solution they add up to."""

from functools import partial

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose
from scipy import optimize
from scipy.integrate import solve_ivp

import fem_impact as fi
from fem_impact.references.case import TABLE
from fem_impact.references.frequencies import hinged

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
PLATE = fi.Plate(STEEL, 2e-3)
BAR = fi.Beam.rectangular(STEEL, width=0.02, height=0.01)
RIGIDITY = 210e9 * 2e-3**3 / (12 * (1 - 0.3**2))
PER_RATE = np.sqrt(7850 * 2e-3 / RIGIDITY)  # sqrt(rho h / D) of PLATE
SQUARE_CLAMPED, SQUARE_FREE, DISK_CLAMPED, DISK_HINGED, TRIANGLE_CLAMPED = (
    TABLE[name]["values"]
    for name in ("square-clamped", "square-free", "disk-clamped", "disk-hinged", "triangle-clamped")
)
RECTANGLE, SQUARE = fi.mesh.rectangle(1.55, 1.0), fi.mesh.rectangle(1.0, 1.0)
TRIANGLE = fi.mesh.polygon([(0, 0), (1, 0), (0, 1)])
# where all corners are convex, hinged plates are membranes twice over: of a hexagon with side 1
HEXAGON, HEXAGON_HINGED = fi.mesh.polygon(np.exp(1j * np.pi / 3 * np.arange(6))[:, None].view(float)), 7.15533913


def held(shape, kind="hinged", graded=True, element="argyris", **options):
    """Modes of a steel plate held all round, dimensions in metres."""
    return fi.find_modes(fi.assemble(shape, PLATE, {"boundary": kind}, element, graded=graded), **options)


def parameters(*given, **options):
    """Their dimensionless frequencies omega sqrt(rho h / D)."""
    return held(*given, **options).omega * PER_RATE


def ngon(n, size):
    return fi.mesh.polygon(np.exp(2j * np.pi / n * np.arange(n))[:, None].view(float), size=size)


def test_hinged_rectangle_is_exact_to_eight_digits():
    found = parameters(fi.mesh.rectangle(1.55, 1.0, size=1 / 12), n_modes=6)
    assert_allclose(found, hinged(1.55, 1.0, 6), rtol=1e-8)  # 1e-7 (kh)**8 = 8e-9 for the sixth
    # a size left open is chosen for the modes asked for: `Theory.wave` promises it
    assert_allclose(parameters(RECTANGLE, n_modes=60), hinged(1.55, 1.0, 60), rtol=5e-5)


@pytest.mark.parametrize(("shape", "sizes", "edge", "wanted", "order"), [
    (fi.mesh.disk, (0.24, 0.12), "clamped", DISK_CLAMPED[:3], 3.5),  # five to six were measured
    (fi.mesh.disk, (0.24, 0.12), "hinged", DISK_HINGED[:3], 3.5),
    # theory 8 once a wave has a few elements
    (partial(fi.mesh.rectangle, 1.0), (1 / 3, 1 / 6), "hinged", hinged(1.0, 1.0, 4), 6.0),
])  # fmt: skip
def test_order_on_curved_and_straight_edges(shape, sizes, edge, wanted, order):
    one, two = (np.abs(parameters(shape(1.0, size=size), edge, n_modes=len(wanted)) / wanted - 1.0) for size in sizes)
    assert (np.log2(one / two) > order).all()


def test_a_hinged_polygon_does_not_become_the_hinged_disk_but_ours_does():
    # Babuska's paradox: w = 0 on straight sides makes the slope vanish at each corner, and the limit is too stiff
    # graded=False: the sharp corners of the polygon would only add to the effect
    assert parameters(ngon(64, 0.2), graded=False, n_modes=1)[0] > 1.05 * DISK_HINGED[0]
    assert_allclose(parameters(fi.mesh.disk(1.0, size=0.2), n_modes=1), DISK_HINGED[:1], rtol=2e-6)


def test_hinged_hexagon_has_the_squared_spectrum_of_the_membrane():
    shape = ngon(6, 0.25)
    # 4e-6 was measured: corners of 120 degrees behave as r**1.5
    assert_allclose(parameters(shape, n_modes=1), [HEXAGON_HINGED], rtol=1e-5)
    coarse = parameters(shape, graded=False, n_modes=1)[0]
    assert coarse / HEXAGON_HINGED - 1.0 > 1e-3  # what the rings at the corners are for


def test_a_square_of_matching_wood_has_the_spectrum_of_a_rhombus():
    """A map of the plane leaves the energy of hinged sides alone if the material is mapped, too.

    The right angles of the wood are then as singular as the 120 degrees of the rhombus: r**1.5.
    """
    steep = np.array([[1.0, 0.5], [0.0, 0.75**0.5]])  # takes the unit square to the rhombus
    (across, along), turn = np.linalg.eigh(np.linalg.inv(steep.T @ steep))  # roots of the stiffnesses, axes
    coupling = 0.3 * along * across  # twist so that coupling + 2 twist = along across
    rest, twist = 1.0 - 0.3**2, 0.35 * along * across
    moduli = {"E_along": 12.0 * rest * along**2, "E_across": 12.0 * rest * across**2, "G": 12.0 * twist}
    angle = float(np.arctan2(turn[1, 1], turn[0, 1]))
    wood = fi.Material.orthotropic(**moduli, nu=coupling / across**2, rho=1.0, angle=angle)
    found = fi.find_modes(fi.assemble(SQUARE, fi.Plate(wood, 1.0), {"boundary": "hinged"}), n_modes=4)
    rhombus = parameters(fi.mesh.polygon(np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) @ steep.T), n_modes=4)
    assert_allclose(found.omega, rhombus, rtol=5e-6)  # 1e-6 was measured; 6e-3 without rings
    assert found.frequency_error.max() < 5e-6


def test_l_shape_is_stable_once_its_corner_is_graded():
    corners = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    one, two = (parameters(fi.mesh.polygon(corners, size=size), n_modes=1)[0] for size in (0.5, 0.25))
    assert_allclose(one, two, rtol=1e-4)  # r**(4/3) at the corner; ungraded meshes differ by 2 percent
    assert two < one  # conforming: from above


@pytest.mark.parametrize(("ends", "n_modes"), [
    *((ends, 8) for ends in [("clamped", "free"), ("free", "free"), ("hinged", "hinged"), ("hinged", "free")]),
    *((ends, 200) for ends in [("free", "free"), ("hinged", "free")]),
    *(pytest.param(ends, 1000, marks=pytest.mark.slow) for ends in [("clamped", "free"), ("hinged", "hinged")]),
])  # fmt: skip
def test_beams_keep_their_lowest_frequencies_however_many_are_asked_for(ends, n_modes):
    supports = {name: kind for name, kind in zip(("left", "right"), ends) if kind != "free"}
    found = fi.find_modes(fi.assemble(fi.mesh.line(0.5), BAR, supports), n_modes=n_modes)
    exact = fi.analytic.beam(0.5, ends=ends, section=BAR, n_modes=n_modes)
    flexible = exact.omega > 0.0
    error = np.abs(found.omega[flexible] / exact.omega[flexible] - 1.0)
    assert error.max() < (1e-12 if n_modes == 8 else 2e-8)  # rounding of K grows as the fourth power of the elements
    assert (error < 3.0 * found.frequency_error[flexible]).all()
    points = np.array([[0.0], [0.1234], [0.5]])
    assert_allclose(np.abs(found.shape_at(points)), np.abs(exact.shape_at(points)), atol=1e-5 * exact.mass**-0.5)


def shooting_frequencies(height, length, guess):
    """Frequencies [rad/s] of a cantilever of varying height, by integrating its equation from the free end."""
    width, E, rho = 0.02, 210e9, 7850.0

    def tip(omega):
        def rhs(x, u):
            h = height(np.array([[x]]))[0]
            (w, dw, m, v), stiffness = u.reshape(4, 2), E * width * h**3 / 12
            return np.array([dw, m / stiffness, v, omega**2 * rho * width * h * w]).ravel()

        start = np.zeros((4, 2))
        start[2, 0] = start[3, 1] = 1.0
        end = solve_ivp(rhs, (0.0, length), start.ravel(), method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        return np.linalg.det(end.reshape(4, 2)[2:])

    return [optimize.brentq(tip, g * 0.97, g * 1.03, rtol=1e-13) for g in guess]


@pytest.mark.parametrize("height", [
    lambda x: 0.01 * (1.0 - 1.6 * x[:, 0]),  # a wedge, a fifth as high at its end
    lambda x: np.interp(x[:, 0], [0.0, 0.11, 0.29, 0.5], [0.01, 0.012, 0.004, 0.01]),  # kinks
])  # fmt: skip
@pytest.mark.slow
def test_tapered_beams_meet_an_integration_of_their_equation(height):
    bar = fi.Beam.rectangular(STEEL, width=0.02, height=height)
    few, many = (fi.find_modes(fi.assemble(fi.mesh.line(0.5), bar, {"left": "clamped"}), n_modes=n) for n in (5, 300))
    assert_allclose(few.omega, shooting_frequencies(height, 0.5, few.omega), rtol=2e-9)  # the integrator's 1e-10
    assert_allclose(many.omega[:5], few.omega, rtol=1e-8)
    assert many.frequency_error.max() < 1e-6


def test_modes_are_mass_normalised_and_orthogonal():
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(1.0, 1.0, size=1 / 6), PLATE), n_modes=20)
    M, vectors = modes.shapes.system.M, modes.shapes.vectors
    assert_allclose(vectors.T @ (M @ vectors), np.eye(20), atol=1e-10)  # rounding


def test_degenerate_pair_spans_the_right_space():
    modes = held(fi.mesh.rectangle(1.0, 1.0, size=1 / 8), n_modes=3)
    points = np.array([[0.2, 0.3], [0.6, 0.1], [0.7, 0.8]])
    x, y = np.pi * points.T
    exact = 2.0 / np.sqrt(modes.mass) * np.column_stack([np.sin(2 * x) * np.sin(y), np.sin(x) * np.sin(2 * y)])
    pair = modes.shape_at(points)[:, 1:]
    assert_allclose(pair @ pair.T, exact @ exact.T, atol=1e-5 * np.abs(exact).max() ** 2)  # the shape errs as h**6


@pytest.mark.parametrize("supports", [{"boundary": "hinged"}, {}, {"left": "hinged"}])
def test_all_modes_add_up_to_the_static_solution(supports):
    system = fi.assemble(fi.mesh.rectangle(1.0, 1.0, size=0.5), PLATE, supports)
    modes = fi.find_modes(system, n_modes=system.n_dofs)
    points = [(0.3, 0.4), (0.7, 0.7)]
    rows = system.interpolate(np.array(points))
    elements = rows @ modes.shapes.flexibility.solve(rows.toarray().T) / system.frame.mass / system.frame.rate**2
    assert_allclose(modes.modal_compliance(points), elements, atol=1e-9 * elements.max())  # rounding
    few = modes.truncated(n_modes=10)
    whole = modes.shapes.compliance(np.array(points))
    assert_allclose(few.modal_compliance(points) + few.residual_compliance(points), whole, rtol=1e-12)


def test_inertia_relief_of_a_free_beam():
    modes = fi.find_modes(fi.assemble(fi.mesh.line(1.0), BAR), n_modes=60)
    total = modes.shapes.compliance(np.array([[0.0]]))[0, 0]
    # a free-free beam loaded at its end: L^3 / (105 E I), from its fourth-order deflection under inertia relief
    assert_allclose(total, 1.0 / (105 * 210e9 * 0.02 * 0.01**3 / 12), rtol=1e-6)
    assert 0.0 < modes.residual_compliance([0.0])[0, 0] < 1e-4 * total


@pytest.mark.parametrize(("shape", "kind", "wanted", "tolerance"), [
    (RECTANGLE, "hinged", hinged(1.55, 1.0, 8), 1e-4),
    (RECTANGLE, "hinged", hinged(1.55, 1.0, 8), 1e-8),
    (fi.mesh.disk(1.0), "clamped", DISK_CLAMPED, 1e-6),
    (fi.mesh.disk(1.0), "hinged", DISK_HINGED, 1e-6),
    (SQUARE, "clamped", SQUARE_CLAMPED[:1], 1e-6),
    (HEXAGON, "hinged", [HEXAGON_HINGED], 1e-5),
])  # fmt: skip
def test_tolerance_is_kept_and_the_estimate_is_honest(shape, kind, wanted, tolerance):
    modes = held(shape, kind, n_modes=len(wanted), tolerance=tolerance)
    true = np.abs(modes.omega * PER_RATE / wanted - 1.0)
    assert (true <= tolerance).all() and (modes.frequency_error <= tolerance).all()
    # the estimate is within 0.3 and 10 of the truth where the table has digits enough to tell
    ratio = (modes.frequency_error / true)[true > 1e-8]
    assert ((ratio > 0.3) & (ratio < 10.0)).all()


@pytest.mark.parametrize(("shape", "kind", "wanted"), [
    (RECTANGLE, "hinged", hinged(1.55, 1.0, 8)),
    (SQUARE, "clamped", SQUARE_CLAMPED),
    (SQUARE, "free", [0.0, 0.0, 0.0, *SQUARE_FREE[:5]]),
    (TRIANGLE, "hinged", np.pi**2 * np.array([5.0, 10.0, 13.0])),
    (TRIANGLE, "clamped", TRIANGLE_CLAMPED),
])  # fmt: skip
@pytest.mark.slow
def test_bounds_enclose_the_exact_frequencies(shape, kind, wanted):
    low, high = held(shape, kind, n_modes=len(wanted), bounds=True).bounds.T * 2 * np.pi * PER_RATE
    wanted = np.array(wanted)
    slack = 1e-8 * wanted  # the last digit printed
    assert (low <= wanted + slack).all() and (high >= wanted - slack).all()
    assert (high - low < 0.02 * wanted)[wanted > 0].all()  # tight enough to mean something


@pytest.mark.parametrize(
    ("kind", "wanted"), [("hinged", hinged(1.0, 1.0, 3)), ("clamped", np.array(SQUARE_CLAMPED[:3]))]
)
def test_morley_converges_from_below_at_second_order(kind, wanted):
    shapes = [fi.mesh.rectangle(1.0, 1.0, size=size) for size in (1 / 16, 1 / 32)]
    one, two = (1.0 - parameters(shape, kind, element="morley", n_modes=3) / wanted for shape in shapes)
    assert (two > 0).all()
    assert_allclose(np.log2(one / two), 2.0, atol=0.2)  # theory 2


@pytest.mark.slow
def test_an_error_that_no_mesh_removes_is_stated():
    modes = held(ngon(24, 0.3), n_modes=1)
    # the membrane's 24-gon: 5.783186 pi / area (1 + 4 zeta(3) / 24**3), Grinfeld and Strang (2012) to this order
    exact = 5.783186 * np.pi / (12 * np.sin(np.pi / 12)) * (1 + 4 * 1.2020569 / 24**3)
    true = modes.omega[0] * PER_RATE / exact - 1.0
    assert 0.3 < modes.frequency_error[0] / true < 10.0


def test_a_tolerance_out_of_reach_is_refused():
    # hinged sides that meet at 170 degrees make the plate move as r**1.06: no mesh resolves that
    corners = [(0, 0), (2, 0), (2, 1), (1, 1.0875), (0, 1)]
    with pytest.raises(fi.SimulationError, match=r"tolerance = 1e-06 is not met: mode \d is uncertain by"):
        held(fi.mesh.polygon(corners), n_modes=1, tolerance=1e-6)


def test_max_frequency_keeps_every_mode_below_it():
    limit = hinged(1.55, 1.0, 30)[20:22].mean() / (2 * np.pi * PER_RATE)
    assert held(RECTANGLE, max_frequency=limit).n_modes == 21


def test_bounds_are_refused_where_no_proof_covers_the_body():
    with pytest.raises(ValueError, match="bounds need an isotropic plate of constant thickness with straight edges"):
        held(fi.mesh.disk(1.0), n_modes=1, bounds=True)


test_refuses_requests_that_make_no_sense = refusing([
    ({}, "either n_modes or max_frequency"),
    ({"n_modes": 3, "max_frequency": 10.0}, "either n_modes or max_frequency"),
    ({"n_modes": 0}, "n_modes must be at least 1"),
    ({"n_modes": 10**6}, "n_modes lower: .* no mesh allowed has enough"),
    ({"n_modes": 2, "tolerance": -1.0}, "tolerance must lie between"),
], lambda options: held(fi.mesh.rectangle(1.0, 1.0, size=0.5), **options))  # fmt: skip


# Without a tolerance the estimate is what elements of this size are known to err by: over the truth 5 ... 500, and only
# for the first mode of a clamped square on three or four elements half of it.
@pytest.mark.parametrize("size", [0.5, 0.34, 0.25, 0.1])
def test_the_error_stated_without_a_tolerance_covers_the_truth(size):
    square = held(fi.mesh.rectangle(1.0, 1.0, size=size), "clamped", n_modes=6)
    assert (square.frequency_error > 0.4 * np.abs(square.omega * PER_RATE / SQUARE_CLAMPED - 1.0)).all()
    assert square.frequency_error[0] < 1.0
    disk = held(fi.mesh.disk(1.0, size=size), n_modes=6)
    exact = fi.analytic.disk(1.0, edge="hinged", section=PLATE, n_modes=6)
    assert (disk.frequency_error > np.abs(disk.omega / exact.omega - 1.0)).all()


@pytest.mark.parametrize(("place", "ratio"), [(0.3, 3.0), (0.37, 3.0), (0.37, 1.1), (0.52, 0.5)])
def test_the_error_stated_covers_steps_of_the_thickness(place, ratio):
    """Elements across a step neither bend as it does nor place it; beams, which have a node there, know the truth."""
    wood = fi.Material(E=10e9, nu=0.0, rho=450.0)  # without contraction a strip bends as a beam

    def thickness(p):
        return 3e-3 * np.where(p[:, 0] < place, 1.0, ratio)

    supports = {"left": "hinged", "right": "clamped"}
    beam = fi.Beam.rectangular(wood, width=0.08, height=thickness)
    truth = fi.find_modes(fi.assemble(fi.mesh.line(1.0), beam, supports), n_modes=3).omega
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(1.0, 0.08), fi.Plate(wood, thickness), supports), n_modes=3)
    error = np.abs(modes.omega / truth - 1.0)
    assert (modes.frequency_error > 0.5 * error).all()  # 0.6 to 2.9 times were measured, 0.1 to 0.7 without steps
    assert (modes.frequency_error < 5.0 * error).all()
