"""Bodies that follow a frequency response: passive, as good as the response, with errors that hold."""

import numpy as np
import pytest
import xarray as xr

import fem_impact as fi
from fem_impact.impact import distance

AT = [0.0]
FREQUENCY = np.arange(0.0, 1500.0, 5.0)  # Hz
KNOWN = np.array([0.0, 210.0, 530.0, 545.0, 900.0, 1380.0, 2200.0, 3100.0])  # Hz


def known(first=0):
    """A body of a rigid motion, or none, and modes, two of them close together, three above the band."""
    rows = np.array([1.1, 1.4, -0.9, 1.2, 1.0, 1.3, -0.8, 1.1])  # kg**-0.5
    shapes = np.stack([rows, 0.7 * rows[::-1]])[:, first:]
    return fi.Modes.from_arrays(
        KNOWN[first:], shapes, points=[[0.0], [1.0]], mass=1.0, damping_ratio=np.where(KNOWN[first:] > 0.0, 0.01, 0.0),
        complete=True,
    )  # fmt: skip


def measured(modes, noise=1e-3, sigma=20.0, scale=1.0):
    """Its accelerance at both points with noise and an exponential window, as `fi.frf` tells them."""
    s = 2j * np.pi * FREQUENCY[:, None] + sigma
    unit = s**2 / (s**2 + 2.0 * modes.damping_ratio * modes.omega * s + modes.omega**2)
    exact = unit @ (modes.shape_at([[0.0]]) * modes.shape_at([[0.0], [1.0]])).T * scale
    size = noise * np.sqrt(np.square(np.abs(exact)).mean())
    H = exact + size * (np.random.default_rng(0).standard_normal((*exact.shape, 2)) @ [1.0, 1j]) / np.sqrt(2.0)
    dims = ("frequency", "channel")
    table = {"H": (dims, H), "error": (dims, np.full(H.shape, size * np.sqrt(-np.log(0.1))))}
    coords = {"frequency": FREQUENCY, "channel": ["a", "b"], "units": ("channel", ["m/s^2/N"] * 2)}
    return xr.Dataset(table, coords, {"added_damping": sigma})


def followed_body(frf, **how):
    return fi.Modes.from_frf(frf, mass=1.0, points=[[0.0], [1.0]], driving=0, pick=False, **how)


@pytest.fixture(scope="module")
def body():
    return followed_body(measured(known()))


def test_what_is_left_out_and_the_rigid_motion_are_measured(body):
    rest = sum(known().shape_at([AT])[0, 6:] ** 2 / known().omega[6:] ** 2)
    assert body.n_rigid == 1
    assert body.shape_at([AT])[0, 0] == pytest.approx(1.1, rel=2e-3)  # the noise is 1e-3 of 300 lines
    middle, error = body.shapes.rest[0]
    assert abs(middle - rest) <= error < 0.1 * rest


def test_a_blow_errs_less_than_it_states(body):
    for mass, duration in ((0.02, 1e-3), (0.3, 4e-3), (0.1, 2e-2)):
        striker, law = fi.Striker.rigid(mass), fi.Contact.linear(mass * (np.pi / duration) ** 2)
        hits = [fi.strike(modes, striker, law, at=AT, speed=1.0, tolerance=0.1) for modes in (body, known())]
        for quantity in ("force", "contact_time", "impulse"):
            one, two = (distance.value_of(hit, quantity, None) for hit in hits)
            allowed = hits[0].error.of_quantity(quantity) + hits[1].error.of_quantity(quantity)
            assert abs(one / two - 1.0) <= allowed < 0.1
        assert 0.0 < hits[0].error.measurement < 0.05


@pytest.mark.slow
def test_hammers_tests_and_maps_take_it_and_count_what_was_measured(body):
    (light,), (one,) = (fi.hammers.choose(modes, AT, 500.0, masses=[2e-3]) for modes in (body, known()))
    assert light.works and one.works
    assert light.softest == pytest.approx(one.softest, rel=0.02)  # ends are found to 1e-3, the body is known to 1e-3
    hammer = {"steel": (0.02, {"hard": 2e6})}
    one, two = (fi.plan_test(modes, hammer, [AT], 1000.0).n_impacts.tolist() for modes in (body, known()))
    assert one == two
    blow = {"at": AT, "speed": 1.0, "tolerance": 0.1}
    law = fi.Contact.linear(0.02 * (np.pi / 1e-3) ** 2)
    table = fi.sweep(body, fi.Striker.rigid(0.02), law, over={"mass": [0.01, 0.02]}, workers=1, **blow)
    hit = fi.strike(body, fi.Striker.rigid(0.02), law, **blow)
    assert float(table.truncation[1]) >= hit.error.measurement > 1e-4


def test_another_point_moves_as_measured_there(body):
    """Its share of each mode errs with the noise of lines near the peak, a hundredth of it."""
    striker, law = fi.Striker.rigid(0.02), fi.Contact.linear(0.02 * (np.pi / 1e-3) ** 2)
    time = np.linspace(2e-3, 2e-2, 50)
    hits = (fi.strike(modes, striker, law, at=AT, speed=1.0, tolerance=0.1) for modes in (body, known()))
    found, wanted = (hit.velocity([[1.0]], time) for hit in hits)
    assert np.abs(found - wanted).max() < 0.03 * np.abs(wanted).max()


def test_a_held_body_may_move_rigidly_only_as_far_as_noise_hides():
    body = followed_body(measured(known(first=1)))
    assert body.n_rigid == 0 or body.shape_at([AT])[0, 0] < 0.1
    assert body.shapes.loose(np.array([AT])).size <= 1


def test_sums_are_passive_whatever_the_response():
    """A response that turns the wrong way by half a radian everywhere: what remains is told, and reaches the blow."""
    body = followed_body(measured(known(), scale=np.exp(0.5j)))
    assert (body.damping_ratio >= 0.0).all()
    left = [float(note.split("leaves ")[1].split(" %")[0]) for note in body.notes if "leaves" in note]
    assert 15.0 < left[0] < 50.0
    assert body.shapes.spread(np.array([AT])).max() > 0.2


def test_what_cannot_be_followed_is_refused():
    frf = measured(known())
    with pytest.raises(ValueError, match="must be left out if pick is False"):
        followed_body(frf, frequencies=[100.0])
    with pytest.raises(ValueError, match="at least 20 lines"):
        followed_body(frf.isel(frequency=slice(0, 9)))
