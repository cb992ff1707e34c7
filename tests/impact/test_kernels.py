"""The compiled loops against mathematics: exact propagation, energy, momentum, force never pulling, events."""

import os
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from warming import locked

from fem_impact.impact.compiled import arrays, build, collocation, energy, layout, propagation, record, schemes
from fem_impact.impact.compiled import law as laws
from fem_impact.impact.compiled.bundles import KernelSystem, Limits
from fem_impact.impact.compiled.laws.base import Spring
from fem_impact.impact.engine import gauss

EPS = np.finfo(float).eps


@njit
def mode_moments(w, z, h, out_moments, work):
    return propagation.mode_moments(w, z, h, out_moments, work)


@njit
def waves(angle, out_sin, out_cos):
    propagation.waves(angle, out_sin, out_cos)


@njit
def decays(exponent, out_decay):
    propagation.decays(exponent, out_decay)


def run(
    omega, shape, *, k=1e5, exponent=1.0, loss=0.0, compliance=0.0, zeta=None, offset=0.0, bias=None, q=None, p=None,
    speed=1.0, scheme="A4", h=1e-5, horizon=np.inf, n_max=0, max_steps=20000, noise=(0.0, 0.0),
):  # fmt: skip
    """Run a kernel; mode 0 is a striker at ``speed`` unless p is given. Energies before, after and of all there is."""
    omega = np.asarray(omega, float)
    shape = np.atleast_2d(np.asarray(shape, float))
    m = len(shape)
    zeta = np.zeros_like(omega) if zeta is None else np.broadcast_to(np.asarray(zeta, float), omega.shape).copy()
    offset = np.broadcast_to(np.asarray(offset, float), (m,)).copy()
    bias = np.zeros_like(omega) if bias is None else np.asarray(bias, float)
    law = laws.table(list(zip(*(np.broadcast_to(x, (m,)) for x in (k, exponent, loss, compliance)))))
    q = np.zeros_like(omega) if q is None else np.asarray(q, float)
    if p is None:
        p = np.zeros_like(omega)
        p[0] = speed / shape[0, 0]
    p = np.asarray(p, float)
    state = locked(omega, zeta, shape, offset, bias, law, q, p)
    limits = Limits(*noise, horizon, n_max, max_steps)
    if scheme == "collocation":
        out = collocation.run_collocation(KernelSystem(*state), *gauss(5), h, 1e-10 * abs(speed), limits)
    else:
        out = energy.run_energy(KernelSystem(*state), None, int(scheme == "A4"), h, limits)
    steps, q1, p1, now, done, time, status, n_fallback, n_blind, _ = out

    def stored(d):
        return laws.stored(np.atleast_1d(d).astype(float), law)

    def modal(q, p):
        return 0.5 * (p @ p + (omega * q) @ (omega * q)) - bias @ q

    width = 6 if scheme == "collocation" else 5
    forces = steps[:, 6::width] + 0.5 * steps[:, 7::width] if scheme != "collocation" else None
    return SimpleNamespace(
        steps=steps, q=q1, p=p1, now=now, done=done, time=time, status=status, n_fallback=n_fallback, n_blind=n_blind,
        force=forces, before=modal(q, p) + stored(offset + shape @ q), after=modal(q1, p1) + stored(now[0]),
        scale=0.5 * (p1 @ p1 + (omega * q1) @ (omega * q1)) + abs(bias @ q1) + stored(now[0]),
        momentum=p1 - (p + bias * time - (steps[:, 1] @ forces) @ shape) if forces is not None else None,
    )  # fmt: skip


def drift(result):
    """Energy change over all the energy there is."""
    return abs(result.after - result.before) / max(result.scale, abs(result.before), 1e-300)


def plate(n_modes, seed=0, top=1e5):
    """A striker of 10 g and a body of n_modes modes up to ``top`` rad/s: frequencies and signed shapes."""
    rng = np.random.default_rng(seed)
    return np.append(0.0, np.sort(rng.uniform(0.01, 1.0, n_modes)) * top), np.append(
        10.0, -rng.normal(0.0, 2.0, n_modes)
    )


# --- exact propagation -----------------------------------------------------------------------------------------------


def exact_moments(w, z, h, count):
    """Moments of the impulse response by their recursion, in 400 digits."""
    with mp.workdps(400):
        w, z, h = mp.mpf(w), mp.mpf(z), mp.mpf(h)
        th, x = w * h, z * w * h
        if z < 1:
            root = w * mp.sqrt(1 - z * z)
            s, c = mp.exp(-x) * mp.sin(root * h) / root, mp.exp(-x) * mp.cos(root * h)
        elif z == 1:
            s, c = mp.exp(-x) * h, mp.exp(-x)
        else:
            root = w * mp.sqrt(z * z - 1)
            s, c = mp.exp(-x) * mp.sinh(root * h) / root, mp.exp(-x) * mp.cosh(root * h)
        moments, before = [s / h], c - z * w * s
        for k in range(count):
            new = (1 / mp.factorial(k) - 2 * x * moments[k] - before) / th**2
            before = moments[k]
            moments.append(new)
        return [float(v) for v in (c + z * w * s, s, c - z * w * s)], [float(v) for v in moments]


