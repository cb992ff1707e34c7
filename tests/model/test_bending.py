import numpy as np
import pytest
import thick_elements  # the study, which has the exact equations
from scipy.special import jn_zeros
from thick_plates import ritz

import fem_impact as fi
from fem_impact.model import bending as module
from fem_impact.model.thinness import lowered_by

E, NU, RHO = 210e9, 0.3, 7850.0
STEEL = fi.Material(E=E, nu=NU, rho=RHO)
SIDE, THIN = 0.1, fi.Plate(STEEL, 0.002)


def integrals(modes):
    return module.integrate_shapes(module.known_of(modes))


def by_elements(mesh, section, supports, **how):
    theory = how.pop("theory", None)
    return fi.find_modes(fi.assemble(mesh, section, supports, theory=theory), **how)


def drops(modes, exact):
    """Relative drops of the flexible frequencies of a thick body: estimated, and exact."""
    flexible = modes.omega > 0.0
    told = 1.0 - lowered_by(integrals(modes).thick)
    return told[flexible][: len(exact)], 1.0 - exact / modes.omega[flexible][: len(exact)]


@pytest.mark.parametrize("ends", [("hinged", "hinged"), ("clamped", "free"), ("free", "free"), ("clamped", "hinged")])
@pytest.mark.parametrize("height", [0.005, 0.06])
def test_frequencies_of_a_thick_beam_drop_as_timoshenko_says(ends, height):
    section, how = fi.Beam.rectangular(STEEL, width=0.02, height=height), {"ends": ends, "n_modes": 7}
    closed, stout = (fi.analytic.beam(0.4, section=section, theory=theory, **how) for theory in ("euler", "timoshenko"))
    others = by_elements(fi.mesh.line(0.4), section, dict(zip(("left", "right"), ends)), n_modes=7)
    for body in (closed, others):
        told, true = drops(body, stout.omega[stout.omega > 0.0][:5])
        assert true.min() < 2e-3 or true.max() > 0.3  # thin and thick
        # 1 % while the drop is small; the estimate saturates as the truth does, 7 % off at a drop of 40 %
        np.testing.assert_allclose(told, true, rtol=0.005 + 0.2 * true.max())


@pytest.mark.parametrize("edge", ["clamped", "hinged", "free"])
@pytest.mark.parametrize("h", [0.005, 0.02])
@pytest.mark.slow
def test_frequencies_of_a_thick_disk_drop_as_mindlin_says(edge, h):
    plate = fi.Plate(STEEL, h)
    exact = thick_elements.disk_frequencies(h / SIDE, edge, 5, NU) * np.sqrt(E / RHO) / SIDE
    for body in (
        fi.analytic.disk(SIDE, edge=edge, section=plate, n_modes=12),
        by_elements(fi.mesh.disk(SIDE), plate, {"boundary": edge}, n_modes=12),
    ):
        # measured 0.82 to 1.05: at a free edge the layer of twist, 0.32 h, is not short beside the waves
        np.testing.assert_allclose(*drops(body, exact), rtol=0.2 if edge == "free" else 0.06)


@pytest.mark.parametrize("edges", [("free",) * 4, ("clamped", "free", "hinged", "free"), ("hinged",) * 4])
def test_frequencies_of_a_thick_square_drop_as_mindlin_says(edges):
    h, supports = 0.008, dict(zip(("left", "right", "bottom", "top"), edges))
    modes = by_elements(fi.mesh.rectangle(SIDE, SIDE), fi.Plate(STEEL, h), supports, n_modes=12)
    exact = ritz(h / SIDE, NU, edges, 11, 12) * np.sqrt(E / RHO) / SIDE
    told, true = drops(modes, exact[exact > 1e-3 * exact[-1]][:6])
    np.testing.assert_allclose(told, true, rtol=0.25)  # the layers of the free corners are left out


def test_hinged_polygons_follow_wang():
    mesh = fi.mesh.polygon([(0.0, 0.0), (0.2, 0.0), (0.05, 0.15)])
    modes = by_elements(mesh, fi.Plate(STEEL, 0.01), {"boundary": "hinged"}, n_modes=12)
    exact = thick_elements.hinged_polygon(modes.omega, 0.01, E=E, nu=NU, rho=RHO)
    np.testing.assert_allclose(*drops(modes, exact), rtol=0.06)  # drops of 3 to 25 %


ELL = [(0.0, 0.0), (0.4, 0.0), (0.4, 0.2), (0.2, 0.2), (0.2, 0.4), (0.0, 0.4)]


@pytest.mark.parametrize(("corners", "thickness", "support", "n_modes", "low", "high"), [
    # 0.98 to 1.05 clamped, 0.53 to 1.02 hinged, where the force grows faster and hangs on where it ends
    (ELL, 0.015, "clamped", 6, 0.9, 1.15), (ELL, 0.015, "hinged", 6, 0.45, 1.1),
    pytest.param(ELL, 0.005, "hinged", 6, 0.45, 1.1, marks=pytest.mark.slow),
    # obtuse: first order in the drop; it was told a thousand times too large, by what the mesh resolves
    ([(0.0, 0.0), (0.3, 0.0), (0.2, 0.2), (-0.1, 0.2)], 0.01, "hinged", 2, 0.95, 1.05),
])  # fmt: skip
def test_shear_at_a_corner_is_finite(corners, thickness, support, n_modes, low, high):
    """The thin plate's shear energy there is infinite: it was up to 2e12 times too large, by what the mesh resolves."""
    body = fi.mesh.polygon(corners, size=0.08), fi.Plate(STEEL, thickness), {"boundary": support}
    thin, mindlin = (by_elements(*body, theory=theory, n_modes=n_modes, tolerance=1e-3) for theory in (None, "mindlin"))
    ratio = integrals(thin).thick / ((thin.omega / mindlin.omega) ** 2 - 1.0)
    assert ratio.min() > low and ratio.max() < high


