"""Every contact law keeps what the rest of the program asks of one; a law that is added needs a line in `MADE`."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.impact.compiled import build, law
from fem_impact.impact.contact import acting_stiffness, sunk
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
AT, SLOPES, SMOOTH = (build.plain(getattr(law, name)) for name in ("point_at", "mean_slopes", "smooth_force"))
each_law = pytest.mark.parametrize("contact", [MADE[each.name] for each in law.LAWS], ids=[e.name for e in law.LAWS])
POWERS = [fi.Contact.power(k, a) for k, a in ((1e5, 1.0), (1e7, 1.5), (1e4, 0.7))]
each_course = pytest.mark.parametrize("contact", [*MADE.values(), *POWERS], ids=[*MADE, "linear", "hertz", "soft"])


def spring_of(contact, compliance=0.0):
    """The spring of a contact that has not been pressed; that of one's own law is read where its table lies."""
    TABLES.append(law.table([contact.numbers._replace(compliance=compliance)]))
    return build.plain(law.spring_of)(TABLES[-1], 0)


@each_law
def test_kernels_and_python_know_the_same_force(contact):
    found = [AT(d, spring_of(contact)).force for d in APPROACHES]
    assert_allclose(found, contact.force(APPROACHES), rtol=1e-13)


@each_course
@pytest.mark.parametrize("compliance", [0.0, 1e-7])
def test_the_force_is_the_slope_of_the_energy(contact, compliance):
    spring = spring_of(contact, compliance)
    for d in APPROACHES:
        low, high = (AT(d * (1.0 + side * 1e-4), spring).energy for side in (-1.0, 1.0))
        assert_allclose((high - low) / (2e-4 * d), AT(d, spring).force, rtol=1e-7)  # of order 1e-4**2


@each_course
@pytest.mark.parametrize("compliance", [0.0, 1e-7])
def test_average_slopes_are_those_of_the_ends(contact, compliance):
    spring = spring_of(contact, compliance)
    points = [AT(d, spring) for d in (-1e-4, 1e-7, *APPROACHES)]
    for one in points:
        for two in points:
            if one is not two:
                span = two.approach - one.approach
                wanted = (two.energy - one.energy) / span, (two.force - one.force) / span
                assert_allclose(SLOPES(one, two, spring), wanted, rtol=1e-12)


@each_law
def test_what_collocation_sees_is_the_force_and_its_slope(contact):
    spring = spring_of(contact)
    for d in APPROACHES[spring.corner < APPROACHES] if spring.corner < np.inf else APPROACHES:
        force, slope, _ = SMOOTH(d, 0.0, spring)
        assert_allclose(force, contact.force(d), rtol=1e-13)
        low, high = (SMOOTH(d * (1.0 + side * 1e-4), 0.0, spring)[0] for side in (-1.0, 1.0))
        assert_allclose((high - low) / (2e-4 * d), slope, rtol=1e-6)


@each_law
def test_an_approach_is_found_from_its_force(contact):
    if contact.law.hertzian:
        assert_allclose([contact.law.approach(contact, contact.force(d)) for d in APPROACHES], APPROACHES, rtol=1e-13)


@each_law
def test_the_law_that_stands_for_it_stores_as_much_at_the_same_approach(contact):
    if contact.law.rated:
        return pytest.skip("its force depends on how long it is pressed")
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
    assert_allclose(sunk(rows, np.zeros((1, 1)), np.zeros((1, 1))), 0.0, atol=1e-18)
    if law.row_of(contact).yield_approach:
        dent = build.plain(law.dent)(rows, 0, 3e-4)
        assert dent > 0.0
        assert_allclose(sunk(rows, np.full((2, 1), 3e-4), np.array([[0.0], [9.0]])), dent, rtol=1e-13)


@each_law
def test_its_numbers_have_names_units_and_words(contact):
    own = contact.law
    assert own.name and set(own.numbers) <= set(vars(contact)) and set(own.slopes) <= set(vars(contact))
    assert all(number.axis for number in own.numbers.values())
    if contact.knots:
        return pytest.skip("no scene can state a function of one's own")
    words = [form("contact", own.name, key) for key in contact.table if key != "kind"]
    assert all(words)
    table = contact.table
    assert getattr(fi.Contact, table.pop("kind"))(**table) == contact
    if own.mark:
        assert own.mark in own.numbers and own.words and own.sentence(contact, lambda value, unit: f"{value} {unit}")
