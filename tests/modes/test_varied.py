"""What a changed section changes in modes: powers of uniform bodies, and differences of modes found again."""

from dataclasses import replace

import numpy as np
import pytest
from comparing import along
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.fe.variation import DIFFERENCES, SectionChange
from fem_impact.modes import varied

WOOD = fi.Material(E=16e9, nu=0.35, rho=900.0)
AT = np.array([0.15])


def uniform(height):
    return fi.Beam.rectangular(WOOD, width=0.055, height=height)


def undercut(middle):
    def height(x):
        return 0.022 - (0.022 - middle) * np.sin(np.pi * x[:, 0] / 0.35) ** 2

    return fi.Beam.rectangular(WOOD, width=0.055, height=height)


def modes_of(section, theory=None, ends=None, count=10):
    return fi.find_modes(fi.assemble(fi.mesh.line(0.35), section, ends, theory=theory), n_modes=count)


@pytest.mark.parametrize("ends", [None, {"left": "clamped"}])
def test_a_uniform_bar_changes_by_powers(ends):
    height = 0.02
    modes, change = modes_of(uniform(height), ends=ends), along(uniform, height, 1e-4)
    found, row = varied.changed_modes(modes, change, AT), modes.shapes.at(AT[None])[0]
    assert_allclose(found.omega, modes.omega / height, rtol=1e-8)
    assert_allclose(found.shape, -0.5 * row / height, rtol=1e-8, atol=1e-8 * np.abs(row).max() / height)
    assert_allclose(found.compliance, -3.0 * modes.shapes.compliance(AT[None])[0, 0] / height, rtol=1e-8)
    slopes = varied.frequency_slopes(modes, change, np.array([5, 6]))
    assert_allclose(slopes, modes.frequencies[5:7] / height, rtol=1e-8)


@pytest.mark.parametrize("theory", ["euler", pytest.param("timoshenko", marks=pytest.mark.slow)])
def test_an_undercut_changes_modes_by_differences(theory):
    value, step = 9e-3, 2e-5
    now = modes_of(undercut(value), theory)
    change = varied.changed_modes(now, along(undercut, value, 1e-5), AT)
    sides = [modes_of(undercut(value + k * step), theory) for k in DIFFERENCES[0][0]]

    def difference(of):
        return sum(weight / step * of(side) for weight, side in zip(DIFFERENCES[0][1], sides))

    assert_allclose(change.omega, difference(lambda each: each.omega), rtol=1e-6, atol=1e-6)  # fourth order
    squares = difference(lambda each: each.shapes.at(AT[None])[0] ** 2)
    found = 2.0 * now.shapes.at(AT[None])[0] * change.shape
    assert_allclose(found[:2].sum(), squares[:2].sum(), rtol=1e-7)  # rigid motions may turn into one another
    assert_allclose(found[2:], squares[2:], atol=1e-6 * np.abs(squares).max())
    exact = difference(lambda each: each.shapes.compliance(AT[None])[0, 0])
    assert_allclose(change.compliance, exact, rtol=1e-6)


def square_plate(slope):
    return fi.Plate(WOOD, thickness=lambda x: 3e-3 * (1.0 + slope * x[:, 0]))


def grooved(depth):
    """A groove across: stiffer for one mode of the pair (2, 1), (1, 2) than for the other."""
    return fi.Plate(WOOD, thickness=lambda x: 3e-3 * (1.0 + depth * np.sin(np.pi * x[:, 0] / 0.3) ** 2))


