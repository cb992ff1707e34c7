"""What friction would do: against blows integrated with Coulomb friction, and where there is none to speak of."""

from functools import partial

import numpy as np
import pytest
from comparing import examined
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from tumblers import tumbler

import fem_impact as fi
from fem_impact.impact.assumption import FRICTION

MASS, STIFFNESS = 0.3, 1e6
SLOW = 1e-3  # [-] what friction that falls off slowly leaves of its impulse; in space, speed below which it falls off
ABRUPT = 1e-4  # [-] of the arrival's speed, below which friction falls off in the integration: 1e-3 of its impulse


def with_friction(inertia, arm, pivot, other, friction):
    """Restitution, contact time and impulse of a rigid body on a mass that moves along the blow alone."""
    across, ahead = arm

    def rates(t, s):
        z, turned, u, w, spin, far, speed, _ = s
        force = STIFFNESS * max(z + turned * across - far, 0.0)
        drag = -friction * force * np.tanh((u - spin * ahead) / ABRUPT)
        turning = -(force * across + drag * ahead) / inertia
        return [w, spin, drag / MASS, -force / MASS, turning, speed, force / other, force]

    def apart(t, s):
        return s[0] + s[1] * across - s[5]

    apart.terminal, apart.direction = True, -1.0
    spin = 0.0 if pivot is None else 1.0 / (across - pivot[0])
    start = [0.0, 0.0, *((0.0, 1.0) if pivot is None else (spin * pivot[1], -spin * pivot[0])), spin, 0.0, 0.0, 0.0]
    last = 4.0 * np.pi * np.sqrt(MASS / STIFFNESS)
    found = solve_ivp(rates, (0.0, last), start, "LSODA", rtol=1e-9, atol=1e-13, events=apart, max_step=last / 800)
    end = found.y[:, -1]
    return np.array([-(end[3] + end[4] * across), found.t[-1], end[7]])


told = partial(examined, name="no friction")


def knocked(striker, other=1e4):
    """A blow of 1 m/s by a striker on a mass, once."""
    law = fi.Contact.linear(STIFFNESS)
    return fi.strike(fi.Modes.rigid(other), striker, law, at=None, speed=1.0, max_impacts=1)


def clubs(seed, n):
    rng = np.random.default_rng(seed)
    for i in range(n):
        inertia = MASS * rng.uniform(0.02, 0.08) ** 2
        arm = rng.uniform(-0.04, 0.04), rng.uniform(0.0, 0.06)
        pivot = None if i % 2 else (rng.uniform(-0.5, -0.2), rng.uniform(-0.1, 0.1))
        yield inertia, arm, pivot, float(rng.choice([0.3, 1e4]))


def right(changes, found):
    """Whether an estimate of the largest change is above a third of it, and below three times that."""
    guess = max(found.effect[name] for name in ("restitution", "contact_time", "impulse"))
    return changes.max() / 3.0 - SLOW <= guess <= 3.0 * changes.max() + SLOW


@pytest.mark.thin(3)
@pytest.mark.parametrize(
    "club", [*clubs(0, 8), *(pytest.param(each, marks=pytest.mark.slow) for each in clubs(11, 24))]
)
def test_what_friction_changes_is_told_within_a_factor_of_three(club):
    """Straight and turning, on a wall and on a mass as light: sticking, sliding, and sliding before sticking."""
    inertia, arm, pivot, other = club
    hit = knocked(fi.Striker.turning(MASS, inertia, arm, pivot=pivot), other)
    found = told(hit)
    smooth, rough = (with_friction(*club, each) for each in (0.0, FRICTION))
    assert_allclose([hit.restitution, hit.contact_time, hit.impulse], smooth, atol=2e-4)  # the tolerance, and theirs
    changes = np.abs(rough - smooth) / np.append(1.0, smooth[1:])
    assert right(changes, found), (changes, found.effect)
    assert found.known and ("slides" in found.reading or "sticking" in found.reading)


@pytest.mark.slow
def test_so_it_is_for_most_random_bodies_that_bend():
    """In space, straight, aslant or turning; while a contact sticks, the motion across swings, which is left out."""
    missed = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        body, way, other = tumbler(rng, 6), rng.normal(size=3), float(10.0 ** rng.uniform(-1.0, 1.0))
        way /= np.linalg.norm(way)
        along, pivot = ((way + 0.3 * rng.normal(size=3), None), (None, rng.uniform(-0.3, 0.3, 3)))[seed % 2]
        striker = fi.Striker.of(body["body"], 1, direction=way, along=along, pivot=pivot)
        law = fi.Contact.linear(10.0 ** rng.uniform(5.0, 7.0) / (1.0 / striker.felt_mass + 1.0 / other))
        hit = fi.strike(fi.Modes.rigid(other), striker, law, at=None, speed=1.0, max_impacts=1, residual=False)
        smooth, rough = (in_space(body, way, along, pivot, law.stiffness, other, each) for each in (0.0, FRICTION))
        assert_allclose([hit.restitution, hit.contact_time, hit.impulse], smooth, atol=SLOW)
        missed += not right(np.abs(rough - smooth) / np.append(1.0, smooth[1:]), told(hit))
    assert missed <= 1  # none was measured, and 7 of 210 others


