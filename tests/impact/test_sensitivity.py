"""The linear equations of small changes against closed forms and exact propagation."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from warming import locked

import fem_impact as fi
from fem_impact.impact.compiled import build, one_mode, record, tangents
from fem_impact.impact.compiled.build import ZERO
from fem_impact.impact.sensitivity import Sensitivity, gauss, no_change


def moments_alone(omega, zeta, out_moments):
    work = np.empty((2, out_moments.shape[0] - 2))
    for n in range(omega.size):
        alone = np.empty(out_moments.shape[0] - 1)
        out_moments[0, n] = build.plain(one_mode.mode_moments)(omega[n], zeta[n], 1.0, alone, work)[2]
        out_moments[1:, n] = alone


@pytest.mark.parametrize("count", [4, 6])
@pytest.mark.parametrize("zeta", [0.0, 0.02, 0.5, 0.89, 0.95, 3.0])
def test_moments_of_many_modes_are_those_of_each(zeta, count):
    """Forwards and, below a phase of a half, backwards from power series: the same as mode by mode."""
    omega = np.append(0.0, np.geomspace(1e-5, 1e3, 60))
    damping = np.where(omega > 0.0, zeta, 0.0)
    found, alone = np.empty((2, count + 2, len(omega)))
    build.plain(tangents.moments_of)(omega, damping, 1.0, found)
    moments_alone(omega, damping, alone)
    # two orders of the recursion divide rounding by the square of a half; beside it 3e-15 of a phase of a thousand
    assert_allclose(found, alone, rtol=0, atol=1e-15 * 4.0 ** ((count + 1) // 2) + 3e-15)


@pytest.mark.parametrize("count", [4, 6])
@pytest.mark.parametrize("zeta", [0.0, 0.02, 0.95, 1.0, 3.0])
def test_changes_of_moments_are_differences_of_moments(zeta, count):
    """As plain Python, for the compiler would take half a minute."""
    omega = np.array([0.0, 1e-3, 0.3, 2.0, 40.0, 700.0])
    damping = np.where(omega > 0.0, zeta, 0.0)

    def moments(omega, damping):
        found = np.empty((count + 2, len(omega)))
        build.plain(tangents.moments_of)(omega, damping, 1.0, found)
        return found

    per, own, faster, damped = np.empty(6), np.empty(6), np.empty((count + 1, 6)), np.empty((count + 1, 6))
    build.plain(tangents.divisors)(omega, damping, per, own)
    build.plain(tangents.moment_slopes)(omega, damping, 1.0, moments(omega, damping), per, own, faster, damped)
    near, far = ((moments(omega * (1 + h), damping) - moments(omega * (1 - h), damping)) / h for h in (1e-5, 2e-5))
    # four-point differences of numbers of order one; they move fast where the phase is 700
    assert_allclose(faster * omega, ((4.0 * near - far) / 6.0)[:-1], atol=1e-9)
    if zeta == 0.0:
        return  # no damping below zero
    flexible = omega > 0.0
    near, far = (
        (moments(omega, damping + h * flexible) - moments(omega, damping - h * flexible)) / h for h in (1e-5, 2e-5)
    )
    assert_allclose(damped, ((4.0 * near - far) / 6.0)[:-1], atol=2e-7)  # in zeta a phase of 700 moves fast, too


@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize(
    "law",
    [
        fi.Contact.linear(1e5), fi.Contact.hertz(1e6), fi.Contact.power(1e8, 2.7),
        fi.Contact.layers(1e5, 1.2, depth=5e-4, hard_stiffness=1e8),
    ],
    ids=["linear", "hertz", "power", "layers"],
)  # fmt: skip
def test_slopes_of_the_law_are_its_differences(law, loss):
    numbers = np.array([law.numbers])
    numbers[0, 2] = loss
    d, v, slopes = 1.3e-3, -0.4, np.zeros(8)
    if law.hard_stiffness == 0.0:
        numbers[0, 3] = 1e-6  # a spring in series, as the modes left out are
    force, by_d, by_v, _ = tangents.law_at(d, v, numbers, 0.0, False, slopes)

    def change(i, step):
        near = [numbers.copy() for _ in range(2)]
        for side, each in zip((-1.0, 1.0), near):
            each[0, i] += side * step
        return np.diff([tangents.law_at(d, v, each, 0.0, False, np.zeros(8))[0] for each in near])[0] / (2.0 * step)

    def along(dd, dv):
        ends = [
            tangents.law_at(d + side * dd, v + side * dv, numbers, 0.0, False, np.zeros(8))[0] for side in (-1.0, 1.0)
        ]
        return np.diff(ends)[0] / (2.0 * max(dd, dv))

    scale = force * 1e-7  # differences of second order
    assert_allclose(by_d, along(1e-5 * d, 0.0), atol=scale / d)
    assert_allclose(by_v, along(0.0, 1e-5), atol=scale)
    for i in (0, 1, 2, 3, 5, 6, 7):
        if numbers[0, i] != 0.0:
            step = 1e-5 * numbers[0, i]
            assert_allclose(slopes[i], change(i, step), atol=scale / numbers[0, i], err_msg=f"number {i}")


@pytest.mark.parametrize("compliance", [0.0, 1e-6])
@pytest.mark.parametrize("yields", [True, False])
def test_slopes_of_a_yielding_law_are_its_differences(yields, compliance):
    """Also in the deepest compression, from which it unloads; both courses meet where it turned back."""
    numbers = np.array([fi.Contact.elastic_plastic(1e7, exponent=1.4, yield_approach=5e-5).numbers])
    numbers[0, 3] = compliance
    d, memory, slopes = 2e-4, 1.7e-4, np.zeros(8)

    def force(d, numbers, memory):
        return tangents.law_at(d, 0.0, numbers, memory, yields, np.zeros(8))

    found = tangents.law_at(d, 0.0, numbers, memory, yields, slopes)
    assert_allclose(found[0], force(d, numbers, memory)[0])
    scale = found[0] * 1e-7  # differences of second order
    ends = [force(d * (1.0 + side * 1e-5), numbers, memory)[0] for side in (-1.0, 1.0)]
    assert_allclose(found[1] * d, np.diff(ends)[0] / 2e-5, atol=scale)
    ends = [force(d, numbers, memory * (1.0 + side * 1e-5))[0] for side in (-1.0, 1.0)]
    assert_allclose(found[3] * memory, np.diff(ends)[0] / 2e-5, atol=scale)
    for i in (0, 1, 3, 5):
        sides = [numbers.copy() for _ in range(2)]
        for side, each in zip((-1.0, 1.0), sides):
            each[0, i] *= 1.0 + side * 1e-5
        ends = [force(d, each, memory)[0] for each in sides]
        assert_allclose(slopes[i] * numbers[0, i], np.diff(ends)[0] / 2e-5, atol=scale, err_msg=f"number {i}")
    deepest = (
        memory + compliance * tangents.law_at(memory, 0.0, numbers * [1, 1, 1, 0, 1, 1, 1, 1, 1], 0.0, True, slopes)[0]
    )
    assert_allclose(*(tangents.law_at(deepest, 0.0, numbers, memory, side, slopes)[0] for side in (True, False)))


def linear_blow(tolerance):
    """A mass on a wall behind a linear spring, and its changes with mass and stiffness."""
    mass, stiffness, speed = 0.2, 1e5, 1.3
    touch = fi.Touch(fi.Contact.linear(stiffness, gap=1e-4), 0, None)
    hit = fi.collide([fi.Modes.rigid(mass)], [touch], speeds=[speed], tolerance=tolerance)
    change = no_change(hit.history, 2)
    change.shape[0], change.start_p[0] = -0.5 * hit.history.shape[0] / mass, 0.5 * hit.history.start_p / mass
    change.law[1, 0, 0] = 1.0
    return SimpleNamespace(mass=mass, stiffness=stiffness, speed=speed), Sensitivity.of(hit.history, change)


def test_linear_spring_meets_its_half_sine():
    blow, found = linear_blow(1e-9)
    omega = np.sqrt(blow.stiffness / blow.mass)
    time, peak = np.pi / omega, blow.speed * np.sqrt(blow.stiffness * blow.mass)
    # steps of some tenths of the contact, each a polynomial of degree 4: exact to the tolerance
    assert_allclose(found.contact_time, [0.5 * time / blow.mass, -0.5 * time / blow.stiffness], rtol=1e-8)
    assert_allclose(found.impulse, [2.0 * blow.speed, 0.0], atol=1e-8)
    assert_allclose(found.peak_force, [0.5 * peak / blow.mass, 0.5 * peak / blow.stiffness], rtol=1e-8)
    assert_allclose(found.peak_time, found.contact_time / 2.0, rtol=1e-6)  # the peak is flat
    frequencies = np.array([0.0, 100.0, 400.0])
    spectrum = found.spectrum(frequencies)
    start, w = 1e-4 / blow.speed, 2.0 * np.pi * frequencies

    def transform(mass, stiffness):  # of F sin(omega t) from the start of the contact on
        omega = np.sqrt(stiffness / mass)
        delayed = np.exp(-1j * w * start) * (1.0 + np.exp(-1j * w * np.pi / omega))
        return blow.speed * np.sqrt(stiffness * mass) * omega / (omega**2 - w**2) * delayed

    for i, (dm, dk) in enumerate([(1e-5, 0.0), (0.0, 1e-5)]):
        ends = [transform(blow.mass * (1 + s * dm), blow.stiffness * (1 + s * dk)) for s in (-1.0, 1.0)]
        exact = (ends[1] - ends[0]) / 2e-5 / (blow.mass if dm else blow.stiffness)
        # differences of second order, and what the tolerance leaves
        assert_allclose(spectrum[:, i], exact, atol=1e-7 * np.abs(exact).max())


def test_smaller_steps_make_changes_exact():
    errors = []
    for tolerance in (1e-3, 1e-6):
        blow, found = linear_blow(tolerance)
        exact = 0.5 * np.pi / np.sqrt(blow.stiffness * blow.mass)
        errors.append(abs(found.contact_time[0] / exact - 1.0))
    assert errors[1] < 1e-6 and errors[1] < 0.1 * errors[0]


def test_gauss_polynomials_are_one_at_their_node():
    nodes, powers = gauss(4)
    assert nodes[-1] == 1.0
    assert_allclose(powers @ np.vander(nodes[:-1], increasing=True).T, np.eye(4), atol=1e-12)  # rounding


def test_a_blow_that_chatters_is_refused():
    hit = fi.strike(fi.Modes.rigid(1e6), fi.Striker.rigid(0.1), fi.Contact.hertz(1e6), at=None, speed=1.0)
    blind = SimpleNamespace(n_blind=3)
    with pytest.raises(fi.SimulationError, match="the bodies chatter"):
        Sensitivity.of(blind, no_change(hit.history, 1))


@pytest.mark.parametrize("loss, tolerance", [(0.0, 1e-4), (0.3, 1e-4), (0.0, 1e-8)])
def test_the_largest_force_is_the_largest_of_many_samples(loss, tolerance):
    """Its time is that of the largest of 200 000 samples, with loss, where the force rings, as without."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=10)
    law = fi.Contact.hertz(695e3, loss=loss)
    hit = fi.strike(plate, fi.Striker.rigid(0.1), law, at=(0.45, 0.3), speed=1.0, tolerance=tolerance, max_impacts=2)
    h = hit.history
    time, top, rival = record.largest_force(h.steps, h.now, h.law, h.n_coefficients, ZERO)
    times = np.linspace(0.0, h.end_time, 200_001)
    force = h.force_at(times, 0)[0]
    assert_allclose(time, times[force.argmax()], atol=2.0 * times[1])
    assert_allclose(top, force.max(), rtol=1e-3)  # the larger of 16 samples of a step is short of its largest force
    assert 0.0 <= rival < top


