"""What a number of a blow changes in the modes and contact of its run: differences of rebuilt blows."""

import gradient_claims as claims
import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi

WOOD = fi.Material(E=10e9, nu=0.3, rho=450.0)
NUMBERS = claims.random_numbers(np.random.default_rng(12)) | {"contact.loss": 0.1, "target.damping_ratio": 0.01}


def test_finite_elements_and_closed_forms_change_alike_with_the_strike_point():
    section = fi.Plate(WOOD, thickness=3e-3)
    system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), section, {"boundary": "hinged"})
    exact, how = fi.analytic.rectangle(0.465, 0.3, section=section, n_modes=15), {"at": (0.14, 0.09), "tolerance": 1e-6}
    hits = (
        fi.strike(plate, fi.Striker.rigid(0.02), fi.Contact.hertz(1e7), speed=1.0, **how)
        for plate in (exact, fi.find_modes(system, n_modes=15))
    )
    one, other = (hit.gradient("contact_time").slopes for hit in hits)
    assert_allclose(other, one, rtol=1e-3)  # contact time itself agrees to 1e-6; its slopes jump a little


def test_why_a_number_has_no_gradient():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.4, first_frequency=90.0, n_modes=12)
    points = [(0.1, 0.1), (0.3, 0.1)]
    tested = fi.Modes.from_arrays([110.0, 340.0], [[1.2, 0.4], [0.9, -1.1]], points=points, mass=0.5, complete=True)
    system = fi.assemble(fi.mesh.rectangle(0.465, 0.3, size=0.06), fi.Plate(WOOD, 3e-3), {"boundary": fi.Elastic(1e4)})
    section = fi.Beam.rectangular(WOOD, width=0.02, height=0.005)
    bar = fi.assemble(fi.mesh.line(0.5), section, point_supports=[(0.2, 3e4)])
    for body, at, name, words in (
        (fi.find_modes(bar, n_modes=10), (0.14,), "material.E", "springs and point masses"),
        (plate, (0.45, 0.3), "material.E", r"no gradient in material\.E: section and material of the target"),
        (tested, points[0], "strike.x", r"no gradient in strike\.x: the shapes of the target are known at single"),
        (fi.find_modes(system, n_modes=10), (0.14, 0.09), "section.thickness", "springs and point masses"),
        (system, (0.14, 0.09), "section.thickness", "springs and point masses"),  # by Ritz vectors
    ):
        hit = fi.strike(body, fi.Striker.rigid(0.1), fi.Contact.hertz(1e7), at=at, speed=1.0, tolerance=1e-2)
        with pytest.raises(fi.SimulationError, match=words):
            hit.gradient("impulse", name)


def patched(values):
    """A plate of 3 mm with two smooth patches that are thicker by values [m]."""

    def patch(x, at):
        return np.exp(-30.0 * ((x - at) ** 2).sum(axis=1))

    a, b = values
    return fi.Plate(WOOD, thickness=lambda x: 3e-3 + a * patch(x, (0.1, 0.1)) + b * patch(x, (0.3, 0.2)))


def hit_patched(values, tolerance=1e-8):
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3, size=0.15), patched(values), {"boundary": "hinged"})
    law, modes = fi.Contact.hertz(1e6), fi.find_modes(system, n_modes=12, damping_ratio=0.005)
    return fi.strike(modes, fi.Striker.rigid(0.03), law, at=(0.15, 0.1), speed=2.0, tolerance=tolerance, max_impacts=1)


@pytest.mark.slow
def test_patches_of_thickness_change_a_blow_by_differences():
    values, step = np.array([2e-4, 1e-4]), 1e-6
    hit = hit_patched(values)
    sections = {
        f"patch {i}": (values[i], lambda v, i=i: patched(np.where(np.arange(2) == i, v, values))) for i in (0, 1)
    }
    found = hit.gradient(("restitution", "impulse"), ("patch 0", "patch 1", "striker.mass"), sections=sections)
    low, high = (hit_patched(values + side * step * np.eye(2)[0]) for side in (-1.0, 1.0))
    for name, slopes in found.items():
        exact = (getattr(high, name) - getattr(low, name)) / (2.0 * step)
        # the last modes kept are next to those left out, of which ten static solutions tell
        assert_allclose(slopes["patch 0"], exact, rtol=1e-4, err_msg=name)
    assert found["impulse"].numbers[1] == values[1]


def test_what_makes_no_section_is_said():
    hit = claims.strike(NUMBERS, 1e-3)
    for sections, words in (
        ({"patch": 3.0}, "sections must be a dict of names to"),
        ({"patch": (3.0, 4.0)}, r"sections\['patch'\] must be a pair of a value and a function"),
        ({"patch": (0.0, lambda h: fi.Plate(WOOD, -1.0 - h))},
         r"sections\['patch'\]: no section can be made on either side of 0; change the value"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=words):
            hit.gradient("impulse", sections=sections)
    with pytest.raises(fi.SimulationError, match="needs modes of finite elements, of find_modes"):
        hit.gradient("impulse", "patch", sections={"patch": (3e-3, lambda h: fi.Plate(WOOD, h))})