@pytest.mark.slow
def test_modes_that_share_a_frequency_answer_a_blow_smoothly_and_have_no_single_derivatives():
    """Of a pair, any turned basis is as good: what the point feels of it must not depend on which was found."""
    square = fi.mesh.rectangle(0.3, 0.3, size=0.06)
    modes = fi.find_modes(fi.assemble(square, square_plate(0.0), {"boundary": "hinged"}), n_modes=6)
    change, at, shapes, turn = along(square_plate, 0.0, 1e-3), np.array([0.07, 0.11]), modes.shapes, np.eye(6)
    turn[1:3, 1:3] = [[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]]
    other = type(shapes)(shapes.system, shapes.vectors @ turn, shapes.flexibility)
    felt = []
    for each in (modes, fi.Modes(modes.omega, modes.damping_ratio, other, modes.mass)):
        found, row = varied.changed_modes(each, change, at), each.shapes.at(at[None])[0]
        felt.append([(row[1:3] ** 2) @ found.omega[1:3], row[1:3] @ found.shape[1:3]])
    assert_allclose(*felt, rtol=1e-6)  # elements split the pair by 1e-7
    with pytest.raises(fi.SimulationError, match="2 modes share it, and a change splits it"):
        varied.frequency_slopes(modes, along(grooved, 0.0, 1e-3), np.array([1]))
    whole = varied.frequency_slopes(modes, along(lambda h: fi.Plate(WOOD, h), 3e-3, 1e-5), np.array([0, 1, 2]))
    assert_allclose(whole, modes.frequencies[:3] / 3e-3, rtol=1e-6)  # alike for both of a pair


@pytest.mark.parametrize("count", [7, 10])
def test_modes_change_alike_however_few_are_kept(count):
    """The eleventh frequency of this plate is 2 % above the tenth; the elements are those for all 14."""
    plate = fi.assemble(fi.mesh.rectangle(0.3, 0.28, size=0.05), grooved(0.1), {"boundary": "hinged"})
    modes, change, at = fi.find_modes(plate, n_modes=14), along(grooved, 0.1, 1e-4), np.array([0.07, 0.11])
    whole, few = (varied.changed_modes(each, change, at).shape for each in (modes, modes.truncated(n_modes=count)))
    assert_allclose(few, whole[:count], atol=1e-9 * np.abs(whole).max())


def test_a_spherical_panel_follows_its_radius_and_thickness():
    # sliding edges: omega**2 = D k**4 / (rho h) + E / (rho R**2), with k of the half waves
    E, nu, rho, sides, at_rest = 70e9, 0.3, 2700.0, (0.4, 0.3), {"radius": -2.0, "thickness": 1e-3}

    def plate(radius, thickness):
        def rise(points):
            return 0.5 * ((points - np.array(sides) / 2.0) ** 2).sum(axis=1) / radius

        return fi.Plate(fi.Material(E=E, nu=nu, rho=rho), thickness, rise=rise, in_plane={"boundary": "sliding"})

    system = fi.assemble(fi.mesh.rectangle(*sides), plate(**at_rest), {"boundary": "hinged"})
    modes = fi.find_modes(system, n_modes=4, tolerance=1e-6)
    k = np.pi**2 * np.sort([(i / sides[0]) ** 2 + (j / sides[1]) ** 2 for i in range(1, 9) for j in range(1, 9)])[:4]
    h, R = at_rest["thickness"], at_rest["radius"]
    exact = {"radius": -2.0 * E / (rho * R**3), "thickness": E * h / (6.0 * rho * (1.0 - nu**2)) * k**2}
    for name, slope in exact.items():
        change = SectionChange.by_differences(name, at_rest[name], lambda x, name=name: plate(**(at_rest | {name: x})))
        found = varied.frequency_slopes(modes, change, np.arange(4))
        # the tolerance of the modes, and differences of 1e-6
        assert_allclose(found, slope / (4.0 * np.pi * modes.omega), rtol=1e-5)


