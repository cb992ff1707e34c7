from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from comparing import examined

import fem_impact as fi
from fem_impact.model import bending, still_air
from fem_impact.modes import air

SPRUCE = fi.Material(E=10e9, nu=0.3, rho=450.0)
STEEL = fi.Material(E=210e9, nu=0.3, rho=7850.0)
RHO, C = air.DENSITY, air.SPEED


found = partial(examined, name="still air")


def loading(modes):
    known = bending.known_of(modes)
    return still_air.loading(known, bending.integrate_shapes(known))


def rayleigh(modes, mode, n=48):
    """Added mass over mass, and damping ratio by sound, of a baffled rectangle's mode on both sides.

    Rayleigh's integral of the shape with itself, on a grid of equal squares; that of a square on itself by its disk.
    """
    sides = np.ptp(modes.shapes.grid()[0], axis=0)
    count = np.maximum(2, np.round(n * sides / sides.max())).astype(int)
    axes = [side * (np.arange(k) + 0.5) / k for side, k in zip(sides, count)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    area = float(np.prod(sides / count))
    shape = modes.shape_at(points)[:, mode]
    omega = modes.omega[mode]
    k = omega / C
    far = np.hypot(*(points[:, None] - points[None]).T)
    np.fill_diagonal(far, 1.0)
    green = np.exp(-1j * k * far) / far
    a = np.sqrt(area / np.pi)
    np.fill_diagonal(green, 2.0 * np.pi * a / area * (1.0 - 0.5j * k * a))  # of a disk on its centre
    pressure = 1j * omega * RHO / (2.0 * np.pi) * (green @ shape) * area  # for unit modal velocity
    impedance = 2.0 * (shape @ pressure) * area
    return impedance.imag / omega, impedance.real / (2.0 * omega)


def plate(h, n_modes, sides=(0.4, 0.3), material=SPRUCE, damping_ratio=0.0):
    return fi.analytic.rectangle(*sides, section=fi.Plate(material, h), n_modes=n_modes, damping_ratio=damping_ratio)


def blow(modes, mass=0.02, law=None, **more):
    how = {"at": (0.12, 0.1), "speed": 0.3, "tolerance": 1e-1} | more
    return fi.strike(modes, fi.Striker.rigid(mass), law or fi.Contact.hertz(1e6), **how)


@pytest.mark.parametrize(("mode", "h"), [(0, 1e-3), (8, 1e-3), (3, 3e-3)])
@pytest.mark.slow
def test_air_on_a_baffled_plate_is_that_of_rayleighs_integral(mode, h):
    modes = plate(h, 12)
    mass, damping = (each[mode] for each in loading(modes))
    true_mass, true_damping = rayleigh(modes, mode)
    assert 0.5 < mass / true_mass < 2.0
    assert 1.0 / 3.0 < damping / true_damping < 6.0  # an average over modes: those with nodal lines radiate less


def test_above_coincidence_a_plate_radiates_as_an_endless_one():
    modes, D = plate(0.01, 300), 10e9 * 0.01**3 / (12.0 * 0.91)
    coincidence = C**2 / (2.0 * np.pi) * np.sqrt(4.5 / D)  # Hz; Cremer, Heckl and Petersson
    fast = np.flatnonzero(modes.frequencies > 2.0 * coincidence)
    mass, damping = (each[fast[-1]] for each in loading(modes))
    assert len(fast) > 20 and mass == 0.0
    assert 1.0 < damping * modes.omega[fast[-1]] * 4.5 / (RHO * C) < 1.3  # 1 / sqrt(1 - k**2 / k_0**2)


def test_a_thin_spruce_plate_feels_a_quarter_of_its_mass_in_air():
    # 2 rho_0 / (rho h k): for 1 mm at k = 20 / m some 13 % on each side, 27 % on both
    modes = plate(1e-3, 6, (0.4, 0.4))
    wave, carried = bending.integrate_shapes(bending.known_of(modes)).wave, loading(modes)[0]
    at = int(np.argmin(np.abs(wave - 20.0)))
    assert carried[at] * wave[at] == pytest.approx(1.25 * 2.0 * RHO / 0.45, rel=0.05)  # 1 + 1/2 4 a / (k a**2)
    assert carried == pytest.approx((modes.omega / fi.in_air(modes).omega) ** 2 - 1.0, rel=0.12)


def test_a_panel_held_at_one_side_moves_no_more_air_than_a_stiff_disk():
    """Its first wave is three times as long as the panel: it was said to move 3.6 times the air."""
    aluminium = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), 2e-3)
    modes = fi.find_modes(fi.assemble(fi.mesh.rectangle(0.4, 0.3), aluminium, {"left": "clamped"}), n_modes=2)
    true = (modes.omega / fi.in_air(modes).omega) ** 2 - 1.0
    assert (true < loading(modes)[0]).all() and loading(modes)[0][0] < 1.5 * true[0]


