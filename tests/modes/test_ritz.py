"""Ritz vectors started from loads: complete where the loads act, as the closed forms say, and nested."""

import numpy as np
import pytest

import fem_impact as fi
from fem_impact.fe.shallow import plane_mass
from fem_impact.modes.ritz import Krylov

SPRUCE = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
AT = np.array([[0.12, 0.1]])  # m


@pytest.fixture(scope="module")
def rectangle():
    return fi.assemble(fi.mesh.rectangle(0.465, 0.3, size=0.03), SPRUCE, {"boundary": "hinged"}, near=AT)


@pytest.fixture(scope="module")
def krylov(rectangle):
    made = Krylov(rectangle, AT, 3e4)
    made.grow(500)
    return made


def exact(**how):
    return fi.analytic.closed_form(fi.mesh.rectangle(0.465, 0.3), SPRUCE, {"boundary": "hinged"})(**how)


def test_static_compliance_is_that_of_the_body(rectangle):
    seen = fi.ritz_modes(rectangle, AT, max_frequency=5e3, n_vectors=20)
    true = exact(n_modes=1).shapes.compliance(AT)[0, 0]
    # the elements under the load miss 1e-6 of the compliance, see splitting.DEPTH
    assert seen.modal_compliance(AT)[0, 0] == pytest.approx(true, rel=3e-6)
    assert abs(seen.residual_compliance(AT)[0, 0]) < 1e-12 * true


def test_a_free_ring_struck_near_its_edge_keeps_its_rigid_motions():
    ring, at = fi.assemble(fi.mesh.disk(0.2, hole=0.05, size=0.04), SPRUCE, near=[(0.19, 0.0)]), [(0.19, 0.0)]
    seen = fi.ritz_modes(ring, at, max_frequency=5e3, n_vectors=30)
    assert seen.n_rigid == 3 and (seen.omega[:3] == 0.0).all()
    inertia = 0.25 * seen.mass * (0.2**2 + 0.05**2)  # about a diameter; quadrature of a polynomial is exact
    mobile = float((seen.shape_at(at)[0, :3] ** 2).sum())
    assert mobile == pytest.approx(1.0 / seen.mass + 0.19**2 / inertia, rel=1e-9)


def after_pulse(modes, length, times):
    """Displacement where a half-sine force of unit impulse and a length [s] acted, at times after it."""
    heard = np.cos(0.5 * modes.omega * length) / (1.0 - (modes.omega * length / np.pi) ** 2)
    return (modes.shape_at(AT)[0] ** 2 / modes.omega * heard) @ np.sin(np.outer(modes.omega, times - 0.5 * length))


def test_response_to_a_pulse_is_that_of_all_modes(rectangle):
    """Until 6 ms, against 4 000 closed-form modes: more vectors follow the echoes for longer."""
    length = 2e-4
    times = np.linspace(length, 6e-3, 400)
    true = after_pulse(exact(n_modes=4000), length, times)
    bodies = (fi.ritz_modes(rectangle, AT, max_frequency=5e3, n_vectors=n) for n in (20, 160))
    few, many = (np.abs(after_pulse(body, length, times) - true).max() / np.abs(true).max() for body in bodies)
    # with 20 vectors late echoes are wrong; the kinks of the half sine excite waves that 160 do not resolve
    assert few > 0.1 and many < 0.01


def test_first_vectors_of_more_are_those_of_fewer(rectangle, krylov):
    one, two = krylov.modes(25), Krylov(rectangle, AT, 3e4).modes(25)
    assert one.omega == pytest.approx(two.omega, rel=1e-9)
    assert np.abs(one.shape_at(AT)) == pytest.approx(np.abs(two.shape_at(AT)), rel=1e-7)
    assert one.poorer["truncation"].n_modes == 17


def test_excited_frequencies_are_found_from_above(rectangle):
    true, seen = exact(n_modes=40), fi.ritz_modes(rectangle, AT, max_frequency=2e3, n_vectors=60)
    heard = true.frequencies[np.abs(true.shape_at(AT)[0]) > 0.1 * true.mass**-0.5][:8]
    nearest = np.array([seen.frequencies[np.abs(seen.frequencies - f).argmin()] for f in heard])
    assert (nearest > heard * (1.0 - 1e-7)).all() and nearest == pytest.approx(heard, rel=1e-5)  # mesh: 1e-6


