"""How singular corners are, against Williams' exponents, and triangles that shrink towards them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq, newton
from scipy.special import ivp, jvp

import fem_impact as fi
from fem_impact.fe import corners
from fem_impact.fe.corners import around_corners
from fem_impact.fe.material import rotated_stiffness
from fem_impact.mesh.loops import Arc, Outline, segment
from fem_impact.mesh.meshes import fill

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)


def exponent(degrees, kinds, stiffness=STEEL.plane_stress):
    return corners.exponent(np.radians(degrees), kinds, tuple((stiffness / stiffness.max()).ravel().tolist()))


@pytest.mark.parametrize(
    ("degrees", "kinds", "expected"),
    [
        (270.0, ("clamped", "clamped"), 1.5444837),  # Williams (1952): sin(1.5 pi z) = -z sin(1.5 pi), z = 0.5444837
        (360.0, ("clamped", "clamped"), 1.5),  # a crack: the square root
        (270.0, ("hinged", "hinged"), 4.0 / 3.0),  # twice pi over the angle
    ],
)
def test_exponent_of_the_deflection_at_a_corner(degrees, kinds, expected):
    assert_allclose(exponent(degrees, kinds), expected, atol=2e-6)


@pytest.mark.parametrize("degrees", [90.0, 150.0, 270.0, 330.0])
@pytest.mark.parametrize("words", [("free", "free"), ("held", "held"), ("held", "free")])
def test_exponent_of_displacements_in_the_plane_at_a_corner(degrees, words):
    """The smallest root of Williams' equations (1952, J. Appl. Mech. 19, 526-528), at most one."""
    angle, kappa = np.radians(degrees), (3.0 - STEEL.nu) / (1.0 + STEEL.nu)  # in plane stress

    def equation(z):
        if words == ("held", "free"):
            return np.sin(z * angle) ** 2 - ((kappa + 1.0) ** 2 / 4.0 - (z * np.sin(angle)) ** 2) / kappa
        return np.sin(z * angle) ** 2 - (z * np.sin(angle) / (kappa if words[0] == "held" else 1.0)) ** 2

    z = np.linspace(0.1, 0.999, 400)
    change = np.flatnonzero(np.diff(np.sign(equation(z))))
    expected = brentq(equation, z[change[0]], z[change[0] + 1]) if change.size else 1.0
    if words == ("held", "free") and degrees > 90.0:  # a pair of complex roots
        expected = newton(equation, 90.0 / degrees + 0.1j).real
    stiffness = tuple((STEEL.plane_stress / STEEL.plane_stress.max()).ravel().tolist())
    for pair in (words, words[::-1]):
        assert_allclose(corners.plane_exponent(angle, pair, stiffness), expected, atol=1e-6)


@pytest.mark.parametrize("held", [("left", "right"), ("left", "bottom", "top")])
def test_modes_of_a_panel_follow_the_plane_at_corners_between_held_and_free_edges(held):
    """Without rings of triangles there they err by 1.5e-4 and 2.5e-4, two and four times what was stated."""
    plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    kinds, how = (
        dict.fromkeys(held, "hinged"),
        {"rise": lambda p: 0.1 * (p[:, 0] - 0.2) ** 2 + 0.15 * (p[:, 1] - 0.1) ** 2},
    )
    usual, fine = (fi.assemble(fi.mesh.rectangle(0.465, 0.3, size=size), plate, kinds, **how) for size in (None, 0.02))
    modes, better = (fi.find_modes(system, n_modes=7) for system in (usual, fine))
    apart = np.abs(modes.frequencies / better.frequencies - 1.0)
    assert (apart <= modes.frequency_error + better.frequency_error).all()
    assert modes.frequency_error.max() < 2e-5  # a fifth of what coarser triangles there left
    assert fi.assemble(fi.mesh.rectangle(0.465, 0.3), plate, kinds, graded=False, **how).n_dofs < 0.8 * usual.n_dofs


@pytest.mark.parametrize("kinds", [("clamped", "free"), ("free", "free"), ("clamped", "hinged"), ("hinged", "hinged")])
def test_exponents_of_wood_are_those_of_its_mirror_image_and_not_of_steel(kinds):
    """The grain is 0.5 rad off the first edge of a corner of 100 degrees, and in the mirror as far off its last."""
    wood = fi.Material.orthotropic(E_along=12e9, E_across=0.8e9, nu=0.35, G=0.7e9, rho=430.0).plane_stress
    found = exponent(100.0, kinds, rotated_stiffness(wood, 0.5))
    assert_allclose(exponent(100.0, kinds[::-1], rotated_stiffness(wood, np.radians(100.0) - 0.5)), found, atol=1e-9)
    assert found < exponent(100.0, kinds) - 0.1


