"""Contacts that yield, have two layers or are felt: against scipy, closed forms, and their own energy balance."""

import numpy as np
import pytest
import restarted
from comparing import worst
from lossy_blow import blow
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import fem_impact as fi
from fem_impact.impact.accuracy import contact_duration

PLATE = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=20)
WALL, AT = fi.Modes.rigid(1e6), (0.45, 0.3)
LAWS = {  # the law, and the same for `lossy_blow`
    "layers": (fi.Contact.layers(1e5, 1.3, depth=2e-4, hard_stiffness=1e8), ("layers", 1e5, 1.3, 2e-4, 1e8, 1.5)),
    "straight layers": (
        fi.Contact.layers(1e5, 1.0, depth=2e-4, hard_stiffness=1e6, hard_exponent=1.0),
        ("layers", 1e5, 1.0, 2e-4, 1e6, 1.0),
    ),
    "plastic": (fi.Contact(1e8, 1.5, yield_approach=3e-5), ("plastic", 1e8, 1.5, 3e-5, 12.0, 3.5)),
    "slow felt": (fi.Contact.felt(1e9, 2.2, hysteresis=0.6, relaxation=2e-4), ("felt", 1e9, 2.2, 0.6, 2e-4)),
    "quick felt": (fi.Contact.felt(1e9, 2.2, hysteresis=0.9, relaxation=2e-5), ("felt", 1e9, 2.2, 0.9, 2e-5)),
}


def struck(law, target, tolerance, speed=1.0, **wanted):
    at = None if target.dimension == 0 else AT
    about = {"at": at, "speed": speed, "tolerance": tolerance, "residual": False, **wanted}
    return fi.strike(target, fi.Striker.rigid(0.02), law, **about)  # 20 modes do not resolve the stiff contacts


def truth(hit, told):
    h = hit.history
    return blow(h.omega, h.zeta, h.shape[0], h.start_p, told, 1.001 * max(h.end_time, hit.impacts[-1].end))


def test_a_blow_that_ends_while_the_contact_yields():
    """The approach at the end counts from no dent, although the last step made the dent deeper."""
    law, _ = LAWS["plastic"]
    hit = struck(law, WALL, 1e-4, duration=5e-5)
    h = hit.history
    assert_allclose(h.now[0], h.offset + h.shape @ h.end_q, rtol=1e-12)  # rounding of sums of steps
    assert h.now[5, 0] > law.yield_approach and hit.energies["dissipated"] > 0.0
    assert hit.energy_error < 1e-12  # rounding


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("target", [WALL, PLATE], ids=["wall", "plate"])
def test_blows_agree_with_runge_kutta(name, target):
    """Within the tolerance, and by no more than ten times what is claimed."""
    law, told = LAWS[name]
    fine, usual = struck(law, target, 1e-9), struck(law, target, 1e-4)
    wanted = truth(fine, told)
    momentum = np.linalg.norm(fine.history.start_p)
    for hit, limit in ((fine, 1e-8), (usual, 1e-4)):
        missed = [abs(getattr(hit, name) / getattr(wanted, name) - 1.0) for name in ("impulse", "contact_time")]
        missed.append(abs(hit.history.end_p[0] - wanted.speeds[0]) / momentum)
        assert max(missed) < limit
        assert max(missed) < 10.0 * hit.error.step + 1e-11  # 1e-11: what Runge-Kutta itself errs by
        assert hit.peak_force == pytest.approx(wanted.peak, rel=max(limit, 1e-6))  # the truth is sampled 4000 times
        lost = hit.energies["contact"] + hit.energies["dissipated"]
        assert lost == pytest.approx(wanted.lost, abs=4.0 * limit * 0.5 * momentum**2)
        assert hit.energies["dissipated"] >= 0.0
        assert hit.energy_error < 1e-12  # rounding


