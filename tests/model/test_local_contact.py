import numpy as np
import pytest
from comparing import examined as found
from scipy.optimize import brentq
from scipy.special import spherical_jn

import fem_impact as fi
from fem_impact.model import local_contact

E, NU, RHO, YIELD = 210e9, 0.3, 7850.0, 1e9
STEEL = fi.Material(E=E, nu=NU, rho=RHO, yield_strength=YIELD)
R = 5e-3


def block(h=0.02, material=STEEL, n_modes=200):
    return fi.analytic.rectangle(0.3, 0.2, section=fi.Plate(material, h), n_modes=n_modes)


def drop(speed, h=0.02, material=STEEL, ball=STEEL, at=(0.12, 0.09), radius=R):
    sphere = fi.Striker.sphere(ball, radius)
    law = fi.Contact.between(sphere, fi.Plate(material, h))
    return fi.strike(block(h, material), sphere, law, at=at, speed=speed)


def first_yield():
    """Speed [m/s] of first yield on a half space; Johnson (1985), eq. 11.32: m v**2 / 2 = 53 R**3 Y**5 / E***4."""
    modulus = 0.5 * E / (1.0 - NU**2)
    mass = 4.0 / 3.0 * np.pi * R**3 * RHO
    return np.sqrt(2.0 * 53.0 * R**3 * YIELD**5 / modulus**4 / mass)


def test_a_ball_yields_at_johnsons_speed():
    # on a thick block, which hardly gives; his 53 is rounded, the formula of the pressure is his too
    speed = brentq(lambda v: found(drop(v, 0.2), "no yielding").value - 1.0, 0.05, 1.0, xtol=1e-3)
    assert speed == pytest.approx(first_yield(), rel=0.05)


def test_a_contact_as_wide_as_the_plate_is_thick_speaks_up():
    thick, thin = (found(drop(1.0, h), "local contact") for h in (0.05, 0.4e-3))
    assert thick.value < 0.05 and thin.value > 0.3
    # the middle of a half space under the load goes down by (1 + nu)(3 - 2 nu) F / (pi E h), Johnson, eq. 3.18
    hit = drop(1.0, 0.05)
    given = (1.0 + NU) * (3.0 - 2.0 * NU) / (np.pi * E * 0.05)
    stiffness = 1.5 * hit.contact.stiffness ** (2.0 / 3.0) * hit.peak_force ** (1.0 / 3.0)
    assert thick.effect["force"] == pytest.approx(given * stiffness * 0.4, rel=0.7)


def test_a_contact_at_the_edge_is_softer():
    inside, edge = (found(drop(0.5, at=(0.15, y)), "local contact") for y in (0.1, 2e-4))
    assert edge.value > 0.5 > inside.value and "distance to the edge" in edge.number


def test_a_large_soft_ball_struck_fast_is_not_quasi_static():
    small, large = (found(drop(0.5, radius=radius), "quasi-static contact") for radius in (2e-3, 2e-2))
    assert small.value == pytest.approx(large.value, rel=0.2)  # both times grow with the size of the ball
    slow, fast = (found(drop(speed), "quasi-static contact") for speed in (0.01, 20.0))
    assert fast.value / slow.value == pytest.approx(2000.0**0.2, rel=0.1)  # Hertz: time goes as speed**(-1/5)
    assert fast.worst > 5.0 * slow.worst


def test_radius_of_the_contact_is_hertzs_up_to_yield_and_that_of_the_cut_far_beyond():
    law = fi.Contact.elastic_plastic(1e10, yield_approach=1e-6)
    for approach, cut in ((0.5e-6, 1.0), (1e-6, 1.0), (1e-2, 2.0)):  # Johnson (1985), sections 4.2 and 6.3
        force = float(law.force(approach))
        radius = local_contact.contact_radius(law, R, force)
        assert radius == pytest.approx((R * cut * approach) ** 0.5, rel=2e-3 if cut > 1.0 else 1e-12)


