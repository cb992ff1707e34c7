"""Bodies held at points: beams in closed form, plates by series and by Ritz's method."""

import numpy as np
import pytest
import shapely
from comparing import refusing
from numpy.testing import assert_allclose
from scipy.linalg import eigh, null_space
from scipy.optimize import brentq

import fem_impact as fi

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
BAR = fi.Beam.rectangular(STEEL, width=0.02, height=1e-3)
SHEET = fi.Plate(STEEL, 1e-3)
RATE = float(np.sqrt(SHEET.stiffness(np.zeros((1, 2)))[0, 0, 0] / SHEET.inertia(np.zeros((1, 2)))[0]))  # [m^2/s]


def resisting(frequency, length, height):
    """Dynamic stiffness (4, 4) of a piece of unit E, rho and width, deflection and slope at both ends; and its poles.

    Those of the stiffness are the roots of the factor that is returned.
    """
    stiff, wave = height**3 / 12.0, (12.0 * (2.0 * np.pi * frequency) ** 2 / height**2) ** 0.25
    x = wave * length
    s, c, S, C = np.sin(x), np.cos(x), np.sinh(x), np.cosh(x)
    force, mixed, moment = wave**3 * (s * C + c * S), wave**2 * s * S, wave * (s * C - c * S)
    far, across, turned = -(wave**3) * (s + S), wave**2 * (C - c), wave * (S - s)
    rows = [force, mixed, far, across], [mixed, moment, -across, turned], [far, -across, force, -mixed]
    return stiff / (1.0 - c * C) * np.array([*rows, [across, turned, -mixed, moment]]), (1.0 - c * C) / C


STEPPED = [0.0, 0.011, 0.035, 0.117, 0.32, 0.4], [1.05e-3, 1.05e-3, 13.8e-3, 19.0e-3, 19.0e-3]
ON_POSTS = [([0.0, o, 1.0 - o, 1.0], [1e-3] * 3, [1, 2], push) for o in (0.224, 0.1) for push in (np.inf, 2.5e-9)]


