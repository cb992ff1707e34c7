"""References for shells, ribs and laminates against each other: formulas against Ritz, limits, bounds, literature."""

from dataclasses import replace

import numpy as np
import pytest
import shell_references
from references_panels import (
    BLADE,
    DOMED,
    Panel,
    clamped_blade,
    domed_panel,
    levy_modes,
    levy_omegas,
    panel_modes,
    panel_stretching,
    rectangular_rib,
)
from references_plates import disk_roots
from references_ritz import Order, Round, RoundFields, round_modes, round_omegas, round_stretching
from references_shells import (
    angle_ply_panel,
    cap_roots,
    diaphragm_panel,
    isotropic,
    isotropic_panel,
    stack,
    t_beam,
)

E, NU, RHO, H = 210e9, 0.3, 7850.0, 1e-3
STEEL = isotropic(E, NU, H)
PLY = (138e9, 8.96e9, 0.3, 7.1e9)  # carbon: E1, E2, nu12, G12
DIAPHRAGM = (("hinged", "sliding"),) * 4
SIDES = (1.0, 0.7)


def disk(rise, edge=("free", "free"), radius=1.0, **changes):
    """A cap of a rise [m], as far as shallow theory tells it from a paraboloid."""
    slope = None if rise == 0.0 else lambda r: -2.0 * rise * r / radius**2
    return Round(E, NU, RHO, H, radius, slope, edge=edge, **changes)


def curved(zxx, zyy, sides=SIDES):
    return lambda x, y: (zxx * (x - 0.5 * sides[0]), zyy * (y - 0.3 * sides[1]))


def lowest_waves(frequency, count, most=9):
    return np.sort([frequency((m, n)) for m in range(1, most) for n in range(1, most)])[:count]


# Bodies of revolution


def test_plane_disk_by_ritz_has_the_roots_of_bessel_functions():
    rows = round_omegas(disk(0.0), count=3, most=5, order=Order(4, 11))[:8]
    roots = disk_roots("free", NU, 7.5)[:8]
    assert [k for _, k, _ in rows] == [k for _, k in roots]
    squares = [omega / np.sqrt(disk(0.0).bending / disk(0.0).per_area) for omega, _, _ in rows]
    np.testing.assert_allclose(squares, [z**2 for z, _ in roots], rtol=1e-12)


@pytest.mark.parametrize("edge", [("free", "free"), ("clamped", "held")])
@pytest.mark.parametrize("rise", [1e-4, 1e-3, 5e-3, 2e-2])
def test_spherical_cap_by_bessel_and_kelvin_functions_and_by_ritz(rise, edge):
    """No step is common: stress function and determinant there, displacements and energy here. 5e-11 was measured."""
    body, chi = disk(rise, edge), 12.0 * (1.0 - NU**2) * (2.0 * rise / H) ** 2
    for k in range(5):
        omega = round_modes(body, k, 4, Order(4, 13))[0]
        squares = omega[omega > 0.0][:2] ** 2 * body.per_area / body.bending
        roots = cap_roots(k, chi, NU, edge[0], squares[-1] + 50.0)
        np.testing.assert_allclose(roots[:2], squares, rtol=1e-10)


def test_circles_of_a_free_cap_rise_as_its_curvature_squared():
    """Touze and Thomas (2006): with no nodal diameter, squared frequencies grow by E / (rho R**2) exactly."""
    for rise in (1e-3, 0.02):
        plane, cap = (round_modes(disk(z), 0, 4, Order(6, 12))[0] for z in (0.0, rise))
        np.testing.assert_allclose(cap[1:] ** 2 - plane[1:] ** 2, 4.0 * E / RHO * rise**2, rtol=1e-6)


def test_a_cap_bends_without_stretching_where_it_can():
    """Frequencies with k > 1 and no circle hardly grow with the rise, those with circles at least as E / R**2."""
    plane, cap = (round_modes(disk(z), 2, 2)[0] for z in (0.0, 0.02))
    assert 1.0 < cap[0] / plane[0] < 1.06
    assert cap[1] ** 2 > E / RHO * 4.0 * 0.02**2


@pytest.mark.parametrize("k", range(3))
def test_ritz_of_bodies_of_revolution_falls_to_its_limit(k):
    body = disk(5e-3)
    exact = round_modes(body, k, 4, Order(6, 13))[0]
    errors = [round_modes(body, k, 4, order)[0][1:] / exact[1:] - 1.0 for order in (Order(1, 8), Order(2, 8))]
    assert (errors[0] > 0.0).all() and (errors[1] >= -1e-13).all() and (errors[1] < errors[0]).all()


