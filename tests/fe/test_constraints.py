"""Bodies held at points: beams in closed form, plates by series and by Ritz's method."""

import numpy as np
import pytest
import shapely
from numpy.testing import assert_allclose
from scipy.linalg import eigh, null_space
from scipy.optimize import brentq

import fem_impact as fi

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
BAR = fi.Beam.rectangular(STEEL, width=0.02, height=1e-3)
SHEET = fi.Plate(STEEL, 1e-3)
RATE = float(np.sqrt(SHEET.stiffness(np.zeros((1, 2)))[0, 0, 0] / SHEET.inertia(np.zeros((1, 2)))[0]))  # [m^2/s]


def spans(overhang, length=1.0, stiffness=np.inf):
    """Determinant over k [1/m] of a free beam on two posts at equal distances from its ends.

    Each of three spans is a sum of cos, sin, cosh and sinh; moment and shear vanish at the ends, deflection, slope and
    moment are continuous, and a post of a stiffness over the bending stiffness takes the jump of the shear force.
    """

    def derivatives(k, x, order):
        signs = {0: (1, 1), 1: (-1, 1), 2: (-1, -1), 3: (1, -1)}[order]
        c, s = (np.cos(k * x), np.sin(k * x)) if order % 2 == 0 else (np.sin(k * x), np.cos(k * x))
        h = (np.cosh(k * x), np.sinh(k * x)) if order % 2 == 0 else (np.sinh(k * x), np.cosh(k * x))
        return np.array([signs[0] * c, signs[1] * s, *h])  # over k**order

    def determinant(k):
        rows, lengths = np.zeros((12, 12)), (overhang, length - 2.0 * overhang, overhang)
        rows[0, 0:4], rows[1, 0:4] = derivatives(k, 0.0, 2), derivatives(k, 0.0, 3)
        for i in (0, 1):
            left, right = slice(4 * i, 4 * i + 4), slice(4 * i + 4, 4 * i + 8)
            start = 2 + 4 * i
            for row, order in enumerate((0, 1, 2)):
                rows[start + row, left] = derivatives(k, lengths[i], order)
                rows[start + row, right] = -derivatives(k, 0.0, order)
            if np.isinf(stiffness):
                rows[start + 3, left] = derivatives(k, lengths[i], 0)
            else:  # EI (w'''(+) - w'''(-)) = -stiffness w
                rows[start + 3, right] = derivatives(k, 0.0, 3)
                rows[start + 3, left] = stiffness / k**3 * derivatives(k, lengths[i], 0) - derivatives(k, lengths[i], 3)
        rows[10, 8:12], rows[11, 8:12] = derivatives(k, lengths[2], 2), derivatives(k, lengths[2], 3)
        return np.linalg.det(rows)

    return determinant


def roots(function, low, high, count):
    found, grid = [], np.linspace(low, high, 4000)
    values = [function(x) for x in grid]
    for a, b, before, after in zip(grid, grid[1:], values, values[1:]):
        if before * after < 0.0:
            found.append(brentq(function, a, b, xtol=1e-14))
    return np.array(found[:count])


@pytest.mark.parametrize("stiffness", [np.inf, 30.0])
@pytest.mark.parametrize("overhang", [0.224, 0.1])
def test_a_bar_on_two_posts_has_the_frequencies_of_its_three_spans(overhang, stiffness):
    bending, inertia = (float(np.ravel(of(np.zeros((1, 1))))[0]) for of in (BAR.stiffness, BAR.inertia))
    post = "hinged" if np.isinf(stiffness) else stiffness * bending
    held = [((overhang,), post), ((1.0 - overhang,), post)]
    system = fi.assemble(fi.mesh.line(1.0), BAR, {}, point_supports=held)
    modes = fi.find_modes(system, n_modes=6)
    k = roots(spans(overhang, stiffness=stiffness), 0.3, 25.0, 6)
    wanted = k**2 * np.sqrt(bending / inertia) / (2.0 * np.pi)
    assert_allclose(modes.frequencies, wanted, rtol=1e-8)
    assert np.abs(modes.frequencies / wanted - 1.0).max() < 3.0 * modes.frequency_error.max() + 1e-10
    if np.isinf(stiffness):
        assert np.abs(modes.shape_at([[overhang]])).max() < 1e-12 * np.abs(modes.shape_at([[0.0]])).max()
        assert modes.n_rigid == 0
    compliance = modes.shapes.compliance(np.array([[0.5]]))[0, 0]
    span = 1.0 - 2.0 * overhang  # under a force amid the posts the overhangs stay straight
    give = span**3 / (48.0 * bending) + (0.0 if np.isinf(stiffness) else 0.5 / (stiffness * bending))
    assert_allclose(compliance, give, rtol=1e-9)


