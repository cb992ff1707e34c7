"""Beam elements of degree 32: where a section divides them, which points become nodes, and errors in equilibrium."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import eye_array
from skfem import MeshLine

import fem_impact as fi
from fem_impact.fe import beam_elements
from fem_impact.fe.beam_elements import HermiteSpace, divide_lines, nodes


def test_points_are_found_in_their_element_and_beyond_the_ends_in_none():
    space = HermiteSpace(MeshLine(np.array([0.0, 0.4, 1.0])))
    cell, inside = space.locate(np.array([[0.0], [0.1], [0.7], [1.0], [-0.1], [1.0 + 1e-6], [1.0 + 1e-12]]))
    assert cell.tolist() == [0, 0, 1, 1, 0, 1, 1]
    assert inside.tolist() == [True, True, True, True, False, False, True]  # the last is off by rounding only


def divisions(stiffness, inertia=np.ones_like, places=(0.0, 1.0)):
    """Nodes of a beam of unit length whose section is a function of the place."""
    return divide_lines(lambda x: (stiffness(x), inertia(x)), np.array(places)).p[0]


def test_steps_and_kinks_of_the_section_become_nodes():
    step, kink = 1.0 / np.pi, np.sqrt(0.5)
    found = divisions(lambda x: np.where(x < step, 1.0, 2.0), lambda x: 1.0 + np.maximum(x - kink, 0.0))
    assert np.abs(found - step).min() < 1e-15 and np.abs(found - kink).min() < 2e-9  # a frequency moves with a step
    assert len(found) == 4  # nothing else
    assert divisions(np.ones_like, places=(0.0, 0.5, 1.0)).tolist() == [0.0, 0.5, 1.0]


@pytest.mark.parametrize("width", [1e-3, 0.02, 0.1])
def test_a_notch_is_found_wherever_it_is(width):
    """Its sides near or on the ends of an interval that was halved, such as 1/4, are seen from within a neighbour."""
    for left in (*np.random.default_rng(3).uniform(0.01, 0.89, 8), 0.25, 0.5, 0.25 - width, 0.375 + 1e-12):
        found = divisions(lambda x, low=left: np.where((x > low) & (x < low + width), 0.1, 1.0))
        assert np.abs(found[1:-1] - [left, left + width]).max() < 1e-15


def dimple(x):
    return 1.0 - 0.5 * np.exp(-(((x - 0.4217) / 1e-3) ** 2))


@pytest.mark.parametrize(("section", "at", "reach", "widest"), [
    # rounding of the places makes a steep section rough: 1e-16 over a width of 1e-3 is more than its own
    ((lambda x: dimple(x) ** 3, dimple), 0.4217, 1e-3, 2e-3),
    # Runge's function: intervals near it must be about as narrow, those far from it need not be
    ((lambda x: 1.0 + 1.0 / (1.0 + ((x - 0.4) / 0.01) ** 2),), 0.4, 0.01, 0.02),
], ids=["a narrow dimple is no cluster of kinks", "Runge"])  # fmt: skip
def test_smooth_sections_are_divided_until_a_polynomial_fits(section, at, reach, widest):
    found = divisions(*section)
    gap, near = np.diff(found), np.abs(0.5 * (found[1:] + found[:-1]) - at) < reach
    assert gap[near].max() < widest and gap[~near].max() > 0.1 and len(found) < 60


def test_nodes_keep_ends_and_marks_and_no_points_close_to_them():
    points, held = np.array([1.0, 0.0, 0.5, 0.25, 0.75]), np.array([0.0])
    assert nodes(points, np.array([0.6]), held).tolist() == [0.0, 0.25, 0.5, 0.6, 0.75, 1.0]
    taken = nodes(points, np.array([0.503]), held)
    assert taken.tolist() == [0.0, 0.25, 0.503, 0.75, 1.0]  # takes its neighbour's place
    assert nodes(points, np.array([0.9995]), held).tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]  # close to a free end: none
    assert nodes(points, np.array([0.002]), held).tolist() == [0.0, 0.002, 0.25, 0.5, 0.75, 1.0]  # to a held end: one


def test_a_mass_beside_a_post_has_a_node_of_its_own():
    """0.6 % of the length away it had none, so that frequencies of a Timoshenko beam were uncertain by 1e-4."""
    beam = fi.Beam.rectangular(fi.Material(E=1e10, nu=0.3, rho=500.0), width=0.02, height=0.01)
    held = {"point_masses": [([0.4], 0.1)], "point_supports": [([0.406], "hinged")]}
    system = fi.assemble(fi.mesh.line(1.0), beam, {"left": "clamped"}, theory="timoshenko", **held)
    assert fi.find_modes(system, n_modes=6).frequency_error.max() < 1e-9


@pytest.mark.parametrize("theory", ["euler", "timoshenko"])
def test_error_of_a_solution_that_does_not_bend_is_the_energy_of_the_clamped_beam(theory):
    """Prager and Synge: the best linear moment is left out, as in a beam clamped at both ends, q**2 L**5 / 720 EI."""
    beam = fi.Beam.rectangular(fi.Material(E=1e9, nu=0.3, rho=1e3), width=0.01, height=1e-5)  # shear is 1e-10 of it
    system = fi.assemble(fi.mesh.line(1.0), beam, {"boundary": "clamped"}, theory=theory, near=[(0.35,)])
    even = system.space.rigid_unknowns(system.element_dofs, system.expand.shape[0])[:, :1]
    whole = replace(system, expand=eye_array(len(even), format="csr"))  # its ends may be pushed, too
    assert_allclose(beam_elements.balanced_errors(whole, 0.0 * even, even)[0], 1.0 / 720.0, rtol=1e-7)
    push = beam_elements.balanced_errors(whole, 0.0 * even, 0.0 * even, np.array([[0.35]]))[0]
    assert_allclose(push, (0.35 * 0.65) ** 3 / 3.0, rtol=1e-7)  # a unit force at 0.35: a**3 b**3 / 3 L**3
    assert fi.find_modes(system, n_modes=3).frequency_error.max() < 1e-10  # in equilibrium, nothing is missed
