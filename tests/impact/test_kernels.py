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
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from warming import locked

from fem_impact.impact.compiled import arrays, build, energy, exact, frame, layout, propagation, record
from fem_impact.impact.compiled import law as laws
from fem_impact.impact.compiled.bundles import KernelSystem, Limits

EPS = np.finfo(float).eps
MODE_MOMENTS = build.plain(propagation.mode_moments)
each_scheme = pytest.mark.parametrize("scheme", ["A", "A4"])


def run(
    omega, shape, *, k=1e5, exponent=1.0, loss=0.0, compliance=0.0, zeta=0.0, offset=0.0, bias=0.0, q=0.0, p=None,
    speed=1.0, scheme="A4", h=1e-5, horizon=np.inf, n_max=0, max_steps=20000,
):  # fmt: skip
    """Run a kernel; mode 0 is a striker at ``speed`` unless p is given. Energies before, after and of all there is."""
    omega, shape = np.asarray(omega, float), np.atleast_2d(np.asarray(shape, float))
    n, m = len(omega), len(shape)
    law = laws.table(list(zip(*(np.broadcast_to(x, (m,)) for x in (k, exponent, loss, compliance)))))
    p = np.append(speed / shape[0, 0], np.zeros(n - 1)) if p is None else np.asarray(p, float)
    zeta, bias, q = (np.broadcast_to(np.asarray(x, float), (n,)) for x in (zeta, bias, q))
    offset = np.broadcast_to(np.asarray(offset, float), (m,))
    scene = KernelSystem(*locked(omega, zeta, shape, offset, bias, law, q, p))
    limits = Limits(0.0, 0.0, float(horizon), n_max, max_steps)
    out = energy.run_energy(scene, None, int(scheme == "A4"), h, limits)
    steps, q1, p1, now, done, time, status, n_fallback, n_blind, _ = out

    def stored(d):
        return laws.stored_energies(np.atleast_1d(d).astype(float), law)

    def modal(q, p):
        return 0.5 * (p @ p + (omega * q) @ (omega * q)) - bias @ q

    forces = steps[:, 6::5] + 0.5 * steps[:, 7::5]
    return SimpleNamespace(
        steps=steps, q=q1, p=p1, now=now, done=done, time=time, status=status, n_fallback=n_fallback, n_blind=n_blind,
        law=law, force=forces, before=modal(q, p) + stored(offset + shape @ q), after=modal(q1, p1) + stored(now[0]),
        scale=0.5 * (p1 @ p1 + (omega * q1) @ (omega * q1)) + abs(bias @ q1) + stored(now[0]),
        momentum=p1 - (p + bias * time - (steps[:, 1] @ forces) @ shape),
    )  # fmt: skip


def drift(result):
    """Energy change over all the energy there is."""
    return abs(result.after - result.before) / max(result.scale, abs(result.before), 1e-300)


def plate(n_modes, seed=0, top=1e5):
    """A striker of 10 g and a body of n_modes modes up to ``top`` rad/s: frequencies and signed shapes."""
    rng = np.random.default_rng(seed)
    omega = np.append(0.0, np.sort(rng.uniform(0.01, 1.0, n_modes)) * top)
    return omega, np.append(10.0, -rng.normal(0.0, 2.0, n_modes))


def step_table(omega, zeta, h):
    """Coefficients of one step, (N_TABLE, n_modes)."""
    table = np.empty((propagation.N_TABLE, len(omega)))
    propagation.step_table(omega, np.broadcast_to(zeta, omega.shape).copy(), h, table)
    return table


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


def test_moments_of_slow_modes_are_those_of_a_sine():
    """Integrals of the impulse response of undamped modes with powers of time, by series and in closed form."""
    angles, found = np.array([1e-3, 0.3, 0.7, 0.999]) * propagation.SERIES_END, np.empty((7, 4))
    build.plain(propagation.near_moments)(angles / 1e-5, 1e-5, np.zeros(4), 0, found)
    with mp.workdps(60):
        wanted = [((th - mp.sin(th)) / th**3, (th * th / 2 - 1 + mp.cos(th)) / th**4) for th in map(mp.mpf, angles)]
    assert_allclose(found[5:].T, np.array(wanted, float), rtol=1e-15)  # eps was measured


