"""What a rig makes of a blow: closed forms of filter, sensor, tip, noise and bits."""

import numpy as np
import pytest
from comparing import refusing

import fem_impact as fi
from fem_impact.taps import rig

RATE = 25600.0  # [Hz]
LAW = fi.Contact.linear(4e6)
BLOW = fi.collide([fi.Modes.rigid(0.1)], [fi.Touch(LAW, 0, None)], speeds=[1.0], tolerance=1e-6)


def measured(**rig):
    return fi.measure(BLOW, **{"rate": RATE} | rig)


def test_a_filter_keeps_the_impulse_and_the_spectrum_of_its_band():
    tap = measured(anti_alias="delta-sigma", before=2e-3)
    assert abs(tap.force.sum() / RATE - BLOW.impulse) < 1e-5 * BLOW.impulse  # the filter passes zero frequency
    frequencies = np.fft.rfftfreq(tap.force.shape[1], 1.0 / RATE)
    band = frequencies < 0.45 * RATE
    found = np.fft.rfft(tap.force[0])[band] / RATE * np.exp(2j * np.pi * frequencies[band] * 0.00200)
    lead = round(2e-3 * RATE) / RATE - 2e-3
    exact = BLOW.spectrum(frequencies[band]) * np.exp(-2j * np.pi * frequencies[band] * lead)
    assert np.abs(found - exact).max() < 3e-4 * BLOW.impulse  # ringing beyond the record's ends


def test_half_a_sample_of_onset_shifts_the_record():
    early, half, late = (measured(onset=shift / RATE) for shift in (0.0, 0.5, 1.0))
    assert np.abs(early.force[0, :-1] - late.force[0, 1:]).max() < 1e-9 * early.peak[0]
    assert np.abs(half.force - early.force).max() > 0.05 * early.peak[0]


def test_butterworth_is_three_decibels_down_at_its_corner():
    chain = rig.Rig(RATE, (4, 5000.0))
    found = np.abs(chain.passes(np.array([0.0, 5000.0, 10000.0])))
    assert np.allclose(found, [1.0, 0.5**0.5, 1.0 / np.sqrt(1.0 + 2.0**8)], rtol=1e-12)


def test_the_table_of_filters_falls_between_its_edges():
    for name, edges in rig.FILTERS.items():
        passes = rig.Rig(RATE, name).passes(np.array([0.3, 0.7]) * RATE).real
        assert np.allclose(passes, [1.0, 1.0 if edges is None else 0.0])


def test_the_cell_behind_a_rigid_tip_misses_its_share_of_the_force():
    whole, behind = (measured(tip_mass=mass) for mass in (0.0, 0.02))
    assert np.allclose(behind.force, 0.8 * whole.force, atol=1e-9)


def test_a_force_sensor_enlarges_what_is_near_its_resonance():
    """A tone at half the resonance by 1 / (1 - 1/4), and only in the force."""
    n, tone = 512, 40  # samples, and periods in them: 2 kHz
    chain = rig.Rig(rate=RATE, resonance=2.0 * tone * RATE / n, resonance_damping=1e-3)
    fine = np.sin(2.0 * np.pi * tone / n * np.arange(n * rig.FINE) / rig.FINE)
    force, other = (np.abs(np.fft.rfft(rig.sample(fine, chain, force=is_force)))[tone] for is_force in (True, False))
    assert force / other == pytest.approx(4.0 / 3.0, rel=1e-5)  # its damping counts by a square of 1e-3


def test_the_mode_of_a_hammer_shows_behind_its_tip():
    hammer = fi.Modes.from_arrays([0.0, 3000.0], [[10.0**0.5, 10.0**0.5]], points=[[0.0]], mass=0.1, complete=True)
    hit = fi.collide([hammer], [fi.Touch(LAW, 0, None, first_at=[0.0])], speeds=[1.0], tolerance=1e-6)
    tap = fi.measure(hit, rate=RATE, tip_mass=0.01, duration=0.02)
    later = tap.time > hit.impacts[-1].end + 2e-3
    spectrum = np.abs(np.fft.rfft(tap.force[0, later]))
    peak = np.fft.rfftfreq(later.sum(), 1.0 / RATE)[spectrum.argmax()]
    assert abs(peak - 3000.0) < 70.0  # it rings at its own frequency after the blow; resolution 60 Hz
    assert tap.force[0, later].max() > 1.0  # N


def test_a_response_is_the_motion_of_the_target():
    plate = fi.Modes.from_arrays(
        [400.0], [[1.5], [0.8]], points=[[0.0], [1.0]], mass=0.5, damping_ratio=0.02, complete=True
    )
    hit = fi.strike(plate, fi.Striker.rigid(0.05), fi.Contact.linear(2e5), at=[0.0], speed=1.0, tolerance=1e-6)
    tap = fi.measure(hit, rate=51200.0, at=[[1.0]], duration=0.03)
    late = (tap.time > 0.004) & (tap.time < 0.028)
    times = tap.time[late] - 51.0 / 51200.0  # the record begins 51 samples before the blow
    speed = hit.velocity([[1.0]], times)[:, 0]
    exact = np.gradient(speed, times)
    assert np.abs(tap.response[0, late, 0] - exact)[1:-1].max() < 2e-3 * np.abs(exact).max()  # central differences


