"""A theory of one's own: what is common to all theories follows from its elements, terms and supports."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.fe import assembly, kirchhoff
from fem_impact.fe.theory import Term

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
SIDES, THICKNESS = np.array([0.5, 0.3]), 0.03


def terms(space, points, cells):
    """Rayleigh's plate: a thin plate whose sections also turn with its slope."""
    slope = space.functions(cells, points.x[cells], (1,))[0].transpose(0, 2, 1, 3)
    return [*kirchhoff.terms(space, points, cells), Term("M", "rotary", slope)]


def no_errors(system, vectors, loads, forced=None):
    return np.zeros((3, vectors.shape[1]))


@pytest.fixture
def rayleigh(monkeypatch):
    """What its own file would make, without an estimate of errors, so that a second mesh tells them."""
    fields = ("stiffness", "inertia", "rotary")
    made = replace(
        kirchhoff.ARGYRIS, name="rayleigh", element="argyris turning", terms=terms, errors=no_errors, fields=fields,
        matrices=None, compared=True,
    )  # fmt: skip
    monkeypatch.setattr(assembly, "EVERY", (*assembly.EVERY, made))
    monkeypatch.setitem(assembly.THEORIES, 2, (*assembly.THEORIES[2], "rayleigh"))
    plate = fi.Plate(STEEL, THICKNESS)
    return fi.assemble(fi.mesh.rectangle(*SIDES), plate, {"boundary": "hinged"}, theory="rayleigh")


def test_a_new_theory_gets_modes_with_errors_and_static_deflections(rayleigh):
    modes, thin = (fi.find_modes(each, n_modes=6) for each in (rayleigh, assembly.reassemble(
        rayleigh, rayleigh.mesh, element="argyris")))  # fmt: skip
    m, n = (each.ravel() for each in np.meshgrid(np.arange(1, 7), np.arange(1, 7)))
    square = np.sort((m * np.pi / SIDES[0]) ** 2 + (n * np.pi / SIDES[1]) ** 2)[:6]
    exact = square * np.sqrt(rayleigh.section.stiffness(np.zeros((1, 2)))[0, 0, 0] / (STEEL.rho * THICKNESS))
    exact /= np.sqrt(1.0 + square * THICKNESS**2 / 12.0)
    assert_allclose(modes.omega, exact, rtol=1e-6)
    assert (np.abs(modes.omega / exact - 1.0) < modes.frequency_error).all()
    point = np.array([[0.2, 0.1]])  # at rest nothing turns
    assert_allclose(modes.shapes.compliance(point), thin.shapes.compliance(point), rtol=1e-5)
