"""FE modes against exact values, their order of convergence, and the static solution they add up to."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import optimize, special
from scipy.integrate import solve_ivp

from fem_impact import mesh
from fem_impact._base.check import SimulationError
from fem_impact.fe.assembly import assemble
from fem_impact.fe.section import Beam, Material, Plate
from fem_impact.modes import analytic
from fem_impact.modes.finding import find_modes
from fem_impact.references.case import TABLE
from fem_impact.references.frequencies import hinged

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
PLATE = Plate(STEEL, 2e-3)
BAR = Beam.rectangular(STEEL, width=0.02, height=0.01)
PER_RATE = np.sqrt(7850 * 2e-3 / (210e9 * 2e-3**3 / (12 * (1 - 0.3**2))))  # sqrt(rho h / D) of PLATE
SQUARE_CLAMPED, SQUARE_FREE, DISK_CLAMPED, DISK_HINGED, TRIANGLE_CLAMPED = (
    TABLE[name]["values"]
    for name in ("square-clamped", "square-free", "disk-clamped", "disk-hinged", "triangle-clamped")
)
HEXAGON = np.column_stack([np.cos(np.pi / 3 * np.arange(6)), np.sin(np.pi / 3 * np.arange(6))])


def parameters(shape, supports, n_modes, **options):
    """Dimensionless frequencies omega sqrt(rho h / D) of the flexible modes of a steel plate in metres."""
    modes = find_modes(assemble(shape, PLATE, supports), n_modes=n_modes, **options)
    return modes.omega[modes.n_rigid :] * PER_RATE


def test_hinged_rectangle_is_exact_to_eight_digits():
    found = parameters(mesh.rectangle(1.55, 1.0, size=1 / 12), {"boundary": "hinged"}, 6)
    assert_allclose(found, hinged(1.55, 1.0, 6), rtol=1e-8)  # 1e-7 (kh)**8 = 8e-9 for the sixth


@pytest.mark.parametrize(
    ("shape", "sizes", "edge", "wanted", "order"),
    [
        (mesh.disk, (0.24, 0.12), "clamped", DISK_CLAMPED[:3], 3.5),  # five to six were measured
        (mesh.disk, (0.24, 0.12), "hinged", DISK_HINGED[:3], 3.5),
        # theory 8 once a wave has a few elements
        (partial(mesh.rectangle, 1.0), (1 / 3, 1 / 6), "hinged", hinged(1.0, 1.0, 4), 6.0),
    ],
)
def test_order_on_curved_and_straight_edges(shape, sizes, edge, wanted, order):
    found = [parameters(shape(1.0, size=size), {"boundary": edge}, len(wanted)) for size in sizes]
    errors = np.abs(np.array(found) / wanted - 1.0)
    assert (np.log2(errors[0] / errors[1]) > order).all()


def test_a_hinged_polygon_does_not_become_the_hinged_disk_but_ours_does():
    angle = 2.0 * np.pi * np.arange(64) / 64
    # graded=False: the sharp corners of the polygon would only add to the effect
    corners = np.column_stack([np.cos(angle), np.sin(angle)])
    system = assemble(mesh.polygon(corners, size=0.2), PLATE, {"boundary": "hinged"}, graded=False)
    polygonal = find_modes(system, n_modes=1).omega[0] * PER_RATE
    # Babuska's paradox: w = 0 on straight sides makes the slope vanish at each corner, and the limit is too stiff
    assert polygonal > 1.05 * DISK_HINGED[0]
    assert_allclose(parameters(mesh.disk(1.0, size=0.2), {"boundary": "hinged"}, 1), DISK_HINGED[:1], rtol=2e-6)


def test_hinged_hexagon_has_the_squared_spectrum_of_the_membrane():
    # where all corners are convex, hinged plates are membranes twice over; 7.15533913 is the hexagon's with side 1
    shape = mesh.polygon(HEXAGON, size=0.25)
    found = parameters(shape, {"boundary": "hinged"}, 1)[0]
    assert_allclose(found, 7.15533913, rtol=1e-5)  # 4e-6 was measured: corners of 120 degrees behave as r**1.5
    coarse = find_modes(assemble(shape, PLATE, {"boundary": "hinged"}, graded=False), n_modes=1).omega[0] * PER_RATE
    assert coarse / 7.15533913 - 1.0 > 1e-3  # what the rings at the corners are for


def test_a_square_of_matching_wood_has_the_spectrum_of_a_rhombus():
    """A map of the plane leaves the energy of hinged sides alone if the material is mapped, too.

    The right angles of the wood are then as singular as the 120 degrees of the rhombus: r**1.5.
    """
    steep = np.array([[1.0, 0.5], [0.0, 0.75**0.5]])  # takes the unit square to the rhombus
    (across, along), turn = np.linalg.eigh(np.linalg.inv(steep.T @ steep))  # roots of the stiffnesses, axes
    held = 0.3 * along * across  # coupling; twist so that held + 2 twist = along across
    rest, twist = 1.0 - 0.3**2, 0.35 * along * across
    moduli = {"E_along": 12.0 * rest * along**2, "E_across": 12.0 * rest * across**2, "G": 12.0 * twist}
    angle = float(np.arctan2(turn[1, 1], turn[0, 1]))
    wood = Material.orthotropic(**moduli, nu=held / across**2, rho=1.0, angle=angle)
    square = assemble(mesh.rectangle(1.0, 1.0), Plate(wood, 1.0), {"boundary": "hinged"})
    found = find_modes(square, n_modes=4)
    rhombus = parameters(mesh.polygon(np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) @ steep.T), {"boundary": "hinged"}, 4)
    assert_allclose(found.omega, rhombus, rtol=5e-6)  # 1e-6 was measured; 6e-3 without rings
    assert found.frequency_error.max() < 5e-6


def test_l_shape_is_stable_once_its_corner_is_graded():
    corners = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    found = [parameters(mesh.polygon(corners, size=size), {"boundary": "hinged"}, 1)[0] for size in (0.5, 0.25)]
    assert_allclose(found[0], found[1], rtol=1e-4)  # r**(4/3) at the corner; ungraded meshes differ by 2 percent
    assert found[1] < found[0]  # conforming: from above


@pytest.mark.parametrize("ends", [("clamped", "free"), ("free", "free"), ("hinged", "hinged"), ("hinged", "free")])
@pytest.mark.parametrize("n_modes", [8, 200, pytest.param(1000, marks=pytest.mark.slow)])
def test_beams_keep_their_lowest_frequencies_however_many_are_asked_for(ends, n_modes):
    held = {name: kind for name, kind in zip(("left", "right"), ends) if kind != "free"}
    found = find_modes(assemble(mesh.line(0.5), BAR, held), n_modes=n_modes)
    exact = analytic.beam(0.5, ends=ends, section=BAR, n_modes=n_modes)
    flexible = exact.omega > 0.0
    error = np.abs(found.omega[flexible] / exact.omega[flexible] - 1.0)
    assert error.max() < (1e-12 if n_modes == 8 else 2e-8)  # rounding of K grows as the fourth power of the elements
    assert (error < 3.0 * found.frequency_error[flexible]).all()
    points = np.array([[0.0], [0.1234], [0.5]])
    assert_allclose(np.abs(found.shape_at(points)), np.abs(exact.shape_at(points)), atol=1e-5 * exact.mass**-0.5)


def shooting_frequencies(height, length, n, guess):
    """First frequencies [rad/s] of a cantilever of varying height, by integrating its equation from the free end."""
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

    return [optimize.brentq(tip, g * 0.97, g * 1.03, rtol=1e-13) for g in guess[:n]]


@pytest.mark.parametrize(
    "height",
    [
        lambda x: 0.01 * (1.0 - 1.6 * x[:, 0]),  # a wedge, a fifth as high at its end
        lambda x: 0.01 * (1.0 + 0.3 * np.sin(25.0 * x[:, 0])),
        lambda x: np.interp(x[:, 0], [0.0, 0.11, 0.29, 0.5], [0.01, 0.012, 0.004, 0.01]),  # kinks
    ],
)
@pytest.mark.slow
def test_tapered_beams_meet_an_integration_of_their_equation(height):
    bar = Beam.rectangular(STEEL, width=0.02, height=height)
    modes = find_modes(assemble(mesh.line(0.5), bar, {"left": "clamped"}), n_modes=5)
    assert_allclose(modes.omega, shooting_frequencies(height, 0.5, 5, modes.omega), rtol=2e-9)  # the integrator's 1e-10
    many = find_modes(assemble(mesh.line(0.5), bar, {"left": "clamped"}), n_modes=300)
    assert_allclose(many.omega[:5], modes.omega, rtol=1e-8)
    assert many.frequency_error.max() < 1e-6


def test_modes_are_mass_normalised_and_orthogonal():
    modes = find_modes(assemble(mesh.rectangle(1.0, 1.0, size=1 / 6), PLATE), n_modes=20)
    M, vectors = modes.shapes.system.M, modes.shapes.vectors
    assert_allclose(vectors.T @ (M @ vectors), np.eye(20), atol=1e-10)  # rounding


def test_shape_at_a_point_is_the_sine_of_the_hinged_plate():
    modes = find_modes(assemble(mesh.rectangle(1.55, 1.0, size=1 / 10), PLATE, {"boundary": "hinged"}), n_modes=1)
    x, y = 0.4, 0.3
    wanted = 2.0 / np.sqrt(modes.mass) * np.sin(np.pi * x / 1.55) * np.sin(np.pi * y)
    assert_allclose(abs(modes.shape_at([(x, y)])[0, 0]), wanted, rtol=1e-7)  # the shape errs as h**6


def test_degenerate_pair_spans_the_right_space():
    modes = find_modes(assemble(mesh.rectangle(1.0, 1.0, size=1 / 8), PLATE, {"boundary": "hinged"}), n_modes=3)
    points = np.array([[0.2, 0.3], [0.6, 0.1], [0.7, 0.8]])
    x, y = np.pi * points.T
    exact = 2.0 / np.sqrt(modes.mass) * np.column_stack([np.sin(2 * x) * np.sin(y), np.sin(x) * np.sin(2 * y)])
    pair = modes.shape_at(points)[:, 1:]
    assert_allclose(pair @ pair.T, exact @ exact.T, atol=1e-5 * np.abs(exact).max() ** 2)  # the shape errs as h**6


@pytest.mark.parametrize("supports", [{"boundary": "hinged"}, {}, {"left": "hinged"}])
def test_all_modes_add_up_to_the_static_solution(supports):
    system = assemble(mesh.rectangle(1.0, 1.0, size=0.5), PLATE, supports)
    modes = find_modes(system, n_modes=system.n_dofs)
    points = [(0.3, 0.4), (0.7, 0.7)]
    rows = system.interpolate(np.array(points))
    elements = rows @ modes.shapes.flexibility.solve(rows.toarray().T) / system.frame.mass / system.frame.rate**2
    assert_allclose(modes.modal_compliance(points), elements, atol=1e-9 * elements.max())  # rounding
    few = modes.truncated(n_modes=10)
    whole = modes.shapes.compliance(np.array(points))
    assert_allclose(few.modal_compliance(points) + few.residual_compliance(points), whole, rtol=1e-12)


def test_static_deflection_of_a_hinged_square_under_its_middle():
    system = assemble(mesh.rectangle(1.0, 1.0, size=1 / 8), PLATE, {"boundary": "hinged"})
    found = find_modes(system, n_modes=1).shapes.compliance(np.array([[0.5, 0.5]]))[0, 0]
    D = 210e9 * 2e-3**3 / (12 * (1 - 0.3**2))
    assert_allclose(found * D, 0.0116008, rtol=2e-3)  # Timoshenko's 0.01160; r**2 log r at the load slows it to h**2


def test_inertia_relief_of_a_free_beam():
    modes = find_modes(assemble(mesh.line(1.0, size=1 / 200), BAR), n_modes=60)
    residual = modes.residual_compliance([0.0])[0, 0]
    total = modes.shapes.compliance(np.array([[0.0]]))[0, 0]
    # a free-free beam loaded at its end: L^3 / (105 E I), from its fourth-order deflection under inertia relief
    assert_allclose(total, 1.0 / (105 * 210e9 * 0.02 * 0.01**3 / 12), rtol=1e-6)
    assert 0.0 < residual < 1e-4 * total


@pytest.mark.parametrize(
    ("shape", "supports", "wanted", "tolerance"),
    [
        (mesh.rectangle(1.55, 1.0), "hinged", hinged(1.55, 1.0, 8), 1e-4),
        (mesh.rectangle(1.55, 1.0), "hinged", hinged(1.55, 1.0, 8), 1e-8),
        (mesh.disk(1.0), "clamped", DISK_CLAMPED, 1e-6),
        (mesh.disk(1.0), "hinged", DISK_HINGED, 1e-6),
        (mesh.rectangle(1.0, 1.0), "clamped", SQUARE_CLAMPED[:1], 1e-6),
        (mesh.polygon(HEXAGON), "hinged", [7.15533913], 1e-5),
    ],
)
def test_tolerance_is_kept_and_the_estimate_is_honest(shape, supports, wanted, tolerance):
    modes = find_modes(assemble(shape, PLATE, {"boundary": supports}), n_modes=len(wanted), tolerance=tolerance)
    true = np.abs(modes.omega * PER_RATE / wanted - 1.0)
    assert (true <= tolerance).all()
    assert (modes.frequency_error <= tolerance).all()
    # the estimate is within 0.3 and 10 of the truth where the table has digits enough to tell
    known = true > 1e-8
    ratio = modes.frequency_error[known] / true[known]
    assert ((ratio > 0.3) & (ratio < 10.0)).all()


@pytest.mark.parametrize(
    ("shape", "supports", "wanted"),
    [
        (mesh.rectangle(1.55, 1.0), "hinged", hinged(1.55, 1.0, 8)),
        (mesh.rectangle(1.0, 1.0), "clamped", SQUARE_CLAMPED),
        (mesh.rectangle(1.0, 1.0), "free", [0.0, 0.0, 0.0, *SQUARE_FREE[:5]]),
        (mesh.polygon([(0, 0), (1, 0), (0, 1)]), "hinged", np.pi**2 * np.array([5.0, 10.0, 13.0])),
        (mesh.polygon([(0, 0), (1, 0), (0, 1)]), "clamped", TRIANGLE_CLAMPED),
    ],
)
@pytest.mark.slow
def test_bounds_enclose_the_exact_frequencies(shape, supports, wanted):
    modes = find_modes(assemble(shape, PLATE, {"boundary": supports}), n_modes=len(wanted), bounds=True)
    bounds = modes.bounds * 2 * np.pi * PER_RATE
    slack = 1e-8 * np.array(wanted)  # the last digit printed
    assert (bounds[:, 0] <= wanted + slack).all() and (bounds[:, 1] >= wanted - slack).all()
    flexible = np.array(wanted) > 0
    assert (
        np.ptp(bounds[flexible], axis=1) < 0.02 * np.array(wanted)[flexible]
    ).all()  # tight enough to mean something


@pytest.mark.parametrize("supports", ["hinged", "clamped"])
def test_morley_converges_from_below_at_second_order(supports):
    wanted = hinged(1.0, 1.0, 3) if supports == "hinged" else np.array(SQUARE_CLAMPED[:3])
    errors = []
    for size in (1 / 16, 1 / 32):
        system = assemble(mesh.rectangle(1.0, 1.0, size=size), PLATE, {"boundary": supports}, "morley")
        errors.append(1.0 - find_modes(system, n_modes=3).omega * PER_RATE / wanted)
    assert (errors[1] > 0).all()
    assert_allclose(np.log2(errors[0] / errors[1]), 2.0, atol=0.2)  # theory 2


@pytest.mark.slow
def test_an_error_that_no_mesh_removes_is_stated():
    angle = 2.0 * np.pi * np.arange(24) / 24
    shape = mesh.polygon(np.column_stack([np.cos(angle), np.sin(angle)]), size=0.3)
    modes = find_modes(assemble(shape, PLATE, {"boundary": "hinged"}), n_modes=1)
    # the membrane's 24-gon: 5.783186 pi / area (1 + 4 zeta(3) / 24**3), Grinfeld and Strang (2012) to this order
    exact = 5.783186 * np.pi / (12 * np.sin(np.pi / 12)) * (1 + 4 * 1.2020569 / 24**3)
    true = modes.omega[0] * PER_RATE / exact - 1.0
    assert 0.3 < modes.frequency_error[0] / true < 10.0


def test_a_tolerance_out_of_reach_is_refused():
    # hinged sides that meet at 170 degrees make the plate move as r**1.06: no mesh resolves that
    corners = [(0, 0), (2, 0), (2, 1), (1, 1.0875), (0, 1)]
    with pytest.raises(SimulationError, match=r"tolerance = 1e-06 is not met: mode \d is uncertain by"):
        find_modes(assemble(mesh.polygon(corners), PLATE, {"boundary": "hinged"}), n_modes=1, tolerance=1e-6)


def test_a_size_left_open_is_chosen_for_the_modes_asked_for():
    found = parameters(mesh.rectangle(1.55, 1.0), {"boundary": "hinged"}, 60)
    assert_allclose(found, hinged(1.55, 1.0, 60), rtol=5e-5)  # `Theory.wave` promises it


def test_max_frequency_keeps_every_mode_below_it():
    exact = hinged(1.55, 1.0, 30) / (2 * np.pi * PER_RATE)
    limit = 0.5 * (exact[20] + exact[21])
    modes = find_modes(assemble(mesh.rectangle(1.55, 1.0), PLATE, {"boundary": "hinged"}), max_frequency=limit)
    assert modes.n_modes == 21


def test_bounds_are_refused_where_no_proof_covers_the_body():
    with pytest.raises(ValueError, match="bounds need an isotropic plate of constant thickness with straight edges"):
        find_modes(assemble(mesh.disk(1.0), PLATE, {"boundary": "hinged"}), n_modes=1, bounds=True)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({}, "either n_modes or max_frequency"),
        ({"n_modes": 3, "max_frequency": 10.0}, "either n_modes or max_frequency"),
        ({"n_modes": 0}, "n_modes must be at least 1"),
        ({"max_frequency": 1e-3}, "max_frequency must reach the first mode"),
        ({"n_modes": 10**6}, "n_modes lower: .* no mesh allowed has enough"),
        ({"n_modes": 2, "tolerance": -1.0}, "tolerance must lie between"),
    ],
)
def test_refuses_requests_that_make_no_sense(options, text):
    system = assemble(mesh.rectangle(1.0, 1.0, size=0.5), PLATE, {"boundary": "hinged"})
    with pytest.raises(ValueError, match=text):
        find_modes(system, **options)


# Without a tolerance the estimate is what elements of this size are known to err by: over the truth 5 ... 500, and only
# for the first mode of a clamped square on three or four elements half of it.
@pytest.mark.parametrize("size", [0.5, 0.34, 0.25, 0.17, 0.1])
def test_the_error_stated_without_a_tolerance_covers_the_truth(size):
    system = assemble(mesh.rectangle(1.0, 1.0, size=size), PLATE, supports={"boundary": "clamped"})
    modes = find_modes(system, n_modes=6)
    assert (modes.frequency_error > 0.4 * np.abs(modes.omega * PER_RATE / SQUARE_CLAMPED - 1.0)).all()
    assert modes.frequency_error[0] < 1.0
    disk = find_modes(assemble(mesh.disk(1.0, size=size), PLATE, supports={"boundary": "hinged"}), n_modes=6)
    true = np.abs(disk.omega / analytic.disk(1.0, edge="hinged", section=PLATE, n_modes=6).omega - 1.0)
    assert (disk.frequency_error > true).all()


def ring_rows(edge, n, z, r):
    """Two edge conditions at radius r on J, Y, I, K of order n at z r, as columns, (2, 4); nu = 0.3."""
    columns = []
    for function, derivative, sign in (
        (special.jv, special.jvp, -1),
        (special.yv, special.yvp, -1),
        (special.iv, special.ivp, 1),
        (special.kv, special.kvp, 1),
    ):
        w, dw, d2w = (derivative(n, z * r, k) * z**k if k else function(n, z * r) for k in range(3))
        moment = d2w + 0.3 * (dw / r - n**2 * w / r**2)
        shear = sign * z**2 * dw - 0.7 * n**2 / r**2 * (dw - w / r)
        columns.append({"clamped": (w, dw), "hinged": (w, moment), "free": (moment, shear)}[edge])
    return np.array(columns).T


def ring_roots(inner, outer, hole, highest=9.0):
    """omega of a ring of outer radius, rigidity and mass per area 1, ascending, both of each pair."""

    def determinant(z, n):
        rows = np.vstack([ring_rows(outer, n, z, 1.0), ring_rows(inner, n, z, hole)])
        rows = rows / np.abs(rows).max(axis=1, keepdims=True)
        return np.linalg.det(rows / np.abs(rows).max(axis=0, keepdims=True))

    found = []
    for n in range(10):
        scan = np.arange(max(0.4, 0.35 * n), highest, 0.02)
        values = [determinant(z, n) for z in scan]
        for i in np.flatnonzero(np.diff(np.sign(values))):
            root = optimize.brentq(determinant, scan[i], scan[i + 1], args=(n,), xtol=1e-12)
            found += [root**2] * (1 if n == 0 else 2)
    return np.sort(found)


KINDS = "clamped", "hinged", "free"
RINGS = [  # one kind of each edge with another, the others are alike
    pytest.param(inner, outer, marks=() if (KINDS.index(inner) + 1) % 3 == KINDS.index(outer) else pytest.mark.slow)
    for inner in KINDS
    for outer in KINDS
]


@pytest.mark.parametrize(("place", "ratio"), [(0.3, 3.0), (0.37, 3.0), (0.37, 1.1), (0.52, 0.5)])
def test_the_error_stated_covers_steps_of_the_thickness(place, ratio):
    """Elements across a step neither bend as it does nor place it; beams, which have a node there, know the truth."""
    wood = Material(E=10e9, nu=0.0, rho=450.0)  # without contraction a strip bends as a beam

    def thickness(p):
        return 3e-3 * np.where(p[:, 0] < place, 1.0, ratio)

    held = {"left": "hinged", "right": "clamped"}
    beam = Beam.rectangular(wood, width=0.08, height=thickness)
    truth = find_modes(assemble(mesh.line(1.0), beam, held), n_modes=3).omega
    system = assemble(mesh.rectangle(1.0, 0.08), Plate(wood, thickness), held)
    modes = find_modes(system, n_modes=3)
    error = np.abs(modes.omega / truth - 1.0)
    assert (modes.frequency_error > 0.5 * error).all()  # 0.6 to 2.9 times were measured, 0.1 to 0.7 without steps
    assert (modes.frequency_error < 5.0 * error).all()


@pytest.mark.parametrize("inner, outer", RINGS)
@pytest.mark.slow
def test_rings_meet_the_roots_of_their_bessel_determinant(inner, outer):
    exact = ring_roots(inner, outer, 0.4)[:8]
    supports = {"inner": inner, "outer": outer}
    modes = find_modes(assemble(mesh.disk(1.0, 0.4), PLATE, supports=supports), n_modes=12)
    found = modes.omega[modes.n_rigid :][: len(exact)] * PER_RATE
    assert_allclose(found, exact, rtol=2e-5)  # elements sized by the program: 1.3e-5 measured, hinged at both edges
