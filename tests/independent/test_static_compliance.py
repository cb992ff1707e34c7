"""Static compliance of finite element plates and beams against series, images and mixed elements of high degree."""

import functools
import itertools
import zlib

import numpy as np
import pytest
import references_plates as references

import fem_impact as fi

ACCURACY = 1e-4  # [-] relative error wanted at any point; 1e-5 ends the refinement, so a missed one is a failure
FLOOR = 2e-8  # [-] of the references: their sums cancel beside held edges; two ways of summing agree to this
RESTS = 1e-12  # [-] compliance of a point on a support over the largest of the body
DISTANCES = (-4.0, -1.0)  # powers of ten of the size, of points beside edges and corners
N_MODES = 12
FAST, SLOW, ALL, BEAM_POINTS = 3, 8, 35, 56  # points per body: quick, slow, with --all-cases; nine beams make 500
MIXED_FAST, MIXED_SLOW, MIXED_ALL = 1, 2, 6  # where each reference takes seconds

SIDES = ("clamped", "hinged", "free")
STRIPS = {
    "hinged rectangle": ("hinged", "hinged", 1.55),
    "strip clamped at both sides": ("clamped", "clamped", 0.6),
    "strip free at both sides": ("free", "free", 1.5),
    "strip clamped and free": ("clamped", "free", 1.0),
    "strip hinged and free": ("hinged", "free", 3.0),
}
ROUND = {
    "clamped disk": (None, "clamped", 0.0),
    "hinged disk": (None, "hinged", 0.0),
    "free disk": (None, "free", 0.0),
    "ring on its hub": ("clamped", "free", 0.3),
    "ring on its hinged rim": ("free", "hinged", 0.4),
    "ring clamped at both rims": ("clamped", "clamped", 0.5),
    "ring hinged inside, clamped outside": ("hinged", "clamped", 0.2),
}
ELL = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 0.5), (0.5, 1.0), (0.0, 1.0))
SQUARE = ((0.0, 0.0), (1.2, 0.0), (1.2, 1.0), (0.0, 1.0))
SLANTED = ((0.0, 0.0), (1.0, 0.0), (0.3, 0.8))
BEAMS = list(itertools.product(SIDES, repeat=2))
MIXED = {
    "clamped L": (ELL, ("clamped",) * 6),
    "clamped rectangle": (SQUARE, ("clamped",) * 4),
    "cantilever": (SQUARE, ("free", "free", "free", "clamped")),
    "clamped triangle": (SLANTED, ("clamped",) * 3),
    "L of mixed edges": (ELL, ("hinged", "free", "free", "clamped", "clamped", "free")),
}


def stream(name):
    return np.random.default_rng(zlib.crc32(name.encode()))


def section_of(rng):
    """A size, a plate whose thickness suits it, its bending stiffness and Poisson's ratio."""
    size = 10.0 ** rng.uniform(-2.0, 2.0)
    E, nu, rho = references.MATERIALS[rng.integers(3)]
    thickness = size * 10.0 ** rng.uniform(-4.0, -1.0)
    plate = fi.Plate(fi.Material(E=E, nu=nu, rho=rho), thickness)
    return size, plate, references.rigidity(E, nu, thickness), nu


def polygon_points(rng, corners, kinds, count):
    """Points (count, 2) inside, on edges and corners that can move, and beside any edge and corner."""
    corners = np.asarray(corners)
    n, size = len(corners), np.ptp(corners, axis=0).max()
    step = np.roll(corners, -1, axis=0) - corners
    along = step / np.linalg.norm(step, axis=1, keepdims=True)
    inward = np.column_stack([-along[:, 1], along[:, 0]])
    moving = [i for i in range(n) if kinds[i] == "free"]
    tips = [i for i in range(n) if kinds[i] == kinds[i - 1] == "free"]
    points = []
    while len(points) < count:
        kind, i = rng.choice(5, p=[0.35, 0.1, 0.05, 0.3, 0.2]), rng.integers(n)
        d = size * 10.0 ** rng.uniform(*DISTANCES)
        if kind == 0:
            point = corners.min(axis=0) + rng.random(2) * np.ptp(corners, axis=0)
        elif kind == 1 and moving:
            i = rng.choice(moving)
            points.append(corners[i] + rng.uniform(0.01, 0.99) * step[i])
            continue
        elif kind == 2 and tips:
            points.append(corners[rng.choice(tips)])
            continue
        elif kind == 3:
            point = corners[i] + rng.uniform(0.0, 1.0) * step[i] + d * inward[i]
        else:
            turn = rng.uniform(0.0, 2.0 * np.pi)
            point = corners[i] + d * np.array([np.cos(turn), np.sin(turn)])
        if within(corners, point) and off_edges(corners, point) > 0.99e-4 * size:
            points.append(point)
    return np.array(points)


