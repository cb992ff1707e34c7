"""Every contact law keeps what the rest of the program asks of one; a law that is added needs a line in `MADE`."""

import mpmath as mp
import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.impact.compiled import build, law, misfit
from fem_impact.impact.contact import acting_stiffness, depths_of_surfaces
from fem_impact.scenes.keys import form

MADE = {  # one of each, its own course within the approaches below
    "power": fi.Contact.power(1e7, 1.7, loss=0.1),
    "layers": fi.Contact.layers(1e6, 1.3, depth=2e-4, hard_stiffness=1e9, loss=0.2),
    "elastic_plastic": fi.Contact.elastic_plastic(1e8, yield_approach=1e-4),
    "felt": fi.Contact.felt(1e8, 2.0, hysteresis=0.4, relaxation=1e-3),
    "of": fi.Contact.of(lambda d: 1e7 * d**1.7 + 1e13 * d**3.2, deepest=2e-3),
}
TABLES: list[np.ndarray] = []  # kept while their springs are asked
APPROACHES = np.array([3e-5, 1.3e-4, 2.7e-4, 6e-4])
AT, SLOPES, STEEP, SIMPLE = (
    build.plain(getattr(law, name)) for name in ("point_at", "mean_slopes", "steepness", "simple")
)
each_law = pytest.mark.parametrize("contact", [MADE[each.name] for each in law.LAWS], ids=[e.name for e in law.LAWS])
POWERS = [fi.Contact.power(k, a) for k, a in ((1e5, 1.0), (1e7, 1.5), (1e4, 0.7))]
each_course = pytest.mark.parametrize("contact", [*MADE.values(), *POWERS], ids=[*MADE, "linear", "hertz", "soft"])


def spring_of(contact, compliance=0.0):
    """The spring of a contact that has not been pressed; that of one's own law is read where its table lies."""
    TABLES.append(law.table([contact.numbers._replace(compliance=compliance)]))
    return build.plain(law.spring_of)(TABLES[-1], 0)


@pytest.mark.parametrize(
    "k, a, c", [(1e5, 1.0, 0.0), (1e7, 1.5, 0.0), (3e6, 1.3, 0.0), (1e5, 1.0, 3e-6), (1e7, 1.5, 1e-7), (1e4, 0.7, 1e-5)]
)
def test_compression_and_series_spring_make_up_the_approach(k, a, c):
    spring, step = SIMPLE(k, a, 0.0, c), 1e-12
    for d in (1e-12, 1e-6, 1e-3, 1.0):
        point = AT(d, spring)
        assert_allclose(point.force, k * point.compression**a, rtol=1e-14)
        assert_allclose(point.compression + c * point.force, d, rtol=1e-14)
    assert AT(-1e-3, spring)[2:] == (0.0, 0.0)
    # average slopes of close approaches, whose differences would lose all digits, err by the square of the distance
    energy, force = SLOPES(AT(2e-4 - step, spring), AT(2e-4 + step, spring), spring)
    point = AT(2e-4, spring)
    tangent = a * point.force / point.compression
    assert_allclose([energy, force], [point.force, tangent / (1.0 + c * tangent)], rtol=1e-13)


@pytest.mark.parametrize("a", [1.3, 1.5, 2.5, 3.5])
@pytest.mark.parametrize("apart", [1e-9, 1.9e-4, 2.1e-4, 0.1])  # below and above where a series takes over
def test_average_slopes_are_exact_at_any_distance(a, apart):
    d0, d1, spring = 2e-4, 2e-4 * (1.0 + apart), SIMPLE(1e6, a, 0.0, 0.0)
    with mp.workdps(40):
        span = mp.mpf(d1) - d0
        exact = [float(1e6 / (a + 1) ** n * (mp.mpf(d1) ** (a + n) - mp.mpf(d0) ** (a + n)) / span) for n in (1, 0)]
    assert_allclose(SLOPES(AT(d0, spring), AT(d1, spring), spring), exact, rtol=1e-12)  # r**4 = 1e-16, and rounding


@pytest.mark.parametrize("loss, factor", [(0.0, 1.5), (0.2, 5.0)])
def test_a_step_near_the_peak_is_judged_by_how_far_its_mean_force_is_from_the_law(loss, factor):
    d0, v0, d1, v1, h = motion = 1e-4, 0.9, 1.3e-4, -0.1, 5e-5  # approach [m] and rate [m/s] at both ends, length [s]

    def suggested(mean, peak):
        return build.plain(misfit.misfit)(mean, *motion, SIMPLE(1e6, 1.5, loss, 0.0), peak)

    t = (np.arange(4000) + 0.5) / 4000  # midpoint rule: errs by 1e-8
    d = d0 + t * (h * v0 + t * (3.0 * (d1 - d0) - h * (2.0 * v0 + v1) + t * (2.0 * (d0 - d1) + h * (v0 + v1))))
    mean = (1e6 * d**1.5 * (1.0 + loss * np.gradient(d, t) / h)).mean()
    assert suggested(mean, mean) < 1e-4 * mean  # what Gauss's rule of three nodes misses
    assert_allclose(suggested(1.01 * mean, mean), factor * 0.01 * mean, rtol=0.02)
    assert suggested(mean, 4.0 * mean) == suggested(0.0, mean) == 0.0  # too far from the peak to count


