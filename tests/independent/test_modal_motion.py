"""The integrator that judges all attacks: closed forms, and agreement with itself in other steps."""

from types import SimpleNamespace

import attack_blows
import modal_motion as motion
import numpy as np
import pytest
import references_blows as reference
from linear_blow import exact
from numpy.testing import assert_allclose


def follow(omega, squared, zeta, mass, law, speed, **how):
    """A rigid mass on modes given by numbers."""
    target = omega, squared, np.full(len(omega), zeta)
    return reference.follow(
        (np.zeros(1), np.array([1.0 / mass]), np.zeros(1)), target, law, speed, **{"finer": 1, "most": 9} | how
    )


def test_a_mass_rebounds_from_a_spring():
    found = follow(np.empty(0), np.empty(0), 0.0, 0.3, reference.Law(2e5, 1.0), 1.7)
    rate = np.sqrt(2e5 / 0.3)
    assert (found.status, found.n_impacts) == (reference.DONE, 1)
    assert_allclose(found.restitution, 1.0, atol=1e-12)  # steps err by 1e-11 of the force where they are longest
    assert_allclose([found.impulse, found.contact_time], [2.0 * 0.3 * 1.7, np.pi / rate], rtol=1e-11)
    assert_allclose(found.peak_force, 1.7 * np.sqrt(0.3 * 2e5), rtol=1e-11)


@pytest.mark.parametrize("mass, stiffness, n_impacts", [(0.1, 1e5, 1), (0.3, 1e5, 2), (0.2, 5e5, 3)])
def test_a_linear_contact_moves_as_its_eigenvectors_do(mass, stiffness, n_impacts):
    rng = np.random.default_rng(5)
    omega, squared = 2.0 * np.pi * np.cumsum(rng.uniform(60.0, 140.0, 14)), rng.uniform(0.5, 20.0, 14)
    found = follow(omega, squared, 0.0, mass, reference.Law(stiffness, 1.0), 1.0)
    start = np.zeros(15)
    start[0] = np.sqrt(mass)
    joined = SimpleNamespace(
        omega=np.append(0.0, omega), shape=np.sqrt(np.append(1.0 / mass, squared))[None],
        law=np.array([[stiffness, 1.0, 0.0, 0.0]]), start_q=np.zeros(15), start_p=start,
    )  # fmt: skip
    truth = exact(joined, wait=0.1)
    assert found.n_impacts == len(truth.impacts) == n_impacts
    assert_allclose(found.restitution, -truth.p[0] / np.sqrt(mass), atol=1e-9)  # 1e-11, grown from impact to impact
    assert_allclose(found.contact_time, truth.contact_time, rtol=1e-9)
    assert_allclose(found.impulse, truth.impacts[:, 2].sum(), rtol=1e-9)
    assert_allclose(found.peak_force, truth.impacts[:, 3].max(), rtol=1e-8)  # the truth looks at 10 000 points


def test_forces_in_a_step_are_answered_to_rounding():
    """Both recurrences against a quadrature, where they meet and far off; slow and rigid modes too."""
    x, weight = np.polynomial.legendre.leggauss(200)
    for omega, zeta, part in [(0.0, 0.0, 1.0), (1e-3, 0.1, 0.3), (6.9, 0.02, 1.0), (7.1, 0.02, 1.0), (60.0, 0.3, 0.5)]:
        q, p = np.empty(motion.POINTS), np.empty(motion.POINTS)
        motion.answer(omega, zeta, 1.0, part, q, p)
        times, weights = 0.5 * part * (x + 1.0), 0.5 * part * weight
        moves = np.array([motion.advance(omega, zeta, part - t) for t in times])
        powers = times ** np.arange(motion.POINTS)[:, None]
        assert_allclose(q, powers @ (weights * moves[:, 1]), rtol=1e-10, atol=1e-14)  # upwards 7! / 7**7 is lost
        assert_allclose(p, powers @ (weights * moves[:, 3]), rtol=1e-10, atol=1e-14)


@pytest.mark.parametrize("steep", [False, True])
def test_half_the_steps_tell_the_same(steep):
    floors = []
    for number in range(8):
        blow, _ = attack_blows.random_blow(5, number, steep=steep)
        true, floor = attack_blows.truth(blow)
        floors += [floor] if true.n_impacts <= 3 else []
    assert len(floors) >= 4
    assert max(floors) < 1e-7  # 2e-8 is the most of hundreds, where a corner of the law is met at rest


@pytest.mark.parametrize("gap", [1e-3, 1e-7, 1e-11])
def test_a_graze_is_found_or_proved_missed(gap):
    """A mode swings to within a hair of a mass that leaves slowly: a touch that deep or that far from one."""
    shape, omega = np.ones(2), np.array([0.0, 100.0])
    for away, found in [(-1.0 - gap, 0), (-1.0 + gap, 1)]:
        start = np.array([away, 0.0, -1e-13, 100.0])
        assert motion._next_touch(omega, np.zeros(2), shape, start, 0.01) == found