@pytest.mark.parametrize("zeta", [0.0, 1e-3, 0.3, 0.9, 1.0 - 1e-9, 1.0, 1.0 + 1e-7, 1.15, 1.3, 3.0, 50.0, 1e3, 1e6])
def test_moments_are_exact_to_rounding(zeta):
    w, moments, work = 1000.0, np.empty(7), np.empty((2, 6))
    for angle in (1e-9, 1e-3, 0.999, 1.001, 2.5, 4.9, 5.1, 10.0, 100.0, 1e4):
        state = MODE_MOMENTS(w, zeta, angle / w, moments, work)
        wanted_state, wanted = exact_moments(w, zeta, angle / w, 6)
        # 16 eps; 6e-16 was measured. Near its zeros the first moment keeps the phase's rounding only
        assert_allclose(moments[1:], wanted[1:], rtol=4e-15, atol=4e-15 * moments[2], err_msg=angle)
        # the phase w h itself is rounded: eps times the angle
        size = [1.0, w, 1.0]
        assert_allclose(np.multiply(state, size), np.multiply(wanted_state, size), atol=EPS * (2.0 + angle))


@pytest.mark.parametrize("zeta", [0.0, 0.01, 0.5, 0.9, 0.95, 2.0])
@pytest.mark.parametrize("h", [1e-9, 1e-6, 2e-5, 1e-4, 1e-2, 10.0])
def test_fast_lanes_agree_with_the_single_mode_and_tables_by_arrays_with_them(zeta, h):
    omega = np.append(0.0, np.geomspace(1.0, 1.2e5, 60))
    damping = np.append(0.0, np.full(60, zeta))
    table, moments, work = step_table(omega, damping, h), np.empty(4), np.empty((2, 3))
    for n, (w, z) in enumerate(zip(omega, damping)):
        a11, _, a22 = MODE_MOMENTS(w, z, h, moments, work)
        slack = 8.0 * EPS * (1.0 + w * h)  # rounding of the phase
        assert_allclose(table[[0, 3], n], [a11, a22], rtol=0, atol=slack)
        assert_allclose(table[4, n] / h**2, moments[1], rtol=slack, atol=slack / max(1.0, w * h) ** 2)
        assert_allclose(table[10, n] / h**2, moments[2], rtol=slack)
        assert_allclose(table[11, n] / h**2, moments[3] - 0.5 * moments[2], rtol=slack, atol=4.0 * EPS)
    if zeta <= 0.9 and h <= 1e-2:
        lanes = np.empty((layout.N_LANE, 61))
        arrays.lane_table(omega, damping, h, True, lanes)
        one, far = np.ones_like(omega), np.maximum(1.0, omega * h)  # the moments fall with the square of the phase
        size = np.stack([one, h / far, far / h, one, h / far, h / far, h / far])
        wanted = np.stack([*table[:4], table[9], table[10] / h, table[11] / h])
        assert np.all(np.abs(lanes - wanted) <= 8.0 * EPS * (1.0 + omega * h) * size)


@njit
def waves_and_decays(angle, out_sin, out_cos, exponent, out_decay):
    propagation.waves(angle, out_sin, out_cos)
    propagation.decays(exponent, out_decay)


def test_waves_and_decays_are_within_two_units_in_the_last_place():
    rng = np.random.default_rng(1)
    angle = np.concatenate([rng.uniform(0.0, 1e6, 50000), rng.uniform(0.0, 10.0, 50000), np.arange(999) * np.pi / 2])
    exponent = np.append(rng.uniform(0.0, 700.0, 5000), [0.0, 800.0])
    sine, cosine, decay = np.empty_like(angle), np.empty_like(angle), np.empty_like(exponent)
    waves_and_decays(angle, sine, cosine, exponent, decay)
    assert_allclose(sine, np.sin(angle), rtol=0, atol=1.5 * EPS)
    assert_allclose(cosine, np.cos(angle), rtol=0, atol=1.5 * EPS)
    assert_allclose(decay, np.exp(-exponent) * (exponent < 700.0), rtol=2.0 * EPS)