def within(corners, point):
    """Whether a point lies in a polygon: the number of sides that a ray crosses is odd."""
    (x, y), inside = point, False
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0)):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0):
            inside = not inside
    return inside


def off_edges(corners, point):
    """Distance of a point from the nearest side."""
    step = np.roll(corners, -1, axis=0) - corners
    share = np.clip(((point - corners) * step).sum(axis=1) / (step**2).sum(axis=1), 0.0, 1.0)
    return np.linalg.norm(corners + share[:, None] * step - point, axis=1).min()


def round_points(rng, inner, outer, hole, count):
    """The same for a disk or ring of unit radius; a rim's own points only where it can move."""
    radii = []
    rims = [(1.0, -1.0, outer)] + ([(hole, hole, inner)] if inner else [])
    while len(radii) < count:
        r, off, kind = rims[rng.integers(len(rims))]
        choice, d = rng.random(), 10.0 ** rng.uniform(*DISTANCES)
        if choice < 0.4:
            radii.append(np.sqrt(rng.uniform(hole**2, 1.0)))
        elif choice < 0.55 and kind == "free":
            radii.append(r)
        elif choice > 0.55:
            radii.append(r + off * d)
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    return np.array(radii)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def body(name, count):
    """Finite element modes of a body, points on it [m] and the true compliance there [m/N], both (count,)."""
    rng = stream(name)
    size, plate, D, nu = section_of(rng)
    if name in ROUND:
        inner, outer, hole = ROUND[name]
        points = round_points(rng, inner, outer, hole, count)
        mesh = fi.mesh.disk(size, hole * size)
        supports = {"outer": outer} | ({"inner": inner} if inner else {})
        radii = [1.0 if abs(r - 1.0) < 1e-12 else hole if abs(r - hole) < 1e-12 else r for r in np.hypot(*points.T)]
        truth = [references.ring_compliance(inner, outer, hole, nu, float(r)) for r in radii]
    elif name in STRIPS:
        bottom, top, width = STRIPS[name]
        corners = ((0.0, 0.0), (1.0, 0.0), (1.0, width), (0.0, width))
        points = polygon_points(rng, corners, (bottom, "hinged", top, "hinged"), count)
        mesh = fi.mesh.rectangle(size, width * size)
        supports = {"left": "hinged", "right": "hinged", "bottom": bottom, "top": top}
        truth = [references.levy((bottom, top), 1.0, width, nu, p, p) for p in points]
    elif name == "hinged triangle":
        corners = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
        points = polygon_points(rng, corners, ("hinged",) * 3, count)
        mesh, supports = fi.mesh.polygon(size * np.array(corners)), {"boundary": "hinged"}
        truth = [references.hinged_triangle(1.0, p) for p in points]
    else:
        corners, kinds = MIXED[name]
        points = polygon_points(rng, corners, kinds, count)
        # moments of mixed elements do not feel a force at a corner; corners are the strips' and the triangle's part
        at_corner = np.linalg.norm(points[:, None] - np.array(corners), axis=2).min(axis=1) < 1e-9
        points[at_corner] += 0.01 * (np.mean(corners, axis=0) - points[at_corner])
        mesh = fi.mesh.polygon(size * np.array(corners))
        supports = {f"edge{i}": kind for i, kind in enumerate(kinds)}
        extent = np.ptp(np.array(corners), axis=0).max()
        truth = []
        for point in points:
            gap = off_edges(np.array(corners), point) / extent
            smallest = min(1e-3, 0.05 * gap) if gap > 1e-9 else 1e-3
            truth.append(references.polygon_compliance(corners, kinds, nu, point, smallest=smallest))
    modes = fi.find_modes(fi.assemble(mesh, plate, supports=supports), n_modes=N_MODES)
    return modes, size * points, np.array(truth) * size**2 / D


@functools.cache
def measured(name, count):
    """Points, truth, answer and claimed error (count,) of a body, and where its modes are softer than the whole."""
    modes, points, truth = body(name, count)
    found, claim, softer = np.empty(count), np.empty(count), []
    for i, point in enumerate(points):
        found[i] = modes.shapes.compliance(point[None])[0, 0]
        claim[i] = modes.shapes.compliance_error(point[None])[0]
        try:
            rest = modes.residual_compliance(point[None])[0, 0]
        except fi.SimulationError as error:
            softer.append(str(error))
            continue
        both = rest + modes.modal_compliance(point[None])[0, 0]
        assert abs(both / found[i] - 1.0) < 1e-9  # the same number by definition, less rounding
    return points, truth, found, claim, softer