@pytest.mark.parametrize(
    ("law", "told", "tolerance"),
    [
        # opens 40 times quicker than it closes: contact times erred by 3e-3 where 1e-4 was claimed
        (fi.Contact(1e14, 3.0, yield_approach=1e-5), ("plastic", 1e14, 3.0, 1e-5, 12.0, 17.0), 1e-2),
        # of order two, as its memory sets in like the force: claims took it for three and were 2.3 times too small
        (fi.Contact.felt(1e7, 1.0, hysteresis=0.6, relaxation=1e-4), ("felt", 1e7, 1.0, 0.6, 1e-4), 1e-3),
    ],
)
def test_what_a_contact_does_within_its_steps_is_claimed(law, told, tolerance):
    hit = fi.strike(fi.Modes.rigid(1.0), fi.Striker.rigid(0.1), law, at=None, speed=1.0, tolerance=tolerance)
    wanted = truth(hit, told)
    assert abs(hit.contact_time / wanted.contact_time - 1.0) < 1.1 * hit.error.of_quantity("contact_time")
    missed = abs(hit.history.end_p[0] - wanted.speeds[0]) / np.linalg.norm(hit.history.start_p)
    assert missed < 1.1 * hit.error.of_quantity("restitution")  # 1.1: terms of higher order


@pytest.mark.parametrize(("loss", "tolerance"), [(20.0, 1e-6), (230.0, 1e-2), (700.0, 1e-4), (5e3, 1e-5)])
def test_a_sticky_contact_ends_where_the_overlap_does(loss, tolerance):
    """It slows the bodies down to 1 / loss: rounding decided when they parted faster, and no two runs agreed."""
    stiffness, striker, target, speed = 1.4e6, 0.0064, 0.0015, 1.0
    mass = striker * target / (striker + target)

    def change(_, y):  # approach, and the logarithm of 1 + loss * rate
        return [np.expm1(y[1]) / loss, -loss * stiffness * max(y[0], 0.0) ** 2 / mass]

    parted = lambda _, y: y[0]  # noqa: E731
    parted.terminal, parted.direction = True, -1.0
    start = [0.0, np.log1p(loss * speed)]
    truth = solve_ivp(change, (0.0, 10.0), start, "LSODA", rtol=1e-11, atol=1e-16, events=parted)
    hit = fi.strike(
        fi.Modes.rigid(target), fi.Striker.rigid(striker), fi.Contact.power(stiffness, 2.0, loss=loss), at=None,
        speed=speed, tolerance=tolerance,
    )  # fmt: skip
    assert hit.tolerance_met
    assert hit.contact_time == pytest.approx(truth.t[-1], rel=hit.error.of_quantity("contact_time"))
    assert hit.impulse == pytest.approx(mass * (speed - np.expm1(truth.y[1, -1]) / loss), rel=tolerance)


@pytest.mark.parametrize(("scheme", "tolerance"), [("A", 1e-3), ("A4", 1e-4)])
def test_a_dent_stays_and_what_it_took_is_known(scheme, tolerance):
    """A ball dropped again and again: second impacts begin at the dent and lose only where they press deeper."""
    touch = fi.Touch(fi.Contact.elastic_plastic(1e9, yield_speed=0.05, mass=0.02), 0, None)
    how = {"speeds": [1.0], "forces": [0.02 * 9.81], "max_impacts": 3, "scheme": scheme, "tolerance": tolerance}
    hit = fi.collide([fi.Modes.rigid(0.02)], [touch], **how)
    ends = [impact.end for impact in hit.impacts]
    assert len(ends) == 3
    first, *later = np.abs(hit.velocity(None, ends, body=0)[:, 0])
    assert first < 0.81
    assert_allclose(later, first, rtol=1e-3)  # slower than before: elastic, but for the work of the weight
    deepest = hit.history.now[5, 0]
    dent = hit.history.offset[0] + hit.displacement(None, ends[2:], body=0)[0, 0]
    assert 0.1 * deepest < dent < deepest  # it leaves the floor at the dent
    assert hit.energy_error < 1e-13  # the loss is that of the law in closed form