def test_one_hinge_leaves_a_bar_free_to_turn_and_a_thick_bar_bends_less():
    held = [((0.3,), "hinged")]
    modes = fi.find_modes(fi.assemble(fi.mesh.line(1.0), BAR, {}, point_supports=held), n_modes=4)
    assert modes.n_rigid == 1
    shape = modes.shape_at([[0.3], [0.0], [1.0]])[:, 0]
    assert_allclose(shape[1] / shape[2], -0.3 / 0.7, rtol=1e-9)
    thick = fi.assemble(fi.mesh.line(1.0), BAR, {}, theory="timoshenko", point_supports=[*held, ((0.7,), "hinged")])
    thin = fi.assemble(fi.mesh.line(1.0), BAR, {}, point_supports=[*held, ((0.7,), "hinged")])
    one, other = (fi.find_modes(system, n_modes=4) for system in (thick, thin))
    assert_allclose(one.frequencies, other.frequencies, rtol=1e-4)  # (height / wave)**2
    assert (one.frequencies < other.frequencies).all()
    assert one.frequency_error.max() < 1e-6


WIDTH = 0.77  # [m] of the plate of 1 m: no two frequencies coincide


def post_in_a_hinged_plate(at, count, stiffness=np.inf, n_terms=400):
    """k**2 [1/m^2] of a hinged plate on a post, where both receptances add up to zero."""
    n = np.arange(1, n_terms + 1) * np.pi
    # mass-normalised, times the mass per area
    value = 4.0 / WIDTH * np.outer(np.sin(n * at[0]), np.sin(n * at[1] / WIDTH)) ** 2
    square = (n[:, None] ** 2 + (n / WIDTH) ** 2) ** 2

    def receptance(rate):
        return (value / (square - rate**2)).sum() + 1.0 / stiffness

    poles = np.unique(np.sqrt(square[value > 1e-12]).round(9))[: count + 1]
    found = []
    low = 1e-3
    for high in poles:
        inside = low + 1e-9 * high, high - 1e-9 * high
        if receptance(inside[0]) * receptance(inside[1]) < 0.0:
            found.append(brentq(receptance, *inside, xtol=1e-13))
        low = high
    return np.array(found[:count])


@pytest.mark.parametrize("stiffness", [np.inf, 500.0])
def test_a_post_under_a_hinged_plate_meets_the_series(stiffness):
    at, bending = (0.4, 0.3), SHEET.stiffness(np.zeros((1, 2)))[0, 0, 0]
    post = "hinged" if np.isinf(stiffness) else stiffness * bending
    system = fi.assemble(fi.mesh.rectangle(1.0, WIDTH), SHEET, {"boundary": "hinged"}, point_supports=[(at, post)])
    modes = fi.find_modes(system, n_modes=6, tolerance=1e-5)
    wanted = post_in_a_hinged_plate(at, 6, stiffness) * RATE / (2.0 * np.pi)
    assert_allclose(modes.frequencies, wanted, rtol=2e-5)  # the series of 400 squared errs by some 1e-6 at most
    at_post = np.abs(modes.shape_at([at])[0])
    assert (at_post.max() < 1e-9 * np.abs(modes.shape_at([(0.5, 0.6)])).max()) == np.isinf(stiffness)


def on_corners(count, degree=24):
    """k**2 [1/m^2] of a free square of side 1 at rest in its corners, by Ritz's method with products of polynomials."""
    x, weight = np.polynomial.legendre.leggauss(degree + 2)
    unit = np.eye(degree)
    poly = [np.polynomial.legendre.legval(x, np.polynomial.legendre.legder(unit, m)) * 2.0**m for m in range(3)]
    table = {(m, n): 0.5 * (poly[m] * weight) @ poly[n].T for m in range(3) for n in range(3)}
    nu = 0.3
    K = np.kron(table[2, 2], table[0, 0]) + np.kron(table[0, 0], table[2, 2])
    K += nu * (np.kron(table[2, 0], table[0, 2]) + np.kron(table[0, 2], table[2, 0]))
    K += 2.0 * (1.0 - nu) * np.kron(table[1, 1], table[1, 1])
    ends = np.array([(-1.0) ** np.arange(degree), np.ones(degree)])
    free = null_space(np.kron(ends, ends))
    M = np.kron(table[0, 0], table[0, 0])
    values = eigh(free.T @ K @ free, free.T @ M @ free, eigvals_only=True, subset_by_index=(0, count - 1))
    return np.sqrt(values)


def test_a_free_plate_on_its_four_corners_meets_ritz():
    corners = [((x, y), "hinged") for x in (0.0, 1.0) for y in (0.0, 1.0)]
    wanted = on_corners(8)
    assert_allclose(wanted[:3], [7.111, 15.770, 15.770], rtol=1e-3)  # as handbooks have it for nu = 0.3
    system = fi.assemble(fi.mesh.rectangle(1.0, 1.0), SHEET, {}, point_supports=corners)
    modes = fi.find_modes(system, n_modes=8, tolerance=1e-5)
    assert modes.n_rigid == 0
    assert_allclose(modes.frequencies, wanted * RATE / (2.0 * np.pi), rtol=3e-5)
    soft = fi.assemble(fi.mesh.rectangle(1.0, 1.0), SHEET, {}, point_supports=[(at, 1e-3) for at, _ in corners])
    bounce = fi.find_modes(soft, n_modes=3)
    assert bounce.n_rigid == 0
    assert_allclose(bounce.frequencies[0], np.sqrt(4e-3 / soft.mass) / (2.0 * np.pi), rtol=1e-5)


