"""Air around plates: Wallace's rectangles and a drumhead by independent integrals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import QUICK, load_text
from scipy import integrate, special

import fem_impact as fi
from fem_impact.modes import air

RHO, C = air.DENSITY, air.SPEED


def membrane_in_air(order, number, radius, weight, tension, sides=2):
    """First frequencies [rad/s] and damping of the modes (order, 1...) of a baffled membrane, by Hankel transforms.

    Christian et al. (1984), eq. 10 on: the Rayleigh integral in wave numbers, where the shapes are Bessel functions.
    """
    zero = special.jn_zeros(order, number)
    alone = zero / radius * np.sqrt(tension / weight)
    turn = 2.0 * np.pi if order == 0 else np.pi
    norm = (weight * turn * 0.5 * (radius * special.jv(order + 1, zero)) ** 2) ** -0.5

    def transform(j, kappa):
        b = zero[j] / radius
        edge = norm[j] * radius * b * special.jv(order + 1, zero[j])
        return edge * special.jv(order, kappa * radius) / (b**2 - kappa**2)

    def integrals(k):
        # the kernel exp(-i k R) / R is 2 pi / sqrt(kappa**2 - k**2) in wave numbers
        u = np.linspace(0.0, 40.0 * zero[-1] / radius, 6001) + 1e-9
        kappa = np.sqrt(k**2 + u**2)
        outer = np.array([transform(j, kappa) for j in range(number)])
        angle = (np.arange(2000) + 0.5) / 2000 * 0.5 * np.pi
        inner = np.array([transform(j, k * np.sin(angle)) for j in range(number)])
        near = k * np.sin(angle) * 0.5 * np.pi / 2000
        mass = np.array([[integrate.simpson(a * b, x=u) for a in outer] for b in outer])
        return 2.0 * np.pi * turn * mass, 2.0 * np.pi * turn * (inner * near) @ inner.T

    found = []
    for j in range(number):
        omega = alone[j]
        for _ in range(4):
            added, lost = (sides * RHO / (2.0 * np.pi) * x for x in integrals(omega / C))
            value, vector = air.eigh(np.diag(alone**2), np.eye(number) + added)
            omega, q = np.sqrt(value[j]), vector[:, j]
        found.append((omega, omega * (q @ lost @ q) / (2.0 * omega)))
    return np.array(found).T


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.slow
@pytest.mark.thin(3)
def test_drumhead(order):
    """A kettledrum's head of Mylar in a wall: the air halves the lowest frequency."""
    radius, weight, tension = 0.328, 0.262, 3990.0
    head = fi.Plate(fi.Material(E=5e9, nu=0.3, rho=weight / 1.9e-4), thickness=1.9e-4, tension=tension)
    modes = fi.find_modes(fi.assemble(fi.mesh.disk(radius), head, {"outer": "hinged"}), n_modes=30)
    loaded = fi.in_air(modes)
    true, damping = membrane_in_air(order, 4, radius, weight, tension)
    assert loaded.n_modes == 30 and (np.diff(loaded.omega) >= 0.0).all()
    for omega, ratio in zip(true[:2], damping[:2]):
        near = np.abs(loaded.omega / omega - 1.0).argmin()
        assert loaded.omega[near] == pytest.approx(omega, rel=1.5 * loaded.frequency_error[near])
        assert loaded.omega[near] == pytest.approx(omega, rel=5e-3)  # the air mass is up to twice the head's
        assert loaded.damping_ratio[near] == pytest.approx(ratio, rel=0.1)
    assert loaded.omega[0] < 0.7 * modes.omega[0]


@pytest.fixture(scope="module")
def plate():
    return fi.analytic.rectangle(0.5, 0.3, mass=0.2, first_frequency=100.0, n_modes=20, damping_ratio=0.01)


@pytest.fixture(scope="module")
def loud(plate):
    return fi.in_air(plate)


@pytest.fixture(scope="module")
def open_air(plate):
    return fi.in_air(plate, baffled=False)


def test_plate_keeps_its_static_deflection_and_order(plate, loud):
    """Still air carries no load; all that it does is to add inertia and to carry sound away."""
    at = [(0.1, 0.1)]
    assert loud.modal_compliance(at) == pytest.approx(plate.modal_compliance(at), rel=1e-10)
    assert (loud.omega < plate.omega).all() and (np.diff(loud.omega) > 0.0).all()
    assert (loud.damping_ratio > 0.01).all() and loud.mass == plate.mass