def test_felt_held_pressed_relaxes_to_its_share():
    """A weight on felt: it sinks until the relaxed stiffness carries it."""
    law = fi.Contact.felt(1e6, 1.5, hysteresis=0.75, relaxation=2e-3)
    weight = 0.02 * 9.81
    hit = fi.collide([fi.Modes.rigid(0.02)], [fi.Touch(law, 0, None)], speeds=[1e-2], forces=[weight], duration=3.0)
    depth = hit.displacement(None, [3.0], body=0)[0, 0]
    assert depth == pytest.approx((weight / (0.25 * 1e6)) ** (1.0 / 1.5), rel=1e-4)
    assert hit.force[-1] == pytest.approx(weight, rel=1e-4)


def test_felt_that_does_not_relax_is_a_power_law_and_fast_felt_a_softer_one():
    plain = struck(fi.Contact.power(1e9, 2.0), WALL, 1e-6)
    stiff = struck(fi.Contact.felt(1e9, 2.0, hysteresis=0.5, relaxation=1e3), WALL, 1e-6)
    soft = struck(fi.Contact.power(5e8, 2.0), WALL, 1e-6)
    quick = fi.Contact.felt(1e9, 2.0, hysteresis=0.5, relaxation=1e-10)
    assert stiff.peak_force == pytest.approx(plain.peak_force, rel=2e-6)  # relaxation time over contact time: 2e6
    assert struck(quick, WALL, 1e-6).peak_force == pytest.approx(soft.peak_force, rel=3e-6)


def test_felt_hit_again_at_once_is_harder_and_thinner():
    """A force brings the mass back before the felt has recovered: it meets the surface where that is by then."""
    share, time = 0.9, 1e-3
    law = fi.Contact.felt(1e8, 2.0, hysteresis=share, relaxation=time)
    touch, about = [fi.Touch(law, 0, None)], {"speeds": [0.5], "forces": [0.5], "max_impacts": 2}
    for tolerance in (1e-5, 1e-9):
        hit = fi.collide([fi.Modes.rigid(0.02)], touch, tolerance=tolerance, **about)
        assert hit.n_impacts == 2
        first, second = hit.impacts
        left, met = hit.displacement(None, [first.end, second.start], body=0)[:, 0]
        wanted = left * np.exp(-0.5 * (1.0 - share) * (second.start - first.end) / time)  # z falls so, d is its root
        assert left > 1e-5 and met > 0.1 * left
        assert met == pytest.approx(wanted, rel=100.0 * tolerance)  # its way since then is 100 times as long
        assert hit.energy_error < 1e-12


