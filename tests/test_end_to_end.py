"""The whole path on the source's scene: FE plate and FE stick against closed formulas, rigid limits."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.modes import analytic

AT = (0.3 * 1.55, 0.3)
SOFT = fi.Contact.hertz(695e3)  # N/m**1.5, the source's marked case
PLATE = fi.Plate(fi.Material(E=1e9, nu=0.3, rho=1e3), thickness=1e-3)  # any: the modes are scaled


def fe_plate(size, n_modes=60, mass=0.2):
    system = fi.assemble(fi.mesh.rectangle(1.55, 1.0, size=size), PLATE, supports={"boundary": "hinged"})
    return fi.find_modes(system, n_modes=n_modes).scaled(mass=mass, first_frequency=100.0)


def closed_plate(n_modes=60, mass=0.2):
    return analytic.rectangle(1.55, 1.0, mass=mass, first_frequency=100.0, n_modes=n_modes)


def closed_stick(n_modes=9):
    modes = analytic.beam(1.0, ends=("hinged", "free"), mass=0.1, first_frequency=10e3, n_modes=n_modes)
    return fi.Striker.flexible(modes, at=1.0)


def blow(plate, stick, contact, **options):
    """A strike at 1 m/s with steps of 5 us, so that only the modes differ between two calls."""
    return fi.strike(plate, stick, contact, at=AT, speed=1.0, dt=5e-6, **options)


def force_difference(one, other):
    """Largest difference of two force histories over the peak."""
    time = np.linspace(0.0, max(one.history.end_time, other.history.end_time), 4000)
    forces = [np.interp(time, hit.time, hit.force, right=0.0) for hit in (one, other)]
    return np.abs(forces[0] - forces[1]).max() / forces[0].max()


# Frequencies agree to 3e-6, those of the stick's 8th mode to 3e-4; seven impacts magnify that (2.7e-4 measured).
@pytest.mark.parametrize(
    "contact, tolerance", [(SOFT, 1e-6), (fi.Contact.linear(88.6e3), 1e-5), (fi.Contact.linear(1e6), 1e-3)], ids=str
)
def test_finite_elements_agree_with_closed_formulas(contact, tolerance):
    fe = blow(fe_plate(0.08), fi.Striker.stick(0.1, 10e3), contact)
    exact = blow(closed_plate(), closed_stick(), contact)
    assert fe.n_impacts == exact.n_impacts
    assert force_difference(fe, exact) < tolerance
    for name in ("contact_time", "peak_force", "impulse", "restitution"):
        assert_allclose(getattr(fe, name), getattr(exact, name), rtol=tolerance)
    for ours, theirs in zip(fe.impacts, exact.impacts):
        assert_allclose([ours.start, ours.end], [theirs.start, theirs.end], atol=1e-9, rtol=tolerance)
        assert_allclose(ours.impulse, theirs.impulse, rtol=10.0 * tolerance)  # of a small later impact


def test_the_difference_falls_with_the_mesh_at_the_order_of_the_frequencies():
    exact = blow(closed_plate(20), closed_stick(), SOFT, residual=False)
    sizes = [0.25, 0.2, 0.125]
    errors = [force_difference(blow(fe_plate(size, 20), closed_stick(), SOFT, residual=False), exact) for size in sizes]
    order = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert order > 5.5  # quintic elements: 8 in frequency, 6 in the shapes' values; 6 ... 8 measured
    assert errors[-1] < 1e-5


def test_heavy_plate_and_rigid_mass_give_the_closed_forms():
    felt, plate = 0.1 / 3.0, closed_plate(mass=500e3)
    linear = fi.strike(plate, fi.Striker.rigid(felt), fi.Contact.linear(88.6e3), at=AT, speed=1.0, tolerance=1e-7)
    # 500 t instead of a wall moves the results by the mass ratio times some modes' share: 1e-6.
    assert_allclose(linear.contact_time, np.pi * np.sqrt(felt / 88.6e3), rtol=2e-6)
    assert_allclose(linear.peak_force, np.sqrt(felt * 88.6e3), rtol=2e-6)
    hertz = fi.strike(plate, fi.Striker.rigid(felt), SOFT, at=AT, speed=1.0, tolerance=1e-7)
    assert_allclose(hertz.contact_time, 3.2180654597 * (felt**2 / 695e3**2) ** 0.2, rtol=2e-6)
    assert_allclose(hertz.peak_force, 1.1432626298 * 695e3**0.4 * felt**0.6, rtol=2e-6)
    assert_allclose([linear.restitution, hertz.restitution], 1.0, atol=2e-5)


def test_a_free_striker_arrives_straight_and_a_hinged_one_turning():
    bar = analytic.beam(0.3, ends=("free", "free"), mass=0.05, first_frequency=900.0, n_modes=8)
    for at in (0.0, 0.11):
        hit = fi.strike(closed_plate(), fi.Striker.flexible(bar, at=at), SOFT, at=AT, speed=2.0, max_impacts=1)
        before = hit.velocity(np.linspace(0.0, 0.3, 5), [0.0], body=0)[0]
        assert_allclose(before, 2.0, rtol=1e-12)  # every point of it moves at the speed given
    hit = fi.strike(closed_plate(), closed_stick(), SOFT, at=AT, speed=2.0, max_impacts=1)
    before = hit.velocity(np.linspace(0.0, 1.0, 5), [0.0], body=0)[0]
    assert_allclose(before, 2.0 * np.linspace(0.0, 1.0, 5), atol=1e-12)  # about the hinge at x = 0