def test_a_hole_too_small_to_matter_and_inertia_in_the_plane():
    body = disk(5e-3, breaks=(0.1,))
    for k in (0, 2):
        whole = round_modes(body, k, 3, Order(4, 11))[0]
        bored = round_modes(replace(body, hole=1e-4), k, 3, Order(6, 11))[0]
        np.testing.assert_allclose(bored[whole > 0.0], whole[whole > 0.0], rtol=1e-6)  # the hole's area, squared sizes
        moving = round_modes(replace(body, inertia=True), k, 3, Order(4, 11))[0]
        ratio = moving[whole > 0.0] / whole[whole > 0.0]
        assert (ratio < 1.0).all() and (ratio > 1.0 - 2.0 * 0.01**2).all()  # as the slope squared


# Rectangles


@pytest.mark.parametrize("curvature", [(0.2, 0.2), (0.2, 0.0), (0.0, 0.2), (0.2, -0.2)])
def test_curved_panels_on_diaphragms_three_ways(curvature):
    closed = lowest_waves(lambda mn: isotropic_panel(SIDES, E, NU, RHO, H, mn, curvature), 6)
    sines = lowest_waves(lambda mn: diaphragm_panel(SIDES, STEEL, RHO * H, mn, curvature), 6)
    np.testing.assert_allclose(sines, closed, rtol=1e-13)
    panel = Panel(SIDES, STEEL, RHO * H, DIAPHRAGM, curved(*curvature))
    np.testing.assert_allclose([row[0] for row in levy_omegas(panel, 6, Order(2, 16), curvature)], closed, rtol=1e-11)
    np.testing.assert_allclose(panel_modes(panel, 3, Order(1, 11))[0], closed[:3], rtol=1e-3)  # up to five half waves


def test_inertia_in_the_plane_of_a_curved_panel():
    """Along the surface or along the plane, it matters by the square of the slope, which is 0.1 at most."""
    for mn in ((1, 1), (2, 1), (3, 3)):
        without = diaphragm_panel(SIDES, STEEL, RHO * H, mn, (0.2, 0.2))
        moving = diaphragm_panel(SIDES, STEEL, RHO * H, mn, (0.2, 0.2), inertia=True)
        assert 1.0 - 0.1**2 < moving[0] / without < 1.0
    panel = Panel(SIDES, STEEL, RHO * H, DIAPHRAGM, curved(0.2, 0.2), inertia=True)
    along = lowest_waves(lambda mn: diaphragm_panel(SIDES, STEEL, RHO * H, mn, (0.2, 0.2), inertia=True)[0], 4)
    np.testing.assert_allclose(panel_modes(panel, 4, Order(1, 10))[0], along, rtol=0.1**2)


@pytest.mark.parametrize(
    ("angles", "edge", "formula"),
    [
        ((0, 90), "sliding", diaphragm_panel),
        ((45, -45), "across", angle_ply_panel),
        ((30, -30) * 2, "across", angle_ply_panel),
    ],
)
@pytest.mark.parametrize("inertia", [False, True])
def test_unsymmetric_laminates_by_sines_and_by_ritz(angles, edge, formula, inertia):
    stiffness, per_area = stack([(PLY, 0.5e-3, degrees) for degrees in angles]), 1600.0 * 0.5e-3 * len(angles)
    panel = Panel((0.4, 0.3), stiffness, per_area, (("hinged", edge),) * 4, inertia=inertia)
    closed = lowest_waves(lambda mn: np.min(formula((0.4, 0.3), stiffness, per_area, mn, inertia=inertia)), 5)
    np.testing.assert_allclose(panel_modes(panel, 3, Order(1, 10))[0], closed[:3], rtol=1e-6)


def test_stacks():
    np.testing.assert_allclose(isotropic(E, NU, H)[2][0, 0], E * H**3 / 12.0 / (1.0 - NU**2), rtol=1e-15)
    A, B, _ = stack([(PLY, 1e-3, 0), (PLY, 2e-3, 90), (PLY, 1e-3, 0)])
    assert np.abs(B).max() < 1e-12 * A.max()  # symmetric
    halves = stack([(PLY, 1e-3, 30), (PLY, 1e-3, 30)])
    for whole, two in zip(stack([(PLY, 2e-3, 30)]), halves):
        np.testing.assert_allclose(two, whole, rtol=1e-14, atol=1e-12 * np.abs(A).max())
    turned = stack([(PLY, 1e-3, 90), (PLY, 1e-3, 0)])
    np.testing.assert_allclose(turned[1], -stack([(PLY, 1e-3, 0), (PLY, 1e-3, 90)])[1], rtol=1e-13, atol=1e-9)


