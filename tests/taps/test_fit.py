"""From taps to a model: what is told, what is not, and how well other taps are predicted."""

import numpy as np
import pytest
from hammer_taps import LAW, MASS, RANGES, RATE, STRUCTURE, fitted, said, taps_of

import fem_impact as fi


@pytest.fixture(scope="module")
def taps():
    return taps_of()


@pytest.fixture(scope="module")
def found(taps):
    return fitted(taps, contact=fi.Contact.hertz(1e7), starts=3, profiles=True)


def test_on_a_known_structure_everything_is_told(found):
    assert found.unidentifiable == () and found.limited == () and found.data()["unidentifiable"] == []
    said = found.summary()
    assert "90 % interval" in said and "striker.mass" in said and "do not determine" not in said
    for name, truth in (("contact.stiffness", 5e8), ("contact.exponent", 1.7), ("striker.mass", MASS)):
        low, high = found.interval(name, 0.95)
        assert low < truth < high  # this seed's noise; `studies/verification/fit_coverage.py` counts how often
        assert found.interval(name, 0.5)[0] > low
    assert found.interval("striker.mass")[1] / found.interval("striker.mass")[0] < 1.05  # 0.5 % of noise
    low, high = found.interval("speed[1]", 0.95)
    assert low < 0.8 < high and high / low < 1.05
    assert found.whiteness > 0.01


def test_taps_whose_response_is_dead_are_left_out_and_some_must_stay():
    taps = taps_of(at=[[0.0]], duration=0.01)
    force, moved = (np.concatenate([getattr(each, name) for each in taps]) for name in ("force", "response"))
    moved[1] = 5.0
    made = fitted(fi.Taps.from_arrays(force, moved, rate=RATE), response_at=[[0.0]])
    assert said(made, "left out, because their response does not change: tap 2") and made.used == (0, 1)
    moved[1:], force[0] = 5.0, np.minimum(force[0], 0.5 * force[0].max())
    with pytest.raises(ValueError, match="taps must hold one at least that can be compared; left out"):
        fitted(fi.Taps.from_arrays(force, moved, rate=RATE), response_at=[[0.0]])
    moved[0] = 5.0
    with pytest.raises(ValueError, match=r"whose responses all change; leave out dead channels, response="):
        fitted(fi.Taps.from_arrays(force, moved, rate=RATE), response_at=[[0.0]])
    assert fitted(fi.Taps.from_arrays(force, rate=RATE)).used == (0, 1)  # without them


@pytest.mark.parametrize("level", [0.0, 0.5])
def test_a_tap_with_a_gap_in_its_force_is_told_and_left_out(level, tmp_path):
    """What lost samples leave was fitted as a pulse, without a word."""
    force = np.concatenate([each.force for each in taps_of(duration=0.02)])
    first = int(force[1].argmax()) + 3
    force[1, first : first + 5] = level * force[1, first]
    fi.Taps.from_arrays(force, rate=RATE).save(tmp_path / "t.npz")
    read = fi.read_taps(tmp_path / "t.npz")
    assert said(read, "tap 2: the force stands still amid a pulse, as where lost samples were filled")
    made = fitted(read)
    assert said(
        made, "left out, because their force stands still amid a pulse, as where lost samples were filled: tap 2"
    )
    with pytest.raises(ValueError, match="taps must hold one at least whose force has no gap"):
        fitted(read.pick([1]))


def test_what_was_found_strikes_again(found):
    hit = fi.strike(STRUCTURE, found.striker, found.contact, at=[0.0], speed=1.0)
    wanted = fi.strike(STRUCTURE, fi.Striker.rigid(MASS), LAW, at=[0.0], speed=1.0)
    assert hit.peak_force == pytest.approx(wanted.peak_force, rel=0.01)
    assert found.double_hit(tip=1e-2).n_impacts == 1 < found.double_hit(mass=0.5, tip=1e3).n_impacts


def test_on_a_wall_mass_and_stiffness_are_a_ridge():
    wall = fi.Modes.rigid(1e9)
    ranges = RANGES | {"contact.stiffness": (1e4, 1e13)}
    made = fi.fit(taps_of(wall, None), striker=fi.Striker.rigid(0.1), contact=LAW, unknown=ranges, starts=2)
    assert set(made.unidentifiable) == {"contact.stiffness", "striker.mass"}
    ridge = made.ridges["striker.mass"]
    # F = k d**a on a wall: the record stays if mass times speed and k / mass**a stay
    assert ridge["contact.stiffness"] == pytest.approx(1.7, abs=0.05)
    assert ridge["speed[0]"] == pytest.approx(-1.0, abs=0.05)
    assert "striker.mass" not in made.values and "speed[0]" not in made.values
    low, high = made.interval("contact.exponent", 0.95)
    assert low < 1.7 < high < 1.9 and "striker.mass" in made.verdict[0] in made.summary()


