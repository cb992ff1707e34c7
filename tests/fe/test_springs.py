"""Springs, point masses, tension, grain and varying sections against closed forms."""

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from fem_impact import mesh
from fem_impact.fe.assembly import assemble
from fem_impact.fe.section import Beam, Elastic, Material, Plate
from fem_impact.modes.finding import find_modes

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
PLATE = Plate(STEEL, 2e-3)
D = 210e9 * 2e-3**3 / (12 * (1 - 0.3**2))
PER_AREA = 7850 * 2e-3
BAR = Beam.rectangular(STEEL, width=0.02, height=0.01)
EI, PER_LENGTH = 210e9 * 0.02 * 0.01**3 / 12, 7850 * 0.02 * 0.01


def test_tension_stiffens_a_hinged_plate_as_the_closed_form_says():
    tension, pulled = 5e3, Plate(STEEL, 2e-3, tension=5e3)
    modes = find_modes(assemble(mesh.rectangle(1.55, 1.0), pulled, {"boundary": "hinged"}), n_modes=4)
    wave2 = np.pi**2 * np.array([1 + 1 / 1.55**2, 1 + 4 / 1.55**2, 1 + 9 / 1.55**2, 4 + 1 / 1.55**2])
    exact = np.sqrt((D * wave2**2 + tension * wave2) / PER_AREA)
    assert_allclose(modes.omega, np.sort(exact), rtol=1e-5)  # promised by `Theory.wave`


def test_a_drumhead_is_a_membrane():
    thin = Plate(Material(E=4e9, nu=0.35, rho=1400.0), 2e-4, tension=4e3)
    modes = find_modes(assemble(mesh.disk(0.18), thin, {"boundary": "hinged"}), n_modes=1)
    assert_allclose(modes.omega[0], 1596.92625, rtol=3e-5)  # root of the hinged disk under tension, J0 and I0
    wave = 2.404825557695773 / 0.18
    assert_allclose(modes.omega[0], wave * np.sqrt(4e3 / (1400 * 2e-4)), rtol=1e-4)  # bending adds D k^2 / 2 T = 7e-5


def test_orthotropic_hinged_plate_meets_its_closed_form():
    """With the grain along either side."""
    h, a, b = 3e-3, 0.5, 0.36
    inner = 1 - 0.35**2 * 0.8 / 11
    D1, D2, D12, D66 = 11e9 / inner, 0.8e9 / inner, 0.35 * 0.8e9 / inner, 0.75e9
    m, n = np.meshgrid(np.arange(1, 9), np.arange(1, 9))
    kx, ky = m * np.pi / a, n * np.pi / b
    stiff = h**3 / 12 * (D1 * kx**4 + 2 * (D12 + 2 * D66) * kx**2 * ky**2 + D2 * ky**4)
    exact = np.sort(np.sqrt(stiff / (430 * h)).ravel())[:10]
    for angle, sides in ((0.0, (a, b)), (np.pi / 2, (b, a))):
        wood = Material.orthotropic(E_along=11e9, E_across=0.8e9, nu=0.35, G=0.75e9, rho=430.0, angle=angle)
        system = assemble(mesh.rectangle(*sides), Plate(wood, h), {"boundary": "hinged"})
        assert_allclose(find_modes(system, n_modes=10, tolerance=1e-6).omega, exact, rtol=1e-6)


def test_a_strip_without_contraction_is_a_beam_of_the_same_varying_height():
    loose, height = Material(E=210e9, nu=0.0, rho=7850.0), lambda x: 0.01 * (1.0 - 0.5 * x[:, 0])
    bodies = (mesh.rectangle(1.0, 0.05), Plate(loose, height)), (
        mesh.line(1.0, size=0.01), Beam.rectangular(loose, width=0.05, height=height))  # fmt: skip
    plate, beam = (find_modes(assemble(*body, {"left": "clamped"}), n_modes=2) for body in bodies)
    assert_allclose(plate.omega, beam.omega, rtol=1e-5)  # the beam errs by 7e-4 (kh)**4 = 1e-8, the strip by 1e-6


def test_cantilever_with_a_tip_mass():
    share = 0.7

    def condition(x):
        c, s, C, S = np.cos(x), np.sin(x), np.cosh(x), np.sinh(x)
        return 1 + c * C + share * x * (c * S - s * C)

    exact = np.array([brentq(condition, 0.5, 1.8), brentq(condition, 3.5, 4.6)])
    mass = share * PER_LENGTH
    modes = find_modes(assemble(mesh.line(1.0), BAR, {"left": "clamped"}, point_masses=[(1.0, mass)]), n_modes=2)
    assert_allclose(modes.omega, exact**2 * np.sqrt(EI / PER_LENGTH), rtol=1e-6)
    assert_allclose(modes.mass, PER_LENGTH + mass, rtol=1e-12)