def test_a_clamped_right_angle_is_smooth_enough():
    assert exponent(90.0, ("clamped", "clamped")) > 2.5  # bounded bending moments


def test_only_the_notch_of_an_l_is_graded_by_triangles_that_are_narrow_and_not_narrower():
    mesh = fi.mesh.polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    fine = around_corners(mesh, ["clamped"] * len(mesh.facets), STEEL)[-1]
    corner = fine.points[fine.cells]  # (n_cells, 3, 2)
    side = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
    near = np.linalg.norm(corner - [1.0, 1.0], axis=2).min(axis=1) < 1e-12
    assert side[near].max() < 1e-3 < 0.05 < side[~near].max()
    first = np.linalg.norm(corner - [1.0, 1.0], axis=2).argmin(axis=1)
    at, a, b = (corner[np.arange(len(corner)), (first + i) % 3] for i in range(3))
    there = np.linalg.norm(at - [1.0, 1.0], axis=1) < 1e-12
    u, v = (side[there] / np.linalg.norm(side[there], axis=1, keepdims=True) for side in (a - at, b - at))
    assert 0.4 < np.arccos((u * v).sum(axis=1)).max() < 0.7


@pytest.mark.parametrize(("degrees", "kind"), [(270.0, "clamped"), (300.0, "clamped"), (110.0, "hinged")])
def test_the_innermost_ring_misses_a_ten_millionth_of_the_energy(degrees, kind):
    """The energy within r goes as r**(2 z - 2); half as large a ring would miss less than it may."""
    power = 2.0 * (exponent(degrees, (kind, kind)) - 1.0)
    n = corners.number_of_rings(exponent(degrees, (kind, kind)), (kind, kind))
    assert 0.5 ** (power * n) <= 1e-7 < 0.5 ** (power * (n - 1))


def test_rings_stop_where_rounding_takes_over():
    """Coordinates keep six digits of a ring of 1e-10; at a free corner, rounding goes as its size to the -2: 1e-11."""
    hinged, free = (corners.number_of_rings(exponent(172.5, (kind, kind)), (kind, kind)) for kind in ("hinged", "free"))
    assert 0.5**hinged <= 1e-10 < 0.5 ** (hinged - 1)
    assert 0.5**free <= 3e-3 < 0.5 ** (free - 1)


@pytest.mark.parametrize(
    ("degrees", "kind", "rings"),
    [(130, "clamped", False), (135, "clamped", True), (105, "free", False), (110, "free", True)],
)
def test_corners_that_quintics_resolve_get_no_rings(degrees, kind, rings):
    """Exponents of 2.96, 2.89, 2.54 and 2.48: what is left of the first and third is below 1e-6."""
    assert bool(corners.number_of_rings(exponent(degrees, (kind, kind)), (kind, kind))) == rings


@pytest.mark.slow
def test_hinged_edges_in_line_are_told():
    """At 179 degrees the exponent is next to one: no mesh resolves it, and no unit is to blame."""
    angle = np.radians(np.linspace(0.0, 179.0, 13))
    mesh = fi.mesh.polygon([(0.0, 0.0), *zip(0.2 * np.cos(angle), 0.2 * np.sin(angle))])
    body = fi.assemble(mesh, fi.Plate(STEEL, 2e-3), {"boundary": "hinged"})
    modes = fi.find_modes(body, n_modes=1)
    assert any("corners leave the frequencies uncertain by 77 %" in note for note in modes.notes)
    with pytest.raises(fi.SimulationError, match="no tolerance is, as corners hold that error on any mesh"):
        fi.find_modes(body, n_modes=1, tolerance=1e-2)


@pytest.mark.slow
def test_hinged_sides_of_a_circle_of_points_lead_to_its_curve():
    points = 0.2 * np.exp(2j * np.pi * np.arange(30) / 30)[:, None].view(float)
    sides, curve = (
        fi.assemble(shape(points), fi.Plate(STEEL, 2e-3), {"boundary": "hinged"})
        for shape in (fi.mesh.polygon, fi.mesh.outline)
    )
    with pytest.raises(fi.SimulationError, match=r"fewer modes; 30 corners turn .* fi\.mesh\.outline joins them"):
        fi.find_modes(sides, n_modes=1, tolerance=1e-2)
    assert fi.find_modes(curve, n_modes=1, tolerance=1e-2).omega[0] > 0.0