def test_mass_orthonormal_and_low_frequencies_keep_their_digits_however_many(rectangle, krylov):
    gram = krylov.vectors[:200] @ (rectangle.M @ krylov.vectors[:200].T)
    assert np.abs(gram - np.eye(200)).max() < 1e-9  # rounding, let grow to 2e-10 before it is removed
    # rounding; from the projected stiffness itself they would differ by 5e-9
    few, many = (krylov.modes(n).omega[:5] for n in (200, 500))
    assert many == pytest.approx(few, rel=1e-11)


@pytest.mark.slow
def test_a_thousand_vectors_stay_orthogonal():
    """Rounding may grow a millionfold in forty vectors; those made since the last look at all were kept, once."""
    aluminium = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), 4e-3)
    system = fi.assemble(fi.mesh.rectangle(0.6, 0.4, size=0.02), aluminium)
    krylov = Krylov(system, np.array([[0.02, 0.02]]), 2e4 * np.pi)
    krylov.grow(1000)
    vectors = krylov.vectors[: krylov.count]
    # overlaps are taken out above 1e-11 and grow between two looks, at most to the 1e-8 at which vectors are made again
    np.testing.assert_allclose(vectors @ (system.M @ vectors.T), np.eye(1000), atol=1e-8)


TWO = np.array([(0.12, 0.1), (0.3, 0.2)])


@pytest.mark.parametrize(("places", "count"), [(AT, 30), (TWO, 31), (TWO, 32)])  # a block of two vectors may be cut
def test_pairs_are_those_of_the_projected_stiffness(rectangle, places, count):
    krylov = Krylov(rectangle, places, 3e4)
    krylov.grow(40)
    basis = krylov.vectors[:count]
    value, turn = np.linalg.eigh(basis @ (rectangle.K @ basis.T))
    rate, modes = rectangle.frame.rate, krylov.modes(count)
    # rounding of the largest eigenvalue, 1e9 times the lowest, spoils the dense ones
    assert modes.omega == pytest.approx(np.sqrt(value) * rate, rel=1e-6)
    # squares do not depend on the sign of a pair
    rows = (krylov.loads.T @ basis.T) @ turn * rectangle.frame.mass**-0.5
    assert modes.shape_at(places) ** 2 == pytest.approx(rows**2, abs=1e-5 * np.square(rows).max())


def test_all_that_a_small_mesh_can_reach():
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3, size=0.3), SPRUCE, {"boundary": "hinged"})
    seen = fi.ritz_modes(system, [(0.2, 0.15)], max_frequency=5e3, n_vectors=5000)
    assert seen.n_modes <= system.n_dofs and not seen.poorer  # nothing is left out, so nothing is in doubt


def test_same_load_twice_is_one(rectangle):
    krylov = Krylov(rectangle, np.vstack([AT, AT]), 3e4)
    modes = krylov.modes(40)
    rows = modes.shape_at(np.vstack([AT, AT]))
    assert np.array_equal(rows[0], rows[1]) and modes.n_modes == 40


def test_two_contacts_on_one_plate(rectangle):
    """A ball strikes a plate just above a spring elsewhere: the same by vectors of both points as by modes."""
    system = fi.assemble(fi.mesh.rectangle(0.465, 0.3, size=0.03), SPRUCE, {"boundary": "hinged"}, near=TWO)
    bodies = (fi.ritz_modes(system, TWO, max_frequency=1e4, n_vectors=300), exact(n_modes=1000))
    touches = [
        fi.Touch(fi.Contact.hertz(1e7), 0, 1, None, tuple(TWO[0])),
        fi.Touch(fi.Contact.linear(2e4, gap=1e-6), 1, None, tuple(TWO[1]), None),  # without a gap it chatters
    ]
    blow = {"speeds": [1.0, 0.0], "tolerance": 1e-3, "duration": 2e-3}
    one, two = (fi.collide([fi.Modes.rigid(0.01), body], touches, **blow) for body in bodies)
    for name in ("peak_force", "impulse", "contact_time"):  # both claims together
        assert getattr(one, name) == pytest.approx(getattr(two, name), rel=1e-3 + float(one.error))


