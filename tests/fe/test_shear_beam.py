"""Timoshenko beams by elements: the hinged beam, steps, springs, error estimates; all ends in test_timoshenko."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from thick_plates import block

import fem_impact as fi

ALUMINIUM = fi.Material(E=70e9, nu=0.33, rho=2700.0)
STOUT = fi.Beam.rectangular(ALUMINIUM, width=0.03, height=0.08)
HINGED = {"left": "hinged", "right": "hinged"}


def hinged(length, bending, shear, mass, rotary, n_modes):
    """First omega [rad/s] of a hinged beam, both kinds of modes and the one that only turns the sections."""
    k = np.arange(n_modes + 1) * np.pi / length
    b = mass * (bending * k**2 + shear) + rotary * shear * k**2
    root = np.sqrt(b**2 - 4.0 * mass * rotary * bending * shear * k**4)
    low, high = 2.0 * shear * bending * k**4 / (b + root), (b + root) / (2.0 * mass * rotary)
    return np.sqrt(np.sort(np.concatenate([low[1:], high]))[:n_modes])


def sizes(section):
    """Bending and shear stiffness, mass and rotary inertia per length."""
    point = np.zeros((1, 1))
    return [float(f(point)[0]) for f in (section.stiffness, section.shear, section.inertia, section.rotary)]


def test_cowpers_coefficients():
    round_one, area, inertia = fi.Beam.circular(ALUMINIUM, diameter=0.02), np.pi * 0.01**2, np.pi * 0.01**4 / 4.0
    assert STOUT.shear_coefficient == pytest.approx(10.0 * 1.33 / (12.0 + 11.0 * 0.33))
    assert round_one.shear_coefficient == pytest.approx(6.0 * 1.33 / (7.0 + 6.0 * 0.33))
    shear = round_one.shear_coefficient * 70e9 / 2.66 * area
    assert_allclose(sizes(round_one), [70e9 * inertia, shear, 2700.0 * area, 2700.0 * inertia], rtol=1e-12)


@pytest.mark.parametrize("height", [0.2, 0.08, 1e-4])
def test_hinged_beams_from_stout_to_slender_have_both_kinds_of_modes(height):
    """At height 0.2 the second kind begins at the ninth mode; slender beams keep all digits."""
    section = fi.Beam.rectangular(ALUMINIUM, width=0.03, height=height)
    system = fi.assemble(fi.mesh.line(0.4), section, HINGED, theory="timoshenko")
    found = fi.find_modes(system, n_modes=40)
    assert_allclose(found.omega, hinged(0.4, *sizes(section), 40), rtol=1e-9)
    assert found.frequency_error.max() < 1e-9


def test_a_step_of_the_section_is_a_node_with_a_kink():
    """A beam of two sections, as two beams joined: its static deflection by hand, bending plus shear."""
    height = lambda x: np.where(x[:, 0] < 0.15, 0.08, 0.04)  # noqa: E731
    section = fi.Beam.rectangular(ALUMINIUM, width=0.03, height=height)
    system = fi.assemble(fi.mesh.line(0.4), section, {"left": "clamped"}, theory="timoshenko")
    found = fi.find_modes(system, n_modes=4)
    thick, thin = sizes(STOUT), sizes(fi.Beam.rectangular(ALUMINIUM, width=0.03, height=0.04))
    bent = (0.4**3 - 0.25**3) / 3.0 / thick[0] + 0.25**3 / 3.0 / thin[0]
    exact = bent + 0.15 / thick[1] + 0.25 / thin[1]
    assert found.shapes.compliance(np.array([[0.4]]))[0, 0] == pytest.approx(exact, rel=1e-9)
    assert found.frequency_error.max() < 1e-8


def test_springs_and_a_mass_at_the_ends():
    """Stiff springs are supports; a heavy mass turns a clamped-free beam's first mode into mass on a spring."""
    line, firm, (bending, shear, *_) = fi.mesh.line(0.4), fi.Elastic(1e16, 0.0), sizes(STOUT)
    sprung = fi.find_modes(fi.assemble(line, STOUT, {"left": firm, "right": firm}, theory="timoshenko"), n_modes=4)
    assert_allclose(sprung.omega, hinged(0.4, *sizes(STOUT), 4), rtol=1e-5)
    loaded = fi.assemble(line, STOUT, {"left": "clamped"}, theory="timoshenko", point_masses=[((0.4,), 1e4)])
    spring = 1.0 / (0.4**3 / 3.0 / bending + 0.4 / shear)
    assert fi.find_modes(loaded, n_modes=1).omega[0] == pytest.approx(np.sqrt(spring / 1e4), rel=1e-3)


def test_the_error_estimate_is_that_of_a_beam_too_coarse_for_its_modes():
    """One element of degree 32 for 20 modes: the last are off by up to 1e-2, and the estimate says so."""
    section = fi.Beam.rectangular(ALUMINIUM, width=0.03, height=0.02)
    system = fi.assemble(fi.mesh.line(0.4, size=0.4), section, HINGED, theory="timoshenko")
    found = fi.find_modes(system, n_modes=20)
    true = np.abs(found.omega / hinged(0.4, *sizes(section), 20) - 1.0)
    wrong = true > 1e-10
    assert wrong.sum() > 3 and true.max() > 1e-6
    ratio = found.frequency_error[wrong] / true[wrong]
    assert (ratio > 0.3).all() and (ratio < 30.0).all()


def test_compliance_of_both_theories_differs_by_the_shear():
    systems = (fi.assemble(fi.mesh.line(0.4), STOUT, HINGED, theory=theory) for theory in ("euler", "timoshenko"))
    one, other = (fi.find_modes(each, n_modes=2).shapes.compliance(np.array([[0.13]]))[0, 0] for each in systems)
    assert other - one == pytest.approx(0.13 * 0.27 / 0.4 / sizes(STOUT)[1], rel=1e-9)


@pytest.mark.parametrize("ends", [{}, {"left": "hinged"}, {"right": "hinged"}])
def test_rigid_motions_are_found(ends):
    found = fi.find_modes(fi.assemble(fi.mesh.line(0.4), STOUT, ends, theory="timoshenko"), n_modes=4)
    assert found.n_rigid == 2 - len(ends)
    assert found.mass == pytest.approx(0.4 * sizes(STOUT)[2], rel=1e-12)


@pytest.mark.slow
def test_a_free_block_of_one_to_five_is_a_timoshenko_beam_within_a_hundredth():
    """Where the slender theory is 5 to 40 % off in its first three modes. The solid is converged to 1e-3."""
    exact = block((5.0, 1.0, 1.0), (16, 2), 0.3, 3)
    section = fi.Beam.rectangular(fi.Material(E=1.0, nu=0.3, rho=1.0), width=1.0, height=1.0)
    ends = ("free", "free")
    stout, slender = (
        fi.analytic.beam(5.0, ends=ends, section=section, n_modes=5, theory=theory).omega[2:]
        for theory in ("timoshenko", "euler")
    )
    assert_allclose(stout, exact, rtol=0.01)
    assert (slender > 1.05 * exact).all()