def test_two_contacts_of_other_kinds_at_once_agree_with_finer_steps():
    """Three balls in a row through felt and a yielding contact."""
    balls = [fi.Modes.rigid(m) for m in (0.02, 0.01, 0.03)]
    felt = fi.Contact.felt(1e8, 2.0, hysteresis=0.5, relaxation=1e-4)
    soft = fi.Contact.elastic_plastic(1e8, yield_speed=0.05, mass=0.01)
    touches = [fi.Touch(felt, 0, 1), fi.Touch(soft, 1, 2)]
    usual, fine = (fi.collide(balls, touches, speeds=[1.0, 0.0, 0.0], tolerance=t) for t in (1e-5, 1e-9))
    assert_allclose(usual.speeds, fine.speeds, atol=1e-5)
    assert_allclose(usual.impulse, fine.impulse, rtol=1e-5)
    for hit in (usual, fine):
        assert hit.energy_error < 1e-12
        assert hit.momentum_error < 1e-12
        assert hit.dissipated["contact"] > 0.01 * 0.5 * 0.02


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_the_error_is_what_it_claims_for_random_blows(seed):
    """At 1e-3 or 1e-4 against 1e-8, on plates of random size with random laws."""
    rng = np.random.default_rng(seed)
    plate = fi.analytic.rectangle(1.0 + rng.random(), 1.0, mass=0.2, first_frequency=100.0, n_modes=30)
    k, speed, mass = 10.0 ** rng.uniform(7.0, 9.0), 10.0 ** rng.uniform(-1.0, 1.0), 10.0 ** rng.uniform(-2.5, -1.0)
    time = contact_duration(fi.Contact.hertz(k), mass, speed)
    law = [
        fi.Contact.layers(1e-3 * k, 1.2, depth=0.1 * speed * time, hard_stiffness=k),
        fi.Contact.elastic_plastic(k, yield_speed=speed * rng.uniform(0.05, 0.5), mass=mass),
        fi.Contact.felt(k, 1.5, hysteresis=rng.uniform(0.2, 0.95), relaxation=time * 10.0 ** rng.uniform(-2.0, 1.0)),
    ][seed % 3]
    about = {"at": rng.uniform(0.2, 0.8, 2), "speed": speed, "residual": False}
    tolerance = (1e-3, 1e-4)[seed % 2]
    usual, fine = (fi.strike(plate, fi.Striker.rigid(mass), law, tolerance=t, **about) for t in (tolerance, 1e-8))
    assert worst(usual, fine) < tolerance
    assert usual.energy_error < 1e-12


def test_a_stick_that_bends_too_little_to_matter_still_meets_a_lossy_contact():
    stick, law = fi.Striker.stick(mass=0.1, first_frequency=10e3), fi.Contact.power(1e4, 1.5, loss=0.1)
    rough, fine = (fi.strike(PLATE, stick, law, at=AT, speed=0.1, tolerance=tolerance) for tolerance in (0.1, 1e-4))
    assert rough.n_impacts == 1
    assert rough.impulse == pytest.approx(fine.impulse, rel=1e-2)  # a tenth of what was asked for


def felt_blow(stiffness, tolerance):
    """A mass rests twice on felt that lets go for a moment in between, if it is just stiff enough."""
    plate = fi.analytic.rectangle(1.03, 1.0, mass=0.2, first_frequency=100.0, n_modes=40, damping_ratio=0.01)
    felt = fi.Contact.felt(stiffness, 2.13, hysteresis=0.7, relaxation=1.1e-4)
    options = {"at": (0.3, 0.4), "speed": 1.0, "residual": False}
    return fi.strike(plate, fi.Striker.rigid(0.052), felt, tolerance=tolerance, **options)


def lets_go(stiffness):
    return felt_blow(stiffness, 1e-4).n_impacts > 1


def test_margin_tells_how_nearly_felt_lets_go_or_holds():
    low, high = 2.1e8, 2.5e8
    assert lets_go(high) and not lets_go(low)
    for _ in range(18):  # to 6e-7 of the stiffness
        middle = 0.5 * (low + high)
        low, high = (low, middle) if lets_go(middle) else (middle, high)
    for tolerance in (1e-1, 1e-2, 1e-4):
        for side, count in ((-1.0, 1), (1.0, 2)):
            near, far = (felt_blow(high * (1.0 + side * offset), tolerance) for offset in (1e-3, 1e-2))
            assert near.n_impacts == far.n_impacts == count
            assert 0.0 < near.margin < 1e-4 < far.margin < 1e-3
            assert far.margin / near.margin == pytest.approx(10.0, rel=0.3)  # in a straight line at first


