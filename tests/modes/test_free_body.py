"""Two bodies from elsewhere, and strikers that turn: against our own modes, closed forms and DOP853 in space."""

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import block_diag
from test_body import STEEL, body_of, free_bar
from tumblers import tumbler

import fem_impact as fi

LAW = fi.Contact.linear(1e6)
Z = (0.0, 0.0, 1.0)


def exported(modes, points, loads=()):
    """The body as another program knows it, with unit loads: it moves along z."""
    return body_of(modes, points, [(number, Z) for number in loads])


def numbers(hit):
    return np.array([hit.restitution, hit.contact_time, hit.impulse, hit.peak_force])


def test_two_bars_from_elsewhere_collide_as_our_own():
    """With unit loads exactly; without, within the stated error, to which both sides add theirs."""
    (own, points), how = free_bar(20), {"speed": 1.0, "tolerance": 1e-2}
    truth = fi.strike(own, fi.Striker.flexible(own, at=points[0]), LAW, at=points[10], **how)
    bodies = {known: exported(own, points, [1, 11] if known else []) for known in (True, False)}
    left_out = {}
    for one, other in [(True, True), (False, True), (True, False), (False, False)]:
        striker, target = fi.Striker.of(bodies[one], 1, direction="z"), bodies[other]
        hit = fi.strike(target.modes("z"), striker, LAW, at=target.at(11), **how)
        for name, known in (("striker", one), ("target", other)):
            assert (f"not stated of the {name}: static compliance" in hit.verdict) is not known
        if one and other:
            assert_allclose(numbers(hit), numbers(truth), rtol=1e-9)  # the same numbers, read at nodes
        apart = np.abs(numbers(hit) - numbers(truth)) / np.append(1.0, numbers(truth)[1:])
        assert apart.max() <= hit.error.total + truth.error.total
        left_out[one, other] = hit.error.truncation
    of_both = left_out[False, False] - left_out[True, True]
    alone = [left_out[False, True] - left_out[True, True], left_out[True, False] - left_out[True, True]]
    assert min(alone) > 0.0
    assert_allclose(of_both, sum(alone), rtol=0.3)  # largest of several quantities, each of which adds


PANEL = fi.analytic.rectangle(0.6, 0.4, section=fi.Plate(STEEL, 2e-3), n_modes=60, damping_ratio=0.01)


def test_a_drumstick_from_elsewhere_on_our_own_plate_is_the_stick():
    own, points = fi.Striker.stick(0.05, 900.0, n_modes=8), np.linspace(0.0, 1.0, 21)[:, None]
    stick = fi.Striker.of(exported(own.modes, points, [21]), 21, direction="z")
    found, truth = (fi.strike(PANEL, each, LAW, at=(0.2, 0.15), speed=2.0, tolerance=1e-2) for each in (stick, own))
    assert_allclose(numbers(found), numbers(truth), rtol=1e-9)  # the same numbers, read at nodes
    assert_allclose(stick.felt_mass, 0.05 / 3.0)


def test_a_body_hit_beside_its_centre_turns_as_closed_forms_say():
    """Two rigid bodies without friction, e = 1: J = 2 v m_e, 1/m_e the sum of 1/m + (r x n).I^-1.(r x n) of both."""
    inertia, arm = np.array([[5e-4, 1e-4, 0.0], [1e-4, 4e-4, -5e-5], [0.0, -5e-5, 3e-4]]), np.array([0.03, -0.02, 0.04])
    way = np.array([0.6, 0.0, 0.8])
    names = {"centre": 1, "tip": 2, "x": 3, "y": 4}
    nodes = [(0.0, 0.0, 0.0), arm, (0.1, 0.0, 0.0), (0.0, 0.1, 0.0)]
    club, other = fi.Body.rigid(0.5, inertia, nodes, names=names), fi.Body.rigid(0.2, 1e-4, nodes, names=names)
    striker = fi.Striker.of(club, "tip", direction=way)
    twist = np.cross(arm, way)
    both = (club, 0, 0.5, inertia, -1.0, 3.0), (other, 1, 0.2, 1e-4 * np.eye(3), 1.0, 0.0)
    yields = [1.0 / m + twist @ np.linalg.solve(tensor, twist) for _, _, m, tensor, *_ in both]
    assert_allclose(striker.felt_mass, 1.0 / yields[0])
    hit = fi.strike(other.modes(way), striker, LAW, at=other.at("tip"), speed=3.0)
    push = 2.0 * 3.0 / sum(yields)
    assert_allclose(hit.impulse, push, rtol=1e-10)  # momentum and energy are exact at each step
    for body, which, mass, tensor, sign, came in both:
        moved = hit.modal_state([hit.history.end_time], body=which)[1]
        centre, x, y = body.displacement(moved, ["centre", "x", "y"])[0]
        turn = np.linalg.solve(tensor, sign * push * twist)
        assert_allclose(centre, (came + sign * push / mass) * way, atol=1e-9)
        assert_allclose(x - centre, np.cross(turn, [0.1, 0.0, 0.0]), atol=1e-9)
        assert_allclose(y - centre, np.cross(turn, [0.0, 0.1, 0.0]), atol=1e-9)
    assert_allclose(sum(hit.energies.values()), 0.5 * 0.5 * 3.0**2)