def test_scaled_damped_and_truncated_with_their_doubts(rectangle):
    seen = fi.ritz_modes(rectangle, AT, max_frequency=5e3, n_vectors=50)
    other = seen.scaled(mass=2.0 * seen.mass).damped(0.01).truncated(max_frequency=3e3)
    less = other.poorer["truncation"]
    assert less.mass == other.mass == 2.0 * seen.mass
    assert (less.damping_ratio == 0.01).all() and less.frequencies[-1] <= 3e3
    whole = seen.modal_compliance(AT) / 2.0  # at the same frequencies a body twice as heavy is twice as stiff
    assert other.shapes.compliance(AT) == pytest.approx(whole) and other.residual_compliance(AT)[0, 0] > 0.0


def test_points_that_cannot_move_are_refused(rectangle):
    for place, said in (((1.0, 1.0), "points must lie on the body"), ((0.0, 0.1), "points must not lie on a support")):
        with pytest.raises(ValueError, match=said):
            fi.ritz_modes(rectangle, [place], max_frequency=5e3)


def test_motion_elsewhere_follows_the_modes(rectangle):
    """Shapes away from the load: the deflection at another point during a blow agrees with that of the modes."""
    ball, law, times = fi.Striker.rigid(0.01), fi.Contact.hertz(1e7), np.linspace(0.0, 2e-3, 50)
    bodies = fi.ritz_modes(rectangle, AT, max_frequency=1e4, n_vectors=200), exact(n_modes=1500)
    hits = (fi.strike(body, ball, law, at=AT[0], speed=1.0) for body in bodies)
    first, second = (hit.displacement(TWO[1:], times)[:, 0] for hit in hits)
    assert first == pytest.approx(second, abs=0.01 * np.abs(second).max())  # measured 1e-3


@pytest.mark.parametrize("stiffness", [1e-3, 1.0])
def test_weak_springs_leave_bending_to_the_vectors(stiffness):
    """Beside the deflection on such springs, that of bending is a billionth; a blow feels bending alone."""
    steel = fi.Plate(fi.Material(E=210e9, nu=0.3, rho=7850.0), 0.02)
    feet = [((x, y), stiffness) for x in (0.0, 0.3) for y in (0.0, 0.3)]
    found = []
    for posts in (feet, []):
        system = fi.assemble(fi.mesh.rectangle(0.3, 0.3), steel, {}, near=[(0.1, 0.12)], point_supports=posts)
        modes = fi.ritz_modes(system, [(0.1, 0.12)], max_frequency=5e3, n_vectors=60)
        found.append(modes.omega[modes.omega > 100.0][:8])
    assert found[0] == pytest.approx(found[1], rel=1e-5)
    assert modes.n_rigid == 3


@pytest.mark.parametrize("supports", [{"boundary": "hinged"}, {}])
def test_vectors_of_a_ribbed_plate_end_at_the_modes_with_its_mass_in_the_plane(supports):
    """Projected onto vectors made without that mass, frequencies still fell by 1e-4 between 220 and 400 of them."""
    bar = fi.Beam.rectangular(fi.Material(E=10e9, nu=0.3, rho=450.0), width=5e-3, height=15e-3)
    mesh, rib = fi.mesh.rectangle(0.465, 0.3, size=0.15), fi.Rib([(0.05, 0.2), (0.4, 0.1)], bar)
    system = fi.assemble(mesh, SPRUCE, supports, near=AT, ribs=[rib])
    grown, true = Krylov(system, AT, 3e4), fi.find_modes(system, n_modes=30)
    few, many = (grown.pairs(count).omega[:30] for count in (220, 400))
    assert few == pytest.approx(many, rel=1e-8)
    assert many == pytest.approx(true.omega, rel=1e-6)  # 1e-3 at the 23rd if modes had it in their own space only
    vectors = grown.vectors[:400]
    np.testing.assert_allclose(vectors @ (system.M @ vectors.T + plane_mass(system, vectors.T)), np.eye(400), atol=1e-8)
