"""Records as other people have them: noise, drift, commas, late triggers, double hits, all the way to a prediction."""

import numpy as np
import pytest
from hammer_taps import RATE, said
from scenes import load_text

import fem_impact as fi

pytestmark = pytest.mark.usefixtures("read_here")
LAW = fi.Contact.power(2e11, 1.9, loss=0.15)  # six to eight samples of contact
SPEEDS = (0.3, 0.42, 0.5, 0.65, 0.8)  # m/s
GAP, BEFORE = 0.25, 0.1  # s between taps, and before the first
RANGES = {"contact.stiffness": (1e3, 1e16), "contact.exponent": (1.0, 4.0), "contact.loss": (0.0, 20.0)}
WALL = fi.Modes.rigid(1e9)


def struck(target, place, mass=0.15, law=LAW, speeds=SPEEDS, **given):
    return [fi.strike(target, fi.Striker.rigid(mass), law, at=place, speed=v, **given) for v in speeds]


def record(hits, noise=0.005):
    """One long record of the force of all hits (n_samples,) [N]; noise over the largest peak."""
    rng = np.random.default_rng(0)
    force = np.zeros(int(RATE * (BEFORE + GAP * len(hits))))
    for i, hit in enumerate(hits):
        tap = fi.measure(hit, rate=RATE, duration=0.9 * GAP, onset=rng.uniform() / RATE)
        first = int(RATE * (BEFORE + GAP * i))
        force[first : first + len(tap.time)] += tap.force[0]
    return force + noise * force.max() * rng.standard_normal(len(force))


@pytest.fixture
def read(tmp_path):
    """Taps of a record as a German spreadsheet writes it."""

    def read(force, heading="Kraft [N]", **options):
        rows = (f"{i / RATE:.7f};{f:.6e}".replace(".", ",") for i, f in enumerate(force))
        (tmp_path / "a.csv").write_text("\n".join([f"Zeit [s];{heading}", *rows]) + "\n")
        return fi.read_taps(tmp_path / "a.csv", **options)

    return read


@pytest.fixture(scope="module")
def hits():
    return struck(WALL, None)


@pytest.fixture(scope="module")
def force(hits):
    return record(hits)


def first_above(force, start):
    """The first sample above a tenth of the largest force, from some sample on."""
    return start + int((force[start:] > 0.1 * force.max()).argmax())


def fitted(taps, **changes):
    given = {"striker": fi.Striker.rigid(0.15), "contact": fi.Contact.hertz(1e7), "unknown": RANGES, "starts": 2,
             "profiles": False}  # fmt: skip
    return fi.fit(taps, **given | changes)


def test_drift_and_offset_beyond_the_trigger_make_no_taps(force, read):
    slow = np.linspace(0.0, 0.3 * force.max(), len(force)) - 0.1 * force.max()
    taps, plain = read(1e-3 * (force + slow), "Kraft [kN]"), read(force)
    assert taps.n_taps == plain.n_taps == 5 and (taps.n_pulses == 1).all()
    assert np.allclose(taps.peak, plain.peak, atol=2e-3 * force.max())  # a median of 400 samples of 0.5 % of noise
    assert said(taps, "drift of the force was removed") and len(plain.notes) == 1


@pytest.mark.parametrize("second", [0.0, 0.05])
def test_drift_that_bends_makes_no_pulses(second, read):
    """Two newtons of it, smooth beside its noise, look like pushes; a second pulse above it is still seen."""
    time = np.arange(100_000) / RATE
    force = 2.0 * np.sin(2.0 * np.pi * 0.5 * time) + 3e-3 * np.random.default_rng(1).standard_normal(len(time))
    for start, size in ((0.3, 1.0), (0.303, second), (2.1, 1.0), (2.103, second)):
        wave = (time - start) / 1e-3
        force += 100.0 * size * np.where((wave > 0.0) & (wave < 1.0), np.sin(np.pi * wave), 0.0)
    found = read(force)
    assert found.n_pulses.tolist() == [2 if second else 1] * 2
    np.testing.assert_allclose(found.impulse, 0.2 / np.pi * (1.0 + second), rtol=5e-3)


def test_a_tap_that_a_record_begins_with_does_not_cost_the_others_their_rest(force, read):
    taps = read(force[first_above(force, 0) :])
    assert taps.labels == ("tap 2", "tap 3", "tap 4", "tap 5") and taps.onset[0] > 0.01
    assert said(taps, "tap 1 is left out")


