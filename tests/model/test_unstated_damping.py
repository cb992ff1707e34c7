from functools import partial

import pytest
from comparing import examined

import fem_impact as fi
from fem_impact.model.audit import PLAUSIBLE

PLATE = fi.analytic.rectangle(0.4, 0.3, mass=0.2, first_frequency=100.0, n_modes=60)
BLOW = {"at": (0.12, 0.09), "speed": 1.0}
LAW = fi.Contact.hertz(1e6)


found = partial(examined, name="stated damping")


@pytest.mark.parametrize("mass", [0.005, 0.02, 0.1])
def test_effect_is_that_of_striking_a_damped_plate(mass):
    # residual=False: else another static give of the same modes is a difference, too
    hits = [
        fi.strike(PLATE.damped(zeta), fi.Striker.rigid(mass), LAW, tolerance=1e-6, residual=False, **BLOW)
        for zeta in (0.0, PLAUSIBLE)
    ]
    told = found(hits[0])
    assert told.value == PLAUSIBLE and "state the damping ratio of the struck body" in told.sentence
    assert told.effect["restitution"] == pytest.approx(
        abs(hits[1].restitution - hits[0].restitution), rel=0.2, abs=1e-5
    )
    change = abs(hits[1].impulse / hits[0].impulse - 1.0)
    assert told.effect["impulse"] == pytest.approx(change, rel=0.2, abs=1e-5)  # 1e-5: two runs of a first step


def test_a_stated_damping_is_not_doubted():
    told = found(fi.strike(PLATE.damped(1e-4), fi.Striker.rigid(0.02), LAW, **BLOW))
    assert told.worst == 0.0 and told.known and told.value is None


def test_a_sound_without_damping_would_never_end():
    told = found(fi.strike(PLATE, fi.Striker.rigid(0.02), LAW, quantity="sound=2000", **BLOW))
    assert told.effect["sound"] == 1.0 and told.beyond


def test_the_damping_of_a_flexible_striker_counts():
    stick = fi.Striker.stick(mass=0.05, first_frequency=300.0)
    told = found(fi.strike(PLATE.damped(0.01), stick, LAW, tolerance=1e-3, **BLOW))
    assert told.worst > 1e-6 and told.remedy == "state the damping ratio of the striker"