@pytest.mark.parametrize("share", [1e-3, 0.3, 0.7, 0.999])
def test_moments_of_slow_modes_are_those_of_a_sine(share):
    """Integrals of the impulse response of undamped modes with powers of time, by series and in closed form."""
    th = share * propagation.SERIES_END
    found = np.empty((7, 1))
    build.plain(propagation.near_moments)(np.array([th / 1e-5]), 1e-5, np.zeros(1), 0, found)
    with mp.workdps(60):
        th = mp.mpf(th)
        wanted = [(th - mp.sin(th)) / th**3, (th * th / 2 - 1 + mp.cos(th)) / th**4]
    assert_allclose(found[5:, 0], [float(each) for each in wanted], rtol=1e-15)  # eps was measured


@pytest.mark.parametrize("zeta", [0.0, 1e-3, 0.3, 0.9, 1.0 - 1e-9, 1.0, 1.0 + 1e-7, 1.15, 1.3, 3.0, 50.0, 1e3, 1e6])
@pytest.mark.parametrize("angle", [1e-9, 1e-3, 0.999, 1.001, 2.5, 4.9, 5.1, 10.0, 100.0, 1e4])
def test_moments_are_exact_to_rounding(zeta, angle):
    w = 1000.0
    moments, work = np.empty(7), np.empty((2, 6))
    state = mode_moments(w, zeta, angle / w, moments, work)
    wanted_state, wanted = exact_moments(w, zeta, angle / w, 6)
    # 16 eps; 6e-16 was measured. Near its zeros the first moment keeps the phase's rounding only
    assert_allclose(moments[1:], wanted[1:], rtol=4e-15, atol=4e-15 * moments[2])
    # the phase w h itself is rounded: eps times the angle
    assert_allclose(np.array(state) * [1.0, w, 1.0], np.array(wanted_state) * [1.0, w, 1.0], atol=EPS * (2.0 + angle))


@pytest.mark.parametrize("zeta", [0.0, 0.01, 0.5, 0.95, 2.0])
@pytest.mark.parametrize("h", [1e-9, 1e-6, 2e-5, 1e-4, 1e-2, 10.0])
def test_fast_lanes_agree_with_the_single_mode(zeta, h):
    omega = np.append(0.0, np.geomspace(1.0, 1.2e5, 60))
    damping = np.append(0.0, np.full(60, zeta))
    table = np.empty((propagation.N_TABLE, 61))
    propagation.step_table(omega, damping, h, table)
    moments, work = np.empty(4), np.empty((2, 3))
    for n, (w, z) in enumerate(zip(omega, damping)):
        a11, _, a22 = mode_moments(w, z, h, moments, work)
        slack = 8.0 * EPS * (1.0 + w * h)  # rounding of the phase
        assert_allclose(table[[0, 3], n], [a11, a22], rtol=0, atol=slack)
        assert_allclose(table[4, n] / h**2, moments[1], rtol=slack, atol=slack / max(1.0, w * h) ** 2)
        assert_allclose(table[10, n] / h**2, moments[2], rtol=slack)
        assert_allclose(table[11, n] / h**2, moments[3] - 0.5 * moments[2], rtol=slack, atol=4.0 * EPS)


@pytest.mark.parametrize("zeta", [0.0, 0.01, 0.5, 0.9])
@pytest.mark.parametrize("h", [1e-9, 1e-6, 2e-5, 1e-4, 1e-2])
def test_tables_by_arrays_agree_with_the_fast_lanes(zeta, h):
    omega = np.append(0.0, np.geomspace(1.0, 1.2e5, 60))
    damping = np.append(0.0, np.full(60, zeta))
    table, lanes = np.empty((propagation.N_TABLE, 61)), np.empty((layout.N_LANE, 61))
    propagation.step_table(omega, damping, h, table)
    arrays.lane_table(omega, damping, h, True, lanes)
    slack = 8.0 * EPS * (1.0 + omega * h)  # rounding of the phase
    one, far = np.ones_like(omega), np.maximum(1.0, omega * h)  # the moments fall with the square of the phase
    size = np.stack([one, h / far, far / h, one, h / far, h / far, h / far])
    wanted = np.stack([*table[:4], table[9], table[10] / h, table[11] / h])
    assert np.all(np.abs(lanes - wanted) <= slack * size)


def test_waves_and_decays_are_within_two_units_in_the_last_place():
    rng = np.random.default_rng(1)
    angle = np.concatenate([rng.uniform(0.0, 1e6, 50000), rng.uniform(0.0, 10.0, 50000), np.arange(999) * np.pi / 2])
    sine, cosine = np.empty_like(angle), np.empty_like(angle)
    waves(angle, sine, cosine)
    assert_allclose(sine, np.sin(angle), rtol=0, atol=1.5 * EPS)
    assert_allclose(cosine, np.cos(angle), rtol=0, atol=1.5 * EPS)
    exponent = np.append(rng.uniform(0.0, 700.0, 5000), [0.0, 800.0])
    decay = np.empty_like(exponent)
    decays(exponent, decay)
    assert_allclose(decay, np.exp(-exponent) * (exponent < 700.0), rtol=2.0 * EPS)


# --- cases 5, 6, 8, 9, 10: any step, any stiffness, any modes --------------------------------------------------------


