"""Sections: stiffness and mass per length or area, and what is refused."""

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose

from fem_impact.fe.material import Material, yield_strength
from fem_impact.fe.section import Beam, Plate

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
POINT = np.zeros((1, 2))


def test_equal_moduli_are_isotropic_at_any_angle_and_grain_turned_by_a_right_angle_swaps_the_axes():
    same = Material.orthotropic(E_along=210e9, E_across=210e9, nu=0.3, G=210e9 / 2.6, rho=7850.0, angle=0.7)
    assert_allclose(same.plane_stress, STEEL.plane_stress, rtol=1e-13, atol=1e-3)  # rounding of 1e11 Pa

    wood = {"E_along": 11e9, "E_across": 0.8e9, "nu": 0.3, "G": 0.7e9, "rho": 450.0}
    along = Material.orthotropic(**wood).plane_stress
    turned = Material.orthotropic(**wood, angle=np.pi / 2).plane_stress
    assert_allclose(turned[[1, 0, 2]][:, [1, 0, 2]], along, rtol=1e-12, atol=1e-5)  # cos(pi/2) is 6e-17, not 0
    assert_allclose(along[0, 0], 11e9 / (1 - 0.3**2 * 0.8 / 11), rtol=1e-14)


def test_sections_of_beams_and_plates_that_vary():
    bar, rod = Beam.rectangular(STEEL, width=0.02, height=0.01), Beam.circular(STEEL, diameter=0.01)
    assert_allclose(bar.stiffness(POINT[:, :1]), 210e9 * 0.02e-6 / 12)
    assert_allclose(rod.stiffness(POINT[:, :1]), 210e9 * np.pi * 0.01**4 / 64)
    assert_allclose(rod.inertia(POINT[:, :1]), 7850 * np.pi * 0.01**2 / 4)
    wedge = Plate(STEEL, lambda x: 1e-3 * (1 + x[:, 0]))
    assert_allclose(wedge.inertia(np.array([[0.0, 0.0], [1.0, 0.0]])), [7.85, 15.7])


test_refuses_what_no_material_does = refusing([
    (lambda: Material(E=-1.0, nu=0.3, rho=1.0), "E must be positive, got -1 Pa"),
    (lambda: Material(E=1.0, nu=0.6, rho=1.0), "nu must be above -1 and at most 0.5, got 0.6"),
    (lambda: Material(E=1.0, nu=-1.0, rho=1.0), "nu must be above -1"),
    (lambda: Material.orthotropic(E_along=1.0, E_across=4.0, nu=0.5, G=1.0, rho=1.0), "release energy"),
    (lambda: Material(E=1.0, nu=0.3, rho=1.0, yield_strength=-1.0), "yield_strength must be positive, got -1 Pa"),
    (lambda: Plate(STEEL, 0.0), "thickness must be positive, got 0 m"),
    (lambda: Plate(STEEL, lambda x: x[:, 0]).inertia(POINT), r"thickness must be positive everywhere, got 0 m at"),
    (lambda: Plate(STEEL, lambda x: x[:, 0] + 1e-300).inertia(POINT), "thickness must be at least 1e-75 m every"),
    (lambda: Plate(STEEL, lambda x: np.ones(7)).inertia(POINT), "thickness must be a function that returns numbers"),
    (lambda: Beam.rectangular(STEEL, width=0.1, height=-0.1), "height must be positive, got -0.1 m"),
])  # fmt: skip


def test_yield_strength_may_be_stated_and_is_that_of_a_dent_of_the_pyramid():
    """Vickers' number is over the slanted faces of a pyramid of 136 degrees between them; here of 120 HV."""
    wood = {"E_along": 11e9, "E_across": 0.8e9, "nu": 0.37, "G": 0.7e9, "rho": 430.0}
    assert STEEL.yield_strength is None and Material.orthotropic(**wood, yield_strength=5e6).yield_strength == 5e6
    pressure = 120.0 * 9.80665e6 * (2.0 / (2.0 * np.sin(np.radians(68.0))))
    assert yield_strength(120.0) == pytest.approx(pressure / 2.8, rel=1e-12)
