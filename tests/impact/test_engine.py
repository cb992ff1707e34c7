"""The contact engine at its narrowest: any step, any power, single precision, long flights, chatter, work that ends."""

import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose
from restarted import measured
from test_collision import PLATE_80, wall_duration
from test_kernels import EPS, drift, each_scheme, plate, run

import fem_impact as fi
from fem_impact.impact import engine
from fem_impact.impact.collision import Touch, collide
from fem_impact.impact.compiled import record


@each_scheme
@pytest.mark.parametrize("exponent", [0.5, 1.0, 1.0001, 1.5, 2.5])
@pytest.mark.parametrize("steps", [0.1, 2.0, 7.3, 100.0])
def test_a_wall_throws_back_all_speed_at_any_step(scheme, exponent, steps):
    """Steps per contact from ten contacts in one step on."""
    k, mass = 1e5, 0.04
    h = wall_duration(k, exponent, mass, 1.0) / steps
    r = run([0.0], [[mass**-0.5]], k=k, exponent=exponent, scheme=scheme, h=h)
    assert r.status == record.FINISHED and np.isfinite(r.steps).all() and (r.force >= 0.0).all()
    assert_allclose(-r.p[0] * mass**-0.5, 1.0, rtol=1e-12)


def test_a_mode_at_rest_at_the_contact_swings_alone():
    omega, shape = plate(8)
    omega, shape, p = np.append(omega, 4321.0), np.append(shape, 0.0), np.append(np.append(0.1, np.zeros(8)), 0.3)
    r = run(omega, shape, k=1e6, exponent=1.5, h=1e-5, p=p)
    wanted = [0.3 * np.sin(4321.0 * r.time), 0.3 * np.cos(4321.0 * r.time)]
    assert_allclose([r.q[-1] * 4321.0, r.p[-1]], wanted, atol=4.0 * EPS * len(r.steps))


@each_scheme
@pytest.mark.parametrize("common", [3.0, -40.0])
def test_common_motion_leaves_each_step_as_it_was(scheme, common):
    bodies, how = ([0.0, 0.0, 900.0, 4000.0], [10.0, -2.0, 3.0, -1.5]), {"k": 1e6, "exponent": 1.5, "scheme": scheme}
    still = run(*bodies, **how, h=1e-5)
    moving = run(*bodies, **how, h=1e-5, p=[0.1 * (1.0 + common), -common / -2.0, 0.0, 0.0])
    assert len(moving.steps) == len(still.steps)
    # approach and rate are differences of displacements that the common motion makes larger by its share
    assert_allclose(moving.force, still.force, rtol=0, atol=1e-13 * abs(common) * still.force.max())


@each_scheme
@pytest.mark.parametrize(("h", "horizon", "least"), [(2e-5, 2e-4, 10), (4e-7, 1.2e-4, 300)])
def test_steps_run_backwards(scheme, h, horizon, least):
    omega, shape = plate(12)
    blow = {"k": 1e6, "exponent": 1.5, "scheme": scheme, "h": h, "offset": 2e-4, "horizon": horizon}
    there = run(omega, shape, **blow)
    back = run(omega, shape, **blow, q=there.q, p=-there.p)
    assert len(there.steps) >= least and there.n_fallback == 0
    assert_allclose(back.q, 0.0, atol=1e-16 if least == 10 else 1e-13)
    assert np.abs(omega * back.q).max() < 1e-13
    assert_allclose(-back.p, np.append(0.1, np.zeros(12)), atol=1e-13)


@pytest.mark.parametrize("stiffness", [1e2, 1e6, 1e10])
def test_rest_stays_for_a_million_steps(stiffness):
    """k h**2 / m up to 1e8 on the weight's own indentation."""
    weight, sunk = 9.81, 9.81 / stiffness
    r = run(
        [0.0], [[1.0]], k=stiffness, q=[sunk], p=[0.0], bias=[weight], h=0.1, horizon=1e5, max_steps=1_000_010
    )  # fmt: skip
    assert len(r.steps) >= 1_000_000
    assert_allclose(r.force, weight, rtol=1e-14)
    assert abs(r.q[0] - sunk) < 1e-9 * sunk + EPS * 0.5 * weight * 0.1**2  # of the free fall


