"""How steep a shell is, and what the inertia in its plane does, against exact panels."""

from dataclasses import replace

import numpy as np
import pytest
import references_shells as reference
from comparing import examined
from references_panels import Order, Panel, panel_modes

import fem_impact as fi
from fem_impact.fe import shallow
from fem_impact.model import audit
from fem_impact.model.target import Target

E, NU, RHO, H = 70e9, 0.3, 2700.0, 2e-3
SIDES, CURVATURE = (0.4, 0.3), -0.5
PLATE = fi.Plate(fi.Material(E=E, nu=NU, rho=RHO), H)


def panel(curvature=CURVATURE):
    def rise(points):
        return 0.5 * curvature * ((points - np.array(SIDES) / 2.0) ** 2).sum(axis=1)

    mesh = fi.mesh.rectangle(*SIDES)
    return fi.assemble(mesh, PLATE, {"boundary": "hinged"}, rise=rise, in_plane={"boundary": "sliding"})


def sloped(x, y):
    return CURVATURE * (x - SIDES[0] / 2.0), CURVATURE * (y - SIDES[1] / 2.0)


def test_the_mass_in_the_plane_lowers_frequencies_as_the_exact_panel_has_it():
    modes = fi.find_modes(panel(), n_modes=1)
    shape = modes.shapes.vectors[:, 0]
    share = shape @ shallow.plane_mass(modes.shapes.system, shape[:, None])[:, 0]
    # half the square of the slope c (x - a / 2), over sin**2: c**2 a**2 (1 / 12 - 1 / (2 pi**2)) / 2
    surface = 0.5 * CURVATURE**2 * (1.0 / 12.0 - 0.5 / np.pi**2) * (SIDES[0] ** 2 + SIDES[1] ** 2)
    stiffness, edges = reference.isotropic(E, NU, H), (("hinged", "sliding"),) * 4
    bodies = (Panel(SIDES, stiffness, RHO * H, edges, sloped, inertia=inertia) for inertia in (False, True))
    still, heavy = (panel_modes(body, 1, Order(1, 12))[0][0] for body in bodies)
    # first order of a share of 2e-3
    assert share - surface == pytest.approx((still / heavy) ** 2 - 1.0, rel=0.02)


def test_a_blow_says_how_steep_its_target_is_and_a_flat_one_does_not():
    blow = fi.Striker.rigid(5e-3), fi.Contact.hertz(1e7)
    how = {"at": (0.13, 0.1), "speed": 0.1, "tolerance": 1e-2, "damping_ratio": 0.01}
    plane = fi.assemble(fi.mesh.rectangle(*SIDES), PLATE, {"boundary": "hinged"})
    steep, flat = (examined(fi.strike(body, *blow, **how), "shallow target") for body in (panel(), plane))
    assert steep.value == pytest.approx(-CURVATURE * 0.5 * np.hypot(*SIDES), rel=1e-3)  # of a plane through triangles
    assert steep.doubtful and 0.0 < steep.worst < 0.05
    assert "steepest slope of the rise is 0.13" in steep.sentence
    assert "take its modes from a program for shells" in steep.sentence
    assert flat.value is None and flat.worst == 0.0


def test_a_tilt_of_the_rise_counts_as_slope_and_leaves_the_modes():
    mesh, edges = fi.mesh.rectangle(*SIDES), {"boundary": "hinged"}
    tilted = fi.assemble(mesh, replace(PLATE, rise=lambda points: 0.3 * points[:, 0]), edges)
    flat, modes = (fi.find_modes(body, n_modes=3) for body in (fi.assemble(mesh, PLATE, edges), tilted))
    assert np.allclose(modes.frequencies, flat.frequencies, rtol=1e-6)  # to which both are found
    assert shallow.steepest(tilted) == pytest.approx(0.3, rel=1e-9)
    shape = modes.shapes.vectors[:, 0]
    # the surface is larger by half the square of the slope; nothing moves in the plane
    assert shape @ shallow.plane_mass(tilted, shape[:, None])[:, 0] == pytest.approx(0.5 * 0.3**2, rel=1e-6)


@pytest.mark.slow
def test_advice_on_bodies_without_thick_theory_is_not_to_take_it():
    """Blows on curved and ribbed plates named theory = "mindlin", which is refused, and called flat ones too steep."""
    rib = fi.Rib([(0.1, 0.0), (0.1, 0.3)], fi.Beam.rectangular(PLATE.material, width=3e-3, height=8e-3))
    ribbed = fi.assemble(fi.mesh.rectangle(*SIDES), PLATE, {"boundary": "hinged"}, ribs=[rib])
    ball, contact = fi.Striker.rigid(5e-3), fi.Contact.hertz(3e8)
    for system, curved in ((panel(), True), (ribbed, False)):
        hit = fi.strike(system, ball, contact, at=(0.13, 0.1), speed=0.3, tolerance=1e-1, damping_ratio=0.01)
        thin, steep = (examined(hit, name) for name in ("thin target", "shallow target"))
        assert "take a softer contact" in thin.remedy and "mindlin" not in hit.summary()
        assert ("too steep" in steep.remedy) == curved == (steep.value is not None)
        assert curved or "ribs and layers move in the plane" in steep.sentence
        target = Target.of(system)
        better = audit.required_model(target, replace(hit, tolerance=1e-9))
        assert better is not None and "theory" not in better[0]  # air or stretching are next
