"""What taking material off does: powers of uniform bodies, differences of modes found again, areas of dishes."""

from types import SimpleNamespace

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.designs import removal
from fem_impact.designs.removal import PER_CENT, Dishes, Places, Sensitivity

WOOD = fi.Material(E=16e9, nu=0.35, rho=900.0)
BAR = fi.Beam.rectangular(WOOD, width=0.05, height=0.012)
ROUND = fi.Beam.circular(WOOD, diameter=0.012)
PLATE = fi.Plate(WOOD, 4e-3)
LINE, SHEET = fi.mesh.line(0.35), fi.mesh.rectangle(0.3, 0.2, size=0.05)


def sensitivity(system, count=8):
    modes = fi.find_modes(system, n_modes=count)
    which = np.arange(modes.n_rigid, count)
    return modes, Sensitivity.of(modes.shapes.system, modes.shapes.vectors[:, which], modes.omega[which])


@pytest.mark.parametrize(
    ("mesh", "section", "factor", "size"),
    [(LINE, BAR, 1.0, 0.35 * 0.05), (LINE, ROUND, 2.0, 0.35 * np.pi * 0.012), (SHEET, PLATE, 1.0, 0.06)],
)
def test_frequencies_of_thin_bodies_fall_with_their_thickness(mesh, section, factor, size):
    """The frequency of a thin body is as its thickness; a round bar loses from both sides."""
    _, found = sensitivity(fi.assemble(mesh, section))
    thick = 0.012 if mesh is LINE else 4e-3
    assert_allclose(found.cents.sum(axis=0), -factor * PER_CENT / thick, rtol=1e-6)  # of the modes' own errors
    assert_allclose(found.areas.sum(), size, rtol=1e-12)


CURVED = fi.Plate(WOOD, 4e-3, rise=fi.rise.cap(0.8, centre=(0.15, 0.1)))
THICK = fi.Plate(WOOD, 0.03)
DISHED = {
    "euler": (LINE, BAR, None, 1e-9), "timoshenko": (LINE, BAR, "timoshenko", 1e-9), "round": (LINE, ROUND, None, 1e-9),
    "kirchhoff": (SHEET, PLATE, None, 1e-6), "mindlin": (SHEET, THICK, "mindlin", 1e-6),
    "shallow": (SHEET, CURVED, None, 1e-6),
}  # fmt: skip


@pytest.mark.parametrize("name", [pytest.param(each, marks=[pytest.mark.slow] * (each not in ("euler", "round")))
                                  for each in DISHED])  # fmt: skip
def test_slopes_of_a_dish_are_differences_of_solved_modes(name):
    mesh, section, theory, rtol = DISHED[name]
    middles = np.array([[0.1]]) if mesh is LINE else np.array([[0.1, 0.08]])
    radius, step = 0.06, 1e-3 * float(removal.thickness(section, mesh.points).min())
    supports = {"left": "clamped"}
    now, found = sensitivity(fi.assemble(mesh, section, supports, theory=theory), 4)
    slopes, areas = found.of_dishes(middles, radius)

    def solved(depth):
        less = removal.thinned_section(section, Dishes(middles, np.array([depth]), radius).depth)
        return fi.find_modes(fi.assemble(mesh, less, supports, theory=theory), n_modes=4).frequencies

    below, above = solved(-step), solved(step)
    exact = PER_CENT * (above - below) / (2.0 * step * now.frequencies)
    # differences err by the square of a step of 1e-3, and by rounding of 1e-10 over that step
    assert_allclose(slopes[0], exact, rtol=0.0, atol=max(1e-4, rtol) * np.abs(exact).max())
    if mesh is SHEET:
        assert_allclose(areas, np.pi * radius**2 / 3.0, rtol=2e-2)  # a little of it lies beyond the edge


def test_a_dish_within_a_plate_has_the_area_of_its_formula():
    system = fi.assemble(fi.mesh.rectangle(1.0, 1.0, size=0.1), PLATE)
    _, found = sensitivity(system, 4)
    areas = found.of_dishes(np.array([[0.5, 0.5], [0.5, 0.0]]), 0.15)[1]
    assert_allclose(areas, np.pi * 0.15**2 / 3.0 * np.array([1.0, 0.5]), rtol=1e-5)  # Gauss points of the elements


def test_images_stand_once_and_places_lie_on_the_body():
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3, size=0.1), PLATE)
    assert removal.mirror_images(np.array([0.1, 0.1]), "xy", system).tolist() == pytest.approx(
        np.array([[0.1, 0.1], [0.3, 0.1], [0.1, 0.2], [0.3, 0.2]])
    )
    assert len(removal.mirror_images(np.array([0.2, 0.1]), "xy", system)) == 2
    places = Places.over(system, 0.1, "x")
    depths = np.zeros(len(places.first))
    depths[[0, -1]] = 1e-3, 2e-3
    assert places.dishes(depths).depths.tolist() == [1e-3, 1e-3, 2e-3]  # the last lies in the middle
    nearby = removal.dish_profile(
        (places.gap / places.radius) ** 2
    )  # what a dish keeps where no point looked at is nearer
    assert_allclose(nearby * (places.overlaps @ depths), places.dishes(depths).depth(places.between), atol=1e-15)
    some = places.some(np.array([len(depths) - 1, 0]))
    assert_allclose(some.first, places.first[[-1, 0]])


TWO_LAYERS = fi.Plate.laminate([(WOOD, 1e-3, 0.0), (WOOD, 1e-3, np.pi / 2)])
RIBBED = fi.Plate(WOOD, 4e-3, ribs=(SimpleNamespace(rigidity=None),))


test_bodies_that_nothing_is_taken_off_are_refused = refusing([
    (lambda: removal.check_body(TWO_LAYERS), r"section must not have layers: .*; take a plate of one material"),
    (lambda: removal.check_body(RIBBED), r"section must not have ribs here; use fi\.design"),
])  # fmt: skip