@each_scheme
@pytest.mark.parametrize("k", [1e3, 1e6, 1e10])
@pytest.mark.parametrize("h", [1e-8, 1e-4, 1e-1])
@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.7])
def test_energy_and_momentum_hold_at_any_step(scheme, k, h, exponent):
    omega, shape = plate(20, seed=int(np.log10(k)))
    r = run(omega, shape, k=k, exponent=exponent, scheme=scheme, h=h, horizon=2000.0 * h, max_steps=2000)
    assert np.isfinite(r.q).all() and (r.force >= 0.0).all()
    # rounding of each step; the force's rounding acts on rigid displacements: eps f |u q| / E
    noise = EPS * (1.0 + r.force.max(initial=0.0) * np.abs(shape) @ np.abs(r.q) / r.before)
    assert drift(r) <= 100.0 * noise * np.sqrt(len(r.steps) + 1.0)
    assert abs(r.momentum[0]) <= 20.0 * EPS * np.sqrt(len(r.steps) + 1.0) * 0.2


@each_scheme
@pytest.mark.parametrize("angle", [1e-9, 1e-3, np.pi, 2.0 * np.pi, 3.0 * np.pi, 1e5])
def test_resonant_steps_stay_bounded(scheme, angle):
    h = 2e-5
    omega = np.array([0.0, angle / h])
    r = run(omega, [10.0, -3.0], k=1e6, scheme=scheme, h=h, horizon=300 * h)
    assert drift(r) < 1e-13  # rounding of 300 steps
    assert np.abs(omega * r.q).max() <= np.sqrt(2.0 * r.before) * (1.0 + 1e-12)


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


@pytest.mark.parametrize(("scheme", "order"), [("A", 2), ("A4", 4)])
@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize(("k", "exponent"), [(1e5, 1.0), (1e7, 1.5)])
def test_order_in_pressed_contact(scheme, order, loss, k, exponent):
    """A mass of 10 g from 0.2 mm at 0.6 m/s over 0.1 ms, against DOP853."""

    def rates(_, z):
        return [z[1], -k * z[0] ** exponent * (1.0 + loss * z[1]) / 0.01]

    exact = solve_ivp(rates, (0.0, 1e-4), [2e-4, 0.6], "DOP853", rtol=1e-13, atol=1e-18).y[:, -1]
    how, errors = {"k": k, "exponent": exponent, "loss": loss, "scheme": scheme, "horizon": 1e-4}, []
    for count in (8, 16):
        r = run([0.0], [[10.0]], q=[2e-5], p=[0.06], h=1e-4 / count, **how)
        errors.append(np.hypot(10.0 * r.p[0] - exact[1], (10.0 * r.q[0] - exact[0]) * np.sqrt(k / 0.01)))
    assert len(r.steps) == 16 and abs(np.log2(errors[0] / errors[1]) - order) < 0.35


def moved(omega, q, p, t):
    """Displacements of undamped modes without forces."""
    return q * np.cos(omega * t) + p * np.where(omega > 0.0, np.sin(omega * t) / np.maximum(omega, 1.0), t)


def replayed(omega, zeta, shape, q, p, steps, times):
    """Modal states at times of a run's steps."""
    n, found = len(omega), np.empty((2, len(times), len(omega)))
    arrays = locked(omega, np.broadcast_to(zeta, (n,)), shape, [0.0], np.zeros(n), laws.table([[0.0]]), q, p)
    propagation.replay(KernelSystem(*arrays), *locked(steps), times, *found)
    return found