def check(name, count):
    points, truth, found, claim, softer = measured(name, count)
    error = np.abs(found / truth - 1.0)
    wrong = [
        f"at ({x:.9g}, {y:.9g}) m: {answer:.9g}, truth {right:.9g} m/N, off by {off:.1e}, claim {said:.1e}"
        for (x, y), answer, right, off, said in zip(points, found, truth, error, claim)
        if off > ACCURACY
    ]
    assert not wrong, "\n".join(wrong)
    assert not softer, "\n".join(softer)


def share_covered(cases):
    """Share of points whose error is within three times the claim, and the worst of the others."""
    error, claim, place = [], [], []
    for name, count in cases:
        points, truth, found, said, _ = measured(name, count)
        error.append(np.abs(found / truth - 1.0))
        claim.append(said)
        place += [(name, *point) for point in points]
    error, claim = np.concatenate(error), np.concatenate(claim)
    covered = error <= 3.0 * claim + FLOOR
    worst = np.argsort((error - FLOOR) / claim)[::-1][:10]
    text = [f"{place[i]}: off by {error[i]:.1e}, claim {claim[i]:.1e}" for i in worst]
    return covered.mean(), "\n".join(text)


PLATES = [*STRIPS, *ROUND, "hinged triangle"]


ALIKE = (  # others of the same series are quick to run
    "strip clamped and free", "strip hinged and free", "ring on its hinged rim", "ring clamped at both rims",
    "ring hinged inside, clamped outside",
)  # fmt: skip
QUICKEST = [pytest.param(name, marks=pytest.mark.slow) if name in ALIKE else name for name in PLATES]


@pytest.mark.xdist_group("static few")  # the claims are of the same points
@pytest.mark.parametrize("name", QUICKEST)
def test_a_plate_gives_what_its_series_says_at_any_point(name):
    check(name, FAST)


@pytest.mark.slow
@pytest.mark.xdist_group("static many")
@pytest.mark.parametrize("name", PLATES)
def test_a_plate_gives_what_its_series_says_at_many_points(name, all_cases):
    check(name, ALL if all_cases else SLOW)


@pytest.mark.slow
def test_a_clamped_rectangle_gives_what_mixed_elements_say():
    pytest.importorskip("ngsolve")
    check("clamped rectangle", MIXED_FAST)


@pytest.mark.slow
@pytest.mark.thin(4)
@pytest.mark.xdist_group("static many")
@pytest.mark.parametrize("name", MIXED)
def test_a_polygon_gives_what_mixed_elements_say(name, all_cases):
    pytest.importorskip("ngsolve")
    check(name, MIXED_ALL if all_cases else MIXED_SLOW)


@pytest.mark.xdist_group("static few")
def test_claims_cover_the_error():
    covered, worst = share_covered([(name, FAST) for name in PLATES if name not in ALIKE])
    assert covered >= 0.99, worst


@pytest.mark.slow
@pytest.mark.xdist_group("static many")
def test_claims_cover_the_error_at_many_points(all_cases):
    pytest.importorskip("ngsolve")
    count, mixed = (ALL, MIXED_ALL) if all_cases else (SLOW, MIXED_SLOW)
    covered, worst = share_covered([(name, count) for name in PLATES] + [(name, mixed) for name in MIXED])
    assert covered >= 0.99, worst


@functools.cache
def beam_errors(ends):
    """Relative errors of a beam's elements and closed form (2, n), claims of the elements and places over length."""
    rng = stream("-".join(ends))
    size = 10.0 ** rng.uniform(-2.0, 2.0)
    E, nu, rho = references.MATERIALS[rng.integers(3)]
    thickness = size * 10.0 ** rng.uniform(-4.0, -1.0)
    bar = fi.Beam.rectangular(fi.Material(E=E, nu=nu, rho=rho), width=thickness, height=thickness)
    held = dict(zip(("left", "right"), ends))
    elements = fi.find_modes(fi.assemble(fi.mesh.line(size), bar, held), n_modes=N_MODES)
    closed = fi.analytic.beam(size, ends=ends, section=bar, n_modes=N_MODES)
    beside = 10.0 ** rng.uniform(*DISTANCES, 28)
    tips = [x for x, end in zip((0.0, 1.0), ends) if end == "free"]
    places = np.concatenate([tips, beside[::2], 1.0 - beside[1::2], [0.5], rng.random(BEAM_POINTS)])[:BEAM_POINTS]
    unit = size**3 / (E * thickness**4 / 12.0)
    errors, claims = np.empty((2, BEAM_POINTS)), np.empty(BEAM_POINTS)
    for i, x in enumerate(places):
        truth, point = references.beam_compliance(ends, x) * unit, np.array([[x * size]])
        errors[:, i] = [abs(modes.shapes.compliance(point)[0, 0] / truth - 1.0) for modes in (elements, closed)]
        claims[i] = elements.shapes.compliance_error(point)[0]
        elements.residual_compliance(point)  # raises where the modes are softer than the whole
    return errors, claims, places