@pytest.mark.parametrize("noise", [pytest.param(0.005, marks=pytest.mark.slow), 0.02])
def test_noise_neither_makes_pulses_nor_widens_the_window(hits, read, noise):
    taps = read(record(hits, noise))
    assert taps.n_pulses.tolist() == [1] * 5
    made = fitted(taps)
    assert len(made.taps.time) < 60  # some 8 samples of contact, 12 before, and 1.5 times 12 after
    # 2 % of the largest peak is 13 % of the rms force of a tap in the middle
    assert made.whiteness > 0.01 and made.predict(4).error < 4.0 * noise + 0.01
    assert made.point["contact.exponent"] == pytest.approx(1.9, abs=0.05 + 10.0 * noise)  # this seed's noise


@pytest.mark.slow
def test_taps_count_by_how_sure_they_are(force, read):
    made = fitted(read(force))
    size = np.sqrt(np.square(made.problem.residual(made.best.x)).reshape(5, -1).mean(axis=1))
    assert size.max() < 2.0 * size.min()  # weighted residuals; of the peak they differ by the peaks, a factor of 3.4


def test_two_taps_at_the_same_ceiling_are_cut_off(force, read):
    taps = read(np.minimum(force, 0.7 * force.max()))  # two or three samples of each, on different offsets
    assert taps.overload.tolist() == [False, False, False, True, True]
    made = fitted(taps)
    assert made.taps.n_taps == 3 and said(made, "cut off: tap 4, tap 5")


@pytest.mark.slow
def test_a_trigger_in_the_pulse_is_said_and_left_out(force, tmp_path):
    starts = [first_above(force, int(RATE * t)) for t in BEFORE - 0.01 + GAP * np.arange(5)]

    def rows(*shifts):
        return np.array([force[n + k : n + k + 200] for n, k in zip(starts, shifts)])

    def read(rows):
        np.savez(tmp_path / "a.npz", force=rows, rate=RATE)
        return fi.read_taps(tmp_path / "a.npz")

    early, late = read(rows(*[-4] * 5)), read(rows(*[1] * 5))
    assert [said(taps, "begins or ends within a pulse") for taps in (early, late)] == [False, True]
    with pytest.raises(ValueError, match="trigger earlier"):
        fitted(late)
    assert fitted(early).point["contact.exponent"] == pytest.approx(1.9, abs=0.15)
    made = fitted(fi.Taps.from_arrays(rows(-4, -4, 1, -4, -4), rate=RATE))
    assert made.taps.labels == ("tap 1", "tap 2", "tap 4", "tap 5") and said(made, "tap 3")


@pytest.mark.slow
def test_a_spike_is_no_tap_of_this_hammer(force, read):
    sparks = force.copy()
    sparks[[1000, 20000]] = 0.5 * force.max(), -0.5 * force.max()
    made = fitted(read(sparks))
    assert list(made.outliers) == ["tap 1"] and made.point["contact.exponent"] == pytest.approx(1.9, abs=0.15)


@pytest.mark.slow
def test_five_taps_on_an_unknown_structure_are_predicted_to_their_noise(read):
    body = fi.Modes.from_arrays(
        [700.0, 2100.0, 5200.0], [[1.1, 0.9, 0.8]], points=[[0.0]], mass=1.0, damping_ratio=0.03, complete=True
    )
    force = record(struck(body, [0.0]))
    time = np.arange(len(force)) / RATE
    force += 0.002 * force.max() * np.sin(2.0 * np.pi * 0.7 * time)  # what a charge amplifier drifts
    taps = read(force)
    made = fitted(taps, unknown=RANGES | {"mode1.frequency": (500.0, 1e4), "mode1.mass": (0.05, 20.0)}, starts=3)
    assert made.outliers == {} and made.whiteness > 1e-3
    for one, peak in zip(made.left_out(), taps.peak):
        # the noise, and a little of the others'
        assert np.sqrt(np.mean(one.residual**2)) < 1.6 * 0.005 * taps.peak.max()
        assert one.error_of_peak < 1.6 * 0.005 * taps.peak.max() / peak


WOODEN = """
[mesh]
shape = "rectangle"
length = 0.4
width = 0.3
[material]
E = 11e9
nu = 0.37
rho = 430.0
E_across = 0.8e9
G = 0.7e9
[section]
kind = "plate"
thickness = 4e-3
[target]
damping_ratio = 0.01
[supports]
boundary = "free"
[striker]
kind = "rigid"
mass = 0.02
[contact]
kind = "hertz"
stiffness = 4e8
[strike]
at = [0.17, 0.12]
speed = 0.5
"""


