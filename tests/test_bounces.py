"""Many blows in kernel form against closed forms, against single blows, and against themselves."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact import _batch, _kernels, bounces

AT = np.array([0.465, 0.3])


def plate(mass=0.2, **wanted):
    return fi.analytic.rectangle(1.55, 1.0, mass=mass, first_frequency=100.0, n_modes=120, **wanted)


def many(modes, striker, stiffness, *, at=AT, exponent=1.0, speed=1.0, mass=None, target_mass=None, residual=True):
    """Blows of one family, one for each stiffness."""
    stiffness = np.atleast_1d(np.asarray(stiffness, float))
    column = np.ones(len(stiffness))
    return bounces.Blows(
        {0: bounces.Family.of(modes, at, striker, residual)},
        np.zeros(len(stiffness), int),
        column * (modes.mass if target_mass is None else target_mass),
        column * (striker.mass if mass is None else mass),
        stiffness,
        column * exponent,
        column * speed,
    )


@pytest.mark.parametrize("damping_ratio", [0.0, 0.02, 1.3])
def test_kernel_is_the_modal_propagation(damping_ratio):
    """Rows against the same force pushed through the modes one step at a time."""
    modes = plate(damping_ratio=damping_ratio)
    squared, h = modes.shape_at(AT)[0] ** 2, 1e-4
    table = np.empty((_kernels.N_TABLE, modes.n_modes))
    _kernels.step_table(np.array(modes.omega), np.array(modes.damping_ratio), h, table)
    rows = np.empty((_batch.N_KERNELS, 12))
    _batch.kernel_rows(table, squared, rows)
    q, p = table[4].copy(), table[5].copy()
    for m in range(12):
        assert_allclose(rows[0, m], squared @ q, rtol=1e-12)  # the same sums in another order
        if m < 11:
            assert_allclose(rows[2, m + 1], squared @ (table[8] * q + table[9] * p), rtol=1e-11)
        q, p = table[0] * q + table[1] * p, table[2] * q + table[3] * p


@pytest.mark.parametrize("exponent", [1.0, 1.2, 1.5, 2.5])
def test_two_masses_share_speed_whatever_the_law(exponent):
    target, striker = fi.Modes.rigid(0.3), fi.Striker.rigid(0.1)
    blows = many(target, striker, np.logspace(3, 7, 9), at=np.zeros(0), exponent=exponent, speed=2.0)
    found = bounces.bounce(blows, tolerance=1e-3)
    assert found.done.all()
    assert (found.n_impacts == 1).all()
    assert_allclose(found.restitution, (0.3 - 0.1) / (0.3 + 0.1), atol=1e-9)  # energy exact at every step
    reduced = 0.1 * 0.3 / 0.4
    expected = [fi.accuracy.contact_duration(fi.Contact.power(k, exponent), reduced, 2.0) for k in blows.stiffness]
    assert_allclose(found.contact_time, expected, rtol=1e-3)  # the tolerance
    deepest = (0.5 * (exponent + 1.0) * reduced * 4.0 / blows.stiffness) ** (1.0 / (exponent + 1.0))
    assert_allclose(found.peak_force, blows.stiffness * deepest**exponent, rtol=1e-3)


CASES = {
    "stick on plate": (plate, lambda: fi.Striker.stick(0.1, 10e3), AT),
    "flexible stick": (plate, lambda: fi.Striker.stick(0.1, 400.0), AT),
    "damped plate": (lambda: plate(damping_ratio=0.01), lambda: fi.Striker.rigid(0.02), AT),
    "free bar": (
        lambda: fi.analytic.beam(1.0, ends=("free", "free"), mass=0.2, first_frequency=100.0, n_modes=40),
        lambda: fi.Striker.rigid(0.03),
        np.array([0.1]),
    ),
}


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("case", CASES)
def test_every_bounce_is_the_single_blow_within_the_tolerance(case, exponent):
    make, strike, at = CASES[case]
    modes, striker = make(), strike()
    stiffness = np.logspace(4, 6, 7) * 10.0 ** (2.0 * (exponent - 1.0))
    blows = many(modes, striker, stiffness, at=at, exponent=exponent, speed=3.0)
    found = bounces.bounce(blows, tolerance=1e-3)
    assert found.done.mean() > 0.7  # the others belong to the modal engine
    for i in np.flatnonzero(found.done):
        hit = fi.strike(modes, striker, fi.Contact.power(stiffness[i], exponent), at=at, speed=3.0, tolerance=1e-5)
        assert hit.n_impacts == found.n_impacts[i]
        assert_allclose(found.restitution[i], hit.restitution, atol=1e-3)
        for name in ("contact_time", "impulse", "peak_force"):
            assert_allclose(getattr(found, name)[i], getattr(hit, name), rtol=1e-3)


def test_estimate_covers_the_error():
    """Effectivity over many random blows: the estimate is no less than a third of the error, and not wildly more."""
    rng = np.random.default_rng(7)
    stiffness = 10.0 ** rng.uniform(4, 6, 400)
    blows = many(plate(2.0), fi.Striker.stick(0.1, 10e3), stiffness)
    rough, fine = bounces.bounce(blows, tolerance=1e-2), bounces.bounce(blows, tolerance=1e-6)
    both = rough.done & fine.done
    assert both.mean() > 0.95
    error = np.abs(rough.contact_time / fine.contact_time - 1.0)[both]
    for name in ("impulse", "peak_force"):
        error = np.maximum(error, np.abs(getattr(rough, name) / getattr(fine, name) - 1.0)[both])
    effectivity = rough.error[both] / error
    assert (effectivity > 0.3).mean() > 0.97  # flukes aside
    assert np.median(effectivity) < 10.0


@pytest.mark.parametrize("n_modes", [30, 300])
def test_steps_do_not_grow_with_the_modes(n_modes):
    modes = fi.analytic.rectangle(1.55, 1.0, mass=2.0, first_frequency=100.0, n_modes=n_modes)
    engine = bounces._Engine(many(modes, fi.Striker.stick(0.1, 10e3), [1e5]), 0.0, 1, {})
    assert engine.first_step(bounces.STEPS)[0] == 26  # h = 2**-13 s whatever the modes: 15 for 1.8 ms


def test_only_stiffness_times_speed_to_the_power_matters():
    speed = np.array([0.1, 1.0, 10.0])
    blows = many(plate(), fi.Striker.stick(0.1, 10e3), 1e6 / np.sqrt(speed), exponent=1.5, speed=1.0)
    found = bounces.bounce(bounces.Blows(**{**vars(blows), "speed": speed}), tolerance=1e-3)
    assert_allclose(found.contact_time, found.contact_time[0], rtol=1e-9)  # rounding of k v**0.5
    assert_allclose(found.impulse / speed, found.impulse[0] / speed[0], rtol=1e-9)


def test_threads_change_nothing():
    blows = many(plate(), fi.Striker.stick(0.1, 10e3), np.logspace(4, 6, 300))
    one, two = (bounces.bounce(blows, tolerance=1e-3, workers=n) for n in (1, 2))
    for name in ("n_impacts", "contact_time", "impulse"):
        assert np.array_equal(getattr(one, name), getattr(two, name), equal_nan=True)