def test_a_hammer_comes_turning_about_its_grip_and_is_free_from_then_on():
    """Struck at the centre of percussion of the grip, that stays at rest; I / (m b) beyond the centre of mass."""
    mass, inertia, grip = 0.6, 5e-3, -0.25
    sweet = inertia / (mass * -grip)
    for across in (sweet, 0.5 * sweet):
        hammer = fi.Striker.turning(mass, inertia, (across, 0.03), pivot=(grip, 0.0))
        felt = 1.0 / (1.0 / mass + across**2 / inertia)
        assert_allclose(hammer.felt_mass, felt)
        hit = fi.strike(fi.Modes.rigid(0.1), hammer, fi.Contact.hertz(1e8), at=None, speed=2.0)
        turning = 2.0 / (across - grip)  # rad/s
        start = 0.5 * mass * (turning * grip) ** 2 + 0.5 * inertia * turning**2
        assert_allclose(hit.start_energies["striker"], start)
        assert_allclose(hit.impulse, 2.0 * 2.0 / (1.0 / felt + 1.0 / 0.1), rtol=1e-10)
        ends = hit.velocity([[0.0, 0.0], [across, 0.03], [grip, 0.0]], [0.0, hit.history.end_time], body=0)
        assert_allclose(ends[0], [-turning * grip, 2.0, 0.0], atol=1e-12)
        moved = ends[1, 2]
        assert abs(moved) < 1e-9 if across == sweet else abs(moved) > 0.01
    plain = fi.Striker.turning(mass, inertia, (0.0, 0.03))
    assert not plain.modes.notes  # a rigid body has no mesh that may err
    bounced = fi.strike(fi.Modes.rigid(1e6), plain, LAW, at=None, speed=1.0)
    assert_allclose(bounced.contact_time, np.pi * np.sqrt(mass / 1e6), rtol=1e-4)  # the tolerance
    with pytest.raises(ValueError, match="turns or comes aslant"):
        hammer.falling()
    assert fi.Striker.turning(mass, inertia, (0.02, 0.03)).falling().gravity > 9.0


def test_a_soft_contact_feels_a_body_that_bends_as_rigid():
    """The contact lasts 40 periods of the first mode; what bends then is the square of that, some 1e-3."""
    own, points = free_bar(20)
    body = exported(own, points, [31])
    striker = fi.Striker.of(body, 31, direction="z")
    arm, inertia = 0.1, own.mass * 0.4**2 / 12.0
    assert_allclose(striker.felt_mass, 1.0 / (1.0 / own.mass + arm**2 / inertia))
    law = fi.Contact.linear(striker.felt_mass * (np.pi * own.frequencies[2] / 40.0) ** 2)
    hit = fi.strike(fi.Modes.rigid(0.3), striker, law, at=None, speed=1.0, tolerance=1e-3)
    assert_allclose(hit.impulse, 2.0 / (1.0 / striker.felt_mass + 1.0 / 0.3), rtol=2e-3)
    assert_allclose(-hit.restitution, (striker.felt_mass - 0.3) / (striker.felt_mass + 0.3), atol=2e-3)