@pytest.mark.slow
def test_double_hits_on_a_known_wooden_plate_tell_the_hammer(tmp_path, read):
    plate, place = load_text(tmp_path, WOODEN).modes(60), (0.17, 0.12)
    law = fi.Contact.power(4e8, 1.5, loss=0.2)
    hits = struck(plate, place, 0.02, law, (0.15, 0.25, 0.4, 0.6, 0.9), max_impacts=6, tolerance=1e-3, duration=0.05)
    taps = read(record(hits))
    assert (taps.n_pulses > 1).all() and said(taps, "more than one pulse")
    made = fitted(taps, target=plate, at=place, striker=fi.Striker.rigid(0.04),
                  unknown=RANGES | {"striker.mass": (5e-3, 0.3)})  # fmt: skip
    assert made.outliers == {} and made.whiteness > 1e-3
    assert made.point["striker.mass"] == pytest.approx(0.02, rel=0.01)  # the second rise tells it
    assert made.point["contact.exponent"] == pytest.approx(1.5, abs=0.05)
    # the later pulses follow from the rise of the first; 2.2 % of the rms force is noise
    assert made.left_out(rise_only=True)[4].error < 0.05


def test_taps_of_the_wrong_sign_and_empty_ones_are_left_out(force):
    rows = np.array([force[int(RATE * t) - 50 :][:150] for t in BEFORE + GAP * np.arange(5)])
    rows[1] *= -1.0
    rows[3] = 0.0
    rows[4] += 0.2 * force.max()
    made = fitted(fi.Taps.from_arrays(rows, rate=RATE), unknown={"contact.stiffness": RANGES["contact.stiffness"]},
                  contact=LAW, starts=1, robust=False)  # fmt: skip
    assert made.taps.labels == ("tap 1", "tap 3", "tap 5") and made.error < 0.06
    assert "left out, because their force never pushes: tap 2, tap 4" in made.notes
    assert said(made, "offsets of the force were removed")
    with pytest.raises(ValueError, match="a negative one has the wrong sign"):
        fitted(fi.Taps.from_arrays(-rows[:1], rate=RATE))


STIFFNESS = {"unknown": {"contact.stiffness": RANGES["contact.stiffness"]}, "contact": LAW, "starts": 1}


def test_an_acceleration_in_place_of_the_force_is_told_and_refused(force, read):
    ringing = np.convolve(force, np.cos(np.arange(200) / 2.0) * np.exp(-np.arange(200) / 40.0))[: len(force)]
    taps = read(ringing)
    assert said(taps, "the force pulls as it pushes, which no contact does; name its channel, force=")
    with pytest.raises(ValueError, match="force pushes more than it pulls; name the channel of the force"):
        fitted(taps, **STIFFNESS)


def test_hum_is_refused_before_searches_that_take_minutes(force, read):
    hum = 0.2 * force.max() * np.sin(2.0 * np.pi * 50.0 * np.arange(len(force)) / RATE)
    said = r"window must be given: .* again .* s after its onset, by hum or noise; check the"
    with pytest.raises(ValueError, match=said):
        fitted(read(force + hum), **STIFFNESS)


@pytest.mark.parametrize(("factor", "doubted"), [(1e-3, "slower"), (1.0, None), (1e3, "faster")])
def test_a_slip_in_the_unit_of_the_force_shows_in_the_speed(force, read, factor, doubted):
    made = fitted(read(factor * force, "Kraft [N]"), **STIFFNESS)
    assert said(made, "m/s is") == bool(doubted) == said(made, f"m/s is {doubted} than a hammer taps; check the unit")


def test_what_the_model_does_not_explain_is_said(force):
    pulses = [np.pad(np.sin(np.linspace(0.0, np.pi, n)), (50, 250 - n)) for n in (8, 80, 200)]  # of three rates
    made = fitted(fi.Taps.from_arrays(force.max() * np.array(pulses), rate=RATE), **STIFFNESS)
    assert made.error > 0.5 and "The model does not explain the taps: check the channels" in made.summary()


def test_pulses_that_no_hammer_makes_are_told(force, read, tmp_path):
    plain, spike = force.copy(), force.copy()
    spike[1000] = 50.0 * force.max()  # every tap is below the trigger
    assert said(read(spike), "tap 1: a pulse of a single sample, which is a spike")
    assert not any("a pulse of" in note for note in read(plain).notes)
    for rate, what in ((1e3 * RATE, "shorter"), (1e-3 * RATE, "longer")):  # times in other units
        np.savez(tmp_path / "a.npz", force=force[int(RATE * BEFORE) - 50 :][:150], rate=rate)
        assert said(fi.read_taps(tmp_path / "a.npz"), f"s is {what} than a tap; check rate, or the unit of the times")
