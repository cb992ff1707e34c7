import numpy as np
import pytest

import fem_impact as fi
from fem_impact.modes.stretching import stretch

E, NU, RHO, H = 210e9, 0.3, 7850.0, 1e-3
STEEL = fi.Material(E=E, nu=NU, rho=RHO)
PLATE = fi.Plate(STEEL, H)
SPRUCE = fi.Material.orthotropic(E_along=11e9, E_across=0.8e9, nu=0.37, G=0.7e9, rho=430.0)


def energy(modes, q):
    """V = 1/4 sum (q' B q)**2."""
    return 0.25 * sum(float(q @ form @ q) ** 2 for form in stretch(modes).forms)


def same_forms(one, other, rel):
    """The forms may differ by signs and turns of equal modes; their eigenvalues may not."""
    values = [np.linalg.eigvalsh(stretch(modes).forms[0]) for modes in (one, other)]
    assert values[0] == pytest.approx(values[1], rel=rel, abs=1e-12 * values[1].max())  # a stout beam only turns in one


def test_energy_of_a_hinged_square_is_bergers():
    # w = a sin sin: int |grad w|**2 = a**2 pi**2 / 2, energy E h / (8 A (1 - nu**2)) times its square
    side, a = 0.2, 0.7e-3
    modes = fi.analytic.rectangle(side, side, section=PLATE, n_modes=1)
    q = np.array([a / modes.shape_at([(side / 2, side / 2)])[0, 0]])
    wanted = E * H / (8.0 * side**2 * (1.0 - NU**2)) * (a**2 * np.pi**2 / 2.0) ** 2
    assert energy(modes, q) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("theory, height", [("euler", 3e-3), ("timoshenko", 3e-3), ("timoshenko", 0.05)])
@pytest.mark.parametrize("ends", [("hinged", "hinged"), ("clamped", "hinged"), ("clamped", "clamped")])
def test_beams_by_elements_and_by_formulas(ends, theory, height):
    bar = fi.Beam.rectangular(STEEL, width=0.02, height=height)
    closed = fi.analytic.beam(0.3, ends=ends, section=bar, n_modes=8, theory=theory)
    system = fi.assemble(fi.mesh.line(0.3), bar, {"left": ends[0], "right": ends[1]}, theory=theory)
    same_forms(closed, fi.find_modes(system, n_modes=8), 1e-9)


def test_a_beam_between_walls_stretches_as_woinowsky_krieger_says():
    bar, length, a = fi.Beam.rectangular(STEEL, width=0.02, height=3e-3), 0.3, 1e-3
    modes = fi.analytic.beam(length, ends=("hinged", "hinged"), section=bar, n_modes=1)
    q = np.array([a / abs(modes.shape_at([length / 2])[0, 0])])
    tension = E * 0.02 * 3e-3 * (np.pi * a / (2.0 * length)) ** 2  # E A times the mean of w'**2 / 2
    assert energy(modes, q) == pytest.approx(0.25 * tension * a**2 * np.pi**2 / (2.0 * length), rel=1e-10)


@pytest.mark.parametrize("edge", ["clamped", "hinged"])
def test_disks_by_elements_and_by_formulas(edge):
    closed = fi.analytic.disk(0.2, edge=edge, section=PLATE, n_modes=14)
    found = fi.find_modes(fi.assemble(fi.mesh.disk(0.2), PLATE, {"boundary": edge}), n_modes=14)
    same_forms(closed, found, 3e-5)  # 1e-5 from the shapes of the highest modes


def test_rectangles_by_elements_and_by_formulas():
    closed = fi.analytic.rectangle(0.2, 0.3, section=PLATE, n_modes=12)
    found = fi.find_modes(fi.assemble(fi.mesh.rectangle(0.2, 0.3), PLATE, {"boundary": "hinged"}), n_modes=12)
    same_forms(closed, found, 1e-7)


def test_grain_along_and_across():
    # a hinged wooden rectangle: s = int sqrt(C11) w_x**2 + sqrt(C22) w_y**2, turned with the grain
    sides = np.array([0.2, 0.3])
    local = SPRUCE.plane_stress
    for angle, order in ((0.0, (0, 1)), (np.pi / 2.0, (1, 0))):
        wood = fi.Material.orthotropic(E_along=11e9, E_across=0.8e9, nu=0.37, G=0.7e9, rho=430.0, angle=angle)
        system = fi.assemble(fi.mesh.rectangle(*sides), fi.Plate(wood, H), {"boundary": "hinged"})
        modes = fi.find_modes(system, n_modes=1)
        roots = np.sqrt(local.diagonal()[:2])[list(order)]
        gram = float((np.pi / sides) ** 2 @ roots) / (430.0 * H)
        assert stretch(modes).forms[0, 0, 0] == pytest.approx(gram / np.sqrt(2.0 * sides.prod() / H), rel=1e-9)


def test_modes_in_air_stretch_as_their_mixture():
    modes = fi.analytic.rectangle(0.2, 0.3, section=PLATE, n_modes=12)
    mixed = fi.in_air(modes, density=300.0)  # dense enough to mix them visibly
    mix = mixed.shapes.mix
    wanted = mix.T @ stretch(modes).forms[0] @ mix
    assert stretch(mixed).forms[0] == pytest.approx(wanted, rel=1e-12, abs=1e-9 * wanted.max())
    assert np.abs(wanted - np.diag(wanted.diagonal())).max() > 1e-3 * wanted.max()


def test_ritz_vectors_stretch_as_modes_do():
    # the same static dent under a point force, of which a few vectors hold all: the same energy
    system = fi.assemble(fi.mesh.rectangle(0.2, 0.3), PLATE, {"boundary": "hinged"}, near=[(0.08, 0.1)])
    vectors = fi.ritz_modes(system, [(0.08, 0.1)], max_frequency=3e3, n_vectors=60)
    modes = fi.analytic.rectangle(0.2, 0.3, section=PLATE, n_modes=1500)
    found = [each.shape_at([(0.08, 0.1)])[0] / each.omega**2 for each in (vectors, modes)]
    # 1 - 4e-7 of int |grad w|**2 is in these modes
    assert energy(vectors, found[0]) == pytest.approx(energy(modes, found[1]), rel=1e-5)


@pytest.mark.parametrize(
    "body, why",
    [
        (lambda: fi.Modes.rigid(1.0), "a mass has none"),
        (lambda: fi.analytic.rectangle(0.2, 0.2, mass=1.0, first_frequency=100.0, n_modes=4), "section is not known"),
        (lambda: fi.analytic.disk(0.2, edge="free", section=PLATE, n_modes=8), "can move rigidly"),
        (
            lambda: fi.find_modes(
                fi.assemble(fi.mesh.rectangle(0.2, 0.2), PLATE, {"left": "clamped", "right": "clamped"}), n_modes=4
            ),
            "an edge is free or elastic",
        ),
        (
            lambda: fi.find_modes(
                fi.assemble(fi.mesh.rectangle(0.2, 0.2, size=0.1), PLATE, {"boundary": "hinged"}, element="morley"),
                n_modes=4,
            ),
            "element 'morley'",
        ),
        (
            lambda: fi.analytic.beam(
                0.3,
                ends=("clamped", "free"),
                section=fi.Beam.rectangular(STEEL, width=0.02, height=H),
                n_modes=4,
            ),
            "an end is free",
        ),
    ],
)
def test_bodies_that_may_slip_are_refused(body, why):
    with pytest.raises(ValueError, match=why):
        stretch(body())