@pytest.mark.slow
def test_plates_of_the_literature():
    """Clamped and free squares, and two free edges (Leissa 1973, J. Sound Vib. 31, 257-293, upper bounds)."""
    scale = np.sqrt(RHO * H / STEEL[2][0, 0])

    def square(edges):
        return scale * panel_modes(Panel((1.0, 1.0), STEEL, RHO * H, edges), 10, Order(1, 16))[0]

    np.testing.assert_allclose(
        square((("clamped", "held"),) * 4)[:4], [35.98519, 73.39385, 73.39385, 108.21650], rtol=1e-6
    )
    np.testing.assert_allclose(square((("free", "free"),) * 4)[3:6], [13.468197, 19.596137, 24.270201], rtol=1e-6)
    two = (("hinged", "sliding"),) * 2 + (("free", "free"),) * 2
    levy = scale * np.array(levy_omegas(Panel((1.0, 1.0), STEEL, RHO * H, two), 5))[:, 0]
    np.testing.assert_allclose(levy, [9.6314, 16.1348, 36.7256, 38.9450, 46.7381], rtol=5e-6)
    np.testing.assert_allclose(square(two)[:5], levy, rtol=1e-7)


def test_clamped_cylindrical_panel_and_the_bounds_of_ritz():
    """Five frequencies of the literature, 870, 958, 1288, 1364 and 1440 Hz, are those of shallow theory rounded."""
    coarse, fine = (panel_modes(clamped_blade(), 5, order)[0] / (2.0 * np.pi) for order in (Order(1, 9), Order(1, 12)))
    assert (coarse > fine).all()
    np.testing.assert_allclose(fine, [870.0, 958.0, 1288.0, 1364.0, 1440.0], atol=0.5)
    np.testing.assert_allclose(fine, BLADE[:5], rtol=2e-5)


# Ribs


