"""A falling striker bounces again and again: closed forms on a wall, an integrator of its own on a moving body."""

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import fem_impact as fi
from fem_impact.impact.striker import GRAVITY

EARTH = fi.Modes.rigid(1e9)
MASS, HARD = 0.02, 1e12
BODY = fi.Modes.from_arrays(
    [180.0, 640.0], [[1.2, 0.9]], points=[[0.0]], mass=1.0, damping_ratio=[0.02, 0.01], complete=True
)


def dropped(law, n, height=0.1, body=EARTH, at=None, tolerance=1e-6):
    ball = fi.Striker.rigid(MASS).falling()
    return fi.strike(body, ball, law, at=at, speed=ball.dropped(height), max_impacts=n, tolerance=tolerance)


@pytest.mark.parametrize(("exponent", "stiffness"), [(1.0, HARD), (1.5, HARD), (2.5, 1e18)])
def test_every_bounce_loses_what_the_law_takes_at_its_own_speed(exponent, stiffness):
    """F = k d**n (1 + c d'): m v dv / (1 + c v) = -k d**n dd, so that c v - ln(1 + c v) of both speeds add to zero."""
    law = fi.Contact.power(stiffness, exponent, loss=0.3)
    hit = dropped(law, 5)
    before, after = hit.striker_speeds.T
    went_in, came_out = law.loss * before, law.loss * after
    # the weight at 1e-4 of the force, or 3e-4 at the smallest of them
    assert_allclose(went_in - np.log1p(went_in), came_out - np.log1p(came_out), rtol=1e-3)
    assert_allclose([each.restitution for each in hit.impacts], -after / before, rtol=1e-6)
    assert_allclose(before[1:], -after[:-1], rtol=1e-3)  # what it rises it falls; the floor is met where it was left
    assert_allclose(hit.restitution, np.prod([each.restitution for each in hit.impacts]), rtol=1e-6)
    pairs = list(zip(hit.impacts, hit.impacts[1:]))
    assert_allclose([b.approach_speed for _, b in pairs], [a.separation_speed for a, _ in pairs], rtol=1e-6)
    flights = [later.start - sooner.end for sooner, later in pairs]
    assert_allclose(flights, 2.0 * -after[:-1] / GRAVITY, rtol=1e-4)
    heights = after**2 / (2.0 * GRAVITY)
    assert (np.diff(heights) < 0.0).all()
    assert_allclose(hit.dissipated["contact"], MASS * GRAVITY * (0.1 - heights[-1]), rtol=1e-3)


def test_bounces_on_a_body_that_still_moves_are_those_of_another_integrator():
    """Two modes and a ball by DOP853, piece by piece between the times when contact begins and ends."""
    law = fi.Contact.linear(1e6)
    hit = dropped(law, 4, height=5e-3, body=BODY, at=[0.0], tolerance=1e-8)
    omega, zeta, shape = BODY.omega, BODY.damping_ratio, BODY.shape_at([[0.0]])[0]

    def rates(_, y, pressed):
        push = law.stiffness * (y[0] - shape @ y[2:4]) * pressed
        return [y[1], GRAVITY - push / MASS, *y[4:], *(shape * push - 2.0 * zeta * omega * y[4:] - omega**2 * y[2:4])]

    def apart(_, y, pressed):
        return y[0] - shape @ y[2:4]

    apart.terminal = True
    y, time, found = np.array([0.0, hit.speed, 0.0, 0.0, 0.0, 0.0]), 0.0, []
    for piece in range(7):
        pressed = piece % 2 == 0
        apart.direction = -1.0 if pressed else 1.0
        part = solve_ivp(rates, (time, time + 1.0), y, "DOP853", events=apart, args=(pressed,), rtol=1e-11, atol=1e-13,
                         max_step=1e-4 if pressed else 1e-3)  # fmt: skip
        time, y = float(part.t_events[0][0]), part.y_events[0][0]
        found.append((time, y[1], abs(y[1] - shape @ y[4:])))
    ends, own, relative = np.array(found).T
    assert_allclose([each.end for each in hit.impacts], ends[::2], rtol=1e-6)
    assert_allclose([each.start for each in hit.impacts[1:]], ends[1::2], rtol=1e-6)
    assert_allclose(hit.striker_speeds[:, 1], own[::2], rtol=1e-5)
    wanted = relative[::2] / np.append(hit.speed, relative[1::2])
    assert_allclose([each.restitution for each in hit.impacts], wanted, rtol=1e-5)
    assert all(error < 1e-4 for error in hit.restitution_errors)


