"""A contact law of the user's own: kept as he gives it, as exact in energy as any other, and refused in words."""

import dataclasses
import pickle

import numpy as np
import pytest
from comparing import refusing
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.optimize import brentq

import fem_impact as fi
from fem_impact.impact.compiled import build, law
from fem_impact.impact.compiled.laws import tabled

BALL, WALL = fi.Striker.rigid(0.05), fi.Modes.rigid(1e9)
HERTZ = fi.Contact.of(lambda d: 1e6 * d**1.5, deepest=2e-3)


def foam(d):
    """A foam that stiffens exponentially [N]."""
    return 20.0 * np.expm1(d / 1e-3)


def kinked(d):
    """A spring that becomes ten times as stiff at 1 mm [N]."""
    return np.where(d < 1e-3, 1e4 * d, 10.0 + 1e5 * (d - 1e-3))


@pytest.mark.parametrize(
    "force",
    [foam, kinked, lambda d: 100.0 * np.tanh(d / 3e-3), lambda d: 1e9 * d**3.5, lambda d: 1e12 * d**5.0,
     lambda d: 3e4 * d if d < 1.0 else 0.0],
    ids=["foam", "kinked", "softens", "power 3.5", "power 5", "one at a time"],
)  # fmt: skip
def test_the_force_kept_differs_by_no_more_than_it_says(force):
    law = fi.Contact.of(force, deepest=5e-3)
    x = np.geomspace(5.001e-6, 5e-3, 3001)
    wanted = np.array([float(force(each)) for each in x])
    assert 0.0 < law.misfit <= 1e-5 and law.n_knots <= tabled.KNOTS
    # it is looked for at three points of each piece; a cubic's error is largest at the middle one, a kink's is not
    assert np.abs(law.force(x) / wanted - 1.0).max() < (5.0 if force is kinked else 1.1) * law.misfit + 1e-12
    assert (np.diff(law.force(np.linspace(0.0, 7e-3, 2001))) > 0.0).all()


@pytest.mark.parametrize("loss", [0.0, 0.05])
def test_a_blow_on_a_wall_is_that_of_the_force_given(loss):
    hit = fi.strike(WALL, BALL, fi.Contact.of(foam, deepest=5e-3, loss=loss), at=None, speed=0.8, tolerance=1e-6)
    if loss:  # of any law, whatever its force: L (1 + e) = ln((1 + L) / (1 - e L))
        e, L = hit.restitution, loss * 0.8
        assert_allclose(L * (1.0 + e), np.log((1.0 + L) / (1.0 - e * L)), rtol=1e-5)
        return
    deepest = brentq(lambda d: 20.0 * (1e-3 * np.expm1(d / 1e-3) - d) - 0.5 * 0.05 * 0.8**2, 1e-4, 5e-3, xtol=1e-15)

    def slowness(s):  # of the way out from the deepest, over y = deepest s**2
        y = deepest * s * s
        return 2.0 * deepest * s / np.sqrt(40.0 / 0.05 * (-1e-3 * np.exp(deepest / 1e-3) * np.expm1(-y / 1e-3) - y))

    assert_allclose(hit.peak_force, foam(deepest), rtol=1e-5)  # as misfit, also the time
    assert_allclose(hit.contact_time, 2.0 * quad(slowness, 0.0, 1.0)[0], rtol=1e-5)
    assert abs(hit.energy_error) < 1e-12
    slow, fast = (fi.Contact.of(foam, deepest=5e-3, tolerance=t) for t in (1e-3, 1e-5))
    assert fast.n_knots > slow.n_knots


def test_hertz_as_a_law_of_ones_own_strikes_as_hertz():
    alloy = fi.Plate(fi.Material(E=70e9, nu=0.33, rho=2700.0), thickness=3e-3)
    sheet = fi.analytic.rectangle(0.6, 0.4, section=alloy, n_modes=40, damping_ratio=0.01)
    own, known = (fi.strike(sheet, BALL, law, at=(0.2, 0.15), speed=0.5) for law in (HERTZ, fi.Contact.hertz(1e6)))
    for name in ("restitution", "contact_time", "peak_force"):
        allowed = float(own.error) + float(known.error) + HERTZ.misfit
        assert_allclose(getattr(own, name), getattr(known, name), rtol=allowed)
    assert abs(own.energy_error) < 1e-12  # rounding
    assert own.n_impacts == known.n_impacts == 1
    found, there = (hit.gradient("restitution") for hit in (own, known))
    assert not [name for name in found.names if name.startswith("contact.")]
    assert_allclose(found["striker.mass"], there["striker.mass"], rtol=1e-4)