def test_the_impulse_of_a_smooth_law_grows_with_the_mass_alone():
    """A ball on a wall has the impulse 2 m v, although its force rises with a power whose slopes are singular."""
    ball, wall = fi.Striker.rigid(0.1), fi.Modes.rigid(1e12)
    hit = fi.strike(wall, ball, fi.Contact.power(1e6, 1.2), at=None, speed=1.0, tolerance=1e-9)
    slopes = hit.gradient("impulse", ("striker.mass", "contact.stiffness", "strike.speed"))
    assert_allclose(slopes.relative, [1.0, 0.0, 1.0], atol=5e-9)  # 2e-9 were measured


def test_a_contact_that_stays_elastic_has_the_largest_force_of_one_that_cannot_yield():
    laws = fi.Contact.power(1e7, 1.4), fi.Contact.elastic_plastic(1e7, exponent=1.4, yield_approach=0.009)
    hits = [fi.collide([fi.Modes.rigid(0.2)], [fi.Touch(law, 0, None)], speeds=[0.5]) for law in laws]
    elastic, plastic = (Sensitivity.of(hit.history, no_change(hit.history, 1)).largest for hit in hits)
    assert plastic == pytest.approx(elastic, rel=1e-12) and elastic == pytest.approx(hits[0].peak_force, rel=1e-2)


@pytest.mark.parametrize("before", [0.01, 0.7])  # [s] of the step before the longest
def test_a_peak_just_before_the_end_of_a_long_step_is_found(before):
    """Of a half sine of pi seconds, whose look nearest to the peak is the start of the short step after it."""
    ends = np.array([0.0, 0.8 - before, 0.8, 0.5 * np.pi + 0.01, 0.5 * np.pi + 0.02, np.pi])
    steps, now, law = np.zeros((5, 8)), np.zeros((6, 1)), np.array([[1e3, 1.0, 0.0, 0.0]])
    steps[:, 0], steps[:, 1], steps[:, 5] = ends[:-1], np.diff(ends), 1.0
    steps[:, 3], steps[:, 4] = np.sin(ends[:-1]), np.cos(ends[:-1])
    now[4] = -1.0
    time, top, _ = record.largest_force(*locked(steps, now, law), 2, ZERO)
    assert_allclose([time, top], [0.5 * np.pi, 1e3], rtol=1e-3)  # of the cubics