# ends, damping ratio, place [m], mass [kg], law, speed [m/s], and the impacts: of both, rates within the first press
# reach 1 / loss for three quarters of a step
@pytest.mark.parametrize(
    ("ends", "damping_ratio", "at", "mass", "law", "speed", "n_impacts"),
    [
        (("hinged", "hinged"), 0.01218, 0.24622, 3.529e-3, (9.8516e4, 1.5, 33.646), 0.15042, 2),
        (("free", "free"), 0.005, 0.1978, 1.3944e-2, (1.10042e8, 1.935, 120.45), 0.036885, 3),
    ],
)
def test_a_lossy_contact_that_pauses_for_less_than_a_step_is_two_impacts(
    ends, damping_ratio, at, mass, law, speed, n_impacts
):
    shape = {"mass": 0.2, "first_frequency": 100.0, "n_modes": 60 - 20 * (ends[0] == "free")}
    body = fi.analytic.beam(1.0, ends=ends, damping_ratio=damping_ratio, **shape), fi.Striker.rigid(mass)
    hit, exact = (
        fi.strike(*body, fi.Contact(*law), at=[at], speed=speed, tolerance=each, max_impacts=12) for each in (0.1, 1e-6)
    )
    assert hit.n_impacts == exact.n_impacts == n_impacts
    assert hit.contact_time == pytest.approx(exact.contact_time, rel=hit.error.of_quantity("contact_time"))


@pytest.mark.parametrize("steps", [{"tolerance": 0.1}, {"tolerance": 1e-3}, {"dt": 2.5e-5}, {"dt": 1e-5}])
def test_felt_that_lets_go_for_less_than_a_step_is_two_impacts(steps):
    """It is met again seven microseconds later, within the step that began when it let go."""
    law = fi.Contact.felt(8.65e12, 2.675, hysteresis=0.518, relaxation=1.286e-4)
    plate = fi.analytic.rectangle(0.75, 1.0, mass=0.2, first_frequency=100.0, n_modes=40, damping_ratio=0.01)
    how = {"at": (0.3, 0.4), "speed": 1.336, "residual": False, "tolerance": 0.1, **steps}
    first, second = fi.strike(plate, fi.Striker.rigid(0.1707), law, **how).impacts
    assert_allclose([first.end, second.start], [396.77e-6, 403.94e-6], rtol=1e-3)  # at a tolerance of 1e-5


def ringing(frequency, shape):
    """A body of one mode, known at one point."""
    about = {"points": [[0.0]], "mass": 0.3, "damping_ratio": 0.05, "complete": True}
    return fi.Modes.from_arrays([frequency], [[shape]], **about)


QUICK = fi.Contact.felt(1.66e5, 1.2, hysteresis=0.26, relaxation=1.7e-6)


@pytest.mark.parametrize(
    ("body", "law", "mass", "speed", "quantity", "tolerance"),
    [
        # a peak that the rate within a step moves: two runs agreed on it by chance, claims were a third to a fifth
        (ringing(3705.0, 0.126), fi.Contact.power(4.57e6, 1.2, loss=1.38), 0.00211, 5.75, "force", 1e-2),
        (ringing(57.6, 2.0), fi.Contact.power(1.866e6, 1.0, loss=0.0378), 0.2456, 7.36, "force", 1e-4),
        (ringing(120.8, 0.609), fi.Contact.power(1.25e4, 1.0, loss=0.053), 0.0329, 1.66, "force", 1e-5),
        # felt that recovers within a step errs at first order: claims were a third of the errors
        *((WALL, QUICK, 1.2e-3, 0.2, "contact_time", tolerance) for tolerance in (1e-3, 1e-4)),
    ],
)
def test_what_happens_within_a_step_is_claimed(body, law, mass, speed, quantity, tolerance):
    blow = {"at": [0.0] if body.dimension else None, "speed": speed, "max_impacts": 1}
    told, true = (fi.strike(body, fi.Striker.rigid(mass), law, tolerance=each, **blow) for each in (tolerance, 1e-9))
    name = "peak_force" if quantity == "force" else quantity
    assert abs(getattr(told, name) / getattr(true, name) - 1.0) < told.error.of_quantity(quantity) < tolerance