def test_bounces_that_depend_on_when_they_come_are_called_chaotic():
    """Bounces of some periods of a loosely damped mode: two drops a millionth apart are soon another series."""
    body = fi.Modes.from_arrays([400.0], [[2.0]], points=[[0.0]], mass=1.0, damping_ratio=1e-4, complete=True)
    ball, law = fi.Striker.rigid(MASS).falling(), fi.Contact.linear(1e6)
    rules = {"at": [0.0], "max_impacts": 12, "tolerance": 1e-1}
    hits = [fi.strike(body, ball, law, speed=v, **rules) for v in (0.5, 0.5 * (1.0 + 1e-6))]
    apart = np.abs(np.array([[a.end - b.end for a, b in zip(hits[0].impacts, hits[1].impacts)]])).ravel()
    grown = apart[-1] / apart[0]
    assert grown > 1e3 * hits[0].impacts[-1].end / hits[0].impacts[0].end
    assert "chaotic: small differences grow" in hits[0].summary()


def test_a_ball_on_a_damped_body_comes_to_rest():
    """It then rests in its dent, pressed by its weight, and all energy of the fall is lost."""
    body = fi.Modes.from_arrays([60.0], [[2.0]], points=[[0.0]], mass=1.0, damping_ratio=0.2, complete=True)
    ball, law = fi.Striker.rigid(0.05).falling(), fi.Contact.linear(1e5)
    rules = {"at": [0.0], "speed": ball.dropped(0.05), "tolerance": 1e-3}
    short, long = (fi.strike(body, ball, law, duration=time, **rules) for time in (1.0, 2.0))
    assert short.n_impacts == long.n_impacts > 20 and long.in_contact and long.impacts[-1].restitution is None
    assert_allclose(long.force[-1], 0.05 * GRAVITY, rtol=1e-6)
    # a sag of 5 and 2 micrometres more
    assert_allclose(sum(long.dissipated.values()), 0.05 * GRAVITY * 0.05, rtol=1e-3)


def test_a_flexible_ball_falls_as_a_whole():
    """The weight moves it rigidly: it does not bend in flight, and falls as a mass does."""
    bar = fi.analytic.beam(0.2, ends=("free", "free"), mass=MASS, first_frequency=2e3, n_modes=4)
    stick = fi.Striker.flexible(bar, at=[0.0]).falling()
    assert_allclose(stick.push @ stick.motion, GRAVITY * MASS, rtol=1e-12)
    assert not stick.push[stick.modes.omega > 0.0].any()
    hit = fi.strike(EARTH, stick, fi.Contact.linear(1e4, gap=0.01), at=None, speed=0.5, duration=0.03, tolerance=1e-4)
    time = (np.sqrt(0.25 + 2.0 * GRAVITY * 0.01) - 0.5) / GRAVITY
    assert_allclose(hit.impacts[0].start, time, rtol=1e-9)
    assert_allclose(hit.impacts[0].approach_speed, 0.5 + GRAVITY * time, rtol=1e-9)


def test_the_gradient_knows_that_the_weight_grows_with_the_mass():
    def blow(mass):
        how = {"at": [0.0], "speed": 0.3, "max_impacts": 3, "tolerance": 1e-7}
        return fi.strike(BODY, fi.Striker.rigid(mass).falling(), fi.Contact.linear(1e6), **how)

    slope, step = blow(0.05).gradient("impulse", wrt="striker.mass").slopes[0], 0.05e-4
    differences = (blow(0.05 + step).impulse - blow(0.05 - step).impulse) / (2.0 * step)
    assert_allclose(slope, differences, rtol=1e-3)  # of the third order


test_what_cannot_fall_or_follow_a_fall_says_so = refusing([
    (lambda: fi.Striker.rigid(0.1).falling(-1.0), "gravity must not be negative"),
    (lambda: fi.Striker.stick(mass=0.1, first_frequency=1e3).falling(), "to fall, .* aslant; leave gravity out$"),
    (lambda: fi.Striker.rigid(0.1).held(fi.Hand(1e3)).falling(),
     "must fall freely to fall, a hand holds this one; leave gravity or hand out"),
    (lambda: fi.sweep(BODY, fi.Striker.rigid(0.1).falling(), fi.Contact.linear(1e6), at=[0.0], speed=1.0,
                      over={"mass": [0.1]}), "must not fall in a map"),
])  # fmt: skip