@pytest.mark.parametrize("scheme", ["A", "A4"])
@pytest.mark.parametrize("k", [1e3, 1e6, 1e10])
@pytest.mark.parametrize("h", [1e-8, 1e-6, 1e-4, 1e-2, 1e-1])
@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.7])
def test_energy_and_momentum_hold_at_any_step(scheme, k, h, exponent):
    omega, shape = plate(20, seed=int(np.log10(k)))
    r = run(omega, shape, k=k, exponent=exponent, scheme=scheme, h=h, horizon=2000.0 * h, max_steps=2000)
    assert np.isfinite(r.q).all()
    assert (r.force >= 0.0).all()
    # rounding of each step; the force's rounding acts on rigid displacements: eps f |u q| / E
    noise = EPS * (1.0 + r.force.max(initial=0.0) * np.abs(shape) @ np.abs(r.q) / r.before)
    assert drift(r) <= 100.0 * noise * np.sqrt(len(r.steps) + 1.0)
    assert abs(r.momentum[0]) <= 20.0 * EPS * np.sqrt(len(r.steps) + 1.0) * 0.2


@pytest.mark.parametrize("scheme", ["A", "A4"])
@pytest.mark.parametrize("angle", [1e-9, 1e-3, np.pi, 2.0 * np.pi, 3.0 * np.pi, 1e5])
def test_resonant_steps_stay_bounded(scheme, angle):
    h = 2e-5
    omega, shape = np.array([0.0, angle / h]), np.array([10.0, -3.0])
    r = run(omega, shape, k=1e6, scheme=scheme, h=h, horizon=300 * h)
    assert drift(r) < 1e-13  # rounding of 300 steps
    assert np.abs(omega * r.q).max() <= np.sqrt(2.0 * r.before) * (1.0 + 1e-12)


def test_several_rigid_motions_are_exact():
    shape = np.array([10.0, -2.0, -1.5, 0.0])
    r = run(np.zeros(4), shape, k=1e6, exponent=1.5, p=[0.1, 0.0, 0.05, 7.0])
    assert drift(r) < 1e-14
    assert np.abs(r.momentum).max() < 1e-15
    assert r.p[3] == 7.0  # rests at the contact: untouched bit for bit


def test_degenerate_and_split_modes_do_not_change_the_force():
    omega, shape = plate(12)
    one = run(omega, shape, k=1e6, h=2e-5)
    split = np.append(shape, shape[5] * 0.8)
    split[5] *= 0.6  # u**2 = u1**2 + u2**2
    order = np.random.default_rng(0).permutation(13)
    order = np.concatenate([[0], order[order > 0], [13]])
    two = run(np.append(omega, omega[5])[order], split[order] * np.where(order == 3, -1.0, 1.0), k=1e6, h=2e-5)
    assert_allclose(two.force, one.force, rtol=0, atol=1e-14 * one.force.max())  # sums in another order
    assert_allclose(two.time, one.time, rtol=1e-14)


# --- cases 7, 12, 13: free flight, scaling, reversal -----------------------------------------------------------------


def test_long_free_flight_keeps_energy_and_phase():
    omega = np.array([0.0, 1234.5, 9999.0])
    q, p = np.array([-1.0, 1e-3, 2e-4]), np.array([0.0, 0.3, -0.7])
    t = np.linspace(0.0, 100.0, 1001)
    out_q, out_p = np.empty((1001, 3)), np.empty((1001, 3))
    nothing = np.zeros((0, 3 + 5))
    law = laws.table([[0.0]])
    scene = KernelSystem(omega, np.zeros(3), np.ones((1, 3)), np.zeros(1), np.zeros(3), law, q, p)
    propagation.replay(scene, nothing, 2, t, out_q, out_p)
    sine = np.where(omega > 0.0, np.sin(omega * t[:, None]) / np.maximum(omega, 1.0), t[:, None])
    wanted = q * np.cos(omega * t[:, None]) + p * sine
    assert_allclose(out_q, wanted, atol=1e6 * EPS * 1e-3)  # phase omega t rounded: 1e6 eps of the amplitude
    energy = 0.5 * (out_p**2 + (omega * out_q) ** 2).sum(axis=1)
    assert_allclose(energy, energy[0], rtol=1e-14)


@pytest.mark.parametrize("speed", [1e-12, 1e-3, 1e3, 1e6])
def test_linear_force_scales_with_speed(speed):
    omega, shape = plate(12)
    one, other = (run(omega, shape, k=1e6, h=2e-5, speed=v) for v in (1.0, speed))
    assert_allclose(other.force / speed, one.force, atol=1e-14 * one.force.max())  # rounding through 40 steps
    assert_allclose(other.time, one.time, rtol=1e-14)


@pytest.mark.parametrize("exponent", [1.2, 1.5, 3.0])
def test_power_law_depends_on_stiffness_and_speed_in_one_way(exponent):
    omega, shape = plate(12)
    one = run(omega, shape, k=1e7, exponent=exponent, h=2e-5)
    other = run(omega, shape, k=1e7 * 100.0 ** (1.0 - exponent), exponent=exponent, h=2e-5, speed=100.0)
    assert_allclose(
        other.force / 100.0, one.force, atol=5e-14 * one.force.max()
    )  # pow() is good to some eps; 7e-15 was measured


@pytest.mark.parametrize("scheme", ["A", "A4"])
def test_time_runs_backwards(scheme):
    omega, shape = plate(12)
    there = run(omega, shape, k=1e6, exponent=1.5, scheme=scheme, h=2e-5, offset=2e-4, horizon=2e-4)
    back = run(
        omega, shape, k=1e6, exponent=1.5, scheme=scheme, h=2e-5, offset=2e-4, horizon=2e-4, q=there.q, p=-there.p
    )
    assert there.n_fallback == 0
    assert_allclose(back.q, 0.0, atol=1e-16)
    assert_allclose(-back.p, np.append(0.1, np.zeros(12)), atol=1e-13)


