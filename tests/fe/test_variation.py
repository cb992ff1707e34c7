"""Energies of a changed section: exact powers of uniform bodies, and differences of assembled matrices."""

import numpy as np
import pytest
from comparing import along
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.fe.variation import DIFFERENCES, SectionChange, energy_changes

WOOD = fi.Material(E=10e9, nu=0.3, rho=450.0)


@pytest.mark.parametrize("multiples, weights", DIFFERENCES)
def test_differences_are_exact_for_polynomials_of_degree_four(multiples, weights):
    for power in range(5):
        assert_allclose(np.power(np.array(multiples, float), power) @ weights, float(power == 1), atol=1e-14)


def plate(values):
    return fi.Plate(WOOD, thickness=lambda x: 3e-3 * (1.0 + 0.3 * x[:, 0] + values * x[:, 1]))


def bar(values):
    return fi.Beam.rectangular(WOOD, width=0.05, height=lambda x: 0.02 * (1.0 - values * np.sin(np.pi * x[:, 0] / 0.4)))


@pytest.mark.parametrize(
    "mesh, made, theory",
    [(fi.mesh.line(0.4), bar, "euler"), (fi.mesh.line(0.4), bar, "timoshenko"), (fi.mesh.disk(0.2), plate, None)],
)
def test_energies_are_differences_of_the_matrices(mesh, made, theory):
    value, step = 0.2, 1e-4
    modes = fi.find_modes(fi.assemble(mesh, made(value), {next(iter(mesh.edges)): "clamped"}, theory=theory), n_modes=5)
    system, vectors = modes.shapes.system, modes.shapes.vectors
    # the section itself has its own energies: those of the eigenvectors are the eigenvalues and one
    stiff, heavy = energy_changes(system, SectionChange((made(value),), (1.0,)), vectors)
    assert_allclose(heavy, np.eye(5), atol=1e-9)  # elements are integrated to rounding
    assert_allclose(np.diag(stiff), (modes.omega / system.frame.rate) ** 2, rtol=1e-9)
    stiffer, heavier = energy_changes(system, along(made, value, 1e-2), vectors)
    for matrix, kinds in ((stiffer, ("stiffness", "shear")), (heavier, ("inertia", "rotary"))):
        exact = 0.0
        for side in (-1.0, 1.0):  # the same forms with the whole section instead of its rate
            whole = SectionChange((made(value + side * step),), (side / (2.0 * step),))
            exact = exact + energy_changes(system, whole, vectors)[kinds[0] == "inertia"]
        # differences of second order of cubes of the thickness
        assert_allclose(matrix, exact, rtol=1e-6, atol=1e-7 * np.abs(matrix).max())


def test_morley_elements_have_none():
    mesh, wood, held = fi.mesh.rectangle(0.4, 0.3, size=0.2), fi.Plate(WOOD, 3e-3), {"boundary": "hinged"}
    change = SectionChange((wood,), (1.0,))
    morley, argyris = (fi.assemble(mesh, wood, held, element=element) for element in ("morley", "argyris"))
    with pytest.raises(ValueError, match="unknown for element 'morley'; take 'argyris'"):
        energy_changes(morley, change, np.zeros((morley.n_dofs, 1)))
    energy_changes(argyris, change, np.zeros((argyris.n_dofs, 1)))