def test_average_slopes_are_those_of_the_energy_also_across_knots_and_at_both_ends():
    numbers = law.table([HERTZ.numbers])
    spring = build.plain(law.spring_of)(numbers, 0)
    at, slopes = build.plain(law.point_at), build.plain(law.mean_slopes)
    for one, two in [(1e-7, 1.5e-6), (1e-6, 3e-6), (4e-6, 1e-3), (1e-5, 1.0001e-5), (1e-3, 3e-3), (2.5e-3, 3e-3)]:
        start, end = at(one, spring), at(two, spring)
        g, d = slopes(start, end, spring)
        rounding = 4e-16 * two / (two - one)  # of the differences
        assert_allclose(g, (end.energy - start.energy) / (two - one), rtol=10.0 * rounding)
        assert_allclose(d, (end.force - start.force) / (two - one), rtol=10.0 * rounding)
        assert_allclose(slopes(end, start, spring), (g, d), rtol=1e-14)
    near = at(1e-3, spring), at(1e-3 * (1.0 + 1e-13), spring)
    steep = build.plain(law.steepness)(1e-3, near[0].force, spring)
    assert_allclose(slopes(*near, spring), (near[0].force, steep), rtol=1e-12)  # without cancellation
    assert_allclose([each[0].energy for each in (near,)], 0.4e6 * 1e-3**2.5, rtol=HERTZ.misfit)


def test_it_is_a_law_as_any_other_also_in_a_map():
    over, how = {"speed": np.array([0.1, 0.4])}, {"at": None, "speed": 0.2}
    found, known = (fi.sweep(WALL, BALL, each, over=over, **how) for each in (HERTZ, fi.Contact.hertz(1e6)))
    assert_allclose(found.contact_time, known.contact_time, rtol=2e-3)  # twice the tolerance of a map
    assert HERTZ.special and not HERTZ.lossy and not HERTZ.remembers
    assert pickle.loads(pickle.dumps(HERTZ)) == HERTZ
    with pytest.raises(AttributeError, match="cannot assign"):
        HERTZ.misfit = 0.0


test_what_is_no_contact_law_is_refused_in_words = refusing([
    (3.0, "force must be a function of the approach, got 3.0"),
    (lambda d: 1.0 - d, "force must grow with the approach, got 0.999999 N at 1e-06 m and"),
    (lambda d: -1e3 * d, "force must be positive, as a contact only pushes, got"),
    (lambda d: d * np.nan, "force must be finite, got nan N at an approach of 1e-06 m"),
    (lambda d: np.zeros((2, 2)), r"force must return a force for each approach, \(24,\), got \(2, 2\)"),
    (lambda d: 1e4 * d + np.round(d / 1e-4), "within 1e-05, but near .*; give a larger tolerance or a smaller dee"),
    (lambda d: 1e4 * d * (1.5 + np.sin(3e5 * d)), "force must grow with the approach"),
], lambda force: fi.Contact.of(force, deepest=1e-3))  # fmt: skip


test_numbers_that_are_no_law_are_refused_in_words = refusing([
    (lambda: dataclasses.replace(HERTZ, stiffness=2e6), "stiffness and exponent must be those of the knots"),
    (lambda: fi.Contact(1e4, knots=((1e-3, 1.0, 1e3), (2e-3, 0.5, 1e3))),
     r"knots must be 2 to 96 rows .* that grow; use Contact.of"),
    (lambda: fi.strike(WALL, BALL, HERTZ, at=None, speed=5.0),  # deeper than the law is known
     r"deepest must be at .*, got 0.002 m; give Contact.of a larger one"),
])  # fmt: skip