# --- cases 14 to 17: damping and loss --------------------------------------------------------------------------------


@pytest.mark.parametrize("zeta", [1e-3, 0.1, 0.999, 1.0, 1.5, 1e3])
@pytest.mark.parametrize("scheme", ["A", "A4"])
def test_damping_never_gives_energy(zeta, scheme):
    omega, shape = plate(12)
    last = np.inf
    for n in range(1, 40):
        r = run(omega, shape, k=1e6, zeta=zeta, scheme=scheme, h=2e-5, max_steps=n)
        assert r.after <= last * (1.0 + 4.0 * EPS)
        last = r.after


@pytest.mark.slow
def test_modal_damping_takes_what_its_integral_says():
    """One mode, one step at a time: E0 - E = integral of 2 zeta omega q'^2, by quadrature of the exact motion."""
    omega, zeta, u, k = np.array([0.0, 3000.0]), np.array([0.0, 0.2]), np.array([[10.0, -4.0]]), 1e5
    r = run(omega, u, k=k, zeta=zeta, h=5e-5)
    x, weight = np.polynomial.legendre.leggauss(20)
    times = (r.steps[:, :1] + 0.5 * (x + 1.0) * r.steps[:, 1:2]).ravel()
    q, p = np.empty((len(times), 2)), np.empty((len(times), 2))
    law, start = laws.table([[0.0]]), np.array([0.1, 0.0])
    scene = KernelSystem(omega, zeta, u, np.zeros(1), np.zeros(2), law, np.zeros(2), start)
    propagation.replay(scene, r.steps, 2, times, q, p)
    taken = (0.5 * r.steps[:, 1:2] * weight * (2.0 * 0.2 * 3000.0 * p[:, 1] ** 2).reshape(len(r.steps), -1)).sum()
    assert_allclose(taken, r.before - r.after, rtol=1e-12)  # quadrature exact to rounding


@pytest.mark.parametrize("number", [1e-6, 1e-2, 1.0, 30.0, 1e3])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize(("scheme", "h", "accuracy"), [("A4", 1e-5, 1e-5), ("collocation", 1e-3, 1e-8)])
def test_hunt_and_crossley_on_a_wall(number, exponent, scheme, h, accuracy):
    """loss (v0 + v1) = ln[(1 + loss v0) / (1 - loss v1)], whatever stiffness, exponent and mass."""
    shape, k = [[2.0]], 1e5
    r = run([0.0], shape, k=k, exponent=exponent, loss=number, scheme=scheme, h=h)
    t = brentq(lambda t: np.log1p(number) + t - number + np.expm1(-t), 0.0, 2.0 * number + 1.0, xtol=1e-14)
    assert abs(-r.p[0] * 2.0 - -np.expm1(-t) / number) <= accuracy


@pytest.mark.parametrize("loss", [1.0, 1e3, 1e12])
def test_loss_never_pulls(loss):
    """Pressed in and torn apart by a strong pull."""
    r = run([0.0], [[1.0]], k=1e4, loss=loss, q=[1e-3], p=[-5.0], bias=[-1e3], h=1e-4, horizon=0.01, scheme="A4")
    assert (r.force >= 0.0).all()
    assert r.after <= r.before * (1.0 + 1e-12) + 1e-15
    assert np.isfinite(r.p).all()


# --- cases 18, 20, 21, 22, 23, 24, 25: grazing, release, rest --------------------------------------------------------