def test_long_free_flight_keeps_energy_and_phase():
    omega = np.array([0.0, 1234.5, 9999.0])
    q, p, t = np.array([-1.0, 1e-3, 2e-4]), np.array([0.0, 0.3, -0.7]), np.linspace(0.0, 100.0, 1001)
    out_q, out_p = replayed(omega, 0.0, np.ones((1, 3)), q, p, np.zeros((0, 8)), t)
    assert_allclose(out_q, moved(omega, q, p, t[:, None]), atol=1e6 * EPS * 1e-3)  # phase omega t rounded: 1e6 eps
    energy = 0.5 * (out_p**2 + (omega * out_q) ** 2).sum(axis=1)
    assert_allclose(energy, energy[0], rtol=1e-14)


@pytest.mark.parametrize(("exponent", "speed", "slower", "rounding"), [
    (1.0, 1e-12, 1.0, 1e-14), (1.0, 1e6, 1.0, 1e-14),  # rounding through 40 steps
    (1.2, 100.0, 1.0, 5e-14), (1.5, 100.0, 1.0, 5e-14), (3.0, 100.0, 1.0, 5e-14),  # pow(); 7e-15 was measured
    (1.5, 1.0, 1e3, 1e-11), (1.0, 1e-3, 1e3, 1e-11),  # milliseconds for seconds: pow() and other roundings
])  # fmt: skip
def test_units_of_length_and_time_do_not_matter(exponent, speed, slower, rounding):
    """A blow of another speed through another stiffness is the same in another unit of length."""
    omega, shape = plate(12)
    how, length = {"k": 1e7, "exponent": exponent, "h": 2e-5}, speed * slower
    one = run(omega, shape, **how)
    how |= {"k": 1e7 * length ** (1.0 - exponent) / slower**2, "h": 2e-5 * slower, "speed": speed}
    other = run(omega / slower, shape, **how)
    assert_allclose(other.force * slower**2 / length, one.force, rtol=0, atol=rounding * one.force.max())
    assert_allclose(other.time / slower, one.time, rtol=1e-14 if slower == 1.0 else 1e-12)


@each_scheme
@pytest.mark.parametrize("zeta", [1e-3, 0.1, 0.999, 1.0, 1.5, 1e3])
def test_damping_never_gives_energy(zeta, scheme):
    omega, shape = plate(12)
    left = [run(omega, shape, k=1e6, zeta=zeta, scheme=scheme, h=2e-5, max_steps=n).after for n in range(1, 40)]
    assert (np.diff(left) <= 4.0 * EPS * np.abs(left[:-1])).all()


def test_modal_damping_takes_what_its_integral_says():
    """One mode, one step at a time: E0 - E = integral of 2 zeta omega q'^2, by quadrature of the exact motion."""
    omega, zeta, u, start = np.array([0.0, 3000.0]), np.array([0.0, 0.2]), np.array([[10.0, -4.0]]), [0.1, 0.0]
    r = run(omega, u, k=1e5, zeta=zeta, h=5e-5)
    x, weight = np.polynomial.legendre.leggauss(20)
    times = (r.steps[:, :1] + 0.5 * (x + 1.0) * r.steps[:, 1:2]).ravel()
    p = replayed(omega, zeta, u, np.zeros(2), start, r.steps, times)[1]
    taken = (0.5 * r.steps[:, 1:2] * weight * (2.0 * 0.2 * 3000.0 * p[:, 1] ** 2).reshape(len(r.steps), -1)).sum()
    assert_allclose(taken, r.before - r.after, rtol=1e-12)  # quadrature exact to rounding


@pytest.mark.parametrize("number", [1e-6, 1e-2, 1.0, 30.0, 1e3])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_hunt_and_crossley_on_a_wall(number, exponent):
    """loss (v0 + v1) = ln[(1 + loss v0) / (1 - loss v1)], whatever stiffness, exponent and mass."""
    r = run([0.0], [[2.0]], k=1e5, exponent=exponent, loss=number, h=1e-5)
    t = brentq(lambda t: np.log1p(number) + t - number + np.expm1(-t), 0.0, 2.0 * number + 1.0, xtol=1e-14)
    assert abs(-r.p[0] * 2.0 - -np.expm1(-t) / number) <= 1e-5


