"""What a change of the bodies does to a blow tells the errors of its modes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from comparing import worst
from test_collision import thinned_blow

import fem_impact as fi
from fem_impact.impact import what_if


@pytest.mark.parametrize(
    ("seed", "low", "high"),
    [*((seed, 1.0, 4.0) for seed in (0, 2, 4, 8, 12, 14, 16, 21)),  # 1.2 to 2.7 times the true one were measured
     *((seed, 0.5, 3.0) for seed in (55, 105, 123, 151, 183, 206, 274))],  # 0.6 to 1.4; runs agree by chance here
)  # fmt: skip
def test_error_of_leaving_out_modes_is_neither_below_the_true_one_nor_far_above(seed, low, high):
    """Both blows at the same small step error."""
    plate, kept, how, where = thinned_blow(seed)
    few, truth = (fi.strike(each, *how, **where, tolerance=1e-6) for each in (plate.truncated(n_modes=kept), plate))
    true = worst(few, truth)
    assert low * true < few.error.truncation < high * true  # 0.3 to 10 are promised


@pytest.mark.parametrize(("mass", "stiffness", "x"), [(0.016, 9.2e5, 0.525), (0.14, 3.2e5, 0.5), (0.012, 2.9e5, 0.8)])
def test_a_body_known_by_two_modes_and_its_compliance_says_what_the_others_do(mass, stiffness, x):
    """A hinged beam of 1 kg; struck near a node of its second mode, the errors told were 20 and 5 000 times too small.

    The estimate is right within a factor: 1.3 is allowed.
    """
    n, places = np.arange(1, 61), np.array([0.5, 0.525, 0.8])
    omega, shapes = 100.0 * n**2, np.sqrt(2.0) * np.sin(np.pi * np.outer(places, n))
    compliance = (shapes / (2.0 * np.pi * omega) ** 2) @ shapes.T
    body = {"points": places[:, None], "mass": 1.0}
    full = fi.Modes.from_arrays(omega, shapes, **body, complete=True)
    known = fi.Modes.from_arrays(omega[:2], shapes[:, :2], **body, compliance=compliance)
    law, blow = fi.Contact.linear(stiffness), {"at": [x], "speed": 1.0}
    truth = fi.strike(full, fi.Striker.rigid(mass), law, **blow, tolerance=1e-6)
    hit = fi.strike(known, fi.Striker.rigid(mass), law, **blow, tolerance=0.1)
    told = max(hit.error.of_quantity(name) for name in ("restitution", "impulse", "contact_time", "force"))
    assert 0.1 * told < worst(hit, truth) < 1.3 * told


def test_a_number_of_impacts_that_the_modes_left_out_may_change_is_doubted_aloud():
    """Forty modes of a plate see one impact, all modes two; a spring for the others does not decide it."""
    g = np.random.default_rng(777 + 216)
    width, zeta = g.uniform(0.5, 1.0), float(g.choice([0.0, 0.002, 0.01]))
    at = (g.uniform(0.05, 0.95), g.uniform(0.05, 0.95) * width)
    mass, speed = 10 ** g.uniform(-2.0, 0.0), 10 ** g.uniform(-0.5, 0.5)
    exponent = float(g.choice([1.0, 1.5, 1.5]))
    law = fi.Contact.power(10 ** (g.uniform(3.5, 5.7) if exponent == 1.0 else g.uniform(5.0, 7.5)), exponent)

    def blow(n_modes, **asked):
        kept = {"mass": 0.2, "first_frequency": 100.0, "n_modes": n_modes, "damping_ratio": zeta}
        plate = fi.analytic.rectangle(1.0, width, **kept)
        return fi.strike(plate, fi.Striker.rigid(mass), law, at=at, speed=speed, tolerance=1e-2, **asked)

    few, many, averaged = blow(40), blow(3000), blow(40, quantity="impulse")
    assert few.n_impacts == 1 and many.n_impacts == 2
    assert many.tolerance_met and not few.tolerance_met
    assert "number of impacts cannot be determined" in few.verdict or "modes" in few.verdict
    assert averaged.error.total < few.error.total  # what does not ask for the number is not told to doubt it


def test_contact_the_modes_cannot_resolve_says_so():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=30)
    hit = fi.strike(plate, fi.Striker.rigid(0.02), fi.Contact.linear(1e7), at=(0.465, 0.31), speed=1.0, max_impacts=1)
    assert not hit.error.resolvable and hit.error.total == np.inf and "not resolvable" in hit.summary()


def test_a_contact_that_outlasts_the_modes_left_out_is_not_told_the_error_of_a_short_one():
    """A mass twice that of its plate rests on it for 600 periods of the last mode kept, with hardly any ripple."""
    plate = fi.analytic.rectangle(0.63, 0.61, mass=0.2, first_frequency=100.0, n_modes=3000, damping_ratio=0.005)
    how, where = (fi.Striker.rigid(0.474), fi.Contact.linear(1.48e6)), {"at": (0.1015, 0.408), "speed": 3.35}
    few, truth = (fi.strike(each, *how, **where, tolerance=1e-5) for each in (plate.truncated(n_modes=800), plate))
    true = worst(few, truth)
    assert true < few.error.truncation < 50.0 * true  # 26 was measured, and 148 where a forecast alone decided


@pytest.mark.parametrize("seed", [0, 2, 3, 6, 7, 9, 12])
def test_restitutions_of_impacts_tell_their_errors(seed):
    """Points part as fast as the bodies ring there: modes left out count for more than in other quantities."""
    plate, few, how, where = thinned_blow(seed)
    truth, steps = (fi.strike(plate, *how, **where, tolerance=tolerance) for tolerance in (1e-7, 1e-2))
    modes = fi.strike(plate.truncated(n_modes=few), *how, **where, tolerance=1e-3)
    for hit, most in ((steps, 100.0), (modes, 50.0)):  # 2.5 to 43 and 2 to 36 times the true ones were measured
        assert len(hit.restitution_errors) == hit.n_impacts == truth.n_impacts
        for one, other, told in zip(hit.impacts, truth.impacts, hit.restitution_errors):
            true = abs(one.restitution - other.restitution)
            assert true < told < most * true


def test_impacts_without_a_restitution_have_no_error_of_it():
    plate, _, how, where = thinned_blow(0)
    pressed, whole = (fi.strike(plate, *how, **where, **end) for end in ({"duration": 1e-4}, {"max_impacts": 1}))
    assert pressed.impacts[-1].restitution is None and pressed.restitution_errors == (None,)
    assert whole.restitution_errors[0] > 0.0
    simplified = replace(whole, error=replace(whole.error, idealisation=1e-3))  # of a target that does not ring
    assert simplified.restitution_errors == (None,)


def test_a_change_whose_bodies_do_not_part_counts_in_full():
    """It is no reason to refuse the blow itself."""

    def again(parts):
        raise fi.SimulationError("no final separation was reached")

    blow = SimpleNamespace(
        options=SimpleNamespace(quantities={}, n_quantities=5), runs=SimpleNamespace(error=np.zeros(8), coarse=None),
        pace=None, again=again,
    )  # fmt: skip
    found = what_if.what_if(blow, [what_if.Variation("truncation", [[((), 0.1, 0.1)]])])
    np.testing.assert_allclose(found["truncation"], np.ones(8), rtol=0.0)


def test_modes_that_a_hard_layer_excites_are_counted():
    """With those of the whole contact the force missed 1e-2 by as much again, and a quarter of that was stated."""
    stick, law = fi.Striker.stick(0.059, 2259.0), fi.Contact.layers(4.21e5, 1.0, depth=1.283e-4, hard_stiffness=1.353e9)
    rough, truth = (
        fi.strike(fi.Modes.rigid(1e9), stick, law, at=None, speed=1.036, tolerance=limit) for limit in (1e-2, 1e-5)
    )
    assert worst(rough, truth) < rough.error.total < 1e-2
