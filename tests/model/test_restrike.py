"""Blows struck again with something changed, and what damping that nobody stated would change."""

from functools import partial

import numpy as np
import pytest
from comparing import examined

import fem_impact as fi
from fem_impact.impact import engine
from fem_impact.model import bending, restrike
from fem_impact.model.audit import PLAUSIBLE
from fem_impact.model.restrike import Struck

PLATE = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=60)
LAW, HAMMER = fi.Contact.hertz(1e6), fi.Striker.rigid(0.02)
SLOW = {"at": (0.12, 0.09), "speed": 1.0}
BLOW = SLOW | {"tolerance": 1e-6}


def struck(quantity=None, **how):
    hit = fi.strike(PLATE, HAMMER, LAW, quantity=quantity, **BLOW, **how)
    return Struck(hit, hit.bodies, bending.known_of(PLATE), None)


@pytest.mark.parametrize("factor", [0.9, 1.05])
def test_changes_are_those_of_a_new_blow(factor):
    case = struck(residual=False)
    changed = case.changes(omega=case.with_target(factor * PLATE.omega))
    other = fi.strike(PLATE.scaled(first_frequency=100.0 * factor), HAMMER, LAW, residual=False, **BLOW)
    assert changed["restitution"] == pytest.approx(abs(other.restitution - case.hit.restitution), rel=0.05, abs=2e-5)
    for name, key in (("impulse", "impulse"), ("contact_time", "contact_time"), ("force", "peak_force")):
        size = abs(getattr(other, key) / getattr(case.hit, key) - 1.0)
        assert changed[name] == pytest.approx(size, rel=0.05, abs=2e-5)  # both in the steps of a first run: 1e-4


def test_spectra_are_compared_in_their_band():
    case = struck(quantity="spectrum=1000")
    effect = case.changes(omega=case.with_target(0.9 * PLATE.omega))
    assert set(effect) == {"spectrum"} and 1e-4 < effect["spectrum"] < 1.0


def test_sound_is_the_shift_of_what_rings():
    case = struck(quantity="sound=2000")
    effect = case.add_sound({"sound": 0.0}, lambda body, _: np.full(body.modes.n_modes, 0.03))
    assert effect["sound"] == pytest.approx(0.03)
    assert case.add_sound({"sound": 0.0}, lambda *_: None)["sound"] is None


def test_a_limit_of_the_blow_stays():
    hit = fi.strike(PLATE, HAMMER, LAW, duration=5e-4, **BLOW)
    assert engine.follow_again(hit.history).end_time == pytest.approx(hit.history.end_time, rel=1e-12)
    first = fi.strike(PLATE, fi.Striker.rigid(0.2), LAW, max_impacts=1, **BLOW)
    assert len(engine.follow_again(first.history).contacts) == 1


def test_a_blow_that_cannot_be_struck_again_is_not_known(monkeypatch):
    case = struck()

    def fails(history, **changed):
        raise fi.SimulationError("no final separation was reached")

    monkeypatch.setattr(restrike, "follow_again", fails)
    assert set(case.changes(omega=0.9 * case.hit.history.omega).values()) == {None}


undamped = partial(examined, name="stated damping")


@pytest.mark.parametrize("mass", [0.005, 0.02, 0.1])
def test_effect_is_that_of_striking_a_damped_plate(mass):
    # residual=False: else another static give of the same modes is a difference, too
    plain, damped = (
        fi.strike(PLATE.damped(zeta), fi.Striker.rigid(mass), LAW, residual=False, **BLOW) for zeta in (0.0, PLAUSIBLE)
    )
    told = undamped(plain)
    assert told.value == PLAUSIBLE and "state the damping ratio of the struck body" in told.sentence
    changes = {"restitution": damped.restitution - plain.restitution, "impulse": damped.impulse / plain.impulse - 1.0}
    for name, change in changes.items():
        assert told.effect[name] == pytest.approx(abs(change), rel=0.2, abs=1e-5)  # 1e-5: two runs of a first step


def test_a_sound_without_damping_would_never_end():
    told = undamped(fi.strike(PLATE, HAMMER, LAW, quantity="sound=2000", **SLOW))
    assert told.effect["sound"] == 1.0 and told.beyond