@pytest.mark.parametrize("loss", [1.0, 1e3, 1e12])
def test_loss_never_pulls(loss):
    """Pressed in and torn apart by a strong pull."""
    r = run([0.0], [[1.0]], k=1e4, loss=loss, q=[1e-3], p=[-5.0], bias=[-1e3], h=1e-4, horizon=0.01)
    assert (r.force >= 0.0).all() and np.isfinite(r.p).all()
    assert r.after <= r.before * (1.0 + 1e-12) + 1e-15


@each_scheme
@pytest.mark.parametrize("depth", [1e-12, 1e-9, 1e-6, 1e-3])
def test_grazing_touch_is_continuous_and_keeps_energy(depth, scheme):
    """A mode swings up to a wall and over it by a hair."""
    swing = {"omega": [1000.0], "shape": [[1.0]], "p": [1.0], "k": 1e5, "h": 1e-4, "horizon": 5e-3}
    r = run(**swing, offset=-1e-3 * (1.0 - depth), scheme=scheme)
    assert not run(**swing, offset=-1e-3 * (1.0 + depth)).force.any()
    assert drift(r) < 1e-13 and r.force.any()
    # the speed at touch is sqrt(2 depth), and so are impulse and later deviation: at most twice that amplitude
    assert abs(r.q[0] - np.sin(1000.0 * r.time) / 1000.0) < 4.0 * np.sqrt(2.0 * depth) * 1e-3


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_touching_at_rest(exponent):
    still = run([0.0], [[1.0]], k=1e4, exponent=exponent, p=[0.0], h=1e-4, horizon=1.0)
    assert not still.force.any() and still.q[0] == 0.0
    pressed = run([0.0], [[1.0]], k=1e4, exponent=exponent, p=[0.0], bias=[9.81], h=1e-4, horizon=10.0, loss=20.0)
    assert_allclose(pressed.force[-1], 9.81, rtol=1e-6)  # it comes to rest on its weight


def test_lossy_ball_comes_to_rest_in_finite_steps():
    r = run([0.0], [[1.0]], k=1e5, exponent=1.5, loss=0.5, offset=-0.05, p=[0.0], bias=[9.81], h=3e-3, horizon=20.0)
    assert r.status == record.HORIZON and r.after < r.before and len(r.steps) < 20000
    assert abs(r.p[0]) < 1e-3  # from 1 m/s at the first touch


@each_scheme
def test_compliance_in_series_softens_a_linear_contact_and_keeps_energy_of_a_hertz_one(scheme):
    omega, shape = plate(12)
    series = run(omega, shape, k=1e6, compliance=1e-6, scheme=scheme, h=2e-5)
    single = run(omega, shape, k=1e6 / (1.0 + 1e6 * 1e-6), scheme=scheme, h=2e-5)
    assert_allclose(series.p, single.p, atol=1e-13)
    assert_allclose(series.time, single.time, rtol=1e-12)
    hertz = run(omega, shape, k=1e9, exponent=1.5, compliance=1e-7, scheme=scheme, h=1e-5)
    assert drift(hertz) < 1e-14 * np.sqrt(len(hertz.steps))


@each_scheme
def test_two_half_springs_at_one_point_are_one_and_a_third_that_never_closes_changes_nothing(scheme):
    omega, shape = plate(12)
    how = {"exponent": 1.5, "scheme": scheme, "h": 2e-5}
    one, two = run(omega, shape, k=1e6, **how), run(omega, [shape, shape], k=5e5, **how)
    # the coupling matrix is singular; located events and solver tolerance remain
    assert_allclose(two.p, one.p, atol=1e-9)
    far = run(omega, [shape, shape, 0.3 * shape], k=5e5, offset=[0.0, 0.0, -1.0], **how)
    assert_allclose(far.p, two.p, atol=1e-12)


