"""Force laws: their numbers, their limits, their errors."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.impact.contact import loss_number


def test_power_law_force_in_numbers():
    law = fi.Contact.power(4.0, 1.5, loss=0.5)
    assert_allclose(law.force([0.25, 0.25, -1.0], [0.0, 2.0, 3.0]), [0.5, 1.0, 0.0], rtol=1e-15)
    assert law.force(0.25, -10.0) == 0.0  # the loss alone would pull


def test_sphere_on_plate_has_hertz_stiffness():
    steel = fi.Material(E=210e9, nu=0.3, rho=7850.0)
    ball = fi.Striker.sphere(steel, 0.01)
    law = fi.Contact.between(ball, fi.Plate(steel, 0.002))
    assert_allclose(law.stiffness, 4.0 / 3.0 * 210e9 / (2.0 * (1.0 - 0.09)) * 0.1, rtol=1e-14)
    assert law.exponent == 1.5
    assert_allclose(ball.mass, 4.0 / 3.0 * np.pi * 1e-6 * 7850.0, rtol=1e-14)


@given(st.floats(0.05, 1.0))
def test_loss_number_solves_hunt_and_crossley(restitution):
    number = loss_number(restitution)
    excess = np.log1p(number) - np.log1p(-restitution * number) - number * (1.0 + restitution)
    # the logarithm's argument 1 - e L falls to exp(-1/e) at the strongest loss and amplifies rounding by its inverse
    assert abs(excess) <= 1e-15 / max(1.0 - restitution * number, 1e-12) * max(1.0, number)


def test_no_loss_for_a_perfect_rebound():
    assert fi.Contact.restituting(1e6, 1.5, restitution=1.0, speed=1.0).loss == 0.0


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: fi.Contact.linear(0.0), r"stiffness must be positive, got 0 N/m\*\*exponent"),
        (lambda: fi.Contact.hertz(float("nan")), "stiffness must be finite"),
        (lambda: fi.Contact.power(1e5, 0.4), "exponent must lie between 0.5 and 100"),
        (lambda: fi.Contact.linear(1e5, loss=-1.0), "loss must not be negative, got -1 s/m"),
        (lambda: fi.Contact.linear(1e5, gap=float("inf")), "gap must be finite"),
        (lambda: fi.Contact.restituting(1e5, 1.5, restitution=1.2, speed=1.0), "restitution must lie between"),
        (lambda: fi.Contact.restituting(1e5, 1.5, restitution=0.5, speed=0.0), "speed must be positive"),
        (lambda: fi.Contact.between(fi.Striker.rigid(1.0), None), "sphere must be made by Striker.sphere"),
        (
            lambda: fi.Contact.between(
                fi.Striker.sphere(fi.Material(E=1e9, nu=0.3, rho=1.0), 0.1), SimpleNamespace(material="wood")
            ),
            "plate must have an isotropic material",
        ),
    ],
)
def test_errors_name_argument_rule_and_value(make, text):
    with pytest.raises(ValueError, match=text):
        make()
