"""Plates of layers against one layer, closed forms of cross-ply and angle-ply, and shear of sandwiches."""

import numpy as np
import pytest
import references_shells as reference
from comparing import refusing

import fem_impact as fi

ALUMINIUM = fi.Material(E=70e9, nu=0.3, rho=2700.0)
CARBON = fi.Material.orthotropic(E_along=140e9, E_across=10e9, nu=0.3, G=5e9, rho=1600.0)
PLY = (140e9, 10e9, 0.3, 5e9)
ORIGIN = np.zeros((1, 2))


def test_layers_of_one_material_are_one_plate():
    layered, whole = fi.Plate.laminate([(ALUMINIUM, 1e-3, 0.0), (ALUMINIUM, 2.5e-3, 0.3)]), fi.Plate(ALUMINIUM, 3.5e-3)
    for name in ("stiffness", "inertia", "shear", "rotary", "walls"):
        mine, its = getattr(layered, name)(ORIGIN), getattr(whole, name)(ORIGIN)
        np.testing.assert_allclose(mine, its, rtol=1e-12, atol=1e-12 * np.abs(its).max())
    assert layered.plain and not layered.uniform


@pytest.mark.parametrize("angles, in_plane, exact", [
    ((0.0, 90.0), "sliding", reference.diaphragm_panel), ((45.0, -45.0), "across", reference.angle_ply_panel),
])  # fmt: skip
def test_layers_that_couple_have_the_frequencies_of_closed_forms(angles, in_plane, exact):
    sides, ply = (0.3, 0.2), 1e-3
    plate = fi.Plate.laminate([(CARBON, ply, np.radians(angle)) for angle in reversed(angles)])  # theirs begin below
    stiffness = reference.stack([(PLY, ply, angle) for angle in angles])
    waves = [(i, j) for i in range(1, 8) for j in range(1, 8)]
    every = np.sort([exact(sides, stiffness, 1600.0 * 2.0 * ply, each) for each in waves])[:8]
    system = fi.assemble(fi.mesh.rectangle(*sides), plate, {"boundary": "hinged"}, in_plane={"boundary": in_plane})
    assert plate.coupled and system.theory == "shallow"
    np.testing.assert_allclose(fi.find_modes(system, n_modes=8, tolerance=1e-5).omega, every, rtol=1e-5)


def test_symmetric_layers_need_no_plane():
    plate = fi.Plate.laminate([(CARBON, 1e-3, angle) for angle in (0.3, -0.3, -0.3, 0.3)])
    system = fi.assemble(fi.mesh.rectangle(0.3, 0.2), plate, {"boundary": "hinged"})
    forced = fi.assemble(fi.mesh.rectangle(0.3, 0.2), plate, {"boundary": "hinged"}, theory="shallow")
    thin, shell = (fi.find_modes(each, n_modes=3, tolerance=1e-5).omega for each in (system, forced))
    assert system.theory == "kirchhoff"
    np.testing.assert_allclose(thin, shell, rtol=2e-5)


def test_the_core_of_a_sandwich_gives_by_shear():
    # thin stiff faces on a soft core: G_core (core + face)**2 / core (Allen 1969, Analysis of sandwich panels, ch. 2)
    face, core = 0.2e-3, 10e-3
    foam = fi.Material(E=30e6, nu=0.3, rho=60.0)
    panel = fi.Plate.laminate([(ALUMINIUM, face, 0.0), (foam, core, 0.0), (ALUMINIUM, face, 0.0)])
    G = foam.E / 2.6
    assert panel.shear(ORIGIN)[0, 0, 0] == pytest.approx(G * (core + face) ** 2 / core, rel=2e-3)
    system = [
        fi.assemble(fi.mesh.rectangle(0.5, 0.4), panel, {"boundary": "hinged"}, theory=theory)
        for theory in ("kirchhoff", "mindlin")
    ]
    thin, thick = (fi.find_modes(each, n_modes=1, tolerance=1e-3).omega[0] for each in system)
    # a hinged sandwich: omega**2 drops by 1 + D k**2 / S, with k**2 of its half waves (Allen)
    D, square = panel.stiffness(ORIGIN)[0, 0, 0], (np.pi / 0.5) ** 2 + (np.pi / 0.4) ** 2
    assert (thin / thick) ** 2 == pytest.approx(1.0 + D * square / panel.shear(ORIGIN)[0, 0, 0], rel=2e-2)


UNEVEN = fi.Plate.laminate([(ALUMINIUM, 1e-3, 0.0), (CARBON, 1e-3, 0.0)])


test_what_no_layers_can_be_is_refused_by_name = refusing([
    (fi.Plate.laminate, ([(ALUMINIUM, 1e-3, 0.0), (ALUMINIUM, 1e-3)],),
     r"layers\[1\] must be \(material, thickness in m, angle in rad\)"),
    (fi.Plate.laminate, ([(ALUMINIUM, -1e-3, 0.0)],), r"thickness of layers\[0\] must be positive"),
    (fi.Plate, (UNEVEN.material, 1e-3), "thickness must be that of the layers; make a plate of layers by"),
    (fi.Plate, (ALUMINIUM, 2e-3), "material must be that of the layers"),
], lambda make, given: make(*given, **{"layers": UNEVEN.layers} if make is fi.Plate else {}))  # fmt: skip