@pytest.mark.parametrize("ends", BEAMS, ids="-".join)
def test_beams_of_elements_and_of_closed_form(ends):
    errors, _, places = beam_errors(ends)
    assert errors[0].max() <= ACCURACY, places[errors[0].argmax()]
    assert errors[1].max() <= ACCURACY, (places[errors[1].argmax()], errors[1].max())


def test_claims_of_beams_cover_the_error():
    found = [(ends, *beam_errors(ends)) for ends in BEAMS]
    error, claim = (np.concatenate(x) for x in ([f[1][0] for f in found], [f[2] for f in found]))
    place = [(f[0], x) for f in found for x in f[3]]
    covered = error <= 3.0 * claim + 1e-12  # below that, rounding of the answer and of its error
    worst = [(place[i], error[i], claim[i]) for i in np.argsort(error / (3.0 * claim + 1e-12))[::-1][:10]]
    assert covered.mean() >= 0.99, (covered.mean(), worst)


@pytest.mark.parametrize("name", ["hinged rectangle", "clamped disk", "hinged disk", "ring clamped at both rims"])
@pytest.mark.slow
def test_points_on_a_support_rest(name):
    rng = stream("rest " + name)
    size, plate, D, _ = section_of(rng)
    if name in ROUND:
        inner, outer, hole = ROUND[name]
        mesh, supports = fi.mesh.disk(size, hole * size), {"outer": outer} | ({"inner": inner} if inner else {})
        angle, radius = rng.uniform(0.0, 2.0 * np.pi, 2), np.array([1.0, hole or 1.0])
        points = size * radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    else:
        mesh, supports = fi.mesh.rectangle(size, size), {"boundary": "hinged"}
        points = size * np.array([[0.0, rng.random()], [rng.random(), 1.0], [0.0, 0.0], [1.0, 1.0]])
    modes = fi.find_modes(fi.assemble(mesh, plate, supports=supports), n_modes=N_MODES)
    for point in points:
        assert abs(modes.shapes.compliance(point[None])[0, 0]) <= RESTS * 1e-2 * size**2 / D


@pytest.mark.parametrize("ends", BEAMS, ids="-".join)
def test_products_for_beams_against_macaulays_bracket(ends):
    for x in (0.2, 0.5, 0.9):
        both = references.beam_compliance(ends, x), references.beam_deflection(ends, x, x)
        assert abs(both[0] / both[1] - 1.0) < 1e-11  # both exact but for rounding


# The references against each other: each formula is checked by one that shares no step with it.


@pytest.mark.parametrize("point", [(0.3, 0.4), (1.5, 0.9), (0.775, 0.03), (0.02, 0.5)])
def test_levy_series_against_naviers(point):
    m, n = np.pi * np.arange(1, 4001)[:, None] / 1.55, np.pi * np.arange(1, 4001)
    waves = (np.sin(m * point[0]) * np.sin(n * point[1])) ** 2 / (m**2 + n**2) ** 2
    coarse, fine = (4.0 / 1.55 * waves[:k, :k].sum() for k in (2000, 4000))
    # Navier's series leaves some 1 / n**2 of a full plate's compliance: the extrapolated one an eighth of that.
    slack = 0.5 * (fine - coarse)
    assert abs(references.levy(("hinged", "hinged"), 1.55, 1.0, 0.3, point, point) - fine) < max(slack, 1e-12)


@pytest.mark.parametrize("edge", SIDES)
@pytest.mark.slow
def test_fourier_series_against_sums_over_modes(edge):
    rho, nu, reach = 0.6, 0.3, 45.0
    total = sum(
        references.disk_radial_squares(edge, nu, z, n, rho) * 0.5 ** (n > 0) * (1.0 if n == 0 else 2.0) / (np.pi * z**4)
        for z, n in references.disk_roots(edge, nu, reach)
    )
    rest = 1.0 / (4.0 * np.pi * reach**2) / 2.0  # of an endless plate: the integral of dk / (2 pi k**3)
    found = references.ring_compliance(None, edge, 0.0, nu, rho)
    assert abs(total + 2.0 * rest - found) < 0.2 * rest  # the number of modes per step of k waves about its mean
