"""The choice of a hammer against a bisection over single blows, on bodies and hammers that were not used to make it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.model.target import Target
from fem_impact.sweeps import bodies, hammers

PLATE = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=300)
AT = (0.465, 0.3)
BODIES = {  # bodies, points and hammers, each drawn once and kept
    "plate": (PLATE, (0.71, 0.52), 0.005),
    "clamped disk": (fi.analytic.disk(0.15, mass=0.1, first_frequency=300.0, n_modes=120), (0.04, 0.0), 0.02),
    "beam": (fi.analytic.beam(0.5, ends=("free", "free"), mass=0.4, first_frequency=60.0, n_modes=30), 0.11, 0.05),
}


def impacts(modes, at, mass, tip):
    return fi.strike(modes, fi.Striker.rigid(mass), fi.Contact.linear(tip), at=at, speed=0.7, tolerance=1e-5).n_impacts


def last_single(modes, at, mass, good, bad):
    """The hardest tip that hits once between one that does and one that does not."""
    while bad / good > 1.0001:
        middle = (good * bad) ** 0.5
        good, bad = (middle, bad) if impacts(modes, at, mass, middle) == 1 else (good, middle)
    return good


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.slow
def test_the_tips_that_hit_once_end_where_a_bisection_over_single_blows_ends(name):
    modes, at, mass = BODIES[name]
    (hammer,) = hammers.choose(modes, at, 300.0, [mass])
    low, high = max(hammer.single, key=lambda ends: ends[1] / ends[0])
    assert {impacts(modes, at, mass, tip) for tip in np.geomspace(low, high, 6)} == {1}
    bad = 1.05 * high  # 5 %: gaps and ranges narrower than 2 % may be missed
    assert impacts(modes, at, mass, bad) != 1
    assert high == pytest.approx(last_single(modes, at, mass, high, bad), rel=2.0 * hammers.WIDTH)


def test_which_tips_hit_once_does_not_depend_on_the_bandwidth():
    one, other = (hammers.choose(PLATE, AT, bandwidth, [0.02])[0] for bandwidth in (300.0, 600.0))
    assert one.limit == other.limit
    assert_allclose(one.single[-1][1], other.single[-1][1], rtol=2.0 * hammers.WIDTH)
    assert one.softest < other.softest


@pytest.mark.slow
def test_the_last_mass_that_works_is_found_between_two():
    """As computed with single blows: it works, a hammer 2 % heavier has no tip that does (both ends are to 0.5 %)."""
    light, border, heavy = hammers.choose(PLATE, AT, 500.0, [0.05, 0.02], between=True)
    assert (light.border, border.border, heavy.border) == (False, True, False)
    assert light.mass < border.mass < heavy.mass
    assert border.works and not heavy.works

    def working(mass):
        tips = np.geomspace(0.95 * border.softest, 1.05 * border.hardest, 25)  # 0.5 % apart
        hits = [fi.strike(PLATE, fi.Striker.rigid(mass), fi.Contact.linear(tip), at=AT, speed=1.0) for tip in tips]
        return any(hit.n_impacts == 1 and hammers.bandwidth_of(hit, 10.0) >= 500.0 for hit in hits)

    assert working(0.98 * border.mass) and not working(1.02 * border.mass)
    assert hammers.choose(PLATE, AT, 500.0, [0.02, 0.01], between=True)[0].mass == 0.01  # ascending, without a border


@pytest.mark.parametrize("number", [1, 2, 5, 10, 37])
def test_hammers_are_tried_in_an_order_that_tells_the_time_left(number):
    """If each takes longer than the last lighter one, the mean of the first few is that of all: within a third."""
    order = hammers._mixed(np.geomspace(1e-3, 1.0, number)[::-1])
    assert sorted(order) == list(range(number))
    seconds = 1.0 + np.arange(number)[::-1][order]
    told = np.cumsum(seconds) / np.arange(1, number + 1)
    assert_allclose(told[3:], seconds.mean(), rtol=0.34)  # in ascending order the first four would tell a quarter of 37


def test_without_a_limit_the_answer_ends_where_the_modes_no_longer_resolve_the_contact():
    (hammer,) = hammers.choose(PLATE, AT, 500.0, [1e-3])
    assert hammer.unlimited and hammer.hardest == hammer.limit
    blow = PLATE, fi.Striker.rigid(1e-3)
    wanted = {"at": AT, "speed": 1.0, "tolerance": 1e-2}
    assert fi.strike(*blow, fi.Contact.linear(hammer.limit), **wanted).error.resolvable
    assert not fi.strike(*blow, fi.Contact.linear(1.1 * hammer.limit), **wanted).error.resolvable


def test_several_ranges_are_all_told():
    (hammer,) = hammers.choose(PLATE, AT, 500.0, [1.0])
    assert len(hammer.single) > 1  # 75 kN/m hits twice at any tolerance, softer and harder tips once
    for low, high in hammer.single:
        assert impacts(PLATE, AT, 1.0, 1.001 * low) == impacts(PLATE, AT, 1.0, high / 1.001) == 1
    for (_, before), (after, _) in zip(hammer.single, hammer.single[1:]):
        assert impacts(PLATE, AT, 1.0, (before * after) ** 0.5) != 1


def test_working_tips_hit_once_and_reach_the_bandwidth_and_softer_ones_do_not():
    light, heavy = hammers.choose(PLATE, AT, 500.0, [2e-3, 0.2])
    assert light.works and not heavy.works and heavy.softest is None and heavy.hardest is not None
    for tip, reaches in ((light.softest, True), (light.hardest, True), (0.98 * light.softest, False)):
        hit = fi.strike(PLATE, fi.Striker.rigid(2e-3), fi.Contact.linear(tip), at=AT, speed=1.0)
        assert hit.n_impacts == 1
        assert (hammers.bandwidth_of(hit, 10.0) >= 0.999 * 500.0) == reaches


@pytest.mark.parametrize("mass", [0.01, 5.0])
def test_a_rigid_body_is_hit_once_by_any_tip(mass):
    """Only the bandwidth matters: k = m (2 pi f / reach)**2 with the reduced mass m."""
    bandwidth, body = 800.0, 5.0
    (hammer,) = hammers.choose(fi.Modes.rigid(body), None, bandwidth, [mass])
    exact = mass * body / (mass + body) * (2.0 * np.pi * bandwidth / hammers.half_sine_reach(10.0)) ** 2
    assert_allclose(hammer.softest, exact, rtol=2.0 * hammers.WIDTH)  # and 1e-4 of the blow
    centre = mass * (2.0 * np.pi * bandwidth / hammers.half_sine_reach(10.0)) ** 2  # [N/m] on a body that never yields
    assert hammer.unlimited and len(hammer.single) == 1
    assert_allclose(hammer.single[0], [hammers.SOFTEST * centre, hammers.STIFFEST * centre], rtol=1e-9)  # all tried


# Euphonics 2.2.6: frequencies over the contact frequency where the spectrum of a half sine has fallen, to four digits
PRINTED = {3.0: 1.187, 6.0: 1.637, 10.0: 2.039, 20.0: 2.607}


def test_reach_of_a_half_sine():
    assert_allclose([hammers.half_sine_reach(drop) for drop in PRINTED], [*PRINTED.values()], atol=6e-4)


@pytest.mark.parametrize(("body", "drop"), [(0.05, 3.0), (2.0, 20.0)])  # [kg]
def test_bandwidth_of_two_masses_on_a_linear_spring(body, drop):
    """A half sine of the reduced mass, whatever the speed."""
    mass, stiffness = 0.1, 1e5
    bodies = fi.Modes.rigid(body), fi.Striker.rigid(mass), fi.Contact.linear(stiffness)
    hit = fi.strike(*bodies, at=None, speed=3.0, tolerance=1e-6)
    resonance = np.sqrt(stiffness * (1.0 / mass + 1.0 / body)) / (2.0 * np.pi)
    assert_allclose(hammers.bandwidth_of(hit, drop), hammers.half_sine_reach(drop) * resonance, rtol=1e-3)  # 400 looks


def test_modes_wanted_follow_from_the_hardest_tip():
    """Its contact frequency is sqrt(10) times that of the bandwidth, and modes reach at least four times that far."""
    plate = fi.analytic.rectangle(1.55, 1.0, mass=1e4, first_frequency=100.0, n_modes=20)
    found, light = (
        hammers.highest_frequency(each, AT, 500.0, [0.01, 0.02]) for each in (plate, plate.scaled(mass=0.2))
    )
    assert_allclose(found, 4.0 * np.sqrt(10.0) * 500.0 / hammers.half_sine_reach(10.0), rtol=1e-6)
    assert light > found


def test_on_a_beam_by_elements_tips_end_ten_times_above_the_bandwidth_as_on_a_plate():
    """They went on to where its modes end, a million times harder, in seconds that nobody asks for."""
    beam = fi.Beam.rectangular(fi.Material(E=10e9, nu=0.3, rho=500.0), width=0.03, height=0.01)
    body = fi.assemble(fi.mesh.line(1.0), beam, {"left": "clamped"})
    (hammer,) = hammers.choose(body, 0.7, 500.0, [0.005], damping_ratio=0.01)
    centre = 500.0 / hammers.half_sine_reach(10.0)
    assert hammer.unlimited and hammer.limit == pytest.approx(10.0 * 0.005 * (2.0 * np.pi * centre) ** 2)
    assert hammer.error < hammers.DECIDED


def test_hammers_on_elements_are_those_on_the_closed_form():
    """Ritz vectors, to 6e-3, end a range where no description of the body touches twice any more."""
    wood = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    body = fi.assemble(fi.mesh.rectangle(0.465, 0.3), wood, {"boundary": "hinged"})
    at = (0.2, 0.11)
    light, heavy = hammers.choose(body, at, 500.0, [0.01, 0.05])
    truth = fi.analytic.closed_form(body.mesh, wood, body.supports)(n_modes=600)
    good, bad = heavy.single[0][1] / 1.05, heavy.single[0][1] * 1.05
    assert (impacts(truth, at, 0.05, good), impacts(truth, at, 0.05, bad) > 1) == (1, True)
    assert heavy.hardest == pytest.approx(last_single(truth, at, 0.05, good, bad), rel=0.01)
    assert heavy.error < 6e-3 and not heavy.works
    centre = 500.0 / hammers.half_sine_reach(10.0)
    assert light.unlimited is True and light.limit == pytest.approx(10.0 * 0.01 * (2.0 * np.pi * centre) ** 2)
    hit = fi.strike(truth, fi.Striker.rigid(0.01), fi.Contact.linear(light.softest), at=at, speed=1.0)
    assert hammers.bandwidth_of(hit, 10.0) == pytest.approx(500.0, rel=3e-3)


def test_a_plate_in_air_has_no_more_modes_than_the_bandwidth_asks_for(monkeypatch):
    """300 modes in air took ten minutes; twenty give the ranges of tips that sixty do."""
    plate = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), thickness=4e-3)
    edges = dict.fromkeys(("left", "right", "bottom", "top"), "hinged")
    target = Target(fi.mesh.rectangle(0.4, 0.3), plate, edges, air="both sides")
    found, chosen = bodies.of_hammers, []

    def counted(*given):
        chosen.append(found(*given))
        return chosen[-1]

    monkeypatch.setattr(bodies, "of_hammers", counted)
    few = hammers.choose_on(target, (0.15, 0.11), 100.0, [0.05, 0.2])
    monkeypatch.setattr(bodies, "needed_frequency", lambda case, tolerance: 7000.0)
    many = hammers.choose_on(target, (0.15, 0.11), 100.0, [0.05, 0.2])
    assert [modes.n_modes for (modes,) in chosen] == [20, 59]
    for one, other in zip(few, many):
        assert_allclose(one.softest, other.softest, rtol=2.0 * hammers.WIDTH)
    assert_allclose(few[1].hardest, many[1].hardest, rtol=2.0 * hammers.WIDTH)
