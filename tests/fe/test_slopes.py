import numpy as np
import pytest

import fem_impact as fi
from fem_impact.fe import slopes

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)


def products(modes, weight):
    return slopes.products(modes.shapes.system, modes.shapes.vectors, weight)


def test_products_of_a_rectangle_are_those_of_its_sines():
    plate, sides = fi.Plate(STEEL, 1e-3), np.array([0.2, 0.3])
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(*sides), plate, {"boundary": "hinged"}), n_modes=4)
    numbers = np.array([(1, 1), (1, 2), (2, 1), (1, 3)])
    for weight in (np.eye(2), np.diag([1.0, 0.0]), np.diag([0.0, 3.0])):
        wanted = (np.pi * numbers / sides) ** 2 @ weight.diagonal() / (STEEL.rho * 1e-3)
        # the error of the modes themselves, 1e-5 in the fourth
        assert products(modes, weight) == pytest.approx(np.diag(wanted), rel=1e-8, abs=1e-8 * wanted.max())


def test_products_count_the_true_curve():
    # hinged: the slope is steepest at the edge; straight sides would miss 1 % of the area of these few triangles
    drum = fi.assemble(fi.mesh.disk(0.2, size=0.08), fi.Plate(STEEL, 1e-3), {"boundary": "hinged"})
    system = fi.find_modes(drum, n_modes=1).shapes.system
    area = slopes.quadrature(system).dx.sum() * system.frame.length**2
    assert area == pytest.approx(np.pi * 0.2**2, rel=1e-5)  # arcs are followed by parabolas
    assert slopes.softness(system) == pytest.approx(np.pi * 0.2**2 / 1e-3, rel=1e-5)


def test_softness_of_a_tapered_beam_and_a_wedge():
    # int dx / (E b (h0 + h1 x)) is a logarithm
    h0, h1, width, length = 4e-3, 0.01, 0.02, 0.3
    bar = fi.Beam.rectangular(STEEL, width=width, height=lambda x: h0 + h1 * x[:, 0])
    system = fi.assemble(fi.mesh.line(length), bar, {"left": "hinged", "right": "hinged"})
    whole = np.log1p(h1 * length / h0) / h1
    assert slopes.softness(system) == pytest.approx(whole / (STEEL.E * width), rel=1e-10)
    wedge = fi.Plate(STEEL, lambda x: h0 + h1 * x[:, 0])
    plate = fi.assemble(fi.mesh.rectangle(length, 0.2), wedge, {"boundary": "hinged"})
    assert slopes.softness(plate) == pytest.approx(0.2 * whole, rel=1e-10)


def test_thick_elements_give_the_slopes_of_their_deflection():
    body = fi.mesh.rectangle(0.2, 0.3, size=0.15), fi.Plate(STEEL, 2e-4), {"boundary": "hinged"}
    systems = (fi.assemble(*body, theory=theory) for theory in ("kirchhoff", "mindlin"))
    one, two = (products(fi.find_modes(each, n_modes=2), np.eye(2)).diagonal() for each in systems)
    assert two == pytest.approx(one, rel=1e-4)  # as thin, shear changes the shapes by some (h k)**2 = 1e-5
