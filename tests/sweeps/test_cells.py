"""One cell of a map: what each axis replaces, on bodies that are seen from each strike point."""

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.modes.shapes import SampledShapes
from fem_impact.sweeps import cells
from fem_impact.sweeps.cells import Case, sample_modes

HERE, THERE = (0.3, 0.2), (0.7, 0.45)
PLATE = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=40)


def case(**more):
    few = ((HERE, 30), (THERE, 20))
    views = {place: sample_modes(PLATE.truncated(n_modes=n), np.array([place])) for place, n in few}
    return Case(views[HERE], fi.Striker.rigid(0.1), fi.Contact.linear(1e5), np.array(HERE), 1.0, views=views, **more)


def test_another_strike_point_brings_the_body_as_seen_from_there():
    moved = case().changed("at", THERE)
    assert moved.modes.n_modes == 20 and moved.at.tolist() == list(THERE)
    with pytest.raises(ValueError, match="at must lie on the body"):
        case().changed("at", (0.1, 0.1))


@pytest.mark.parametrize("names", [("target_mass", "at"), ("at", "target_mass")])
def test_a_change_of_the_body_holds_at_every_strike_point(names):
    values = {"target_mass": 0.4, "at": THERE}
    changed = case().with_values({name: values[name] for name in names})
    assert changed.modes.mass == 0.4 and changed.modes.n_modes == 20
    assert_allclose(changed.modes.shape_at([THERE]), PLATE.truncated(n_modes=20).shape_at([THERE]) / 2**0.5)


def test_frequencies_are_scaled_by_the_first_mode_even_if_no_vector_shows_it():
    """Vectors that start where the first mode rests begin with another: here all are twice the first."""
    known = case(first=50.0).changed("target_frequency", 75.0)
    assert known.first_frequency == 75.0 and case().first_frequency == pytest.approx(100.0)
    assert_allclose(known.modes.omega, 1.5 * PLATE.omega[:30])
    assert_allclose(case().changed("target_frequency", 75.0).modes.omega, 0.75 * PLATE.omega[:30])


def test_reduced_bodies_give_the_same_blow_and_keep_what_is_poorer():
    whole = case()
    reduced = whole.sampled(np.array([HERE, THERE]))
    assert isinstance(reduced.changed("at", THERE).modes.shapes, SampledShapes)
    hits = [fi.strike(one.modes, one.striker, one.contact, at=HERE, speed=1.0) for one in (whole, reduced)]
    assert hits[0].restitution == pytest.approx(hits[1].restitution, abs=1e-12)
    wood = fi.Plate(fi.Material(10e9, 0.3, 450.0), 3e-3)
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3), wood, {"boundary": "hinged"})
    seen = fi.ritz_modes(system, [(0.1, 0.1)], max_frequency=1e3, n_vectors=30)
    small = sample_modes(seen, np.array([(0.1, 0.1)]))
    assert small.poorer["truncation"].n_modes == seen.poorer["truncation"].n_modes == 21  # seven tenths
    assert isinstance(small.poorer["truncation"].shapes, SampledShapes)


RANGE = {"from": 1.0, "to": 100.0, "scale": "log"}


def test_axes_without_a_count_are_as_fine_as_a_picture():
    spring, felt = fi.Contact.linear(1e5), fi.Contact.felt(2e6, 1.5, hysteresis=0.2, relaxation=1e-3)
    both = {"mass": RANGE, "stiffness": {"from": 2.0, "to": 3.0}}

    def sizes(over, law=spring, **wanted):
        found, ours = cells.laid_out(over, law, **wanted)
        return [len(values) for values in found.values()], ours

    assert sizes(both) == ([400, 400], True)
    assert sizes(both, felt) == sizes(both, alone=True) == ([100, 100], True)
    assert sizes({**both, "exponent": [0.9]}) == ([100, 100, 1], True)
    assert sizes(both, cells=30) == ([30, 30], True)
    assert sizes({**both, "speed": [1.0, 2.0]}) == ([282, 282, 2], True)  # 400 x 400 cells in all
    assert sizes({"mass": RANGE, "speed": [1.0, 2.0]}) == ([400, 2], True)
    assert sizes({"mass": [0.1], "speed": {**RANGE, "count": 7}}) == ([1, 7], False)
    assert_allclose(cells.laid_out({"mass": RANGE}, spring, cells=3)[0]["mass"], [1.0, 10.0, 100.0])


test_ranges_of_no_sense_are_told = refusing([
    ({"from": 1.0}, {}, r"mass must be a list or \{ from, to, count, scale"),
    ({"from": 2.0, "to": 1.0}, {}, "mass.to must be above mass.from, got 1 and 2"),
    ({"from": -1.0, "to": 1.0, "scale": "log"}, {}, "mass.from must be positive"),
    ({"from": 0.0, "to": 1.0, "scale": "cube"}, {}, "mass.scale must be one of"),
    ([0.1, 0.2], {"cells": 0}, "cells must be at least 2, got 0"),
], lambda values, how: cells.laid_out({"mass": values}, fi.Contact.linear(1e5), **how))  # fmt: skip


def test_values_typed_with_four_digits_are_evenly_spaced_in_the_logarithm():
    values = np.geomspace(0.01, 10.0, 40)
    assert cells.is_logarithmic(np.array([float(f"{value:.4g}") for value in values]))
    assert not cells.is_logarithmic(values * (1.0 + 3e-3 * (np.arange(40) % 2)))
    assert not cells.is_logarithmic(np.linspace(1.0, 1.02, 5))  # nearly even in the logarithm, too