@pytest.mark.parametrize("loss", [0.0, 0.1])
@pytest.mark.parametrize("each", law.LAWS, ids=lambda each: each.name)
def test_forces_with_corners_are_told_from_smooth_ones(each, loss):
    """A corner is where a head's second layer is reached, a contact yields or turns back, or a lossy one lets go."""
    rows = law.table([[1e6, 1.5], [1e6, 1.5, loss, 0.0, each.kind]])
    special = each is not law.LAWS[0]
    assert build.plain(law.special_of)(rows) == (special, special or loss > 0.0)


@each_law
def test_kernels_and_python_know_the_same_force(contact):
    spring = spring_of(contact)
    assert_allclose([AT(d, spring).force for d in APPROACHES], contact.force(APPROACHES), rtol=1e-13)


@each_course
@pytest.mark.parametrize("compliance", [0.0, 1e-7])
def test_the_force_is_the_slope_of_the_energy_and_average_slopes_are_those_of_the_ends(contact, compliance):
    spring = spring_of(contact, compliance)
    for d in APPROACHES:
        low, high = (AT(d * (1.0 + side * 1e-4), spring).energy for side in (-1.0, 1.0))
        assert_allclose((high - low) / (2e-4 * d), AT(d, spring).force, rtol=1e-7)  # of order 1e-4**2
    points = [AT(d, spring) for d in (-1e-4, 1e-7, *APPROACHES)]
    for one, two in ((one, two) for one in points for two in points if one is not two):
        span = two.approach - one.approach
        wanted = (two.energy - one.energy) / span, (two.force - one.force) / span
        assert_allclose(SLOPES(one, two, spring), wanted, rtol=1e-12)


@each_law
def test_the_steepness_of_a_law_is_the_slope_of_its_force(contact):
    spring = spring_of(contact)
    for d in APPROACHES:
        low, high = (AT(d * (1.0 + side * 1e-4), spring).force for side in (-1.0, 1.0))
        assert_allclose(STEEP(d, AT(d, spring).force, spring), (high - low) / (2e-4 * d), rtol=1e-6)


@each_law
def test_an_approach_is_found_from_its_force_and_the_law_that_stands_for_it_stores_as_much(contact):
    if contact.law.hertzian:
        assert_allclose([contact.law.approach(contact, contact.force(d)) for d in APPROACHES], APPROACHES, rtol=1e-13)
    if not contact.law.rated:  # the force of others depends on how long they are pressed
        spring, mass, a = spring_of(contact), 0.1, contact.exponent
        for d in APPROACHES:
            energy = AT(d, spring).energy
            stands = acting_stiffness(contact.numbers, 1.0 / mass, np.sqrt(2.0 * energy / mass))
            # the approach of a law of one's own stands between 2000 of it over eight decades
            assert_allclose(stands * d ** (a + 1.0) / (a + 1.0), energy, rtol=1e-5 if contact.knots else 1e-9)


@each_law
def test_a_new_surface_lies_where_it_is_and_a_fresh_dent_where_kernels_have_it(contact):
    """A dent does not recover, and kernels know how deep it is; of felt no dent but what is still pressed in."""
    rows = law.table([contact.numbers])
    assert_allclose(depths_of_surfaces(rows, np.zeros((1, 1)), np.zeros((1, 1))), 0.0, atol=1e-18)
    if law.row_of(contact).yield_approach:
        dent = build.plain(law.dent)(rows, 0, 3e-4)
        assert dent > 0.0
        assert_allclose(depths_of_surfaces(rows, np.full((2, 1), 3e-4), np.array([[0.0], [9.0]])), dent, rtol=1e-13)


@each_law
def test_its_numbers_have_names_units_and_words(contact):
    own = contact.law
    assert own.name and set(own.numbers) <= set(vars(contact)) and set(own.slopes) <= set(vars(contact))
    assert all(number.axis for number in own.numbers.values())
    if contact.knots:
        return  # no scene can state a function of one's own
    table = contact.table
    assert all(form("contact", own.name, key) for key in table if key != "kind")
    assert getattr(fi.Contact, table.pop("kind"))(**table) == contact
    if own.mark:
        assert own.mark in own.numbers and own.words and own.sentence(contact, lambda value, unit: f"{value} {unit}")
