from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from comparing import examined

import fem_impact as fi
from fem_impact.model import audit, bending, still_air
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


@pytest.mark.parametrize("mode", [0, 1, 3, 8])
@pytest.mark.parametrize("h", [1e-3, 3e-3])
@pytest.mark.slow
def test_air_on_a_baffled_plate_is_that_of_rayleighs_integral(mode, h):
    modes = fi.analytic.rectangle(0.4, 0.3, section=fi.Plate(SPRUCE, h), n_modes=12)
    mass, damping = (each[mode] for each in loading(modes))
    true = rayleigh(modes, mode)
    assert 0.5 < mass / true[0] < 2.0
    assert 1.0 / 3.0 < damping / true[1] < 6.0  # an average over modes: those with nodal lines radiate less


def test_above_coincidence_a_plate_radiates_as_an_endless_one():
    modes = fi.analytic.rectangle(0.4, 0.3, section=fi.Plate(SPRUCE, 0.01), n_modes=300)
    D = 10e9 * 0.01**3 / (12.0 * 0.91)
    coincidence = C**2 / (2.0 * np.pi) * np.sqrt(4.5 / D)  # Hz; Cremer, Heckl and Petersson
    fast = modes.frequencies > 2.0 * coincidence
    assert fast.sum() > 20
    mass, damping = loading(modes)
    high = int(np.flatnonzero(fast)[-1])
    assert mass[high] == 0.0
    sigma = damping[high] * modes.omega[high] * 4.5 / (RHO * C)
    assert 1.0 < sigma < 1.3  # 1 / sqrt(1 - k**2 / k_0**2)


def test_a_thin_spruce_plate_feels_a_quarter_of_its_mass_in_air():
    # 2 rho_0 / (rho h k): for 1 mm at k = 20 / m some 13 % on each side, 27 % on both
    modes = fi.analytic.rectangle(0.4, 0.4, section=fi.Plate(SPRUCE, 1e-3), n_modes=6)
    at = int(np.argmin(np.abs(bending.integrate_shapes(bending.known_of(modes)).wave - 20.0)))
    wave = bending.integrate_shapes(bending.known_of(modes)).wave[at]
    carried = loading(modes)[0]
    assert carried[at] * wave == pytest.approx(1.25 * 2.0 * RHO / 0.45, rel=0.05)  # 1 + 1/2 4 a / (k a**2)
    assert carried == pytest.approx((modes.omega / fi.in_air(modes).omega) ** 2 - 1.0, rel=0.12)


def test_effect_is_that_of_a_plate_with_the_air_of_rayleighs_integral():
    thin = fi.analytic.rectangle(0.4, 0.3, section=fi.Plate(SPRUCE, 1.5e-3), n_modes=8, damping_ratio=0.01)
    at = [(0.12, 0.1)]
    mass = np.array([rayleigh(thin, mode, 32)[0] for mode in range(8)])
    row = thin.shape_at(at)
    hits = []
    for factor in (np.ones(8), 1.0 / np.sqrt(1.0 + mass)):
        modes = fi.Modes.from_arrays(thin.frequencies * factor, row * factor, points=at, mass=thin.mass, complete=True)
        modes = modes.damped(thin.damping_ratio)
        body = thin if factor[0] == 1.0 else modes
        law = fi.Contact.linear(2e4)
        blow = {"at": at[0], "speed": 0.3, "tolerance": 1e-6, "residual": False, "max_impacts": 1}
        hits.append(fi.strike(body, fi.Striker.rigid(0.02), law, **blow))
    told = found(hits[0])
    true = abs(hits[1].contact_time / hits[0].contact_time - 1.0)
    assert true > 2e-3
    assert true / 3.0 < told.effect["contact_time"] < 3.0 * true


def test_steel_in_air_keeps_silent():
    modes = fi.analytic.rectangle(0.4, 0.3, section=fi.Plate(STEEL, 0.01), n_modes=60, damping_ratio=0.005)
    hit = fi.strike(modes, fi.Striker.rigid(0.05), fi.Contact.hertz(1e8), at=(0.12, 0.1), speed=1.0)
    assert found(hit).value < 5e-3 and found(hit).worst < 1e-3 and found(hit).known