SOFT = fi.Material(E=E, nu=NU, rho=RHO)  # of a strength that nobody stated


@pytest.mark.parametrize(("ball", "material"), [(SOFT, STEEL), (STEEL, SOFT), (SOFT, SOFT)])
def test_what_is_not_stated_is_not_known(ball, material):
    told = found(drop(0.5 * first_yield(), ball=ball, material=material), "no yielding")
    assert told.state == "not known" and set(told.effect.values()) == {None}


@pytest.mark.parametrize(("law", "names"), [
    (fi.Contact.hertz(1e10), ("no yielding", "local contact", "quasi-static contact")),  # of a head of unknown radius
    (fi.Contact.layers(1e7, 1.5, depth=1e-4, hard_stiffness=1e9), ("no yielding", "local contact")),
    (fi.Contact.felt(1e8, 1.5, hysteresis=0.4, relaxation=1e-3), ("no yielding", "local contact")),
], ids=["rigid", "layers", "felt"])  # fmt: skip
def test_a_contact_of_unknown_radius_is_not_known(law, names):
    striker = fi.Striker.rigid(0.004) if len(names) == 3 else fi.Striker.sphere(STEEL, R)
    hit = fi.strike(block(n_modes=50), striker, law, at=(0.12, 0.09), speed=1.0, tolerance=1e-2)
    assert {found(hit, name).state for name in names} == {"not known"}


def test_a_known_strength_that_is_exceeded_is_enough():
    told = found(drop(3.0, ball=SOFT), "no yielding")
    assert told.value > 1.0 and told.known and told.worst > 0.1


def test_below_yield_nothing_is_lost_and_above_the_restitution_falls():
    slow, fast = (found(drop(factor * first_yield(), 0.2), "no yielding") for factor in (0.8, 3.0))
    assert slow.worst == 0.0 and slow.known
    assert fast.effect["restitution"] == pytest.approx(1.0 - local_contact.restitution(1.0 / 3.0), rel=0.15)


def test_a_contact_that_yields_says_so_and_the_elastic_one_foretold_its_loss():
    ball, how = fi.Striker.sphere(STEEL, R), {"at": (0.12, 0.09), "speed": 2.0 * first_yield()}
    elastic, plastic = (
        fi.strike(block(0.2), ball, fi.Contact.between(ball, STEEL, yield_strength=given), **how)
        for given in (None, YIELD)
    )
    told = found(plastic, "no yielding")
    assert told.value is None and told.known and told.worst == 0.0 and not told.remedy
    true = elastic.restitution - plastic.restitution
    assert true / 3.0 < found(elastic, "no yielding").effect["restitution"] < 3.0 * true
    # a softer contact is wider under the same force, but its force is smaller
    wide, hard = (found(hit, "local contact").value for hit in (plastic, elastic))
    assert wide == pytest.approx(hard, rel=0.1)


def test_a_sphere_vibrates_as_lamb_says():
    ratio, n = np.sqrt((1.0 - 2.0 * 0.25) / (2.0 - 2.0 * 0.25)), 2  # of the two wave speeds, for nu = 0.25

    def free(x):
        """Tractions of the spheroidal mode n = 2 of an elastic sphere; Eringen and Suhubi (1975), Elastodynamics."""
        a, j = ratio * x, spherical_jn
        t11 = (n * n - n - 0.5 * x * x) * j(n, a) + 2.0 * a * j(n + 1, a)
        t13 = n * (n + 1) * ((n - 1) * j(n, x) - x * j(n + 1, x))
        t41 = (n - 1) * j(n, a) - a * j(n + 1, a)
        t43 = (n * n - 1.0 - 0.5 * x * x) * j(n, x) + x * j(n + 1, x)
        return t11 * t43 - t13 * t41

    assert brentq(free, 2.0, 3.2) == pytest.approx(local_contact.LAMB, abs=0.01)