@pytest.mark.parametrize(("places", "heights", "posts", "push"), [*ON_POSTS, (*STEPPED, [1, 4], np.inf)])
def test_a_bar_on_two_posts_has_the_frequencies_of_its_pieces_within_its_claims(places, heights, posts, push):
    """One is stepped beside its posts and hinged: a step misplaced by 1e-9 of its length moves mode 5 by 6e-9."""
    stepped, stiff, end = len(places) > 4, np.isinf(push), places[-1]
    bar = fi.Beam.rectangular(
        fi.Material(E=1.0, nu=0.3, rho=1.0), width=1.0,
        height=lambda x: np.array(heights)[np.searchsorted(places[1:-1], np.ravel(x), side="right")],
    )  # fmt: skip
    held = [((places[i],), "hinged" if stiff else push) for i in posts]
    system = fi.assemble(fi.mesh.line(end), bar, {"left": "hinged"} if stepped else {}, point_supports=held)
    modes = fi.find_modes(system, n_modes=8)
    dofs = 2 * np.array(posts)
    kept = np.setdiff1d(np.arange(2 * len(places)), np.append(dofs, 0) if stepped else dofs if stiff else [])

    def determinant(frequency):
        whole, poles = np.zeros((2 * len(places),) * 2), 1.0
        for i, (length, height) in enumerate(zip(np.diff(places), heights)):
            part, factor = resisting(frequency, length, height)
            whole[2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += part
            poles *= factor
        whole[dofs, dofs] += 0.0 if stiff else push
        scale = np.array([places[1] * 1e-3, 1.0] * len(places))[kept]  # of deflections and slopes
        return np.linalg.det(whole[np.ix_(kept, kept)] * np.outer(scale, scale) * 1e12) * poles

    near = modes.frequencies[:, None] * (1.0 + 1e-6 * np.array([-1.0, 1.0]))
    true = [brentq(determinant, *each, xtol=1e-16, rtol=1e-15) for each in near]
    signs = np.sign([determinant(f) for f in np.linspace(near[0, 0] / 3.0, near[-1, 1], 4000)])
    assert np.count_nonzero(np.diff(signs)) == 8  # none is missed
    error = np.abs(modes.frequencies / true - 1.0)
    assert (error < modes.frequency_error + 1e-11).all() and error.max() < 1e-8  # rounding of the determinants
    assert modes.n_rigid == 0
    if stiff:
        there = modes.shape_at([[places[i]] for i in posts])
        assert np.abs(there).max() < 1e-12 * np.abs(modes.shape_at([[end]])).max()
    if not stepped:  # under a force amid the posts the overhangs stay straight
        give = (places[2] - places[1]) ** 3 / 4e-9 + (0.0 if stiff else 0.5 / push)
        assert_allclose(modes.shapes.compliance(np.array([[0.5]]))[0, 0], give, rtol=1e-9)


def test_one_hinge_leaves_a_bar_free_to_turn_and_a_thick_bar_bends_less():
    def on_posts(*places, theory=None):
        held = [((x,), "hinged") for x in places]
        return fi.find_modes(fi.assemble(fi.mesh.line(1.0), BAR, {}, theory=theory, point_supports=held), n_modes=4)

    modes, thick, thin = on_posts(0.3), on_posts(0.3, 0.7, theory="timoshenko"), on_posts(0.3, 0.7)
    assert modes.n_rigid == 1
    left, right = modes.shape_at([[0.0], [1.0]])[:, 0]
    assert_allclose(left / right, -0.3 / 0.7, rtol=1e-9)
    assert_allclose(thick.frequencies, thin.frequencies, rtol=1e-4)  # (height / wave)**2
    assert (thick.frequencies < thin.frequencies).all() and thick.frequency_error.max() < 1e-6


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
    between = [(low + 1e-9 * high, high - 1e-9 * high) for low, high in zip([1e-3, *poles], poles)]
    return np.array(
        [brentq(receptance, a, b, xtol=1e-13) for a, b in between if receptance(a) * receptance(b) < 0.0][:count]
    )


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


CORDS = [((0.224,), "hinged"), ((0.776,), "hinged")]
FEET = [((x, y), 1e6) for x in (0.05, 0.35) for y in (0.05, 0.25)]


@pytest.mark.parametrize(("mesh", "section", "supports", "at"), [
    pytest.param(fi.mesh.line(1.0), BAR, CORDS, (0.5,), id="bar on cords"),
    pytest.param(fi.mesh.rectangle(0.4, 0.3), SHEET, FEET, (0.2, 0.1), marks=pytest.mark.slow, id="plate on feet"),
])  # fmt: skip
def test_a_blow_on_a_body_on_posts_by_the_plan_and_by_its_modes(mesh, section, supports, at):
    system = fi.assemble(mesh, section, point_supports=supports)
    mallet, law = fi.Striker.rigid(0.03), fi.Contact.linear(1e4)
    blow = {"at": at, "speed": 1.0, "tolerance": 1e-3}
    planned = fi.strike(system, mallet, law, **blow)
    own = fi.strike(fi.find_modes(system, n_modes=80), mallet, law, **blow)
    assert_allclose(planned.restitution, own.restitution, atol=2e-3)
    assert planned.n_impacts == own.n_impacts


LINE, SQUARE, MIDDLE = fi.mesh.line(1.0), fi.mesh.rectangle(1.0, 1.0), (0.5, 0.5)


test_what_is_no_point_support_says_so = refusing([
    (LINE, BAR, 3, "point_supports must be a list"),
    (LINE, BAR, [(0.5,)], r"point_supports\[0\] must be a pair"),
    (SQUARE, SHEET, [(MIDDLE, "clamped", 1e25)], "radius of point_supports must be smaller than the body, 1 m"),
    (LINE, BAR, [((0.5,), "clamped")], r"support of point_supports\[0\] must be one of hinged"),
    (LINE, BAR, [((0.5,), "clamped", 0.01)], r"point_supports\[0\] must not clamp a point of a beam"),
    (SQUARE, SHEET, [(MIDDLE, "clamped", 0.0)], r"radius of point_supports\[0\] must be positive"),
    (SQUARE, SHEET, [(MIDDLE, "clamped", 1e-9)], "radius of point_supports must be at least 1e-06 of the body"),
    (SQUARE, SHEET, [(MIDDLE, "clamped", 0.6)], "point_supports must leave room for each clamp"),
    (SQUARE, SHEET, [((0.5, x), "clamped", 0.1) for x in (0.5, 0.6)], "point_supports must leave room"),
    (LINE, BAR, [((0.5,), -1.0)], r"stiffness of point_supports\[0\] must be positive"),
    (SQUARE, SHEET, [((2.0, 0.5), "hinged")], r"point of point_supports\[0\] must lie on the body"),
], lambda mesh, section, posts: fi.assemble(mesh, section, {}, point_supports=posts))  # fmt: skip