@each_scheme
def test_far_contacts_of_separate_bodies_do_not_mix(scheme):
    (omega, shape), (omega2, shape2) = plate(6), plate(6, seed=1)
    both, p = np.zeros((2, 14)), np.zeros(14)
    both[0, :7], both[1, 7:], p[0], p[7] = shape, shape2, 0.1, 0.2
    pair = run(np.concatenate([omega, omega2]), both, k=1e6, p=p, scheme=scheme, h=1e-5)
    left, right = run(omega, shape, k=1e6, scheme=scheme, h=1e-5), run(omega2, shape2, k=1e6, speed=2.0, h=1e-5)
    # each one's release cuts the other's step: they agree to the step error
    assert_allclose(pair.p[[0, 7]], [left.p[0], right.p[0]], atol=1e-4 if scheme == "A" else 1e-6)


def test_final_separation_is_final():
    """Where the certificate was given, ten thousand looks later nothing has touched."""
    rng = np.random.default_rng(11)
    given_out, t = 0, np.linspace(0.0, 0.1, 10001)[1:, None]
    for _ in range(100):
        n = int(rng.integers(1, 12))
        omega = np.append(0.0, np.sort(rng.uniform(100.0, 2e4, n)))
        shape = np.append(rng.uniform(3.0, 30.0), -rng.normal(0.0, 3.0, n))
        r = run(omega, shape, k=10.0 ** rng.uniform(3, 8), exponent=1.5, h=2e-5, max_steps=3000)
        if r.status == record.FINISHED:
            given_out += 1
            assert (moved(omega, r.q, r.p, t) @ shape).max() < 0.0
    assert given_out > 50


def test_no_certificate_while_a_force_pushes_back():
    r = run([0.0], [[1.0]], k=1e5, bias=[9.81], h=1e-4, horizon=3.0)
    assert r.status == record.HORIZON and (r.force > 0.0).any()


@pytest.mark.parametrize("shrink", [1.0, 0.25])
def test_brief_second_contact_is_not_missed(shrink):
    """The plate overtakes the leaving striker with a swing of 60 us, seen at steps of 100 and 25 us alike."""
    omega, q, p = np.array([0.0, 2.0 * np.pi * 1000.0]), np.zeros(2), np.array([-0.06, 1.0])
    r, fine = (run(omega, [1.0, -1.0], k=1e4, p=p, offset=-1.1e-4, h=h, horizon=4e-3) for h in (1e-4 * shrink, 1e-6))
    free = moved(omega, q, p, np.linspace(0.0, 1e-3, 4001)[:, None]) @ [1.0, -1.0] - 1.1e-4
    assert free.max() > 0.0  # the free motion overlaps for a while
    assert (r.force > 0.0).any()
    assert_allclose(r.p, fine.p, atol=2e-4)


def test_absurd_step_falls_back_and_keeps_energy():
    rng, total = np.random.default_rng(2), 0
    for _ in range(200):
        n = int(rng.integers(1, 30))
        omega = np.append(0.0, np.sort(10.0 ** rng.uniform(2, 6, n)))
        shape = np.append(10.0, rng.normal(0.0, 3.0, n))
        r = run(omega, shape, k=10.0 ** rng.uniform(3, 10), exponent=1.5, h=0.1, horizon=10.0, max_steps=300)
        total += r.n_fallback
        assert drift(r) < 1e-11 and (r.force >= 0.0).all()
    assert total > 0  # scheme A4 did hand steps to A


@pytest.mark.parametrize("speed", [0.0, 1e-300, 1e-12, 1e6, 1e100])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_extreme_speeds(speed, exponent):
    r = run([0.0, 1e3], [[3.0, -1.0]], k=1e5, exponent=exponent, speed=speed, h=1e-4, horizon=1e6 if speed else 1.0)
    assert np.isfinite(r.p).all() and (r.force >= 0.0).all() and (speed or not r.force.any())
    assert abs(r.p[0]) <= speed / 3.0 * (1.0 + 1e-12)


def test_origin_far_from_the_contact_costs_known_digits():
    """A gap of 1 km before a contact of some um: energy is lost to rounding eps x 1 km x f, no worse."""
    near, far = (run([0.0], [[1.0]], k=1e6, h=1e-4, offset=-x, q=[x]) for x in (0.0, 1e3))
    assert_allclose(far.p, near.p, rtol=1e3 * EPS * near.force.max() / near.before * 100.0)