@pytest.mark.slow
def test_a_response_tells_what_the_force_cannot():
    body, unit = (
        fi.Modes.from_arrays([0.0, 900.0], np.array([[1.0, 1.5], [1.0, -0.9]]) / mass**0.5, points=[[0.0], [1.0]],
                             mass=mass, damping_ratio=0.02, complete=True) for mass in (1.0, 1.5625)
    )  # fmt: skip
    taps = taps_of(body, at=[[1.0]])
    given = {"target": unit, "unknown": RANGES | {"target.mass": (0.3, 3.0)}, "profiles": True}
    blind, seeing = (fitted(taps, **given, response_at=at) for at in (None, [[1.0]]))
    assert {"striker.mass", "target.mass"} <= set(blind.unidentifiable)
    assert seeing.unidentifiable == ()
    low, high = seeing.interval("target.mass", 0.95)
    assert low < 1.0 < high and high / low < 1.1


LOSING = {
    "felt": (
        fi.Contact.felt(5e8, 1.8, hysteresis=0.4, relaxation=4e-4), fi.Contact.power(5e8, 1.8),
        {"contact.stiffness": (1e6, 1e11), "contact.hysteresis": (0.0, 0.9), "contact.relaxation": (2e-5, 1e-2)},
    ),
    "plastic": (
        fi.Contact.elastic_plastic(2e8, 1.5, yield_approach=3e-5), fi.Contact.hertz(1e8),
        {"contact.stiffness": (1e6, 1e11), "contact.yield_approach": (5e-6, 5e-4)},
    ),
    "layers": (
        fi.Contact.layers(2e6, 1.0, depth=1e-4, hard_stiffness=5e8), fi.Contact.linear(1e6),
        {
            "contact.stiffness": (1e5, 1e8), "contact.depth": (2e-5, 5e-4), "contact.hard_stiffness": (1e7, 1e10),
        },
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", LOSING)
def test_any_number_of_a_contact_is_found_by_its_name(kind):
    truth, guess, ranges = LOSING[kind]
    given = {"striker": fi.Striker.rigid(MASS), "contact": guess, "unknown": ranges, "starts": 3, "profiles": True}
    made = fitted(taps_of(law=truth, noise=0.001), **given)
    assert made.unidentifiable == () and made.whiteness > 0.01
    for name in ranges:
        wanted = getattr(truth, name.partition(".")[2])
        low, high = made.interval(name, 0.95)
        assert low < wanted < high  # this seed's noise
        assert getattr(made.contact, name.partition(".")[2]) == pytest.approx(wanted, rel=0.02)  # 0.6 % measured


def test_a_tap_that_disagrees_is_named():
    taps = taps_of(speeds=(0.4, 0.7, 1.0, 1.3))
    other = taps_of(law=fi.Contact.power(2e8, 1.7), speeds=(0.9,))
    made = fitted([*taps, *other])
    assert list(made.outliers) == ["tap 5"] and made.used == (0, 1, 2, 3)
    assert made.point["contact.exponent"] == pytest.approx(1.7, abs=0.05)


@pytest.mark.parametrize("noise", [0.02, 0.05])
def test_a_tap_that_is_only_noisier_counts_less_and_stays(noise):
    made = fitted([*taps_of(speeds=(0.4, 0.7, 1.0, 1.3)), *taps_of(speeds=(0.9,), noise=noise)])
    assert made.outliers == {} and len(made.used) == 5
    assert made.point["contact.exponent"] == pytest.approx(1.7, abs=0.02)  # this seed's noise: 0.016


def test_laws_are_compared_by_left_out_taps():
    laws = [fi.Contact.linear(1e6), fi.Contact.hertz(1e7)]
    unknown = {name: RANGES[name] for name in ("contact.stiffness", "striker.mass")}
    made = fitted(taps_of(law=fi.Contact.hertz(1e8)), contact=laws, unknown=unknown)
    assert made.contact.exponent == 1.5 and made.compared["Hertz"] < 0.3 * made.compared["linear"]


@pytest.mark.parametrize(("changes", "said"), [
    ({"response_at": [[0.0]]}, "response_at needs accelerations"),
    ({"known": {"striker.mass": 0.1}}, "known and unknown both name"),
    ({"known": {"contact.hardness": 0.1}}, "known must be one of"),
    ({"unknown": {"contact.hysteresis": (0.0, 0.9)}}, "a contact within all ranges: relaxation must be positive"),
    ({"unknown": {"contact.hysteresis": (0.0, 0.9), "contact.exponent": (0.8, 3.0)},
      "known": {"contact.relaxation": 1e-3}}, "a contact within all ranges: exponent must be at least 1"),
    ({"taps": 3}, "taps must be"),
    ({"at": [0.1, 0.2]}, "at must be left out without a target"),
    ({"starts": 10**6}, "starts must be at most 64, got 1000000"),
    ({"taps": fi.Taps.from_arrays(100.0 * np.hanning(40), rate=RATE, overload=True)}, "not cut off"),
])  # fmt: skip
def test_wrong_arguments_are_refused(taps, changes, said):
    given = {"taps": taps, "striker": fi.Striker.rigid(0.1), "contact": LAW, "unknown": RANGES}
    with pytest.raises(ValueError, match=said):
        fi.fit(**given | changes)


@pytest.mark.slow
def test_a_search_goes_on_where_all_starts_end_in_a_poor_minimum():
    plate = fi.analytic.rectangle(0.5, 0.4, mass=1.5, first_frequency=90.0, n_modes=30, damping_ratio=0.01)
    law = fi.Contact.power(3e8, 1.6, loss=0.2)
    hits = [fi.strike(plate, fi.Striker.rigid(0.1), law, at=(0.21, 0.13), speed=v) for v in (0.5, 1.0, 1.6)]
    taps = [fi.measure(hit, rate=51200.0, noise=2e-3, rng=i, duration=6e-3) for i, hit in enumerate(hits)]
    found = fi.fit(
        taps, target=plate, at=(0.21, 0.13), striker=fi.Striker.rigid(0.1), contact=fi.Contact.hertz(1e7),
        unknown={"contact.stiffness": (1e6, 1e11), "contact.exponent": (1.0, 3.0), "contact.loss": (0.0, 2.0),
                 "target.first_frequency": (60.0, 150.0), "target.mass": (0.5, 5.0)},
        starts=1, profiles=False,
    )  # fmt: skip
    # others end at a bound of the frequency
    assert len(found.minima) > 1 and max(found.minima) > 50.0 * found.best.cost
    assert found.point["target.mass"] == pytest.approx(1.5, rel=0.02)  # 0.3 % was found in 0.2 % of noise
    assert found.point["target.first_frequency"] == pytest.approx(90.0, rel=0.01)


@pytest.mark.slow
def test_a_second_mode_is_found_from_the_best_fit_without_it():
    """Where only points spread over the ranges begin, two of three seeds end at 1.08 times this sum of squares."""
    body = fi.Modes.from_arrays(
        [900.0, 2300.0, 4200.0], [[2.0, 1.5, 1.2]], points=[[0.0]], mass=1.0, damping_ratio=0.02
    )
    mode = {"frequency": (200.0, 1e4), "mass": (0.02, 50.0)}
    unknown = {"contact.stiffness": (1e6, 1e11), "contact.exponent": (1.0, 4.0)} | {
        f"mode{i}.{part}": limits for i in (1, 2) for part, limits in mode.items()
    }
    taps = taps_of(body, [0.0])
    made = [
        fi.fit(taps, striker=fi.Striker.rigid(MASS), contact=fi.Contact.hertz(1e8), unknown=unknown, starts=2,
               profiles=False, rng=seed)
        for seed in (0, 2)
    ]  # fmt: skip
    assert made[0].best.cost == pytest.approx(made[1].best.cost, rel=1e-3)
    assert made[0].best.cost < made[0].minima[-1] and not made[0].notes


def test_a_stiffness_beyond_its_range_is_said_and_has_its_interval():
    taps = taps_of(noise=0.002)
    made = fitted(taps, striker=fi.Striker.rigid(MASS), unknown={"contact.stiffness": (1.0, 1e3)})  # in other units
    assert said(made, "in the best fit, outside its range of 1 to 1000")
    low, high = made.interval("contact.stiffness")
    assert low < 5e8 < high < 1.1 * low
    assert not said(fitted(taps, unknown={"contact.stiffness": (1e6, 1e11)}), "outside its range")
