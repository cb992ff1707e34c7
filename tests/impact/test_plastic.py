"""The contact that yields: against books on its two ends, and against published finite elements in between."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.optimize import brentq

import fem_impact as fi
from fem_impact.impact.compiled import build, law
from fem_impact.impact.compiled.laws import plastic

STRENGTH, MODULUS, RADIUS = 1e9, 115e9, 5e-3  # [Pa], [Pa] plane strain, of both bodies; [m]
HERTZ = fi.Contact.hertz(4.0 / 3.0 * MODULUS * RADIUS**0.5)
FIRST = (0.5 * np.pi * 1.6 * STRENGTH / MODULUS) ** 2 * RADIUS  # [m] approach at a largest pressure of 1.6 Y
ROUND = fi.Contact.elastic_plastic(HERTZ.stiffness, yield_approach=FIRST)


def dented(contact, deepest):
    """Numbers of a contact that was pressed as deep."""
    row = law.table([contact.numbers])
    row["memory"][0] = deepest
    return row


def widths(approaches, contact=ROUND):
    return np.array([contact.law.wide(contact, x) for x in approaches])


def pressures(approaches):
    """Mean pressures [Pa] of the sphere."""
    return ROUND.force(approaches) / (np.pi * RADIUS * widths(approaches))


def test_it_begins_as_hertz_and_ends_as_tabor():
    """First yield at a mean pressure of 2/3 * 1.6 Y; far beyond it 2.8 Y on the area pi 2 R x (Johnson, 6.3)."""
    assert_allclose(pressures(np.array([FIRST])), 2.0 / 3.0 * 1.6 * STRENGTH, rtol=1e-12)
    deep = FIRST * np.array([1e4, 1e6])
    assert_allclose(pressures(deep), 2.8 * STRENGTH, rtol=1e-3)  # what is left falls as 1 over the approach
    assert_allclose(widths(deep), 2.0 * deep, rtol=2e-3)


def test_it_is_fully_plastic_where_johnson_says():
    """Mean pressure over a E / (R Y): 1.1 Y at 2.5 and some 3 Y at 30 to 40 (Johnson, 6.3); Tabor's 2.8 is the end."""
    approaches = np.geomspace(FIRST, 300.0 * FIRST, 400)
    strain = np.sqrt(RADIUS * widths(approaches)) * MODULUS / (RADIUS * STRENGTH)
    assert strain[0] == pytest.approx(2.5, rel=0.01)
    found = np.interp([30.0, 40.0], strain, pressures(approaches) / STRENGTH)
    assert (found > 0.94 * 2.8).all() and (found < 2.8).all()


def finite_elements():
    """Approaches, and force and area of Kogut and Etsion (2002), J. Appl. Mech. 69, 657, and of Jackson and Green
    (2005), J. Tribol. 127, 343, for nu = 0.3 and Y / E = 0.0068; all over those at first yield."""
    x = np.geomspace(1.001, 110.0, 4000)
    kogut = np.where(x <= 6.0, 1.03 * x**1.425, 1.40 * x**1.263)
    kogut_area = np.where(x <= 6.0, 0.93 * x**1.136, 0.94 * x**1.146)
    constant = 1.295 * np.exp(0.736 * 0.3)
    jackson = np.exp(-0.25 * x ** (5.0 / 12.0)) * x**1.5
    jackson += 4.0 * 2.84 / constant * (1.0 - np.exp(-(x ** (5.0 / 9.0)) / 25.0)) * x
    jackson_area = x * np.maximum(1.0, x / 1.9) ** (0.14 * np.exp(23.0 * 0.0068))
    return x, kogut, kogut_area, jackson, jackson_area


def taken(x, force):
    """Energy, as 2/5 at first yield."""
    return 0.4 + np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(x))])


def test_it_lies_near_published_finite_elements():
    """Elastic, ideally plastic spheres; the two sources differ by 7 % themselves."""
    x, kogut, kogut_area, jackson, jackson_area = finite_elements()
    force, area = ROUND.force(x * FIRST) / float(ROUND.force(FIRST)), widths(x * FIRST) / FIRST
    assert 0.08 < np.abs(force / kogut - 1.0).max() < 0.12
    assert 0.06 < np.abs(force / jackson - 1.0).max() < 0.10
    assert np.abs(area / kogut_area - 1.0)[x > 1.05].max() < 0.07  # theirs begins with 0.93
    energies = np.geomspace(1.0, 3e4, 200)  # 0.4 at first yield
    wide = np.interp(energies, taken(x, force), area)
    for theirs, their_area, rms in ((kogut, kogut_area, 0.006), (jackson, jackson_area, 0.009)):
        off = np.sqrt(wide / np.interp(energies, taken(x, theirs), their_area)) - 1.0  # of the radius
        assert 0.5 * rms < np.sqrt(np.mean(off**2)) < rms and np.abs(off).max() < 0.025
    # Etsion, Kligerman and Kadin (2005), Int. J. Solids Struct. 42, 3716: the dent after unloading
    deep = x[x > 3.0][::20]
    left = deep * (1.0 - deep**-0.28) * (1.0 - deep**-0.69)
    dents = [build.plain(law.dent)(law.table([ROUND.numbers]), 0, d * FIRST) / FIRST for d in deep]
    assert np.abs(dents / left - 1.0).max() < 0.20