def test_low_modes_radiate_as_wallace_says(plate):
    """Below ka = 1 the (1, 1) mode radiates like a monopole: Wallace's eq. 15 for one side of a baffled rectangle."""
    a, b = 0.5, 0.3
    omega = 0.3 * C / a
    slow = plate.scaled(first_frequency=omega / (2.0 * np.pi))
    ka, kb = omega / C * a, omega / C * b
    sigma = 32.0 * ka * kb / np.pi**5 * (1.0 - ka * kb / 12.0 * ((1.0 - 8.0 / np.pi**2) * (a / b + b / a)))
    loud = fi.in_air(
        slow.truncated(n_modes=1).damped(0.0), density=1e-3, sides=1
    )  # so thin that the shift does not matter
    found = loud.damping_ratio[0] * 2.0 * loud.omega[0] * slow.mass / (1e-3 * C * a * b)
    assert found == pytest.approx(sigma, rel=0.02)  # Wallace's series has an error of (ka)**4


def test_modes_that_outrun_sound_are_damped_as_sums_over_wave_numbers_say():
    """They are not solved for on a grid, which takes minutes beyond some hundred; Rayleigh's integral of every mode."""
    a, b, mass = 0.3, 0.21, 0.6
    plate = fi.analytic.rectangle(a, b, mass=mass, first_frequency=300.0, n_modes=160)
    loud = fi.in_air(plate)
    m, n = (x.ravel() for x in np.meshgrid(np.arange(1, 40), np.arange(1, 40), indexing="ij"))
    order = np.argsort((m / a) ** 2 + (n / b) ** 2)[:160]
    theta, turn = np.polynomial.legendre.leggauss(150), 2.0 * np.pi * (np.arange(600) + 0.5) / 600
    sine = np.sin(0.25 * np.pi * (theta[0] + 1.0))
    solid = 0.25 * np.pi * (theta[1] * sine)[:, None] * np.full(600, 2.0 * np.pi / 600)
    fast = np.arange(70, 160, 8)
    for i in fast:
        k, square = plate.omega[i] / C, 4.0 / mass
        for number, side, along in ((m[order[i]], a, np.cos(turn)), (n[order[i]], b, np.sin(turn))):
            own, kappa = number * np.pi / side, k * np.outer(sine, along)
            square = (
                square * np.abs(own * (1.0 - (-1.0) ** number * np.exp(-1j * kappa * side)) / (own**2 - kappa**2)) ** 2
            )
        damping = 2.0 * RHO * k * (square * solid).sum() / (8.0 * np.pi**2)
        assert abs(loud.damping_ratio[i] - damping) < loud.damping_error[i] < 0.3 * damping
    assert (abs(loud.omega[fast] / plate.omega[fast] - 1.0) <= loud.frequency_error[fast]).all()


def test_thin_air_changes_nothing_and_one_side_does_half(plate):
    assert fi.in_air(plate, density=1e-9).omega == pytest.approx(plate.omega, rel=1e-8)
    one, two = (1.0 - (fi.in_air(plate, density=0.01, sides=n).omega / plate.omega) ** 2 for n in (1, 2))
    assert two == pytest.approx(2.0 * one, rel=1e-2)  # to first order in the density


def test_air_may_be_as_thin_as_none():
    """Masses below rounding left bands without a width to the modes of a second block."""
    plate = fi.analytic.rectangle(0.3, 0.2, mass=0.486, first_frequency=260.0, n_modes=60)
    thin = fi.in_air(plate, density=1e-15)
    assert np.isfinite(thin.damping_error).all() and thin.omega == pytest.approx(plate.omega, rel=1e-12)


def test_pairs_at_one_frequency_are_damped_as_surely_as_others():
    """Both modes of a pair came out as one where they shared the frequency to rounding: errors of 50 to 200 %."""
    disk = fi.analytic.disk(0.2, edge="clamped", mass=0.34, first_frequency=63.3, n_modes=5)
    loud = fi.in_air(disk)
    assert disk.omega[1] == disk.omega[2] and (loud.damping_error < 0.03 * loud.damping_ratio).all()
    assert_allclose(loud.damping_ratio[1], loud.damping_ratio[2], rtol=1e-3)


def test_without_a_wall_the_shift_is_bounded(plate, loud, open_air):
    low, high = (open_air.omega * (1.0 + side * open_air.frequency_error) for side in (-1.0, 1.0))
    assert (high >= plate.omega * (1.0 - 1e-3)).all() and (low <= loud.omega * 1.001).all()