@pytest.mark.parametrize(
    ("body", "stick", "law", "at", "speed", "tolerance"),
    [
        (
            fi.analytic.rectangle(0.691, 0.288, mass=2.04, first_frequency=143.6, n_modes=400, damping_ratio=0.01),
            (33.6e-3, 2148.0), fi.Contact.hertz(3.41e6, loss=1.044), (0.0818, 0.026), 0.803, 1e-4,
        ),
        (
            fi.analytic.beam(0.8126, ends=("free", "free"), mass=0.0367, first_frequency=36.75, n_modes=200),
            (0.026, 6802.0), fi.Contact.power(1.9e9, 2.18, loss=0.94), (0.083,), 1.9, 1e-3,
        ),
    ],
)  # fmt: skip
def test_ringing_of_a_lossy_force_that_no_step_resolves_is_claimed(body, stick, law, at, speed, tolerance):
    """Halved steps do not show it: the claim was a thirtieth and a third of the error."""
    blow = {"at": at, "speed": speed}  # the modes are the same, however many are missing
    told, true = (fi.strike(body, fi.Striker.stick(*stick), law, tolerance=each, **blow) for each in (tolerance, 1e-7))
    assert abs(told.peak_force / true.peak_force - 1.0) < told.error.table["step"]["force"] < tolerance


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5])
def test_felt_that_hardly_stays_behind_is_parted_from_before_its_surface(tolerance):
    """A step in which felt let go could not end where it would open, and passed both: the time was off by 5e-4."""
    law, ball = fi.Contact.felt(9.57e5, 1.0, hysteresis=0.0554, relaxation=2.5e-3), fi.Striker.rigid(1.4e-3)
    told, true = (fi.strike(WALL, ball, law, at=None, speed=5.73, tolerance=each) for each in (tolerance, 1e-9))
    assert told.history.n_blind == 0
    assert_allclose(told.contact_time, true.contact_time, rtol=3.0 * told.error.of_quantity("contact_time"))


@pytest.mark.parametrize(("seed", "law", "mass", "speeds"), [
    (94, fi.Contact.felt(5.24e5, 2.68, hysteresis=0.7, relaxation=1.1e-5), 0.025, (0.28, 0.91)),
    (109, fi.Contact.felt(4.28e6, 2.76, hysteresis=0.73, relaxation=2.1e-5), 0.052, (0.21, 0.18)),
])  # fmt: skip
def test_felt_that_is_left_slowly_is_not_met_again(seed, law, mass, speeds):
    """Of 300 such pairs 10 had one impact too many: a step found no force although the felt pushed at both ends."""
    body, balls = restarted.measured(10, seed), [fi.Striker.rigid(mass)] * 2
    touches = [fi.Touch(law, i, 2, None, [0.0]) for i in (0, 1)]
    told, true = (fi.collide([*balls, body], touches, speeds=(*speeds, 0.0), tolerance=each) for each in (1e-3, 1e-7))
    assert told.n_impacts == true.n_impacts == 2
    # two runs share the last step, whose length once was a hundred relaxations, and do not tell its error: 1e-4
    assert_allclose(told.contact_time, true.contact_time, rtol=2e-5)


@pytest.mark.parametrize(("seed", "tolerance"), [(1, 1e-4), (9, 1e-3)])
def test_bodies_that_a_loss_lets_go_have_parted_however_the_rate_is_rounded(seed, tolerance):
    """Let go is located to 1e-8 of the force's factor, but told to 1e-9: there was no restitution."""
    law, body = fi.Contact.power(1.35e7, 2.0, loss=3.09), restarted.measured(6, seed)
    hit = fi.strike(body, fi.Striker.rigid(0.86), law, at=[0.0], speed=2.6, max_impacts=2, tolerance=tolerance)
    assert hit.restitution is not None
    assert_allclose(hit.impacts[-1].separation_speed, 1.0 / law.loss, rtol=1e-6)
