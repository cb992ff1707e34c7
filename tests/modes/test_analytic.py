"""Closed-form modes against published roots, orthonormality and independent static sums."""

import itertools

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose
from scipy.special import roots_legendre

from fem_impact.fe import section
from fem_impact.fe.section import KINDS
from fem_impact.modes import analytic, modal, slender

ENDS = list(itertools.product(KINDS, repeat=2))


def disk_quadrature(radius, n_radial=80, n_angle=128):
    """Points (n, 2) and weights (n,) that integrate polynomials over a disk exactly to degree 127."""
    node, weight = np.polynomial.legendre.leggauss(n_radial)
    r = 0.5 * radius * (node + 1.0)
    angle = 2.0 * np.pi * np.arange(n_angle) / n_angle
    points = np.column_stack([np.outer(r, np.cos(angle)).ravel(), np.outer(r, np.sin(angle)).ravel()])
    return points, np.repeat(0.5 * radius * weight * r * 2.0 * np.pi / n_angle, n_angle)


# omega R**2 sqrt(rho h / D), nu = 0.3: Leissa (1969) corrected to converged digits
FIRST = {"clamped": 10.2158262, "hinged": 4.93514904, "free": 5.3583298}


# free beams: Bishop and Johnson (1960), table 7.1
@pytest.mark.parametrize("ends, roots", [
    (("clamped", "free"), [1.875104068712, 4.694091132974]),
    (("free", "free"), [4.730040744863, 7.853204624096]),
    (("hinged", "free"), [3.926602312048, 7.068582745629]),
    (("hinged", "hinged"), [np.pi, 2 * np.pi]),
])  # fmt: skip
def test_beam_frequencies(ends, roots):
    modes = analytic.beam(2.0, ends=ends, mass=1.0, first_frequency=roots[0] ** 2, n_modes=4)
    assert_allclose(np.sqrt(modes.frequencies[modes.n_rigid :][:2]), roots, rtol=1e-12)  # the digits printed
    if ends[1] == "free":
        assert_allclose(modes.shape_at([2.0])[0, modes.n_rigid :] ** 2, 4.0, rtol=1e-9)  # over the mass


@pytest.mark.parametrize("ends", ENDS)
def test_beam_modes_are_orthonormal_up_to_high_order(ends):
    modes = analytic.beam(2.0, ends=ends, mass=0.3, first_frequency=50.0, n_modes=300)
    node, weight = roots_legendre(1000)
    shapes = modes.shape_at(1.0 + node)
    gram = shapes.T @ (shapes * weight[:, None]) * 0.3 / 2.0
    assert_allclose(gram, np.eye(300), atol=1e-12)  # 1000 points integrate the products to rounding


@pytest.mark.parametrize("edge", KINDS)
@pytest.mark.slow
def test_disk_modes_are_orthonormal(edge):
    modes = analytic.disk(0.7, edge=edge, mass=0.3, first_frequency=50.0, n_modes=120)
    points, weight = disk_quadrature(0.7)
    shapes = modes.shape_at(points)
    gram = shapes.T @ (shapes * weight[:, None]) * 0.3 / (np.pi * 0.7**2)
    assert_allclose(gram, np.eye(120), atol=1e-11)  # quadrature exact, Bessel functions to some 1e-13


@pytest.mark.parametrize("ends", ENDS)
def test_beam_static_compliance_is_the_limit_of_its_modal_sum(ends):
    modes = analytic.beam(2.0, ends=ends, mass=0.3, first_frequency=50.0, n_modes=400)
    points = [[0.001], [0.5], [1.2], [2.0]]
    rest = modes.residual_compliance(points)
    first = slender._roots(ends, 1)[0]
    unit = first**4 / (0.3 * (2 * np.pi * 50.0) ** 2)  # length**3 / (E I)
    tail = 4.0 / (3.0 * np.pi**4 * 397.0**3) * unit  # squared shapes are at most 4 / mass, roots (n +- 1/2) pi
    assert np.diag(rest)[:3].min() > 0.0 and np.abs(rest).max() < 1.01 * tail


