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
