"""Bands of taps predicted by a fit hold nine tenths of what is measured; taps of another contact lie outside."""

from dataclasses import replace

import numpy as np
import pytest
from hammer_taps import LAW, RANGES, RATE, STRUCTURE, taps_of

import fem_impact as fi
from fem_impact.taps.against import widths
from fem_impact.taps.predictions import predicted
from fem_impact.taps.solver import solve

SPEEDS = (0.4, 0.6, 0.8, 1.0)


@pytest.fixture(scope="module")
def found():
    return fi.fit(
        taps_of(STRUCTURE, [0.0], speeds=SPEEDS, noise=0.005), target=STRUCTURE, at=[0.0], contact=LAW, starts=1,
        striker=fi.Striker.rigid(0.1), unknown=RANGES, profiles=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def new():
    taps = taps_of(STRUCTURE, [0.0], speeds=(0.5, 0.7, 0.9), noise=0.005)
    return fi.Taps.from_arrays([tap.force[0, :500] for tap in taps], rate=RATE)


def test_taps_left_out_and_new_ones_lie_in_their_bands(found, new):
    """Of 14 numbers 9 or fewer inside have a probability of 1 % at nine tenths; of hundreds of samples seven tenths."""
    for measured, taps in ((None, found.taps), (new, new)):
        one = found.against(measured)
        assert len(one.verdicts) == 2 * taps.n_taps and one.n_inside >= len(one.verdicts) - 2
        assert 0.7 < np.mean([trace.inside.mean() for trace in one.traces]) < 0.98  # nine tenths; the rest's noise is
        # known from nine samples only, to a quarter
    assert found.misfit < 0.6 * found.error  # most of what is left is noise


def test_a_band_holds_what_the_values_leave_open(found):
    """The spread is that of fits to the same taps with other noise."""
    problem, best, tap = found.problem, found.best, found.taps.pick(0)
    made = problem.residual(best.x).reshape(problem.data.values.shape) + problem.data.values
    rng, forces = np.random.default_rng(0), []
    for _ in range(20):
        values = made + 0.005 * rng.standard_normal(made.shape)
        again = replace(problem, data=replace(problem.data, values=values), _last={})
        forces.append(predicted(again, solve(again, best.x), tap).force)
    spread = np.linalg.norm(found.predict(0).spread)
    assert spread == pytest.approx(np.linalg.norm(np.std(forces, axis=0, ddof=1)), rel=0.4)  # 20 tell it to a sixth,
    # as does the noise found


def test_taps_of_a_softer_tip_lie_outside(found):
    soft = taps_of(STRUCTURE, [0.0], law=fi.Contact.power(0.7 * LAW.stiffness, LAW.exponent), speeds=(0.7,))[0]
    one = found.against(soft)
    assert not one["tap 1, width"].inside and one["tap 1, width"].beyond > 0.02  # longer by a tenth
    assert one["tap 1, peak"].own_width < found.against(soft, calibration=0.05)["tap 1, peak"].own_width / 4.0


def test_the_width_of_a_half_sine_is_two_thirds_of_it():
    time = np.arange(400) / RATE
    pulse = np.sin(np.pi * np.clip((time - 3e-3) / 2e-3, 0.0, 1.0))
    assert widths(pulse[None], RATE)[0] == pytest.approx(2e-3 * 2.0 / 3.0, rel=1e-3)  # the kink of 25 samples aliases