def test_eccentric_rib_makes_a_t_beam_of_a_narrow_plate():
    """Strip of 1 m by 40 mm; that its sides need not follow (shear lag, and nu) is 7e-4 in the first mode."""
    E, RHO, thickness = 70e9, 2700.0, 2e-3
    length, width, section = 1.0, 0.04, (3e-3, 20e-3)
    rib = rectangular_rib("x", 0.5 * width, *section, thickness, E, NU, RHO)
    edges = (("hinged", "sliding"),) * 2 + (("free", "free"),) * 2
    strip = Panel((length, width), isotropic(E, NU, thickness), RHO * thickness, edges, ribs=(rib,))
    exact = levy_modes(strip, 1, 1)[0]
    np.testing.assert_allclose(exact / t_beam(length, 1, E, RHO, (width, thickness), section), 1.0, atol=1e-3)
    np.testing.assert_allclose(exact / (2.0 * np.pi), 53.082557782, rtol=1e-10)  # 4.6 Hz without the rib
    np.testing.assert_allclose(panel_modes(strip, 1, Order(1, 8))[0][0], exact, rtol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("curvature", [(0.0, 0.0), (-0.04, -0.02)])
def test_ribbed_panel_on_diaphragms_by_levy_and_by_ritz(curvature):
    ribs = (rectangular_rib("x", 0.3, 4e-3, 15e-3, H, E, NU, RHO),)
    panel = Panel(SIDES, STEEL, RHO * H, DIAPHRAGM, curved(*curvature), ribs)
    levy = [row[0] for row in levy_omegas(panel, 4, curvature=curvature)]
    np.testing.assert_allclose(panel_modes(panel, 4, Order(1, 10))[0], levy, rtol=1e-4)
    upward = replace(panel, ribs=tuple(replace(rib, offset=-rib.offset) for rib in ribs))
    mirrored = [row[0] for row in levy_omegas(upward, 4, curvature=tuple(-z for z in curvature))]
    np.testing.assert_allclose(mirrored, levy, rtol=1e-10)
    centred = replace(panel, ribs=tuple(replace(rib, offset=0.0) for rib in ribs))
    assert (np.array([row[0] for row in levy_omegas(centred, 4, curvature=curvature)]) < levy).all()


# Large deflections


@pytest.mark.parametrize(
    ("k", "n", "nu", "gamma"), [(2, 0, 0.38, 1.898356), (0, 0, 0.3, 8.501230), (3, 0, 0.3, 16.87594)]
)
def test_stretching_of_a_free_disk(k, n, nu, gamma):
    """Touze, Thomas and Chaigne (2002), J. Sound Vib. 258, 649-676, print 1.898; more digits by stress functions."""
    body = Round(1.0, nu, 1.0, 0.01, 1.0)
    cubic, quartic = round_stretching(body, k, n, Order(3, 9))
    np.testing.assert_allclose(4.0 * quartic * body.per_area**2 / body.E / body.thickness, gamma, rtol=1e-6)
    assert abs(cubic) < 1e-9 * np.sqrt(quartic) * round_modes(body, k, n + 3)[0].max()


@pytest.mark.parametrize(
    ("plane", "ratio"), [("across", 0.75 * (2.0 * (3.0 - NU**2) + 4.0 * NU) / 4.0), ("free", 0.177236)]
)
def test_stretching_of_a_hinged_square(plane, ratio):
    """Chu and Herrmann (1956), J. Appl. Mech. 23, 532-540, let edges slide along themselves; free: Gamma 25.29581."""
    square = Panel((1.0, 1.0), STEEL, RHO * H, (("hinged", plane),) * 4)
    omega, _, quartic = panel_stretching(square, 1, Order(1, 9))
    middle = 2.0 / np.sqrt(RHO * H)  # of the mode, there
    np.testing.assert_allclose(4.0 * quartic.item() / omega.item() ** 2 * (H / middle) ** 2, ratio, rtol=1e-4)


def test_a_rise_like_the_mode_makes_the_cubic_term_four_times_the_quartic():
    """Stretching from rise c to c + q is that of a plane body from 0, (c + q)**2 - c**2 in place of q**2."""
    plane, order = disk(0.0, ("clamped", "held")), Order(2, 9)
    fields, x = RoundFields(plane, 0, order), round_modes(plane, 0, 1, order)[1][:, 0]
    shape = fields.kept[2 * fields.plane.size :] @ x
    c = 0.01 * H * np.sqrt(plane.per_area * plane.radius**2)
    cap = replace(plane, slope=lambda r: c * (fields.normal.at(r, 1) @ shape))
    (_, flat), (cubic, quartic) = (round_stretching(body, 0, 0, order) for body in (plane, cap))
    np.testing.assert_allclose(abs(cubic), 4.0 * c * flat, rtol=1e-3)  # the mode changes by the rise squared
    np.testing.assert_allclose(quartic, flat, rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("plane", DOMED)
def test_stretching_of_a_domed_panel(plane):
    omega, cubic, quartic = panel_stretching(domed_panel(plane), 1, Order(1, 10))
    np.testing.assert_allclose([omega.item(), abs(cubic.item()), quartic.item()], DOMED[plane], rtol=3e-6)


# Solids


@pytest.mark.parametrize(("name", "worst"), [("cap", 4.5e-3), ("cymbal", 3e-3), ("cymbal, steep cup", 1.1e-2)])
def test_shallow_theory_against_solids_of_revolution(name, worst):
    """Slopes are 0.1, 0.1 and 0.47; half of what shallow theory errs by is the inertia in the plane it leaves out."""
    solid, table = shell_references.BODIES[name], shell_references.read()[name]
    body = Round(
        solid.E, solid.nu, solid.rho, solid.thickness, solid.radius, solid.slope,
        breaks=(solid.cup_radius,), inertia=False,
    )  # fmt: skip
    errors = []
    for each in (body, replace(body, inertia=True)):
        rows = {f"({k},{n})": omega / (2.0 * np.pi) for omega, k, n in round_omegas(each, 6, 9, Order(3, 9))}
        errors.append(max(abs(rows[mode] / frequency - 1.0) for mode, frequency, _ in table))
    assert 0.5 * worst < errors[0] < worst
    assert errors[1] < errors[0]


def free_solid(name):
    """The body of that name as a panel of plate theory."""
    body = shell_references.BODIES[name]
    if name == "layered":
        ply = (body.E1, body.E2, body.nu12, body.G12)
        layers = [(ply, body.layer, angle) for angle in body.angles]
        return Panel(body.sides, stack(layers), body.rho * body.layer * len(layers))
    (a, b), h = body.sides, body.thickness
    places = (("x", body.rib_y), ("y", body.rib_x))
    ribs = tuple(rectangular_rib(*place, *body.rib, h, body.E, body.nu, body.rho) for place in places)
    slopes = lambda x, y: (body.zxx * (x - 0.5 * a), body.zyy * (y - 0.5 * b))  # noqa: E731
    return Panel((a, b), isotropic(body.E, body.nu, h), body.rho * h, slopes=slopes, ribs=ribs)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "order"), [("layered", 11), ("ribbed", 6), ("ribbed and domed", 6)])
def test_plate_theory_against_solids_of_bricks(name, order):
    """Eight modes; shallow theory leaves out squared slopes of 0.07, and a line a width of 0.5 % of the side."""
    table = shell_references.read()[name][:8]
    found = panel_modes(free_solid(name), 11, Order(1, order))[0][3:] / (2.0 * np.pi)
    np.testing.assert_allclose(found, [row[1] for row in table], rtol=7e-3)


def test_solids_are_converged():
    for name, rows in shell_references.read().items():
        worst = max(abs(coarser) for _, _, coarser in rows[:8])
        assert worst < (1e-5 if name.startswith("c") else 1e-3), name
