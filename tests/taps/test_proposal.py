"""Models proposed for taps of rigs that are known: no more than is there, and never worse than a smaller one."""

import pytest

import fem_impact as fi

WALL, HAMMER = fi.Modes.rigid(1e4), fi.Striker.rigid(0.1)


def taps_of(law, body=WALL, place=None, noise=5e-3):
    hits = [fi.strike(body, HAMMER, law, at=place, speed=v, tolerance=1e-4) for v in (0.5, 1.0, 1.5)]
    return [fi.measure(hit, rate=25600.0, noise=noise, rng=i) for i, hit in enumerate(hits)]


def test_a_lossy_law_is_found_and_nothing_more():
    got = fi.propose(taps_of(fi.Contact.power(2e9, 1.9, loss=0.3)), striker=HAMMER, starts=1, profiles=False)
    taken = [one.name for one in got.tried if one.taken]
    assert taken == ["Hertz", "Hertz + exponent", "Hertz + exponent + loss"]
    assert got.found.point["contact.exponent"] == pytest.approx(1.9, abs=0.03)
    more = {one.name.rpartition(" + ")[2] for one in got.tried[-3:]}
    assert more == {"springy head", "stiffness per tap", "mode 1"}
    errors = {one.name: one.error for one in got.tried}
    assert all(one.error <= errors[one.inside] * (1.0 + 1e-3) for one in got.tried if one.inside)
    assert "left out" in got.summary() and set(got.found.compared) == set(errors)


def test_what_cannot_be_tried_is_refused():
    one = taps_of(fi.Contact.hertz(2e8))[:1]
    with pytest.raises(ValueError, match="taps must be two at least"):
        fi.propose(one, striker=HAMMER)
    with pytest.raises(ValueError, match="striker must be rigid"):
        fi.propose([*one, *one], striker=fi.Striker.stick(mass=0.1, first_frequency=1e4))