def test_the_reach_is_the_one_nearest_to_finite_elements():
    """The largest differences of force from the two sources balance there: another would raise one of them."""
    x, kogut, *_ = finite_elements()

    def furthest(reach):
        u = x - 1.0
        ripe = u + reach * np.expm1(-u / reach)
        force = 1.0 + 1.5 * (u + 2.5 * ripe)
        return np.abs(np.log(force / kogut)).max()

    assert min((furthest(reach), reach) for reach in range(6, 20))[1] == pytest.approx(plastic.REACH, abs=1.0)


@pytest.mark.parametrize("exponent", [1.001, 1.05, 1.2, 1.5, 2.0, 4.0, 10.0])
def test_no_contact_that_yields_is_stiffer_than_one_that_does_not_or_gives_energy(exponent):
    yields = fi.Contact.elastic_plastic(1e8, exponent, yield_approach=1e-4)
    x = 1e-4 * np.geomspace(1.0001, 1e3, 400)
    assert (yields.force(x) <= 1e8 * x**exponent * (1.0 + 1e-12)).all()
    lost = np.array([build.plain(law.yielded_energy)(dented(yields, deepest)) for deepest in x])
    assert (np.diff(lost[x > 1.01e-4]) > 0.0).all()
    assert (lost / (1e8 * 1e-4 ** (exponent + 1.0)) > -1e-13).all()  # rounding


@pytest.mark.parametrize("exponent", [1.1, 1.5, 4.0, 100.0])
def test_approaches_are_found_from_force_and_energy(exponent):
    contact = fi.Contact.elastic_plastic(1e8, exponent, yield_approach=1.0)  # of 1 m, for an exponent of 100
    for x in (0.5, 1.01, 1.5, 30.0, 1e3 if exponent > 10.0 else 1e4):
        assert contact.law.approach(contact, float(contact.force(x))) == pytest.approx(x, rel=1e-12)
        energy = build.plain(law.point_at)(x, build.plain(law.spring_of)(law.table([contact.numbers]), 0)).energy
        stands = float(contact.law.acting(contact.numbers, 1.0, np.sqrt(2.0 * energy)))
        assert stands == pytest.approx((exponent + 1.0) * energy / x ** (exponent + 1.0), rel=1e-11 * exponent)


def wall(ratio):
    """Restitution of a mass on a wall for its speed over that of first yield, by integrating the force anew."""
    reach = plastic.REACH

    def force(x):
        u = max(x - 1.0, 0.0)
        return min(x, 1.0) ** 1.5 + 1.5 * (3.5 * u + 2.5 * reach * np.expm1(-u / reach))

    def work(x):
        return 0.4 + quad(force, 1.0, x, epsabs=0.0, epsrel=1e-12)[0]

    deepest = brentq(lambda x: work(x) - 0.4 * ratio**2, 1.0, 10.0 * ratio, xtol=1e-13)
    area = quad(lambda x: 2.0 - np.exp((1.0 - x) / reach), 1.0, deepest, epsabs=0.0, epsrel=1e-12)[0] + 1.0
    return np.sqrt(0.4 * force(deepest) ** 2 / area**0.5 / (0.4 * ratio**2))


@pytest.mark.parametrize("ratio", [1.1, 2.0, 16.0, 256.0])
def test_restitution_is_what_goes_in_and_comes_out(ratio):
    contact, how = fi.Contact.elastic_plastic(1e10, yield_speed=0.1, mass=0.02), {"residual": False, "tolerance": 1e-6}
    hit = fi.strike(fi.Modes.rigid(1e6), fi.Striker.rigid(0.02), contact, at=None, speed=0.1 * ratio, **how)
    assert hit.restitution == pytest.approx(wall(ratio), abs=1e-6)
    assert contact.law.rebound(contact, 0.01 * (0.1 * ratio) ** 2) == pytest.approx(wall(ratio), rel=1e-9)