def test_a_bar_moves_the_air_around_its_width():
    bar = fi.Beam.rectangular(SPRUCE, width=0.05, height=0.01)
    modes = fi.analytic.beam(0.4, ends=("free", "free"), section=bar, n_modes=5)
    mass, _ = loading(modes)
    around = np.pi * RHO * 0.05**2 / 4.0 / (450.0 * 0.05 * 0.01)  # Lamb, Hydrodynamics, art. 71: a moving strip
    assert mass[2] == pytest.approx(around, rel=1e-9) and (mass[:2] == 0.0).all()


def test_a_beam_of_unknown_width_is_not_known():
    modes = fi.analytic.beam(0.4, ends=("free", "free"), mass=0.1, first_frequency=500.0, n_modes=8)
    hit = fi.strike(modes, fi.Striker.rigid(0.05), fi.Contact.hertz(1e8), at=0.2, speed=1.0)
    assert found(hit).state == "not known" and "width" in found(hit).sentence


def test_modes_in_air_have_their_air_and_lose_nothing_else_that_is_known():
    dry = fi.analytic.rectangle(0.4, 0.3, section=fi.Plate(SPRUCE, 1e-3), n_modes=24)
    wet = fi.in_air(dry)
    how = {"at": (0.12, 0.1), "speed": 0.3, "tolerance": 1e-1}
    before, after = (fi.strike(modes, fi.Striker.rigid(0.02), fi.Contact.hertz(1e6), **how) for modes in (dry, wet))
    told = found(after)
    assert told.value is None and told.known and told.worst == 0.0 and not told.remedy
    true = abs(after.contact_time / before.contact_time - 1.0)
    assert true / 3.0 < found(before).effect["contact_time"] < 3.0 * true
    one, two = ({each.name: each for each in audit.examine(hit)} for hit in (before, after))
    for name in ("thin target", "small deflections"):
        assert two[name].known and two[name].value == pytest.approx(one[name].value, rel=0.3)  # lower, slower modes


def test_the_air_stays_in_modes_that_are_cut_damped_or_scaled():
    wet = fi.in_air(fi.analytic.rectangle(0.4, 0.3, section=fi.Plate(SPRUCE, 2e-3), n_modes=6))
    kept = (
        wet.truncated(n_modes=3),
        wet.damped(0.01),
        wet.scaled(first_frequency=50.0),
        wet.truncated(max_frequency=1e3),
    )
    assert all(modes.air for modes in kept) and wet.section is not None
    assert not fi.analytic.rectangle(0.4, 0.3, section=fi.Plate(SPRUCE, 2e-3), n_modes=3).air


def test_slopes_in_air_are_those_of_the_mixed_shapes():
    system = fi.assemble(fi.mesh.rectangle(0.4, 0.3), fi.Plate(SPRUCE, 1e-3), {"boundary": "hinged"})
    dry = fi.find_modes(system, n_modes=16)
    wet = fi.in_air(dry)
    mixed = replace(dry, shapes=replace(dry.shapes, vectors=dry.shapes.vectors @ wet.shapes.mix))
    found, true = (bending.integrate_shapes(bending.known_of(modes)) for modes in (wet, mixed))
    for name in ("slope", "rotary", "shear"):  # 1 mm of spruce: modes mix by some percent in amplitude
        np.testing.assert_allclose(getattr(found, name), getattr(true, name), rtol=1e-2)
    assert (found.slope[0] < 0.7 * bending.integrate_shapes(bending.known_of(dry)).slope[0]) and (
        wet.shapes.mix**2
    ).sum() < 16.0


def test_frequencies_drop_by_a_hundredth_at_the_limit():
    assert pytest.approx(0.01, rel=0.05) == 1.0 - (1.0 + still_air.CARRIED.limit) ** -0.5


def test_where_sound_damps_more_than_air_weighs_its_damping_is_named():
    """A plate so light that all its waves are faster than sound."""
    section = fi.Plate(replace(SPRUCE, rho=0.45), 3e-3)
    plate = fi.analytic.rectangle(0.4, 0.3, section=section, n_modes=20, damping_ratio=0.005)
    told = found(fi.strike(plate, fi.Striker.rigid(1e-5), fi.Contact.linear(1e3), at=(0.13, 0.1), speed=1.0))
    assert told.number.startswith("damping ratio by the sound radiated") and told.doubtful and told.worst > 0.01
