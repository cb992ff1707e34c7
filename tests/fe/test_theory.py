"""A theory of one's own: what is common to all theories follows from its elements, terms and supports."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.fe import assembly, euler, kirchhoff, shallow
from fem_impact.fe.theory import Term, no_estimate
from fem_impact.modes.stretching import stretch

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
SIDES, THICKNESS = np.array([0.5, 0.3]), 0.03


def terms(space, points, cells):
    """Rayleigh's plate: a thin plate whose sections also turn with its slope."""
    slope = space.functions(cells, points.x[cells], (1,))[0].transpose(0, 2, 1, 3)
    return [*kirchhoff.terms(space, points, cells), Term("M", "rotary", slope)]


OWN = {"errors": no_estimate, "matrices": None, "compared": True}  # a second mesh tells the errors


def square_waves():
    m, n = (each.ravel() for each in np.meshgrid(np.arange(1, 7), np.arange(1, 7)))
    return np.sort((m * np.pi / SIDES[0]) ** 2 + (n * np.pi / SIDES[1]) ** 2)[:6]


def test_a_new_theory_gets_modes_with_errors_and_static_deflections():
    fields = ("stiffness", "inertia", "rotary")
    made = replace(kirchhoff.ARGYRIS, name="rayleigh", element="argyris turning", terms=terms, fields=fields, **OWN)
    mesh, plate = fi.mesh.rectangle(*SIDES), fi.Plate(STEEL, THICKNESS)
    rayleigh = fi.assemble(mesh, plate, {"boundary": "hinged"}, theory=made)
    modes, thin = (fi.find_modes(each, n_modes=6) for each in (rayleigh, assembly.reassemble(
        rayleigh, rayleigh.mesh, element="argyris")))  # fmt: skip
    square = square_waves()
    exact = square * np.sqrt(rayleigh.section.stiffness(np.zeros((1, 2)))[0, 0, 0] / (STEEL.rho * THICKNESS))
    exact /= np.sqrt(1.0 + square * THICKNESS**2 / 12.0)
    assert_allclose(modes.omega, exact, rtol=1e-6)
    assert (np.abs(modes.omega / exact - 1.0) < modes.frequency_error).all()
    point = np.array([[0.2, 0.1]])  # at rest nothing turns
    assert_allclose(modes.shapes.compliance(point), thin.shapes.compliance(point), rtol=1e-5)


def test_a_theory_made_of_that_of_shells_keeps_what_their_plane_needs():
    """It had no rings of triangles at corners of the plane, and as it stretched, no stresses by its linear motion."""
    plate, kinds = fi.Plate(STEEL, 2e-3), dict.fromkeys(("left", "right"), "hinged")
    theories = shallow.SHALLOW, replace(shallow.SHALLOW, name="mine")
    made = [
        fi.assemble(fi.mesh.rectangle(*SIDES), plate, kinds, rise=fi.rise.cap(2.0), theory=each) for each in theories
    ]
    known, own = (stretch(fi.find_modes(each, n_modes=2)) for each in made)
    assert made[0].n_dofs == made[1].n_dofs
    assert own.linear.any() and np.array_equal(own.linear, known.linear) and np.array_equal(own.forms, known.forms)


class Bedded(fi.Plate):
    def foundation(self, points):
        return np.full(len(points), 3e8)


def on_foundation(space, points, cells):
    value = space.functions(cells, points.x[cells], (0,))[0][:, :, None]
    return [*kirchhoff.terms(space, points, cells), Term("K", "foundation", value)]


def test_a_theory_may_ask_its_own_section_for_another_field():
    fields = ("stiffness", "inertia", "foundation")
    made = replace(kirchhoff.ARGYRIS, name="bedded", element="on a bed", terms=on_foundation, fields=fields, **OWN)
    plate, held = Bedded(STEEL, THICKNESS), {"boundary": "hinged"}
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(*SIDES), plate, held, theory=made), n_modes=6)
    stiffness, inertia = modes.section.stiffness(np.zeros((1, 2)))[0, 0, 0], STEEL.rho * THICKNESS
    exact = np.sqrt((square_waves() ** 2 * stiffness + 3e8) / inertia)
    assert_allclose(modes.omega, exact, rtol=1e-6)  # as Kirchhoff's plate on this mesh


def test_a_theory_of_another_dimension_is_refused():
    with pytest.raises(ValueError, match="theory must be of dimension 2 as the mesh"):
        fi.assemble(fi.mesh.rectangle(*SIDES), fi.Plate(STEEL, THICKNESS), theory=euler.EULER)
