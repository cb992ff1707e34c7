"""Free flight against closed forms: the time of the next onset, and the proof that there is none."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from fem_impact.impact.compiled import build, flight, layout, stretched
from fem_impact.impact.compiled.bundles import Bodies, Flights, Limits
from fem_impact.impact.compiled.flight import LATER, NEVER, ONSET

FIND_ONSET = build.plain(flight.find_onset)


def fly(omega, shape, q, p, *, offset=0.0, bias=None, left=np.inf, zeta=0.0, base=1e-4, miss=None, depth=0.0):
    """Elapsed time, contact and end of a flight, and the state after it."""
    omega, q, p = (np.array(x, float) for x in (omega, q, p))
    n, bias = len(omega), np.zeros(len(omega)) if bias is None else np.array(bias, float)
    tables = np.empty((flight.GLIDES + 1, layout.N_LANE, n))
    flights = Flights(tables, np.zeros(flight.GLIDES + 1), base, 1e-3 * base)
    shape, offset = np.atleast_2d(np.array(shape, float)), np.array([offset])
    bodies = Bodies(omega, np.full(n, zeta), 2.0 * zeta * omega, shape, bias, q, p, np.empty(n), np.empty(n))
    miss = np.array([-np.inf]) if miss is None else miss
    return *FIND_ONSET(bodies, offset, flights, Limits(depth, 0.0, np.inf, 0, 1), left, miss), q, p


@pytest.mark.parametrize("gap, speed, gravity", [(1e-3, 0.5, 0.0), (0.2, 0.0, 9.81), (0.05, -1.0, 9.81)])
def test_a_rigid_body_falls(gap, speed, gravity):
    elapsed, contact, found, _, p = fly([0.0], [1.0], [0.0], [speed], offset=-gap, bias=[gravity])
    root = np.sqrt(speed * speed + 2.0 * gravity * gap)
    assert (contact, found) == (0, ONSET)
    assert_allclose(elapsed, gap / speed if gravity == 0.0 else (root - speed) / gravity, rtol=1e-13)
    assert_allclose(p[0], root, rtol=1e-13)


@pytest.mark.parametrize("zeta", [0.0, 0.02])
def test_an_approaching_body_meets_a_swinging_one(zeta):
    """A striker at constant speed and one mode: the first zero of d(t) by bracketing."""
    w, speed, gap = 3e3, 0.3, 2e-3
    damped = w * np.sqrt(1.0 - zeta * zeta)

    def approach(t):
        swing = 1e-3 * np.exp(-zeta * w * t) * (np.cos(damped * t) + zeta * w / damped * np.sin(damped * t))
        return speed * t - gap - swing

    t = np.linspace(0.0, 2.0 * gap / speed, 20001)
    first = np.flatnonzero(approach(t) > 0.0)[0]
    exact = brentq(approach, t[first - 1], t[first], xtol=1e-16)
    elapsed, _, found, *_ = fly([0.0, w], [1.0, -1.0], [0.0, 1e-3], [speed, 0.0], offset=-gap, zeta=zeta)
    assert found == ONSET
    assert_allclose(elapsed, exact, rtol=1e-11)


def test_a_receding_body_never_returns():
    """The swing of 1 mm cannot reach a body that is 2 mm away and recedes; one that is 0.5 mm away it meets."""
    motion = {"omega": [0.0, 3e3], "shape": [1.0, -1.0], "q": [0.0, 1e-3], "p": [-1e-3, 0.0]}
    elapsed, _, found, q, p = fly(**motion, offset=-2e-3)
    assert (elapsed, found) == (0.0, NEVER)
    assert q.tolist() == motion["q"] and p.tolist() == motion["p"]
    elapsed, _, found, *_ = fly(**motion, offset=-5e-4)
    assert found == ONSET
    exact = brentq(lambda t: -1e-3 * t - 5e-4 - 1e-3 * np.cos(3e3 * t), 0.5 / 3e3, 1.0 / 3e3 * np.pi)
    assert_allclose(elapsed, exact, rtol=1e-11)


def test_a_flight_ends_at_its_limit():
    elapsed, contact, found, q, _ = fly([0.0], [1.0], [0.0], [0.5], offset=-1.0, left=0.25)
    assert (elapsed, contact, found) == (0.25, -1, LATER)
    assert_allclose(q[0], 0.125, rtol=1e-14)


@pytest.mark.parametrize("gap", [1e-9, 1e-7, 1e-5])
def test_how_near_a_flight_passes_is_known(gap):
    """A body swings up to a gap below touching and leaves; it is followed until 2 % of the approach are between."""
    swing, w, speed = 1e-3, 2e3, 0.1
    top = brentq(lambda t: swing * w * np.cos(w * t) - speed, 0.0, 0.5 * np.pi / w, xtol=1e-18)
    highest, miss = swing * np.sin(w * top) - speed * top, np.array([-np.inf])
    _, _, found, *_ = fly(
        [0.0, w], [1.0, 1.0], [0.0, 0.0], [-speed, swing * w], offset=-highest - gap, miss=miss, depth=1e-18
    )
    assert found == NEVER
    # the cubic through two looks about the turn errs by the fourth power of their distance
    assert 0.8 * gap < -miss[0] < 1.2 * gap


@pytest.mark.parametrize("phase", [0.0, 0.7, 0.5 * np.pi])  # displaced, both, moving
@pytest.mark.parametrize(("reach", "over"), [(0.9e-3, True), (1.1e-3, False)])
def test_a_mode_that_stretches_may_swing_as_far_as_its_energy(phase, reach, over):
    """The striker is 1 mm away and recedes; the mode's amplitude at the contact decides whether they can meet."""
    omega, shape = np.array([0.0, 1e3]), np.array([[1.0, 2.0]])
    q, p = np.array([-1e-3, 0.5 * reach * np.cos(phase)]), np.array([-0.1, 0.5e3 * reach * np.sin(phase)])
    bodies = SimpleNamespace(omega=omega, shape=shape, q=q, p=p, bias=np.zeros(2))
    contacts, still = SimpleNamespace(end=np.zeros(1), offset=np.zeros(1)), SimpleNamespace(still=0.0, depth=0.0)
    room = stretched.made_room(stretched.Stretch(np.zeros((1, 1, 1)), np.zeros((0, 1)), 1), omega, 1)
    assert build.plain(stretched.surely_apart)(bodies, contacts, room, still) == over
