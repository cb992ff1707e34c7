"""Energy and momentum of a blow: nothing is made, and what is lost is said by whom."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fem_impact as fi
from fem_impact.impact.balance import Balance, momentum_error


def blow(loss=0.0, damping_ratio=0.0):
    plate = fi.analytic.rectangle(1.55, 1.0, mass=0.2, first_frequency=100.0, n_modes=80, damping_ratio=damping_ratio)
    law = fi.Contact.power(1e6, 1.5, loss=loss)
    return fi.strike(plate, fi.Striker.rigid(0.02), law, at=(0.45, 0.3), speed=2.0, tolerance=1e-4, residual=False)


@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize("damping_ratio", [0.0, 0.02])
def test_what_modes_and_contacts_lose_is_missing_at_the_end(loss, damping_ratio):
    hit = blow(loss, damping_ratio)
    found = Balance.of(hit.history, hit.contacts)
    assert_allclose(found.start, 0.5 * 0.02 * 2.0**2, rtol=1e-14)  # the energy that arrives
    lost = found.dissipated
    assert (lost["modes"] > 0.0) == (damping_ratio > 0.0) and (lost["contact"] > 0.0) == (loss > 0.0)
    assert_allclose(found.start - found.end, sum(lost.values()), atol=1e-13 * found.start)
    assert found.error < 1e-12 and found.contact == 0.0  # rounding of some hundred steps


def test_energy_that_nothing_explains_is_an_error():
    hit = blow()
    h = hit.history
    faster = replace(h, end_p=1.01 * h.end_p)
    gained = 0.5 * float(faster.end_p @ faster.end_p - h.end_p @ h.end_p)
    found = Balance.of(faster, hit.contacts)
    assert_allclose(found.error, gained / found.largest, rtol=1e-9)
    assert_allclose(
        momentum_error(faster), 0.01 * abs(h.end_p[0]) / np.abs(h.impulses.sum() * h.shape[0, 0]), rtol=1e-9
    )
    assert momentum_error(h) < 1e-14


def test_a_body_that_stops_has_no_negative_restitution():
    """Two equal masses swap their speeds; what is left of the first one's is rounding of either sign."""
    touch = [fi.Touch(fi.Contact.linear(1e6), 0, 1)]
    hit = fi.collide([fi.Modes.rigid(0.1)] * 2, touch, speeds=[1.0, 0.0])
    assert abs(hit.restitution) < 1e-12 and "restitution 0.00000 at 1 m/s" in hit.summary()


def test_what_waves_carry_into_an_infinite_plate_is_not_called_lost():
    plate = fi.Plate(fi.Material(E=7e10, nu=0.23, rho=2500.0), 4e-3)
    pane = fi.assemble(fi.mesh.rectangle(1.2, 0.8), plate, {"boundary": "clamped"})
    hit = fi.plan(pane, fi.Striker.rigid(4e-3), fi.Contact.hertz(1e10), at=(0.6, 0.4), speed=1.0, tolerance=0.01,
                  target="infinite").strike()  # fmt: skip
    assert "target 0.00%, contact 0.00%, carried off by waves or dissipated " in hit.summary()
    assert "contact 0.00%, dissipated 0.00%" in blow().summary()


HEAVIER, FREE = (
    fi.Modes.rigid(0.3),
    fi.analytic.beam(0.3, ends=("free", "free"), mass=0.1, n_modes=6, first_frequency=800.0),
)
LINEAR = fi.Contact.linear(1e5)


def test_speeds_count_from_the_first_body_of_a_touch_also_if_it_is_the_later_one():
    """They had the other sign, and the restitution with them: -0.5."""
    first, second = ([fi.Touch(LINEAR, *bodies)] for bodies in ((0, 1), (1, 0)))
    hits = [
        fi.collide([fi.Modes.rigid(0.1), HEAVIER], touch, speeds=[speed, 0.0])
        for touch, speed in ((first, 1.0), (second, -1.0))
    ]
    assert_allclose([hit.restitution for hit in hits], 0.5, rtol=1e-12)  # (0.3 - 0.1) / (0.3 + 0.1)
    assert_allclose(hits[1].speeds, [0.5, -0.5], rtol=1e-12)
    assert_allclose(hits[1].striker_speeds, [[-1.0, 0.5]], rtol=1e-12)


def test_a_body_whose_first_contact_is_with_itself_has_a_speed():
    """Its rigid motion does not press that contact: speed and restitution were zero."""
    own, wall = fi.Touch(fi.Contact.linear(1e5, gap=0.1), 0, 0, 0.1, 0.25), fi.Touch(LINEAR, 0, None, 0.15)
    hit, other = (fi.collide([FREE], touches, speeds=[1.0], residual=False) for touches in ([own, wall], [wall, own]))
    assert_allclose([hit.restitution, -hit.speeds[0]], other.restitution, rtol=1e-12)
    assert other.restitution > 0.9


def test_a_first_body_that_stands_has_no_restitution():
    """It was given the speed it gets over that of the body that hits it."""
    hit = fi.collide([HEAVIER, fi.Modes.rigid(0.1)], [fi.Touch(LINEAR, 0, 1)], speeds=[0.0, -1.0])
    assert_allclose(hit.speeds, [-0.5, 0.5], rtol=1e-12)
    assert hit.restitution is None and "restitution none, the first body did not arrive at -1 m/s" in hit.summary()
