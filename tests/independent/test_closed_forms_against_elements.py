"""Closed-form modes, finite element modes and textbook formulas, each against the others, over all sizes."""

import functools
import itertools

import numpy as np
import pytest
import references_plates as references
from numpy.testing import assert_allclose

import fem_impact as fi

ROUNDING = 1e-12  # [-] of frequencies: both sides take roots to 1e-15, and a square and a cube of sizes
FLOOR = 1e-11  # [-] truth below which a claim cannot be told from rounding
FAST, SLOW = 24, 240  # seeded bodies
RINGS = [("clamped", "free", 0.3), ("free", "hinged", 0.4), ("clamped", "clamped", 0.5), ("free", "free", 0.25)]
RINGS += [("hinged", "clamped", 0.2), ("hinged", "free", 0.6), ("free", "clamped", 0.1), ("clamped", "hinged", 0.7)]
KINDS = [
    *(("beam", ends) for ends in itertools.product(references.ENDS, repeat=2)),
    *(("disk", edge) for edge in references.ENDS),
    *(("rectangle", None) for _ in range(3)),
    *(("disk", edge) for edge in references.ENDS),
]


def draw(seed):
    """A body with seeded sizes: kind, detail, size, width, thickness, material, number of flexible modes."""
    rng = np.random.default_rng(seed)
    kind, detail = KINDS[seed % len(KINDS)]
    size, thin = 10.0 ** rng.uniform(-2.0, 2.0), 10.0 ** rng.uniform(-4.0, -1.0)
    material = references.MATERIALS[seed % 3 if seed % 2 else rng.integers(3)]
    return kind, detail, size, size * rng.uniform(0.3, 1.0), size * thin, material, int(rng.integers(5, 26))


def formula(kind, detail, size, width, thickness, material, count):
    """Circular frequencies (count,) [rad/s] of the bending modes by textbook, mass [kg], number of rigid motions."""
    E, nu, rho = material
    if kind == "beam":
        bending, per_length = E * thickness**4 / 12.0, rho * thickness**2
        roots = references.beam_roots(detail, count)
        rigid = {0: 0, 1: 1, 2: 2}[detail.count("free")] - (set(detail) == {"free", "clamped"})
        return roots**2 / size**2 * np.sqrt(bending / per_length), per_length * size, rigid
    D, per_area = references.rigidity(E, nu, thickness), rho * thickness
    if kind == "rectangle":
        return references.rectangle_omegas(size, width, D, per_area, count)[0], per_area * size * width, 0
    roots = disk_list(detail, nu, count)
    omega = np.array([z**2 for z, _ in roots]) / size**2 * np.sqrt(D / per_area)
    return omega, per_area * np.pi * size**2, 3 if detail == "free" else 0


def disk_list(edge, nu, count):
    """Roots and nodal diameters of the first modes, pairs twice."""
    reach = 2.0 * np.sqrt(count) + 6.0
    twice = [root for root in references.disk_roots(edge, nu, reach) for _ in range(1 if root[1] == 0 else 2)]
    assert len(twice) >= count
    return twice[:count]


def bodies(kind, detail, size, width, thickness, material, count):
    """The same as objects: mesh, section, supports, closed form as a function of how it is scaled."""
    E, nu, rho = material
    stuff = fi.Material(E=E, nu=nu, rho=rho)
    if kind == "beam":
        section = fi.Beam.rectangular(stuff, width=thickness, height=thickness)
        held = dict(zip(("left", "right"), detail))
        return fi.mesh.line(size), section, held, functools.partial(fi.analytic.beam, size, ends=detail)
    section = fi.Plate(stuff, thickness)
    if kind == "rectangle":
        mesh = fi.mesh.rectangle(size, width)
        return mesh, section, {"boundary": "hinged"}, functools.partial(fi.analytic.rectangle, size, width)
    mesh = fi.mesh.disk(size)
    return mesh, section, {"boundary": detail}, functools.partial(fi.analytic.disk, size, edge=detail)


@functools.cache
def compared(seed):
    """Truth and claim of the finite element frequencies, each (count,), the case and its finite element modes."""
    case = draw(seed)
    omega, _, rigid = formula(*case)
    mesh, section, supports, _ = bodies(*case)
    elements = fi.find_modes(fi.assemble(mesh, section, supports), n_modes=case[-1] + rigid)
    assert elements.n_rigid == rigid
    truth = np.abs(elements.omega[rigid:] / omega - 1.0)
    return truth, elements.frequency_error[rigid:], case, elements