@pytest.mark.slow
def test_a_blow_on_a_shell_has_slopes_in_its_rise_and_none_by_scaling():
    plate = fi.Plate(fi.Material(E=70e9, nu=0.3, rho=2700.0), 2e-3)

    def curved(radius):
        return replace(plate, rise=fi.rise.cap(radius, centre=(0.2, 0.15)))

    def struck(radius, tolerance):
        system = fi.assemble(fi.mesh.rectangle(0.4, 0.3, size=0.05), curved(radius), {"boundary": "hinged"})
        modes = fi.find_modes(system, n_modes=30, damping_ratio=0.01)
        blow = {"at": (0.13, 0.1), "speed": 1.0, "tolerance": tolerance, "max_impacts": 1}
        return fi.strike(modes, fi.Striker.rigid(0.02), fi.Contact.hertz(1e6), **blow)

    hit, step = struck(2.0, 1e-6), 1e-3
    found = hit.gradient("contact_time", "radius", sections={"radius": (2.0, curved)})
    each = [struck(2.0 + sign * step, 1e-8).contact_time for sign in (1.0, -1.0)]
    assert found["radius"] == pytest.approx((each[0] - each[1]) / (2.0 * step), rel=1e-3)  # differences err by 1e-4
    with pytest.raises(fi.SimulationError, match="plate does not scale by powers of its numbers; give"):
        hit.gradient("contact_time", "section.thickness")


@pytest.fixture(scope="module")
def barred():
    """A domed plate with a straight and a tapered bar, from numbers that change."""
    spruce, mesh = fi.Material(E=11e9, nu=0.3, rho=430.0), fi.mesh.rectangle(0.4, 0.3, size=0.06)

    def bar(height, width):
        return fi.Beam.rectangular(spruce, width=width, height=height)

    def plate(height=12e-3, width=8e-3, radius=3.0, thickness=3e-3):
        ribs = (
            fi.Rib([(0.1, 0.0), (0.1, 0.3)], bar(height, width)),
            fi.Rib([(0.0, 0.12), (0.4, 0.17)], bar(lambda s: height * (1.0 - s[:, 0]), 8e-3)),
        )
        return fi.Plate(spruce, thickness, ribs=ribs, rise=fi.rise.cap(radius, centre=(0.2, 0.15)))

    def modes(**sizes):
        return fi.find_modes(fi.assemble(mesh, plate(**sizes), {"boundary": "hinged"}), n_modes=20)

    return plate, modes, modes()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "value"), {"height": 12e-3, "width": 8e-3, "radius": 3.0}.items())
@pytest.mark.thin(3)
def test_ribs_have_slopes_in_their_sizes(barred, name, value):
    """The plane of ribs moves with 2e-2 of the kinetic energy at most, which changes as well."""
    plate, modes, at_rest = barred
    at, step, which = np.array([0.13, 0.1]), 2e-4 * value, np.arange(20)
    change = SectionChange.by_differences(name, value, lambda number: plate(**{name: number}))
    sides = [modes(**{name: value + sign * step}) for sign in (1.0, -1.0)]
    found = varied.changed_modes(at_rest, change, at)

    def difference(of):
        return (of(sides[0]) - of(sides[1])) / (2.0 * step)

    def shape(modes):
        row = modes.shapes.at(at[None])[0]
        return row * np.sign(row * at_rest.shapes.at(at[None])[0])

    frequencies = difference(lambda modes: modes.frequencies)
    rtol = np.where(which < 7, 2e-5, 5e-4)  # 1e-5 and 2e-4 were measured: the last modes lack some of those above
    slopes = varied.frequency_slopes(at_rest, change, which)
    assert (np.abs(slopes - frequencies) < rtol * np.maximum.accumulate(np.abs(frequencies))).all()
    assert_allclose(found.omega / (2.0 * np.pi), slopes, rtol=1e-8)
    shapes = difference(shape)
    assert_allclose(found.shape, shapes, atol=6e-3 * np.abs(shapes).max())
    assert_allclose(found.compliance, difference(lambda modes: modes.shapes.compliance(at[None])[0, 0]), rtol=1e-5)


def test_a_change_keeps_the_ribs_of_a_body(barred):
    plate, _, modes = barred
    change = SectionChange.by_differences("height", 0.01, lambda height: replace(plate(height), ribs=()))
    with pytest.raises(ValueError, match="must keep the 2 ribs of the body, got 0"):
        varied.frequency_slopes(modes, change, np.arange(2))