def sector(degrees):
    """Unit sector with edges side0, arc and side1."""
    angle, origin = np.radians(degrees), np.zeros(2)
    arc = Arc(origin, np.array([1.0, 0.0]), np.array([0.0, 1.0]), 0.0, angle, "arc")
    tip = (np.cos(angle), np.sin(angle))
    return fill(Outline.around((segment(origin, (1.0, 0.0), "side0"), arc, segment(tip, origin, "side1"))))


def sector_waves(degrees, nu, edge):
    """The eight lowest wavenumbers of a unit sector with hinged sides: sin(v angle) times Bessel functions of order v.

    Below order one J alone has infinite energy at the corner; J less I, of both signs of the order, has not.
    """
    found = []
    for v in np.arange(1, 9) * 180.0 / degrees:
        parts = [lambda x, d, v=v: jvp(v, x, d), lambda x, d, v=v: ivp(v, x, d)]
        if v < 1.0:
            parts = [lambda x, d, s=s: jvp(s, x, d) - ivp(s, x, d) for s in (v, -v)]

        def rows(part, x, v=v):
            w, slope, second, third = (part(x, d) for d in range(4))
            if edge == "clamped":
                return w, slope
            lap = third + second / x - slope / x**2 - v * v * (slope / x**2 - 2.0 * w / x**3)
            turned = (1.0 - nu) * v * v * (slope / x**2 - w / x**3)
            return second + nu * (slope / x - v * v * w / x**2), lap - turned

        def excess(x, rows=rows, parts=parts):
            (a, b), (c, d) = (rows(part, x) for part in parts)
            return a * d - b * c

        x = np.linspace(0.2, 12.0, 600)
        y = np.array([excess(each) for each in x])
        found += [brentq(excess, x[i], x[i + 1], xtol=1e-13) for i in np.flatnonzero(y[1:] * y[:-1] < 0.0)]
    return np.sort(found)[:8]


@pytest.mark.parametrize("edge", ["clamped", "free"])
@pytest.mark.parametrize("degrees", [150.0, 179.0, 350.0])
def test_modes_of_a_sector_err_by_less_than_they_claim(degrees, edge):
    """And only those that swing at its corner claim much.

    Of 350 degrees and a free arc mode 1 is 63 % off, of which 27 % were claimed, and as much of all other modes.
    """
    supports = {"side0": "hinged", "side1": "hinged", "arc": edge}
    system = fi.assemble(sector(degrees), fi.Plate(STEEL, 3e-3), supports)
    modes = fi.find_modes(system, n_modes=5)
    stiffness = STEEL.plane_stress[0, 0] * 3e-3**3 / 12.0
    true = sector_waves(degrees, 0.3, edge)[:5] ** 2 * np.sqrt(stiffness / (7850.0 * 3e-3))
    assert (np.abs(modes.omega / true - 1.0) < modes.frequency_error).all()
    assert modes.frequency_error[1:3].max() < 1e-4  # the second and third pass the corner by


@pytest.mark.parametrize("ends", [("clamped", "free"), ("hinged", "hinged")])
def test_corners_filled_by_one_triangle_state_what_they_miss(ends):
    wood = fi.Material.orthotropic(E_along=10e9, E_across=0.5e9, nu=0.3, G=0.6e9, rho=400.0)
    mesh = fi.mesh.polygon([(0.0, 0.0), (0.3, 0.0), (0.3, 0.3 * np.tan(np.radians(40.0)))])
    system = fi.assemble(mesh, fi.Plate(wood, 1e-3), dict(zip(("edge0", "edge2"), ends)))
    corner = int(np.linalg.norm(mesh.points, axis=1).argmin())
    assert (system.space.vertices == corner).any(axis=1).sum() == 1
    assert corner in system.corners
    modes = fi.find_modes(system, n_modes=3)
    finer = fi.find_modes(fi.assemble(mesh.refined(2.5), fi.Plate(wood, 1e-3), system.supports), n_modes=3)
    assert (np.abs(modes.omega / finer.omega - 1.0) < modes.frequency_error + finer.frequency_error).all()