def places(kind, size, width, rng):
    """Four points on the body [m]."""
    if kind == "beam":
        return size * np.append(rng.random(3), 1.0)[:, None]
    if kind == "rectangle":
        return rng.random((4, 2)) * (size, width)
    radius, angle = size * np.sqrt(np.append(rng.random(3), 1.0)), rng.uniform(0.0, 2.0 * np.pi, 4)
    return radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def groups(omega, gap):
    """Slices of modes closer to each other than a relative gap; the last, which may lack its partners, left out."""
    starts = np.append(0, np.flatnonzero(np.diff(omega) > gap * omega[1:]) + 1)
    return [slice(a, b) for a, b in itertools.pairwise(starts)]


def textbook_squares(case, points, omega):
    """Squared shapes times mass (n_points, n) of the bending modes by textbook; of a pair on a disk half its sum."""
    kind, detail, size, width, _, (_, nu, _), count = case
    if kind == "beam":
        return references.beam_squares(detail, references.beam_roots(detail, count), points[:, 0] / size)
    if kind == "rectangle":
        _, waves = references.rectangle_omegas(size, width, 1.0, 1.0, count)
        x, y = np.pi * points[:, :1] / size, np.pi * points[:, 1:] / width
        return 4.0 * (np.sin(x * waves[:, 0]) * np.sin(y * waves[:, 1])) ** 2
    r = np.hypot(*points.T) / size
    columns = [
        references.disk_radial_squares(detail, nu, z, n, r) * (1.0 if n == 0 else 0.5)
        for z, n in disk_list(detail, nu, count)
    ]
    return np.column_stack(columns)


def check_closed_form(seed):
    case = draw(seed)
    kind, _, size, width, _, material, count = case
    omega, mass, rigid = formula(*case)
    _, section, _, closed = bodies(*case)
    nu = {"nu": material[1]} if kind == "disk" else {}
    own = closed(section=section, n_modes=count + rigid)
    scaled = closed(mass=mass, first_frequency=omega[0] / (2.0 * np.pi), n_modes=count + rigid, **nu)
    points = places(kind, size, width, np.random.default_rng(seed))
    for modes in (own, scaled):
        assert modes.n_rigid == rigid
        assert_allclose(modes.omega[rigid:], omega, rtol=ROUNDING)
        assert_allclose(modes.mass, mass, rtol=1e-14)  # a product of four numbers
    limit = np.searchsorted(omega, omega[-1] * (1.0 - 1e-9))
    within = closed(section=section, max_frequency=omega[-1] * (1.0 - 1e-9) / (2.0 * np.pi)) if limit else own
    if limit:
        assert within.n_modes == rigid + limit
    # Both come from the same wavenumbers, scaled once
    assert_allclose(own.shape_at(points), scaled.shape_at(points), rtol=1e-11, atol=1e-11 * mass**-0.5)
    whole = [modes.shapes.compliance(points) for modes in (own, scaled)]
    assert_allclose(*whole, rtol=1e-11, atol=1e-13 * np.abs(whole[0]).max())  # the fourth power of those frequencies
    squares, expected = own.shape_at(points)[:, rigid:] ** 2 * mass, textbook_squares(case, points, omega)
    for part in groups(omega, 1e-9):
        # Shapes lose as many digits as the wave number has: Bessel functions to 1e-13 at these, quadrature 1e-12
        assert_allclose(squares[:, part].sum(axis=1), expected[:, part].sum(axis=1), rtol=1e-8, atol=1e-10)


def check_elements(seed):
    truth, claim, case, elements = compared(seed)
    kind, _, size, width, *_ = case
    omega, mass, rigid = formula(*case)
    assert_allclose(elements.mass, mass, rtol=1e-6 if kind == "disk" else 1e-12)  # a disk's rim of quintic curves
    missed = np.flatnonzero(truth > np.maximum(3.0 * claim, ROUNDING))
    text = "\n".join(f"mode {i}: off by {truth[i]:.2e}, claim {claim[i]:.2e}" for i in missed)
    points = places(kind, size, width, np.random.default_rng(seed))
    squares = elements.shape_at(points)[:, rigid:] ** 2 * mass
    expected = textbook_squares(case, points, omega)
    for part in groups(omega, max(1e-9, 100.0 * claim.max())):
        # The shape's error is about the root of the frequency's in energy, but the energy weighs curvature: values
        # are right to the frequency's error times ten or so, and those of modes that lie close mix by its inverse gap.
        both = squares[:, part].sum(axis=1), expected[:, part].sum(axis=1)
        assert_allclose(*both, atol=1e-3 * (part.stop - part.start))
    assert len(missed) <= max(1.0, 0.1 * len(truth)), text  # single misses are counted over all bodies below