def test_the_error_of_damping_is_that_of_air_alone_and_follows_the_modes(plate, loud, open_air):
    assert plate.damping_error is None and loud.damped(0.01).damping_error is None
    assert (loud.damping_error > 0.0).all() and loud.damping_error[0] < 0.1 * (loud.damping_ratio[0] - 0.01)
    assert_allclose(loud.truncated(n_modes=5).damping_error, loud.damping_error[:5])
    # without a wall no sound is counted, though with one it would be as much as the error says
    assert_allclose(open_air.damping_ratio, 0.01)
    assert (open_air.damping_error > 0.8 * (loud.damping_ratio - 0.01)).all()


@pytest.mark.parametrize(("edge", "thick", "number", "frequency", "damping_ratio"), [
    ("free", 2e-3, 10, 262.78, 1.06e-5),  # in a wall it radiates a twentieth of that
    ("clamped", 6e-3, 0, 469.90, 3.37e-3),  # and this one was said to be known to half as much
])  # fmt: skip
def test_without_a_wall_a_vortex_lattice_lies_within_the_errors(edge, thick, number, frequency, damping_ratio):
    """Aluminium, 0.4 m by 0.3 m: rings of constant jumps in 14 and 20 rows, extrapolated, with retardation."""
    plate = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), thick)
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3), plate, {"boundary": edge})
    loud = fi.in_air(fi.find_modes(system, n_modes=number + 1), density=1.204, speed=343.2, baffled=False)
    assert abs(loud.frequencies[number] - frequency) < frequency * loud.frequency_error[number]
    assert damping_ratio < loud.damping_error[number] < 2.0 * damping_ratio and loud.damping_ratio[number] == 0.0


def test_without_a_wall_boundary_elements_of_a_flat_box_lie_within_the_errors():
    """Spruce, 0.4 m by 0.3 m, free, on a box 0.05 m high: constant jumps and pressures on 22 panels along its side.

    In a wall this mode is silent, and it was said to be damped by a half of this at most.
    """
    plate = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), 3e-3)
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(0.4, 0.3), plate, {}), n_modes=6)
    loud = fi.in_air(modes, density=1.204, speed=343.2, sides=1, baffled=False)
    assert abs(loud.frequencies[5] / modes.frequencies[5] - 1.0335**-0.5) < loud.frequency_error[5] < 0.01
    assert 2.28e-5 < loud.damping_error[5] < 2.0 * 2.28e-5


def test_a_free_plate_moves_no_volume():
    """Its modes bear no force and no moment; with 24 cells across a lattice alone moves 1e-3 of what they sweep."""
    plate = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), thickness=1e-3)
    modes = fi.find_modes(fi.assemble(fi.mesh.disk(0.1), plate), n_modes=9)
    points, sizes = modes.shapes.quadrature(100.0)
    whole = points, sizes, modes.shapes.at(points)
    samples = air._sampled(modes.shapes, 0.2 / 48, whole)[0][modes.n_rigid :]
    x = np.arange(samples.shape[1]) - 0.5 * samples.shape[1]
    for moved in (samples, samples * x[:, None]):
        assert (np.abs(moved.sum(axis=(1, 2))) < 1e-6 * np.abs(moved).sum(axis=(1, 2))).all()  # that of the elements


def test_free_plate_keeps_its_rigid_motions():
    aluminium = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), thickness=1e-3)
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(0.3, 0.2), aluminium, {}), n_modes=8)
    loud = fi.in_air(modes)
    assert loud.n_rigid == 3 and loud.rigid_motion((0.1, 0.1)) == pytest.approx(modes.rigid_motion((0.1, 0.1)))
    assert (loud.frequencies[3:] < modes.frequencies[3:]).all()
    hit = fi.strike(loud, fi.Striker.rigid(0.01), fi.Contact.linear(1e4), at=(0.1, 0.1), speed=1.0, tolerance=1e-2)
    assert hit.energy_error < 1e-10


def test_scene_in_air(tmp_path):
    # so short a blow that modes far from a block are mixed into it to first order
    given = QUICK.replace('source = "analytic"', 'source = "fe"').replace("mass = 0.03", "mass = 0.01")
    given = given.replace("stiffness = 1e4", "stiffness = 1e5")
    light, heavy = (
        load_text(tmp_path, given.replace("[target]", f"[target]{air}")) for air in ("", '\nair = "both sides"')
    )
    assert heavy.modes(20).omega == pytest.approx(fi.in_air(light.modes(20)).omega, rel=1e-6)
    assert heavy.plan().target == "modal" and any("air" in note for note in heavy.strike().notes)


def test_air_on_too_fine_a_grid_is_refused_by_the_name_of_its_speed_of_sound(plate):
    with pytest.raises(ValueError, match=r"^speed of sound in the air must be higher or modes fewer, got 0\.01 m/s: "):
        fi.in_air(plate, speed=0.01)
