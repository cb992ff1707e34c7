"""Force laws: their numbers, their limits, their errors."""

from functools import partial
from types import SimpleNamespace

import numpy as np
from comparing import refusing
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.impact.contact import loss_number


def test_power_law_force_in_numbers():
    law = fi.Contact.power(4.0, 1.5, loss=0.5)
    assert_allclose(law.force([0.25, 0.25, -1.0], [0.0, 2.0, 3.0]), [0.5, 1.0, 0.0], rtol=1e-15)
    assert law.force(0.25, -10.0) == 0.0  # the loss alone would pull
    assert fi.Contact.restituting(1e6, 1.5, restitution=1.0, speed=1.0).loss == 0.0


def test_sphere_on_plate_has_hertz_stiffness():
    steel = fi.Material(E=210e9, nu=0.3, rho=7850.0)
    ball = fi.Striker.sphere(steel, 0.01)
    law = fi.Contact.between(ball, fi.Plate(steel, 0.002))
    assert_allclose(law.stiffness, 4.0 / 3.0 * 210e9 / (2.0 * (1.0 - 0.09)) * 0.1, rtol=1e-14)
    assert law.exponent == 1.5
    assert_allclose(ball.mass, 4.0 / 3.0 * np.pi * 1e-6 * 7850.0, rtol=1e-14)


@settings(max_examples=40)
@given(st.floats(0.05, 1.0))
def test_loss_number_solves_hunt_and_crossley(restitution):
    number = loss_number(restitution)
    excess = np.log1p(number) - np.log1p(-restitution * number) - number * (1.0 + restitution)
    # the logarithm's argument 1 - e L falls to exp(-1/e) at the strongest loss and amplifies rounding by its inverse
    assert abs(excess) <= 1e-15 / max(1.0 - restitution * number, 1e-12) * max(1.0, number)


SPHERE = fi.Striker.sphere(fi.Material(E=1e9, nu=0.3, rho=1.0), 0.1)
WOODEN = SimpleNamespace(material="wood")


test_errors_name_argument_rule_and_value = refusing([
    (lambda: fi.Contact.linear(0.0), r"stiffness must be positive, got 0 N/m\*\*exponent"),
    (lambda: fi.Contact.hertz(float("nan")), "stiffness must be finite"),
    (lambda: fi.Contact.linear(1e5, loss=-1.0), "loss must not be negative, got -1 s/m"),
    (lambda: fi.Contact.linear(1e5, gap=float("inf")), "gap must be finite"),
    (lambda: fi.Contact.restituting(1e5, 1.5, restitution=1.2, speed=1.0), "restitution must lie between"),
    (lambda: fi.Contact.restituting(1e5, 1.5, restitution=0.5, speed=0.0), "speed must be positive"),
    (lambda: fi.Contact.between(fi.Striker.rigid(1.0), None), "sphere must be made by Striker.sphere"),
    (lambda: fi.Contact.between(SPHERE, WOODEN), "plate must have an isotropic material"),
    (lambda: fi.Contact.between(SPHERE, fi.Beam.circular(SPHERE.material, diameter=0.01)), "plate must be flat"),
    (lambda: fi.Contact(1e6, 1.5, loss=0.1, hysteresis=0.5, relaxation=1e-3), "loss and hysteresis"),
    (lambda: fi.Contact(1e6, 1.5, yield_approach=1e-4, hard_stiffness=1e9), "yield_approach and hard_stiffness"),
    (lambda: fi.Contact(1e6, 1.5, hysteresis=0.5), "relaxation must be positive"),
    (lambda: fi.Contact(1e6, 0.7, yield_approach=1e-4), "exponent must be at least 1"),
    (lambda: fi.Contact(1e6, 1.5, hysteresis=1.5, relaxation=1e-3), "hysteresis"),
    *(
        (partial(fi.Contact.elastic_plastic, 1e9, **told), "yield_approach must be given, or yield_speed and mass")
        for told in ({}, {"yield_speed": 0.1}, {"yield_speed": 0.1, "mass": 1.0, "yield_approach": 1e-4})
    ),
])  # fmt: skip


def test_a_sphere_yields_first_at_johnsons_speed():
    """Contact Mechanics, 11.5: m v**2 / 2 = 53 R**3 Y**5 / E***4 for a sphere on a half space; his 53 is rounded."""
    steel, strength, radius = fi.Material(E=210e9, nu=0.3, rho=7850.0), 1e9, 5e-3
    ball = fi.Striker.sphere(steel, radius)
    law = fi.Contact.between(ball, steel, yield_strength=strength)
    energy = law.stiffness * law.yield_approach**2.5 / 2.5
    modulus = 0.5 * 210e9 / (1.0 - 0.09)
    assert_allclose(energy, 53.0 * radius**3 * strength**5 / modulus**4, rtol=0.01)
    speed = np.sqrt(2.0 * energy / ball.mass)
    again = fi.Contact.elastic_plastic(law.stiffness, yield_speed=speed, mass=ball.mass)
    assert_allclose(again.yield_approach, law.yield_approach, rtol=1e-14)


def test_forces_have_no_jump_where_the_law_changes():
    for law, bend, slope in (
        (fi.Contact.layers(1e5, 1.2, depth=1e-3, hard_stiffness=1e7), 1e-3, 1.2e5 * 1e-3**0.2),
        (fi.Contact.elastic_plastic(1e9, yield_approach=1e-4), 1e-4, 1.5e9 * 1e-4**0.5),
    ):
        below, at, above = law.force(bend * np.array([1.0 - 1e-6, 1.0, 1.0 + 1e-6]))
        assert_allclose([at - below, above - at], slope * bend * 1e-6, rtol=2e-2)  # (1e-6)**1.5 of a hard layer
