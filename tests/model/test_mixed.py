"""Modes below a frequency, an infinite plate above: against all modes, in closed form and by finite elements."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.impact.error import Error
from fem_impact.model import mixed
from fem_impact.model.target import Stages

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
LENGTH, WIDTH, AT = 0.4, 0.3, (0.13, 0.11)
BALL = fi.Striker.rigid(4.11e-3)  # 10 mm of steel
HARD = fi.Contact.hertz(1.09e10)


def mobility(thickness):
    """Of an infinite steel plate of a thickness [m], in m/(N s)."""
    rigidity = STEEL.E * thickness**3 / 12.0 / (1.0 - STEEL.nu**2)
    return 0.125 / np.sqrt(rigidity * STEEL.rho * thickness)


def modes(thickness, highest, size=1.0):
    """All modes of the hinged plate, of another size, up to a frequency [Hz]."""
    section = fi.Plate(STEEL, thickness)
    return fi.analytic.rectangle(size * LENGTH, size * WIDTH, section=section, max_frequency=highest).damped(1e-3)


def strike(body, *, at=AT, speed=1.0, tolerance=1e-3):
    return fi.strike(body, BALL, HARD, at=at, speed=speed, tolerance=tolerance)


def system(thickness, size=1.0):
    """The same plate, to be meshed."""
    plate = fi.mesh.rectangle(size * LENGTH, size * WIDTH)
    return fi.assemble(plate, fi.Plate(STEEL, thickness), {"boundary": "hinged"})


def test_modes_and_what_stands_above_them_are_the_infinite_plate():
    """Before any echo: with modes as dense as those of a wide plate, the mobility is real and that of the plate."""
    wanted, frequency, density = 0.04, 1e4, 400
    above, shape, rest = mixed.absorbing_oscillators(wanted, frequency, 1e8)
    edges = 2.0 * np.pi * frequency * np.geomspace(1e-6, 1e3, 9 * density + 1)
    low = np.sqrt(edges[1:] * edges[:-1])
    squared = 2.0 * wanted / np.pi * np.diff(edges) * mixed.kept_share(low, wanted, above, shape)
    damped = 2e-2  # [-] ratio that makes the sum over the low modes an integral, for frequencies off its edges
    for omega in 2.0 * np.pi * frequency * np.array([1e-2, 0.1, 0.5, 2.0, 10.0, 100.0]):
        low_part = 1j * omega * (squared / (low**2 - omega**2 + 2j * damped * low * omega)).sum()
        high = 2.0 * np.sin(mixed.ANGLE) * above * omega
        high_part = 1j * omega * ((shape**2 / (above**2 - omega**2 + 1j * high)).sum() + rest)
        # the damping that smooths the low sum changes it by 2 / pi times the ratio
        assert_allclose(low_part + high_part, wanted, rtol=0.03, err_msg=f"{omega:g} rad/s")


def test_share_that_modes_keep_falls_from_one_to_zero():
    above, shape, _ = mixed.absorbing_oscillators(0.04, 1e4, 1e9)
    ratio = np.array([0.0, 0.01, 0.1, 0.5, 1.0, 2.0, 10.0])
    share = mixed.kept_share(2e4 * np.pi * ratio, 0.04, above, shape)
    assert (np.diff(share) < 0.0).all() and share[0] == 1.0
    assert share[2] > 0.999 and 0.3 < share[4] < 0.7 and share[5] < 0.02


def test_what_lies_above_the_oscillators_gives_as_more_of_them_would():
    static = [(shape**2 / omega**2).sum() + rest for omega, shape, rest in
              (mixed.absorbing_oscillators(0.04, 1e4, highest) for highest in (2e4, 1e5, 1e8))]  # fmt: skip
    assert_allclose(static, static[-1], rtol=1e-4)  # a sum in place of an integral: RATIO**2 / 24 = 5e-5


@pytest.mark.parametrize("frequency", [2e4, 8e4])
def test_blow_errs_by_no_more_than_it_states(frequency):
    """A plate of 1 mm, of which 15 190 modes tell everything: a ball that stops dead and is thrown back by echoes."""
    whole = modes(1e-3, 4e5)
    true = strike(whole)
    hit = strike(mixed.mixed_plate(whole, AT, mobility(1e-3), frequency, 4e5))
    assert hit.bodies[-1].n_modes < 0.5 * whole.n_modes
    # until the echo the plate is infinite: the modes err by 1e-3 there themselves
    assert_allclose(hit.peak_force, true.peak_force, rtol=3e-3)
    error = abs(hit.restitution - true.restitution)
    assert error <= hit.error.total
    assert error < 2e-3


def test_half_the_frequency_is_the_poorer_description():
    body = mixed.mixed_plate(modes(1e-3, 1e5), AT, mobility(1e-3), 4e4, 4e5)
    assert list(body.poorer) == ["idealisation"]
    assert body.poorer["idealisation"].omega[-1] > 0.9 * body.omega[-1]
    hit = strike(body)
    assert hit.error.idealisation > 0.0 and "simplified" in hit.error.dominant[0]


def test_ball_on_a_thin_sheet_is_planned_in_both_ways():
    """By all modes it would need some 90 000; in closed form there may be so many, by elements not."""
    blow = {"at": AT, "speed": 1.0, "tolerance": 1e-2}
    plan = fi.plan(system(0.5e-3), BALL, HARD, **blow)
    assert plan.target == "mixed" and plan.meets and plan.element == "argyris"
    assert "above, it is treated as an infinite plate of mobility 0.0407 m/(N s)" in str(plan)
    assert fi.plan(system(5e-3), BALL, HARD, **blow).target != "mixed"  # where the ball bounces off


BEAM = fi.mesh.line(0.4), fi.Beam(STEEL, width=0.02, height=1e-3), {"left": "hinged", "right": "hinged"}
ONLY = "is only for thin plates in a vacuum, and for the blow alone"


@pytest.mark.parametrize(("body", "asked", "words"), [
    (None, {"at": AT, "quantity": "sound=1000"}, ONLY), (None, {"at": AT, "stretching": True}, ONLY),
    (BEAM, {"at": 0.13}, "is not available for this body"),
], ids=["sound", "stretching", "beam"])  # fmt: skip
def test_what_it_does_not_know_is_refused(body, asked, words):
    target = fi.assemble(*body) if body else system(1e-3)
    with pytest.raises(ValueError, match=f"target = 'mixed' {words}; use target = 'modal'$"):
        fi.plan(target, BALL, HARD, speed=1.0, target="mixed", **asked)


@pytest.mark.parametrize(("truncation", "more"), [(5e-3, False), (0.5, True)])
def test_vectors_do_not_grow_where_a_higher_frequency_must_come_first(truncation, more):
    """By which the plate is struck with vectors of its own: of a speed of 1e10 m/s, that took half of 20 s."""
    blow = {"at": AT, "speed": 1.0, "tolerance": 1e-2}
    described = fi.plan(system(0.5e-3), BALL, HARD, **blow).description
    seen = SimpleNamespace(count=400, improved=lambda *_: False)
    hit = SimpleNamespace(
        error=Error(1e-5, truncation, 1e-3, idealisation=0.1), bodies=[SimpleNamespace(n_modes=100)],
        history=SimpleNamespace(steps=np.zeros((10, 1))),
    )  # fmt: skip
    better = replace(described, ritz=seen, compared=True).refined(hit, Stages())
    assert seen.count == (800 if more else 400)
    assert better.frequency == described.frequency * (1.0 if more else 2.0)


@pytest.mark.slow
def test_sheet_by_elements_against_all_modes():
    """A plate of 0.75 mm, of which Ritz vectors alone cannot tell the number of impacts."""
    at = (0.75 * AT[0], 0.75 * AT[1])
    true = strike(modes(0.75e-3, 4e5, 0.75), at=at)
    how = {"at": at, "speed": 1.0, "tolerance": 1e-2, "damping_ratio": 1e-3}
    with warnings.catch_warnings(action="ignore"):  # whether it touches once more cannot be told from 1000 vectors
        run = fi.plan(system(0.75e-3, 0.75), BALL, HARD, **how).run()
    hit = run.response
    assert run.plan.target == "mixed"
    assert abs(hit.restitution - true.restitution) <= min(5e-3, hit.error.total)
    assert_allclose([hit.impulse, hit.peak_force], [true.impulse, true.peak_force], rtol=1e-2)


def test_no_plate_counts_as_infinite_for_waves_whose_echo_comes_within_a_turn():
    frequency = mixed.first_frequency(mass=1.0, mobility=1.0, echo=1e-4, duration=1.0)
    assert 2.0 * np.pi * frequency * 1e-4 > 2.0 * np.pi


def test_the_striker_hardly_swings_above_the_first_frequency():
    """A mass against a dashpot of 1 / mobility: the higher the frequency, the less of its speed it gives or takes."""
    mass, mobility = 0.01, 0.04
    omega = 2.0 * np.pi * mixed.first_frequency(mass, mobility, echo=1e6, duration=1e-6)
    assert abs(1.0 / (1.0 + 1j * omega * mass * mobility)) < 0.25
    soft = 2.0 * np.pi * mixed.first_frequency(mass, mobility, echo=1e6, duration=1.0)
    assert soft > np.pi  # of a contact longer than that: above the contact resonance, pi over its duration