def test_a_free_plate_is_softer_at_its_edges_by_the_first_power_of_its_thickness():
    strips = [by_elements(fi.mesh.rectangle(0.4, 0.04), fi.Plate(STEEL, h), {}, n_modes=12) for h in (0.001, 0.002)]
    edge = [integrals(modes).edge.max() for modes in strips]  # of the first torsion
    assert edge[0] == pytest.approx(0.63 * 0.001 / 0.04, rel=0.05)  # Saint-Venant's strip: 1 - 0.63 h / b
    assert edge[1] / edge[0] == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize(("closed", "mesh", "edge"), [
    (fi.analytic.rectangle(0.3, 0.2, section=THIN, n_modes=30), fi.mesh.rectangle(0.3, 0.2), "hinged"),
    (fi.analytic.disk(0.1, edge="clamped", section=THIN, n_modes=8), fi.mesh.disk(0.1), "clamped"),
], ids=["rectangle", "disk"])  # fmt: skip
def test_closed_forms_and_elements_have_the_same_integrals(closed, mesh, edge):
    one, two = integrals(closed), integrals(by_elements(mesh, THIN, {"boundary": edge}, n_modes=closed.n_modes))
    # the slivers at curved edges; on straight ones three Gauss points a side leave 9e-6, third derivatives 7e-4
    straight = edge == "hinged"
    for name, rtol in (
        ("wave", 0.01),
        ("rotary", 0.01),
        ("slope", 2e-5 if straight else 0.01),
        ("shear", 1e-3 if straight else 0.01),
    ):
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), rtol=rtol)
    np.testing.assert_allclose(np.abs(one.volume)[:8], np.abs(two.volume)[:8], atol=0.01 * np.abs(one.volume).max())


def test_the_first_hinged_mode_is_that_of_its_sines_and_high_ones_follow_from_the_low():
    modes = fi.analytic.rectangle(0.3, 0.2, section=THIN, n_modes=300)
    found = integrals(modes)
    assert found.wave[0] == pytest.approx(np.pi * np.hypot(1.0 / 0.3, 1.0 / 0.2), rel=1e-12)
    assert found.volume[0] == pytest.approx(8.0 * 0.06 / np.pi**2 * modes.mass**-0.5, rel=1e-12)
    exact = np.sqrt(modes.omega / modes.omega[0]) * found.wave[0]
    np.testing.assert_allclose(found.wave, exact, rtol=0.02)  # the mean of the last ten integrated modes


def test_scaled_bodies_keep_their_waves_and_forget_their_section():
    modes = fi.analytic.disk(0.1, edge="clamped", section=THIN, n_modes=5)
    scaled = modes.scaled(mass=2.0 * modes.mass)
    assert scaled.section is None and modes.scaled(mass=modes.mass).section is not None
    np.testing.assert_allclose(integrals(scaled).wave, integrals(modes).wave, rtol=1e-12)
    assert integrals(scaled).thick is None


def test_ritz_pairs_are_as_thick_as_modes():
    plate, at = fi.Plate(STEEL, 0.005), [(0.1, 0.08)]
    system = fi.assemble(fi.mesh.rectangle(0.3, 0.2), plate, {"boundary": "hinged"}, near=at)
    pairs = fi.ritz_modes(system, at, max_frequency=2e4, n_vectors=60)
    modes = fi.analytic.rectangle(0.3, 0.2, section=plate, n_modes=400)
    expected = np.interp(pairs.omega, modes.omega, integrals(modes).thick)
    np.testing.assert_allclose(integrals(pairs).thick[:40], expected[:40], rtol=0.1)


def test_bodies_without_shapes_are_not_known():
    measured = fi.Modes.from_arrays([100.0], [[1.0]], points=[(0.1, 0.1)], mass=0.5, complete=True)
    assert module.known_of(fi.Modes.rigid(1.0)) is None and module.known_of(measured) is None


@pytest.mark.slow
def test_a_drumhead_has_the_waves_of_its_membrane():
    skin = fi.Plate(fi.Material(E=4e9, nu=0.38, rho=1390.0), 0.1e-3, tension=4000.0)
    modes = by_elements(fi.mesh.disk(0.3), skin, {"boundary": "hinged"}, n_modes=3)
    assert integrals(modes).wave[0] == pytest.approx(jn_zeros(0, 1)[0] / 0.3, rel=1e-3)


@pytest.mark.parametrize("ends", [("hinged", "clamped"), ("free", "free")])
def test_a_stout_beam_by_formulas_has_the_slopes_of_one_by_elements(ends):
    section, theory = fi.Beam.rectangular(STEEL, width=0.02, height=0.03), {"theory": "timoshenko", "n_modes": 8}
    closed = fi.analytic.beam(0.3, ends=ends, section=section, **theory)
    found = by_elements(fi.mesh.line(0.3), section, dict(zip(("left", "right"), ends)), **theory)
    np.testing.assert_allclose(integrals(closed).slope, integrals(found).slope, rtol=1e-6, atol=1e-6)
    assert module.known_of(closed).held == float(ends[0] == "hinged")