@pytest.mark.parametrize("name", ["rectangle", *KINDS])
def test_plate_static_compliance_is_the_limit_of_its_modal_sum(name):
    scale = {"mass": 0.2, "first_frequency": 100.0, "n_modes": 1200}
    square = name == "rectangle"
    modes = analytic.rectangle(1.55, 1.0, **scale) if square else analytic.disk(0.5, edge=name, **scale)
    points = np.array([[0.31, 0.2], [0.1, 0.33], [0.22, 0.05]])
    rest = modes.residual_compliance(points)
    scale = modes.shapes.compliance(points).max()
    off_diagonal = rest - np.diag(np.diag(rest))
    assert np.abs(off_diagonal).max() < 3e-5 * scale  # oscillating tail: 1e-6 ... 2e-5 measured
    # The diagonal tail is that of an infinite plate, (2 / pi) Y / omega_c with Y = 1 / (8 sqrt(D rho h)).
    density = 0.2 / (1.55 if square else np.pi * 0.25)
    first = np.pi**2 * (1 + 1 / 1.55**2) if square else FIRST[name] / 0.25
    rigidity = density * (2 * np.pi * 100.0 / first) ** 2
    admittance = 1.0 / (8.0 * np.sqrt(rigidity * density))
    assert_allclose(np.diag(rest), 2.0 / np.pi * admittance / modes.omega[-1], rtol=0.1)  # 5 % measured, wavy


# Timoshenko and Woinowsky-Krieger, Theory of plates and shells, eq. (89) and (92)
@pytest.mark.parametrize(("edge", "factor"), [("clamped", 1.0), ("hinged", 3.3 / 1.3)])
@pytest.mark.parametrize("radius", [0.01, 100.0])
def test_a_disk_of_any_size_yields_at_its_centre_as_in_closed_form(edge, factor, radius):
    plate = section.Plate(section.Material(E=210e9, nu=0.3, rho=7850.0), thickness=1e-3 * radius)
    rigidity = 210e9 * plate.thickness**3 / (12 * (1 - 0.3**2))
    found = analytic.disk(radius, edge=edge, section=plate, n_modes=1).shapes.compliance(np.zeros((1, 2)))
    assert_allclose(found, [[factor * radius**2 / (16.0 * np.pi * rigidity)]], rtol=1e-12)


def test_inertia_relief_leaves_no_rigid_motion():
    modes = analytic.disk(1.0, edge="free", mass=1.0, first_frequency=1.0, n_modes=4)
    points, weight = disk_quadrature(1.0, 30, 32)
    response = modes.shapes.deflection(np.array([[0.3, 0.55]]), points)[:, 0]
    left = np.abs(modes.shape_at(points)[:, :3].T @ (weight * response)).max()
    assert left < 1e-4 * np.abs(response).max()  # 1e-5: the quadrature's error at the kink


DISK = analytic.disk(0.2, mass=1.0, first_frequency=1.0, n_modes=3)


test_bad_input_names_argument_and_rule = refusing([
    (lambda: analytic.rectangle(-1.0, 1.0, mass=1.0, first_frequency=1.0, n_modes=3), "length must be positive"),
    (lambda: analytic.beam(1.0, ends=("free", "fre"), mass=1.0, first_frequency=1.0, n_modes=3), "mean 'free'"),
    (lambda: analytic.beam(1.0, ends="free", mass=1.0, first_frequency=1.0, n_modes=3), "two words"),
    (lambda: analytic.disk(1.0, edge="open", mass=1.0, first_frequency=1.0, n_modes=3), "edge must be one of"),
    (lambda: analytic.disk(1.0, mass=float("nan"), first_frequency=1.0, n_modes=3), "mass must be finite"),
    (lambda: modal.Modes.rigid(1.0).stretched(1.0, 0), "frequency must be positive, got 0"),
    (lambda: modal.Modes.rigid(1.0).stretched("3", 1.0), "mass must be a number, got '3'"),
    (lambda: modal.rayleigh(1.0, 1e-6)([1.0, 0.0]), "frequency must be positive, got 0 Hz"),
    (lambda: modal.rayleigh(1.0, 1e-6)(10**400), "frequency must be numbers in Hz"),
    (lambda: modal.Modes.from_arrays([], [[1.0]], points=[(0.0,)], mass=1.0), "frequencies must not be empty"),
    (lambda: DISK.shape_at([[0.3, 0.0]]), r"points must lie on the body, got \(0.3, 0\) m"),
    (lambda: DISK.points("at", (0.2, 0.1)), r"at must lie on the body, got \(0.2, 0.1\) m"),
])  # fmt: skip


def test_rigid_motions_of_a_free_disk_are_those_of_its_mass_and_inertia():
    """One at unit mass, and turns about two diameters with the inertia ``m R**2 / 4``."""
    disk = analytic.disk(0.3, edge="free", mass=0.7, first_frequency=100.0, n_modes=5)
    at = np.array([[0.0, 0.0], [0.12, -0.2]])
    r = np.hypot(*at[1])
    squared = disk.shape_at(at)[:, :3] ** 2 * 0.7
    assert_allclose(squared[:, 0], 1.0, rtol=1e-12)
    assert_allclose(squared[:, 1:].sum(axis=1), [0.0, 4.0 * (r / 0.3) ** 2], rtol=1e-12, atol=1e-12)