def by_dop853(one, other, way, pairs, stiffness, pivot, speed, duration):
    """Centres, rotations and elastic modes of both by DOP853: velocities at the end, and the impulses of contacts."""

    def row(body, node):
        """What moves a node along the way, per unit of each coordinate."""
        return np.concatenate([way, np.cross(body["nodes"][node], way), way @ body["shapes"][node]])

    rows = np.array([np.append(row(one, i), -row(other, j)) for i, j in pairs])
    omega, zeta = (np.concatenate([np.append(np.zeros(6), each[name]) for each in (one, other)])
                   for name in ("omega", "zeta"))  # fmt: skip
    parts = [part for each in (one, other)
             for part in (np.eye(3) / each["m"], np.linalg.inv(each["I"]), np.eye(len(each["omega"])))]  # fmt: skip
    inverse, n = block_diag(*parts), len(omega)

    def rates(t, z):
        q, p = z[:n], z[n : 2 * n]
        force = stiffness * np.maximum(rows @ q, 0.0)
        return np.concatenate([p, -inverse @ (rows.T @ force) - 2.0 * zeta * omega * p - omega**2 * q, force])

    start = np.zeros(2 * n + len(pairs))
    if pivot is None:
        start[n : n + 3] = speed * way
    else:
        axis = np.cross(one["nodes"][pairs[0][0]] - pivot, way)
        turn = speed * axis / (axis @ axis)
        start[n : n + 3], start[n + 3 : n + 6] = np.cross(turn, -pivot), turn
    end = solve_ivp(rates, (0.0, duration), start, "DOP853", rtol=1e-10, atol=1e-13, max_step=duration / 400).y[:, -1]
    split = n + 6 + len(one["omega"])
    moved = [p[:3] + np.cross(p[3:6], body["nodes"]) + body["shapes"] @ p[6:]
             for body, p in ((one, end[n:split]), (other, end[split : 2 * n]))]  # fmt: skip
    return *moved, end[2 * n :]


@pytest.mark.parametrize("seed", range(4))
def test_random_bodies_in_space_move_as_their_equations_say(seed):
    """One or two contacts, straight or turning: all velocities in space after 2 ms, to 1e-6 of the fastest.

    A kink of the force at onset and release leaves DOP853 some 1e-8 at these steps; the blow has a tolerance of 1e-8.
    """
    rng = np.random.default_rng(seed)
    one, other = tumbler(rng, 6), tumbler(rng, 4)
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    pairs = [(0, 1), (3, 2)][: 1 + seed % 2]
    pivot = None if seed < 2 else rng.uniform(-0.3, 0.3, 3)
    stiffness, duration = 2e6, 2e-3
    striker, target = fi.Striker.of(one["body"], 1 + pairs[0][0], direction=way, pivot=pivot), other["body"].modes(way)
    places = [(one["body"].at(1 + i), other["body"].at(1 + j)) for i, j in pairs]
    touches = [fi.Touch(fi.Contact.linear(stiffness), 0, 1, *each) for each in places]
    how = {"residual": False, "duration": duration, "tolerance": 1e-8}
    if len(pairs) == 1:
        hit = fi.strike(target, striker, touches[0].law, at=places[0][1], speed=1.5, **how)
    else:
        hit = fi.collide([striker, target], touches, speeds=[1.5, 0.0], **how)
    *moved, impulses = by_dop853(one, other, way, pairs, stiffness, pivot, 1.5, duration)
    size = max(np.abs(each).max() for each in moved)
    for which, (each, wanted) in enumerate(zip((one, other), moved)):
        p = hit.modal_state([duration], body=which)[1]
        assert_allclose(each["body"].displacement(p, list(each["nodes"]))[0], wanted, atol=1e-6 * size)
    found = [sum(i.impulse for i in hit.impacts if i.contact == c) for c in range(len(pairs))]
    assert_allclose(found, impulses, rtol=1e-6)


def test_two_contacts_between_the_same_two_bodies_feel_all_that_yields():
    """Between two points the compliance of modes left out counts, too: as of our own bars."""
    own, points = free_bar(12)
    body = exported(own, points, [1, 11, 31, 41])
    striker, target = fi.Striker.of(body, 11, direction="z"), body.modes("z")
    one, two = (
        fi.collide(bodies, [fi.Touch(LAW, 0, 1, a, b), fi.Touch(LAW, 0, 1, c, d)], speeds=[1.0, 0.0],
                tolerance=1e-2, max_impacts=2)
        for bodies, a, b, c, d in (
            ([striker, target], None, body.at(1), body.at(31), body.at(41)),
            ([own, own], *points[[10, 0, 30, 40]]),
        )
    )  # fmt: skip
    assert_allclose([one.impulse, *one.contact_times], [two.impulse, *two.contact_times], rtol=1e-9)  # read at nodes
    assert_allclose(one.error.total, two.error.total, rtol=1e-2)