def in_space(body, way, along, pivot, stiffness, other, friction):
    """As `with_friction`, of a body that bends, struck at its first node."""
    place, frame, n = body["nodes"][0], np.linalg.svd(way[None])[2][1:], 6 + len(body["omega"])
    normal, *aside = (np.concatenate([each, np.cross(place, each), each @ body["shapes"][0]]) for each in (way, *frame))
    aside, inverse = np.array(aside), np.eye(n)
    inverse[:3, :3] /= body["m"]
    inverse[3:6, 3:6] = np.linalg.inv(body["I"])
    omega, zeta = (np.append(np.zeros(6), body[name]) for name in ("omega", "zeta"))

    def rates(t, s):
        q, p = s[:n], s[n : 2 * n]
        force = stiffness * max(normal @ q - s[2 * n], 0.0)
        slips = aside @ p
        size = np.hypot(*slips)
        drag = friction * force * np.tanh(size / SLOW) / max(size, 1e-30) * slips
        pushed = -inverse @ (normal * force + drag @ aside) - 2.0 * zeta * omega * p - omega**2 * q
        return np.concatenate([p, pushed, [s[2 * n + 1], force / other, force]])

    def parted(t, s):
        return normal @ s[:n] - s[2 * n]

    parted.terminal, parted.direction = True, -1.0
    start = np.zeros(2 * n + 3)
    if pivot is None:
        start[n : n + 3] = along / (along @ way)
    else:
        axis = np.cross(place - pivot, way)
        start[n + 3 : n + 6] = axis / (axis @ axis)
        start[n : n + 3] = np.cross(start[n + 3 : n + 6], -pivot)
    felt = normal[:6] @ inverse[:6, :6] @ normal[:6] + 1.0 / other
    last = 6.0 * np.pi / np.sqrt(stiffness * felt)
    found = solve_ivp(rates, (0.0, last), start, "LSODA", rtol=1e-8, atol=1e-12, events=parted, max_step=last / 600)
    end = found.y[:, -1]
    return np.array([-normal[:6] @ end[n : n + 6], found.t[-1], end[-1]])


def test_an_oblique_blow_slides_and_says_so():
    """The end of a rod slides all the while: W falls by mu W_tn, and the contact lasts as 1 / sqrt(W)."""
    half, inertia = 0.15, MASS * 0.3**2 / 12.0
    rod = fi.Body.rigid(MASS, (inertia, inertia, 0.0), [(0, 0, -half), (0, 0, 0), (0, 0, half)])
    lean = np.radians(20.0)
    way = np.array([np.sin(lean), 0.0, np.cos(lean)])
    hit = knocked(fi.Striker.of(rod, 3, direction=way, along=(-np.sin(0.5), 0.0, np.cos(0.5))))
    found = told(hit)
    assert "slides to its end with a friction of 0.3" in found.reading and found.value > FRICTION
    assert "no friction" in hit.verdict and not hit.trusted
    square = np.cross((0.0, 0.0, half), way)
    side = np.array([np.cos(lean), 0.0, -np.sin(lean)])
    smooth = 1.0 / MASS + square @ square / inertia
    coupled = np.cross((0.0, 0.0, half), side) @ square / inertia
    assert_allclose(found.effect["contact_time"], (1.0 - FRICTION * coupled / smooth) ** -0.5 - 1.0, rtol=1e-3)


@pytest.mark.parametrize("striker", [
    fi.Striker.turning(MASS, 1e-4, (0.0, 0.05)), fi.Striker.rigid(MASS), fi.Striker.stick(MASS, 500.0),
], ids=["turning", "rigid", "stick"])  # fmt: skip
def test_a_blow_in_line_with_the_centre_has_no_friction_to_tell(striker):
    found = told(knocked(striker, 1.0))
    assert found.value is None and found.known and found.worst == 0.0


def test_a_struck_body_that_moves_across_counts_too_and_a_plan_foresees_a_striker():
    other, law = fi.Body.rigid(MASS, 1e-4, [(0.0, 0.0, 0.0), (0.02, 0.0, -0.03)]), fi.Contact.linear(STIFFNESS)
    hit = fi.strike(other.modes("z"), fi.Striker.rigid(0.1), law, at=other.at(2), speed=1.0)
    club = fi.Striker.turning(MASS, 1e-4, (0.02, 0.03))
    again = told(knocked(club, 0.1))
    assert told(hit).worst > 0.01
    assert_allclose(again.value, told(hit).value, rtol=1e-6)  # seen from the other body
    wood = fi.Plate(fi.Material(E=1e10, nu=0.3, rho=450.0), 3e-3)
    plate = fi.assemble(fi.mesh.rectangle(0.4, 0.3), wood, {"boundary": "hinged"})
    assert_allclose(told(fi.plan(plate, club, law, at=(0.1, 0.1), speed=1.0)).value, again.value, rtol=1e-3)


def test_friction_that_jams_is_not_known():
    """A light long rod that leans far forward against a rough wall: its tip would dig in (Painleve)."""
    clubs = (fi.Striker.turning(MASS, 1e-3 * MASS * 0.3**2, (-0.05, 0.3), pivot=(-0.6, y)) for y in (-0.5, 1.0))
    assert any("jams" in told(knocked(club)).unknown for club in clubs)
