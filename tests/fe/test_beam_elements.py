"""Beam elements of degree 32 against polynomials, exact deflections and the roots of clamped beams."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from scipy.sparse import eye_array
from skfem import MeshLine

import fem_impact as fi
from fem_impact.fe import beam_elements
from fem_impact.fe.beam_elements import DEGREE, HermiteSpace, divided, nodes
from fem_impact.fe.elements import numbering
from fem_impact.fe.euler import EULER
from fem_impact.fe.theory import Domain, Points


def uniform(x):
    return np.ones_like(x), np.ones_like(x)


def integrals(line):
    """Space, stiffness and mass (n_cells, n_local, n_local) of a uniform beam, unit EI and unit mass per length."""
    space = HermiteSpace(line)
    x, dx = beam_elements.quadrature(space)
    fields = {"stiffness": dx, "inertia": dx}
    return space, *EULER.matrices(None, Domain(line, space, None, Points(x[:1], x[..., None], dx), fields, 1.0))


def assembled(places):
    """The same with matrices (n_dofs, n_dofs), and the unknowns of the elements."""
    line = MeshLine(np.asarray(places))
    space, K, M = integrals(line)
    dofs, n_dofs = numbering(line, space)
    whole = np.zeros((2, n_dofs, n_dofs))
    for cell, own in enumerate(dofs.T):
        whole[0][np.ix_(own, own)] += K[cell]
        whole[1][np.ix_(own, own)] += M[cell]
    return space, dofs, *whole


def test_shapes_hold_every_polynomial_up_to_their_degree():
    space = integrals(MeshLine(np.array([-0.3, 1.1])))[0]  # with turned bubbles
    s = np.linspace(-0.3, 1.1, 200)
    value, slope, bend = (f[0] for f in space.functions(np.zeros(1, int), s[None, :, None], (0, 1, 2)))
    centred = (s - 0.4) / 0.7
    for degree in (0, 1, 3, 7, DEGREE):
        power = Polynomial.basis(degree)
        weights = np.linalg.lstsq(value, power(centred), rcond=None)[0]
        assert_allclose(value @ weights, power(centred), atol=1e-11)
        assert_allclose(slope @ weights, power.deriv(1)(centred) / 0.7, atol=1e-8 * max(1, degree))
        assert_allclose(bend @ weights, power.deriv(2)(centred) / 0.7**2, atol=1e-6 * max(1, degree**2))
    above = np.linalg.lstsq(value, centred ** (DEGREE + 2), rcond=None)[1]
    assert above.size == 0 or above > 1e-20  # and no polynomial beyond


def test_bubbles_are_the_modes_of_the_clamped_beam():
    """Unit stiffness, so their mass is 1 / k**4 of cos k cosh k = 1: ten half waves are resolved to rounding."""
    _, K, M = integrals(MeshLine(np.array([0.0, 1.0])))
    n = np.arange(1, 11)
    k = np.array([brentq(lambda k: np.cos(k) - 1.0 / np.cosh(k), (i + 0.3) * np.pi, (i + 0.7) * np.pi) for i in n])
    mass = np.sort(np.diag(M[0])[4:])[::-1][:10]
    assert_allclose(mass ** (-1 / 4), k, rtol=1e-12)
    assert_allclose(K[0, 4:, 4:], np.eye(DEGREE - 3), atol=1e-10)


@pytest.mark.parametrize("places", [[0.0, 1.0], [0.0, 0.1, 0.55, 1.0]])
def test_cantilever_under_its_weight_is_the_quartic(places):
    _, dofs, K, M = assembled(places)
    load = M @ rigid(places, dofs, len(K))[:, 0]  # a unit force per length
    kept = np.setdiff1d(np.arange(len(K)), dofs[:2, 0])
    solution = np.zeros(len(K))
    solution[kept] = np.linalg.solve(K[np.ix_(kept, kept)], load[kept])
    tip, turn = solution[dofs[2:4, -1]]
    assert_allclose([tip, turn], [1.0 / 8.0, 1.0 / 6.0], rtol=1e-10)  # q L**4 / 8 EI and q L**3 / 6 EI
    assert_allclose(solution @ load, 1.0 / 20.0, rtol=1e-10)  # twice the strain energy, q**2 L**5 / 20 EI


def rigid(places, dofs, n_dofs):
    return HermiteSpace(MeshLine(np.asarray(places))).rigid_unknowns(dofs, n_dofs)


def test_rigid_motions_cost_nothing_and_weigh_what_the_beam_does():
    places = [0.0, 0.3, 1.0]
    _, dofs, K, M = assembled(places)
    motions = rigid(places, dofs, len(K))
    assert_allclose(K @ motions, 0.0, atol=1e-9)  # of stiffnesses up to 12 / 0.3**3
    assert_allclose(motions.T @ M @ motions, [[1.0, 0.5], [0.5, 1.0 / 3.0]], rtol=1e-13)


def test_points_are_found_in_their_element_and_beyond_the_ends_in_none():
    space = HermiteSpace(MeshLine(np.array([0.0, 0.4, 1.0])))
    cell, inside = space.locate(np.array([[0.0], [0.1], [0.7], [1.0], [-0.1], [1.0 + 1e-6], [1.0 + 1e-12]]))
    assert cell.tolist() == [0, 0, 1, 1, 0, 1, 1]
    assert inside.tolist() == [True, True, True, True, False, False, True]  # the last is off by rounding only


def divisions(fields, nodes):
    return divided(fields, nodes).p[0]


def test_steps_and_kinks_of_the_section_become_nodes():
    step, kink = 1.0 / np.pi, np.sqrt(0.5)

    def fields(x):
        return np.where(x < step, 1.0, 2.0), 1.0 + np.maximum(x - kink, 0.0)

    found = divisions(fields, np.array([0.0, 1.0]))
    assert np.abs(found - step).min() < 1e-15 and np.abs(found - kink).min() < 2e-9  # a frequency moves with a step
    assert len(found) == 4  # nothing else
    assert divisions(uniform, np.array([0.0, 0.5, 1.0])).tolist() == [0.0, 0.5, 1.0]


@pytest.mark.parametrize("width", [1e-3, 0.02, 0.1])
def test_a_notch_is_found_wherever_it_is(width):
    """Its sides near or on the ends of an interval that was halved, such as 1/4, are seen from within a neighbour."""
    for left in (*np.random.default_rng(3).uniform(0.01, 0.89, 40), 0.25, 0.5, 0.25 - width, 0.375 + 1e-12):

        def fields(x, low=left, high=left + width):
            return np.where((x > low) & (x < high), 0.1, 1.0), np.ones_like(x)

        found = divisions(fields, np.array([0.0, 1.0]))
        assert np.abs(found[1:-1] - [left, left + width]).max() < 1e-15


def test_a_narrow_smooth_dimple_is_no_cluster_of_kinks():
    """Rounding of the places makes a steep section rough: 1e-16 over a width of 1e-3 is more than its own."""

    def fields(x):
        depth = 1.0 - 0.5 * np.exp(-(((x - 0.4217) / 1e-3) ** 2))
        return depth**3, depth

    found = divisions(fields, np.array([0.0, 1.0]))
    gap, middle = np.diff(found), 0.5 * (found[1:] + found[:-1])
    assert gap[np.abs(middle - 0.4217) < 1e-3].max() < 2e-3 and len(found) < 60


def test_smooth_sections_are_divided_until_a_polynomial_fits():
    """A Runge function of width 0.01: intervals near it must be about as narrow, those far from it need not be."""

    def fields(x):
        return 1.0 + 1.0 / (1.0 + ((x - 0.4) / 0.01) ** 2), np.ones_like(x)

    found = divisions(fields, np.array([0.0, 1.0]))
    gap = np.diff(found)
    near = np.abs(0.5 * (found[1:] + found[:-1]) - 0.4) < 0.01
    assert gap[near].max() < 0.02 and gap[~near].max() > 0.1 and len(found) < 60


def test_a_section_of_too_many_steps_is_refused():
    with pytest.raises(ValueError, match="section must have at most 2000 steps and kinks"):
        divisions(lambda x: (1.0 + (np.floor(5000 * x) % 2), np.ones_like(x)), np.array([0.0, 1.0]))


def test_nodes_keep_ends_and_marks_and_no_points_close_to_them():
    points, held = np.array([1.0, 0.0, 0.5, 0.25, 0.75]), np.array([0.0])
    assert nodes(points, np.array([0.6]), held).tolist() == [0.0, 0.25, 0.5, 0.6, 0.75, 1.0]
    taken = nodes(points, np.array([0.503]), held)
    assert taken.tolist() == [0.0, 0.25, 0.503, 0.75, 1.0]  # takes its neighbour's place
    assert nodes(points, np.array([0.998]), held).tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]  # close to a free end: none
    assert nodes(points, np.array([0.002]), held).tolist() == [0.0, 0.002, 0.25, 0.5, 0.75, 1.0]  # to a held end: one


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


def resisting(frequency, length, height):
    """Dynamic stiffness (4, 4) of a uniform piece of unit E, rho and width: deflection and slope at both ends."""
    stiff, wave = height**3 / 12.0, (12.0 * (2.0 * np.pi * frequency) ** 2 / height**2) ** 0.25
    x = wave * length
    s, c, S, C = np.sin(x), np.cos(x), np.sinh(x), np.cosh(x)
    force, mixed, moment = wave**3 * (s * C + c * S), wave**2 * s * S, wave * (s * C - c * S)
    far, across, turned = -(wave**3) * (s + S), wave**2 * (C - c), wave * (S - s)
    rows = [force, mixed, far, across], [mixed, moment, -across, turned], [far, -across, force, -mixed]
    return stiff / (1.0 - c * C) * np.array([*rows, [across, turned, -mixed, moment]])


def test_frequencies_of_a_stepped_beam_are_those_of_its_pieces_within_their_claims():
    """Hinged and free, on two points beside its steps; a step misplaced by 1e-9 of the length moves mode 5 by 6e-9."""
    places, heights = [0.0, 0.011, 0.035, 0.117, 0.32, 0.4], [1.05e-3, 1.05e-3, 13.8e-3, 19.0e-3, 19.0e-3]
    held = [0, 2, 8]  # deflections at the hinge and at the points

    def height(x):
        return np.array(heights)[np.searchsorted(places[1:-1], np.ravel(x), side="right")]

    beam = fi.Beam.rectangular(fi.Material(E=1.0, nu=0.3, rho=1.0), width=1.0, height=height)
    points = [((0.011,), "hinged"), ((0.32,), "hinged")]
    modes = fi.find_modes(fi.assemble(fi.mesh.line(0.4), beam, {"left": "hinged"}, point_supports=points), n_modes=8)

    def determinant(frequency):
        whole = np.zeros((12, 12))
        for i, thick in enumerate(heights):
            whole[2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += resisting(frequency, places[i + 1] - places[i], thick)
        kept = np.setdiff1d(np.arange(12), held)
        scale = np.array([places[1] * 1e-3, 1.0] * 6)[kept]  # of deflections and slopes
        return np.linalg.det(whole[np.ix_(kept, kept)] * np.outer(scale, scale) * 1e12)

    true = [brentq(determinant, f * (1 - 1e-6), f * (1 + 1e-6), xtol=1e-16, rtol=1e-15) for f in modes.frequencies]
    claimed = modes.frequency_error + 1e-11  # rounding of the determinants
    assert (np.abs(modes.frequencies / true - 1.0) < claimed).all()