def test_a_heavy_mass_swings_on_the_static_compliance_of_the_plate():
    at, mass = (0.5, 0.4), 1e4
    bare, laden = (
        find_modes(assemble(mesh.rectangle(1.0, 0.8), PLATE, {"boundary": "hinged"}, point_masses=masses), n_modes=1)
        for masses in ([], [(at, mass)])
    )
    compliance = bare.shapes.compliance(np.array([at]))[0, 0]
    # Dunkerley: the plate's own mass adds about m_plate / mass, 1e-3; the mesh about 3e-3 under a point
    assert_allclose(laden.omega[0], (mass * compliance) ** -0.5, rtol=5e-3)


def test_a_free_plate_turns_about_its_common_centre_of_mass():
    system = assemble(mesh.rectangle(1.0, 1.0), PLATE, point_masses=[((0.9, 0.5), 5.0)])
    modes = find_modes(system, n_modes=4)
    x0 = (PER_AREA * 0.5 + 5.0 * 0.9) / (PER_AREA + 5.0)
    inertia_y = PER_AREA * (1 / 12 + (x0 - 0.5) ** 2) + 5.0 * (0.9 - x0) ** 2
    mobility = 1.0 / (PER_AREA + 5.0) + (0.2 - x0) ** 2 / inertia_y
    assert modes.n_rigid == 3
    assert_allclose((modes.shape_at([(0.2, 0.5)])[0, :3] ** 2).sum(), mobility, rtol=1e-9)


def test_stiff_springs_are_hinges_and_stiff_turning_springs_clamps():
    shape = mesh.rectangle(1.0, 1.0)
    hinged = find_modes(assemble(shape, PLATE, {"boundary": Elastic(1e12)}), n_modes=3)
    assert_allclose(hinged.omega * np.sqrt(PER_AREA / D), np.pi**2 * np.array([2, 5, 5]), rtol=1e-4)
    clamped = find_modes(assemble(shape, PLATE, {"boundary": Elastic(1e12, 1e9)}), n_modes=1)
    assert_allclose(clamped.omega * np.sqrt(PER_AREA / D), [35.9851911], rtol=1e-4)


@pytest.mark.parametrize("stiffness", [1e-4, 10.0])
def test_a_body_on_weak_springs_moves_as_a_rigid_one(stiffness):
    """Heave and tilt by Newton, far below bending; a spring that is hardly felt must not be lost in rounding."""
    a, thick = 0.3, Plate(STEEL, 0.02)
    feet = [((x, y), stiffness) for x in (0.0, a) for y in (0.0, a)]
    modes = find_modes(assemble(mesh.rectangle(a, a), thick, {}, point_supports=feet), n_modes=4)
    heave = np.sqrt(4.0 * stiffness / modes.mass)
    tilt = np.sqrt(3.0) * heave  # 4 k (a / 2)**2 over m a**2 / 12
    # a corner gives way by some 4e-8 of what a spring of 1 N/m does
    assert_allclose(modes.omega[:3], [heave, tilt, tilt], rtol=1e-8 + 3e-8 * stiffness)
    free = find_modes(assemble(mesh.rectangle(a, a), thick, {}), n_modes=4)
    assert modes.omega[3] == pytest.approx(free.omega[3], rel=1e-6) and modes.frequency_error.max() < 1e-6


def test_a_plate_and_a_beam_on_weak_springs_move_rigidly_first():
    shape, weak = mesh.rectangle(0.3, 0.3), 1e-6 * D / 0.3**3
    modes = find_modes(assemble(shape, PLATE, {"boundary": Elastic(weak)}), n_modes=4)
    heave = np.sqrt(4.0 * 0.3 * weak / modes.mass)
    tilt = heave * np.sqrt(2.0)  # k (2 a (a / 2)**2 + 2 a**3 / 12) over m a**2 / 12
    assert_allclose(modes.omega[:3], [heave, tilt, tilt], rtol=1e-6)

    # Hinged at the left, a spring k at the right: it turns rigidly, omega^2 = 3 k / m.
    modes = find_modes(assemble(mesh.line(1.0), BAR, {"left": "hinged", "right": Elastic(1e-3)}), n_modes=2)
    assert modes.omega[0] == pytest.approx(np.sqrt(3.0 * 1e-3 / modes.mass), rel=1e-6)
    assert modes.omega[1] == pytest.approx(3.9266023**2 * np.sqrt(EI / PER_LENGTH), rel=1e-6)


test_refuses_what_cannot_be_attached = refusing([
    ({}, {"point_masses": [((2.0, 0.5), 1.0)]}, r"must lie on the body, got \(2, 0.5\) m"),
    ({}, {"point_masses": [((0.2, 0.5), -1.0)]}, "mass of .* must be positive, got -1 kg"),
    ({}, {"point_masses": [0.2]}, r"must be a pair \(point in m, mass in kg\)"),
], lambda held, more: assemble(mesh.rectangle(1, 1), **{"section": PLATE} | more, supports=held))  # fmt: skip