@pytest.mark.parametrize("exponent", [0.5, 0.52, 0.6])
@each_scheme
def test_chatter_of_a_soft_power_comes_to_an_end(exponent, scheme):
    """At such exponents the stiffness is infinite at the touch: a pressed body chatters faster than any step."""
    r = run(
        *plate(6, top=3e4), k=1e2, exponent=exponent, scheme=scheme, speed=1e-6, bias=np.append(1e-4, np.zeros(6)),
        horizon=0.05, max_steps=200_000,
    )  # fmt: skip
    assert r.status == record.HORIZON and (r.force >= 0.0).all()
    assert len(r.steps) < 5000  # of 1e-5 s: passed in steps of the length asked for, and mostly flown over
    assert drift(r) < 1e-12  # rounding of a thousand steps


def test_lossy_chatter_is_passed_in_ever_longer_rests():
    """A weight settles on a soft power: 4500 steps for the time of 3000, 27 500 if rests stay short."""
    r = run(
        [0.0, 580.0, 1170.0], [10.0, -0.654, -2.27], k=7e3, exponent=0.5, loss=0.49, h=5.2e-5, speed=2.9e-8,
        bias=[0.055, 0.0, 0.0], horizon=3000 * 5.2e-5, max_steps=100_000,
    )  # fmt: skip
    assert r.status == record.HORIZON and (r.force >= 0.0).all()
    assert 0 < r.n_blind < len(r.steps) < 9000
    assert r.after < r.before + 1e-12 * r.scale


@pytest.fixture
def runs(monkeypatch):
    """Steps of every run that `collide` makes, in order."""
    taken, whole = [], engine.run_system

    def counted(*arguments):
        history = whole(*arguments)
        taken.append(len(history.steps))
        return history

    monkeypatch.setattr(engine, "run_system", counted)
    return taken


@pytest.mark.parametrize("n_modes", [3, 60])
def test_a_run_that_cannot_end_gives_up_by_its_work(monkeypatch, runs, n_modes):
    """Two clamped bodies set swinging never part: steps times modes are bounded, whatever the clock says."""
    monkeypatch.setattr(engine, "MAX_WORK", 200_000)
    bodies, touches = [measured(3, 1), measured(n_modes, 2)], [Touch(fi.Contact.linear(1e5), 0, 1, [0.0], [0.0])]
    states = [(np.zeros(3), np.full(3, 0.1)), (np.zeros(n_modes), np.zeros(n_modes))]
    most = 200_000 // (3 + n_modes)
    with pytest.raises(fi.SimulationError, match=f"reached in {most} steps.*give a duration of at most"):
        collide(bodies, touches, states=states, residual=False)
    assert runs == []  # the first run was the last


def test_no_run_is_begun_that_cannot_come_to_its_end(monkeypatch, runs):
    """Scheme A would need millions of steps for ten digits: it says so after the last run that fits the bound."""
    monkeypatch.setattr(engine, "MAX_STEPS", 4000)
    blow = {"at": (0.465, 0.3), "speed": 1.0, "max_impacts": 1, "scheme": "A", "tolerance": 1e-7}
    with pytest.raises(fi.SimulationError, match=r"step error stays at .* with \d+ steps; leave out scheme"):
        fi.strike(PLATE_80, fi.Striker.rigid(0.01), fi.Contact.hertz(1e7), **blow)
    assert len(runs) >= 2
    assert 2000 < runs[-1] <= 4000  # the next would have been cut short
    assert sum(runs) < 2 * runs[-1]


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5])
@pytest.mark.parametrize("ratio", [1e-4, 1.0, 30.0])
def test_preload_lets_two_masses_go_with_all_it_held(exponent, ratio):
    pressed, k, mass = 1e-4, 1e6, 0.1
    law, reduced = fi.Contact.power(k, exponent, gap=-pressed), mass * ratio / (1.0 + ratio)
    hit = collide([fi.Modes.rigid(mass), fi.Modes.rigid(mass * ratio)], [Touch(law, 0, 1)], tolerance=1e-8)
    stored = k * pressed ** (exponent + 1.0) / (exponent + 1.0)
    first = -np.sqrt(2.0 * stored / mass * ratio / (1.0 + ratio))
    assert hit.finished
    assert_allclose(hit.speeds, [first, -first / ratio], rtol=1e-12)  # energy and momentum leave nothing else
    # half of a blow that presses the two as deep
    whole = wall_duration(k, exponent, reduced, -first * (1.0 + 1.0 / ratio))
    assert_allclose(hit.contact_time, 0.5 * whole, rtol=1e-8)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_preload_held_by_a_force_stays(exponent):
    k, pressed = 1e6, 1e-4
    touch, hold = Touch(fi.Contact.power(k, exponent, gap=-pressed), 0, 1), k * pressed**exponent
    hit = collide([fi.Modes.rigid(0.1), fi.Modes.rigid(0.3)], [touch], forces=[hold, -hold], duration=1.0)
    assert np.abs(hit.speeds).max() < 1e-9 * hold / 0.1  # [m/s] of a second of free motion under that force
    assert_allclose(hit.force, hold, rtol=1e-9)