def test_restart_and_change_of_step_keep_energy():
    state, start = {}, None
    for scheme, h, n in (("A4", 2e-5, 4), ("A", 7e-6, 5), ("A4", 3e-5, 3), ("A", 1e-4, 10)):
        r = run(*plate(12), k=1e6, exponent=1.5, scheme=scheme, h=h, max_steps=n, **state)
        start, state = start or r.before, {"q": r.q, "p": r.p}
        assert_allclose(r.after, start, rtol=1e-13)


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
    assert np.isfinite(r.q).all() and np.isfinite(r.steps).all() and (r.force >= 0.0).all()
    slack, size = np.sqrt(len(r.steps) + 1.0), np.abs(scene["shape"])
    # rounding of the force acts on all displacements: eps f sum |u q| / E, case by case (notes on pitfalls)
    largest = (size @ np.abs(r.q)).max() + np.abs(scene["offset"]).max()
    # contacts that hold each other: each alone would bring the energy (h f u)^2, of which little is left; largest drift
    # of 20 000 random pairs: 440 times this noise
    acting = 100.0 * r.force.max(initial=0.0) * largest
    acting += (((r.steps[:, 1, None] * r.force) @ size) ** 2).max(initial=0.0)
    allowed = 1e3 * EPS * (10.0 + acting / max(r.before, 1e-300)) * slack * max(r.scale, r.before)
    assert r.after - r.before <= allowed
    if not np.any(scene["loss"]) and not np.any(scene["zeta"]):
        assert abs(r.after - r.before) <= allowed
    impulse = ((r.steps[:, 1] @ r.force) @ size).max() + scene["speed"] / scene["shape"][0, 0]
    assert np.abs(r.momentum[scene["omega"] == 0.0]).max() <= 100.0 * EPS * slack * impulse


@pytest.mark.parametrize("examples", [20, pytest.param(250, marks=pytest.mark.slow)])
def test_any_scene_keeps_the_invariants(examples):
    settings(max_examples=examples, deadline=None)(given(scenes())(check_invariants))()


PLAIN = """
import json
import numpy as np
from warming import locked
from fem_impact.impact.compiled.bundles import KernelSystem, Limits
from fem_impact.impact.compiled.energy import run_energy
from fem_impact.impact.compiled.law import table
from fem_impact.impact.compiled.propagation import replay

def after(run):
    times = np.linspace(0.0, 2e-3, 9)
    q, p = np.empty((9, 3)), np.empty((9, 3))
    replay(KernelSystem(*scene), *locked(run[0]), times, q, p)
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
    found += after(run_energy(KernelSystem(*scene), None, 1, 5e-5, limits))
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
    thread = threading.Thread(target=press, args=(300_000,))  # some 0.3 s
    thread.start()
    ticks = 0
    while thread.is_alive():
        time.sleep(1e-3)
        ticks += 1
    assert ticks > 10  # with the lock held the first sleep lasts as long as the run: 1 or 2


@pytest.mark.parametrize(("target", "closed"), [(0, 0.0), (-1, 1.0)], ids=["closes at the end", "presses on"])
def test_a_contact_that_closes_as_a_step_ends_was_apart_in_it(target, closed):
    """What rounding leaves of a force then made one impact of two while another stick pressed."""
    scene = KernelSystem(np.zeros(1), *np.zeros((4, 1)), laws.table([[1e5, 1.0]]), np.zeros(1), np.ones(1))
    begun, row = frame.made_run(scene), np.zeros(layout.HEAD + layout.WIDTH + 1)
    contacts, course = build.plain(frame.touching)(begun), build.plain(frame.course_of)(begun)
    contacts.force[0], course.counts[layout.TARGET] = 1e-14, target
    build.plain(exact.record)(contacts, course, row, np.zeros((6, 1, 1)), 1e-6, False)
    assert row[layout.HEAD + layout.CLOSED] == closed
