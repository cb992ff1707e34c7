"""What a number of a blow changes in the modes and contact of its run: differences of rebuilt blows."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.impact.compiled.law import columns
from fem_impact.impact.parameters import Parameters

NUMBERS = {
    "striker.mass": 0.1, "striker.first_frequency": 3e3, "striker.damping_ratio": 0.02, "target.mass": 0.4,
    "target.first_frequency": 90.0, "target.damping_ratio": 0.01, "contact.stiffness": 1e7, "contact.exponent": 1.5,
    "contact.gap": 1e-4, "strike.x": 0.45, "strike.y": 0.3, "strike.speed": 1.2,
}  # fmt: skip
FIELDS = "omega", "zeta", "shape", "bias", "start_q", "start_p", "offset", "law"


def strike(numbers, loss, push=0.0):
    plate = fi.analytic.rectangle(
        1.55, 1.0, mass=numbers["target.mass"], first_frequency=numbers["target.first_frequency"], n_modes=12,
        damping_ratio=numbers["target.damping_ratio"],
    )  # fmt: skip
    stick = fi.Striker.stick(numbers["striker.mass"], numbers["striker.first_frequency"], n_modes=3)
    stick = fi.Striker.flexible(stick.modes.damped(numbers["striker.damping_ratio"]), at=stick.at)
    law = fi.Contact.power(
        numbers["contact.stiffness"], numbers["contact.exponent"], loss=loss, gap=numbers["contact.gap"]
    )
    at = (numbers["strike.x"], numbers["strike.y"])
    speed = numbers["strike.speed"]
    return fi.strike(plate, stick, law, at=at, speed=speed, duration=1e-3, target_force=push, striker_force=0.5 * push)


@pytest.mark.parametrize("loss, push", [(0.0, 0.0), (0.1, 0.0), (0.0, 0.3)])
def test_changes_are_differences_of_the_system(loss, push):
    hit = strike(NUMBERS, loss, push)
    parameters = Parameters(hit)
    for name, value in NUMBERS.items():
        assert_allclose(parameters.values[name], value, rtol=1e-12, err_msg=name)
    assert loss == 0.0 or parameters.values["contact.loss"] == loss
    change = parameters.change(tuple(NUMBERS))
    for i, name in enumerate(NUMBERS):
        sides = [strike(NUMBERS | {name: NUMBERS[name] * (1.0 + s * 1e-4)}, loss, push).history for s in (-1.0, 1.0)]
        for field in FIELDS:
            low, high, now = (columns(getattr(history, field)) for history in (*sides, hit.history))
            if field in ("shape", "offset", "law"):
                low, high, now = low[0], high[0], now[0]
            exact = (high - low) / (2e-4 * NUMBERS[name])
            found = columns(getattr(change, field))[i]
            if field in ("shape", "offset", "law"):
                found = found[0]
            # differences of second order; the strike point is 1e-4 of some wavelengths away
            scale = np.abs(now).max() / NUMBERS[name]
            assert_allclose(found, exact, rtol=1e-5, atol=1e-7 * scale, err_msg=f"{field} in {name}")


def test_finite_elements_and_closed_forms_change_alike_with_the_strike_point():
    section = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), section, {"boundary": "hinged"})
    exact = fi.analytic.rectangle(0.465, 0.3, section=section, n_modes=15)
    slopes = []
    for plate in (exact, fi.find_modes(system, n_modes=15)):
        hit = fi.strike(
            plate, fi.Striker.rigid(0.02), fi.Contact.hertz(1e7), at=(0.14, 0.09), speed=1.0, tolerance=1e-6
        )
        slopes.append(hit.gradient("contact_time").slopes)
    assert_allclose(slopes[1], slopes[0], rtol=1e-3)  # contact time itself agrees to 1e-6; its slopes jump a little


def test_why_a_number_has_no_gradient():
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.4, first_frequency=90.0, n_modes=12)
    law, rigid = fi.Contact.hertz(1e7), fi.Striker.rigid(0.1)
    hit = fi.strike(plate, rigid, law, at=(0.45, 0.3), speed=1.0)
    with pytest.raises(fi.SimulationError, match=r"no gradient in contact\.loss: without loss the modes left out act"):
        hit.gradient("impulse", "contact.loss")
    with pytest.raises(fi.SimulationError, match=r"no gradient in material\.E: section and material of the target"):
        hit.gradient("impulse", "material.E")
    points = [(0.1, 0.1), (0.3, 0.1)]
    tested = fi.Modes.from_arrays([110.0, 340.0], [[1.2, 0.4], [0.9, -1.1]], points=points, mass=0.5, complete=True)
    hit = fi.strike(tested, rigid, law, at=points[0], speed=1.0)
    with pytest.raises(
        fi.SimulationError, match=r"no gradient in strike\.x: the shapes of the target are known at single"
    ):
        hit.gradient("impulse", "strike.x")
    section = fi.Plate(fi.Material(E=10e9, nu=0.3, rho=450.0), thickness=3e-3)
    held = {"boundary": fi.Elastic(1e4)}
    system = fi.assemble(fi.mesh.rectangle(0.465, 0.3), section, held)
    hit = fi.strike(fi.find_modes(system, n_modes=10), rigid, law, at=(0.14, 0.09), speed=1.0)
    with pytest.raises(fi.SimulationError, match="springs and point masses"):
        hit.gradient("impulse", "section.thickness")


WOOD = fi.Material(E=10e9, nu=0.3, rho=450.0)


def patched(values):
    """A plate of 3 mm with two smooth patches that are thicker by values [m]."""
    return fi.Plate(
        WOOD,
        thickness=lambda x: (
            3e-3
            + sum(v * np.exp(-30.0 * ((x - at) ** 2).sum(axis=1)) for v, at in zip(values, ((0.1, 0.1), (0.3, 0.2))))
        ),
    )


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
    hit = strike(NUMBERS, 0.1)
    with pytest.raises(ValueError, match="sections must be a dict of names to"):
        hit.gradient("impulse", sections={"patch": 3.0})
    with pytest.raises(ValueError, match=r"sections\['patch'\] must be a pair of a value and a function"):
        hit.gradient("impulse", sections={"patch": (3.0, 4.0)})
    with pytest.raises(
        ValueError, match=r"sections\['patch'\]: no section can be made on either side of 0; change the value"
    ):
        hit.gradient("impulse", sections={"patch": (0.0, lambda h: fi.Plate(WOOD, -1.0 - h))})
    with pytest.raises(fi.SimulationError, match="needs modes of finite elements, of find_modes"):
        hit.gradient("impulse", "patch", sections={"patch": (3e-3, lambda h: fi.Plate(WOOD, h))})