@pytest.mark.parametrize("source", ["outline", pytest.param("file", marks=pytest.mark.slow)])
def test_a_clamped_disk_of_a_plate_is_a_clamped_hole(tmp_path, source):
    """The mesh of the hole is drawn through points of the circle, or has the plate's own rim from a file."""
    at, radius = np.array([0.4, 0.3]), 0.05
    turn = np.linspace(0.0, 2.0 * np.pi, 65)[:-1, None]
    hole = at + radius * np.hstack([np.cos(turn), np.sin(turn)])
    drawn = fi.mesh.outline(shapely.Polygon([(0, 0), (1, 0), (1, WIDTH), (0, WIDTH)], [hole]))
    wanted = fi.find_modes(fi.assemble(drawn, SHEET, {"outer": "hinged", "hole0": "clamped"}), n_modes=3)
    whole = fi.mesh.rectangle(1.0, WIDTH)
    if source == "file":
        fi.mesh.save(tmp_path / "plate.msh", whole)
        whole = fi.mesh.load(tmp_path / "plate.msh")
    edges = dict.fromkeys(("left", "right", "bottom", "top"), "hinged")
    system = fi.assemble(whole, SHEET, edges, point_supports=[(at, "clamped", radius)])
    assert set(system.mesh.edges) == {*edges, "outer", "clamp0", "boundary"} and system.point_supports == ()
    modes = fi.find_modes(system, n_modes=3)
    assert_allclose(modes.frequencies, wanted.frequencies, rtol=2e-5)  # what is promised of either
    post = post_in_a_hinged_plate(at, 3) * RATE / (2.0 * np.pi)
    assert (modes.frequencies > 1.02 * post).all()  # stiffer than the point alone


ON_CORDS = fi.assemble(fi.mesh.line(1.0), BAR, {}, point_supports=[((0.224,), "hinged"), ((0.776,), "hinged")])
ON_FEET = fi.assemble(
    fi.mesh.rectangle(0.4, 0.3), SHEET, {}, point_supports=[((x, y), 1e6) for x in (0.05, 0.35) for y in (0.05, 0.25)]
)


@pytest.mark.parametrize(
    ("system", "at"),
    [(ON_CORDS, (0.5,)), pytest.param(ON_FEET, (0.2, 0.1), marks=pytest.mark.slow)],
    ids=["cords", "feet"],
)
def test_a_blow_on_a_body_on_posts_by_the_plan_and_by_its_modes(system, at):
    mallet, law = fi.Striker.rigid(0.03), fi.Contact.linear(1e4)
    blow = {"at": at, "speed": 1.0, "tolerance": 1e-3}
    planned = fi.strike(system, mallet, law, **blow)
    own = fi.strike(fi.find_modes(system, n_modes=80), mallet, law, **blow)
    assert_allclose(planned.restitution, own.restitution, atol=2e-3)
    assert planned.n_impacts == own.n_impacts


def test_what_is_no_point_support_says_so():
    line, square = fi.mesh.line(1.0), fi.mesh.rectangle(1.0, 1.0)
    for mesh, section, posts, words in (
        (line, BAR, 3, "point_supports must be a list"),
        (line, BAR, [(0.5,)], r"point_supports\[0\] must be a pair"),
        (square, SHEET, [((0.5, 0.5), "clamped", 1e25)], "radius of point_supports must be smaller than the body, 1 m"),
        (line, BAR, [((0.5,), "clamped")], r"support of point_supports\[0\] must be one of hinged"),
        (line, BAR, [((0.5,), "clamped", 0.01)], r"point_supports\[0\] must not clamp a point of a beam"),
        (square, SHEET, [((0.5, 0.5), "clamped", 0.0)], r"radius of point_supports\[0\] must be positive"),
        (square, SHEET, [((0.5, 0.5), "clamped", 1e-9)], "radius of point_supports must be at least 1e-06 of the body"),
        (square, SHEET, [((0.5, 0.5), "clamped", 0.6)], "point_supports must leave room for each clamp"),
        (square, SHEET, [((0.5, x), "clamped", 0.1) for x in (0.5, 0.6)], "point_supports must leave room"),
        (line, BAR, [((0.5,), -1.0)], r"stiffness of point_supports\[0\] must be positive"),
        (square, SHEET, [((2.0, 0.5), "hinged")], r"point of point_supports\[0\] must lie on the body"),
    ):
        with pytest.raises(ValueError, match=words):
            fi.assemble(mesh, section, {}, point_supports=posts)