def test_far_beyond_first_yield_restitution_is_johnsons():
    """Contact Mechanics, 11.5: a dent of radius a costs ``pi a**4 p / (4 R)``, of which ``3 F**2 / (10 E a)`` comes
    back; he neglects the elastic part. With p = 3 Y it is his ``3.8 (Y / E)**(1/2) (m V**2 / (2 Y R**3))**(-1/8)``."""

    def johnson(energy, pressure):
        radius = (4.0 * RADIUS * energy / (np.pi * pressure)) ** 0.25
        return np.sqrt(0.3 * (np.pi * radius**2 * pressure) ** 2 / (MODULUS * radius) / energy)

    energy = 1e6 * HERTZ.stiffness * FIRST**2.5
    rounded = 3.8 * np.sqrt(STRENGTH / MODULUS) * (energy / (STRENGTH * RADIUS**3)) ** -0.125
    assert johnson(energy, 3.0 * STRENGTH) == pytest.approx(rounded, rel=0.016)
    assert ROUND.law.rebound(ROUND, energy) == pytest.approx(johnson(energy, 2.8 * STRENGTH), rel=2e-3)


@pytest.mark.parametrize("exponent", [1.3, 1.5])
def test_slopes_keep_their_digits_for_any_two_approaches(exponent):
    """Average slopes from a dent on, over spans from 1e-12 of the reach to a hundred times it, against quadrature."""
    contact = fi.Contact.elastic_plastic(1e8, exponent, yield_approach=1e-5)
    row = dented(contact, 4e-5)  # kept while its spring is asked
    spring = build.plain(law.spring_of)(row, 0)
    node, weight = np.polynomial.legendre.leggauss(20)
    for start in (1e-9, 1e-5, 1e-3):
        for span in (1e-16, 1e-10, 1e-6, 1e-4):
            near, far = spring.corner + start, spring.corner + start + span
            x = near + 0.5 * (node + 1.0) * (far - near)
            forces = [build.plain(law.point_at)(each, spring).force for each in x]
            g, d = build.plain(plastic.slopes_beyond)(near, far, spring)
            assert_allclose(g, 0.5 * weight @ forces, rtol=1e-13)
            steep = [build.plain(plastic.slope_beyond)(each, spring) for each in x]
            assert_allclose(d, 0.5 * weight @ steep, rtol=1e-13)


def test_pressed_again_it_goes_on_where_it_was():
    """A dent made in two blows is that of one blow as deep: the force depends on the deepest approach alone."""
    row = law.table([ROUND.numbers])
    deep = 30.0 * FIRST
    build.plain(law.harden)(row, 0, 0.4 * deep)
    left = build.plain(law.dent)(row, 0, row["memory"][0])
    force = build.plain(law.point_at)(deep - left, build.plain(law.spring_of)(row, 0)).force
    assert force == pytest.approx(float(ROUND.force(deep)), rel=1e-13)


WALL = fi.Modes.rigid(1e6), 0.05, 1.0
LIGHT = fi.Modes.from_arrays([120.0], [[500.0]], points=[[0.0]], mass=3e-3, damping_ratio=0.0, complete=True), 8e-4, 0.1


@pytest.mark.parametrize(
    ("law", "blow", "rises"),
    [
        (fi.Contact.elastic_plastic(1e14, 3.0, yield_approach=1e-8), WALL, "at once where it is steepest"),
        (fi.Contact.elastic_plastic(1e65, 20.0, yield_approach=1e-8), WALL, "at once where it is steepest"),
        (fi.Contact.elastic_plastic(4.8e11, 3.0, yield_approach=1.5e-6), WALL, "at once where it is steepest"),
        (fi.Contact.elastic_plastic(7.6e6, 3.5, yield_approach=2e-5), LIGHT, "at once where it is steepest"),
        (fi.Contact.layers(1e3, 1.0, depth=1e-3, hard_stiffness=1e22, hard_exponent=1.0), WALL, "within 1.5e-09 s"),
    ],
    ids=["steep", "steepest", "back within 5e-8 of its depth", "on a body that bends", "on rock"],
)
def test_a_law_that_no_steps_can_follow_is_refused_at_once(law, blow, rises):
    """It took minutes, to end after 500 000 steps with the advice of a duration of 5e-53 s."""
    with pytest.raises(fi.SimulationError, match=f"steps cannot follow a force that acts for .* changes {rises}"):
        fi.strike(blow[0], fi.Striker.rigid(blow[1]), law, at=[0.0] * blow[0].dimension or None, speed=blow[2])
