"""Blows on bodies that stretch, against closed forms and direct integration."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from comparing import difference
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk
from warming import locked

import fem_impact as fi
from fem_impact.impact import engine, stretched
from fem_impact.impact.compiled import record
from fem_impact.impact.compiled.bundles import KernelSystem, Limits
from fem_impact.impact.compiled.energy import run_energy
from fem_impact.impact.compiled.law import table
from fem_impact.impact.compiled.stretched import Stretch, energies_of_stretching
from fem_impact.modes.stretching import stretch

H, SIDES = 1e-3, (0.2, 0.3)
STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
PLATE = fi.Plate(STEEL, H)
AT, HAMMER = (0.09, 0.13), fi.Striker.rigid(0.1)
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("stretched")]  # one worker compiles its kernels


def plate(n_modes, damping_ratio=0.0, sides=SIDES):
    return fi.analytic.rectangle(*sides, section=PLATE, n_modes=n_modes, damping_ratio=damping_ratio)


def blow(modes, law, speed=1.0, **how):
    return fi.strike(modes, HAMMER, law, at=AT, speed=speed, residual=False, **{"stretching": True, **how})


def duffing(omega, cubic, amplitude):
    """Angular frequency of ``q'' + omega**2 q + cubic q**3 = 0`` (Abramowitz and Stegun, 17.3)."""
    stiff = omega**2 + cubic * amplitude**2
    return 0.5 * np.pi * np.sqrt(stiff) / ellipk(0.5 * cubic * amplitude**2 / stiff)


def test_overlapping_blocks_of_the_motion_go_on_from_the_block_before(monkeypatch):
    """As those of a sound do that arrives over several ways; each began again with the blow."""
    hit, begun, replay = blow(plate(4), fi.Contact.linear(1e5), duration=0.05), [], stretched.replay_stretched
    watched = lambda *those: begun.append(those[5][0]) or replay(*those)  # noqa: E731
    monkeypatch.setattr(stretched, "replay_stretched", watched)
    whole = np.linspace(0.0, 0.04, 401)
    blocks = [np.array(hit.modal_state(whole[i : i + 150])) for i in range(0, 300, 100)]
    assert begun[-2:] == pytest.approx([whole[100], whole[200]], abs=1e-3)
    for i, block in enumerate(blocks):
        np.testing.assert_allclose(block, np.array(hit.modal_state(whole))[:, 100 * i : 100 * i + 150], rtol=1e-9)


@pytest.mark.parametrize("speed", [0.3, 1.0, 3.0])
def test_one_mode_rings_at_the_frequency_of_a_duffing_oscillator(speed):
    modes = plate(1, sides=(0.2, 0.2))
    hit = blow(modes, fi.Contact.linear(1e5), speed, tolerance=1e-7)
    omega, form = modes.omega[0], stretch(modes).forms[0, 0, 0]
    end = hit.impacts[-1].end
    q, p = (state[0, 0] for state in hit.modal_state([end]))
    total = 0.5 * (p**2 + (omega * q) ** 2) + 0.25 * (form * q**2) ** 2
    square = (np.sqrt(omega**4 + 4.0 * form**2 * total) - omega**2) / form**2  # of the amplitude
    wanted = duffing(omega, form**2, np.sqrt(square))
    # two upward crossings of zero, ten periods apart
    times = end + np.linspace(0.0, 12.0 * 2.0 * np.pi / wanted, 1500)
    moved = hit.modal_state(times)[0][:, 0]
    up = np.flatnonzero((moved[:-1] < 0.0) & (moved[1:] >= 0.0))
    cross = [brentq(lambda t: hit.modal_state([t])[0][0, 0], *times[[i, i + 1]], xtol=1e-15) for i in up[[0, 10]]]
    assert 2.0 * np.pi * 10.0 / (cross[1] - cross[0]) == pytest.approx(wanted, rel=3e-8)  # steps halved: 16 times less
    assert hit.energy_error < 1e-13


def shell(n_modes, radius=2.0, damping_ratio=0.0):
    """A spherical panel on shear diaphragms, struck on its top; from below if the radius is negative."""
    rise = fi.rise.cap(radius, centre=(0.1, 0.15))
    system = fi.assemble(
        fi.mesh.rectangle(*SIDES, size=0.05), PLATE, {"boundary": "hinged"}, rise=rise, in_plane={"boundary": "sliding"}
    )
    return fi.find_modes(system, n_modes=n_modes, damping_ratio=damping_ratio)


def direct(modes, law, speed, until):
    """The same blow by DOP853: when contact begins and ends, and the state at ``until``: hammer, modes, impulse."""
    n, found, row, omega = modes.n_modes, stretch(modes), modes.shape_at([AT])[0], modes.omega
    forms = found.forms
    linear = found.linear if len(found.linear) else np.zeros((len(forms), n))

    def meets(t, x):
        return x[0] - row @ x[2 : 2 + n]

    def rates(t, x):
        q, p, approach = x[2 : 2 + n], x[2 + n : 2 + 2 * n], meets(t, x)
        force = max(0.0, float(law.force(approach, x[1] - row @ p))) if approach > 0.0 else 0.0
        bent, lead = forms @ q, linear @ q
        pulled = -(omega**2) * q - 2.0 * modes.damping_ratio * omega * p + row * force
        pulled -= (lead + bent @ q) @ bent + 0.5 * (bent @ q) @ linear
        return np.concatenate([[x[1], -force / HAMMER.mass], p, pulled, [force]])

    events, x, t = [], np.zeros(3 + 2 * n), 0.0
    x[1], meets.terminal = speed, True
    while t < until:
        meets.direction = -1.0 if len(events) % 2 == 0 else 1.0
        run = solve_ivp(rates, (t, until), x, "DOP853", events=meets, rtol=1e-11, atol=1e-13, first_step=1e-7)
        t, x = run.t[-1], run.y[:, -1]
        if run.status == 1:
            events.append(t)
    return events, x


@pytest.mark.parametrize(
    "law, zeta, radius, speed",
    [
        (fi.Contact.hertz(1e7), 0.0, None, 1.0),
        (fi.Contact.linear(2e5), 0.02, None, 1.0),
        (fi.Contact.hertz(1e7, loss=0.2), 0.0, None, 1.0),
        (fi.Contact.hertz(3e8), 0.0, None, 1.0),  # so stiff that it hits five times
        *((fi.Contact.hertz(1e7), 0.01, radius, 2.0) for radius in (2.0, -2.0, 8.0)),
    ],
)
def test_blow_on_several_modes_is_that_of_a_direct_integration(law, zeta, radius, speed):
    modes = shell(8, radius, zeta) if radius else plate(8, zeta)
    hit = blow(modes, law, speed, tolerance=1e-6)
    until = hit.impacts[-1].end + 1e-3
    events, x = direct(modes, law, speed, until)
    assert radius or hit.displacement([AT], np.linspace(0.0, until, 300)).max() > 0.3 * H
    plain = blow(modes, law, speed, stretching=False)
    assert abs(plain.restitution - hit.restitution) > (3e-3 if radius else 1e-2)  # it matters here
    assert len(events) == 2 * hit.n_impacts - 1
    assert sum(events[0::2]) - sum(events[1::2]) == pytest.approx(hit.contact_time, rel=3e-6)
    assert -x[1] == pytest.approx(hit.restitution * speed, abs=3e-6 * speed)
    assert x[-1] == pytest.approx(hit.impulse, rel=3e-6)
    q, p = hit.modal_state([until])
    assert q[0] == pytest.approx(x[2:10], abs=3e-5 * np.abs(q).max())  # the phase of the fastest mode goes on
    assert p[0] == pytest.approx(x[10:18], abs=3e-5 * np.abs(p).max())
    assert hit.energy_error < 1e-12


@pytest.mark.parametrize("body", [plate, shell])
def test_error_falls_with_the_fourth_power_of_the_step(body):
    # no contact in between: 8 modes stretch each other after a blow
    modes = body(8)
    hit = blow(modes, fi.Contact.hertz(1e7), 2.0, tolerance=1e-3)
    history, times = hit.history, np.array([hit.impacts[-1].end + 2e-3])
    ends = []
    for size in (4e-5, 2e-5, 1e-5, 5e-6):
        finer = replace(history, stretched=replace(history.stretched, base=size))
        ends.append(np.hstack(finer.states(times)))
    apart = [np.abs(one - two).max() for one, two in pairwise(ends)]
    assert 12.0 < apart[0] / apart[1] < 22.0 and 12.0 < apart[1] / apart[2] < 22.0  # 16


@pytest.mark.parametrize("body", [plate, shell])
def test_energy_is_kept_over_ten_thousand_steps(body):
    # a hammer that a constant force presses against the plate, which it leaves again and again
    modes, (law,), base = body(12), locked(table([[1e7, 1.5]])), 3e-5
    still, push, mass = np.zeros(13), 40.0, HAMMER.mass**0.5
    shape, omega = np.append(1.0 / mass, -modes.shape_at([AT])[0])[None], np.append(0.0, modes.omega)
    bias, start_p = np.append(push / mass, still[1:]), np.append(2.0 * mass, still[1:])
    arrays = locked(omega, still, shape, np.zeros(1), bias, law, still, start_p)
    form, flat = locked(*vars(stretch(modes)).values())
    stretching, limits = Stretch(form, flat, 1), Limits(1e-18, 1e-10, 1e4 * base, 0, 100_000)
    steps, q, p, now, _, _, status, *_ = run_energy(KernelSystem(*arrays), stretching, 1, base, limits)
    impacts = record.find_impacts(*locked(steps, now), law, 0.0, 0.0, 0.0)
    assert len(steps) > 10_000 and status == record.HORIZON and len(impacts) > 20
    stretched, start = energies_of_stretching(stretching, q[None])[0], 0.5 * float(start_p @ start_p)
    kept = 0.5 * (p @ p + (omega * q) @ (omega * q)) + stretched + 0.4 * 1e7 * max(0.0, now[0, 0]) ** 2.5
    assert kept - float(bias @ q) == pytest.approx(start, rel=1e-12)
    assert abs(stretched) > 1e-3 * start  # it stretches


def test_a_gentle_blow_is_that_of_a_plate_that_does_not_stretch():
    # the effect falls with the square of the speed
    modes, law = plate(20), fi.Contact.linear(1e5)
    apart = []
    for speed in (3e-2, 3e-3, 3e-5):
        hits = [blow(modes, law, speed, tolerance=1e-6, stretching=stretching) for stretching in (False, True)]
        apart.append(abs(hits[0].restitution - hits[1].restitution))
    assert apart[0] > 1e-4 and apart[0] / apart[1] == pytest.approx(100.0, rel=0.02) and apart[2] < 1e-8


def test_a_body_that_moves_freely_may_be_hit_again():
    # at a speed at which nothing stretches
    modes = fi.analytic.disk(0.2, edge="free", section=PLATE, n_modes=20)
    for at, hammer, n_impacts in (((0.0, 0.0), fi.Striker.rigid(0.5), 4), ((0.1, 0.03), fi.Striker.rigid(0.1), 2)):
        plain, better = (
            fi.strike(modes, hammer, fi.Contact.hertz(1e9), at=at, speed=1e-3, stretching=on, residual=False)
            for on in (False, True)
        )
        assert plain.n_impacts == better.n_impacts == n_impacts
        assert better.restitution == pytest.approx(plain.restitution, abs=2e-4)  # twice the tolerance


def test_a_motion_is_the_same_however_it_is_asked_for():
    hit = blow(plate(8, 0.01), fi.Contact.hertz(3e8), 2.0, tolerance=1e-3)
    times = np.linspace(0.0, 2.0 * hit.impacts[-1].end, 200)
    whole = hit.modal_state(times)[0]
    parts = np.concatenate([hit.modal_state(part)[0] for part in (times[:77], times[77:78], times[78:])])
    backward = hit.modal_state(times[::-1])[0][::-1]
    size = np.abs(whole).max()
    # the stretching forces are found to 1e-15 of themselves from another first guess
    assert parts == pytest.approx(whole, abs=1e-12 * size) and backward == pytest.approx(whole, abs=1e-12 * size)
    rate = np.gradient(hit.displacement([AT], times)[:, 0], times)
    # of 2.6 m/s; the differences are coarse
    assert hit.velocity([AT], times)[1:-1, 0] == pytest.approx(rate[1:-1], abs=0.1)


@pytest.mark.parametrize(
    "law",
    [
        fi.Contact.felt(1e7, 1.5, hysteresis=0.3, relaxation=1e-3),
        fi.Contact.elastic_plastic(1e7, yield_approach=5e-5),
        fi.Contact.layers(1e5, 1.0, depth=1e-4, hard_stiffness=1e8),
        fi.Contact.power(1e6, 1.2, loss=0.5),
    ],
)
def test_every_contact_law_keeps_energy(law):
    hit, stiff = (blow(plate(8, 0.01), law, 2.0, tolerance=1e-4, stretching=on) for on in (True, False))
    assert hit.tolerance_met and hit.finished and hit.energy_error < 1e-9
    assert 1e-3 < abs(hit.restitution - stiff.restitution) < 0.2
    assert sum(hit.energies.values()) == pytest.approx(0.5 * HAMMER.mass * 2.0**2, rel=1e-9)


def test_error_estimates_hold():
    law, how = fi.Contact.hertz(1e7), {"at": AT, "speed": 1.0, "stretching": True}
    hit, fine = (fi.strike(plate(n), HAMMER, law, tolerance=t, **how) for n, t in ((60, 2e-2), (600, 1e-3)))
    true = difference(hit, fine)
    assert true / 3.0 < hit.error.total < 30.0 * true


def test_bodies_that_cannot_are_refused_and_no_rig_measures_one():
    scaled = fi.analytic.rectangle(0.2, 0.2, mass=1.0, first_frequency=100.0, n_modes=4)
    with pytest.raises(ValueError, match="its section is not known"):
        fi.strike(scaled, HAMMER, fi.Contact.linear(1e5), at=(0.1, 0.1), speed=1.0, stretching=True)
    with pytest.raises(ValueError, match="does not stretch"):
        fi.measure(blow(plate(4), fi.Contact.linear(1e5), tolerance=1e-3), rate=25600.0)


def test_scheme_a_converges_to_the_same_blow_and_a_blow_again_is_the_same():
    law = fi.Contact.linear(1e5)
    one, two = (blow(plate(8), law, 2.0, scheme=scheme, tolerance=1e-4) for scheme in ("A", "A4"))
    assert one.restitution == pytest.approx(two.restitution, abs=3e-4)
    assert one.energy_error < 1e-12 and not one.history.stretched.ramp
    again = engine.follow_again(two.history)
    assert again.end_p[0] == pytest.approx(two.history.end_p[0], rel=1e-3)
    assert again.stretched.forms is two.history.stretched.forms


def test_an_early_end_and_a_first_number_of_impacts():
    law = fi.Contact.hertz(3e8)
    assert blow(plate(8), law, 2.0, duration=1e-4, tolerance=1e-3).history.end_time == pytest.approx(1e-4)
    assert blow(plate(8), law, 2.0, max_impacts=1, tolerance=1e-3).n_impacts == 1


def test_a_map_on_a_body_that_stretches_is_made_of_such_blows():
    modes, law = replace(plate(8), stretches=True), fi.Contact.linear(2e5)
    table = fi.sweep(modes, HAMMER, law, at=AT, speed=1.0, over={"speed": [1e-3, 1.0]}, residual=False, tolerance=1e-4)
    alone = blow(plate(8), law, tolerance=1e-4)
    assert table.restitution.values[1] == pytest.approx(alone.restitution, abs=2e-4)
    assert abs(table.restitution.values[1] - table.restitution.values[0]) > 1e-2  # a linear contact knows no speed


def test_sound_after_a_hard_blow_is_that_of_the_motion_that_stretches():
    # the pitch falls as the sound fades: the periods of the first mode get longer
    modes = plate(1, 0.002, sides=(0.2, 0.2))
    hit = blow(modes, fi.Contact.linear(1e5), 3.0, tolerance=1e-4)
    sound = fi.sound.synthesise(hit, duration=0.6)
    up = np.flatnonzero((sound.samples[:-1] < 0.0) & (sound.samples[1:] >= 0.0)) / sound.rate
    early, late = (np.diff(some).mean() for some in (up[:6], up[-6:]))
    times = np.arange(1000, 1400) / sound.rate
    velocity = hit.velocity([AT], hit.time[0] + times)[:, 0]
    assert sound.samples[1000:1400] * sound.full_scale == pytest.approx(velocity, abs=1e-9)
    assert 1.02 * early < late < 1.0 / modes.frequencies[0]


def test_sound_in_air_of_a_plate_that_stretches():
    hits = [blow(plate(4, 0.01), fi.Contact.linear(1e5), speed, tolerance=1e-3) for speed in (1e-3, 1.0)]
    still = blow(plate(4, 0.01), fi.Contact.linear(1e5), 1e-3, tolerance=1e-3, stretching=False)
    one, hard, linear = (fi.sound.radiate(hit, (0.1, 0.1, 0.5), duration=0.02) for hit in (*hits, still))
    size = np.abs(linear.samples).max()
    # finite differences at eight instants per sample against exact derivatives
    assert one.samples == pytest.approx(linear.samples, abs=0.02 * size)
    assert np.abs(hard.samples / 1e3 - linear.samples).max() > 0.05 * size
