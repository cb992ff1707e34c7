"""Taps predicted from the others, with what each has of its own."""

import numpy as np
import pytest
from hammer_taps import LAW, RANGES, RATE, STRUCTURE, taps_of

import fem_impact as fi


@pytest.fixture(scope="module")
def found():
    laws = [fi.Contact.power(factor * LAW.stiffness, LAW.exponent) for factor in (0.8, 1.0, 1.25)]
    return fi.fit(
        taps_of(STRUCTURE, [0.0], law=laws, noise=0.002), target=STRUCTURE, at=[0.0], contact=LAW, starts=2,
        striker=fi.Striker.rigid(0.1), unknown=RANGES, per_tap="contact.stiffness", profiles=False,
    )  # fmt: skip


def test_a_new_tap_gets_its_own_stiffness(found):
    law = fi.Contact.power(0.6 * LAW.stiffness, LAW.exponent)
    new = fi.Taps.from_arrays(taps_of(STRUCTURE, [0.0], law=law, speeds=(1.4,), noise=0.0)[0].force, rate=RATE)
    one = found.predict(new)
    assert one.error < 5e-3 and one.speed == pytest.approx(1.4, rel=0.01)
    assert one.own["contact.stiffness"] == pytest.approx(0.6 * found.point["contact.stiffness[1]"], rel=0.03)


def test_the_fall_of_a_pulse_follows_from_its_rise_and_the_other_taps(found):
    whole, rise = found.left_out(), found.left_out(rise_only=True)
    for one, blind in zip(whole, rise):
        assert one.error < 0.01  # 0.2 % of the peak is 0.5 % of the rms force here
        assert one.error <= blind.error < 0.03  # 0.011 measured at worst: twelve samples decide three values
        until = int(one.measured.argmax()) + 1
        assert np.linalg.norm(blind.residual[:until]) < 1.2 * np.linalg.norm(one.residual[:until])
    assert found.left_out() is whole and "own" not in found.taps.table


def test_a_tap_at_another_rate_is_refused(found):
    with pytest.raises(ValueError, match="sampled at 25600 Hz"):
        found.predict(fi.Taps.from_arrays(np.sin(np.arange(60.0)) ** 2, rate=1e3))
