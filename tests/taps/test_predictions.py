"""Taps predicted from the others, with what each has of its own; their bands hold nine tenths of what is measured."""

from dataclasses import replace

import numpy as np
import pytest
from hammer_taps import LAW, RATE, fitted, taps_of

import fem_impact as fi
from fem_impact.taps.predictions import predict_tap, widths
from fem_impact.taps.solver import solve


@pytest.fixture(scope="module")
def found():
    laws = [fi.Contact.power(factor * LAW.stiffness, LAW.exponent) for factor in (0.8, 1.0, 1.25)]
    return fitted(taps_of(law=laws, noise=0.002), per_tap="contact.stiffness")


def test_a_new_tap_gets_its_own_stiffness(found):
    law = fi.Contact.power(0.6 * LAW.stiffness, LAW.exponent)
    new = fi.Taps.from_arrays(taps_of(law=law, speeds=(1.4,), noise=0.0)[0].force, rate=RATE)
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


@pytest.fixture(scope="module")
def banded():
    return fitted(taps_of(speeds=(0.4, 0.6, 0.8, 1.0)), starts=1)


@pytest.fixture(scope="module")
def new():
    return fi.Taps.from_arrays([tap.force[0, :500] for tap in taps_of(speeds=(0.5, 0.7, 0.9))], rate=RATE)


def test_taps_left_out_and_new_ones_lie_in_their_bands(banded, new):
    """Of 14 numbers 9 or fewer inside have a probability of 1 % at nine tenths; of hundreds of samples seven tenths."""
    for measured, taps in ((None, banded.taps), (new, new)):
        one = banded.against(measured)
        assert len(one.verdicts) == 2 * taps.n_taps and one.n_inside >= len(one.verdicts) - 2
        # nine tenths; the rest's noise is known from nine samples only, to a quarter
        assert 0.7 < np.mean([trace.inside.mean() for trace in one.traces]) < 0.98
    assert banded.misfit < 0.6 * banded.error  # most of what is left is noise


def test_a_band_holds_what_the_values_leave_open(banded):
    """The spread is that of fits to the same taps with other noise."""
    problem, best, tap = banded.problem, banded.best, banded.taps.pick(0)
    made = problem.residual(best.x).reshape(problem.data.values.shape) + problem.data.values
    rng, forces = np.random.default_rng(0), []
    for _ in range(10):
        values = made + 0.005 * rng.standard_normal(made.shape)
        again = replace(problem, data=replace(problem.data, values=values))
        forces.append(predict_tap(again, solve(again, best.x), tap).force)
    spread = np.linalg.norm(banded.predict(0).spread)
    # ten tell it to a quarter, the noise found to a sixth
    assert spread == pytest.approx(np.linalg.norm(np.std(forces, axis=0, ddof=1)), rel=0.4)


def test_taps_of_a_softer_tip_lie_outside(banded):
    soft = taps_of(law=fi.Contact.power(0.7 * LAW.stiffness, LAW.exponent), speeds=(0.7,))[0]
    one = banded.against(soft)
    assert not one["tap 1, width"].inside and one["tap 1, width"].beyond > 0.02  # longer by a tenth
    assert one["tap 1, peak"].own_width < banded.against(soft, calibration=0.05)["tap 1, peak"].own_width / 4.0


def test_the_width_of_a_half_sine_is_two_thirds_of_it():
    time = np.arange(400) / RATE
    pulse = np.sin(np.pi * np.clip((time - 3e-3) / 2e-3, 0.0, 1.0))
    assert widths(pulse[None], RATE)[0] == pytest.approx(2e-3 * 2.0 / 3.0, rel=1e-3)  # the kink of 25 samples aliases
