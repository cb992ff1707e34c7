"""The blow that most pictures, files and sounds are tested with."""

import pytest

import fem_impact as fi


@pytest.fixture(scope="session")
def modes():
    return fi.analytic.rectangle(0.465, 0.3, mass=0.2, first_frequency=100.0, n_modes=30, damping_ratio=0.005)


@pytest.fixture(scope="session")
def hit(modes):
    how = {"at": (0.1395, 0.09), "speed": 2.0, "tolerance": 1e-3}
    return fi.strike(modes, fi.Striker.rigid(0.03), fi.Contact.hertz(695e3), **how)


@pytest.fixture(scope="session")
def bar_hit():
    bar = fi.analytic.beam(0.35, ends=("free", "free"), mass=0.3, first_frequency=220.0, n_modes=12, damping_ratio=0.01)
    return fi.strike(bar, fi.Striker.rigid(0.03), fi.Contact.linear(1e5), at=0.17, speed=1.0, tolerance=1e-3)