def check_claims(seeds):
    """At most one mode in a hundred is further off than three times its claim; four in five claims are of its size."""
    truth, claim = (np.concatenate([compared(seed)[i] for seed in seeds]) for i in (0, 1))
    covered = truth <= np.maximum(3.0 * claim, ROUNDING)
    worst = np.argsort(truth / np.maximum(3.0 * claim, ROUNDING))[::-1][:5]
    assert covered.mean() >= 0.99, [(truth[i], claim[i]) for i in worst]
    seen = truth > FLOOR
    assert np.mean(claim[seen] <= 30.0 * truth[seen]) >= 0.8


@pytest.mark.parametrize("seed", range(FAST))
def test_a_closed_form_is_the_textbooks_and_the_same_by_section_and_by_mass(seed):
    check_closed_form(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(FAST, SLOW))
def test_more_closed_forms_are_the_textbooks(seed):
    check_closed_form(seed)


@pytest.mark.xdist_group("elements")  # the claims are of the same modes
@pytest.mark.parametrize("seed", range(FAST))
def test_elements_are_within_their_claim_of_the_textbook(seed):
    check_elements(seed)


@pytest.mark.slow
@pytest.mark.xdist_group("more elements")
@pytest.mark.parametrize("seed", range(FAST, SLOW))
def test_more_elements_are_within_their_claim_of_the_textbook(seed):
    check_elements(seed)


@pytest.mark.xdist_group("elements")
def test_claims_cover_the_error_and_are_of_its_size():
    check_claims(range(FAST))


@pytest.mark.slow
@pytest.mark.xdist_group("more elements")
def test_claims_cover_the_error_and_are_of_its_size_over_all_bodies():
    check_claims(range(SLOW))


@pytest.mark.parametrize("inner, outer, hole", RINGS[:3])
def test_rings(inner, outer, hole):
    check_ring(inner, outer, hole, 0)


@pytest.mark.slow
@pytest.mark.parametrize("inner, outer, hole", RINGS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_more_rings(inner, outer, hole, seed):
    check_ring(inner, outer, hole, seed)


def check_ring(inner, outer, hole, seed):
    rng = np.random.default_rng([seed, int(100 * hole)])
    size, thin, count = 10.0 ** rng.uniform(-2.0, 2.0), 10.0 ** rng.uniform(-4.0, -1.0), 14
    E, nu, rho = references.MATERIALS[rng.integers(3)]
    plate = fi.Plate(fi.Material(E=E, nu=nu, rho=rho), size * thin)
    modes = fi.find_modes(
        fi.assemble(fi.mesh.disk(size, hole * size), plate, {"inner": inner, "outer": outer}), n_modes=count
    )
    rigid = 3 if inner == outer == "free" else 0
    assert modes.n_rigid == rigid
    unit = np.sqrt(references.rigidity(E, nu, size * thin) / (rho * size * thin)) / size**2
    reach = 1.01 * np.sqrt(modes.omega[-1] / unit)
    found = references.ring_roots(inner, outer, hole, nu, reach)
    omega = np.array([z**2 * unit for z, n in found for _ in range(1 if n == 0 else 2)])[: count - rigid]
    truth, claim = np.abs(modes.omega[rigid:] / omega - 1.0), modes.frequency_error[rigid:]
    assert (truth <= np.maximum(3.0 * claim, ROUNDING)).all(), [*zip(truth, claim)]


@pytest.mark.parametrize("edge", references.ENDS)
def test_the_textbook_roots_of_disks(edge):
    # Leissa (1969), NASA SP-160, ch. 2, with converged digits: checks the reference itself
    printed = {
        "clamped": [10.2158262, 21.2603977, 34.8770354, 39.7711482],
        "hinged": [4.93514904, 13.8981651, 25.6132967, 29.7200047],
        "free": [5.3583298, 9.0031374, 12.4389882, 20.4745501],
    }[edge]
    squared = [z**2 for z, _ in references.disk_roots(edge, 0.3, 7.0)[:4]]
    assert_allclose(squared, printed, rtol=2e-8)  # the digits printed