@pytest.mark.parametrize("vectors", [False, True])
def test_responses_at_the_point_struck_contain_the_modes_left_out(vectors):
    section = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), thickness=0.004)
    plate = fi.assemble(fi.mesh.rectangle(0.5, 0.4), section, supports={"boundary": "hinged"})
    whole = fi.analytic.closed_form(plate.mesh, section, {"boundary": "hinged"})(n_modes=300).damped(0.05)
    struck, damping = (plate, 0.05) if vectors else (whole.truncated(n_modes=40), None)
    hit = fi.strike(
        struck, fi.Striker.rigid(0.02), fi.Contact.linear(2e5), at=(0.13, 0.11), speed=1.0, tolerance=2e-2,
        damping_ratio=damping,
    )  # fmt: skip
    points = [[0.13, 0.11], [0.3, 0.25]]
    found = fi.frf(fi.measure(hit, rate=12800.0, at=points, duration=0.4))
    band = (found.frequency.values > 20.0) & (found.frequency.values < 700.0)
    exact = fi.mobility(whole, points[0], points, found.frequency.values[band], "accelerance")[:, :, 0]
    # modes above 2.9 kHz yield as if at rest, to a sixteenth of what they yield: 1e-3 of the whole; without them 5e-2
    assert (np.abs(found.H.values[band] - exact) < 2e-3 * np.abs(exact).max(axis=0)).all()


@pytest.mark.parametrize("quantity", ["acceleration", "velocity", "displacement"])
def test_responses_are_right_between_resonances_too(quantity):
    """There the modes left out count, whose velocity jumps with the rate of a linear contact's force."""
    plate = fi.analytic.rectangle(0.4, 0.3, mass=0.3, first_frequency=120.0, n_modes=25, damping_ratio=0.03)
    points = np.array([[0.13, 0.1], [0.2, 0.15]])
    hit = fi.strike(
        plate, fi.Striker.rigid(0.01), fi.Contact.linear(2e5), at=points[0], speed=1.0, tolerance=1e-4, max_impacts=1
    )
    tap = fi.measure(hit, rate=25600.0, at=points, duration=1.5, quantity=quantity)
    frequency = np.fft.rfftfreq(tap.force.shape[1], 1.0 / 25600.0)
    band = (frequency > 50.0) & (frequency < 2500.0)
    force, moved = (np.fft.rfft(each, axis=0)[band] for each in (tap.force[0], tap.response[0]))
    square = (2j * np.pi * frequency[band, None]) ** 2
    shape, poles = plate.shape_at(points), plate.omega**2 + 2.0 * plate.damping_ratio * plate.omega * np.sqrt(square)
    each = ((shape[0] * shape)[:, None] / (poles + square)).sum(axis=2).T + plate.residual_compliance(points)[0]
    exact = each * np.sqrt(square) ** ("displacement", "velocity", "acceleration").index(quantity)
    assert np.abs(moved / force[:, None] / exact - 1.0).max() < 1e-3  # 4e-4; of velocities it was 2.8e-2


def test_a_constant_force_accelerates_too():
    hit = fi.strike(
        fi.Modes.rigid(0.4), fi.Striker.rigid(0.1), fi.Contact.linear(1e6), at=None, speed=1.0, striker_force=-5.0
    )
    tap = fi.measure(hit, rate=RATE, tip_mass=0.02, duration=0.05)
    gone = (tap.time > hit.impacts[0].end + 5e-3) & (tap.time < hit.impacts[0].end + 6e-3)
    assert tap.force[0, gone] == pytest.approx(-0.02 / 0.1 * 5.0, rel=1e-3)  # N; what the filter rings


def test_noise_bits_and_range():
    clean, noisy = measured(), measured(noise=0.01, rng=1)
    assert np.array_equal(noisy.force, measured(noise=0.01, rng=np.random.default_rng(1)).force)
    assert abs(np.std(noisy.force - clean.force) / (0.01 * clean.peak[0]) - 1.0) < 0.1  # 551 samples: 3 % of spread
    step = 1.25 * clean.peak[0] / 128.0
    assert np.abs(measured(bits=8).force - clean.force).max() <= 0.5 * step * (1 + 1e-9)
    over = measured(full_scale=500.0)
    assert over.overload.tolist() == [True] and over.peak[0] == 500.0


test_wrong_rigs_are_refused = refusing([
    ({"rate": 0.0}, "rate"), ({"anti_alias": "brick"}, "anti_alias must be one of"), ({"noise": -1.0}, "noise"),
    ({"duration": 1e-4}, "longer than before"), ({"duration": 1e4}, "duration must be shorter"), ({"bits": 1}, "bits"),
    ({"anti_alias": (0, 1e3)}, "order"), ({"quantity": "jerk"}, "quantity must be one of"),
    ({"noise": 0.01}, "rng must be given"), ({"noise": 0.01, "rng": -1}, "a seed of whole numbers"),
    ({"noise": 0.01, "rng": 0.5}, "rng must be"), ({"tip_mass": 2.0}, "tip_mass must be less than the striker's"),
], lambda wrong: measured(**wrong))  # fmt: skip