FLIGHTS = """
import fem_impact as fi
plate = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=8)
for gap in (1.0, 1e9):
    try:
        fi.strike(plate, fi.Striker.rigid(0.03), fi.Contact.linear(1e4, gap=gap), at=(0.13, 0.1), speed=1.0,
                  tolerance=1.0)
    except fi.SimulationError:
        pass
"""


def test_flights_of_any_length_stay_within_their_tables():
    """Python notices an index out of bounds; compiled, a flight wrote beyond an array and some ended the process."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", FLIGHTS], env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


GRAZING = [  # mass [kg] and bending frequency [Hz] of the stick, stiffness [N/m], impacts: gaps of 5 to 15 us
    (0.04345637583892617, 10e3, 266241.8345392927, 3),
    (0.04220805369127517, 10e3, 577493.4746952576, 4),
    (0.18826174496644296, 10e3, 170323.24457873483, 2),
    (0.1583020134228188, 600.0, 138273.66677129985, 2),
]


@pytest.mark.parametrize(("mass", "frequency", "stiffness", "n_impacts"), GRAZING)
def test_contacts_that_barely_open_are_told_from_those_that_do_not(mass, frequency, stiffness, n_impacts):
    """Two runs agreed on one contact less, and on a time in contact wrong by 5e-3."""
    light = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300)
    blow = light, fi.Striker.stick(mass, frequency), fi.Contact.linear(stiffness)
    fine, *hits = (fi.strike(*blow, at=(0.465, 0.3), speed=1.0, tolerance=t) for t in (1e-7, 1e-2, 1e-3, 1e-4))
    assert fine.n_impacts == n_impacts
    for hit in hits:
        assert hit.n_impacts == n_impacts
        assert_allclose(hit.contact_time, fine.contact_time, rtol=hit.tolerance)


def test_what_stands_for_modes_left_out_does_not_rattle_in_fine_steps():
    """Its little mass on a stiff contact took 4 008 steps; the restitution is that of these, -0.3642307."""
    plate = fi.analytic.rectangle(0.5, 0.4, mass=0.1, first_frequency=100.0, n_modes=20)
    contact = fi.Contact.linear(1e7, loss=0.5)
    with pytest.warns(fi.ToleranceWarning):  # twenty modes are too few
        hit = fi.strike(
            plate, fi.Striker.rigid(0.01), contact, at=(0.11, 0.13), speed=1.0, tolerance=1e-3, max_impacts=1
        )
    assert len(hit.history.steps) < 300 and hit.error.step < 1e-4
    assert hit.restitution == pytest.approx(-0.3642307, abs=hit.error.step)


def test_no_run_ends_in_a_step_as_short_as_rounding():
    """It held nothing but rounding: of 300 durations of a lossy blow six were refused for errors of the peak force."""
    bodies, touch = [fi.Modes.rigid(0.1)], fi.Touch(fi.Contact.linear(1e5, loss=0.1), 0, None)
    for n in range(20, 120):
        hit = fi.collide(bodies, [touch], speeds=[1.0], duration=n * 1.3e-5, dt=1.3e-5, tolerance=0.1)
        assert len(hit.history.steps) == n and hit.history.end_time == n * 1.3e-5
