import numpy as np
import pytest

import fem_impact as fi
from fem_impact.fe import slopes

STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)


def test_quadrature_follows_the_true_curve():
    # hinged: the slope is steepest at the edge; straight sides would miss 1 % of the area of these few triangles
    drum = fi.assemble(fi.mesh.disk(0.2, size=0.08), fi.Plate(STEEL, 1e-3), {"boundary": "hinged"})
    system = fi.find_modes(drum, n_modes=1).shapes.system
    area = slopes.quadrature(system).dx.sum() * system.frame.length**2
    assert area == pytest.approx(np.pi * 0.2**2, rel=1e-5)  # arcs are followed by parabolas


def test_softness_of_a_tapered_beam():
    # int dx / (E b (h0 + h1 x)) is a logarithm
    h0, h1, width, length = 4e-3, 0.01, 0.02, 0.3
    bar = fi.Beam.rectangular(STEEL, width=width, height=lambda x: h0 + h1 * x[:, 0])
    system = fi.assemble(fi.mesh.line(length), bar, {"left": "hinged", "right": "hinged"})
    whole = np.log1p(h1 * length / h0) / h1
    found = slopes.lengthening_of_beam(system, np.zeros((system.n_dofs, 1)))[1]
    assert found == pytest.approx(whole / (STEEL.E * width), rel=1e-10)


def test_a_beam_is_lengthened_as_its_sines_are():
    bar, length = fi.Beam.rectangular(STEEL, width=0.02, height=4e-3), 0.3
    modes = fi.find_modes(fi.assemble(fi.mesh.line(length), bar, {"left": "hinged", "right": "hinged"}), n_modes=4)
    found = slopes.lengthening_of_beam(modes.shapes.system, modes.shapes.vectors)[0]
    wanted = np.diag((np.pi * np.arange(1, 5) / length) ** 2 / (modes.mass / length))
    assert found == pytest.approx(wanted, rel=1e-10, abs=1e-10 * wanted.max())