def test_effect_is_that_of_a_plate_with_the_air_of_rayleighs_integral():
    thin, at = plate(1.5e-3, 8, damping_ratio=0.01), [(0.12, 0.1)]
    slower = 1.0 / np.sqrt(1.0 + np.array([rayleigh(thin, mode, 32)[0] for mode in range(8)]))
    shapes = thin.shape_at(at) * slower
    wet = fi.Modes.from_arrays(thin.frequencies * slower, shapes, points=at, mass=thin.mass, complete=True)
    how = {"law": fi.Contact.linear(2e4), "tolerance": 1e-6, "residual": False, "max_impacts": 1}
    dry, true = (blow(modes, **how) for modes in (thin, wet.damped(thin.damping_ratio)))
    change = abs(true.contact_time / dry.contact_time - 1.0)
    assert change > 2e-3 and change / 3.0 < found(dry).effect["contact_time"] < 3.0 * change


def test_modes_in_air_have_their_air_and_lose_nothing_else_that_is_known():
    dry = plate(1e-3, 24)
    before, after = map(blow, (dry, fi.in_air(dry)))
    told = found(after)
    assert told.value is None and told.known and told.worst == 0.0 and not told.remedy
    true = abs(after.contact_time / before.contact_time - 1.0)
    assert true / 3.0 < found(before).effect["contact_time"] < 3.0 * true
    for name in ("thin target", "small deflections"):
        one, two = (examined(hit, name) for hit in (before, after))
        assert two.known and two.value == pytest.approx(one.value, rel=0.3)  # lower, slower modes


def test_the_air_stays_in_modes_that_are_cut_damped_or_scaled():
    wet = fi.in_air(plate(2e-3, 6))
    kept = (
        wet.truncated(n_modes=3),
        wet.damped(0.01),
        wet.scaled(first_frequency=50.0),
        wet.truncated(max_frequency=1e3),
    )
    assert all(modes.air for modes in kept) and wet.section is not None and not plate(2e-3, 3).air


def test_slopes_in_air_are_those_of_the_mixed_shapes():
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3), fi.Plate(SPRUCE, 1e-3), {"boundary": "hinged"})
    dry = fi.find_modes(system, n_modes=16)
    wet = fi.in_air(dry)
    mixed = replace(dry, shapes=replace(dry.shapes, vectors=dry.shapes.vectors @ wet.shapes.mix))
    alone, found, true = (bending.integrate_shapes(bending.known_of(modes)) for modes in (dry, wet, mixed))
    for name in ("slope", "rotary", "shear"):  # 1 mm of spruce: modes mix by some percent in amplitude
        np.testing.assert_allclose(getattr(found, name), getattr(true, name), rtol=1e-2)
    assert found.slope[0] < 0.7 * alone.slope[0] and (wet.shapes.mix**2).sum() < 16.0


def test_steel_in_air_keeps_silent():
    told = found(blow(plate(0.01, 60, material=STEEL, damping_ratio=0.005), 0.05, fi.Contact.hertz(1e8), speed=1.0))
    assert told.value < 5e-3 and told.worst < 1e-3 and told.known


def test_where_sound_damps_more_than_air_weighs_its_damping_is_named():
    """A plate so light that all its waves are faster than sound."""
    light = plate(3e-3, 20, material=replace(SPRUCE, rho=0.45), damping_ratio=0.005)
    told = found(blow(light, 1e-5, fi.Contact.linear(1e3), speed=1.0, tolerance=1e-3))
    assert told.number.startswith("damping ratio by the sound radiated") and told.doubtful and told.worst > 0.01


def test_a_bar_moves_the_air_around_its_width_and_a_beam_of_unknown_width_is_not_known():
    beam = fi.analytic.beam(0.4, ends=("free", "free"), mass=0.1, first_frequency=500.0, n_modes=8)
    told = found(blow(beam, at=0.2))
    assert told.state == "not known" and "width" in told.sentence

    bar = fi.Beam.rectangular(SPRUCE, width=0.05, height=0.01)
    modes = fi.analytic.beam(0.4, ends=("free", "free"), section=bar, n_modes=5)
    mass, _ = loading(modes)
    around = np.pi * RHO * 0.05**2 / 4.0 / (450.0 * 0.05 * 0.01)  # Lamb, Hydrodynamics, art. 71: a moving strip
    assert mass[2] == pytest.approx(around, rel=1e-9) and (mass[:2] == 0.0).all()


def test_frequencies_drop_by_a_hundredth_at_the_limit():
    assert pytest.approx(0.01, rel=0.05) == 1.0 - (1.0 + still_air.CARRIED.limit) ** -0.5
