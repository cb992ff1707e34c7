"""Timoshenko beams in closed form against elements, limits and sums; stout sticks."""

from itertools import product

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose

import fem_impact as fi

ALUMINIUM = fi.Material(E=70e9, nu=0.33, rho=2700.0)
ENDS = list(product(("clamped", "hinged", "free"), repeat=2))
PAIRS = [("clamped", "clamped"), ("hinged", "hinged"), ("free", "free"), ("clamped", "free"), ("free", "hinged")]
POINTS = np.array([[0.0], [0.03], [0.17], [0.4]])


def bar(height):
    return fi.Beam.rectangular(ALUMINIUM, width=0.03, height=height)


@pytest.mark.parametrize(("ends", "height"), [(ends, 0.15) for ends in ENDS] + [(ends, 0.004) for ends in PAIRS])
def test_all_ends_agree_with_elements(ends, height):
    section = bar(height)
    exact = fi.analytic.beam(0.4, ends=ends, section=section, n_modes=30, theory="timoshenko")
    system = fi.assemble(fi.mesh.line(0.4), section, dict(zip(("left", "right"), ends)), theory="timoshenko")
    found = fi.find_modes(system, n_modes=30)
    assert found.n_rigid == exact.n_rigid and found.mass == pytest.approx(exact.mass, rel=1e-12)
    assert_allclose(found.omega, exact.omega, rtol=1e-8)  # 2e-13 measured
    flexible = slice(exact.n_rigid, None)
    shapes = [np.abs(modes.shape_at(POINTS)[:, flexible]) for modes in (found, exact)]
    assert_allclose(*shapes, atol=1e-5 * shapes[1].max())  # 3e-7: roots of the eigensolver's residual
    compliance = [modes.shapes.compliance(POINTS) for modes in (found, exact)]
    assert_allclose(*compliance, atol=1e-10 * np.abs(compliance[1]).max())


@pytest.mark.parametrize("ends", PAIRS)
def test_slender_beams_are_euler_bernoulli_beams(ends):
    """Shear and rotary inertia lower the tenth mode by 2e-7 at height / length = 2.5e-5."""
    thin = bar(1e-5)
    stout = fi.analytic.beam(0.4, ends=ends, section=thin, n_modes=10, theory="timoshenko")
    plain = fi.analytic.beam(0.4, ends=ends, section=thin, n_modes=10)
    assert_allclose(stout.omega, plain.omega, rtol=1e-6)
    assert (stout.omega <= plain.omega * (1.0 + 1e-10)).all()


def test_the_first_kind_of_the_second_spectrum_only_turns_the_sections():
    """A hinged beam has a mode without deflection at omega^2 = kappa G A / (rho I)."""
    section, point = bar(0.1), np.zeros((1, 1))
    modes = fi.analytic.beam(0.4, ends=("hinged", "hinged"), section=section, n_modes=20, theory="timoshenko")
    turning = np.sqrt(section.shear(point)[0] / section.rotary(point)[0])
    nearest = np.abs(modes.omega / turning - 1.0)
    assert nearest.min() < 1e-12
    still = np.abs(modes.shape_at(POINTS)[:, nearest.argmin()]).max()
    assert still < 1e-6 * np.abs(modes.shape_at(POINTS)).max()


def test_no_mode_is_missed_up_to_a_frequency():
    how = {"ends": ("free", "free"), "section": bar(0.1), "theory": "timoshenko"}
    by_number = fi.analytic.beam(0.4, n_modes=50, **how)
    up_to = fi.analytic.beam(0.4, max_frequency=by_number.frequencies[38:40].mean(), **how)
    assert up_to.n_modes == 39
    assert_allclose(up_to.omega, by_number.omega[:39], rtol=1e-12)


def test_a_section_and_its_slenderness_are_the_same_beam():
    """Round, nu = 0.3, twenty diameters long."""
    section = fi.Beam.circular(fi.Material(E=12e9, nu=0.3, rho=700.0), diameter=0.02)
    how = {"ends": ("hinged", "free"), "n_modes": 12, "theory": "timoshenko"}
    exact = fi.analytic.beam(0.4, section=section, **how)
    told = fi.analytic.beam(0.4, mass=exact.mass, first_frequency=exact.frequencies[1], slenderness=20.0, **how)
    assert_allclose(told.omega, exact.omega, rtol=2e-4)  # the shear coefficient is 0.886 to three digits


def test_a_stout_stick_has_lower_modes_above_its_first():
    slender, stout = fi.Striker.stick(0.1, 1e3), fi.Striker.stick(0.1, 1e3, slenderness=20.0)
    ratio = stout.modes.omega[1:] / slender.modes.omega[1:]
    assert ratio[0] == pytest.approx(1.0) and (np.diff(ratio[:60]) < 0.0).all()
    assert ratio[9] == pytest.approx(0.797, abs=1e-3)
    assert stout.felt_mass == pytest.approx(0.1 / 3.0 * (1.0 + 3.0 / 16.0 / 20.0**2), rel=1e-9)  # rotary inertia
    wooden = fi.Striker.stick(0.1, 1e3, slenderness=20.0, shear_ratio=15.0)
    assert (wooden.modes.omega[2:] < stout.modes.omega[2:]).all()
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=100)
    law = fi.Contact.linear(88.6e3)
    hits = [fi.strike(plate, stick, law, at=(0.3, 0.3), speed=1.0, tolerance=1e-3) for stick in (slender, stout)]
    assert hits[0].restitution != pytest.approx(hits[1].restitution, abs=3e-5)  # by 9e-5


test_refusals = refusing([
    (lambda: stout(section=bar(0.01), theory="mindlin"), "theory must be one of euler, timoshenko"),
    (lambda: stout(mass=0.1, first_frequency=9.0, slenderness=10.0, theory=None), "slenderness needs theory"),
    (lambda: stout(mass=0.1, first_frequency=9.0), "slenderness must be given if there is no section"),
    (lambda: fi.Striker.stick(0.1, 1e3, slenderness=0.5), "slenderness must lie between 1"),
    (lambda: stout(section=bar(1e-6)), "length must be at most"),
])  # fmt: skip


def stout(theory="timoshenko", **how):
    return fi.analytic.beam(0.4, n_modes=3, **({"theory": theory} if theory else {}), **how)