def test_gradients_in_the_speed_of_a_striker_that_turns_follow_its_motion():
    """Two strikers meet; the slope of the impulse in a speed is the impulse per speed where contacts are linear."""
    one = fi.Striker.turning(0.3, 2e-4, (0.02, 0.05), pivot=(-0.9, 0.0))
    other = fi.Striker.turning(0.1, 1e-4, (0.01, 0.02))
    hit = fi.collide([one, other], [fi.Touch(LAW, 0, 1)], speeds=[2.0, 0.5])
    slopes = [hit.gradient("impulse", wrt=f"speeds.{i}").slopes[0] for i in (0, 1)]
    push = 2.0 / (1.0 / one.felt_mass + 1.0 / other.felt_mass)
    assert_allclose(hit.impulse, 1.5 * push, rtol=1e-9)
    assert_allclose(slopes, [push, -push], rtol=1e-4)


@pytest.mark.slow
def test_a_striker_that_turns_is_mapped():
    hammer = fi.Striker.turning(0.1, 1e-4, (0.02, 0.03), pivot=(-0.2, 0.0))
    blow = {"striker": hammer, "contact": LAW, "at": (0.2, 0.15), "speed": 1.0}
    cells = fi.sweep(PANEL, over={"stiffness": [5e5, 1e6]}, tolerance=1e-4, **blow)
    truth = fi.strike(PANEL, **blow)
    assert_allclose(float(cells.restitution[1]), truth.restitution, atol=2e-4)  # both tolerances
    assert_allclose(float(cells.contact_time[1]), truth.contact_time, rtol=2e-4)


test_what_no_motion_allows_is_refused = refusing([
    (lambda: fi.Body.rigid(1.0, (1.0, 1.0, 3.0), [(0, 0, 0)]), "none of its principal moments larger"),
    (lambda: fi.Body.rigid(1.0, -1.0, [(0, 0, 0)]), "inertia must be that of a body"),
    (lambda: fi.Body.rigid(1.0, 1.0, [(0, 0, 0)]).freed(1.0, (0, 0, 0)), "it is free already"),
    (lambda: fi.Striker.of(loose(), 1, direction="z", along=(0, 0, -1)), "along must lead towards"),
    (lambda: fi.Striker.of(loose(), 1, direction="z", along=Z, pivot=Z), "give either along"),
    (lambda: fi.Striker.of(loose(), 1, direction="z", pivot=(0, 0, 1)), "pivot must lie off the line"),
    (lambda: fi.Striker.of(loose(scale=2.0), 1, direction="z"), "must be what the rigid motions move, 0.25 kg"),
    (lambda: fi.Striker.of(loose(n=1, at=0.1), 1, direction="z"), "three that are not on a line"),
    (lambda: fi.Striker.of(loose(first=3), 1, direction="z"), "give all six as modes of 0 Hz, or `Body.freed`"),
    (lambda: fi.Striker.of(fi.Body([10.0], np.ones((3, 3, 1)), np.eye(3), 1.0), 1, direction="z"),
     "give its rigid motions as modes of"),
    (lambda: fi.Striker.turning(1.0, 1.0, 0.1), "arm must"),
    (lambda: onto(fi.Striker.turning(1.0, 1e-3, (0.02, 0.0), pivot=(-0.2, 0.0)), -0.2),
     "first_at of body 0 must come towards"),
    (lambda: onto(fi.Striker.rigid(1.0).falling()), "striker must not fall in a collision"),
    (lambda: onto(curved().modes("normal"), curved().at(1)), "along normals its motion before the blow is not defined"),
])  # fmt: skip


def onto(body, at=None):
    return fi.collide([body, fi.Modes.rigid(1.0)], [fi.Touch(LAW, 0, 1, at)], speeds=[1.0, 0.0])


def loose(n=4, scale=1.0, first=0, at=0.0):
    nodes = (at + np.vstack([np.zeros(3), 0.1 * np.eye(3)]))[:n]
    whole = fi.Body.rigid(1.0, 1e-3, nodes)
    return fi.Body(whole.frequencies[first:], scale * whole.shapes[:, :, first:], nodes, 1.0)


def curved():
    """Four nodes of a sphere, as of a shell."""
    nodes = 0.1 * np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-0.6, -0.6, -0.5)])
    return fi.Body.rigid(1.0, 1e-3, nodes, normals=nodes)