@pytest.mark.parametrize("depth", [1e-12, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("scheme", ["A", "A4"])
def test_grazing_touch_is_continuous_and_keeps_energy(depth, scheme):
    """A mode swings up to a wall and over it by a hair."""
    omega = np.array([1000.0])
    r = run(omega, [[1.0]], k=1e5, q=[0.0], p=[1.0], offset=-1e-3 * (1.0 - depth), h=1e-4, horizon=5e-3, scheme=scheme)
    miss = run(omega, [[1.0]], k=1e5, q=[0.0], p=[1.0], offset=-1e-3 * (1.0 + depth), h=1e-4, horizon=5e-3)
    assert not miss.force.any()
    assert drift(r) < 1e-13
    assert r.force.any()
    free = np.sin(1000.0 * r.time) / 1000.0
    # the speed at touch is sqrt(2 depth), and so are impulse and later deviation: at most twice that amplitude
    assert abs(r.q[0] - free) < 4.0 * np.sqrt(2.0 * depth) * 1e-3


def test_release_branch_meets_the_smooth_one():
    spring = Spring(1e5, 1.5, 0.0, 0.0, laws.POWER, np.inf, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    start, solve = build.plain(laws.point_at)(1e-4, spring), build.plain(schemes.solve_constant)
    b = 1e-9
    edge = b * start.energy / start.approach  # free end approach at which the step ends with the contact just open
    below = solve(start, edge * (1.0 - 1e-9), b, 1.0, spring)
    above = solve(start, edge * (1.0 + 1e-9), b, 1.0, spring)
    assert_allclose(below[1], above[1], rtol=1e-7)
    assert below[0].approach <= 0.0 <= above[0].approach


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_touching_at_rest(exponent):
    still = run([0.0], [[1.0]], k=1e4, exponent=exponent, p=[0.0], h=1e-4, horizon=1.0)
    assert not still.force.any()
    assert still.q[0] == 0.0
    pressed = run([0.0], [[1.0]], k=1e4, exponent=exponent, p=[0.0], bias=[9.81], h=1e-4, horizon=10.0, loss=20.0)
    assert_allclose(pressed.force[-1], 9.81, rtol=1e-6)  # it comes to rest on its weight


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5])
def test_preload_turns_into_speed(exponent):
    r = run([0.0], [[1.0]], k=1e5, exponent=exponent, q=[1e-3], p=[0.0], h=1e-3)
    stored = 1e5 * 1e-3 ** (exponent + 1.0) / (exponent + 1.0)
    assert_allclose(0.5 * r.p[0] ** 2, stored, rtol=1e-12)
    assert r.p[0] < 0.0


@pytest.mark.parametrize("stiffness", [1e2, 1e6, 1e10])
def test_static_rest_is_a_fixed_point(stiffness):
    """k h**2 / m up to 1e8 on the weight's own indentation."""
    weight = 9.81
    r = run(
        [0.0], [[1.0]], k=stiffness, q=[weight / stiffness], p=[0.0], bias=[weight], h=0.1, horizon=2000.0,
    )  # fmt: skip
    assert_allclose(r.force, weight, rtol=1e-9)  # rounding of 20000 steps; no step is lost
    assert (
        abs(r.q[0] - weight / stiffness) < 1e-9 * weight / stiffness + EPS * 0.5 * weight * 0.1**2
    )  # of the free fall


def test_bouncing_ball_keeps_its_height():
    r = run([0.0], [[1.0]], k=1e5, exponent=1.5, offset=-0.05, p=[0.0], bias=[9.81], h=3e-3, n_max=300)
    assert r.status == record.IMPACTS
    assert abs(r.after - r.before) < 1e-11 * 0.5 * r.p[0] ** 2  # rounding of 300 bounces
    height = 0.5 * r.p[0] ** 2 / 9.81
    assert_allclose(height, 0.05, rtol=1e-11)


def test_lossy_ball_comes_to_rest_in_finite_steps():
    r = run([0.0], [[1.0]], k=1e5, exponent=1.5, loss=0.5, offset=-0.05, p=[0.0], bias=[9.81], h=3e-3, horizon=20.0)
    assert r.status == record.HORIZON
    assert r.after < r.before
    assert len(r.steps) < 20000
    assert abs(r.p[0]) < 1e-3  # from 1 m/s at the first touch


@pytest.mark.slow
def test_repeated_impacts_on_a_vibrating_plate_keep_energy():
    omega, shape = plate(30)
    rng = np.random.default_rng(5)
    p = np.append(0.0, rng.normal(0.0, 0.3, 30))
    bias = np.append(5.0, np.zeros(30))  # keeps the striker coming back
    r = run(omega, shape, k=1e6, exponent=1.5, p=p, bias=bias, offset=-1e-4, h=2e-5, horizon=30.0, max_steps=100000)
    assert len(r.steps) > 10000
    assert drift(r) < 1e-11  # rounding of 1e5 steps


# --- cases 34, 36, 38 to 41, 43, 45 ----------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", ["A", "A4", "collocation"])
def test_compliance_in_series_softens_a_linear_contact(scheme):
    omega, shape = plate(12)
    series = run(omega, shape, k=1e6, compliance=1e-6, scheme=scheme, h=2e-5)
    single = run(omega, shape, k=1e6 / (1.0 + 1e6 * 1e-6), scheme=scheme, h=2e-5)
    assert_allclose(series.p, single.p, atol=1e-13)
    assert_allclose(series.time, single.time, rtol=1e-12)


def test_compliance_in_series_keeps_energy_of_a_hertz_contact():
    omega, shape = plate(12)
    r = run(omega, shape, k=1e9, exponent=1.5, compliance=1e-7, h=1e-5)
    assert drift(r) < 1e-14 * np.sqrt(len(r.steps))


@pytest.mark.parametrize("scheme", ["A", "A4", "collocation"])
def test_two_half_springs_at_one_point_are_one(scheme):
    omega, shape = plate(12)
    one = run(omega, shape, k=1e6, exponent=1.5, scheme=scheme, h=2e-5)
    two = run(omega, [shape, shape], k=5e5, exponent=1.5, scheme=scheme, h=2e-5)
    # the coupling matrix is singular; located events and solver tolerance remain
    assert_allclose(two.p, one.p, atol=1e-9)


@pytest.mark.parametrize("scheme", ["A", "A4", "collocation"])
def test_far_contacts_of_separate_bodies_do_not_mix(scheme):
    omega, shape = plate(6)
    omega2, shape2 = plate(6, seed=1)
    both = np.zeros((2, 14))
    both[0, :7], both[1, 7:] = shape, shape2
    p = np.zeros(14)
    p[0], p[7] = 0.1, 0.2
    pair = run(np.concatenate([omega, omega2]), both, k=1e6, p=p, scheme=scheme, h=1e-5)
    left, right = run(omega, shape, k=1e6, scheme=scheme, h=1e-5), run(omega2, shape2, k=1e6, speed=2.0, h=1e-5)
    speeds = np.array([pair.p[0], pair.p[7]])
    # each one's release cuts the other's step: they agree to the step error
    assert_allclose(speeds, [left.p[0], right.p[0]], atol={"A": 1e-4, "A4": 1e-6, "collocation": 1e-6}[scheme])


@pytest.mark.parametrize("cases", [100, pytest.param(1000, marks=pytest.mark.slow)])
def test_final_separation_is_final(cases):
    """Where the certificate was given, ten thousand looks later nothing has touched."""
    rng = np.random.default_rng(11)
    given_out = 0
    for _ in range(cases):
        n = int(rng.integers(1, 12))
        omega = np.append(0.0, np.sort(rng.uniform(100.0, 2e4, n)))
        shape = np.append(rng.uniform(3.0, 30.0), -rng.normal(0.0, 3.0, n))
        r = run(omega, shape, k=10.0 ** rng.uniform(3, 8), exponent=1.5, h=2e-5, max_steps=3000)
        if r.status != record.FINISHED:
            continue
        given_out += 1
        t = np.linspace(0.0, 0.1, 10001)[:, None]
        q = r.q * np.cos(omega * t) + r.p * np.where(omega > 0.0, np.sin(omega * t) / np.maximum(omega, 1.0), t)
        assert (q[1:] @ shape).max() < 0.0
    assert given_out > 0.5 * cases


def test_no_certificate_while_a_force_pushes_back():
    r = run([0.0], [[1.0]], k=1e5, bias=[9.81], h=1e-4, horizon=3.0)
    assert r.status == record.HORIZON
    assert (r.force > 0.0).any()


@pytest.mark.parametrize("shrink", [1.0, 0.25])
def test_brief_second_contact_is_not_missed(shrink):
    """The plate overtakes the leaving striker with a swing of 60 us, seen at steps of 100 and 25 us alike."""
    omega, shape = np.array([0.0, 2.0 * np.pi * 1000.0]), np.array([1.0, -1.0])
    q, p = np.array([0.0, 0.0]), np.array([-0.06, 1.0])
    r = run(omega, shape, k=1e4, q=q, p=p, offset=-1.1e-4, h=1e-4 * shrink, horizon=4e-3)
    swing = [1.1e-4 + 0.06 * t + np.sin(omega[1] * t) / omega[1] for t in np.linspace(0.0, 1e-3, 4001)]
    assert min(swing) < 0.0  # the free motion overlaps for a while
    assert (r.force > 0.0).any()
    fine = run(omega, shape, k=1e4, q=q, p=p, offset=-1.1e-4, h=1e-6, horizon=4e-3)
    assert_allclose(r.p, fine.p, atol=2e-4)


def test_absurd_step_falls_back_and_keeps_energy():
    rng = np.random.default_rng(2)
    total = 0
    for _ in range(200):
        n = int(rng.integers(1, 30))
        omega = np.append(0.0, np.sort(10.0 ** rng.uniform(2, 6, n)))
        shape = np.append(10.0, rng.normal(0.0, 3.0, n))
        r = run(omega, shape, k=10.0 ** rng.uniform(3, 10), exponent=1.5, h=0.1, horizon=10.0, max_steps=300)
        total += r.n_fallback
        assert drift(r) < 1e-11
        assert (r.force >= 0.0).all()
    assert total > 0  # scheme A4 did hand steps to A


@pytest.mark.parametrize("speed", [1e-300, 1e-12, 1e6, 1e100])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_extreme_speeds(speed, exponent):
    r = run([0.0, 1e3], [[3.0, -1.0]], k=1e5, exponent=exponent, speed=speed, h=1e-4, horizon=1e6)
    assert np.isfinite(r.p).all()
    assert (r.force >= 0.0).all()
    assert abs(r.p[0]) <= speed / 3.0 * (1.0 + 1e-12)


def test_speed_zero_does_nothing():
    r = run([0.0, 1e3], [[3.0, -1.0]], speed=0.0, horizon=1.0)
    assert not r.force.any()


def test_origin_far_from_the_contact_costs_known_digits():
    """A gap of 1 km before a contact of some um: energy is lost to rounding eps x 1 km x f, no worse."""
    near = run([0.0], [[1.0]], k=1e6, h=1e-4)
    far = run([0.0], [[1.0]], k=1e6, h=1e-4, offset=-1e3, q=[1e3])
    assert_allclose(far.p, near.p, rtol=1e3 * EPS * near.force.max() / near.before * 100.0)


def test_restart_and_change_of_step_keep_energy():
    omega, shape = plate(12)
    q = p = None
    start = None
    for scheme, h, n in (("A4", 2e-5, 4), ("A", 7e-6, 5), ("A4", 3e-5, 3), ("A", 1e-4, 10)):
        r = run(omega, shape, k=1e6, exponent=1.5, scheme=scheme, h=h, q=q, p=p, max_steps=n)
        start = r.before if start is None else start
        q, p = r.q, r.p
        assert_allclose(r.after, start, rtol=1e-13)


@pytest.mark.parametrize("scheme", ["A", "A4"])
def test_convolution_of_forces_gives_the_same_approach(scheme):
    """Kernel form: approach = free motion - sum of shifted step responses times past forces, to rounding."""
    omega, shape = plate(12)
    h = 1e-5
    r = run(omega, shape, k=1e6, exponent=1.5, scheme=scheme, h=h, max_steps=20, zeta=0.01)
    n = len(r.steps)
    assert (r.steps[:, 1] == h).all()
    constant, ramp = np.zeros(n + 1), np.zeros(n + 1)
    table = np.empty((propagation.N_TABLE, len(omega)))
    propagation.step_table(omega, np.full(len(omega), 0.01), h, table)
    for out, rows in ((constant, (4, 5)), (ramp, (6, 7))):
        x, v = table[rows[0]] * shape, table[rows[1]] * shape
        for m in range(n):
            out[m] = shape @ x
            x, v = table[0] * x + table[1] * v, table[2] * x + table[3] * v
    slope = r.steps[:, 7]
    for j in range(n - 1):
        past = sum(constant[j - i] * r.force[i, 0] + ramp[j - i] * slope[i] for i in range(j + 1))
        assert_allclose((j + 1) * h - past, r.steps[j + 1, 3], rtol=0, atol=1e-13 * r.steps[:, 3].max())


# --- case 44: negative controls --------------------------------------------------------------------------------------


def test_quadratised_scheme_fails_the_same_checks():
    """psi = sqrt(2 V) updated linearly: not iterative, but it pulls and drifts from the law."""
    k, m, h = 1e6, 0.1, 1e-4
    x, v, psi, force, worst = 0.0, 1.0, 0.0, [], 0.0
    for _ in range(60):
        # force = g psi_mean with g = d psi / d x at the start of the step
        g = np.sqrt(k) * 1.25 * max(x, 0.0) ** 0.25 / np.sqrt(1.25)
        step = h * (v - 0.5 * h / m * g * psi) / (1.0 + 0.25 * h * h * g * g / m)
        mean = psi + 0.5 * g * step
        force.append(g * mean)
        v -= h / m * g * mean
        x, psi = x + step, psi + g * step
        worst = max(worst, abs(0.5 * psi**2 - k * max(x, 0.0) ** 2.5 / 2.5) / (0.5 * m))
    assert min(force) < 0.0 or worst > 1e-3


def test_two_step_form_grows_at_resonance():
    """q[n+1] = 2 cos(th) q[n] - q[n-1] has a double root -1 at th = pi: a rounding error grows step by step."""
    before, now = 0.0, 1e-6
    for _ in range(10000):
        before, now = now, 2.0 * np.cos(np.pi) * now - before
    assert abs(now) > 1e3 * 1e-6


def test_strang_kick_is_unstable_in_stiff_contact():
    omega, shape = plate(40, top=1e5)
    k, h = 1e8, 2e-5
    q, p = np.zeros(41), np.append(0.1, np.zeros(40))
    table = np.empty((propagation.N_TABLE, 41))
    propagation.step_table(omega, np.zeros(41), h, table)
    for _ in range(50):
        p = p - 0.5 * h * k * shape * max(shape @ q, 0.0)
        q, p = table[0] * q + table[1] * p, table[2] * q + table[3] * p
        p = p - 0.5 * h * k * shape * max(shape @ q, 0.0)
    energy = 0.5 * (p @ p + (omega * q) @ (omega * q)) + 0.5 * k * max(shape @ q, 0.0) ** 2
    assert abs(energy / 0.005 - 1.0) > 1e-2
    assert drift(run(omega, shape, k=k, h=h)) < 1e-12


# --- properties over random scenes -----------------------------------------------------------------------------------


@st.composite
def scenes(draw):
    """Any bodies, laws, steps: arguments of `run`."""
    rng = np.random.default_rng(draw(st.integers(0, 2**31)))
    n = draw(st.sampled_from([1, 2, 5, 20, 100, 500]))
    omega = np.sort(10.0 ** rng.uniform(1.0, 6.0, n))
    omega[: draw(st.integers(0, 2))] = 0.0
    if n > 4 and draw(st.booleans()):
        omega[3] = omega[4]
    m = draw(st.integers(1, 3))
    shape = np.insert(rng.normal(size=(m, n)), 0, 10.0 ** draw(st.floats(-3.5, 3.5)), axis=1)
    shape[:, 1:][:, rng.random(n) < 0.1] = 0.0
    speed = 10.0 ** draw(st.floats(-12.0, 6.0))
    zeta = np.where(omega > 0.0, rng.choice([0.0, 0.02, 0.999, 1.5, 50.0], n), 0.0) if draw(st.booleans()) else 0.0
    return {
        "omega": np.append(0.0, omega),
        "shape": shape,
        "k": 10.0 ** rng.uniform(3.0, 12.0, m),
        "exponent": rng.choice([1.0, 1.5, 1.0 + 2.0 * rng.random()], m),
        "loss": rng.choice([0.0, 10.0 ** rng.uniform(-3.0, 3.0)], m) if draw(st.booleans()) else 0.0,
        "zeta": np.append(0.0, zeta * np.ones(n)),
        "offset": -rng.choice([0.0, 10.0 ** rng.uniform(-9.0, -2.0)], m),
        "speed": speed,
        "scheme": draw(st.sampled_from(["A", "A4"])),
        "h": 10.0 ** draw(st.floats(-9.0, -1.0)),
    }


def check_invariants(scene):
    """No NaN, no pull, energy and momentum to rounding."""
    r = run(**scene, horizon=1000.0 * scene["h"], max_steps=1000)
    assert np.isfinite(r.q).all()
    assert np.isfinite(r.steps).all()
    assert (r.force >= 0.0).all()
    slack = np.sqrt(len(r.steps) + 1.0)
    # rounding of the force acts on all displacements: eps f sum |u q| / E, case by case (notes on pitfalls)
    largest = (np.abs(np.atleast_2d(scene["shape"])) @ np.abs(r.q)).max() + np.abs(scene["offset"]).max()
    # contacts that hold each other: each alone would bring the energy (h f u)^2, of which little is left; largest drift
    # of 20 000 random pairs: 440 times this noise
    impulses = (r.steps[:, 1, None] * r.force) @ np.abs(np.atleast_2d(scene["shape"]))
    acting = 100.0 * r.force.max(initial=0.0) * largest + (impulses**2).max(initial=0.0)
    noise = EPS * (10.0 + acting / max(r.before, 1e-300))
    assert r.after - r.before <= 1e3 * noise * slack * max(r.scale, r.before)
    lossless = not np.any(scene["loss"]) and not np.any(scene["zeta"])
    if lossless:
        assert abs(r.after - r.before) <= 1e3 * noise * slack * max(r.scale, r.before)
    rigid = scene["omega"] == 0.0
    given_momentum = np.abs(r.momentum[rigid]).max()
    impulse = ((r.steps[:, 1] @ r.force) @ np.abs(scene["shape"])).max() + scene["speed"] / scene["shape"][0, 0]
    assert given_momentum <= 100.0 * EPS * slack * impulse


@settings(max_examples=20, deadline=None)
@given(scenes())
def test_any_scene_keeps_the_invariants(scene):
    check_invariants(scene)


@pytest.mark.slow
@settings(max_examples=600, deadline=None)
@given(scenes())
def test_many_scenes_keep_the_invariants(scene):
    check_invariants(scene)


PLAIN = """
import json
import numpy as np
from warming import locked
from fem_impact.impact.compiled.bundles import KernelSystem, Limits
from fem_impact.impact.compiled.collocation import run_collocation
from fem_impact.impact.compiled.energy import run_energy
from fem_impact.impact.compiled.law import table
from fem_impact.impact.compiled.propagation import replay
from fem_impact.impact.engine import gauss

def after(run, n_coefficients):
    times = np.linspace(0.0, 2e-3, 9)
    q, p = np.empty((9, 3)), np.empty((9, 3))
    replay(KernelSystem(*scene), *locked(run[0]), n_coefficients, times, q, p)
    return [len(run[0]), *run[2], *(1e3 * q).ravel(), *p.ravel()]

w, z = np.array([0.0, 4e3, 9e3]), np.zeros(3)
start = np.array([0.1, 0.0, 0.0])
shapes = np.array([[10.0, -2.0, 1.0], [10.0, 1.0, -2.0]])
law = table([[1e6, 1.5, 0.0, 1e-9], [1e6, 1.2, 0.1]])
found, limits = [], Limits(0.0, 0.0, 3e-3, 0, 500)
for m, zeta, bias in (
    (1, z, z), (1, np.array([0.0, 0.95, 1.3]), z), (2, np.array([0.0, 0.01, 0.2]), np.array([0.1, 1.0, -2.0]))
):
    body = locked(w, zeta, shapes[:m])
    scene = *body, *locked(np.array([-1e-5, -3e-5])[:m], bias, law[:m], z, start)
    found += after(run_energy(KernelSystem(*scene), None, 1, 5e-5, limits), 2)
    found += after(run_collocation(KernelSystem(*scene), *gauss(4), 2e-4, 1e-4, limits), 4)
print(json.dumps(list(map(float, found))))
"""


def test_plain_python_form_agrees():
    """The same kernels, or their array forms, without compilation, in a process of its own."""
    answers = [
        subprocess.run(
            [sys.executable, "-c", PLAIN], capture_output=True, text=True, check=True, timeout=600,
            env={**os.environ, "NUMBA_DISABLE_JIT": flag, "PYTHONPATH": os.pathsep.join(sys.path)},
        ).stdout
        for flag in ("0", "1")
    ]  # fmt: skip
    compiled, plain = (np.array(eval(text)) for text in answers)
    assert_allclose(plain, compiled, rtol=0, atol=1e-13)  # fused multiply-adds and reordered sums


@pytest.mark.skipif(not build.COMPILED, reason="plain Python holds the interpreter lock by nature")
def test_a_run_leaves_other_threads_free():
    def press(count):
        run([0.0, *np.linspace(1e3, 1e5, 300)], [1.0, *np.full(300, -0.05)], k=1e4, h=1e-7, max_steps=count)

    press(10)  # compiled or loaded
    thread = threading.Thread(target=press, args=(100_000,))  # some 0.1 s
    thread.start()
    ticks = 0
    while thread.is_alive():
        time.sleep(1e-3)
        ticks += 1
    assert ticks > 10  # with the lock held the first sleep lasts as long as the run: 1 or 2


@pytest.mark.parametrize("exponent", [1.0, 1.5, 3.0])
def test_forces_of_a_stiff_contact_are_found_however_slowly(exponent):
    """One node of one contact, f = k (d - c f)**a: far off, each step of Newton leaves 1 - 1/a of what is missing."""
    c, d, k = 1e-6, 1e-3, 1e4 * 1e3 / 1e-3**exponent
    nodes, free, inner = np.zeros((4, 1, 1)), np.zeros((2, 1, 1)), np.zeros((2, 1, 1, 1, 1))
    free[collocation.MOVED], inner[collocation.MOVED] = d, c
    room = SimpleNamespace(
        matrix=np.zeros((2, 1)), nodes=nodes, active=np.zeros(1, int), free=free, contacts=np.zeros((8, 1))
    )
    contacts = SimpleNamespace(law=laws.table([[k, exponent]]), pressed=np.ones(1, bool))
    assert build.plain(collocation.solve_collocation)(contacts, room, inner)
    force = nodes[collocation.FORCES, 0, 0]
    exact = brentq(lambda f: f - k * (d - c * f) ** exponent, 0.0, d / c, xtol=1e-12)
    assert_allclose(force, exact, rtol=1e-9)  # that of the search for the exact force, and rounding of d - c f
