import numpy as np
import pytest

import fem_impact as fi
from fem_impact.impact import engine
from fem_impact.model import bending, restrike
from fem_impact.model.restrike import Struck, softer

PLATE = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=60)
LAW, HAMMER = fi.Contact.hertz(1e6), fi.Striker.rigid(0.02)
BLOW = {"at": (0.12, 0.09), "speed": 1.0, "tolerance": 1e-6}


def struck(quantity=None, **how):
    hit = fi.strike(PLATE, HAMMER, LAW, quantity=quantity, **BLOW, **how)
    return Struck(hit, hit.bodies, bending.known_of(PLATE), None)


def test_nothing_changes_if_nothing_is_changed():
    case = struck()
    assert set(case.changes(omega=case.hit.history.omega).values()) == {0.0}


@pytest.mark.parametrize("factor", [0.9, 0.99, 1.05])
def test_changes_are_those_of_a_new_blow(factor):
    case = struck(residual=False)
    changed = case.changes(omega=case.with_target(factor * PLATE.omega))
    other = fi.strike(PLATE.scaled(first_frequency=100.0 * factor), HAMMER, LAW, residual=False, **BLOW)
    expected = {
        "restitution": abs(other.restitution - case.hit.restitution),
        "impulse": abs(other.impulse / case.hit.impulse - 1.0),
        "contact_time": abs(other.contact_time / case.hit.contact_time - 1.0),
        "force": abs(other.peak_force / case.hit.peak_force - 1.0),
    }
    for name, size in expected.items():
        assert changed[name] == pytest.approx(size, rel=0.05, abs=2e-5)  # both in the steps of a first run: 1e-4


def test_more_compliance_is_a_softer_contact():
    case = struck()
    effect = case.changes(**softer(case.hit.history, 1e-5))
    assert effect["force"] > 1e-3 and effect["contact_time"] > 1e-3


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
    assert engine.again(hit.history).end_time == pytest.approx(hit.history.end_time, rel=1e-12)
    first = fi.strike(PLATE, fi.Striker.rigid(0.2), LAW, max_impacts=1, **BLOW)
    assert len(engine.again(first.history).contacts) == 1


def test_frequency_of_the_contact_is_that_of_its_longest_impact():
    case = struck()
    assert case.omega == pytest.approx(np.pi / max(impact.duration for impact in case.hit.impacts))


def test_a_blow_that_cannot_be_struck_again_is_not_known(monkeypatch):
    case = struck()

    def fails(history, **changed):
        raise fi.SimulationError("no final separation was reached")

    monkeypatch.setattr(restrike, "again", fails)
    assert set(case.changes(omega=0.9 * case.hit.history.omega).values()) == {None}
